"""Numbers that are not floats, in compiled code: their types, their operations, and formulas on any of them."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar

import numba
import numpy as np
from llvmlite import ir
from numba import extending, types
from numba.core import cgutils

from limitsets.numbers.jit.compiling import PROOF, compiled, overloaded

# ----------------------------------------------------------------
# A mark that compiled code leaves where a function was asked beyond where it is defined.


# ---------------------------------------------------------------- the mark of what is not defined

# Compiled code notes here that a function was asked beyond where it is defined.  A proof kernel gives back bare
# intervals, which cannot say it: the loop that asked it takes the mark afterwards.
_MARK, _BYTE = "limitsets_mark", ir.IntType(8)


def _mark_of(builder: Any) -> Any:
    """Return the byte of the mark, one for all that is linked together."""
    mark = builder.module.globals.get(_MARK)
    if mark is None:
        mark = ir.GlobalVariable(builder.module, _BYTE, _MARK)
        mark.linkage, mark.initializer = "linkonce_odr", ir.Constant(_BYTE, 0)
    return mark


@extending.intrinsic  # type: ignore[untyped-decorator]  # numba has no types
def mark_undefined(typing: Any, wrong: Any) -> Any:
    """Set the mark where `wrong` is true, in compiled code."""

    def store(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        mark = _mark_of(builder)
        builder.store(builder.or_(builder.load(mark), builder.zext(args[0], _BYTE)), mark)
        return context.get_dummy_value()

    return types.none(types.boolean), store


@extending.intrinsic  # type: ignore[untyped-decorator]  # numba has no types
def take_mark(typing: Any) -> Any:
    """Whether the mark was set since it was taken last, in compiled code; it no longer is."""

    def take(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        mark = _mark_of(builder)
        was = builder.icmp_unsigned("!=", builder.load(mark), _BYTE(0))
        builder.store(_BYTE(0), mark)
        return was

    return types.boolean(), take


# ----------------------------------------------------------------


F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")


# ---------------------------------------------------------------- numbers that are not floats


class _NumberType(types.Type):  # type: ignore[misc]  # numba has no types
    """How numba sees a number of two entries of one type: floats, numbers, or arrays with an entry for each side."""

    def __init__(self, cls: type, entry: Any) -> None:
        self.cls, self.entry = cls, entry
        super().__init__(name=f"{cls.__qualname__}({entry})")

    def unify(self, context: Any, other: Any) -> Any:
        """Return the type of a variable that is this number on one path and a plainer one on another: this."""
        return self if isinstance(other, types.Number) or other == self.entry else None

    def can_convert_from(self, context: Any, other: Any) -> Any:
        fits = isinstance(other, types.Number) or other == self.entry
        return numba.core.typeconv.Conversion.safe if fits else None


def number(*, twice: bool) -> Callable[[type[T]], type[T]]:
    """Make a class of two entries a number in compiled code: constructed by its name, its fields read by theirs.

    The entries are two floats, two numbers of one type, or two arrays.  What the number can do is added by `operation`.

    Parameters
    ----------
    twice : bool
        Whether a plainer number has both entries equal to itself; else the second is 0.
    """
    return lambda cls: _number(cls, twice)


def _number(cls: type[T], twice: bool) -> type[T]:
    if twice:
        _TWICE.add(cls)
    first, _ = _FIELDS[cls] = tuple(cls.__annotations__)

    def typer(context: Any) -> Any:
        def typed(one: Any, two: Any) -> Any:
            plain = all(isinstance(each, types.Number) for each in (one, two))
            entry = types.float64 if plain else one
            fits = plain or (one == two and isinstance(one, _NumberType | types.Array))
            return numba.core.typing.signature(_NumberType(cls, entry), entry, entry) if fits else None

        return typed

    def made(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        structure = _structure(context, builder, signature.return_type, *args)
        return numba.core.imputils.impl_ret_borrowed(context, builder, signature.return_type, structure)

    extending.type_callable(cls)(typer)
    extending.typeof_impl.register(cls)(
        lambda value, c: _NumberType(cls, extending.typeof_impl(getattr(value, first), c))
    )
    extending.lower_builtin(cls, types.Any, types.Any)(made)
    return cls


_FIELDS: dict[type, tuple[str, ...]] = {}
_TWICE: set[type] = set()


def _structure(context: Any, builder: Any, kind: _NumberType, one: Any, two: Any) -> Any:
    """Put two values together, while code is generated."""
    structure = cgutils.create_struct_proxy(kind)(context, builder)
    for name, value in zip(_FIELDS[kind.cls], (one, two), strict=True):
        setattr(structure, name, value)
    return structure._getvalue()


@extending.register_model(_NumberType)
class _NumberModel(extending.models.StructModel):  # type: ignore[misc]  # numba has no types
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, [(name, kind.entry) for name in _FIELDS[kind.cls]])


@extending.lower_cast(types.Number, _NumberType)  # type: ignore[untyped-decorator]  # numba has no types
@extending.lower_cast(_NumberType, _NumberType)  # type: ignore[untyped-decorator]  # numba has no types
def _from_plainer(context: Any, builder: Any, plain: Any, kind: Any, value: Any) -> Any:
    """Lift a plainer number where code asks for this one on another path."""
    one = context.cast(builder, value, plain, kind.entry)
    zero = context.get_constant(types.float64, 0.0)
    two = one if kind.cls in _TWICE else context.cast(builder, zero, types.float64, kind.entry)
    return _structure(context, builder, kind, one, two)


@extending.infer_getattr
class _NumberFields(numba.core.typing.templates.AttributeTemplate):  # type: ignore[misc]  # numba has no types
    key = _NumberType

    def generic_resolve(self, kind: Any, name: str) -> Any:
        return kind.entry if name in _FIELDS[kind.cls] else None


@extending.lower_getattr_generic(_NumberType)  # type: ignore[untyped-decorator]  # numba has no types
def _read_field(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    field = getattr(cgutils.create_struct_proxy(kind)(context, builder, value=value), name)
    return numba.core.imputils.impl_ret_borrowed(context, builder, kind.entry, field)


@extending.box(_NumberType)  # type: ignore[untyped-decorator]  # numba has no types
def _to_python(kind: Any, value: Any, c: Any) -> Any:
    structure = cgutils.create_struct_proxy(kind)(c.context, c.builder, value=value)
    fields = [c.box(kind.entry, getattr(structure, name)) for name in _FIELDS[kind.cls]]
    cls = c.pyapi.unserialize(c.pyapi.serialize_object(kind.cls))
    made = c.pyapi.call_function_objargs(cls, fields)
    for each in (*fields, cls):
        c.pyapi.decref(each)
    return made


@extending.unbox(_NumberType)  # type: ignore[untyped-decorator]  # numba has no types
def _from_python(kind: Any, instance: Any, c: Any) -> Any:
    made = cgutils.create_struct_proxy(kind)(c.context, c.builder)
    for name in _FIELDS[kind.cls]:
        field = c.pyapi.object_getattr_string(instance, name)
        setattr(made, name, c.unbox(kind.entry, field).value)
        c.pyapi.decref(field)
    return extending.NativeValue(
        made._getvalue(), is_error=cgutils.is_not_null(c.builder, c.pyapi.err_occurred())
    )


def operation(
    stub: Callable[..., Any],
    cls: type,
    method: Callable[..., Any],
    *,
    left: Callable[..., Any] | None = None,
    right: Callable[..., Any] | None = None,
    whole: Callable[..., Any] | None = None,
    beside: tuple[type, ...] = (),
) -> None:
    """Give a number a method of an operator, or of any function of Python, in compiled code.

    Parameters
    ----------
    stub : callable
        The operator of the module `operator`, or the function.
    cls : type
        The class of the number; the other arguments may be plain numbers.  `float` stands for plain numbers alone:
        their methods may be contracted, all others are not.
    method : callable
        A function that closes over nothing: a lambda, or one of a module.
    left, right : callable, optional
        The methods where only the first of two arguments is of the class, and where only the second is; as `method`.
    whole : callable, optional
        The method where the last argument is a whole number; as `method`.
    beside : tuple of type
        Classes of numbers that may stand beside this one as plain ones may.
    """

    def choose(*args: Any) -> Callable[..., Any] | None:
        mine = [number_class(each) is cls for each in args]
        plain = [isinstance(each, types.Number) or number_class(each) in beside for each in args]
        if cls is float:
            return method if all(plain) else None
        if not (any(mine) and all(np.logical_or(mine, plain))):
            return None
        if whole is not None and isinstance(args[-1], types.Integer):
            return whole
        return (left or method) if not mine[-1] else (right or method) if not mine[0] else method

    overloaded(stub, choose, proof=cls is not float)


def corners_as_numbers(number: type, array: type) -> Callable[[Any, Any], Any]:
    """Make the function, for compiled code, that puts two NamedTuples of one class together, entry by entry.

    Parameters
    ----------
    number, array : type
        What two floats become, and what two arrays become.

    Returns
    -------
    callable
        ``f(lo, hi)``: a NamedTuple of the same class.  What is no float, array or NamedTuple is taken from `lo`.
    """

    def joined(kind: Any) -> Any:
        if isinstance(kind, types.BaseNamedTuple):
            return types.BaseTuple.from_types([joined(each) for each in kind], kind.instance_class)
        if isinstance(kind, types.Float):
            return _NumberType(number, kind)
        return _NumberType(array, kind) if isinstance(kind, types.Array) else kind

    def value(context: Any, builder: Any, kind: Any, lo: Any, hi: Any) -> Any:
        made = joined(kind)
        if isinstance(kind, types.BaseNamedTuple):
            entries = [
                value(context, builder, each, *(builder.extract_value(end, k) for end in (lo, hi)))
                for k, each in enumerate(kind)
            ]
            return context.make_tuple(builder, made, entries)
        return _structure(context, builder, made, lo, hi) if isinstance(made, _NumberType) else lo

    @extending.intrinsic  # type: ignore[untyped-decorator]  # numba has no types
    def together(typing: Any, lo: Any, hi: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            corners = value(context, builder, lo, *args)
            return numba.core.imputils.impl_ret_borrowed(context, builder, signature.return_type, corners)

        return (joined(lo)(lo, hi), code) if lo == hi else None

    return together  # type: ignore[no-any-return]  # numba has no types


def of_entries(function: Callable[..., Any]) -> Callable[..., Any]:
    """Make a kernel of one entry a kernel of a tuple: ``f(entries, *more)`` is that of ``function(entry, k, *more)``.

    The entries may be of several types; the answer is a tuple of as many.  For proofs, in compiled code.
    """
    inlined = compiled(function, PROOF, False)

    @functools.wraps(function)
    def each(entries: Any, *more: Any) -> Any:
        return tuple(function(entry, k, *more) for k, entry in enumerate(entries))

    def choose(entries: Any, *more: Any) -> Callable[..., Any] | None:
        if not isinstance(entries, types.BaseTuple):
            return None
        # Compiled code makes a tuple of a length that is written down.
        calls = "".join(f"of(entries[{k}], {k}, *more), " for k in range(len(entries)))
        scope: dict[str, Any] = {"of": inlined}
        exec(f"def method(entries, *more):\n    return ({calls})", scope)  # noqa: S102  # our own text
        return scope["method"]  # type: ignore[no-any-return]  # made by exec

    overloaded(each, choose, proof=True)
    return each


def formula(function: F) -> F:
    """Let compiled code run a plain function, inlined, on whatever numbers it is given; Python runs it as it stands.

    Operations on floats may be contracted; those of other numbers are their own.
    """
    overloaded(function, lambda *args: function)
    return function


entries_of = numba.literal_unroll
"""Loop over the entries of a tuple of several classes, in compiled code."""


def number_class(numba_type: Any) -> type | None:
    """Class of a number that `number` made, as numba sees it; None for any other type."""
    return numba_type.cls if isinstance(numba_type, _NumberType) else None
