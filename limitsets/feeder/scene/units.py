"""Quantities in text: a decimal number and a unit from a fixed list.

A library of units would read "5,75 in" as 575 in, never come back from "9**9**9 in" and let 1/s pass as rad/s: a number
is read by a regular expression, a unit by one table.  Conversions are exact fractions up to one last rounding; a value
already in the target unit is the float of its text.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

from limitsets.base import LONGEST, SceneError, shown

UNITS: dict[str, tuple[str, ...]] = {
    "length": ("m", "cm", "mm", "in", "ft", "um"),
    "angle": ("deg", "rad"),
    "angular speed": ("deg/s", "rad/s", "rpm"),
    "acceleration": ("m/s^2", "cm/s^2", "mm/s^2", "in/s^2", "ft/s^2", "um/s^2"),
    "mass": ("kg", "g", "lb", "t", "mg"),
    "mass per area": ("kg/m^2", "g/cm^2"),
    "mass per volume": ("kg/m^3", "g/cm^3"),
    "frequency": ("Hz",),
    "share": ("%",),
}
"""The units a scene may use, by dimension."""

_SPELLINGS = {"\u00b5m": "um", "\u03bcm": "um", "\u00b0": "deg"}
"""Other signs for some of them: micro and Greek mu, the degree sign."""

# Micro signs, degree signs and what looks like them, superscripts.
_PLAIN_SIGNS = str.maketrans(
    {
        "\u00b5": "u",
        "\u03bc": "u",
        "\u00b0": "deg",
        "\u00ba": "deg",
        "\u02da": "deg",
        "\u00b2": "^2",
        "\u00b3": "^3",
    }
)

_SHARES_OF_PI = {"deg": Fraction(1, 180), "deg/s": Fraction(1, 180), "rpm": Fraction(1, 30)}

# In millimetres and in inches, for a scene has either.
_EXAMPLES = {
    "length": '"146 mm" or "5.75 in"',
    "angle": '"30 deg"',
    "angular speed": '"158 deg/s"',
    "acceleration": '"4900 mm/s^2" or "193 in/s^2"',
    "mass": '"20 g"',
    "mass per area": '"1.5 kg/m^2"',
    "mass per volume": '"7850 kg/m^3"',
    "frequency": '"2 Hz"',
    "share": '"1 %"',
}

# What people write instead: how much of which unit one of it is.
_OTHER_NAMES = {
    "dm": "1/10 m",
    "km": "1000 m",
    "Mm": "1000000 m",
    "yd": "3 ft",
    "mrad": "1/1000 rad",
    "deg/min": "1/60 deg/s",
    "rev/s": "360 deg/s",
    "rps": "360 deg/s",
    "rad/min": "1/60 rad/s",
    "oz": "28.349523125 g",
    "ug": "1/1000000 g",
    **dict.fromkeys(("hz", "/s", "1/s", "throws/s"), "1 Hz"),
    **dict.fromkeys(("/min", "1/min", "throws/min"), "1/60 Hz"),
    **dict.fromkeys(("rev", "turn", "turns"), "360 deg"),
    **dict.fromkeys(("meter", "metre", "meters", "metres"), "1 m"),
    **dict.fromkeys(("inch", "inches", '"'), "1 in"),
    **dict.fromkeys(("foot", "feet"), "1 ft"),
    **dict.fromkeys(("degree", "degrees"), "1 deg"),
    **dict.fromkeys(("radian", "radians"), "1 rad"),
    **dict.fromkeys(("rev/min", "r/min"), "1 rpm"),
    **dict.fromkeys(("kilogram", "kilograms"), "1 kg"),
    **dict.fromkeys(("gram", "grams"), "1 g"),
    **dict.fromkeys(("lbs", "pound", "pounds"), "1 lb"),
    **dict.fromkeys(("tonne", "tonnes", "Mg"), "1 t"),
    **dict.fromkeys(("g/cc", "g/ml", "kg/l", "kg/dm^3"), "1 g/cm^3"),
}
# What people write for a rate of throws: the time from one to the next [s].
_PERIODS = {"s": Fraction(1), "ms": Fraction(1, 1000), "min": Fraction(60)}
_NUMBER = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
_QUANTITY = re.compile(rf"({_NUMBER})(?: +|(?=[%\u00b0]))([^\s].*)")
_SMALLEST, _LARGEST = 1e-300, 1e12

_PI = Fraction("3.1415926535897932384626433832795028841971693993751")

# Of a dimension that is wanted and a unit of another that is plainly read as one of it: when, the factor, the unit.
_EACH_TURN = "if each turn throws once"
_READ_AS = {
    ("frequency", "rpm"): (_EACH_TURN, Fraction(1, 60), "Hz"),
    ("frequency", "deg/s"): (_EACH_TURN, Fraction(1, 360), "Hz"),
    ("frequency", "rad/s"): (_EACH_TURN, Fraction(1, 2) / _PI, "Hz"),
    ("angular speed", "Hz"): ("if it counts turns", Fraction(60), "rpm"),
    ("acceleration", "g"): ("if it is that of free fall", Fraction("9.80665"), "m/s^2"),
}

# Sizes in m, kg, rad and s, by what the units measure; a test compares quotients of them with those of pint.
_SIZES_BY_KIND: dict[str, dict[str, str | Fraction]] = {
    "m": {"m": "1", "cm": "0.01", "mm": "0.001", "um": "0.000001", "in": "0.0254", "ft": "0.3048"},
    "kg": {"kg": "1", "g": "0.001", "mg": "0.000001", "t": "1000", "lb": "0.45359237"},
    "rad": {"rad": "1", "deg": _PI / 180},
    "rad/s": {"rpm": _PI / 30},
    "s": {"s": "1"},
    "Hz": {"Hz": "1"},
    "share": {"": "1", "%": "0.01"},
}
_SIZES = {
    unit: (kind, Fraction(size)) for kind, sizes in _SIZES_BY_KIND.items() for unit, size in sizes.items()
}


class Quantity(NamedTuple):
    """A number as it was written, and its unit in letters of ASCII."""

    number: str
    unit: str


def parse(
    text: object,
    dimension: str,
    *,
    share: bool = False,
    key: str | None = None,
    file: str | None = None,
) -> Quantity:
    """Read a quantity of a given dimension.

    Parameters
    ----------
    text : object
        What stands in the scene; anything but a string is refused.
    dimension : str
        A key of `UNITS`.
    share : bool
        Whether percent is allowed as well: for the error.
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
    known = _read(text, dimension) if isinstance(text, str) else _NO_TEXT.format(_EXAMPLES[dimension])
    if isinstance(known, Quantity):
        return known
    percent = '"<decimal number> %" or ' if share and dimension != "share" else ""
    article = "an" if dimension[0] in "aeiou" else "a"
    other = [sign for sign, unit in _SPELLINGS.items() if unit in UNITS[dimension]]
    units = ", ".join([*UNITS[dimension], *other[:1]])
    allowed = f'{percent}{article} {dimension}, "<decimal number> <unit>" with a unit of {units}'
    raise SceneError(f"this {dimension}", shown(text), allowed, known, key=key, file=file)


