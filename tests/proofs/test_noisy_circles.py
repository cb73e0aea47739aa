"""Averages of maps of circles whose steps scatter: known answers, random orbits, forged files."""

import math

import numpy as np
import pytest

import limitsets as ls
from tests.proofs.test_noisy_maps import itself, own, require_denied, section_of

TAU = 2.0 * math.pi


def doubled(x):
    return 2.0 * x


def wavy(x, a):
    return x + 0.3 + a * np.sin(6.283185307179586 * x) / 6.283185307179586


def tripled(x):
    return 3.0 * x + 0.2 * np.cos(x)


def turned_back(x):
    return 1.7 - x


def below_half(x):
    return x - 0.5


def test_the_doubling_map_has_the_uniform_law_under_any_noise():
    circle = ls.grid([(0.0, 1.0)], cells=200, periodic=True)
    for noise in (0.01, 0.2):
        answer = ls.average(ls.map(doubled), circle, ["lyapunov", itself, [(0.25, 0.5)]], noise=noise)
        for (lo, hi), exact in zip(answer.numbers.values(), (math.log(2.0), 0.5, 0.25), strict=True):
            assert lo <= exact <= hi
            assert hi - lo < (0.3 if noise == 0.01 else 0.01)
        assert answer.hi - answer.lo < 1e-8


# map, cells, noise, the step in floats, ln of the slope where that is asked, and how wide each number may be
CIRCLES = {
    "a map with turning points": (
        ls.map(wavy, a=1.6), (0.0, 1.0), 0.05, lambda x, _: wavy(x, 1.6),
        lambda x: np.log(np.abs(1.0 + 1.6 * np.cos(TAU * x))), (0.013, 0.003),
    ),
    "a period of 2 pi": (
        ls.map(tripled), (0.0, TAU), 0.2, lambda x, _: tripled(x), lambda x: np.log(3.0 - 0.2 * np.sin(x)), (0.01, 0.1),
    ),
    "cells from a place that is no float sum": (
        ls.map(wavy, a=0.9), (0.1, 1.1), {"landing": 0.02, "a": 0.05},
        lambda x, rng: wavy(x, rng.uniform(0.85, 0.95, x.size)), None, (0.01,),
    ),
    "two branches, one of which turns back": (
        ls.map(pieces=(doubled, turned_back), margin=below_half), (0.0, 1.0), 0.06,
        lambda x, _: np.where(x < 0.5, 2.0 * x, 1.7 - x), lambda x: np.where(x < 0.5, math.log(2.0), 0.0), (0.02, 0.02),
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CIRCLES)
def test_random_orbits_lie_within_the_bounds(case):
    the_map, (lo, hi), noise, step, logs, widths = CIRCLES[case]
    functions = [itself] if logs is None else ["lyapunov", itself]
    answer = ls.average(the_map, ls.grid([(lo, hi)], cells=400, periodic=True), functions, noise=noise)
    rng = np.random.default_rng(4)
    e = noise["landing"] if isinstance(noise, dict) else noise
    x, rows = rng.uniform(lo, hi, 10_000), []
    for k in range(250):
        x = lo + (step(x, rng) + rng.uniform(-e, e, x.size) - lo) % (hi - lo)
        if k >= 50:
            rows.append([x] if logs is None else [logs(x), x])
    for (least, most), width, row in zip(answer.numbers.values(), widths, np.mean(rows, axis=0), strict=True):
        error = 5.0 * row.std() / math.sqrt(row.size)
        assert least - error <= row.mean() <= most + error
        assert most - least < width


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    circle = ls.grid([(0.0, 1.0)], cells=60, periodic=True)
    path = tmp_path_factory.mktemp("circles") / "wavy.proof.zip"
    return ls.average(ls.map(wavy, a=0.8), circle, itself, noise=0.2).save(path, recheck=False)


def test_a_saved_answer_is_rechecked(saved):
    report = ls.recheck(saved)
    assert report.verdict == "proved"
    assert any("x0' modulo 1, in [0.0, 0.0 + 1)" in line for line in report.map["formulas"])


def last_node(forged, place):
    forged.arrays["0.nodes.0"][-1] = place


FORGED = {
    "nodes beyond the period": (lambda f: last_node(f, 1.0), None),  # a bad file
    "another function near the seam": (
        lambda f: f.arrays["0.long-run.upper"].__setitem__(slice(1, 3), 5.0), "the upper end",
    ),
    "less noise": (own(landing="0.1"), "end is"),
    "noise beyond half a period": (own(landing="0.7"), "the noise is longer than a period"),
    "starts beyond the seam": (
        lambda f: section_of(f)["starts"][0].update(box=[[(0.5).hex(), (1.5).hex()]]), "beyond the nodes",
    ),
    "a longer period": (lambda f: f.header["map"].update(periodic=[["1.5"]]), "end is"),
    "nodes a hair apart": (lambda f: last_node(f, np.nextafter(1.0, 0.0)), "do not ascend"),
}  # fmt: skip


@pytest.mark.parametrize("case", FORGED)
def test_what_is_forged_is_denied(case, saved, tmp_path):
    require_denied(saved, FORGED[case], tmp_path)
