"""What is proved of one cell of parameters: a record that holds for every parameter in it, orbits and jogs included.

A cell of parameters is a scene with a tolerance, fixed but unknown: the proofs of `limitsets.proofs` are about it as
they are about any.  Here they are asked for, as cheaply as may be, and put together.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.goals import OrientedBeyond
from limitsets.feeder.scene import Scene
from limitsets.proofs.prover.attraction import Attraction, attraction
from limitsets.proofs.prover.certificate import arrays_of
from limitsets.proofs.prover.cover import cover, met
from limitsets.proofs.prover.goals import cuts, prove
from limitsets.proofs.prover.goals.kind import above, throws_to_reach
from limitsets.proofs.prover.goals.violating_orbits import MORE_THAN_ROUNDING, middle
from limitsets.proofs.prover.numbers import RationalInterval
from limitsets.proofs.prover.orbits import follow
from limitsets.proofs.prover.parameters import ParameterBox, parameter_box
from limitsets.proofs.prover.tolerances import SceneBox
from limitsets.systems.cells import CellSet, cell_ends
from limitsets.systems.maps import Orbit, orbit

# ----------------------------------------------------------------
# Jogs per visit: how many throws a part stays on a side of an attracting block, between one flip and the next.


Ends = NDArray[np.int32]


class Visit(NamedTuple):
    """Bounds of the jogs in a row, from the landing after a flip to the next flip; `most` -1 where none is proved."""

    least: int
    most: int


def visit(jog: Ends, flip: Ends, block: Mask, side: Mask) -> Visit | None:
    """Bound the jogs of a visit to one side of a block; None where no flip of the block leads to it.

    Parameters
    ----------
    jog, flip : ndarray of int, shape (n_cells, 2)
        Target cells, as in a certificate.
    block, side : ndarray of bool, shape (n_cells,)
        The cells of the block, all sides together, and those of the side.
    """
    here = met(flip, block) & side
    if not here.any():
        return None
    least, most = -1, int((block & side).sum())
    for jogs in range(most + 1):
        if least < 0 and (flip[here, 0] >= 0).any():
            least = jogs
        if not (jog[here, 0] >= 0).any():
            return Visit(least, jogs)
        here = met(jog, here)
    return Visit(max(least, 0), -1)  # longer than there are cells: some cell comes again


# ----------------------------------------------------------------
# A periodic orbit that all parameters of a box have: intervals each of which is thrown over the next.
#
# Let I_0, ..., I_(p-1) be intervals, on each of which the decision of the throw is proved for all parameters of the
# box, and let the image of I_k hold I_(k+1), and that of the last one I_0: the throw is continuous on them and rises,
# so it is enough where the two ends go.  Then every map of the box has a periodic orbit that passes through the
# intervals in turn, by the intermediate value theorem.  The intervals may be as wide as the orbit moves over the box;
# multiplied out over a period, as a single interval of starts would have to be, they would not be decided any more.
# Source: covering relations, Zgliczynski and Gidea, Journal of Differential Equations 202, 2004, in one dimension.


# Throws until an orbit of the middle scene has settled, and throws of it that are searched.
SETTLING, SEARCHED = 2_000, 20_000

# Longest period; how near a return has to be, relative to x; returns that are tried, those with most room first.
LONGEST, NEAR, TRIED = 60, 1e-2, 64

# Widths beside the orbit, relative to x, on which the decision may be proved; times round the orbit.
WIDTHS, ROUNDS = tuple(0.1 * 2.0**-k for k in range(9)), 30

# An interval that has to shrink does so by this share of it more, so that the shrinking ends.
MORE = 2.0**-20

# Of the widths so much is used: the checker's balls decide less near a switch.  With half as much to spare it did not
# confirm one of 7306 cells of the plane in docs/regions.md.
SURE = 1.0 - 2.0**-4

# Images hold the next interval with this much to spare, so that other arithmetic can confirm it.
ROOM = 1e-9


class Chain(NamedTuple):
    """The intervals, with the side and the branch of each; the first one violates the goal as a whole."""

    lo: Array
    hi: Array
    side: Ints
    branches: Ints


class Return(NamedTuple):
    """A piece of an orbit that nearly comes back."""

    x: Array
    side: Ints
    branches: Ints


def violating_chain(
    attracting: Attraction, middle_box: ParameterBox, goal: OrientedBeyond
) -> tuple[bool, Chain | None]:
    """Look for a periodic orbit that violates the goal, and prove that every map of the box has one.

    Parameters
    ----------
    attracting : Attraction
        The cells, for the whole box.
    middle_box : ParameterBox
        The scene in the middle of the box.
    goal : OrientedBeyond
        The goal.

    Returns
    -------
    bool
        Whether an orbit of the scene in the middle violates the goal.
    Chain or None
        What proves it of all parameters.
    """
    box = attracting.cover.box
    map_now = middle_box.at_kappa(middle_box.middle_kappa)
    start = orbit(map_now, *middle(attracting, attracting.cells.numbers()), SETTLING)
    path = orbit(map_now, float(start.x[-1]), int(start.side[-1]), SEARCHED)
    if not goal.wrong()(path.x * MORE_THAN_ROUNDING, path.side).any():
        return False, None
    if not box.concave:
        return True, None  # the impact may not depend continuously on where the throw starts
    chains = (_widened(box, near, above(goal.x)) for near in _returns(path, goal))
    return True, next((chain for chain in chains if chain is not None), None)


def _returns(path: Orbit, goal: OrientedBeyond) -> Iterator[Return]:
    """Pieces from a place that violates the goal back to it, nearly; those farthest from all switches first."""
    size = path.code.size
    x, side = path.x[:size], path.side[:size]
    room = _from_switches(x, side, path.code)
    begin = np.flatnonzero(goal.wrong()(x, side) & (np.arange(size) < size - LONGEST))
    least = x[begin] - goal.x
    tried = []
    for period in range(1, LONGEST + 1):
        least = np.minimum(least, room[begin + period - 1])
        to = begin + period
        back = (side[to] == side[begin]) & (np.abs(x[to] - x[begin]) <= NEAR * x[begin])
        best = np.argsort(-least[back], kind="stable")[:TRIED]
        tried.append((least[back][best], begin[back][best], np.full(best.size, period)))
    score, start, length = (np.concatenate(parts) for parts in zip(*tried, strict=True))
    for k in np.argsort(-score, kind="stable")[:TRIED].tolist():
        piece = slice(int(start[k]), int(start[k] + length[k]))
        yield Return(x[piece], side[piece].astype(np.int64), path.code[piece].astype(np.int64))


def _from_switches(x: Array, side: Ints, code: Ints) -> Array:
    """Distance of each state from the nearest place at which the decision is seen to change."""
    room = np.full(x.size, np.inf)
    for s in np.unique(side).tolist():
        mine = np.flatnonzero(side == s)
        order = mine[np.argsort(x[mine], kind="stable")]
        change = np.flatnonzero(np.diff(code[order]))
        if change.size:
            at = 0.5 * (x[order][change] + x[order][change + 1])
            right = np.clip(np.searchsorted(at, x[mine]), 0, at.size - 1)
            left = np.maximum(right - 1, 0)
            room[mine] = np.minimum(np.abs(x[mine] - at[left]), np.abs(x[mine] - at[right]))
    return room


def _widened(box: ParameterBox, near: Return, beyond: float) -> Chain | None:
    """Widen a piece of orbit, whose first place lies beyond x on a wrong side, to a chain."""
    ends = [_decided(box, near, k) for k in range(near.side.size)]
    lo, hi = np.array([low for low, _ in ends]), np.array([high for _, high in ends])
    lo[0] = max(lo[0], math.nextafter(beyond, math.inf))
    if not (lo < hi).all():
        return None
    size = near.side.size
    waiting = set(range(size))
    for _ in range(ROUNDS * size):
        k = min(waiting)
        waiting.discard(k)
        image = _held(box, near, k, float(lo[k]), float(hi[k]))
        after = (k + 1) % size
        if not (image[0] <= lo[after] and hi[after] <= image[1]):
            more = MORE * (hi[after] - lo[after])
            lo[after] = lo[after] if image[0] <= lo[after] else image[0] + more
            hi[after] = hi[after] if hi[after] <= image[1] else image[1] - more
            if not lo[after] < hi[after]:
                return None
            waiting.add(after)
        if not waiting:
            return Chain(lo, hi, near.side, near.branches)
    return None


def _decided(box: ParameterBox, near: Return, k: int) -> tuple[float, float]:
    """Widest interval around a place of the orbit on which the throw is proved to go its way, and to rise."""
    x = float(near.x[k])
    ends = []
    for sign in (-1.0, 1.0):
        tried = (x + sign * width * abs(x) for width in WIDTHS)
        ends.append(next((end for end in tried if _goes(box, near, k, min(x, end), max(x, end))), x))
    # a little nearer, so that other arithmetic can confirm it
    return x + SURE * (ends[0] - x), x + SURE * (ends[1] - x)


def _goes(box: ParameterBox, near: Return, k: int, lo: float, hi: float) -> bool:
    """Whether throws from [lo, hi] are proved to take the branch of the orbit, and to rise with x."""
    on_arm = lo > box.bare[1].a[near.side[k]] and hi <= box.bare[0].arm_length
    thrown = follow(box, lo, hi, int(near.side[k]), near.branches[k : k + 1])
    return bool(on_arm and thrown.decided.all() and thrown.lo.size > 1 and thrown.slope[0] > 0.0)


def _held(box: ParameterBox, near: Return, k: int, lo: float, hi: float) -> tuple[float, float]:
    """Return an interval that the image of [lo, hi], on which the throw is decided, holds for all parameters."""
    word, side = near.branches[k : k + 1], int(near.side[k])
    first, last = follow(box, lo, lo, side, word), follow(box, hi, hi, side, word)
    return float(first.hi[1]) + ROOM, float(last.lo[1]) - ROOM


# ----------------------------------------------------------------
# What is proved of one cell of parameters: a record that holds for every parameter in it.


# Cells per side where nothing is known yet; more where nothing attracts with them.
COARSE = (64, 256, 1024)

# Cells per side, as narrow as these in what attracts, tried in turn until the goal is settled.
CELLS = (256, 1024)

# Borders of cells are apart by this share of the narrowest cell wanted.
APART = 0.125

# Pieces of the parameter that is known least, where a cell is open to both decisions.
PIECES = 8

SEEN = "an orbit of the middle violates the goal, and no such orbit is proved of all parameters"


class Block(NamedTuple):
    """An attracting block: the throw maps it into its own interior, so it holds an attractor.

    Attributes
    ----------
    extents : dict of int to list of (lo, hi)
        Its intervals per side; between them lies nothing of the attractor.
    bands : dict of int to int
        Per side, of so many of the intervals it is proved that every orbit of the block comes to them again and again.
    jogs : dict of int to Visit
        Per side that flips lead to, bounds of the jogs of one visit.
    flip_order : tuple of int
        The sides in cyclic order, where every orbit of the block is proved to leave every side; empty otherwise.
    """

    extents: dict[int, list[tuple[float, float]]]
    bands: dict[int, int]
    jogs: dict[int, Visit]
    flip_order: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Record:
    """What is proved of all parameters in a cell.

    Attributes
    ----------
    spans : dict of str to tuple of Fraction
        The cell: both ends per quantity, in the units of the scene.
    goal : str
        "proved", "refuted" (for each parameter a periodic orbit violates it), "undecided", or "" without a goal.
    reason : str
        What is missing where something is undecided.
    starts : str, dict or None
        The starts that are proved to come to the blocks: "every", "almost-every", {"from": {"0": x}} or "cells"; None
        without a block.
    shares : dict of str to float
        Shares of the arm: `share` comes to the blocks, `leaves`, `creeps`, `open`.  A certificate does not hold those
        that leave.
    blocks : tuple of Block
        Attracting blocks, disjoint: there are at least so many attractors.
    section : dict
        What a recheck needs of the goal and of the starts.
    arrays : dict of str to ndarray
        Cells, images and ranks, as a certificate has them; empty without a block.
    chain : Chain or None
        What refutes the goal.
    """

    spans: dict[str, tuple[Fraction, Fraction]]
    goal: str = ""
    reason: str = ""
    starts: Any = None
    shares: Mapping[str, float] = field(default_factory=dict)
    blocks: tuple[Block, ...] = ()
    section: Mapping[str, Any] = field(default_factory=dict)
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    chain: Chain | None = None

    @property
    def settled(self) -> bool:
        """Whether the goal is proved or refuted; without a goal, whether starts are proved to come to the blocks."""
        return self.goal in ("proved", "refuted") or (not self.goal and self.starts not in (None, "cells"))


def certify_cell(
    scene: Scene, spans: Mapping[str, tuple[Fraction, Fraction]], cells: Sequence[int] = CELLS
) -> Record:
    """Prove what can be proved of a scene for all values of some quantities.

    Parameters
    ----------
    scene : Scene
        The scene, without effects and noise.
    spans : mapping of str to (Fraction, Fraction)
        Per quantity both ends, in the unit in which the scene gives it.
    cells : sequence of int
        Cells per side, tried in turn.

    Returns
    -------
    Record

    Examples
    --------
    >>> import limitsets as ls
    >>> scene = ls.load("paper-designed").with_values({"throw.speed": "160 deg/s"})
    >>> found = certify_cell(scene, {"throw.speed": (Fraction(160), Fraction(641, 4))})
    >>> found.goal, found.starts, len(found.blocks), found.blocks[0].flip_order
    ('proved', 'every', 1, (0, 1, 2))
    """
    ends = {name: (Fraction(lo), Fraction(hi)) for name, (lo, hi) in spans.items()}
    piece = SceneBox(scene, {name: RationalInterval(*pair) for name, pair in ends.items()})
    goal = scene.goal
    try:
        box = parameter_box(scene, tree=piece.tree())
        middle = parameter_box(scene, tree=_middle(piece).tree())
        coarse = _coarse(box, scene)
        first: Record | None = None
        for number in cells:
            attracting = _finer(coarse, scene, number)
            doubtful = _may_violate(attracting, scene)
            seen, chain = False, None
            if doubtful and first is None and isinstance(goal, OrientedBeyond) and not goal.from_anywhere:
                seen, chain = violating_chain(attracting, middle, goal)
            # if these cells prove nothing, finer cells come before two throws at once, which cost more
            record = _record(attracting, scene, ends, ask=not seen and (not doubtful or number == cells[-1]))
            if chain is not None:
                return replace(record, goal="refuted", reason="", chain=chain)
            if seen:
                return replace(record, reason=SEEN)
            if record.settled:
                return record
            first = record if first is None or not first.blocks else first
    except AnswerError as error:  # no such part or throw somewhere in the cell
        return Record(ends, "undecided" if scene.goal else "", str(error).splitlines()[0])
    # where a cell stays undecided, its coarse cells say as much as its fine ones
    return replace(first if first is not None and first.blocks else record, reason=record.reason)


def _coarse(box: ParameterBox, scene: Scene) -> tuple[Attraction, int]:
    """Find about where the attracting blocks are, and with how many cells a side."""
    wanted = cuts(() if scene.goal is None else (scene.goal,), box.lo.a.size)
    for number in COARSE:
        attracting = attraction(cover(box, number, wanted, PIECES))
        if (attracting.component >= 0).any():
            break
    return attracting, number


def _finer(coarse: tuple[Attraction, int], scene: Scene, number: int) -> Attraction:
    """Cut the attracting cells at multiples of arm length / number, so that neighbours in the plane share borders."""
    attracting, base = coarse
    extents, step = attracting.cells.extents(), float(attracting.cover.box.lo.arm_length) / number
    if not extents:
        return attracting
    wanted = cuts(() if scene.goal is None else (scene.goal,), attracting.cover.grid.sides)
    for side, (edges,) in enumerate(attracting.cover.grid.edges):
        for lo, hi in extents.get(side, ()):
            at = np.arange(math.ceil(lo / step), math.floor(hi / step) + 1) * step
            k = np.clip(np.searchsorted(edges, at), 1, edges.size - 1)
            # a cut too near to another border would leave the images of a cell no room in the digits of x
            apart = np.minimum(np.abs(at - edges[k - 1]), np.abs(edges[k] - at)) > APART * step
            wanted[side] += at[apart].tolist()
    return attraction(cover(attracting.cover.box, base, wanted, PIECES))


def _middle(piece: SceneBox) -> SceneBox:
    middles = {name: (span.lo + span.hi) / 2 for name, span in piece.spans.items()}
    return SceneBox(piece.scene, {name: RationalInterval(x, x) for name, x in middles.items()})


def _record(
    attracting: Attraction, scene: Scene, spans: dict[str, tuple[Fraction, Fraction]], *, ask: bool
) -> Record:
    """Put together what some cells prove; the goal is undecided where it is not asked for."""
    basin = attracting.basin
    if not (attracting.component >= 0).any():
        return Record(spans, "undecided" if scene.goal else "", attracting.reason, shares=basin.shares)
    verdict, reason, section = "", basin.missing, dict[str, Any]()
    if scene.goal is not None and not ask:
        verdict = "undecided"
    elif scene.goal is not None:
        answer = prove(attracting, scene, scene.goal)
        verdict = "proved" if answer.verdict == "proved" else "undecided"
        reason, section = answer.reason, dict(answer.section) if verdict == "proved" else {}
    counts: dict[str, Any] = {"thinning": basin.thinning, "near": basin.near}
    if basin.near:
        counts["joint"] = [(near.q, *(near.fixed_point or (0.0, 0.0))) for near in attracting.joint]
    return Record(
        spans=spans,
        goal=verdict,
        reason=reason,
        starts=basin.starts,
        shares=basin.shares,
        blocks=blocks_of(attracting),
        section=section | counts,
        arrays=arrays_of(attracting, ""),
    )


def _may_violate(attracting: Attraction, scene: Scene) -> bool:
    """Whether the attracting cells reach a place that violates the goal."""
    wrong = None if scene.goal is None else scene.goal.wrong()
    if wrong is None:
        return False
    return any(
        wrong(np.array([hi]), np.array([side])).any()
        for side, parts in attracting.cells.extents().items()
        for _, hi in parts
    )


# ---------------------------------------------------------------- the blocks


def blocks_of(attracting: Attraction) -> tuple[Block, ...]:
    """Say of each attracting component what it is proved to be like."""
    grid, arrays = attracting.cover.grid, arrays_of(attracting, "")
    jog, flip, (on, _, _) = arrays["jog"], arrays["flip"], cell_ends(grid)
    blocks = []
    for number in range(int(attracting.component.max(initial=-1)) + 1):
        inside = attracting.component == number
        extents = CellSet(grid, inside).extents()
        visits = {side: visit(jog, flip, inside, on == side) for side in range(grid.sides)}
        jogs = {side: each for side, each in visits.items() if each is not None}
        blocks.append(
            Block(extents, _bands(attracting, inside, extents), jogs, _order(extents, jogs, grid.sides))
        )
    return tuple(blocks)


def _order(extents: Mapping[int, Any], jogs: Mapping[int, Visit], sides: int) -> tuple[int, ...]:
    """Give the cyclic order of the sides: a flip leads to the next one, so that each has to be left again and again."""
    if len(extents) == 1 and not jogs:
        return tuple(extents)
    comes_round = len(jogs) == sides == len(extents) and all(each.most >= 0 for each in jogs.values())
    return tuple(range(sides)) if comes_round else ()


def _bands(
    attracting: Attraction, inside: Mask, extents: Mapping[int, list[tuple[float, float]]]
) -> dict[int, int]:
    """Count the intervals of each side to which every orbit of the block comes."""
    on, low, _ = cell_ends(attracting.cover.grid)
    bands = dict.fromkeys(extents, 0)
    for side, parts in extents.items():
        for lo, hi in parts:
            wanted = inside & (on == side) & (low >= lo) & (low < hi)
            bands[side] += not throws_to_reach(attracting, inside, wanted)[1].size
    return bands
