"""A tray: parts wash over a plate's depressions again and again, and stay where they fall in rightly.

`passing` draws a part that comes by and a kick of the plate, counts in the engine what a depression does with both,
follows one depression pass by pass, and keeps its passes for a film.  `pouring` lets many parts come by many
depressions at once.  `filling` says what follows for n passes (`limitsets.tray`).
"""

from limitsets.cell.trays.filling import Chain, TrayFill, tray
from limitsets.cell.trays.passing import Histories, Passes, filmed
from limitsets.cell.trays.pouring import Pouring, TrayCrowd

__all__ = [
    "Chain",
    "Histories",
    "Passes",
    "Pouring",
    "TrayCrowd",
    "TrayFill",
    "filmed",
    "tray",
]
