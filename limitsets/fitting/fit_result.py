"""What a fit found: values with intervals, the scatter, misrecorded sides, the scene that has it all."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from decimal import ROUND_CEILING, Context, Decimal
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.files import as_table, picked
from limitsets.fitting.further import Further
from limitsets.fitting.likelihood import Likelihood
from limitsets.fitting.maximising import Maximum, maximised
from limitsets.fitting.misfit import Misfit
from limitsets.fitting.rows import Rows
from limitsets.robust.margins.deviations import deviation_scale
from limitsets.scene import Scene
from limitsets.scene.spelling import in_unit_of, in_units_of, unit_of
from limitsets.tables import Column, Table, Tabled

# A larger share of a value is no tolerance: what is fitted is then not known at all.
MOST = 0.99

Array = NDArray[np.float64]


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
        for k, value in zip(fixed, values.values(), strict=True):
            at[k] = (value - own.centre[k]) / own.scale[k]
        free = np.array([k for k in range(at.size) if k not in fixed])

        def function(numbers: Array) -> Array:
            points = np.repeat(at[None], len(numbers), axis=0)
            points[:, free] = numbers
            return own(points)

        return 2.0 * (self.best.value - maximised(function, at[free]).value)

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [(each.name, each.value, (each.lo, each.hi), each.unit) for each in self.quantities]
        for name, each, factor, unit in (
            ("scatter of throw.speed", self.speed, 100.0, "%"),
            ("scatter of landing.x", self.landing, 1.0, self.scene.unit),
        ):
            rows.append((name, factor * each.value, (factor * each.lo, factor * each.hi), unit))
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


def rounded_up(value: float) -> str:
    """Write a size with three digits, not less than it is."""
    return f"{Context(prec=3, rounding=ROUND_CEILING).create_decimal(Decimal(repr(value))):f}"


def fitted_scene(given: Scene, quantities: tuple[Fitted, ...], speed: Scatter, landing: Scatter) -> Scene:
    """Return the scene with the values, the intervals as [tolerance], and the scatter in [world], in its own units."""
    scene = given.with_values({each.name: each.value for each in quantities})
    scene = in_units_of(scene, given, [each.name for each in quantities])
    tree = scene.as_dict()
    tolerance = {}
    for each in quantities:
        name = "throw.speed" if each.name == "throw.kappa" else each.name
        share = deviation_scale(scene, name).relative
        # the speed goes as the inverse square root of kappa
        per = (0.5 if each.name == "throw.kappa" else 1.0) / each.value if share else 1.0
        half = per * each.half
        if each.bounded and half < (MOST if share else math.inf):
            size, unit = (
                (100.0 * half, "%") if share else (in_unit_of(given, name, half), unit_of(given, name))
            )
            tolerance[name] = f"{rounded_up(size)} {unit}"
    kept = {name: text for name, text in tree.get("tolerance", {}).items() if name not in tolerance}
    tree["tolerance"] = kept | tolerance
    # where none is most likely, but some is not ruled out, the most that is possible is written
    length, rate = (each.value or each.hi for each in (landing, speed))
    scatter = {}
    if math.isfinite(length):
        of_places = unit_of(given, "landing.x")
        scatter["landing"] = f"{rounded_up(in_unit_of(given, 'landing.x', length))} {of_places}"
    if rate < MOST:
        scatter["speed"] = f"{rounded_up(100.0 * rate)} %"
    tree["world"] = {**tree.get("world", {}), "scatter": scatter}
    return Scene.of(tree, given.file)
