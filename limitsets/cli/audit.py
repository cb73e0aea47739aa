"""`limitsets audit`: what the model leaves out, and where the scene calls for it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from limitsets.cli.output import Csv, Form, Format, Json, Scene, answer, opened, option, progress, table

if TYPE_CHECKING:
    from limitsets.auditing import Audit


def audit(
    scene: Scene,
    out: Annotated[
        Path | None, option("--out -o", "DIR", "Write audit.md, audit.json and figures there.")
    ] = None,
    form: Format = Form.PNG,
    csv: Csv = None,
    json: Json = False,
) -> None:
    """Ask which assumptions of the model a scene breaks: on its limit set, and on the whole arm."""
    with progress() as tell:
        chosen, _ = opened(scene, out)
        tell("assumptions", 0, 1 + (out is not None))
        from limitsets.auditing import audit as run

        found = run(chosen)
        files = []
        if out is not None:
            from limitsets.report.audit_pages import write_audit

            tell("files", 1, 2)
            files = write_audit(found, out, form)
    answer(found, json, lambda: _text(found, files), csv=(csv, found.table))


def _text(found: Audit, files: list[Path]) -> None:
    from limitsets.report.audit_pages import HEADS, lines_of, summary

    table(HEADS, lines_of(found))
    for line in summary(found):
        typer.echo(line)
    if files:
        typer.echo(f"report: {files[0]}")
