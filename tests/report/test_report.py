"""The report: pages, figures, files, with own figures in it."""

import base64
import json
import math
import re
import subprocess
import sys
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from jinja2 import UndefinedError

import limitsets as ls
from limitsets.base.errors import AnswerError, LimitsetsError
from limitsets.base.files import as_json, as_table, replaced
from limitsets.cell.feeding import proposed_cavity
from limitsets.face.report.pages import (
    EXPLAINED,
    as_html,
    bands,
    explained,
    page,
    starts_words,
    verdict_of,
    void_of,
    words,
)
from limitsets.face.report.writing import FIGURES, audit_page, write, write as write_report
from limitsets.feeder.goals import OrientedBeyond
from limitsets.feeder.scattering import Gaussian, Scattering
from limitsets.parameters.analysis import GoalOutcome, proved_averages
from tests.assembly.pairs import both_own
from tests.browsers import Page, browser
from tests.cli.command import run
from tests.feeding.scenes import with_cavity
from tests.plates import left_by_some

# ----------------------------------------------------------------
# The report: its words against the answers, and its files replaced whole.


SCENES = Path(__file__).parents[1] / "analysis"
SOURCES = ["paper-designed", "paper-initial", SCENES / "four-sides.toml", SCENES / "five-sides.toml"]
PICTURES = {f"{kind}.png" for kind in ("part", "limit-set", "map", "basins", "morse", "flight")}
FILES = PICTURES | {"report.md", "report.html", "analysis.json"}


@lru_cache(maxsize=8)
def analysed(source):
    return ls.analyse(source)


def asking(goal, **tables):
    return ls.analyse({**ls.load("paper-designed").as_dict(), "goal": goal, **tables}, 1024)


@pytest.mark.parametrize("figures", [{}, {"limit-set": "a.png", "flight": "b.png"}])
def test_a_paragraph_is_a_line_and_one_without_sentences_is_none(figures):
    blocks = page(analysed("paper-designed"), figures).removesuffix("\n").split("\n\n")
    assert all(block.strip("\n") == block.rstrip() == block != "" for block in blocks)
    assert all("  " not in block.strip() for block in blocks if block[0] != " ")
    assert {block[0] for block in blocks if "\n" in block} == {"|", " "}  # tables, the cavity
    pictures = [block for block in blocks if block[0] == "!"]
    assert [re.search(r"\((.*)\)$", each)[1] for each in pictures] == list(figures.values())


def test_a_template_that_speaks_of_what_it_was_not_told_is_refused():
    with pytest.raises(UndefinedError, match="scene"):
        words("scene")


@pytest.mark.parametrize("source", SOURCES[::3], ids=lambda source: Path(source).stem)
def test_everything_is_written(source, tmp_path):
    found = analysed(source)
    seen = []
    folder = tmp_path / "deep" / "down"
    files = write(found, folder, progress=lambda name, done, of: seen.append(name))
    assert {path.name for path in files} == FILES == {path.name for path in folder.iterdir()}
    assert set(seen) <= FILES
    text = files[0].read_text(encoding="utf-8")
    pictures = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", text)
    assert (pictures[0], set(pictures)) == ("part.png", PICTURES)
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in files if path.suffix == ".png")
    record = json.loads(files[1].read_text(encoding="utf-8"))
    assert record == json.loads(json.dumps(found.to_json()))


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: Path(source).stem)
def test_the_page_has_the_numbers(source):
    found = analysed(source)
    text = page(found, {})
    for parts in found.extents[0].values():
        for lo, hi in parts:
            assert f"{math.floor(1000 * lo) / 1000:.3f} to {math.ceil(1000 * hi) / 1000:.3f}" in text
    for points in found.critical_points.values():
        assert all(f"{point.x:.6f}" in text for point in points)
    for word in ("nan", "None", "inf ", "{", "}"):
        assert word not in text


CLEAR = "Nothing here calls for attention. `limitsets audit` says whether the scene breaks assumptions of the model."

# Exponent and flips per throw: bounds on 128 000 cells, made apart from this package, and 6e7 throws in floats.
KNOWN = {"lyapunov": 0.205679, "flips_per_throw": 0.319163}


