"""Components, order and basins: known answers, oracles, long chains, the networkx backend."""

import subprocess
import sys
from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import sparse
from scipy.sparse import csgraph

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.systems.cells import CellSet, Grid
from limitsets.systems.graph import components as walk, segment_tree
from limitsets.systems.graph.components import descend, reach, strong_components
from limitsets.systems.graph.graph import TransitionGraph
from limitsets.systems.graph.ranges import RUN, START, build, count_edges, expand
from limitsets.systems.maps import UNDECIDED
from tests.graph.long_chains import check_cycle, check_path
from tests.maps_of_tests import Linear2, Product, ThreeState, TwoState

# ----------------------------------------------------------------
# Graphs with answers known from the field or on paper.


# Leslie's map on dyadic cells, corners + one cell: cells, edges, recurrent components (cells) from the top of the
# order to the attractor. Published example of CMGDB; its counts were reproduced with CMGDB 1.5.2.
LESLIE = [
    (12, 4096, 48384, [1, 1128]),
    (14, 16384, 202269, [1, 3542]),
    (16, 65536, 837188, [1, 8636, 851]),
]


@pytest.mark.parametrize(("depth", "cells", "edges", "chain"), LESLIE)
def test_leslie(depth, cells, edges, chain):
    rectangle = ls.grid([(-0.001, 90), (-0.001, 70)], depth=depth)
    graph = ls.transitions(ls.maps.Leslie(), rectangle, method="corners-padded")
    assert graph.n_cells == cells
    assert graph.number_of_cell_edges() == edges
    morse = ls.morse_graph(graph)
    path = nx.dag_longest_path(morse)
    assert [morse.nodes[k]["cells"] for k in path] == chain
    assert morse.number_of_nodes() == len(chain)
    assert morse.number_of_edges() == len(chain) - 1
    assert [morse.nodes[k]["attracting"] for k in path] == [False] * (len(chain) - 1) + [True]


CORNERS = [(0, 0), (1, 0), (0, 1), (1, 1)]


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
        close = [((lo - 2 * width <= point) & (point <= hi + 2 * width)).all() for point in CORNERS]
        assert sum(close) == 1
        at[k] = CORNERS[close.index(True)]
    assert set(at.values()) == set(CORNERS)
    order = {(at[a], at[b]) for a, b in nx.transitive_closure_dag(morse).edges if at[a] != at[b]}
    low, right, up, high = CORNERS
    assert order == {(high, right), (high, up), (high, low), (right, low), (up, low)}
    assert [at[k] for k, data in morse.nodes(data=True) if data["attracting"]] == [(0, 0)]


def linear(x, y, cells):
    """Graph of the map (x, y) -> (x * first, y * second) on a square."""
    return ls.transitions(Linear2(x, 0.0, 0.0, y), ls.grid([(-1, 1), (-1, 1)], cells=cells), method="corners")


def test_a_line_of_fixed_points_is_covered():
    """F = (x, y/2): the x axis attracts, and each of its cells is recurrent."""
    graph = linear(1.0, 0.5, 32)
    places = np.stack([graph.grid.edges[0][0], np.zeros(33)], axis=1)
    assert CellSet.of(graph.grid, graph.grid.index(places, 0)) <= graph.recurrent_set()


def test_the_unstable_set_of_a_saddle_covers_its_axis():
    """diag(0.5, 2): what can be reached from the fixed point's cell covers the y axis."""
    graph = linear(0.5, 2.0, 33)
    (origin,) = graph.grid.index([[0.0, 0.0]], 0)
    reached = [n for n in nx.descendants(graph, int(origin)) if n < graph.n_cells]
    middles = graph.grid.centres(0)
    axis = CellSet.of(graph.grid, np.flatnonzero(np.abs(middles[:, 0]) < 1e-9))
    assert len(axis) == 33
    assert axis <= CellSet.of(graph.grid, [*reached, int(origin)])


