"""Random scenes by seed: triangles to pentagons with lead weights, every model, surfaces below and above the joint.

Kappa is a little above or a few times the longest ell, where flips are frequent; the numbers are decimals as people
write them.  Some scenes come with noise or with a tolerance.
"""

import math
import random
from typing import Any, NamedTuple


class Case(NamedTuple):
    """A scene as text, and what may vary."""

    scene: dict[str, Any]
    noise: dict[str, str]
    tolerance: dict[str, str]


def case(seed: int) -> Case:
    """The scene of a seed; the same on every machine."""
    rng = random.Random(f"scene {seed}")
    n = rng.choice([3, 3, 4, 5])
    size = rng.uniform(10, 60)
    while True:  # corners on an ellipse, spread well enough
        turns = sorted(rng.uniform(0, 2 * math.pi) for _ in range(n))
        gaps = [(b - a) % (2 * math.pi) for a, b in zip(turns, turns[1:] + turns[:1], strict=True)]
        if min(gaps) > 0.35 and max(gaps) < 2.8:
            break
    flat = rng.uniform(0.5, 1)
    corners = [(size * math.cos(t), size * flat * math.sin(t)) for t in turns]
    points = []
    for _ in range(rng.randrange(3)):
        weights = [rng.random() + 0.1 for _ in corners]
        total = sum(weights)
        x, y = (sum(w * c[k] for w, c in zip(weights, corners, strict=True)) / total for k in (0, 1))
        points.append({"x": f"{x:.3f} mm", "y": f"{y:.3f} mm", "mass": f"{rng.uniform(0.1, 6):.3f} g"})
    kappa = size * rng.choice([rng.uniform(1.2, 3), rng.uniform(3, 9)])
    arm = size * rng.uniform(8, 16)
    sign = 1 if rng.random() < 0.25 else -1
    model = {
        "flight": rng.choice(["exact"] * 5 + ["small-angle", "small-angle-2"]),
        "flip": rng.choice(["signed", "energy"]),
    }
    height = sign * size * (rng.uniform(0.005, 0.06) if sign > 0 else rng.uniform(0.005, 0.15))
    side = rng.randrange(n)
    place = f"{rng.uniform(0.15, 0.9) * arm:.3f} mm"
    goal: dict[str, Any] = rng.choice(
        [
            {"oriented_beyond": {"x": place, "side": side}},
            {"reaches": {"x": place, "side": side, "every_orbit": rng.random() < 0.5}},
            {"attracts_all": True},
            {"flip_order": list(range(n))},
            {"stays_on_arm": True},
        ]
    )
    if rng.random() < 0.2:
        goal["from_anywhere"] = True
    scene = {
        "name": f"random-{seed}",
        "part": {
            "vertices": [[f"{x:.3f} mm", f"{y:.3f} mm"] for x, y in corners],
            "mass": {"plate_density": "3 kg/m^2", "points": points},
        },
        "arm": {"surface_height": f"{height:.3f} mm", "length": f"{arm:.3f} mm"},
        "throw": {"kappa": f"{kappa:.4f} mm"},
        "model": model,
        "goal": goal,
    }
    kind = rng.random()
    if kind < 0.2:
        what = rng.choice([{"throw.speed": f"{rng.uniform(0.02, 0.6):.2f} %"}, {"landing.x": "0.05 mm"}])
        return Case(scene, what, {})
    if kind < 0.5:
        names = ["throw.speed", "arm.surface_height", "arm.length"]
        names += [f"part.vertices[{rng.randrange(n)}].x", f"part.vertices[{rng.randrange(n)}].y"]
        chosen = rng.sample(names, rng.choice([1, 1, 2, 3]))
        return Case(scene, {}, {k: "0.1 %" if k == "throw.speed" else "0.02 mm" for k in chosen})
    return Case(scene, {}, {})
