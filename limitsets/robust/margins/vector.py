"""A vector of tolerances: deviations of several quantities at once, and the boxes of scenes between two of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction

from limitsets.errors import AnswerError
from limitsets.proofs.tolerance import Piece
from limitsets.robust.margins.deviations import Measure, measure, short
from limitsets.robust.margins.effect import scene_at
from limitsets.scene import Scene
from limitsets.scene.quantities import deviation, parsed_deviation

__all__ = ["Parts", "Tolerance"]

Parts = tuple[Fraction, ...]


@dataclass(frozen=True, eq=False)
class Tolerance:
    """A vector of deviations.

    Attributes
    ----------
    measures : tuple of Measure
        What is fixed but unknown.
    sizes : tuple of Fraction
        A size for each.
    landing : Measure or None
        Where parts land, at every throw, if that is in it.
    landing_size : Fraction
        How far.
    """

    measures: tuple[Measure, ...]
    sizes: Parts
    landing: Measure | None
    landing_size: Fraction

    @classmethod
    def of(cls, scene: Scene, texts: Mapping[str, str]) -> Tolerance:
        """Read it from texts by quantity."""
        measures, sizes, landing, landing_size = [], [], None, Fraction(0)
        if not texts:
            raise AnswerError(
                "the tolerance", "empty", "deviations by quantity", "give the scene [tolerance]"
            )
        for name, text in texts.items():
            deviation(text, name, scene.unit, key=f'tolerance."{name}"')
            one = measure(scene, name)
            given = parsed_deviation(text, name)
            one = replace(one, unit=given.unit)
            if name == "throw.speed" and one.key != name and given.unit != "%":
                raise AnswerError("the tolerance", text, "percent, for a scene given by kappa", "give it so")
            if name == "landing.x":
                landing, landing_size = one, Fraction(given.number)
            else:
                measures.append(one)
                sizes.append(Fraction(given.number))
        return cls(tuple(measures), tuple(sizes), landing, landing_size)

    def noise(self, factor: Fraction) -> dict[str, str]:
        """Say what differs at every throw."""
        return (
            {}
            if self.landing is None
            else {"landing.x": self.landing.text(short(factor * self.landing_size))}
        )

    def texts(self, factor: Fraction) -> dict[str, str]:
        """Say what is fixed but unknown, as `limitsets.certify` takes it."""
        return {
            one.quantity: one.text(factor * size) for one, size in zip(self.measures, self.sizes, strict=True)
        }

    def corner(self, factor: Fraction, signs: tuple[int, ...]) -> Piece | None:
        """Return the scene at one corner."""
        if not self.measures:
            return None
        sizes = [factor * size * sign for size, sign in zip(self.sizes, signs, strict=True)]
        return scene_at(self.measures, sizes)

    def piece(self, low: Parts, high: Parts, factor: Fraction) -> Piece | None:
        """Return the scenes between two corners, given as parts of the whole deviation."""
        if not self.measures:
            return None
        spans = {
            one.key: one.between(factor * size * lo, factor * size * hi)
            for one, size, lo, hi in zip(self.measures, self.sizes, low, high, strict=True)
        }
        return Piece(self.measures[0].scene, spans)
