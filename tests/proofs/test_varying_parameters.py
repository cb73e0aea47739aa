"""Averages of maps of which a parameter varies at every step: known answers, steps at every place, forged files."""

import math
import random
from fractions import Fraction

import flint
import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.checker.balls import PRECISION
from limitsets.checker.laws import uniform_law
from limitsets.checker.noisy_map import Varied, between_ends, chain_of_map, mesh_of_map, strata_of
from tests.maps_of_tests import affine, logistic
from tests.proofs.forge import opened
from tests.proofs.test_noisy_maps import checked, itself, squared


def shifted(x, p):
    return 0.5 * x + p


def times(x, p):
    return p * x + 0.3


def to_one(x, p):
    return 1.0 + 0.0 * x


def to_zero(x, p):
    return 0.0 * x


def beyond_place(x, p):
    return x - p


def within(answer, value, width):
    lo, hi = answer
    assert lo <= value <= hi < lo + width, (lo, hi, value)


def test_a_parameter_that_varies_has_the_moments_of_theory():
    # p even in [0, 1/2]: mean 1/2, variance (1/48) / (1 - 1/4)
    line = ls.grid([(-1.0, 2.0)], cells=300)
    answer = ls.average(ls.map(shifted, p=0.25), line, [itself, squared], noise={"p": 0.25})
    within(answer.numbers["itself"], 0.5, 1e-6)
    within(answer.numbers["squared"], 0.25 + 1 / 36, 1e-3)


def test_a_slope_that_varies_has_moments_and_exponent_of_theory():
    # p even in [1/4, 3/4]: E x = 0.3 + E p E x, E x^2 = E p^2 E x^2 + 0.6 E p E x + 0.09
    line = ls.grid([(-1.0, 3.0)], cells=300)
    answer = ls.average(ls.map(times, p=0.5), line, [itself, squared, "lyapunov"], noise={"p": 0.25})
    within(answer.numbers["itself"], 0.6, 1e-5)
    within(answer.numbers["squared"], 0.27 / (1 - 0.25 - 1 / 48), 2e-3)
    of_log = 2 * (0.75 * math.log(0.75) - 0.25 * math.log(0.25) - 0.5)
    within(answer.numbers["lyapunov"], of_log, 0.15)


def test_a_border_that_varies_counts_strata_on_which_the_branch_is_open():
    # from 1 to 0 where p < 1, from 0 to 1 where p > 0; p even in [-0.05, 1.25]
    line = ls.grid([(-0.2, 1.2)], cells=100)
    jumps = ls.map(pieces=(to_one, to_zero), margin=beyond_place, p=0.6)
    answer = ls.average(jumps, line, itself, noise={"p": 0.65})
    up, down = 1.25 / 1.3, 1.05 / 1.3
    within((answer.lo, answer.hi), up / (up + down), 0.08)


def test_a_file_with_a_parameter_that_varies_is_rechecked_and_forgeries_are_denied(tmp_path):
    line = ls.grid([(-1.0, 2.0)], cells=60)
    answer = ls.average(ls.map(shifted, p=0.25), line, squared, noise={"p": 0.25})
    file = opened(answer.save(tmp_path / "p.proof.zip", recheck=False))
    report = ls.recheck(file.write(tmp_path / "again.proof.zip"))
    assert report.verdict == "proved"
    assert "at every step p deviates by at most 0.25 from its value, evenly" in report.statement[0]
    assert "land within" not in report.statement[0]
    changes = [({"strata": 4}, "failed"), ({"within": "0.3"}, "failed"), ({"within": "0.2"}, "failed")]
    changes += [(change, "bad file") for change in ({"strata": 3}, {"within": "0"}, {"name": "q"}, None)]
    for change, verdict in changes:
        forged = file.copy()
        section = forged.header["boxes"][0]["claims"][0]["section"]
        section["varied"] |= change or {}
        if change is None:
            del section["varied"]
        assert ls.recheck(forged.seal().write(tmp_path / "forged.proof.zip")).verdict == verdict, change


def over(x, p):
    return x / p


def bare(x, landing):
    return x * landing


def waves(x, p):
    return 0.8 * np.sin(3.0 * p * x) + p * p


def kinked(x, p):
    return 0.3 * x + 0.5 * abs(p - 0.03)


def fewer(x, p):
    return 0.5 * x - 0.4 * p


def wavy_border(x, p):
    return np.sin(8.0 * x) - 3.0 * p


