"""Rates with their intervals, the joint law of two fates, and shares of trials in which outlines overlap."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from limitsets.feeding.falling import FATES
from limitsets.robust.noise.proportions import binomial_interval

Row = Mapping[str, Any]


@dataclass(frozen=True)
class Rate:
    """A share of trials.

    Attributes
    ----------
    count, of : int
        So many of so many trials.
    share : float
        Their ratio.
    interval : (float, float)
        Of Clopper and Pearson, 95 %.
    """

    count: int
    of: int
    share: float
    interval: tuple[float, float]


def rate_of(count: int, of: int) -> Rate:
    """Give a rate with its interval.

    Examples
    --------
    >>> [round(end, 3) for end in rate_of(11, 20).interval]
    [0.315, 0.769]
    """
    return Rate(count, of, count / of, binomial_interval(count, of))


@dataclass(frozen=True)
class Overlaps:
    """Trials in which the outlines of parts that pass through each other overlap while both are on the arm.

    Attributes
    ----------
    ever, at_start, at_rest, in_flight : Rate
        At any time; before the first throw; after some throw; during some throw.
    """

    ever: Rate
    at_start: Rate
    at_rest: Rate
    in_flight: Rate


def overlaps_of(rows: Sequence[Row]) -> Overlaps:
    """Count trials with overlaps."""
    names = ("overlap_at_start", "overlap_at_rest", "overlap_in_flight")
    counts = [sum(bool(row[name]) for row in rows) for name in names]
    ever = sum(any(row[name] for name in names) for row in rows)
    return Overlaps(*(rate_of(count, len(rows)) for count in (ever, *counts)))


@dataclass(frozen=True)
class Joint:
    """The joint law of both parts' fates.

    Attributes
    ----------
    table : dict of str to dict of str to int
        Trials by the first part's fate, and by the second's.
    rates : tuple of Rate
        Right feeds of each part by itself: the marginals.
    both : Rate
        Both are fed rightly, in whatever order.
    product : float
        Of the marginals: what independent parts would do.
    error : float
        The product less the share of both: what multiplying is off by.
    error_interval : (float, float)
        Of that, 95 %, to first order: the trials' spread of (both - p1 [2 right] - p2 [1 right]).
    serial : (float, float)
        Interval of the product, 95 %: the rate of feeding serially, one part after the other, or with two arms, where
        the order is certain.
    """

    table: dict[str, dict[str, int]]
    rates: tuple[Rate, Rate]
    both: Rate
    product: float
    error: float
    error_interval: tuple[float, float]
    serial: tuple[float, float]


def joint_of(rows: Sequence[Row]) -> Joint:
    """Count pairs of fates."""
    of = len(rows)
    pairs = [tuple(row["fates"]) for row in rows]
    table = {one: {two: pairs.count((one, two)) for two in FATES} for one in FATES}
    right = [(one == "right", two == "right") for one, two in pairs]
    first, second = (rate_of(sum(each[k] for each in right), of) for k in (0, 1))
    both = rate_of(sum(one and two for one, two in right), of)
    product = first.share * second.share
    terms = [first.share * two + second.share * one - (one and two) for one, two in right]
    mean = sum(terms) / of
    spread = 1.96 * math.sqrt(sum((term - mean) ** 2 for term in terms) / max(of - 1, 1) / of)
    error = product - both.share
    # each marginal at 97.5 %, so that both hold at 95 %
    ends = [binomial_interval(rate.count, of, 0.975) for rate in (first, second)]
    serial = ends[0][0] * ends[1][0], ends[0][1] * ends[1][1]
    return Joint(table, (first, second), both, product, error, (error - spread, error + spread), serial)
