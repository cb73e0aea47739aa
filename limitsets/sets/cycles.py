"""Periodic orbits, stable or not.

In one dimension by itinerary.  A word names, step by step, the monotone piece of the map that the orbit is on; the
starts that follow a word form one interval, on which the composed map is monotone, and the words are grown piece by
piece while that interval is not empty.  A cycle is a root of G(x) = x for the composed map G of a word.  Only words
that are the least of their rotations are grown (the pruning of Fredricksen, Kessler and Maiorana), so each cycle
comes up once; a falling G also has cycles of twice its word's length.

In two dimensions, where pieces have no order, by Newton's method from many starts; nothing tells then whether all
were found, and the answer says so.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.cells import CellSet
from limitsets.errors import AnswerError
from limitsets.jit import kernel
from limitsets.maps.contract import image_on, kind_of
from limitsets.maps.critical import Sides, along, monotone_pieces
from limitsets.maps.drivers import images, step

__all__ = ["Cycle", "Cycles", "cycles", "cycles_from", "cycles_of"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Extents = Mapping[int, Iterable[tuple[float, float]]]

EPS = 2.0**-52
# Given sets are widened by this, and orbits closer than this are one (relative to the extent of x).
NEAR = 1e-9
# Samples of G(x) - x per word; between two of them of one sign an extremum towards zero is followed.
SAMPLES = 17
MOST_WORDS = 400_000
MOST_STARTS = 20_000
NEWTON_STEPS = 60


@dataclass(frozen=True, eq=False)
class Cycle:
    """A periodic orbit.

    Attributes
    ----------
    x : ndarray, shape (p,) or (p, 2)
        Its points in the order of the steps, beginning with the least x on the least side.
    side, branches : ndarray of int, shape (p,)
        Side of each point, and the branch taken from it.
    period : int
        p, the smallest one.
    multiplier : float
        Derivative of F^p along the orbit; in two dimensions the largest modulus of its eigenvalues.  The orbit attracts
        where it is below 1 in modulus.
    residual : float
        Largest distance between the image of a point and the next.
    admissible : bool
        Whether the map takes these branches at these points.  False for an orbit through a change of branch that only
        the one-sided limit there makes periodic.
    """

    x: Array
    side: Ints
    branches: Ints
    period: int
    multiplier: float
    residual: float
    admissible: bool


class Cycles(tuple[Cycle, ...]):
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


# ---------------------------------------------------------------- one dimension: words


@dataclass(frozen=True)
class _Words:
    """Words of one length: letters (n, m), the interval of starts, the length of the shortest period of the letters."""

    letters: Ints
    lo: Array
    hi: Array
    repeat: Ints


@dataclass(frozen=True)
class _Alphabet:
    """Monotone pieces of the map, cut to a set: letter k is the range [lo, hi] of a side and a branch."""

    params: Any
    side: Ints
    branch: Ints
    lo: Array
    hi: Array
    scale: float

    def follow(self, letters: Ints, x: Array) -> tuple[Array, Ints, Array]:
        """Send starts along their words: image, side, slope."""
        if x.size == 0:
            return x, np.empty(0, np.int64), x
        return along(self.params, x, self.side[letters[:, 0]], self.branch[letters])


def _alphabet(params: Any, extents: Extents, domain: Sides) -> _Alphabet:
    scale = float(max(np.abs(domain.lo).max(), np.abs(domain.hi).max()))
    rows = []
    pieces = monotone_pieces(params, domain)
    for side, pairs in sorted(extents.items()):
        for piece in pieces.get(side, ()):
            for a, b in sorted(pairs):
                lo, hi = max(piece.lo, float(a) - NEAR * scale), min(piece.hi, float(b) + NEAR * scale)
                if lo <= hi:
                    rows.append((side, piece.branch, lo, hi))
    table = np.array(rows, dtype=np.float64).reshape(-1, 4)
    sides, branches = table[:, 0].astype(np.int64), table[:, 1].astype(np.int64)
    return _Alphabet(params, sides, branches, table[:, 2].copy(), table[:, 3].copy(), scale)


def _solve(alphabet: _Alphabet, letters: Ints, lo: Array, hi: Array, target: Array | None) -> Array:
    """Solve G(x) = target, or G(x) = x where it is None, in brackets with a change of sign; Newton kept inside."""
    lo, hi = lo.copy(), hi.copy()
    x = 0.5 * (lo + hi)

    def height(rows: Ints, at: Array) -> tuple[Array, Array]:
        y, _, slope = alphabet.follow(letters[rows], at)
        return (y - at, slope - 1.0) if target is None else (y - target[rows], slope)

    f_lo, _ = height(np.arange(x.size), lo)
    active = np.arange(x.size)
    for turn in range(200):
        f, slope = height(active, x[active])
        same = (f > 0.0) == (f_lo[active] > 0.0)
        lo[active] = np.where(same, x[active], lo[active])
        hi[active] = np.where(same, hi[active], x[active])
        middle = 0.5 * (lo[active] + hi[active])
        newton = x[active] - f / np.where(slope == 0.0, np.inf, slope)
        inside = (newton > lo[active]) & (newton < hi[active]) & (turn % 4 < 3)
        proposal = np.where(inside, newton, middle)
        moving = (f != 0.0) & (middle > lo[active]) & (middle < hi[active])
        moving &= ~(inside & (np.abs(newton - x[active]) <= 0.5 * EPS * np.abs(x[active])))
        active = active[moving]
        x[active] = proposal[moving]
        if active.size == 0:
            break
    return x


def _grown(alphabet: _Alphabet, words: _Words) -> _Words:
    """Words one letter longer that some start follows and that can still be the least of their rotations."""
    a, to, _ = alphabet.follow(words.letters, words.lo)
    b, _, _ = alphabet.follow(words.letters, words.hi)
    low, high = np.minimum(a, b), np.maximum(a, b)
    fits = (to[:, None] == alphabet.side) & (high[:, None] >= alphabet.lo) & (low[:, None] <= alphabet.hi)
    length = words.letters.shape[1]
    mirror = words.letters[np.arange(to.size), length - words.repeat]
    fits &= np.arange(alphabet.lo.size) >= mirror[:, None]
    row, letter = np.nonzero(fits)
    old, rising = words.letters[row], b[row] >= a[row]
    ends = [words.lo[row], words.hi[row]]
    bounds = (
        (alphabet.lo[letter], low[row] < alphabet.lo[letter], rising),
        (alphabet.hi[letter], high[row] > alphabet.hi[letter], ~rising),
    )
    for bound, beyond, at_lower_start in bounds:
        which = np.flatnonzero(beyond)
        at = _solve(alphabet, old[which], words.lo[row][which], words.hi[row][which], bound[which])
        first = at_lower_start[which]
        ends[0][which[first]] = at[first]
        ends[1][which[~first]] = at[~first]
    repeat = np.where(letter == mirror[row], words.repeat[row], length + 1)
    return _Words(np.column_stack([old, letter]), ends[0], np.maximum(*ends), repeat)


def _brackets(
    alphabet: _Alphabet, letters: Ints, lo: Array, hi: Array
) -> tuple[Ints, Array, Array, Ints, Array]:
    """Where G(x) - x changes sign: rows and brackets; and rows and x where it only touches zero."""
    t = np.linspace(0.0, 1.0, SAMPLES)
    x = lo[:, None] + t * (hi - lo)[:, None]
    x[:, -1] = hi
    y, _, slope = alphabet.follow(np.repeat(letters, SAMPLES, axis=0), x.ravel())
    f, rate = y.reshape(x.shape) - x, slope.reshape(x.shape) - 1.0
    row, k = np.nonzero((f[:, :-1] > 0) != (f[:, 1:] > 0))
    found = [(row, x[row, k], x[row, k + 1])]
    bends = ((f[:, :-1] > 0) == (f[:, 1:] > 0)) & ((rate[:, :-1] > 0) != (rate[:, 1:] > 0))
    bends &= (rate[:, :-1] > 0) != (f[:, :-1] > 0)  # towards zero
    row, k = np.nonzero(bends)
    a, b, before = x[row, k].copy(), x[row, k + 1].copy(), rate[row, k] > 0
    for _ in range(60):
        middle = 0.5 * (a + b)
        same = (alphabet.follow(letters[row], middle)[2] > 1.0) == before
        a, b = np.where(same, middle, a), np.where(same, b, middle)
    top = alphabet.follow(letters[row], a)[0] - a
    crossed = (top > 0) != (f[row, k] > 0)
    found += [
        (row[crossed], x[row, k][crossed], a[crossed]),
        (row[crossed], a[crossed], x[row, k + 1][crossed]),
    ]
    # An end may be a root that rounding has put just outside; so may a touching extremum.
    noise = 64.0 * EPS * alphabet.scale * (1.0 + np.abs(rate))
    touch_row, touch_k = np.nonzero(np.abs(f[:, [0, -1]]) <= noise[:, [0, -1]])
    touching = ~crossed & (np.abs(top) <= 64.0 * EPS * alphabet.scale)
    rows, los, his = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return (
        rows,
        los,
        his,
        np.concatenate([touch_row, row[touching]]),
        np.concatenate([x[touch_row, -touch_k], a[touching]]),
    )


def _closed(alphabet: _Alphabet, words: _Words) -> list[Cycle]:
    """Cycles of the words of one length."""
    length = words.letters.shape[1]
    whole = (length % words.repeat == 0) & (length <= 2 * words.repeat)
    a, to, _ = alphabet.follow(words.letters, words.lo)
    b, _, _ = alphabet.follow(words.letters, words.hi)
    slack = NEAR * alphabet.scale
    back = (np.minimum(a, b) <= words.hi + slack) & (np.maximum(a, b) >= words.lo - slack)
    k = np.flatnonzero(whole & back & (to == alphabet.side[words.letters[:, 0]]))
    if k.size == 0:
        return []
    letters = words.letters[k]
    row, lo, hi, touch_row, touch = _brackets(alphabet, letters, words.lo[k], words.hi[k])
    roots = np.concatenate([_solve(alphabet, letters[row], lo, hi, None), touch])
    return [
        _orbit(alphabet, letters[r], x) for r, x in zip(np.concatenate([row, touch_row]), roots, strict=True)
    ]


def _orbit(alphabet: _Alphabet, letters: Ints, x: float) -> Cycle:
    """Find the cycle of a word near x; Newton's method at every point of it, so that no point inherits errors."""
    period = letters.size
    rotated = letters[(np.arange(period)[:, None] + np.arange(period)) % period]
    branches, sides = alphabet.branch[letters], alphabet.side[letters]
    points = np.empty(period)
    points[0] = x
    for j in range(1, period):
        points[j] = along(alphabet.params, points[j - 1 : j], sides[j - 1], branches[j - 1 : j])[0][0]
    for _ in range(3):
        y, _, slope = alphabet.follow(rotated, points)
        with np.errstate(divide="ignore", invalid="ignore"):
            move = (y - points) / (1.0 - slope)
        good = np.isfinite(move) & (np.abs(move) < NEAR * alphabet.scale)
        points = np.where(good, points + move, points)
    after, _, slopes = along(alphabet.params, points, sides, branches[:, None])
    residual = float(np.abs(after - np.roll(points, -1)).max())
    first = int(np.lexsort((points, sides))[0])
    ahead = (np.arange(period) + first) % period
    return Cycle(points[ahead], sides[ahead], branches[ahead], period, float(np.prod(slopes)), residual, True)


