"""What a policy leads to under known laws: known answers, thrown parts, forged files."""

import itertools
from functools import cache

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

import flint
from limitsets.robust import Gaussian, Scattering, Uniform

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.checker.balls import PRECISION
from limitsets.checker.brackets import mesh_of
from limitsets.checker.policy_chances import PolicyChances, places_of, read_settings
from limitsets.feeder.scene.surroundings import BeyondSensor, SideSensor
from limitsets.parameters.noise.sampling import ManyParts, scattering_map
from limitsets.proofs.policies import policy_chances
from limitsets.systems.maps import images
from tests.checker.test_policy import FEW, policies, scene_with
from tests.proofs.forge import opened

BOTH = Scattering(speed=Uniform(0.01), landing=Uniform(0.05))


@cache
def chances_of(asked):
    return policy_chances(policies()[asked], BOTH, cells=500)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    chances = policy_chances(policies()["catch"], BOTH, cells=200)
    return chances, opened(chances.save(tmp_path_factory.mktemp("chances") / "catch.proof.zip"))


def recheck(forged, folder):
    return ls.recheck(forged.seal().write(folder / "forged.proof.zip"))


def section_of(file):
    return file.header["claims"][0]["section"]


def one_throw(goal, noise=None):
    """A policy of one throw with the part's own speed, from 16 to 16.001 in on side 2, that stops whatever it hears."""
    tree = ls.load("paper-designed").as_dict()
    tree["feedback"] = {"throws": [{"name": "own", **tree["throw"]}]}
    return ls.feedback(ls.load(tree), "none", goal=goal, starts={2: (16.0, 16.001)}, cells=64, noise=noise)


# ------------------------------------------------------------------------------ known answers


def test_one_throw_comes_with_the_probability_of_its_law():
    """It lands within 0.5 in of T(x), evenly: the share beyond the goal is (T(x) + 0.5 - goal) / 1 on average."""
    scene = ls.load("paper-designed")
    starts = np.linspace(16.0, 16.001, 101)
    lands = images(scene.map, starts, 2)
    assert (lands.side == 2).all()
    goal = float(lands.x.min()) - 0.1
    policy = one_throw((goal, 2), {"landing.x": "0.05 in"})
    assert policy.found.throws == 1
    chances = policy_chances(policy, Scattering(landing=Uniform(0.5)), cells=2000)
    exact = float(np.mean(lands.x + 0.5 - goal))
    lo, hi = chances.come
    assert lo <= exact <= hi < lo + 2e-4
    assert abs(chances.mean[0] - 1.0) < 1e-9 > abs(chances.mean[1] - 1.0)


def test_a_policy_that_is_proved_for_the_noise_brings_all_parts():
    # without scatter of the landing functions jump, and coarse cells bound little
    policy, little = policies()["error"], Scattering(speed=Uniform(0.001), landing=Uniform(1e-3))
    chances = policy_chances(policy, little, cells=1000)
    assert chances.come[0] > 0.97
    assert chances.mean[1] <= policy.found.throws


@pytest.mark.sweep
@pytest.mark.parametrize(
    ("asked", "answer"),
    [("place", "even"), ("catch", "even"), ("error", "even"), ("error", "yes"), ("error", "no")],
)
def test_thrown_parts_come_as_often_as_is_proved(asked, answer):
    """Parts of the package's own engine of many throws; a sensor near its place says yes, no or either."""
    policy, chances, count = policies()[asked], chances_of(asked), 20_000
    throws, come = thrown(policy, BOTH, count, {"even": None, "yes": 1.0, "no": -1.0}[answer])
    for (lo, hi), row in ((chances.mean, throws), (chances.come, come)):
        error = 5.0 * row.std() / count**0.5
        assert lo - error <= row.mean() <= hi + error
        assert hi - lo < (1.0 if asked == "error" else 0.35)


