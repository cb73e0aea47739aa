"""A part that cannot rest on a side: `analyse` alone switches landing and roll on; with them all commands go."""

import json
from pathlib import Path

import pytest

import limitsets as ls
from tests.cli.command import run
from tests.scene.test_chamfer import BOTH, chamfered

FIRST = "switched on landing and roll: the part cannot rest on side 3, and tips on from there; other commands ask for"


def written(**tables):
    """Write a scene's file, and return its text."""
    ls.dump(ls.load(chamfered(**{"effects": BOTH, **tables})), "chamfered.toml")
    return Path("chamfered.toml").read_text(encoding="utf-8")


def without_lines():
    """Write it without the effects; what cannot be loaded cannot be dumped."""
    lines = ("[effects]", "landing = true", "roll = true")
    kept = [line for line in written().splitlines() if line not in lines]
    Path("chamfered.toml").write_text("\n".join(kept) + "\n", encoding="utf-8")


def test_analyse_says_in_its_first_line_what_it_switched_on(capfd):
    without_lines()
    code, out, _ = run(capfd, "analyse", "chamfered.toml", "--cells", "512", "-o", "found")
    assert code == 0
    assert out.splitlines()[0] == f"{FIRST} landing = true and roll = true in [effects]"
    page = Path("found/report.md").read_text(encoding="utf-8")
    assert "**Switched on landing and roll: the part cannot rest on side 3" in page.split("\n\n")[1]
    record = json.loads(Path("found/analysis.json").read_text(encoding="utf-8"))
    assert record["scene"]["effects"] == BOTH
    assert record["effects"]["tipping"] == ["landing", "roll"]
    assert "3" not in record["attractors"][0]["extents"]
    assert record["attractors"][0]["flip_order"] == [0, 1, 2, 4]
    assert sum(record["basins"]["attractors"]) == pytest.approx(1.0)
    assert ls.load(record["scene"]).sides.rests.tolist() == [True, True, True, False, True]


def test_with_the_lines_nothing_is_switched_on_and_nothing_said(capfd):
    written()
    code, out, err = run(capfd, "analyse", "chamfered.toml", "--cells", "512", "-o", "found", "--json")
    assert code == 0
    assert "switched on" not in err
    assert json.loads(out)["effects"]["tipping"] == []


@pytest.mark.parametrize(
    "words",
    [
        ("certify", "chamfered.toml"),
        ("throw", "chamfered.toml", "--x", "20", "--side", "0"),
        ("audit", "chamfered.toml"),
        ("margin", "chamfered.toml"),
    ],
)
def test_all_others_name_the_lines(words, capfd):
    without_lines()
    code, out, err = run(capfd, *words)
    assert (code, out) == (2, "")
    assert "the part cannot rest on side 3" in err
    assert "add landing = true and roll = true to [effects]" in err


@pytest.mark.sweep
def test_with_the_lines_all_of_them_go(capfd):
    written(goal={"stays_on_arm": True})
    for kind in ("part", "limit-set", "map", "basins", "morse", "flight"):
        assert run(capfd, "plot", "chamfered.toml", kind, "-o", f"{kind}.png")[0] == 0
    titles = [axes.get_title() for axes in ls.plot.map(ls.load("chamfered.toml")).axes]
    assert titles[3] == "on side 3: no part rests there"
    code, out, _ = run(
        capfd, "throw", "chamfered.toml", "--x", "20", "--side", "0", "--count", "50", "--json"
    )
    sides = {row["side"] for row in json.loads(out)}
    assert code == 0
    assert sides == {0, 1, 2, 4}
    code, out, _ = run(capfd, "audit", "chamfered.toml", "--json")
    assert code == 0
    assert 3 not in {row["side"] for row in json.loads(out)}
    assert all("3" not in row["ranges"] for row in json.loads(out))
    code, _, err = run(capfd, "throw", "chamfered.toml", "--x", "20", "--side", "3")
    assert code == 2
    assert "tips over on side 3" in err
