"""Proved brackets of absorption: closed forms, throws, quadrature of the operator at any place, monotone facts."""

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from scipy import stats

pytest.importorskip("flint", reason="the checker needs python-flint")

from flint import arb

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.checker.laws import normal_law, uniform_law
from limitsets.checker.means import Extremes, Graph, Mesh, Ranges, Spread, mean_rows
from limitsets.feeder.scattering import Gaussian, Given, Scattering, Uniform, starts_from
from limitsets.parameters.noise.sampling import throw_many
from limitsets.proofs.chances.absorption import absorption_brackets
from limitsets.proofs.chances.chain import chain_of
from limitsets.systems.maps import advance
from tests.closed_forms import ladder
from tests.one_throw import mean_after

BOTH = Scattering(speed=Uniform(0.003), landing=Uniform(0.02))


def test_a_normal_law_has_its_probabilities_and_its_density():
    law, exact = normal_law(Fraction(1, 2), 96, 4), stats.truncnorm(-6.0, 6.0, scale=0.5)
    assert np.abs(law.weights - np.diff(exact.cdf(law.cuts))).max() < 1e-15
    assert 1.9e-9 < law.beyond < 2.0e-9  # 2 (1 - Phi(6)) = 1.973e-9
    assert law.most == pytest.approx(exact.pdf(0.0), rel=1e-12)
    # what a stratum's even density leaves out, at most and all together: |F - F_even|, the law's function and its own
    fine = np.linspace(law.cuts[:-1], law.cuts[1:], 41)
    off = np.abs(exact.cdf(fine) - np.linspace(exact.cdf(law.cuts[:-1]), exact.cdf(law.cuts[1:]), 41))
    assert off.max() <= law.ripple < 3.0 * off.max()
    assert np.trapezoid(off, fine, axis=0).sum() <= law.tilt < 3.0 * np.trapezoid(off, fine, axis=0).sum()
    ends = np.array([float(end) for end in law.ends])
    at_ends = exact.pdf(3.0 - 1e-12)
    assert [(j, float(change)) for j, change in law.jumps] == [
        (j, pytest.approx(sign * at_ends)) for j, sign in ((0, 1), (96, -1))
    ]
    for column in law.columns:
        inside = np.linspace(ends[column.first], ends[column.last], 101)
        density = 2.0 * stats.norm.pdf(2.0 * inside)
        slope = np.abs(4.0 * inside * density)
        assert float(column.change) == pytest.approx(density[-1] - density[0], abs=1e-7)
        assert density.max() <= column.most * (1.0 + 1e-8) <= density.max() * (1.0 + 1e-6)
        assert slope.max() <= column.steep * (1.0 + 1e-8) <= slope.max() * 1.01
        assert float(law.density(arb(inside[40]))) == pytest.approx(density[40], rel=1e-8)


def test_a_uniform_law_jumps_at_its_ends_and_has_narrow_columns():
    law = uniform_law(Fraction(3, 100), 16)
    assert law.weights.tolist() == [1.0 / 16.0] * 16
    assert [(j, float(change)) for j, change in law.jumps] == [
        (0, pytest.approx(100.0 / 6.0)),
        (16, pytest.approx(-100.0 / 6.0)),
    ]
    widths = [law.ends[each.last] - law.ends[each.first] for each in law.columns]
    assert sum(widths) == Fraction(6, 100)
    assert max(widths) <= Fraction(1, 100)
    assert uniform_law(Fraction(0), 16).certain


# ------------------------------------------------------------ one throw of any function, at any place


NOISES = [
    (BOTH, 100),
    (Scattering(landing=Uniform(0.05)), 1000),
    (Scattering(speed=Uniform(0.1)), 1000),
    (Scattering(speed=Uniform(0.1), landing=Uniform(0.05)), 100),
    (Scattering(), 1),
    (Scattering(speed=Gaussian(0.005)), 1000),
    (Scattering(landing=Gaussian(0.02)), 1000),
    (Scattering(speed=Gaussian(0.005), landing=Uniform(0.02)), 100),
]


CASES = [("paper-designed", *each) for each in NOISES]
CASES += [("paper-initial", *NOISES[k]) for k in (0, 2)]


