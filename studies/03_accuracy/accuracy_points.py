"""What all parts of the study share: a point of a figure, how seconds are measured, how exponents are fitted."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

__all__ = ["Point", "by_method", "exponent", "timed"]


class Point(NamedTuple):
    """One setting of one method.

    Attributes
    ----------
    method : str
        Name, as in the legend.
    size : float
        What the setting changes: cells, throws, steps, digits.
    error : float
        Against the reference.
    seconds : float
        The best of some repeats.
    """

    method: str
    size: float
    error: float
    seconds: float


def timed(run: Callable[[], Any], least: float = 0.2, most: int = 20, inner: int = 1) -> tuple[Any, float]:
    """Return what `run` gives and its seconds: the best of repeats, after one that is not counted and may compile.

    Repeats stop after `least` seconds in all, or `most` of them.  The machine may be busy with other things, and the
    best is what they disturb least; `inner` calls are timed at once where one is too short for the clock.
    """
    answer = run()
    best, spent, count = math.inf, 0.0, 0
    while count < 2 or (spent < least and count < most):
        begin = perf_counter()
        for _ in range(inner):
            run()
        took = perf_counter() - begin
        best, spent, count = min(best, took / inner), spent + took, count + 1
    return answer, best


def by_method(points: Iterable[Point]) -> dict[str, list[Point]]:
    """Points per method, in the order of their first one."""
    found: dict[str, list[Point]] = {}
    for point in points:
        found.setdefault(point.method, []).append(point)
    return found


def exponent(points: Iterable[Point], against: str = "size") -> float | None:
    """Slope of ln error against ln size (or ln seconds), None for fewer than three points or an exact method."""
    known = [point for point in points if point.error > 0 and math.isfinite(point.error)]
    if len(known) < 3:
        return None
    x = np.log([getattr(point, against) for point in known])
    return float(np.polyfit(x, np.log([point.error for point in known]), 1)[0])
