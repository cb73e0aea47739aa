"""Proved brackets of what becomes of parts, throw by throw, beside the probabilities that are computed."""

from __future__ import annotations

import math
from collections.abc import Callable

from limitsets.errors import AnswerError
from limitsets.feeding.falling import ArmEnd
from limitsets.robust.brackets.absorption import absorption_brackets
from limitsets.robust.brackets.result import AbsorptionBrackets
from limitsets.robust.noise.scattering import Scattering
from limitsets.robust.sheet.noise_input import still

Places = list[tuple[int, float, float]]

THROWS = 200


def fate_brackets(
    end: ArmEnd,
    scatter: Scattering,
    cells: int,
    *,
    throws: int = THROWS,
    progress: Callable[[str, int, int], None] | None = None,
) -> AbsorptionBrackets:
    """Prove brackets of the fates right, wrong, wall, edge and exits ("left") within n throws.

    A part that comes to rest where the next throw acts beyond the end has ended here, a throw before it is thrown.

    Raises
    ------
    AnswerError
        No noise, or one of which nothing is proved.
    """
    if not scatter.given():
        remedy = "give the scene a scatter, or pass one: without noise safety and progress are proved instead"
        raise AnswerError("the noise of the brackets", None, "of speed or landing place", remedy)
    starts = [
        (side, lo, hi)
        for lo, hi, side in zip(*(each.tolist() for each in end.ranges), strict=True)
        if lo < hi
    ]
    return absorption_brackets(
        still(end.scene),
        scatter,
        absorbing=_places(end),
        starts=starts,
        cells=cells,
        throws=throws,
        # without scatter of the landing a start next to the joint needs throws without bound
        mean=scatter.landing is not None,
        progress=progress,
    )


def _places(end: ArmEnd) -> dict[str, Places]:
    """Where parts are fed: right where they clear the wall on the wanted side, wall on the rest of it, else wrong."""
    right: Places = []
    wall: Places = []
    at, last = end.x, end.scene.arm_length
    for lo, hi in end.clear:
        low, high = end.x + lo, min(end.x + hi, last)
        if low > at:
            wall.append((end.side, at, low))
        right.append((end.side, low, math.inf if high >= last else high))
        at = high
    if at < last:
        wall.append((end.side, at, math.inf))
    wrong = [(side, end.x, math.inf) for side in range(len(end.scene.sides)) if side != end.side]
    edge = [(side, lo, end.x) for side, lo in enumerate(end.edges.tolist()) if lo < end.x]
    named = (("right", right), ("wrong", wrong), ("wall", wall), ("edge", edge))
    return {name: places for name, places in named if places}
