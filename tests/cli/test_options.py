"""Options that every command has that prints a table or draws: --csv, --format."""

import csv
import json
import re
from pathlib import Path

import pytest
from typer.main import get_command

import limitsets as ls
from limitsets.face.cli.app import app
from tests.cli.command import run

COMMANDS = get_command(app).commands

# What prints no table, and what draws nothing.
NO_TABLE = {"plot", "animate", "new", "explore"}
NO_FIGURE = {"scenes", "throw", "certify", "recheck", "new", "check", "doctor", "animate", "explore"}


def options(name):
    return {word for each in COMMANDS[name].params for word in each.opts}


def rows_of(file):
    return list(csv.DictReader(Path(file).read_text(encoding="utf-8").splitlines()))


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_command_that_prints_a_table_saves_it(name):
    assert ("--csv" in options(name)) == (name not in NO_TABLE)
    assert ("--format" in options(name)) == (name not in NO_FIGURE)
    assert ("--json" in options(name)) == (name != "explore")  # which serves a page


def test_throws_in_full(capfd):
    code, out, _ = run(
        capfd,
        "throw",
        "paper-designed",
        "--x",
        "15",
        "--side",
        "2",
        "--count",
        "5",
        "--json",
        "--csv",
        "t.csv",
    )
    assert code == 0
    rows, throws = rows_of("t.csv"), json.loads(out)
    assert list(rows[0])[:5] == ["throw", "x [in]", "side", "status", "turned by [deg]"]
    assert [float(row["x [in]"]) for row in rows] == [15.0, *(each["x"] for each in throws)]
    assert [float(row["displacement [in]"]) for row in rows[1:]] == [each["displacement"] for each in throws]
    assert rows[0]["turned by [deg]"] == ""


def test_limit_sets_in_full_and_figures_of_another_form(capfd):
    words = ("--cells", "512", "--csv", "sets.csv", "--format", "svg", "--html", "--json")
    code, out, _ = run(capfd, "analyse", "paper-designed", *words)
    assert code == 0
    (found,) = json.loads(out)["attractors"]
    bands = [(int(side), *part) for side, parts in found["extents"].items() for part in parts]
    rows = rows_of("sets.csv")
    assert [(int(row["side"]), float(row["x low [in]"]), float(row["x high [in]"])) for row in rows] == bands
    folder = Path("paper-designed-analysis")
    assert (folder / "map.svg").read_bytes().startswith(b"<?xml")
    assert not list(folder.glob("*.png"))
    page = (folder / "report.md").read_text(encoding="utf-8")
    assert "](map.svg)" in page
    for name in re.findall(r"\]\(([^)]+)\)", page):
        assert (folder / name).is_file()
    assert (folder / "report.html").is_file()


def test_a_page_links_to_figures_that_it_cannot_show(capfd):
    assert run(capfd, "audit", "paper-designed", "-o", "out", "--format", "pdf", "--csv", "a.csv")[0] == 0
    assert Path("out/audit.pdf").read_bytes().startswith(b"%PDF")
    page = Path("out/audit.md").read_text(encoding="utf-8")
    assert "(audit.pdf)" in page
    assert "![" not in page
    rows = rows_of("a.csv")
    assert {row["where"] for row in rows} == {"limit-set", "domain"}
    found = ls.audit("paper-designed").findings
    assert [row["x [in]"] for row in rows] == ["" if each.x is None else repr(each.x) for each in found]


def test_the_form_of_one_figure(capfd):
    words = ("plot", "paper-designed", "flight", "--cells", "256")
    assert run(capfd, *words, "--format", "svg")[0] == 0
    assert Path("paper-designed-flight.svg").read_bytes().startswith(b"<?xml")
    code, _, err = run(capfd, *words, "--format", "svg", "-o", "a.png")
    assert (code, len(err.splitlines())) == (2, 1)


@pytest.mark.parametrize("file", [".", "no folder/t.csv"])
def test_a_table_that_cannot_be_written_is_refused_first(file, capfd):
    code, out, err = run(capfd, "throw", "paper-designed", "--x", "15", "--side", "2", "--csv", file)
    assert (code, out, len(err.splitlines())) == (2, "", 1)


def test_a_table_is_replaced_whole(capfd):
    Path("t.csv").write_text("old\n" * 1000)
    assert run(capfd, "scenes", "--csv", "t.csv")[0] == 0
    assert [row["scene"] for row in rows_of("t.csv")] == ls.scenes()
    assert [path.name for path in Path().iterdir()] == ["t.csv"]
