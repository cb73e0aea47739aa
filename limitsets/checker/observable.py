"""What is averaged along orbits: read, bounded on a cell, and put in words.

docs/certificates.md, "Averages": the claim `average` of a map of a line, and of the throw.
"""

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from flint import arb

from .balls import Arb, Array, Pair, float_of, floats_around
from .file import Arrays, hex_float, is_whole, read_box, read_side, require, rows, table
from .program import Formulas, Program, in_words, read_formulas

LEAST_WEIGHT, MOST_WEIGHT = 2.0**-100, 2.0**100
MOST_FUNCTIONS = 99

# ----------------------------------------------------------------
# Reading.


class Averaged(NamedTuple):
    """A function, and between which numbers its average lies on each of some components.

    `what` is by `word`: "lyapunov" nothing; "formula" the formula; "share" places, as side and ends; "steps" pairs of
    a side and a branch.
    """

    word: str
    what: Any
    bounds: dict[int, Pair]
    upper: Array  # u of the upper end, and of the lower end
    lower: Array
    weight: Array


class Average(NamedTuple):
    """The functions that are averaged; of which pairs the quotient is asked for; runs beside changes of branch."""

    functions: list[Averaged]
    quotients: list[tuple[int, int]]
    runs: Array  # by component and undecided cell: cells of J below it, and above

    def components(self) -> list[int]:
        """Return the components, which are those of each function."""
        return sorted(self.functions[0].bounds)


class Allowed(NamedTuple):
    """What a function may name: how many sides and branches there are, and the names of parameters."""

    sides: int
    branches: int
    names: list[str]
    periods: Sequence[str | None] = ()  # of a line by side


KEYS = "components functions quotients"
COLUMNS = ("upper", "lower", "weight")


def read_average(
    section: dict[str, Any], arrays: Arrays, prefix: str, allowed: Allowed, where: str
) -> Average:
    """Read the claim `average`."""
    components = rows(section["components"], f"{where}: components", 1, 10_000)
    require(all(is_whole(k, 0, 2**31) for k in components), f"{where}: a component is not a whole number")
    require(len(set(components)) == len(components), f"{where}: a component stands twice")
    listed = rows(section["functions"], f"{where}: functions", 1, MOST_FUNCTIONS)
    count = len(listed)
    numbers = [arrays.read(f"{prefix}average.{word}", "<f8", count) for word in COLUMNS]
    columns = [array.reshape(len(array), count).T for array in numbers]
    functions = [
        read_function(one, components, allowed, f"{where}: function {k}", [column[k] for column in columns])
        for k, one in enumerate(listed)
    ]
    quotients = [
        (i, j)
        for i, j in (
            rows(pair, f"{where}: a quotient", 2, 2)
            for pair in rows(section["quotients"], f"{where}: quotients", 0, 10_000)
        )
        if is_whole(i, 0, count - 1) and is_whole(j, 0, count - 1)
    ]
    require(len(quotients) == len(section["quotients"]), f"{where}: a quotient is not of two functions")
    positive = all(lo >= LEAST_WEIGHT for _, j in quotients for lo, _ in functions[j].bounds.values())
    require(positive, f"{where}: that a divisor is above 0 is not claimed")
    return Average(functions, quotients, arrays.read(f"{prefix}average.runs", "<i4", 2))


def read_function(
    raw: object, components: list[int], allowed: Allowed, where: str, columns: list[Array]
) -> Averaged:
    """Read one function, with its bounds and its columns of the arrays."""
    known = table(raw, where, "of lower upper")
    of = table(known["of"], f"{where}: of", "", "lyapunov formula share steps")
    require(len(of) == 1, f"{where}: of does not name one function")
    ((word, value),) = of.items()
    what: Any = None
    if word == "lyapunov":
        require(value is True, f"{where}: of.lyapunov is not true")
    elif word == "formula":
        table(value, f"{where}: of.formula", "ops out")
        what = read_formulas(value, 1, allowed.names, 1, f"{where}: of.formula")
    elif word == "share":
        what = [
            (read_side(one["side"], allowed.sides), *read_box(one["box"], 1, f"{where}: of.share")[0])
            for one in (
                table(each, f"{where}: of.share", "side box")
                for each in rows(value, f"{where}: of.share", 1, 10_000)
            )
        ]
    else:
        what = [
            (read_side(side, allowed.sides), read_side(branch, allowed.branches))
            for side, branch in (
                rows(pair, f"{where}: of.steps", 2, 2) for pair in rows(value, f"{where}: of.steps", 1, 128)
            )
        ]
    ends = []
    for key in ("lower", "upper"):
        texts = rows(known[key], f"{where}: {key}", len(components), len(components))
        ends.append([hex_float(text, f"{where}: {key}") for text in texts])
    ordered = all(-MOST_WEIGHT <= lo <= hi <= MOST_WEIGHT for lo, hi in zip(*ends, strict=True))
    require(ordered, f"{where}: the two ends do not ascend, or are not between -2^100 and 2^100")
    return Averaged(word, what, dict(zip(components, zip(*ends, strict=True), strict=True)), *columns)


# ----------------------------------------------------------------
# Bounds on a cell.


class OnCell(NamedTuple):
    """A cell on one of its branches: side, branch, ends, their ball, its middle; |f'| there; f''/f' over the cell."""

    side: int
    branch: int
    ends: tuple[float, float]
    x: Arb
    middle: Arb
    slope: Callable[[], Arb]
    bend: Arb


