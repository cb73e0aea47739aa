"""The report: its words against the answers, and its files replaced whole."""

import json
import re
from functools import lru_cache
from pathlib import Path

import pytest

import limitsets as ls
from limitsets.errors import LimitsetsError
from limitsets.report import page, write
from limitsets.report import write as write_report
from limitsets.report.tables import bands

SCENES = Path(__file__).parents[1] / "analysis"
SOURCES = ["paper-designed", "paper-initial", SCENES / "four-sides.toml", SCENES / "five-sides.toml"]
FILES = {"report.md", "analysis.json", "limit-set.png", "map.png", "basins.png", "morse.png", "flight.png"}


@lru_cache(maxsize=8)
def analysed(source):
    return ls.analyse(source)


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
    assert f"{asked}. **It holds** (sampled: no proof)" in text
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
    from dataclasses import replace

    found = replace(analysed("paper-designed"), other_vertex_first={0: [(19.0, 28.0)], 1: [], 2: []})
    text = page(found, {})
    assert "another vertex lands first: the model does not describe" in text.split("##")[0]
    assert "This touches the limit set: side 0: 19.000 to 19.753 in" in text


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


@pytest.mark.parametrize("fault", [RuntimeError, KeyboardInterrupt])
def test_a_fault_while_drawing_leaves_the_old_files_whole(tmp_path, monkeypatch, fault):
    import limitsets.plot

    write(analysed("paper-initial"), tmp_path)
    before = bytes_of(tmp_path)

    def fails(*_, **__):
        raise fault

    monkeypatch.setattr(limitsets.plot, "basins", fails)
    with pytest.raises(fault):
        write(analysed("paper-designed"), tmp_path)
    assert bytes_of(tmp_path) == before


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
