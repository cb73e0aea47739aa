"""`limitsets new` and `part`: a scene to start from, of a drawing perhaps, and the sides on which a part rests."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import limitsets as ls
from limitsets.base import LimitsetsError, Table, proposed
from limitsets.face import report
from limitsets.face.cli.arguments import deviations
from limitsets.face.cli.commands import Answer, Form, Run, Scene, Words, command
from limitsets.face.cli.output import saved, stem_of

if TYPE_CHECKING:
    from limitsets.feeder.drawing import Drawing


@command(out=False, csv=False)
def new(
    run: Run,
    file: Path,
    *,
    from_: Path | None = None,
    unit: str | None = None,
    material: str | None = None,
    density: str | None = None,
    thickness: str | None = None,
    layer: Words = None,
    scale: str | None = None,
    error: str | None = None,
) -> Answer:
    """Write a scene to start from: every key that a scene may have, with what it means.

    With --from its part is that of a drawing, and a picture of the part is written beside the scene.

    Parameters
    ----------
    file : FILE.toml
        The file to write; it must not be there.
    from_ : DRAWING
        A plate as a DXF or SVG file: its outline and holes become the part.
    unit : UNIT
        Of its lengths: mm, cm, m, in, ...; default in, with --from that of the drawing. A drawing that states none is
        in this unit.
    material : NAME
        With --from: of the plate, for its density: steel, aluminium, brass, ...
    density : DENSITY
        With --from, instead: '7850 kg/m^3' with a thickness, or '15.7 kg/m^2'.
    thickness : LENGTH
        With --from: of the plate; default: what the drawing states.
    layer : NAME
        With --from: read this layer alone; repeatable.
    scale : LENGTH
        With --from: what 1 is in the drawing, like '0.1 mm', whatever the drawing states.
    error : LENGTH
        With --from: how far chords may be from the arcs that they replace; default 1/1000 of the drawing's extent.
    """
    from limitsets.feeder.scene import new_scene

    options = {
        "--material": material,
        "--density": density,
        "--thickness": thickness,
        "--layer": layer,
        "--scale": scale,
        "--error": error,
    }
    if from_ is None:
        for option, value in options.items():
            if value is not None:
                remedy = "name the drawing with --from, or leave this out"
                raise LimitsetsError(f"the option {option}", value, "beside --from", remedy)
        written = new_scene(file, unit or "in")
        words = [f"scene: {written}", _next(written)]
        return Answer({"scene": str(written)}, lambda: words)
    from limitsets.feeder.drawing import read_drawing, tables_of

    drawing = read_drawing(from_, unit=unit, scale=scale, error=error, layers=layer or ())
    tables = tables_of(drawing, material=material, density=density, thickness=thickness)
    written = new_scene(file, drawing.unit, tables)
    scene, picture = ls.load(written), written.with_suffix(".png")
    with saved(picture) as draft:
        ls.plot.part(scene).savefig(draft, dpi=report.writing.DPI)
    record = {
        "scene": str(written),
        "picture": str(picture),
        "unit": drawing.unit,
        "vertices": len(drawing.outline),
        "holes": len(drawing.holes),
        "sides": len(scene.sides),
        "extent": drawing.extent,
        "area": drawing.area,
        "chord_error": drawing.chord_error,
        "left_out": drawing.left_out,
    }

    def read() -> Iterator[str]:
        yield from _read(drawing, len(scene.sides))
        if not (material or density):
            yield "no material is named: the plate has 1 kg/m^2, which counts only beside point masses"
        tips = [str(side) for side, rests in enumerate(scene.sides.rests.tolist()) if not rests]
        if tips:
            sides = f"side {tips[0]}" if len(tips) == 1 else f"{len(tips)} of its sides"
            yield f"it cannot rest on {sides}: landing and roll in [effects] simulate how it tips on"
        yield f"scene: {written}"
        yield f"picture: {picture}"
        yield _next(written)

    return Answer(record, read)


def _next(written: Path) -> str:
    return f"next: edit it, then {proposed('check', written)} and {proposed('analyse', written)}"


def _read(drawing: Drawing, sides: int) -> Iterator[str]:
    """Say what was read of a drawing."""
    unit, (wide, high) = drawing.unit, drawing.extent
    holes = {0: "no hole", 1: "1 hole"}.get(len(drawing.holes), f"{len(drawing.holes)} holes")
    yield (
        f"read: an outline with {len(drawing.outline)} vertices and {holes}, {wide:.6g} x {high:.6g} {unit},"
        f" {drawing.area:.6g} {unit}^2; its hull has {sides} sides"
    )
    if drawing.chord_error > 0.0:
        yield f"arcs and curves are chords, within {drawing.chord_error:.2g} {unit} of them"
    if drawing.left_out:
        yield f"left out: {', '.join(drawing.left_out)}"


@command()
def part(run: Run, scene: Scene, *, tolerance: Words = None, form: Form | None = None) -> Answer:
    """Say on which sides a part rests, and how far the ground can lean before it tips over; with a figure.

    Parameters
    ----------
    tolerance : Q=DEV
        A quantity of the part that is known to a deviation only, like part.mass.center.along='0.5 mm'; repeatable.
    form : FORMAT
        png, svg or pdf; by default what FILE says, else png.
    out : FILE
        The figure (.png, .svg, .pdf), ./NAME-sides.FORMAT by default.
    """
    from limitsets.face.cli.throw import figure_file
    from limitsets.feeder.scene import load_to_analyse
    from limitsets.proofs.prover.stability import stability

    chosen, _ = load_to_analyse(scene)
    answer = stability(chosen, tolerance=deviations("--tolerance", tolerance))
    file = figure_file(run.out, form, f"{stem_of(chosen)}-sides")
    with saved(file) as draft:
        ls.plot.resting_sides(answer).savefig(draft, dpi=report.writing.DPI)

    def words() -> Iterator[str | Table]:
        yield answer.table()
        yield f"figure: {file}"

    record: dict[str, Any] = {"figure": str(file), "sides": answer.to_json()}
    return Answer(record, words, answer.table)
