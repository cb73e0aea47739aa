"""Averages of throws: known numbers, orbits, what the checker encloses of a throw, forged files, scenes without one."""

import functools
import math
import re

import flint
import mpmath
import numpy as np
import pytest
from flint import arb

import limitsets as ls
from limitsets.base import AnswerError, LimitsetsError
from limitsets.checker import orbit_average, throw_average
from limitsets.checker.balls import PRECISION, UnprovedError
from limitsets.checker.claims import average_statement
from limitsets.checker.file import open_certificate
from limitsets.checker.report import read_certificate
from limitsets.checker.scene import read_scene
from limitsets.checker.throw_average import ThrowsOfSide
from limitsets.proofs.prover import averages_of_scene, observables
from limitsets.systems.maps import advance
from tests.proofs.forge import (
    MODELS,
    Plain,
    average_changed,
    end_moved,
    scene,
    section_of_average,
)
from tests.proofs.test_certify import random_scene
from tests.proofs.test_noisy_maps import require_denied


@pytest.fixture(scope="module")
def designed():
    return ls.average("paper-designed")


@pytest.fixture(scope="module")
def coarse():
    """Of fewer cells, which a recheck is through with sooner."""
    return ls.average("paper-designed", cells=2500)


@pytest.fixture(scope="module")
def designed_file(coarse, tmp_path_factory):
    return coarse.save(tmp_path_factory.mktemp("average") / "designed.proof.zip", recheck=False)


def between(proof, name):
    assert proof.average is not None, proof.claims[-1].reason
    ((lo, hi),) = proof.average.numbers[name].values()
    return lo, hi


# ---------------------------------------------------------------- numbers

# 6e7 throws in floats, and brackets of an independent search on 32 000 and 128 000 cells, kept to their digits.
KNOWN = {
    "lyapunov": (0.205679, 6e-5),
    "flips_per_throw": (0.319163, 6e-4),
    "share_of_throws_from_side_0": (0.106391, 2e-4),
    "share_of_throws_from_side_1": (0.106391, 2e-4),
    "share_of_throws_from_side_2": (0.787218, 4e-4),
    "mean_jogs_per_visit_of_side_2": (6.399, 0.02),
}


@pytest.mark.parametrize("name", KNOWN)
def test_numbers_of_the_designed_feeder(name, designed):
    known, width = KNOWN[name]
    lo, hi = between(designed, name)
    assert lo < known < hi
    assert hi - lo < width


def test_the_checker_states_what_is_claimed(coarse, designed_file):
    report = ls.recheck(designed_file)
    assert report.verdict == "proved"
    lo, hi = between(coarse, "lyapunov")
    text = "\n".join(report.statement)
    assert f"{lo!r} to {hi!r}: ln |dx'/dx|, whose average is the Lyapunov exponent" in text
    assert "of almost every start in the attracting cells these averages over n steps converge" in text
    lo, hi = between(coarse, "mean_jogs_per_visit_of_side_2")
    # a quotient is rounded by either side on its own
    assert any(
        math.isclose(float(line.split()[0]), lo, rel_tol=1e-15)
        for line in text.splitlines()
        if "quotient of function 9" in line
    )
    assert coarse.average.lo == coarse.average.bounds[0][0]


def test_bounds_of_one_proof_agree(designed):
    """Shares add up to 1, and are made of jogs and flips: so each pair of intervals has to meet."""
    sums = np.sum([between(designed, f"share_of_throws_from_side_{k}") for k in range(3)], axis=0)
    assert sums[0] < 1.0 < sums[1]
    for k in range(3):
        made = np.sum(
            [between(designed, f"{word}_per_throw_on_side_{k}") for word in ("jogs", "flips")], axis=0
        )
        lo, hi = between(designed, f"share_of_throws_from_side_{k}")
        assert max(lo, made[0]) <= min(hi, made[1])


