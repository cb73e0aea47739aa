"""Random scenes as TOML text: parts of three to five corners, lead weights, all flights and criteria, all goals.

A scene is a function of its seed. Thresholds of goals lie near the ends of what a few hundred orbits reach, where true
and false are close.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from mpmath import mp

from tests.attack import facts as model
from tests.attack.throws import Orbits

KINDS = ("oriented_beyond", "reaches", "reaches_all", "attracts_all", "flip_order", "stays_on_arm")
UNITS = ("mm", "cm", "in", "m")


@dataclass(frozen=True)
class Case:
    """A scene, and what `certify` is asked of it."""

    seed: int
    text: str
    claims: tuple[str, ...]
    noise: dict[str, str] = field(default_factory=dict)
    tolerance: dict[str, str] = field(default_factory=dict)


def text(value: float, unit: str, of: str, digits: int = 6) -> str:
    """Write a quantity in another unit of its kind."""
    number = mp.mpf(float(value)) * model.UNITS[of] / model.UNITS[unit]
    return f"{float(mp.nstr(number, digits))!r} {unit}".replace("e-0", "e-")


def polygon(rng: Any, corners: int) -> Any:
    """Convex, counterclockwise, about one in size."""
    angles = np.sort(rng.uniform(0, 2 * np.pi, corners))
    gaps = np.diff(np.append(angles, angles[0] + 2 * np.pi))
    if gaps.min() < 0.35 or gaps.max() > 2.9:
        return polygon(rng, corners)
    radius = rng.uniform(0.7, 1.3, corners)
    p = radius[:, None] * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    q, r = np.roll(p, -1, axis=0) - p, np.roll(p, -2, axis=0) - np.roll(p, -1, axis=0)
    turn = q[:, 0] * r[:, 1] - q[:, 1] * r[:, 0]
    return p if turn.min() > 0.15 else polygon(rng, corners)


def part(rng: Any, size: float, unit: str) -> dict[str, Any]:
    """One part; whether it rests on each side is looked at later."""
    corners = int(rng.integers(3, 6))
    p = polygon(rng, corners) * size + rng.normal(0, 0.3 * size, 2)
    of = "mm"
    found: dict[str, Any] = {}
    sides = corners == 3 and rng.random() < 0.5
    if sides:
        edges = [np.hypot(*(p[k - 1] - p[k])) for k in range(3)]
        found["sides"] = [text(length, unit, of) for length in edges]
    else:
        found["vertices"] = [[text(x, unit, of), text(y, unit, of)] for x, y in p]
    if rng.random() < 0.35:
        inside = rng.dirichlet(np.full(corners, 2.0)) @ p
        side = int(rng.integers(corners))
        q, r = p[-side % corners], p[(-side + 1) % corners]
        along = (r - q) / np.hypot(*(r - q))
        away = np.array((-along[1], along[0]))
        places = (text(float(way @ (inside - q)), unit, of) for way in (along, away))
        center = dict(zip(("side", "along", "above"), (side, *places), strict=True))
        radius = text(size * rng.uniform(0.25, 0.6), unit, of)
        found["mass"] = {"center": center, "radius_of_gyration": radius}
        return found
    found["mass"] = {"plate_density": f"{rng.integers(1, 9)} kg/m^2"}
    if rng.random() < 0.75:
        weight = 4.0 * 2.5 * (size / 1000) ** 2 * 1000  # about that of the plate [g]
        frame = p
        if sides:
            s = [float(model.si(value)) * 1000 for value in found["sides"]]
            x = (s[0] ** 2 + s[1] ** 2 - s[2] ** 2) / (2 * s[0])
            frame = np.array(((0, 0), (s[0], 0), (x, np.sqrt(s[1] ** 2 - x**2))))
        points = []
        for _ in range(rng.integers(1, 4)):
            x, y = rng.dirichlet(np.full(corners, 1.5)) @ frame
            m = weight * 10 ** rng.uniform(-1, 0.3)
            mass = text(m / 1000, str(rng.choice(["g", "kg", "lb"])), "kg", 4)
            points.append({"x": text(float(x), unit, of), "y": text(float(y), unit, of), "mass": mass})
        found["mass"]["points"] = points
    return found


def rests(facts: model.Facts) -> bool:
    """Whether the part rests on every side, not on a knife's edge."""
    return all(
        0.04 < a / s < 0.96 and d > 0.04 * s for a, d, s in zip(facts.a, facts.d, facts.side, strict=True)
    )


