"""Maps whose methods contradict each other, and kernels that are refused."""

import math
import re
from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets import interval as iv
from limitsets.base.errors import AnswerError, LimitsetsError, MapError
from limitsets.systems.graph import building as memory

# ----------------------------------------------------------------
# Kernels of a map of one's own that contradict each other: one line each, of the package's family of errors.


def made(name, **kernels):
    """Register a class of its own."""
    return ls.register(NamedTuple(name, [("slope", float)]), **kernels)


def tent(params, x, side):
    return (params.slope * x, side, 0) if x < 0.5 else (params.slope * (1.0 - x), side, 1)


def tent_on(params, x, side, branch):
    up = (params.slope * x, side, params.slope)
    return up if branch == 0 else (params.slope * (1 - x), side, -params.slope)


def tent_box(low, high, lo, hi, side):
    slope = (low.slope, high.slope)
    one, two = iv.mul(slope, (lo, hi)), iv.mul(slope, iv.sub((1.0, 1.0), (lo, hi)))
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
    other = (first[0], first[1], 1 - side, first[3]), (second[0], second[1], 1 - side, second[3])
    return count, other[0], other[1], witness


def root(params, x, side):
    return math.sqrt(x - params.slope), side, 0


def root_box(low, high, lo, hi, side):
    """Claims that there is an image where there is none."""
    after = iv.sqrt(iv.absolute(iv.sub((lo, hi), (low.slope, high.slope))))
    slot = (after[0], after[1], side, 0)
    return 1, slot, slot, (0.0, 0.0)


TWO = ("left", "right")
GRID = [(0.0, 1.0)]


TENT = {"image": tent, "branches": TWO}


def test_a_contradiction_is_one_line():
    for kernels, method, words in (
        ({"image": misspelt}, None, ["image of Case", "'slop'", "(slope)", "test_contradictions.py, line"]),
        ({"image": no_code}, None, ["image of Case", "2 values", "3 values"]),
        ({"image": a_number}, None, ["image of Case", "float64", "a tuple"]),
        ({"image": unknown_name}, None, ["image of Case", "hepler"]),
        (TENT | {"image": third_branch}, None, ["code", "image of Case", "is 2", "0 left, 1 right"]),
        ({"image": tent}, None, ["code", "is 1", "0 map", "branches="]),
        (TENT | {"image_on": other_image}, None, ["image_on on branch 0 (left)", "x = "]),
        (TENT | {"image_on": other_side}, None, ["image_on on branch", "side"]),
        (TENT | {"image_on": swapped_branches}, None, ["image_on on branch 0"]),
        (TENT | {"image_on": no_side}, None, ["image_on of Case", "float64", "a tuple"]),
        (TENT | {"image_box": other_box}, "boxes", ["image_box of Case", "x = "]),
        (TENT | {"image_box": other_side_box}, "boxes", ["image_box of Case"]),
        ({"image": root, "image_box": root_box}, "boxes", ["image_box of Case", "nan"]),
    ):
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


# ---------------------------------------------------------------- margin and image


class Beside(NamedTuple):
    """A tent whose image changes its branch at `at`; its margin changes sign at 1/2."""

    slope: float
    at: float


def beside(params, x, side):
    return (params.slope * (1.0 - x), side, 1) if x > params.at else (params.slope * x, side, 0)


def beside_margin(params, x, side):
    return x - 0.5


def turned_margin(params, x, side):
    return params.at - x


def back(params, x, side):
    """Take branch 1 between 1/2 and `at` only."""
    return (params.slope * (1.0 - x), side, 1) if 0.5 < x < params.at else (params.slope * x, side, 0)


class Turned(Beside):
    """Its margin has the wrong sign."""


class Back(Beside):
    """Its image changes its branch where the margin does not change its sign."""


