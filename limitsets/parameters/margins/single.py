"""Margins of one quantity at a time, proved and refuted; and as functions of X: where to let the arm end.

With growing X the slack to parts on other sides grows, and the slack of the wanted side falls.  Every X therefore has
two goals: beyond X only the wanted side, and almost every orbit comes to rest on that side beyond X.  The margin is
largest between the two limits.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, overload

import numpy as np

from limitsets.base import (
    AnswerError,
    Column,
    Progress,
    Table,
    Tabled,
    arguments_checked_as,
    as_table,
    picked,
    shown_in_notebooks,
)
from limitsets.base.arrays import Array
from limitsets.feeder.goals import Goal, OrientedBeyond, Predicate, Reaches, unknown_goal
from limitsets.feeder.scene import LaidLike, Scene, laid_goal, load, read_laid
from limitsets.parameters.margins.brackets import Bracket, bracket_fixed, bracket_per_throw
from limitsets.parameters.margins.deviations import (
    DeviationScale,
    Tolerance,
    deviation_scale,
    deviation_scales,
)
from limitsets.parameters.margins.joint import joint_margin
from limitsets.parameters.margins.margin_result import Margin, bound, bound_above, failure
from limitsets.parameters.margins.of_map import MarginOfMap, margins_of_map, require_width
from limitsets.proofs.prover.certifying import require_none
from limitsets.proofs.prover.query import Outcome, Query
from limitsets.systems.cells import Grid

# ----------------------------------------------------------------
# Margins: how much a quantity may deviate before a goal fails, as a bracket that is proved and refuted.
#
# `proved` is the largest symmetric deviation for which a certificate can be written; `refuted` the smallest for which
# an orbit is proved to violate the goal.  Floats only propose both.


GoalLike = Goal | Callable[..., Any]


def goals_of(
    scene: Scene, goal: GoalLike | Sequence[GoalLike] | None, laid: LaidLike | None = None
) -> tuple[Goal, ...]:
    """Read what is asked: the scene's goal, another, several, or a function; of all starts or of those laid down."""
    ranges = read_laid(scene, laid)
    asked = scene.goal if goal is None else goal
    if asked is None:
        raise AnswerError("the goal", None, "a scene with [goal], or goal=", "say what has to hold")
    several = list(asked) if isinstance(asked, Sequence) else [asked]
    goals: list[Goal] = []
    for one in several:
        if isinstance(one, Goal):
            goals.append(one)
        elif callable(one):
            goals.append(Predicate(one, getattr(one, "__name__", "the predicate")))
        else:
            raise unknown_goal(one)
    if not goals:
        raise AnswerError("the goal", "no goals", "one at least", "name one")
    return tuple(laid_goal(each, ranges) for each in goals)