_NO_TEXT = "write it as text with its unit, like {}"


@lru_cache(maxsize=4096)  # a scene is read many times in a search, most of it unchanged
def _read(text: str, dimension: str) -> Quantity | str:
    """Read a quantity, or say what to do about a text that is none."""
    if len(text) > LONGEST:
        return "shorten it"
    match = _QUANTITY.fullmatch(text.strip(" "))
    if match is None:
        return _why_no_quantity(text, dimension)
    number, unit = match[1], _SPELLINGS.get(match[2], match[2])
    if not (fits(float(number)) or _is_zero(number)):
        return f"give 0 or a size from {_SMALLEST:g} to {_LARGEST:g}; choose another unit"
    return Quantity(number, unit) if unit in UNITS[dimension] else _why_not_unit(number, unit, dimension)


def fits(value: Any) -> Any:
    """Whether a number other than 0, or each of an array, has a size that a quantity may have.

    Examples
    --------
    >>> fits(-2.5), fits(1e13)
    (True, False)
    """
    return (abs(value) >= _SMALLEST) & (abs(value) <= _LARGEST)


def _is_zero(number: str) -> bool:
    return not re.search(r"[1-9]", re.split(r"[eE]", number)[0])


def _why_no_quantity(text: str, dimension: str) -> str:
    example = _EXAMPLES[dimension]
    if "," in text:
        return f"write the decimal point as a point and leave no commas, like {example}"
    if re.fullmatch(_NUMBER, text.strip()):
        return f"add the unit, like {example}"
    close = re.fullmatch(rf"({_NUMBER})([a-zA-Z\u00b5\u03bc]\S*)", text.strip(" "))
    if close is not None:
        return f'put a space between number and unit: "{close[1]} {close[2]}"'
    rate = re.fullmatch(rf"({_NUMBER})(/[a-z]+)", text.strip(" "))
    if rate is not None and dimension == "frequency" and fits(float(rate[1])):
        return _why_not_unit(rate[1], rate[2], dimension)
    return f"write one finite decimal number, a space and the unit, like {example}"


