"""A class registered again under its name, as by a cell of a notebook that runs twice, is a map of its own."""

import math
import pickle
from typing import NamedTuple

import pytest

import limitsets as ls


def slow(params, x, side):
    return 0.5 * x + 0.1 * params.a, side, 0


def fast(params, x, side):
    return 0.5 * x + 0.4 * params.a, side, 0


def registered(image):
    class Again(NamedTuple):
        a: float

    return ls.register(Again, image=image)


def test_each_of_two_classes_of_one_name_is_followed_by_its_own_formula():
    """The fixed point of x / 2 + c is 2 c; either class may come first."""
    old, new = registered(slow), registered(fast)
    for cls, c in ((old, 0.1), (new, 0.4), (old, 0.1)):
        assert ls.orbit(cls(1.0), 0.3, 0, 1).x[-1] == 0.15 + c
        graph = ls.transitions(cls(1.0), ls.grid([(0.0, 1.0)], cells=256))
        ((lo, hi),) = ls.attractors(graph)[0].extents[0]
        assert lo <= 2.0 * c <= hi
    assert ls.maps.kind_of(old(1.0)).name == ls.maps.kind_of(new(1.0)).name == "Again"
    assert repr(new(1.0)) != repr(old(1.0))
    assert (
        new.__name__.isidentifier()
    )  # the cache on disk makes the class again, under this name, in the next process


class Henon(NamedTuple):
    """A map of one's own under the name and the fields of a textbook map."""

    a: float
    b: float


def turned(params, x, side):
    return (params.a * x[0] - params.b * x[1], params.b * x[0] + params.a * x[1]), side, 0


ls.register(Henon, image=turned, dimension=2)


@pytest.mark.parametrize("mine_first", [False, True])
def test_a_map_may_have_the_name_of_a_textbook_map(mine_first):
    mine, book = Henon(0.6, 0.3), ls.maps.Henon(0.6, 0.3)
    for params in (mine, book) if mine_first else (book, mine):
        after = ls.orbit(params, (0.5, 0.25), 0, 1).x[-1]
        known = (0.225, 0.3) if params is mine else (1.0 - 0.6 * 0.25 + 0.25, 0.15)
        assert math.dist(after, known) < 1e-15
    assert type(pickle.loads(pickle.dumps(mine))) is Henon
