"""Margins of maps: brackets against values on paper, one file with what is proved and what is refuted."""

import itertools
import math

import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError

STARTS, ENDS = [[(0.02, 2.6)]], [[(0.35, 1.65)]]


def ricker(x, r):
    return x * math.exp(r * (1.0 - x))


def affine(x, slope, shift):
    return slope * x + shift


def line(lo, hi, cells):
    return ls.grid([(lo, hi)], cells=cells)


# The map, its grid, parameter, ends and starts; how far the goal can be proved on cells, and from where it fails.
CASES = {
    # the 2-cycle x, 2 - x has x = 0.35 where r (1 - x) = ln((2 - x)/x); the top e^(r - 1)/r leaves the ends before,
    # at r = 2.35902, and beyond no set of cells in the ends stays there
    "ricker": (ls.map(ricker, r=2.33), line(0.02, 2.6, 2000), "r", ENDS, STARTS,
               0.02903, math.log(1.65 / 0.35) / 0.65 - 2.33, "more"),
    # the fixed point is 2 shift, and beyond 1.1 for shifts above 0.55; below 0.85 for those under 0.425
    "affine": (ls.map(affine, slope=0.5, shift=0.5), line(-1.0, 3.0, 8000), "shift", [[(0.85, 1.1)]], [[(-0.5, 2.5)]],
               0.05, 0.05, "more"),
    "less": (ls.map(affine, slope=0.5, shift=0.5), line(-1.0, 3.0, 8000), "shift", [[(0.95, 1.4)]], [[(-0.5, 2.5)]],
             0.025, 0.025, "less"),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_a_margin_is_proved_below_and_refuted_above_in_one_file(name, tmp_path):
    lower, grid, parameter, ends, starts, most, least, direction = CASES[name]
    (margin,) = ls.margin(lower, grid, parameter, ends=ends, starts=starts, width=0.03)
    assert 0.9 * most < margin.proved <= most
    assert least <= margin.refuted < 1.03 * least
    assert margin.direction == direction
    assert margin.closed is (not margin.reason) is (name != "ricker")
    report = ls.recheck(margin.save(tmp_path / "margin.proof.zip"))
    assert report.verdict == "proved"
    boxes = report.map["boxes"]
    assert [box["verdict"] for box in boxes] == ["proved"] * len(margin.pieces) + ["refuted"]
    # the ranges cover the whole margin, and the refuted value is where it says
    spans = sorted((getattr(each.map, parameter), getattr(each.upper, parameter)) for each in margin.pieces)
    nominal = getattr(lower, parameter)
    assert spans[0][0] <= nominal - margin.proved + 1e-12
    assert spans[-1][1] >= nominal + margin.proved - 1e-12
    assert margin.interval == (spans[0][0], spans[-1][1])
    assert all(one[1] == other[0] for one, other in itertools.pairwise(spans))
    sign = 1 if direction == "more" else -1
    assert getattr(margin.against.map, parameter) == pytest.approx(nominal + sign * margin.refuted, abs=1e-12)


def test_a_goal_that_fails_or_is_open_has_no_margin(tmp_path):
    (failing,) = ls.margin(ls.map(ricker, r=2.5), line(0.02, 2.6, 1000), "r", ends=ENDS, starts=STARTS)
    assert (failing.proved, failing.refuted, failing.holds) == (0.0, 0.0, False)
    assert "a cycle of period 2 attracts" in failing.reason
    assert ls.recheck(failing.save(tmp_path / "failing.zip")).verdict == "refuted"
    (coarse,) = ls.margin(ls.map(ricker, r=2.37), line(0.02, 2.6, 1000), "r", ends=ENDS, starts=STARTS)
    assert (coarse.proved, coarse.refuted) == (0.0, None)
    with pytest.raises(AnswerError, match="neither proved nor refuted"):
        coarse.save(tmp_path / "open.zip")


@pytest.mark.parametrize(
    ("given", "how", "words"),
    [
        (("r",), {}, "the argument ends of margin"),
        (("q",), {"ends": ENDS}, "the parameter is 'q'; allowed: r"),
        (("r",), {"ends": ENDS, "width": 2.0}, "the width"),
        (("r",), {"ends": ENDS, "reading": "fixed"}, "the argument reading of margin"),
    ],
)
def test_what_cannot_be_asked_of_a_map(given, how, words):
    with pytest.raises(AnswerError) as error:
        ls.margin(ls.map(ricker, r=2.33), line(0.02, 2.6, 100), *given, **how)
    assert words in str(error.value)


def test_ends_are_for_maps():
    with pytest.raises(AnswerError, match="the argument ends of margin"):
        ls.margin("paper-designed", "throw.speed", ends=ENDS)
