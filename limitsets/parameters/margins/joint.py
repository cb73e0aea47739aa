"""The joint margin: the factor on a whole vector of tolerances up to which goals are proved, by subdivision.

Every quantity is fixed but unknown, except the landing place, which differs at every throw.  The worst corners, each
a single scene, bracket the factor from above, the proof of the whole box from below.
"""

from __future__ import annotations

import heapq
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Array, Mask
from limitsets.feeder.goals import Goal, OrientedBeyond, Reaches
from limitsets.feeder.scene import Scene
from limitsets.parameters.margins.brackets import Bracket, Ray, Tell
from limitsets.parameters.margins.deviations import (
    Parts,
    Signs,
    Tolerance,
    a_little_beyond,
    halved,
    worst_corner,
)
from limitsets.parameters.margins.margin_result import Margin
from limitsets.proofs.prover.goals.violating_orbits import on_limit_set
from limitsets.proofs.prover.parameters import SceneBox
from limitsets.proofs.prover.query import Outcome, Query
from limitsets.systems.maps import orbit

# ----------------------------------------------------------------
# Sensitivities of a goal to each quantity, by floats: the worst corner of a box, and the quantity to cut.
#
# The slack before a goal fails (from the highest place on another side to X, from X to the highest place on the wanted
# one) is nearly linear in the quantities.  It is read off one long orbit for each change of one quantity.  Nothing is
# proved here; it only says in which order to try.


# Throws of an orbit that is read, after so many that are not.
LENGTH, BEFORE = 60_000, 2000

# Refinement of the cells with which the cost of a piece is measured.
STEP = 2

# Part of the tolerance by which a quantity is changed to either side.
CHANGE = Fraction(1, 4)


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """The slack before a goal fails, and how it falls with each quantity.

    Attributes
    ----------
    slack : ndarray, shape (n,)
        In the scene as it is, one number for each way in which a goal can fail; negative where one does.
    fall : ndarray, shape (n, quantities)
        By how much each falls when a quantity rises by its tolerance.
    cost : ndarray, shape (n, quantities)
        By how much less is proved of each when a quantity may be anywhere in its tolerance, proved as noise.
    same_throws : ndarray of bool, shape (n,)
        Whether throws with the same parameters are followed: then what is proved falls as the corners do.
    """

    slack: Array
    fall: Array
    cost: Array
    same_throws: Mask

    @classmethod
    def none(cls, quantities: int) -> Sensitivity:
        """Return what is known where nothing attracts."""
        nothing = np.zeros((0, quantities))
        return cls(np.zeros(0), nothing, nothing, np.zeros(0, dtype=np.bool_))

    def corners(self) -> list[Signs]:
        """Signs of the worst corner for each way to fail, the worst of all first."""
        cost = np.abs(self.fall).sum(axis=1)
        order = np.argsort(np.where(cost > 0.0, self.slack / np.maximum(cost, 1e-300), math.inf))
        return list(dict.fromkeys(worst_corner(self.fall[k]) for k in order))


@np.errstate(invalid="ignore")  # a side that no part comes to has room without end: inf - inf
def sensitivity_of(query: Query, tolerance: Tolerance) -> Sensitivity:
    """Measure the sensitivity by differences.

    Parameters
    ----------
    query : Query
        The goals.
    tolerance : Tolerance
        Quantities that are fixed but unknown, with sizes.
    """
    count = len(tolerance.scales)
    nominal = query.prove(finest=1) if count else None
    if nominal is None or nominal.found is None or not (nominal.found.component >= 0).any():
        return Sensitivity.none(count)
    start, step = on_limit_set(nominal.found), float(CHANGE)
    slack, level = (
        _slack(query, tolerance.corner(Fraction(0), [0] * count), start),
        _proved_slack(query, None),
    )
    falls, costs = [], []
    for k, one in enumerate(tolerance.scales):
        size = CHANGE * tolerance.sizes[k]
        ends = []
        for sign in (-1, 1):
            try:
                corner = tolerance.corner(CHANGE, [sign * (j == k) for j in range(count)])
                ends.append(_slack(query, corner, start))
            except AnswerError:
                ends.append(slack)
        falls.append((ends[0] - ends[1]) / (2 * step))
        try:
            low = _proved_slack(query, one.piece(one.between(-size, size)))
        except AnswerError:
            low = level
        costs.append((level - low) / step)
    fall = np.array(falls)
    cost = np.maximum(np.array(costs), 1.2 * np.abs(fall))
    usable = np.isfinite(slack) & np.isfinite(fall).all(axis=0) & np.isfinite(cost).all(axis=0)
    sides = query.scene.sides.a
    same_throws = [
        isinstance(goal, OrientedBeyond) and not goal.from_anywhere
        for goal in query.goals
        for _ in _slack_of(goal, sides.tolist())
    ]
    return Sensitivity(
        slack[usable], fall.T[usable], cost.T[usable], np.array(same_throws, dtype=bool)[usable]
    )


