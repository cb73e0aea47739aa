"""As much of a part as can be read from a scene that is refused, so that it can be looked at."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from limitsets.errors import SceneError
from limitsets.geometry import OnSide, triangle_of
from limitsets.geometry.polygon import Vector
from limitsets.scene.quantities import base_unit, find, text_at
from limitsets.scene.reading import structure_of
from limitsets.scene.units import UNITS, convert, parse
from limitsets.scene.validation import plain


class Sketch(NamedTuple):
    """A part as it is written, whether or not it can be one.

    Attributes
    ----------
    name, unit : str
        Of the scene: its name, and its unit of length.
    vertices : ndarray, shape (n, 2)
        As they are given [length]; three lengths that make no triangle lie on one line.
    centre : tuple of float, or None
        Centre of mass where it is measured on a side [length].
    """

    name: str
    unit: str
    vertices: npt.NDArray[np.float64]
    centre: tuple[float, float] | None


def sketch(source: str | Path | Mapping[str, Any]) -> Sketch | None:
    """Read the outline of a part without any check; None where not even that can be read.

    Examples
    --------
    >>> from limitsets.scene.sketch import sketch
    >>> sketch({"part": {"vertices": [["0 in", "0 in"], ["4 in", "0 in"], ["4 in", "-1 ft"]]}}).vertices[2].tolist()
    [4.0, -12.0]
    """
    try:
        structure, file = structure_of(source)
        tree = plain(structure, file)
        part = tree["part"]
        unit = _unit_of(tree)
        if "sides" in part:
            lengths = [_number(tree, f"part.sides[{k}]", unit) for k in range(3)]
            corners = triangle_of(lengths, lambda square: math.sqrt(max(square, 0.0)))
        else:
            count = range(len(part["vertices"]))
            corners = tuple(
                (_number(tree, f"part.vertices[{k}].x", unit), _number(tree, f"part.vertices[{k}].y", unit))
                for k in count
            )
        return Sketch(str(tree["name"]), unit, np.array(corners, dtype=float), _centre(tree, unit, corners))
    except (SceneError, KeyError, TypeError, ValueError, ZeroDivisionError):
        return None


def _unit_of(tree: Mapping[str, Any]) -> str:
    """Give the unit of the arm's length, or of the first vertex or side where that cannot be read."""
    names = ("arm.length", "part.sides[0]", "part.vertices[0].x")
    for text in (text_at(tree, name) for name in names):
        try:
            return parse(text, "length").unit
        except SceneError:
            continue
    return UNITS["length"][0]


def _number(tree: Mapping[str, Any], name: str, unit: str) -> float:
    dimension = find(name).dimension
    return convert(parse(text_at(tree, name), dimension, key=name), base_unit(dimension, unit))


def _centre(tree: Mapping[str, Any], unit: str, corners: Sequence[Vector]) -> tuple[float, float] | None:
    try:
        side = tree["part"]["mass"]["center"]["side"]
        along, above = (_number(tree, f"part.mass.center.{word}", unit) for word in ("along", "above"))
        x, y = OnSide(int(side), along, above).in_frame(corners)
    except (SceneError, KeyError, TypeError, ValueError, IndexError, ZeroDivisionError):
        return None
    return float(x), float(y)
