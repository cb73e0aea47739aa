"""Tasks known by an importable name, and plans: which points of which subject a task answers for, in which chunks."""

from __future__ import annotations

import hashlib
import importlib
import json
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import PackageNotFoundError, version
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from limitsets.base import LimitsetsError, code_digest
from limitsets.parameters.atlas.subjects import Axis, Points, Subject, source_of

# ----------------------------------------------------------------
# Tasks: functions that answer for points of a plan, known to every process by their importable name.
#
# Any importable function is a task: it takes one scene (or one map's parameters) and returns numbers, or arrays of
# numbers, by name.  A function that takes a block of points at once is registered (`block_task`), with its variables.


Task = TypeVar("Task", bound=Callable[..., Any])


def all_are(values: npt.NDArray[Any], fill: Any) -> bool:
    """Whether an array holds nothing but what marks points without an answer: nan, of integers `fill`."""
    return bool((np.isnan(values) if values.dtype.kind == "f" else values == fill).all())


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
        """The value that marks a point without an answer."""
        return np.nan if np.dtype(self.dtype).kind == "f" else self.fill

    def is_empty(self, values: npt.NDArray[Any]) -> bool:
        """Whether an array holds nothing."""
        return all_are(values, self.fill)


def codes_of(attributes: Mapping[str, Any]) -> dict[str, int]:
    """Read the names of a variable's codes from its attributes; empty for a variable without."""
    values = np.atleast_1d(attributes.get("flag_values", [])).tolist()
    return dict(zip(attributes.get("flag_meanings", "").split(), values, strict=True))


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
    """Codes at n points, and the names of those that occur.  The task learns these names only while it runs."""

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
        target: Any = importlib.import_module(module)
        for word in function.split("."):
            target = getattr(target, word)
    except (ImportError, AttributeError) as error:
        raise LimitsetsError("the task", name, "module:function that can be imported", f"{error}") from None
    if not callable(target):
        raise LimitsetsError("the task", name, "a function", "it is none")
    return target  # type: ignore[no-any-return]  # of a task that is known by name


# ----------------------------------------------------------------
# A plan: which points of which subject a task answers for, in which chunks.


Region: TypeAlias = tuple[slice, ...]

# Points of a chunk: a block task does 10 000 in about a second, a task of one scene at a time 64 in some ten.
_BLOCK, _SINGLE = (2500, 10_000), (4, 64)
_CHUNKS = 64
_RELIED_ON = ("limitsets", "numpy", "numba")


def code_of(subject: Subject, task: str) -> dict[str, dict[str, str]]:
    """Return versions of packages, and digests of the code, ours and outside, on which numbers depend."""
    versions = {}
    for package in _RELIED_ON:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:  # sources that are not installed
            versions[package] = ""
    return {
        "versions": versions,
        "sources": {"limitsets": code_digest()} | subject.sources | source_of(task.partition(":")[0]),
    }


