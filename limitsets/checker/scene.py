"""The scene: the part on the arm, kappa with its noise, and the tolerance that the boxes cover.

docs/certificates.md, "What is claimed": the exact scene, a tolerance, noise at every throw.
"""

import bisect
import copy
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from flint import arb

from .balls import HALF, ONE, ZERO, Arb, UnprovedError, exact, prove, reason_of, span
from .file import (
    KINDS,
    LENGTHS,
    Quantity,
    hex_float,
    plain,
    quantity,
    require,
    rows,
    table,
)
from .part import narrow_part

DEPTH = 12  # a cell is halved at most so often in x, so often in kappa, and so often in all else that is an interval
MOST_HALVES = 1_000  # pieces of a tolerance, for one check that is not of a cell
MOST_COMPARED = 20_000_000  # boxes that are looked at to see that they leave no gap
G0 = Fraction(980665, 100_000)


@dataclass(slots=True)
class Side:
    """The parameters of throws from one side, as balls (`small_d` is d in small-angle-2 and 0 otherwise)."""

    a: Arb
    d: Arb
    length: Arb
    h: Arb
    rho2: Arb
    arm: Arb
    exact: bool
    signed: bool
    concave: bool = False
    small_d: Arb = ZERO
    shift: Arb = ZERO  # R'(jog) - R'(flip) = a + L' - a'
    ell: Arb = ZERO
    hd: Arb = ZERO  # h + d
    landing: Arb = ZERO  # a part lands within this of where the throw would put it
    over_2m: Arb = ZERO
    floats: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)  # a, d, small_d, a past half a turn: for guesses only
    # the same four for the earliest impact, and for the latest: f has the term -a sin p, so that a large a hastens the
    # impact up to p = pi and delays it beyond
    early: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    late: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)


@dataclass(slots=True)
class Scene:
    """Enclosures of everything in a scene, with lengths in the unit of arm.length."""

    sides: list[Side]
    k_lo: Arb  # kappa at its smallest, noise included; both ends are exact points
    k_hi: Arb
    rho: Arb
    arm: tuple[Fraction, Fraction]
    unit: str
    raw: dict[str, Any] = field(default_factory=dict)  # the JSON of the scene
    noise: object = None  # the JSON of the noise
    end: Fraction | None = None  # where the arm ends in a cavity; landings are followed up to arm.length
    loose: float = 0.0  # the widths of all sides' enclosures together; 0 where `halves` cannot narrow them
    parts: "dict[tuple[str, int], list[Scene]]" = field(default_factory=dict)  # known halves

    def cuts(self) -> list[str]:
        """Name the intervals of part and arm that `halves` may halve; kappa and arm.length are not among them."""
        known = [(name, value) for name, value in quantities(self.raw) if name.startswith(("part.", "arm.s"))]
        again = [name for name, value in known if isinstance(value, Quantity) and value.lo < value.hi]
        return again + [name for name, value in known if isinstance(value, list)]

    def halves(self, of: str = "", side: int = 0) -> "list[Scene]":
        """Return two scenes that together hold this one, or [] if no quantity is an interval.

        The quantity that is halved is the one whose halves have the narrowest enclosures: of the "decision" or the
        "image" of one side, as `of` says, or of everything by default.  Not a_i or d_i are halved: they depend on each
        other and on the lengths.
        """
        key = (of, side)
        if self.loose > 0 and key not in self.parts:
            pairs = [[read_scene(raw, self.noise) for raw in halved(self.raw, name)] for name in self.cuts()]
            self.parts[key] = min(
                pairs, key=lambda pair: sum(half.width(of, side) for half in pair), default=[]
            )
        return self.parts.get(key, [])

    def width(self, of: str = "", side: int = 0) -> float:
        """Return the width of all enclosures, or of those in the decision or the image of one side."""
        if not of:
            return self.loose
        s = self.sides[side]
        balls = [s.a, s.d, s.h, self.rho] + ([s.shift] if of == "image" else [])
        return sum(float(ball.rad()) for ball in balls)


