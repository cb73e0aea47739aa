"""A map of a line whose steps land within a bounded distance of f(x), evenly: where steps lead, cell by cell.

docs/certificates.md, "Steps that land with noise".  What is collected is what `steps` needs to bound the mean of a
function after a step; cells whose image is not enclosed have no step.

A parameter may vary too, evenly and anew at every step.  Its range is cut in strata.  On a stratum of width d the mean
of G(f(x, p)) lies above that of its two ends by no more than G(f(x, .)) lies above its chord, which `turn_of` bounds as
it does along a cell: there x varies, here p.
"""

import itertools
import math
from collections.abc import Iterable, Iterator
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from flint import arb

from .any_map import Map, possible
from .balls import Arb, Array, Pair, exact, prove
from .brackets import OUTERMOST, mesh_of
from .file import decimal
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


class Varied(NamedTuple):
    """A parameter that deviates at every step within a bound, evenly; the range is cut in so many strata."""

    name: str
    bound: Fraction
    strata: int


class Stratum(NamedTuple):
    """The map for a part of what a parameter may be: for all of it, and for either end (none where nothing varies)."""

    weight: float
    whole: Map
    ends: list[Map]
    name: str = ""
    width: float = 0.0

    def images(self, step: StepOfMap, end: int) -> list[Arb]:
        """Enclose where steps from an end of a cell lead, for the ends of the stratum."""
        if not self.ends:
            return [step.images[end]]
        own = step.piece
        return [
            each.image[own.side, own.branch].at([arb(own.ends[end]), *each.piece([]).balls])[0]
            for each in self.ends
        ]


def strata_of(the_map: Map, varied: Varied | None) -> list[Stratum]:
    """Cut what a parameter may be."""
    if varied is None:
        return [Stratum(1.0, the_map, [])]
    name, step = varied.name, 2 * varied.bound / varied.strata
    lo, hi = (Fraction(end) for end in the_map.parameters[name])

    def between(first: Fraction, last: Fraction) -> Map:
        ends = decimal(lo + first), decimal(hi + last)
        return Map(the_map.shape, the_map.parameters | {name: ends})

    cuts = [k * step - varied.bound for k in range(varied.strata + 1)]
    return [
        Stratum(1.0 / varied.strata, between(a, b), [between(a, a), between(b, b)], name, upper(exact(step)))
        for a, b in itertools.pairwise(cuts)
    ]


def chain_of_map(
    strata: list[Stratum], edges: list[Array], law: Law
) -> tuple[Chain, list[list[BranchOfCell]]]:
    """Prove the steps from the cells between nodes; with the cells of the chain on their branches, by stratum."""
    size = max(float(np.abs(each).max()) for each in edges) + float(law.reach)
    mesh = mesh_of(edges, OUTERMOST * FAR_OF_MAP * 2.0 ** math.ceil(math.log2(size)))
    scatter = None if law.certain else Scatter(mesh, law, NARROW_OF_MAP)
    collected = CellsOfMap(strata)
    for side, (first, end) in enumerate(itertools.pairwise(mesh.first.tolist())):
        known: list[dict[tuple[int, int, float], Arb]] = [{} for _ in strata]
        for at in range(first + 1, end - 2):
            ends = float(mesh.place[at]), float(mesh.place[at + 1])
            collected.add(
                at,
                [
                    steps_from(each.whole, side, at, ends, seen)
                    for each, seen in zip(strata, known, strict=True)
                ],
            )
    prove(bool(collected.places), "the image of no cell is enclosed")
    goal, spread = mesh if scatter is None else scatter.mesh, spread_of(collected.places, collected.parts)
    # nodes are not raised together: the cells beside a change of branch may be wide
    rows = mean_rows(len(mesh.place), goal, [spread])
    return Chain(mesh, scatter, rows, {}, collected.parts, 0.0, narrow=0.0), collected.pieces


class Lands(NamedTuple):
    """Where the steps of a stratum from a node lead, and whether on this branch for sure."""

    weight: float
    step: StepOfMap
    images: list[Arb]
    sure: bool


