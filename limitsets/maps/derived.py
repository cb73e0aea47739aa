"""Proved boxes, and slopes, of any map from the source of its plain kernels.

The kernels run on intervals and on intervals with a derivative (`limitsets.interval.Dual`).  One formula f on a box X of
states, for a box of parameters, is enclosed by what these three have in common:

* f(X), each operation in turn.
* Where df_i/dx_j has one sign on X for some j: f_i at the two ends of X_j, for all other coordinates as before.
* The mean value form f(m) + sum_j df/dx_j(X) (X_j - m_j), with m the middle; asked where a sign is open.

So the box of a map that is monotone on X is the range itself, but for rounding.  A map with two branches has a `margin`,
enclosed in the same way: where its sign is proved there is one box, where it is open there are two.

Source: Neumaier, "Interval Methods for Systems of Equations", 1990, sections 2.3 and 2.4.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from limitsets.interval import Dual, Interval, intervals_between, slope_of, value_of
from limitsets.interval.number import ends_of
from limitsets.jit import generic, of_entries, proof_kernel
from limitsets.maps.kernels import (
    entries_of,
    forced,
    image,
    image_box,
    margin,
    on_side,
    on_side_box,
    seeded,
    state_of,
)

__all__ = ["derive"]


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


def _decision(form: Decision, params: Any, x: Any) -> Any:
    return margin(params, x, form.side), form.side


def _on_branch(form: OnBranch, params: Any, x: Any) -> Any:
    found = forced(params, x, form.side, form.branch)
    return found[0], found[1]


def _whole(form: Whole, params: Any, x: Any) -> Any:
    after, to, _ = image(params, x, form.side)
    return after, to


_formula.on(Decision, _decision)
_formula.on(OnBranch, _on_branch)
_formula.on(Whole, _whole)


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
    found = columns[0][i].value
    least, most = _at(form, params, _corner(x, columns, i, False)), _at(form, params, _corner(x, columns, i, True))
    lo, hi = max(found.lo, least[i].value.lo), min(found.hi, most[i].value.hi)
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
    found = _range(x, form, params, x, _columns(x, form, params, x))
    _, to = _formula(form, params, state_of(x))
    finite = True
    for k in range(len(found)):
        finite &= (found[k].lo <= found[k].hi) & (found[k].hi - found[k].lo < math.inf)
    return (state_of(_lows(found)), state_of(_highs(found)), to, branch), finite


@proof_kernel
def _box(lo: Any, hi: Any) -> Any:
    return _intervals(entries_of(lo), entries_of(hi))


def _as_intervals(params_lo: Any, params_hi: Any, side: int) -> Any:
    """Method of `on_side_box`: both corners together, once for a batch."""
    params = intervals_between(params_lo, params_hi)
    return params, params


def _whole_box(params: Any, _: Any, lo: Any, hi: Any, side: int) -> Any:
    """Method of `image_box` for a map whose `image` has no branches."""
    slot, finite = _slot(Whole(side), on_side(params, side), _box(lo, hi), 0)
    return 1 if finite else -1, slot, slot, NO_WITNESS


def _smooth_box(params: Any, _: Any, lo: Any, hi: Any, side: int) -> Any:
    """Method of `image_box` for a map of one branch, by `image_on`."""
    slot, finite = _slot(OnBranch(side, 0), on_side(params, side), _box(lo, hi), 0)
    return 1 if finite else -1, slot, slot, NO_WITNESS


def _box_of_two(params: Any, _: Any, lo: Any, hi: Any, side: int) -> Any:
    """Method of `image_box` for a map of two branches, by `image_on` and `margin`."""
    here, x, form = on_side(params, side), _box(lo, hi), Decision(side)
    sign = _component(form, here, x, _columns(x, form, here, x), 0)
    branch = 1 if sign.lo > 0.0 else 0
    first, finite = _slot(OnBranch(side, branch), here, x, branch)
    second = first
    count = 1 if finite & ((sign.lo > 0.0) | (sign.hi <= 0.0)) else -1
    if (sign.lo <= 0.0) & (sign.hi > 0.0):
        second, also = _slot(OnBranch(side, 1), here, x, 1)
        count = 2 if finite & also else -1
    return count, first, second, NO_WITNESS


def derive(cls: type, *, forced: bool, decided: bool, branches: int) -> bool:
    """Give a class of parameters the methods of `image_box`, where its kernels suffice; whether they do."""
    if forced and (branches == 1 or (branches == 2 and decided)):
        method = _smooth_box if branches == 1 else _box_of_two
    elif branches == 1:
        method = _whole_box
    else:
        return False
    on_side_box.on(cls, _as_intervals)
    image_box.on(cls, method)
    return True