def test_a_share_is_never_below_zero(designed):
    """No part jogs on side 0, which the proof knows to rounding only."""
    lo, hi = between(designed, "jogs_per_throw_on_side_0")
    assert (lo, 0.0 < hi < 1e-11) == (0.0, True)


def test_a_quotient_by_what_may_be_zero_is_left_out(monkeypatch):
    def flips_by_jogs(sides):
        one, other = observables.OF_THROWS["jogs_per_visit"](sides[:1])[0]
        return [other, one], [("flips_by_jogs", 0, 1)]

    monkeypatch.setitem(observables.OF_THROWS, "flips_by_jogs", flips_by_jogs)
    numbers = ls.average("paper-designed", of="flips_by_jogs", cells=1000).average.numbers
    assert list(numbers) == ["flips_per_throw_on_side_0", "jogs_per_throw_on_side_0"]


def test_finer_cells_are_tried_where_there_are_no_weights(monkeypatch):
    monkeypatch.setattr(averages_of_scene, "CELLS", (60, 1500))
    assert "no solution" in reason("paper-initial", of="lyapunov", cells=60)
    proof = ls.average("paper-initial", of="lyapunov")
    lo, hi = between(proof, "lyapunov")
    assert lo < 0.0988 < hi
    assert len(proof.attractions[0].cells) > 1000


def test_ranges_without_a_side_are_of_all_sides_and_may_have_units():
    proof = ls.average(
        "paper-designed", [[(16.0, 18.0)], {2: [("40.64 cm", "45.72 cm")]}, {0: [(16.0, 18.0)]}], cells=1500
    )
    one, other, third = (
        np.array(ends) for by_component in proof.average.numbers.values() for ends in by_component.values()
    )
    assert list(proof.average.numbers) == [
        "share_of_16_to_18",
        "share_of_16_to_18_on_side_2",
        "share_of_16_to_18_on_side_0",
    ]
    assert one.mean() > (other + third).mean() - 0.02 > other.mean() > 0.05  # some throws are from side 1 too


def test_a_constant_slope_is_its_exponent():
    """In the small-angle flight dx'/dx = 1 - 2 h/kappa everywhere."""
    given = ls.load("paper-designed-small-angle").text
    h, kappa = (
        mpmath.mpf(text.split()[0]) for text in (given["arm"]["surface_height"], given["throw"]["kappa"])
    )
    lo, hi = between(ls.average("paper-designed-small-angle", of="lyapunov"), "lyapunov")
    assert lo < float(mpmath.log(1 - 2 * h / kappa)) < hi
    assert hi - lo < 1e-12


def orbits(throw, counts=(400, 2000), seed=3):
    """Throws of many orbits from random places, after the first: places, sides and codes, by throw."""
    random = np.random.default_rng(seed)
    x = random.uniform(0.4, 0.7, counts[0]) * throw.arm_length
    side = random.integers(0, 3, counts[0])
    for k in range(counts[1] + 300):
        after, turned, code, _ = advance(throw, x, side, 1)
        assert (code >= 0).all()
        if k >= 300:
            yield x, side, code
        x, side = after, turned


def sampled(throw):
    """Flips, throws from side 1, and mean x, by orbit; their means and standard errors."""
    sums, count = np.zeros((3, 400)), 0
    for x, side, code in orbits(throw):
        sums, count = sums + np.array([code == 1, side == 1, x]), count + 1
    means = sums / count
    return means.mean(axis=1), means.std(axis=1) / math.sqrt(means.shape[1])


def place(x):
    return x


SEEDS = [0, 1, *(pytest.param(k, marks=pytest.mark.sweep) for k in (2, 3, 4))]
SEEDS += [pytest.param(k, marks=pytest.mark.repeats) for k in range(5, 20)]


