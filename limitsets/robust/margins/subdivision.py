"""Proof of goals over a box of scenes by adaptive subdivision.

Two throws with the same parameters may settle the box as a whole (`proofs/two_throws.py`).  Otherwise a piece
counts as noise, which costs about as much slack again as its deviation.  Pieces therefore have to be narrow near the
worst corner, in the quantities of large sensitivity, and nowhere else.
"""

from __future__ import annotations

import heapq
import time
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from limitsets.proofs.query import Outcome, Query, unjoined
from limitsets.robust.margins.brackets import Tell
from limitsets.robust.margins.halving import halved
from limitsets.robust.margins.sensitivity import Sensitivity
from limitsets.robust.margins.vector import Parts, Tolerance

# Pieces after which the proof of the box ends with what it has.
MOST_PIECES = 4000

# What a piece costs, proved as a whole, against what was measured one quantity at a time; learned on the way.
COST, LEAST_COST, MOST_COST = 1.0, 0.7, 3.0

# Share of what was to spare at first, below which cells have to be finer: the steps of `Query.prove`.
FINER = (0.06, 0.015)

# A part is worth a try from this share of what its worst corner has to spare.
WORTH = 0.15

# Share of the largest cost that a quantity counts for at least, where nothing attracts.
LEAST_SHARE = 0.2

# A piece narrower than this share of the box is not cut again.
NARROWEST = Fraction(1, 4096)


@dataclass(order=True)
class _SubBox:
    """A box of parts of the whole deviation, by how near to the scene as it is it comes."""

    near: Fraction
    number: int
    low: Parts = field(compare=False)
    high: Parts = field(compare=False)

    def cut(self, k: int, at: Fraction, number: int) -> list[_SubBox]:
        """Cut along one quantity."""
        parts = []
        for low, high in (
            (self.low, (*self.high[:k], at, *self.high[k + 1 :])),
            ((*self.low[:k], at, *self.low[k + 1 :]), self.high),
        ):
            number += 1
            parts.append(_SubBox(_nearness(low, high), number, low, high))
        return parts


def _nearness(low: Parts, high: Parts) -> Fraction:
    """Least factor of the whole box at which a part begins to count."""
    return max(max(lo, -hi, Fraction(0)) for lo, hi in zip(low, high, strict=True))


class _Guess(NamedTuple):
    """What is to spare on a part, proved as a whole, and at its worst corner alone; the quantity to cut, and where."""

    left: float
    at_corner: float
    k: int
    at: Fraction


