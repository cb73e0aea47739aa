"""The chain of a tray: its numbers, counted passes, the certificate of its scene."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.cell.trays import filmed
from limitsets.cell.trays.filling import Chain, chain_of, drawn_chains, filled
from limitsets.cell.trays.passing import Counts, Histories, _history, count, histories, passes_of, random_of
from limitsets.feeder.engine.depression import Rest
from limitsets.feeder.engine.member import MARKS
from limitsets.parameters.noise.sampling import binomial_interval
from tests.trays.scenes import with_tray

# ----------------------------------------------------------------
# The chain of a depression against closed forms, with probabilities that are known.


EMPTY, RIGHT = 0, 1


def two_states(capture, release):
    return Chain(np.array([1.0 - capture, capture]), np.array([[1.0, 0.0], [release, 1.0 - release]]), RIGHT)


def counts_of(captured, kicked, right=1, names=("empty", "side 0", "side 1")):
    return Counts(tuple(names), right, np.array(captured), np.array(kicked), 0, {})


@pytest.mark.parametrize(("capture", "release"), [(0.3, 0.1), (0.05, 0.4), (0.9, 0.9)])
def test_two_states_fill_geometrically(capture, release):
    chain = two_states(capture, release)
    # a part that popped out may be replaced in the same pass
    lost = release * (1.0 - capture)
    last, ratio = capture / (capture + lost), 1.0 - capture - lost
    n = np.arange(31)
    assert chain.occupied(30)[:, RIGHT] == pytest.approx(last * (1.0 - ratio**n), abs=1e-12)
    assert chain.at_last() == pytest.approx([1.0 - last, last], abs=1e-12)
    assert [float(each) for each in chain.capture_and_release] == pytest.approx([capture, lost], abs=1e-12)


def test_a_wrong_part_that_no_kick_moves_takes_all_that_it_can():
    # capture rightly 0.2, wrongly 0.1; what is right never leaves: the shares of who came first
    kicked = np.eye(3)
    chain = Chain(np.array([0.7, 0.2, 0.1]), kicked, RIGHT)
    assert chain.at_last() == pytest.approx([0.0, 2 / 3, 1 / 3], abs=1e-9)
    # and where right ones leave, wrong ones have all in the end
    kicked = np.array([[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, 0.0, 1.0]])
    chain = Chain(np.array([0.7, 0.2, 0.1]), kicked, RIGHT)
    assert chain.at_last() == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)


def test_the_watched_chain_has_the_shares_of_the_whole_one():
    random = np.random.default_rng(8)
    for _ in range(20):
        kicked = random.dirichlet(np.ones(5), 5)
        kicked[EMPTY] = [1, 0, 0, 0, 0]
        chain = Chain(random.dirichlet(np.ones(5)), kicked, 3)
        # the left eigenvector of the whole chain, by numpy
        values, vectors = np.linalg.eig(chain.passed.T)
        still = np.real(vectors[:, np.argmin(abs(values - 1.0))])
        still /= still.sum()
        assert chain.at_last() == pytest.approx(still, abs=1e-9)
        capture, release = chain.capture_and_release
        assert release / (capture + release) == pytest.approx(still[0] / (still[0] + still[3]), abs=1e-9)


def test_a_pass_by_hand():
    # right: 0.1 to wrong, 0.2 out; wrong: 0.4 out, 0.1 to right; a part that comes: 0.5 nothing, 0.3 right, 0.2 wrong
    counts = counts_of([50, 30, 20], [[0, 0, 0], [20, 70, 10], [40, 10, 50]])
    step = chain_of(counts).passed
    expected = [[0.5, 0.3, 0.2], [0.1, 0.7 + 0.06, 0.1 + 0.04], [0.2, 0.1 + 0.12, 0.5 + 0.08]]
    assert step == pytest.approx(np.array(expected), abs=1e-12)


def test_intervals_cover_as_often_as_they_say():
    random = np.random.default_rng(2)
    captured, right, wrong = [0.6, 0.25, 0.15], [0.1, 0.85, 0.05], [0.3, 0.1, 0.6]
    chain = Chain(np.array(captured), np.array([[1.0, 0.0, 0.0], right, wrong]), RIGHT)
    truth = chain.occupied(12)[-1, RIGHT]
    inside, repeats = 0, 150
    for _ in range(repeats):
        rows = [np.zeros(3, int), random.multinomial(100, right), random.multinomial(100, wrong)]
        counts = counts_of(random.multinomial(200, captured), rows)
        drawn = drawn_chains(counts, random, draws=200).occupied(12)[:, -1, RIGHT]
        low, high = np.quantile(drawn, [0.025, 0.975])
        inside += low <= truth <= high
    assert 0.90 <= inside / repeats <= 0.985


def test_each_drawn_row_has_its_counts_and_one_more_spread_evenly():
    """The mean of Dirichlet's law: (n_k + 1/3)/(n + 1) for three states."""
    counts = counts_of([4, 0, 2], [[0, 0, 0], [0, 3, 0], [1, 0, 1]])
    drawn = drawn_chains(counts, np.random.default_rng(1), draws=20_000)
    third = 1 / 3
    assert drawn.captured.mean(axis=0) == pytest.approx(np.array([4 + third, third, 2 + third]) / 7, abs=0.01)
    assert drawn.kicked[:, 1].mean(axis=0) == pytest.approx(np.array([third, 3 + third, third]) / 4, abs=0.01)
    assert (drawn.kicked[:, 0] == [1.0, 0.0, 0.0]).all()


