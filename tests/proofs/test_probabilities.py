"""The claim `probabilities`: the checker's brackets against a chain solved by hand and against throws; forgeries.

The certificates are put together here, not by the package.
"""

import sys
from fractions import Fraction
from types import SimpleNamespace

import flint
import numpy as np
import pytest
from scipy import stats

import limitsets as ls
from limitsets.feeder.scattering import Gaussian, Scattering, Uniform
from limitsets.parameters.noise.sampling import ManyParts, scattering_map
from limitsets.proofs.chances.absorption import absorption_brackets
from limitsets.proofs.prover.certificate import DeniedError
from tests.closed_forms import ladder
from tests.proofs import forge
from tests.proofs.forge import put
from tests.proofs.test_recheck import checker, verdict

pytestmark = pytest.mark.usefixtures("precision")

CLOSE = 1e-8
# a of the three sides, from the table of the paper's scenes, to five places: nodes begin before them
FEET = {"small": (1.74394, 1.65101, 4.41796), "initial": (1.37302, 3.05205, 3.98670)}


def mesh(model, steps, special):
    """Nodes by side: even ones, and close ones where functions jump."""
    arm = forge.magnitude(forge.scene(model)["arm"]["length"])
    found = []
    for side, foot in enumerate(FEET[model]):
        ends = [foot - 1e-4, foot + 1e-4, arm - CLOSE, arm]
        some = [x + k * CLOSE for x in special.get(side, ()) for k in (-1, 0, 1)]
        even = [x for x in steps[side] if foot + 1e-3 < x < arm - 1e-3]
        even = [x for x in even if all(abs(x - s) > 2 * CLOSE for s in some)]
        found.append(np.unique(np.array(ends + some + even)))
    return found


def certificate(model, laws, starts, absorbing, edges, within, **more):
    """Put a certificate together; `within`: by name two columns."""
    scene = forge.scene(model)
    section = {
        "scene": scene,
        "laws": {name: law if isinstance(law, dict) else {"uniform": law} for name, law in laws.items()},
        "starts": starts,
        "absorbing": absorbing,
        "strata": 8,
        "names": list(within),
        "quantiles": [],
        "mean": None,
    } | more
    header = forge.alone(scene, "probabilities", section)
    arrays = {f"edges.{side}": each for side, each in enumerate(edges)}
    arrays |= {f"within.{k}": np.asarray(each, dtype=float) for k, each in enumerate(within.values())}
    return forge.Forged(header, arrays).seal()


AT = ("claims", 0, "section")


def section_of(forged):
    return forged.header["claims"][0]["section"]


# ------------------------------------------------------------------------------------------------- solved by hand


EXACT = ladder((4.4179581, 1.0 + 2.0 / 48.6228609), (15.0, 16.0), 0.05, 18.0, 7)
"""P(x_n >= 18 in) of the small-angle scene where every landing scatters by 0.05 in."""


def by_hand(off=0.0):
    """The ladder's certificate, its brackets 0.002 wide and off by so much."""
    said = np.stack([EXACT - 1e-3 + off, EXACT + 1e-3 + off], axis=1)
    steps = [np.linspace(2, 40, 20), np.linspace(2, 40, 20), np.linspace(14.5, 18.5, 1200)]
    starts, places = [[2, "15 in", "16 in"]], {"right": [[2, "18 in", None]]}
    edges = mesh("small", steps, {2: [18.0]})
    return certificate("small", {"landing.x": "0.05 in"}, starts, places, edges, {"right": said})


def test_a_chain_solved_by_hand_is_proved(tmp_path):
    assert 0.1 < EXACT[5] < 0.9
    report = verdict(by_hand(), tmp_path)
    assert (report.verdict, report.reason) == ("proved", "")
    assert report.parameters["law of landing.x"] == "uniform, within 0.05 in"
    assert any("right: side 2 from 18.0 to 40.0 in" in line for line in report.statement)


@pytest.mark.parametrize("off", [2e-3, -2e-3])
def test_a_probability_raised_or_lowered_is_not_proved(tmp_path, off):
    report = verdict(by_hand(off), tmp_path)
    assert report.verdict == "failed"
    assert "is claimed" in report.reason


