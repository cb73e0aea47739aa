"""Files that the checker denies, and the checker in one file."""

import json
import multiprocessing
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import flint
import numpy as np
import pytest

import limitsets as ls
from limitsets.parameters.margins.margin_result import settled
from limitsets.proofs.prover import certificate
from limitsets.proofs.prover.certificate import DeniedError
from tests.cli.command import run
from tests.proofs import forge

# ----------------------------------------------------------------
# What was right and denied, or slow, found by a search over random scenes; and what becomes of what is denied.


pytest.importorskip("flint", reason="the checker needs python-flint")


def test_a_constant_slope_is_seen_at_once(tmp_path):
    """Small angles, and lengths known to 0.7 %: dR'/dR = 1 + 2|h|/kappa was enclosed by 16 383 boxes a cell."""
    tree = ls.load("paper-initial-small-angle").as_dict()
    del tree["goal"]
    tree["part"]["mass"]["center"] |= {"along": "3.5298 in", "above": "1.9435 in"}
    tree["arm"]["surface_height"], tree["throw"]["kappa"] = "-0.322 in", "72.9808 in"
    tolerance = {"part.sides[2]": "0.02387 in", "part.mass.center.along": "0.02387 in"}
    proof = ls.certify(ls.load(tree), ["invariant", "expanding"], tolerance=tolerance)
    assert proof.proved
    report = ls.recheck(proof.save(tmp_path / "x.proof.zip", recheck=False))
    assert (report.verdict, report.reason) == ("proved", "")
    inside = sum(int((found.component >= 0).sum()) for found in proof.attractions)
    assert report.boxes < 4 * inside


# ------------------------------------------------------------------------------ before a certificate gets its name


@pytest.fixture
def wrong(monkeypatch):
    """A prover whose brackets of the impact angle are wrong on one side."""
    right = certificate.arrays_of

    def arrays_of(found, prefix):
        arrays = right(found, prefix)
        arrays[f"{prefix}phi"][:, 0] = 0.999 * arrays[f"{prefix}phi"][:, 1]
        return arrays

    monkeypatch.setattr(certificate, "arrays_of", arrays_of)


def test_a_certificate_that_is_denied_does_not_get_its_name(tmp_path, wrong):
    file = tmp_path / "designed.proof.zip"
    file.write_text("an older one")
    proof = ls.certify("paper-designed")
    with pytest.raises(DeniedError, match="is not proved at x") as denied:
        proof.save(file)
    assert file.read_text() == "an older one"
    kept = tmp_path / "designed.denied.zip"
    assert ls.recheck(kept).verdict == "failed"
    assert sorted(path.name for path in tmp_path.iterdir()) == [kept.name, file.name]
    left = proof.denied(denied.value.claims)
    assert [claim.verdict for claim in left.claims] == ["undecided", "undecided"]
    assert not left.proved
    proof.save(file, recheck=False)
    assert ls.recheck(file).verdict == "failed"


def test_a_verdict_that_the_checker_does_not_reach_is_denied(tmp_path):
    proof = ls.certify("paper-designed", ["goal"])
    (goal,) = proof.claims
    section = {key: value for key, value in goal.section.items() if key != "near_joint"} | {"starts": "cells"}
    proof = replace(proof, claims=(replace(goal, section=section),))
    with pytest.raises(DeniedError, match="in the cells only"):
        proof.save(tmp_path / "x.proof.zip")


def test_the_command_says_undecided_and_exits_with_1(capfd, tmp_path, monkeypatch, wrong):
    monkeypatch.chdir(tmp_path)
    code, out, _ = run(capfd, "certify", "paper-designed")
    assert code == 1
    assert "goal: UNDECIDED" in out
    assert "kept as paper-designed.denied.zip" in out
    assert [path.name for path in Path().iterdir()] == ["paper-designed.denied.zip"]
    code, out, _ = run(capfd, "certify", "paper-designed", "--json")
    assert code == 1
    claims = json.loads(out)
    assert [claim["verdict"] for claim in claims] == ["undecided", "undecided"]
    assert claims[0]["timings"]["recheck"] > 0
    code, out, _ = run(capfd, "certify", "paper-designed", "--no-recheck")
    assert code == 0
    assert "paper-designed.proof.zip, not rechecked" in out


