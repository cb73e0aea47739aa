"""What a scene may not say, and the remedy that is named."""

from __future__ import annotations

import copy
import math
import os
import sys
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import LimitsetsError, SceneError
from limitsets.feeder.scene import dump, load
from limitsets.feeder.scene.checking import examined
from limitsets.feeder.thrower.effects import EFFECTS
from limitsets.parameters.design import robust_design
from limitsets.parameters.design.for_goal import design_for_goal
from tests import plates
from tests.scene.test_load import BOTH as BOTH_REMEDIES, chamfered

# ----------------------------------------------------------------
# Scenes that cannot be: each is one SceneError that names file, key, value, what is allowed and what to do.


GONE = object()
TRAY = {"depression_width": "7.02 in", "depression_depth": "1.53 in", "pitch": "14.04 in"}
TRAY |= {"agitation": "0.4 in", "wash": "1 in"}
LOOSE_TRAY = {key: TRAY[key] for key in ("pitch", "agitation", "wash")}
DEEP = [["0 in", "0 in"], ["4 in", "-3 in"], ["9 in", "-3 in"], ["9 in", "0 in"]]
CAVITY = {"position": "20 in", "width": "9.3 in", "depth": "5.8633 in", "angle": "32.23 deg"}
BOTH = {"sides": ["3 in", "4 in", "5 in"], "vertices": [["0 in", "0 in"], ["1 in", "0 in"], ["0 in", "1 in"]]}

OWN = {"name": "own", "kappa": "25 in"}


def feedback(*throws: Any, **sensor: Any) -> dict[str, Any]:
    return {"feedback": {"throws": [*throws], **sensor}}


def changed(table: dict[str, Any], key: str, value: Any) -> dict[str, Any]:
    """Put a value at a dotted key; GONE deletes."""
    *path, last = key.split("/")
    node: Any = table
    for word in path:
        node = node[int(word)] if isinstance(node, list) else node.setdefault(word, {})
    if value is GONE:
        del node[int(last) if isinstance(node, list) else last]
    elif isinstance(node, list):
        node[int(last)] = value
    else:
        node[last] = value
    return table


