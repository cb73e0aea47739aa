"""Without an extra, what needs it ends in one line that names it."""

import os
import subprocess
import sys

import pytest

import limitsets as ls
from tests.cli.command import PROGRESS

RUN = """
import sys
for name in sys.argv[1].split(","):
    sys.modules[name] = None
from limitsets.cli import main
sys.exit(main(sys.argv[2:]))
"""

ATLAS = ("atlas", "paper-designed", "--x", "throw.kappa=25:26:2")


def without(modules, *words):
    command = [sys.executable, "-c", RUN, modules, *words]
    return subprocess.run(
        command, capture_output=True, text=True, encoding="utf-8", env=os.environ, check=False
    )


@pytest.mark.sweep
@pytest.mark.parametrize(
    ("extra", "modules", "words"),
    [
        ("atlas", "xarray", ATLAS),
        ("atlas", "zarr", ATLAS),
        ("atlas", "pandas", (*ATLAS, "--csv", "a.csv")),
        ("cluster", "distributed", (*ATLAS, "--cluster", "tcp://127.0.0.1:1")),
        ("explore", "panel", ("explore", "paper-designed")),
        ("engine", "pymunk", ("tray", "tray.toml", "--drops", "1")),
    ],
)
def test_one_line_names_the_extra(extra, modules, words):
    if extra == "engine":
        from tests.trays.scenes import with_tray

        ls.dump(with_tray(), "tray.toml")
    done = without(modules, *words)
    assert (done.returncode, done.stdout) == (2, "")
    (line,) = [line for line in done.stderr.splitlines() if not PROGRESS.search(line)]
    assert f"pip install 'limitsets[{extra}]'" in line


@pytest.mark.sweep
def test_without_any_extra_the_rest_works():
    every = "pymunk,xarray,zarr,pandas,pyarrow,panel,bokeh,distributed,dask,IPython"
    throw = ("throw", "paper-designed", "--x", "15", "--side", "2")
    for words in (("scenes",), ("check", "paper-designed"), ("doctor",), throw):
        done = without(every, *words)
        assert (done.returncode, done.stderr.count("Traceback")) == (0, 0), done.stderr
