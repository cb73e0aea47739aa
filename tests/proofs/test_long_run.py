"""Averages over ever more throws that scatter: against throws in floats, chains in rationals, and forged files."""

import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
from flint import ctx
from limitsets.robust import Gaussian, Scattering, Uniform, long_run_averages

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.checker.balls import PRECISION
from limitsets.checker.brackets import mesh_of, read_setting
from limitsets.checker.horizon import nothing, worst
from limitsets.checker.log_slopes import log_slopes
from limitsets.checker.long_run import (
    EXPONENT,
    FLIPS,
    Counted,
    LongRun,
    kept_cells,
    long_run_in_words,
    most_gain,
)
from limitsets.checker.means import Mesh
from tests.proofs.forge import Plain, opened, scene
from tests.proofs.test_noisy_maps import require_denied

NOISE = Scattering(speed=Uniform(0.003), landing=Uniform(0.02))


@pytest.fixture(scope="module")
def designed():
    """Of the scatter of the scene itself, speed within 0.003 and landing within 0.02."""
    own = {"world": {"scatter": {"speed": "0.3 %", "landing": "0.02 in"}}, "effects": {"spread": "bounded"}}
    scattering = ls.load(ls.load("paper-designed").as_dict() | own)
    assert "long_run_averages proves" in ls.average(scattering).claims[-1].reason
    return long_run_averages(scattering, cells=500)


@pytest.fixture(scope="module")
def honest(designed, tmp_path_factory):
    return designed.save(tmp_path_factory.mktemp("long-run") / "designed.proof.zip", recheck=False)


def thrown(model, speed, landing, parts=20_000, throws=250, seed=1):
    """Flips per throw, shares of sides, exponent: of throws in plain floats, each part from 10 in on side 2."""
    rng, m = np.random.default_rng(seed), Plain(scene(model))
    x, side = np.full(parts, 10.0), np.full(parts, 2)
    flips, shares, counted, logs = 0, np.zeros(3), 0, 0.0
    for n in range(throws):
        kappa = m.kappa / (1.0 + speed * rng.uniform(-1.0, 1.0, parts)) ** 2
        after, to = np.empty(parts), side.copy()
        for i in range(3):
            own = side == i
            turns = m.decision(i, x[own], kappa[own]) > 0.0
            after[own] = np.where(turns, m.flip(i, x[own], kappa[own]), m.jog(i, x[own], kappa[own]))
            to[own] = np.where(turns, (i + 1) % 3, i)
        if n >= 100:  # none of which remembers where it began
            flips, counted = flips + int((to != side).sum()), counted + parts
            shares += np.bincount(side, minlength=3)
            logs += sum(float(log_slope(m, i, x[side == i], kappa[side == i]).sum()) for i in range(3))
        x, side = after + landing * rng.uniform(-1.0, 1.0, parts), to
    return flips / counted, shares / counted, logs / counted


def log_slope(m, i, x, kappa):
    """ln |dx'/dx| by a difference of throws in floats, good to 1e-8."""
    return np.log(np.abs(m.jog(i, x + 1e-4, kappa) - m.jog(i, x - 1e-4, kappa)) / 2e-4)


def test_throws_lie_between_the_bounds(designed):
    flips, shares, exponent = thrown("designed", 0.003, 0.02)
    error = 5.0 / math.sqrt(20_000 * 150)  # of counts that depend on each other little
    sampled = {"flips_per_throw": flips} | {
        f"share_of_side_{k}": share for k, share in enumerate(shares.tolist())
    }
    sampled["jogs_per_visit_of_side_2"] = 3.0 * shares[2] / flips - 1.0
    sampled["lyapunov"] = exponent
    for name, number in sampled.items():
        lo, hi = designed.numbers[name]
        room = error * (100.0 if name.startswith("jogs") else 1.0)
        assert lo - room < number < hi + room, name
        most = {"flips_per_throw": 0.06, "lyapunov": 0.006, "jogs_per_visit_of_side_2": 2.0}
        assert hi - lo < most.get(name, 0.04)


def logs_of(model, laws, edges, keeps):
    """The mesh of nodes on each side, the cells that are kept, and bounds of the logarithm of slopes at their nodes."""
    said = {
        "scene": scene(model),
        "absorbing": {"none": [[0, "27 in", None]]},
        "starts": [[2, "9 in", "10 in"]],
    }
    with ctx.workprec(PRECISION):
        setting = read_setting(said | {"laws": laws, "strata": 8})
        mesh = mesh_of([edges] * 3, 1000.0)
        kept = np.array(
            [keeps(*ends) for ends in zip(mesh.place[:-1], mesh.place[1:], strict=True)] + [False]
        )
        return mesh, kept, *log_slopes(setting.noisy, mesh, kept)


