"""Texts, quantities with units, and JSON: how the checker reads and writes them.

docs/certificates.md, "Checking one": numbers are written from the exact values that were checked.
"""

import functools
import re
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from fractions import Fraction
from typing import Any, NamedTuple

from flint import arb

from .balls import Arb, exact, span


class BadFileError(Exception):
    """The file is not a certificate that can be read."""


def require(condition: bool, message: str) -> None:
    """Raise BadFileError unless the condition holds."""
    if not condition:
        raise BadFileError(message)


def plain(text: object, most: int = 80) -> str:
    """Clean the text of a stranger for printing: replace control characters, and mark where a long text is cut."""
    whole = str(text)
    clean = "".join(c if c.isprintable() and c.isascii() else "?" for c in whole[:most])
    return clean + ("... (cut)" if len(whole) > most else "")


DECIMAL = r"[+-]?(?:[0-9]{1,100}(?:\.[0-9]{0,100})?|\.[0-9]{1,100})(?:[eE][+-]?[0-9]{1,3})?"
NUMBER = re.compile(rf" *({DECIMAL})(?: +|(?=%))([a-zH%/^0-9]{{1,8}}) *")  # as a scene writes a quantity
INCH = Fraction(254, 10_000)
METRIC = {"m": Fraction(1), "cm": Fraction(1, 100), "mm": Fraction(1, 1000), "um": Fraction(1, 10**6)}
LENGTHS = {**METRIC, "in": INCH, "ft": 12 * INCH}
POUND = Fraction(45359237, 10**8)
UNITS: dict[str, dict[str, Fraction]] = {
    "length": LENGTHS,
    "angle": {"rad": Fraction(1), "deg": Fraction(1, 180)},  # degrees as multiples of pi
    "speed": {"rad/s": Fraction(1), "deg/s": Fraction(1, 180), "rpm": Fraction(1, 30)},
    "acceleration": {f"{unit}/s^2": factor for unit, factor in LENGTHS.items()},
    "mass": {
        "t": Fraction(1000),
        "kg": Fraction(1),
        "g": Fraction(1, 1000),
        "mg": Fraction(1, 10**6),
        "lb": POUND,
    },
    "density": {"kg/m^2": Fraction(1), "g/cm^2": Fraction(10)},  # mass per area of a plate
    "bulk": {"kg/m^3": Fraction(1), "g/cm^3": Fraction(1000)},  # mass per volume
    "frequency": {"Hz": Fraction(1)},
    "share": {"%": Fraction(1, 100)},
}
KINDS = " ".join(UNITS)
BY_PI = ("deg", "deg/s", "rpm")
LONGEST_TEXT = 64  # signs of a quantity: a longer text is refused, so that `plain` cuts no quantity


def decimal(value: Fraction) -> str:
    """Write a rational number exactly: as a decimal where it is one, else as a fraction."""
    over, twos, fives = value.denominator, 0, 0
    while over % 2 == 0:
        over, twos = over // 2, twos + 1
    while over % 5 == 0:
        over, fives = over // 5, fives + 1
    if over != 1:
        return f"{value.numerator}/{value.denominator}"
    places = max(twos, fives)
    digits = str(abs(value.numerator) * 2 ** (places - twos) * 5 ** (places - fives))
    sign, kept = "-" if value < 0 else "", digits.rstrip("0")
    if not kept:
        return "0"
    exponent = len(digits) - 1 - places  # of the first digit
    if -7 < exponent < 16:
        digits = digits.rjust(places + 1, "0")
        whole, rest = digits[: len(digits) - places], digits[len(digits) - places :]
        return sign + whole + (f".{rest}" if rest else "")
    return f"{sign}{kept[0]}{'.' + kept[1:] if kept[1:] else ''}e{exponent}"


def rounded(value: float, *, up: bool, digits: int = 9) -> str:
    """Write a float with few digits, rounded up or down."""
    return str(Context(digits, ROUND_CEILING if up else ROUND_FLOOR).create_decimal(value))


class Quantity(NamedTuple):
    """An interval in basic units (metre, radian, second, kilogram), exact; in multiples of pi where `pi` says so."""

    lo: Fraction
    hi: Fraction
    pi: bool
    unit: str

    def ball(self) -> Arb:
        """Enclose the interval in a ball."""
        return span(self.lo, self.hi) * (arb.pi() if self.pi else 1)

    def ends(self) -> list[Arb]:
        """Enclose the two ends of the interval."""
        return [exact(end) * (arb.pi() if self.pi else 1) for end in (self.lo, self.hi)]

    def __str__(self) -> str:
        """Write the interval from its numbers, not from the text in the file."""
        factor = next(kind[self.unit] for kind in UNITS.values() if self.unit in kind)
        lo, hi = (f"{decimal(end / factor)} {self.unit}" for end in (self.lo, self.hi))
        return lo if self.lo == self.hi else f"every value in [{lo}, {hi}]"


