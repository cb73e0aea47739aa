"""A scene to start from, all that is wrong with a scene at once, and what is installed."""

import csv
import re
import sys
import tomllib
from pathlib import Path

import pytest

import limitsets as ls
from limitsets.base.errors import SceneError
from limitsets.feeder.scene.checking import examined
from limitsets.feeder.scene.schema import Section, Several, schema
from limitsets.feeder.scene.starting import starting_text
from limitsets.feeder.scene.validation import refusals
from tests.cli.command import documented, json_of, names_in, prints, refusal, run, written

LEAD = """
part.vertices = [["0 mm", "0 mm"], ["146 mm", "0 mm"], ["100 mm", "90 mm"]]
part.mass.plate_density = "3.805 kg/m^2"
part.mass.points = [{ x = "80 mm", y = "20 mm", mass = "40 kg" }]
arm = { surface_height = "-5 mm", length = "700 mm" }
throw.speed = "158 deg/s"
gravity.tilt = "30 deg"
"""


def problems(source):
    return examined(source)[0]


SWITCH = re.compile(r'^# (?=\[|[a-z_]+ = |"[a-z.]+" = )', re.M)


def keys_of(table, path=()):
    """Every key of a table of the schema, with those of the tables in it."""
    for name, key in table.keys.items():
        yield (*path, name), key
        for each in tables(key.of):
            yield from keys_of(each, (*path, name))


def tables(of):
    inner = of.of if isinstance(of, Several) else of
    return [inner] if isinstance(inner, Section) else []


def test_the_new_scene_loads_and_is_the_designed_feeder(capfd):
    assert prints(capfd, "new 'my part.toml'").splitlines()[0] == "scene: my part.toml"
    found = ls.load("my part.toml")
    assert found.as_dict() == ls.load("paper-designed").as_dict() | {"name": "my part"}
    before = Path("my part.toml").read_bytes()
    refusal(capfd, "new 'my part.toml'")
    assert Path("my part.toml").read_bytes() == before
    assert names_in() == {"my part.toml"}


@pytest.mark.parametrize("name", ["mine.txt", "no folder/mine.toml", "mine"])
def test_a_name_that_cannot_be(name, capfd):
    refusal(capfd, "new", name)
    assert not names_in()


def test_every_key_of_the_schema_stands_in_it_with_its_words_and_an_example_that_fits():
    text = starting_text("all", "all.toml")
    tree = tomllib.loads(SWITCH.sub("", text))
    # it has all words that exclude each other
    both = {"part", "part.mass", "part.holes", "gravity", "throw", "cavity", "tray"}
    assert {error.key for error in refusals(tree, None)} == both
    for path, key in keys_of(schema(with_effects=True)):
        assert re.search(rf"\b{path[-1]}\b", text), path
        if len(path) == 2:
            assert path[1] in tree[path[0]], path
        inner = list(tables(key.of))
        assert key.says or (inner and len(path) < 3 and inner[0].says), path


WRONG = """
part.sides = ["5.75 in", "3.6 in", "6.75 in"]
part.mass.center = { side = 2, along = "4.2 kg", above = "0.7 in" }
part.mass.radius_of_gyration = 1.25
arm = { surface_height = "-0.2 in", lenght = "28 in" }
throw.kappa = "25 in"
goal.oriented_beyond = { x = "20 in", side = "two" }
"""


def test_all_errors_of_a_file_are_told_at_once(capfd):
    Path("wrong.toml").write_text(WRONG, encoding="utf-8")
    code, out, err = run(capfd, "check wrong.toml")
    assert (code, err) == (2, "")
    told = out.splitlines()
    mass = ["part.mass.center.along", "part.mass.radius_of_gyration"]
    keys = ["arm.lenght", *mass, "goal.oriented_beyond.side"]
    for key in keys:
        assert sum(line.startswith(f"wrong.toml: {key}: ") for line in told) == 1, key
    assert told[-1] == "wrong.toml: 4 things are wrong"
    records = json_of(capfd, "check wrong.toml --csv wrong.csv", code=2)
    assert {record["key"] for record in records} == set(keys)
    assert all(set(record) == documented("check") for record in records)
    rows = list(csv.DictReader(Path("wrong.csv").read_text(encoding="utf-8").splitlines()))
    assert [row["key"] for row in rows] == [record["key"] for record in records]