def test_what_is_said_of_many_passes():
    counts = counts_of([60, 40, 0], [[0, 0, 0], [10, 90, 0], [0, 0, 0]])
    found = filled(counts, 200, np.random.default_rng(0))
    last = 0.4 / (0.4 + 0.1 * 0.6)
    assert found.states == ("empty", "side 0")
    assert found.right[0] == 0.0
    assert found.right[-1] == pytest.approx(last, abs=1e-12)
    assert found.unfilled == pytest.approx({"empty": 1.0 - last, "wrong": 0.0}, abs=1e-12)
    assert found.rest == pytest.approx(1.0 - last, abs=1e-12)
    assert found.rest_interval[0] < found.rest < found.rest_interval[1]
    assert np.all(found.interval[1:, 0] < found.right[1:])
    assert np.all(found.interval[1:, 1] > found.right[1:])
    # the first n after which no more than 5 % are missing
    assert found.passes_to(0.95) == int(np.ceil(np.log(0.05) / np.log(1.0 - 0.4 - 0.06)))
    assert found.stays[1] == pytest.approx(1.0 / 0.06)


def test_of_a_state_that_never_comes_no_share_is_filled():
    found = filled(counts_of([60, 0, 40], [[0, 0, 0], [10, 90, 0], [10, 0, 90]]), 5, np.random.default_rng(0))
    assert found.last[found.number] == 0.0
    assert found.passes_to(0.95) is None


# ----------------------------------------------------------------
# A scene with a tray is proved and rechecked as the same scene without one: nothing of the tray is read there.


@pytest.mark.sweep  # compiles a cover and starts the checker
def test_a_scene_with_a_tray_has_certificates(tmp_path):
    proof = ls.certify(with_tray(), ["attracts-all"])
    assert [claim.verdict for claim in proof.claims] == ["proved"]
    found = ls.recheck(proof.save(tmp_path / "tray.proof.zip", recheck=False))
    assert found.verdict == "proved"


# ----------------------------------------------------------------
# Counts and histories: seeds by number, whatever computes them; what is refused; the chain beside histories.


pytest.importorskip("pymunk")


def test_trials_have_random_numbers_of_their_own_whoever_runs_them():
    passes = passes_of(with_tray(), None, 8e-3)
    alone = count(passes, 60, 30, 4)
    with ThreadPoolExecutor(3) as threads:
        spread = count(passes, 60, 30, 4, executor=threads)
    assert alone.to_json() == spread.to_json()
    assert alone.poses == spread.poses
    # the first 30 parts are the same parts; each is drawn from its number alone
    first = np.zeros(7, int)
    for k in reversed(range(30)):
        first[passes.plate.settle(*passes.arrival(random_of(4, 0, k))).state] += 1
    assert count(passes, 30, 1, 4).captured.tolist() == first.tolist()
    assert alone.captured.sum() == 60
    assert (alone.kicked.sum(axis=1)[alone.met] == 30).all()
    assert alone.unfinished == 0


