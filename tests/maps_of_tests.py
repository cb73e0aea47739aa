"""Maps with answers on paper, and an image method, that only tests use, added from outside the package as users do."""

from __future__ import annotations

import math
from typing import NamedTuple
from unittest import mock

import numpy as np

import limitsets as ls
import limitsets.numbers.interval as iv
from limitsets.numbers.interval import Interval
from limitsets.numbers.interval.number import hull_of
from limitsets.numbers.jit import proof_kernel
from limitsets.systems.cells import Grid
from limitsets.systems.graph.images import METHODS
from limitsets.systems.graph.images.sampled import sampled
from limitsets.systems.graph.images.undecided import SamplePoints
from limitsets.systems.maps import OUTSIDE
from limitsets.systems.maps.derived import NO_WITNESS
from limitsets.systems.maps.textbook.shared import Line, Plane, Point, plane


@proof_kernel
def plane_of_two(
    first: bool, a: tuple[Interval, Interval], second: bool, b: tuple[Interval, Interval], side: int
) -> Plane:
    """Images of branches 0 and 1 in the plane, each as far as it is possible."""
    n, zero, _, witness = plane(a, side, 0)
    m, one, _, _ = plane(b, side, 1)
    sound = ((n == 1) | (not first)) & ((m == 1) | (not second))
    count = (1 if first else 0) + (1 if second else 0)
    return count if sound & (count > 0) else -1, zero if first else one, one, witness


class Contraction(NamedTuple):
    """x' = slope x + offset, a contraction for abs(slope) < 1.

    Known answer: the fixed point offset / (1 - slope) attracts everything; the Lyapunov exponent is
    ln abs(slope).

    Attributes
    ----------
    slope : float
        Factor per step.
    offset : float
        Image of 0.
    """

    slope: float = 0.5
    offset: float = 0.0


def _contraction(params: Contraction, x: float, side: int) -> tuple[float, int, int]:
    after = params.slope * x + params.offset
    return after, side, 0 if abs(after) < math.inf else OUTSIDE


def _contraction_on(params: Contraction, x: float, side: int, branch: int) -> tuple[float, int, float]:
    return params.slope * x + params.offset, side, params.slope


ls.register(Contraction, image=_contraction, image_on=_contraction_on)


class Tent(NamedTuple):
    """x' = slope x up to 1/2 and slope (1 - x) beyond; without boxes or slopes of its own, as a user writes it down.

    Known answers: the core [slope (1 - slope/2), slope/2] is invariant, every slope is +-slope, and slope/(1 + slope)
    is a fixed point.

    Attributes
    ----------
    slope : float
        Between sqrt 2 and 2.
    """

    slope: float = 1.9


def _tent(params: Tent, x: float, side: int) -> tuple[float, int, int]:
    return (params.slope * (1.0 - x), side, 1) if x > 0.5 else (params.slope * x, side, 0)


def _tent_on(params: Tent, x: float, side: int, branch: int) -> tuple[float, int]:
    if branch == 1:
        return params.slope * (1.0 - x), side
    return params.slope * x, side


def _tent_margin(params: Tent, x: float, side: int) -> float:
    return x - 0.5


ls.register(Tent, image=_tent, image_on=_tent_on, margin=_tent_margin, branches=("up", "down"))


class Linear2(NamedTuple):
    """(x, y)' = (xx x + xy y, yx x + yy y); by default the saddle diag(0.5, 2).

    Known answers: the unstable set of the saddle is the y axis. For f = (x, y/2), that is
    ``Linear2(1.0, 0.0, 0.0, 0.5)``, the relative attractor of [-1, 1]^2 is the x axis.

    Attributes
    ----------
    xx, xy, yx, yy : float
        Entries of the matrix, row by row.
    """

    xx: float = 0.5
    xy: float = 0.0
    yx: float = 0.0
    yy: float = 2.0


def _linear(params: Linear2, x: Point, side: int) -> tuple[Point, int, int]:
    u = params.xx * x[0] + params.xy * x[1]
    v = params.yx * x[0] + params.yy * x[1]
    return (u, v), side, 0 if (abs(u) < math.inf) & (abs(v) < math.inf) else OUTSIDE


