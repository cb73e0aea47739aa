"""Searches along sizes: two that are told apart, brought together; sizes a little beyond one that is known."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction

from limitsets.robust.margins.deviations import short


def halved(
    low: Fraction,
    high: Fraction,
    is_low: Callable[[Fraction], bool],
    width: Fraction,
    least: Fraction = Fraction(0),
    rounded: Callable[[Fraction], Fraction] = short,
    stop: Callable[[], bool] = lambda: False,
) -> tuple[Fraction, Fraction]:
    """Bring two sizes together, until they differ by a share of the higher one at most.

    Parameters
    ----------
    low, high : Fraction
        The sizes.
    is_low : callable
        Whether a size between them takes the place of the lower one, or of the higher one.
    width : Fraction
        The share.
    least : Fraction
        A higher size of at most this is near enough to 0.
    rounded : callable
        Makes of a size one that people can read.
    stop : callable
        Whether to leave them as they are now.

    Examples
    --------
    >>> halved(Fraction(0), Fraction(2), lambda x: x * x < 2, Fraction(1, 4))
    (Fraction(5, 4), Fraction(3, 2))
    """
    while high - low > width * high and high > least and not stop():
        middle = rounded((low + high) / 2)
        low, high = (middle, high) if is_low(middle) else (low, middle)
    return low, high


def a_little_beyond(size: Fraction, share: Fraction, count: int) -> Iterator[Fraction]:
    """Yield sizes from one on: beyond it by shares 0, 1, 3, 7 and so on of a small one.

    Examples
    --------
    >>> [float(size) for size in a_little_beyond(Fraction(2), Fraction(1, 100), 4)]
    [2.0, 2.02, 2.06, 2.14]
    """
    for k in range(count):
        yield size * (1 + share * (2**k - 1))
