"""A million components in a row, and one of a million cells: no search may recurse.  1e7 in tests/bench."""

import pytest

from tests.graph.long_chains import check_cycle, check_path


@pytest.mark.parametrize("check", [check_path, check_cycle])
def test_a_million_deep(check):
    check(2**20)
