"""A film of a recording of the engine: several parts, the ground, and what happened to whom."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from limitsets.animation.cutting import Pace, require_length
from limitsets.animation.film import Film, Mark
from limitsets.animation.lanes import Progress
from limitsets.errors import AnswerError

if TYPE_CHECKING:
    from limitsets.engine.recording import Recording

__all__ = ["film_of_recording"]

# More parts than this are counted, not named.
NAMED = 4
# Seconds for which the last picture stays.
STAYS = 1.5


def film_of_recording(
    recording: Recording,
    start: tuple[float, int] | None,
    throws: int | None,
    fps: float,
    slow: float,
    progress: Progress,
) -> Film:
    """Show a recording from its beginning, up to so many throws."""
    if start is not None:
        raise AnswerError("the start", start, "none: a recording has its own", "leave it out")
    times = recording.times
    if not times.size:
        raise AnswerError("the recording", "empty", "one with frames", "record a throw")
    marks = sorted(recording.marks)
    thrown = sorted({time for time, _, word in marks if word == "thrown"})
    last = float(times[-1]) if throws is None or len(thrown) <= throws else thrown[throws]
    pace = Pace(fps, slow)
    count = max(1, round((last - float(times[0])) * pace.unit * fps))
    require_length(count)
    at = float(times[0]) + np.arange(count + 1 + round(STAYS * fps)) / (pace.unit * fps)
    at = np.minimum(at, last)
    kept = np.maximum(np.searchsorted(times, at + 1e-9, side="right") - 1, 0)
    texts = [_words(marks, thrown, float(time), len(recording.outlines)) for time in at]
    captions, notes = (tuple(dict.fromkeys(each)) for each in zip(*texts, strict=True))
    frames = at.size

    def shown(time: float, number: int, word: str) -> Mark:
        frame = int(np.searchsorted(at, time))
        until = next((int(np.searchsorted(at, each)) for each in thrown if each > time), frames)
        pose = recording.poses[min(int(np.searchsorted(times, time)), times.size - 1), number]
        return Mark(frame, until, number, word, float(pose[0]), float(pose[1]))

    ground = tuple(recording.ground)
    return Film(
        "parts in the rigid-body engine",
        "",
        "",
        fps,
        f"{pace.words}; the arm's swing is not shown",
        at,
        recording.poses[kept],
        tuple(recording.outlines),
        tuple(() for _ in recording.outlines),
        recording.arm[kept],
        None,
        ground,
        captions,
        notes,
        np.array([captions.index(caption) for caption, _ in texts]),
        np.array([notes.index(note) for _, note in texts]),
        np.zeros((frames, 2), dtype=np.int64),
        tuple(shown(*mark) for mark in marks if mark[0] <= last),
        (),
        None,
        np.full((frames, 2), np.nan),
        np.full(frames, -1, dtype=np.int64),
        _view(ground, recording.poses[kept]),
    )


def _words(
    marks: list[tuple[float, int, str]], thrown: list[float], time: float, parts: int
) -> tuple[str, str]:
    count = sum(each <= time for each in thrown)
    latest = {number: word for at, number, word in marks if at <= time}
    if parts <= NAMED:
        note = ", ".join(f"part {number + 1}: {word}" for number, word in sorted(latest.items()))
    else:
        note = ", ".join(f"{many} {word}" for word, many in sorted(Counter(latest.values()).items()))
    return (f"Throw {count}" if count else "Before the first throw"), note


def _view(
    ground: tuple[NDArray[np.float64], ...], poses: NDArray[np.float64]
) -> tuple[tuple[float, float], ...]:
    """Keep the surfaces in sight on which parts come to lie: those that begin where parts are."""
    reach = float(np.nanmax(poses[:, :, 0])), float(np.nanmin(poses[:, :, 0]))
    tops = [(float(each[:, 0].max()), float(each[:, 1].max())) for each in ground]
    return tuple(
        (min(x, reach[0]), y) for x, y in tops if x > reach[1] and y <= float(np.nanmax(poses[:, :, 1]))
    )