Observed = Callable[[OnCell], tuple[float, ...]]
"""Five numbers of a function on a cell: bounds of its mean, least, largest, and how far these two are apart."""


def observed(
    average: Average, program_of: Callable[[Formulas], Program], ranges: list[Arb]
) -> list[Observed]:
    """Return by function what bounds it on a cell; `ranges` are of parameters."""
    return [observed_of(function, program_of, ranges) for function in average.functions]


def observed_of(function: Averaged, program_of: Callable[[Formulas], Program], ranges: list[Arb]) -> Observed:
    """Return what bounds a function on a cell."""
    if function.word == "lyapunov":
        return lambda at: bounds_by_slope(at.slope().log(), at.bend, at.x)
    if function.word == "formula":
        return functools.partial(bounds_of_formula, program_of(function.what), ranges)
    if function.word == "share":
        return functools.partial(bounds_of_share, function.what)
    return functools.partial(bounds_of_steps, set(function.what))


def bounds_by_slope(middle: Arb, slope: Arb, x: Arb) -> tuple[float, ...]:
    """Bound a function by its value in the middle of a cell and its slopes: its mean is off by |I|(B - A)/8 at most."""
    half, spread = x.rad(), slope.rad()  # |I| = 2 half, B - A = 2 spread
    mean = middle + arb(0, 1) * (half * spread / 2)
    largest = half * abs(slope).abs_upper()
    ball = middle + arb(0, 1) * largest
    (lo, hi), (least, most) = floats_around(mean), floats_around(ball)
    return lo, hi, least, most, floats_around(2 * largest)[1]


def bounds_of_formula(program: Program, ranges: list[Arb], at: OnCell) -> tuple[float, ...]:
    """Bound a formula on a cell: by its slopes, or by its ball where it has a kink or jump."""
    slope = program.gradients([at.x, *ranges])[0][0]
    if slope.is_finite():
        return bounds_by_slope(program.at([at.middle, *ranges])[0], slope, at.x)
    least, most = floats_around(program.at([at.x, *ranges])[0])
    return least, most, least, most, math.nextafter(most - least, math.inf)


def bounds_of_share(places: list[tuple[int, float, float]], at: OnCell) -> tuple[float, ...]:
    """Bound the indicator of some places: 1 in one of them, 0 off all but for borders, else between."""
    own = [(lo, hi) for side, lo, hi in places if side == at.side]
    inside = any(lo <= at.ends[0] and at.ends[1] <= hi for lo, hi in own)
    off = all(hi <= at.ends[0] or at.ends[1] <= lo for lo, hi in own)
    least, most = (1.0, 1.0) if inside else (0.0, 0.0) if off else (0.0, 1.0)
    return least, most, least, most, most - least


def bounds_of_steps(steps: set[tuple[int, int]], at: OnCell) -> tuple[float, ...]:
    """Bound the indicator of steps from some sides on some branches."""
    value = 1.0 if (at.side, at.branch) in steps else 0.0
    return value, value, value, value, 0.0


# ----------------------------------------------------------------
# Words.


def function_in_words(one: Averaged, branches: list[str]) -> str:
    """Say what a function is; `branches` are words for taking a branch."""
    if one.word == "lyapunov":
        return "ln |dx'/dx|, whose average is the Lyapunov exponent"
    if one.word == "formula":
        return "; ".join(in_words(one.what, ["g"]))
    if one.word == "share":
        spans = ", ".join(f"[{lo!r}, {hi!r}] of side {side}" for side, lo, hi in one.what)
        return f"the share of steps in {spans}"
    return f"the share of steps that {', '.join(f'{branches[b]} on side {side}' for side, b in one.what)}"


def known_bounds(one: Averaged, component: int) -> Pair:
    """Return the bounds of an average; a share lies between 0 and 1 by itself."""
    lo, hi = one.bounds[component]
    return (min(max(lo, 0.0), 1.0), max(min(hi, 1.0), 0.0)) if one.word in ("share", "steps") else (lo, hi)


def quotient_of(above: Pair, below: Pair) -> Pair:
    """Bound a quotient of two numbers between bounds, of which the second is above 0."""
    ends = [Fraction(one) / Fraction(other) for one in above for other in below]
    return float_of(min(ends), up=False), float_of(max(ends), up=True)


def average_in_words(average: Average, components: dict[int, str], branches: list[str]) -> str:
    """Say what is averaged and what is proved of it."""
    return "\n".join(lines_of_average(average, components, branches))


def lines_of_average(average: Average, components: dict[int, str], branches: list[str]) -> Iterator[str]:
    """Say it in lines: by component the functions, each with its bounds, and the quotients."""
    names = [function_in_words(one, branches) for one in average.functions]
    for k, name in components.items():
        yield f"of almost every start in {name} these averages over n steps converge, each to a number between the two"
        bounds = [known_bounds(one, k) for one in average.functions]
        yield from (f"    {lo!r} to {hi!r}: {what}" for what, (lo, hi) in zip(names, bounds, strict=True))
        for i, j in average.quotients:
            lo, hi = quotient_of(bounds[i], bounds[j])
            yield f"    {lo!r} to {hi!r}: the quotient of function {i} by function {j}"
    yield "    means over invariant densities lie there too"
