"""The joint margin: the factor on a whole vector of tolerances, up to which goals are proved.

Every quantity is fixed but unknown, but for the landing place, which differs at every throw.  The box is cut where it
pays: proved as a whole a piece counts as noise, which costs about as much again as its deviation does, so pieces have
to be narrow near the worst corner, in the quantities that matter there, and nowhere else.
"""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from limitsets.errors import AnswerError
from limitsets.goals import Goal
from limitsets.proofs.tolerance import Piece
from limitsets.robust.margins.asking import Asked, Question
from limitsets.robust.margins.deviations import Measure, measure, short
from limitsets.robust.margins.effect import Effects, effects_of, scene_at
from limitsets.robust.margins.finding import Margin, asked_of
from limitsets.scene import Scene
from limitsets.scene.quantities import deviation
from limitsets.scene.units import parse

__all__ = ["joint_margin"]

# Seconds and pieces after which the proof of the box ends with what it has.
SECONDS, MOST_PIECES = 150.0, 4000

# Parts of the bracket's lower end that are proved in turn.
STAGES = tuple(Fraction(n, 32) for n in (1, 2, 4, 8, 16, 24, 32))

# What a piece costs, proved as a whole, against what was measured one quantity at a time; learned on the way.
COST, LEAST_COST, MOST_COST = 1.0, 0.7, 3.0

# Share of what was to spare at first, below which cells have to be finer: the steps of `Question.prove`.
FINER = (0.06, 0.015)

# A part is worth a try from this share of what its worst corner has to spare.
WORTH = 0.15

# A piece narrower than this share of the box is not cut again.
NARROWEST = Fraction(1, 4096)

Tell = Callable[[float], None]
Sizes = tuple[Fraction, ...]


@dataclass(frozen=True, eq=False)
class Tolerance:
    """A vector of deviations.

    Attributes
    ----------
    measures : tuple of Measure
        What is fixed but unknown.
    sizes : tuple of Fraction
        A size for each.
    landing : Measure or None
        Where parts land, at every throw, if that is in it.
    landing_size : Fraction
        How far.
    """

    measures: tuple[Measure, ...]
    sizes: tuple[Fraction, ...]
    landing: Measure | None
    landing_size: Fraction

    @classmethod
    def of(cls, scene: Scene, texts: Mapping[str, str]) -> Tolerance:
        """Read it from texts by quantity."""
        measures, sizes, landing, landing_size = [], [], None, Fraction(0)
        if not texts:
            raise AnswerError(
                "the tolerance", "empty", "deviations by quantity", "give the scene [tolerance]"
            )
        for name, text in texts.items():
            deviation(text, name, scene.unit, key=f'tolerance."{name}"')
            one = measure(scene, name)
            share = text.rstrip().endswith("%")
            given = parse(text, "share" if share else _dimension(name))
            one = replace(one, unit=given.unit)
            if name == "throw.speed" and one.key != name and not share:
                raise AnswerError("the tolerance", text, "percent, for a scene given by kappa", "give it so")
            if name == "landing.x":
                landing, landing_size = one, Fraction(given.number)
            else:
                measures.append(one)
                sizes.append(Fraction(given.number))
        return cls(tuple(measures), tuple(sizes), landing, landing_size)

    def noise(self, factor: Fraction) -> dict[str, str]:
        """Say what differs at every throw."""
        return (
            {}
            if self.landing is None
            else {"landing.x": self.landing.text(short(factor * self.landing_size))}
        )

    def texts(self, factor: Fraction) -> dict[str, str]:
        """Say what is fixed but unknown, as `limitsets.certify` takes it."""
        return {
            one.quantity: one.text(factor * size) for one, size in zip(self.measures, self.sizes, strict=True)
        }

    def corner(self, factor: Fraction, signs: tuple[int, ...]) -> Piece | None:
        """Return the scene at one corner."""
        if not self.measures:
            return None
        sizes = [factor * size * sign for size, sign in zip(self.sizes, signs, strict=True)]
        return scene_at(self.measures, sizes)

    def piece(self, low: Sizes, high: Sizes, factor: Fraction) -> Piece | None:
        """Return the scenes between two corners, given as parts of the whole deviation."""
        if not self.measures:
            return None
        spans = {
            one.key: one.between(factor * size * lo, factor * size * hi)
            for one, size, lo, hi in zip(self.measures, self.sizes, low, high, strict=True)
        }
        return Piece(self.measures[0].scene, spans)


def _dimension(name: str) -> str:
    from limitsets.scene.quantities import find

    return find(name).dimension


@dataclass(order=True)
class _Part:
    """A box of parts of the whole deviation, by how near to the scene as it is it comes."""

    near: Fraction
    number: int
    low: Sizes = field(compare=False)
    high: Sizes = field(compare=False)

    def cut(self, k: int, at: Fraction, number: int) -> list[_Part]:
        """Cut along one quantity."""
        parts = []
        for low, high in (
            (self.low, (*self.high[:k], at, *self.high[k + 1 :])),
            ((*self.low[:k], at, *self.low[k + 1 :]), self.high),
        ):
            number += 1
            parts.append(_Part(_nearness(low, high), number, low, high))
        return parts


