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
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from limitsets.cell.assembly import assemble as assemble
    from limitsets.cell.feeding import feed as feed
    from limitsets.cell.trays import tray as tray
    from limitsets.face import plot as plot
    from limitsets.face.animation import animate as animate
    from limitsets.face.explorer import explore as explore
    from limitsets.feeder import engine as engine
    from limitsets.feeder.scene import dump as dump, load as load, scenes as scenes
    from limitsets.numbers import interval as interval
    from limitsets.parameters.analysis import analyse as analyse
    from limitsets.parameters.atlas import atlas as atlas
    from limitsets.parameters.continuation import continuation as continuation
    from limitsets.parameters.design import design as design, robust_design as robust_design
    from limitsets.parameters.fitting import fit as fit
    from limitsets.parameters.margins.single import margin as margin
    from limitsets.parameters.noise import noise_statistics as noise_statistics
    from limitsets.parameters.sheet.sheet_run import robustness as robustness
    from limitsets.proofs.auditing import audit as audit
    from limitsets.proofs.policies import feedback as feedback
    from limitsets.proofs.prover import certify as certify
    from limitsets.proofs.prover.averaging import average as average
    from limitsets.proofs.prover.certificate import recheck as recheck
    from limitsets.proofs.prover.entropy import entropy as entropy
    from limitsets.proofs.prover.programs import formulas as formulas
    from limitsets.systems import maps as maps, resilience as resilience
    from limitsets.systems.cells import grid as grid
    from limitsets.systems.graph import morse_graph as morse_graph, transitions as transitions
    from limitsets.systems.maps import (
        critical_points as critical_points,
        orbit as orbit,
        register as register,
    )
    from limitsets.systems.maps.written import map as map  # noqa: A004  # an attribute of the package
    from limitsets.systems.sets import (
        attractors as attractors,
        basins as basins,
        cycles as cycles,
        limit_set as limit_set,
    )

__version__ = "0.1.0"

# Public name -> where it stands: `room:name` of a function, a room where the name is that of a room.  Rooms keep
# these names wherever they stand: README, docs and code of users import them, and those who call `limitsets.robust`
# need not know which wing has it.
_PUBLIC = {
    "analyse": "parameters.analysis:analyse",
    "animate": "face.animation:animate",
    "assemble": "cell.assembly:assemble",
    "atlas": "parameters.atlas:atlas",
    "attractors": "systems.sets:attractors",
    "average": "proofs.prover.averaging:average",
    "entropy": "proofs.prover.entropy:entropy",
    "audit": "proofs.auditing:audit",
    "basins": "systems.sets:basins",
    "certify": "proofs.prover:certify",
    "continuation": "parameters.continuation:continuation",
    "critical_points": "systems.maps:critical_points",
    "cycles": "systems.sets:cycles",
    "design": "parameters.design:design",
    "discrepancy": "parameters.discrepancy:discrepancy",
    "dump": "feeder.scene:dump",
    "explore": "face.explorer:explore",
    "feed": "cell.feeding:feed",
    "feedback": "proofs.policies:feedback",
    "fit": "parameters.fitting:fit",
    "formulas": "proofs.prover.programs:formulas",
    "grid": "systems.cells:grid",
    "interval_chain": "proofs.chances.interval_chain:interval_chain",
    "limit_set": "systems.sets:limit_set",
    "load": "feeder.scene:load",
    "map": "systems.maps.written:map",
    "margin": "parameters.margins.single:margin",
    "morse_graph": "systems.graph:morse_graph",
    "noise_statistics": "parameters.noise:noise_statistics",
    "orbit": "systems.maps:orbit",
    "recheck": "proofs.prover.certificate:recheck",
    "register": "systems.maps:register",
    "robust_design": "parameters.design:robust_design",
    "robustness": "parameters.sheet.sheet_run:robustness",
    "scenes": "feeder.scene:scenes",
    "transitions": "systems.graph:transitions",
    "tray": "cell.trays:tray",
    "analysis": "parameters.analysis",
    "animation": "face.animation",
    "arguments": "base.arguments",
    "assembly": "cell.assembly",
    "auditing": "proofs.auditing",
    "cells": "systems.cells",
    "cli": "face.cli",
    "drawing": "feeder.drawing",
    "engine": "feeder.engine",
    "errors": "base.errors",
    "explorer": "face.explorer",
    "feeding": "cell.feeding",
    "files": "base.files",
    "fitting": "parameters.fitting",
    "geometry": "feeder.geometry",
    "goals": "feeder.goals",
    "graph": "systems.graph",
    "interval": "numbers.interval",
    "inverse": "parameters.design",
    "jit": "numbers.jit",
    "maps": "systems.maps",
    "plot": "face.plot",
    "policies": "proofs.policies",
    "progress": "base.progress",
    "regions": "parameters.regions",
    "report": "face.report",
    "resilience": "systems.resilience",
    "robust": "parameters.noise",
    "scene": "feeder.scene",
    "sets": "systems.sets",
    "sweep": "parameters.atlas",
    "tables": "base.tables",
    "thrower": "feeder.thrower",
    "topology": "systems.sets.topology",
    "trays": "cell.trays",
}

__all__ = [
    "analyse",
    "animate",
    "assemble",
    "atlas",
    "attractors",
    "audit",
    "average",
    "basins",
    "certify",
    "continuation",
    "critical_points",
    "cycles",
    "design",
    "dump",
    "engine",
    "entropy",
    "explore",
    "feed",
    "feedback",
    "fit",
    "formulas",
    "grid",
    "interval",
    "limit_set",
    "load",
    "map",
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


class _Rooms:
    """Find a room, and what is in it, under its public name: the module itself, never a second copy.

    A finder and loader without their base classes: `importlib.abc` takes longer to import than the rest of this file.
    """

    def find_spec(self, fullname: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        package, _, name = fullname.partition(".")
        room = name.partition(".")[0]
        known = package == __name__ and room in _PUBLIC and ":" not in _PUBLIC[room]
        loader: Any = self
        return ModuleSpec(fullname, loader) if known else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        room, _, rest = spec.name.removeprefix(f"{__name__}.").partition(".")
        module = import_module(f"{__name__}.{_PUBLIC[room]}" + (f".{rest}" if rest else ""))
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Give the module its own name back: the import machinery has just set that of the alias."""
        spec: Any = module.__spec__
        if spec.loader is self:
            module.__spec__ = spec.loader_state


if not any(type(finder).__name__ == _Rooms.__name__ for finder in sys.meta_path):
    # before the finder of files, which would read a file in a room a second time
    sys.meta_path.insert(0, _Rooms())


if not TYPE_CHECKING:  # a checker of types has the imports above, and finds a name that is not there

    def __getattr__(name: str) -> Any:
        place = _PUBLIC.get(name)
        if place is None:
            # Python proposes a similar name where it knows whose name is missing
            own = sys.modules[__name__]
            raise AttributeError(f"module 'limitsets' has no attribute {name!r}", name=name, obj=own)
        room, _, function = place.partition(":")
        module = import_module(f"{__name__}.{room}")
        return getattr(module, function) if function else globals().setdefault(name, module)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
