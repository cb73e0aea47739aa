"""The set algebra obeys the laws of sets, and extents are the intervals a person would draw."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import limitsets as ls
from limitsets.base.errors import GridError
from limitsets.systems.cells import CellSet, Domain

COVER = ls.grid(Domain([[0.0], [10.0]], [[1.0], [12.0]]), cells=8)
subsets = st.lists(st.booleans(), min_size=16, max_size=16).map(lambda bits: CellSet(COVER, np.array(bits)))


@given(subsets, subsets, subsets)
def test_the_laws_of_sets(a, b, c):
    assert (a | b) & c == (a & c) | (b & c)
    assert ~(a | b) == ~a & ~b
    assert a - b == a & ~b
    assert (a <= b) == (a | b == b)
    assert np.isclose((a | b).measure() + (a & b).measure(), a.measure() + b.measure())
    assert len(a) + len(~a) == COVER.n_cells


@given(subsets)
def test_extents_hold_the_cells_and_nothing_else(a):
    total = sum(hi - lo for parts in a.extents().values() for lo, hi in parts)
    assert np.isclose(total, a.measure())
    for side, parts in a.extents().items():
        for lo, hi in parts:
            inside = (COVER.centres(side) > lo) & (COVER.centres(side) < hi)
            assert a.mask[COVER.of_side(side)][inside].all()


@given(subsets, st.sampled_from([0, 1]), st.lists(st.integers(-3, 35), min_size=1))
def test_a_set_holds_the_states_of_its_cells(a, side, quarters):
    """Quarters of cells: inside, on borders, beyond the domain."""
    width = 0.125 if side == 0 else 0.25
    x = COVER.edges[side][0][0] + width * np.array(quarters) / 4.0
    cell = COVER.index(x, side)
    assert np.array_equal(a.holds(x, side), a.mask[cell] & (cell >= 0))


def test_neighbouring_cells_make_one_interval():
    assert CellSet.of(COVER, [0, 1, 3, 8]).extents() == {0: [(0.0, 0.25), (0.375, 0.5)], 1: [(10.0, 10.25)]}


def test_a_refined_set_is_the_same_set():
    a = CellSet.of(COVER, [0, 5, 15])
    fine = a.refined(COVER.refine(4))
    assert fine.extents() == a.extents()
    plane = ls.grid([(0, 1), (0, 1)], cells=(2, 3))
    piece = CellSet.of(plane, [4])
    assert np.isclose(piece.refined(plane.refine(2)).measure(), piece.measure())


def test_sets_of_different_grids_do_not_mix():
    other = CellSet.of(ls.grid([(0.0, 1.0)], cells=16), [0])
    with pytest.raises(GridError, match="same grid"):
        CellSet.of(COVER, [0]) | other
    with pytest.raises(GridError, match="16 booleans"):
        CellSet(COVER, np.zeros(3, dtype=bool))


def test_ranges_along_every_axis():
    """Cells 1 and 14 of 4 by 4 on [0, 1] x [0, 4] are (0, 1) and (3, 2), the last axis counting fastest."""
    cells = CellSet.of(ls.grid([(0.0, 1.0), (0.0, 4.0)], cells=4), [1, 14])
    assert cells.extents() == cells.extents(axis=0) == {0: [(0.0, 0.25), (0.75, 1.0)]}
    assert cells.extents(axis=1) == {0: [(1.0, 3.0)]}
    with pytest.raises(GridError, match="the axis"):
        cells.extents(axis=2)
