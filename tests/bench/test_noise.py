"""Chains of noise and brackets of their probabilities, with their rivals."""

from __future__ import annotations

from time import perf_counter, process_time

import numpy as np
import pytest
from scipy import stats
from scipy.sparse import coo_array

import limitsets as ls
from limitsets.feeder.scattering import (
    Gaussian,
    Scattering,
    Uniform,
    kappa_strata,
    starts_from,
    still_map,
    thrown,
)
from limitsets.parameters.noise.sampling import ManyParts, scattering_map, throw_many, uniform_starts
from limitsets.parameters.noise.statistics import noise_statistics
from limitsets.parameters.noise.ulam import transfer
from limitsets.proofs.chances.absorption import absorption_brackets
from limitsets.proofs.chances.long_run import long_run_averages
from limitsets.proofs.policies import policy_chances
from limitsets.proofs.prover.certificate import recheck
from tests.bench.measure import limit, take_turns, versus
from tests.checker.test_policy_chances import policies, thrown as run_table
from tests.proofs.test_long_run import thrown as plain_throws

pytestmark = pytest.mark.bench


# ----------------------------------------------------------------
# The transfer operator with noise: a million cells beside plain sampling, and its answers beside 1e8 throws.


NOISE = Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02))
GOAL = (20.5, 2)
STRATA = 8
POINTS = 64
THROWS = 100_000_000


def one_step(cover):
    """Build the operator as sums along the cells, and apply it once to even masses."""
    scene = ls.load("paper-designed")
    laws = {"parameter": kappa_strata(NOISE, scene, STRATA), "landing": NOISE.landing}
    chain = transfer(thrown(still_map(scene)), cover, **laws, strata=STRATA)
    even = cover.measure / cover.measure.sum()
    return np.maximum(chain.landing.adjoint(chain.throw.adjoint(even)), 0.0)


def one_step_by_sampling(cover):
    """Ulam's method as it is usually written: points of each cell thrown once, counted into a sparse matrix."""
    params = scattering_map(ls.load("paper-designed"), NOISE, 1)
    rows, columns = [], []
    for side in range(cover.sides):
        (edges,) = cover.edges[side]
        place = (np.arange(POINTS) + 0.5) / POINTS
        x = (edges[:-1, None] + place * np.diff(edges)[:, None]).ravel()
        source = np.repeat(np.arange(cover.offset[side], cover.offset[side + 1]), POINTS)
        first = int(source[0]) * POINTS
        after, to, code, _ = ls.maps.advance(params, x, np.full(x.size, side), 1, first=first)
        for target in range(cover.sides):
            here = (to == target) & (code >= 0)
            cell = cover.index(after[here], target)
            rows.append(source[here][cell >= 0])
            columns.append(cell[cell >= 0])
    place = (np.concatenate(rows), np.concatenate(columns))
    weight = np.full(place[0].size, 1.0 / POINTS)
    matrix = coo_array((weight, place), shape=(cover.n_cells, cover.n_cells)).tocsr()
    return matrix.T @ (cover.measure / cover.measure.sum())


def cover_of(cells):
    return ls.grid(ls.load("paper-designed").domain, cells=cells, grading="uniform")


