"""Hard cases of one throw: each row a case, held against balls of 90 digits and the error that is allowed."""

from __future__ import annotations

import math

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.feeder.thrower import fly, throw_map, trace
from limitsets.systems.cells import Domain
from limitsets.systems.maps import drivers
from limitsets.systems.maps.critical import margins

flint = pytest.importorskip("flint", reason="the balls of python-flint are the reference")
from tests.thrower import exhaustive  # noqa: E402  # needs flint
from tests.thrower.exhaustive import Part, arb  # noqa: E402  # needs flint

ULPS = 4.0  # allowed, times the condition number


@pytest.fixture(autouse=True)
def digits():
    with flint.ctx.workprec(exhaustive.PRECISION):
        yield


def ulps(exact: arb, found: float) -> float:
    """Error in units of the last place of the exact value."""
    return abs(float((exact - arb(found)).mid())) / math.ulp(float(exact.mid()))


def check(part: Part, x: float) -> exhaustive.Exact | None:
    """One throw: angle, displacement, decision, and x' as the rounded sum of x and the displacement told."""
    params = throw_map(**part.numbers())
    exact, what = exhaustive.throw(part, x), (part, x)
    found = maps.images(params, [x], 0)
    if exact is None:
        assert (found.code[0], found.side[0], found.x[0]) == (maps.OUTSIDE_MODEL, 0, x), what
        assert np.isnan(margins(params, [x], 0)).all(), what
        return None
    assert ulps(exact.phi, fly(params, x, 0).phi) <= ULPS * exact.phi_condition, what
    told = trace(params, x, 0).displacement
    assert told.size == 0 or found.x[0] == x + told[0], what
    shift = drivers.displacements(params, [x], 0)[0]
    assert found.x[0] == x + shift, what
    margin = float(exact.margin.mid())
    if abs(margin) > 1e-12 * exact.phi_condition * (part.kappa + part.rho):
        assert found.side[0] == (1 if exact.flips else 0), what
        assert ulps(exact.displacement, shift) <= ULPS * exact.displacement_condition, what
    return exact


# ---------------------------------------------------------------- three regimes of kappa, down to the vertex

SHAPES = {"broad": (2.0, 1.0), "tall": (1.0, 2.0), "needle upright": (0.01, 5.0), "needle flat": (5.0, 0.01)}
# The centre of mass all but over the left vertex: for kappa = d a march with a fixed bound would take 1e10 steps.
OVER_THE_VERTEX = (1e-12, 1.0)


def regimes(a: float, d: float) -> dict[str, float]:
    ell = math.hypot(a, d)
    return {
        "1e-6": 1e-6,
        "below d": 0.6 * d,
        "just below d": d * (1.0 - 1e-9),
        "d": d,
        "next to d": math.nextafter(d, math.inf),
        "just above d": d * (1.0 + 1e-6),
        "between d and ell": 0.5 * (d + ell),
        "just below ell": math.nextafter(ell, 0.0),
        "just above ell": math.nextafter(ell, math.inf),
        "above ell": 3.0 * ell,
        "1e6": 1e6,
        "1e12": 1e12,
    }


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("regime", regimes(2.0, 1.0))
def test_every_regime_from_the_vertex_outwards(shape: str, regime: str) -> None:
    """By the signed flip where the part is broad, by the energy where it is tall: the flight is the same."""
    a, d = SHAPES[shape]
    flip = "signed" if a > d else "energy"
    part = Part(a, d, regimes(a, d)[regime], flip=flip)
    beyond = math.pi * part.kappa  # f(2 pi) > 0 from here on
    starts = [a * (1.0 + reach) for reach in (1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0)]
    starts += [math.nextafter(a, math.inf), 0.5 * (a + beyond), 0.9 * beyond, 1.1 * beyond]
    for x in starts:
        if x > a:
            check(part, x)


@pytest.mark.parametrize("regime", regimes(2.0, 1.0))
def test_every_regime_with_the_centre_over_the_vertex(regime: str) -> None:
    a, d = OVER_THE_VERTEX
    part = Part(a, d, regimes(a, d)[regime], h=-0.1, rho=0.3)
    for reach in (1e-27, 1e-22, 1e-18, 1e-12, 1e-6, 1e-3, 1.0):
        check(part, a + reach)


