"""One part of a crowd: its release, its way down to the arm, and the joint that holds the struck vertex.

Velocities in a crowd's space are those of half a step later, so that the engine's steps are exact in free flight
(`limitsets.engine.stage`).  The impact on the joint is the engine's, in a space of the part's own: an instant in the
common one would spoil what its solver remembers of the other contacts.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from limitsets.engine.hinged import LEANING
from limitsets.engine.stage import pymunk_module, set_up

if TYPE_CHECKING:
    from limitsets.scene import Scene

OUT, FLYING, HINGED, LOOSE = "out", "flying", "hinged", "loose"
"""Not in play; in flight and not in contact with the arm; held at a vertex; left to the engine's own contact."""

ROUNDS = 30  # of Newton's method, which ends long before


def whole_steps(gap: float, speed: float, gain: float, step: float) -> int:
    """Count the steps, one at least, in which nothing covers a gap that begins at a speed and gains so much."""
    time = (math.sqrt(speed * speed + 2.0 * gain * gap) - speed) / gain if gap > 0.0 else 0.0
    return max(int(time / step), 1)


class Member:
    """A part in a crowd's space."""

    def __init__(self, scene: Scene, number: int, mass: float) -> None:
        pymunk = pymunk_module()
        self.scene, self.number, self.mode, self.due = scene, number, OUT, 0
        self.twin = set_up(scene, scene.arm_length, 0)
        self.corners, self.flat, self.size = self.twin.corners, self.twin.flat, self.twin.size
        self.polar = [(math.hypot(x, y), math.atan2(y, x)) for x, y in self.corners]
        self.reach = max(radius for radius, _ in self.polar)
        self.body = pymunk.Body(mass, mass * scene.radius_of_gyration**2)
        self.shape = pymunk.Poly(self.body, self.corners)
        self.joint: Any = None
        self.place: tuple[float, ...] = ()
        self.vertex = self.side = -1
        self.faces = (0, 0)
        self.low = self.high = 0.0
        self.met: dict[str, None] = {}  # in this order
        self.lost = False

    def world(self) -> list[tuple[float, float]]:
        """Where its corners are."""
        (x, y), angle = self.body.position, self.body.angle
        return [(x + r * math.cos(angle + a), y + r * math.sin(angle + a)) for r, a in self.polar]

    def pose(self) -> tuple[float, float, float]:
        """Place of the centre of mass, and angle."""
        (x, y), angle = self.body.position, self.body.angle
        return x, y, angle

    def level(self, side: int) -> None:
        """Take back what contacts overlap from a part that lies on a side, if it does; the side it is thrown from."""
        self.side = side
        if side >= 0:
            (x, _), angle = self.body.position, self.body.angle
            off = math.remainder(angle - self.flat[side], math.tau)
            self.stand((x, self.scene.surface_height + float(self.scene.sides.d[side]), angle - off))

    def stand(self, pose: tuple[float, float, float]) -> None:
        """Put it somewhere, at rest."""
        body = self.body
        body.position, body.angle = pose[:2], pose[2]
        body.velocity, body.angular_velocity = (0.0, 0.0), 0.0

    def release(self, speed: float, shift: float, step: float) -> None:
        """Let it go with the velocity of a turn about the joint, shifted along the arm by what its landing scatters."""
        body, kappa = self.body, self.scene.kappa
        x, y = body.position
        body.velocity = (-speed * y, speed * x - 0.5 * kappa * step)
        body.angular_velocity = speed
        body.position = (x + shift, y)

    def steps_to_arm(self, step: float) -> int:
        """Count the steps in which no corner can come down to the arm."""
        body = self.body
        gap = min(y for _, y in self.world()) - self.scene.surface_height
        speed = abs(body.angular_velocity) * self.reach - body.velocity.y
        return whole_steps(gap, speed, self.scene.kappa, step)

    def struck(self, step: float) -> tuple[float, int] | None:
        """How long ago a corner came down to the arm, in the last step, and which; None while all are above."""
        body, kappa = self.body, self.scene.kappa
        y, angle, rate = body.position.y - self.scene.surface_height, body.angle, body.angular_velocity
        rise = body.velocity.y + 0.5 * kappa * step
        found = None
        for vertex, (radius, phase) in enumerate(self.polar):
            if y + radius * math.sin(angle + phase) >= 0.0:
                continue
            back = 0.0
            for _ in range(ROUNDS):
                turned = angle + phase - rate * back
                over = y - rise * back - 0.5 * kappa * back * back + radius * math.sin(turned)
                slope = -rise - kappa * back - rate * radius * math.cos(turned)
                if slope <= 0.0 or abs(over) < 1e-14 * self.size or back >= step:
                    break
                back -= over / slope
            back = min(max(back, 0.0), step)
            if found is None or back > found[0]:
                found = back, vertex
        return found

    def before(self, back: float, step: float) -> tuple[tuple[float, float, float], tuple[float, float]]:
        """Its pose and velocity so long ago, in flight."""
        (x, y), (across, up) = self.body.position, self.body.velocity
        kappa = self.scene.kappa
        up += 0.5 * kappa * step
        angle = self.body.angle - self.body.angular_velocity * back
        pose = x - across * back, y - up * back - 0.5 * kappa * back * back, angle
        return pose, (across, up + kappa * back)

    def corner_at(self, back: float, vertex: int, step: float) -> float:
        """Where along the arm a corner was so long ago."""
        (x, _, angle), _ = self.before(back, step)
        radius, phase = self.polar[vertex]
        return x + radius * math.cos(angle + phase)

    def catch(self, space: Any, back: float, vertex: int, step: float) -> None:
        """Put a joint at a corner as it strikes the arm; the engine finds the velocities after that.

        The part goes on from there in the next step: its clock is late by less than a step then.
        """
        pymunk, body, twin = pymunk_module(), self.body, self.twin
        pose, velocity = self.before(back, step)
        twin.body.position, twin.body.angle = pose[:2], pose[2]
        twin.body.velocity, twin.body.angular_velocity = velocity, body.angular_velocity
        corner = self.corners[vertex]
        self.place = tuple(twin.body.local_to_world(corner))
        twin.kick(0.5 * step)
        joint = pymunk.PivotJoint(twin.space.static_body, twin.body, self.place)
        joint.error_bias = 1.0  # nothing to correct yet
        twin.strike(joint)
        body.position, body.angle = pose[:2], pose[2]
        body.velocity, body.angular_velocity = twin.body.velocity, twin.body.angular_velocity
        self.joint = pymunk.PivotJoint(space.static_body, body, self.place, corner)
        self.joint.error_bias = 0.0  # all of the drift is corrected in the next step
        space.add(self.joint)
        self.mode, self.vertex = HINGED, vertex
        count = len(self.flat)
        self.faces = -vertex % count, (1 - vertex) % count
        right, left = (self.flat[face] for face in self.faces)
        self.low = pose[2] - ((pose[2] - right + LEANING) % math.tau - LEANING)
        self.high = self.low + (left - right) % math.tau

    def steps_to_face(self, step: float) -> int:
        """Count the steps in which no face can come down; 0 where one does in the next."""
        body = self.body
        angle, rate = body.angle, body.angular_velocity
        if not self.low < angle + rate * step < self.high:
            return 0
        radius = self.polar[self.vertex][0]
        gain = self.scene.kappa * radius / (self.scene.radius_of_gyration**2 + radius * radius)
        gap = min(angle - self.low, self.high - angle) - abs(rate) * step
        return whole_steps(gap, abs(rate), gain, step)

    def coming_down(self) -> tuple[int, float, float]:
        """Which face of a held part comes down, where its centre of mass is along the arm then, and its angle."""
        ends = (self.low, self.faces[0]), (self.high, self.faces[1])
        angle, side = min(ends, key=lambda end: abs(self.body.angle - end[0]))
        radius, phase = self.polar[self.vertex]
        return side, self.place[0] - radius * math.cos(angle + phase), angle

    def lie_down(self, space: Any) -> int:
        """Lie on the face that comes down, at rest, and let go of the corner; which side."""
        side, x, angle = self.coming_down()
        self.let_go(space)
        self.stand((x, self.scene.surface_height + float(self.scene.sides.d[side]), angle))
        return side

    def soften(self, bias: float) -> None:
        """Let the joint take back its drift as slowly as contacts their overlap, or they would never rest."""
        if self.joint.error_bias != bias:  # to set it wakes the part
            self.joint.error_bias = bias

    def let_go(self, space: Any) -> None:
        """Take the joint away, if there is one."""
        if self.joint is not None:
            space.remove(self.joint)
            self.joint = None
