"""A scene's text as numbers, read by code of its own: units, sides, mass, kappa, at 50 digits.

Written from the model's description alone; nothing here imports the package, so that a mistake in its units or its
geometry is a difference, not an agreement.
"""

from __future__ import annotations

import copy
import re
import tomllib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from mpmath import mp, mpf

mp.dps = 50

G0 = mpf("9.80665")
INCH = mpf("0.0254")
LENGTHS = {"m": mpf(1), "cm": mpf("0.01"), "mm": mpf("0.001"), "in": INCH, "ft": 12 * INCH}
UNITS = LENGTHS | {f"{unit}/s^2": size for unit, size in LENGTHS.items()}
UNITS |= {"deg": mp.pi / 180, "rad": mpf(1), "deg/s": mp.pi / 180, "rad/s": mpf(1), "kg/m^2": mpf(1)}
UNITS |= {"kg": mpf(1), "g": mpf("0.001"), "lb": mpf("0.45359237"), "%": mpf("0.01")}
FLIGHTS = ("exact", "small-angle", "small-angle-2")
FLIPS = ("signed", "energy")


def si(text: str) -> mpf:
    """Value of a quantity in SI units (a share of one for percent)."""
    number, unit = text.split()
    return mpf(number) * UNITS[unit]


@dataclass(frozen=True)
class Facts:
    """All that a throw depends on, lengths in the unit of the arm's length."""

    unit: str
    a: list[mpf]
    d: list[mpf]
    side: list[mpf]
    rho: mpf
    kappa: mpf
    h: mpf
    arm: mpf
    flight: str
    flip: str

    def floats(self) -> tuple[Any, ...]:
        """Give the numbers as the simulator takes them."""
        arrays = (np.array([float(value) for value in each]) for each in (self.a, self.d, self.side))
        rest = (float(self.rho), float(self.kappa), float(self.h), float(self.arm))
        return (*arrays, *rest, FLIGHTS.index(self.flight), FLIPS.index(self.flip))

    def with_kappa(self, kappa: mpf) -> Facts:
        return replace(self, kappa=kappa)


def cross(p: tuple[mpf, mpf], q: tuple[mpf, mpf]) -> mpf:
    return p[0] * q[1] - p[1] * q[0]


def plate(corners: list[tuple[mpf, mpf]]) -> tuple[mpf, tuple[mpf, mpf], mpf]:
    """Area, centroid and second moment about the origin, of a polygon."""
    area = sx = sy = second = mpf(0)
    for p, q in zip(corners, corners[1:] + corners[:1], strict=True):
        turn = cross(p, q)
        area += turn / 2
        sx += turn * (p[0] + q[0]) / 6
        sy += turn * (p[1] + q[1]) / 6
        second += turn * sum(p[k] ** 2 + p[k] * q[k] + q[k] ** 2 for k in (0, 1)) / 12
    return area, (sx / area, sy / area), second


def corners_of(part: dict[str, Any]) -> list[tuple[mpf, mpf]]:
    """Corners counterclockwise; three sides: side 0 = P0P1, side 1 = P2P0, side 2 = P1P2, P0 at 0, P1 on the x axis."""
    if "vertices" in part:
        return [(si(x), si(y)) for x, y in part["vertices"]]
    s0, s1, s2 = (si(text) for text in part["sides"])
    x = (s0**2 + s1**2 - s2**2) / (2 * s0)
    return [(mpf(0), mpf(0)), (s0, mpf(0)), (x, mp.sqrt(s1**2 - x**2))]


def edge(corners: list[tuple[mpf, mpf]], side: int) -> tuple[tuple[mpf, mpf], tuple[mpf, mpf], mpf]:
    """Left end, direction and length of a side: side 0 is P0P1, side 1 P(n-1)P0, side 2 P(n-2)P(n-1), ..."""
    first = -side % len(corners)
    p, q = corners[first], corners[(first + 1) % len(corners)]
    length = mp.hypot(q[0] - p[0], q[1] - p[1])
    return p, ((q[0] - p[0]) / length, (q[1] - p[1]) / length), length


