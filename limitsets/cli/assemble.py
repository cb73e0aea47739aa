"""`limitsets assemble`: pairs of parts thrown along one arm into a cavity, and what becomes of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from limitsets.cli.arguments import deviations
from limitsets.cli.output import Csv, Form, Format, Json, Scene, Words, answer, opened, option, progress, show

if TYPE_CHECKING:
    from limitsets.assembly import Assembly

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
        from limitsets.assembly import assemble as run
        from limitsets.robust.sheet.noise_input import scattering_from

        random = deviations("--scatter", scatter)
        found = run(
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
            from limitsets import plot
            from limitsets.files import as_json
            from limitsets.report.writing import laid

            tell("figure", 0, 1)
            figures = [("assembly", plot.assembly(found))]
            files = laid(out, figures, lambda _: {"assembly.json": as_json(found)}, form)
    answer(found.to_json(), json, lambda: _text(found, files), csv=(csv, found.table))


def _text(found: Assembly, files: list[Path]) -> None:
    one, two = found.pair.scenes
    how = "the cavity is thrown too" if found.series.carried else "the cavity stands"
    meet = (
        "pass through each other" if found.contact == "none" else f"push each other, {found.contact}, {how}"
    )
    typer.echo(f"{one.name} below, {two.name} on top: {len(found.rows)} trials, the parts {meet}")
    if found.misfit is not None:
        typer.echo(
            f"THEY DO NOT FIT: {found.misfit}; 'assembled' says only that both were fed rightly, one after the other"
        )
    overlaps, joint = found.overlaps, found.joint
    if overlaps is not None:
        low, high = overlaps.ever.interval
        typer.echo(
            f"the outlines overlap in {100 * overlaps.ever.share:.1f} % of the trials ({100 * low:.1f} to "
            f"{100 * high:.1f} %), in flight in {100 * overlaps.in_flight.share:.1f} %: of these the rates say nothing"
        )
    show(found.table())
    if joint is not None:
        first, second = joint.rates
        typer.echo(f"fed rightly: {first.share:.4f} and {second.share:.4f}; both {joint.both.share:.4f}")
        low, high = joint.error_interval
        typer.echo(
            f"multiplying gives {joint.product:.4f}, off by {joint.error:+.4f} ({low:+.4f} to {high:+.4f})"
        )
        low, high = joint.serial
        typer.echo(f"one part after the other, or two arms: the product, {low:.4f} to {high:.4f}")
    for name, rate in found.survived.items():
        low, high = rate.interval
        what = "the cavity standing" if name == "standing" else "the cavity thrown too"
        whole = f"{rate.count} of {rate.of} ({low:.3f} to {high:.3f})"
        typer.echo(f"whole after the next throw, {what}: {whole}")
    first = found.first_series
    typer.echo(f"{first.count} assembled in the first {first.of} trials")
    if files:
        typer.echo(f"written: {', '.join(map(str, files))}")
