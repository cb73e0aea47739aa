"""The formulas of a map as lists of operations: its functions run once, on numbers that record what is done with them.

A number is a place on a tape, which holds each operation once.  Sides, branches, loops, tables and constants are
Python's own and leave nothing on the tape.  `math`, `numpy`, `min` and `max` are replaced in copies of the function and
of all that it calls.  What cannot be recorded (a comparison of x, a root of an odd kind) is refused by name; whether
the tape is what the compiled function does is compared afterwards (`programs`).
"""

from __future__ import annotations

import builtins
import operator
from collections.abc import Callable
from pathlib import Path
from types import CellType, FunctionType, ModuleType
from typing import Any, NoReturn, TypeAlias

import numpy as np

from limitsets.base import AnswerError, shown
from limitsets.numbers.jit.cache import names_in
from limitsets.systems.maps.textbook.shared import exponential

Tape: TypeAlias = dict[tuple[Any, ...], int]

OF_TWO = {"add", "sub", "mul", "div", "min", "max", "atan2"}
LEAVES = {"x", "p", "c"}

# Operations of a program at most; a tape may hold this many times more, which reach no output.
MOST, UNUSED = 20_000, 10

LARGEST_POWER = 200

# Sizes of a constant.
LEAST, GREATEST = 1e-99, 1e99

ALLOWED = (
    "+ - * /, whole powers, abs, min, max, sqrt, exp, log, sin, cos, tan, tanh, atan2 and floor of math or numpy, "
    "cbrt of numpy"
)
BRANCHES = (
    "give each branch a formula of its own, with a margin (pieces= of limitsets.map; image_on and margin of register), "
    "or write min, max, abs or floor"
)


class RefusedError(BaseException):
    """What cannot be recorded, and what to do: no exception, so that no handler of the function swallows it."""

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(what)
        self.what, self.remedy = what, remedy


# ---------------------------------------------------------------- numbers that record


class Recorded:
    """A number on a tape."""

    __array_ufunc__ = None  # numpy leaves a product with one of its own numbers to this class
    __hash__ = None  # type: ignore[assignment]  # no key of a dict: its value is not known

    def __init__(self, tape: Tape, *operation: Any) -> None:
        self.tape, self.index = tape, tape.setdefault(operation, len(tape))
        if len(tape) > MOST * UNUSED:
            raise RefusedError(f"more than {MOST * UNUSED} operations", "record fewer steps of a long loop")

    def __pos__(self) -> Recorded:
        return self

    def __pow__(self, count: Any) -> Recorded:
        if isinstance(count, Recorded) or not isinstance(count, int | float | np.number):
            raise RefusedError("a power by x or a parameter", "write exp(b * log(a))")
        power = float(count)
        if not abs(power) <= LARGEST_POWER or not power.is_integer():
            raise RefusedError(
                f"the power {count}", f"write sqrt, exp(b * log(a)), or a whole power to {LARGEST_POWER}"
            )
        return Recorded(self.tape, "pow", self.index, int(power)) if power else lifted(self.tape, 1)


def lifted(tape: Tape, value: Any) -> Recorded:
    """Return a number on the tape; a constant stands there as its shortest decimal."""
    if isinstance(value, Recorded):
        return value
    value = value.item() if isinstance(value, np.generic) else value
    if not isinstance(value, int | float):
        raise RefusedError(str(shown(value)), "calculate with numbers alone, and return a tuple of them")
    if not abs(value) <= GREATEST or 0 < abs(value) < LEAST:
        raise RefusedError(f"the number {shown(value)}", f"use numbers from {LEAST} to {GREATEST}, and 0")
    return Recorded(tape, "c", decimal(value))


def decimal(value: float) -> str:
    """Write a number as its shortest decimal, a whole one without a point."""
    whole = abs(value) < 2**53 and value == int(value)
    return str(int(value)) if whole else repr(float(value))


def _tape_of(values: Any) -> Tape | None:
    """Return the tape of a recorded number among some values, in tuples, lists and arrays too."""
    for value in values:
        if isinstance(value, Recorded):
            return value.tape
        if isinstance(value, tuple | list) or (isinstance(value, np.ndarray) and value.dtype == object):
            tape = _tape_of(value)
            if tape is not None:
                return tape
    return None


def _records(word: str, plain: Callable[..., Any], swapped: bool = False) -> Callable[..., Any]:
    """Make a function that records an operation, or computes where nothing is recorded."""

    def run(*values: Any) -> Any:
        tape = _tape_of(values)
        if tape is None:
            return plain(*values)
        if len(values) == 1 and isinstance(values[0], tuple | list):  # max((a, b))
            values = tuple(values[0])
        if len(values) > 2 and word in ("min", "max"):
            values = run(*values[:-1]), values[-1]
        if len(values) != (2 if word in OF_TWO else 1):
            raise RefusedError(f"{word} of {len(values)} numbers", "give it as many as it takes")
        entries = [lifted(tape, value).index for value in (values[::-1] if swapped else values)]
        return Recorded(tape, word, *entries)

    return run