def read(text: str | dict[str, Any]) -> Facts:
    """Numbers of a scene."""
    scene = tomllib.loads(text) if isinstance(text, str) else text
    unit = scene["arm"]["length"].split()[1]
    one = UNITS[unit]
    corners = corners_of(scene["part"])
    mass = scene["part"]["mass"]
    if "center" in mass:
        where = mass["center"]
        left, along, _ = edge(corners, where["side"])
        s, t = si(where["along"]), si(where["above"])
        center = (left[0] + s * along[0] - t * along[1], left[1] + s * along[1] + t * along[0])
        rho = si(mass["radius_of_gyration"])
    else:
        area, middle, second = plate(corners)
        density = si(mass["plate_density"])
        weights = [(density * area, middle)]
        about = density * second
        for point in mass.get("points", ()):
            at, m = (si(point["x"]), si(point["y"])), si(point["mass"])
            weights.append((m, at))
            about += m * (at[0] ** 2 + at[1] ** 2)
        total = sum(m for m, _ in weights)
        center = (sum(m * p[0] for m, p in weights) / total, sum(m * p[1] for m, p in weights) / total)
        rho = mp.sqrt(about / total - center[0] ** 2 - center[1] ** 2)
    a, d, lengths = [], [], []
    for side in range(len(corners)):
        left, along, length = edge(corners, side)
        arm = (center[0] - left[0], center[1] - left[1])
        a.append((arm[0] * along[0] + arm[1] * along[1]) / one)
        d.append(cross(along, arm) / one)
        lengths.append(length / one)
    throw = scene["throw"]
    if "kappa" in throw:
        kappa = si(throw["kappa"])
    else:
        gravity = scene["gravity"]
        pull = si(gravity["acceleration"]) if "acceleration" in gravity else G0 * mp.sin(si(gravity["tilt"]))
        kappa = pull / si(throw["speed"]) ** 2
    model = scene.get("model", {})
    return Facts(
        unit, a, d, lengths, rho / one, kappa / one, si(scene["arm"]["surface_height"]) / one,
        si(scene["arm"]["length"]) / one, model.get("flight", "exact"), model.get("flip", "signed"),
    )  # fmt: skip


def kappas(facts: Facts, scene: dict[str, Any], noise: dict[str, str]) -> tuple[mpf, mpf]:
    """Least and greatest kappa under the noise of single throws."""
    lo = hi = facts.kappa
    if "throw.speed" in noise:
        p = si(noise["throw.speed"])
        if not noise["throw.speed"].endswith("%"):
            p /= si(scene["throw"]["speed"])
        lo, hi = lo / (1 + p) ** 2, hi / (1 - p) ** 2
    if "gravity.tilt" in noise:
        tilt, off = si(scene["gravity"]["tilt"]), si(noise["gravity.tilt"])
        if noise["gravity.tilt"].endswith("%"):
            off *= tilt
        lo, hi = lo * mp.sin(tilt - off) / mp.sin(tilt), hi * mp.sin(tilt + off) / mp.sin(tilt)
    return lo, hi


def landing(facts: Facts, noise: dict[str, str]) -> mpf:
    """Largest deviation of the landing place."""
    return si(noise["landing.x"]) / UNITS[facts.unit] if "landing.x" in noise else mpf(0)


def moved(
    scene: dict[str, Any], quantity: str, shift: str | None = None, to: str | None = None
) -> dict[str, Any]:
    """Give the scene with one quantity set to a text, or multiplied by a decimal."""
    found = copy.deepcopy(scene)
    if quantity == "throw.speed" and "kappa" in found["throw"]:
        number, unit = found["throw"]["kappa"].split()
        assert shift is not None
        found["throw"]["kappa"] = f"{mp.nstr(mpf(number) / mpf(shift) ** 2, 45)} {unit}"
        return found
    keys: list[Any] = []
    for word in quantity.split("."):
        name, *index = re.split(r"[\[\]]+", word.rstrip("]"))
        keys += [name, *map(int, index)]
    if "vertices" in keys:
        keys[-1] = "xy".index(keys[-1])
    place = found
    for key in keys[:-1]:
        place = place[key]
    if to is None:
        assert shift is not None
        number, unit = place[keys[-1]].split()
        to = f"{mp.nstr(mpf(number) * mpf(shift), 45)} {unit}"
    place[keys[-1]] = to
    return found
