"""Several parts on one arm at once, in the engine: thrown together, in contact with each other and with the ground.

What is assumed stands in docs/crowds.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.engine.ground import ground_of
from limitsets.engine.member import FLYING, HINGED, LOOSE, OUT, Member
from limitsets.engine.overlaps import depth_of_overlap
from limitsets.engine.recording import Mark, Recording
from limitsets.engine.rests import Rest, lying, on_arm, rest_of
from limitsets.engine.settling import IDLE
from limitsets.engine.stage import ITERATIONS, OVERLAP, TAKEN_BACK, pymunk_module
from limitsets.errors import AnswerError

if TYPE_CHECKING:
    from limitsets.scene import Scene

__all__ = ["Crowd"]

# A part slower than this share of the speed of a fall by its own size is idle.
SLOW = 1e-3
# Time [rad] between two looks at who is asleep or lost, and between two frames of a film.
LOOK, FRAME = 0.1, 0.04
# Collision types: parts; pieces of the ground have those beyond.
PART = 1
ARM, OTHERS = 1, 2  # categories of shapes


class Crowd:
    """Parts in one engine space.

    Parameters
    ----------
    scenes : sequence of Scene
        One part each, of its outline, centre of mass and radius of gyration; arm, gravity and cavity are those of all.
    contact : str
        ``"hinge"``: a corner that comes down on the arm is held by a joint until a face lies on the arm; then the part
        lies still until another one strikes it.  A corner that comes down beyond the arm's end, a part that was struck
        as it lay, the cavity and other parts meet the engine's own contact.  ``"unilateral"``: that contact for all.
    between : bool
        Whether parts push each other.  If not, `overlapped` still tells which outlines have met.
    carried : bool
        Whether the cavity is part of the arm, and all that lies in it is thrown; else only those parts are that touch
        the arm's surface with a corner or have their centre of mass before its end.
    friction : float, optional
        On the arm; from the first scene's world where not given.
    sliding : float
        Friction on the cavity's surfaces and between parts.  A part slides down the ramp if it is below tan(angle).
    restitution : float, optional
        Of the engine's own contact (Newton's); from the first scene's world where not given, or 0.
    masses : sequence of float, optional
        Default each part's area: plates of one thickness and material.  Only ratios matter.
    step : float
        The engine's, times the angular speed of the throw [rad].
    patience : float
        When a throw is given up, in the same measure [rad].
    record : bool
        Whether to keep poses for `recording`.
    wall, depressions
        As in `ground_of`.

    Attributes
    ----------
    overlapped : set of (int, int)
        Parts whose outlines have come into contact so far, the lower number first.
    ground : Ground
        What stands still.

    Raises
    ------
    AnswerError
        pymunk is not installed; scenes that do not share arm, gravity and cavity; a contact that cannot be.

    Examples
    --------
    >>> import limitsets as ls
    >>> scene = ls.load("paper-designed")
    >>> crowd = Crowd([scene, scene], friction=1.0)
    >>> crowd.place(0, 6.0, 2)
    >>> crowd.place(1, 15.0, 2)
    >>> [(rest.where, rest.side, round(rest.x, 3)) for rest in crowd.throw()]
    [('arm', 2, 6.073), ('arm', 2, 16.754)]
    """

    def __init__(
        self,
        scenes: Sequence[Scene],
        *,
        contact: str = "hinge",
        between: bool = True,
        carried: bool = False,
        friction: float | None = None,
        sliding: float = 0.2,
        restitution: float | None = None,
        masses: Sequence[float] | None = None,
        step: float = 4e-3,
        patience: float = 60.0,
        record: bool = False,
        wall: float | None = None,
        depressions: Sequence[tuple[float, float, float]] = (),
    ) -> None:
        pymunk, scene = pymunk_module(), scenes[0]
        mu = scene.world.friction if friction is None else friction
        e = (scene.world.restitution or 0.0) if restitution is None else restitution
        _check(scenes, contact, mu, sliding, e, step)
        self.contact, self.between, self.carried = contact, between, carried
        self.step, self.patience, self.record = step, patience, record
        self.ground, self.cavity = ground_of(scene, depressions=depressions, wall=wall), scene.cavity
        masses = [_area(each) for each in scenes] if masses is None else masses
        self.members = [Member(each, k, float(masses[k])) for k, each in enumerate(scenes)]
        self.unit = 1.0 if scene.gravity is None else math.sqrt(scene.kappa / scene.gravity)

        size = min(member.size for member in self.members)
        self.space = space = pymunk.Space()
        space.gravity = (0.0, -scene.kappa)
        space.iterations = ITERATIONS
        space.collision_slop = OVERLAP * size
        space.collision_bias = (1.0 - TAKEN_BACK) ** (1.0 / step)
        space.sleep_time_threshold = IDLE
        space.idle_speed_threshold = SLOW * math.sqrt(scene.kappa * size)
        # the engine takes the products of the numbers of two shapes
        own, bounce = max(math.sqrt(sliding), 1e-6), math.sqrt(e)
        self.names: dict[int, str] = {}
        for kind, (name, shapes) in enumerate(self.ground.shapes(space.static_body).items(), PART + 1):
            self.names[kind] = name
            for shape in shapes:
                shape.friction, shape.elasticity = ((mu or 0.0) if name == "arm" else sliding) / own, bounce
                shape.collision_type = kind
                shape.filter = pymunk.ShapeFilter(categories=ARM if name == "arm" else OTHERS)
            space.add(*shapes)
            space.on_collision(PART, kind, begin=self._strikes, separate=self._leaves)
        space.on_collision(PART, PART, begin=self._strikes, separate=self._leaves)
        self.on_all = pymunk.ShapeFilter(categories=OTHERS)
        self.off_arm = pymunk.ShapeFilter(categories=OTHERS, mask=self.on_all.mask ^ ARM)
        self.by_shape: dict[Any, Member] = {}
        for member in self.members:
            member.shape.friction, member.shape.elasticity = own, bounce
            member.shape.collision_type = PART
            self.by_shape[member.shape] = member

        self.count, self.elapsed = 0, 0.0
        self.touching: set[tuple[int, int]] = set()
        self.overlapped: set[tuple[int, int]] = set()
        self.struck: set[int] = set()
        self.frames: list[tuple[float, list[tuple[float, float, float]]]] = []
        self.marks: list[Mark] = []

    def place(self, number: int, x: float, side: int) -> None:
        """Lay a part on the arm; it comes into play if it was out.

        Raises
        ------
        AnswerError
            For a place off the arm, or over another part.
        """
        member = self.members[number]
        scene = member.scene
        if not (0 <= side < len(scene.sides) and float(scene.sides.a[side]) < x <= scene.arm_length):
            allowed = "a side of the part, and x from a of that side to the arm's length"
            raise AnswerError(f"the place of part {number}", (x, side), allowed, "lay it on the arm")
        self.drop(number, (x, scene.surface_height + float(scene.sides.d[side]), member.flat[side]))
        member.body.sleep()

    def drop(self, number: int, pose: tuple[float, float, float]) -> None:
        """Put a part anywhere, at rest, with a pose as in `Rest`; `settle` lets it fall.

        Raises
        ------
        AnswerError
            Where it overlaps another part.
        """
        member = self.members[number]
        self.take(number)
        member.stand(pose)
        if self.between:
            corners, most = member.world(), 2.0 * OVERLAP * member.size
            for other in self.members:
                if other.mode != OUT and depth_of_overlap(corners, other.world()) > most:
                    thing = f"the places of parts {other.number} and {number}"
                    remedy = "move one of them: the engine would throw them apart"
                    raise AnswerError(thing, "overlapping", "outlines that do not overlap", remedy)
        self.space.add(member.body, member.shape)
        member.mode, member.shape.filter = LOOSE, self.on_all

    def take(self, number: int) -> None:
        """Take a part out of play."""
        member = self.members[number]
        if member.mode != OUT:
            member.let_go(self.space)
            self.space.remove(member.body, member.shape)
            member.mode = OUT
            self.touching = {pair for pair in self.touching if number not in pair}

    def throw(
        self, deviation: float = 0.0, landing: Mapping[int, float] | Sequence[float] = ()
    ) -> list[Rest]:
        """Throw all parts that the arm carries, once, and wait until all are at rest.

        Parameters
        ----------
        deviation : float
            Of the arm's speed, relative, the same for all parts.
        landing : sequence or mapping of float
            By part how far the place where it lands is shifted along the arm [length].

        Returns
        -------
        list of Rest
            One per part, in the order of the scenes.
        """
        shifts = landing if isinstance(landing, Mapping) else dict(enumerate(landing))
        carried = [each for each in self.members if each.mode != OUT and self._is_carried(each)]
        for member in carried:
            member.let_go(self.space)
            member.level(lying(member))
            member.release(1.0 + deviation, float(shifts.get(member.number, 0.0)), self.step)
            hinged = self.contact == "hinge"
            member.mode, member.due = (FLYING, 1) if hinged else (LOOSE, 0)
            member.shape.filter = self.off_arm if hinged else self.on_all
            self._mark(member, "thrown")
        return self._run()

    def settle(self) -> list[Rest]:
        """Wait until all parts are at rest, with no throw."""
        return self._run()

    def rests(self) -> list[Rest]:
        """Where all parts are now."""
        found = []
        for each in self.members:
            if each.mode == OUT:
                x, y = each.body.position
                where = "lost" if each.lost else "out"
                found.append(Rest(each.number, where, x, -1, (x, y, each.body.angle), tuple(each.met)))
            else:
                found.append(rest_of(each, self.ground, self.cavity, each.body.is_sleeping))
        return found

    def recording(self) -> Recording:
        """What was kept since the crowd was made."""
        times = np.array([time for time, _ in self.frames])
        poses = np.array([pose for _, pose in self.frames]).reshape(times.size, len(self.members), 3)
        outlines = tuple(np.array(each.corners) for each in self.members)
        return Recording(
            times, poses, outlines, self.ground.polygons, np.zeros(times.size), tuple(self.marks)
        )

    def _is_carried(self, member: Member) -> bool:
        return self.carried or on_arm(member, self.ground)

    def _run(self) -> list[Rest]:
        """Step until all are at rest; Python acts only where a part may come down, or a film wants a frame."""
        last, look, frame = math.ceil(self.patience / self.step), 0, 0
        looks, frames = (max(round(time / self.step), 1) for time in (LOOK, FRAME))
        step, forward = self.step, self.space.step
        self.count = 0
        for each in self.members:
            each.met, each.lost = {}, each.lost and each.mode == OUT
        while self.count < last:
            held = [each for each in self.members if each.mode in (FLYING, HINGED)]
            if self.count >= look:
                look = self.count + looks
                if not self._moving():
                    break
            if self.record and self.count >= frame:
                frame = self.count + frames
                self._film()
            until = min(last, look, *(each.due for each in held), frame if self.record else last)
            self.struck.clear()
            while self.count < until and not self.struck:
                forward(step)
                self.count += 1
            for each in held:
                if self.count >= each.due or each.number in self.struck:
                    (self._fly if each.mode == FLYING else self._turn)(each)
        found = self.rests()
        for rest in found:
            if rest.where not in ("out", "lost", "unfinished"):
                self._mark(self.members[rest.number], "in the cavity" if rest.where == "cavity" else "rest")
        self._film()
        self.elapsed += self.count * step * self.unit
        self.count = 0
        return found

    def _moving(self) -> bool:
        """Whether any part is in motion; those that have fallen off are taken out."""
        moves = False
        for each in self.members:
            if each.mode != OUT and not each.body.is_sleeping:
                moves = True
                if each.body.position.y < self.ground.bottom:
                    self._mark(each, "lost")
                    self.take(each.number)
                    each.lost = True
        return moves

    def _fly(self, member: Member) -> None:
        """Look whether a part in flight has come down; on the arm its corner is held from then on."""
        found = member.struck(self.step)
        if found is None:
            member.due = self.count + (1 if self._touched(member) else member.steps_to_arm(self.step))
        elif self.ground.is_arm(member.corner_at(*found, self.step)):
            member.catch(self.space, *found, self.step)
            member.met["arm"] = None
            self._mark(member, "impact")
            self._turn(member)
        else:
            member.mode, member.shape.filter = LOOSE, self.on_all

    def _turn(self, member: Member) -> None:
        """Look whether the face of a held part comes down: there it lies, or else tips over the end."""
        wait = member.steps_to_face(self.step)
        if wait > 0:
            member.due = self.count + (1 if self._touched(member) else wait)
            return
        if member.lie_down(self.space) != member.side:
            self._mark(member, "roll")
        member.mode, member.shape.filter = LOOSE, self.on_all
        # the engine's memory breaks where a body is put to sleep that is in contact with one awake
        if member.body.position.x <= self.ground.end and not self._touched(member):
            member.body.sleep()

    def _touched(self, member: Member) -> bool:
        return any(member.number in pair for pair in self.touching)

    def _pair(self, arbiter: Any) -> tuple[int, int, str, str]:
        """Numbers of what meets, lower first, and names; pieces of the ground have negative numbers."""
        found = []
        for shape in arbiter.shapes:
            member = self.by_shape.get(shape)
            kind = shape.collision_type
            found.append(
                (-kind, self.names[kind]) if member is None else (member.number, f"part {member.number}")
            )
        (one, first), (two, second) = sorted(found)
        return one, two, first, second

    def _strikes(self, arbiter: Any, _space: Any, _data: Any) -> None:
        """Two shapes come into contact."""
        one, two, first, second = self._pair(arbiter)
        if one >= 0:
            self.overlapped.add((one, two))
            if not self.between:
                arbiter.process_collision = False
                return
        self.touching.add((one, two))
        for number, name in ((one, second), (two, first)):
            if number >= 0:
                member = self.members[number]
                if name not in member.met:
                    member.met[name] = None
                    self._mark(member, "impact")
                if member.mode in (FLYING, HINGED):
                    self.struck.add(number)

    def _leaves(self, arbiter: Any, _space: Any, _data: Any) -> None:
        one, two, *_ = self._pair(arbiter)
        self.touching.discard((one, two))

    def _mark(self, member: Member, word: str) -> None:
        if self.record:
            self.marks.append((self.elapsed + self.count * self.step * self.unit, member.number, word))

    def _film(self) -> None:
        if self.record:
            poses = [(math.nan,) * 3 if each.mode == OUT else each.pose() for each in self.members]
            self.frames.append((self.elapsed + self.count * self.step * self.unit, poses))


def _area(scene: Scene) -> float:
    x, y = scene.vertices.T
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def _check(
    scenes: Sequence[Scene], contact: str, mu: float | None, sliding: float, e: float, step: float
) -> None:
    """Refuse parts that are not on one arm, and contacts that cannot be."""
    for name in ("unit", "kappa", "surface_height", "arm_length", "cavity"):
        values = {repr(getattr(scene, name)) for scene in scenes}
        if len(values) > 1:
            remedy = "parts on one arm share it, its throw and its cavity"
            raise AnswerError(f"{name} of the scenes", ", ".join(sorted(values)), "one value", remedy)
    if contact not in ("hinge", "unilateral"):
        raise AnswerError("the contact", contact, "'hinge' or 'unilateral'", "choose one")
    if mu is None or not (0.0 <= mu < math.inf and 0.0 <= sliding < math.inf):
        remedy = "pass friction=0.5, or give world.friction in the scene"
        raise AnswerError("the friction", (mu, sliding), "numbers from 0", remedy)
    if not 0.0 <= e <= 1.0:
        raise AnswerError("the restitution", e, "0 to 1", "pass restitution=0 for a plastic contact")
    if not 0.0 < step <= 0.05:
        raise AnswerError("the engine's step", step, "above 0 and at most 0.05 rad", "pass step=4e-3")
