"""The page without a browser: what a visitor does, and what is shown then."""

import math
import subprocess
import sys
import time
from typing import NamedTuple

import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError, LimitsetsError, SceneError
from limitsets.face.explorer.atlas_page import Background
from tests.maps_of_tests import TwoState

LEAD = """
name = "lead"
[part]
vertices = [["0 mm", "0 mm"], ["30 mm", "0 mm"], ["0 mm", "20 mm"]]
mass = { plate_density = "3 kg/m^2", points = [{ x = "20 mm", y = "4 mm", mass = "8 g" }] }
[arm]
length = "150 mm"
surface_height = "-1 mm"
[throw]
kappa = "90 mm"
"""


@pytest.fixture
def page():
    made = ls.explore("paper-designed").page()
    yield made
    made.close()


def shown(picture, called):
    """Give what a layer of a picture shows."""
    return picture.canvas.layer(called).data


def sets_of(page):
    return list(shown(page.lanes, "limit sets")["right"])


def test_a_slider_moves_the_picture_and_the_threshold(page):
    before, threshold = sets_of(page), page._found.threshold
    page.sliders.put({"throw.speed": 150.0})
    page.beat()
    assert sets_of(page) != before
    assert page._found.threshold != threshold
    assert page.scene.kappa == pytest.approx(28.166, abs=1e-3)  # gravity over the speed squared
    assert "Estimated" in page._estimated.object


@pytest.mark.parametrize(
    "values", [{"part.mass.center.above": 50.0}, {"throw.speed": 0.0}, {"gravity.tilt": 400.0}]
)
def test_a_bad_value_is_one_line_and_the_last_good_picture_stays(page, values):
    before = sets_of(page)
    page.sliders.put(values)
    page.beat()
    assert page._error.object.count('role="alert" class="wrong"') == 1
    assert "\n" not in page._error.object
    assert sets_of(page) == before
    page.sliders.put({knob.name: knob.value for knob in page.sliders.knobs})
    page.beat()
    assert "wrong" not in page._error.object


def test_a_slider_moves_the_goal_and_what_is_asked_of_it(page, monkeypatch):
    """Paper-designed has other sides up to 19.753 in: beyond 19 in its goal fails."""
    threshold, asked = page._found.threshold, []
    monkeypatch.setattr(page._proofs, "ask", asked.append)
    page._wrote = -1.0  # text is written a few times a second
    page.sliders.put({"goal.x": 19.0})
    page.beat()
    assert shown(page.lanes, "goal")["x"] == [19.0, 19.0]
    assert shown(page.lanes, "goal in words")["words"] == [" goal: side 2 from 19 in on "]
    assert page._found.threshold == threshold
    assert f"does not hold; threshold x = {threshold:.4f} in" in page._estimated.object
    page._ask()
    assert ls.load(asked[0]["scene"]).goal == type(page.scene.goal)(19.0, 2)
    assert "goal.x" not in asked[0]["margins"]  # X is no quantity that deviates
    assert "arm.length" in asked[0]["margins"]
    assert "goal.x" not in page.atlas._x.options.values()


def test_the_arm_is_as_wide_as_the_lanes_also_where_its_length_moves(page):
    for length in (28.0, 33.0):
        page.sliders.put({"arm.length": length})
        page.beat()
        lanes, arm = page.lanes.canvas.view, page.arm.canvas.view
        assert arm["x"] == lanes["x"]
        assert arm["margins"][:2] == lanes["margins"][:2]
        end = max(shown(page.arm, "arm")["x"])
        assert end == pytest.approx(length, abs=0.01)
        page.throw(length - 1e-6, 0)
        page.arm.rest(page.scene, length - 1e-6, 0, lanes["x"])
        assert max(shown(page.arm, "part")["x"]) < lanes["x"][1]  # a part at the end of the arm is in sight
        low, high = arm["y"]
        assert arm["tall"] == pytest.approx(
            (high - low) / (lanes["x"][1] - lanes["x"][0])
        )  # one scale on both axes


def test_the_progress_of_a_proof_stands_until_the_next_answer(page):
    step = {"step": "margin of throw.speed, 40 %", "number": 2, "of": 6}
    page._tell([{"claim": "goal", "verdict": "proved", "reason": "", "starts": "every", "share": 1.0}, step])
    said = page._proved.object
    assert '<progress value="1" max="6"></progress> margin of speed, 40 % (2 of 6)' in said
    page._tell([step | {"step": "margin of throw.speed, 50 %"}])
    assert page._proved.object.count("<progress") == 1
    page._tell([step, {"margin": "throw.speed", "proved": "0.7 %", "refuted": None}])
    assert "<progress" not in page._proved.object
    page._tell([step, {"done": True}])
    assert "<progress" not in page._proved.object
    assert "also compiles" not in page._proved.object
    assert page._proved.object.count("proved</b>, for every start") == 1


