"""The part: where its sides lie, its centre of mass, and its radius of gyration.

docs/certificates.md, "What is claimed", names the parameters; docs/model.md has the geometry.
"""

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from itertools import product
from typing import Any

from flint import arb

from .balls import ONE, ZERO, Arb, Centred, centred, exact, span
from .file import quantity, require, rows, table


def ends_of(value: object, where: str, unit: Fraction) -> tuple[Fraction, Fraction]:
    """Read a length of the part in the scene's unit, or a mass in kg: its least and its largest value."""
    kind, by = ("mass", Fraction(1)) if where.endswith(".mass") else ("length", unit)
    q = quantity(value, kind, where)
    return q.lo / by, q.hi / by


def narrow_part(part: object, unit: Fraction) -> tuple[list[tuple[Any, ...]], Arb]:
    """Enclose (a_i, d_i, L_i, a_i + L_next - a_next) of every side, and rho.

    A formula that names an interval twice gives too wide a ball; the mean value theorem gives a narrower one.
    """
    wide, plain_rests, rho = read_wide(part, unit)
    if not wide:
        return plain_rests, rho
    balls = [span(lo, hi) for _, lo, hi in wide.values()]
    middles = [exact((lo + hi) / 2) for _, lo, hi in wide.values()]
    off = [ball - middle for ball, middle in zip(balls, middles, strict=True)]
    numbers = dict(zip(wide, centred(middles, balls, off), strict=True))

    def ball_of(f: Any, known: Arb) -> Arb:
        return f.x.intersection(known) if isinstance(f, Centred) and f.x.is_finite() else known

    rests, narrow_rho = part_with(part, unit, numbers)
    rows_of_sides = zip(rests, plain_rests, strict=True)
    return [tuple(map(ball_of, *both)) for both in rows_of_sides], ball_of(narrow_rho, rho)


def part_with(part: object, unit: Fraction, numbers: Mapping[int, Any]) -> tuple[list[tuple[Any, ...]], Any]:
    """Compute what `read_part` does with some numbers of the part given by id, in their arithmetic."""

    def read(value: object, where: str) -> Any:
        return numbers[id(value)] if id(value) in numbers else span(*ends_of(value, where, unit))

    return read_part(part, unit, read)


def read_wide(
    part: object, unit: Fraction
) -> tuple[dict[int, tuple[str, Fraction, Fraction]], list[tuple[Any, ...]], Arb]:
    """Read a part in balls; before it by id, as they are read, the numbers that are intervals: name and ends."""
    wide: dict[int, tuple[str, Fraction, Fraction]] = {}

    def look(value: object, where: str) -> Arb:
        lo, hi = ends_of(value, where, unit)
        if lo < hi:
            wide.setdefault(id(value), (where, lo, hi))
        return span(lo, hi)

    return wide, *read_part(part, unit, look)


def read_part(
    part: Any, unit: Fraction, read: Callable[[object, str], Any]
) -> tuple[list[tuple[Any, ...]], Any]:
    """Compute (a_i, d_i, L_i, a_i + L_next - a_next) of every side, and rho, in the arithmetic of `read`."""
    outline, corners = read_polygon(part, read, unit)
    vertices = [outline[k] for k in corners]
    n = len(vertices)
    mass = part["mass"]
    if "plate_density" in mass:
        table(mass, "part.mass", "plate_density", "plate_thickness points")
        start, rho2 = read_plate(part, outline, unit, read)
        (ex, ey), along, above, rho, own = (ONE, ZERO), ZERO, ZERO, rho2.sqrt(), -1
    else:
        table(mass, "part.mass", "center radius_of_gyration")
        center = table(mass["center"], "part.mass.center", "side along above")
        fits = type(center["side"]) is int and 0 <= center["side"] < n
        require(fits, "part.mass.center.side is not a side")
        along = read(center["along"], "part.mass.center.along")
        above = read(center["above"], "part.mass.center.above")
        own = center["side"]
        start, (ex, ey), _ = side_frame(vertices, own)
        rho = read(mass["radius_of_gyration"], "part.mass.radius_of_gyration")
    rests = []
    for i in range(n):
        (px, py), (ux, uy), long = side_frame(vertices, i)
        x, y = start[0] - px, start[1] - py
        with_e, across_e = ex * ux + ey * uy, ux * ey - uy * ex
        a = x * ux + y * uy + along * with_e - above * across_e  # the centre is start + along e + above n
        d = ux * y - uy * x + along * across_e + above * with_e
        # with a tolerance a number of the scene is narrower than the same number computed
        a, d = (along, above) if i == own else (a, d)
        long = read(part["sides"][i], "part.sides") if "sides" in part else long
        rests.append((a, d, long))
    after = rests[1:] + rests[:1]
    return [(a, d, long, a + ll - aa) for (a, d, long), (aa, _, ll) in zip(rests, after, strict=True)], rho


