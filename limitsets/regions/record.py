"""What is proved of one cell of parameters: a record that holds for every parameter in it.

A cell of parameters is a scene with a tolerance, fixed but unknown: the proofs of `limitsets.proofs` are about it as
they are about any.  Here they are asked for, as cheaply as may be, and put together.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import CellSet
from limitsets.errors import AnswerError
from limitsets.goals import OrientedBeyond
from limitsets.proofs.attraction import Attraction, attraction
from limitsets.proofs.certificate import arrays_of
from limitsets.proofs.cover import cover
from limitsets.proofs.goals import cuts, prove
from limitsets.proofs.goals.kind import throws_to_reach
from limitsets.proofs.parameters import ParameterBox, parameter_box
from limitsets.proofs.rational import RationalInterval
from limitsets.proofs.tolerance import SceneBox
from limitsets.regions.persisting import Chain, Violation, violating_chain
from limitsets.regions.visits import Visit, visit
from limitsets.scene import Scene

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
    try:
        box = parameter_box(scene, tree=piece.tree())
        middle = parameter_box(scene, tree=_middle(piece).tree())
        coarse = _coarse(box, scene)
        first: Record | None = None
        for number in cells:
            found = _finer(coarse, scene, number)
            doubtful = _may_violate(found, scene)
            against = _refuting(found, scene, middle) if doubtful and first is None else Violation()
            # where these cells do not prove it finer ones are asked before two throws at once, which cost more
            record = _record(
                found, scene, ends, ask=not against.seen and (not doubtful or number == cells[-1])
            )
            if against.chain is not None:
                return replace(record, goal="refuted", reason="", chain=against.chain)
            if against.seen:
                return replace(record, reason=SEEN)
            if record.settled:
                return record
            first = record if first is None or not first.blocks else first
    except AnswerError as error:  # no such part or throw somewhere in the cell
        return Record(ends, "undecided" if scene.goal else "", str(error).splitlines()[0])
    # of a cell that stays undecided the coarse cells say as much as the fine ones
    return replace(first if first is not None and first.blocks else record, reason=record.reason)


def _coarse(box: ParameterBox, scene: Scene) -> tuple[Attraction, int]:
    """Find about where the attracting blocks are, and with how many cells a side."""
    wanted = cuts(() if scene.goal is None else (scene.goal,), box.lo.a.size)
    for number in COARSE:
        found = attraction(cover(box, number, wanted, PIECES))
        if (found.component >= 0).any():
            break
    return found, number


def _finer(coarse: tuple[Attraction, int], scene: Scene, number: int) -> Attraction:
    """Cut what attracts at multiples of a number-th of the arm, so that neighbours in the plane have such in common."""
    found, base = coarse
    extents, step = found.cells.extents(), float(found.cover.box.lo.arm_length) / number
    if not extents:
        return found
    wanted = cuts(() if scene.goal is None else (scene.goal,), found.cover.grid.sides)
    for side, (edges,) in enumerate(found.cover.grid.edges):
        for lo, hi in extents.get(side, ()):
            at = np.arange(math.ceil(lo / step), math.floor(hi / step) + 1) * step
            k = np.clip(np.searchsorted(edges, at), 1, edges.size - 1)
            # none so near to another border that the images of a cell had no room in the digits of x
            apart = np.minimum(np.abs(at - edges[k - 1]), np.abs(edges[k] - at)) > APART * step
            wanted[side] += at[apart].tolist()
    return attraction(cover(found.cover.box, base, wanted, PIECES))


def _middle(piece: SceneBox) -> SceneBox:
    middles = {name: (span.lo + span.hi) / 2 for name, span in piece.spans.items()}
    return SceneBox(piece.scene, {name: RationalInterval(x, x) for name, x in middles.items()})


def _record(
    found: Attraction, scene: Scene, spans: dict[str, tuple[Fraction, Fraction]], *, ask: bool
) -> Record:
    """Put together what some cells prove; the goal is undecided where it is not asked for."""
    basin = found.basin
    if not (found.component >= 0).any():
        return Record(spans, "undecided" if scene.goal else "", found.reason, shares=basin.shares)
    verdict, reason, section = "", basin.missing, dict[str, Any]()
    if scene.goal is not None and not ask:
        verdict = "undecided"
    elif scene.goal is not None:
        answer = prove(found, scene, scene.goal)
        verdict = "proved" if answer.verdict == "proved" else "undecided"
        reason, section = answer.reason, dict(answer.section) if verdict == "proved" else {}
    counts: dict[str, Any] = {"thinning": basin.thinning, "near": basin.near}
    if basin.near:
        counts["joint"] = [(near.q, *(near.fixed_point or (0.0, 0.0))) for near in found.joint]
    return Record(
        spans,
        verdict,
        reason,
        basin.starts,
        basin.shares,
        blocks_of(found),
        section | counts,
        arrays_of(found, ""),
    )


def _may_violate(found: Attraction, scene: Scene) -> bool:
    """Whether a goal of single places is violated somewhere in the attracting cells, as far as these tell."""
    wrong = None if scene.goal is None else scene.goal.wrong()
    if wrong is None:
        return False
    return any(
        wrong(np.array([hi]), np.array([side])).any()
        for side, parts in found.cells.extents().items()
        for _, hi in parts
    )


def _refuting(found: Attraction, scene: Scene, middle: ParameterBox) -> Violation:
    """Look for a periodic orbit of all parameters that violates the goal."""
    goal = scene.goal
    if not isinstance(goal, OrientedBeyond) or goal.from_anywhere:
        return Violation()
    return violating_chain(found, middle, goal)


# ---------------------------------------------------------------- the blocks


def blocks_of(found: Attraction) -> tuple[Block, ...]:
    """Say of each attracting component what it is proved to be like."""
    grid, arrays = found.cover.grid, arrays_of(found, "")
    jog, flip = arrays["jog"], arrays["flip"]
    blocks = []
    for number in range(int(found.component.max(initial=-1)) + 1):
        inside = found.component == number
        sides = []
        for side in range(grid.sides):
            own = np.zeros_like(inside)
            own[grid.of_side(side)] = True
            sides.append(own)
        extents = CellSet(grid, inside).extents()
        visits = {side: visit(jog, flip, inside, own) for side, own in enumerate(sides)}
        jogs = {side: each for side, each in visits.items() if each is not None}
        blocks.append(Block(extents, _bands(found, inside, extents), jogs, _order(extents, jogs, grid.sides)))
    return tuple(blocks)


def _order(extents: Mapping[int, Any], jogs: Mapping[int, Visit], sides: int) -> tuple[int, ...]:
    """Give the cyclic order of the sides: a flip leads to the next one, so that each has to be left again and again."""
    if len(extents) == 1 and not jogs:
        return tuple(extents)
    comes_round = len(jogs) == sides == len(extents) and all(each.most >= 0 for each in jogs.values())
    return tuple(range(sides)) if comes_round else ()


def _bands(
    found: Attraction, inside: NDArray[np.bool_], extents: Mapping[int, list[tuple[float, float]]]
) -> dict[int, int]:
    """Count the intervals of each side to which every orbit of the block comes."""
    grid = found.cover.grid
    bands = {}
    for side, parts in extents.items():
        bands[side] = 0
        low = grid.edges[side][0][:-1]
        for lo, hi in parts:
            wanted = np.zeros_like(inside)
            wanted[grid.of_side(side)] = (low >= lo) & (low < hi)
            bands[side] += not throws_to_reach(found, inside, wanted & inside)[1].size
    return bands
