"""Rigorous images in one, two and three dimensions: graphs that prove, maps of one's own, parameters in a box."""

import importlib
import math
from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets import interval as iv
from limitsets.base.errors import AnswerError
from limitsets.systems.cells import CellSet, Domain
from limitsets.systems.graph.target import Target, place
from tests.maps_of_tests import Product, TwoState

# The name of the module is hidden by that of its function.
enclosed = importlib.import_module("limitsets.systems.graph.images.enclosed")


# ---------------------------------------------------------------- maps of one's own


class Spiral(NamedTuple):
    """A contraction of space that turns about an axis."""

    turn: float
    shrink: float


def spiral(params, x, side):
    c, s = math.cos(params.turn), math.sin(params.turn)
    u = params.shrink * (c * x[0] - s * x[1]), params.shrink * (s * x[0] + c * x[1]), params.shrink * x[2]
    return u, side, 0


def spiral_box(low, high, lo, hi, side):
    turn, shrink = (low.turn, high.turn), (low.shrink, high.shrink)
    c, s = iv.cos(turn), iv.sin(turn)
    x, y, z = (lo[0], hi[0]), (lo[1], hi[1]), (lo[2], hi[2])
    u = iv.mul(shrink, iv.sub(iv.mul(c, x), iv.mul(s, y)))
    v = iv.mul(shrink, iv.add(iv.mul(s, x), iv.mul(c, y)))
    w = iv.mul(shrink, z)
    slot = ((u[0], v[0], w[0]), (u[1], v[1], w[1]), side, 0)
    return 1, slot, slot, (0.0, 0.0)


class Broken(NamedTuple):
    """Answers that prove nothing, in each of the ways a kernel may go wrong."""

    way: float


def broken(params, x, side):
    return 0.5 * x, 5 if params.way == 5.0 else side, 0


def broken_box(low, high, lo, hi, side):
    ends = iv.mul((0.5, 0.5), (lo, hi))
    if low.way == 1.0:
        ends = (math.nan, math.nan)
    if low.way == 2.0:
        ends = (-math.inf, math.inf)
    if low.way == 3.0:
        ends = (ends[1], ends[0])
    slot = (ends[0], ends[1], 5 if low.way == 5.0 else side, 0)
    return 0 if low.way == 4.0 else 1, slot, slot, (0.0, 0.0)


ls.register(Spiral, image=spiral, image_box=spiral_box, dimension=3)
ls.register(Broken, image=broken, image_box=broken_box)


def attracting(graph):
    return [data["members"] for _, data in ls.morse_graph(graph).nodes(data=True) if data["attracting"]]


def holds(graph, params, points):
    """Whether the graph's images of the cells of points hold the cells of their images."""
    got = ls.maps.images(params, points, 0)
    cells = graph.grid.index(points, 0)
    for k in range(len(cells)):
        where = graph.grid.index(got.x[k : k + 1], int(got.side[k]))[0]
        if where >= 0 and where not in graph.successors(int(cells[k])):
            return False
        if where < 0 and not graph.ranges.exits[cells[k]]:
            return False
    return True


def is_forward_invariant(graph, members):
    cells = set(members.numbers().tolist())
    return all(set(graph.successors(k).tolist()) <= cells and not graph.ranges.exits[k] for k in cells)


# ---------------------------------------------------------------- known answers, proved


def test_the_orbit_of_period_two_of_the_logistic_map_attracts():
    graph = ls.transitions(ls.maps.Logistic(3.2), ls.grid([(0.0, 1.0)], cells=4096), method="boxes")
    (block,) = attracting(graph)
    assert is_forward_invariant(graph, block)
    r = 3.2
    root = math.sqrt((r - 3) * (r + 1))
    orbit = [(r + 1 - root) / (2 * r), (r + 1 + root) / (2 * r)]
    extents = block.extents()[0]
    assert [lo <= x <= hi for x, (lo, hi) in zip(orbit, extents, strict=True)] == [True, True]
    assert sum(hi - lo for lo, hi in extents) < 0.02
    assert not graph.ranges.exits.any()