def _linear_on(params: Linear2, x: Point, side: int, branch: int) -> tuple[Point, int, tuple[Point, Point]]:
    u = params.xx * x[0] + params.xy * x[1]
    v = params.yx * x[0] + params.yy * x[1]
    return (u, v), side, ((params.xx, params.xy), (params.yx, params.yy))


ls.register(Linear2, image=_linear, image_on=_linear_on, dimension=2)


class Baker(NamedTuple):
    """(x, y)' = (2 x, c y) for x < 1/2, else (2 x - 1, c y + 1 - c), on 0 <= x <= 1; c is the contraction.

    Known answers: Lyapunov exponents ln 2 and ln c; for c = 1/2 areas are kept, and the invariant measure is
    uniform.

    Attributes
    ----------
    contraction : float
        Factor across the dough, 0 < contraction <= 1/2.

    Notes
    -----
    Doubles are multiples of a power of 2, so every x ends in 0, as for `limitsets.maps.Doubling`.
    """

    contraction: float = 0.5


def _baker(params: Baker, x: Point, side: int) -> tuple[Point, int, int]:
    right = x[0] >= 0.5
    u = 2.0 * x[0] - 1.0 if right else 2.0 * x[0]
    v = params.contraction * x[1]
    v = v + (1.0 - params.contraction) if right else v
    code = 1 if right else 0
    return (u, v), side, code if (x[0] >= 0.0) & (x[0] <= 1.0) & (abs(v) < math.inf) else OUTSIDE


def _baker_on(params: Baker, x: Point, side: int, branch: int) -> tuple[Point, int, tuple[Point, Point]]:
    c = params.contraction
    slope = ((2.0, 0.0), (0.0, c))
    if branch == 1:
        return (2.0 * x[0] - 1.0, c * x[1] + (1.0 - c)), side, slope
    return (2.0 * x[0], c * x[1]), side, slope


def _baker_box(params_lo: Baker, params_hi: Baker, lo: Point, hi: Point, side: int) -> Plane:
    """Both branches at x = 1/2; products with 2 are exact, and the unit square is not left by rounding."""
    c, y = Interval(params_lo.contraction, params_hi.contraction), Interval(lo[1], hi[1])
    dough = (lo[0] >= 0.0) & (hi[0] <= 1.0)
    # c y + 1 - c = 1 - c (1 - y), with each number once
    thin, lifted = c * y, 1.0 - c * (1.0 - y)
    bottom = 0.0 if (c.lo >= 0.0) & (y.lo >= 0.0) else -math.inf
    top = 1.0 if (c.lo >= 0.0) & (y.hi <= 1.0) else math.inf
    left = Interval(2.0 * lo[0], min(2.0 * hi[0], 1.0)), Interval(max(thin.lo, bottom), thin.hi)
    right = Interval(2.0 * lo[0], 2.0 * hi[0]) - 1.0
    moved = Interval(max(right.lo, 0.0), min(right.hi, 1.0)), Interval(lifted.lo, min(lifted.hi, top))
    return plane_of_two(dough & (lo[0] <= 0.5), left, dough & (hi[0] >= 0.5), moved, side)


ls.register(
    Baker, image=_baker, image_on=_baker_on, image_box=_baker_box, dimension=2, branches=("left", "right")
)


class Product(NamedTuple):
    """x_i' = x_i / (pole - x_i) in each of two coordinates, for x_i < pole.

    Known answers for pole = 2 on [0, 1.2]^2: four fixed points, with slopes 1/2 at 0 and 2 at 1; the order of
    the recurrent sets is the diamond (1, 1) -> (1, 0), (0, 1) -> (0, 0), and (0, 0) attracts.

    Attributes
    ----------
    pole : float
        Where the image is infinite; the second fixed point is at pole - 1.
    """

    pole: float = 2.0