@overload
def margin(
    scene: Scene | str | Path,
    *quantities: str,
    reading: str | None = None,
    goal: GoalLike | Sequence[GoalLike] | None = None,
    laid: LaidLike | None = None,
    noise: Mapping[str, str] | None = None,
    width: float = 0.01,
    progress: Progress | None = None,
) -> tuple[Margin, ...]: ...
@overload
def margin(
    scene: tuple[Any, ...],
    *quantities: str | Grid,
    ends: Any,
    starts: Any = None,
    width: float = 0.01,
    progress: Progress | None = None,
) -> tuple[MarginOfMap, ...]: ...
def margin(
    scene: Any,
    *quantities: Any,
    reading: str | None = None,
    goal: GoalLike | Sequence[GoalLike] | None = None,
    laid: LaidLike | None = None,
    noise: Mapping[str, str] | None = None,
    ends: Any = None,
    starts: Any = None,
    width: float = 0.01,
    progress: Progress | None = None,
) -> tuple[Margin, ...] | tuple[MarginOfMap, ...]:
    """Bracket how much quantities of a scene, or parameters of a map, may deviate before a goal fails.

    Parameters
    ----------
    scene : Scene, str, Path, or NamedTuple
        A scene, or what `limitsets.load` takes; or a map.
    *quantities : str
        Names of quantities; "joint" for all of the scene's tolerance at once.  Default: all that the scene gives, in
        both readings, and joint if there is a tolerance.  Of a map: its grid, then names of parameters, by default all.
    reading : str, optional
        "fixed" but unknown, or "per-throw": another value at every throw, of throw.speed, gravity.tilt and landing.x.
        Default: "fixed", and "per-throw" of landing.x.
    goal : Goal, callable, or a sequence of them, optional
        What has to hold, all of it; default the scene's goal.  A function is taken as `limitsets.goals.Predicate`.
    laid : mapping of int to sequence of (float, float), optional
        By side the ranges of x where parts are laid down, as for `limitsets.certify`: the goal's starts are these.
        Default: the whole arm.
    noise : mapping of str to str, optional
        ``{"throw.speed": "0.3 %"}``: what differs at every throw beside the tolerance of "joint", and as many times it.
    ends, starts : sequence of boxes
        Of a map: its goal, that every start in `starts` ends in `ends` and stays, as for `limitsets.certify`.
    width : float
        How close the two ends of a bracket have to be, as a share of the upper one.
    progress : callable, optional
        Called with what is done, how much of it, and of how much.

    Returns
    -------
    tuple of Margin, or of MarginOfMap
        One per quantity and reading.  Of several, one whose search ends with an error has nothing proved, and the error
        as its reason.

    Raises
    ------
    AnswerError
        No goal, a quantity or a reading that the scene does not have, effects of which nothing is proved, or arguments
        for maps beside a scene or the reverse.

    Notes
    -----
    Margins of a scene that scatters its throws are those of the scene without its scatter.

    Examples
    --------
    >>> import limitsets as ls
    >>> (speed,) = ls.margin("paper-designed", "throw.speed")
    >>> speed.proved < 0.733 < speed.refuted, speed.unit
    (True, '%')
    >>> logistic, line = ls.maps.Logistic(2.5), ls.grid([(0.1, 0.9)], cells=512)
    >>> (r,) = ls.margin(logistic, line, "r", ends=[[(0.5, 0.7)]], starts=[[(0.2, 0.8)]])
    >>> 0.4 < r.proved < 0.5 < r.refuted < 0.51, r.direction  # below r = 2 the fixed point 1 - 1/r lies below 0.5
    (True, 'less')
    """
    if isinstance(scene, tuple | type):
        require_none(
            {"reading": reading, "goal": goal, "laid": laid, "noise": noise}, "margin", "beside a map"
        )
        given = quantities or (None,)  # which is then refused as the grid
        return margins_of_map(scene, *given, ends=ends, starts=starts, width=width, progress=progress)
    require_none({"ends": ends, "starts": starts}, "margin", "beside a scene")
    return margin_scene(
        scene, *quantities, reading=reading, goal=goal, laid=laid, noise=noise, width=width, progress=progress
    )


@shown_in_notebooks
@arguments_checked_as("margin")
def margin_scene(
    scene: Scene | str | Path,
    *quantities: str,
    reading: str | None = None,
    goal: GoalLike | Sequence[GoalLike] | None = None,
    laid: LaidLike | None = None,
    noise: Mapping[str, str] | None = None,
    width: float = 0.01,
    progress: Progress | None = None,
) -> tuple[Margin, ...]:
    """Bracket margins of a scene; called by `limitsets.margin`, which says what the arguments are."""
    require_width(width)
    loaded = load(scene)
    goals = goals_of(loaded, goal, laid)
    query = Query.of(loaded, goals)
    query.box(None, {})  # refuses a scene of which nothing can be proved
    todo: list[DeviationScale | str] = [
        name if name == "joint" else deviation_scale(query.scene, name, reading)
        for name in dict.fromkeys(quantities)
    ]
    if not todo:
        todo += deviation_scales(query.scene, reading)
        todo += ["joint"] if loaded.tolerance and reading is None else []
    margins = []
    for number, one in enumerate(todo):
        label = one if isinstance(one, str) else f"{one.quantity} {one.reading}"

        def tell(share: float, label: str = label, number: int = number) -> None:
            if progress is not None:
                progress(f"margin of {label}, {100 * share:.0f} %", number, len(todo))

        tell(0.0)
        try:
            if isinstance(one, str):
                answer = joint_margin(loaded, goals, noise=noise, width=width, tell=tell)
            else:
                answer = _single(query, one, Fraction(repr(width)), tell)
        except Exception as error:
            if len(todo) == 1:
                raise
            answer = _failed(query, one, dict(loaded.text.get("tolerance", {})), failure(error))
        margins.append(answer)
    return tuple(margins)


