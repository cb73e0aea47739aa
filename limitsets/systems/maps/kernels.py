"""The kernels of a map: one function each, whose method is chosen by the class of the parameters.

What each of them takes and gives is the table of `limitsets.systems.maps.contract`, where methods are registered.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from limitsets.numbers.interval import seed, slope_of
from limitsets.numbers.jit import generic, kernel, of_entries
from limitsets.systems.maps import codes


@generic
def image(params: Any, x: Any, side: int) -> Any:
    """One step: ``(x', side', code)``."""


@generic
def forced(params: Any, x: Any, side: int, branch: int) -> Any:
    """One step on a forced branch as it was registered, with the slope or without: `image_on` adds it."""


@generic(proof=True)
def image_box(params_lo: Any, params_hi: Any, lo: Any, hi: Any, side: int) -> Any:
    """Boxes that contain the image of a box, for every parameter between the two."""


@generic(
    proof=True,
    inlined=False,
    default=lambda lo_map, hi_map, lo, hi, side: image_box(lo_map, hi_map, lo, hi, side),
)
def fallback_box(params_lo: Any, params_hi: Any, lo: Any, hi: Any, side: int) -> Any:
    """As `image_box`, slow and sure."""


@generic(proof=True, default=lambda lo, hi, side: (lo, hi))
def on_side_box(params_lo: Any, params_hi: Any, side: int) -> Any:
    """Return what `image_box` needs to know of one side, for both corners."""


@generic(default=lambda params, side: params)
def on_side(params: Any, side: int) -> Any:
    """Return what the kernels need to know of one side."""


@generic(inlined=False, default=lambda params, x, side: (x, side, codes.OUTSIDE_MODEL))
def fallback(params: Any, x: Any, side: int) -> Any:
    """One step, slow and sure."""


@generic(default=lambda params, x, side: -1.0)
def margin(params: Any, x: Any, side: int) -> Any:
    """Return a number whose sign decides between branches 0 and 1; of a map without one -1, which is branch 0."""


@generic
def displacement(params: Any, x: Any, side: int) -> Any:
    """x' - x without cancellation."""


@generic(default=lambda params, start, step: params)
def scattered(params: Any, start: int, step: int) -> Any:
    """Return the parameters of one step of one start."""


def _one_by_one(params: Any, x: Any, side: int) -> Any:
    value = margin(params, x, side)
    return value, image_on(params, x, side, 1 if value > 0.0 else 0)[2], True


@generic(default=_one_by_one)
def decision(params: Any, x: Any, side: int) -> Any:
    """Return the margin, the slope on the branch that it decides for, and whether these can be vouched for.

    For loops over many states: a map whose `margin` has a slow way gives here what the fast one finds.
    """


# ---------------------------------------------------------------- states in arrays


@generic
def pick(xs: Any, k: int) -> Any:
    """State number k of a tuple of coordinate arrays: a number, or a tuple from two coordinates up."""


@generic
def put(xs: Any, k: int, x: Any) -> None:
    """Store state number k."""


def _put1(xs: Any, k: int, x: Any) -> None:
    xs[0][k] = x


def _put2(xs: Any, k: int, x: Any) -> None:
    xs[0][k], xs[1][k] = x


def _put3(xs: Any, k: int, x: Any) -> None:
    xs[0][k], xs[1][k], xs[2][k] = x


for _n, _get, _set in (
    (1, lambda xs, k: xs[0][k], _put1),
    (2, lambda xs, k: (xs[0][k], xs[1][k]), _put2),
    (3, lambda xs, k: (xs[0][k], xs[1][k], xs[2][k]), _put3),
):
    pick.on(_n, _get)
    put.on(_n, _set)


# ---------------------------------------------------------------- slopes of maps that do not give them


@generic(default=lambda x: x)
def state_of(entries: Any) -> Any:
    """Return what kernels take, from a tuple of coordinates: a number in one dimension, the tuple in more."""


@generic(default=lambda x: (x,))
def entries_of(x: Any) -> Any:
    """Undo `state_of`."""


class Closing(NamedTuple):
    """Lower ends and periods of the axes of a domain, shape (sides, dimension); a period is 0 where none closes."""

    lo: Any
    period: Any


@of_entries
def _turned(x: Any, k: int, side: Any, axes: Closing) -> Any:
    """Turn a coordinate to the domain, exactly where it lies there; rounding may not leave it on the seam."""
    if (side < 0) | (side >= axes.lo.shape[0]):  # the domain says nothing of that side
        return x
    lo, period = axes.lo[side, k], axes.period[side, k]
    if not ((period > 0.0) & (abs(x) < math.inf)):
        return x
    after = x - period * math.floor((x - lo) / period)
    return after if (after >= lo) & (after < lo + period) else lo


@kernel
def in_domain(x: Any, side: Any, axes: Closing | None) -> Any:
    """State of a domain that a state is; of one that no axis closes, None, it is x."""
    if axes is None:
        return x
    return state_of(_turned(entries_of(x), side, axes))


@generic(default=lambda given, params, x, side, branch: given)
def _with_slope(image_on_branch: Any, params: Any, x: Any, side: int, branch: int) -> Any:
    """Return ``(x', side', slope)``, whether the slope is there or not."""


@of_entries
def seeded(x: Any, k: int, j: int) -> Any:
    """Coordinates with their derivatives by coordinate j."""
    return seed(x, 1.0 if k == j else 0.0)


@of_entries
def _slope(y: Any, i: int) -> Any:
    return slope_of(y)


@of_entries
def _column(x: Any, j: int, params: Any, start: Any, side: int, branch: int) -> Any:
    """Differentiate the image by one coordinate."""
    return _slope(entries_of(forced(params, state_of(seeded(start, j)), side, branch)[0]))


@of_entries
def _entry(column: Any, j: int, i: int) -> Any:
    return column[i]


@of_entries
def _row(y: Any, i: int, columns: Any) -> Any:
    """Return the derivatives of one coordinate of the image."""
    return state_of(_entry(columns, i))


def _with_derivative(image_on_branch: Any, params: Any, x: Any, side: int, branch: int) -> Any:
    start = entries_of(x)
    columns = _column(start, params, start, side, branch)
    return image_on_branch[0], image_on_branch[1], state_of(_row(columns[0], columns))


state_of.on(1, lambda entries: entries[0])
for _n in (2, 3):
    entries_of.on(_n, lambda x: x)
_with_slope.on(2, _with_derivative)


@kernel
def image_on(params: Any, x: Any, side: int, branch: int) -> Any:
    """One step on a forced branch: ``(x', side', slope)``."""
    return _with_slope(forced(params, x, side, branch), params, x, side, branch)
