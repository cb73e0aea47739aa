"""Graphs with answers known from the field or on paper."""

import networkx as nx
import numpy as np
import pytest

import limitsets as ls
from limitsets.systems.cells import CellSet
from tests.maps_of_tests import Linear2, Product, ThreeState, TwoState

# Leslie's map on dyadic cells, corners + one cell: cells, edges, recurrent components (cells) from the top of the
# order to the attractor. Published example of CMGDB; its counts were reproduced with CMGDB 1.5.2.
LESLIE = [
    (12, 4096, 48384, [1, 1128]),
    (14, 16384, 202269, [1, 3542]),
    (16, 65536, 837188, [1, 8636, 851]),
]


@pytest.mark.parametrize(("depth", "cells", "edges", "chain"), LESLIE)
def test_leslie(depth, cells, edges, chain):
    graph = ls.transitions(
        ls.maps.Leslie(), ls.grid([(-0.001, 90), (-0.001, 70)], depth=depth), method="corners-padded"
    )
    assert graph.n_cells == cells
    assert graph.number_of_cell_edges() == edges
    morse = ls.morse_graph(graph)
    path = nx.dag_longest_path(morse)
    assert [morse.nodes[k]["cells"] for k in path] == chain
    assert morse.number_of_nodes() == len(chain)
    assert morse.number_of_edges() == len(chain) - 1
    assert [morse.nodes[k]["attracting"] for k in path] == [False] * (len(chain) - 1) + [True]


@pytest.mark.parametrize("cells", [(64, 32), (128, 128)])
def test_the_product_map_recurs_at_its_four_fixed_points_in_diamond_order(cells):
    """Beside a fixed point of slope 2 a cell at less than its own width from it meets its image, so each fixed point
    has several one-cell components; none lies elsewhere, and between fixed points the order is the diamond."""
    graph = ls.transitions(Product(), ls.grid([(0, 1.2), (0, 1.2)], cells=cells), method="corners")
    morse = ls.morse_graph(graph)
    width = 1.2 / np.array(cells)
    at = {}
    for k, data in morse.nodes(data=True):
        lo, hi = graph.grid.boxes(data["members"].numbers(), 0)
        near = [
            point
            for point in [(0, 0), (0, 1), (1, 0), (1, 1)]
            if (lo - 2 * width <= point).all() and (point <= hi + 2 * width).all()
        ]
        assert len(near) == 1
        at[k] = near[0]
    assert set(at.values()) == {(0, 0), (0, 1), (1, 0), (1, 1)}
    order = {(at[a], at[b]) for a, b in nx.transitive_closure_dag(morse).edges if at[a] != at[b]}
    assert order == {
        ((1, 1), (1, 0)),
        ((1, 1), (0, 1)),
        ((1, 1), (0, 0)),
        ((1, 0), (0, 0)),
        ((0, 1), (0, 0)),
    }
    assert [at[k] for k, data in morse.nodes(data=True) if data["attracting"]] == [(0, 0)]


def test_a_line_of_fixed_points_is_covered():
    """F = (x, y/2): the x axis attracts, and each of its cells is recurrent."""
    graph = ls.transitions(
        Linear2(1.0, 0.0, 0.0, 0.5), ls.grid([(-1, 1), (-1, 1)], cells=32), method="corners"
    )
    recurrent = graph.recurrent_set()
    axis = CellSet.of(
        graph.grid, graph.grid.index(np.stack([graph.grid.edges[0][0], np.zeros(33)], axis=1), 0)
    )
    assert axis <= recurrent


def test_the_unstable_set_of_a_saddle_covers_its_axis():
    """diag(0.5, 2): what can be reached from the fixed point's cell covers the y axis."""
    graph = ls.transitions(
        Linear2(0.5, 0.0, 0.0, 2.0), ls.grid([(-1, 1), (-1, 1)], cells=33), method="corners"
    )
    (origin,) = graph.grid.index([[0.0, 0.0]], 0)
    reached = [n for n in nx.descendants(graph, int(origin)) if n < graph.n_cells]
    middles = graph.grid.centres(0)
    axis = CellSet.of(graph.grid, np.flatnonzero(np.abs(middles[:, 0]) < 1e-9))
    assert len(axis) == 33
    assert axis <= CellSet.of(graph.grid, [*reached, int(origin)])


