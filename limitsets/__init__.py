"""Limit sets, attractors and basins of throw-and-catch parts feeders, and of any discrete-time map with modes.

Scene -> map -> cells -> graph -> answers:

>>> import limitsets as ls
>>> scene = ls.load("paper-designed")
>>> graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))
>>> found = ls.attractors(graph)
>>> {side: [(round(lo, 1), round(hi, 1)) for lo, hi in parts] for side, parts in found[0].extents.items()}
{0: [(15.2, 19.8)], 1: [(12.6, 17.5)], 2: [(8.9, 23.4)]}

Names are loaded when first used, so the import itself costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from limitsets import maps, plot
    from limitsets.analysis import analyse
    from limitsets.cells import grid
    from limitsets.graph import morse_graph, transitions
    from limitsets.maps import critical_points, orbit, register
    from limitsets.scene import dump, load, scenes
    from limitsets.sets import attractors, basins, cycles, limit_set

__version__ = "0.1.0"

# Public name -> the room it comes from; a namespace is its own room.
_ROOMS = {
    "analyse": "analysis",
    "attractors": "sets",
    "basins": "sets",
    "critical_points": "maps",
    "cycles": "sets",
    "dump": "scene",
    "grid": "cells",
    "limit_set": "sets",
    "load": "scene",
    "maps": "maps",
    "morse_graph": "graph",
    "orbit": "maps",
    "plot": "plot",
    "register": "maps",
    "scenes": "scene",
    "transitions": "graph",
}

__all__ = [
    "analyse",
    "attractors",
    "basins",
    "critical_points",
    "cycles",
    "dump",
    "grid",
    "limit_set",
    "load",
    "maps",
    "morse_graph",
    "orbit",
    "plot",
    "register",
    "scenes",
    "transitions",
]


def __getattr__(name: str) -> Any:
    room = _ROOMS.get(name)
    if room is None:
        raise AttributeError(f"module 'limitsets' has no attribute {name!r}")
    module = import_module(f"limitsets.{room}")
    return module if room == name else getattr(module, name)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
