"""A tray: parts wash over a plate's depressions again and again, and stay where they fall in rightly.

`passing` draws a part that comes by and a kick of the plate; `counting` counts what a depression does with both, in the
engine; `chain` says what follows for n passes; `histories` follows one depression pass by pass, and asks whether it
forgets; `filling` joins them (`limitsets.tray`).
`filming` keeps the passes of one depression for a film.  `pouring` lets many parts come by many
depressions at once, and `crowd` counts them.
"""

from limitsets.trays.chain import Chain as Chain
from limitsets.trays.crowd import TrayCrowd as TrayCrowd
from limitsets.trays.filling import TrayFill as TrayFill
from limitsets.trays.filling import tray as tray
from limitsets.trays.filming import filmed as filmed
from limitsets.trays.histories import Histories as Histories
from limitsets.trays.passing import Passes as Passes
from limitsets.trays.pouring import Pouring as Pouring
