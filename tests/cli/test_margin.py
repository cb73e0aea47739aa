"""`margin` and `robustness` at the command line."""

import json
import re
from pathlib import Path

import pytest

import limitsets as ls
from tests.cli.command import documented, json_of, names_in, prints, refusal, run, written

# ----------------------------------------------------------------
# `limitsets margin`: words, JSON, files, exit codes.


def test_a_table_in_units_that_people_use(capfd):
    out = prints(capfd, "margin paper-designed throw.speed arm.surface_height --width 0.1")
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
    assert "vacuously" not in out
    assert not list(Path().iterdir())


@pytest.mark.sweep
def test_a_margin_of_a_goal_that_no_part_gets_to_says_so(capfd):
    _, out, _ = run(capfd, "margin paper-designed landing.x --width 0.3 --x 25")
    assert "landing.x: what is proved holds vacuously, no part gets beyond x = 25 in" in out
    assert "choose X between 19.753 and 23.383 in for side 2" in out


def test_json_and_files_that_recheck_accepts(capfd):
    pytest.importorskip("flint", reason="the checker needs python-flint")
    line = "margin paper-designed throw.speed --reading per-throw --width 0.1 -o deep/down"
    (record,) = json_of(capfd, line)
    assert set(record) == documented("margin")
    assert (record["quantity"], record["reading"], record["unit"]) == ("throw.speed", "per-throw", "%")
    assert record["goal"] == {"oriented_beyond": {"x": "20.0 in", "side": 2}, "from_anywhere": False}
    assert record["counterexample"][-1]["side"] != 2
    assert record["counterexample"][-1]["between"][0] > 20.0
    folder = Path("deep/down")
    assert names_in(folder) == {*record["certificate"], "margins.json", "part.png", "margins.png"}
    assert json.loads((folder / "margins.json").read_text(encoding="utf-8")) == [record]
    for name in record["certificate"]:
        code, out, _ = run(capfd, "recheck", str(folder / name))
        assert (code, out.splitlines()[-1]) == ((1, "REFUTED") if "refuted" in name else (0, "PROVED"))
    (farther,) = json_of(
        capfd, "margin paper-designed throw.speed --reading per-throw --width 0.2 --x '53.34 cm'"
    )
    assert farther["goal"]["oriented_beyond"]["x"] == "21.0 in"
    assert farther["proved"] > record["refuted"]


def test_the_joint_margin_has_a_figure_of_its_own(capfd):
    own = written(tolerance={"throw.speed": "0.5 %"})
    assert "asked of the limit set" in prints(capfd, f"margin {own} joint --width 0.1 -o out")
    assert {"joint.png", "margins.json"} < names_in("out")
    assert "margins.png" not in names_in("out")


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
    assert said in refusal(capfd, "margin", *words)


# ----------------------------------------------------------------
# `limitsets robustness`: words, JSON, files, exit codes.
# The sharp margin of the surface's height of paper-designed is between 0.057 and 0.058 in, as long orbits show
# here.


QUICK = ("--quantity", "arm.surface_height", "--width", "0.5", "--without", "curve")
NOISE = ("--scatter", "throw.speed=0.5 %", "--cells", "32")


def cell(page, row, column):
    line = next(line for line in page.splitlines() if line.startswith(f"| {row} |"))
    return line.strip("| ").split(" | ")[column]


def violates(height):
    """Whether a long orbit comes to rest beyond 20 in on another side than 2."""
    scene = ls.load("paper-designed").with_values({"arm.surface_height": height})
    path = ls.orbit(scene.map, 15.0, 2, 1_000_000)
    return bool(((path.x > 20.0) & (path.side != 2))[2000:].any())


def test_the_sharp_margin_of_the_height():
    assert violates("-0.258 in")
    assert not violates("-0.257 in")
    assert not violates("-0.142 in")