MARGIN = {"image_on": tent_on, "branches": TWO}
ls.register(Beside, image=beside, margin=beside_margin, **MARGIN)
ls.register(Turned, image=beside, margin=turned_margin, **MARGIN)
ls.register(Back, image=back, margin=beside_margin, **MARGIN)
INSIDE = ls.grid([(0.15, 0.93)], cells=256)


def place_in(error):
    """The x that an error names."""
    return float(re.search(r" at x = (\S+), side 0", str(error))[1])


@pytest.mark.parametrize("way", [-1, 1])
@pytest.mark.parametrize("off", [3e-3, 2e-4, 1e-6, 1e-9, 1e-11])
def test_a_margin_that_changes_sign_beside_the_switch_of_image_is_refused(off, way):
    params = Beside(1.8, 0.5 + way * off)
    for method in (None, "boxes"):
        said = r"'\d \(\w+\)'; allowed: \d \(\w+\), as its kernel image"
        with pytest.raises(MapError, match=said) as caught:
            ls.transitions(params, INSIDE, method)
        x = place_in(caught.value)
        # there the two do differ: by the plain functions
        assert beside(params, x, 0)[2] != (1 if beside_margin(params, x, 0) > 0.0 else 0)
        assert "in terms of margin and image_on" in caught.value.remedy


def test_what_would_be_proved_of_a_margin_beside_the_switch_is_false_of_image():
    """The core of a tent of slope 1.8 ends at 0.9; with its switch at 0.503 an image lies beyond."""
    assert beside(Beside(1.8, 0.503), 0.503, 0)[0] > 0.905
    with pytest.raises(MapError, match="sign of the kernel margin of Beside"):
        ls.certify(Beside(1.8, 0.503), INSIDE, ["invariant"])
    proof = ls.certify(Beside(1.8, 0.5), INSIDE, ["invariant"])
    assert proof.proved
    assert 0.9 <= proof.cells.extents()[0][-1][1] < 0.905


def test_parameters_are_compared_anew_and_at_both_corners():
    ls.transitions(Beside(1.7, 0.5), INSIDE)
    with pytest.raises(MapError, match="sign of the kernel margin of Beside"):
        ls.transitions(Beside(1.7, 0.6), INSIDE)
    with pytest.raises(MapError, match="sign of the kernel margin of Beside"):
        ls.certify(Beside(1.7, 0.5), INSIDE, ["invariant"], upper=Beside(1.7, 0.5001))


def test_an_atlas_compares_the_map_that_it_is_given():
    with pytest.raises(MapError, match="sign of the kernel margin of Beside"):
        ls.atlas(Beside(1.8, 0.503), "slope=1.7:1.8:3", domain=[(0.15, 0.93)])


def test_a_margin_of_the_wrong_sign_is_told_so_on_a_sampled_graph():
    with pytest.raises(MapError, match="wrong everywhere: give its negative"):
        ls.transitions(Turned(1.8, 0.5), INSIDE)


@pytest.mark.parametrize("at", [0.8, 0.5 + 2.0**-8])
def test_a_change_of_branch_without_a_change_of_sign_is_refused(at):
    params = Back(1.8, at)
    with pytest.raises(MapError, match=r"'1 \(right\)'; allowed: 0 \(left\)") as caught:
        ls.transitions(params, INSIDE)
    assert place_in(caught.value) > at


class OneOver(NamedTuple):
    """A tent whose switch is computed in two ways, which differ by rounding."""

    slope: float
    shift: float


def one_over(params, x, side):
    branch = 1 if (x - params.shift) * params.slope > 1.0 else 0
    after, to = one_over_on(params, x, side, branch)
    return after, to, branch


def one_over_on(params, x, side, branch):
    u = x - params.shift
    return params.shift + (2.0 - params.slope * u if branch == 1 else params.slope * u), side


def one_over_margin(params, x, side):
    return x - (params.shift + 1.0 / params.slope)


ls.register(OneOver, image=one_over, image_on=one_over_on, margin=one_over_margin, branches=TWO)


