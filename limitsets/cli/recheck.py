"""`limitsets recheck`: a certificate, checked anew."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from limitsets.cli.output import Csv, Json, Out, answer, progress
from limitsets.tables import Table


def recheck(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A certificate, NAME.proof.zip.")],
    out: Out = None,
    csv: Csv = None,
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

    found = Table(("claim", "verdict", "reason"), report.claims, str(file))
    answer(report, json, lambda: show(report, str(file)), out, (csv, lambda: found))
    raise typer.Exit(EXITS[report.verdict])
