"""Image methods: from a cell to the cells its image meets.

A method is a function ``(map, grid, side, target, **options) -> TargetBoxes``.  Most sample: they are a function
``(grid, side, **options) -> SamplePoints`` in `sampled`.  To add one, write its file and name it here.
"""

from limitsets.systems.graph.images.enclosed import enclosed
from limitsets.systems.graph.images.sampled import corners, corners_padded, end_points, sampled

__all__ = ["METHODS"]

METHODS = {
    "boxes": enclosed,
    "corners": sampled(corners),
    "corners-padded": sampled(corners_padded),
    "end-points": sampled(end_points),
}
