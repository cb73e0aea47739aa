"""Cycles to which all starts of some cells tend, and goals that such a cycle refutes; saved, and rechecked.

Expected: fixed points and 2-cycles by hand, Henon's 7-cycle, and the figures of a prototype that shares no code.
"""

import functools
import math

import numpy as np
import pytest
from limitsets.cells import Grid, as_domain

import limitsets as ls
from limitsets.base.errors import AnswerError
from tests.checker.map_examples import graded
from tests.maps_of_tests import henon, odd, ricker, rivals, two_lines


def delayed(x, y, alpha):
    return y, y * math.exp(alpha - x)


def turned_in_space(x, y, z):
    return 0.5 * y, 0.5 * z, 0.5 * math.sin(x)


def around(points, domain, wide, fine):
    """Edges of 256 cells along each axis, and finer ones near some points."""
    axes = [
        np.unique(np.concatenate([np.linspace(*ends, 257), *(np.linspace(v - wide, v + wide, fine) for v in at)]))
        for ends, at in zip(domain, np.transpose(points), strict=True)
    ]  # fmt: skip
    return Grid(as_domain(domain), (tuple(axes),))


def seven():
    """The grid of Henon's map at a = 1.24: fine near the points of its attracting 7-cycle, by plain iteration."""
    x, y, points = 0.1, 0.1, []
    for k in range(20_000):
        x, y = 1.0 - 1.24 * x * x + y, 0.3 * x
        if k >= 19_993:
            points.append((x, y))
    return ls.map(henon, a=1.24, b=0.3), around(points, [(-1.5, 1.5), (-0.5, 0.5)], 0.003, 33), points


def two_ages():
    edges = graded(0.6005, 0.02, 2.6, 0.0025, 0.02)
    return ls.map(delayed, alpha=0.6), Grid(as_domain([(0.02, 2.6)] * 2), ((edges, edges),))


def line(lo, hi, cells):
    return ls.grid([(lo, hi)], cells=cells)


# The map, its grid, the upper corner's values, claims, the cycles that attract (a point of each), and bounds of the
# share of the domain from which orbits come there.
CASES = {
    "ricker": (
        lambda: (ls.map(ricker, r=1.5), line(0.02, 2.6, 512)),
        {"r": 1.55}, "cycles converges attracts-all basin", [(1, 1.0)], (1.0, 1.0),
    ),
    # x0 = x1 / 2 - 1/2 and x1 = x0 / 2 + 1/2
    "branches": (
        lambda: (two_lines(0.5, 0.5, -0.5), line(-1.0, 1.0, 64)),
        {}, "converges attracts-all", [(2, 1.0 / 3.0)], (1.0, 1.0),
    ),
    # a x - x^3 = x at x^2 = a - 1; there the slope is 3 - 2 a, 0 at a = 3/2
    "two fixed points": (
        lambda: (ls.map(odd, a=1.5), line(-1.2, 1.2, 801)),
        {}, "converges basin", [(1, math.sqrt(0.5)), (1, -math.sqrt(0.5))], (0.95, 0.9999),
    ),
    # every start in 92 % of the square tends to (alpha, alpha), within 36 steps, by finer cells of the prototype
    "delayed": (two_ages, {"alpha": 0.601}, "converges basin", [(1, 0.6005)], (0.9, 0.95)),
    "henon": (lambda: seven()[:2], {}, "converges", [(7, seven()[2][0][0])], (0.0, 1.0)),
}  # fmt: skip


@functools.cache
def proved(name):
    make, upper, claims, *_ = CASES[name]
    lower, grid = make()
    return ls.certify(lower, grid, claims.split(), upper=lower.with_values(**upper))


@pytest.mark.parametrize("name", CASES)
def test_starts_tend_to_cycles(name, tmp_path):
    _, upper, claims, cycles, (least, most) = CASES[name]
    proof = proved(name)
    lower, grid = proof.map, proof.graph.grid
    assert proof.proved, proof.claims
    drawn = [cycle for cycle in proof.cycles if cycle.ball is not None]
    assert sorted(cycle.period for cycle in drawn) == sorted(period for period, _ in cycles)
    for period, point in cycles:
        holding = [
            c for c in drawn if c.period == period and ((c.lo[:, 0] <= point) & (point <= c.hi[:, 0])).any()
        ]
        assert len(holding) == 1
    rank = proof.arrays["rank"]
    assert least <= grid.measure[rank >= 0].sum() / grid.measure.sum() <= most
    report = ls.recheck(proof.save(tmp_path / "map.proof.zip", recheck=False))
    assert {claim for claim, *_ in report.claims} == {*claims.split(), "cycles"}
    # random orbits, of random maps between the corners, from cells with a rank
    random = np.random.default_rng(1)
    numbers = random.choice(np.flatnonzero(rank >= 0), 300)
    lo, hi = grid.boxes(numbers, 0)
    starts = random.uniform(lo, hi) if grid.dimension > 1 else random.uniform(lo, hi)[:, 0]
    for share in (0.0, random.uniform(), 1.0):
        own = {key: (1.0 - share) * getattr(lower, key) + share * end for key, end in upper.items()}
        one = lower.with_values(**own)
        after, *_ = ls.maps.advance(one, starts, 0, 3000)
        after = after.reshape(300, -1)
        off = [
            np.maximum(c.lo - after[:, None], after[:, None] - c.hi).max(axis=2).min(axis=1) for c in drawn
        ]
        assert np.min(off, axis=0).max() < 1e-6


