"""A formula as a list of operations: read strictly, evaluated in balls with gradients, and printed.

docs/certificates.md, "Formulas of a map".  A formula is never text that is evaluated, and neither evaluation nor print
recurses, so that 20 000 operations of depth 20 000 are read as any other.
"""

import functools
import itertools
import operator
import re
from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from .balls import ONE, ZERO, Arb, exact
from .file import is_whole, plain, require, rows

MOST_OPERATIONS = 20_000
LARGEST_POWER = 200
LONGEST_LINE = 90  # signs of a formula: a longer part of it is printed as a line of its own
NAN = arb("nan")
ALL_SIGNS = arb(0, 1)
SHORT_DECIMAL = re.compile(r"-?[0-9]{1,40}(\.[0-9]{1,40})?(e[+-]?[0-9]{1,2})?")
Gradient = list[Arb | None]  # by x0, x1, ... and the parameters with a range; None is exactly 0

# ----------------------------------------------------------------
# Numbers, and the operations on balls.


def rational(text: object, where: str) -> Fraction:
    """Read a decimal."""
    fits = isinstance(text, str) and SHORT_DECIMAL.fullmatch(text) is not None
    require(fits, f"{where} is not a decimal of at most 40 digits on each side of the point")
    return Fraction(str(text))


def number(text: object, where: str) -> Arb:
    """Enclose a decimal together with the double next to it: what is proved holds for both."""
    value = rational(text, where)
    return exact(value).union(arb(float(value)))


def magnitude(x: Arb) -> Arb:
    """Enclose the absolute value; where x may be 0 it lies between 0 and the larger end."""
    if x > 0 or x < 0:
        return abs(x)
    largest = x.abs_upper()
    return ZERO.union(largest) if largest > 0 else abs(x)


