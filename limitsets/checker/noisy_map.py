"""A map of a line whose steps land within a bounded distance of f(x), evenly: where steps lead, cell by cell.

docs/certificates.md, "Long-run averages".  What is collected is what `steps` needs to bound the mean of a function
after a step; cells whose image is not enclosed have no step.
"""

import itertools
import math
from typing import NamedTuple

import numpy as np
from flint import arb

from .any_map import Map, possible
from .balls import Arb, Array, Pair
from .brackets import OUTERMOST, mesh_of
from .landings import upper
from .laws import Law
from .links import turn_of
from .means import INFLATE, Scatter, Spread, mean_rows
from .steps import Chain, Parts

NARROW_OF_MAP = 2.0**-30  # cells below this share of the largest place count as jumps
FAR_OF_MAP = (
    8.0  # images may lie so many times as far out as places and the noise: what is there is off all cells
)


class BranchOfCell(NamedTuple):
    """A cell on one of its branches: its left node, side and branch, its ends, f' and f'' on the cell."""

    at: int
    side: int
    branch: int
    ends: Pair
    slope: Arb
    bend: Arb


class StepOfMap(NamedTuple):
    """Where steps from a cell lead on one branch: the side, the images of its ends, and a range of all images."""

    piece: BranchOfCell
    to: int
    images: tuple[Arb, Arb]
    range: Pair


def steps_from(
    the_map: Map, side: int, at: int, ends: Pair, known: dict[tuple[int, int, float], Arb]
) -> list[StepOfMap]:
    """Enclose the steps from a cell, on each branch that is possible; none where one is not enclosed.

    `known` keeps images of nodes, by side, branch and place.
    """
    piece, steps = the_map.piece([ends]), list[StepOfMap]()
    for branch in possible(the_map, side, piece)[0]:
        program, (x, *ranges) = the_map.image[side, branch], piece.balls
        image, slope, bend = program.bend([x, *ranges])
        for end in ends:
            if (side, branch, end) not in known:
                known[side, branch, end] = program.at([arb(end), *ranges])[0]
        first, last = (known[side, branch, end] for end in ends)
        if slope > 0 or slope < 0:
            image = first.union(last)
        elif slope.is_finite():  # from either end on, no farther than the slope allows
            image = first.union(last) + (x - x.mid()) * abs(slope).upper()
        if not (image.is_finite() and first.is_finite() and last.is_finite()):
            return []
        lo, hi = -upper(-image), upper(image)
        own = BranchOfCell(at, side, branch, ends, slope, bend)
        steps.append(StepOfMap(own, the_map.shape.to[side, branch], (first, last), (lo, hi)))
    return steps


def chain_of_map(the_map: Map, edges: list[Array], law: Law) -> tuple[Chain, list[BranchOfCell]]:
    """Prove the steps from the cells between nodes; with the cells of the chain on their branches."""
    size = max(float(np.abs(each).max()) for each in edges) + float(law.reach)
    mesh = mesh_of(edges, OUTERMOST * FAR_OF_MAP * 2.0 ** math.ceil(math.log2(size)))
    scatter = Scatter(mesh, law, NARROW_OF_MAP)
    parts, pieces = Parts(), list[BranchOfCell]()
    places: dict[int, tuple[int, Arb]] = {}  # by node where the step from there leads
    for side, (first, end) in enumerate(itertools.pairwise(mesh.first.tolist())):
        known: dict[tuple[int, int, float], Arb] = {}
        for at in range(first + 1, end - 2):
            ends = float(mesh.place[at]), float(mesh.place[at + 1])
            steps = steps_from(the_map, side, at, ends, known)
            if not steps:
                continue
            pieces += [step.piece for step in steps]
            ranges = [(step.to, *step.range) for step in (steps[0], steps[-1])]
            parts.at_cells.rows.append((at, float(len(steps) > 1), *ranges[0], *ranges[1]))
            if len(steps) == 1:
                (step,) = steps
                row = turn_of(at, ends[1] - ends[0], step.piece.slope, step.piece.bend, ranges[0])
                parts.turns.rows += [] if row is None else [row]
            for node, image in zip((at, at + 1), steps[0].images, strict=True):
                if len(steps) == 1 or node not in places:  # on a cell of one branch the node has this one too
                    places[node] = steps[0].to, image
    spread = spread_of(places, parts)
    rows = mean_rows(len(mesh.place), scatter.mesh, [spread])
    # nodes are not raised together: the cells beside a change of branch may be wide
    return Chain(mesh, scatter, rows, {}, parts, 0.0, narrow=0.0), pieces


def spread_of(places: dict[int, tuple[int, Arb]], parts: Parts) -> Spread:
    """Put the step from each node to where it leads, and collect how far it may be off."""
    to, at = [], []
    for node, (side, image) in sorted(places.items()):
        middle = float(image.mid())
        off = upper(abs(image - middle)) * INFLATE
        where = side, middle - off, middle + off
        parts.at_nodes.rows.append((node, 0.0, *where, *where, 1.0, off))
        to.append(side)
        at.append(middle)
    lands, nodes = np.array(at), np.array(sorted(places), dtype=np.int64)
    return Spread(nodes, np.ones(len(nodes)), np.array(to, dtype=np.int64), lands, lands)
