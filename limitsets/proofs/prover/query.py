"""One query: whether goals hold for all of a box of scenes and every noise; worst orbits; the weakest of claims.

Cells are refined where needed: first some hundreds a side, then borders spread evenly over the attracting cells.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.goals import Goal, Reaches
from limitsets.feeder.scene import Scene, load
from limitsets.proofs.prover.attraction import Attraction, attraction
from limitsets.proofs.prover.cover import cover
from limitsets.proofs.prover.from_foot import FromFoot, is_nearly_all, starts_from_foot
from limitsets.proofs.prover.goals import Answer, cuts, prove, prove_or_refute
from limitsets.proofs.prover.goals.kind import against, undecided
from limitsets.proofs.prover.goals.laid_starts import laid_only, narrowed, starts_in
from limitsets.proofs.prover.goals.reaches import falls_short
from limitsets.proofs.prover.goals.recurrent_orbits import Refutation, closed
from limitsets.proofs.prover.goals.violating_orbits import (
    Path,
    ReachedStates,
    ThrowChoice,
    Wrong,
    on_limit_set,
    throw_choices,
    throws,
    violation,
)
from limitsets.proofs.prover.parameters import ParameterBox, parameter_box
from limitsets.proofs.prover.proof import Claim
from limitsets.proofs.prover.tolerances import SceneBox
from limitsets.systems.graph.images.enclosed import least_known
from limitsets.systems.maps import Orbit, orbit

# ----------------------------------------------------------------
# Worst-case orbits: a goal is violated by choosing the disturbance at every throw.
#
# Random throws miss them, and a forward search with one state per cell misses small violations.  The search is
# therefore backward reachability on a fine raster: places from which one throw can violate the goal, from which two
# can, and so on; then forward from a long orbit without noise that meets such a place, with every throw computed
# anew.


# Places of the raster, values of kappa at a throw, throws back from the violation, throws of the orbit, states kept.
PLACES, KAPPAS, BACK, LENGTH, KEPT = 120_000, 9, 4, 200_000, 4000

# Throws of the long orbit before the noise begins: the closed orbit may begin at each of them.
BEFORE = 12


class _Raster:
    """Places evenly over the attracting cells, and the nearest of them to any place."""

    def __init__(self, attractors: Attraction) -> None:
        extents = attractors.cells.extents()
        total = sum(hi - lo for parts in extents.values() for lo, hi in parts)
        self.step = total / PLACES
        spans = {side: (parts[0][0], parts[-1][1]) for side, parts in extents.items() if parts}
        rows = [np.arange(lo, hi + self.step, self.step) for lo, hi in spans.values()]
        sizes = [row.size for row in rows]
        self.low = {side: lo for side, (lo, _) in spans.items()}
        self.first = dict(zip(spans, np.cumsum([0, *sizes[:-1]]).tolist(), strict=True))
        self.x, self.side = np.concatenate(rows), np.repeat([*spans], sizes)

    def nearest(self, x: Array, side: Ints) -> Ints:
        """Return the number of the nearest place; -1 where there is none."""
        nearest = np.full(x.size, -1)
        for s, first in self.first.items():
            mine = np.flatnonzero(side == s)
            number = first + np.rint((x[mine] - self.low[s]) / self.step).astype(np.int64)
            last = first + int((self.side == s).sum())
            nearest[mine] = np.where((number >= first) & (number < last), number, -1)
        return nearest


def _beside(mask: Mask) -> Mask:
    """Add the neighbours."""
    wide = mask.copy()
    wide[1:] |= mask[:-1]
    wide[:-1] |= mask[1:]
    return wide


def worst_orbit(attractors: Attraction, wrong: Wrong) -> Refutation:
    """Find a closed orbit that violates a goal, with the noise chosen at every throw, and prove it.

    Parameters
    ----------
    attractors : Attraction
        Cells and images, of a box of parameters with noise.
    wrong : callable
        From places and sides to whether each violates the goal.

    Returns
    -------
    Refutation
        Empty if none is found.
    """
    box, options = attractors.cover.box, throw_choices(attractors.cover.box, KAPPAS)
    raster = _Raster(attractors)
    start, on = on_limit_set(attractors)
    path = orbit(box.at_kappa(box.middle_kappa), start, on, LENGTH)
    here = raster.nearest(path.x, path.side)
    levels = [_beside(wrong(raster.x, raster.side))]
    known = np.zeros(raster.x.size, dtype=bool)
    for back in range(1, BACK + 1):
        left = np.flatnonzero(~known)
        thrown = throws(box, raster.x[left], raster.side[left], options)
        to = raster.nearest(thrown.x, thrown.side)
        hit = (to >= 0) & thrown.stays & levels[-1][to]
        good = np.zeros(raster.x.size, dtype=bool)
        good[left[thrown.state[hit]]] = True
        levels.append(_beside(good))
        known |= good
        begin = np.flatnonzero((here >= 0) & levels[back][here])
        begin = begin[begin >= BEFORE][:KEPT]
        refutation = _followed(
            attractors, wrong, raster, levels=levels, path=path, begin=begin, options=options
        )
        if refutation.states:
            return refutation
    return Refutation()


def _followed(
    attractors: Attraction,
    wrong: Wrong,
    raster: _Raster,
    levels: list[Mask],
    path: Orbit,
    begin: Ints,
    options: list[ThrowChoice],
) -> Refutation:
    """Throw on from states of the long orbit along the levels, and close and prove what then violates the goal."""
    if not begin.size:
        return Refutation()
    reached = ReachedStates.of(path.x[begin], path.side[begin].astype(np.int64))
    for back, level in reversed(list(enumerate(levels[:-1]))):
        thrown = throws(attractors.cover.box, reached.x[-1], reached.side[-1], options)
        if back == 0:
            keep = violation(thrown, wrong)
        else:
            to = raster.nearest(thrown.x, thrown.side)
            keep = np.flatnonzero((to >= 0) & level[to] & thrown.stays)
            keep = keep[:: max(1, keep.size // KEPT)]
        if not keep.size:
            return Refutation()
        reached.add(thrown, keep)
    tail = reached.path(0, options)
    same = (path.x[begin] == tail.x[0]) & (path.side[begin] == tail.side[0])
    first = int(begin[np.flatnonzero(same)[0]])
    before = slice(first - BEFORE, first)
    usual = ThrowChoice(attractors.cover.box.middle_kappa, 0.0)
    whole = Path(
        [*path.x[before].tolist(), *tail.x],
        [*path.side[before].tolist(), *tail.side],
        [*([usual] * BEFORE), *tail.thrown],
    )
    return closed(attractors.cover.box, whole, wrong)


# ----------------------------------------------------------------
# One claim of all pieces of a tolerance, from those of each: the weakest numbers, for the fewest starts.


# The words for the starts of a goal, from the most starts to the fewest.
STARTS = ("every", "within", "almost-every", "from", "from_foot", "cells")


def weakest_of(claims: Sequence[Claim], attractions: Sequence[Attraction]) -> Claim:
    """Join one claim, proved on every piece by its cells: with the weakest of the numbers, for the fewest starts."""
    sections = [claim.section for claim in claims]
    section = _weakest_numbers(sections)
    if claims[0].starts is None:
        return Claim(claims[0].claim, "proved", "", section)
    words = [one.starts if isinstance(one.starts, str) else next(iter(one.starts)) for one in claims]
    weakest = max(zip(words, claims, strict=True), key=lambda each: STARTS.index(each[0]))[1]
    starts = weakest.starts
    section.pop("lost", None)
    most, whole = [claim.shares for claim in claims], True
    if isinstance(starts, dict) and "from" in starts:
        starts, places, most, whole = _from_farthest(section, claims, attractions)
    elif isinstance(starts, dict) and "from_foot" in starts:
        starts, places, most, whole = _from_foot(attractions)
    else:
        places = {"starts": weakest.section["starts"]}
    section |= places
    least = {"share": min, "leaves": min, "creeps": min, "open": max}
    shares = {key: pick(each[key] for each in most) for key, pick in least.items()}
    notes = {claim.note for claim in claims}
    note = notes.pop() if len(notes) == 1 else ""
    claim = replace(weakest, section=section, counterexample=(), starts=starts, shares=shares, note=note)
    if whole:
        return claim
    share = math.ceil(1000.0 * shares["open"]) / 10.0
    reason = (
        "each value is proved alone, but near the joint starts that come out at one value may stay behind at another:"
        f" of {share:g} % of the starts the same is not proved for all, and 1 % may be"
    )
    return replace(claim, verdict="proved-on-cells", reason=reason)


def _weakest_numbers(sections: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Join the sections of one claim: the largest counts, the least slope, the least expansion near the joint."""
    section = dict(sections[0])
    near = [other["near_joint"] for other in sections if "near_joint" in other]
    section.pop("near_joint", None)
    if len(near) == len(sections):
        section["near_joint"] = {side: _weakest([other[side] for other in near]) for side in near[0]}
    for count in ("max_rank", "throws", "jogs", "thinning"):
        counts = [other[count] for other in sections if count in other]
        if counts:
            section[count] = max(counts)
    if "least_slope" in section:
        section["least_slope"] = min((other["least_slope"] for other in sections), key=float.fromhex)
    return section


