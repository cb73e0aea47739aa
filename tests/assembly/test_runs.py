"""Assembly: which parts pass, how a part is pushed, and whole runs against closed forms."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binomtest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.cell.assembly.assembly_run import OUTCOMES, joint_of
from limitsets.cell.assembly.pairing import (
    TOLERANCE,
    Draws,
    are_apart,
    at_rest,
    meet,
    outline_at,
    pair_of,
    way_of,
)
from limitsets.cell.assembly.trials import Question, _Watched, crowd_of, pass_through, push
from limitsets.cell.feeding.falling import arm_end_of
from limitsets.cell.feeding.trials import run_trials
from limitsets.feeder.engine.crowd import depth_of_overlap
from limitsets.feeder.engine.depression import seat_of
from limitsets.feeder.engine.member import Rest
from limitsets.feeder.scattering import Gaussian, Scattering, Uniform
from limitsets.feeder.thrower import trace
from limitsets.systems.maps import images
from tests.assembly.pairs import NAMES, NOISE, pair
from tests.cli.command import json_of, prints, refusal, run
from tests.feeding.scenes import with_cavity
from tests.sweep.stores import Shuffled

# ----------------------------------------------------------------
# Trials by any executor, in any order, cut off and gone on with; what cannot be; JSON and the command.


COUNT = 45  # the last chunk is not full


@pytest.fixture(scope="module")
def whole():
    return ls.assemble(*NAMES, NOISE, trials=COUNT, seed=8).rows


class Killed(Executor):
    """Ends the run, as Ctrl-C does, after some chunks."""

    def __init__(self, chunks):
        self.left = chunks

    def submit(self, function, /, *arguments):
        if self.left == 0:
            raise KeyboardInterrupt
        self.left -= 1
        future = Future()
        future.set_result(function(*arguments))
        return future


@pytest.mark.sweep
def test_the_same_by_threads_in_any_order_and_by_processes(whole):
    with ThreadPoolExecutor(3) as pool:
        assert ls.assemble(*NAMES, NOISE, trials=COUNT, seed=8, executor=pool).rows == plain(whole)
    assert ls.assemble(*NAMES, NOISE, trials=COUNT, seed=8, executor=Shuffled(4)).rows == plain(whole)
    assert ls.assemble(*NAMES, NOISE, trials=COUNT, seed=8, workers=2).rows == plain(whole)


def plain(rows):
    return tuple(json.loads(json.dumps(row)) for row in rows)


def test_a_killed_run_goes_on(whole, tmp_path):
    file = tmp_path / "trials.json"
    # the driver hands out a window of chunks before it writes: two are kept before the run that is killed
    ls.assemble(*NAMES, NOISE, trials=20, seed=8, file=file)
    with pytest.raises(KeyboardInterrupt):
        ls.assemble(*NAMES, NOISE, trials=COUNT, seed=8, file=file, executor=Killed(1))
    assert len(json.loads(file.read_text())["trials"]) == 20
    made = []
    note = {"progress": lambda stage, done, of: made.append(done)}
    found = ls.assemble(*NAMES, NOISE, trials=COUNT, seed=8, file=file, **note)
    assert min(made) >= 2  # two of the five chunks were there
    assert found.rows == plain(whole)
    assert ls.assemble(*NAMES, NOISE, trials=7, seed=8, file=file).rows == plain(whole)[:7]


@pytest.mark.sweep
def test_a_run_killed_from_outside_goes_on(tmp_path):
    file, command = tmp_path / "trials.json", [sys.executable, "-m", "limitsets", "assemble", *NAMES]
    command += ["--scatter", "throw.speed=0.5 %", "--trials", "2000", "--seed", "8", "--json"]
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    begun = subprocess.Popen([*command, "--file", str(file)], **silent)
    until = time.monotonic() + 120.0
    while not file.exists() and time.monotonic() < until and begun.poll() is None:
        time.sleep(0.01)
    os.kill(begun.pid, signal.SIGKILL)
    begun.wait()
    kept = json.loads(file.read_text())["trials"]
    assert 0 < len(kept) < 2000
    command[command.index("2000")] = str(len(kept) + 30)
    continued, afresh = (
        subprocess.run([*command, *more], capture_output=True, check=True, text=True).stdout
        for more in (["--file", str(file)], [])
    )
    assert json.loads(continued) == json.loads(afresh)
    assert kept.items() <= json.loads(file.read_text())["trials"].items()


@pytest.mark.sweep
def test_a_dask_cluster_of_separate_processes_gives_the_same_trials(whole, tmp_path):
    from distributed import LocalCluster

    options = {"processes": True, "threads_per_worker": 1, "dashboard_address": None}
    with LocalCluster(n_workers=2, local_directory=str(tmp_path / "dask"), **options) as cluster:
        found = ls.assemble(*NAMES, NOISE, trials=COUNT, seed=8, cluster=cluster.scheduler_address)
    assert found.rows == plain(whole)


def test_a_file_of_other_trials_is_refused(tmp_path):
    file = tmp_path / "trials.json"
    ls.assemble(*NAMES, NOISE, trials=1, seed=8, file=file)
    with pytest.raises(AnswerError, match="seed differs"):
        ls.assemble(*NAMES, NOISE, trials=1, seed=9, file=file)
    file.write_text("[]")
    with pytest.raises(AnswerError, match="a file of trials that this call wrote"):
        ls.assemble(*NAMES, NOISE, trials=1, seed=8, file=file)


def both():
    return [ls.load(name).as_dict() for name in NAMES]


def second_with(name, value):
    """The pair, one quantity of the second part's scene changed."""
    return NAMES[0], ls.load(NAMES[1]).with_values({name: value})


