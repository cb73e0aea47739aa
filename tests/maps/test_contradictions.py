"""Kernels of a map of one's own that contradict each other: one line each, of the package's family of errors."""

import math
from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets import interval as iv
from limitsets.errors import AnswerError, LimitsetsError, MapError
from limitsets.graph import memory


class Base(NamedTuple):
    slope: float


def made(name, **kernels):
    """Register a class of its own."""
    return ls.register(NamedTuple(name, [("slope", float)]), **kernels)


def tent(params, x, side):
    return (params.slope * x, side, 0) if x < 0.5 else (params.slope * (1.0 - x), side, 1)


def tent_on(params, x, side, branch):
    return (
        (params.slope * x, side, params.slope)
        if branch == 0
        else (params.slope * (1 - x), side, -params.slope)
    )


def tent_box(low, high, lo, hi, side):
    one, two = (
        iv.mul((low.slope, high.slope), (lo, hi)),
        iv.mul((low.slope, high.slope), iv.sub((1.0, 1.0), (lo, hi))),
    )
    left, right = (one[0], one[1], side, 0), (two[0], two[1], side, 1)
    return (1 if (hi < 0.5) | (lo >= 0.5) else 2), left if lo < 0.5 else right, right, (0.0, 0.0)


# Each contradicts the tent, or the contract.
def misspelt(params, x, side):
    return params.slop * x, side, 0


def no_code(params, x, side):
    return params.slope * x, side


def a_number(params, x, side):
    return params.slope * x


def unknown_name(params, x, side):
    return params.slope * hepler(x), side, 0  # noqa: F821  # meant


def third_branch(params, x, side):
    return params.slope * x, side, 2 if x > 0.9 else 0


def other_image(params, x, side, branch):
    return params.slope * x + 0.01, side, params.slope


def other_side(params, x, side, branch):
    return (params.slope * x if branch == 0 else params.slope * (1 - x)), 1 - side, params.slope


def swapped_branches(params, x, side, branch):
    return tent_on(params, x, side, 1 - branch)


def no_side(params, x, side, branch):
    return params.slope * x


def other_box(low, high, lo, hi, side):
    after = iv.mul((low.slope, high.slope), (0.5 * lo, 0.5 * hi))
    slot = (after[0], after[1], side, 0)
    return 1, slot, slot, (0.0, 0.0)


def other_side_box(low, high, lo, hi, side):
    count, first, second, witness = tent_box(low, high, lo, hi, side)
    return (
        count,
        (first[0], first[1], 1 - side, first[3]),
        (second[0], second[1], 1 - side, second[3]),
        witness,
    )


def root(params, x, side):
    return math.sqrt(x - params.slope), side, 0


def root_box(low, high, lo, hi, side):
    """Claims that there is an image where there is none."""
    after = iv.sqrt(iv.absolute(iv.sub((lo, hi), (low.slope, high.slope))))
    slot = (after[0], after[1], side, 0)
    return 1, slot, slot, (0.0, 0.0)


TWO = ("left", "right")
GRID = [(0.0, 1.0)]


@pytest.mark.parametrize(
    ("kernels", "method", "words"),
    [
        ({"image": misspelt}, None, ["image of Case", "'slop'", "(slope)", "test_contradictions.py, line"]),
        ({"image": no_code}, None, ["image of Case", "2 values", "3 values"]),
        ({"image": a_number}, None, ["image of Case", "float64", "a tuple"]),
        ({"image": unknown_name}, None, ["image of Case", "hepler"]),
        (
            {"image": third_branch, "branches": TWO},
            None,
            ["code", "image of Case", "is 2", "0 left, 1 right"],
        ),
        ({"image": tent}, None, ["code", "is 1", "0 map", "branches="]),
        (
            {"image": tent, "image_on": other_image, "branches": TWO},
            None,
            ["image_on on branch 0 (left)", "x = "],
        ),
        ({"image": tent, "image_on": other_side, "branches": TWO}, None, ["image_on on branch", "side"]),
        ({"image": tent, "image_on": swapped_branches, "branches": TWO}, None, ["image_on on branch 0"]),
        (
            {"image": tent, "image_on": no_side, "branches": TWO},
            None,
            ["image_on of Case", "float64", "a tuple"],
        ),
        ({"image": tent, "image_box": other_box, "branches": TWO}, "boxes", ["image_box of Case", "x = "]),
        ({"image": tent, "image_box": other_side_box, "branches": TWO}, "boxes", ["image_box of Case"]),
        ({"image": root, "image_box": root_box}, "boxes", ["image_box of Case", "nan"]),
    ],
)
def test_a_contradiction_is_one_line(kernels, method, words):
    case = made("Case", **kernels)
    with pytest.raises(MapError) as caught:
        ls.transitions(case(0.7), ls.grid(GRID, cells=64), method)
    text = str(caught.value)
    assert "\n" not in text
    assert len(text) < 400
    for word in words:
        assert word in text


