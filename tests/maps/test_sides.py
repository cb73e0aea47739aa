"""Sides that a map or a grid has not: kernels would read beyond their arrays."""

from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.base.errors import AnswerError, MapError
from limitsets.systems.cells import Domain
from limitsets.systems.maps.critical import margins


@pytest.mark.parametrize("side", [-1, 3, 7, 2**31])
@pytest.mark.parametrize(
    "ask",
    [
        lambda params, side: maps.images(params, [8.0], side),
        lambda params, side: maps.images_on(params, [8.0], side, 0),
        lambda params, side: maps.along(params, [8.0, 8.0], [0, side], [0]),
        lambda params, side: maps.advance(params, [8.0, 8.0], [0, side], 3),
        lambda params, side: ls.orbit(params, 8.0, side, 3),
        lambda params, side: maps.lyapunov(params, 8.0, side, 3),
        lambda params, side: margins(params, [8.0], side),
    ],
    ids=["images", "images_on", "along", "advance", "orbit", "lyapunov", "margins"],
)
def test_a_side_the_part_has_not(ask, side):
    with pytest.raises(MapError, match="0 to 2"):
        ask(ls.load("paper-designed").map, side)


@pytest.mark.parametrize("method", ["end-points", "corners"])
def test_a_grid_of_fewer_sides_than_the_map(method):
    with pytest.raises(AnswerError, match="the side of an image is 1"):
        ls.transitions(ls.load("paper-designed").map, ls.grid([(2.0, 28.0)], cells=16), method)


def test_a_grid_of_more_sides_than_the_map():
    scene = ls.load("paper-designed")
    four = Domain(np.full((4, 1), 5.0), np.full((4, 1), 28.0))
    with pytest.raises(MapError, match="the side is 3"):
        ls.transitions(scene.map, ls.grid(four, cells=16))
    with pytest.raises(MapError, match="the side is 3"):
        ls.critical_points(scene.map, four)


class Elsewhere(NamedTuple):
    to: float


def _elsewhere(params, x, side):
    return 0.5 * x, int(params.to), 0


maps.register(Elsewhere, image=_elsewhere)


@pytest.mark.parametrize("to", [-1.0, 1.0, 30_000.0])
def test_a_map_that_leads_to_a_side_that_is_none(to):
    with pytest.raises(AnswerError, match="the side of an image"):
        ls.transitions(Elsewhere(to), ls.grid([(0.0, 1.0)], cells=8))