@pytest.mark.sweep
@pytest.mark.parametrize(("name", "scatter", "count"), CASES)
def test_one_throw_is_bounded_at_every_place(name, scatter, count):
    scene = ls.load(name)
    chain = chain_of(scene, scatter, [(2, 8.0, 20.0)], {"right": [(2, 25.0, math.inf)]}, 250).steps
    mesh, random = chain.mesh, np.random.default_rng(3)
    x, side = random.uniform(6.0, 22.0, 400), random.integers(0, 3, 400)
    rows = [slice(first, last) for first, last in pairwise(mesh.first.tolist())]
    place, phase = np.clip(mesh.place, -60.0, 60.0), np.repeat(np.arange(3), np.diff(mesh.first))
    for values in (
        np.sin(3.0 * place + phase) + (place > 17.3),
        np.sin(place + 2.0 * phase),
        (place > 17.3) + 0.5 * (phase == 1),
        np.clip(place - 15.0, -20.0, 20.0) ** 2 / 100.0 - phase,
    ):
        found = mean_after(scene, scatter, [(mesh.place[row], values[row]) for row in rows], x, side, count)
        none = np.full(place.size, -np.inf)
        above, below = chain.above(values, none), -chain.above(-values, none)
        on = [side == k for k in range(3)]
        high, low = (
            np.select(on, [np.interp(x, mesh.place[row], b[row]) for row in rows]) for b in (above, below)
        )
        # Midpoints of a function that jumps where the branch changes and at 17.3: each by half a weight.
        slack = np.ptp(values) / count
        assert (found <= high + slack).all()
        assert (found >= low - slack).all()
        assert np.median(high - low) < (0.05 if scatter in (BOTH, NOISES[1][0]) else 0.3) * np.ptp(values)


# ------------------------------------------------------------ closed forms


def _stretched(scene):
    """a_2, and the factor by which a jog of the small-angle model stretches R - a."""
    return float(scene.sides.a[2]), 1.0 + 2.0 * abs(scene.map.surface_height) / scene.map.kappa


def fed_beyond(scene, scatter, x, starts, cells, throws):
    """Brackets of parts that start even on a stretch of side 2 and come beyond x on that side."""
    words = {"starts": [(2, *starts)], "cells": cells, "throws": throws, "mean": False}
    return absorption_brackets(scene, scatter, right=(x, 2), **words)


def test_a_linear_map_with_uniform_noise_has_its_closed_form():
    scene = ls.load("paper-designed-small-angle")
    a, q = _stretched(scene)
    b, x_right, lo, hi = 0.05, 18.0, 15.0, 16.0
    # Each jog leads farther than the noise back: absorbed within n throws is x_n >= X, a sum of uniform numbers.
    assert (q - 1.0) * (lo - a) > 2.0 * b
    for cells in (60, 1500):
        found = fed_beyond(scene, Scattering(landing=Uniform(b)), x_right, (lo, hi), cells, 7)
        low, high = found.within["right"]
        exact = ladder((a, q), (lo, hi), b, x_right, 7)
        assert (low - 1e-12 <= exact).all()
        assert (exact <= high + 1e-12).all()
        if cells == 1500:
            assert (high - low).max() < 0.01


def _arrived(x, least, scatter):
    """P that a jog of the small-angle model whose speed deviates evenly leads from x to `least` or beyond."""
    scene = ls.load("paper-designed-small-angle")
    a, q = _stretched(scene)
    # x' - a = (x - a) (1 + (q - 1) (1 + delta)^2)
    need = np.sqrt(np.maximum((least - x) / ((x - a) * (q - 1.0)), 0.0)) - 1.0
    return np.clip((scatter - need) / (2.0 * scatter), 0.0, 1.0)


def test_speed_alone_has_its_closed_form():
    scene, p, lo, hi, x_right = ls.load("paper-designed-small-angle"), 0.05, 17.2, 17.7, 18.0
    found = fed_beyond(scene, Scattering(speed=Uniform(p)), x_right, (lo, hi), 4000, 1)
    low, high = found.within["right"][:, 1]
    starts = lo + (hi - lo) * (np.arange(100_000) + 0.5) / 100_000
    exact = float(_arrived(starts, x_right, p).mean())
    assert low <= exact <= high
    assert high - low < 0.01


