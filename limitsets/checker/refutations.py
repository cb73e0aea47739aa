"""Periodic orbits, and orbits that refute a goal, because they come back or the goal speaks of every throw.

docs/certificates.md, "Refutations".
"""

import itertools
from typing import Any, NamedTuple

from flint import arb

from .balls import ONE, ZERO, Arb, Pair, UnprovedError, about, exact, prove
from .end_points import Intervals, Throws, attracting, first_outside
from .file import (
    KINDS,
    LENGTHS,
    Cells,
    hex_float,
    plain,
    quantity,
    read_side,
    require,
    rows,
    table,
)
from .goals import read_goal
from .near_foot import INSIDE
from .scene import Scene, quantities, read_scene
from .starts import Span, ranges_in_words, read_laid

# ---------------------------------------------------------------- Periodic orbits in the attracting cells
#
# docs/certificates.md, "Goals, end points, orbits", number 13.


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
    followed = follow(throws, orbit, lo, hi)
    period = len(orbit.word)
    for k in range(1, period):
        apart = period % k or not meets(followed.states[k], followed.states[0])
        prove(bool(apart), f"its period may be {k}")
    least, most = orbit.multiplier
    within = bool(followed.slope >= least and followed.slope <= most)
    prove(within, f"its multiplier, {followed.slope.str(10)}, is not proved to be as claimed")
    return followed


def meets(one: tuple[int, Arb, Arb], other: tuple[int, Arb, Arb]) -> bool:
    """Whether two intervals may have a point in common."""
    return one[0] == other[0] and not (one[2] < other[1] or other[2] < one[1])


def check_orbits(scene: Scene, c: Cells, section: dict[str, Any]) -> None:
    """Check that all periodic orbits exist and are different."""
    cells, throws = attracting(c), Throws(scene)
    proved: list[Followed] = []
    for orbit in section["orbits"]:
        with about(f"period {len(orbit.word)}, side {orbit.side}, x in [{orbit.lo!r}, {orbit.hi!r}]"):
            prove(all(s.concave for s in scene.sides), "kappa > ell is not proved")
            followed = prove_orbit(throws, cells, orbit)
            alike = [other.states for other in proved if len(other.states) == len(followed.states)]
            same = any(meets(state, followed.states[0]) for state in itertools.chain(*alike))
            prove(not same, "it may be the same orbit as another one")
        proved.append(followed)


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


# ----------------------------------------------------------------
# Orbits that refute a goal, because they come back or because the goal speaks of every throw.


MOST_THROWS = 100_000  # throws of an orbit that refutes
# an orbit refutes because it is periodic, closes with noise, or once is enough
RECURS = (
    "cycle",
    "closed",
    "once",
)
BROKEN = {  # the goals that an orbit may refute: their keys besides from_anywhere, and words for the orbit
    "oriented_beyond": ("kind x side", "comes to lie beyond x = {text} on another side than {side}"),
    "reaches": ("kind x side every_orbit", "never comes to rest on side {side} at x >= {text}"),
    "flip_order": ("kind order", "does not follow the order {order} of sides"),
    "stays_on_arm": ("kind", "leaves the arm"),
    "attracts_all": ("kind", "leaves the arm"),
}
State = tuple[int, Arb, Arb]  # side, and bounds of x


def read_refutation(section: dict[str, Any], n_sides: int) -> dict[str, Any]:
    """Read an orbit that refutes a goal: why it comes back, and either a cycle or a start with its throws."""
    nominal, tolerance = section["nominal"], section["tolerance"]
    goal, laid = read_broken_goal(section["goal"], n_sides)
    same = isinstance(nominal, dict) and isinstance(tolerance, dict) and set(nominal) == set(tolerance)
    fits = same and len(nominal) <= 64
    require(fits, "refuted: nominal values and tolerance do not name the same quantities")
    refutation = {
        "goal": read_goal(goal, n_sides),
        "nominal": nominal,
        "tolerance": tolerance,
        "why": "",
        "laid": laid,
    }
    if "recurs" in section:
        recurs = table(section["recurs"], "refuted.recurs", "", " ".join(RECURS))
        require(len(recurs) == 1, "refuted.recurs is not one of cycle, closed and once")
        (refutation["why"],) = recurs
        if refutation["why"] == "cycle":
            require(not {"start", "throws"} & set(section), "refuted: a cycle has no start and no throws")
            (orbit,) = read_orbits({"cycles": [recurs["cycle"]], "complete": False}, n_sides)["orbits"]
            return refutation | {"orbit": orbit}
        require(recurs[refutation["why"]] is True, "refuted.recurs is not true")
    return refutation | read_passing(section, refutation["why"], n_sides)


