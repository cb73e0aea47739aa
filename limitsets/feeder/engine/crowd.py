"""Several parts on one arm at once, in the engine: thrown together, in contact, and what may be asked of them.

What is assumed stands in docs/many_parts.md.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.base import AnswerError
from limitsets.feeder.engine.member import (
    FLYING,
    HINGED,
    LOOSE,
    OUT,
    Depression,
    Film,
    Member,
    Recording,
    Rest,
    ground_of,
    lying,
    on_arm,
    rest_of,
)
from limitsets.feeder.engine.stage import IDLE, ITERATIONS, OVERLAP, TAKEN_BACK, check_contact, pymunk_module

if TYPE_CHECKING:
    from limitsets.feeder.engine.member import Ground
    from limitsets.feeder.scene import Scene


# ---------------------------------------------------------------- What can be asked of a crowd


def area_of(scene: Scene) -> float:
    """Area of the part's outline [length^2]."""
    x, y = scene.vertices.T
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def check_asked(
    scenes: Sequence[Scene], contact: str, mu: float | None, sliding: float, e: float, step: float
) -> None:
    """Refuse parts that are not on one arm, and contacts that cannot be."""
    for name in ("unit", "kappa", "surface_height", "arm_length", "cavity"):
        values = {repr(getattr(scene, name)) for scene in scenes}
        if len(values) > 1:
            remedy = "parts on one arm share it, its throw and its cavity"
            raise AnswerError(f"{name} of the scenes", ", ".join(sorted(values)), "one value", remedy)
    check_contact(contact, e, step, 0.05)
    remedies = "give world.friction in the scene, or pass friction=0.5", "pass sliding=0.2"
    for name, value, remedy in zip(("on the arm", "elsewhere"), (mu, sliding), remedies, strict=True):
        if value is None or not 0.0 <= value < math.inf:
            raise AnswerError(f"the friction {name}", value, "a number from 0", remedy)


# ---------------------------------------------------------------- By how much two convex polygons overlap


Corners = Sequence[tuple[float, float]]


def depth_of_overlap(one: Corners, two: Corners) -> float:
    """Give the least distance by which one has to move so that two convex polygons only touch; below 0 they are apart.

    Negative values are lower bounds of the distance between them.

    Parameters
    ----------
    one, two : sequence of (float, float)
        Corners, counterclockwise [length].

    Returns
    -------
    float
        [length].

    Source: the theorem of separating axes: two convex polygons are apart if and only if a side's line separates them.

    Examples
    --------
    >>> square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    >>> depth_of_overlap(square, [(x + 0.75, y) for x, y in square])
    0.25
    """
    return min(_along_sides(one, two), _along_sides(two, one))


def _along_sides(one: Corners, two: Iterable[tuple[float, float]]) -> float:
    """Least depth of the other polygon's deepest corner behind a side of this one."""
    others, least = list(two), math.inf
    for (x0, y0), (x1, y1) in zip(one, [*one[1:], one[0]], strict=True):
        along, up = x1 - x0, y1 - y0
        length = math.hypot(along, up)
        depth = max((y - y0) * along - (x - x0) * up for x, y in others) / length
        least = min(least, depth)
    return least


# ----------------------------------------------------------------
# The space of a crowd, and who touches whom in it.


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


# ----------------------------------------------------------------
# Several parts on one arm at once, in the engine: thrown together, in contact with each other and with the ground.


