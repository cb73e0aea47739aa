"""Attractors, limit sets, their measure and entropy."""

import math
from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.base.errors import AnswerError
from limitsets.systems.cells import Domain, as_domain
from limitsets.systems.maps import INWARD
from limitsets.systems.sets import invariant_measures, limit_set_of
from limitsets.systems.sets.attracting import _visits
from limitsets.systems.sets.entropy import topological_entropy
from tests.maps_of_tests import Baker, Linear2, with_middles
from tests.sets.part import Part
from tests.test_paper import LIMIT_SETS

# ----------------------------------------------------------------
# Attractors, basins and ways out: what cells, labels and visits say (the paper's scenes: tests/test_paper.py).


@pytest.mark.parametrize(("h", "border"), [(0.1, (3.16, 3.19, 4.81)), (0.2, (4.64, 4.55, 5.39))])
def test_with_the_arm_above_the_joint_starts_near_it_collapse(h, border):
    """For h > 0 every start between a_i and an unstable fixed point of the jog runs to a_i: label inward."""
    scene = ls.load("paper-designed").with_values({"arm.surface_height": f"{h} in"})
    graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))
    share = ls.basins(graph, ls.attractors(graph, throws=1000))
    for side, x in enumerate(border):
        inside = graph.grid.edges[side][0][1:] < x - 0.03
        beyond = (graph.grid.edges[side][0][:-1] > x + 0.03) & (graph.grid.edges[side][0][:-1] < x + 1.0)
        labels = share.labels[graph.grid.of_side(side)]
        assert (labels[inside] == INWARD).all()
        assert not (labels[beyond] == INWARD).any()
    assert share.exits["inward"] > 0.0


def test_strong_outward_jogs_lead_off_the_arm():
    scene = ls.load("paper-designed").with_values({"arm.surface_height": "-3 in"})
    graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=1024))
    share = ls.basins(graph, ls.attractors(graph, throws=1000))
    assert share.attractors == ()
    assert share.exits["outward"] > 0.99


def test_visits_count_jogs_between_arriving_and_leaving():
    sides = np.array([2, 2, 0, 1, 2, 2, 2, 0, 1, 2, 2, 0, 0])
    assert _visits(sides) == ((0, 1, 2), {0: (0, 0), 1: (0, 0), 2: (1, 2)})
    assert _visits(np.array([1, 1, 1])) == ((1,), {})
    order, _ = _visits(np.array([0, 1, 2, 0, 2, 1, 0, 1]))
    assert order is None


def test_basins_of_another_graph_are_refused():
    scene = ls.load("paper-designed")
    one, two = (ls.transitions(scene.map, ls.grid(scene.domain, cells=256)) for _ in range(2))
    with pytest.raises(AnswerError, match="this graph"):
        ls.basins(two, ls.attractors(one, throws=10))
    with pytest.raises(AnswerError, match="integer from 1"):
        ls.attractors(one, throws=0)


@with_middles
def test_an_orbit_may_leave_what_the_cells_promise_and_says_so():
    """Middles alone miss images: the share of the orbit inside the cells tells."""
    graph = ls.transitions(ls.maps.Henon(1.4, 0.3), ls.grid([(-2, 2), (-2, 2)], cells=64), method="middles")
    found = ls.attractors(graph, throws=5000)
    assert found == () or min(a.in_cells for a in found) < 1.0


def test_extents_in_the_plane_are_a_box_for_each_piece():
    params = ls.maps.Henon(0.9, 0.3)  # a stable cycle of period 2, between a = 0.3675 and 0.9125
    found = ls.attractors(ls.transitions(params, ls.grid([(-2, 2), (-1, 1)], cells=256)), throws=1000)[0]
    roots = np.roots([0.81, -0.9 * 0.7, 0.49 - 0.9])  # of a^2 x^2 - a (1 - b) x + (1 - b)^2 - a
    assert len(found.extents[0]) == 2
    for root, other in (roots, roots[::-1]):  # y is 0.3 times the x before
        boxes = [[lo <= root <= hi, low <= 0.3 * other <= high] for (lo, hi), (low, high) in found.extents[0]]
        assert any(map(all, boxes))
    assert found.table().heads == ["side", "x[0]", "x[1]", "jogs per visit"]


