"""What was proved of a scene, or refuted by an orbit: the claims, their certificates, and their tables for JSON."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from limitsets.base import AnswerError, Column, Table, as_table, bands_of, picked, rounded
from limitsets.feeder.goals import Goal, Laid, by_side
from limitsets.feeder.scene import Model, Scene
from limitsets.feeder.scene.quantities import text_at, texts
from limitsets.feeder.scene.units import convert, parse
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.averages import Average, rows_of
from limitsets.proofs.prover.certificate import Saved, require_proved, write
from limitsets.proofs.prover.end_points import union_of
from limitsets.proofs.prover.entropies import Entropy
from limitsets.proofs.prover.goals import State, hexed, rechecked
from limitsets.proofs.prover.tolerances import whole

# ----------------------------------------------------------------
# Writing an orbit that refutes a goal, so that it can be checked independently.
#
# A certificate with the one claim "refuted": the goal; an orbit that comes back, or that refutes by one passage; and
# within which deviations of which nominal values the scene lies.  The scene's cells are in the file as in every other.


KINDS = ("cycle", "closed", "once")
"""Why an orbit refutes, where a certificate can say it."""


def _nominal(scene: Scene, name: str) -> str:
    by_kappa = name == "throw.speed" and "kappa" in scene.text["throw"]
    return str(text_at(scene.text, "throw.kappa" if by_kappa else name))


def _goal(goal: Goal, scene: Scene) -> dict[str, Any]:
    words: dict[str, Any] = {"kind": goal.kind} | asdict(goal)
    if words.pop("laid", ()):
        words["starts"] = {"within": hexed(goal.laid)}
    if "x" in words:
        words["x"] = f"{words['x']!r} {scene.unit}"
    if "order" in words:
        words["order"] = list(words["order"])
    return words


def thrown_orbit(states: Sequence[State], recurs: Mapping[str, Any], varies: bool) -> dict[str, Any]:
    """Give the start and the throws, of a closed orbit from its exact state on."""
    states = list(states)
    throws = [
        {
            "kappa": float(state.kappa).hex() if varies and state.kappa is not None else None,
            "landing": float(state.landing).hex() if state.landing else None,
        }
        for state in states[:-1]
    ]
    first = 0
    if "closed" in recurs:
        first = next(k for k, state in enumerate(states) if state.lo == state.hi)
        throws = [*throws[first:], *throws[:first]]
        throws[-1] = {"kappa": recurs.get("kappa", throws[-1]["kappa"]), "landing": None}
    return {"start": {"x": float(states[first].lo).hex(), "side": states[first].side}, "throws": throws}


def write_refutation(
    path: str | Path,
    attraction: Attraction,
    goal: Goal,
    states: Sequence[State],
    recurs: Mapping[str, Any],
    within: Mapping[str, str],
    scene: Scene,
    *,
    recheck: bool = True,
) -> None:
    """Write it, replacing an older file whole; it gets its name once the checker has confirmed it.

    Parameters
    ----------
    path : str or Path
        The file.
    attraction : Attraction
        The cells, of the scene that refutes and its noise.
    goal : Goal
        What is refuted.
    states : sequence of State
        The orbit.
    recurs : mapping
        Why it refutes: `limitsets.proofs.prover.goals.recurrent_orbits.Refutation`.
    within : mapping of str to str
        Deviations from the nominal scene that its own do not exceed, by quantity.
    scene : Scene
        The nominal scene.
    recheck : bool
        Whether to check it first.

    Raises
    ------
    AnswerError
        A goal that the checker does not know, or an orbit that no certificate can show.
    """
    kind = next((word for word in KINDS if word in recurs), None)
    if not rechecked(goal) or kind is None:
        raise AnswerError(
            "the refutation",
            goal.kind,
            "by an orbit that comes back, of a goal that the checker knows",
            "leave it",
        )
    box = attraction.cover.box
    section = {
        "goal": _goal(goal, scene),
        "recurs": {kind: recurs[kind]},
        "nominal": {name: _nominal(scene, name) for name in within},
        "tolerance": dict(within),
    }
    if kind != "cycle":
        section |= thrown_orbit(states, recurs, box.kappa_varies)
    write(
        path,
        [attraction],
        [{"claim": "refuted", "section": section, "verdict": "refuted"}],
        noise=box.noise or None,
        tolerance=None,
        recheck=recheck,
    )


# ----------------------------------------------------------------
# What was proved of a scene: the claims, their certificate, and their tables for JSON.


def require_checkable(effects: Sequence[str], goals: Iterable[Goal | None], stands: str) -> None:
    """Refuse what no certificate can hold: effects beyond a spread, and goals that the checker does not know.

    `stands` says where what is proved is to be read instead.
    """
    if effects:
        raise AnswerError(
            "the certificate",
            f"with the effects {', '.join(effects)}",
            "the minimal model, and noise",
            f"nothing rechecks other maps; {stands}",
        )
    for goal in goals:
        if goal is not None and not rechecked(goal):
            raise AnswerError(
                "the certificate",
                f"of the goal {goal.kind}",
                "goals that the checker knows",
                f"nothing rechecks others; {stands}",
            )


SHARES = ("share", "leaves", "creeps", "open")


@dataclass(frozen=True)
class Claim:
    """One claim and its verdict.

    Attributes
    ----------
    claim : str
        A word of `CLAIMS`.
    verdict : str
        "proved", "refuted" or "undecided"; of a goal also "proved-on-cells", for the starts in some cells only.
    reason : str
        Why it is not proved: what is missing and where; empty if it is.
    section : dict
        The numbers that a recheck needs; empty if nothing is proved.
    counterexample : tuple of State
        An orbit that refutes the claim; empty if there is none.
    fixed : dict of str to list of str
        The counterexample's values of what is fixed but unknown, as pairs of texts.
    final : bool
        Whether finer cells cannot change the verdict.
    starts : str, dict or None
        Of a goal that is proved, for which starts: "every", "almost-every", ``{"from": {"0": x}}``,
        ``{"from_foot": {"0": y}}`` for those with x - a_0 > y, ``{"within": {"0": [[lo, hi]]}}`` where parts are laid
        down, or "cells"; of one that is refuted, of which starts it is not true.  None for other claims.
    shares : dict of str to float
        Of a goal that is proved: shares of the arm for whose starts it is (`share`), whose starts are proved to leave
        (`leaves`) or to creep to the joint (`creeps`), and of whose starts nothing is proved (`open`); shares of where
        parts are laid down, if that is given.
    note : str
        What a reader of a proved goal should know, empty if nothing.
    recurs : dict
        Why the orbit that refutes comes back, or that it need not: as in
        `limitsets.proofs.prover.goals.recurrent_orbits.Refutation`.
    """

    claim: str
    verdict: str
    reason: str
    section: dict[str, Any]
    counterexample: tuple[State, ...] = ()
    fixed: dict[str, list[str]] = field(default_factory=dict)
    final: bool = False
    starts: Any = None
    shares: dict[str, float] = field(default_factory=dict)
    note: str = ""
    recurs: dict[str, Any] = field(default_factory=dict)

    @property
    def written(self) -> bool:
        """Whether a certificate may hold it."""
        return self.verdict in ("proved", "proved-on-cells")

    @property
    def jog_fixed_points(self) -> dict[str, list[float]] | None:
        """Brackets of the jog's unstable fixed point by side, where the claim rests on them."""
        near = self.section.get("near_joint", {})
        brackets = {
            side: [float.fromhex(end) for end in each.get("fixed_point", ())] for side, each in near.items()
        }
        return brackets if brackets and all(brackets.values()) else None


