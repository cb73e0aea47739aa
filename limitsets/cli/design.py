"""`limitsets design`: quantities of a scene for which its critical points are as wanted, or the margin large."""

from __future__ import annotations

import json as json_words
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from limitsets.cli.output import Json, Scene, progress, saved, table
from limitsets.errors import LimitsetsError

if TYPE_CHECKING:
    from collections.abc import Callable

    from limitsets.inverse import Design

__all__ = ["design"]

DPI = 150
FREE = "free"
_BARE = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?")

HELP_POINTS = "First critical point wanted on each side, like 10,10,20 or '25 cm',free,free."
HELP_ROBUST = (
    "Make the proved joint margin of [tolerance] large: only one side beyond X, and almost every orbit there."
)
HELP_VARY = "Quantities to vary, like part.mass.center.along,throw.speed; repeatable."
HELP_EVALUATIONS = "With --robust: designs to look at."
HELP_BOUNDS = (
    "Bounds of one of them, like part.mass.center.along='4 in':'5 in'; either may be left out; repeatable."
)


def design(
    scene: Scene,
    critical_points: Annotated[
        str | None, typer.Option("--critical-points", metavar="R,R,R", help=HELP_POINTS)
    ] = None,
    robust: Annotated[bool, typer.Option("--robust", help=HELP_ROBUST)] = False,
    vary: Annotated[list[str] | None, typer.Option("--vary", metavar="Q,Q", help=HELP_VARY)] = None,
    bounds: Annotated[list[str] | None, typer.Option("--bounds", metavar="Q=LO:HI", help=HELP_BOUNDS)] = None,
    evaluations: Annotated[
        int, typer.Option("--evaluations", min=1, max=1_000_000, metavar="N", help=HELP_EVALUATIONS)
    ] = 1200,
    seconds: Annotated[
        float,
        typer.Option("--seconds", min=0.0, metavar="S", help="With --robust: for the proof of each margin."),
    ] = 240.0,
    starts: Annotated[
        int, typer.Option("--starts", min=0, max=10_000, metavar="N", help="Other starts to draw at most.")
    ] = 8,
    stages: Annotated[
        int | None,
        typer.Option(
            "--stages", min=1, max=1000, metavar="N", help="Move the targets in N steps, all of them shown."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help="NAME.toml for the scene; else a folder: scene, JSON and figure.",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Find a scene whose critical points are where they are wanted, or that is fed in spite of large deviations.

    Exit 1 where none is found, or no margin is proved.
    """
    if (critical_points is None) != robust:
        raise LimitsetsError(
            "the design",
            "nothing is wanted" if critical_points is None else "two things are wanted",
            "--critical-points R,R,R or --robust",
            "give one of them",
        )
    names = [name.strip() for words in vary or [] for name in words.split(",")]
    if critical_points is None:
        from limitsets.cli.design_robust import run_robust

        raise typer.Exit(
            run_robust(scene, names, _bounds(bounds or []), evaluations, seconds, out, json=json)
        )
    with progress() as tell:
        from limitsets.inverse import design as run
        from limitsets.scene import load

        chosen = load(scene)
        if out is not None and out.suffix != ".toml":
            from limitsets.report.writing import require_place

            require_place(out)
        found = run(
            chosen,
            critical_points=_points(critical_points),
            vary=names,
            bounds=_bounds(bounds or []),
            starts=starts,
            stages=stages,
            progress=tell,
        )
        files = [] if out is None else _written(found, out, tell)
    if json:
        print(json_words.dumps(found.to_json(), indent=2, allow_nan=False))
    else:
        _text(found, files)
    raise typer.Exit(0 if found.reached else 1)


def _points(words: str) -> list[float | str | None]:
    return [None if word.strip() == FREE else _number(word) for word in words.split(",")]


def _number(word: str) -> float | str:
    """Read a bare number in the scene's unit; text with a unit is read further on."""
    return float(word) if _BARE.fullmatch(word.strip()) else word.strip()


def _bounds(words: list[str]) -> dict[str, tuple[float | str | None, float | str | None]]:
    found: dict[str, tuple[float | str | None, float | str | None]] = {}
    for word in words:
        name, sign, text = word.partition("=")
        lo, colon, hi = text.partition(":")
        if not (sign and colon) or name.strip() in found:
            remedy = (
                "name each quantity once"
                if sign and colon
                else "put = after the quantity, : between the bounds"
            )
            raise LimitsetsError("the bounds", word, "QUANTITY=LOWEST:HIGHEST", remedy, key="--bounds")
        ends = [_number(end.strip("'\" ")) if end.strip("'\" ") else None for end in (lo, hi)]
        found[name.strip()] = (ends[0], ends[1])
    return found


def _written(found: Design, out: Path, tell: Callable[[str, int, int], None]) -> list[Path]:
    """Write the scene, or a folder with the scene, the answer as JSON and the figure of the way there."""
    from limitsets.files import replaced
    from limitsets.report.writing import refusal
    from limitsets.scene import dump

    text = dump(found.scene)
    if out.suffix == ".toml":
        with saved(out) as draft:
            draft.write_text(text, encoding="utf-8", newline="\n")
        return [out]
    from limitsets import plot
    from limitsets.inverse import limit_sets_along

    drawn = plot.design(found, limit_sets_along(found, tell))
    names = [f"{found.scene.name}.toml", "design.json", "design.png"]
    try:
        with replaced(out) as folder:
            (folder / names[0]).write_text(text, encoding="utf-8", newline="\n")
            record = json_words.dumps(found.to_json(), indent=2, allow_nan=False)
            (folder / names[1]).write_text(record + "\n", encoding="utf-8", newline="\n")
            drawn.savefig(folder / names[2], dpi=DPI)
    except OSError as error:
        raise refusal(out, error.strerror or str(error)) from None
    return [out / name for name in names]


def _text(found: Design, files: list[Path]) -> None:
    """Print what changed, how well it is reached, and the scene."""
    from limitsets.scene import dump

    unit = found.start.unit
    rows = [
        [name, f"{before:.9g}", f"{after:.9g}", unit_of]
        for name, (before, after, unit_of) in found.quantities().items()
    ]
    points = zip(
        found.before.x.tolist(), found.jacobian.x.tolist(), found.targets, found.residual, strict=True
    )
    for side, (before, after, target, miss) in enumerate(points):
        wanted = "free" if target is None else f"wanted {target:.9g}"
        missed = "" if miss is None else f", off by {miss:.1e}"
        rows.append([f"r_{side}", f"{before:.9g}", f"{after:.9g}", f"{unit} ({wanted}{missed})"])
    table(["", "before", "after", "unit"], rows)
    typer.echo(found.message[:1].upper() + found.message[1:] + ".")
    condition = "not known" if found.condition is None else f"{found.condition:.4g}"
    typer.echo(
        f"{found.evaluations} evaluations, {found.how}; condition number of the derivatives: {condition}"
    )
    for side, reason in enumerate(found.jacobian.reasons):
        if reason is not None:
            typer.echo(f"no derivative on side {side}: {reason}")
    if files:
        typer.echo(f"scene: {files[0]}")
    else:
        typer.echo("")
        typer.echo(dump(found.scene).rstrip("\n"))
