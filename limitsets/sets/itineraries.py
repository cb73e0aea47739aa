"""Itineraries of a one-dimensional map: words of monotone pieces, and the starts that follow each.

The letters are the monotone pieces, cut to the set that is searched.  The starts that follow a word J_0 J_1 .. J_m-1,

    X(J_0 .. J_m-1) = {x in J_0 : F(x) in J_1, ..., F^(m-1)(x) in J_m-1},

form one interval, on which the composed map G = F^m is monotone: X(w J) is the part of X(w) that G sends into J, so
words are grown letter by letter while X is not empty.  Of each word and its rotations only the least is wanted, and
what no such word begins with is not grown: the words are the prenecklaces of Fredricksen, Kessler and Maiorana.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from limitsets.maps.bisection import Flags
from limitsets.maps.critical import Sides
from limitsets.maps.forced import along
from limitsets.maps.pieces import monotone_pieces
from limitsets.sets.cycle import NEAR, Array, Ints
from limitsets.sets.unions import EPS, Extents


@dataclass(frozen=True)
class Alphabet:
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
    return Alphabet(params, sides, branches, table[:, 2].copy(), table[:, 3].copy(), scale)


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
        moving = (f != 0.0) & (middle > lo[active]) & (middle < hi[active])
        moving &= ~(inside & (np.abs(newton - x[active]) <= 0.5 * EPS * np.abs(x[active])))
        active = active[moving]
        x[active] = proposal[moving]
        if active.size == 0:
            break
    return x


def _fits(alphabet: Alphabet, words: Words, to: Ints, low: Array, high: Array) -> tuple[Flags, Ints]:
    """Which letters may follow which word, and the letter each word has one repetition back.

    G sends X(w) to [low, high], which has to meet the letter; and a letter less than the one a repetition back would
    begin a lesser rotation.
    """
    mirror = words.letters[np.arange(to.size), words.length - words.repeat]
    meets = (high[:, None] >= alphabet.lo) & (low[:, None] <= alphabet.hi)
    letter = np.arange(alphabet.lo.size)
    return (to[:, None] == alphabet.side) & meets & (letter >= mirror[:, None]), mirror


def grown(alphabet: Alphabet, words: Words) -> Words:
    """Words one letter longer that some start follows and that can still be the least of their rotations."""
    a, to, _ = alphabet.follow(words.letters, words.lo)
    b, _, _ = alphabet.follow(words.letters, words.hi)
    low, high = np.minimum(a, b), np.maximum(a, b)
    fits, mirror = _fits(alphabet, words, to, low, high)
    row, letter = np.nonzero(fits)
    old, rising = words.letters[row], b[row] >= a[row]
    lo, hi = words.lo[row], words.hi[row]
    starts = [lo.copy(), hi.copy()]
    bottom, top = alphabet.lo[letter], alphabet.hi[letter]
    # Where G reaches beyond the letter, the start that it sends to the letter's end is an end of the new X.
    for bound, beyond, is_lo in ((bottom, low[row] < bottom, rising), (top, high[row] > top, ~rising)):
        which = np.flatnonzero(beyond)
        at = solved(alphabet, old[which], lo[which], hi[which], bound[which])
        first = is_lo[which]
        starts[0][which[first]] = at[first]
        starts[1][which[~first]] = at[~first]
    repeat = np.where(letter == mirror[row], words.repeat[row], words.length + 1)
    return Words(np.column_stack([old, letter]), starts[0], np.maximum(*starts), repeat)
