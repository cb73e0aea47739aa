"""One part of a crowd: the ground, its way from release to rest, and what is kept of its motion for films.

Velocities in a crowd's space are those of half a step later, so that the engine's steps are exact in free flight
(`limitsets.feeder.engine.stage`).  The impact on the joint is the engine's, in a space of the part's own: an instant
in the common one would spoil what its solver remembers of the other contacts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, repeat
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError
from limitsets.feeder.engine.stage import LEANING, faces_about, nearest, pymunk_module, set_up
from limitsets.feeder.geometry import side_ends

if TYPE_CHECKING:
    from limitsets.feeder.scene import Cavity, Scene
    from limitsets.feeder.scene.surroundings import Outline


# ----------------------------------------------------------------
# What stands still: the arm up to its end, the cavity's ramp, floor and far wall, and depressions in the arm.
#
# Convex polygons as thick as a part is long, so that nothing comes out on the other side.  Lengths are the scene's,
# from the joint.  This file makes no engine objects but in `Ground.shapes`.


@dataclass(frozen=True, eq=False)
class Piece:
    """One convex polygon of the ground.

    Attributes
    ----------
    name : str
        "arm", "ramp", "floor", "wall", or "depression": the bottom of one. Of a cavity by polygon the first edge is the
        ramp, the last the wall, and all between are floor.
    corners : ndarray, shape (m, 2)
        Counterclockwise [length].
    """

    name: str
    corners: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Ground:
    """The world that stands still.

    Attributes
    ----------
    pieces : tuple of Piece
        Its polygons.
    height : float
        Of the arm's surface over the joint [length].
    end : float
        Where the arm ends [length].
    bottom : float
        Below this height a part is lost [length].
    """

    pieces: tuple[Piece, ...]
    height: float
    end: float
    bottom: float

    @property
    def polygons(self) -> tuple[NDArray[np.float64], ...]:
        """The polygons without their names."""
        return tuple(piece.corners for piece in self.pieces)

    def is_arm(self, x: float) -> bool:
        """Whether the arm's surface lies below."""
        arm = (piece.corners[:, 0] for piece in self.pieces if piece.name == "arm")
        return any(float(along.min()) <= x <= float(along.max()) for along in arm)

    def shapes(self, on: Any) -> dict[str, list[Any]]:
        """Make the engine's shapes on a body of a space, by name; friction and the like are the caller's."""
        pymunk = pymunk_module()
        made: dict[str, list[Any]] = {}
        for piece in self.pieces:
            made.setdefault(piece.name, []).append(pymunk.Poly(on, piece.corners.tolist()))
        return made


Depression = tuple[float, float, "float | Outline"]
"""Where a depression begins, its width, and its depth, with upright walls and a level bottom, or its outline."""


def depth_of(hollow: float | Outline) -> float:
    """Give how deep a depression is, by its depth or its outline."""
    return hollow if isinstance(hollow, float | int) else -min(y for _, y in hollow)


def ground_of(scene: Scene, *, depressions: Sequence[Depression] = (), wall: float | None = None) -> Ground:
    """Lay out the ground of a scene.

    Parameters
    ----------
    scene : Scene
        The arm goes up to its cavity, or else to its length; towards the joint it goes on by a part's size, so that
        parts that have come off the working range lie there.
    depressions : sequence of (float, float, float or tuple of (float, float))
        Where each begins, its width, and its depth, with upright walls and a level bottom, or its outline from where it
        begins [length].
    wall : float, optional
        How high the cavity's far wall stands over the arm's surface; default as far as the arm reaches, higher than
        parts fly [length].

    Returns
    -------
    Ground

    Raises
    ------
    AnswerError
        Depressions that overlap or leave the arm.

    Examples
    --------
    >>> import limitsets as ls
    >>> tree = ls.load("paper-designed").as_dict()
    >>> cavity = {"position": "20 in", "width": "9.3 in", "depth": "5 in", "angle": "32.23 deg"}
    >>> [piece.name for piece in ground_of(ls.load({**tree, "cavity": cavity})).pieces]
    ['arm', 'ramp', 'floor', 'wall']
    """
    cavity, height = scene.cavity, scene.surface_height
    thick = 2.0 * float(np.hypot(*np.ptp(scene.vertices, axis=0)))
    end = scene.arm_length if cavity is None else cavity.position
    deep = max([0.0 if cavity is None else cavity.depth, *(depth_of(hollow) for _, _, hollow in depressions)])
    low = height - deep - thick
    # depth and width are rounded where the ramp meets the wall
    least = 0.0 if cavity is None else 1e-6 * cavity.width

    def block(name: str, left: float, right: float, top: float) -> Piece:
        return Piece(name, np.array([[left, low], [right, low], [right, top], [left, top]]))

    def slabs(names: Iterable[str], start: float, outline: Outline) -> Iterator[Piece]:
        """Cut the ground below an outline between its corners, upright."""
        for name, ((left, y1), (right, y2)) in zip(names, pairwise(outline), strict=False):
            if right - left > least:
                corners = [[left, low], [right, low], [right, height + y2], [left, height + y1]]
                yield Piece(name, np.array(corners) + np.array([start, 0.0]))

    pieces, at = [], -thick
    for left, width, hollow in sorted(depressions, key=itemgetter(0)):
        depth = depth_of(hollow)
        if not (left >= at and width > 0.0 and depth > 0.0 and left + width <= end):
            allowed = f"one after the other, from the joint to the arm's end at {end:g} {scene.unit}"
            raise AnswerError("a depression (from, width, depth)", (left, width, depth), allowed, "move it")
        if left > at:
            pieces.append(block("arm", at, left, height))
        outline = ((0.0, -depth), (width, -depth)) if isinstance(hollow, float | int) else hollow
        pieces += slabs(repeat("depression"), left, outline)
        at = left + width
    if at < end:
        pieces.append(block("arm", at, end, height))
    if cavity is not None:
        line, past = cavity.line, end if wall is None else wall
        pieces += slabs(["ramp", *["floor"] * (len(line) - 3), "wall"], end, line)
        far, top = end + line[-1][0], height + line[-1][1]
        pieces.append(block("wall", far, far + thick, top + past))
    return Ground(tuple(pieces), height, end, low)