def draft(rng: Any) -> tuple[dict[str, Any], model.Facts, str]:
    """A scene without a goal, of a part that rests."""
    unit = str(rng.choice(UNITS, p=(0.45, 0.2, 0.25, 0.1)))
    size = 10 ** rng.uniform(0.8, 2.2)  # mm
    own = unit if rng.random() < 0.75 else str(rng.choice(UNITS))
    kappa = size * np.exp(rng.uniform(np.log(0.9), np.log(16)))
    flight = str(rng.choice(model.FLIGHTS, p=(0.66, 0.17, 0.17)))
    scene: dict[str, Any] = {"name": "attacked", "part": part(rng, size, own)}
    h = size * 10 ** rng.uniform(-2.2, -0.5)
    h *= 1 if rng.random() < (0.3 if flight == "exact" else 0.12) else -1
    length = (kappa * rng.uniform(0.5, 1.1) + 2.5 * size) * rng.uniform(0.8, 1.8)
    scene["arm"] = {"surface_height": text(h, own, "mm", 5), "length": text(length, unit, "mm", 5)}
    if rng.random() < 0.5:
        scene["throw"] = {"kappa": text(kappa, unit, "mm")}
    else:
        tilt = float(rng.integers(5, 86))
        if rng.random() < 0.6:
            scene["gravity"] = {"tilt": f"{tilt} deg"}
            pull = 9806.65 * np.sin(np.radians(tilt))
        else:
            pull = rng.uniform(500, 9800)
            pulled = f"{pull / 1000:.4f} m/s^2" if rng.random() < 0.5 else f"{pull / 25.4:.3f} in/s^2"
            scene["gravity"] = {"acceleration": pulled}
        speed = np.sqrt(pull / kappa)
        scene["throw"] = {"speed": text(speed, "deg/s" if rng.random() < 0.7 else "rad/s", "rad/s", 5)}
    scene["model"] = {"flight": flight, "flip": "energy" if rng.random() < 0.5 else "signed"}
    facts = model.read(scene)
    lands = flight != "small-angle-2" or facts.kappa > max(facts.d)
    ok = rests(facts) and facts.arm > 1.2 * max(facts.a) and lands
    return (scene, facts, unit) if ok else draft(rng)


def sampled(facts: model.Facts, rng: Any, orbits: int = 300) -> Orbits:
    """A few hundred orbits after a thousand throws."""
    numbers = facts.floats()
    i = rng.integers(0, len(facts.a), orbits)
    found = Orbits(numbers, rng.uniform(numbers[0][i], numbers[6]), i)
    found.fly(1000)
    found.look()
    found.fly(500)
    return found