def test_averages_stand_with_their_proved_bounds():
    found = analysed("paper-designed")
    (bounds,) = averages = proved_averages(found.scene, found.extents)
    text = page(found, {}, averages)
    for name, words_before in (
        ("lyapunov", "exponent [0-9.]+ per throw"),
        ("flips_per_throw", "flips per throw"),
    ):
        lo, hi = map(float, re.search(rf"{words_before} \(proved: (\S+) to (\S+)\)", text).groups())
        assert lo <= bounds[name][0] < KNOWN[name] < bounds[name][1] <= hi < lo + 6e-4
    assert "almost every start" in text
    assert "not proved, but for the bounds" in text
    without = page(found, {})
    assert "(proved:" not in without
    assert "almost every start" not in without


@pytest.mark.parametrize("last", [{0: [(27.0, 27.5)]}, {1: [(27.0, 27.5)]}, {0: [(90.0, 91.0)]}])
def test_bounds_belong_to_the_limit_sets_in_whose_cells_they_are_proved(last):
    found = analysed("paper-designed")
    none, some = proved_averages(found.scene, [{2: [(15.0, 17.0)]} | last, *found.extents])
    assert none == {}
    assert set(some) == set(KNOWN)


@pytest.mark.parametrize("effects", [{"roll": True, "landing": True}, {"spread": "bounded"}])
def test_no_bounds_of_averages_with_effects(effects):
    text = ls.load("paper-designed").as_dict() | {
        "effects": effects,
        "world": {"scatter": {"speed": "0.1 %"}},
    }
    assert proved_averages(ls.load(text), [{0: [(15.0, 19.0)]}]) == [{}]


def test_the_goal_in_words():
    text = page(analysed("paper-designed"), {})
    asked = "every part at rest beyond x = 20 in lies on side 2 (asked of the limit set)"
    assert f"{asked}. **It holds of the limit set** (sampled: no proof)" in text
    assert "from x = 19.753 in on" in text
    assert "does not hold" in page(analysed("paper-initial"), {})
    assert "(sampled, not proved): no part gets there" in page(analysed(SCENES / "five-sides.toml"), {})
    assert "## The goal" not in page(analysed(SCENES / "four-sides.toml"), {})


@pytest.mark.parametrize(
    "goal",
    [
        {"attracts_all": True},
        {"flip_order": [0, 1, 2]},
        {"stays_on_arm": True, "from_anywhere": True},
        {"reaches": {"x": "23 in", "side": 2, "every_orbit": True}},
    ],
)
def test_goals_of_other_kinds(goal):
    text = page(asking(goal), {})
    assert "Asked: " in text
    assert "None" not in text
    assert "from_anywhere = true asks it of every start" not in text
    if goal == {"stays_on_arm": True, "from_anywhere": True}:
        assert "The [goal](#the-goal) **holds** (sampled" in text
        # no throw leads out of any limit set
        assert "from_anywhere = true asks it of every start" in page(asking({"stays_on_arm": True}), {})


def test_of_a_goal_it_is_said_from_which_starts_parts_come_to_where_it_holds():
    """ "holds" stood beside "proved for some starts only": of this feeder 3.5 % of the starts leave."""
    text = page(ls.analyse(left_by_some(), 1024), {})
    holds = r"The \[goal\]\(#the-goal\) \*\*holds of the limit set, to which (\S+) % of all starts come\*\* \(sampled"
    said = re.search(holds, text)
    assert float(said[1]) == pytest.approx(96.5, abs=0.3)


def test_of_thousands_of_recurrent_sets_the_largest_are_named():
    """Over a surface this near to the joint's height jogs are shorter than cells: 6002 sets, in JSON 450 kB of them."""
    scene = left_by_some()
    scene["arm"]["surface_height"] = "-0.2 mm"
    found = ls.analyse(scene, 1024)
    text = page(found, {})
    count = int(re.search(r"(\d+) recurrent sets vanish when cells are cut finer", text)[1])
    assert count == len(found.spurious) > 1000
    (line,) = [line for line in text.splitlines() if line.startswith("**Cells too coarse:**")]
    sizes = [int(size) for size in re.findall(r"\((\d+) cells?\)", line)]
    assert sizes == sorted((len(cells) for cells in found.spurious), reverse=True)[:3]
    cells = sorted((found.morse.nodes[node]["cells"] for node in found.morse), reverse=True)[:5]
    assert f"; the largest have {', '.join(map(str, cells))} cells." in text


def alarms(text):
    """Give what calls for attention: the list between the title and the contents."""
    top = text.split("**Contents:** ")[0].split("\n\n")
    assert (len(top), top[1]) in ((3, CLEAR), (4, "**Calls for attention:**"))
    return [line for line in top[2].splitlines() if line.startswith("* ")]