def test_a_long_orbit_of_henon_stays_in_proved_cells():
    params = ls.maps.Henon(1.4, 0.3)
    graph = ls.transitions(params, ls.grid([(-1.5, 1.5), (-0.5, 0.5)], cells=(512, 256)), method="boxes")
    start = ls.orbit(params, (0.1, 0.1), 0, 200).x[-1]
    orbit = ls.orbit(params, start, 0, 20_000).x
    visited = CellSet.of(graph.grid, graph.grid.index(orbit, 0))
    (block,) = attracting(graph)
    assert visited <= block
    assert is_forward_invariant(graph, block)
    assert len(block) < 0.1 * graph.n_cells
    # A third of the rectangle is sent beyond it: a share known to the width of a column of cells.
    leaving = np.count_nonzero(graph.ranges.exits) / graph.n_cells
    rng = np.random.default_rng(1)
    x = rng.uniform([-1.5, -0.5], [1.5, 0.5], (200_000, 2))
    sampled = np.mean(graph.grid.index(ls.maps.images(params, x, 0).x, 0) < 0)
    assert sampled - 0.005 <= leaving <= sampled + 0.02


def test_leslie_images_hold_sampled_ones_and_are_no_looser_than_padded_corners():
    params = ls.maps.Leslie()
    cells = ls.grid([(-0.001, 90), (-0.001, 70)], depth=12)
    graph = ls.transitions(params, cells, method="boxes")
    padded = ls.transitions(params, cells, method="corners-padded")
    rng = np.random.default_rng(2)
    assert holds(graph, params, rng.uniform([-0.001, -0.001], [90, 70], (5000, 2)))
    assert graph.number_of_cell_edges() < padded.number_of_cell_edges()
    within = [set(graph.successors(k)) <= set(padded.successors(k)) for k in range(graph.n_cells)]
    assert np.mean(within) > 0.95
    (block,) = attracting(graph)
    assert is_forward_invariant(graph, block)


def test_a_map_of_space_proves_its_attractor():
    params = Spiral(0.5, 0.6)
    graph = ls.transitions(params, ls.grid([(-1, 1)] * 3, cells=17), method="boxes")
    (block,) = attracting(graph)
    assert is_forward_invariant(graph, block)
    assert graph.grid.index([[0.0, 0.0, 0.0]], 0)[0] in block.numbers()
    lo, hi = graph.grid.boxes(block.numbers(), 0)
    assert np.abs([lo, hi]).max() < 0.6
    assert holds(graph, params, np.random.default_rng(4).uniform(-1, 1, (1000, 3)))


# ---------------------------------------------------------------- parameters in a box


@pytest.mark.parametrize(
    ("low", "high", "domain", "cells"),
    [
        (ls.maps.Logistic(3.1), ls.maps.Logistic(3.3), [(0, 1)], 500),
        (ls.maps.Doubling(1.6), ls.maps.Doubling(1.7), [(0, 1)], 300),
        (ls.maps.Rotation(0.30), ls.maps.Rotation(0.31), [(0, 1)], 300),
        (ls.maps.Henon(1.35, 0.29), ls.maps.Henon(1.4, 0.3), [(-2, 2), (-2, 2)], 64),
        (
            ls.maps.Leslie(19.0, 23.0, 0.095, 0.69),
            ls.maps.Leslie(20.0, 24.0, 0.1, 0.7),
            [(0, 90), (0, 70)],
            32,
        ),
        (TwoState(0.4), TwoState(0.6), [(-2, 2), (-2, 2)], 30),
        (Spiral(0.4, 0.5), Spiral(0.5, 0.6), [(-1, 1)] * 3, 9),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, tuple) else "",
)
def test_images_hold_for_every_parameter_of_a_box(low, high, domain, cells):
    graph = ls.transitions(low, ls.grid(domain, cells=cells), method="boxes", upper=high)
    rng = np.random.default_rng(6)
    lo, hi = np.array(domain, dtype=float).T
    for _ in range(8):
        params = type(low)(*(rng.uniform(a, b) for a, b in zip(low, high, strict=True)))
        points = rng.uniform(lo, hi, (300, len(domain)))
        assert holds(graph, params, points if len(domain) > 1 else points[:, 0])


@pytest.mark.parametrize("upper", [ls.maps.Logistic(3.0), ls.maps.Cubic(4.0)])
def test_an_upper_corner_that_is_none_is_refused(upper):
    with pytest.raises(AnswerError, match="upper corner"):
        ls.transitions(ls.maps.Logistic(3.2), ls.grid([(0, 1)]), method="boxes", upper=upper)


