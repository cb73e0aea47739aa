"""A scene with two attractors: one collects 83 % of the starts, and a fixed point at 274.729 mm on side 3 some 2 %."""

POINTS = [
    {"x": "0.404 mm", "y": "12.471 mm", "mass": "0.775 g"},
    {"x": "-1.976 mm", "y": "20.782 mm", "mass": "0.791 g"},
]
CORNERS = ((8.748, 31.560), (-7.853, 31.732), (-21.757, -26.582), (-0.592, -32.428))
FOUR_GON = {
    "name": "four-gon",
    "part": {
        "vertices": [[f"{x:.3f} mm", f"{y:.3f} mm"] for x, y in CORNERS],
        "mass": {"plate_density": "3 kg/m^2", "points": POINTS},
    },
    "arm": {"surface_height": "-5.202 mm", "length": "427.206 mm"},
    "throw": {"kappa": "125.9620 mm"},
    "model": {"flight": "exact", "flip": "energy"},
    "goal": {"reaches": {"x": "69.0806 mm", "side": 1, "every_orbit": True}},
}
