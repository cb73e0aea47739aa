"""A million throws against vectorised C, the price of effects, and what accuracy costs."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import limitsets as ls
from limitsets.feeder.thrower.params import gather
from limitsets.parameters.analysis.accuracy import _distance
from limitsets.proofs.prover.attraction import attraction
from limitsets.proofs.prover.cover import cover
from limitsets.proofs.prover.end_points import proved_ends
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.systems.maps import drivers
from limitsets.systems.sets import invariant_measures
from tests.bench.compiled import compiler, throws_in_c
from tests.bench.measure import Turns, limit, take_turns, versus
from tests.test_paper import LIMIT_SETS
from tests.thrower.effects.copies import environment_of_copy

# ----------------------------------------------------------------
# Exact throws of limit-set states in a batch, against C with the same guarantee and against libm and Newton.


SIDE, COUNT, ROUNDS = 2, 4096, 400
REPEATS = 5  # per round: what the others left in the cache matters for the first only
((LO, HI),) = LIMIT_SETS["paper-designed"][2]

PER = COUNT * REPEATS
VECTORISED, LIBM = "C, vectorised, contraction", "C, libm and Newton"
UNCONTRACTED, OWN = "C, vectorised, no contraction", "our kernel on arrays made beforehand"


def repeated(run):
    """The same, several times over."""

    def several():
        for _ in range(REPEATS):
            answer = run()
        return answer

    return several


@pytest.fixture
def throws(tmp_path_factory):
    scene = ls.load("paper-designed")
    x = np.random.default_rng(2).uniform(LO, HI, COUNT)
    folder = tmp_path_factory.mktemp("c")
    part = gather(scene.map, SIDE)
    rivals = {
        VECTORISED: throws_in_c(part, x, "images", folder, contract=True),
        UNCONTRACTED: throws_in_c(part, x, "images", folder, contract=False),
        LIBM: throws_in_c(part, x, "images_libm", folder, contract=True),
    }
    return scene.map, x, {name: repeated(run) for name, run in rivals.items()}


@pytest.mark.bench
@pytest.mark.skipif(compiler() is None, reason="no C compiler: cc is the rival")
def test_kernel(benchmark, throws, table):
    params, x, rivals = throws
    after, side, code = (np.empty(COUNT),), np.empty(COUNT, np.int64), np.empty(COUNT, np.int64)

    def ours():
        return drivers.fill_images(params, SIDE, (x,), after, side, code)

    turns = take_turns(benchmark, repeated(ours), rivals, ROUNDS)
    assert turns.answer == 0  # none needed the second pass
    for name, (x_c, side_c, code_c) in turns.answers.items():
        np.testing.assert_allclose(after[0], x_c, rtol=0, atol=1e-11 if name == LIBM else 1e-13)
        np.testing.assert_array_equal(side, side_c)
        np.testing.assert_array_equal(code, code_c)
    assert set(np.unique(code)) == {0, 1}
    what = "a throw, kernel on arrays made beforehand"
    table += [
        versus(what, turns, VECTORISED, unit="ns", per=PER, within=1.5),
        versus(what, turns, UNCONTRACTED, unit="ns", per=PER, within=1.5, inform=True),
        versus(what, turns, LIBM, unit="ns", per=PER, faster=10),
    ]


@pytest.mark.bench
@pytest.mark.skipif(compiler() is None, reason="no C compiler: cc is the rival")
def test_public(benchmark, throws, table):
    params, x, rivals = throws
    made = (np.empty(COUNT),), np.empty(COUNT, np.int64), np.empty(COUNT, np.int64)
    rivals |= {OWN: repeated(lambda: drivers.fill_images(params, SIDE, (x,), *made))}
    turns = take_turns(benchmark, repeated(lambda: ls.maps.images(params, x, SIDE)), rivals, ROUNDS)
    x_c, side_c, code_c = turns.answers[VECTORISED]
    np.testing.assert_allclose(turns.answer.x, x_c, rtol=0, atol=1e-13)
    np.testing.assert_array_equal(turns.answer.side, side_c)
    np.testing.assert_array_equal(turns.answer.code, code_c)
    assert turns.answer.second_pass == 0.0
    what = "a throw, limitsets.maps.images"
    table += [
        versus(what, turns, OWN, unit="ns", per=PER, within=1.25),
        versus(what, turns, VECTORISED, unit="ns", per=PER, within=1.5),
        versus(what, turns, LIBM, unit="ns", per=PER, faster=10),
    ]


# ----------------------------------------------------------------
# What effects cost: nothing where a scene does not ask for them, and each its own where it does.


PAIRS = 20
OF_EFFECTS = 4096

# Facts for every effect, so that each can be switched on alone.
WORLD = {"friction": 0.9, "restitution": 0.2, "bounce_threshold": "0.01 in", "stroke": "5 deg"}
WORLD |= {"scatter": {"speed": "0.3 %"}}
EFFECTS = [{name: True} for name in ("landing", "roll", "slip", "pivot", "bounce", "drive")]
EFFECTS.append({"landing": True, "roll": True})


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


@pytest.mark.bench
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


@pytest.mark.bench
@pytest.mark.parametrize("effects", EFFECTS, ids="+".join)
def test_an_effect(benchmark, effects, table):
    bare = ls.load("paper-initial")
    full = ls.load(bare.as_dict() | {"effects": effects, "world": WORLD})
    x = np.random.default_rng(3).uniform(14.0, 22.0, OF_EFFECTS)

    def throws(params):
        after, (side, code) = (np.empty(OF_EFFECTS),), np.empty((2, OF_EFFECTS), np.int64)
        return lambda: drivers.fill_images(params, 2, (x,), after, side, code)

    turns = take_turns(benchmark, throws(full.map), {"the bare map": throws(bare.map)}, PAIRS)
    what = f"a throw with {' and '.join(effects)}"
    table.append(versus(what, turns, "the bare map", unit="ns", per=OF_EFFECTS, within=np.inf, inform=True))


# ----------------------------------------------------------------
# What accuracy costs: the limit set to a given error by each method, and one throw by each arithmetic.
# Errors are asserted against ends known to twelve digits (from the decimal scene, at 40 digits); the curves behind
# these rows are drawn by studies/03_accuracy.


EXACT = LIMIT_SETS["paper-designed"]
ROUNDS_ACCURACY = 15


def error_of(extents):
    return _distance(extents, EXACT)


def attracting(scene, cells, method=None):
    """The graph and the extents of its one attractor, without the orbit on which jogs are counted."""
    graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=cells), method)
    sets = zip(graph.recurrent_components(), graph.condensation().attracting, strict=True)
    ((cells_of_it, _),) = [(part, ends) for part, ends in sets if ends]
    from limitsets.systems.cells import CellSet

    return graph, CellSet.of(graph.grid, cells_of_it)


@pytest.mark.bench
def test_ends_of_the_limit_set(benchmark, table):
    scene = ls.load("paper-designed")

    def critical():
        graph, cells = attracting(scene, 2048)

        class Cells:
            extents = cells.extents()

        return ls.limit_set(graph, Cells()).extents

    def proved():
        return proved_ends(attraction(cover(parameter_box(scene), 2048)))

    rivals = {
        "cells, error 3e-3": lambda: attracting(scene, 65536)[1].extents(),
        "proved boxes, error 3e-3": lambda: attracting(scene, 65536, "boxes")[1].extents(),
        "proved end points, error 1.5e-11": proved,
    }
    turns = take_turns(benchmark, critical, rivals, ROUNDS_ACCURACY)
    assert error_of(turns.answer) < 2e-12  # the digits that are known
    for name in ("cells, error 3e-3", "proved boxes, error 3e-3"):
        assert 1e-3 < error_of(turns.answers[name]) < 5e-3
    assert turns.answers["proved end points, error 1.5e-11"].width < 1e-10
    what = "ends of the limit set by critical orbits, error 1e-14"
    table += [versus(what, turns, name, unit="ms") for name in rivals]


@pytest.mark.bench
def test_an_error_asked_for(benchmark, table):
    scene = ls.load("paper-designed")
    rivals = {"analyse": lambda: ls.analyse(scene)}
    turns = take_turns(benchmark, lambda: ls.analyse(scene, error=1e-6), rivals, ROUNDS_ACCURACY)
    assert turns.answer.accuracy.met
    assert error_of(turns.answer.extents[0]) < 1e-6
    found = turns.answer.accuracy
    table += [
        versus("analyse to an error of 1e-6: planned, done, verified", turns, "analyse"),
        limit("the same: seconds said before", found.plan.chosen.seconds, "s", None),
        limit("the same: seconds taken by what was planned", found.seconds, "s", None),
    ]


@pytest.mark.bench
def test_one_throw(benchmark, table):
    scene = ls.load("paper-designed")
    x = np.random.default_rng(2).uniform(*EXACT[2][0], 4096)
    from limitsets.feeder.thrower import Energy, SmallAngle

    small = scene.map._replace(flight=SmallAngle(), flip=Energy())
    name = "small angle (errors of inches)"
    rivals = {name: lambda: ls.maps.images(small, x, 2)}
    turns = take_turns(benchmark, lambda: ls.maps.images(scene.map, x, 2), rivals, 200)
    same = turns.answer.side == turns.answers[name].side
    assert np.abs(turns.answer.x - turns.answers[name].x)[same].max() > 1.0
    table.append(versus("an exact throw, limitsets.maps.images", turns, name, unit="ns", per=4096))


@pytest.mark.bench
def test_density(benchmark, table):
    cells, throws = 16384, 10**6
    edges = np.linspace(0.0, 1.0, cells + 1)
    exact = np.diff(2.0 / np.pi * np.arcsin(np.sqrt(edges)))
    params = ls.maps.Logistic(4.0)

    def ulam():
        (found,) = invariant_measures(ls.transitions(params, ls.grid([(0.0, 1.0)], cells=cells)))
        return found.weight

    def histogram():
        path = ls.orbit(params, 0.3, 0, throws)
        return np.bincount((path.x[1:] * 1000).astype(int).clip(0, 999), minlength=1000) / throws

    turns = take_turns(benchmark, ulam, {"histogram of 1e6 steps": histogram}, ROUNDS_ACCURACY)
    mine = np.abs(turns.answer - exact).sum()
    bins = np.diff(2.0 / np.pi * np.arcsin(np.sqrt(np.linspace(0.0, 1.0, 1001))))
    theirs = np.abs(turns.answers["histogram of 1e6 steps"] - bins).sum()
    assert mine < theirs < 0.1
    what = f"density of the logistic map, Ulam, 16384 cells (error {mine:.2g}, histogram {theirs:.2g})"
    table.append(versus(what, turns, "histogram of 1e6 steps", unit="ms"))