def read_broken_goal(value: object, n_sides: int) -> tuple[dict[str, Any], list[list[Span]] | None]:
    """Read the section of the refuted goal, its counts set to 0, and the ranges of its starts if it has any."""
    kind = value.get("kind") if isinstance(value, dict) else None
    require(isinstance(kind, str) and kind in BROKEN, "refuted.goal: not a kind that an orbit refutes")
    goal = dict(table(value, "refuted.goal", BROKEN[str(kind)][0], "from_anywhere starts"))
    counts: dict[str, Any] = {"reaches": {"throws": 0}, "flip_order": {"jogs": 0}}.get(str(kind), {})
    starts = goal.pop("starts", None)
    laid = None if starts is None else read_laid(table(starts, "refuted.starts", "within")["within"], n_sides)
    return counts | goal, laid


def read_passing(section: dict[str, Any], why: str, n_sides: int) -> dict[str, Any]:
    """Read an orbit that is thrown from its start: the start, and kappa and landing of each throw."""
    require({"start", "throws"} <= set(section), "refuted: start or throws are missing")
    start = table(section["start"], "refuted.start", "x side")
    throws = [read_throw(each) for each in rows(section["throws"], "refuted.throws", 1, MOST_THROWS)]
    spans = [number for number, (kappa, _) in enumerate(throws) if isinstance(kappa, tuple)]
    closes = why == "closed" and spans == [len(throws) - 1]
    last = not spans or not why or closes
    require(last, "two values of kappa are those of the throw that closes an orbit")
    x, side = hex_float(start["x"], "refuted.start.x"), read_side(start["side"], n_sides)
    return {"x": x, "side": side, "throws": throws}


def read_throw(value: object) -> tuple[Any, Any]:
    """Read kappa of a throw, or two values between which kappa lies, or None; and how far off it landed, or None."""
    one = table(value, "a throw", "kappa landing")
    kappa, landing = one["kappa"], one["landing"]
    if isinstance(kappa, list):
        low, high = (hex_float(end, "kappa") for end in rows(kappa, "kappa", 2, 2))
        require(low < high, "kappa is an empty interval")
        kappa = arb(low), arb(high)
    elif kappa is not None:
        kappa = arb(hex_float(kappa, "kappa"))
    return kappa, None if landing is None else arb(hex_float(landing, "landing"))


def check_deviations(scene: Scene, section: dict[str, Any]) -> None:
    """Check that the scene deviates from the nominal values by no more than the tolerance."""
    flat = dict(quantities(scene.raw))
    for name, text in section["tolerance"].items():
        square = name == "throw.speed" and "throw.kappa" in flat
        key = "throw.kappa" if square else name
        require(key in flat, f"refuted: {plain(name)} is not a quantity of the scene")
        q, nominal = quantity(flat[key], KINDS, key), quantity(section["nominal"][name], KINDS, key)
        dev = quantity(text, KINDS, "tolerance")
        require(dev.lo == dev.hi >= 0 and nominal.lo == nominal.hi, "refuted: a deviation is not one number")
        if square and dev.unit == "%":  # kappa deviates with the square of the speed
            require(dev.lo < 1, "refuted: a deviation of 100 %")
            ends = nominal.lo / (1 + dev.lo) ** 2, nominal.lo / (1 - dev.lo) ** 2
        elif dev.unit == "%":
            ends = nominal.lo * (1 - dev.lo), nominal.lo * (1 + dev.lo)
        else:
            require(not square and dev.pi == q.pi == nominal.pi, f"refuted: {plain(name)} is in another unit")
            ends = nominal.lo - dev.lo, nominal.lo + dev.lo
        within = q.pi == nominal.pi and min(ends) <= q.lo <= q.hi <= max(ends)
        why = f"{plain(name)} is not within {plain(text)} of {plain(section['nominal'][name])}"
        prove(within, why)