def _distance(one: Cycle, other: Cycle, shift: int = 0) -> float:
    """Largest distance between corresponding points, the second orbit taken `shift` steps ahead."""
    if one.period != other.period or (one.side != np.roll(other.side, -shift)).any():
        return np.inf
    return float(np.abs(one.x - np.roll(other.x, -shift, axis=0)).max())


def _distinct(found: list[Cycle], near: float) -> list[Cycle]:
    """Each orbit once, with its smallest period, by period and least point; admissible ones are kept first."""
    kept: list[Cycle] = []
    first = np.array([float(np.ravel(cycle.x)[0]) for cycle in found])
    order = sorted(range(len(found)), key=lambda k: (found[k].period, found[k].side[0], first[k]))
    for k in order:
        cycle = found[k]
        divisors = [d for d in range(1, cycle.period) if cycle.period % d == 0]
        if any(_distance(cycle, cycle, d) <= near for d in divisors):
            continue
        twin = None
        for number in range(len(kept) - 1, -1, -1):
            other = kept[number]
            if other.period != cycle.period or float(np.ravel(other.x)[0]) < first[k] - near:
                break
            # Points that agree to rounding may begin at another one of them.
            if any(_distance(cycle, other, shift) <= near for shift in range(cycle.period)):
                twin = number
        if twin is None:
            kept.append(cycle)
        elif cycle.admissible and not kept[twin].admissible:
            kept[twin] = cycle
    return kept


