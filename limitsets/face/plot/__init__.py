"""Pictures of scenes and answers; each function returns a `matplotlib.figure.Figure` and shows nothing.

    figure = limitsets.plot.limit_set(scene, found)
    figure.savefig("limit-set.png")

One file per family; `style.py` holds what they share.  Colours are safe for colour-blind readers, and no information
is in colour alone: lines have styles, areas hatches, points markers.  No window and no pyplot: figures are made
with the object interface.  A file never has the name of a function of the room: after an
import of that file `plot.map` would be a module.

A file is imported at the first use of one of its functions, so that a limit set does not load the libraries for maps
of an atlas.
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from limitsets.face.plot.atlas_maps import atlas as atlas
    from limitsets.face.plot.atlas_surfaces import (
        atlas_surface as atlas_surface,
    )
    from limitsets.face.plot.atlas_surfaces import (
        bifurcation as bifurcation,
    )
    from limitsets.face.plot.basin import basins as basins
    from limitsets.face.plot.basin import morse as morse
    from limitsets.face.plot.designs import design as design
    from limitsets.face.plot.designs import robust_design as robust_design
    from limitsets.face.plot.fed_parts import assembly as assembly
    from limitsets.face.plot.fed_parts import feeding as feeding
    from limitsets.face.plot.filled_trays import tray as tray
    from limitsets.face.plot.limit_sets import limit_set as limit_set
    from limitsets.face.plot.limit_sets import map as map  # noqa: A004 - its public name
    from limitsets.face.plot.margins import (
        audit as audit,
    )
    from limitsets.face.plot.margins import (
        counterexample as counterexample,
    )
    from limitsets.face.plot.margins import (
        margin_curve as margin_curve,
    )
    from limitsets.face.plot.margins import (
        tolerance_box as tolerance_box,
    )
    from limitsets.face.plot.margins import (
        tornado as tornado,
    )
    from limitsets.face.plot.noise import (
        fit_residuals as fit_residuals,
    )
    from limitsets.face.plot.noise import (
        noise_arrivals as noise_arrivals,
    )
    from limitsets.face.plot.noise import (
        noise_density as noise_density,
    )
    from limitsets.face.plot.noise import (
        noise_levels as noise_levels,
    )
    from limitsets.face.plot.parts import flight as flight
    from limitsets.face.plot.policies import policy as policy


_FILES = {
    "assembly": "fed_parts",
    "atlas": "atlas_maps",
    "atlas_surface": "atlas_surfaces",
    "audit": "margins",
    "basins": "basin",
    "bifurcation": "atlas_surfaces",
    "counterexample": "margins",
    "design": "designs",
    "feeding": "fed_parts",
    "fit_residuals": "noise",
    "flight": "parts",
    "limit_set": "limit_sets",
    "map": "limit_sets",
    "margin_curve": "margins",
    "morse": "basin",
    "noise_arrivals": "noise",
    "noise_density": "noise",
    "noise_levels": "noise",
    "part": "parts",
    "policy": "policies",
    "robust_design": "designs",
    "tolerance_box": "margins",
    "tornado": "margins",
    "tray": "filled_trays",
}

__all__ = [*_FILES]


def __getattr__(name: str) -> Any:
    if name not in _FILES:
        raise AttributeError(
            f"module 'limitsets.plot' has no attribute {name!r}", name=name, obj=sys.modules[__name__]
        )
    return getattr(import_module(f"limitsets.face.plot.{_FILES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(_FILES)
