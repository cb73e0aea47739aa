"""Where the likelihood's maximum is looked for: robust least squares of the landings, and what they cannot tell.

A quantity along whose direction the landings hardly move (a singular direction of the information) is held at the
scene's value and named.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import DataError
from limitsets.fitting.rows import Rows, assigned
from limitsets.scene import Scene

RADIUS = "part.mass.radius_of_gyration"
QUANTITIES = ("part.mass.center.along", "part.mass.center.above", "arm.surface_height")
# A direction is told by the landings if they fix it to this share of the speed, or of the part.
TOLD = 0.2
# What moves by this share of its standard error with a quantity that is held is not determined.
MOVED = 0.2
STEP = 1e-5
# One after the other: towards the machine, away from outliers for good, and once more with the sides set right.
LOSSES = ("soft_l1", "cauchy", "huber")
# Median of the sizes of normal numbers.
MEDIAN = 0.6744897501960817
# Where the landings are first taken apart robustly: what misses by more is treated as an outlier, this share of a side.
ROUGH = 0.02

Array = NDArray[np.float64]


class Start(NamedTuple):
    """Where to begin.

    Attributes
    ----------
    rows : Rows
        The throws, with the sides and branches that their landings tell.
    names : tuple of str
        What the landings tell.
    values, errors : ndarray, shape (p,)
        Their values, and roughly how well they are known.
    held : dict of str to str
        What they do not tell, and which others it goes with.
    undetermined : dict of str to str
        What has a value only because another quantity is held, and which one.
    spread : float
        Robust standard deviation of the landings [length].
    """

    rows: Rows
    names: tuple[str, ...]
    values: Array
    errors: Array
    held: dict[str, str]
    undetermined: dict[str, str]
    spread: float


def quantities_of(scene: Scene) -> tuple[str, ...]:
    """Name what landings depend on: the speed, or kappa without gravity, and what the scene is written in."""
    thrown = "throw.kappa" if scene.gravity is None else "throw.speed"
    centre = "center" in scene.text["part"]["mass"]
    return (thrown, *(QUANTITIES if centre else QUANTITIES[2:]))


def units_of_change(scene: Scene, names: tuple[str, ...]) -> Array:
    """Return what counts as a large change of each quantity: its value for the throw, a side for lengths."""
    side = float(np.mean(scene.sides.length))
    return np.array([scene.value(name) if name.startswith("throw.") else side for name in names])


def spread_of(residual: Array) -> float:
    """Return the standard deviation of most of the numbers."""
    return float(np.median(np.abs(residual))) / MEDIAN


def jacobian(scene: Scene, rows: Rows, names: tuple[str, ...], values: Array, units: Array) -> Array:
    """Return the derivatives of the landings by quantities, each in its unit of change; shape (n, p)."""
    count = len(names)
    moves = np.concatenate([np.diag(units), -np.diag(units), np.zeros((1, count))]) * STEP
    told = rows.told(scene, dict(zip(names, (values + moves).T, strict=True)))
    # a step that leads out of what can be is not made: the difference is one-sided there
    after = np.where(told.possible, told.after, told.after[-1])
    steps = STEP * (told.possible[:count] * 1.0 + told.possible[count:-1])
    found: Array = ((after[:count] - after[count:-1]) / np.maximum(steps, STEP)).T
    return found


def _least_squares(
    scene: Scene, rows: Rows, names: tuple[str, ...], values: Array, units: Array, scale: float, loss: str
) -> Array:
    """Fit the landings so that outliers count little."""
    from scipy.optimize import least_squares

    def misses(at: Array) -> Array:
        points = dict(zip(names, (values + units * at)[:, None], strict=True))
        told = rows.told(scene, points)
        miss = (rows.throws.x_after - told.after[0]) / scale
        refused = np.full(miss.size, 1e6)
        return np.where(np.isfinite(miss), miss, 1e6) if told.possible[0, 0] else refused

    def slopes(at: Array) -> Array:
        found = -jacobian(scene, rows, names, values + units * at, units) / scale
        return np.where(np.isfinite(found), found, 0.0)

    # a hundredth of a unit of change is a step; nothing leads farther than half of one
    done = least_squares(
        misses, np.zeros(len(names)), slopes, bounds=(-0.5, 0.5), x_scale=0.01, loss=loss, max_nfev=60
    )
    return np.asarray(values + units * done.x, dtype=np.float64)


def robust_start(scene: Scene, rows: Rows) -> Start:
    """Fit the landings robustly, and hold what they do not tell.

    Raises
    ------
    DataError
        A throw begins where a part on its side cannot fly, or the landings tell nothing.
    """
    names, held, together = quantities_of(scene), {}, {}
    values, units = np.array([scene.value(name) for name in names]), units_of_change(scene, names)
    _require_flight(scene, rows)
    while True:
        spread = ROUGH * float(np.mean(scene.sides.length))
        for loss in LOSSES:
            values = _least_squares(scene, rows, names, values, units, spread, loss)
            here = dict(zip(names, values.tolist(), strict=True))
            told = rows.told(scene, {k: np.array([v]) for k, v in here.items()})
            spread = max(spread_of(rows.throws.x_after - told.after[0]), 1e-9 * scene.arm_length)
            if loss != LOSSES[0]:  # a machine that is not yet near explains nothing
                rows = assigned(rows, scene, here, spread)
        slopes = jacobian(scene, rows, names, values, units)
        _, singular, axes = np.linalg.svd(slopes / spread, full_matrices=False)
        if singular[-1] * TOLD >= 1.0:
            break
        out = int(np.argmax(np.abs(axes[-1])))
        others = [n for k, n in enumerate(names) if k != out and abs(axes[-1][k]) > 0.1]
        together[names[out]] = others
        held[names[out]] = (
            f"the landings do not tell it apart from {', '.join(others)}" if others else "no landing tells it"
        )
        keep = [k for k in range(len(names)) if k != out]
        if not keep:
            raise DataError(
                "what the landings tell",
                "nothing",
                "one quantity at least",
                "film throws from other places; check units and sides",
                file=rows.throws.file,
            )
        names, units = tuple(names[k] for k in keep), units[keep]
        values = np.array([scene.value(name) for name in names])
    covariance = np.linalg.inv(slopes.T @ slopes / spread**2)
    errors = np.sqrt(np.diag(covariance))
    known = scene.with_values(dict(zip(names, values.tolist(), strict=True)))
    undetermined = _undetermined(known, rows, names, together, slopes, errors)
    return Start(rows, names, values, errors * units, held, undetermined, spread)


def _undetermined(
    scene: Scene, rows: Rows, names: tuple[str, ...], held: dict[str, list[str]], slopes: Array, errors: Array
) -> dict[str, str]:
    """Find what goes with a quantity that is held, or moves when that one moves within what the landings leave open."""
    found: dict[str, list[str]] = {}
    for one, others in held.items():
        own = np.array([scene.value(one)])
        moved = jacobian(scene, rows, (one,), own, units_of_change(scene, (one,)))[:, 0]
        follows = np.linalg.lstsq(slopes, moved)[0]
        # a decision depends on all quantities, so that the radius of gyration goes with each
        for name, size in zip((*names, RADIUS), (*np.abs(follows) * TOLD / errors, np.inf), strict=True):
            if size > MOVED or name in others:
                found.setdefault(name, []).append(one)
    return {name: ", ".join(others) for name, others in found.items()}


def _require_flight(scene: Scene, rows: Rows) -> None:
    throws, count = rows.throws, len(scene.sides)
    strange = np.flatnonzero(np.maximum(throws.side_before, throws.side_after) >= count)
    if strange.size:
        k = int(strange[0])
        sides = f"{throws.side_before[k]} and {throws.side_after[k]}"
        allowed = f"sides of this part, 0 to {count - 1}"
        raise DataError("the sides", sides, allowed, "count them in flip order", key=f"row {throws.row[k]}")
    least = np.zeros(len(throws)) if throws.corner else scene.sides.a[throws.side_before]
    short = np.flatnonzero(throws.x_before <= least)
    if short.size:
        k, unit = int(short[0]), scene.unit
        side = int(throws.side_before[k])
        beyond = f"beyond the left vertex of side {side}, above {least[k]:.4g} {unit}"
        raise DataError(
            "the place before", f"{throws.x_before[k]:g} {unit}",
            "beyond the joint, above 0" if throws.corner else beyond,
            "a part nearer to the joint is not thrown: correct the place or the side", key=f"row {throws.row[k]}",
            file=throws.file,
        )  # fmt: skip
