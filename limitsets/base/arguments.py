"""Arguments of public functions, held against their annotations: where mypy does not look, a person learns what fits.

What a value must be beyond its kind (from 1 on, one of these words) each function says itself.
"""

from __future__ import annotations

import ast
import inspect
import math
import numbers
import os
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from typing import Any, NamedTuple, NoReturn, ParamSpec, TypeVar

from limitsets.base.errors import AnswerError, shown

P = ParamSpec("P")
R = TypeVar("R")

# Class -> the call that gives one.  A class is known by its name: the rooms are above this file.
GIVEN_BY = {
    "Analysis": "limitsets.analyse(scene)",
    "Assembly": "limitsets.assemble(scene, scene2)",
    "Atlas": "limitsets.atlas(scene, x, y)",
    "Attractor": "limitsets.attractors(graph)",
    "Audit": "limitsets.audit(scene)",
    "Basins": "limitsets.basins(graph, limitsets.attractors(graph))",
    "Continuation": "limitsets.continuation(scene, path)",
    "Design": "limitsets.design(scene, ...)",
    "Discrepancy": "limitsets.discrepancy(scene)",
    "Domain": "limitsets.grid([(0, 1)]).domain",
    "DiGraph": "limitsets.morse_graph(graph)",
    "Feeding": "limitsets.feed(scene)",
    "FilmedThrows": "limitsets.fitting.throws_of_film(scene, file)",
    "Fit": "limitsets.fit(scene, file)",
    "Grid": "limitsets.grid(scene.domain, cells=1024)",
    "Levels": "limitsets.robust.noise_levels(scene)",
    "Machines": "limitsets.fit(scene, file).machines",
    "Margin": "limitsets.margin(scene)",
    "MarginsBeyond": "limitsets.robustness(scene).curve(side)",
    "NoiseStatistics": "limitsets.noise_statistics(scene)",
    "RobustDesign": "limitsets.robust_design(scene)",
    "SampledStatistics": "limitsets.robust.sampled_statistics(scene)",
    "Scattering": "limitsets.robust.Scattering(speed=limitsets.robust.Gaussian(0.01))",
    "Scene": 'limitsets.load("paper-designed")',
    "Stability": "limitsets.proofs.prover.stability.stability(scene)",
    "Synthesis": "limitsets.feedback(scene)",
    "TransitionGraph": "limitsets.transitions(scene.map, limitsets.grid(scene.domain))",
    "TrayFill": "limitsets.tray(scene)",
}


class _Kind(NamedTuple):
    """What an annotation asks for: a test, its words, and the call that gives such a thing where one is known."""

    fits: Callable[[Any], bool]
    words: str
    call: str = ""


def _is_number(value: Any) -> bool:
    return isinstance(value, numbers.Real) and not isinstance(value, bool) and not math.isnan(value)


_PLAIN = {
    "int": _Kind(
        lambda value: isinstance(value, numbers.Integral) and not isinstance(value, bool), "a whole number"
    ),
    "float": _Kind(_is_number, "a number"),
    "bool": _Kind(lambda value: type(value).__name__ == "bool", "True or False"),  # Python's, or numpy's
    "str": _Kind(lambda value: isinstance(value, str), "text"),
    "Path": _Kind(lambda value: isinstance(value, str | os.PathLike), "a path"),
    "None": _Kind(lambda value: value is None, "None"),
    "Callable": _Kind(callable, "a function"),
    "LaidLike": _Kind(lambda value: isinstance(value, Mapping), "a dict by side, like {0: [(8.0, 20.0)]}"),
    "Progress": _Kind(callable, "a function of (step, done, of)"),
    "Tell": _Kind(callable, "a function of (step, done, of)"),
}


def _all_fit(kind: _Kind | None) -> Callable[[Any], bool]:
    """Say whether a list holds nothing but what fits; a text is no list of its letters."""

    def fits(value: Any) -> bool:
        if isinstance(value, str | bytes) or not (isinstance(value, Sequence) or hasattr(value, "__array__")):
            return False
        return kind is None or all(map(kind.fits, value))

    return fits