def test_a_margin_that_is_denied_is_undecided(tmp_path, wrong):
    (speed,) = ls.margin("paper-designed", "throw.speed", reading="fixed", width=0.5)
    assert speed.proved > 0
    left = settled(speed, tmp_path)
    # the file of the orbit that refutes rests on its throws, and not on the cells that are wrong here
    assert (left.proved, left.refuted, left.closed) == (0.0, speed.refuted, False)
    assert [name.split(".", 1)[1] for name in left.files] == ["refuted.zip"]
    assert "denied" in left.reason
    assert {path.name.split(".", 1)[1] for path in tmp_path.iterdir()} == {"denied.zip", "refuted.zip"}


# ------------------------------------------------------------------- an impact later than half a turn, with a tolerance

LATE = {  # by what it is: the scene, and its tolerance
    "flips by energy": (
        """
        part.sides = ["2.45841 in", "1.92018 in", "1.99109 in"]
        part.mass.center = {side = 0, along = "1.12022 in", above = "0.631575 in"}
        part.mass.radius_of_gyration = "0.428394 in"
        arm = {surface_height = "-0.071355 in", length = "17.661 in"}
        gravity.tilt = "73.0 deg"
        throw.speed = "374.4 deg/s"
        model = {flight = "exact", flip = "energy"}
        """,
        {"part.mass.center.above": "0.1695 %"},
    ),
    "a heavy point": (
        """
        part.vertices = [["0.864742 cm", "0.983764 cm"], ["-1.33843 cm", "-1.02662 cm"],
                         ["0.887191 cm", "-2.9061 cm"], ["2.40741 cm", "-1.49521 cm"]]
        part.mass.plate_density = "3 kg/m^2"
        part.mass.points = [{x = "0.675821 cm", y = "-1.33623 cm", mass = "0.001349 lb"},
                            {x = "-0.345433 cm", y = "-0.984184 cm", mass = "0.0004335 kg"},
                            {x = "0.362217 cm", y = "-0.532232 cm", mass = "0.001205 kg"}]
        arm = {surface_height = "-0.50786 cm", length = "597.79 mm"}
        throw.kappa = "303.974 mm"
        model = {flight = "exact", flip = "signed"}
        """,
        {"part.mass.points[2].mass": "0.0643 %"},
    ),
}


@pytest.mark.parametrize("which", LATE)
def test_an_impact_after_half_a_turn_is_bracketed_as_closely_as_one_before(tmp_path, which):
    """f has -a sin(p): past half a turn a large a delays the impact, and both guesses stood on the wrong side of it."""
    scene, tolerance = LATE[which]
    proof = ls.certify(ls.load(scene), ["attracts-all"], tolerance=tolerance)
    assert proof.proved
    cells = sum(len(found.component) for found in proof.attractions)
    report = ls.recheck(proof.save(tmp_path / "x.proof.zip", recheck=False))
    assert (report.verdict, report.reason) == ("proved", "")
    assert report.boxes < 2 * cells


# ----------------------------------------------------------------
# The checker in one file: built, and run where only numpy and python-flint can be imported.


pytest.importorskip("flint", reason="the checker needs python-flint")


FOLDER = Path(__file__).resolve().parents[2] / "limitsets" / "checker"
SMALL = 20_000  # cells that the checker checks in one process, written anew
METHODS = [method for method in multiprocessing.get_all_start_methods() if method != "fork"]