# ------------------------------------------------------------------------------------------------- throws

THROWS, PARTS = 10, 200_000
LAWS = {"landing.x": "0.2 in", "throw.speed": "1 %"}
SPANS = [(0, 6.0, 20.0), (1, 6.0, 20.0), (2, 6.0, 20.0)]


@pytest.fixture(scope="module")
def thrown():
    """Counts of 200 000 parts of paper-initial that ended right and wrong within n throws, and their throws."""
    scene, random = ls.load("paper-initial"), np.random.default_rng(2)
    scatter = Scattering(speed=Uniform(0.01), landing=Uniform(0.2))
    side = random.integers(0, 3, PARTS)
    many = ManyParts(scattering_map(scene, scatter, 7), random.uniform(6.0, 20.0, PARTS), side)
    right, wrong, times = np.zeros(THROWS + 1, int), np.zeros(THROWS + 1, int), []
    for n in range(1, 200):
        code = many.throw()
        far = (many.x >= 20.0) & (code >= 0)
        there = far & (many.side == 2)
        if n <= THROWS:
            right[n:] += int(there.sum())
            wrong[n:] += int((far & ~there).sum())
        times.append(np.full(int((far | (code < 0)).sum()), n))
        many.keep(~far & (code >= 0))
    times.append(np.full(many.x.size, 200))
    return right, wrong, np.concatenate(times)


def interval(count):
    """Clopper and Pearson, 99.99 %."""
    low = stats.beta.ppf(0.5e-4, count, PARTS - count + 1)
    high = stats.beta.ppf(1.0 - 0.5e-4, count + 1, PARTS - count)
    return np.nan_to_num(low, nan=0.0), np.nan_to_num(high, nan=1.0)


def noisy(within=None, **more):
    """A certificate of paper-initial, of which nothing is said by default."""
    nothing = np.tile([0.0, 1.0], (THROWS + 1, 1))
    # parts that are past 20 have ended
    steps = [np.append(np.linspace(1, 20.2, 498), np.linspace(20.5, 28, 9))] * 3
    return certificate(
        "initial",
        LAWS,
        [[side, f"{lo} in", f"{hi} in"] for side, lo, hi in SPANS],
        {"right": [[2, "20 in", None]], "wrong": [[0, "20 in", None], [1, "20 in", None]]},
        mesh("initial", steps, {side: [20.0] for side in range(3)}),
        within or {"right": nothing, "wrong": nothing, "any": nothing},
        **more,
    )


def entries_of(forged, tmp_path):
    path = forged.write(tmp_path / "x.proof.zip")
    return checker.report.open_certificate(path)


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """The certificate that claims what the checker finds, and no more."""
    with flint.ctx.workprec(checker.balls.PRECISION):
        module, absorption = (
            sys.modules[f"{checker.__name__}.{name}"] for name in ("brackets", "absorption")
        )
        claim = module.read_chances(*entries_of(noisy(), tmp_path_factory.mktemp("probabilities")))
        chain, row = module.chain_on(claim.setting, claim.edges, lambda more: None)
        found = {
            name: absorption.brackets_of(chain, row, name, len(said))[0]
            for name, said in claim.absorption.within.items()
        }
    quantiles = [["any", "50 %", *median_of(found["any"])]]
    return noisy(found, quantiles=quantiles, mean=[(12.2).hex(), (12.4).hex()])


def median_of(pair):
    return int(np.flatnonzero(pair[:, 1] >= 0.5)[0]), int(np.flatnonzero(pair[:, 0] >= 0.5)[0])


@pytest.fixture
def fewer_steps(monkeypatch):
    """For the bounds of a mean: enough for what is true, and soon at their end for what is false."""
    monkeypatch.setattr(sys.modules[f"{checker.__name__}.horizon"], "MOST_MEAN", 1000)