def _judged(params: Any, found: list[Cycle]) -> list[Cycle]:
    """Ask the map itself whether it takes the branches of the orbits."""
    if not found:
        return []
    x, side, branch = (
        np.concatenate([getattr(c, name) for c in found]) for name in ("x", "side", "branches")
    )
    right = np.empty(side.size, dtype=bool)
    for s in np.unique(side):
        right[side == s] = images(params, x[side == s], int(s)).code == branch[side == s]
    parts = np.split(right, np.cumsum([cycle.period for cycle in found])[:-1])
    return [replace(cycle, admissible=bool(ok.all())) for cycle, ok in zip(found, parts, strict=True)]


def _require_period(up_to: int) -> None:
    if up_to < 1:
        raise AnswerError("the largest period", up_to, "an integer from 1", "pass up_to=8")


def cycles_of(
    params: Any, extents: Extents, domain: Sides, up_to: int, *, most_words: int = MOST_WORDS
) -> Cycles:
    """Find the periodic orbits of a one-dimensional map that stay in a set of intervals.

    Parameters
    ----------
    params : NamedTuple
        A map with `image_on`.
    extents : mapping of int to iterable of (lo, hi)
        The set, per side.
    domain : Domain
        Where the map's branches are looked for.
    up_to : int
        Largest period.
    most_words : int
        Words of one length beyond which the search stops.

    Returns
    -------
    Cycles

    Raises
    ------
    AnswerError
        For a map of more dimensions or without `image_on`, or a period below 1.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.cells import as_domain
    >>> from limitsets.sets.cycles import cycles_of
    >>> [(cycle.period, round(cycle.multiplier, 6)) for cycle in cycles_of(
    ...     maps.Logistic(3.2), {0: [(0.1, 0.9)]}, as_domain([(0, 1)]), 4)]  # 2 - r and 4 + 2 r - r^2
    [(1, -1.2), (2, 0.16)]
    """
    _require_period(up_to)
    alphabet = _alphabet(params, extents, domain)
    count = alphabet.lo.size
    words = _Words(np.arange(count)[:, None], alphabet.lo, alphabet.hi, np.ones(count, dtype=np.int64))
    found: list[Cycle] = []
    length = 1
    while words.lo.size and words.lo.size <= most_words:
        found += _closed(alphabet, words)
        if length == up_to:
            break
        words, length = _grown(alphabet, words), length + 1
    complete = words.lo.size <= most_words
    how = (
        "by itinerary"
        if complete
        else f"by itinerary up to period {length - 1}: too many words; raise most_words"
    )
    kept = _distinct(_judged(params, found), NEAR * alphabet.scale)
    return Cycles(kept, complete=complete, how=how)


