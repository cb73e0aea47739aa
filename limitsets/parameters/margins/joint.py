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

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Array
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
from limitsets.proofs.prover.query import Outcome, Query
from limitsets.proofs.prover.tolerances import SceneBox
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
    """

    slack: Array
    fall: Array

    @classmethod
    def none(cls, quantities: int) -> Sensitivity:
        """Return what is known where nothing attracts."""
        return cls(np.zeros(0), np.zeros((0, quantities)))

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
    slack = _slack(query, tolerance.corner(Fraction(0), [0] * count), start)
    falls = []
    for k in range(count):
        ends = []
        for sign in (-1, 1):
            try:
                corner = tolerance.corner(CHANGE, [sign * (j == k) for j in range(count)])
                ends.append(_slack(query, corner, start))
            except AnswerError:
                ends.append(slack)
        falls.append((ends[0] - ends[1]) / (2 * step))
    fall = np.array(falls)
    usable = np.isfinite(slack) & np.isfinite(fall).all(axis=0)
    return Sensitivity(slack[usable], fall.T[usable])


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


# ----------------------------------------------------------------
# Proof of goals over a box of scenes by adaptive subdivision.
#
# Throws with the same parameters may settle the box as a whole (`proofs/prover/bands.py`).  Otherwise the cells of a
# piece let its quantities differ at every throw, as noise does.  Pieces therefore have to be narrow in the quantities
# of large sensitivity, and most of all near the worst corner, where nothing but a piece that fails is cut.


# Pieces after which the proof of the box ends with what it has.
MOST_PIECES = 4000

# Finer cells are tried of parts whose costliest quantity is narrower than this share of the box.
NARROW = Fraction(1, 8)

# Share of the largest cost that a quantity counts for at least.
LEAST_SHARE = 0.1

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


class Subdivision:
    """Proof of a box, piece by piece."""

    def __init__(
        self, query: Query, tolerance: Tolerance, factor: Fraction, sensitivity: Sensitivity
    ) -> None:
        self.query, self.tolerance, self.factor, self.sensitivity = query, tolerance, factor, sensitivity
        self.noise = tolerance.noise(factor)
        self.proved: list[tuple[_SubBox, Outcome]] = []

    def _costliest(self, part: _SubBox) -> int:
        """Say along which quantity to cut a part: that which matters most over its width."""
        costs = np.abs(self.sensitivity.fall).max(axis=0, initial=0.0)
        shares = np.maximum(costs / max(costs.max(initial=0.0), 1e-300), LEAST_SHARE)
        widths = np.array([float(hi - lo) for lo, hi in zip(part.low, part.high, strict=True)])
        return int(np.argmax(widths * shares)) if widths.size else 0

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
            k = self._costliest(part)
            narrow = not part.low or part.high[k] - part.low[k] <= 2 * NARROW
            piece = self.tolerance.piece(part.low, part.high, self.factor)
            outcome = self.query.prove(piece, self.noise, finest=3 if narrow else 1, bases=1)
            if outcome.verdict == "proved":
                self.proved.append((part, outcome))
                tell(len(self.proved) / (len(self.proved) + len(waiting)))
                continue
            why = self._stop(part, k, outcome, waiting, time.perf_counter() > end)
            if why:
                failed.append((part.near, why))
                continue
            for half in part.cut(k, (part.low[k] + part.high[k]) / 2, number):
                heapq.heappush(waiting, half)
            number += 2
        return min(failed, default=(Fraction(1), ""))

    def _stop(self, part: _SubBox, k: int, outcome: Outcome, waiting: list[_SubBox], late: bool) -> str:
        """Say why a part is given up; empty if it is to be cut."""
        if late:
            return (
                "the box of all quantities ran out of time: give it more seconds, or ask for a wider bracket"
            )
        if len(self.proved) + len(waiting) >= MOST_PIECES:
            return f"the box of all quantities is in {MOST_PIECES} pieces: ask for a wider bracket"
        if part.low and part.high[k] - part.low[k] > NARROWEST:
            return ""
        return outcome.reason or "a piece of the box of all quantities is too narrow to be cut"

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
    noise: Mapping[str, str] | None = None,
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
    noise : mapping of str to str, optional
        Deviations at every throw beside it, of throw.speed, gravity.tilt or landing.x; the same factor is on them.
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
    vector, share = Tolerance.of(query.scene, texts, noise), Fraction(repr(width))
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
        own = slack(turned)
        if own < least:
            least, best = own, turned
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
