"""`limitsets design`: quantities for wanted critical points, for a large margin, or (`--goal`) for the scene's goal."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from math import isfinite
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

import limitsets as ls
from limitsets.base import Column, LimitsetsError, Table, as_json, picked, proposed
from limitsets.face import report
from limitsets.face.cli.arguments import bounds_of, laid_ranges, number
from limitsets.face.cli.commands import About, Answer, Run, Scene, Words, command, limits
from limitsets.face.cli.output import saved

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from limitsets.feeder.scene import LaidLike, Scene as SceneOf
    from limitsets.parameters.design import Design, RobustDesign
    from limitsets.parameters.design.for_goal import GoalDesign
    from limitsets.parameters.design.for_margin import NoDesignError


# ----------------------------------------------------------------
# The scene of a design: its file, or the scene itself on stdout.


def is_scene_file(run: Run) -> bool:
    """Whether --out is a file for the scene alone, and no folder."""
    return run.out is not None and run.out.suffix == ".toml"


def scene_file(run: Run, scene: SceneOf) -> str:
    """Name the file of a design; empty if none is written."""
    return "" if run.out is None else str(run.out if is_scene_file(run) else run.out / f"{scene.name}.toml")


def save_scene(scene: SceneOf, file: Path) -> None:
    """Write a scene alone."""
    with saved(file) as draft:
        draft.write_text(ls.dump(scene), encoding="utf-8", newline="\n")


def write_design(
    run: Run,
    scene: SceneOf,
    record: Callable[[], Any],
    drawn: Callable[[], Iterable[tuple[str, Figure]]] = tuple,
) -> None:
    """Write where --out says: the scene alone, or a folder with it, the answer as JSON, the part and more figures."""
    if run.out is None:
        return
    if is_scene_file(run):
        save_scene(scene, run.out)
        return
    texts = {f"{scene.name}.toml": ls.dump(scene), "design.json": record()}
    run.write([("part", ls.plot.part(scene)), *drawn()], texts)


def scene_words(run: Run, scene: SceneOf, about: About | None) -> Iterator[str]:
    """Name the file of a design, or give the design if there is no file.

    Without `about` it is a near miss only, and nothing is printed that looks like an answer.
    """
    file, run.files = scene_file(run, scene), []
    if about is not None:
        yield about.line()
    elif not file:
        yield "the values above are the nearest miss, no answer; add -o FILE.toml to save that scene"
        return
    if file:
        yield f"scene: {file}" + ("" if about else " (the nearest miss, no answer)")
    else:
        name = quote(f"{scene.name}.toml")
        yield f"scene (add -o {name} to save it):\n\n{ls.dump(scene)}".rstrip("\n")


def designed(
    run: Run,
    solution: Any,
    words: Iterable[str | Table],
    *,
    reached: bool = True,
    good: bool,
    drawn: Callable[[], Iterable[tuple[str, Figure]]] | None = tuple,
) -> Answer:
    """Write a design, where its files are not there yet (`drawn`), and answer: `words`, then its scene."""
    about = About(solution.model, scene_file(run, solution.scene), solution.scene)
    if drawn is not None:
        write_design(run, solution.scene, lambda: about.added(solution), drawn)
    return Answer(
        lambda: about.added(solution),
        lambda: [*words, *scene_words(run, solution.scene, about if reached else None)],
        solution.table,
        code=0 if good else 1,
    )


# ----------------------------------------------------------------
# `limitsets design`: which of the three is wanted.


FREE = "free"


@command(form=True)
def design(
    run: Run,
    scene: Scene,
    *,
    critical_points: str | None = None,
    robust: bool = False,
    goal: bool = False,
    vary: Words = None,
    bounds: Words = None,
    laid: Words = None,
    evaluations: Annotated[int | None, limits(min=1, max=1_000_000)] = None,
    seconds: Annotated[float, limits(min=0.0)] = 240.0,
    starts: Annotated[int, limits(min=0, max=10_000)] = 8,
    stages: Annotated[int | None, limits(min=1, max=1000)] = None,
    no_recheck: bool = False,
) -> Answer:
    """Find a scene whose critical points are as wanted, that meets its goal, or is fed in spite of large deviations.

    Exit 1 where none is found, or no margin is proved.

    Parameters
    ----------
    critical_points : R,R,R
        First critical point wanted on each side, like 10,10,20 or '25 cm',free,free.
    robust
        Make the proved joint margin of [tolerance] large: only one side beyond X, and almost every orbit
        there.
    goal
        Meet the scene's own goal, at the X that it asks for; bounds come by themselves.
    vary : Q,Q
        Quantities to vary, like part.mass.center.along,throw.speed; repeatable.
    bounds : Q=LO:HI
        Bounds of one of them, like part.mass.center.along='4 in':'5 in'; bare numbers are in the unit of the
        scene's text; either may be left out; repeatable.
    laid : SIDE=LO:HI
        With --goal or --robust: Where parts are laid down, like 0=8:20 or 0='8 in:20 in'; repeatable. The
        goal's starts are these; default: the whole arm.
    evaluations : N
        Designs to look at: with --robust 1200 by default, with --goal 600.
    seconds : S
        With --robust: for the proof of each margin.
    starts : N
        With --critical-points: other starts to draw at most.
    stages : N
        With --critical-points: move them there in N steps, of which the figure shows twelve at most.
    no_recheck
        With --robust: Write certificates without checking them first.
    out : FILE
        NAME.toml for the scene; else a folder: scene, JSON and figure.
    """
    wanted = (critical_points is not None) + robust + goal
    if wanted != 1:
        raise LimitsetsError(
            "the design",
            "nothing is wanted" if not wanted else "two things are wanted",
            "--critical-points R,R,R, --goal or --robust",
            "give one of them",
        )
    begins = laid_ranges(laid)
    if begins and critical_points is not None:
        allowed, remedy = "with --goal or --robust", "critical points have no starts"
        raise LimitsetsError("laid", laid, allowed, remedy, key="--laid")
    names = [name.strip() for words in vary or [] for name in words.split(",")]
    chosen = ls.load(scene) if is_scene_file(run) else run.opened(scene)
    ends = bounds_of(chosen, bounds)
    if goal:
        return _of_goal(run, chosen, names, bounds=ends, laid=begins, evaluations=evaluations or 600)
    if critical_points is None:
        ways: dict[str, Any] = {"bounds": ends, "laid": begins, "seconds": seconds, "recheck": not no_recheck}
        return _of_margin(run, chosen, names, evaluations=evaluations or 1200, **ways)
    from limitsets.parameters.design import limit_sets_along

    solution = ls.design(
        chosen,
        critical_points=[
            None if word.strip() == FREE else number(word) for word in critical_points.split(",")
        ],
        vary=names,
        bounds=ends,
        starts=starts,
        stages=stages,
        progress=run.tell,
    )
    return designed(
        run,
        solution,
        _text(solution),
        reached=solution.reached,
        good=solution.reached,
        drawn=lambda: [("design", ls.plot.design(solution, limit_sets_along(solution, run.tell)))],
    )


def _text(solution: Design) -> Iterator[str | Table]:
    """Show the changed quantities, and how well the critical points are reached."""
    yield solution.table()
    yield solution.message[:1].upper() + solution.message[1:] + "."
    condition = "not known" if solution.condition is None else f"{solution.condition:.4g}"
    yield f"{solution.evaluations} evaluations, {solution.how}; condition number of the derivatives: {condition}"
    for side, reason in enumerate(solution.jacobian.reasons):
        if reason is not None:
            yield f"no derivative on side {side}: {reason}"


# ----------------------------------------------------------------
# `limitsets design --goal`: a scene that meets its own goal, at the X that it asks for.


def _of_goal(
    run: Run, scene: SceneOf, vary: Sequence[str], evaluations: int, bounds: Any, laid: LaidLike | None
) -> Answer:
    """Search and prove."""
    from limitsets.parameters.design.for_goal import design_for_goal

    solution = design_for_goal(
        scene, vary=vary, bounds=bounds, laid=laid, evaluations=evaluations, progress=run.tell
    )
    words = _text_of_goal(run, solution, evaluations)
    return designed(run, solution, words, reached=solution.room > 0.0, good=solution.verdict == "proved")


def _text_of_goal(run: Run, solution: GoalDesign, asked: int) -> Iterator[str | Table]:
    from limitsets.parameters.design.for_goal import POPULATION

    yield solution.table()
    yield solution.message[:1].upper() + solution.message[1:] + "."
    yield solution.itself
    if solution.room > 0.0 and not any(name.startswith("part.") for name in solution.varied):
        yield "arm and throw are enough: the part stays as it is"
    elif solution.evaluations < asked:
        whole = asked - solution.evaluations < POPULATION
        why = f"only whole generations of {POPULATION} are" if whole else "all designs came to rate alike"
        yield f"{solution.evaluations} of {asked} designs were looked at: {why}"
    met = solution.room > 0.0
    if met and solution.ruled_out:
        from limitsets.parameters.design.search import said

        yield (
            f"{sum(solution.ruled_out.values())} of {solution.evaluations} designs were ruled out: "
            f"{said(solution.ruled_out)}"
        )
    if met and solution.leaving is not None:
        share = report.pages.percent(solution.leaving)
        yield (
            f"careful: from {share} of all starts (sampled) parts leave the arm; no design was"
            " found that meets the goal and that no part leaves, and margins of this one may be 0 by that"
        )
    if met and solution.verdict != "proved":
        save = "" if run.out else "add -o design.toml to this command, then "
        command = proposed("certify", scene_file(run, solution.scene) or "design.toml")
        yield f"next: {save}{command} (what keeps the design from a proof)"


# ----------------------------------------------------------------
# `limitsets design --robust`: the part for which the proved joint margin is large.


def _of_margin(
    run: Run,
    scene: SceneOf,
    vary: Sequence[str],
    *,
    bounds: Any,
    laid: LaidLike | None,
    evaluations: int,
    seconds: float,
    recheck: bool,
) -> Answer:
    """Search and prove."""
    from limitsets.parameters.design.for_margin import NoDesignError

    in_folder = run.out is not None and not is_scene_file(run)
    so_far = run.folder / f"{scene.name}-so-far.toml" if in_folder else run.out
    try:
        design = ls.robust_design(
            scene,
            vary=(dict.fromkeys(vary, (None, None)) | bounds) or None,
            laid=laid,
            evaluations=evaluations,
            prove=seconds,
            progress=run.tell,
            keep=None if so_far is None else lambda best: _kept(best, so_far),
        )
    except NoDesignError as none:
        if none.miss is None:
            raise
        return _missed(run, none, scene, none.miss)
    if in_folder and so_far is not None:
        design = _written(run, design, recheck=recheck)
        so_far.unlink(missing_ok=True)
    proved = seconds == 0.0 or all(margin.proved > 0.0 for margin in design.margins)
    return designed(run, design, _text_of_margin(design), good=proved, drawn=None if in_folder else tuple)


def _kept(best: SceneOf, file: Path) -> None:
    """Write the best design so far, for the case that the search is interrupted."""
    file.parent.mkdir(parents=True, exist_ok=True)
    save_scene(best, file)


def _missed(run: Run, none: NoDesignError, scene: SceneOf, miss: SceneOf) -> Answer:
    """Give the nearest miss, and the reasons for which designs were ruled out."""
    from limitsets.feeder.scene import in_unit_of, unit_of

    rows = [
        (name, *(in_unit_of(scene, name, one.value(name)) for one in (scene, miss)), unit_of(scene, name))
        for name in none.varied
    ]
    heads = ("quantity", Column("before", show=".6g"), Column("nearest miss", show=".6g"), "unit")
    table = Table(heads, rows, f"{scene.name}: no design that feeds")
    record = {"scene": miss.as_dict(), "message": str(none), **picked(none, "ruled_out", "evaluations")}
    write_design(run, miss, lambda: record)
    return Answer(record, lambda: [table, str(none), *scene_words(run, miss, None)], lambda: table, code=1)


def _written(run: Run, design: RobustDesign, *, recheck: bool) -> RobustDesign:
    """Write a folder with all files; return the design without the claims that the checker denies."""
    from limitsets.parameters.design.design_result import save

    with report.writing.filled(run.folder) as folder:
        design, paths = save(design, folder, recheck=recheck)
        record = About(design.model, str(run.folder / paths[0].name), design.scene).added(design)
        (folder / "design.json").write_text(as_json(record), encoding="utf-8", newline="\n")
        drawn = {"part": ls.plot.part(design.scene)}
        if design.front:
            drawn["front"] = ls.plot.robust_design(design)
        for name, figure in drawn.items():
            figure.savefig(folder / f"{name}.{run.form}", dpi=report.writing.DPI)
    return design


def _text_of_margin(design: RobustDesign) -> Iterator[str | Table]:
    """Print the changed quantities, both margins, the throws, the lead weight, and the scene."""
    from limitsets.parameters.design.design_result import both

    unit, rate, in_time = design.scene.unit, design.scene.world.throw_rate, report.pages.in_time
    yield design.table()
    for label, margins, sampled, feeding in (
        ("before", design.before_margins, design.before_sampled, design.before_feeding),
        ("design", design.margins, design.sampled, design.feeding),
    ):
        if sampled is None or not isfinite(sampled.x):
            yield f"{label}: fed at no X in spite of any deviation"
            continue
        margin = f"joint margin by floats {sampled.margin:.4g} times the tolerance"
        yield f"{label}: X = {sampled.x:.4g} {unit}, {margin}"
        for one in margins:
            fails = "" if one.refuted is None else f", shown to fail from {one.refuted:.4g}"
            yield f"  {one.goals[0].kind}: proved up to {one.proved:.4g}{fails}"
        if feeding is not None:
            yield (
                f"  throws to feed (sampled): mean {feeding.mean:.3g}{in_time(feeding.mean, rate, parts=True)},"
                f" 95 % after {feeding.quantile_95:.3g}{in_time(feeding.quantile_95, rate)}"
            )
    asked = getattr(design.before.goal, "x", None)
    if asked is not None and asked != design.x:
        yield f"the goal's X has moved from {asked:g} to {design.x:g} {unit} (design --goal keeps it)"
    (fell, _), (least, _) = both(design.before_margins), both(design.margins)
    if fell is not None and least is not None and least < fell:
        yield (
            f"careful: what is proved fell, from {fell:.4g} to {least:.4g} times the tolerance: the design is better"
            " by floats alone"
        )
    moved = any(name.startswith("part.") for name in design.varied)
    if moved and "center" in design.scene.text["part"]["mass"]:  # else the file has the masses, or they stay
        lead = design.lead
        yield (
            f"lead weight: {100 * lead.share:.1f} % of the mass at x = {lead.x:.4g}, y = {lead.y:.4g} {unit}"
            " in the frame of the vertices"
        )
