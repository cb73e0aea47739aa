"""`limitsets animate`: a film of throws, of feeding, of feedback, or of an orbit that violates the goal."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from limitsets.base.errors import LimitsetsError
from limitsets.face.cli.arguments import place
from limitsets.face.cli.output import Json, Scene, answer, option, progress, stem_of

# Pairs thrown to find one that is assembled; drops counted for a tray, of which the film shows only the passes.
PAIRS, FEW = 40, 20
HELP_START = "x and side of the start: 15,2 or '38 cm,2'; default a good one, on the limit set."


def animate(
    scene: Scene,
    out: Annotated[
        Path | None,
        option("--out -o", "FILE", "A name that ends in .html or .gif; ./NAME.html by default."),
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
    assemble: Annotated[
        str | None,
        option("--assemble", "SCENE2", "Throw the part together with another; both scenes in contact."),
    ] = None,
    standing: Annotated[
        bool, typer.Option("--standing", help="With --assemble: the cavity stands, it is not thrown.")
    ] = False,
    tray: Annotated[bool, typer.Option("--tray", help="Show a depression of the scene's [tray].")] = False,
    parts: Annotated[
        int | None, option("--parts", "N", "With --tray: N parts a pass that push each other.", min=1, max=50)
    ] = None,
    reading: Annotated[str | None, option("--reading", "R", "Of the margin: fixed or per-throw.")] = None,
    fps: Annotated[float, option("--fps", "N", "Frames per second.")] = 20.0,
    slow: Annotated[float, option("--slow", "N", "How many times slower than the machine.")] = 3.0,
    json: Json = False,
) -> None:
    """Write a film: the arm swings up and stops, the part flies and lands, and where that is on the limit set."""
    if feed + feedback + tray + (margin is not None) + (assemble is not None) > 1:
        value = "more than one of --feed, --feedback, --margin, --assemble, --tray"
        raise LimitsetsError("what to show", value, "one of them", "make a film of each")
    if reading is not None and margin is None:
        raise LimitsetsError("the reading", reading, "with --margin", "name the quantity", key="--reading")
    if parts is not None and not tray:
        raise LimitsetsError("the parts", parts, "with --tray", "ask for a tray", key="--parts")
    if standing and assemble is None:
        raise LimitsetsError(
            "the cavity", "standing", "with --assemble", "name the other part", key="--standing"
        )
    with progress() as tell:
        from limitsets.face.animation import animate as write
        from limitsets.face.animation import require_file
        from limitsets.feeder.scene import load

        chosen = load(scene)
        file = Path(f"{stem_of(chosen)}.html") if out is None else out
        require_file(file)  # before anything is searched or proved
        begin = None if start is None else _start(chosen, start)
        if begin is not None and (tray or margin is not None or assemble is not None):
            allowed = "none with --margin, --assemble and --tray, which have their own"
            raise LimitsetsError("the start", start, allowed, "leave it out")
        asked: dict[str, Any] = {
            "feed": feed,
            "feedback": feedback,
            "tray": tray,
            "margin": margin,
            "assemble": assemble,
            "standing": standing,
        }
        shown = _shown(chosen, tell, reading=reading, parts=parts, **asked)
        write(shown, file, start=begin, throws=throws, fps=fps, slow=slow, progress=tell)
    size = file.stat().st_size
    answer(
        {"film": str(file), "bytes": size}, json, lambda: typer.echo(f"film: {file} ({size / 1e6:.2g} MB)")
    )


def _start(scene: Any, text: str) -> tuple[float, int]:
    x, comma, side = text.rpartition(",")
    if not comma or not side.strip().isdigit():
        raise LimitsetsError("the start", text, "X,SIDE, as in 15,2", "name both", key="--start")
    return place(scene, x, "--start"), int(side)


def _shown(
    scene: Any,
    tell: Any,
    *,
    feed: bool,
    feedback: bool,
    tray: bool,
    margin: str | None,
    assemble: str | None,
    standing: bool,
    reading: str | None,
    parts: int | None,
) -> Any:
    """Compute the answer that is to be shown, as far as a film needs it."""
    if feed:
        from limitsets.cell.feeding.falling import arm_end_of

        return arm_end_of(scene)
    if feedback:
        from limitsets.proofs.policies import feedback as find

        return find(scene, progress=tell)
    if tray:
        from limitsets.cell.trays import tray as fill

        return fill(scene, passes=1, drops=FEW, kicks=FEW, parts=parts, batches=1, progress=tell)
    if assemble is not None:
        from limitsets.cell.assembly import assemble as pairs

        return pairs(scene, assemble, carried=not standing, trials=PAIRS, progress=tell)
    if margin is not None:
        from limitsets.parameters.margins.single import margin as bracket

        (found,) = bracket(scene, margin, reading=reading, progress=tell)
        return found
    return scene