@pytest.mark.parametrize("h", [-2.0, -1e-9, 0.0, 1e-9, 0.1])
def test_displacements_near_the_vertex_cancel_nothing(h: float) -> None:
    for reach in np.geomspace(1e-15, 1.0, 16):
        exact = check(Part(2.0, 1.0, 7.0, h=h), 2.0 * (1.0 + float(reach)))
        assert exact is not None


def test_the_barrier_keeps_its_digits_at_the_top() -> None:
    """ell - H near X = 0, where the centre of mass stands over the vertex: K - V is then all K."""
    for a, d in SHAPES.values():
        part = Part(a, d, 4.0 * math.hypot(a, d))
        params, top = throw_map(**part.numbers()), math.atan2(a, d)
        for off in (-1e-2, -1e-5, -1e-8, 1e-8, 1e-5, 1e-2):
            phi = top * (1.0 + off)
            x = (a * math.sin(phi) - 2.0 * d * math.sin(phi / 2) ** 2) / phi + 0.5 * part.kappa * phi
            exact = exhaustive.throw(part, x)
            assert exact is not None
            right = arb(a) * exact.phi.cos() - arb(d) * exact.phi.sin()
            above = arb(a) * exact.phi.sin() + arb(d) * exact.phi.cos()
            barrier = part.kappa * right * abs(right) / ((arb(a) ** 2 + arb(d) ** 2).sqrt() + above)
            # A relative error of phi moves X by H phi, and B goes with the square of X.
            moved = abs(above) * exact.phi * exact.phi_condition + 2 * arb(max(a, d))
            condition = 1.0 + 2.0 * float(moved / abs(right))
            assert ulps(barrier, fly(params, x, 0).barrier) <= ULPS * condition, (a, d, off)


# ---------------------------------------------------------------- several roots


def turned_to(part: Part, phi: arb) -> tuple[arb, arb]:
    """R(phi), the start that is over the arm by nothing at phi, and its derivative."""
    a, d = arb(part.a), arb(part.d)
    low, rise = a * phi.sin() - 2 * d * (phi / 2).sin() ** 2, a * phi.cos() - d * phi.sin()
    half = arb(part.kappa) / 2
    return low / phi + half * phi, (rise - low / phi) / phi + half


def grazings(part: Part) -> list[arb]:
    """Starts whose flight grazes the arm before any other impact: the record maxima of R(phi)."""
    grid = np.linspace(1e-6, 2.0 * math.pi, 1500)
    rising = [bool(turned_to(part, arb(float(phi)))[1] > 0) for phi in grid]
    highest, found = arb(part.a), []
    for k in range(grid.size - 1):
        if rising[k] and not rising[k + 1]:
            lo, hi = arb(float(grid[k])), arb(float(grid[k + 1]))
            for _ in range(300):
                middle = ((lo + hi) / 2).mid()
                lo, hi = (middle, hi) if turned_to(part, middle)[1] > 0 else (lo, middle)
            start = turned_to(part, lo)[0].mid()
            if start > highest:
                highest = start
                found.append(start)
    return found


GRAZING = [
    Part(8.175880020962229, 0.3701709448707153, 5.542435337193188),
    Part(8.849537002981464, 0.3951868146936833, 3.361281553527389),
    Part(5.524313285614356, 0.3554256398269438, 3.3215000986062106),
    Part(6.963938451107478, 1.3361158924859586, 5.403875672771518),
    Part(4.0, 0.1, 1.3),
]


@pytest.mark.parametrize("part", GRAZING, ids=lambda part: f"kappa {part.kappa:.3g}")
def test_a_grazing_root_is_neither_skipped_nor_made_up(part: Part) -> None:
    starts = grazings(part)
    assert starts
    for start in starts:
        nearest = float(start.mid())
        for steps in (-(10**6), -1000, -16, -2, 2, 16, 1000, 10**6):
            x = nearest + steps * math.ulp(nearest)
            roots = exhaustive.roots(part, x)
            assert all(root.simple for root in roots)
            check(part, x)
        before = exhaustive.roots(part, nearest * (1.0 - 1e-9))
        after = exhaustive.roots(part, nearest * (1.0 + 1e-9))
        assert len(before) - len(after) == 2  # the two that met


def test_the_smallest_of_many_roots() -> None:
    rng = np.random.default_rng(11)
    counts = []
    for _ in range(60):
        a, d = 10.0 ** rng.uniform(-1.0, 1.0, 2)
        part = Part(float(a), float(d), float(rng.uniform(0.1, 1.0) * math.hypot(a, d)))
        x = float(a * (1.0 + 10.0 ** rng.uniform(-3.0, 0.0)))
        counts.append(len(exhaustive.roots(part, x)))
        check(part, x)
    assert {0, 1, 2, 3} <= set(counts)


