"""Legs of a film, one after the other, cut into frames."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.animation.film import Film, Label, Lanes, Mark, Rest
from limitsets.errors import AnswerError
from limitsets.plot.poses import about_centre

if TYPE_CHECKING:
    from limitsets.scene import Scene

Array = NDArray[np.float64]

MOST_FRAMES = 6000
"""More frames than this are refused: four minutes."""

UNKNOWN = 0.4
"""Seconds that stand for 1/w where no gravity is given: a throw of the paper's feeder."""


class Leg(NamedTuple):
    """Something that goes on for a while.

    Attributes
    ----------
    seconds : float
        How long it is shown, at rate 1 of the film [s].
    pose : callable
        From shares of it, shape (n,), to poses in the room, shape (n, 3).
    arm : callable
        To angles of the arm, shape (n,).
    lane : callable
        To x and side in the lanes, shape (n, 2).
    caption, note : str
        What is written meanwhile.
    stage : int
        Number of what a controller knows.
    trail : bool
        Whether the path is drawn: it begins with the first such leg after one without.
    marks : tuple of (float, str, float, float)
        Share of the leg, word, and place.
    rest : tuple of (float, int, str) or None
        x, side and sentence where the part comes to rest at its end.
    begins : bool
        Whether a throw begins: what was drawn of the last one is taken away.
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
        """Refuse what cannot be."""
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
        """How fast it runs, a clause."""
        if self.clock == "s":
            return (
                "as fast as the machine"
                if self.slow == 1.0
                else f"{self.slow:g} times slower than the machine"
            )
        return f"1/w, the time in which the throw turns by 1 rad, is shown in {self.unit:g} s"


class Asked(NamedTuple):
    """What is asked of a film, as in `limitsets.animate`; without a start or throws each film has its own."""

    start: tuple[float, int] | None
    throws: int | None
    fps: float
    slow: float
    progress: Any = None

    def pace(self, scene: Scene) -> Pace:
        """Know the seconds where the scene has gravity."""
        return Pace(self.fps, self.slow, "1/w" if scene.gravity is None else "s")


def require_length(frames: int) -> None:
    """Refuse a film that nobody would look at, before anything is drawn."""
    if frames > MOST_FRAMES:
        remedy = "show fewer throws, fewer frames per second, or less slow motion"
        raise AnswerError("the frames of the film", frames, f"up to {MOST_FRAMES}", remedy)


def labels_of(scene: Scene) -> tuple[Label, ...]:
    """Name each side of a part, inside it next to the middle of the side."""
    corners = about_centre(scene)
    n, found = len(corners), []
    size = float(np.abs(corners).max())
    for side in range(n):
        left, right = corners[-side % n], corners[(1 - side) % n]
        middle, along = 0.5 * (left + right), right - left
        inward = np.array([-along[1], along[0]]) / float(np.hypot(*along))
        x, y = (middle + 0.1 * size * inward).tolist()
        found.append(Label(str(side), x, y))
    return tuple(found)


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
    """Cut legs of one part's motion into frames: each ends in a frame, and the first begins in one."""
    counts = [max(1, round(leg.seconds * pace.fps)) for leg in legs]
    require_length(sum(counts) + 1)
    columns: dict[str, list[Any]] = {word: [] for word in ("times", "poses", "arm", "position", "trail")}
    texts: dict[str, list[int]] = {"caption": [], "note": [], "stage": []}
    captions, notes = (
        list(dict.fromkeys(leg.caption for leg in legs)),
        list(dict.fromkeys(leg.note for leg in legs)),
    )
    marks: list[tuple[int, str, float, float]] = []
    rests: list[Rest] = []
    frame, trail, clock, before, begins = 0, [0, 0], 0.0, False, [0]
    for number, (leg, count) in enumerate(zip(legs, counts, strict=True)):
        share = np.arange(0 if number == 0 else 1, count + 1) / count
        columns["times"].append(clock + share * leg.seconds / pace.unit)
        columns["poses"].append(leg.pose(share))
        columns["arm"].append(leg.arm(share))
        columns["position"].append(leg.lane(share))
        if leg.begins:
            begins, trail = [*begins, frame], [frame, frame]
        if leg.trail and not before:
            trail = [max(frame - 1, 0), frame]
        for k in range(share.size):
            trail = [trail[0], frame + k] if leg.trail else trail
            columns["trail"].append(trail)
        texts["caption"] += [captions.index(leg.caption)] * share.size
        texts["note"] += [notes.index(leg.note)] * share.size
        texts["stage"] += [leg.stage] * share.size
        last = frame + share.size - 1
        marks += [(last - round((1.0 - at) * count), word, x, y) for at, word, x, y in leg.marks]
        if leg.rest is not None:
            rests.append(Rest(begins[-1], last, *leg.rest))
        frame, clock, before = last + 1, clock + leg.seconds / pace.unit, leg.trail
    shown = []
    for at, word, x, y in marks:
        until = next((k for k in begins if k > at), frame)
        shown.append(Mark(at, until, 0, word, x, y))
    return Film(
        title,
        scene.unit,
        pace.clock,
        pace.fps,
        "; ".join(words for words in (pace.words, about) if words),
        np.concatenate(columns["times"]),
        np.concatenate(columns["poses"])[:, None, :],
        (about_centre(scene),),
        (labels_of(scene),),
        np.concatenate(columns["arm"]),
        (scene.surface_height, scene.arm_length if end is None else end),
        tuple(ground),
        tuple(captions),
        tuple(notes),
        np.array(texts["caption"]),
        np.array(texts["note"]),
        np.array(columns["trail"]),
        tuple(shown),
        tuple(rests),
        lanes,
        np.concatenate(columns["position"]),
        np.array(texts["stage"]),
        tuple(view),
    )
