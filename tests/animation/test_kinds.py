"""The films: each kind shows what was computed, with the part where the throw puts it."""

import math

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError, LimitsetsError
from limitsets.cell.feeding import time_to_tip
from limitsets.cell.feeding.falling import arm_end_of, tipping_times
from limitsets.face.animation import film_of
from limitsets.face.animation.fed import film_of_recording
from limitsets.face.animation.film import Asked
from limitsets.face.animation.picture import Picture
from limitsets.face.plot.throwing import about_centre, motion, throws_of, turned
from limitsets.feeder.engine import Crowd
from limitsets.feeder.engine.crowd import depth_of_overlap
from limitsets.feeder.engine.member import Recording, ground_of
from limitsets.feeder.thrower import trace
from limitsets.systems.maps import advance
from tests.assembly.pairs import pair as pair_of_tests
from tests.cli.command import refusal
from tests.feeding.scenes import with_cavity
from tests.trays.scenes import with_tray

# ----------------------------------------------------------------
# Films of feeding, feedback, margins and recordings, and what cannot be shown.


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
        # docs/feeding.md: a start on side 1 feeds side 1
        ("paper-initial", None, (19.5, 1), "Fed on a wrong side"),
        ("paper-designed", "20 Hz", (17.49, 2), "Not clear of the wall"),  # it tips longer than 1/20 s
    ],
)
def test_a_wrong_part_and_a_late_one_are_called_so(name, rate, start, words):
    film = film_of(arm_end_of(with_cavity(name, rate=rate), side=2), start=start)
    assert film.captions[film.caption[-1]].startswith(words)


def test_a_policy_shows_its_answers_throws_and_beliefs():
    tree = ls.load("paper-designed").as_dict()
    throws = [{"name": "own", "kappa": "25.3778518 in"}]
    tree["feedback"] = {"sensor": {"beyond": "20 in"}, "throws": throws}
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
    # released in the first
    assert film.captions[film.caption[-1]] == film.captions[film.caption[0]] == "Throw 1"


def test_what_cannot_be_shown_is_refused():
    for asked, words in (
        ({"start": (30.0, 2)}, "x of the start is 30.0; allowed: more than 4.22558 and up to 28 in on side"),
        ({"start": (1.0, 0)}, "x of the start"),
        ({"start": (15.0, 3)}, "the side of the start is 3; allowed: a whole number from 0 to 2"),
        ({"start": (math.nan, 1)}, "x of the start is nan"),
        ({"throws": 0}, "the throws is 0"),
        ({"throws": 100_000}, "the frames of the film"),
        ({"throws": 500}, "the frames of the film"),
        ({"fps": 0.0}, "the frames per second"),
        ({"slow": -1.0}, "the slow motion"),
    ):
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
    # others lie in the cavity, thrown with it
    on_arm = [part for part in thrown if kept.poses[0, part, 0] < end]
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


# ----------------------------------------------------------------
# The cavity in films: it turns with the arm, and no part is swept through it.


ASKED = Asked(None, None, 20.0, 3.0)


def deepest(film, scene):
    """How deep any part is in the ramp, the floor or the wall, as the arm of that frame holds them."""
    blocks = [piece.corners for piece in ground_of(scene).pieces if piece.name != "arm"]
    worst = -math.inf
    for frame in range(film.frames):
        angle = float(film.arm[frame])
        back = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        for part in np.flatnonzero(np.isfinite(film.poses[frame, :, 0])):  # those in play
            corners = (film.polygon(frame, part) @ back).tolist()  # as seen from the arm
            worst = max(worst, *(depth_of_overlap(corners, block.tolist()) for block in blocks))
    return worst


@pytest.mark.parametrize("start", [(19.59, 0), (18.2, 2)])
def test_a_part_that_hangs_over_the_end_swings_with_the_cavity(start):
    scene = with_cavity()
    film = film_of(arm_end_of(scene), start=start)
    assert film.arm.min() < -0.05
    hangs = [film.polygon(k)[:, 0].max() > 20.0 for k in np.flatnonzero(film.arm == 0.0)]
    assert any(hangs)
    assert deepest(film, scene) < 0.01


