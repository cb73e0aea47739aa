"""What is derived from one plain function; maps of the same name; their sides."""

import math
import pickle
from typing import NamedTuple

import flint
import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.base.errors import AnswerError, MapError
from limitsets.systems.cells import Domain
from limitsets.systems.graph.images.enclosed import BoxImages, enclosures
from limitsets.systems.maps.critical import margins
from limitsets.systems.maps.derived import MAYBE, NEVER, SURE, branch_boxes
from limitsets.systems.maps.kernels import decision
from tests.maps_of_tests import Tent

# ----------------------------------------------------------------
# Boxes and slopes of users' maps, derived from their plain kernels: against exact arithmetic, and what is refused.


# One map for each function that boxes can follow, spelt by math or by numpy, and the same in Arb.
def _ricker(p, x, side):
    return x * math.exp(p.r * (1.0 - x)), side, 0


def _roots(p, x, side):
    return np.sqrt(1.0 + p.r * x**2) * np.cbrt(x - 0.3) - math.log(2.0 + x) / (p.s + x**4), side, 0


def _turns(p, x, side):
    return p.r * np.sin(3.0 * x) - math.cos(p.s * x) * x, side, 0


def _steep(p, x, side):
    return math.tan(0.4 * x) + np.tanh(p.r * x) - np.arctan2(x, 1.0 + p.s * x**2), side, 0


def _corners(p, x, side):
    return max(abs(x - 0.3), p.r * x) - np.minimum(x, np.abs(p.s * x - 1.0)), side, 0


def _steps(p, x, side):
    return p.r * x - math.floor(3.0 * x) + 0.25 * np.floor(p.s * x), side, 0


def _powers(p, x, side):
    return p.r * x**3 - 2 * x**2 + x**-2 / 7 - x**0 + (+x) - 1.0 / (3.0 - x), side, 0


def _cube_root(x):
    """Cube root of a number that is not 0."""
    return x.root(3) if x > 0 else -(-x).root(3)


EXACT = {
    _ricker: lambda r, s, x: x * (r * (1 - x)).exp(),
    _roots: lambda r, s, x: (
        (1 + r * x**2).sqrt() * _cube_root(x - flint.arb(0.3)) - (2 + x).log() / (s + x**4)
    ),
    _turns: lambda r, s, x: r * (3 * x).sin() - (s * x).cos() * x,
    _steep: lambda r, s, x: (flint.arb(0.4) * x).tan() + (r * x).tanh() - flint.arb.atan2(x, 1 + s * x**2),
    _corners: lambda r, s, x: abs(x - flint.arb(0.3)).max(r * x) - x.min(abs(s * x - 1)),
    _steps: lambda r, s, x: r * x - (3 * x).floor() + (s * x).floor() / 4,
    _powers: lambda r, s, x: r * x**3 - 2 * x**2 + 1 / x**2 / 7 - 1 + x - 1 / (3 - x),
}


def registered(name, fields, **kernels):
    """A fresh class of parameters, with these kernels; found in this file by its name, so that its code is kept."""
    cls = globals()[name] = NamedTuple(name, fields)
    cls.__module__ = __name__
    return ls.register(cls, **kernels)


MAPS = {f: registered(f"Map{f.__name__}", [("r", float), ("s", float)], image=f) for f in EXACT}


def boxes(rng, count):
    """Boxes in [-1, 2.5] of all widths, and of parameters, some of them points."""
    width = 10.0 ** rng.uniform(-8, 0, count)
    lo = rng.uniform(-1.0, 2.5 - width)
    return lo, lo + width


def exact(p):
    return flint.arb(float(p))


