"""Points of the window against the reference: a handful, and sixty of them, half of these next to boundaries."""

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.feeder.scene.arrays import throw_stack
from limitsets.systems.maps.pieces import point_of, stacked
from limitsets.systems.topology import topologies
from tests.topology.compare import differences
from tests.topology.reference import STARTS, reference
from tests.topology.window import points_of


def compared(stack, found, i, cells):
    """Fields in which a point of the window differs."""
    lo, hi = stack.lo[i], stack.hi[i]
    r = reference(point_of(stack.params, i), lo, hi, cells=cells, seed=i)
    return differences(found, i, r, STARTS, float((hi - lo).max()))


def test_reference_knows_the_logistic_map():
    # two bands for r below 3.678573510428322 (gap where F^3(1/2) has not reached 1 - 1/r), one above, a cycle of three
    two, one, three = (reference(maps.Logistic(r), [0.0], [1.0], cells=40_000) for r in (3.67, 3.7, 3.83))
    assert [len(r.attractors) for r in (two, one, three)] == [1, 1, 1]
    assert [len(r.attractors[0].bands[0]) for r in (two, one, three)] == [2, 1, 3]
    assert [r.attractors[0].period for r in (two, one, three)] == [0, 0, 3]
    lo, hi = one.attractors[0].bands[0][0]
    assert (lo, hi) == (pytest.approx(0.925 * (1 - 0.925) * 3.7), pytest.approx(0.925))


@pytest.mark.parametrize("name", ["paper-designed", pytest.param("paper-initial", marks=pytest.mark.sweep)])
def test_a_handful(name):
    # escape of some, of all, none of either, and the collapse
    scene = ls.load(name)
    stack = throw_stack(scene, {"arm.surface_height": [-2.0, -0.9, -0.31, 0.15]})
    found = topologies(stack.params, stack.lo, stack.hi, stack.anchor)
    for i in range(4):
        assert found.undecided[i] == 0
        assert compared(stack, found, i, 40_000) == {}


def test_throws_that_the_fast_search_for_the_impact_cannot_vouch_for():
    # kappa below the radius of the struck vertex on side 2, hypot(a, d) = 4.28 in: several impacts, and grazing
    scene = ls.load("paper-designed").with_values({"throw.kappa": "3.5 in"})
    assert maps.images(scene.map, np.linspace(5.0, 28.0, 100), 2).second_pass == 1.0
    stack = throw_stack(scene, {"arm.surface_height": [-0.6, 0.1]})
    found = topologies(stack.params, stack.lo, stack.hi, stack.anchor)
    assert found.attractors.tolist() == [1, 0]
    for i in range(2):
        assert found.undecided[i] == 0
        assert compared(stack, found, i, 40_000) == {}


def test_differences_are_seen():
    t = topologies(stacked([maps.Logistic(3.7)]), [[0.0]], [[1.0]])
    r = reference(maps.Logistic(3.69), [0.0], [1.0], cells=40_000)
    assert set(differences(t, 0, r, STARTS, 1.0)) == {"extents 0 0"}
    r = reference(maps.Logistic(3.66), [0.0], [1.0], cells=40_000)
    assert "bands 0 0" in differences(t, 0, r, STARTS, 1.0)
    r = reference(maps.Logistic(3.83), [0.0], [1.0], cells=40_000)
    assert "period 0" in differences(t, 0, r, STARTS, 1.0)


@pytest.mark.sweep
def test_sixty_points():
    points = points_of(ls.load("paper-designed"), 60, seed=12)
    found = points.found
    anywhere = ~points.at_boundary
    assert (found.undecided[anywhere] > 0).sum() <= 1  # two in a hundred of many
    for i in np.flatnonzero(found.undecided == 0):
        if compared(points.stack, found, i, 40_000):
            # what only the coarser cells say is their own error
            assert compared(points.stack, found, i, 160_000) == {}, points.places[i]
