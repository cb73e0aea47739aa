"""Periodic orbits, stable or not: by itinerary on a line, by Newton's method in the plane and on axes that close."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from limitsets.base import AnswerError, arguments_checked, shown
from limitsets.numbers.jit import kernel
from limitsets.systems.cells import CellSet, Domain
from limitsets.systems.graph.graph import TransitionGraph
from limitsets.systems.maps.contract import compiled_kind_of, has_slope
from limitsets.systems.maps.critical import Flags, Sides, bisected
from limitsets.systems.maps.drivers import closing_of, step
from limitsets.systems.maps.kernels import Closing, image_on, in_domain
from limitsets.systems.maps.pieces import along, monotone_pieces
from limitsets.systems.sets.closing import (
    NEAR,
    Array,
    Closed,
    Cycle,
    Cycles,
    Ints,
    closed,
    corrected,
    distinct,
    require_period,
    stepped,
)
from limitsets.systems.sets.end_points import EPS, Extents

# ----------------------------------------------------------------
# Itineraries of a one-dimensional map: words of monotone pieces, and the starts that follow each.
#
# The letters are the monotone pieces, cut to the set that is searched.  The starts that follow a word J_0 J_1 .. J_m-1,
#
#     X(J_0 .. J_m-1) = {x in J_0 : F(x) in J_1, ..., F^(m-1)(x) in J_m-1},
#
# form one interval, on which the composed map G = F^m is monotone: X(w J) is the part of X(w) that G sends into J, so
# words are grown letter by letter while X is not empty.  Of each word and its rotations only the least is wanted, and
# what no such word begins with is not grown: the words are the prenecklaces of Fredricksen, Kessler and Maiorana.


# Doublings of the step, of one rounding at first, by which an end is held inside a letter.
HELD = 16


@dataclass(frozen=True)
class Alphabet:
    """Monotone pieces of the map, cut to a set: letter k is the range [lo, hi] of a side and a branch.

    `torn` says that a branch jumps, so that two of its letters are different functions.
    """

    params: Any
    side: Ints
    branch: Ints
    lo: Array
    hi: Array
    scale: float
    torn: bool

    def follow(self, letters: Ints, x: Array) -> tuple[Array, Ints, Array]:
        """Send starts along their words: image, side, slope."""
        if x.size == 0:
            return x, np.empty(0, np.int64), x
        return along(self.params, x, self.side[letters[:, 0]], self.branch[letters])


@dataclass(frozen=True)
class Words:
    """Words of one length.

    Attributes
    ----------
    letters : ndarray of int, shape (n, m)
        The words.
    lo, hi : ndarray, shape (n,)
        Their starts.
    repeat : ndarray of int, shape (n,)
        Length of the shortest word whose repetition each word begins.
    """

    letters: Ints
    lo: Array
    hi: Array
    repeat: Ints

    @property
    def length(self) -> int:
        """m."""
        return int(self.letters.shape[1])


def alphabet_of(params: Any, extents: Extents, domain: Sides) -> Alphabet:
    """Cut the monotone pieces to a set, a little widened."""
    scale = float(max(np.abs(domain.lo).max(), np.abs(domain.hi).max()))
    pieces = monotone_pieces(params, domain)
    rows = [
        (side, piece.branch, max(piece.lo, a - NEAR * scale), min(piece.hi, b + NEAR * scale))
        for side, pairs in sorted(extents.items())
        for piece in pieces.get(side, ())
        for a, b in sorted(pairs)
    ]
    table = np.array(rows, dtype=np.float64).reshape(-1, 4)
    table = table[table[:, 2] <= table[:, 3]]
    sides, branches = table[:, 0].astype(np.int64), table[:, 1].astype(np.int64)
    torn = any(piece.above == "jump" for row in pieces.values() for piece in row)
    return Alphabet(
        params, sides, branches, lo=table[:, 2].copy(), hi=table[:, 3].copy(), scale=scale, torn=torn
    )


def letters_alone(alphabet: Alphabet) -> Words:
    """Words of one letter."""
    count = alphabet.lo.size
    return Words(np.arange(count)[:, None], alphabet.lo, alphabet.hi, np.ones(count, dtype=np.int64))


def solved(alphabet: Alphabet, letters: Ints, lo: Array, hi: Array, target: Array | None) -> Array:
    """Solve G(x) = target, or G(x) = x where it is None, in brackets with a change of sign; Newton kept inside."""
    lo, hi = lo.copy(), hi.copy()
    x = 0.5 * (lo + hi)

    def height(rows: Ints, at: Array) -> tuple[Array, Array]:
        y, _, slope = alphabet.follow(letters[rows], at)
        return (y - at, slope - 1.0) if target is None else (y - target[rows], slope)

    active = np.arange(x.size)
    below = height(active, lo)[0] > 0.0
    for turn in range(200):
        f, slope = height(active, x[active])
        same = (f > 0.0) == below[active]
        lo[active] = np.where(same, x[active], lo[active])
        hi[active] = np.where(same, hi[active], x[active])
        middle = 0.5 * (lo[active] + hi[active])
        newton = x[active] - f / np.where(slope == 0.0, np.inf, slope)
        # Every fourth turn halves the bracket, so that a Newton step that crawls does not last.
        inside = (newton > lo[active]) & (newton < hi[active]) & (turn % 4 < 3)
        proposal = np.where(inside, newton, middle)
        crawls = inside & (np.abs(newton - x[active]) <= 0.5 * EPS * np.abs(x[active]))
        moving = (f != 0.0) & (middle > lo[active]) & (middle < hi[active]) & ~crawls
        active = active[moving]
        x[active] = proposal[moving]
        if active.size == 0:
            break
    return x


def _held(alphabet: Alphabet, letters: Ints, x: Array, inward: Array, low: Array, high: Array) -> Array:
    """Move ends of starts inward until G sends them into [low, high]: beyond a jump the branch leads elsewhere."""
    for doublings in range(HELD if alphabet.torn else 0):
        y = alphabet.follow(letters, x)[0]
        x = np.where((y < low) | (y > high), x + inward * 2.0**doublings, x)
    return x


def grown(alphabet: Alphabet, words: Words) -> Words:
    """Words one letter longer that some start follows and that can still be the least of their rotations."""
    a, to, _ = alphabet.follow(words.letters, words.lo)
    b, _, _ = alphabet.follow(words.letters, words.hi)
    low, high = np.minimum(a, b), np.maximum(a, b)
    # Which letters may follow which word: G sends X(w) to [low, high], which has to meet the letter; and a letter less
    # than the one a repetition back (its mirror) would begin a lesser rotation.
    mirror = words.letters[np.arange(to.size), words.length - words.repeat]
    meets = (high[:, None] >= alphabet.lo) & (low[:, None] <= alphabet.hi) & (to[:, None] == alphabet.side)
    row, letter = np.nonzero(meets & (np.arange(alphabet.lo.size) >= mirror[:, None]))
    old, rising = words.letters[row], b[row] >= a[row]
    lo, hi = words.lo[row], words.hi[row]
    starts = np.stack([lo, hi])
    bottom, top = alphabet.lo[letter], alphabet.hi[letter]
    # Where G reaches beyond the letter, the start that it sends to the letter's end is an end of the new X.
    for bound, beyond, is_lo in ((bottom, low[row] < bottom, rising), (top, high[row] > top, ~rising)):
        which = np.flatnonzero(beyond)
        first = is_lo[which]
        at = solved(alphabet, old[which], lo[which], hi[which], bound[which])
        inward = np.where(first, EPS, -EPS) * alphabet.scale
        at = _held(alphabet, old[which], at, inward, bottom[which], top[which])
        starts[np.where(first, 0, 1), which] = at
    repeat = np.where(letter == mirror[row], words.repeat[row], words.length + 1)
    return Words(np.column_stack([old, letter]), starts[0], np.maximum(*starts), repeat)


# ----------------------------------------------------------------
# Cycles of a one-dimensional map by itinerary: roots of G(x) = x for the composed map G of every word.
#
# A cycle repeats its itinerary, so it is a fixed point of G on the starts of one word, the least rotation of it
# .  Each cycle then comes up once.  A falling G has in addition cycles of twice its
# word's length, which is why a word repeated once is closed too.


# Samples of G(x) - x per word; between two of them of one sign an extremum towards zero is followed.
SAMPLES = 17
MOST_WORDS = 400_000


def _tops(alphabet: Alphabet, letters: Ints, x: Array, f: Array, rate: Array) -> tuple[Ints, Ints, Array]:
    """Extrema of G(x) - x towards zero between samples of one sign: rows and columns of the samples, and x."""
    one_sign = (f[:, :-1] > 0) == (f[:, 1:] > 0)
    turns = (rate[:, :-1] > 0) != (rate[:, 1:] > 0)
    to_zero = (rate[:, :-1] > 0) != (f[:, :-1] > 0)
    row, k = np.nonzero(one_sign & turns & to_zero)
    before = rate[row, k] > 0

    def not_yet(_lo: Array, middle: Array, _hi: Array) -> Flags:
        return np.asarray((alphabet.follow(letters[row], middle)[2] > 1.0) == before)

    return row, k, bisected(x[row, k], x[row, k + 1], not_yet)[0]


def _roots(alphabet: Alphabet, letters: Ints, lo: Array, hi: Array) -> tuple[Ints, Array]:
    """Rows and roots of G(x) = x on the starts of each word: where G(x) - x changes sign, or only touches zero."""
    x = lo[:, None] + np.linspace(0.0, 1.0, SAMPLES) * (hi - lo)[:, None]
    x[:, -1] = hi
    y, _, slope = alphabet.follow(np.repeat(letters, SAMPLES, axis=0), x.ravel())
    f, rate = y.reshape(x.shape) - x, slope.reshape(x.shape) - 1.0
    row, k = np.nonzero((f[:, :-1] > 0) != (f[:, 1:] > 0))
    bent, j, top = _tops(alphabet, letters, x, f, rate)
    height = alphabet.follow(letters[bent], top)[0] - top
    crossed = (height > 0) != (f[bent, j] > 0)
    rows = np.concatenate([row, bent[crossed], bent[crossed]])
    los = np.concatenate([x[row, k], x[bent, j][crossed], top[crossed]])
    his = np.concatenate([x[row, k + 1], top[crossed], x[bent, j + 1][crossed]])
    # An end may be a root that rounding has put just outside; so may an extremum.
    noise = 64.0 * EPS * alphabet.scale
    at_end, end = np.nonzero(np.abs(f[:, [0, -1]]) <= noise * (1.0 + np.abs(rate[:, [0, -1]])))
    touching = ~crossed & (np.abs(height) <= noise)
    return (
        np.concatenate([rows, at_end, bent[touching]]),
        np.concatenate([solved(alphabet, letters[rows], los, his, None), x[at_end, -end], top[touching]]),
    )


def _closed_orbits(alphabet: Alphabet, letters: Ints, x: Array) -> list[Closed]:
    """Cycles near the starts x, one of each word, that close under the map itself."""
    branches, sides = alphabet.branch[letters], alphabet.side[letters]
    points = np.empty((*letters.shape, 1))
    points[:, 0, 0] = x
    for j in range(1, letters.shape[1]):
        points[:, j, 0] = along(
            alphabet.params, points[:, j - 1, 0], sides[:, j - 1], branches[:, j - 1, None]
        )[0]

    def slopes(at: Array, side: Ints, branch: Ints) -> Array:
        return along(alphabet.params, at[:, 0], side, branch[:, None])[2]

    def forced(at: Array) -> tuple[Array, Array]:
        after, _, slope = along(alphabet.params, at.ravel(), sides.ravel(), branches.reshape(-1, 1))
        return after.reshape(at.shape), slope.reshape(*at.shape, 1)

    points = corrected(forced, points, alphabet.scale, 3)
    return closed(alphabet.params, points, sides, alphabet.scale, slopes)


def _closed(alphabet: Alphabet, words: Words) -> list[Closed]:
    """Cycles of the words of one length."""
    whole = (words.length % words.repeat == 0) & (words.length <= 2 * words.repeat)
    a, to, _ = alphabet.follow(words.letters, words.lo)
    b, _, _ = alphabet.follow(words.letters, words.hi)
    slack = NEAR * alphabet.scale
    back = (np.minimum(a, b) <= words.hi + slack) & (np.maximum(a, b) >= words.lo - slack)
    k = np.flatnonzero(whole & back & (to == alphabet.side[words.letters[:, 0]]))
    rows, roots = _roots(alphabet, words.letters[k], words.lo[k], words.hi[k])
    if rows.size == 0:
        return []
    return _closed_orbits(alphabet, words.letters[k[rows]], roots)


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
    >>> from limitsets.sets import cycles_of
    >>> [(cycle.period, round(cycle.multiplier, 6)) for cycle in cycles_of(
    ...     maps.Logistic(3.2), {0: [(0.1, 0.9)]}, as_domain([(0, 1)]), 4)]  # 2 - r and 4 + 2 r - r^2
    [(1, -1.2), (2, 0.16)]
    """
    require_period(up_to)
    domain.require_ends("the domain of cycles by itinerary")
    alphabet = alphabet_of(params, extents, domain)
    words = letters_alone(alphabet)
    closed_orbits: list[Closed] = []
    while words.lo.size and words.lo.size <= most_words:
        closed_orbits += _closed(alphabet, words)
        if words.length == up_to:
            break
        words = grown(alphabet, words)
    complete = words.lo.size <= most_words
    how = "by itinerary"
    if not complete:
        how += f" up to period {words.length - 1}: too many words; raise most_words"
    return Cycles(distinct(closed_orbits), complete=complete, how=how)


