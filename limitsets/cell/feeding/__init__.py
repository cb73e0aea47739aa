"""Feeding: the arm ends in a cavity, and a part that comes to rest beyond the end falls in.

`falling` says what becomes of such a part and how long it takes to tip.  `paths` and `proving` prove which sides can be
fed, that every start is, and brackets of the probabilities.  `trials` throws parts as experimenters do, counts their
fates, and finds the noise at which success falls to a share.  `crowd` throws many at once, in the engine.
`feeding_run` joins them (`limitsets.feed`), and is imported at the first use: a cavity is proposed without it.
"""

from typing import TYPE_CHECKING, Any

from limitsets.cell.feeding.falling import FATES, clear_beyond, proposed_cavity, time_to_tip

if TYPE_CHECKING:
    from limitsets.cell.feeding.feeding_run import Feeding, feed
else:

    def __getattr__(name: str) -> Any:
        if name not in ("Feeding", "feed"):
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from limitsets.cell.feeding import feeding_run

        return getattr(feeding_run, name)


__all__ = [
    "FATES",
    "Feeding",
    "clear_beyond",
    "feed",
    "proposed_cavity",
    "time_to_tip",
]
