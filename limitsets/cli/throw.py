"""`limitsets throw`: single throws, with what is worth knowing of each."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

from limitsets.cli.arguments import position
from limitsets.cli.output import Json, Out, Scene, answer, option, table
from limitsets.files import as_table

if TYPE_CHECKING:
    from limitsets.thrower import Trace

__all__ = ["throw"]

MOST_THROWS = 1_000_000


def throw(
    scene: Scene,
    x: Annotated[str, option("--x", "X", "Where the part rests: 8, or '20 cm'.")],
    side: Annotated[int, option("--side", "I", "On which side.")],
    count: Annotated[int, option("--count", "N", "How many throws.", min=1, max=MOST_THROWS)] = 1,
    out: Out = None,
    json: Json = False,
) -> None:
    """Throw a part, and say what each throw does; ends at the first exit."""
    from limitsets.scene import load
    from limitsets.thrower import trace

    chosen = load(scene)
    path = trace(chosen.map, position(chosen, x), side, count)
    records = _records(path)

    def text() -> None:
        rows = [[0, f"{path.x[0]:.6f}", int(path.side[0]), "start", "", "", ""]]
        rows += [_row(number, record) for number, record in enumerate(records, start=1)]
        unit = chosen.unit
        table(["throw", f"x [{unit}]", "side", "status", "turned by", f"displacement [{unit}]", "flag"], rows)

    answer(records, json, text, out)
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


def _row(number: int, record: dict[str, Any]) -> list[Any]:
    phi, shift = record["phi"], record["displacement"]
    return [
        number,
        f"{record['x']:.6f}",
        record["side"],
        record["status"],
        "-" if phi is None else f"{math.degrees(phi):.3f} deg",
        "-" if shift is None else f"{shift:+.6g}",
        "another vertex lands first" if record["other_vertex_first"] else "",
    ]
