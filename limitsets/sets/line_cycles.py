"""Cycles of a one-dimensional map by itinerary: roots of G(x) = x for the composed map G of every word.

A cycle repeats its itinerary, so it is a fixed point of G on the starts of one word, the least rotation of it
(`limitsets.sets.itineraries`).  Each cycle then comes up once.  A falling G has in addition cycles of twice its
word's length, which is why a word repeated once is closed too.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from limitsets.maps.bisection import Flags, bisected
from limitsets.maps.critical import Sides
from limitsets.maps.forced import along
from limitsets.sets.closing import Closed, closed, corrected, distinct
from limitsets.sets.cycle import NEAR, Array, Cycles, Ints, require_period
from limitsets.sets.itineraries import Alphabet, Words, alphabet_of, grown, letters_alone, solved
from limitsets.sets.unions import EPS, Extents

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
        flags: Flags = (alphabet.follow(letters[row], middle)[2] > 1.0) == before
        return flags

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


def _orbits(alphabet: Alphabet, letters: Ints, x: Array) -> list[Closed]:
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
    return _orbits(alphabet, words.letters[k[rows]], roots)


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
    alphabet = alphabet_of(params, extents, domain)
    words = letters_alone(alphabet)
    found: list[Closed] = []
    while words.lo.size and words.lo.size <= most_words:
        found += _closed(alphabet, words)
        if words.length == up_to:
            break
        words = grown(alphabet, words)
    complete = words.lo.size <= most_words
    how = "by itinerary"
    if not complete:
        how += f" up to period {words.length - 1}: too many words; raise most_words"
    return Cycles(distinct(found), complete=complete, how=how)
