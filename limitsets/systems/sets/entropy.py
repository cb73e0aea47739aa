"""Topological entropy, sampled: on a line by the Markov diagram of its intervals, in more coordinates by curves.

On a line a node is an interval; a branch that meets it leads to the image of the common part.  The growth of the number
of paths is the topological entropy; a diagram cut off after n images is off by about exp(-n times the entropy).
Source: Hofbauer, "On intrinsic ergodicity of piecewise monotonic transformations with positive entropy", Israel J.
Math. 34, 1979; Milnor and Thurston, "On iterated maps of the interval", 1988.

The length of a curve grows as exp(n entropy) at most where the map is infinitely often differentiable, and in the plane
for some curves so where the map is one to one: Yomdin, "Volume growth and entropy", Israel J. Math. 57, 1987; Newhouse,
"Entropy and volume", Ergodic Theory and Dynamical Systems 8, 1988.  Where areas grow the entropy is larger.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.base.arrays import Array, Ints
from limitsets.systems.cells import Domain
from limitsets.systems.maps import along, images, monotone_pieces
from limitsets.systems.maps.critical import Sides
from limitsets.systems.sets.end_points import Extents

# ---------------------------------------------------------------- on a line


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
    >>> from limitsets.systems.sets.entropy import topological_entropy
    >>> found = topological_entropy(maps.Logistic(4.0), {0: [(0.0, 1.0)]}, as_domain([(0, 1)]))
    >>> abs(found - math.log(2)) < 1e-9
    True
    """
    from scipy import sparse

    edges, count = _diagram(params, extents, domain)
    if not edges:
        return 0.0
    rows, columns = np.array(edges).T
    return perron(sparse.csr_matrix((np.ones(len(edges)), (rows, columns)), shape=(count, count)))[0]


def perron(matrix: Any) -> tuple[float, NDArray[np.float64]]:
    """Find the growth of the number of paths, and the vector x >= 0 of paths from each node of the component it is of.

    Parameters
    ----------
    matrix : sparse matrix, shape (n, n)
        Counts of edges from node to node.

    Returns
    -------
    growth : float
        Logarithm of the spectral radius; 0 where paths do not grow.
    x : ndarray, shape (n,)
        On a strongly connected component of that growth, ``matrix @ x`` = exp(growth) x; 0 elsewhere, and everywhere
        without growth.
    """
    from scipy import sparse

    count = matrix.shape[0]
    rows, columns = matrix.nonzero()
    _, label = sparse.csgraph.connected_components(matrix, connection="strong")
    inside = label[rows] == label[columns]
    edges = np.asarray(matrix[rows[inside], columns[inside]]).ravel()
    spare = np.bincount(label[rows[inside]], edges, minlength=count) - np.bincount(label, minlength=count)
    most, vector = 0.0, np.zeros(count)
    # a component with no more edges than nodes is a cycle, or nothing
    for k in np.flatnonzero(spare > 0):
        nodes = np.flatnonzero(label == k)
        growth, x = _growth(matrix[nodes][:, nodes])
        if growth > most:
            most, vector = growth, np.zeros(count)
            vector[nodes] = x
    return most, vector


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
        intervals, new = after.reshape(-1, 2), []
        for (k, *_), (one, other), side in zip(parts, intervals.tolist(), to[::2].tolist(), strict=True):
            target, fresh = number(side, min(one, other), max(one, other))
            edges.append((k, target))
            if fresh:
                new.append(target)
    return edges, len(nodes)


def _growth(matrix: Any) -> tuple[float, NDArray[np.float64]]:
    """Logarithm of the spectral radius and its vector, by powers of (1 + matrix)/2, which has no periods."""
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
    return math.log(2.0 * size - 1.0), at


# ---------------------------------------------------------------- in more coordinates

# A curve is known by points at most so far from each other, a share of the domain; it is followed up to so many points
# and steps.  Its growth is that over the later half of the steps on which it is longer than the domain.
APART, MOST_POINTS, MOST_CURVE_STEPS = 0.01, 400_000, 400
# Starts along each axis, for one that stays in the domain.
SETTLED = 12


