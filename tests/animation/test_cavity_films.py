"""The cavity in films: it turns with the arm, and no part is swept through it."""

import math

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError, LimitsetsError
from limitsets.cell.feeding.falling import arm_end_of, tipping_times
from limitsets.face.animation import film_of
from limitsets.face.animation.fed import film_of_recording
from limitsets.face.animation.film import Asked
from limitsets.face.animation.picture import Picture
from limitsets.feeder.engine import Crowd
from limitsets.feeder.engine.crowd import depth_of_overlap
from limitsets.feeder.engine.member import ground_of
from tests.cli.command import run
from tests.feeding.scenes import with_cavity

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
    shown = [
        shape.points
        for shape in Picture.of(film).moving(int(film.arm.argmin()))
        if shape.look.get("what") == "ground"
    ]
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


def test_a_part_from_which_the_throw_acts_beyond_the_end_is_not_thrown():
    with pytest.raises(AnswerError, match="where throws act beyond the end"):
        film_of(arm_end_of(with_cavity()), start=(19.95, 2))


def test_a_standing_cavity_is_one_of_assembly(capfd):
    code, _, err = run(capfd, "animate", "paper-triangle", "--feed", "--standing")
    assert code == 2
    assert "--assemble" in err
    with pytest.raises(LimitsetsError, match=r"effects\.contact"):
        ls.assemble("paper-triangle", "paper-quadrilateral", carried=False, trials=1)
