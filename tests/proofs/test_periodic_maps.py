"""Proofs of maps of circles and tori: proved on cells, saved, and so confirmed by the checker."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from limitsets.errors import AnswerError, GridError

import limitsets as ls
from limitsets.proofs.prover import cycles_of_map
from limitsets.systems.cells import Domain
from tests.graph.test_periodic_axes import TORUS, cat, circle, doubling, line, standard, turn


def pendulum(q, p, push):
    """A step of a damped pendulum, in radians."""
    after = 0.5 * p + push - 0.3 * math.sin(q)
    return q + after, after


def arc(omega: float, k: float = 0.9) -> Any:
    return ls.map(circle, omega=omega, k=k)


CIRCLE, STAYS = line(0.0, 64), ["trapping", "basin"]
ROUND = ls.grid([(0.0, math.tau), (-1.0, 1.0)], cells=(48, 48), periodic=(True, False))
CERTIFIED: dict[str, tuple[Any, Any, list[str], Any]] = {
    # map, grid, claims, upper corner of the parameters
    "attractor on the seam": (arc(0.0, -0.9), CIRCLE, STAYS, None),
    "odd domain": (arc(0.05), line(-0.3, 64), STAYS, None),
    "lift by many turns": (arc(1000.05), CIRCLE, STAYS, None),
    "range of parameters": (arc(0.05), CIRCLE, ["trapping"], arc(0.06)),
    "doubling": (ls.map(doubling), CIRCLE, ["attracts-all", "trapping", "expanding"], None),
    "cat map": (ls.map(cat), ls.grid(TORUS, cells=12, periodic=True), ["attracts-all", "invariant"], None),
    "pendulum": (ls.map(pendulum, push=0.0), ROUND, STAYS, None),
}


@pytest.mark.parametrize("name", CERTIFIED)
def test_proofs_on_axes_that_close_are_confirmed(name: str, tmp_path: Path) -> None:
    params, grid, claims, upper = CERTIFIED[name]
    proof = ls.certify(params, grid, claims, upper=upper)
    assert proof.proved
    proof.save(tmp_path / "circle.proof.zip")


def test_goal_on_a_circle(tmp_path: Path) -> None:
    params, grid = arc(0.05), line(0.0, 128)
    proof = ls.certify(params, grid, ends=[[(0.5, 0.6)]], starts=[[(0.96875, 0.9921875)], [(0.0, 0.9)]])
    assert proof.proved
    proof.save(tmp_path / "goal.proof.zip")
    # the other fixed point lies at 0.943: starts about it are not proved, and no cycle that attracts leaves the ends
    open_ = ls.certify(params, grid, ends=[[(0.5, 0.6)]], starts=[[(0.9, 0.96)]])
    assert [claim.verdict for claim in open_.claims] == ["undecided"]
    with pytest.raises(AnswerError, match="seam"):
        ls.certify(params, grid, ends=[[(0.5, 0.6)]], starts=[[(0.96875, 1.0)]])
    with pytest.raises(AnswerError, match="two where the seam is passed"):
        ls.certify(params, grid, ends=[[(0.5, 1.1)]])


# ---------------------------------------------------------------- orbits


ELSEWHERE = [(-0.3, 0.7), (-0.3, 0.7)]  # the seam is on no orbit of the tests

TORUS_ELSEWHERE = ls.grid(ELSEWHERE, cells=12, periodic=True)
ORBITS: dict[str, tuple[Any, Any, list[list[bool | None]]]] = {
    # map, grid, and by period of each orbit whether it attracts, None where that is open
    # 2^p - 1 points with f^p(x) = x
    "doubling": (ls.map(doubling), line(-0.3, 64), [[False], [False], [False] * 2, [False] * 3]),
    # 1, 5, 16 points: |det(A^p - 1)|
    "cat map": (ls.map(cat), TORUS_ELSEWHERE, [[False], [False] * 2, [False] * 5]),
    # traces 2 + k and 2 - k, determinant 1: hyperbolic, elliptic
    "standard map": (ls.map(standard, k=0.5), TORUS_ELSEWHERE, [[False, None]]),
    # each point is of period 2: none is alone
    "rotation": (ls.map(turn, by=0.5), line(-0.3, 16), [[], []]),
    # 0 and 1/2 attract: the slopes are 1.9 and 0.1; the other orbit of period 2 repels, outside the attracting cells
    "tongue": (arc(0.5), line(-0.3, 64), [[], [True]]),
}


@pytest.mark.parametrize("name", ORBITS)
def test_orbits_are_proved_modulo_the_period(name: str, tmp_path: Path, monkeypatch: Any) -> None:
    params, grid, wanted = ORBITS[name]
    most = len(wanted)
    monkeypatch.setattr(cycles_of_map, "UP_TO", most)
    proof = ls.certify(params, grid, ["cycles"])
    got = [[cycle.attracts for cycle in proof.cycles if cycle.period == p] for p in range(1, most + 1)]
    assert [sorted(each, key=str) for each in got] == [sorted(each, key=str) for each in wanted]
    if not any(wanted):
        assert not proof.proved
        return
    proof.save(tmp_path / "orbits.proof.zip")


def test_an_orbit_on_the_seam_is_not_proved(monkeypatch: Any) -> None:
    monkeypatch.setattr(cycles_of_map, "UP_TO", 2)
    proof = ls.certify(ls.map(doubling), line(0.0, 64), ["cycles"])
    assert [cycle.period for cycle in proof.cycles] == [2]
    (missing,) = proof.claims[0].section["missing"]
    assert "period 1" in missing
    assert "begin the domain elsewhere" in missing


def test_starts_of_a_tongue_tend_to_its_orbit(tmp_path: Path) -> None:
    """For all omega near 1/2 one orbit of period 2 attracts; beside the one that repels nothing is proved."""
    lower, grid = arc(0.499), line(-0.3, 256)
    proof = ls.certify(lower, grid, ["converges", "basin"], upper=lower.with_values(omega=0.501))
    assert proof.proved, proof.claims
    (cycle,) = proof.cycles
    assert cycle.period == 2
    assert sorted(cycle.turns.ravel().tolist()) == [0, 1]  # once round in two steps
    rank = proof.arrays["rank"]
    assert 0.9 < (rank >= 0).mean() < 1.0
    proof.save(tmp_path / "tongue.proof.zip")
    random = np.random.default_rng(1)
    numbers = random.choice(np.flatnonzero(rank >= 0), 200)
    starts = random.uniform(*grid.boxes(numbers, 0))[:, 0]
    for omega in (0.499, 0.5, 0.501):
        after = ls.maps.advance(lower.with_values(omega=omega), starts, 0, 1000, domain=grid.domain)[0]
        off = np.maximum(cycle.lo[:, 0] - after[:, None], after[:, None] - cycle.hi[:, 0]).min(axis=1)
        assert off.max() < 1e-6


def test_a_ball_ends_before_the_seam(tmp_path: Path) -> None:
    """The map contracts beyond the seam too, which is 0.06 beside the fixed point."""
    params = arc(0.0, -0.9)
    free, near = (ls.certify(params, line(lo, 256), ["converges", "basin"]) for lo in (-0.3, -0.06))
    assert free.proved
    assert near.proved
    assert near.cycles[0].ball.radius < 0.06 < free.cycles[0].ball.radius
    near.save(tmp_path / "near.proof.zip")


def test_a_goal_is_refuted_by_an_orbit_that_goes_round(tmp_path: Path) -> None:
    params, grid = arc(0.5), line(-0.3, 128)
    proof = ls.certify(params, grid, ends=[[(0.4, 0.6)]], starts=[[(-0.2, 0.6)]])
    assert [claim.verdict for claim in proof.claims] == ["refuted"]
    assert "period 2" in proof.claims[0].reason
    proof.save(tmp_path / "tongue.refuted.zip")
    proved = ls.certify(
        params, grid, ["converges", "ends-in"], ends=[[(-0.1, 0.1)], [(0.4, 0.6)]], starts=[[(0.4, 0.6)]]
    )
    assert proved.proved, proved.claims
    proved.save(tmp_path / "tongue.proof.zip")


class Handover(NamedTuple):
    rate: float


def handed_over(p, x, side):
    """Take circles of length 1 and 2 to each other."""
    return p.rate * x + (2.25 if side == 0 else 3.0), 1 - side, 0


ls.register(Handover, image=handed_over)


def test_circles_of_two_lengths(tmp_path: Path) -> None:
    """Modulo 2 y = x / 2 + 1 / 4, modulo 1 x = y / 2: the orbit is 1/6, 1/3."""
    grid = ls.grid(Domain([[-0.25], [-0.25]], [[0.75], [1.75]], periodic=(True,)), cells=64)
    proof = ls.certify(Handover(0.5), grid, ["converges", "basin"])
    assert proof.proved, proof.claims
    (cycle,) = proof.cycles
    assert cycle.lo[:, 0] == pytest.approx([1 / 6, 1 / 3])
    assert cycle.turns.ravel().tolist() == [1, 3]
    proof.save(tmp_path / "two.proof.zip")


def test_a_pendulum_that_goes_round_at_each_step(tmp_path: Path) -> None:
    """It runs on by 2 pi where pi = push - 0.3 sin q; there the determinant is 1/2 and the trace 1.5 - 0.3 cos q."""
    grid = ls.grid([(-1.0, math.tau - 1.0), (5.8, 6.8)], cells=(64, 64), periodic=(True, False))
    proof = ls.certify(ls.map(pendulum, push=3.1), grid, ["converges"])
    assert proof.proved, proof.claims
    (cycle,) = proof.cycles
    assert cycle.turns.tolist() == [[1, 0]]
    assert cycle.lo[0] == pytest.approx([-math.asin((math.pi - 3.1) / 0.3), math.tau])
    proof.save(tmp_path / "pendulum.proof.zip")


def test_margin_of_a_goal_on_a_circle(tmp_path: Path) -> None:
    """The fixed point, where k sin(2 pi x) = -2 pi omega, comes to the end 0.6 of the goal at k sin(0.2 pi) / 2 pi."""
    params = arc(0.05)
    (margin,) = ls.margin(params, line(0.0, 256), "omega", ends=[[(0.5, 0.6)]], starts=[[(0.0, 0.9)]])
    limit = 0.9 * math.sin(0.2 * math.pi) / math.tau - 0.05
    assert 0.8 * limit < margin.proved < limit < margin.refuted < 1.01 * limit
    report = ls.recheck(margin.save(tmp_path / "margin.proof.zip", recheck=False))
    assert report.verdict == "proved", report
    assert report.claims[-1][1:] == ("refuted", "")


def test_that_orbits_are_all_is_refused() -> None:
    with pytest.raises(GridError, match="all turns of each step"):
        ls.certify(ls.map(doubling), line(0.0, 8), ["all-cycles"], period=2)


def test_formulas_name_the_period() -> None:
    params = arc(0.05)
    assert ls.formulas(params, line(-0.25, 8)).lines[-1] == "    x0' modulo 1, in [-0.25, -0.25 + 1)"
    plane = ls.grid([(0.0, math.tau), (-1.0, 1.0)], cells=4, periodic=(True, False))
    table = ls.formulas(ls.map(pendulum, push=0.0), plane).table
    assert table["periodic"] == [["tau", None]]
    assert not any("modulo" in text for text in ls.formulas(params).lines)


def test_a_proof_says_how_many_cells_of_its_basin_a_certificate_shows(tmp_path: Path) -> None:
    """Cells that recur beside the cycle of period 2 are passed by every orbit: ranks end there."""
    proof = ls.certify(arc(0.48), line(0.0, 1000), ["basin"])
    report = ls.recheck(proof.save(tmp_path / "circle.proof.zip", recheck=False))
    (share,) = re.findall(r"cells that cover ([0-9.]+) %", " ".join(report.statement))
    (shown,) = re.findall(r"a certificate can show (\d+) of them", str(proof))
    assert float(share) == pytest.approx(int(shown) / 10, abs=0.1001)  # the checker rounds down
    assert int(shown) < len(proof.enters)
