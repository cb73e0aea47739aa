"""Scenes: reading them, the documented ones, garbage, chamfers."""

from __future__ import annotations

import copy
import math
import re
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import limitsets as ls
from limitsets.base.errors import GridError, MapError, SceneError, TipsError
from limitsets.feeder.goals import OrientedBeyond, Reaches, StaysOnArm
from limitsets.feeder.scene import (
    Deviation,
    Effects,
    Scatter,
    Scene,
    World,
    dump,
    load,
    load_to_analyse,
    scenes,
)
from limitsets.feeder.scene.quantities import NAMES
from limitsets.feeder.scene.schema import schema
from limitsets.feeder.scene.surroundings import BeyondSensor, ChosenThrow, Feedback
from limitsets.feeder.thrower import trace
from limitsets.feeder.thrower.effects import EFFECTS

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
    scatter = Scatter(Deviation(0.01, relative=True), Deviation(0.05, relative=False))
    stated = {"friction": 0.9, "restitution": 0.4, "bounce_threshold": 0.01, "stroke": math.radians(5)}
    assert scene.world == World(stated | {"throw_rate": 2.0}, scatter)
    assert scene.effects == Effects(auto=True)
    assert scene.tolerance == {
        "throw.speed": Deviation(0.01, relative=True),
        "part.sides[1]": Deviation(0.01, relative=False),
    }
    own, slow = ("own", "throw.speed", "158.02 deg/s"), ("slow", "throw.kappa", "30 in")
    assert scene.feedback == Feedback((ChosenThrow(*own), ChosenThrow(*slow)), BeyondSensor(20.0, 0.1))


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
    volumes = (("1000 kg/m^3", "2 mm"), ("1 g/cm^3", "2000 \u00b5m"), ("0.5 g/cm^3", "0.4 cm"))
    for density, thickness in volumes:
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
    half_turn = scene.with_values({"throw.speed": "30 rpm"}).value("throw.speed")
    assert half_turn == pytest.approx(math.pi, rel=1e-15)
    assert scene.with_values({"arm.length": "0.8 m"}).unit == "um"


