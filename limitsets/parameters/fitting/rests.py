"""Rests of a part in a film: stretches of frames in which its pose does not move, and what lies between them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.geometry.polygon import side_ends
from limitsets.feeder.scene import Scene
from limitsets.parameters.fitting.poses import FINEST, SIXFOLD, Poses, noise_of, size_of
from limitsets.parameters.fitting.throws import SLACK
from limitsets.parameters.fitting.tracks import refuse

# Frames of the window in which a part at rest does not move; the middle one counts.
_WINDOW = 5
# Middle frames that a rest has at the least: the top of a flight is slow in one or two, and turns on.
_LEAST = 3
# Frames that may be lacking within a window: no throw is over in so few.
_LACKING = 3
# A jump is away from five of its six neighbours.
_NEIGHBOURS = 7
# Angle to the arm up to which a side lies on it [rad]: clicks on a picture draw a line within a degree, and
# the next side of a part that rests is farther.
_LIES = math.radians(5.0)
# Of the part's size: so far above or below the arm a side does not lie on it.
_HOVERS = 0.1
# Frames of one rest that count as independent, at the most: a tracker looks at one picture again and again.
_MOST_READINGS = 100
# A rest's own spread counts beside that of all rests, which counts as so many frames.
_SHARED = 10
# In terms of the median of what throws take: a shorter gap holds no throw, a longer one perhaps two.
_NO_THROW, _TWO_THROWS = 0.5, 2.0
# The variance of a median over that of a mean.
_MEDIAN = 0.5 * math.pi

JUMP, CREEPS = "a jump of the track", "it still creeps"
NO_SIDE, NOT_ON_ARM, UNMARKED = "on no side", "not on the arm", "its mark was not seen"


@dataclass(frozen=True, eq=False)
class Rest:
    """One rest.

    Attributes
    ----------
    frames : ndarray of int
        Those that show it.
    side : int
        On which the part lies; the nearest one where it lies on none.
    tilt : float
        Of that side to the arm [rad].
    above : float
        Height of its lower end over the arm's surface [length].
    x, error : float
        Place along the arm of the left corner of the side, or of the mark at the centre of mass, and its standard
        deviation [length].
    wrong : str
        Why it is not used; empty where it is.
    """

    frames: Ints
    side: int
    tilt: float
    above: float
    x: float
    error: float
    wrong: str


@dataclass(frozen=True, eq=False)
class Rests:
    """The rests of a film.

    Attributes
    ----------
    rests : tuple of Rest
        In order of time.
    thrown : list of bool
        For each but the last: whether one throw led to the next.
    flight : float
        Frames that a throw takes, from the last at rest to the first: the median; nan where none is seen.
    noise : float
        Standard deviation of a coordinate of a point from frame to frame, at rest [length].
    jumps : ndarray of int
        Frames in which the track jumped away and back.
    """

    rests: tuple[Rest, ...]
    thrown: list[bool]
    flight: float
    noise: float
    jumps: Ints


def rests_of(poses: Poses, scene: Scene, *, period: float | None, centre: bool, file: str) -> Rests:
    """Find the rests, and which of them follow each other by one throw.

    Parameters
    ----------
    poses : Poses
        Of the film.
    scene : Scene
        The part and the arm.
    period : float or None
        Frames from one throw to the next, where they are known.
    centre : bool
        Whether places are those of the mark at the centre of mass.
    file : str
        For messages.

    Raises
    ------
    DataError
        No rest, or most rests on no side, or not on the arm.
    """
    size, vertices = size_of(scene), scene.vertices @ np.array([1.0, 1j])
    spots = poses.at[:, None] + poses.turn[:, None] * vertices
    readings = np.hstack([spots.real, spots.imag])
    refuse(
        len(readings) < _NEIGHBOURS,
        "the film",
        f"{len(readings)} frames",
        f"rests of {_NEIGHBOURS} frames or more",
        "film on",
        file=file,
    )
    # beyond this it moves: noise does not, and of a track without any, no tracker resolves it
    still = max(SIXFOLD * float(noise_of(poses.frames, readings).max()), FINEST * size)
    windows = np.lib.stride_tricks.sliding_window_view(readings, _NEIGHBOURS, axis=0)
    away = abs(windows - np.median(windows, axis=2)[..., None]).max(axis=1) > still
    jumps = np.pad(away[:, 3] & (away.sum(axis=1) <= 2), 3)
    kept = np.flatnonzero(~jumps)
    stretches = [kept[each] for each in _stretches(poses.frames[kept], readings[kept], still)]
    refuse(
        not stretches,
        "the rests of the film",
        "none",
        f"stretches of {_NEIGHBOURS} frames in which the part lies still",
        "film at more frames a second, or longer; the noise of the track may be too large",
        file=file,
    )
    stretches, thrown, flight = _joined(stretches, poses.frames, readings, jumps, still, period)
    ends = np.array([side_ends(len(vertices), side) for side in range(len(vertices))])
    turns = [poses.turn[each].mean() for each in stretches]
    tilts = np.angle(np.outer(turns, vertices[ends[:, 1]] - vertices[ends[:, 0]]))
    sides = np.argmin(abs(tilts), axis=1)
    tilts = tilts[np.arange(len(sides)), sides]
    lower = [spots[each][:, ends[side]].imag for each, side in zip(stretches, sides, strict=True)]
    above = np.array([np.median(each, axis=0).min() for each in lower]) - scene.surface_height
    _require_on_arm(tilts, above, scene, size, file)
    reads = [
        poses.centre[each].real if centre else spots[each, ends[side, 0]].real
        for each, side in zip(stretches, sides, strict=True)
    ]
    reads = [each[np.isfinite(each)] for each in reads]
    errors, noise = _errors(reads, poses, stretches)
    rests = []
    for k, read in enumerate(reads):
        x, third = float(np.median(read)) if read.size else math.nan, max(len(read) // 3, 1)
        on = (0.0 if centre else -SLACK * scene.arm_length) < x <= (1.0 + SLACK) * scene.arm_length
        reasons = {
            UNMARKED: not read.size,
            NO_SIDE: abs(tilts[k]) > _LIES,
            NOT_ON_ARM: abs(above[k]) > _HOVERS * size or not on,
            CREEPS: abs(np.median(read[:third]) - np.median(read[-third:])) > still if read.size else False,
        }
        wrong = next((reason for reason, holds in reasons.items() if holds), "")
        numbers = float(tilts[k]), float(above[k]), x, errors[k]
        rests.append(Rest(poses.frames[stretches[k]], int(sides[k]), *numbers, wrong))
    return Rests(tuple(rests), thrown, flight, noise or poses.noise, poses.frames[jumps])


def _stretches(frames: Ints, places: Array, still: float) -> list[Ints]:
    """Find stretches whose windows all have no slope, and no reading off their middle."""
    windows = np.lib.stride_tricks.sliding_window_view(places, _WINDOW, axis=0)
    # the least-squares slope times the length of the window: of noise alone it is 1.26 times that of a reading
    slopes = windows @ np.array([-2.0, -1.0, 0.0, 1.0, 2.0]) * (4.0 / 10.0)
    spread = abs(windows - np.median(windows, axis=2)[..., None]).max(axis=2)
    calm = (np.maximum(abs(slopes), spread) <= 1.26 * still).all(axis=1)
    calm &= frames[_WINDOW - 1 :] - frames[: 1 - _WINDOW] <= _WINDOW - 1 + _LACKING
    middles = np.flatnonzero(calm) + _WINDOW // 2
    parts = np.split(middles, np.flatnonzero(np.diff(middles) > 1) + 1)
    return [part for part in parts if len(part) >= _LEAST]


def _joined(
    stretches: list[Ints], frames: Ints, readings: Array, jumps: Mask, still: float, period: float | None
) -> tuple[list[Ints], list[bool], float]:
    """Join stretches that are one rest, and say which rests follow each other by one throw.

    Where the arm's period is known, it counts the throws between two landings.  Else a throw takes about as long as
    the median of all: within a much shorter gap there was none, and a part that lies where it lay is one rest;
    within a much longer one there may have been two, or somebody took the part.  In a gap in between there was one if
    the part was seen to move or lies elsewhere; if neither, nobody knows, and the run ends.
    """
    places = [np.median(readings[each], axis=0) for each in stretches]
    gaps, moves, elsewhere, shifted = (np.zeros(len(stretches) - 1) for _ in range(4))
    for k in range(len(stretches) - 1):
        one, other = stretches[k], stretches[k + 1]
        # two frames at each end of a rest are no middles of windows that lie still
        gaps[k] = frames[other[0]] - frames[one[-1]] - 2 * (_WINDOW // 2)
        between = np.setdiff1d(np.arange(one[-1] + 1, other[0]), np.flatnonzero(jumps))
        far = [abs(readings[between] - places[j]).max(axis=1, initial=0.0) > still for j in (k, k + 1)]
        shift, scatter = (
            abs(places[k] - places[k + 1]).max(),
            sum(1.0 / min(len(s), _MOST_READINGS) for s in (one, other)),
        )
        elsewhere[k], shifted[k] = shift > still, shift > still * math.sqrt(_MEDIAN * scatter)
        # of a throw most frames show a part in the air; of a track that jumped, the part where it lies
        moves[k] = elsewhere[k] or 2 * (far[0] & far[1]).sum() > between.size
    usual = float(np.median(gaps[moves > 0])) if moves.any() else math.nan
    joined, thrown = stretches[:1], []
    for k, other in enumerate(stretches[1:]):
        if period is not None:
            throws = round(float(frames[other[0]] - frames[joined[-1][0]]) / period)
            same, once = throws == 0 and not elsewhere[k], throws == 1
        else:
            same = not elsewhere[k] and not gaps[k] >= _NO_THROW * usual
            once = bool(moves[k] or shifted[k]) and gaps[k] <= _TWO_THROWS * usual
        if same:
            joined[-1] = np.concatenate([joined[-1], other])
        else:
            joined.append(other)
            thrown.append(bool(once))
    return joined, thrown, usual


def _require_on_arm(tilts: Array, above: Array, scene: Scene, size: float, file: str) -> None:
    """Refuse a film most of whose rests are turned against the arm's line, or off it."""
    degrees, height = math.degrees(np.median(abs(tilts))), float(np.median(above))
    refuse(
        degrees > math.degrees(_LIES),
        "the arm's line",
        f"turned by {degrees:.0f} deg to the nearest side in the median of all rests",
        f"sides along it, up to {math.degrees(_LIES):g} deg",
        "exchange origin (the joint) and along, or correct them; where y points up say y-up, where the arm goes to the"
        " left mirrored",
        file=file,
    )
    refuse(
        abs(height) > _HOVERS * size,
        "the origin or the arm's line",
        f"{abs(height):.4g} {scene.unit} {'above' if height > 0 else 'below'} the arm in the median of all rests",
        f"a part at rest on the arm, within {_HOVERS * size:.3g} {scene.unit}",
        "correct origin and along, or the arm.surface_height of the scene",
        file=file,
    )


