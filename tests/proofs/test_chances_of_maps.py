"""Where orbits of noisy maps end, and when: closed forms, random orbits, forged files."""

from fractions import Fraction

import numpy as np
import pytest
from limitsets.robust import absorption_brackets

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.checker import horizon
from limitsets.checker.laws import uniform_law
from limitsets.checker.map_chances import places_on
from limitsets.checker.noisy_map import mesh_of_map
from tests.proofs.forge import opened
from tests.proofs.test_noisy_maps import half, itself, own, require_denied, section_of


def to_middle(x):
    return 0.5 + 0.0 * x


def to_level(x, p):
    return p + 0.0 * x


def doubled(x, p):
    return p * x


def lower(x):
    return 1.8 * x + 0.1


def upper(x):
    return 1.9 - 1.8 * x


def from_middle(x):
    return x - 0.45


def from_level(x, c):
    return x - c


KNOWN = {  # map, grid, noise, places, starts: P(ever at the place), mean of T, both in closed form
    # from x a step lands in [0, 1] with probability 1/2, evenly, and above 1 with x/4
    "a half and wide noise": (ls.map(half), (0.0, 3.0), 1.0, {"top": [(0, 1.0, 3.0)]}, (0.0, 1.0), 1 / 4, 2.0),
    # the ruin of a player whose stakes are as wide as what he has
    "a walk of one step": (
        ls.map(itself), (-2.0, 3.0), 1.0, {"top": [(0, 1.0, 3.0)], "ruin": [(0, -2.0, 0.0)]}, (0.0, 1.0), 1 / 2, 2.0,
    ),
    # a sixth of all steps lands off the grid, a third at the place
    "every step lands alike": (
        ls.map(to_middle), (-1.0, 1.0), 0.75, {"low": [(0, -0.25, 0.25)]}, (0.3, 0.9), 2 / 3, 2.0,
    ),
    "a parameter that deviates": (
        ls.map(to_level, p=0.5), (-1.0, 1.0), {"p": 0.25}, {"top": [(0, 0.6, 0.8)]}, (-0.5, 0.5), 1.0, 10 / 3,
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", KNOWN)
def test_probabilities_and_times_are_those_in_closed_form(case, tmp_path):
    the_map, ends, noise, places, starts, ever, mean = KNOWN[case]
    grid = ls.grid([ends], cells=400)
    answer = absorption_brackets(
        the_map, grid, noise=noise, absorbing=places, starts=[(0, *starts)], throws=20
    )
    # one of 32 strata of a parameter holds the end of the place, and counts as on it or not
    near = 1.0 / 32.0 if isinstance(noise, dict) else 5e-5
    for (lo, hi), exact in ((answer.ever[next(iter(places))], ever), (answer.mean, mean)):
        assert lo - 1e-9 <= exact <= hi + 1e-9
        assert hi - lo < 2.5 * near * mean**2
    lo, hi = answer.within["any"]
    exact = 1.0 - (1.0 - 1.0 / mean) ** np.arange(21)
    assert ((lo - 1e-9 <= exact) & (exact <= hi + 1e-9) & (hi - lo < 3.0 * near)).all()
    first, last = answer.quantile(0.55)
    assert first <= np.argmax(exact >= 0.55) <= last
    assert "steps" in answer.table().text()
    report = ls.recheck(answer.save(tmp_path / "known.proof.zip", recheck=False))
    assert report.verdict == "proved"


def test_orbits_that_never_end_have_no_mean_and_no_probability_from_below(monkeypatch):
    """From -0.2 to 0.2 no step leads out, and the place lies elsewhere."""
    monkeypatch.setattr(horizon, "MOST_MEAN", 60)
    answer = absorption_brackets(
        ls.map(half), ls.grid([(-1.0, 1.0)], cells=20), noise=0.1, absorbing={"top": [(0, 0.9, 1.0)]},
        starts=[(0, -0.1, 0.1)], throws=5,
    )  # fmt: skip
    assert answer.mean[1] == np.inf
    assert answer.ever == {}
    assert answer.within["top"].max() < 1e-12


def test_the_time_to_leave_a_grid_needs_no_place():
    """From x every step lands off [-1, 1] with probability 1/6; with p from 0.4 to 0.6 with 1/10 to 7/30."""
    grid = ls.grid([(-1.0, 1.0)], cells=100)
    lo, hi = absorption_brackets(ls.map(to_middle), grid, noise=0.75).mean
    assert 6.0 - 1e-4 < lo <= 6.0 <= hi < 6.0 + 1e-4
    corners = [ls.map(to_level, p=p) for p in (0.4, 0.6)]
    lo, hi = absorption_brackets(corners[0], grid, noise=0.75, upper=corners[1]).mean
    assert 4.28 < lo <= 30.0 / 7.0
    assert 10.0 <= hi < 10.01


RANDOM = {
    "two branches": (
        ls.map(pieces=(lower, upper), margin=from_middle), {}, 0.08,
        lambda x, _: np.where(x < 0.45, lower(x), upper(x)),
    ),
    "a border that moves over the end of the place": (
        ls.map(pieces=(lower, upper), margin=from_level, c=0.85),
        {"upper": ls.map(pieces=(lower, upper), margin=from_level, c=0.86)}, 0.08,
        lambda x, rng: np.where(x < rng.uniform(0.85, 0.86, x.size), lower(x), upper(x)),
    ),
    "a range of a parameter, another at every step": (
        ls.map(doubled, p=1.2), {"upper": ls.map(doubled, p=1.25)}, 0.3,
        lambda x, rng: rng.uniform(1.2, 1.25, x.size) * x,
    ),
    "a slope that deviates too": (
        ls.map(doubled, p=-1.1), {}, {"p": 0.2, "landing": 0.15},
        lambda x, rng: rng.uniform(-1.3, -0.9, x.size) * x,
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", RANDOM)
def test_random_orbits_end_within_the_bounds(case):
    the_map, how, noise, image = RANDOM[case]
    place = (0, 0.85, 0.95)
    answer = absorption_brackets(
        the_map, ls.grid([(-0.5, 1.2)], cells=300), noise=noise, absorbing={"hit": [place]},
        starts=[(0, 0.0, 0.5)], throws=10, **how,
    )  # fmt: skip
    rng, count = np.random.default_rng(3), 100_000
    e = noise["landing"] if isinstance(noise, dict) else noise
    x, ended, hit = rng.uniform(0.0, 0.5, count), np.zeros(count, int), np.zeros(count, bool)
    for n in range(1, 600):
        x = image(x, rng) + rng.uniform(-e, e, count)
        on = ended == 0
        hit |= on & (place[1] <= x) & (x <= place[2])
        ended[on & ((x < -0.5) | (x > 1.2) | hit)] = n
        x = np.where(ended > 0, 0.2, x)
        if n == 10:
            some, error = (hit.mean(), (ended > 0).mean()), 5 * 0.5 / np.sqrt(count)
            for name, share in zip(("hit", "any"), some, strict=True):
                lo, hi = answer.within[name][:, -1]
                assert lo - error <= share <= hi + error
        if n > 10 and (ended > 0).all():
            break
    assert (ended > 0).all()
    lo, hi = answer.ever["hit"]
    assert lo - error <= hit.mean() <= hi + error
    lo, hi = answer.mean
    error = 5 * ended.std() / np.sqrt(count)
    assert lo - error <= ended.mean() <= hi + error
    assert hi - lo < (0.4 if how else 0.1) * ended.mean()


def test_on_the_scale_of_atoms_all_that_lands_outside_has_ended():
    """Every first step lands off the grid, by far; places are told apart to 1e-12 only, so that less is proved."""
    answer = absorption_brackets(
        ls.map(to_middle), ls.grid([(-1e-14, 1e-14)], cells=10), noise=9e-15, absorbing={"top": [(0, 5e-15, 1e-14)]},
        starts=[(0, -1e-14, 0.0)], throws=3, mean=False,
    )  # fmt: skip
    for name in ("any", "exits"):
        assert answer.within[name][1, 1] == 1.0


def test_the_cells_beyond_the_domain_are_exits():
    mesh = mesh_of_map([np.array([-0.5, 0.0, 0.4, 1.0, 1.5])], uniform_law(Fraction(1, 2), 1))
    live, absorbed = places_on(mesh, {"top": [(0, Fraction(0.4), Fraction(1))]})
    assert live.tolist() == [2]
    assert absorbed["exits"].tolist() == [0, 1, 2, 4, 5, 6]
    assert absorbed["top"].tolist() == [3, 4]


# ------------------------------------------------------------------------------------------------- certificates


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    answer = absorption_brackets(
        ls.map(half), ls.grid([(0.0, 3.0)], cells=100), noise=1.0, absorbing={"top": [(0, 1.0, 3.0)]},
        starts=[(0, 0.0, 1.0)], throws=4,
    )  # fmt: skip
    return answer.save(tmp_path_factory.mktemp("chances") / "half.proof.zip")


def test_a_saved_answer_is_said_in_words(saved):
    said = ls.recheck(saved).statement[-1]
    for words in (
        "steps land within 1 of f(x), evenly", "domain: [0.0, 3.0]", "top: [1.0, 3.0]",
        "starts, equally likely per length: [0.0, 1.0]", 'P(ever ended "top")', "the mean of T: at least 1.99",
    ):  # fmt: skip
        assert words in said


def test_a_slope_beyond_the_domain_proves_no_mean(tmp_path):
    """A hostile reader's: an orbit goes to and fro between two sides for ever, and its images pass the far node."""
    answer = absorption_brackets(
        ls.map(to_level, p=0.5), ls.grid([(-1.0, 1.0)], cells=20), noise={"p": 0.1}, throws=2, mean=False
    )
    forged = opened(answer.save(tmp_path / "base.proof.zip", recheck=False))
    steep = 2**20
    programs = [
        ([["x", 0], ["c", str(steep)], ["mul", 1, 0], ["c", "0.9375"], ["add", 2, 3]], 1),
        ([["c", repr(7.0 / (128.0 * steep))]], 0),
    ]
    listed = [
        {"side": k, "branch": 0, "to": to, "ops": ops, "out": [len(ops) - 1]}
        for k, (ops, to) in enumerate(programs)
    ]
    forged.header["map"].update(sides=2, periodic=[[None], [None]], programs=listed)
    first, last = np.array([-0.0625, 0.0, 0.0625, 0.125]), np.array([0.875, 63.0 / 64.0, 1.0, 1.0625])
    section_of(forged).update(
        varied={"name": "p", "within": "0.1", "strata": 1}, absorbing={}, names=["any"],
        mean=[(0.0).hex(), (13.0).hex()], starts=[{"side": 1, "box": [[(63.0 / 64.0).hex(), (1.0).hex()]]}],
    )  # fmt: skip
    far = mesh_of_map([first, last], uniform_law(Fraction(0), 1)).place[-1]
    rising = 8.0 + 64.0 * (np.append(last, far) - 0.9375)
    v = np.array([0.0, 0.0, 9.01, rising[-1] + 1.01, 0.0, 0.0, 0.0, *rising])
    forged.arrays = {
        "0.nodes.0": first, "0.nodes.1": last, "0.within.0": np.array([[0.0, 1.0]] * 3), "0.mean.upper": v,
    }  # fmt: skip
    report = ls.recheck(forged.seal().write(tmp_path / "forged.zip"))
    assert (report.verdict, "not constant beyond the domain" in str(report)) == ("failed", True), str(report)


def box(lo, hi):
    return [{"side": 0, "box": [[float(lo).hex(), float(hi).hex()]]}]


def without_node_at_1(forged):
    nodes = forged.arrays["0.nodes.0"]
    at = int(np.searchsorted(nodes, 1.0)) + 1
    forged.arrays["0.nodes.0"] = np.delete(nodes, at - 1)
    for name in [name for name in forged.arrays if ".mean." in name or ".ever." in name]:
        forged.arrays[name] = np.delete(forged.arrays[name], at)


def number(name, at, value):
    return lambda f: f.arrays[f"0.{name}"].__setitem__(at, value)


FORGED = {
    "more noise": (own(landing="1.1"), "is proved"),
    "another place": (own(absorbing={"top": box(2, 3)}), "no nodes"),
    "a place that its nodes do not end": (without_node_at_1, "its ends are no nodes"),
    "a place beyond the domain": (own(absorbing={"top": box(1, 3.5)}), "reaches beyond the domain"),
    "starts beyond the domain": (own(starts=box(-1, 1)), "beyond the domain"),
    "other starts": (own(starts=box(0.5, 1)), "is proved"),
    "a larger probability": (
        lambda f: section_of(f)["ever"][0].__setitem__(slice(1, 3), [(0.3).hex(), (0.4).hex()]), "is proved",
    ),
    "a longer mean": (own(mean=[(2.1).hex(), (3.0).hex()]), "is proved"),
    "a function that is lower at a node": (number("ever.0.upper", 20, 0.0), "upper function is none"),
    "a probability within some steps": (number("within.0", (3, 1), 0.1), "within 3 steps"),
    "a probability from below where nothing says that orbits end": (
        lambda f: section_of(f)["mean"].__setitem__(1, None) or f.arrays.pop("0.mean.upper") is None, "the throws end",
    ),
    "a function with a slope beyond the domain": (number("mean.upper", -1, 9.0), "not constant beyond the domain"),
    # files that are none
    "no noise": (own(landing="0"), None),
    "a key too many": (own(more=1), None),
    "a place that overlaps another": (own(absorbing={"top": box(1, 3), "more": box(2, 3)}), None),
    "starts that count twice": (own(starts=box(0, 1) + box(0.5, 1)), None),
    "a place named as the exits": (own(absorbing={"exits": box(1, 3)}), None),
    "a function of other cells": (lambda f: f.arrays.update({"0.mean.upper": np.ones(7)}), None),
}  # fmt: skip


@pytest.mark.parametrize("case", FORGED)
def test_what_is_forged_is_denied(case, saved, tmp_path):
    require_denied(saved, FORGED[case], tmp_path)


def inverse(x):
    return 1.0 / x


def huge(x):
    return (1e80 * x) ** 4


def turned(x, y):
    return 0.5 * y, 0.5 * x


LINE, TOP = ls.grid([(-1.0, 1.0)], cells=20), {"top": [(0, 0.5, 1.0)]}
REFUSED = {
    "no noise": (half, LINE, {}, r"the noise is 0"),
    "words of a scene": (half, LINE, {"noise": 0.1, "right": (0.5, 0)}, r"right of absorption_brackets"),
    "no grid": (half, None, {"noise": 0.1}, r"the grid of"),
    "a plane": (turned, ls.grid([(-1, 1), (-1, 1)], cells=8), {"noise": 0.1}, r"of a line"),
    "a place off the grid": (half, LINE, {"noise": 0.1, "absorbing": {"a": [(0, 0.5, 2.0)]}}, r"a place is"),
    "a start on no side": (half, LINE, {"noise": 0.1, "starts": [(1, 0.0, 0.5)]}, r"a place is"),
    "a name that is taken": (half, LINE, {"noise": 0.1, "absorbing": {"exits": TOP["top"]}}, r"not taken"),
    "places that overlap": (
        half, LINE, {"noise": 0.1, "absorbing": TOP | {"more": [(0, 0.6, 0.7)]}}, r"two places that absorb overlap",
    ),
    "no start": (half, LINE, {"noise": 0.1, "starts": []}, r"the number of starts is 0"),
    "a start of two numbers": (half, LINE, {"noise": 0.1, "starts": [(0, 0.5)]}, r"starts is"),
    "more steps than a file takes": (half, LINE, {"noise": 0.1, "throws": 2001}, r"0 to 2000"),
    "a name with a blank": (half, LINE, {"noise": 0.1, "absorbing": {"my place": TOP["top"]}}, r"without blanks"),
    "all of the grid": (half, LINE, {"noise": 0.1, "absorbing": {"a": [(0, -1.0, 1.0)]}}, r"no cell from which"),
    "noise that is no number": (half, LINE, {"noise": {"landing": None}}, r"the noise is"),
    "images beyond all numbers": (huge, LINE, {"noise": 0.1}, r"not enclosed"),
    "a pole": (inverse, LINE, {"noise": 0.1, "absorbing": TOP}, r"not enclosed"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_asked_is_told_in_a_line(case):
    f, grid, how, words = REFUSED[case]
    with pytest.raises(AnswerError, match=words):
        absorption_brackets(ls.map(f), grid, **how)


def test_a_map_is_no_argument_of_a_scene():
    with pytest.raises(AnswerError, match="noise of absorption_brackets"):
        absorption_brackets("paper-initial", noise=0.1, right=(20.0, 2))