def read_polygon(
    part: object, read: Callable[[object, str], Any], unit: Fraction
) -> tuple[list[tuple[Arb, Arb]], list[int]]:
    """Read the outline, counterclockwise, and which of its vertices are corners of its convex hull, on which it rests.

    Side i of the hull goes from its corner -i to its corner 1 - i (mod their number).  So side 0 is the edge from
    corner 0 to corner 1, and the left vertex of side i is the right vertex of side i+1.
    """
    keys = table(part, "part", "mass", "sides vertices holes")
    require(("sides" in keys) != ("vertices" in keys), "part: either sides or vertices")
    require(isinstance(keys["mass"], dict), "part.mass is not an object")
    require("holes" not in keys or "plate_density" in keys["mass"], "part.holes: of a plate alone")
    if "sides" in keys:
        three = rows(keys["sides"], "part.sides", 3, 3)
        base, left, right = (read(q, f"part.sides[{i}]") for i, q in enumerate(three))
        x = (base * base + left * left - right * right) / (2 * base)
        y2 = left * left - x * x
        positive = all(bool(q > 0) for q in (base, left, right, y2))
        require(positive, "the sides form no triangle")
        outline, corners = [(ZERO, ZERO), (base, ZERO), (x, y2.sqrt())], [0, 1, 2]
    else:
        pairs = [rows(v, "a vertex", 2, 2) for v in rows(keys["vertices"], "part.vertices", 3, 1000)]
        outline = [(read(x, "part.vertices"), read(y, "part.vertices")) for x, y in pairs]
        corners = list(range(len(pairs)))
        if "plate_density" in keys["mass"]:
            corners = hull_of([[ends_of(each, "part.vertices", unit) for each in pair] for pair in pairs])
    require(3 <= len(corners) <= 256, "the hull of the part has fewer than 3 or more than 256 corners")
    vertices = [outline[k] for k in corners]
    n = len(vertices)
    for k in range(n):
        (px, py), (ex, ey), _ = side_frame(vertices, -k)
        for j in set(range(n)) - {k, (k + 1) % n}:
            beyond = (vertices[j][1] - py) * ex - (vertices[j][0] - px) * ey
            require(bool(beyond > 0), "the vertices are not those of a convex polygon, counterclockwise")
    return outline, corners


CoordinateEnds = tuple[Fraction, Fraction]
VertexEnds = Sequence[CoordinateEnds]  # least and largest x, least and largest y of a vertex


def hull_of(places: Sequence[VertexEnds]) -> list[int]:
    """Find the corners of the convex hull, ascending: no other vertex lies beyond one of its sides, exactly.

    Their candidates are those of the middles.
    """
    middles = [tuple((lo + hi) / 2 for lo, hi in place) for place in places]
    order = sorted(range(len(places)), key=lambda k: middles[k])
    corners: list[int] = []
    for way in (order, order[::-1]):
        chain: list[int] = []
        for k in way:
            while len(chain) > 1 and cross_of(*(middles[j] for j in (*chain[-2:], k))) <= 0:
                chain.pop()
            chain.append(k)
        corners += chain[:-1]
    start = corners.index(min(corners))
    corners = corners[start:] + corners[:start]
    require(corners == sorted(corners), "the outline of the part is not counterclockwise")
    for left, right in zip(corners, corners[1:] + corners[:1], strict=True):
        for k in set(range(len(places))) - set(corners):
            within = least_cross(places[left], places[right], places[k]) >= 0
            require(within, f"vertex {k} of the part may lie beyond its convex hull")
    return corners


def least_cross(start: VertexEnds, end: VertexEnds, place: VertexEnds) -> Fraction:
    """Bound the cross product of vertices that are known to ends: by its terms, and only where that is below 0 exactly.

    It is affine in each coordinate, so its least value is that at one of the corners of the box.
    """

    def product_of(
        a: CoordinateEnds, b: CoordinateEnds, c: CoordinateEnds, d: CoordinateEnds
    ) -> list[Fraction]:
        """Give the products of the ends of b - a and of d - c."""
        return [x * y for x in (b[0] - a[1], b[1] - a[0]) for y in (d[0] - c[1], d[1] - c[0])]

    ahead = product_of(start[0], end[0], start[1], place[1])
    aside = product_of(start[1], end[1], start[0], place[0])
    least = min(ahead) - max(aside)
    if least < 0:
        box = [set(ends) for vertex in (start, end, place) for ends in vertex]
        least = min(cross_of(at[:2], at[2:4], at[4:]) for at in product(*box))
    return least


