"""The report: its words against the answers, and its files replaced whole."""

import json
import re
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import pytest
from jinja2 import UndefinedError

import limitsets as ls
from limitsets.base.errors import AnswerError, LimitsetsError
from limitsets.face.report.pages import bands, page, starts_words, verdict_of, void_of, words
from limitsets.face.report.writing import audit_page, write
from limitsets.face.report.writing import write as write_report
from limitsets.feeder.goals import OrientedBeyond
from limitsets.parameters.analysis import GoalOutcome
from tests.lead_triangle import left_by_some

SCENES = Path(__file__).parents[1] / "analysis"
SOURCES = ["paper-designed", "paper-initial", SCENES / "four-sides.toml", SCENES / "five-sides.toml"]
FILES = {
    "report.md",
    "analysis.json",
    "part.png",
    "limit-set.png",
    "map.png",
    "basins.png",
    "morse.png",
    "flight.png",
}


@lru_cache(maxsize=8)
def analysed(source):
    return ls.analyse(source)


@pytest.mark.parametrize("figures", [{}, {"limit-set": "a.png", "flight": "b.png"}])
def test_a_paragraph_is_a_line_and_one_without_sentences_is_none(figures):
    blocks = page(analysed("paper-designed"), figures).removesuffix("\n").split("\n\n")
    assert all(block == block.strip() != "" for block in blocks)
    assert all("  " not in block for block in blocks)
    assert {block[0] for block in blocks if "\n" in block} == {"|"}
    pictures = [block for block in blocks if block[0] == "!"]
    assert [re.search(r"\((.*)\)$", each)[1] for each in pictures] == list(figures.values())


def test_a_template_that_speaks_of_what_it_was_not_told_is_refused():
    with pytest.raises(UndefinedError, match="scene"):
        words("scene")


def bytes_of(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: Path(source).stem)
def test_everything_is_written(source, tmp_path):
    found = analysed(source)
    seen = []
    files = write(found, tmp_path / "deep" / "down", progress=lambda name, done, of: seen.append(name))
    assert (
        {path.name for path in files}
        == FILES
        == {path.name for path in (tmp_path / "deep" / "down").iterdir()}
    )
    assert set(seen) <= FILES
    text = files[0].read_text(encoding="utf-8")
    assert set(re.findall(r"!\[[^\]]+\]\(([^)]+)\)", text)) == {
        name for name in FILES if name.endswith(".png")
    }
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in files if path.suffix == ".png")
    record = json.loads(files[1].read_text(encoding="utf-8"))
    assert record == json.loads(json.dumps(found.to_json()))
    for parts in found.extents[0].values():
        for lo, hi in parts:
            assert f"{lo:.3f} to {hi:.3f}" in text
    for points in found.critical_points.values():
        assert all(f"{point.x:.6f}" in text for point in points)
    for word in ("nan", "None", "inf ", "{", "}"):
        assert word not in text


def test_the_goal_in_words():
    text = page(analysed("paper-designed"), {})
    asked = "every part at rest beyond x = 20 in lies on side 2 (asked of the limit set)"
    assert f"{asked}. **It holds of the limit set** (sampled: no proof)" in text
    assert "from x = 19.753 in on" in text
    assert "does not hold" in page(analysed("paper-initial"), {})
    assert "But no part gets there" in page(analysed(SCENES / "five-sides.toml"), {})
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
    text = page(ls.analyse({**ls.load("paper-designed").as_dict(), "goal": goal}), {})
    assert "Asked: " in text
    assert "None" not in text


def asking(goal, **tables):
    return ls.analyse({**ls.load("paper-designed").as_dict(), "goal": goal, **tables}, 1024)


def test_of_a_goal_it_is_said_from_which_starts_parts_come_to_where_it_holds():
    """ "holds" stood beside "proved for some starts only": of this feeder 3.5 % of the starts leave."""
    text = page(ls.analyse(left_by_some(), 1024), {})
    said = re.search(
        r"The goal \*\*holds of the limit set, to which (\S+) % of all starts come\*\* \(sampled", text
    )
    assert float(said[1]) == pytest.approx(96.5, abs=0.3)
    every = page(asking({"stays_on_arm": True, "from_anywhere": True}), {})
    assert "The goal **holds** (sampled" in every


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


def section(text, name):
    return text.split(f"## {name}\n")[1].split("\n## ")[0]


@pytest.mark.parametrize("side", [0, 2])
def test_a_goal_that_no_part_gets_to_holds_vacuously(side):
    """tests/test_paper.py: the limit set ends at 23.383 in."""
    found = asking({"oriented_beyond": {"x": "25 in", "side": side}})
    text = page(found, {})
    assert "The goal **holds vacuously** (sampled" in text.split("##")[0]
    assert "**It holds vacuously** (sampled" in text
    assert "But no part gets there: the limit set ends at x = 23.383 in, before x = 25 in." in text
    assert found.to_json()["goal_vacuous"] is True
    assert analysed("paper-designed").to_json()["goal_vacuous"] is False
    assert "vacuously" not in page(analysed("paper-designed"), {})


