"""Probabilities against throws and theory; trials as the experimenters made them; JSON and the figure."""

import json

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from scipy.stats import beta

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.base.files import as_json
from limitsets.cell.feeding import Feeding
from limitsets.cell.feeding.falling import FATES, arm_end_of
from limitsets.cell.feeding.trials import FedShares, Trials, run_trials, success_curve
from limitsets.face.cli.cell import _words_of_feeding
from limitsets.feeder.scattering import Gaussian, Scattering, Uniform
from limitsets.parameters.noise.sampling import ManyParts, binomial_interval
from tests.feeding.own_throws import shares
from tests.feeding.scenes import with_cavity

NOISE = Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02))


def test_the_interval_of_19_of_20():
    """Clopper and Pearson by the quantiles of the beta distribution: 75.1 to 99.9 %."""
    low, high = binomial_interval(19, 20)
    assert low == pytest.approx(beta.ppf(0.025, 19, 2), rel=1e-9)
    assert high == pytest.approx(beta.ppf(0.975, 20, 1), rel=1e-9)
    assert (round(low, 2), round(high, 3)) == (0.75, 0.999)
    assert binomial_interval(20, 20)[0] == pytest.approx(0.025 ** (1 / 20), rel=1e-9)


@pytest.fixture(scope="module")
def initial():
    """Four ends: about 0.3 right, 0.6 wrong, 0.1 thrown at the end, and from rest, at 2 Hz, some meet the wall."""
    end = arm_end_of(with_cavity("paper-initial", rate="2 Hz", tips="rest"))
    return end, run_trials(end, NOISE, 20_000, seed=3)


def assert_within(found, truth, count):
    """Shares are within their stated errors of those of so many other parts, whose own errors count too."""
    for name, share in truth.items():
        low, high = binomial_interval(round(share * count), count)
        allowed = np.hypot(found.errors[name], max(share - low, high - share))
        assert abs(found.shares[name] - share) <= 1.3 * allowed, (name, found.shares[name], share)


def test_two_ways_agree(initial):
    """The package's throws, and the equations of docs/model.md in numpy, under noise."""
    end, trials = initial
    found = FedShares(trials)
    assert sum(found.shares.values()) == pytest.approx(1.0)
    assert found.by_throw.sum() == pytest.approx(1.0)
    assert 0.2 < found.shares["right"] < 0.4
    assert found.shares["wall"] > 1e-3
    own = shares(end, 20_000, 8, lambda r, n: r.normal(0, 0.005, n), lambda r, n: r.normal(0, 0.02, n))
    assert_within(found, own, 20_000)


# 1.2 million parts of `own_throws` without noise, of an arm whose parts tip from rest, and their 95 % intervals.
TRUE_WALL = {"2 Hz": (0.004421, 1.2e-4), "3 Hz": (0.019176, 2.5e-4)}


@pytest.mark.parametrize("rate", TRUE_WALL)
def test_the_stated_error_of_the_wall_holds_without_noise(rate):
    """Transfer between cells said 0.004732 +- 0.000013 and 0.020389: cells spread the parts next to the end."""
    found = ls.feed(with_cavity(rate=rate, tips="rest"), prove=False)
    value, error = TRUE_WALL[rate]
    assert abs(found.shares.shares["wall"] - value) <= found.errors["wall"] + error
    assert found.errors["wall"] < 0.15 * value


