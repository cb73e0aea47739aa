"""Fits of a thousand machines of known truth: coverage, sides recorded wrong, level and power of the misfit test."""

from __future__ import annotations

import os

import pytest
from scipy.stats import binom

from tests.bench.fitted_machines import EFFECTS, measured
from tests.bench.measure import limit
from tests.fitting.machines import RADIUS
from tests.fitting.test_corners import FIVE, covered
from tests.fitting.test_fit import PLACES

pytestmark = pytest.mark.bench

MACHINES, FILMS = 1000, 1000
# 99 % of the counts of 1000 intervals of 95 %; at a bound, and of what decisions alone tell, they hold more often.
LEAST, MOST = 932, 966


def test_a_thousand_machines(table):
    found = measured(MACHINES, FILMS, os.cpu_count() or 1)
    assert found["errors"] == []
    for share, least in (("clean", LEAST), ("flipped", 930)):
        counts = found[share]["intervals"]
        for name in (*PLACES, "region"):
            each = counts[name]
            table.append(limit(f"fit, {share} sides: {name} held, of {each['told']}", each["held"], "", None))
            assert each["told"] == MACHINES
            assert least <= each["held"]
            assert share == "flipped" or each["held"] <= MOST
        for name in (RADIUS, "speed", "landing"):
            each = counts[name]
            what = f"fit, {share} sides: {name} held, of {each['told']}, {each['open']} open"
            table.append(limit(what, each["held"], "", None))
            assert each["held"] >= binom.ppf(0.005, each["told"], 0.95)
    for kind in ("median off, standard errors", "median moved, standard errors"):
        for name, size in found["flipped"][kind].items():
            table.append(limit(f"fit, 5 % of sides wrong: {name}, {kind}", abs(size), "", 1.0))
            assert abs(size) < 1.0
    for share, rejected in found["level"].items():
        table.append(limit(f"misfit test at 5 %: rejected with {share} of sides wrong", rejected, "", None))
        assert rejected <= binom.ppf(0.999, MACHINES, 0.05)
    for effect in EFFECTS:
        table.append(limit(f"misfit test: {effect} told apart, of {FILMS}", found["power"][effect], "", None))
        assert found["power"][effect] >= 0.9 * FILMS
    table.append(limit("fit of fifty throws", found["seconds"]["fit, median"], "s", None))


def test_two_hundred_films_of_corners(table):
    held = covered(200, 3)
    for name in FIVE:
        table.append(limit(f"fit, corners: {name} held, of 200", held[name], "", None))
        assert held[name] >= 184
