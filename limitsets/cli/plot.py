"""`limitsets plot`: one figure."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from limitsets.cli.arguments import position
from limitsets.cli.output import Form, Json, Scene, answer, option, progress, saved
from limitsets.errors import LimitsetsError

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

FORMATS = (".png", ".svg", ".pdf")


class Picture(StrEnum):
    """What to draw."""

    PART = "part"
    LIMIT_SET = "limit-set"
    MAP = "map"
    BASINS = "basins"
    MORSE = "morse"
    FLIGHT = "flight"


def plot(
    scene: Scene,
    kind: Annotated[Picture, typer.Argument(metavar="KIND", help="What to draw.")],
    out: Annotated[
        Path | None,
        option("--out -o", "FILE", f"File ({', '.join(FORMATS)}), ./NAME-KIND.FORMAT by default."),
    ] = None,
    cells: Annotated[int, option("--cells", "N", "Cells per side.", min=1, max=10_000_000)] = 4096,
    x: Annotated[str | None, option("--x", "X", "For flight: where the part rests.")] = None,
    side: Annotated[int | None, option("--side", "I", "For flight: on which side.")] = None,
    form: Annotated[
        Form | None, option("--format", "FORMAT", "png, svg or pdf; by default what FILE says, else png.")
    ] = None,
    json: Json = False,
) -> None:
    """Draw one figure of a scene."""
    if form is not None and out is not None and out.suffix.lower() != f".{form}":
        raise LimitsetsError("the figure's file", str(out), f"a name that ends in .{form}", "leave one out")
    if out is not None and out.suffix.lower() not in FORMATS:
        raise LimitsetsError(
            "the figure's file", str(out), f"a name that ends in {', '.join(FORMATS)}", "rename it"
        )
    if (x is None) != (side is None) or (x is not None and kind is not Picture.FLIGHT):
        value = "half given" if kind is Picture.FLIGHT else "given"
        raise LimitsetsError("the throw to draw", value, "--x and --side, for a flight", "give both or none")
    with progress() as tell:
        from limitsets.report.writing import DPI

        wrong: LimitsetsError | None = None
        if kind is Picture.PART:
            name, drawn, wrong = _part(scene)
        else:
            name, drawn = _figure(scene, kind, cells, x, side, tell)
        file = out if out is not None else Path(f"{name}-{kind}.{form or Form.PNG}")
        with saved(file) as draft:
            drawn.savefig(draft, dpi=DPI)
    answer({"figure": str(file)}, json, lambda: typer.echo(f"figure: {file}"))
    if wrong is not None:
        raise wrong


def _part(scene: str) -> tuple[str, Figure, LimitsetsError | None]:
    """Draw what needs no analysis; of a part that is refused what can be read of it, and the error."""
    from limitsets.plot.parts import part, refused_part
    from limitsets.scene import load
    from limitsets.scene.sketch import sketch

    try:
        chosen = load(scene)
    except LimitsetsError as error:
        found = sketch(scene)
        if found is None:
            raise
        return found.name, refused_part(found, str(error)), error
    return chosen.name, part(chosen), None


def _figure(
    scene: str,
    kind: Picture,
    cells: int,
    x: str | None,
    side: int | None,
    tell: Callable[[str, int, int], None],
) -> tuple[str, Figure]:
    from limitsets.analysis import analyse as run
    from limitsets.report.writing import figure

    analysis = run(scene, cells, progress=tell)
    throw = None if x is None or side is None else (position(analysis.scene, x), side)
    return analysis.scene.name, figure(analysis, str(kind), throw)
