"""Are there constants with which the paper's printed data give its printed critical points?  A search for them.

Printed are, for the centre of mass (u, v) over a side and the speed w: (2, 3.5, 320) with r = (20, 20, 20), and
(2.8, 3.8, 263) with r = (10, 10, 20); and a triangle with sides 3.6, 5.75, 6.75.  Not printed are g and the unit of w
(together one number, kappa at w = 320), h, rho, on which side and from which end u is measured, and which side has
which of the r.  Everything here is written from docs/model.md, on arrays of candidates; nothing of the package is used.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import differential_evolution, minimize

__all__ = ["CASES", "Case", "Placed", "found_constants", "outside", "residuals"]

Array = npt.NDArray[np.float64]

PRINTED = ((2.0, 3.5, 320.0), (2.8, 3.8, 263.0))
TARGETS = np.array([[20.0, 20.0, 20.0], [10.0, 10.0, 20.0]])
SIDES = (3.6, 5.75, 6.75)
# Taken for a critical point that is not there, or of a flight that may have several impacts.
NONE = 80.0
# Near 0 densely: some parts flip from the first throw on, and jog only from a little farther out.
ANGLES = np.concatenate([np.geomspace(1e-8, 9e-3, 50), np.linspace(1e-2, 2.0 * np.pi, 550)])
# ln of kappa at w = 320, h; rho; then for any triangle its base, and the third corner's place over it.  No mass of the
# printed triangle's extent has a radius of gyration above 6.75 / sqrt(3); for any triangle see `largest`.
BOUNDS = ((np.log(2.0), np.log(2000.0)), (-5.0, 5.0))
PRINTED_RHO = ((0.2, 3.9),)
MORE = ((0.2, 20.0), (2.0, 20.0), (-5.0, 25.0), (1.0, 20.0))


class Case(NamedTuple):
    """A model and whether the triangle is the printed one."""

    model: str
    triangle: str


CASES = tuple(Case(model, triangle) for model in ("small angle", "exact") for triangle in ("printed", "any"))


class Placed(NamedTuple):
    """How the printed numbers are read.

    Parameters
    ----------
    lengths : tuple of float or None
        The base, on which the centre of mass is measured, and the sides after it in flip order; None: any triangle.
    from_right : bool
        Whether u is measured from the base's right end.
    twenty : int
        Which side keeps its 20: 0 is the base, 1 and 2 come after it in flip order.
    """

    lengths: tuple[float, float, float] | None
    from_right: bool
    twenty: int


def placements(triangle: str) -> list[Placed]:
    """List every way to read the printed numbers."""
    orders: list[Any] = list(itertools.permutations(SIDES)) if triangle == "printed" else [None]
    # any triangle may be mirrored: reading u from the other end is another triangle
    ends = (False, True)
    return [Placed(order, end, twenty) for order in orders for end in ends for twenty in range(3)]


def corner(lengths: tuple[float, float, float]) -> tuple[float, float]:
    """Return the third corner over the base; the side after the base joins it to the base's left end."""
    base, after, last = lengths
    x = (base**2 + after**2 - last**2) / (2.0 * base)
    return x, float(np.sqrt(after**2 - x**2))


def feet(base: Array, x: Array, y: Array, along: Array, above: float) -> tuple[Array, Array, Array]:
    """Return a, d and the length of the base and the two sides after it in flip order, last axis.

    Flips turn the part about its left corner: the side after the base is the one from the third corner to the base's
    left end, resting with the third corner to the left.
    """
    zero = np.zeros_like(base)
    corners = [(zero, zero), (base, zero), (x, y)]
    a, d, length = [], [], []
    for left, right in ((0, 1), (2, 0), (1, 2)):
        (px, py), (qx, qy) = corners[left], corners[right]
        size = np.hypot(qx - px, qy - py)
        ex, ey = (qx - px) / size, (qy - py) / size
        a.append((along - px) * ex + (above - py) * ey)
        d.append((above - py) * ex - (along - px) * ey)
        length.append(size)
    return np.stack(a, -1), np.stack(d, -1), np.stack(length, -1)


def largest(base: Array, x: Array, y: Array, along: Array, above: float) -> Array:
    """Return the largest squared radius of gyration of a body in the triangle with that centre: mass in the corners."""
    third = above / y
    right = (along - third * x) / base
    squares = [along**2 + above**2, (base - along) ** 2 + above**2, (x - along) ** 2 + (y - above) ** 2]
    return (1.0 - right - third) * squares[0] + right * squares[1] + third * squares[2]


def small_angle(a: Array, d: Array, kappa: Array, h: Array, rho: Array) -> Array:
    """First root beyond a of the paper's K = V, a quadratic in R; `NONE` where there is none."""
    ell, m = np.hypot(a, d), rho**2 + a**2 + d**2
    big = rho**2 + 2.0 * a**2 + d**2 + d * h
    two, one = a**2 / (2.0 * m), 2.0 * a - a * big / m
    none = big**2 / (2.0 * m) - kappa * (ell - d) - 2.0 * a**2
    root = np.sqrt(np.maximum(one**2 - 4.0 * two * none, 0.0))
    real = one**2 > 4.0 * two * none
    first, second = ((-one + sign * root) / (2.0 * two) for sign in (-1.0, 1.0))
    found = np.where(first > np.maximum(a, 0.0), first, second)
    return np.where(real & (found > np.maximum(a, 0.0)) & (found < NONE), found, NONE)


