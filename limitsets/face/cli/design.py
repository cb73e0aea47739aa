"""`limitsets design`: quantities for wanted critical points, for a large margin, or (`--goal`) for the scene's goal."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from limitsets.base.errors import LimitsetsError
from limitsets.base.files import as_json
from limitsets.base.proposals import proposed
from limitsets.face.cli.about import About
from limitsets.face.cli.arguments import HELP_LAID, HELP_NO_RECHECK, bounds_of, laid_ranges, number
from limitsets.face.cli.output import (
    Csv,
    Form,
    Format,
    Json,
    Scene,
    Words,
    answer,
    opened,
    option,
    progress,
    save_scene,
    scene_file,
    show,
    show_scene,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from limitsets.feeder.scene.laid import LaidLike
    from limitsets.parameters.design import Design
    from limitsets.parameters.design.for_goal import GoalDesign


# ----------------------------------------------------------------
# `limitsets design --goal`: a scene that meets its own goal, at the X that it asks for.


def run_goal(
    name: str,
    vary: Sequence[str],
    bounds: list[str] | None,
    laid: LaidLike | None,
    evaluations: int,
    out: Path | None,
    form: str,
    csv: Path | None,
    *,
    json: bool,
) -> int:
    """Search, prove, write and print; return the exit code."""
    with progress() as tell:
        from limitsets.parameters.design.for_goal import design_for_goal

        scene, _ = opened(name, None if out and out.suffix == ".toml" else out)
        given = bounds_of(scene, bounds)
        solution = design_for_goal(
            scene, vary=vary, bounds=given, laid=laid, evaluations=evaluations, progress=tell
        )
        about = About(solution.model, scene_file(solution.scene, out), solution.scene)
        files = [] if out is None else _written_of_goal(solution, out, form, about)
    answer(
        about.added(solution) if json else solution,
        json,
        lambda: _text_of_goal(solution, files, about, evaluations),
        csv=(csv, solution.table),
    )
    return 0 if solution.verdict == "proved" else 1


def _written_of_goal(solution: GoalDesign, out: Path, form: str, about: About) -> list[Path]:
    """Write the scene, or a folder with the scene, the answer as JSON and the part."""
    if out.suffix == ".toml":
        return save_scene(solution.scene, out)
    from limitsets.base.files import as_json
    from limitsets.face import plot
    from limitsets.face.report.writing import laid
    from limitsets.feeder.scene import dump

    texts = {
        f"{solution.scene.name}.toml": dump(solution.scene),
        "design.json": as_json(about.added(solution)),
    }
    return laid(out, [("part", plot.part(solution.scene))], lambda _: texts, form)


def _text_of_goal(solution: GoalDesign, files: list[Path], about: About, asked: int) -> None:
    from limitsets.parameters.design.for_goal import POPULATION

    show(solution.table())
    typer.echo(solution.message[:1].upper() + solution.message[1:] + ".")
    typer.echo(solution.itself)
    if solution.room > 0.0 and not any(name.startswith("part.") for name in solution.varied):
        typer.echo("arm and throw are enough: the part stays as it is")
    elif solution.evaluations < asked:
        whole = asked - solution.evaluations < POPULATION
        why = f"only whole generations of {POPULATION} are" if whole else "all designs came to rate alike"
        typer.echo(f"{solution.evaluations} of {asked} designs were looked at: {why}")
    met = solution.room > 0.0
    if met and solution.ruled_out:
        from limitsets.parameters.design.search import said

        typer.echo(
            f"{sum(solution.ruled_out.values())} of {solution.evaluations} designs were ruled out: "
            f"{said(solution.ruled_out)}"
        )
    if met and solution.leaving is not None:
        from limitsets.face.report.pages import percent

        typer.echo(
            f"careful: from {percent(solution.leaving)} of all starts (sampled) parts leave the arm; no design was"
            " found that meets the goal and that no part leaves, and margins of this one may be 0 by that"
        )
    if met and solution.verdict != "proved":
        file = next((str(path) for path in files if path.suffix == ".toml"), None)
        save = "" if file else "add -o design.toml to this command, then "
        command = proposed("certify", file or "design.toml")
        typer.echo(f"next: {save}{command} (what keeps the design from a proof)")
    show_scene(solution.scene, files, about if met else None)


# ----------------------------------------------------------------
# `limitsets design`: quantities of a scene for which its critical points are as wanted, or the margin large.


FREE = "free"

HELP_POINTS = "First critical point wanted on each side, like 10,10,20 or '25 cm',free,free."
HELP_ROBUST = (
    "Make the proved joint margin of [tolerance] large: only one side beyond X, and almost every orbit there."
)
HELP_GOAL = "Meet the scene's own goal, at the X that it asks for; bounds come by themselves."
HELP_VARY = "Quantities to vary, like part.mass.center.along,throw.speed; repeatable."
HELP_STARTS = "With --critical-points: other starts to draw at most."
HELP_STAGES = "With --critical-points: move them there in N steps, of which the figure shows twelve at most."
HELP_EVALUATIONS = "Designs to look at: with --robust 1200 by default, with --goal 600."
HELP_BOUNDS = (
    "Bounds of one of them, like part.mass.center.along='4 in':'5 in'; bare numbers are in the unit of the scene's "
    "text; either may be left out; repeatable."
)


def design(
    scene: Scene,
    critical_points: Annotated[str | None, option("--critical-points", "R,R,R", HELP_POINTS)] = None,
    robust: Annotated[bool, typer.Option("--robust", help=HELP_ROBUST)] = False,
    goal: Annotated[bool, typer.Option("--goal", help=HELP_GOAL)] = False,
    vary: Annotated[Words, option("--vary", "Q,Q", HELP_VARY)] = None,
    bounds: Annotated[Words, option("--bounds", "Q=LO:HI", HELP_BOUNDS)] = None,
    laid: Annotated[Words, option("--laid", "SIDE=LO:HI", f"With --goal or --robust: {HELP_LAID}")] = None,
    evaluations: Annotated[
        int | None, option("--evaluations", "N", HELP_EVALUATIONS, min=1, max=1_000_000)
    ] = None,
    seconds: Annotated[
        float, option("--seconds", "S", "With --robust: for the proof of each margin.", min=0.0)
    ] = 240.0,
    starts: Annotated[int, option("--starts", "N", HELP_STARTS, min=0, max=10_000)] = 8,
    stages: Annotated[int | None, option("--stages", "N", HELP_STAGES, min=1, max=1000)] = None,
    out: Annotated[
        Path | None,
        option("--out -o", "FILE", "NAME.toml for the scene; else a folder: scene, JSON and figure."),
    ] = None,
    form: Format = Form.PNG,
    csv: Csv = None,
    json: Json = False,
    no_recheck: Annotated[
        bool, typer.Option("--no-recheck", help=f"With --robust: {HELP_NO_RECHECK}")
    ] = False,
) -> None:
    """Find a scene whose critical points are as wanted, that meets its goal, or is fed in spite of large deviations.

    Exit 1 where none is found, or no margin is proved.
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
        raise LimitsetsError(
            "laid", laid, "with --goal or --robust", "critical points have no starts", key="--laid"
        )
    names = [name.strip() for words in vary or [] for name in words.split(",")]
    if goal:
        raise typer.Exit(
            run_goal(
                scene,
                names,
                bounds,
                laid=begins,
                evaluations=evaluations or 600,
                out=out,
                form=form,
                csv=csv,
                json=json,
            )
        )
    if critical_points is None:
        from limitsets.face.cli.design_robust import run_robust

        raise typer.Exit(
            run_robust(
                scene,
                names,
                bounds,
                laid=begins,
                evaluations=evaluations or 1200,
                seconds=seconds,
                out=out,
                form=form,
                csv=csv,
                json=json,
                recheck=not no_recheck,
            )
        )
    with progress() as tell:
        from limitsets.parameters.design import design as run

        chosen, _ = opened(scene, None if out and out.suffix == ".toml" else out)
        solution = run(
            chosen,
            critical_points=_points(critical_points),
            vary=names,
            bounds=bounds_of(chosen, bounds),
            starts=starts,
            stages=stages,
            progress=tell,
        )
        about = About(solution.model, scene_file(solution.scene, out), solution.scene)
        files = [] if out is None else _written(solution, out, form, about, tell)
    answer(
        about.added(solution) if json else solution,
        json,
        lambda: _text(solution, files, about),
        csv=(csv, solution.table),
    )
    raise typer.Exit(0 if solution.reached else 1)


