"""Feeding: the arm ends in a cavity, and a part that comes to rest beyond the end falls in.

`falling` says what becomes of such a part and how long it takes to tip.  `paths` and `proving` prove which sides can be
fed, that every start is, and brackets of the probabilities.  `trials` throws parts as experimenters do, counts their
fates, and finds the noise at which success falls to a share.  `crowd` throws many at once, in the engine.
`feeding_run` joins them (`limitsets.feed`).
"""

from limitsets.cell.feeding.falling import (
    FATES as FATES,
)
from limitsets.cell.feeding.falling import (
    clear_beyond as clear_beyond,
)
from limitsets.cell.feeding.falling import (
    time_to_tip as time_to_tip,
)
from limitsets.cell.feeding.feeding_run import Feeding as Feeding
from limitsets.cell.feeding.feeding_run import feed as feed