@pytest.mark.sweep
@pytest.mark.usefixtures("fewer_steps")
def test_brackets_of_the_checker_hold_what_is_thrown(good, thrown, tmp_path):
    right, wrong, times = thrown
    claimed = {name: good.arrays[f"within.{k}"] for k, name in enumerate(section_of(good)["names"])}
    for name, counts in (("right", right), ("wrong", wrong)):
        low, high = interval(counts)
        assert (low <= claimed[name][:, 1]).all()
        assert (high >= claimed[name][:, 0]).all()
        assert (claimed[name][:, 1] - claimed[name][:, 0]).max() < 0.02
    assert claimed["any"][0].max() < 1e-8
    _, _, lo, hi = section_of(good)["quantiles"][0]
    assert lo <= np.median(times) <= hi
    assert 12.2 < times.mean() < 12.4  # its standard error is 0.02
    report = verdict(good, tmp_path)
    assert (report.verdict, report.reason) == ("proved", "")


def test_a_hard_cell_is_compared_with_the_first_node_that_is_thrown_from():
    """The node on its right; else one of the next three, nearer than a landing may be off; else that on its right."""
    links = sys.modules[f"{checker.__name__}.links"].Links
    side = SimpleNamespace(x=[0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7], at_cut={1, 3, 6}, e=0.25)
    assert [links.next_thrown(side, cell) for cell in range(7)] == [1, 3, 3, 4, 6, 6, 7]


def test_bounds_of_a_step_are_not_below_the_exact_sums():
    """A step with nothing but a mean, or a hard cell: the sum of two numbers, which floats round either way."""
    modules = (sys.modules[f"{checker.__name__}.{name}"] for name in ("steps", "means"))
    (steps, means), generator = modules, np.random.default_rng(5)
    none = np.zeros(0, np.int64)
    for most, mean, more in generator.uniform(0.0, 1.0, (30, 3)):
        step = SimpleNamespace(
            mesh=means.Mesh(np.arange(4.0), np.array([0, 4])),
            scatter=None,
            narrow=means.NARROW,
            beyond=0.0,
            rows=SimpleNamespace(times=lambda values: np.full(4, mean), off=np.zeros(4)),  # noqa: B023  # called here
            nodes=SimpleNamespace(
                at=none,
                much=np.zeros(0),
                varied=np.zeros(0),
                steep=np.zeros(0),
                ends=lambda g: (np.zeros(0), np.zeros(0)),
                variation=lambda g: np.zeros(0),
                steepest=lambda g: np.zeros(0),
            ),
            deficits=lambda g: np.zeros(4),
            cells=SimpleNamespace(at=np.array([0]), ends=lambda g: (np.zeros(1), np.full(1, np.inf))),
            hard=SimpleNamespace(
                at=np.array([2]),
                steep=np.array([np.inf]),
                ends=lambda g: (np.zeros(1), np.array([most])),  # noqa: B023  # called here
                steepest=lambda g: np.zeros(1),
            ),
            live=np.array([0]),
            beside=np.array([0]),
        )
        bounds = steps.Chain.above(step, np.ones(4), np.full(4, -np.inf), more)
        exact = [Fraction(mean) + Fraction(more)] * 2 + [Fraction(most) + Fraction(more)] * 2
        assert all(Fraction(bound) >= sum_ for bound, sum_ in zip(bounds.tolist(), exact, strict=True))
        assert bounds.tolist() == pytest.approx([float(sum_) for sum_ in exact], abs=1e-14)


# ------------------------------------------------------------------------------------------------- forgeries


def moved(name, column, by):
    """Move a column of brackets from some throw on, where there is room."""

    def change(forged):
        forged.arrays[name][3:, column] += by

    return change


def quantile_of(by):
    """Say that the median is one throw less, or one more."""

    def change(forged):
        row = section_of(forged)["quantiles"][0]
        row[2:] = [0, row[2] - 1] if by < 0 else [row[3] + 1, row[3] + 1]

    return change


def without_edges(forged):
    """A lying mesh: every other node is left out."""
    for side in range(3):
        forged.arrays[f"edges.{side}"] = forged.arrays[f"edges.{side}"][::2].copy()
        forged.arrays[f"edges.{side}"][-1] = 28.0


def shifted(forged):
    """Brackets of n throws said of n + 1."""
    rows = forged.arrays["within.0"]
    forged.arrays["within.0"] = np.concatenate([rows[:1], rows[:-1]])


