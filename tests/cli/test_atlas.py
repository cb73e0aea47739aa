"""`atlas` and `animate` at the command line."""

import csv
import math
import sys
from pathlib import Path

import pytest

from tests.cli.command import documented, json_of, prints, refusal, run, written
from tests.feeding.scenes import with_cavity
from tests.trays.scenes import with_tray

# ----------------------------------------------------------------
# `limitsets atlas`: text, JSON, tables, and runs that go on.


TASK = "limitsets.parameters.atlas.examples:critical_points"
KAPPA = ["--x", "throw.kappa=25.3778518:27:2"]


def test_the_designed_critical_points_in_every_form(capfd, tmp_path):
    record = json_of(capfd, "atlas paper-designed", *KAPPA, "--task", TASK, "--csv", "a.csv")
    assert record["axes"] == [{"name": "throw.kappa", "unit": "in", "values": [25.3778518, 27.0]}]
    assert record["variables"]["critical_point"]["values"][0] == pytest.approx([10, 10, 20], abs=1e-6)
    rows = list(csv.DictReader((tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()))
    assert [float(row["throw.kappa [in]"]) for row in rows] == [25.3778518, 27.0]
    assert float(rows[0]["critical_point[2]"]) == record["variables"]["critical_point"]["values"][0][2]
    assert (tmp_path / "paper-designed-atlas.zarr" / "zarr.json").is_file()
    code, out, err = run(capfd, "atlas paper-designed", *KAPPA, "--task", TASK)
    assert (code, err) == (0, "")
    assert "2 points, 1 of its 1 chunks by earlier runs: paper-designed-atlas.zarr" in out
    assert "computed: 2" in out


def test_a_task_in_a_file_of_the_present_folder(capfd, tmp_path, monkeypatch):
    (tmp_path / "own_task_here.py").write_text("def twice(scene):\n    return {'twice': 2 * scene.kappa}\n")
    monkeypatch.setattr(sys, "path", [place for place in sys.path if place not in ("", str(tmp_path))])
    task = "--task own_task_here:twice --workers 2"
    record = json_of(capfd, f"atlas paper-designed --x throw.kappa=25:30:9 {task}")
    assert record["variables"]["twice"]["values"] == [50.0 + 1.25 * k for k in range(9)]


def test_another_plan_in_the_same_place_is_bad_input(capfd):
    prints(capfd, "atlas paper-designed", *KAPPA, "--task", TASK)
    assert "scene.name is 'paper-designed' there, 'paper-initial' here" in refusal(
        capfd, "atlas paper-initial", *KAPPA, "--task", TASK, "-o", "paper-designed-atlas.zarr"
    )


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["--x", "throw.sped=1:2:3"],
        ["--x", "throw.speed=1:2"],
        [*KAPPA, "--y", "throw.kappa=1:2:3"],
        [*KAPPA, "--task", "nothing:nowhere"],
        [*KAPPA, "--task", TASK, "--variables", "nothing"],
        [*KAPPA, "--task", TASK, "--workers", "0"],
        [*KAPPA, "--task", TASK, "--workers", "2", "--cluster", "tcp://127.0.0.1:1"],
        [*KAPPA, "--task", TASK, "--cluster", "here"],
        [*KAPPA, "--task", TASK, "--out", "file"],
        [*KAPPA, "--task", TASK, "--out", "file/below"],
        [*KAPPA, "--task", TASK, "--csv", "."],
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(words, capfd, tmp_path):
    (tmp_path / "file").write_text("a letter")
    refusal(capfd, "atlas paper-designed", *words)
    assert (tmp_path / "file").read_text() == "a letter"


def test_points_without_a_scene_are_counted(capfd):
    table = json_of(capfd, "atlas paper-designed --x throw.speed=-10:10:3 --task", TASK)
    status = table["variables"]["status"]
    # at 10 deg/s kappa is 193.045/(pi/18)^2 = 6337 in: there is a scene
    assert status["values"] == [1, 1, 0]
    assert math.prod(status["codes"].values()) == 0


def test_the_map_of_classes_lies_beside_the_store(capfd, tmp_path):
    """Of the later forms nothing is computed anew: the store is there."""
    for form, begins in (("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")):
        speed = ["--x", "throw.speed=135:165:17", "--refine", "--variables", "class"]
        out = prints(capfd, "atlas paper-designed", *speed, "--format", form, "-o", "here.zarr")
        assert f"figure: here.{form}" in out
        assert (tmp_path / f"here.{form}").read_bytes().startswith(begins)
        assert "level" in out  # some points are filled


def test_a_task_without_classes_has_no_map(capfd, tmp_path):
    out = prints(capfd, "atlas paper-designed", *KAPPA, "--task", TASK, "-o", "here.zarr")
    assert "figure" not in out
    assert [path.name for path in tmp_path.glob("here*")] == ["here.zarr"]


# ----------------------------------------------------------------
# `limitsets animate`: files, words, JSON, exit codes.


QUICK = ("--start", "21,2", "--throws", "1", "--slow", "1")


def test_a_page_by_default_named_after_the_scene(capfd):
    out = prints(capfd, "animate paper-designed", *QUICK)
    assert out.startswith("film: paper-designed.html (")
    page = Path("paper-designed.html").read_text(encoding="utf-8")
    assert "flip from 21.00 in, side 2, to 16.55, side 0" in page


def test_json_alone_and_a_place_with_a_unit(capfd):
    film = json_of(capfd, "animate paper-designed --start '53.34 cm,2' --throws 1 -o run.gif --slow 1")
    assert set(film) == documented("animate")
    assert film == {"film": "run.gif", "bytes": Path("run.gif").stat().st_size}


def test_feeding_and_a_margin(capfd):
    prints(capfd, f"animate {written(with_cavity())} --feed --start 19,2 -o fed.html")
    assert "Fed rightly" in Path("fed.html").read_text(encoding="utf-8")
    prints(capfd, "animate paper-designed --margin throw.speed --throws 1 -o m.html")
    assert "the goal is violated" in Path("m.html").read_text(encoding="utf-8")


def test_what_cannot_be_is_one_line_and_exit_2(capfd):
    for words, expected in (
        (("-o", "run.mp4"), "ffmpeg -i film.gif"),
        (("--start", "40 kg,2"), "--start: "),
        (("--start", "15"), "X,SIDE"),
        (("--start", "15,7"), "the side of the start is 7"),
        (("--feed", "--feedback"), "one of them"),
        (("--feed",), "without [cavity]"),
        (("--feedback",), "feedback.throws"),
        (("--reading", "fixed"), "--margin"),
        (("--margin", "throw.speed", "--start", "15,2"), "none with --margin, --assemble"),
    ):
        assert expected in refusal(capfd, "animate paper-designed", *words)
    assert not list(Path().glob("*.html"))


def test_a_tray_and_a_pair_that_cannot_be_filmed(capfd):
    tray = written(with_tray())
    prints(capfd, f"animate {tray} --tray --throws 3 -o tray.html")
    assert "one depression of a tray" in Path("tray.html").read_text(encoding="utf-8")
    assert "with --tray" in refusal(capfd, f"animate {tray} --parts 2 -o tray.html")
    # without contact they pass through each other, and the engine has nothing to show
    err = refusal(capfd, "animate paper-triangle --assemble paper-quadrilateral -o pair.html")
    assert "[effects] contact = true" in err
    assert not Path("pair.html").exists()
