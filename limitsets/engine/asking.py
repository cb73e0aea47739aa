"""What can be asked of a crowd."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from limitsets.errors import AnswerError

if TYPE_CHECKING:
    from limitsets.scene import Scene


def area_of(scene: Scene) -> float:
    """Area of the part's outline [length^2]."""
    x, y = scene.vertices.T
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def check_asked(
    scenes: Sequence[Scene], contact: str, mu: float | None, sliding: float, e: float, step: float
) -> None:
    """Refuse parts that are not on one arm, and contacts that cannot be."""
    for name in ("unit", "kappa", "surface_height", "arm_length", "cavity"):
        values = {repr(getattr(scene, name)) for scene in scenes}
        if len(values) > 1:
            remedy = "parts on one arm share it, its throw and its cavity"
            raise AnswerError(f"{name} of the scenes", ", ".join(sorted(values)), "one value", remedy)
    if contact not in ("hinge", "unilateral"):
        raise AnswerError("the contact", contact, "'hinge' or 'unilateral'", "choose one")
    remedies = "give world.friction in the scene, or pass friction=0.5", "pass sliding=0.2"
    for name, value, remedy in zip(("on the arm", "elsewhere"), (mu, sliding), remedies, strict=True):
        if value is None or not 0.0 <= value < math.inf:
            raise AnswerError(f"the friction {name}", value, "a number from 0", remedy)
    if not 0.0 <= e <= 1.0:
        raise AnswerError("the restitution", e, "0 to 1", "pass restitution=0 for a plastic contact")
    if not 0.0 < step <= 0.05:
        raise AnswerError("the engine's step", step, "above 0 and at most 0.05 rad", "pass step=4e-3")
