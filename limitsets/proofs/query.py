"""One query: whether goals hold for all of a box of scenes, and every sequence of throws with some noise.

Cells are refined where needed: first some hundreds a side, then borders spread evenly over the attracting cells.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from limitsets.errors import AnswerError
from limitsets.goals import Goal, Reaches
from limitsets.proofs.attraction import Attraction, attraction
from limitsets.proofs.cover import cover
from limitsets.proofs.goals import Answer, cuts, prove, prove_or_refute
from limitsets.proofs.goals.kind import against, undecided
from limitsets.proofs.goals.laid_starts import laid_only, narrowed, starts_in
from limitsets.proofs.goals.reaches import falls_short
from limitsets.proofs.parameters import ParameterBox, parameter_box
from limitsets.proofs.proof import Claim
from limitsets.proofs.tolerance import SceneBox
from limitsets.proofs.weakest_claim import weakest_of
from limitsets.proofs.worst import worst_orbit
from limitsets.scene import Scene, load

# Cells per side to begin with, then borders over all that attracts, and pieces of a parameter where a cell is open to
# both decisions; more cells to begin with where nothing attracts.
BASE, FINE, PIECES = 512, (0, 4000, 16_000, 32_000), (8, 32, 128, 512)
BASES = (512, 2048, 8192)

# For goals about every start: cells per side, as no part of the arm matters more than the others.
LADDER = (512, 2048, 8192, 32_768)


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of the goals on one box.

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
        The scenes it was asked of; None for the scene as it is.
    noise : dict of str to str
        The noise.
    within : dict of str to str
        Deviations that those of a single scene do not exceed, by quantity.
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
    known : dict
        "base": cells per side, outside what attracts, with which the goals were proved last.
    """

    scene: Scene
    goals: tuple[Goal, ...]
    known: dict[str, int] = field(default_factory=dict)

    @classmethod
    def of(cls, scene: Scene, goals: tuple[Goal, ...]) -> Query:
        """Put goals to a scene, without what a margin is not asked about.

        The scene's own goal is left out, so that a certificate says what was asked; and its scatter, because no
        quantity deviates in a margin but those asked about.
        """
        tree = scene.as_dict()
        tree.pop("goal", None)
        tree.get("effects", {}).pop("spread", None)
        return cls(load(tree), goals)

    @property
    def anywhere(self) -> bool:
        """Whether some goal is about every start on the arm."""
        return any(goal.from_anywhere or goal.of_every_start for goal in self.goals)

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
            for base in self._bases():
                coarse = self._coarse(box, bases, base)
                found, answers = self._refined(coarse, box, finest, base)
                missing = answers[-1]
                if missing.verdict == "proved":
                    self.known["base"] = base
                    return Outcome("proved", "", found, answers, piece=piece, noise=noise)
                # finer cells where nothing attracts are needed only for starts that are not proved to come
                if missing.final or missing.verdict != "proved-on-cells":
                    break
        except AnswerError as error:
            return Outcome("impossible", _said(error), piece=piece, noise=noise)
        reason = missing.reason
        if missing.verdict == "proved-on-cells":
            share = 100.0 * missing.shares["share"]
            laid = " laid down" if any(goal.laid for goal in self.goals) else ""
            reason = f"the goal is proved for {math.floor(10.0 * share) / 10.0:g} % of the starts{laid} only: {reason}"
        if not (found.component >= 0).any():
            reason = f"{reason}: from some of them, parts may leave the arm"
        return Outcome("undecided", reason, found, piece=piece, noise=noise)

    def _bases(self) -> tuple[int, ...]:
        """Cells per side outside what attracts: first as many as proved the goals last, or the fewest; then more."""
        return BASES[:1] if self.anywhere else BASES[BASES.index(self.known.get("base", BASE)) :]

    def _refined(
        self, found: Attraction, box: ParameterBox, finest: int, base: int
    ) -> tuple[Attraction, tuple[Answer, ...]]:
        """Refine what attracts until the goals are proved, or finer cells cannot do it."""
        for step in range(finest + 1):
            if step:
                found = self._finer(found, box, step, base)
            answers = self._each(found)
            missing = answers[-1]
            if missing.verdict == "proved" or missing.final or not (found.component >= 0).any():
                break
        return found, answers

    def _each(self, found: Attraction) -> tuple[Answer, ...]:
        """Prove one goal after the other, up to the first that is not: it comes last then."""
        answers: list[Answer] = []
        for goal in self.goals:
            answers.append(prove(found, self.scene, goal))
            if answers[-1].verdict != "proved":
                break
        return tuple(answers)

    def cells(self, piece: SceneBox | None, step: int) -> Attraction:
        """Return the cells of one refinement, whatever they prove."""
        box = self.box(piece, {})
        return self._finer(self._coarse(box), box, step)

    def _coarse(self, box: ParameterBox, bases: int = len(BASES), base: int = BASE) -> Attraction:
        for cells in (base, *(more for more in BASES[:bases] if more > base)):
            found = attraction(cover(box, cells, cuts(self.goals, box.lo.a.size), PIECES[0]))
            if (found.component >= 0).any():
                break
        return found

    def _finer(self, found: Attraction, box: ParameterBox, step: int, base: int = BASE) -> Attraction:
        """Cut what attracts into more cells; or everything, where a goal is about every start."""
        borders = cuts(self.goals, box.lo.a.size)
        if self.anywhere:
            return attraction(cover(box, LADDER[step], borders, PIECES[step]))
        extents = found.cells.extents()
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
            found = self._coarse(box)
        except AnswerError as error:
            return Outcome("impossible", _said(error), piece=piece, noise=noise)
        for goal in self.goals:
            answer = self._against(found, goal)
            if answer.verdict == "refuted":
                return Outcome(
                    "refuted", answer.reason, found, (answer,), goal, answer.counterexample, piece, noise
                )
            reason = answer.reason or reason
        return Outcome("undecided", reason, found, piece=piece, noise=noise)

    def _against(self, found: Attraction, goal: Goal) -> Answer:
        """Search for what refutes one goal: where throws differ, for the worst that they can do."""
        wrong = goal.wrong()
        if isinstance(goal, Reaches) and not goal.every_orbit:
            # refuted by where attracting cells end; a periodic orbit that attracts is not looked for each time
            finer = self._finer(found, found.cover.box, 2)
            finer = narrowed(finer, starts_in(finer, goal.laid)[0]) if goal.laid else finer
            return laid_only(falls_short(finer, goal) or undecided(""), finer, goal.laid)
        if wrong is None or not found.cover.box.noise or goal.from_anywhere:
            return prove_or_refute(found, self.scene, goal)
        answer = prove(found, self.scene, goal)
        found = narrowed(found, starts_in(found, goal.laid)[0]) if goal.laid else found
        if not (found.component >= 0).any():
            return answer
        return laid_only(against(worst_orbit(found, wrong), answer.reason), found, goal.laid)


def joined_claims(pieces: Sequence[Outcome]) -> tuple[Claim, ...]:
    """Join what is proved of several pieces: one claim for each goal, of the starts for which all of them prove it."""
    found = [piece.found for piece in pieces if piece.found is not None]
    claims = [
        [
            Claim("goal", "proved", "", dict(one.section), starts=one.starts, shares=dict(one.shares))
            for one in piece.answers
        ]
        for piece in pieces
    ]
    return tuple(weakest_of(of_goal, found) for of_goal in zip(*claims, strict=True))


def unjoined(pieces: Sequence[Outcome]) -> str:
    """Say why pieces do not prove the goals together, in one certificate; empty if they do."""
    missing = [piece.reason for piece in pieces if piece.verdict != "proved"]
    missing = missing or [claim.reason for claim in joined_claims(pieces) if claim.verdict != "proved"]
    return missing[0] if missing else ""


def _said(error: AnswerError) -> str:
    """Say why there is no such scene."""
    value = f"{error.value:.6g}" if isinstance(error.value, float) else error.value
    return f"there is no such part or throw: {error.thing} is {value}; it has to be {error.allowed}"
