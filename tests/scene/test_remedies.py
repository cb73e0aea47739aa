"""What a refusal and `check` tell to do: the way out, and nothing that only follows from what is told already."""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import LimitsetsError, SceneError
from limitsets.feeder.scene.checking import examined
from limitsets.parameters.design import robust_design
from limitsets.parameters.design.for_goal import design_for_goal
from tests import plates
from tests.scene.test_chamfer import BOTH, chamfered

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


@pytest.mark.parametrize(
    "command",
    [
        lambda scene: design_for_goal(scene),
        lambda scene: robust_design(scene),
        lambda scene: ls.feed(scene),
        lambda scene: ls.tray(scene),
        lambda scene: ls.feedback(scene),
        lambda scene: ls.assemble(scene, scene),
    ],
)
def test_what_does_not_take_a_chamfer_names_the_way_out(command: Any) -> None:
    goal = {"oriented_beyond": {"x": "20 cm", "side": 1}}
    with pytest.raises(LimitsetsError) as caught:
        command(ls.load(chamfered(effects=BOTH, goal=goal)))
    assert "cannot rest on side 3" in str(caught.value)
    assert "draw the part without it" in caught.value.remedy
    assert "[cavity]" not in caught.value.remedy


def test_a_chamfer_with_a_cavity_is_told_the_same() -> None:
    cavity = {"position": "30 cm", "width": "10 cm", "depth": "4 cm", "angle": "40 deg"}
    with pytest.raises(SceneError, match="draw the part without it"):
        ls.load(chamfered(effects=BOTH, cavity=cavity))


def test_the_way_out_works() -> None:
    """The edges beside the chamfer of this square meet in the corner (4, 4)."""
    tree = chamfered()
    tree["part"]["vertices"][2:4] = [["4 cm", "4 cm"]]
    assert ls.load(tree).sides.rests.all()


def test_an_example_is_in_the_unit_of_the_scene() -> None:
    with pytest.raises(LimitsetsError, match=r'position = "300 mm"'):
        ls.feed(ls.load(plate() | {"goal": {"oriented_beyond": {"x": "300 mm", "side": 1}}}))


def test_a_concave_part_is_told_its_hull_ready_to_paste() -> None:
    with pytest.raises(SceneError) as caught:
        ls.load(l_shaped())
    assert "convex hull" in caught.value.remedy
    pasted = caught.value.remedy.partition("vertices = ")[2].partition("]]")[0] + "]]"
    corners = tomllib.loads(f"vertices = {pasted}")["vertices"]
    # all but the inward corner (20, 20), counterclockwise
    assert {tuple(pair) for pair in corners} == {
        (f"{x} mm", f"{y} mm") for x, y in L_SHAPED if (x, y) != (20, 20)
    }
    tree = l_shaped()
    tree["part"] = {
        "vertices": corners,
        "mass": {
            "center": {"side": 0, "along": "30 mm", "above": "30 mm"},
            "radius_of_gyration": "29 mm",
        },
    }
    tree["tolerance"] = {}
    assert not [error for error in examined(tree)[0] if error.key == "part.vertices"]


def test_the_worked_example_of_the_page_is_the_sum_of_its_pieces() -> None:
    """Two rectangles and a point: areas, centres, and moments by the parallel-axis rule, in mm and g."""
    page = (Path(__file__).parents[2] / "docs" / "scene.md").read_text(encoding="utf-8")
    lines = re.findall(
        r"`((?:vertices|center|radius_of_gyration) = .*?)`", page.partition("**A concave part**")[2]
    )
    tree = plate() | {"tolerance": {}}
    tree["part"] = tomllib.loads(lines[0]) | {"mass": tomllib.loads("\n".join(lines[1:3]))}
    scene = ls.load(tree)
    assert scene.sides.rests.all()
    by_area = 7850e-9 * 2.0 * 1e3  # g/mm^2
    pieces = [(80 * 40, 40, 20, 80**2 + 40**2), (40 * 40, 20, 60, 40**2 + 40**2)]
    parts = [(area * by_area, x, y, squares / 12) for area, x, y, squares in pieces] + [(18.0, 60, 20, 0.0)]
    told = (2, (33.333, 33.333), 31.269), (3, scene.centre, scene.radius_of_gyration)
    for count, centre, radius in told:
        mass, x, y, own = np.array(parts[:count]).T
        cx, cy = (mass @ x) / mass.sum(), (mass @ y) / mass.sum()
        assert (cx, cy) == pytest.approx(centre, abs=5e-4)
        rho = math.sqrt(mass @ (own + (x - cx) ** 2 + (y - cy) ** 2) / mass.sum())
        assert rho == pytest.approx(radius, abs=5e-4)


def test_points_beside_a_measured_mass_are_told_how_to_be_added() -> None:
    tree = plate()
    center = {"side": 0, "along": "40 mm", "above": "20 mm"}
    tree["part"]["mass"] |= {"center": center, "radius_of_gyration": "25 mm"}
    with pytest.raises(SceneError, match="parallel-axis"):
        ls.load(tree)


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
    tree = plate(
        ('"throw.speed" =', '"throw.sped" ='), ('"180 deg/s"', '"-160 deg/s"'), ('"30 deg"', '"120 deg"')
    )
    rest = ["gravity.tilt", 'tolerance."throw.sped"', "throw.speed"]
    tree["part"]["vertices"].reverse()
    assert sorted(keys(tree)) == sorted(["part.vertices", *rest])
    tree["part"]["vertices"] = l_shaped()["part"]["vertices"]
    assert sorted(keys(tree)) == sorted(["part.vertices", *rest])
