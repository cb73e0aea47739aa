"""What a pass is: a kick of the plate, and a part that comes by; drawn by laws that are named."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.engine.depression import Motion, Plate, Pose, fall_speed
from limitsets.errors import AnswerError
from limitsets.files import as_table
from limitsets.scene.scene import require_rests
from limitsets.scene.tray import heights_over_sides

if TYPE_CHECKING:
    from limitsets.scene import Scene, Tray


def random_of(seed: int, *number: int) -> np.random.Generator:
    """Give the random numbers of one trial: the same whatever else is drawn, where and in which order."""
    return np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, *number))))


@dataclass(frozen=True, eq=False)
class Passes:
    """The plate, the side wanted, and the laws of what happens in a pass.

    A kick throws every part at rest, on the plate and in depressions: up with the speed |N| s, turning at the
    rate N s/size, N from the normal law of standard deviation 1, s = sqrt(2 g agitation) and size the part's
    longest side, so that the ends of that side leave with speeds that differ by s; and along the plate with a
    speed that is uniform from 0 to sqrt(2 g wash). A part that comes by falls from the height `agitation`
    over a place uniform on one pitch about the middle of the depression, turned by a uniform angle, moving
    along and turning as after a kick.

    Attributes
    ----------
    plate : Plate
        Part and depression in the engine.
    tray : Tray
        Sizes, agitation and wash.
    side : int
        The side wanted.
    """

    plate: Plate
    tray: Tray
    side: int

    @property
    def right(self) -> int:
        """Number of the state in which a part lies in the depression rightly."""
        return 1 + self.side

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states of a depression, by their numbers."""
        count = len(self.plate.part.sides)
        flush = (f"side {i}" for i in range(count))
        return "empty", *flush, *(f"leaning, vertex {k} lowest" for k in range(count))

    @property
    def kick_speed(self) -> float:
        """Standard deviation of a kick's velocity [length per unit of time]."""
        return fall_speed(self.plate.size, self.tray.agitation)

    def kick(self, random: np.random.Generator) -> Motion:
        """Draw what a kick of the plate does to a part at rest."""
        up, turning = random.normal(0.0, self.kick_speed, 2).tolist()
        along = random.uniform(0.0, fall_speed(self.plate.size, self.tray.wash))
        return Motion(along, abs(up), turning / self.plate.size)

    def arrival(self, random: np.random.Generator) -> tuple[Pose, Motion]:
        """Draw a part that comes by."""
        x = random.uniform(-0.5, 0.5) * self.tray.pitch
        angle = random.uniform(0.0, math.tau)
        return self.plate.lowered(x, angle, self.tray.agitation), self.kick(random)._replace(up=0.0)

    def again(self, pose: Pose, random: np.random.Generator) -> tuple[Pose, Motion]:
        """Draw how a part that lies on the plate comes by: kicked and washed on, the next depression being equal."""
        x = math.remainder(pose.x, self.tray.pitch)
        return Pose(x, pose.y, pose.angle), self.kick(random)

    def to_json(self) -> dict[str, Any]:
        """Give what was drawn, and with which contact."""
        plate = self.plate
        return as_table(
            **{name: getattr(self.tray, name) for name in self.tray.__dataclass_fields__},
            friction=plate.friction,
            restitution=plate.restitution,
            contact="unilateral",
            step=plate.step,
        )


def passes_of(scene: Scene, side: int | None, step: float) -> Passes:
    """Read what is asked of a scene; refuse one that lacks something.

    Raises
    ------
    AnswerError
        No [tray], no effects.contact, no friction or restitution, or a side the part has not.
    """

    def refuse(thing: str, value: object, allowed: str, remedy: str, key: str) -> AnswerError:
        return AnswerError(thing, value, allowed, remedy, key=key, file=scene.file)

    tray = scene.tray
    if tray is None:
        require_rests(scene)
        remedy = "add [tray] with depression_width, depression_depth, pitch, agitation and wash"
        raise refuse("the scene", "without [tray]", "one with a tray", remedy, "tray")
    if not scene.effects.contact:
        remedy = "a part in a depression touches its walls: write contact = true in [effects]"
        raise refuse("contact", None, "true", remedy, "effects.contact")
    facts = {"friction": scene.world.friction, "restitution": scene.world.restitution}
    for name, given in facts.items():
        if given is None:
            remedy = f"the engine needs it: add {name} to [world]"
            raise refuse(f"the {name}", None, "a number from 0", remedy, f"world.{name}")
    wanted = getattr(scene.goal, "side", None) if side is None else side
    if wanted is None or not 0 <= wanted < len(scene.sides):
        allowed = f"0 to {len(scene.sides) - 1}"
        remedy = "pass side= (--side), or give the scene a goal with a side"
        raise refuse("the side wanted", wanted, allowed, remedy, "goal")
    if tray.depression_width < scene.sides.length[wanted]:
        allowed = f"at least {scene.sides.length[wanted]:.6g} {scene.unit}, the length of side {wanted}"
        remedy = "the part cannot lie in it: widen it"
        raise refuse("the width", tray.depression_width, allowed, remedy, "tray.depression_width")
    height = heights_over_sides([(float(x), float(y)) for x, y in scene.vertices])[wanted]
    if tray.depression_depth >= height:
        allowed = f"below {height:.6g} {scene.unit}, the height of the part on side {wanted}"
        remedy = "the depression is deeper than the part, and nothing would pop out: make it less deep"
        raise refuse("the depth", tray.depression_depth, allowed, remedy, "tray.depression_depth")
    if not 0.0 < step <= 0.02:
        raise AnswerError("the engine's step", step, "above 0 and at most 0.02", "pass step=4e-3")
    friction, restitution = float(facts["friction"] or 0.0), float(facts["restitution"] or 0.0)
    plate = Plate(scene, tray.depression_width, tray.depression_depth, friction, restitution, step)
    return Passes(plate, tray, wanted)
