"""What the explorer computes, and the canvas it is drawn on."""

import base64
import io
import itertools
import json
import math
import sys

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import LimitsetsError, SceneError
from limitsets.face.explorer.answers import estimate_words, proof_words
from limitsets.face.explorer.canvas import Canvas, Layer
from limitsets.face.explorer.estimates import (
    GOAL_X,
    centre_at,
    estimate,
    estimate_of_map,
    knobs_of,
    knobs_of_map,
    map_with,
    points_of_map,
    scene_with,
)
from limitsets.face.explorer.work import MOST_BYTES, MOST_SIDES, answers, main, scene_from, with_outline
from limitsets.systems.cells import as_domain
from tests.plates import left_by_some

# ----------------------------------------------------------------
# What follows the sliders, without a page: expected values are the paper's, geometry's, or those of proofs.


PAPER = ls.load("paper-designed")


def test_critical_points_are_those_that_the_paper_designed():
    assert [round(x, 4) for _, _, x in estimate(PAPER).critical] == [10.0, 10.0, 20.0]


def test_the_ends_are_those_that_end_points_are_proved_for():
    found = estimate(PAPER)
    limit = ls.limit_set(ls.transitions(PAPER.map, ls.grid(PAPER.domain, cells=4096)))
    assert found.sharp
    for side, parts in limit.extents.items():
        assert np.allclose(found.sets[0][side], parts, rtol=0, atol=1e-7)
    # side 0 reaches farthest, but for side 2
    assert found.threshold == pytest.approx(limit.extents[0][0][1], abs=1e-7)


def test_of_a_goal_it_says_for_which_starts():
    """It said "holds" above and a cross below, beside "proved for some starts only": 3.5 % of the starts leave."""
    scene = ls.load(left_by_some())
    assert "holds of the limit set, to which 96." in estimate_words(estimate(scene), scene.goal, scene.unit)
    lines = list(answers({"what": "proof", "scene": ls.dump(scene), "margins": []}))
    assert [line["verdict"] for line in lines] == ["refuted", "proved-on-cells"]
    share = math.floor(1000 * lines[1]["share"]) / 10
    assert 96.0 < share < 97.0
    said = proof_words(lines, (), "").split("<tr>")[2]
    assert f"&#9680; <b>proved</b>, for {share:g} % of all starts" in said
    assert "&#10007;" not in said
    first = estimate_words(estimate(PAPER), PAPER.goal, PAPER.unit)
    assert "<td>holds of the limit set; threshold" in first
    lines = list(answers({"what": "proof", "scene": ls.dump(PAPER), "margins": []}))
    said = proof_words(lines, (), "", "of the minimal model")
    assert "&#10003; <b>proved</b>, for every start</td>" in said
    assert "of the minimal model</p>" in said  # the last claim's starts once stood in its place


def test_a_margin_says_up_to_where_the_goal_is_proved_and_from_where_it_fails():
    """At a speed 0.733 % less parts of paper-designed get beyond x = 20."""
    *_, last = answers({"what": "proof", "scene": ls.dump(PAPER), "margins": ["throw.speed"]})
    proved, refuted = (last[word].split() for word in ("proved", "refuted"))
    assert float(proved[0]) < 0.7335 < float(refuted[0]) < 0.75
    assert last["margin"] == "throw.speed"
    assert proved[1] == refuted[1] == "%"


def test_a_goal_that_is_proved_of_nothing_says_so():
    """The limit set of paper-designed ends at 23.383 in."""
    goal = {"oriented_beyond": {"x": "25 in", "side": 2}}
    scene = ls.load({**ls.load("paper-designed").as_dict(), "goal": goal})
    lines = list(answers({"what": "proof", "scene": ls.dump(scene), "margins": []}))
    said = proof_words(lines, (), "")
    assert "<b>proved</b>" in said
    assert "before x = 25: the goal asks nothing of them" in said


