import copy
import tomllib
from collections.abc import Callable
from typing import Any

import pytest

from limitsets.feeder.scene import load

_WHOLE = tomllib.loads("""
name = "whole"
part.sides = ["5.75 in", "3.6 in", "6.75 in"]
part.mass.center = { side = 2, along = "4.2255778 in", above = "0.7082490 in" }
part.mass.radius_of_gyration = "1.25 in"
arm = { surface_height = "-0.2 in", length = "28 in" }
throw.speed = "158.02 deg/s"
gravity.tilt = "30 deg"
model = { flight = "exact", flip = "signed" }
goal.oriented_beyond = { x = "20 in", side = 2 }
cavity = { position = "20 in", width = "9.3 in", depth = "5.8633 in", angle = "32.23 deg" }
effects.auto = true
tolerance = { "throw.speed" = "1 %", "part.sides[1]" = "0.01 in" }
feedback.sensor = { beyond = "20 in", error = "0.1 in" }
feedback.throws = [{ name = "own", speed = "158.02 deg/s" }, { name = "slow", kappa = "30 in" }]
[tray]
depression_width = "7.02 in"
depression_depth = "1.53 in"
pitch = "14.04 in"
agitation = "0.4 in"
wash = "1 in"
[world]
throw_rate = "2 Hz"
friction = 0.9
restitution = 0.4
bounce_threshold = "0.01 in"
stroke = "5 deg"
scatter = { speed = "1 %", landing = "0.05 in" }
""")
_PLATE = tomllib.loads("""
name = "plate"
part.vertices = [["0 cm", "0 cm"], ["6 cm", "0 cm"], ["6 cm", "4 cm"], ["0 cm", "4 cm"]]
part.mass = { plate_density = "2 kg/m^2", points = [{ x = "3 cm", y = "1 cm", mass = "4.8 g" }] }
arm = { surface_height = "-5 mm", length = "70 cm" }
throw.kappa = "0.6 m"
""")


@pytest.fixture
def whole() -> dict[str, Any]:
    """Give a scene in which every section stands."""
    return copy.deepcopy(_WHOLE)


@pytest.fixture
def plate() -> dict[str, Any]:
    """Give a scene by vertices, plate and point mass."""
    return copy.deepcopy(_PLATE)


@pytest.fixture(scope="session", autouse=True)
def _loaded() -> Callable[..., Any]:
    """Import what a scene needs before hypothesis measures its first example."""
    load("paper-designed")
    return load
