"""Many parameter points in one NamedTuple of arrays, and one of them in compiled code."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import extending, types

from limitsets.jit.options import ESTIMATE, OVERLOAD


def row_of(stack: Any, k: int) -> Any:
    """Return row k of an array, and of a NamedTuple of arrays the NamedTuple of their rows.

    An array keeps its other axes; what is no array and no NamedTuple is the same in every row.
    """
    if isinstance(stack, np.ndarray):
        return stack[k] if stack.ndim > 1 else float(stack[k])
    return type(stack)(*(row_of(entry, k) for entry in stack)) if hasattr(stack, "_fields") else stack


def _choose(stack: Any, k: Any) -> Any:
    if isinstance(stack, types.Array):
        return lambda stack, k: stack[k]
    if not isinstance(stack, types.BaseNamedTuple):
        return lambda stack, k: stack
    # Compiled code makes a NamedTuple of entries that are written down.
    entries = ", ".join(f"row(stack[{j}], k)" for j in range(len(stack)))
    scope: dict[str, Any] = {"of": stack.instance_class, "row": row_of}
    exec(f"def method(stack, k):\n    return of({entries})", scope)  # noqa: S102  # our own text
    return scope["method"]


extending.overload(
    row_of, jit_options={**{key: ESTIMATE[key] for key in OVERLOAD}, "forceinline": True}, strict=False
)(_choose)
