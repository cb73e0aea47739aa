"""`limitsets robustness`: a sheet of tolerances, what is proved safe and what fails, and what noise does."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from limitsets.cli.about import About
from limitsets.cli.arguments import HELP_LAID, HELP_NO_RECHECK, deviations, laid_ranges
from limitsets.cli.output import (
    Csv,
    Form,
    Format,
    Html,
    Json,
    Scene,
    Words,
    answer,
    opened,
    option,
    processes,
    progress,
    table,
)

if TYPE_CHECKING:
    from limitsets.robust.sheet.summary import Robustness
    from limitsets.scene import Scene as SceneOf

HELP_QUANTITY = "A quantity, like throw.speed; repeatable. Default: all that the scene gives."
HELP_TOLERANCE = "Of the joint margin, like throw.speed='1 %'; repeatable. Default: the scene's [tolerance]."
HELP_SCATTER = (
    "Noise at every throw, like throw.speed='0.5 %'; repeatable. Default: the scatter in the scene's [world]."
)
HELP_SECONDS = "For the proofs of the joint margin and of the curve; five times as many for the noise."
HELP_WITHOUT = "What not to do: margins, joint, curve, noise or audit; repeatable."


def robustness(
    scene: Scene,
    quantity: Annotated[Words, option("--quantity", "Q", HELP_QUANTITY)] = None,
    reading: Annotated[
        str | None, option("--reading", "R", "fixed (but unknown) or per-throw; default both.")
    ] = None,
    laid: Annotated[Words, option("--laid", "SIDE=LO:HI", HELP_LAID)] = None,
    tolerance: Annotated[Words, option("--tolerance", "Q=DEV", HELP_TOLERANCE)] = None,
    scatter: Annotated[Words, option("--scatter", "Q=DEV", HELP_SCATTER)] = None,
    law: Annotated[
        str, option("--law", "LAW", "Of --scatter: gaussian (standard deviations) or bounded.")
    ] = "gaussian",
    width: Annotated[float, option("--width", "W", "How close brackets have to be, as a share.")] = 0.01,
    cells: Annotated[
        int, option("--cells", "N", "Cells per side, for the noise.", min=8, max=100_000)
    ] = 1024,
    seconds: Annotated[float, option("--seconds", "S", HELP_SECONDS, min=0.0)] = 12.0,
    workers: Annotated[
        int | None, option("--workers", "N", "Processes that search for margins; default: one a core.", min=1)
    ] = None,
    without: Annotated[Words, option("--without", "PART", HELP_WITHOUT)] = None,
    out: Annotated[
        Path | None, option("--out -o", "DIR", "Folder of the report, ./NAME-robustness by default.")
    ] = None,
    html: Html = False,
    form: Format = Form.PNG,
    csv: Csv = None,
    json: Json = False,
    no_recheck: Annotated[bool, typer.Option("--no-recheck", help=HELP_NO_RECHECK)] = False,
) -> None:
    """Say how far each quantity may drift before the goal fails, and write report.md, figures and certificates.

    Exit 1 where the goal is not proved of the scene as it is, or the search for a margin ends with an error.
    """
    with progress() as tell, processes(workers) as pool:
        chosen, folder = opened(scene, out, "robustness")
        from limitsets.report.robust_files import write_robustness
        from limitsets.robust.sheet.noise_input import scattering_from
        from limitsets.robust.sheet.sheet_run import robustness as run

        noise = deviations("--scatter", scatter)
        vector = deviations("--tolerance", tolerance)
        found = run(
            chosen,
            *(quantity or ()),
            laid=laid_ranges(laid),
            reading=reading,
            tolerance=vector or None,
            scatter=scattering_from(chosen, noise, law) if noise else None,
            width=width,
            cells=cells,
            leave_out=without or (),
            seconds=seconds,
            folder=folder,
            recheck=not no_recheck,
            executor=pool,
            progress=tell,
        )
        tell("files", len(found.entries), len(found.entries) + 1)
        files = write_robustness(found, folder, form, html=html)
    about = About(found.model, scene)  # audited by the sheet itself, unless that was left out
    answer(found, json, lambda: _text(chosen, found, files), csv=(csv, found.table), about=about)
    raise typer.Exit(0 if found.verdict == "proved" and not found.failed else 1)


def _text(given: SceneOf, found: Robustness, files: list[Any]) -> None:
    from limitsets.report.goals import without_margin
    from limitsets.report.robust_pages import HEADS, lines_of, none_holds
    from limitsets.report.robust_pages import answer as said

    typer.echo(said(found).replace("**", ""))
    if any(entry.holds for entry in found.singles):
        table(HEADS, lines_of(found))
    elif found.singles:
        typer.echo(none_holds(found))
        typer.echo(f"next: {without_margin(given, found.goals, fails=found.decided == 'refuted')}")
    rests = ("rest of the curve", "rest of the noise")
    for part in dict.fromkeys(("joint", "curve", "noise", *rests, *found.failed)):
        reason = found.left_out.get(part)
        if reason and reason != "it was not asked for":
            typer.echo(f"no {part}: {reason}")
    if found.again:
        typer.echo(f"found by an earlier run: {found.again} of {len(found.entries)} margins")
    typer.echo(f"report: {files[0]}")