def exact(a: Array, d: Array, kappa: Array, h: Array, rho: Array) -> Array:
    """First change of the signed decision, followed along the impact angle: R is a function of it where kappa > ell."""
    a, d, kappa, h, rho = (np.asarray(value)[..., None] for value in np.broadcast_arrays(a, d, kappa, h, rho))
    s, v = np.sin(ANGLES), 1.0 - np.cos(ANGLES)
    R = (a * s - d * v) / ANGLES + 0.5 * kappa * ANGLES
    ell, m = np.hypot(a, d), rho**2 + a**2 + d**2
    X, H = a * (1.0 - v) - d * s, a * s + d * (1.0 - v)
    omega = (rho**2 + X * (R - kappa * ANGLES) + H * (h + d)) / m
    F = 0.5 * m * omega * np.abs(omega) - np.sign(X) * kappa * (ell - H)
    changes = (F[..., 1:] > 0.0) != (F[..., :-1] > 0.0)
    k = changes.argmax(-1)[..., None]
    before, after = np.take_along_axis(F, k, -1), np.take_along_axis(F, k + 1, -1)
    at, to = np.take_along_axis(R, k, -1), np.take_along_axis(R, k + 1, -1)
    found = (at + (to - at) * before / (before - after))[..., 0]
    there = changes.any(-1) & (kappa > ell)[..., 0] & (found < NONE)
    return np.where(there, found, NONE)


def residuals(case: Case, placed: Placed, candidates: Array) -> Array:
    """Critical points less targets, for candidates of shape (count, unknowns): shape (count, 6)."""
    kappa, h, rho = np.exp(candidates[:, 0]), candidates[:, 1], candidates[:, 2]
    if placed.lengths is None:
        base, x, y = (candidates[:, k] for k in (3, 4, 5))
    else:
        base = np.full(kappa.size, placed.lengths[0])
        x, y = (np.full(kappa.size, value) for value in corner(placed.lengths))
    first = small_angle if case.model == "small angle" else exact
    rows = []
    for (u, v, w), targets in zip(PRINTED, TARGETS, strict=True):
        along = base - u if placed.from_right else np.full_like(base, u)
        a, d, length = feet(base, x, y, along, v)
        scale = (kappa * (PRINTED[0][2] / w) ** 2)[:, None]
        r = first(a, d, scale, h[:, None], rho[:, None])
        if (
            case.triangle == "any"
        ):  # there the part has to rest on every side; see `outside` for the printed one
            tips = np.maximum(np.maximum(-a, a - length), -d).max(-1, keepdims=True)
            heavy = (rho**2 - largest(base, x, y, along, v))[:, None]
            beyond = np.maximum(tips, 0.0) + np.maximum(heavy, 0.0)
            r = np.where(beyond > 0.0, NONE + beyond, r)
        # targets are (r_0, r_1, r_2), r_2 that of the side that keeps its 20
        order = [(placed.twenty + 1 + k) % 3 for k in range(3)]
        rows.append(r[:, order] - targets)
    return np.concatenate(rows, axis=1)


def outside() -> float:
    """Return how far outside the printed triangle the first centre of mass lies, laid as well as can be."""
    worst = []
    for placed in placements("printed"):
        assert placed.lengths is not None
        x, y = (np.array([value]) for value in corner(placed.lengths))
        base, (u, v, _) = np.array([placed.lengths[0]]), PRINTED[0]
        _, d, _ = feet(base, x, y, base - u if placed.from_right else np.array([u]), v)
        worst.append(float((-d).max()))
    return min(worst)


def found_constants(
    case: Case, seed: int, generations: int, tell: Callable[[str], None] | None = None
) -> dict[str, Any]:
    """Search all readings for the constants with the least rms of the six residuals."""
    bounds = BOUNDS + (MORE if case.triangle == "any" else PRINTED_RHO)
    best: dict[str, Any] = {"rms": np.inf}
    for number, placed in enumerate(placements(case.triangle)):
        if tell is not None and number % 6 == 0:
            tell(f"{case.model}, {case.triangle} triangle: reading {number + 1}, best rms {best['rms']:.2f}")

        def cost(columns: Array, placed: Placed = placed) -> Array:
            return np.sqrt((residuals(case, placed, np.atleast_2d(columns.T)) ** 2).mean(axis=1))

        evolved = differential_evolution(
            cost,
            bounds,
            maxiter=generations,
            popsize=20,
            tol=1e-6,
            vectorized=True,
            updating="deferred",
            polish=False,
            rng=np.random.default_rng([seed, number]),
        )
        polished = minimize(
            lambda at: float(cost(at)[0]),
            evolved.x,
            method="Nelder-Mead",
            bounds=bounds,
            options={"maxfev": 2000, "xatol": 1e-8, "fatol": 1e-10},
        )
        if polished.fun < best["rms"]:
            best = {"rms": float(polished.fun), "placed": placed._asdict(), "at": polished.x.tolist()}
    best["residuals"] = residuals(case, Placed(**best["placed"]), np.array([best["at"]]))[0].tolist()
    return best
