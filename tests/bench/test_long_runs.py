"""1e9 throws that may not drift off the limit set, and graphs of 1e7 cells in a row."""

from __future__ import annotations

from time import perf_counter

import pytest

import limitsets as ls
from tests.bench.measure import limit
from tests.graph.long_chains import check_cycle, check_path

pytestmark = pytest.mark.bench

# Ends of the limit set, side by side, from the decimal scene at 40 digits.
LIMIT_SET = {
    0: (15.205338825681, 19.75268801485),
    1: (12.637023572659, 17.439819281769),
    2: (8.9140259080455, 23.383151921158),
}
ROUNDS, THROWS = 1000, 1_000_000


def test_a_thousand_million_throws(table):
    """One orbit, every state of it looked at; the seconds hold the looking as well."""
    params, x, side = ls.load("paper-designed").map, 15.0, 2
    ls.orbit(params, x, side, 10)
    begin = perf_counter()
    for _ in range(ROUNDS):
        path = ls.orbit(params, x, side, THROWS)
        assert path.stopped is None
        assert path.code.size == THROWS
        for s, (lo, hi) in LIMIT_SET.items():
            here = path.x[path.side == s]
            assert lo - 1e-11 < here.min()
            assert here.max() < hi + 1e-11
        x, side = float(path.x[-1]), int(path.side[-1])
    seconds = perf_counter() - begin
    table.append(limit("paper-designed, 1e9 throws of one orbit, checked", seconds, "s", None))


@pytest.mark.parametrize("check", [check_path, check_cycle])
def test_ten_million_cells_in_a_row(check, table):
    begin = perf_counter()
    check(10_000_000)
    table.append(limit(f"graph of 1e7 cells, {check.__name__}", perf_counter() - begin, "s", None))
