"""Where parts are laid down: ranges of x by side, which take the place of the whole arm as the starts of a goal.

A place that is no binary number is rounded outward, so that the ranges hold all that was asked for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from limitsets.base import AnswerError, shown
from limitsets.feeder.goals import Goal, Laid
from limitsets.feeder.scene.units import exact_factor, parse

if TYPE_CHECKING:
    from limitsets.feeder.scene.scene import Scene


LaidLike = Mapping[int, Sequence[tuple[float | str, float | str]]]
"""By side the ranges of x: pairs of numbers in the scene's unit, or of texts with a unit."""

FORM = "by side a list of ranges, as in {0: [(8.0, 20.0)]}: numbers in the scene's unit, or texts with a unit"


def read_laid(scene: Scene, given: LaidLike | None, key: str = "laid") -> Laid:
    """Read the ranges in which parts are laid down, ascending by side and place; none are given: ().

    Raises
    ------
    AnswerError
        Another form, a side on which the part does not rest, a range that is empty or not on the arm.

    Examples
    --------
    >>> import limitsets as ls
    >>> read_laid(ls.load("paper-designed"), {2: [("20 cm", 20.0)], 0: [(8, 12), (10, 16)]})
    ((0, 8.0, 16.0), (2, 7.874015748031495, 20.0))
    """
    if given is None:
        return ()
    if not isinstance(given, Mapping) or not given:
        raise AnswerError("where parts are laid down", shown(given), FORM, "name a side and a range", key=key)
    spans: list[tuple[int, float, float]] = []
    for side, ranges in given.items():
        sides = [i for i, rests in enumerate(scene.sides.rests.tolist()) if rests]
        if isinstance(side, bool) or side not in sides:
            allowed = f"a side on which the part rests: {', '.join(map(str, sides))}"
            raise AnswerError("the side laid down on", shown(side), allowed, "name one of these", key=key)
        pairs = isinstance(ranges, list | tuple) and all(
            isinstance(pair, list | tuple) and len(pair) == 2 for pair in ranges
        )
        if not pairs or not ranges:
            raise AnswerError("where parts are laid down", shown(ranges), FORM, "write pairs", key=key)
        spans += [(int(side), *_ends(scene, side, lo, hi, key)) for lo, hi in ranges]
    joined: list[tuple[int, float, float]] = []
    for side, lo, hi in sorted(spans):
        if joined and joined[-1][0] == side and lo <= joined[-1][2]:
            joined[-1] = side, joined[-1][1], max(hi, joined[-1][2])
        else:
            joined.append((side, lo, hi))
    return tuple(joined)


def _ends(scene: Scene, side: int, lo: Any, hi: Any, key: str) -> tuple[float, float]:
    """Read one range, rounded outward."""
    low, high = _place(scene, lo, key), _place(scene, hi, key)
    foot, end = float(scene.sides.a[side]), scene.arm_length
    words = f"{lo} to {hi}"
    if not low < high:
        raise AnswerError("the range", words, "a lower end and a higher one", "turn them round", key=key)
    if not (foot < low and float(high) <= end):
        allowed = f"above {foot:.6g} {scene.unit}, where a part on side {side} tips over the joint, and up to"
        allowed = f"{allowed} the arm's end, {end:.9g} {scene.unit}"
        raise AnswerError("the range", words, allowed, "lay parts down on the arm", key=key)
    first, last = float(low), float(high)
    first = math.nextafter(first, -math.inf) if first > low else first
    return first, math.nextafter(last, math.inf) if last < high else last


def _place(scene: Scene, given: Any, key: str) -> Fraction:
    """Read a place: a number in the scene's unit, or a text with a unit."""
    if isinstance(given, str):
        number, unit = parse(given, "length", key=key)
        return Fraction(number) * exact_factor(unit, scene.unit)
    if isinstance(given, bool) or not isinstance(given, int | float) or not math.isfinite(given):
        raise AnswerError(
            "a place laid down at", shown(given), "a number, or text with a unit", FORM, key=key
        )
    return Fraction(given)


def laid_goal(goal: Goal, laid: Laid) -> Goal:
    """Ask a goal of the starts in some ranges alone.

    Raises
    ------
    AnswerError
        The goal's class has no field `laid`.
    """
    if not laid:
        return goal
    try:
        return replace(goal, laid=laid)
    except TypeError:
        allowed = "a goal whose class has a field laid"
        raise AnswerError("the goal", goal.kind, allowed, "add laid: Laid = () to it") from None


def laid_goals(scene: Scene, given: LaidLike | None) -> tuple[Scene, Laid]:
    """Ask a scene's own goal of the starts in the ranges given.

    Raises
    ------
    AnswerError
        The scene has no goal.
    """
    laid = read_laid(scene, given)
    if not laid:
        return scene, laid
    if scene.goal is None:
        remedy = "give the scene a goal: the starts are those of a goal"
        raise AnswerError("the goal", None, "a scene with [goal], where laid is given", remedy)
    return replace(scene, goal=laid_goal(scene.goal, laid)), laid
