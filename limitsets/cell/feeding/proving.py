"""Proofs of feeding: which sides, from which starts, under every noise; brackets throw by throw; their certificate.

The arm ends at X.  On enclosed images of cells an orbit goes on from cells before X, and ends in a cell beyond.

*Safety*: a cell from which no cell beyond X on another side can be reached feeds the wanted side only, under any
sequence of the noise.  *Progress*: where neither a recurrent cell nor an exit can be reached from a cell, before X,
every start in it is fed, within as many throws as the longest path has.  An orbit that is never fed makes that
impossible; then almost every start is fed where the starts that stay before X are proved to thin out.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from limitsets.base import AnswerError, Progress, silent
from limitsets.cell.feeding.falling import ArmEnd
from limitsets.cell.feeding.paths import MOST_SIDES, Fed, Paths, Safe, verdict_of_share
from limitsets.feeder.goals import OrientedBeyond
from limitsets.feeder.scattering import Scattering
from limitsets.parameters.sheet.summary import still
from limitsets.proofs.chances.absorption import AbsorptionBrackets, absorption_brackets
from limitsets.proofs.prover.attraction import Attraction, attraction
from limitsets.proofs.prover.certificate import write
from limitsets.proofs.prover.certifying import spelled_deviations
from limitsets.proofs.prover.cover import cover
from limitsets.proofs.prover.goals import State, hexed
from limitsets.proofs.prover.goals.kind import above, below
from limitsets.proofs.prover.goals.recurrent_orbits import Refutation, cycle_that, meets
from limitsets.proofs.prover.goals.violating_orbits import one_throw
from limitsets.proofs.prover.parameters import ParameterBox, joined, parameter_box, scattered
from limitsets.proofs.prover.proof import thrown_orbit
from limitsets.systems.graph.images.enclosed import PIECES_OF_PARAMETER

# ----------------------------------------------------------------
# Proved brackets of what becomes of parts, throw by throw, beside the probabilities that are computed.


Places = list[tuple[int, float, float]]

THROWS = 200


def fate_brackets(
    end: ArmEnd,
    scatter: Scattering,
    cells: int,
    *,
    throws: int = THROWS,
    progress: Progress | None = None,
) -> AbsorptionBrackets:
    """Prove brackets of the fates right, wrong, wall, edge and exits ("left") within n throws.

    A part that comes to rest where the next throw acts beyond the end has ended here, a throw before it is thrown.

    Raises
    ------
    AnswerError
        No noise, or one of which nothing is proved.
    """
    if not scatter.given():
        remedy = "give the scene a scatter, or pass one: without noise safety and progress are proved instead"
        raise AnswerError("the noise of the brackets", None, "of speed or landing place", remedy)
    starts = [
        (side, lo, hi)
        for lo, hi, side in zip(*(each.tolist() for each in end.ranges), strict=True)
        if lo < hi
    ]
    return absorption_brackets(
        still(end.scene),
        scatter,
        absorbing=_places(end),
        starts=starts,
        cells=cells,
        throws=throws,
        # without scatter of the landing a start next to the joint needs throws without bound
        mean=scatter.landing is not None,
        progress=progress,
    )


def _places(end: ArmEnd) -> dict[str, Places]:
    """Where parts are fed: right where they clear the wall on the wanted side, wall on the rest of it, else wrong."""
    right: Places = []
    wall: Places = []
    at, last = end.x, end.scene.arm_length
    for lo, hi in end.clear:
        low, high = end.x + lo, min(end.x + hi, last)
        if low > at:
            wall.append((end.side, at, low))
        right.append((end.side, low, math.inf if high >= last else high))
        at = high
    if at < last:
        wall.append((end.side, at, math.inf))
    wrong = [(side, end.x, math.inf) for side in range(len(end.scene.sides)) if side != end.side]
    edge = [(side, lo, end.x) for side, lo in enumerate(end.edges.tolist()) if lo < end.x]
    named = (("right", right), ("wrong", wrong), ("wall", wall), ("edge", edge))
    return {name: places for name, places in named if places}


# ----------------------------------------------------------------
# Which sides can be fed, from which starts, under every sequence of the noise; and that every start is fed.


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
    attraction : Attraction
        Cells and images.
    """

    safe: Safe
    fed: Fed
    attraction: Attraction