def test_a_part_comes_by_as_the_laws_say():
    passes = passes_of(with_tray(wash="2 in"), None, 8e-3)
    drawn = [passes.arrival(random_of(9, 0, k)) for k in range(4000)]
    x = np.array([pose.x for pose, _ in drawn]) / 14.04
    angle = np.array([pose.angle for pose, _ in drawn]) / (2 * np.pi)
    along = np.array([motion.along for _, motion in drawn]) / np.sqrt(2 * 6.75 * 2.0)
    turning = np.array([motion.turning for _, motion in drawn]) * 6.75 / np.sqrt(2 * 6.75 * 0.5)
    for uniform in (x + 0.5, angle, along):
        assert uniform.min() >= 0.0
        assert uniform.max() <= 1.0
        assert uniform.mean() == pytest.approx(0.5, abs=4 / np.sqrt(12 * 4000))
    assert turning.std() == pytest.approx(1.0, abs=0.05)
    assert all(motion.up == 0.0 for _, motion in drawn)
    up = np.array([passes.kick(random_of(9, 1, k)).up for k in range(4000)]) / np.sqrt(2 * 6.75 * 0.5)
    assert up.min() >= 0.0
    assert (up**2).mean() == pytest.approx(1.0, abs=0.1)


@pytest.fixture(scope="module")
def shaken():
    """A tray that is shaken so hard that few passes are enough, with histories."""
    return ls.tray(with_tray(agitation="2 in"), passes=12, drops=600, kicks=250, histories=80, step=8e-3)


@pytest.mark.sweep
@pytest.mark.parametrize("after", [1, 3, 12])
def test_the_chain_agrees_with_histories_of_new_parts(shaken, after):
    new = shaken.histories[0]
    found = int((new.after_pass[:, after - 1] == new.right).sum())
    low, high = binomial_interval(found, 80, 0.999)
    lo, hi = shaken.filled.interval[after]
    assert low <= hi
    assert lo <= high


@pytest.mark.sweep
def test_of_new_parts_a_depression_forgets_misses(shaken):
    rows = shaken.histories[0].captures()
    of = shaken.counts.captured
    low, high = binomial_interval(int(of[shaken.counts.right]), int(of.sum()), 0.999)
    for right, came in rows:
        lo, hi = binomial_interval(right, came, 0.999)
        assert lo <= high
        assert low <= hi


def test_misses_and_kicks_that_were_stood_are_counted():
    # empty 0, right 1, wrong 2; by hand
    kicked = np.array([[0, 0, 0, 1, 1, 0, 2], [0, 2, 2, 0, 0, 0, -1]])
    passed = np.array([[0, 0, 1, 1, 1, 2, 2], [2, 2, 2, 0, 1, 1, -1]])
    found = Histories(kicked, passed, False, 1)
    # first row: misses, misses after one, captured after two; then popped out: a wrong part comes, after no miss
    # second row: a wrong part comes; popped out: a miss, one is captured after it; popped out: captured after no miss
    assert found.captures() == [(1, 5), (1, 2), (1, 1)]
    # first row: stands two kicks, released by the third; second: by the first, the last has no end
    assert found.releases() == [(1, 2), (0, 1), (1, 1)]
    assert found.filled.tolist() == [0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 0.5, 0.0]
    assert found.to_json()["unfinished"] == 1


class Played:
    """Passes and a plate that give what is written down, and keep what was asked for."""

    def __init__(self, *rests):
        self.plate, self.rests, self.asked = self, list(rests), []

    def settle(self, pose, motion):
        self.asked.append((motion, pose))
        state, side = self.rests.pop(0)
        return Rest(f"place {len(self.asked)}", state, side, 1.0)

    def kick(self, _):
        return "kick"

    def arrival(self, _):
        return "new", "new"

    def again(self, pose, _):
        return pose, "again"


def test_only_what_missed_and_lies_flat_comes_by_again():
    # misses flat; comes again, misses on no side; a new one is captured; popped out by a kick, a new one misses flat
    played = Played((0, 2), (0, -1), (3, -1), (0, 1), (0, 1), (0, 1))
    rows = _history(played, 5, 0, True, 0)
    assert rows == [(0, 0), (0, 0), (0, 3), (0, 0), (0, 0)]
    new, kick = ("new", "new"), ("kick", "place 3")
    assert played.asked == [new, ("again", "place 1"), new, kick, new, ("again", "place 5")]


def test_histories_begin_empty_and_repeat():
    passes = passes_of(with_tray(), None, 8e-3)
    some, more = histories(passes, 3, 8, 5), histories(passes, 5, 8, 5)
    assert (more.after_pass[:3] == some.after_pass).all()
    assert (some.after_kick[:, 0] == 0).all()
    assert not (histories(passes, 3, 8, 5, returning=True).after_pass == some.after_pass).all()