def _kind_of(node: ast.expr) -> _Kind | None:
    """Read an annotation; None for one of which this file knows nothing, which lets everything pass."""
    if isinstance(node, ast.BinOp):  # a union
        one, two = _kind_of(node.left), _kind_of(node.right)
        if one is None or two is None:
            return None
        words = f"{one.words} or {two.words}"
        return _Kind(
            lambda value: one.fits(value) or two.fits(value),
            words,
            " or ".join(filter(None, (one.call, two.call))),
        )
    if isinstance(node, ast.Subscript):
        return _kind_of_many(node)
    name = node.attr if isinstance(node, ast.Attribute) else ast.unparse(node)
    if name in GIVEN_BY:
        call = GIVEN_BY[name]
        words = f"what {call.partition('(')[0]} gives"
        return _Kind(lambda value: name in {each.__name__ for each in type(value).__mro__}, words, call)
    return _PLAIN.get(name)


def _kind_of_many(node: ast.Subscript) -> _Kind | None:
    """Read an annotation with brackets."""
    outer = ast.unparse(node.value).rpartition(".")[2]
    inner = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
    if outer == "Mapping":
        value_kind = _kind_of(inner[1])
        return _Kind(
            lambda value: (
                isinstance(value, Mapping)
                and (value_kind is None or all(map(value_kind.fits, value.values())))
            ),
            "a dict" + (f" whose values are {value_kind.words}" if value_kind else ""),
        )
    if outer in ("Sequence", "tuple") and (outer == "Sequence" or ast.unparse(inner[-1]) == "..."):
        one = _kind_of(inner[0])
        return _Kind(_all_fit(one), ("a list" + (f" of {one.words}" if one else "")), one.call if one else "")
    if outer == "tuple":
        several = [_kind_of(each) for each in inner]
        return _Kind(
            lambda value: (
                isinstance(value, tuple | list)
                and len(value) == len(several)
                and all(kind is None or kind.fits(each) for kind, each in zip(several, value, strict=True))
            ),
            f"({', '.join(kind.words if kind else '...' for kind in several)})",
        )
    return _kind_of(node.value)


def _asked_of(annotation: str) -> _Kind | None:
    kind = _kind_of(ast.parse(annotation, mode="eval").body)
    # a scene or the text of one: limitsets.load refuses the rest, and says of each what to do
    return None if kind is None or {"Scene", "str"} <= set(annotation.split(" | ")) else kind


def arguments_checked(function: Callable[P, R], public: str = "") -> Callable[P, R]:
    """Refuse arguments of another kind than the function's annotations say, before it begins.

    Raises
    ------
    AnswerError
        By the function: the argument, what was given, what fits and what to pass.  The function goes by its own name,
        or by `public`.

    Examples
    --------
    >>> @arguments_checked
    ... def twice(count: int = 3) -> int:
    ...     return 2 * count
    >>> twice("many")
    Traceback (most recent call last):
    limitsets.base.errors.AnswerError: the argument count of twice is 'many'; allowed: a whole number; pass count=3
    """
    parameters = inspect.signature(function).parameters
    ends: dict[Any, int | None] = {inspect.Parameter.VAR_POSITIONAL: None, inspect.Parameter.KEYWORD_ONLY: 0}
    asked = []  # the slice: where its values stand among the arguments that are given without names
    for place, (name, each) in enumerate(parameters.items()):
        kind = _asked_of(each.annotation) if isinstance(each.annotation, str) else None
        if kind is not None:
            asked.append((name, kind, slice(place, ends.get(each.kind, place + 1))))
    called = public or function.__name__

    def refuse(name: str, value: object, kind: _Kind) -> NoReturn:
        usual = parameters[name].default
        remedy = f"help({called}) says more"
        if kind.call:
            remedy = f"pass {kind.call}"
        elif isinstance(usual, int | str) or _is_number(usual):
            remedy = f"pass {name}={usual!r}"
        raise AnswerError(f"the argument {name} of {called}", shown(value), kind.words, remedy)

    @wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        # one too many or too few Python refuses itself, by the function's name
        for name, kind, place in asked:
            for value in (kwargs[name],) if name in kwargs else args[place]:
                if not kind.fits(value):
                    refuse(name, value, kind)
        return function(*args, **kwargs)

    return checked


def arguments_checked_as(public: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Check as `arguments_checked`; an error says the name of the public function that hands its arguments on."""
    return lambda function: arguments_checked(function, public)
