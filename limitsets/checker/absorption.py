"""What is claimed of a noisy chain that absorbs: where it ends, and when; read, found anew, compared, put in words.

docs/certificates.md, "Probabilities", number 22.  T is the step of the first absorption.  The checker makes the steps
itself, and its own brackets have to lie within those claimed.
"""

import math
from collections.abc import Callable, Collection, Iterator
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from .balls import Array, UnprovedError, prove
from .file import Arrays, hex_float, number_and_unit, plain, require, rounded, rows
from .horizon import check_ever, check_mean, mean_above, proves_mean_above
from .means import Rows
from .steps import Chain

ANY, LEFT = "any", "exits"
MOST_BRACKETS = 2_000
OF_ABSORPTION = "names quantiles mean"  # and `ever`, in files written since that is claimed


class Absorption(NamedTuple):
    """What is claimed: read, and not yet believed."""

    within: dict[str, Array]  # by name two columns: lower and upper bound after 0, 1, ... steps
    quantiles: list[tuple[str, Fraction, int, int]]
    mean: tuple[float, float] | None
    ever: dict[str, tuple[float, float]]
    functions: dict[str, Array]


def read_absorption(
    section: dict[str, Any], arrays: Arrays, prefix: str, places: Collection[str], nodes: int
) -> Absorption:
    """Read what is claimed of some places, by their names; functions have one number for each node."""
    names = rows(section["names"], "names", 1, 100)
    known = all(isinstance(name, str) and name in (ANY, LEFT, *places) for name in names)
    require(known and len(set(names)) == len(names), "names are not those of places that absorb")
    ever = {name: (lo, hi) for name, lo, hi in map(read_ever, rows(section.get("ever", []), "ever", 0, 100))}
    require(set(ever) <= set(places), "ever: a name is not that of places that absorb")
    within = {name: arrays.read(f"{prefix}within.{k}", "<f8", 2) for k, name in enumerate(names)}
    needed = [f"ever.{k}.{end}" for k in range(len(ever)) for end in ("lower", "upper")]
    held = [name for name in ("mean.lower", "mean.upper") if f"{prefix}{name}.npy" in arrays.entries]
    functions = {name: arrays.read(f"{prefix}{name}", "<f8") for name in (*held, *needed)}
    alike = all(len(each) == nodes for each in functions.values())
    require(alike, "a function has not one number for each node")
    lengths = {len(each) for each in within.values()}
    require(len(lengths) == 1 and 1 <= lengths.pop() <= MOST_BRACKETS + 1, "the brackets are not alike many")
    quantiles = [read_quantile(each, names) for each in rows(section["quantiles"], "quantiles", 0, 1000)]
    mean = None if section["mean"] is None else read_mean(section["mean"])
    return Absorption(within, quantiles, mean, ever, functions)


def read_quantile(value: object, names: list[Any]) -> tuple[str, Fraction, int, int]:
    """Read one quantile: name, share, and between which numbers of throws."""
    name, share, lo, hi = rows(value, "a quantile", 4, 4)
    part, _ = number_and_unit(share if isinstance(share, str) else "", "share", "a quantile")
    counts = type(lo) is int and type(hi) is int and 0 <= lo <= hi
    require(name in names and 0 < part < 1 and counts, "a quantile is none")
    return name, part, lo, hi


def read_mean(value: object) -> tuple[float, float]:
    """Read the bounds of a mean; null where there is no upper one."""
    lo, hi = rows(value, "mean", 2, 2)
    low, high = hex_float(lo, "mean"), math.inf if hi is None else hex_float(hi, "mean")
    require(0 <= low <= high, "the bounds of the mean are none")
    return low, high


def read_ever(value: object) -> tuple[str, float, float]:
    """Read the bounds of one probability."""
    name, lo, hi = rows(value, "ever", 3, 3)
    low, high = hex_float(lo, "ever"), hex_float(hi, "ever")
    require(isinstance(name, str) and 0 <= low <= high <= 1, "ever: the bounds are none")
    return name, low, high


