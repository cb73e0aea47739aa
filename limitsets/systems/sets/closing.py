"""Periodic orbits as answers, and orbits that close: by Newton's method, and then under `image` itself.

For points x_0 .. x_p-1 with slopes S_j the corrections d_j solve S_j d_j - d_j+1 = x_j+1 - f(x_j), p equations at once,
so that no point inherits the errors of those before it.  A computed step differs from the exact one by rounding,

    a_j = 64 eps (scale + |f(x_j)| + |S_j| |x_j|) + 4 noise ,

where noise is how far images of points very near the orbit are from the tangents there, for formulas that cancel.  The
orbit counts where |f(x_j) - x_j+1| <= a_j for each j, with f the kernel `image` on whatever branch it takes.  Then its
points are known to |J^-1| a, with J the matrix of the equations: orbits nearer than that are one.

A map on a circle or torus has a seam, where a formula jumps by one turn, or the domain closes.  A point on it has two
names, 0 and 1, and rounding chooses.  Two such orbits are one if their points differ by the jump and their slopes do
not differ.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError, Column, Table, Tabled
from limitsets.systems.cells import Domain
from limitsets.systems.maps.drivers import images
from limitsets.systems.sets.end_points import EPS

# ----------------------------------------------------------------
# Periodic orbits as answers: one cycle, and a tuple of them.


Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# Orbits closer than this are one, relative to the extent of x.
NEAR = 1e-9


@dataclass(frozen=True, eq=False)
class Cycle:
    """A periodic orbit.

    Attributes
    ----------
    x : ndarray, shape (p,) or (p, 2)
        Its points in the order of the steps, beginning with the least x on the least side.
    side, branches : ndarray of int, shape (p,)
        Side of each point, and the branch taken from it.
    multiplier : float
        Derivative of F^p along the orbit; in two dimensions the largest modulus of its eigenvalues.  The orbit attracts
        where it is below 1 in modulus.
    residual, rounding : float
        Largest distance between the image of a point and the next, on the branch that the map takes there; and what the
        rounding of a step may come to, which the residual does not exceed at any point.
    """

    x: Array
    side: Ints
    branches: Ints
    multiplier: float
    residual: float
    rounding: float

    @property
    def period(self) -> int:
        """p, the smallest one."""
        return int(self.side.size)


class Cycles(tuple[Cycle, ...], Tabled):
    """Cycles by period, then by their least point; a tuple that knows how it came about.

    Attributes
    ----------
    complete : bool
        Whether every itinerary was followed: then none is missing, up to rounding and, where a composed branch bends
        several times across the diagonal between two samples, up to sampling.
    how : str
        The method, and what was cut short.
    """

    complete: bool
    how: str

    def __new__(cls, found: Iterable[Cycle], *, complete: bool, how: str) -> Self:
        """Make a tuple with `complete` and `how`."""
        self = super().__new__(cls, found)
        self.complete, self.how = complete, how
        return self

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [
            (k, each.period, step, side, x, each.multiplier, each.residual)
            for k, each in enumerate(self)
            for step, (side, x) in enumerate(zip(each.side.tolist(), each.x.tolist(), strict=True))
        ]
        heads = ("cycle", "period", "step", "side", Column("x", show=_place))
        more = (Column("multiplier", show=".6g"), Column("residual", show=".1e"))
        return (Table((*heads, *more), rows, f"Cycles: {self.how}", "sampled, not proved"),)


def _place(x: Any) -> str:
    """Write a point, of one dimension or more."""
    return ", ".join(f"{each:.9g}" for each in x) if isinstance(x, list) else f"{x:.9g}"


def require_period(up_to: int) -> None:
    """Refuse a largest period below 1."""
    if up_to < 1:
        raise AnswerError("the largest period", up_to, "an integer from 1", "pass up_to=8")


# ----------------------------------------------------------------
# Orbits that close: Newton's method at all points of a cycle at once, then `image` itself has to run through it.


# Rounding of a step in units of the last place; the largest correction, and the largest uncertainty of a point that is
# believed, relative to the extent of x.
ROUNDING, FARTHEST, VAGUE = 64.0, 1e-6, 1e-4

# The distance, relative to the extent of x, at which a step is compared with its tangent: curvature is nothing there.
BESIDE = 1.7e-10

# Numbers of one matrix, and of all that are inverted together.
AT_ONCE = 1 << 22

Slopes = Callable[[Array, Ints, Ints], Array]
"""Derivatives (n, d, d) of the steps from states (n, d) with sides and branches."""

Onward = Callable[[Array, Ints], tuple[Array, Ints, Ints]]
"""From points of cycles (m, p, d) with sides to their images, sides, codes."""

Measured = Callable[[Array], tuple[Array, Array]]


class Closed(NamedTuple):
    """A cycle, and what tells it from others: derivatives, jumps of the image beside each point, uncertainty."""

    cycle: Cycle
    slopes: Array
    jumps: Array
    near: float


def stepped(params: Any, x: Array, side: Ints) -> tuple[Array, Ints, Ints]:
    """Take one step from states of any shape (..., d): images, sides, codes."""
    flat, sides = x.reshape(-1, x.shape[-1]), side.ravel()
    after, to, code = np.empty_like(flat), np.empty_like(sides), np.empty_like(sides)
    for s in np.unique(sides).tolist():
        mine = sides == s
        image = images(params, flat[mine, 0] if flat.shape[1] == 1 else flat[mine], s)
        after[mine], to[mine], code[mine] = image.x.reshape(-1, flat.shape[1]), image.side, image.code
    return after.reshape(x.shape), to.reshape(side.shape), code.reshape(side.shape)


def _onward(params: Any, domain: Domain | None, x: Array, side: Ints) -> tuple[Array, Ints, Ints]:
    """Step from the points of cycles (m, p, d); along axes that close, to the image nearest to the next point."""
    after, to, code = stepped(params, x, side)
    if domain is not None and domain.closes:
        after = _ahead(x) + domain.shortest(after - _ahead(x), _ahead(side))
    return after, to, code


def _at_seam(domain: Domain | None, x: Array, side: Ints, near: float) -> Array:
    """Period where a coordinate has two names, one at each end of an axis that closes; 0 elsewhere."""
    if domain is None:
        return np.zeros_like(x)
    seam = np.minimum(x - domain.lo[side], domain.hi[side] - x) <= near
    return np.where(seam, domain.period[side], 0.0)


def _ahead(x: Any) -> Any:
    """Turn to what stands at the next point of each orbit."""
    return np.roll(x, -1, axis=1)


def _offsets(dimension: int) -> Iterator[Array]:
    """Directions to all sides: of the axes, and between them."""
    return (np.array(way) for way in product((1.0, -1.0, 0.0), repeat=dimension) if any(way))


def _inverse(slope: Array) -> Array:
    """Invert J for many orbits, shape (m, p d, p d); huge where it is singular."""
    m, p, d = slope.shape[:3]
    whole = np.zeros((m, p, d, p, d))
    for j in range(p):
        whole[:, j, :, j] += slope[:, j]
        whole[:, j, :, (j + 1) % p] -= np.eye(d)
    matrix = whole.reshape(m, p * d, p * d)
    try:
        return np.asarray(np.linalg.inv(matrix))
    except np.linalg.LinAlgError:  # one of them: all are moved by less than what is vague anyway
        return np.asarray(np.linalg.inv(matrix + 2.0**-40 * np.eye(p * d)))


@np.errstate(all="ignore")  # orbits that run away
def corrected(measured: Measured, x: Array, scale: float, steps: int) -> Array:
    """Newton's method at all points (m, p, d) at once; orbits that it would move far stay where they are."""
    for _ in range(steps):
        after, slope = measured(x)
        miss = (after - _ahead(x)).reshape(len(x), x[0].size, 1)
        usable = np.isfinite(miss).all(axis=(1, 2)) & np.isfinite(slope).all(axis=(1, 2, 3))
        if not usable.any():
            break
        move = np.zeros_like(x)
        move[usable] = -(_inverse(slope[usable]) @ miss[usable]).reshape(x[usable].shape)
        near = np.isfinite(move).all(axis=(1, 2)) & (np.abs(move).max(axis=(1, 2)) < FARTHEST * scale)
        x = np.where(near[:, None, None], x + move, x)
    return x


