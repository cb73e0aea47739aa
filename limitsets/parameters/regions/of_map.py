"""Proved regions of the parameters of any map: a box of one to three parameters, cut where it is not decided.

A box of parameters between two corners is asked for all claims at once (`limitsets.certify` with `upper`).  It counts
as proved where each is, and as refuted where "ends-in" is, by a cycle that attracts; else it is cut in its widest
direction.  Neighbours are glued as those of scenes are: where their components meet one to one.

All boxes have the same cells.  Let K of one box and L of its neighbour be attracting cells, and f a map on the common
face.  The image of K lies in its interior relative to the domain, for targets are chosen with a slack, and so does that
of L: where orbits of K come to L there is a cell of both.  So each attractor in K comes to the one L that K meets.  Of
final cells, whose orbits tend to a cycle, one cell of both says that the two cycles are one.
"""

from __future__ import annotations

import functools
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError, Column, Progress, Table, arguments_checked, shown
from limitsets.base.arrays import Ints
from limitsets.parameters.regions.plane import CODES, Cell, Index, cut_where_open, regions, spread
from limitsets.parameters.regions.writing import CellAxis
from limitsets.proofs.prover.certificate import Saved
from limitsets.proofs.prover.certificate_of_map import Part, write_map
from limitsets.proofs.prover.goal_of_map import GoalOfMap, read_goal
from limitsets.proofs.prover.of_map import certify_map
from limitsets.proofs.prover.proof_of_map import ProofOfMap
from limitsets.proofs.prover.recording import names_of
from limitsets.systems.cells import Grid
from limitsets.systems.maps import coerce
from limitsets.systems.maps.contract import require_corners, with_number

# Halvings of a box at most, for the raster of the smallest boxes; and parameters that vary.
MOST_HALVINGS, MOST_AXES = 20, 3

USUAL = ("trapping", "basin")
"""What is claimed of each box of parameters where nothing else is asked for."""


class RecordOfMap(NamedTuple):
    """What is proved of the maps between two corners.

    Attributes
    ----------
    verdict : str
        A word of `CODES`.
    reason : str
        Why it is not proved; empty if it is.
    part : Part
        The box as a certificate has it; without claims where nothing is decided.
    blocks : int
        Number of attracting components: there are at least so many attractors.
    exact : bool
        Whether there are exactly so many: every start of the domain comes to a component, and each tends to a cycle.
    periods : tuple of int
        Of the cycles to which components tend, ascending.
    settled : bool
        Whether smaller boxes would not say more.
    """

    verdict: str
    reason: str
    part: Part
    blocks: int = 0
    exact: bool = False
    periods: tuple[int, ...] = ()
    settled: bool = True


@dataclass(frozen=True, eq=False)
class RegionsOfMap(Saved):
    """A box of parameters of a map in boxes, and what is proved of each.

    Attributes
    ----------
    grid : Grid
        The cells, the same for all parameters.
    axes : tuple of CellAxis
        The parameters that vary, with the borders of the smallest boxes: those of all boxes are among them.
    index : ndarray of int32, shape (n, 2 axes)
        Per box the numbers of its borders: low and high along each axis in turn.
    records : tuple of RecordOfMap
        Per box what is proved.
    code : ndarray of int8, shape (n,)
        Per box a number of `limitsets.regions.CODES`: undecided, proved, refuted.
    region : ndarray of int32, shape (n,)
        Number of the region, from 0 in the order of first boxes; -1 without attracting cells.
    goal : GoalOfMap or None
        What "ends-in" says.
    seconds : float
        Time it took.
    """

    grid: Grid
    axes: tuple[CellAxis, ...]
    index: Index
    records: tuple[RecordOfMap, ...]
    code: NDArray[np.int8]
    region: NDArray[np.int32]
    goal: GoalOfMap | None
    seconds: float

    @functools.cached_property
    def sizes(self) -> tuple[Fraction, ...]:
        """The share of the whole that each box is, exactly: its ends are decimals."""
        return tuple(
            math.prod(
                (axis.borders[high] - axis.borders[low]) / (axis.borders[-1] - axis.borders[0])
                for axis, low, high in zip(self.axes, at[::2], at[1::2], strict=True)
            )
            for at in self.index.tolist()
        )

    def share(self, chosen: Any) -> Fraction:
        """Add the shares of some boxes, exactly; `chosen` has shape (n,)."""
        return sum((self.sizes[k] for k in np.flatnonzero(chosen).tolist()), Fraction(0))

    def shares(self) -> dict[str, Fraction]:
        """Shares that are undecided, proved and refuted, exactly: together 1."""
        return {word: self.share(self.code == k) for k, word in enumerate(CODES)}

    @property
    def blocks(self) -> Ints:
        """Number of attracting components of each box, shape (n,)."""
        return np.array([record.blocks for record in self.records], dtype=np.int64)

    def raster(self, of: NDArray[Any] | None = None) -> NDArray[Any]:
        """Spread numbers of the boxes, by default their own, over the raster of the smallest boxes."""
        return spread(self.axes, self.index, np.arange(len(self.index)) if of is None else of)

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        percent = Column("share", show=lambda share: f"{100 * float(share):.2f} %")
        names = " and ".join(axis.quantity for axis in self.axes)
        verdicts = [(word, int((self.code == k).sum()), share)
                    for k, (word, share) in enumerate(self.shares().items())]  # fmt: skip
        whole = Table(("verdict", "boxes", percent), verdicts, f"Boxes of {names}", "proved")
        rows = [self._row(number) for number in range(int(self.region.max(initial=-1)) + 1)]
        if not rows:
            return (whole,)
        heads = ("region", "boxes", percent, "attractors", "periods of cycles")
        return whole, Table(heads, rows, "Regions: attractors that continue into each other", "proved")

    def __str__(self) -> str:
        return "\n\n".join(table.text() for table in self.tables())

    def _row(self, number: int) -> tuple[Any, ...]:
        mine = self.region == number
        held = [self.records[k] for k in np.flatnonzero(mine).tolist()]
        words = "" if all(record.exact for record in held) else "at least "
        periods = sorted({period for record in held for period in record.periods})
        return number, len(held), self.share(mine), f"{words}{held[0].blocks}", ", ".join(map(str, periods))

    def _write(self, path: str | Path, **how: Any) -> None:
        """Write one file of type `plane` with all boxes, each by itself: regions do not stand in it."""
        if not self.code.any():
            remedy = "take finer cells, more halvings or fewer claims"
            raise AnswerError("the regions", "undecided everywhere", "a box that is proved", remedy)
        write_map(
            path,
            self.grid.domain,
            [record.part for record in self.records],
            goal=None if self.goal is None else self.goal.in_file(),
            region=[axis.quantity for axis in self.axes],
            **how,
        )


