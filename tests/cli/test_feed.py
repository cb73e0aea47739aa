"""`limitsets feed`: words, JSON, files, exit codes."""

import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import limitsets as ls
from tests.cli.command import run
from tests.feeding.scenes import with_cavity


def written(name, **changes):
    ls.dump(with_cavity(name, **changes), "fed.toml")
    return "fed.toml"


def test_words_files_and_exit(capfd):
    file = written("paper-designed", rate="2 Hz")
    quick = ("--trials", "200")
    code, out, _ = run(capfd, "feed", file, *quick, "-o", "fed")
    assert code == 0
    assert "the arm ends at x = 20 in, side 2 is wanted" in out
    assert "safety: PROVED" in out
    assert "within 786 throws" in out
    assert {path.name for path in Path("fed").iterdir()} == {"feeding.json", "part.png", "feeding.png"}
    assert json.loads(Path("fed/feeding.json").read_text())["scene"] == "paper-designed"


@pytest.mark.sweep
def test_json_alone_and_noise(capfd):
    file = written("paper-designed")
    code, out, _ = run(
        capfd, "feed", file, "--json", "--no-proof", "--scatter", "landing.x=0.1 in", "--law", "bounded",
        "--trials", "50", "--seed", "4",
    )  # fmt: skip
    assert code == 0
    table = json.loads(out)
    assert table["safety"] is None
    assert table["scatter"] == {"landing": "Uniform(bound=0.1)"}
    assert table["trials"]["seed"] == 4
    assert table["success"]["wanted"] == 0.95


@pytest.mark.sweep
def test_the_certificate_is_written_and_rechecked(capfd):
    file = written("paper-designed", position="20.5 in")
    quick = ("--trials", "50", "--certificate", "fed.proof.zip")
    code, out, _ = run(capfd, "feed", file, *quick)
    assert code == 0
    assert "certificate: fed.proof.zip, rechecked in" in out
    code, out, _ = run(capfd, "recheck", "fed.proof.zip")
    assert code == 0
    assert "feeds: the arm ends at x = 20.5 in" in out
    assert "feeds: PROVED" in out
    code, out, _ = run(capfd, "feed", file, *quick, "--no-recheck", "--json")
    assert json.loads(out)["certificate"] == {"file": "fed.proof.zip", "denied": False, "recheck": None}


def test_what_the_checker_denies_is_undecided(capfd, monkeypatch):
    """It is kept, and the command says so."""
    from limitsets.cell.feeding import proving as writing

    file, right = written("paper-designed"), writing.section_of

    def too_few(proof, end):
        section = right(proof, end)
        return section | {"progress": section["progress"] | {"throws": 5}}

    monkeypatch.setattr(writing, "section_of", too_few)
    quick = ("--trials", "50", "--certificate", "fed.proof.zip")
    code, out, _ = run(capfd, "feed", file, *quick)
    assert code == 1
    assert "progress: UNDECIDED, the checker denies it: side 0, cell" in out
    assert "the checker denies the certificate: it is kept as fed.denied.zip" in out
    assert Path("fed.denied.zip").exists()
    assert not Path("fed.proof.zip").exists()


@pytest.mark.sweep
def test_a_run_that_is_ended_leaves_no_draft():
    """A signal that ends a process leaves its files as they are: the command has to take away what it began."""
    command = [sys.executable, "-m", "limitsets", "feed", written("paper-designed", position="20.5 in")]
    command += ["--trials", "50", "--certificate", "out/fed.proof.zip"]
    folder = Path("out")
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        while process.poll() is None and not list(folder.glob(".draft-*")):
            time.sleep(0.002)
        assert list(folder.glob(".draft-*"))
        process.terminate()
    assert process.returncode == 128 + signal.SIGTERM
    assert not list(folder.iterdir())


def test_not_proved_is_exit_1(capfd):
    code, out, _ = run(capfd, "feed", written("paper-initial"), "--trials", "50")
    assert code == 1
    assert "safety: REFUTED" in out


def test_a_scene_without_a_cavity_is_told_so(capfd):
    code, _, err = run(capfd, "feed", "paper-designed")
    assert code == 2
    assert "add [cavity]" in err


@pytest.mark.sweep
def test_many_parts_at_once(capfd):
    """The keys are those of docs/json.md; without contact nothing is thrown at once."""
    pytest.importorskip("pymunk")
    tables = {"world": {"friction": 0.9, "throw_rate": "2 Hz"}, "effects": {"contact": True}}
    ls.dump(with_cavity("paper-designed", tables=tables), "many.toml")
    quick = ("--no-proof", "--trials", "20", "--parts", "2", "--batches", "2")
    code, out, _ = run(capfd, "feed", "many.toml", *quick, "--json")
    assert code == 0
    crowds = json.loads(out)["crowds"]
    page = (Path(__file__).resolve().parents[2] / "docs" / "json.md").read_text(encoding="utf-8")
    line = next(line for line in page.splitlines() if line.startswith("| `crowds`"))
    named = re.search(r"`\{(.*?)\}`", line).group(1).split(", ")
    for crowd, between in zip(crowds, (True, False), strict=True):
        assert list(crowd) == named
        assert (crowd["parts"], crowd["batches"], crowd["between"]) == (2, 2, between)
        rate = crowd["right_per_throw"]["value"]
        assert crowd["right_per_minute"] == pytest.approx(120.0 * rate)
    code, out, _ = run(capfd, "feed", "many.toml", *quick)
    assert code == 0
    assert "2 parts at once that push each other (arm: hinge):" in out
    assert "right per throw" in out
    code, _, err = run(capfd, "feed", written("paper-designed"), *quick)
    assert code == 2
    assert "effects.contact" in err
