"""Margins of several quantities together."""

import csv
import io
import json
from dataclasses import replace
from fractions import Fraction
from itertools import product

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.face.cli.app import main
from limitsets.face.report.robust_pages import robustness_page
from limitsets.feeder.goals import OrientedBeyond, Reaches
from limitsets.parameters.design import robust_design
from limitsets.parameters.margins import brackets, single as finding
from limitsets.parameters.margins.deviations import Tolerance, corners, deviation_scale, worst_corner
from limitsets.parameters.margins.joint import joint_margin, sensitivity_of
from limitsets.parameters.margins.margin_result import Margin
from limitsets.parameters.sheet import sheet_run
from limitsets.proofs.prover.certifying import certify
from limitsets.proofs.prover.query import Query
from tests.one_throw import highest_off, highest_scattered
from tests.plates import plate

# ----------------------------------------------------------------
# The joint margin: against single scenes at all corners, by plain orbits; its certificate; covers of a box.


pytest.importorskip("flint", reason="the checker needs python-flint")
from limitsets.checker.scene import covered  # needs flint

TOLERANCE = {"throw.speed": "1 %", "part.sides[0]": "1 %", "arm.surface_height": "0.02 in"}
GOALS = (OrientedBeyond(20.0, 2), Reaches(20.0, 2))


def scene(tolerance):
    return ls.load(ls.load("paper-designed").as_dict() | {"tolerance": tolerance})


def highest_at(factor, signs):
    """Highest place off side 2 of a long orbit at one corner."""
    base = ls.load("paper-designed")
    speed, side, height = (s * factor for s in signs)
    values = {"throw.kappa": base.kappa / (1 + 0.01 * speed) ** 2, "part.sides[0]": 5.75 * (1 + 0.01 * side)}
    moved = base.with_values(values | {"arm.surface_height": -0.2 + 0.02 * height})
    return highest_off(moved.map, 150_000)


@pytest.fixture(scope="module")
def found():
    return joint_margin(scene(TOLERANCE), GOALS, width=0.35)


def test_the_factor_is_that_of_the_worst_corner(found):
    assert found.closed
    corners = list(product((-1, 1), repeat=3))
    assert max(highest_at(found.proved, signs) for signs in corners) < 20.0
    assert max(highest_at(1.01 * found.refuted, signs) for signs in corners) > 20.0


def test_its_certificates_are_confirmed_and_so_is_the_orbit_that_refutes(found, tmp_path):
    files = found.save(tmp_path)
    names = [file.name.split("tolerance")[1] for file in files]
    assert names == ["-oriented-beyond.proof.zip", "-reaches.proof.zip", ".refuted.zip"]
    for file in files:
        report = ls.recheck(file)
        word = "refuted" if file.name.endswith(".refuted.zip") else "proved"
        assert (report.verdict, report.reason) == (word, ""), file
    assert report.statement[0].startswith("refuted: ")
    stated = ls.recheck(files[0]).parameters["tolerance (fixed but unknown)"]
    assert all(name in stated for name in TOLERANCE)


@pytest.mark.sweep
def test_the_landing_place_differs_at_every_throw():
    one = joint_margin(scene({"throw.speed": "1 %", "landing.x": "0.05 in"}), GOALS[:1], width=0.1)
    assert one.noise.keys() == {"landing.x"}
    assert one.closed
    assert one.refuted < 0.733
    alone = joint_margin(scene({"landing.x": "0.02 in"}), GOALS[:1])
    (landing,) = ls.margin("paper-designed", "landing.x")
    assert 0.02 * alone.proved < landing.refuted
    assert landing.proved < 0.02 * alone.refuted
    # landings that scatter more can lose starts from the middle of the arm: the goal is then one of some cells
    assert not alone.closed
    assert "of the starts only" in alone.reason
    assert abs(0.02 * alone.refuted - landing.refuted) < 0.02 * landing.refuted


def test_by_the_public_name_and_from_the_scene():
    (found,) = ls.margin(scene({"throw.speed": "0.5 %"}), "joint", width=0.05)
    assert (found.quantity, found.reading, found.unit) == ("joint", "tolerance", "")
    assert found.proved < 0.733 / 0.5 < found.refuted
    assert found.to_json()["unit"] is None


# ---------------------------------------------------------------- nine quantities

