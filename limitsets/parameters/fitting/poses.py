"""Poses of a rigid part in the frames of a film, by least squares, and what is wrong with all of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from limitsets.base import DataError
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.scene import Scene
from limitsets.parameters.fitting.tracks import CENTRE, Points, Tracks
from limitsets.parameters.fitting.view import View

# The quarter of all normal numbers that are nearest to 0 lie within this, in standard deviations.
_QUARTER = 0.3186
# Noise alone is beyond this once in 5e8 readings: a film has fewer.
SIXFOLD = 6.0
# Of the part's size: no tracker places a corner better, and a pixel is seldom less.
FINEST = 1e-3
# A part whose corners lie farther from the scene's than this share of its size is another one.
_OTHER_SHAPE = 0.05
# Lengths may be off by this share: a ruler and clicks on a picture do better, another unit or part does worse.
_SCALE_OFF = 0.05
# The change of the scale over a film from which places are not believed: it moves them by as much.
_PERSPECTIVE = 0.03

NO_ROW, FEW, FAR = "no row in the table", "fewer than two points", "points exchanged or far off"


@dataclass(frozen=True, eq=False)
class Poses:
    """Where the part is in the n frames that show it whole.

    Attributes
    ----------
    frames : ndarray of int, shape (n,)
        Their numbers.
    at, turn : ndarray of complex, shape (n,)
        A point p of the part, in the frame of its vertices, is at ``at + turn * p`` [length].
    centre : ndarray of complex, shape (n,)
        The mark at the centre of mass where there is one; else nan [length].
    off : ndarray of complex, shape (n, k)
        Where points were seen less where the pose has them; nan where they were not [length].
    noise : float
        Standard deviation of one coordinate of one point from frame to frame [length].
    scale, scale_error : float
        Size of the part in the film over that in the scene; nan for a marker, which has none.
    left_out : dict of str to ndarray of int
        Frames that show no pose, by the reason.
    """

    frames: Ints
    at: Points
    turn: Points
    centre: Points
    off: Points
    noise: float
    scale: float
    scale_error: float
    left_out: dict[str, Ints]


def noise_of(frames: Ints, places: Array) -> Array:
    """Estimate the noise of each column of readings from second differences in successive frames.

    A part at rest or at an even speed has none but those of noise, whose standard deviation is sqrt(6) times that of a
    reading.  The quarter nearest to 0 is taken, because frames in which the part starts or lands may be many.

    Examples
    --------
    >>> readings = np.random.default_rng(0).normal(scale=0.1, size=(2000, 1))
    >>> noise_of(np.arange(2000), readings).round(2)
    array([0.1])
    """
    successive = frames[2:] - frames[:-2] == 2
    second = abs(places[2:] - 2.0 * places[1:-1] + places[:-2])[successive]
    second = second[np.isfinite(second).all(axis=1)]
    if not len(second):
        return np.zeros(places.shape[1])
    return np.asarray(np.quantile(second, 0.25, axis=0) / (_QUARTER * math.sqrt(6.0)))


def size_of(scene: Scene) -> float:
    """Give the part's largest extent [length]."""
    vertices = scene.vertices
    return float(np.hypot(*(vertices[:, None] - vertices).transpose(2, 0, 1)).max())


def poses_of(tracks: Tracks, scene: Scene, view: View, marker: tuple[complex, float]) -> Poses:
    """Find the pose in each frame.

    Parameters
    ----------
    tracks : Tracks
        Of points or of a marker.
    scene : Scene
        The part.
    view : callable
        From the table's numbers to places.
    marker : (complex, float)
        Where the marker is in the frame of the vertices [length], and how its axis is turned there [rad].

    Raises
    ------
    DataError
        Points that the part does not have, another part, another scale, a camera that looks at an angle.
    """
    missing = np.setdiff1d(np.arange(tracks.frames[0], tracks.frames[-1] + 1), tracks.frames)
    if tracks.angle is not None:
        return _of_marker(tracks, scene, view, marker, missing)
    vertices = scene.outline @ np.array([1.0, 1j])
    names = [name for name in tracks.names if name != CENTRE]
    numbers = [int(name[1:]) for name in names]
    if len(numbers) < 2 or max(numbers) >= len(vertices):
        given = ", ".join(tracks.names)
        allowed = f"two or more of this part's vertices, P0 to P{len(vertices) - 1}"
        remedy = "count them as the scene does; the centre of mass alone shows no side"
        raise DataError("the points", given, allowed, remedy, file=tracks.file)
    places = view(tracks.at)
    seen = places[:, [tracks.names.index(name) for name in names]]
    centre = places[:, tracks.names.index(CENTRE)] if CENTRE in tracks.names else np.full(len(seen), np.nan)
    enough = np.isfinite(seen).sum(axis=1) >= 2
    if not enough.any():
        remedy = "lower the likelihood, or track more points"
        raise DataError("the frames", "none with two points", "some", remedy, file=tracks.file)
    left_out = {NO_ROW: missing, FEW: tracks.frames[~enough]}
    frames, seen, centre = tracks.frames[enough], seen[enough], centre[enough]
    used, body = np.isfinite(seen), vertices[numbers]
    middles = [np.where(used, each, 0).sum(axis=1) / used.sum(axis=1) for each in (body[None], seen)]
    own = np.where(used, body - middles[0][:, None], 0)
    there = np.where(used, seen - middles[1][:, None], 0)
    size = size_of(scene)
    fit, spread = (own.conj() * there).sum(axis=1), (abs(own) ** 2).sum(axis=1)
    turn = fit / np.maximum(abs(fit), FINEST * spread)  # of points that coincide there is no turn: far off
    scales = abs(fit) / spread
    _require_shape(own, there, used, tracks.file)
    _require_one_scale(scales, middles[1].real, tracks.file)
    scale = float(np.median(scales))
    parts = np.stack([seen.real, seen.imag], axis=2).reshape(len(seen), -1)
    noise = float(np.median(noise_of(frames, parts)))
    off = np.where(used, there - scale * turn[:, None] * own, np.nan)
    size_off = np.sqrt(np.nansum(abs(off) ** 2, axis=1) / (2 * used.sum(axis=1) - 3))
    near = size_off <= np.median(size_off) + SIXFOLD * noise + FINEST * size
    left_out[FAR] = frames[~near]
    error = 1.2533 * float(np.std(scales[near])) / math.sqrt(max(int(near.sum()), 1))  # of a median
    at = middles[1] - turn * middles[0]
    return Poses(frames[near], at[near], turn[near], centre[near], off[near], noise, scale, error, left_out)