def power(x: Arb, n: int) -> Arb:
    """Enclose x^n, n not 0: Arb's own power of a ball around 0 is nan or twice as wide as needed."""
    if n < 0:
        return 1 / power(x, -n)
    if n % 2:
        return x if n == 1 else x * power(x, n - 1)
    half = power(magnitude(x), n // 2)
    square = half * half
    # the ball of a square reaches below 0 where the ball of its root holds 0
    return square if half > 0 else magnitude(square)


def sign(x: Arb) -> Arb:
    """Enclose the slopes of |x|, at 0 all of them."""
    return ONE if x > 0 else -ONE if x < 0 else ALL_SIGNS


def by_quotient(x: Arb, y: Arb, ratio: Arb) -> tuple[Arb, Arb]:
    """Return the partial derivatives of x / y."""
    inverse = 1 / y
    return inverse, -ratio * inverse


def by_largest(x: Arb, y: Arb, _: Arb) -> tuple[Arb, Arb]:
    """Return those of max(x, y): where neither is surely larger, all slopes between."""
    share = (1 + sign(x - y)) / 2
    return share, 1 - share


def by_least(x: Arb, y: Arb, largest: Arb) -> tuple[Arb, Arb]:
    """Return those of min(x, y)."""
    first, second = by_largest(x, y, largest)
    return second, first


def by_atan2(y: Arb, x: Arb, _: Arb) -> tuple[Arb, Arb]:
    """Return those of atan2(y, x); nan where the box meets the cut: y = 0 and x <= 0."""
    whole = x * x + y * y if x > 0 or y > 0 or y < 0 else NAN
    return x / whole, -y / whole


Jet = tuple[Arb, Arb, Arb]  # a value, its derivative by x0 and the second


def bend_of_product(x: Jet, y: Jet, _: Arb) -> tuple[Arb, Arb]:
    """Return the two derivatives of x y by an input."""
    (x0, x1, x2), (y0, y1, y2) = x, y
    return x1 * y0 + x0 * y1, x2 * y0 + 2 * x1 * y1 + x0 * y2


def bend_of_quotient(x: Jet, y: Jet, ratio: Arb) -> tuple[Arb, Arb]:
    """Return those of x / y."""
    (_, x1, x2), (y0, y1, y2) = x, y
    slope = (x1 - ratio * y1) / y0
    return slope, (x2 - 2 * slope * y1 - ratio * y2) / y0


def bend_of_largest(x: Jet, y: Jet, _: Arb) -> tuple[Arb, Arb]:
    """Return those of max(x, y); nan where neither is surely larger."""
    apart = x[0] - y[0]
    return x[1:] if apart > 0 else y[1:] if apart < 0 else (NAN, NAN)


def bend_of_least(x: Jet, y: Jet, _: Arb) -> tuple[Arb, Arb]:
    """Return those of min(x, y)."""
    apart = y[0] - x[0]
    return x[1:] if apart > 0 else y[1:] if apart < 0 else (NAN, NAN)


def bend_of_atan2(y: Jet, x: Jet, _: Arb) -> tuple[Arb, Arb]:
    """Return those of atan2(y, x); nan where the box meets the cut."""
    (y0, y1, y2), (x0, x1, x2) = y, x
    whole = x0 * x0 + y0 * y0 if x0 > 0 or y0 > 0 or y0 < 0 else NAN
    slope = (y1 * x0 - y0 * x1) / whole
    return slope, (y2 * x0 - y0 * x2 - slope * 2 * (x0 * x1 + y0 * y1)) / whole


Function = Callable[..., Arb]
Partials = Callable[[Arb, Arb, Arb], tuple[Arb, Arb]]
Bends = Callable[[Jet, Jet, Arb], tuple[Arb, Arb]]
BINARY: dict[str, tuple[Function, Partials, Bends]] = {
    "add": (operator.add, lambda _, __, ___: (ONE, ONE), lambda x, y, _: (x[1] + y[1], x[2] + y[2])),
    "sub": (operator.sub, lambda _, __, ___: (ONE, -ONE), lambda x, y, _: (x[1] - y[1], x[2] - y[2])),
    "mul": (operator.mul, lambda x, y, _: (y, x), bend_of_product),
    "div": (operator.truediv, by_quotient, bend_of_quotient),
    "min": (arb.min, by_least, bend_of_least),
    "max": (arb.max, by_largest, bend_of_largest),
    "atan2": (arb.atan2, by_atan2, bend_of_atan2),
}
"""Operations on two numbers, their partial derivatives at x, y from the value too, and those by an input."""


def cube_root(x: Arb) -> Arb:
    """Enclose the cube root, which rises with x and has its sign."""
    if not x.is_finite():
        return NAN
    lo, hi = (
        (-(-end).root(3)) if end < 0 else end.root(3) if end > 0 else ZERO for end in (x.lower(), x.upper())
    )
    return lo.union(hi)


def slope_of_cube_root(_: Arb, v: Arb) -> Arb:
    """Enclose the slope by its ends: the ball of a square of a wide ball reaches 0."""
    near, far = v.abs_lower(), v.abs_upper()
    return (1 / (3 * near * near)).union(1 / (3 * far * far)) if near > 0 else NAN


def flat_unless_at_kink(x: Arb, _: Arb) -> Arb:
    """Return the second derivative of |x|; nan where the kink may lie."""
    return ZERO if sign(x).is_exact() else NAN


def flat_between_jumps(_: Arb, v: Arb) -> Arb:
    """Return both derivatives of the floor: it is constant where its ball is one integer."""
    return ZERO if v.is_exact() else NAN


Slope = Callable[[Arb, Arb], Arb]
UNARY: dict[str, tuple[Function, Slope, Slope]] = {
    "neg": (operator.neg, lambda _, __: -ONE, lambda _, __: ZERO),
    "abs": (magnitude, lambda x, _: sign(x), flat_unless_at_kink),
    "sqrt": (arb.sqrt, lambda _, v: 1 / (2 * v), lambda _, v: -1 / (4 * v * v * v)),
    "cbrt": (cube_root, slope_of_cube_root, lambda _, v: -2 / (9 * power(v, 5))),
    "exp": (arb.exp, lambda _, v: v, lambda _, v: v),
    "log": (arb.log, lambda x, _: 1 / x, lambda x, _: -1 / (x * x)),
    "sin": (arb.sin, lambda x, _: x.cos(), lambda _, v: -v),
    "cos": (arb.cos, lambda x, _: -x.sin(), lambda _, v: -v),
    "tan": (arb.tan, lambda _, v: 1 + v * v, lambda _, v: 2 * v * (1 + v * v)),
    "tanh": (arb.tanh, lambda _, v: 1 - v * v, lambda _, v: -2 * v * (1 - v * v)),
    "floor": (arb.floor, flat_between_jumps, flat_between_jumps),
}
"""Operations on one number, and their first and second derivatives at x, from the value v too."""


def slope_of_power(n: int, x: Arb, _: Arb) -> Arb:
    """Return the derivative of x^n."""
    return ONE if n == 1 else n * power(x, n - 1)


def bend_of_power(n: int, x: Arb, _: Arb) -> Arb:
    """Return the second derivative of x^n."""
    return ZERO if n == 1 else arb(n * (n - 1)) * (ONE if n == 2 else power(x, n - 2))


def powers_of(n: int) -> tuple[Slope, Slope]:
    """Return the two derivatives of x^n as functions, as `UNARY` has them."""
    return functools.partial(slope_of_power, n), functools.partial(bend_of_power, n)


# ----------------------------------------------------------------
# Reading.


class Operation(NamedTuple):
    """An operation on earlier ones; `what` is an axis, the name of a parameter, a constant's text or an exponent."""

    word: str
    entries: tuple[int, ...] = ()
    what: Any = None


class Formulas(NamedTuple):
    """Operations in order, and the numbers of those that are the results."""

    operations: list[Operation]
    out: list[int]


def read_formulas(
    raw: dict[str, Any], dimension: int, names: list[str], results: int, where: str
) -> Formulas:
    """Read operations and results."""
    listed = rows(raw["ops"], f"{where}: ops", 0, MOST_OPERATIONS)
    operations = [
        read_operation(one, at, dimension, names, f"{where}, operation {at}") for at, one in enumerate(listed)
    ]
    out = rows(raw["out"], f"{where}: out", results, results)
    require(all(is_whole(k, 0, len(operations) - 1) for k in out), f"{where}: a result is not an operation")
    return Formulas(operations, out)


def read_operation(raw: object, at: int, dimension: int, names: list[str], where: str) -> Operation:
    """Read one operation; it may use earlier ones only."""
    word, *rest = rows(raw, where, 2, 3)
    require(isinstance(word, str), f"{where} does not begin with a word")
    require(len(rest) == 1 + (word in BINARY or word == "pow"), f"{where} has a wrong number of entries")
    if word == "x":
        require(is_whole(rest[0], 0, dimension - 1), f"{where}: there is no such axis")
        return Operation(word, what=rest[0])
    if word == "p":
        require(isinstance(rest[0], str) and rest[0] in names, f"{where}: there is no such parameter")
        return Operation(word, what=rest[0])
    if word == "c":
        rational(rest[0], where)
        return Operation(word, what=rest[0])
    require(word in BINARY or word in UNARY or word == "pow", f"{where}: {plain(word)} is not known")
    if word == "pow":
        whole = is_whole(rest[1], -LARGEST_POWER, LARGEST_POWER) and rest[1] != 0
        require(whole, f"{where}: the power is not a whole number of size 1 to {LARGEST_POWER}")
    entries = rest[:1] if word == "pow" else rest
    require(all(is_whole(k, 0, at - 1) for k in entries), f"{where} is on an operation that is not before it")
    return Operation(word, tuple(entries), rest[1] if word == "pow" else None)


# ----------------------------------------------------------------
# Evaluating.


class Program:
    """Formulas for one box of parameters; what depends on neither x nor a range of a parameter is computed once.

    `values` are the balls of the parameters, `wide` those with a range: they are inputs after x0, x1, ...
    """

    def __init__(self, formulas: Formulas, dimension: int, values: dict[str, Arb], wide: list[str]):
        self.formulas, self.out, self.n_inputs = formulas, formulas.out, dimension + len(wide)
        self.known: list[Arb] = []  # None where it has to be computed
        self.inputs: list[tuple[int, int]] = []
        self.steps: list[
            tuple[int, Function, int, int]
        ] = []  # number, function, one or two entries (else -1)
        for k, (word, entries, what) in enumerate(formulas.operations):
            if word in ("x", "p", "c"):
                self.known.append(None)
                if word == "x" or (what in wide and word == "p"):
                    self.inputs.append((k, what if word == "x" else dimension + wide.index(what)))
                else:
                    self.known[k] = values[what] if word == "p" else number(what, "a constant")
                continue
            function = (
                functools.partial(power, n=what) if word == "pow" else (BINARY.get(word) or UNARY[word])[0]
            )
            constant = all(self.known[j] is not None for j in entries)
            self.known.append(function(*(self.known[j] for j in entries)) if constant else None)
            if not constant:
                self.steps.append((k, function, entries[0], entries[1] if len(entries) == 2 else -1))

    def entries_of(self, word: str) -> list[tuple[int, int]]:
        """List the operations of a word on one number that varies: their numbers, and those of their entries."""
        return [(k, a) for k, _, a, _ in self.steps if self.formulas.operations[k].word == word]

    def at(self, inputs: list[Arb], out: list[int] | None = None) -> list[Arb]:
        """Enclose the results, or other operations, for all numbers in the balls of the inputs."""
        balls = self.known.copy()
        for k, j in self.inputs:
            balls[k] = inputs[j]
        for k, function, a, b in self.steps:
            balls[k] = function(balls[a]) if b < 0 else function(balls[a], balls[b])
        return [balls[k] for k in out or self.out]

    def gradients(self, inputs: list[Arb], out: list[int] | None = None, apart: int = -1) -> list[list[Arb]]:
        """Enclose the gradients of the results, by all inputs; at a kink all slopes between, at a jump nan.

        A finite gradient is so only where the formula is defined and Lipschitz on the balls of the inputs.  With
        `apart` that operation counts as one more input, the last, whatever its entries are.
        """
        count = self.n_inputs + (apart >= 0)
        flat: Gradient = [None] * count
        balls = self.known.copy()
        by: list[Gradient] = [flat] * len(balls)
        for k, j in self.inputs:
            balls[k], by[k] = inputs[j], [ONE if i == j else None for i in range(count)]
        for k, function, a, b in self.steps:
            word, _, exponent = self.formulas.operations[k]
            x = balls[a]
            y = None if b < 0 else balls[b]
            value = balls[k] = function(x) if y is None else function(x, y)
            if k == apart:
                by[k] = [None] * self.n_inputs + [ONE]
                continue
            if y is not None:
                first, second = BINARY[word][1](x, y, value) if value.is_finite() else (NAN, NAN)
                by[k] = [summed(first, u, second, v) for u, v in zip(by[a], by[b], strict=True)]
                continue
            slope = UNARY[word][1] if word != "pow" else powers_of(exponent)[0]
            factor = slope(x, value) if value.is_finite() else NAN
            by[k] = [None if u is None else factor * u for u in by[a]]
        return [[ZERO if u is None else u for u in by[k]] for k in out or self.out]

    def bend(self, inputs: list[Arb], number: int = 0) -> tuple[Arb, Arb, Arb]:
        """Enclose the one result, its derivative by one input and the second; nan where a kink or a jump may lie.

        Finite ones are so only where the formula is twice differentiable on the balls of the inputs.
        """
        balls = self.known.copy()
        flat = ZERO, ZERO
        by: list[tuple[Arb, Arb] | None] = [None] * len(balls)  # None where it does not matter
        for k, j in self.inputs:
            balls[k], by[k] = inputs[j], (ONE, ZERO) if j == number else None
        for k, function, a, b in self.steps:
            word, _, exponent = self.formulas.operations[k]
            x = balls[a]
            value = balls[k] = function(x) if b < 0 else function(x, balls[b])
            own = by[a] if b < 0 else by[a] or by[b]
            if own is None:
                continue
            if not value.is_finite():
                by[k] = NAN, NAN
            elif b >= 0:
                first, second = (balls[a], *(by[a] or flat)), (balls[b], *(by[b] or flat))
                by[k] = BINARY[word][2](first, second, value)
            else:
                slope_of, bend_of = UNARY[word][1:] if word != "pow" else powers_of(exponent)
                slope, bend = slope_of(x, value), bend_of(x, value)
                by[k] = slope * own[0], bend * own[0] * own[0] + slope * own[1]
        k = self.out[0]
        return balls[k], *(by[k] or flat)


def summed(first: Arb, u: Arb | None, second: Arb, v: Arb | None) -> Arb | None:
    """Return first u + second v, where None is exactly 0."""
    if u is None:
        return None if v is None else second * v
    return first * u if v is None else first * u + second * v


# ----------------------------------------------------------------
# Printing.

SIGNS = {"add": ("+", 1), "sub": ("-", 1), "mul": ("*", 2), "div": ("/", 2)}
RESERVED = "|".join(
    [*BINARY, *UNARY, "pow", "margin", "branch", "side", "pi", "tau", "e", "inf", "nan", "if", "else", "mod"]
)
MISLEADING = re.compile(rf"[xt][0-9]*(\..*)?|p\..*|{RESERVED}", re.IGNORECASE)
Written = tuple[
    str, int
]  # a text, and how strongly it binds: 1 sums and signs, 2 products, 3 powers and numbers, 4 names


def named(name: str) -> str:
    """Write a parameter, with `p.` before a name that could be read as something else."""
    return f"p.{name}" if MISLEADING.fullmatch(name) else name


def in_words(formulas: Formulas, names: list[str]) -> list[str]:
    """Write the formulas as they are checked; what is used twice, or is long, has a line of its own."""
    used = itertools.chain(formulas.out, *(one.entries for one in formulas.operations))
    uses = np.bincount(np.array(list(used), dtype=np.int64), minlength=len(formulas.operations)).tolist()
    lines: list[str] = []
    shown: list[Written] = []
    for k, one in enumerate(formulas.operations):
        text, level = operation_in_words(one, shown)
        long = len(text) > LONGEST_LINE and k not in formulas.out
        if one.entries and (uses[k] > 1 or long):
            lines.append(f"t{len(lines) + 1} = {text}")
            text, level = f"t{len(lines)}", 4
        shown.append((text, level))
    return lines + [f"{name} = {shown[k][0]}" for name, k in zip(names, formulas.out, strict=True)]


def operation_in_words(one: Operation, shown: list[Written]) -> Written:
    """Write one operation on parts that are written, in brackets where they bind less strongly."""

    def part(k: int, least: int) -> str:
        text, level = shown[one.entries[k]]
        return text if level >= least else f"({text})"

    if one.word in SIGNS:
        sign, level = SIGNS[one.word]
        return f"{part(0, level)} {sign} {part(1, level + 1)}", level
    if one.word == "neg":
        return f"-{part(0, 3)}", 1
    if one.word == "pow":  # (x0^2)^3 is not x0^2^3, nor is (-2)^2 -2^2
        power = str(one.what) if int(str(one.what)) > 0 else f"({one.what})"
        return f"{part(0, 4)}^{power}", 3
    if one.word == "c":
        return str(one.what), 1 if str(one.what).startswith("-") else 3
    if one.entries:
        return f"{one.word}({', '.join(shown[j][0] for j in one.entries)})", 4
    return (f"x{one.what}" if one.word == "x" else named(str(one.what))), 4