@arguments_checked
def certified_map(
    map: Any,  # noqa: A002  # the field's word
    grid: Grid,
    claims: Sequence[str] | None = None,
    *,
    upper: Any,
    ends: Any = None,
    starts: Any = None,
    share: float = 0.0,
    first: int = 0,
    depth: int = 8,
    seconds: float | None = None,
    progress: Progress | None = None,
) -> RegionsOfMap:
    """Prove claims about all maps between two corners of one to three parameters, cut into boxes where it is needed.

    Parameters
    ----------
    map, upper : NamedTuple
        The lower and the upper corner of the parameters.
    grid : Grid
        The cells; finer ones prove more.
    claims : sequence of str, optional
        As for `limitsets.certify`, all of which a box has to have; by default "ends-in" where `ends` are given, else
        "trapping" and "basin".
    ends, starts : sequence of boxes, optional
        The goal "ends-in", as for `limitsets.certify`.  With `starts` a box may be refuted too.
    share : float
        Of the claims "basin" and "ends-in" without starts: cells that cover so much of the domain have to lead there.
    first : int
        How often the whole is halved before any box is asked: wide boxes join attractors that smaller ones tell apart.
    depth : int
        How often a box is halved in all, each time in its widest direction, while it is undecided.
    seconds : float, optional
        After this time no further box is asked: the rest stays undecided.
    progress : callable, optional
        Called with what is done, how much of it, and of how much.

    Returns
    -------
    RegionsOfMap

    Raises
    ------
    AnswerError
        For corners that differ in none or more than three parameters, or what `limitsets.certify` refuses.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.regions import certified_map
    >>> lower, upper = ls.maps.Logistic(2.0), ls.maps.Logistic(2.5)
    >>> found = certified_map(lower, ls.grid([(0.1, 0.9)], cells=256), ["converges", "attracts-all"], upper=upper)
    >>> found.shares()["proved"], set(found.region.tolist()), found.records[0].exact
    (Fraction(1, 1), {0}, True)
    """
    begin = time.perf_counter()
    for name, value, most in (("share", share, 1), ("depth", depth, MOST_HALVINGS), ("first", first, depth)):
        if not 0 <= value <= most:
            raise AnswerError(f"the argument {name} of certified_map", value, f"0 to {most}", "correct it")
    require_corners(map, upper)
    lower, over = coerce(map), coerce(upper)
    axes = _axes(lower, over, depth)
    wanted = tuple(claims or (("ends-in",) if ends is not None else USUAL))
    goal = None if ends is None else read_goal(ends, starts, grid.domain)

    def ask(at: Cell) -> RecordOfMap:
        corners = tuple(_corner(lower, axes, at[end::2]) for end in (0, 1))
        if seconds is not None and time.perf_counter() - begin > seconds:
            return RecordOfMap(CODES[0], f"the {seconds:g} seconds were over", Part(corners, {}, {}))
        return _record(
            certify_map(corners[0], grid, wanted, upper=corners[1], ends=ends, starts=starts), share
        )

    boxes: list[Cell] = [tuple(end for axis in axes for end in (0, len(axis.borders) - 1))]
    for _ in range(first):
        boxes = [half for at in boxes for half in _halves(at)]
    index, records = cut_where_open(
        boxes, lambda todo: (ask(at) for at in todo), _halves, depth - first, progress
    )
    code = np.array([CODES.index(record.verdict) for record in records], dtype=np.int8)
    region = regions(records, spread(axes, index, np.arange(len(index))), _corresponds)
    return RegionsOfMap(grid, axes, index, records, code, region, goal, time.perf_counter() - begin)