@pytest.mark.parametrize(
    ("params", "domain", "cells", "method", "states"),
    [
        # corners see both branches in the cells along x = 0, one column or two of 32
        (TwoState(1.0), [(-2, 2), (-2, 2)], 32, "corners", 2),
        (TwoState(1.0), [(-2, 2), (-2, 2)], 32, "corners-padded", 2),
        (TwoState(0.3), [(-2, 2), (-2, 2)], 32, "corners", 1),
        (ThreeState(), [(-3, 3)], 60, None, 3),
    ],
)
def test_equal_states_share_the_domain_and_no_cell_is_without_a_label(params, domain, cells, method, states):
    graph = ls.transitions(params, ls.grid(domain, cells=cells), method)
    found = ls.attractors(graph)
    share = ls.basins(graph, found)
    assert len(found) == states
    assert share.attractors == pytest.approx((1 / states,) * states, abs=1 / 30)
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


METHODS = pytest.mark.parametrize("method", ["end-points", "corners", "corners-padded"])


@METHODS
def test_a_cell_on_which_the_flip_is_undecided_gets_the_image_of_both_branches(method):
    scene = ls.load("paper-designed")
    graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=64), method=method)
    (cell,) = graph.grid.index([20.0], 2)  # r_2 = 20 to 1e-6, no cell border
    successors = graph.successors(int(cell))
    assert set(graph.grid.side_of(successors[successors < graph.n_cells]).tolist()) == {0, 2}


def below_the_break(x):
    return 0.5 * x


def steep_from_the_break(x, at):
    return 0.95 - 100.0 * (x - at)


def past_the_break(x, at):
    return x - at


def test_what_a_branch_does_right_beside_its_end_is_seen():
    """From 0.95 at x = 0.453 the image falls to 0.625 within a sixteenth of the cell, and below 0 within the cell."""
    params = ls.map(pieces=(below_the_break, steep_from_the_break), margin=past_the_break, at=0.453)
    graph = ls.transitions(params, ls.grid([(0.0, 1.0)], cells=10), "end-points")
    reached = graph.successors(4)
    assert reached[reached < 10].tolist() == list(range(10))


@METHODS
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


# ----------------------------------------------------------------
# Every algorithm on ranges against scipy and networkx on the graph written out edge by edge.


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
    ends = (np.array(bound, dtype=np.int32).reshape(shape) for bound in (lo, hi))
    ranges = build(grid, np.array(first), np.array(side, dtype=np.int32), *ends, exits)
    return TransitionGraph(ls.maps.Logistic(1.0), grid, ranges, "made up")


@given(graphs())
@settings(max_examples=60)
def test_edges_are_those_of_the_boxes_and_components_those_of_scipy_in_topological_order(graph):
    pointer, targets = expand(graph.ranges)
    assert count_edges(graph.ranges) == targets.size
    for cell in range(graph.n_cells):
        inside = targets[pointer[cell] : pointer[cell + 1]]
        reached = graph.successors(cell)
        assert np.array_equal(inside, reached[reached < graph.n_cells])
    assert graph.to_networkx().number_of_edges() == graph.number_of_edges()
    assert graph.to_networkx().number_of_nodes() == graph.number_of_nodes()
    parts = strong_components(graph.ranges)
    matrix = sparse.csr_matrix(
        (np.ones(targets.size), targets, pointer), shape=(graph.n_cells, graph.n_cells)
    )
    count, oracle = csgraph.connected_components(matrix, connection="strong")
    assert parts.count == count
    assert len({*zip(parts.label.tolist(), oracle.tolist(), strict=True)}) == count  # a renaming, one to one
    sources = np.repeat(np.arange(graph.n_cells), np.diff(pointer))
    assert (parts.label[targets] <= parts.label[sources]).all()
    assert np.array_equal(np.sort(parts.order), np.arange(graph.n_cells))
    assert (np.diff(parts.label[parts.order]) >= 0).all()
    loops = np.zeros(count, dtype=bool)
    loops[parts.label[sources[sources == targets]]] = True
    assert np.array_equal(parts.recurrent, loops | (parts.size > 1))


