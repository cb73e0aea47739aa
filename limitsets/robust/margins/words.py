"""A margin in words: a size with its unit, never rounded to more than is known."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal

__all__ = ["bound"]


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