@pytest.mark.parametrize("carried", [True, False])
def test_parts_in_the_cavity_are_not_swept_through_it(carried):
    """One lies in the cavity, one hangs over the end, and both are thrown where the cavity is part of the arm."""
    pytest.importorskip("pymunk")
    scene = with_cavity(tables={"effects": {"contact": True}, "world": {"friction": 0.9}})
    crowd = Crowd([scene, scene], carried=carried, record=True)
    crowd.place(0, 21.0, 2)
    crowd.settle()
    crowd.place(1, 19.0, 2)
    crowd.throw()
    film = film_of_recording(crowd.recording(), ASKED, [scene, scene], carried=carried)
    assert bool(film.arm.min() < -0.05) is carried  # a standing cavity is in the way of the arm's swing
    assert ("with the cavity" in film.about) is carried
    # in one step a corner comes as deep as it is fast, 25 in x 4e-3; swept through the ramp it would be inches
    assert deepest(film, scene) < 0.15
    moving = Picture.of(film).moving(int(film.arm.argmin()))
    shown = [shape.points for shape in moving if shape.look.get("what") == "ground"]
    assert bool(shown) is carried  # else it is drawn once
    low, high = np.array([0.0, 0.0]), np.array(Picture.of(film).size)
    assert all((low <= each).all() and (each <= high).all() for each in shown)


def test_it_tips_as_fast_as_it_came_down():
    for tips in ("moving", "rest"):
        scene = with_cavity(tips=tips)
        film = film_of(arm_end_of(scene), start=(17.7, 2), throws=1)
        tipping = np.flatnonzero([film.captions[k].startswith("It tips") for k in film.caption])
        shown = film.times[tipping[-1]] - film.times[tipping[0] - 1]
        beyond = np.array([film.rests[-1].x - 20.0])
        assert shown == pytest.approx(float(tipping_times(scene, 2)(beyond)[0]), rel=1e-4)


def test_a_part_that_lands_where_the_next_throw_acts_beyond_the_end_is_said_to_be_not_simulated():
    end = arm_end_of(with_cavity())
    x = np.linspace(12.0, 19.0, 2000)
    to, on, _, _ = advance(end.scene.map, x, np.full(x.size, 2), 1)
    film = film_of(end, start=(float(x[np.flatnonzero(end.at_edge(to, on))[0]]), 2))
    assert "not simulated" in film.notes[film.note[-1]]
    assert set(film.stage.tolist()) == {-1}  # no controller


def test_a_part_from_which_the_throw_acts_beyond_the_end_is_not_thrown():
    with pytest.raises(AnswerError, match="where throws act beyond the end"):
        film_of(arm_end_of(with_cavity()), start=(19.95, 2))


def test_a_standing_cavity_is_one_of_assembly(capfd):
    assert "--assemble" in refusal(capfd, "animate paper-triangle --feed --standing")
    with pytest.raises(LimitsetsError, match=r"effects\.contact"):
        ls.assemble("paper-triangle", "paper-quadrilateral", carried=False, trials=1)


# ----------------------------------------------------------------
# Films of throws: what is shown at the release, the impact and the rest are the map's numbers; nothing sinks in.


ROLLING = {"effects": {"landing": True, "roll": True}}
SCATTER = {"speed": "0.5 %", "landing": "0.05 in"}
SCATTERED = {"effects": {"spread": "bounded"}, "world": {"scatter": SCATTER}}
DRIVEN = {"effects": {"drive": True}, "world": {"stroke": "8 deg"}}
SLIPPING = {"effects": {"slip": True}, "world": {"friction": 0.6}}


def scene_of(name, **more):
    return ls.load({**ls.load(name).as_dict(), **more})


