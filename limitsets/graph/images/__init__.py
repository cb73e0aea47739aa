"""Image methods: from a cell to the cells its image meets.

A method is a function ``(grid, side, **options) -> Samples``; to add one, write its file and name it here.
"""

from limitsets.graph.images.centres import centres
from limitsets.graph.images.corners import corners, corners_padded, end_points
from limitsets.graph.images.random import random
from limitsets.graph.images.samples import Samples

__all__ = ["METHODS", "Samples"]

METHODS = {
    "centres": centres,
    "corners": corners,
    "corners-padded": corners_padded,
    "end-points": end_points,
    "random": random,
}
