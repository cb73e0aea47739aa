"""What holds for every command: options, missing extras, remedies, the page of the JSON."""

import csv
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.face.cli.app import app
from tests.cli.command import DOCS, PROGRESS, documented, json_of, names_in, prints, refusal, run, written
from tests.feeding.scenes import with_cavity
from tests.trays.scenes import with_tray

# ----------------------------------------------------------------
# Options that every command has that prints a table or draws: --csv, --format.


COMMANDS = get_command(app).commands

# What prints no table, and what draws nothing.
NO_TABLE = {"plot", "animate", "new", "explore"}
NO_FIGURE = {
    "scenes",
    "throw",
    "certify",
    "average",
    "absorption",
    "recheck",
    "new",
    "check",
    "doctor",
    "animate",
    "explore",
    "film",
}


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
    throws = json_of(capfd, "throw paper-designed --x 15 --side 2 --count 5 --csv t.csv")
    rows = rows_of("t.csv")
    assert list(rows[0])[:5] == ["throw", "x [in]", "side", "status", "turned by [deg]"]
    assert [float(row["x [in]"]) for row in rows] == [15.0, *(each["x"] for each in throws)]
    assert [float(row["displacement [in]"]) for row in rows[1:]] == [each["displacement"] for each in throws]
    assert rows[0]["turned by [deg]"] == ""


def test_limit_sets_in_full_and_figures_of_another_form(capfd):
    record = json_of(capfd, "analyse paper-designed --cells 512 --csv sets.csv --format svg")
    keys_of_an_analysis(record)
    (found,) = record["attractors"]
    bands = [(int(side), *part) for side, parts in found["extents"].items() for part in parts]
    rows = rows_of("sets.csv")
    assert [(int(row["side"]), float(row["x low [in]"]), float(row["x high [in]"])) for row in rows] == bands
    folder = Path("paper-designed-analysis")
    assert (folder / "map.svg").read_bytes().startswith(b"<?xml")
    assert not list(folder.glob("*.png"))
    page = (folder / "report.md").read_text(encoding="utf-8")
    assert "](map.svg)" in page
    for name in re.findall(r"\]\(([^#)]+)\)", page):
        assert (folder / name).is_file()
    assert (folder / "report.html").is_file()


def test_a_page_can_be_left_out(capfd):
    prints(capfd, "analyse paper-designed --cells 64 -o out --no-html")
    assert Path("out/report.md").is_file()
    assert not Path("out/report.html").exists()


def test_a_page_links_to_figures_that_it_cannot_show(capfd):
    prints(capfd, "audit paper-designed -o out --format pdf --csv a.csv")
    assert Path("out/audit.pdf").read_bytes().startswith(b"%PDF")
    page = Path("out/audit.md").read_text(encoding="utf-8")
    assert "(audit.pdf)" in page
    assert "![" not in page
    rows = rows_of("a.csv")
    assert {row["where"] for row in rows} == {"limit-set", "domain"}
    found = ls.audit("paper-designed").findings
    assert [row["x [in]"] for row in rows] == ["" if each.x is None else repr(each.x) for each in found]


def test_the_form_of_one_figure(capfd):
    words = "plot paper-designed flight --cells 256 --format svg"
    prints(capfd, words)
    assert Path("paper-designed-flight.svg").read_bytes().startswith(b"<?xml")
    refusal(capfd, f"{words} -o a.png")


@pytest.mark.parametrize("file", [".", "no folder/t.csv"])
def test_a_table_that_cannot_be_written_is_refused_first(file, capfd):
    refusal(capfd, "throw paper-designed --x 15 --side 2 --csv", file)


def test_a_table_is_replaced_whole(capfd):
    Path("t.csv").write_text("old\n" * 1000)
    prints(capfd, "scenes --csv t.csv")
    assert [row["scene"] for row in rows_of("t.csv")] == ls.scenes()
    assert names_in() == {"t.csv"}


# ----------------------------------------------------------------
# Without an extra, what needs it ends in one line that names it.


RUN = """
import json, sys
from limitsets.cli import main
codes = []
for modules, words in json.loads(sys.argv[1]):
    names = modules.split(",")
    kept = {name: sys.modules.pop(name) for name in names if name in sys.modules}
    sys.modules.update(dict.fromkeys(names))
    codes.append(main(words))
    for name in names:
        del sys.modules[name]
    sys.modules.update(kept)
print(codes)
"""

ATLAS = ("atlas", "paper-designed", "--x", "throw.kappa=25:26:2")


WITHOUT = (
    ("atlas", "xarray", ATLAS),
    ("atlas", "zarr", ATLAS),
    ("cluster", "distributed", (*ATLAS, "--cluster", "tcp://127.0.0.1:1")),
    ("atlas", "pandas", (*ATLAS, "--csv", "a.csv")),  # which stores the atlas
    ("explore", "panel", ("explore", "paper-designed")),
    ("engine", "pymunk", ("tray", "tray.toml", "--drops", "1")),
)