def _nearness(low: Sizes, high: Sizes) -> Fraction:
    """Least factor of the whole box at which a part begins to count."""
    return max(max(lo, -hi, Fraction(0)) for lo, hi in zip(low, high, strict=True))


class _Guess(NamedTuple):
    """What is to spare on a part, proved as a whole, and at its worst corner alone; the quantity to cut, and where."""

    left: float
    at_corner: float
    k: int
    at: Fraction


class _Cutting:
    """Proof of a box, piece by piece."""

    def __init__(self, question: Question, tolerance: Tolerance, factor: Fraction, effects: Effects) -> None:
        self.question, self.tolerance, self.factor, self.effects = question, tolerance, factor, effects
        self.cost, self.noise = COST, tolerance.noise(factor)
        self.proved: list[tuple[_Part, Asked]] = []
        self.tried = 0

    def judge(self, part: _Part) -> _Guess:
        """Guess what is to spare on a part, and where to cut it."""
        low, high = (np.array([float(x) for x in end]) * float(self.factor) for end in (part.low, part.high))
        half, effects = 0.5 * (high - low), self.effects
        if not half.size:
            return _Guess(1.0, 1.0, 0, Fraction(0))
        if not effects.spare.size:
            k = int(np.argmax(half))
            return _Guess(1.0, 1.0, k, (part.low[k] + part.high[k]) / 2)
        costs, fall = self.cost * effects.cost, np.abs(effects.fall)
        at_corner = effects.spare - effects.fall @ (0.5 * (low + high)) - fall @ half
        left = at_corner - np.maximum(costs - fall, 0.0) @ half
        worst = int(np.argmin(left))
        k = int(np.argmax(costs[worst] * half))
        # the part on the good side is to be as long as it may be
        wanted = WORTH * at_corner[worst] - left[worst]
        share = 2.0 * wanted / max((fall + costs)[worst, k] * 2.0 * half[k], 1e-300)
        share = share if 0.1 < share < 0.6 else 0.5
        steps = max(1, min(15, round(16 * share)))
        width = (part.high[k] - part.low[k]) * Fraction(steps, 16)
        at = part.high[k] - width if effects.fall[worst, k] > 0.0 else part.low[k] + width
        return _Guess(float(left[worst]), float(at_corner[worst]), k, at)

    def run(self, seconds: float, tell: Tell) -> tuple[Fraction, str]:
        """Prove parts, nearest first; up to which part of the factor all are proved, and what stops it."""
        count = len(self.tolerance.measures)
        whole = (Fraction(-1),) * count, (Fraction(1),) * count
        waiting, number, end = [_Part(Fraction(0), 0, *whole)], 0, time.perf_counter() + seconds
        failed: list[tuple[Fraction, str]] = []
        while waiting:
            part = heapq.heappop(waiting)
            if failed and part.near >= min(near for near, _ in failed):
                continue
            guess = self.judge(part)
            k = guess.k
            found = self._try(part, guess.left) if guess.left > WORTH * guess.at_corner or not count else None
            if found is not None and found.verdict == "proved":
                self.proved.append((part, found))
                self.cost = max(LEAST_COST, self.cost * 0.99)
                tell(self.done(waiting))
                continue
            if found is not None and self.effects.spare.size:
                self.cost = min(MOST_COST, self.cost * 1.03)
            over = time.perf_counter() > end or len(self.proved) + len(waiting) >= MOST_PIECES
            narrow = not count or part.high[k] - part.low[k] <= NARROWEST
            if over or narrow:
                why = (
                    "the box of all quantities ran out of time: give it more seconds, or ask for a wider bracket"
                    if over
                    else (found.reason if found else "")
                )
                failed.append((part.near, why))
                continue
            for piece in part.cut(k, guess.at, number):
                heapq.heappush(waiting, piece)
            number += 2
        return min(failed, default=(Fraction(1), ""))

    def within(self, share: Fraction) -> list[Asked]:
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

    def done(self, waiting: list[_Part]) -> float:
        """Share of the pieces known so far."""
        return len(self.proved) / (len(self.proved) + len(waiting))

    def _try(self, part: _Part, left: float) -> Asked:
        self.tried += 1
        finest = 3
        if self.effects.spare.size:
            finest = 1 + sum(left < share * float(self.effects.spare.min()) for share in FINER)
        # where nothing attracts the piece is cut: that helps more than finer cells
        piece = self.tolerance.piece(part.low, part.high, self.factor)
        return self.question.prove(piece, self.noise, finest, bases=1)


