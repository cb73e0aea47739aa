"""How a camera sees the plane of the motion: from numbers of a tracker's table to places from the joint."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from limitsets.base import DataError
from limitsets.feeder.scene import Scene
from limitsets.feeder.scene.units import convert, exact_factor, parse
from limitsets.parameters.fitting.throws import length_of
from limitsets.parameters.fitting.tracks import Points, Tracks

Pair = tuple[float, float]
Place = tuple[float | str, float | str]
View = Callable[[Points], Points]

# Four points that are on one line within this share of their extent fix no plane: clicks on a picture are no better.
_ON_A_LINE = 1e-3


def view_of(
    tracks: Tracks,
    scene: Scene,
    *,
    origin: Pair | None,
    along: Pair | None,
    length: float | str | None,
    corners: Sequence[tuple[Pair, Place]] | None,
    y_up: bool,
    mirrored: bool,
) -> View:
    """Give the function from x + iy of the table to x + iy of the plane, x along the arm from the joint, y up.

    Raises
    ------
    DataError
        A scale that is missing or given twice, points that are one, corners on a line.
    """
    file = tracks.file
    pixels = tracks.unit == "px"
    if corners is not None and (length is not None or mirrored or not pixels):
        remedy = "corners of pixels say scale and sides themselves: leave length, mirrored or the unit out"
        raise DataError("the scale", "given twice", "corners, or a length", remedy, file=file)
    if not pixels and length is not None:
        remedy = "leave length out, or the unit"
        raise DataError("the scale", "given twice", f"the unit {tracks.unit}, or a length", remedy, file=file)
    if pixels and corners is None and (length is None or origin is None or along is None):
        allowed = "origin (the joint), along (a point of the arm's line) and length (between these two)"
        remedy = "give all three, or corners; or x and y with a unit of length in the head"
        raise DataError("the scale of x and y in pixels", "missing", allowed, remedy, file=file)
    if corners is not None:
        flat = _homography(corners, scene, file)
    else:
        factor = 1.0 if pixels else float(exact_factor(tracks.unit, scene.unit))

        def flat(points: Points) -> Points:
            return factor * (points if y_up else points.conj())

    start = flat(np.array([complex(*(origin or (0.0, 0.0)))]))[0] if origin or corners is None else 0j
    # without a point of its own the arm's line is the axis of x
    end = start + 1.0 if along is None else flat(np.array([complex(*along)]))[0]
    if start == end:
        allowed = "a point of the arm's line away from the joint"
        raise DataError("along", "the origin itself", allowed, "name another point", file=file)
    turn = abs(end - start) / (end - start)
    if length is not None:
        turn *= length_of(length, scene, "the length from origin to along") / abs(end - start)

    def seen(points: Points) -> Points:
        plane = (flat(points) - start) * turn
        return plane.conj() if mirrored else plane

    return seen


def pair_of(place: Place, scene: Scene) -> complex:
    """Read two lengths: texts with a unit, or numbers in the scene's unit."""
    x, y = (convert(parse(v, "length"), scene.unit) if isinstance(v, str) else float(v) for v in place)
    return complex(x, y)


def _homography(corners: Sequence[tuple[Pair, Place]], scene: Scene, file: str) -> View:
    """Find the projective map that takes pixels to places: the null vector of two equations for each corner."""
    if len(corners) != 4:
        allowed = "four, no three of them on a line"
        raise DataError("the number of corners", len(corners), allowed, "give four", file=file)
    pixels = np.array([complex(*pixel) for pixel, _ in corners])
    places = np.array([pair_of(place, scene) for _, place in corners])
    for each in (pixels, places):
        extent = abs(each[:, None] - each).max()
        areas = [abs(((b - a).conjugate() * (c - a)).imag) for a, b, c in combinations(each, 3)]
        if min(areas) <= _ON_A_LINE * extent**2:
            raise DataError("the corners", "three on a line", "four corners", "name others", file=file)
    # numbers of the size of 1, or squares of pixels drown the rest
    middle, size = pixels.mean(), abs(pixels - pixels.mean()).max()
    p = (pixels - middle) / size
    zero = np.zeros(len(p))
    head = np.stack([p.real, p.imag, zero + 1.0], axis=1)
    rows = [
        np.hstack([head, np.zeros_like(head), -places.real[:, None] * head]),
        np.hstack([np.zeros_like(head), head, -places.imag[:, None] * head]),
    ]
    matrix = np.linalg.svd(np.vstack(rows))[2][-1].reshape(3, 3)

    def flat(points: Points) -> Points:
        q = (points - middle) / size
        x, y, w = (row[0] * q.real + row[1] * q.imag + row[2] for row in matrix)
        return np.asarray((x + 1j * y) / w)

    return flat