Joined: TypeAlias = tuple[Any, dict[str, Any], list[dict[str, float]], bool]
"""Starts, the entries that name their places, shares in each piece, and whether the goal counts as proved of them."""


def _from_farthest(
    section: Mapping[str, Any], claims: Sequence[Claim], attractions: Sequence[Attraction]
) -> Joined:
    """Join starts from some x on."""
    starts = _farthest_start(claims, attractions, below_cells="near_joint" in section)
    places: dict[str, Any] = {"starts": {"from": {side: x.hex() for side, x in starts.items()}}}
    lost = [claim.section["lost"] for claim in claims if "lost" in claim.section]
    if len(lost) == len(claims):
        places["lost"] = {side: min((each[side] for each in lost), key=float.fromhex) for side in lost[0]}
    most, whole = zip(*(one.shares_from({**section, **places}) for one in attractions), strict=True)
    return {"from": starts}, places, list(most), all(whole)


def _from_foot(attractions: Sequence[Attraction]) -> Joined:
    """Join starts from some distance to the foot on."""
    feet = [starts_from_foot(one) for one in attractions]
    joined = FromFoot.of_all([one for one in feet if one is not None])
    most = [joined.shares_of(one) for one in attractions]
    return joined.starts, joined.section, most, None not in feet and all(map(is_nearly_all, most))