def test_a_first_root_beyond_a_full_turn_is_outside_the_model() -> None:
    for part in (Part(2.0, 1.0, 7.0), Part(2.0, 1.0, 1.5), Part(0.01, 5.0, 4.0)):
        edge = math.pi * part.kappa
        before = check(part, edge * (1.0 - 1e-9))
        assert before is not None or part.kappa < math.hypot(part.a, part.d)
        for factor in (1.0 + 1e-13, 1.001, 2.0, 1e6, 1e300):
            if edge * factor > part.a and edge * factor < 1e6:
                assert not exhaustive.roots(part, edge * factor) or part.kappa < math.hypot(part.a, part.d)
                check(part, edge * factor)
        code = maps.images(throw_map(**part.numbers()), [1e300, math.inf], 0).code
        assert (code == maps.OUTSIDE_MODEL).all()
    nothing = Part(2.0, 1.0, 1e-6)  # gravity that small never brings it down
    assert exhaustive.roots(nothing, 5.0) == []
    assert check(nothing, 5.0) is None


# ---------------------------------------------------------------- the decision


def critical_point(part: Part, near: float) -> arb:
    """Root of the margin between two floats 64 ulp around a guess, to 60 bits below their spacing."""
    lo, hi = arb(near - 64 * math.ulp(near)), arb(near + 64 * math.ulp(near))

    def flips(x: arb) -> bool:
        return bool(exhaustive.margin_at(part, x, exhaustive.roots(part, x, first=True)[0].phi) > 0)

    before = flips(lo)
    assert before != flips(hi)
    for _ in range(70):
        middle = ((lo + hi) / 2).mid()
        lo, hi = (middle, hi) if flips(middle) == before else (lo, middle)
    return lo


def sides_of(params: object, flip: str) -> list[Part]:
    p = params
    after = [(k + 1) % p.a.size for k in range(p.a.size)]
    own = [p.kappa, p.surface_height, p.radius_of_gyration, flip]
    return [
        Part(float(p.a[k]), float(p.d[k]), *own, float(p.length[j]), float(p.a[j]))
        for k, j in enumerate(after)
    ]


THREE = Part(1.373, 0.533, 33.06, h=-0.5, rho=1.25, flip="energy")


def decided() -> list[tuple[str, object, Domain, int, Part]]:
    rows = []
    for name in ("paper-initial", "paper-designed"):
        scene = ls.load(name)
        parts = enumerate(sides_of(scene.map, "signed"))
        rows += [(name, scene.map, scene.domain, k, part) for k, part in parts]
    params = throw_map(**THREE.numbers(40.0))
    rows.append(("three on one side", params, Domain([[1.374]], [[40.0]], [1.373]), 0, THREE))
    return rows


@pytest.mark.parametrize("row", decided(), ids=lambda row: f"{row[0]} side {row[3]}")
def test_decisions_around_critical_points(row: tuple[str, object, Domain, int, Part]) -> None:
    name, params, domain, side, part = row
    found = ls.critical_points(params, domain)[side]
    assert len(found) == (3 if name == "three on one side" else 1)
    for point in found:
        exact = critical_point(part, point.x)
        nearest = float(exact.mid())
        ulp = math.ulp(nearest)
        assert abs(float((exact - arb(point.x)).mid())) <= 16 * ulp
        for steps in (17, 18, 24, 33, 100, 10_000):
            around = [nearest - steps * ulp, nearest + steps * ulp]
            flips = margins(params, around, side) > 0.0
            assert flips.tolist() == [point.before == maps.FLIP, point.after == maps.FLIP]
            landed = maps.images(params, around, side)
            assert ((landed.side != side) == flips).all()
        # Within them the answer is one of the two branches, and x' is where that branch leads.
        within = nearest + np.arange(-16, 17) * ulp
        landed = maps.images(params, within, side)
        for branch in (maps.JOG, maps.FLIP):
            taken = landed.code == branch
            there = maps.images_on(params, within[taken], side, branch)[0]
            np.testing.assert_array_equal(landed.x[taken], there)