def frames_of(film, word):
    return [mark.frame for mark in film.marks if mark.word == word]


def heights(film, frame):
    """Of the corners over the arm, in the frame of the arm, which turns about the joint."""
    corners = film.polygon(frame)
    angle = -film.arm[frame]
    return math.sin(angle) * corners[:, 0] + math.cos(angle) * corners[:, 1] - film.surface[0]


@pytest.mark.parametrize("name", ["paper-designed", "paper-initial", "paper-designed-small-angle"])
def test_release_impact_and_rest_are_those_of_the_map(name):
    """In the exact model by an independent formula: R - (h + d) phi - a cos phi + d sin phi is the stuck vertex."""
    scene = ls.load(name)
    film = film_of(scene, start=(15.0, 2), throws=3)
    path = trace(scene.map, 15.0, 2, 3)
    a, d, h = scene.sides.a, scene.sides.d, scene.surface_height
    frames = zip(*(frames_of(film, word) for word in ("thrown", "impact", "rest")), strict=True)
    for k, (released, struck, rested) in enumerate(frames):
        x, side, phi = path.x[k], path.side[k], path.phi[k]
        assert film.arm[released] == film.arm[struck] == film.arm[rested] == 0.0
        assert film.poses[released, 0, :2] == pytest.approx([x, h + d[side]], abs=1e-9)
        assert film.poses[struck, 0, 2] - film.poses[released, 0, 2] == pytest.approx(phi, abs=1e-12)
        left = -side % 3
        corner = film.polygon(struck)[left]
        at = x - h * phi - a[side]
        if scene.flight == "exact":
            at = x - (h + d[side]) * phi - a[side] * math.cos(phi) + d[side] * math.sin(phi)
        assert corner == pytest.approx([at, h], abs=1e-9)
        after, on = path.x[k + 1], path.side[k + 1]
        assert film.poses[rested, 0, :2] == pytest.approx([after, h + d[on]], abs=1e-9)
        bottom = film.polygon(rested)[[-on % 3, (1 - on) % 3]]
        assert bottom[:, 1] == pytest.approx([h, h], abs=1e-9)
        assert bottom[0, 0] == pytest.approx(after - a[on], abs=1e-9)
        assert film.rests[k].x == after
        assert film.rests[k].side == on


@pytest.mark.parametrize("name", ["paper-designed", "paper-initial", "paper-initial-small-angle"])
def test_no_corner_is_below_the_arm_in_any_frame(name):
    film = film_of(name, throws=6)
    assert min(heights(film, k).min() for k in range(film.frames)) > -1e-9


def test_a_part_lies_on_the_arm_while_that_swings():
    film = film_of("paper-designed", start=(15.0, 2), throws=1)
    released = frames_of(film, "thrown")[0]
    assert film.arm.min() == pytest.approx(-math.radians(12.0))
    for k in range(released + 1):
        assert sorted(heights(film, k))[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    # constant acceleration from rest: the angle to go falls as 1 - share^2
    swing = film.arm[np.argmin(film.arm) : released + 1] / film.arm.min()
    share = np.linspace(0.0, 1.0, swing.size)
    assert swing == pytest.approx(1.0 - share**2, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "more", "starts"),
    [
        ("paper-initial", ROLLING, [(19.5, 1), (27.0, 0), (24.0, 1)]),
        ("paper-designed", SCATTERED, [(15.0, 2), (19.0, 0)]),
        pytest.param("paper-designed", DRIVEN, [(15.0, 2), (19.0, 0)], marks=pytest.mark.sweep),
        pytest.param("paper-designed", SLIPPING, [(15.0, 2), (19.0, 0)], marks=pytest.mark.sweep),
    ],
)
def test_effects_join_without_a_jump_and_end_where_the_map_says(name, more, starts):
    scene = scene_of(name, **more)
    body, share = about_centre(scene), np.linspace(0.0, 1.0, 31)
    for x, side in starts:
        for throw in throws_of(scene, trace(scene.map, x, side, 5)):
            moves = motion(scene, throw)
            flight, turning = moves.flight(share), moves.turning.pose(share)
            assert moves.struck[1] == pytest.approx(scene.surface_height, abs=1e-9)
            assert flight[-1] == pytest.approx(turning[0], abs=1e-9)
            at_rest = throw.after, scene.surface_height + scene.sides.d[throw.side_after]
            assert turning[-1, :2] == pytest.approx(at_rest, abs=1e-9)
            lowest = min(float((turned(body, pose[2])[:, 1] + pose[1]).min()) for pose in (*flight, *turning))
            assert lowest > scene.surface_height - 1e-9
            assert moves.turning.drawn == ("slip" in more["effects"])