def thrown(policy, scatter, count, mood, seed=1):
    """Run a table; `mood`: what the sensor's error is in its bound, None for anything."""
    table, random = policy.found.policy, np.random.default_rng(seed)
    ((side, ((lo, hi),)),) = policy.starts.extents().items()
    x, sides = random.uniform(lo, hi, count), np.full(count, side)
    maps = []
    for each in policy.scene.feedback.throws:
        tree = policy.scene.with_values({each.quantity: each.text}).as_dict()
        bare = {key: value for key, value in tree.items() if key not in ("cavity", "goal")}
        maps.append(scattering_map(ls.load(bare), scatter, seed + 2))
    drawn, (goal, wanted) = 0, policy.goal

    def heard():
        if isinstance(policy.sensor, SideSensor):
            yes = sides == policy.sensor.side
        else:
            off = random.uniform(-1.0, 1.0, count) if mood is None else -mood
            yes = x > policy.sensor.x + policy.sensor.error * off
        words = list(table.answers)
        return np.where(yes, words.index("yes"), words.index("no"))

    state, moving = table.first[heard()], np.ones(count, dtype=bool)
    made, come = np.zeros(count), np.zeros(count)
    for _ in range(int(table.left.max()) + 1):
        moving &= state >= 0
        stops = moving & (table.throw[state] < 0)
        come[stops & (x >= goal) & (sides == wanted) & (policy.mode == "stop")] = 1.0
        moving &= ~stops
        for k, of in enumerate(maps):
            now = np.flatnonzero(moving & (table.throw[state] == k))
            many = ManyParts(of, x[now], sides[now], drawn)
            code = many.throw()
            drawn = many.drawn
            made[now] += 1.0
            x[now], sides[now] = many.x, np.maximum(many.side, 0)
            moving[now[code < 0]] = False
        if policy.mode == "catch":
            caught = moving & (x >= goal)
            come[caught & (sides == wanted)] = 1.0
            moving &= ~caught
        state = np.where(moving, table.after[state, heard()], state)
    assert not moving.any()
    return made, come


def test_a_sensor_far_off_the_arm_is_no_matter(tmp_path):
    far = ls.feedback(
        scene_with(), BeyondSensor(20.0, 150.0), starts={2: (20.5, 21.0)}, goal=(20.0, 2), cells=64
    )
    chances = policy_chances(far, cells=8)
    assert chances.mean == (0.0, 0.0)
    assert ls.recheck(chances.save(tmp_path / "far.proof.zip")).verdict == "proved"


def test_a_normal_law_counts_its_tails():
    policy = one_throw((17.0, 2), {"landing.x": "0.05 in"})
    x = float(images(ls.load("paper-designed").map, np.array([16.0005]), 2).x[0])
    sigma = (x - 17.0) / 2.0
    lo, hi = policy_chances(policy, Scattering(landing=Gaussian(sigma)), cells=1000).come
    assert lo < 0.97725 < hi < lo + 5e-3  # of a standard normal number above -2


def test_cells_that_hold_a_place_count_on_both_of_its_sides(written):
    """Cells from 5 to 19, to 21, to 27 in; wanted is 20 in or beyond on side 2, and the sensor tells this side."""
    with flint.ctx.workprec(PRECISION):
        game, settings = read_settings(section_of(written[1]))
        edges = [np.array([5.0, 19.0, 21.0, 27.0])] * 3
        for mode, right, wrong, asked in (("catch", [2, 3], [], [1, 2]), ("stop", [2, 3], [1, 2], [1, 2, 3])):
            table = PolicyChances(game._replace(mode=mode), settings, edges, *[np.zeros(0)] * 3, {})
            places = places_of(table, mesh_of(edges, 1000.0))
            of_side = {"right": places.right, "wrong": places.wrong, "yes": places.answers[0]}
            # by left nodes: far out, 5, 19, 21, 27, far out on each side
            found = {name: np.flatnonzero(some[12:18]).tolist() for name, some in of_side.items()}
            assert {name: [k for k in some if 1 <= k <= 3] for name, some in found.items()} == {
                "right": right, "wrong": wrong, "yes": asked,
            }  # fmt: skip
            elsewhere = np.flatnonzero(places.wrong[:6]).tolist()
            assert [k for k in elsewhere if 1 <= k <= 3] == ([2, 3] if mode == "catch" else [1, 2, 3])


# ------------------------------------------------------------------------------ files


def test_the_file_says_what_is_proved(written, tmp_path):
    chances, file = written
    report = ls.recheck(file.write(tmp_path / "again.proof.zip"))
    assert report.verdict == "proved"
    said = "\n".join(report.statement)
    assert "until the part is caught (at x >= 20 in) or has left the arm, or the controller hears" in said
    assert "P(the part is caught on side 2 at x >= 20 in): between" in said
    assert report.parameters["law of landing.x"].startswith("uniform, within")
    assert not any(name.startswith("throw.") for name in report.parameters)
    json = chances.to_json()
    assert json["mean"] == {"lo": chances.mean[0], "hi": chances.mean[1]}
    assert [row[0] for row in chances.table().rows] == ["mean number of throws", "probability to come"]


