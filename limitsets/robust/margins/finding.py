"""Margins: how much a quantity may deviate before a goal fails, as a bracket that is proved and refuted.

`proved` is the largest symmetric deviation for which a certificate can be written; `refuted` the smallest for which an
orbit is proved to violate the goal.  Floats only propose both.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from limitsets.arguments import arguments_checked
from limitsets.errors import AnswerError
from limitsets.goals import Goal, Predicate, unknown_goal
from limitsets.progress import shown_in_notebooks
from limitsets.proofs.query import Outcome, Query
from limitsets.robust.margins.brackets import Bracket, bracket_fixed, bracket_per_throw
from limitsets.robust.margins.deviations import DeviationScale, deviation_scale, deviation_scales
from limitsets.robust.margins.joint import joint_margin
from limitsets.robust.margins.margin_result import Margin
from limitsets.robust.margins.margin_texts import failure
from limitsets.scene import Scene, load
from limitsets.scene.laid import LaidLike, laid_goal, read_laid
from limitsets.scene.units import exact_factor

Progress = Callable[[str, int, int], None]
GoalLike = Goal | Callable[..., Any]


def goals_of(
    scene: Scene, goal: GoalLike | Sequence[GoalLike] | None, laid: LaidLike | None = None
) -> tuple[Goal, ...]:
    """Read what is asked: the scene's goal, another, several, or a function; of all starts or of those laid down."""
    ranges = read_laid(scene, laid)
    return tuple(laid_goal(each, ranges) for each in _goals_of(scene, goal))


def _goals_of(scene: Scene, goal: GoalLike | Sequence[GoalLike] | None) -> tuple[Goal, ...]:
    if goal is None:
        if scene.goal is None:
            raise AnswerError("the goal", None, "a scene with [goal], or goal=", "say what has to hold")
        return (scene.goal,)
    several = list(goal) if isinstance(goal, Sequence) else [goal]
    found: list[Goal] = []
    for one in several:
        if isinstance(one, Goal):
            found.append(one)
        elif callable(one):
            found.append(Predicate(one, getattr(one, "__name__", "the predicate")))
        else:
            raise unknown_goal(one)
    if not found:
        raise AnswerError("the goal", "no goals", "one at least", "name one")
    return tuple(found)


@shown_in_notebooks
@arguments_checked
def margin(
    scene: Scene | str | Path,
    *quantities: str,
    reading: str | None = None,
    goal: GoalLike | Sequence[GoalLike] | None = None,
    laid: LaidLike | None = None,
    width: float = 0.01,
    progress: Progress | None = None,
) -> tuple[Margin, ...]:
    """Bracket how much quantities may deviate before a goal fails.

    Parameters
    ----------
    scene : Scene, str or Path
        A scene, or what `limitsets.load` takes.
    *quantities : str
        Names of quantities; "joint" for all of the scene's tolerance at once.  Default: all that the scene gives, in
        both readings, and joint if there is a tolerance.
    reading : str, optional
        "fixed" but unknown, or "per-throw": another value at every throw, of throw.speed, gravity.tilt and landing.x.
        Default: "fixed", and "per-throw" of landing.x.
    goal : Goal, callable, or a sequence of them, optional
        What has to hold, all of it; default the scene's goal.  A function is taken as `limitsets.goals.Predicate`.
    laid : mapping of int to sequence of (float, float), optional
        By side the ranges of x where parts are laid down, as for `limitsets.certify`: the goal's starts are these.
        Default: the whole arm.
    width : float
        How close the two ends of a bracket have to be, as a share of the upper one.
    progress : callable, optional
        Called with what is done, how much of it, and of how much.

    Returns
    -------
    tuple of Margin
        One per quantity and reading.  Of several, one whose search ends with an error has nothing proved, and the error
        as its reason.

    Raises
    ------
    AnswerError
        No goal, a quantity or a reading that the scene does not have, or effects of which nothing is proved.

    Notes
    -----
    Margins of a scene that scatters its throws are those of the scene without its scatter.

    Examples
    --------
    >>> import limitsets as ls
    >>> (speed,) = ls.margin("paper-designed", "throw.speed")
    >>> speed.proved < 0.733 < speed.refuted, speed.unit
    (True, '%')
    """
    loaded = load(scene)
    if not 1e-4 <= width < 1:
        raise AnswerError("the width", width, "from 0.0001 to below 1", "0.01 is a hundredth")
    goals = goals_of(loaded, goal, laid)
    query = Query.of(loaded, goals)
    query.box(None, {})  # refuses a scene of which nothing can be proved
    names: tuple[str, ...] = tuple(dict.fromkeys(quantities))
    todo: list[DeviationScale | str] = []
    if names:
        todo = [name if name == "joint" else deviation_scale(query.scene, name, reading) for name in names]
    else:
        todo = [*deviation_scales(query.scene, reading)]
        todo += ["joint"] if loaded.tolerance and reading is None else []
    found = []
    for number, one in enumerate(todo):
        label = one if isinstance(one, str) else f"{one.quantity} {one.reading}"

        def tell(share: float, label: str = label, number: int = number) -> None:
            if progress is not None:
                progress(f"margin of {label}, {100 * share:.0f} %", number, len(todo))

        tell(0.0)
        try:
            if isinstance(one, str):
                answer = joint_margin(loaded, goals, width=width, tell=tell)
            else:
                answer = _single(query, one, Fraction(repr(width)), tell)
        except Exception as error:
            if len(todo) == 1:
                raise
            answer = _failed(query, one, dict(loaded.text.get("tolerance", {})), failure(error))
        found.append(answer)
    return tuple(found)


