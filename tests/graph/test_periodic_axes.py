"""Axes that close: grids, transitions, attractors, basins, orbits and cycles of maps on circles and tori, by lifts.

Expected values are those of the theory of each map, or of the same map seen from a domain whose seam is elsewhere.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from limitsets.errors import GridError
from limitsets.sets import cycles_of, invariant_measures, limit_set_of

import limitsets as ls
from limitsets.systems.cells import CellSet, Domain, Grid
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.sets.basin import longest_stays, passing

TORUS = [(0.0, 1.0), (0.0, 1.0)]


def cat(x, y):
    return x + y, x + 2 * y


def turn(x, by):
    return x + by


def circle(x, omega, k):
    return x + omega + k / (2 * math.pi) * math.sin(2 * math.pi * x)


def doubling(x):
    return 2 * x


def standard(p, q, k):
    kick = k / (2 * math.pi) * math.sin(2 * math.pi * q)
    return p + kick, p + q + kick


def ghost(x, y, gap):
    """Drift round a circle, slow beside x = 0 where two fixed points are about to be born, to a fixed point by 0.4."""
    return x + gap + 0.3 * math.sin(math.pi * x) ** 2 * (math.cos(2 * math.pi * x) + 0.809), 0.5 * y


def lifted_row(x, y):
    return x + 0.5, y + 0.3


def runs_away(x):
    return x + math.exp(1000.0 + x)


def turned_arrays(x, by):
    return np.asarray(x) + by


def line(lo: float, cells: int) -> Grid:
    return ls.grid([(lo, lo + 1.0)], cells=cells, periodic=True)


def multiplicity(found: Any, up_to: int) -> list[int]:
    """Points of period dividing n, for n from 1."""
    periods = Counter(cycle.period for cycle in found)
    return [sum(p * many for p, many in periods.items() if n % p == 0) for n in range(1, up_to + 1)]


# ---------------------------------------------------------------- grids


def test_grid_takes_states_modulo_the_period() -> None:
    grid = ls.grid([(-0.25, 0.75), (0.0, 2.0)], cells=8, periodic=(True, False))
    inside = np.array([[-0.25, 0.1], [0.7, 1.9], [0.5, 2.0]])
    for turns in (-7, 0, 3):
        assert (grid.index(inside + np.array([turns, 0.0]), 0) == grid.index(inside, 0)).all()
    assert grid.index([[0.75, 0.1]], 0) == grid.index([[-0.25, 0.1]], 0)  # the seam is one place
    assert (grid.index([[0.0, 2.1], [0.0, -0.1]], 0) == -1).all()
    assert grid.refine(2).domain.periodic == (True, False)
    assert ls.grid([(0.0, 1.0)]).domain.periodic == (False,)


def test_states_are_shown_in_the_domain() -> None:
    domain = line(-0.3, 8).domain
    x = np.random.default_rng(0).uniform(-1e4, 1e4, 10_000)
    shown = domain.wrapped(x, 0)
    assert ((shown >= domain.lo[0]) & (shown < domain.hi[0])).all()
    assert np.abs((x - shown) - np.round(x - shown)).max() < 1e-11
    own = np.array([-0.3, 0.0, np.nextafter(domain.hi[0, 0], 0.0)])
    assert (domain.wrapped(own, 0) == own).all()
    assert line(0.0, 8).domain.wrapped([-1e-20], 0) == 0.0  # 1 - 1e-20 is 1, which is the seam
    assert np.isnan(domain.wrapped([math.nan], 0)).all()


def test_set_of_cells_holds_states_modulo_the_period() -> None:
    cells = CellSet.of(line(0.0, 8), [0, 7])
    assert cells.holds([1.1, -0.1, 0.5, 2.0], 0).tolist() == [True, True, False, True]
    assert cells.extents() == {0: [(0.0, 0.125), (0.875, 1.0)]}


@pytest.mark.parametrize("periodic", [(True,), (True, False, True), "yes", 1, (1, 0), [None, True]])
def test_grid_refuses_other_words(periodic: Any) -> None:
    with pytest.raises(GridError, match="periodic"):
        ls.grid(TORUS, cells=8, periodic=periodic)


def test_grid_refuses_axes_that_close_beside_an_anchor() -> None:
    with pytest.raises(GridError, match="anchor"):
        Domain([[1.0]], [[2.0]], anchor=[0.5], periodic=(True,))  # type: ignore[arg-type]  # lists are read


# ---------------------------------------------------------------- transitions


@pytest.mark.parametrize("method", ["corners", "end-points", "boxes"])
@pytest.mark.parametrize("lo", [0.0, -0.375])
@pytest.mark.parametrize("by", [0.25, -0.25, 1000.25, -999.75])
def test_rotation_by_two_cells_goes_to_these_and_their_closed_neighbours(
    method: str, lo: float, by: float
) -> None:
    graph = ls.transitions(ls.map(turn, by=by), line(lo, 8), method)
    shift = round(8 * (by % 1.0))
    for cell in range(8):
        expected = sorted((cell + shift + k) % 8 for k in (-1, 0, 1))
        assert graph.successors(cell).tolist() == expected
    assert not graph.ranges.exits.any()


@pytest.mark.parametrize("method", ["corners", "corners-padded", "boxes"])
def test_no_image_of_the_cat_map_is_missed(method: str) -> None:
    grid = ls.grid(TORUS, cells=16, periodic=True)
    graph = ls.transitions(ls.map(cat), grid, method)
    x = np.random.default_rng(1).random((4000, 2))
    to = np.floor(16 * ((x @ np.array([[1, 1], [1, 2]])) % 1.0)).astype(int) @ [16, 1]
    source, target = graph.edge_arrays()
    known = set(zip(source.tolist(), target.tolist(), strict=True))
    assert all(pair in known for pair in zip(grid.index(x, 0).tolist(), to.tolist(), strict=True))
    widths = {len(graph.successors(cell)) for cell in range(256)}
    assert widths == {42 if method == "corners-padded" else 20}  # 2 by 3 cells, and all that these touch
    assert len(known) == graph.number_of_edges()


def test_image_that_goes_round_is_the_whole_circle() -> None:
    graph = ls.transitions(ls.map(doubling), line(0.0, 2), "boxes")
    assert [graph.successors(cell).tolist() for cell in range(2)] == [[0, 1], [0, 1]]


def test_axis_that_ends_is_left_beside_one_that_closes() -> None:
    graph = ls.transitions(
        ls.map(lifted_row), ls.grid([(0.0, 1.0), (0.0, 1.0)], cells=4, periodic=(True, False)), "boxes"
    )
    rows = graph.ranges.exits.reshape(4, 4).astype(bool)
    assert (rows == [False, False, True, True]).all()  # y + 0.3 leaves above 0.7


@pytest.mark.parametrize("method", ["corners", "boxes"])
def test_images_that_are_not_finite_leave(method: str) -> None:
    graph = ls.transitions(ls.map(runs_away), line(0.0, 4), method)
    assert graph.ranges.exits.all()


@pytest.mark.parametrize("method", ["corners", "end-points", "boxes"])
def test_the_seam_is_nowhere(method: str) -> None:
    """The same circle cut elsewhere: transitions, components, basins are turned, nothing else."""
    params = ls.map(circle, omega=0.03, k=-0.9)
    one, two = (ls.transitions(params, line(lo, 64), method) for lo in (0.0, -0.25))
    turned = (np.arange(64) + 16) % 64  # cell of `two` that is the cell of `one`
    for cell in range(64):
        assert sorted(turned[one.successors(cell)]) == two.successors(turned[cell]).tolist()
    found = [ls.attractors(graph, throws=200) for graph in (one, two)]
    labels = [ls.basins(graph, each).labels for graph, each in zip((one, two), found, strict=True)]
    assert (labels[1][turned] == labels[0]).all()
    assert len(found[0]) == 1


# ---------------------------------------------------------------- attractors, basins


@pytest.mark.parametrize("method", ["corners", "end-points", "boxes"])
def test_circle_map_locks_to_its_fixed_point(method: str) -> None:
    graph = ls.transitions(ls.map(circle, omega=0.05, k=0.9), line(0.0, 256), method)
    (found,) = ls.attractors(graph, throws=2000)
    at = 0.5 + math.asin(2 * math.pi * 0.05 / 0.9) / (2 * math.pi)
    slope = 1.0 - 0.9 * math.sqrt(1.0 - (2 * math.pi * 0.05 / 0.9) ** 2)
    assert found.extents[0][0][0] < at < found.extents[0][0][1]
    assert found.lyapunov == pytest.approx(math.log(slope), rel=1e-9)
    assert found.in_cells == 1.0
    shares = ls.basins(graph, (found,))
    assert shares.attractors[0] > 0.99  # all but the cells about the other fixed point
    assert shares.exits == {"outside": 0.0, "undefined": 0.0}


def test_attractor_on_the_seam_is_one() -> None:
    graph = ls.transitions(ls.map(circle, omega=0.0, k=-0.9), line(0.0, 128), "boxes")
    (found,) = ls.attractors(graph, throws=1000)
    assert sorted(found.cells.numbers()) == [0, 127]
    assert found.lyapunov == pytest.approx(math.log(0.1), rel=1e-9)
    assert ls.basins(graph, (found,)).attractors[0] > 0.97


def test_cat_map_fills_the_torus() -> None:
    graph = ls.transitions(ls.map(cat), ls.grid(TORUS, cells=16, periodic=(True, True)))
    (found,) = ls.attractors(graph, throws=20_000)
    assert len(found.cells) == 256
    assert found.lyapunov == pytest.approx(math.log((3 + math.sqrt(5)) / 2), rel=1e-12)
    assert found.in_cells == 1.0
    assert found.throws == 20_000


def _stays(gap: float, lo: float) -> dict[frozenset[int], int]:
    """Columns of the cells of each recurrent component, counted from x = 0, and the steps that orbits stay there."""
    grid = ls.grid([(lo, lo + 1.0), (-1.0, 1.0)], cells=(64, 4), periodic=(True, False))
    graph = ls.transitions(ls.map(ghost, gap=gap), grid)
    columns = [
        frozenset((cell // 4 + round(64 * lo)) % 64 for cell in component.tolist())
        for component in graph.recurrent_components()
    ]
    assert (passing(graph) == (longest_stays(graph) > 0)).all()
    return dict(zip(columns, longest_stays(graph).tolist(), strict=True))


def test_orbits_pass_a_ghost_wherever_the_seam_is() -> None:
    """Cells beside the ghost recur, across the seam too; cut finer they do not."""
    here, elsewhere = _stays(0.004, 0.0), _stays(0.004, -0.5)
    assert here == elsewhere
    (beside,) = (columns for columns in here if {63, 0} <= columns)
    columns, steps = sorted((k + 32) % 64 - 32 for k in beside), 0
    x = columns[0] / 64
    while x < (columns[-1] + 1) / 64:
        (x, _), steps = ghost(x, 0.0, 0.004), steps + 1
    assert 10 < steps <= here[beside] < 2 * steps  # one orbit, and the bound of all


def test_ghost_with_fixed_points_is_not_passed() -> None:
    for lo in (0.0, -0.5):
        (stays,) = (steps for columns, steps in _stays(-0.001, lo).items() if {63, 0} <= columns)
        assert stays == 0


# ---------------------------------------------------------------- orbits, resilience


def test_orbit_is_turned_to_the_domain_at_every_step() -> None:
    domain = ls.grid([(-0.5, 0.5), (0.0, 1.0)], periodic=True, cells=4).domain
    path = ls.orbit(ls.map(cat), (0.25, 0.625), 0, 200, domain=domain).x
    x, y = 2, 5  # eighths: the orbit is exact
    for at in path:
        assert at.tolist() == [((x + 4) % 8 - 4) / 8, (y % 8) / 8]
        x, y = x + y, x + 2 * y
    assert ls.orbit(ls.map(cat), (0.25, 0.625), 0, 3).x[-1].tolist() == [6.25, 10.125]  # the lift


def test_orbit_of_a_function_of_arrays_is_turned_too() -> None:
    params, grid = ls.map(turned_arrays, by=0.375, vectorised=True), line(0.0, 8)
    assert ls.orbit(params, 0.5, 0, 3, domain=grid.domain).x.tolist() == [0.5, 0.875, 0.25, 0.625]
    x, *_ = ls.maps.advance(params, [0.5, 7.5], 0, 1000, domain=grid.domain)
    assert x.tolist() == [0.5, 0.5]  # 375 turns
    assert len(ls.attractors(ls.transitions(params, grid), throws=100)) == 1


@pytest.mark.parametrize("lo", [0.0, 0.55])  # the attractor away from the seam, and on it
def test_resilience_on_a_circle(lo: float) -> None:
    graph = ls.transitions(ls.map(circle, omega=0.05, k=0.9), line(lo, 256), "boxes")
    found = ls.attractors(graph, throws=100)
    stable = ls.resilience.basin_stability(graph, found, starts=400)
    assert (stable.attractors[0].share, stable.exits["outside"].share) == (1.0, 0.0)
    assert ls.resilience.basin_stability(graph, found).attractors[0].lo > 0.99
    times = ls.resilience.convergence_times(graph, found, starts=400).attractors[0]
    assert times.starts == 400
    assert times.at_most is not None
    assert ls.resilience.basin_entropy(graph, found, box=8, starts=400).value == 0.0


def test_measure_of_the_cat_map_is_even() -> None:
    graph = ls.transitions(ls.map(cat), ls.grid(TORUS, cells=8, periodic=True))
    (found,) = invariant_measures(graph)
    assert np.abs(found.weight * 64 - 1.0).max() < 1e-6


# ---------------------------------------------------------------- cycles


@pytest.mark.parametrize("lo", [0.0, -0.3])
def test_cat_map_has_as_many_cycles_as_its_matrix_says(lo: float) -> None:
    grid = ls.grid([(lo, lo + 1.0), (lo, lo + 1.0)], cells=24, periodic=True)
    found = ls.cycles(ls.transitions(ls.map(cat), grid), 4)
    matrix = np.array([[1, 1], [1, 2]])
    power = [np.linalg.matrix_power(matrix, n) for n in range(1, 5)]
    assert (
        multiplicity(found, 4) == [abs(round(np.linalg.det(a - np.eye(2)))) for a in power] == [1, 5, 16, 45]
    )
    golden = (3 + math.sqrt(5)) / 2
    assert all(cycle.multiplier == pytest.approx(golden**cycle.period, rel=1e-9) for cycle in found)
    assert all(((cycle.x >= lo) & (cycle.x < lo + 1.0)).all() for cycle in found)


@pytest.mark.parametrize("lo", [0.0, -0.3])
def test_doubling_has_as_many_cycles_as_binary_words(lo: float) -> None:
    found = ls.cycles(ls.transitions(ls.map(doubling), line(lo, 128)), 6)
    assert multiplicity(found, 6) == [2**n - 1 for n in range(1, 7)]
    assert not found.complete


def test_cycles_of_the_circle_map_by_its_lift() -> None:
    found = ls.cycles(ls.transitions(ls.map(circle, omega=0.05, k=0.9), line(0.0, 128)), 2)
    wave = math.asin(2 * math.pi * 0.05 / 0.9) / (2 * math.pi)
    root = math.sqrt(1.0 - (2 * math.pi * 0.05 / 0.9) ** 2)
    assert [cycle.period for cycle in found] == [1, 1]
    assert [cycle.x[0] for cycle in found] == pytest.approx([0.5 + wave, 1.0 - wave], abs=1e-12)
    assert [cycle.multiplier for cycle in found] == pytest.approx([1 - 0.9 * root, 1 + 0.9 * root], rel=1e-9)
    # omega = 1/2: 0 and 1/2 change places, by the slopes 1 + k and 1 - k
    halves = ls.cycles(ls.transitions(ls.map(circle, omega=0.5, k=0.9), line(0.0, 128)), 2)
    assert [cycle.x.tolist() for cycle in halves if cycle.multiplier < 1.0] == [
        pytest.approx([0.0, 0.5], abs=1e-12)
    ]


@pytest.mark.parametrize("lo", [0.0, -0.5])
def test_fixed_points_of_the_standard_map(lo: float) -> None:
    grid = ls.grid([(lo, lo + 1.0), (0.0, 1.0)], cells=16, periodic=True)
    found = ls.cycles(ls.transitions(ls.map(standard, k=1.5), grid), 1)
    assert [cycle.x[0].tolist() for cycle in found] == [
        pytest.approx([0, 0], abs=1e-12),
        pytest.approx([0, 0.5]),
    ]
    trace = 2.0 + 1.5  # the eigenvalues are l and 1 / l
    saddle = 0.5 * (trace + math.sqrt(trace**2 - 4.0))
    assert [cycle.multiplier for cycle in found] == pytest.approx([saddle, 1.0], rel=1e-9)


# ---------------------------------------------------------------- doors


def _graph(lo: float = 0.0) -> TransitionGraph:
    return ls.transitions(ls.map(circle, omega=0.05, k=0.9), line(lo, 64))


def _with_found(door: Callable[..., Any]) -> Callable[[], Any]:
    def ask() -> Any:
        graph = _graph()
        return door(graph, ls.attractors(graph, throws=10))

    return ask


REFUSING: dict[str, Callable[[], Any]] = {
    "limit_set": lambda: ls.limit_set(_graph()),
    "limit_set_of": lambda: limit_set_of(_graph().map, {0: [(0.1, 0.9)]}, line(0.0, 8).domain),
    "cycles_of": lambda: cycles_of(_graph().map, {0: [(0.1, 0.9)]}, line(0.0, 8).domain, 2),
    "certify": lambda: ls.certify(_graph().map, line(0.0, 8), ["all-cycles"], period=2),
    "atlas": lambda: ls.atlas(
        _graph().map, {"k": (0.1, 0.9)}, {"omega": (0.0, 0.1)}, domain=line(0.0, 8).domain
    ),
    "continuation": lambda: ls.continuation(_graph().map, lambda t: {"k": t}, domain=line(0.0, 8).domain),
    "explore": lambda: ls.explore(_graph().map, domain=line(0.0, 8).domain),
    "minimal_fatal_shock": _with_found(partial(ls.resilience.minimal_fatal_shock, x=0.3, side=0)),
    "uncertainty_exponent": _with_found(ls.resilience.uncertainty_exponent),
    "wada": _with_found(ls.resilience.wada),
    "transfer": lambda: ls.robust.transfer(_graph().map, line(0.0, 8)),
    "plot.map": lambda: ls.plot.map(_graph()),
    "plot.limit_set": lambda: ls.plot.limit_set(_graph(), {0: [(0.5, 0.6)]}),
}


@pytest.mark.parametrize("door", REFUSING)
def test_other_doors_refuse_axes_that_close(door: str) -> None:
    with pytest.raises(GridError, match="axes that end"):
        REFUSING[door]()
