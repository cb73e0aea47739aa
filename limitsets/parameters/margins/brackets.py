"""The search for a bracket: how far a goal is proved to hold, and from where on an orbit refutes it.

One quantity at a time.  Time-invariant uncertainty: single scenes come first, which is quick and shows where the goal
fails.  Then all scenes up to this deviation are proved at once, if two throws with the same parameters settle them; or
the proof grows outward from the nominal scene in pieces that become narrower towards the failure, each proved as if the
quantity differed at every throw.  Time-varying disturbance: the range cannot be cut; the search tries sizes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, Protocol

from limitsets.parameters.margins.deviations import Signs, a_little_beyond, halved, short
from limitsets.proofs.prover.numbers import RationalInterval

# What is asked, and of what: scenes (`Query`, `DeviationScale`, `Tolerance`) or maps (`of_map`).  A piece is a box of
# scenes or of maps, None for what is given; an outcome has `verdict`, `reason`, `piece` and `within`.


class Asked(Protocol):
    """Proves and refutes goals of a piece."""

    def prove(self, piece: Any = ..., noise: Any = ..., finest: int = ...) -> Any:
        """Prove the goals, or say what is missing."""

    def refute(self, piece: Any = ..., noise: Any = ...) -> Any:
        """Find an orbit that violates one."""

    def unjoined(self, pieces: Sequence[Any]) -> str:
        """Say why pieces do not prove the goals together, in one certificate; empty if they do."""


class Sizes(Protocol):
    """Deviations as sizes of a vector."""

    def corner(self, factor: Fraction, signs: Signs) -> Any:
        """Return the piece of one corner."""

    def noise(self, factor: Fraction) -> dict[str, str]:
        """Say what differs at every throw."""

    def texts(self, factor: Fraction) -> dict[str, str]:
        """Say what is fixed but unknown."""


class Scale(Protocol):
    """One quantity or parameter, and how its deviations are measured."""

    @property
    def key(self) -> str:
        """Its name in pieces."""

    @property
    def least(self) -> Fraction:
        """Where a search begins."""

    @property
    def most(self) -> Fraction | None:
        """What sizes stay below."""

    @property
    def widest(self) -> Fraction | None:
        """Width of a piece at most."""

    def alone(self) -> Sizes:
        """Return its deviations by 1 of its unit."""

    def text(self, size: Fraction) -> str:
        """Write a size."""

    def between(self, one: Fraction, other: Fraction) -> RationalInterval:
        """Return the values at all deviations between two."""

    def piece(self, span: RationalInterval) -> Any:
        """Return the piece with these values."""


Tell = Callable[[float], None]
"""Called with the share of the bracket that is closed."""

# Steps outward at most, each `FACTOR` times as far; trials of pieces in one direction.
STEPS, FACTOR, TRIALS = 24, 3, 200

# What to do about a bracket that does not close.
NARROWER = "it would need finer cells than are tried here: ask for a wider bracket, or another x"

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
    pieces : list of Outcome, or what else is asked gives
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
    pieces: list[Any] = field(default_factory=list)
    against: Any = None
    reason: str = ""
    sign: int = 1

    def closed(self, width: Fraction) -> bool:
        """Whether it is narrower than a share of its upper end."""
        return self.refuted is not None and self.refuted - self.proved <= width * self.refuted


class Ray:
    """Sizes in one direction of a tolerance, each asked as a single scene, and what became of them."""

    def __init__(self, query: Asked, tolerance: Sizes, signs: Signs) -> None:
        self.query, self.tolerance, self.signs = query, tolerance, signs
        self.bracket = Bracket()
        self.end: Fraction | None = None

    def _at(self, size: Fraction) -> tuple[Any, dict[str, str]]:
        return self.tolerance.corner(size, self.signs), self.tolerance.noise(size)

    def proves(self, size: Fraction, finest: int = 3) -> bool:
        """Whether the goals are proved at a size."""
        one = self.query.prove(*self._at(size), finest)
        if one.verdict != "proved":
            self.bracket.reason = one.reason
        elif size > self.bracket.proved:
            self.bracket.proved, self.bracket.pieces = size, [one]
        return bool(one.verdict == "proved")

    def refutes(self, size: Fraction) -> bool:
        """Whether an orbit violates a goal at a size."""
        one = self.query.refute(*self._at(size))
        if one.verdict == "refuted":
            self.bracket.refuted = size
            self.bracket.against = replace(one, within=self.tolerance.texts(size))
        return bool(one.verdict == "refuted")

    def ask(self, size: Fraction) -> str:
        """Ask for the verdict at a size; `end` is where it was neither proved nor refuted last."""
        one = self.query.prove(*self._at(size), finest=0)
        if one.verdict not in ("proved", "impossible"):
            if self.refutes(size):
                return "refuted"
            one = self.query.prove(*self._at(size))
        if one.verdict == "proved":
            self.bracket.proved = max(self.bracket.proved, size)
        else:
            self.end, self.bracket.reason = size, one.reason
        return str(one.verdict)

    @property
    def gap(self) -> bool:
        """Whether nothing is known of some scene before those that are refuted."""
        return self.bracket.refuted is not None and self.end is not None and self.end < self.bracket.refuted


def _reach(query: Asked, scale: Scale, sign: int, width: Fraction, known: Fraction | None) -> Ray:
    """Go outward from the scene as it is until single scenes are refuted or cannot be, then halve."""
    ray, step = Ray(query, scale.alone(), (sign,)), scale.least
    bracket = ray.bracket
    for _ in range(STEPS):
        size = step if scale.most is None else min(step, (step / FACTOR + scale.most) / 2)
        if known is not None and bracket.proved >= known:
            return ray
        if ray.ask(size) != "proved":
            break
        step *= FACTOR
    else:
        return ray
    least = NONE * scale.least
    # beyond a gap the refuted size is nearly the smallest that can be refuted
    halved(bracket.proved, size, lambda s: ray.ask(s) == "proved", width, least, stop=lambda: ray.gap)
    if bracket.refuted is not None and ray.end is not None:
        # lower what is refuted towards what is undecided, and raise what is proved
        halved(ray.end, bracket.refuted, lambda s: ray.ask(s) != "refuted", width)
        ray.end = None
    return ray


def _grow(
    query: Asked, scale: Scale, sign: int, target: Fraction, wall: Fraction, tell: Tell
) -> tuple[Fraction, list[Any], str]:
    """Prove from the scene as it is outward, in pieces; how far, the pieces, and what stops it."""
    low, pieces, reason = Fraction(0), list[Any](), ""
    share = Fraction(2, 5)
    step = share * wall
    for _ in range(TRIALS):
        if low >= target:
            return low, pieces, ""
        step = step if scale.widest is None else min(step, scale.widest)
        high = min(target, short(low + step, up=True))
        # far from the wall narrower pieces do as well as finer cells, and a failed proof on fine cells takes long
        finest = 3 if low > NEAR * wall else 1
        outcome = query.prove(scale.piece(scale.between(sign * low, sign * high)), finest=finest)
        if outcome.verdict == "proved":
            pieces.append(outcome)
            # pieces grow fast until one fails
            low, share = high, min(share * Fraction(33 if reason else 40, 32), Fraction(3))
            step = share * (wall - high)
            tell(float(low / target))
        else:
            reason, share = outcome.reason, (high - low) / (wall - low) * Fraction(2, 3)
            step = share * (wall - low)
            if step < min((wall - target) / 8, target / 16000):
                break
    return low, pieces, reason


def bracket_fixed(query: Asked, scale: Scale, width: Fraction, tell: Tell) -> Bracket:
    """Bracket the margin of a quantity that is fixed but unknown."""
    ways: dict[int, Ray] = {}
    for sign in (-1, 1):
        known = min(
            (way.bracket.refuted for way in ways.values() if way.bracket.refuted is not None), default=None
        )
        ways[sign] = _reach(query, scale, sign, width / 4, known)
    bracket = Bracket()
    for sign, way in ways.items():
        bad = way.bracket.refuted
        if bad is not None and (bracket.refuted is None or bad < bracket.refuted):
            bracket.refuted, bracket.against, bracket.sign = bad, way.bracket.against, sign
    ends = [way for way in ways.values() if way.end is not None]
    if bracket.refuted is not None:
        goal = bracket.refuted * (1 - width * Fraction(6, 10))
        goal = min([goal, *(way.bracket.proved for way in ends)])
    else:
        goal = min(way.bracket.proved for way in ends or ways.values())
    first = next((way for way in ends if way.bracket.proved == goal), None)
    if first is not None and first.end is not None:
        bracket.reason = f"from {scale.text(first.end)} on: {first.bracket.reason}"
    bracket = _fixed_proof(query, scale, bracket, short(goal), tell)
    _come_back(query, scale, bracket, width)
    bracket.reason = "" if bracket.closed(width) else bracket.reason
    return bracket


def _fixed_proof(query: Asked, scale: Scale, bracket: Bracket, goal: Fraction, tell: Tell) -> Bracket:
    """Prove it all at once, or grow the proof in both directions."""
    if goal <= NONE * scale.least:
        return bracket
    # all at once first: two throws with the same parameters may settle it
    whole = query.prove(scale.piece(scale.between(-goal, goal)), finest=0)
    if whole.verdict == "proved":
        bracket.pieces, bracket.proved = [whole], goal
        return bracket
    wall = bracket.refuted or goal * Fraction(101, 100)
    for sign in (-1, 1):
        near = bracket.against is not None and sign == bracket.sign
        far, pieces, reason = _grow(query, scale, sign, goal, wall if near else 3 * wall, tell)
        bracket.pieces += pieces
        if far < goal:
            stuck = f"{reason}; {NARROWER}" if reason else f"from there on it is in more than {TRIALS} pieces"
            goal, bracket.reason = far, stuck
            _fails_beyond(Ray(query, scale.alone(), (sign,)), sign, far, bracket)
            if not far:
                break
    bracket.proved = goal
    return bracket


def _come_back(query: Asked, scale: Scale, bracket: Bracket, width: Fraction) -> None:
    """Come back to the size up to which all pieces together are one claim, as a certificate has to make it.

    Each piece is proved for its own starts; where these differ too much, no claim is left for all of them.
    """
    pieces, missing = bracket.pieces, query.unjoined(bracket.pieces) if bracket.pieces else ""
    if not missing:
        return

    def joins(size: Fraction) -> bool:
        nonlocal missing
        within = _within(query, scale, pieces, size)
        why = query.unjoined(within)
        if not why:
            bracket.proved, bracket.pieces = size, within
        missing = why or missing
        return not why

    top = bracket.proved
    if joins(top):
        return
    bracket.proved, bracket.pieces = Fraction(0), []
    _, bad = halved(Fraction(0), top, joins, min(width, Fraction(1, 50)), NONE * scale.least)
    bracket.reason = f"from {scale.text(bad)} on: {missing}"


def _within(query: Asked, scale: Scale, pieces: Sequence[Any], size: Fraction) -> list[Any]:
    """Cut pieces back to a size: those that reach beyond are proved anew, for more starts."""
    whole, kept = scale.between(-size, size), []
    for piece in pieces:
        own = piece.piece.spans[scale.key] if piece.piece is not None else whole
        lo, hi = max(own.lo, whole.lo), min(own.hi, whole.hi)
        if (lo, hi) == (own.lo, own.hi):
            kept.append(piece)
        elif lo < hi:
            kept.append(query.prove(scale.piece(RationalInterval(lo, hi))))
    return kept


def _fails_beyond(ray: Ray, sign: int, far: Fraction, bracket: Bracket) -> None:
    """Where a proof stops growing, look for a scene that fails: a goal may fail at a size and hold at larger ones."""
    for beyond in a_little_beyond(far, Fraction(1, 400), 10):
        size = short(beyond, up=True)
        if bracket.refuted is not None and size >= bracket.refuted:
            return
        if ray.refutes(size):
            bracket.refuted, bracket.against, bracket.sign = size, ray.bracket.against, sign
            return


def bracket_per_throw(query: Asked, scale: Scale, width: Fraction, tell: Tell) -> Bracket:
    """Bracket the margin of a quantity that has another value at every throw."""
    ray, size, most = Ray(query, scale.alone(), ()), scale.least, scale.most
    bracket = ray.bracket
    for _ in range(STEPS):
        if not ray.proves(size, 1):
            break
        nearer = FACTOR * size
        size = nearer if most is None or nearer < most else (size + most) / 2
    _, size = halved(bracket.proved, size, lambda s: ray.proves(s, 1), Fraction(1, 40), NONE * scale.least)
    tell(0.3)
    for beyond in a_little_beyond(size, Fraction(1, 100), 8):
        if (most is None or short(beyond) < most) and ray.refutes(short(beyond)):
            break
    tell(0.5)
    if bracket.refuted is not None and not bracket.closed(width):
        ray.proves(short(bracket.refuted * (1 - width * Fraction(9, 10))), 3)
    _close_per_throw(ray, width, NONE * scale.least)
    bracket.reason = "" if bracket.closed(width) else bracket.reason
    return bracket


def _close_per_throw(ray: Ray, width: Fraction, least: Fraction) -> None:
    """Move both ends of a bracket towards each other, until it is closed or no size between them is decided."""
    bracket = ray.bracket
    low = high = None  # nothing is known between them
    while bracket.refuted is not None and not bracket.closed(width) and bracket.refuted > least:
        middle = short(((high or bracket.proved) + bracket.refuted) / 2)
        if bracket.refuted - (high or bracket.proved) > width / 4 * bracket.refuted:
            if ray.refutes(middle) or ray.proves(middle, 3):
                continue
            low, high = low or middle, middle
        elif low is not None and low - bracket.proved > width / 4 * low:
            middle = short((bracket.proved + low) / 2)
            low = low if ray.proves(middle, 3) else middle
        else:
            break
