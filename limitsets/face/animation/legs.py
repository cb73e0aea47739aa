"""The legs of one throw, from the arm's way down to rest, and the lanes that stand beside a film.

If the scene simulates no stroke, the swing is drawn: it goes from `SWING` below level up to level with constant
acceleration, so that the arm reaches the speed of the throw when it stops.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from limitsets.base import AnswerError, Progress
from limitsets.base.arrays import Array
from limitsets.face.animation.film import Lanes, Leg, Pace
from limitsets.face.plot.style import stretch
from limitsets.face.plot.throwing import CONTACTS, Throw, angle_on_side, motion, stroke_of
from limitsets.feeder.goals import Goal, OrientedBeyond, Reaches
from limitsets.feeder.scene import Scene
from limitsets.parameters.analysis import Analysis, analyse

# ----------------------------------------------------------------
# The lanes beside the film: limit sets, critical points and the goal, from an analysis; and a good start.


# Cells per side: enough for a picture a few hundred pixels wide.
CELLS = 1024


def known_of(scene: Scene, progress: Progress | None = None, **more: Any) -> tuple[Analysis, Lanes]:
    """Analyse a scene, which chooses its effects if they are `auto`, and give the lanes of the analysis."""
    analysis = analyse(scene, CELLS, progress=progress)
    return analysis, lanes_of(analysis.scene, analysis, **more)


def lanes_of(scene: Scene, analysis: Analysis | None = None, goal: Goal | None = None, **more: Any) -> Lanes:
    """Fill in the lanes; without an analysis they show no sets.  The goal is the scene's unless another is given."""
    goal = scene.goal if goal is None else goal
    return Lanes(
        tuple(scene.sides.a.tolist()),
        scene.arm_length,
        ()
        if analysis is None
        else tuple({side: list(parts) for side, parts in each.items()} for each in analysis.extents),
        {}
        if analysis is None
        else {s: tuple(p.x for p in points) for s, points in analysis.critical_points.items()},
        (goal.x, goal.side) if isinstance(goal, OrientedBeyond | Reaches) else None,
        **more,
    )


def good_start(analysis: Analysis, throws: int) -> tuple[float, int]:
    """Choose a start on the limit set, at the beginning of a whole round of sides; else the middle of side 0."""
    for extents in analysis.extents[:1]:
        path = stretch(analysis.scene, extents, throws)
        if path is not None:
            return float(path.x[0]), int(path.side[0])
    return 0.5 * (float(analysis.scene.sides.a[0]) + analysis.scene.arm_length), 0


def require_start(scene: Scene, start: tuple[float, int]) -> tuple[float, int]:
    """Refuse a start from which nothing is thrown."""
    x, side = start
    if not (isinstance(side, int) and 0 <= side < len(scene.sides)):
        allowed = f"a whole number from 0 to {len(scene.sides) - 1}"
        raise AnswerError("the side of the start", side, allowed, "name a side of the part")
    least = float(scene.sides.a[side])
    if not (math.isfinite(x) and least < x <= scene.arm_length):
        allowed = f"more than {least:.6g} and up to {scene.arm_length:g} {scene.unit} on side {side}"
        raise AnswerError("x of the start", x, allowed, "start where the part can rest and is thrown")
    return float(x), int(side)


# ----------------------------------------------------------------
# The legs of one throw: the arm goes down, swings up and stops; the part flies, strikes, turns and rests.


SWING = math.radians(12.0)
"""Angle of the arm's swing if the scene has no stroke; half of it if there is a cavity at the end."""

RESTS, LOWERS, STAYS = 0.5, 0.5, 1.5
"""Seconds for the part at rest, for the arm's way down, and for the last picture."""


def drawn_of(scene: Scene) -> str:
    """Name the motions that are drawn rather than computed."""
    said = []
    if not stroke_of(scene):
        said.append("the swing of the arm and the pauses are drawn, the throw is impulsive")
    if scene.flight != "exact" or scene.flip != "signed":
        said.append("the way from the impact to rest is drawn: these formulas have none")
    on = [name for name in CONTACTS if getattr(scene.effects, name)]
    if on:
        said.append(
            f"the way from the first impact to rest is drawn ({', '.join(on)}); its ends are the map's"
        )
    return "; ".join(said)


def _lying(scene: Scene, x: float, side: int) -> Array:
    return np.array([x, scene.surface_height + float(scene.sides.d[side]), angle_on_side(scene, side)])


def riding(poses: Array, angle: Array | float) -> Array:
    """Poses of parts lying on the arm, after a turn of the arm about the joint; shapes (3,) or (n, 3), () or (n,)."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = cos * poses[..., 0] - sin * poses[..., 1], sin * poses[..., 0] + cos * poses[..., 1]
    return np.stack([x, y, poses[..., 2] + angle], axis=-1)


def swing_of(scene: Scene) -> float:
    """Angle of the arm's swing [rad]."""
    return SWING if scene.cavity is None else 0.5 * SWING