def test_what_is_typed_moves_the_slider(page):
    page.sliders._fields["throw.speed"].value = "2.7 rad/s"
    page.beat()
    assert page.scene.value("throw.speed") == pytest.approx(2.7)
    page.sliders._fields["throw.speed"].value = "fast"
    assert "wrong" in page._error.object
    assert page.scene.value("throw.speed") == pytest.approx(2.7)


def test_the_mark_in_the_part_moves_the_centre_of_mass(page):
    hand, (x, y) = page.part.canvas._handle_msg, page.scene.centre
    hand({"what": "grasp", "x": x + 3.0, "y": y})  # beside the mark
    hand({"what": "drag", "x": 2.0, "y": 1.5})
    page.beat()
    assert page.scene.centre == (x, y)
    hand({"what": "grasp", "x": x, "y": y})
    hand({"what": "drag", "x": 2.0, "y": 1.5})
    page.beat()
    assert page.scene.centre == pytest.approx((2.0, 1.5))
    hand({"what": "drag", "x": -9.0, "y": 1.5})  # out of the part: the mark stays
    page.beat()
    assert "wrong" in page._error.object
    assert shown(page.part, "centre of mass")["x"] == [pytest.approx(2.0)]
    hand({"what": "release", "x": 2.0, "y": 1.5})
    hand({"what": "drag", "x": 2.5, "y": 1.5})
    page.beat()
    assert shown(page.part, "centre of mass")["x"] == [pytest.approx(2.0)]


def test_corners_that_are_clicked_become_a_part(page):
    page.opening._draw.value = True
    for x, y in ((0.0, 0.0), (6.0, 0.0), (6.0, 3.0), (0.0, 3.0)):
        page.opening.corner(x, y)
    assert shown(page.part, "corners")["x"] == [0.0, 6.0, 6.0, 0.0, 0.0]
    page.opening._draw.value = False
    page.beat()
    assert page.scene.centre == pytest.approx((3.0, 1.5))
    assert len(shown(page.lanes, "basins")["left"]) >= 4
    page.opening._draw.value = True
    for x, y in ((0.0, 0.0), (4.0, 0.0), (1.0, 1.0), (0.0, 4.0)):  # it turns inward
        page.opening.corner(x, y)
    page.opening._draw.value = False
    assert "wrong" in page._error.object
    assert page.scene.centre == pytest.approx((3.0, 1.5))


def test_throws_are_shown_from_a_start_and_end_where_the_map_says(page):
    near = dict(page.arm.canvas.view)
    page.throw(21.0, 2)
    assert page.arm.canvas.view["y"][1] > near["y"][1]  # the flight is in sight
    film = page._film
    assert film.rests[0].side == 0
    assert film.rests[0].x == pytest.approx(float(ls.orbit(page.scene.map, 21.0, 2, 1).x[1]))
    page._began -= 1000.0
    page.beat()
    assert page._film is None
    last = film.rests[-1]
    assert shown(page.lanes, "start")["x"] == [pytest.approx(last.x)]
    assert page.arm.canvas.view == near
    page.throw(-5.0, 0)
    assert "wrong" in page._error.object


def test_throws_outside_the_model_are_said(page):
    assert page._careful.object == ""
    page._wrote = -1.0  # text is written a few times a second
    page.sliders.put({"throw.speed": 3000.0})  # no start lands within a full turn
    page.beat()
    assert "careful: from 100 % of the starts" in page._careful.object


def test_throws_of_the_limit_set_that_land_on_another_vertex_are_said(page):
    assert page._careful.object == ""
    page._wrote = -1.0
    page.sliders.put({"throw.speed": 170.0})
    page.beat()
    _, reach = page._found.sets[0][0][-1]
    assert ls.analysis.other_vertex_first(page.scene)[0][0][0] < reach  # on side 0 alone
    careful = "careful: of some throws of the limit set from side 0 another vertex lands first"
    assert careful in page._careful.object


def test_added_masses_are_drawn_where_they_are_and_have_sliders(page):
    page.open(ls.load(LEAD))
    page.beat()
    masses, words = shown(page.part, "added masses"), shown(page.part, "weights")["words"]
    assert (masses["x"], masses["y"], words) == ([20.0], [4.0], ["8 g"])
    page.sliders.put({"part.mass.points[0].mass": 16.0})
    page.beat()
    assert shown(page.part, "weights")["words"] == ["16 g"]
    plate, lead = 3.0 * 0.03 * 0.02 / 2, 0.016  # kg; the plate's centroid is at (10, 20/3) mm
    x = (plate * 10.0 + lead * 20.0) / (plate + lead)
    assert page.scene.centre[0] == pytest.approx(x)
    page.sliders.put({"part.mass.points[0].x": 10.0})
    page.beat()
    assert shown(page.part, "added masses")["x"] == [10.0]