@pytest.mark.parametrize(
    ("goal", "expected"),
    [
        ({"oriented_beyond": {"x": "508 mm", "side": 2}}, OrientedBeyond(20.0, 2)),
        (
            {"reaches": {"x": "2 ft", "side": 0, "every_orbit": True}, "from_anywhere": True},
            Reaches(24.0, 0, every_orbit=True, from_anywhere=True),
        ),
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
    numbers = "kappa centre radius_of_gyration surface_height arm_length gravity tolerance feedback"
    for name in numbers.split():
        assert getattr(one, name) == getattr(other, name)
    for name in ("a", "d", "length", "right", "corner"):
        np.testing.assert_array_equal(getattr(one.sides, name), getattr(other.sides, name))


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


def test_map_is_the_throw_of_the_scene_and_its_domain_begins_just_beyond_the_feet() -> None:
    scene = load("paper-designed")
    assert scene.map is scene.map
    assert scene.map.kappa == 25.3778518
    assert scene.map.arm_length == 28.0
    np.testing.assert_array_equal(scene.map.corner, scene.sides.corner)
    domain, a = scene.domain, scene.sides.a
    assert scene.domain is domain
    np.testing.assert_allclose(np.ravel(domain.lo) - a, 1e-6 * (28.0 - a), rtol=1e-6)
    assert np.ravel(domain.hi).tolist() == [28.0] * 3
    np.testing.assert_array_equal(domain.anchor, a)


def test_reading_a_scene_loads_little() -> None:
    """Numba takes a second, scipy a third of one; neither is needed for a scene."""
    code = (
        "import sys, limitsets.scene as scene\n"
        "heavy = ('numba', 'scipy')\n"
        "print([name for name in heavy if name in sys.modules])\n"
        "scene.load('paper-designed')\n"
        "print([name for name in heavy if name in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["[]", "[]"]


# ----------------------------------------------------------------
# docs/scene.md: its example loads, and its table has the keys that there are.


PAGE = (Path(__file__).resolve().parents[2] / "docs" / "scene.md").read_text(encoding="utf-8")


TABLES = {
    "part",
    "part.mass",
    *["arm", "throw", "gravity", "model", "goal", "cavity", "tray", "world", "effects", "feedback"],
}


def keys(table, path=""):
    """Every key of the schema by its whole name; what is written in one line counts as one key."""
    for name, key in table.keys.items():
        if f"{path}{name}" in TABLES:
            yield from keys(key.of, f"{path}{name}.")
        else:
            yield f"{path}{name}"


def test_the_example_loads_and_has_a_margin_of_its_own():
    text, *_ = re.findall(r"```toml\n(.*?)```", PAGE, re.S)
    scene = ls.load(tomllib.loads(text))
    assert (scene.unit, scene.sides.a.size) == ("mm", 4)
    path = ls.orbit(scene.map, 300.0, 0, 1000)
    assert len(path.x) > 1000  # none of these throws leaves the arm


def documented():
    """The keys in the first column of the table: a word that begins with a point is in the table of the first one."""
    for line in PAGE.splitlines():
        names = re.findall(r"`([^`]+)`", line.split("|")[1]) if line.startswith("| `") else []
        for name in names:
            yield names[0].rpartition(".")[0] + name if name.startswith(".") else name.partition('."')[0]


def test_the_table_has_the_keys_that_there_are():
    assert sorted(documented()) == sorted(keys(schema(with_effects=True)))


def test_the_model_s_table_has_every_effect_and_the_facts_that_it_needs():
    page = (Path(__file__).resolve().parents[2] / "docs" / "model.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \|([^|]*)\|", page.split("## Effects", 1)[1], re.M)
    told = {name: tuple(re.findall(r"`(\w+)`", facts)) for name, facts in rows}
    assert told == {name: effect.needs for name, effect in EFFECTS.items()}


def test_every_quantity_is_named():
    for name in NAMES:
        last = name.rpartition(".")[2]
        assert f"`{name}`" in PAGE or (f"`.{last}`" in PAGE and name.startswith("part."))


# ----------------------------------------------------------------
# Whatever is read is a scene or one SceneError.


DESIGNED = load("paper-designed").as_dict()
UNITS = st.sampled_from(["in", "cm", "m", "deg", "rad", "deg/s", "%", "kg", "1/s", ""])
ODD = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.binary(max_size=4)
    | st.builds("{} {}".format, st.floats() | st.integers(-40, 40), UNITS),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6) | st.integers(), inner, max_size=3)
    ),
    max_leaves=4,
)