def _axes(lower: Any, upper: Any, depth: int) -> tuple[CellAxis, ...]:
    """Cut the range of each parameter that varies: decimals of floats, as they stand in a file."""
    ends = zip(names_of(lower), names_of(upper), strict=True)
    varied = [(name, low, high) for (name, low), (_, high) in ends if low != high]
    if not 1 <= len(varied) <= MOST_AXES:
        names = ", ".join(name for name, *_ in varied) or "none"
        remedy = "pass upper= that differs from the map in these"
        raise AnswerError("the parameters that vary", names, f"one to {MOST_AXES} of them", remedy)
    axes = []
    for name, low, high in varied:
        whole = CellAxis(name, "", (Fraction(repr(low)), Fraction(repr(high))))
        borders = whole.refined(-(-depth // len(varied))).borders
        decimals = tuple(Fraction(repr(float(border))) for border in borders)
        if len(set(decimals)) < len(decimals):
            remedy = "take a wider range, or halve it fewer times"
            raise AnswerError(f"the range of {name}", shown((low, high)), "one that can be halved", remedy)
        axes.append(CellAxis(name, "", decimals))
    return tuple(axes)


def _corner(params: Any, axes: Sequence[CellAxis], at: Sequence[int]) -> Any:
    """Return the map with the values of some borders."""
    for axis, number in zip(axes, at, strict=True):
        params = with_number(params, axis.quantity, float(axis.borders[number]))
    return params


def _halves(at: Cell) -> Iterator[Cell]:
    """Halve a box in its widest direction, the first of several."""
    widths = [high - low for low, high in zip(at[::2], at[1::2], strict=True)]
    k = 2 * widths.index(max(widths))
    middle = (at[k] + at[k + 1]) // 2
    yield (*at[: k + 1], middle, *at[k + 2 :])
    yield (*at[:k], middle, *at[k + 1 :])


def _record(proof: ProofOfMap, share: float) -> RecordOfMap:
    """Say what a proof decides, and keep of it what a file needs."""
    if any(each.claim == "ends-in" and each.verdict == "refuted" for each in proof.claims):
        return RecordOfMap(CODES[2], "refuted by a cycle that attracts", proof.part())
    open_ = [claim for claim in proof.claims if claim.verdict != "proved"]
    words = [claim.claim for claim in proof.claims]
    reason = f"{open_[0].claim}: {open_[0].reason}" if open_ else _missing(proof, words, share)
    if reason:
        part = Part((proof.map, proof.upper), {}, {})
        return RecordOfMap(CODES[0], reason, part, settled=any(claim.final for claim in open_))
    part = proof.part()
    blocks = int(part.arrays["component"].max(initial=-1)) + 1 if part.arrays else 0
    periods = tuple(sorted(cycle.period for cycle in proof.cycles if cycle.ball is not None))
    exact = "attracts-all" in words and len(periods) == blocks
    return RecordOfMap(CODES[1], "", part, blocks, exact, periods)


def _missing(proof: ProofOfMap, words: Sequence[str], share: float) -> str:
    """Say what a box lacks whose claims are proved: the ranks in a file show less than the prover knows."""
    if not {"basin", "attracts-all", "ends-in"} & set(words):
        return ""
    ranked, size = proof.arrays["rank"] >= 0, proof.graph.grid.measure
    if "attracts-all" in words and not ranked.all():
        return "attracts-all: orbits pass through cells that recur, which no certificate shows"
    held = float(size[ranked].sum() / size.sum())
    return "" if held >= share else f"{100 * held:.4g} % of the domain is proved to lead there"


def _corresponds(one: RecordOfMap, other: RecordOfMap) -> bool:
    """Whether the components of two neighbours meet one to one, and come to each other's or tend to cycles."""
    if not one.blocks or one.blocks != other.blocks:
        return False
    a, b = one.part.arrays["component"], other.part.arrays["component"]
    both = (a >= 0) & (b >= 0)
    meets = np.zeros((one.blocks, one.blocks), dtype=np.int64)
    meets[a[both], b[both]] = 1
    if not ((meets.sum(axis=0) == 1).all() and (meets.sum(axis=1) == 1).all()):
        return False
    if all(len(record.periods) == record.blocks for record in (one, other)):
        return True  # an orbit from a cell of both tends to one cycle
    ranks = one.part.arrays["rank"], other.part.arrays["rank"]
    return bool((ranks[1][a >= 0] >= 0).all() and (ranks[0][b >= 0] >= 0).all())