@dataclass(frozen=True, eq=False)
class Plan:
    """The points of a sweep and what is asked of them.

    Attributes
    ----------
    subject : SceneSubject or MapSubject
        What is varied.
    axes : tuple of Axis
        The last one runs fastest in the numbers of the points.
    task : str
        Its importable name.
    options : mapping
        Keyword arguments of the task, of numbers, text, lists and tables.
    variables : tuple of str or None
        Those asked for; None for all that the task gives by itself.
    chunk : tuple of int
        Points of a chunk along each axis.
    code : mapping
        Versions and digests of what it runs (`code_of`), as this process has them.
    seed : int
        Of all random numbers.
    refine : (str, int) or None
        Only points where this variable changes are computed, from a coarse grid of this step on; None: all are.
    """

    subject: Subject
    axes: tuple[Axis, ...]
    task: str
    options: Mapping[str, Any]
    variables: tuple[str, ...] | None
    chunk: tuple[int, ...]
    code: Mapping[str, Mapping[str, str]]
    seed: int = 0
    refine: tuple[str, int] | None = None

    @property
    def shape(self) -> tuple[int, ...]:
        """Points along each axis."""
        return tuple(axis.values.size for axis in self.axes)

    @property
    def chunks(self) -> tuple[int, ...]:
        """Chunks along each axis."""
        return tuple(-(-n // step) for n, step in zip(self.shape, self.chunk, strict=True))

    def place(self, number: int) -> tuple[int, ...]:
        """Return where a chunk stands among the chunks."""
        return tuple(int(k) for k in np.unravel_index(number, self.chunks))

    def region(self, number: int) -> Region:
        """Return the points of a chunk, a slice for each axis."""
        steps = zip(self.place(number), self.chunk, self.shape, strict=True)
        return tuple(slice(k * step, min((k + 1) * step, n)) for k, step, n in steps)

    def point(self, number: int) -> Region:
        """Return the region of a single point."""
        return tuple(slice(int(k), int(k) + 1) for k in np.unravel_index(number, self.shape))

    def numbers(self, region: Region) -> npt.NDArray[np.int64]:
        """Return the numbers of the points of a region."""
        return np.ravel_multi_index(tuple(np.ogrid[region]), self.shape).ravel().astype(np.int64)

    @cached_property
    def base(self) -> dict[str, npt.NDArray[np.float64]]:
        """The values of each axis in the units in which scenes hold them."""
        return {axis.name: self.subject.in_base(axis) for axis in self.axes}

    def values(self, region: Region) -> dict[str, npt.NDArray[np.float64]]:
        """Return the values of each axis at every point of a region."""
        parts = [self.base[axis.name][part] for axis, part in zip(self.axes, region, strict=True)]
        grids = np.meshgrid(*parts, indexing="ij")
        return {axis.name: grid.ravel() for axis, grid in zip(self.axes, grids, strict=True)}

    def words(self, region: Region) -> str:
        """Name a region by the values of its axes."""
        spans = [
            (axis, axis.values[part.start], axis.values[part.stop - 1])
            for axis, part in zip(self.axes, region, strict=True)
        ]
        return ", ".join(
            f"{axis.name} {f'{lo:.9g}' if lo == hi else f'{lo:.9g} to {hi:.9g}'} {axis.unit}".rstrip()
            for axis, lo, hi in spans
        )

    @cached_property
    def record(self) -> dict[str, Any]:
        """Everything that the numbers depend on."""
        return {
            **self.subject.record,
            "axes": [axis.record for axis in self.axes],
            "task": self.task,
            "options": json.loads(json.dumps(dict(self.options))),
            "variables": None if self.variables is None else list(self.variables),
            "chunk": list(self.chunk),
            "seed": self.seed,
            "refine": None if self.refine is None else list(self.refine),
            **self.code,
        }

    def require(self) -> None:
        """Refuse a plan that cannot be carried out, before anything is computed."""
        names = [axis.name for axis in self.axes]
        if len(set(names)) < len(names):
            raise LimitsetsError("the axes", ", ".join(names), "different quantities", "name each once")
        task = registered(resolved(self.task))
        self.subject.require(self.base, block=task is not None)
        if task is not None:
            known = task.variables(self.subject, **self.options)
            both = [name for name in names if name in known]
            if both:
                raise LimitsetsError("the axis", both[0], "no variable of the task", "it would be both")
            asked = (*(self.variables or ()), *(self.refine or ())[:1])
            unknown = [name for name in asked if name not in known]
            if unknown:
                raise LimitsetsError("the variable", unknown[0], ", ".join(known), "name some of these")
        try:
            json.dumps(dict(self.options), allow_nan=False)
        except (TypeError, ValueError):
            raise LimitsetsError(
                "the options of the task", dict(self.options), "numbers, text, lists and tables", "pass such"
            ) from None


def digest_of(record: Any) -> str:
    """Return the hash of the record of a plan."""
    return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()


def chunk_shape(shape: tuple[int, ...], task: str) -> tuple[int, ...]:
    """Choose the chunks of a plan: about square, by its size alone, so that every machine chooses the same.

    Examples
    --------
    >>> chunk_shape((1000, 1000), "math:hypot"), chunk_shape((7,), "math:hypot")
    ((8, 8), (4,))
    """
    least, most = _SINGLE if registered(resolved(task)) is None else _BLOCK
    points = min(max(math.prod(shape) // _CHUNKS, least), most)
    chosen: list[tuple[int, int]] = []
    for k, n in sorted(enumerate(shape), key=lambda pair: pair[1]):
        side = max(round(points ** (1 / (len(shape) - len(chosen)))), 1)
        step = -(-n // -(-n // min(side, n)))  # parts of nearly one length
        points = max(points // step, 1)
        chosen.append((k, step))
    return tuple(step for _, step in sorted(chosen))


def require_same_code(plan: Plan) -> None:
    """Refuse to work on a plan that another version made: its points would not be computed alike."""
    for name, here, there in differences(code_of(plan.subject, plan.task), plan.code):
        raise LimitsetsError(
            f"{name} of a worker",
            here,
            f"{there!r}, as where the sweep was started",
            "give workers the same code",
        )


def differences(ours: Any, theirs: Any, name: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Walk two records and give what differs: name, here, there."""
    if isinstance(ours, Mapping) and isinstance(theirs, Mapping):
        for key in (*ours, *(key for key in theirs if key not in ours)):
            inner = f"{name}.{key}" if name else str(key)
            yield from differences(ours.get(key), theirs.get(key), inner)
    elif isinstance(ours, list) and isinstance(theirs, list) and len(ours) == len(theirs):
        for k, (one, other) in enumerate(zip(ours, theirs, strict=True)):
            yield from differences(one, other, f"{name}[{k}]")
    elif ours != theirs:
        yield name, ours, theirs