LISTS = re.compile(r"part\.(sides|vertices|mass\.points|holes(\[[0-9]+\]\.vertices)?)")
VERTEX = re.compile(r"part\.(holes\[[0-9]+\]\.)?vertices\[[0-9]+\]")


def quantities(value: object, where: str = "") -> Iterator[tuple[str, object]]:
    """Name every quantity of a scene, and the numbers of its holes."""
    if isinstance(value, dict):
        for key, inner in value.items():
            if where or key in ("part", "arm", "throw", "gravity"):
                yield from quantities(inner, f"{where}.{key}" if where else key)
    elif isinstance(value, list) and LISTS.fullmatch(where):
        for i, inner in enumerate(value):
            yield from quantities(inner, f"{where}[{i}]")
    elif isinstance(value, list) and VERTEX.fullmatch(where):
        yield from ((f"{where}.{key}", inner) for key, inner in zip("xy", value, strict=True))
    else:
        yield where, value


def is_exact(raw: dict[str, Any]) -> bool:
    """Whether no quantity of a scene is an interval."""
    return not any(isinstance(value, list) for _, value in quantities(raw))


def place_of(tree: Any, name: str) -> tuple[Any, Any]:
    """Find where a quantity stands: the object and its key, or the list and the number in it."""
    holder = at = None
    for word in re.findall(r"[^.\[\]]+", name):
        holder = tree
        at = word if isinstance(tree, dict) else int({"x": "0", "y": "1"}.get(word, word))
        tree = tree[at]
    return holder, at


def halved(raw: dict[str, Any], name: str) -> Iterator[dict[str, Any]]:
    """Yield a scene twice, with either half of one of its intervals."""
    node, at = place_of(raw, name)
    q = quantity(node[at], KINDS, name)
    middle = (q.lo + q.hi) / 2
    for half in (q._replace(hi=middle), q._replace(lo=middle)):
        tree = copy.deepcopy(raw)
        node, at = place_of(tree, name)
        node[at] = half
        yield tree


def check_by_halves(scene: Scene, check: Callable[..., None], *more: Any) -> None:
    """Check a statement about all parameters, half by half where the check fails for the whole."""
    stack, tried = [(scene, 0)], 0
    while stack:
        piece, depth = stack.pop()
        tried += 1
        reason = reason_of(check, piece, *more)
        if reason:
            parts = piece.halves() if depth < DEPTH and tried + len(stack) < MOST_HALVES else []
            prove(bool(parts), reason)
            stack += [(half, depth + 1) for half in parts]


def read_scene(raw: object, noise: object) -> Scene:
    """Enclose a_i, d_i, L_i, rho, kappa, h and the arm's length from the decimals of a scene."""
    scene = table(
        raw, "scene", "part arm throw model", "name gravity goal cavity tray feedback world tolerance effects"
    )
    check_spread(scene, noise)
    arm = table(scene["arm"], "arm", "surface_height length")
    reach = quantity(arm["length"], "length", "arm.length")
    unit = LENGTHS[reach.unit]
    rests, rho = narrow_part(scene["part"], unit)
    require(bool(rho > 0), "the radius of gyration is not positive")
    k_lo, k_hi = read_kappa(scene, noise, unit)
    require(float(k_lo) > 0.0 and float(k_hi) < math.inf, "throw: kappa is no ordinary number")
    scatter = read_noise(noise, "landing.x", "length").ball() / exact(unit)
    flight, flip = read_model(scene["model"])
    require(reach.lo > 0, "arm.length is not positive")
    height = quantity(arm["surface_height"], "length", "arm.surface_height")
    h, ends = span(height.lo / unit, height.hi / unit), (reach.lo / unit, reach.hi / unit)
    sides = []
    for i, (a, d, long, shift) in enumerate(rests):
        require(bool(a > 0) and bool(a < long) and bool(d > 0), f"the part does not rest on side {i}")
        side = Side(
            a, d, long, h=h, rho2=rho * rho, arm=span(*ends), exact=flight == "exact", signed=flip == "signed"
        )
        side.shift, side.landing = shift, scatter
        side.small_d = d if flight == "small-angle-2" else ZERO
        complete(side, k_lo)
        sides.append(side)
    require(all(bool(k_lo > side.small_d) for side in sides), "small-angle-2 needs kappa > d")
    whole = Scene(sides, k_lo, k_hi, rho=rho, arm=ends, unit=reach.unit, raw=scene, noise=noise)
    whole.end = read_end(scene.get("cavity"), unit)
    if whole.cuts():
        whole.loose = sum(float(ball.rad()) for s in sides for ball in (s.a, s.d, s.h, s.shift, whole.rho))
    return whole