@pytest.mark.parametrize("kernel", EXACT, ids=lambda f: f.__name__)
def test_boxes_and_slopes_hold_the_exact_ones(kernel):
    rng = np.random.default_rng(3)
    cls, lost = MAPS[kernel], 0
    for spread in (0.0, 1e-9, 1e-2):
        low = cls(*rng.uniform(0.5, 2.0, 2))
        high = cls(*(v * (1.0 + spread) for v in low))
        lo, hi = boxes(rng, 300)
        got = branch_boxes(low, high, 0, 0, lo[:, None], hi[:, None])
        found = BoxImages(low, high, 0, (lo,), (hi,))
        lost += int((found.count != 1).sum())
        assert set(np.unique(got.state)) <= {SURE, -1}
        for k in np.flatnonzero(found.count == 1):
            p = [exact(a + rng.random() * (b - a)) for a, b in zip(low, high, strict=True)]
            at = [lo[k], hi[k], *rng.uniform(lo[k], hi[k], 3)]
            values = [EXACT[kernel](*p, exact(x)) for x in at]
            (a,), (b,) = found.slots[0]
            for value in values:
                assert exact(a[k]) <= value + value.rad()
                assert value - value.rad() <= exact(b[k])
            if got.state[k] != SURE:
                continue
            slope = flint.arb(float(got.slope_lo[k, 0, 0])).union(flint.arb(float(got.slope_hi[k, 0, 0])))
            for x, value in zip(at[1:], values[1:], strict=True):
                ratio = (value - values[0]) / (exact(x) - exact(at[0]))
                assert not ratio.is_finite() or ratio.overlaps(slope)
    # poles, what is not defined, and where the slope is infinite are nobody's image
    assert lost < (70 if kernel is not _powers else 320)


def test_boxes_of_monotone_cells_are_the_range():
    edges = np.linspace(0.0, 0.4, 4001)  # the top of x exp(r (1 - x)) is at 1/r
    params = MAPS[_ricker](2.0, 0.0)
    lo, hi = enclosures(params, params, edges, 0).hulls[0, 0]
    value = edges * np.exp(2.0 * (1.0 - edges))
    assert np.abs((hi - lo) / np.diff(value) - 1.0).max() < 1e-9


class Young(NamedTuple):
    young: float = 19.6
    old: float = 23.68
    crowding: float = 0.1
    survival: float = 0.7


def _young(p, x, side):
    decay = math.exp(-p.crowding * (x[0] + x[1]))
    return ((p.young * x[0] + p.old * x[1]) * decay, p.survival * x[0]), side, 0


ls.register(Young, image=_young, dimension=2)


def test_boxes_of_the_plane_against_those_written_by_hand():
    edges = tuple(np.linspace(0.0, end, 129) for end in (90.0, 70.0))
    own, hand = Young(), maps.Leslie()
    lo, hi = enclosures(own, own, edges, 0).hulls[0, 0]
    least, most = enclosures(hand, hand, edges, 0).hulls[0, 0]
    assert ((lo <= least + 1e-9) & (most - 1e-9 <= hi)).all()  # those by hand are the range
    ratio = (hi - lo)[:, 0] / (most - least)[:, 0]
    assert np.median(ratio) < 1.0 + 1e-9
    assert ratio.mean() < 1.02


def _turned(p, x, side):
    c, s = p.at.c[side], p.at.s[side]
    return (c * x[0] - s * x[1], s * x[0] + c * x[1], 0.5 * x[2] + p.rise), int(p.to[side]), 0


class At(NamedTuple):
    c: np.ndarray
    s: np.ndarray


class Turned(NamedTuple):
    at: At
    to: np.ndarray
    rise: float
    unused: None = None


ls.register(Turned, image=_turned, dimension=3)


@pytest.mark.sweep
def test_three_dimensions_with_parameters_by_side_in_a_nested_class():
    params = maps.coerce(Turned(At([0.6, 0.0], [0.8, 1.0]), [1.0, 0.0], 0.25))
    lo, hi = (np.array([0.0]),) * 3, (np.array([1.0]),) * 3
    found = BoxImages(params, params, 0, lo, hi)
    (a, b), to = found.slots[0], int(found.to[0, 0])
    assert found.count[0] == 1
    assert to == 1
    assert np.allclose([v[0] for v in a], [-0.8, 0.0, 0.25], atol=1e-14)
    assert np.allclose([v[0] for v in b], [0.6, 1.4, 0.75], atol=1e-14)


# ---------------------------------------------------------------- two branches


