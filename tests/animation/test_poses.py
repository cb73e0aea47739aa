"""Films of throws: what is shown at the release, the impact and the rest are the map's numbers; nothing sinks in."""

import math

import numpy as np
import pytest

import limitsets as ls
from limitsets.face.animation import film_of
from limitsets.face.plot.throwing import about_centre, motion, throws_of, turned
from limitsets.feeder.thrower import trace

ROLLING = {"effects": {"landing": True, "roll": True}}
SCATTERED = {
    "effects": {"spread": "bounded"},
    "world": {"scatter": {"speed": "0.5 %", "landing": "0.05 in"}},
}
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
    for k, (released, struck, rested) in enumerate(
        zip(*(frames_of(film, word) for word in ("thrown", "impact", "rest")), strict=True)
    ):
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