def section(text, name):
    return text.split(f"## {name}\n")[1].split("\n## ")[0]


@pytest.mark.parametrize("side", [0, 2])
def test_a_goal_that_no_part_gets_to_holds_vacuously(side):
    """tests/test_paper.py: the limit set ends at 23.383 in."""
    found = asking({"oriented_beyond": {"x": "25 in", "side": side}})
    text = page(found, {})
    short = "no part gets there: the limit set ends at x = 23.383 in, before x = 25 in."
    assert f"The [goal](#the-goal) **holds vacuously** (sampled, not proved): {short}" in alarms(text)[0]
    assert "**It holds vacuously** (sampled" in text
    assert found.to_json()["goal_vacuous"] is True
    assert analysed("paper-designed").to_json()["goal_vacuous"] is False
    assert "vacuously" not in page(analysed("paper-designed"), {})


def test_a_goal_is_vacuous_also_where_parts_never_lie_on_another_side():
    """Thrown so fast the part jogs about x = 8.98 in on side 2: nothing was said of the 20 in that it never gets to."""
    text = page(asking({"oriented_beyond": {"x": "20 in", "side": 2}}, throw={"kappa": "4 in"}), {})
    assert "It holds vacuously" in section(text, "The goal")
    assert "the limit set ends at x = 8.976 in, before x = 20 in" in alarms(text)[0]


def test_what_is_asked_from_anywhere_is_not_answered_by_where_the_limit_set_ends():
    """It fails, by a landing beyond 25 in; the page added that no part gets there."""
    text = page(asking({"oriented_beyond": {"x": "25 in", "side": 2}, "from_anywhere": True}), {})
    assert "**It does not hold**" in text
    assert "gets there" not in text
    text = page(asking({"oriented_beyond": {"x": "27.9 in", "side": 2}, "from_anywhere": True}), {})
    assert "**It holds vacuously**" in text
    assert "no part gets there: the farthest landing is at x = 2" in text


def test_a_limit_set_that_ends_before_is_named_where_another_does_not():
    goal = OrientedBeyond(20.0, 2)
    asked = GoalOutcome(goal, True, 19.7, reach=(23.4, 12.0))
    assert not asked.vacuous
    assert verdict_of(asked, 1.0) == "holds of each limit set"
    assert verdict_of(asked, 0.35) == "holds of each limit set, to which 35.0 % of all starts come"
    void = "not every part gets there: limit set 1 ends at x = 12.000 in, before x = 20 in"
    assert void_of(asked, "in", None) == void
    assert void_of(GoalOutcome(goal, False, 21.0, reach=(23.4, 12.0)), "in", None) == ""


def test_starts_outside_the_model_are_told_why():
    fast = page(asking({"attracts_all": True}, throw={"kappa": "4 in"}), {})
    assert "Outside the model: a throw after which the part has not landed within a full turn" in fast
    assert "Outside the model" not in page(analysed("paper-designed"), {})


def test_an_audit_says_where_it_followed_no_throw():
    """With kappa = 8 in the orbit comes to rest in fewer throws than are left out as a transient."""
    tree = ls.load("paper-designed").as_dict() | {"throw": {"kappa": "8 in"}}
    text = audit_page(ls.audit(tree))
    assert "No orbit was followed on a limit set" in text
    assert "was seen to break" not in text
    assert "cannot tell: no throw known" in text
    assert "no throw known" not in audit_page(ls.audit("paper-designed"))
    found = replace(ls.audit("paper-designed"), extents={})
    assert "No limit set was found." in audit_page(found)
    assert "in cells that are proved" not in audit_page(found)


def test_flags_and_assumptions_in_words():
    text = page(analysed("paper-designed"), {})
    assert "**Another vertex lands first** on throws from side 0: 20.151 to 28.000 in; side 1: 26.423" in text
    assert "No throw from the limit set is concerned" in text
    assert "**Assumed:**" in text
    assert "**Sampled, not proved.**" in text
    assert "158.02 deg/s" in text
    assert "Cells too coarse" not in text
    assert "Cells too coarse" in page(ls.analyse("paper-initial", 512), {})


