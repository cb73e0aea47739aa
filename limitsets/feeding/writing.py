"""The certificate of a proof of feeding: which side, and from which starts; the checker redoes the rest."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from limitsets.errors import AnswerError
from limitsets.feeding.falling import ArmEnd
from limitsets.feeding.paths import verdict_of_share
from limitsets.feeding.proving import FeedingProof
from limitsets.feeding.verdicts import Fed
from limitsets.proofs.certificate import write
from limitsets.proofs.goals import hexed
from limitsets.proofs.refutation import thrown_orbit

PROVED = ("proved", "proved-on-cells")


def section_of(proof: FeedingProof, end: ArmEnd) -> dict[str, Any]:
    """Write what a recheck needs: the side, and for each part that is proved its starts and counts, or its orbit."""
    safe, fed, found = proof
    section: dict[str, Any] = {"side": end.side} | ({"laid": hexed(end.laid)} if end.laid else {})
    bare = len(section)
    if safe.share > 0.0:
        section["safety"] = "every" if safe.share == 1.0 else "cells"
    if safe.counterexample:
        section["wrong"] = thrown_orbit(safe.counterexample, {}, found.cover.box.kappa_varies)
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
    share = min(safe.share, _progress(fed))
    return "proved-on-cells" if laid and 0.0 < share < 1.0 else verdict_of_share(share)


def _progress(fed: Fed) -> float:
    """Share of the starts of which every one, or almost every one, is fed."""
    return max(
        fed.share if fed.verdict in PROVED else 0.0, fed.almost_share if fed.almost_every in PROVED else 0.0
    )


def holds(proof: FeedingProof, end: ArmEnd) -> bool:
    """Whether a certificate can hold something of it."""
    return not proof.found.cover.box.effects and bool(section_of(proof, end))


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
    section, box = section_of(proof, end), proof.found.cover.box
    if box.effects:
        raise AnswerError(
            "the certificate",
            "with effects",
            "the minimal model, and noise",
            "nothing rechecks other maps; the proof stands in .safe and .fed",
        )
    if not section:
        remedy = "see the reason in .fed; a part without a proof is in no certificate"
        raise AnswerError("the certificate", "without a proved claim", "safety or progress", remedy)
    try:
        producer = {"limitsets": version("limitsets")}
    except PackageNotFoundError:  # sources that are not installed
        producer = {}
    claim = {"claim": "feeds", "section": section, "verdict": verdict_of(proof, laid=bool(end.laid))}
    write(
        path,
        [proof.found],
        [claim],
        noise=box.noise or None,
        tolerance=None,
        unit=end.scene.unit,
        producer=producer,
        recheck=recheck,
        workers=workers,
    )
    return Path(path)
