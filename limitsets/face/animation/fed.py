"""Films of what falls into the cavity: throws of a feeder, and what the engine recorded of several parts.

The part tips about the end of the arm as limitsets/cell/feeding/falling.py says: M theta'' = g (d sin theta + e cos
theta). It then slides without friction until it meets the far wall or the floor; that, and a fall of a part that lies
wholly beyond the end, is drawn.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Array, Ints
from limitsets.cell.feeding.falling import ArmEnd, first_contact, rate_about_end
from limitsets.face.animation.film import Asked, Film, Leg, Mark, Pace, cut, labels_of, require_length
from limitsets.face.animation.legs import (
    LOWERS,
    RESTS,
    STAYS,
    drawn_of,
    known_of,
    legs_of,
    lowered,
    raised,
    require_start,
    rest_leg,
    riding,
    swing_of,
)
from limitsets.face.animation.picture import cavity_pieces
from limitsets.face.plot.throwing import (
    Throw,
    angle_on_side,
    motion,
    outline,
    pendulum_until,
    throws_of,
    turned,
)
from limitsets.feeder.engine.depression import way_down
from limitsets.feeder.engine.member import Recording, ground_of
from limitsets.feeder.scene import Cavity, Scene
from limitsets.feeder.thrower import trace
from limitsets.systems.maps import codes, orbit

if TYPE_CHECKING:
    from limitsets.cell.assembly import Assembly
    from limitsets.cell.feeding import Feeding
    from limitsets.cell.trays import TrayFill


# Starts tried per side in the search for a good one; angles of the grid on which the first contact is searched.
TRIED, ANGLES = 40, 400
# Throws shown at most: from a given start, and from a start that is chosen here.
MOST_THROWS, USUAL = 60, 8
WORDS = ("fed rightly", "fed on a wrong side", "not clear of the wall")
AT_EDGE = "the next throw acts beyond the end of the arm, which is not simulated: assumed not fed"
BEYOND = "the struck corner is beyond the end of the arm: the map throws as if the arm went on"
# A place of rest this close to the end of the arm (as a share of its length) looks as if it were beyond the end.
NEAR = 0.005


def film_of_feeding(feeding: Feeding, asked: Asked) -> Film:
    """Show a part until it is fed."""
    return film_of_end(feeding.end, asked)


def film_of_end(end: ArmEnd, asked: Asked) -> Film:
    """Show a part until it is fed."""
    start, throws = asked.start, asked.throws
    sides = end.edges.size
    if start is not None and not start[0] < (end.edges[start[1]] if 0 <= start[1] < sides else end.x):
        allowed = f"below {end.x:g} {end.scene.unit}, where the arm ends, and where throws act beyond the end"
        raise AnswerError("x of the start", start[0], allowed, "start on the arm")
    goes_on = f"where the arm ends: side {end.side} is wanted"
    analysis, lanes = known_of(end.scene, asked.progress, lines=((end.x, goes_on),))
    scene, pace = analysis.scene, asked.pace(analysis.scene)
    most = MOST_THROWS if throws is None else throws
    x, side = _longest(end, most if throws else USUAL) if start is None else require_start(scene, start)
    made = _until_fed(end, scene, x, side, most)
    if not made:
        raise AnswerError("the start", f"x = {x:g} on side {side}", "one that is thrown", "choose another")
    last = made[-1]
    fate = _fate(end, last)
    legs = [rest_leg(scene, x, side, 1.0, f"Start: x = {x:.2f} {scene.unit} on side {side}")]
    for number, throw in enumerate(made, start=1):
        stays = STAYS if number == len(made) and fate < 0 else RESTS
        note = BEYOND if motion(scene, throw).struck[0] > end.x else ""
        edge = (AT_EDGE, -1) if end.at_edge(throw.after, throw.side_after) else None
        legs += legs_of(scene, throw, pace, f"Throw {number}", stays=stays, note=note, after=edge)
    if fate >= 0:
        legs += _falls(end, scene, last, fate, pace)
    pieces = cavity_pieces(scene, 0.5 * float(scene.sides.length.max()))
    about = "; ".join(words for words in (drawn_of(scene), "the slide down the ramp is drawn") if words)
    return cut(scene, legs, pace, title=scene.name, about=about, lanes=lanes, ground=pieces, end=end.x)


def _fate(end: ArmEnd, throw: Throw) -> int:
    if throw.code < 0:
        return -1
    return int(end.fate(np.array([throw.after]), np.array([throw.side_after]))[0])


def _until_fed(end: ArmEnd, scene: Scene, x: float, side: int, throws: int) -> list[Throw]:
    path = orbit(scene.map, x, side, throws)
    over = (path.x >= end.x) | end.at_edge(path.x, path.side)
    beyond = np.flatnonzero(over[1:])
    count = int(beyond[0]) + 1 if beyond.size else throws
    return throws_of(scene, trace(scene.map, x, side, count))


def _longest(end: ArmEnd, throws: int) -> tuple[float, int]:
    """Choose the start whose part is fed rightly after the most throws; a part that is fed wrongly if there is none."""
    best, chosen = (-1, -1), (float(end.starts[0]), 0)
    for side, begin in enumerate(end.starts.tolist()):
        for x in np.linspace(begin, end.x, TRIED + 2)[1:-1].tolist():
            made = _until_fed(end, end.scene, x, side, throws)
            if made and made[-1].code >= 0:
                fate = _fate(end, made[-1])
                flips = sum(throw.turned != 0 for throw in made)
                plain = all(abs(throw.after - end.x) > NEAR * end.x for throw in made)
                rank = (2 * (fate == 0) + (fate > 0) + plain, flips)
                best, chosen = max((best, chosen), (rank, (x, side)))
    return chosen


def _falls(end: ArmEnd, scene: Scene, throw: Throw, fate: int, pace: Pace) -> list[Leg]:
    """Give the legs of the fall: the part tips, slides and stays."""
    cavity, side = end.scene.cavity, throw.side_after
    assert cavity is not None  # an ArmEnd has one
    gravity = scene.kappa if scene.gravity is None else scene.gravity
    beyond, d = throw.after - end.x, float(scene.sides.d[side])
    about_end = outline(scene, side) + np.array([beyond, d])  # the corners from the end of the arm
    hinge = np.array([end.x, scene.surface_height])
    start = angle_on_side(scene, side)
    words, where = WORDS[fate], f"from x = {throw.after:.2f} {scene.unit} on side {side}"

    def pose(tipped: Array, along: Array, down: Array) -> Array:
        cos, sin = np.cos(tipped), np.sin(tipped)
        x = hinge[0] + beyond * cos + d * sin + along
        y = hinge[1] - beyond * sin + d * cos - down
        return np.stack([x, y, start - tipped], axis=-1)

    def leg(seconds: float, pose_of: Callable[[Array], Array], caption: str, begins: bool = False) -> Leg:
        place = np.array([throw.after, float(side)])
        return Leg(
            seconds,
            pose_of,
            np.zeros_like,
            lambda share: np.tile(place, (share.size, 1)),
            caption,
            where,
            trail=True,
            begins=begins,
        )

    if beyond >= float(scene.sides.a[side]):  # the whole side is beyond the end: nothing turns it
        drop = (beyond - float(scene.sides.a[side])) * math.tan(cavity.angle)
        time = math.sqrt(2.0 * drop / gravity)
        falls = leg(
            time * pace.unit,
            lambda share: pose(0.0 * share, 0.0 * share, drop * share * share),
            f"It falls: {words}",
            begins=True,
        )
        return [
            falls,
            leg(STAYS, lambda share: pose(0.0 * share, 0.0 * share, drop + 0.0 * share), words.capitalize()),
        ]
    most = _first_contact(cavity, about_end)
    inertia = scene.radius_of_gyration**2 + beyond**2 + d**2
    rate = rate_about_end(scene, throw.x, side, beyond) if throw.code == codes.JOG else 0.0
    # an inverted pendulum at e from the top needs ln(d/e) of its time constants, and a few more
    patience = 40.0 + max(0.0, math.log(d / max(beyond, 1e-300)))
    longest, arm = patience * math.sqrt(inertia / (gravity * d)), np.array([beyond, d])
    tipping = pendulum_until(arm, -rate, (-most, math.inf), inertia, (0.0, -gravity), longest=longest)
    assert tipping is not None  # it has time enough
    time, _, turned_at, _ = tipping
    tips = leg(
        time * pace.unit,
        lambda share: pose(np.minimum(-turned_at(share * time), most), 0.0 * share, 0.0 * share),
        f"It tips over the end: {words}",
        begins=True,
    )
    flush = turned(about_end, -cavity.angle)
    slide = max(0.0, way_down(cavity, flush)) if most >= cavity.angle else 0.0
    cos, sin = math.cos(cavity.angle), math.sin(cavity.angle)
    slides = leg(
        math.sqrt(2.0 * slide / (gravity * sin)) * pace.unit,
        lambda share: pose(most + 0.0 * share, slide * cos * share * share, slide * sin * share * share),
        f"It slides down the ramp: {words}" if slide else f"It meets the wall: {words}",
    )
    stays = leg(
        STAYS,
        lambda share: pose(most + 0.0 * share, slide * cos + 0.0 * share, slide * sin + 0.0 * share),
        words.capitalize(),
    )
    return [tips, slides, stays._replace(marks=((0.0, "in the cavity", *hinge.tolist()),))]


def _first_contact(cavity: Cavity, about_end: Array) -> float:
    """Angle at which a corner meets the far wall or the floor, or the side the ramp [rad]."""
    from scipy.optimize import brentq

    if cavity.outline:
        return first_contact(cavity, about_end)

    def room(tipped: float) -> float:
        corners = turned(about_end, -tipped)
        return float(min((cavity.width - corners[:, 0]).min(), (corners[:, 1] + cavity.depth).min()))

    angles = np.linspace(0.0, cavity.angle, ANGLES)
    for before, after in zip(angles[:-1].tolist(), angles[1:].tolist(), strict=True):
        if room(after) < 0.0:
            return float(brentq(room, before, after)) if room(before) > 0.0 else before
    return cavity.angle


# ----------------------------------------------------------------
# Films of what the engine recorded: several parts, the ground, and what happened to whom.
#
# If the scenes of the parts are known, the film names the sides, uses the scenes' unit of time, and draws the swing of
# the arm before each throw, with the parts lying on the arm.


# Above this number, parts are counted and not named.
NAMED = 4
# Frames for which an impact is shown: few, because there are many impacts.
BRIEFLY = 8
# Throws of a pair, and passes of a tray, that are shown unless others are asked for.
LAST, PASSES = 4, 12


class _Frame(NamedTuple):
    """One frame: its time in the recording, the angle of the arm, and its caption."""

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
    """Show the first throws of a recording; a cavity that stands still is shown without the arm's swing."""
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
        fps=pace.fps,
        about=f"{pace.words}; {about}",
        times=np.arange(count) / (pace.unit * pace.fps),
        poses=poses,
        outlines=tuple(recording.outlines),
        labels=tuple(labels_of(each) for each in scenes) or tuple(() for _ in recording.outlines),
        arm=np.array([each.arm for each in shown]),
        surface=surface,
        ground=ground,
        captions=captions,
        notes=notes,
        caption=np.array([captions.index(caption) for caption, _ in texts]),
        note=np.array([notes.index(note) for _, note in texts]),
        trail=np.zeros((count, 2), dtype=np.int64),
        marks=_marks(recording, at, thrown),
        rests=(),
        lanes=None,
        position=np.full((count, 2), np.nan),
        stage=np.full(count, -1, dtype=np.int64),
        view=() if scenes else _view(ground, poses),
    )