@pytest.mark.sweep
def test_report_and_files(capfd):
    out = prints(capfd, "robustness paper-designed -o sheet", *QUICK, *NOISE)
    assert "this holds, proved" in out
    assert "no joint: the scene has no [tolerance]" in out
    assert out.splitlines()[-2] == "report: sheet/report.md"
    folder = Path("sheet")
    page = (folder / "report.md").read_text(encoding="utf-8")
    figures = set(re.findall(r"\]\((\S+\.png)\)", page))
    kinds = ("part", "margins", "counterexample", "density", "throws", "levels")
    assert figures == {f"{kind}.png" for kind in kinds}
    assert names_in(folder) == {*figures, "report.md", "report.html", "robustness.json", "certificates"}
    assert (folder / "report.html").read_text(encoding="utf-8").count('src="data:image/png') == len(figures)
    assert all((folder / name).read_bytes().startswith(b"\x89PNG") for name in figures)
    commands = re.findall(r"^    limitsets recheck (\S+)$", page, re.MULTILINE)
    assert names_in(folder / "certificates") == {Path(name).name for name in commands}
    low, high = (float(cell(page, "arm.surface_height", k).split()[0]) for k in (3, 4))
    assert low < 0.058
    assert high > 0.057
    least, most = (float(part) for part in cell(page, "arm.surface_height", 5).split(" / "))
    assert least == pytest.approx(100 * low / 0.2, rel=2e-3)
    assert most == pytest.approx(100 * high / 0.2, rel=2e-3)
    heads = ["One quantity at a time", "What limits it", "All together", "Noise", "How far to trust this"]
    for head in heads:
        assert f"## {head}" in page
    assert "`limitsets audit paper-designed`" in page
    assert "parts per minute" not in page  # the scene has no rate of throws
    record = json.loads((folder / "robustness.json").read_text())
    numbers = {name: found["value"] for name, found in record["noise"]["numbers"].items()}
    assert sum(numbers[f"time on side {k}"] for k in range(3)) == pytest.approx(1.0, abs=1e-9)
    # every start is attracted, and the limit set passes 20 in
    assert numbers["fed"] == pytest.approx(1.0, abs=1e-6)
    assert cell(page, "throws until they do, mean", 1) == f"{numbers['mean throws']:.1f}"
    levels = record["noise_levels"]
    assert levels["factors"] == [0.0, 0.5, 1.0, 1.5, 2.0]
    wrong = levels["numbers"]["wrong beyond"]
    assert wrong[4] > wrong[0]  # more noise, more mistakes


def test_json_alone_on_stdout(capfd):
    words = ("robustness paper-designed -o sheet --without noise --without audit", *QUICK)
    record = json_of(capfd, *words)
    assert record == json.loads(Path("sheet/robustness.json").read_text())
    assert set(record) == documented("robustness")
    assert [row["quantity"] for row in record["margins"]] == ["arm.surface_height"]
    assert record["noise"] is None
    assert ls.load(record["scene"]) == ls.load("paper-designed")


def test_a_goal_that_fails_is_exit_1_and_the_orbit_is_there(capfd):
    words = "paper-initial -o sheet --tolerance 'throw.speed=1 %' --without curve --without audit"
    out = prints(capfd, f"robustness {words}", code=1)
    assert "this fails: an orbit shows it" in out
    assert "The tolerance is not met: the scene as it is fails already." in out
    page = Path("sheet/report.md").read_text(encoding="utf-8")
    assert "Already in the scene as it is, an orbit violates the goal: after " in page
    assert Path("sheet/counterexample.png").exists()
    assert not Path("sheet/margins.png").exists()
    assert "times its tolerance" not in page


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("no-such-scene",), "no-such-scene"),
        (("paper-designed", "-o", "taken/deeper"), "taken"),
        (("paper-designed", "--quantity", "throw.sped"), "throw.speed"),
        (("paper-designed", "--tolerance", "part.sides[3]=1 %"), "part.sides[3]"),
        (("paper-designed", "--tolerance", "gravity.tilt=1 deg"), "gravity.tilt"),
        (("paper-designed", "--scatter", "part.sides[0]=1 %"), "noise of throw.speed"),
        (("paper-designed", "--scatter", "throw.speed=1 %", "--law", "flat"), "gaussian or bounded"),
        (("paper-designed", "--without", "everything"), "margins, joint, curve"),
        (("no-goal.toml",), "add [goal] with, for instance, oriented_beyond"),
        (("slips.toml",), "leave the others out of [effects]"),
    ],
)
def test_bad_input_is_exit_2_of_robustness(capfd, words, said):
    Path("taken").write_text("a file")
    written(file="slips.toml", world={"friction": 0.6}, effects={"slip": True})
    tree = ls.load("paper-designed").as_dict()
    del tree["goal"]
    written(tree, "no-goal.toml")
    assert said in refusal(capfd, "robustness", *words)
    assert not list(Path().glob("*-robustness"))


@pytest.mark.sweep
def test_an_own_part_in_millimetres(capfd):
    """A tolerance in inches; the margin of the landing place is 0.105 to 0.107 of the unit of length, here mm."""
    text = ls.dump(ls.load("paper-designed")).replace(' in"', ' mm"').replace("in/s^2", "mm/s^2")
    Path("part.toml").write_text(text)
    words = ["--without", "margins", "--without", "noise", "--without", "audit", "--without", "curve"]
    out = prints(capfd, "robustness part.toml -o sheet", *words, "--tolerance", "landing.x=0.001 in")
    assert "The tolerance is met, proved" in out
    (joint,) = json.loads(Path("sheet/robustness.json").read_text())["margins"]
    assert joint["proved"] * 0.0254 < 0.107
    assert joint["refuted"] * 0.0254 > 0.105
