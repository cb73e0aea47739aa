"""Functions whose method is chosen by the class of an argument, at compile time; and one of many parameter points."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, ParamSpec, Protocol, TypeVar, overload

import numpy as np
from numba import types

from limitsets.base import MapError
from limitsets.numbers.jit.compiling import overloaded, with_helpers

P = ParamSpec("P")
R = TypeVar("R", covariant=True)


def named_tuple_class(numba_type: Any) -> type | None:
    """Class of a NamedTuple as numba sees it, None for any other type."""
    return getattr(numba_type, "instance_class", None) if isinstance(numba_type, types.BaseTuple) else None


class Generic(Protocol[P, R]):
    """A function whose method is chosen by the class of its first argument: what `generic` makes of a stub."""

    methods: dict[Any, Callable[..., Any]]

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """Run the method."""

    def on(self, key: type | int, method: Callable[..., Any]) -> None:
        """Add the method of a class, or of plain tuples of a length: a module-level function."""


def entry_of(entries: Any, cls: type) -> Any:
    """Return the entry of a class in a tuple of several classes, None where there is none; chosen at compile time."""
    return next((entry for entry in entries if type(entry) is cls), None)


def with_entry(entries: Any, entry: Any) -> Any:
    """Return a tuple with its entry of the same class replaced."""
    return tuple(entry if type(each) is type(entry) else each for each in entries)


def _place_of(entries: Any, cls: type | None) -> int | None:
    """Where a tuple has its entry of a class, as numba sees it."""
    return next((k for k, each in enumerate(entries) if named_tuple_class(each) is cls), None)


def _choose_entry(entries: Any, cls: Any) -> Callable[..., Any]:
    at = _place_of(entries, cls.instance_class)
    return (lambda entries, cls: None) if at is None else (lambda entries, cls: entries[at])


def _choose_with(entries: Any, entry: Any) -> Callable[..., Any] | None:
    at = _place_of(entries, named_tuple_class(entry))
    if at is None:
        return None
    after = at + 1
    return lambda entries, entry: entries[:at] + (entry,) + entries[after:]  # noqa: RUF005 - numba has no unpacking


overloaded(entry_of, _choose_entry)
overloaded(with_entry, _choose_with)


def _handed_on(entry: Any, value: Any, *rest: Any) -> Any:
    return value


@overload
def generic(stub: Callable[P, R]) -> Generic[P, R]: ...
@overload
def generic(
    *,
    proof: bool = False,
    inlined: bool = True,
    default: Callable[..., Any] | None = None,
    chained: bool = False,
) -> Callable[[Callable[P, R]], Generic[P, R]]: ...
def generic(
    stub: Any = None,
    *,
    proof: bool = False,
    inlined: bool = True,
    default: Callable[..., Any] | None = None,
    chained: bool = False,
) -> Any:
    """Make a function whose method is chosen by the class of its first argument.

    Parameters
    ----------
    stub : callable
        A module-level function that names the arguments; its body is never compiled.
    proof : bool
        Compile the methods without contraction.
    inlined : bool
        False for a method that is rarely called: it then costs the loops around it no compile time.
    default : callable, optional
        The method of every class that has none of its own.
    chained : bool
        The arguments are an entry and a value, which the method gives back changed.  Called with a tuple of several
        classes the function runs the methods of its entries in their order, each on the value that the last one gave;
        an entry without one is not in the machine code.

    Returns
    -------
    callable
        The stub, a `Generic`: ``stub.on(Class, method)`` adds a module-level method.  For a plain tuple
        the key is its length instead.  In compiled code the choice is made at compile time.

    Notes
    -----
    The table is read by one numba overload per generic function.  A method is never passed as an argument nor kept
    in a closure: numba does not cache such code (numba issues 2065, 2952, 6264).
    """
    if stub is None:
        return functools.partial(generic, proof=proof, inlined=inlined, default=default, chained=chained)
    default = _handed_on if chained else default
    methods: dict[Any, Callable[..., Any]] = {}

    def one_after_another(entries: Any, value: Any, *rest: Any) -> Any:
        return chosen(entries[1:], chosen(entries[0], value, *rest), *rest)

    def of_tuple(first: Any) -> Callable[..., Any] | None:
        plain = type(first) is tuple or (isinstance(first, types.BaseTuple) and not named_tuple_class(first))
        return None if not (chained and plain) else one_after_another if len(first) else _handed_on

    def choose(first: Any, *rest: Any) -> Callable[..., Any] | None:
        if (method := of_tuple(first)) is not None:
            return method
        key: Any = type(None) if isinstance(first, types.NoneType) else named_tuple_class(first)
        if key is None and isinstance(first, types.BaseTuple):
            key = len(first)
        return methods.get(key, default)

    @functools.wraps(stub)
    def chosen(first: Any, *rest: Any) -> Any:
        """Run the method in Python, on the numbers of Python: a method made of formulas alone knows no others."""
        method = of_tuple(first) or methods.get(type(first), default)
        if method is None:
            raise MapError("the argument", type(first).__name__, "a class with a method", "add one")
        return method(first, *rest)

    overloaded(chosen, choose, proof=proof, inlined=inlined)

    def on(key: type | int, method: Callable[..., Any]) -> None:
        methods[key] = with_helpers(getattr(method, "py_func", method), proof)

    made: Any = chosen
    made.on, made.methods = on, methods
    return made


# ----------------------------------------------------------------
# Many parameter points in one NamedTuple of arrays, and one of them in compiled code.


def row_of(stack: Any, k: int) -> Any:
    """Return row k of an array, and of a NamedTuple of arrays the NamedTuple of their rows.

    An array keeps its other axes; what is no array and no NamedTuple is the same in every row.
    """
    if isinstance(stack, np.ndarray):
        return stack[k] if stack.ndim > 1 else float(stack[k])
    return type(stack)(*(row_of(entry, k) for entry in stack)) if hasattr(stack, "_fields") else stack


def _choose_row(stack: Any, k: Any) -> Any:
    if isinstance(stack, types.Array):
        return lambda stack, k: stack[k]
    if not isinstance(stack, types.BaseNamedTuple):
        return lambda stack, k: stack
    # Compiled code makes a NamedTuple of entries that are written down.
    entries = ", ".join(f"row(stack[{j}], k)" for j in range(len(stack)))
    scope: dict[str, Any] = {"of": stack.instance_class, "row": row_of}
    exec(f"def method(stack, k):\n    return of({entries})", scope)  # noqa: S102  # our own text
    return scope["method"]


overloaded(row_of, _choose_row)