@pytest.mark.parametrize("seed", SEEDS)
def test_orbits_lie_inside(seed):
    """A feeder near one of the paper: what its orbits do on average lies in the bounds."""
    random = np.random.default_rng(seed)
    nominal = ls.load(["paper-designed", "paper-initial"][seed % 2])
    kappa = float(nominal.text["throw"]["kappa"].split()[0]) * random.uniform(0.98, 1.02)
    height = float(nominal.text["arm"]["surface_height"].split()[0]) * random.uniform(0.7, 1.5)
    own = nominal.with_values({"throw.kappa": f"{kappa:.6f} in", "arm.surface_height": f"{height:.6f} in"})
    proof = ls.average(own, of=["flips_per_throw", "side_shares", place])
    means, errors = sampled(own.map)
    for name, mean, error in zip(
        ("flips_per_throw", "share_of_throws_from_side_1", "place"), means, errors, strict=True
    ):
        lo, hi = between(proof, name)
        assert lo - 6.0 * error < mean < hi + 6.0 * error, name
        assert hi - lo < (0.02 if name != "place" else 0.2)


def test_a_share_of_places_and_a_function(designed):
    proof = ls.average("paper-designed", of=[{2: [(20.0, 40.0)]}, lambda x: x * x, "lyapunov"], cells=2000)
    throw, counted = ls.load("paper-designed").map, []
    for x, side, _ in orbits(throw):
        counted.append([((side == 2) & (x > 20.0)).mean(), (x * x).mean()])
    means = np.mean(counted, axis=0)
    for name, mean in zip(("share_of_20_to_40_on_side_2", "function"), means, strict=True):
        lo, hi = between(proof, name)
        assert lo - 2e-3 * mean < mean < hi + 2e-3 * mean
    # beyond the critical point of side 2 the part flips, and nowhere else
    lo, hi = between(proof, "share_of_20_to_40_on_side_2")
    flips = between(designed, "flips_per_throw_on_side_2")
    assert lo < flips[1]
    assert flips[0] < hi


# ---------------------------------------------------------------- what is enclosed of a throw


@pytest.fixture(autouse=True)
def as_precise_as_the_checker(monkeypatch):
    monkeypatch.setattr(flint.ctx, "prec", PRECISION)


@functools.lru_cache
def pair(model, flip=""):
    """The checker's scene of a model, and the plain producer's, which shares no code with it."""
    data = scene(model)
    data["model"]["flip"] = flip or data["model"]["flip"]
    return read_scene(data, None), Plain(data)


def test_the_second_small_angle_flight_lands_earlier():
    """phi = 2 (R - a)/(kappa - d), so dx'/dx = 1 - 2 h/(kappa - d) and x' = x - h phi."""
    data = scene("small")
    data["model"] = {"flight": "small-angle-2", "flip": "energy"}
    throws, plain = ThrowsOfSide(read_scene(data, None), 2), Plain(data)
    over = plain.kappa - plain.d[2]
    assert float(throws.angle(arb(20.0)).mid()) == pytest.approx(2.0 * (20.0 - plain.a[2]) / over)
    slope, second = throws.slopes(throws.angle(arb(20.0)))
    assert (float(slope.mid()), second == 0) == (pytest.approx(1.0 - 2.0 * plain.h / over), True)


@pytest.mark.parametrize("model", MODELS)
def test_slopes_and_images_of_a_throw(model):
    checked, plain = pair(model)
    for side in range(3):
        throws = ThrowsOfSide(checked, side)
        for at in np.linspace(plain.a[side] + 3.0, 0.9 * plain.arm, 9):
            middle, half = float(at), 2.0**-7
            around = np.array([middle + t * half for t in (-1.0, -0.5, 0.0, 0.5, 1.0)])
            angles = throws.angles((middle - half, middle + half))
            slope, second = throws.slopes(angles)
            exact = plain.slope(side, around, plain.kappa)
            assert all(slope.overlaps(arb(float(value), 1e-7)) for value in exact)
            assert float(slope.rad()) < 0.05
            step = 1e-3
            by_place = (
                plain.jog(side, around + step, plain.kappa)
                - 2 * plain.jog(side, around, plain.kappa)
                + plain.jog(side, around - step, plain.kappa)
            ) / step**2
            assert all(second.overlaps(arb(float(value), 1e-6)) for value in by_place)
            one = throws.slopes(throws.angle(arb(middle)))[1]
            assert float(one.rad()) < 1e-12
            assert abs(float(one.mid()) - by_place[2]) < 1e-6
            for branch, image in enumerate((plain.jog, plain.flip)):
                at_start = image(side, np.array([middle]), plain.kappa)[0]
                assert abs(float(throws.image(middle, branch).mid()) - at_start) < 1e-11


