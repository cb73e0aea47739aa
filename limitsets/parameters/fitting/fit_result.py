"""What a fit says: values with intervals, scatter, the scene that has it all, and whether the margin is enough."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from limitsets.base import AnswerError, Column, Progress, Table, Tabled, as_table, picked
from limitsets.base.arrays import Array
from limitsets.feeder.goals import OrientedBeyond
from limitsets.feeder.scene import Scene, load
from limitsets.parameters.fitting.likelihood import Further, Likelihood, Rows
from limitsets.parameters.fitting.misfit import Misfit
from limitsets.parameters.fitting.searching import RADIUS, Maximum, maximised
from limitsets.parameters.margins.machines import SIGMAS, Machines, rounded_up, with_uncertainty
from limitsets.parameters.margins.margin_result import Margin, bound
from limitsets.parameters.margins.single import margin
from limitsets.proofs.prover.certifying import certify
from limitsets.proofs.prover.query import Query


@dataclass(frozen=True)
class Fitted:
    """One quantity.

    Attributes
    ----------
    name : str
        Of the quantity.
    value : float
        The most likely value; of an interval within which nothing is more likely, a value in it [scene's units].
    lo, hi : float
        The 95 % interval, which ends where no part exists; infinite where there is no bound.
    unit : str
        Of all three.
    bounded : bool
        Whether the throws set both ends.
    """

    name: str
    value: float
    lo: float
    hi: float
    unit: str
    bounded: bool = True

    @property
    def half(self) -> float:
        """The larger distance from the value to an end."""
        return max(self.value - self.lo, self.hi - self.value)


@dataclass(frozen=True)
class Scatter:
    """How far throws scatter, as a standard deviation.

    Attributes
    ----------
    value : float
        The most likely one: a share of the speed, or a length.
    lo, hi : float
        The 95 % interval.
    at_most : bool
        Whether it may be errors of measurement, for none is known: then it is a bound.
    """

    value: float
    lo: float
    hi: float
    at_most: bool


@dataclass(frozen=True, eq=False)
class Fit(Tabled):
    """A scene fitted to filmed throws.

    Attributes
    ----------
    scene : Scene
        The scene with the fitted values, their uncertainty as [tolerance], and the scatter in [world].
    given : Scene
        The scene as it was.
    rows : Rows
        The throws, and what each was taken for.
    quantities : tuple of Fitted
        What the data tell.
    held : dict of str to str
        What they do not tell, and why: it is as in the scene.
    undetermined : dict of str to str
        What has no interval, for the throws do not tell it apart from quantities that are held: these.
    speed, landing : Scatter
        Scatter of the speed (share), and of landings [length].
    error : float or None
        Standard deviation of a measured place, the mean of those given [length]; None where none is known.
    misread : tuple of (int, str, int, int)
        Misrecorded sides: line of the file, column, recorded, what fits the landing.
    misread_rate : tuple of float
        Their share of all recorded sides, and its 95 % interval.
    misfit : Misfit
        Whether the model fits.
    explained : str
        Which origin or scale of places would make a film fit that does not; empty if none.
    residuals, deviations : ndarray, shape (n,)
        What was measured less what is predicted, and its standard deviation [length].
    further : tuple of Further
        Which throws would sharpen the answer most, the best of each side first.
    seconds : float
        Time.
    likelihood, best, threshold
        The function, its maximum, and by how much twice the logarithm may fall within the interval of one quantity.
    """

    scene: Scene
    given: Scene
    rows: Rows
    quantities: tuple[Fitted, ...]
    held: dict[str, str]
    undetermined: dict[str, str]
    speed: Scatter
    landing: Scatter
    error: float | None
    misread: tuple[tuple[int, str, int, int], ...]
    misread_rate: tuple[float, float, float]
    misfit: Misfit
    explained: str
    residuals: Array
    deviations: Array
    further: tuple[Further, ...]
    seconds: float
    likelihood: Likelihood = field(repr=False)
    best: Maximum = field(repr=False)
    threshold: float = field(repr=False)

    def __getitem__(self, name: str) -> Fitted:
        """Return what was found of a quantity."""
        return next(each for each in self.quantities if each.name == name)

    def deviance(self, values: dict[str, float]) -> float:
        """Say how much less likely these values are: twice the loss of log-likelihood, all else chosen at its best.

        Parameters
        ----------
        values : dict of str to float
            All of the fitted quantities, or some of them, in the scene's units.
        """
        own = self.likelihood
        at = self.best.at.copy()
        fixed = [own.names.index(name) for name in values]
        at[fixed] = (np.array([*values.values()]) - own.centre[fixed]) / own.scale[fixed]
        free = np.setdiff1d(np.arange(at.size), fixed)

        def function(numbers: Array) -> Array:
            points = np.repeat(at[None], len(numbers), axis=0)
            points[:, free] = numbers
            return own(points)

        return 2.0 * (self.best.value - maximised(function, at[free]).value)

    @property
    def machines(self) -> Machines:
        """The machines that the film leaves possible.

        Raises
        ------
        DataError
            The film leaves a quantity open.
        """
        return Machines.of(self.to_json(), self.rows.throws.file or None)

    def _correlation(self) -> dict[str, Any]:
        """Say how the errors of bounded quantities go together: by the likelihood's curvature at its maximum."""
        own, names = self.likelihood, [each.name for each in self.quantities]
        kept = [own.names.index(name) for name in names]
        bend = -self.best.hessian[np.ix_(kept, kept)]
        if (
            RADIUS in names
        ):  # nothing within its interval is more likely: as much as a uniform law of its width bends
            k = names.index(RADIUS)
            bend[k, k] += 3.0 * (own.scale[kept[k]] / self[RADIUS].half) ** 2
        told = [k for k, each in enumerate(self.quantities) if each.bounded and each.name != RADIUS]
        covariance = np.linalg.inv(bend)[np.ix_(told, told)]
        size = np.sqrt(np.diag(covariance))
        return {
            "names": [names[k] for k in told],
            "matrix": covariance / np.outer(size, size),
            "spare": len(self.rows.throws) - len(own.names),
        }

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        scatters = (
            ("scatter of throw.speed", self.speed, 100.0, "%"),
            ("scatter of landing.x", self.landing, 1.0, self.scene.unit),
        )
        rows = [
            *((each.name, each.value, (each.lo, each.hi), each.unit) for each in self.quantities),
            *(
                (name, factor * each.value, (factor * each.lo, factor * each.hi), unit)
                for name, each, factor, unit in scatters
            ),
        ]
        columns = (
            "quantity",
            Column("value", show=_number),
            Column("95 % interval", show=_number, ends=True),
            "unit",
        )
        return (Table(columns, rows, f"{self.scene.name}: fitted", "95 % intervals, not proved"),)

    def to_json(self) -> dict[str, Any]:
        """Give it as plain tables for JSON; every number is finite or null."""
        rows, sides = self.rows, len(self.given.sides)
        lines = zip(rows.throws.row, rows.side, rows.branch, self.residuals, self.deviations, strict=True)
        return as_table(
            scene=self.scene.as_dict(),
            unit=self.scene.unit,
            throws=len(rows.throws),
            quantities={
                each.name: picked(each, "value", "lo", "hi", "unit", "bounded") for each in self.quantities
            },
            held=self.held,
            undetermined=self.undetermined,
            scatter={"throw.speed": self.speed, "landing.x": self.landing},
            correlation=self._correlation(),
            error=self.error,
            misread=[
                {"row": row, "column": column, "recorded": recorded, "fits": fits}
                for row, column, recorded, fits in self.misread
            ],
            misread_rate=dict(zip(("value", "lo", "hi"), self.misread_rate, strict=True)),
            misfit={
                **picked(self.misfit, "p", "outliers", "structure", "lacking"),
                "rows": self.misfit.strange,
            },
            explained=self.explained or None,
            further=self.further,
            residuals=[
                {
                    "row": row,
                    "side": side,
                    "side_after": (side + flipped) % sides,
                    "residual": miss,
                    "deviation": size,
                }
                for row, side, flipped, miss, size in lines
            ],
            timings={"fit": self.seconds},
        )


def _number(value: float) -> str:
    """Write a number; an end that the data do not bound is open."""
    return f"{value:.6g}" if math.isfinite(value) else "open"


def fitted_scene(given: Scene, quantities: tuple[Fitted, ...], speed: Scatter, landing: Scatter) -> Scene:
    """Return the scene with the values, the intervals as [tolerance], and the scatter in [world], in its own units."""
    halves = {each.name: each.half if each.bounded else math.inf for each in quantities}
    # where none is most likely, but some is not ruled out, the most that is possible is written
    scatter = {"throw.speed": speed.value or speed.hi, "landing.x": landing.value or landing.hi}
    return with_uncertainty(given, {each.name: each.value for each in quantities}, halves, scatter)


# ----------------------------------------------------------------
# Whether the goal's margin is larger than what the machine does: the question that matters.
#
# The margins of the fitted scene, at every throw another speed or landing, stand against the fitted scatter; and
# the goal is asked of all scenes within the fitted intervals together with that scatter at once.


WORDS = {"throw.speed": "speed repeats", "landing.x": "landings repeat"}
ALL_OF_IT = {
    "proved": "The goal is proved for every machine within these intervals with all of this scatter: safe.",
    "refuted": "A machine within these intervals with this scatter violates the goal: not safe.",
    "undecided": "For every machine within these intervals with all of this scatter the goal is not decided.",
}


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
    margins = [
        margin(scene, name, reading="per-throw", width=width, progress=progress)[0] for name in repeats
    ]
    verdicts = [_judged(one, *sizes) for one, sizes in zip(margins, repeats.values(), strict=True)]
    sentences = [
        _sentence(name, one, sizes, units[name], verdict)
        for (name, sizes), one, verdict in zip(repeats.items(), margins, verdicts, strict=True)
    ]
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
        sentences.append(ALL_OF_IT[together])
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
