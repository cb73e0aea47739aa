"""A map of a line whose steps land within a bounded distance of f(x), evenly: where steps lead, cell by cell.

docs/certificates.md, "Steps that land with noise".  What is collected is what `steps` needs to bound the mean of a
function after a step; cells whose image is not enclosed have no step.

A parameter may vary too, evenly and anew at every step.  Its range is cut in strata.  On a stratum of width d the mean
of G(f(x, p)) lies above that of its two ends by no more than G(f(x, .)) lies above its chord, which `turn_of` bounds as
it does along a cell: there x varies, here p.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from .any_map import Map, period_of, possible
from .balls import ZERO, Arb, Array, Pair, exact, prove
from .brackets import OUTERMOST, Place, mesh_of
from .file import Arrays, decimal, read_box, read_side, require, rows, table
from .landings import upper
from .laws import Law, uniform_law
from .links import turn_of
from .map_cells import closed_axis
from .means import INFLATE, Mesh, Scatter, Spread, mean_rows
from .observable import Allowed
from .program import named, rational
from .steps import Chain, Parts

NARROW_OF_MAP = 2.0**-30  # cells below this share of the largest place count as jumps
FAR_OF_MAP = (
    8.0  # images may lie so many times as far out as places and the noise: what is there is off all cells
)


# ----------------------------------------------------------------
# What claims about such a map say of the noise: read, and put in words.


OF_NOISY, MORE_OF_NOISY = "landing starts", "varied"
STRATA = (1, 2, 4, 8, 16, 32, 64)
MOST_NODES_OF_MAP, FARTHEST = 2_000_000, 2.0**100


class Varied(NamedTuple):
    """A parameter that deviates at every step within a bound, evenly; the range is cut in so many strata."""

    name: str
    bound: Fraction
    strata: int


class NoisyMap(NamedTuple):
    """Noise, starts and nodes: read, and not yet believed."""

    landing: str
    law: Law
    varied: Varied | None
    starts: list[Place]
    edges: list[Array]

    @property
    def nodes(self) -> int:
        """How many there are in a mesh, which has two more on each side."""
        return sum(len(each) + 2 for each in self.edges)


def read_noisy(
    section: dict[str, Any], arrays: Arrays, prefix: str, allowed: Allowed, where: str
) -> NoisyMap:
    """Read what a claim about a box of parameters says of the noise."""
    bound = rational(section["landing"], f"{where}: landing")
    varied = read_varied(section["varied"], allowed.names, where) if "varied" in section else None
    fits = 0 < bound < FARTHEST or (bound == 0 and varied is not None)  # where a parameter varies
    require(fits, f"{where}: landing is not above 0, or too large")
    edges = [
        closed_axis(arrays.read(f"{prefix}nodes.{side}", "<f8"), period_of(period))
        for side, period in enumerate(allowed.periods)
    ]
    sound = all(
        len(e) >= 4 and bool((np.diff(e) > 0).all()) and float(np.abs(e).max()) < FARTHEST for e in edges
    )
    require(
        sound and sum(map(len, edges)) <= MOST_NODES_OF_MAP,
        f"{where}: the nodes do not ascend, or are too many",
    )
    starts = read_stretches(section["starts"], allowed.sides, f"{where}: starts")
    return NoisyMap(section["landing"], uniform_law(bound, 1), varied, starts, edges)


def read_stretches(value: object, sides: int, where: str) -> list[Place]:
    """Read some places: side, and the box from x to x."""
    return [
        (read_side(one["side"], sides), Fraction(lo), Fraction(hi))
        for each in rows(value, where, 1, 1000)
        for one in (table(each, where, "side box"),)
        for lo, hi in read_box(one["box"], 1, where)
    ]


def read_varied(value: object, names: list[str], where: str) -> Varied:
    """Read which parameter varies at every step."""
    known = table(value, f"{where}: varied", "name within strata")
    bound = rational(known["within"], f"{where}: varied")
    count = known["strata"]
    require(known["name"] in names, f"{where}: what varies is no parameter of the map")
    require(bound > 0, f"{where}: what varies has no bound above 0")
    require(type(count) is int and count in STRATA, f"{where}: strata is not a power of 2 up to {STRATA[-1]}")
    return Varied(known["name"], bound, known["strata"])


def noise_of_map_in_words(c: NoisyMap) -> str:
    """Say what deviates."""
    laws = [] if c.law.certain else [f"steps land within {c.landing} of f(x), evenly"]
    if c.varied is not None:
        bound = decimal(c.varied.bound)
        laws.append(
            f"at every step {named(c.varied.name)} deviates by at most {bound} from its value, evenly"
        )
    return f"{'; '.join(laws)}; deviations are independent of each other"


def stretches_in_words(places: list[Place]) -> str:
    """Name places."""
    return ", ".join(f"[{float(lo)!r}, {float(hi)!r}] of side {side}" for side, lo, hi in places)


# ----------------------------------------------------------------
# Where steps lead.


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
    moved: Arb = ZERO  # along an axis that closes images are moved by whole periods


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
        lo, hi = -upper(-image), upper(image)
        if not (first.is_finite() and last.is_finite() and math.isfinite(hi - lo)):
            return []
        own = BranchOfCell(at, side, branch, ends, slope, bend)
        steps.append(StepOfMap(own, the_map.shape.to[side, branch], (first, last), (lo, hi)))
    return steps


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
            each.image[own.side, own.branch].at([arb(own.ends[end]), *each.piece([]).balls])[0] + step.moved
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


def mesh_of_map(edges: list[Array], law: Law) -> Mesh:
    """Put the nodes of all sides together, with one far out at either end."""
    # not nearer than in units of 1, in which roundings of places are allowed for (`Mesh.size`)
    size = 1.0 + max(float(np.abs(each).max()) for each in edges) + float(law.reach)
    return mesh_of(edges, OUTERMOST * FAR_OF_MAP * 2.0 ** math.ceil(math.log2(size)))


def between_ends(mesh: Mesh) -> Array:
    """List the cells, by their left nodes, but those to the far nodes."""
    return np.concatenate([np.arange(first + 1, end - 2) for first, end in itertools.pairwise(mesh.first)])


def chain_of_map(
    strata: list[Stratum],
    mesh: Mesh,
    law: Law,
    live: Array,
    absorbed: dict[str, Array],
    turned: Callable[[list[StepOfMap]], list[StepOfMap]] = list,
) -> tuple[Chain, list[list[BranchOfCell]]]:
    """Prove the steps from some cells; with the cells of the chain on their branches, by stratum."""
    scatter = None if law.certain else Scatter(mesh, law, NARROW_OF_MAP)
    collected = CellsOfMap(strata)
    known: list[dict[tuple[int, int, float], Arb]] = [{} for _ in strata]
    sides = np.searchsorted(mesh.first, live, side="right") - 1
    for at, side in zip(live.tolist(), sides.tolist(), strict=True):
        ends = float(mesh.place[at]), float(mesh.place[at + 1])
        steps = [
            turned(steps_from(each.whole, side, at, ends, seen))
            for each, seen in zip(strata, known, strict=True)
        ]
        collected.add(at, steps)
    prove(bool(collected.places), "the image of no cell is enclosed")
    goal, spread = mesh if scatter is None else scatter.mesh, spread_of(collected.places, collected.parts)
    # nodes are not raised together: the cells beside a change of branch may be wide
    rows = mean_rows(len(mesh.place), goal, [spread])
    return Chain(mesh, scatter, rows, absorbed, collected.parts, 0.0, narrow=0.0), collected.pieces


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
    ((own, to, _, reach, _),) = steps
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
