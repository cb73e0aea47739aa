"""1e6 cells of the paper scene: how long, and how much memory above what the process held before."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.bench.measure import limit

pytestmark = [
    pytest.mark.bench,
    pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="peak memory is read from /proc"),
]

# Ends of the limit set, side by side, from the decimal scene at 40 digits.
LIMIT_SET = {
    "0": (15.205338825681, 19.75268801485),
    "1": (12.637023572659, 17.439819281769),
    "2": (8.9140259080455, 23.383151921158),
}


def test_million_cells(table):
    script = Path(__file__).with_name("million_cells.py")
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True)
    answer = json.loads(done.stdout)
    assert answer["attractors"] == [pytest.approx(1.0, abs=1e-4)]
    assert answer["undecided"] == pytest.approx(0.0, abs=1e-4)
    for side, (lo, hi) in LIMIT_SET.items():
        ((found_lo, found_hi),) = answer["extents"][side]
        assert found_lo == pytest.approx(lo, abs=2e-3)
        assert found_hi == pytest.approx(hi, abs=2e-3)
    what = "paper-designed, 1e6 cells"
    table += [
        limit(f"{what}: grid, graph, components, survey", answer["seconds"], "s", None),
        limit(f"{what}: the same with attractors and basins", answer["seconds_with_basins"], "s", 0.5),
        limit(f"{what}: peak memory above the process before", answer["peak"], "MB", 300),
    ]
