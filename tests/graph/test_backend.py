"""networkx's own functions on the graph give what they give on the graph written out."""

import subprocess
import sys

import networkx as nx
import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError


@pytest.fixture(scope="module")
def graph():
    scene = ls.load("paper-designed")
    return ls.transitions(scene.map, ls.grid(scene.domain, cells=150))


@pytest.fixture(scope="module")
def plain(graph):
    return graph.to_networkx()


def same(one, two):
    return sorted(map(sorted, one)) == sorted(map(sorted, two))


def test_components(graph, plain):
    assert same(nx.strongly_connected_components(graph), nx.strongly_connected_components(plain))
    assert same(nx.attracting_components(graph), nx.attracting_components(plain))
    assert nx.number_strongly_connected_components(graph) == nx.number_strongly_connected_components(plain)
    assert nx.number_attracting_components(graph) == nx.number_attracting_components(plain)
    assert nx.is_strongly_connected(graph) is nx.is_strongly_connected(plain) is False
    assert nx.is_attracting_component(graph) is nx.is_attracting_component(plain) is False


def test_sinks_are_attracting_components_to_networkx(graph):
    sinks = [{graph.n_cells + e} for e in range(4)]
    found = list(nx.attracting_components(graph))
    assert all(sink in found for sink in sinks)
    assert all(graph.successors(min(sink)).tolist() == sorted(sink) for sink in sinks)


@pytest.mark.parametrize("given", [False, True])
def test_condensation(graph, plain, given):
    components = list(nx.strongly_connected_components(plain)) if given else None
    ours = nx.condensation(graph, scc=components)
    oracle = nx.condensation(plain, scc=components)
    assert same(
        nx.get_node_attributes(ours, "members").values(), nx.get_node_attributes(oracle, "members").values()
    )
    assert all(node in ours.nodes[ours.graph["mapping"][node]]["members"] for node in plain)

    def edges(dense):
        members = nx.get_node_attributes(dense, "members")
        return {(min(members[a]), min(members[b])) for a, b in dense.edges}

    assert edges(ours) == edges(oracle)


def test_reachability_from_cells_and_sinks(graph, plain):
    for node in [0, 17, 200, 449, graph.n_cells, graph.n_cells + 1, graph.n_cells + 2, graph.n_cells + 3]:
        assert nx.descendants(graph, node) == nx.descendants(plain, node)
        assert nx.ancestors(graph, node) == nx.ancestors(plain, node)


def test_a_node_that_is_none_is_networkx_own_error(graph):
    with pytest.raises(nx.NetworkXError, match="not in the digraph"):
        nx.descendants(graph, 10**9)
    with pytest.raises(AnswerError, match="integer from 0"):
        graph.successors(-1)


def test_the_rest_of_networkx_by_conversion(graph, plain):
    assert nx.number_weakly_connected_components(
        graph.to_networkx()
    ) == nx.number_weakly_connected_components(plain)
    before = nx.config.fallback_to_nx
    try:
        nx.config.fallback_to_nx = True
        assert nx.number_weakly_connected_components(graph) == nx.number_weakly_connected_components(plain)
    finally:
        nx.config.fallback_to_nx = before


def test_every_node_but_none_has_successors(graph):
    assert all(graph.successors(node).size for node in graph)
    assert len(graph) == graph.number_of_nodes() == graph.n_cells + 4
    assert graph.is_directed()
    assert not graph.is_multigraph()


def test_components_gives_labels_without_making_sets(graph):
    label = graph.components().label
    assert isinstance(label, np.ndarray)
    assert label.dtype == np.int32


def test_importing_networkx_does_not_import_us():
    code = "import networkx, sys; sys.exit(any(name.split('.')[0] == 'limitsets' for name in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
