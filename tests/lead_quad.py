"""The scene of docs/scene.md: a plate of four corners in millimetres, with a lead weight."""

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