WIDE = [("designed", 0.0, 3.0), ("designed", 0.1, 1e-3), ("initial", 0.05, 0.5)]


@pytest.mark.parametrize(("model", "reach", "width"), WIDE)
def test_the_mean_of_the_logarithm_of_slopes_lies_between_its_bounds(model, reach, width):
    """On wide cells what is not affine counts, and at a node, with cells that hardly add, what the speed bends."""
    laws = {"throw.speed": {"uniform": f"{100 * reach} %"}} if reach else {}
    m, rng = Plain(scene(model)), np.random.default_rng(3)
    delta, weight = np.polynomial.legendre.leggauss(20)
    edges = np.append(np.arange(6.0, 24.0, width)[:40], 30.0)
    mesh, kept, below, above = logs_of(model, laws, edges, lambda lo, hi: 6.0 <= lo < 24.0 and lo < hi < 25.0)
    for cell in np.flatnonzero(kept).tolist():
        lo, hi = mesh.place[cell : cell + 2]
        side = int(np.searchsorted(mesh.first, cell, side="right")) - 1
        for share in (0.0, 1.0, *rng.uniform(0.0, 1.0, 4)):
            x, kappa = lo + share * (hi - lo), m.kappa / (1.0 + reach * delta) ** 2
            mean = float(weight @ log_slope(m, side, np.full(20, x), kappa)) / 2.0
            low, high = (float(each[cell] + share * (each[cell + 1] - each[cell])) for each in (below, above))
            assert low - 1e-7 < mean < high + 1e-7
            assert high - low < 0.002 + reach + 0.05 * width


def test_the_upper_end_counts_the_upper_logarithms_and_the_lower_end_the_lower_ones():
    """Two states, each of which follows the other: the exponent is the mean of the logarithms of both."""
    chain = States([[0.0, 1.0], [1.0, 0.0]])
    logs = np.repeat([[-0.7, 0.1], [-0.5, 0.9]], 4, axis=1)
    for sign, exact in ((-1.0, -0.3), (1.0, 0.2)):
        nodes, gained = most_gain(chain, chain.kept, EXPONENT, sign, tuple(logs))(np.zeros(8))
        assert nodes.tolist() == [1, 2, 5, 6]
        assert gained[::2].sum() / 2.0 == pytest.approx(sign * exact, abs=1e-12)


def test_an_exponent_below_0_is_printed_so_and_a_share_is_not(designed):
    zero = np.zeros(0)
    said = [Counted(of, (-0.25, 1.5), (zero, zero)) for of in (EXPONENT, FLIPS, 2)]
    lines = long_run_in_words(LongRun(read_setting(designed.chain.section), [], said))[-3:]
    assert "exponent: between -0.25 and 1.5" in lines[0]
    assert "flips per throw: between 0 and 1" in lines[1]
    assert "from side 2: between 0 and 1" in lines[2]


def test_where_a_slope_may_be_0_nothing_is_bounded():
    """From below the joint, as from 1 in, no throw is made."""
    edges = np.array([1.0, 6.0, 7.0, 30.0])
    _, _, below, above = logs_of("designed", {}, edges, lambda lo, hi: (lo, hi) in ((1.0, 6.0), (6.0, 7.0)))
    assert below[1] == below[2] == -math.inf
    assert above[1] == above[2] == math.inf
    assert -1.0 < below[3] < above[3] < 1.0


def test_a_recheck_says_what_is_proved(designed, honest):
    report = ls.recheck(honest)
    assert report.verdict == "proved"
    text = "\n".join(report.statement)
    assert "from every start below almost surely" in text
    printed = re.search(r"flips per throw: between (\S+) and (\S+)", text)
    assert [float(each) for each in printed.groups()] == pytest.approx(
        designed.numbers["flips_per_throw"], abs=2e-9
    )


def test_landing_noise_alone_and_speed_alone():
    """Without noise 0.3192 (docs/averages.md); the noise moves flips by less than the width."""
    lo, hi = long_run_averages("paper-designed", Scattering(landing=Uniform(0.05)), cells=400).numbers[
        "flips_per_throw"
    ]
    assert lo < 0.3185 < hi < lo + 0.02
    rough = long_run_averages("paper-designed", Scattering(speed=Uniform(0.003)), cells=200)
    assert rough.numbers["flips_per_throw"] == (0.0, 1.0)


CAVITY = {"position": "22 in", "width": "9 in", "depth": "3 in", "angle": "20 deg"}


