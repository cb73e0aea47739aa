"""A mark that compiled code leaves where a function was asked beyond where it is defined."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import extending, types

# ---------------------------------------------------------------- the mark of what is not defined

# Compiled code notes here that a function was asked beyond where it is defined.  A proof kernel gives back bare
# intervals, which cannot say it: the loop that asked it takes the mark afterwards.
_MARK, _BYTE = "limitsets_mark", ir.IntType(8)


def _mark_of(builder: Any) -> Any:
    """Return the byte of the mark, one for all that is linked together."""
    found = builder.module.globals.get(_MARK)
    if found is None:
        found = ir.GlobalVariable(builder.module, _BYTE, _MARK)
        found.linkage, found.initializer = "linkonce_odr", ir.Constant(_BYTE, 0)
    return found


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
