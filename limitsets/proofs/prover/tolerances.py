"""Tolerances: quantities that are fixed but unknown (time-invariant uncertainty), as boxes of a scene.

A box of quantities is proved piece by piece: a piece that cannot be proved as a whole is halved along the quantity
that is widest relative to its tolerance.  Subdivision is sound because the quantity is the same at every throw; for
noise, which differs at every throw, it would be unsound.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any

from limitsets.base import AnswerError, SceneError
from limitsets.feeder.scene import Scene, unit_of
from limitsets.feeder.scene.quantities import find, text_at
from limitsets.feeder.scene.units import exact_factor, parse, share_of_pi
from limitsets.proofs.prover.numbers import RationalInterval

NARROWER = "lower the tolerance or noise"


# Digits to which a bound that is no short decimal is written, outward.
DIGITS = 25


def decimal(value: Fraction, *, up: bool = False) -> str:
    """Write a rational as a decimal, rounded down or up if it has no short one.

    Examples
    --------
    >>> decimal(Fraction(-397, 1000)), decimal(Fraction(12))
    ('-0.397', '12')
    """
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
        spelled = {}
        for name, span in self.spans.items():
            unit = parse(text_at(self.scene.text, name), find(name).dimension).unit
            spelled[name] = [f"{decimal(span.lo)} {unit}", f"{decimal(span.hi, up=True)} {unit}"]
        return spelled

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
    _require_plate(scene, spans)
    return SceneBox(scene, spans)


def _require_plate(scene: Scene, spans: Mapping[str, RationalInterval]) -> None:
    """Refuse a tolerance at a corner of which an outline crosses itself or a hole, as far as 16 corners show it."""
    moved = {name: span for name, span in spans.items() if name.startswith("part.vertices")}
    if moved and (scene.holes or len(scene.outline) > len(scene.vertices)):
        for _, ends in zip(
            range(16), product(*((span.lo, span.hi) for span in moved.values())), strict=False
        ):
            units = [unit_of(scene, name) for name in moved]
            texts = {
                name: f"{decimal(end)} {unit}" for name, end, unit in zip(moved, ends, units, strict=True)
            }
            try:
                scene.with_values(texts)
            except SceneError as error:
                if error.key in ("part.vertices", "part.holes"):
                    allowed = f"{error.allowed}, throughout"
                    raise AnswerError(error.thing, error.value, allowed, NARROWER) from None
