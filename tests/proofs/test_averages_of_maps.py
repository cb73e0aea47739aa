"""Averages along almost every orbit: known answers, sampled averages, files that are forged, maps without an answer."""

import math

import numpy as np
import pytest
from flint import arb

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.checker.observable import LEAST_WEIGHT, OnCell, bounds_of_share
from tests.maps_of_tests import beyond_half, falling, place, stretched, tent
from tests.proofs.forge import average_changed, end_moved, opened, section_of_average
from tests.proofs.test_noisy_maps import require_denied

GOLDEN = (1.0 + math.sqrt(5.0)) / 2.0


def lanford(x):
    return 2.0 * x + x * (1.0 - x) / 2.0


def circle(cells):
    return ls.grid([(0.0, 1.0)], cells=cells, periodic=True)


def line(cells):
    return ls.grid([(0.0, 1.0)], cells=cells)


def bounds(proof):
    assert proof.average is not None, proof.claims[0].reason
    ((lo, hi),) = proof.average.bounds.values()
    return lo, hi


# Densities are constant for the doubling map and on the two intervals between the points a < 1/2 < t of the orbit of
# 1/2 of the golden tent: [a, 1/2] goes onto [1/2, t], and that onto both, so that masses are as 1 : GOLDEN^2; that
# of x -> b x mod 1 is (b^2 + b/2) / (...) on two steps (Renyi, Acta Math. Hung. 8, 1957); Lanford's exponent is printed
# by Galatolo and Nisoli (SIAM J. Appl. Dyn. Syst. 13, 2014).
KNOWN = {
    "doubling, mean": (ls.map(stretched, b=2.0), circle, place, 0.5, 2e-3),
    "doubling, exponent": (ls.map(stretched, b=2.0), circle, "lyapunov", math.log(2.0), 1e-11),
    "doubling, share": (ls.map(stretched, b=2.0), circle, [(0.25, 0.5)], 0.25, 5e-3),
    "doubling, share of places that cut cells": (ls.map(stretched, b=2.0), circle, [(0.1, 0.35)], 0.25, 5e-3),
    "golden mean, mean": (ls.map(stretched, b=GOLDEN), circle, place, 1.0 / math.sqrt(5.0), 5e-3),
    "golden tent, mean": (tent(GOLDEN), line, place, 0.25 + 0.15 * math.sqrt(5.0), 1e-3),
    "tent of 1.7, exponent": (tent(1.7), line, "lyapunov", math.log(1.7), 1e-11),
    "Lanford's map, exponent": (ls.map(lanford), circle, "lyapunov", 0.6576617800, 2e-3),
}


@pytest.mark.parametrize("name", KNOWN)
def test_averages_that_are_known(name, tmp_path):
    params, grid, of, known, width = KNOWN[name]
    proof = ls.average(params, grid(1000), of)
    lo, hi = bounds(proof)
    assert lo < known < hi
    assert hi - lo < width
    report = ls.recheck(proof.save(tmp_path / "own.proof.zip", recheck=False))
    assert report.verdict == "proved"
    assert f"\n    {lo!r} to {hi!r}: " in report.statement[-1]
    assert str(lo)[:5] in str(proof)


def test_bounds_for_every_value_of_a_range(tmp_path):
    """They hold the averages of both ends, and are of values that stay."""
    lower, upper = tent(1.7), tent(1.7005)
    proof = ls.average(lower, line(800), place, upper=upper)
    lo, hi = bounds(proof)
    for b in (1.7, 1.7005):
        inner = bounds(ls.average(tent(b), line(800), place))
        assert lo < inner[0] < inner[1] < hi
    assert hi - lo < 0.1
    report = ls.recheck(proof.save(tmp_path / "range.proof.zip", recheck=False))
    assert report.verdict == "proved"
    assert "fixed in time: average" in str(report.map) + " ".join(report.statement)


def bumpy(x, a):
    return 2.0 * x + a + 0.3 * np.sin(x)


