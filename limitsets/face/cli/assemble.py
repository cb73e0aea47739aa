"""`limitsets assemble` and `tray`: pairs of parts thrown into a cavity, and depressions that fill."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from limitsets.face.cli.arguments import deviations
from limitsets.face.cli.output import (
    Csv,
    Form,
    Format,
    Json,
    Scene,
    Words,
    answer,
    opened,
    option,
    progress,
    show,
)

if TYPE_CHECKING:
    from limitsets.cell.assembly import Assembly
    from limitsets.cell.trays import TrayFill


HELP_SECOND = "The part that is to lie on top of the first, with the same arm, throw and cavity."
HELP_SCATTER = (
    "Random noise at every throw, like throw.speed='0.5 %'; repeatable. Default: the scenes', if any."
)
HELP_CONTACT = "With contact in the scenes: hinge (a struck corner is held, the default) or unilateral."
HELP_STANDING = (
    "With contact: the cavity stands in the room. Default: it is part of the arm, and thrown with it."
)
HELP_FILE = "Keep finished trials there; the same command goes on with what is left."


def assemble(
    scene: Scene,
    scene2: Annotated[str, typer.Argument(metavar="SCENE2", help=HELP_SECOND)],
    scatter: Annotated[Words, option("--scatter", "Q=DEV", HELP_SCATTER)] = None,
    law: Annotated[
        str, option("--law", "LAW", "Of --scatter: gaussian (standard deviations) or bounded.")
    ] = "gaussian",
    contact: Annotated[str | None, option("--contact", "HOW", HELP_CONTACT)] = None,
    standing: Annotated[bool, typer.Option("--standing", help=HELP_STANDING)] = False,
    trials: Annotated[int, option("--trials", "N", "Pairs thrown from random starts.", min=1)] = 2000,
    seed: Annotated[int, option("--seed", "N", "Of the trials.", min=0)] = 0,
    workers: Annotated[int | None, option("--workers", "N", "Processes that throw.", min=1)] = None,
    cluster: Annotated[str | None, option("--cluster", "ADDRESS", "Of a Dask scheduler, instead.")] = None,
    file: Annotated[Path | None, option("--file", "FILE", HELP_FILE)] = None,
    out: Annotated[Path | None, option("--out -o", "DIR", "Write assembly.json and a figure there.")] = None,
    form: Format = Form.PNG,
    csv: Csv = None,
    json: Json = False,
) -> None:
    """Count how often two parts, thrown together, come to lie in the cavity as they should, and how they fail.

    Exit 0 whatever the rate.
    """
    with progress() as tell:
        chosen, _ = opened(scene, out)
        from limitsets.cell.assembly import assemble as run
        from limitsets.parameters.sheet.summary import scattering_from

        random = deviations("--scatter", scatter)
        assembly = run(
            chosen,
            scene2,
            scattering_from(chosen, random, law) if random else None,
            contact=contact,
            carried=not standing,
            trials=trials,
            seed=seed,
            file=file,
            workers=workers,
            cluster=cluster,
            progress=tell,
        )
        files: list[Path] = []
        if out is not None:
            from limitsets.base.files import as_json
            from limitsets.face import plot
            from limitsets.face.report.writing import laid

            tell("figure", 0, 1)
            figures = [("assembly", plot.assembly(assembly))]
            files = laid(out, figures, lambda _: {"assembly.json": as_json(assembly)}, form)
    answer(assembly.to_json(), json, lambda: _text(assembly, files), csv=(csv, assembly.table))


def _text(assembly: Assembly, files: list[Path]) -> None:
    one, two = assembly.pair.scenes
    how = "the cavity is thrown too" if assembly.series.carried else "the cavity stands"
    meet = (
        "pass through each other"
        if assembly.contact == "none"
        else f"push each other, {assembly.contact}, {how}"
    )
    typer.echo(f"{one.name} below, {two.name} on top: {len(assembly.rows)} trials, the parts {meet}")
    if assembly.misfit is not None:
        typer.echo(
            f"THEY DO NOT FIT: {assembly.misfit}; 'assembled' says only that both were fed rightly, one after the other"
        )
    overlaps, joint = assembly.overlaps, assembly.joint
    if overlaps is not None:
        low, high = overlaps.ever.interval
        typer.echo(
            f"the outlines overlap in {100 * overlaps.ever.share:.1f} % of the trials ({100 * low:.1f} to "
            f"{100 * high:.1f} %), in flight in {100 * overlaps.in_flight.share:.1f} %: of these the rates say nothing"
        )
    show(assembly.table())
    if joint is not None:
        first, second = joint.rates
        typer.echo(f"fed rightly: {first.share:.4f} and {second.share:.4f}; both {joint.both.share:.4f}")
        low, high = joint.error_interval
        typer.echo(
            f"multiplying gives {joint.product:.4f}, off by {joint.error:+.4f} ({low:+.4f} to {high:+.4f})"
        )
        low, high = joint.serial
        typer.echo(f"one part after the other, or two arms: the product, {low:.4f} to {high:.4f}")
    for name, rate in assembly.survived.items():
        low, high = rate.interval
        what = "the cavity standing" if name == "standing" else "the cavity thrown too"
        whole = f"{rate.count} of {rate.of} ({low:.3f} to {high:.3f})"
        typer.echo(f"whole after the next throw, {what}: {whole}")
    first = assembly.first_series
    typer.echo(f"{first.count} assembled in the first {first.of} trials")
    if files:
        typer.echo(f"written: {', '.join(map(str, files))}")


# ----------------------------------------------------------------
# `limitsets tray`: how depressions fill over which parts wash again and again.


HELP_OUT = "Write tray.json and a figure there."
HELP_PARTS = "Let N parts come by at once in each pass, in the engine, that push each other."
HELP_BATCHES = "Keep finished batches of --parts there; the same command goes on with what is left."
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
    file: Annotated[Path | None, option("--file", "FILE", HELP_BATCHES)] = None,
    form: Format = Form.PNG,
    csv: Csv = None,
    out: Annotated[Path | None, option("--out -o", "DIR", HELP_OUT)] = None,
    json: Json = False,
) -> None:
    """Say how a tray's depressions fill: captures and releases counted in the engine, then the chain."""
    with progress() as tell:
        chosen, _ = opened(scene, out)
        from limitsets.cell.trays import tray as run

        filling = run(
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
        record = filling.to_json()
        files = [] if out is None else _written(filling, record, out, form)
    answer(record, json, lambda: _text_of_tray(filling, files), csv=(csv, filling.table))


def _written(filling: TrayFill, record: dict[str, Any], out: Path, form: str) -> list[Path]:
    from limitsets.base.files import as_json
    from limitsets.face import plot
    from limitsets.face.report.writing import laid

    return laid(out, [("tray", plot.tray(filling))], lambda _: {"tray.json": as_json(record)}, form)


def _text_of_tray(filling: TrayFill, files: list[Path]) -> None:
    filled, counts, unit = filling.filled, filling.counts, filling.scene.unit
    sizes, plate = filling.passes.tray, filling.passes.plate
    typer.echo(
        f"{filling.scene.name}: depressions {sizes.depression_width:g} {unit} wide and {sizes.depression_depth:g} "
        f"{unit} deep, side {filling.passes.side} is right; unilateral contact, friction {plate.friction:g}, "
        f"restitution {plate.restitution:g}"
    )
    show(filling.tables()[0])
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
    for each in filling.histories:
        words = "parts that return" if each.returning else "new parts"
        low, high = each.interval(each.filled.size - 1)
        typer.echo(
            f"{len(each.after_pass)} histories with {words}: {each.filled[-1]:.4f} ({low:.4f} to {high:.4f})"
        )
    for at_once in filling.tables()[2:]:
        typer.echo(at_once.caption)
        show(at_once)
    if filling.crowd_chain is not None:
        right, (low, high) = filling.crowd_chain.right[-1], filling.crowd_chain.interval[-1].tolist()
        typer.echo(f"by the chain, of as many parts one by one: right {right:.4f} ({low:.4f} to {high:.4f})")
    if counts.unfinished:
        typer.echo(f"{counts.unfinished} parts did not come to rest; they are left out")
    if files:
        typer.echo(f"written: {', '.join(map(str, files))}")