# ----------------------------------------------------------------
# End points of limit sets: from sets of any size, 40-digit orbits of the origins, maps on paper.


UNIT = as_domain([(0.0, 1.0)])


def widened(extents, width):
    return {side: [(lo - width, hi + width) for lo, hi in pairs] for side, pairs in extents.items()}


def whole(scene):
    return {side: [(float(scene.domain.lo[side, 0]), scene.arm_length)] for side in range(3)}


def assert_same(found, expected, tolerance):
    assert {side: len(pairs) for side, pairs in found.items()} == {s: len(p) for s, p in expected.items()}
    for side, pairs in expected.items():
        assert np.abs(np.array(found[side]) - np.array(pairs)).max() < tolerance


@pytest.mark.parametrize("start", [0.05, 0.5, 2.0, "whole arm"])
@pytest.mark.parametrize("name", LIMIT_SETS)
def test_the_table_from_sets_of_any_size(name, start):
    scene = ls.load(name)
    extents = whole(scene) if start == "whole arm" else widened(LIMIT_SETS[name], start)
    found = limit_set_of(scene.map, extents, scene.domain)
    assert found.converged
    assert not found.leaves
    assert found.advice is None
    assert_same(found.extents, LIMIT_SETS[name], 1e-12)
    assert all(end.origin.kind == "critical" for end in found.ends)


# ---------------------------------------------------------------- the same end points at 40 digits


@pytest.mark.parametrize("name", LIMIT_SETS)
def test_every_end_is_the_orbit_of_its_origin_at_40_digits(name):
    scene, part = ls.load(name), Part(name)
    found = limit_set_of(scene.map, widened(LIMIT_SETS[name], 0.05), scene.domain)
    printed = [x for side in sorted(LIMIT_SETS[name]) for pair in LIMIT_SETS[name][side] for x in pair]
    for end, table in zip(found.ends, printed, strict=True):
        x, side = part.critical_point(end.origin.side, end.origin.x), end.origin.side
        for branch in end.origin.branches:
            x, side = part.throw(x, side, branch)
        assert side == end.side
        assert abs(x - table) < 1e-12
        # The estimate speaks of the float map; the scene's lengths, rounded to floats, add about as much again.
        assert abs(x - end.x) < 8.0 * end.error
        assert abs(x - end.x) < 2e-13


def test_ends_say_where_they_come_from():
    scene = ls.load("paper-designed")
    found = limit_set_of(scene.map, widened(LIMIT_SETS["paper-designed"], 0.05), scene.domain)
    assert str(found.ends[3].origin).endswith("on side 2, jog, flip x 2")
    assert found.ends[3].origin.branches == ("jog", "flip", "flip")
    assert [(end.side, end.which) for end in found.ends] == [(s, w) for s in range(3) for w in ("lo", "hi")]


# ---------------------------------------------------------------- maps with answers on paper


def test_doubling_fills_the_circle():
    found = limit_set_of(maps.Doubling(2.0), {0: [(0.0, 1.0)]}, UNIT)
    assert found.extents == {0: [(0.0, pytest.approx(1.0, abs=1e-15))]}
    assert found.converged


@pytest.mark.parametrize("r", [3.7, 3.9, 4.0])
def test_a_logistic_band_ends_at_the_images_of_the_turning_point(r):
    found = limit_set_of(maps.Logistic(r), {0: [(0.01, 0.999)]}, UNIT)
    top = r / 4.0
    (lo, hi), *others = found.extents[0]
    assert (lo, hi) == (pytest.approx(r * top * (1.0 - top), abs=1e-12), pytest.approx(top, abs=1e-12))
    assert not others


