"""Which further throws would sharpen the answer most: the gain in information of a throw from each place and side.

The information of a throw is that of its landing and of its decision; near a critical point the decision tells most,
and about the radius of gyration it alone tells anything.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.fitting.likelihood import SHARPEST
from limitsets.fitting.predicting import predicted
from limitsets.scene import Scene

PLACES = 200
STEP = 1e-4
# Throws that are filmed more, of which the gain is told.
MORE = 10
# A value that the data leave quite open is known this well before them, in units of change.
BEFORE = 0.5

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Further:
    """A throw worth filming.

    Attributes
    ----------
    x, side : float, int
        Where the part is laid down [length]: what the film shows, the left corner or the centre of mass.
    gain : float
        Gain in information by one such throw [nats]: logarithm of the ratio of volumes of the region, before and after.
    shrinks : dict of str to float
        By which factor ten of them shorten the interval of each quantity.
    """

    x: float
    side: int
    gain: float
    shrinks: dict[str, float]


class Question(NamedTuple):
    """Quantities of a scene that are to be known, the units of their change, the scatter of speed and place.

    With `corner` places are those of the left corner, else of the centre of mass.
    """

    scene: Scene
    names: tuple[str, ...]
    units: Array
    scatter: tuple[float, float]
    corner: bool


def information(asked: Question, x: Array, side: NDArray[np.int64], error: Array) -> Array:
    """Return the information of single throws about quantities in their units of change; shape (n, p, p)."""
    from scipy.stats import norm

    scene, names, units, scatter, corner = asked
    centre = np.array([scene.value(name) for name in names])
    moves = np.concatenate([np.zeros((1, len(names))), np.diag(units), -np.diag(units)]) * STEP
    points = dict(zip(names, (centre + moves).T, strict=True))
    jog, flip = (
        predicted(scene, points, x, side, np.full(side.size, b, np.int64), corner=corner) for b in (0, 1)
    )
    speed, landing = scatter[0], max(scatter[1], SHARPEST * scene.arm_length)
    size = np.sqrt((jog.decides_slope * error) ** 2 + (jog.decides_per_log_speed * speed) ** 2)[0]
    z = jog.decides / np.maximum(size, 1e-9)
    flips = norm.cdf(z[0])
    p = len(names)
    total = np.zeros((side.size, p, p))
    for told, share in ((jog, 1.0 - flips), (flip, flips)):
        slope = ((told.after[1 : p + 1] - told.after[p + 1 :]) / (2.0 * STEP)).T
        variance = error**2 * (1.0 + told.slope[0] ** 2) + (told.per_log_speed[0] * speed) ** 2 + landing**2
        total += (share / variance)[:, None, None] * slope[:, :, None] * slope[:, None, :]
    slope = ((z[1 : p + 1] - z[p + 1 :]) / (2.0 * STEP)).T
    weight = norm.pdf(z[0]) ** 2 / np.maximum(flips * (1.0 - flips), 1e-30)
    total += weight[:, None, None] * slope[:, :, None] * slope[:, None, :]
    return np.where(np.isfinite(total), total, 0.0)


def further_throws(asked: Question, x: Array, side: NDArray[np.int64], error: Array) -> tuple[Further, ...]:
    """Find the start on each side from which a throw tells most beside those filmed; the most telling first."""
    scene, names = asked.scene, asked.names
    known = information(asked, x, side, error).sum(axis=0)
    known += np.eye(len(names)) / BEFORE**2
    found = []
    size = float(np.mean(error)) if np.mean(error) > 0 else asked.scatter[1]
    for own in range(len(scene.sides)):
        near, far = scene.sides.a[own], scene.arm_length
        places = np.linspace(near + 0.02 * (far - near), far, PLACES) - (near if asked.corner else 0.0)
        there = information(asked, places, np.full(PLACES, own), np.full(PLACES, size))
        gains = np.linalg.slogdet(known + there)[1] - np.linalg.slogdet(known)[1]
        best = int(np.argmax(gains))
        ratio = np.diag(np.linalg.inv(known)) / np.diag(np.linalg.inv(known + MORE * there[best]))
        shrinks = {name: float(np.sqrt(each)) for name, each in zip(names, ratio, strict=True)}
        found.append(Further(float(places[best]), own, 0.5 * float(gains[best]), shrinks))
    return tuple(sorted(found, key=lambda each: -each.gain))
