"""Machines that do what the model lacks, thrown by the effects that exist; and the level on machines that do not."""

import tracemalloc
from functools import cache

import numpy as np
import pytest
from scipy.stats import binom, norm

import limitsets as ls
from limitsets.parameters.fitting import Throws
from limitsets.parameters.fitting.likelihood import as_recorded
from limitsets.parameters.fitting.misfit import SHARES, WIDER, _ratio, misfit_of
from limitsets.parameters.fitting.searching import robust_start
from limitsets.systems.maps import advance
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


@cache
def moved(effect, count=4000):
    """A machine, and random throws of one with an effect, that land elsewhere by more than 3 sigma and that do not."""
    one, other = with_effect(**{effect: True, "landing": True})
    draw = np.random.default_rng(20)
    side = draw.integers(0, 3, count)
    x = draw.uniform(one.sides.a[side] + 2.0, one.arm_length - 1.0)
    (to, on, code, *_), (other_to, other_on, other_code, *_) = (
        advance(each.map, x, side, 1) for each in (one, other)
    )
    fine = (code >= 0) & (other_code >= 0)
    far = fine & ((np.abs(other_to - to) > 3.0 * SIGMA) | (on != other_on))
    same = fine & (np.abs(other_to - to) < 0.3 * SIGMA) & (on == other_on)
    return one, (x, side, other_to, other_on), np.flatnonzero(far), np.flatnonzero(same)


def spoiled_film(draw, effect, strange=5, n=50):
    """The machine without the effect, and a film of that with it, that many landings moved by more than 3 sigma."""
    one, thrown, far, same = moved(effect)
    chosen = np.concatenate([draw.choice(far, strange, False), draw.choice(same, n - strange, False)])
    x, side, to, on = (each[chosen] for each in thrown)
    noise = ERROR * draw.standard_normal((2, n))
    rows = np.arange(2, n + 2)
    return one, Throws(x + noise[0], side, to + noise[1], on, np.full(n, ERROR), np.zeros(n, bool), rows)


def lacking(scene, throws):
    """Ask the test alone, without intervals."""
    return misfit_of(scene, robust_start(scene, as_recorded(throws, throws.error, True, 3))).lacking


def told_apart(effect, count, seed):
    draw = np.random.default_rng(seed)
    return sum(lacking(*spoiled_film(draw, effect)) for _ in range(count))


def rejected(count, seed, **how):
    draw, given = np.random.default_rng(seed), ls.load(scene("designed"))
    return sum(lacking(given, film(draw, machine(draw), **how)) for _ in range(count))


@pytest.mark.sweep
@pytest.mark.parametrize("effect", ["roll", "slip"])
def test_a_machine_with_an_effect_is_told_apart(effect):
    # of a power of 90 % fewer than this come once in a thousand times
    assert told_apart(effect, 20, seed=21) >= binom.ppf(1e-3, 20, 0.9)


@pytest.mark.sweep
def test_a_machine_without_one_is_left_alone():
    assert rejected(20, seed=23) <= binom.ppf(0.9999, 20, 0.05)


@pytest.mark.sweep
@pytest.mark.parametrize("effect", ["roll", "slip"])
def test_the_power_is_90_percent(effect):
    assert told_apart(effect, 400, seed=22) >= 360


@pytest.mark.sweep
@pytest.mark.parametrize("flipped", [0.0, 0.05])
def test_the_level_is_5_percent(flipped):
    assert rejected(400, seed=24, flipped=flipped) <= binom.ppf(0.999, 400, 0.05)


@pytest.mark.parametrize("effect", [None, "roll", pytest.param("slip", marks=pytest.mark.sweep)])
def test_the_fit_asks_the_same_test(effect):
    draw = np.random.default_rng(27)
    given = ls.load(scene("designed"))
    one, throws = spoiled_film(draw, effect) if effect else (given, film(draw, machine(draw)))
    found = ls.fit(one, throws).misfit
    assert found.lacking == lacking(one, throws) == (effect is not None)


def test_rows_that_land_far_off_are_named():
    found = ls.fit(*spoiled_film(np.random.default_rng(25), "roll")).misfit
    assert set(found.strange) >= {2, 3, 4, 5, 6}
    assert len(found.strange) <= 10


def test_a_number_written_down_wrong_is_named_alone():
    draw = np.random.default_rng(26)
    throws = film(draw, machine(draw))
    after = throws.x_after.copy()
    after[6] = 26.5 - after[6] / 2.0
    found = ls.fit(ls.load(scene("designed")), type(throws)(**{**vars(throws), "x_after": after})).misfit
    assert found.lacking
    assert found.strange == (8,)


def test_the_ratio_of_likelihoods_takes_one_alternative_at_a_time():
    """By the densities of scipy; all at once took 20 times the memory, and held Ctrl-C back."""
    z = np.random.default_rng(3).standard_normal((1000, 200)) * 2.0
    alternatives = [(share, wide) for share in SHARES for wide in WIDER]
    plain = norm.logpdf(z)
    expected = [
        np.logaddexp(np.log1p(-share) + plain, np.log(share) + norm.logpdf(z, scale=wide)) - plain
        for share, wide in alternatives
    ]
    tracemalloc.start()
    found = _ratio(z)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found == pytest.approx(np.max([each.sum(axis=1) for each in expected], axis=0), rel=1e-9)
    assert peak < 8 * z.nbytes