def check_refuted(scene: Scene, section: dict[str, Any]) -> None:
    """Throw the orbit again in balls, without the cells."""
    why, goal = section["why"], section["goal"]
    prove(bool(why), "it shows a passing orbit only: a goal is refuted by one that comes back")
    check_deviations(scene, section)
    once = goal["kind"] in ("stays_on_arm", "attracts_all")
    if once or (goal["kind"] == "oriented_beyond" and goal["anywhere"]):
        prove(why == "once", "an orbit that comes back is not what refutes this goal")
    else:
        every = "once is not enough: the goal does not speak of every throw from every start"
        prove(why != "once", every)
    states = periodic(scene, section["orbit"]) if why == "cycle" else thrown_again(scene, section)
    # an orbit that comes back begins with each of its states
    laid = is_laid_down(section["laid"], states[:1] if why == "once" else states)
    prove(laid, "no state of the orbit is proved to be one in which a part is laid down")
    if why == "once":
        check_left_or_beyond(scene, goal, states[-1])
        return
    prove(breaks(scene, goal, states), "no state of the orbit violates the goal")
    attracts = why == "cycle" and section["orbit"].attracts
    enough = goal["kind"] != "reaches" or goal["every"] or attracts
    prove(enough, "the goal speaks of almost every start, and the orbit is not proved to attract")


def is_laid_down(laid: list[list[Span]] | None, states: list[State]) -> bool:
    """Whether a state is proved to lie inside one of the ranges of its side, so that its neighbours lie there too.

    So does any where parts may be laid down everywhere.
    """
    return laid is None or any(
        bool(low > lo and high < hi) for side, low, high in states for lo, hi in laid[side]
    )


def periodic(scene: Scene, orbit: Orbit) -> list[State]:
    """Prove a periodic orbit of the scene without noise, which is one of the sequences allowed; return its states."""
    quiet = read_scene({**scene.raw, "effects": {}}, None)
    prove(all(s.concave for s in quiet.sides), "kappa > ell is not proved")
    states = prove_orbit(Throws(quiet), None, orbit).states
    for side, lo, hi in states:
        s = quiet.sides[side]
        prove(bool(lo > s.a and hi <= s.arm), "a point of the periodic orbit is not proved to lie on the arm")
    return states


def thrown_again(scene: Scene, section: dict[str, Any]) -> list[State]:
    """Prove every throw of an orbit, and that a closed orbit comes back exactly to its start; return the states."""
    side, x = section["side"], arb(section["x"])
    throws = Throws(scene)
    states = [(side, x, x)]
    for number, (said, landing) in enumerate(section["throws"], 1):
        s = scene.sides[side]
        prove(bool(x > s.a and x <= s.arm), f"the part does not lie on the arm before throw {number}")
        kappa = kappa_of_throw(scene, said, number)
        shift = ZERO if landing is None else landing
        prove(bool(abs(shift) <= s.landing), f"throw {number} lands farther off than the noise allows")
        images, branch = images_of_throw(throws, side, x, kappa, shift, number)
        side = (side + branch) % len(scene.sides)
        if number == len(section["throws"]) and section["why"] == "closed":
            prove(side == states[0][0], "the last throw ends on another side")
            back = comes_back(scene, states[0][1], images, landing)
            prove(back, "that the last throw comes back is not proved")
            return states
        x = images[0]
        states.append((side, x.lower(), x.upper()))
    return states


def kappa_of_throw(scene: Scene, said: Any, number: int) -> tuple[Any, ...]:
    """Return kappa of a throw, or for two values their union and both; all are proved to lie within the noise."""
    varies = isinstance(scene.noise, dict) and bool({"throw.speed", "gravity.tilt"} & set(scene.noise))
    kappa = said if isinstance(said, tuple) else () if said is None else (said,)
    prove(varies or not kappa, f"the kappa of throw {number} is not within the noise: it is known")
    prove(bool(kappa) or not varies, f"throw {number} does not say its kappa")
    for k in kappa:
        within = k > scene.k_lo * (1 + INSIDE) and k < scene.k_hi * (1 - INSIDE)
        prove(bool(within), f"the kappa of throw {number} is not within the noise")
    if len(kappa) > 1:
        return (kappa[0].union(kappa[1]), *kappa)
    return kappa or (scene.k_lo.union(scene.k_hi),)