@pytest.mark.parametrize("shift", [0.0, 1e6])
def test_switches_that_differ_by_rounding_are_one(shift):
    differing = 0
    for slope in np.linspace(1.5, 1.9, 41).tolist():
        params = OneOver(slope, shift)
        x = shift + 1.0 / slope
        near = x + np.spacing(x) * np.arange(-3, 4)
        signs = [one_over_margin(params, v, 0) > 0.0 for v in near.tolist()]
        differing += [one_over(params, v, 0)[2] for v in near.tolist()] != signs
        ls.transitions(params, ls.grid([(shift + 0.01, shift + 1.1)], cells=16))
    assert differing > 0


class Disc(NamedTuple):
    square: float


def disc(params, x, side):
    branch = 1 if x[0] * x[0] + x[1] * x[1] > params.square else 0
    after, to = disc_on(params, x, side, branch)
    return after, to, branch


def disc_on(params, x, side, branch):
    return ((0.3 * x[0], 0.4 * x[1]) if branch == 1 else (0.5 * x[1], 0.5 * x[0])), side


def disc_margin(params, x, side):
    return x[0] * x[0] + x[1] * x[1] - 0.3


ls.register(Disc, image=disc, image_on=disc_on, margin=disc_margin, dimension=2, branches=("in", "out"))


@pytest.mark.parametrize("off", [1e-2, 1e-5, -1e-9])
def test_a_margin_beside_the_switch_in_the_plane(off):
    square = ls.grid([(-1.0, 1.0)] * 2, cells=16)
    for method in (None, "boxes"):
        ls.transitions(Disc(0.3), square, method)
        with pytest.raises(MapError, match="sign of the kernel margin of Disc") as caught:
            ls.transitions(Disc(0.3 + off), square, method)
        x, y = map(float, re.search(r" at x = (\S+), (\S+), side 0", str(caught.value)).groups())
        assert min(0.3, 0.3 + off) <= x * x + y * y <= max(0.3, 0.3 + off)


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
    ("dimension", "cells", "method"), [(2, 512, None), (2, 512, "boxes"), (1, 4096, None)]
)
def test_a_graph_that_does_not_fit_is_refused_and_the_one_proposed_is_not(
    monkeypatch, dimension, cells, method
):
    map_, domain = (ls.maps.Henon(), [(-2, 2)] * 2) if dimension == 2 else (ls.maps.Logistic(3.5), [(0, 1)])
    monkeypatch.setattr(memory, "_free_bytes", lambda: 2_000_000 if dimension == 2 else 100_000)
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


# ----------------------------------------------------------------
# What a user reads of a kernel that gives or does what compiled code does not take: plain words, and what to write.


class Arrayed(NamedTuple):
    a: float
    b: float


class Listed(NamedTuple):
    a: float


class ArrayedLine(NamedTuple):
    r: float


class Polynomial(NamedTuple):
    c: tuple[float, float]


def _arrayed(params, x, side):
    return np.array([1.0 - params.a * x[0] ** 2 + x[1], params.b * x[0]]), side, 0


def _listed(params, x, side):
    return [params.a * x[0], x[1]], side, 0


def _arrayed_line(params, x, side):
    return np.array([params.r * x * (1.0 - x)]), side, 0


def _polynomial(params, x, side):
    return params.c * x, side, 0


ls.register(Arrayed, image=_arrayed, dimension=2)
ls.register(Listed, image=_listed, dimension=2)
ls.register(ArrayedLine, image=_arrayed_line)
ls.register(Polynomial, image=_polynomial)

PLANE, LINE = [(-1.5, 1.5), (-0.5, 0.5)], [(0.0, 1.0)]