FALSE = {
    "landing narrower": put(*AT, "laws", "landing.x", "uniform", "0.1 in"),
    "speed narrower": put(*AT, "laws", "throw.speed", "uniform", "0.2 %"),
    "start law moved": put(*AT, "starts", 0, 1, "10 in"),
    "a start dropped": lambda forged: section_of(forged)["starts"].pop(),
    "nodes dropped": without_edges,
    "P lower end raised": moved("within.0", 0, 0.02),
    "P upper end lowered": moved("within.0", 1, -0.02),
    "quantile lowered": quantile_of(-1),
    "quantile raised": quantile_of(1),
    "share raised": put(*AT, "quantiles", 0, 1, "99 %"),
    "mean raised": put(*AT, "mean", [(12.35).hex(), None]),
    "mean bounded": put(*AT, "mean", [(12.0).hex(), (12.2).hex()]),
    "X moved": put(*AT, "absorbing", "right", 0, 1, "19 in"),
    "sides swapped": lambda f: [
        put(*AT, "absorbing", word, 0, 0, side)(f) for word, side in (("right", 0), ("wrong", 2))
    ],
    "names swapped": put(*AT, "names", ["wrong", "right", "any"]),
    "n shifted": shifted,
    "kappa changed": put(*AT, "scene", "throw", "kappa", "30 in"),
    "strata few": put(*AT, "strata", 1),
}


@pytest.mark.sweep
@pytest.mark.usefixtures("fewer_steps")
@pytest.mark.parametrize("name", FALSE)
def test_what_has_become_false_is_not_proved(good, tmp_path, name):
    forged = good.copy()
    FALSE[name](forged)
    report = verdict(forged.seal(), tmp_path)
    assert report.verdict == "failed", report.reason
    assert report.reason.startswith("probabilities: ")


CAVITY = {"position": "15 in", "width": "6 in", "depth": "3 in", "angle": "60 deg"}
ODD = {
    "uniform and gaussian laws only": put(*AT, "laws", "landing.x", {"cauchy": "0.2 in"}),
    "laws only": put(*AT, "laws", "landing.x", {"uniform": "0.2 in", "gaussian": "0.2 in"}),
    "its number is not a text": put(*AT, "laws", "landing.x", "uniform", ["0.2 in", "0.2 in"]),
    "noise reaches 100": put(*AT, "laws", "throw.speed", {"gaussian": "17 %"}),
    "has a cavity": put(*AT, "scene", "cavity", CAVITY),
    "is not negative": put(*AT, "laws", "landing.x", "uniform", "-0.2 in"),
    "reaches 100": put(*AT, "laws", "throw.speed", "uniform", "120 %"),
    "stretches of starts overlap": put(*AT, "starts", 2, 0, 1),
    "overlap": put(*AT, "absorbing", "wrong", [[2, "21 in", None]]),
    "name no places": put(*AT, "absorbing", "exits", [[2, "10 in", "11 in"]]),
    "names are not": put(*AT, "names", ["right", "elsewhere", "any"]),
    "a place is not one of the arm": put(*AT, "starts", 2, 1, "1 in"),
    "array edges.2 is missing": lambda f: f.arrays.pop("edges.2"),
    "do not span the arm": lambda f: f.arrays.update({"edges.0": f.arrays["edges.0"][10:].copy()}),
    "do not ascend": lambda f: f.arrays.update({"edges.0": f.arrays["edges.0"][::-1].copy()}),
    "strata is not": put(*AT, "strata", 65),
    "kappa > ell": put(*AT, "scene", "throw", "kappa", "3 in"),
    "a quantile is none": put(*AT, "quantiles", 0, 1, "120 %"),
    "bounds of the mean": put(*AT, "mean", [(3.0).hex(), (2.0).hex()]),
    "has no boxes": lambda forged: forged.header.update(noise={"landing.x": "0.2 in"}),
    "claims of probabilities": lambda f: f.header["claims"].append({"claim": "invariant", "section": {}}),
    "different models": lambda forged: forged.header["scene"].update(flip="energy"),
    "not the one the header describes": None,
}