def test_a_range_of_a_map_whose_change_moves():
    """Where the image passes the seam depends on the parameter, and lies in one cell for all of its values."""
    turn = ls.grid([(0.0, math.tau)], cells=300, periodic=True)
    lo, hi = bounds(ls.average(ls.map(bumpy, a=0.7), turn, upper=ls.map(bumpy, a=0.701)))
    one = bounds(ls.average(ls.map(bumpy, a=0.7), turn))
    assert lo < one[0] < one[1] < hi
    share = bounds(ls.average(ls.map(bumpy, a=0.7), turn, [(1.0, 2.5)]))

    def step(x):
        return bumpy(math.tau * x, 0.7) / math.tau % 1.0

    mean, error = sampled(step, lambda x: (x >= 1.0 / math.tau) & (x <= 2.5 / math.tau), 400)
    assert share[0] - 6.0 * error < mean < share[1] + 6.0 * error
    assert share[1] - share[0] < 0.01


def test_a_histogram_is_one_file_with_a_share_for_each_bin(tmp_path):
    """The doubling map spreads starts evenly; what orbits do in a bin is asked of each bin alone."""
    bins = [[(k / 5, (k + 1) / 5)] for k in range(5)]
    proof = ls.average(ls.map(stretched, b=2.0), circle(500), bins)
    assert list(proof.average.numbers)[1] == "share_of_0.2_to_0.4"
    for by_component in proof.average.numbers.values():
        lo, hi = by_component[0]
        assert lo < 0.2 < hi
        assert hi - lo < 5e-3
    text = ls.recheck(proof.save(tmp_path / "bins.zip", recheck=False)).statement[-1]
    assert text.count("the share of steps in") == 5


def test_places_that_cut_a_cell():
    places = [(0, 0.2, 0.4), (0, 0.6, 0.7)]

    def indicator(side, ends):
        ball = arb(ends[0]).union(arb(ends[1]))
        cell = OnCell(side, 0, tuple(ends), ball, middle=ball.mid(), slope=lambda: arb(1), bend=arb(0))
        return bounds_of_share(places, cell)

    for ends, least, most in (
        ([0.3, 0.5], 0, 1),
        ([0.4, 0.6], 0, 0),
        ([0.25, 0.4], 1, 1),
        ([0.39, 0.61], 0, 1),
    ):
        assert indicator(0, ends) == (least, most, least, most, most - least)
    assert indicator(1, [0.3, 0.35])[3] == 0


def sampled(step, of, seeds, throws=4000):
    """The mean over orbits from random places, and its standard error; rounding keeps it off unstable cycles."""
    random = np.random.default_rng(5)
    x = random.uniform(0.2, 0.8, seeds)
    total = np.zeros(seeds)
    for k in range(throws + 100):
        x = np.clip(step(x) + random.uniform(-1e-13, 1e-13, seeds), 0.0, 1.0)
        total += of(x) if k >= 100 else 0.0
    means = total / throws
    return means.mean(), means.std() / math.sqrt(seeds)


def first_piece(x, left, bend, right, top):
    return left * x + bend * x * x


def second_piece(x, left, bend, right, top):
    return top - right * (x - 0.5) - bend * (x - 0.5) * (x - 0.5)


@pytest.mark.parametrize(
    "seed", [*range(3), *(pytest.param(k, marks=pytest.mark.repeats) for k in range(3, 40))]
)
def test_sampled_averages_lie_inside(seed):
    """Maps of two bent pieces on [0, 1], which stretch by 1.5 at least."""
    random = np.random.default_rng(seed)
    values = {
        "bend": random.uniform(-0.1, 0.3),
        "left": random.uniform(1.65, 1.8),
        "top": random.uniform(0.85, 0.95),
    }
    values["right"] = random.uniform(1.5, 2.0 * values["top"] - 0.16)
    params = ls.map(pieces=(first_piece, second_piece), margin=beyond_half, **values)
    lo, hi = bounds(ls.average(params, line(1500), place))

    def step(x):
        return np.where(x > 0.5, second_piece(x, **values), first_piece(x, **values))

    mean, error = sampled(step, lambda x: x, 400)
    assert lo - 6.0 * error < mean < hi + 6.0 * error
    assert hi - lo < 0.1


# ---------------------------------------------------------------- no answer


def narrow(x, b):
    return (x - 0.5) * (x - 0.5001) * (x - 0.5002)


def quadratic(x, a, b):
    return a * x + b * x * x


def jumps(x, b):
    return b * x - np.floor(b * x)


def kink(x, b):
    return b * (0.5 - np.abs(x - 0.5))


def bent_rising(x, b):
    return b * x + 0.05 * np.abs(x - 0.33)


