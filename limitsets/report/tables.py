"""Markdown: tables and numbers with units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from math import isfinite

Extents = Mapping[int, Sequence[tuple[float, float]]]


def table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Write a Markdown table.

    Examples
    --------
    >>> print(table(["side", "x"], [[0, 1.5]]))
    | side | x |
    |---|---|
    | 0 | 1.5 |
    """

    def line(cells: Sequence[object]) -> str:
        return "| " + " | ".join(str(cell) for cell in cells) + " |"

    return "\n".join([line(heads), "|" + "---|" * len(heads), *(line(row) for row in rows)])


def number(value: float | None, digits: int = 3) -> str:
    """Write a number with a fixed count of decimals, or a dash.

    Examples
    --------
    >>> number(19.7526), number(None)
    ('19.753', '-')
    """
    return "-" if value is None else f"{value:z.{digits}f}"


def percent(share: float) -> str:
    """Write a share; all and nothing are written only where they are meant.

    Examples
    --------
    >>> percent(1.0), percent(0.99999), percent(0.305)
    ('100 %', 'more than 99.9 %', '30.5 %')
    """
    if share >= 1 - 1e-9 or share == 0:
        return f"{100 * share:.0f} %"
    if share > 0.999 or share < 0.001:
        return "more than 99.9 %" if share > 0.5 else "less than 0.1 %"
    return f"{100 * share:.1f} %"


def count(least: int, most: int) -> str:
    """Write a range of whole numbers.

    Examples
    --------
    >>> count(3, 11), count(0, 0)
    ('3 to 11', '0')
    """
    return str(least) if least == most else f"{least} to {most}"


def in_time(throws: float | None, rate: float | None, *, parts: bool = False) -> str:
    """Write a number of throws in seconds, and as parts per minute one after the other; empty where no rate is known.

    Parameters
    ----------
    throws : float or None
        How many.
    rate : float or None
        Throws per second (`world.throw_rate`).
    parts : bool
        Whether a part is fed after so many.

    Examples
    --------
    >>> in_time(12.0, 2.0, parts=True), in_time(12.0, None)
    (' (6 s, 10 parts per minute)', '')
    """
    if throws is None or rate is None or not isfinite(throws) or throws <= 0.0:
        return ""
    minute = f", {60.0 * rate / throws:.3g} parts per minute" if parts else ""
    return f" ({throws / rate:.3g} s{minute})"


def intervals(parts: Iterable[tuple[float, float]], digits: int = 3) -> str:
    """Write intervals.

    Examples
    --------
    >>> intervals([(1.0, 2.0), (3.0, 4.5)], 1)
    '1.0 to 2.0, 3.0 to 4.5'
    """
    return ", ".join(f"{lo:z.{digits}f} to {hi:z.{digits}f}" for lo, hi in parts)


def bands(extents: Extents) -> list[tuple[float, float, tuple[int, ...]]]:
    """Cut the x axis where a side begins or ceases to occur: ``(lo, hi, sides)``, ascending; empty stretches left out.

    Examples
    --------
    >>> bands({0: [(1.0, 3.0)], 1: [(2.0, 4.0)]})
    [(1.0, 2.0, (0,)), (2.0, 3.0, (0, 1)), (3.0, 4.0, (1,))]
    """
    cuts = sorted({x for parts in extents.values() for pair in parts for x in pair})
    found = []
    for lo, hi in pairwise(cuts):
        middle = 0.5 * (lo + hi)
        sides = tuple(sorted(s for s, parts in extents.items() if any(a <= middle <= b for a, b in parts)))
        if sides:
            found.append((lo, hi, sides))
    return found
