"""Proofs about any map on a grid: what the enclosed images of the cells imply, and periodic orbits.

*Invariant, trapping*: no image of an attracting component meets a cell outside; cells are closed, so the images lie in
the interior of the component, relative to the domain.
*Attracts all*: besides, no image leaves the domain and every recurrent component attracts, or orbits pass through: its
cells, cut finer, do not recur.  Then the rank of a cell, the longest path to an attracting cell, falls along every
orbit outside, but for the stays where orbits pass, which are bounded.
*Basin*: orbits from the cells all of whose paths end in attracting cells enter these, and stay.
*Ends in*: the cells of some boxes from which no path leaves these boxes are mapped into each other; from the cells with
the starts every path leads there.
*Expanding*, in one dimension: |dx'/dx| > 1 on every attracting cell, on every branch that is possible there; refuted
where it is below 1 on all of them.
*Cycles*: for the points x_0 .. x_p-1 of an orbit along an itinerary, F_k = f(x_k) - x_k+1 and boxes X_k around them,
K(X) = m - C F(m) + (1 - C DF(X)) (X - m) lies in the interior of X.  Then F has one root in X, whatever the matrix C,
and it is no multiple one (Krawczyk; Neumaier, "Interval Methods for Systems of Equations", 1990, section 5.1).  All
points at once, and not the first one under f^p: so images of a box of parameters do not grow along the orbit.  On X
every branch is proved to be taken.

For two corners of parameters all of it holds for each of the maps between.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add, mul
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from limitsets.base import (
    AnswerError,
    Column,
    Progress,
    Table,
    Tabled,
    arguments_checked_as,
    as_table,
    bands_of,
    picked,
    shown_in_notebooks,
)
from limitsets.base.arrays import Array, Arrays, Ints
from limitsets.numbers.interval import guard
from limitsets.proofs.prover.attraction import components_of
from limitsets.proofs.prover.certificate import require_proved
from limitsets.proofs.prover.certificate_of_map import cells_of, cycle_in_file, write_map
from limitsets.proofs.prover.goal_of_map import GoalOfMap, missing, read_goal, within_ends
from limitsets.proofs.prover.numbers import Intervals
from limitsets.proofs.prover.proof import Claim, left_of
from limitsets.systems.cells import CellSet, Grid
from limitsets.systems.graph import TransitionGraph, transitions
from limitsets.systems.graph.components import ranks
from limitsets.systems.maps import coerce, has_slope, kernels, kind_of
from limitsets.systems.maps.contract import between, compiled_kind_of
from limitsets.systems.maps.derived import NEVER, SURE, UNKNOWN, branch_boxes
from limitsets.systems.sets import Cycle, Cycles, cycles, cycles_of
from limitsets.systems.sets.basin import longest_stays, passing

Matrix: TypeAlias = list[list[Intervals]]

# Claims about slopes: slopes are derived automatically even where the map gives its own boxes.
OF_SLOPES = ("cycles", "expanding")

# Largest period of the search for cycles.
UP_TO = 16

# X is K(X) of the step before and so much more of its width, until it holds its own; relative to the point at first.
MORE, FIRST, TRIES = 0.125, 2.0**-40, 24

# Itineraries of one length (in the plane: starts) beyond which no longer cycles are looked for.
MOST_WORDS = 2000


@dataclass(frozen=True, eq=False)
class CycleOfMap:
    """A periodic orbit that is proved to exist, alone in its boxes.

    Attributes
    ----------
    lo, hi : ndarray, shape (p, d)
        Boxes of its points in the order of the steps; the first is the one in which it is alone.
    side, branches : ndarray of int, shape (p,)
        The side of each point, and the branch taken from it.
    slope_lo, slope_hi : ndarray, shape (d, d)
        Enclosure of the derivative of F^p.
    attracts : bool or None
        Whether every eigenvalue of it is below 1 in modulus; None where that is open.
    """

    lo: Array
    hi: Array
    side: Ints
    branches: Ints
    slope_lo: Array
    slope_hi: Array
    attracts: bool | None

    @property
    def period(self) -> int:
        """p, the smallest one."""
        return int(self.side.size)


@dataclass(frozen=True, eq=False)
class ProofOfMap(Tabled):
    """What was proved of a map on a grid.

    Attributes
    ----------
    map, upper : NamedTuple
        The corners of the parameters.
    graph : TransitionGraph
        Cells and enclosed images.
    component : ndarray of int32, shape (n_cells,)
        Number of the attracting component of each cell, -1 outside.
    claims : tuple of Claim
        One per claim asked for.
    cycles : tuple of CycleOfMap
        The periodic orbits that are proved, if "cycles" was asked for.
    seconds : float
        Time it took.
    goal : GoalOfMap or None
        What "ends-in" says, if boxes were given.
    """

    map: Any
    upper: Any
    graph: TransitionGraph
    component: NDArray[np.int32]
    claims: tuple[Claim, ...]
    cycles: tuple[CycleOfMap, ...]
    seconds: float
    goal: GoalOfMap | None = None

    @property
    def proved(self) -> bool:
        """Whether every claim is proved."""
        return all(claim.verdict == "proved" for claim in self.claims)

    @property
    def cells(self) -> CellSet:
        """The attracting cells: proved to be positively invariant."""
        return CellSet(self.graph.grid, self.component >= 0)

    @property
    def enters(self) -> CellSet:
        """The cells all of whose points are proved to enter the attracting cells."""
        return CellSet(self.graph.grid, self.graph.condensation().destinations(passing(self.graph)) >= 0)

    @functools.cached_property
    def arrays(self) -> Arrays:
        """The arrays of a certificate: target cells, ranks, components (docs/certificates.md)."""
        grid = self.graph.grid
        ends = None if self.goal is None else within_ends(self.goal, grid)
        return cells_of(self.map, self.upper, grid, ends)

    def save(self, path: str | Path, *, recheck: bool = True, workers: int | None = 1) -> Path:
        """Write the certificate of the claims that are proved; it gets its name once `recheck` has confirmed it.

        The file holds the formulas of `image_on` (of `image` where a map of one branch has no other) and `margin`, as
        `limitsets.formulas` shows them, and the proof is of these.

        Parameters
        ----------
        path : str or Path
            The file, replaced whole.
        recheck : bool
            Whether to have it checked first.
        workers : int, optional
            Processes that check it, as in `limitsets.recheck`.

        Raises
        ------
        AnswerError
            Nothing is proved, or the map cannot be recorded: the line names the function and the way out.
        DeniedError
            The checker does not confirm it: it is kept as NAME.denied.zip.
        """
        claims = {each.claim: dict(each.section) for each in self.claims if each.verdict == "proved"}
        require_proved(claims)
        if "cycles" in claims:
            claims["cycles"] = {"cycles": [_in_file(self, cycle) for cycle in self.cycles]}
        write_map(
            path,
            (self.map, self.upper),
            self.graph.grid,
            claims,
            arrays={} if set(claims) == {"cycles"} else self.arrays,
            goal=self.goal.in_file() if self.goal and "ends-in" in claims else None,
            recheck=recheck,
            workers=workers,
        )
        return Path(path)

    def denied(self, claims: Mapping[str, str]) -> ProofOfMap:
        """Return the proof where the checker denies some claims: these are undecided."""
        cycles = () if "cycles" in claims else self.cycles
        return replace(self, claims=left_of(self.claims, claims), cycles=cycles)

    def functions(self, claim: str) -> str:
        """Name the functions of the map that a claim is proved of: `image` may be another, but for a sample."""
        kind = kind_of(self.map)
        names: tuple[str, ...] = ("image_box",) if kind.own_box else ()
        if not kind.own_box or claim in OF_SLOPES:
            names += kind.formulas
        return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))

    def to_json(self) -> list[dict[str, Any]]:
        """Give it as plain tables for JSON, one per claim."""
        return [
            as_table(
                **picked(claim, "claim", "verdict"),
                of=self.functions(claim.claim),
                reason=claim.reason or None,
                map=type(self.map).__name__,
                parameters=[end._asdict() for end in (self.map, self.upper)],
                cells=self.graph.n_cells,
                attracting=len(self.cells),
                section=claim.section or None,
                cycles=self.cycles if claim.claim == "cycles" else None,
                timings={"certify": self.seconds},
            )
            for claim in self.claims
        ]

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [
            (each.claim, each.verdict, self.functions(each.claim), _missing(each)) for each in self.claims
        ]
        caption = f"Proofs of {type(self.map).__name__}, of {self.functions('invariant')}"
        claims = Table(("claim", "verdict", "of", "missing"), rows, caption)
        if not len(self.cells):
            return (claims,)
        kept = _region(self.cells, "Attracting cells", "no image leads out")
        return claims, kept, _region(self.enters, "Basin", "every point of its cells enters them")

    def __str__(self) -> str:
        return "\n\n".join(table.text() for table in self.tables())


# ---------------------------------------------------------------- claims about cells


def _region(cells: CellSet, caption: str, proved: str) -> Table:
    """Say where cells are: which intervals on a line, else by boxes around their connected pieces."""
    rows: list[tuple[Any, ...]]
    if cells.grid.dimension == 1:
        names, rows = ["x"], [(side, band) for side, band in bands_of(cells.extents())]
    else:
        names = [f"x[{axis}]" for axis in range(cells.grid.dimension)]
        rows = [(side, *box) for side, boxes in cells.pieces().items() for box in boxes]
    spans = [Column(name, show=".6g", ends=True) for name in names]
    caption += ": boxes around its pieces" if cells.grid.dimension > 1 else ""
    how = f"proved: {proved}; {len(cells)} of {cells.grid.n_cells} cells"
    return Table(("side", *spans), rows, caption, how)


def _missing(claim: Claim) -> str | None:
    """Say what is not proved, also of the cycles where only some are proved."""
    rest = claim.section.get("missing", [])
    more = f"; and {len(rest) - 1} more" if len(rest) > 1 else ""
    return claim.reason or (f"{rest[0]}{more}" if rest else None)


def _place(grid: Grid, cell: int) -> str:
    """Name a cell for people."""
    side = int(grid.side_of(np.array([cell]))[0])
    lo, hi = (corner[0] for corner in grid.boxes(np.array([cell]), side))
    spans = ", ".join(f"[{a:.6g}, {b:.6g}]" for a, b in zip(lo, hi, strict=True))
    return f"side {side}, x in {spans}" if grid.sides > 1 else f"x in {spans}"


def _invariant(proof: ProofOfMap) -> Claim:
    if not len(proof.cells):
        return Claim("invariant", "undecided", "there are no attracting cells", {})
    return Claim("invariant", "proved", "", {})


def _ends_in(proof: ProofOfMap) -> Claim:
    assert proof.goal is not None
    reason = missing(proof.goal, proof.graph.grid, proof.arrays)
    return Claim("ends-in", "undecided" if reason else "proved", reason, {})


def _attracts_all(proof: ProofOfMap) -> Claim:
    graph, attracting = proof.graph, proof.component >= 0
    sets, parts = graph.recurrent_components(), graph.components()
    leaving = np.flatnonzero(graph.ranges.exits)
    attracts = np.array([attracting[cells[0]] for cells in sets], dtype=bool)
    if leaving.size:
        place = _place(graph.grid, int(leaving[0]))
        return Claim(
            "attracts-all", "undecided", f"the image of {place} may leave the domain, or is not enclosed", {}
        )
    if not attracts.any():
        return Claim("attracts-all", "undecided", "there are no attracting cells", {})
    stays = np.zeros(len(sets), np.int64) if attracts.all() else longest_stays(graph)
    lost = np.concatenate(
        [
            np.zeros(0, np.int64),
            *(cells for cells, good in zip(sets, attracts | (stays > 0), strict=True) if not good),
        ]
    )
    if lost.size:
        place = _place(graph.grid, int(lost.min()))
        return Claim(
            "attracts-all", "undecided", f"{lost.size} recurrent cells do not attract: first {place}", {}
        )
    settled = np.zeros(parts.count, dtype=bool)
    settled[np.flatnonzero(parts.recurrent)[attracts]] = True
    # a rank falls with every step, but for those within a recurrent component, through which orbits pass
    most = int(ranks(graph.ranges, parts, settled).max()) + int((stays[stays > 0] - 1).sum())
    return Claim("attracts-all", "proved", "", {"max_rank": most})


def _expanding(proof: ProofOfMap) -> Claim:
    grid = proof.graph.grid
    if grid.dimension != 1:
        reason = "expansion is proved in one dimension only"
        return Claim("expanding", "undecided", reason, {}, final=True)
    if not len(proof.cells):
        return Claim("expanding", "undecided", "there are no attracting cells", {})
    numbers = proof.cells.numbers()
    sides, least, most, place = grid.side_of(numbers), np.inf, 0.0, ""
    for side in np.unique(sides).tolist():
        mine = numbers[sides == side]
        lo, hi = grid.boxes(mine, side)
        for branch in range(len(kind_of(proof.map).branches)):
            boxes = branch_boxes(proof.map, proof.upper, side, branch, lo, hi)
            low, high = boxes.slope_lo[:, 0, 0], boxes.slope_hi[:, 0, 0]
            slope = np.where(low > 0.0, low, np.where(high < 0.0, -high, 0.0))
            slope[boxes.state == UNKNOWN] = 0.0
            slope[boxes.state == NEVER] = np.inf
            largest = np.maximum(np.abs(low), np.abs(high))
            largest[boxes.state == UNKNOWN] = np.inf
            most = max(most, float(largest[boxes.state != NEVER].max(initial=0.0)))
            worst = int(slope.argmin())
            if slope[worst] < least:
                least, place = float(slope[worst]), _place(grid, int(mine[worst]))
    if most < 1.0:
        reason = f"on all attracting cells the slope is at most {most:.6g} in modulus"
        return Claim("expanding", "refuted", reason, {}, final=True)
    if not least > 1.0:
        return Claim("expanding", "undecided", f"slope {least:.6g} at {place}", {})
    return Claim("expanding", "proved", "", {"least_slope": least.hex()})


# ---------------------------------------------------------------- cycles


def _stepped(
    proof: ProofOfMap, lo: Array, hi: Array, cycle: Cycle | CycleOfMap
) -> tuple[Intervals, Intervals] | str:
    """Enclose images (p, d) and slopes (p, d, d) of boxes around the points of an orbit; or say what is missing."""
    image, slope = np.empty((2, *lo.shape)), np.empty((2, *lo.shape, lo.shape[1]))
    for side, branch in sorted(set(zip(cycle.side.tolist(), cycle.branches.tolist(), strict=True))):
        here = np.flatnonzero((cycle.side == side) & (cycle.branches == branch))
        boxes = branch_boxes(proof.map, proof.upper, side, branch, lo[here], hi[here])
        if (boxes.state == UNKNOWN).any():
            return "its images are not bounded on the boxes that are tried"
        if (boxes.state != SURE).any():
            return f"the branch of point {here[np.argmax(boxes.state != SURE)]} is not proved"
        if (cycle.side[(here + 1) % cycle.period] != boxes.side).any():
            return "it ends on another side"
        image[:, here], slope[:, here] = (boxes.lo, boxes.hi), (boxes.slope_lo, boxes.slope_hi)
    return Intervals(*image), Intervals(*slope)


def _matrix(lo: Array, hi: Array) -> Matrix:
    return [[Intervals.of(a, b) for a, b in zip(*rows, strict=True)] for rows in zip(lo, hi, strict=True)]


def _times(a: Matrix, b: Matrix) -> Matrix:
    columns = list(zip(*b, strict=True))
    return [[reduce(add, map(mul, row, column)) for column in columns] for row in a]


def _ends(a: Matrix) -> tuple[Array, Array]:
    lo, hi = (np.array([[getattr(entry, end)[0] for entry in row] for row in a]) for end in ("lo", "hi"))
    return lo, hi


def _slope(steps: Intervals) -> Matrix:
    """Enclose the derivative of the steps together."""
    each = map(_matrix, steps.lo, steps.hi)
    return reduce(lambda total, step: _times(step, total), each)


def _exactly(x: Array) -> Intervals:
    return Intervals(x, x)


def _sum(terms: Intervals) -> Intervals:
    """Add along the last axis."""
    return reduce(add, map(Intervals, np.moveaxis(terms.lo, -1, 0), np.moveaxis(terms.hi, -1, 0)))


def _inverse(slope: Intervals) -> Array:
    """Invert DF in floats; nan, which proves nothing, where it is singular."""
    p, d = slope.lo.shape[:2]
    derivative = np.zeros((p, d, p, d))
    for k in range(p):
        derivative[k, :, k] += 0.5 * (slope.lo[k] + slope.hi[k])
        derivative[k, :, (k + 1) % p] -= np.eye(d)
    try:
        return np.asarray(np.linalg.inv(derivative.reshape(p * d, p * d)), dtype=np.float64)
    except np.linalg.LinAlgError:
        return np.full((p * d, p * d), np.nan)


def _in_file(proof: ProofOfMap, cycle: CycleOfMap) -> dict[str, Any]:
    slopes = None
    if cycle.attracts:
        step = _stepped(proof, cycle.lo, cycle.hi, cycle)
        assert not isinstance(step, str)  # it was proved on these boxes
        slopes = 0.5 * (step[1].lo + step[1].hi)
    # branches that are names alone are one in the file
    branches = cycle.branches if kind_of(proof.map).has_margin else np.zeros_like(cycle.branches)
    return cycle_in_file(cycle.lo, cycle.hi, cycle.side, branches, slopes)


def _krawczyk(middle: Array, c: Array, off: Intervals, slope: Intervals, wide: Intervals) -> Intervals:
    """K(X), from F at the middles, the slopes on X, and X less the middles."""
    p, d = middle.shape
    of_points = c.reshape(p * d, p, d)
    turned = Intervals(slope.lo.swapaxes(1, 2), slope.hi.swapaxes(1, 2))
    product_ = _sum(_exactly(of_points[:, :, None, :]) * turned) - _exactly(np.roll(of_points, 1, axis=1))
    rest = _exactly(np.eye(p * d).reshape(p * d, p, d)) - product_
    newton, spread = (_sum(_sum(terms)) for terms in (_exactly(of_points) * off, rest * wide))
    moved = _exactly(middle.ravel()) - newton + spread
    return Intervals(moved.lo.reshape(p, d), moved.hi.reshape(p, d))


def _attracts(slope: Matrix) -> bool | None:
    """Whether every eigenvalue lies in the unit disc: of a 2 x 2 matrix by |det| < 1 and |trace| < 1 + det (Jury)."""
    if len(slope) == 1:
        size = slope[0][0].absolute()
        return True if size.hi[0] < 1.0 else (False if size.lo[0] > 1.0 else None)
    (a, b), (c, d) = slope
    det, trace = a * d - b * c, (a + d).absolute()
    room = det + 1.0 - trace
    if det.absolute().hi[0] < 1.0 and room.lo[0] > 0.0:
        return True
    return False if det.absolute().lo[0] > 1.0 or room.hi[0] < 0.0 else None


@np.errstate(all="ignore")  # a singular matrix or an overflow gives inf and nan, which prove nothing
def _prove(proof: ProofOfMap, cycle: Cycle) -> CycleOfMap | str:
    """Prove that there is one orbit near one found in floats; or say what is missing."""
    middle = cycle.x.reshape(cycle.period, -1).astype(np.float64)
    step = _stepped(proof, middle, middle, cycle)
    if isinstance(step, str):
        return step
    c, least = _inverse(step[1]), FIRST * np.maximum(np.abs(middle), 1.0)
    off, lo, hi = step[0] - _exactly(np.roll(middle, -1, axis=0)), middle, middle
    for _ in range(TRIES):
        held = _krawczyk(middle, c, off, step[1], Intervals(lo, hi) - _exactly(middle))
        if ((lo < held.lo) & (held.hi < hi)).all():
            return _proved(proof, held, cycle)
        more = MORE * (held.hi - held.lo) + least
        lo, hi = np.minimum(held.lo - more, middle), np.maximum(held.hi + more, middle)
        if not np.isfinite([lo, hi]).all():
            break
        step = _stepped(proof, lo, hi, cycle)
        if isinstance(step, str):
            return step
    return "no box is found that Newton's operator contracts"


def _proved(proof: ProofOfMap, at: Intervals, cycle: Cycle) -> CycleOfMap | str:
    """Prove the sides, branches and slope of an orbit that lies in boxes; or say what is missing."""
    step = _stepped(proof, at.lo, at.hi, cycle)
    if isinstance(step, str):
        return step
    if any(
        ((at.lo[0] <= at.hi[k]) & (at.lo[k] <= at.hi[0])).all()
        for k in range(1, cycle.period)
        if cycle.period % k == 0 and cycle.side[k] == cycle.side[0]
    ):
        return "its period may be smaller"
    if not _within(proof.cells, at.lo[0], at.hi[0], int(cycle.side[0])):
        return "its box is not in the attracting cells"
    slope = _slope(step[1])
    return CycleOfMap(at.lo, at.hi, cycle.side, cycle.branches, *_ends(slope), _attracts(slope))


def _within(cells: CellSet, lo: Array, hi: Array, side: int) -> bool:
    """Whether the cells cover a box."""
    grid = cells.grid
    corners = grid.index(np.array([lo, hi]), side)
    if (corners < 0).any():
        return False
    first, last = np.transpose(grid.axes(corners, side))
    mine = cells.mask[grid.of_side(side)].reshape(grid.shape[side])
    return bool(mine[tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))].all())


def _candidates(proof: ProofOfMap) -> tuple[Cycles, list[str]]:
    """Find cycles in floats for the parameters in the middle, and say what was left out."""
    cells, middle = proof.cells, between(proof.map, proof.upper)
    if cells.grid.dimension > 1:
        return cycles(replace(proof.graph, map=middle), UP_TO, cells), []
    candidates = cycles_of(middle, cells.extents(), cells.grid.domain, UP_TO, most_words=MOST_WORDS)
    beyond = f"longer cycles: there are more than {MOST_WORDS} itineraries of one length"
    return candidates, [] if candidates.complete else [beyond]


def _cycles(proof: ProofOfMap, progress: Progress | None) -> tuple[Claim, tuple[CycleOfMap, ...]]:
    kind = kind_of(proof.map)
    if (len(kind.branches) > 1 and not kind.has_margin) or kind.dimension > 2 or not has_slope(proof.map):
        reason = "cycles need slopes, at most two dimensions, and `margin` where there are branches"
        return Claim("cycles", "undecided", reason, {}, final=True), ()
    candidates, missing = _candidates(proof) if len(proof.cells) else ((), [])
    proved: list[CycleOfMap] = []
    for number, cycle in enumerate(candidates):
        if progress is not None:
            progress("cycles", number, len(candidates))
        answer = _prove(proof, cycle)
        if isinstance(answer, CycleOfMap):
            proved.append(answer)
        else:
            missing.append(f"period {cycle.period} through {np.atleast_1d(cycle.x[0])}: {answer}")
    if not proved:
        reason = missing[0] if missing else f"none is found of period up to {UP_TO} in attracting cells"
        return Claim("cycles", "undecided", reason, {}), ()
    return Claim(
        "cycles", "proved", "", {"cycles": len(proved), "missing": missing, "complete": False}
    ), tuple(proved)


# ---------------------------------------------------------------- all together


PROVERS: dict[str, Callable[[ProofOfMap], Claim]] = {
    "attracts-all": _attracts_all,
    "ends-in": _ends_in,
    "expanding": _expanding,
    "invariant": _invariant,
    "basin": lambda proof: replace(_invariant(proof), claim="basin"),
    "trapping": lambda proof: replace(_invariant(proof), claim="trapping"),
}
CLAIMS_OF_MAP = (*PROVERS, "cycles")
"""What can be claimed of any map."""


def _require_provable(lower: Any) -> None:
    """Refuse maps whose boxes do not enclose the map that their orbits follow."""
    kind = kind_of(lower)
    for name in ("scattered", "on_side"):
        if type(lower) in getattr(kernels, name).methods:
            mine = type(lower).__module__.split(".")[0] != "limitsets"
            way = f"register the map without {name}" if mine else "pass the scene: limitsets.certify(scene)"
            allowed = "a map of image, image_on, margin or image_box alone"
            raise AnswerError("the map", f"{kind.name}, which has {name}", allowed, way)


@shown_in_notebooks
@arguments_checked_as("certify")
def certify_map(
    map: Any,  # noqa: A002  # the field's word
    grid: Grid | None = None,
    claims: Sequence[str] | None = None,
    *,
    upper: Any = None,
    ends: Any = None,
    starts: Any = None,
    progress: Progress | None = None,
) -> ProofOfMap:
    """Prove claims about the attracting cells of any map; called by `limitsets.certify`.

    Parameters
    ----------
    map : NamedTuple
        A map, or the lower corner of a box of its parameters.
    grid : Grid
        The cells; finer ones prove more.
    claims : sequence of str, optional
        Of `CLAIMS_OF_MAP`; default ("attracts-all",), or ("ends-in",) where `ends` are given.
    upper : NamedTuple, optional
        The upper corner of the parameters; default `map`.
    ends, starts : sequence of boxes, optional
        Of the claim "ends-in": every start in a box of `starts` (default: in all cells that are proved to lead there)
        ends in the boxes of `ends` and stays.  A box is a list of (lo, hi) per axis; a dict gives lists by side.
    progress : callable, optional
        Called with the step, how much of it is done, and of how much.

    Returns
    -------
    ProofOfMap

    Raises
    ------
    AnswerError
        For a word that is no claim of a map, a map with `scattered` or `on_side`, corners that differ in anything but
        numbers and arrays of numbers, or a thread that does not round to nearest.
    MapError
        For a map whose images cannot be enclosed: the line names the function and the way out.
    """
    begin = time.perf_counter()
    compiled_kind_of(map, "certify")
    wanted = tuple(dict.fromkeys(claims or (("attracts-all",) if ends is None else ("ends-in",))))
    for claim in wanted:
        if claim not in CLAIMS_OF_MAP:
            raise AnswerError("the claim about a map", claim, ", ".join(CLAIMS_OF_MAP), "correct the word")
    if grid is None:
        way = "limitsets.certify(map, limitsets.grid([(lo, hi)], cells=1024))"
        raise AnswerError("the grid", None, "the cells to prove the claims on", f"pass {way}")
    if (ends is None) is ("ends-in" in wanted) or (ends is not None and len(wanted) > 1):
        way = 'ask so: limitsets.certify(map, grid, ["ends-in"], ends=[[(lo, hi)]])'
        raise AnswerError("the claims", ", ".join(wanted), "ends-in by itself, with its boxes ends=", way)
    goal = None if ends is None else read_goal(ends, starts, grid.domain)
    guard()
    _require_provable(map)
    lower = coerce(map)
    upper = lower if upper is None else coerce(upper)
    if progress is not None:
        progress("transitions", 0, 1)
    graph = transitions(lower, grid, "boxes", upper=upper)
    proof = ProofOfMap(
        lower, upper, graph, component=components_of(graph)[0], claims=(), cycles=(), seconds=0.0, goal=goal
    )
    orbits: tuple[CycleOfMap, ...] = ()
    answers = []
    for word in wanted:
        if word == "cycles":
            answer, orbits = _cycles(proof, progress)
        else:
            answer = PROVERS[word](proof)
        answers.append(answer)
    return replace(proof, claims=tuple(answers), cycles=orbits, seconds=time.perf_counter() - begin)
