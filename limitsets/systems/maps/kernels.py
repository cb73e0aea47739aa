"""The kernels of a map: one function each, whose method is chosen by the class of the parameters.

What each of them takes and gives is the table of `limitsets.systems.maps.contract`, where methods are registered.
"""

from __future__ import annotations

from typing import Any

from limitsets.numbers.interval import seed, slope_of
from limitsets.numbers.jit import generic, kernel, of_entries
from limitsets.systems.maps import codes


def _same(params: Any, side: int) -> Any:
    return params


def _both(lo: Any, hi: Any, side: int) -> Any:
    return lo, hi


def _as_they_are(params: Any, start: int, step: int) -> Any:
    return params


def _no_fallback_box(params_lo: Any, params_hi: Any, lo: Any, hi: Any, side: int) -> Any:
    return image_box(params_lo, params_hi, lo, hi, side)


def _no_fallback(params: Any, x: Any, side: int) -> Any:
    return x, side, codes.OUTSIDE_MODEL


def _first_branch(params: Any, x: Any, side: int) -> Any:
    return -1.0


@generic
def image(params: Any, x: Any, side: int) -> Any:
    """One step: ``(x', side', code)``."""


@generic
def forced(params: Any, x: Any, side: int, branch: int) -> Any:
    """One step on a forced branch as it was registered, with the slope or without: `image_on` adds it."""


@generic(proof=True)
def image_box(params_lo: Any, params_hi: Any, lo: Any, hi: Any, side: int) -> Any:
    """Boxes that contain the image of a box, for every parameter between the two."""


@generic(proof=True, inlined=False, default=_no_fallback_box)
def fallback_box(params_lo: Any, params_hi: Any, lo: Any, hi: Any, side: int) -> Any:
    """As `image_box`, slow and sure."""


@generic(proof=True, default=_both)
def on_side_box(params_lo: Any, params_hi: Any, side: int) -> Any:
    """Return what `image_box` needs to know of one side, for both corners."""


@generic(default=_same)
def on_side(params: Any, side: int) -> Any:
    """Return what the kernels need to know of one side."""


@generic(inlined=False, default=_no_fallback)
def fallback(params: Any, x: Any, side: int) -> Any:
    """One step, slow and sure."""


@generic(default=_first_branch)
def margin(params: Any, x: Any, side: int) -> Any:
    """Return a number whose sign decides between branches 0 and 1; of a map without one -1, which is branch 0."""


@generic
def displacement(params: Any, x: Any, side: int) -> Any:
    """x' - x without cancellation."""


@generic(default=_as_they_are)
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


def _pick1(xs: Any, k: int) -> Any:
    return xs[0][k]


def _pick2(xs: Any, k: int) -> Any:
    return xs[0][k], xs[1][k]


def _pick3(xs: Any, k: int) -> Any:
    return xs[0][k], xs[1][k], xs[2][k]


def _put1(xs: Any, k: int, x: Any) -> None:
    xs[0][k] = x


def _put2(xs: Any, k: int, x: Any) -> None:
    xs[0][k], xs[1][k] = x


def _put3(xs: Any, k: int, x: Any) -> None:
    xs[0][k], xs[1][k], xs[2][k] = x


for _n, _get, _set in ((1, _pick1, _put1), (2, _pick2, _put2), (3, _pick3, _put3)):
    pick.on(_n, _get)
    put.on(_n, _set)


# ---------------------------------------------------------------- slopes of maps that do not give them


def _itself(x: Any) -> Any:
    return x


def _alone(x: Any) -> Any:
    return (x,)


def _first(x: Any) -> Any:
    return x[0]


@generic(default=_itself)
def state_of(entries: Any) -> Any:
    """Return what kernels take, from a tuple of coordinates: a number in one dimension, the tuple in more."""


@generic(default=_alone)
def entries_of(x: Any) -> Any:
    """Undo `state_of`."""


def _as_given(image_on_branch: Any, params: Any, x: Any, side: int, branch: int) -> Any:
    return image_on_branch


@generic(default=_as_given)
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


state_of.on(1, _first)
entries_of.on(2, _itself)
entries_of.on(3, _itself)
_with_slope.on(2, _with_derivative)


@kernel
def image_on(params: Any, x: Any, side: int, branch: int) -> Any:
    """One step on a forced branch: ``(x', side', slope)``."""
    return _with_slope(forced(params, x, side, branch), params, x, side, branch)
