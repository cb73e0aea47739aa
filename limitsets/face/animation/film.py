"""A film as data: the poses in every frame, cut from legs, and the captions.  Writers only draw it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from limitsets.base import AnswerError, Progress
from limitsets.base.arrays import Array, Ints
from limitsets.face.plot.throwing import about_centre, turned
from limitsets.feeder.geometry import side_ends
from limitsets.feeder.scene import Scene

Extents = dict[int, list[tuple[float, float]]]


class Label(NamedTuple):
    """A word on a part, about its centre of mass, in the frame of its outline [length]."""

    word: str
    x: float
    y: float


class Mark(NamedTuple):
    """An event of a part: its frame, the frame up to which it is shown, its word and its place [length].

    The words are those of events in `limitsets.feeder.engine.member.Recording`.
    """

    frame: int
    until: int
    part: int
    word: str
    x: float
    y: float


class Rest(NamedTuple):
    """The rest of a part: the frame in which its throw begins, that of the rest, the place [length], a sentence."""

    begin: int
    frame: int
    x: float
    side: int
    sentence: str


@dataclass(frozen=True, eq=False)
class Lanes:
    """Facts about the places of rest, in one lane per side.

    Attributes
    ----------
    begin : tuple of float
        Least x at which the part can rest, by side [length].
    end : float
        Largest x at which it can rest [length].
    sets : tuple of dict
        Limit sets, or attractors: intervals by side.
    critical : dict of int to tuple of float
        Critical points by side.
    goal : tuple of (float, int) or None
        The goal's x and side.
    lines : tuple of (float, str)
        Other places, such as the place of a sensor, each with its words.
    known : tuple of dict
        Places at which a controller knows the part to be, for each state of the controller.
    """

    begin: tuple[float, ...]
    end: float
    sets: tuple[Extents, ...] = ()
    critical: dict[int, tuple[float, ...]] = field(default_factory=dict)
    goal: tuple[float, int] | None = None
    lines: tuple[tuple[float, str], ...] = ()
    known: tuple[Extents, ...] = ()


@dataclass(frozen=True, eq=False)
class Film:
    """A film, frame by frame; all frames are shown for the same time.

    Attributes
    ----------
    title : str
        What is shown.
    unit, clock : str
        Unit of lengths, and of times: "s", or "1/w" where no gravity is given.
    fps : float
        Frames per second when it is shown.
    about : str
        Speed of the film, and its motions that are drawn rather than computed.
    times : ndarray, shape (frames,)
        Since the beginning, in `clock`.
    poses : ndarray, shape (frames, parts, 3)
        Centre of mass [length], and the angle by which the outline has turned [rad].
    outlines : tuple of ndarray, shape (n, 2)
        Corners of each part about its centre of mass [length].
    labels : tuple of tuple of Label
        Words on each part.
    arm : ndarray, shape (frames,)
        Angle of the arm, 0 when level [rad].
    surface : tuple of (float, float) or None
        Height of the arm's surface over the joint, and where the arm ends [length]; None where the arm is ground.
    ground : tuple of ndarray, shape (m, 2)
        The cavity, which turns with the arm, in its place when the arm is level; fixed ground if the arm is ground.
    captions, notes : tuple of str
        Texts: the first line, and the second.
    caption, note : ndarray of int, shape (frames,)
        Numbers of the texts of each frame.
    trail : ndarray of int, shape (frames, 2)
        The frames between which the path of the first part's centre of mass is shown.
    marks : tuple of Mark
        Events.
    rests : tuple of Rest
        Places at which the first part came to rest.
    lanes : Lanes or None
        Lanes drawn beside the film.
    position : ndarray, shape (frames, 2)
        Where the first part is in the lanes: x [length], and the side, between two sides while it turns.
    stage : ndarray of int, shape (frames,)
        Number in ``lanes.known``, -1 for none.
    view : tuple of (float, float)
        Places that have to be in sight, besides those of the moving parts [length].
    """

    title: str
    unit: str
    clock: str
    fps: float
    about: str
    times: Array
    poses: Array
    outlines: tuple[Array, ...]
    labels: tuple[tuple[Label, ...], ...]
    arm: Array
    surface: tuple[float, float] | None
    ground: tuple[Array, ...]
    captions: tuple[str, ...]
    notes: tuple[str, ...]
    caption: Ints
    note: Ints
    trail: Ints
    marks: tuple[Mark, ...]
    rests: tuple[Rest, ...]
    lanes: Lanes | None
    position: Array
    stage: Ints
    view: tuple[tuple[float, float], ...] = ()

    @property
    def frames(self) -> int:
        """Number of frames."""
        return int(self.times.size)

    def polygon(self, frame: int, part: int = 0) -> Array:
        """Corners of a part in a frame, shape (n, 2) [length]."""
        x, y, angle = self.poses[frame, part].tolist()
        corners: Array = turned(self.outlines[part], angle) + np.array([x, y])
        return corners

    def arm_polygon(self, frame: int, thick: float) -> Array:
        """Corners of the arm in a frame, its surface first, shape (4, 2) [length]."""
        assert self.surface is not None  # asked where there is one
        height, end = self.surface
        corners = np.array([[0.0, height], [end, height], [end, height - thick], [0.0, height - thick]])
        return turned(corners, float(self.arm[frame]))

    def ground_polygons(self, frame: int) -> list[Array]:
        """Corners of the ground's pieces in a frame [length]."""
        return [turned(each, float(self.arm[frame])) for each in self.ground]


