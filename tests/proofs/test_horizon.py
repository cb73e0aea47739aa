"""Any number of throws: bounds by functions against chains solved in rationals, and in certificates; forgeries."""

import random
import sys
from fractions import Fraction
from types import SimpleNamespace

import flint
import numpy as np
import pytest

from limitsets.checker import horizon as of_package
from limitsets.checker.absorption import brackets_of
from limitsets.checker.balls import PRECISION
from limitsets.checker.means import Spread, mean_rows
from limitsets.checker.noisy_map import chain_of_map, mesh_of_map, strata_of
from limitsets.feeder.scattering import Scattering, Uniform
from limitsets.proofs.chances.absorption import absorption_brackets
from limitsets.proofs.chances.forever import forever
from tests.proofs import forge
from tests.proofs.test_noisy_maps import WITHIN_1, map_of, probabilities, solved
from tests.proofs.test_probabilities import section_of
from tests.proofs.test_recheck import checker, verdict


def of_checker(name):
    return sys.modules[f"{checker.__name__}.{name}"]


class Chain:
    """A chain of some states, rows of probabilities, of which the last two absorb: "right" and "exits"."""

    def __init__(self, rows):
        self.rows, n = np.array(rows, dtype=float), len(rows)
        self.absorbed = {"right": np.array([n - 2]), "exits": np.array([n - 1])}
        self.live, self.hard = np.array([], dtype=np.int64), SimpleNamespace(at=np.arange(n - 3))

    def fixed(self, value):
        return np.concatenate([np.full(len(self.rows) - 2, -np.inf), [value["right"], value["exits"]]])

    def first(self, fixed):
        return np.maximum(fixed, 0.0)

    def above(self, values, fixed, more=0.0):
        mean = self.rows @ values + 2.0**-50 * np.abs(values).max() + more
        return np.maximum(np.where(np.isfinite(fixed), -np.inf, mean), fixed)


def start_at_0(count):
    return of_checker("means").Rows(1, np.array([0]), np.array([0]), np.array([1.0]), 0.0)


def of_one(stays):
    """A state that throws stay in with a probability; `hard` names its node and the next one, which absorbs."""
    return Chain([[stays, 1.0 - stays, 0.0], [0, 1, 0], [0, 0, 1]])


@pytest.mark.usefixtures("precision")
@pytest.mark.parametrize("stays", [0.1, 0.4, 0.9])
def test_a_mean_below_the_geometric_one_is_not_proved(stays):
    horizon, chain, row = of_checker("horizon"), of_one(stays), start_at_0(3)
    chain.hard.at = np.array([0])
    chain.above = lambda values, fixed, more=0.0: np.array(
        [more + stays * values[0] + (1.0 - stays) * values[1], fixed[1], fixed[2]]
    )
    mean = 1.0 / (1.0 - stays)  # of a geometric law
    unproved = of_checker("balls").UnprovedError
    for share in (0.7, 0.9, 0.999999):
        with pytest.raises(unproved, match="at most"):
            horizon.check_mean(chain, row, (0.0, share * mean), (None, None))
    horizon.check_mean(chain, row, (0.999 * mean, 1.001 * mean), (None, None))
    with pytest.raises(unproved, match="at least"):
        horizon.check_mean(chain, row, (1.001 * mean, np.inf), (None, None))


def until_absorbed(rows, right):
    """Solve (I - Q) V = right of the states that do not absorb, in rationals."""
    n = len(rows) - 2
    return solved([[*(Fraction(i == j) - rows[i][j] for j in range(n)), right[i]] for i in range(n)])