def test_a_cycle_within_joined_cells_is_its_points():
    """At r = 3.843 cells of 1/2048 join the six points of the logistic map's cycle to three intervals."""
    x = 0.5
    for _ in range(100_000):
        x = 3.843 * x * (1.0 - x)
    cycle = []
    for _ in range(6):
        x = 3.843 * x * (1.0 - x)
        cycle.append(x)
    found = estimate_of_map(ls.maps.Logistic(3.843), ls.grid([(0.0, 1.0)]).domain)
    lo, hi = zip(*found.sets[0][0], strict=True)
    assert lo == hi
    assert lo == pytest.approx(sorted(cycle), abs=1e-9)
    assert "a cycle of period 6" in estimate_words(found, None, "")


def test_bands_that_cells_join_are_told():
    """The logistic map has two bands up to r = 3.6785735: between them a gap narrower than a cell is left at 3.6785."""
    found = estimate_of_map(ls.maps.Logistic(3.678), ls.grid([(0.0, 1.0)]).domain)
    assert found.bands == (2,)
    assert len(found.sets[0][0]) == 1
    assert "2 intervals, which these cells join" in estimate_words(found, None, "")


def test_shares_of_the_starts_are_all_of_them():
    found = estimate(ls.load("paper-initial"))
    assert sum(share for _, share in found.shares) == pytest.approx(1.0)
    for side, lo, hi in zip(range(3), found.lo, found.hi, strict=True):
        runs = [run for run in found.basins if run[0] == side]
        assert (runs[0][1], runs[-1][2]) == pytest.approx((lo, hi))
        assert all(before[2] == after[1] for before, after in itertools.pairwise(runs))


def test_a_knob_that_is_not_moved_leaves_the_scene_as_it_is_written():
    knobs = knobs_of(PAPER)
    assert scene_with(PAPER, knobs, {knob.name: knob.value for knob in knobs}) == PAPER


def test_twice_the_gravity_at_the_same_speed_doubles_kappa():
    steep = scene_with(PAPER, knobs_of(PAPER), {"gravity.tilt": 90.0})
    assert steep.kappa == pytest.approx(2 * PAPER.kappa, rel=1e-5)  # sin 90 deg over sin 30 deg
    assert math.degrees(steep.value("throw.speed")) == pytest.approx(math.degrees(PAPER.value("throw.speed")))


def test_typed_values_are_read_with_their_units():
    speed = next(knob for knob in knobs_of(PAPER) if knob.name == "throw.speed")
    assert speed.read("1 rad/s") == pytest.approx(180 / math.pi)
    assert speed.read("150") == 150.0
    for wrong in ("fast", "3 kg", "nan", "1e999", ""):
        with pytest.raises(LimitsetsError):
            speed.read(wrong)


def in_other_units():
    """Paper-designed with its arm in mm, X and a height in cm, and its speed in rpm: 1 in is 25.4 mm."""
    tree = PAPER.as_dict()
    tree["arm"] = {"length": "711.2 mm", "surface_height": "-0.508 cm"}
    tree["throw"] = {"speed": "30 rpm"}
    tree["part"]["mass"]["center"]["along"] = "10 cm"
    tree["goal"] = {"oriented_beyond": {"x": "50.8 cm", "side": 2}}
    return ls.load(tree)


