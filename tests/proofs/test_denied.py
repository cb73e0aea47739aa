"""What was right and denied, or slow, found by a search over random scenes; and what becomes of what is denied."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

import limitsets as ls
from limitsets.parameters.margins.margin_result import settled
from limitsets.proofs.prover import certificate
from limitsets.proofs.prover.certificate import DeniedError
from tests.cli.command import run


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
    left, files = settled(speed, tmp_path)
    # the file of the orbit that refutes rests on its throws, and not on the cells that are wrong here
    assert (left.proved, left.refuted, left.closed) == (0.0, speed.refuted, False)
    assert [file.name.split(".", 1)[1] for file in files] == ["refuted.zip"]
    assert "denied" in left.reason
    assert {path.name.split(".", 1)[1] for path in tmp_path.iterdir()} == {"denied.zip", "refuted.zip"}


# ------------------------------------------------------------------- an impact later than half a turn, with a tolerance

LATE = {
    "flips by energy": {
        "part": {
            "sides": ["2.45841 in", "1.92018 in", "1.99109 in"],
            "mass": {
                "center": {"side": 0, "along": "1.12022 in", "above": "0.631575 in"},
                "radius_of_gyration": "0.428394 in",
            },
        },
        "arm": {"surface_height": "-0.071355 in", "length": "17.661 in"},
        "gravity": {"tilt": "73.0 deg"},
        "throw": {"speed": "374.4 deg/s"},
        "model": {"flight": "exact", "flip": "energy"},
        "tolerance": {"part.mass.center.above": "0.1695 %"},
    },
    "a heavy point": {
        "part": {
            "vertices": [
                ["0.864742 cm", "0.983764 cm"],
                ["-1.33843 cm", "-1.02662 cm"],
                ["0.887191 cm", "-2.9061 cm"],
                ["2.40741 cm", "-1.49521 cm"],
            ],
            "mass": {
                "plate_density": "3 kg/m^2",
                "points": [
                    {"x": "0.675821 cm", "y": "-1.33623 cm", "mass": "0.001349 lb"},
                    {"x": "-0.345433 cm", "y": "-0.984184 cm", "mass": "0.0004335 kg"},
                    {"x": "0.362217 cm", "y": "-0.532232 cm", "mass": "0.001205 kg"},
                ],
            },
        },
        "arm": {"surface_height": "-0.50786 cm", "length": "597.79 mm"},
        "throw": {"kappa": "303.974 mm"},
        "model": {"flight": "exact", "flip": "signed"},
        "tolerance": {"part.mass.points[2].mass": "0.0643 %"},
    },
}


@pytest.mark.parametrize("which", LATE)
def test_an_impact_after_half_a_turn_is_bracketed_as_closely_as_one_before(tmp_path, which):
    """f has -a sin(p): past half a turn a large a delays the impact, and both guesses stood on the wrong side of it."""
    scene = dict(LATE[which])
    tolerance = scene.pop("tolerance")
    proof = ls.certify(ls.load(scene), ["attracts-all"], tolerance=tolerance)
    assert proof.proved
    cells = sum(len(found.component) for found in proof.attractions)
    report = ls.recheck(proof.save(tmp_path / "x.proof.zip", recheck=False))
    assert (report.verdict, report.reason) == ("proved", "")
    assert report.boxes < 2 * cells