CONTACT = pair(contact=True)
ENERGY = [tree | {"model": {"flight": "exact", "flip": "energy"}} for tree in both()]
FLAT = [{key: table for key, table in tree.items() if key != "cavity"} for tree in both()]


@pytest.mark.parametrize(
    ("scenes", "words", "said"),
    [
        (NAMES, {"starts": [(10.0, 2), (10.5, 1)]}, "overlapping"),
        (NAMES, {"starts": [(6.0, 2), (20.5, 1)]}, "the start of paper-quadrilateral"),
        (second_with("throw.kappa", 24.0), {}, "kappa of the two scenes"),
        (second_with("arm.surface_height", -0.4), {}, "surface_height of the two scenes"),
        (FLAT, {}, "cavity"),
        (NAMES, {"contact": "hinge"}, r"effects\.contact"),
        ((CONTACT[0], NAMES[1]), {}, r"effects\.contact of the two scenes"),
        (CONTACT, {"contact": "glue"}, "the contact"),
        (NAMES, {"trials": 0}, "the trials"),
        (NAMES, {"seed": -1}, r"the seed is -1; allowed: a whole number from 0"),
        (ENERGY, {}, "the flip of paper-triangle"),
    ],
)
def test_what_cannot_be(scenes, words, said):
    with pytest.raises(AnswerError, match=said):
        ls.assemble(*scenes, **{"trials": 1} | words)


def test_parts_that_do_not_fit_one_on_the_other_are_named(capfd, tmp_path):
    """Two triangles: the second's side 2 lies on the ramp beyond the first, which fills it down to the wall."""
    one = both()[0]
    deep = {**one, "cavity": {**one["cavity"], "width": "7 in", "depth": "4.4 in"}}
    ls.dump(ls.load(deep), tmp_path / "deep.toml")
    found = ls.assemble(deep, deep, trials=1)
    assert found.misfit.startswith("the part on side 2 in the cavity: standing out by")
    _, out, _ = run(capfd, "assemble", *[str(tmp_path / "deep.toml")] * 2, "--trials", "1")
    assert "THEY DO NOT FIT: the part on side 2" in out
    deep["effects"] = {"contact": True}
    with pytest.raises(AnswerError, match="standing out by"):
        ls.assemble(deep, deep, trials=1)