@pytest.mark.parametrize("said", ODD)
def test_what_is_odd_is_refused_in_words(good, tmp_path, said):
    forged = good.copy()
    if ODD[said] is None:
        forged.arrays["within.1"][4, 0] -= 1e-9
    else:
        ODD[said](forged)
        forged.seal()
    report = verdict(forged, tmp_path)
    assert report.verdict == "bad file"
    assert said in report.reason


def test_what_lands_far_beyond_the_arm_has_left_it(tmp_path, monkeypatch):
    """Of a cell of which no branch is known; its parts land beyond 300 in, and scatter by 199 in: none stays."""
    own = forge.scene

    def high(model):
        scene = own(model)
        scene["arm"] = {"surface_height": "-40 in", "length": "99 in"}
        scene["throw"]["kappa"] = "32 in"
        return scene

    monkeypatch.setattr(forge, "scene", high)
    steps = [np.linspace(2.1, 97.9, 100)] * 2 + [np.linspace(4.5, 50.0, 100)]
    places = {"right": [[0, "2 in", None], [1, "2 in", None]]}
    edges = mesh("small", steps, {0: [2.0], 1: [2.0]})
    for most, word in ((1.0, "proved"), (0.97, "failed")):
        said = np.array([[0.0, 1.0], [0.0, most]])
        forged = certificate(
            "small", {"landing.x": "199 in"}, [[2, "90 in", "90.001 in"]], places, edges, {"exits": said}
        )
        assert verdict(forged, tmp_path).verdict == word


# ------------------------------------------------------------------------------------------------- from the package


@pytest.mark.sweep
def test_brackets_are_saved_and_rechecked(tmp_path):
    scatter = Scattering(speed=Uniform(0.005), landing=Uniform(0.2))
    words = {"right": (20.0, 2), "wrong": 20.0, "cells": 150, "throws": 4}
    found = absorption_brackets("paper-initial", scatter, **words)
    low, high = found.mean
    # cells at the joint lead to themselves: only their neighbour's throws bound the mean
    assert low < high < 25
    file = found.save(tmp_path / "initial.proof.zip", recheck=False)
    report, before = ls.recheck(file), file.read_bytes()
    assert (report.verdict, report.claims) == ("proved", [("probabilities", "proved", "")])
    with pytest.raises(DeniedError, match="is claimed"):
        found.save(file, allowance=-0.002)
    assert file.read_bytes() == before
    assert (tmp_path / "initial.denied.zip").exists()


def test_a_scene_in_other_units_has_the_same_brackets():
    inches = ls.load("paper-initial")

    def in_millimetres(each):
        if isinstance(each, dict):
            return {key: in_millimetres(value) for key, value in each.items()}
        if isinstance(each, list):
            return [in_millimetres(value) for value in each]
        number, _, unit = str(each).partition(" ")
        return f"{float(number) * 25.4!r} mm" if unit == "in" else each

    scene = ls.load(in_millimetres(inches.text))
    words = {"cells": 100, "throws": 5, "mean": False}
    pair = [
        absorption_brackets(each, Scattering(landing=Uniform(0.1 * by)), right=(20.0 * by, 2), **words)
        for each, by in ((inches, 1.0), (scene, 25.4))
    ]
    pair = [found.within["right"][:, 5] for found in pair]
    assert pair[0] == pytest.approx(pair[1], abs=1e-6)
    assert scene.unit == "mm"


@pytest.mark.parametrize(
    ("scatter", "said"),
    [
        (Scattering(landing=Gaussian(0.1)), {"landing.x": "normal, with a standard deviation of 0.1 in"}),
        (Scattering(speed=Uniform(0.01)), {"throw.speed": "uniform, within 1 %"}),
        (Scattering(), {}),
    ],
)
def test_every_law_is_saved_and_rechecked(tmp_path, scatter, said):
    found = absorption_brackets("paper-initial", scatter, right=(20.0, 2), cells=60, throws=1, mean=False)
    report = ls.recheck(found.save(tmp_path / "x.proof.zip", recheck=False))
    assert (report.verdict, report.reason) == ("proved", "")
    assert {name: text for name, text in report.parameters.items() if name.startswith("law")} == {
        f"law of {name}": text for name, text in said.items()
    }
