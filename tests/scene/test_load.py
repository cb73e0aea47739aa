import math
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from limitsets.feeder.goals import AttractsAll, FlipOrder, OrientedBeyond, Reaches, StaysOnArm
from limitsets.feeder.scene import Deviation, Effects, Scatter, Scene, World, dump, load, scenes
from limitsets.feeder.scene.surroundings import BeyondSensor, ChosenThrow, Feedback

# kappa, speed for information [deg/s], arm's length, height, flight, flip (docs/model.md, the four paper scenes)
PAPER = {
    "paper-initial-small-angle": (85.2549144, 86.22, 40.0, -1.0, "small-angle", "energy"),
    "paper-designed-small-angle": (48.6228609, 114.16, 40.0, -1.0, "small-angle", "energy"),
    "paper-initial": (33.3605945, 137.83, 28.0, -0.2, "exact", "signed"),
    "paper-designed": (25.3778518, 158.02, 28.0, -0.2, "exact", "signed"),
}


def test_lists_the_built_in_scenes() -> None:
    assert scenes() == sorted([*PAPER, "paper-quadrilateral", "paper-triangle"])


@pytest.mark.parametrize("name", PAPER)
def test_paper_scenes(name: str) -> None:
    kappa, speed, length, height, flight, flip = PAPER[name]
    scene = load(name)
    assert (scene.name, scene.unit, scene.file) == (name, "in", name)
    assert (scene.kappa, scene.arm_length, scene.surface_height) == (kappa, length, height)
    assert (scene.flight, scene.flip, scene.radius_of_gyration) == (flight, flip, 1.25)
    assert scene.goal == OrientedBeyond(20.0, 2)
    assert math.degrees(scene.value("throw.speed")) == pytest.approx(speed, abs=0.006)
    assert scene.sides.length.tolist() == [5.75, 3.6, 6.75]
    assert (scene.world, scene.effects, scene.tolerance) == (World(), Effects(), {})


def test_every_section(whole: dict[str, Any]) -> None:
    scene = load(whole)
    rate = math.radians(158.02)
    assert scene.gravity == pytest.approx(386.0885826771653 / 2, rel=1e-15)
    assert scene.kappa == pytest.approx(386.0885826771653 / 2 / rate**2, rel=1e-15)
    assert scene.world == World(
        0.9,
        0.4,
        0.01,
        math.radians(5),
        Scatter(Deviation(0.01, relative=True), Deviation(0.05, relative=False)),
        {"throw_rate": 2.0},
    )
    assert scene.effects == Effects(auto=True)
    assert scene.tolerance == {
        "throw.speed": Deviation(0.01, relative=True),
        "part.sides[1]": Deviation(0.01, relative=False),
    }
    assert scene.feedback == Feedback(
        (ChosenThrow("own", "throw.speed", "158.02 deg/s"), ChosenThrow("slow", "throw.kappa", "30 in")),
        BeyondSensor(20.0, 0.1),
    )


def test_plate_with_a_point_mass(plate: dict[str, Any]) -> None:
    """The point weighs as much as the plate of 24 cm^2: the centre is half way, 1 cm and 1 cm from each."""
    scene = load(plate)
    assert scene.unit == "cm"
    assert scene.kappa == 60.0
    assert scene.surface_height == -0.5
    assert scene.centre == pytest.approx((3.0, 1.5))
    # (36 + 16)/12 for the plate about its own centre, 1/4 for either half about the common one
    assert scene.radius_of_gyration == pytest.approx(math.sqrt((52 / 12) / 2 + 0.25))
    np.testing.assert_allclose(scene.sides.a, [3.0, 2.5, 3.0, 1.5])
    np.testing.assert_allclose(scene.sides.d, [1.5, 3.0, 2.5, 3.0])


