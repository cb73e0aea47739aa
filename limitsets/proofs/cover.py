"""Cells for a proof, and the enclosures of their images.

The cells of side i run from just beyond a_i to the arm's end, graded towards a_i; starts nearer to a_i are treated
in `near_hinge.py`.  Where the arm's surface is above the joint they begin just beyond the unstable fixed point of
the jog instead, if one is found.  Wanted borders (the x of a goal) are cut in.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Domain, Grid, grid
from limitsets.errors import AnswerError
from limitsets.graph import TransitionGraph
from limitsets.graph.images.enclosed import Enclosures, boxes_of, enclosures
from limitsets.graph.ranges import build
from limitsets.graph.target import Target
from limitsets.maps import kind_of
from limitsets.proofs.fixed_point import FixedPoint, fixed_points
from limitsets.proofs.parameters import ParameterBox

# Share of a side's extent that is left to the argument near the joint.
NEAREST = 1e-6

# So many times the width of what is known of a_i is left to it at least: nearer than that a jog, whose length goes with
# x - a, is shorter than a cell, whose width goes with the distance from the least a.
UNKNOWN = 4.0

# Images are widened by this share of the cell they come from, so that other arithmetic can confirm them.
SLACK = 1e-3


@dataclass(frozen=True, eq=False)
class Cover:
    """Cells of every side and what is proved of their images.

    Attributes
    ----------
    box : ParameterBox
        The parameters for which it holds.
    grid : Grid
        The cells.
    images : tuple of Enclosures
        Per side, widened by `SLACK` and by the noise of the landing place.
    graph : TransitionGraph
        The same as a graph; the sinks are reached by images that may leave.
    points : tuple of FixedPoint
        Where the arm's surface is above the joint: the fixed points of the jog, one per side; otherwise none.
    """

    box: ParameterBox
    grid: Grid
    images: tuple[Enclosures, ...]
    graph: TransitionGraph
    points: tuple[FixedPoint, ...]

    def place(self, cell: int) -> str:
        """Name a cell for people."""
        side = int(self.grid.side_of(cell))
        lo, hi = self.grid.boxes([cell], side)
        return f"side {side}, x in [{lo[0, 0]:.6g}, {hi[0, 0]:.6g}]"


def _widened(found: Enclosures, edges: NDArray[np.float64], landing: float) -> Enclosures:
    """Widen the images by the slack and by the scatter of the landing place, which no decision depends on."""
    more = np.nextafter(landing + SLACK * np.diff(edges), np.inf)
    hulls = {
        key: (np.nextafter(lo - more, -np.inf), np.nextafter(hi + more, np.inf))
        for key, (lo, hi) in found.hulls.items()
    }
    return Enclosures(hulls, found.witness, found.lost)


def cover(
    box: ParameterBox,
    cells: int,
    cuts: Mapping[int, Sequence[float]] | None = None,
    pieces: int | None = None,
) -> Cover:
    """Cut the sides into cells and enclose their images.

    Parameters
    ----------
    box : ParameterBox
        Parameters.
    cells : int
        Cells per side.
    cuts : mapping of int to sequence of float, optional
        Borders wanted on each side.
    pieces : int, optional
        Pieces of the parameter that is known least, where the decision of a cell is open: fewer are quicker.

    Returns
    -------
    Cover

    Raises
    ------
    AnswerError
        For a part that may stand beyond the arm's end.
    """
    rests, end = box.rests, np.full(box.hi.a.size, box.hi.arm_length)
    foot, anchor, points = np.where(rests, box.hi.a, 0.0), np.where(rests, box.lo.a, 0.0), fixed_points(box)
    if not (foot < box.lo.arm_length).all():
        raise AnswerError("the arm", box.lo.arm_length, f"longer than a = {foot.max()}", "lengthen it")
    for side, point in enumerate(points):
        if not point.reason:
            foot[side] = anchor[side] = point.hi
    unknown = np.minimum(UNKNOWN * (box.hi.a - box.lo.a), 0.1 * (end - foot)) if not points else 0.0
    lo = np.where(rests, foot + np.maximum(NEAREST * (end - foot), unknown), end)
    plain = grid(Domain(lo[:, None], end[:, None], anchor), cells=cells)
    sides = []
    for side, (edges,) in enumerate(plain.edges):
        wanted = [x for x in (cuts or {}).get(side, ()) if edges[0] < x < edges[-1]]
        sides.append((np.union1d(edges, wanted),))
    return cover_on(box, Grid(plain.domain, tuple(sides)), pieces, points)


def cover_on(
    box: ParameterBox, cells: Grid, pieces: int | None = None, points: tuple[FixedPoint, ...] = ()
) -> Cover:
    """Enclose the images of cells that are given; `pieces` as in `cover`, `points` where the cells begin there."""
    found = tuple(
        _widened(enclosures(box.lo, box.hi, edges, side, pieces), edges, box.landing)
        for side, (edges,) in enumerate(cells.edges)
    )
    return Cover(box, cells, found, _graph(box, cells, found), points)


def _graph(box: ParameterBox, cells: Grid, found: Sequence[Enclosures]) -> TransitionGraph:
    exits = kind_of(box.lo).exits
    target = Target.of(cells, exits)
    # the arm's end as it is known, not the last border: what may land beyond it leaves
    parts = [boxes_of(images, target, len(exits)) for images in found]
    cell = np.concatenate([part.cell + cells.offset[k] for k, part in enumerate(parts)])
    joined = [
        np.concatenate([getattr(part, name) for part in parts]) for name in ("side", "lo", "hi", "exits")
    ]
    first = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=cells.n_cells))])
    leaving = joined[3]
    outward = np.uint8(1 << list(exits).index("outward"))
    for side, images in enumerate(found):
        for lo, hi in images.hulls.values():
            beyond = (lo <= hi) & (hi > box.lo.arm_length)
            leaving[cells.of_side(side)] |= np.where(beyond, outward, 0).astype(np.uint8)
    ranges = build(cells, first, joined[0], joined[1], joined[2], leaving)
    return TransitionGraph(box.lo, cells, ranges, "boxes")


def everywhere(found: Cover) -> list[NDArray[np.int32]]:
    """First and last target cells, as `targets`, of every branch and every number of sides that it turns."""
    sides = found.grid.sides
    keys = {((to - side) % sides, of) for side, images in enumerate(found.images) for to, of in images.hulls}
    return [targets(found, branch, turned) for turned, branch in sorted(keys)]


def targets(found: Cover, branch: int, turned: int | None = None) -> NDArray[np.int32]:
    """First and last target cell of one branch, -1 -1 where it is impossible.

    A branch that leads to several sides is asked for with the number of sides it turns.
    """
    grid = found.grid
    out = np.full((grid.n_cells, 2), -1, dtype=np.int32)
    for side, images in enumerate(found.images):
        for (to, of_branch), (lo, hi) in images.hulls.items():
            if of_branch != branch or (turned is not None and (to - side) % grid.sides != turned):
                continue
            edges = grid.edges[to][0]
            some = (lo <= hi) & (edges.size > 1)  # no image comes to rest on a side without cells
            first = np.clip(np.searchsorted(edges, lo[some], side="right") - 1, 0, edges.size - 2)
            last = np.clip(np.searchsorted(edges, hi[some], side="left") - 1, 0, edges.size - 2)
            rows = grid.offset[side] + np.flatnonzero(some)
            out[rows] = np.stack([first, last], axis=1) + grid.offset[to]
    return out