def read_end(cavity: object, unit: Fraction) -> Fraction | None:
    """Read where the arm ends, in the unit of arm.length; what the cavity is like beyond is not looked at."""
    if cavity is None:
        return None
    known = table(cavity, "cavity", "position", "width depth angle vertices outline play side tips")
    end = quantity(known["position"], "length", "cavity.position")
    require(end.lo == end.hi > 0, "cavity.position is not one number above 0")
    return end.lo / unit


def read_model(value: object) -> tuple[str, str]:
    """Read flight and flip of the model."""
    model = table(value, "model", "flight flip")
    flight, flip = model["flight"], model["flip"]
    known = flight in ("exact", "small-angle", "small-angle-2") and flip in ("signed", "energy")
    require(known, "the model is not one that is known")
    return flight, flip


def complete(side: Side, k_lo: Arb) -> None:
    """Fill in the parameters that follow from the others."""
    side.ell = (side.a**2 + side.d**2).sqrt()
    side.hd = side.h + side.d
    side.over_2m = HALF / (side.rho2 + side.ell**2)
    side.concave = bool(k_lo > side.ell) or not side.exact
    a_lo, a, a_hi = (float(end) for end in (side.a.lower(), side.a.mid(), side.a.upper()))
    side.floats = (a, float(side.d.mid()), float(side.small_d.mid()), a)
    side.early = (a_hi, float(side.d.lower()), float(side.small_d.lower()), a_lo)
    side.late = (a_lo, float(side.d.upper()), float(side.small_d.upper()), a_hi)


FACTS = ("friction", "restitution", "bounce_threshold", "stroke")
WORLD = " ".join((*FACTS, "throw_rate", "scatter", "other"))
NONE = Quantity(Fraction(0), Fraction(0), False, "")
SCATTER = {"speed": ("throw.speed", "share speed"), "landing": ("landing.x", "length")}


def read_noise(noise: object, name: str, kinds: str) -> Quantity:
    """Read by how much a quantity varies from throw to throw: a share of the quantity where the unit is %."""
    if noise is None:
        return NONE
    known = table(noise, "noise", "", "throw.speed gravity.tilt landing.x")
    require(len(known) > 0, "noise of nothing")
    dev = quantity(known[name], kinds, f"noise of {name}") if name in known else NONE
    require(dev.lo == dev.hi >= 0, "noise is not a number that is not negative")
    return dev


def check_spread(scene: dict[str, Any], noise: object) -> None:
    """Check that the scene has no effect but a bounded spread, and that the spread is in the noise claimed."""
    effects = scene.get("effects", {})
    on = (
        {name: how for name, how in effects.items() if how}
        if isinstance(effects, dict)
        else {"effects": True}
    )
    known = set(on) <= {"spread"} and on.get("spread", "bounded") == "bounded"
    require(known, "scene: effects are switched on, which the throw map, version 1, has not")
    more = not_in_noise(scene, noise)
    require(not on or not more, f"scene: its spread scatters {more}, which is not in the noise claimed")


def not_in_noise(scene: dict[str, Any], noise: object) -> str:
    """Return what the scene scatters at every throw by more than the noise claimed, or ""."""
    world = table(scene.get("world") or {}, "scene.world", "", WORLD)
    others(world)
    more = ""
    for word, text in table(world.get("scatter") or {}, "scene.world.scatter", "", "speed landing").items():
        name, kinds = SCATTER[word]
        scatter, claimed = (
            quantity(text, kinds, f"scene.world.scatter.{word}"),
            read_noise(noise, name, kinds),
        )
        require(scatter.lo == scatter.hi >= 0, "scene.world.scatter is not a number that is not negative")
        alike = (scatter.unit == "%", scatter.pi) == (claimed.unit == "%", claimed.pi)
        covered = scatter.lo == 0 or (alike and scatter.lo <= claimed.lo)
        more = more if covered or more else f"{name} by {scatter}"
    return more


