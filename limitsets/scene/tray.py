"""A tray: a plate with equal depressions, over which parts wash again and again."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from limitsets.geometry.polygon import Scalar, Vector, above_side, side_ends
from limitsets.scene.resolve import Resolver

if TYPE_CHECKING:
    from limitsets.goals import Goal
    from limitsets.scene.schema import TrayTable


@dataclass(frozen=True)
class Tray:
    """A plate with equal depressions, each with upright walls and a level floor.

    Parameters
    ----------
    depression_width, depression_depth : float
        Of each depression [length].
    pitch : float
        From one depression to the next [length].
    agitation : float
        The height that a kick of one standard deviation throws a part to [length].
    wash : float
        The height of a fall that ends at the largest speed with which parts come along the plate [length].
    """

    depression_width: float
    depression_depth: float
    pitch: float
    agitation: float
    wash: float


def heights_over_sides(
    vertices: Sequence[Vector],
    sqrt: Callable[[Scalar], Scalar] = math.sqrt,
    larger: Callable[[Scalar, Scalar], Scalar] = max,
) -> list[Scalar]:
    """How high the part stands when it lies on each side [length]."""
    ends = (side_ends(len(vertices), side) for side in range(len(vertices)))
    measured = (
        (above_side(vertices[left], vertices[right], corner, sqrt)[1] for corner in vertices)
        for left, right in ends
    )
    return [functools.reduce(larger, heights) for heights in measured]


def resolve_tray(
    table: TrayTable,
    vertices: npt.NDArray[np.float64],
    lengths: npt.NDArray[np.float64],
    goal: Goal | None,
    resolver: Resolver,
) -> Tray:
    """Resolve ``[tray]`` for a part with these vertices and lengths of its sides."""
    names = ("depression_width", "depression_depth", "pitch", "agitation", "wash")
    sizes = Tray(
        **{name: resolver.positive(getattr(table, name), "length", f"tray.{name}") for name in names}
    )
    corners = [(float(x), float(y)) for x, y in vertices]
    heights, wanted = heights_over_sides(corners), getattr(goal, "side", None)
    fit_for = range(len(heights)) if wanted is None else [wanted]
    side = min(fit_for, key=lengths.__getitem__)
    unit, of_side = resolver.unit, f"of side {side}"
    if sizes.depression_width < lengths[side]:
        allowed = f"at least {lengths[side]:.6g} {unit}, the length {of_side}"
        raise resolver.refusal(
            "tray.depression_width",
            "the width of a depression",
            table.depression_width,
            allowed,
            "the part cannot lie in it: widen it",
        )
    highest = max(heights[each] for each in fit_for)
    if not sizes.depression_depth < highest:
        allowed = f"below {highest:.6g} {unit}, the height of the part in it"
        raise resolver.refusal(
            "tray.depression_depth",
            "the depth of a depression",
            table.depression_depth,
            allowed,
            "the depression is deeper than the part, and nothing would pop out: make it less deep",
        )
    if not sizes.pitch > sizes.depression_width:
        allowed = f"above the width of a depression, {sizes.depression_width:.6g} {unit}"
        remedy = "depressions overlap: set them farther apart"
        raise resolver.refusal("tray.pitch", "the pitch", table.pitch, allowed, remedy)
    return sizes
