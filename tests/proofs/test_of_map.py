"""Claims about any map, proved from its plain kernels: against answers on paper, and against sampled orbits."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.base.errors import AnswerError
from limitsets.proofs.prover import orbits_of_map
from limitsets.proofs.prover.converging import entries
from limitsets.proofs.prover.cycles_of_map import MOST_WORDS
from limitsets.proofs.prover.orbits_of_map import prove_orbit
from limitsets.systems.sets import Cycle, cycles
from tests.maps_of_tests import Tent, odd, ricker, spiral
from tests.proofs.test_certify import verdicts

CLAIMS = ["invariant", "trapping", "attracts-all", "expanding", "cycles"]


def growth(r):
    return ls.map(ricker, r=r)


def cubic(a):
    return ls.map(odd, a=a)


def test_a_fixed_point_attracts_all():
    # x exp(r (1 - x)) has the fixed point 1 with slope 1 - r, and its top exp(r - 1)/r at 1/r.
    r = 1.8
    top = math.exp(r - 1.0) / r
    grid = ls.grid([(0.3, top + 1e-3)], cells=512)
    proof = ls.certify(growth(r), grid, CLAIMS)
    # the slope is 1 - r there
    assert verdicts(proof) == dict.fromkeys(CLAIMS, "proved") | {"expanding": "refuted"}
    (cycle,) = proof.cycles
    assert cycle.period == 1
    assert cycle.attracts
    assert cycle.lo[0, 0] < 1.0 < cycle.hi[0, 0]
    assert cycle.slope_lo[0, 0] <= 1.0 - r <= cycle.slope_hi[0, 0]
    assert proof.cells.mask[grid.index(np.array([[1.0]]), 0)].all()
    most = proof.claims[2].section["max_rank"]
    starts = np.linspace(0.3, top, 2001)
    x, _, _, _ = maps.advance(growth(r), starts, np.zeros(starts.size, int), most)
    assert proof.cells.mask[grid.index(x[:, None], 0)].all()


@pytest.mark.sweep
def test_a_user_map_of_two_branches_expands_for_a_box_of_parameters():
    grid = ls.grid([(0.15, 0.93)], cells=1024)
    proof = ls.certify(Tent(1.80), grid, ["invariant", "expanding"], upper=Tent(1.81))
    assert verdicts(proof) == {"invariant": "proved", "expanding": "proved"}
    assert 1.79 < float.fromhex(proof.claims[1].section["least_slope"]) <= 1.80
    lo, hi = proof.cells.extents()[0][0][0], proof.cells.extents()[0][-1][1]
    for s in (1.80, 1.805, 1.81):  # the core of a tent: from s (1 - s/2) to s/2
        assert lo <= s * (1.0 - s / 2.0)
        assert s / 2.0 <= hi
    cycles = ls.certify(Tent(1.80), grid, ["cycles"])
    fixed = next(cycle for cycle in cycles.cycles if cycle.period == 1)
    assert fixed.lo[0, 0] < 1.8 / 2.8 < fixed.hi[0, 0]
    assert fixed.attracts is False
    assert len(cycles.cycles) > 10


@pytest.mark.parametrize("factor", [0.9, 0.5])
def test_a_spiral_in_the_plane(factor):
    params = ls.map(spiral, c=factor * 0.6, s=factor * 0.8, bend=0.0)
    proof = ls.certify(params, ls.grid([(-1.1, 0.9), (-1.2, 0.8)], cells=64), ["cycles", "expanding"])
    (cycle,) = proof.cycles
    assert (cycle.lo[0] < 0.0).all()
    assert (cycle.hi[0] > 0.0).all()
    assert cycle.attracts is True
    assert "one dimension only" in proof.claims[1].reason


@pytest.mark.parametrize(
    ("low", "high"), [(1e-3, 1e-3), (1e-9, 1e-9), (-1e-3, 1e-3), (0.0, 0.0), (-1e-12, 1e-12)]
)
def test_an_orbit_that_is_not_there_for_all_parameters_is_not_proved(low, high):
    # 1.75 x - x^3 + c has fixed points beside 1/2 for c > -1/4, and one there that is double for c = -1/4
    lower, upper = (ls.map(odd, a=1.75, c=-0.25 - off) for off in (high, low))
    proof = ls.certify(lower, ls.grid([(-2.1, 2.1)], cells=64), ["invariant"], upper=upper)
    here = Cycle(np.array([0.5]), np.zeros(1, np.int64), np.zeros(1, np.int64), 1.0, 0.0, True)
    assert isinstance(prove_orbit((proof.map, proof.upper), here, lambda *_: True), str)


@pytest.mark.parametrize("size", [0.9, 1.0, 1.1])
def test_a_fixed_point_of_the_plane_attracts_as_its_eigenvalues_say(size):
    """They are size and 1/2, -size and 1/2, and +-i size: on the unit circle nothing is proved."""
    for matrix in ([[size, 0.0], [0.0, 0.5]], [[-size, 0.0], [0.0, 0.5]], [[0.0, -size], [size, 0.0]]):
        slope = np.array([matrix])
        expected = None if size == 1.0 else size < 1.0
        assert orbits_of_map._attracts(entries(slope, slope)) is expected


def test_an_orbit_found_badly_is_proved_in_a_box_that_holds_it():
    proof = ls.certify(growth(2.3), ls.grid([(0.2, 1.7)], cells=4096), ["invariant"])
    (true,) = cycles(proof.graph, 2, proof.cells)
    found = prove_orbit((proof.map, proof.map), replace(true, x=true.x + 1e-3), lambda *_: True)
    assert not isinstance(found, str)
    assert (found.lo[:, 0] <= true.x).all()
    assert (true.x <= found.hi[:, 0]).all()


def test_a_cycle_is_proved_for_a_range_of_parameters_in_which_it_stays_hyperbolic():
    # a x - x^3 has the fixed points +- sqrt(a - 1), with slope 3 - 2 a
    grid, low, high = ls.grid([(-2.1, 2.1)], cells=2048), 1.6, 1.7
    proof = ls.certify(cubic(low), grid, ["cycles"], upper=cubic(high))
    assert verdicts(proof) == {"cycles": "proved"}
    assert [cycle.attracts for cycle in proof.cycles] == [True, True]
    left, right = proof.cycles
    for a in np.linspace(low, high, 11):
        assert right.lo[0, 0] <= math.sqrt(a - 1.0) <= right.hi[0, 0]
        assert left.lo[0, 0] <= -math.sqrt(a - 1.0) <= left.hi[0, 0]
        assert right.slope_lo[0, 0] <= 3.0 - 2.0 * a <= right.slope_hi[0, 0]
    doubling = ls.certify(cubic(1.99), grid, ["cycles"], upper=cubic(2.01))  # slope -1 at a = 2
    assert not any(cycle.attracts for cycle in doubling.cycles)


@pytest.mark.sweep
def test_cycles_of_a_chaotic_range_leave_the_other_claims_of_the_call_alone():
    grid, told = ls.grid([(-2.1, 2.1)], cells=2048), []
    upper, tell = cubic(2.51), (lambda *step: told.append(step))
    proof = ls.certify(cubic(2.5), grid, ["invariant", "cycles"], upper=upper, progress=tell)
    assert verdicts(proof) == {"invariant": "proved", "cycles": "proved"}
    assert told[0][0] == "transitions"
    assert [step for step in told if step[0] == "cycles"][-1][1:] == (len(told) - 2, len(told) - 1)
    for cycle in proof.cycles[:: len(proof.cycles) // 12]:
        middle = 0.5 * (cycle.lo[:, 0] + cycle.hi[:, 0])
        for a in (2.5, 2.5037, 2.51):  # Newton's method on all points at once, in floats
            x, p = middle, cycle.period
            for _ in range(20):
                slope = np.diag(a - 3.0 * x**2) - np.roll(np.eye(p), 1, axis=1)
                x = x - np.linalg.solve(slope, a * x - x**3 - np.roll(x, -1))
            assert np.abs(a * x - x**3 - np.roll(x, -1)).max() < 1e-12
            assert ((cycle.lo[:, 0] <= x + 1e-12) & (x - 1e-12 <= cycle.hi[:, 0])).all()
            slope = np.prod(a - 3.0 * x**2)
            assert cycle.slope_lo[0, 0] <= slope + 1e-9 * abs(slope)
            assert slope - 1e-9 * abs(slope) <= cycle.slope_hi[0, 0]


@pytest.mark.sweep
def test_a_search_for_very_many_cycles_ends_and_says_so():
    # a = 2.9: about 3^p / p cycles of period p
    proof = ls.certify(cubic(2.9), ls.grid([(-2.1, 2.1)], cells=512), ["cycles"])
    assert 500 < len(proof.cycles) < 2000
    assert f"more than {MOST_WORDS} itineraries" in str(proof)


@pytest.mark.sweep
def test_a_search_for_very_many_cycles_of_the_plane_ends_and_says_so():
    # the cat map: 1122 cycles of periods up to 9, by |det(A^n - 1)|
    def cat(x, y):
        return 2.0 * x + y, x + y

    grid = ls.grid([(0, 1), (0, 1)], cells=64, periodic=True)
    proof = ls.certify(ls.map(cat), grid, ["cycles"])
    assert "longer cycles: there are 1122 of periods up to 9" in proof.claims[0].section["missing"]
    assert 800 < len(proof.cycles) < 1122


def test_the_basin_holds_starts_that_pass_through_recurrent_sets_of_coarse_cells():
    # all of the starts but those that leave: 85.2 %, by orbits of 100 000 starts
    proof = ls.certify(cubic(2.2), ls.grid([(-2.1, 2.1)], cells=2048), ["trapping"])
    assert 0.78 < len(proof.enters) / 2048 < 0.852
    shares = ls.resilience.basin_stability(proof.graph, ls.attractors(proof.graph))
    assert len(proof.enters) / 2048 == pytest.approx(sum(each.lo for each in shares.attractors), abs=1e-9)
    lo, hi = proof.graph.grid.boxes(proof.enters.numbers(), 0)
    x = np.linspace(lo[:, 0], hi[:, 0], 7).ravel()
    for _ in range(2000):
        x = 2.2 * x - x**3
    assert proof.cells.mask[proof.graph.grid.index(x[:, None], 0)].all()


def test_a_proof_is_printed_with_the_region_that_it_is_about():
    # the core of a tent ends at 1.8 / 2, and no start beyond 1 - 0.15 / 1.8 has an image in the grid
    text = str(ls.certify(Tent(1.8), ls.grid([(0.15, 0.93)], cells=2048), ["invariant"]))
    rows = r"{}.*\n.*\n0 +(\S+) to (\S+)$"
    kept, basin = (re.search(rows.format(head), text, re.M) for head in ("Attracting", "Basin"))
    lo, hi = map(float, kept.groups())
    assert lo <= 1.8 * (1.0 - 0.9) + 1e-6
    assert 0.9 - 1e-6 <= hi < 0.901
    assert float(basin[1]) == 0.15
    assert float(basin[2]) == pytest.approx(1.0 - 0.15 / 1.8, abs=1e-3)
    assert "Tent" in text
    assert "proved" in text
    turning, square = ls.map(spiral, c=0.3, s=0.4, bend=0.0), ls.grid([(-1.1, 0.9), (-1.2, 0.8)], cells=16)
    plane = str(ls.certify(turning, square, ["invariant"]))
    assert "boxes around its pieces" in plane  # which are more than its cells
    assert "x[1]" in plane


def test_words_and_maps_that_cannot_be_proved():
    grid = ls.grid([(0.1, 0.9)], cells=64)
    with pytest.raises(AnswerError, match="the claim about a map"):
        ls.certify(growth(2.0), grid, ["goal"])
    answer = ls.certify(maps.Doubling(1.9), grid, ["cycles"]).claims[0]  # two formulas without a margin
    assert answer.verdict == "undecided"
    assert "margin" in answer.reason


def test_branches_that_are_names_alone_need_no_margin():
    """The 2-cycle of the logistic map has the points (r + 1 +- sqrt((r - 3) (r + 1))) / 2r."""
    r, grid = 3.4, ls.grid([(0.1, 0.9)], cells=512)
    proof = ls.certify(maps.Logistic(r), grid, ["cycles", "converges"])
    assert [claim.verdict for claim in proof.claims] == ["proved", "proved"]
    (cycle,) = (each for each in proof.cycles if each.attracts)
    points = [(r + 1 + sign * math.sqrt((r - 3) * (r + 1))) / (2 * r) for sign in (-1, 1)]
    assert np.sort(0.5 * (cycle.lo + cycle.hi).ravel()) == pytest.approx(points, rel=1e-12)
    every = ls.certify(maps.Logistic(4.0), ls.grid([(-0.1, 1.1)], cells=16), ["all-cycles"], period=4)
    assert every.claims[0].verdict == "proved"
    # of the full shift of two
    assert sorted(orbit.period for orbit in every.cycles) == [1, 1, 2, 3, 3, 4, 4, 4]


def root(x, r):
    return r * np.sqrt(x)


def test_nothing_is_proved_where_a_function_is_not_defined():
    proof = ls.certify(ls.map(root, r=0.5), ls.grid([(-1.0, 1.0)], cells=64), ["attracts-all"])
    assert proof.claims[0].verdict == "undecided"
    assert "may leave the domain, or is not enclosed" in proof.claims[0].reason
