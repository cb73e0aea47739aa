"""Cells of a grid, and sets of cells."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

import limitsets as ls
from limitsets.base.errors import GridError
from limitsets.systems.cells import CellSet, Domain, Grid, as_domain

# ----------------------------------------------------------------
# Grids cover the domain exactly, graded ones shrink towards the anchor, and cells are found where they are.


ANCHORED = Domain([[1.001], [2.0005]], [[28.0], [20.0]], [1.0, 2.0])


def test_a_uniform_grid_has_equal_cells():
    cover = ls.grid([(0.0, 1.0), (-1.0, 3.0)], cells=(4, 8))
    assert cover.n_cells == 32
    assert np.allclose(cover.edges[0][1], -1.0 + 0.5 * np.arange(9))
    assert np.allclose(cover.measure, 0.125)


def test_depth_splits_the_axes_in_turn_beginning_with_the_first():
    for depth, shape in ((12, (64, 64)), (13, (128, 64)), (16, (256, 256)), (1, (2, 1)), (7, (8, 4, 4))):
        assert tuple(ls.grid([(0.0, 1.0)] * len(shape), depth=depth).shape[0]) == shape


def test_graded_cells_are_the_default_where_there_is_an_anchor():
    cover = ls.grid(ANCHORED, cells=500)
    for side, anchor in enumerate(ANCHORED.anchor):
        edges = cover.edges[side][0]
        assert edges[0] == ANCHORED.lo[side, 0]
        assert edges[-1] == ANCHORED.hi[side, 0]
        ratio = np.diff(edges) / (edges[:-1] - anchor)
        near = edges[:-1] - anchor < 0.2 * (edges[-1] - anchor)
        assert np.ptp(ratio[near][:-1]) < 1e-9 * ratio[0] + 1e-12  # in proportion to the distance
        wide = np.diff(edges)[edges[:-1] - anchor > 0.3 * (edges[-1] - anchor)]
        assert np.ptp(wide) < 1e-9  # and equal far away
    uniform = ls.grid(ANCHORED, cells=500, grading="uniform")
    assert np.allclose(np.diff(uniform.edges[0][0]), (28.0 - 1.001) / 500)


@given(st.integers(1, 300), st.floats(0.0, 1.0), st.integers(0, 1))
def test_every_point_lies_in_the_cell_it_is_given(cells, share, side):
    cover = ls.grid(ANCHORED, cells=cells)
    lo, hi = ANCHORED.lo[side, 0], ANCHORED.hi[side, 0]
    x = lo + share * (hi - lo)
    (cell,) = cover.index([x], side)
    low, high = cover.boxes([cell], side)
    assert low[0, 0] <= x <= high[0, 0]
    assert cover.side_of(cell) == side


def test_points_outside_are_in_no_cell():
    assert ls.grid(ANCHORED, cells=100).index([0.999, 28.0001, 28.0], 0).tolist() == [-1, -1, 99]


def test_index_runs_the_last_axis_fastest():
    cover = ls.grid([(0, 2), (0, 3)], cells=(2, 3))
    assert cover.index([[0.5, 0.5], [0.5, 2.5], [1.5, 0.5]], 0).tolist() == [0, 2, 3]
    assert np.allclose(cover.centres(0)[[0, 2, 3]], [[0.5, 0.5], [0.5, 2.5], [1.5, 0.5]])


def test_refining_keeps_the_old_borders_and_the_measure():
    cover = ls.grid(ANCHORED, cells=37)
    fine = cover.refine(3)
    assert np.array_equal(fine.edges[1][0][::3], cover.edges[1][0])
    assert np.isclose(fine.measure.sum(), cover.measure.sum(), rtol=1e-13)


def test_grids_that_cannot_be_are_refused():
    for domain, options, word in (
        ([(1.0, 0.0)], {}, "lo < hi"),
        ([(0.0, float("inf"))], {}, "finite"),
        ("nonsense", {}, "domain"),
        ([(0.0, 1.0)], {"cells": 0}, "integer from 1"),
        ([(0.0, 1.0)], {"cells": 2.5}, "integer from 1; pass cells=1024$"),
        ([(0.0, 1.0)] * 2, {"cells": -5}, "integer from 1, or 2 of them; pass cells=1024, or one per"),
        ([(0.0, 1.0)], {"cells": (2, 2)}, "integer from 1"),
        ([(0.0, 1.0)], {"grading": "fine"}, "uniform or graded"),
        ([(0.0, 1.0)], {"grading": "graded"}, "anchor"),
        ([(0.0, 1.0)], {"depth": 0}, "integer from 1"),
        ([(0.0, 1.0), (0.0, 1.0)], {"depth": 40}, "at most"),
        ([(1.0, 1.0 + 1e-14)], {"cells": 1000}, "spacing"),
    ):
        with pytest.raises(GridError, match=word):
            ls.grid(domain, **options)


def test_an_anchor_inside_the_box_is_refused():
    with pytest.raises(GridError, match="anchor"):
        Domain([[1.0]], [[2.0]], [1.5])


def test_borders_of_fewer_digits_are_refused_before_they_merge() -> None:
    edges = np.linspace(1.0, 1.0 + 1e-7, 5)
    domain = as_domain([(1.0, 1.0 + 1e-7)])
    assert np.unique(edges.astype(np.float32)).size < edges.size  # what would happen
    with pytest.raises(GridError, match="float64"):
        Grid(domain, ((edges.astype(np.float32),),))
    # Corners in float32 are taken as the numbers they are; equal ones are no box.
    assert ls.grid(np.array([(0.1, 0.3)], dtype=np.float32), cells=2).edges[0][0][0] == float(np.float32(0.1))
    with pytest.raises(GridError, match="lo < hi"):
        ls.grid(np.array([(1.0, 1.0 + 1e-9)], dtype=np.float32), cells=2)


def test_cells_narrower_than_the_spacing_of_numbers_are_refused_however_they_are_made() -> None:
    lo, hi = 1.0, 1.0 + 64 * 2.0**-52
    fine = ls.grid([(lo, hi)], cells=64)
    with pytest.raises(GridError, match="spacing"):
        fine.refine(2)
    with pytest.raises(GridError, match="spacing"):
        ls.grid([(lo, hi)], cells=128)
    with pytest.raises(GridError, match="spacing"):
        Grid(as_domain([(0.0, 1.0)]), ((np.array([0.0, 0.5, 0.5, 1.0]),),))
    # The domain of a throw whose arm all but ends at a_i.
    near = Domain([[2.0 + 1e-15]], [[2.0 + 3e-15]], [2.0])
    with pytest.raises(GridError, match="spacing"):
        ls.grid(near, cells=64)


def test_a_grid_is_shown_as_a_table():
    cover = ls.grid([(0.0, 1.0), (0.0, 4.0)], cells=(4, 8))
    assert cover.table().shown() == [["0", "0", "4", "0 to 1", "0.25"], ["0", "1", "8", "0 to 4", "0.5"]]
    assert "Grid of 32 cells" in cover._repr_html_()
    assert repr(cover) == "Grid(32 cells: 4x8)"


# ----------------------------------------------------------------
# The set algebra obeys the laws of sets, and extents are the intervals a person would draw.


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


def test_a_grid_with_a_side_without_states_is_shown_without_this_side():
    (shown,) = ls.grid(Domain([[0.0], [1.0]], [[2.0], [1.0]]), cells=4).tables()
    assert [row[:3] for row in shown.rows] == [(0, 0, 4)]


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