class Subdivision:
    """Proof of a box, piece by piece."""

    def __init__(
        self, query: Query, tolerance: Tolerance, factor: Fraction, sensitivity: Sensitivity
    ) -> None:
        self.query, self.tolerance, self.factor, self.sensitivity = query, tolerance, factor, sensitivity
        self.cost, self.noise = COST, tolerance.noise(factor)
        self.proved: list[tuple[_SubBox, Outcome]] = []
        self.tried = 0

    def judge(self, part: _SubBox) -> _Guess:
        """Guess what is to spare on a part, and where to cut it."""
        low, high = (np.array([float(x) for x in end]) * float(self.factor) for end in (part.low, part.high))
        half, known = 0.5 * (high - low), self.sensitivity
        if not half.size:
            return _Guess(1.0, 1.0, 0, Fraction(0))
        if not known.slack.size:
            k = int(np.argmax(half))
            return _Guess(1.0, 1.0, k, (part.low[k] + part.high[k]) / 2)
        costs, fall = self.cost * known.cost, np.abs(known.fall)
        at_corner = known.slack - known.fall @ (0.5 * (low + high)) - fall @ half
        left = at_corner - np.where(known.two_throws[:, None], 0.0, np.maximum(costs - fall, 0.0)) @ half
        worst = int(np.argmin(left))
        k = int(np.argmax(costs[worst] * half))
        # the part on the good side is to be as long as it may be
        wanted = WORTH * at_corner[worst] - left[worst]
        share = 2.0 * wanted / max((fall + costs)[worst, k] * 2.0 * half[k], 1e-300)
        share = share if 0.1 < share < 0.6 else 0.5
        steps = max(1, min(15, round(16 * share)))
        width = (part.high[k] - part.low[k]) * Fraction(steps, 16)
        at = part.high[k] - width if known.fall[worst, k] > 0.0 else part.low[k] + width
        return _Guess(float(left[worst]), float(at_corner[worst]), k, at)

    def run(self, seconds: float, tell: Tell) -> tuple[Fraction, str]:
        """Prove parts, nearest first; up to which part of the factor all are proved, and what stops it."""
        count = len(self.tolerance.scales)
        whole = (Fraction(-1),) * count, (Fraction(1),) * count
        waiting, number, end = [_SubBox(Fraction(0), 0, *whole)], 0, time.perf_counter() + seconds
        failed: list[tuple[Fraction, str]] = []
        while waiting:
            part = heapq.heappop(waiting)
            if failed and part.near >= min(near for near, _ in failed):
                continue
            guess = self.judge(part)
            # the whole box is worth a try whatever is guessed: two throws with the same parameters may settle it
            worth = part.number == 0 or guess.left > WORTH * guess.at_corner
            found = self._try(part, guess.left) if worth else None
            if found is not None and found.verdict == "proved":
                self.proved.append((part, found))
                self.cost = max(LEAST_COST, self.cost * 0.99)
                tell(self.done(waiting))
                continue
            if found is not None and self.sensitivity.slack.size:
                self.cost = min(MOST_COST, self.cost * 1.03)
            k, at = self._where(part, guess, found)
            why = self._stop(part, k, found, waiting, time.perf_counter() > end)
            if why:
                failed.append((part.near, why))
                continue
            for piece in part.cut(k, at, number):
                heapq.heappush(waiting, piece)
            number += 2
        return min(failed, default=(Fraction(1), ""))

    def _where(self, part: _SubBox, guess: _Guess, found: Outcome | None) -> tuple[int, Fraction]:
        """Say along which quantity to cut a part, and where.

        Where nothing attracts, or no part is proved to rest, what a quantity costs elsewhere says little: the widest.
        """
        cells = None if found is None else found.found
        if not part.low or found is None or (cells is not None and (cells.component >= 0).any()):
            return guess.k, guess.at
        widths = np.array([float(hi - lo) for lo, hi in zip(part.low, part.high, strict=True)])
        cost = self.sensitivity.cost.max(axis=0, initial=0.0)
        k = int(np.argmax(widths * np.maximum(cost / max(cost.max(initial=0.0), 1e-300), LEAST_SHARE)))
        return k, (part.low[k] + part.high[k]) / 2

    def _stop(self, part: _SubBox, k: int, found: Outcome | None, waiting: list[_SubBox], late: bool) -> str:
        """Say why a part is given up; empty if it is to be cut."""
        if late:
            return (
                "the box of all quantities ran out of time: give it more seconds, or ask for a wider bracket"
            )
        if len(self.proved) + len(waiting) >= MOST_PIECES:
            return f"the box of all quantities is in {MOST_PIECES} pieces: ask for a wider bracket"
        if part.low and part.high[k] - part.low[k] > NARROWEST:
            return ""
        return (
            found.reason if found else ""
        ) or "a piece of the box of all quantities is too narrow to be cut"

    def within(self, share: Fraction) -> list[Outcome]:
        """Return what proves a share of the box: parts that reach beyond are cut back, their cells serve for less."""
        kept = []
        for part, found in self.proved:
            low = tuple(max(x, -share) for x in part.low)
            high = tuple(min(x, share) for x in part.high)
            if any(a >= b for a, b in zip(low, high, strict=True)) or found.found is None:
                continue
            piece = self.tolerance.piece(low, high, self.factor)
            if piece is not None:
                cover = found.found.cover
                box = replace(cover.box, scene=piece.tree())
                found = replace(found, found=replace(found.found, cover=replace(cover, box=box)), piece=piece)
            kept.append(found)
        return kept

    def joined(self, share: Fraction) -> tuple[Fraction, str]:
        """Return up to which share of the box all is one claim, as a certificate has to make it, and what stops it."""
        missing = unjoined(self.within(share)) if share else ""
        if missing:
            share, _ = halved(
                Fraction(0),
                share,
                lambda part: not unjoined(self.within(part)),
                Fraction(1, 8),
                Fraction(1, 64),
            )
        return share, missing

    def done(self, waiting: list[_SubBox]) -> float:
        """Share of the pieces known so far."""
        return len(self.proved) / (len(self.proved) + len(waiting))

    def _try(self, part: _SubBox, left: float) -> Outcome:
        self.tried += 1
        finest = 3
        if self.sensitivity.slack.size:
            finest = 1 + sum(left < share * float(self.sensitivity.slack.min()) for share in FINER)
        # where nothing attracts the piece is cut: that helps more than finer cells
        piece = self.tolerance.piece(part.low, part.high, self.factor)
        return self.query.prove(piece, self.noise, finest, bases=1)