def _points(words: str) -> list[float | str | None]:
    return [None if word.strip() == FREE else number(word) for word in words.split(",")]


def _written(
    solution: Design, out: Path, form: str, about: About, tell: Callable[[str, int, int], None]
) -> list[Path]:
    """Write the scene, or a folder with the scene, the answer as JSON and a figure of the design's path."""
    from limitsets.feeder.scene import dump

    if out.suffix == ".toml":
        return save_scene(solution.scene, out)
    from limitsets.face import plot
    from limitsets.face.report.writing import laid
    from limitsets.parameters.design import limit_sets_along

    drawn = plot.design(solution, limit_sets_along(solution, tell))
    texts = {
        f"{solution.scene.name}.toml": dump(solution.scene),
        "design.json": as_json(about.added(solution)),
    }
    return laid(out, [("part", plot.part(solution.scene)), ("design", drawn)], lambda _: texts, form)


def _text(solution: Design, files: list[Path], about: About) -> None:
    """Print the changed quantities, how well the critical points are reached, and the scene."""
    show(solution.table())
    typer.echo(solution.message[:1].upper() + solution.message[1:] + ".")
    condition = "not known" if solution.condition is None else f"{solution.condition:.4g}"
    typer.echo(
        f"{solution.evaluations} evaluations, {solution.how}; condition number of the derivatives: {condition}"
    )
    for side, reason in enumerate(solution.jacobian.reasons):
        if reason is not None:
            typer.echo(f"no derivative on side {side}: {reason}")
    show_scene(solution.scene, files, about if solution.reached else None)