def test_the_first_series_is_of_twenty_or_of_all_there_are(whole):
    found = ls.assemble(*NAMES, NOISE, trials=COUNT, seed=8)
    words = [row["outcome"] for row in whole]
    for made in (12, COUNT):
        fewer = replace(found, rows=found.rows[:made])
        first = words[: min(made, 20)]
        assert fewer.to_json()["first_series"] == {"of": len(first), "assembled": first.count("assembled")}
    assert "assembled" in words[20:]


KEYS = {
    "scenes", "unit", "contact", "carried", "misfit", "overlaps", "trials", "seed", "scatter", "counts", "assembled",
    "first_series", "joint", "survived",
}  # fmt: skip


def test_json_and_the_command(capfd, tmp_path):
    options = ("--trials", "12", "--seed", "2", "--scatter", "throw.speed=0.5 %")
    found = json_of(capfd, "assemble", *NAMES, *options, "-o", str(tmp_path))
    assert set(found) == KEYS
    assert found["contact"] == "none"
    assert found["misfit"] is None
    assert set(found["overlaps"]) == {"ever", "at_start", "at_rest", "in_flight"}
    assert set(found["assembled"]) == {"count", "of", "share", "interval"}
    assert set(found["joint"]) == {"table", "rates", "both", "product", "error", "error_interval", "serial"}
    assert json.loads((tmp_path / "assembly.json").read_text()) == found
    assert (tmp_path / "assembly.png").stat().st_size > 10_000
    out = prints(capfd, "assemble", *NAMES, *options)
    assert "the outlines overlap in" in out.splitlines()[1]  # reported first
    assert "one part after the other, or two arms" in out
    assert f"{found['first_series']['assembled']} assembled in the first 12 trials" in out
    refusal(capfd, "assemble", NAMES[0], "paper-designed")


# ----------------------------------------------------------------
# Parts that pass through each other: each by itself as `limitsets.feed` has it, and outlines against brute force.


TRIALS, ALONE = 600, 5000  # an interval of the first is as wide as 13 %, one of the second as 5 %


@pytest.fixture(scope="module")
def found():
    return ls.assemble(*NAMES, NOISE, trials=TRIALS, seed=3)


@pytest.mark.sweep  # thousands of trials
@pytest.mark.parametrize("number", [0, 1])
def test_each_part_by_itself_is_fed_as_alone(found, number):
    """The common speed couples the parts, but each sees the same law as alone: intervals of 99.9 % overlap."""
    alone = run_trials(arm_end_of(ls.load(NAMES[number])), NOISE, ALONE, seed=11)
    table = found.joint.table
    for fate, count in alone.counts.items():
        row = table[fate].values() if number == 0 else (of[fate] for of in table.values())
        own = binomtest(sum(row), TRIALS).proportion_ci(0.999, method="exact")
        other = binomtest(count, ALONE).proportion_ci(0.999, method="exact")
        assert own.low <= other.high, fate
        assert other.low <= own.high, fate
    throws = np.array([row["throws"][number] for row in found.rows])
    error = np.hypot(throws.std() / np.sqrt(TRIALS), alone.throws.std() / np.sqrt(ALONE))
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
    for _ in range(24):
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
            starting = zip(scenes, states, sides, strict=True)
            ways = [way_of(scene, scene.map, *each) for scene, *each in starting]
            times = np.linspace(0.0, max(way.ends for way in ways), 800).tolist()
            deepest.append(max(depth_of_overlap(*(way.corners(time) for way in ways)) for time in times))
            states = [(float(each.x[0]), side) for each, side in zip(after, sides, strict=True)]
        met = [depth > 0.0 for depth in deepest]
        assert met == [False] * (len(deepest) - bool(throw)) + [True] * bool(throw)
        assert found.overlap_in_flight == throw
        assert found.overlaps == bool(throw)