# Time [rad] between two looks at who is asleep or lost, and between two frames of a film.
LOOK, FRAME = 0.1, 0.04


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
        Whether parts push each other.
    watch : bool
        Whether `overlapped` tells which outlines have met where parts do not push each other; slow for very many.
    carried : bool
        Whether the cavity is part of the arm, as the paper's was, and all that lies in it is thrown; else only those
        parts are that touch the arm's surface with a corner or have their centre of mass before its end.
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
        watch: bool = True,
        carried: bool = True,
        friction: float | None = None,
        sliding: float = 0.2,
        restitution: float | None = None,
        masses: Sequence[float] | None = None,
        step: float = 4e-3,
        patience: float = 60.0,
        record: bool = False,
        wall: float | None = None,
        depressions: Sequence[Depression] = (),
    ) -> None:
        scene = scenes[0]
        mu = scene.world.friction if friction is None else friction
        e = (scene.world.restitution or 0.0) if restitution is None else restitution
        check_asked(scenes, contact, mu, sliding, e, step)
        self.hinged, self.between, self.carried = contact == "hinge", between, carried
        self.step, self.patience = step, patience
        self.ground, self.cavity = ground_of(scene, depressions=depressions, wall=wall), scene.cavity
        masses = [area_of(each) for each in scenes] if masses is None else masses
        self.members = [Member(each, k, float(masses[k])) for k, each in enumerate(scenes)]
        self.contacts = Touching(self.ground, self.members, between, watch, scene.kappa, step)
        self.contacts.rub(mu or 0.0, sliding, e)
        self.space = self.contacts.space
        unit = 1.0 if scene.gravity is None else math.sqrt(scene.kappa / scene.gravity)
        self.film, self.count = Film(record, unit, self.members), 0
        self.awake = max(int(0.5 * IDLE / step), 1)  # steps in which nothing falls asleep

    @property
    def overlapped(self) -> set[tuple[int, int]]:
        """Parts whose outlines have come into contact so far, the lower number first."""
        return self.contacts.overlapped

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
        if x <= self.ground.end:
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
                near = math.dist(pose[:2], other.pose()[:2]) < member.reach + other.reach
                if near and other.mode != OUT and depth_of_overlap(corners, other.world()) > most:
                    thing = f"the places of parts {other.number} and {number}"
                    remedy = "move one of them: the engine would throw them apart"
                    raise AnswerError(thing, "overlapping", "outlines that do not overlap", remedy)
        self.space.add(member.body, member.shape)
        member.mode, member.shape.filter = LOOSE, self.contacts.on_all

    def take(self, number: int) -> None:
        """Take a part out of play."""
        member = self.members[number]
        if member.mode != OUT:
            member.let_go(self.space)
            self.space.remove(member.body, member.shape)
            member.mode = OUT
            self.contacts.forget(number)

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
        for member in self.members:
            if member.mode == OUT or not (self.carried or on_arm(member, self.ground)):
                continue
            member.let_go(self.space)
            member.level(lying(member))
            member.release(1.0 + deviation, float(shifts.get(member.number, 0.0)), self.step)
            member.mode, member.due = (FLYING, 1) if self.hinged else (LOOSE, 0)
            member.shape.filter = self.contacts.off_arm if self.hinged else self.contacts.on_all
            self._mark("thrown", member.number)
        return self._run()

    def settle(self) -> list[Rest]:
        """Wait until all parts are at rest, with no throw."""
        return self._run()

    def rests(self) -> list[Rest]:
        """Where all parts are now."""
        return [rest_of(each, self.ground, self.cavity) for each in self.members]

    def recording(self) -> Recording:
        """Give what was kept since the crowd was made."""
        return self.film.recording(self.ground)

    def _run(self) -> list[Rest]:
        """Step until all are at rest; Python acts only where a part may come down, or a film wants a frame."""
        last, look, frame = math.ceil(self.patience / self.step), 0, 0 if self.film.on else math.inf
        looks, frames = (max(round(time / self.step), 1) for time in (LOOK, FRAME))
        step, forward, contacts = self.step, self.space.step, self.contacts
        for each in self.members:
            each.met, each.lost = {}, each.lost and each.mode == OUT
        while self.count < last:
            held = [each for each in self.members if each.mode in (FLYING, HINGED)]
            if self.count >= look:
                look = self.count + looks
                if not self._moving():
                    break
            if self.count >= frame:
                frame = self.count + frames
                self.film.frame(self.count * step)
            until = min(last, look, frame, *(each.due for each in held))
            contacts.struck.clear()
            while self.count < until and not contacts.struck:
                forward(step)
                self.count += 1
            for each in held:
                if self.count >= each.due or each.number in contacts.struck:
                    (self._fly if each.mode == FLYING else self._turn)(each)
            self._mark("impact", *contacts.news)
            contacts.news.clear()
        rests = self.rests()
        self.film.end(self.count * step, rests)
        self.count = 0
        return rests

    def _mark(self, word: str, *numbers: int) -> None:
        self.film.mark(self.count * self.step, numbers, word)

    def _moving(self) -> bool:
        """Whether any part is in motion; those that have fallen off are taken out."""
        moves = False
        for each in self.members:
            if each.mode != OUT and not each.body.is_sleeping:
                moves = True
                if each.body.position.y < self.ground.bottom:
                    self._mark("lost", each.number)
                    self.take(each.number)
                    each.lost = True
        return moves

    def _fly(self, member: Member) -> None:
        """Look whether a part in flight has come down; on the arm its corner is held from then on."""
        strike = member.struck(self.step)
        if strike is None:
            member.due = self.count + (
                1 if self.contacts.any_of(member.number) else member.steps_to_arm(self.step)
            )
        elif self.ground.is_arm(member.corner_at(*strike, self.step)):
            member.catch(self.space, *strike, self.step)
            member.met["arm"] = None
            self._mark("impact", member.number)
            self._turn(member)
        else:
            member.mode, member.shape.filter = LOOSE, self.contacts.on_all

    def _turn(self, member: Member) -> None:
        """Look whether the face of a held part comes down: there it lies, or else tips over the end."""
        wait = member.steps_to_face(self.step)
        if wait > 0:
            wait = min(wait, self.awake)
            if self.contacts.any_of(member.number):
                member.soften(self.space.collision_bias)
                wait = 1
            else:
                member.body.activate()  # it may stand on its corner for long, but not for good
            member.due = self.count + wait
            return
        side, x, _ = member.coming_down()
        if side != member.side:
            self._mark("roll", member.number)
        member.mode, member.shape.filter = LOOSE, self.contacts.on_all
        if x > self.ground.end and self.cavity is not None and self.cavity.tips == "moving":
            member.let_go(self.space)  # the end of the arm stops the face, not the part
            return
        member.lie_down(self.space)
        # the engine's memory breaks where a body is put to sleep that is in contact with one awake
        if member.body.position.x <= self.ground.end and not self.contacts.any_of(member.number):
            member.body.sleep()