INCHES = {  # all that is fixed but unknown except the speed: value, and deviation at the factor 1
    "part.sides[0]": (5.75, 0.0575),
    "part.sides[1]": (3.6, 0.036),
    "part.sides[2]": (6.75, 0.0675),
    "part.mass.radius_of_gyration": (1.25, 0.0125),
    "part.mass.center.along": (4.2255778, 0.01),
    "part.mass.center.above": (0.708249, 0.01),
    "arm.surface_height": (-0.2, 0.01),
}
NINE = dict.fromkeys(("throw.speed", *list(INCHES)[:4]), "1 %")
NINE |= dict.fromkeys((*list(INCHES)[4:], "landing.x"), "0.01 in")


def corner(factor, signs):
    """One scene at a corner of the box of all nine quantities, as a map."""
    base = ls.load("paper-designed")
    values = {
        name: value + sign * factor * deviation
        for (name, (value, deviation)), sign in zip(INCHES.items(), signs[1:], strict=True)
    }
    return base.with_values(values | {"throw.kappa": base.kappa / (1 + 0.01 * factor * signs[0]) ** 2}).map


def test_nine_quantities_and_the_landing_place(tmp_path):
    found = joint_margin(scene(NINE), GOALS[:1], width=0.01, seconds=15.0)
    # the worst corner fails from 0.4714 on, as long orbits of it show
    assert 0.465 <= found.proved < found.refuted < 0.473
    assert found.closed
    assert len(found.pieces) == 1
    assert found.noise.keys() == {"landing.x"}
    for file in found.save(tmp_path):
        word = "refuted" if file.name.endswith(".refuted.zip") else "proved"
        assert ls.recheck(file).verdict == word
    corners = list(product((-1, 1), repeat=8))
    heights = [highest_off(corner(found.proved, signs), 20_000) for signs in corners]
    assert max(heights) < 20.0
    worst = corners[int(np.argmax(heights))]
    for factor, above in ((found.proved, False), (1.01 * found.refuted, True)):
        random = np.random.default_rng(0)
        reached = highest_scattered(corner(factor, worst), 0.01 * factor, random, 3000)
        assert (reached > 20.0) is above


def test_what_runs_out_of_time_says_so_and_keeps_what_is_proved(tmp_path):
    """paper-initial: the lesser of two chains of throws is highest, so that each alone would stop at 0.15."""
    initial = ls.load(ls.load("paper-initial").as_dict() | {"tolerance": NINE})
    found = joint_margin(initial, (OrientedBeyond(21.8, 2),), seconds=0.0)
    assert 0.2 <= found.proved < found.refuted < 0.2225
    assert not found.closed
    assert "time" in found.reason
    (file, _) = found.save(tmp_path)
    assert ls.recheck(file).verdict == "proved"


@pytest.mark.sweep
def test_a_small_angle_scene_closes():
    small = ls.load(ls.load("paper-initial-small-angle").as_dict() | {"tolerance": NINE})
    found = joint_margin(small, (OrientedBeyond(20.6, 2),), seconds=10.0)
    assert found.closed
    assert len(found.pieces) == 1


@pytest.mark.parametrize(
    ("tolerance", "words"),
    [
        ({}, "tolerance"),
        ({"throw.sped": "1 %"}, "throw.speed"),
        ({"throw.speed": "1 deg/s"}, "percent"),
        ({"throw.speed": "-1 %"}, "above 0"),
        ({"gravity.acceleration": "1 %"}, "given by kappa"),
    ],
)
def test_refusals(tolerance, words):
    with pytest.raises(LimitsetsError, match=words):
        joint_margin(ls.load("paper-designed"), GOALS, tolerance)


# ---------------------------------------------------------------- covers, as the checker sees them


def boxes_by_cutting(random, whole, count):
    boxes = [whole]
    while len(boxes) < count:
        box = boxes.pop(int(random.integers(len(boxes))))
        k = int(random.integers(len(box)))
        lo, hi = box[k]
        cut = lo + (hi - lo) * Fraction(int(random.integers(1, 8)), 8)
        boxes += [[*box[:k], (lo, cut), *box[k + 1 :]], [*box[:k], (cut, hi), *box[k + 1 :]]]
    return boxes