def test_what_a_browser_sends_as_a_place_may_be_anything(page):
    places = {"what": "tap", "x": "1", "y": 2}, {"what": "tap", "x": 1.0, "y": math.inf}
    for sent in (None, "tap", {}, *places):
        page.lanes.canvas._handle_msg(sent)
    assert page._film is None
    page.lanes.canvas._handle_msg({"what": "tap", "x": 21.0, "y": -2.0})
    assert page._film is not None


def test_a_scene_from_outside_is_opened_and_a_path_is_not(page, tmp_path):
    other = ls.load("paper-initial")
    page.opening._read(ls.dump(other))
    page.beat()
    assert page.scene == other
    ls.dump(ls.load("paper-triangle"), tmp_path / "mine.toml")
    page.opening._read(str(tmp_path / "mine.toml"))
    page.beat()
    assert "wrong" in page._error.object
    assert page.scene == other
    page.opening._sent(b"\xff\xfe\x00 = not a scene")
    assert "wrong" in page._error.object


def test_what_is_wrong_is_text_and_no_markup(page):
    page.opening._read("name = '<img src=x onerror=alert(1)>'\n")
    assert "<img" not in page._error.object
    assert "&lt;img" in page._error.object


def test_two_pages_do_not_know_of_each_other():
    explorer = ls.explore("paper-designed")
    one, other = explorer.page(), explorer.page()
    before = sets_of(other)
    one.sliders.put({"throw.speed": 150.0})
    one.beat()
    other.beat()
    assert sets_of(other) == before
    assert other.scene == ls.load("paper-designed")
    one.close()
    other.close()


def test_what_is_saved_is_the_scene_that_is_shown(page):
    page.sliders.put({"arm.surface_height": -0.25})
    page.beat()
    saved = page._toml.callback().read()
    assert ls.load(saved) == page.scene
    assert page.scene.surface_height == -0.25
    assert page._svg().read(200).startswith(b"<?xml")


@pytest.mark.sweep
def test_proofs_come_once_the_sliders_rest(page):
    deadline = time.monotonic() + 300
    while "<b>proved</b>" not in page._proved.object and time.monotonic() < deadline:
        page.beat()
        time.sleep(0.02)
    assert "proved" in page._proved.object
    page.sliders.put({"throw.speed": 150.0})
    page.beat()
    assert "<b>proved</b>" not in page._proved.object  # what was proved was said of another scene


def test_a_proof_that_has_said_nothing_yet_ends_when_a_slider_moves(page):
    """Left running it takes a core from the pictures, and its answers would stand beside another scene."""
    page._ask()
    assert "being computed" in page._proved.object
    page.sliders.put({"throw.speed": 150.0})
    page.beat()
    assert "waits until the sliders rest" in page._proved.object
    assert page._proofs.wait() == []


def test_a_process_whose_answer_is_cut_short_is_ended_and_waited_for(monkeypatch):
    started, cut = subprocess.Popen, "import time; print('{', flush=True); time.sleep(60)"
    monkeypatch.setattr(subprocess, "Popen", lambda _, **how: started([sys.executable, "-c", cut], **how))
    asked = Background()
    asked.ask({})
    assert asked.wait() == [{"done": True}]
    assert asked._process.returncode is not None


def test_a_picture_is_sent_when_anything_of_it_has_changed_and_not_otherwise(page):
    page.beat()
    canvas = page.lanes.canvas
    canvas.drawn = "seen"
    canvas.send()
    assert canvas.drawn == "seen"
    changes = [
        lambda: page.lanes.mark(10.0, 1),
        lambda: setattr(canvas, "heading", "another"),
        lambda: canvas.view.update(x=[0.0, 1.0]),
    ]
    for change in changes:
        change()
        canvas.drawn = "seen"
        canvas.send()
        assert canvas.drawn != "seen"


def test_a_map_of_two_dimensions_is_its_points_and_a_bad_parameter_a_line():
    page = ls.explore(ls.maps.Henon()).page()
    assert len(shown(page.points, "points")["x"]) > 1000
    page.sliders.put({"a": 5.0})  # all of it leaves
    page.beat()
    assert len(shown(page.points, "points")["x"]) == 0
    page._wrote = -1.0  # text is written a few times a second
    page.beat()
    assert "0 of 8 orbits" in page._said.object
    assert "8 of 8 orbits pass x_0 = -" in page._said.object
    page.sliders._typed(page.sliders.knobs[0], "much")
    assert "wrong" in page._error.object


class Spot(NamedTuple):
    at: float


def spot(params, x, side):  # the fixed point is (at, -at)
    return (0.5 * (x[0] + params.at), 0.5 * (x[1] - params.at)), side, 0


class Wide(NamedTuple):
    a: float