def absorption_in_words(a: Absorption, step: str) -> Iterator[str]:
    """Put the claim in words, from the numbers that were checked; `step` says what is counted."""
    last = len(next(iter(a.within.values()))) - 1
    for name, said in a.within.items():
        lo, hi = (float(end) for end in said[-1])
        what = "P(T <= n)" if name == ANY else f'P(ended "{name}" within n {step}s)'
        between = f"between {rounded(lo, up=False)} and {rounded(hi, up=True)}"
        yield f"    {what} for n = 0 to {last}; for n = {last} {between}"
    for name, share, first, by in a.quantiles:
        ended = "have ended" if name == ANY else f'have ended "{name}"'
        count = f"exactly {first}" if first == by else f"between {first} and {by}"
        yield f"    the least number of {step}s within which {float(100 * share):.6g} % {ended}: {count}"
    for name, (low, high) in a.ever.items():
        between = f"between {rounded(low, up=False)} and {rounded(high, up=True)}"
        yield f'    P(ever ended "{name}"), after any number of {step}s: {between}'
    if a.mean is not None:
        most = f", at most {rounded(a.mean[1], up=True)}" if math.isfinite(a.mean[1]) else ""
        yield f"    the mean of T: at least {rounded(a.mean[0], up=False)}{most}"


# ----------------------------------------------------------------
# The brackets, found anew.


def brackets_of(
    chain: Chain, row: Rows, name: str, count: int, told: Callable[[int], None] = lambda done: None
) -> tuple[Array, Array]:
    """Prove brackets of one name after 0, 1, ... throws, so many in all; with bounds at the nodes after the last."""
    value = {each: float(name in (ANY, each)) for each in chain.absorbed}
    fixed = [chain.fixed({each: sign * v for each, v in value.items()}) for sign in (-1.0, 1.0)]
    bound = [chain.first(each) for each in fixed]
    brackets = np.empty((count, 2))
    for n in range(count):
        if n:
            bound = [chain.above(values, each) for values, each in zip(bound, fixed, strict=True)]
        brackets[n] = -mean_above(row, bound[0]), mean_above(row, bound[1])
        told(n)
    # to have ended is for ever: a lower bound holds later on, an upper one earlier
    brackets[:, 0] = np.maximum(np.maximum.accumulate(brackets[:, 0]), 0.0)
    brackets[:, 1] = np.minimum(np.minimum.accumulate(brackets[::-1, 1])[::-1], 1.0)
    return brackets, np.stack([-bound[0], bound[1]])


def check_within(name: str, said: Array, brackets: Array, step: str) -> None:
    """Check that the brackets claimed of one name hold those that are proved."""
    wrong = np.flatnonzero(~((said[:, 0] <= brackets[:, 0]) & (brackets[:, 1] <= said[:, 1])))
    if len(wrong):
        n = int(wrong[0])
        lo, hi = rounded(float(brackets[n, 0]), up=False), rounded(float(brackets[n, 1]), up=True)
        claimed = f"[{float(said[n, 0])!r}, {float(said[n, 1])!r}]"
        what = f"P({plain(name)} within {n} {step}s)"
        raise UnprovedError(f"{what}: {claimed} is claimed, [{lo}, {hi}] is proved")


def check_quantiles(a: Absorption, brackets: dict[str, Array]) -> None:
    """Check the quantiles by the brackets that are proved."""
    for name, share, lo, hi in a.quantiles:
        low, high = brackets[name].T
        none_before = lo == 0 or (lo <= len(high) and Fraction(float(high[lo - 1])) < share)
        there = hi < len(low) and Fraction(float(low[hi])) >= share
        quantile = f"the quantile of {float(share):.6g}, {lo} to {hi} throws, is not proved"
        prove(none_before and there, quantile)


def check_absorption(chain: Chain, row: Rows, a: Absorption, step: str, told: Callable[[], None]) -> None:
    """Check everything that is claimed; tells when a name is done.  `step` says what is counted."""
    brackets: dict[str, Array] = {}
    for name, said in a.within.items():
        brackets[name], _ = brackets_of(chain, row, name, len(said))
        told()
        check_within(name, said, brackets[name], step)
    check_quantiles(a, brackets)
    lower, upper = (a.functions.get(f"mean.{end}") for end in ("lower", "upper"))
    if a.mean is not None:
        check_mean(chain, row, a.mean, (lower, upper))
    ends = upper is not None and proves_mean_above(chain, upper)
    for k, (name, said_of) in enumerate(a.ever.items()):
        pair = a.functions[f"ever.{k}.lower"], a.functions[f"ever.{k}.upper"]
        check_ever(chain, row, name, said_of, pair, ends)