@functools.lru_cache(maxsize=4096)  # a scene is read again for each half of a tolerance
def number_and_unit(text: str, kinds: str, where: str) -> tuple[Fraction, str]:
    """Read a text like `"5.75 in"`: the number in the basic unit of its kind, and the unit written."""
    words = text if len(text) <= LONGEST_TEXT else ""
    tidy = words == " ".join(words.split()) != ""
    require(tidy, f"{where}: {plain(text)} is not text of at most {LONGEST_TEXT} signs, with single blanks")
    found = NUMBER.fullmatch(words)
    require(found is not None, f"{where}: {plain(text)} is not a decimal number and a unit")
    assert found is not None
    size = abs(Fraction(found[1]))
    ordinary = size == 0 or Fraction(1, 10**300) <= size <= 10**12
    require(ordinary, f"{where}: {plain(text)} is not 0 or of a size from 1e-300 to 1e12")
    factors = [UNITS[kind][found[2]] for kind in kinds.split() if found[2] in UNITS[kind]]
    require(len(factors) == 1, f"{where}: {plain(found[2])} is not a unit of {kinds}")
    return Fraction(found[1]) * factors[0], found[2]


def quantity(value: object, kinds: str, where: str) -> Quantity:
    """Read a quantity of one of the kinds named: a text like `"5.75 in"`, or a pair of such texts for an interval."""
    if isinstance(value, Quantity):  # `Scene.halves` put it there: JSON holds no such object
        return value
    pair = value if isinstance(value, list) else [value, value]
    require(len(pair) == 2, f"{where}: an interval has two ends")
    read = [number_and_unit(text if isinstance(text, str) else plain(text), kinds, where) for text in pair]
    (lo, unit), (hi, other) = read
    require((unit in BY_PI) == (other in BY_PI), f"{where}: mixes degrees and radians")
    require(lo <= hi, f"{where}: the interval is empty")
    return Quantity(lo, hi, unit in BY_PI, unit)


def table(value: object, where: str, needed: str, optional: str = "") -> dict[str, Any]:
    """Return a JSON object that has all keys needed, and no others than these and the optional ones."""
    require(isinstance(value, dict), f"{where} is not an object")
    assert isinstance(value, dict)
    missing = [key for key in needed.split() if key not in value]
    require(not missing, f"{where}: {', '.join(missing)} missing")
    odd = [key for key in value if key not in needed.split() + optional.split()]
    require(not odd, f"{where}: unknown key {plain(' '.join(odd))}")
    return value


def rows(value: object, where: str, least: int, most: int) -> list[Any]:
    """Return a JSON array of a fitting length."""
    fits = isinstance(value, list) and least <= len(value) <= most
    require(fits, f"{where} is not a list of a fitting length")
    assert isinstance(value, list)
    return value


def by_side(value: object, where: str, n_sides: int) -> list[Any]:
    """Read an object with one entry for each side."""
    names = [str(i) for i in range(n_sides)]
    known = table(value, where, " ".join(names))
    return [known[name] for name in names]


def read_side(value: object, n_sides: int) -> int:
    """Read the number of a side."""
    require(type(value) is int and 0 <= value < n_sides, "a side is not a number of one")
    assert isinstance(value, int)
    return value


def hex_float(text: object, where: str) -> float:
    """Read a float in Python's hexadecimal form."""
    form = r"-?0x[01]\.[0-9a-f]{1,13}p[+-][0-9]{1,4}"
    fits = isinstance(text, str) and re.fullmatch(form, text) is not None
    require(fits, f"{where} is not a hexadecimal number")
    try:
        return float.fromhex(str(text))
    except OverflowError:
        raise BadFileError(f"{where} is too large") from None


def model_in_words(model: dict[str, Any]) -> str:
    """Say of which model a verdict is."""
    kind = f"model with {' and '.join(model['simulated'])}" if model["simulated"] else "minimal model"
    facts = model["left_out"]
    if not facts:
        return f"of the {kind}: no fact of [world] is left out; not audited"
    also = ", of the scene without its scatter" if "scatter" in facts else ""
    said = " and ".join(part for part in (", ".join(facts[:-1]), facts[-1]) if part)
    return (
        f"of the {kind}{also}: {said} of [world] {'is' if len(facts) == 1 else 'are'} not in it; not audited"
    )
