"""Starts that leave the domain, and almost every start: what theory says of maps, and orbits that are followed.

In the window of period 3 the logistic map has an attracting 3-cycle, to which almost every start tends, and beside it
a Cantor set of starts that do not; for r = 4 almost every orbit is dense.
"""

import math

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError, GridError
from tests.maps_of_tests import affine, beyond_half, henon, logistic, odd


def left_third(x):
    return 3.0 * x


def right_third(x):
    return 3.0 - 3.0 * x


def escaping(proof, tmp_path):
    """Cells that leave, within how many steps all of them, and what the checker says."""
    assert proof.proved
    report = ls.recheck(proof.save(tmp_path / "escapes.proof.zip", recheck=False))
    (said,) = (line for line in report.statement if line.startswith("escapes"))
    (claim,) = (claim for claim in proof.claims if claim.claim == "escapes")
    assert claim.section["steps"] == proof.exits.max() + 1
    return proof.exits, claim.section["steps"], said


def test_the_gap_of_the_logistic_map_leaves_at_once(tmp_path):
    """4.5 x (1 - x) > 1 on (1/3, 2/3), and its two preimages leave in two steps."""
    proof = ls.certify(ls.map(logistic, r=4.5), ls.grid([(0.0, 1.0)], cells=1000), ["escapes"])
    exits, steps, said = escaping(proof, tmp_path)
    edges = np.arange(1001) / 1000
    assert np.array_equal(exits == 0, (edges[:-1] > 1 / 3) & (edges[1:] < 2 / 3))
    low, high = (0.5 - math.sqrt(0.25 - y / 4.5) for y in (1 / 3, 2 / 3))
    second = edges[:-1][(exits == 1) & (edges[:-1] < 0.5)]
    assert low < second.min() < low + 0.002
    assert high - 0.003 < second.max() < high - 0.001
    share = float((exits >= 0).mean())
    assert said.endswith(f"leaves it within {steps} steps")
    assert f"{100 * share:.1f} % of it; {(exits >= 0).sum()} of 1000 cells" in str(proof)
    # almost every start leaves: finer cells show more of them
    finer = ls.certify(ls.map(logistic, r=4.5), ls.grid([(0.0, 1.0)], cells=20_000), ["escapes"])
    assert finer.claims[0].section["share"] > share + 0.1


def test_every_start_leaves_where_the_fixed_point_lies_outside(tmp_path):
    proof = ls.certify(ls.map(affine, a=2.0, b=0.0), ls.grid([(1.0, 3.0)], cells=100), ["escapes"])
    exits, steps, said = escaping(proof, tmp_path)
    assert (steps, exits.min()) == (2, 0)  # 1 -> 2 -> 4
    assert "cover all of [1.0, 3.0]" in said


def test_starts_of_henons_map_outside_its_basin(tmp_path):
    """Of every cell that leaves all orbits do, for both ends of the range and a value between."""
    lower = ls.map(henon, a=1.4, b=0.3)
    grid = ls.grid([(-3, 3), (-3, 3)], cells=200)
    proof = ls.certify(lower, grid, ["escapes"], upper=lower.with_values(a=1.41))
    exits, _, _ = escaping(proof, tmp_path)
    assert exits[grid.index(np.array([[0.6, 0.2]]), 0)] == -1  # next to the fixed point
    numbers = np.flatnonzero(exits >= 0)
    lo, hi = grid.boxes(numbers, 0)
    for a, at in ((1.4, 0.0), (1.405, 0.4), (1.41, 1.0)):
        x, y = (lo + at * (hi - lo)).T
        inside = np.ones(x.size, dtype=bool)
        for k in range(exits.max() + 1):
            x, y = 1.0 - a * x**2 + y, 0.3 * x
            inside &= (np.abs(x) <= 3) & (np.abs(y) <= 3)
            assert not inside[exits[numbers] <= k].any()
            x, y = np.where(inside, x, 0.0), np.where(inside, y, 0.0)


def test_leaving_stands_beside_claims_of_those_that_stay(tmp_path):
    """1.5 x - x^3 tends to +- sqrt(1/2) from within +- sqrt(2.5), and leaves from beyond."""
    claims = ["converges", "basin", "escapes"]
    proof = ls.certify(ls.map(odd, a=1.5), ls.grid([(-2.1, 2.1)], cells=2000), claims)
    exits, _, _ = escaping(proof, tmp_path)
    middles = proof.graph.grid.centres(0)
    assert (exits[np.abs(middles) > math.sqrt(2.5) + 0.01] >= 0).all()
    assert (exits[np.abs(middles) < math.sqrt(2.5)] == -1).all()
    assert not (proof.enters.mask & (exits >= 0)).any()