def film_of_assembly(assembly: Assembly, asked: Asked) -> Film:
    """Show the last throws of the first pair that was assembled, or of the first pair if none was."""
    example = assembly.example("assembled")
    number = 0 if example is None else example
    scenes, last = assembly.pair.scenes, LAST if asked.throws is None else asked.throws
    title = f"{scenes[0].name} and {scenes[1].name}, trial {number}: {assembly.rows[number]['outcome']}"
    recording, carried = assembly.film(number, last), assembly.series.carried
    return film_of_recording(recording, asked._replace(throws=None), scenes, title, carried=carried)


def film_of_tray(filling: TrayFill, asked: Asked) -> Film:
    """Show a tray pass by pass: one depression, or, if asked for, many parts at once that push each other."""
    from limitsets.cell.trays import Pouring, filmed

    scene, passes = filling.scene, PASSES if asked.throws is None else asked.throws
    if filling.crowds:
        parts, depressions = filling.crowds[0].parts, filling.crowds[0].depressions
        recording = Pouring(filling.passes, parts, depressions, passes, filling.seed).film(0, last=passes)
        title = f"{scene.name}, {parts} parts a pass over {depressions} depressions"
    else:
        recording = filmed(scene, passes, seed=filling.seed)
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
    """Choose the times of the frames, each throw's swing (angle, seconds) before it, and give those of the throws."""
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


