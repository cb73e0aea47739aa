"""A vector of tolerances: deviations of several quantities at once, and the scenes and boxes of scenes in it.

A proof takes them exactly, in rational numbers of the units in which people give them; an estimate takes the same
vector in floats, of any scene that gives these quantities.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from limitsets.errors import AnswerError, SceneError
from limitsets.proofs.rational import RationalInterval
from limitsets.proofs.tolerance import SceneBox
from limitsets.robust.margins.deviations import DeviationScale, deviation_scale, short
from limitsets.scene import Scene
from limitsets.scene.facts import Deviation
from limitsets.scene.quantities import deviation, parsed_deviation

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
    varying : DeviationScale or None
        What differs at every throw, if something does: where parts land.
    varying_size : Fraction
        How much.
    """

    scales: tuple[DeviationScale, ...]
    sizes: Parts
    varying: DeviationScale | None = None
    varying_size: Fraction = Fraction(0)

    @classmethod
    def of(cls, scene: Scene, texts: Mapping[str, str]) -> Tolerance:
        """Read it from texts by quantity."""
        scales, sizes, landing, landing_size = list[DeviationScale](), list[Fraction](), None, Fraction(0)
        if not texts:
            raise AnswerError(
                "the tolerance", "empty", "deviations by quantity", "give the scene [tolerance]"
            )
        for name, text in texts.items():
            deviation(text, name, scene.unit, key=f'tolerance."{name}"')  # refuses what is none
            one, given = deviation_scale(scene, name), parsed_deviation(text, name)
            one = replace(one, unit=given.unit)
            if name == "throw.speed" and one.key != name and given.unit != "%":
                raise AnswerError("the tolerance", text, "percent, for a scene given by kappa", "give it so")
            if name == "landing.x":
                landing, landing_size = one, Fraction(given.number)
            else:
                scales.append(one)
                sizes.append(Fraction(given.number))
        return cls(tuple(scales), tuple(sizes), landing, landing_size)

    @classmethod
    def alone(cls, one: DeviationScale) -> Tolerance:
        """Return one quantity, by 1 of its unit."""
        return cls((one,), (Fraction(1),)) if one.reading == "fixed" else cls((), (), one, Fraction(1))

    @cached_property
    def deviations(self) -> dict[str, Deviation]:
        """What is fixed but unknown, in floats of the scene's units."""
        return {one.quantity: one.deviation(size) for one, size in zip(self.scales, self.sizes, strict=True)}

    @cached_property
    def scatter(self) -> float:
        """How far landings are off, in floats [length]; 0 where they are not."""
        return 0.0 if self.varying is None else self.varying.deviation(self.varying_size).value

    def noise(self, factor: Fraction) -> dict[str, str]:
        """Say what differs at every throw."""
        one = self.varying
        return {} if one is None else {one.quantity: one.text(short(factor * self.varying_size))}

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
