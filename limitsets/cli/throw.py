"""`limitsets throw`: single throws, with what is worth knowing of each."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

from limitsets.cli.arguments import position
from limitsets.cli.output import Csv, Json, Out, Scene, answer, option, progress, show
from limitsets.files import as_table
from limitsets.tables import Column, Table

if TYPE_CHECKING:
    from limitsets.thrower import Trace

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
    from limitsets.scene import load
    from limitsets.thrower import trace

    chosen = load(scene)
    start = position(chosen, x)
    with progress() as tell:
        tell("throws (a first run compiles: up to half a minute)", 0, 1)
        path = trace(chosen.map_of_seed(seed), start, side, count)
    records = _records(path)

    found = _table(chosen.unit, (float(path.x[0]), int(path.side[0])), records)
    answer(records, json, lambda: show(found), out, (csv, lambda: found))
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
    from limitsets.maps import codes

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
