"""Attractors, basins and ways out: what cells, labels and visits say (the paper's scenes: tests/test_paper.py)."""

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.systems.cells import Domain
from limitsets.systems.maps import INWARD, UNDECIDED
from limitsets.systems.sets.attracting import _visits
from tests.maps_of_tests import with_middles


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


def test_undecided_cells_are_a_state_of_their_own():
    domain = Domain([[-1.3]], [[1.3]])
    graph = ls.transitions(ls.maps.Cubic(1.5), ls.grid(domain, cells=101))
    share = ls.basins(graph, ls.attractors(graph, throws=1000))
    (middle,) = graph.grid.index([0.0], 0)
    assert share.labels[middle] == UNDECIDED
    assert share.undecided_between > 0.0
    assert share.attractors[0] == pytest.approx(share.attractors[1], rel=1e-9)


def test_extents_in_the_plane_are_a_box_for_each_piece():
    params = ls.maps.Henon(0.9, 0.3)  # a stable cycle of period 2, between a = 0.3675 and 0.9125
    found = ls.attractors(ls.transitions(params, ls.grid([(-2, 2), (-1, 1)], cells=256)), throws=1000)[0]
    roots = np.roots([0.81, -0.9 * 0.7, 0.49 - 0.9])  # of a^2 x^2 - a (1 - b) x + (1 - b)^2 - a
    assert len(found.extents[0]) == 2
    for root, other in (roots, roots[::-1]):  # y is 0.3 times the x before
        assert any(
            lo <= root <= hi and low <= 0.3 * other <= high for (lo, hi), (low, high) in found.extents[0]
        )
    assert found.table().heads == ["side", "x[0]", "x[1]", "jogs per visit"]
