"""A depression pass by pass, kept for a film: kicks, parts that come by, how they come to lie."""

from __future__ import annotations

import math

import numpy as np

from limitsets.engine.depression import EMPTY, Motion, Pose, Rest
from limitsets.engine.recording import Mark, Recording
from limitsets.errors import AnswerError
from limitsets.scene import Scene
from limitsets.trays.passing import passes_of, random_of

# The stream of random numbers, frames per unit of time, and pitches to either side that are shown.
STREAM, FRAMES, SHOWN = 10_003, 25.0, 1.0


def filmed(
    scene: Scene, passes: int = 12, *, seed: int = 0, side: int | None = None, step: float = 4e-3
) -> Recording:
    """Follow one depression, as `limitsets.trays.histories` does with new parts, and keep where all parts are.

    Parameters
    ----------
    scene : Scene
        As `limitsets.tray` takes it.
    passes : int
        Passes.
    seed : int
        Of all draws.
    side : int, optional
        The side wanted; default the goal's.
    step : float
        The engine's step, in units of sqrt(longest side/g).

    Returns
    -------
    Recording
        One part for each that came by, nan before it comes and after it has passed; x from the middle of the
        depression, y from the plate's surface.

    Raises
    ------
    AnswerError
        As `limitsets.tray`.

    Examples
    --------
    >>> import limitsets as ls
    >>> tray = {"depression_width": "7.02 in", "depression_depth": "1.53 in", "pitch": "14.04 in",
    ...         "agitation": "1 in", "wash": "1 in"}
    >>> tables = {"tray": tray, "world": {"friction": 0.3, "restitution": 0.3}, "effects": {"contact": True}}
    >>> scene = ls.load({**ls.load("paper-designed").as_dict(), **tables})
    >>> kept = filmed(scene, passes=2)
    >>> kept.poses.shape[1] in (1, 2), kept.outlines[0].shape
    (True, (3, 2))
    """
    if passes < 1:
        raise AnswerError("the passes", passes, "1 or more", "film some")
    asked, random = passes_of(scene, side, step), random_of(seed, STREAM)
    plate = asked.plate
    g = scene.kappa if scene.gravity is None else scene.gravity
    unit = math.sqrt(plate.size / g)  # seconds, or 1/w
    every = max(round(1.0 / (FRAMES * step)), 1)
    frames: list[tuple[float, int, Pose]] = []
    marks: list[Mark] = []
    start, parts, state, pose = 0.0, 0, EMPTY, Pose(0.0, 0.0, 0.0)

    def move(part: int, pose: Pose, motion: Motion) -> Rest:
        """Let a part move to rest; what is kept begins where the last motion ended."""
        nonlocal start
        kept: list[tuple[float, Pose]] = []
        rest = plate.settle(pose, motion, lambda time, now, _: kept.append((time, now)))
        last = rest.time
        shown = [*kept[::every], (last, rest.pose)]
        frames.extend((start + unit * time, part, now) for time, now in shown)
        start += unit * last
        marks.append((start, part, "rest"))
        start += unit * step
        return rest

    for _ in range(passes):
        if state != EMPTY:
            marks.append((start, parts - 1, "thrown"))
            pose, state, *_ = move(parts - 1, pose, asked.kick(random))
            if state == EMPTY:
                marks.append((start, parts - 1, "ejected"))
        if state == EMPTY:
            parts += 1
            pose, state, *_ = move(parts - 1, *asked.arrival(random))
            marks.append((start, parts - 1, "lost" if state == EMPTY else "in the cavity"))
    times = np.array([time for time, _, _ in frames])
    poses = np.full((times.size, parts, 3), np.nan)
    for number, (_, part, now) in enumerate(frames):
        poses[number, part] = now
    outline = scene.vertices - scene.centre
    edge = SHOWN * asked.tray.pitch
    ground = tuple(
        np.column_stack([corners[:, 0].clip(-edge, edge), corners[:, 1]]) for corners in plate.ground()
    )
    return Recording(times, poses, (outline,) * parts, ground, np.zeros(times.size), tuple(marks))