def test_two_bands_of_the_logistic_map():
    # At r = 3.6 the images of 1/2 bound two bands that the map exchanges.
    r = 3.6
    f = [0.5]
    for _ in range(4):
        f.append(r * f[-1] * (1.0 - f[-1]))
    # Started apart from the fixed point 1 - 1/r between them, which repels.
    found = limit_set_of(maps.Logistic(r), {0: [(0.3, 0.62), (0.77, 0.91)]}, UNIT)
    assert found.converged
    assert_same(found.extents, {0: [(f[2], f[4]), (f[3], f[1])]}, 1e-12)


def test_an_attracting_orbit_of_period_three_is_three_points():
    r = 3.83
    path = ls.orbit(maps.Logistic(r), 0.5, 0, 3000).x[-3:]
    start = {0: [(float(x) - 1e-3, float(x) + 1e-3) for x in np.sort(path)]}
    found = limit_set_of(maps.Logistic(r), start, UNIT)
    assert found.converged
    assert_same(found.extents, {0: [(x, x) for x in np.sort(path)]}, 1e-11)


def test_fixed_points_of_the_cubic_map_from_its_graph():
    graph = ls.transitions(maps.Cubic(1.5), ls.grid([(-1.2, 1.2)], cells=1024))
    found = ls.attractors(graph)
    assert len(found) == 2
    ends = sorted(x for a in found for pair in ls.limit_set(graph, a).extents[0] for x in pair)
    root = np.sqrt(0.5)
    assert ends == pytest.approx([-root, -root, root, root], abs=1e-9)
    with pytest.raises(AnswerError, match="number of attractors"):
        ls.limit_set(graph)


# ---------------------------------------------------------------- what cannot be answered is said


def test_a_set_that_still_moves_is_a_value_with_advice():
    scene = ls.load("paper-designed")
    found = limit_set_of(scene.map, whole(scene), scene.domain, most_iterations=50)
    assert (found.converged, found.iterations) == (False, 50)
    assert "raise most_iterations" in found.advice


def test_what_leaves_is_dropped_and_said():
    scene = ls.load("paper-designed")
    far = scene.map._replace(surface_height=-3.0)  # strong outward jogs
    found = limit_set_of(far, whole(scene), scene.domain)
    assert found.leaves
    assert "left the domain" in found.advice or "still move" in found.advice


def test_wrong_questions():
    scene = ls.load("paper-designed")
    with pytest.raises(AnswerError, match="dimension"):
        limit_set_of(maps.Henon(), {0: [(0.0, 1.0)]}, as_domain([(-2, 2), (-2, 2)]))
    with pytest.raises(AnswerError, match="start from"):
        limit_set_of(scene.map, {0: [(40.0, 50.0)]}, scene.domain)
    with pytest.raises(AnswerError, match="side of the set is 3; allowed: 0 to 2;"):
        limit_set_of(scene.map, {3: [(4.0, 5.0)]}, scene.domain)


# ----------------------------------------------------------------
# Ulam's method where the stationary distribution is known on paper.


class Swap(NamedTuple):
    """[0, 1) and [1, 2) are swapped by the doubling map: period 2, uniform."""

    factor: float


def _swap(params, x, side):
    base = 0.0 if x < 1.0 else 1.0
    after = params.factor * (x - base)
    after = after if after < 1.0 else after - 1.0
    return after + (1.0 - base), side, 0 if x < 1.0 else 1


ls.register(Swap, image=_swap, branches=("up", "down"))


class Tents(NamedTuple):
    """A tent map on each of [0, 1] and [2, 3], and a rest that falls to the first."""

    slope: float


def _tents(params, x, side):
    base = 2.0 if x >= 2.0 else 0.0
    y = x - base if x >= 2.0 or x <= 1.0 else 0.5 * (x - 1.0)
    after = params.slope * y if y < 0.5 else params.slope * (1.0 - y)
    return base + after, side, 0 if y < 0.5 else 1


