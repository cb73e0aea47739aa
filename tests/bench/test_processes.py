"""Whole processes: what a user waits for."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from time import perf_counter

import pytest

from tests.bench.measure import limit, take_turns, versus

pytestmark = pytest.mark.bench

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
