"""`limitsets check`: all that is wrong with a scene, at once."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import typer

from limitsets.cli.output import Csv, Json, Out, Scene, answer
from limitsets.files import picked
from limitsets.tables import Table

if TYPE_CHECKING:
    from limitsets.scene import Scene as SceneOf

WORDS = ("key", "thing", "value", "allowed", "remedy")


def check(scene: Scene, out: Out = None, csv: Csv = None, json: Json = False) -> None:
    """Say all that is wrong with a scene: unknown keys, values, units, contradictions, improbable values.

    A line each; exit 2 where anything is wrong.
    """
    from limitsets.scene import load
    from limitsets.scene.checking import examined

    found, doubts = examined(scene)
    records = [{"improbable": False, **picked(error, *WORDS, "file")} for error in found]
    records += [{"improbable": True, **picked(doubt, *WORDS, "file")} for doubt in doubts]
    heads = (*WORDS, "improbable")
    rows = Table(heads, [[str(record[word] or "") for word in heads] for record in records], scene)

    def text() -> None:
        for each in (*found, *doubts):
            typer.echo(str(each))
        unlikely = f", {_count(len(doubts), 'improbable')}" if doubts else ""
        typer.echo(f"{scene}: {_count(len(found), 'wrong')}{unlikely}")
        if not found and (note := _beside_kappa(load(scene))):
            typer.echo(f"{scene}: {note}")

    answer(records, json, text, out, (csv, lambda: rows))
    raise typer.Exit(2 if found else 0)


def _beside_kappa(scene: SceneOf) -> str:
    """Say of a gravity that changes no throw what it is for; empty where it changes them, or is not given."""
    if scene.gravity is None or "kappa" not in scene.text["throw"]:
        return ""
    speed = math.degrees(scene.value("throw.speed"))
    return f"throw.kappa gives the throw, and gravity changes none: it tells which speed that is, {speed:.4g} deg/s"


def _count(number: int, word: str) -> str:
    things = "nothing is" if not number else "1 thing is" if number == 1 else f"{number} things are"
    return f"{things} {word}"
