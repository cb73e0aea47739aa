"""Places at which an assumption of the model is broken: a flag beside the answers, never a state of the map."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from limitsets.scene import Scene

Array = NDArray[np.float64]
Interval = tuple[float, float]
Extents = Mapping[int, Sequence[Interval]]

SAMPLES = 4096


def other_vertex_first(scene: Scene) -> dict[int, list[tuple[float, float]]]:
    """Find the starts from which another vertex than the left one would land first.

    The part has then turned by more than the exterior angle at its left vertex, and the model's formulas speak of a
    landing that does not take place.

    Parameters
    ----------
    scene : Scene
        The scene.

    Returns
    -------
    dict of int to list of (lo, hi)
        Per side of the part the intervals of `scene.domain`, ascending [length]; an empty list where it never
        happens, or where the scene simulates the effect `landing`.  Between 4096 samples a narrower interval may be
        missed.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.analysis import other_vertex_first
    >>> found = other_vertex_first(ls.load("paper-designed"))
    >>> [(side, round(lo, 4)) for side, parts in found.items() for lo, _ in parts]
    [(0, 20.1517), (1, 26.4235)]
    """
    from limitsets.auditing.stretches import where
    from limitsets.thrower import impact_angles

    if scene.effects.landing:
        return {side: [] for side in range(len(scene.sides))}
    found = {}
    for side in range(len(scene.sides)):
        corner = float(scene.sides.corner[side])
        x = np.linspace(float(scene.domain.lo[side, 0]), float(scene.domain.hi[side, 0]), SAMPLES)

        def beyond(at: Array, side: int = side, corner: float = corner) -> NDArray[np.bool_]:
            return impact_angles(scene.map, at, side) > corner

        found[side] = where(beyond, x)
    return found


def in_limit_sets(flags: Extents, sets: Iterable[Extents]) -> dict[int, list[Interval]]:
    """Give, per side, where in a limit set a flag is [length]; sides without any are left out.

    Examples
    --------
    >>> from limitsets.analysis import in_limit_sets
    >>> in_limit_sets({0: [(1.0, 3.0)]}, [{0: [(2.0, 5.0)]}, {1: [(0.0, 1.0)]}])
    {0: [(2.0, 3.0)]}
    """
    found: dict[int, list[Interval]] = {}
    for extents in sets:
        for side, parts in extents.items():
            found.setdefault(side, []).extend(
                (max(a, lo), min(b, hi))
                for a, b in flags.get(side, ())
                for lo, hi in parts
                if max(a, lo) <= min(b, hi)
            )
    return {side: sorted(parts) for side, parts in sorted(found.items()) if parts}
