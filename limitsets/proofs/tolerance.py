"""Tolerances: quantities that are fixed but unknown (time-invariant uncertainty).

A box of quantities is proved piece by piece: a piece that cannot be proved as a whole is halved along the quantity that
is widest relative to its tolerance.  Subdivision is sound because the quantity is the same at every throw; for noise,
which differs at every throw, it would be unsound.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any

from limitsets.errors import AnswerError
from limitsets.proofs.rational import RationalInterval
from limitsets.scene import Scene
from limitsets.scene.quantities import find, text_at
from limitsets.scene.units import exact_factor, parse, share_of_pi

# Digits to which a bound that is no short decimal is written, outward.
DIGITS = 25


def _decimal(value: Fraction, up: bool) -> str:
    """Write a rational as a decimal, outward if it has no short one."""
    scale = 10**DIGITS
    scaled = value * scale
    whole_part = math.ceil(scaled) if up else math.floor(scaled)
    sign, digits = ("-" if whole_part < 0 else ""), str(abs(whole_part)).rjust(DIGITS + 1, "0")
    return f"{sign}{digits[:-DIGITS]}.{digits[-DIGITS:]}".rstrip("0").rstrip(".")


@dataclass(frozen=True)
class SceneBox:
    """A box of quantities of a scene.

    Attributes
    ----------
    scene : Scene
        The scene they belong to.
    spans : dict of str to RationalInterval
        Per quantity, in the unit in which the scene gives it.
    """

    scene: Scene
    spans: dict[str, RationalInterval]

    def texts(self) -> dict[str, list[str]]:
        """Both ends of each quantity, as text with the unit in which the scene gives it."""
        found = {}
        for name, span in self.spans.items():
            unit = parse(text_at(self.scene.text, name), find(name).dimension).unit
            found[name] = [f"{_decimal(span.lo, up=False)} {unit}", f"{_decimal(span.hi, up=True)} {unit}"]
        return found

    def tree(self) -> dict[str, Any]:
        """Write the scene as text, each of the quantities a pair of texts."""
        tree: dict[str, Any] = copy.deepcopy(dict(self.scene.text))
        for name, pair in self.texts().items():
            *path, last = find(name).path
            node: Any = tree
            for word in path:
                node = node[word]
            node[last] = pair
        return tree

    def halves(self, scales: Mapping[str, Fraction]) -> tuple[SceneBox, SceneBox]:
        """Cut along the quantity that is widest against its scale."""
        name = max(self.spans, key=lambda key: (self.spans[key].hi - self.spans[key].lo) / scales[key])
        span = self.spans[name]
        middle = (span.lo + span.hi) / 2
        lower, upper = RationalInterval(span.lo, middle), RationalInterval(middle, span.hi)
        return SceneBox(self.scene, {**self.spans, name: lower}), SceneBox(
            self.scene, {**self.spans, name: upper}
        )

    def corners(self) -> Iterator[SceneBox]:
        """Yield the scenes at the corners, the first 16 of them."""
        ends = [(RationalInterval(s.lo, s.lo), RationalInterval(s.hi, s.hi)) for s in self.spans.values()]
        for _, chosen in zip(range(16), product(*ends), strict=False):
            yield SceneBox(self.scene, dict(zip(self.spans, chosen, strict=True)))


def whole(scene: Scene, tolerance: Mapping[str, str]) -> SceneBox:
    """Build the box that a tolerance stands for.

    Parameters
    ----------
    scene : Scene
        The scene.
    tolerance : mapping of str to str
        Symmetric deviations by quantity, ``{"throw.speed": "0.7 %"}`` or ``{"arm.surface_height": "0.01 in"}``.

    Raises
    ------
    AnswerError
        A quantity that the scene does not give.
    """
    spans = {}
    for name, text in tolerance.items():
        relative = text.rstrip().endswith("%")
        quantity = parse(text, "share" if relative else find(name).dimension)
        share = Fraction(quantity.number) / 100
        if name == "throw.speed" and "kappa" in scene.text["throw"]:
            # the scene gives kappa = g / w^2: a slower throw is a larger kappa
            if not relative:
                raise AnswerError(
                    "the tolerance", text, "percent, for a scene given by kappa", "give it in percent"
                )
            if "throw.kappa" in tolerance:
                raise AnswerError(
                    "the tolerance", name, "of throw.speed or of throw.kappa", "leave one of them out"
                )
            kappa = Fraction(parse(scene.text["throw"]["kappa"], "length").number)
            spans["throw.kappa"] = RationalInterval(kappa / (1 + share) ** 2, kappa / (1 - share) ** 2)
            continue
        node = text_at(scene.text, name)
        if node is None:
            raise AnswerError("the tolerance", name, "a quantity that the scene gives", "name another")
        given = parse(node, find(name).dimension)
        nominal = Fraction(given.number)
        if not relative and (share_of_pi(quantity.unit) is None) != (share_of_pi(given.unit) is None):
            raise AnswerError("the tolerance", text, f"percent, or the scene's {given.unit}", "convert it")
        factor = Fraction(1) if relative else exact_factor(quantity.unit, given.unit)
        half = abs(nominal) * share if relative else Fraction(quantity.number) * factor
        spans[name] = RationalInterval(nominal - half, nominal + half)
    return SceneBox(scene, spans)
