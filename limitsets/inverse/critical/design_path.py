"""Limit sets along the path of a design, on which the critical points move to their targets (Fig. 6 of the paper)."""

from __future__ import annotations

from collections.abc import Callable

from limitsets.cells import grid
from limitsets.graph.transitions import transitions
from limitsets.inverse.critical.designing import Design
from limitsets.scene import Scene
from limitsets.sets.attractors import attractors
from limitsets.sets.limit_set import limit_set

Extents = dict[int, list[tuple[float, float]]]

# As many cells per side as an analysis takes.
CELLS = 4096


def limit_sets_along(
    found: Design, progress: Callable[[str, int, int], None] | None = None
) -> tuple[tuple[Extents, ...], ...]:
    """Compute the limit sets of every scene on a design's path.

    Parameters
    ----------
    found : Design
        From `limitsets.design`.
    progress : callable, optional
        Told ``(step, done, of)`` before each scene.

    Returns
    -------
    tuple of tuples of dict
        Per scene and attractor the intervals per side [length]: of its end points where they are known, of cells
        otherwise.  Sampled, not proved.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = ls.design("paper-initial", critical_points=[10, 10, 20],
    ...                   vary=["part.mass.center.along", "part.mass.center.above", "throw.speed"])
    >>> first, *_, last = limit_sets_along(found)
    >>> [round(last[0][2][0][end], 3) for end in (0, 1)]
    [8.914, 23.383]
    """
    sets = []
    for number, scene in enumerate(found.path):
        if progress is not None:
            progress("limit sets", number, len(found.path))
        sets.append(_limit_sets(scene))
    return tuple(sets)


def _limit_sets(scene: Scene) -> tuple[Extents, ...]:
    graph = transitions(scene.map, grid(scene.domain, cells=CELLS))
    found = []
    for attractor in attractors(graph):
        limit = limit_set(graph, attractor)
        found.append(limit.extents if limit.converged else attractor.extents)
    return tuple(found)