def _swung(recording: Recording, kept: Ints, shown: list[_Frame], thrown: list[float]) -> Array:
    """Let the parts that are thrown lie on the arm while it swings."""
    poses: Array = recording.poses[kept].copy()
    for frame, each in enumerate(shown):
        if each.arm:
            riders = [part for time, part, word in recording.marks if word == "thrown" and time == each.time]
            poses[frame, riders] = riding(poses[frame, riders], each.arm)
    return poses


def _marks(recording: Recording, at: Array, thrown: list[float]) -> tuple[Mark, ...]:
    """Place the mark of each event at the lowest corner of the part."""
    marks = []
    for time, part, word in sorted(recording.marks):
        if time <= at[-1]:
            frame = int(np.searchsorted(at, time))
            next_throw = next((int(np.searchsorted(at, each)) for each in thrown if each > time), at.size)
            number = min(int(np.searchsorted(recording.times, time)), recording.times.size - 1)
            corners = recording.corners(number, part)
            x, y = corners[int(np.argmin(corners[:, 1]))].tolist()
            if math.isfinite(x):
                marks.append(Mark(frame, min(next_throw, frame + BRIEFLY), part, word, x, y))
    return tuple(marks)


def _words(recording: Recording, thrown: list[float], frame: _Frame) -> tuple[str, str]:
    count = sum(each <= frame.time for each in thrown)
    latest = {number: word for at, number, word in sorted(recording.marks) if at <= frame.time}
    if len(recording.outlines) <= NAMED:
        note = ", ".join(f"part {number + 1}: {word}" for number, word in sorted(latest.items()))
    else:
        note = ", ".join(f"{many} {word}" for word, many in sorted(Counter(latest.values()).items()))
    return (f"Throw {count}{frame.said}" if count else "Before the first throw"), note


def _view(ground: tuple[Array, ...], poses: Array) -> tuple[tuple[float, float], ...]:
    """Give points that keep the surfaces in sight on which parts come to lie."""
    least, most = float(np.nanmin(poses[:, :, 0])), float(np.nanmax(poses[:, :, 0]))
    tops = [(float(each[:, 0].max()), float(each[:, 1].max())) for each in ground]
    highest = float(np.nanmax(poses[:, :, 1]))
    return tuple((min(x, most), y) for x, y in tops if x > least and y <= highest)
