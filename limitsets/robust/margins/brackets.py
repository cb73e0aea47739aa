"""The search for a bracket: how far a goal is proved to hold, and from where on an orbit refutes it.

One quantity at a time.  Fixed but unknown: single scenes are asked first, which is quick and says where the goal
breaks; then all scenes up to there are proved at once, where two throws with the same parameters settle it, or the
proof grows outward from the scene as it is, in pieces that get narrower towards there, each proved as if the quantity
differed at every throw.  Another one at every throw: there is no cutting, sizes are tried.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction

from limitsets.proofs.query import Outcome, Query
from limitsets.robust.margins.deviations import Measure, short
from limitsets.robust.margins.halving import a_little_beyond, halved

__all__ = ["Bracket", "Tell", "bracket_fixed", "bracket_per_throw"]

Tell = Callable[[float], None]
"""Called with the share of the bracket that is closed."""

# Steps outward at most, each `FACTOR` times as far; trials of pieces in one direction.
STEPS, FACTOR, TRIALS = 24, 3, 200

# What to do about a bracket that does not close.
NARROWER = "; it would need finer cells than are tried here: ask for a wider bracket, or another x"

# From this share of the way to where the goal breaks, pieces are tried with the finest cells.
NEAR = Fraction(3, 4)

# What is smaller than this share of a small deviation counts as none.
NONE = Fraction(1, 1000)


@dataclass(eq=False)
class Bracket:
    """What the search found.

    Attributes
    ----------
    proved : Fraction
        Largest size proved, 0 if the scene as it is or nothing is.
    refuted : Fraction or None
        Smallest size refuted.
    pieces : list of Outcome
        What proves it.
    against : Outcome or None
        What refutes it.
    reason : str
        Why the bracket is not closed, or does not end.
    sign : int
        The direction in which it is refuted.
    """

    proved: Fraction = Fraction(0)
    refuted: Fraction | None = None
    pieces: list[Outcome] = field(default_factory=list)
    against: Outcome | None = None
    reason: str = ""
    sign: int = 1

    def closed(self, width: Fraction) -> bool:
        """Whether it is narrower than a share of its upper end."""
        return self.refuted is not None and self.refuted - self.proved <= width * self.refuted


@dataclass(eq=False)
class _Reach:
    """How far in one direction single scenes are good, bad, or cannot be."""

    query: Query
    measure: Measure
    sign: int
    good: Fraction = Fraction(0)
    bad: Fraction | None = None
    against: Outcome | None = None
    end: Fraction | None = None
    reason: str = ""

    def ask(self, size: Fraction) -> str:
        """Ask a single scene, and remember what it says; the verdict."""
        found = _point(self.query, self.measure, self.sign * size)
        if found.verdict == "proved":
            self.good = max(self.good, size)
        elif found.verdict == "refuted":
            self.bad, self.against = size, found
        else:
            self.end, self.reason = size, found.reason
        return found.verdict

    @property
    def gap(self) -> bool:
        """Whether nothing is known of some scene before those that are bad."""
        return self.bad is not None and self.end is not None and self.end < self.bad


def _point(query: Query, measure: Measure, size: Fraction) -> Outcome:
    """Ask a single scene."""
    piece = measure.piece(measure.at(size))
    found = query.prove(piece, finest=0)
    if found.verdict in ("proved", "impossible"):
        return found
    against = query.refute(piece)
    if against.verdict == "refuted":
        return replace(against, within={measure.quantity: measure.text(abs(size))})
    return query.prove(piece)


def _reach(query: Query, measure: Measure, sign: int, width: Fraction, known: Fraction | None) -> _Reach:
    """Go outward from the scene as it is until single scenes are refuted or cannot be, then halve."""
    reach, step = _Reach(query, measure, sign), measure.least
    for _ in range(STEPS):
        size = step if measure.most is None else min(step, (step / FACTOR + measure.most) / 2)
        if known is not None and reach.good >= known:
            return reach
        if reach.ask(size) != "proved":
            break
        step *= FACTOR
    else:
        return reach
    top = next(each for each in (reach.bad, reach.end) if each is not None)
    # beyond a gap what is refuted is nearly as near as can be
    least, near = NONE * measure.least, reach.good
    halved(near, top, lambda size: reach.ask(size) == "proved", width, least, stop=lambda: reach.gap)
    if reach.bad is not None and reach.end is not None:
        # lower what is refuted towards what is undecided, and raise what is proved
        halved(reach.end, reach.bad, lambda size: reach.ask(size) != "refuted", width)
        reach.end = None
    return reach


def _grow(
    query: Query, measure: Measure, sign: int, target: Fraction, wall: Fraction, tell: Tell
) -> tuple[Fraction, list[Outcome], str]:
    """Prove from the scene as it is outward, in pieces; how far, the pieces, and what stops it."""
    low, pieces, reason = Fraction(0), list[Outcome](), ""
    share = Fraction(2, 5)
    step = share * wall
    for _ in range(TRIALS):
        if low >= target:
            return low, pieces, ""
        step = step if measure.widest is None else min(step, measure.widest)
        high = min(target, short(low + step, up=True))
        # far from the wall narrower pieces do as well as finer cells, and to fail with these is what takes time
        finest = 3 if low > NEAR * wall else 1
        found = query.prove(measure.piece(measure.between(sign * low, sign * high)), finest=finest)
        if found.verdict == "proved":
            pieces.append(found)
            low, share = high, min(share * Fraction(9, 8), Fraction(3))
            step = share * (wall - high)
            tell(float(low / target))
        else:
            reason, share = found.reason, share * Fraction(2, 3)
            step = share * (wall - low)
            if step < min((wall - target) / 8, target / 1000):
                break
    return low, pieces, reason


def bracket_fixed(query: Query, measure: Measure, width: Fraction, tell: Tell) -> Bracket:
    """Bracket the margin of a quantity that is fixed but unknown."""
    ways: dict[int, _Reach] = {}
    for sign in (-1, 1):
        known = min((way.bad for way in ways.values() if way.bad is not None), default=None)
        ways[sign] = _reach(query, measure, sign, width / 4, known)
    found = Bracket()
    bad = [way for way in ways.values() if way.bad is not None]
    if bad:
        nearest = min(bad, key=lambda way: way.bad or 0)
        found.refuted, found.against = nearest.bad, nearest.against
        found.sign = next(sign for sign, way in ways.items() if way is nearest)
    ends = [way for way in ways.values() if way.end is not None]
    limits = [way.good for way in ends] if found.refuted is None else []
    goal = min(limits, default=min(way.good for way in ways.values()))
    if found.refuted is not None:
        goal = found.refuted * (1 - width * Fraction(6, 10))
        goal = min([goal, *(way.good for way in ends)])
    first = next((way for way in ends if way.good == goal and way.end is not None), None)
    if first is not None and first.end is not None:
        found.reason = f"from {measure.text(first.end)} on: {first.reason}"
    found = _fixed_proof(query, measure, found, short(goal), tell)
    found.reason = "" if found.closed(width) else found.reason
    return found


def _fixed_proof(query: Query, measure: Measure, found: Bracket, goal: Fraction, tell: Tell) -> Bracket:
    """Prove it all at once, or grow the proof in both directions."""
    if goal <= NONE * measure.least:
        return found
    # all at once first: two throws with the same parameters may settle it
    whole = query.prove(measure.piece(measure.between(-goal, goal)), finest=1)
    if whole.verdict == "proved":
        found.pieces, found.proved = [whole], goal
        return found
    wall = found.refuted or goal * Fraction(101, 100)
    for sign in (-1, 1):
        near = found.against is not None and sign == found.sign
        far, pieces, reason = _grow(query, measure, sign, goal, wall if near else 3 * wall, tell)
        found.pieces += pieces
        if far < goal:
            goal, found.reason = far, reason + NARROWER
            _fails_beyond(query, measure, sign, far, found)
            if not far:
                break
    found.proved = goal
    return found


def _fails_beyond(query: Query, measure: Measure, sign: int, far: Fraction, found: Bracket) -> None:
    """Where a proof stops growing, look for a scene that fails: a goal may fail at a size and hold at larger ones."""
    for beyond in a_little_beyond(far, Fraction(1, 400), 10):
        size = short(beyond, up=True)
        if found.refuted is not None and size >= found.refuted:
            return
        against = query.refute(measure.piece(measure.at(sign * size)))
        if against.verdict == "refuted":
            found.refuted, found.sign = size, sign
            found.against = replace(against, within={measure.quantity: measure.text(size)})
            return


class _Sizes:
    """Sizes of a quantity that is another one at every throw, proved and refuted."""

    def __init__(self, query: Query, measure: Measure) -> None:
        self.query, self.measure, self.found = query, measure, Bracket()

    def proves(self, size: Fraction, finest: int) -> bool:
        one = self.query.prove(None, {self.measure.quantity: self.measure.text(size)}, finest)
        if one.verdict == "proved":
            if size > self.found.proved:
                self.found.proved, self.found.pieces = size, [one]
        else:
            self.found.reason = one.reason
        return one.verdict == "proved"

    def refutes(self, size: Fraction) -> bool:
        one = self.query.refute(None, {self.measure.quantity: self.measure.text(size)})
        if one.verdict == "refuted":
            self.found.refuted, self.found.against = size, one
        return one.verdict == "refuted"

    def first(self) -> Fraction:
        """Go outward until it is not proved with few cells, then halve to some percent; that size."""
        size, most = self.measure.least, self.measure.most
        for _ in range(STEPS):
            if not self.proves(size, 1):
                break
            nearer = FACTOR * size
            size = nearer if most is None or nearer < most else (size + most) / 2
        least = NONE * self.measure.least
        _, size = halved(
            self.found.proved, size, lambda middle: self.proves(middle, 1), Fraction(1, 40), least
        )
        return size

    def against(self, size: Fraction) -> None:
        """Find a size that is refuted, from one on that is not proved."""
        most = self.measure.most
        for beyond in a_little_beyond(size, Fraction(1, 100), 8):
            if (most is None or short(beyond) < most) and self.refutes(short(beyond)):
                return


def bracket_per_throw(query: Query, measure: Measure, width: Fraction, tell: Tell) -> Bracket:
    """Bracket the margin of a quantity that is another one at every throw."""
    sizes = _Sizes(query, measure)
    found = sizes.found
    top = sizes.first()
    tell(0.3)
    sizes.against(top)
    tell(0.5)
    if found.refuted is not None and not found.closed(width):
        sizes.proves(short(found.refuted * (1 - width * Fraction(9, 10))), 3)
    low = high = None  # nothing is known between them
    while found.refuted is not None and not found.closed(width) and found.refuted > NONE * measure.least:
        middle = short(((high or found.proved) + found.refuted) / 2)
        if found.refuted - (high or found.proved) > width / 4 * found.refuted:
            if sizes.refutes(middle) or sizes.proves(middle, 3):
                continue
            low, high = low or middle, middle
        elif low is not None and low - found.proved > width / 4 * low:
            middle = short((found.proved + low) / 2)
            low = low if sizes.proves(middle, 3) else middle
        else:
            break
    found.reason = "" if found.closed(width) else found.reason
    return found