def test_a_radius_that_is_too_large_is_not_taken():
    """Of the delayed map a radius of 0.2 is too large for the checker; the prototype proves 0.06."""
    (cycle,) = proved("delayed").cycles
    assert 0.05 < cycle.ball.radius < 0.2


def test_starts_end_in_ends_that_hold_the_balls(tmp_path):
    lower, starts = ls.map(ricker, r=1.5), [[(0.02, 2.6)]]
    grid, upper = line(0.02, 2.6, 512), lower.with_values(r=1.55)
    for ends, verdict in (([[(0.99, 1.01)]], "proved"), ([[(1.01, 1.5)]], "refuted")):
        proof = ls.certify(lower, grid, ["converges", "ends-in"], upper=upper, ends=ends, starts=starts)
        assert proof.claims[1].verdict == verdict
        proof.save(tmp_path / "ends.proof.zip")


@pytest.mark.parametrize(
    ("lower", "grid", "reason"),
    [
        (ls.map(ricker, r=1.5), line(0.02, 2.6, 16), "take finer cells there"),
        (ls.map(ricker, r=2.0), line(0.02, 2.6, 512), "through ["),  # the slope is -1
        (ls.map(ricker, r=3.1), line(0.02, 4.0, 512), "no cycle that attracts is found"),
        (ls.map(turned_in_space), ls.grid([(-1, 1)] * 3, cells=8), "at most two dimensions"),
        # the two that attract lie on the border; orbits from x = y end on the saddle (2/3, 2/3)
        (ls.map(rivals), ls.grid([(0, 3)] * 2, cells=16), "no balls around it in the domain are contracted"),
    ],
)
def test_what_is_missing_is_said(lower, grid, reason):
    (claim,) = ls.certify(lower, grid, ["converges"]).claims
    assert claim.verdict == "undecided"
    assert reason in claim.reason


@pytest.mark.parametrize("word", ["invariant", "trapping", "expanding"])
def test_claims_about_cells_that_stay_are_apart(word):
    with pytest.raises(AnswerError, match=f"prove {word} in a call of its own"):
        ls.certify(ls.map(ricker, r=1.5), line(0.02, 2.6, 64), ["converges", word])


# ---------------------------------------------------------------- goals that are refuted


ENDS, STARTS = [[(0.35, 1.65)]], [[(0.02, 2.6)]]


@pytest.mark.parametrize(
    ("upper", "how", "verdict"),
    [
        (2.5, {"ends": ENDS, "starts": STARTS}, "refuted"),
        (2.501, {"ends": ENDS, "starts": STARTS}, "refuted"),
        (2.5, {"ends": ENDS}, "undecided"),  # of which starts is not said
        (2.5, {"ends": ENDS, "starts": [[(2.0, 2.6)]]}, "undecided"),  # the cycle begins elsewhere
        (2.5, {"ends": [[(0.2, 1.9)]], "starts": STARTS}, "proved"),
        # by a cycle that repels alone
        (2.5, {"ends": [[(0.2, 0.8)], [(1.2, 1.9)]], "starts": STARTS}, "undecided"),
    ],
)
def test_a_goal_is_refuted_by_a_cycle_that_attracts(upper, how, verdict, tmp_path):
    """At r = 2.5 Ricker's map has the attracting 2-cycle 0.28959, 1.71041."""
    lower = ls.map(ricker, r=2.5)
    proof = ls.certify(lower, line(0.02, 2.6, 1000), upper=lower.with_values(r=upper), **how)
    assert proof.claims[0].verdict == verdict
    if verdict == "refuted":
        (cycle,) = proof.cycles
        at = np.array([0.28959, 1.71041])
        assert (np.abs(cycle.lo[:, 0] - at) < (6e-6 if upper == 2.5 else 1e-2)).all()
        assert "a cycle of period 2 attracts" in proof.claims[0].reason
        report = ls.recheck(proof.save(tmp_path / "ricker.refuted.zip", recheck=False))
        assert report.claims == [("cycles", "proved", ""), ("refuted", "refuted", "")]