def _slack(query: Query, piece: SceneBox | None, start: tuple[float, int]) -> Array:
    """Read the slack of one scene off a long orbit."""
    box = query.box(piece, {})
    path = orbit(box.at_kappa(box.middle_kappa), *start, BEFORE + LENGTH)
    x, side = np.asarray(path.x)[BEFORE:], np.asarray(path.side)[BEFORE:]
    highest = [float(x[side == s].max(initial=-math.inf)) for s in range(box.lo.a.size)]
    return np.array([each for goal in query.goals for each in _slack_of(goal, highest)])


def _slack_of(goal: Goal, highest: Sequence[float]) -> list[float]:
    """Give the slack for each way in which a goal can fail, from the highest place on each side."""
    if isinstance(goal, OrientedBeyond):
        return [goal.x - top for side, top in enumerate(highest) if side != goal.side]
    if isinstance(goal, Reaches):
        return [highest[goal.side] - goal.x]
    return []


def _proved_slack(query: Query, piece: SceneBox | None) -> Array:
    """Give the proved slack of each goal; 0 for a place to be reached, whose slack these cells do not prove."""
    extents = query.cells(piece, STEP).cells.extents()
    sides = range(query.scene.sides.a.size)
    highest = [max((hi for _, hi in extents.get(side, ())), default=-math.inf) for side in sides]
    slacks: list[float] = []
    for goal in query.goals:
        slacks += [0.0] if isinstance(goal, Reaches) else _slack_of(goal, highest)
    return np.array(slacks)


# ----------------------------------------------------------------
# Proof of goals over a box of scenes by adaptive subdivision.
#
# Throws with the same parameters may settle the box as a whole (`proofs/prover/bands.py`).  Otherwise a piece
# counts as noise, which costs about as much slack again as its deviation.  Pieces therefore have to be narrow near the
# worst corner, in the quantities of large sensitivity, and nowhere else.


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
        upper_end = (*self.high[:k], at, *self.high[k + 1 :])
        lower_end = (*self.low[:k], at, *self.low[k + 1 :])
        return [
            _SubBox(_nearness(self.low, upper_end), number + 1, self.low, upper_end),
            _SubBox(_nearness(lower_end, self.high), number + 2, lower_end, self.high),
        ]


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
        left = at_corner - np.where(known.same_throws[:, None], 0.0, np.maximum(costs - fall, 0.0)) @ half
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

    def whole(self) -> bool:
        """Prove the box in one piece, as throws with the same parameters may settle it; whether that succeeds."""
        count = len(self.tolerance.scales)
        whole = _SubBox(Fraction(0), 0, (Fraction(-1),) * count, (Fraction(1),) * count)
        piece = self.tolerance.piece(whole.low, whole.high, self.factor)
        outcome = self.query.prove(piece, self.noise, finest=1, bases=1)
        self.proved = [(whole, outcome)] if outcome.verdict == "proved" else []
        return bool(self.proved)

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
            worth = guess.left > WORTH * guess.at_corner
            outcome = self._try(part, guess.left) if worth else None
            if outcome is not None and outcome.verdict == "proved":
                self.proved.append((part, outcome))
                self.cost = max(LEAST_COST, self.cost * 0.99)
                tell(len(self.proved) / (len(self.proved) + len(waiting)))
                continue
            if outcome is not None and self.sensitivity.slack.size:
                self.cost = min(MOST_COST, self.cost * 1.03)
            k, at = self._where(part, guess, outcome)
            why = self._stop(part, k, outcome, waiting, time.perf_counter() > end)
            if why:
                failed.append((part.near, why))
                continue
            for piece in part.cut(k, at, number):
                heapq.heappush(waiting, piece)
            number += 2
        return min(failed, default=(Fraction(1), ""))

    def _where(self, part: _SubBox, guess: _Guess, outcome: Outcome | None) -> tuple[int, Fraction]:
        """Say along which quantity to cut a part, and where.

        Where nothing attracts, or no part is proved to rest, what a quantity costs elsewhere says little: the widest.
        """
        cells = None if outcome is None else outcome.found
        if not part.low or outcome is None or (cells is not None and (cells.component >= 0).any()):
            return guess.k, guess.at
        widths = np.array([float(hi - lo) for lo, hi in zip(part.low, part.high, strict=True)])
        cost = self.sensitivity.cost.max(axis=0, initial=0.0)
        k = int(np.argmax(widths * np.maximum(cost / max(cost.max(initial=0.0), 1e-300), LEAST_SHARE)))
        return k, (part.low[k] + part.high[k]) / 2

    def _stop(
        self, part: _SubBox, k: int, outcome: Outcome | None, waiting: list[_SubBox], late: bool
    ) -> str:
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
            outcome.reason if outcome else ""
        ) or "a piece of the box of all quantities is too narrow to be cut"

    def within(self, share: Fraction) -> list[Outcome]:
        """Return what proves a share of the box: parts that reach beyond are cut back, their cells serve for less."""
        kept = []
        for part, outcome in self.proved:
            low = tuple(max(x, -share) for x in part.low)
            high = tuple(min(x, share) for x in part.high)
            if any(a >= b for a, b in zip(low, high, strict=True)) or outcome.found is None:
                continue
            piece = self.tolerance.piece(low, high, self.factor)
            if piece is not None:
                cover = outcome.found.cover
                box = replace(cover.box, scene=piece.tree())
                outcome = replace(
                    outcome, found=replace(outcome.found, cover=replace(cover, box=box)), piece=piece
                )
            kept.append(outcome)
        return kept

    def joined(self, share: Fraction) -> tuple[Fraction, str]:
        """Return up to which share of the box all is one claim, as a certificate has to make it, and what stops it."""
        missing = self.query.unjoined(self.within(share)) if share else ""
        if missing:
            share, _ = halved(
                Fraction(0),
                share,
                lambda part: not self.query.unjoined(self.within(part)),
                Fraction(1, 8),
                Fraction(1, 64),
            )
        return share, missing

    def _try(self, part: _SubBox, left: float) -> Outcome:
        self.tried += 1
        finest = 3
        if self.sensitivity.slack.size:
            finest = 1 + sum(left < share * float(self.sensitivity.slack.min()) for share in FINER)
        # where nothing attracts the piece is cut: that helps more than finer cells
        piece = self.tolerance.piece(part.low, part.high, self.factor)
        return self.query.prove(piece, self.noise, finest, bases=1)


