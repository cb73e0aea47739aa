"""Atlases of maps of several coordinates by their Morse graphs, and the proofs of a window of them."""

import networkx as nx
import pytest

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.parameters.atlas.parameter_atlas import MORSE, TOPOLOGY, plan_of

WINDOW = "young=19:20:2", "old=21:22:3"
DOMAIN = [(-0.001, 90.0), (-0.001, 70.0)]


@pytest.fixture(scope="module")
def leslie():
    return ls.atlas(ls.maps.Leslie(), *WINDOW, options={"cells": 64}, workers=1)


def test_the_morse_graph_of_each_point_is_that_of_networkx(leslie):
    assert leslie.dataset.sizes == {"old": 3, "young": 2}
    for point in ((0, 0), (2, 1)):
        values = {
            name: float(leslie.dataset[name][k]) for name, k in zip(("old", "young"), point, strict=True)
        }
        graph = ls.transitions(ls.maps.Leslie(**values), ls.grid(DOMAIN, cells=64)).to_networkx()
        recurrent = [
            cells for cells in nx.strongly_connected_components(graph)
            if max(cells) < 64**2 and (len(cells) > 1 or graph.has_edge(*cells, *cells))
        ]  # fmt: skip
        attracting = [cells for cells in nx.attracting_components(graph) if cells in recurrent]
        answer = {name: leslie.dataset[name].values[point] for name in leslie.dataset}
        assert answer["recurrent"] == len(recurrent)
        assert answer["attractors"] == len(attracting)
        assert answer["attracting_share"] == pytest.approx(sum(map(len, attracting)) / 64**2)


def test_its_window_is_proved_between_the_first_and_the_last_values(leslie):
    found = leslie.certify(ls.grid(DOMAIN, cells=64), ["trapping", "basin"], first=1, depth=3)
    assert {axis.quantity: (axis.borders[0], axis.borders[-1]) for axis in found.axes} == {
        "young": (19, 20),
        "old": (21, 22),
    }
    assert sum(found.shares().values()) == 1
    assert len(found.index) >= 2


def test_arguments_of_the_other_kind_of_atlas_are_refused(leslie):
    with pytest.raises(LimitsetsError, match="the argument grid of certify"):
        leslie.certify()
    with pytest.raises(LimitsetsError, match="the argument executor of certify"):
        leslie.certify(ls.grid(DOMAIN, cells=64), executor=object())
    scene = ls.atlas(
        "paper-designed",
        "throw.speed=157 deg/s:158 deg/s:2",
        task="limitsets.parameters.atlas.examples:critical_points",
        workers=1,
    )
    assert scene.map is None
    with pytest.raises(LimitsetsError, match="the arguments of certify is 'grid, seconds'"):
        scene.certify(ls.grid(DOMAIN, cells=64), seconds=3.0)


def test_what_is_asked_depends_on_the_coordinates():
    assert plan_of(ls.maps.Logistic(), "r=2.8:3.2:2").task == TOPOLOGY
    assert plan_of(ls.maps.Leslie(), *WINDOW).task == MORSE