def _why_not_unit(number: str, unit: str, dimension: str) -> str:
    """Say what is wrong with a unit; what is proposed is the same value, whatever the unit was."""
    if unit == "N":
        wanted = ", and a mass is wanted: give kg" if dimension == "mass" else ": the dimension is wrong"
        return f"N is a unit of force{wanted}"
    size, name = _in_known_unit(unit)
    for other, units in UNITS.items():
        if name in units and other != dimension:
            if (dimension, name) not in _READ_AS:
                return f"{unit} is a unit of {other}: the dimension is wrong"
            words, factor, own = _READ_AS[dimension, name]
            value = float(Fraction(number) * size * factor)
            return f'{unit} is a unit of {other}: {words}, write "{value:.15g} {own}"'
    if dimension == "frequency" and unit in _PERIODS and not _is_zero(number):
        rate = 1 / (Fraction(number) * _PERIODS[unit])
        return f'{unit} is a unit of time: if it is that from throw to throw, write "{float(rate):.15g} Hz"'
    if not name:
        return f"the unit {unit!r} is not known; convert the value to one of these"
    if size == 1:
        return f"the unit {unit!r} is not known; did you mean {name!r}?"
    return f'the unit {unit!r} is not known; write "{float(Fraction(number) * size):.15g} {name}"'


def _in_known_unit(unit: str) -> tuple[Fraction, str]:
    """Say how many of which known unit one of another is, or of one in another spelling; 0 and "" if that is not known.

    Examples
    --------
    >>> _in_known_unit("km"), _in_known_unit("g/m\u00b2")
    ((Fraction(1000, 1), 'm'), (Fraction(1, 1000), 'kg/m^2'))
    """
    name = unit
    if unit not in _OTHER_NAMES:
        name = unit.translate(_PLAIN_SIGNS).replace("**", "^").lower()
        name = re.sub(r"(?<=[a-z])[23]$", r"^\g<0>", name)
    if any(name in units for units in UNITS.values()):
        return Fraction(1), name
    density = re.fullmatch(r"([a-z]+)/([a-z]+)\^([23])", name)
    if density is not None and density[1] in UNITS["mass"] and density[2] in UNITS["length"]:
        power = int(density[3])
        return exact_factor(density[1], "kg") / exact_factor(density[2], "m") ** power, f"kg/m^{power}"
    size, _, known = _OTHER_NAMES.get(name, "0").partition(" ")
    return Fraction(size), known


def convert(quantity: Quantity, unit: str) -> float:
    """Give the value of a quantity in another unit, rounded once.

    Examples
    --------
    >>> convert(Quantity("2.54", "cm"), "in"), convert(Quantity("0.1", "in"), "in")
    (1.0, 0.1)
    """
    if quantity.unit == unit:
        return float(quantity.number)
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
    (kind, size), (other, of) = _measured(unit), _measured(target)
    if kind != other:
        raise ValueError(f"{unit} and {target} measure different things")
    return size / of


def _measured(unit: str) -> tuple[str, Fraction]:
    """Give what a unit measures and its size, also of a quotient like kg/in^2."""
    if unit in _SIZES:
        return _SIZES[unit]
    top, below = unit.split("/")
    name, caret, power = below.partition("^")
    (kind, size), (per, part) = _SIZES[top], _SIZES[name]
    return f"{kind}/{per}{caret}{power}", size / part ** int(power or 1)


def density_dimension(text: object) -> str:
    """Say of what a plate's density is one, by its unit: of an area or of a volume.

    Examples
    --------
    >>> density_dimension("7850 kg/m^3"), density_dimension("3 kg/m^2")
    ('mass per volume', 'mass per area')
    """
    unit = text.rstrip(" ").rpartition(" ")[2] if isinstance(text, str) else ""
    volume = unit.endswith(("3", "\u00b3")) or _in_known_unit(unit)[1] in UNITS["mass per volume"]
    return "mass per volume" if volume else "mass per area"


def share_of_pi(unit: str) -> Fraction | None:
    """Say what share of pi an angle's unit is, or a speed's for 1 rad/s; None for all others.

    Examples
    --------
    >>> share_of_pi("rpm"), share_of_pi("rad/s")
    (Fraction(1, 30), None)
    """
    return _SHARES_OF_PI.get(unit)


def spelled_plainly(tree: Any) -> Any:
    """Spell every quantity in what stands in a scene in one way: number, one blank, unit in letters of ASCII.

    Examples
    --------
    >>> spelled_plainly({"tilt": " 30\u00b0", "order": [0, 1]})
    {'tilt': '30 deg', 'order': [0, 1]}
    """
    if isinstance(tree, Mapping):
        return {key: spelled_plainly(inner) for key, inner in tree.items()}
    if isinstance(tree, list | tuple):
        return [spelled_plainly(inner) for inner in tree]
    match = _QUANTITY.fullmatch(tree.strip(" ")) if isinstance(tree, str) else None
    unit = "" if match is None else _SPELLINGS.get(match[2], match[2])
    known = any(unit in units for units in UNITS.values())
    return f"{match[1]} {unit}" if match is not None and known else tree


def written(value: float, unit: str) -> str:
    """Write a number as a quantity that reads back as the same float.

    Examples
    --------
    >>> written(0.1, "in")
    '0.1 in'
    """
    return f"{float(value)!r} {unit}"
