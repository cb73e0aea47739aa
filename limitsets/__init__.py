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

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # each from the file that holds it: most rooms have a file of the same name
    from limitsets import engine, interval, maps, plot, resilience
    from limitsets.analysis import analyse
    from limitsets.animation import animate
    from limitsets.assembly import assemble
    from limitsets.auditing import audit
    from limitsets.cells import grid
    from limitsets.explorer import explore
    from limitsets.feeding import feed
    from limitsets.fitting import fit
    from limitsets.graph.morse import morse_graph
    from limitsets.graph.transitions import transitions
    from limitsets.inverse import design, robust_design
    from limitsets.maps import critical_points, orbit, register
    from limitsets.policies import feedback
    from limitsets.proofs.certify import certify
    from limitsets.proofs.confirm import recheck
    from limitsets.robust.margins.finding import margin
    from limitsets.robust.noise.statistics import noise_statistics
    from limitsets.robust.sheet.sheet_run import robustness
    from limitsets.scene import dump, load, scenes
    from limitsets.sets.attractors import attractors
    from limitsets.sets.basins import basins
    from limitsets.sets.cycles import cycles
    from limitsets.sets.limit_set import limit_set
    from limitsets.sweep.continuation import continuation
    from limitsets.sweep.parameter_atlas import atlas
    from limitsets.trays.filling import tray

__version__ = "0.1.0"

# Public name -> the room it comes from, or the file where a module bears the same name: that module could stand in for
# the function.  A namespace is its own room.
_ROOMS = {
    "analyse": "analysis",
    "animate": "animation",
    "atlas": "sweep.parameter_atlas",
    "attractors": "sets.attractors",
    "audit": "auditing",
    "basins": "sets.basins",
    "certify": "proofs.certify",
    "continuation": "sweep.continuation",
    "critical_points": "maps",
    "cycles": "sets.cycles",
    "design": "inverse",
    "dump": "scene",
    "engine": "engine",
    "assemble": "assembly",
    "explore": "explorer",
    "feed": "feeding",
    "feedback": "policies",
    "fit": "fitting",
    "grid": "cells",
    "interval": "interval",
    "limit_set": "sets.limit_set",
    "load": "scene",
    "maps": "maps",
    "margin": "robust.margins.finding",
    "morse_graph": "graph",
    "noise_statistics": "robust.noise.statistics",
    "orbit": "maps",
    "plot": "plot",
    "recheck": "proofs.confirm",
    "register": "maps",
    "resilience": "resilience",
    "robust_design": "inverse",
    "robustness": "robust.sheet.sheet_run",
    "scenes": "scene",
    "transitions": "graph.transitions",
    "tray": "trays",
}

__all__ = [
    "analyse",
    "animate",
    "assemble",
    "atlas",
    "attractors",
    "audit",
    "basins",
    "certify",
    "continuation",
    "critical_points",
    "cycles",
    "design",
    "dump",
    "engine",
    "explore",
    "feed",
    "feedback",
    "fit",
    "grid",
    "interval",
    "limit_set",
    "load",
    "maps",
    "margin",
    "morse_graph",
    "noise_statistics",
    "orbit",
    "plot",
    "recheck",
    "register",
    "resilience",
    "robust_design",
    "robustness",
    "scenes",
    "transitions",
    "tray",
]


if not TYPE_CHECKING:  # a checker of types has the imports above, and finds a name that is not there

    def __getattr__(name: str) -> Any:
        room = _ROOMS.get(name)
        if room is None:
            # Python proposes a similar name where it knows whose name is missing
            own = sys.modules[__name__]
            raise AttributeError(f"module 'limitsets' has no attribute {name!r}", name=name, obj=own)
        module = import_module(f"limitsets.{room}")
        return module if room == name else getattr(module, name)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