def _product(params: Product, x: Point, side: int) -> tuple[Point, int, int]:
    u, v = x[0] / (params.pole - x[0]), x[1] / (params.pole - x[1])
    inside = (x[0] < params.pole) & (x[1] < params.pole) & (abs(u) < math.inf) & (abs(v) < math.inf)
    return (u, v), side, 0 if inside else OUTSIDE


def _product_on(params: Product, x: Point, side: int, branch: int) -> tuple[Point, int, tuple[Point, Point]]:
    left, below = params.pole - x[0], params.pole - x[1]
    slope = ((params.pole / (left * left), 0.0), (0.0, params.pole / (below * below)))
    return (x[0] / left, x[1] / below), side, slope


@proof_kernel
def _moebius(pole: Interval, lo: float, hi: float) -> Interval:
    """Exact range of x / (pole - x) left of the pole: monotone in x; nan or infinite where it may be met."""
    low, high = Interval(lo, lo), Interval(hi, hi)
    after = hull_of(low / (pole - low), high / (pole - high))
    left = (pole - high).lo > 0.0
    least = max(after.lo, 0.0) if lo >= 0.0 else after.lo
    return Interval(least if left else -math.inf, after.hi if left else math.inf)


def _product_box(params_lo: Product, params_hi: Product, lo: Point, hi: Point, side: int) -> Plane:
    pole = Interval(params_lo.pole, params_hi.pole)
    return plane((_moebius(pole, lo[0], hi[0]), _moebius(pole, lo[1], hi[1])), side, 0)


ls.register(Product, image=_product, image_on=_product_on, image_box=_product_box, dimension=2)


class TwoState(NamedTuple):
    """(x, y)' = (r, r) for x >= 0, (-r, -r) for x < 0; for r < 1/2 the origin in both cases.

    Known answers: for r = 1 on [-2, 2]^2 two attractors with half of the starts each; for r < 1/2 one.

    Attributes
    ----------
    r : float
        Where the two states lie.
    """

    r: float = 1.0


def _two_state(params: TwoState, x: Point, side: int) -> tuple[Point, int, int]:
    reach = params.r if params.r >= 0.5 else 0.0
    after = reach if x[0] >= 0.0 else -reach
    code = 1 if x[0] >= 0.0 else 0
    return (after, after), side, code if (abs(x[0]) < math.inf) & (abs(x[1]) < math.inf) else OUTSIDE


def _two_state_on(
    params: TwoState, x: Point, side: int, branch: int
) -> tuple[Point, int, tuple[Point, Point]]:
    reach = params.r if params.r >= 0.5 else 0.0
    after = reach if branch == 1 else -reach
    return (after, after), side, ((0.0, 0.0), (0.0, 0.0))


def _two_state_box(params_lo: TwoState, params_hi: TwoState, lo: Point, hi: Point, side: int) -> Plane:
    """Both states on x = 0."""
    r = (params_lo.r, params_hi.r)
    # below 1/2 both states are the origin
    reach = Interval(r[0] if r[0] >= 0.5 else 0.0, r[1] if r[1] >= 0.5 else 0.0)
    down = -reach
    return plane_of_two(lo[0] <= 0.0, (down, down), hi[0] >= 0.0, (reach, reach), side)


ls.register(
    TwoState,
    image=_two_state,
    image_on=_two_state_on,
    image_box=_two_state_box,
    dimension=2,
    branches=("down", "up"),
)


class ThreeState(NamedTuple):
    """x' = -value for x < -edge, 0 for -edge <= x <= edge, value for x > edge.

    Known answer: for value > edge three attractors, whose basins are the three intervals.

    Attributes
    ----------
    value : float
        Where the outer states lie.
    edge : float
        Where the basins end.
    """

    value: float = 2.0
    edge: float = 1.0


def _three_state(params: ThreeState, x: float, side: int) -> tuple[float, int, int]:
    code = 1 if x >= -params.edge else 0
    code = 2 if x > params.edge else code
    after = params.value * (code - 1.0)
    return after, side, code if abs(x) < math.inf else OUTSIDE


