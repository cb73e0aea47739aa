"""Where a one-dimensional map changes its branch, and where a branch turns.

Between these points a map is a monotone function of x: that is what the end points of a limit set and the search
for cycles are built on.  A side is sampled finely (densely towards its anchor), every change between two samples is
bisected down to adjacent floats, and every extremum of the deciding number towards zero is followed to its top, so
that two changes between a pair of samples do not hide.  For the throw: the critical points r_i of the paper, all of
them (docs/model.md, decision).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.errors import AnswerError
from limitsets.jit import kernel
from limitsets.maps import codes
from limitsets.maps.contract import image_on, kind_of, margin, on_side
from limitsets.maps.drivers import images

__all__ = [
    "CriticalPoint",
    "Piece",
    "TurningPoint",
    "along",
    "critical_points",
    "margins",
    "monotone_pieces",
    "turning_points",
]

Array = NDArray[np.float64]
Codes = NDArray[np.int64]

SAMPLES = 4096
# Golden section: 0.618^50 = 4e-11 of two sample spacings, where the top of a parabola is flat to rounding.
NARROWINGS = 50
# A step this large between adjacent floats is a jump; the root of a grazing throw moves by the root of an ulp.
JUMP = 2.0**-18


class Sides(Protocol):
    """What is asked of a domain: a box of x for each side (`limitsets.cells.Domain`)."""

    @property
    def lo(self) -> Array: ...
    @property
    def hi(self) -> Array: ...
    @property
    def anchor(self) -> Array | None: ...
    @property
    def sides(self) -> int: ...


class CriticalPoint(NamedTuple):
    """A change of branch.

    Attributes
    ----------
    x : float
        The first floating-point number on the branch after the change; the one below it is still on the other.
    kind : str
        Both branches by name: ``"jog->flip"``.
    before, after : int
        Both branches by number.
    """

    x: float
    kind: str
    before: int
    after: int


class TurningPoint(NamedTuple):
    """A point inside a branch where its slope changes sign: `x`, and the branch."""

    x: float
    branch: int


class Piece(NamedTuple):
    """A range of x on which a map stays on one branch and is monotone.

    Attributes
    ----------
    lo, hi : float
        First and last floating-point number of the piece.
    branch : int
        The branch.
    below, above : str
        What ends it: "critical", "turning", "jump" (of the image, inside the branch), "exit" (no branch beyond) or
        "domain".
    """

    lo: float
    hi: float
    branch: int
    below: str
    above: str


@kernel(entry=True)
def _margins(params: Any, side: int, x: Any, out: Any) -> None:
    here = on_side(params, side)
    for k in range(x.size):
        out[k] = margin(here, x[k], side)


@kernel(entry=True)
def _along(params: Any, x: Any, sides: Any, branches: Any, after: Any, side_after: Any, slope: Any) -> None:
    """Force steps: row k of `branches` for start k, or the one row for all."""
    for k in range(x.size):
        row = k if branches.shape[0] > 1 else 0
        at, side, product = x[k], sides[k], 1.0
        for j in range(branches.shape[1]):
            at, side, factor = image_on(params, at, side, branches[row, j])
            product *= factor
        after[k] = at
        side_after[k] = side
        slope[k] = product


def margins(params: Any, x: ArrayLike, side: int) -> Array:
    """Evaluate the number whose sign decides between branches 0 and 1, nan where the map has no image.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.maps.critical import margins
    >>> margins(ls.load("paper-designed").map, [19.0, 21.0], 2) > 0  # r_2 = 20
    array([False,  True])
    """
    starts = np.ascontiguousarray(x, dtype=np.float64)
    out = np.empty(starts.size)
    _margins(params, side, starts, out)
    return out


def along(params: Any, x: ArrayLike, side: ArrayLike, branches: ArrayLike) -> tuple[Array, Codes, Array]:
    """Send states along forced branches.

    Parameters
    ----------
    params : NamedTuple
        A one-dimensional map with `image_on`.
    x : array_like, shape (n,)
        States.
    side : int or array_like of int, shape (n,)
        Their sides.
    branches : array_like of int, shape (m,) or (n, m)
        The branches to take one after the other, for all states or for each.

    Returns
    -------
    x, side, slope : ndarray, shape (n,)
        Where they end, and the derivative of the whole with respect to the start.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.maps.critical import along
    >>> along(maps.Doubling(2.0), [0.5], 0, [0, 1])  # from below 1/2 to 1, which stays
    (array([1.]), array([0]), array([4.]))
    """
    starts = np.ascontiguousarray(x, dtype=np.float64)
    sides = np.array(np.broadcast_to(np.asarray(side, dtype=np.int64), starts.shape))
    words = np.ascontiguousarray(np.atleast_2d(np.asarray(branches, dtype=np.int64)))
    after, side_after, slope = np.empty(starts.size), np.empty(starts.size, np.int64), np.empty(starts.size)
    _along(params, starts, sides, words, after, side_after, slope)
    return after, side_after, slope


# ---------------------------------------------------------------- search


def _grid(domain: Sides, side: int, count: int) -> Array:
    """Sample one side, evenly and, where it has an anchor, densely towards it as well."""
    lo, hi = float(domain.lo[side, 0]), float(domain.hi[side, 0])
    x = np.linspace(lo, hi, count)
    if domain.anchor is not None:
        anchor = float(domain.anchor[side])
        graded = anchor + np.geomspace(lo - anchor, hi - anchor, count)
        x = np.unique(np.concatenate([x, np.clip(graded, lo, hi)]))
    return x


def _sign_code(values: Array) -> Codes:
    return np.where(np.isnan(values), codes.OUTSIDE_MODEL, values > 0.0).astype(np.int64)


def _insert(x: Array, extra: Array) -> Array:
    return np.unique(np.concatenate([x, extra]))


def _hidden(value_of: Callable[[Array], Array], x: Array) -> Array:
    """Points of the other sign between samples of one sign: every extremum towards zero is followed to its top.

    The golden section is run on all of them at once.
    """
    m = value_of(x)
    sign = np.where(m > 0.0, 1.0, -1.0)
    here, left, right = sign * m, np.full(x.size, np.nan), np.full(x.size, np.nan)
    left[1:], right[:-1] = sign[1:] * m[:-1], sign[:-1] * m[1:]
    no_left, no_right = np.isnan(left), np.isnan(right)  # a border, of the domain or of the map
    k = np.flatnonzero(
        np.isfinite(m) & (no_left | (left > here)) & (no_right | (right >= here)) & ~(no_left & no_right)
    )
    if k.size == 0:
        return np.empty(0)
    sign, a, b = sign[k], x[k - ~no_left[k]], x[k + ~no_right[k]]
    ratio = 0.5 * (np.sqrt(5.0) - 1.0)
    c, d = b - ratio * (b - a), a + ratio * (b - a)
    found = []
    for _ in range(NARROWINGS):
        mc, md = sign * value_of(c), sign * value_of(d)
        found += [c[_sign_code(sign * mc) == (sign < 0)], d[_sign_code(sign * md) == (sign < 0)]]
        lower = mc < md
        a, b = np.where(lower, a, c), np.where(lower, d, b)
        c, d = b - ratio * (b - a), a + ratio * (b - a)
    return np.concatenate(found)


def _located(code_of: Callable[[Array], Codes], x: Array) -> tuple[Array, Codes]:
    """Refine samples until every change of code stands between adjacent floats."""
    code = code_of(x)
    while True:
        k = np.flatnonzero((code[1:] != code[:-1]) & (np.nextafter(x[:-1], np.inf) < x[1:]))
        if k.size == 0:
            return x, code
        lo, hi, before = x[k], x[k + 1], code[k]
        while True:
            middle = lo + 0.5 * (hi - lo)
            inside = (middle > lo) & (middle < hi)
            if not inside.any():
                break
            same = code_of(middle) == before
            lo, hi = np.where(inside & same, middle, lo), np.where(inside & ~same, middle, hi)
        x = _insert(x, np.concatenate([lo, hi]))
        code = code_of(x)


def _code_of(params: Any, side: int) -> Callable[[Array], Codes]:
    """Branch in force at x, a negative number where there is none."""
    if kind_of(params).has_margin:
        return lambda x: _sign_code(margins(params, x, side))
    return lambda x: images(params, x, side).code


def _branches_of_side(params: Any, domain: Sides, side: int, samples: int) -> tuple[Array, Codes]:
    """Sample one side and its branches, with every change of branch between adjacent floats."""
    x, _ = _located(_code_of(params, side), _grid(domain, side, samples))
    if kind_of(params).has_margin:
        x = _insert(x, _hidden(lambda at: margins(params, at, side), x))
    return _located(_code_of(params, side), x)


def _require_one_dimension(params: Any) -> None:
    dimension = kind_of(params).dimension
    if dimension != 1:
        raise AnswerError(
            "the dimension of the map",
            dimension,
            "1",
            "ask this of a one-dimensional map: branches have no order here",
        )


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
        For a map of two or three dimensions.

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
    _require_one_dimension(params)
    names = kind_of(params).branches
    found: dict[int, tuple[CriticalPoint, ...]] = {}
    for side in range(domain.sides):
        x, code = _branches_of_side(params, domain, side, samples)
        changes = np.flatnonzero((code[1:] != code[:-1]) & (code[1:] >= 0) & (code[:-1] >= 0))
        found[side] = tuple(
            CriticalPoint(
                float(x[k + 1]), f"{names[code[k]]}->{names[code[k + 1]]}", int(code[k]), int(code[k + 1])
            )
            for k in changes
        )
    return found


# ---------------------------------------------------------------- monotone pieces


def _jumps(image_of: Callable[[Array], Array], x: Array, y: Array, slope: Array) -> Array:
    """Both floats at each jump of the image inside one branch."""
    step = np.diff(x)
    off = np.abs(np.diff(y) - 0.5 * (slope[1:] + slope[:-1]) * step)
    usual = (np.abs(np.diff(slope)) + 0.01 * np.abs(slope[1:])) * step + JUMP * JUMP * np.abs(y[1:])
    k = np.flatnonzero(off > usual)
    lo, hi, y_lo, y_hi = x[k], x[k + 1], y[k], y[k + 1]
    while True:
        middle = lo + 0.5 * (hi - lo)
        inside = (middle > lo) & (middle < hi)
        if not inside.any():
            break
        y_mid = image_of(middle)
        left = np.abs(y_mid - y_lo) > np.abs(y_hi - y_mid)
        lo, y_lo = np.where(inside & ~left, middle, lo), np.where(inside & ~left, y_mid, y_lo)
        hi, y_hi = np.where(inside & left, middle, hi), np.where(inside & left, y_mid, y_hi)
    real = np.abs(y_hi - y_lo) > JUMP * np.maximum(1.0, np.abs(y_lo))
    return np.concatenate([lo[real], hi[real]])


def _pieces_of_branch(params: Any, side: int, x: Array, branch: int) -> list[tuple[Array, str]]:
    """Cut one branch, sampled at x, where its slope changes sign or its image jumps."""

    def slope_of(at: Array) -> Array:
        return along(params, at, side, [branch])[2]

    def image_of(at: Array) -> Array:
        return along(params, at, side, [branch])[0]

    jumps = _jumps(image_of, x, image_of(x), slope_of(x))
    x = _insert(_insert(x, jumps), _hidden(slope_of, x))
    x, rising = _located(lambda at: _sign_code(slope_of(at)), x)
    turns = np.flatnonzero(np.diff(rising)) + 1
    adjacent = np.nextafter(x[:-1], np.inf) == x[1:]
    steps = np.flatnonzero(np.isin(x[:-1], jumps) & np.isin(x[1:], jumps) & adjacent) + 1
    cuts = np.union1d(turns, steps)
    kinds = ["jump" if cut in steps else "turning" for cut in cuts]
    return list(zip(np.split(x, cuts), ["", *kinds], strict=True))


def monotone_pieces(params: Any, domain: Sides, *, samples: int = SAMPLES) -> dict[int, tuple[Piece, ...]]:
    """Cut a domain into pieces on which a map stays on one branch and is monotone.

    Parameters
    ----------
    params : NamedTuple
        A one-dimensional map with `image_on`.
    domain : Domain
        What to cut.
    samples : int
        As for `critical_points`.

    Returns
    -------
    dict of int to tuple of Piece
        Per side, ascending.  Where the map has no branch (it leaves, or there is no image) there is no piece.

    Raises
    ------
    AnswerError
        For a map of two or three dimensions, or one without `image_on`.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.cells import as_domain
    >>> from limitsets.maps.critical import monotone_pieces
    >>> [(piece.below, piece.above) for piece in monotone_pieces(maps.Logistic(4.0), as_domain([(0, 1)]))[0]]
    [('domain', 'critical'), ('critical', 'domain')]
    """
    _require_one_dimension(params)
    if not kind_of(params).has_image_on:
        name = kind_of(params).name
        raise AnswerError(
            "the map", name, "a map with image_on", "register image_on: one step on a forced branch"
        )
    found: dict[int, tuple[Piece, ...]] = {}
    for side in range(domain.sides):
        x, code = _branches_of_side(params, domain, side, samples)
        runs = np.split(np.arange(x.size), np.flatnonzero(np.diff(code)) + 1)
        pieces: list[Piece] = []
        for number, run in enumerate(runs):
            branch = int(code[run[0]])
            if branch < 0:
                continue
            ends = []
            for k, beyond in ((number - 1, -1), (number + 1, 0)):
                inside = 0 <= k < len(runs)
                ends.append("domain" if not inside else "critical" if code[runs[k][beyond]] >= 0 else "exit")
            parts = _pieces_of_branch(params, side, x[run], branch)
            kinds = [ends[0], *(kind for _, kind in parts[1:]), ends[1]]
            for part, (points, _) in enumerate(parts):
                pieces.append(
                    Piece(float(points[0]), float(points[-1]), branch, kinds[part], kinds[part + 1])
                )
        found[side] = tuple(pieces)
    return found


def turning_points(
    params: Any, domain: Sides, *, samples: int = SAMPLES
) -> dict[int, tuple[TurningPoint, ...]]:
    """Find every x at which the slope of the branch in force changes sign; arguments as for `monotone_pieces`.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.maps.critical import turning_points
    >>> scene = ls.load("paper-designed").with_values({"throw.kappa": 4.0})  # a throw far too fast for this part
    >>> [round(point.x, 4) for point in turning_points(scene.map, scene.domain)[0]]
    [3.9807, 9.6215]
    """
    return {
        side: tuple(TurningPoint(piece.lo, piece.branch) for piece in pieces if piece.below == "turning")
        for side, pieces in monotone_pieces(params, domain, samples=samples).items()
    }