@pytest.mark.parametrize(
    ("name", "function"), [("image", tent_on), ("image_on", tent), ("image_box", tent), ("on_side", tent)]
)
def test_a_wrong_number_of_arguments_is_refused_when_registered(name, function):
    kernels = {"image": tent, name: function}
    with pytest.raises(MapError, match=f"the arguments of the kernel {name} of Case") as caught:
        made("Case", **kernels)
    assert "\n" not in str(caught.value)


def test_an_orbit_names_what_it_met():
    """It has no grid; it looks at the codes it gets."""

    case = made("Case", image=third_branch, branches=TWO)
    with pytest.raises(MapError, match="is 2"):
        ls.orbit(case(1.0), 0.95, 0, 3)
    misspelling = made("Case", image=misspelt)
    with pytest.raises(MapError, match="'slop'"):
        ls.orbit(misspelling(1.0), 0.95, 0, 3)


@pytest.mark.sweep
def test_kernels_that_agree_are_taken():
    case = made("Case", image=tent, image_on=tent_on, image_box=tent_box, branches=TWO)
    for method in (None, "boxes"):
        graph = ls.transitions(case(1.9), ls.grid(GRID, cells=256), method)
        assert len(ls.attractors(graph)) == 1


class Plane(NamedTuple):
    turn: float


def turned(params, x, side):
    return (params.turn * x[1], x[0]), side, 0


def turned_on(params, x, side, branch):
    return (params.turn * x[1], -x[0]), side, ((0.0, params.turn), (-1.0, 0.0))


def test_the_plane():
    ls.register(Plane, image=turned, image_on=turned_on, dimension=2)
    with pytest.raises(MapError, match=r"image_on on branch 0 \(map\) of Plane at x = "):
        ls.transitions(Plane(0.5), ls.grid([(-1, 1), (-1, 1)], cells=16))


# ---------------------------------------------------------------- memory


@pytest.mark.parametrize(
    ("domain", "cells", "method"),
    [
        ([(-2, 2)] * 2, 512, None),
        ([(-2, 2)] * 2, 512, "boxes"),
        ([(-2, 2)] * 2, 512, "random"),
        ([(0, 1)], 4096, None),
    ],
)
def test_a_graph_that_does_not_fit_is_refused_and_the_one_proposed_is_not(monkeypatch, domain, cells, method):
    map_ = ls.maps.Henon() if len(domain) == 2 else ls.maps.Logistic(3.5)
    monkeypatch.setattr(memory, "_free_bytes", lambda: 2_000_000 if len(domain) == 2 else 100_000)
    monkeypatch.setattr(memory, "SMALL", 0)
    with pytest.raises(AnswerError, match=r"about .* GB.*that are free here.*ask for fewer cells") as caught:
        ls.transitions(map_, ls.grid(domain, cells=cells), method)
    fits = int(caught.value.remedy.split(": ")[1].split()[0])
    assert 1 < fits < cells
    ls.transitions(map_, ls.grid(domain, cells=fits), method)


def test_a_large_plane_is_refused_at_once():
    """Two thousand million cells take some 200 GB."""
    grid = ls.grid([(-2, 2)] * 2, cells=46000)
    if (memory._free_bytes() or 0) < 150e9:
        with pytest.raises(LimitsetsError, match=r"about 20\d\.\d GB"):
            ls.transitions(ls.maps.Henon(), grid)


def test_what_is_free_is_a_number_of_bytes():
    free = memory._free_bytes()
    assert free is None or 2**20 < free < 2**60
    assert np.isfinite(free or 0)
