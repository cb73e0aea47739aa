"""The checker in one file: built, and run where only numpy and python-flint can be imported."""

import json
import multiprocessing
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

import flint

from tests.proofs import forge

FOLDER = Path(__file__).resolve().parents[2] / "limitsets" / "checker"
SMALL = 20_000  # cells that the checker checks in one process, written anew
METHODS = [method for method in multiprocessing.get_all_start_methods() if method != "fork"]

# Runs the file as a command would, where processes are started by the method named; prints by which they are.
WITH_METHOD = """
import concurrent.futures, multiprocessing, runpy, sys

class Telling(concurrent.futures.ProcessPoolExecutor):
    def __init__(self, workers, context, *more):
        print(workers, context.get_start_method())
        super().__init__(workers, context, *more)

multiprocessing.set_start_method(sys.argv.pop(1))
del sys.argv[0]
concurrent.futures.ProcessPoolExecutor = Telling
runpy.run_path(sys.argv[0], run_name="__main__")
"""


@pytest.fixture(scope="module")
def packed(tmp_path_factory):
    """The file, beside a folder from which only numpy and python-flint can be imported."""
    folder = tmp_path_factory.mktemp("packed")
    command = [sys.executable, str(FOLDER / "build.py"), str(folder / "recheck.pyz")]
    subprocess.run(command, check=True, cwd=folder)
    (folder / "only").mkdir()
    for package in (np, flint):
        site = Path(package.__file__).parents[1]
        for place in (*site.glob(f"{package.__name__}"), *site.glob(f"*{package.__name__}.libs")):
            (folder / "only" / place.name).symlink_to(place, target_is_directory=True)
    return folder / "recheck.pyz"


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """A certificate with more cells than one process checks alone, and the same with one bracket spoiled."""
    folder = tmp_path_factory.mktemp("large")
    f = forge.forge("designed", first=0.1, ratio=0.0009, widest=0.0045)
    assert (f.arrays["0.component"] < 0).sum() > SMALL
    right = f.write(folder / "right.proof.zip")
    f.arrays["0.phi"][-3, 1] = f.arrays["0.phi"][-3].mean()
    return right, f.seal().write(folder / "wrong.proof.zip")


def run(packed, *words):
    """Run Python without site packages: -S leaves out those of the interpreter, and the .pth files among them."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    return subprocess.run(
        [sys.executable, "-S", *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        cwd=packed.parent,
        env=environment | {"PYTHONPATH": str(packed.parent / "only")},
        timeout=100,
    )


def test_nothing_else_can_be_imported_there(packed):
    assert run(packed, "-c", "import numpy, flint").returncode == 0
    for name in ("limitsets", "numba", "scipy", "checker"):
        assert "ModuleNotFoundError" in run(packed, "-c", f"import {name}").stderr


def test_one_process(packed, large, tmp_path):
    done = run(packed, packed, large[0], "--workers", 1)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.rstrip().endswith("PROVED")
    (tmp_path / "no.zip").write_bytes(b"no")
    done = run(packed, packed, tmp_path / "no.zip")
    assert (done.returncode, done.stderr) == (2, "")
    assert done.stdout.count("\n") < 6


def test_several_processes(packed, large):
    """As a user starts it."""
    done = run(packed, packed, large[0], "--workers", 2)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.rstrip().endswith("PROVED")


@pytest.mark.sweep
@pytest.mark.parametrize("method", METHODS)
def test_several_processes_however_they_are_started(packed, large, method):
    for file, code, verdict in zip(large, (0, 1), ("proved", "failed"), strict=True):
        done = run(packed, "-c", WITH_METHOD, method, packed, file, "--json", "--workers", 2)
        assert (done.returncode, done.stderr) == (code, "")
        started, said = done.stdout.splitlines()
        assert started == f"2 {method}"
        assert json.loads(said)["verdict"] == verdict


def test_the_module_is_the_same_command(large):
    command = [sys.executable, "-m", "limitsets.checker", str(large[0]), "--json", "--workers", "2"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=FOLDER.parents[1])
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["verdict"] == "proved"


def test_it_neither_evaluates_nor_unpickles():
    text = "".join(path.read_text(encoding="utf-8") for path in FOLDER.glob("*.py"))
    assert "eval(" not in text
    assert "exec(" not in text
    assert "pickle" not in text.replace("unpickle", "")