def test_the_three_critical_points_of_the_energy_model() -> None:
    params = throw_map(**THREE.numbers(40.0))
    points = ls.critical_points(params, Domain([[1.374]], [[40.0]], [1.373]))[0]
    assert [point.x for point in points] == pytest.approx([14.17, 18.24, 20.00], abs=0.005)
    assert [point.kind for point in points] == ["jog->flip", "flip->jog", "jog->flip"]
    # None is skipped: the margin at 90 digits has just these signs.
    signs = [bool(exhaustive.throw(THREE, x).flips) for x in np.arange(1.5, 40.0, 0.1)]
    changes = np.flatnonzero(np.diff(signs))
    assert changes.size == 3
    for change, point in zip(changes, points, strict=True):
        assert 1.5 + 0.1 * change <= point.x <= 1.6 + 0.1 * change


# ---------------------------------------------------------------- shapes


@pytest.mark.parametrize("n", [3, 4, 5, 6, 8, 12, 16, 33, 64])
def test_regular_polygons_do_the_same_on_every_side(n: int) -> None:
    """From vertices, side by side, through the scene: a and d differ by rounding, and so may the images."""
    angle = 2.0 * math.pi * (np.arange(n) + 0.3) / n
    corners = [[f"{math.cos(t)!r} in", f"{math.sin(t)!r} in"] for t in angle]
    part = {"vertices": corners, "mass": {"plate_density": "1 kg/m^2"}}
    arm = {"surface_height": "-0.1 in", "length": "20 in"}
    scene = ls.load({"name": "regular", "part": part, "arm": arm, "throw": {"kappa": "6 in"}})
    # By geometry: circumradius 1.
    np.testing.assert_allclose(scene.sides.a, math.sin(math.pi / n), rtol=1e-13)
    np.testing.assert_allclose(scene.sides.d, math.cos(math.pi / n), rtol=1e-13)
    np.testing.assert_allclose(scene.sides.corner, 2.0 * math.pi / n, rtol=1e-12)
    x = np.linspace(1.2, 19.0, 200)
    first = maps.images(scene.map, x, 0)
    assert {maps.JOG, maps.FLIP} <= set(first.code.tolist()) or n > 33
    for side in range(1, n):
        found = maps.images(scene.map, x, side)
        np.testing.assert_array_equal(found.code, first.code)
        np.testing.assert_array_equal((found.side - side) % n, first.side % n)
        np.testing.assert_allclose(found.x, first.x, rtol=0, atol=1e-12)


@pytest.mark.parametrize("thin", [1e-2, 1e-5, 1e-8])
@pytest.mark.parametrize("foot", [1e-12, 1e-6, 0.3])
def test_flat_parts_with_the_centre_over_a_vertex(thin: float, foot: float) -> None:
    """A centre of mass 1e-12 right of the vertical through the left vertex, on parts as flat as rounding lets be."""
    part = Part(foot, thin, 6.0, h=-0.1, rho=0.3, length_after=1.0, a_after=0.5)
    for reach in (1e-15, 1e-9, 1e-3, 1.0, 10.0):
        check(part, foot + reach)


# ---------------------------------------------------------------- scale

LENGTHS = ("kappa", "surface_height", "arm_length", "radius_of_gyration", "a", "d", "length")


@pytest.mark.parametrize("power", [-250, -15, 5, 250])
@pytest.mark.parametrize("name", ["paper-initial-small-angle", "several roots"])
def test_a_power_of_two_scales_to_the_bit(name: str, power: int) -> None:
    """Graphs and limit sets of the exact scenes: tests/sets/test_attractors.py."""
    scene = ls.load("paper-designed" if name == "several roots" else name)
    if name == "several roots":
        scene = scene.with_values({"throw.kappa": 2.0})
    scale = 2.0**power
    small = scene.map._replace(**{key: getattr(scene.map, key) * scale for key in LENGTHS})
    for side in range(3):
        x = np.linspace(float(scene.map.a[side]), scene.arm_length, 400)
        one, other = maps.images(scene.map, x, side), maps.images(small, x * scale, side)
        np.testing.assert_array_equal(one.x * scale, other.x)
        np.testing.assert_array_equal(one.code, other.code)
        np.testing.assert_array_equal(one.side, other.side)
    one, other = ls.orbit(scene.map, 15.0, 2, 5000), ls.orbit(small, 15.0 * scale, 2, 5000)
    np.testing.assert_array_equal(one.x * scale, other.x)
    np.testing.assert_array_equal(one.side, other.side)
    assert one.stopped == other.stopped
