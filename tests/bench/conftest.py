"""Benchmarks: every test adds rows to one table, printed at the end and written as JSON.

What is asserted are answers, ours against the rivals'; whether a time is what was asked for stands in the table.
Run them with `make bench`; `--bench-table=FILE` chooses where the JSON goes.
"""

from __future__ import annotations

import json
import os
import platform
from datetime import UTC, datetime
from pathlib import Path

import pytest

from tests.bench.measure import Row, as_dicts, as_text

ROWS = pytest.StashKey[list[Row]]()


def pytest_addoption(parser):
    parser.addoption(
        "--bench-table", default=".benchmarks/table.json", help="where the table of the benchmarks goes"
    )
    parser.addoption(
        "--feeders", type=int, default=12, help="how many random feeders are thrown in C (about 5 s each)"
    )


def pytest_configure(config):
    config.stash[ROWS] = []


@pytest.fixture
def table(request):
    """List to which a benchmark appends its rows."""
    return request.config.stash[ROWS]


def _machine() -> str:
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        lines = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        model = lines[0].split(":", 1)[1].strip() if lines else model
    return f"{model}, {os.cpu_count()} cores, Python {platform.python_version()}"


def pytest_terminal_summary(terminalreporter, config):
    rows = config.stash[ROWS]
    if not rows:
        return
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    path = Path(config.getoption("--bench-table"))
    path.parent.mkdir(parents=True, exist_ok=True)
    about = {"machine": _machine(), "load": load, "when": datetime.now(UTC).isoformat(timespec="seconds")}
    path.write_text(json.dumps({**about, "rows": as_dicts(rows)}, indent=1) + "\n")
    terminalreporter.section("benchmarks")
    terminalreporter.line(f"{_machine()}; load {load:.1f}; medians of alternating rounds; JSON in {path}")
    for line in as_text(rows):
        terminalreporter.line(line)
