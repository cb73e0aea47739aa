"""Every algorithm on ranges against scipy and networkx on the graph written out edge by edge."""

from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse
from scipy.sparse import csgraph

import limitsets as ls
from limitsets.systems.cells import Grid
from limitsets.systems.graph.components import descend, reach, strong_components
from limitsets.systems.graph.graph import TransitionGraph
from limitsets.systems.graph.ranges import build, count_edges, expand
from limitsets.systems.maps import UNDECIDED


@st.composite
def graphs(draw):
    """Random boxes: one to three dimensions, one to three sides, several boxes, empty images, ways out."""
    dimension = draw(st.integers(1, 3))
    sides = draw(st.integers(1, 3))
    sizes = [
        tuple(draw(st.integers(1, 4 if dimension > 1 else 12)) for _ in range(dimension))
        for _ in range(sides)
    ]
    of_one = ls.grid([(0, 1)] * dimension, cells=1).domain
    domain = replace(of_one, lo=of_one.lo.repeat(sides, 0), hi=of_one.hi.repeat(sides, 0))
    edges = tuple(tuple(np.linspace(0, 1, n + 1) for n in size) for size in sizes)
    grid = Grid(domain, edges)
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    first, side, lo, hi = [0], [], [], []
    for _ in range(grid.n_cells):
        for _ in range(rng.integers(0, 3)):
            s = int(rng.integers(sides))
            a, b = (rng.integers(0, sizes[s]) for _ in range(2))
            side.append(s)
            lo.append(np.minimum(a, b))
            hi.append(np.minimum(np.maximum(a, b), np.minimum(a, b) + 2))
        first.append(len(side))
    exits = rng.choice([0, 0, 0, 1], grid.n_cells).astype(np.uint8)
    shape = (len(side), dimension)
    return TransitionGraph(
        ls.maps.Logistic(1.0),
        grid,
        build(
            grid,
            np.array(first),
            np.array(side, dtype=np.int32),
            np.array(lo, dtype=np.int32).reshape(shape),
            np.array(hi, dtype=np.int32).reshape(shape),
            exits,
        ),
        "made up",
    )


def matrix(graph):
    pointer, targets = expand(graph.ranges)
    return sparse.csr_matrix((np.ones(targets.size), targets, pointer), shape=(graph.n_cells, graph.n_cells))


@given(graphs())
@settings(max_examples=150)
def test_edges_are_those_of_the_boxes(graph):
    pointer, targets = expand(graph.ranges)
    assert count_edges(graph.ranges) == targets.size
    for cell in range(graph.n_cells):
        inside = targets[pointer[cell] : pointer[cell + 1]]
        reached = graph.successors(cell)
        assert np.array_equal(inside, reached[reached < graph.n_cells])
    assert graph.to_networkx().number_of_edges() == graph.number_of_edges()
    assert graph.to_networkx().number_of_nodes() == graph.number_of_nodes()


@given(graphs())
@settings(max_examples=150)
def test_components_agree_with_scipy_and_come_in_topological_order(graph):
    parts = strong_components(graph.ranges)
    count, oracle = csgraph.connected_components(matrix(graph), connection="strong")
    assert parts.count == count
    assert len({*zip(parts.label.tolist(), oracle.tolist(), strict=True)}) == count  # a renaming, one to one
    pointer, targets = expand(graph.ranges)
    sources = np.repeat(np.arange(graph.n_cells), np.diff(pointer))
    assert (parts.label[targets] <= parts.label[sources]).all()
    assert np.array_equal(np.sort(parts.order), np.arange(graph.n_cells))
    assert (np.diff(parts.label[parts.order]) >= 0).all()
    loops = np.zeros(count, dtype=bool)
    loops[parts.label[sources[sources == targets]]] = True
    assert np.array_equal(parts.recurrent, loops | (parts.size > 1))


@given(graphs())
@settings(max_examples=100)
def test_reachability_agrees_with_networkx(graph):
    plain = graph.to_networkx()
    parts = strong_components(graph.ranges)
    target = graph.n_cells // 2
    marks = np.zeros(graph.n_cells, dtype=np.uint8)
    marks[target] = 1
    found = set(np.flatnonzero(reach(graph.ranges, parts, marks)).tolist())
    assert found == nx.ancestors(plain, target) | {target}
    seen = set(np.flatnonzero(descend(graph.ranges, np.array([target]))).tolist())
    sinks = set(range(graph.n_cells, len(graph)))
    assert seen | {target} == (nx.descendants(plain, target) | {target}) - sinks


@given(graphs())
@settings(max_examples=100)
def test_destinations_agree_with_networkx(graph):
    plain = graph.to_networkx()
    ends = [set(part) for part in nx.attracting_components(plain)]
    found = graph.condensation()
    recurrent = graph.recurrent_components()
    attractors = [
        set(cells.tolist()) for cells, good in zip(recurrent, found.attracting, strict=True) if good
    ]
    left = {
        int(c) for cells, good in zip(recurrent, found.attracting, strict=True) if not good for c in cells
    }
    assert sorted(map(sorted, attractors)) == sorted(
        sorted(part)
        for part in ends
        if min(part) < graph.n_cells and (len(part) > 1 or plain.has_edge(*2 * tuple(part)))
    )
    for cell in range(graph.n_cells):
        reachable = nx.descendants(plain, cell) | {cell}
        numbers = [k for k, part in enumerate(attractors) if part & reachable]
        codes = [code for e, code in enumerate(graph.exits.values()) if graph.n_cells + e in reachable]
        options = numbers + codes
        if len(options) > 1 or reachable & left:  # a set that is not closed may hold an orbit
            assert found.destination[cell] == UNDECIDED
        elif len(options) == 1:
            assert found.destination[cell] == options[0]


@pytest.mark.parametrize("count", [3, 60, 130])
def test_more_components_than_one_sweep_holds(count):
    """A chain of `count` fixed cells with a transient cell between neighbours: the order is a chain."""
    n = 2 * count - 1
    grid = ls.grid([(0.0, 1.0)], cells=n)
    rows = np.arange(n)
    # An even cell leads to itself and the odd one below it, an odd cell to the even one below it.
    lo, hi = np.where(rows % 2 == 0, np.maximum(rows - 1, 0), rows - 1)[:, None], rows[:, None].copy()
    hi[rows % 2 == 1] -= 1
    ranges = build(
        grid,
        np.arange(n + 1),
        np.zeros(n, np.int32),
        lo.astype(np.int32),
        hi.astype(np.int32),
        np.zeros(n, np.uint8),
    )
    graph = TransitionGraph(ls.maps.Logistic(1.0), grid, ranges, "made up")
    morse = ls.morse_graph(graph)
    assert len(morse) == count
    assert nx.is_directed_acyclic_graph(morse)
    assert nx.dag_longest_path_length(morse) == count - 1
    assert morse.number_of_edges() == count - 1
    assert (graph.condensation().destination[:2] == 0).all()
    assert (
        graph.condensation().destination[2:] == UNDECIDED
    ).all()  # from there on an unstable cell can be reached
