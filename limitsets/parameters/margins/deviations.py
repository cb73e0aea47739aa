"""Deviations of one quantity, or of several at once: readings, units, and the values and boxes they stand for.

A deviation has a size, a rational number of its unit: percent of the value, or a length or an angle.  The texts
written here are input of `limitsets.certify` and of certificates, so every size is a short decimal.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from fractions import Fraction
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from limitsets.base import AnswerError, SceneError
from limitsets.feeder.scene import Deviation, Scene
from limitsets.feeder.scene.quantities import base_unit, deviation, find, parsed_deviation, text_at, texts
from limitsets.feeder.scene.units import Quantity, exact_factor, parse
from limitsets.proofs.prover.numbers import RationalInterval
from limitsets.proofs.prover.parameters import VARYING
from limitsets.proofs.prover.tolerances import SceneBox, decimal

READINGS = ("fixed", "per-throw")
"""Fixed but unknown, or another one at every throw."""

# Digits of a size.
DIGITS = 9

# Of a piece of a part's quantity, relative to it.
_WIDEST = Fraction(4, 100)

# Of these a deviation is given as a share of the value.
_SHARES = (
    "throw.speed",
    "throw.kappa",
    "part.mass.radius_of_gyration",
    "part.sides",
    "gravity.acceleration",
)


def short(value: Fraction | float, *, up: bool = False) -> Fraction:
    """Round a positive number to `DIGITS` significant digits, towards zero or away from it.

    Examples
    --------
    >>> short(Fraction(2, 3)), short(1234567.8999, up=True)
    (Fraction(333333333, 500000000), Fraction(12345679, 10))
    """
    exact = Fraction(value)
    context = Context(prec=DIGITS, rounding=ROUND_CEILING if up else ROUND_FLOOR)
    return Fraction(context.divide(Decimal(exact.numerator), Decimal(exact.denominator)))


@dataclass(frozen=True)
class DeviationScale:
    """One quantity of a scene, read in one way.

    Attributes
    ----------
    quantity : str
        Its name.
    reading : str
        Of `READINGS`.
    unit : str
        Of a deviation: "%", or the unit of a length or an angle.
    scene : Scene
        The scene.
    """

    quantity: str
    reading: str
    unit: str
    scene: Scene

    @property
    def relative(self) -> bool:
        """Whether sizes are percents of the value."""
        return self.unit == "%"

    @property
    def key(self) -> str:
        """The quantity that the scene gives instead, where it is given by kappa."""
        by_kappa = self.quantity == "throw.speed" and "kappa" in self.scene.text["throw"]
        return "throw.kappa" if by_kappa else self.quantity

    @property
    def given(self) -> Quantity:
        """The value of `key` as the scene gives it."""
        return parse(_text_at(self.scene, self.key), find(self.key).dimension)

    @property
    def nominal(self) -> Fraction:
        """The value of `key`, in the unit in which the scene gives it."""
        return Fraction(self.given.number)

    @property
    def about(self) -> float | None:
        """The value about which it deviates; of a length or an angle in the unit of the deviation."""
        if self.key != self.quantity or self.quantity == "landing.x":
            return None
        return float(
            self.nominal if self.relative else self.nominal * exact_factor(self.given.unit, self.unit)
        )

    @property
    def least(self) -> Fraction:
        """A size that is small for such a quantity: where a search begins."""
        if self.relative:
            return Fraction(1, 10)
        if self.unit in ("deg", "rad"):
            return Fraction(1, 20) if self.unit == "deg" else Fraction(1, 1000)
        if find(self.quantity).dimension != "length":
            return short(abs(self.nominal) * exact_factor(self.given.unit, self.unit) / 1000)
        # lengths: about a thousandth of the part
        sides = [float(length) for length in self.scene.sides.length]
        return short(exact_factor(self.scene.unit, self.unit) * Fraction(min(sides)) / 1000)

    @property
    def most(self) -> Fraction | None:
        """Sizes have to stay below it; None where the part says how far one can go."""
        return Fraction(100) if self.relative else None

    @property
    def widest(self) -> Fraction | None:
        """Width of a piece at most, so that others can confirm it: a part that varies much is enclosed badly."""
        if not self.quantity.startswith("part."):
            return None
        if self.relative:
            return 100 * _WIDEST
        return max(abs(self.nominal) * exact_factor(self.given.unit, self.unit) * _WIDEST, self.least)

    def text(self, size: Fraction) -> str:
        """Write a size with its unit, as `limitsets.certify` takes it."""
        return f"{decimal(size)} {self.unit}"

    def deviation(self, size: Fraction) -> Deviation:
        """Return a size in floats, in the scene's units."""
        if self.relative:
            return Deviation(float(size / 100), relative=True)
        unit = base_unit(find(self.quantity).dimension, self.scene.unit)
        return Deviation(float(size * exact_factor(self.unit, unit)), relative=False)

    def value(self, size: Fraction) -> Fraction:
        """Return the value of `key` at a deviation with its sign."""
        if self.key != self.quantity:  # kappa = g / w^2
            return self.nominal / (1 + size / 100) ** 2
        if self.relative:
            return self.nominal * (1 + size / 100)
        return self.nominal + size * exact_factor(self.unit, self.given.unit)

    def between(self, one: Fraction, other: Fraction) -> RationalInterval:
        """Return the values at all deviations between two."""
        ends = self.value(one), self.value(other)
        return RationalInterval(min(ends), max(ends))

    def at(self, size: Fraction) -> RationalInterval:
        """Return the value at a deviation, as a decimal that is not farther from the nominal one."""
        exact, places = self.value(size), 10**18
        scaled = exact * places
        rounded = Fraction(scaled.numerator // scaled.denominator, places)
        if rounded != exact and exact < self.nominal:
            rounded += Fraction(1, places)
        return RationalInterval(rounded, rounded)

    def piece(self, span: RationalInterval) -> SceneBox:
        """Return the box of scenes with these values."""
        return SceneBox(self.scene, {self.key: span})

    def alone(self) -> Tolerance:
        """Return its deviations by 1 of its unit."""
        return Tolerance.alone(self)


def nominal_of(scene: Scene, quantity: str) -> tuple[float | None, str]:
    """Find the value of a quantity as people say it, and its unit; None for what has none."""
    if quantity in ("joint", "landing.x"):
        return None, scene.unit
    text = text_at(scene.text, quantity)
    if text is not None:
        given = parse(text, find(quantity).dimension)
        return float(given.number), given.unit
    if quantity == "throw.speed" and scene.gravity is not None:
        return math.degrees(math.sqrt(scene.gravity / scene.kappa)), "deg/s"
    return None, scene.unit


def _text_at(scene: Scene, name: str) -> str:
    text = text_at(scene.text, name)
    if text is None:
        raise AnswerError(
            "the quantity", name, f"one that the scene gives: {', '.join(given(scene))}", "name another"
        )
    return str(text)


def given(scene: Scene) -> tuple[str, ...]:
    """Name the quantities that a scene gives and that its throws depend on, and the speed, and where parts land.

    Examples
    --------
    >>> import limitsets as ls
    >>> given(ls.load("paper-designed"))[-3:]
    ('arm.length', 'throw.speed', 'landing.x')
    """
    by_kappa = "kappa" in scene.text["throw"]
    gravity = ("gravity.acceleration", "gravity.tilt")
    tables = {word: scene.text[word] for word in ("part", "arm", "throw", "gravity") if word in scene.text}
    names = [name for name, _ in texts(tables) if name not in ("throw.kappa", "throw.speed")]
    kept = [name for name in names if not (by_kappa and name in gravity[:1])]
    return (*kept, "throw.speed", "landing.x")


def _unit(scene: Scene, quantity: str) -> str:
    """Choose the unit: as the scene's [tolerance] has it, or as people give such a deviation."""
    text = scene.text.get("tolerance", {}).get(quantity)
    if text is not None:
        return parsed_deviation(text, quantity).unit
    if quantity.startswith(_SHARES) or quantity.endswith(".mass"):
        return "%"
    if quantity == "gravity.tilt":
        return str(parse(_text_at(scene, quantity), "angle").unit)
    return scene.unit


def deviation_scale(scene: Scene, quantity: str, reading: str | None = None) -> DeviationScale:
    """Say how deviations of a quantity are measured.

    Parameters
    ----------
    scene : Scene
        The scene.
    quantity : str
        Its name, "landing.x" included.
    reading : str, optional
        Of `READINGS`; default "fixed", but of landing.x "per-throw", its only one.

    Raises
    ------
    AnswerError
        A quantity that the scene does not give or its throws do not depend on, or a reading that it does not have.
    """
    find(quantity)
    reading = reading or ("per-throw" if quantity == "landing.x" else "fixed")
    if reading not in READINGS:
        raise AnswerError("the reading", reading, " or ".join(READINGS), "correct the word")
    if reading == "per-throw" and quantity not in VARYING:
        allowed = f"per-throw for {', '.join(VARYING)}; fixed"
        raise AnswerError(f"the reading of {quantity}", reading, allowed, "ask for it fixed but unknown")
    if reading == "fixed" and quantity == "landing.x":
        raise AnswerError(
            "the reading of landing.x", reading, "per-throw", "where a part lands differs at every throw"
        )
    by_kappa = "kappa" in scene.text["throw"]
    if by_kappa and quantity.startswith("gravity.") and reading == "fixed":
        remedy = "give the throw by its speed, or ask for throw.speed"
        raise AnswerError(
            "the quantity", quantity, "one that the throw depends on; it is given by kappa", remedy
        )
    scale = DeviationScale(quantity, reading, _unit(scene, quantity), scene)
    if quantity not in ("landing.x", "throw.speed"):
        _text_at(scene, quantity)
    return scale


def deviation_scales(scene: Scene, reading: str | None = None) -> tuple[DeviationScale, ...]:
    """List what can deviate in a scene, fixed but unknown first.

    Parameters
    ----------
    scene : Scene
        The scene.
    reading : str, optional
        Only this one.
    """
    never_fixed = ("landing.x", "gravity.tilt") if "kappa" in scene.text["throw"] else ("landing.x",)
    return tuple(
        deviation_scale(scene, name, word)
        for word in (READINGS if reading is None else (reading,))
        for name in given(scene)
        if (name not in never_fixed if word == "fixed" else name in VARYING)
    )


# ----------------------------------------------------------------
# Searches along sizes: two that are told apart, brought together; sizes a little beyond one that is known.


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


# ----------------------------------------------------------------
# A vector of tolerances: deviations of several quantities at once, and the scenes and boxes of scenes in it.
#
# A proof takes them exactly, in rational numbers of the units in which people give them; an estimate takes the same
# vector in floats, of any scene that gives these quantities.


Parts = tuple[Fraction, ...]
Signs = tuple[int, ...]

# Corners that are tried where a box has more.
MOST_CORNERS = 512


def corners(count: int) -> list[Signs]:
    """All corners of a box of so many quantities; of a large one some, always the same.

    Examples
    --------
    >>> corners(1)
    [(-1,), (1,)]
    """
    if 2**count <= MOST_CORNERS:
        return list(product((-1, 1), repeat=count))
    drawn = np.random.default_rng(0).choice((-1, 1), (MOST_CORNERS, count))
    return [tuple(row) for row in drawn.tolist()]


def worst_corner(fall: ArrayLike) -> Signs:
    """Return the corner at which a number is least that falls so much with each quantity.

    Examples
    --------
    >>> worst_corner([0.5, -2.0])
    (1, -1)
    """
    return tuple(int(sign) for sign in np.where(np.asarray(fall) < 0.0, -1, 1))


@dataclass(frozen=True, eq=False)
class Tolerance:
    """A vector of deviations.

    Attributes
    ----------
    scales : tuple of DeviationScale
        What is fixed but unknown.
    sizes : tuple of Fraction
        A size for each.
    varying : tuple of (DeviationScale, Fraction)
        What differs at every throw, and how much: where parts land, and what noise is given beside.
    """

    scales: tuple[DeviationScale, ...]
    sizes: Parts
    varying: tuple[tuple[DeviationScale, Fraction], ...] = ()

    @classmethod
    def of(cls, scene: Scene, texts: Mapping[str, str], noise: Mapping[str, str] | None = None) -> Tolerance:
        """Read it from texts by quantity, and the noise at every throw beside it."""
        fixed, varying = list[tuple[DeviationScale, Fraction]](), list[tuple[DeviationScale, Fraction]]()
        if not texts:
            raise AnswerError(
                "the tolerance", "empty", "deviations by quantity", "give the scene [tolerance]"
            )
        readings = [
            *(
                (name, text, None)
                for name, text in texts.items()
                if name != "landing.x" or name not in (noise or ())
            ),
            *((name, text, "per-throw") for name, text in (noise or {}).items()),
        ]
        for name, text, reading in readings:
            deviation(text, name, scene.unit, key=f'tolerance."{name}"')  # refuses what is none
            one, given = deviation_scale(scene, name, reading), parsed_deviation(text, name)
            one = replace(one, unit=given.unit)
            if name == "throw.speed" and one.key != name and given.unit != "%":
                raise AnswerError("the tolerance", text, "percent, for a scene given by kappa", "give it so")
            (fixed if one.reading == "fixed" else varying).append((one, Fraction(given.number)))
        return cls(tuple(one for one, _ in fixed), tuple(size for _, size in fixed), tuple(varying))

    @classmethod
    def alone(cls, one: DeviationScale) -> Tolerance:
        """Return one quantity, by 1 of its unit."""
        return cls((one,), (Fraction(1),)) if one.reading == "fixed" else cls((), (), ((one, Fraction(1)),))

    @cached_property
    def deviations(self) -> dict[str, Deviation]:
        """What is fixed but unknown, in floats of the scene's units."""
        return {one.quantity: one.deviation(size) for one, size in zip(self.scales, self.sizes, strict=True)}

    @cached_property
    def scatter(self) -> float:
        """How far landings are off, in floats [length]; 0 where they are not."""
        return sum(one.deviation(size).value for one, size in self.varying if one.quantity == "landing.x")

    def noise(self, factor: Fraction) -> dict[str, str]:
        """Say what differs at every throw."""
        return {one.quantity: one.text(short(factor * size)) for one, size in self.varying}

    def texts(self, factor: Fraction) -> dict[str, str]:
        """Say what is fixed but unknown, as `limitsets.certify` takes it."""
        return {
            one.quantity: one.text(factor * size) for one, size in zip(self.scales, self.sizes, strict=True)
        }

    def corner(self, factor: Fraction, signs: Sequence[int]) -> SceneBox | None:
        """Return the scene at a corner of the box stretched by a factor, exactly; None where nothing is fixed."""
        ends = zip(self.scales, self.sizes, signs, strict=True)
        return self._piece([one.at(factor * size * sign) for one, size, sign in ends])

    def piece(self, low: Parts, high: Parts, factor: Fraction) -> SceneBox | None:
        """Return the scenes between two corners, given as parts of the whole deviation."""
        ends = zip(self.scales, self.sizes, low, high, strict=True)
        return self._piece(
            [one.between(factor * size * lo, factor * size * hi) for one, size, lo, hi in ends]
        )

    def _piece(self, spans: Sequence[RationalInterval]) -> SceneBox | None:
        keys = [one.key for one in self.scales]
        return SceneBox(self.scales[0].scene, dict(zip(keys, spans, strict=True))) if keys else None

    def scene_at(self, scene: Scene, factor: float, signs: Sequence[float]) -> Scene | None:
        """Give another scene, in floats, at a corner of the same box about it; None where there is no such part."""
        values: dict[str, float | str] = {}
        for (name, size), sign in zip(self.deviations.items(), signs, strict=True):
            if name == "throw.speed" and "kappa" in scene.text["throw"]:
                share = factor * sign * size.value
                if not share > -1.0:
                    return None
                values["throw.kappa"] = scene.kappa / (1.0 + share) ** 2
            else:
                value = scene.value(name)
                # a share of a negative value is negative, here as in a proof
                values[name] = value + factor * sign * (size.value * value if size.relative else size.value)
        try:
            return scene.with_values(values)
        except SceneError:
            return None
