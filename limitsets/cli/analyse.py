"""`limitsets analyse`: where the throws lead, as a report."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from limitsets.cli.output import Csv, Form, Format, Html, Json, Scene, answer, opened, option, progress, table

if TYPE_CHECKING:
    from limitsets.analysis import Analysis, Plan

MOST_CELLS = 10_000_000

# Share of the starts that leave the model, above which the speed is likely to have a wrong unit.
MOST = 0.99


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
    html: Html = False,
    form: Format = Form.PNG,
    csv: Csv = None,
    json: Json = False,
) -> None:
    """Find limit sets, basins and critical points, and write report.md, analysis.json and figures."""
    with progress() as tell:
        from limitsets.scene import load_to_analyse
        from limitsets.scene.doubts import doubts

        _, folder = opened(scene, out, "analysis", lambda source: load_to_analyse(source)[0])
        from limitsets.analysis import analyse as run
        from limitsets.report.writing import write

        analysis = run(scene, cells, error=error, progress=tell, announce=_announce)
        files = write(analysis, folder, form=form, html=html, progress=tell)
    if json:
        for note in (analysis.choice.notice, *map(str, doubts(analysis.scene))):
            if note:
                print(f"limitsets: {note}", file=sys.stderr, flush=True)
    answer(analysis, json, lambda: _text(analysis, files[0]), csv=(csv, analysis.table))


def _announce(plan: Plan) -> None:
    print(f"limitsets: {plan}", file=sys.stderr, flush=True)


def _text(analysis: Analysis, page: Path) -> None:
    from limitsets.analysis import in_limit_sets
    from limitsets.report.goals import after_undecided, next_command, verdict_of, void_of
    from limitsets.report.tables import count, intervals, percent
    from limitsets.scene.doubts import doubts

    unit = analysis.scene.unit
    if analysis.choice.notice:
        typer.echo(analysis.choice.notice)
    for doubt in doubts(analysis.scene):
        typer.echo(str(doubt))
    if not analysis.attractors:
        undecided = analysis.basins.undecided_between
        left = f"no limit set was found, and {percent(undecided)} of all starts are undecided"
        typer.echo(left if undecided else "no start was found to stay on the arm")
        if analysis.basins.exits.get("outside-model", 0.0) > MOST:
            kappa = f"{analysis.scene.kappa:.6g} {unit}"
            typer.echo(
                "outside the model: a throw after which the part has not landed within a full turn. "
                f"Almost all starts are; kappa is {kappa}: has the speed the right unit?"
            )
    for k, (attractor, extents) in enumerate(zip(analysis.attractors, analysis.extents, strict=True)):
        whose = "" if analysis.scene.effects.spread is None else ", of throws without scatter"
        typer.echo(f"limit set {k}{whose}: from {percent(analysis.basins.attractors[k])} of all starts")
        rows = [
            [side, intervals(parts), count(*attractor.jogs_per_visit.get(side, (0, 0)))]
            for side, parts in extents.items()
        ]
        table(["side", f"x [{unit}]", "jogs per visit"], rows)
    exits = ", ".join(f"{name} {percent(share)}" for name, share in analysis.basins.exits.items() if share)
    if exits:
        typer.echo(f"of all starts leave: {exits}")
    broken = ", ".join(str(side) for side in in_limit_sets(analysis.other_vertex_first, analysis.extents))
    if broken:
        typer.echo(
            f"careful: of some throws of the limit set from side {broken} another vertex lands first, and the model "
            "does not describe them; limitsets audit says what else is broken"
        )
    for text in analysis.advice:
        typer.echo(f"not settled: {text}")
    undecided, finer = analysis.basins.undecided_between, after_undecided(analysis)
    if finer and analysis.attractors:
        typer.echo(f"undecided: {percent(undecided)} of all starts; next: {finer}")
    if analysis.goal is not None:
        void = void_of(analysis.goal, unit, analysis.scene.effects.spread)
        said = verdict_of(analysis.goal, sum(analysis.basins.attractors))
        typer.echo(
            f"goal {analysis.goal.goal.kind}: {said} ({analysis.goal.how}, not proved)"
            + (f"; but {void}" if void else "")
        )
        threshold = analysis.goal.threshold
        if analysis.goal.holds is False and threshold is not None and math.isfinite(threshold):
            typer.echo(analysis.goal.goal.explained(threshold, unit))
        typer.echo(f"next: {next_command(analysis)}")
    found = analysis.accuracy
    if found is not None and found.reached is not None:
        typer.echo(f"error of the ends: {found.reached:.2g} {unit} ({found.how})")
    if found is not None and not found.met:
        typer.echo(f"the error of {found.plan.error_wanted:g} {unit} was not met: {found.advice}")
    typer.echo(f"report: {page}")
