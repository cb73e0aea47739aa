"""Maps of numpy functions of arrays: the same answers as compiled, and one line from every call that needs more."""

import pickle

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import limitsets as ls
from limitsets.base import LimitsetsError
from limitsets.systems import maps

BOX = [(-1.5, 1.5), (-0.5, 0.5)]


def henon(x, y, a, b=0.3):
    return 1 - a * x**2 + y, b * x


def ricker(x, r):
    return x * np.exp(r * (1 - x))


def rooted(x, a):
    return a * np.sqrt(x)


def twins(f, **values):
    return ls.map(f, **values), ls.map(f, vectorised=True, **values)


@pytest.mark.parametrize(
    ("f", "values", "domain", "cells"),
    [
        (henon, {"a": 1.4}, BOX, 128),
        (ricker, {"r": 2.3}, [(0.02, 2.6)], 500),
        (rooted, {"a": 1.2}, [(-0.5, 2.0)], 300),  # nan from half a cell on
    ],
)
def test_graphs_orbits_and_basins_are_those_of_the_compiled_map(f, values, domain, cells):
    compiled, of_arrays = twins(f, **values)
    grid = ls.grid(domain, cells=cells)
    one, two = (ls.transitions(each, grid, "corners-padded") for each in (compiled, of_arrays))
    for name in ("box", "exits"):
        assert np.array_equal(getattr(one.ranges, name), getattr(two.ranges, name))
    seen = [ls.attractors(each) for each in (one, two)]
    assert [each.extents for each in seen[0]] == [each.extents for each in seen[1]]
    labels = [ls.basins(graph, each).labels for graph, each in zip((one, two), seen, strict=True)]
    assert np.array_equal(*labels)
    start = [0.1] * len(domain)
    paths = [ls.orbit(each, start if len(start) > 1 else 0.1, 0, 40) for each in (compiled, of_arrays)]
    assert np.allclose(paths[0].x, paths[1].x, atol=1e-6)
    states = np.linspace(*np.array(domain).T, 50)
    ends = [maps.advance(each, states, 0, 7) for each in (compiled, of_arrays)]
    assert np.allclose(ends[0][0], ends[1][0], atol=1e-6, equal_nan=True)
    for k in (1, 2, 3):
        assert np.array_equal(ends[0][k], ends[1][k])


def test_an_orbit_ends_where_the_image_is_nan():
    path = ls.orbit(ls.map(lambda x: np.log(x), vectorised=True), 2.0, 0, 10)
    assert path.x[:3].tolist() == [2.0, np.log(2.0), np.log(np.log(2.0))]
    assert path.stopped == "undefined"
    assert np.isnan(path.x[-1])


@pytest.mark.sweep
def test_a_spline_of_scipy_has_shares_of_its_basins():
    """x' = x + (x - x^3)/2 through nine knots: 1 and -1 attract one half each, by the symmetry of the knots."""
    knots = np.linspace(-1.5, 1.5, 9)
    spline = CubicSpline(knots, knots + (knots - knots**3) / 2)

    def push(x, gain=1.0):
        return x + gain * (spline(x) - x)

    map_ = ls.map(push, vectorised=True)
    assert map_ == ls.map(push, vectorised=True, gain=1)
    assert map_.with_values(gain=0.5).gain == 0.5
    graph = ls.transitions(map_, ls.grid([(-1.5, 1.5)], cells=400))
    basins = ls.attractors(graph)
    assert [round(0.5 * sum(each.extents[0][0])) for each in basins] == [-1, 1]
    shares = ls.resilience.basin_stability(graph, basins, starts=2000)
    assert [0.5 * (each.lo + each.hi) for each in shares.attractors] == pytest.approx([0.5, 0.5], abs=0.05)


def test_a_map_of_a_module_is_pickled():
    map_ = ls.map(henon, vectorised=True, a=1.4)
    assert pickle.loads(pickle.dumps(map_)) == map_  # our own


MAP = ls.map(ricker, vectorised=True, r=2.3)
GRID = ls.grid([(0.02, 2.6)], cells=100)
DOORS = {
    'transitions by "boxes"': lambda: ls.transitions(MAP, GRID, "boxes"),
    'transitions by "end-points", or a method that cuts cells as it does,': lambda: ls.transitions(
        MAP, GRID, "end-points"
    ),
    "certify": lambda: ls.certify(MAP, GRID, ["invariant"]),
    "formulas": lambda: ls.formulas(MAP),
    "cycles": lambda: ls.cycles(ls.transitions(MAP, GRID), 3),
    "the limit set": lambda: ls.limit_set(ls.transitions(MAP, GRID)),
    "critical points": lambda: ls.critical_points(MAP, GRID.domain),
    "lyapunov": lambda: maps.lyapunov(MAP, 0.3, 0, 10),
    "images_on": lambda: maps.images_on(MAP, [0.3], 0, 0),
    "continuation": lambda: ls.continuation(MAP, lambda t: MAP, domain=[(0.02, 2.6)]),
    "the atlas": lambda: ls.atlas(MAP, "r=2:2.5:3", domain=[(0.02, 2.6)]),
    "the explorer": lambda: ls.explore(MAP, domain=[(0.02, 2.6)]),
}


@pytest.mark.parametrize("door", DOORS)
def test_other_calls_refuse_in_one_line(door):
    with pytest.raises(LimitsetsError) as refused:
        DOORS[door]()
    assert str(refused.value).startswith(f"the map of {door} is 'ricker, of vectorised=True'")
    assert "leave vectorised=True out" in str(refused.value)


def two_of(x, a):
    return np.stack([x, x], axis=1)


def scalar(x, a):
    return x if x > a else -x


def fewer(x, y):
    return x[:1], y


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: ls.map(two_of, vectorised=True, a=1.0), "of shape (4, 2)"),
        (lambda: ls.map(scalar, vectorised=True, a=1.0), "without if"),
        (lambda: ls.map(fewer, vectorised=True), "a tuple of 2 arrays of shape (4,)"),
        (lambda: ls.map(henon, vectorised=True, a=1.4, c=2.0), "values of a, b"),
        (lambda: ls.map(ricker, vectorised=True), "of shape"),
        (lambda: ls.map(3, vectorised=True), "one function of arrays alone"),
        (lambda: ls.map(pieces=(ricker, ricker), margin=ricker, vectorised=True, r=1.0), "pieces or margin"),
        (lambda: ls.map(np.sin, vectorised=True), "write def sin(x, a)"),
    ],
)
def test_what_is_no_function_of_arrays_is_refused(make, says):
    with pytest.raises(LimitsetsError) as refused:
        make()
    assert says in str(refused.value)
