"""Proved brackets of probabilities beside 1e8 throws, and the transfer operator's mean beside that of the cut law."""

from __future__ import annotations

from time import perf_counter

import numpy as np
import pytest
from scipy import stats

import limitsets as ls
from limitsets.feeder.scattering import Gaussian, Scattering, Uniform, starts_from
from limitsets.parameters.noise.sampling import ManyParts, scattering_map, uniform_starts
from limitsets.parameters.noise.statistics import noise_statistics
from limitsets.proofs.chances.absorption import absorption_brackets
from tests.bench.measure import limit

pytestmark = pytest.mark.bench

THROWS = 100_000_000
PARTS = 500_000
# Two-sided 99.99 %.
MISS = 0.5e-4


def throw_to_the_end(scene, scatter, x, side):
    """Throw parts from even starts till each has ended: throws of each, and whether it is right, wrong or neither."""
    random, made, seed = np.random.default_rng(5), 0, 0
    times, right, wrong = [], 0, 0
    while made < THROWS:
        seed += 1
        many = ManyParts(
            scattering_map(scene, scatter, seed), *uniform_starts(random, starts_from(scene), x, PARTS)
        )
        number = 0
        while many.x.size:
            number += 1
            made += many.x.size
            code = many.throw()
            far = (many.x >= x) & (code >= 0)
            there = far & (many.side == side)
            right, wrong = right + int(there.sum()), wrong + int((far & ~there).sum())
            over = far | (code < 0)
            times.append(np.full(int(over.sum()), number))
            many.keep(~over)
    return np.concatenate(times), right, wrong, made


def interval_of(count, parts):
    """Clopper and Pearson."""
    low = stats.beta.ppf(MISS, count, parts - count + 1) if count else 0.0
    high = stats.beta.ppf(1.0 - MISS, count + 1, parts - count) if count < parts else 1.0
    return float(low), float(high)


def meet(table, what, sampled, proved):
    """Add both to the table; they have to have numbers in common."""
    (low, high), (lo, hi) = sampled, proved
    print(f"{what}: thrown {low:.6f} to {high:.6f}, proved {lo:.6f} to {hi:.6f}")
    table.append(limit(f"{what}, proved bracket's width", hi - lo, "", None))
    table.append(limit(f"{what}, width of the 99.99 % interval", high - low, "", None))
    assert low <= hi, what
    assert high >= lo, what


BOTH = Scattering(speed=Uniform(0.003), landing=Uniform(0.02))
CASES = [
    pytest.param("paper-designed", 20.5, BOTH, 12_000, (23, 40, 63), 80, id="designed"),
    pytest.param("paper-initial", 20.0, Scattering(landing=Uniform(0.1)), 1000, (23, 63), 200, id="landing"),
    pytest.param("paper-initial", 20.0, Scattering(speed=Uniform(0.005)), 12_000, (23, 63), 150, id="speed"),
]


@pytest.mark.parametrize(("name", "x", "scatter", "cells", "counts", "throws"), CASES)
def test_1e8_throws_meet_the_brackets(name, x, scatter, cells, counts, throws, table):
    scene, begin = ls.load(name), perf_counter()
    # Without scatter of the landing a start next to the joint needs throws without bound: there is no mean.
    mean = scatter.landing is not None
    found = absorption_brackets(scene, scatter, right=(x, 2), wrong=x, cells=cells, throws=throws, mean=mean)
    table.append(limit(f"brackets of {name}, {cells} cells", perf_counter() - begin, "s", None))
    begin = perf_counter()
    times, right, wrong, made = throw_to_the_end(scene, scatter, x, 2)
    table.append(limit(f"{made} throws of {name}", perf_counter() - begin, "s", None))
    parts = times.size
    for n in counts:
        count = int((times <= n).sum())
        meet(table, f"{name}: P(T <= {n})", interval_of(count, parts), found.within["any"][:, n])
    # After the last throw a part not yet ended may still end anywhere.
    open_ = 1.0 - found.within["any"][0, -1]
    for kind, count in (("right", right), ("wrong", wrong)):
        low, high = found.within[kind][:, -1]
        meet(table, f"{name}: {kind} at last", interval_of(count, parts), (low, high + open_))
    if mean:
        error = stats.norm.isf(MISS) * times.std(ddof=1) / np.sqrt(parts)
        meet(table, f"{name}: mean", (times.mean() - error, times.mean() + error), found.mean)
    if name == "paper-designed":
        assert found.quantile(0.95) == (63, 63)


def test_the_mean_of_a_normal_law_cut_at_six_sigma_lies_in_its_bracket(table):
    noise = Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02))
    found = absorption_brackets("paper-designed", noise, right=(20.5, 2), cells=4000, throws=2)
    solved = noise_statistics("paper-designed", noise, goal=(20.5, 2), sensitivity=False, cells=2048)
    print(f"mean: operator {solved.numbers['mean throws']:.5f}, proved {found.mean}")
    table.append(limit("mean of the normal law, bracket's width", found.mean[1] - found.mean[0], "", None))
    assert found.mean[0] - 0.008 <= solved.numbers["mean throws"] <= found.mean[1] + 0.008
