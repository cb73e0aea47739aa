"""Parts of some centimetres as an engineer writes them, in millimetres: three plates with a lead weight."""

from copy import deepcopy
from typing import Any

# The scene of docs/scene.md: four corners.
LEAD_QUAD = {
    "name": "lead-quad",
    "part": {
        "vertices": [["0 mm", "0 mm"], ["130 mm", "0 mm"], ["150 mm", "70 mm"], ["30 mm", "100 mm"]],
        "mass": {"plate_density": "3 kg/m^2", "points": [{"x": "110 mm", "y": "15 mm", "mass": "60 g"}]},
    },
    "arm": {"surface_height": "-15 mm", "length": "700 mm"},
    "throw": {"speed": "160 deg/s"},
    "gravity": {"tilt": "30 deg"},
    "goal": {"oriented_beyond": {"x": "52 cm", "side": 0}},
}

# A triangle.
LEAD_TRIANGLE = {
    "name": "lead-triangle",
    "part": {
        "sides": ["46 mm", "30 mm", "54 mm"],
        "mass": {
            "plate_density": "7850 kg/m^3",
            "plate_thickness": "2 mm",
            "points": [{"x": "30 mm", "y": "8 mm", "mass": "20 g"}],
        },
    },
    "arm": {"surface_height": "-2 mm", "length": "300 mm"},
    "throw": {"speed": "200 deg/s"},
    "gravity": {"tilt": "30 deg"},
    "goal": {"oriented_beyond": {"x": "160 mm", "side": 2}},
}


def left_by_some():
    """Give the same plate as a feeder that meets its goal on the limit set, and which parts leave from some starts."""
    found = deepcopy(LEAD_TRIANGLE)
    found["part"]["mass"]["points"] = [{"x": "2.1097 mm", "y": "16.2608 mm", "mass": "24.653 g"}]
    found["arm"]["surface_height"] = "-0.4074 mm"
    found["throw"]["speed"] = "279.3797 deg/s"
    return found


# A steel plate, and scenes that differ from it in a few lines.
PLATE = """
[part]
vertices = [["0 mm", "0 mm"], ["80 mm", "0 mm"], ["62 mm", "45 mm"], ["12 mm", "45 mm"]]
[part.mass]
plate_density = "7850 kg/m^3"
plate_thickness = "2 mm"
points = [{ x = "58 mm", y = "9 mm", mass = "18 g" }]
[arm]
surface_height = "-8 mm"
length = "400 mm"
[throw]
speed = "180 deg/s"
[gravity]
tilt = "30 deg"
"""


def plate(*changes: tuple[str, str], name: str = "plate", more: str = "") -> str:
    """The scene's text with another name and more tables, each change made in it."""
    text = f'name = "{name}"\n{PLATE}{more}'
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


def bracket() -> dict[str, Any]:
    """An L of steel with a notch in its base, a round and a three-cornered hole, and a lead weight; five sides."""
    corners = [(0, 0), (30, 0), (30, 5), (50, 5), (50, 0), (80, 0), (80, 40), (40, 40), (40, 80), (0, 80)]
    holes = [
        {"center": {"x": "20 mm", "y": "60 mm"}, "diameter": "10 mm"},
        {"vertices": [["10 mm", "10 mm"], ["20 mm", "10 mm"], ["10 mm", "20 mm"]]},
    ]
    points = [{"x": "60 mm", "y": "20 mm", "mass": "18 g"}]
    return {
        "name": "bracket",
        "part": {
            "vertices": [[f"{x} mm", f"{y} mm"] for x, y in corners],
            "holes": holes,
            "mass": {"plate_density": "7850 kg/m^3", "plate_thickness": "2 mm", "points": points},
        },
        "arm": {"surface_height": "-4 mm", "length": "400 mm"},
        "throw": {"speed": "150 deg/s"},
        "gravity": {"tilt": "30 deg"},
    }
