"""What a user reads of a kernel that gives or does what compiled code does not take: plain words, and what to write."""

from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError, MapError


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


class Entries(NamedTuple):
    r: float


class Unpacked(NamedTuple):
    r: float


class TwoOfOne(NamedTuple):
    r: float


class OneOfTwo(NamedTuple):
    r: float


class Compared(NamedTuple):
    r: float


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


@pytest.mark.parametrize(
    ("params", "said"),
    [
        (
            Entries(3.5),
            r"takes entries of \(test_kernels_refused.py, line \d+\) is 'a number'.*write x, not x\[0\]",
        ),
        (Unpacked(3.5), r"takes entries of .* is 'a number'.*pass dimension="),
        (TwoOfOne(3.5), "new x .* image of TwoOfOne gives is 'a tuple of 2 numbers'.*pass dimension="),
        (OneOfTwo(3.5), "new x .* image of OneOfTwo gives is 'a number'.*two or three as a tuple"),
    ],
)
def test_a_kernel_of_another_dimension_is_told_so(params, said):
    plane = type(params) is OneOfTwo
    with pytest.raises(MapError, match=said):
        ls.transitions(params, ls.grid(PLANE if plane else LINE, cells=8))
    with pytest.raises(MapError, match=said):
        ls.orbit(params, (0.1, 0.1) if plane else 0.1, 0, 3)


def test_a_forgotten_dimension_is_named_with_the_call_that_takes_it():
    said = "dimension of the grid is 2; allowed: 1, that of Unpacked;.*pass dimension=2 to limitsets.register"
    with pytest.raises(AnswerError, match=said):
        ls.transitions(Unpacked(0.5), ls.grid(PLANE, cells=8))
    with pytest.raises(
        MapError, match=r"start x is 'a list of 2'; .*pass dimension=2 to limitsets\.register"
    ):
        ls.orbit(Unpacked(0.5), (0.1, 0.1), 0, 3)
    with pytest.raises(AnswerError) as caught:  # of a map of the package nobody can change it
        ls.transitions(ls.maps.Logistic(3.5), ls.grid(PLANE, cells=8))
    assert "register" not in str(caught.value)


def test_boxes_of_an_image_with_branches_name_what_is_missing():
    with pytest.raises(
        AnswerError, match=r"'Compared, of the branches left, right'.*register image_on and margin"
    ):
        ls.transitions(Compared(1.8), ls.grid(LINE, cells=8), "boxes")


def test_an_operation_on_a_tuple_of_parameters_is_named():
    said = r"operation of the kernel image of Polynomial is 'a tuple of 2 numbers \* a number'.*one by one.*line \d+"
    with pytest.raises(MapError, match=said):
        ls.orbit(Polynomial((1.0, 2.0)), 0.1, 0, 3)