def random_feeder(random):
    """Give a feeder of 3 to 6 corners, and its noise: of the speed, of the landing, both or none."""
    while True:
        count = int(random.integers(3, 7))
        at = np.sort(random.uniform(0.0, 2.0 * np.pi, count))
        corners = np.c_[np.cos(at) * random.uniform(1.0, 1.8), np.sin(at)] * random.uniform(1.8, 3.2)
        length = random.uniform(24.0, 36.0)
        x = random.uniform(0.55, 0.85) * length
        tree = {
            "name": "random",
            "part": {
                "vertices": [[f"{u} in", f"{v} in"] for u, v in corners.tolist()],
                "mass": {"plate_density": "1 kg/m^2"},
            },
            "arm": {"length": f"{length} in", "surface_height": f"{-random.uniform(0.1, 0.8)} in"},
            "throw": {"kappa": f"{random.uniform(8.0, 40.0)} in"},
            "cavity": {"position": f"{x} in", "width": "12 in", "depth": "4.6 in", "angle": "32.23 deg"},
            "goal": {"oriented_beyond": {"x": f"{x} in", "side": int(random.integers(count))}},
        }
        law = (Gaussian, Uniform)[int(random.integers(2))]
        noise = Scattering(
            speed=law(random.uniform(0.002, 0.02)) if random.random() < 0.5 else None,
            landing=law(random.uniform(0.01, 0.15)) if random.random() < 0.5 else None,
        )
        try:
            end = arm_end_of(ls.load(tree))
        except LimitsetsError:
            continue
        if FedShares(run_trials(end, noise, 200)).never == 0.0:
            return end, noise


def drawn(law):
    """Draw from a law, by its definition."""
    if law is None:
        return None
    if isinstance(law, Gaussian):
        return lambda random, n: random.normal(0.0, law.sigma, n)
    return lambda random, n: random.uniform(-law.bound, law.bound, n)


@pytest.mark.sweep
@pytest.mark.parametrize(
    "seed", [0, 1, 2, *(pytest.param(k, marks=pytest.mark.repeats) for k in range(3, 8))]
)
def test_random_feeders_are_within_the_stated_error(seed):
    """The first three: uniform noise of the landing, uniform and normal noise of the speed."""
    end, noise = random_feeder(np.random.default_rng([27, seed]))
    found = FedShares(run_trials(end, noise, 40_000, seed=seed))
    speed = drawn(noise.speed) or (lambda _, n: np.zeros(n))
    assert_within(found, shares(end, 40_000, seed, speed, drawn(noise.landing)), 40_000)


@pytest.mark.parametrize("height", ["0.25 in", "0.5 in"])
def test_parts_that_creep_to_the_joint_never_leave_the_arm(height):
    """Above the joint a start near a keeps 1 - 2 h/kappa of its distance from a; cells counted it as one that left."""
    arm = ls.load("paper-designed").as_dict()["arm"] | {"surface_height": height}
    end = arm_end_of(with_cavity(tables={"arm": arm}))
    for noise in (Scattering(), Scattering(speed=Gaussian(0.005))):
        counts = run_trials(end, noise, 300).counts
        assert counts["never"] > 0
        assert counts["left"] == 0
    # scattered landings do take them off the arm
    assert run_trials(end, Scattering(landing=Gaussian(0.02)), 300).counts["left"] > 0


def test_feed_says_of_parts_that_creep_that_they_stay():
    """And its answer is not a number for each of the 20 000 throws that they are thrown."""
    arm = {**ls.load("paper-designed").as_dict()["arm"], "surface_height": "0.5 in"}
    told = ls.feed(with_cavity(tables={"arm": arm}), prove=False, level=False, trials=300).to_json()
    assert told["probabilities"]["left"]["value"] == 0.0
    assert told["probabilities"]["never"]["value"] > 0.0
    assert len(as_json(told["throws"])) < 5000


def test_of_parts_that_all_stay_no_mean_is_told():
    none = np.zeros(5, dtype=bool)
    stay = FedShares(Trials(np.full(5, 5), np.full(5, 20_000), none, 0))
    assert np.isnan(stay.mean_throws)
    assert stay.per_minute(60.0) is None