UNSOLVED, FLAT = "the inequality of variations has no solution", "the slope may be 0 or jump"
NARROW = ls.map(pieces=(stretched, falling), margin=narrow, b=1.7)
HOPELESS = {
    "an attracting fixed point": (ls.map(stretched, b=0.5), line, UNSOLVED),
    "a neutral fixed point": (ls.map(quadratic, a=1.0, b=2.0), circle, UNSOLVED),
    "a turning point with slope 0": (ls.map(quadratic, a=3.9, b=-3.9), line, FLAT),
    "a kink inside a cell": (ls.map(kink, b=1.7), line, ""),
    "a jump inside a cell": (ls.map(jumps, b=1.7), circle, FLAT),
    "a kink that keeps the sign of the slope": (
        ls.map(pieces=(bent_rising, falling), margin=beyond_half, b=1.6), line, "twice differentiable",
    ),
    "three changes of branch in a cell": (NARROW, line, "that it holds one change of branch at most is not proved"),
    "two branches on a circle": (NARROW, circle, "an axis closes, of a map of two branches"),
}  # fmt: skip


@pytest.mark.parametrize("name", HOPELESS)
def test_no_average_is_proved_where_steps_do_not_stretch(name):
    params, grid, why = HOPELESS[name]
    proof = ls.average(params, grid(499), place)
    assert proof.average is None
    (claim,) = proof.claims
    assert (claim.claim, claim.verdict) == ("average", "undecided")
    assert why in claim.reason


def test_an_average_that_cannot_be_says_why():
    (claim,) = ls.average(ls.map(stretched, b=2.6), circle(200), lambda x: 1.0 / x).claims
    assert "the function is not finite on cell 0" in claim.reason
    (claim,) = ls.average(ls.map(lanford), line(200)).claims
    assert "close it (periodic)" in claim.reason


OUTSIDE = "the range to average over"
REFUSED = [
    ((tent(1.7), ls.grid([(0.0, 1.0), (0.0, 1.0)], cells=8)), "one"),
    (("paper-designed", line(64)), "beside a scene"),
    ((tent(1.7),), "the grid of an average"),
    *(((tent(1.7), line(64), of), "the function to average") for of in ("mean", 3.0)),
    *(
        ((tent(1.7), line(64), [of]), OUTSIDE)
        for of in ((0.5, 0.2), (0.1, 0.2, 0.3), ("1 cm", "2 cm"), (2.0, 3.0))
    ),
    ((tent(1.7), line(64), {1: [(0.1, 0.2)]}), "the side of a range"),
]


@pytest.mark.parametrize(("given", "why"), REFUSED)
def test_what_cannot_be_averaged_is_refused(given, why):
    with pytest.raises(AnswerError, match=why):
        ls.average(*given)


# ---------------------------------------------------------------- forged


@pytest.fixture(scope="module")
def tent_file(tmp_path_factory):
    return ls.average(tent(GOLDEN), line(600), place).save(
        tmp_path_factory.mktemp("average") / "tent.proof.zip"
    )


def averaged(forged):
    return section_of_average(forged)["functions"][0]


def at_least(values):
    return np.maximum(values, LEAST_WEIGHT)


FORGED = {
    "a narrower upper end": (end_moved(0, "upper", -0.3), "upper end of the average is not proved"),
    "a narrower lower end": (end_moved(0, "lower", 0.3), "lower end of the average is not proved"),
    "no weights": (average_changed("weight", lambda w: 0.0 * w), "weight is not between"),
    "small weights": (average_changed("weight", lambda w: at_least(0.9 * w)), "weight is smaller"),
    "large weights": (average_changed("weight", lambda w: 10.0 * w), "end of the average is not proved"),
    "another u": (average_changed("upper", lambda u: -u), "is not proved"),
    "u of both ends exchanged": (average_changed("lower", lambda u: -u), "is not proved"),
    "a run that leaves its component": (average_changed("runs", lambda r: r + 150), "a run beside it"),
    "a run that leaves its side": (average_changed("runs", lambda r: r + 5000), "a run beside it"),
    "a run beyond the last cell": (average_changed("runs", lambda r: r + np.int32([0, 10**6])), "a run beside it"),
    "an empty run": (average_changed("runs", lambda r: 0 * r), "a run beside it"),
    "a run on the wrong side": (average_changed("runs", lambda r: -r), "a run beside it"),
    "one more run": (average_changed("runs", lambda r: np.concatenate([r, r])), "runs beside no undecided cell"),
    "no runs": (average_changed("runs", lambda r: r[:0]), "no runs beside it"),
    "a component without cells": (
        lambda f: section_of_average(f).update(components=[3]), "component 3 has no cells",
    ),
    # files that are none
    "a number that is not finite": (average_changed("upper", lambda u: u + np.inf), None),
    "too few numbers": (lambda f: averaged(f).update(lower=[]), None),
    "two functions": (lambda f: averaged(f).update(of={"lyapunov": True, "share": []}), None),
    "no function": (lambda f: averaged(f).update(of={}), None),
}  # fmt: skip


