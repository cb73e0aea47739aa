"""`limitsets margin`: words, JSON, files, exit codes."""

import json
from pathlib import Path

import pytest

import limitsets as ls
from tests.cli.command import run


def test_a_table_in_units_that_people_use(capfd):
    code, out, _ = run(
        capfd, "margin", "paper-designed", "throw.speed", "arm.surface_height", "--width", "0.1"
    )
    assert code == 0
    assert "beyond x = 20 in lies on side 2" in out
    rows = {line.split()[0]: line for line in out.splitlines() if line.split()[:1]}
    *low, high, direction = rows["throw.speed"].replace("%", "").split()[-3:]
    assert float(low[0]) < 0.733 < float(high)
    # 0.7 % slower throws carry another side beyond 20 in, as much faster ones do not
    assert direction == "less"
    scene = ls.load("paper-designed")
    kappa = [scene.kappa / (1.0 + sign * 0.0075) ** 2 for sign in (-1, 1)]
    slower, faster = (ls.analyse(scene.with_values({"throw.kappa": each}), 1024).goal.holds for each in kappa)
    assert (slower, faster) == (False, True)
    assert rows["arm.surface_height"].split()[-2:] == ["in", "less"]
    assert rows["arm.surface_height"].count(" in") == 2
    assert not list(Path().iterdir())


@pytest.mark.sweep
def test_a_margin_of_a_goal_that_no_part_gets_to_says_so(capfd):
    _, out, _ = run(capfd, "margin", "paper-designed", "landing.x", "--width", "0.3", "--x", "25")
    assert "landing.x: what is proved holds vacuously, no part gets beyond x = 25 in" in out
    _, out, _ = run(capfd, "margin", "paper-designed", "landing.x", "--width", "0.3")
    assert "vacuously" not in out


def test_json_and_files_that_recheck_accepts(capfd):
    pytest.importorskip("flint", reason="the checker needs python-flint")
    words = (
        "margin",
        "paper-designed",
        "throw.speed",
        "--reading",
        "per-throw",
        "--width",
        "0.1",
        "--json",
        "-o",
        "deep/down",
    )
    code, out, _ = run(capfd, *words)
    assert code == 0
    (record,) = json.loads(out)
    assert set(record) >= {
        "quantity",
        "reading",
        "goal",
        "proved",
        "refuted",
        "counterexample",
        "certificate",
    }
    assert (record["quantity"], record["reading"], record["unit"]) == ("throw.speed", "per-throw", "%")
    assert record["goal"] == {"oriented_beyond": {"x": "20.0 in", "side": 2}, "from_anywhere": False}
    assert record["counterexample"][-1]["side"] != 2
    assert record["counterexample"][-1]["between"][0] > 20.0
    folder = Path("deep/down")
    assert {path.name for path in folder.iterdir()} == {
        *record["certificate"],
        "margins.json",
        "part.png",
        "margins.png",
    }
    assert json.loads((folder / "margins.json").read_text(encoding="utf-8")) == [record]
    for name in record["certificate"]:
        code, out, _ = run(capfd, "recheck", str(folder / name))
        assert (code, out.splitlines()[-1]) == ((1, "REFUTED") if "refuted" in name else (0, "PROVED"))


def test_the_joint_margin_has_a_figure_of_its_own(capfd):
    own = Path("own.toml")
    ls.dump(ls.load(ls.load("paper-designed").as_dict() | {"tolerance": {"throw.speed": "0.5 %"}}), own)
    code, out, _ = run(capfd, "margin", str(own), "joint", "--width", "0.1", "-o", "out")
    assert code == 0
    assert "asked of the limit set" in out
    names = {path.name for path in Path("out").iterdir()}
    assert {"joint.png", "margins.json"} < names
    assert "margins.png" not in names


@pytest.mark.sweep
def test_another_x_and_a_reading(capfd):
    words = ("margin", "paper-designed", "throw.speed", "--reading", "per-throw", "--width", "0.2", "--json")
    _, at_20, _ = run(capfd, *words)
    code, at_21, _ = run(capfd, *words, "--x", "53.34 cm")
    assert code == 0
    assert json.loads(at_21)[0]["goal"]["oriented_beyond"]["x"] == "21.0 in"
    assert json.loads(at_21)[0]["proved"] > json.loads(at_20)[0]["refuted"]


def test_a_goal_that_fails_as_it_is_is_exit_1(capfd):
    code, out, _ = run(capfd, "margin", "paper-initial", "throw.speed")
    assert code == 1
    assert "fails in the scene as it is" in out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("no-such-scene",), "scene"),
        (("paper-designed", "throw.sped"), "throw.speed"),
        (("paper-designed", "part.sides[0]", "--reading", "per-throw"), "reading"),
        (("paper-designed", "--x", "30"), "arm's length"),
        (("paper-designed", "--x", "far"), "far"),
        (("paper-designed", "joint"), "tolerance"),
        (("paper-designed", "throw.speed", "--width", "2"), "width"),
    ],
)
def test_bad_input_is_exit_2(capfd, words, said):
    code, out, err = run(capfd, "margin", *words)
    assert (code, out) == (2, "")
    assert said in err


def test_the_help_names_it(capfd):
    assert "margin" in run(capfd, "--help")[1]
    assert ls.margin.__doc__.startswith("Bracket")