# ----------------------------------------------------------------
# The joint margin: the factor on a whole vector of tolerances, up to which goals are proved.


# Seconds after which the proof of the box ends with what it has.
SECONDS = 150.0

# Parts of the bracket's lower end that are proved in turn.
STAGES = tuple(Fraction(n, 32) for n in (1, 2, 4, 8, 16, 24, 32))

# A box that is proved in one piece is this near to the largest such box, as a share.
ONE_PIECE = Fraction(1, 32)

# Corners whose factor is bracketed, the worst first; factors between which it is sought.
CORNERS, SMALL, LEAST, MOST = 4, Fraction(1, 16), Fraction(1, 10**6), Fraction(10**6)


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
    query = Query.of(scene, goals)
    texts = dict(scene.text.get("tolerance", {}) if tolerance is None else tolerance)
    vector, share = Tolerance.of(query.scene, texts), Fraction(repr(width))
    sensitivity = sensitivity_of(query, vector)
    at_corners = _at_corners(query, vector, sensitivity, share / 8)
    bad, reason, target = at_corners.refuted, at_corners.reason, at_corners.proved
    target = rounded(target if bad is None else min(target, bad * (1 - share * Fraction(9, 10))))
    tell(0.05)
    kept = _Proved(query, vector, sensitivity)
    if target > 0 and not kept.in_one_piece(target):
        halved(Fraction(0), target, kept.in_one_piece, ONE_PIECE, LEAST, rounded)
    end = time.perf_counter() + seconds
    for stage in (each for each in STAGES if target * each > kept.factor):
        # the smaller box first: what is proved of it stands, whatever becomes of the larger one
        left = end - time.perf_counter()
        whole, why = kept.in_pieces(rounded(target * stage), left if stage == STAGES[-1] else left / 2, tell)
        reason = why or reason
        if not whole:
            break
    proved, noise, pieces = kept.factor, kept.noise, kept.pieces
    closed = bad is not None and bad - proved <= share * bad
    reason = reason or "no orbit is found that violates it nearer to what is proved"
    return Margin(
        quantity="joint",
        reading="tolerance",
        goals=goals,
        proved=float(proved),
        refuted=None if bad is None else float(bad),
        unit="",
        nominal=None,
        reason="" if closed else reason,
        closed=closed,
        seconds=time.perf_counter() - begin,
        scene=query.scene,
        tolerance=dict(texts),
        deviations=vector.texts(proved) if proved else {},
        noise=noise if proved else {},
        pieces=tuple(pieces),
        against=at_corners.against,
    )


