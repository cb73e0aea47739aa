"""What a worker does: answer for one chunk of a plan, with boundaries of classes refined."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from limitsets.base import LimitsetsError
from limitsets.parameters.atlas.plan import (
    Block,
    BlockTask,
    Coded,
    Plan,
    Variable,
    registered,
    require_same_code,
    resolved,
)
from limitsets.systems.maps.pieces import chosen

# ----------------------------------------------------------------
# Boundaries of classes, refined: a coarse grid, then only what lies between points that differ.
#
# The points of a chunk are a rectangle of cells.  A cell is filled where all points of it that were computed, on its
# edges too, agree; else it is halved along each axis, and its new corners are computed.  A cell beside one that was
# halved sees the points on their common edge, so a boundary is followed once it is met.  What passes between the points
# of the coarse grid without meeting one is missed: an island, or a tongue, that is narrower than the step.
#
# A chunk is refined by itself, with the points of its own edges, by the worker that has it: the result is that of the
# plan alone, and a sweep that was interrupted goes on.


# Of the coarse grid.
STEP = 8
FILLED = -1

Ints = npt.NDArray[np.int64]


class Refined(NamedTuple):
    """Which points were computed, and which point each point has its answers from.

    Attributes
    ----------
    points : ndarray of int64, shape (m,)
        Those computed, in that order.
    source : ndarray of int64, shape (n,)
        For every point, the place in `points` of itself or of the nearest corner of its cell.
    level : ndarray of int8, shape (n,)
        0 on the coarse grid, then how often cells were halved; -1 for what was filled.
    """

    points: Ints
    source: Ints
    level: npt.NDArray[np.int8]


def refined(shape: tuple[int, ...], step: int, ask: Callable[[Ints], Ints]) -> Refined:
    """Compute the points of a grid that are needed to see where its classes meet.

    Parameters
    ----------
    shape : tuple of int
        Points along one or two axes.
    step : int
        Between the points of the coarse grid, along each axis.
    ask : callable
        Told numbers of points, in the order of the rows, it computes them and returns codes; equal codes, one class.

    Returns
    -------
    Refined

    Examples
    --------
    >>> found = refined((1, 17), 8, lambda points: points // 11)  # classes meet between 10 and 11
    >>> found.points.tolist()
    [0, 8, 16, 12, 10, 11]
    >>> found.level[8:13].tolist()
    [0, -1, 2, 3, 1]
    """
    rows, columns = shape if len(shape) == 2 else (1, *shape)
    source = np.full((rows, columns), -1, np.int64)
    level = np.full((rows, columns), FILLED, np.int8)
    codes = np.zeros((rows, columns), np.int64)
    points = np.zeros(0, np.int64)
    cells = np.array([(*i, *j) for i, j in product(_parts(rows, step), _parts(columns, step))], np.int64)
    depth = np.zeros(len(cells), np.int64)
    new = cells
    while True:
        corners = np.concatenate([new[:, i] * columns + new[:, j] for i in (0, 1) for j in (2, 3)])
        wanted = np.unique(corners[source.ravel()[corners] < 0])
        if wanted.size:
            source.ravel()[wanted] = points.size + np.arange(wanted.size)
            points = np.concatenate([points, wanted])
            codes.ravel()[wanted] = ask(wanted)
            near = np.full(rows * columns, np.iinfo(np.int8).max, np.int8)
            np.minimum.at(near, corners, np.tile(depth[len(cells) - len(new) :], 4).astype(np.int8))
            level.ravel()[wanted] = near[wanted]
        wide = np.maximum(cells[:, 1] - cells[:, 0], cells[:, 3] - cells[:, 2]) > 1
        split = wide & ~_uniform(cells, codes, source >= 0)
        if not split.any():
            break
        new, halves = _halved(cells[split], depth[split] + 1)
        cells, depth = np.concatenate([cells[~split], new]), np.concatenate([depth[~split], halves])
    for i, k, j, m in cells[wide].tolist():
        part = source[i : k + 1, j : m + 1]
        near_rows = np.where(2 * np.arange(k - i + 1) <= k - i, 0, k - i)
        near_columns = np.where(2 * np.arange(m - j + 1) <= m - j, 0, m - j)
        part[:] = np.where(part < 0, part[np.ix_(near_rows, near_columns)], part)
    return Refined(points, source.ravel(), level.ravel())


def _parts(length: int, step: int) -> list[tuple[int, int]]:
    ends = [*range(0, length - 1, step), length - 1]
    return list(pairwise(ends)) if len(ends) > 1 else [(0, 0)]


def _halved(cells: Ints, depth: Ints) -> tuple[Ints, Ints]:
    """Halve cells along each axis along which they have inner points."""
    for lo, hi in ((0, 1), (2, 3)):
        wide = cells[:, hi] - cells[:, lo] > 1
        lower, upper = cells[wide].copy(), cells[wide].copy()
        lower[:, hi] = upper[:, lo] = (lower[:, lo] + lower[:, hi]) // 2
        cells = np.concatenate([cells[~wide], lower, upper])
        depth = np.concatenate([depth[~wide], depth[wide], depth[wide]])
    return cells, depth


def _uniform(cells: Ints, codes: Ints, known: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Whether the known points of each cell have one code: where the mean of squares is the square of the mean."""
    places = np.unique(codes[known], return_inverse=True)[1]
    values = np.zeros(codes.shape, np.int64)
    values[known] = places
    count, total, squares = (_sums(cells, each) for each in (known.astype(np.int64), values, values**2))
    return np.asarray(count * squares == total**2)


def _sums(cells: Ints, values: Ints) -> Ints:
    """Sum an array over cells, their edges with them."""
    table = np.zeros((values.shape[0] + 1, values.shape[1] + 1), np.int64)
    table[1:, 1:] = values.cumsum(axis=0).cumsum(axis=1)
    i, k, j, m = cells[:, 0], cells[:, 1] + 1, cells[:, 2], cells[:, 3] + 1
    return table[k, m] - table[i, m] - table[k, j] + table[i, j]


# ----------------------------------------------------------------
# What a worker does: answer for one chunk of a plan.


COMPUTED, IMPOSSIBLE, REFUSED = 0, 1, 2
_OURS = ("status", "level")
STATUS = Variable(
    dtype="int8",
    codes={"computed": COMPUTED, "impossible": IMPOSSIBLE, "refused": REFUSED},
    about="whether there is such a scene or map, and whether the task answered",
)


LEVEL = Variable(
    dtype="int8",
    about="how often the coarse grid was halved to compute the point; -1: filled from the nearest corner of its cell",
)

Values = Mapping[str, npt.NDArray[np.float64]]
VariableArrays = dict[str, tuple[Variable, npt.NDArray[Any]]]


class Answer(NamedTuple):
    """The answers of one chunk: its number, and a variable and an array of the chunk's shape for each name."""

    number: int
    arrays: VariableArrays


def answer(plan: Plan, number: int) -> Answer:
    """Answer for one chunk."""
    require_same_code(plan)
    region = plan.region(number)
    shape = tuple(part.stop - part.start for part in region)
    values, numbers = plan.values(region), plan.numbers(region)
    arrays = _refined(plan, shape, values, numbers) if plan.refine else _asked(plan, values, numbers)
    return Answer(
        number, {name: (v, each.reshape(*shape, *each.shape[1:])) for name, (v, each) in arrays.items()}
    )


def _asked(plan: Plan, values: Values, numbers: npt.NDArray[np.int64]) -> VariableArrays:
    """Ask the task."""
    function = resolved(plan.task)
    task = registered(function)
    status, arrays = (
        _single(plan, function, values, numbers) if task is None else _block(plan, task, values, numbers)
    )
    return {"status": (STATUS, status), **arrays}


def _refined(
    plan: Plan, shape: tuple[int, ...], values: Values, numbers: npt.NDArray[np.int64]
) -> VariableArrays:
    """Ask the task where its answer changes, and fill the rest."""
    name, step = plan.refine or ("", 1)
    batches: list[VariableArrays] = []
    seen: dict[bytes, int] = {}

    def ask(points: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        arrays = _asked(plan, {axis: each[points] for axis, each in values.items()}, numbers[points])
        batches.append(arrays)
        rows = [arrays[each][1].reshape(points.size, -1) for each in ("status", name) if each in arrays]
        keys = zip(*([row.tobytes() for row in np.ascontiguousarray(part)] for part in rows), strict=True)
        return np.array([seen.setdefault(b"".join(key), len(seen)) for key in keys], np.int64)

    layout = refined(shape, step, ask)
    arrays: VariableArrays = {"level": (LEVEL, layout.level)}
    for each in dict.fromkeys(key for batch in batches for key in batch):
        variable, answers = _joined(plan, each, batches)
        arrays[each] = (variable, answers[layout.source])
        if not variable.copied:
            arrays[each][1][layout.level == FILLED] = variable.empty
    if name not in arrays and (arrays["status"][1] == COMPUTED).any():
        raise _wrong(plan, name, "missing", "the variable by which the atlas is refined")
    return arrays


def _joined(plan: Plan, name: str, batches: list[VariableArrays]) -> tuple[Variable, npt.NDArray[Any]]:
    """Put the answers of batches of points one behind the other."""
    variables = [batch[name][0] for batch in batches if name in batch]
    codes = {word: code for variable in variables for word, code in variable.codes.items()}
    variable, parts = replace(variables[0], codes=codes), []
    more = tuple(n for _, n in variable.dims)
    for batch in batches:
        size = (batch["status"][1].size, *more)
        part = batch[name][1] if name in batch else np.full(size, variable.empty, variable.dtype)
        if part.shape != size:
            raise _wrong(plan, name, part.shape[1:], "one shape at all points")
        parts.append(part)
    return variable, np.concatenate(parts)


def _block(
    plan: Plan, task: BlockTask, values: Values, numbers: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.int8], VariableArrays]:
    """Answer by a task that takes all possible points at once."""
    points, asked = plan.subject.points(values), plan.variables
    variables = {
        name: variable
        for name, variable in task.variables(plan.subject, **plan.options).items()
        if (variable.default if asked is None else name in asked)
    }
    good = np.flatnonzero(points.possible)
    kept = points if good.size == numbers.size else type(points)(*(chosen(each, good) for each in points))
    varied = {name: each[good] for name, each in values.items()}
    block = Block(kept, numbers[good], plan.seed, frozenset(variables), plan.subject, varied)
    given = task.function(block, **plan.options) if good.size else {}
    arrays: VariableArrays = {}
    for name, variable in variables.items():
        whole = np.full((numbers.size, *(n for _, n in variable.dims)), variable.empty, dtype=variable.dtype)
        if good.size:
            told = given.get(name)
            if isinstance(told, Coded):
                variable, told = replace(variable, codes=told.codes), told.values
            if told is None or np.shape(told) != (good.size, *whole.shape[1:]):
                shape = "missing" if told is None else np.shape(told)
                raise _wrong(plan, name, shape, f"an array of shape {(good.size, *whole.shape[1:])}")
            whole[good] = told
        arrays[name] = (variable, whole)
    return np.where(points.possible, COMPUTED, IMPOSSIBLE).astype(np.int8), arrays


def _single(
    plan: Plan,
    function: Callable[..., Any],
    values: Values,
    numbers: npt.NDArray[np.int64],
) -> tuple[npt.NDArray[np.int8], VariableArrays]:
    """Answer point by point; what a task refuses is a point without numbers, any other error ends the sweep."""
    seeded = "seed" in inspect.signature(function).parameters
    status, arrays = np.zeros(numbers.size, dtype=np.int8), {}
    for k, number in enumerate(numbers.tolist()):
        one = plan.subject.at({name: float(each[k]) for name, each in values.items()})
        if one is None:
            status[k] = IMPOSSIBLE
            continue
        # of each point a seed by its number alone
        drawn = np.random.SeedSequence(plan.seed, spawn_key=(number,)) if seeded else None
        more = {} if drawn is None else {"seed": int(drawn.generate_state(1, np.uint64)[0])}
        try:
            given = function(one, **plan.options, **more)
        except LimitsetsError:
            status[k] = REFUSED
            continue
        except Exception as error:
            place = plan.words(plan.point(number))
            raise _wrong(plan, "", f"{type(error).__name__}: {error}", f"an answer at {place}") from error
        for name, each in _numbers(plan, given).items():
            if name not in arrays:
                dims = tuple((f"{name}_{axis}", n) for axis, n in enumerate(each.shape))
                arrays[name] = (Variable(dims=dims), np.full((numbers.size, *each.shape), np.nan))
            if arrays[name][1].shape[1:] != each.shape:
                raise _wrong(plan, name, each.shape, "one shape at all points")
            arrays[name][1][k] = each
    return status, dict(sorted(arrays.items()))


def _wrong(plan: Plan, name: str, value: object, allowed: str) -> LimitsetsError:
    thing = f"what the task {plan.task} returns{f' as {name}' if name else ''}"
    return LimitsetsError(thing, value, allowed, "correct the task")


def _numbers(plan: Plan, given: Any) -> dict[str, npt.NDArray[np.float64]]:
    """Read what a task returned: numbers and arrays of numbers by name; None is no number."""
    if not isinstance(given, Mapping):
        raise _wrong(plan, "", type(given).__name__, "a dict")
    if plan.variables is not None:
        missing = [name for name in plan.variables if name not in given]
        if missing:
            raise _wrong(
                plan, missing[0], "missing", f"the variables asked for, of {', '.join(map(str, given))}"
            )
        given = {name: given[name] for name in plan.variables}
    arrays = {}
    for name, value in given.items():
        if not isinstance(name, str) or not name or "/" in name or name in (*plan.base, *_OURS):
            raise _wrong(plan, repr(name), name, "names without /, not that of an axis, status or level")
        try:
            arrays[name] = np.array(np.nan if value is None else value, dtype=np.float64)
        except (TypeError, ValueError):
            raise _wrong(plan, name, type(value).__name__, "a number, or an array of numbers") from None
    return arrays
