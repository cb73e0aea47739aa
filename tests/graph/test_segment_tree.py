"""The tree algorithms for wide images against the walk over edges, and what they are for: width costs nothing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import limitsets as ls
from limitsets.systems.graph import components as surveys
from limitsets.systems.graph import components as walk
from limitsets.systems.graph import segment_tree
from limitsets.systems.graph.ranges import RUN, START, build


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
@settings(max_examples=300)
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
@settings(max_examples=200)
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
        assert segment_tree.leaves(r, plain.label, cells) == surveys._leaves(r, plain.label, cells)


def test_the_tree_is_chosen_for_wide_images_only():
    n = 2000
    for width, chosen in ((3, False), (500, True)):
        lo = np.maximum(np.arange(n) - width // 2, 0)[:, None].astype(np.int32)
        hi = np.minimum(lo + width, n - 1).astype(np.int32)
        r = build(
            ls.grid([(0, 1)], cells=n), np.arange(n + 1), np.zeros(n, np.int32), lo, hi, np.zeros(n, np.uint8)
        )
        assert segment_tree.is_wide(r) is chosen
        assert walk.strong_components(r).count == 1


@pytest.mark.parametrize("width", [10_000])
def test_wide_images_of_many_cells(width):
    """2e5 cells that each lead to the next 10 000 below: a chain of single cells, 2e9 implied edges."""
    n = 200_000
    at = np.arange(n)
    lo, hi = np.maximum(at - width, 0), np.maximum(at - 1, 0)
    r = build(
        ls.grid([(0, 1)], cells=n),
        np.arange(n + 1),
        np.zeros(n, np.int32),
        lo[:, None].astype(np.int32),
        hi[:, None].astype(np.int32),
        np.zeros(n, np.uint8),
    )
    parts = walk.strong_components(r)
    assert parts.count == n
    assert parts.recurrent.sum() == 1  # cell 0, which leads to itself
    rank = walk.ranks(r, parts, parts.recurrent)
    assert np.array_equal(rank, at)  # the longest path steps down one cell at a time
