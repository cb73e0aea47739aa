"""`limitsets animate`: a film of throws, of feeding, of feedback, or of an orbit that violates the goal."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from limitsets.cli.arguments import position
from limitsets.cli.output import Json, Scene, answer, option, progress
from limitsets.errors import LimitsetsError

__all__ = ["animate"]

HELP_START = "x and side of the start: 15,2 or '38 cm,2'; default a good one, on the limit set."


def animate(
    scene: Scene,
    out: Annotated[
        Path | None,
        option("--out -o", "FILE", "A name that ends in .html, .gif or .mp4; ./NAME.html by default."),
    ] = None,
    start: Annotated[str | None, option("--start", "X,SIDE", HELP_START)] = None,
    throws: Annotated[
        int | None,
        option(
            "--throws", "N", "How many throws at most; default 8, and all of --feed and --feedback.", min=1
        ),
    ] = None,
    feed: Annotated[
        bool, typer.Option("--feed", help="Throw until the part falls into the scene's [cavity].")
    ] = False,
    feedback: Annotated[
        bool, typer.Option("--feedback", help="Find a policy for the scene's [feedback], and throw by it.")
    ] = False,
    margin: Annotated[
        str | None,
        option("--margin", "QUANTITY", "Show the orbit that violates the goal, at its margin of QUANTITY."),
    ] = None,
    reading: Annotated[str | None, option("--reading", "R", "Of the margin: fixed or per-throw.")] = None,
    fps: Annotated[float, option("--fps", "N", "Frames per second.")] = 20.0,
    slow: Annotated[float, option("--slow", "N", "How many times slower than the machine.")] = 3.0,
    json: Json = False,
) -> None:
    """Write a film: the arm swings up and stops, the part flies and lands, and where that is on the limit set."""
    if feed + feedback + (margin is not None) > 1:
        value = "more than one of --feed, --feedback, --margin"
        raise LimitsetsError("what to show", value, "one of them", "make a film of each")
    if reading is not None and margin is None:
        raise LimitsetsError("the reading", reading, "with --margin", "name the quantity", key="--reading")
    with progress() as tell:
        from limitsets.animation import animate as write
        from limitsets.animation import require_file
        from limitsets.scene import load

        chosen = load(scene)
        file = Path(f"{chosen.name}.html") if out is None else out
        require_file(file)  # before anything is searched or proved
        begin = None if start is None else _start(chosen, start)
        if margin is not None and begin is not None:
            raise LimitsetsError(
                "the start", start, "none with --margin: its orbit has its own", "leave it out"
            )
        shown = _shown(chosen, tell, feed=feed, feedback=feedback, margin=margin, reading=reading)
        write(shown, file, start=begin, throws=throws, fps=fps, slow=slow, progress=tell)
    size = file.stat().st_size
    answer(
        {"film": str(file), "bytes": size}, json, lambda: typer.echo(f"film: {file} ({size / 1e6:.2g} MB)")
    )


def _start(scene: Any, text: str) -> tuple[float, int]:
    x, comma, side = text.rpartition(",")
    if not comma or not side.strip().isdigit():
        raise LimitsetsError("the start", text, "X,SIDE, as in 15,2", "name both", key="--start")
    return position(scene, x), int(side)


def _shown(
    scene: Any, tell: Any, *, feed: bool, feedback: bool, margin: str | None, reading: str | None
) -> Any:
    if feed:
        from limitsets.feeding.falling import arm_end_of

        return arm_end_of(scene)
    if feedback:
        from limitsets.policies import feedback as find

        return find(scene, progress=tell)
    if margin is not None:
        from limitsets.robust import margin as bracket

        (found,) = bracket(scene, margin, reading=reading, progress=tell)
        return found
    return scene
