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
    from limitsets.face.plot.atlas_maps import atlas
    from limitsets.face.plot.atlas_surfaces import atlas_surface, bifurcation
    from limitsets.face.plot.basin import basins, morse
    from limitsets.face.plot.designs import design, robust_design
    from limitsets.face.plot.discrepancies import discrepancy
    from limitsets.face.plot.fed_parts import assembly, feeding
    from limitsets.face.plot.filled_trays import tray
    from limitsets.face.plot.films import film_rests
    from limitsets.face.plot.limit_sets import limit_set, map  # noqa: A004 - its public name
    from limitsets.face.plot.margins import audit, counterexample, margin_curve, tolerance_box, tornado
    from limitsets.face.plot.noise import fit_residuals, noise_arrivals, noise_density, noise_levels
    from limitsets.face.plot.parameter_regions import regions
    from limitsets.face.plot.parts import flight, part
    from limitsets.face.plot.policies import policy
    from limitsets.face.plot.tipping import resting_sides

__all__ = [
    "assembly", "atlas", "atlas_surface", "audit", "basins", "bifurcation", "counterexample", "design", "discrepancy",
    "feeding", "film_rests", "fit_residuals", "flight", "limit_set", "map", "margin_curve", "morse", "noise_arrivals",
    "noise_density", "noise_levels", "part", "policy", "regions", "resting_sides", "robust_design", "tolerance_box",
    "tornado", "tray",
]  # fmt: skip

_FILES = {
    "atlas_maps": ("atlas",),
    "atlas_surfaces": ("atlas_surface", "bifurcation"),
    "basin": ("basins", "morse"),
    "designs": ("design", "robust_design"),
    "discrepancies": ("discrepancy",),
    "fed_parts": ("assembly", "feeding"),
    "filled_trays": ("tray",),
    "films": ("film_rests",),
    "limit_sets": ("limit_set", "map"),
    "margins": ("audit", "counterexample", "margin_curve", "tolerance_box", "tornado"),
    "noise": ("fit_residuals", "noise_arrivals", "noise_density", "noise_levels"),
    "parameter_regions": ("regions",),
    "parts": ("flight", "part"),
    "policies": ("policy",),
    "tipping": ("resting_sides",),
}


def __getattr__(name: str) -> Any:
    for file, names in _FILES.items():
        if name in names:
            return getattr(import_module(f"limitsets.face.plot.{file}"), name)
    own = sys.modules[__name__]
    raise AttributeError(f"module 'limitsets.plot' has no attribute {name!r}", name=name, obj=own)


def __dir__() -> list[str]:
    return __all__
