"""What is told of each parameter point: arrays whose first axis numbers the points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.topology.work import MOST_ATTRACTORS

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

DECIDED, TOO_FINE, MOVING, BANDS_JOIN, NOT_ONE, STAYING, UNSURE_EXIT = range(7)
DOUBTS = {
    DECIDED: "decided",
    TOO_FINE: "more pieces, bands or attractors than are followed, or a branch narrower than a sample",
    MOVING: "the ends of a band do not come to rest",
    BANDS_JOIN: "bands that are one or two: a gap below the resolution",
    NOT_ONE: "a closed set of cells may hold several attractors",
    STAYING: "orbits stay where no attractor was found",
    UNSURE_EXIT: "cells may lead out of the domain, none surely does",
}


class Topologies(NamedTuple):
    """Topology of the attractors at n parameter points; K attractors at most, S sides.

    Attributes
    ----------
    attractors : ndarray of int, shape (n,)
        How many.
    undecided : ndarray of int, shape (n,)
        0, or the number of the doubt in `DOUBTS`: nothing else that is told of the point counts then.
    bands : ndarray of int, shape (n, K, S)
        Intervals per side.
    lowest, reach : ndarray, shape (n, K, S)
        Ends of the attractor on each side, nan on one that it does not visit [length].
    jogs_min, jogs_max : ndarray of int, shape (n, K, S)
        Steps that stay on a side between arriving and leaving; -1 where no step arrives.
    flip_order : ndarray of int, shape (n, K, S)
        Sides in the cyclic order in which they are visited, from the smallest, then -1; all -2 where it changes.
    period : ndarray of int, shape (n, K)
        Length of the cycle that the attractor is; 0 where it is none.
    share : ndarray, shape (n, K)
        Of the starts, those that come to the attractor.
    leaves, collapses : ndarray, shape (n,)
        Of the starts, those that leave the domain, and those that come back to the joint.
    flips_per_throw, lyapunov : ndarray, shape (n, K)
        Means along one orbit; nan where they were not asked for.
    flips_per_throw_error, lyapunov_error : ndarray, shape (n, K)
        Their standard errors.
    start, start_side : ndarray, shape (n, K)
        A state of the attractor.
    """

    attractors: Ints
    undecided: Ints
    bands: Ints
    lowest: Floats
    reach: Floats
    jogs_min: Ints
    jogs_max: Ints
    flip_order: Ints
    period: Ints
    share: Floats
    leaves: Floats
    collapses: Floats
    flips_per_throw: Floats
    flips_per_throw_error: Floats
    lyapunov: Floats
    lyapunov_error: Floats
    start: Floats
    start_side: Ints


def empty(points: int, sides: int) -> Topologies:
    """Return arrays for points of which nothing is known."""
    n, k, s = points, MOST_ATTRACTORS, sides

    def ints(*shape: int) -> Ints:
        return np.full(shape, -1, np.int64)

    def floats(*shape: int) -> Floats:
        return np.full(shape, np.nan)

    return Topologies(
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.zeros((n, k, s), np.int64),
        floats(n, k, s),
        floats(n, k, s),
        ints(n, k, s),
        ints(n, k, s),
        ints(n, k, s),
        ints(n, k),
        floats(n, k),
        floats(n),
        floats(n),
        floats(n, k),
        floats(n, k),
        floats(n, k),
        floats(n, k),
        floats(n, k),
        ints(n, k),
    )
