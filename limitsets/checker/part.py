"""The part: where its sides lie, its centre of mass, and its radius of gyration.

docs/certificates.md, "What is claimed", names the parameters; docs/model.md has the geometry.
"""

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

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
    vertices = read_polygon(part, read)
    n = len(vertices)
    mass = part["mass"]
    if "plate_density" in mass:
        table(mass, "part.mass", "plate_density", "plate_thickness points")
        start, rho2 = read_plate(mass, vertices, unit, read)
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


def read_polygon(part: object, read: Callable[[object, str], Any]) -> list[tuple[Arb, Arb]]:
    """Read the vertices, counterclockwise; side i goes from vertex -i to vertex 1 - i (mod their number).

    So side 0 is the edge from vertex 0 to vertex 1, and the left vertex of side i is the right vertex of side i+1.
    """
    keys = table(part, "part", "mass", "sides vertices")
    require(("sides" in keys) != ("vertices" in keys), "part: either sides or vertices")
    require(isinstance(keys["mass"], dict), "part.mass is not an object")
    if "sides" in keys:
        three = rows(keys["sides"], "part.sides", 3, 3)
        base, left, right = (read(q, f"part.sides[{i}]") for i, q in enumerate(three))
        x = (base**2 + left**2 - right**2) / (2 * base)
        y2 = left**2 - x**2
        positive = all(bool(q > 0) for q in (base, left, right, y2))
        require(positive, "the sides form no triangle")
        vertices = [(ZERO, ZERO), (base, ZERO), (x, y2.sqrt())]
    else:
        pairs = [rows(v, "a vertex", 2, 2) for v in rows(keys["vertices"], "part.vertices", 3, 64)]
        vertices = [(read(x, "part.vertices"), read(y, "part.vertices")) for x, y in pairs]
    n = len(vertices)
    for k in range(n):
        (px, py), (ex, ey), _ = side_frame(vertices, -k)
        for j in set(range(n)) - {k, (k + 1) % n}:
            beyond = (vertices[j][1] - py) * ex - (vertices[j][0] - px) * ey
            require(bool(beyond > 0), "the vertices are not those of a convex polygon, counterclockwise")
    return vertices


def side_frame(vertices: list[tuple[Arb, Arb]], i: int) -> tuple[tuple[Arb, Arb], tuple[Arb, Arb], Arb]:
    """Return left end, unit vector to the right end, and length of side i."""
    n = len(vertices)
    left, right = vertices[-i % n], vertices[(1 - i) % n]
    dx, dy = right[0] - left[0], right[1] - left[1]
    long = (dx**2 + dy**2).sqrt()
    return left, (dx / long, dy / long), long


def read_plate(
    mass: dict[str, Any],
    vertices: list[tuple[Arb, Arb]],
    unit: Fraction,
    read: Callable[[object, str], Any],
) -> tuple[tuple[Arb, Arb], Arb]:
    """Compute centre of mass and squared radius of gyration of a uniform plate with points of mass on it."""
    area = sx = sy = second = ZERO
    for (x0, y0), (x1, y1) in zip(vertices, vertices[1:] + vertices[:1], strict=True):
        cross = x0 * y1 - x1 * y0
        area += cross / 2
        sx += (x0 + x1) * cross / 6
        sy += (y0 + y1) * cross / 6
        second += (x0 * x0 + x0 * x1 + x1 * x1 + y0 * y0 + y0 * y1 + y1 * y1) * cross / 12
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
        total, sx, sy, second = total + w, sx + w * x, sy + w * y, second + w * (x**2 + y**2)
    require(density.lo > 0 and bool(total > 0), "a mass is not positive")
    return (sx / total, sy / total), second / total - (sx / total) ** 2 - (sy / total) ** 2