@dataclass
class _Proved:
    """The largest box that is proved: its factor, and the pieces that prove it."""

    query: Query
    tolerance: Tolerance
    sensitivity: Sensitivity
    factor: Fraction = Fraction(0)
    noise: dict[str, str] = field(default_factory=dict)
    pieces: list[Outcome] = field(default_factory=list)

    def in_one_piece(self, factor: Fraction) -> bool:
        """Prove the box of a factor as a whole, if that can be done."""
        cutting = Subdivision(self.query, self.tolerance, factor, self.sensitivity)
        return cutting.whole() and self._keep(cutting, Fraction(1))[0]

    def in_pieces(self, factor: Fraction, seconds: float, tell: Tell) -> tuple[bool, str]:
        """Prove the box of a factor piece by piece: whether all of it is, and what stops it."""
        cutting = Subdivision(self.query, self.tolerance, factor, self.sensitivity)
        part, why = cutting.run(seconds, tell)
        whole, missing = self._keep(cutting, part)
        return whole, missing or why

    def _keep(self, cutting: Subdivision, part: Fraction) -> tuple[bool, str]:
        """Keep what proves a part of a box, as far as it is one claim, where that is more than before."""
        part, missing = cutting.joined(part)
        if part * cutting.factor > self.factor:
            self.factor, self.noise = part * cutting.factor, cutting.noise
            self.pieces = cutting.within(part)
        return part == 1, missing


def _at_corners(query: Query, tolerance: Tolerance, sensitivity: Sensitivity, width: Fraction) -> Bracket:
    """Bracket the factor at the worst corners, as single scenes."""
    count, bracket, proved = len(tolerance.scales), Bracket(), list[Fraction]()
    waiting, tried = (sensitivity.corners() or [(1,) * count, (-1,) * count])[:CORNERS], set[Signs]()
    while waiting:
        signs = waiting.pop(0)
        tried.add(signs)
        own = _at_one(Ray(query, tolerance, signs), width, bracket.refuted)
        proved.append(own.proved)
        if own.refuted is not None and (bracket.refuted is None or own.refuted < bracket.refuted):
            bracket.refuted, bracket.against = own.refuted, own.against
            worse = _worse_corner(query, tolerance, own.refuted, signs)
            waiting += [worse] if worse not in tried else []
        bracket.reason = bracket.reason or own.reason
    bracket.proved = min(proved)
    return bracket


def _worse_corner(query: Query, tolerance: Tolerance, factor: Fraction, signs: Signs) -> Signs:
    """Turn signs of a corner as long as its slack falls: that far out it need not be linear, nor of the same orbit."""

    def slack(some: Signs) -> float:
        try:
            return float(_slack(query, tolerance.corner(factor, some), start).min(initial=math.inf))
        except AnswerError:  # no such part
            return math.inf

    nominal = query.prove(finest=0).found
    assert nominal is not None
    start = on_limit_set(nominal)
    least, best = slack(signs), signs
    for k in [*range(len(signs))] * 2:
        turned = (*best[:k], -best[k], *best[k + 1 :])
        found = slack(turned)
        if found < least:
            least, best = found, turned
    return best


def _at_one(ray: Ray, width: Fraction, known: Fraction | None) -> Bracket:
    """Bracket the factor at one corner, where it is below one that is known."""
    factor, bracket = known or SMALL, ray.bracket
    while ray.proves(factor):
        if known is not None or factor > MOST:
            return bracket
        factor *= 2
    _, top = halved(bracket.proved, factor, ray.proves, width, LEAST, rounded)
    beyond = (rounded(each) for each in a_little_beyond(top, Fraction(1, 400), 10))
    bad = next((each for each in beyond if ray.refutes(each)), None)
    if bad is not None:
        # what is not proved need not fail: it may hold for fewer starts than all
        halved(top, bad, lambda middle: not ray.refutes(middle), width, rounded=rounded)
    return bracket


def rounded(value: Fraction) -> Fraction:
    """Five digits: a factor that people can read, and whose multiples are short decimals."""
    return Fraction(f"{float(value):.5g}")