@pytest.mark.usefixtures("precision")
def test_functions_bound_random_chains_as_exact_rationals_do():
    """40 chains of 2 to 6 states: functions a little off the exact solution prove bounds on its side alone."""
    horizon, unproved = of_checker("horizon"), of_checker("balls").UnprovedError
    random = np.random.default_rng(8)
    for _ in range(40):
        n = int(random.integers(2, 7))
        counts = random.integers(0, 9, (n, n + 2))
        counts[:, n:] += 1  # so that throws end
        rows = [[Fraction(int(c), int(row.sum())) for c in row] for row in counts]
        rows += [[Fraction(i == j) for j in range(n + 2)] for i in (n, n + 1)]
        mean, ever = (
            until_absorbed(rows, [Fraction(1)] * n),
            until_absorbed(rows, [rows[i][n] for i in range(n)]),
        )
        chain, row = Chain([[float(p) for p in each] for each in rows]), start_at_0(n + 2)
        m = np.array([*map(float, mean), 0.0, 0.0])
        v = np.array([*map(float, ever), 1.0, 0.0])
        upper, lower, least, most = m * (1 + 1e-9), -m * (1 - 1e-9), -v + 1e-9 * m, v + 1e-9 * m
        horizon.check_mean(chain, row, (m[0] * (1 - 1e-8), m[0] * (1 + 1e-8)), (lower, upper))
        assert horizon.proves_mean_above(chain, upper)
        span = v[0] - 1e-7, min(v[0] + 1e-7, 1.0)
        horizon.check_ever(chain, row, "right", span, (least, most), True)
        for said in ((float(mean[0]) * (1 + 1e-8), np.inf), (0.0, float(mean[0]) * (1 - 1e-8))):
            with pytest.raises(unproved, match="is proved"):
                horizon.check_mean(chain, row, said, (lower, upper))
        for said in ((min(v[0] + 1e-7, 1.0), 1.0), (0.0, v[0] - 1e-7)):
            with pytest.raises(unproved, match="is proved"):
                horizon.check_ever(chain, row, "right", said, (least, most), True)
        # a function on the wrong side of the solution, at one state, proves nothing
        k, off = int(random.integers(n)), np.zeros(n + 2)
        off[k] = 1e-3
        for functions in ((lower - off, upper), (lower, upper - off)):
            with pytest.raises(unproved, match="function of the mean is none"):
                horizon.check_mean(chain, row, (0.1, 1e6), functions)
        for functions in ((least - off, most), (least, most - off)):
            with pytest.raises(unproved, match="function is none"):
                horizon.check_ever(chain, row, "right", (1e-6, 1.0 - 1e-6), functions, True)


@pytest.mark.usefixtures("precision")
def test_where_throws_go_on_for_ever_no_probability_is_proved_from_below():
    """A closed state off the places: V = 1 there has its inequality, and would prove 1; a mean has any lower bound."""
    horizon, unproved = of_checker("horizon"), of_checker("balls").UnprovedError
    chain, row = Chain([[1, 0, 0, 0], [0.5, 0, 0.5, 0], [0, 0, 1, 0], [0, 0, 0, 1]]), start_at_0(4)
    chain.above = lambda values, fixed, more=0.0: np.where(
        np.isfinite(fixed), fixed, chain.rows @ values + more
    )
    one = np.array([-1.0, -1.0, -1.0, 0.0])
    assert horizon.worst(chain, one, horizon.fixed_of(chain, "right", -1.0), 0.0) <= 0.0
    with pytest.raises(unproved, match="that the throws end is not proved"):
        horizon.check_ever(chain, row, "right", (0.9, 1.0), (one, -one), False)
    horizon.check_mean(chain, row, (1e6, np.inf), (np.array([-1e6, -5e5, 0.0, 0.0]), None))
    # from above, of the state that ends at the place with probability 1/2: V < 0 on the closed state would prove 0
    beside = row._replace(column=np.array([1]))
    horizon.check_ever(chain, beside, "right", (0.0, 0.5), (one, np.array([0.0, 0.5, 1.0, 0.0])), False)
    with pytest.raises(unproved, match="the upper function is none"):
        horizon.check_ever(chain, beside, "right", (0.0, 0.1), (one, np.array([-1.0, 0.0, 1.0, 0.0])), False)
    assert not horizon.proves_mean_above(chain, np.array([1e6, 1e6, 0.0, 0.0]))


# ------------------------------------------------------------------------------------------------- chains of throws


