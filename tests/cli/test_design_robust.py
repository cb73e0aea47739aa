"""`limitsets design --robust`: search without proof, its files, and what it refuses."""

import json
from pathlib import Path

import pytest

import limitsets as ls
from tests.cli.command import run


@pytest.mark.sweep
def test_a_search_writes_scene_answer_and_figure(here, capfd):
    tree = ls.load("paper-designed").as_dict() | {"tolerance": {"throw.speed": "1 %"}}
    ls.dump(ls.load(tree), "given.toml")
    code, out, _ = run(
        capfd,
        "design",
        "given.toml",
        "--robust",
        "--evaluations",
        "4",
        "--vary",
        "part.mass.center.along,throw.kappa",
        "--seconds",
        "0",
        "--out",
        "found",
        "--json",
    )
    assert code == 0
    record = json.loads(out)
    assert record["margins"] == []
    assert {path.name for path in Path("found").iterdir()} == {
        "paper-designed-robust.toml",
        "design.json",
        "front.png",
        "part.png",
    }
    kept = json.loads(Path("found/design.json").read_text(encoding="utf-8"))
    assert isinstance(kept["model"]["assumptions_broken"], int)  # as it is printed
    assert kept["model"] == record["model"]
    again = ls.load(Path("found") / "paper-designed-robust.toml")
    assert again.value("throw.kappa") == record["values"]["throw.kappa"]


@pytest.mark.sweep
def test_the_scene_alone(capfd):
    words = ("--robust", "--evaluations", "20", "--seconds", "0", "-o", "found.toml")
    code, out, _ = run(capfd, "design", "paper-designed", *words)
    assert code == 0
    assert out.splitlines()[-1] == "scene: found.toml"
    assert [path.name for path in Path().iterdir()] == ["found.toml"]
    assert ls.load("found.toml").value("throw.kappa") > 0


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ((), "give one of them"),
        (("--robust", "--critical-points", "10,10,20", "--vary", "throw.speed"), "give one of them"),
        (("--robust", "--bounds", "arm.length=20 in"), "QUANTITY=LOWEST:HIGHEST"),
        (("--robust", "--bounds", "arm.length=:20 in"), "a lower and a higher one"),
        (("--robust", "--vary", "arm.legnth"), "arm.length"),
    ],
)
def test_what_it_refuses(here, capfd, words, says):
    code, _, err = run(capfd, "design", "paper-designed", *words)
    assert code == 2
    assert says in err


def test_where_nothing_is_found_the_nearest_miss_is_written(capfd):
    words = ("--robust", "--bounds", "part.mass.center.along=0.1:0.2", "--evaluations", "20")
    code, out, _ = run(capfd, "design", "paper-designed", *words, "-o", "missed")
    assert code == 1
    assert "nearest miss" in out
    assert "none that feeds among" in out
    assert out.splitlines()[-1] == "scene: missed/paper-designed-robust.toml (the nearest miss, no answer)"
    record = json.loads(Path("missed/design.json").read_text(encoding="utf-8"))
    assert sum(record["ruled_out"].values()) == record["evaluations"]
    assert ls.load(record["scene"]) == ls.load("missed/paper-designed-robust.toml")
    code, out, _ = run(capfd, "design", "paper-designed", *words, "--json", "--csv", "missed.csv")
    assert (code, set(json.loads(out))) == (1, set(record))
    assert "nearest miss" in Path("missed.csv").read_text(encoding="utf-8")