ls.register(Tents, image=_tents, branches=("left", "right"))


def measures(params, domain, cells, **options):
    return invariant_measures(ls.transitions(params, ls.grid(domain, cells=cells)), **options)


def test_doubling_map_is_uniform():
    (found,) = measures(ls.maps.Doubling(), [(0.0, 1.0)], 64)
    np.testing.assert_allclose(found.density, 1.0, rtol=0, atol=1e-11)
    assert found.weight.sum() == pytest.approx(1.0, abs=1e-12)
    assert found.residual <= 1e-12
    assert found.lost == 0.0


def test_baker_map_is_uniform():
    (found,) = measures(Baker(), [(0.0, 1.0), (0.0, 1.0)], 16)
    np.testing.assert_allclose(found.density, 1.0, rtol=0, atol=1e-10)


def arcsine(x):
    """Share of the time that the logistic map with r = 4 spends below x."""
    return 2.0 / np.pi * np.arcsin(np.sqrt(x))


def test_logistic_map_comes_near_the_arcsine_density():
    errors = []
    for cells in (1024, 4096, 16384):
        (found,) = measures(ls.maps.Logistic(4.0), [(0.0, 1.0)], cells)
        exact = np.diff(arcsine(np.linspace(0.0, 1.0, cells + 1)))
        errors.append(np.abs(found.weight - exact).sum())
    # The density grows as 1/sqrt(x) at the ends: an end cell holds, and gets wrong, a share of order sqrt(width), and
    # each step carries that on to four times the distance: sqrt(width) ln(1/width) in all.
    assert errors[0] < 0.15
    assert 0.5 < errors[1] / errors[0] < 0.5 * 12 / 10
    assert 0.5 < errors[2] / errors[1] < 0.5 * 14 / 12


def test_period_two_does_not_keep_the_chain_from_resting():
    (found,) = measures(Swap(2.0), [(0.0, 2.0)], 32)
    np.testing.assert_allclose(found.density, 0.5, rtol=0, atol=1e-11)


def test_two_attractors_have_a_measure_each():
    low, high = measures(Tents(1.9), [(0.0, 3.0)], 300)
    np.testing.assert_allclose(low.weight[:100], high.weight[200:], rtol=0, atol=1e-10)  # the same map twice
    assert low.weight[100:].sum() == high.weight[:200].sum() == 0.0
    assert low.weight[:100].sum() == pytest.approx(1.0, abs=1e-12)
    # It lives between the second and the first image of the top: 1.9 (1 - 0.95) = 0.095 and 0.95.
    first, last = np.flatnonzero(low.weight > 1e-9)[[0, -1]]
    assert first == 9
    assert last in (94, 95)  # 0.95 is a border


def test_attracting_cycle_holds_all_the_weight():
    (found,) = measures(ls.maps.Logistic(3.2), [(0.0, 1.0)], 4096)
    r = 3.2  # the cycle of period 2 solves r^2 x^2 - r (r + 1) x + r + 1 = 0
    points = (r + 1 + np.array([-1, 1]) * np.sqrt((r + 1) * (r - 3))) / (2 * r)
    edges = np.linspace(0.0, 1.0, 4097)
    middles = 0.5 * (edges[1:] + edges[:-1])
    for point in points:
        assert found.weight[np.abs(middles - point) < 2 / 4096].sum() == pytest.approx(0.5, abs=1e-9)


def test_nothing_stays():
    graph = ls.transitions(Linear2(xx=3.0, yy=3.0), ls.grid([(1.0, 2.0), (1.0, 2.0)], cells=8))
    assert invariant_measures(graph) == ()


# ----------------------------------------------------------------
# Topological entropy against closed forms.


def of_logistic(r):
    bands = limit_set_of(maps.Logistic(r), {0: [(0.05, 0.999)]}, UNIT).extents
    return topological_entropy(maps.Logistic(r), bands, UNIT)