@pytest.mark.parametrize("name", FORGED)
def test_a_forged_average_is_denied(name, tent_file, tmp_path):
    require_denied(tent_file, FORGED[name], tmp_path)


def downward(x, b):
    return -b * x


# Maps whose change of branch, at a border of two cells, comes to the seam exactly: each image ends there, and f is
# linear, so that the average by the lengths of images, as if they were chances, would solve both inequalities.
BETWEEN = {
    "two cells": (stretched, 1.5, 0.75, [0.0, 0.5, 0.75]),
    "a falling map": (downward, 2.5, 0.9375, [0.0, 0.375, 0.75, 0.9375]),
    "even cells": (stretched, 2.5, 0.9375, np.linspace(0.0, 0.9375, 16)),
}


@pytest.mark.parametrize("name", BETWEEN)
def test_a_change_on_the_border_of_two_cells_is_not_overlooked(name, tmp_path):
    function, b, period, edges = BETWEEN[name]
    edges, sign = np.array(edges), -1.0 if function is downward else 1.0
    own = ls.grid([(0.0, period)], cells=60, periodic=True)
    honest = ls.average(ls.map(function, b=b), own, place).save(tmp_path / "honest.zip", recheck=False)
    forged = opened(honest)
    n, chances = len(edges) - 1, np.zeros((len(edges) - 1, len(edges) - 1))
    for i, k, turn in np.ndindex(n, n, 7):
        lo, hi = sorted(sign * b * edges[[i, i + 1]] + (turn - 3) * period)
        chances[i, k] += max(0.0, min(hi, edges[k + 1]) - max(lo, edges[k])) / (hi - lo)
    assert chances.sum(axis=1) == pytest.approx(1.0)
    values, vectors = np.linalg.eig(chances.T)
    law = vectors[:, np.argmin(np.abs(values - 1.0))].real
    middles = 0.5 * (edges[1:] + edges[:-1])
    wrong = float(law @ middles / law.sum())
    equations = np.vstack([np.eye(n) - chances, np.ones(n)])
    u = np.linalg.lstsq(equations, np.append(middles - wrong, 0.0), rcond=None)[0]
    forged.arrays.clear()
    forged.arrays |= {
        "0.edges.0.0": edges[:-1].copy(),
        "0.rank": np.zeros(n, np.int32),
        "0.component": np.zeros(n, np.int32),
        "0.target.0": np.array([[0, n - 1]] * n, np.int32),
        "0.average.upper": u,
        "0.average.lower": -u,
        "0.average.weight": np.full(n, 100.0),
        "0.average.runs": np.zeros((0, 2), np.int32),
    }
    averaged(forged).update(lower=[(wrong - 1e-9).hex()], upper=[(wrong + 1e-9).hex()])
    report = ls.recheck(forged.seal().write(tmp_path / "forged.zip"))
    assert report.verdict == "failed"
    whys = ("an undecided cell has no runs beside it", "its image is as long as the axis")
    assert any(why in report.reason for why in whys), report.reason


def test_numbers_that_are_found_otherwise_are_as_good(tent_file, tmp_path):
    """Nothing depends on how u and w were found: larger w and another constant in u prove wider bounds."""
    forged = opened(tent_file)
    forged.arrays["0.average.upper"] += 3.0
    forged.arrays["0.average.weight"] *= 1.5
    lo, hi = (float.fromhex(averaged(forged)[key][0]) for key in ("lower", "upper"))
    averaged(forged).update(lower=[(lo - 9 * (hi - lo)).hex()], upper=[(hi + 9 * (hi - lo)).hex()])
    assert ls.recheck(forged.seal().write(tmp_path / "other.zip")).verdict == "proved"
