"""The four operations and the root stay sound in every rounding direction; the guard notices each."""

import ctypes
import ctypes.util
import platform
import subprocess
import sys

import pytest

# Processor words for fesetround on x86-64 (C's fenv.h): nearest, down, up, towards zero.
DIRECTIONS = {"nearest": 0x000, "down": 0x400, "up": 0x800, "towards zero": 0xC00}

PROGRAM = """
import ctypes, ctypes.util, sys
from fractions import Fraction
from math import isqrt
import numpy as np
from limitsets import interval
from limitsets.errors import LimitsetsError

rng = np.random.default_rng(7)
n = 4000
size = 10.0 ** rng.uniform(-140, 140, (2, n))
size[:, ::3] = rng.uniform(0.1, 10, (2, (n + 2) // 3))
x, y = rng.choice([-1.0, 1.0], (2, n)) * size
x[::50] = 2.0**-1074 * rng.integers(-40, 40, x[::50].size)
pairs = [(float(a), float(b)) for a, b in zip(x, y)]
exact = {
    "add": [Fraction(a) + Fraction(b) for a, b in pairs],
    "sub": [Fraction(a) - Fraction(b) for a, b in pairs],
    "mul": [Fraction(a) * Fraction(b) for a, b in pairs],
    "div": [Fraction(a) / Fraction(b) for a, b in pairs],
}
ops = {name: getattr(interval, name) for name in exact}
for op in ops.values():
    op((1.0, 1.0), (2.0, 2.0))
interval.sqrt((1.0, 1.0)); interval.sqr((1.0, 1.0)); interval.rounding_is_sound()
c = ctypes.CDLL(ctypes.util.find_library("m"))
assert c.fesetround(int(sys.argv[1])) == 0
results = {name: [op((a, a), (b, b)) for a, b in pairs] for name, op in ops.items()}
squares = [interval.sqr((a, a)) for a, _ in pairs]
roots = [interval.sqrt((abs(a), abs(a))) for a, _ in pairs]
sound = interval.rounding_is_sound()
c.fesetround(0)
bad = 0
for name, values in exact.items():
    bad += sum(not (Fraction(lo) <= v <= Fraction(hi)) for (lo, hi), v in zip(results[name], values))
bad += sum(not (Fraction(lo) <= Fraction(a) ** 2 <= Fraction(hi)) for (lo, hi), (a, _) in zip(squares, pairs))
bad += sum(not (Fraction(lo) ** 2 <= abs(Fraction(a)) <= Fraction(hi) ** 2) for (lo, hi), (a, _) in zip(roots, pairs))
print(bad, sound)
"""


@pytest.mark.sweep
@pytest.mark.parametrize("name", DIRECTIONS)
def test_enclosures_hold_and_the_guard_notices(name):
    if platform.machine() not in ("x86_64", "AMD64") or ctypes.util.find_library("m") is None:
        pytest.skip("the words for rounding directions below are those of x86-64")
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(DIRECTIONS[name])], capture_output=True, text=True, check=True
    )
    bad, sound = run.stdout.split()
    assert int(bad) == 0
    assert sound == str(name == "nearest")