def _farthest_start(
    claims: Sequence[Claim], attractions: Sequence[Attraction], *, below_cells: bool
) -> dict[str, float]:
    """Return by side from where on the goal holds on all pieces; only on their cells, unless `below_cells` too."""
    given = [claim.starts["from"] for claim in claims if isinstance(claim.starts, dict)]
    if not below_cells:
        given += [
            {side: float(one.cover.grid.edges[int(side)][0][0]) for side in given[0]} for one in attractions
        ]
    return {side: max(each[side] for each in given) for side in given[0]}


def _weakest(near: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Near the joint on one side of every piece: the least factor, and a bracket of all fixed points."""
    joined: dict[str, Any] = {"q": min((each["q"] for each in near), key=float.fromhex)}
    if "fixed_point" in near[0]:  # or in none of them: h = 0 would lie in a piece between
        ends = [each["fixed_point"] for each in near]
        lowest, highest = (lo for lo, _ in ends), (hi for _, hi in ends)
        joined["fixed_point"] = [min(lowest, key=float.fromhex), max(highest, key=float.fromhex)]
    return joined


# ----------------------------------------------------------------
# One query: whether goals hold for all of a box of scenes, and every sequence of throws with some noise.


# Cells per side to begin with, then borders over all that attracts, and pieces of a parameter where a cell is open to
# both decisions; more cells to begin with where nothing attracts.
BASE, FINE, PIECES = 512, (0, 4000, 16_000, 32_000), (8, 32, 128, 512)
BASES = (512, 2048, 8192)

# For goals about every start: cells per side, as no part of the arm matters more than the others.
LADDER = (512, 2048, 8192, 32_768)


@dataclass(frozen=True, eq=False)
class Outcome:
    """The verdict on the goals for one box of scenes.

    Attributes
    ----------
    verdict : str
        "proved" (all goals), "refuted" (one of them), "undecided", or "impossible" (no such scene, or no part of it).
    reason : str
        Why it is not proved.
    found : Attraction or None
        The cells that prove it.
    answers : tuple of Answer
        One per goal, where all are proved; what refutes one, where one is refuted.
    refuted : Goal or None
        The goal that is refuted.
    counterexample : tuple of State
        The orbit that does it.
    piece : SceneBox or None
        The scenes of the query; None for the scene as it is.
    noise : dict of str to str
        The noise.
    within : dict of str to str
        Bounds, by quantity, of the deviations of the single scene that refutes.
    """

    verdict: str
    reason: str = ""
    found: Attraction | None = None
    answers: tuple[Answer, ...] = ()
    refuted: Goal | None = None
    counterexample: tuple[Any, ...] = ()
    piece: SceneBox | None = None
    noise: Mapping[str, str] = field(default_factory=dict)
    within: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Query:
    """Some goals of a scene: all have to hold.

    Attributes
    ----------
    scene : Scene
        The scene.
    goals : tuple of Goal
        What is asked.
    """

    scene: Scene
    goals: tuple[Goal, ...]

    @classmethod
    def of(cls, scene: Scene, goals: tuple[Goal, ...]) -> Query:
        """Ask goals of a scene without its own goal and scatter.

        A certificate then names the goals of the query; and in a margin no quantity deviates but those of the query.
        """
        tree = scene.as_dict()
        tree.pop("goal", None)
        tree.get("effects", {}).pop("spread", None)
        return cls(load(tree), goals)

    @property
    def anywhere(self) -> bool:
        """Whether some goal is about every start on the arm."""
        return any(goal.from_anywhere or goal.of_every_start for goal in self.goals)

    def unjoined(self, pieces: Sequence[Outcome]) -> str:
        """Say why pieces do not prove the goals together, in one certificate; empty if they do."""
        missing = [piece.reason for piece in pieces if piece.verdict != "proved"]
        missing = missing or [claim.reason for claim in joined_claims(pieces) if claim.verdict != "proved"]
        return missing[0] if missing else ""

    def box(self, piece: SceneBox | None, noise: Mapping[str, str]) -> ParameterBox:
        """Enclose the parameters."""
        return parameter_box(self.scene, tree=None if piece is None else piece.tree(), noise=dict(noise))

    def prove(
        self,
        piece: SceneBox | None = None,
        noise: Mapping[str, str] | None = None,
        finest: int = 3,
        bases: int = len(BASES),
    ) -> Outcome:
        """Prove the goals, with finer and finer cells; or say what is missing.

        Parameters
        ----------
        piece : SceneBox, optional
            Scenes, all at once: cells as if the quantities differed at every throw.
        noise : mapping of str to str, optional
            What differs at every throw.
        finest : int
            Refinements, up to 3.
        bases : int
            Numbers of cells to begin with that are tried where nothing attracts, up to 3.
        """
        noise = dict(noise or {})
        try:
            box = self.box(piece, noise)
            for base in BASES[:1] if self.anywhere else BASES:
                coarse = self._coarse(box, bases, base)
                attractors, answers = self._refined(coarse, box, finest, base)
                missing = answers[-1]
                if missing.verdict == "proved":
                    return Outcome("proved", "", attractors, answers, piece=piece, noise=noise)
                # finer cells off the attracting ones are needed only for starts that are not proved to reach these
                if missing.final or missing.verdict != "proved-on-cells":
                    break
        except AnswerError as error:
            return Outcome("impossible", _said(error), piece=piece, noise=noise)
        reason = missing.reason
        if missing.verdict == "proved-on-cells":
            share = 100.0 * missing.shares["share"]
            laid = " laid down" if any(goal.laid for goal in self.goals) else ""
            reason = f"the goal is proved for {math.floor(10.0 * share) / 10.0:g} % of the starts{laid} only: {reason}"
        if not (attractors.component >= 0).any():
            reason = f"{reason}: from some of them, parts may leave the arm"
        return Outcome("undecided", reason, attractors, piece=piece, noise=noise)

    def _refined(
        self, attractors: Attraction, box: ParameterBox, finest: int, base: int
    ) -> tuple[Attraction, tuple[Answer, ...]]:
        """Refine what attracts until the goals are proved, or finer cells cannot do it."""
        # the cells of other starts stay as they are: only pieces of a parameter help these, last of all
        cut = self.anywhere or (base == BASES[-1] and least_known(box.lo, box.hi) is not None)
        for step in range(finest + 1):
            if step:
                attractors = self._finer(attractors, box, step, base)
            answers = self._each(attractors)
            missing = answers[-1]
            settled = missing.final or (missing.verdict == "proved-on-cells" and not cut)
            if missing.verdict == "proved" or settled or not (attractors.component >= 0).any():
                break
        return attractors, answers

    def _each(self, attractors: Attraction) -> tuple[Answer, ...]:
        """Prove one goal after the other, up to the first that is not proved, which comes last."""
        answers: list[Answer] = []
        for goal in self.goals:
            answers.append(prove(attractors, self.scene, goal))
            if answers[-1].verdict != "proved":
                break
        return tuple(answers)

    def cells(self, piece: SceneBox | None, step: int) -> Attraction:
        """Return the cells of one refinement, whatever they prove."""
        box = self.box(piece, {})
        return self._finer(self._coarse(box), box, step)

    def _coarse(self, box: ParameterBox, bases: int = len(BASES), base: int = BASE) -> Attraction:
        for cells in (base, *(more for more in BASES[:bases] if more > base)):
            attractors = attraction(cover(box, cells, cuts(self.goals, box.lo.a.size), PIECES[0]))
            if (attractors.component >= 0).any():
                break
        return attractors

    def _finer(self, attractors: Attraction, box: ParameterBox, step: int, base: int = BASE) -> Attraction:
        """Cut what attracts into more cells; or everything, where a goal is about every start."""
        borders = cuts(self.goals, box.lo.a.size)
        if self.anywhere:
            return attraction(cover(box, LADDER[step], borders, PIECES[step]))
        extents = attractors.cells.extents()
        total = sum(hi - lo for parts in extents.values() for lo, hi in parts)
        for side, parts in extents.items():
            for lo, hi in parts:
                count = max(2, round(FINE[step] * (hi - lo) / total))
                borders[side] = [*borders[side], *np.linspace(lo, hi, count).tolist()]
        return attraction(cover(box, base, borders, PIECES[step]))

    def refute(self, piece: SceneBox | None = None, noise: Mapping[str, str] | None = None) -> Outcome:
        """Search for an orbit of one scene that violates one of the goals.

        Parameters
        ----------
        piece : SceneBox, optional
            The scene, each quantity known but for the last digits.
        noise : mapping of str to str, optional
            What differs at every throw, chosen by the search.
        """
        noise = dict(noise or {})
        reason = "no orbit is found that violates it"
        try:
            box = self.box(piece, noise)
            attractors = self._coarse(box)
        except AnswerError as error:
            return Outcome("impossible", _said(error), piece=piece, noise=noise)
        for goal in self.goals:
            answer = self._against(attractors, goal)
            if answer.verdict == "refuted":
                return Outcome(
                    "refuted",
                    answer.reason,
                    attractors,
                    answers=(answer,),
                    refuted=goal,
                    counterexample=answer.counterexample,
                    piece=piece,
                    noise=noise,
                )
            reason = answer.reason or reason
        return Outcome("undecided", reason, attractors, piece=piece, noise=noise)

    def _against(self, attractors: Attraction, goal: Goal) -> Answer:
        """Search for an orbit that refutes one goal: with noise, for the worst sequence of throws."""
        wrong = goal.wrong()
        if isinstance(goal, Reaches) and not goal.every_orbit:
            # the ends of the attracting cells refute it; the search for an attracting cycle would take too long here
            finer = self._finer(attractors, attractors.cover.box, 2)
            finer = narrowed(finer, starts_in(finer, goal.laid)[0]) if goal.laid else finer
            return laid_only(falls_short(finer, goal) or undecided(""), finer, goal.laid)
        if wrong is None or not attractors.cover.box.noise or goal.from_anywhere:
            return prove_or_refute(attractors, self.scene, goal)
        answer = prove(attractors, self.scene, goal)
        attractors = narrowed(attractors, starts_in(attractors, goal.laid)[0]) if goal.laid else attractors
        if not (attractors.component >= 0).any():
            return answer
        return laid_only(against(worst_orbit(attractors, wrong), answer.reason), attractors, goal.laid)


def joined_claims(pieces: Sequence[Outcome]) -> tuple[Claim, ...]:
    """Join what is proved of several pieces: one claim for each goal, of the starts for which all of them prove it."""
    attractions = [piece.found for piece in pieces if piece.found is not None]
    claims = [
        [
            Claim("goal", "proved", "", dict(one.section), starts=one.starts, shares=dict(one.shares))
            for one in piece.answers
        ]
        for piece in pieces
    ]
    return tuple(weakest_of(of_goal, attractions) for of_goal in zip(*claims, strict=True))


def _said(error: AnswerError) -> str:
    """Say why there is no such scene."""
    value = f"{error.value:.6g}" if isinstance(error.value, float) else error.value
    return f"there is no such part or throw: {error.thing} is {value}; it has to be {error.allowed}"
