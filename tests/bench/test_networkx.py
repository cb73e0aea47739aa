"""networkx's own function on our graph and on a networkx.DiGraph of the same edges."""

from __future__ import annotations

from dataclasses import replace

import networkx as nx
import pytest

import limitsets as ls
from tests.bench.measure import take_turns, versus

pytestmark = pytest.mark.bench

PLAIN, KEPT = "networkx.DiGraph", "ours, components kept from before"


def paper():
    scene = ls.load("paper-designed")
    return ls.transitions(scene.map, ls.grid(scene.domain, cells=33_334))


def leslie():
    return ls.transitions(ls.maps.Leslie(), ls.grid([(-0.001, 90), (-0.001, 70)], cells=(317, 316)))


@pytest.mark.parametrize("build", [paper, leslie])
def test_attracting_components(benchmark, build, table):
    graph = build()
    plain = graph.to_networkx()
    list(nx.attracting_components(graph))

    def cold():
        fresh = replace(graph)  # the same ranges, nothing computed yet
        return list(nx.attracting_components(fresh))

    rivals = {
        PLAIN: lambda: list(nx.attracting_components(plain)),
        KEPT: lambda: list(nx.attracting_components(graph)),
    }
    turns = take_turns(benchmark, cold, rivals, 7)
    for name in rivals:
        assert sorted(map(sorted, turns.answer)) == sorted(map(sorted, turns.answers[name]))
    what = f"nx.attracting_components, {build.__name__}, {graph.n_cells} cells"
    table += [versus(what, turns, PLAIN, unit="ms", faster=50), versus(what, turns, KEPT, unit="ms")]
