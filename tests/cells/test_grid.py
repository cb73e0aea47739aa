"""Grids cover the domain exactly, graded ones shrink towards the anchor, and cells are found where they are."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import limitsets as ls
from limitsets.base.errors import GridError
from limitsets.systems.cells import Domain, Grid, as_domain

ANCHORED = Domain([[1.001], [2.0005]], [[28.0], [20.0]], [1.0, 2.0])


def test_a_uniform_grid_has_equal_cells():
    cover = ls.grid([(0.0, 1.0), (-1.0, 3.0)], cells=(4, 8))
    assert cover.n_cells == 32
    assert np.allclose(cover.edges[0][1], -1.0 + 0.5 * np.arange(9))
    assert np.allclose(cover.measure, 0.125)


@pytest.mark.parametrize(("depth", "shape"), [(12, (64, 64)), (13, (128, 64)), (16, (256, 256)), (1, (2, 1))])
def test_depth_splits_the_axes_in_turn_beginning_with_the_first(depth, shape):
    assert tuple(ls.grid([(0.0, 1.0), (0.0, 1.0)], depth=depth).shape[0]) == shape


def test_in_three_dimensions_too():
    assert tuple(ls.grid([(0, 1), (0, 1), (0, 1)], depth=7).shape[0]) == (8, 4, 4)


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
    assert cover_index([0.999, 28.0001]) == [-1, -1]
    assert cover_index([28.0])[0] == 99


def cover_index(x):
    return ls.grid(ANCHORED, cells=100).index(x, 0).tolist()


def test_index_runs_the_last_axis_fastest():
    cover = ls.grid([(0, 2), (0, 3)], cells=(2, 3))
    assert cover.index([[0.5, 0.5], [0.5, 2.5], [1.5, 0.5]], 0).tolist() == [0, 2, 3]
    assert np.allclose(cover.centres(0)[[0, 2, 3]], [[0.5, 0.5], [0.5, 2.5], [1.5, 0.5]])


def test_refining_keeps_the_old_borders_and_the_measure():
    cover = ls.grid(ANCHORED, cells=37)
    fine = cover.refine(3)
    assert np.array_equal(fine.edges[1][0][::3], cover.edges[1][0])
    assert np.isclose(fine.measure.sum(), cover.measure.sum(), rtol=1e-13)


@pytest.mark.parametrize(
    ("domain", "options", "word"),
    [
        ([(1.0, 0.0)], {}, "lo < hi"),
        ([(0.0, float("inf"))], {}, "finite"),
        ("nonsense", {}, "domain"),
        ([(0.0, 1.0)], {"cells": 0}, "integer from 1"),
        ([(0.0, 1.0)], {"cells": 2.5}, "integer from 1; pass cells=1024$"),
        (
            [(0.0, 1.0), (0.0, 1.0)],
            {"cells": -5},
            "integer from 1, or 2 of them; pass cells=1024, or one per",
        ),
        ([(0.0, 1.0)], {"cells": (2, 2)}, "integer from 1"),
        ([(0.0, 1.0)], {"grading": "fine"}, "uniform or graded"),
        ([(0.0, 1.0)], {"grading": "graded"}, "anchor"),
        ([(0.0, 1.0)], {"depth": 0}, "integer from 1"),
        ([(0.0, 1.0), (0.0, 1.0)], {"depth": 40}, "at most"),
        ([(1.0, 1.0 + 1e-14)], {"cells": 1000}, "spacing"),
    ],
)
def test_grids_that_cannot_be_are_refused(domain, options, word):
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
