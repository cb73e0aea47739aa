"""`limitsets margin` and `robustness`: how much quantities may deviate, and the sheet of all tolerances."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from limitsets.base.errors import LimitsetsError
from limitsets.base.files import as_json
from limitsets.base.tables import joined
from limitsets.face.cli.about import About
from limitsets.face.cli.arguments import HELP_LAID, HELP_NO_RECHECK, deviations, laid_ranges, place
from limitsets.face.cli.output import (
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
    from limitsets.feeder.scene import Scene as SceneOf
    from limitsets.parameters.margins.margin_result import Margin
    from limitsets.parameters.sheet.summary import Robustness


HEADS = ("quantity", "reading", "proved safe up to", "shown to fail from")


def margin(
    scene: Scene,
    quantity: Annotated[
        list[str] | None,
        typer.Argument(metavar="QUANTITY", help='Like throw.speed, or "joint"; default: all there are.'),
    ] = None,
    reading: Annotated[str | None, option("--reading", "R", "fixed (but unknown) or per-throw.")] = None,
    x: Annotated[str | None, option("--x", "X", "Ask the goal at another X: 20, or '50 cm'.")] = None,
    laid: Annotated[Words, option("--laid", "SIDE=LO:HI", HELP_LAID)] = None,
    width: Annotated[float, option("--width", "W", "How close the two ends have to be, as a share.")] = 0.01,
    out: Annotated[
        Path | None, option("--out -o", "DIR", "Write margins.json, certificates, orbits, a figure.")
    ] = None,
    form: Format = Form.PNG,
    csv: Csv = None,
    json: Json = False,
    no_recheck: Annotated[bool, typer.Option("--no-recheck", help=HELP_NO_RECHECK)] = False,
) -> None:
    """Bracket how much each quantity may deviate before the goal fails: proved below, refuted above.

    Exit 1 where nothing is proved of one of them, its two ends are farther apart than asked, or the scene scatters its
    throws: margins are those of the scene without its scatter.
    """
    with progress() as tell:
        from limitsets.parameters.margins.single import margin as run

        begins = laid_ranges(laid)
        chosen, _ = opened(scene, out)
        goal = None if x is None else _goal_at(chosen, x)
        margins = run(
            chosen, *(quantity or ()), reading=reading, goal=goal, laid=begins, width=width, progress=tell
        )
        about = About(margins[0].model, scene, chosen)
        if out is not None:
            tell("files", len(margins), len(margins) + 1)
            margins = _write(margins, out, form, about, recheck=not no_recheck)
    answer(
        margins,
        json,
        lambda: _text(chosen, margins, out, no_recheck=no_recheck),
        csv=(csv, lambda: joined(margins)),
        about=about,
    )
    bracketed = all(each.proved > 0 and (each.closed or each.refuted is None) for each in margins)
    raise typer.Exit(0 if bracketed and chosen.effects.spread is None else 1)


def _goal_at(scene: Any, text: str) -> Any:
    """Ask the scene's goal at another X: a number in the scene's unit, or text with a unit."""
    from dataclasses import replace

    from limitsets.feeder.goals import OrientedBeyond, Reaches

    if not isinstance(scene.goal, OrientedBeyond | Reaches):
        kind = None if scene.goal is None else scene.goal.kind
        raise LimitsetsError("the goal", kind, "one that has an x", "leave --x out", key="--x")
    x = place(scene, text)
    if not 0 <= x < scene.arm_length:
        allowed = f"from 0 to below the arm's length, {scene.arm_length:.9g} {scene.unit}"
        raise LimitsetsError("the position", text, allowed, "correct it", key="--x")
    return replace(scene.goal, x=x)


def _write(
    given: tuple[Margin, ...], out: Path, form: str, about: About, *, recheck: bool
) -> tuple[Margin, ...]:
    """Write the files; return the margins without the claims that the checker denies."""
    from limitsets.face.plot.margins import tolerance_box, tornado
    from limitsets.face.plot.parts import part
    from limitsets.face.report.writing import laid
    from limitsets.parameters.margins.margin_result import settled

    margins = tuple(settled(each, out, recheck=recheck) for each in given)
    single = [each for each in margins if each.reading != "tolerance"]
    drawn = [("part", part(given[0].scene))]
    drawn += [("margins", tornado(single))] if single else []
    drawn += [("joint", tolerance_box(each)) for each in margins if each.reading == "tolerance"]
    laid(out, drawn, lambda _: {"margins.json": as_json(about.added(margins))}, form)
    return margins


def _text(given: SceneOf, margins: tuple[Margin, ...], out: Path | None, *, no_recheck: bool) -> None:
    from limitsets.face.report.pages import goal_sentence, without_margin
    from limitsets.face.report.robust_pages import READINGS
    from limitsets.feeder.scene.left_out import WITHOUT_SCATTER
    from limitsets.parameters.margins.margin_result import bound, failing, reach_of, void_of

    rows = []
    for each in margins:
        unit = each.unit or "times"
        low, high = bound(each.proved, unit), failing(each.refuted, unit, each.direction)
        rows.append([each.quantity, READINGS[each.reading], low, high])
    scene = margins[0].scene
    whose = f"{scene.name}: {WITHOUT_SCATTER}, " if given.effects.spread else f"{scene.name}: "
    typer.echo(whose + " and ".join(goal_sentence(goal, scene.unit) for goal in margins[0].goals))
    if len(margins) == 1 or any(each.proved > 0.0 or each.refuted for each in margins):
        table(HEADS, rows)
    else:
        typer.echo(f"{len(margins)} margins, all of them 0: {margins[0].reason}")
        fails = any(each.refuted == 0.0 for each in margins)
        typer.echo(f"next: {without_margin(given, margins[0].goals, fails=fails)}")
        margins = ()
    for each in margins:
        void = void_of(each.goals, reach_of(each.pieces), scene.unit)
        if void:
            typer.echo(f"{each.quantity}: what is proved holds vacuously, {void}")
        if each.reason:
            typer.echo(f"{each.quantity}: {each.reason}")
    if out is not None:
        typer.echo(
            f"written to {out}: margins.json, figures, certificates"
            f" ({'not rechecked' if no_recheck else 'rechecked'}; again: limitsets recheck FILE)"
        )


# ----------------------------------------------------------------
# `limitsets robustness`: a sheet of tolerances, what is proved safe and what fails, and what noise does.


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
        from limitsets.face.report.robust_pages import write_robustness
        from limitsets.parameters.sheet.sheet_run import robustness as run
        from limitsets.parameters.sheet.summary import scattering_from

        noise = deviations("--scatter", scatter)
        vector = deviations("--tolerance", tolerance)
        sheet = run(
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
        tell("files", len(sheet.entries), len(sheet.entries) + 1)
        files = write_robustness(sheet, folder, form, html=html)
    about = About(sheet.model, scene)  # audited by the sheet itself, unless that was left out
    answer(sheet, json, lambda: _text_of_sheet(chosen, sheet, files), csv=(csv, sheet.table), about=about)
    raise typer.Exit(0 if sheet.verdict == "proved" and not sheet.failed else 1)


def _text_of_sheet(given: SceneOf, sheet: Robustness, files: list[Any]) -> None:
    from limitsets.face.report.pages import without_margin
    from limitsets.face.report.robust_pages import HEADS, lines_of, none_holds
    from limitsets.face.report.robust_pages import answer as said

    typer.echo(said(sheet).replace("**", ""))
    if any(entry.holds for entry in sheet.singles):
        table(HEADS, lines_of(sheet))
    elif sheet.singles:
        typer.echo(none_holds(sheet))
        typer.echo(f"next: {without_margin(given, sheet.goals, fails=sheet.decided == 'refuted')}")
    rests = ("rest of the curve", "rest of the noise")
    for part in dict.fromkeys(("joint", "curve", "noise", *rests, *sheet.failed)):
        reason = sheet.left_out.get(part)
        if reason and reason != "it was not asked for":
            typer.echo(f"no {part}: {reason}")
    typer.echo(f"report: {files[0]}")
