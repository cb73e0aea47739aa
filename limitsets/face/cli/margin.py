"""`limitsets margin`, `robustness` and `atlas`: how far quantities may deviate, and what changes when they vary."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import limitsets as ls
from limitsets.base import Table, joined
from limitsets.face import report
from limitsets.face.cli.arguments import deviations, goal_at, laid_ranges, machines_of, scattering_of
from limitsets.face.cli.commands import About, Answer, Run, Scene, Words, command, limits
from limitsets.face.cli.output import processes, saved, stem_of
from limitsets.face.cli.subjects import MapOfFile, domain_of, of_map_alone, of_scene_alone, subject

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene as SceneOf
    from limitsets.parameters.atlas import Atlas
    from limitsets.parameters.margins.margin_result import Margin
    from limitsets.parameters.sheet.summary import Robustness


HEADS = ("quantity", "reading", "proved safe up to", "shown to fail from")


@command(form=True)
def margin(
    run: Run,
    scene: Scene,
    quantity: list[str] | None = None,
    *,
    reading: str | None = None,
    x: str | None = None,
    laid: Words = None,
    fitted: Path | None = None,
    width: float = 0.01,
    no_recheck: bool = False,
) -> Answer:
    """Bracket how much each quantity may deviate before the goal fails: proved below, refuted above.

    Exit 1 where nothing is proved of one of them, its two ends are farther apart than asked, or the scene scatters its
    throws: margins are those of the scene without its scatter.

    Parameters
    ----------
    quantity : QUANTITY
        Like throw.speed, or "joint"; default: all there are, with --fitted joint.
    reading : R
        fixed (but unknown) or per-throw.
    x : X
        Ask the goal at another X: 20, or '50 cm'.
    width : W
        How close the two ends have to be, as a share.
    out : DIR
        Write margins.json, certificates, orbits, a figure.
    """
    begins, chosen = laid_ranges(laid), run.opened(scene)
    machines, noise = machines_of(fitted), None
    if machines is not None:
        chosen, noise, quantity = machines.on(chosen), machines.noise, quantity or ["joint"]
    goal = None if x is None else goal_at(chosen, x)
    margins = ls.margin(
        chosen,
        *(quantity or ()),
        reading=reading,
        goal=goal,
        laid=begins,
        noise=noise,
        width=width,
        progress=run.tell,
    )
    about = run.about(margins[0].model, chosen)
    if run.out is not None:
        run.tell("files", len(margins), len(margins) + 1)
        margins = _write(run, margins, about, recheck=not no_recheck)
    again = "not rechecked" if no_recheck else "rechecked"
    last = [] if run.out is None else [f"certificates: {again} (again: limitsets recheck FILE)"]
    if machines is not None:
        last += [machines.sentence(each.proved, each.refuted) for each in margins if each.quantity == "joint"]
    bracketed = all(each.proved > 0 and (each.closed or each.refuted is None) for each in margins)
    return Answer(
        margins,
        lambda: [*_text(chosen, margins), *last],
        lambda: joined(margins),
        code=0 if bracketed and chosen.effects.spread is None else 1,
        about=about,
    )


def _write(run: Run, given: tuple[Margin, ...], about: About, *, recheck: bool) -> tuple[Margin, ...]:
    """Write the files; return the margins without the claims that the checker denies."""
    from limitsets.parameters.margins.margin_result import settled

    margins = tuple(settled(each, run.folder, recheck=recheck) for each in given)
    single = [each for each in margins if each.reading != "tolerance"]
    drawn = [
        ("part", ls.plot.part(given[0].scene)),
        *([("margins", ls.plot.tornado(single))] if single else []),
        *(("joint", ls.plot.tolerance_box(each)) for each in margins if each.reading == "tolerance"),
    ]
    run.write(drawn, {"margins.json": about.added(margins)})
    return margins


def _text(given: SceneOf, margins: tuple[Margin, ...]) -> Iterator[str | Table]:
    from limitsets.feeder.scene import WITHOUT_SCATTER
    from limitsets.parameters.margins.margin_result import bound, failing, reach_of, void_of

    scene, goals = margins[0].scene, margins[0].goals
    whose = f"{scene.name}: {WITHOUT_SCATTER}, " if given.effects.spread else f"{scene.name}: "
    yield whose + " and ".join(report.pages.goal_sentence(goal, scene.unit) for goal in goals)
    if len(margins) > 1 and not any(each.proved > 0.0 or each.refuted for each in margins):
        yield f"{len(margins)} margins, all of them 0: {margins[0].reason}"
        fails = any(each.refuted == 0.0 for each in margins)
        yield f"next: {report.pages.without_margin(given, goals, fails=fails)}"
        return
    rows = []
    for each in margins:
        unit = each.unit or "times"
        low, high = bound(each.proved, unit), failing(each.refuted, unit, each.direction)
        rows.append((each.quantity, report.robust_pages.READINGS[each.reading], low, high))
    yield Table(HEADS, rows)
    voids = [void_of(each.goals, reach_of(each.pieces), scene.unit) for each in margins]
    for each, void in zip(margins, voids, strict=True):
        if void:
            yield f"{each.quantity}: what is proved holds vacuously, {void}"
        if each.reason:
            yield f"{each.quantity}: {each.reason}"
    if any(voids):
        yield from report.pages.choice_for(given, goals)


# ----------------------------------------------------------------
# `limitsets robustness`: a sheet of tolerances, what is proved safe and what fails, and what noise does.


@command(form=True, html=True)
def robustness(
    run: Run,
    scene: Scene,
    *,
    quantity: Words = None,
    reading: str | None = None,
    laid: Words = None,
    tolerance: Words = None,
    scatter: Words = None,
    law: str = "gaussian",
    width: float = 0.01,
    cells: Annotated[int, limits(min=8, max=100_000)] = 1024,
    seconds: Annotated[float, limits(min=0.0)] = 12.0,
    workers: Annotated[int | None, limits(min=1)] = None,
    without: Words = None,
    no_recheck: bool = False,
) -> Answer:
    """Say how far each quantity may drift before the goal fails, and write report.md, figures and certificates.

    Exit 1 where the goal is not proved of the scene as it is, or the search for a margin ends with an error.

    Parameters
    ----------
    quantity : Q
        A quantity, like throw.speed; repeatable. Default: all that the scene gives.
    reading : R
        fixed (but unknown) or per-throw; default both.
    tolerance : Q=DEV
        Of the joint margin, like throw.speed='1 %'; repeatable. Default: the scene's [tolerance].
    scatter : Q=DEV
        Noise at every throw, like throw.speed='0.5 %'; repeatable. Default: the scatter in the scene's
        [world].
    width : W
        How close brackets have to be, as a share.
    cells : N
        Cells per side, for the noise.
    seconds : S
        For the proofs of the joint margin and of the curve; five times as many for the noise.
    workers : N
        Processes that search for margins; default: one a core.
    without : PART
        What not to do: margins, joint, curve, noise or audit; repeatable.
    out : DIR
        Folder of the report, ./NAME-robustness by default.
    """
    chosen = run.opened(scene, "robustness")
    with processes(workers) as pool:
        sheet = ls.robustness(
            chosen,
            *(quantity or ()),
            laid=laid_ranges(laid),
            reading=reading,
            tolerance=deviations("--tolerance", tolerance) or None,
            scatter=scattering_of(chosen, scatter, law),
            width=width,
            cells=cells,
            leave_out=without or (),
            seconds=seconds,
            folder=run.out,
            recheck=not no_recheck,
            executor=pool,
            progress=run.tell,
        )
    run.tell("files", len(sheet.entries), len(sheet.entries) + 1)
    run.files = report.robust_pages.write_robustness(sheet, run.folder, run.form, html=run.html)
    return Answer(
        sheet,
        lambda: _text_of_sheet(chosen, sheet),
        sheet.table,
        code=0 if sheet.verdict == "proved" and not sheet.failed else 1,
        about=run.about(sheet.model),  # audited by the sheet itself, unless that was left out
    )


def _text_of_sheet(given: SceneOf, sheet: Robustness) -> Iterator[str | Table]:
    pages = report.robust_pages
    yield pages.answer(sheet).replace("**", "")
    if any(entry.holds for entry in sheet.singles):
        yield Table(pages.HEADS, pages.lines_of(sheet))
    elif sheet.singles:
        yield pages.none_holds(sheet)
        fails = sheet.decided == "refuted"
        yield f"next: {report.pages.without_margin(given, sheet.goals, fails=fails)}"
    rests = ("rest of the curve", "rest of the noise")
    for part in dict.fromkeys(("joint", "curve", "noise", *rests, *sheet.failed)):
        reason = sheet.left_out.get(part)
        if reason and reason != "it was not asked for":
            yield f"no {part}: {reason}"


# ----------------------------------------------------------------
# `limitsets atlas`: one or two quantities of a scene, varied, and what is asked at every point.


@command(form=True)
def atlas(
    run: Run,
    scene: Scene,
    *,
    x: str,
    y: str | None = None,
    variables: list[str] | None = None,
    task: str | None = None,
    margin: str | None = None,
    reading: str = "fixed",
    fitted: Path | None = None,
    certify: bool = False,
    set_: Words = None,
    domain: str | None = None,
    workers: Annotated[int | None, limits(min=1)] = None,
    cluster: str | None = None,
    refine: bool = False,
    coarse: Annotated[int, limits(min=2)] = 8,
) -> Answer:
    """Vary one or two quantities of a scene or a map, and keep what a task says at every point.

    A run that was interrupted goes on when the same command is given again.

    Parameters
    ----------
    scene : SCENE
        A built-in name, a TOML file, or a map FILE.py:NAME; the Python file is run.
    x : Q=LO:HI:N
        What varies: throw.speed=120:180:1000, or with units throw.speed='120 deg/s:180 deg/s:1000'.
    y : Q=LO:HI:N
        A second one; without it a line of points.
    variables : V,V
        Which answers; default: what the task gives.
    task : MODULE:FUNCTION
        What is asked: a function of a scene; by default the topology of the attractors.
    margin : Q
        Find the goal's margin at every point, by floats: throw.speed, or joint.
    reading : R
        Of --margin: fixed (but unknown) or per-throw.
    certify
        Prove what holds in each cell of the window; writes NAME-regions.proof.zip.
    set_ : NAME=NUMBER
        Of a map: the value of a parameter that does not vary, like b=0.3; repeatable.
    domain : LO:HI,LO:HI
        Of a map: a range for each coordinate.
    workers : N
        Processes; default: one a core.
    cluster : URL
        Compute on a Dask cluster, by its scheduler's address: tcp://10.0.0.1:8786.
    refine
        Compute a coarse grid, then only points near boundaries of classes; fill the rest.
    coarse : N
        With --refine: the coarse grid has every N-th point of each axis.
    out : STORE
        The store (Zarr), ./NAME-atlas.zarr by default; one that was begun is continued.
    """
    from limitsets.parameters.atlas.classes import is_classified

    if task is not None:  # a file in the current folder can be imported, as with `python -m`
        sys.path.insert(0, str(Path.cwd()))
    chosen = subject(scene, set_)
    if isinstance(chosen, MapOfFile):
        of_map_alone({"--margin": margin, "--certify": certify or None, "--fitted": fitted})
        name, box = chosen.name, domain_of(chosen, domain)
        about: Any = chosen.one()
    else:
        name, about, box = stem_of(chosen), of_scene_alone(chosen, {"--domain": domain}), None
    machines = machines_of(fitted)
    about = about if machines is None else machines.on(about)
    store = run.out or Path(f"{name}-atlas.zarr")
    wanted = [name.strip() for words in variables or [] for name in words.split(",")]
    answers = ls.atlas(
        about,
        x,
        y,
        domain=box,
        task=task,
        variables=wanted or None,
        options=None if margin is None else {"margin": margin, "reading": reading},
        refine=refine,
        coarse=coarse,
        store=store,
        workers=workers,
        cluster=cluster,
        progress=run.tell,
    )
    last = [f"table: {run.csv}"] if run.csv is not None else []
    if is_classified(answers.dataset):
        picture = store.with_name(f"{store.name.removesuffix('.zarr')}.{run.form}")
        with saved(picture) as draft:
            ls.plot.atlas(answers, fitted=machines).savefig(draft, dpi=report.writing.DPI)
        last.append(f"figure: {picture}")
    if answers.model is not None:
        last.append(run.about(answers.model).line())
    if certify:
        proof = Path(f"{name}-regions.proof.zip")
        with processes(workers) as pool:
            regions = answers.certify(executor=pool, progress=run.tell)
        run.tell("certificate", 0, 1)
        regions.save(proof, workers=workers)
        shares = ", ".join(f"{100 * share:.2f} % {word}" for word, share in regions.shares().items())
        last.append(f"regions: {shares}: {proof}")
    return Answer(answers, lambda: [*_words_of_atlas(answers), *last], answers.table)


def _words_of_atlas(answers: Atlas) -> Iterator[str | Table]:
    """Show the classes, the ranges of the answers, and the store."""
    from limitsets.parameters.atlas.classes import is_classified, legend

    for each in legend(answers.dataset) if is_classified(answers.dataset) else ():
        yield f"{100 * each.share:6.2f} %  {each.words}"
    yield answers.tables()[0]
    chunks = f", {answers.kept} of its {answers.kept + answers.new} chunks by earlier runs"
    yield f"{answers.dataset['status'].size} points{chunks if answers.kept else ''}: {answers.store}"
