"""Claims about periodic orbits of any map: `cycles`, `all-cycles`, `converges`, and goals that a cycle refutes.

The proofs of one orbit stand in `orbits_of_map`, of all in `every_orbit`, the balls around one in `converging`.
"""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Any

import numpy as np

from limitsets.base import Progress
from limitsets.base.arrays import Array, Ints
from limitsets.proofs.prover.certificate_of_map import hexed, widened
from limitsets.proofs.prover.converging import Ball, cells_within, contracted_ball, settled_orbits
from limitsets.proofs.prover.every_orbit import every_orbit
from limitsets.proofs.prover.numbers import Intervals
from limitsets.proofs.prover.orbits_of_map import CycleOfMap, Lies, prove_orbit, slopes_of, slopes_on
from limitsets.proofs.prover.programs import names_alone
from limitsets.proofs.prover.proof import Claim, claimed, undecided
from limitsets.proofs.prover.proof_of_map import ProofOfMap, frames_of
from limitsets.systems.cells import CellSet, Grid
from limitsets.systems.maps import has_slope, kind_of
from limitsets.systems.maps.contract import between
from limitsets.systems.sets import Cycle, Cycles, cycles_of
from limitsets.systems.sets.periodic import cycles_near

# Largest period of the search for cycles.
UP_TO = 16

# Largest period of which all orbits are looked for: the checker reads cycles of so many points.
MOST_PERIOD = 200

# Itineraries of one length, and cycles in the plane, beyond which no longer cycles are looked for.
MOST_WORDS, MOST_CYCLES = 2000, 1000


def _within(cells: CellSet, lo: Array, hi: Array, side: Ints) -> bool:
    """Whether invariant cells cover the first box of an orbit, and so hold the orbit."""
    grid = cells.grid
    corners = grid.index(np.array([lo[0], hi[0]]), int(side[0]))
    if (corners < 0).any():
        return False
    first, last = np.transpose(grid.axes(corners, int(side[0])))
    mine = cells.mask[grid.of_side(int(side[0]))].reshape(grid.shape[int(side[0])])
    return bool(mine[tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))].all())


def every_cycle(
    proof: ProofOfMap, period: int, progress: Progress | None
) -> tuple[Claim, Claim, tuple[CycleOfMap, ...]]:
    """Prove the claims `all-cycles` and `cycles` of all orbits in the domain, and return these."""
    domain = proof.graph.grid.domain
    if not _decided(proof.map) or not has_slope(proof.map):
        reason = "it needs slopes, and `margin` where there are branches"
        return undecided("all-cycles", reason, final=True), undecided("cycles", reason, final=True), ()
    proved, missing = every_orbit((proof.map, proof.upper), domain, period, progress)
    boxes = np.stack([domain.lo, domain.hi], axis=-1)
    sides = [{"side": side, "box": hexed(box)} for side, box in enumerate(boxes)]
    section = {"period": period, "domain": sides}
    listed = {"cycles": len(proved), "missing": [], "complete": not missing}
    return (
        Claim("all-cycles", "undecided" if missing else "proved", missing, section),
        claimed("cycles", "" if proved else "none is proved", listed),
        tuple(proved),
    )


def _candidates(proof: ProofOfMap) -> tuple[Cycles, list[str]]:
    """Find cycles in floats for the parameters in the middle, and say what was left out."""
    cells, middle = proof.cells, between(proof.map, proof.upper)
    if cells.grid.dimension > 1 or cells.grid.domain.closes:
        candidates = cycles_near(middle, cells, UP_TO, most_cycles=MOST_CYCLES)
        longest = max((cycle.period for cycle in candidates), default=0)
        beyond = f"longer cycles: there are {len(candidates)} of periods up to {longest}"
        return candidates, [beyond] if len(candidates) > MOST_CYCLES else []
    candidates = cycles_of(middle, cells.extents(), cells.grid.domain, UP_TO, most_words=MOST_WORDS)
    beyond = f"longer cycles: there are more than {MOST_WORDS} itineraries of one length"
    return candidates, [] if candidates.complete else [beyond]


def _prove(proof: ProofOfMap, cycle: Cycle, lies: Lies) -> CycleOfMap | str:
    """Prove an orbit near one that floats give, off the seams of axes that close; or say what is missing."""
    domain = proof.graph.grid.domain
    answer = prove_orbit((proof.map, proof.upper), cycle, lies, domain.period)
    if isinstance(answer, str) or not domain.closes:
        return answer
    lo, hi = widened(answer.lo, answer.hi)
    beyond = (lo <= domain.lo[cycle.side]) | (hi >= domain.hi[cycle.side])
    return (
        "it meets the seam of an axis: begin the domain elsewhere"
        if (beyond & domain.periodic).any()
        else answer
    )


NO_CYCLES = "cycles need slopes, at most two dimensions, and `margin` where there are branches"


def _decided(lower: Any) -> bool:
    """Whether it is known on a box which formula the map takes."""
    kind = kind_of(lower)
    return len(kind.branches) == 1 or kind.has_margin or names_alone(lower)


def _has_cycles(lower: Any) -> bool:
    """Whether cycles of a map can be proved."""
    return kind_of(lower).dimension <= 2 and has_slope(lower) and _decided(lower)