def without(*cases):
    """Run commands, each without some modules, in one fresh process: what it prints, last the exit codes."""
    command = [sys.executable, "-c", RUN, json.dumps(cases)]
    return subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=True)


@pytest.mark.sweep
def test_one_line_names_the_extra():
    ls.dump(with_tray(), "tray.toml")
    done = without(*((modules, words) for _, modules, words in WITHOUT))
    assert done.stdout == f"{[2] * len(WITHOUT)}\n"
    lines = [line for line in done.stderr.splitlines() if not PROGRESS.search(line)]
    for (extra, *_), line in zip(WITHOUT, lines, strict=True):
        assert f"pip install 'limitsets[{extra}]'" in line


@pytest.mark.sweep
def test_without_any_extra_the_rest_works():
    every = "pymunk,xarray,zarr,pandas,pyarrow,panel,bokeh,distributed,dask,IPython"
    throw = ("throw", "paper-designed", "--x", "15", "--side", "2")
    done = without(
        *((every, words) for words in (("scenes",), ("check", "paper-designed"), ("doctor",), throw))
    )
    assert (done.stdout.splitlines()[-1], done.stderr.count("Traceback")) == ("[0, 0, 0, 0]", 0), done.stderr


# ----------------------------------------------------------------
# What commands say of what they do not use, do not find, or cannot take.


SCATTER = {"speed": "0.3 %", "landing": "0.02 in"}
QUICK = ("--no-proof", "--trials", "20")


def noisy(**tables):
    return written(with_cavity(), world={"scatter": SCATTER}, **tables)


def test_feed_says_in_its_first_line_that_the_scatter_is_not_used(capfd):
    _, out, _ = run(capfd, "feed", noisy(), *QUICK)
    assert "[world] scatter is not used" in out.splitlines()[0]
    assert "--scatter" in out.splitlines()[0]
    _, _, err = run(capfd, "feed", noisy(), *QUICK, "--json")
    assert "[world] scatter is not used" in err
    words = ("--scatter", "throw.speed=0.3 %", "--no-level")
    assert "not used" not in run(capfd, "feed", noisy(), *QUICK, *words)[1]


def test_the_levels_of_the_noise_can_be_left_out(capfd):
    scene = noisy(effects={"spread": "gaussian"})
    assert "times the noise" in run(capfd, "feed", scene, *QUICK)[1]
    out = prints(capfd, "feed", scene, *QUICK, "--no-level")
    assert not any(words in out for words in ("times the noise", "not used"))


def test_the_cavities_of_two_scenes_are_told_in_words():
    one = with_cavity("paper-designed")
    two = ls.load(one.as_dict() | {"cavity": one.as_dict()["cavity"] | {"width": "9.4 in"}})
    with pytest.raises(LimitsetsError) as caught:
        ls.assemble(one, two, trials=1)
    assert "Cavity(" not in str(caught.value)
    for scene in (one, two):
        assert ", ".join(f"{key} {text}" for key, text in scene.text["cavity"].items()) in str(caught.value)
    fast = one.with_values({"throw.kappa": "20 in"})
    with pytest.raises(LimitsetsError, match=r"25\.3778518 in and 20 in"):
        ls.assemble(one, fast, trials=1)


def test_where_there_is_no_policy_the_next_thing_is_told(capfd):
    throws = [{"name": "own", **ls.load("paper-initial").as_dict()["throw"]}]
    file = written("paper-initial", feedback={"sensor": {"beyond": "20 in"}, "throws": throws})
    out = prints(capfd, f"feedback {file} --starts 2=17:18 --cells 64 --throws 1", code=1)
    assert "not with 1 throws on these cells" in out
    assert "next: more --throws or --cells, --sweep LO:HI:N for another place of the sensor" in out


def test_analyse_tells_what_is_improbable(capfd):
    fast = written(values={"throw.speed": "160 rpm"})
    assert "throw.speed: careful, '160 rpm'" in prints(capfd, f"analyse {fast} --cells 64")
    assert "throw.speed: careful, '160 rpm'" in run(capfd, f"analyse {fast} --cells 64 --json")[2]


# ----------------------------------------------------------------
# Every key that `--json` prints stands in docs/json.md, and no other: commands whose own tests do not ask for it.


IN_ITS_TEXT = ("effects", "basins", "starts", "goal", "units")


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ("scenes", ""),
        ("throw", "paper-designed --x 8 --side 2"),
        ("plot", "paper-designed part"),
    ],
)
def test_the_keys_are_those_of_the_page(capfd, section, words):
    record = json_of(capfd, f"{section} {words}")
    assert set(record[0] if isinstance(record, list) else record) == documented(section)


def keys_of_an_analysis(record):
    assert set(record) == documented("analyse")
    text = (DOCS / "json.md").read_text(encoding="utf-8").split("## analyse", 1)[1].split("\n## ", 1)[0]
    lists = ("attractors", "cycles", "spurious")
    inner = [*(record[key] for key in IN_ITS_TEXT), *(each for name in lists for each in record[name])]
    missing = {key for table in inner for key in table if key not in text}
    assert not missing
