"""Functions that bound the mean number of throws and the probability of ever ending at a place, found throw by throw.

The checker proves one inequality of each (`limitsets/checker/horizon.py`); how they are found does not matter.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial

import numpy as np

from limitsets.base.arrays import Array
from limitsets.proofs.chances.chain import Chain

# A bound is good enough once so many throws more narrow it by less than this share.
PATIENCE, SOON, NARROWED, MOST_THROWS = 50, 10, 1e-3, 3000
# Of the mean a tenth of this share: with 12 000 cells it is what the cells leave open, not what the throws do.
CLOSER = 0.1
# By this share a function is made smaller, or larger, that the roundings of its inequality are made up for.
SLACK = 1e-9
# What may be missing in an inequality before the function is made up for it, at most so often.
LACKING, RAISED = 1e-7, 6


# By the nodes' numbers, from below with the other sign: functions that prove a bound from below, and from above.
Functions = tuple[Array | None, Array | None]


def _settled(
    bounds: Iterable[tuple[float, Array]], scale: float = 1.0, patience: int = PATIENCE
) -> tuple[float, Array] | None:
    """Return the last of ever better bounds, once they hardly change: at most `scale` times the share."""
    every: list[float] = []
    last = None
    for bound, values in bounds:
        every.append(bound)
        last = bound, values
        before = every[-patience] if len(every) > patience else math.nan
        if math.isfinite(bound) and abs(bound - before) <= NARROWED * scale * abs(bound):
            break
    return last if last is not None and math.isfinite(last[0]) else None


def mean_bounds(chain: Chain) -> list[tuple[float, Array | None]]:
    """Bound the mean number of throws until absorption, from below and from above, with functions that prove it.

    On coarse cells no function is as good from below as the mean of the lesser of T and n: then there is none, and a
    recheck makes the throws again.
    """
    from limitsets.checker import horizon

    fixed, pair = horizon.nothing(chain.steps), list[tuple[float, Array | None]]()
    for sign, ever_better in ((-1.0, horizon.means_below), (1.0, horizon.means_above)):
        last = _settled(ever_better(chain.steps, chain.row), CLOSER)
        if last is None:
            pair.append((0.0 if sign < 0.0 else math.inf, None))
            continue
        values = _made_up(chain, last[1], fixed, sign, partial(_scaled, sign))
        bound = math.inf if values is None else horizon.mean_above(chain.row, values)
        worse = bound - sign * last[0] > NARROWED * last[0]
        pair.append((last[0], None) if sign < 0.0 and worse else (sign * bound, values))
    return pair


def _scaled(sign: float, values: Array, lacking: float) -> Array:
    """Scale a function of the mean: with V also (1 + 2c) V, or the less of -V, has its inequality, and c to spare."""
    return values * (1.0 + sign * (2.0 * lacking + SLACK))


def _lifted(ends: Array, values: Array, lacking: float) -> Array:
    """Lift a function by a multiple of V >= 1 + K V."""
    return values + 2.0 * lacking * ends


def _raised(chain: Chain, values: Array, fixed: Array, more: float) -> Array:
    """Raise a function where it is below what it has to bound, throw by throw, until that is by little."""
    from limitsets.checker import horizon

    made = horizon.made_from(chain.steps)
    for _ in range(MOST_THROWS):
        above = chain.steps.above(values, fixed, more)
        if not float((above - values)[made].max()) > LACKING:
            break
        values = values.copy()
        values[made] = np.maximum(values[made], above[made])
    return values


def ever_functions(chain: Chain, within: Mapping[str, Array], ends: Array) -> dict[str, Functions]:
    """Find by name functions that bound the probability of ever ending at a place, from below and from above.

    What ends elsewhere does not end here: from above it is 1 less the others' functions from below.

    Parameters
    ----------
    chain : Chain
        The chain.
    within : mapping of str to ndarray, shape (2, n)
        By name, of all that absorb, bounds at the nodes of the probability within some number of throws.
    ends : ndarray, shape (n,)
        V >= 1 + K V, with which a function is raised where an inequality fails by a little.
    """
    from limitsets.checker import horizon

    lifted = partial(_lifted, ends)
    lower, both = dict[str, Array | None](), dict[str, Functions]()
    for name in chain.steps.absorbed:
        fixed = horizon.fixed_of(chain.steps, name, -1.0)
        last = _settled(_steps(chain, -within[name][0], fixed), 0.1 * NARROWED, SOON)
        lower[name] = None if last is None else _made_up(chain, last[1], fixed, 0.0, lifted)
    for name, below in lower.items():
        others = [each for other, each in lower.items() if other != name and each is not None]
        values = np.maximum(sum(others, start=np.ones(len(ends))), 0.0)
        fixed = horizon.fixed_of(chain.steps, name, 1.0)
        both[name] = below, _made_up(chain, values, fixed, 0.0, lifted)
    return both


def _made_up(
    chain: Chain, values: Array, fixed: Array, more: float, mend: Callable[[Array, float], Array]
) -> Array | None:
    """Raise a function until it is above its mean after a throw everywhere, or return none."""
    from limitsets.checker import horizon

    values = _raised(chain, values, fixed, more)
    for k in range(RAISED):
        lacking = horizon.worst(chain.steps, values, fixed, more)
        if lacking <= 0.0:
            return values
        values = mend(values, lacking * 10.0**k)  # a little more is lost to the roundings of what is added
    return None


def forever(
    chain: Chain, names: Iterable[str], within: Mapping[str, Array]
) -> tuple[tuple[float, float], dict[str, tuple[float, float]], dict[str, Array]]:
    """Bound the mean, and where throws are proved to end the probabilities of ever ending at places."""
    from limitsets.checker.horizon import mean_above

    (low, lower), (high, upper) = mean_bounds(chain)
    pair, ever = (("mean.lower", lower), ("mean.upper", upper)), {}
    functions = {name: each for name, each in pair if each is not None}
    both = {} if upper is None else ever_functions(chain, within, upper)
    none = np.zeros(len(chain.steps.mesh.place))
    for k, name in enumerate(names if both else ()):
        below, above = both[name]
        functions[f"ever.{k}.lower"] = none if below is None else below
        functions[f"ever.{k}.upper"] = none + 1.0 if above is None else above
        ever[name] = (
            0.0 if below is None else max(-mean_above(chain.row, below), 0.0),
            1.0 if above is None else min(mean_above(chain.row, above), 1.0),
        )
    return (low, high), ever, functions


def _steps(chain: Chain, values: Array, fixed: Array) -> Iterator[tuple[float, Array]]:
    """Make throw after throw of a bound."""
    from limitsets.checker import horizon

    for _ in range(MOST_THROWS):
        yield horizon.mean_above(chain.row, values), values
        values = chain.steps.above(values, fixed)