def test_what_lacks_is_named():
    for scene, key in (
        (lambda: ls.load("paper-designed"), "tray"),
        (lambda: with_tray(contact=False), "effects.contact"),
        (lambda: with_tray(world={"restitution": 0.3}), "world.friction"),
        (lambda: with_tray(world={"friction": 0.3}), "world.restitution"),
        (lambda: ls.load({k: v for k, v in with_tray().as_dict().items() if k != "goal"}), "goal"),
    ):
        with pytest.raises(AnswerError) as caught:
            ls.tray(scene(), drops=1)
        assert caught.value.key == key
        assert key in str(caught.value)


def test_without_contact_the_engine_is_not_even_loaded():
    code = """
import sys
import limitsets as ls
from limitsets.errors import AnswerError
from tests.trays.scenes import with_tray
try:
    ls.tray(with_tray(contact=False))
except AnswerError:
    print("pymunk" in sys.modules)
"""
    how = {"cwd": Path(__file__).parents[2], "capture_output": True, "text": True, "check": True}
    done = subprocess.run([sys.executable, "-c", code], **how)
    assert done.stdout.strip() == "False"


def test_what_cannot_be_is_refused(monkeypatch):
    with pytest.raises(AnswerError, match="drops"):
        ls.tray(with_tray(), drops=0)
    with pytest.raises(AnswerError, match="drops and kicks"):
        ls.tray(with_tray(), drops=10, kicks=0)
    with pytest.raises(AnswerError, match="the seed"):
        ls.tray(with_tray(), drops=1, seed=-1)
    hasty = passes_of(with_tray(), None, 8e-3)
    with pytest.raises(AnswerError, match="the parts at rest, of those that came by, is 0"):
        count(replace(hasty, plate=replace(hasty.plate, patience=0.1)), 5, 5, 0)
    with pytest.raises(AnswerError, match="passes"):
        ls.tray(with_tray(), passes=0)
    with pytest.raises(AnswerError, match="step"):
        ls.tray(with_tray(), step=0.5)
    narrow = with_tray("paper-designed", depression_width="6.8 in").as_dict()
    narrow["goal"] = {"oriented_beyond": {"x": "20 in", "side": 1}}
    narrow["tray"]["depression_width"] = "4 in"  # wide enough for side 1, 3.6 in long
    assert ls.load(narrow).tray.depression_width == 4.0
    with pytest.raises(AnswerError, match="the length of side 2"):
        ls.tray(narrow, side=2)
    # without a goal a depression may be as deep as the part is high on its highest side; the wanted one may be lower
    low = with_tray().as_dict()
    low["tray"]["depression_depth"] = "3.2 in"
    del low["goal"]
    with pytest.raises(AnswerError, match="deeper than the part") as caught:
        ls.tray(low, side=2, drops=1)
    assert caught.value.key == "tray.depression_depth"
    monkeypatch.setitem(sys.modules, "pymunk", None)
    with pytest.raises(AnswerError, match=r"limitsets\[engine\]"):
        ls.tray(with_tray(), drops=1)


def test_a_film_shows_what_the_engine_does():
    scene = with_tray()
    kept = filmed(scene, 6, seed=2, step=8e-3)
    assert np.all(np.diff(kept.times) > 0.0)
    shown = ~np.isnan(kept.poses[..., 0])
    assert (shown.sum(axis=1) == 1).all()  # one part at a time
    assert shown.any(axis=0).all()
    assert {word for _, _, word in kept.marks} <= set(MARKS)
    # a part falls freely at first: half of g t^2 in the scene's own seconds, to a step
    fallen = 0.5 * scene.gravity * kept.times[4:8] ** 2
    assert kept.poses[0, 0, 1] - kept.poses[4:8, 0, 1] == pytest.approx(fallen, rel=0.06)
    # each part is lost, or lies in the depression until it is ejected or the film ends
    ended = [part for _, part, word in kept.marks if word in ("lost", "in the cavity")]
    assert ended == list(range(kept.poses.shape[1]))


def test_in_a_film_a_part_comes_by_once_the_last_one_is_gone():
    kept = filmed(with_tray(agitation="2 in"), 8, seed=3, step=8e-3)
    gone = [part for _, part, word in kept.marks if word in ("lost", "ejected")]
    parts = kept.poses.shape[1]
    assert gone[: parts - 1] == list(range(parts - 1))
    assert "ejected" in {word for _, _, word in kept.marks}
