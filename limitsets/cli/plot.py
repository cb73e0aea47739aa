"""`limitsets plot`: one figure."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from limitsets.cli.arguments import position
from limitsets.cli.output import Json, Scene, answer, option, progress, saved
from limitsets.errors import LimitsetsError

if TYPE_CHECKING:
    from limitsets.analysis import Analysis

__all__ = ["plot"]

FORMATS = (".png", ".svg", ".pdf")


class Picture(StrEnum):
    """What to draw."""

    LIMIT_SET = "limit-set"
    MAP = "map"
    BASINS = "basins"
    MORSE = "morse"
    FLIGHT = "flight"


def plot(
    scene: Scene,
    kind: Annotated[Picture, typer.Argument(metavar="KIND", help="What to draw.")],
    out: Annotated[
        Path | None, option("--out -o", "FILE", f"File ({', '.join(FORMATS)}), ./NAME-KIND.png by default.")
    ] = None,
    cells: Annotated[int, option("--cells", "N", "Cells per side.", min=1, max=10_000_000)] = 4096,
    x: Annotated[str | None, option("--x", "X", "For flight: where the part rests.")] = None,
    side: Annotated[int | None, option("--side", "I", "For flight: on which side.")] = None,
    json: Json = False,
) -> None:
    """Draw one figure of a scene."""
    if out is not None and out.suffix.lower() not in FORMATS:
        raise LimitsetsError(
            "the figure's file", str(out), f"a name that ends in {', '.join(FORMATS)}", "rename it"
        )
    if (x is None) != (side is None) or (x is not None and kind is not Picture.FLIGHT):
        value = "half given" if kind is Picture.FLIGHT else "given"
        raise LimitsetsError("the throw to draw", value, "--x and --side, for a flight", "give both or none")
    with progress() as tell:
        from limitsets.analysis import analyse as run

        analysis = run(scene, cells, progress=tell)
        file = out if out is not None else Path(f"{analysis.scene.name}-{kind}.png")
        _draw(analysis, kind, file, x, side)
    answer({"figure": str(file)}, json, lambda: typer.echo(f"figure: {file}"))


def _draw(analysis: Analysis, kind: Picture, file: Path, x: str | None, side: int | None) -> None:
    from limitsets.report.writing import DPI, figure

    throw = None if x is None or side is None else (position(analysis.scene, x), side)
    drawn = figure(analysis, str(kind), throw)
    with saved(file) as draft:
        drawn.savefig(draft, dpi=DPI)
