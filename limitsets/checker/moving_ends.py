"""Ends that move with the parameters: chains of throws, all with the same parameters, from a place.

docs/certificates.md, "Goals, end points, orbits", number 9.  A chain begins at a number, or where the branch changes,
which is a place that moves with the parameters; its end is a smooth function of them.  The function is enclosed with
its slopes, throw by throw; a slope with a sign says at which end of the parameter's range the chain ends farthest.
"""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

from flint import arb

from .balls import HALF, ONE, ZERO, Arb, Centred, Pair, centred
from .file import LENGTHS
from .model import FULL_TURN, deciding, guess_root
from .part import part_with, read_wide
from .scene import Scene, Side

KAPPA, HEIGHT, PART = range(3)  # the parameters of a box: kappa, h, and from there the numbers of the part
# Balls of angles tried for a root: how many, how wide the first is, how much wider the next than the enclosure.
TRIED, LEAST_BALL, INFLATED = 12, arb(2) ** -60, arb(1.05)
# Steps of Newton's method to the middle of such a ball, with slopes over the box: each gains some digits.
GUESSES = 8


class ByAngle(NamedTuple):
    """A throw by its impact angle: where it begins and jogs to, what decides (above 0: a flip), a flip's shift."""

    begins: Any
    jogs_to: Any
    decides: Any
    shift: Any


def by_angle(s: Side, kappa: Any, p: Any) -> ByAngle:
    """Throw with the angle p, in any arithmetic: no equation has to be solved.

    In the exact model sgn(om) K and sgn(X) V are compared by their roots, with their signs, which are smooth at 0.
    """
    if not s.exact:
        x = s.a + HALF * (kappa - s.small_d) * p
        return ByAngle(x, x - s.h * p, deciding(s, p, x, kappa), s.shift)
    sin, cos = p.sin_cos()
    x = HALF * kappa * p + (s.a * sin - s.d * (ONE - cos)) / p
    jog = x - s.h * p + s.a * (ONE - cos) - s.d * (p - sin)
    X, H = s.a * cos - s.d * sin, s.a * sin + s.d * cos
    spin = s.rho2 + X * (x - kappa * p) + H * s.hd
    if not (s.signed or spin > 0):
        spin = -spin if -spin > 0 else arb("nan")
    return ByAngle(x, jog, spin * s.over_2m.sqrt() - X * (kappa / (s.ell + H)).sqrt(), s.shift)


class Moving(NamedTuple):
    """A number that moves with the parameters: at the middle of their box, over the box, and its slopes by each."""

    middle: Arb
    over: Arb
    slopes: list[Arb]


class Change(NamedTuple):
    """The place on a side where the branch changes: within these angles, to flips where `rises`, else to jogs."""

    side: int
    first: float
    last: float
    rises: bool


def overlaps_range(ball: Arb, ends: Pair) -> bool:
    """Whether a ball and an interval have a number in common."""
    lo, hi = map(arb, ends)
    return bool(lo in ball or hi in ball or (ball >= lo and ball <= hi))


# A place, and then throws: each a side, a branch (0 jog, 1 flip), and to which end the landing is off (-1, 1).
MovingEnd = tuple[Any, ...]


