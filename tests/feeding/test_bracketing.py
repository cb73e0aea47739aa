"""Proved brackets of the fates: the shares of trials lie in them; what is refused."""

import json
import re

import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.cell.feeding.falling import arm_end_of
from limitsets.feeder.scattering import Scattering, Uniform
from tests.cli.command import run
from tests.feeding.own_throws import shares
from tests.feeding.scenes import with_cavity

NOISE = Scattering(landing=Uniform(0.2))


@pytest.fixture(scope="module")
def found():
    scene = with_cavity("paper-initial", rate="4 Hz", tips="rest")
    return ls.feed(scene, NOISE, prove=False, level=False, trials=4000, brackets=500)


@pytest.mark.sweep
def test_the_trials_lie_in_the_brackets(found):
    assert set(found.brackets.within) == {"any", "right", "wrong", "wall", "edge", "exits"}
    parts = found.trials.fate.size
    for name in ("right", "wrong", "wall"):
        low, high = found.brackets.within[name][:, -1]
        assert high - low < 0.015
        share = found.trials.counts[name] / parts
        error = 4.0 * (share * (1.0 - share) / parts) ** 0.5
        assert low - error <= share <= high + error
    low, high = found.brackets.mean
    error = 4.0 * found.trials.throws.std() / parts**0.5
    assert low - error <= found.shares.mean_throws <= high + error
    first, by = found.brackets.quantile(0.95)
    error = 4.0 * (0.05 * 0.95 / parts) ** 0.5
    assert found.shares.ended[first - 1] < 0.95 + error
    assert found.shares.ended[by] >= 0.95 - error


@pytest.mark.sweep
def test_the_json_has_them(found):
    table = json.loads(json.dumps(found.to_json()))["brackets"]
    assert table["how"] == "proved"
    assert set(table["within"]["wall"]) == {"lo", "hi"}
    assert table["starts"][0][2] == 20.0


def test_without_noise_there_are_none():
    with pytest.raises(AnswerError, match="the noise of the brackets"):
        ls.feed(with_cavity("paper-initial"), prove=False, trials=10, brackets=50)


@pytest.mark.sweep  # brackets of 200 throws
def test_the_command_shows_them(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ls.dump(with_cavity("paper-initial"), "fed.toml")
    code, out, _ = run(
        capfd, "feed", "fed.toml", "--no-proof", "--scatter", "landing.x=0.2 in", "--law", "bounded",
        "--trials", "50", "--brackets", "200",
    )  # fmt: skip
    assert code == 0
    said = re.search(
        r"PROVED: on the wanted side, clear of the wall within 200 throws: ([\d.]+) to ([\d.]+)", out
    )
    assert said, out
    low, high = (float(number) for number in said.groups())
    end = arm_end_of(ls.load("fed.toml"))
    own = shares(end, 20_000, 3, landing=lambda random, n: random.uniform(-0.2, 0.2, n))["right"]
    error = 4.0 * (own * (1.0 - own) / 20_000) ** 0.5
    assert low - error <= own <= high + error
    assert "PROVED: the least number of throws within which 95 % have ended: " in out
