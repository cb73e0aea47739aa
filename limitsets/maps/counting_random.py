"""Random numbers that depend on a seed and on counters only: for noise that differs at every step of every start.

Philox4x32-10 (Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011): ten rounds of two
32-bit multiplications turn four counters and a key of two into four random words.  Nothing is kept from one call to the
next, so results do not depend on the order of the work, on batches or on threads.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from limitsets.jit import kernel

Words: TypeAlias = tuple[np.uint64, np.uint64, np.uint64, np.uint64]

# np.uint64 throughout: numba turns a mixture of signed and unsigned integers into floats.
LOW = np.uint64(0xFFFFFFFF)
HALF = np.uint64(32)
MULTIPLIER_0, MULTIPLIER_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
WEYL_0, WEYL_1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)


@kernel
def philox(seed: int, a: int, b: int) -> Words:
    """Four random 32-bit words for a seed and two 64-bit counters."""
    k0, k1 = np.uint64(seed) & LOW, np.uint64(seed) >> HALF
    c0, c1 = np.uint64(a) & LOW, np.uint64(a) >> HALF
    c2, c3 = np.uint64(b) & LOW, np.uint64(b) >> HALF
    for _ in range(10):
        first, second = MULTIPLIER_0 * c0, MULTIPLIER_1 * c2
        c0, c1, c2, c3 = (
            (second >> HALF) ^ c1 ^ k0,
            second & LOW,
            (first >> HALF) ^ c3 ^ k1,
            first & LOW,
        )
        k0, k1 = (k0 + WEYL_0) & LOW, (k1 + WEYL_1) & LOW
    return c0, c1, c2, c3


@kernel
def uniform_pair(seed: int, a: int, b: int) -> tuple[float, float]:
    """Two numbers in (0, 1), each with 52 random bits; never 0 or 1."""
    c0, c1, c2, c3 = philox(seed, a, b)
    first = ((c0 << HALF) | c1) >> np.uint64(12)
    second = ((c2 << HALF) | c3) >> np.uint64(12)
    return (float(first) + 0.5) * 2.0**-52, (float(second) + 0.5) * 2.0**-52


@kernel
def normal_pair(seed: int, a: int, b: int) -> tuple[float, float]:
    """Two independent standard normal numbers, by the method of Box and Muller; none beyond 8.5."""
    u, v = uniform_pair(seed, a, b)
    radius = math.sqrt(-2.0 * math.log(u))
    return radius * math.cos(2.0 * math.pi * v), radius * math.sin(2.0 * math.pi * v)
