"""Parts in contact, in the engine: seats, order, what is counted, and films."""

import math

import numpy as np
import pytest

import limitsets as ls
from limitsets.cell.assembly.assembly_run import OUTCOMES
from limitsets.cell.assembly.pairing import are_apart, pair_of
from limitsets.cell.assembly.trials import Question, _Watched, crowd_of, push
from limitsets.feeder.engine.crowd import depth_of_overlap
from limitsets.feeder.engine.depression import seat_of
from limitsets.feeder.engine.member import Rest
from tests.assembly.pairs import NOISE, pair
from tests.feeding.scenes import with_cavity

pytest.importorskip("pymunk")
TRIALS = 24


@pytest.fixture(scope="module")
def joined():
    return pair_of(*pair(contact=True), NOISE)


@pytest.fixture(scope="module")
def found():
    return ls.assemble(*pair(contact=True), NOISE, trials=TRIALS, seed=1)


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


def test_trials_end_in_words_and_start_apart(found, joined):
    assert sum(found.counts.values()) == TRIALS
    assert set(found.counts) == set(OUTCOMES)
    assert found.joint is None
    assert found.overlaps is None
    from limitsets.cell.assembly.pairing import Draws

    for number in range(200):
        assert are_apart(joined, Draws(joined, 1, number).starts(apart=True))


def test_a_trial_depends_on_its_number_alone(found, joined):
    for number in (3, 0):
        again, _ = push(joined, 1, number)
        assert again.outcome == found.rows[number]["outcome"]
        assert list(again.throws) == list(found.rows[number]["throws"])


def test_a_film_ends_with_the_parts_in_the_cavity(found):
    number = next(k for k, row in enumerate(found.rows) if None not in row["entered"])
    film = found.film(number)
    assert film.times.size > 5
    assert (np.diff(film.times) >= 0.0).all()
    assert (film.poses[-1, :, 0] > 20.0).all()
    assert film.poses[-1, :, 1].max() < 2.0


@pytest.mark.sweep
def test_the_figure_has_a_case_of_each_outcome(found, tmp_path):
    figure = ls.plot.assembly(found)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert sum("(trial" in title for title in titles) == sum(count > 0 for count in found.counts.values())
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == [scene.name for scene in found.pair.scenes]  # which of the parts is which
    figure.savefig(tmp_path / "assembly.png")
