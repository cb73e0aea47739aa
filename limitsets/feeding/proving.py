"""Which sides can be fed, from which starts, under every sequence of the noise; and that every start is fed.

The arm ends at X.  On enclosed images of cells an orbit goes on from cells before X, and ends in a cell beyond.

*Safety*: a cell from which no cell beyond X on another side can be reached feeds the wanted side only, under any
sequence of the noise.  *Progress*: where neither a recurrent cell nor an exit can be reached from a cell, before X,
every start in it is fed, within as many throws as the longest path has.  An orbit that is never fed makes that
impossible; then almost every start is fed where the starts that stay before X are proved to thin out.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from limitsets.errors import AnswerError
from limitsets.feeding.falling import ArmEnd
from limitsets.feeding.paths import MOST_SIDES, Paths
from limitsets.feeding.verdicts import Fed, Safe
from limitsets.goals import OrientedBeyond
from limitsets.graph.images.enclosed import PIECES_OF_PARAMETER
from limitsets.proofs.attraction import Attraction, attraction
from limitsets.proofs.certify import spelled_deviations
from limitsets.proofs.cover import cover
from limitsets.proofs.goals import State
from limitsets.proofs.goals.kind import above, below
from limitsets.proofs.goals.recurrent_orbits import Refutation, cycle_that, meets
from limitsets.proofs.goals.violating_starts import one_throw
from limitsets.proofs.parameters import ParameterBox, parameter_box
from limitsets.proofs.simulated import joined, scattered

Progress = Callable[[str, int, int], None]

# Cells per side, tried in turn until both questions are answered.
LADDER = (2048, 8192, 32768)

# How much longer finer cells take than the ones before.
FINER = 4.0

# Pieces of what the noise lets vary: the most that the first cells can have done in time, and in no less than SOON [s].
PIECES = (PIECES_OF_PARAMETER[1], 64, 16, 4)
SOON = 10.0
# On so many cells a side it is measured how long that takes.
FEW = 64


class FeedingProof(NamedTuple):
    """What is proved of feeding, and the cells on which.

    Attributes
    ----------
    safe : Safe
        Which sides can be fed.
    fed : Fed
        Whether every start is.
    found : Attraction
        Cells and images.
    """

    safe: Safe
    fed: Fed
    found: Attraction


def proved_feeding(
    end: ArmEnd,
    noise: Mapping[str, str] | None = None,
    *,
    seconds: float = math.inf,
    progress: Progress | None = None,
) -> FeedingProof:
    """Prove which sides can be fed and that every start is, or show what refutes it.

    Parameters
    ----------
    end : ArmEnd
        The end of the arm, the side wanted.
    noise : mapping of str to str, optional
        ``{"throw.speed": "0.3 %"}``: what may differ at every throw, as for `limitsets.certify`.
    seconds : float
        Finer cells than the first are tried only if they are likely to be done in so many seconds from the start.  The
        first cut what the noise lets vary into fewer pieces where they would take longer, and longer than 10 s.
    progress : callable, optional
        Told (stage, done, all); the stage names the shares that are proved so far.

    Returns
    -------
    FeedingProof
        Of one cover: of the finest that was tried.

    Raises
    ------
    AnswerError
        For effects or noise of which nothing can be proved, or a part of more than seven sides.
    """
    scene = end.scene
    if len(scene.sides) > MOST_SIDES:
        raise AnswerError(
            "the sides of the part", len(scene.sides), f"up to {MOST_SIDES}", "pass prove=False"
        )
    tell = progress or (lambda stage, done, of: None)
    every = joined(spelled_deviations(scene, noise), spelled_deviations(scene, scattered(scene)))
    box, borders = parameter_box(scene, noise=every), [below(end.x), above(end.x)]
    cuts = {
        side: borders + [place for on, *ends in end.laid if on == side for place in ends]
        for side in range(len(scene.sides))
    }
    wrong = OrientedBeyond(end.x, end.side, from_anywhere=True).wrong()
    shown: tuple[State, ...] = ()
    never = Refutation()
    begin, proved = time.perf_counter(), ""
    pieces = _pieces(box, cuts, seconds) if every else PIECES[0]
    for step, cells in enumerate(LADDER):
        began = time.perf_counter()
        tell(f"proof on {cells} cells a side{proved}", step, len(LADDER) + 2)
        found = attraction(cover(box, cells, cuts, pieces))
        paths = Paths.of(found, end)
        safe, fed = paths.safe(), paths.fed()
        if safe.verdict != "proved":
            shown = shown or one_throw(found, wrong, up_to=end.x, laid=end.laid)
        if shown:
            safe = replace(safe, verdict="refuted", counterexample=shown)
        if fed.verdict != "proved":
            tell("almost every start", step, len(LADDER) + 2)
            fed = paths.almost(fed)
        if step == 0 and fed.verdict != "proved":
            tell("an orbit that is never fed", len(LADDER), len(LADDER) + 2)
            never = cycle_that(
                found, scene, lambda loop: meets(loop, end.laid) and bool((loop.hi < below(end.x)).all())
            )
        if never.states:
            cycle, reason = never.recurs.get("cycle", {}), "a periodic orbit is never fed"
            fed = replace(fed, verdict="refuted", never_fed=never.states, cycle=cycle, reason=reason)
        refuted = fed.verdict == "refuted" and fed.almost_every == "proved"
        if safe.verdict in ("proved", "refuted") and (fed.verdict == "proved" or refuted):
            break
        proved = f"; so far {100 * safe.share:.4g} % safe, {100 * max(fed.share, fed.almost_share):.4g} % fed"
        now = time.perf_counter()
        if cells < LADDER[-1] and now - begin + FINER * (now - began) > seconds:
            open_ = f"finer cells than {cells} a side were not tried: they would take more than {seconds:g} s"
            fed = replace(fed, reason="; ".join(filter(None, (fed.reason, open_))))
            break
    if pieces < PIECES[0] and not (safe.verdict == fed.verdict == "proved"):
        open_ = f"the noise was cut into {pieces} pieces, not {PIECES[0]}, which would take longer"
        fed = replace(fed, reason="; ".join(filter(None, (fed.reason, open_))))
    return FeedingProof(safe, fed, found)


def _pieces(box: ParameterBox, cuts: Mapping[int, Sequence[float]], seconds: float) -> int:
    """Say into how many pieces the noise can be cut in time, by what a few cells take."""
    if math.isinf(seconds):
        return PIECES[0]
    took = math.inf
    for _ in range(2):  # the first run may compile
        began = time.perf_counter()
        cover(box, FEW, cuts)
        took = min(took, (time.perf_counter() - began) * LADDER[0] / FEW)
        if took <= max(seconds, SOON):
            return PIECES[0]
    return next((n for n in PIECES if took * n / PIECES[0] <= max(seconds, SOON)), PIECES[-1])
