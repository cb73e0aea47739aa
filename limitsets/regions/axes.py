"""The two quantities of a plane of parameters, and the borders of its cells: exact decimals, shared by neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

from limitsets.errors import AnswerError
from limitsets.proofs.tolerance import DIGITS
from limitsets.scene import Scene
from limitsets.scene.quantities import NOISE_ONLY, find
from limitsets.scene.units import parse


@dataclass(frozen=True)
class CellAxis:
    """A quantity and the borders of the cells along it.

    Attributes
    ----------
    quantity : str
        Its name.
    unit : str
        The unit of the borders.
    borders : tuple of Fraction, length n + 1
        Ascending, each a decimal of at most 25 places.
    """

    quantity: str
    unit: str
    borders: tuple[Fraction, ...]

    @classmethod
    def of(cls, quantity: str, borders: Sequence[str]) -> CellAxis:
        """Read the borders: decimals with one unit, ascending.

        Raises
        ------
        AnswerError
            Fewer than two, several units, or borders that do not ascend.
        """
        place = find(quantity)
        if quantity == NOISE_ONLY:
            raise AnswerError("the axis", quantity, "a quantity that a scene gives", "choose another one")
        read = [parse(text, place.dimension) for text in borders]
        values = tuple(Fraction(each.number) for each in read)
        units = {each.unit for each in read}
        ascending = all(a < b for a, b in pairwise(values))
        if len(values) < 2 or len(units) != 1 or not ascending:
            raise AnswerError(
                f"the borders of {quantity}",
                list(borders)[:3],
                "two at least, in one unit, ascending",
                'give texts like "150 deg/s"',
            )
        return cls(quantity, units.pop(), values)

    def refined(self, depth: int) -> CellAxis:
        """Halve every cell so many times."""
        borders = self.borders
        for _ in range(depth):
            middles = [(a + b) / 2 for a, b in pairwise(borders)]
            borders = tuple(sorted([*borders, *middles]))
        return CellAxis(self.quantity, self.unit, borders)

    def text(self, number: int) -> str:
        """Write one border, exactly."""
        return f"{_decimal(self.borders[number])} {self.unit}"

    def widths(self) -> list[float]:
        """Width of each cell, in the unit."""
        return [float(b - a) for a, b in pairwise(self.borders)]


def evenly(quantity: str, first: str, last: str, cells: int) -> CellAxis:
    """Cut a range of a quantity into cells of equal width, to the 12th place behind the comma.

    Examples
    --------
    >>> speed = evenly("throw.speed", "150 deg/s", "166 deg/s", 64)
    >>> speed.text(0), speed.text(1)
    ('150 deg/s', '150.25 deg/s')
    """
    ends = CellAxis.of(quantity, [first, last])
    low, high = ends.borders
    scale = 10**12
    borders = [Fraction(round((low + (high - low) * k / cells) * scale), scale) for k in range(1, cells)]
    return CellAxis.of(quantity, [f"{_decimal(value)} {ends.unit}" for value in (low, *borders, high)])


def _decimal(value: Fraction) -> str:
    """Write a decimal exactly; one that is none, or too long for a certificate, is refused."""
    scaled = value * 10**DIGITS
    if scaled.denominator != 1:
        raise AnswerError(
            "a border", float(value), f"a decimal of at most {DIGITS} places", "halve the cells fewer times"
        )
    digits = str(abs(scaled.numerator)).rjust(DIGITS + 1, "0")
    text = f"{digits[:-DIGITS]}.{digits[-DIGITS:]}".rstrip("0").rstrip(".")
    return f"-{text}" if value < 0 else text


def placed(scene: Scene, axes: Sequence[CellAxis]) -> Scene:
    """Write the scene in the quantities of the axes, each at its first border, so that a cell can stand in its place.

    Raises
    ------
    AnswerError
        One quantity twice, effects that no certificate can hold, or noise.
    """
    if len({axis.quantity for axis in axes}) < len(axes):
        raise AnswerError(
            "the axes", [axis.quantity for axis in axes], "two quantities", "choose another one"
        )
    if scene.effects.on():
        raise AnswerError(
            "the scene's effects", list(scene.effects.on()), "none", "regions are proved of the minimal model"
        )
    return scene.with_values({axis.quantity: axis.text(0) for axis in axes})