def growth_of_curve(params: Any, domain: Domain) -> float:
    """Find the growth of the length of a curve per step [natural logarithm], from one short at the start.

    Parameters
    ----------
    params : NamedTuple
        A map.
    domain : Domain
        Of the map: parts of the curve that leave are dropped.

    Returns
    -------
    float
        0 where the curve stays shorter than the domain; nan where all of it leaves, no start stays in the domain, an
        axis closes, or the map has more sides.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.systems.sets.entropy import growth_of_curve
    >>> square = ls.grid([(-1.6, 1.6), (-0.6, 0.6)], cells=16)
    >>> round(growth_of_curve(ls.maps.Henon(1.4, 0.3), square.domain), 2)
    0.46
    """
    start = None if domain.closes or domain.sides > 1 else _settled(params, domain)
    if start is None:
        return math.nan
    size = domain.hi[0] - domain.lo[0]
    at, lengths, steps = np.linspace(-1.0, 1.0, 64), list[float](), 0

    def begin(at: Array) -> Array:
        # one direction as good as another, along no axis
        return np.asarray(start + 1e-6 * size * at[:, None] * np.cos(np.arange(1.0, 1.0 + size.size)))

    points, pieces = begin(at), np.zeros(at.size, np.int64)
    while steps < MOST_CURVE_STEPS:
        points, pieces, alive = _stepped(params, domain, points, pieces)
        at, points, pieces, steps = at[alive], points[alive], pieces[alive], steps + 1
        while True:
            gaps = np.where(
                np.diff(pieces) == 0, np.abs(np.diff(points, axis=0) / size).max(axis=1, initial=0.0), 0.0
            )
            wide = np.flatnonzero((gaps > APART) & (np.diff(at) > 1e-14))
            if not wide.size or at.size + wide.size > MOST_POINTS:
                break
            more, between = begin(0.5 * (at[wide] + at[wide + 1])), np.zeros(wide.size, np.int64)
            kept = 0.5 * (at[wide] + at[wide + 1])
            for _ in range(steps):
                more, between, alive = _stepped(params, domain, more, between)
                more, between, kept = more[alive], between[alive], kept[alive]
            order = np.argsort(np.concatenate([at, kept]), kind="stable")
            at, points = np.concatenate([at, kept])[order], np.concatenate([points, more])[order]
            pieces = np.concatenate([pieces, between])[order]
        if at.size < 2 or at.size + wide.size > MOST_POINTS:
            break
        lengths.append(float(gaps.sum()))
    logs = np.log([length for length in lengths if length > 1.0])
    if logs.size < 8:
        return 0.0 if steps == MOST_CURVE_STEPS and not logs.size else math.nan
    late = logs[logs.size // 2 :]
    return float(np.polyfit(np.arange(late.size), late, 1)[0])


def _settled(params: Any, domain: Domain) -> Array | None:
    """Find a state that is still in the domain after many steps, from starts that fill it; None where none is."""
    axes = [np.linspace(lo, hi, SETTLED + 2)[1:-1] for lo, hi in zip(domain.lo[0], domain.hi[0], strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    pieces = np.zeros(len(points), np.int64)
    for _ in range(MOST_CURVE_STEPS):
        points, pieces, alive = _stepped(params, domain, points, pieces)
        points, pieces = points[alive], pieces[alive]
    return points[0] if len(points) else None


def _stepped(params: Any, domain: Domain, points: Array, pieces: Ints) -> tuple[Array, Ints, Any]:
    """Throw points of a curve; a number by the branches so far, and which stay in the domain."""
    after = images(params, points, 0)
    inside = (after.code >= 0) & ((after.x >= domain.lo[0]) & (after.x <= domain.hi[0])).all(axis=1)
    return after.x, pieces * 3 + after.code, inside
