"""Test whether the graph of a grid fits in memory, before it is built: a process that needs more is killed."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from limitsets.cells import Grid
from limitsets.errors import AnswerError

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
    found = []
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        found += [1024 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:")]
    except OSError:
        if hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names:
            found.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    for limit, used in LIMITS:
        try:
            found.append(
                int(Path(limit).read_text(encoding="ascii")) - int(Path(used).read_text(encoding="ascii"))
            )
        except (OSError, ValueError):  # no such limit, or "max"
            continue
    return min(found, default=None)


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
