"""Inner and outer basins of enclosed images: against orbits, and what refining a recurrent set proves."""

import numpy as np
import pytest

import limitsets as ls
from limitsets.systems.cells import CellSet
from limitsets.systems.maps import images
from limitsets.systems.sets.basin import longest_stays, passing
from tests.maps_of_tests import Contraction, Product, TwoState
from tests.resilience.test_shares import setting

SQUARE = [(-2.0, 2.0), (-2.0, 2.0)]


def ends(params, grid, attractors, starts, steps):
    """Number of the attractor whose cells each orbit of one side is in at the end; -1 none; -2 once it has left."""
    x, end = starts.copy(), np.full(len(starts), -1)
    going = np.arange(len(starts))
    for _ in range(steps):
        there = images(params, x[going] if grid.dimension > 1 else x[going, 0], 0)
        x[going] = there.x.reshape(going.size, -1)
        out = (there.code < 0) | (grid.index(x[going], 0) < 0)
        end[going[out]] = -2
        going = going[~out]
    for number, attractor in enumerate(attractors):
        end[going[attractor.cells.holds(x[going], 0)]] = number
    return end


@pytest.mark.parametrize(
    ("params", "domain", "cells", "least"),
    [
        (ls.maps.Cubic(1.8), [(-1.7, 1.7)], 2000, 0.95),
        (ls.maps.Cubic(2.4), [(-1.7, 1.7)], 2000, 0.4),
        (ls.maps.Logistic(2.9), [(-0.2, 1.2)], 2000, 0.95),
        (Contraction(0.9, 0.0), [(-1.0, 1.0)], 1001, 1.0),
        (Product(), [(0.0, 1.2), (0.0, 1.2)], 64, 0.5),
        (TwoState(1.0), SQUARE, 64, 0.9),
    ],
    ids=str,
)
def test_no_orbit_contradicts_inner_or_outer_basins(params, domain, cells, least):
    graph, attractors = setting(params, domain, cells, "boxes")
    found = ls.resilience.basin_stability(graph, attractors)
    grid, rng = graph.grid, np.random.default_rng(4)
    numbers = rng.choice(grid.n_cells, 4000)
    lo, hi = grid.boxes(numbers, 0)
    end = ends(params, grid, attractors, lo + rng.random(lo.shape) * (hi - lo), 400)
    for number in range(len(attractors)):
        assert found.outer[number].mask[numbers[end == number]].all()
        assert (end[found.inner[number].mask[numbers]] == number).all()
    left = CellSet(grid, found.inner[len(attractors)].mask | found.inner[len(attractors) + 1].mask)
    assert (end[left.mask[numbers]] == -2).all()
    assert sum(share.lo for share in found.attractors) + found.exits["outside"].lo >= least


def test_recurrent_cells_beside_a_fixed_point_are_proved_to_be_passed_through():
    """At slope 0.9 the cells next to the fixed point's meet their own images; orbits leave them nevertheless."""
    graph, attractors = setting(Contraction(0.9, 0.0), [(-1.0, 1.0)], 1001, "boxes")
    sets = graph.recurrent_components()
    through = passing(graph)
    assert len(attractors) == 1
    assert len(sets) > 10
    assert through.sum() == len(sets) - 1
    # k cells from the fixed point an orbit stays for ln((k + 1/2) / (k - 1/2)) / ln(1/0.9) steps, rounded up
    stays = longest_stays(graph)
    for cells, stay in zip(sets, stays, strict=True):
        k = abs(int(cells[0]) - 500)
        if k:
            bound = np.log((k + 0.5) / (k - 0.5)) / np.log(1.0 / 0.9)
            assert bound < stay <= bound + 2.5
        else:
            assert stay == 0
    found = ls.resilience.basin_stability(graph, attractors)
    assert (found.attractors[0].lo, found.undecided) == (1.0, 0.0)


@pytest.mark.parametrize("method", ["corners", "boxes"])
@pytest.mark.parametrize("share", [0.4, 0.2, 1 / 40, 1 / 100])
def test_a_shift_passes_through_every_cell_that_it_moves_by_a_fine_one(method, share):
    """x' = x + c meets its own cell of width w while c < w, and not its own 64th part where c > w / 64."""
    cover = ls.grid([(0.0, 1.0)], cells=100)
    graph = ls.transitions(Contraction(1.0, 0.01 * share), cover, method)
    assert len(graph.recurrent_components()) == 100
    assert passing(graph).all() == (share > 1 / 64)
    if (
        share > 1 / 64
    ):  # an image begins in the fine cell so many further on, and the slowest path goes on from there
        assert (longest_stays(graph) == np.ceil(64 / np.floor(64 * share))).all()
    else:
        assert not longest_stays(graph).any()
    expected = 0.0 if share > 1 / 64 else 1.0
    assert ls.basins(graph, ls.attractors(graph)).undecided_between == pytest.approx(expected)


@pytest.mark.sweep
def test_what_is_passed_through_is_so_for_every_parameter():
    """For slopes from 0.5 to 1.2 no orbit need leave the cells beside 0, for the lower corner alone all do."""
    lower, upper = Contraction(0.5, 0.0), Contraction(1.2, 0.0)
    cover = ls.grid([(-1.0, 1.0)], cells=101)
    both = ls.transitions(lower, cover, "boxes", upper=upper)
    assert not passing(both).any()
    assert passing(ls.transitions(lower, cover, "boxes")).any()
    found = ls.resilience.basin_stability(both, ls.attractors(both, throws=10))
    assert found.undecided > 0.5
