"""The ground in the engine: its surface is that of the scene."""

import math

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.feeder.engine.crowd import depth_of_overlap
from limitsets.feeder.engine.member import ground_of
from tests.feeding.scenes import with_cavity


def surface(ground, x):
    """Height of the highest polygon over a place, by the line of its upper side there."""
    heights = []
    for corners in ground.polygons:
        for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            if min(x0, x1) <= x <= max(x0, x1) and x0 != x1:
                heights.append(y0 + (y1 - y0) * (x - x0) / (x1 - x0))
    return max(heights)


@pytest.mark.parametrize("depth", ["5 in", "5.8633 in"])
def test_the_cavity_is_that_of_the_scene(depth):
    """The arm, a ramp of slope tan(angle), a floor where the ramp ends before the wall, the wall."""
    scene = with_cavity(depth=depth)
    ground, cavity = ground_of(scene), scene.cavity
    assert surface(ground, 19.9) == scene.surface_height
    for along in (0.5, 4.0, 7.0):
        down = along * math.tan(cavity.angle)
        assert surface(ground, 20.0 + along) == pytest.approx(scene.surface_height - down, abs=1e-12)
    assert surface(ground, 29.29) == pytest.approx(scene.surface_height - cavity.depth, abs=7e-3)
    assert surface(ground, 29.4) > scene.surface_height + 6.75
    if depth == "5 in":
        assert surface(ground, 28.2) == scene.surface_height - 5.0


def test_depressions_are_cut_into_the_arm():
    ground = ground_of(ls.load("paper-designed"), depressions=[(15.0, 7.0, 1.5), (2.0, 7.0, 1.0)])
    assert [round(surface(ground, x), 9) for x in (1.0, 5.0, 12.0, 18.0, 25.0)] == [
        -0.2,
        -1.2,
        -0.2,
        -1.7,
        -0.2,
    ]
    assert [ground.is_arm(x) for x in (1.0, 5.0, 12.0)] == [True, False, True]
    solid = [piece.corners.tolist() for piece in ground.pieces]
    pairs = [(one, two) for k, one in enumerate(solid) for two in solid[:k]]
    assert max(depth_of_overlap(*pair) for pair in pairs) <= 1e-12


@pytest.mark.parametrize("wrong", [[(2.0, 7.0, 1.0), (8.0, 7.0, 1.0)], [(25.0, 7.0, 1.0)], [(2.0, 7.0, 0.0)]])
def test_depressions_that_cannot_be_are_refused(wrong):
    with pytest.raises(AnswerError, match="one after the other"):
        ground_of(ls.load("paper-designed"), depressions=wrong)
