"""The transfer operator with noise: a million cells beside plain sampling, and its answers beside 1e8 throws."""

from __future__ import annotations

from time import perf_counter

import numpy as np
import pytest
from scipy.sparse import coo_array

import limitsets as ls
from limitsets.feeder.scattering import Gaussian, Scattering, kappa_strata, starts_from, still_map, thrown
from limitsets.parameters.noise.sampling import scattering_map, throw_many
from limitsets.parameters.noise.statistics import noise_statistics
from limitsets.parameters.noise.ulam import transfer
from tests.bench.measure import limit, take_turns, versus

pytestmark = pytest.mark.bench

NOISE = Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02))
GOAL = (20.5, 2)
STRATA = 8
POINTS = 64
THROWS = 100_000_000


def one_step(cover):
    """Build the operator as sums along the cells, and apply it once to even masses."""
    scene = ls.load("paper-designed")
    chain = transfer(
        thrown(still_map(scene)),
        cover,
        parameter=kappa_strata(NOISE, scene, STRATA),
        landing=NOISE.landing,
        strata=STRATA,
    )
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
        after, to, code, _ = ls.maps.advance(
            params, x, np.full(x.size, side), 1, first=int(source[0]) * POINTS
        )
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
    turns = take_turns(
        benchmark,
        lambda: one_step(cover),
        {"sampled matrix": lambda: one_step_by_sampling(cover)},
        rounds=3,
    )
    same(turns.answer, turns.answers["sampled matrix"], cover)
    row = versus("noisy operator, 1e5 cells, built and applied once", turns, "sampled matrix")
    table.append(row)


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
    found = noise_statistics(
        scene, noise, goal=GOAL, sensitivity=False, cells=2048 if noise.given() else 8192
    )
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
