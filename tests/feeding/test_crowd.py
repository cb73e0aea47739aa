"""Many parts at once: against the trials of single parts, from the same law of starts and noise."""

import json
import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.stats import binomtest, norm

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.base.files import as_json
from limitsets.cell.feeding.crowd import _Batch, run_crowd
from limitsets.cell.feeding.falling import FATES, arm_end_of
from limitsets.cell.feeding.trials import run_trials
from limitsets.feeder.engine import Crowd
from limitsets.feeder.scattering import Gaussian, Given, Scattering
from tests.feeding.scenes import with_cavity

pytest.importorskip("pymunk")

NOISE = Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02))


def scene(name="paper-designed", **changes):
    tables = {"effects": {"contact": True}, "world": {"friction": 0.9}, **changes}
    return with_cavity(name, tables=tables)


@cache
def single(name):
    return run_trials(arm_end_of(scene(name)), NOISE, 20_000, seed=3)


def assert_alike(found, trials, throws):
    """Counts within binomial intervals of those of single parts, and the mean number of throws."""
    count = int(found.fates.sum())
    for name in FATES:
        low, high = binomtest(found.counts[name], count).proportion_ci(0.9999, method="exact")
        assert low - 2e-3 <= trials.counts[name] / trials.fate.size <= high + 2e-3, name
    if throws:
        error = trials.throws.std() / np.sqrt(found.throws.size)
        assert abs(found.throws.mean() - trials.throws.mean()) < 4.0 * error


@pytest.mark.parametrize("name", ["paper-designed", "paper-initial"])
def test_one_part_does_what_single_parts_do(name):
    found = run_crowd(arm_end_of(scene(name)), NOISE, 1, batches=120, seed=2)
    assert_alike(found, single(name), throws=True)
    assert not found.met.any()
    assert not found.spilled.any()


def test_parts_that_pass_through_each_other_do_too():
    found = run_crowd(arm_end_of(scene("paper-initial")), NOISE, 6, batches=20, between=False, seed=4)
    assert found.fates.sum() == 120
    assert_alike(found, single("paper-initial"), throws=False)


def test_batches_are_the_same_whoever_throws_them():
    end = arm_end_of(scene())
    how = {"batches": 3, "seed": 1, "throws": 10}
    here = run_crowd(end, NOISE, 2, **how)
    with ThreadPoolExecutor(2) as threads:
        spread = run_crowd(end, NOISE, 2, **how, executor=threads)
    told = [each.to_json() | {"seconds_per_part_and_throw": 0.0} for each in (here, spread)]
    assert told[0] == told[1]
    assert (here.fates == spread.fates).all()
    assert len(pickle.dumps(end)) > 0  # processes are sent it


@pytest.mark.sweep
def test_parts_that_push_each_other_are_counted():
    one = run_crowd(arm_end_of(scene()), NOISE, 5, batches=4, seed=1, throws=40)
    assert one.met.all()
    assert (one.fates.sum(axis=1) + one.spilled == 5).all()
    # of single parts nothing leaves or feeds another side
    assert one.counts["left"] + one.counts["wrong"] > 0


def test_more_parts_than_find_a_place_are_dropped_and_some_spill():
    """The arm before its end takes three or four side by side."""
    found = run_crowd(arm_end_of(scene()), NOISE, 30, batches=1, throws=5)
    assert found.spilled[0] > 5
    assert found.fates.sum() + found.spilled[0] == 30
    assert found.throws.tolist() == [5]


def test_the_lowest_part_is_taken_out_first_and_the_next_slides_down():
    """Two of the same side, one on top of the other: alone each falls in rightly, so both do."""
    fed = scene()
    crowd = Crowd([fed] * 2)
    for number in (0, 1):
        crowd.place(number, 21.0, 2)
        rests = crowd.settle()
    assert [rest.where for rest in rests] == ["cavity", "cavity"]
    assert [rest.side for rest in rests] == [2, -1]  # the second lies on the first
    batch = _Batch(crowd, arm_end_of(fed), np.random.default_rng(0))
    batch._take_out(rests)
    assert batch.fates() == [2, 0, 0, 0, 0, 0]


@pytest.mark.parametrize(("off", "fate"), [(-0.01, "left"), (0.01, "never")])
def test_a_part_that_rests_at_a_or_nearer_to_the_joint_has_left(off, fate):
    """Side 2 of paper-designed has a = 4.22558 in: no throw lifts the left corner of a part that rests there."""
    fed = scene()
    crowd = Crowd([fed])
    crowd.drop(0, (4.22558 + off, fed.surface_height + fed.sides.d[2], crowd.members[0].flat[2]))
    batch = _Batch(crowd, arm_end_of(fed), np.random.default_rng(0))
    batch._take_out(crowd.settle())
    assert batch.fates()[FATES.index(fate)] == 1


def test_rates_count_right_feeds_per_throw():
    found = run_crowd(arm_end_of(scene()), NOISE, 1, batches=2)
    made = replace(found, fates=np.array([[3, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 2]]), throws=np.array([10, 30]))
    rate, error = made.right_per_throw
    assert rate == pytest.approx(0.1)
    # residuals 3 - 1 and 1 - 3: standard deviation sqrt(8), over sqrt(2) batches of 20 throws in the mean
    assert error == pytest.approx(np.sqrt(8.0) / np.sqrt(2.0) / 20.0)
    assert made.per_minute(2.0) == pytest.approx(12.0)
    assert made.per_minute(None) is None


def test_feed_has_both_kinds_and_its_json():
    found = ls.feed(scene(), NOISE, prove=False, level=False, trials=50, parts=2, batches=2, seed=5)
    assert [crowd.between for crowd in found.crowds] == [True, False]
    table = json.loads(as_json(found))
    first = table["crowds"][0]
    assert first["parts"] == first["batches"] == 2
    assert sum(first["counts"].values()) + 2 * first["spilled"] == 4
    assert first["right_per_minute"] is None
    assert first["seed"] == 5


@pytest.mark.parametrize(
    ("changes", "asked", "said"),
    [
        ({"effects": {}}, {}, "effects.contact"),
        ({"world": {}}, {}, "world.friction"),
        ({}, {"parts": 0}, "1 or more"),
        ({}, {"scatter": Scattering(speed=Given(norm(scale=0.01)))}, "Gaussian or Uniform"),
    ],
)
def test_what_cannot_be_thrown_is_refused(changes, asked, said):
    asked = {"parts": 2, "scatter": NOISE, **asked}
    with pytest.raises(AnswerError, match=said):
        ls.feed(scene(**changes), trials=10, prove=False, **asked)
