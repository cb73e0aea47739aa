"""Borders of the monotone pieces for many values of a map's parameter: computed at a few, interpolated in between.

Critical and turning points are smooth functions of the parameter as long as their number and kind stay the same.  If
these change, or if the interpolation fails a check, the borders are computed for every value.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Domain
from limitsets.maps import monotone_pieces

# Values of the parameter at which cuts are computed, and the error allowed at one more, as a share of the side.
NODES = 7
ALLOWED = 1e-7


class BranchInterval(NamedTuple):
    """A monotone piece of one side: from `lo` to `hi`, on this branch."""

    lo: float
    hi: float
    branch: int


Pieces = dict[int, tuple[BranchInterval, ...]]


def _cut(params: Any, domain: Domain) -> Pieces:
    found = {}
    for side, pieces in monotone_pieces(params, domain).items():
        ends = [*(piece.lo for piece in pieces[1:]), np.inf]
        # The last float of a piece and the first of the next are neighbours: the gap between them is nothing.
        tops = [
            end if np.nextafter(piece.hi, np.inf) == end else piece.hi
            for piece, end in zip(pieces, ends, strict=True)
        ]
        found[side] = tuple(
            BranchInterval(p.lo, float(top), p.branch) for p, top in zip(pieces, tops, strict=True)
        )
    return found


def _kinds(pieces: Pieces) -> dict[int, list[int]]:
    return {side: [cut.branch for cut in cuts] for side, cuts in pieces.items()}


class InterpolatedPieces:
    """Cuts of all sides as a function of the parameter.

    Parameters
    ----------
    map_of : callable
        From the parameter to the map.
    domain : Domain
        What is cut.
    values : ndarray
        Values that will be asked for.
    """

    def __init__(self, map_of: Callable[[float], Any], domain: Domain, values: NDArray[np.float64]) -> None:
        self.map_of, self.domain = map_of, domain
        self.nodes = np.empty(0)
        lo, hi = float(values.min()), float(values.max())
        if values.size <= NODES + 1 or not hi > lo:
            return
        angle = (2 * np.arange(NODES) + 1) * np.pi / (2 * NODES)
        self.nodes = 0.5 * (lo + hi) - 0.5 * (hi - lo) * np.cos(angle)
        self.weights = (-1.0) ** np.arange(NODES) * np.sin(angle)
        self.known = [_cut(map_of(float(node)), domain) for node in self.nodes]
        checks = (0.5 * (lo + float(self.nodes[0])), 0.5 * float(self.nodes[3:5].sum()))
        if not all(self._serves(value) for value in checks):
            self.nodes = np.empty(0)

    def _serves(self, value: float) -> bool:
        exact = _cut(self.map_of(value), self.domain)
        if any(_kinds(pieces) != _kinds(exact) for pieces in self.known):
            return False
        guess = self._between(value)
        extent = float((self.domain.hi - self.domain.lo).max())
        return all(
            abs(one.lo - two.lo) <= ALLOWED * extent and abs(one.hi - two.hi) <= ALLOWED * extent
            for side, cuts in exact.items()
            for one, two in zip(cuts, guess[side], strict=True)
        )

    def _between(self, value: float) -> Pieces:
        """Interpolate between the nodes by the barycentric formula."""
        gap = value - self.nodes
        if (gap == 0.0).any():
            return self.known[int(np.flatnonzero(gap == 0.0)[0])]
        share = self.weights / gap
        share /= share.sum()
        found = {}
        for side, cuts in self.known[0].items():
            ends = np.array([[cut[:2] for cut in pieces[side]] for pieces in self.known])
            values = np.tensordot(share, ends, axes=1) if cuts else ends[0]
            found[side] = tuple(
                BranchInterval(float(lo), float(hi), cut.branch)
                for (lo, hi), cut in zip(values, cuts, strict=True)
            )
        return found

    def at(self, value: float) -> Pieces:
        """Pieces of every side at one value of the parameter."""
        return self._between(value) if self.nodes.size else _cut(self.map_of(value), self.domain)
