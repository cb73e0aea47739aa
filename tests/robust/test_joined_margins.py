"""Margins of several pieces: what one certificate states of all of them, and what becomes of a quantity that fails."""

import csv
import io
import json
from dataclasses import replace
from fractions import Fraction

import pytest

import limitsets as ls
from limitsets.face.cli.app import main
from limitsets.face.report.robust_pages import robustness_page
from limitsets.parameters.margins import brackets
from limitsets.parameters.margins import single as finding
from limitsets.parameters.margins.deviations import Tolerance, deviation_scale
from limitsets.parameters.margins.joint import sensitivity_of
from limitsets.parameters.sheet import sheet_run
from limitsets.parameters.sheet.entries import Entry
from limitsets.proofs.prover.certifying import certify
from limitsets.proofs.prover.query import Query
from tests.plates import plate

ALL_BUT_MARGINS = ["joint", "curve", "noise", "audit"]

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
    assert found.cost.shape == found.fall.shape == (len(room), 1)


def test_a_corner_that_becomes_flat_is_no_part():
    """At y = 0 the chamfer's upper corner lies on the line of side 0: the angle there was a division by 0."""
    query = asked(CHAMFERED)
    scale = deviation_scale(query.scene, "part.vertices[2].y")
    found = query.prove(scale.piece(scale.at(Fraction(-4))), finest=0)
    assert found.verdict == "impossible"
    assert "of no convex shape" in found.reason


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
    asks = [
        "--quantity",
        "throw.speed",
        "--quantity",
        "arm.surface_height",
        "--reading",
        "fixed",
        "--width",
        "0.5",
    ]
    more = ["--tolerance", "throw.speed=1 %", "--without", "curve", "--without", "audit", "--workers", "1"]
    code = main(["robustness", "paper-designed", *asks, *more, "-o", str(tmp_path)])
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


def entry(quantity, proved, refuted, unit, nominal, of, reason=""):
    return Entry(
        quantity,
        "fixed",
        (),
        proved,
        refuted,
        unit,
        nominal,
        of,
        False,
        reason,
        None,
        (),
        (),
        None,
        1,
        0.0,
        None,
    )


def test_the_csv_of_a_sheet_has_each_value_as_the_scene_gives_it():
    """62 mm was 61.99999999999999, 0 mm and the height of a margin of 0 were empty, and 34.5449 g stood beside %."""
    scene = ls.load(OVER_THE_JOINT)
    rows = [
        entry("part.vertices[2].x", 4.211134, 4.23655332, "mm", 62.0, "mm"),
        entry("part.vertices[0].x", 2.39729481, None, "mm", 0.0, "mm"),
        entry("part.mass.points[0].mass", 28.8570625, None, "%", 34.5449, "g"),
        entry("arm.surface_height", 0.0, 5.9, "mm", -3.8895, "mm"),
        entry("landing.x", 2.0, None, "mm", None, "mm"),
    ]
    sheet = ls.robustness(
        "paper-designed", "throw.speed", reading="fixed", width=0.5, leave_out=ALL_BUT_MARGINS
    )
    table = list(csv.DictReader(io.StringIO(replace(sheet, scene=scene, entries=tuple(rows)).table().csv())))
    assert [(row["value"], row["value_unit"]) for row in table] == [
        ("62.0", "mm"), ("0.0", "mm"), ("34.5449", "g"), ("-3.8895", "mm"), ("", ""),
    ]  # fmt: skip


def test_a_page_tells_the_reason_of_a_margin_of_nothing(tmp_path):
    """A row of 0 beside 5.9 mm had no reason in report.md: what the checker denies is not proved."""
    sheet = ls.robustness(
        "paper-designed", "throw.speed", reading="fixed", width=0.5, leave_out=ALL_BUT_MARGINS
    )
    denied = entry("arm.surface_height", 0.0, 0.1, "in", -0.397, "in", "the checker does not confirm it")
    page = robustness_page(replace(sheet, entries=(*sheet.entries, denied)), {})
    assert "Where the two columns are apart" in page
    assert "the proof ends with: the checker does not confirm it" in page