@pytest.mark.parametrize("axes", [1, 2, 5, 9])
def test_a_cover_is_seen_and_a_gap_is(axes):
    random = np.random.default_rng(axes)
    whole = [(Fraction(0), Fraction(1))] * axes
    boxes = boxes_by_cutting(random, whole, 50)
    assert covered(whole, boxes)
    assert covered(whole, [*boxes, *boxes_by_cutting(random, whole, 20)])
    for gone in random.choice(50, 3, replace=False).tolist():
        assert not covered(whole, boxes[:gone] + boxes[gone + 1 :])
        lo, hi = boxes[gone][0]
        smaller = [(lo, hi - (hi - lo) / 2**40), *boxes[gone][1:]]
        assert not covered(whole, [*boxes[:gone], smaller, *boxes[gone + 1 :]])


def test_a_pinwheel_is_covered_though_no_cut_parts_its_boxes():
    def box(a, b, c, d):
        return [(Fraction(a), Fraction(b)), (Fraction(c), Fraction(d))]

    wheel = [box(0, 2, 0, 1), box(2, 3, 0, 2), box(1, 3, 2, 3), box(0, 1, 1, 3), box(1, 2, 1, 2)]
    assert covered(box(0, 3, 0, 3), wheel)
    assert not covered(box(0, 3, 0, 3), wheel[:-1])


# ----------------------------------------------------------------
# Margins of several pieces: what one certificate states of all of them, and what becomes of a quantity that fails.


# A trapezium in mm, 3.9 mm below the joint: a deviation of its surface height may lead above the joint.
OVER_THE_JOINT = plate(
    ("-8 mm", "-3.8895 mm"),
    ("180 deg/s", "160.2441 deg/s"),
    ('x = "58 mm", y = "9 mm", mass = "18 g"', 'x = "5.5310 mm", y = "16.9612 mm", mass = "34.5449 g"'),
    name="over-the-joint",
    more='[goal]\noriented_beyond = {x = "300 mm", side = 2}',
)


@pytest.mark.sweep
def test_a_margin_over_the_joint_ends_where_one_certificate_does(tmp_path):
    """Above the joint near parts creep to it: each height up to 5.8 mm is proved, but not for the same starts.

    The margin said 5.873 mm, and the checker denied its certificate.  At 3.8895 mm the surface is as high as the joint.
    """
    (found,) = ls.margin(OVER_THE_JOINT, "arm.surface_height", width=0.05)
    assert 3.8895 < found.proved < 4.3
    assert found.refuted == pytest.approx(5.9, abs=0.3)
    assert "may stay behind at another" in found.reason
    proof, _ = found.save(tmp_path)
    assert ls.recheck(proof).verdict == "proved"


@pytest.mark.sweep
def test_a_tolerance_over_the_joint_is_proved_on_cells_as_the_checker_says(tmp_path):
    proof = certify(ls.load(OVER_THE_JOINT), ["goal"], tolerance={"arm.surface_height": "5.8 mm"})
    (goal,) = proof.claims
    assert goal.verdict == "proved-on-cells"
    checked = ls.recheck(proof.save(tmp_path / "over.proof.zip"))
    assert checked.verdict == "proved-on-cells"
    assert goal.shares["open"] == pytest.approx(checked.open, abs=1e-4)
    assert goal.shares["share"] == pytest.approx(checked.share, abs=1e-4)


# A part with a chamfer on which it cannot rest: it rolls on.
CHAMFERED = plate(
    ('["80 mm", "0 mm"]', '["76 mm", "0 mm"], ["78.4 mm", "4 mm"]'),
    name="chamfered",
    more="""
[goal]
oriented_beyond = { x = "310 mm", side = 0 }
[tolerance]
"throw.speed" = "0.5 %"
[effects]
landing = true
roll = true
""",
)


def asked(text):
    scene = ls.load(text)
    return Query.of(scene, (scene.goal,))


def test_a_side_on_which_no_part_rests_has_no_room_to_lose():
    """The rows of what is proved were fewer than those of the orbit, and of other sides: an error of numpy."""
    query = asked(CHAMFERED)
    found = sensitivity_of(query, Tolerance.of(query.scene, {"throw.speed": "0.5 %"}))
    path = ls.orbit(query.scene.map, 300.0, 0, 60_000)
    x, side = path.x[2000:], path.side[2000:]
    room = [310.0 - x[side == s].max() for s in range(1, 5) if (side == s).any()]
    assert len(room) < 4  # no part rests on the chamfer
    assert found.slack == pytest.approx(room, rel=0.05)
    assert found.fall.shape == (len(room), 1)