def test_a_margin_decides_between_two_branches():
    lo, hi = np.array([0.1, 0.4, 0.6]), np.array([0.2, 0.6, 0.7])
    found = BoxImages(Tent(2.0), Tent(2.0), 0, (lo,), (hi,))
    assert found.count.tolist() == [1, 2, 1]
    assert found.to[1].tolist() == [0, 0, 1]
    found = [branch_boxes(Tent(2.0), Tent(2.0), 0, b, lo[:, None], hi[:, None]) for b in (0, 1)]
    states = [boxes.state.tolist() for boxes in found]
    assert states == [[SURE, MAYBE, NEVER], [NEVER, MAYBE, SURE]]


def _hill(x, b, n):
    return b * x**n / (1 + x**n)


@pytest.mark.parametrize(("x", "slope"), [(0.25, 1.9), (0.75, -1.9)])
def test_a_decision_has_the_slope_of_the_branch_that_the_margin_takes(x, slope):
    assert decision(Tent(1.9), x, 0) == (x - 0.5, slope, True)


@pytest.mark.sweep
def test_a_map_with_a_real_power_is_enclosed():
    """Fixed points of b x^n / (1 + x^n), b = 2.5, that attract: 0, and 2 for n = 2; for n = 2.5 by Newton's method."""
    hill = ls.map(_hill, b=2.5, n=2.0)
    for exponent, stays in ((2.0, (0.0, 2.0)), (2.5, (0.0, 2.19183059))):
        graph = ls.transitions(hill.with_values(n=exponent), ls.grid([(0.0, 3.0)], cells=512), "boxes")
        spans = [each.extents()[0] for each in (found.cells for found in ls.attractors(graph))]
        assert [bool(s[0][0] <= x <= s[-1][1]) for s, x in zip(spans, stays, strict=True)] == [True, True]


def test_slopes_that_image_on_leaves_out_are_derived():
    assert maps.lyapunov(Tent(1.9), 0.3, 0, 500).exponent == pytest.approx(math.log(1.9), abs=1e-12)
    own, hand = Young(10.0, 12.0), maps.Leslie(10.0, 12.0)
    one, two = (maps.lyapunov(m, (3.0, 2.0), 0, 400).exponent for m in (own, hand))
    assert one == pytest.approx(two, abs=1e-6)


def _edge_of_model(p, x, side):
    return 0.5 * x, side, 0 if x < 0.7 else maps.OUTSIDE


def _half_on(p, x, side, branch):
    return 0.5 * x, side


def test_an_exit_that_only_image_knows_is_refused():
    cls = registered("Exits", [("r", float)], image=_edge_of_model, image_on=_half_on)
    with pytest.raises(MapError, match=r"code -2, an exit.*let image_on give nan there"):
        ls.transitions(cls(1.0), ls.grid([(0.0, 1.0)], cells=16), "boxes")


# ---------------------------------------------------------------- what boxes cannot follow


def _compares(p, x, side):
    return (p.r * x if x < 0.5 else p.r * (1.0 - x)), side, 0


def _compares_parameter(p, x, side):
    return (x if p.r > 1.0 else 2.0 * x), side, 0


def _unknown(p, x, side):
    return np.cosh(x), side, 0


def _rounds(p, x, side):
    return x % 1.0, side, 0


@pytest.mark.parametrize(
    ("kernel", "smooth"),  # floats may be compared with parameters, and have roots: slopes are known
    [
        (_compares, False),
        (_compares_parameter, True),
        (_unknown, False),
        (_rounds, False),
    ],
)
def test_a_line_names_the_function_and_the_way_out(kernel, smooth):
    cls = registered(f"No{kernel.__name__}", [("r", float)], image=kernel)
    with pytest.raises(MapError) as caught:
        ls.transitions(cls(0.5), ls.grid([(0.1, 0.9)], cells=8), "boxes")
    text = str(caught.value)
    assert "\n" not in text
    for word in (kernel.__name__, "test_derived.py, line", "return", "image_on", "margin", "image_box"):
        assert word in text
    # Everything but boxes and slopes still runs.
    graph = ls.transitions(cls(0.5), ls.grid([(0.1, 0.9)], cells=8))
    assert maps.has_slope(graph.map) == smooth


# ----------------------------------------------------------------
# A class registered again under its name, as by a cell of a notebook that runs twice, is a map of its own.