@pytest.mark.parametrize(
    ("r", "entropy", "within"),
    [
        # F^2 on each of two bands is conjugate to the full tent map (Misiurewicz point, F^3(1/2) a fixed point)
        (3.678573510428322, 0.5 * math.log(2), 1e-8),
        # the set from 0.05 to 0.999 holds the repelling Cantor set beside the cycle: laps grow as Fibonacci numbers
        (3.83, math.log(0.5 * (1.0 + math.sqrt(5.0))), 1e-10),
        *((r, 0.0, 0.0) for r in (2.8, 3.2, 3.5)),  # before chaos
    ],
)
def test_entropies_of_the_logistic_map(r, entropy, within):
    assert of_logistic(r) == pytest.approx(entropy, rel=within, abs=0.0)


@pytest.mark.parametrize("slope", [1.3, 1.6180339887498949, 1.9])
def test_constant_slope(slope):
    # of a piecewise linear map of constant slope s it is ln s (Misiurewicz and Szlenk)
    params = maps.Doubling(slope)
    bands = limit_set_of(params, {0: [(0.0, 1.0)]}, UNIT).extents
    assert topological_entropy(params, bands, UNIT) == pytest.approx(math.log(slope), rel=1e-6)


@pytest.mark.parametrize("name", ["paper-initial-small-angle", "paper-designed-small-angle"])
def test_small_angle_feeders_have_the_logarithm_of_their_slope(name):
    scene = ls.load(name)
    bands = ls.limit_set(ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))).extents
    slope = 1.0 + 2.0 * abs(scene.surface_height) / scene.kappa
    found = topological_entropy(scene.map, bands, scene.domain)
    assert found == pytest.approx(math.log(slope), rel=1e-5)


def test_it_is_at_least_the_lyapunov_exponent():
    # Ruelle's inequality, and 0.206 per throw on the designed feeder
    scene = ls.load("paper-designed")
    bands = ls.limit_set(ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))).extents
    assert 0.2055 < topological_entropy(scene.map, bands, scene.domain) < math.log(2)


# ----------------------------------------------------------------
# Answers about a part are those about the same part in another unit: lengths scaled by a power of two, to the bit.


LENGTHS = ("kappa", "surface_height", "arm_length", "radius_of_gyration", "a", "d", "length")


def answers(params, domain):
    graph = ls.transitions(params, ls.grid(domain, cells=512))
    found = ls.attractors(graph, throws=2000)
    return graph, found, ls.limit_set(graph, found[0]), ls.critical_points(params, domain)


# From a part of 1e-11 lengths, below any absolute tolerance, by micrometres in metres, to kilometres in millimetres.
@pytest.mark.parametrize("power", [-40, -20, 20])
@pytest.mark.parametrize("name", ["paper-designed", "paper-initial"])
def test_scaled_by_a_power_of_two(name, power):
    scene, scale = ls.load(name), 2.0**power
    domain = scene.domain
    other = scene.map._replace(**{key: getattr(scene.map, key) * scale for key in LENGTHS})
    graph, found, limit, critical = answers(scene.map, domain)
    scaled = Domain(domain.lo * scale, domain.hi * scale, domain.anchor * scale)
    graph2, found2, limit2, critical2 = answers(other, scaled)
    for one, two in zip(graph.grid.edges, graph2.grid.edges, strict=True):
        np.testing.assert_array_equal(one[0] * scale, two[0])
    np.testing.assert_array_equal(graph.condensation().destination, graph2.condensation().destination)
    assert len(found) == len(found2) == 1
    assert found[0].lyapunov == found2[0].lyapunov
    assert found[0].jogs_per_visit == found2[0].jogs_per_visit
    assert limit.converged
    assert limit2.converged
    for side, pairs in limit.extents.items():
        assert [(lo * scale, hi * scale) for lo, hi in pairs] == limit2.extents[side]
    assert limit.extents.keys() == limit2.extents.keys()
    for side, points in critical.items():
        assert [point.x * scale for point in points] == [point.x for point in critical2[side]]
