"""Bisection along a line, and with it the switching points of a map; for the throw all critical points of the paper.

A side is sampled, densely towards its anchor.  Every change between two samples is bisected down to adjacent floats,
and every extremum of the deciding number towards zero is followed to its top, so that two changes between a pair of
samples are found (docs/model.md, decision).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.base import AnswerError, arguments_checked, shown
from limitsets.numbers.jit import kernel
from limitsets.systems.cells import Domain
from limitsets.systems.maps import codes
from limitsets.systems.maps.contract import compiled_kind_of, kind_of, require_sides
from limitsets.systems.maps.drivers import columns, images
from limitsets.systems.maps.kernels import margin, on_side, pick

# ----------------------------------------------------------------
# Bisection along a line: changes between samples, down to adjacent floats, and changes hidden between samples.
#
# Nothing here knows a map.  A bracket that holds a change is halved until its ends are neighbours.  Two changes between
# a pair of samples of one sign have an extremum towards zero between them: golden section follows each to its top.


Array = NDArray[np.float64]
Codes = NDArray[np.int64]
Flags = NDArray[np.bool_]

# Golden section: 0.618^50 = 4e-11 of two sample spacings, where the top of a parabola is flat to rounding.
NARROWINGS = 50
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
SHARES = np.arange(1, 16)[:, None] / 16.0


def sign_code(values: Array) -> Codes:
    """1 where a number is positive, 0 where it is not, `OUTSIDE_MODEL` for nan."""
    return np.where(np.isnan(values), codes.OUTSIDE_MODEL, values > 0.0).astype(np.int64)


def inserted(x: Array, extra: Array) -> Array:
    """Put more samples among the samples: ascending, each once."""
    return np.unique(np.concatenate([x, extra]))


def bisected(lo: Array, hi: Array, is_above: Callable[[Array, Array, Array], Flags]) -> tuple[Array, Array]:
    """Halve brackets until their ends are adjacent floats.

    Parameters
    ----------
    lo, hi : ndarray, shape (n,)
        The brackets.
    is_above : callable
        ``is_above(lo, middle, hi)``: whether what is sought lies in the upper half, for all brackets at once.

    Returns
    -------
    lo, hi : ndarray, shape (n,)
        The halved brackets.
    """
    while True:
        middle = lo + 0.5 * (hi - lo)
        inside = (middle > lo) & (middle < hi)
        if not inside.any():
            return lo, hi
        above = is_above(lo, middle, hi)
        lo, hi = np.where(inside & above, middle, lo), np.where(inside & ~above, middle, hi)


def _first_change(
    code_of: Callable[[Array], Codes], lo: Array, hi: Array, before: Codes
) -> tuple[Array, Array]:
    """Cut brackets until their ends are adjacent floats: 16 parts at a time, for a call of a map is dear by itself."""
    at = np.arange(lo.size)
    while True:
        points = lo + SHARES * (hi - lo)
        inside = (points > lo) & (points < hi)
        if not inside.any():
            return lo, hi
        same = np.where(inside, code_of(points.ravel()).reshape(points.shape) == before, points <= lo)
        count = np.logical_and.accumulate(same, axis=0).sum(axis=0)  # below the first change
        ends = np.concatenate([lo[None], points, hi[None]])
        lo, hi = ends[count, at], ends[count + 1, at]


def located(code_of: Callable[[Array], Codes], x: Array) -> tuple[Array, Codes]:
    """Refine samples until every change of code stands between adjacent floats: samples, and their codes."""
    code = code_of(x)
    while True:
        k = np.flatnonzero((code[1:] != code[:-1]) & (np.nextafter(x[:-1], np.inf) < x[1:]))
        if k.size == 0:
            return x, code
        lo, hi = _first_change(code_of, x[k], x[k + 1], code[k])
        x = inserted(x, np.concatenate([lo, hi]))
        code = code_of(x)


def _dips(values: Array, x: Array) -> tuple[Array, Array, Array]:
    """Brackets around samples nearer to zero than their neighbours: lower end, upper end, sign of the sample.

    A sample beside a border, of the range or of where there are values, is compared on its other side alone.
    """
    sign = np.where(values > 0.0, 1.0, -1.0)
    here, left, right = sign * values, np.full(x.size, np.nan), np.full(x.size, np.nan)
    left[1:], right[:-1] = sign[1:] * values[:-1], sign[:-1] * values[1:]
    no_left, no_right = np.isnan(left), np.isnan(right)
    least = (no_left | (left > here)) & (no_right | (right >= here))
    k = np.flatnonzero(np.isfinite(values) & least & ~(no_left & no_right))
    return x[k - ~no_left[k]], x[k + ~no_right[k]], sign[k]


def hidden(value_of: Callable[[Array], Array], x: Array) -> Array:
    """Points whose value has the other sign than the samples around them.

    Parameters
    ----------
    value_of : callable
        The values, nan where there are none.
    x : ndarray, shape (n,)
        Samples, ascending.

    Returns
    -------
    ndarray
        Points found on the way to the tops of all extrema towards zero; none where no top crosses it.
    """
    a, b, sign = _dips(value_of(x), x)
    if sign.size == 0:
        return np.empty(0)
    points = []
    for _ in range(NARROWINGS):
        c, d = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
        at_c, at_d = value_of(c), value_of(d)
        points += [at[sign_code(value) == (sign < 0)] for at, value in ((c, at_c), (d, at_d))]
        lower = sign * at_c < sign * at_d
        a, b = np.where(lower, a, c), np.where(lower, d, b)
    return np.concatenate(points)


# ----------------------------------------------------------------
# Switching points of a one-dimensional map; for the throw all critical points of the paper, r_i and further ones.


SAMPLES = 4096

# The smallest number of full precision: what is nearer to 0 is 0 to people.
TINY = float(np.finfo(np.float64).tiny)


# Under this name `arguments_checked` lets everything pass: `require_domain` says more of what is no domain.
Sides: TypeAlias = Domain


def require_domain(params: Any, domain: Any, samples: int) -> None:
    """Refuse a map of more dimensions, where branches have no order, a domain that is none, and too few samples."""
    require_one_dimension(params)
    if not isinstance(domain, Domain):
        remedy = "pass scene.domain, or limitsets.grid([(0.0, 1.0)]).domain"
        raise AnswerError("the domain", shown(domain), "a Domain", remedy)
    if samples < 2:
        raise AnswerError("the number of samples", samples, "an integer from 2", f"pass samples={SAMPLES}")


class CriticalPoint(NamedTuple):
    """A change of branch.

    Attributes
    ----------
    x : float
        The first floating-point number on the branch after the change; the one below it is still on the other.  0 for
        a change just above 0, where that number would be 5e-324.
    kind : str
        Both branches by name: ``"jog->flip"``.
    before, after : int
        Both branches by number.
    """

    x: float
    kind: str
    before: int
    after: int


@kernel(entry=True)
def _margins(params: Any, side: int, xs: Any, out: Any) -> None:
    here = on_side(params, side)
    for k in range(out.size):
        out[k] = margin(here, pick(xs, k), side)


def margins(params: Any, x: ArrayLike, side: int) -> Array:
    """Evaluate the number whose sign decides between branches 0 and 1, nan where the map has no image.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.systems.maps.critical import margins
    >>> margins(ls.load("paper-designed").map, [19.0, 21.0], 2) > 0  # r_2 = 20
    array([False,  True])
    """
    return _margins_of(params, side)(np.asarray(x, dtype=np.float64))


def _margins_of(params: Any, side: int) -> Callable[[Array], Array]:
    """Margins of one side, which is held against the map once for all."""
    require_sides(params, side, side)
    dimension = kind_of(params).dimension

    def margins_at(x: Array) -> Array:
        out = np.empty(len(x))
        _margins(params, side, columns(x, dimension), out)
        return out

    return margins_at


def _sampled(domain: Sides, side: int, count: int) -> Array:
    """Sample one side, evenly and, where it has an anchor, densely towards it as well."""
    lo, hi = float(domain.lo[side, 0]), float(domain.hi[side, 0])
    x = np.linspace(lo, hi, count)
    if domain.anchor is not None:
        anchor = float(domain.anchor[side])
        graded = anchor + np.geomspace(lo - anchor, hi - anchor, count)
        x = inserted(x, np.clip(graded, lo, hi))
    return x


def _code_of(params: Any, side: int) -> Callable[[Array], Codes]:
    """Branch in force at x, a negative number where there is none."""
    if kind_of(params).has_margin:
        margins_at = _margins_of(params, side)
        return lambda x: sign_code(margins_at(x))
    return lambda x: images(params, x, side).code


def branches_of_side(params: Any, domain: Sides, side: int, samples: int) -> tuple[Array, Codes]:
    """Sample one side and its branches, with every change of branch between adjacent floats; none without states."""
    if not domain.lo[side, 0] < domain.hi[side, 0]:
        return np.empty(0), np.empty(0, np.int64)
    code_of = _code_of(params, side)
    x, code = located(code_of, _sampled(domain, side, samples))
    if kind_of(params).has_margin:
        x, code = located(code_of, inserted(x, hidden(_margins_of(params, side), x)))
    return x, code


def require_one_dimension(params: Any) -> None:
    """Refuse a map of more dimensions: there branches have no order."""
    dimension = compiled_kind_of(params, "critical points").dimension
    if dimension != 1:
        raise AnswerError(
            "the dimension of the map",
            dimension,
            "1",
            "ask this of a one-dimensional map: branches have no order here",
        )


@arguments_checked
def critical_points(
    params: Any, domain: Sides, *, samples: int = SAMPLES
) -> dict[int, tuple[CriticalPoint, ...]]:
    """Find every x at which a map changes its branch.

    Parameters
    ----------
    params : NamedTuple
        A one-dimensional map.  With a registered `margin` its sign is followed, otherwise the codes of `image`; a
        branch is then seen only where it does not leave, and a range narrower than a sample may be missed.
    domain : Domain
        Where to look.
    samples : int
        Samples per side (twice as many where the side has an anchor).

    Returns
    -------
    dict of int to tuple of CriticalPoint
        Per side, ascending.

    Raises
    ------
    AnswerError
        For a map of two or three dimensions, no domain, or fewer than 2 samples.

    Notes
    -----
    Source: docs/model.md, decision.  Where there is no image (margin nan) nothing is reported, not even the border.

    Examples
    --------
    >>> import limitsets as ls
    >>> scene = ls.load("paper-designed")
    >>> [round(point.x, 5) for points in ls.critical_points(scene.map, scene.domain).values() for point in points]
    [10.0, 10.0, 20.0]
    """
    require_domain(params, domain, samples)
    names = kind_of(params).branches
    points: dict[int, tuple[CriticalPoint, ...]] = {}
    for side in range(domain.sides):
        x, code = branches_of_side(params, domain, side, samples)
        changes = np.flatnonzero((code[1:] != code[:-1]) & (code[1:] >= 0) & (code[:-1] >= 0))
        rows = zip(x[changes + 1].tolist(), code[changes].tolist(), code[changes + 1].tolist(), strict=True)
        points[side] = tuple(
            CriticalPoint(at if abs(at) >= TINY else 0.0, f"{names[before]}->{names[after]}", before, after)
            for at, before, after in rows
        )
    return points