def _beside(onward: Onward, slopes: Slopes, side: Ints, scale: float) -> Measured:
    """Measure steps by `image`, of points on the far side of a seam by a point just across it."""

    def measured(x: Array) -> tuple[Array, Array]:
        at = x.copy()
        after, to, code = onward(x, side)

        def miss(after: Array, to: Ints, code: Ints) -> Array:
            far = np.abs(after - _ahead(x)).max(axis=-1)
            return np.where((code >= 0) & (to == _ahead(side)) & np.isfinite(far), far, np.inf)

        best = miss(after, to, code)
        for way in _offsets(x.shape[-1]):
            if not (best > FARTHEST * scale).any():
                break
            tried = x + BESIDE * scale * way
            step = onward(tried, side)
            better = (best > FARTHEST * scale) & (miss(*step) < best)
            at[better], after[better], code[better] = tried[better], step[0][better], step[2][better]
            best = np.where(better, miss(*step), best)
        slope = _slopes(slopes, at, side, code)
        return after - np.einsum("mpij,mpj->mpi", slope, at - x), slope

    return measured


def _slopes(slopes: Slopes, x: Array, side: Ints, code: Ints) -> Array:
    d = x.shape[-1]
    return slopes(x.reshape(-1, d), side.ravel(), np.maximum(code, 0).ravel()).reshape(*x.shape, d)


