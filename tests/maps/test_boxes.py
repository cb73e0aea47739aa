"""Box images of the textbook maps against exact rationals (Arb for the exponential): nothing missed, little added."""

import itertools
import math
from fractions import Fraction

import flint
import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.numbers.jit import proof_kernel
from limitsets.systems.graph.images.enclosed import BoxImages
from limitsets.systems.maps.kernels import image_box, pick
from limitsets.systems.maps.textbook.shared import DOMAINS as PUBLIC
from tests.interval.exact import arb
from tests.maps_of_tests import DOMAINS as OWN, Baker, Contraction, Linear2, Product, ThreeState, TwoState

POINTS = 2000
DOMAINS = PUBLIC | OWN
HALF = Fraction(1, 2)


def circle(x, times, turn):
    """Images on the closed circle, both at the break: a branch and a number each."""
    y = times * x + turn
    return [(b, [y - b]) for b, met in ((0, y <= 1), (1, y >= 1)) if met]


def wave(omega, coupling, x):
    """As balls, in Arb; both branches where a ball holds the break."""
    omega, coupling, x = (arb(float(v)) for v in (omega, coupling, x))
    tau = 2 * flint.arb.pi()
    y = x + omega - coupling / tau * (tau * x).sin()
    return [(b, [y - b]) for b, met in ((0, not y > 1), (1, not y < 1)) if met]


def three(v, e, x):
    met = [(0, x <= -e), (1, -e <= x <= e), (2, x >= e)]
    return [(b, [v * (b - 1)]) for b, here in met if here]


def two(r, x, _):
    r = r if r >= HALF else 0
    return [(b, [s * r] * 2) for b, s, met in ((0, -1, x <= 0), (1, 1, x >= 0)) if met]


def baker(c, x, y):
    both = [(0, [2 * x, c * y], x <= HALF), (1, [2 * x - 1, c * y + 1 - c], x >= HALF)]
    return [(b, u) for b, u, met in both if met]


def leslie(young, old, crowding, survival, x, y):
    """As balls, in Arb."""
    young, old, crowding = (arb(float(v)) for v in (young, old, crowding))
    x_, y_ = arb(float(x)), arb(float(y))
    return [(0, [(young * x_ + old * y_) * (-crowding * (x_ + y_)).exp(), arb(float(survival)) * x_])]


# Map -> relative width of its parameter box in the tests with one, its images in exact arithmetic.
EXACT = {
    Baker: (0.1, baker),
    maps.Circle: (0.1, wave),
    Contraction: (0.1, lambda s, o, x: [(0, [s * x + o])]),
    maps.Cubic: (0.1, lambda r, x: [(None, [r * x - x**3])]),
    maps.Doubling: (0.1, lambda f, x: circle(x, f, 0)),
    maps.Henon: (0.1, lambda a, b, x, y: [(0, [1 - a * x * x + y, b * x])]),
    maps.Leslie: (0.1, leslie),
    Linear2: (0.1, lambda a, b, c, d, x, y: [(0, [a * x + b * y, c * x + d * y])]),
    maps.Logistic: (0.1, lambda r, x: [(None, [r * x * (1 - x)])]),
    Product: (0.1, lambda p, x, y: [(0, [x / (p - x), y / (p - y)])]),
    maps.Rotation: (0.1, lambda a, x: circle(x, 1, a)),
    ThreeState: (0.1, three),
    TwoState: (0.9, two),
}
ALL = pytest.mark.parametrize("cls", EXACT, ids=lambda cls: cls.__name__)
DEFAULTS = {Linear2: Linear2(0.7, -0.4, 0.3, 1.1), Contraction: Contraction(-0.7, 0.1)}


def test_every_textbook_map_has_boxes():
    assert set(EXACT) == set(DOMAINS)
    assert all(maps.kind_of(cls()).has_image_box for cls in DOMAINS)


def boxes_in(rng, pairs, count, largest):
    """Boxes of all sizes in a domain, some with borders at its ends, at 0 or at 1/2."""
    lo, hi = [], []
    for a, b in pairs:
        size = (b - a) * np.minimum(largest, 10.0 ** rng.uniform(-9, 0, count))
        middle = rng.uniform(a, b, count)
        ends = rng.choice([a, b, 0.0, 0.5, 1.0], count)
        middle = np.where((rng.random(count) < 0.2) & (a <= ends) & (ends <= b), ends, middle)
        share = rng.choice([0.0, 0.3, 0.5, 1.0], count)
        lo.append(np.clip(middle - share * size, a, b))
        hi.append(np.clip(middle + (1 - share) * size, a, b))
    return tuple(lo), tuple(hi)