@pytest.mark.parametrize("model", MODELS)
def test_what_is_enclosed_of_a_cell(model):
    """Least slope, bend and images over a cell that is wide, by plain floats at many places of it."""
    checked, plain = pair(model)
    for side in range(3):
        throws = ThrowsOfSide(checked, side)
        for first in np.linspace(plain.a[side] + 3.0, 0.8 * plain.arm, 5).tolist():
            ends, places = (first, first + 0.25), np.linspace(first, first + 0.25, 101)
            try:
                listed = throws.cell(
                    1, ends, [lambda at: (float(at.slope().mid()), *at.ends, at.branch, at.side)]
                )
            except UnprovedError:  # the slope may have no sign there
                assert np.abs(plain.slope(side, places, plain.kappa)).min() < 0.05
                continue
            least, bend, low, high, off = listed.numbers
            slopes = np.abs(plain.slope(side, places, plain.kappa))
            assert slopes.min() - 0.02 < least < slopes.min() + 1e-6
            second = np.abs(np.diff(slopes)).max() / (places[1] - places[0])
            assert second / slopes.max() ** 2 - 1e-5 < bend < second / slopes.min() ** 2 + 0.1
            images = plain.flip(side, np.array(ends), plain.kappa)
            assert (low, high) == pytest.approx(sorted(images), abs=1e-11)
            assert 0.0 < off < 1e-13
            ((slope, *at),) = listed.functions
            assert slope == pytest.approx(slopes[50], abs=1e-6)
            assert at == [*ends, 1, side]


@pytest.mark.parametrize("flip", ["signed", "energy"])
@pytest.mark.parametrize("model", MODELS)
def test_which_branch_lies_below_a_change(model, flip):
    """The excess of energy rises or falls with x as in plain floats; right of the vertex energy alone always flips."""
    checked, plain = pair(model, flip)
    seen = 0
    for side in range(3):
        throws = ThrowsOfSide(checked, side)
        for x in np.linspace(plain.a[side] + 2.0, 0.9 * plain.arm, 24).tolist():
            ends = (x, x + 2.0**-8)
            angle = plain.phi(side, np.array(ends), plain.kappa)
            beyond = plain.exact and (plain.a[side] * np.cos(angle) < plain.d[side] * np.sin(angle)).all()
            if beyond and flip == "energy":
                with pytest.raises(UnprovedError, match=r"left of the vertex"):
                    throws.way(1, ends)
                continue
            try:
                way = throws.way(1, ends)
            except UnprovedError:  # the angle is large, or the excess may turn
                continue
            values = plain.decision(side, np.array(ends), plain.kappa)
            assert way == int(values[1] > values[0]) == 1 - throws.way(0, ends)
            seen += 1
    assert seen > 20


def test_the_excess_falls_where_a_fast_part_turns_backwards():
    """In the small-angle flight, signed, its slope is a (2 - |om|), below 0 where om < -2."""
    checked, plain = pair("small", "signed")
    throws, momentum = ThrowsOfSide(checked, 2), plain.rho**2 + plain.ell[2] ** 2
    far = (3 * momentum + plain.a[2] ** 2 + plain.d[2] * plain.h) / plain.a[2]  # om = -2
    assert far + 2 < plain.arm
    assert (throws.way(1, (far - 1.0, far - 0.99)), throws.way(1, (far + 1.0, far + 1.01))) == (1, 0)


