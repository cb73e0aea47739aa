"""Quantities in text: a decimal number and a unit from a fixed list.

The number is read by a regular expression and only the unit is handed to pint, which would read "5,75 in" as 575 in,
never come back from "9**9**9 in" and let 1/s pass as rad/s.  Conversions are exact fractions up to one last rounding;
a value in the unit asked for is the float of its text.
"""

from __future__ import annotations

import difflib
import math
import re
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

from limitsets.errors import SceneError

__all__ = ["UNITS", "Quantity", "convert", "exact_factor", "parse", "written"]

UNITS: dict[str, tuple[str, ...]] = {
    "length": ("m", "cm", "mm", "in", "ft"),
    "angle": ("deg", "rad"),
    "angular speed": ("deg/s", "rad/s"),
    "acceleration": ("m/s^2", "cm/s^2", "mm/s^2", "in/s^2", "ft/s^2"),
    "mass": ("kg", "g", "lb"),
    "mass per area": ("kg/m^2",),
    "share": ("%",),
}
"""The units a scene may use, by dimension."""

_EXAMPLES = {
    "length": "5.75 in",
    "angle": "30 deg",
    "angular speed": "158 deg/s",
    "acceleration": "193.045 in/s^2",
    "mass": "20 g",
    "mass per area": "1.5 kg/m^2",
    "share": "1 %",
}
_NUMBER = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
_QUANTITY = re.compile(rf"({_NUMBER})(?: +|(?=%))([^\s].*)")
_LONGEST = 64
_SMALLEST, _LARGEST = 1e-300, 1e12

# pint's own 900 definitions take 0.4 s to read; these are the ones needed, and a test compares them with pint's
_DEFINITIONS = """
centi- = 0.01 = c-
milli- = 0.001 = m-
kilo- = 1000 = k-
pi = 3.1415926535897932384626433832795028841971693993751
meter = [length] = m
inch = 0.0254 * meter = in
foot = 12 * inch = ft
second = [time] = s
radian = [] = rad
degree = pi / 180 * radian = deg
gram = [mass] = g
pound = 453.59237 * gram = lb
"""


class Quantity(NamedTuple):
    """A number as it was written, and its unit."""

    number: str
    unit: str


def parse(text: object, dimension: str, *, key: str | None = None, file: str | None = None) -> Quantity:
    """Read a quantity of a given dimension.

    Parameters
    ----------
    text : object
        What stands in the scene; anything but a string is refused.
    dimension : str
        A key of `UNITS`.
    key, file : str, optional
        Where it stands, for the error.

    Returns
    -------
    Quantity
        The number's text and the unit.

    Raises
    ------
    SceneError
        Not a string, no decimal number, no known unit, a unit of another dimension, or a number too large or small.

    Examples
    --------
    >>> parse("5.75 in", "length")
    Quantity(number='5.75', unit='in')
    """
    article = "an" if dimension[0] in "aeiou" else "a"
    example = _EXAMPLES[dimension]

    def refuse(value: object, remedy: str) -> SceneError:
        units = ", ".join(UNITS[dimension])
        allowed = f'{article} {dimension}, "<decimal number> <unit>" with a unit of {units}'
        return SceneError(f"this {dimension}", value, allowed, remedy, key=key, file=file)

    if not isinstance(text, str):
        raise refuse(shown(text), f'write it as text with its unit, like "{example}"')
    if len(text) > _LONGEST:
        raise refuse(shown(text), "shorten it")
    match = _QUANTITY.fullmatch(text.strip(" "))
    if match is None:
        raise refuse(text, _why_no_quantity(text, example))
    number, unit = match[1], match[2]
    if unit not in UNITS[dimension]:
        raise refuse(text, _why_not_unit(unit, dimension, example))
    size = abs(float(number))
    if not (_SMALLEST <= size <= _LARGEST or _is_zero(number)):
        raise refuse(text, f"give 0 or a size from {_SMALLEST:g} to {_LARGEST:g}; choose another unit")
    return Quantity(number, unit)


def _is_zero(number: str) -> bool:
    return not re.search(r"[1-9]", re.split(r"[eE]", number)[0])


def _why_no_quantity(text: str, example: str) -> str:
    if "," in text:
        return f'write the decimal point as a point and leave no commas, like "{example}"'
    if re.fullmatch(_NUMBER, text.strip()):
        return f'add the unit, like "{example}"'
    if re.fullmatch(_NUMBER + r"[a-zA-Z%]\S*", text.strip(" ")):
        return f'put a space between number and unit, like "{example}"'
    return f'write one finite decimal number, a space and the unit, like "{example}"'


def _why_not_unit(unit: str, dimension: str, example: str) -> str:
    for other, units in UNITS.items():
        if unit in units:
            return f"{unit} is a unit of {other}: the dimension is wrong"
    near = difflib.get_close_matches(unit.lower(), UNITS[dimension], n=1, cutoff=0.5)
    return f"the unit {unit!r} is not known; {f'did you mean {near[0]!r}?' if near else f'write {example!r}'}"


def convert(quantity: Quantity, unit: str) -> float:
    """Give the value of a quantity in another unit, rounded once.

    Examples
    --------
    >>> convert(Quantity("2.54", "cm"), "in"), convert(Quantity("0.1", "in"), "in")
    (1.0, 0.1)
    """
    if quantity.unit == unit:
        return float(quantity.number)
    if unit == "":
        return float(Fraction(quantity.number) / 100)
    return float(Fraction(quantity.number) * exact_factor(quantity.unit, unit))


@lru_cache(maxsize=128)
def exact_factor(unit: str, target: str) -> Fraction:
    """Give what a number in one unit is multiplied by for another: exact, but for degrees (pi to 50 digits).

    Examples
    --------
    >>> exact_factor("in", "cm")
    Fraction(127, 50)
    """
    if unit == target:
        return Fraction(1)
    return Fraction(_registry().Quantity(Fraction(1), unit).to(target).magnitude)


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint  # lazily: it takes 0.1 s, and most scenes need no conversion

    return pint.UnitRegistry(_DEFINITIONS.strip().splitlines(), non_int_type=Fraction)


def written(value: float, unit: str) -> str:
    """Write a number as a quantity that reads back as the same float.

    Examples
    --------
    >>> written(0.1, "in")
    '0.1 in'
    """
    return f"{float(value)!r} {unit}"


def shown(value: object) -> object:
    """Shorten a value for an error: what a scene holds may be a million characters long."""
    if isinstance(value, str):
        return value if len(value) <= _LONGEST else value[:_LONGEST] + "..."
    if isinstance(value, int) and not isinstance(value, bool) and value.bit_length() > 64:
        return f"an integer of {value.bit_length()} bits"
    if value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else f"{value}"
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    return f"a {type(value).__name__}"
