"""Proved boxes, and slopes, of any map from the source of its plain kernels.

The kernels run on intervals and on intervals with a derivative (`limitsets.interval.Dual`).  One formula f on a box X
of states, for a box of parameters, is enclosed by what these three have in common:

* f(X), each operation in turn.
* Where df_i/dx_j has one sign on X for some j: f_i at the two ends of X_j, for all other coordinates as before.
* The mean value form f(m) + sum_j df/dx_j(X) (X_j - m_j), with m the middle; asked where a sign is open.

So the box of a map that is monotone on X is the range itself, but for rounding.  A map with two branches has a
`margin`, enclosed in the same way: where its sign is proved there is one box, where it is open there are two.

Source: Neumaier, "Interval Methods for Systems of Equations", 1990, sections 2.3 and 2.4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from limitsets.numbers.interval import Dual, Interval, intervals_between, slope_of, value_of
from limitsets.numbers.interval.number import ends_of
from limitsets.numbers.jit import generic, kernel, of_entries, proof_kernel, take_mark
from limitsets.systems.maps import kernels
from limitsets.systems.maps.kernels import (
    entries_of,
    forced,
    image,
    image_on,
    margin,
    on_side,
    on_side_box,
    pick,
    seeded,
    state_of,
)

Floats: TypeAlias = NDArray[np.float64]

# Whether the map takes a branch on a box.
UNKNOWN, NEVER, MAYBE, SURE = -1, 0, 1, 2


NO_WITNESS = (0.0, 0.0)


# ---------------------------------------------------------------- formulas


class Decision(NamedTuple):
    """The formula `margin`."""

    side: int


class OnBranch(NamedTuple):
    """The formula `image_on` of one branch."""

    side: int
    branch: int


class Whole(NamedTuple):
    """The formula `image` of a map without branches."""

    side: int


@generic(proof=True)
def _formula(form: Any, params: Any, x: Any) -> Any:
    """Value of a formula, and the side that it leads to."""


def _by_image(params: Any, x: Any, side: int, branch: int) -> Any:
    """Return the image of a map of one branch that has `image` alone: method of `forced`."""
    after, to, _ = image(params, x, side)
    return after, to


_formula.on(Decision, lambda form, params, x: (margin(params, x, form.side), form.side))
_formula.on(OnBranch, lambda form, params, x: forced(params, x, form.side, form.branch)[:2])
_formula.on(Whole, lambda form, params, x: image(params, x, form.side)[:2])


# ---------------------------------------------------------------- numbers of a box


@of_entries
def _intervals(lo: Any, k: int, hi: Any) -> Interval:
    """Sides of the box between two corners."""
    return Interval(lo, hi[k])


@of_entries
def _lows(y: Any, k: int) -> float:
    return y.lo  # type: ignore[no-any-return]  # kernels take numbers as Any


@of_entries
def _highs(y: Any, k: int) -> float:
    return y.hi  # type: ignore[no-any-return]  # kernels take numbers as Any


@of_entries
def _middle(x: Any, k: int) -> Interval:
    m = x.lo + 0.5 * (x.hi - x.lo)
    return Interval(m, m)


@of_entries
def _lifted(y: Any, k: int) -> Dual:
    """Return each entry as a `Dual` of intervals, whatever number it is."""
    value, slope = ends_of(value_of(y)), ends_of(slope_of(y))
    return Dual(Interval(value[0], value[1]), Interval(slope[0], slope[1]))


@of_entries
def _corner(x: Any, k: int, columns: Any, i: int, upper: bool) -> Interval:
    """Where f_i is least, or largest, on a box; as far as the signs of its derivatives tell."""
    slope = columns[k][i].slope
    rises, falls = slope.lo >= 0.0, slope.hi <= 0.0
    last, first = (rises, falls) if upper else (falls, rises)
    return Interval(x.hi if last else x.lo, x.lo if first & (not last) else x.hi)


# ---------------------------------------------------------------- the enclosure of one formula


@proof_kernel
def _at(form: Any, params: Any, x: Any) -> Any:
    return _lifted(entries_of(_formula(form, params, state_of(x))[0]))


@of_entries
def _columns(x: Any, k: int, form: Any, params: Any, box: Any) -> Any:
    """Values with derivatives by each coordinate: entry [j][i] holds f_i and df_i/dx_j."""
    return _at(form, params, seeded(box, k))


@proof_kernel
def _component(form: Any, params: Any, x: Any, columns: Any, i: int) -> Interval:
    """Enclose coordinate i of a formula on a box on which values and derivatives are known."""
    hull = columns[0][i].value
    least, most = (
        _at(form, params, _corner(x, columns, i, False)),
        _at(form, params, _corner(x, columns, i, True)),
    )
    lo, hi = max(hull.lo, least[i].value.lo), min(hull.hi, most[i].value.hi)
    open_sign = False
    for j in range(len(columns)):
        slope = columns[j][i].slope
        open_sign |= not ((slope.lo >= 0.0) | (slope.hi <= 0.0))
    if open_sign:
        middle = _middle(x)
        mean = _at(form, params, middle)[i].value
        for j in range(len(columns)):
            mean = mean + columns[j][i].slope * (x[j] - middle[j])
        lo, hi = max(lo, mean.lo), min(hi, mean.hi)
    return Interval(lo, hi)


@of_entries
def _range(x: Any, k: int, form: Any, params: Any, box: Any, columns: Any) -> Interval:
    """Every coordinate of the image."""
    return _component(form, params, box, columns, k)


# ---------------------------------------------------------------- boxes as the contract has them


@proof_kernel
def _slot(form: Any, params: Any, x: Any, branch: int) -> Any:
    """One image as the contract has it, and whether it is finite."""
    hull = _range(x, form, params, x, _columns(x, form, params, x))
    _, to = _formula(form, params, state_of(x))
    finite = True
    for k in range(len(hull)):
        finite &= (hull[k].lo <= hull[k].hi) & (hull[k].hi - hull[k].lo < math.inf)
    return (state_of(_lows(hull)), state_of(_highs(hull)), to, branch), finite


@proof_kernel
def _box(lo: Any, hi: Any) -> Any:
    return _intervals(entries_of(lo), entries_of(hi))


def _margin(params: Any, x: Any, side: int) -> Interval:
    form = Decision(side)
    return _component(form, params, x, _columns(x, form, params, x), 0)


def _as_intervals(params_lo: Any, params_hi: Any, side: int) -> Any:
    """Put both corners together, once for a batch: method of `on_side_box`."""
    params = intervals_between(params_lo, params_hi)
    return params, params


def _box_of_one(params: Any, _: Any, lo: Any, hi: Any, side: int) -> Any:
    """Enclose the image under a map of one branch: method of `image_box`."""
    here = on_side(params, side)
    slot, finite = _slot(_form(here, side, 0), here, _box(lo, hi), 0)
    return 1 if finite else -1, slot, slot, NO_WITNESS


def _box_of_two(params: Any, _: Any, lo: Any, hi: Any, side: int) -> Any:
    """Enclose the image under a map of two branches: method of `image_box`."""
    here, x = on_side(params, side), _box(lo, hi)
    sign = _sign(here, x, side)
    branch = 1 if sign.lo > 0.0 else 0
    first, finite = _slot(_form(here, side, branch), here, x, branch)
    second = first
    count = 1 if finite & ((sign.lo > 0.0) | (sign.hi <= 0.0)) else -1
    if (sign.lo <= 0.0) & (sign.hi > 0.0):
        second, also = _slot(_form(here, side, 1), here, x, 1)
        count = 2 if finite & also else -1
    return count, first, second, NO_WITNESS


# ---------------------------------------------------------------- branch by branch, with slopes


@generic(proof=True, default=lambda params, x, side: Interval(-math.inf, math.inf))
def _sign(params: Any, x: Any, side: int) -> Any:
    """Enclose `margin`; everything where a map has none."""


@generic(proof=True, default=lambda params, side, branch: OnBranch(side, branch))
def _form(params: Any, side: int, branch: int) -> Any:
    """Return the formula of one branch."""


@proof_kernel(entry=True)
def _enclose_branch(
    lo_map: Any, hi_map: Any, side: int, branch: int, lo: Any, hi: Any, image: Any, slope: Any, state: Any
) -> int:
    """Fill images (2, n, d), slopes (2, n, d, d) and states of boxes on one branch; the side it leads to."""
    params, to = on_side(intervals_between(lo_map, hi_map), side), side
    for k in range(lo[0].size):
        take_mark()
        x = _box(pick(lo, k), pick(hi, k))
        sign = _sign(params, x, side)
        form = _form(params, side, branch)
        columns = _columns(x, form, params, x)
        hull = _range(x, form, params, x, columns)
        _, to = _formula(form, params, state_of(x))
        for i in range(len(hull)):
            image[0, k, i], image[1, k, i] = hull[i].lo, hull[i].hi
            for j in range(len(columns)):
                slope[0, k, i, j], slope[1, k, i, j] = columns[j][i].slope.lo, columns[j][i].slope.hi
        mine = (sign.lo > 0.0) if branch == 1 else (sign.hi <= 0.0)
        never = (sign.hi <= 0.0) if branch == 1 else (sign.lo > 0.0)
        state[k] = SURE if mine else (NEVER if never else MAYBE)
        state[k] = UNKNOWN if take_mark() else state[k]
    return int(to)


@dataclass(frozen=True, eq=False)
class BranchBoxes:
    """Images and derivatives of boxes on one branch, for every parameter between two corners.

    Attributes
    ----------
    lo, hi : ndarray, shape (n, d)
        The images.
    slope_lo, slope_hi : ndarray, shape (n, d, d)
        Entry [k, i, j] holds every dx_i'/dx_j on box k; all numbers where these are not bounded.
    state : ndarray of int8, shape (n,)
        Whether the map takes this branch there: `SURE`, `NEVER`, `MAYBE`; `UNKNOWN` where nothing is proved.
    side : int
        The side it leads to.
    """

    lo: Floats
    hi: Floats
    slope_lo: Floats
    slope_hi: Floats
    state: NDArray[np.int8]
    side: int


def branch_boxes(lo_map: Any, hi_map: Any, side: int, branch: int, lo: Floats, hi: Floats) -> BranchBoxes:
    """Enclose images and derivatives of boxes with corners of shape (n, d) on one branch of any map.

    A map of one branch takes it; one of several without `margin` may take any of them anywhere.

    Raises
    ------
    MapError
        For a map whose kernels do more than boxes can follow; the line names the function.
    """
    n, d = lo.shape
    image, slope, state = np.full((2, n, d), np.nan), np.full((2, n, d, d), np.nan), np.empty(n, np.int8)
    corners = [tuple(np.ascontiguousarray(end[:, k]) for k in range(d)) for end in (lo, hi)]
    to = _enclose_branch(lo_map, hi_map, side, branch, corners[0], corners[1], image, slope, state)
    state[~np.isfinite(image).all(axis=(0, 2))] = UNKNOWN
    slope[:, ~np.isfinite(slope).all(axis=0)] = [[-np.inf], [np.inf]]  # a jump has an image, and no slope
    return BranchBoxes(image[0], image[1], slope[0], slope[1], state, to)


@kernel(entry=True)
def _slope_at(params: Any, xs: Any) -> Any:
    return image_on(params, pick(xs, 0), 0, 0)[2]


def try_slope(params: Any, dimension: int) -> None:
    """Compile the slope of the one branch of a map.

    Raises
    ------
    MapError
        For a map whose kernel `image` does more than derivatives can follow.
    """
    _slope_at(params, tuple(np.full(1, 0.5) for _ in range(dimension)))


# ---------------------------------------------------------------- registration


def derive(cls: type, *, forced: bool, decided: bool, branches: int, boxes: bool) -> bool:
    """Give a class of parameters what follows from its kernels; whether it has `image_box` then.

    Parameters
    ----------
    cls : type
        The class.
    forced, decided, boxes : bool
        Whether it has `image_on`, `margin` and an `image_box` of its own.
    branches : int
        How many it has.
    """
    if not forced and branches == 1:
        kernels.forced.on(cls, _by_image)
        _form.on(cls, lambda params, side, branch: Whole(side))
    if branches == 1:
        _sign.on(cls, lambda params, x, side: Interval(-1.0, -1.0))
    elif decided:
        _sign.on(cls, _margin)
    enough = branches == 1 or (branches == 2 and decided and forced)
    if boxes or not enough:
        return boxes
    on_side_box.on(cls, _as_intervals)
    kernels.image_box.on(cls, _box_of_one if branches == 1 else _box_of_two)
    return True
