"""`limitsets animate`: files, words, JSON, exit codes."""

import json
from pathlib import Path

import limitsets as ls
from tests.cli.command import run
from tests.feeding.scenes import with_cavity
from tests.trays.scenes import with_tray

QUICK = ("--start", "21,2", "--throws", "1", "--slow", "1")


def test_a_page_by_default_named_after_the_scene(capfd):
    code, out, _ = run(capfd, "animate", "paper-designed", *QUICK)
    assert code == 0
    assert out.startswith("film: paper-designed.html (")
    assert "flip from 21.00 in, side 2, to 16.55, side 0" in Path("paper-designed.html").read_text(
        encoding="utf-8"
    )


def test_json_alone_and_a_place_with_a_unit(capfd):
    code, out, _ = run(
        capfd, "animate", "paper-designed", "--start", "53.34 cm,2", "--throws", "1", "-o", "run.gif", "--slow", "1",
        "--json",
    )  # fmt: skip
    assert code == 0
    assert json.loads(out) == {"film": "run.gif", "bytes": Path("run.gif").stat().st_size}


def test_feeding(capfd):
    ls.dump(with_cavity("paper-designed"), "fed.toml")
    code, _, _ = run(capfd, "animate", "fed.toml", "--feed", "--start", "19,2", "-o", "fed.html")
    assert code == 0
    assert "Fed rightly" in Path("fed.html").read_text(encoding="utf-8")


def test_a_margin(capfd):
    code, _, _ = run(
        capfd, "animate", "paper-designed", "--margin", "throw.speed", "--throws", "1", "-o", "m.html"
    )
    assert code == 0
    assert "the goal is violated" in Path("m.html").read_text(encoding="utf-8")


def test_what_cannot_be_is_one_line_and_exit_2(capfd):
    for words, expected in (
        (("-o", "run.avi"), "ends in .gif, .html"),
        (("-o", "run.mp4"), "ffmpeg -i film.gif"),
        (("--start", "40,2"), "x of the start is 40.0; allowed: more than 4.22558 and up to 28 in on side 2"),
        (("--start", "40 kg,2"), "--start: "),
        (("--start", "15"), "X,SIDE"),
        (("--start", "15,7"), "the side of the start is 7"),
        (("--feed", "--feedback"), "one of them"),
        (("--feed",), "without [cavity]"),
        (("--feedback",), "feedback.throws"),
        (("--reading", "fixed"), "--margin"),
        (("--margin", "throw.speed", "--start", "15,2"), "none with --margin, --assemble"),
        (("--throws", "9999"), "the frames of the film"),
    ):
        code, out, err = run(capfd, "animate", "paper-designed", *words)
        assert code == 2
        assert out == ""
        assert expected in err.splitlines()[-1]
    assert not list(Path().glob("*.html"))


def test_a_tray_and_a_pair_that_cannot_be_filmed(capfd):
    ls.dump(with_tray(), "tray.toml")
    code, _, _ = run(capfd, "animate", "tray.toml", "--tray", "--throws", "3", "-o", "tray.html")
    assert code == 0
    assert "one depression of a tray" in Path("tray.html").read_text(encoding="utf-8")
    code, _, err = run(capfd, "animate", "tray.toml", "--parts", "2", "-o", "tray.html")
    assert code == 2
    assert "with --tray" in err
    code, _, err = run(
        capfd, "animate", "paper-triangle", "--assemble", "paper-quadrilateral", "-o", "pair.html"
    )
    assert code == 2  # without contact they pass through each other, and the engine has nothing to show
    assert "[effects] contact = true" in err
    assert not Path("pair.html").exists()
