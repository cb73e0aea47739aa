"""Whether the goal's margin is larger than what the machine does: the question that matters.

The margins of the fitted scene, at every throw another speed or landing, stand against the fitted scatter; and
the goal is asked of all scenes within the fitted intervals together with that scatter at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from limitsets.errors import AnswerError
from limitsets.files import as_table
from limitsets.fitting.fit_result import Fit, rounded_up
from limitsets.goals import OrientedBeyond
from limitsets.proofs.certify import certify
from limitsets.proofs.query import Query
from limitsets.robust.margins.finding import margin
from limitsets.robust.margins.margin_result import Margin
from limitsets.robust.margins.margin_texts import bound
from limitsets.scene import Scene, load

# Throws scatter without a bound; so many standard deviations are taken for one (1 throw in 370 is outside).
SIGMAS = 3.0

Progress = Callable[[str, int, int], None]
WORDS = {"throw.speed": "speed repeats", "landing.x": "landings repeat"}


@dataclass(frozen=True, eq=False)
class Enough:
    """Whether the margin is larger than what was found.

    Attributes
    ----------
    verdict : str
        "enough": the goal is proved for every scene within the intervals with the scatter; "not-enough": the scatter
        exceeds a deviation at which an orbit violates the goal; "undecided".
    sentences : tuple of str
        The answer in words.
    repeats : dict of str to (float, float)
        Three standard deviations of each noise, as most likely and at most: percent of the speed, lengths.
    margins : tuple of Margin
        Of the same, per throw.
    together : str
        Verdict on all scenes within the intervals with all of the scatter: "proved", "refuted" or "undecided".
    beyond : float or None
        An X beyond which the goal is proved with this scatter, where it is not for the goal's own.
    """

    verdict: str
    sentences: tuple[str, ...]
    repeats: dict[str, tuple[float, float]]
    margins: tuple[Margin, ...]
    together: str
    beyond: float | None

    def to_json(self) -> dict[str, Any]:
        """Give it as plain tables for JSON."""
        return as_table(
            verdict=self.verdict,
            sentences=self.sentences,
            repeats=self.repeats,
            margins={
                each.quantity: {"proved": each.proved, "refuted": each.refuted} for each in self.margins
            },
            together=self.together,
            beyond=self.beyond,
        )


def enough(found: Fit, *, width: float = 0.02, progress: Progress | None = None) -> Enough:
    """Ask whether the goal's margin is larger than the fitted uncertainty and scatter.

    Parameters
    ----------
    found : Fit
        A fit of a scene with a goal.
    width : float
        How close the ends of the margins have to be.
    progress : callable, optional
        Called with what is done, how much of it, and of how much.

    Raises
    ------
    AnswerError
        The scene has no goal.
    """
    if found.scene.goal is None:
        raise AnswerError("the goal", None, "a scene with [goal]", "say what has to hold")
    scene, unit = found.scene, found.scene.unit
    repeats = {
        "throw.speed": (100.0 * SIGMAS * found.speed.value, 100.0 * SIGMAS * found.speed.hi),
        "landing.x": (SIGMAS * found.landing.value, SIGMAS * found.landing.hi),
    }
    units = {"throw.speed": "%", "landing.x": unit}
    margins, sentences, verdicts = [], [], []
    for name, sizes in repeats.items():
        (one,) = margin(scene, name, reading="per-throw", width=width, progress=progress)
        margins.append(one)
        verdicts.append(_judged(one, *sizes))
        sentences.append(_sentence(name, one, sizes, units[name], verdicts[-1]))
    if all(each.refuted == 0 for each in margins):
        sentences = ["Without any scatter an orbit of the fitted machine violates the goal: not enough."]
    noise = {
        name: f"{rounded_up(most)} {units[name]}"
        for name, (_, most) in repeats.items()
        if 0 < most < math.inf
    }
    together, beyond = "undecided", None
    if "not-enough" in verdicts:
        verdict = "not-enough"
        beyond = _beyond(scene, noise)
        if beyond is not None:
            sentences.append(f"Beyond X = {beyond:.4g} {unit} it would be.")
    else:
        open_ended = [
            each.name
            for each in found.quantities
            if each.name.replace("kappa", "speed") not in scene.tolerance
        ]
        if open_ended:
            sentences.append(
                f"The film bounds {' and '.join(open_ended)} on one side at most: film more throws."
            )
        together = "undecided" if open_ended else _together(scene, noise, progress)
        verdict = "enough" if together == "proved" else "undecided"
        sentences.append(_all_of_it(together))
    return Enough(verdict, tuple(sentences), repeats, tuple(margins), together, beyond)


def _judged(one: Margin, likely: float, most: float) -> str:
    if most <= one.proved:
        return "enough"
    return "not-enough" if one.refuted is not None and likely >= one.refuted else "undecided"


def _sentence(name: str, one: Margin, sizes: tuple[float, float], unit: str, verdict: str) -> str:
    likely, most = (f"{rounded_up(size)} {unit}" if math.isfinite(size) else "any size" for size in sizes)
    fails = f", at {bound(one.refuted, unit, up=True)} an orbit fails" if one.refuted is not None else ""
    ends = {
        "enough": "enough by itself",
        "not-enough": "not enough",
        "undecided": "film more throws to tell" if sizes[0] <= one.proved else "not proved to be enough",
    }
    safe = f"up to {bound(one.proved, unit)} is proved safe" if one.proved > 0 else "nothing is proved safe"
    repeats = f"Your {WORDS[name]} to {likely} (three standard deviations; {most} at most)"
    return f"{repeats}; {safe}{fails}: {ends[verdict]}."


def _together(scene: Scene, noise: dict[str, str], progress: Progress | None) -> str:
    """Ask the goal of every scene within the intervals with the whole scatter."""
    tolerance = scene.as_dict().get("tolerance", {})
    tolerance = {name: text for name, text in tolerance.items() if name != "landing.x"}
    proof = certify(scene, ["goal"], noise=noise, tolerance=tolerance, progress=progress)
    return proof.claims[0].verdict if proof.claims[0].verdict in ("proved", "refuted") else "undecided"


def _all_of_it(together: str) -> str:
    said = {
        "proved": "The goal is proved for every machine within these intervals with all of this scatter: safe.",
        "refuted": "A machine within these intervals with this scatter violates the goal: not safe.",
        "undecided": "For every machine within these intervals with all of this scatter the goal is not decided.",
    }
    return said[together]


def _beyond(scene: Scene, noise: dict[str, str]) -> float | None:
    """Find an X from which the goal is proved with this noise, short of where its side ends; None if there is none."""
    goal = scene.goal
    if not isinstance(goal, OrientedBeyond):
        return None
    tree = scene.as_dict()
    tree.pop("goal")
    bare = load(tree)
    cells = Query.of(bare, (goal,)).prove(noise=noise).found
    if cells is None:
        return None
    reach = {side: max((hi for _, hi in parts), default=0.0) for side, parts in cells.cells.extents().items()}
    x = max((hi for side, hi in reach.items() if side != goal.side), default=math.inf)
    x = float(rounded_up(x)) if math.isfinite(x) else x
    if not x < min(reach.get(goal.side, 0.0), scene.arm_length):
        return None
    proof = Query.of(bare, (OrientedBeyond(x, goal.side),)).prove(noise=noise)
    return x if proof.verdict == "proved" else None
