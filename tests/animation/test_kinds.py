"""Films of feeding, feedback, margins and recordings, and what cannot be shown."""

import math

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.cell.feeding import time_to_tip
from limitsets.cell.feeding.falling import arm_end_of
from limitsets.face.animation import film_of
from limitsets.feeder.engine.member import Recording
from tests.assembly.pairs import pair as pair_of_tests
from tests.feeding.scenes import with_cavity
from tests.trays.scenes import with_tray


def test_a_part_is_fed_tips_in_its_time_and_lies_on_the_ramp():
    scene = with_cavity("paper-designed", tips="rest")
    film = film_of(arm_end_of(scene))
    cavity, last = scene.cavity, film.frames - 1
    assert film.captions[film.caption[last]].startswith("Fed rightly")
    rest = film.rests[-1]
    assert rest.x > cavity.position
    assert rest.side == 2
    # the base of the part leans by the ramp's angle, on the ramp
    corners = film.polygon(last)
    left, right = corners[-rest.side % 3], corners[(1 - rest.side) % 3]
    slope = math.atan2(left[1] - right[1], right[0] - left[0])
    assert slope == pytest.approx(cavity.angle, abs=1e-9)
    drop = scene.surface_height - left[1]
    assert drop == pytest.approx((left[0] - cavity.position) * math.tan(cavity.angle), abs=1e-9)
    assert corners[:, 0].max() <= cavity.position + cavity.width + 1e-9
    # the time to tip by an integral, where the film solves the equation of motion
    tipping = np.flatnonzero([film.captions[k].startswith("It tips") for k in film.caption])
    beyond, d = rest.x - cavity.position, scene.sides.d[2]
    time = time_to_tip(beyond, d, scene.radius_of_gyration, scene.gravity, cavity.angle)
    shown = film.times[tipping[-1]] - film.times[tipping[0] - 1]
    assert shown == pytest.approx(float(time), rel=1e-6)


@pytest.mark.parametrize(
    ("name", "rate", "start", "words"),
    [
        (
            "paper-initial",
            None,
            (19.5, 1),
            "Fed on a wrong side",
        ),  # docs/feeding.md: a start on side 1 feeds side 1
        ("paper-designed", "20 Hz", (17.49, 2), "Not clear of the wall"),  # it tips longer than 1/20 s
    ],
)
def test_a_wrong_part_and_a_late_one_are_called_so(name, rate, start, words):
    film = film_of(arm_end_of(with_cavity(name, rate=rate), side=2), start=start)
    assert film.captions[film.caption[-1]].startswith(words)


def test_a_policy_shows_its_answers_throws_and_beliefs():
    tree = ls.load("paper-designed").as_dict()
    tree["feedback"] = {
        "sensor": {"beyond": "20 in"},
        "throws": [{"name": "own", "kappa": "25.3778518 in"}],
    }
    found = ls.feedback(ls.load(tree), starts={2: (16.0, 16.5)}, cells=256)
    film = film_of(found)
    assert len(film.rests) == 2  # docs: two throws are enough
    begin = film.position[0, 0]
    path = ls.orbit(found.scene.map, begin, 2, 2)
    assert [rest.x for rest in film.rests] == pytest.approx(path.x[1:])
    assert film.notes[film.note[0]] == "sensor: is the part beyond 20 in? no → throw own (state 0)"
    assert film.notes[film.note[-1]].startswith("sensor: is the part beyond 20 in? yes → stop")
    for k in (0, film.rests[0].frame + 1, film.frames - 1):
        x, side = film.position[k]
        assert any(lo <= x <= hi for lo, hi in film.lanes.known[film.stage[k]][int(side)])
    with pytest.raises(AnswerError, match="one of the policy's starts"):
        film_of(found, start=(10.0, 2))


def test_a_margin_shows_the_orbit_that_violates_the_goal():
    (found,) = ls.margin("paper-designed", "throw.speed", width=0.1)
    film = film_of(found, throws=3)
    last = found.counterexample[-1]
    assert last.lo - 1e-9 <= film.rests[-1].x <= last.hi + 1e-9
    assert film.rests[-1].side == last.side != 2
    assert film.rests[-1].x > 20.0
    assert film.notes[film.note[-1]].startswith("the goal is violated")
    with pytest.raises(AnswerError, match="has its own"):
        film_of(found, start=(15.0, 2))


def recording():
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    times = np.linspace(0.0, 1.0, 21)
    poses = np.zeros((21, 2, 3))
    poses[:, 0, 0], poses[:, 1, 0] = 5.0, 9.0
    poses[:, :, 1] = 1.0 + 4.0 * (times * (1.0 - times))[:, None]
    poses[15:, 1] = np.nan
    ground = np.array([[0.0, -1.0], [20.0, -1.0], [20.0, 0.0], [0.0, 0.0]])
    marks = ((0.0, 0, "thrown"), (0.0, 1, "thrown"), (0.7, 1, "lost"), (1.0, 0, "rest"))
    return Recording(times, poses, (square, square), (ground,), np.zeros(21), marks)


