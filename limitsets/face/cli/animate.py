"""`limitsets animate`: a film of throws, of feeding, of feedback, or of an orbit that violates the goal."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.face.cli.arguments import place
from limitsets.face.cli.commands import Answer, Run, Scene, command, limits
from limitsets.face.cli.output import stem_of

# Pairs thrown to find one that is assembled; drops counted for a tray, of which the film shows only the passes.
PAIRS, FEW = 40, 20


@command(csv=False)
def animate(
    run: Run,
    scene: Scene,
    *,
    start: str | None = None,
    throws: Annotated[int | None, limits(min=1)] = None,
    feed: bool = False,
    feedback: bool = False,
    margin: str | None = None,
    assemble: str | None = None,
    standing: bool = False,
    tray: bool = False,
    parts: Annotated[int | None, limits(min=1, max=50)] = None,
    reading: str | None = None,
    fps: float = 20.0,
    slow: float = 3.0,
) -> Answer:
    """Write a film: the arm swings up and stops, the part flies and lands, and where that is on the limit set.

    Parameters
    ----------
    start : X,SIDE
        x and side of the start: 15,2 or '38 cm,2'; default a good one, on the limit set.
    throws : N
        How many throws at most; default 8, and all of --feed and --feedback.
    feed
        Throw until the part falls into the scene's [cavity].
    feedback
        Find a policy for the scene's [feedback], and throw by it.
    margin : QUANTITY
        Show the orbit that violates the goal, at its margin of QUANTITY.
    assemble : SCENE2
        Throw the part together with another; both scenes in contact.
    standing
        With --assemble: the cavity stands, it is not thrown.
    tray
        Show a depression of the scene's [tray].
    parts : N
        With --tray: N parts a pass that push each other.
    reading : R
        Of the margin: fixed or per-throw.
    fps : N
        Frames per second.
    slow : N
        How many times slower than the machine.
    out : FILE
        A name that ends in .html or .gif; ./NAME.html by default.
    """
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
    from limitsets.cell.feeding.falling import arm_end_of
    from limitsets.face.animation import require_file

    chosen = ls.load(scene)
    file = run.out or Path(f"{stem_of(chosen)}.html")
    require_file(file)  # before anything is searched or proved
    begin = None if start is None else _start(chosen, start)
    if begin is not None and (tray or margin is not None or assemble is not None):
        allowed = "none with --margin, --assemble and --tray, which have their own"
        raise LimitsetsError("the start", start, allowed, "leave it out")
    shown: Any = chosen  # or the answer that is to be shown, as far as a film needs it
    if feed:
        shown = arm_end_of(chosen)
    elif feedback:
        shown = ls.feedback(chosen, progress=run.tell)
    elif tray:
        shown = ls.tray(chosen, passes=1, drops=FEW, kicks=FEW, parts=parts, batches=1, progress=run.tell)
    elif assemble is not None:
        shown = ls.assemble(chosen, assemble, carried=not standing, trials=PAIRS, progress=run.tell)
    elif margin is not None:
        (shown,) = ls.margin(chosen, margin, reading=reading, progress=run.tell)
    ls.animate(shown, file, start=begin, throws=throws, fps=fps, slow=slow, progress=run.tell)
    size = file.stat().st_size
    return Answer({"film": str(file), "bytes": size}, lambda: [f"film: {file} ({size / 1e6:.2g} MB)"])


def _start(scene: Any, text: str) -> tuple[float, int]:
    x, comma, side = text.rpartition(",")
    if not comma or not side.strip().isdigit():
        raise LimitsetsError("the start", text, "X,SIDE, as in 15,2", "name both", key="--start")
    return place(scene, x, "--start"), int(side)