def _failed(query: Query, one: DeviationScale | str, tolerance: dict[str, str], reason: str) -> Margin:
    """Return what is left of a margin whose search ended with an error."""
    if isinstance(one, DeviationScale):
        return _of_bracket(query, one, Bracket(reason=reason), Fraction(1), 0.0)
    about = "joint", "tolerance", query.goals, 0.0, None, "", None, reason, False, 0.0
    return Margin(*about, query.scene, tolerance, {}, {}, (), None)


def _single(query: Query, one: DeviationScale, width: Fraction, tell: Callable[[float], None]) -> Margin:
    begin = time.perf_counter()
    nominal = query.prove()
    if nominal.verdict != "proved":
        found = _of_none(query, nominal)
    else:
        search = bracket_fixed if one.reading == "fixed" else bracket_per_throw
        found = search(query, one, width, tell)
    return _of_bracket(query, one, found, width, time.perf_counter() - begin)


def _of_bracket(query: Query, one: DeviationScale, found: Bracket, width: Fraction, seconds: float) -> Margin:
    return Margin(
        one.quantity,
        one.reading,
        query.goals,
        float(found.proved),
        None if found.refuted is None else float(found.refuted),
        one.unit,
        _nominal(one),
        found.reason,
        found.closed(width),
        seconds,
        query.scene,
        {},
        *_texts(one, found.proved),
        tuple(found.pieces),
        found.against,
        None if one.reading != "fixed" or not found.refuted else "more" if found.sign > 0 else "less",
    )


def _texts(one: DeviationScale, size: Fraction) -> tuple[dict[str, str], dict[str, str]]:
    """Say what is fixed but unknown, and what differs at every throw."""
    if not size:
        return {}, {}
    said = {one.quantity: one.text(size)}
    return (said, {}) if one.reading == "fixed" else ({}, said)


def _nominal(one: DeviationScale) -> float | None:
    """Give the value; of a length or an angle in the unit of its deviation."""
    if one.key != one.quantity or one.quantity == "landing.x":
        return None
    return float(one.nominal if one.relative else one.nominal * exact_factor(one.given.unit, one.unit))


def _of_none(query: Query, nominal: Outcome) -> Bracket:
    """Answer for a scene that does not have the goal as it is: no deviation is small enough."""
    against = query.refute()
    if against.verdict == "refuted":
        reason = f"the goal fails in the scene as it is: {against.reason}"
        return Bracket(Fraction(0), Fraction(0), [], against, reason)
    laid = any(goal.laid for goal in query.goals)
    starts = "where parts are laid down" if laid else "on the arm, beyond the limit set"
    needed = f"a margin needs the goal proved of the scene as it is for every start {starts}"
    return Bracket(reason=f"{needed}: {nominal.reason}")
