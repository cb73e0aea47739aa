"""Pictures of scenes and answers; each function returns a `matplotlib.figure.Figure` and shows nothing.

    figure = limitsets.plot.limit_set(scene, found)
    figure.savefig("limit-set.png")

One file per family; `style.py` holds what they share.  Colours are told apart by colour-blind readers, and nothing is told
by colour alone: lines have styles, areas hatches, points markers.  No window, no pyplot: figures are made with the object
interface and drawn by Agg wherever that is the backend.
"""

from limitsets.plot.basins import basins
from limitsets.plot.flight import flight
from limitsets.plot.limit_set import limit_set
from limitsets.plot.map import map  # noqa: A004 - ls.plot.map is the word for it
from limitsets.plot.morse import morse

__all__ = ["basins", "flight", "limit_set", "map", "morse"]
