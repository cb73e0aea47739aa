"""Certified regions: a plane of two quantities in cells, and of each cell a record that holds for all parameters in it.

The record is that of a Conley-Morse database (Arai, Kalies, Kokubu, Mischaikow, Oka, Pilarczyk, SIAM J. Appl. Dyn.
Syst. 8, 2009), for the throw: attracting blocks, the starts that come to them, the order of flips, the goal.
"""

from limitsets.parameters.regions.of_map import RegionsOfMap, certified_map
from limitsets.parameters.regions.plane import CODES, Regions, certified, largest_square, roomiest
from limitsets.parameters.regions.record import Block, Record, certify_cell
from limitsets.parameters.regions.writing import CellAxis, evenly

__all__ = [
    "CODES",
    "Block",
    "CellAxis",
    "Record",
    "Regions",
    "RegionsOfMap",
    "certified",
    "certified_map",
    "certify_cell",
    "evenly",
    "largest_square",
    "roomiest",
]