def _failed(query: Query, one: DeviationScale | str, tolerance: dict[str, str], reason: str) -> Margin:
    """Return what is left of a margin whose search ended with an error."""
    if isinstance(one, DeviationScale):
        return _of_bracket(query, one, Bracket(reason=reason), Fraction(1), 0.0)
    return Margin(
        quantity="joint",
        reading="tolerance",
        goals=query.goals,
        proved=0.0,
        refuted=None,
        unit="",
        nominal=None,
        reason=reason,
        closed=False,
        seconds=0.0,
        scene=query.scene,
        tolerance=tolerance,
        deviations={},
        noise={},
        pieces=(),
        against=None,
    )


def _single(query: Query, one: DeviationScale, width: Fraction, tell: Callable[[float], None]) -> Margin:
    begin = time.perf_counter()
    nominal = query.prove()
    if nominal.verdict != "proved":
        bracket = _of_none(query, nominal)
    else:
        search = bracket_fixed if one.reading == "fixed" else bracket_per_throw
        bracket = search(query, one, width, tell)
    return _of_bracket(query, one, bracket, width, time.perf_counter() - begin)


def _of_bracket(
    query: Query, one: DeviationScale, bracket: Bracket, width: Fraction, seconds: float
) -> Margin:
    alone = Tolerance.alone(one)
    return Margin(
        quantity=one.quantity,
        reading=one.reading,
        goals=query.goals,
        proved=float(bracket.proved),
        refuted=None if bracket.refuted is None else float(bracket.refuted),
        unit=one.unit,
        nominal=one.about,
        reason=bracket.reason,
        closed=bracket.closed(width),
        seconds=seconds,
        scene=query.scene,
        tolerance={},
        deviations=alone.texts(bracket.proved) if bracket.proved else {},
        noise=alone.noise(bracket.proved) if bracket.proved else {},
        pieces=tuple(bracket.pieces),
        against=bracket.against,
        direction=("more" if bracket.sign > 0 else "less")
        if one.reading == "fixed" and bracket.refuted
        else None,
    )


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


# ----------------------------------------------------------------
# Margins as functions of X, for "beyond X only one side": where to let the arm end.


@dataclass(frozen=True, eq=False)
class MarginsBeyond(Tabled):
    """Brackets of margins at several X.

    Attributes
    ----------
    scene : Scene
        The scene.
    side : int
        The side wanted.
    x : ndarray, shape (n,)
        Places, ascending [length].
    names : tuple of str
        Quantity and reading of each margin.
    units : tuple of str
        Their units.
    proved, refuted : ndarray, shape (n, names)
        The brackets; refuted is nan where nothing is.
    margins : tuple of tuple of Margin
        The same with their proofs, by place.
    """

    scene: Scene
    side: int
    x: Array
    names: tuple[str, ...]
    units: tuple[str, ...]
    proved: Array
    refuted: Array
    margins: tuple[tuple[Margin, ...], ...]

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        bounds = [
            Column(f"{name} {word}", unit, show)
            for name, unit in zip(self.names, self.units, strict=True)
            for word, show in (("proved", bound), ("refuted", bound_above))
        ]
        rows = [
            (x, *(end for pair in zip(low, high, strict=True) for end in pair))
            for x, low, high in zip(self.x.tolist(), self.proved.tolist(), self.refuted.tolist(), strict=True)
        ]
        caption = f"{self.scene.name}: margins of side {self.side} beyond X"
        columns = (Column("X", self.scene.unit, ".6g"), *bounds)
        return (Table(columns, rows, caption, "brackets: proved below, refuted above"),)

    def to_json(self) -> dict[str, Any]:
        """Give them as a plain table for JSON, without the proofs; null where nothing is refuted."""
        places = picked(self, "side", "x")
        return as_table(**places, quantities=self.names, **picked(self, "units", "proved", "refuted"))

    def best(self, name: str | None = None) -> tuple[float, float]:
        """Return the place with the largest proved margin, and that margin; of the first quantity by default."""
        k = 0 if name is None else self.names.index(name)
        at = int(np.argmax(self.proved[:, k]))
        return float(self.x[at]), float(self.proved[at, k])


