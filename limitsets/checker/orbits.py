"""Periodic orbits in the attracting cells.

docs/certificates.md, "Goals, end points, orbits", number 13.
"""

from typing import Any, NamedTuple

from flint import arb

from .balls import ONE, ZERO, Arb, Pair, UnprovedError, prove
from .end_points import Intervals, Throws, attracting, first_outside
from .file import Cells
from .scene import Scene
from .texts import hex_float, read_side, require, rows, table

MOST_ORBITS, LONGEST = 200, 1_000  # orbits in a section, and throws of one


class Orbit(NamedTuple):
    """A periodic orbit as the certificate claims it: an interval of starts, the branches, and its multiplier."""

    side: int
    lo: float
    hi: float
    word: list[int]
    multiplier: Pair
    attracts: bool


def read_orbits(section: dict[str, Any], n_sides: int) -> dict[str, Any]:
    """Read the section of cycles."""
    require(section["complete"] is False, "that no cycle is missing is nothing that can be proved here")
    orbits = []
    for each in rows(section["cycles"], "cycles", 1, MOST_ORBITS):
        table(each, "a cycle", "side itinerary interval multiplier attracts")
        word = rows(each["itinerary"], "an itinerary", 1, LONGEST)
        require(all(type(b) is int and b in (0, 1) for b in word), "an itinerary is not one of 0 and 1")
        lo, hi = (hex_float(end, "interval") for end in rows(each["interval"], "an interval", 2, 2))
        least, most = (hex_float(end, "multiplier") for end in rows(each["multiplier"], "a multiplier", 2, 2))
        require(lo < hi and least <= most, "an interval or a multiplier is empty")
        attracts = each["attracts"]
        right = (least > -1 and most < 1) if attracts else (least > 1 or most < -1)
        require(isinstance(attracts, bool) and right, "a multiplier and what it is said to do do not fit")
        orbits.append(Orbit(read_side(each["side"], n_sides), lo, hi, word, (least, most), attracts))
    return {"orbits": orbits}


class Followed(NamedTuple):
    """The states of starts along an itinerary, with side and bounds of each; and the slope of all throws together."""

    states: list[tuple[int, Arb, Arb]]
    slope: Arb


def follow(throws: Throws, orbit: Orbit, x0: Arb, x1: Arb) -> Followed:
    """Follow the starts in [x0, x1], proving that each throw decides as the itinerary says."""
    states, slope = [(orbit.side, x0, x1)], ONE
    for k, branch in enumerate(orbit.word):
        side, lo, hi = states[-1]
        t = throws.interval(side, lo, hi)
        prove(t.decision == branch, f"throw {k + 1}: that it is a {('jog', 'flip')[branch]} is not proved")
        if t.slope is None:
            raise UnprovedError(f"throw {k + 1}: its slope is not bounded")
        shift = throws.scene.sides[side].shift if branch else ZERO
        after = (side + branch) % len(throws.scene.sides)
        states.append((after, (t.lo - shift).lower(), (t.hi - shift).upper()))
        slope = slope * t.slope
    return Followed(states, slope)


def prove_orbit(throws: Throws, cells: Intervals | None, orbit: Orbit) -> Followed:
    """Prove one periodic orbit: with G the throws along the itinerary, G(R) - R changes sign in the interval.

    Along the interval all decisions are those of the itinerary and f is concave, so that G is the map and continuous.
    |G'| > 1 or |G'| < 1 on the interval: G(R) - R is monotone, and the orbit is the only one.  The attracting cells, if
    the orbit has to lie in them, are invariant: one point of the orbit in them is enough.
    """
    if cells is not None:
        here: Intervals = [[] for _ in cells]
        here[orbit.side] = [(orbit.lo, orbit.hi)]
        prove(not first_outside(here, cells), "not in the attracting cells")
    lo, hi = arb(orbit.lo), arb(orbit.hi)
    first, last = (follow(throws, orbit, x, x).states[-1] for x in (lo, hi))
    prove(first[0] == orbit.side, "it ends on another side")
    grows = bool(first[2] < lo and last[1] > hi)
    prove(grows or bool(first[1] > lo and last[2] < hi), "that it comes back is not proved")
    found = follow(throws, orbit, lo, hi)
    period = len(orbit.word)
    for k in range(1, period):
        apart = period % k or not meets(found.states[k], found.states[0])
        prove(bool(apart), f"its period may be {k}")
    least, most = orbit.multiplier
    within = bool(found.slope >= least and found.slope <= most)
    prove(within, f"its multiplier, {found.slope.str(10)}, is not proved to be as claimed")
    return found


def meets(one: tuple[int, Arb, Arb], other: tuple[int, Arb, Arb]) -> bool:
    """Whether two intervals may have a point in common."""
    return one[0] == other[0] and not (one[2] < other[1] or other[2] < one[1])


def check_orbits(scene: Scene, c: Cells, section: dict[str, Any]) -> str:
    """Check that all periodic orbits exist and are different; "" or the reason."""
    cells, throws = attracting(c), Throws(scene)
    proved: list[Followed] = []
    for orbit in section["orbits"]:
        name = f"period {len(orbit.word)}, side {orbit.side}, x in [{orbit.lo!r}, {orbit.hi!r}]"
        try:
            prove(all(s.concave for s in scene.sides), "kappa > ell is not proved")
            found = prove_orbit(throws, cells, orbit)
        except UnprovedError as error:
            return f"{name}: {error}"
        for other in proved:
            if len(other.states) == len(found.states) and any(
                meets(state, found.states[0]) for state in other.states
            ):
                return f"{name}: it may be the same orbit as another one"
        proved.append(found)
    return ""


def orbits_statement(section: dict[str, Any]) -> str:
    """Put the claim of periodic orbits in words."""
    lines = ["cycles: periodic orbits in the attracting cells, no two the same (there may be more)"]
    for o in section["orbits"]:
        does = "attracts" if o.attracts else "repels"
        where = f"the only one of it with x in [{o.lo!r}, {o.hi!r}] on side {o.side}"
        lines.append(
            f"    period {len(o.word)}, {where}: {does}, multiplier in [{o.multiplier[0]!r}, {o.multiplier[1]!r}]"
        )
    return "\n".join(lines)