REFUSED = [
    (("paper-designed", Scattering(landing=Gaussian(0.02))), {}, "a law without bound"),
    (("paper-designed", Scattering(landing=Uniform(8.0))), {}, "some cells attract"),
    ((ls.load("paper-designed").as_dict() | {"cavity": CAVITY}, NOISE), {}, "without a cavity"),
    (("paper-designed", NOISE), {"cells": 0}, "1 or more"),
    *(
        (("paper-designed", NOISE), {"starts": starts}, "start")
        for starts in ([(2, 12.0, 10.0)], [(3, 10.0, 12.0)], [(2, 10.0, 99.0)], [])
    ),
    (("paper-designed", NOISE), {"starts": [(2, 10.0, 12.0)]}, "places that no throw leaves"),
]


@pytest.mark.parametrize(("given", "how", "why"), REFUSED)
def test_what_has_none_is_refused(given, how, why):
    with pytest.raises(AnswerError, match=why):
        long_run_averages(*given, **{"cells": 100} | how)


# ---------------------------------------------------------------- chains of states


class States:
    """A chain of some states, one a side: cells whose means are those of rows of probabilities."""

    def __init__(self, rows):
        self.rows, n = np.array(rows, dtype=float), len(rows)
        place = np.concatenate([[-9.0, 0.0, 1.0, 9.0] for _ in range(n)])
        self.mesh = Mesh(place, 4 * np.arange(n + 1))
        self.kept = np.zeros(4 * n, dtype=bool)
        self.kept[1::4] = True

    def above(self, values, fixed, more=0.0):
        bounds = fixed.copy()
        mean = self.rows @ values[1::4] + 2.0**-50 * np.abs(values).max() + more
        bounds[1::4] = bounds[2::4] = mean
        return bounds


def stationary(rows):
    n = len(rows)
    equations = np.vstack([np.array(rows).T - np.eye(n), np.ones(n)])
    return np.linalg.lstsq(equations, np.concatenate([np.zeros(n), [1.0]]), rcond=None)[0]