def test_a_recording_keeps_its_poses_and_says_what_happened():
    kept = recording()
    film = film_of(kept, slow=1.0, fps=20.0)
    assert film.poses[:21] == pytest.approx(kept.poses, nan_ok=True)
    assert film.notes[film.note[0]] == "part 1: thrown, part 2: thrown"
    assert film.notes[film.note[-1]] == "part 1: rest, part 2: lost"
    assert (
        film.captions[film.caption[-1]] == film.captions[film.caption[0]] == "Throw 1"
    )  # released in the first


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (
            {"start": (30.0, 2)},
            "x of the start is 30.0; allowed: more than 4.22558 and up to 28 in on side 2",
        ),
        ({"start": (1.0, 0)}, "x of the start"),
        ({"start": (15.0, 3)}, "the side of the start is 3; allowed: a whole number from 0 to 2"),
        ({"start": (math.nan, 1)}, "x of the start is nan"),
        ({"throws": 0}, "the throws is 0"),
        ({"throws": 100_000}, "the frames of the film"),
        ({"throws": 500}, "the frames of the film"),
        ({"fps": 0.0}, "the frames per second"),
        ({"slow": -1.0}, "the slow motion"),
    ],
)
def test_what_cannot_be_shown_is_refused(asked, words):
    with pytest.raises(AnswerError, match=words):
        film_of("paper-designed", **asked)


def test_marks_of_a_throw_go_when_the_next_one_begins():
    film = film_of("paper-designed", start=(15.0, 2), throws=2)
    impacts = [mark for mark in film.marks if mark.word == "impact"]
    assert [mark.until for mark in impacts] == [film.rests[1].begin, film.frames]
    assert impacts[0].frame < film.rests[0].frame < film.rests[1].begin < impacts[1].frame


def test_nothing_else_can_be_shown(tmp_path):
    with pytest.raises(AnswerError, match="what to animate is 'dict'"):
        film_of({})
    for name in ("run.avi", "run.mp4", "run"):
        with pytest.raises(AnswerError, match=r"ends in \.gif, \.html; .* ffmpeg -i film\.gif"):
            ls.animate("paper-designed", tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_pair_in_contact_swings_with_the_arm_and_keeps_the_engine_s_poses():
    pair = pair_of_tests(contact=True)
    found = ls.assemble(*pair, trials=3, seed=1, starts=((8.0, 2), (18.0, 2)))
    film = film_of(found, throws=1)
    kept = found.film(found.example("assembled") or 0, 1)
    height, end = film.surface
    assert (height, end) == (pair[0].surface_height, pair[0].cavity.position)
    assert film.poses[-1] == pytest.approx(kept.poses[-1], nan_ok=True)
    assert [label.word for label in film.labels[1]] == ["0", "1", "2", "3"]
    # a part that is thrown lies on the arm in the first frames of the swing
    low = int(np.argmin(film.arm))
    thrown = [part for time, part, word in kept.marks if word == "thrown" and time == kept.times[0]]
    angle = -film.arm[low]
    on_arm = [
        part for part in thrown if kept.poses[0, part, 0] < end
    ]  # others lie in the cavity, thrown with it
    assert on_arm
    for part in on_arm:
        corners = film.polygon(low, part)
        over = math.sin(angle) * corners[:, 0] + math.cos(angle) * corners[:, 1] - height
        assert sorted(over)[:2] == pytest.approx([0.0, 0.0], abs=1e-3)  # the engine's own overlap
    assert min(film.arm) == pytest.approx(-math.radians(6.0))


def test_many_parts_on_a_tray_are_shown_kick_by_kick():
    found = ls.tray(with_tray(), passes=1, drops=20, kicks=20, parts=3, depressions=2, batches=1, step=8e-3)
    film = film_of(found, throws=3)
    assert film.title == "paper-designed, 3 parts a pass over 2 depressions"
    assert [caption for caption in film.captions if caption.startswith("Kick")] == ["Kick 1", "Kick 2"]
    # the first pass has no kick, there is nothing to throw; 3 parts and more are on the tray in the last one
    seen = np.isfinite(film.poses[..., 0]).sum(axis=1)
    assert seen.max() >= 3
    assert seen[-1] >= 3


def test_a_tray_shows_its_passes():
    film = film_of(ls.tray(with_tray(), passes=1, drops=20, kicks=20), throws=4)
    assert film.title == "paper-designed, one depression of a tray"
    assert film.surface is None
    assert any(caption.startswith("Kick") for caption in film.captions)
    assert len(film.ground) == 3
