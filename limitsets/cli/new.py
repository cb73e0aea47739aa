"""`limitsets new`: a scene to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from limitsets.cli.output import Json, answer, option
from limitsets.proposals import proposed


def new(
    file: Annotated[
        Path, typer.Argument(metavar="FILE.toml", help="The file to write; it must not be there.")
    ],
    unit: Annotated[str, option("--unit", "UNIT", "Of its lengths: mm, cm, m, in, ...")] = "in",
    json: Json = False,
) -> None:
    """Write a scene to start from: every key that a scene may have, with what it means."""
    from limitsets.scene.starting import new_scene

    written = new_scene(file, unit)

    def text() -> None:
        typer.echo(f"scene: {written}")
        typer.echo(f"next: edit it, then {proposed('check', written)} and {proposed('analyse', written)}")

    answer({"scene": str(written)}, json, text)