def random_sides(rng, first):
    """Sides that wait at a place and turn one of two ways, on the last two of which throws have ended.

    `first` chooses the first way of a side, of so many; the second leads on, so that throws end.
    """
    count = rng.randint(5, 8)
    places = [rng.randint(-8, 8) for _ in range(count)]
    to = [[first(k, count), rng.randrange(min(k + 1, count - 1), count)] for k in range(count)]
    return places, to, [place + Fraction(rng.randint(-6, 6), 8) for place in places]


def proved_of(places, to, borders):
    """What the engine finds of mean and ends, for parts that have landed on side 0, with the ends within 10 throws."""
    the_map, edges = map_of(places, to, borders)
    mesh = mesh_of_map(edges, WITHIN_1)
    *sides, right, end = np.split(np.arange(len(mesh.place)), mesh.first[1:-1])
    live = np.concatenate([side[1:-2] for side in sides])
    absorbed = {"right": right, "exits": np.concatenate([end, *(k[[0, 1, -2, -1]] for k in sides)])}
    steps, _ = chain_of_map(strata_of(the_map, None), mesh, WITHIN_1, live, absorbed)
    start = (np.array([number]) for number in (0, 1.0, 0, places[0] - 1.0, places[0] + 1.0))
    chain = SimpleNamespace(steps=steps, row=mean_rows(1, steps.mesh, [Spread(*start)]))
    within = {name: brackets_of(steps, chain.row, name, 10) for name in steps.absorbed}
    mean, ever, _ = forever(chain, steps.absorbed, {name: values for name, (_, values) in within.items()})
    return mean, ever, within["right"][0]


SEEDS = [
    range(8),
    pytest.param(range(8, 40), marks=pytest.mark.sweep),
    pytest.param(range(40, 210), marks=pytest.mark.repeats),
]


@pytest.mark.parametrize("seeds", SEEDS, ids=["some", "many", "most"])
def test_mean_and_ends_of_random_chains_of_throws_are_those_of_rationals(seeds):
    """Everything at work: steps as of a scene, functions that are found, and their inequalities."""
    for seed in seeds:
        rng = random.Random(seed)
        sides = random_sides(rng, lambda _, count, rng=rng: rng.randrange(count))
        rows, n = probabilities(*sides), len(sides[0]) - 2
        times, ends = (
            until_absorbed(rows, [Fraction(1)] * n)[0],
            until_absorbed(rows, [row[n] for row in rows])[0],
        )
        with flint.ctx.workprec(PRECISION):
            mean, ever, _ = proved_of(*sides)
        bounds = (mean, times, 1e-3 * times), (ever["right"], ends, 1e-6), (ever["exits"], 1 - ends, 1e-6)
        for (low, high), exact, width in bounds:
            assert low <= exact <= high < low + width, seed


@pytest.mark.parametrize("seed", range(3))
def test_of_random_chains_of_throws_that_may_go_on_for_ever_nothing_is_said(seed, monkeypatch):
    """Some side leads to itself alone: the mean is infinite, and no end has a lower bound but that of some throws."""
    monkeypatch.setattr(of_package, "MOST_MEAN", 60)
    rng = random.Random(seed)
    places, to, borders = random_sides(rng, lambda k, count: min(k + 1, count - 3))
    closed = len(places) - 3
    to[closed] = [closed, closed]
    with flint.ctx.workprec(PRECISION):
        (low, high), ever, within = proved_of(places, to, borders)
    rows = probabilities(places, to, borders)
    rows[closed] = [Fraction(0)] * len(rows)  # from where no part comes
    assert low > 10.0
    assert high == np.inf
    assert not ever
    assert within[-1, 0] <= until_absorbed(rows, [row[closed + 1] for row in rows])[0]


# ------------------------------------------------------------------------------------------------- certificates


@pytest.fixture(scope="module")
def found():
    """Brackets of paper-initial, of which P(ever wrong) is 0.691625 (docs/probabilities.md)."""
    words = {"right": (20.0, 2), "wrong": 20.0, "cells": 250, "throws": 3}
    return absorption_brackets("paper-initial", Scattering(landing=Uniform(0.1)), **words)