def _worst(
    question: Question, tolerance: Tolerance, effects: Effects, width: Fraction
) -> tuple[Fraction, Fraction | None, Asked | None, str]:
    """Bracket the factor at the worst corners, as single scenes: proved, refuted, by what, why not."""
    corners = effects.corners() or [(1,) * len(tolerance.measures), (-1,) * len(tolerance.measures)]
    bad: Fraction | None = None
    against, good_all, reason = None, None, ""
    for signs in corners[:4]:
        good, own, by, why = _at_corner(question, tolerance, signs, width, bad)
        good_all = good if good_all is None else min(good_all, good)
        if own is not None and (bad is None or own < bad):
            bad, against = own, by
        reason = reason or why
    return good_all or Fraction(0), bad, against, "" if bad is not None else reason


def _at_corner(
    question: Question, tolerance: Tolerance, signs: tuple[int, ...], width: Fraction, known: Fraction | None
) -> tuple[Fraction, Fraction | None, Asked | None, str]:
    good, bad, against, reason = Fraction(0), None, None, ""

    def proves(factor: Fraction) -> bool:
        nonlocal good, reason
        found = question.prove(tolerance.corner(factor, signs), tolerance.noise(factor))
        good, reason = (max(good, factor), reason) if found.verdict == "proved" else (good, found.reason)
        return found.verdict == "proved"

    def refutes(factor: Fraction) -> bool:
        nonlocal bad, against
        found = question.refute(tolerance.corner(factor, signs), tolerance.noise(factor))
        if found.verdict == "refuted":
            bad, against = factor, replace(found, within=tolerance.texts(factor))
        return found.verdict == "refuted"

    factor = known or Fraction(1, 16)
    while proves(factor):
        if known is not None or factor > 10**6:
            return good, None, None, ""
        factor *= 2
    top = factor
    while top - good > width * top and top > Fraction(1, 10**6):
        middle = _round((good + top) / 2)
        top = top if proves(middle) else middle
    for k in range(10):
        if refutes(_round(top * (1 + Fraction(2**k - 1, 400)))):
            break
    return good, bad, against, reason


def _round(value: Fraction) -> Fraction:
    """Five digits: a factor that people can read, and whose multiples are short decimals."""
    return Fraction(f"{float(value):.5g}")


def joint_margin(
    scene: Scene,
    goals: tuple[Goal, ...],
    tolerance: Mapping[str, str] | None = None,
    *,
    width: float = 0.01,
    seconds: float = SECONDS,
    tell: Tell = lambda _: None,
) -> Margin:
    """Bracket the factor on a tolerance up to which goals hold.

    Parameters
    ----------
    scene : Scene
        The scene.
    goals : tuple of Goal
        What has to hold, all of it.
    tolerance : mapping of str to str, optional
        Deviations by quantity, ``{"throw.speed": "1 %", "landing.x": "0.01 in"}``; default the scene's.  landing.x is
        noise at every throw, all else fixed but unknown.
    width : float
        How close the two ends have to be, as a share of the upper one.
    seconds : float
        Time for the proof of the box; what is proved by then counts.
    tell : callable
        Called with the share that is done.

    Returns
    -------
    Margin
        Its `quantity` is "joint", `proved` and `refuted` are factors.
    """
    begin = time.perf_counter()
    question = asked_of(scene, goals)
    texts = dict(scene.text.get("tolerance", {}) if tolerance is None else tolerance)
    vector = Tolerance.of(question.scene, texts)
    share = Fraction(repr(width))
    effects = (
        effects_of(question, vector.measures, _sizes(vector))
        if vector.measures
        else Effects(np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)))
    )
    good, bad, against, reason = _worst(question, vector, effects, share / 8)
    target = _round(min(good, bad * (1 - share * Fraction(9, 10))) if bad is not None else good)
    tell(0.05)
    proved, pieces, noise = Fraction(0), list[Asked](), dict[str, str]()
    end = time.perf_counter() + seconds
    for stage in STAGES if target > 0 else ():
        # the smaller box first: what is proved of it stands, whatever becomes of the larger one
        cutting = _Cutting(question, vector, _round(target * stage), effects)
        left = end - time.perf_counter()
        part, why = cutting.run(left if stage == STAGES[-1] else left / 2, tell)
        if part * cutting.factor <= proved:
            break
        proved, reason, noise = part * cutting.factor, why or reason, cutting.noise
        pieces = cutting.within(part)
        if part < 1:
            break
    closed = bad is not None and bad - proved <= share * bad
    return Margin(
        "joint",
        "tolerance",
        goals,
        float(proved),
        None if bad is None else float(bad),
        "",
        None,
        "" if closed else reason,
        closed,
        time.perf_counter() - begin,
        question.scene,
        dict(texts),
        vector.texts(proved) if proved else {},
        noise if proved else {},
        tuple(pieces),
        against,
    )


def _sizes(vector: Tolerance) -> dict[str, Fraction]:
    return {one.quantity: size for one, size in zip(vector.measures, vector.sizes, strict=True)}
