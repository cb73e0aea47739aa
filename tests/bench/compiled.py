"""The throw in C, compiled for this machine when a benchmark asks for it."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.feeder.thrower.params import Side

__all__ = ["compiler", "throws_in_c"]

SOURCE = Path(__file__).with_name("throw.c")
FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-shared", "-fPIC")
# As the structure in throw.c has them.
NUMBERS = ("kappa", "h", "arm_length", "a", "d", "ell", "rho2", "inertia", "per_inertia", "per_b")
NUMBERS += ("over", "under", "under2", "a_next", "shift")
INTEGERS = ("single_root", "side", "next")

Answer = tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]


class _Side(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in NUMBERS] + [(name, ctypes.c_int64) for name in INTEGERS]


def compiler() -> str | None:
    """Path of the C compiler, None where there is none."""
    return shutil.which("cc")


def throws_in_c(
    part: Side, x: NDArray[np.float64], function: str, folder: Path, *, contract: bool
) -> Callable[[], Answer]:
    """Compile throw.c; a call without arguments that throws all of `x` into arrays made beforehand."""
    library = folder / f"throw-{'fast' if contract else 'off'}.so"
    if not library.exists():
        contraction = f"-ffp-contract={'fast' if contract else 'off'}"
        subprocess.run([str(compiler()), *FLAGS, contraction, "-o", library, SOURCE, "-lm"], check=True)
    run: Any = getattr(ctypes.CDLL(str(library)), function)
    run.restype = None
    side = _Side(
        *(float(getattr(part, name)) for name in NUMBERS), *(int(getattr(part, name)) for name in INTEGERS)
    )
    answer = np.empty(x.size), np.empty(x.size, np.int64), np.empty(x.size, np.int64)
    pointers = [ctypes.c_void_p(values.ctypes.data) for values in (x, *answer)]
    count = ctypes.c_int64(x.size)

    def throw() -> Answer:
        run(ctypes.byref(side), count, *pointers)
        return answer

    return throw
