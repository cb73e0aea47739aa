"""A scene with two attractors: one collects 83 % of the starts, and a fixed point at 274.729 mm on side 3 some 2 %."""

FOUR_GON = {
    "name": "four-gon",
    "part": {
        "vertices": [
            ["8.748 mm", "31.560 mm"],
            ["-7.853 mm", "31.732 mm"],
            ["-21.757 mm", "-26.582 mm"],
            ["-0.592 mm", "-32.428 mm"],
        ],
        "mass": {
            "plate_density": "3 kg/m^2",
            "points": [
                {"x": "0.404 mm", "y": "12.471 mm", "mass": "0.775 g"},
                {"x": "-1.976 mm", "y": "20.782 mm", "mass": "0.791 g"},
            ],
        },
    },
    "arm": {"surface_height": "-5.202 mm", "length": "427.206 mm"},
    "throw": {"kappa": "125.9620 mm"},
    "model": {"flight": "exact", "flip": "energy"},
    "goal": {"reaches": {"x": "69.0806 mm", "side": 1, "every_orbit": True}},
}