# ---------------------------------------------------------------- nothing proved


@pytest.mark.parametrize("way", [1.0, 2.0, 3.0, 4.0])
def test_answers_that_prove_nothing_lead_everywhere(way):
    graph = ls.transitions(Broken(way), ls.grid([(0.5, 1.5)], cells=8), method="boxes")
    assert graph.ranges.exits.all()
    assert all(set(range(8)) <= set(graph.successors(k).tolist()) for k in range(8))
    assert attracting(graph) == []


class Hole(NamedTuple):
    """Not defined at 0, or up to it: the sine of the inverse, or of the logarithm."""

    inverse: float


def hole(params, x, side):
    return (math.sin(1.0 / x) if params.inverse > 0.0 else math.sin(math.log(x))), side, 0


def hole_box(low, high, lo, hi, side):
    after = iv.sin(iv.div((1.0, 1.0), (lo, hi))) if low.inverse > 0.0 else iv.sin(iv.log((lo, hi)))
    slot = (after[0], after[1], side, 0)
    return 1, slot, slot, (0.0, 0.0)


ls.register(Hole, image=hole, image_box=hole_box)


class Root(NamedTuple):
    """Not defined left of the edge."""

    edge: float


def root(params, x, side):
    return math.sin(math.sqrt(x - params.edge)), side, 0


def root_box(low, high, lo, hi, side):
    after = iv.sin(iv.sqrt(iv.sub((lo, hi), (low.edge, high.edge))))
    slot = (after[0], after[1], side, 0)
    return 1, slot, slot, (0.0, 0.0)


ls.register(Root, image=root, image_box=root_box)


def test_a_cell_that_is_not_defined_throughout_is_undecided():
    """Whatever a kernel makes of the number: a sine is bounded."""
    edges = np.linspace(-1.0, 1.0, 9)
    found = enclosed.enclosures(Root(0.3), Root(0.3), edges, 0)
    assert found.lost.tolist() == [True] * 6 + [False] * 2
    lo, hi = found.hulls[0, 0]
    assert lo[7] <= math.sin(math.sqrt(0.45)) <= math.sin(math.sqrt(0.7)) <= hi[7]
    assert enclosed.enclosures(Root(-1.0), Root(-1.0), edges, 0).lost.tolist() == [False] * 8
    for inverse, lost in ((1.0, [3, 4]), (0.0, [0, 1, 2, 3, 4])):
        edges = np.linspace(-1.0, 1.0, 9)
        found = enclosed.enclosures(Hole(inverse), Hole(inverse), edges, 0)
        assert np.flatnonzero(found.lost).tolist() == lost


def test_a_side_that_does_not_exist_is_refused():
    with pytest.raises(AnswerError, match="side"):
        ls.transitions(Broken(5.0), ls.grid([(0.0, 1.0)], cells=8), method="boxes")


def test_beyond_the_pole_nothing_is_proved_and_before_it_all():
    graph = ls.transitions(Product(), ls.grid([(0, 4), (0, 4)], cells=16), method="boxes")
    _, hi = graph.grid.boxes(np.arange(graph.n_cells), 0)
    lost = (hi >= 2.0).any(axis=1)
    counts = np.array([len(graph.successors(k)) for k in range(graph.n_cells)])
    assert (counts[lost] > graph.n_cells).all()  # every cell, and the sink
    assert (counts[~lost] < graph.n_cells).all()


def test_an_image_that_reaches_past_both_ends_leaves_by_both():
    scene = ls.load("paper-designed")
    cells = ls.grid(scene.domain, cells=4)
    exits = ls.maps.kind_of(scene.map).exits
    target = Target.of(cells, exits)
    lo, hi = np.full(4, -1e3), np.full(4, 1e3)
    found = enclosed.Enclosures({(1, 0): (lo, hi)}, np.zeros((2, 4)), np.zeros(4, bool))
    boxes = enclosed.boxes_of(found, target, len(exits))
    numbers = list(exits)
    assert (boxes.exits == (1 << numbers.index("inward") | 1 << numbers.index("outward"))).all()


# ---------------------------------------------------------------- which closed cells an interval meets


