"""What effects cost: nothing where a scene does not ask for them, and each its own where it does."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import limitsets as ls
from limitsets.systems.maps import drivers
from tests.bench.measure import Turns, take_turns, versus
from tests.thrower.effects.copies import environment_of_copy

pytestmark = pytest.mark.bench

PAIRS = 20
COUNT = 4096

# Facts for every effect, so that each can be switched on alone.
WORLD = {"friction": 0.9, "restitution": 0.2, "bounce_threshold": "0.01 in", "stroke": "5 deg"}
WORLD |= {"scatter": {"speed": "0.3 %"}}
EFFECTS = [
    {"landing": True},
    {"roll": True},
    {"slip": True},
    {"pivot": True},
    {"bounce": True},
    {"drive": True},
    {"landing": True, "roll": True},
]


@pytest.fixture
def two_packages(tmp_path):
    """Processes with the package whole, and with the effects deleted, each waiting to time throws."""
    workers = {}
    for word in ("with", "without"):
        workers[word] = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("timed_throws.py")), word],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment_of_copy(tmp_path, word),
        )
    yield workers
    for worker in workers.values():
        worker.communicate()


def test_absent_effects_cost_nothing(two_packages, table):
    def timed(word: str) -> float:
        worker = two_packages[word]
        worker.stdin.write("go\n")
        worker.stdin.flush()
        return float(worker.stdout.readline())

    timed("with"), timed("without")  # compiled by then
    pairs = np.array([(timed("with"), timed("without")) for _ in range(PAIRS)])
    turns = Turns(pairs[:, 0], {"without the effects' files": pairs[:, 1]}, None, {})
    what = "a bare throw, effects in the package"
    # the machine code is the same (tests/thrower/effects/test_absent.py): two processes differ by some percent anyway
    table.append(versus(what, turns, "without the effects' files", unit="ns", within=1.05))


@pytest.mark.parametrize("effects", EFFECTS, ids="+".join)
def test_an_effect(benchmark, effects, table):
    bare = ls.load("paper-initial")
    full = ls.load(bare.as_dict() | {"effects": effects, "world": WORLD})
    x = np.random.default_rng(3).uniform(14.0, 22.0, COUNT)

    def throws(params):
        after, side, code = (np.empty(COUNT),), np.empty(COUNT, np.int64), np.empty(COUNT, np.int64)
        return lambda: drivers.fill_images(params, 2, (x,), after, side, code)

    turns = take_turns(benchmark, throws(full.map), {"the bare map": throws(bare.map)}, PAIRS)
    what = f"a throw with {' and '.join(effects)}"
    table.append(versus(what, turns, "the bare map", unit="ns", per=COUNT, within=np.inf, inform=True))
