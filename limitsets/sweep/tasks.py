"""Tasks: functions that answer for points of a plan, known to every process by their importable name.

Any importable function is a task: it takes one scene (or one map's parameters) and returns numbers, or arrays of
numbers, by name.  A function that takes a block of points at once is registered (`block_task`), with its variables.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from limitsets.errors import LimitsetsError
from limitsets.sweep.subjects import Points

Task = TypeVar("Task", bound=Callable[..., Any])


@dataclass(frozen=True)
class Variable:
    """What a task answers of every point.

    Parameters
    ----------
    dtype : str
        Of its numbers: ``"float64"``, ``"int8"``.
    dims : tuple of (str, int)
        Names and lengths of the axes it has beyond those of the plan.
    unit : str
        Unit of its numbers; ``"length"`` stands for that of the scene.
    codes : mapping of str to int
        Names of codes, for integers that are codes.
    about : str
        What it is, in words.
    fill : int
        Of integers, where there is nothing; of floats that is nan.
    default : bool
        Whether it is computed unless others are asked for.
    copied : bool
        Whether points that refinement fills get it from their neighbour.
    """

    dtype: str = "float64"
    dims: tuple[tuple[str, int], ...] = ()
    unit: str = ""
    codes: Mapping[str, int] = field(default_factory=dict)
    about: str = ""
    fill: int = -1
    default: bool = True
    copied: bool = True

    @property
    def empty(self) -> float | int:
        """What stands where there is nothing."""
        return np.nan if np.dtype(self.dtype).kind == "f" else self.fill

    def is_empty(self, values: npt.NDArray[Any]) -> bool:
        """Whether an array holds nothing."""
        none = np.isnan(values) if values.dtype.kind == "f" else values == self.fill
        return bool(none.all())


class Block(NamedTuple):
    """What a block task is given: n points that can be.

    Attributes
    ----------
    points : Points
        Stacked parameters and domains.
    numbers : ndarray of int64, shape (n,)
        Of the points in the plan, for seeds.
    seed : int
        Of the plan.
    wanted : frozenset of str
        The variables asked for.
    subject : SceneSubject or MapSubject
        What is varied.
    values : mapping of str to ndarray, shape (n,)
        Of the axes, in the units of the scene.
    """

    points: Points
    numbers: npt.NDArray[np.int64]
    seed: int
    wanted: frozenset[str]
    subject: Any
    values: Mapping[str, npt.NDArray[np.float64]]


class Coded(NamedTuple):
    """Codes at n points whose names are known only when they are met, and these names."""

    values: npt.NDArray[Any]
    codes: Mapping[str, int]


class BlockTask(NamedTuple):
    """A registered block task: the function, and its variables for a subject."""

    function: Callable[..., Mapping[str, npt.NDArray[Any] | Coded]]
    variables: Callable[..., Mapping[str, Variable]]


_BLOCKS: dict[Callable[..., Any], BlockTask] = {}


def block_task(variables: Callable[..., Mapping[str, Variable]]) -> Callable[[Task], Task]:
    """Register a task that takes a block of points at once.

    Parameters
    ----------
    variables : callable
        ``variables(subject, **options)``: what the task returns, by name.

    Returns
    -------
    callable
        A decorator for ``task(block, **options)``, which returns an array of shape (n, ...) for each wanted variable.

    Examples
    --------
    >>> @block_task(lambda subject: {"kappa": Variable(unit="length")})
    ... def kappas(block):
    ...     return {"kappa": block.points.params.kappa}
    """

    def register(function: Task) -> Task:
        _BLOCKS[function] = BlockTask(function, variables)
        return function

    return register


def registered(function: Callable[..., Any]) -> BlockTask | None:
    """Return the registration of a block task; None for a task that takes one scene or map."""
    return _BLOCKS.get(function)


def named(task: object) -> str:
    """Return the importable name of a task, ``module:function``.

    Raises
    ------
    LimitsetsError
        For what other processes cannot import.

    Examples
    --------
    >>> import math
    >>> named("package.module:function"), named(math.hypot)
    ('package.module:function', 'math:hypot')
    """
    name = (
        task
        if isinstance(task, str)
        else f"{getattr(task, '__module__', None)}:{getattr(task, '__qualname__', '')}"
    )
    module, _, function = name.partition(":")
    if not module or not all(word.isidentifier() for word in (*module.split("."), *function.split("."))):
        raise LimitsetsError(
            "the task", name, "module:function, or a function of a module",
            "workers import it by its name: move it to the top of a file",
        )  # fmt: skip
    return name


def resolved(name: str) -> Callable[..., Any]:
    """Import a task by its name.

    Raises
    ------
    LimitsetsError
        There is no such module or function.
    """
    module, _, function = name.partition(":")
    try:
        found: Any = importlib.import_module(module)
        for word in function.split("."):
            found = getattr(found, word)
    except (ImportError, AttributeError) as error:
        raise LimitsetsError("the task", name, "module:function that can be imported", f"{error}") from None
    if not callable(found):
        raise LimitsetsError("the task", name, "a function", "it is none")
    return found  # type: ignore[no-any-return]  # of a task that is known by name
