"""`limitsets margin`: how much each quantity may deviate before the goal fails, proved and refuted."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from limitsets.cli.about import About
from limitsets.cli.arguments import HELP_LAID, HELP_NO_RECHECK, laid_ranges, place
from limitsets.cli.output import (
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
    table,
)
from limitsets.errors import LimitsetsError
from limitsets.files import as_json
from limitsets.tables import joined

if TYPE_CHECKING:
    from limitsets.robust.margins.margin_result import Margin
    from limitsets.scene import Scene as SceneOf

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
        from limitsets.robust.margins.finding import margin as run

        begins = laid_ranges(laid)
        chosen, _ = opened(scene, out)
        goal = None if x is None else _goal_at(chosen, x)
        found = run(
            chosen, *(quantity or ()), reading=reading, goal=goal, laid=begins, width=width, progress=tell
        )
        records = [each.to_json() for each in found]
        about = About(found[0].model, scene, chosen)
        if out is not None:
            tell("files", len(found), len(found) + 1)
            found, records = _write(found, out, form, about, recheck=not no_recheck)
    answer(
        records,
        json,
        lambda: _text(chosen, found, out, no_recheck=no_recheck),
        csv=(csv, lambda: joined(found)),
        about=about,
    )
    bracketed = all(each.proved > 0 and (each.closed or each.refuted is None) for each in found)
    raise typer.Exit(0 if bracketed and chosen.effects.spread is None else 1)


def _goal_at(scene: Any, text: str) -> Any:
    """Ask the scene's goal at another X: a number in the scene's unit, or text with a unit."""
    from dataclasses import replace

    from limitsets.goals import OrientedBeyond, Reaches

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
) -> tuple[tuple[Margin, ...], list[dict[str, Any]]]:
    """Write the files; the margins and their JSON without what the checker denies."""
    from limitsets.errors import AnswerError
    from limitsets.plot.margins import tolerance_box, tornado
    from limitsets.plot.parts import part
    from limitsets.report.writing import laid
    from limitsets.robust.margins.margin_result import settled

    found, records = [], []
    for each in given:
        try:
            left, paths = settled(each, out, recheck=recheck)
        except AnswerError:  # effects: nothing rechecks them, the margin stands
            left, paths = each, ()
        found.append(left)
        records.append(left.to_json() | {"certificate": [path.name for path in paths] or None})
    single = [each for each in found if each.reading != "tolerance"]
    drawn = [("part", part(given[0].scene))]
    drawn += [("margins", tornado(single))] if single else []
    drawn += [("joint", tolerance_box(each)) for each in found if each.reading == "tolerance"]
    laid(out, drawn, lambda _: {"margins.json": as_json(about.added(records))}, form)
    return tuple(found), records


def _text(given: SceneOf, found: tuple[Margin, ...], out: Path | None, *, no_recheck: bool) -> None:
    from limitsets.report.goals import goal_sentence, without_margin
    from limitsets.report.robust_pages import READINGS
    from limitsets.robust.margins.margin_texts import bound, failing, reach_of, void_of
    from limitsets.scene.left_out import WITHOUT_SCATTER

    rows = []
    for each in found:
        unit = each.unit or "times"
        low, high = bound(each.proved, unit), failing(each.refuted, unit, each.direction)
        rows.append([each.quantity, READINGS[each.reading], low, high])
    scene = found[0].scene
    whose = f"{scene.name}: {WITHOUT_SCATTER}, " if given.effects.spread else f"{scene.name}: "
    typer.echo(whose + " and ".join(goal_sentence(goal, scene.unit) for goal in found[0].goals))
    if len(found) == 1 or any(each.proved > 0.0 or each.refuted for each in found):
        table(HEADS, rows)
    else:
        typer.echo(f"{len(found)} margins, all of them 0: {found[0].reason}")
        fails = any(each.refuted == 0.0 for each in found)
        typer.echo(f"next: {without_margin(given, found[0].goals, fails=fails)}")
        found = ()
    for each in found:
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