def test_a_flag_on_the_limit_set_is_said_at_the_top():
    found = replace(analysed("paper-designed"), other_vertex_first={0: [(19.0, 28.0)], 1: [], 2: []})
    text = page(found, {})
    (alarm,) = alarms(text)
    assert "another vertex lands first: the model does not describe" in alarm
    assert "It is side 0: 19.000 to 19.753 in" in alarm
    assert "lands first" not in text.split("## ")[1]


def test_where_nothing_calls_for_attention_a_line_says_so_and_the_contents_follow():
    text = page(analysed("paper-designed"), {})
    assert text.split("\n\n")[1] == CLEAR
    links = re.findall(r"\[(.*?)\]\(#(.*?)\)", text.split("\n\n")[2])
    assert [head for head, _ in links] == re.findall(r"^## (.*)$", text, re.MULTILINE)
    assert all(name == head.lower().replace(" ", "-") for head, name in links)
    assert len(alarms(page(ls.analyse(left_by_some(), 1024), {}))) > 1
    assert "**Some starts leave the arm**: inward " in page(ls.analyse(left_by_some(), 1024), {})


def test_words_are_explained_where_they_first_stand():
    text = "# My basin\n\n| basins |\n\nTwo basins, `--cells`:\n\nThe basin, cells\n* of a cell"
    basin, cell = EXPLAINED["basins?"], EXPLAINED["[Cc]ells?"]
    told = text.replace("Two", f"*{basin}* Two").replace("The basin, cells", f"The basin, cells *{cell}*")
    assert explained(text) == told
    text = page(analysed("paper-designed"), {})
    for sentence in EXPLAINED.values():
        assert text.count(sentence) == 1


def test_a_cavity_is_proposed_where_the_goal_holds_and_there_is_none():
    """The one that `feed` proposes, and nothing that feeds is loaded for it."""
    text = page(analysed("paper-designed"), {})
    lines = proposed_cavity(ls.load("paper-designed")).splitlines()
    assert "\n".join(f"    {line}" for line in lines) in section(text, "The goal")
    without = (
        ls.load("paper-initial"),
        with_cavity(),
        {**ls.load("paper-designed").as_dict(), "goal": {"attracts_all": True}},
    )
    for scene in without:
        assert "[cavity]" not in page(ls.analyse(scene, 512), {})
    code = "from limitsets.face.report.pages import cavity_for\nimport limitsets as ls, sys\n"
    code += "assert cavity_for(ls.analyse('paper-designed', 64))\n"
    code += "assert 'limitsets.cell.feeding.feeding_run' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_nothing_stays():
    """Its figures: tests/plot/test_figures.py."""
    scene = ls.load(SCENES / "five-sides.toml").with_values({"throw.kappa": 60.0, "arm.surface_height": -0.5})
    text = page(ls.analyse(scene), {})
    assert "no start was found to stay on the arm" in text
    assert "100 % inward" in text
    assert "This analysis cannot tell" in text
    assert "of the states of a long orbit" not in text  # there was none


def test_what_is_not_settled_is_said():
    text = page(ls.analyse("paper-initial", 20), {})
    assert any("**Not settled:**" in alarm for alarm in alarms(text))
    assert any("**Undecided**" in alarm and "--cells 80" in alarm for alarm in alarms(text))
    assert text.count("Not settled") == 1
    assert "ended where their cells say" in page(analysed("paper-designed"), {})


def test_bands_tell_which_sides_occur_where():
    found = bands(analysed("paper-designed").extents[0])
    assert [sides for _, _, sides in found] == [(2,), (1, 2), (0, 1, 2), (0, 2), (2,)]
    assert found[-1][0] == pytest.approx(19.75268801485, abs=1e-9)


# ---------------------------------------------------------------- files


@pytest.mark.sweep
def test_a_fault_while_writing_the_page_leaves_the_old_files_whole(tmp_path, monkeypatch):
    for name in ("report.md", "map.png"):
        (tmp_path / name).write_text("old")
    text_of = Path.write_text

    def fails(self, *arguments, **options):
        if self.name == "report.md":
            raise OSError(28, "No space left on device")
        return text_of(self, *arguments, **options)

    monkeypatch.setattr(Path, "write_text", fails)
    with pytest.raises(LimitsetsError, match="No space left"):
        write_report(analysed("paper-designed"), tmp_path)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {
        "report.md": "old",
        "map.png": "old",
    }


def test_a_place_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(LimitsetsError, match="a folder that can be written"):
            write(analysed("paper-initial"), folder)


