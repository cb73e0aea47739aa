"""Averages of maps whose steps scatter: known answers, random chains against rationals, poles, forged files."""

import math
import random
from fractions import Fraction

import flint
import mpmath
import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.checker.any_map import Map, read_map
from limitsets.checker.balls import PRECISION
from limitsets.checker.laws import uniform_law
from limitsets.checker.links import turn_of
from limitsets.checker.map_long_run import LongRunOfMap, gains_of, pole
from limitsets.checker.noisy_map import BranchOfCell, NoisyMap, steps_from
from limitsets.checker.observable import Allowed, read_function
from limitsets.proofs.prover.long_run_of_map import settled
from tests.maps_of_tests import logistic
from tests.proofs.forge import opened, spoiled

A, B = 19 / 42 * (7 / 5) ** (1 / 3), 0.02328852830307032
C = 20 / (3**20 * 7) * (7 / 5) ** (1 / 3) * math.exp(18.7)


def half(x):
    return 0.5 * x


def left(x):
    return (A + np.cbrt(x - 0.125)) * math.exp(-x) + B


def right(x):
    return C * (10 * x * math.exp(-10 * x / 3)) ** 19 + B


def from_change(x):
    return x - 0.3


def swapped(x):
    return 1.0 + 0.0 * x


def swapped_back(x):
    return -1.0 + 0.0 * x


def itself(x):
    return x


def squared(x):
    return x * x


def by_share(x, a):
    return a * x


# Matsumoto and Tsuda's map, on which noise makes order: J. Stat. Phys. 31 (1983) 87.
ORDERED = ls.map(pieces=(left, right), margin=from_change)


# ---------------------------------------------------------------- known answers


def test_a_contraction_with_noise_has_the_mean_square_and_exponent_of_theory():
    # X = sum of 2^-k e_k: the mean of X^2 is e^2/3 / (1 - 1/4)
    e = 0.25
    of = ["lyapunov", itself, squared, [(0.0, 2.0)]]
    answer = ls.average(ls.map(half), ls.grid([(-1.0, 1.0)], cells=400), of, noise=e)
    exact = {"lyapunov": -math.log(2.0), "itself": 0.0, "squared": 4 * e * e / 9, "share_of_0_to_2": 0.5}
    assert answer.numbers.keys() == exact.keys()
    for name, value in exact.items():
        lo, hi = answer.numbers[name]
        assert lo <= value <= hi < lo + 1e-4, name
    assert answer.starts == ((0, -1.0, 1.0),)


def test_two_intervals_that_are_swapped_share_the_time_from_every_start():
    # the chain has period 2: single laws do not converge, averages do
    to_and_fro = ls.map(pieces=(swapped, swapped_back), margin=itself)
    answer = ls.average(to_and_fro, ls.grid([(-2.0, 2.0)], cells=64), [[(0.0, 3.0)]], noise=0.5)
    assert answer.lo <= 0.5 <= answer.hi < answer.lo + 1e-6


def test_a_set_that_no_step_leaves_is_a_part_of_the_grid():
    # 2 x + noise leaves [-1, 1] from everywhere; x/2 stays where |x| <= 2 e
    with pytest.raises(AnswerError, match=r"the noise.*steps stay on some cells"):
        ls.average(ls.map(by_share, a=2.0), ls.grid([(-1.0, 1.0)], cells=50), noise=0.1)


def test_noise_makes_order():
    # the sampled exponent is -0.390 at 0.003 (2e7 steps of floats)
    answer = ls.average(ORDERED, ls.grid([(0.0, 1.0)], cells=4000), noise=0.003)
    assert -0.41 < answer.lo < -0.392
    assert -0.389 < answer.hi < -0.37


@pytest.mark.sweep
@pytest.mark.parametrize("seed", range(3))
def test_random_orbits_of_noisy_parabolas_lie_within_the_bounds(seed):
    rng = random.Random(seed)
    r, e = rng.uniform(2.8, 3.9), 10 ** rng.uniform(-2.5, -1.7)
    lo, hi = r * r / 4 * (1 - r / 4) - 3 * e, r / 4 + e  # from the image of the top on
    lo = min(lo, r * (r / 4 + e) * (1 - r / 4 - e) - e) - 1e-3
    answer = ls.average(
        ls.map(logistic, r=r), ls.grid([(lo, hi + 1e-3)], cells=1000), ["lyapunov", itself], noise=e
    )
    x = np.random.default_rng(seed).uniform(lo, hi, 1000)
    sums = np.zeros((2, 1000))
    noise = np.random.default_rng(seed + 100)
    for k in range(3000):
        x = r * x * (1 - x) + noise.uniform(-e, e, 1000)
        if k >= 500:
            sums += np.log(np.abs(r * (1 - 2 * x))), x
    means = sums / 2500
    for name, row in zip(("lyapunov", "itself"), means, strict=True):
        bound, error = answer.numbers[name], 5 * row.std() / math.sqrt(1000)
        assert bound[0] - error <= row.mean() <= bound[1] + error, (name, r, e)