@dataclass(frozen=True)
class ParameterBox:
    """A box of the parameters (kappa, h, and the lengths of the part that are intervals), and the chains in it."""

    scene: Scene
    ends: list[Pair]
    places: dict[MovingEnd, Moving | None] = field(default_factory=dict)
    angles: dict[tuple[MovingEnd, int], Moving | None] = field(default_factory=dict)
    corners: "dict[tuple[Pair, ...], ParameterBox]" = field(default_factory=dict)

    @cached_property
    def free(self) -> list[int]:
        """The parameters that are intervals: slopes are by these."""
        return [k for k, (lo, hi) in enumerate(self.ends) if lo < hi]

    @cached_property
    def middle(self) -> list[Arb]:
        """The middle of each of these."""
        return [arb(lo + (hi - lo) / 2) for lo, hi in map(self.ends.__getitem__, self.free)]

    @cached_property
    def balls(self) -> list[Arb]:
        """The range of each."""
        return [arb(lo).union(arb(hi)) for lo, hi in map(self.ends.__getitem__, self.free)]

    @cached_property
    def off(self) -> list[Arb]:
        """The ranges less the middles."""
        return [ball - mid for ball, mid in zip(self.balls, self.middle, strict=True)]

    @cached_property
    def sides(self) -> list[tuple[Any, ...]]:
        """What throws from each side depend on: a, d, shift, rho^2, kappa and h."""
        values: list[Any] = [arb(lo) for lo, _ in self.ends]
        free = centred([ZERO, *self.middle], [ZERO, *self.balls], [ZERO, *self.off])[1:]
        for k, number in zip(self.free, free, strict=True):
            values[k] = number
        part, unit = self.scene.raw["part"], LENGTHS[self.scene.unit]
        numbers = dict(zip(read_wide(part, unit)[0], values[PART:], strict=True))
        rests, rho = part_with(part, unit, numbers)
        return [(a, d, shift, rho * rho, *values[:PART]) for a, d, _, shift in rests]

    def throw(self, side: int, middle: Arb, angle: Arb) -> ByAngle:
        """Throw from a side with the angles of a ball and all parameters, each number about that at the middles."""
        off = [angle - middle, *self.off]
        a, d, shift, rho2, kappa, h = (
            Centred(z.at, z.x, z.by, off) if isinstance(z, Centred) else z for z in self.sides[side]
        )
        ell2 = a * a + d * d
        known = self.scene.sides[side]
        s = Side(a, d, known.length, h=h, rho2=rho2, arm=known.arm, exact=known.exact, signed=known.signed)
        s.shift, s.small_d, s.ell = shift, d if known.small_d > 0 else ZERO, ell2.sqrt()
        s.hd, s.over_2m = h + d, HALF / (rho2 + ell2)
        return by_angle(s, kappa, Centred(middle, angle, [ONE, *(ZERO for _ in self.free)], off))

    def moving(self, middle: Arb, slopes: list[Arb]) -> Moving:
        """Enclose a number over the box by the mean value theorem."""
        return Moving(middle, sum((d * o for d, o in zip(slopes, self.off, strict=True)), middle), slopes)

    def root(self, side: int, what: str, target: Moving, guess: Arb) -> Moving | None:
        """Enclose the angle at which a number of the throw is the target; None if that fails.

        Newton's method: where the slope by the angle has a sign over a ball of angles, and the enclosure computed from
        it lies inside the ball, each parameter has one root in the ball.
        """
        least = abs(guess) * LEAST_BALL
        ball = arb(guess, least)
        for _ in range(TRIED):
            number = getattr(self.throw(side, guess, ball), what)
            steep, *others = number.by
            if not (steep > 0 or steep < 0):
                return None
            slopes = [(t - d) / steep for t, d in zip(target.slopes, others, strict=True)]
            angle = self.moving(guess - (number.at - target.middle) / steep, slopes)
            if not angle.over.is_finite():
                return None
            if ball.contains_interior(angle.over):
                return angle
            ball = arb(guess, (abs(angle.over - guess) * INFLATED + least).upper())
        return None

    def angle(self, chain: MovingEnd, side: int) -> Moving | None:
        """Enclose the angle of the throw from the end of a chain."""
        if (chain, side) not in self.angles:
            self.angles[chain, side] = self.angle_of(chain, side)
        return self.angles[chain, side]

    def lies_in(self, chain: MovingEnd, side: int, angles: Pair) -> bool:
        """Whether throws from the end of a chain are enclosed, by angles that meet a range."""
        angle = self.angle(chain, side)
        return angle is not None and overlaps_range(angle.over, angles)

    def angle_of(self, chain: MovingEnd, side: int) -> Moving | None:
        """Compute what `angle` keeps."""
        if isinstance(chain[-1], Change):
            return self.changes(chain[-1])
        place, s = self.place(chain), self.scene.sides[side]
        if place is None:
            return None
        known = (z.at if isinstance(z, Centred) else z for z in self.sides[side])
        a, d, _, _, kappa, _, x = (float(z.mid()) for z in (*known, place.middle))
        late = (x + math.sqrt(max(x * x + 2 * kappa * (d + math.hypot(a, d)), 0.0))) / kappa
        guess = guess_root((a, d, d if s.small_d > 0 else 0.0, a), s.exact, x, kappa, late)
        return self.root(side, "begins", place, arb(guess)) if 0 < guess < FULL_TURN else None

    def changes(self, change: Change) -> Moving | None:
        """Enclose the angle at which the branch changes.

        The number that decides is monotone on the angles of the cells that are not decided, which hold the change, and
        on a ball that has a root for each parameter; they overlap, so that the two are one.
        """
        undecided, none = arb(change.first).union(arb(change.last)), [ZERO] * len(self.free)
        guess = undecided.mid()
        for _ in range(GUESSES):
            number = self.throw(change.side, guess, guess).decides
            step = (number.at / number.by[0].mid()).mid()
            guess = (guess - step).mid()
            if abs(step) < LEAST_BALL * guess:
                break
        angle = self.root(change.side, "decides", Moving(ZERO, ZERO, none), guess) if guess > 0 else None
        if angle is None or not overlaps_range(angle.over, (change.first, change.last)):
            return None
        steep = self.throw(change.side, angle.middle, angle.over).decides.by[0]
        return angle if (steep > 0 if change.rises else steep < 0) else None

    def place(self, chain: MovingEnd) -> Moving | None:
        """Enclose where a chain ends, the landing off by as much as it may be; None if that fails."""
        if chain not in self.places:
            self.places[chain] = self.place_of(chain)
        return self.places[chain]

    def enclosed(self, chains: list[MovingEnd]) -> list[Moving]:
        """Return where chains end, as far as that is enclosed."""
        return [place for place in map(self.place, chains) if place is not None]

    def place_of(self, chain: MovingEnd) -> Moving | None:
        """Compute what `place` keeps."""
        *before, last = chain
        if isinstance(last, float):
            return Moving(arb(last), arb(last), [ZERO] * len(self.free))
        side, branch, sign = (last.side, None, 0) if isinstance(last, Change) else last
        angle = self.angle((*before, last) if branch is None else tuple(before), side)
        if angle is None:
            return None
        thrown = self.throw(side, angle.middle, angle.over)
        if not (thrown.begins.by[0] > 0 and thrown.jogs_to.by[0] > 0):
            return None
        ends = (thrown.begins, thrown.jogs_to, thrown.jogs_to - thrown.shift)
        number = ends[0 if branch is None else 1 + branch]
        steep, *others = number.by
        slopes = [steep * d + other for d, other in zip(angle.slopes, others, strict=True)]
        return self.moving(number.at + sign * self.scene.sides[0].landing, slopes)

    def highest(self, chain: MovingEnd) -> Arb:
        """Bound the end of a chain from above: a parameter with which it rises, or falls, counts at one end."""
        place = self.place(chain)
        if place is None:
            return arb("inf")
        corner = self.worst(place)
        top = place.over.upper()
        return top if corner is self else top.min(corner.highest(chain))

    def worst(self, place: Moving, *, point: bool = False) -> "ParameterBox":
        """Return the part of the box where a place is highest; with `point` one point of it."""
        ends = self.ends.copy()
        for k, d, mid in zip(self.free, place.slopes, map(float, self.middle), strict=True):
            lo, hi = ends[k]
            ends[k] = (hi, hi) if d >= 0 else (lo, lo) if d <= 0 else (mid, mid) if point else (lo, hi)
        if ends == self.ends:
            return self
        return self.corners.setdefault(tuple(ends), ParameterBox(self.scene, ends))

    def is_below(self, one: MovingEnd, other: MovingEnd, *, strictly: bool = False) -> bool:
        """Whether one chain is proved to end at another's end or before, for all parameters."""
        if one == other:
            return not strictly
        a, b = self.place(one), self.place(other)
        if a is None or b is None:
            return False
        slopes = [d - e for d, e in zip(a.slopes, b.slopes, strict=True)]
        away = self.moving(a.middle - b.middle, slopes).over
        return bool(away < 0 if strictly else away <= 0)

    def extreme(self, chains: list[MovingEnd], sign: int) -> list[MovingEnd]:
        """Leave out chains of which the least (sign -1) or the greatest is sought: those never it, or not enclosed."""

        def is_enough(one: MovingEnd, other: MovingEnd) -> bool:
            return self.is_below(one, other) if sign < 0 else self.is_below(other, one)

        kept: list[MovingEnd] = []
        for chain in chains:
            if self.place(chain) is not None and not any(is_enough(one, chain) for one in kept):
                kept = [*(other for other in kept if not is_enough(chain, other)), chain]
        return kept
