"""Films of what the engine recorded: several parts, the ground, and what happened to whom.

Where the scenes of the parts are known their sides are named, times are theirs, and the swing of the arm before each
throw is drawn, with the parts that it throws lying on it.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.animation.cavity_drawn import cavity_pieces
from limitsets.animation.cutting import Asked, Pace, labels_of, require_length
from limitsets.animation.film import Film, Mark
from limitsets.animation.legs import LOWERS, STAYS, lowered, raised, riding, swing_of
from limitsets.engine.ground import ground_of
from limitsets.errors import AnswerError

if TYPE_CHECKING:
    from limitsets.assembly import Assembly
    from limitsets.engine.recording import Recording
    from limitsets.scene import Scene
    from limitsets.trays import TrayFill

Array = NDArray[np.float64]

# More parts than this are counted, not named.
NAMED = 4
# Frames for which an impact is shown: there are many.
BRIEFLY = 8
# Throws of a pair, and passes of a tray, that are shown unless others are asked for.
LAST, PASSES = 4, 12


class _Frame(NamedTuple):
    """What one frame shows: when, of the recording, the angle of the arm, and what is said."""

    time: float
    arm: float
    said: str


def film_of_recording(
    recording: Recording,
    asked: Asked,
    scenes: Sequence[Scene] = (),
    title: str = "parts in the rigid-body engine",
    *,
    carried: bool = True,
) -> Film:
    """Show a recording from its beginning, up to so many throws; of a cavity that stands without the arm's swing."""
    if asked.start is not None:
        raise AnswerError("the start", asked.start, "none: a recording has its own", "leave it out")
    if not recording.times.size:
        raise AnswerError("the recording", "empty", "one with frames", "record a throw")
    pace = asked.pace(scenes[0]) if scenes else Pace(asked.fps, asked.slow)
    swing, about = 0.0, "the arm's swing is not shown"
    if scenes and carried:
        about = "the swing of the arm, with the cavity, is drawn"
        swing = swing_of(scenes[0])
    takes = 2.0 * swing * pace.unit / pace.rate(scenes[0], scenes[0].kappa) if scenes else 0.0
    shown, thrown = _frames(recording, asked.throws, pace, (swing, takes))
    at = np.array([each.time for each in shown])
    kept = np.maximum(np.searchsorted(recording.times, at + 1e-9, side="right") - 1, 0)
    texts = [_words(recording, thrown, each) for each in shown]
    captions, notes = (tuple(dict.fromkeys(each)) for each in zip(*texts, strict=True))
    count, ground, surface = at.size, tuple(recording.ground), None
    if scenes:
        pieces = ground_of(scenes[0])
        surface = (pieces.height, pieces.end)
        ground = cavity_pieces(scenes[0], 0.5 * float(scenes[0].sides.length.max()))
    poses = _swung(recording, kept, shown, thrown)
    return Film(
        title,
        scenes[0].unit if scenes else "",
        pace.clock if scenes else "",
        pace.fps,
        f"{pace.words}; {about}",
        np.arange(count) / (pace.unit * pace.fps),
        poses,
        tuple(recording.outlines),
        tuple(labels_of(each) for each in scenes) or tuple(() for _ in recording.outlines),
        np.array([each.arm for each in shown]),
        surface,
        ground,
        captions,
        notes,
        np.array([captions.index(caption) for caption, _ in texts]),
        np.array([notes.index(note) for _, note in texts]),
        np.zeros((count, 2), dtype=np.int64),
        _marks(recording, at, thrown),
        (),
        None,
        np.full((count, 2), np.nan),
        np.full(count, -1, dtype=np.int64),
        () if scenes else _view(ground, poses),
    )


def film_of_assembly(found: Assembly, asked: Asked) -> Film:
    """Show the first pair that was assembled, or else the first pair: its last throws."""
    example = found.example("assembled")
    number = 0 if example is None else example
    scenes, last = found.pair.scenes, LAST if asked.throws is None else asked.throws
    title = f"{scenes[0].name} and {scenes[1].name}, trial {number}: {found.rows[number]['outcome']}"
    recording, carried = found.film(number, last), found.series.carried
    return film_of_recording(recording, asked._replace(throws=None), scenes, title, carried=carried)


