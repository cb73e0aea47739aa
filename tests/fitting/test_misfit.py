"""Machines that do what the model lacks, thrown by the effects that exist; and the level on machines that do not."""

import numpy as np
import pytest
from scipy.stats import binom

import limitsets as ls
from limitsets.fitting import Throws
from limitsets.maps import advance
from tests.fitting.machines import film, machine
from tests.proofs.forge import scene

ERROR = 0.02
# Of a landing less what is predicted: both places are measured.
SIGMA = ERROR * np.sqrt(2.0)


def with_effect(**effects):
    """paper-initial as it is, and with effects on."""
    bare = ls.load("paper-initial").as_dict()
    return ls.load(bare), ls.load(
        bare | {"effects": effects, "world": {"friction": 0.35, "restitution": 0.3}}
    )


def moved(one, other, draw, count):
    """Random starts, where both machines throw the part, and by how much the second lands elsewhere."""
    side = draw.integers(0, 3, count)
    x = draw.uniform(one.sides.a[side] + 2.0, one.arm_length - 1.0)
    ends = [advance(each.map, x, side, 1) for each in (one, other)]
    fine = (ends[0][2] >= 0) & (ends[1][2] >= 0)
    return [each[fine] for each in (x, side, ends[0][0], ends[0][1], ends[1][0], ends[1][1])]


def spoiled_film(draw, one, other, strange=5, n=50):
    """A film of the second machine with exactly so many landings moved by more than 3 sigma."""
    x, side, to, on, other_to, other_on = moved(one, other, draw, 4000)
    far = (np.abs(other_to - to) > 3.0 * SIGMA) | (on != other_on)
    same = np.flatnonzero((np.abs(other_to - to) < 0.3 * SIGMA) & (on == other_on))
    chosen = np.concatenate(
        [draw.choice(np.flatnonzero(far), strange, False), draw.choice(same, n - strange, False)]
    )
    noise = ERROR * draw.standard_normal((2, n))
    return Throws(
        x[chosen] + noise[0], side[chosen], other_to[chosen] + noise[1], other_on[chosen], np.full(n, ERROR),
        np.zeros(n, bool), np.arange(2, n + 2),
    )  # fmt: skip


@pytest.mark.parametrize("effects", [{"roll": True, "landing": True}, {"slip": True, "landing": True}])
def test_a_machine_with_an_effect_is_told_apart(effects):
    one, other = with_effect(**effects)
    draw = np.random.default_rng(21)
    lacking = [ls.fit(one, spoiled_film(draw, one, other)).misfit.lacking for _ in range(6)]
    # of a power of 90 % fewer than this come once in a thousand times
    assert sum(lacking) >= binom.ppf(1e-3, 6, 0.9)


@pytest.mark.sweep
@pytest.mark.parametrize("effects", [{"roll": True, "landing": True}, {"slip": True, "landing": True}])
def test_the_power_is_90_percent(effects):
    one, other = with_effect(**effects)
    draw = np.random.default_rng(22)
    lacking = sum(ls.fit(one, spoiled_film(draw, one, other)).misfit.lacking for _ in range(100))
    assert lacking >= 90


def rejected(count, seed):
    draw, given = np.random.default_rng(seed), ls.load(scene("designed"))
    return sum(ls.fit(given, film(draw, machine(draw))).misfit.lacking for _ in range(count))


def test_a_machine_without_one_is_left_alone():
    assert rejected(10, seed=23) <= binom.ppf(0.9999, 10, 0.05)


@pytest.mark.sweep
def test_the_level_is_5_percent():
    assert rejected(200, seed=24) <= binom.ppf(0.999, 200, 0.05)


def test_rows_that_land_far_off_are_named():
    one, other = with_effect(roll=True, landing=True)
    throws = spoiled_film(np.random.default_rng(25), one, other)
    found = ls.fit(one, throws).misfit
    assert set(found.strange) >= {2, 3, 4, 5, 6}
    assert len(found.strange) <= 10
