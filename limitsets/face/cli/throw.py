"""`limitsets throw` and `plot`: single throws, with what is worth knowing of each, and one figure."""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from limitsets.base.errors import LimitsetsError
from limitsets.base.files import as_table
from limitsets.base.tables import Column, Table
from limitsets.face.cli.arguments import position
from limitsets.face.cli.output import Csv, Form, Json, Out, Scene, answer, option, progress, saved, show

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    from limitsets.feeder.thrower import Trace


MOST_THROWS = 1_000_000


def throw(
    scene: Scene,
    x: Annotated[str, option("--x", "X", "Where the part rests: 8, or '20 cm'.")],
    side: Annotated[int, option("--side", "I", "On which side.")],
    count: Annotated[int, option("--count", "N", "How many throws.", min=1, max=MOST_THROWS)] = 1,
    seed: Annotated[int, option("--seed", "N", "Of throws that scatter ([effects] spread).", min=0)] = 0,
    out: Out = None,
    csv: Csv = None,
    json: Json = False,
) -> None:
    """Throw a part, and say what each throw does; ends at the first exit."""
    from limitsets.feeder.scene import load
    from limitsets.feeder.thrower import trace

    chosen = load(scene)
    start = position(chosen, x)
    with progress() as tell:
        tell("throws (a first run compiles: up to half a minute)", 0, 1)
        path = trace(chosen.map_of_seed(seed), start, side, count)
    records = _records(path)

    listing = _table(chosen.unit, (float(path.x[0]), int(path.side[0])), records)
    answer(records, json, lambda: show(listing), out, (csv, lambda: listing))
    if chosen.effects.auto:
        typer.echo(
            "limitsets: auto in [effects] is resolved by limitsets analyse; thrown with: "
            + (", ".join(chosen.effects.on()) or "no effects"),
            err=True,
        )
    if path.reason is not None:
        typer.echo(f"limitsets: outside-model: {path.reason}", err=True)
    if path.stopped == "stalled":
        typer.echo(
            "limitsets: stalled: the displacement is too small to change x any more; no fixed point", err=True
        )


def _records(path: Trace) -> list[dict[str, Any]]:
    from limitsets.systems.maps import codes

    return [
        as_table(
            x=path.x[k + 1],
            side=path.side[k + 1],
            status=codes.NAMES[int(path.code[k])],
            phi=path.phi[k],
            displacement=path.displacement[k],
            sides_turned=path.turned[k],
            other_vertex_first=path.other_vertex_first[k],
            **({"reason": path.reason} if path.code[k] == codes.OUTSIDE_MODEL else {}),
        )
        for k in range(path.code.size)
    ]


def _table(unit: str, start: tuple[float, int], records: list[dict[str, Any]]) -> Table:
    columns = (
        "throw",
        Column("x", unit, ".6f"),
        "side",
        "status",
        Column("turned by", "deg", ".3f"),
        Column("displacement", unit, "+.6g"),
        Column("another vertex lands first", show=lambda value: "yes" if value else ""),
    )
    rows: list[tuple[Any, ...]] = [(0, *start, "start", None, None, False)]
    for number, record in enumerate(records, start=1):
        phi = record["phi"]
        told = (
            None if phi is None else math.degrees(phi),
            record["displacement"],
            record["other_vertex_first"],
        )
        rows.append((number, record["x"], record["side"], record["status"], *told))
    return Table(columns, rows, "Throws", "computed, not proved")


# ---------------------------------------------------------------- `limitsets plot`: one figure


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
        from limitsets.face.report.writing import DPI

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
    """Draw the part, which needs no analysis; if it is refused, draw its readable corners and return the error."""
    from limitsets.face.plot.parts import part, refused_part
    from limitsets.feeder.scene import load
    from limitsets.feeder.scene.reading import sketch

    try:
        chosen = load(scene)
    except LimitsetsError as error:
        outline = sketch(scene)
        if outline is None:
            raise
        return outline.name, refused_part(outline, str(error)), error
    return chosen.name, part(chosen), None


def _figure(
    scene: str,
    kind: Picture,
    cells: int,
    x: str | None,
    side: int | None,
    tell: Callable[[str, int, int], None],
) -> tuple[str, Figure]:
    from limitsets.face.report.writing import figure
    from limitsets.parameters.analysis import analyse as run

    analysis = run(scene, cells, progress=tell)
    throw = None if x is None or side is None else (position(analysis.scene, x), side)
    return analysis.scene.name, figure(analysis, str(kind), throw)