def film_of_tray(found: TrayFill, asked: Asked) -> Film:
    """Show a tray pass by pass: one depression, or many parts at once that push each other, if they were asked for."""
    from limitsets.trays import Pouring, filmed

    scene, passes = found.scene, PASSES if asked.throws is None else asked.throws
    if found.crowds:
        parts, depressions = found.crowds[0].parts, found.crowds[0].depressions
        pouring = Pouring(found.passes, parts, depressions, passes, found.seed)
        recording = pouring.film(0, last=passes)
        title = f"{scene.name}, {parts} parts a pass over {depressions} depressions"
    else:
        recording = filmed(scene, passes, seed=found.seed)
        title = f"{scene.name}, one depression of a tray"
    film = film_of_recording(recording, asked._replace(throws=None), title=title)
    pace = asked.pace(scene)
    return replace(
        film,
        unit=scene.unit,
        clock=pace.clock,
        about=f"{pace.words}; times between passes are left out",
        labels=(labels_of(scene),) * len(recording.outlines),
        captions=tuple(
            each.replace("Throw", "Kick").replace("the first throw", "the first kick")
            for each in film.captions
        ),
    )


def _frames(
    recording: Recording, throws: int | None, pace: Pace, swing: tuple[float, float]
) -> tuple[list[_Frame], list[float]]:
    """Choose the moments that are shown, each throw's swing (angle, seconds) first, and say when parts are thrown."""
    first, end = float(recording.times[0]), float(recording.times[-1])
    thrown = sorted({time for time, _, word in recording.marks if word == "thrown"})
    if throws is not None and len(thrown) > throws:
        end = thrown[throws]
        thrown = thrown[:throws]
    ends = [*(time for time in thrown if time > first), end]
    require_length(round((end - first) * pace.unit * pace.fps))
    frames, begin = [_Frame(first, 0.0, "")], first
    for end_of_leg in ends:
        if swing[0] and begin in thrown:
            down, up = (max(1, round(seconds * pace.fps)) for seconds in (LOWERS, swing[1]))
            for way, count, said in ((lowered, down, "goes down"), (raised, up, "swings up and stops")):
                angles = way(swing[0], np.arange(1, count + 1) / count).tolist()
                frames += [_Frame(begin, angle, f": the arm {said}") for angle in angles]
        count = max(1, round((end_of_leg - begin) * pace.unit * pace.fps))
        frames += [_Frame(begin + (end_of_leg - begin) * k / count, 0.0, "") for k in range(1, count + 1)]
        begin = end_of_leg
    frames += [frames[-1]] * round(STAYS * pace.fps)
    require_length(len(frames))
    return frames, thrown


def _swung(recording: Recording, kept: NDArray[np.int64], shown: list[_Frame], thrown: list[float]) -> Array:
    """Let the parts that are thrown lie on the arm while it swings."""
    poses: Array = recording.poses[kept].copy()
    for frame, each in enumerate(shown):
        if each.arm:
            riders = [part for time, part, word in recording.marks if word == "thrown" and time == each.time]
            poses[frame, riders] = riding(poses[frame, riders], each.arm)
    return poses


def _marks(recording: Recording, at: Array, thrown: list[float]) -> tuple[Mark, ...]:
    """Say where things happen: at the lowest corner of the part."""
    found = []
    for time, part, word in sorted(recording.marks):
        if time <= at[-1]:
            frame = int(np.searchsorted(at, time))
            until = next((int(np.searchsorted(at, each)) for each in thrown if each > time), at.size)
            until = min(until, frame + BRIEFLY)
            number = min(int(np.searchsorted(recording.times, time)), recording.times.size - 1)
            corners = recording.corners(number, part)
            x, y = corners[int(np.argmin(corners[:, 1]))].tolist()
            if math.isfinite(x):
                found.append(Mark(frame, until, part, word, x, y))
    return tuple(found)


def _words(recording: Recording, thrown: list[float], frame: _Frame) -> tuple[str, str]:
    count = sum(each <= frame.time for each in thrown)
    latest = {number: word for at, number, word in sorted(recording.marks) if at <= frame.time}
    if len(recording.outlines) <= NAMED:
        note = ", ".join(f"part {number + 1}: {word}" for number, word in sorted(latest.items()))
    else:
        note = ", ".join(f"{many} {word}" for word, many in sorted(Counter(latest.values()).items()))
    return (f"Throw {count}{frame.said}" if count else "Before the first throw"), note


def _view(ground: tuple[Array, ...], poses: Array) -> tuple[tuple[float, float], ...]:
    """Keep the surfaces in sight on which parts come to lie."""
    least, most = float(np.nanmin(poses[:, :, 0])), float(np.nanmax(poses[:, :, 0]))
    tops = [(float(each[:, 0].max()), float(each[:, 1].max())) for each in ground]
    highest = float(np.nanmax(poses[:, :, 1]))
    return tuple((min(x, most), y) for x, y in tops if x > least and y <= highest)
