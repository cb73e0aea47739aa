"""A policy thrown many times: random starts, noise anywhere in its bounds and at them, errors of the sensor too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import AnswerError
from limitsets.maps import images
from limitsets.policies.policy import NONE
from limitsets.policies.synthesis import Synthesis

Floats = NDArray[np.float64]

# Kappas drawn for each throw, the two ends of its noise among them.
KAPPAS = 16


@dataclass(frozen=True, eq=False)
class Simulated:
    """What became of the parts.

    Attributes
    ----------
    parts : int
        How many were started.
    reached : int
        Those that came to the goal region, and where the controller stops, were known to be there.
    failures : dict of str to int
        What happened to the others.
    throws : ndarray of int, shape (most throws + 1,)
        How many of those that came took 0, 1, ... throws.
    """

    parts: int
    reached: int
    failures: dict[str, int]
    throws: NDArray[np.int64]

    @property
    def mean(self) -> float:
        """Mean number of throws of those that came."""
        return float(np.average(np.arange(self.throws.size), weights=self.throws)) if self.reached else np.nan


def simulate(found: Synthesis, parts: int = 10_000, seed: int = 0) -> Simulated:
    """Run a policy with throws of the map itself.

    Parameters
    ----------
    found : Synthesis
        A policy that was found.
    parts : int
        How many parts to start, equally likely per length of the starts.
    seed : int
        Of the random numbers.

    Returns
    -------
    Simulated

    Raises
    ------
    AnswerError
        Where there is no policy.
    """
    policy = found.found.policy
    if policy is None:
        remedy = "more throws, other throws, another sensor or fewer starts may do it"
        raise AnswerError("the policy", found.found.verdict, "one that was found", remedy)
    random = np.random.default_rng(seed)
    x, side = _drawn(found, parts, random)
    state = policy.first[_heard(found, x, side, random)]
    took, ends = np.zeros(parts, np.int64), np.full(parts, "", dtype=object)
    moving = np.ones(parts, dtype=bool)
    for made in range(int(policy.left.max()) + 1):
        unknown = moving & (state == NONE)
        ends[unknown] = "an answer that cannot come"
        stops = moving & ~unknown & (policy.throw[state] == NONE)
        ends[stops & ~_inside(found, x, side)] = "stopped elsewhere"
        moving &= ~(unknown | stops)
        if not moving.any():
            break
        took[moving] = made + 1
        for throw, box in enumerate(found.throws.values()):
            now = np.flatnonzero(moving & (policy.throw[state] == throw))
            x[now], side[now], code = _thrown(box, x[now], side[now], random)
            ends[now[code < 0]] = "left the arm"
            moving[now[code < 0]] = False
        if found.mode == "catch":
            fallen = moving & (x >= found.goal[0])
            ends[fallen & (side != found.goal[1])] = "caught on a wrong side"
            moving &= ~fallen
        state = np.where(moving, policy.after[state, _heard(found, x, side, random)], state)
    ends[moving] = "more throws than promised"
    good = ends == ""
    kinds, counts = np.unique(ends[~good].astype(str), return_counts=True)
    return Simulated(
        parts,
        int(good.sum()),
        dict(zip(kinds.tolist(), counts.tolist(), strict=True)),
        np.bincount(took[good], minlength=int(policy.left.max()) + 1),
    )


def _drawn(found: Synthesis, parts: int, random: np.random.Generator) -> tuple[Floats, NDArray[np.int64]]:
    """Draw starts, equally likely per length."""
    spans = [(side, lo, hi) for side, pairs in found.starts.extents().items() for lo, hi in pairs]
    length = np.array([hi - lo for _, lo, hi in spans])
    which = random.choice(len(spans), size=parts, p=length / length.sum())
    at = np.array([(lo, hi) for _, lo, hi in spans])[which]
    side = np.array([side for side, _, _ in spans])[which]
    return random.uniform(at[:, 0], at[:, 1]), side.astype(np.int64)


def _inside(found: Synthesis, x: Floats, side: NDArray[np.int64]) -> NDArray[np.bool_]:
    inside: NDArray[np.bool_] = (x >= found.goal[0]) & (side == found.goal[1])
    return inside


def _heard(found: Synthesis, x: Floats, side: NDArray[np.int64], random: np.random.Generator) -> Any:
    """Read the sensor: the numbers of the answers."""
    if found.sensor is None:
        return np.zeros(x.size, np.int64)
    yes = found.sensor.read(x, side, random.uniform(-1.0, 1.0, x.size))
    words = list(found.game.answers)
    return np.where(yes, words.index("yes"), words.index("no"))


def _thrown(
    box: Any, x: Floats, side: NDArray[np.int64], random: np.random.Generator
) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
    """Throw parts, each with a kappa of the box; where they come to rest, and the codes."""
    low, high = box.bare[0].kappa, box.bare[1].kappa
    kappas: Sequence[float] = [box.middle_kappa]
    if box.kappa_varies:
        kappas = [low, high, *random.uniform(low, high, KAPPAS - 2).tolist()]
    drawn = random.integers(len(kappas), size=x.size)
    after, to, code = x.copy(), side.copy(), np.zeros(x.size, np.int64)
    for k, kappa in enumerate(kappas):
        for own in np.unique(side[drawn == k]).tolist():
            some = (drawn == k) & (side == own)
            landed = images(box.at_kappa(kappa), x[some], own)
            after[some], to[some], code[some] = landed.x, landed.side, landed.code
    if box.landing:
        offset = box.landing * np.clip(random.uniform(-1.25, 1.25, x.size), -1.0, 1.0)
        after = after + offset
    return after, to, code
