"""`limitsets design`: quantities for wanted critical points, for a large margin, or (`--goal`) for the scene's goal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.base.proposals import proposed
from limitsets.base.tables import Table
from limitsets.face import report
from limitsets.face.cli.arguments import bounds_of, laid_ranges, number
from limitsets.face.cli.commands import Answer, Run, Scene, Words, command, limits
from limitsets.face.cli.design_robust import designed, is_scene_file, of_margin, scene_file

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene as SceneOf
    from limitsets.feeder.scene.laid import LaidLike
    from limitsets.parameters.design import Design
    from limitsets.parameters.design.for_goal import GoalDesign


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
        return of_margin(run, chosen, names, evaluations=evaluations or 1200, **ways)
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