@pytest.mark.sweep  # all throws that may be made are made
def test_where_no_part_comes_beyond_the_end_nothing_is_fed():
    """The limit set of paper-designed ends at 23.38 in; the arm here at 26 in."""
    found = ls.feed(with_cavity(position="26 in"), prove=False, level=False, trials=20)
    assert found.shares.shares["never"] == 1.0
    assert np.isnan(found.shares.mean_throws)
    assert found.shares.quantile(0.95) is None
    lines = [part for part in _words_of_feeding(found) if isinstance(part, str)]
    assert any("no part comes beyond the end of the arm" in line for line in lines)


def test_half_of_three_parts_are_two():
    ended = FedShares(Trials(np.zeros(3, dtype=int), np.array([4, 1, 2]), np.zeros(3, dtype=bool), 0))
    assert [ended.quantile(share) for share in (0.3, 0.5, 2.0 / 3.0, 0.7)] == [1, 2, 2, 4]


def test_parts_per_minute_are_right_feeds_over_the_time_of_all(initial):
    trials = initial[1]
    found = FedShares(trials)
    assert found.per_minute(2.0) == pytest.approx(120.0 * (trials.fate == 0).sum() / trials.throws.sum())
    assert found.per_minute(None) is None


def test_throws_until_the_end_are_told_in_a_few_numbers(initial):
    """By share of the starts the least number of throws after which so many have ended: not a number per throw."""
    end, trials = initial
    told = json.loads(as_json(Feeding(end, {}, None, {}, NOISE, None, trials)))["throws"]["ended"]
    assert len(told["share"]) == len(told["throws"]) <= 25
    for share, throws in zip(told["share"], told["throws"], strict=True):
        assert (trials.throws <= throws).mean() >= share > (trials.throws < throws).mean()


def test_trials_do_not_depend_on_how_many_there_are(initial):
    """Numbers are counted: a series is the series of that seed, and a throw of the same part the same."""
    end, trials = initial
    again = run_trials(end, NOISE, 20_000, seed=3)
    assert (again.fate == trials.fate).all()
    assert (again.throws == trials.throws).all()
    series = trials.series()
    assert series.size == 1000
    assert series.sum() == (trials.fate == 0).sum()
    assert series[0] == (trials.fate[:20] == 0).sum()


def test_many_parts_are_thrown_in_blocks_between_which_ctrl_c_comes(initial, monkeypatch):
    """All at once a throw of 1e8 parts takes ten seconds; each block draws starts and noise of its own."""
    end, trials = initial
    sizes, told = [], []
    throw = ManyParts.throw

    def counted(many):
        sizes.append(many.x.size)
        return throw(many)

    monkeypatch.setattr(ManyParts, "throw", counted)
    monkeypatch.setattr("limitsets.cell.feeding.trials.BLOCK", 3000)
    found = run_trials(end, NOISE, 20_000, seed=3, progress=lambda *words: told.append(words))
    assert max(sizes) == 3000
    assert sum(size == 3000 for size in sizes) >= 6
    assert [done for _, done, _ in told] == sorted(done for _, done, _ in told)
    assert {of for _, _, of in told} == {20_000}
    for name, (low, high) in found.intervals.items():
        least, most = trials.intervals[name]
        assert low <= most
        assert least <= high
    # parts of one start: what differs between the blocks is their noise
    same = arm_end_of(with_cavity("paper-initial"), side=2, laid={0: [(8.0, 8.0 + 1e-9)]})
    again = run_trials(same, NOISE, 6000, seed=3)
    assert not (again.throws[:3000] == again.throws[3000:]).all()


def test_without_noise_all_are_fed_on_side_2():
    trials = run_trials(arm_end_of(with_cavity()), Scattering(), 2000)
    assert trials.counts["right"] + trials.counts["edge"] == 2000
    assert trials.throws.max() <= 786
    # r_2 = 20: a flip from side 2 would start beyond the end; flips to side 2 strike far before it
    assert not trials.beyond.any()


