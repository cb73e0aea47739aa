"""A margin as text: a size with its unit, rounded to the safe side, and goals that hold vacuously."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal

from limitsets.errors import LimitsetsError
from limitsets.goals import Goal, OrientedBeyond
from limitsets.proofs.query import Outcome

NOT_FOUND = "it was not found"
"""How the reason begins where the search for a margin ends with an error."""


def bound(value: float | None, unit: str = "", *, up: bool = False) -> str:
    """Write a size with four digits, rounded so that it claims no more than is known; a dash for none.

    Examples
    --------
    >>> bound(0.395408203, "%"), bound(0.397675781, "%", up=True), bound(None)
    ('0.3954 %', '0.3977 %', '-')
    """
    if value is None:
        return "-"
    if value == 0:
        return f"0 {unit}".rstrip()
    context = Context(prec=4, rounding=ROUND_CEILING if up else ROUND_FLOOR)
    return f"{context.create_decimal(Decimal(repr(value))):f} {unit}".rstrip()


def failing(value: float | None, unit: str, direction: str | None) -> str:
    """Write from where on a goal is shown to fail, and whether at a greater or a smaller value of the quantity.

    Examples
    --------
    >>> failing(0.733543, "%", "less"), failing(0.107, "in", None), failing(None, "in", None)
    ('0.7336 % less', '0.107 in', '-')
    """
    return f"{bound(value, unit, up=True)} {direction or ''}".rstrip()


def failure(error: Exception) -> str:
    """Say which error a search ended with.

    Examples
    --------
    >>> failure(ZeroDivisionError())
    'it was not found: this is a bug in limitsets: ZeroDivisionError'
    """
    if isinstance(error, LimitsetsError):
        return f"{NOT_FOUND}: {error}"
    words = ": ".join(filter(None, (type(error).__name__, str(error))))
    return f"{NOT_FOUND}: this is a bug in limitsets: {words}"


def bound_above(value: float) -> str:
    """Write what is refuted from here on, without its unit."""
    return bound(value, up=True)


def reach_of(pieces: Sequence[Outcome]) -> float | None:
    """Say how far out the cells reach that attract in all of what was proved together; None where nothing was."""
    cells = [piece.found.cells.extents() for piece in pieces if piece.found is not None]
    return max((hi for each in cells for parts in each.values() for _, hi in parts), default=None)


def void_of(goals: Sequence[Goal], reach: float | None, unit: str) -> str:
    """Say which goal holds only because no part gets to where it is asked; empty where none does.

    Examples
    --------
    >>> void_of([OrientedBeyond(25.0, 2)], 23.41, "in")
    'no part gets beyond x = 25 in: the attracting cells end at x = 23.41 in'
    """
    limits = [goal.x for goal in goals if isinstance(goal, OrientedBeyond) and not goal.from_anywhere]
    for x in limits:
        if reach is not None and reach <= x:
            return f"no part gets beyond x = {x:g} {unit}: the attracting cells end at x = {reach:.7g} {unit}"
    return ""