# what is changed in the scene of conftest, the key that the error names, and words in it
TABLE: list[tuple[dict[str, Any], str, str]] = [
    # keys
    ({"arm/lenght": "28 in"}, "arm.lenght", "did you mean 'length'"),
    ({"arm/length": GONE, "arm/lenght": "28 in"}, "arm.lenght", "did you mean 'length'"),
    ({"world/scatter/sped": "1 %"}, "world.scatter.sped", "did you mean 'speed'"),
    ({"gaol": {}}, "gaol", "did you mean 'goal'"),
    ({"effects/landings": True}, "effects.landings", "did you mean 'landing'"),
    ({"arm/length": GONE}, "arm.length", "required key is 'missing'"),
    # tray
    (
        {"tray": TRAY | {"rows": 1}},
        "tray.rows",
        "agitation, depression_depth, depression_width, outline, pitch, play",
    ),
    (
        {"tray": TRAY | {"depression_width": "6.7 in"}},
        "tray.depression_width",
        "at least 6.75 in, the length of",
    ),
    ({"tray": TRAY | {"depression_depth": "3.07 in"}}, "tray.depression_depth", "deeper than the part"),
    *(
        ({"tray": LOOSE_TRAY | tray}, f"tray.{key}", words)
        for tray, key, words in [
            ({"vertices": [*DEEP[:2], ["9 in", "1 in"]]}, "vertices[2].y", "allowed: 0;"),
            ({"vertices": [*DEEP[:2], ["9 in", "0 in"]]}, "vertices", "level floor of a depression"),
            ({"depression_width": "7.02 in"}, "depression_depth", "depression_width needs it"),
            (
                {"outline": "part", "play": "1 mm", "depression_depth": "4 in"},
                "depression_depth",
                "deeper than",
            ),
        ]
    ),
    ({"tray": TRAY | {"pitch": "7.02 in"}}, "tray.pitch", "above the width of a depression, 7.02 in"),
    ({"tray": TRAY | {"agitation": "0 in"}}, "tray.agitation", "above 0"),
    # feedback
    ({"feedback": {"throws": []}}, "feedback.throws", "at least 1"),
    (feedback({"name": "own"}), "feedback.throws[0]", "kappa or speed"),
    (feedback(OWN | {"speed": "9 rpm"}), "feedback.throws[0]", "kappa and speed"),
    (feedback({"name": "a", "kappa": "0 in"}), "feedback.throws[0].kappa", "above 0"),
    ({"throw": {"kappa": "25 in"}, "gravity": GONE}, "feedback.throws[0].speed", "add [gravity]"),
    (feedback(OWN, OWN), "feedback.throws[1].name", "a name of its own"),
    (feedback(OWN, sensor={}), "feedback.sensor", "beyond or side"),
    (feedback(OWN, sensor={"beyond": "-1 in"}), "feedback.sensor.beyond", "from 0"),
    (feedback(OWN, sensor={"beyond": "90 in"}), "feedback.sensor.beyond", "to the arm's length"),
    (feedback(OWN, sensor={"side": 3}), "feedback.sensor.side", "0 to 2"),
    (feedback(OWN, sensor={"side": 1, "beyond": "2 in"}), "feedback.sensor", "one question"),
    (feedback(OWN, sensor={"side": 1, "error": "2 in"}), "feedback.sensor.error", "leave it"),
    (feedback(OWN, sensor={"beyond": "2 in", "error": "-1 in"}), "feedback.sensor.error", "0 or more"),
    # quantities
    ({"arm/length": 28}, "arm.length", "write it as text with its unit"),
    ({"arm/length": {"value": "28 in"}}, "arm.length", "a table"),
    ({"throw/speed": None}, "throw.speed", "None"),
    ({"world/friction": float("inf")}, "world.friction", "a finite number"),
    # types
    ({"part": []}, "part", "a table"),
    ({"part/sides": "5.75 in"}, "part.sides", "a list"),
    ({"part/mass/center/side": True}, "part.mass.center.side", "whole number"),
    ({"part/mass/center/side": "2"}, "part.mass.center.side", "whole number"),
    ({"part/mass/center/side": 10**5000}, "part.mass.center.side", "an integer of"),
    ({"name": 3}, "name", "letters"),
    ({"name": ""}, "name", "letters"),
    ({"name": "../../etc"}, "name", "letters"),
    ({"tolerance": ["1 %"]}, "tolerance", "a table"),
    ({"tolerance": {"throw": {"speed": "1 %"}}}, "tolerance.throw", "quoted"),
    # shape
    ({"part/sides": ["1 in", "2 in"]}, "part.sides", "3, a triangle"),
    ({"part/sides": ["1 in"] * 4}, "part.sides", "vertices"),
    ({"part/sides/1": "0 in"}, "part.sides[1]", "above 0"),
    ({"part/sides/1": "0.999999 in"}, "part.sides", "triangle inequality"),
    ({"part/sides": GONE}, "part", "neither sides nor vertices"),
    ({"part": BOTH | {"mass": {"plate_density": "1 kg/m^2"}}}, "part", "sides and vertices"),
    # mass
    ({"part/mass": {}}, "part.mass", "empty"),
    ({"part/mass/center": GONE}, "part.mass", "only radius_of_gyration"),
    ({"part/mass/radius_of_gyration": GONE}, "part.mass", "only center"),
    ({"part/mass/plate_density": "1 kg/m^2"}, "part.mass", "not both: a point mass"),
    ({"part/mass": {"points": []}}, "part.mass", "only points"),
    ({"part/mass/radius_of_gyration": "0 in"}, "part.mass.radius_of_gyration", "above 0"),
    ({"part/mass/center/side": 3}, "part.mass.center.side", "0 to 2"),
    ({"part/mass/center/above": "-0.1 in"}, "part.mass.center", "outside, 0.1 in beyond side 2"),
    ({"part/mass/center/above": "0 in"}, "part.mass.center", "above side 2"),
    # arm and throw
    ({"arm/length": "0 in"}, "arm.length", "above 0"),
    ({"arm/length": "4 in"}, "arm.length", "side 2"),
    ({"throw/kappa": "25 in"}, "throw", "kappa and speed"),
    ({"throw": {}}, "throw", "neither kappa nor speed"),
    ({"throw/speed": "0 deg/s"}, "throw.speed", "above 0"),
    ({"throw/speed": "1e-8 deg/s"}, "throw.speed", "gravity/speed^2"),
    ({"throw": {"kappa": "0 in"}}, "throw.kappa", "above 0"),
    ({"gravity": GONE}, "throw.speed", "add [gravity]"),
    ({"gravity/acceleration": "193 in/s^2"}, "gravity", "not both"),
    ({"gravity": {}}, "gravity", "acceleration or tilt"),
    ({"gravity": {"acceleration": "0 in/s^2"}}, "gravity.acceleration", "above 0"),
    ({"gravity/tilt": "0 deg"}, "gravity.tilt", "up to 90 deg"),
    ({"gravity/tilt": "90.001 deg"}, "gravity.tilt", "up to 90 deg"),
    ({"model/flight": "small"}, "model.flight", '"small-angle"'),
    ({"model/flip": "Signed"}, "model.flip", '"signed" or "energy"'),
    # goal
    ({"goal": {}}, "goal", "name exactly one"),
    ({"goal/attracts_all": True}, "goal", "name exactly one"),
    ({"goal": {"attracts_all": False}}, "goal.attracts_all", "leave the line out"),
    ({"goal/oriented_beyond/x": "20 deg"}, "goal.oriented_beyond.x", "dimension is wrong"),
    ({"goal/oriented_beyond/x": "28 in"}, "goal.oriented_beyond.x", "below the arm's length"),
    ({"goal/oriented_beyond/side": 3}, "goal.oriented_beyond.side", "0 to 2"),
    (
        {"goal": {"reaches": {"x": "1 in", "side": 0, "every_orbit": 1}}},
        "goal.reaches.every_orbit",
        "true or",
    ),
    ({"goal": {"flip_order": [0, 3]}}, "goal.flip_order[1]", "0 to 2"),
    ({"goal": {"flip_order": []}}, "goal.flip_order", "at least 1"),
    # cavity
    *(
        ({"cavity": {"position": "20 in"} | cavity}, f"cavity{key}", words)
        for cavity, key, words in [
            ({}, "", "neither width nor vertices nor outline"),
            ({"vertices": DEEP, "width": "9 in"}, "", "width and vertices"),
            ({"vertices": DEEP, "angle": "30 deg"}, ".angle", "beside vertices"),
            ({"vertices": DEEP, "side": 1}, ".side", "beside vertices"),
            ({"width": "9 in", "depth": "2 in"}, ".angle", "width needs it"),
            ({"outline": "part", "angle": "30 deg"}, ".play", "outline needs it"),
            ({"outline": "part", "angle": "90 deg", "play": "1 mm"}, ".angle", "below 90 deg"),
            ({"outline": "part", "angle": "9 deg", "play": "1 mm", "side": 3}, ".side", "0 to 2"),
            ({"vertices": DEEP[:2]}, ".vertices", "at least 3"),
            ({"vertices": DEEP[1:]}, ".vertices[0]", "where the ground begins to fall"),
            ({"vertices": [*DEEP[:2], ["3 in", "-4 in"], *DEEP[3:]]}, ".vertices[2].x", "overhangs"),
            ({"vertices": [*DEEP, ["9 in", "1 in"]]}, ".vertices[3].y", "below 0"),
            ({"vertices": DEEP[:3]}, ".vertices[2].y", "0 or above"),
            (
                {"vertices": [DEEP[0], ["0 in", "-3 in"], *DEEP[2:]]},
                ".vertices[1].x",
                "the first edge is the ramp",
            ),
        ]
    ),
    (
        {"cavity": CAVITY | {"size": "1 in"}},
        "cavity.size",
        "angle, depth, outline, play, position, side, tips, vertices, width",
    ),
    ({"cavity": CAVITY | {"position": "28.001 in"}}, "cavity.position", "up to the arm's length, 28 in"),
    ({"cavity": CAVITY | {"position": "4.2 in"}}, "cavity.position", "the part resting on side 2 needs"),
    ({"cavity": CAVITY | {"width": "6.7 in"}}, "cavity.width", "at least 6.75 in, the length of side 2"),
    ({"cavity": CAVITY | {"depth": "5.87 in"}}, "cavity.depth", "the ramp is longer than the cavity"),
    ({"cavity": CAVITY | {"depth": "0 in"}}, "cavity.depth", "above 0"),
    ({"cavity": CAVITY | {"angle": "0 deg"}}, "cavity.angle", "below 90 deg"),
    ({"cavity": CAVITY | {"angle": "90 deg"}}, "cavity.angle", "below 90 deg"),
    ({"world/throw_rate": "0 Hz"}, "world.throw_rate", "above 0"),
    # world, effects, tolerance
    ({"world/friction": "0.9"}, "world.friction", "without a unit"),
    ({"world/friction": -0.1}, "world.friction", "from 0"),
    ({"world/restitution": 1.1}, "world.restitution", "from 0 to 1"),
    ({"world/bounce_threshold": 0.01}, "world.bounce_threshold", "as text"),
    ({"world/stroke": "90 deg"}, "world.stroke", "below 90 deg"),
    ({"world/scatter/speed": "-1 %"}, "world.scatter.speed", "from 0"),
    ({"world/scatter/landing": "1 %"}, "world.scatter.landing", "share"),
    ({"effects/landing": "yes"}, "effects.landing", "true or false"),
    ({"effects/spread": "wide"}, "effects.spread", '"bounded" or "gaussian"'),
    ({"effects/slip": True, "world/friction": GONE}, "effects.slip", "slip needs it: add world.friction"),
    ({"effects/pivot": True, "world": GONE}, "effects.pivot", "world.friction"),
    ({"effects/spread": "bounded", "world/scatter": {}}, "effects.spread", "world.scatter"),
    ({"effects/drive": True, "effects/slip": True}, "effects.drive", "drive or slip"),
    ({"effects/drive": True, "effects/pivot": True}, "effects.drive", "drive or pivot"),
    ({"effects/drive": True, "effects/bounce": True}, "effects.drive", "drive or bounce"),
    ({"effects/roll": True, "model/flight": "small-angle"}, "effects.roll", "the exact one"),
    ({"effects/spread": "gaussian", "model/flight": "small-angle-2"}, "effects.spread", "the exact one"),
    ({"tolerance": {"throw.sped": "1 %"}}, 'tolerance."throw.sped"', "did you mean 'throw.speed'"),
    ({"tolerance": {"part.sides[3]": "1 %"}}, 'tolerance."part.sides[3]"', "does not give it"),
    ({"tolerance": {"throw.speed": "1 in"}}, 'tolerance."throw.speed"', "dimension is wrong"),
    ({"tolerance": {"throw.speed": "0 %"}}, 'tolerance."throw.speed"', "above 0"),
]


