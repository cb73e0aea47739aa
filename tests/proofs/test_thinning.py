"""The bounds of thinning out, against what their definition says cell by cell."""

from itertools import pairwise

import numpy as np
import pytest

import limitsets as ls
from limitsets.proofs.prover.attraction import attraction
from limitsets.proofs.prover.cover import cover, targets
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.proofs.prover.thinning import _Largest, _stretches, perron_frobenius_bound, slopes
from limitsets.systems.cells import CellSet


def by_definition(found, left, of, values):
    """For each target, run of neighbours and branch in turn: the largest value of a source in the target's group."""
    runs, begun = {}, 0
    for cell in np.flatnonzero(left).tolist():
        begun += cell == 0 or not left[cell - 1] or cell in found.grid.offset
        runs[cell] = begun
    largest = {}
    for branch in (0, 1):
        for cell, (first, last) in enumerate(targets(found, branch).tolist()):
            for to in range(first, last + 1) if left[cell] and first >= 0 else ():
                if left[to] and of[to] == of[cell]:
                    key = to, runs[cell], branch
                    largest[key] = max(values[cell], largest.get(key, 0.0))
    return [(key[0], largest[key]) for key in sorted(largest)]


@pytest.mark.parametrize("name", ["paper-designed", "paper-initial-small-angle"])
@pytest.mark.parametrize("noise", [{}, {"throw.speed": "0.3 %"}, {"landing.x": "0.12 in"}], ids=str)
def test_the_largest_source_of_each_run_and_branch_is_found(name, noise):
    found = cover(parameter_box(ls.load(name), noise=noise), 100, {})
    n, random = found.grid.n_cells, np.random.default_rng(4)
    for share, groups in ((1.0, 1), (0.95, 1), (0.97, 3), (0.6, 2), (0.0, 1)):
        left = random.random(n) < share
        of = np.sort(random.integers(0, groups, n)) if share > 0.7 else random.integers(0, groups, n)
        values, number = random.random(n), np.flatnonzero(left)
        each = _stretches(found, left, number, of)
        got = _Largest(each, number.size)(values[number])
        begins = [*each.begins.tolist(), got.size]
        most = [got[one:two].max() for one, two in pairwise(begins)]
        assert list(zip(number[each.target].tolist(), most, strict=True)) == by_definition(
            found, left, of, values
        )
        assert bool(most) == (share > 0)


def throws_by_definition(found, left, of, steep):
    """After each throw in turn: the bounds, from 1 everywhere, as number 8 of docs/certificates.md has them."""
    runs = np.cumsum(
        left & ~np.append(False, left[:-1] & ~np.isin(np.arange(1, left.size), found.grid.offset))
    )
    pairs = [
        (to, 2 * runs[cell] + branch, cell)
        for branch in (0, 1)
        for cell, (first, last) in enumerate(targets(found, branch).tolist())
        for to in range(first, last + 1)
        if first >= 0 and left[cell] and left[to] and of[to] == of[cell]
    ]
    slots, slot = np.unique([pair[:2] for pair in pairs], axis=0, return_inverse=True)
    source, bound = np.array([cell for *_, cell in pairs]), left.astype(float)
    while True:
        most = np.zeros(len(slots))
        np.maximum.at(most, slot.ravel(), (bound / steep)[source])
        bound = np.bincount(slots[:, 0], most, minlength=left.size)
        yield bound


@pytest.fixture
def asked(monkeypatch):
    """How often bounds are thrown."""
    plain, calls = _Largest.__call__, []
    monkeypatch.setattr(_Largest, "__call__", lambda self, values: calls.append(1) or plain(self, values))
    return calls


def slowly_left(x):
    """The cells that attract before x, which orbits leave by side 2 alone, and the slopes on them."""
    found = cover(parameter_box(ls.load("paper-designed")), 1000, {2: [x]})
    left = attraction(found).component >= 0
    left[found.grid.of_side(2)] &= found.grid.edges[2][0][1:] <= x
    return found, left, slopes(found, CellSet(found.grid, left))


def test_bounds_that_fall_slowly_are_known_to_fall_before_they_are_below_1(asked):
    found, left, steep = slowly_left(22.65)
    throws, thick, reason = perron_frobenius_bound(found, left)
    assert (thick.any(), reason) == (False, "")
    bounds = throws_by_definition(found, left, np.zeros(left.size), steep)
    needed = next(n for n, bound in enumerate(bounds, 1) if bound.max() < 1.0)
    assert 5 * len(asked) < needed <= throws <= 4000


def test_bounds_that_stay_are_given_up_soon(asked):
    """Beyond 22.7 in there are so few places that bounds by 1000 cells a side do not fall in 4000 throws."""
    found, left, steep = slowly_left(22.7)
    _, thick, reason = perron_frobenius_bound(found, left)
    assert (thick == left).all()
    assert "not proved to thin out" in reason
    assert len(asked) < 200
    bounds = throws_by_definition(found, left, np.zeros(left.size), steep)
    assert min(bound.max() for _, bound in zip(range(4000), bounds, strict=False)) >= 1.0