def _of_marker(
    tracks: Tracks, scene: Scene, view: View, marker: tuple[complex, float], missing: Ints
) -> Poses:
    assert tracks.angle is not None
    spots = tracks.at[:, 0]
    seen: Mask = np.isfinite(spots) & np.isfinite(tracks.angle)
    frames, spots, angle = tracks.frames[seen], spots[seen], tracks.angle[seen]
    here = view(spots)
    # the direction by a second point on the axis: a camera that looks at an angle turns directions, too
    axis = view(spots + np.exp(1j * angle)) - here
    spot, turned = marker
    turn = axis / abs(axis) * np.exp(-1j * turned)
    parts = np.stack([here.real, here.imag], axis=1)
    noise = float(np.median(noise_of(frames, parts))) if len(frames) else 0.0
    left_out = {NO_ROW: missing, FEW: tracks.frames[~seen]}
    nothing = np.full(len(frames), complex(math.nan, math.nan))
    return Poses(
        frames, here - turn * spot, turn, nothing, nothing[:, None], noise, math.nan, math.nan, left_out
    )


def _require_shape(own: Points, there: Points, used: Mask, file: str) -> None:
    """Refuse points that lie to each other as those of another part, or of this one in a mirror."""
    several = used.sum(axis=1) >= 3
    if not several.any():
        return  # two points lie as any other two
    own, there = own[several], there[several]
    sizes = np.sqrt((abs(own) ** 2).sum(axis=1) * (abs(there) ** 2).sum(axis=1))
    like = abs((own.conj() * there).sum(axis=1)) / np.maximum(sizes, np.finfo(float).tiny)
    mirror = abs((own * there).sum(axis=1)) / np.maximum(sizes, np.finfo(float).tiny)
    off, off_in_mirror = (float(np.median(np.sqrt(np.maximum(1.0 - each**2, 0.0)))) for each in (like, mirror))
    if off <= _OTHER_SHAPE:
        return
    if off_in_mirror <= _OTHER_SHAPE:
        allowed = "points in the order of the scene's vertices, counterclockwise"
        remedy = "where y points up say y-up; where the camera stands behind and the arm goes to the left, mirrored"
        raise DataError("the order of the points", "that of a mirror", allowed, remedy, file=file)
    allowed = f"the scene's part, up to {100 * _OTHER_SHAPE:g} %"
    remedy = "take the scene of this part, and names of points as it counts its vertices"
    raise DataError("the shape of the points", f"{100 * off:.0f} % off", allowed, remedy, file=file)


def _require_one_scale(scales: Array, x: Array, file: str) -> None:
    """Refuse a scale that is not the scene's, or that changes along the arm."""
    scale = float(np.median(scales))
    usual = abs(scales - scale) < 0.5 * scale  # points exchanged show any
    x, scales = x[usual], scales[usual]
    if x.size > 2 and np.ptp(x) > 0.0:
        line = np.polynomial.Polynomial.fit(x, scales, 1)
        slope = line.convert().coef[1] if len(line.convert().coef) > 1 else 0.0
        span = float(np.diff(np.quantile(x, [0.05, 0.95]))[0])
        change = slope * span / scale
        rest = float(np.std(scales - line(x))) / (float(np.std(x)) * math.sqrt(x.size))
        if abs(change) > _PERSPECTIVE and abs(slope) > SIXFOLD * rest:
            remedy = "the camera looks at an angle (perspective): give corners, four pixels with their places"
            allowed = f"one scale, up to {100 * _PERSPECTIVE:g} %"
            given = f"{100 * change:+.1f} % from one end of the film's places to the other"
            raise DataError("the change of the scale", given, allowed, remedy, file=file)
    if abs(scale - 1.0) > _SCALE_OFF:
        allowed = f"within {100 * _SCALE_OFF:g} % of the scene's"
        remedy = f"correct the scale: length, origin and along make it {scale:.4g} times what it is in the scene"
        raise DataError("the size of the part in the film", f"{scale:.4g} times", allowed, remedy, file=file)
