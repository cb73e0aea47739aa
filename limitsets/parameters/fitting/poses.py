"""Poses of a rigid part in the frames of a film, by least squares, and what is wrong with all of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.scene import Scene
from limitsets.parameters.fitting.tracks import CENTRE, Points, Tracks, View, refuse

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

NO_ROW, FEW, FAR = "no row in the table", "too few points seen", "points exchanged or far off"


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
        Standard deviation of one coordinate of one point from frame to frame, flights counted in [length].
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
    places, names = view(tracks.at), [name for name in tracks.names if name != CENTRE]
    nowhere = np.full(len(places), complex(math.nan, math.nan))
    centre = places[:, tracks.names.index(CENTRE)] if CENTRE in tracks.names else nowhere
    if tracks.angle is not None:
        spots, angle, (spot, turned) = tracks.at[:, 0], tracks.angle, marker
        marked = np.isfinite(spots) & np.isfinite(angle)
        # the direction by a second point on the axis: a camera that looks at an angle turns directions, too
        axis = view(spots + np.exp(1j * angle))[marked] - places[marked, 0]
        turn = axis / abs(axis) * np.exp(-1j * turned)
        left_out, at = {NO_ROW: missing, FEW: tracks.frames[~marked]}, places[marked, 0] - turn * spot
        parts = np.stack([at.real, at.imag], axis=1)
        noise = float(np.median(noise_of(tracks.frames[marked], parts)))
        lost = nowhere[marked]
        return Poses(
            tracks.frames[marked],
            at,
            turn,
            centre=lost,
            off=lost[:, None],
            noise=noise,
            scale=math.nan,
            scale_error=math.nan,
            left_out=left_out,
        )
    vertices, numbers = scene.outline @ np.array([1.0, 1j]), [int(name[1:]) for name in names]
    refuse(
        len(numbers) < 2 or max(numbers) >= len(vertices),
        "the points",
        ", ".join(tracks.names),
        f"two or more of this part's vertices, P0 to P{len(vertices) - 1}",
        "count them as the scene does; the centre of mass alone shows no side",
        file=tracks.file,
    )
    seen = places[:, [tracks.names.index(name) for name in names]]
    enough = np.isfinite(seen).sum(axis=1) >= 2
    refuse(
        not enough.any(),
        "the frames",
        "none with two points",
        "some",
        "lower the likelihood, or track more points",
        file=tracks.file,
    )
    frames, seen, body = tracks.frames[enough], seen[enough], vertices[numbers]
    used, size = np.isfinite(seen), size_of(scene)
    middles = [np.where(used, each, 0).sum(axis=1) / used.sum(axis=1) for each in (body[None], seen)]
    own, there = (np.where(used, e - m[:, None], 0) for e, m in zip((body, seen), middles, strict=True))
    noise = float(np.median(noise_of(frames, np.hstack([seen.real, seen.imag]))))
    _require_shape(own, there, used, noise / size, tracks.file)
    fit, spread = (own.conj() * there).sum(axis=1), (abs(own) ** 2).sum(axis=1)
    scales, turn = abs(fit) / spread, fit / np.maximum(abs(fit), np.finfo(float).tiny)
    scale = _one_scale(scales, middles[1].real, tracks.file)
    off = np.where(used, there - scale * turn[:, None] * own, np.nan)
    misfit = np.sqrt(np.nansum(abs(off) ** 2, axis=1) / (2 * used.sum(axis=1) - 3))
    near = misfit <= np.median(misfit) + SIXFOLD * noise + FINEST * size
    error = 1.2533 * float(np.std(scales[near])) / math.sqrt(near.sum())  # of a median
    left_out = {NO_ROW: missing, FEW: tracks.frames[~enough], FAR: frames[~near]}
    at, turn = (middles[1] - turn * middles[0])[near], turn[near]
    return Poses(
        frames[near],
        at,
        turn,
        centre=centre[enough][near],
        off=off[near],
        noise=noise,
        scale=scale,
        scale_error=error,
        left_out=left_out,
    )


def _require_shape(own: Points, there: Points, used: Mask, noise: float, file: str) -> None:
    """Refuse points that lie to each other as those of another part, or of this one in a mirror."""
    several = used.sum(axis=1) >= 3
    if not several.any():
        return  # two points lie as any other two
    own, there = own[several], there[several]
    sizes = (abs(own) ** 2).sum(axis=1) * np.maximum((abs(there) ** 2).sum(axis=1), np.finfo(float).tiny)
    # the share of the shape that turning and scaling one onto the other leave over
    off, off_in_mirror = (
        float(np.median(np.sqrt(np.maximum(1.0 - abs((each * there).sum(axis=1)) ** 2 / sizes, 0.0))))
        for each in (own.conj(), own)
    )
    refuse(
        off_in_mirror <= _OTHER_SHAPE < off,
        "the order of the points",
        "that of a mirror",
        "points in the order of the scene's vertices, counterclockwise",
        "where y points up say y-up; where the camera stands behind and the arm goes to the left, mirrored",
        file=file,
    )
    refuse(
        off > _OTHER_SHAPE and noise > 0.5 * _OTHER_SHAPE,
        "the noise of the points",
        f"{100 * noise:.0f} % of the part's size from frame to frame",
        f"up to {50 * _OTHER_SHAPE:g} %, or any shape fits",
        "film from nearer, or leave out frames that the tracker is not sure of",
        file=file,
    )
    refuse(
        off > _OTHER_SHAPE,
        "the shape of the points",
        f"{100 * off:.0f} % off",
        f"the scene's part, up to {100 * _OTHER_SHAPE:g} %",
        "take the scene of this part, and names of points as it counts its vertices",
        file=file,
    )


def _one_scale(scales: Array, x: Array, file: str) -> float:
    """Give the scale; refuse one that is not the scene's, or that changes along the arm."""
    scale = float(np.median(scales))
    usual = abs(scales - scale) < 0.5 * scale  # points exchanged show any
    x, scales = x[usual] - x[usual].mean(), scales[usual]
    spread = max(float((x**2).sum()), np.finfo(float).tiny)
    slope = float((x * scales).sum()) / spread
    error = float(np.std(scales - scales.mean() - slope * x)) / math.sqrt(spread)
    change = slope * float(np.diff(np.quantile(x, [0.05, 0.95]))[0]) / scale
    refuse(
        abs(change) > _PERSPECTIVE and abs(slope) > SIXFOLD * error,
        "the change of the scale",
        f"{100 * change:+.1f} % from one end of the film's places to the other",
        f"up to {100 * _PERSPECTIVE:g} %",
        "the camera looks at an angle (perspective): give corners, four pixels with their places",
        file=file,
    )
    refuse(
        abs(scale - 1.0) > _SCALE_OFF,
        "the size of the part in the film",
        f"{scale:.4g} times",
        f"within {100 * _SCALE_OFF:g} % of that in the scene",
        "correct the scale: length, origin and along; or it is another part",
        file=file,
    )
    return scale
