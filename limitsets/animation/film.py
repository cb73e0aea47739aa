"""A film as data: where everything is in every frame, and what is written under it.  Writers only draw it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.plot.poses import turned

Array = NDArray[np.float64]
Extents = dict[int, list[tuple[float, float]]]


class Label(NamedTuple):
    """A word on a part, about its centre of mass, in the frame of its outline [length]."""

    word: str
    x: float
    y: float


class Mark(NamedTuple):
    """Something that happens: in which frame, to which part, where; shown up to another frame [length].

    The words are those of `limitsets.engine.recording.Recording`.
    """

    frame: int
    until: int
    part: int
    word: str
    x: float
    y: float


class Rest(NamedTuple):
    """A part has come to rest: the frame in which its throw begins, and that of the rest; where [length]; in words."""

    begin: int
    frame: int
    x: float
    side: int
    sentence: str


@dataclass(frozen=True, eq=False)
class Lanes:
    """What is known of the places of rest, a lane for each side.

    Attributes
    ----------
    begin : tuple of float
        By side the least x at which the part can rest [length].
    end : float
        The largest [length].
    sets : tuple of dict
        Limit sets, or attractors: intervals by side.
    critical : dict of int to tuple of float
        Critical points by side.
    goal : tuple of (float, int) or None
        The goal's x and side.
    lines : tuple of (float, str)
        Other places, such as a sensor's, and what they are.
    known : tuple of dict
        Where a controller knows the part to be, one for each state it comes to.
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
        How fast it runs, and what of it is drawn rather than computed.
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
        What turns with the arm, as it is with the arm level: the cavity; what stands, where the arm is ground [length].
    captions, notes : tuple of str
        Texts: the first line, and the second.
    caption, note : ndarray of int, shape (frames,)
        Which of them belong to a frame.
    trail : ndarray of int, shape (frames, 2)
        The frames between which the path of the first part's centre of mass is shown.
    marks : tuple of Mark
        What happens.
    rests : tuple of Rest
        Where the first part came to rest.
    lanes : Lanes or None
        What is drawn beside it.
    position : ndarray, shape (frames, 2)
        Where the first part is in the lanes: x [length], and the side, between two sides while it turns.
    stage : ndarray of int, shape (frames,)
        Number in ``lanes.known``, -1 for none.
    view : tuple of (float, float)
        Places that have to be in sight, besides what moves [length].
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
    caption: NDArray[np.int64]
    note: NDArray[np.int64]
    trail: NDArray[np.int64]
    marks: tuple[Mark, ...]
    rests: tuple[Rest, ...]
    lanes: Lanes | None
    position: Array
    stage: NDArray[np.int64]
    view: tuple[tuple[float, float], ...] = ()

    @property
    def frames(self) -> int:
        """How many."""
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
