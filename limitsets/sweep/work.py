"""What a worker does: answer for one chunk of a plan."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from limitsets.errors import LimitsetsError
from limitsets.maps.stacks import chosen
from limitsets.sweep.boundaries import FILLED, refined
from limitsets.sweep.plan import Plan, require_same_code
from limitsets.sweep.tasks import Block, BlockTask, Coded, Variable, registered, resolved

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
Found = dict[str, tuple[Variable, npt.NDArray[Any]]]


class Answer(NamedTuple):
    """The answers of one chunk: its number, and a variable and an array of the chunk's shape for each name."""

    number: int
    found: Found


def answer(plan: Plan, number: int) -> Answer:
    """Answer for one chunk."""
    require_same_code(plan)
    region = plan.region(number)
    shape = tuple(part.stop - part.start for part in region)
    values, numbers = plan.values(region), plan.numbers(region)
    if plan.refine is None:
        found = _asked(plan, values, numbers)
    else:
        found = _refined(plan, shape, values, numbers)
    return Answer(
        number, {name: (v, each.reshape(*shape, *each.shape[1:])) for name, (v, each) in found.items()}
    )


def _asked(plan: Plan, values: Values, numbers: npt.NDArray[np.int64]) -> Found:
    """Ask the task."""
    function = resolved(plan.task)
    task = registered(function)
    if task is None:
        status, found = _single(plan, function, values, numbers)
    else:
        status, found = _block(plan, task, values, numbers)
    return {"status": (STATUS, status), **found}


def _refined(plan: Plan, shape: tuple[int, ...], values: Values, numbers: npt.NDArray[np.int64]) -> Found:
    """Ask the task where its answer changes, and fill the rest."""
    name, step = plan.refine or ("", 1)
    batches: list[Found] = []
    seen: dict[bytes, int] = {}

    def ask(points: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        found = _asked(plan, {axis: each[points] for axis, each in values.items()}, numbers[points])
        batches.append(found)
        rows = [found[each][1].reshape(points.size, -1) for each in ("status", name) if each in found]
        keys = zip(*([row.tobytes() for row in np.ascontiguousarray(part)] for part in rows), strict=True)
        return np.array([seen.setdefault(b"".join(key), len(seen)) for key in keys], np.int64)

    layout = refined(shape, step, ask)
    found: Found = {"level": (LEVEL, layout.level)}
    for each in dict.fromkeys(key for batch in batches for key in batch):
        variable, answers = _joined(plan, each, batches)
        found[each] = (variable, answers[layout.source])
        if not variable.copied:
            found[each][1][layout.level == FILLED] = variable.empty
    if name not in found and (found["status"][1] == COMPUTED).any():
        raise _wrong(plan, name, "missing", "the variable by which the atlas is refined")
    return found


def _joined(plan: Plan, name: str, batches: list[Found]) -> tuple[Variable, npt.NDArray[Any]]:
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


def seed_of(plan: Plan, number: int) -> int:
    """Return the seed of a point: by its number alone."""
    return int(np.random.SeedSequence(plan.seed, spawn_key=(number,)).generate_state(1, np.uint64)[0])


def variables_of(plan: Plan, task: BlockTask) -> dict[str, Variable]:
    """Return the variables that a plan asks of a block task."""
    known = task.variables(plan.subject, **plan.options)
    if plan.variables is None:
        return {name: each for name, each in known.items() if each.default}
    return {name: each for name, each in known.items() if name in plan.variables}


def _block(
    plan: Plan, task: BlockTask, values: Values, numbers: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.int8], Found]:
    """Answer by a task that takes all possible points at once."""
    points, variables = plan.subject.points(values), variables_of(plan, task)
    good = np.flatnonzero(points.possible)
    kept = points if good.size == numbers.size else type(points)(*(chosen(each, good) for each in points))
    varied = {name: each[good] for name, each in values.items()}
    block = Block(kept, numbers[good], plan.seed, frozenset(variables), plan.subject, varied)
    given = task.function(block, **plan.options) if good.size else {}
    found: Found = {}
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
        found[name] = (variable, whole)
    return np.where(points.possible, COMPUTED, IMPOSSIBLE).astype(np.int8), found


def _single(
    plan: Plan,
    function: Callable[..., Any],
    values: Values,
    numbers: npt.NDArray[np.int64],
) -> tuple[npt.NDArray[np.int8], Found]:
    """Answer point by point; what a task refuses is a point without numbers, any other error ends the sweep."""
    seeded = "seed" in inspect.signature(function).parameters
    status, found = np.zeros(numbers.size, dtype=np.int8), {}
    for k in range(numbers.size):
        one = plan.subject.at({name: float(each[k]) for name, each in values.items()})
        if one is None:
            status[k] = IMPOSSIBLE
            continue
        more = {"seed": seed_of(plan, int(numbers[k]))} if seeded else {}
        try:
            given = function(one, **plan.options, **more)
        except LimitsetsError:
            status[k] = REFUSED
            continue
        except Exception as error:
            place = plan.words(plan.point(int(numbers[k])))
            raise _wrong(plan, "", f"{type(error).__name__}: {error}", f"an answer at {place}") from error
        for name, each in _numbers(plan, given).items():
            if name not in found:
                dims = tuple((f"{name}_{axis}", n) for axis, n in enumerate(each.shape))
                found[name] = (Variable(dims=dims), np.full((numbers.size, *each.shape), np.nan))
            if found[name][1].shape[1:] != each.shape:
                raise _wrong(plan, name, each.shape, "one shape at all points")
            found[name][1][k] = each
    return status, dict(sorted(found.items()))


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
    found = {}
    for name, value in given.items():
        if not isinstance(name, str) or not name or "/" in name or name in (*plan.base, *_OURS):
            raise _wrong(plan, repr(name), name, "names without /, not that of an axis, status or level")
        try:
            found[name] = np.array(np.nan if value is None else value, dtype=np.float64)
        except (TypeError, ValueError):
            raise _wrong(plan, name, type(value).__name__, "a number, or an array of numbers") from None
    return found