def refused(tree: dict[str, Any], changes: dict[str, Any], key: str, words: str) -> None:
    for place, value in changes.items():
        changed(tree, place, value)
    with pytest.raises(SceneError) as caught:
        load(tree)
    error = caught.value
    assert words in str(error)
    assert error.key == key
    assert all(str(part) in str(error) for part in (error.key, error.allowed, error.remedy))
    assert len(str(error)) < 700
    assert error.__cause__ is None


@pytest.mark.parametrize(("changes", "key", "words"), TABLE)
def test_refuses(changes: dict[str, Any], key: str, words: str, whole: dict[str, Any]) -> None:
    refused(whole, changes, key, words)


def test_a_radius_of_gyration_that_no_part_of_this_outline_has(whole: dict[str, Any]) -> None:
    """Of a triangle the shares of the three corners follow from the centre of mass; all mass in them is the most."""
    scene = load(whole)
    away = scene.vertices - np.array(scene.centre)
    shares = np.linalg.solve(np.vstack([scene.vertices.T, np.ones(3)]), [*scene.centre, 1.0])
    largest = math.sqrt(shares @ (away**2).sum(axis=1))
    whole["part"]["mass"]["radius_of_gyration"] = f"{largest * (1 - 1e-12)!r} in"
    assert load(whole).radius_of_gyration == pytest.approx(largest)
    changes = {"part/mass/radius_of_gyration": f"{largest * (1 + 1e-6)!r} in"}
    refused(whole, changes, "part.mass.radius_of_gyration", f"at most {largest:.6g} in")


