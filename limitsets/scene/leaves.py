"""The leaf types of the schema: each carries the allowed values and the remedy, so that errors read alike.

Values remain text; `build` gives them units.  Only `schema` imports this file: pydantic takes 0.1 s.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, TypeAlias

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from limitsets.errors import SceneError
from limitsets.scene.units import density_dimension, parse


def _refusal(thing: str, allowed: str, remedy: str) -> PydanticCustomError:
    return PydanticCustomError("refused", "{thing}", {"thing": thing, "allowed": allowed, "remedy": remedy})


def quantity(dimension: str) -> BeforeValidator:
    """Take a number with a unit of a dimension."""
    return _quantity_of(lambda _: dimension)


def _quantity_of(dimension: Callable[[object], str]) -> BeforeValidator:
    def check(value: object) -> object:
        try:
            parse(value, dimension(value))
        except SceneError as error:
            raise _refusal(error.thing, error.allowed, error.remedy) from None
        return value

    return BeforeValidator(check)


def _fitting(fits: Callable[[Any], bool], thing: str, allowed: str, remedy: str) -> BeforeValidator:
    def check(value: object) -> object:
        if not fits(value):
            raise _refusal(thing, allowed, remedy)
        return value

    return BeforeValidator(check)


def number(thing: str, most: float, example: str) -> BeforeValidator:
    """Take a number without a unit."""

    def fits(value: object) -> bool:
        return isinstance(value, float | int) and not isinstance(value, bool) and 0 <= value <= most

    return _fitting(fits, thing, f"a number from 0 to {most:g}, without a unit", f"write it like {example}")


def word(*words: str) -> BeforeValidator:
    """Take one of a few words."""
    allowed = " or ".join(f'"{word}"' for word in words)
    return _fitting(lambda value: value in words, "this word", allowed, "write one of them")


def _is_side(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1000


def _is_name(value: object) -> bool:
    return (
        isinstance(value, str)
        and 0 < len(value) <= 64
        and value[0].isalnum()
        and all(sign.isalnum() or sign in " ._-" for sign in value)
    )


Length: TypeAlias = Annotated[str, quantity("length")]
Pair: TypeAlias = Annotated[list[Length], Field(min_length=2, max_length=2)]
Angle: TypeAlias = Annotated[str, quantity("angle")]
AngularSpeed: TypeAlias = Annotated[str, quantity("angular speed")]
Acceleration: TypeAlias = Annotated[str, quantity("acceleration")]
Mass: TypeAlias = Annotated[str, quantity("mass")]
Density: TypeAlias = Annotated[str, _quantity_of(density_dimension)]
Flag: TypeAlias = Annotated[
    bool,
    _fitting(lambda value: isinstance(value, bool), "this switch", "true or false", "write it unquoted"),
]
Yes: TypeAlias = Annotated[
    bool,
    _fitting(lambda value: value is True, "this goal", "true", "leave the line out if it is not asked for"),
]
SideNumber: TypeAlias = Annotated[
    int, _fitting(_is_side, "the side", "a whole number from 0", "count the sides in flip order")
]
Flight: TypeAlias = Annotated[str, word("exact", "small-angle", "small-angle-2")]
Flip: TypeAlias = Annotated[str, word("signed", "energy")]
Tips: TypeAlias = Annotated[str, word("moving", "rest")]
Deviation: TypeAlias = Annotated[
    str,
    _fitting(
        lambda value: isinstance(value, str),
        "this deviation",
        'text, "<decimal number> %" or "<decimal number> <unit>"',
        'write it like "1 %"; names with a point are quoted: "throw.speed" = "1 %"',
    ),
]
Name: TypeAlias = Annotated[
    str,
    _fitting(
        _is_name,
        "the name",  # it becomes part of file names
        "1 to 64 letters, digits, blanks and . _ -, beginning with a letter or digit",
        "choose such a name",
    ),
]


def says(text: str, example: object = None) -> Any:
    """Describe a key, with an example of its value: the words of `limitsets new`."""
    return Field(description=text, examples=None if example is None else [example])
