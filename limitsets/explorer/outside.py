"""Scenes from outside, typed, uploaded or drawn: text only, never a path, and small enough to follow a slider."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from limitsets.errors import SceneError
from limitsets.geometry import convex_polygon
from limitsets.geometry.mass import plate_with_points
from limitsets.geometry.polygon import above_side
from limitsets.scene import Scene, load
from limitsets.scene.units import written

MOST_BYTES = 64 * 1024
"""Of a scene's text: the largest that comes with the package has 2 kB."""

MOST_SIDES = 16
"""Of a part: the work of a picture grows with them."""


def scene_from(text: str) -> Scene:
    r"""Read a scene that a visitor typed or sent.

    Whatever it is, it is read as TOML: a name of a file or of a built-in scene is not looked up.

    Raises
    ------
    SceneError
        It is too large, no TOML, or no scene.

    Examples
    --------
    >>> scene_from("/etc/passwd")
    Traceback (most recent call last):
    limitsets.errors.SceneError: the text of the scene is 'not valid'; allowed: TOML; ...
    """
    size = len(text.encode("utf-8", "surrogatepass"))
    if size > MOST_BYTES:
        allowed = f"at most {MOST_BYTES} bytes"
        raise SceneError("the size of the scene", f"{size} bytes", allowed, "send the scene alone")
    return within_reach(load(text + "\n"))  # text with a line break is never taken for a path


def within_reach(scene: Scene) -> Scene:
    """Refuse a part with more sides than a picture can follow."""
    if len(scene.sides) > MOST_SIDES:
        allowed = f"at most {MOST_SIDES}"
        raise SceneError("the number of sides", len(scene.sides), allowed, "analyse it on the command line")
    return scene


def with_outline(scene: Scene, corners: npt.ArrayLike) -> Scene:
    """Give the scene with another part: a plate of one thickness, its corners in either sense [length].

    A goal that asks for a side which the part does not have is left out.

    Raises
    ------
    GeometryError
        No convex polygon, or one that cannot rest on a side.

    Examples
    --------
    >>> import limitsets as ls
    >>> with_outline(ls.load("paper-designed"), [(0, 0), (0, 3), (6, 3), (6, 0)]).centre
    (3.0, 1.5)
    """
    points = np.asarray(corners, dtype=np.float64)
    if len(points) >= 3 and _area(points) < 0:
        points = points[::-1]
    vertices = convex_polygon(points)
    plate = plate_with_points(vertices, 1.0)
    along, above, _ = above_side(vertices[0], vertices[1], plate.centre)
    unit, tree = scene.unit, scene.as_dict()
    tree["name"] = "drawn"
    tree["part"] = {
        "vertices": [[written(x, unit), written(y, unit)] for x, y in vertices.tolist()],
        "mass": {
            "center": {"side": 0, "along": written(float(along), unit), "above": written(float(above), unit)},
            "radius_of_gyration": written(float(plate.radius_of_gyration), unit),
        },
    }
    for table in ("cavity", "tray", "feedback", "tolerance"):
        tree.pop(table, None)
    if any(side >= len(vertices) for side in _sides_in(tree.get("goal"))):
        tree.pop("goal")
    return within_reach(load(tree))


def _area(points: npt.NDArray[np.float64]) -> float:
    x, y = points[:, 0], points[:, 1]
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _sides_in(goal: Any) -> list[int]:
    """List the sides that a goal names."""
    if isinstance(goal, dict):
        own = [goal["side"]] if isinstance(goal.get("side"), int) else []
        return own + [side for each in goal.values() for side in _sides_in(each)]
    return [each for each in goal if isinstance(each, int)] if isinstance(goal, list) else []
