"""Several parts on one arm at once, in the engine: thrown together, in contact with each other and with the ground.

What is assumed stands in docs/many_parts.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from limitsets.engine.asking import area_of, check_asked
from limitsets.engine.filming import Film
from limitsets.engine.ground import ground_of
from limitsets.engine.member import FLYING, HINGED, LOOSE, OUT, Member
from limitsets.engine.overlaps import depth_of_overlap
from limitsets.engine.recording import Recording
from limitsets.engine.rests import Rest, lying, on_arm, rest_of
from limitsets.engine.settling import IDLE
from limitsets.engine.stage import OVERLAP
from limitsets.engine.touching import Touching
from limitsets.errors import AnswerError

if TYPE_CHECKING:
    from limitsets.scene import Scene

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
        depressions: Sequence[tuple[float, float, float]] = (),
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
        found = self.rests()
        self.film.end(self.count * step, found)
        self.count = 0
        return found

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
        found = member.struck(self.step)
        if found is None:
            member.due = self.count + (
                1 if self.contacts.any_of(member.number) else member.steps_to_arm(self.step)
            )
        elif self.ground.is_arm(member.corner_at(*found, self.step)):
            member.catch(self.space, *found, self.step)
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
