"""Probabilities against throws and theory; trials as the experimenters made them; JSON and the figure."""

import json

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from scipy.stats import beta, binomtest

import limitsets as ls
from limitsets.cli.feed import _text
from limitsets.feeding.falling import FATES, arm_end_of
from limitsets.feeding.fed_shares import FedShares, FeedingProblem, success_curve
from limitsets.feeding.trials import run_trials
from limitsets.files import as_json
from limitsets.robust import Gaussian, Scattering, Uniform
from limitsets.robust.noise.proportions import binomial_interval
from tests.feeding.scenes import with_cavity

NOISE = Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02))


def test_the_interval_of_19_of_20():
    """Clopper and Pearson by the quantiles of the beta distribution: 75.1 to 99.9 %."""
    low, high = binomial_interval(19, 20)
    assert low == pytest.approx(beta.ppf(0.025, 19, 2), rel=1e-9)
    assert high == pytest.approx(beta.ppf(0.975, 20, 1), rel=1e-9)
    assert (round(low, 2), round(high, 3)) == (0.75, 0.999)
    assert binomial_interval(20, 20)[0] == pytest.approx(0.025 ** (1 / 20), rel=1e-9)


def assert_alike(found, trials):
    """Counts within what binomials and the operator's error allow."""
    count = trials.fate.size
    for name, share in found["shares"].items():
        low, high = binomtest(trials.counts[name], count).proportion_ci(0.9999, method="exact")
        error = found["errors"][name]
        assert low - error <= share <= high + error, name


@pytest.fixture(scope="module")
def initial():
    """Three ends: about 0.3 right, 0.7 wrong, and at 2 Hz some meet the wall."""
    end = arm_end_of(with_cavity("paper-initial", rate="2 Hz"))
    problem = FeedingProblem.of(end, 512, 16)
    found = problem.solve(NOISE)
    return end, found, problem.errors(NOISE, found), run_trials(end, NOISE, 20_000, seed=3)


def test_two_ways_agree(initial):
    _, found, errors, trials = initial
    assert sum(found.shares.values()) == pytest.approx(1.0, abs=1e-6)
    assert 0.2 < found.shares["right"] < 0.4
    assert found.shares["wall"] > 1e-3
    assert_alike({"shares": found.shares, "errors": errors}, trials)
    mean = trials.throws.mean()
    assert abs(found.mean_throws - mean) < 5.0 * trials.throws.std() / np.sqrt(trials.throws.size)


def test_of_parts_that_all_stay_no_mean_is_told():
    stay = FedShares(np.zeros((5, 4)), 1.0, 0.0)
    assert np.isnan(stay.mean_throws)
    assert stay.per_minute(60.0) is None


@pytest.mark.sweep  # all throws that may be made are made
def test_where_no_part_comes_beyond_the_end_nothing_is_fed(capsys):
    """The limit set of paper-designed ends at 23.38 in; the arm here at 26 in."""
    found = ls.feed(with_cavity(position="26 in"), prove=False, level=False, trials=20, cells=32)
    assert found.shares.shares["never"] == pytest.approx(1.0, abs=1e-9)
    assert np.isnan(found.shares.mean_throws)
    assert found.shares.quantile(0.95) is None
    _text(found, [], None)
    assert "no part comes beyond the end of the arm" in capsys.readouterr().out


def test_parts_per_minute_are_right_feeds_over_the_time_of_all(initial):
    _, found, _, trials = initial
    assert found.per_minute(2.0) == pytest.approx(
        120.0 * (trials.fate == 0).sum() / trials.throws.sum(), rel=0.05
    )
    assert found.per_minute(None) is None


def test_trials_do_not_depend_on_how_many_there_are(initial):
    """Numbers are counted: a series is the series of that seed, and a throw of the same part the same."""
    end, _, _, trials = initial
    again = run_trials(end, NOISE, 20_000, seed=3)
    assert (again.fate == trials.fate).all()
    assert (again.throws == trials.throws).all()
    series = trials.series()
    assert series.size == 1000
    assert series.sum() == (trials.fate == 0).sum()
    assert series[0] == (trials.fate[:20] == 0).sum()


def test_without_noise_all_are_fed_on_side_2():
    end = arm_end_of(with_cavity())
    found = FeedingProblem.of(end, 256, 8).solve(Scattering())
    assert found.shares["right"] == pytest.approx(1.0, abs=1e-6)
    trials = run_trials(end, Scattering(), 2000)
    assert trials.counts["right"] == 2000
    assert trials.throws.max() <= 786
    # r_2 = 20: a flip from side 2 would start beyond the end; flips to side 2 strike far before it
    assert not trials.beyond.any()


