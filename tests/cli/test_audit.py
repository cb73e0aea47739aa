"""`limitsets audit`: words, JSON, files, exit codes."""

import json
from pathlib import Path

import pytest

import limitsets as ls
from tests.cli.command import run


def test_table_says_what_breaks_where_and_how_often(capfd):
    code, out, _ = run(capfd, "audit", "paper-initial")
    assert code == 0
    rows = {line.split()[0]: line for line in out.splitlines() if line.split()[:1]}
    assert "BREAKS: 8.3 % of jogs" in rows["roll"]
    assert "breaks on side 1" in rows["roll"]
    assert "holds (proved)" in rows["landing"]
    assert "breaks on side 0" in rows["landing"]
    assert "Called for on the limit set: pivot, roll." in out
    assert "Give friction, restitution, stroke, scatter in [world]" in out
    assert not any("…" in line for line in out.splitlines())
    assert not list(Path().iterdir())


def test_json_alone_on_stdout(capfd):
    code, out, _ = run(capfd, "audit", "paper-initial", "--json")
    assert code == 0
    assert json.loads(out) == json.loads(json.dumps(ls.audit("paper-initial").to_json()))


def test_files(capfd):
    code, out, _ = run(capfd, "audit", "paper-designed", "-o", "deep/down")
    assert code == 0
    assert out.splitlines()[-1] == "report: deep/down/audit.md"
    folder = Path("deep/down")
    assert {path.name for path in folder.iterdir()} == {"audit.md", "audit.json", "part.png", "audit.png"}
    assert (folder / "audit.png").read_bytes().startswith(b"\x89PNG")
    page = (folder / "audit.md").read_text(encoding="utf-8")
    assert "(audit.png)" in page
    assert "| left corner lands first | 0 | 20.1517 to 28.0000 |" in page
    assert "| left corner lands first | 1 | 26.4235 to 28.0000 |" in page
    assert json.loads((folder / "audit.json").read_text())[0]["effect"] == "release"


@pytest.mark.parametrize("words", [("no-such-scene",), ("paper-initial", "-o", "taken/deeper")])
def test_bad_input_is_exit_2(capfd, words):
    Path("taken").write_text("a file")
    code, out, err = run(capfd, "audit", *words)
    assert code == 2
    assert out == ""
    assert err


@pytest.mark.sweep
def test_analyse_resolves_auto_and_says_so(capfd):
    tree = ls.load("paper-initial").as_dict() | {"effects": {"auto": True}}
    ls.dump(ls.load(tree), "auto.toml")
    code, out, _ = run(capfd, "analyse", "auto.toml", "--json", "-o", "found")
    record = json.loads(out)
    assert code == 0
    assert "roll" in record["effects"]["switched_on"]
    assert record["effects"]["left_out"]["slip"] == "world.friction is missing: cannot tell"
    assert record["scene"]["effects"]["roll"] is True
    page = Path("found/report.md").read_text(encoding="utf-8")
    assert "The audit of the limit set switched on: roll" in page
    assert "slip: world.friction is missing" in page
    assert "stays where it is until the next throw" not in page  # that is what rolling lifts
    code, out, _ = run(capfd, "throw", "auto.toml", "--x", "18", "--side", "1")
    assert code == 0
