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

from limitsets.maps.critical import Sides
from limitsets.maps.forced import along
from limitsets.maps.pieces import monotone_pieces
from limitsets.sets.cycle import NEAR, Array, Ints
from limitsets.sets.unions import EPS, Extents

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
    return Alphabet(params, sides, branches, table[:, 2].copy(), table[:, 3].copy(), scale, torn)


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