@pytest.mark.parametrize("off", [1e-9, -0.3, math.nan])
def test_an_angle_that_is_guessed_badly_is_refused(off, monkeypatch):
    throws = ThrowsOfSide(pair("designed")[0], 2)
    exact = float(throws.angle(arb(20.0)))
    monkeypatch.setattr(throw_average, "guess_root", lambda *_: exact + off)
    with pytest.raises(UnprovedError, match="the impact is not bracketed"):
        throws.angle(arb(20.0))


def test_an_undecided_cell_where_the_excess_may_turn_is_refused():
    throws = ThrowsOfSide(pair("designed")[0], 2)
    with pytest.raises(UnprovedError, match="one change of branch at most is not proved"):
        throws.way(0, (9.0, 27.0))
    with pytest.raises(UnprovedError, match="within a turn"):
        throws.slopes(arb(6.4))


# ---------------------------------------------------------------- forged


def scene_of(forged):
    return forged.header["boxes"][0]["scene"]


def as_interval(forged):
    throw = scene_of(forged)["throw"]
    throw["kappa"] = [throw["kappa"], throw["kappa"]]


def exchanged(forged):
    one, other = section_of_average(forged)["functions"][1:3]
    one["of"], other["of"] = other["of"], one["of"]


def everywhere_open(forged):
    """Both branches are possible on all attracting cells, each with targets of its own component."""
    branch, own = forged.arrays["0.branch"], forged.arrays["0.component"] == 0
    start = np.concatenate([[0], np.cumsum([len(forged.arrays[f"0.edges.{k}"]) - 1 for k in range(3)])])
    side = np.searchsorted(start, np.arange(own.size), side="right") - 1
    branch[own] = 2
    for word, turn in (("jog", 0), ("flip", 1)):
        for k in range(3):
            to = (k + turn) % 3
            cells = np.flatnonzero(own[start[to] : start[to + 1]]) + start[to]
            forged.arrays[f"0.{word}"][own & (side == k)] = cells[0], cells[-1]


def in_function(k, **more):
    """Change a function's keys."""
    return lambda f: section_of_average(f)["functions"][k].update(more)


CAVITY = {"position": "22 in", "width": "9 in", "depth": "9 in", "angle": "20 deg"}
FORGED = {
    "a narrower upper end": (end_moved(0, "upper", -0.3), "upper end of the average is not proved"),
    "a narrower lower end": (end_moved(4, "lower", 0.3), "lower end of the average is not proved"),
    "functions exchanged": (exchanged, "function 1: "),
    "no weights": (average_changed("weight", lambda w: 0.0 * w), "weight is not between"),
    "smaller weights": (average_changed("weight", lambda w: 0.9 * w), "weight is smaller"),
    "columns exchanged": (average_changed("upper", lambda u: u[:, ::-1]), "function 0: "),
    "runs that are too long": (average_changed("runs", lambda r: r + 5000), "a run beside it"),
    "no runs": (average_changed("runs", lambda r: r[:0]), "no runs beside it"),
    "all cells undecided": (everywhere_open, "more than 2048 cells"),
    "noise": (lambda f: f.header.update(noise={"landing.x": "0.001 in"}), "it is about one scene"),
    "one more run": (average_changed("runs", lambda r: np.concatenate([r, r])), "runs beside no undecided cell"),
    "numbers that overflow": (average_changed("upper", lambda u: u + 1e300), "u are not between"),
    "an interval of a quantity": (as_interval, "nor with a tolerance or an interval"),
    "a cavity before the cells end": (
        lambda f: scene_of(f).update(cavity=CAVITY), "where parts fall into the cavity",
    ),
    "a component without cells": (
        lambda f: section_of_average(f).update(components=[3]), "component 3 has no cells",
    ),
    # files that are none
    "no function": (lambda f: section_of_average(f).update(functions=[]), None),
    "a quotient of a function that is none": (lambda f: section_of_average(f).update(quotients=[[0, 99]]), None),
    "a quotient by what may be 0": (lambda f: section_of_average(f).update(quotients=[[0, 5]]), None),
    "a step on a branch that is none": (in_function(1, of={"steps": [[0, 2]]}), None),
    "a step on a side that is none": (in_function(1, of={"steps": [[3, 0]]}), None),
    "a parameter in a formula": (in_function(1, of={"formula": {"ops": [["p", "b"]], "out": [0]}}), None),
    "ends that do not ascend": (in_function(10, upper=[(0.0).hex()]), None),
    "an end that is too large": (in_function(0, upper=[(2.0**1000).hex()]), None),
    "too few columns": (average_changed("upper", lambda u: u[:, 1:]), None),
    "an array too many": (lambda f: f.arrays.update({"0.average.more": np.zeros(3)}), None),
}  # fmt: skip