def _errors(reads: list[Array], poses: Poses, stretches: list[Ints]) -> tuple[list[float], float]:
    """Say how well each place is known, and the noise of a point from frame to frame.

    Two parts: the spread of its readings, over the square root of how many are independent, by the correlation of
    successive ones (a hundred at the most: the frames of a rest are one picture nearly, and what the tracker misses in
    one it misses in all); and what is left in the mean of a rest of its points about a rigid part, which no further
    frame of it would take away.
    """
    spreads = [read - read.mean() for read in reads if read.size > 1]
    freedom = sum(each.size - 1 for each in spreads) or 1
    shared = sum(float((each**2).sum()) for each in spreads) / freedom
    products = sum(float((each[1:] * each[:-1]).sum()) for each in spreads) / freedom
    # about a mean taken from the readings themselves each product lacks 1/n of the variance
    lacking = sum((each.size - 1) / each.size for each in spreads) / freedom
    linked = min(max(products / shared + lacking, 0.0), 0.98) if shared else 0.0
    thinned = (1.0 + linked) / (1.0 - linked)
    frame, mean = _point_noise(poses, stretches)
    usual = thinned * float(np.mean([1.0 / max(len(each), 1) for each in stretches]))
    # what the mean of a rest has beyond the noise of its frames, carried from a point to the place that is read
    fixed = max(mean - frame * usual, 0.0) * (shared / frame if frame else 1.0)
    errors = []
    for read in reads:
        own = float(((read - read.mean()) ** 2).sum()) if read.size else math.nan
        variance = (_SHARED * shared + own) / (_SHARED + read.size - 1)
        readings = min(max(read.size / thinned, 1.0), _MOST_READINGS)
        errors.append(math.sqrt(_MEDIAN * variance / readings + fixed))
    return errors, math.sqrt(frame)


def _point_noise(poses: Poses, stretches: list[Ints]) -> tuple[float, float]:
    """Estimate, of a coordinate of a point about a rigid part, the variance from frame to frame and that of a mean."""
    within, between, frames, rests = 0.0, 0.0, 0.0, 0
    for which in stretches:
        # in the frame of the part, or its turning would count
        off = poses.off[which] * poses.turn[which].conj()[:, None]
        # points that hardly a frame shows have no mean worth its name
        off = off[:, np.isfinite(off).sum(axis=0) > len(off) // 2]
        if off.shape[1] < 2:
            continue
        count, free = np.isfinite(off).sum(axis=0), 2 * off.shape[1] - 3  # a pose takes three coordinates
        means = np.nansum(off, axis=0) / count
        within += float(np.nansum(abs(off - means) ** 2)) / free
        between += float((abs(means) ** 2).sum()) / free
        frames, rests = frames + float(count.mean()) - 1.0, rests + 1
    return (within / frames, between / rests) if rests else (0.0, 0.0)
