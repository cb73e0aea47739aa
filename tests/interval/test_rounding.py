"""Directions of rounding, and the vectors of IEEE 1788."""

import ctypes
import ctypes.util
import json
import math
import platform
import subprocess
import sys
from collections import Counter
from fractions import Fraction
from pathlib import Path

import pytest

from limitsets import interval
from limitsets.numbers.interval import elementary

# ----------------------------------------------------------------
# The four operations and the root stay sound in every rounding direction; the guard notices each.


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


# ----------------------------------------------------------------
# IEEE 1788 test vectors, where a copy of them lies beside the checkout.
# The vectors are third-party data (Interval Test Framework, github.com/oheim/ITF1788) and are not part of the
# project. Those with bare operands apply to us, infinite and empty ones too; what is asked is containment, with an
# excess of a few units in the last place where the expected ends are finite.


FILE = Path(__file__).resolve().parents[3] / "shared" / "data" / "itf1788.json"
SAME = ("add", "sub", "mul", "div", "neg", "sqr", "sqrt", "sin", "cos", "atan2")
OURS = {name: getattr(interval, name) for name in SAME}
OURS |= {"abs": interval.absolute, "min": interval.minimum, "max": interval.maximum}


def number(text):
    return float.fromhex(text) if "x" in text.lower() else float(text)


def ends_of(operand):
    """Interval of doubles; the empty set is (nan, nan)."""
    if operand["kind"] == "empty":
        return math.nan, math.nan
    return number(operand["lo"]), number(operand["hi"])


def applicable():
    """Vectors with bare operands, and an operation of ours."""
    if not FILE.is_file():
        return []
    found = []
    for vector in json.loads(FILE.read_text())["vectors"]:
        operands = vector["args"]
        if vector["op"] not in OURS or vector["decorated"]:
            continue
        if {a["kind"] for a in (*operands, vector["expect"])} <= {"bounded", "empty"}:
            ends = [ends_of(a) for a in operands]
            found.append((vector["op"], ends, vector["expect"], f"{vector['src']}:{vector['line']}"))
    return found


if FILE.is_file():

    @pytest.mark.parametrize(("name", "operands", "expect", "where"), applicable())
    def test_ieee_1788(name, operands, expect, where):
        got = OURS[name](*operands)
        if expect["kind"] == "empty":  # the operation is defined nowhere on the operands
            # Divided by 0 alone, and the angle of no vector: all, where the standard has nothing.
            everything = {"div": (-math.inf, math.inf), "atan2": (-elementary.PI_ABOVE, elementary.PI_ABOVE)}
            nothing = math.isnan(got[0]) and math.isnan(got[1])
            assert nothing or (got == everything.get(name) and not any(math.isnan(x) for x, _ in operands))
            return
        lo, hi = number(expect["lo"]), number(expect["hi"])
        assert got[0] <= lo
        assert hi <= got[1]
        tight = name in ("add", "sub", "mul", "sqr", "sqrt", "neg", "abs", "min", "max")
        if tight and math.isfinite(lo) and math.isfinite(hi):
            for mine, exact in zip(got, (lo, hi), strict=True):
                if math.isinf(mine):  # the step outward from the largest double
                    assert abs(exact) == sys.float_info.max
                    continue
                assert abs(Fraction(mine) - Fraction(exact)) <= 8 * Fraction(math.ulp(exact))

    def test_many_vectors_apply():
        counts = Counter(name for name, *_ in applicable())
        for name, least in (("sin", 40), ("cos", 40), ("atan2", 100), ("div", 300), ("mul", 100)):
            assert counts[name] >= least