def undecided(word: str, reason: str, *, final: bool = False) -> Claim:
    """Leave a claim open, for a reason; `final` where smaller boxes would not help."""
    return Claim(word, "undecided", reason, {}, final=final)


def claimed(word: str, missing: str, section: Mapping[str, Any] | None = None) -> Claim:
    """Claim a word as proved, by the numbers of its section; undecided where something is missing."""
    return undecided(word, missing) if missing else Claim(word, "proved", "", dict(section or {}))


def _starts(starts: Any) -> str | None:
    """Write for which starts a goal is proved."""
    if not isinstance(starts, dict):
        return None if starts is None else str(starts)
    if "within" in starts:
        spans = [(side, pair) for side, pairs in starts["within"].items() for pair in pairs]
        x = Column("x", show=".6g", ends=True, inward=True)
        return "within " + ", ".join(f"x = {x.text(pair)} on side {side}" for side, pair in spans)
    ((word, places),) = starts.items()
    foot = " - a_{}" if word == "from_foot" else ""
    first = {side: rounded(x, ".6g", up=True) for side, x in places.items()}
    return "from " + ", ".join(f"x{foot.format(side)} = {x} on side {side}" for side, x in first.items())


@dataclass(frozen=True, eq=False)
class Proof(Saved):
    """What was proved of a scene.

    Attributes
    ----------
    scene : Scene
        The scene.
    noise, tolerance : dict of str to str
        What may differ at every throw, and what is fixed but unknown, and by how much.
    attractions : tuple of Attraction
        Cells, images, ranks; one for each box into which a tolerance was cut.
    claims : tuple of Claim
        One per claim asked for.
    seconds : float
        Time it took.
    average : Average or None
        If `limitsets.average` was asked: the bounds, and the numbers that prove them.
    entropy : Entropy or None
        If `limitsets.entropy` was asked: likewise, and the sampled number.
    """

    scene: Scene
    noise: dict[str, str]
    tolerance: dict[str, str]
    attractions: tuple[Attraction, ...]
    claims: tuple[Claim, ...]
    seconds: float
    average: Average | None = None
    entropy: Entropy | None = None

    def __repr__(self) -> str:
        """Name its scene, and each claim with its verdict."""
        return (
            f"Proof({self.scene.name}: {', '.join(f'{each.claim} {each.verdict}' for each in self.claims)})"
        )

    @property
    def proved(self) -> bool:
        """Whether every claim is proved."""
        return all(claim.verdict == "proved" for claim in self.claims)

    @property
    def spans(self) -> dict[str, list[str]]:
        """Both ends of each quantity that is fixed but unknown, as text."""
        return whole(self.scene, self.tolerance).texts() if self.tolerance else {}

    @property
    def laid(self) -> Laid:
        """Where parts are laid down: the starts of the goal; () for the whole arm."""
        return () if self.scene.goal is None else self.scene.goal.laid

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects of the scene that the proof is about, but for a spread, which is noise."""
        return tuple(name for name in self.scene.effects.on() if name != "spread")

    @property
    def model(self) -> Model:
        """The model for which the claims are proved, and the facts of the scene that this model leaves out."""
        return Model.of(self.scene, self.noise)

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [
            (
                each.claim,
                each.verdict,
                _starts(each.starts),
                *(each.shares.get(word) for word in SHARES),
                each.reason or None,
                ", ".join(self.model.left_out) or None,
            )
            for each in self.claims
        ]
        shares = [Column(word, show=partial(rounded, show=".4f", up=word == "open")) for word in SHARES]
        heads: tuple[Column | str, ...] = ("claim", "verdict", "starts", *shares, "missing", "not simulated")
        claims = Table(heads, rows, f"{self.scene.name}: proofs", self.model.sentence)
        if not any(each.written for each in self.claims):
            return (claims,)
        columns = ("side", Column("x", self.scene.unit, ".6f", ends=True))
        kept = bands_of(self.outer_extents())
        return (
            *(each.table() for each in self._numbers()),
            claims,
            Table(columns, kept, "Attracting cells", "proved: no throw leads out"),
        )

    def to_json(self) -> list[dict[str, Any]]:
        """Give it as plain tables for JSON, one per claim, in the words of docs/certificates.md."""
        return [self._tables(claim) for claim in self.claims]

    def _tables(self, claim: Claim) -> dict[str, Any]:
        proved, attractions = claim.written, self.attractions
        slope = float.fromhex(claim.section["least_slope"]) if "least_slope" in claim.section else None
        return as_table(
            **picked(claim, "claim", "verdict", "starts"),
            **{word: claim.shares.get(word) for word in SHARES},
            note=claim.note or None,
            reason=claim.reason or None,
            recurs=claim.recurs or None,
            counterexample=[self._state(claim, state) for state in claim.counterexample] or None,
            **self._conditions(),
            max_throws=self.max_throws() if proved and claim.claim == "attracts-all" else None,
            jog_fixed_points=claim.jog_fixed_points,
            extents=self._extents(claim) if proved else None,
            least_slope=slope,
            entropy=math.log(slope) if slope is not None and not self.noise else None,
            section=claim.section or None,
            averages=rows_of(self.average) if claim.claim == "average" else None,
            bounds=self.entropy.to_json() if self.entropy and claim.claim == "entropy" else None,
            model=self.model,
            cells=sum(each.cover.grid.n_cells for each in attractions),
            undecided=sum(_undecided(each) for each in attractions),
            unresolved=_by_side(each.unresolved.extents() for each in attractions),
            timings={"certify": self.seconds},
        )

    def _conditions(self) -> dict[str, Any]:
        """Give the scenes and the starts for which the claims are made."""
        return {
            "parameters": self.values(),
            "effects": self.effects or None,
            "noise": self.noise or None,
            "tolerance": self.tolerance or None,
            "laid": by_side(self.laid) or None,
        }

    def values(self) -> dict[str, str | list[str]]:
        """Name every quantity of the scene with its text: the two ends where it is fixed but unknown."""
        spans = self.spans
        return {name: spans.get(name, text) for name, text in texts(self.scene.text)}

    def _state(self, claim: Claim, state: State) -> dict[str, Any]:
        thrown = None if state.kappa is None else claim.fixed | self.thrown(state)
        return state.to_json() | {"parameters": thrown}

    def thrown(self, state: State) -> dict[str, str]:
        """Say what a throw was like, by quantity.

        kappa always, as it was replayed; the tilt that makes it, where the tilt alone differs; how far beyond the
        model's place it landed, where that differs.
        """
        quantities, scene = {"throw.kappa": f"{state.kappa!r} {self.scene.unit}"}, self.scene
        if "gravity.tilt" in self.noise and "throw.speed" not in self.noise and state.kappa is not None:
            given = parse(scene.text["gravity"]["tilt"], "angle")
            nominal = convert(given, "rad")
            # kappa goes with the sine of the tilt
            tilt = math.asin(min(1.0, math.sin(nominal) * state.kappa / scene.kappa))
            degrees = given.unit == "deg"
            quantities["gravity.tilt"] = f"{math.degrees(tilt) if degrees else tilt!r} {given.unit}"
        if state.landing is not None:
            quantities["landing.x"] = f"{state.landing!r} {scene.unit}"
        return quantities

    def max_throws(self) -> dict[str, Any]:
        """Bound the throws until a start is in the attracting cells.

        Returns
        -------
        dict
            `throws` from `beyond` (x by side) on; below it, x - a grows by a factor of `near_joint` at least with each,
            or with the arm's surface above the joint x - R* does, down to the jog's fixed point R*.
        """
        starts = [
            [float(edges[0]) for (edges,) in attraction.cover.grid.edges] for attraction in self.attractions
        ]
        rests = self.scene.sides.rests
        return {
            "beyond": {
                str(side): max(each) for side, each in enumerate(zip(*starts, strict=True)) if rests[side]
            },
            "throws": max(attraction.max_rank for attraction in self.attractions),
            "near_joint": min(near.q for attraction in self.attractions for near in attraction.joint),
        }

    def outer_extents(self) -> dict[int, list[tuple[float, float]]]:
        """Per side the intervals of attracting cells, of all pieces of a tolerance together."""
        together = _by_side(attraction.cells.extents() for attraction in self.attractions)
        return {side: union_of(together[side]) for side in sorted(together)}

    def _extents(self, claim: Claim) -> dict[int, Any]:
        """Per side `[[lo_outer, lo_inner], [hi_inner, hi_outer]]`: inner ends where the claim proves them."""
        ends = claim.section.get("ends")
        if ends is None:
            extents = self.outer_extents().items()
            return {side: [[[lo, None], [None, hi]] for lo, hi in parts] for side, parts in extents}
        intervals: dict[int, Any] = {}
        for lo, hi in zip(ends[::2], ends[1::2], strict=True):
            pair = [[_float(lo["outer"]), _float(lo["inner"])], [_float(hi["inner"]), _float(hi["outer"])]]
            intervals.setdefault(lo["side"], []).append(pair)
        return intervals

    def _write(self, path: str | Path, **how: Any) -> None:
        """Write the claims that are proved."""
        goals = [self.scene.goal for claim in self.claims if claim.claim == "goal" and claim.written]
        require_checkable(self.effects, goals, "the claims, and the JSON of this proof, hold what is proved")
        good = [
            {"claim": claim.claim, "section": claim.section, "verdict": claim.verdict}
            for claim in self.claims
            if claim.written
        ]
        require_proved(good)
        write(
            path,
            self.attractions,
            good,
            noise=self.noise,
            tolerance=self.tolerance,
            arrays={name: array for each in self._numbers() for name, array in each.arrays.items()},
            **how,
        )

    def _numbers(self) -> list[Average | Entropy]:
        return [each for each in (self.average, self.entropy) if each is not None]

    def denied(self, claims: Mapping[str, str]) -> Proof:
        """Return the proof where the checker denies some claims: these are undecided."""
        return replace(self, claims=left_of(self.claims, claims), **without(self, claims))


def without(proof: Any, denied: Mapping[str, str]) -> dict[str, Any]:
    """Give the numbers of a proof, None for those that the checker denies."""
    return {word: None if word in denied else getattr(proof, word) for word in ("average", "entropy")}


def left_of(claims: Sequence[Claim], denied: Mapping[str, str]) -> tuple[Claim, ...]:
    """Give claims of which the checker denies some, with the reason: these are undecided."""
    return tuple(
        replace(
            each,
            verdict="undecided",
            reason=f"the checker denies it: {denied[each.claim]}",
            section={},
            starts=None,
        )
        if each.claim in denied
        else each
        for each in claims
    )


def _float(text: str | None) -> float | None:
    return None if text is None else float.fromhex(text)


def _undecided(attraction: Attraction) -> int:
    """Count the cells on which both a jog and a flip are possible."""
    count = 0
    for images in attraction.cover.images:
        possible = [(lo <= hi).reshape(lo.shape[0], -1).all(axis=1) for lo, hi in images.hulls.values()]
        count += int((np.sum(possible, axis=0) > 1).sum()) if possible else 0
    return count


def _by_side(
    extents: Iterable[Mapping[int, Sequence[tuple[float, float]]]],
) -> dict[int, list[tuple[float, float]]]:
    """Put intervals together, per side."""
    together: dict[int, list[tuple[float, float]]] = {}
    for each in extents:
        for side, parts in each.items():
            together.setdefault(side, []).extend(parts)
    return together