def test_a_corner_that_becomes_flat_is_no_part():
    """At y = 0 the chamfer's upper corner lies on the line of side 0: the hull of the plate has a side less."""
    query = asked(CHAMFERED)
    scale = deviation_scale(query.scene, "part.vertices[2].y")
    found = query.prove(scale.piece(scale.at(Fraction(-4))), finest=0)
    assert found.verdict == "impossible"
    assert "the corners 0, 2, 3, 4 of its hull" in found.reason


def test_a_proof_of_too_many_pieces_says_so(monkeypatch):
    """A reason began with a semicolon."""
    monkeypatch.setattr(brackets, "TRIALS", 1)
    (found,) = ls.margin(OVER_THE_JOINT, "arm.surface_height", width=0.5)
    assert found.reason.startswith("from there on it is in more than 1 pieces")


def fails_of_speed(search):
    def failing(query, scale, *rest):
        if scale.quantity == "throw.speed":
            raise ZeroDivisionError
        return search(query, scale, *rest)

    return failing


BUG = "it was not found: this is a bug in limitsets: ZeroDivisionError"


def test_one_margin_that_fails_does_not_lose_the_others(monkeypatch, capfd, tmp_path):
    monkeypatch.setattr(finding, "bracket_fixed", fails_of_speed(finding.bracket_fixed))
    named = ["throw.speed", "arm.surface_height"]
    speed, height = ls.margin("paper-designed", *named, width=0.5)
    assert (speed.proved, speed.refuted, speed.reason) == (0.0, None, BUG)
    assert height.proved > 0.0
    with pytest.raises(ZeroDivisionError):  # alone there is nothing to keep
        ls.margin("paper-designed", "throw.speed")
    code = main(["margin", "paper-designed", *named, "--width", "0.5", "-o", str(tmp_path)])
    assert code == 1
    assert f"throw.speed: {BUG}" in capfd.readouterr().out
    assert (tmp_path / "paper-designed-arm-surface-height-fixed.proof.zip").exists()


def test_a_sheet_goes_on_without_the_margin_that_fails(monkeypatch, capfd, tmp_path):
    monkeypatch.setattr(finding, "bracket_fixed", fails_of_speed(finding.bracket_fixed))

    def no_joint(*_, **__):
        raise ZeroDivisionError

    monkeypatch.setattr(sheet_run, "joint_margin", no_joint)
    asks = "--quantity throw.speed --quantity arm.surface_height --reading fixed --width 0.5 --workers 1"
    more = ["--tolerance", "throw.speed=1 %", "--without", "curve", "--without", "audit"]
    code = main(["robustness", "paper-designed", *asks.split(), *more, "-o", str(tmp_path)])
    out = capfd.readouterr().out
    assert code == 1
    assert f"no margin of throw.speed, fixed: {BUG}" in out
    assert f"no joint: {BUG}" in out
    record = json.loads((tmp_path / "robustness.json").read_text())
    assert [each["quantity"] for each in record["margins"]] == ["arm.surface_height"]
    assert record["left_out"]["margin of throw.speed, fixed"] == BUG
    page = (tmp_path / "report.md").read_text()
    assert f"No margin of throw.speed, fixed: {BUG}." in page
    assert f"No joint margin: {BUG}." in page


def made_up(scene, quantity, proved, refuted, unit, reason=""):
    """A margin of a scene, as if it were found."""
    found = {"quantity": quantity, "proved": proved, "refuted": refuted, "unit": unit, "reason": reason}
    rest = {"reading": "fixed", "goals": (), "nominal": None, "closed": False, "seconds": 0.0, "scene": scene}
    empty = {"tolerance": {}, "deviations": {}, "noise": {}, "pieces": (), "against": None}
    return Margin(**found, **rest, **empty)


@pytest.fixture(scope="module")
def sheet():
    words = {"reading": "fixed", "width": 0.5, "leave_out": ["joint", "curve", "noise", "audit"]}
    return ls.robustness("paper-designed", "throw.speed", **words)


def test_the_csv_of_a_sheet_has_each_value_as_the_scene_gives_it(sheet):
    """62 mm was 61.99999999999999, 0 mm and the height of a margin of 0 were empty, and 34.5449 g stood beside %."""
    scene = ls.load(OVER_THE_JOINT)
    rows = [
        made_up(scene, "part.vertices[2].x", 4.211134, 4.23655332, "mm"),
        made_up(scene, "part.vertices[0].x", 2.39729481, None, "mm"),
        made_up(scene, "part.mass.points[0].mass", 28.8570625, None, "%"),
        made_up(scene, "arm.surface_height", 0.0, 5.9, "mm"),
        made_up(scene, "landing.x", 2.0, None, "mm"),
    ]
    table = list(csv.DictReader(io.StringIO(replace(sheet, scene=scene, entries=tuple(rows)).table().csv())))
    assert [(row["value"], row["value_unit"]) for row in table] == [
        ("62.0", "mm"), ("0.0", "mm"), ("34.5449", "g"), ("-3.8895", "mm"), ("", ""),
    ]  # fmt: skip