def places(node: Any) -> list[tuple[Any, Any]]:
    """List every place of a structure that holds something, as its holder and its key."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    return [place for key, value in items for place in [(node, key), *places(value)]]


@settings(max_examples=70)
@given(st.data())
def test_spoilt_structures(data: st.DataObject) -> None:
    table = copy.deepcopy(DESIGNED)
    for _ in range(data.draw(st.integers(1, 3))):
        found = places(table)
        holder, key = found[data.draw(st.integers(0, len(found) - 1))]
        if data.draw(st.booleans()):
            holder[key] = data.draw(ODD)
        else:
            del holder[key]
        if not table:
            break
    try:
        scene = load(table)
    except SceneError:
        return
    assert load(dump(scene)) == scene


TEXT = dump(load("paper-designed"))


@settings(max_examples=70)
@given(st.integers(0, len(TEXT)), st.integers(0, 12), st.text(max_size=12))
def test_spoilt_text(place: int, length: int, other: str) -> None:
    try:
        scene = load(TEXT[:place] + other + TEXT[place + length :] + "\n")
    except SceneError:
        return
    assert load(dump(scene)) == scene


# ----------------------------------------------------------------
# A part with a side on which it cannot rest: what loads, what is refused and how, and where its states lie.


BOTH = {"landing": True, "roll": True}
CHAMFER = 3


def chamfered(**tables: Any) -> dict[str, Any]:
    """A square plate of 4 cm with a corner cut off, on which it tips over the right end."""
    corners = ((0, 0), (4, 0), (4, 3.6), (3.0, 4), (0, 4))
    vertices = [[f"{x} cm", f"{y} cm"] for x, y in corners]
    return {
        "name": "chamfered",
        "part": {"vertices": vertices, "mass": {"plate_density": "23.55 kg/m^2"}},
        "arm": {"surface_height": "-3 mm", "length": "40 cm"},
        "throw": {"kappa": "20 cm"},
    } | tables


def test_the_error_names_the_lines_to_add() -> None:
    with pytest.raises(TipsError) as caught:
        ls.load(chamfered())
    assert "the part cannot rest on side 3: it tips over the right end by 0.197 cm" in str(caught.value)
    assert "add landing = true and roll = true to [effects]" in str(caught.value)
    assert caught.value.key == "part.mass"
    for effects in ({"roll": True}, {"landing": True}, {"landing": True, "roll": False}):
        with pytest.raises(TipsError):
            ls.load(chamfered(effects=effects))


def test_with_the_lines_it_loads_and_has_no_states_on_the_chamfer() -> None:
    scene = ls.load(chamfered(effects=BOTH))
    assert scene.sides.rests.tolist() == [True, True, True, False, True]
    assert scene.domain.inhabited.tolist() == scene.sides.rests.tolist()
    cells = ls.grid(scene.domain, cells=100)
    assert cells.shape[:, 0].tolist() == [100, 100, 100, 0, 100]
    assert (cells.index([1.0, 20.0, scene.arm_length], CHAMFER) == -1).all()
    assert (cells.index([20.0, scene.arm_length], 0) >= 0).all()
    assert cells.side_of([299, 300]).tolist() == [2, 4]
    assert cells.refine(3).shape[:, 0].tolist() == [300, 300, 300, 0, 300]
    assert ls.load(scene.as_dict()) == scene


SMALL_CAVITY = {"position": "39 cm", "width": "9 cm", "depth": "2 cm", "angle": "45 deg"}
ONE_THROW = {"sensor": {"side": 0}, "throws": [{"name": "one", "kappa": "20 cm"}]}


def test_what_knows_nothing_of_a_chamfer_is_refused() -> None:
    for tables, key, words in (
        ({"model": {"flip": "energy"}}, "model.flip", "signed"),
        (
            {"effects": BOTH | {"drive": True}, "world": {"stroke": "5 deg"}},
            "effects.drive",
            "rest on side 3",
        ),
        ({"goal": {"oriented_beyond": {"x": "10 cm", "side": 3}}}, "goal.oriented_beyond.side", "0, 1, 2, 4"),
        ({"goal": {"flip_order": [0, 3]}}, "goal.flip_order[1]", "cannot rest on it"),
        ({"cavity": SMALL_CAVITY}, "cavity", "rests on each of its sides.*draw the part without it"),
        ({"feedback": ONE_THROW}, "feedback", "rests on each of its sides"),
    ):
        with pytest.raises(SceneError, match=words) as caught:
            ls.load(chamfered(**{"effects": BOTH, **tables}))
        assert caught.value.key == key


def test_only_what_analyse_reads_switches_the_effects_on() -> None:
    scene, switched = load_to_analyse(chamfered())
    assert switched == ("landing", "roll")
    assert scene.as_dict()["effects"] == BOTH
    assert load_to_analyse(chamfered(effects={"roll": True}))[1] == ("landing",)
    assert load_to_analyse(chamfered(effects=BOTH))[1] == ()
    assert load_to_analyse("paper-designed") == (ls.load("paper-designed"), ())
    with pytest.raises(SceneError, match='flight = "exact"'):
        load_to_analyse(chamfered(model={"flight": "small-angle"}))


def test_no_throw_begins_on_a_chamfer() -> None:
    thrown = ls.load(chamfered(effects=BOTH)).map
    with pytest.raises(MapError, match="0, 1, 2, 4; it tips over on side 3"):
        trace(thrown, 20.0, CHAMFER)
    assert trace(thrown, 20.0, 0).code[0] >= 0


def test_a_domain_has_states_somewhere_and_no_box_that_is_empty_in_part() -> None:
    from limitsets.systems.cells import Domain

    assert Domain([[0.0], [1.0]], [[1.0], [1.0]]).inhabited.tolist() == [True, False]
    for lo, hi in (([[1.0]], [[1.0]]), ([[0.0, 1.0]], [[1.0, 1.0]]), ([[2.0], [0.0]], [[1.0], [1.0]])):
        with pytest.raises(GridError, match="lo < hi"):
            Domain(np.array(lo), np.array(hi))