def slow(params, x, side):
    return 0.5 * x + 0.1 * params.a, side, 0


def fast(params, x, side):
    return 0.5 * x + 0.4 * params.a, side, 0


def registered_same_name(image):
    class Again(NamedTuple):
        a: float

    return ls.register(Again, image=image)


@pytest.mark.sweep
def test_each_of_two_classes_of_one_name_is_followed_by_its_own_formula():
    """The fixed point of x / 2 + c is 2 c; either class may come first."""
    old, new = registered_same_name(slow), registered_same_name(fast)
    for cls, c in ((old, 0.1), (new, 0.4), (old, 0.1)):
        assert ls.orbit(cls(1.0), 0.3, 0, 1).x[-1] == 0.15 + c
        graph = ls.transitions(cls(1.0), ls.grid([(0.0, 1.0)], cells=256))
        ((lo, hi),) = ls.attractors(graph)[0].extents[0]
        assert lo <= 2.0 * c <= hi
    assert ls.maps.kind_of(old(1.0)).name == ls.maps.kind_of(new(1.0)).name == "Again"
    assert repr(new(1.0)) != repr(old(1.0))
    # the cache on disk makes the class again, under this name, in the next process
    assert new.__name__.isidentifier()


class Henon(NamedTuple):
    """A map of one's own under the name and the fields of a textbook map."""

    a: float
    b: float


def turned(params, x, side):
    return (params.a * x[0] - params.b * x[1], params.b * x[0] + params.a * x[1]), side, 0


ls.register(Henon, image=turned, dimension=2)


@pytest.mark.parametrize("mine_first", [False, True])
def test_a_map_may_have_the_name_of_a_textbook_map(mine_first):
    mine, book = Henon(0.6, 0.3), ls.maps.Henon(0.6, 0.3)
    for params in (mine, book) if mine_first else (book, mine):
        after = ls.orbit(params, (0.5, 0.25), 0, 1).x[-1]
        known = (0.225, 0.3) if params is mine else (1.0 - 0.6 * 0.25 + 0.25, 0.15)
        assert math.dist(after, known) < 1e-15
    assert type(pickle.loads(pickle.dumps(mine))) is Henon


# ----------------------------------------------------------------
# Sides that a map or a grid has not: kernels would read beyond their arrays.


@pytest.mark.parametrize("side", [-1, 3, 7, 2**31])
def test_a_side_the_part_has_not(side):
    params = ls.load("paper-designed").map
    for ask, *arguments in (
        (maps.images, [8.0], side),
        (maps.images_on, [8.0], side, 0),
        (maps.along, [8.0, 8.0], [0, side], [0]),
        (maps.advance, [8.0, 8.0], [0, side], 3),
        (ls.orbit, 8.0, side, 3),
        (maps.lyapunov, 8.0, side, 3),
        (margins, [8.0], side),
    ):
        with pytest.raises(MapError, match="0 to 2"):
            ask(params, *arguments)


@pytest.mark.parametrize("method", ["end-points", "corners"])
def test_a_grid_of_fewer_sides_than_the_map(method):
    with pytest.raises(AnswerError, match="the side of an image is 1"):
        ls.transitions(ls.load("paper-designed").map, ls.grid([(2.0, 28.0)], cells=16), method)


def test_a_grid_of_more_sides_than_the_map():
    scene = ls.load("paper-designed")
    four = Domain(np.full((4, 1), 5.0), np.full((4, 1), 28.0))
    with pytest.raises(MapError, match="the side is 3"):
        ls.transitions(scene.map, ls.grid(four, cells=16))
    with pytest.raises(MapError, match="the side is 3"):
        ls.critical_points(scene.map, four)


class Elsewhere(NamedTuple):
    to: float


def _elsewhere(params, x, side):
    return 0.5 * x, int(params.to), 0


maps.register(Elsewhere, image=_elsewhere)


@pytest.mark.parametrize("to", [-1.0, 1.0, 30_000.0])
def test_a_map_that_leads_to_a_side_that_is_none(to):
    with pytest.raises(AnswerError, match="the side of an image"):
        ls.transitions(Elsewhere(to), ls.grid([(0.0, 1.0)], cells=8))