# ---------------------------------------------------------------- random chains


def random_chain(rng):
    """A chain on sides: side i waits at a place c_i, within e of which steps land, and then turns one of two ways."""
    count = rng.randint(2, 5)
    places = [rng.randint(-8, 8) for _ in range(count)]
    to = [[rng.randrange(count), rng.randrange(count)] for _ in range(count)]
    borders = [rng.choice(places) + Fraction(rng.randint(-7, 7), 8) for _ in range(count)]
    return places, to, borders


def probabilities(places, to, borders):
    """Rows of probabilities of the next side, in rationals."""
    count = len(places)
    matrix = [[Fraction(0)] * count for _ in range(count)]
    for i in range(count):
        # the part landed within 1 of the place of side i
        above = min(max((places[i] + 1 - borders[i]) / 2, Fraction(0)), Fraction(1))
        matrix[i][to[i][1]] += above
        matrix[i][to[i][0]] += 1 - above
    return matrix


def solved(table):
    """Solve equations in rationals, by Gauss and Jordan: of each the coefficients, and what they come to."""
    n = len(table)
    for k in range(n):
        pivot = next(i for i in range(k, n) if table[i][k])
        table[k], table[pivot] = table[pivot], table[k]
        table[k] = [each / table[k][k] for each in table[k]]
        for i in range(n):
            if i != k:
                table[i] = [a - table[i][k] * b for a, b in zip(table[i], table[k], strict=True)]
    return [row[-1] for row in table]


def exact_shares(places, to, borders):
    """Stationary shares of sides, by rationals: None where the chain has several closed classes."""
    count, matrix = len(places), probabilities(places, to, borders)
    reach = [{j for j in range(count) if matrix[i][j] > 0} for i in range(count)]
    for _ in range(count):
        reach = [one | {k for j in one for k in reach[j]} for one in reach]
    classes = {frozenset(reach[i]) for i in range(count) if all(i in reach[j] for j in reach[i])}
    if len(classes) != 1:
        return None
    closed = sorted(*classes)
    table = [[*(matrix[j][i] - (i == j) for j in closed), Fraction(0)] for i in closed[:-1]]
    return dict(zip(closed, solved([*table, [Fraction(1)] * (len(closed) + 1)]), strict=True))


def map_of(places, to, borders):
    """The map of a chain on sides, and nodes for it."""
    count, close = len(places), 2.0**-33
    keys = [(i, b) for i in range(count) for b in (0, 1)]
    raw = {
        "dimension": 1, "sides": count, "branches": 2, "parameters": [], "periodic": [[None]] * count,
        "programs": [
            {"side": i, "branch": b, "to": to[i][b], "ops": [["c", str(places[to[i][b]])]], "out": [0]} for i, b in keys
        ],
        "margins": [
            {"side": i, "ops": [["x", 0], ["c", repr(float(borders[i]))], ["sub", 0, 1]], "out": [2]}
            for i in range(count)
        ],
    }  # fmt: skip
    edges = []
    for i in range(count):
        ends = [float(borders[i]) + k * close for k in (-2, -1, 1, 2)]
        edges.append(np.array(sorted({-12.0, -11.0, 11.0, 12.0, *ends})))
    return Map(read_map(raw), {}), edges


WITHIN_1 = uniform_law(Fraction(1), 1)


def function_of(of, sides, branches):
    """What is averaged, as the checker reads it."""
    zero = [(0.0).hex()]
    raw = {"of": of, "lower": zero, "upper": zero}
    return read_function(raw, [0], Allowed(sides, branches, []), "a test", [np.zeros(0)] * 3)


def bounds_of(places, to, borders):
    """What is proved of the shares of steps from each side."""
    count, (the_map, edges) = len(places), map_of(places, to, borders)
    functions = [function_of({"steps": [[i, 0], [i, 1]]}, count, 2) for i in range(count)]
    chain, kept, gains = gains_of(the_map, LongRunOfMap(NoisyMap("1", WITHIN_1, None, [], edges), functions))
    assert kept.sum() == sum(len(each) - 1 for each in edges)
    mesh = chain.mesh
    low, high = ([settled(each[k].bound, mesh.place, mesh.first)[0] for each in gains] for k in (0, 1))
    return list(zip([-bound for bound in low], high, strict=True))