class CellsOfMap:
    """What is collected of cells: their pieces by stratum, and by node and stratum where steps from there lead."""

    def __init__(self, strata: list[Stratum]):
        self.strata, self.parts, self.places = strata, Parts(), dict[int, list[Lands]]()
        self.pieces = [list[BranchOfCell]() for _ in strata]

    def add(self, at: int, steps: list[list[StepOfMap]]) -> None:
        """Add a cell by the steps of each stratum, unless those of some are not enclosed."""
        if not all(steps):
            return
        for own, some in zip(self.pieces, steps, strict=True):
            own += [step.piece for step in some]
        by_stratum = list(zip(self.strata, steps, strict=True))
        open_share = sum(each.weight for each, some in by_stratum if len(some) > 1)
        ranges = hulls((step.piece.branch, step.to, *step.range) for some in steps for step in some)
        self.parts.at_cells.rows.append((at, open_share, *ranges[0], *ranges[-1]))
        turns = [row for each, some in by_stratum for row in turns_of_stratum(each, some)]
        bounded = [row for row in turns if row is not None]
        self.parts.turns.rows += bounded if len(bounded) == len(turns) else []
        for k, node in enumerate((at, at + 1)):
            lands = [
                Lands(each.weight, some[0], each.images(some[0], k), sure=len(some) == 1)
                for each, some in by_stratum
            ]
            # on a cell of one branch the node has this one too
            before = self.places.get(node, lands)
            self.places[node] = [new if new.sure else old for new, old in zip(lands, before, strict=True)]


def hulls(ranges: Iterable[tuple[int, int, float, float]]) -> list[tuple[int, float, float]]:
    """Return by branch the side and the range that holds all places; given by branch, side and ends."""
    by_branch: dict[int, tuple[int, float, float]] = {}
    for branch, side, lo, hi in ranges:
        _, least, most = by_branch.get(branch, (side, lo, hi))
        by_branch[branch] = side, min(lo, least), max(hi, most)
    return [by_branch[branch] for branch in sorted(by_branch)]


def turns_of_stratum(of: Stratum, steps: list[StepOfMap]) -> Iterator[tuple[float, ...] | None]:
    """Bound how far the mean lies above its chord along a cell, and above that of the ends of what varies.

    Nothing where both branches are possible, which counts by the share of the range of G; None where nothing is known.
    """
    if len(steps) > 1:
        return
    ((own, to, _, reach),) = steps
    h = upper(arb(own.ends[1]) - arb(own.ends[0]))
    yield turn_of(own.at, h, own.slope, own.bend, (to, *reach), of.weight)
    if of.ends:
        program, number = of.whole.image[own.side, own.branch], 1 + of.whole.wide.index(of.name)
        balls = [arb(own.ends[0]).union(arb(own.ends[1])), *of.whole.piece([]).balls]
        yield turn_of(own.at, of.width, *program.bend(balls, number)[1:], (to, *reach), of.weight)


def spread_of(places: dict[int, list[Lands]], parts: Parts) -> Spread:
    """Put the steps from each node to where they lead, and collect how far these may be off."""
    rows = list[tuple[int, float, int, float]]()  # node, weight, side, place
    for node, lands in sorted(places.items()):
        middles = [(each, float(image.mid()), image) for each in lands for image in each.images]
        off = max(upper(abs(image - middle)) for _, middle, image in middles) * INFLATE
        where = hulls(
            (each.step.piece.branch, each.step.to, middle - off, middle + off) for each, middle, _ in middles
        )
        parts.at_nodes.rows.append((node, 0.0, *where[0], *where[-1], 1.0, off))
        rows += [(node, each.weight / len(each.images), each.step.to, middle) for each, middle, _ in middles]
    at, weight, to, where_to = (np.array(column) for column in zip(*rows, strict=True))
    return Spread(at.astype(np.int64), weight, to.astype(np.int64), where_to, where_to)
