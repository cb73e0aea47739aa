"""Proofs of maps of circles and tori: proved on cells, saved, and confirmed by the checker."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import pytest
from limitsets.errors import AnswerError, GridError

import limitsets as ls
from tests.graph.test_periodic_axes import TORUS, cat, circle, doubling, line

pytest.importorskip("flint", reason="the checker needs python-flint")


def pendulum(q, p, push):
    """A step of a damped pendulum, in radians."""
    after = 0.5 * p + push - 0.3 * math.sin(q)
    return q + after, after


CERTIFIED: dict[str, tuple[Any, Any, list[str], Any]] = {
    # map, grid, claims, upper corner of the parameters
    "attractor inside": (ls.map(circle, omega=0.05, k=0.9), line(0.0, 64), ["trapping", "basin"], None),
    "attractor on the seam": (ls.map(circle, omega=0.0, k=-0.9), line(0.0, 64), ["trapping", "basin"], None),
    "odd domain": (ls.map(circle, omega=0.05, k=0.9), line(-0.3, 64), ["trapping", "basin"], None),
    "lift by many turns": (ls.map(circle, omega=1000.05, k=0.9), line(0.0, 64), ["trapping", "basin"], None),
    "range of parameters": (
        ls.map(circle, omega=0.05, k=0.9),
        line(0.0, 64),
        ["trapping"],
        ls.map(circle, omega=0.06, k=0.9),
    ),
    "doubling": (ls.map(doubling), line(0.0, 64), ["attracts-all", "trapping", "expanding"], None),
    "cat map": (ls.map(cat), ls.grid(TORUS, cells=12, periodic=True), ["attracts-all", "invariant"], None),
    "pendulum": (
        ls.map(pendulum, push=0.0),
        ls.grid([(0.0, math.tau), (-1.0, 1.0)], cells=(48, 48), periodic=(True, False)),
        ["trapping", "basin"],
        None,
    ),
}


@pytest.mark.parametrize("name", CERTIFIED)
def test_proofs_on_axes_that_close_are_confirmed(name: str, tmp_path: Path) -> None:
    params, grid, claims, upper = CERTIFIED[name]
    proof = ls.certify(params, grid, claims, upper=upper)
    assert proof.proved
    report = ls.recheck(proof.save(tmp_path / "circle.proof.zip", recheck=False))
    assert report.verdict == "proved", report
    assert {claim for claim, *_ in report.claims} == set(claims)


def test_goal_on_a_circle(tmp_path: Path) -> None:
    params, grid = ls.map(circle, omega=0.05, k=0.9), line(0.0, 128)
    proof = ls.certify(params, grid, ends=[[(0.5, 0.6)]], starts=[[(0.96875, 0.9921875)], [(0.0, 0.9)]])
    assert proof.proved
    assert ls.recheck(proof.save(tmp_path / "goal.proof.zip", recheck=False)).verdict == "proved"
    # the other fixed point lies at 0.943: starts about it are not proved, and no cycle is looked for
    open_ = ls.certify(params, grid, ends=[[(0.5, 0.6)]], starts=[[(0.9, 0.96)]])
    assert [claim.verdict for claim in open_.claims] == ["undecided"]
    with pytest.raises(AnswerError, match="seam"):
        ls.certify(params, grid, ends=[[(0.5, 0.6)]], starts=[[(0.96875, 1.0)]])


@pytest.mark.parametrize("claim", ["cycles", "converges", "all-cycles"])
def test_claims_about_orbits_are_refused(claim: str) -> None:
    period = {"period": 2} if claim == "all-cycles" else {}
    with pytest.raises(GridError, match="axes that end"):
        ls.certify(ls.map(doubling), line(0.0, 8), [claim], **period)


def test_formulas_name_the_period() -> None:
    params = ls.map(circle, omega=0.05, k=0.9)
    assert ls.formulas(params, line(-0.25, 8)).lines[-1] == "    x0' modulo 1, in [-0.25, -0.25 + 1)"
    plane = ls.grid([(0.0, math.tau), (-1.0, 1.0)], cells=4, periodic=(True, False))
    table = ls.formulas(ls.map(pendulum, push=0.0), plane).table
    assert table["periodic"] == [["tau", None]]
    assert not any("modulo" in text for text in ls.formulas(params).lines)


def test_a_proof_says_how_many_cells_of_its_basin_a_certificate_shows(tmp_path: Path) -> None:
    """Cells that recur beside the cycle of period 2 are passed by every orbit: ranks end there."""
    proof = ls.certify(ls.map(circle, omega=0.48, k=0.9), line(0.0, 1000), ["basin"])
    report = ls.recheck(proof.save(tmp_path / "circle.proof.zip", recheck=False))
    (share,) = re.findall(r"cells that cover ([0-9.]+) %", " ".join(report.statement))
    (shown,) = re.findall(r"a certificate shows (\d+) of them", str(proof))
    assert float(share) == pytest.approx(int(shown) / 10, abs=0.1001)  # the checker rounds down
    assert int(shown) < len(proof.enters)