@pytest.mark.parametrize("name", FORGED)
def test_a_forged_average_is_denied(name, designed_file, tmp_path):
    require_denied(designed_file, FORGED[name], tmp_path)


def test_an_image_may_not_meet_too_many_cells(designed_file, monkeypatch):
    """Of a forged file with one image over all cells a recheck would not end."""
    monkeypatch.setattr(orbit_average, "MOST_MET", 2)
    assert "an image meets more than 2 cells" in ls.recheck(designed_file).reason


def test_a_claim_of_one_component_of_two_says_where_that_lies(designed_file):
    """A file may leave a component out, as that of a sink: its numbers are not those of all attracting cells."""
    claimed = read_certificate(*open_certificate(designed_file)).claims["average"]
    assert "every start in the attracting cells these averages" in average_statement(claimed, False)
    claimed["cells"].component[0] = 1
    assert "every start in component 0 (side 0: [15.1" in average_statement(claimed, False)


# ---------------------------------------------------------------- no answer


def reason(scene, **how):
    proof = ls.average(scene, **how)
    claim = proof.claims[-1]
    assert (proof.average, claim.claim, claim.verdict) == (None, "average", "undecided")
    return claim.reason


def test_scenes_without_an_average_say_why():
    assert "effects beyond the minimal model" in reason("paper-quadrilateral")
    spread = {"world": {"scatter": {"speed": "0.1 %"}}, "effects": {"spread": "bounded"}}
    assert "a spread" in reason(ls.load(ls.load("paper-designed").as_dict() | spread))
    resting = random_scene(np.random.default_rng(4), "exact", "signed")
    assert re.search("no attracting|no solution", reason(resting, cells=500))


REFUSED = [
    ("flips_per_throws", "did you mean 'flips_per_throw'"),
    ({7: [(8.0, 9.0)]}, "allowed: 0, 1, 2"),
    ({2: [(60.0, 70.0)]}, "where states of side 2 lie"),
    ([(60.0, 70.0)], "where states of side 0 lie"),
    ([("10 kg", "20 kg")], "kg"),
    ("mean", "side_shares"),
    (["lyapunov", 3.0], "a function of x"),
    ([(2.0, 1.0)], "the lower one first"),
]


def test_what_is_no_average_of_a_scene_is_refused():
    for of, allowed in REFUSED:
        with pytest.raises(LimitsetsError, match=allowed):
            ls.average("paper-designed", of=of)
    with pytest.raises(AnswerError, match="the cells of an average"):
        ls.average("paper-designed", cells=0)
    with pytest.raises(AnswerError, match="upper of average"):
        ls.average("paper-designed", upper=2.0)
    with pytest.raises(AnswerError, match="cells of average"):
        ls.average(ls.maps.Doubling(2.0), ls.grid([(0.0, 1.0)], cells=8), cells=8)
    with pytest.raises(AnswerError, match="a scene, or a map of a line"):
        ls.average(3.0)