def goal(rng: Any, facts: model.Facts, seen: Orbits, unit: str) -> dict[str, Any]:
    """One goal that may or may not hold."""
    n = len(facts.a)
    kind = KINDS[rng.choice(6, p=(0.32, 0.2, 0.2, 0.08, 0.1, 0.1))]
    most = seen.most.max(axis=0)
    lively = np.flatnonzero(np.isfinite(most))
    width = float(facts.arm) - float(min(facts.a))
    best = int(lively[np.argmax(most[lively])] if lively.size else rng.integers(n))
    if kind == "oriented_beyond":
        others = np.delete(most, best)
        x = max(others.max(), float(min(facts.a))) + width * rng.choice((-0.03, -0.002, 0.002, 0.01, 0.05))
        x = min(max(x, 0.001 * width), 0.999 * float(facts.arm))
        found: dict[str, Any] = {"x": text(x, unit, facts.unit), "side": best}
    elif kind.startswith("reaches"):
        side = best if rng.random() < 0.6 else int(rng.integers(n))
        low = np.where(np.isfinite(seen.most[:, side]), seen.most[:, side], np.nan)
        x = float(facts.a[side]) + 0.3 * width
        if np.isfinite(low).any():
            x = float(np.nanquantile(low, rng.choice((0.0, 0.5, 1.0))))
            x -= width * rng.choice((-0.01, 0.002, 0.02, 0.1))
        x = min(max(x, float(facts.a[side]) * 1.02), 0.999 * float(facts.arm))
        found = {"x": text(x, unit, facts.unit), "side": side, "every_orbit": kind == "reaches"}
    elif kind == "flip_order":
        start = int(rng.integers(n))
        order = [(start + k) % n for k in range(n)]
        still = lively.size and not np.any((seen.code >= 0) & (seen.longest < 500))
        return {"flip_order": [best] if still and rng.random() < 0.7 else order} | _anywhere(rng)
    else:
        return {kind: True} | (_anywhere(rng) if kind == "stays_on_arm" else {})
    return {kind.removesuffix("_all"): found} | _anywhere(rng)


def _anywhere(rng: Any) -> dict[str, bool]:
    return {"from_anywhere": True} if rng.random() < 0.2 else {}


def deviations(rng: Any, scene: dict[str, Any], facts: model.Facts) -> tuple[dict[str, str], dict[str, str]]:
    """Noise, or tolerance, or neither."""
    what = rng.random()
    share = f"{10 ** rng.uniform(-2, 0):.3f} %"
    if what < 0.62:
        return {}, {}
    if what < 0.82:
        names = ["throw.speed", "landing.x", "both"]
        names += ["gravity.tilt"] if "tilt" in scene.get("gravity", {}) else []
        name = str(rng.choice(names))
        noise = {}
        if name in ("throw.speed", "gravity.tilt", "both"):
            noise["gravity.tilt" if name == "gravity.tilt" else "throw.speed"] = share
        if name in ("landing.x", "both"):
            e = float(facts.arm) * 10 ** rng.uniform(-5, -3)
            noise["landing.x"] = text(e, facts.unit, facts.unit, 3)
        return noise, {}
    names = ["throw.speed", "arm.surface_height"]
    if "center" in scene["part"]["mass"]:
        names += ["part.mass.center.along", "part.mass.center.above", "part.mass.radius_of_gyration"]
    for k in range(len(scene["part"]["mass"].get("points", ()))):
        names += [f"part.mass.points[{k}].mass"]
    return {}, {str(rng.choice(names)): f"{10 ** rng.uniform(-3, -0.3):.4f} %"}


def toml(scene: dict[str, Any]) -> str:
    """Write a scene."""

    def value(given: Any) -> str:
        if isinstance(given, bool):
            return str(given).lower()
        if isinstance(given, dict):
            return "{" + ", ".join(f"{key} = {value(each)}" for key, each in given.items()) + "}"
        if isinstance(given, list):
            return "[" + ", ".join(map(value, given)) + "]"
        return f'"{given}"' if isinstance(given, str) else str(given)

    lines = [f"{key} = {value(each)}" for key, each in scene.items() if not isinstance(each, dict)]
    for table, entries in scene.items():
        if isinstance(entries, dict):
            lines += ["", f"[{table}]", *(f"{key} = {value(each)}" for key, each in entries.items())]
    return "\n".join(lines) + "\n"


def case(seed: int) -> Case:
    """The scene of a seed, one with flips and orbits that stay if some draws give one."""
    rng = np.random.default_rng([10, seed])
    for _ in range(8):
        scene, facts, unit = draft(rng)
        seen = sampled(facts, rng)
        stay = seen.code >= 0
        if stay.mean() > 0.02 and np.any(seen.longest[stay] < 500):
            break
    scene["goal"] = goal(rng, facts, seen, unit)
    noise, tolerance = deviations(rng, scene, facts)
    claims = ("goal",) if rng.random() < 0.4 else ("attracts-all", "goal")
    return Case(seed, toml(scene), claims, noise, tolerance)