def test_a_scene_whose_throws_all_leave_the_model_has_a_report_without_a_flight(tmp_path):
    """150 rad/s for 150 deg/s: the part turns many times before it lands, and there is nothing to draw."""
    wild = ls.load("paper-designed").with_values({"throw.speed": "150 rad/s"})
    (tmp_path / "notes.txt").write_text("mine")
    written = write(ls.analyse(wild, 256), tmp_path)
    assert (tmp_path / "notes.txt").read_text() == "mine"  # other files stay
    assert {path.name for path in written} == FILES - {"flight.png"}
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "no start was found to stay on the arm" in text
    assert "flight.png" not in text
    with pytest.raises(AnswerError, match=r"outside the model, from x = 15 on side 0.*right unit"):
        ls.plot.flight(wild, 15.0, 0)


def test_a_proved_share_is_rounded_down():
    """Not the doctest's: pytest takes 96.5 for 96.4 there."""
    assert starts_words("cells", 0.96459) == "for 96.4 % of all starts"
    assert starts_words("cells", 0.99999) == "for 99.9 % of all starts"


# ----------------------------------------------------------------
# The report as one file: it stands alone, says what the Markdown says, and is readable on a phone.


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("report")
    write(ls.analyse("paper-designed", cells=512), place)
    return place


def test_it_stands_alone_and_has_all_figures(folder):
    page = Page((folder / "report.html").read_text(encoding="utf-8"))
    links = [
        attributes[name] for _, attributes in page.tags for name in ("href", "src") if name in attributes
    ]
    sections = {f"#{attributes['id']}" for tag, attributes in page.tags if tag == "h2"}
    assert {link for link in links if not link.startswith("data:")} == sections
    images = [attributes for tag, attributes in page.tags if tag == "img"]
    assert len(images) == len(FIGURES)
    for image in images:
        assert image["alt"]
        assert base64.b64decode(image["src"].partition(",")[2]).startswith(b"\x89PNG")


def test_it_says_what_the_markdown_says(folder):
    html = Page((folder / "report.html").read_text(encoding="utf-8"))
    page = re.sub(r"!\[.*?\]\(.*?\)|\]\(#.*?\)", "", (folder / "report.md").read_text(encoding="utf-8"))

    def words(text):
        return re.findall(r"[\w.]+", text)

    title = page.splitlines()[0].lstrip("# ")
    said = " ".join(text for tag, _, text in html.texts if tag != "style")
    assert words(said) == words(title) + words(page)


def test_text_of_a_scene_is_never_markup():
    page = as_html("# a <b> & c\n\n<script>alert(1)</script>\n\n[x](javascript:alert(1))\n", {})
    assert "<script>" not in page
    assert 'href="javascript' not in page
    assert "<title>a &lt;b&gt; &amp; c</title>" in page


@pytest.mark.sweep
@pytest.mark.parametrize("width", [1200, 390])
def test_no_page_is_wider_than_the_screen(width, folder):
    said = []
    with browser() as started:
        page = started.new_page(viewport={"width": width, "height": 800})
        page.on("console", lambda message: said.append(message.text))
        page.on("request", lambda request: said.extend([request.url] * request.url.startswith("http")))
        page.goto((folder / "report.html").as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert page.evaluate("[...document.images].every(each => each.naturalWidth > 0)")
    assert said == []


# ----------------------------------------------------------------
# Files that are replaced whole, or not at all, and answers as JSON.


@dataclass
class Place:
    x: float
    side: int


class Told:
    def to_json(self):
        return as_table(place=Place(math.nan, np.int64(2)))


def test_an_answer_as_json():
    answer = {
        1: (Told(), Place(np.float64(0.1), 0)),
        "sizes": np.array([[1.5, -np.inf], [np.nan, 2.0]]),
        "none": None,
        "words": iter(["a", "é"]),
        "sure": np.True_,
    }
    text = as_json(answer)
    assert json.loads(text) == {
        "1": [{"place": {"x": None, "side": 2}}, {"x": 0.1, "side": 0}],
        "sizes": [[1.5, None], [None, 2.0]],
        "none": None,
        "words": ["a", "é"],
        "sure": True,
    }
    assert text == json.dumps(json.loads(text), indent=2) + "\n"
    with pytest.raises(TypeError):
        as_json(object())


def test_all_at_once(tmp_path):
    (tmp_path / "one").write_text("old")
    with replaced(tmp_path) as draft:
        (draft / "one").write_text("new")
        (draft / "two").write_text("new")
        assert (tmp_path / "one").read_text() == "old"
        assert not (tmp_path / "two").exists()
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"one": "new", "two": "new"}