@pytest.mark.parametrize(
    ("params", "domain", "start"),
    [(Arrayed(1.4, 0.3), PLANE, (0.1, 0.1)), (Listed(0.5), PLANE, (0.1, 0.1)), (ArrayedLine(3.9), LINE, 0.1)],
    ids=["array", "list", "array on a line"],
)
def test_an_array_in_place_of_a_state_is_named(params, domain, start):
    said = rf"the new x that the kernel image of {type(params).__name__} gives is 'an array or a list'.*return \(y, z\)"
    with pytest.raises(MapError, match=said):
        ls.transitions(params, ls.grid(domain, cells=8))
    with pytest.raises(MapError, match=said):
        ls.orbit(params, start, 0, 3)


# Classes of one parameter each.
Entries, Unpacked, TwoOfOne, OneOfTwo, Compared = (
    NamedTuple(name, [("r", float)]) for name in ("Entries", "Unpacked", "TwoOfOne", "OneOfTwo", "Compared")
)


def _entries(params, x, side):
    return params.r * x[0] * (1.0 - x[0]), side, 0


def _unpacked(params, x, side):
    u, v = x
    return (params.r * v, u), side, 0


def _two_of_one(params, x, side):
    return (params.r * x, x), side, 0


def _one_of_two(params, x, side):
    return params.r * x[0], side, 0


def _compared(params, x, side):
    return (params.r * (1.0 - x), side, 1) if x > 0.5 else (params.r * x, side, 0)


ls.register(Entries, image=_entries)
ls.register(Unpacked, image=_unpacked)
ls.register(TwoOfOne, image=_two_of_one)
ls.register(OneOfTwo, image=_one_of_two, dimension=2)
ls.register(Compared, image=_compared, branches=("left", "right"))


def test_a_kernel_of_another_dimension_is_told_so():
    for params, said in (
        (Entries(3.5), r"takes entries of \(test_\w+.py, line \d+\) is 'a number'.*write x, not x\[0\]"),
        (Unpacked(3.5), r"takes entries of .* is 'a number'.*pass dimension="),
        (TwoOfOne(3.5), "new x .* image of TwoOfOne gives is 'a tuple of 2 numbers'.*pass dimension="),
        (OneOfTwo(3.5), "new x .* image of OneOfTwo gives is 'a number'.*two or three as a tuple"),
    ):
        plane = type(params) is OneOfTwo
        with pytest.raises(MapError, match=said):
            ls.transitions(params, ls.grid(PLANE if plane else LINE, cells=8))
        with pytest.raises(MapError, match=said):
            ls.orbit(params, (0.1, 0.1) if plane else 0.1, 0, 3)


def test_a_forgotten_dimension_is_named_with_the_call_that_takes_it():
    said = "dimension of the grid is 2; allowed: 1, that of Unpacked;.*pass dimension=2 to limitsets.register"
    with pytest.raises(AnswerError, match=said):
        ls.transitions(Unpacked(0.5), ls.grid(PLANE, cells=8))
    said = r"start x is 'a list of 2'; .*pass dimension=2 to limitsets\.register"
    with pytest.raises(MapError, match=said):
        ls.orbit(Unpacked(0.5), (0.1, 0.1), 0, 3)
    with pytest.raises(AnswerError) as caught:  # of a map of the package nobody can change it
        ls.transitions(ls.maps.Logistic(3.5), ls.grid(PLANE, cells=8))
    assert "register" not in str(caught.value)


def test_boxes_of_an_image_with_branches_name_what_is_missing():
    said = r"'Compared, of the branches left, right'.*register image_on and margin"
    with pytest.raises(AnswerError, match=said):
        ls.transitions(Compared(1.8), ls.grid(LINE, cells=8), "boxes")


def test_an_operation_on_a_tuple_of_parameters_is_named():
    said = r"operation of the kernel image of Polynomial is 'a tuple of 2 numbers \* a number'.*one by one.*line \d+"
    with pytest.raises(MapError, match=said):
        ls.orbit(Polynomial((1.0, 2.0)), 0.1, 0, 3)
