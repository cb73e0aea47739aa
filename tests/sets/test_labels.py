"""Labels of cells against orbits: no start in a cell may end elsewhere than its label says."""

import math
from typing import NamedTuple

import networkx as nx
import numpy as np
import pytest

import limitsets as ls
from limitsets.systems.maps import OUTSIDE, UNDECIDED, UNDEFINED, images
from tests.maps_of_tests import Baker, Contraction, Linear2, Product, ThreeState, TwoState, with_middles

# ---------------------------------------------------------------- maps with holes: roots, logarithms, quotients


def root(x, below):
    return math.sqrt(x) - below if x >= 0.0 else math.nan


def log_of_size(x, factor):
    """A pole and no hole: every orbit but one of a countable set goes on for ever, until it passes the border."""
    return factor * math.log(abs(x)) if x != 0.0 else -math.inf


def gap(x, half):
    """The logarithm of x^2 - half^2: a hole in the middle, with a steep border on both sides."""
    inside = x * x - half * half
    return 0.3 * math.log(inside) + 1.0 if inside > 0.0 else math.nan


def newton(x, square):
    """Newton's method for a root: a pole at 0, two attractors."""
    return 0.5 * (x + square / x) if x != 0.0 else math.nan


def tangent(x, factor):
    return factor * math.tan(x)


def means(x, y, share):
    """Arithmetic and geometric means: undefined where the signs differ, else towards a point of the diagonal."""
    under = x * y
    other = math.sqrt(under) if under >= 0.0 else math.nan
    return share * (x + y), 0.9 * other + 0.05


def cubes(x, y):
    """Newton's method for z^3 = 1 in the plane: a pole at 0, three basins mixed everywhere between them."""
    size = (x * x + y * y) ** 2
    if size == 0.0:
        return math.nan, math.nan
    return (2.0 * x + (x * x - y * y) / size) / 3.0, (2.0 * y - 2.0 * x * y / size) / 3.0


def disc(x, y, radius):
    """A round hole, around which all turns and comes in."""
    under = x * x + y * y - radius * radius
    size = math.sqrt(under) if under >= 0.0 else math.nan
    return 0.7 * x - 0.6 * y + 0.1 * size, 0.6 * x + 0.7 * y


def nothing(x):
    return math.nan * x


class Steep(NamedTuple):
    factor: float


def steep(params, x, side):
    """Next to where the logarithm begins one step leads below any border, a little farther on to no number."""
    return (math.log(x[0]) if x[0] > 0.0 else math.nan, params.factor * x[1]), side, 0


class SteepOn(NamedTuple):
    factor: float


def steep_on(params, x, side, branch):
    first, slope = (math.log(x[0]), 1.0 / x[0]) if x[0] > 0.0 else (math.nan, math.nan)
    return (first, params.factor * x[1]), side, ((slope, 0.0), (0.0, params.factor))


ls.register(Steep, image=steep, dimension=2)
ls.register(SteepOn, image=steep, image_on=steep_on, dimension=2)

SQUARE = [(-2.0, 2.0), (-2.0, 2.0)]
HOLES = [
    (ls.map(root, below=0.2), [(-1.0, 2.0)], 1000),
    (ls.map(root, below=-0.25), [(-1.0, 2.0)], 333),
    (ls.map(log_of_size, factor=1.3), [(-3.0, 3.0)], 999),
    (ls.map(gap, half=0.01), [(-2.0, 2.0)], 500),
    (ls.map(newton, square=2.0), [(-3.0, 3.0)], 1001),
    (ls.map(newton, square=-1.0), [(-30.0, 30.0)], 1000),
    (ls.map(tangent, factor=0.7), [(-5.0, 5.0)], 1000),
    (ls.map(means, share=0.5), SQUARE, 64),
    (ls.map(cubes), SQUARE, 128),
    (Steep(0.5), [(-3.0, 3.0), (-2.0, 2.0)], 65),
    (SteepOn(0.5), [(-3.0, 3.0), (-2.0, 2.0)], 64),
    (ls.map(disc, radius=0.37), SQUARE, 101),
    (ls.map(nothing), [(0.0, 1.0)], 50),
]
TEXTBOOK = [
    (Baker(), [(0.0, 1.0), (0.0, 1.0)], 64),
    (Contraction(0.5), [(-1.0, 1.0)], 333),
    (ls.maps.Cubic(2.6), [(-1.7, 1.7)], 1001),
    (ls.maps.Doubling(2.0), [(0.0, 1.0)], 333),
    (ls.maps.Henon(1.4, 0.3), SQUARE, 128),
    (ls.maps.Leslie(), ls.maps.domain_of(ls.maps.Leslie()), 128),
    (Linear2(0.5, 0.0, 0.0, 2.0), SQUARE, 64),
    (ls.maps.Logistic(3.83), [(-0.2, 1.2)], 777),
    (ls.maps.Logistic(4.1), [(0.0, 1.0)], 999),
    (Product(), [(0.0, 1.2), (0.0, 1.2)], 64),
    (ls.maps.Rotation(), [(0.0, 1.0)], 100),
    (ThreeState(), [(-3.0, 3.0)], 100),
    (TwoState(1.0), SQUARE, 32),
]


