"""Proofs about any map on a grid: what the enclosed images of the cells imply, and periodic orbits.

*Invariant*: no image of an attracting component meets a cell outside.
*Trapping*: besides, no image reaches the border of the domain; cells are closed, so the images lie in the interior of
the component.
*Attracts all*: the components are invariant, no image leaves the domain, and every recurrent component attracts, or
orbits pass through: its cells, cut finer, do not recur.  Then the rank of a cell, the longest path to an attracting
cell, falls along every orbit outside, but for the stays where orbits pass, which are bounded.
*Basin*: orbits from the cells all of whose paths end in attracting cells enter these, and stay.
*Ends in*: the cells of some boxes from which no path leaves these boxes are mapped into each other; from the cells with
the starts every path leads there.
*Escapes*: every path from the cells that are counted leads out of the domain (`leaving_of_map`).
*Almost every*, in one dimension: the starts that stay in cells without a rank thin out (there too).
*Expanding*, in one dimension: |dx'/dx| > 1 on every attracting cell, on every branch that is possible there; refuted
where it is below 1 on all of them.
*Cycles*: `limitsets.proofs.prover.orbits_of_map`; *all cycles*: `limitsets.proofs.prover.every_orbit`.

For two corners of parameters all of it holds for each of the maps between.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from limitsets.base import (
    AnswerError,
    Progress,
    arguments_checked_as,
    shown_in_notebooks,
)
from limitsets.base.arrays import Ints
from limitsets.numbers.interval import guard
from limitsets.proofs.prover.attraction import components_of, no_cells
from limitsets.proofs.prover.cycles_of_map import (
    MOST_PERIOD,
    converging_claim,
    cycles_claim,
    every_cycle,
    refuted_by_cycle,
)
from limitsets.proofs.prover.goal_of_map import missing, read_goal
from limitsets.proofs.prover.proof import Claim, claimed, undecided
from limitsets.proofs.prover.proof_of_map import ProofOfMap
from limitsets.systems.cells import CellSet, Grid
from limitsets.systems.graph import transitions
from limitsets.systems.graph.components import ranks
from limitsets.systems.maps import coerce, has_slope, kernels, kind_of
from limitsets.systems.maps.contract import compiled_kind_of
from limitsets.systems.maps.derived import NEVER, UNKNOWN, BranchBoxes, branch_boxes
from limitsets.systems.sets.basin import longest_stays

# ---------------------------------------------------------------- claims about cells


def _place(grid: Grid, cell: int) -> str:
    """Name a cell for people."""
    side = int(grid.side_of(np.array([cell]))[0])
    lo, hi = (corner[0] for corner in grid.boxes(np.array([cell]), side))
    spans = ", ".join(f"[{a:.6g}, {b:.6g}]" for a, b in zip(lo, hi, strict=True))
    return f"side {side}, x in {spans}" if grid.sides > 1 else f"x in {spans}"


def _boxes(proof: ProofOfMap) -> Iterator[tuple[Ints, BranchBoxes]]:
    """Give the attracting cells by side and branch, with their images and slopes."""
    grid, numbers = proof.graph.grid, proof.cells.numbers()
    sides, branches = grid.side_of(numbers), range(len(kind_of(proof.map).branches))
    for side, branch in itertools.product(np.unique(sides).tolist(), branches):
        mine = numbers[sides == side]
        yield mine, branch_boxes(proof.map, proof.upper, side, branch, *grid.boxes(mine, side))


def _trapping(proof: ProofOfMap) -> Claim:
    """Prove that images lie in the interior of the cells: not on the border of the domain either."""
    grid, numbers = proof.graph.grid, proof.cells.numbers()
    domain, (lo, hi, sides) = grid.domain, grid.corners(numbers)
    ends = ~np.array(domain.periodic)
    at_border = ((lo <= domain.lo[sides]) | (hi >= domain.hi[sides]))[:, ends].any()
    for mine, boxes in _boxes(proof) if at_border and has_slope(proof.map) else ():
        inside = (boxes.lo > domain.lo[boxes.side]) & (boxes.hi < domain.hi[boxes.side])
        reaching = np.flatnonzero(~inside[:, ends].all(axis=1) & (boxes.state != NEVER))
        if reaching.size:
            where = f"the image of {_place(grid, int(mine[reaching[0]]))} may reach the border of the domain"
            reason = f"{where}: widen the domain, or claim invariant"
            return undecided("trapping", reason, final=True)
    return claimed("trapping", no_cells(proof.component))


def _ends_in(proof: ProofOfMap) -> Claim:
    assert proof.goal is not None
    return claimed("ends-in", missing(proof.goal, proof.graph.grid, proof.arrays))


def _attracts_all(proof: ProofOfMap) -> Claim:
    graph, attracting = proof.graph, proof.component >= 0
    sets, parts = graph.recurrent_components(), graph.components()
    leaving = np.flatnonzero(graph.ranges.exits)
    attracts = np.array([attracting[cells[0]] for cells in sets], dtype=bool)
    if leaving.size:
        place = _place(graph.grid, int(leaving[0]))
        return undecided("attracts-all", f"the image of {place} may leave the domain, or is not enclosed")
    if no_cells(proof.component):
        return claimed("attracts-all", no_cells(proof.component))
    stays = np.zeros(len(sets), np.int64) if attracts.all() else longest_stays(graph)
    lost = np.concatenate(
        [
            np.zeros(0, np.int64),
            *(cells for cells, good in zip(sets, attracts | (stays > 0), strict=True) if not good),
        ]
    )
    if lost.size:
        place = _place(graph.grid, int(lost.min()))
        return undecided("attracts-all", f"{lost.size} recurrent cells do not attract: first {place}")
    settled = np.zeros(parts.count, dtype=bool)
    settled[np.flatnonzero(parts.recurrent)[attracts]] = True
    # a rank falls with every step, but for those within a recurrent component, through which orbits pass
    most = int(ranks(graph.ranges, parts, settled).max()) + int((stays[stays > 0] - 1).sum())
    return claimed("attracts-all", "", {"max_rank": most})


def _escapes(proof: ProofOfMap) -> Claim:
    out = CellSet(proof.graph.grid, proof.exits >= 0)
    share = out.measure() / float(proof.graph.grid.measure.sum())
    none = "" if len(out) else "no cell is found all of whose starts leave the domain"
    return claimed("escapes", none, {"steps": int(proof.exits.max()) + 1, "share": share})


def _almost_every(proof: ProofOfMap) -> Claim:
    if proof.graph.grid.dimension != 1:
        return undecided("almost-every", "that starts thin out is proved in one dimension only", final=True)
    return claimed("almost-every", proof.weights if isinstance(proof.weights, str) else "")


def _expanding(proof: ProofOfMap) -> Claim:
    grid = proof.graph.grid
    if grid.dimension != 1:
        return undecided("expanding", "expansion is proved in one dimension only", final=True)
    if no_cells(proof.component):
        return claimed("expanding", no_cells(proof.component))
    least, most, place = np.inf, 0.0, ""
    for mine, boxes in _boxes(proof):
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
    slow = "" if least > 1.0 else f"slope {least:.6g} at {place}"
    return claimed("expanding", slow, {"least_slope": least.hex()})


# ---------------------------------------------------------------- the same claim between other corners


def proved_again(proof: ProofOfMap, lower: Any, upper: Any) -> ProofOfMap:
    """Ask "ends-in" between other corners, on the cells of a proof; its graph is left as it was."""
    other = replace(proof, map=lower, upper=upper, cycles=())
    return replace(other, claims=(_ends_in(other),))


def refuted_again(proof: ProofOfMap, lower: Any, upper: Any) -> ProofOfMap:
    """Look for what refutes "ends-in" between other corners."""
    open_ = undecided("ends-in", "no cycle is found that refutes it")
    return refuted_by_cycle(replace(proof, map=lower, upper=upper, claims=(open_,), cycles=()))


# ---------------------------------------------------------------- all together


def _with_final(proof: ProofOfMap, claim: str) -> Claim:
    """Prove a claim about all starts where some cells are final, from the labels of the certificate."""
    grid, rank = proof.graph.grid, proof.arrays["rank"]
    lost = np.flatnonzero(rank < 0)
    if claim == "attracts-all" and lost.size:
        place = _place(grid, int(lost[0]))
        return undecided(claim, f"{lost.size} cells may not lead to attracting cells: first {place}")
    return claimed(claim, "", {"max_rank": int(rank.max())} if claim == "attracts-all" else {})


PROVERS: dict[str, Callable[[ProofOfMap], Claim]] = {
    "almost-every": _almost_every,
    "attracts-all": _attracts_all,
    "ends-in": _ends_in,
    "escapes": _escapes,
    "expanding": _expanding,
    "invariant": lambda proof: claimed("invariant", no_cells(proof.component)),
    "basin": lambda proof: claimed("basin", no_cells(proof.component)),
    "trapping": _trapping,
}
CLAIMS_OF_MAP = (*PROVERS, "cycles", "all-cycles", "converges")
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


def _wanted(claims: Sequence[str] | None, ends: Any, starts: Any, period: int | None) -> tuple[str, ...]:
    """Return what is claimed, by default what the other arguments are for; refuse those without their claim."""
    usual = "ends-in" if ends is not None else "attracts-all" if period is None else "all-cycles"
    wanted = tuple(dict.fromkeys(claims or (usual,)))
    for claim in wanted:
        if claim not in CLAIMS_OF_MAP:
            raise AnswerError("the claim about a map", claim, ", ".join(CLAIMS_OF_MAP), "correct the word")
    beside = set(wanted) - {"ends-in", "converges", "cycles"}
    if (ends is None) is ("ends-in" in wanted) or (ends is not None and beside) or (ends is None and starts):
        way = 'ask so: limitsets.certify(map, grid, ["ends-in"], ends=[[(lo, hi)]])'
        allowed = "ends-in by itself, or with converges and cycles, and its boxes ends="
        raise AnswerError("the claims", ", ".join(wanted), allowed, way)
    beside = {"invariant", "trapping", "expanding"} & set(wanted)
    if "converges" in wanted and beside:
        allowed = "cycles, basin, attracts-all, ends-in, escapes and almost-every beside converges"
        raise AnswerError(
            "the claims", ", ".join(wanted), allowed, f"prove {min(beside)} in a call of its own"
        )
    if ("all-cycles" in wanted and period is None) or (
        period is not None and ("all-cycles" not in wanted or not 1 <= period <= MOST_PERIOD)
    ):
        way = 'ask so: limitsets.certify(map, grid, ["all-cycles"], period=8)'
        raise AnswerError("the period", period, f"1 to {MOST_PERIOD}, with the claim all-cycles", way)
    return wanted


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
    period: int | None = None,
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
        Of `CLAIMS_OF_MAP`; default ("attracts-all",), or ("ends-in",) and ("all-cycles",) where `ends` or a `period`
        are given.
    upper : NamedTuple, optional
        The upper corner of the parameters; default `map`.
    ends, starts : sequence of boxes, optional
        Of the claim "ends-in": every start in a box of `starts` (default: in all cells that are proved to lead there)
        ends in the boxes of `ends` and stays.  A box is a list of (lo, hi) per axis; a dict gives lists by side.
    period : int, optional
        Of the claim "all-cycles": every orbit of a period up to this one that lies in the domain is proved and listed.
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
    wanted = _wanted(claims, ends, starts, period)
    if grid is None:
        way = "limitsets.certify(map, limitsets.grid([(lo, hi)], cells=1024))"
        raise AnswerError("the grid", None, "the cells to prove the claims on", f"pass {way}")
    if "all-cycles" in wanted:  # its tubes have no number of turns for each step
        grid.domain.require_ends("the grid of all-cycles, which would have to try all turns of each step")
    if {"escapes", "almost-every"} & set(wanted):
        grid.domain.require_ends("the grid of the claims escapes and almost-every")
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
    known: dict[str, Claim] = {}
    if period is not None:
        known["all-cycles"], known["cycles"], orbits = every_cycle(proof, period, progress)
        proof = replace(proof, cycles=orbits)
    elif "cycles" in wanted:
        known["cycles"], orbits = cycles_claim(proof, progress)
        proof = replace(proof, cycles=orbits)
    if "converges" in wanted:
        proof, known["converges"] = converging_claim(proof)
    for word in wanted:
        if word not in known:
            final = proof.final is not None and word in ("basin", "attracts-all")
            known[word] = _with_final(proof, word) if final else PROVERS[word](proof)
    proof = replace(proof, claims=tuple(known[word] for word in wanted))
    if "ends-in" in known and known["ends-in"].verdict != "proved":
        proof = refuted_by_cycle(proof)
    return replace(proof, seconds=time.perf_counter() - begin)
