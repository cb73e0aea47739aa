"""A part over the arm in the engine: bodies, units and time steps.

Lengths are those of the scene; the unit of time is 1/w, so that the arm turns at rate 1, gravity is kappa, and a time
in flight is the angle by which the part has turned.  Mass 1; the joint is the origin.

The engine's step moves the part with its present velocity and then changes the velocity (symplectic Euler, first
order). With the velocity at the middle of the step, as in `Stage.drift`, it is exact for a parabola and a steady turn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeAlias

from limitsets.errors import AnswerError
from limitsets.geometry import side_ends

if TYPE_CHECKING:
    from pymunk import Body, Poly, Segment, Shape, Space

    from limitsets.scene import Scene

INSTANT = 1e-12
"""A step as short as this lets the solver act and moves nothing."""
OVERLAP = 1e-4
"""What contacts may overlap for good, as a fraction of the part's size: without any they would come and go."""
# Of the overlap beyond that so much is taken back in each step, without adding to the velocity.
TAKEN_BACK = 0.2
# Two contacts with friction on one body; more change nothing.
ITERATIONS = 40

State: TypeAlias = tuple[Any, float, Any]


def pymunk_module() -> ModuleType:
    """Import the engine.

    Raises
    ------
    AnswerError
        pymunk is not installed.
    """
    try:
        import pymunk
    except ImportError as error:
        remedy = "pip install 'limitsets[engine]', or pip install pymunk"
        raise AnswerError("the rigid-body engine", "not installed", "pymunk", remedy) from error
    return pymunk


@dataclass(frozen=True)
class Stage:
    """One part in a space of its own.

    Attributes
    ----------
    space, body, part : pymunk.Space, pymunk.Body, pymunk.Poly
        The engine's objects.
    corners : tuple of pairs
        Vertices about the centre of mass, in the scene's order [length].
    flat : tuple of float
        The body's angle when it rests on each side [rad].
    height, kappa : float
        Of the arm's surface over the joint, and gravity [length].
    size : float
        Length of the longest side [length].
    """

    space: Space
    body: Body
    part: Poly
    corners: tuple[tuple[float, float], ...]
    flat: tuple[float, ...]
    height: float
    kappa: float
    size: float

    def kick(self, time: float) -> None:
        """Give the velocity that gravity adds in `time`, which may be negative."""
        (across, up), (along, down) = self.body.velocity, self.space.gravity
        self.body.velocity = (across + along * time, up + down * time)

    def drift(self, time: float) -> None:
        """Fly freely, from the velocity at the start of the step to that at its end."""
        self.kick(0.5 * time)
        self.space.step(time)
        self.kick(-0.5 * time)

    def gap(self) -> float:
        """Height of the part's lowest point over the arm."""
        return float(self.part.cache_bb().bottom) - self.height

    def lowest(self) -> int:
        """Which vertex is lowest."""
        heights = [self.body.local_to_world(corner).y for corner in self.corners]
        return heights.index(min(heights))

    def strike(self, against: Any) -> None:
        """Let the solver answer a joint or a shape within an instant.

        It is taken away again: the engine starts each step from the impulses of the last one, in proportion to the
        steps' lengths, and an impact is no force that goes on.
        """
        self.space.add(against)
        self.space.step(INSTANT)
        self.space.remove(against)

    def arm(self, on: Body, far: float, friction: float, restitution: float, step: float) -> Segment:
        """Make the arm's surface, as far as that from the joint, and let it meet the part in steps of this length.

        It is as thick as the part is long, which so never comes out on the other side.
        """
        low = self.height - self.size
        arm: Segment = pymunk_module().Segment(on, (-far, low), (far, low), self.size)
        self.meet([arm], friction, restitution, step)
        return arm

    def meet(self, ground: Sequence[Shape], friction: float, restitution: float, step: float) -> None:
        """Let shapes of the ground meet the part with this friction and restitution, in steps of this length."""
        for shape in ground:
            shape.friction = shape.elasticity = 1.0  # the engine takes products
        self.part.friction, self.part.elasticity = friction, restitution
        self.space.iterations = ITERATIONS
        self.space.collision_slop = OVERLAP * self.size
        self.space.collision_bias = (1.0 - TAKEN_BACK) ** (1.0 / step)

    def state(self) -> State:
        """Remember where the part is in flight; its rate of turning does not change."""
        return self.body.position, self.body.angle, self.body.velocity

    def restore(self, state: State) -> None:
        """Go back to a remembered state."""
        self.body.position, self.body.angle, self.body.velocity = state


def set_up(scene: Scene, x: float, side: int) -> Stage:
    """Put a part on the arm at the moment of release: it has the velocity of a turn at rate 1 about the joint."""
    pymunk = pymunk_module()
    height, d = scene.surface_height, float(scene.sides.d[side])
    flat = []
    for each in range(len(scene.vertices)):
        left, right = side_ends(len(scene.vertices), each)
        along, up = (scene.vertices[right] - scene.vertices[left]).tolist()
        flat.append(-math.atan2(up, along))
    about = (scene.vertices - scene.centre).tolist()
    corners = tuple((across, up) for across, up in about)
    body = pymunk.Body(1.0, scene.radius_of_gyration**2)
    body.angle = flat[side]
    body.position = (x, height + d)
    body.velocity = (-(height + d), x)
    body.angular_velocity = 1.0
    part = pymunk.Poly(body, corners)
    space = pymunk.Space()
    space.gravity = (0.0, -scene.kappa)
    space.add(body, part)
    size = float(scene.sides.length.max())
    return Stage(space, body, part, corners, tuple(flat), height, scene.kappa, size)