@pytest.fixture(scope="module")
def good(found, tmp_path_factory):
    path = found.save(tmp_path_factory.mktemp("horizon") / "x.proof.zip", recheck=False)
    return forge.opened(path)


def test_probabilities_of_ever_ending_are_proved_and_rechecked(found, good, tmp_path):
    for name, known in (("right", 0.308374), ("wrong", 0.691625)):
        low, high = found.ever[name]
        assert low <= known + 1e-6
        assert known - 1e-6 <= high < low + 1e-4
    low, high = found.mean
    assert low < 17.425 < high < low + 0.3
    report = verdict(good.copy(), tmp_path)
    assert (report.verdict, report.reason) == ("proved", "")
    assert any(
        'P(ever ended "wrong"), after any number of throws: between 0.6916' in each
        for each in report.statement
    )
    assert found.to_json()["ever"]["right"]["lo"] == found.ever["right"][0]


def test_with_one_place_all_end_there_and_nothing_is_known_of_the_others(tmp_path):
    """Of exits little is proved from below, so that the bound from above is near 1.

    After 2 throws the search begins far off, and what its function lacks is of the size of roundings.
    """
    scatter, words = Scattering(landing=Uniform(0.1)), {"right": (20.5, 2), "cells": 600, "throws": 2}
    brackets = absorption_brackets("paper-designed", scatter, **words)
    low, high = brackets.ever["right"]
    assert 0.99999 < low <= high == 1.0
    report = verdict(forge.opened(brackets.save(tmp_path / "x.proof.zip", recheck=False)), tmp_path)
    assert (report.verdict, report.reason) == ("proved", "")


def said(name, by):
    """Move both ends of what is said of a name, or of the mean."""

    def change(forged):
        section = section_of(forged)
        row = section["mean"] if name == "mean" else next(each for each in section["ever"] if each[0] == name)
        row[-2:] = [(float.fromhex(end) + by).hex() for end in row[-2:]]

    return change


def moved(name, by):
    def change(forged):
        forged.arrays[name][200] += by

    return change


def without_the_mean(forged):
    del forged.arrays["mean.upper"]
    section_of(forged)["mean"][1] = None


FORGED = {
    "is at least": said("right", 1e-4),
    "is at most": said("wrong", -1e-4),
    "the mean is at least": said("mean", 0.3),
    "the mean is at most": said("mean", -0.3),
    "the lower function is none": moved("ever.1.lower", -1e-4),
    "the upper function is none": moved("ever.0.upper", -1e-4),
    "the lower function of the mean is none": moved("mean.lower", -1e-2),
    "the upper function of the mean is none": moved("mean.upper", -1e-2),
    "that the throws end is not proved": without_the_mean,
    # files that are none
    "a function has not one number for each node": lambda f: f.arrays.update(
        {"mean.lower": f.arrays["mean.lower"][1:].copy()}
    ),
    "array ever.0.lower is missing": lambda f: f.arrays.pop("ever.0.lower"),
    "ever: the bounds are none": said("right", 1.0),
    "ever: a name is not that of places": lambda f: section_of(f)["ever"][0].__setitem__(0, "elsewhere"),
}


@pytest.mark.parametrize("reason", FORGED)
def test_what_is_false_or_odd_is_denied_in_words(good, tmp_path, reason):
    forged = good.copy()
    FORGED[reason](forged)
    report = verdict(forged.seal(), tmp_path)
    assert report.verdict == ("bad file" if [*FORGED].index(reason) > 8 else "failed")
    assert reason in report.reason


def test_files_without_functions_of_the_mean_are_read(good, tmp_path):
    """As version 0.1.0 wrote them: the checker finds functions itself."""
    forged = good.copy()
    del forged.arrays["mean.upper"], forged.arrays["mean.lower"]
    section_of(forged)["mean"] = [(15.0).hex(), (20.0).hex()]
    del section_of(forged)["ever"]
    forged.arrays = {name: each for name, each in forged.arrays.items() if not name.startswith("ever")}
    assert verdict(forged.seal(), tmp_path).verdict == "proved"
