"""Any number of throws: functions that one throw maps below themselves, and what such a function bounds.

docs/certificates.md, "Probabilities", number 23.  A file holds the functions at the nodes; how they were found does not
matter.  T is the throw of the first absorption, K V the mean of V after a throw.
"""

import math
from collections.abc import Callable, Iterator

import numpy as np

from .balls import Array, prove
from .file import plain, rounded
from .means import INFLATE, Rows
from .steps import Chain

MOST_MEAN = 5_000  # steps in which a mean is bounded
# A mean is bounded from above once no state's bound grows by more than this share of a throw.
GROWTH = 0.5
# Bounds that move by less have come to rest; one above this grows without end.
STILL, HOPELESS = 1e-9, 1e6
MeanBound = tuple[float, Array]  # of a mean over the starts, and the function


def mean_above(row: Rows, values: Array) -> float:
    """Bound the mean over the starts from above."""
    return float(row.times(values)[0]) + row.off * float(np.abs(values).max())


def made_from(chain: Chain) -> Array:
    """List the nodes of cells that throws are made from."""
    nodes: Array = np.unique(np.concatenate([chain.live, chain.live + 1, chain.hard.at, chain.hard.at + 1]))
    return nodes


def nothing(chain: Chain) -> Array:
    """Return 0 on the places that absorb."""
    return chain.fixed(dict.fromkeys(chain.absorbed, 0.0))


def worst(chain: Chain, values: Array, fixed: Array, more: float) -> float:
    """Return by how much V is below `more` and the mean of V after a throw, or below what is fixed, at most."""
    if not np.isfinite(values).all():
        return math.inf
    absorbed, made = np.unique(np.concatenate([*chain.absorbed.values()])), made_from(chain)
    above = chain.above(values, fixed, more)
    return float(
        max((above - values)[made].max(initial=-np.inf), (fixed - values)[absorbed].max(initial=-np.inf))
    )


# ----------------------------------------------------------------
# The mean number of throws.


def means_below(chain: Chain, row: Rows) -> Iterator[MeanBound]:
    """Bound the mean of T from below, ever better: V <= 1 + K V, bounded above, with V <= 0 where throws have ended.

    V is at most the mean of the lesser of T and n, plus its greatest value times P(T > n): if this does not tend to 0
    the mean is infinite.  V is found as the mean of the lesser of T and n; -V is given.
    """
    fixed = nothing(chain)
    below, low, change = chain.first(fixed), 0.0, math.inf
    for _ in range(MOST_MEAN):
        yield low, below
        if not change > STILL:
            return
        before, below = below, chain.above(below, fixed, -1.0)
        low, change = max(low, -mean_above(row, below)), float((before - below).max())


def means_above(chain: Chain, row: Rows) -> Iterator[MeanBound]:
    """Bound the mean of T from above, ever better: V >= 1 + K V, V >= 0.

    It is found where 1 + K V <= V + c with c < 1: V / (1 - c) is such a function.
    """
    fixed, made = nothing(chain), made_from(chain)
    above, best = chain.first(fixed), (math.inf, np.full(len(fixed), np.inf))
    for _ in range(MOST_MEAN):
        after = chain.above(above, fixed, 1.0)
        growth = float((after - above)[made].max())
        if growth < GROWTH and bool((above >= 0.0).all()):
            bound = mean_above(row, above) / (1.0 - growth) * INFLATE
            best = min(best, (bound, above / (1.0 - growth) * INFLATE), key=lambda each: each[0])
        yield best
        if growth <= STILL or not float(after.max()) < HOPELESS:
            return
        above = after


def proves_mean_below(chain: Chain, values: Array) -> bool:
    """Whether -V proves a mean from below."""
    return worst(chain, values, nothing(chain), -1.0) <= 0.0


def proves_mean_above(chain: Chain, values: Array) -> bool:
    """Whether V proves a mean from above; then P(T > n) <= (1 - 1/max V)^n V, for K V <= V - 1."""
    return bool((values >= 0.0).all()) and worst(chain, values, nothing(chain), 1.0) <= 0.0


def reached(bounds: Iterator[MeanBound], enough: Callable[[float], bool]) -> float:
    """Return the first bound that is good enough, or the last."""
    last = math.nan
    for last, _ in bounds:
        if enough(last):
            break
    return last


def check_mean(
    chain: Chain, row: Rows, said: tuple[float, float], functions: tuple[Array | None, Array | None]
) -> None:
    """Check the bounds of the mean number of throws, by their functions or, in a file without, by finding some."""
    lower, upper = functions
    if lower is None:
        low = reached(means_below(chain, row), lambda bound: bound >= said[0])
    else:
        prove(proves_mean_below(chain, lower), "the lower function of the mean is none")
        low = -mean_above(row, lower)
    proved = f"the mean is at least {said[0]!r}: only {rounded(low, up=False)} is proved"
    prove(low >= said[0], proved)
    if said[1] == math.inf:
        return
    if upper is None:
        high = reached(means_above(chain, row), lambda bound: bound <= said[1])
    else:
        prove(proves_mean_above(chain, upper), "the upper function of the mean is none")
        high = mean_above(row, upper)
    prove(high <= said[1], f"the mean is at most {said[1]!r}: only {high!r} is proved")


# ----------------------------------------------------------------
# The probability of ever ending at a place.


def fixed_of(chain: Chain, name: str, sign: float) -> Array:
    """Return what V, or -V, has to be at least where throws have ended: 1 at the name's places, 0 at others."""
    return chain.fixed({each: sign * float(each == name) for each in chain.absorbed})


def check_ever(
    chain: Chain, row: Rows, name: str, said: tuple[float, float], functions: tuple[Array, Array], ends: bool
) -> None:
    """Check the bounds of a probability by their functions.

    From above: V >= K V, V >= 0, V >= 1 at the places; V of the part is a supermartingale.  From below: V <= K V,
    V <= 1 at the places, V <= 0 at others, and the throws end (`ends`): else V = 1 where they go on for ever would do.
    """
    lower, upper = functions
    what = f'P(ever ended "{plain(name)}")'
    if said[0] > 0.0:
        prove(ends, f"{what}: that the throws end is not proved")
        prove(
            worst(chain, lower, fixed_of(chain, name, -1.0), 0.0) <= 0.0,
            f"{what}: the lower function is none",
        )
        low = -mean_above(row, lower)
        prove(low >= said[0], f"{what} is at least {said[0]!r}: only {rounded(low, up=False)} is proved")
    if said[1] < 1.0:
        one = bool((upper >= 0.0).all()) and worst(chain, upper, fixed_of(chain, name, 1.0), 0.0) <= 0.0
        prove(one, f"{what}: the upper function is none")
        high = mean_above(row, upper)
        prove(high <= said[1], f"{what} is at most {said[1]!r}: only {rounded(high, up=True)} is proved")