def same(ours, theirs, cover):
    """Masses in 300 bins agree as well as sampling can tell."""
    bins = np.minimum(np.arange(cover.n_cells) * 300 // cover.n_cells, 299)
    mine, other = np.bincount(bins, ours), np.bincount(bins, theirs)
    np.testing.assert_allclose(mine, other, rtol=0, atol=1e-4)


def test_building_and_one_step(benchmark, table):
    cover = cover_of(33_333)
    rivals = {"sampled matrix": lambda: one_step_by_sampling(cover)}
    turns = take_turns(benchmark, lambda: one_step(cover), rivals, rounds=3)
    same(turns.answer, turns.answers["sampled matrix"], cover)
    table.append(versus("noisy operator, 1e5 cells, built and applied once", turns, "sampled matrix"))


def test_a_million_cells(table):
    cover = cover_of(333_334)
    one_step(cover_of(100))
    begin = perf_counter()
    masses = one_step(cover)
    seconds = perf_counter() - begin
    assert masses.sum() == pytest.approx(1.0, abs=0.02)  # some land inward from near a_i
    table.append(limit("noisy operator, 1e6 cells, built and applied once", seconds, "s", 10.0))


@pytest.mark.parametrize("noise", [Scattering(), NOISE], ids=["no noise", "noise"])
def test_against_1e8_throws(noise, table):
    scene, word = ls.load("paper-designed"), "with noise" if noise.given() else "without noise"
    begin = perf_counter()
    cells = 2048 if noise.given() else 8192
    found = noise_statistics(scene, noise, goal=GOAL, sensitivity=False, cells=cells)
    mine = perf_counter() - begin
    begin = perf_counter()
    counted = throw_many(scene, noise, GOAL, starts_from(scene), throws=THROWS, parts=100_000)
    theirs = perf_counter() - begin
    for name in ("time on side 0", "share of flip", "time beyond", "wrong beyond", "mean throws", "fed"):
        error = 4.0 * np.hypot(counted.errors[name], found.errors[name])
        assert abs(found.numbers[name] - counted.numbers[name]) <= error, name
    table.append(limit(f"statistics {word}, operator and its errors", mine, "s", None))
    table.append(limit(f"statistics {word}, 1e8 throws", theirs, "s", None))
    off = abs(found.numbers["time on side 0"] - counted.numbers["time on side 0"])
    table.append(limit(f"time on side 0 {word}, operator off by", off, "", None))
    table.append(
        limit(
            f"time on side 0 {word}, standard error of 1e8 throws", counted.errors["time on side 0"], "", None
        )
    )


# ----------------------------------------------------------------
# Proved brackets of probabilities beside 1e8 throws, and the transfer operator's mean beside that of the cut law.


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


@pytest.mark.parametrize(("cells", "throws"), [(4000, 200), (12_000, 80), (12_000, 1)])
def test_the_recheck_of_brackets(cells, throws, table, tmp_path):
    """Throw by throw it took 136 s once, of 12 000 cells and 80 throws (docs/probabilities.md as of 47c8ecf9)."""
    found = absorption_brackets("paper-designed", BOTH, right=(20.5, 2), cells=cells, throws=throws)
    path, what = tmp_path / "brackets.proof.zip", f"paper-designed, {cells} cells, {throws} throws"
    widths = {"mean": found.mean, "P(ever right)": found.ever["right"]}
    for name, (lo, hi) in widths.items():
        table.append(limit(f"{what}: width of {name}", hi - lo, "", None))
    found.save(path, recheck=False)
    begin = process_time()
    assert recheck(path, workers=1).verdict == "proved"
    table.append(limit(f"{what}: recheck, of the processor", process_time() - begin, "s", None))


@pytest.mark.parametrize("asked", ["place", "catch"])
def test_1e8_throws_of_a_table_meet_its_bounds(asked, table):
    """A million parts at a time."""
    policy, noise = policies()[asked], Scattering(speed=Uniform(0.01), landing=Uniform(0.05))
    begin = perf_counter()
    chances = policy_chances(policy, noise, cells=4000)
    table.append(limit(f"chances of the table asked {asked}", perf_counter() - begin, "s", None))
    begin, parts, come, sums = perf_counter(), 0, 0, np.zeros(2)
    while sums[0] < THROWS:
        made, ended = run_table(policy, noise, 1_000_000, None, seed=parts)
        parts, come = parts + made.size, come + int(ended.sum())
        sums += made.sum(), (made**2).sum()
    table.append(limit(f"{sums[0]:.0f} throws of {parts} parts", perf_counter() - begin, "s", None))
    mean, square = sums / parts
    error = stats.norm.isf(MISS) * np.sqrt((square - mean**2) / parts)
    meet(table, f"table asked {asked}, mean", (mean - error, mean + error), chances.mean)
    meet(table, f"table asked {asked}, comes", interval_of(come, parts), chances.come)


# ----------------------------------------------------------------
# Long-run averages, proved, beside 1e8 throws.


def test_1e8_throws_meet_the_long_run_averages(table, tmp_path):
    scene, begin = ls.load("paper-designed"), perf_counter()
    proved = long_run_averages(scene, BOTH, cells=4000)
    table.append(limit("long-run averages of paper-designed, 4000 cells", perf_counter() - begin, "s", None))
    begin = perf_counter()
    assert recheck(proved.save(tmp_path / "long.proof.zip", recheck=False)).verdict == "proved"
    table.append(limit("their recheck", perf_counter() - begin, "s", None))
    begin, many = perf_counter(), stats.norm.isf(MISS)
    counted = throw_many(scene, BOTH, GOAL, starts_from(scene), throws=THROWS, parts=100_000)
    table.append(limit("1e8 throws", perf_counter() - begin, "s", None))
    names = {"share of flip": "flips_per_throw"} | {
        f"time on side {k}": f"share_of_side_{k}" for k in range(3)
    }
    for name, its in names.items():
        number, error = counted.numbers[name], many * counted.errors[name]
        meet(table, name, (number - error, number + error), proved.numbers[its])
    begin = perf_counter()
    exponents = np.array([plain_throws("designed", 0.003, 0.02, seed=seed)[2] for seed in range(8)])
    error = stats.t.isf(MISS, 7) * exponents.std(ddof=1) / np.sqrt(8)
    table.append(limit("exponent of 4e7 throws in numpy", perf_counter() - begin, "s", None))
    sampled = exponents.mean() - error, exponents.mean() + error
    meet(table, "Lyapunov exponent", sampled, proved.numbers["lyapunov"])
