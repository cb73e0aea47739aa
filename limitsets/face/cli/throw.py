"""`limitsets throw`, `plot` and `animate`: single throws, with what is worth knowing of each, a figure, a film."""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import limitsets as ls
from limitsets.base import Column, LimitsetsError, Table, as_table
from limitsets.face import report
from limitsets.face.cli.arguments import place, position
from limitsets.face.cli.commands import Answer, Form, Run, Scene, Seed, command, limits
from limitsets.face.cli.output import saved, stem_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from limitsets.feeder.thrower import Trace


@command()
def throw(
    run: Run,
    scene: Scene,
    *,
    x: str,
    side: int,
    count: Annotated[int, limits(min=1, max=1_000_000)] = 1,
    seed: Seed = 0,
) -> Answer:
    """Throw a part, and say what each throw does; ends at the first exit.

    Parameters
    ----------
    x : X
        Where the part rests: 8, or '20 cm'.
    side : I
        On which side.
    count : N
        How many throws.
    """
    from limitsets.feeder.thrower import trace

    chosen = ls.load(scene)
    start = position(chosen, x)
    run.tell("throws (a first run compiles: up to half a minute)", 0, 1)
    path = trace(chosen.map_of_seed(seed), start, side, count)
    notes = []
    if chosen.effects.auto:
        effects = ", ".join(chosen.effects.on()) or "no effects"
        notes.append(f"auto in [effects] is resolved by limitsets analyse; thrown with: {effects}")
    if path.reason is not None:
        notes.append(f"outside-model: {path.reason}")
    if path.stopped == "stalled":
        notes.append("stalled: the displacement is too small to change x any more; no fixed point")
    return Answer(
        lambda: _records(path),
        lambda: [_table(chosen.unit, path)],
        lambda: _table(chosen.unit, path),
        notes=notes,
    )


def _records(path: Trace) -> list[dict[str, Any]]:
    from limitsets.systems.maps import codes

    return [
        as_table(
            x=path.x[k + 1],
            side=path.side[k + 1],
            status=codes.NAMES[int(path.code[k])],
            phi=path.phi[k],
            displacement=path.displacement[k],
            sides_turned=path.turned[k],
            other_vertex_first=path.other_vertex_first[k],
            **({"reason": path.reason} if path.code[k] == codes.OUTSIDE_MODEL else {}),
        )
        for k in range(path.code.size)
    ]


def _table(unit: str, path: Trace) -> Table:
    columns = (
        "throw",
        Column("x", unit, ".6f"),
        "side",
        "status",
        Column("turned by", "deg", ".3f"),
        Column("displacement", unit, "+.6g"),
        Column("another vertex lands first", show=lambda value: "yes" if value else ""),
    )
    rows: list[tuple[Any, ...]] = [(0, float(path.x[0]), int(path.side[0]), "start", None, None, False)]
    for number, record in enumerate(_records(path), start=1):
        phi = None if record["phi"] is None else math.degrees(record["phi"])
        place = record["x"], record["side"], record["status"]
        rows.append((number, *place, phi, record["displacement"], record["other_vertex_first"]))
    return Table(columns, rows, "Throws", "computed, not proved")


# ---------------------------------------------------------------- `limitsets plot`: one figure


FORMATS = (".png", ".svg", ".pdf")


class Picture(StrEnum):
    """What to draw."""

    PART = "part"
    LIMIT_SET = "limit-set"
    MAP = "map"
    BASINS = "basins"
    MORSE = "morse"
    FLIGHT = "flight"


@command(csv=False)
def plot(
    run: Run,
    scene: Scene,
    kind: Picture,
    *,
    cells: Annotated[int, limits(min=1, max=10_000_000)] = 4096,
    x: str | None = None,
    side: int | None = None,
    form: Form | None = None,
) -> Answer:
    """Draw one figure of a scene.

    Parameters
    ----------
    kind : KIND
        What to draw.
    cells : N
        Cells per side.
    x : X
        For flight: where the part rests.
    side : I
        For flight: on which side.
    form : FORMAT
        png, svg or pdf; by default what FILE says, else png.
    out : FILE
        File (.png, .svg, .pdf), ./NAME-KIND.FORMAT by default.
    """
    figure_file(run.out, form, "")  # refuses another ending before anything is computed
    if (x is None) != (side is None) or (x is not None and kind is not Picture.FLIGHT):
        value = "half given" if kind is Picture.FLIGHT else "given"
        raise LimitsetsError("the throw to draw", value, "--x and --side, for a flight", "give both or none")
    wrong: LimitsetsError | None = None
    if kind is Picture.PART:
        name, drawn, wrong = _part(scene)
    else:
        analysis = ls.analyse(scene, cells, progress=run.tell)
        throw = None if x is None or side is None else (position(analysis.scene, x), side)
        name, drawn = analysis.scene.name, report.writing.figure(analysis, str(kind), throw)
    file = figure_file(run.out, form, f"{name}-{kind}")
    with saved(file) as draft:
        drawn.savefig(draft, dpi=report.writing.DPI)
    notes = [] if wrong is None else [str(wrong)]
    return Answer({"figure": str(file)}, lambda: [f"figure: {file}"], code=2 if wrong else 0, notes=notes)


def figure_file(out: Path | None, form: Form | None, stem: str) -> Path:
    """Give the file of one figure: that of --out, whose ending has to fit --format, or the stem with its ending."""
    if out is None:
        return Path(f"{stem}.{form or Form.PNG}")
    if out.suffix.lower() not in ([f".{form}"] if form else FORMATS):
        endings = f".{form}" if form else ", ".join(FORMATS)
        remedy = "leave one out" if form else "rename it"
        raise LimitsetsError("the figure's file", str(out), f"a name that ends in {endings}", remedy)
    return out


def _part(scene: str) -> tuple[str, Figure, LimitsetsError | None]:
    """Draw the part, which needs no analysis; if it is refused, draw its readable corners and return the error."""
    from limitsets.face.plot.parts import refused_part
    from limitsets.feeder.scene import sketch

    try:
        chosen = ls.load(scene)
    except LimitsetsError as error:
        outline = sketch(scene)
        if outline is None:
            raise
        return outline.name, refused_part(outline, str(error)), error
    return chosen.name, ls.plot.part(chosen), None


# ----------------------------------------------------------------
# `limitsets animate`: a film of throws, of feeding, of feedback, or of an orbit that violates the goal.


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
    # an option, what it says, and the option without which it means nothing
    for option, thing, told, beside, given, remedy in (
        ("--reading", "the reading", reading, "--margin", margin, "name the quantity"),
        ("--parts", "the parts", parts, "--tray", tray or None, "ask for a tray"),
        (
            "--standing",
            "the cavity",
            "standing" if standing else None,
            "--assemble",
            assemble,
            "name the other part",
        ),
    ):
        if told is not None and given is None:
            raise LimitsetsError(thing, told, f"with {beside}", remedy, key=option)
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
        from limitsets.cell.feeding.falling import arm_end_of

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