@shown_in_notebooks
def margins_beyond(
    scene: Scene | str | Path,
    side: int,
    quantities: Sequence[str] = ("throw.speed",),
    *,
    x: Sequence[float] | None = None,
    places: int = 9,
    tolerance: Mapping[str, str] | None = None,
    laid: LaidLike | None = None,
    width: float = 0.05,
    seconds: float = 30.0,
    progress: Progress | None = None,
) -> MarginsBeyond:
    """Bracket margins of "beyond X only this side, and almost every orbit comes there" at several X.

    Parameters
    ----------
    scene : Scene, str or Path
        A scene, or what `limitsets.load` takes.
    side : int
        The side wanted.
    quantities : sequence of str
        Each fixed but unknown, landing.x at every throw; "joint" for the tolerance.
    x : sequence of float, optional
        Places; default `places` of them between the farthest that the limit set gets on other sides and on this one.
    places : int
        How many.
    tolerance : mapping of str to str, optional
        For "joint"; default the scene's.
    laid : mapping of int to sequence of (float, float), optional
        Where parts are laid down, as for `limitsets.certify`; default the whole arm.
    width : float
        Of the brackets.
    seconds : float
        For each proof of "joint".
    progress : callable, optional
        Called with what is done, how much of it, and of how much.

    Raises
    ------
    AnswerError
        The limit set gets farther on another side than on this one.

    Examples
    --------
    >>> margins_beyond("paper-designed", 2, x=[20.0]).proved[:, 0].round(1).tolist()
    [0.7]
    """
    loaded = load(scene)
    at = np.sort(np.asarray(places_beyond(loaded, side, places) if x is None else x, dtype=float))
    rows: list[tuple[Margin, ...]] = []
    for number, place in enumerate(at.tolist()):
        if progress is not None:
            progress(f"margins beyond x = {place:.4g}", number, at.size)
        goals = goals_of(loaded, (OrientedBeyond(place, side), Reaches(place, side)), laid)
        rows.append(tuple(_one(loaded, name, goals, tolerance, width, seconds) for name in quantities))
    names = tuple(one.quantity for one in rows[0])
    proved = np.array([[one.proved for one in row] for row in rows])
    refuted = np.array([[np.nan if one.refuted is None else one.refuted for one in row] for row in rows])
    return MarginsBeyond(
        scene=loaded,
        side=side,
        x=at,
        names=names,
        units=tuple(one.unit for one in rows[0]),
        proved=proved,
        refuted=refuted,
        margins=tuple(rows),
    )


def _one(
    scene: Scene,
    name: str,
    goals: tuple[Goal, ...],
    tolerance: Mapping[str, str] | None,
    width: float,
    seconds: float,
) -> Margin:
    if name == "joint":
        return joint_margin(scene, goals, tolerance, width=width, seconds=seconds)
    (answer,) = margin(scene, name, goal=goals, width=width)
    return answer


def places_beyond(scene: Scene, side: int, places: int) -> Array:
    """Return places between the farthest that the limit set gets on other sides and on this one, as many as asked."""
    extents = Query.of(scene, (OrientedBeyond(0.0, side),)).cells(None, 2).cells.extents()
    highest = {s: max(hi for _, hi in parts) for s, parts in extents.items() if parts}
    others = max((top for s, top in highest.items() if s != side), default=0.0)
    own = highest.get(side, -np.inf)
    if not others < own:
        farthest = max(highest, key=lambda s: highest[s], default=side)
        raise AnswerError(
            "the side",
            side,
            f"the one that the limit set gets farthest out on, {farthest}",
            "ask about that one",
        )
    return np.linspace(others, own, places + 2)[1:-1]