# ----------------------------------------------------------------
# One part of a crowd: its release, its way down to the arm, and the joint that holds the struck vertex.


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
        strike = None
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
            if strike is None or back > strike[0]:
                strike = back, vertex
        return strike

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
        self.faces, self.low, self.high = faces_about(self.flat, vertex, pose[2])

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

    def lie_down(self, space: Any) -> None:
        """Lie on the face that comes down, at rest, and let go of the corner."""
        side, x, angle = self.coming_down()
        self.let_go(space)
        self.stand((x, self.scene.surface_height + float(self.scene.sides.d[side]), angle))

    def soften(self, bias: float) -> None:
        """Let the joint take back its drift as slowly as contacts their overlap, or they would never rest."""
        if self.joint.error_bias != bias:  # to set it wakes the part
            self.joint.error_bias = bias

    def let_go(self, space: Any) -> None:
        """Take the joint away, if there is one."""
        if self.joint is not None:
            space.remove(self.joint)
            self.joint = None


# ---------------------------------------------------------------- Where a part of a crowd has come to rest


# Corners lower than this fraction of the part's size touch the arm.
TOUCHING = 1e-3
# On the ramp, where a part's own errors of contact add up, it is this fraction.
ON_RAMP = 0.01


@dataclass(frozen=True)
class Rest:
    """Where a part is after a throw.

    Attributes
    ----------
    number : int
        The part.
    where : str
        ``"arm"``: on a side, before the end; ``"beyond"``: on a side on the arm with its centre of mass beyond the
        end, balanced or slower than the engine's measure of rest; ``"leaning"``: before the end, on no side;
        ``"cavity"``: at rest beyond the end otherwise; ``"lost"``: it fell off, and is out of play; ``"unfinished"``:
        still in motion when patience ended; ``"out"``: not in play.
    x : float
        Of the centre of mass [length].
    side : int
        The one that lies on the arm or, in the cavity, on the ramp; -1 for none.
    pose : (float, float, float)
        x, y of the centre of mass from the joint [length], and the angle, continuous in time [rad].
    met : tuple of str
        What it came into contact with in this throw, in this order: names of `Piece`, ``"part 1"``, ...
    """

    number: int
    where: str
    x: float
    side: int
    pose: tuple[float, float, float]
    met: tuple[str, ...]


def rest_of(member: Member, ground: Ground, cavity: Cavity | None) -> Rest:
    """Say where a part is."""
    x, y, angle = member.pose()
    side = lying(member) if member.mode != OUT and member.body.is_sleeping else -1
    if member.mode == OUT:
        where = "lost" if member.lost else "out"
    elif not member.body.is_sleeping:
        where = "unfinished"
    elif side >= 0:
        where = "arm" if x <= ground.end else "beyond"
    elif x <= ground.end or cavity is None:
        where = "leaning"
    else:
        where, side = "cavity", _on_ramp(member, ground, cavity)
    return Rest(member.number, where, x, side, (x, y, angle), tuple(member.met))


def lying(member: Member) -> int:
    """Which side lies on the arm; -1 for none."""
    side, off = nearest(member.body.angle, member.flat)
    height = member.scene.surface_height + float(member.scene.sides.d[side])
    flat = off < LEANING and abs(member.body.position.y - height) < TOUCHING * member.size
    return side if flat else -1


def _on_ramp(member: Member, ground: Ground, cavity: Cavity) -> int:
    side, off = nearest(member.body.angle + cavity.angle, member.flat)
    corners, ends = member.world(), side_ends(len(member.corners), side)
    slope = math.tan(cavity.angle)
    over = [corners[end][1] - ground.height + slope * (corners[end][0] - ground.end) for end in ends]
    return side if off < LEANING and max(map(abs, over)) < ON_RAMP * member.size else -1