# ---------------------------------------------------------------- two dimensions: Newton from many starts


@kernel(entry=True)
def _returns(
    params: Any, count: int, u: Any, v: Any, side: Any, after: Any, jacobian: Any, ends: Any
) -> None:
    """F^count of starts in the plane and its derivative; `ends` is the side, or -1 for an orbit that leaves."""
    for k in range(u.size):
        x, at, code = (u[k], v[k]), side[k], 0
        a, b, c, d = 1.0, 0.0, 0.0, 1.0
        for _ in range(count):
            to, side_to, code = step(params, x, at)
            if code < 0:
                break
            _, _, slope = image_on(params, x, at, code)
            (p, q), (r, s) = slope
            a, b, c, d = p * a + q * c, p * b + q * d, r * a + s * c, r * b + s * d
            x, at = to, side_to
        after[0, k], after[1, k] = x
        jacobian[0, k], jacobian[1, k], jacobian[2, k], jacobian[3, k] = a, b, c, d
        ends[k] = at if code >= 0 else -1


def _returned(params: Any, count: int, x: Array, side: Ints) -> tuple[Array, Array, Ints]:
    """F^count, its derivative (n, 4) and the side reached (-1: left) of states (n, 2)."""
    after, jacobian, ends = np.empty((2, len(x))), np.empty((4, len(x))), np.empty(len(x), np.int64)
    u, v = np.ascontiguousarray(x[:, 0]), np.ascontiguousarray(x[:, 1])
    _returns(params, count, u, v, np.ascontiguousarray(side), after, jacobian, ends)
    return after.T.copy(), jacobian.T.copy(), ends


