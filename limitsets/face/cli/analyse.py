"""`limitsets analyse`, `audit`, `discrepancy`, `fit`: where throws lead, what the model omits, a film fitted."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import limitsets as ls
from limitsets.base import Table
from limitsets.face import report
from limitsets.face.cli.arguments import number
from limitsets.face.cli.commands import Answer, Run, Scene, Seed, Words, command, limits

if TYPE_CHECKING:
    from limitsets.parameters.analysis import Analysis, Plan


# Share of the starts that leave the model, above which the speed is likely to have a wrong unit.
MOST = 0.99


@command(form=True, html=True)
def analyse(
    run: Run,
    scene: Scene,
    *,
    cells: Annotated[int | None, limits(min=1, max=10_000_000)] = None,
    error: float | None = None,
) -> Answer:
    """Find limit sets, basins and critical points, and write report.md, report.html, JSON and figures.

    Parameters
    ----------
    cells : N
        Cells per side, 4096 by default.
    error : X
        Instead of cells: largest error of the limit sets' ends, in the scene's unit of length. What is picked
        for it, and what it will cost, is told before it starts.
    out : DIR
        Folder of the report, ./NAME-analysis by default.
    """
    from limitsets.feeder.scene import doubts, load_to_analyse

    run.opened(scene, "analysis", lambda source: load_to_analyse(source)[0])

    def announce(plan: Plan) -> None:
        print(f"limitsets: {plan}", file=sys.stderr, flush=True)

    analysis = ls.analyse(scene, cells, error=error, progress=run.tell, announce=announce)
    run.files = report.writing.write(analysis, run.folder, form=run.form, html=run.html, progress=run.tell)
    notes = [note for note in (analysis.choice.notice, *map(str, doubts(analysis.scene))) if note]

    def words() -> Iterator[str | Table]:
        yield from notes
        yield from _limit_sets(analysis)
        yield from _lines(analysis)

    return Answer(analysis, words, analysis.table, notes=notes if run.json else ())


def _lines(analysis: Analysis) -> Iterator[str]:
    """Say what leaves, what is not settled, and what becomes of the goal and of the error asked for."""
    from limitsets.parameters.analysis import in_limit_sets

    pages, unit, accuracy = report.pages, analysis.scene.unit, analysis.accuracy
    exits = ", ".join(
        f"{name} {pages.percent(share)}" for name, share in analysis.basins.exits.items() if share
    )
    if exits:
        yield f"of all starts leave: {exits}"
    broken = ", ".join(str(side) for side in in_limit_sets(analysis.other_vertex_first, analysis.extents))
    if broken:
        yield (
            f"careful: of some throws of the limit set from side {broken} another vertex lands first, and the model "
            "does not describe them; limitsets audit says what else is broken"
        )
    yield from (f"not settled: {text}" for text in analysis.advice)
    finer = pages.after_undecided(analysis)
    if finer and analysis.attractors:
        yield f"undecided: {pages.percent(analysis.basins.undecided_between)} of all starts; next: {finer}"
    if analysis.goal is not None:
        void = pages.void_of(analysis.goal, unit, analysis.scene.effects.spread)
        verdict = pages.verdict_of(analysis.goal, sum(analysis.basins.attractors))
        but = f"; but {void}" if void else ""
        yield f"goal {analysis.goal.goal.kind}: {verdict} ({analysis.goal.how}, not proved){but}"
        threshold = analysis.goal.threshold
        if analysis.goal.holds is False and threshold is not None and math.isfinite(threshold):
            yield analysis.goal.goal.explained(threshold, unit)
    yield from pages.choice_of(analysis)
    if analysis.goal is not None:
        yield f"next: {pages.next_command(analysis)}"
    if accuracy is not None and accuracy.reached is not None:
        yield f"error of the ends: {accuracy.reached:.2g} {unit} ({accuracy.how})"
    if accuracy is not None and not accuracy.met:
        yield f"the error of {accuracy.plan.error_wanted:g} {unit} was not met: {accuracy.advice}"


def _limit_sets(analysis: Analysis) -> Iterator[str | Table]:
    """Show each limit set as a table, or say where the starts go if there is none."""
    pages, unit = report.pages, analysis.scene.unit
    if not analysis.attractors:
        undecided = analysis.basins.undecided_between
        left = f"no limit set was found, and {pages.percent(undecided)} of all starts are undecided"
        yield left if undecided else "no start was found to stay on the arm"
        if analysis.basins.exits.get("outside-model", 0.0) > MOST:
            yield (
                "outside the model: a throw after which the part has not landed within a full turn. "
                f"Almost all starts are; kappa is {analysis.scene.kappa:.6g} {unit}: has the speed the right unit?"
            )
    for k, (attractor, extents) in enumerate(zip(analysis.attractors, analysis.extents, strict=True)):
        whose = "" if analysis.scene.effects.spread is None else ", of throws without scatter"
        yield f"limit set {k}{whose}: from {pages.percent(analysis.basins.attractors[k])} of all starts"
        jogs = attractor.jogs_per_visit
        rows = [
            (side, pages.intervals(parts), pages.count(*jogs.get(side, (0, 0))))
            for side, parts in extents.items()
        ]
        yield Table(("side", f"x [{unit}]", "jogs per visit"), rows)


# ----------------------------------------------------------------
# `limitsets audit`: what the model leaves out, and where the scene calls for it.


@command(form=True)
def audit(run: Run, scene: Scene) -> Answer:
    """Ask which assumptions of the model a scene breaks: on its limit set, and on the whole arm.

    Parameters
    ----------
    out : DIR
        Write audit.md, audit.json and figures there.
    """
    chosen = run.opened(scene)
    run.tell("assumptions", 0, 1 + (run.out is not None))
    findings = ls.audit(chosen)
    if run.out is not None:
        run.tell("files", 1, 2)
        run.files = report.writing.write_audit(findings, run.out, run.form)
    writing = report.writing
    return Answer(
        findings,
        lambda: [Table(writing.HEADS, writing.lines_of(findings)), *writing.summary(findings)],
        findings.table,
    )


# ----------------------------------------------------------------
# `limitsets discrepancy`: the minimal model against the machine.


@command(form=True, html=True)
def discrepancy(
    run: Run,
    scene: Scene,
    *,
    effect: Words = None,
    throws: Annotated[int, limits(min=1)] = 100_000,
    seed: Seed = 0,
) -> Answer:
    """Ask whether the feeder works on the machine: how far friction and rebound move a landing, and what survives.

    Exit 1 where the effects are not covered by what is proved of the minimal model, or the goal does not survive them.

    Parameters
    ----------
    effect : EFFECT
        An effect to compare with, repeatable; by default those that the scene calls for and whose facts it states.
    throws : N
        How many throws are simulated in each place.
    out : DIR
        Write report.md, discrepancy.json and a figure there.
    """
    from limitsets.parameters.discrepancy import discrepancy as of_scene

    chosen = run.opened(scene)
    compared = of_scene(chosen, effect or None, throws=throws, seed=seed, progress=run.tell)
    if run.out is not None:
        run.files = report.machine_page.write_machine(compared, run.out, run.form, html=run.html)
    code = (
        1
        if compared.effects and not (compared.enough or (compared.margin is None and compared.covered))
        else 0
    )

    def words() -> Iterator[str | Table]:
        yield from compared.tables()
        yield compared.sentence
        yield from compared.advice
        yield from (f"not simulated: {name}: {why}" for name, why in compared.left_out.items())

    return Answer(compared, words, compared.table, code=code)


# ----------------------------------------------------------------
# `limitsets fit`: the model fitted to filmed throws, and whether the goal's margin is larger than what was
# found.


@command(form=True)
def fit(run: Run, scene: Scene, file: Path, *, error: str | None = None, no_margin: bool = False) -> Answer:
    """Fit speed, centre of mass, surface height and radius of gyration to filmed throws.

    Exit 1 where the goal is not proved for every machine that the film leaves possible, with its scatter.

    Parameters
    ----------
    file : FILE.csv
        Throws: x_before [mm], side_before, x_after [mm], side_after, and, if known, error [mm], run;
        corner_before [mm], corner_after [mm] for x where the film shows the left corner.
    error : E
        Standard deviation of a measured place: '0.5 mm', or a number in the scene's unit.
    no_margin
        Do not ask whether the goal's margin is large enough (proofs: a minute).
    out : DIR
        Write fitted.toml, fit.json and figures.
    """
    from limitsets.parameters.fitting import enough

    chosen = run.opened(scene)
    estimates = ls.fit(chosen, file, error=None if error is None else number(error), progress=run.tell)
    judged = None if no_margin or chosen.goal is None else enough(estimates, progress=run.tell)
    record = estimates.to_json() | {"enough": None if judged is None else judged.to_json()}
    if run.out is not None:
        drawn = [("part", ls.plot.part(estimates.scene)), ("residuals", ls.plot.fit_residuals(estimates))]
        run.write(drawn, {"fitted.toml": ls.dump(estimates.scene), "fit.json": record})

    sentences = () if judged is None else judged.sentences
    return Answer(
        record,
        lambda: [estimates.table(), *report.pages.lines_of(estimates), *sentences],
        estimates.table,
        code=0 if judged is None or judged.verdict == "enough" else 1,
    )
