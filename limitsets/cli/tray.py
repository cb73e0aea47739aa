"""`limitsets tray`: how depressions fill over which parts wash again and again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from limitsets.cli.arguments import places_of
from limitsets.cli.output import Csv, Form, Format, Json, Scene, answer, opened, option, progress, show, table

if TYPE_CHECKING:
    from limitsets.trays import TrayDesign, TrayFill

HELP_OUT = "Write tray.json and a figure there; with --depths or --agitations design.json."
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
    depths: Annotated[
        str | None, option("--depths", "LO:HI:N", "Try N depths of the depressions instead.")
    ] = None,
    agitations: Annotated[str | None, option("--agitations", "LO:HI:N", "Try N agitations instead.")] = None,
    form: Format = Form.PNG,
    csv: Csv = None,
    out: Annotated[Path | None, option("--out -o", "DIR", HELP_OUT)] = None,
    json: Json = False,
) -> None:
    """Say how a tray's depressions fill: captures and releases counted in the engine, then the chain.

    With --depths or --agitations: for each of them, and the best again with another seed.
    """
    with progress() as tell:
        chosen, _ = opened(scene, out)
        common: dict[str, Any] = {
            "passes": passes,
            "drops": drops,
            "kicks": kicks,
            "seed": seed,
            "side": side,
            "progress": tell,
        }
        found: TrayFill | TrayDesign
        if depths is None and agitations is None:
            from limitsets.trays import tray as run

            crowd: dict[str, Any] = {
                "parts": parts,
                "depressions": depressions,
                "batches": batches,
                "file": file,
            }
            found = run(chosen, **common, histories=histories, **crowd, workers=workers)
        else:
            found = _designed(chosen, depths, agitations, common)
        record = found.to_json()
        files = [] if out is None else _written(found, record, out, form)
    answer(record, json, lambda: _text(found, files), csv=(csv, found.table))


def _designed(chosen: Any, depths: str | None, agitations: str | None, common: dict[str, Any]) -> TrayDesign:
    """Try the depths and agitations named; where one is not, the scene's own."""
    from limitsets.trays import tray_design

    own = chosen.tray
    at = [] if depths is None else places_of(chosen, depths, "--depths")
    kicks = [] if agitations is None else places_of(chosen, agitations, "--agitations")
    if own is not None:
        at, kicks = at or [own.depression_depth], kicks or [own.agitation]
    return tray_design(chosen, at, kicks, **common)


def _written(found: TrayFill | TrayDesign, record: dict[str, Any], out: Path, form: str) -> list[Path]:
    from limitsets import plot
    from limitsets.files import as_json
    from limitsets.report.writing import laid
    from limitsets.trays import TrayDesign

    drawn = (
        ("design", plot.tray_design(found)) if isinstance(found, TrayDesign) else ("tray", plot.tray(found))
    )
    return laid(out, [drawn], lambda _: {f"{drawn[0]}.json": as_json(record)}, form)


def _text(found: TrayFill | TrayDesign, files: list[Path]) -> None:
    from limitsets.trays import TrayDesign

    if isinstance(found, TrayDesign):
        _say_design(found)
    else:
        _say_fill(found)
    if files:
        typer.echo(f"written: {', '.join(map(str, files))}")


def _say_fill(found: TrayFill) -> None:
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


def _say_design(found: TrayDesign) -> None:
    unit = found.scene.unit
    heads = [f"depth [{unit}] \\ agitation [{unit}]", *(f"{each:.4g}" for each in found.agitations)]
    rows = [
        [f"{depth:.4g}", *(f"{share:.4f}" for share in row)]
        for depth, row in zip(found.depths, found.right, strict=True)
    ]
    typer.echo(f"{found.scene.name}: filled rightly after {found.passes} passes")
    table(heads, rows)
    depth, agitation = found.best
    again = found.confirmed.filled
    low, high = again.interval[-1].tolist()
    typer.echo(
        f"best: depth {depth:.4g} {unit}, agitation {agitation:.4g} {unit}; on fresh seeds {again.right[-1]:.4f} "
        f"({low:.4f} to {high:.4f}), rest {again.unfilled['empty']:.4f} empty, {again.unfilled['wrong']:.4f} wrong"
    )
