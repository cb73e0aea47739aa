"""Whether two parts thrown together come into each other's way, were they to pass through each other.

A part flies with its release's velocity until the throw map's impact; then it turns about the corner that struck, held,
until the side lies down on which the map lets it rest.  Angles are those of the arm's speed of this throw: time is w t.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from limitsets.assembly.pairing import Start, angle_on, outline_at
from limitsets.engine.overlaps import depth_of_overlap
from limitsets.scene import Scene
from limitsets.thrower import impact_angles

# Parts nearer than this share of the first one's longest side are taken to overlap.
TOLERANCE = 5e-3
# Step in which a part turns about the corner that struck [rad], and when turning is given up.
STEP, PATIENCE = 4e-3, 12.0


@dataclass(frozen=True, eq=False)
class Way:
    """How a part moves in one throw.

    Attributes
    ----------
    scene : Scene
        The part.
    start : (float, int)
        Where it lies at first.
    kappa : float
        Of this throw [length].
    phi : float
        Time of its impact [rad].
    struck : int
        The corner that strikes.
    turns : tuple of float
        Angles by which it has turned since, at multiples of `STEP`; the last one is that at rest [rad].
    in_flight, turning : float
        No point of the part is faster before and after the impact [length].
    """

    scene: Scene
    start: Start
    kappa: float
    phi: float
    struck: int
    turns: tuple[float, ...]
    in_flight: float
    turning: float

    @property
    def ends(self) -> float:
        """When it lies still."""
        return self.phi + STEP * (len(self.turns) - 1)

    def speed(self, time: float) -> float:
        """No point of the part is faster from a time on [length]."""
        if time >= self.ends:
            return 0.0
        return self.turning if time >= self.phi else max(self.in_flight, self.turning)

    def corners(self, time: float) -> list[tuple[float, float]]:
        """Where its corners are.

        Parameters
        ----------
        time : float
            From release, times the angular speed of the throw [rad].
        """
        if time <= self.phi:
            return _in_flight(self.scene, self.start, self.kappa, time)
        at, last = (time - self.phi) / STEP, len(self.turns) - 1
        k = min(int(at), last)
        part = min(at - k, 1.0) if k < last else 0.0
        angle = self.turns[k] + part * (self.turns[min(k + 1, last)] - self.turns[k])
        landed = _in_flight(self.scene, self.start, self.kappa, self.phi)
        (px, py), cos, sin = landed[self.struck], math.cos(angle), math.sin(angle)
        return [
            (px + (x - px) * cos - (y - py) * sin, py + (x - px) * sin + (y - py) * cos) for x, y in landed
        ]


def _in_flight(scene: Scene, start: Start, kappa: float, phi: float) -> list[tuple[float, float]]:
    x, side = start
    height = scene.surface_height + float(scene.sides.d[side])
    rise = height + (x - 0.5 * kappa * phi) * phi
    return outline_at(scene, x - height * phi, rise, angle_on(scene, side) + phi)


def way_of(scene: Scene, params: Any, start: Start, side: int) -> Way:
    """Follow a part through a throw.

    Parameters
    ----------
    scene : Scene
        The part, in the minimal model or with `landing`.
    params : Throw or FullThrow
        The throw map at the speed of this throw.
    start : (float, int)
        Where it lies.
    side : int
        On which side the map lets it come to rest.
    """
    x, before = start
    kappa = float(getattr(params, "bare", params).kappa)
    phi = float(impact_angles(params, [x], before)[0])
    reach = max(math.dist(corner, scene.centre) for corner in scene.vertices.tolist())
    height = scene.surface_height + float(scene.sides.d[before])
    if not math.isfinite(phi):  # outside the model: it stays where it is
        return Way(scene, start, kappa, 0.0, 0, (0.0,), 0.0, 0.0)
    landed = _in_flight(scene, start, kappa, phi)
    # the left corner, unless the scene lets another one land before it
    count = len(landed)
    struck = (
        min(range(count), key=lambda k: landed[k][1]) if "landing" in scene.effects.on() else -before % count
    )
    right = x - height * phi - landed[struck][0]
    above = height + (x - 0.5 * kappa * phi) * phi - landed[struck][1]
    inertia = scene.radius_of_gyration**2 + right**2 + above**2
    # plastic impact: angular momentum about the corner is kept
    rate = (scene.radius_of_gyration**2 + right * (x - kappa * phi) + above * height) / inertia
    sides = (side - before) % count
    turned = sum(float(scene.sides.corner[(before + k) % count]) for k in range(sides))
    turns, fastest = _turned(turned - phi, rate, (right, above), inertia, kappa)
    in_flight = math.hypot(height, max(abs(x), abs(x - kappa * phi))) + reach
    return Way(scene, start, kappa, phi, struck, turns, in_flight, 2.0 * reach * fastest)


def _turned(
    target: float, rate: float, centre: tuple[float, float], inertia: float, kappa: float
) -> tuple[tuple[float, ...], float]:
    """Turn about the corner until it has turned by `target`: angles by time, and the greatest rate."""
    (right, above), angle, fastest, angles = centre, 0.0, abs(rate), [0.0]

    def pull(angle: float) -> float:
        return -kappa * (right * math.cos(angle) - above * math.sin(angle)) / inertia

    gain = pull(angle)
    while len(angles) * STEP < PATIENCE:
        angle += STEP * (rate + 0.5 * STEP * gain)
        after = pull(angle)
        rate, gain = rate + 0.5 * STEP * (gain + after), after
        fastest = max(fastest, abs(rate))
        if (target <= 0.0 and angle <= target) or (target >= 0.0 and angle >= target):
            break
        angles.append(angle)
    return (*angles, target), fastest


def meet(one: Way, two: Way) -> bool:
    """Whether the outlines of two parts overlap at any time of a throw.

    As nothing is faster than the ways' speeds, times are left out in which the parts cannot have met: no overlap is
    missed, and parts that come closer than `TOLERANCE` count as overlapping.
    """
    least = TOLERANCE * float(one.scene.sides.length.max())
    time, last = 0.0, max(one.ends, two.ends)
    while True:
        apart = -depth_of_overlap(one.corners(time), two.corners(time))
        if apart < least:
            return True
        if time >= last:
            return False
        speed = one.speed(time) + two.speed(time)
        time = min(time + apart / speed, last) if speed > 0.0 else last