@pytest.mark.sweep
def test_close_to_the_end_at_a_high_rate_parts_meet_the_wall():
    """The share within the distance that does not clear, by the density of first rests beyond the end."""
    slow, fast = (arm_end_of(with_cavity(rate=rate, tips="rest")) for rate in ("2 Hz", "4 Hz"))
    first, second = (FedShares(run_trials(end, NOISE, 50_000)).shares["wall"] for end in (slow, fast))
    assert 0.0 < first < second
    ((least, _),), ((more, _),) = slow.clear, fast.clear
    # the density of first rests hardly changes so near to the end
    assert second / first == pytest.approx(more / least, rel=0.25)


def test_the_level_at_which_success_falls():
    """A wall that half the parts meet at so high a rate: below 95 % without any noise; and none where all is right."""
    end = arm_end_of(with_cavity(rate="8 Hz", tips="rest"))
    assert success_curve(end, NOISE, factors=(0.0, 1.0)).level == (0.0, 0.0)
    curve = success_curve(arm_end_of(with_cavity()), Scattering(speed=Uniform(0.01)), factors=(0.0, 1.0))
    assert curve.level is None
    assert curve.right[0] == 1.0  # of the parts that are not thrown at the edge, each
    assert "stays above 95 % of the parts not thrown at the edge" in curve.line()


@pytest.mark.sweep
def test_a_level_is_bracketed():
    """Other parts, thrown at both ends, are fed rightly more often than wanted, and less often."""
    end, noise = arm_end_of(with_cavity()), Scattering(landing=Uniform(0.5))
    curve = success_curve(end, noise, factors=(0.0, 1.0, 2.0, 4.0), parts=25_000)
    lo, hi = curve.level
    for factor, sign in ((lo, 1.0), (hi, -1.0)):
        found = FedShares(run_trials(end, noise.scaled(factor), 25_000, seed=9))
        right = found.shares["right"] / (1.0 - found.shares["edge"])
        assert sign * (right - 0.95) > -2.0 * found.errors["right"]
    assert hi - lo <= 0.1 * hi


KEYS = {
    "scene", "unit", "position", "side", "starts_from", "laid", "throw_rate", "clear", "tipping", "safety", "vacuous",
    "model", "next_throw", "machines",
    "progress", "noise", "scatter", "brackets", "crowds",
    "probabilities", "throws", "right_per_minute", "success", "trials",
}  # fmt: skip


@pytest.mark.sweep
def test_json_and_figure():
    found = ls.feed(with_cavity(rate="2 Hz", tips="rest"), NOISE, trials=400, level=False)
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
        "trials", "seed", "counts", "intervals", "mean_throws", "series", "corner_beyond_end",
    }  # fmt: skip
    assert sum(table["trials"]["series"]["right"]) == 20
    figure = ls.plot.feeding(found)
    FigureCanvasAgg(figure).draw()
    cavity, tipping, fates, empty = figure.axes
    assert tipping.get_xscale() == "log"
    assert any("2 Hz" in text.get_text() for text in tipping.texts)
    assert "from rest" in tipping.get_title(loc="left")
    assert not empty.axison
    right, wall, edge = (100 * found.shares.shares[name] for name in ("right", "wall", "edge"))
    words = [text.get_text() for text in fates.get_legend().get_texts()]
    assert words == [
        f"side wanted, clear: {right:.3g} %",
        *([f"meets the wall: {wall:.3g} %"] if wall else []),
        f"thrown at the end (assumed not fed): {edge:.3g} %",
    ]
    # flush on the ramp a side of the part falls under its angle
    edges = np.diff(cavity.patches[-1].get_xy(), axis=0)
    assert np.isclose(np.arctan2(-edges[:, 1], edges[:, 0]), found.end.scene.cavity.angle).any()


def test_the_page_has_every_key():
    from pathlib import Path

    page = (Path(__file__).parents[2] / "docs" / "json.md").read_text(encoding="utf-8")
    section = page.split("## feed\n", 1)[1].split("\n## ", 1)[0]
    assert all(f"`{key}`" in section for key in {*KEYS, "certificate"})  # of the command