SEEDS = [
    range(15),
    pytest.param(range(15, 50), marks=pytest.mark.sweep),
    pytest.param(range(50, 220), marks=pytest.mark.repeats),
]


@pytest.mark.parametrize("seeds", SEEDS, ids=["some", "many", "most"])
def test_shares_of_random_chains_are_those_of_rationals(seeds):
    known = 0
    with flint.ctx.workprec(PRECISION):
        for seed in seeds:
            chain = random_chain(random.Random(seed))
            shares = exact_shares(*chain)
            if shares is None:
                continue
            known += 1
            for i, (low, high) in enumerate(bounds_of(*chain)):
                exact = shares.get(i, Fraction(0))
                assert low - 1e-9 <= exact <= high + 1e-9, (seed, i)
                assert high - low < 1e-4, (seed, i)
    assert known > len(seeds) // 2


# ---------------------------------------------------------------- one step


def falling(x):
    return -0.3 * x - 0.3


def rising(x):
    return 0.4 * x + 0.5


def from_0_13(x):
    return x - 0.13


def hill(x):
    return 0.4 - 0.8 * x * x


def wavy(x):
    return 0.9 * np.sin(2.0 * x)


def knoll(x):
    return 0.1 - 0.2 * x * x


TWO_WAYS = ls.map(pieces=(falling, rising), margin=from_0_13)
WAYS = lambda x: np.where(x > 0.13, rising(x), falling(x))  # noqa: E731
TO_THE_RIGHT = {"share": [{"side": 0, "box": [[(0.0).hex(), (2.0).hex()]]}]}
STEPS = {  # the map, its image, what is counted, its values, edges
    "a change of branch in a wide cell": (
        TWO_WAYS, WAYS, {"steps": [[0, 1]]}, lambda x: 1.0 * (x > 0.13), np.linspace(-1.0, 1.75, 12),
    ),
    "a pole in a wide cell": (
        ls.map(hill), hill, {"lyapunov": True}, lambda x: np.log(np.abs(1.6 * x)), np.linspace(-1.2, 1.2, 8),
    ),
    "a jump at a node": (
        ls.map(half), half, TO_THE_RIGHT, lambda x: 1.0 * (x > 0.0), np.linspace(-1.0, 1.0, 5),
    ),
    "a turn in a very wide cell": (
        ls.map(knoll), knoll, {"steps": [[0, 0]]}, np.ones_like, np.array([-1.5, -0.8, 0.8, 1.5]),
    ),
    "a slope that turns": (
        ls.map(wavy), wavy, TO_THE_RIGHT, lambda x: 1.0 * (x > 0.0), np.linspace(-1.6, 1.6, 8),
    ),
}  # fmt: skip


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("case", STEPS)
def test_a_step_is_bounded_at_every_place_of_wide_cells(case, seed):
    the_map, image, of, counted, edges = STEPS[case]
    rng, e = np.random.default_rng(seed), 0.3
    xi = e * (2.0 * (np.arange(4000) + 0.5) / 4000 - 1.0)
    with flint.ctx.workprec(PRECISION):
        function = function_of(of, 1, 2 if the_map is TWO_WAYS else 1)
        claim = LongRunOfMap(NoisyMap("0.3", uniform_law(Fraction(3, 10), 1), None, [], [edges]), [function])
        chain, kept, ((lower, upper),) = gains_of(checked(the_map), claim)
        assert kept.sum() == len(edges) - 1
        u = rng.normal(size=len(chain.mesh.place)) * (seed > 0)
        x = rng.uniform(edges[0], edges[-1], 500)
        landings = image(x)[:, None] + xi
        for sign, gain in ((-1.0, lower), (1.0, upper)):
            nodes, bound = gain.bound(u)
            mean = (sign * counted(landings) + np.interp(landings, chain.mesh.place, u)).mean(axis=1)
            # of 4000 places the mean is off by less than 1e-3, beside a pole too
            assert (np.interp(x, chain.mesh.place[nodes], bound) > mean - 1e-3).all()