def images_of_throw(
    throws: Throws, side: int, x: Arb, kappa: tuple[Any, ...], shift: Arb, number: int
) -> tuple[list[Arb], int]:
    """Enclose where a throw lands, for each kappa given, and return its branch, which is proved."""
    images = []
    for k in kappa:
        thrown = throws.box(side, x.lower(), x.upper(), k.lower(), k.upper())
        prove(thrown.decision != 2, f"the decision of throw {number} is not settled")
        turned = throws.scene.sides[side].shift if thrown.decision == 1 else ZERO
        images.append(thrown.lo.union(thrown.hi) + shift - turned)
    return images, thrown.decision


def comes_back(scene: Scene, start: Arb, images: list[Arb], landing: Arb | None) -> bool:
    """Whether a throw can land exactly on the start.

    The noise of the landing spans the distance from all of the enclosed place to the start; or the places for two
    values of kappa lie on either side of the start, and the place moves continuously with kappa as f is concave.
    """
    if len(images) == 1:
        return landing is None and bool(abs(images[0] - start) <= scene.sides[0].landing.lower())
    _, first, last = images
    parted = bool(first < start and last > start) or bool(first > start and last < start)
    return parted and all(s.concave for s in scene.sides)


def breaks(scene: Scene, goal: dict[str, Any], states: list[State]) -> bool:
    """Whether an orbit that comes back to its first state violates a goal, for all numbers in the balls."""
    if goal["kind"] == "flip_order":
        order, sides = goal["order"], [side for side, _, _ in states]
        allowed = set(zip(order, [*order[1:], order[0]], strict=True))
        flips = [(a, b) for a, b in itertools.pairwise([*sides, sides[0]]) if a != b]
        return bool(set(flips) - allowed) or (not flips and len(set(order)) > 1)
    x = goal["x"].ball() / exact(LENGTHS[scene.unit])
    if goal["kind"] == "oriented_beyond":
        return any(side != goal["side"] and bool(lo > x) for side, lo, _ in states)
    return all(side != goal["side"] or bool(hi < x) for side, _, hi in states)


def check_left_or_beyond(scene: Scene, goal: dict[str, Any], last: State) -> None:
    """Check that a state is off the arm, or beyond x on another side."""
    side, lo, hi = last
    s, ends = scene.sides[side], f"the orbit ends on side {side} at x = {lo.union(hi).str(12)}"
    if goal["kind"] == "oriented_beyond":
        prove(breaks(scene, goal, [last]) and hi <= s.arm, f"{ends}, which the goal allows")
    else:
        prove(hi <= s.a or lo > s.arm, f"{ends}, on the arm")


def statement_of_refutation(section: dict[str, Any]) -> str:
    """Put a refutation in words."""
    near = ", ".join(
        f"{plain(name)} within {quantity(dev, KINDS, 'tolerance')} of"
        f" {quantity(section['nominal'][name], KINDS, 'nominal')}"
        for name, dev in section["tolerance"].items()
    )
    goal = section["goal"]
    order = " ".join(map(str, goal.get("order", ())))
    broken = BROKEN[goal["kind"]][1].format(text=goal.get("text"), side=goal.get("side"), order=order)
    if section["why"] == "cycle":
        o = section["orbit"]
        of = "almost every start" if o.attracts else "every start"
        orbit = f"a periodic orbit, of {len(o.word)} throws, with a place x in [{o.lo!r}, {o.hi!r}] on side {o.side}"
        what = f"not from {of}: {orbit}, which {'attracts' if o.attracts else 'repels'}, {broken}"
    else:
        start = f"x = {section['x']!r} on side {section['side']}"
        number = f"{len(section['throws'])} throws"
        if section["why"] == "closed":
            what = (
                f"not for every sequence of throws: an orbit of {number} from {start} back to there {broken}"
            )
        else:
            what = f"not from every start on the arm: the orbit from {start}, of {number}, {broken}"
    laid = section["laid"]
    begins = (
        "" if laid is None else f"; one of its states lies where parts are laid down: {ranges_in_words(laid)}"
    )
    return f"refuted: {what}{begins}" + (f"; {near}" if near else "")
