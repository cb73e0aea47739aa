"""One part and one depression of a plate, until it rests; and where a part is seated.

The depression's middle is at x = 0, the plate's surface at y = 0.  Lengths are those of the scene; gravity is one size
(the part's longest side) per unit of time squared, so that nothing depends on a throw.  Mass 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError, arguments_checked
from limitsets.feeder.engine.member import ground_of
from limitsets.feeder.engine.stage import IDLE, LEANING, Stage, nearest, pymunk_module, set_up
from limitsets.feeder.geometry import side_ends

if TYPE_CHECKING:
    from limitsets.feeder.scene import Cavity, Scene
    from limitsets.feeder.scene.surroundings import Outline


# ----------------------------------------------------------------
# Where a part is seated in the cavity: a side on the ramp, slid down to the wall, the floor or the parts below.


SEATED = 0.01
"""So much of the mouth's width a seated part's corners are off its seat at most: less than the play of
studies/sizes.toml, 0.1 of 9.3 in.  A part farther off keeps the next one from fitting."""

Points = NDArray[np.float64]


@arguments_checked
def seat_of(scene: Scene, side: int, below: Sequence[Points] = ()) -> Points:
    """Give the corners of a part seated in its scene's cavity.

    Parameters
    ----------
    scene : Scene
        With a cavity.
    side : int
        The side on the ramp.
    below : sequence of ndarray, shape (m, 2)
        Corners of parts that are seated already [length].

    Returns
    -------
    ndarray, shape (n, 2)
        In the scene's order, from the joint [length].

    Raises
    ------
    AnswerError
        For a scene without [cavity], and for a part that would stand out of it.

    Examples
    --------
    >>> import limitsets as ls
    >>> cavity = {"position": "20 in", "width": "9.3 in", "depth": "5.8633 in", "angle": "32.23 deg"}
    >>> scene = ls.load({**ls.load("paper-designed").as_dict(), "cavity": cavity})
    >>> seat_of(scene, 2).round(2).tolist()
    [[29.3, -2.44], [23.55, -2.44], [29.26, -6.04]]
    """
    cavity = scene.cavity
    if cavity is None:
        remedy = "add [cavity] with position, width, depth and angle"
        raise AnswerError("the scene", "without [cavity]", "one with a cavity", remedy)
    left, right = side_ends(len(scene.vertices), side)
    along, up = (scene.vertices[right] - scene.vertices[left]).tolist()
    turn = -cavity.angle - math.atan2(up, along)
    cos, sin = math.cos(turn), math.sin(turn)
    corners = (scene.vertices - scene.vertices[left]) @ np.array([[cos, sin], [-sin, cos]])
    # from so far up the ramp's line that nothing is met yet
    down = np.array([math.cos(cavity.angle), -math.sin(cavity.angle)])
    size = 2.0 * float(np.hypot(*np.ptp(scene.vertices, axis=0)))
    corners += np.array([cavity.position, scene.surface_height]) - size * down
    way = [way_down(cavity, corners, (cavity.position, scene.surface_height))]
    for other in below:
        way += [_ahead(corner, other, down) for corner in corners]
        way += [_ahead(corner, corners, -down) for corner in other]
    seated: Points = corners + min(way) * down
    out = max(float(seated[:, 1].max()) - scene.surface_height, cavity.position - float(seated[left, 0]))
    if out > 0.0:
        remedy = "widen or deepen the cavity, or let another side lie on the ramp"
        thing = f"the part on side {side} in the cavity"
        raise AnswerError(thing, f"standing out by {out:.4g} {scene.unit}", "a part that fits", remedy)
    return seated


def way_down(cavity: Cavity, corners: Points, end: tuple[float, float] = (0.0, 0.0)) -> float:
    """Say how far a part that lies on the ramp's line can slide down it until it meets the ground.

    Parameters
    ----------
    cavity : Cavity
        Of which the ground is.
    corners : ndarray, shape (n, 2)
        Of the part [length].
    end : (float, float)
        Where the arm ends [length].

    Examples
    --------
    >>> from limitsets.feeder.scene import Cavity
    >>> corners = np.array([[0.0, 0.0], [1.0, -1.0], [1.0, 0.0]])
    >>> chain = (0.0, 0.0), (4.0, -4.0), (4.0, 0.0)
    >>> ways = [way_down(Cavity(9.0, 4.0, 4.0, np.pi / 4, outline=line), corners) for line in ((), chain)]
    >>> np.round(ways, 12).tolist()
    [4.242640687119, 4.242640687119]
    """
    down = np.array([math.cos(cavity.angle), -math.sin(cavity.angle)])
    if not cavity.outline:
        wall, floor = end[0] + cavity.width, end[1] - cavity.depth
        return min(
            float(((wall - corners[:, 0]) / down[0]).min()), float(((floor - corners[:, 1]) / down[1]).min())
        )
    # the wall goes on upwards, higher than the part can be
    line = np.array([*cavity.outline, (cavity.outline[-1][0], 1e3 * float(np.ptp(corners)))]) + end
    over = (line - end) @ (-down[1], down[0])  # over the ramp's line
    ways = [math.inf]
    for (start, stop), most in zip(pairwise(line[1:]), over[2:], strict=True):
        if most > 0.0:  # an edge below that line is not met, nor the back of a bump
            ways += [_ahead(corner, [start, stop], down) for corner in corners]
    ways += [
        _ahead(corner, corners, -down)
        for corner, high in zip(line, over, strict=True)
        if high > 1e-9 * over.max()
    ]
    return min(ways)


@arguments_checked
def off_seat(corners: Sequence[tuple[float, float]], seat: Points) -> float:
    """Give by how much the corner that is farthest from its seat is off.

    Parameters
    ----------
    corners : sequence of (float, float)
        Corners of the part [length].
    seat : ndarray, shape (n, 2)
        Where they should be [length].

    Returns
    -------
    float
        The largest distance [length].

    Examples
    --------
    >>> import numpy as np
    >>> off_seat([(0.0, 0.0), (1.0, 0.0)], np.array([[0.0, 0.0], [1.0, 0.5]]))
    0.5
    """
    return float(np.hypot(*(np.asarray(corners) - seat).T).max())


def _ahead(point: Points, outline: Sequence[Points] | Points, way: Points) -> float:
    """How far a point can go this way until it meets an outline."""
    nearest = math.inf
    for one, two in pairwise([*outline, outline[0]]):
        side, to = two - one, one - point
        across = way[0] * side[1] - way[1] * side[0]
        if abs(across) <= 1e-9 * math.hypot(side[0], side[1]):  # along it: its ends are met on other sides
            continue
        time = (to[0] * side[1] - to[1] * side[0]) / across
        share = (to[0] * way[1] - to[1] * way[0]) / across
        if time >= 0.0 and -1e-9 <= share <= 1.0 + 1e-9:
            nearest = min(nearest, float(time))
    return nearest


# ----------------------------------------------------------------
# One part and one depression of a plate: it falls, hits the edges, rolls over or lies down in it, until it rests.


EMPTY, UNFINISHED = 0, -1
"""States in which no part rests in the depression: none of it is below the plate's surface; it did not come to rest."""

