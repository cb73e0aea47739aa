"""`limitsets margin`: how much each quantity may deviate before the goal fails, proved and refuted."""

from __future__ import annotations

import json as json_words
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from limitsets.cli.output import Json, Scene, progress, table
from limitsets.errors import LimitsetsError

if TYPE_CHECKING:
    from limitsets.robust.margins.finding import Margin

__all__ = ["margin"]

HEADS = ("quantity", "reading", "proved safe up to", "shown to fail from")
READINGS = {"fixed": "fixed, unknown", "per-throw": "at every throw", "tolerance": "of the tolerance"}


def margin(
    scene: Scene,
    quantity: Annotated[
        list[str] | None,
        typer.Argument(metavar="[QUANTITY]...", help='Like throw.speed, or "joint"; default: all there are.'),
    ] = None,
    reading: Annotated[
        str | None, typer.Option("--reading", metavar="R", help="fixed (but unknown) or per-throw.")
    ] = None,
    x: Annotated[str | None, typer.Option("--x", metavar="X", help="Ask the goal at another X.")] = None,
    width: Annotated[
        float, typer.Option("--width", metavar="W", help="How close the two ends have to be, as a share.")
    ] = 0.01,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="DIR", help="Write margins.json, certificates, orbits, a figure."
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Bracket how much each quantity may deviate before the goal fails: proved below, refuted above."""
    with progress() as tell:
        from limitsets.robust.margins.finding import margin as run
        from limitsets.scene import load

        chosen = load(scene)
        goal = None if x is None else _goal_at(chosen, x)
        if out is not None:
            from limitsets.report.writing import require_place

            require_place(out)
        found = run(chosen, *(quantity or ()), reading=reading, goal=goal, width=width, progress=tell)
        records = [each.to_json() for each in found]
        if out is not None:
            tell("files", len(found), len(found) + 1)
            _write(found, records, out)
    if json:
        print(json_words.dumps(records, indent=2, allow_nan=False))
    else:
        _text(found, out)
    raise typer.Exit(
        0 if all(each.proved > 0 and (each.closed or each.refuted is None) for each in found) else 1
    )


def _goal_at(scene: Any, text: str) -> Any:
    """Ask the scene's goal at another X: a number in the scene's unit, or text with a unit."""
    from dataclasses import replace

    from limitsets.goals import OrientedBeyond, Reaches
    from limitsets.scene.units import convert, parse

    if not isinstance(scene.goal, OrientedBeyond | Reaches):
        kind = None if scene.goal is None else scene.goal.kind
        raise LimitsetsError("the goal", kind, "one that has an x", "leave --x out", key="--x")
    try:
        place = float(text)
    except ValueError:
        place = convert(parse(text, "length", key="--x"), scene.unit)
    if not 0 <= place < scene.arm_length:
        allowed = f"from 0 to below the arm's length, {scene.arm_length:.9g} {scene.unit}"
        raise LimitsetsError("the position", text, allowed, "correct it", key="--x")
    return replace(scene.goal, x=place)


def _write(found: tuple[Margin, ...], records: list[dict[str, Any]], out: Path) -> None:
    from limitsets.errors import AnswerError
    from limitsets.files import replaced
    from limitsets.plot.margins import tornado

    for each, record in zip(found, records, strict=True):
        try:
            record["certificate"] = [path.name for path in each.save(out)] or None
        except AnswerError:  # effects: nothing rechecks them, the margin stands
            record["certificate"] = None
    with replaced(out) as draft:
        (draft / "margins.json").write_text(
            json_words.dumps(records, indent=2, allow_nan=False) + "\n", encoding="utf-8"
        )
        tornado(found).savefig(draft / "margins.png")


def _text(found: tuple[Margin, ...], out: Path | None) -> None:
    from limitsets.robust.margins.words import bound

    rows = []
    for each in found:
        unit = each.unit or "times"
        low, high = bound(each.proved, unit), bound(each.refuted, unit, up=True)
        rows.append([each.quantity, READINGS[each.reading], low, high])
    typer.echo(
        f"{found[0].scene.name}: {' and '.join(_words(goal, found[0].scene.unit) for goal in found[0].goals)}"
    )
    table(HEADS, rows)
    for each in found:
        if each.reason:
            typer.echo(f"{each.quantity}: {each.reason}")
    if out is not None:
        typer.echo(
            f"written to {out}: margins.json, margins.png, certificates (check them: limitsets recheck FILE)"
        )


def _words(goal: Any, unit: str) -> str:
    where = "from anywhere on the arm" if goal.from_anywhere else "in the limit set"
    if goal.kind == "oriented_beyond":
        return f"beyond x = {goal.x:g} {unit} only side {goal.side}, {where}"
    if goal.kind == "reaches":
        who = "every orbit" if goal.every_orbit else "almost every orbit"
        return f"{who} reaches x = {goal.x:g} {unit} on side {goal.side}"
    return f"{goal.kind.replace('_', ' ')}, {where}"
