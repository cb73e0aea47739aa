"""What is kept of a motion in the engine, for films: poses by time, outlines, the ground, and what happened when."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Mark = tuple[float, int, str]
"""Time, number of the part, and a word of `MARKS`."""

MARKS = ("thrown", "impact", "roll", "rest", "in the cavity", "ejected", "lost")
"""Words for what happens to a part."""


@dataclass(frozen=True, eq=False)
class Recording:
    """Poses of parts by time.

    Attributes
    ----------
    times : ndarray, shape (frames,)
        Seconds if the scene knows its speed, else in units of 1/w; ascending.
    poses : ndarray, shape (frames, parts, 3)
        x and y of the centre of mass, from the joint [length], and the angle [rad]; nan once a part is taken out.
    outlines : tuple of ndarray, shape (n_k, 2)
        Corners of each part about its centre of mass, at angle 0 [length].
    ground : tuple of ndarray, shape (m, 2)
        Convex polygons that stand still, the arm level [length].
    arm : ndarray, shape (frames,)
        Angle of the arm [rad], 0 when level.
    marks : tuple of (float, int, str)
        Time, part and word: one of `MARKS`.
    """

    times: NDArray[np.float64]
    poses: NDArray[np.float64]
    outlines: tuple[NDArray[np.float64], ...]
    ground: tuple[NDArray[np.float64], ...]
    arm: NDArray[np.float64]
    marks: tuple[Mark, ...] = ()

    def corners(self, frame: int, part: int) -> NDArray[np.float64]:
        """Give where the corners of a part are in a frame, shape (n_k, 2) [length].

        Examples
        --------
        >>> import numpy as np
        >>> square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        >>> pose = np.array([[[5.0, 1.0, np.pi / 2]]])
        >>> kept = Recording(np.zeros(1), pose, (square,), (), np.zeros(1))
        >>> kept.corners(0, 0)[0].round(12).tolist()
        [6.0, 0.0]
        """
        x, y, angle = self.poses[frame, part]
        cos, sin = np.cos(angle), np.sin(angle)
        turned: NDArray[np.float64] = self.outlines[part] @ np.array([[cos, sin], [-sin, cos]]) + (x, y)
        return turned