@pytest.mark.parametrize("fault", [ValueError, KeyboardInterrupt, SystemExit])
def test_a_fault_leaves_the_old_ones(tmp_path, fault):
    (tmp_path / "one").write_text("old")
    with pytest.raises(fault), replaced(tmp_path) as draft:  # noqa: PT012 - leaving the block is what is tested
        (draft / "one").write_text("half")
        raise fault
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("one", "old")]


def test_a_fault_between_two_renames_leaves_whole_files(tmp_path, monkeypatch):
    for name in ("one", "two"):
        (tmp_path / name).write_text("old")
    rename, calls = Path.replace, []

    def fails_second(self, target):
        calls.append(target)
        if len(calls) == 2:
            raise OSError(28, "No space left on device")
        return rename(self, target)

    monkeypatch.setattr(Path, "replace", fails_second)
    with pytest.raises(OSError, match="No space"), replaced(tmp_path) as draft:  # noqa: PT012 - leaving the block is what is tested
        (draft / "one").write_text("new")
        (draft / "two").write_text("new")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"one": "new", "two": "old"}


def test_only_regular_files_are_replaced(tmp_path):
    (tmp_path / "two").mkdir()
    (tmp_path / "one").write_text("old")
    with pytest.raises(FileExistsError), replaced(tmp_path) as draft:  # noqa: PT012 - leaving the block is what is tested
        (draft / "one").write_text("new")
        (draft / "two").write_text("new")
    assert (tmp_path / "one").read_text() == "old"
    assert {path.name for path in tmp_path.iterdir()} == {"one", "two"}


# ----------------------------------------------------------------
# What the paper's experimenters counted stands in no answer about a user's own scenes, through any door.


THEIRS = re.compile(r"\bpaper\b|\b(19|17|11) of( the)? 20\b", re.IGNORECASE)
NOISE = Scattering(speed=Gaussian(0.005))


def said_by(figure):
    """Every text of a figure, legends and notes too."""
    from matplotlib.text import Text

    return " ".join(each.get_text() for each in figure.findobj(Text))


def clean(words, *names):
    for name in names:
        words = words.replace(name, "own")
    assert not THEIRS.search(words), THEIRS.search(words)
    return words


def test_feeding(capfd, tmp_path):
    tree = {**with_cavity().as_dict(), "name": "own"}
    scene = ls.load(tree)
    found = ls.feed(scene, NOISE, trials=40, prove=False)
    words = [as_json(found), said_by(ls.plot.feeding(found)), *(str(table) for table in found.tables())]
    clean(" ".join(words))
    assert "assumed" in said_by(ls.plot.feeding(found))
    ls.dump(scene, tmp_path / "own.toml")
    flags = ("--trials", "40", "--no-proof", "--scatter", "throw.speed=0.5 %")
    _, out, err = run(capfd, "feed", str(tmp_path / "own.toml"), *flags, "-o", str(tmp_path / "out"))
    clean(out + err + (tmp_path / "out" / "feeding.json").read_text(), str(tmp_path))
    assert "assumed: " in out


@pytest.mark.parametrize("contact", [False, True])
def test_assembly(capfd, tmp_path, contact):
    if contact:
        pytest.importorskip("pymunk")
    one, two = both_own(contact=contact)
    found = ls.assemble(one, two, NOISE, trials=3)
    # the cavity is part of the arm unless asked otherwise
    assert json.loads(as_json(found))["carried"] is contact
    clean(" ".join([as_json(found), said_by(ls.plot.assembly(found)), str(found.table())]))
    for name, each in (("one", one), ("two", two)):
        ls.dump(each, tmp_path / f"{name}.toml")
    files = (str(tmp_path / "one.toml"), str(tmp_path / "two.toml"))
    code, out, err = run(capfd, "assemble", *files, "--trials", "3", "-o", str(tmp_path / "out"))
    assert code == 0
    clean(out + err + (tmp_path / "out" / "assembly.json").read_text(), str(tmp_path))
    if contact:
        assert "the cavity is thrown too" in out
        _, out, _ = run(capfd, "assemble", *files, "--trials", "1", "--standing")
        assert "the cavity stands" in out
