"""Parts that pass through each other: each by itself as `limitsets.feed` has it, and outlines against brute force."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.stats import binomtest

import limitsets as ls
from limitsets.cell.assembly.assembly_run import joint_of
from limitsets.cell.assembly.pairing import TOLERANCE, Draws, at_rest, meet, outline_at, pair_of, way_of
from limitsets.cell.assembly.trials import pass_through
from limitsets.cell.feeding.falling import arm_end_of
from limitsets.cell.feeding.trials import run_trials
from limitsets.feeder.engine.crowd import depth_of_overlap
from limitsets.feeder.scattering import Gaussian, Scattering, Uniform
from limitsets.feeder.thrower import trace
from limitsets.systems.maps import images
from tests.assembly.pairs import NAMES, NOISE

TRIALS = 600


@pytest.fixture(scope="module")
def found():
    return ls.assemble(*NAMES, NOISE, trials=TRIALS, seed=3)


@pytest.mark.sweep  # thousands of trials
@pytest.mark.parametrize("number", [0, 1])
def test_each_part_by_itself_is_fed_as_alone(found, number):
    """The common speed couples the parts, but each sees the same law as alone: intervals of 99.9 % overlap."""
    alone = run_trials(arm_end_of(ls.load(NAMES[number])), NOISE, 20_000, seed=11)
    table = found.joint.table
    for fate, count in alone.counts.items():
        row = table[fate].values() if number == 0 else (of[fate] for of in table.values())
        own = binomtest(sum(row), TRIALS).proportion_ci(0.999, method="exact")
        other = binomtest(count, 20_000).proportion_ci(0.999, method="exact")
        assert own.low <= other.high, fate
        assert other.low <= own.high, fate
    throws = np.array([row["throws"][number] for row in found.rows])
    error = np.hypot(throws.std() / np.sqrt(TRIALS), alone.throws.std() / np.sqrt(20_000))
    assert abs(throws.mean() - alone.throws.mean()) < 4.0 * error


@pytest.mark.sweep
def test_the_joint_law_adds_up(found):
    joint, counts = found.joint, found.counts
    assert sum(sum(row.values()) for row in joint.table.values()) == TRIALS
    assert counts["assembled"] + counts["order"] == joint.both.count == joint.table["right"]["right"]
    assert sum(counts.values()) == TRIALS


def test_the_error_of_multiplying():
    """Of two coins that always fall alike half of the trials have both heads; the product says a quarter."""
    rows = [{"fates": ("right", "right")}, {"fates": ("left", "left")}] * 200
    joint = joint_of(rows)
    assert (joint.both.share, joint.product, joint.error) == (0.5, 0.25, -0.25)
    # each trial's term is p1 [2] + p2 [1] - [both] = 0 whatever falls: no spread to first order
    assert joint.error_interval == pytest.approx((-0.25, -0.25))
    alone = joint_of([{"fates": (one, two)} for one in ("right", "left") for two in ("right", "left")] * 100)
    assert alone.error == 0.0
    assert alone.error_interval[0] < 0.0 < alone.error_interval[1]


def test_serial_feeding_holds_both_rates_at_once():
    """Of n right feeds of n the least rate is (alpha/2)^(1/n); two intervals of 97.5 % both hold at 95 %."""
    joint = joint_of([{"fates": ("right", "right")}] * 20)
    assert joint.serial == pytest.approx((0.0125 ** (2 / 20), 1.0), rel=1e-9)


@pytest.mark.parametrize("name", [*NAMES, "paper-designed", "paper-initial"])
def test_a_way_ends_where_the_map_lets_the_part_rest(name):
    """Flight and turning about the struck corner, integrated here, end at the place that the map's formulas give."""
    scene = ls.load(name)
    jogs = flips = 0
    for side in range(len(scene.sides)):
        a = float(scene.sides.a[side])
        for x in np.linspace(a + 1.0, 23.0, 14).tolist():
            after = images(scene.map, [x], side)
            if after.code[0] < 0 or trace(scene.map, x, side).other_vertex_first[0]:
                continue  # it leaves, or the minimal model lets a corner strike that is not the lowest
            way = way_of(scene, scene.map, (x, side), int(after.side[0]))
            at_end = np.array(way.corners(way.ends))
            rest = np.array(at_rest(scene, (float(after.x[0]), int(after.side[0]))))
            assert at_end == pytest.approx(rest, abs=1e-6)
            assert np.array(way.corners(0.0)) == pytest.approx(np.array(at_rest(scene, (x, side))), abs=1e-12)
            # without a jump at the impact, nor a point faster than said
            times = np.linspace(0.0, way.ends, 400)
            places = np.array([way.corners(time) for time in times.tolist()])
            steps = np.hypot(*np.moveaxis(np.diff(places, axis=0), -1, 0)).max(axis=1)
            most = np.array([way.speed(time) for time in times[:-1].tolist()]) * np.diff(times)
            assert (steps <= most * (1.0 + 1e-9) + 1e-9).all()
            jogs, flips = jogs + (after.side[0] == side), flips + (after.side[0] != side)
    assert jogs > 5
    assert flips > 5