def others(world: dict[str, Any]) -> list[str]:
    """Name the facts of other models: by names that this map has not; their values change nothing here."""
    known = world.get("other", {})
    require(isinstance(known, dict), "scene.world.other is not an object")
    for name, value in known.items():
        fits = re.fullmatch("[a-z][a-z0-9_]{0,39}", name) and name not in WORLD.split()
        require(bool(fits), f"scene.world.other: {plain(name)} is no name of another fact")
        if type(value) not in (int, float):
            quantity(value, KINDS, f"scene.world.other.{name}")
    return [*known]


def left_out(scene: dict[str, Any], noise: object) -> list[str]:
    """Name the facts of [world] that the throw map, version 1, has not: all but the rate of throws, which moves none.

    A coefficient of restitution of 0 is the map's own landing; scatter counts where it is not in the noise claimed.
    """
    world = scene.get("world") or {}
    plain_landing = world.get("restitution") == 0
    stated = [fact for fact in FACTS if world.get(fact) is not None]
    facts = [f for f in stated if not (plain_landing and f in ("restitution", "bounce_threshold"))]
    return facts + others(world) + (["scatter"] if not_in_noise(scene, noise) else [])


def share_and_more(dev: Quantity) -> tuple[Arb, Arb]:
    """Return a deviation as a share of the quantity and as an amount in its unit; one of the two is 0."""
    return (dev.ball(), ZERO) if dev.unit == "%" else (ZERO, dev.ball())


def tilted(tilts: list[Arb], dev: Quantity) -> list[Arb]:
    """Return the least and largest tilt with noise, proved to lie between 0 and 90 degrees, where the sine rises."""
    share, more = share_and_more(dev)
    ends = [tilts[0] * (1 - share) - more, tilts[1] * (1 + share) + more]
    steep = bool(ends[0] > 0) and bool(ends[1] < arb.pi() / 2)
    require(steep, "gravity.tilt is not between 0 and 90 degrees")
    return ends


def read_kappa(scene: dict[str, Any], noise: object, unit: Fraction) -> tuple[Arb, Arb]:
    """Enclose the smallest and largest kappa = g/w^2, with all noise, from below and from above by points.

    Where kappa is given the noise of the tilt multiplies it by sin(tilt') / sin(tilt).  With a share s that is
    sin((1 +- s) t) / sin(t), whose logarithm has the slope (1 +- s) cot((1 +- s) t) - cot(t), and u cot(u t) falls with
    u; with an amount m it is cos(m) +- cot(t) sin(m).  Both are farthest from 1 at the smallest tilt allowed.
    """
    throw = table(scene["throw"], "throw", "", "kappa speed")
    require(len(throw) == 1, "throw: either kappa or speed")
    gravity = table(scene.get("gravity", {}), "gravity", "", "acceleration tilt")
    share, more = share_and_more(read_noise(noise, "throw.speed", "share speed"))
    require(bool(share < 1), "noise reaches 100 %")
    dev = read_noise(noise, "gravity.tilt", "share angle")
    require("tilt" in gravity or dev is NONE, "noise of gravity.tilt needs a tilt")
    if "kappa" in throw:
        q = quantity(throw["kappa"], "length", "throw.kappa")
        require(q.lo > 0, "throw.kappa is not positive")
        require(bool(more == 0), "noise with a unit needs throw.speed")
        less = greater = ONE
        if dev is not NONE:
            tilts = quantity(gravity["tilt"], "angle", "gravity.tilt").ends()
            tilted(tilts, dev)
            less, greater = (end.sin() / tilts[0].sin() for end in tilted([tilts[0], tilts[0]], dev))
        lo = exact(q.lo / unit) * less / (1 + share) ** 2
        hi = exact(q.hi / unit) * greater / (1 - share) ** 2
        return lo.lower(), hi.upper()
    require(len(gravity) == 1, "gravity: either acceleration or tilt")
    if "tilt" in gravity:
        tilts = quantity(gravity["tilt"], "angle", "gravity.tilt").ends()
        g = [exact(G0 / unit) * tilt.sin() for tilt in tilted(tilts, dev)]
    else:
        g = [end / exact(unit) for end in quantity(gravity["acceleration"], "acceleration", "gravity").ends()]
    speeds = quantity(throw["speed"], "speed", "throw.speed").ends()
    slow, fast = speeds[0] * (1 - share) - more, speeds[1] * (1 + share) + more
    require(bool(g[0] > 0) and bool(slow > 0), "gravity and throw.speed must be positive")
    return (g[0] / fast**2).lower(), (g[1] / slow**2).upper()