def test_a_density_of_volume_and_a_thickness_are_one_of_area(plate: dict[str, Any]) -> None:
    """1 g/cm^3 times 2 mm is 2 kg/m^2."""
    wanted = load(plate)
    for density, thickness in (
        ("1000 kg/m^3", "2 mm"),
        ("1 g/cm^3", "2000 \u00b5m"),
        ("0.5 g/cm^3", "0.4 cm"),
    ):
        plate["part"]["mass"] |= {"plate_density": density, "plate_thickness": thickness}
        scene = load(plate)
        assert scene.centre == pytest.approx(wanted.centre, rel=1e-15)
        assert scene.radius_of_gyration == pytest.approx(wanted.radius_of_gyration, rel=1e-15)
        assert load(dump(scene)) == scene
        assert load(dump(scene)).as_dict() == plate
    del plate["part"]["mass"]["plate_thickness"]
    plate["part"]["mass"]["plate_density"] = "0.2 g/cm^2"
    assert load(plate).radius_of_gyration == pytest.approx(wanted.radius_of_gyration, rel=1e-15)


def test_units_of_other_workshops(plate: dict[str, Any]) -> None:
    """The same scene in micrometres, milligrams and turns per minute; the file keeps its signs."""
    plate["throw"], plate["gravity"] = {"speed": "150 deg/s"}, {"tilt": "30 deg"}
    plate["goal"] = {"oriented_beyond": {"x": "5 cm", "side": 0}}
    wanted = load(plate)
    plate["throw"], plate["gravity"] = {"speed": "25 rpm"}, {"tilt": "30\u00b0"}
    plate["arm"] = {"surface_height": "-5000 \u00b5m", "length": "700000 \u00b5m"}
    plate["part"]["mass"]["points"][0]["mass"] = "4800 mg"
    plate["goal"] = {"oriented_beyond": {"x": "50000 \u03bcm", "side": 0}}
    plate["world"] = {"stroke": "5 \u00b0"}
    plate["tolerance"] = {"throw.speed": "0.5 rpm", "arm.surface_height": "2 \u00b5m"}
    scene = load(plate)
    assert scene.unit == "um"
    assert scene.value("throw.speed") == pytest.approx(math.radians(150), rel=1e-15)
    assert scene.kappa == pytest.approx(1e4 * wanted.kappa, rel=1e-15)
    assert scene.sides.d == pytest.approx(1e4 * wanted.sides.d, rel=1e-14)
    assert scene.radius_of_gyration == pytest.approx(1e4 * wanted.radius_of_gyration, rel=1e-14)
    assert scene.goal == OrientedBeyond(50000.0, 0)
    assert scene.tolerance["arm.surface_height"].value == 2.0
    assert dump(load(dump(scene))) == dump(scene)
    assert load(dump(scene)).as_dict() == plate
    assert scene.with_values({"throw.speed": "30 rpm"}).value("throw.speed") == pytest.approx(
        math.pi, rel=1e-15
    )
    assert scene.with_values({"arm.length": "0.8 m"}).unit == "um"


@pytest.mark.parametrize(
    ("goal", "expected"),
    [
        ({"oriented_beyond": {"x": "508 mm", "side": 2}}, OrientedBeyond(20.0, 2)),
        (
            {"reaches": {"x": "2 ft", "side": 0, "every_orbit": True}, "from_anywhere": True},
            Reaches(24.0, 0, every_orbit=True, from_anywhere=True),
        ),
        ({"attracts_all": True}, AttractsAll()),
        ({"flip_order": [0, 1, 2]}, FlipOrder((0, 1, 2))),
        ({"stays_on_arm": True, "from_anywhere": False}, StaysOnArm()),
    ],
)
def test_goals(whole: dict[str, Any], goal: dict[str, Any], expected: object) -> None:
    scene = load(whole | {"goal": goal})
    assert scene.goal == expected
    assert load(dump(scene)).goal == expected


