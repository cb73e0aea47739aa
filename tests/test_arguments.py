"""Which values fit an annotation, and which are refused: the table is Python's and numpy's own idea of each kind."""

import types
from pathlib import Path

import numpy as np
import pytest

from limitsets.base.arguments import arguments_checked
from limitsets.base.errors import AnswerError


class Scene:
    """Known to the check by its name."""


class Smaller(Scene):
    pass


def _one(value):
    return value


def _rest(*value):
    return value


def _by_keyword(*, value):
    return value


def _taking(annotation, function=_one):
    """A checked function of one argument with that annotation."""
    own = types.FunctionType(function.__code__, {}, "taken")
    own.__annotations__ = {"value": annotation}
    return arguments_checked(own)


FITS = [
    ("int", 3, True),
    ("int", np.int64(3), True),
    ("int", True, False),
    ("int", 3.0, False),
    ("float", 3, True),
    ("float", np.float32(0.5), True),
    ("float", float("inf"), True),
    ("float", float("nan"), False),
    ("float", True, False),
    ("bool", True, True),
    ("bool", np.bool_(True), True),
    ("bool", 1, False),
    ("Path", Path("x"), True),
    ("Path", "x", True),
    ("Path", 3, False),
    ("Sequence[float]", np.array([1.0, 2.0]), True),
    ("Sequence[float]", [1.0, "x"], False),
    ("Sequence[str]", "letters", False),
    ("Scene", Scene(), True),
    ("Scene", Smaller(), True),
    ("Scene", "a file", False),
    ("Scene | str", "a file", True),
    ("Scene | str", 3, True),  # the reader of scenes refuses the number, and says more
    ("Mapping[str, float]", {"a": 1.0}, True),
    ("Mapping[str, float]", {"a": "1.0"}, False),
    ("Mapping[str, float]", ["a"], False),
    ("tuple[float, int]", (1.0, 2), True),
    ("tuple[float, int]", [1.0, 2], True),
    ("tuple[float, int]", (1.0, 2.5), False),
    ("tuple[float, int]", (1.0, 2, 3), False),
    ("Callable[[str, int], None]", print, True),
    ("Callable[[str, int], None]", "print", False),
    ("float | None", None, True),
    ("float | None", "x", False),
    ("Unknown | None", "x", True),
]


@pytest.mark.parametrize(("annotation", "value", "fits"), FITS, ids=lambda each: repr(each)[:30])
def test_a_value_fits_or_is_refused(annotation, value, fits):
    taken = _taking(annotation)
    if fits:
        assert taken(value) is value
        assert taken(value=value) is value
        return
    for call in (lambda: taken(value), lambda: taken(value=value)):
        with pytest.raises(AnswerError, match="the argument value of taken"):
            call()


def test_each_of_the_rest_and_those_by_keyword_alone_are_asked():
    assert _taking("int", _rest)(1, 2) == (1, 2)
    with pytest.raises(AnswerError, match="'x'"):
        _taking("int", _rest)(1, "x")
    with pytest.raises(AnswerError, match="'x'"):
        _taking("int", _by_keyword)(value="x")
    with pytest.raises(
        TypeError, match="positional"
    ):  # Python's own: not held against the next parameter's kind
        _taking("int", _by_keyword)("x")
