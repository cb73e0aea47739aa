"""Exact throws of limit-set states in a batch, against C with the same guarantee and against libm and Newton."""

from __future__ import annotations

import numpy as np
import pytest

import limitsets as ls
from limitsets.feeder.thrower.params import gather
from limitsets.systems.maps import drivers
from tests.bench.compiled import compiler, throws_in_c
from tests.bench.measure import take_turns, versus

pytestmark = [
    pytest.mark.bench,
    pytest.mark.skipif(compiler() is None, reason="no C compiler: cc is the rival"),
]

SIDE, COUNT, ROUNDS = 2, 4096, 400
REPEATS = 5  # per round: what the others left in the cache matters for the first only
LO, HI = 8.9140259080455, 23.383151921158  # the limit set of paper-designed on side 2

PER = COUNT * REPEATS
VECTORISED, UNCONTRACTED, LIBM = (
    "C, vectorised, contraction",
    "C, vectorised, no contraction",
    "C, libm and Newton",
)


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


def test_public(benchmark, throws, table):
    params, x, rivals = throws
    turns = take_turns(benchmark, repeated(lambda: ls.maps.images(params, x, SIDE)), rivals, ROUNDS)
    x_c, side_c, code_c = turns.answers[VECTORISED]
    np.testing.assert_allclose(turns.answer.x, x_c, rtol=0, atol=1e-13)
    np.testing.assert_array_equal(turns.answer.side, side_c)
    np.testing.assert_array_equal(turns.answer.code, code_c)
    assert turns.answer.second_pass == 0.0
    what = "a throw, limitsets.maps.images"
    table += [
        versus(what, turns, VECTORISED, unit="ns", per=PER, within=1.5),
        versus(what, turns, LIBM, unit="ns", per=PER, faster=10),
    ]