@pytest.mark.parametrize("source", [*PAPER, "whole", "plate"])
def test_load_dump_load_is_the_identity(source: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    given = source if source in PAPER else request.getfixturevalue(source)
    scene = load(given)
    file = tmp_path / "scene.toml"
    text = dump(scene, file)
    for again in (load(text), load(file), load(str(file)), load(scene.as_dict())):
        assert again == scene
        assert again.as_dict() == scene.as_dict()
        assert dump(again) == text
        assert_same_numbers(again, scene)
    if isinstance(given, Mapping):
        assert tomllib.loads(text) == given
    assert load(file).file == str(file)


def assert_same_numbers(one: Scene, other: Scene) -> None:
    for name in (
        "kappa",
        "centre",
        "radius_of_gyration",
        "surface_height",
        "arm_length",
        "gravity",
        "tolerance",
        "feedback",
    ):
        assert getattr(one, name) == getattr(other, name)
    for name in ("a", "d", "length", "right", "corner"):
        np.testing.assert_array_equal(getattr(one.sides, name), getattr(other.sides, name))


def test_dump_keeps_the_words_of_quantities(whole: dict[str, Any]) -> None:
    whole["arm"]["length"] = "28.000e0 in"
    whole["arm"]["surface_height"] = "-.508  cm"
    text = dump(load(whole))
    assert '"28.000e0 in"' in text
    assert '"-.508  cm"' in text


def test_dump_replaces_a_file_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "scene.toml"
    file.write_text("precious")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", full)
        with pytest.raises(Exception, match="No space left"):
            dump(load("paper-designed"), file)
    assert file.read_text() == "precious"
    assert [entry.name for entry in tmp_path.iterdir()] == ["scene.toml"]
    dump(load("paper-designed"), file)
    assert load(file) == load("paper-designed")
    assert [entry.name for entry in tmp_path.iterdir()] == ["scene.toml"]


def test_name_comes_from_the_file_where_it_is_left_out(whole: dict[str, Any], tmp_path: Path) -> None:
    del whole["name"]
    text = dump(load(whole)).replace('name = "scene"\n', "")
    for stem, name in [("mine-2", "mine-2"), ("_odd", "scene")]:
        (tmp_path / f"{stem}.toml").write_text(text)
        scene = load(tmp_path / f"{stem}.toml")
        assert scene.name == name
        assert load(dump(scene)) == scene


def test_a_byte_order_mark_and_foreign_line_ends_are_read(tmp_path: Path) -> None:
    text = dump(load("paper-designed")).replace("\n", "\r\n")
    (tmp_path / "scene.toml").write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert load(tmp_path / "scene.toml") == load("paper-designed")


def test_equality_is_that_of_the_words(whole: dict[str, Any]) -> None:
    assert load(whole) == load(whole)
    assert hash(load(whole)) == hash(load(whole))
    assert load(whole) != load("paper-designed")
    assert load(whole) != "whole"
    copied = load(whole).as_dict()
    copied["arm"]["length"] = "1 in"
    assert load(whole).as_dict() != copied


def test_map_is_the_throw_of_the_scene() -> None:
    scene = load("paper-designed")
    assert scene.map is scene.map
    assert scene.map.kappa == 25.3778518
    assert scene.map.arm_length == 28.0
    np.testing.assert_array_equal(scene.map.corner, scene.sides.corner)


def test_domain_begins_just_beyond_the_feet() -> None:
    scene = load("paper-designed")
    domain, a = scene.domain, scene.sides.a
    assert scene.domain is domain
    np.testing.assert_allclose(np.ravel(domain.lo) - a, 1e-6 * (28.0 - a), rtol=1e-6)
    assert np.ravel(domain.hi).tolist() == [28.0] * 3
    np.testing.assert_array_equal(domain.anchor, a)


def test_reading_a_scene_loads_little() -> None:
    """Numba takes a second, and is not needed for a scene; pydantic only to read."""
    code = (
        "import sys, limitsets.scene as scene\n"
        "heavy = ('numba', 'pydantic', 'scipy')\n"
        "print([name for name in heavy if name in sys.modules])\n"
        "scene.load('paper-designed')\n"
        "print([name for name in heavy if name in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["[]", "['pydantic']"]