def test_the_range_of_a_step_holds_a_turn_inside_the_cell_and_its_bow():
    # 0.1 - 0.2 x^2 on [-0.8, 0.8]: from -0.028 to 0.1, 0.128 above its chord in the middle
    with flint.ctx.workprec(PRECISION):
        (step,) = steps_from(checked(ls.map(knoll)), 0, 1, (-0.8, 0.8), {})
        row = turn_of(1, 1.6, step.piece.slope, step.piece.bend, (0, *step.range))
    assert step.range[0] <= -0.028
    assert step.range[1] >= 0.1
    assert 0.128 <= row[-1] < 0.13


# ---------------------------------------------------------------- poles


def checked(the_map, parameters=None):
    """A recorded map, as the checker has it."""
    from limitsets.proofs.prover.programs import recorded_map
    from limitsets.systems.maps import coerce

    return Map(read_map(recorded_map(coerce(the_map), 1) | {"periodic": [[None]]}), parameters or {})


def squares(x):
    return 0.4 - 1.7 * (x - 0.25) * (x - 0.25)


def climbs(x):
    return 20.0 * x + 0.1 * np.cbrt(x - 0.25)


def roots(x):
    return 0.3 + 0.8 * np.cbrt(x - 0.25) * (1.0 + x)


POLES = {  # |f'| at 1/4 + t
    "where the slope is 0": (squares, lambda t: 3.4 * abs(t)),
    "where it is infinite and steep": (climbs, lambda t: 20.0 + 0.1 / (3 * mpmath.cbrt(t * t))),  # from above
    "where it is infinite": (
        roots,
        lambda t: abs(0.8 * ((1.25 + t) / (3 * mpmath.cbrt(t * t)) + mpmath.sign(t) * mpmath.cbrt(abs(t)))),
    ),
}


@pytest.mark.parametrize("width", [2.0**-3, 2.0**-12, 2.0**-30])
@pytest.mark.parametrize("share", [0.5, 0.3, 0.9])
@pytest.mark.parametrize("case", POLES)
def test_the_integral_beside_a_pole_is_bounded(case, share, width):
    f, slope = POLES[case]
    ends = 0.25 - share * width, 0.25 + (1 - share) * width
    with flint.ctx.workprec(PRECISION), mpmath.workdps(60):
        program = checked(ls.map(f)).image[0, 0]
        x = flint.arb(ends[0]).union(flint.arb(ends[1]))
        _, first, second = program.bend([x])
        piece = BranchOfCell(0, 0, 0, ends, first, second)
        for sign in (1,) if f is climbs else (0, 1):
            part = lambda t, sign=sign: max((1 if sign else -1) * mpmath.log(slope(t)), 0)  # noqa: E731
            exact = mpmath.quad(part, [mpmath.mpf(ends[0]) - 0.25, 0, mpmath.mpf(ends[1]) - 0.25])
            bound = pole(program, piece, [], sign)
            assert exact <= bound <= 4 * exact + 3 * width


def test_a_map_that_is_flat_somewhere_has_no_exponent():
    flat = ls.map(pieces=(swapped, half), margin=itself)
    with pytest.raises(AnswerError, match=r"what is averaged has no bound"):
        ls.average(flat, ls.grid([(-2.0, 2.0)], cells=64), noise=0.1)


# ---------------------------------------------------------------- files


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    answer = ls.average(ls.map(half), ls.grid([(-1.0, 1.0)], cells=100), ["lyapunov", squared], noise=0.25)
    return answer.save(tmp_path_factory.mktemp("noisy") / "half.proof.zip", recheck=False)


def test_a_saved_answer_is_rechecked_and_said_in_words(saved):
    report = ls.recheck(saved)
    assert report.verdict == "proved"
    assert "from every start in [-1.0, 1.0] of side 0\n" in report.statement[-1]
    assert "within 0.25 of f(x)" in report.statement[-1]


def section_of(file):
    return file.header["boxes"][0]["claims"][0]["section"]


def narrower(word):
    """Put an end of the second average in the middle between both."""

    def forge(file):
        one = section_of(file)["functions"][1]
        ends = [float.fromhex(one[each][0]) for each in ("lower", "upper")]
        one[word] = [(0.5 * sum(ends)).hex()]

    return forge


def own(**more):
    """Change keys of the section."""
    return lambda f: section_of(f).update(more)


def require_denied(file, forgery, folder):
    """What has become false fails with its reason; a file for which none is given is bad."""
    change, reason = forgery
    report = ls.recheck(spoiled(file, change, folder / "forged.zip"))
    assert report.verdict == ("bad file" if reason is None else "failed"), str(report)
    assert (reason or "") in str(report), str(report)


