"""The space of a crowd, and who touches whom in it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from limitsets.engine.member import FLYING, HINGED, Member
from limitsets.engine.settling import IDLE
from limitsets.engine.stage import ITERATIONS, OVERLAP, TAKEN_BACK, pymunk_module

if TYPE_CHECKING:
    from limitsets.engine.ground import Ground

# A part slower than this share of the speed of a fall by its own size is idle.
SLOW = 3e-3
# Collision type of parts; pieces of the ground have those beyond.
PART = 1
ARM, OTHERS = 1, 2  # categories of shapes


class Touching:
    """A space with the ground in it, and its contacts.

    Attributes
    ----------
    space : pymunk.Space
        The engine's.
    on_all, off_arm : pymunk.ShapeFilter
        Of parts that meet everything, and of those that the arm lets through.
    overlapped : set of (int, int)
        Parts whose outlines have come into contact so far, the lower number first.
    struck : set of int
        Parts in flight, or held at a corner, that something has met since this was cleared.
    """

    def __init__(
        self, ground: Ground, members: Sequence[Member], between: bool, watch: bool, kappa: float, step: float
    ) -> None:
        pymunk = pymunk_module()
        size = min(member.size for member in members)
        self.between, self.members = between, members
        self.space = space = pymunk.Space()
        space.gravity = (0.0, -kappa)
        space.iterations = ITERATIONS
        space.collision_slop = OVERLAP * size
        space.collision_bias = (1.0 - TAKEN_BACK) ** (1.0 / step)
        space.sleep_time_threshold = IDLE
        space.idle_speed_threshold = SLOW * math.sqrt(kappa * size)
        group = 0 if between or watch else 1  # of shapes that do not see each other
        self.on_all = pymunk.ShapeFilter(group, OTHERS)
        self.off_arm = pymunk.ShapeFilter(group, OTHERS, self.on_all.mask ^ ARM)
        self.names: dict[int, str] = {}
        self.pieces: list[Any] = []
        for kind, (name, shapes) in enumerate(ground.shapes(space.static_body).items(), PART + 1):
            self.names[kind] = name
            for shape in shapes:
                shape.collision_type = kind
                shape.filter = pymunk.ShapeFilter(categories=ARM if name == "arm" else OTHERS)
            self.pieces += shapes
            space.add(*shapes)
        for kind in (PART, *self.names):
            space.on_collision(PART, kind, begin=self._begins, separate=self._ends)
        self.numbers = {member.shape: member.number for member in members}
        self.pairs: set[tuple[int, int]] = set()
        self.overlapped: set[tuple[int, int]] = set()
        self.struck: set[int] = set()
        self.news: list[int] = []

    def rub(self, friction: float, sliding: float, restitution: float) -> None:
        """Set friction on the arm and elsewhere, and restitution; the engine multiplies the numbers of two shapes."""
        own, bounce = max(math.sqrt(sliding), 1e-6), math.sqrt(restitution)
        for shape in self.pieces:
            shape.friction = (friction if self.names[shape.collision_type] == "arm" else sliding) / own
            shape.elasticity = bounce
        for member in self.members:
            member.shape.friction, member.shape.elasticity = own, bounce
            member.shape.collision_type = PART

    def any_of(self, number: int) -> bool:
        """Whether a part touches anything."""
        return any(number in pair for pair in self.pairs)

    def forget(self, number: int) -> None:
        """Drop the contacts of a part that was taken out."""
        self.pairs = {pair for pair in self.pairs if number not in pair}

    def _pair(self, arbiter: Any) -> tuple[int, int]:
        """Numbers of what meets, the lower first; pieces of the ground have negative ones."""
        one, two = (self.numbers.get(shape, -shape.collision_type) for shape in arbiter.shapes)
        return (one, two) if one < two else (two, one)

    def _begins(self, arbiter: Any, _space: Any, _data: Any) -> None:
        pair = self._pair(arbiter)
        if pair[0] >= 0:
            self.overlapped.add(pair)
            if not self.between:
                arbiter.process_collision = False
                return
        self.pairs.add(pair)
        for number, other in (pair, pair[::-1]):
            if number >= 0:
                member = self.members[number]
                name = f"part {other}" if other >= 0 else self.names[-other]
                if name not in member.met:
                    member.met[name] = None
                    self.news.append(number)
                if member.mode in (FLYING, HINGED):
                    self.struck.add(number)

    def _ends(self, arbiter: Any, _space: Any, _data: Any) -> None:
        self.pairs.discard(self._pair(arbiter))
