"""The end points of the limit set: throws of intervals, and images of the attracting cells.

docs/certificates.md, "Goals, end points, orbits", numbers 10 (pieces), 11 (outer ends) and 12 (inner ends).
"""

import itertools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from .balls import (
    HALF,
    ONE,
    ZERO,
    Arb,
    Pair,
    float_above,
    float_below,
    prove,
)
from .file import Cells, hex_float, read_side, require, rows, table, whole_number
from .model import FULL_TURN, Angle, at_angle, flight, guess_root, over_angles, slope_over
from .scene import Scene, Side

MOST_ENDS, MOST_PIECES, MOST_IMAGES = 400, 4_000, 20_000
MOST_THROWN = 100_000  # boxes that `Throws` throws for one claim: a section that needs more is refused
END_KEYS = ("outer", "inner", "inner", "outer")
# The relative width of brackets of the impact angle; the second where R - a is less than a millionth of a.
ROOT, WIDER_ROOT = arb(2) ** -70, arb(2) ** -45
Intervals = list[list[Pair]]  # closed intervals by side, ascending and disjoint


class Piece(NamedTuple):
    """A part of the attracting cells, with the branch there (2: either) and the sign of dR'/dR (0: none is claimed)."""

    side: int
    lo: float
    hi: float
    branch: int
    sign: int

    def name(self) -> str:
        """Name the piece, for people."""
        return f"side {self.side}, x in [{self.lo!r}, {self.hi!r}]"


def read_ends(section: dict[str, Any], n_sides: int) -> dict[str, Any]:
    """Read the section of end-points: two unions of intervals, the inner one inside the outer one, and the pieces."""
    images = whole_number(section["images"], 1, MOST_IMAGES, "images is not a number of images")
    outer, inner = read_outer_and_inner(section["ends"], n_sides)
    pieces = read_pieces(section["pieces"], n_sides)
    return {"images": images, "outer": outer, "inner": inner, "pieces": pieces}