def beginning(lo, hi):
    return lambda f: section_of(f)["starts"][0].update(box=[[float(lo).hex(), float(hi).hex()]])


def numbers(end, at, value):
    return lambda f: f.arrays[f"0.long-run.{end}"].__setitem__(at, value)


def nodes(by):
    """Nodes a hair apart, which ask for all memory if the checker does not look first."""
    return lambda f: f.arrays.update({"0.nodes.0": np.arange(101) * by})


FORGED = {
    "a narrower upper end": (narrower("upper"), "function 1: the upper end"),
    "a narrower lower end": (narrower("lower"), "function 1: the lower end"),
    "more noise": (own(landing="0.3"), "the upper end"),
    "noise that leads out": (own(landing="0.6"), "some step may lead out"),
    # a hostile reader's: no cell that is not kept meets them
    "starts beyond the far nodes": (beginning(1e6, 2e6), "beyond the nodes"),
    "starts beyond the cells": (beginning(-1.0, 1.5), "beyond the nodes"),
    "another function": (numbers("upper", (slice(40, 60), 1), 3.0), "the upper end"),
    "near nodes, and wide noise": (lambda f: (own(landing="999999")(f), nodes(1e-9)(f)), ""),
    "nodes that are no normal numbers": (nodes(1e-320), ""),
    # files that are none
    "no noise": (own(landing="0"), None),
    "noise in words": (own(landing="much"), None),
    "a key too many": (own(more=1), None),
    "nodes that descend": (
        lambda f: (f.arrays["0.nodes.0"].sort(), f.arrays["0.nodes.0"].__setitem__(3, -5.0)), None,
    ),
    "too few numbers": (
        lambda f: f.arrays.update({"0.long-run.lower": f.arrays["0.long-run.lower"][1:]}), None,
    ),
    "an array that is missing": (lambda f: f.arrays.pop("0.long-run.lower"), None),
    "a function that is not finite": (numbers("upper", (5, 1), np.nan), None),
    "a function without a name": (lambda f: section_of(f)["functions"][0].update(of={}), None),
}  # fmt: skip


@pytest.mark.parametrize("case", FORGED)
def test_what_is_forged_is_denied(case, saved, tmp_path):
    require_denied(saved, FORGED[case], tmp_path)


def test_a_function_that_is_forged_everywhere_by_a_constant_is_harmless(saved, tmp_path):
    forged = opened(saved)
    forged.arrays["0.long-run.upper"] = forged.arrays["0.long-run.upper"] + 2.0
    assert ls.recheck(forged.seal().write(tmp_path / "forged.zip")).verdict == "proved"


REFUSED = {
    "noise as wide as the grid": ({}, 1e6, r"the noise is 1000000"),
    "noise that no decimal writes": ({}, 1e-300, r"the noise is 1e-300"),
    "corners the wrong way": ({"upper": ls.map(by_share, a=0.4)}, 0.1, r"upper corner of a is 0.4"),
    "an upper corner of another map": ({"upper": ls.map(half)}, 0.1, r"upper"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_asked_is_told_in_a_line(case):
    how, noise, words = REFUSED[case]
    with pytest.raises(AnswerError, match=words):
        ls.average(ls.map(by_share, a=0.5), ls.grid([(-1.0, 1.0)], cells=20), noise=noise, **how)


def test_a_slope_of_either_sign_over_a_range_is_answered():
    ends = [ls.map(by_share, a=a) for a in (-0.5, 0.5)]
    wide = ls.average(ends[0], ls.grid([(-1.0, 1.0)], cells=20), itself, upper=ends[1], noise=0.02)
    assert wide.lo < 0.0 < wide.hi


def rooted(x):
    return 0.5 * np.cbrt(x - 0.3) - 0.6 * np.cbrt(x + 0.4)


@pytest.mark.parametrize("cells", [300, 301])
def test_a_node_beside_the_zero_of_a_cube_root_is_no_obstacle(cells):
    answer = ls.average(ls.map(rooted), ls.grid([(-1.2, 1.2)], cells=cells), noise=0.1)
    rng = np.random.default_rng(0)
    x, total = rng.uniform(-1.0, 1.0, 20_000), 0.0
    for _ in range(300):
        x = rooted(x) + rng.uniform(-0.1, 0.1, x.size)
        slope = 0.5 / (3 * np.cbrt(x - 0.3) ** 2) - 0.6 / (3 * np.cbrt(x + 0.4) ** 2)
        total += np.log(np.abs(slope)).mean()
    assert answer.lo - 0.02 < total / 300 < answer.hi + 0.02
