"""`limitsets analyse`, `audit` and `fit`: where the throws lead, what the model leaves out, the model from a film."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from limitsets.face.cli.arguments import number
from limitsets.face.cli.output import (
    Csv,
    Form,
    Format,
    Html,
    Json,
    Scene,
    answer,
    opened,
    option,
    progress,
    show,
    table,
)

if TYPE_CHECKING:
    from limitsets.parameters.analysis import Analysis, Plan
    from limitsets.parameters.fitting import Enough, Fit
    from limitsets.proofs.auditing import Audit


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
        from limitsets.feeder.scene import load_to_analyse
        from limitsets.feeder.scene.checking import doubts

        _, folder = opened(scene, out, "analysis", lambda source: load_to_analyse(source)[0])
        from limitsets.face.report.writing import write
        from limitsets.parameters.analysis import analyse as run

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
    from limitsets.face.report.pages import after_undecided, next_command, percent, verdict_of, void_of
    from limitsets.feeder.scene.checking import doubts
    from limitsets.parameters.analysis import in_limit_sets

    unit = analysis.scene.unit
    if analysis.choice.notice:
        typer.echo(analysis.choice.notice)
    for doubt in doubts(analysis.scene):
        typer.echo(str(doubt))
    _print_limit_sets(analysis)
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
    accuracy = analysis.accuracy
    if accuracy is not None and accuracy.reached is not None:
        typer.echo(f"error of the ends: {accuracy.reached:.2g} {unit} ({accuracy.how})")
    if accuracy is not None and not accuracy.met:
        typer.echo(f"the error of {accuracy.plan.error_wanted:g} {unit} was not met: {accuracy.advice}")
    typer.echo(f"report: {page}")


def _print_limit_sets(analysis: Analysis) -> None:
    """Print the table of each limit set, or where the starts go if there is none."""
    from limitsets.face.report.pages import count, intervals, percent

    unit = analysis.scene.unit
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


# ----------------------------------------------------------------
# `limitsets audit`: what the model leaves out, and where the scene calls for it.


def audit(
    scene: Scene,
    out: Annotated[
        Path | None, option("--out -o", "DIR", "Write audit.md, audit.json and figures there.")
    ] = None,
    form: Format = Form.PNG,
    csv: Csv = None,
    json: Json = False,
) -> None:
    """Ask which assumptions of the model a scene breaks: on its limit set, and on the whole arm."""
    with progress() as tell:
        chosen, _ = opened(scene, out)
        tell("assumptions", 0, 1 + (out is not None))
        from limitsets.proofs.auditing import audit as run

        findings = run(chosen)
        files = []
        if out is not None:
            from limitsets.face.report.writing import write_audit

            tell("files", 1, 2)
            files = write_audit(findings, out, form)
    answer(findings, json, lambda: _text_of_audit(findings, files), csv=(csv, findings.table))


def _text_of_audit(findings: Audit, files: list[Path]) -> None:
    from limitsets.face.report.writing import HEADS, lines_of, summary

    table(HEADS, lines_of(findings))
    for line in summary(findings):
        typer.echo(line)
    if files:
        typer.echo(f"report: {files[0]}")


# ----------------------------------------------------------------
# `limitsets fit`: the model fitted to filmed throws, and whether the goal's margin is larger than what was
# found.


HELP_FILE = (
    "Throws: x_before [mm], side_before, x_after [mm], side_after, and, if known, error [mm], run; corner_before [mm], "
    "corner_after [mm] for x where the film shows the left corner."
)
HELP_ERROR = "Standard deviation of a measured place: '0.5 mm', or a number in the scene's unit."
HELP_OUT = "Write fitted.toml, fit.json and figures."
HELP_NO_MARGIN = "Do not ask whether the goal's margin is large enough (proofs: a minute)."


def fit(
    scene: Scene,
    file: Annotated[Path, typer.Argument(metavar="FILE.csv", help=HELP_FILE)],
    error: Annotated[str | None, option("--error", "E", HELP_ERROR)] = None,
    out: Annotated[Path | None, option("--out -o", "DIR", HELP_OUT)] = None,
    form: Format = Form.PNG,
    csv: Csv = None,
    json: Json = False,
    no_margin: Annotated[bool, typer.Option("--no-margin", help=HELP_NO_MARGIN)] = False,
) -> None:
    """Fit speed, centre of mass, surface height and radius of gyration to filmed throws.

    Exit 1 where the goal is not proved for every machine that the film leaves possible, with its scatter.
    """
    with progress() as tell:
        chosen, _ = opened(scene, out)
        from limitsets.parameters.fitting import enough
        from limitsets.parameters.fitting import fit as run

        estimates = run(chosen, file, error=None if error is None else number(error), progress=tell)
        judged = None if no_margin or chosen.goal is None else enough(estimates, progress=tell)
        record = estimates.to_json() | {"enough": None if judged is None else judged.to_json()}
        files = _write(estimates, record, out, form) if out is not None else []
    answer(record, json, lambda: _text_of_fit(estimates, judged, files), csv=(csv, estimates.table))
    raise typer.Exit(0 if judged is None or judged.verdict == "enough" else 1)


def _write(estimates: Fit, record: dict[str, Any], out: Path, form: str) -> list[Path]:
    from limitsets.base.files import as_json
    from limitsets.face.plot.noise import fit_residuals
    from limitsets.face.plot.parts import part
    from limitsets.face.report.writing import laid
    from limitsets.feeder.scene import dump

    texts = {"fitted.toml": dump(estimates.scene), "fit.json": as_json(record)}
    drawn = [("part", part(estimates.scene)), ("residuals", fit_residuals(estimates))]
    return laid(out, drawn, lambda _: texts, form)


def _text_of_fit(estimates: Fit, judged: Enough | None, files: list[Path]) -> None:
    from limitsets.face.report.pages import lines_of

    show(estimates.table())
    for line in lines_of(estimates):
        typer.echo(line)
    for line in judged.sentences if judged is not None else ():
        typer.echo(line)
    if files:
        typer.echo(f"written to {files[0].parent}: {', '.join(path.name for path in files)}")
