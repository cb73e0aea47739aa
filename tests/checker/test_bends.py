"""First and second derivatives of formulas in balls, against derivatives that mpmath takes by differences."""

import mpmath
import pytest
from flint import arb

from limitsets.checker.program import Formulas, Program, read_operation

# A formula of x0 and the parameter p = 0.7 for each operation.
FORMULAS = {
    "add": ([["x", 0], ["pow", 0, 3], ["add", 0, 1]], lambda x: x + x**3),
    "sub": ([["x", 0], ["pow", 0, 2], ["c", "2"], ["sub", 2, 1]], lambda x: 2 - x**2),
    "mul": ([["x", 0], ["exp", 0], ["mul", 0, 1], ["mul", 2, 1]], lambda x: x * mpmath.exp(x) ** 2),
    "div": (
        [["x", 0], ["p", "p"], ["pow", 0, 2], ["add", 1, 2], ["div", 0, 3]],
        lambda x: x / (mpmath.mpf("0.7") + x**2),
    ),
    "division of a number": ([["x", 0], ["c", "3"], ["div", 1, 0]], lambda x: 3 / x),
    "neg": ([["x", 0], ["pow", 0, 4], ["neg", 1]], lambda x: -(x**4)),
    "abs": ([["x", 0], ["c", "2"], ["sub", 0, 1], ["abs", 2], ["pow", 3, 3]], lambda x: abs(x - 2) ** 3),
    "sqrt": (
        [["x", 0], ["pow", 0, 2], ["c", "1"], ["add", 1, 2], ["sqrt", 3]],
        lambda x: mpmath.sqrt(x**2 + 1),
    ),
    "exp": ([["x", 0], ["pow", 0, 2], ["exp", 1]], lambda x: mpmath.exp(x**2)),
    "log": ([["x", 0], ["pow", 0, 3], ["log", 1], ["mul", 0, 2]], lambda x: x * mpmath.log(x**3)),
    "sin": ([["x", 0], ["c", "3"], ["mul", 0, 1], ["sin", 2]], lambda x: mpmath.sin(3 * x)),
    "cos": ([["x", 0], ["c", "3"], ["mul", 0, 1], ["cos", 2]], lambda x: mpmath.cos(3 * x)),
    "tan": ([["x", 0], ["pow", 0, 2], ["tan", 1]], lambda x: mpmath.tan(x**2)),
    "tanh": ([["x", 0], ["pow", 0, 2], ["tanh", 1]], lambda x: mpmath.tanh(x**2)),
    "powers below 0": ([["x", 0], ["pow", 0, -2]], lambda x: x**-2),
    "the first power": ([["x", 0], ["pow", 0, 1], ["exp", 1]], mpmath.exp),
    "min": ([["x", 0], ["pow", 0, 2], ["min", 0, 1]], lambda x: x**2),
    "max": ([["x", 0], ["pow", 0, 2], ["max", 1, 0], ["pow", 2, 3]], lambda x: x**3),
    "atan2": (
        [["x", 0], ["pow", 0, 2], ["c", "1"], ["add", 1, 2], ["atan2", 0, 3]],
        lambda x: mpmath.atan2(x, x**2 + 1),
    ),
    "atan2 to the left": (
        [["x", 0], ["neg", 0], ["pow", 0, 2], ["atan2", 2, 1]],
        lambda x: mpmath.atan2(x**2, -x),
    ),
    "floor": ([["x", 0], ["floor", 0], ["add", 0, 1], ["pow", 2, 2]], lambda x: (x + mpmath.floor(x)) ** 2),
}


def program(operations):
    read = [read_operation(raw, at, 1, ["p"], "here") for at, raw in enumerate(operations)]
    return Program(Formulas(read, [len(read) - 1]), 1, {"p": arb("0.7")}, [])


@pytest.mark.parametrize("name", FORMULAS)
def test_derivatives_hold_those_of_mpmath(name):
    operations, function = FORMULAS[name]
    with mpmath.workdps(60):
        for middle, radius in ((0.6, 0.0), (0.6, 1e-3), (0.83, 1e-6)):
            ball = arb(middle, radius)
            answer = program(operations).bend([ball])
            for order, enclosed in enumerate(answer):
                for at in (middle - radius, middle, middle + radius):
                    exact = mpmath.diff(function, mpmath.mpf(at), order)
                    near = arb(mpmath.nstr(exact, 40), 1e-20)
                    assert enclosed.overlaps(near), (name, order, enclosed, exact)
                assert enclosed.rad() < 1000 * radius + 1e-12


KINKS = {
    "abs": [["x", 0], ["abs", 0]],
    "min": [["x", 0], ["c", "0"], ["min", 0, 1]],
    "max": [["x", 0], ["neg", 0], ["max", 0, 1]],
    "floor": [["x", 0], ["floor", 0]],
    "root of 0": [["x", 0], ["sqrt", 0]],
    "the cut of atan2": [["x", 0], ["c", "-1"], ["atan2", 0, 1]],
    "division by 0": [["x", 0], ["c", "1"], ["div", 1, 0]],
}


@pytest.mark.parametrize("name", KINKS)
def test_nothing_is_claimed_where_a_kink_or_jump_may_lie(name):
    _, slope, second = program(KINKS[name]).bend([arb(0, 1e-3)])
    assert not (slope.is_finite() and second.is_finite())