# Runs the file as a command would, where processes are started by the method named; prints by which they are.
WITH_METHOD = """
import concurrent.futures, multiprocessing, runpy, sys

class Telling(concurrent.futures.ProcessPoolExecutor):
    def __init__(self, workers, context, *more):
        print(workers, context.get_start_method())
        super().__init__(workers, context, *more)

multiprocessing.set_start_method(sys.argv.pop(1))
del sys.argv[0]
concurrent.futures.ProcessPoolExecutor = Telling
runpy.run_path(sys.argv[0], run_name="__main__")
"""


@pytest.fixture(scope="module")
def packed(tmp_path_factory):
    """The file, beside a folder from which only numpy and python-flint can be imported."""
    folder = tmp_path_factory.mktemp("packed")
    command = [sys.executable, str(FOLDER / "build.py"), str(folder / "recheck.pyz")]
    subprocess.run(command, check=True, cwd=folder)
    (folder / "only").mkdir()
    for package in (np, flint):
        site = Path(package.__file__).parents[1]
        for place in (*site.glob(f"{package.__name__}"), *site.glob(f"*{package.__name__}.libs")):
            (folder / "only" / place.name).symlink_to(place, target_is_directory=True)
    return folder / "recheck.pyz"


@pytest.fixture(scope="module")
def large(tmp_path_factory):
    """A certificate with more cells than one process checks alone, and the same with one bracket spoiled."""
    folder = tmp_path_factory.mktemp("large")
    f = forge.forge("designed", first=0.1, ratio=0.0009, widest=0.0045)
    assert (f.arrays["0.component"] < 0).sum() > SMALL
    right = f.write(folder / "right.proof.zip")
    f.arrays["0.phi"][-3, 1] = f.arrays["0.phi"][-3].mean()
    return right, f.seal().write(folder / "wrong.proof.zip")


def run_checker_packed(packed, *words):
    """Run Python without site packages: -S leaves out those of the interpreter, and the .pth files among them."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    how = {"cwd": packed.parent, "env": environment | {"PYTHONPATH": str(packed.parent / "only")}}
    command = [sys.executable, "-S", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=100, **how)


ALONE = """
import numpy, flint
for name in ("limitsets", "numba", "scipy", "checker"):
    try:
        raise SystemExit(f"{__import__(name)} is there")
    except ModuleNotFoundError:
        pass
"""


def test_it_runs_as_a_user_starts_it(packed, large, tmp_path):
    (tmp_path / "no.zip").write_bytes(b"no")
    alone = run_checker_packed(packed, "-c", ALONE)
    right = run_checker_packed(packed, packed, large[0], "--workers", 1)
    wrong = run_checker_packed(packed, packed, tmp_path / "no.zip")
    assert [(done.returncode, done.stderr) for done in (alone, right, wrong)] == [(0, ""), (0, ""), (2, "")]
    assert right.stdout.rstrip().endswith("PROVED")
    assert wrong.stdout.count("\n") < 6


@pytest.mark.sweep
@pytest.mark.parametrize(("method", "which"), [*zip(METHODS, (0, 1), strict=False)])
def test_several_processes_however_they_are_started(packed, large, method, which):
    file, code, verdict = large[which], which, ("proved", "failed")[which]
    done = run_checker_packed(packed, "-c", WITH_METHOD, method, packed, file, "--json", "--workers", 2)
    assert (done.returncode, done.stderr) == (code, "")
    started, said = done.stdout.splitlines()
    assert started == f"2 {method}"
    assert json.loads(said)["verdict"] == verdict


def test_the_module_is_the_same_command(large):
    command = [sys.executable, "-m", "limitsets.checker", str(large[0]), "--json", "--workers", "2"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=FOLDER.parents[1])
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["verdict"] == "proved"


def test_it_neither_evaluates_nor_unpickles():
    text = "".join(path.read_text(encoding="utf-8") for path in FOLDER.glob("*.py"))
    assert "eval(" not in text
    assert "exec(" not in text
    assert "pickle" not in text.replace("unpickle", "")