def check_parameters(scene: Scene, said: object, where: str) -> None:
    """Check that each enclosure lies inside the interval that the producer computed with.

    No proof rests on this check, which only finds files that were put together wrongly: so a little slack is allowed.
    """
    names = "a d length kappa surface_height arm_length radius_of_gyration"
    said = table(said, f"{where} parameters", names)
    first = scene.sides[0]
    mine: dict[str, list[Arb]] = {key: [getattr(s, key) for s in scene.sides] for key in ("a", "d", "length")}
    mine |= {"kappa": [scene.k_lo.union(scene.k_hi)], "surface_height": [first.h], "arm_length": [first.arm]}
    mine["radius_of_gyration"] = [scene.rho]
    for key, balls in mine.items():
        pairs = rows(said[key], key, len(balls), len(balls)) if key in ("a", "d", "length") else [said[key]]
        for i, (ball, pair) in enumerate(zip(balls, pairs, strict=True)):
            lo, hi = (arb(hex_float(text, key)) for text in rows(pair, key, 2, 2))
            # a ball's radius has 30 bits; and over a tolerance a ball may be wider than the producer's interval
            slack = (hi - lo) * 2.0**-10 + (abs(hi) * 2.0**-26 if scene.loose > 0 else ZERO)
            if not (ball >= lo - slack and ball <= hi + slack):
                own, limits = ball.str(17), f"[{lo.str(17)}, {hi.str(17)}]"
                raise UnprovedError(f"parameter {key} {i}: the scene gives {own}, not in {limits}")


Ends = list[tuple[Fraction, Fraction]]


def check_tolerance(raw: list[Any], tolerance: object) -> tuple[dict[str, str], str]:
    """Check that the boxes cover the tolerance: the range of each quantity for people; "" or the reason.

    The boxes agree in everything but the quantities named.  Together they cover the smallest box that holds all of
    them, and that box must be as wide as the tolerance around some middle.
    """
    if tolerance is None:
        require(len(raw) == 1, "several boxes need a tolerance")
        return {}, ""
    require(isinstance(tolerance, dict) and 0 < len(tolerance) <= 64, "tolerance is not an object")
    assert isinstance(tolerance, dict)
    flat = [dict(quantities(scene)) for scene in raw]
    ranges: dict[str, list[Quantity]] = {}
    covered_values: dict[str, str] = {}
    for name, text in tolerance.items():
        dev = quantity(text, KINDS, "tolerance")
        key, own = values_in_boxes(flat, name, dev)
        require(key not in ranges, "tolerance names one quantity twice")
        ranges[key] = own
        lo, hi = hull(own)
        covered_values[key] = (
            str(own[0]._replace(lo=lo, hi=hi)) if lo < hi else f"every value in [{own[0]}, {own[0]}]"
        )
        if not covers_deviation(dev, own[0], lo, hi, name, key):
            return covered_values, f"the boxes do not cover the tolerance of {plain(name)}"
    if not same_but_for(list(ranges), raw, flat):
        return covered_values, "the boxes differ in something else than the tolerance"
    boxes = [[(own[b].lo, own[b].hi) for own in ranges.values()] for b in range(len(raw))]
    if not covered([hull(own) for own in ranges.values()], boxes):
        return covered_values, "the boxes leave a gap in the tolerance"
    return covered_values, ""


