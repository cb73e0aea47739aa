"""`limitsets analyse`: where the throws lead, as a report."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from limitsets.cli.output import Json, Scene, answer, opened, option, progress, table

if TYPE_CHECKING:
    from limitsets.analysis import Analysis, Plan

__all__ = ["analyse"]

MOST_CELLS = 10_000_000


def analyse(
    scene: Scene,
    cells: Annotated[
        int | None, option("--cells", "N", "Cells per side, 4096 by default.", min=1, max=MOST_CELLS)
    ] = None,
    error: Annotated[
        float | None,
        option(
            "--error",
            "X",
            "Instead of cells: largest error of the limit sets' ends, in the scene's unit of length. "
            "What is picked for it, and what it will cost, is told before it starts.",
        ),
    ] = None,
    out: Annotated[
        Path | None, option("--out -o", "DIR", "Folder of the report, ./NAME-analysis by default.")
    ] = None,
    json: Json = False,
) -> None:
    """Find limit sets, basins and critical points, and write report.md, analysis.json and figures."""
    with progress() as tell:
        chosen, folder = opened(scene, out, "analysis")
        from limitsets.analysis import analyse as run
        from limitsets.report.writing import write

        analysis = run(chosen, cells, error=error, progress=tell, announce=_announce)
        files = write(analysis, folder, progress=tell)
    answer(analysis, json, lambda: _text(analysis, files[0]))


def _announce(plan: Plan) -> None:
    print(f"limitsets: {plan}", file=sys.stderr, flush=True)


def _text(analysis: Analysis, page: Path) -> None:
    from limitsets.report.goals import verdict_of, void_of
    from limitsets.report.tables import count, intervals, percent

    unit = analysis.scene.unit
    if not analysis.attractors:
        undecided = analysis.basins.undecided_between
        left = f"no limit set was found, and {percent(undecided)} of all starts are undecided"
        typer.echo(left if undecided else "no start was found to stay on the arm")
    for k, (attractor, extents) in enumerate(zip(analysis.attractors, analysis.extents, strict=True)):
        typer.echo(f"limit set {k}: from {percent(analysis.basins.attractors[k])} of all starts")
        rows = [
            [side, intervals(parts), count(*attractor.jogs_per_visit.get(side, (0, 0)))]
            for side, parts in extents.items()
        ]
        table(["side", f"x [{unit}]", "jogs per visit"], rows)
    for text in analysis.advice:
        typer.echo(f"not settled: {text}")
    if analysis.goal is not None:
        void = void_of(analysis.goal, unit)
        typer.echo(
            f"goal {analysis.goal.goal.kind}: {verdict_of(analysis.goal)} ({analysis.goal.how}, not proved)"
            + (f"; but {void}" if void else "")
        )
    found = analysis.accuracy
    if found is not None and found.reached is not None:
        typer.echo(f"error of the ends: {found.reached:.2g} {unit} ({found.how})")
    if found is not None and not found.met:
        typer.echo(f"the error of {found.plan.error_wanted:g} {unit} was not met: {found.advice}")
    typer.echo(f"report: {page}")