def test_a_roll_shows_the_vertex_it_rolls_on_over():
    scene = scene_of("paper-initial", **ROLLING)
    (throw,) = throws_of(scene, trace(scene.map, 19.5, 1, 1))
    assert throw.word == "roll"
    assert len(motion(scene, throw).turning.faces) >= 1
    film = film_of(scene, start=(19.5, 1), throws=1)
    assert frames_of(film, "roll")


def test_the_turn_about_the_vertex_conserves_energy():
    """(1/2) M omega^2 + kappa H, with M = rho^2 + ell^2 about the struck vertex (docs/model.md)."""
    scene = ls.load("paper-designed")
    (throw,) = throws_of(scene, trace(scene.map, 21.0, 2, 1))
    moves = motion(scene, throw)
    share = np.linspace(0.0, 1.0, 2001)
    poses = moves.turning.pose(share)
    rate = np.gradient(poses[:, 2], share * moves.turning.time, edge_order=2)
    arm = poses[:, :2] - np.array(moves.struck)
    inertia = scene.radius_of_gyration**2 + (arm**2).sum(axis=1)
    energy = 0.5 * inertia * rate**2 + scene.kappa * arm[:, 1]
    assert energy == pytest.approx(energy[0], rel=1e-4)


def test_times_are_seconds_by_gravity_and_else_in_1_over_w():
    """phi / w with w = sqrt(g / kappa), the time of flight; without gravity w is 1."""
    scene = ls.load("paper-designed")
    tree = scene.as_dict()
    del tree["gravity"]
    for each, rate, clock in ((scene, math.sqrt(193.045 / 25.3778518), "s"), (ls.load(tree), 1.0, "1/w")):
        film = film_of(each, start=(15.0, 2), throws=1, fps=100.0, slow=20.0)
        released, struck = frames_of(film, "thrown")[0], frames_of(film, "impact")[0]
        phi = trace(each.map, 15.0, 2, 1).phi[0]
        assert film.clock == clock
        assert film.times[struck] - film.times[released] == pytest.approx(phi / rate, rel=1e-9)
        assert np.all(np.diff(film.times) > 0.0)


def test_slow_motion_makes_more_frames_of_the_same_times():
    short, long = (film_of("paper-designed", start=(15.0, 2), throws=1, slow=slow) for slow in (2.0, 8.0))
    flown = [frames_of(film, "impact")[0] - frames_of(film, "thrown")[0] for film in (short, long)]
    assert flown[1] == pytest.approx(4 * flown[0], abs=4)


def test_lanes_show_the_limit_set_and_the_part_over_its_place():
    film = film_of("paper-designed", throws=3)
    ((lo, hi),) = film.lanes.sets[0][2]
    assert (lo, hi) == pytest.approx((8.9140259080455, 23.383151921158), abs=1e-6)  # docs: from 40 digits
    assert film.lanes.critical[2] == pytest.approx((20.0,), abs=1e-5)
    assert film.lanes.goal == (20.0, 2)
    for rest in film.rests:
        assert film.position[rest.frame] == pytest.approx([rest.x, rest.side])
        assert any(lo <= rest.x <= hi for lo, hi in film.lanes.sets[0][rest.side])