# ----------------------------------------------------------------
# Legs of a film, one after the other, cut into frames.


MOST_FRAMES = 6000
"""Largest number of frames of a film: four minutes."""

UNKNOWN = 0.4
"""Seconds that stand for 1/w where no gravity is given: a throw of the paper's feeder."""


class Leg(NamedTuple):
    """One stretch of motion in a film.

    Attributes
    ----------
    seconds : float
        Duration, at rate 1 of the film [s].
    pose : callable
        From shares of the duration, shape (n,), to poses in the room, shape (n, 3).
    arm : callable
        To angles of the arm, shape (n,).
    lane : callable
        To x and side in the lanes, shape (n, 2).
    caption, note : str
        First and second line of text.
    stage : int
        State of the controller, as a number.
    trail : bool
        Whether the path is drawn, from the first of such legs in a row.
    marks : tuple of (float, str, float, float)
        Share of the leg, word, and place.
    rest : tuple of (float, int, str) or None
        x, side and sentence where the part comes to rest at its end.
    begins : bool
        Whether a throw begins: the drawn path of the throw before is removed.
    """

    seconds: float
    pose: Callable[[Array], Array]
    arm: Callable[[Array], Array]
    lane: Callable[[Array], Array]
    caption: str
    note: str = ""
    stage: int = -1
    trail: bool = False
    marks: tuple[tuple[float, str, float, float], ...] = ()
    rest: tuple[float, int, str] | None = None
    begins: bool = False


@dataclass(frozen=True)
class Pace:
    """How fast a film runs.

    Attributes
    ----------
    fps : float
        Frames per second.
    slow : float
        How many times slower than the machine.
    clock : str
        "s", or "1/w".
    """

    fps: float
    slow: float
    clock: str = "s"

    def __post_init__(self) -> None:
        """Refuse impossible speeds."""
        if not (1.0 <= self.fps <= 100.0):
            raise AnswerError("the frames per second", self.fps, "1 to 100", "25 look smooth")
        if not (0.01 <= self.slow <= 1000.0):
            raise AnswerError("the slow motion", self.slow, "0.01 to 1000", "1 is as fast as the machine")

    @property
    def unit(self) -> float:
        """Seconds of film for one unit of the clock."""
        return self.slow * (1.0 if self.clock == "s" else UNKNOWN)

    def rate(self, scene: Scene, kappa: float) -> float:
        """Angular speed of a throw, in units of the clock."""
        return math.sqrt((scene.kappa if scene.gravity is None else scene.gravity) / kappa)

    @property
    def words(self) -> str:
        """Speed of the film, as a clause."""
        if self.clock == "s":
            return (
                "as fast as the machine"
                if self.slow == 1.0
                else f"{self.slow:g} times slower than the machine"
            )
        return f"1/w, the time in which the throw turns by 1 rad, is shown in {self.unit:g} s"


class Asked(NamedTuple):
    """The options of a film, as in `limitsets.animate`; each kind of film has its own start and number of throws."""

    start: tuple[float, int] | None
    throws: int | None
    fps: float
    slow: float
    progress: Progress | None = None

    def pace(self, scene: Scene) -> Pace:
        """Give the pace; it is in seconds if the scene has gravity."""
        return Pace(self.fps, self.slow, "1/w" if scene.gravity is None else "s")


