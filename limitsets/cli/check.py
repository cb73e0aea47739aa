"""`limitsets check`: all that is wrong with a scene, at once."""

from __future__ import annotations

import typer

from limitsets.cli.output import Csv, Json, Out, Scene, answer
from limitsets.files import picked
from limitsets.tables import Table

__all__ = ["check"]

WORDS = ("key", "thing", "value", "allowed", "remedy")


def check(scene: Scene, out: Out = None, csv: Csv = None, json: Json = False) -> None:
    """Say all that is wrong with a scene: unknown keys, values, units, contradictions; a line each.

    Exit 2 where anything is.
    """
    from limitsets.scene.checking import problems

    found = problems(scene)
    records = [picked(error, *WORDS) | {"file": error.file} for error in found]
    rows = Table(WORDS, [[str(record[word] or "") for word in WORDS] for record in records], scene)

    def text() -> None:
        for error in found:
            typer.echo(str(error))
        typer.echo(f"{scene}: {_count(len(found))}")

    answer(records, json, text, out, (csv, lambda: rows))
    raise typer.Exit(2 if found else 0)


def _count(number: int) -> str:
    return (
        "nothing is wrong"
        if not number
        else "1 thing is wrong"
        if number == 1
        else f"{number} things are wrong"
    )