@pytest.mark.parametrize("seed", range(12))
def test_functions_bound_random_chains_as_their_stationary_laws_do(seed):
    """States in a ring, each going on to the next or staying: flips and shares by the law, bounds on its side alone."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 7))
    on = rng.uniform(0.05, 1.0, n)
    rows = [[(1.0 - on[i]) * (j == i) + on[i] * (j == (i + 1) % n) for j in range(n)] for i in range(n)]
    chain, law = States(rows), stationary(rows)
    for side, exact in [(FLIPS, float(law @ on)), *((k, float(law[k])) for k in range(n))]:
        for sign in (-1.0, 1.0):
            gain = most_gain(chain, chain.kept, side, sign)
            # u of the exact solution of g + K u - u = c
            nodes, g = gain(np.zeros(4 * n))
            states = np.linalg.lstsq(np.array(rows) - np.eye(n), sign * exact - g[::2], rcond=None)[0]
            u = np.repeat(states, 4)
            _, gained = gain(u)
            assert float((gained - u[nodes]).max()) == pytest.approx(sign * exact, abs=1e-9)
            worse = u + np.repeat(rng.uniform(0.01, 0.1, n) * (np.arange(n) == rng.integers(n)), 4)
            _, gained = gain(worse)
            assert float((gained - worse[nodes]).max()) > sign * exact


def test_cells_that_throws_leave_are_not_kept():
    """Cells 1 to 6 of one side; cell 3 leads to cell 6, which is hard, and cell 2 to cell 3."""
    mesh = Mesh(np.array([-99.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 99.0]), np.array([0, 9]))
    live = np.array([1, 2, 3, 4, 5])
    to = {1: (1, 1), 2: (3, 3), 3: (5, 6), 4: (4, 4), 5: (4, 5)}
    span, other = SimpleNamespace(), SimpleNamespace()
    other.first, other.last = np.array([to[k] for k in live]).T
    inner = SimpleNamespace(at=live, one=span, two=other)
    chain = SimpleNamespace(mesh=mesh, goal=mesh, cells=inner, hard=SimpleNamespace(at=np.array([6])))

    def kept(reach):
        span.first, span.last = np.array([to[k] for k in live]).T
        return np.flatnonzero(kept_cells(chain, SimpleNamespace(reach=reach, certain=reach == 0.0))).tolist()

    # with scatter each image meets its neighbours too, for roundings at its ends: 5 is beside the hard cell
    assert kept(1e-9) == []
    # without it the spans are all that is met; 5 has a node of the hard cell
    assert kept(0.0) == [1, 4]
    to |= {1: (2, 2), 2: (2, 2), 4: (2, 2)}
    other.first = other.last = np.full(live.size, 2)
    assert kept(1e-9) == []  # 2 and its neighbours, of which 3 leads out
    assert kept(0.0) == [1, 2, 4]
    to |= {3: (2, 2)}
    assert kept(0.5) == [1, 2, 3, 4]
    assert kept(1.5) == []
    assert kept(1e-9) == [1, 2, 3, 4]
    # on the other branch cell 2 leads to the hard cell, and 5 to itself
    other.last = np.array([2, 6, 2, 2, 5])
    assert kept(1e-9) == []


# ---------------------------------------------------------------- forged


def section(f):
    return f.header["claims"][0]["section"]


def narrower(k, key, by):
    def change(f):
        one = section(f)["averages"][k]
        lo, hi = (float.fromhex(one[end]) for end in ("lower", "upper"))
        one[key] = (float.fromhex(one[key]) + by * (hi - lo)).hex()

    return change


def with_functions(k, change):
    def forged(f):
        for word in ("lower", "upper"):
            f.arrays[f"{k}.{word}"] = np.ascontiguousarray(change(f.arrays[f"{k}.{word}"]))

    return forged


def exchanged(f):
    one, other = section(f)["averages"][1], section(f)["averages"][3]
    one["of"], other["of"] = other["of"], one["of"]


def own(**more):
    return lambda f: section(f).update(more)


def of_average(k, **more):
    return lambda f: section(f)["averages"][k].update(more)


def landing(law):
    return lambda f: section(f)["laws"].update({"landing.x": law})


FORGED = {
    "a narrower exponent": (narrower(4, "upper", -0.6), "average 4: the upper end"),
    "an exponent from above": (narrower(4, "lower", 0.6), "average 4: the lower end"),
    "another share as the exponent": (of_average(1, of="lyapunov"), "is proved"),
    "a narrower upper end": (narrower(0, "upper", -0.1), "the upper end"),
    "a narrower lower end": (narrower(1, "lower", 0.1), "the lower end"),
    "no function": (with_functions(0, lambda u: 0.0 * u), "is proved"),
    "a function that overflows": (with_functions(0, lambda u: 0.0 * u - 1.7e308), "too large"),
    "another function": (with_functions(2, lambda u: -u), "is proved"),
    "shares exchanged": (exchanged, "is proved"),
    "starts farther out": (own(starts=[[2, "6 in", "20 in"]]), "no throw leads out"),
    "starts on other places": (own(starts=[[0, "10 in", "11 in"]]), "no throw leads out"),
    "a normal law": (landing({"gaussian": "0.003 in"}), "without a bound"),
    "more noise": (landing({"uniform": "0.4 in"}), "is not proved"),
    # files that are none
    "ends exchanged": (of_average(0, lower=(2.0).hex()), None),
    "another word": (of_average(0, of="jogs"), None),
    "another side": (of_average(1, of={"side": 3}), None),
    "a key too many": (of_average(1, more=1), None),
    "too few numbers": (with_functions(0, lambda u: u[1:]), None),
    "none": (own(averages=[]), None),
    "a function that is not finite": (with_functions(0, lambda u: u * np.inf), None),
}


@pytest.mark.parametrize("name", FORGED)
def test_a_forged_average_is_denied(name, honest, tmp_path):
    require_denied(honest, FORGED[name], tmp_path)


def test_a_function_so_large_that_sums_overflow_proves_nothing(designed):
    """A hostile reader's file: u = -1.8e308 made sums -inf, below any bound."""
    steps = designed.chain.steps
    kept = kept_cells(steps, read_setting(designed.chain.section).noisy.landing)
    for size in (-1.797e308, 1.797e308, 1e200, np.nan):
        _, gained = most_gain(steps, kept, FLIPS, 1.0)(np.full(kept.size, size))
        assert np.isnan(gained).all()
    assert np.isnan(worst(steps, np.full(kept.size, -1e300), nothing(steps), 0.0))


def test_another_function_that_holds_is_as_good(honest, tmp_path):
    forged = opened(honest)
    with_functions(0, lambda u: u + 5.0)(forged)
    narrower(0, "upper", 0.1)(forged)
    assert ls.recheck(forged.seal().write(tmp_path / "other.zip")).verdict == "proved"


def test_without_a_function_flips_are_at_most_what_one_counts(designed):
    """u = 0: a flip from the last side counts 3, and none from the others."""
    steps = designed.chain.steps
    kept = kept_cells(steps, read_setting(designed.chain.section).noisy.landing)
    nodes, gained = most_gain(steps, kept, FLIPS, 1.0)(np.zeros(kept.size))
    last = nodes >= steps.mesh.first[2]
    assert 0.0 <= gained[~last].max() < 1e-9
    assert 3.0 <= gained[last].max() < 3.1
