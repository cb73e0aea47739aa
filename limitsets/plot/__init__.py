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

from importlib import import_module
from typing import Any

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
    "policy": "policies",
    "robust_design": "fronts",
    "tolerance_box": "margins",
    "tornado": "margins",
    "tray": "filled_trays",
    "tray_design": "filled_trays",
}

__all__ = [*_FILES]


def __getattr__(name: str) -> Any:
    if name not in _FILES:
        raise AttributeError(f"module 'limitsets.plot' has no attribute {name!r}")
    return getattr(import_module(f"limitsets.plot.{_FILES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(_FILES)