def test_extremes_over_ranges_are_those_of_the_values():
    rng = np.random.default_rng(1)
    for n in (3, 4, 37, 64):
        values, ends = Extremes(rng.normal(size=n)), np.sort(rng.integers(1, n - 1, (50, 2)), axis=1)
        given, span = values.least[0], Ranges(*ends.T)
        for runs, more in ((span.cells, 1), (span.nodes, 2), (span.inner, 0)):
            slices = [given[a : max(b, a + 1 - more) + more] for a, b in ends.tolist()]
            least, most = values.on(runs)
            assert least.tolist() == [each.min() for each in slices]
            assert most.tolist() == [each.max() for each in slices]


def test_sums_over_spans_keep_small_numbers_beside_large_ones():
    """Differences of running sums stand for the variation on spans: exact in rationals, never below it."""
    random = np.random.default_rng(1)
    values = np.cumsum(random.uniform(-1.0, 1.0, 3000) * 10.0 ** random.integers(-9, 4, 3000))
    graph = Graph(Mesh(np.arange(3000.0), np.array([0, 3000])), values)
    first = random.integers(0, 2980, 400)
    last = first + random.integers(0, 9, 400)
    steps = [abs(Fraction(b) - Fraction(a)) for a, b in pairwise(values.tolist())]
    exact = [float(sum(steps[i : j + 1])) for i, j in zip(first, last, strict=True)]
    found = graph.variation_on(Ranges(first, last))
    assert (found >= exact).all()
    assert (found <= np.array(exact) + 2.0 * graph.rounding).all()


def test_the_rounding_of_a_mean_grows_with_its_entries():
    mesh = Mesh(np.linspace(0.0, 1.0, 40_001), np.array([0, 40_001]))
    one = np.array([0])
    rows = mean_rows(1, mesh, [Spread(one, np.ones(1), one, np.array([0.1]), np.array([0.9]))])
    # 32 001 products, one after the other: (k - 1) roundings of at most the whole sum
    assert rows.off >= 32_001 * 2.0**-53
    values = np.where(np.arange(40_001) % 2, 1.0, -1.0) * np.linspace(0.0, 1.0, 40_001)
    pairs = zip(rows.entry.tolist(), values[rows.column].tolist(), strict=True)
    exact = sum(Fraction(entry) * Fraction(value) for entry, value in pairs)
    assert abs(float(rows.times(values)[0]) - float(exact)) <= rows.off


@pytest.mark.sweep
def test_a_linear_map_with_normal_noise_has_its_closed_form():
    scene = ls.load("paper-designed-small-angle")
    a, q = _stretched(scene)
    sigma, x_right, lo, hi = 0.02, 18.0, 15.0, 16.0
    found = fed_beyond(scene, Scattering(landing=Gaussian(sigma)), x_right, (lo, hi), 600, 6)
    low, high = found.within["right"]
    starts = np.linspace(lo, hi, 20001)
    for n in range(1, 7):
        sd = sigma * math.sqrt(sum(q ** (2 * k) for k in range(n)))
        ends = stats.norm.sf((x_right - (a + q**n * (starts - a))) / sd)
        exact = float(np.trapezoid(ends, starts))
        assert low[n] - 1e-7 <= exact <= high[n] + 1e-7
    assert (high - low).max() < 0.2


def test_a_throw_without_noise_is_certain():
    scene = ls.load("paper-designed")
    found = fed_beyond(scene, Scattering(), 8.5, (8.0, 8.4), 3000, 3)
    # (8, side 2) -> 8.262013 -> 8.557124; what starts beyond x_1 with x_1 -> 8.5 arrives with the first throw.
    low, high = found.within["right"]
    assert low[2] > 1.0 - 1e-6
    assert 1.0 - 1e-9 <= high[2] <= 1.0
    after, *_ = advance(scene.map, np.linspace(8.0, 8.4, 40001), np.full(40001, 2), 1)
    exact = float((after >= 8.5).mean())
    assert low[1] - 1e-4 <= exact <= high[1] + 1e-4


# ------------------------------------------------------------ throws