def inside(lo, hi, image):
    """Whether an exact image (rationals, or balls, of which a part has to be inside) lies in a box."""
    for a, b, u in zip(lo, hi, image, strict=True):
        if isinstance(u, flint.arb):
            if u < arb(a) or u > arb(b):
                return False
        elif not Fraction(a) <= u <= Fraction(b):
            return False
    return True


def between(a, b, share):
    return min(max(a + share * (b - a), a), b)


def violations(cls, width, count, seed):
    """Points whose image is not in a slot that may hold it; and boxes of which nothing is proved."""
    rng = np.random.default_rng(seed)
    params = DEFAULTS.get(cls, cls())
    bad = lost = 0
    for low, high in param_boxes(rng, params, width):
        lo, hi = boxes_in(rng, DOMAINS[cls], count // 20, 0.3)
        got = BoxImages(low, high, 0, lo, hi)
        lost += int((got.count == -1).sum())
        corners = list(itertools.product((0.0, 1.0), repeat=len(lo)))
        for k in range(lo[0].size):
            share = corners[k % len(corners)] if k % 3 == 0 else rng.random(len(lo))
            x = [between(a[k], b[k], s) for a, b, s in zip(lo, hi, share, strict=True)]
            p = [between(a, b, rng.random()) for a, b in zip(low, high, strict=True)]
            images = EXACT[cls][1](*map(Fraction, p), *map(Fraction, x))
            for branch, image in images:
                slots = [(s, int(got.to[2 * s + 1, k])) for s in range(got.count[k])]
                boxes = [np.stack(got.slots[s], axis=0)[:, :, k] for s in range(2)]
                held = [b for s, b in slots if inside(*boxes[s], image)]
                named = branch is None or branch in held or (cls is ThreeState and len(slots) == 2)
                bad += not (held and named)
    return bad, lost


def param_boxes(rng, params, width):
    for _ in range(20):
        at = [v * (1 + width * rng.uniform(-0.5, 0.5)) for v in params] if width else list(params)
        size = [abs(v) * width * rng.choice([0.01, 0.5]) for v in params]
        lo = type(params)(*at)
        hi = type(params)(*(v + s for v, s in zip(at, size, strict=True))) if width else lo
        if isinstance(params, maps.Rotation | maps.Doubling | Baker):  # within their range
            most = {maps.Rotation: 0.999, maps.Doubling: 2.0, Baker: 0.5}[type(params)]
            lo, hi = (type(params)(min(v[0], most)) for v in (lo, hi))
        yield lo, hi


@pytest.fixture(autouse=True)
def _precise_balls():
    flint.ctx.prec = 120
    yield
    flint.ctx.prec = 53


@ALL
def test_images_of_points_lie_in_the_box_of_their_cell(cls):
    assert violations(cls, 0.0, POINTS, 1) == (0, 0)


@ALL
def test_images_for_parameters_of_a_box_lie_in_the_box(cls):
    assert violations(cls, EXACT[cls][0], POINTS, 2) == (0, 0)


TIGHT = [cls for cls in EXACT if cls not in (maps.Doubling, maps.Rotation, ThreeState, TwoState)]


@pytest.mark.parametrize("cls", TIGHT, ids=lambda cls: cls.__name__)
@pytest.mark.parametrize("size", [1e-9, 1e-6])
def test_boxes_of_small_cells_are_tight(cls, size):
    """Cells on which the map is monotone, so that the corners give the exact range."""
    rng = np.random.default_rng(3)
    params = DEFAULTS.get(cls, cls())
    lo = tuple(rng.uniform(a + 0.01 * (b - a), b - 0.01 * (b - a), 100) for a, b in DOMAINS[cls])
    hi = tuple(x + size for x in lo)
    got = BoxImages(params, params, 0, lo, hi)
    assert (got.count == 1).all()
    for k in range(100):
        corners = itertools.product(*((Fraction(a[k]), Fraction(b[k])) for a, b in zip(lo, hi, strict=True)))
        found = [dict(EXACT[cls][1](*map(Fraction, params), *corner)) for corner in corners]
        branch = None if None in found[0] else int(got.to[1, k])
        for axis in range(len(lo)):
            values = [u[branch][axis] for u in found]
            values = [float(v.mid() if isinstance(v, flint.arb) else v) for v in values]
            slack = 1e-12 * max(1.0, *map(abs, values))
            turns = 1e-3 * size if cls is maps.Leslie else 0.0  # near a crest the corners are not the range
            assert got.slots[0][0][axis][k] >= min(values) - slack
            assert got.slots[0][1][axis][k] <= max(values) + slack + turns


def test_wide_cells_are_exact_where_a_map_turns():
    def one(params, *pairs):
        lo, hi = zip(*pairs, strict=True)
        got = BoxImages(params, params, 0, *(tuple(np.array([v]) for v in c) for c in (lo, hi)))
        assert got.count[0] == 1
        return [(low[0], high[0]) for low, high in zip(*got.slots[0], strict=True)]

    assert one(maps.Logistic(4.0), (0.0, 1.0)) == [(0.0, 1.0)]
    assert one(maps.Logistic(3.0), (0.2, 0.6))[0] == pytest.approx((0.48, 0.75), abs=1e-14)
    top = 2 * math.sqrt(0.5) ** 3
    assert one(maps.Cubic(1.5), (-1.0, 1.0))[0] == pytest.approx((-top, top), abs=1e-14)
    assert one(maps.Cubic(1.5), (0.1, 1.2))[0] == pytest.approx((0.072, top), abs=1e-14)
    assert one(maps.Henon(), (-0.5, 1.0), (0.0, 0.1))[0] == pytest.approx((-0.4, 1.1), abs=1e-14)
    # along y = 0 the young are most at x = 1 / crowding: 19.6 * 10 / e
    assert one(maps.Leslie(), (1.0, 50.0), (0.0, 1e-12))[0][1] == pytest.approx(196 / math.e, rel=1e-9)


CIRCLES = [maps.Rotation(0.0), maps.Rotation(), maps.Circle(0.0, 1.0), maps.Circle()]


def test_the_unit_interval_and_square_are_not_left_by_rounding():
    grids = {1: ls.grid([(0, 1)], cells=97), 2: ls.grid([(0, 1), (0, 1)], cells=31)}
    for params in [maps.Logistic(4.0), maps.Doubling(2.0), *CIRCLES, Baker()]:
        graph = ls.transitions(params, grids[maps.kind_of(params).dimension], method="boxes")
        assert not graph.ranges.exits.any(), params


def test_nothing_is_claimed_beyond_a_pole_or_off_the_circle():
    off = [(maps.Rotation(), (-0.5, 0.5)), (maps.Circle(), (-0.5, 0.5)), (maps.Doubling(), (0.9, 1.1))]
    for params, pair in [(Product(), (1.5, 2.5)), *off]:
        dimension = maps.kind_of(params).dimension
        lo, hi = (tuple(np.array([end]) for _ in range(dimension)) for end in pair)
        assert BoxImages(params, params, 0, lo, hi).count[0] == -1


def test_boxes_of_a_circle_map_that_folds_hold_its_images():
    """Beyond a coupling of 1: both turning points inside one cell, and images below 0, which are outside."""
    params = maps.Circle(0.1, 4.0)
    edges = np.linspace(0.0, 1.0, 8)
    got = BoxImages(params, params, 0, (edges[:-1],), (edges[1:],))
    assert (got.count >= 1).all()
    for k, x in enumerate(np.linspace(0.0, 1.0, 1401)[:-1].reshape(7, 200)):
        for point in x:
            count = range(got.count[k])
            slots = {int(got.to[2 * s + 1, k]): np.stack(got.slots[s], axis=0)[:, :, k] for s in count}
            for branch, image in wave(*params, Fraction(point)):
                assert inside(*slots[branch], image)
    assert got.slots[0][0][0].min() < 0.0


def test_parameters_that_are_no_numbers_prove_nothing():
    lo, hi = (np.array([0.1, 0.6]),), (np.array([0.2, 0.7]),)
    for bad in (math.nan, math.inf):
        for cls in (maps.Logistic, maps.Cubic, ThreeState):
            params = cls(bad, 1.0) if cls is ThreeState else cls(bad)
            assert (BoxImages(params, params, 0, lo, hi).count == -1).all()


@proof_kernel(entry=True)
def _loop(params, lo, hi, count):
    """A loop outside the package, which is compiled anew: code from the disk cannot be looked into."""
    for k in range(count.size):
        count[k], _, _, _ = image_box(params, params, pick(lo, k), pick(hi, k), 0)


@pytest.mark.sweep
@pytest.mark.parametrize("cls", [maps.Leslie, maps.Cubic], ids=lambda cls: cls.__name__)
def test_boxes_are_compiled_without_fused_operations(cls):
    params = cls()
    lo = tuple(np.array([0.1, 0.2]) for _ in range(maps.kind_of(params).dimension))
    _loop(params, lo, lo, np.empty(2))
    text = "".join(_loop.inspect_asm().values())
    assert "mul" in text
    assert "vfm" not in text
    assert "vfnm" not in text
