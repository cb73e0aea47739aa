"""`limitsets tray`: how depressions fill over which parts wash again and again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from limitsets.cli.output import Csv, Form, Format, Json, Scene, answer, opened, option, progress, show

if TYPE_CHECKING:
    from limitsets.trays import TrayFill

HELP_OUT = "Write tray.json and a figure there."
HELP_PARTS = "Let N parts come by at once in each pass, in the engine, that push each other."
HELP_FILE = "Keep finished batches of --parts there; the same command goes on with what is left."
HELP_HISTORIES = "Depressions followed pass by pass in the engine, with new parts and with parts that return."


def tray(
    scene: Scene,
    side: Annotated[int | None, option("--side", "I", "The side wanted. Default: the goal's.")] = None,
    passes: Annotated[
        int, option("--passes", "N", "Passes of parts over the tray.", min=1, max=10_000)
    ] = 200,
    drops: Annotated[int, option("--drops", "N", "Parts that come by an empty depression.", min=1)] = 4000,
    kicks: Annotated[
        int | None, option("--kicks", "N", "Kicks in each state. Default: half the drops.", min=1)
    ] = None,
    histories: Annotated[int, option("--histories", "N", HELP_HISTORIES, min=0)] = 0,
    seed: Annotated[int, option("--seed", "N", "Of all draws.", min=0)] = 0,
    parts: Annotated[int | None, option("--parts", "N", HELP_PARTS, min=1, max=1000)] = None,
    depressions: Annotated[
        int | None,
        option("--depressions", "N", "Of the tray, for --parts. Default: one a part.", min=1, max=1000),
    ] = None,
    batches: Annotated[int, option("--batches", "N", "How often --parts are tried.", min=1)] = 10,
    workers: Annotated[int | None, option("--workers", "N", "Processes that run the batches.", min=1)] = None,
    file: Annotated[Path | None, option("--file", "FILE", HELP_FILE)] = None,
    form: Format = Form.PNG,
    csv: Csv = None,
    out: Annotated[Path | None, option("--out -o", "DIR", HELP_OUT)] = None,
    json: Json = False,
) -> None:
    """Say how a tray's depressions fill: captures and releases counted in the engine, then the chain."""
    with progress() as tell:
        chosen, _ = opened(scene, out)
        from limitsets.trays import tray as run

        found = run(
            chosen,
            passes=passes,
            drops=drops,
            kicks=kicks,
            histories=histories,
            seed=seed,
            side=side,
            parts=parts,
            depressions=depressions,
            batches=batches,
            file=file,
            workers=workers,
            progress=tell,
        )
        record = found.to_json()
        files = [] if out is None else _written(found, record, out, form)
    answer(record, json, lambda: _text(found, files), csv=(csv, found.table))


def _written(found: TrayFill, record: dict[str, Any], out: Path, form: str) -> list[Path]:
    from limitsets import plot
    from limitsets.files import as_json
    from limitsets.report.writing import laid

    return laid(out, [("tray", plot.tray(found))], lambda _: {"tray.json": as_json(record)}, form)


def _text(found: TrayFill, files: list[Path]) -> None:
    filled, counts, unit = found.filled, found.counts, found.scene.unit
    sizes, plate = found.passes.tray, found.passes.plate
    typer.echo(
        f"{found.scene.name}: depressions {sizes.depression_width:g} {unit} wide and {sizes.depression_depth:g} "
        f"{unit} deep, side {found.passes.side} is right; unilateral contact, friction {plate.friction:g}, "
        f"restitution {plate.restitution:g}"
    )
    show(found.tables()[0])
    for n in sorted({1, 10, len(filled.right) - 1} & set(range(len(filled.right)))):
        low, high = filled.interval[n].tolist()
        typer.echo(
            f"filled rightly after {n} pass{'es' if n > 1 else ''}: {filled.right[n]:.4f} ({low:.4f} to {high:.4f})"
        )
    rest = filled.unfilled
    typer.echo(
        f"the rest after endless passes: {rest['empty']:.4f} empty, {rest['wrong']:.4f} with a wrong part; "
        f"without wrong parts p_release/(p_capture + p_release) = {filled.rest:.4f}"
    )
    for each in found.histories:
        words = "parts that return" if each.returning else "new parts"
        low, high = each.interval(each.filled.size - 1)
        typer.echo(
            f"{len(each.after_pass)} histories with {words}: {each.filled[-1]:.4f} ({low:.4f} to {high:.4f})"
        )
    for at_once in found.tables()[2:]:
        typer.echo(at_once.caption)
        show(at_once)
    if found.crowd_chain is not None:
        right, (low, high) = found.crowd_chain.right[-1], found.crowd_chain.interval[-1].tolist()
        typer.echo(f"by the chain, of as many parts one by one: right {right:.4f} ({low:.4f} to {high:.4f})")
    if counts.unfinished:
        typer.echo(f"{counts.unfinished} parts did not come to rest; they are left out")
    if files:
        typer.echo(f"written: {', '.join(map(str, files))}")