@pytest.mark.sweep
def test_close_to_the_end_at_a_high_rate_parts_meet_the_wall():
    """The share within the distance that does not clear, by the density of first rests beyond the end."""
    slow, fast = (arm_end_of(with_cavity(rate=rate)) for rate in ("2 Hz", "4 Hz"))
    first, second = (FeedingProblem.of(end, 512, 8).solve(NOISE).shares["wall"] for end in (slow, fast))
    assert 0.0 < first < second
    ((least, _),), ((more, _),) = slow.clear, fast.clear
    # the density of first rests hardly changes so near to the end
    assert second / first == pytest.approx(more / least, rel=0.25)


def test_the_level_at_which_success_falls():
    """A wall that half the parts meet at so high a rate: below 95 % without any noise; and none where all is right."""
    problem = FeedingProblem.of(arm_end_of(with_cavity(rate="8 Hz")), 128, 8)
    assert success_curve(problem, NOISE, factors=(0.0, 1.0)).level == (0.0, 0.0)
    problem = FeedingProblem.of(arm_end_of(with_cavity()), 128, 8)
    curve = success_curve(problem, Scattering(speed=Uniform(0.01)), factors=(0.0, 1.0))
    assert curve.level is None
    assert "stays above 95 %" in curve.line()


def test_a_level_is_bracketed():
    problem = FeedingProblem.of(arm_end_of(with_cavity()), 128, 8)
    noise = Scattering(landing=Uniform(0.5))
    curve = success_curve(problem, noise, factors=(0.0, 1.0, 2.0, 4.0, 8.0))
    lo, hi = curve.level
    right = [problem.solve(noise.scaled(factor)).shares["right"] for factor in (lo, hi)]
    assert right[0] > 0.95 >= right[1]
    assert hi - lo <= 4.0 / 2**8


KEYS = {
    "scene", "unit", "position", "side", "starts_from", "throw_rate", "clear", "tipping", "safety", "vacuous", "model",
    "progress", "noise", "scatter", "brackets", "crowds",
    "probabilities", "throws", "right_per_minute", "noise_cut_off", "success", "trials",
}  # fmt: skip


@pytest.mark.sweep
def test_json_and_figure():
    found = ls.feed(with_cavity(rate="2 Hz"), NOISE, trials=400, cells=128, strata=8, level=False)
    table = json.loads(as_json(found))
    assert set(table) == KEYS
    assert set(table["probabilities"]) == set(table["trials"]["counts"]) == set(FATES)
    assert table["safety"]["verdict"] == table["progress"]["verdict"] == "proved"
    assert set(table["safety"]) == {
        "verdict", "possible", "only_wanted", "share", "leaving", "counterexample"
    }  # fmt: skip
    assert set(table["progress"]) == {
        "verdict", "throws", "beyond", "share", "almost_every", "almost_from", "almost_share", "never_fed",
        "reason",
    }  # fmt: skip
    assert set(table["trials"]) == {
        "trials", "seed", "counts", "intervals", "mean_throws", "series", "paper",
        "corner_beyond_end", "throw_tips_over_end",
    }  # fmt: skip
    assert table["trials"]["paper"]["right"] == 19
    assert sum(table["trials"]["series"]["right"]) == 20
    figure = ls.plot.feeding(found)
    FigureCanvasAgg(figure).draw()
    cavity, tipping, fates, empty = figure.axes
    assert tipping.get_xscale() == "log"
    assert any("2 Hz" in text.get_text() for text in tipping.texts)
    assert not empty.axison
    right, wall = (found.shares.shares[name] for name in ("right", "wall"))
    words = [text.get_text() for text in fates.get_legend().get_texts()]
    assert words == [f"side wanted, clear: {100 * right:.3g} %", f"meets the wall: {100 * wall:.3g} %"]
    # flush on the ramp a side of the part falls under its angle
    edges = np.diff(cavity.patches[-1].get_xy(), axis=0)
    assert np.isclose(np.arctan2(-edges[:, 1], edges[:, 0]), found.end.scene.cavity.angle).any()


def test_the_page_has_every_key():
    from pathlib import Path

    page = (Path(__file__).parents[2] / "docs" / "json.md").read_text(encoding="utf-8")
    section = page.split("## feed\n", 1)[1].split("\n## ", 1)[0]
    assert all(f"`{key}`" in section for key in {*KEYS, "certificate"})  # of the command