def test_a_goal_is_vacuous_also_where_parts_never_lie_on_another_side():
    """Thrown so fast the part jogs about x = 8.98 in on side 2: nothing was said of the 20 in that it never gets to."""
    text = page(asking({"oriented_beyond": {"x": "20 in", "side": 2}}, throw={"kappa": "4 in"}), {})
    assert "It holds vacuously" in section(text, "The goal")
    assert "the limit set ends at x = 8.976 in, before x = 20 in" in section(text, "The goal")


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
    assert (
        void_of(asked, "in", None)
        == "not every part gets there: limit set 1 ends at x = 12.000 in, before x = 20 in"
    )
    assert void_of(GoalOutcome(goal, False, 21.0, reach=(23.4, 12.0)), "in", None) == ""


def test_no_throw_leads_out_of_any_limit_set():
    assert "from_anywhere = true asks it of every start" in page(asking({"stays_on_arm": True}), {})
    assert "asks it of every start" not in page(asking({"stays_on_arm": True, "from_anywhere": True}), {})


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
    assert "**Another vertex lands first** on throws from side 0: 20.152 to 28.000 in; side 1: 26.424" in text
    assert "No throw from the limit set is concerned" in text
    assert "**Assumed:**" in text
    assert "**Sampled, not proved.**" in text
    assert "158.02 deg/s" in text
    assert "Cells too coarse" not in text
    assert "Cells too coarse" in page(ls.analyse("paper-initial", 512), {})


def test_a_flag_on_the_limit_set_is_said_at_the_top():
    found = replace(analysed("paper-designed"), other_vertex_first={0: [(19.0, 28.0)], 1: [], 2: []})
    text = page(found, {})
    assert "another vertex lands first: the model does not describe" in text.split("##")[0]
    assert "This touches the limit set: side 0: 19.000 to 19.753 in" in text


@pytest.mark.sweep
def test_nothing_stays(tmp_path):
    scene = ls.load(SCENES / "five-sides.toml").with_values({"throw.kappa": 60.0, "arm.surface_height": -0.5})
    files = write(ls.analyse(scene), tmp_path)
    text = files[0].read_text(encoding="utf-8")
    assert "no start was found to stay on the arm" in text
    assert "100 % inward" in text
    assert "This analysis cannot tell" in text
    assert "of the states of a long orbit" not in text  # there was none


def test_what_is_not_settled_is_said():
    text = page(ls.analyse("paper-initial", 20), {})
    assert "**Not settled:**" in text
    assert "ended where their cells say" in page(analysed("paper-designed"), {})


def test_bands_tell_which_sides_occur_where():
    found = bands(analysed("paper-designed").extents[0])
    assert [sides for _, _, sides in found] == [(2,), (1, 2), (0, 1, 2), (0, 2), (2,)]
    assert found[-1][0] == pytest.approx(19.75268801485, abs=1e-9)


# ---------------------------------------------------------------- files


@pytest.mark.sweep
@pytest.mark.parametrize("fault", [RuntimeError, KeyboardInterrupt])
def test_a_fault_while_drawing_leaves_the_old_files_whole(tmp_path, monkeypatch, fault):
    write(analysed("paper-initial"), tmp_path)
    before = bytes_of(tmp_path)

    def fails(*_, **__):
        raise fault

    monkeypatch.setattr("limitsets.face.report.writing.basins", fails)
    with pytest.raises(fault):
        write(analysed("paper-designed"), tmp_path)
    assert bytes_of(tmp_path) == before


@pytest.mark.sweep
def test_a_fault_while_writing_the_page_leaves_the_old_files_whole(tmp_path, monkeypatch):
    write(analysed("paper-initial"), tmp_path)
    before = bytes_of(tmp_path)
    text_of = Path.write_text

    def fails(self, *arguments, **options):
        if self.name == "report.md":
            raise OSError(28, "No space left on device")
        return text_of(self, *arguments, **options)

    monkeypatch.setattr(Path, "write_text", fails)
    with pytest.raises(LimitsetsError, match="No space left"):
        write_report(analysed("paper-designed"), tmp_path)
    assert bytes_of(tmp_path) == before


def test_other_files_in_the_folder_stay(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    write(analysed("paper-initial"), tmp_path)
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_a_place_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(LimitsetsError, match="a folder that can be written"):
            write(analysed("paper-initial"), folder)


def test_a_scene_whose_throws_all_leave_the_model_has_a_report_without_a_flight(tmp_path):
    """150 rad/s for 150 deg/s: the part turns many times before it lands, and there is nothing to draw."""
    wild = ls.load("paper-designed").with_values({"throw.speed": "150 rad/s"})
    written = write(ls.analyse(wild, 256), tmp_path)
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