def paths(node: Any) -> Iterator[str]:
    """List the place of each entry of a tree."""
    for key, inner in node.items() if isinstance(node, dict) else enumerate(node):
        yield str(key)
        if isinstance(inner, dict | list):
            yield from (f"{key}/{path}" for path in paths(inner))


def test_whatever_is_left_out_is_missed_as_such_or_not_at_all(
    whole: dict[str, Any], plate: dict[str, Any]
) -> None:
    """A key that is needed, and not known to be, was read as None."""
    for tree in (whole, plate):
        for path in paths(tree):
            wrong, _ = examined(changed(copy.deepcopy(tree), path, GONE))
            assert not any("None" in str(error) for error in wrong), path


def test_contact_is_for_the_engine_alone(whole: dict[str, Any]) -> None:
    assert not load(whole).effects.contact
    whole["effects"] = {"contact": True}
    scene = load(whole)
    assert scene.effects.contact
    assert scene.effects.on() == ()
    assert scene.map is scene.bare_map


def test_an_effect_that_is_not_declared_is_an_unknown_key(
    whole: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    whole["effects"] = {"roll": True}
    assert load(whole).effects.on() == ("roll",)
    monkeypatch.delitem(EFFECTS, "roll")
    names = "auto, bounce, contact, drive, landing, pivot, slip, spread"
    with pytest.raises(SceneError, match=rf"{names}.*known") as caught:
        load(whole)
    assert caught.value.key == "effects.roll"


SKEWED = [["0 cm", "0 cm"], ["2 cm", "0 cm"], ["9 cm", "4 cm"], ["7 cm", "4 cm"]]
CLOCKWISE = [["0 cm", "4 cm"], ["6 cm", "4 cm"], ["6 cm", "0 cm"], ["0 cm", "0 cm"]]
TINY = [[f"{x}e-200 cm", f"{y}e-200 cm"] for x, y in ["00", "10", "01"]]
THIN = {"part/mass/plate_thickness": "0 mm"}


def circle(x: float, y: float, diameter: float) -> dict[str, Any]:
    return {"center": {"x": f"{x} cm", "y": f"{y} cm"}, "diameter": f"{diameter} cm"}


def polygon(*places: tuple[float, float]) -> dict[str, Any]:
    return {"vertices": [[f"{x} cm", f"{y} cm"] for x, y in places]}


# In a rectangle of 6 cm by 4 cm.
HOLES: list[tuple[list[dict[str, Any]], str, str]] = [
    ([circle(1, 1, 2)], "part.holes", "hole 0 is 'beyond the outline'"),  # it touches two edges
    ([circle(7, 1, 0.5)], "part.holes", "beyond the outline"),
    ([circle(3, 2, 20)], "part.holes", "beyond the outline"),
    ([polygon((1, 1), (7, 1), (1, 2))], "part.holes", "beyond the outline"),
    ([polygon((7, 1), (8, 1), (8, 2))], "part.holes", "beyond the outline"),
    ([polygon((-1, -1), (9, -1), (9, 9), (-1, 9))], "part.holes", "beyond the outline"),
    ([circle(2, 2, 1), circle(2.9, 2, 1)], "part.holes", "hole 1 is 'one that meets hole 0'"),
    ([circle(2, 2, 3), circle(2, 2, 1)], "part.holes", "meets hole 0"),
    ([circle(2, 2, 3), polygon((1.8, 1.8), (2.2, 1.8), (2, 2.2))], "part.holes", "meets hole 0"),
    ([polygon((1, 1), (5, 1), (5, 3), (1, 3)), circle(2, 2, 0.1)], "part.holes", "meets hole 0"),
    (
        [polygon((1, 1), (3, 1), (2, 3)), polygon((2, 0.5), (2.2, 0.5), (2.2, 3.5))],
        "part.holes",
        "meets hole 0",
    ),
    (
        [polygon((1, 1), (5, 1), (3, 3)), polygon((3, 1.2), (3.2, 1.2), (3, 1.5))],
        "part.holes",
        "meets hole 0",
    ),
    (
        [polygon((3, 1.2), (3.2, 1.2), (3, 1.5)), polygon((1, 1), (5, 1), (3, 3))],
        "part.holes",
        "meets hole 0",
    ),
    ([polygon((1, 1), (1, 2), (2, 1))], "part.holes", "hole 0: the order of the vertices is 'clockwise'"),
    ([polygon((1, 1), (2, 2), (2, 1), (1, 2))], "part.holes", "hole 0: the boundary"),
    ([circle(1, 1, 0)], "part.holes[0].diameter", "above 0"),
    ([circle(1, 1, 1) | {"depth": "1 mm"}], "part.holes[0].depth", "center, diameter, vertices"),
    ([{"diameter": "1 cm"}], "part.holes[0]", "diameter without center"),
    ([polygon((1, 1), (2, 1), (2, 2)) | circle(1, 1, 1)], "part.holes[0]", "not both"),
    ([{"center": {"x": "1 cm", "y": "1 cm"}}], "part.holes[0]", "neither diameter nor vertices"),
    (
        [polygon((1, 1), (2, 1), (2, 2)) | {"center": {"x": "1 cm", "y": "1 cm"}}],
        "part.holes[0]",
        "without diameter",
    ),
    ([{"vertices": [["1 cm", "1 kg"]]}], "part.holes[0].vertices[0].y", "dimension is wrong"),
]


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ({"part/vertices/2": ["6 cm"]}, "part.vertices[2]", "number of entries is 1; allowed: at least 2"),
        ({"part/vertices/2/1": "4 s"}, "part.vertices[2].y", "not known"),
        ({"part/vertices/2": "6 cm"}, "part.vertices[2]", "a list"),
        ({"part/vertices/2": ["1 cm", "-1 cm"]}, "part.vertices", "vertices 0 and 2 meet"),
        ({"part/vertices/2": ["0 cm", "-4 cm"]}, "part.vertices", "at vertex 3"),  # there and back
        (
            {"part/vertices/1": ["6 cm", "-1e-13 cm"], "part/vertices/2": ["9 cm", "0 cm"]},
            "part.vertices",
            "vertex 1 is 'almost on the line",
        ),
        *(({"part/holes": holes}, key, words) for holes, key, words in HOLES),
        ({"part/vertices": CLOCKWISE}, "part.vertices", "reverse the list"),
        (
            {"part/vertices": SKEWED, "part/mass/points": GONE},
            "part.mass",
            "on side 0: it tips over the right end by 2.5 cm",
        ),
        ({"part/vertices": TINY}, "part.vertices", "smaller"),
        ({"part/vertices": []}, "part.vertices", "from 3"),
        ({"part/vertices": [["0 cm", "0 cm"]] * 2000}, "part.vertices", "at most 1000"),
        ({"part/mass/points/0/x": "7 cm"}, "part.mass.points", "outside, 1 cm beyond side 3"),
        ({"part/mass/points/0/mass": "0 g"}, "part.mass.points[0].mass", "above 0"),
        ({"part/mass/points/0/mass": "1 cm"}, "part.mass.points[0].mass", "dimension is wrong"),
        ({"part/mass/points/0/z": "1 cm"}, "part.mass.points[0].z", "mass, x, y"),
        ({"part/mass/plate_density": "0 kg/m^2"}, "part.mass.plate_density", "above 0"),
        ({"part/mass/plate_density": GONE}, "part.mass", "only points"),
        (
            {"part/mass/plate_density": "7850 kg/m^3"},
            "part.mass.plate_density",
            "add part.mass.plate_thickness",
        ),
        (
            {"part/mass/plate_density": "7.85 g/cm^3"},
            "part.mass.plate_density",
            "add part.mass.plate_thickness",
        ),
        ({"part/mass/plate_thickness": "2 mm"}, "part.mass.plate_thickness", "2 kg/m^2 holds the thickness"),
        (THIN | {"part/mass/plate_density": "7850 kg/m^3"}, "part.mass.plate_thickness", "above 0"),
        (THIN | {"part/mass/plate_density": GONE}, "part.mass", "only plate_thickness and points"),
        ({"part/mass/points/0/mass": "0.05 N"}, "part.mass.points[0].mass", "a mass is wanted: give kg"),
    ],
)
def test_refuses_vertices_and_points(
    changes: dict[str, Any], key: str, words: str, plate: dict[str, Any]
) -> None:
    refused(plate, changes, key, words)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"name = ", "the text of the scene is 'not valid'"),
        (b"name = 'a'\nname = 'b'\n", "not valid"),
        (b"\n[arm]\nlength = 400 mm\n", "(at line 3, column 14); a quantity stands in quotation marks"),
        (b"\xff\xfe\x00", "undecodable at byte 0"),
        (b"name = 'a\x00b'", "not valid"),
        (b"x = " + b"[" * 100_000, "too deeply nested"),
        (b"x = " + b"{a=" * 100_000, "too deeply nested"),
        (b".".join([b"a"] * 30_000) + b" = 1", "too many points"),
        (b" . ".join([b'"a,="'] * 30_000) + b" = 1", "too many points"),
        (b"[" + b".".join([b"a"] * 30_000) + b"]", "too many points"),
        (b"x = " + b"1" * 100_000, "not valid"),
        (b"x = [[[[[[[[[[1]]]]]]]]]]", "deeper than"),
        (b"x = 2020-01-01", "x: this value is 'a date'"),
        (b"#" * (1 << 20) + b"\n", "at most 1048576 bytes"),
        (b"", "required key"),
    ],
)
def test_refuses_files(content: bytes, words: str, tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_bytes(content)
    began = time.process_time()
    with pytest.raises(SceneError) as caught:
        load(file)
    assert words in str(caught.value)
    assert caught.value.file == str(file)
    assert time.process_time() - began < 5.0


def test_refuses_places_without_a_scene(tmp_path: Path) -> None:
    for source, words in [
        (tmp_path / "none.toml", "not there"),
        (tmp_path, "a folder"),
        ("paper-desinged", "did you mean 'paper-designed'"),
        ("", "a folder"),
        ("a" * 5000, "could not be opened"),
        ("a\0b", "the scene"),
        ("\ud800", "the scene"),
        (3, "a path"),
        (None, "a path"),
        (b"paper-designed", "a path"),
        ({}, "required"),
        ({3: 4}, "a key"),
    ]:
        with pytest.raises(SceneError) as caught:
            load(source)  # type: ignore[arg-type]  # wrong on purpose
        assert words in str(caught.value)
        str(caught.value).encode("utf-8")


@pytest.mark.skipif(sys.platform == "win32", reason="no pipes in folders there")
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(SceneError, match="not a regular file"):
        load(tmp_path / "pipe")


def test_refuses_to_write_where_it_cannot(tmp_path: Path) -> None:
    for path in (tmp_path / "none" / "scene.toml", tmp_path, "a\0b"):
        with pytest.raises(SceneError, match="could not be written"):
            dump(load("paper-designed"), path)
    assert list(tmp_path.iterdir()) == []


def test_a_structure_that_holds_itself_is_refused(whole: dict[str, Any]) -> None:
    whole["part"]["mass"] = whole
    with pytest.raises(SceneError, match="nesting"):
        load(whole)


# ----------------------------------------------------------------
# What a refusal and `check` tell to do: the way out, and nothing that only follows from what is told already.


TOLERANCE = """
[tolerance]
"throw.speed" = "0.5 %"
"part.mass.points[0].mass" = "2 %"
"""

L_SHAPED = [(0, 0), (0, 60), (20, 60), (20, 20), (80, 20), (80, 0)]  # clockwise, mm


def plate(*changes: tuple[str, str]) -> dict[str, Any]:
    """The scene, its text changed."""
    return tomllib.loads(plates.plate(*changes, more=TOLERANCE))


def l_shaped(**tables: Any) -> dict[str, Any]:
    tree = plate() | tables
    tree["part"]["vertices"] = [[f"{x} mm", f"{y} mm"] for x, y in L_SHAPED]
    return tree


def keys(tree: dict[str, Any]) -> list[str]:
    return [str(error.key) for error in examined(tree)[0]]


def assemble_both(scene: Any) -> Any:
    return ls.assemble(scene, scene)


@pytest.mark.parametrize(
    "command", [design_for_goal, robust_design, ls.feed, ls.tray, ls.feedback, assemble_both]
)
def test_what_does_not_take_a_chamfer_names_the_way_out(command: Any) -> None:
    goal = {"oriented_beyond": {"x": "20 cm", "side": 1}}
    with pytest.raises(LimitsetsError) as caught:
        command(ls.load(chamfered(effects=BOTH_REMEDIES, goal=goal)))
    assert "cannot rest on side 3" in str(caught.value)
    assert "draw the part without it" in caught.value.remedy
    assert "[cavity]" not in caught.value.remedy


def test_the_way_out_works() -> None:
    """The edges beside the chamfer of this square meet in the corner (4, 4)."""
    tree = chamfered()
    tree["part"]["vertices"][2:4] = [["4 cm", "4 cm"]]
    assert ls.load(tree).sides.rests.all()


def test_an_example_is_in_the_unit_of_the_scene() -> None:
    with pytest.raises(LimitsetsError, match=r'position = "300 mm"'):
        ls.feed(ls.load(plate() | {"goal": {"oriented_beyond": {"x": "300 mm", "side": 1}}}))


def test_a_concave_part_whose_mass_is_measured_is_told_its_hull_ready_to_paste() -> None:
    tree = l_shaped()
    tree["part"]["vertices"].reverse()
    centre = {"side": 0, "along": "30 mm", "above": "30 mm"}
    tree["part"]["mass"] = {"center": centre, "radius_of_gyration": "29 mm"}
    tree["tolerance"] = {}
    with pytest.raises(SceneError) as caught:
        ls.load(tree)
    assert "convex hull" in caught.value.remedy
    assert "plate_density" in caught.value.remedy
    pasted = caught.value.remedy.partition("vertices = ")[2].partition("]]")[0] + "]]"
    corners = tomllib.loads(f"vertices = {pasted}")["vertices"]
    # all but the inward corner (20, 20), counterclockwise
    outer = {(f"{x} mm", f"{y} mm") for x, y in L_SHAPED if (x, y) != (20, 20)}
    assert {tuple(pair) for pair in corners} == outer
    tree["part"]["vertices"] = corners
    assert not [error for error in examined(tree)[0] if error.key == "part.vertices"]


def test_the_worked_example_of_the_page_is_the_sum_of_its_pieces() -> None:
    """Two rectangles, a disc less and a point: areas, centres, and moments by the parallel-axis rule, in mm and g."""
    page = (Path(__file__).parents[2] / "docs" / "scene.md").read_text(encoding="utf-8")
    example = page.partition("**A concave part, a part with holes.**")[2]
    scene = ls.load(
        plate() | tomllib.loads(example.partition("```toml")[2].partition("```")[0]) | {"tolerance": {}}
    )
    assert scene.sides.rests.tolist() == [True] * 5
    by_area = 7850e-9 * 2.0 * 1e3  # g/mm^2
    pieces = [(80 * 40, 40, 20, (80**2 + 40**2) / 12), (40 * 40, 20, 60, (40**2 + 40**2) / 12)]
    pieces.append((-math.pi * 5**2, 20, 60, 5**2 / 2))
    parts = [(area * by_area, x, y, square) for area, x, y, square in pieces] + [(18.0, 60, 20, 0.0)]
    mass, x, y, own = np.array(parts).T
    cx, cy = (mass @ x) / mass.sum(), (mass @ y) / mass.sum()
    assert scene.centre == pytest.approx((cx, cy), rel=1e-14)
    rho = math.sqrt(mass @ (own + (x - cx) ** 2 + (y - cy) ** 2) / mass.sum())
    assert scene.radius_of_gyration == pytest.approx(rho, rel=1e-14)
    assert f"({cx:.3f}, {cy:.3f}) mm, and its radius of gyration is {rho:.3f} mm" in example


@pytest.mark.parametrize(
    ("change", "key"),
    [
        (("180 deg/s", "180 rpm"), "throw.speed"),  # 6 times too fast, 36 times too many turns
        (("180 deg/s", "960 deg/s"), "throw.speed"),
        (('"-8 mm"', '"60 mm"'), "arm.surface_height"),
        (('thickness = "2 mm"', 'thickness = "0.06 m"'), "part.mass.plate_thickness"),
        (
            ("[tolerance]\n", '[tolerance]\n"arm.surface_height" = "50 mm"\n'),
            'tolerance."arm.surface_height"',
        ),
        (('"throw.speed" = "0.5 %"', '"throw.speed" = "90 deg/s"'), None),
        (('"throw.speed" = "0.5 %"', '"throw.speed" = "120 deg/s"'), 'tolerance."throw.speed"'),
        # of dry materials hardly any pair has more than 1.5; a belt of soft rubber may have 2
        (("[gravity]", "[world]\nfriction = 2\n[gravity]"), None),
        (("[gravity]", "[world]\nfriction = 5\n[gravity]"), "world.friction"),
    ],
)
def test_more_that_is_improbable(change: tuple[str, str], key: str | None) -> None:
    wrong, doubts = examined(plate(change))
    assert wrong == ()
    assert [doubt.key for doubt in doubts] == ([key] if key else [])


def test_a_heavy_lead_is_told_where_the_part_tips_over_by_it() -> None:
    chamfer = '["80 mm", "0 mm"]', '["76 mm", "0 mm"], ["78.4 mm", "4 mm"]'
    goal = {"oriented_beyond": {"x": "9 m", "side": 0}}
    wrong, doubts = examined(plate(chamfer, ("18 g", "18 kg")) | {"goal": goal})
    assert [error.key for error in wrong] == ["part.mass", "goal.oriented_beyond.x"]
    assert [doubt.key for doubt in doubts] == ["part.mass.points[0].mass"]


@pytest.mark.parametrize("unit", ["g/cc", "g/ml", "kg/dm^3"])
def test_a_density_of_a_volume_is_told_the_units_of_one(unit: str) -> None:
    (error,) = examined(plate(("7850 kg/m^3", f"2.7 {unit}")))[0]
    assert "mass per volume" in error.allowed
    assert error.remedy.endswith("did you mean 'g/cm^3'?")


def test_the_one_key_that_is_missing_is_what_was_meant() -> None:
    wrong = examined(plate(("mass = ", "weight = "), ("points[0].mass", "points[0].x")))[0]
    assert [error.key for error in wrong] == ["part.mass.points[0].weight"]
    assert wrong[0].remedy.endswith("did you mean 'mass'?")
    wrong = examined(plate(("points = ", "point = "), ("mass = ", "weight = "), ("18 g", "18 gr")))[0]
    points = "part.mass.points[0]"
    assert [error.key for error in wrong] == ["part.mass.point", f"{points}.weight", f"{points}.mass"]
    assert "'gr'" in wrong[2].remedy


def test_what_follows_from_a_wrong_key_is_not_told() -> None:
    assert keys(plate(('x = "58 mm"', 'x = "158 mm"'))) == ["part.mass.points"]


def test_vertices_in_the_wrong_order_hide_nothing() -> None:
    misspelt = ('"throw.speed" =', '"throw.sped" =')
    tree = plate(misspelt, ('"180 deg/s"', '"-160 deg/s"'), ('"30 deg"', '"120 deg"'))
    rest = ["gravity.tilt", 'tolerance."throw.sped"', "throw.speed"]
    tree["part"]["vertices"].reverse()
    assert sorted(keys(tree)) == sorted(["part.vertices", *rest])
    tree["part"]["vertices"][:2] = tree["part"]["vertices"][1::-1]  # the boundary crosses itself
    assert sorted(keys(tree)) == sorted(["part.vertices", *rest])