@pytest.mark.parametrize("deviation", [0.04, -0.02])
def test_a_faster_throw_is_one_with_less_kappa(monkeypatch, deviation):
    """kappa = g/w^2, for both parts at once: noise that is the same at every throw is another scene without noise."""
    starts, by = ((5.0, 2), (16.0, 1)), {}
    by_square = {"scene": (1.0 + deviation) ** -2, "inverse": (1.0 + deviation) ** 2}
    for name, factor in {"noise": 1.0, **by_square}.items():
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


# ----------------------------------------------------------------
# Parts in contact, in the engine: seats, order, what is counted, and films.


pytest.importorskip("pymunk")
TRIALS_PUSHING = 24


@pytest.fixture(scope="module")
def joined():
    return pair_of(*pair(contact=True), NOISE)


@pytest.fixture(scope="module")
def found_pushing():
    return ls.assemble(*pair(contact=True), NOISE, trials=TRIALS_PUSHING, seed=1)


def pose_at(scene, corners):
    """Place of the centre of mass and angle of a part whose corners are there, by the first side's direction."""
    along, up = np.asarray(corners[1]) - corners[0]
    flat = np.asarray(scene.vertices[1]) - scene.vertices[0]
    angle = math.atan2(up, along) - math.atan2(flat[1], flat[0])
    x, y = np.asarray(scene.centre) - scene.vertices[0]
    cos, sin = math.cos(angle), math.sin(angle)
    return corners[0][0] + x * cos - y * sin, corners[0][1] + x * sin + y * cos, angle


def seated(joined):
    one, two = joined.scenes
    below = seat_of(one, 2)
    return pose_at(one, below), pose_at(two, seat_of(two, 1, [below]))


def test_the_seats_are_those_of_the_paper_s_sizes(joined):
    """The triangle's side 0 level, the quadrilateral's base on it, its left side on the ramp, its right at the wall."""
    one, two = joined.scenes
    below = seat_of(one, 2)
    above = seat_of(two, 1, [below])
    assert below[0][1] == pytest.approx(below[1][1], abs=2e-3)
    assert above[0] == pytest.approx(below[1], abs=2e-3)
    assert above[1] == pytest.approx(below[0], abs=2e-3)
    assert above[2][0] == pytest.approx(29.3, abs=2e-3)
    assert above[:, 1].max() < one.surface_height  # it does not stand out


def test_what_points_at_a_part_that_slides_down_stops_it_at_its_side():
    """A spike that meets the part's leading side between two corners: the part touches it, and slides no farther."""
    scene = with_cavity()
    free, slope = seat_of(scene, 2), scene.cavity.angle
    down = np.array([math.cos(slope), -math.sin(slope)])
    spike = np.array([[27.5, -4.2], [28.9, -4.3], [28.9, -4.1]])
    seat = seat_of(scene, 2, [spike])
    moved = (free - seat) @ down
    assert moved == pytest.approx(np.full(3, moved[0]))
    assert free - seat == pytest.approx(np.outer(moved, down), abs=1e-9)
    assert moved[0] > 1.0
    assert depth_of_overlap(seat.tolist(), spike.tolist()) == pytest.approx(0.0, abs=1e-9)
    assert depth_of_overlap((seat + 0.1 * down).tolist(), spike.tolist()) > 0.05


def test_parts_let_go_in_their_seats_stay_there_and_survive(joined):
    crowd = crowd_of(joined, Question(carried=False))
    for number, pose in enumerate(seated(joined)):
        crowd.drop(number, pose)
    watched = _Watched(joined, crowd)
    rests = crowd.settle()
    assert watched.assembled()
    watched.seen(1, rests)
    assert watched.outcome(rests) == "assembled"
    assert [rest.where for rest in crowd.throw()] == ["cavity", "cavity"]  # a standing cavity is not thrown
    assert watched.assembled()


