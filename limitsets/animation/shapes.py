"""Things to draw, in pixels from the upper left."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.plot import style

Array = NDArray[np.float64]

TEXT = {"fill": style.INK, "size": 14.0}


class Shape(NamedTuple):
    """Something to draw.

    Attributes
    ----------
    kind : str
        "polygon", "line", "circle" or "text".
    points : ndarray, shape (n, 2)
        Corners, or one place [pixels].
    look : dict
        fill, stroke, width, dash, radius, opacity; of text: words, size, weight, anchor; what: its name.
    """

    kind: str
    points: Array
    look: dict[str, Any]


def shape_of(kind: str, points: Any, **look: Any) -> Shape:
    """Make a shape."""
    return Shape(kind, np.asarray(points, dtype=np.float64).reshape(-1, 2), look)


def text_of(words: str, x: float, y: float, **look: Any) -> Shape:
    """Make a text."""
    return shape_of("text", (x, y), words=words, **{**TEXT, **look})