@pytest.mark.sweep
@pytest.mark.parametrize("scatter", [BOTH, Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02))])
def test_brackets_meet_the_shares_of_many_throws(scatter):
    scene, parts, throws, cells = ls.load("paper-designed"), 20_000, 8, 300
    goal = (20.5, 2)
    found = absorption_brackets(scene, scatter, right=goal, cells=cells, throws=throws, mean=False)
    thrown_ = throw_many(scene, scatter, goal, starts_from(scene), throws=parts, parts=parts, seed=11)
    low, high = found.within["right"]
    for n in range(1, throws + 1):
        count = int((thrown_.arrived <= n).sum())
        lower = stats.beta.ppf(0.5e-4, count, parts - count + 1) if count else 0.0
        upper = stats.beta.ppf(1.0 - 0.5e-4, count + 1, parts - count)
        assert lower <= high[n]
        assert upper >= low[n]
    assert found.how == "proved"
    assert (high - low)[3] < 0.2
    for name_ in found.within:
        below, above = found.values[name_]
        assert (below <= above + 1e-12).all()
        assert (np.diff(found.within[name_], axis=1) >= 0.0).all()


def test_right_and_wrong_add_up_and_narrow_with_the_cells():
    scatter, words = Scattering(landing=Uniform(0.1)), {"right": (20.0, 2), "wrong": 20.0, "throws": 6}
    wide, narrow = (
        absorption_brackets("paper-initial", scatter, **words, cells=cells, mean=False)
        for cells in (200, 600)
    )
    for name in ("right", "wrong", "any"):
        (lo, hi), (low, high) = wide.within[name], narrow.within[name]
        assert (np.maximum(lo, low) <= np.minimum(hi, high)).all()
        assert (high - low).max() < 0.5 * (hi - lo).max() + 1e-9
    parts = [narrow.within[name] for name in ("right", "wrong", "exits")]
    assert (sum(low for low, _ in parts) <= narrow.within["any"][1] + 1e-12).all()
    assert (sum(high for _, high in parts) >= narrow.within["any"][0] - 1e-12).all()
    json = narrow.to_json()
    assert json["how"] == "proved"
    assert set(json["within"]) == {"any", "right", "wrong", "exits"}


@pytest.mark.sweep  # a bound of the mean, and many throws
def test_the_mean_and_the_quantiles_hold_for_a_ladder_of_throws():
    scene = ls.load("paper-designed-small-angle")
    a, q = _stretched(scene)
    lo, hi, x_right, b = 15.0, 15.2, 18.0, 0.02
    found = absorption_brackets(
        scene, Scattering(landing=Uniform(b)), right=(x_right, 2), starts=[(2, lo, hi)], cells=1500, throws=12
    )
    exact = ladder((a, q), (lo, hi), b, x_right, 8)
    mean = (1.0 - exact).sum()  # the sum of P(T > n)
    assert found.mean[0] <= mean + 1e-9
    assert found.mean[1] >= mean - 1e-9
    assert found.mean[1] - found.mean[0] < 0.2
    # The median: the first n with P(T <= n) of at least a half, in closed form.
    median = int(np.argmax(exact >= 0.5))
    first, last = found.quantile(0.5, "right")
    assert first <= median <= last <= first + 1


# ------------------------------------------------------------ errors


@pytest.mark.parametrize(
    ("scatter", "more", "said"),
    [
        (Scattering(speed=Given(stats.t(5, scale=0.004))), {}, "the law of the speed"),
        (Scattering(tilt=Uniform(0.01)), {}, "speed and landing place"),
        (BOTH, {"right": None, "wrong": 20.0}, "right"),
        (BOTH, {"right": (40.0, 2)}, "on the arm"),
        (BOTH, {"starts": [(2, 9.0, 8.0)]}, "a start"),
        (BOTH, {"absorbing": {"exits": [(2, 9.0, 10.0)]}}, "not taken"),
        (Scattering(speed=Uniform(1.5)), {}, "above -1"),
    ],
)
def test_what_cannot_be_is_refused(scatter, more, said):
    with pytest.raises(AnswerError, match=said):
        absorption_brackets(
            "paper-designed", scatter, **{"right": (20.5, 2), "cells": 50, "throws": 2, **more}
        )
