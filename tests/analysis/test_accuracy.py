"""An error asked for: which method is picked for it, and whether what is reached is true."""

import json
from pathlib import Path

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.parameters.analysis import plan_for
from limitsets.parameters.analysis.accuracy import _distance, _Visited

HERE = Path(__file__).parent

# From the decimal scenes at 40 digits.
EXACT = {
    "paper-designed": {
        0: [(15.205338825681, 19.75268801485)],
        1: [(12.637023572659, 17.439819281769)],
        2: [(8.9140259080455, 23.383151921158)],
    },
    "paper-initial": {
        0: [(13.522673689975, 20.915912223359)],
        1: [(18.994941734574, 19.975954977782), (20.434045200511, 21.554457325114)],
        2: [(16.262705754072, 21.886351326378)],
    },
}


def true_error(found, name):
    exact = EXACT[name]
    return _distance(found.extents[0], exact)


@pytest.mark.parametrize("name", sorted(EXACT))
@pytest.mark.parametrize("error", [0.5, 0.05, 1e-3, 1e-6, 1e-10])
def test_the_error_asked_for_is_met_and_known(name, error):
    plans = []
    found = ls.analyse(name, error=error, announce=plans.append)
    reached = found.accuracy
    assert plans == [reached.plan]
    assert reached.plan.expected
    assert reached.met
    assert true_error(found, name) <= reached.reached + 1e-12  # the ends above have twelve digits
    assert found.extents_from == (reached.plan.chosen.method,)
    assert found.graph.grid.shape[0, 0] == reached.plan.chosen.cells
    assert reached.plan.chosen.error <= error


def test_cells_never_do_for_a_small_error():
    plan = plan_for(ls.load("paper-designed"), 1e-6)
    assert plan.chosen.method == "end points"
    assert plan.other.method == "cells"
    assert plan.other.error > 1e-6


def test_what_cannot_be_met_is_told():
    found = ls.analyse("paper-designed", error=1e-16)
    assert not found.accuracy.plan.expected
    assert not found.accuracy.met
    assert "rounding" in found.accuracy.advice
    assert found.accuracy.proved < 1e-10
    record = json.loads(json.dumps(found.to_json(), allow_nan=False))["accuracy"]
    assert record["met"] is False
    assert record["reached"] > record["asked"] == 1e-16


def test_where_nothing_stays_there_is_nothing_to_meet():
    scene = ls.load(HERE / "five-sides.toml").with_values(
        {"throw.kappa": 60.0, "arm.surface_height": -0.5}  # weak throws with a high arm
    )
    found = ls.analyse(scene, error=1e-3)
    assert found.attractors == ()
    assert found.accuracy.reached is None
    assert not found.accuracy.met
    json.dumps(found.to_json(), allow_nan=False)


def test_nothing_is_planned_where_nothing_is_asked():
    assert ls.analyse("paper-designed").to_json()["accuracy"] is None


@pytest.mark.parametrize("error", [0, -1.0, float("nan"), float("inf"), "fine"])
def test_errors_that_cannot_be(error):
    with pytest.raises(AnswerError, match="error"):
        ls.analyse("paper-designed", error=error)


def test_cells_and_an_error():
    with pytest.raises(AnswerError, match="not both"):
        ls.analyse("paper-designed", 64, error=1e-3)


def test_distance_of_unions():
    assert _distance({0: [(0.0, 1.0)]}, {0: [(0.25, 1.5)]}) == 0.5
    assert _distance({0: [(0.0, 4.0)]}, {0: [(0.0, 1.0), (3.0, 4.0)]}) == 1.0  # the middle of the gap
    assert _distance({0: [(0.0, 4.0)]}, {0: [(0.0, 4.0)], 1: [(0.0, 1.0)]}) == float("inf")


def test_a_hole_counts_by_half():
    seen = _Visited(0, 0.0, 10.0, 0.01)
    seen.add(np.concatenate([np.arange(0.0, 4.0, 0.005), np.arange(6.0, 10.0, 0.005)]))
    assert seen.gap() == pytest.approx(1.0, abs=0.03)