def read_outer_and_inner(value: object, n_sides: int) -> tuple[Intervals, Intervals]:
    """Read the ends: a lower and an upper one of each interval in turn, each with an outer and an inner bound."""
    outer: Intervals = [[] for _ in range(n_sides)]
    inner: Intervals = [[] for _ in range(n_sides)]
    ends = [table(e, "an end", "side which outer inner") for e in rows(value, "ends", 2, MOST_ENDS)]
    sides = [read_side(end["side"], n_sides) for end in ends]
    paired = [end["which"] for end in ends] == ["lo", "hi"] * (len(ends) // 2)
    paired = paired and sides[::2] == sides[1::2] and sides == sorted(sides)
    require(paired, "the ends are not a lower and an upper one of each interval, by sides")
    for side, low, high in zip(sides[::2], ends[::2], ends[1::2], strict=True):
        a, b, c, d = (
            hex_float(end[key], key) for end, key in zip((low, low, high, high), END_KEYS, strict=True)
        )
        apart = a < b < c < d and (not outer[side] or outer[side][-1][1] < a)
        require(apart, f"side {side}: the ends do not ascend, outer before inner, interval after interval")
        outer[side].append((a, d))
        inner[side].append((b, c))
    return outer, inner


def read_pieces(value: object, n_sides: int) -> list[list[Piece]]:
    """Read the pieces of the attracting cells, by side and ascending."""
    pieces: list[list[Piece]] = [[] for _ in range(n_sides)]
    for row in rows(value, "pieces", 1, MOST_PIECES):
        side, lo, hi, branch, sign = rows(row, "a piece", 5, 5)
        fits = all(type(n) is int for n in (branch, sign)) and 0 <= branch <= 2 and -1 <= sign <= 1
        require(fits, "branch or slope of a piece is not one")
        piece = Piece(read_side(side, n_sides), hex_float(lo, "lo"), hex_float(hi, "hi"), branch, sign)
        own = pieces[piece.side]
        ordered = piece.lo < piece.hi and (not own or own[-1].hi <= piece.lo)
        require(ordered, f"{piece.name()}: the pieces do not ascend")
        own.append(piece)
    return pieces


class Thrown(NamedTuple):
    """The result of throws from a box: the decision (2: not settled), bounds of R'(jog), and dR'/dR or None."""

    decision: int
    lo: Arb
    hi: Arb
    slope: Arb | None


def beside_root(s: Side, x: Arb, kappa: Arb, before: bool) -> Angle:
    """Find an angle that is proved to lie just before the impact at x, or just after it."""
    if not s.exact:
        p = 2 * (x - s.a) / (kappa - s.small_d)
        p = p.lower() if before else p.upper()
        prove(bool(p > 0 and p < FULL_TURN), "the impact is not within a turn")
        return at_angle(s, p)
    a, d, _, _ = s.floats
    x0, k = float(x), float(kappa)
    right = (x0 + math.sqrt(x0 * x0 + 2 * k * (d + math.hypot(a, d)))) / k  # f < 0 there
    p = arb(guess_root(s.floats, s.exact, x0, k, right) if 0 < right < 1e3 else math.nan)
    for tried in range(8):  # two are enough, except next to the joint, where the floats are poor
        f = flight(x, kappa, at_angle(s, p))
        sin, cos = p.sin_cos()
        p = (p - f / (x - s.a * cos + s.d * sin - kappa * p)).mid()
        root = ROOT if tried < 6 else WIDER_ROOT
        at = at_angle(s, (p * (ONE - root if before else ONE + root)).mid())
        f = flight(x, kappa, at)
        # with x > a and f concave, f is positive up to its one positive root and negative beyond
        right_side = bool(f > 0 if before else f < 0) and bool(at.p > 0 and at.p < FULL_TURN)
        if right_side or not p.is_finite():
            break
    prove(right_side and s.concave and bool(x > s.a), f"the impact is not bracketed at x = {x0!r}")
    return at


class Throws:
    """Throws of points and boxes from one scene, with a limit on their number."""

    def __init__(self, scene: Scene):
        self.scene, self.left = scene, MOST_THROWN
        self.points: dict[tuple[int, float], Thrown] = {}

    def spend(self) -> None:
        """Count a box."""
        self.left -= 1
        prove(self.left >= 0, f"more than {MOST_THROWN} boxes would be needed")

    def box(self, side: int, x0: Arb, x1: Arb, k0: Arb, k1: Arb) -> Thrown:
        """Throw all x in [x0, x1] with all kappa in [k0, k1]; the four are exact.

        The angle rises with x and falls with kappa.  phi'(R) = -f_R/f_phi = -phi/f_phi, R' = R + D(phi).
        """
        self.spend()
        s = self.scene.sides[side]
        low, high = beside_root(s, x0, k1, True), beside_root(s, x1, k0, False)
        phi, R, kappa = low.p.union(high.p), x0.union(x1), k0.union(k1)
        decision, rise, f_slope = over_angles(s, phi, R, kappa)
        slope = slope_over(s, phi, kappa, rise, f_slope)
        if rise > 0:
            return Thrown(decision, x0 + low.D, x1 + high.D, slope)
        whole = R + low.D + rise * (phi - low.p)
        return Thrown(decision, whole, whole, slope)

    def interval(self, side: int, x0: Arb, x1: Arb) -> Thrown:
        """Throw an interval; where dR'/dR has a sign the images of the ends bound all images."""
        k0, k1 = self.scene.k_lo, self.scene.k_hi
        t = self.box(side, x0, x1, k0, k1)
        if x0 < x1 and t.slope is not None and (t.slope > 0 or t.slope < 0):
            first, last = (x0, x1) if t.slope > 0 else (x1, x0)
            lo, hi = self.box(side, first, first, k0, k1).lo, self.box(side, last, last, k0, k1).hi
            return t._replace(lo=lo, hi=hi)
        return t

    def point(self, side: int, x: float) -> Thrown:
        """Throw one point, at the first call only."""
        if (side, x) not in self.points:
            self.points[side, x] = self.interval(side, arb(x), arb(x))
        return self.points[side, x]


def joined(intervals: list[Pair]) -> list[Pair]:
    """Return the union of closed intervals, ascending."""
    union: list[Pair] = []
    for lo, hi in sorted(intervals):
        if union and lo <= union[-1][1]:
            union[-1] = (union[-1][0], max(union[-1][1], hi))
        else:
            union.append((lo, hi))
    return union


def meeting(one: list[Pair], other: list[Pair]) -> list[Pair]:
    """Return the intersection of two unions, ascending."""
    common = []
    i = k = 0
    while i < len(one) and k < len(other):
        lo, hi = max(one[i][0], other[k][0]), min(one[i][1], other[k][1])
        if lo <= hi:
            common.append((lo, hi))
        if one[i][1] < other[k][1]:
            i += 1
        else:
            k += 1
    return common


def first_outside(union: Intervals, within: Intervals) -> str:
    """Name the first interval that does not lie in one of another union; "" if all do."""
    for side, (parts, wider) in enumerate(zip(union, within, strict=True)):
        for lo, hi in parts:
            if meeting([(lo, hi)], wider) != [(lo, hi)]:
                return f"side {side}, x in [{lo!r}, {hi!r}]"
    return ""


def prove_within(union: Intervals, within: Intervals, what: str) -> None:
    """Prove that all intervals lie in those of another union; the reason names the first that does not."""
    outside = first_outside(union, within)
    prove(not outside, f"{outside}: {what}")


def attracting(c: Cells) -> Intervals:
    """Return the attracting cells as intervals."""
    union: Intervals = []
    for i, edges in enumerate(c.edges):
        own = np.flatnonzero(c.component[c.start[i] : c.start[i + 1]] >= 0)
        union.append(joined(list(zip(edges[own].tolist(), edges[own + 1].tolist(), strict=True))))
    return union


def unproved_of(throws: Throws, piece: Piece, most: int = MOST_THROWN) -> str:
    """Prove branch and sign of the slope on a piece; "" or which of them is not proved.

    Where the whole is too wide it is halved in x and in kappa, until `most` boxes are thrown.
    """
    stack, thrown = [(arb(piece.lo), arb(piece.hi), throws.scene.k_lo, throws.scene.k_hi)], 0
    while stack:
        x0, x1, k0, k1 = stack.pop()
        thrown += 1
        t = throws.box(piece.side, x0, x1, k0, k1)
        steep = bool(piece.sign == 0 or (t.slope is not None and piece.sign * t.slope > 0))
        if piece.branch in (2, t.decision) and steep:
            continue
        wrong = piece.branch != 2 and t.decision == 1 - piece.branch
        halves = [] if wrong or thrown > most else halved_box(x0, x1, k0, k1)
        if not halves:
            return "branch" if piece.branch not in (2, t.decision) else "sign of the slope"
        stack += halves
    return ""


def halved_box(x0: Arb, x1: Arb, k0: Arb, k1: Arb) -> list[tuple[Arb, Arb, Arb, Arb]]:
    """Halve a box in x or kappa, whichever is wider; [] where floats have no middle left."""
    xm, km = (arb(float((HALF * (lo + hi)).mid())) for lo, hi in ((x0, x1), (k0, k1)))
    by_x, by_k = bool(x0 < xm and xm < x1), bool(k0 < km and km < k1)
    if by_k and not (by_x and k1 - k0 < x1 - x0):
        return [(x0, x1, km, k1), (x0, x1, k0, km)]
    return [(xm, x1, k0, k1), (x0, xm, k0, k1)] if by_x else []


def parts_of(throws: Throws, union: Intervals, pieces: list[list[Piece]]) -> Iterator[tuple[int, Piece]]:
    """Cut a union at the borders of the pieces; yield each part with the number of its interval."""
    for intervals, own in zip(union, pieces, strict=True):
        at = 0
        for owner, (lo, hi) in enumerate(intervals):
            while at < len(own) and own[at].hi < lo:
                at += 1
            for piece in itertools.islice(own, at, None):
                if piece.lo > hi:
                    break
                throws.spend()
                yield owner, piece._replace(lo=max(lo, piece.lo), hi=min(hi, piece.hi))


def image_outward(throws: Throws, union: Intervals, pieces: list[list[Piece]]) -> Intervals:
    """Return a union that holds the image of another, by both branches where either is possible."""
    n = len(union)
    images: Intervals = [[] for _ in range(n)]
    for _, part in parts_of(throws, union, pieces):
        if part.sign != 0:
            ends = [throws.point(part.side, x) for x in (part.lo, part.hi)]
        else:
            ends = [throws.interval(part.side, arb(part.lo), arb(part.hi))]
        for branch in (0, 1) if part.branch == 2 else (part.branch,):
            shift = throws.scene.sides[part.side].shift if branch else ZERO
            lo, hi = (
                min(float_below(t.lo - shift) for t in ends),
                max(float_above(t.hi - shift) for t in ends),
            )
            images[(part.side + branch) % n].append((lo, hi))
    return [joined(intervals) for intervals in images]


def image_inward(throws: Throws, union: Intervals, pieces: list[list[Piece]]) -> Intervals:
    """Return a union that lies in the image of another.

    On neighbouring pieces of one branch the map is continuous, because f is concave.  So it takes all values between
    its values at two of their points (intermediate values).  Pieces without a branch give nothing.
    """
    n = len(union)
    images: Intervals = [[] for _ in range(n)]

    def close(run: list[Piece]) -> None:
        shift = throws.scene.sides[run[0].side].shift if run[0].branch else ZERO
        ends = [throws.point(part.side, x) for part in run for x in (part.lo, part.hi)]
        lo, hi = min(float_above(t.hi - shift) for t in ends), max(float_below(t.lo - shift) for t in ends)
        if lo <= hi:
            images[(run[0].side + run[0].branch) % n].append((lo, hi))

    run: list[Piece] = []
    of = -1
    for owner, part in parts_of(throws, union, pieces):
        last = run[-1] if run else part
        follows = (of, last.side, last.branch, last.hi) == (owner, part.side, part.branch, part.lo)
        if run and not follows:
            close(run)
            run = []
        if part.branch != 2:
            run.append(part)
            of = owner
    if run:
        close(run)
    return [joined(intervals) for intervals in images]


def check_ends(scene: Scene, c: Cells, section: dict[str, Any]) -> None:
    """Prove the end points from the attracting cells N, which are invariant.

    Outer: A(0) = N, A(n+1) = F(A(n)) & A(n), rounded outward, holds the image of N under n + 1 throws, whatever kappas
    of the noise they have.  Inner: B lies in N and in its own image F(B), for each kappa: so in every image of N.
    """
    cells, outer, inner, pieces = attracting(c), section["outer"], section["inner"], section["pieces"]
    for side, s in enumerate(scene.sides):
        once = f"side {side}: kappa > ell is not proved, so that there may be several impacts"
        prove(s.concave, once)
        made_up = joined([(piece.lo, piece.hi) for piece in pieces[side]]) == cells[side]
        prove(made_up, f"side {side}: the pieces do not make up the attracting cells")
    prove_within(inner, cells, "not in the attracting cells")
    throws = Throws(scene)
    for piece in itertools.chain(*pieces):
        unproved = unproved_of(throws, piece)
        prove(not unproved, f"{piece.name()}: the {unproved} is not proved")
    again = image_inward(throws, inner, pieces)
    prove_within(inner, again, "it is not proved that all of it is reached again")
    union, taken = cells, 0
    while first_outside(union, outer):
        images = image_outward(throws, union, pieces)
        smaller = [meeting(one, other) for one, other in zip(images, union, strict=True)]
        if smaller == union or taken == section["images"]:
            after = f"after {taken} images of the attracting cells"
            prove_within(union, outer, f"not proved to lie within the outer ends {after}")
        union, taken = smaller, taken + 1


def ends_statement(section: dict[str, Any], noisy: bool) -> str:
    """Put the claim of end points in words, with the numbers that are checked."""
    noise = ", with whatever speeds of the noise" if noisy else ""
    after = f"after {section['images']} throws or more they lie within the outer ends"
    always = "and always they hold all between the inner ends"
    lines = [
        f"end-points: let the attracting cells be thrown, all of them, ever again{noise}; {after}, {always}"
    ]
    for side, (outer, inner) in enumerate(zip(section["outer"], section["inner"], strict=True)):
        for (a, d), (b, c) in zip(outer, inner, strict=True):
            lines.append(f"    side {side}: lower end in [{a!r}, {b!r}], upper end in [{c!r}, {d!r}]")
    return "\n".join(lines)