@pytest.mark.sweep
def test_ways_meet_where_many_looks_say_so():
    one, two = (ls.load(name) for name in NAMES)
    random, seen = np.random.default_rng(5), {True: 0, False: 0}
    near = TOLERANCE * float(one.sides.length.max())
    for _ in range(40):
        starts = (float(random.uniform(5.0, 9.0)), 2), (float(random.uniform(11.5, 16.5)), 1)
        ways = [
            way_of(scene, scene.map, start, int(images(scene.map, [start[0]], start[1]).side[0]))
            for scene, start in zip((one, two), starts, strict=True)
        ]
        times = np.linspace(0.0, max(way.ends for way in ways), 4000).tolist()
        deepest = max(depth_of_overlap(ways[0].corners(time), ways[1].corners(time)) for time in times)
        if deepest > 0.0:
            assert meet(*ways)
        elif deepest < -1.1 * near:
            assert not meet(*ways)
        seen[deepest > 0.0] += 1
    assert min(seen.values()) >= 5


def test_a_trial_says_in_which_throw_the_outlines_meet():
    """One start of parts that meet in the second throw, by many looks at each throw; one of parts that never do."""
    scenes, still = [ls.load(name) for name in NAMES], pair_of(*NAMES, Scattering())
    for starts, throw in ((((8.0, 2), (17.0, 1)), 2), (((5.0, 2), (16.0, 1)), 0)):
        found = pass_through(still, 0, 0, starts=starts)
        assert not found.overlap_at_start
        last, states, deepest = min(found.throws), list(starts), []
        for _ in range(throw or last):
            after = [images(scene.map, [x], side) for scene, (x, side) in zip(scenes, states, strict=True)]
            sides = [int(each.side[0]) for each in after]
            ways = [
                way_of(scene, scene.map, *each) for scene, *each in zip(scenes, states, sides, strict=True)
            ]
            times = np.linspace(0.0, max(way.ends for way in ways), 800).tolist()
            deepest.append(max(depth_of_overlap(*(way.corners(time) for way in ways)) for time in times))
            states = [(float(each.x[0]), side) for each, side in zip(after, sides, strict=True)]
        assert [depth > 0.0 for depth in deepest] == [False] * (len(deepest) - bool(throw)) + [True] * bool(
            throw
        )
        assert found.overlap_in_flight == throw
        assert found.overlaps == bool(throw)


@pytest.mark.parametrize("deviation", [0.04, -0.02])
def test_a_faster_throw_is_one_with_less_kappa(monkeypatch, deviation):
    """kappa = g/w^2, for both parts at once: noise that is the same at every throw is another scene without noise."""
    starts, by = ((5.0, 2), (16.0, 1)), {}
    for name, factor in (
        ("noise", 1.0),
        ("scene", (1.0 + deviation) ** -2),
        ("inverse", (1.0 + deviation) ** 2),
    ):
        scenes = [ls.load(each) for each in NAMES]
        scenes = [each.with_values({"throw.kappa": each.kappa * factor}) for each in scenes]
        with monkeypatch.context() as patched:
            speed = deviation if name == "noise" else 0.0
            patched.setattr(Draws, "throw", lambda _, speed=speed: (speed, (0.0, 0.0)))
            by[name] = pass_through(pair_of(*scenes, Scattering()), 0, 0, starts=starts)
    assert by["noise"] == by["scene"]
    assert by["noise"].throws != by["inverse"].throws


@pytest.mark.parametrize(("law", "deviation"), [(Gaussian, 1.0), (Uniform, 3.0**-0.5)])
def test_a_throw_draws_a_speed_and_two_landings_by_the_laws(law, deviation):
    noise = Scattering(speed=law(0.005), landing=law(0.02))
    draws = Draws(pair_of(*NAMES, noise), 0, 0)
    rows = np.array([(speed, *landing) for speed, landing in (draws.throw() for _ in range(6000))])
    rows /= np.array([0.005, 0.02, 0.02]) * deviation
    assert rows.mean(axis=0) == pytest.approx(np.zeros(3), abs=5 / np.sqrt(6000))
    assert rows.std(axis=0) == pytest.approx(np.ones(3), abs=5 / np.sqrt(2 * 6000))
    assert np.corrcoef(rows.T) == pytest.approx(np.eye(3), abs=5 / np.sqrt(6000))
    if law is Uniform:
        assert np.abs(rows).max() <= 3.0**0.5


def test_an_outline_has_its_centre_of_mass_where_it_is_said():
    scene = ls.load("paper-quadrilateral")
    corners = np.array(outline_at(scene, 7.0, 3.0, 0.4))
    middle = np.array(scene.vertices).mean(axis=0) - np.array(scene.centre)
    turned = np.array([[np.cos(0.4), -np.sin(0.4)], [np.sin(0.4), np.cos(0.4)]]) @ middle
    assert corners.mean(axis=0) == pytest.approx(turned + np.array([7.0, 3.0]))


def test_a_trial_depends_on_its_number_alone():
    joined = pair_of(*NAMES, NOISE)
    again = [pass_through(joined, 3, number) for number in (5, 2)]
    assert again == [pass_through(joined, 3, number) for number in (5, 2)]
    assert again[0] != pass_through(joined, 4, 5)


@pytest.mark.sweep
def test_without_contact_there_is_no_engine():
    code = (
        "import sys, limitsets as ls; ls.assemble('paper-triangle', 'paper-quadrilateral', trials=2);"
        "print('pymunk' in sys.modules)"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "False"