def outcomes(params, grid, starts, steps):
    """Where each start is after so many steps: cell, or code of the exit it left the grid by."""
    x, end = starts.copy(), np.zeros(len(starts), np.int64)
    going = np.arange(len(starts))
    for _ in range(steps):
        there = images(params, x[going], 0)
        x[going] = there.x
        cell = grid.index(there.x, 0)
        end[going] = np.where(there.code < 0, there.code, np.where(cell < 0, OUTSIDE, cell))
        going = going[end[going] >= 0]
    return end


def contradicted(params, domain, cells, method=None):
    """Starts of which a label says something else than their orbit: cells, labels, ends."""
    grid = ls.grid(domain, cells=cells)
    graph = ls.transitions(params, grid, method)
    found = ls.attractors(graph, throws=1000)
    shares = ls.basins(graph, found)
    rng = np.random.default_rng(10)
    numbers = np.repeat(np.arange(grid.n_cells), 4 if len(domain) == 1 else 2)
    lo, hi = grid.boxes(numbers, 0)
    starts = lo + rng.random(lo.shape) * (hi - lo)
    starts, steps = (starts[:, 0], 1000) if len(domain) == 1 else (starts, 150)
    end = outcomes(params, grid, starts, steps)
    label = shares.labels[numbers]
    staying = np.array([*(each.cells.mask for each in found), np.zeros(grid.n_cells, bool)])
    kept = staying[np.maximum(label, -1), np.maximum(end, 0)] & (end >= 0)
    right = (label == UNDECIDED) | (label == end) | ((label >= 0) & kept)
    return np.stack([numbers[~right], label[~right], end[~right]], axis=1).tolist()


@pytest.mark.parametrize(("params", "domain", "cells"), HOLES + TEXTBOOK, ids=lambda value: str(value)[:24])
def test_no_label_is_contradicted_by_an_orbit(params, domain, cells):
    assert contradicted(params, domain, cells) == []