def _refuses(
    name: str, plain: Callable[..., Any] | None = None, remedy: str = BRANCHES
) -> Callable[..., Any]:
    """Make a function that refuses recorded numbers, and computes with all others."""

    def run(*values: Any, **options: Any) -> Any:
        if plain is not None and _tape_of((*values, *options.values())) is None:
            return plain(*values, **options)
        raise RefusedError(f"{name} of x or a parameter", remedy)

    return run


def _raised(plain: Callable[..., Any]) -> Callable[..., Any]:
    """Make a function of a base and a power."""

    def run(base: Any, power: Any) -> Any:
        return plain(base, power) if _tape_of((base, power)) is None else operator.pow(base, power)

    return run


# Methods of numbers that no tape can hold, as a person writes them.
REFUSED = {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!=", "bool": "the truth", "mod": "%"} | {
    "rmod": "%", "floordiv": "//", "rfloordiv": "//", "divmod": "divmod", "rdivmod": "divmod", "float": "float",
    "int": "int", "complex": "complex", "index": "an index", "round": "round", "trunc": "trunc", "ceil": "ceil",
    "iter": "a loop", "getitem": "an entry", "len": "the length", "contains": "the entries",
}  # fmt: skip

for _word, _name in (("add", "add"), ("sub", "sub"), ("mul", "mul"), ("div", "truediv")):
    setattr(Recorded, f"__{_name}__", _records(_word, operator.add))
    setattr(Recorded, f"__r{_name}__", _records(_word, operator.add, swapped=True))
for _word in ("neg", "abs"):
    setattr(Recorded, f"__{_word}__", _records(_word, abs))
Recorded.__floor__ = _records("floor", abs)  # type: ignore[attr-defined]  # as the other methods, by table
for _name, _word in REFUSED.items():
    setattr(Recorded, f"__{_name}__", _refuses(_word))
Recorded.__rpow__ = _refuses("a power", remedy="write exp(b * log(a))")  # type: ignore[attr-defined]  # likewise

# Functions of math, numpy and Python that record -> the operation.
ALIKE = ("sqrt", "cbrt", "exp", "log", "sin", "cos", "tan", "tanh", "floor", "min", "max", "atan2")
WORDS = {word: word for word in ALIKE} | {
    "fabs": "abs", "absolute": "abs", "arctan2": "atan2", "minimum": "min", "maximum": "max",
}  # fmt: skip
POWERS = ("pow", "power")
# Kernels of the package that compute a function by themselves.
OURS = {exponential: "exp"}


# ---------------------------------------------------------------- copies of functions that record


class _Module:
    """A module, whose functions record."""

    def __init__(self, module: ModuleType, copies: dict[Any, Any]) -> None:
        self._module, self._copies = module, copies

    def __getattr__(self, name: str) -> Any:
        return _replaced(getattr(self._module, name), self._copies)


def _replaced(value: Any, copies: dict[Any, Any]) -> Any:
    """Return what stands in a copy of a function for a value that it names."""
    if isinstance(value, ModuleType):
        return _Module(value, copies)
    room = (getattr(value, "__module__", None) or "").split(".")[0]
    foreign = callable(value) and room in ("math", "numpy") and not isinstance(value, type)
    if foreign or isinstance(value, np.ufunc) or any(value is each for each in (min, max, pow)):
        name = value.__name__
        if name in POWERS:
            return _raised(value)
        return _records(WORDS[name], value) if name in WORDS else _refuses(name, value)
    plain = getattr(value, "py_func", value)
    if isinstance(plain, FunctionType) and value in OURS:
        return _records(OURS[value], value)
    if isinstance(plain, FunctionType) and not hasattr(plain, "methods"):
        return recording(plain, copies)
    return value


def recording(f: Any, copies: dict[Any, Any]) -> Any:
    """Copy a function so that it records, with all that it calls: globals, defaults, functions around it.

    `copies` holds those that are made already: functions may call each other.
    """
    if f not in copies:
        scope = dict(f.__globals__)
        copies[f] = FunctionType(
            f.__code__, scope, f.__name__, None, tuple(CellType() for _ in f.__closure__ or ())
        )
        for name in names_in(f):
            value = scope.get(name, getattr(builtins, name, None))
            if callable(value) or isinstance(value, ModuleType):
                scope[name] = _replaced(value, copies)
        for mine, cell in zip(copies[f].__closure__ or (), f.__closure__ or (), strict=True):
            mine.cell_contents = _replaced(cell.cell_contents, copies)
        copies[f].__defaults__ = tuple(_replaced(value, copies) for value in f.__defaults__ or ())
        copies[f].__kwdefaults__ = f.__kwdefaults__
    return copies[f]


