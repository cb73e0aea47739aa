"""Build the transition graph of a map on a grid, if the graph fits in memory."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from limitsets.base import AnswerError, arguments_checked
from limitsets.systems.cells import Grid
from limitsets.systems.graph.agreement import require_agreement
from limitsets.systems.graph.graph import TransitionGraph
from limitsets.systems.graph.images import METHODS
from limitsets.systems.graph.ranges import build
from limitsets.systems.graph.target import Target, cut_at_seams, no_boxes
from limitsets.systems.maps import kind_of
from limitsets.systems.maps.contract import compiled_kind_of, require_dimension, require_sides

# ----------------------------------------------------------------
# Test whether the graph of a grid fits in memory, before it is built: a process that needs more is killed.


# Bytes a cell at the peak, in one, two and three dimensions, as measured on textbook maps.
BYTES_BOXES, BYTES_SAMPLED = (125, 151, 197), (104, 95, 155)

# Below this the system is not asked, which takes longer than a small graph.
SMALL = 64 * 2**20

# Above this a graph is told of before it is built, on stderr; and the seconds a cell takes,
# as measured on maps in two and three dimensions.
TOLD, SECONDS = 4 * 10**9, 2.5e-7

# cgroup versions 2 and 1: limit, and what is in use.
LIMITS = (
    ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
    ("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"),
)


def _free_bytes() -> int | None:
    """Memory that this process may still take; None where the system does not say."""
    free_bytes = []
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        free_bytes += [1024 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:")]
    except OSError:
        if hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names:
            free_bytes.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    for limit, used in LIMITS:
        try:
            free_bytes.append(
                int(Path(limit).read_text(encoding="ascii")) - int(Path(used).read_text(encoding="ascii"))
            )
        except (OSError, ValueError):  # no such limit, or "max"
            continue
    return min(free_bytes, default=None)


def require_memory(grid: Grid, method: str) -> None:
    """Refuse a grid whose graph takes more memory than there is, and say what one takes that is large."""
    per_cell = BYTES_BOXES if method == "boxes" else BYTES_SAMPLED
    wanted = per_cell[grid.dimension - 1] * grid.n_cells
    if wanted <= SMALL:
        return
    free = _free_bytes()
    if free is None or wanted <= free:
        if wanted > TOLD:
            words = f"takes about {wanted / 1e9:.0f} GB and {SECONDS * grid.n_cells:.0f} s on one core"
            print(f"limitsets: the graph of {grid.n_cells} cells {words}", file=sys.stderr, flush=True)
        return
    share = (free / wanted) ** (1.0 / grid.dimension)
    fits = " by ".join(str(max(int(share * n), 1)) for n in grid.shape.max(axis=0).tolist())
    raise AnswerError(
        f"the memory for the graph of {grid.n_cells} cells",
        f"about {wanted / 1e9:.1f} GB",
        f"the {free / 1e9:.1f} GB that are free here",
        f"ask for fewer cells: {fits} fit",
    )


# ----------------------------------------------------------------
# Build the transition graph of a map on a grid.


@arguments_checked
def transitions(map: Any, grid: Grid, method: str | None = None, **options: Any) -> TransitionGraph:  # noqa: A002  # `map` is the word of the field and of the other calls
    """Who can go where in one step.

    Parameters
    ----------
    map : NamedTuple
        A map (`scene.map`, `limitsets.maps`, or your own after `limitsets.register`).
    grid : Grid
        Cells to go between.
    method : str, optional
        How the image of a cell is found, a word of docs/choosing.md.  Default: "end-points" in one dimension,
        "corners-padded" in more and of a map of vectorised=True.  "boxes" proves that no image of any point is missed,
        for a map with `image_box`; the others sample.
    **options
        For "boxes": upper, the upper corner of a box of parameters.

    Returns
    -------
    TransitionGraph
        A directed graph that networkx runs on.

    Raises
    ------
    AnswerError
        For a method that is none, or does not fit the map, an image on a side that the grid has not, or more cells
        than memory has room for.
    MapError
        For a grid of more sides than the map's, or a map of your own whose kernels contradict each other.

    Examples
    --------
    >>> import limitsets as ls
    >>> import networkx as nx
    >>> scene = ls.load("paper-designed")
    >>> graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))
    >>> nx.number_attracting_components(graph)  # the limit set, and the four sinks
    5
    """
    kind = kind_of(map)
    require_dimension(map, "grid", grid.dimension)
    require_sides(map, 0, grid.sides - 1)
    cut = grid.dimension == 1 and kind.on_arrays is None  # cells are cut where compiled images bend
    chosen = method or ("end-points" if cut else "corners-padded")
    if chosen not in METHODS:
        raise AnswerError("the image method", chosen, ", ".join(METHODS), "correct the word")
    if chosen == "boxes":
        compiled_kind_of(map, 'transitions by "boxes"')
    require_memory(grid, chosen)
    require_agreement(map, grid.domain, chosen == "boxes", options.get("upper"))
    target = Target.of(grid, kind.exits)
    inhabited = grid.domain.inhabited.tolist()
    none = no_boxes(grid.dimension, np.empty(0, np.uint8))
    parts = [
        METHODS[chosen](map, grid, side, target, **options) if some else none
        for side, some in enumerate(inhabited)
    ]
    if grid.domain.closes:
        parts = [cut_at_seams(part, grid.shape) for part in parts]
    if len(parts) == 1:
        cell, side, lo, hi, exits = (
            getattr(parts[0], name) for name in ("cell", "side", "lo", "hi", "exits")
        )
    else:
        cell = np.concatenate([part.cell + grid.offset[k] for k, part in enumerate(parts)])
        side, lo, hi, exits = (
            np.concatenate([getattr(part, name) for part in parts]) for name in ("side", "lo", "hi", "exits")
        )
    if cell.size == grid.n_cells and int(cell[-1]) == grid.n_cells - 1 and (np.diff(cell) == 1).all():
        first = np.arange(grid.n_cells + 1)
    else:
        first = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=grid.n_cells))])
    weights = grid.shape.prod(axis=1)
    share = float((np.array([part.second_pass for part in parts]) * weights).sum() / weights.sum())
    ranges = build(grid, first, side, lo, hi, exits)
    return TransitionGraph(map, grid, ranges, chosen, share, options.get("upper"))
