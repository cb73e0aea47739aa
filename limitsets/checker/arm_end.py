"""The end of the arm: what can be reached on the cells before it, and from which cells.

docs/certificates.md, number 17.
"""

import math
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from flint import arb

from .balls import Array, exact, float_above, float_below
from .cells import Task
from .file import Cells
from .near_hinge import check_all_jog, near_angle, near_landing
from .scene import Scene
from .thinning import not_arriving

FAR = 1e300  # beyond all arms


class ArmEnd(NamedTuple):
    """The cells, with no throws from beyond X; `before`: those with places x < X, `fed`: those with x >= X only.

    A cell without a rank whose target cells come to the last border of a side may leave there: towards the joint the
    part may also come to rest before the first cell.  `inward` says so by side, `leaving` of all.
    """

    x: Fraction
    c: Cells
    before: Array
    fed: Array
    inward: list[Array]
    leaving: Array


def arm_end(c: Cells, scene: Scene) -> ArmEnd:
    """Find the cells before X and beyond, and those that may leave."""
    assert scene.end is not None
    x, n = scene.end, len(c.edges)
    before = np.array([Fraction(lo) < x for lo in c.lower().tolist()])
    jog, flip = (np.where(before[:, None], array, -1) for array in (c.jog, c.flip))
    inward = [np.zeros(len(before), dtype=bool) for _ in range(n)]
    leaving = np.zeros(len(before), dtype=bool)
    for array, turned in ((jog, 0), (flip, 1)):
        begins, ends = at_borders(c, array)
        for i in range(n):
            inward[i] |= begins & ((c.side + turned) % n == i)
        leaving |= begins | ends
    return ArmEnd(x, replace(c, jog=jog, flip=flip), before, ~before, inward, leaving)


def at_borders(c: Cells, array: Array) -> tuple[Array, Array]:
    """Find the cells without a rank whose targets begin with the first cell of a side, or end with the last."""
    free = (c.rank < 0) & (array[:, 0] >= 0)
    return free & np.isin(array[:, 0], c.start[:-1]), free & np.isin(array[:, 1] + 1, c.start[1:])


def freed(c: Cells, task: Task) -> Task:
    """Let images that may leave the cells be anywhere beyond their borders."""
    table = task.rows.copy()
    for column, array in ((4, c.jog), (6, c.flip)):
        begins, ends = at_borders(c, array)
        table[begins[task.cells], column] = -FAR
        table[ends[task.cells], column + 1] = FAR
    return task._replace(rows=table)


def unsafe_starts(end: ArmEnd, scene: Scene, side: int) -> tuple[Array, list[bool]]:
    """Find the cells from which the first rest at X or beyond may be on another side; and so before the first cells.

    A part that may come to rest in an unsafe place is unsafe: that is a cell of another side that reaches beyond X, a
    cell from which one may be thrown into an unsafe place, or before the first cell of a side from where it may be.
    """
    c, count = end.c, -1
    bad = (c.side != side) & (c.upper() > float_below(exact(end.x)))
    ahead = [cells_ahead(end, scene, i) for i in range(len(c.edges))]
    gaps = [True] * len(ahead)
    while count != int(bad.sum()):
        count = int(bad.sum())
        gaps = [some is None or bool(bad[some].any()) for some in ahead]
        bad |= thrown_into(end, bad, gaps)
    return thrown_into(end, bad, gaps), gaps


def cells_ahead(end: ArmEnd, scene: Scene, side: int) -> Array | None:
    """Find the cells to which throws from before the first cell of a side may lead; None if that is not known.

    Such a throw is a jog, and lands before some place or leaves towards the joint.
    """
    s, c = scene.sides[side], end.c
    edge = float(c.edges[side][0])
    bound = near_angle(s, scene.k_lo, scene.k_hi, edge)
    if not bound < 1 or check_all_jog(s, scene.k_lo.union(scene.k_hi), arb(edge), bound):
        return None
    far = near_landing(s, scene.k_lo, scene.k_hi, edge)
    found: Array = (c.side == side) & (c.lower() <= (float_above(far) if far.is_finite() else math.inf))
    return found


def thrown_into(end: ArmEnd, places: Array, gaps: list[bool]) -> Array:
    """Find the cells from which a throw may lead to the places, or before the first cell of the sides in `gaps`."""
    c, count = end.c, np.concatenate([[0], np.cumsum(places)])
    hit = np.zeros(len(places), dtype=bool)
    for array in (c.jog, c.flip):
        q = np.flatnonzero(array[:, 0] >= 0)
        hit[q] |= count[array[q, 1] + 1] > count[array[q, 0]]
    for some, gap in zip(end.inward, gaps, strict=True):
        hit |= some & gap
    return hit


def late_within(end: ArmEnd, throws: int) -> Array:
    """Find the cells from which parts are not proved to come to rest at X or beyond within so many throws."""
    c = end.c
    late: Array = not_arriving(c, [c.jog, c.flip], ~end.leaving, end.fed, throws) | end.leaving
    return late


def leading_off(end: ArmEnd) -> Array:
    """Find the cells from which a part may come to one that may leave, and these."""
    leaves, count = end.leaving.copy(), -1
    while count != int(leaves.sum()):
        count = int(leaves.sum())
        leaves |= thrown_into(end, leaves, [False] * len(end.inward))
    return leaves


def share_of(end: ArmEnd, scene: Scene, some: Array) -> float:
    """Bound from below the share of the starts x < X in some cells."""
    x, claimed, whole = float_below(exact(end.x)), 0.0, 0.0
    for i, (s, edges) in enumerate(zip(scene.sides, end.c.edges, strict=True)):
        own = some[end.c.start[i] : end.c.start[i + 1]]
        widths = np.clip(np.minimum(edges[1:], x) - edges[:-1], 0.0, None)
        claimed += float(widths[own].sum())
        whole += float_above(exact(end.x)) - float_below(s.a)
    return claimed / whole * (1 - 2.0**-30)  # against the rounding of these sums