@pytest.mark.parametrize("graded", [False, True])
def test_place_finds_every_closed_cell_that_an_interval_meets(graded):
    domain = Domain([[0.1]], [[3.0]], [0.05]) if graded else Domain([[0.1]], [[3.0]])
    cells = ls.grid(domain, cells=37)
    edges = cells.edges[0][0]
    target = Target.of(cells, {"inward": ls.maps.INWARD, "outward": ls.maps.OUTWARD})
    rng = np.random.default_rng(7)
    borders = np.concatenate([edges, np.nextafter(edges, -9), np.nextafter(edges, 9), [-1e9, 1e9, 0.0, 3.5]])
    for _ in range(4000):
        ends = [rng.choice(borders) if rng.random() < 0.7 else rng.uniform(-0.2, 3.3) for _ in range(2)]
        lo, hi = sorted(map(float, ends))
        k, m, leaves = place_one(target, lo, hi, int(rng.integers(0, 37)))
        met = np.flatnonzero((edges[1:] >= lo) & (edges[:-1] <= hi))
        assert (list(range(k, m + 1)) if k <= m else []) == met.tolist(), (lo, hi)
        assert leaves == (lo < edges[0]) + 2 * (hi > edges[-1])


def place_one(target, lo, hi, hint):
    return place(target, np.int64(0), 0, lo, hi, 0, np.int64(hint))


# ---------------------------------------------------------------- faces of the domain that a map keeps


def parabola(x, a):
    return a * x * (1 - x)


def saturating(x, r):
    return r * x / (1 + x)


def competing(x, y, r, s, c):
    return x * math.exp(r * (1 - x - c * y)), y * math.exp(s * (1 - y - c * x))


def line(x, a, b):
    return a * x + b


# Attracting fixed points by theory: each competitor wins where the competition is stronger than 1, both live below.
KEPT = [
    (ls.map(parabola, a=0.5), [(0, 1)], [(0.0,)]),
    (ls.map(saturating, r=2.0), [(0, 3)], [(1.0,)]),
    (ls.map(competing, r=1.5, s=1.6, c=0.5), [(0, 3), (0, 3)], [(2 / 3, 2 / 3)]),
    (ls.map(competing, r=1.5, s=1.6, c=1.5), [(0, 3), (0, 3)], [(0.0, 1.0), (1.0, 0.0)]),
]


@pytest.mark.parametrize(("params", "box", "wanted"), KEPT)
def test_a_face_that_the_map_keeps_is_not_left_by_rounding(params, box, wanted):
    grid = ls.grid(box, cells=1024 if len(box) == 1 else 128)
    graph = ls.transitions(params, grid, "boxes")
    assert not graph.ranges.exits.any()
    found = [attractor.cells for attractor in ls.attractors(graph, throws=100)]
    points = [[bool(cells.holds(np.array([at]), 0)[0]) for at in wanted] for cells in found]
    assert sorted(points, reverse=True) == np.eye(len(wanted), dtype=bool).tolist()
    assert all(len(cells) < 0.01 * grid.n_cells for cells in found)


def test_a_border_that_is_touched_is_named_with_what_helps():
    """0.5 x + 0.5 ends at 1 exactly: the enclosure beyond it; on a wider domain nothing leaves."""
    params, (narrow, wide) = ls.map(line, a=0.5, b=0.5), (ls.grid([(0, end)], cells=512) for end in (1, 1.25))
    touching = ls.transitions(params, narrow, "boxes")
    assert "widen the domain" in ls.basins(touching, ls.attractors(touching)).advice
    inside = ls.transitions(params, wide, "boxes")
    assert ls.basins(inside, ls.attractors(inside)).attractors == (1.0,)
    leaving = ls.transitions(params.with_values(a=0.9), narrow, "boxes")  # truly: 1.4 at 1
    assert "widen the domain" not in (ls.basins(leaving, ls.attractors(leaving)).advice or "")


@pytest.mark.parametrize("number", [0, 3])
def test_a_proof_up_to_a_kept_face_rechecks(number, tmp_path):
    params, box, _ = KEPT[number]
    proof = ls.certify(params, ls.grid(box, cells=64), ["invariant", "basin"])
    assert {claim.verdict for claim in proof.claims} == {"proved"}
    proof.save(tmp_path / "kept.proof.zip")
    assert ls.recheck(tmp_path / "kept.proof.zip").verdict == "proved"
