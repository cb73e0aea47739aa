"""Start of a process, import, and runs that take long."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from time import perf_counter

import pytest

import limitsets as ls
from tests.bench.measure import limit, take_turns, versus
from tests.graph.long_chains import check_cycle, check_path
from tests.test_paper import LIMIT_SETS

pytestmark = pytest.mark.bench


# ----------------------------------------------------------------
# Whole processes: what a user waits for.


COMMAND = [sys.executable, "-m", "limitsets"]


def timed(arguments, folder, **environment):
    """Run a process to its end: seconds."""
    begin = perf_counter()
    env = {**os.environ, **environment}
    subprocess.run(arguments, cwd=folder, env=env, check=True, capture_output=True)
    return perf_counter() - begin


@pytest.fixture
def command(tmp_path):
    """The command line, where this checkout has one."""
    if subprocess.run([*COMMAND, "--help"], cwd=tmp_path, capture_output=True, check=False).returncode != 0:
        pytest.skip("no command line here")
    return COMMAND


def test_import(benchmark, tmp_path, table):
    bare = [sys.executable, "-c", "pass"]
    ours = [sys.executable, "-c", "import limitsets"]
    nearest = [sys.executable, "-c", "import numpy"]
    rivals = {
        "python -c pass": lambda: timed(bare, tmp_path),
        "python -c 'import numpy'": lambda: timed(nearest, tmp_path),
    }
    turns = take_turns(benchmark, lambda: timed(ours, tmp_path), rivals, 25)
    bare_seconds = turns.rivals["python -c pass"]
    table += [
        versus("python -c 'import limitsets', whole process", turns, "python -c pass"),
        versus("python -c 'import limitsets', whole process", turns, "python -c 'import numpy'"),
        limit("import limitsets, less the bare start", turns.ours - bare_seconds, "s", 0.1),
    ]


def test_help(command, tmp_path, table):
    seconds = [timed([*command, "--help"], tmp_path) for _ in range(10)]
    table.append(limit("limitsets --help", seconds[1:], "s", 0.5))


def test_analyse(command, tmp_path, table):
    analyse = [*command, "analyse", "paper-designed", "--out"]
    cold = timed([*analyse, "cold"], tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    timed([*analyse, "first"], tmp_path)
    warm = [timed([*analyse, f"warm{k}"], tmp_path) for k in range(3)]
    answers = [json.loads((tmp_path / name / "analysis.json").read_text()) for name in ("cold", "warm0")]
    for answer in answers:
        del answer["timings"]
    assert answers[0] == answers[1]
    table += [
        limit("limitsets analyse paper-designed, warm", warm, "s", 5),
        limit("limitsets analyse paper-designed, empty numba cache", cold, "s", 30),
    ]


# ----------------------------------------------------------------
# 1e9 throws that may not drift off the limit set, and graphs of 1e7 cells in a row.


# Ends of the limit set, side by side, from the decimal scene at 40 digits.
LIMIT_SET = LIMIT_SETS["paper-designed"]
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
        for s, ((lo, hi),) in LIMIT_SET.items():
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