def require_length(frames: int) -> None:
    """Refuse a film that is too long, before anything is drawn."""
    if frames > MOST_FRAMES:
        remedy = "show fewer throws, fewer frames per second, or less slow motion"
        raise AnswerError("the frames of the film", frames, f"up to {MOST_FRAMES}", remedy)


def labels_of(scene: Scene) -> tuple[Label, ...]:
    """Put the number of each side inside the part, next to the middle of the side."""
    corners = about_centre(scene)
    ends = np.array([side_ends(len(corners), side) for side in range(len(corners))])
    left, right = corners[ends[:, 0]], corners[ends[:, 1]]
    along = right - left
    inward = np.stack([-along[:, 1], along[:, 0]], axis=-1) / np.hypot(*along.T)[:, None]
    places = 0.5 * (left + right) + 0.1 * float(np.abs(corners).max()) * inward
    return tuple(Label(str(side), x, y) for side, (x, y) in enumerate(places.tolist()))


def _events(
    legs: Sequence[Leg], counts: Sequence[int], firsts: Sequence[int]
) -> tuple[list[Mark], list[Rest], list[tuple[int, int]]]:
    """Give the marks, the rests, and for each frame the frames between which the path is shown."""
    begins = [0, *(first for leg, first in zip(legs, firsts[:-1], strict=True) if leg.begins)]
    marks: list[Mark] = []
    rests: list[Rest] = []
    trails: list[tuple[int, int]] = []
    begin, last, drawn = 0, 0, False  # of the path that is shown
    for leg, count, (first, after) in zip(legs, counts, pairwise(firsts), strict=True):
        if leg.begins:
            begin = last = first
        if leg.trail and not drawn:
            begin = max(first - 1, 0)
        trails += [(begin, frame if leg.trail else last) for frame in range(first, after)]
        last, drawn = trails[-1][1], leg.trail
        for at, word, x, y in leg.marks:
            frame = after - 1 - round((1.0 - at) * count)
            until = next((k for k in begins if k > frame), firsts[-1])
            marks.append(Mark(frame, until, 0, word, x, y))
        if leg.rest is not None:
            rests.append(Rest(max(k for k in begins if k < after), after - 1, *leg.rest))
    return marks, rests, trails


def cut(
    scene: Scene,
    legs: Sequence[Leg],
    pace: Pace,
    *,
    title: str,
    about: str = "",
    lanes: Lanes | None,
    ground: Sequence[Array] = (),
    end: float | None = None,
    view: Sequence[tuple[float, float]] = (),
) -> Film:
    """Cut legs of one part's motion into frames: each leg ends at a frame, and the first begins at one."""
    counts = [max(1, round(leg.seconds * pace.fps)) for leg in legs]
    require_length(sum(counts) + 1)
    shares = [np.arange(int(number > 0), count + 1) / count for number, count in enumerate(counts)]
    # the first frame of each leg, and the number of frames
    firsts = [0, *(1 + np.cumsum(counts)).tolist()]
    clock = np.cumsum([0.0, *(leg.seconds / pace.unit for leg in legs[:-1])])  # when each leg begins
    marks, rests, trails = _events(legs, counts, firsts)
    cuts = list(zip(legs, shares, strict=True))
    captions = list(dict.fromkeys(leg.caption for leg in legs))
    notes = list(dict.fromkeys(leg.note for leg in legs))
    of_leg = np.repeat(np.arange(len(legs)), [share.size for share in shares])
    return Film(
        title,
        scene.unit,
        pace.clock,
        fps=pace.fps,
        about="; ".join(words for words in (pace.words, about) if words),
        times=np.concatenate(
            [at + share * leg.seconds / pace.unit for at, (leg, share) in zip(clock, cuts, strict=True)]
        ),
        poses=np.concatenate([leg.pose(share) for leg, share in cuts])[:, None, :],
        outlines=(about_centre(scene, hull=False),),
        labels=(labels_of(scene),),
        arm=np.concatenate([leg.arm(share) for leg, share in cuts]),
        surface=(scene.surface_height, scene.arm_length if end is None else end),
        ground=tuple(ground),
        captions=tuple(captions),
        notes=tuple(notes),
        caption=np.array([captions.index(leg.caption) for leg in legs])[of_leg],
        note=np.array([notes.index(leg.note) for leg in legs])[of_leg],
        trail=np.array(trails),
        marks=tuple(marks),
        rests=tuple(rests),
        lanes=lanes,
        position=np.concatenate([leg.lane(share) for leg, share in cuts]),
        stage=np.array([leg.stage for leg in legs])[of_leg],
        view=tuple(view),
    )
