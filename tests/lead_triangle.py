"""A triangular plate of some centimetres with a lead weight, in millimetres: a feeder as an engineer writes it."""

from copy import deepcopy

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