def test_each_knob_is_in_the_unit_of_the_file():
    scene = in_other_units()
    knobs = {knob.name: knob for knob in knobs_of(scene)}
    expected = {
        "throw.speed": ("rpm", 30.0, 21.0, 39.0),
        "arm.length": ("mm", 711.2, 497.84, 924.56),
        "arm.surface_height": ("cm", -0.508, -3.556, 3.556),  # 5 % of the arm's length to either side
        "gravity.tilt": ("deg", 30.0001, 5.0, 90.0),
        GOAL_X: ("cm", 50.8, 0.0, 70.4088),  # to 99 % of the arm's length
    }
    for name, (unit, *numbers) in expected.items():
        assert knobs[name].unit == unit
        assert knobs[name][3:] == pytest.approx(numbers, rel=1e-6)
    assert knobs["throw.speed"].read("180 deg/s") == pytest.approx(30.0)
    assert knobs[GOAL_X].read("20 in") == pytest.approx(50.8)
    assert centre_at(scene, *scene.centre)["part.mass.center.along"] == pytest.approx(10.0)  # cm
    moved = scene_with(scene, tuple(knobs.values()), {"throw.speed": 31.0, "arm.surface_height": -1.0})
    assert (moved.text["throw"]["speed"], moved.text["arm"]["surface_height"]) == ("31.0 rpm", "-1.0 cm")
    assert moved.surface_height == pytest.approx(-10.0)  # mm


def test_an_x_moves_alone_and_together_with_an_arm_that_would_be_too_short_for_the_old_one():
    scene = in_other_units()
    moved = scene_with(scene, knobs_of(scene), {GOAL_X: 40.0})
    assert (moved.goal.x, moved.goal.side, moved.arm_length) == (400.0, 2, 711.2)
    moved = scene_with(scene, knobs_of(scene), {GOAL_X: 40.0, "arm.length": 500.0})
    assert (moved.goal.x, moved.arm_length) == (400.0, 500.0)
    with pytest.raises(SceneError, match="below the arm's length, 500 mm"):
        scene_with(scene, knobs_of(scene), {"arm.length": 500.0})


def test_goals_without_an_x_have_no_knob_of_it():
    scene = ls.load(PAPER.as_dict() | {"goal": {"attracts_all": True}})
    assert GOAL_X not in {knob.name for knob in knobs_of(scene)}
    assert (
        knobs_of(ls.load(PAPER.as_dict() | {"goal": {"reaches": {"x": "20 in", "side": 2}}}))[-1].value
        == 20.0
    )


def test_the_process_tells_how_far_it_is(monkeypatch, capsys):
    """A ladder of four grids, from 2048 cells on, and two margins; lines come five times a second at most."""
    question = {"what": "proof", "scene": ls.dump(PAPER), "margins": ["throw.speed", "arm.surface_height"]}
    told = []
    told += answers(question, lambda *step: told.append(step))
    assert told[0] == ("2048 cells a side", 0, 4)
    steps = [each for each in told if isinstance(each, tuple) and each[0].startswith("margin of ")]
    assert {(step.split(",")[0], done, of) for step, done, of in steps} == {
        ("margin of throw.speed", 0, 2),
        ("margin of arm.surface_height", 1, 2),
    }
    monkeypatch.setattr(sys, "stdin", io.StringIO(json.dumps(question | {"margins": []})))
    main()
    first, *lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert first == {"step": "2048 cells a side", "number": 1, "of": 4}
    assert [line["claim"] for line in lines if "claim" in line] == ["attracts-all", "goal"]


def test_a_drawn_rectangle_balances_in_its_middle_whichever_way_it_is_drawn():
    corners = [(1.0, 1.0), (7.0, 1.0), (7.0, 4.0), (1.0, 4.0)]
    for drawn in (corners, corners[::-1]):
        scene = with_outline(PAPER, drawn)
        assert scene.centre == pytest.approx((4.0, 2.5))
        assert scene.radius_of_gyration == pytest.approx(math.sqrt((36 + 9) / 12))
        assert scene.goal == PAPER.goal


def test_a_goal_of_a_side_that_is_not_drawn_is_left_out():
    tree = PAPER.as_dict() | {"goal": {"oriented_beyond": {"x": "20 in", "side": 3}}}
    vertices = [["0 in", "0 in"], ["4 in", "0 in"], ["4 in", "3 in"], ["0 in", "3 in"]]
    center = {"side": 0, "along": "2 in", "above": "1.5 in"}
    tree["part"] = {"vertices": vertices, "mass": {"center": center, "radius_of_gyration": "1.4 in"}}
    assert with_outline(ls.load(tree), [(0, 0), (6, 0), (2, 3)]).goal is None


