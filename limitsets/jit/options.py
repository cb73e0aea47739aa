"""How kernels are compiled: with contraction or without, with the widest vectors."""

from __future__ import annotations

from numba.core import codegen, config


def _use_widest_vectors() -> None:
    """Let LLVM use vectors of 512 bits where the processor has them; numbers stay the same to the bit.

    For Intel's processors LLVM prefers 256 bits (the first of them slowed down at wider ones): a throw takes 11.4 ns
    so, and 6.1 with 512, measured on one processor compiled for in both ways.  The option belongs to the target
    machine, one for the process: it has no effect where numba compiled something before this file was imported, and
    it is part of the key under which compiled code is kept.  ``NUMBA_CPU_FEATURES`` in the environment goes first.
    """
    features = codegen.get_host_cpu_features()
    if config.CPU_FEATURES is None and "+avx512vl" in features:
        config.CPU_FEATURES = f"{features},-prefer-256-bit"


_use_widest_vectors()

_COMMON = {"nopython": True, "error_model": "numpy", "no_cfunc_wrapper": True}
ESTIMATE = {**_COMMON, "fastmath": {"contract"}}
PROOF = {**_COMMON, "fastmath": False}
OVERLOAD = ("error_model", "fastmath")  # what an overload takes of these
