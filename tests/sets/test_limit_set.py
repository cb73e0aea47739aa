"""End points of limit sets: from sets of any size, 40-digit orbits of the origins, maps on paper."""

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.base.errors import AnswerError
from limitsets.systems.cells import as_domain
from limitsets.systems.sets import limit_set_of
from tests.sets.part import Part
from tests.test_paper import LIMIT_SETS

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


def test_from_the_cells_of_a_graph():
    scene = ls.load("paper-designed")
    graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))
    assert_same(ls.limit_set(graph).extents, LIMIT_SETS["paper-designed"], 1e-12)
    assert_same(ls.limit_set(graph, ls.attractors(graph)[0]).extents, LIMIT_SETS["paper-designed"], 1e-12)


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
    with pytest.raises(AnswerError, match="side of the set"):
        limit_set_of(scene.map, {3: [(4.0, 5.0)]}, scene.domain)
