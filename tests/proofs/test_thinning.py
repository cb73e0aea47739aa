"""The bounds of thinning out, against what their definition says cell by cell."""

from itertools import pairwise

import numpy as np
import pytest

import limitsets as ls
from limitsets.proofs.cover import cover, targets
from limitsets.proofs.parameters import parameter_box
from limitsets.proofs.perron_frobenius import _Largest, _stretches


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
        assert list(zip(number[each.target].tolist(), most, strict=True)) == by_definition(found, left, of, values)
        assert bool(most) == (share > 0)