def _three_state_on(params: ThreeState, x: float, side: int, branch: int) -> tuple[float, int, float]:
    return params.value * (branch - 1.0), side, 0.0


def _three_state_box(params_lo: ThreeState, params_hi: ThreeState, lo: float, hi: float, side: int) -> Line:
    """Both values at an edge.  A box over both edges has the first slot from low to middle, the second up to high."""
    v, edge = (params_lo.value, params_hi.value), (params_lo.edge, params_hi.edge)
    low, high = lo <= -edge[0], hi >= edge[0]
    middle = (hi >= -edge[1]) & (lo <= edge[1])
    zero = (0.0, 0.0)
    below, above = iv.neg(v), v
    # Slot 0 holds the lowest value that is possible, slot 1 the highest; the middle is with either or alone.
    first = below if low else (zero if middle else above)
    last = above if high else (zero if middle else below)
    first = iv.hull(first, zero) if low & middle & high else first
    code_first = 0 if low else (1 if middle else 2)
    code_last = 2 if high else (1 if middle else 0)
    two = code_first != code_last
    sound = (v[1] - v[0] < math.inf) & (abs(lo) < math.inf) & (abs(hi) < math.inf) & (low | middle | high)
    count = 2 if two else 1
    return (
        count if sound else -1,
        (first[0], first[1], side, code_first),
        (last[0], last[1], side, code_last),
        NO_WITNESS,
    )


ls.register(
    ThreeState,
    image=_three_state,
    image_on=_three_state_on,
    image_box=_three_state_box,
    branches=("low", "middle", "high"),
)


DOMAINS: dict[type, tuple[tuple[float, float], ...]] = {
    Contraction: ((-1.0, 1.0),),
    Linear2: ((-1.0, 1.0), (-1.0, 1.0)),
    Baker: ((0.0, 1.0), (0.0, 1.0)),
    Product: ((0.0, 1.2), (0.0, 1.2)),
    TwoState: ((-2.0, 2.0), (-2.0, 2.0)),
    ThreeState: ((-3.0, 3.0),),
}


def _middles(grid: Grid, side: int) -> SamplePoints:
    """One point a cell, its middle."""
    axes = tuple(0.5 * (edges[1:] + edges[:-1]) for edges in grid.edges[side])
    shape = grid.shape[side]
    strides = tuple(math.prod(shape[axis + 1 :].tolist()) for axis in range(grid.dimension))
    return SamplePoints(axes, strides, np.zeros(1, np.int64))


with_middles = mock.patch.dict(METHODS, {"middles": sampled(_middles)})
"""An image method of the tests' own: the image of its middle stands for a cell, so that images of others are missed."""


# ---------------------------------------------------------------- plain functions, for `limitsets.map`


def place(x):
    return x


def beyond_half(x):
    return x - 0.5


def affine(x, a, b):
    return a * x + b


def stretched(x, b):
    return b * x


def falling(x, b):
    return b * (1.0 - x)


def logistic(x, r):
    return r * x * (1.0 - x)


def ricker(x, r):
    return x * math.exp(r * (1.0 - x))


def odd(x, a, c=0.0):
    return a * x - x**3 + c


def turned(x, omega, k):
    y = x + omega - k / math.tau * np.sin(math.tau * x)
    return y - np.floor(y)


def henon(x, y, a, b):
    return 1.0 - a * x**2 + y, b * x


def spiral(x, y, c, s, bend):
    return c * x - s * y + bend * x**2, s * x + c * y


def rivals(x, y):
    return 3.0 * x / (1.0 + x + 2.0 * y), 3.0 * y / (1.0 + y + 2.0 * x)


def left_line(x, s, u, v):
    return s * x + u


def right_line(x, s, u, v):
    return s * x + v


def tent(b):
    return ls.map(pieces=(stretched, falling), margin=beyond_half, b=b)


def two_lines(s, u, v):
    """s x + u up to 0, and s x + v beyond."""
    return ls.map(pieces=(left_line, right_line), margin=place, s=s, u=u, v=v)