def cross_of(start: Sequence[Fraction], end: Sequence[Fraction], place: Sequence[Fraction]) -> Fraction:
    """Compute twice the area of a triangle, positive where the place lies left of the way from start to end."""
    return (end[0] - start[0]) * (place[1] - start[1]) - (end[1] - start[1]) * (place[0] - start[0])


def side_frame(vertices: list[tuple[Arb, Arb]], i: int) -> tuple[tuple[Arb, Arb], tuple[Arb, Arb], Arb]:
    """Return left end, unit vector to the right end, and length of side i."""
    n = len(vertices)
    left, right = vertices[-i % n], vertices[(1 - i) % n]
    dx, dy = right[0] - left[0], right[1] - left[1]
    long = (dx * dx + dy * dy).sqrt()  # in Arb the power of a ball around 0 is nan
    return left, (dx / long, dy / long), long


def read_plate(
    part: dict[str, Any],
    outline: list[tuple[Arb, Arb]],
    unit: Fraction,
    read: Callable[[object, str], Any],
) -> tuple[tuple[Arb, Arb], Arb]:
    """Compute centre of mass and squared radius of gyration of a uniform plate with holes and points of mass on it."""
    mass = part["mass"]
    area, sx, sy, second = moments_of(outline)
    require(bool(area > 0), "the outline of the part is not counterclockwise")
    for k, hole in enumerate(rows(part.get("holes", []), "part.holes", 0, 1000)):
        taken = hole_of(hole, f"part.holes[{k}]", unit)
        require(bool(taken[0] > 0), f"part.holes[{k}] is not counterclockwise, or empty")
        area, sx, sy, second = (
            whole - less for whole, less in zip((area, sx, sy, second), taken, strict=True)
        )
    require(bool(area > 0), "the holes are larger than the part")
    thick = "plate_thickness" in mass
    density = quantity(mass["plate_density"], "bulk" if thick else "density", "part.mass.plate_density")
    weight = density.ball() * exact(unit) ** 2
    if thick:
        thickness = quantity(mass["plate_thickness"], "length", "part.mass.plate_thickness")
        require(thickness.lo > 0, "part.mass.plate_thickness is not positive")
        weight = weight * thickness.ball()
    total, sx, sy, second = weight * area, weight * sx, weight * sy, weight * second
    for point in rows(mass.get("points", []), "part.mass.points", 0, 1000):
        table(point, "part.mass.points", "x y mass")
        x, y = (read(point[key], f"part.mass.points.{key}") for key in "xy")
        w = read(point["mass"], "part.mass.points.mass")
        require(w > 0, "a mass is not positive")
        total, sx, sy, second = total + w, sx + w * x, sy + w * y, second + w * (x * x + y * y)
    require(density.lo > 0 and bool(total > 0), "a mass is not positive")
    x, y = sx / total, sy / total
    return (x, y), second / total - x * x - y * y


def moments_of(vertices: list[tuple[Arb, Arb]]) -> tuple[Arb, Arb, Arb, Arb]:
    """Compute area, first moments and polar second moment of a polygon about the origin."""
    area = sx = sy = second = ZERO
    for (x0, y0), (x1, y1) in zip(vertices, vertices[1:] + vertices[:1], strict=True):
        cross = x0 * y1 - x1 * y0
        area += cross / 2
        sx += (x0 + x1) * cross / 6
        sy += (y0 + y1) * cross / 6
        second += (x0 * x0 + x0 * x1 + x1 * x1 + y0 * y0 + y0 * y1 + y1 * y1) * cross / 12
    return area, sx, sy, second


def hole_of(hole: object, where: str, unit: Fraction) -> tuple[Arb, Arb, Arb, Arb]:
    """Compute area and moments of a hole: a circle, or a polygon."""

    def length(value: object) -> Arb:
        lo, hi = ends_of(value, where, unit)
        require(lo == hi, f"{where} is an interval")
        return span(lo, hi)

    keys = table(hole, where, "", "center diameter vertices")
    if "vertices" in keys:
        require(len(keys) == 1, f"{where}: vertices alone, or center and diameter")
        pairs = [rows(v, where, 2, 2) for v in rows(keys["vertices"], where, 3, 1000)]
        return moments_of([(length(x), length(y)) for x, y in pairs])
    require(len(keys) == 2, f"{where}: vertices alone, or center and diameter")
    center = table(keys["center"], f"{where}.center", "x y")
    x, y, diameter = length(center["x"]), length(center["y"]), length(keys["diameter"])
    require(bool(diameter > 0), f"{where}.diameter is not positive")
    area = arb.pi() * diameter * diameter / 4
    return area, area * x, area * y, area * (x * x + y * y + diameter * diameter / 8)