# A part that is less far below the surface than this share of its size is not in the depression.
IN_IT = 1e-3
FAR = 60.0
"""The plate goes on to either side for so many sizes of the part."""


class Pose(NamedTuple):
    """Where a part is: its centre of mass [length], and the angle by which it is turned [rad]."""

    x: float
    y: float
    angle: float


class Motion(NamedTuple):
    """How it moves: along the plate and up [length per unit of time], turning [rad per unit of time]."""

    along: float
    up: float
    turning: float


class Rest(NamedTuple):
    """How a motion ended.

    `state`: `EMPTY`, `UNFINISHED`, 1 + i for a part that lies flush on side i on the floor of the depression, or
    1 + n + k for one that leans in it, vertex k lowest, of a part with n sides.  `side`: on which side a part that is
    not in the depression lies on the plate, else -1.  `time`: until it rested.
    """

    pose: Pose
    state: int
    side: int
    time: float


def fall_speed(size: float, height: float) -> float:
    """Give the speed at the end of a fall from a height [length per unit of time].

    Examples
    --------
    >>> fall_speed(2.0, 1.0)
    2.0
    """
    return math.sqrt(2.0 * size * height)


@dataclass(frozen=True)
class Plate:
    """A plate with one depression, and the part that falls into it.

    Attributes
    ----------
    part : Scene
        The part; of its arm and throw nothing is used.
    width, depth : float
        Of the depression [length].
    outline : tuple of (float, float)
        Of the depression, from its left edge, where it is a polygon [length].
    friction, restitution : float
        Of the engine's contact: Coulomb's law, and Newton's restitution.
    step, patience : float
        The engine's step, and when to give up [units of time].
    """

    part: Scene
    width: float
    depth: float
    friction: float
    restitution: float
    step: float = 4e-3
    patience: float = 60.0
    outline: Outline = ()

    @property
    def size(self) -> float:
        """Length of the part's longest side [length]."""
        return float(self.part.sides.length.max())

    def ground(self) -> tuple[NDArray[np.float64], ...]:
        """Give the polygons of the plate: left and right of the depression, and its floor."""
        far = FAR * self.size
        level = replace(self.part, surface_height=0.0, arm_length=2.0 * far, cavity=None)
        hollow = (far - 0.5 * self.width, self.width, self.outline or self.depth)
        return tuple(corners - (far, 0.0) for corners in ground_of(level, depressions=[hollow]).polygons)

    def lowered(self, x: float, angle: float, height: float) -> Pose:
        """Give the pose of a part over x, turned by an angle, whose lowest point is at a height."""
        about = self.part.vertices - self.part.centre
        low = float((about[:, 0] * math.sin(angle) + about[:, 1] * math.cos(angle)).min())
        return Pose(x, height - low, angle)

    def seated(self, side: int, x: float = 0.0) -> Pose:
        """Give the pose of a part on a side on the floor of the depression, the middle of its side at x."""
        offset = float(self.part.sides.a[side]) - 0.5 * float(self.part.sides.length[side])
        return self.lowered(x + offset, self._stage().flat[side], -self.depth)

    def settle(
        self, pose: Pose, motion: Motion, watch: Callable[[float, Pose, Motion], None] | None = None
    ) -> Rest:
        """Let a part move from here until it rests.

        Parameters
        ----------
        pose, motion : Pose, Motion
            Where it begins; it may not overlap the plate.
        watch : callable, optional
            Told time, pose and motion at the start and after each step.

        Returns
        -------
        Rest
        """
        stage = self._stage()
        space, body = stage.space, stage.body
        shapes = [pymunk_module().Poly(space.static_body, corners.tolist()) for corners in self.ground()]
        stage.meet(shapes, self.friction, self.restitution, self.step)
        space.add(*shapes)
        body.position, body.angle = (pose.x, pose.y), pose.angle
        body.velocity, body.angular_velocity = (motion.along, motion.up), motion.turning
        space.sleep_time_threshold = IDLE
        time = 0.0
        while time <= self.patience and not body.is_sleeping:
            if watch is not None:
                watch(time, *_seen(body))
            space.step(self.step)
            time += self.step
        return self._rest(stage, time)

    def _stage(self) -> Stage:
        return set_up(replace(self.part, kappa=self.size, surface_height=0.0), 0.0, 0)

    def _rest(self, stage: Stage, time: float) -> Rest:
        body = stage.body
        pose = _seen(body)[0]
        if not body.is_sleeping:
            return Rest(pose, UNFINISHED, -1, time)
        heights = [float(body.local_to_world(corner).y) for corner in stage.corners]
        return Rest(pose, *state_of(heights, body.angle, stage.flat, self.depth, self.size), time)


def state_of(
    heights: Sequence[float], angle: float, flat: Sequence[float], depth: float, size: float
) -> tuple[int, int]:
    """Say how a part at rest lies: state and side, as in `Rest`, from the heights of its corners over the plate."""
    side, off = nearest(angle, flat)
    flush, low = off < LEANING, heights.index(min(heights))
    if -heights[low] < IN_IT * size:
        return EMPTY, side if flush else -1
    if flush and -heights[low] > depth - IN_IT * size:
        return 1 + side, -1
    return 1 + len(flat) + low, -1


def _seen(body: Any) -> tuple[Pose, Motion]:
    pose = Pose(float(body.position.x), float(body.position.y), float(body.angle))
    return pose, Motion(float(body.velocity.x), float(body.velocity.y), float(body.angular_velocity))