@np.errstate(all="ignore")  # images that are not there
def _noise(
    onward: Onward, x: Array, side: Ints, after: Array, slope: Array, scale: float
) -> tuple[Array, Array]:
    """How far images just beside each point are from the tangent: rounding, and jumps, along each coordinate."""
    noise, jumps = np.zeros_like(x), np.zeros_like(x)
    for way in _offsets(x.shape[-1]):
        there, to, code = onward(x + BESIDE * scale * way, side)
        off = np.abs(there - after - BESIDE * scale * slope @ way)
        off[~np.isfinite(off) | (code < 0)[..., None] | (to != _ahead(side))[..., None]] = 0.0
        jumps = np.maximum(jumps, np.where(off > NEAR * scale, off, 0.0))
        noise = np.maximum(noise, np.where(off > NEAR * scale, 0.0, off))
    return noise, jumps


def closed(
    params: Any,
    x: Array,
    side: Ints,
    scale: float,
    slopes: Slopes,
    *,
    seams: bool = False,
    domain: Domain | None = None,
) -> list[Closed]:
    """Orbits (m, p, d) with sides (m, p) that close under `image`, each corrected; the others are left out.

    `seams`: names of points on a seam are tried until `image` keeps to them.  `domain`: axes of it may close.
    """
    some = max(1, AT_ONCE // (x.shape[1] * x.shape[2]) ** 2)
    return [
        one
        for k in range(0, len(x), some)
        for one in _closed(params, domain, x[k : k + some], side[k : k + some], scale, slopes, seams=seams)
    ]


@np.errstate(all="ignore")  # orbits that run away, which are left out
def _closed(
    params: Any, domain: Domain | None, x: Array, side: Ints, scale: float, slopes: Slopes, *, seams: bool
) -> list[Closed]:
    onward = partial(_onward, params, domain)
    measured = _beside(onward, slopes, side, scale)
    x = corrected(measured, x, scale, 3)
    after, slope = measured(x)
    noise, jumps = _noise(onward, x, side, after, slope, scale)
    size = scale + np.abs(after) + np.einsum("mpij,mpj->mpi", np.abs(slope), np.abs(x))
    rounding = ROUNDING * EPS * size + 4.0 * noise.max(axis=(1, 2))[:, None, None]
    done, points, branches, missed = (
        np.zeros(len(x), dtype=bool),
        x.copy(),
        np.zeros_like(side),
        np.zeros_like(x),
    )
    for way in (None, np.zeros(x.shape[-1]), *(_offsets(x.shape[-1]) if seams else ())):
        tried = x
        if way is not None:  # what `image` itself calls the points
            tried = np.roll(onward(x + 4.0 * EPS * scale * way, side)[0], 1, axis=1)
        landing, to, code = onward(tried, side)
        miss = np.abs(landing - _ahead(tried))
        good = ((code >= 0) & (to == _ahead(side)) & (miss <= rounding).all(axis=-1)).all(axis=1) & ~done
        points[good], branches[good], missed[good] = tried[good], code[good], miss[good]
        done |= good
        if done.all():
            break
    if domain is not None:
        points = domain.wrapped(points.reshape(side.size, -1), side.ravel()).reshape(x.shape)
    kept: list[Closed] = []
    for k in np.flatnonzero(done).tolist():
        slope_of = _slopes(slopes, points[k : k + 1], side[k : k + 1], branches[k : k + 1])[0]
        about = np.abs(_inverse(slope[k : k + 1])[0]) @ rounding[k].ravel()
        near = float(np.clip(2.0 * np.nanmax(np.append(about, 0.0)), NEAR * scale, VAGUE * scale))
        first = int(np.lexsort((*points[k].T[::-1], side[k]))[0])
        turned = [np.roll(each, -first, axis=0) for each in (points[k], side[k], branches[k], slope_of)]
        jump = np.roll(jumps[k], 1 - first, axis=0)  # of the image that lands there
        jump = np.maximum(jump, _at_seam(domain, turned[0], turned[1], near))
        at = turned[0][:, 0] if x.shape[-1] == 1 else turned[0]
        most = float(missed[k].max()), float(rounding[k].max())
        cycle = Cycle(at, turned[1], turned[2], _multiplier(turned[3]), *most)
        kept.append(Closed(cycle, turned[3], jump, near))
    return kept


def _multiplier(slopes: Array) -> float:
    """Find the derivative of all steps together, in the plane the largest modulus of its eigenvalues."""
    if slopes.shape[1] == 1:
        return float(np.prod(slopes))
    total = np.eye(slopes.shape[1])
    for slope in slopes:
        total = slope @ total
    return float(np.abs(np.linalg.eigvals(total)).max())


# ---------------------------------------------------------------- each orbit once


def _same(one: Closed, other: Closed, shift: int) -> bool:
    """Whether the points of two cycles of one period are the same, the second taken `shift` steps ahead."""
    near = max(one.near, other.near)
    ahead = [np.roll(each, -shift, axis=0) for each in (other.cycle.side, other.cycle.x, other.jumps)]
    if (one.cycle.side != ahead[0]).any():
        return False
    gap = np.abs(one.cycle.x - ahead[1]).reshape(one.jumps.shape)
    agree = gap <= near
    if agree.all():
        return True
    turn = np.maximum(one.jumps, ahead[2])
    across = (turn > 0.0) & (np.abs(gap - turn) <= near)
    slopes = np.roll(other.slopes, -shift, axis=0)
    return bool((agree | across).all() and np.allclose(one.slopes, slopes, rtol=1e-6, atol=1e-6))


def distinct(orbits: Iterable[Closed]) -> list[Cycle]:
    """Each orbit once, with its smallest period, by period and least point."""
    by_period: dict[int, list[Closed]] = {}
    for orbit in orbits:
        by_period.setdefault(orbit.cycle.period, []).append(orbit)
    return [cycle for period in sorted(by_period) for cycle in _distinct(by_period[period], period)]


def _distinct(orbits: list[Closed], period: int) -> Iterator[Cycle]:
    """Each orbit of one period once, by its least point."""
    from scipy.spatial import KDTree

    orbits.sort(key=lambda orbit: (int(orbit.cycle.side[0]), *np.atleast_1d(orbit.cycle.x[0]).tolist()))
    shorter = [d for d in range(1, period) if period % d == 0]
    orbits = [one for one in orbits if not any(_same(one, one, d) for d in shorter)]
    if not orbits:
        return
    points, jumps = (
        np.stack(each).reshape(len(orbits), period, -1)
        for each in ([orbit.cycle.x for orbit in orbits], [orbit.jumps for orbit in orbits])
    )
    # Only orbits with a point near the first point of another one, by any of their names, can be the same.
    named, number = _names(points.reshape(-1, points.shape[-1]), jumps.reshape(-1, points.shape[-1]))
    first, orbit_of_first = _names(points[:, 0], jumps[:, 0])
    widest = (1.0 + 1e-6) * max(orbit.near for orbit in orbits)  # rounding of the names
    pairs = KDTree(named).query_ball_point(first, widest, p=math.inf)
    others: list[set[int]] = [set() for _ in orbits]
    for k, meets in zip(orbit_of_first.tolist(), pairs, strict=True):
        others[k].update((number[meets] // period).tolist())
    kept: set[int] = set()
    for k, one in enumerate(orbits):
        # Points that agree to rounding may begin at another one of them.
        before = [orbits[other] for other in others[k] & kept]
        if not any(_same(one, other, shift) for other in before for shift in range(period)):
            kept.add(k)
            yield one.cycle


def _names(x: Array, jumps: Array) -> tuple[Array, Ints]:
    """All names of points (n, d), one jump further or back along any axes, and the number of the point of each."""
    names = [
        (np.array(way) * jumps, np.array(way) == 0.0) for way in product((0.0, 1.0, -1.0), repeat=x.shape[1])
    ]
    real = [np.flatnonzero((stays | (jumps > 0.0)).all(axis=1)) for _, stays in names]
    moved = [x[rows] + move[rows] for (move, _), rows in zip(names, real, strict=True)]
    return np.concatenate(moved), np.concatenate(real)
