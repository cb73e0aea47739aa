"""What stands still: the arm up to its end, the cavity's ramp, floor and far wall, and depressions in the arm.

Convex polygons as thick as a part is long, so that nothing comes out on the other side.  Lengths are the scene's, from
the joint.  This file makes no engine objects but in `Ground.shapes`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import AnswerError

if TYPE_CHECKING:
    from limitsets.scene import Scene


@dataclass(frozen=True, eq=False)
class Piece:
    """One convex polygon of the ground.

    Attributes
    ----------
    name : str
        "arm", "ramp", "floor", "wall", or "depression": the bottom of one.
    corners : ndarray, shape (m, 2)
        Counterclockwise [length].
    """

    name: str
    corners: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Ground:
    """The world that stands still.

    Attributes
    ----------
    pieces : tuple of Piece
        Its polygons.
    height : float
        Of the arm's surface over the joint [length].
    end : float
        Where the arm ends [length].
    bottom : float
        Below this height a part is lost [length].
    """

    pieces: tuple[Piece, ...]
    height: float
    end: float
    bottom: float

    @property
    def polygons(self) -> tuple[NDArray[np.float64], ...]:
        """The polygons without their names."""
        return tuple(piece.corners for piece in self.pieces)

    def is_arm(self, x: float) -> bool:
        """Whether the arm's surface lies below."""
        arm = (piece.corners[:, 0] for piece in self.pieces if piece.name == "arm")
        return any(float(along.min()) <= x <= float(along.max()) for along in arm)

    def shapes(self, on: Any) -> dict[str, list[Any]]:
        """Make the engine's shapes on a body of a space, by name; friction and the like are the caller's."""
        from limitsets.engine.stage import pymunk_module

        pymunk = pymunk_module()
        made: dict[str, list[Any]] = {}
        for piece in self.pieces:
            made.setdefault(piece.name, []).append(pymunk.Poly(on, piece.corners.tolist()))
        return made


def ground_of(
    scene: Scene, *, depressions: Sequence[tuple[float, float, float]] = (), wall: float | None = None
) -> Ground:
    """Lay out the ground of a scene.

    Parameters
    ----------
    scene : Scene
        The arm goes up to its cavity, or else to its length; towards the joint it goes on by a part's size, so that
        parts that have come off the working range lie there.
    depressions : sequence of (float, float, float)
        Where each begins, its width and its depth, upright walls and a level bottom [length].
    wall : float, optional
        How high the cavity's far wall stands over the arm's surface; default as far as the arm reaches, higher than
        parts fly [length].

    Returns
    -------
    Ground

    Raises
    ------
    AnswerError
        Depressions that overlap or leave the arm.

    Examples
    --------
    >>> import limitsets as ls
    >>> tree = ls.load("paper-designed").as_dict()
    >>> cavity = {"position": "20 in", "width": "9.3 in", "depth": "5 in", "angle": "32.23 deg"}
    >>> [piece.name for piece in ground_of(ls.load({**tree, "cavity": cavity})).pieces]
    ['arm', 'ramp', 'floor', 'wall']
    """
    cavity, height = scene.cavity, scene.surface_height
    thick = 2.0 * float(np.hypot(*np.ptp(scene.vertices, axis=0)))
    end = scene.arm_length if cavity is None else cavity.position
    deep = max([0.0 if cavity is None else cavity.depth, *(depth for _, _, depth in depressions)])
    low = height - deep - thick

    def block(name: str, left: float, right: float, top: float) -> Piece:
        return Piece(name, np.array([[left, low], [right, low], [right, top], [left, top]]))

    pieces, at = [], -thick
    for left, width, depth in sorted(depressions):
        if not (left >= at and width > 0.0 and depth > 0.0 and left + width <= end):
            allowed = f"one after the other, from the joint to the arm's end at {end:g} {scene.unit}"
            raise AnswerError("a depression (from, width, depth)", (left, width, depth), allowed, "move it")
        if left > at:
            pieces.append(block("arm", at, left, height))
        pieces.append(block("depression", left, left + width, height - depth))
        at = left + width
    if at < end:
        pieces.append(block("arm", at, end, height))
    if cavity is not None:
        foot, far = end + cavity.depth / math.tan(cavity.angle), end + cavity.width
        ramp = [[end, low], [foot, low], [foot, height - cavity.depth], [end, height]]
        pieces.append(Piece("ramp", np.array(ramp)))
        if far - foot > 1e-6 * cavity.width:  # depth and width are rounded where the ramp meets the wall
            pieces.append(block("floor", foot, far, height - cavity.depth))
        pieces.append(block("wall", far, far + thick, height + (end if wall is None else wall)))
    return Ground(tuple(pieces), height, end, low)