def _cuts(end: ArmEnd) -> dict[int, list[float]]:
    """Places, by side, at which cells have to end: the end of the arm, and the ends of where parts are laid down."""
    borders = [below(end.x), above(end.x)]
    return {
        side: borders + [place for on, *ends in end.laid if on == side for place in ends]
        for side in range(len(end.scene.sides))
    }


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
    tell = progress or silent
    every = joined(spelled_deviations(scene, noise), spelled_deviations(scene, scattered(scene)))
    box, cuts = parameter_box(scene, noise=every), _cuts(end)
    wrong = OrientedBeyond(end.x, end.side, from_anywhere=True).wrong()
    shown: tuple[State, ...] = ()
    never = Refutation()
    begin, proved = time.perf_counter(), ""
    pieces = _pieces(box, cuts, seconds) if every else PIECES[0]
    for step, cells in enumerate(LADDER):
        began = time.perf_counter()
        tell(f"proof on {cells} cells a side{proved}", step, len(LADDER) + 2)
        region = attraction(cover(box, cells, cuts, pieces))
        paths = Paths.of(region, end)
        safe, fed = paths.safe(), paths.fed()
        if safe.verdict != "proved":
            shown = shown or one_throw(region, wrong, up_to=end.x, laid=end.laid)
        if shown:
            safe = replace(safe, verdict="refuted", counterexample=shown)
        if fed.verdict != "proved":
            tell("almost every start", step, len(LADDER) + 2)
            fed = paths.almost(fed)
        if step == 0 and fed.verdict != "proved":
            tell("an orbit that is never fed", len(LADDER), len(LADDER) + 2)
            never = cycle_that(
                region, scene, lambda loop: meets(loop, end.laid) and bool((loop.hi < below(end.x)).all())
            )
        if never.states:
            cycle, reason = never.recurs.get("cycle", {}), "a periodic orbit is never fed"
            fed = replace(fed, verdict="refuted", never_fed=never.states, cycle=cycle, reason=reason)
        if _is_answered(safe, fed):
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
    return FeedingProof(safe, fed, region)


def _is_answered(safe: Safe, fed: Fed) -> bool:
    """Whether no finer cells can say more: of the starts that are not fed, whether these are almost none too."""
    refuted = fed.verdict == "refuted" and fed.almost_every == "proved"
    return safe.verdict in ("proved", "refuted") and (fed.verdict == "proved" or refuted)


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


# ----------------------------------------------------------------
# The certificate of a proof of feeding: which side, and from which starts; the checker redoes the rest.


PROVED = ("proved", "proved-on-cells")


def section_of(proof: FeedingProof, end: ArmEnd) -> dict[str, Any]:
    """Write what a recheck needs: the side, and for each part that is proved its starts and counts, or its orbit."""
    safe, fed, region = proof
    section: dict[str, Any] = {"side": end.side} | ({"laid": hexed(end.laid)} if end.laid else {})
    bare = len(section)
    if safe.share > 0.0:
        section["safety"] = "every" if safe.share == 1.0 else "cells"
    if safe.counterexample:
        section["wrong"] = thrown_orbit(safe.counterexample, {}, region.cover.box.kappa_varies)
    if fed.verdict in PROVED:
        starts = "every" if fed.share == 1.0 else {str(side): x for side, x in fed.beyond.items()}
        section["progress"] = {"starts": _starts(starts), "throws": fed.throws}
    if fed.almost_every in PROVED:
        starts = fed.almost_from["from"] if isinstance(fed.almost_from, dict) else fed.almost_from
        section["almost"] = {"starts": _starts(starts), "thinning": fed.thinning}
    if fed.cycle:
        section["never_fed"] = dict(fed.cycle)
    return section if len(section) > bare else {}


def _starts(given: str | dict[str, float]) -> Any:
    return given if isinstance(given, str) else {"from": {side: float(x).hex() for side, x in given.items()}}


def verdict_of(proof: FeedingProof, *, laid: bool = False) -> str:
    """Give the verdict on safety and progress together, of all starts or of those laid down, as the checker does."""
    safe, fed, _ = proof
    if safe.counterexample or (fed.never_fed and fed.almost_every not in PROVED):
        return "refuted"
    every, almost = fed.verdict in PROVED, fed.almost_every in PROVED
    share = min(safe.share, max(fed.share * every, fed.almost_share * almost))
    return "proved-on-cells" if laid and 0.0 < share < 1.0 else verdict_of_share(share)


def holds(proof: FeedingProof, end: ArmEnd) -> bool:
    """Whether a certificate can hold something of it."""
    return not proof.attraction.cover.box.effects and bool(section_of(proof, end))


def write_proof(
    path: str | Path, proof: FeedingProof, end: ArmEnd, *, recheck: bool = True, workers: int | None = 1
) -> Path:
    """Write it, replacing an older file whole; it gets its name once the checker has confirmed it.

    Raises
    ------
    AnswerError
        Nothing is proved, or it is proved of a map that no recheck knows.
    DeniedError
        The checker does not confirm it: it is kept as NAME.denied.zip.
    """
    section, box = section_of(proof, end), proof.attraction.cover.box
    if box.effects:
        remedy = "nothing rechecks other maps; the proof stands in .safe and .fed"
        raise AnswerError("the certificate", "with effects", "the minimal model, and noise", remedy)
    if not section:
        remedy = "see the reason in .fed; a part without a proof is in no certificate"
        raise AnswerError("the certificate", "without a proved claim", "safety or progress", remedy)
    write(
        path,
        [proof.attraction],
        [{"claim": "feeds", "section": section, "verdict": verdict_of(proof, laid=bool(end.laid))}],
        noise=box.noise or None,
        tolerance=None,
        recheck=recheck,
        workers=workers,
    )
    return Path(path)