# ----------------------------------------------------------------
# Cycles of a map of the plane, or on axes that close, by Newton's method on F^p(x) = x from many starts.
#
# In the plane pieces have no order and words no intervals; nothing tells whether all cycles were found, and the answer
# says so.  Along an axis that closes F^p(x) = x up to whole turns: a step of Newton's is taken towards the nearest.


NEWTON_STEPS = 60
# Relative to the extent of x: after a Newton step this small the next one, at all points, ends the search.
ARRIVED = 1e-7


@kernel(entry=True)
def _returns(
    params: Any,
    count: int,
    u: Any,
    v: Any,
    side: Any,
    after: Any,
    jacobian: Any,
    ends: Any,
    axes: Closing | None,
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
            x, at = in_domain(to, side_to, axes), side_to
        after[0, k], after[1, k] = x
        jacobian[0, k], jacobian[1, k], jacobian[2, k], jacobian[3, k] = a, b, c, d
        ends[k] = at if code >= 0 else -1


def _returned_on_line(
    params: Any, count: int, x: Array, side: Ints, domain: Domain | None
) -> tuple[Array, Array, Ints]:
    """Do what `_returned` does, in one dimension."""
    slope, stays = np.ones(len(x)), np.ones(len(x), dtype=bool)
    for _ in range(count):
        after, to, code = stepped(params, x, side)
        stays &= code >= 0
        slope = slope * along(params, x[:, 0], side, np.maximum(code, 0)[:, None])[2]
        side = np.where(stays, to, 0)
        x = after if domain is None else domain.wrapped(after, side)
    return x, slope[:, None], np.where(stays, side, -1)


def _returned(
    params: Any, count: int, x: Array, side: Ints, domain: Domain | None
) -> tuple[Array, Array, Ints]:
    """F^count, its derivative (n, d^2) and the side reached (-1: left) of states (n, d), d up to 2."""
    if x.shape[1] == 1:
        return _returned_on_line(params, count, x, side, domain)
    after, jacobian, ends = np.empty((2, len(x))), np.empty((4, len(x))), np.empty(len(x), np.int64)
    u, v = np.ascontiguousarray(x[:, 0]), np.ascontiguousarray(x[:, 1])
    _returns(params, count, u, v, np.ascontiguousarray(side), after, jacobian, ends, closing_of(domain))
    return after.T.copy(), jacobian.T.copy(), ends


def _move(jacobian: Array, miss: Array) -> Array:
    """Solve (J - 1) move = miss for many starts; nan or huge where that is singular."""
    if miss.shape[1] == 1:
        return np.asarray(miss / (jacobian - 1.0))
    a, b, c, d = jacobian[:, 0] - 1.0, jacobian[:, 1], jacobian[:, 2], jacobian[:, 3] - 1.0
    det = a * d - b * c
    return np.stack(
        [(d * miss[:, 0] - b * miss[:, 1]) / det, (a * miss[:, 1] - c * miss[:, 0]) / det], axis=1
    )


def _newton(
    params: Any, count: int, x: Array, side: Ints, scale: float, domain: Domain | None
) -> tuple[Array, Ints]:
    """Newton's method on F^count(x) = x from all starts at once: the roots reached and their sides."""
    roots, sides = [x[:0]], [np.empty(0, np.int64)]
    for _ in range(NEWTON_STEPS):
        if not len(x):
            break
        y, jacobian, ends = _returned(params, count, x, side, domain)
        with np.errstate(all="ignore"):  # starts that run away
            move = _move(jacobian, y - x if domain is None else domain.shortest(y - x, side))
            size = np.abs(move).max(axis=1)
            alive = (ends == side) & np.isfinite(size) & (size < 10.0 * scale)
            better = x - move if domain is None else domain.wrapped(x - move, side)
        arrived = alive & (size <= ARRIVED * scale)
        roots.append(better[arrived])
        sides.append(side[arrived])
        x, side = better[alive & ~arrived], side[alive & ~arrived]
    return np.concatenate(roots), np.concatenate(sides)


def _followed(
    params: Any, roots: Array, side: Ints, period: int, domain: Domain | None
) -> tuple[Array, Ints]:
    """Follow roots around: points (n, period, d) and sides of those that do not leave."""
    points, sides = np.empty((len(roots), period, roots.shape[1])), np.empty((len(roots), period), np.int64)
    stays = np.ones(len(roots), dtype=bool)
    at, on = roots, side
    for j in range(period):
        points[:, j], sides[:, j] = at, on
        at, _, on = _returned(params, 1, at, np.maximum(on, 0), domain)
        stays &= on >= 0
    return points[stays], sides[stays]


def cycles_from(
    params: Any,
    starts: ArrayLike,
    side: ArrayLike,
    up_to: int,
    *,
    domain: Domain | None = None,
    most_cycles: float = math.inf,
) -> Cycles:
    """Find periodic orbits of a map of the plane, or on axes that close, by Newton's method from given starts.

    Parameters
    ----------
    params : NamedTuple
        A two-dimensional map with `image_on`; a one-dimensional one where the axis of the domain closes.
    starts : array_like, shape (n, 2) or (n, 1)
        Starts, such as the centres of recurrent cells.
    side : int or array_like of int, shape (n,)
        Their sides.
    up_to : int
        Largest period.
    domain : Domain, optional
        With axes that close: an orbit closes there up to whole periods, and is shown in the domain.
    most_cycles : float
        Number of cycles beyond which no longer ones are looked for.

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
    >>> from limitsets.sets import cycles_from
    >>> found = cycles_from(maps.Henon(1.4, 0.3), [[x / 4, 0.0] for x in range(-6, 7)], 0, 1)
    >>> [round(float(cycle.x[0, 0]), 6) for cycle in found]
    [-1.131354, 0.631354]
    """
    require_period(up_to)
    kind = compiled_kind_of(params, "cycles")
    line = kind.dimension == 1 and domain is not None and domain.closes
    if not (kind.dimension == 2 or line) or not has_slope(params):
        if kind.dimension > 2:
            way = 'limitsets.certify(map, grid, ["all-cycles"], period=3) lists all of a box'
            raise AnswerError(
                "the map of cycles", f"{kind.name}, of {kind.dimension} coordinates", "one or two", way
            )
        raise AnswerError("the map", kind.name, "a map of the plane with image_on", "register image_on")
    x = np.asarray(starts, dtype=np.float64).reshape(-1, kind.dimension)
    sides = np.array(np.broadcast_to(np.asarray(side, dtype=np.int64), (len(x),)))
    scale = float(np.abs(x).max())
    answer: list[Cycle] = []
    how = "by Newton's method from many starts: completeness not claimed"

    def slopes(at: Array, on: Ints, _: Ints) -> Array:
        return _returned(params, 1, at, on, domain)[1]

    for period in range(1, up_to + 1):
        roots, on = _newton(params, period, x, sides, scale, domain)
        keys = np.column_stack([np.round(roots / (NEAR * scale)), on])
        _, one_of_each = np.unique(keys, axis=0, return_index=True)
        orbits = _followed(params, roots[one_of_each], on[one_of_each], period, domain)
        seams = len(kind.branches) == 1
        answer += distinct(closed(params, *orbits, scale, slopes, seams=seams, domain=domain))
        if len(answer) > most_cycles:
            how += f", up to period {period}: there are more than {most_cycles} cycles"
            break
    return Cycles(answer, complete=False, how=how)


MOST_STARTS = 20_000


def _cells(graph: TransitionGraph, within: Any) -> CellSet | None:
    """Cells of a set or of an answer, by default all recurrent ones; None where it has none."""
    if within is None:
        return graph.recurrent_set()
    cells = within if isinstance(within, CellSet) else getattr(within, "cells", None)
    return cells if isinstance(cells, CellSet) else None


def _middles(cells: CellSet) -> tuple[Array, Ints]:
    """Middles of the cells, of every second, third, ... one where there are very many, and their sides."""
    numbers = cells.numbers()
    numbers = numbers[:: max(1, -(-numbers.size // MOST_STARTS))]
    lo, hi, sides = cells.grid.corners(numbers)
    return 0.5 * (lo + hi), sides


@arguments_checked
def cycles(graph: TransitionGraph, up_to: int, within: Any = None) -> Cycles:
    """Find periodic orbits, attracting or not.

    Parameters
    ----------
    graph : TransitionGraph
        Transitions of a map with `image_on`, in one or two dimensions.
    up_to : int
        Largest period.
    within : Attractor, LimitSet or CellSet, optional
        Where to look; default all recurrent cells.  In two dimensions, and on axes that close, a set of cells, or an
        answer with `cells`.

    Returns
    -------
    Cycles
        A tuple of `Cycle`; its `complete` says whether every itinerary was followed (one dimension only, and no axis
        that closes).

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
    compiled_kind_of(graph.map, "cycles")
    cells = _cells(graph, within)
    domain = graph.grid.domain
    if graph.grid.dimension == 1 and not domain.closes:
        extents = cells.extents() if cells is not None else getattr(within, "extents", None)
        if not isinstance(extents, Mapping):
            raise AnswerError(
                "the set to look in", shown(within), "an attractor, limit set or cells", "pass one of these"
            )
        return cycles_of(graph.map, extents, domain, up_to)
    if cells is None:
        raise AnswerError(
            "the set to look in", shown(within), "cells, or an answer with cells", "pass an attractor"
        )
    return cycles_near(graph.map, cells, up_to, everywhere=within is None)


def cycles_near(
    params: Any, cells: CellSet, up_to: int, *, everywhere: bool = False, most_cycles: float = math.inf
) -> Cycles:
    """Find cycles by Newton's method from the middles of cells, that lie in these, or `everywhere` in the domain."""
    answer = cycles_from(params, *_middles(cells), up_to, domain=cells.grid.domain, most_cycles=most_cycles)
    cells = CellSet(cells.grid, np.ones_like(cells.mask)) if everywhere else cells
    inside = (cycle for cycle in answer if cells.holds(cycle.x, cycle.side).all())
    return Cycles(inside, complete=False, how=answer.how)
