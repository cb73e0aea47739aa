"""The only room that imports numba: the decorators of all compiled code, numbers that are not floats, and the cache.

Three words are used elsewhere:

``kernel``
    Compiles a function for estimates: a multiplication and an addition may be contracted into one instruction.
    Plain ``@kernel`` is for small pieces, which are inlined where they are called (a call costs 80 ns and stops
    the loop from vectorising); ``@kernel(entry=True)`` is for a loop over whole arrays called from Python, the
    only kind that is kept on disk; ``@kernel(inlined=False)`` is for one that only other kernels call.
``proof_kernel``
    The same without contraction, for arithmetic whose rounding a proof relies on.  ``kernel`` takes ``counting=False``
    where a kernel neither makes arrays nor gives one back, and nothing that it calls does: references to arrays are
    not counted then.  Where LLVM cannot cancel the counting of a NamedTuple with five arrays, each call of a helper
    costs twenty atomic operations: seven eighths of the time in which images were placed on a grid.
``generic``
    A function whose method is chosen by the class of its first argument, at compile time.
"""

from limitsets.numbers.jit.cache import cover_foreign_class
from limitsets.numbers.jit.compiling import kernel, proof_kernel
from limitsets.numbers.jit.dispatch import entry_of, generic, named_tuple_class, row_of, with_entry
from limitsets.numbers.jit.number_types import (
    corners_as_numbers,
    entries_of,
    formula,
    mark_undefined,
    number,
    of_entries,
    operation,
    take_mark,
)

__all__ = [
    "corners_as_numbers",
    "cover_foreign_class",
    "entries_of",
    "entry_of",
    "formula",
    "generic",
    "kernel",
    "mark_undefined",
    "named_tuple_class",
    "number",
    "of_entries",
    "operation",
    "proof_kernel",
    "row_of",
    "take_mark",
    "with_entry",
]