def cycles_claim(proof: ProofOfMap, progress: Progress | None) -> tuple[Claim, tuple[CycleOfMap, ...]]:
    """Prove the orbits that floats find in the attracting cells, and return these."""
    if not _has_cycles(proof.map):
        return undecided("cycles", NO_CYCLES, final=True), ()
    candidates, missing = _candidates(proof) if len(proof.cells) else ((), [])
    proved: list[CycleOfMap] = []
    for number, cycle in enumerate(candidates):
        if progress is not None:
            progress("cycles", number, len(candidates))
        answer = _prove(proof, cycle, functools.partial(_within, proof.cells))
        if isinstance(answer, CycleOfMap):
            proved.append(answer)
        else:
            missing.append(f"period {cycle.period} through {np.atleast_1d(cycle.x[0])}: {answer}")
    none = [*missing, f"none is found of period up to {UP_TO} in attracting cells"][0]
    section = {"cycles": len(proved), "missing": missing, "complete": False}
    return claimed("cycles", "" if proved else none, section), tuple(proved)


# ---------------------------------------------------------------- cycles that attract, and what tends to them


# Orbits that are followed until they are at a cycle.
ORBITS = 256


def _attracting(proof: ProofOfMap, starts: tuple[Array, Ints]) -> tuple[tuple[CycleOfMap, ...], list[str]]:
    """Prove the cycles to which orbits from some starts come, for the parameters in the middle; and what is missing."""
    proved, missing = [], []
    for cycle in settled_orbits(between(proof.map, proof.upper), *starts, proof.graph.grid.domain):
        answer = _prove(proof, cycle, lambda *_: True)
        if isinstance(answer, CycleOfMap) and answer.attracts:
            proved.append(answer)
        else:
            why = answer if isinstance(answer, str) else "that it attracts is not proved"
            missing.append(f"period {cycle.period} through {cycle.x[0]}: {why}")
    return tuple(proved), missing


def _spread(grid: Grid) -> tuple[Array, Ints]:
    """Middles of cells spread over the domain, and their sides."""
    numbers = np.unique(np.linspace(0, grid.n_cells - 1, ORBITS).astype(np.int64))
    lo, hi, sides = grid.corners(numbers)
    return 0.5 * (lo + hi), sides


def converging_claim(proof: ProofOfMap) -> tuple[ProofOfMap, Claim]:
    """Draw balls around the cycles that attract, and find the cells in them."""
    if not _has_cycles(proof.map):
        return proof, undecided("converges", NO_CYCLES, final=True)
    grid = proof.graph.grid
    orbits, missing = proof.cycles, list[str]()
    if not orbits:
        orbits, missing = _attracting(proof, _spread(grid))
    final, drawn, chosen = np.full(grid.n_cells, -1, np.int32), 0, []
    for cycle in orbits:
        ball, why = _ball(proof, cycle) if cycle.attracts else (None, "")
        if ball is not None:
            mine = cells_within(grid, ball, *widened(cycle.lo, cycle.hi), cycle.side) & (final < 0)
            if mine.any():
                final[mine], drawn = drawn, drawn + 1
            else:
                ball, why = None, "no cell lies in the balls that are contracted: take finer cells there"
        chosen.append(replace(cycle, ball=ball))
        # what attracts and has no ball tells more than an orbit that ended on a saddle
        missing[:0] = [f"period {cycle.period} through {cycle.lo[0]}: {why}"] if why else []
    if not drawn:
        return proof, undecided("converges", [*missing, "no cycle that attracts is found"][0])
    claim = claimed("converges", "", {"cycles": drawn, "missing": missing})
    return replace(proof, cycles=tuple(chosen), final=final), claim


def _ball(proof: ProofOfMap, cycle: CycleOfMap) -> tuple[Ball | None, str]:
    """Find balls around a cycle, in the domain and the ends; or say what is missing."""
    domain, boxes = proof.graph.grid.domain, widened(cycle.lo, cycle.hi)

    def slopes(lo: Array, hi: Array) -> Intervals | None:
        beyond = (lo < domain.lo[cycle.side]).any() or (hi > domain.hi[cycle.side]).any()
        if beyond or (proof.goal is not None and not proof.goal.within(lo, hi, cycle.side).all()):
            return None
        return slopes_on((proof.map, proof.upper), lo, hi, cycle)

    extent = float((domain.hi - domain.lo).max())
    ball = contracted_ball(*boxes, slopes_of((proof.map, proof.upper), cycle), slopes, extent)
    where = "the domain" if proof.goal is None else "the domain and the ends"
    return ball, "" if ball is not None else f"no balls around it in {where} are contracted"


def refuted_by_cycle(proof: ProofOfMap) -> ProofOfMap:
    """Look for a cycle that attracts, begins inside the starts and leaves the ends: then the goal is refuted."""
    goal = proof.goal
    if goal is None or goal.starts is None or not _has_cycles(proof.map):
        return proof
    for cycle in _attracting(proof, goal.spread(ORBITS))[0]:
        leaves = goal.is_left_by(*widened(cycle.lo, cycle.hi), cycle.side)
        if leaves and frames_of((proof.map, proof.upper), cycle) is not None:
            why = f"a cycle of period {cycle.period} attracts: {leaves}"
            claims = (
                Claim(each.claim, "refuted", why, {})
                if each.claim == "ends-in"
                else Claim(each.claim, "undecided", "not asked further, for ends-in is refuted", {})
                for each in proof.claims
            )
            return replace(proof, claims=tuple(claims), cycles=(cycle,), final=None)
    return proof
