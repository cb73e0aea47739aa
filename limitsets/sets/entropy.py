"""Topological entropy of a piecewise monotone map on an attractor, from the Markov diagram of its intervals.

A node is an interval; a branch that meets it leads to the image of the common part.  The growth of the number of paths
is the topological entropy; a diagram cut off after n images is off by about exp(-n times the entropy).
Source: Hofbauer, "On intrinsic ergodicity of piecewise monotonic transformations with positive entropy", Israel J.
Math. 34, 1979; Milnor and Thurston, "On iterated maps of the interval", 1988.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from limitsets.maps.critical import Sides
from limitsets.maps.forced import along
from limitsets.maps.pieces import monotone_pieces
from limitsets.sets.unions import Extents

# Images after which a diagram is cut off, and nodes at most.
MOST_IMAGES, MOST_NODES = 2000, 20_000
# Parts of a node that are shorter are rounding, a share of the largest side; ends that agree so well are one.
SLIVER = 1e-11
# The growth is known when it moves by less over as many steps as there are images.
CLOSE, MOST_STEPS = 1e-12, 200_000


class _Node(NamedTuple):
    """An interval."""

    side: int
    lo: float
    hi: float


def topological_entropy(params: Any, extents: Extents, domain: Sides) -> float:
    """Find the topological entropy of a map on a set that it maps into itself.

    Parameters
    ----------
    params : NamedTuple
        A one-dimensional map with slopes.
    extents : mapping of int to iterable of (lo, hi)
        The set, such as the `extents` of `limitsets.limit_set`.
    domain : Domain
        Where the map is looked at.

    Returns
    -------
    float
        Per step [natural logarithm]; 0 for a cycle.

    Raises
    ------
    AnswerError
        For a map of more dimensions or without slopes.

    Examples
    --------
    >>> import math
    >>> from limitsets import maps
    >>> from limitsets.cells import as_domain
    >>> from limitsets.sets.entropy import topological_entropy
    >>> found = topological_entropy(maps.Logistic(4.0), {0: [(0.0, 1.0)]}, as_domain([(0, 1)]))
    >>> abs(found - math.log(2)) < 1e-9
    True
    """
    edges, count = _diagram(params, extents, domain)
    if not edges:
        return 0.0
    rows, columns = np.array(edges).T
    matrix = sparse.csr_matrix((np.ones(len(edges)), (rows, columns)), shape=(count, count))
    _, label = sparse.csgraph.connected_components(matrix, connection="strong")
    inside = label[rows] == label[columns]
    spare = np.bincount(label[rows[inside]], minlength=count) - np.bincount(label, minlength=count)
    # a component with no more edges than nodes is a cycle, or nothing
    kept = [np.flatnonzero(label == k) for k in np.flatnonzero(spare > 0)]
    return max((_growth(matrix[nodes][:, nodes]) for nodes in kept), default=0.0)


def _diagram(params: Any, extents: Extents, domain: Sides) -> tuple[list[tuple[int, int]], int]:
    """Edges between nodes, and how many nodes there are."""
    pieces = monotone_pieces(params, domain)
    sliver = SLIVER * float(np.max(domain.hi - domain.lo))
    known: dict[tuple[int, int, int], int] = {}
    nodes: list[_Node] = []

    def number(side: int, lo: float, hi: float) -> tuple[int, bool]:
        # ends within a sliver are one; each is looked for in its own and the two neighbouring steps
        a, b = round(lo / (4.0 * sliver)), round(hi / (4.0 * sliver))
        for i in (a, a - 1, a + 1):
            for j in (b, b - 1, b + 1):
                if (side, i, j) in known:
                    return known[side, i, j], False
        known[side, a, b] = len(nodes)
        nodes.append(_Node(side, lo, hi))
        return len(nodes) - 1, True

    new = [number(side, lo, hi)[0] for side, pairs in extents.items() for lo, hi in pairs if hi - lo > sliver]
    edges: list[tuple[int, int]] = []
    for _ in range(MOST_IMAGES):
        parts = [
            (k, piece.branch, max(nodes[k].lo, piece.lo), min(nodes[k].hi, piece.hi))
            for k in new
            for piece in pieces[nodes[k].side]
        ]
        parts = [part for part in parts if part[3] - part[2] > sliver]
        if not parts or len(nodes) > MOST_NODES:
            break
        ends = np.array([[part[2], part[3]] for part in parts]).ravel()
        sides = np.repeat([nodes[part[0]].side for part in parts], 2)
        after, to, _ = along(params, ends, sides, np.repeat([[part[1]] for part in parts], 2, axis=0))
        found, new = after.reshape(-1, 2), []
        for (k, *_), (one, other), side in zip(parts, found.tolist(), to[::2].tolist(), strict=True):
            target, fresh = number(side, min(one, other), max(one, other))
            edges.append((k, target))
            if fresh:
                new.append(target)
    return edges, len(nodes)


def _growth(matrix: Any) -> float:
    """Logarithm of the spectral radius, by powers of (1 + matrix)/2, which has no periods."""
    at: NDArray[np.float64] = np.ones(matrix.shape[0])
    last, size = math.inf, 0.0
    for step in range(1, MOST_STEPS + 1):
        at = 0.5 * (at + matrix @ at)
        size = float(at.max())
        at /= size
        if step % 64 == 0:
            if abs(size - last) <= CLOSE * size:
                break
            last = size
    return math.log(2.0 * size - 1.0)