def wide(params, x, side):  # nearly |x_0| = |a|: its cycle of two
    return (-params.a if x[0] > 0 else params.a, 0.5 * x[1]), side, 0


def test_the_window_follows_the_points_of_a_plane_map():
    ls.register(Spot, image=spot, dimension=2)
    page = ls.explore(Spot(1.0), domain=[(-2, 2), (-2, 2)]).page()
    for at, there in ((1.0, 0), (1.01, 0), (7.0, 1), (7.02, 1), (-40.0, 2)):
        page.sliders.put({"at": at})
        page.beat()
        (x0, x1), (y0, y1) = page.points.canvas.view["x"], page.points.canvas.view["y"]
        assert x0 < at < x1
        assert y0 < -at < y1
        if there == 0:
            first = x0, x1
            continue
        kept, first = first, (x0, x1)
        assert (kept == first) == (at == 7.02)  # a small move does not move the window


def test_the_window_shrinks_to_points_that_would_be_lost_in_it():
    ls.register(Wide, image=wide, dimension=2)
    page = ls.explore(Wide(100.0), domain=[(-2, 2), (-2, 2)]).page()
    assert page.points.canvas.view["x"] == [-200.0, 200.0]
    for a, shown in ((60.0, 200.0), (20.0, 40.0)):
        page.sliders.put({"a": a})
        page.beat()
        assert page.points.canvas.view["x"] == [-shown, shown]


def test_a_cycle_is_drawn_so_that_it_is_seen():
    page = ls.explore(ls.maps.Henon(0.3, 0.3)).page()
    x = ((0.3 - 1) + math.sqrt(0.49 + 4 * 0.3)) / (2 * 0.3)  # Henon's fixed point
    assert shown(page.points, "few points")["x"] == [pytest.approx(x)]
    page.sliders.put({"a": 1.4})
    page.beat()
    assert shown(page.points, "few points")["x"] == []


def test_a_map_of_one_dimension_has_lanes():
    page = ls.explore(ls.maps.Logistic(3.9)).page()
    assert shown(page.lanes, "limit sets")["right"] == [pytest.approx(0.975)]


def test_what_cannot_be_explored_is_refused():
    class Alien(tuple):
        __slots__ = ()

    for about, options, error, words in (
        (Alien(), {}, LimitsetsError, None),
        ("paper-designed", {"domain": [(0, 1)]}, AnswerError, "none beside a scene"),
        (TwoState(), {}, AnswerError, r"the domain of TwoState .*pass domain=\[\(lo, hi\)"),
        ("no-such-scene", {}, SceneError, None),
        ("paper-designed", {"atlas": "/nowhere"}, LimitsetsError, "a folder that limitsets atlas wrote"),
    ):
        with pytest.raises(error, match=words):
            ls.explore(about, **options)


@pytest.mark.sweep
def test_a_stored_atlas_is_shown_and_a_point_of_it_opened(tmp_path):
    axes = "throw.speed=150 deg/s:160 deg/s:3", "arm.surface_height=-0.4 in:-0.2 in:3"
    ls.atlas("paper-designed", *axes, store=tmp_path / "a.zarr")
    page = ls.explore("paper-designed", atlas=tmp_path / "a.zarr").page()
    assert page.atlas._canvas.visible
    assert page.atlas._canvas.view["margins"][1] == page.lanes.canvas.view["margins"][1]  # both end there
    assert len(page.atlas._canvas.layer("classes").data["left"]) == 9
    page.atlas._canvas._handle_msg({"what": "tap", "x": 151.0, "y": -0.29})
    page.beat()
    assert math.degrees(page.scene.value("throw.speed")) == pytest.approx(150.0)
    assert page.scene.surface_height == pytest.approx(-0.3)
    steps = ("step", 1.0, 0.0), ("step", 1.0, 1.0), ("step", 1.0, 0.0), ("enter", 0.0, 0.0)  # to the corner
    for what, x, y in steps:
        page.atlas._canvas._handle_msg({"what": what, "x": x, "y": y})
    page.beat()
    assert math.degrees(page.scene.value("throw.speed")) == pytest.approx(160.0)
    assert page.scene.surface_height == pytest.approx(-0.2)
    page.close()


def test_the_address_is_printed(monkeypatch, capsys):
    monkeypatch.setattr(
        "limitsets.face.explorer.visits.serve", lambda page, title, ready, **_: ready("http://127.0.0.1:7")
    )
    ls.explore(ls.maps.Henon()).show(show=False)
    assert capsys.readouterr().out == "explorer: http://127.0.0.1:7 (Ctrl-C ends it)\n"


def test_any_other_address_needs_the_names_of_who_may_come():
    with pytest.raises(LimitsetsError, match="allowed origins"):
        ls.explore(ls.maps.Henon()).show(address="0.0.0.0", show=False)