def _newton(params: Any, count: int, x: Array, side: Ints, scale: float) -> tuple[Array, Ints]:
    """Newton's method on F^count(x) = x from all starts at once: the roots reached and their sides."""
    x, side = x.copy(), side.copy()
    done: list[tuple[Array, Ints]] = []
    for _ in range(NEWTON_STEPS):
        y, j, ends = _returned(params, count, x, side)
        a, b, c, d = j[:, 0] - 1.0, j[:, 1], j[:, 2], j[:, 3] - 1.0
        with np.errstate(all="ignore"):  # starts that run away
            f = y - x
            det = a * d - b * c
            move = np.stack([(d * f[:, 0] - b * f[:, 1]) / det, (a * f[:, 1] - c * f[:, 0]) / det], axis=1)
            size = np.abs(move).max(axis=1)
            alive = (ends == side) & np.isfinite(size) & (size < 10.0 * scale)
        rest = alive & (size <= 1e-13 * scale)
        done.append(((x - move)[rest], side[rest]))
        alive &= ~rest
        x, side = (x - move)[alive], side[alive]
        if not len(x):
            break
    return np.concatenate([states for states, _ in done]), np.concatenate([sides for _, sides in done])


def _plane_cycle(params: Any, x: Array, side: int, period: int) -> Cycle | None:
    """Follow one root around and measure it; None where it does not close."""
    points, sides, branches = np.empty((period, 2)), np.empty(period, np.int64), np.empty(period, np.int64)
    at, on = x, side
    for j in range(period):
        points[j], sides[j] = at, on
        found = images(params, at[None, :], on)
        branches[j] = found.code[0]
        if found.code[0] < 0:
            return None
        at, on = found.x[0], int(found.side[0])
    _, jacobian, _ = _returned(params, period, points[:1], sides[:1])
    values = np.linalg.eigvals(jacobian.reshape(2, 2))
    residual = float(np.abs(at - points[0]).max())
    first = int(np.lexsort((points[:, 1], points[:, 0], sides))[0])
    ahead = (np.arange(period) + first) % period
    size = float(np.abs(values).max())
    return Cycle(points[ahead], sides[ahead], branches[ahead], period, size, residual, True)