WIDE, FINE = np.linspace(-1.5, 1.5, 13), np.linspace(-1.5, 1.5, 61)
VARIED = {  # map, value or range of p, strata, nodes, and the map in numpy
    "two slopes": (ls.map(waves, p=0.0), ("0.0", "0.0"), 1, FINE, waves),
    "few strata": (ls.map(waves, p=0.5), ("0.5", "0.5"), 4, WIDE, waves),
    "a tolerance": (ls.map(waves, p=0.02), ("0.02", "0.05"), 2, WIDE, waves),
    "a kink": (ls.map(kinked, p=0.0), ("0.0", "0.0"), 1, WIDE, kinked),
    "a border": (
        ls.map(pieces=(shifted, fewer), margin=wavy_border, p=0.0), ("0.0", "0.0"), 4, WIDE,
        lambda x, p: np.where(wavy_border(x, p) > 0, fewer(x, p), shifted(x, p)),
    ),
}  # fmt: skip


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("case", VARIED)
def test_a_step_with_a_parameter_that_varies_is_bounded_at_every_place(case, seed):
    the_map, ends, count, edges, image = VARIED[case]
    rng = np.random.default_rng(seed)
    slope, turn, bow = rng.uniform(-2.0, 2.0, 3)
    with flint.ctx.workprec(PRECISION):
        strata = strata_of(checked(the_map, {"p": ends}), Varied("p", Fraction(1, 10), count))
        law = uniform_law(Fraction(0), 1)
        mesh = mesh_of_map([edges], law)
        chain, _ = chain_of_map(strata, mesh, law, between_ends(mesh), {})
    place = chain.mesh.place
    near = np.clip(place, -3.0, 3.0)
    u = slope * np.sin(2.0 * near + turn) + bow * near * near
    bound = chain.above(u, np.full(len(place), -np.inf))
    x, p = rng.uniform(edges[0], edges[-1], 400), 0.2 * (np.arange(4000) + 0.5) / 4000 - 0.1
    for value in {float(end) for end in ends}:
        mean = np.interp(image(x[:, None], value + p), place, u).mean(axis=1)
        assert (np.interp(x, place, bound) > mean - 2e-4).all()


LINE, BOW = ls.grid([(-1.0, 1.0)], cells=20), (ls.map(logistic, r=3.7), ls.grid([(0.05, 0.99)], cells=100))
REFUSED = [
    ((ls.map(over, p=0.05), LINE, itself), {"p": 0.1}, "the noise is"),
    ((ls.map(times, p=0.3), LINE, itself), {"p": 1e-50}, "the noise is"),
    ((ls.map(bare, landing=0.5), LINE, itself), 0.1, "a parameter is 'landing'"),
    ((*BOW, itself), {"q": 0.1}, "the noise of q is 0.1; allowed: at least 1e-90, of landing or r"),
    ((*BOW, itself), {"r": -0.1}, "the noise of r is -0.1"),
    ((*BOW, itself), {}, "the noise is 0.0"),
    ((*BOW, itself), {"landing": 0.0}, "the noise is 0.0"),
    (BOW, {"r": 0.05}, r"ln \|f'\| has a pole"),
    ((ls.map(affine, a=0.5, b=0.1), LINE, itself), {"a": 0.1, "b": 0.1}, "of one parameter"),
]


@pytest.mark.parametrize(("given", "noise", "why"), REFUSED)
def test_noise_of_parameters_that_is_none_is_refused(given, noise, why):
    with pytest.raises(AnswerError, match=why):
        ls.average(*given, noise=noise)


@pytest.mark.sweep
@pytest.mark.parametrize("seed", range(3))
def test_random_orbits_with_a_parameter_that_varies_lie_within_the_bounds(seed):
    rng = random.Random(seed)
    r, e, landing = rng.uniform(3.0, 3.7), 10 ** rng.uniform(-2.0, -1.0), rng.choice([0.005, 0.01])
    top = (r + e) / 4 + landing + 3e-3
    bottom = 0.8 * ((r - e) * top * (1 - top) - landing)
    answer = ls.average(
        ls.map(logistic, r=r), ls.grid([(bottom, top)], cells=500), ["lyapunov", itself],
        noise={"landing": landing, "r": e},
    )  # fmt: skip
    noise = np.random.default_rng(seed)
    x, sums = noise.uniform(bottom, top, 1000), np.zeros((2, 1000))
    for k in range(3000):
        drawn = r + noise.uniform(-e, e, 1000)
        if k >= 500:
            sums += np.log(np.abs(drawn * (1 - 2 * x))), x
        x = drawn * x * (1 - x) + noise.uniform(-landing, landing, 1000)
    means = sums / 2500
    for name, row in zip(("lyapunov", "itself"), means, strict=True):
        bound, error = answer.numbers[name], 5 * row.std() / math.sqrt(1000)
        assert bound[0] - error <= row.mean() <= bound[1] + error, (name, r, e)
