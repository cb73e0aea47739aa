"""What a fresh user stumbled over at the command line: widths, cut summaries, lost reports, wrong places, seeds."""

import csv
import platform
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

import limitsets as ls
from limitsets.base.errors import SceneError
from limitsets.face.cli.output import show
from limitsets.face.report.robust_pages import robustness_page
from tests.cli.command import json_of, names_in, prints, refusal, run, written
from tests.plates import LEAD_QUAD, left_by_some

SCATTER = {"world": {"scatter": {"speed": "1 %"}}, "effects": {"spread": "bounded"}}

OTHER = "it is of paper-designed; name another with --out, or delete it"


def own(**tables):
    return ls.load("paper-designed").as_dict() | tables


@pytest.mark.sweep
def test_an_audit_is_as_wide_as_the_terminal_says(capfd, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    out = prints(capfd, "audit paper-designed")
    assert max(map(len, out.splitlines()[:-4])) <= 80  # below the table there are sentences
    assert "no sliding in" in out


def test_where_nothing_says_how_wide_no_cell_is_broken(capfd, monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    show(ls.tables.Table(("head", "other"), [("a b " * 200, "c")]))
    out = capfd.readouterr().out
    assert ("a b " * 200).strip() in out
    assert max(map(len, out.splitlines())) < 900  # as long as they are, no longer


def test_summaries_of_the_help_are_whole(capfd, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    _, out, _ = run(capfd, "--help")
    assert "..." not in out.partition("Commands:")[2]
    for summary in (
        "Find limit sets, basins and critical points, and write report.md, report.html, JSON and figures.",
        "Check a certificate by other code and in other arithmetic",
    ):
        assert summary in " ".join(out.split())


@pytest.mark.parametrize("x", ["-5", "-0.1", "-20 cm"])
def test_no_part_rests_before_the_joint(capfd, x):
    assert "from 0 to 28 in" in refusal(capfd, "throw paper-designed", f"--x={x}", "--side", "2")


def places(capfd, scene, seed=""):
    return [row["x"] for row in json_of(capfd, f"throw {scene} --x 12 --side 2 --count 5 {seed}")]


def test_throws_that_scatter_have_a_seed(capfd):
    file = written(**SCATTER)
    plain, first = places(capfd, file), places(capfd, file, "--seed 7")
    assert places(capfd, file, "--seed 0") == plain
    assert first == places(capfd, file, "--seed 7")
    assert first != plain
    assert places(capfd, "paper-designed", "--seed 7") == places(capfd, "paper-designed")
    with pytest.raises(SceneError, match="the seed"):
        ls.load(own()).map_of_seed(-1)


@pytest.mark.parametrize("ask", [ls.analyse, ls.robustness, ls.load])
def test_a_map_in_the_place_of_a_scene_is_named(ask):
    """It was "a list of 2": Henon's map has two parameters."""
    with pytest.raises(SceneError, match=r"a map, Henon.*ls\.certify\(map, grid\)"):
        ask(ls.maps.Henon())


@pytest.mark.sweep
def test_a_report_of_another_scene_is_not_replaced(capfd):
    words = ("--cells", "64", "-o", "reports")
    for _ in range(2):
        assert "replaced" not in run(capfd, "analyse paper-designed", *words)[2]
    assert OTHER in refusal(capfd, "analyse paper-initial", *words)
    mine = written(arm={"surface_height": "-0.19 in", "length": "28 in"})
    _, _, err = run(capfd, f"analyse {mine}", *words)
    assert "reports: the report of paper-designed with other values is replaced" in err


def test_a_certificate_of_another_scene_is_not_replaced(capfd):
    """Two folders may hold files of one name, started from a third."""
    for folder, scene in (("first", "paper-designed"), ("second", "paper-initial")):
        Path(folder).mkdir()
        written(scene, f"{folder}/mine.toml")
    ask = ("certify", "--claim", "invariant", "--no-recheck")
    prints(capfd, *ask, "first/mine.toml")
    kept = Path("mine.proof.zip").read_bytes()
    assert OTHER in refusal(capfd, *ask, "second/mine.toml")
    assert Path("mine.proof.zip").read_bytes() == kept
    prints(capfd, *ask, "first/mine.toml")  # of this scene again


SPELLED_ODDLY = {
    "gravity": {"tilt": "30\u00b0"},
    "world": {"friction": 0.9, "scatter": {"speed": "0.1%"}},
    "model": {"flight": "exact"},
}


@pytest.mark.parametrize(
    ("tables", "out"),
    [
        ({}, ()),
        ({}, ("-o", "mine.proof.zip")),
        (SPELLED_ODDLY, ()),
        (SPELLED_ODDLY | {"effects": {"spread": "bounded"}}, ()),
    ],
)
def test_a_certificate_of_other_values_is_not_replaced_in_silence(capfd, tables, out):
    """It may be the last that knows them: the scene's file has others by now. Of the same question nothing is said."""
    told = "limitsets: mine.proof.zip: the certificate of paper-designed with other values is replaced\n"
    ask = ("certify", "mine.toml", "--claim", "invariant", "--no-recheck", *out)
    others = (("--tolerance", "arm.surface_height=0.001 in"), ("--noise", "landing.x=0.001 in"))
    said = []
    for height, words in (("-0.2 in", ()), ("-0.19 in", ()), *(("-0.19 in", other) for other in others)):
        written(arm={"surface_height": height, "length": "28 in"}, **tables)
        for _ in range(2):
            code, _, err = run(capfd, *ask, *words)
            assert code == 0
            said.append(err.count(told))
    assert said == [0, 0, 1, 0, 1, 0, 1, 0]


def test_a_certificate_of_other_values_stays_where_nothing_is_proved(capfd):
    prints(capfd, "certify paper-designed --claim trapping --no-recheck")
    kept = Path("paper-designed.proof.zip").read_bytes()
    code, _, err = run(capfd, "certify paper-designed --claim goal --noise 'throw.speed=9 %'")
    assert (code, "replaced" in err) == (1, False)
    assert Path("paper-designed.proof.zip").read_bytes() == kept


@pytest.mark.sweep
def test_a_scene_that_certify_refuses_is_not_proposed_to_it(capfd):
    """The effect slip has no enclosure."""
    written(file="my part.toml", world={"friction": 0.9}, effects={"slip": True})
    refusal(capfd, "certify 'my part.toml'")
    out = prints(capfd, "analyse 'my part.toml' --cells 128 -o out")
    assert "limitsets certify" not in out
    assert "limitsets audit 'my part.toml'" in out
    assert "limitsets certify" not in Path("out/report.md").read_text()


@pytest.mark.sweep
@pytest.mark.skipif(sys.platform == "win32", reason="no locks of this kind there")
def test_two_runs_at_once_do_not_write_into_one_folder(capfd, tmp_path):
    """The first holds the folder as long as it runs, however it ends."""
    code = "import time; from limitsets.files import locked\nwith locked('shared'):"
    code += " print('held', flush=True); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout.readline() == "held\n"
        err = refusal(capfd, "analyse paper-designed --cells 64 -o shared")
        assert f"shared is 'written by process {other.pid} on {platform.node()}'" in err
        assert not Path("shared").exists()
        prints(capfd, "analyse paper-designed --cells 64 -o mine")
        other.kill()
    time.sleep(0.1)
    prints(capfd, "analyse paper-designed --cells 64 -o shared")


# ---------------------------------------------------------------- what comes next, and how long it takes


@pytest.mark.sweep
def test_a_goal_that_fails_names_the_next_command(capfd):
    _, out, _ = run(capfd, "analyse paper-initial --cells 1024 -o found")
    assert "next: limitsets design paper-initial --goal" in out
    assert "limitsets design paper-initial --goal" in Path("found/report.md").read_text()
    _, out, _ = run(capfd, "analyse paper-designed --cells 1024 -o held")
    assert "next: limitsets certify paper-designed" in out
    assert not any(word in out for word in ("careful", "undecided: "))


def test_a_goal_that_is_not_proved_names_the_certificate(capfd):
    """From the arm's end parts leave: no orbit refutes the goal of the limit set, and not every start is proved."""
    written(LEAD_QUAD, "lead.toml")
    out = prints(capfd, "margin lead.toml throw.speed arm.surface_height", code=1)
    needed = "a margin needs the goal proved of the scene as it is for every start on the arm, beyond the limit set"
    assert f"2 margins, all of them 0: {needed}" in out
    assert "next: limitsets certify lead.toml" in out
    assert "limitsets analyse lead.toml (which starts leave the arm" in out
    _, out, _ = run(capfd, "analyse lead.toml -o lead")
    assert "next: limitsets certify lead.toml" in out
    assert "limitsets margin" not in out  # all of them are 0


@pytest.mark.sweep
def test_throws_outside_the_model_are_named_on_the_terminal(capfd):
    """Only the report said it: far out on sides 2 and 3 the vertex of the model is not the lowest."""
    corners = [[f"{x} mm", f"{y} mm"] for x, y in ((0, 0), (80, 0), (80, 44), (74, 50), (0, 50))]
    lead = {"x": "65 mm", "y": "10 mm", "mass": "40 g"}
    part = {"vertices": corners, "mass": {"plate_density": "11.775 kg/m^2", "points": [lead]}}
    arm = {"surface_height": "-10 mm", "length": "400 mm"}
    chamfered = {"part": part, "arm": arm, "throw": {"speed": "200 deg/s"}, "gravity": {"tilt": "30 deg"}}
    out = prints(capfd, f"analyse {written(chamfered)} --cells 1024 -o found")
    assert "careful: of some throws of the limit set from side 2, 3 another vertex lands first" in out


def test_the_next_command_is_one_that_can_be_pasted(capfd):
    """A file with a blank in its name, and a goal that no design is made for."""
    written(file="two words.toml", goal={"flip_order": [0, 2, 1]})
    _, out, _ = run(capfd, "analyse 'two words.toml' --cells 1024 -o found")
    assert "next: limitsets audit 'two words.toml'" in out


def test_margins_that_are_all_nothing_are_one_line(capfd):
    """18 rows of zeros were printed."""
    out = prints(capfd, "margin paper-initial", code=1)
    assert len(out.splitlines()) == 4  # the last says of which model
    assert "11 margins, all of them 0: the goal fails in the scene as it is" in out
    assert "next: limitsets design paper-initial --goal" in out


def test_design_for_the_goal(capfd):
    out = prints(capfd, "design paper-designed --goal --vary throw.kappa --evaluations 10")
    assert "The goal holds of the limit set at X = 20 in (proved), with " in out
    assert re.search(r"no fact of \[world\] is left out; \d assumptions? breaks? on the limit set: \w+", out)
    assert "scene (add -o paper-designed-design.toml to save it):\n\nname = " in out
    narrow = "design paper-initial --goal --bounds 'throw.kappa=33 in:33.5 in'"
    out = prints(capfd, narrow, "--evaluations", "5", code=1)
    assert "name = " not in out  # it printed a scene that looked like the answer
    assert "nearest miss" in out
    assert "audit" not in out
    assert "the scene as it is is ruled out, as one of those that let another side" in out
    record = json_of(capfd, narrow, "--evaluations", "10", "-o", "found", code=1)
    message = "no design that meets the goal at X = 20 in among 10: 10 let another side get"
    assert record["message"].startswith(message)
    assert names_in("found") == {"paper-initial-design.toml", "design.json", "part.png"}
    assert ls.load("found/paper-initial-design.toml").goal == ls.load("paper-initial").goal
    refusal(capfd, "design paper-designed --goal --robust")


def test_a_design_that_parts_leave_says_so(capfd):
    words = "--goal --bounds throw.speed=279.379:279.380 --evaluations 5 -o found.toml"
    out = prints(capfd, f"design {written(left_by_some())} {words}", code=1)
    share = re.search(r"careful: from (\S+) % of all starts \(sampled\) parts leave the arm", out)[1]
    assert float(share) == pytest.approx(3.5, abs=1.0)
    assert "limitsets audit found.toml" in out
    assert "the scene as it is is ruled out, as one of those that lose parts from some starts" in out
    assert out.splitlines()[-1] == "scene: found.toml"


def test_a_design_that_is_not_proved_names_a_command_to_paste(capfd, monkeypatch):
    """It said: limitsets certify on the scene found."""
    from dataclasses import replace

    from limitsets.parameters.design import for_goal

    found = for_goal.design_for_goal(ls.load("paper-designed"), vary=["throw.kappa"], evaluations=10)
    monkeypatch.setattr(for_goal, "design_for_goal", lambda *_, **__: replace(found, verdict="undecided"))
    out = prints(capfd, "design paper-designed --goal", code=1)
    assert "next: add -o design.toml to this command, then limitsets certify design.toml (" in out
    _, out, _ = run(capfd, "design paper-designed --goal -o 'my design.toml'")
    assert "next: limitsets certify 'my design.toml' (" in out
    assert Path("my design.toml").exists()


@pytest.mark.sweep
def test_a_robust_design_that_was_ended_is_on_disk(capfd, monkeypatch):
    from limitsets.parameters.design import for_margin

    monkeypatch.setattr(for_margin, "polished", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    words = "--robust --evaluations 4 --vary part.mass.center.along --seconds 0 -o found"
    assert run(capfd, f"design {written(tolerance={'throw.speed': '1 %'})} {words}")[0] == 130
    (left,) = Path("found").iterdir()
    assert left.name == "paper-designed-so-far.toml"
    assert ls.analyse(left, 1024).goal.holds


RATED = {"throw_rate": "2 Hz", "scatter": {"speed": "0.5 %"}}


@pytest.mark.sweep
def test_times_are_told_in_seconds_and_parts_per_minute(capfd):
    """At two throws a second n throws take n / 2 s, and 120 / n parts come in a minute."""
    cavity = {"position": "20 in", "width": "8 in", "depth": "1 in", "angle": "20 deg"}
    out = prints(capfd, f"feed {written(world=RATED, cavity=cavity)} --no-proof --trials 100")
    mean = float(re.search(r"throws until a part is fed.*: ([\d.]+) in the mean", out)[1])
    seconds = float(re.search(r"in the mean \(([\d.]+) s\)", out)[1])
    assert seconds == pytest.approx(mean / 2.0, abs=0.06)


@pytest.mark.sweep
def test_the_sheet_tells_them_too(tmp_path):
    quick = {"cells": 128, "leave_out": ["margins", "curve", "audit"]}
    found = ls.robustness(ls.load(own(world=RATED)), **quick)
    text = robustness_page(found, {})
    row = next(line for line in text.splitlines() if line.startswith("| throws until they do, mean"))
    mean = found.noise.numbers["mean throws"]
    seconds, parts = re.search(r"\(([\d.]+) s, ([\d.]+) parts per minute\)", row).groups()
    assert float(seconds) == pytest.approx(mean / 2.0, rel=5e-3)
    assert float(parts) == pytest.approx(120.0 / mean, rel=5e-3)


def test_a_speed_in_a_wrong_unit_is_asked_about(capfd):
    fast = written(values={"throw.speed": "150 rad/s"})
    assert "has the speed the right unit?" in prints(capfd, f"analyse {fast} --cells 256 -o found")


@pytest.mark.sweep
def test_a_goal_that_fails_comes_with_the_x_from_which_it_holds(capfd):
    slow = written(values={"throw.speed": "150 deg/s"})
    farthest = max(hi for side in (0, 1) for _, hi in ls.analyse(slow, 1024).extents[0][side])
    out = prints(capfd, f"analyse {slow} --cells 1024 -o found")
    assert f"The sentence is true from x = {farthest:.3f} in on." in out


SHORT = {"arm": {"surface_height": "-0.2 in", "length": "23 in"}}


@pytest.mark.parametrize(
    ("tables", "options", "end"),
    [
        # a_2 and the arm's length are in the scene; kappa = 15 in throws parts in, an arm of 23 in is too short
        ({"throw": {"kappa": "15 in"}}, (), "28 in"),
        (SHORT, (), "23 in"),
        (SHORT, ("--tolerance", "arm.length=1 %"), "22.77 in"),
    ],
)
def test_an_orbit_that_leaves_is_said_to(capfd, tables, options, end):
    short = written(**tables, goal={"stays_on_arm": True})
    out = prints(capfd, f"certify {short} --claim goal", *options, code=1)
    rests = f"There the part has left the arm: on side 2 it rests from x = 4.22558 to {end}"
    assert rests in " ".join(out.split())


def test_an_orbit_that_stays_is_not_said_to_leave(capfd):
    near = written(goal={"oriented_beyond": {"x": "12 in", "side": 2}})
    out = prints(capfd, f"certify {near} --claim goal", code=1)
    assert "This orbit shows it" in out
    assert "left the arm" not in out


def test_a_surface_above_the_joint_is_not_answered_with_finer_cells(capfd):
    above = written(arm={"surface_height": "0.2 in", "length": "28 in"})
    out = prints(capfd, f"analyse {above} --cells 512")
    assert "is arm.surface_height meant to be negative" in out
    assert "finer cells" not in out
    assert "ask for more cells" not in out


# A pentagon whose parts all come back to the joint at this speed, with the surface below it.
LOST = """
name = "lost"
[part]
vertices = [["0 in", "0 in"], ["6 in", "0 in"], ["6.5 in", "2.2 in"], ["3.2 in", "4 in"], ["-0.3 in", "2.4 in"]]
mass.plate_density = "2.7 g/cm^3"
mass.plate_thickness = "0.125 in"
mass.points = [{ x = "5 in", y = "1 in", mass = "56.7 g" }]
[arm]
surface_height = "-0.5 in"
length = "30 in"
[throw]
speed = "160 deg/s"
[gravity]
tilt = "20 deg"
[goal]
oriented_beyond = { x = "20 in", side = 0 }
"""


def test_a_report_without_limit_sets_speaks_of_none_and_looks_for_a_speed(capfd):
    Path("lost.toml").write_text(LOST, encoding="utf-8")
    out = prints(capfd, "analyse lost.toml --cells 512")
    assert "no start was found to stay on the arm" in out
    page = Path("lost-analysis/report.md").read_text(encoding="utf-8")
    assert "**Another vertex lands first**" in page
    assert "No throw from the limit set" not in page
    assert "of the orbit" not in page
    assert "shown here" not in page
    (found,) = re.findall(r"next: limitsets (atlas lost.toml .*) \(at which speeds", out)
    assert found == "atlas lost.toml --x throw.speed=80:320:100"
    prints(capfd, *found.replace(":100", ":9").split(), "--csv", "speeds.csv")
    with Path("speeds.csv").open(encoding="utf-8", newline="") as file:
        count = {row["attractors"] for row in csv.DictReader(file)}
    assert {"0", "1"} <= count