@pytest.mark.parametrize(("word", "end"), [*itertools.product(("mean", "come"), (0, 1))])
def test_bounds_that_are_nearer_are_denied(written, tmp_path, word, end):
    forged = written[1].copy()
    pair = section_of(forged)[word]
    lo, hi = (float.fromhex(each) for each in pair)
    pair[end] = (0.99 * lo + 0.01 * hi if end == 0 else 0.01 * lo + 0.99 * hi).hex()
    report = recheck(forged, tmp_path)
    assert report.verdict == "failed"
    assert f"policy-chances: {word}: " in report.reason
    assert "is claimed, only" in report.reason


def test_a_table_that_stops_leaves_parts_that_have_to_be_caught(written, tmp_path):
    forged = written[1].copy()
    forged.arrays["throw"] = np.full_like(forged.arrays["throw"], -1)
    for word in ("mean", "come"):
        section_of(forged)[word] = [(0.0).hex(), (1.0).hex()]
    report = recheck(forged, tmp_path)
    assert (report.verdict, "the table stops" in report.reason) == ("failed", True)


def test_an_answer_that_leads_to_no_state_ends_the_throws(tmp_path):
    policy = one_throw((17.0, 2), {"landing.x": "0.05 in"})
    file = opened(
        policy_chances(policy, Scattering(landing=Uniform(0.5)), cells=300).save(tmp_path / "a.proof.zip")
    )
    file.arrays["after"] = np.full_like(file.arrays["after"], -1)
    section_of(file)["mean"] = [(1.0 - 1e-9).hex(), (1.0 + 1e-9).hex()]
    section_of(file)["come"] = [(0.0).hex(), (1e-9).hex()]
    assert recheck(file, tmp_path).verdict == "proved"


def table(name, place, value):
    return lambda f: f.arrays[name].__setitem__(place, value)


def section(*keys, **changed):
    def change(f):
        at = section_of(f)
        for key in keys:
            at = at[key]
        at.update(changed)

    return change


ABSORBING = {"here": [[2, "21 in", "22 in"]]}


@pytest.mark.parametrize(
    ("change", "verdict", "why"),
    [
        (table("left", slice(None), 1), "failed", "the number of throws left does not fall"),
        (table("after", 0, 9999), "failed", "a next state is none"),
        (table("throw", 0, 7), "failed", "a throw is none of those to choose from"),
        (section("first", yes=9999), "failed", "the state to begin in is none"),
        (section(mean=[(9.0).hex(), (1.0).hex()]), "bad file", "mean: the ends are negative, or"),
        (section(absorbing=ABSORBING), "bad file", "the places where parts end are those of the policy"),
        (section("scene", effects={}), "bad file", "with effects"),
        (section("laws", **{"landing.x": {"uniform": "0.06 in"}}), "failed", "is claimed"),
        (section("goal", x="21 in"), "bad file", "parts are caught elsewhere"),
        (lambda f: section_of(f)["starts"].append([2, "17.5 in", "18 in"]), "bad file", "overlap"),
    ],
)
def test_what_is_no_such_claim_is_denied(written, tmp_path, change, verdict, why):
    forged = written[1].copy()
    change(forged)
    report = recheck(forged, tmp_path)
    assert report.verdict == verdict
    assert why in report.reason


def test_what_cannot_be_asked_is_refused():
    place = policies()["place"]
    for policy, scatter, how, said in (
        (ls.feedback(scene_with(), "none", starts=FEW, cells=64, throws=1), None, {}, r"the policy is .not-solved."),
        (place, None, {"cells": 0}, "the cells of an expectation is 0"),
        (place, None, {"cells": "8"}, "the argument cells"),
        (place, None, {"cells": 8.5}, "the argument cells"),
        (place, Scattering(landing=Gaussian(0.02)), {"cells": 45_000}, "more than 120000 nodes"),
        (place, Scattering(tilt=Uniform(0.01)), {}, "of speed and landing place"),
    ):  # fmt: skip
        with pytest.raises(AnswerError, match=said):
            policy_chances(policy, scatter, **how)