def test_what_is_no_part_is_refused():
    for corners in ([], [(0, 0), (1, 0)], [(0, 0), (4, 0), (1, 1), (0, 4)], [(0, 0), (1, 1), (2, 2)]):
        with pytest.raises(SceneError):
            with_outline(PAPER, corners)


def test_the_name_of_a_file_is_not_looked_up(tmp_path):
    file = tmp_path / "mine.toml"
    ls.dump(PAPER, file)
    for text in (str(file), "paper-designed", "/etc/passwd", f"file://{file}"):
        with pytest.raises(SceneError):
            scene_from(text)


def test_a_scene_that_names_a_file_or_holds_code_is_refused():
    for line in (
        'atlas = "/etc/passwd"',
        'csv = "../secret.csv"',
        'file = "/etc/passwd"',
        'name = "<script>alert(1)</script>"',
        "name = \"__import__('os').system('true')\"",
        '"!!python/object/apply:os.system" = "true"',
    ):
        with pytest.raises(SceneError):
            scene_from(line + "\n" + ls.dump(PAPER).split("\n", 1)[1])


def test_what_is_too_large_is_refused():
    with pytest.raises(SceneError, match="size of the scene"):
        scene_from("#" * MOST_BYTES + "\n")
    turns = [2 * math.pi * k / (MOST_SIDES + 1) for k in range(MOST_SIDES + 1)]
    with pytest.raises(SceneError, match="number of sides"):
        with_outline(PAPER, [(3 * math.cos(turn), 3 * math.sin(turn)) for turn in turns])


def test_the_logistic_band_is_its_critical_orbit_and_has_no_sides():
    found = estimate_of_map(ls.maps.Logistic(3.9), as_domain([(0, 1)]))
    top = 3.9 / 4  # the image of 1/2
    assert found.sets[0][0] == [pytest.approx((3.9 * top * (1 - top), top), abs=1e-6)]
    assert "; sides" not in estimate_words(found, None, "")
    assert "; sides 0-1-2" in estimate_words(estimate(PAPER), PAPER.goal, PAPER.unit)


def test_points_of_henon_lie_on_a_cycle_where_one_attracts():
    one = ls.maps.Henon(0.3, 0.3)
    x = ((0.3 - 1) + math.sqrt(0.49 + 4 * 0.3)) / (2 * 0.3)  # Henon's fixed point
    points = points_of_map(one, as_domain(ls.maps.domain_of(one))).x
    assert len(points) > 1000
    assert np.allclose(points, (x, 0.3 * x), atol=1e-9)


def test_the_numbers_of_a_map_are_its_knobs():
    knobs = knobs_of_map(ls.maps.Henon())
    assert {knob.name: knob.value for knob in knobs} == {"a": 1.4, "b": 0.3}
    assert map_with(ls.maps.Henon(), {"a": 1.2}) == ls.maps.Henon(1.2, 0.3)
    with pytest.raises(LimitsetsError):
        knobs[0].read("much")


# ----------------------------------------------------------------
# What is sent to the browser to be drawn.


def test_points_beyond_the_picture_are_left_out():
    """The numbers that are sent reach from one end of the picture to the other: beyond, they would come round."""
    layer = Layer("dots", "points")
    layer.data = {"x": [-1.0, 3.0, 6.0, 3.0, 5.0], "y": [0.5, 0.25, 0.5, 1.5, 1.0]}
    canvas = Canvas("map", [layer], 100, x=[1.0, 5.0], y=[0.0, 1.0])
    (sent,) = json.loads(canvas.drawn)["layers"]
    places = np.frombuffer(base64.b64decode(sent["packed"]), "<u2").reshape(-1, 2) / 65535
    assert places == pytest.approx(np.array([[0.5, 0.25], [1.0, 1.0]]), abs=1e-5)