def lowered(swing: float, share: Array) -> Array:
    """Angle of the arm on its way down, which begins and ends at rest [rad]."""
    return -swing * 0.5 * (1.0 - np.cos(np.pi * share))


def raised(swing: float, share: Array) -> Array:
    """Angle of the arm on its way up, with constant acceleration [rad]."""
    return -swing * (1.0 - share * share)


def _on_lane(x: float, side: float, share: Array) -> Array:
    return np.tile([x, side], (share.size, 1))


def rest_leg(
    scene: Scene, x: float, side: int, seconds: float, caption: str, note: str = "", stage: int = -1
) -> Leg:
    """Give the leg of a part that lies on the level arm."""
    lying = _lying(scene, x, side)
    return Leg(
        seconds,
        lambda share: np.tile(lying, (share.size, 1)),
        lambda share: np.zeros(share.size),
        lane=lambda share: _on_lane(x, side, share),
        caption=caption,
        note=note,
        stage=stage,
    )


def legs_of(
    scene: Scene,
    throw: Throw,
    pace: Pace,
    name: str,
    *,
    note: str = "",
    stage: int = -1,
    stays: float = RESTS,
    after: tuple[str, int] | None = None,
) -> list[Leg]:
    """Give the legs of one throw, from the arm's way down to the part's rest.

    Parameters
    ----------
    scene : Scene
        The scene.
    throw : Throw
        The throw.
    pace : Pace
        The pace of the film.
    name : str
        Name of the throw in its captions.
    note, stage : str, int
        Second line of text, and state of the controller.
    stays : float
        Seconds for which the part is shown at rest.
    after : tuple of (str, int), optional
        Note and stage after the part has come to rest.
    """
    moves, swing = motion(scene, throw), stroke_of(scene) or swing_of(scene)
    unit = pace.unit / pace.rate(scene, throw.kappa)
    lying, unit_of = _lying(scene, throw.x, throw.side), scene.unit
    at_rest = f"{throw.word}, x = {throw.after:.2f} {unit_of} on side {throw.side_after}"
    broken = "; another corner would land first, which the model leaves out" if throw.other_first else ""
    kind_of_throw = f"a {throw.word}" if throw.code >= 0 else throw.word
    flown = moves.turning

    def turning_lane(share: Array) -> Array:
        poses = flown.pose(share)
        end = poses[-1] if share[-1] >= 1.0 else flown.pose(np.ones(1))[0]
        way = end[2] - moves.impact[2]
        turned = (poses[:, 2] - moves.impact[2]) / way if abs(way) > 1e-9 else share
        lane = throw.side + (throw.side_after - throw.side) * (turned if throw.turned else 0.0 * share)
        return np.stack([poses[:, 0], np.clip(lane, 0, len(scene.sides) - 1)], axis=-1)

    level = np.zeros_like
    impact, rolled = moves.struck, [(at, "roll", x, y) for at, x, y in flown.faces]
    sentence = f"{name}: {throw.word} from {throw.x:.2f} {unit_of}, side {throw.side}, to {throw.after:.2f}"
    rest = (throw.after, throw.side_after, f"{sentence}, side {throw.side_after}")
    return [
        Leg(
            LOWERS,
            lambda share: riding(lying, lowered(swing, share)),
            lambda share: lowered(swing, share),
            lane=lambda share: _on_lane(throw.x, throw.side, share),
            caption=f"{name}: the arm goes down",
            note=note,
            stage=stage,
            begins=True,
        ),
        Leg(
            2.0 * swing * unit,
            lambda share: riding(lying, raised(swing, share)),
            lambda share: raised(swing, share),
            lane=lambda share: _on_lane(throw.x, throw.side, share),
            caption=f"{name}: the arm swings up and stops",
            note=note,
            stage=stage,
            marks=((1.0, "thrown", throw.x, float(lying[1])),),
        ),
        Leg(
            throw.phi * unit,
            moves.flight,
            level,
            lane=lambda share: np.stack(
                [moves.flight(share)[:, 0], np.full(share.size, float(throw.side))], axis=-1
            ),
            caption=f"{name}: in flight",
            note=note,
            stage=stage,
            trail=True,
            marks=((1.0, "impact", *impact),),
        ),
        Leg(
            flown.time * unit,
            flown.pose,
            level,
            lane=turning_lane,
            caption=f"{name}: impact, and {kind_of_throw}",
            note=note,
            stage=stage,
            trail=True,
            marks=(*rolled, (1.0, "rest", throw.after, float(lying[1]))),
            rest=rest,
        ),
        rest_leg(
            scene,
            throw.after,
            throw.side_after,
            stays,
            f"{name}: {at_rest}{broken}",
            *(after or (note, stage)),
        ),
    ]