# ---------------------------------------------------------------- parameters and programs


class _Entries:
    """An array of parameters, one for each side: read at a side alone."""

    def __init__(self, entries: list[Recorded]) -> None:
        self.entries = entries

    def __getitem__(self, side: Any) -> Recorded:
        return self.entries[operator.index(side)]

    def __len__(self) -> int:
        return len(self.entries)


def names_of(params: Any, prefix: str = "") -> list[tuple[str, Any]]:
    """Names and values of all numbers among the parameters: ``arm.length``, ``k.0`` of an array."""
    if isinstance(params, np.ndarray) and params.ndim == 1:
        return [(f"{prefix}{k}", float(value)) for k, value in enumerate(params)]
    if isinstance(params, tuple) and hasattr(params, "_fields"):
        numbers = []
        for field, value in zip(params._fields, params, strict=True):
            known = isinstance(value, float)
            numbers += [(f"{prefix}{field}", value)] if known else names_of(value, f"{prefix}{field}.")
        return numbers
    if params is None:
        return []
    raise AnswerError(
        f"the parameter {prefix.rstrip('.')}",
        shown(params),
        "a number, an array with one for each side, a NamedTuple of such, or None",
        "write what it chooses as maps of their own",
    )


def _parameters_on(tape: Tape, params: Any, prefix: str = "") -> Any:
    """Return parameters of the same form as numbers on the tape."""
    if isinstance(params, np.ndarray):
        return _Entries([Recorded(tape, "p", f"{prefix}{k}") for k in range(len(params))])
    if params is None:
        return None
    entries = (
        Recorded(tape, "p", prefix + field) if isinstance(value, float)
        else _parameters_on(tape, value, f"{prefix}{field}.")
        for field, value in zip(params._fields, params, strict=True)
    )  # fmt: skip
    return type(params)(*entries)


def recorded(f: Callable[..., Any], params: Any, dimension: int, side: int, *branch: int) -> dict[str, Any]:
    """Record one function of a map on one side: its operations, outputs, and the side it leads to.

    Raises
    ------
    AnswerError
        The function does what cannot be recorded; the line names it, with the place and the remedy.
    """
    tape: Tape = {}
    x = tuple(Recorded(tape, "x", axis) for axis in range(dimension))
    name = f"the function {f.__name__} of {type(params).__name__}"
    try:
        values = recording(f, {})(_parameters_on(tape, params), x if dimension > 1 else x[0], side, *branch)
        after, to = values[:2] if isinstance(values, tuple) else (values, side)
        if isinstance(to, bool) or not isinstance(to, int | np.integer):
            raise RefusedError("a side that depends on x", "return a whole number that is known beforehand")
        out = [lifted(tape, value).index for value in (after if isinstance(after, tuple) else (after,))]
        operations, outputs = _used(list(tape), out)
    except RefusedError as refusal:
        _refuse(name, refusal, refusal.what, refusal.remedy)
    except Exception as error:  # noqa: BLE001  # whatever a user's function does
        _refuse(name, error, f"{type(error).__name__}: {error}", "write it with plain numbers")
    return {"to": int(to), "ops": operations, "out": outputs}


def _refuse(name: str, error: BaseException, what: str, remedy: str) -> NoReturn:
    """Say in one line what cannot be recorded, and on which line of which file."""
    place, trace = "", error.__traceback__
    while trace is not None:
        file = trace.tb_frame.f_code.co_filename
        if file != __file__:
            place = f" ({trace.tb_frame.f_code.co_name}, line {trace.tb_lineno} of {Path(file).name})"
        trace = trace.tb_next
    raise AnswerError(f"what {name} does{place}", what, ALLOWED, remedy) from None


def entries_of(operation: Any) -> Any:
    """Numbers of the operations that one uses."""
    return () if operation[0] in LEAVES else operation[1:2] if operation[0] == "pow" else operation[1:]


def _used(tape: list[Any], out: list[int]) -> tuple[list[list[Any]], list[int]]:
    """Keep the operations that reach an output, in their order and numbered anew."""
    used = set(out)
    for k in range(len(tape) - 1, -1, -1):
        used |= set(entries_of(tape[k])) if k in used else set()
    if len(used) > MOST:
        raise RefusedError(f"{len(used)} operations", f"keep to {MOST}: fewer steps in one image")
    number = {k: place for place, k in enumerate(sorted(used))}
    kept = [
        [tape[k][0], *(number[j] for j in entries_of(tape[k])), *tape[k][1 + len(entries_of(tape[k])) :]]
        for k in sorted(used)
    ]
    return kept, [number[k] for k in out]