@given(graphs())
@settings(max_examples=40)
def test_reachability_and_destinations_agree_with_networkx(graph):
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
    found, recurrent = graph.condensation(), graph.recurrent_components()
    attractors = [
        set(cells.tolist()) for cells, good in zip(recurrent, found.attracting, strict=True) if good
    ]
    left = {
        int(c) for cells, good in zip(recurrent, found.attracting, strict=True) if not good for c in cells
    }
    ends = [sorted(part) for part in nx.attracting_components(plain)]
    closed = [part for part in ends if len(part) > 1 or plain.has_edge(part[0], part[0])]
    assert sorted(map(sorted, attractors)) == sorted(part for part in closed if part[0] < graph.n_cells)
    for cell in range(graph.n_cells):
        reachable = nx.descendants(plain, cell) | {cell}
        numbers = [k for k, part in enumerate(attractors) if part & reachable]
        codes = [code for e, code in enumerate(graph.exits.values()) if graph.n_cells + e in reachable]
        options = numbers + codes
        if len(options) > 1 or reachable & left:  # a set that is not closed may hold an orbit
            assert found.destination[cell] == UNDECIDED
        elif len(options) == 1:
            assert found.destination[cell] == options[0]


def on_a_line(lo, hi):
    """A box of neighbours for each cell of a line."""
    n = lo.size
    ends = (bound[:, None].astype(np.int32) for bound in (lo, hi))
    grid = ls.grid([(0.0, 1.0)], cells=n)
    return build(grid, np.arange(n + 1), np.zeros(n, np.int32), *ends, np.zeros(n, np.uint8))


@pytest.mark.parametrize("count", [3, 60, 130])
def test_more_components_than_one_sweep_holds(count):
    """A chain of `count` fixed cells with a transient cell between neighbours: the order is a chain."""
    n = 2 * count - 1
    rows = np.arange(n)
    # An even cell leads to itself and the odd one below it, an odd cell to the even one below it.
    lo, hi = np.where(rows % 2 == 0, np.maximum(rows - 1, 0), rows - 1), rows - rows % 2
    ranges = on_a_line(lo, hi)
    graph = TransitionGraph(ls.maps.Logistic(1.0), ls.grid([(0.0, 1.0)], cells=n), ranges, "made up")
    morse = ls.morse_graph(graph)
    assert len(morse) == count
    assert nx.is_directed_acyclic_graph(morse)
    assert nx.dag_longest_path_length(morse) == count - 1
    assert morse.number_of_edges() == count - 1
    assert (graph.condensation().destination[:2] == 0).all()
    # from there on an unstable cell can be reached
    assert (graph.condensation().destination[2:] == UNDECIDED).all()


# ----------------------------------------------------------------
# The tree algorithms for wide images against the walk over edges, and what they are for: width costs nothing.


@st.composite
def range_graphs(draw):
    """One to three boxes per cell, or none, of any width; some cells leave."""
    n = draw(st.integers(1, 70))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    longest = draw(st.sampled_from([1, 3, 70]))
    first, lo, hi = [0], [], []
    for _ in range(n):
        for _ in range(rng.integers(0, 4)):
            a = int(rng.integers(n))
            lo.append(a)
            hi.append(min(a + int(rng.integers(longest)), n - 1))
        first.append(len(lo))
    grid = ls.grid([(0.0, 1.0)], cells=n)
    shape = (len(lo), 1)
    exits = rng.choice([0, 0, 0, 1], n).astype(np.uint8)
    ends = (np.array(bound, dtype=np.int32).reshape(shape) for bound in (lo, hi))
    return build(grid, np.array(first), np.zeros(len(lo), np.int32), *ends, exits)


@given(range_graphs())
@settings(max_examples=100)
def test_components_are_those_of_the_walk(r):
    plain = walk.strong_components(r)
    label, order, loops, count = segment_tree.strong(r)
    assert count == plain.count
    assert len({*zip(label.tolist(), plain.label.tolist(), strict=True)}) == count
    assert np.array_equal(np.sort(order), np.arange(label.size))
    assert (np.diff(label[order]) >= 0).all()
    for cell in range(label.size):
        for box in range(r.first[cell], r.first[cell + 1]):
            targets = r.box[box, START] + np.arange(r.box[box, RUN])
            assert (label[targets] <= label[cell]).all()
            assert not (cell in targets and not loops[cell])
    recurrent = np.bincount(label, minlength=count) > 1
    recurrent[label[loops]] = True
    assert np.array_equal(recurrent[label], plain.recurrent[plain.label])