def test_a_page_tells_the_reason_of_a_margin_of_nothing(sheet):
    """A row of 0 beside 5.9 mm had no reason in report.md: what the checker denies is not proved."""
    denied = made_up(sheet.scene, "arm.surface_height", 0.0, 0.1, "in", "the checker does not confirm it")
    page = robustness_page(replace(sheet, entries=(*sheet.entries, denied)), {})
    assert "Where the two columns are apart" in page
    assert "the proof ends with: the checker does not confirm it" in page


# ----------------------------------------------------------------
# A vector of tolerances: exact and in floats it is the same box, and its worst corner is the worst of all.


TEXTS = {
    "throw.speed": "1 %",
    "part.sides[1]": "2 mm",
    "part.mass.center.along": "0.01 in",
    "arm.surface_height": "3 %",
    "landing.x": "0.5 mm",
}
FACTOR = Fraction(7, 4)


@pytest.mark.parametrize("signs", [(1, 1, 1, 1), (-1, 1, -1, 1), (-1, -1, -1, -1)])
def test_a_corner_in_floats_is_that_of_the_proof(signs):
    scene = ls.load("paper-designed")
    tolerance = Tolerance.of(scene, TEXTS)
    exact, floats = tolerance.corner(FACTOR, signs), tolerance.scene_at(scene, float(FACTOR), signs)
    assert exact.spans.keys() == {"throw.kappa", *list(TEXTS)[1:4]}
    for name, span in exact.spans.items():  # all in inches, the scene's unit
        assert floats.value(name) == pytest.approx(float(span.lo), rel=1e-14)
    speed = 1 + Fraction(7, 400) * signs[0]
    assert float(exact.spans["throw.kappa"].lo) == pytest.approx(scene.kappa / float(speed) ** 2, rel=1e-14)
    assert floats.value("part.sides[1]") == pytest.approx(3.6 + signs[1] * 3.5 / 25.4, rel=1e-14)


def test_landings_are_noise_and_nothing_else_is():
    tolerance = Tolerance.of(ls.load("paper-designed"), TEXTS)
    assert tolerance.noise(FACTOR) == {"landing.x": "0.875 mm"}
    assert tolerance.scatter == pytest.approx(0.5 / 25.4, rel=1e-15)
    assert "landing.x" not in tolerance.texts(FACTOR)


def test_a_quantity_alone_is_a_vector_of_one():
    scene = ls.load("paper-designed")
    height = Tolerance.alone(deviation_scale(scene, "arm.surface_height"))
    assert height.texts(Fraction(1, 50)) == {"arm.surface_height": "0.02 in"}
    assert height.corner(Fraction(1, 50), (-1,)).texts() == {"arm.surface_height": ["-0.22 in"] * 2}
    speed = Tolerance.alone(deviation_scale(scene, "throw.speed", "per-throw"))
    assert speed.noise(Fraction(3, 10)) == {"throw.speed": "0.3 %"}
    assert speed.corner(Fraction(3, 10), ()) is None


def test_the_worst_corner_is_the_worst_of_all():
    random = np.random.default_rng(2)
    for _ in range(50):
        fall = random.normal(size=5)
        slack = {signs: -float(np.dot(fall, signs)) for signs in product((-1, 1), repeat=5)}
        assert worst_corner(fall) == min(slack, key=slack.get)


def test_of_a_large_box_some_corners_are_tried_always_the_same():
    assert len(set(corners(9))) == 512
    assert corners(12) == corners(12)
    assert len(corners(12)) == 512


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("gravity.tilt", "1 deg", "the quantity"),
        ("throw.speed", "1 deg/s", "percent"),
        ("part.sides[1]", "0 in", "above 0"),
    ],
)
def test_a_design_refuses_what_a_proof_refuses(name, text, words):
    """Before, the search read 1 deg/s in a scene given by kappa as 1.7 %."""
    with pytest.raises(LimitsetsError, match=words):
        robust_design("paper-designed", tolerance={name: text}, evaluations=1, prove=0.0)