@pytest.mark.parametrize(("params", "domain", "cells"), TEXTBOOK, ids=lambda value: str(value)[:24])
def test_no_label_of_proved_images_is_contradicted(params, domain, cells):
    assert contradicted(params, domain, cells // 2, "boxes") == []


@with_middles
def test_an_orbit_would_contradict_a_wrong_label():
    """One point for a whole cell misses most of its image: the comparison above sees it."""
    assert contradicted(ls.maps.Cubic(2.6), [(-1.7, 1.7)], 1001, "middles") != []


# ---------------------------------------------------------------- undefined


def test_a_map_without_numbers_has_no_attractor():
    graph = ls.transitions(ls.map(nothing), ls.grid([(0.0, 1.0)], cells=50))
    found = ls.attractors(graph)
    shares = ls.basins(graph, found)
    assert found == ()
    assert shares.attractors == ()
    assert shares.exits == {"outside": 0.0, "undefined": pytest.approx(1.0)}
    assert (shares.labels == UNDEFINED).all()
    assert shares.advice is None
    assert list(graph.exits.items()) == [("outside", OUTSIDE), ("undefined", UNDEFINED)]
    assert nx.number_attracting_components(graph) == 2
    assert graph.successors(7).tolist() == [graph.n_cells + 1]


def test_undefined_is_the_last_exit_of_every_map():
    exits = ["inward", "outward", "outside-model", "undefined"]
    assert list(ls.maps.kind_of(ls.load("paper-designed").map).exits) == exits
    assert list(ls.maps.kind_of(ls.maps.Henon(1.4, 0.3)).exits) == ["outside", "undefined"]


@pytest.mark.parametrize(("params", "start"), [(ls.map(root, below=0.5), 0.3), (Steep(0.5), (0.4, 1.0))])
def test_an_orbit_stops_where_the_map_is_undefined(params, start):
    path = ls.orbit(params, start, 0, 10)
    assert (path.stopped, path.code[-1]) == ("undefined", UNDEFINED)
    assert path.code.size < 10
    assert (path.code[:-1] >= 0).all()
    assert np.isfinite(path.x[:-1]).all()
    assert np.isnan(path.x[-1]).any()


class Unproved(NamedTuple):
    infinite: float


def less(params, x, side):
    return 0.4 * x, side, 0


def less_box(lo_params, hi_params, lo, hi, side):
    """Nothing is known of cells beyond 0.5: the box has an end that is none."""
    end = (math.inf if lo_params.infinite > 0.0 else math.nan) if hi > 0.5 else 0.4 * hi
    return 1, (0.4 * lo, end, side, 0), (0.0, 0.0, side, 0), (0.0, 0.0)


ls.register(Unproved, image=less, image_box=less_box)


@pytest.mark.parametrize("infinite", [0.0, 1.0])
def test_a_proved_image_without_an_end_is_undecided(infinite):
    graph = ls.transitions(Unproved(infinite), ls.grid([(0.0, 1.0)], cells=8), "boxes")
    shares = ls.basins(graph, ls.attractors(graph, throws=10))
    assert (shares.labels[4:] == UNDECIDED).all()
    assert (shares.labels[:4] == 0).all()


# ---------------------------------------------------------------- what leaves


@pytest.mark.parametrize("cells", [128, 512])
def test_starts_that_stay_are_not_said_to_leave(cells):
    """0.432 +- 0.002 of uniform starts stay bounded; their cells are undecided, and the answer says what to do."""
    graph = ls.transitions(ls.maps.Henon(1.4, 0.3), ls.grid(SQUARE, cells=cells))
    shares = ls.basins(graph, ls.attractors(graph))
    assert shares.attractors == ()
    assert 0.430 < shares.undecided_between < 0.50
    assert shares.exits["outside"] < 0.570
    assert "finer cells" in shares.advice
    starts = np.random.default_rng(1).uniform(-2.0, 2.0, (2000, 2))
    end = outcomes(graph.map, graph.grid, starts, 500)
    label = shares.labels[graph.grid.index(starts, 0)]
    assert (label[end >= 0] == UNDECIDED).all()
    assert np.mean(end >= 0) == pytest.approx(0.432, abs=0.04)


def test_cells_that_reach_a_set_that_is_not_closed_are_undecided():
    """The unstable fixed point 0.6875 of the logistic map: its cell, and those on a path to it by networkx."""
    graph = ls.transitions(ls.maps.Logistic(3.2), ls.grid([(0.0, 1.0)], cells=1000))
    shares = ls.basins(graph, ls.attractors(graph, throws=100))
    (cell,) = graph.grid.index([0.6875], 0)
    leading = sorted(nx.ancestors(graph.to_networkx(), int(cell)) | {int(cell)})
    assert len(leading) > 5
    assert (shares.labels[leading] == UNDECIDED).all()
    assert shares.attractors[0] > 0.95


def test_a_set_that_orbits_pass_through_takes_no_label_away():
    """x/2 on padded cells: one cell after the attracting ones meets its own image, and nothing stays there."""
    graph = ls.transitions(Contraction(0.5), ls.grid([(0.0, 1.0)], cells=64), method="corners-padded")
    assert len(graph.recurrent_components()) > 1
    shares = ls.basins(graph, ls.attractors(graph, throws=100))
    assert shares.attractors == (pytest.approx(1.0),)
    assert shares.advice is None


def test_a_chaotic_repeller_is_named_and_its_remedy_works():
    """At 2.7 the odd cubic has an attracting cycle of 6, and a repeller near almost every start."""
    graph = ls.transitions(ls.maps.Cubic(2.7), ls.grid([(-2.1, 2.1)], cells=4096))
    found = ls.attractors(graph, throws=100)
    shares = ls.basins(graph, found)
    assert shares.undecided_between > 0.8
    assert "a chaotic repeller" in shares.advice
    assert "limitsets.resilience.basin_stability(graph, found, starts=10000)" in shares.advice
    assert ls.resilience.basin_stability(graph, found, starts=1000).undecided < 0.05
    saddle = ls.transitions(ls.maps.Logistic(3.2), ls.grid([(0.0, 1.0)], cells=1000))
    assert "repeller" not in ls.basins(saddle, ls.attractors(saddle, throws=100)).advice


SAMPLED = "from sampled images of cells, not proved"


@pytest.mark.parametrize(("method", "how"), [("boxes", "proved"), (None, SAMPLED)])
def test_a_table_says_whether_its_cells_are_proved(method, how):
    graph = ls.transitions(ls.maps.Cubic(1.5), ls.grid([(-1.2, 1.2)], cells=101), method)
    found = ls.attractors(graph, throws=100)
    assert f"Basins ({how})" in ls.basins(graph, found).table().text()
    assert f"Attractor ({how})" in found[0].table().text()
