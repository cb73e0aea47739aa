"""Pictures of scenes and answers; each function returns a `matplotlib.figure.Figure` and shows nothing.

    figure = limitsets.plot.limit_set(scene, found)
    figure.savefig("limit-set.png")

One file per family; `style.py` holds what they share.  Colours are safe for colour-blind readers, and no information
is in colour alone: lines have styles, areas hatches, points markers.  No window and no pyplot: figures are made
with the object interface.  A file never has the name of a function of the room: after an
import of that file `plot.map` would be a module.

A file is imported where one of its functions is first asked for: what the maps of an atlas need is not loaded for a
limit set.
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from limitsets.plot.assemblies import assembly as assembly
    from limitsets.plot.atlas_maps import atlas as atlas
    from limitsets.plot.atlas_surfaces import atlas_surface as atlas_surface
    from limitsets.plot.audit_strips import audit as audit
    from limitsets.plot.basin import basins as basins
    from limitsets.plot.bifurcations import bifurcation as bifurcation
    from limitsets.plot.counterexamples import counterexample as counterexample
    from limitsets.plot.designs import design as design
    from limitsets.plot.fed_parts import feeding as feeding
    from limitsets.plot.filled_trays import tray as tray
    from limitsets.plot.flights import flight as flight
    from limitsets.plot.fronts import robust_design as robust_design
    from limitsets.plot.limit_sets import limit_set as limit_set
    from limitsets.plot.maps import map as map  # noqa: A004 - its public name
    from limitsets.plot.margins import margin_curve as margin_curve
    from limitsets.plot.margins import tolerance_box as tolerance_box
    from limitsets.plot.margins import tornado as tornado
    from limitsets.plot.morse_graphs import morse as morse
    from limitsets.plot.noise import noise_arrivals as noise_arrivals
    from limitsets.plot.noise import noise_density as noise_density
    from limitsets.plot.noise import noise_levels as noise_levels
    from limitsets.plot.policies import policy as policy
    from limitsets.plot.residuals import fit_residuals as fit_residuals

_FILES = {
    "assembly": "assemblies",
    "atlas": "atlas_maps",
    "atlas_surface": "atlas_surfaces",
    "audit": "audit_strips",
    "basins": "basin",
    "bifurcation": "bifurcations",
    "counterexample": "counterexamples",
    "design": "designs",
    "feeding": "fed_parts",
    "fit_residuals": "residuals",
    "flight": "flights",
    "limit_set": "limit_sets",
    "map": "maps",
    "margin_curve": "margins",
    "morse": "morse_graphs",
    "noise_arrivals": "noise",
    "noise_density": "noise",
    "noise_levels": "noise",
    "part": "parts",
    "policy": "policies",
    "robust_design": "fronts",
    "tolerance_box": "margins",
    "tornado": "margins",
    "tray": "filled_trays",
}

__all__ = [*_FILES]


def __getattr__(name: str) -> Any:
    if name not in _FILES:
        own = sys.modules[__name__]
        raise AttributeError(f"module 'limitsets.plot' has no attribute {name!r}", name=name, obj=own)
    return getattr(import_module(f"limitsets.plot.{_FILES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(_FILES)
