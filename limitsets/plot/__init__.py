"""Pictures of scenes and answers; each function returns a `matplotlib.figure.Figure` and shows nothing.

    figure = limitsets.plot.limit_set(scene, found)
    figure.savefig("limit-set.png")

One file per family; `style.py` holds what they share.  Colours are safe for colour-blind readers, and no information
is in colour alone: lines have styles, areas hatches, points markers.  No window and no pyplot: figures are made
with the object interface.  A file never has the name of a function of the room: after an
import of that file `plot.map` would be a module.
"""

from limitsets.plot.atlas_maps import atlas
from limitsets.plot.atlas_surfaces import atlas_surface
from limitsets.plot.audit_strips import audit
from limitsets.plot.basin import basins
from limitsets.plot.bifurcations import bifurcation
from limitsets.plot.counterexamples import counterexample
from limitsets.plot.designs import design
from limitsets.plot.flights import flight
from limitsets.plot.fronts import robust_design
from limitsets.plot.limit_sets import limit_set
from limitsets.plot.maps import map  # noqa: A004 - ls.plot.map is the word for it
from limitsets.plot.margins import margin_curve, tolerance_box, tornado
from limitsets.plot.morse_graphs import morse
from limitsets.plot.noise import noise_arrivals, noise_density, noise_levels
from limitsets.plot.residuals import fit_residuals

__all__ = [
    "atlas",
    "atlas_surface",
    "audit",
    "basins",
    "bifurcation",
    "counterexample",
    "design",
    "fit_residuals",
    "flight",
    "limit_set",
    "map",
    "margin_curve",
    "morse",
    "noise_arrivals",
    "noise_density",
    "noise_levels",
    "robust_design",
    "tolerance_box",
    "tornado",
]