def cycles_from(params: Any, starts: ArrayLike, side: ArrayLike, up_to: int) -> Cycles:
    """Find periodic orbits of a map of the plane by Newton's method from given starts.

    Parameters
    ----------
    params : NamedTuple
        A two-dimensional map with `image_on`.
    starts : array_like, shape (n, 2)
        Starts, such as the centres of recurrent cells.
    side : int or array_like of int, shape (n,)
        Their sides.
    up_to : int
        Largest period.

    Returns
    -------
    Cycles
        `complete` is False: whether all were found is not known.

    Raises
    ------
    AnswerError
        For a map of another dimension or without `image_on`, or a period below 1.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.sets.cycles import cycles_from
    >>> found = cycles_from(maps.Henon(1.4, 0.3), [[x / 4, 0.0] for x in range(-6, 7)], 0, 1)
    >>> [round(float(cycle.x[0, 0]), 6) for cycle in found]
    [-1.131354, 0.631354]
    """
    _require_period(up_to)
    kind = kind_of(params)
    if kind.dimension != 2 or not kind.has_image_on:
        raise AnswerError("the map", kind.name, "a map of the plane with image_on", "register image_on")
    x = np.asarray(starts, dtype=np.float64).reshape(-1, 2)
    sides = np.array(np.broadcast_to(np.asarray(side, dtype=np.int64), (len(x),)))
    scale = float(np.abs(x).max())
    found: list[Cycle] = []
    for period in range(1, up_to + 1):
        roots, on = _newton(params, period, x, sides, scale)
        grid_of_roots = np.round(roots / (NEAR * scale))
        _, one_of_each = np.unique(np.column_stack([grid_of_roots, on]), axis=0, return_index=True)
        orbits = [_plane_cycle(params, roots[k], int(on[k]), period) for k in one_of_each]
        found += [orbit for orbit in orbits if orbit is not None and orbit.residual <= 1e-6 * scale]
    kept = _distinct(found, 1e3 * NEAR * scale)
    return Cycles(kept, complete=False, how="by Newton's method from many starts: completeness not claimed")


# ---------------------------------------------------------------- on a graph


def _cells(graph: Any, within: Any) -> CellSet | None:
    if within is None:
        return graph.recurrent_set()  # type: ignore[no-any-return]  # a TransitionGraph's, see limitsets.graph
    cells = within if isinstance(within, CellSet) else getattr(within, "cells", None)
    return cells if isinstance(cells, CellSet) else None


def _inside(cycle: Cycle, cells: CellSet) -> bool:
    """Whether every point of an orbit lies in the cells."""
    numbers = [
        int(cells.grid.index(x[None, :], int(side))[0]) for x, side in zip(cycle.x, cycle.side, strict=True)
    ]
    return all(number >= 0 and cells.mask[number] for number in numbers)


def cycles(graph: Any, up_to: int, within: Any = None) -> Cycles:
    """Find periodic orbits, attracting or not.

    Parameters
    ----------
    graph : TransitionGraph
        Transitions of a map with `image_on`, in one or two dimensions.
    up_to : int
        Largest period.
    within : Attractor, LimitSet or CellSet, optional
        Where to look; default all recurrent cells.  In two dimensions a set of cells, or an answer with `cells`.

    Returns
    -------
    Cycles
        A tuple of `Cycle`; its `complete` says whether every itinerary was followed (one dimension only).

    Raises
    ------
    AnswerError
        For a map of three dimensions or without `image_on`, a period below 1, or a set of another kind.

    Examples
    --------
    >>> import limitsets as ls
    >>> graph = ls.transitions(ls.maps.Logistic(3.83), ls.grid([(0.0, 1.0)], cells=4096))
    >>> [cycle.period for cycle in ls.cycles(graph, 3) if abs(cycle.multiplier) < 1]
    [3]
    """
    cells = _cells(graph, within)
    if graph.grid.dimension == 1:
        extents = cells.extents() if cells is not None else getattr(within, "extents", None)
        if not isinstance(extents, Mapping):
            raise AnswerError(
                "the set to look in", within, "an attractor, limit set or cells", "pass one of these"
            )
        return cycles_of(graph.map, extents, graph.grid.domain, up_to)
    if cells is None:
        raise AnswerError("the set to look in", within, "cells, or an answer with cells", "pass an attractor")
    numbers = cells.numbers()
    numbers = numbers[:: max(1, -(-numbers.size // MOST_STARTS))]
    sides: Sequence[int] = graph.grid.side_of(numbers).tolist()
    middles = np.empty((numbers.size, graph.grid.dimension))
    for side in set(sides):
        here = np.array(sides) == side
        lo, hi = graph.grid.boxes(numbers[here], side)
        middles[here] = 0.5 * (lo + hi)
    found = cycles_from(graph.map, middles, sides, up_to)
    if within is None:
        return found
    return Cycles((cycle for cycle in found if _inside(cycle, cells)), complete=False, how=found.how)