def on_arm(member: Member, ground: Ground) -> bool:
    """Whether the arm carries it: a corner touches the surface, or the centre of mass is before the end."""
    near = TOUCHING * member.size
    touches = any(abs(y - ground.height) < near and x <= ground.end for x, y in member.world())
    return touches or member.body.position.x <= ground.end


# ----------------------------------------------------------------
# What is kept of a motion in the engine, for films: poses by time, outlines, the ground, and what happened
# when.


Mark = tuple[float, int, str]
"""Time, number of the part, and a word of `MARKS`."""

MARKS = ("thrown", "impact", "roll", "rest", "in the cavity", "ejected", "lost")
"""Words for what happens to a part."""


@dataclass(frozen=True, eq=False)
class Recording:
    """Poses of parts by time.

    Attributes
    ----------
    times : ndarray, shape (frames,)
        Seconds if the scene knows its speed, else in units of 1/w; ascending.
    poses : ndarray, shape (frames, parts, 3)
        x and y of the centre of mass, from the joint [length], and the angle [rad]; nan once a part is taken out.
    outlines : tuple of ndarray, shape (n_k, 2)
        Corners of each part about its centre of mass, at angle 0 [length].
    ground : tuple of ndarray, shape (m, 2)
        Convex polygons that stand still, the arm level [length].
    arm : ndarray, shape (frames,)
        Angle of the arm [rad], 0 when level.
    marks : tuple of (float, int, str)
        Time, part and word: one of `MARKS`.
    """

    times: NDArray[np.float64]
    poses: NDArray[np.float64]
    outlines: tuple[NDArray[np.float64], ...]
    ground: tuple[NDArray[np.float64], ...]
    arm: NDArray[np.float64]
    marks: tuple[Mark, ...] = ()

    def corners(self, frame: int, part: int) -> NDArray[np.float64]:
        """Give where the corners of a part are in a frame, shape (n_k, 2) [length].

        Examples
        --------
        >>> import numpy as np
        >>> square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        >>> pose = np.array([[[5.0, 1.0, np.pi / 2]]])
        >>> kept = Recording(np.zeros(1), pose, (square,), (), np.zeros(1))
        >>> kept.corners(0, 0)[0].round(12).tolist()
        [6.0, 0.0]
        """
        x, y, angle = self.poses[frame, part]
        cos, sin = np.cos(angle), np.sin(angle)
        turned: NDArray[np.float64] = self.outlines[part] @ np.array([[cos, sin], [-sin, cos]]) + (x, y)
        return turned


# ----------------------------------------------------------------
# Poses and marks of a crowd, kept while it moves.


class Film:
    """Frames and marks; where nothing is to be kept, it only counts the time.

    Attributes
    ----------
    on : bool
        Whether to keep anything.
    unit : float
        Seconds per rad of the throw's turn, 1 where they are not known.
    start : float
        When the present throw began, in these.
    """

    def __init__(self, on: bool, unit: float, members: Sequence[Member]) -> None:
        self.on, self.unit, self.start, self.members = on, unit, 0.0, members
        self.frames: list[tuple[float, list[tuple[float, float, float]]]] = []
        self.marks: list[Mark] = []
        self.inside: set[int] = set()  # the parts in the cavity

    def mark(self, time: float, numbers: Iterable[int], word: str) -> None:
        """Keep what happens to parts, so long after the throw began [rad]."""
        if self.on:
            self.marks += [(self.start + time * self.unit, number, word) for number in numbers]

    def frame(self, time: float) -> None:
        """Keep where all are."""
        if self.on:
            poses = [(math.nan,) * 3 if each.mode == OUT else each.pose() for each in self.members]
            self.frames.append((self.start + time * self.unit, poses))

    def end(self, time: float, rests: Iterable[Rest]) -> None:
        """Keep where all have come to rest; the next throw begins there."""
        self.frame(time)
        inside = set()
        for rest in rests:
            # in motion: it has not come out
            still = rest.where == "unfinished" and rest.number in self.inside
            if rest.where == "cavity" or still:
                inside.add(rest.number)
            elif rest.number in self.inside and rest.where != "out":
                self.mark(time, [rest.number], "ejected")
            if rest.where in ("arm", "beyond", "leaning"):
                self.mark(time, [rest.number], "rest")
        self.mark(time, sorted(inside - self.inside), "in the cavity")
        self.inside = inside
        self.start += time * self.unit

    def recording(self, ground: Ground) -> Recording:
        """Give what was kept."""
        times = np.array([time for time, _ in self.frames])
        poses = np.array([pose for _, pose in self.frames]).reshape(times.size, len(self.members), 3)
        outlines = tuple(np.array(each.corners) for each in self.members)
        return Recording(times, poses, outlines, ground.polygons, np.zeros(times.size), tuple(self.marks))