def test_a_part_that_fell_off_has_left(joined):
    crowd = crowd_of(joined, Question())
    crowd.drop(0, seated(joined)[0])
    crowd.drop(1, (-40.0, 0.0, 0.0))
    watched = _Watched(joined, crowd)
    rests = crowd.settle()
    watched.seen(1, rests)
    assert watched.outcome(rests) == "left"


def test_a_part_that_comes_out_is_ejected(joined):
    crowd = crowd_of(joined, Question())
    crowd.drop(0, seated(joined)[0])
    crowd.place(1, 8.0, 1)
    watched = _Watched(joined, crowd)
    watched.seen(1, crowd.settle())
    assert watched.entered == [2, None]
    crowd.place(0, 17.0, 2)
    rests = crowd.rests()
    watched.seen(2, rests)
    assert watched.outcome(rests) == "ejected"


def lying(number, where, side):
    return Rest(number, where, 25.0, side, (25.0, -3.0, 0.0), ())


@pytest.mark.parametrize(
    ("first", "second", "word"),
    [
        ((("cavity", 2), ("unfinished", -1)), (("arm", 1), ("unfinished", -1)), "unfinished"),
        ((("cavity", 2), ("arm", 2)), (("arm", 1), ("cavity", 0)), "ejected"),
        ((("arm", 2), ("cavity", 2)), (("cavity", 1), ("cavity", 1)), "order"),
        ((("arm", 2), ("arm", 2)), (("arm", 1), ("arm", 1)), "never"),
        ((("arm", 2), ("cavity", 2)), (("arm", 1), ("lost", -1)), "left"),
        ((("arm", 2), ("cavity", 2)), (("cavity", 1), ("lost", -1)), "ejected"),
    ],
)
def test_a_trial_is_called_after_what_is_seen(joined, first, second, word):
    """Where, and on which side, both parts are after two throws; a part that moves in the cavity has not come out."""
    watched = _Watched(joined, crowd_of(joined, Question()))
    for throw in (1, 2):
        rests = [lying(number, *each[throw - 1]) for number, each in enumerate((first, second))]
        watched.seen(throw, rests)
    assert watched.outcome(rests) == word


def test_trials_end_in_words_and_start_apart(found_pushing, joined):
    assert sum(found_pushing.counts.values()) == TRIALS_PUSHING
    assert set(found_pushing.counts) == set(OUTCOMES)
    assert found_pushing.joint is None
    assert found_pushing.overlaps is None
    from limitsets.cell.assembly.pairing import Draws

    for number in range(60):
        assert are_apart(joined, Draws(joined, 1, number).starts(apart=True))


def test_a_trial_depends_on_its_number_alone_of_pushing(found_pushing, joined):
    for number in (3, 0):
        again, _ = push(joined, 1, number)
        assert again.outcome == found_pushing.rows[number]["outcome"]
        assert list(again.throws) == list(found_pushing.rows[number]["throws"])


def test_a_film_ends_with_the_parts_in_the_cavity(found_pushing):
    for number in (TRIALS_PUSHING, -1):
        with pytest.raises(AnswerError, match="the trial is"):
            found_pushing.film(number)
    number = next(k for k, row in enumerate(found_pushing.rows) if None not in row["entered"])
    film = found_pushing.film(number)
    assert film.times.size > 5
    assert (np.diff(film.times) >= 0.0).all()
    assert (film.poses[-1, :, 0] > 20.0).all()
    assert film.poses[-1, :, 1].max() < 2.0


@pytest.mark.sweep
def test_the_figure_has_a_case_of_each_outcome(found_pushing, tmp_path):
    figure = ls.plot.assembly(found_pushing)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    seen = [word for word, count in found_pushing.counts.items() if count]
    assert sum("(trial" in title for title in titles) == len(seen)
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == [scene.name for scene in found_pushing.pair.scenes]  # which of the parts is which
    figure.savefig(tmp_path / "assembly.png")