@pytest.mark.parametrize("method", ["corners", "corners-padded"])
def test_two_states_share_the_square(method):
    graph = ls.transitions(TwoState(1.0), ls.grid([(-2, 2), (-2, 2)], cells=32), method=method)
    found = ls.attractors(graph)
    share = ls.basins(graph, found)
    assert len(found) == 2
    # corners see both branches in the cells along x = 0, one column or two of 32
    assert share.attractors == pytest.approx((0.5, 0.5), abs=1 / 32)
    assert sum(share.attractors) + share.undecided_between == pytest.approx(1.0, abs=1e-12)


def test_one_state_for_small_r():
    graph = ls.transitions(TwoState(0.3), ls.grid([(-2, 2), (-2, 2)], cells=32), method="corners")
    assert len(ls.attractors(graph)) == 1


def test_three_states_and_no_cell_without_a_label():
    graph = ls.transitions(ThreeState(), ls.grid([(-3, 3)], cells=60))
    found = ls.attractors(graph)
    share = ls.basins(graph, found)
    assert len(found) == 3
    assert share.attractors == pytest.approx((1 / 3, 1 / 3, 1 / 3), abs=2 / 60)
    assert sum(share.attractors) + share.undecided_between == pytest.approx(1.0, abs=1e-12)


def test_the_cubic_map_has_two_attractors_and_an_edge_state():
    graph = ls.transitions(ls.maps.Cubic(1.5), ls.grid([(-1.2, 1.2)], cells=2049))
    found = ls.attractors(graph)
    ends = sorted(np.mean(part) for a in found for part in a.extents[0])
    assert ends == pytest.approx([-np.sqrt(0.5), np.sqrt(0.5)], abs=2e-3)
    repelling = [data for _, data in ls.morse_graph(graph).nodes(data=True) if not data["attracting"]]
    assert any(lo <= 0.0 <= hi for data in repelling for lo, hi in data["extents"][0])


def test_spurious_recurrent_cells_are_told_from_dynamics():
    """Logistic r = 1.4: orbits run from 0 to 2/7; whatever else recurs is an artefact of the padding."""
    from limitsets.systems.sets import spurious

    graph = ls.transitions(ls.maps.Logistic(1.4), ls.grid([(0, 1)], depth=10), method="corners-padded")
    false = spurious(graph)
    genuine = len(ls.morse_graph(graph)) - len(false)
    assert len(false) >= 1
    assert genuine == 2
    assert not any(0 in cells for cells in false)
    (fixed,) = graph.grid.index([2 / 7], 0)
    assert not any(int(fixed) in cells for cells in false)


@pytest.mark.parametrize("method", ["end-points", "corners", "corners-padded"])
def test_a_cell_on_which_the_flip_is_undecided_gets_the_image_of_both_branches(method):
    scene = ls.load("paper-designed")
    graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=64), method=method)
    (cell,) = graph.grid.index([20.0], 2)  # r_2 = 20 to 1e-6, no cell border
    successors = graph.successors(int(cell))
    assert set(graph.grid.side_of(successors[successors < graph.n_cells]).tolist()) == {0, 2}


@pytest.mark.parametrize("method", ["end-points", "corners", "corners-padded"])
def test_images_of_cells_hold_the_images_of_their_points(method):
    scene = ls.load("paper-initial")
    graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=300), method=method)
    rng = np.random.default_rng(1)
    for side in range(3):
        x = rng.uniform(scene.domain.lo[side, 0], scene.domain.hi[side, 0], 3000)
        got = ls.maps.images(scene.map, x, side)
        cells = graph.grid.index(x, side)
        for k in np.flatnonzero(got.code >= 0):
            (target,) = graph.grid.index([got.x[k]], int(got.side[k]))
            assert target in graph.successors(int(cells[k]))