@given(range_graphs(), st.integers(0, 2**32))
@settings(max_examples=80)
def test_sweeps_are_those_of_the_walk(r, seed):
    plain = walk.strong_components(r)
    n = plain.label.size
    marks = (1 << np.random.default_rng(seed).integers(0, 9, n)).astype(np.uint64) & np.uint64(255)
    assert np.array_equal(segment_tree.reach(r, plain.label, plain.order, marks), walk.reach(r, plain, marks))
    settled = plain.recurrent & (np.arange(plain.count) % 2 == 0)
    rank = segment_tree.ranks(r, plain.label, plain.order, settled)
    assert np.array_equal(rank, walk.ranks(r, plain, settled))
    assert (rank[settled[plain.label]] == 0).all()
    for cell in np.flatnonzero(~settled[plain.label]):
        for box in range(r.first[cell], r.first[cell + 1]):
            targets = r.box[box, START] + np.arange(r.box[box, RUN])
            same = plain.label[targets] == plain.label[cell]
            assert (rank[targets[same]] == rank[cell]).all()
            assert (rank[targets[~same]] < rank[cell]).all()
    start = np.array([seed % n])
    assert np.array_equal(segment_tree.descend(r, start), walk.descend(r, start))
    for component in range(plain.count):
        cells = np.flatnonzero(plain.label == component).astype(np.int32)
        assert segment_tree.leaves(r, plain.label, cells) == walk._leaves(r, plain.label, cells)


def test_the_tree_is_chosen_for_wide_images_only():
    n = 2000
    for width, chosen in ((3, False), (500, True)):
        lo = np.maximum(np.arange(n) - width // 2, 0)
        r = on_a_line(lo, np.minimum(lo + width, n - 1))
        assert segment_tree.is_wide(r) is chosen
        assert walk.strong_components(r).count == 1


def test_wide_images_of_many_cells():
    """2e5 cells that each lead to the next 10 000 below: a chain of single cells, 2e9 implied edges."""
    n = 200_000
    at = np.arange(n)
    r = on_a_line(np.maximum(at - 10_000, 0), np.maximum(at - 1, 0))
    parts = walk.strong_components(r)
    assert parts.count == n
    assert parts.recurrent.sum() == 1  # cell 0, which leads to itself
    rank = walk.ranks(r, parts, parts.recurrent)
    assert np.array_equal(rank, at)  # the longest path steps down one cell at a time


# ----------------------------------------------------------------
# A million components in a row, and one of a million cells: no search may recurse.  1e7 in tests/bench.


@pytest.mark.parametrize("check", [check_path, check_cycle])
def test_a_million_deep(check):
    check(2**20)


# ----------------------------------------------------------------
# networkx's own functions on the graph give what they give on the graph written out.


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
    assert same(*(nx.get_node_attributes(dense, "members").values() for dense in (ours, oracle)))
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
    before = nx.config.fallback_to_nx
    try:
        nx.config.fallback_to_nx = True
        assert nx.number_weakly_connected_components(graph) == nx.number_weakly_connected_components(plain)
    finally:
        nx.config.fallback_to_nx = before


def test_every_node_has_successors_and_components_gives_labels_without_making_sets(graph):
    assert all(graph.successors(node).size for node in graph)
    assert len(graph) == graph.number_of_nodes() == graph.n_cells + 4
    assert graph.is_directed()
    assert not graph.is_multigraph()
    label = graph.components().label
    assert isinstance(label, np.ndarray)
    assert label.dtype == np.int32


def test_importing_networkx_does_not_import_us():
    code = "import networkx, sys; sys.exit(any(name.split('.')[0] == 'limitsets' for name in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
