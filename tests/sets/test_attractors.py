"""Attractors, basins and ways out: numbers from theory and from the paper's scenes."""

import math

import numpy as np
import pytest

import limitsets as ls
from limitsets.cells import Domain
from limitsets.errors import AnswerError
from limitsets.maps import INWARD, UNDECIDED
from limitsets.sets.attractors import _visits

SCENES = ["paper-initial-small-angle", "paper-designed-small-angle", "paper-initial", "paper-designed"]


@pytest.fixture(scope="module", params=SCENES)
def scene(request):
    return ls.load(request.param)


def test_each_paper_scene_has_one_attractor_and_everything_leads_to_it(scene):
    graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))
    found = ls.attractors(graph, throws=1000)
    share = ls.basins(graph, found)
    assert len(found) == 1
    assert (share.labels == 0).all()
    assert share.attractors == (pytest.approx(1.0, abs=1e-12),)
    assert share.undecided_between == 0.0
    assert set(share.exits.values()) == {0.0}
    assert found[0].in_cells == 1.0


def test_the_lyapunov_exponent_of_constant_slopes_is_their_logarithm():
    for name in SCENES[:2]:
        scene = ls.load(name)
        graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=2048))
        theory = math.log(1.0 + 2.0 * abs(scene.map.surface_height) / scene.map.kappa)
        assert ls.attractors(graph, throws=1000)[0].lyapunov == pytest.approx(theory, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "exponent", "flips"), [("paper-initial", 0.099, 0.1998), ("paper-designed", 0.206, 0.3191)]
)
def test_long_orbits_of_the_exact_scenes(name, exponent, flips):
    scene = ls.load(name)
    found = ls.attractors(ls.transitions(scene.map, ls.grid(scene.domain, cells=2048)), throws=1_000_000)[0]
    assert found.lyapunov == pytest.approx(exponent, abs=1e-3)
    assert found.flips_per_throw == pytest.approx(flips, abs=5e-4)
    assert found.flip_order == (0, 1, 2)


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


def test_an_orbit_may_leave_what_the_cells_promise_and_says_so():
    """Centres alone miss images: the share of the orbit inside the cells tells."""
    graph = ls.transitions(ls.maps.Henon(1.4, 0.3), ls.grid([(-2, 2), (-2, 2)], cells=64), method="centres")
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