@pytest.mark.parametrize("text", ["a = = 1", "", '[part]\nsides = "no"'])
def test_the_first_error_of_load_is_among_them(text, tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(SceneError) as caught:
        ls.load(file)
    assert str(caught.value) in {str(error) for error in problems(file)}


def test_a_scene_that_is_right(capfd):
    first, *told = prints(capfd, "check paper-designed").splitlines()
    assert first == "paper-designed: nothing is wrong"
    # sqrt(193.045 / 25.3778518) rad/s
    speed = "throw.kappa gives the throw, and gravity changes none: it tells which speed that is, 158 deg/s"
    assert told == [f"paper-designed: {speed}"]
    assert json_of(capfd, "check paper-designed") == []


def test_the_doctor_says_what_is_there(capfd, tmp_path):
    record = json_of(capfd, "doctor --csv packages.csv")
    assert set(record) == documented("doctor")
    assert record["limitsets"] == ls.__version__
    assert {"numba", "typer"} <= {each["package"] for each in record["packages"] if each["extra"] is None}
    assert {each["extra"] for each in record["packages"]} >= {"atlas", "engine", "cluster", "explore"}
    assert Path(record["cache"]["folder"]).is_dir()
    rows = list(csv.DictReader((tmp_path / "packages.csv").read_text(encoding="utf-8").splitlines()))
    assert [row["package"] for row in rows] == [each["package"] for each in record["packages"]]


def test_the_doctor_names_the_line_that_installs_an_extra(capfd, monkeypatch):
    import importlib.metadata

    from limitsets.face.cli import scenes as doctor

    def version(name):
        if name == "pymunk":
            raise importlib.metadata.PackageNotFoundError(name)
        return "1.0"

    monkeypatch.setattr(doctor, "version", version)
    out = prints(capfd, "doctor")
    assert "extra engine is missing: pip install 'limitsets[engine]'" in out


def test_the_doctor_works_where_packages_are_lost(capfd, monkeypatch):
    monkeypatch.setitem(sys.modules, "limitsets.numbers.jit.cache", None)
    monkeypatch.setattr(
        "limitsets.face.cli.scenes.requires", lambda name: ["numba>=0.68", "no-such-package-of-ours>=1"]
    )
    out = prints(capfd, "doctor", code=1)
    assert "missing, and needed by every command: pip install no-such-package-of-ours" in out
    assert "compiled code is not kept: " in out


def test_the_doctor_clears_the_compiled_code(capfd, monkeypatch, tmp_path):
    folder = tmp_path / "cache" / "one version"
    folder.mkdir(parents=True)
    (folder / "code").write_bytes(b"x" * 1000)
    monkeypatch.setattr("limitsets.numbers.jit.cache.FOLDER", folder)
    assert json_of(capfd, "doctor")["cache"]["bytes"] == 1000
    assert folder.is_dir()
    record = json_of(capfd, "doctor --clear")["cache"]
    assert (record["bytes"], record["versions"], record["cleared"]) == (1000, 1, True)
    assert not folder.exists()


def with_tables(**tables):
    return ls.load("paper-designed").as_dict() | tables


AT_158 = {"speed": "158 deg/s"}
CAVITY = {"position": "20 in", "width": "8 in", "depth": "1 in", "angle": "30 deg"}
SHORT = {"length": "15 in", "surface_height": "0 in"}
LONG_AND_HIGH = {"arm": {"length": "2.8 m", "surface_height": "7 in"}}
GOAL_TOO_FAR = {"oriented_beyond": {"x": "200 in", "side": 2}}


@pytest.mark.parametrize(
    ("tables", "keys"),
    [
        # table by table, and of one table all
        (
            {
                "goal": GOAL_TOO_FAR,
                "cavity": CAVITY | {"position": "90 in"},
                "tolerance": {"throw.sped": "1 %"},
            },
            ["goal.oriented_beyond.x", "cavity.position", 'tolerance."throw.sped"'],
        ),
        (
            {
                "goal": {"oriented_beyond": {"x": "99 in", "side": 7}},
                "tolerance": {"throw.speed": "200 %", "arm.length": "-1 in", "gravity.tilt": "1 deg"},
                "world": {"stroke": "-30 deg", "throw_rate": "-2 Hz"},
            },
            [
                "world.stroke",
                "world.throw_rate",
                "goal.oriented_beyond.x",
                "goal.oriented_beyond.side",
                'tolerance."throw.speed"',
                'tolerance."arm.length"',
            ],
        ),
        # a cavity is not blamed for a goal that is wrong
        ({"goal": GOAL_TOO_FAR, "cavity": CAVITY}, ["goal.oriented_beyond.x"]),
        # what is wrong in [tolerance] hides nothing beside it, in it neither
        (
            {"tolerance": {"throw": {"speed": "1 %"}, "arm.lenght": "1 %", "arm.length": "-1 in"}},
            ["tolerance.throw", 'tolerance."arm.lenght"', 'tolerance."arm.length"'],
        ),
        (
            {"tolerance": {"throw.speed": 1, "arm.length": "200 %"}, "goal": GOAL_TOO_FAR},
            ['tolerance."throw.speed"', 'tolerance."arm.length"', "goal.oriented_beyond.x"],
        ),
        # a misspelt key is not missing, and what stands there is looked at
        ({"arm": {"lenght": "28 in", "surface_height": "0 in"}}, ["arm.lenght"]),
        ({"arm": {"lenght": 28, "surface_height": "0 in"}}, ["arm.lenght", "arm.length"]),
        ({"throw": {"kapa": "25 in"}, "goal": GOAL_TOO_FAR}, ["throw.kapa", "goal.oriented_beyond.x"]),
        ({"arm": {"length": "28 in", "lenght": 5, "surface_height": "0 in"}}, ["arm.lenght"]),
        # what stands in for a refused value is not blamed: a place of 20 in, and no arm at all
        ({"arm": SHORT, "goal": {"oriented_beyond": {"x": 20, "side": 2}}}, ["goal.oriented_beyond.x"]),
        ({"arm": {"length": 28, "surface_height": "0 in"}, "goal": GOAL_TOO_FAR}, ["arm.length"]),
        # nothing is missing that is only wrong
        ({"throw": AT_158, "gravity": {"acceleration": "9 m"}}, ["gravity.acceleration"]),
        ({"throw": AT_158, "gravity": {"acceleration": "-9 m/s^2"}}, ["gravity.acceleration"]),
        ({"throw": AT_158, "gravity": {"acceleration": "9 m/s^2", "tilt": "3 deg"}}, ["gravity"]),
        ({"world": {"friction": -1}, "effects": {"slip": True}}, ["world.friction"]),
        # contradictions of words stand beside all others
        (
            {"throw": AT_158 | {"kappa": "25 in"}, "arm": {"length": 28}, "tolerance": {"x": 1}},
            ["throw", "arm.length", "arm.surface_height", "tolerance.x"],
        ),
        ({"throw": AT_158 | {"kappa": "25 in"}, "goal": GOAL_TOO_FAR}, ["throw", "goal.oriented_beyond.x"]),
        # two in one table, one of its words and one of its values
        (
            {"goal": {"oriented_beyond": {"x": "200 in", "side": "two"}}},
            ["goal.oriented_beyond.side", "goal.oriented_beyond.x"],
        ),
    ],
)
def test_all_mistakes_are_told_once(tables, keys):
    assert sorted(error.key for error in problems(with_tables(**tables))) == sorted(keys)


def scatter(**sizes):
    return {"world": {"scatter": sizes}}


PLATE_OF_25_G = tomllib.loads(LEAD)


@pytest.mark.parametrize(
    ("tables", "key", "words"),
    [
        # 0.146 m * 0.09 m / 2 * 3.805 kg/m^2 = 25.0 g; 40 kg / 25 g = 1600
        (PLATE_OF_25_G, "part.mass.points[0].mass", ("'40 kg'", "1600 times the plate, which weighs 25 g")),
        # 28 in w^2 / (pi 193.045 in/s^2) turns; one turn is at 267 deg/s
        ({"throw": {"speed": "215 rad/s"}}, "throw.speed", ("'215 rad/s'", "2134 times", "to 267 deg/s")),
        ({"throw": {"speed": "2.758 deg/s"}}, "throw.speed", ("turns 0.000107 times",)),
        ({"throw": {"kappa": "25 um"}}, "throw.kappa", ("9055 times", "8.91 in")),
        ({"arm": {"length": "28 m", "surface_height": "0 in"}}, "arm.length", ("28 m long",)),
        (LONG_AND_HIGH, "arm.surface_height", ("1.04 times the part",)),
        ({"gravity": {"acceleration": "193.045 m/s^2"}}, "gravity.acceleration", ("193 m/s^2",)),
        ({"world": {"throw_rate": "120 Hz"}}, "world.throw_rate", ("120 throws a second",)),
        (scatter(speed="60 %"), "world.scatter.speed", ("'60 %'", "0.6 times the speed")),
        # sqrt(193.045 / 25.3778518) rad/s are 158.02 deg/s
        (scatter(speed="79.01 deg/s"), "world.scatter.speed", ("'79.01 deg/s'", "0.5 times the speed")),
        # the longest side is 6.75 in
        (
            scatter(landing="13.5 in"),
            "world.scatter.landing",
            ("'13.5 in'", "2 times the part's longest side"),
        ),
        ({"world": {"friction": 45}}, "world.friction", ("a coefficient of 45",)),
        (
            {"world": {"bounce_threshold": "27 in"}},
            "world.bounce_threshold",
            ("'27 in'", "4 times the part's"),
        ),
    ],
)
def test_improbable_values_are_told_and_not_refused(capfd, tables, key, words):
    tree = with_tables(**tables)
    wrong, doubts = examined(tree)
    assert not wrong
    assert [doubt.key for doubt in doubts] == [key]
    assert all(word in str(doubts[0]) for word in (*words, "usual: ", "has it the right unit?"))
    first, second, *_ = prints(capfd, f"check {written(tree, 'odd.toml')}").splitlines()
    assert first == str(doubts[0]._replace(file="odd.toml"))
    assert second == "odd.toml: nothing is wrong, 1 thing is improbable"
    (record,) = json_of(capfd, "check odd.toml")
    assert (set(record), record["improbable"]) == (documented("check"), True)


def test_of_what_has_no_usual_size_nothing_is_said():
    """A throw given by kappa without gravity has no speed; what stands in a wrong value's place is not judged."""
    tree = with_tables(**scatter(speed="79.01 deg/s"))
    del tree["gravity"]
    assert examined(tree) == ((), ())
    assert examined(with_tables(throw={"speed": "215 rad"}))[1] == ()
    tree = with_tables(arm={"length": "0 in", "surface_height": "0 in"})  # 1 in in its place is too short
    tree["part"]["mass"]["radius_of_gyration"] = "-1 in"
    wrong, doubts = examined(tree)
    assert [error.key for error in wrong] == ["arm.length", "part.mass.radius_of_gyration"]
    assert doubts == ()


def test_sizes_in_metres_are_improbable():
    tree = with_tables(arm={"length": "28 m", "surface_height": "-0.2 m"}, throw={"kappa": "25 m"})
    tree["part"]["sides"] = ["5.75 m", "3.6 m", "6.75 m"]
    tree["part"]["mass"]["center"] |= {"along": "4.2 m", "above": "0.7 m"}
    tree["goal"]["oriented_beyond"]["x"] = "20 m"
    keys = ["part.sides", "arm.length", "part.mass.radius_of_gyration"]  # that one is in inches still
    assert [doubt.key for doubt in examined(tree)[1]] == keys


def test_a_mistake_beside_the_throw_hides_nothing_improbable():
    wrong, doubts = examined(with_tables(throw={"speed": "215 rad/s"}, tolerance={"throw.sped": "1 %"}))
    assert [error.key for error in wrong] == ['tolerance."throw.sped"']
    assert [doubt.key for doubt in doubts] == ["throw.speed"]


def test_usual_plates_and_the_built_in_scenes_are_neither_wrong_nor_improbable():
    for density in ("78.5 kg/m^2", "7850 kg/m^3", "0.5 kg/m^2"):
        tree = tomllib.loads(LEAD.replace('mass = "40 kg"', 'mass = "40 g"').replace("3.805 kg/m^2", density))
        if density.endswith("3"):
            tree["part"]["mass"]["plate_thickness"] = "1 mm"
        assert examined(tree) == ((), ())
    usual = {"friction": 0.3, "bounce_threshold": "0.1 in", "throw_rate": "1 Hz"}
    usual["scatter"] = {"speed": "1 %", "landing": "0.1 in"}
    assert examined(with_tables(world=usual)) == ((), ())
    for name in ls.scenes():
        assert examined(name) == ((), ())


def test_a_new_scene_in_millimetres_is_the_same_feeder(capfd):
    prints(capfd, "new mine.toml --unit mm")
    assert ' in"' not in Path("mine.toml").read_text(encoding="utf-8").partition("[part]")[2]
    scene, like = ls.load("mine.toml"), ls.load("paper-designed")
    assert scene.unit == "mm"
    assert scene.arm_length == pytest.approx(25.4 * like.arm_length, rel=1e-9)
    assert scene.kappa == pytest.approx(25.4 * like.kappa, rel=1e-9)
    assert "mm" in refusal(capfd, "new other.toml --unit yd")


def test_what_the_parser_refuses_is_said_in_plain_words(capfd):
    for line, said in (
        ("throw paper-designed --x 8 --side two", "'two' is not a whole number"),
        ("margin paper-designed --sped 1", "; limitsets margin --help lists what there is"),
        ("analyze paper-designed", "; limitsets --help lists what there is"),
        ("plot paper-designed limitset", "did you mean 'limit-set'?"),
        ("analyse paper-designed throw.speed=150", "scene.with_values({'throw.speed': '150 UNIT'})"),
        ("analyse paper-designed --set 'throw.speed=150 deg/s'", "write it into the scene's file"),
    ):
        err = refusal(capfd, line)
        assert said in err
        assert "Input should be" not in err
        assert "Value error" not in err


def test_how_far_a_centre_of_mass_lies_outside_has_a_unit():
    tree = ls.load("paper-designed").as_dict()
    tree["part"]["mass"]["center"]["above"] = "-9 in"
    with pytest.raises(SceneError, match=r"it lies outside, 9 in beyond side 2"):
        ls.load(tree)


def test_a_scene_is_printed_as_its_tables():
    scene = ls.load("paper-designed")
    assert repr(scene) == "Scene('paper-designed', 3 sides, arm 28 in, kappa 25.3779 in)"
    assert "arm length [in]" in str(scene)
    assert "array(" not in str(scene)
