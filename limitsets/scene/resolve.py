"""Convert text to numbers in the scene's unit; every error names its place in the file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from limitsets.errors import GeometryError, SceneError, shown
from limitsets.scene.quantities import base_unit
from limitsets.scene.units import convert, parse

LEAST = 1e-12
"""Least size of what has to be above 0, in the scene's units."""


@dataclass(frozen=True)
class Resolver:
    """Knows the scene's unit of length and its file.

    Parameters
    ----------
    unit : str
        The scene's unit of length.
    file : str or None
        Where the scene was read from.
    """

    unit: str
    file: str | None

    def value(self, text: str, dimension: str, key: str) -> float:
        """Give a quantity in the scene's units."""
        quantity = parse(text, dimension, key=key, file=self.file)
        return convert(quantity, base_unit(dimension, self.unit))

    def positive(self, text: str, dimension: str, key: str) -> float:
        """Give a quantity that has to be above 0, and far enough from it for its square to be a number."""
        value = self.value(text, dimension, key)
        if not value >= LEAST:
            allowed = "above 0" if value <= 0 else f"from {LEAST:g} {base_unit(dimension, self.unit)}"
            raise self.refusal(key, f"this {dimension}", text, allowed, "correct it")
        return value

    def refusal(self, key: str, thing: str, value: object, allowed: str, remedy: str) -> SceneError:
        """Build the error for a key."""
        return SceneError(thing, shown(value), allowed, remedy, key=key, file=self.file)

    @contextmanager
    def at(self, key: str) -> Iterator[None]:
        """Give errors of the geometry their place and their unit."""
        try:
            yield
        except GeometryError as error:
            raise type(error)(
                error.thing,
                error.value,
                error.allowed,
                error.remedy.replace("[length]", self.unit),
                key=key,
                file=self.file,
            ) from None