def hull(values: list[Quantity]) -> tuple[Fraction, Fraction]:
    """Return the ends of the smallest interval that holds all values."""
    return min(q.lo for q in values), max(q.hi for q in values)


def values_in_boxes(flat: list[dict[str, object]], name: str, dev: Quantity) -> tuple[str, list[Quantity]]:
    """Find the quantity that a tolerance names, and its values in all boxes.

    A tolerance of throw.speed is one of throw.kappa where the scene gives kappa.
    """
    key = "throw.kappa" if name == "throw.speed" and "throw.kappa" in flat[0] else name
    known = all(key in f for f in flat) and dev.lo == dev.hi >= 0
    require(known, f"tolerance: {plain(name)} is not understood")
    own = [quantity(f[key], KINDS, key) for f in flat]
    require(len({q.pi for q in own}) == 1, f"{plain(key)}: mixes degrees and radians")
    return key, own


def covers_deviation(dev: Quantity, value: Quantity, lo: Fraction, hi: Fraction, name: str, key: str) -> bool:
    """Whether [lo, hi] holds every deviation up to `dev` from some middle; kappa deviates with the speed's square."""
    if dev.unit == "%":
        lo, hi = (lo, hi) if lo > 0 else (-hi, -lo)
        power = 2 if key != name else 1
        return dev.lo < 1 and lo > 0 and lo * (1 + dev.lo) ** power <= hi * (1 - dev.lo) ** power
    require(key == name and dev.pi == value.pi, f"tolerance of {plain(name)} is in another unit")
    return hi - lo >= 2 * dev.lo


def same_but_for(names: list[str], raw: list[Any], flat: list[dict[str, object]]) -> bool:
    """Whether all boxes have the same scene, but for the quantities named."""
    rest = [{key: value for key, value in f.items() if key not in names} for f in flat]
    alike = ("model", "goal", "cavity", "tray", "feedback", "world", "tolerance", "effects")
    return all(
        r == rest[0] and all(scene.get(key) == raw[0].get(key) for key in alike)
        for r, scene in zip(rest, raw, strict=True)
    )


def covered(whole: Ends, boxes: list[Ends]) -> bool:
    """Whether boxes cover a box, exactly.

    The box lies in one of them, or it is cut at an end of one of them and both parts are covered.  A box that is a
    point along an axis lies in a box that only touches it there.
    """
    stack, looked = [(whole, boxes)], 0
    while stack:
        region, some = stack.pop()
        looked += len(some)
        require(looked <= MOST_COMPARED, "too many boxes")
        if any(holds(box, region) for box in some):
            continue
        best = best_cut(region, some)
        if best is None:
            return False
        axis, cut = best
        for part in ((region[axis][0], cut), (cut, region[axis][1])):
            inner = [*region[:axis], part, *region[axis + 1 :]]
            stack.append((inner, [box for box in some if overlaps(box, inner)]))
    return True


def holds(box: Ends, region: Ends) -> bool:
    """Whether a region lies in a box."""
    return all(lo <= a and b <= hi for (a, b), (lo, hi) in zip(region, box, strict=True))


def overlaps(box: Ends, region: Ends) -> bool:
    """Whether a box and a region have inner points in common, along every axis along which the region has some."""
    return all((lo < b and a < hi) or a == b for (a, b), (lo, hi) in zip(region, box, strict=True))


def best_cut(region: Ends, some: list[Ends]) -> tuple[int, Fraction] | None:
    """Choose the axis and the place of a cut that leaves the fewest boxes on both sides; None if no box ends inside."""
    best: tuple[int, int] | None = None
    where: tuple[int, Fraction] | None = None
    for axis, (a, b) in enumerate(region):
        lows, highs = sorted(box[axis][0] for box in some), sorted(box[axis][1] for box in some)
        for cut in {end for ends in (lows, highs) for end in ends if a < end < b}:
            both = bisect.bisect_left(lows, cut) - bisect.bisect_right(highs, cut)
            uneven = max(bisect.bisect_left(lows, cut), len(some) - bisect.bisect_right(highs, cut))
            if best is None or (both, uneven) < best:
                best, where = (both, uneven), (axis, cut)
    return where