def test_where_no_start_leaves():
    proof = ls.certify(ls.map(affine, a=0.5, b=0.0), ls.grid([(-1.0, 1.0)], cells=16), ["escapes"])
    assert [claim.verdict for claim in proof.claims] == ["undecided"]
    with pytest.raises(AnswerError, match="without a proved claim"):
        proof.save("escapes.proof.zip")
    with pytest.raises(GridError, match="the claims escapes"):
        ls.certify(ls.map(affine, a=2.0, b=0.0), ls.grid([(0.0, 1.0)], cells=16, periodic=True), ["escapes"])


@pytest.mark.parametrize("box", [(-1.0, 1.0), (0.0, 1.0), (-1.0, 0.0)])
def test_an_image_that_is_a_border_of_cells_lies_in_one_of_them(box, tmp_path):
    proof = ls.certify(ls.map(affine, a=0.0, b=0.0), ls.grid([box], cells=4), ["invariant", "attracts-all"])
    proof.save(tmp_path / "zero.proof.zip")


# ------------------------------------------------------------------------------ almost every start


def tents():
    return ls.map(pieces=(left_third, right_third), margin=beyond_half)


COMES, LEAVES, TENDS = (
    "comes into the attracting cells and stays",
    "leaves it",
    "comes into cells that tend to a cycle",
)
THINNING = {
    "period 3": (lambda: ls.map(logistic, r=3.832), (0.0, 1.0), 1024, "trapping", COMES),
    "period 3, tends": (lambda: ls.map(logistic, r=3.832), (0.0, 1.0), 4096, "converges", TENDS),
    "beyond 4": (lambda: ls.map(logistic, r=4.5), (0.0, 1.0), 500, "escapes", LEAVES),
    "middle thirds": (tents, (0.0, 1.0), 999, "", LEAVES),
    "all but 0": (lambda: ls.map(affine, a=2.0, b=0.0), (-1.0, 1.0), 10, "", LEAVES),
    "two cycles": (
        lambda: ls.map(odd, a=1.8),
        (-2.5, 2.5),
        1000,
        "converges escapes",
        f"{TENDS}, or {LEAVES}",
    ),
}


@pytest.mark.parametrize("name", THINNING)
def test_almost_every_start_comes_to_cells_with_a_rank_or_leaves(name, tmp_path):
    make, box, cells, others, words = THINNING[name]
    lower, grid = make(), ls.grid([box], cells=cells)
    proof = ls.certify(lower, grid, ["almost-every", *others.split()])
    assert proof.proved
    report = ls.recheck(proof.save(tmp_path / "almost.proof.zip", recheck=False))
    (said,) = (line for line in report.statement if line.startswith("almost-every"))
    whole = f"almost every start in [{box[0]}, {box[1]}] (all but a set of length 0)"
    assert said == f"almost-every: {whole} {words}"
    # random starts are none of the exceptions
    x = np.random.default_rng(0).uniform(*box, 2000)
    inside, arrived = np.ones(x.size, dtype=bool), np.zeros(x.size, dtype=bool)
    for _ in range(3000):
        inside &= (box[0] <= x) & (x <= box[1])
        arrived |= inside & (
            proof.arrays["rank"][np.where(inside, grid.index(np.clip(x, *box)[:, None], 0), 0)] >= 0
        )
        x, _, _, _ = ls.maps.advance(lower, np.where(inside, x, 0.5), np.zeros(x.size, int), 1)
    assert (arrived | ~inside).all()


def test_almost_every_start_for_a_range_of_parameters(tmp_path):
    lower = ls.map(logistic, r=3.832)
    upper = lower.with_values(r=3.8325)
    proof = ls.certify(
        lower, ls.grid([(0.0, 1.0)], cells=2048), ["almost-every", "attracts-all"], upper=upper
    )
    # the repelling fixed points stay
    assert [claim.verdict for claim in proof.claims] == ["proved", "undecided"]
    report = ls.recheck(proof.save(tmp_path / "range.proof.zip", recheck=False))
    assert report.map["boxes"][0]["holds_for"].endswith("changed at every step too: almost-every")


@pytest.mark.parametrize(
    ("make", "box", "reason"),
    [
        (lambda: ls.map(affine, a=-1.0, b=1.0), [(0.0, 1.0)], "are not seen to thin out"),
        (lambda: ls.map(logistic, r=4.0), [(0.0, 1.0)], "the slope may be 0 on [0.48"),
        (lambda: ls.map(henon, a=1.4, b=0.3), [(-1.5, 1.5), (-0.5, 0.5)], "in one dimension only"),
    ],
)
def test_what_does_not_thin_out_is_undecided(make, box, reason):
    proof = ls.certify(make(), ls.grid(box, cells=64), ["almost-every"])
    assert [claim.verdict for claim in proof.claims] == ["undecided"]
    assert reason in proof.claims[0].reason
