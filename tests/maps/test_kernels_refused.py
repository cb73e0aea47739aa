"""What a user reads of a kernel that gives or does what compiled code does not take: plain words, and what to write."""

from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets.errors import MapError


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


def test_an_operation_on_a_tuple_of_parameters_is_named():
    said = r"operation of the kernel image of Polynomial is 'a tuple of 2 numbers \* a number'.*one by one.*line \d+"
    with pytest.raises(MapError, match=said):
        ls.orbit(Polynomial((1.0, 2.0)), 0.1, 0, 3)
