"""`limitsets recheck`: a certificate, checked anew."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from limitsets.cli.output import Json, Out, answer, progress

__all__ = ["recheck"]


def recheck(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A certificate, NAME.proof.zip.")],
    out: Out = None,
    json: Json = False,
) -> None:
    """Check a certificate by other code and in other arithmetic than those that made it.

    Exit 0 where every claim is proved; 1 where one fails or is proved of some starts only, or is a refutation.
    """
    with progress() as tell:
        from limitsets.proofs.confirm import recheck as check

        report = check(file, workers=None, progress=lambda done, of: tell("cells checked", done - 1, of))
    if report.verdict == "bad file":
        from limitsets.errors import AnswerError

        raise AnswerError("the certificate", str(file), "one that limitsets certify wrote", report.reason)

    from limitsets.checker import EXITS, show

    def text() -> None:
        show(report, str(file))

    answer(asdict(report), json, text, out)
    raise typer.Exit(EXITS[report.verdict])
