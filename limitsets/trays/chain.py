"""The chain of one depression: in each pass a kick, and a part that comes by if the depression is empty then.

A state is "empty", "right" or a wrong one.  With K the probabilities of what a kick leaves of each state and c those of
what a part that comes by leaves of the empty one, one pass is P = K C, where C has the row c for "empty" and leaves all
others as they are.  The chain has no memory but its state: `histories` asks whether a depression has.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.files import as_table
from limitsets.trays.counting import Counts

Array = NDArray[np.float64]

# Passes after which nothing changes any more: 2 to this power.
ENDLESS = 40
# A wrong part that no kick moved leaves by so little, that there is one answer.
LEAVES = 1.0 - 1e-12
# Draws of the counted probabilities, and the confidence of the intervals.
DRAWS, CONFIDENCE = 2000, 0.95


@dataclass(frozen=True, eq=False)
class Chain:
    """Probabilities of one pass, by state; state 0 is the empty depression.

    Attributes
    ----------
    captured : ndarray, shape (..., states)
        What a part that comes by leaves of the empty depression.
    kicked : ndarray, shape (..., states, states)
        What a kick leaves of each state.
    right : int
        Number of the state wanted.
    """

    captured: Array
    kicked: Array
    right: int

    @property
    def passed(self) -> Array:
        """Probabilities of one whole pass, shape (..., states, states)."""
        stay = np.array(self.kicked)
        stay[..., :, 0] = 0.0
        return np.asarray(stay + self.kicked[..., :, :1] * self.captured[..., None, :])

    def occupied(self, passes: int) -> Array:
        """Give the probabilities of the states after 0, 1, ... passes from the empty one, (..., passes + 1, states)."""
        step = self.passed
        now = np.zeros((*step.shape[:-2], 1, step.shape[-1]))
        now[..., 0] = 1.0
        rows = [now]
        for _ in range(passes):
            rows.append(rows[-1] @ step)
        return np.concatenate(rows, axis=-2)

    def of_many(self, each: float) -> Chain:
        """Give the chain of passes in which so many parts come by, one after the other.

        What is left over of a whole number is the probability that one more does.
        """
        whole, more = divmod(each, 1.0)
        missed = self.captured[..., :1]
        missed_by_all = missed**whole * (1.0 - more * (1.0 - missed))
        # of those that do not miss the first captured one stays: a geometric series
        captured = self.captured * ((1.0 - missed_by_all) / np.maximum(1.0 - missed, 1e-300))
        captured[..., :1] = missed_by_all
        return Chain(captured, self.kicked, self.right)

    def at_last(self) -> Array:
        """Give the probabilities of the states after endless passes from the empty one, shape (..., states)."""
        power = self.passed
        for _ in range(ENDLESS):
            power = power @ power
            power /= power.sum(axis=-1, keepdims=True)  # rounding grows, too
        return np.asarray(power[..., 0, :])

    @property
    def capture_and_release(self) -> tuple[Array, Array]:
        """Give p_capture and p_release: of the chain watched only while it is empty or right.

        From each of the two, the probability that the other one is the next of them, whatever wrong parts lay there
        between; so p_release/(p_capture + p_release) is exactly the share of "empty" in both, after endless passes.
        """
        step = self.passed
        ends, others = [0, self.right], [k for k in range(1, step.shape[-1]) if k != self.right]
        among, out = step[..., others, :][..., others], step[..., others, :][..., ends]
        between = np.linalg.solve(np.eye(len(others)) - LEAVES * among, out)
        watched = step[..., ends, :][..., ends] + step[..., ends, :][..., others] @ between
        return np.asarray(watched[..., 0, 1]), np.asarray(watched[..., 1, 0])


def chain_of(counts: Counts) -> Chain:
    """Give the chain with the counted shares; only states that came about are in it."""
    return _chain(counts, *_met(counts))


def _met(counts: Counts) -> tuple[Array, Array]:
    at = [0, *counts.met]
    return counts.captured[at].astype(np.float64), counts.kicked[np.ix_(at, at)].astype(np.float64)


def _chain(counts: Counts, captured: Array, kicked: Array) -> Chain:
    """Normalise rows; the empty depression stays empty under a kick."""
    rows = np.array(kicked)
    rows[..., 0, :] = 0.0
    rows[..., 0, 0] = 1.0
    rows /= rows.sum(axis=-1, keepdims=True)
    return Chain(captured / captured.sum(axis=-1, keepdims=True), rows, 1 + counts.met.index(counts.right))


def drawn_chains(counts: Counts, random: np.random.Generator, draws: int = DRAWS) -> Chain:
    """Draw chains that the counts allow: each row from Dirichlet's law of its counts and one count more, spread evenly.

    That is a Bayesian bootstrap with Perks's prior; a plain one would never draw what was not counted.
    """
    captured, kicked = _met(counts)
    more = 1.0 / captured.size
    rows = np.stack([random.dirichlet(row + more, draws) for row in kicked], axis=-2)
    return _chain(counts, random.dirichlet(captured + more, draws), rows)


@dataclass(frozen=True, eq=False)
class Filled:
    """What the chain says of many passes; intervals of 95 % by drawing the counted probabilities anew.

    Attributes
    ----------
    right : ndarray, shape (passes + 1,)
        Fraction of the depressions that are filled rightly after 0, 1, ... passes.
    interval : ndarray, shape (passes + 1, 2)
        Of it.
    wrong, wrong_interval : ndarray, shape (passes + 1,) and (passes + 1, 2)
        Those that hold a wrong part.
    states : tuple of str
        The states that came about; "empty" first.
    last : ndarray, shape (states,)
        Fractions after endless passes.
    last_interval : ndarray, shape (states, 2)
        Of them.
    stays : ndarray, shape (states,)
        Mean number of passes that a depression stays as it is; infinite where no kick changed it.
    number : int
        Of the state wanted, in `states`.
    capture, release : float
        Between empty and right (`Chain.capture_and_release`).
    rest, rest_interval : float; tuple of float
        release/(capture + release): the share that is empty of the depressions without a wrong part.
    """

    right: Array
    interval: Array
    wrong: Array
    wrong_interval: Array
    states: tuple[str, ...]
    last: Array
    last_interval: Array
    stays: Array
    number: int
    capture: float
    release: float
    rest: float
    rest_interval: tuple[float, float]

    @property
    def unfilled(self) -> dict[str, float]:
        """Fractions that are not filled rightly after endless passes: empty depressions, and wrong parts."""
        empty, right = float(self.last[0]), float(self.last[self.number])
        return {"empty": empty, "wrong": max(1.0 - empty - right, 0.0)}

    def passes_to(self, share: float) -> int | None:
        """Give the passes after which this share of the last fraction is filled; None where it takes more, or is 0."""
        last = self.last[self.number]
        found = np.flatnonzero((self.right >= share * last) & (last > 0.0))
        return int(found[0]) if found.size else None

    def to_json(self) -> dict[str, Any]:
        """Give the numbers as JSON takes them."""
        names = self.states
        return as_table(
            right=self.right,
            interval=self.interval,
            wrong=self.wrong,
            wrong_interval=self.wrong_interval,
            last=dict(zip(names, self.last.tolist(), strict=True)),
            last_interval=dict(zip(names, self.last_interval.tolist(), strict=True)),
            stays=dict(zip(names, self.stays.tolist(), strict=True)),
            unfilled=self.unfilled,
            rest={
                "p_capture": self.capture,
                "p_release": self.release,
                "value": self.rest,
                "interval": self.rest_interval,
            },
            passes_to_95=self.passes_to(0.95),
        )


def filled(counts: Counts, passes: int, random: np.random.Generator, each: float = 1.0) -> Filled:
    """Say what follows from the counts for so many passes, in each of which so many parts come by a depression."""
    chain, drawn = chain_of(counts).of_many(each), drawn_chains(counts, random).of_many(each)
    ends = [0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE]

    def interval(values: Array) -> Array:
        return np.moveaxis(np.quantile(values, ends, axis=0), 0, -1)

    with np.errstate(divide="ignore"):
        stays = 1.0 / (1.0 - np.diagonal(chain.passed))
    capture, release = chain.capture_and_release
    captures, releases = drawn.capture_and_release
    low, high = interval(releases / (captures + releases)).tolist()
    now, nows = chain.occupied(passes), drawn.occupied(passes)
    others = [k for k in range(1, now.shape[-1]) if k != chain.right]
    return Filled(
        now[:, chain.right],
        interval(nows[..., chain.right]),
        now[:, others].sum(axis=-1),
        interval(nows[..., others].sum(axis=-1)),
        ("empty", *(counts.states[k] for k in counts.met)),
        chain.at_last(),
        interval(drawn.at_last()),
        stays,
        chain.right,
        float(capture),
        float(release),
        float(release) / float(capture + release) if capture + release else math.nan,
        (low, high),
    )
