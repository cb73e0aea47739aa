"""Comparison of throws by the map and in the engine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.arguments import arguments_checked
from limitsets.engine.throwing import throw
from limitsets.errors import AnswerError
from limitsets.maps import OUTSIDE_MODEL, images

if TYPE_CHECKING:
    from limitsets.scene import Scene


@dataclass(frozen=True)
class Comparison:
    """One row per throw.

    Attributes
    ----------
    x, side : ndarray, shape (n,)
        Where the part rested before the throw [length], and on which side.
    x_map, side_map, code_map : ndarray, shape (n,)
        Where it rests after it by the map [length], and what the throw was (`limitsets.maps`).
    x_engine, side_engine : ndarray, shape (n,)
        The same in the engine [length]; side -1 where it did not come to rest.
    status : ndarray of str, shape (n,)
        How the throw ended in the engine (`Landing.status`).
    struck : ndarray of int, shape (n,)
        Vertex that met the arm first in the engine.
    left : ndarray of int, shape (n,)
        Left bottom vertex before the throw, the one that the minimal model lets land.
    residual, reverses, rocks : ndarray, shape (n,)
        What was seen of unilateral contact (`Landing`).
    """

    x: NDArray[np.float64]
    side: NDArray[np.int64]
    x_map: NDArray[np.float64]
    side_map: NDArray[np.int64]
    code_map: NDArray[np.int64]
    x_engine: NDArray[np.float64]
    side_engine: NDArray[np.int64]
    status: NDArray[np.str_]
    struck: NDArray[np.int64]
    left: NDArray[np.int64]
    residual: NDArray[np.float64]
    reverses: NDArray[np.bool_]
    rocks: NDArray[np.bool_]

    @property
    def agree(self) -> NDArray[np.bool_]:
        """Whether it rests on the same side by both."""
        same: NDArray[np.bool_] = (self.side_map == self.side_engine) & (self.code_map != OUTSIDE_MODEL)
        same &= self.status == "rest"
        return same

    @property
    def error(self) -> NDArray[np.float64]:
        """x' in the engine less x' by the map [length]; nan where the sides differ."""
        return np.where(self.agree, self.x_engine - self.x_map, np.nan)

    @property
    def other_vertex(self) -> NDArray[np.bool_]:
        """Whether a vertex other than the left one met the arm first."""
        other: NDArray[np.bool_] = (self.struck >= 0) & (self.struck != self.left)
        return other


# Fields of `Landing` that are taken over, and what they are.
SEEN: dict[str, Any] = {
    "status": np.str_,
    "struck": np.int64,
    "residual": np.float64,
    "reverses": np.bool_,
    "rocks": np.bool_,
}


@arguments_checked
def compare(scene: Scene, x: ArrayLike, side: ArrayLike, **how: Any) -> Comparison:
    """Throw parts by the scene's map, with the effects it has, and in the engine.

    Parameters
    ----------
    scene : Scene
        The scene.
    x : array_like, shape (n,)
        Where the parts rest before the throw [length].
    side : int or array_like, shape (n,)
        On which side.
    **how
        How it goes in the engine, as keywords of `throw`: contact, friction, restitution, ...

    Returns
    -------
    Comparison

    Raises
    ------
    AnswerError
        As `throw`; or x and side do not fit together.
    MapError
        For a side the part has not.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = ls.engine.compare(ls.load("paper-designed"), [15.0, 21.0], 2)
    >>> found.side_map.tolist(), found.side_engine.tolist(), bool(abs(found.error).max() < 1e-4)
    ([2, 0], [2, 0], True)
    """
    starts = np.asarray(x, dtype=np.float64)
    sides = np.asarray(side, dtype=np.int64)
    if starts.ndim != 1 or sides.shape not in ((), starts.shape):
        allowed = f"{starts.shape}, or one side"
        raise AnswerError("the shape of the sides", sides.shape, allowed, "give a side per start")
    sides = np.broadcast_to(sides, starts.shape).copy()
    landings = [throw(scene, *start, **how) for start in zip(starts.tolist(), sides.tolist(), strict=True)]
    x_map, side_map, code_map = _by_map(scene, starts, sides)
    return Comparison(
        x=starts,
        side=sides,
        x_map=x_map,
        side_map=side_map,
        code_map=code_map,
        x_engine=np.array([each.x for each in landings]),
        side_engine=np.array([each.side for each in landings], dtype=np.int64),
        left=-sides % len(scene.sides),
        **{name: np.array([getattr(each, name) for each in landings], kind) for name, kind in SEEN.items()},
    )


def _by_map(
    scene: Scene, x: NDArray[np.float64], side: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    after, on, code = np.empty_like(x), np.empty_like(side), np.empty_like(side)
    for each in np.unique(side).tolist():
        here = side == each
        found = images(scene.map, x[here], each)
        after[here], on[here], code[here] = found.x, found.side, found.code
    return after, on, code
