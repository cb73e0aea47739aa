"""The limit set of a scene by every method there is: Hausdorff error against seconds.

The reference follows the critical orbits at 50 digits: each end is a forward image of the one-sided limit at a critical
point.  Which images they are is read off the answer in doubles; what they are is computed anew.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from accuracy_points import Point, timed
from accuracy_throw import Facts, facts_of, in_digits, jog, margin
from mpmath import mp, mpf

import limitsets as ls
from limitsets.proofs.prover.attraction import attraction
from limitsets.proofs.prover.cover import cover
from limitsets.proofs.prover.end_points import proved_ends
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.systems.cells import CellSet, Grid

__all__ = ["BORDERS", "CRITICAL", "ORBIT", "PROVED", "distance", "reference", "set_errors"]

Extents = dict[int, list[tuple[float, float]]]

DIGITS = 50
CELLS = [2**k for k in range(11, 20)]  # fewer show thousands of sets that are not there
THROWS = [10**k for k in range(3, 8)]
ORBIT, BORDERS = "one long orbit", "border cells refined"
CRITICAL, PROVED = "end points by critical orbits", "end points, proved"


def reference(scene: Any) -> dict[int, list[tuple[Any, Any]]]:
    """Compute the ends of the one limit set of a scene at 50 digits."""
    graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))
    rough = ls.limit_set(graph, ls.attractors(graph)[0])
    critical: dict[tuple[int, float], Any] = {}
    found: dict[int, list[Any]] = {}
    with mp.workdps(DIGITS + 10):
        facts = [facts_of(scene.map, side, mpf) for side in range(len(scene.sides))]
        for end in rough.ends:
            side, start = end.origin.side, end.origin.x
            if (side, start) not in critical:
                near = mpf(start)
                critical[side, start] = mp.findroot(partial(_decide, facts[side]), (near, near + mpf("1e-9")))
            x = critical[side, start]
            for branch in end.origin.branches:
                x = jog(facts[side], x, in_digits(facts[side], x), mp.sin, mp.cos)
                if branch == "flip":
                    after = (side + 1) % len(facts)
                    x -= facts[side].a + mpf(float(scene.map.length[after])) - facts[after].a
                    side = after
            if abs(x - mpf(end.x)) > mpf("1e-9") or side != end.side:
                raise ArithmeticError(
                    f"the itinerary of {end.x} on side {end.side} leads to {x} on side {side}"
                )
            found.setdefault(side, []).append(x)
    return {side: list(zip(ends[::2], ends[1::2], strict=True)) for side, ends in sorted(found.items())}


def _decide(p: Facts, x: Any) -> Any:
    return margin(p, x, in_digits(p, x), mp.sin, mp.cos, mp.sqrt)


# ---------------------------------------------------------------- distances


def _one_way(some: Any, others: Any) -> Any:
    """Largest distance of a point of `some` from `others`: at an end, or in the middle of a gap."""
    lo, hi = np.array([pair[0] for pair in others]), np.array([pair[1] for pair in others])
    gaps = 0.5 * (hi[:-1] + lo[1:])
    bottom, top = np.array([pair[0] for pair in some]), np.array([pair[1] for pair in some])
    inside = [g for g in gaps.tolist() if ((bottom < g) & (g < top)).any()]
    x = np.concatenate([bottom, top, inside])
    k = np.clip(np.searchsorted(lo, x, side="right") - 1, 0, lo.size - 1)
    off = np.maximum(np.maximum(lo[k] - x, x - hi[k]), 0.0)
    after = np.clip(k + 1, 0, lo.size - 1)
    return np.minimum(off, np.maximum(np.maximum(lo[after] - x, x - hi[after]), 0.0)).max()


def distance(extents: Extents, exact: Extents) -> float:
    """Hausdorff distance of two unions of intervals per side; the arm's length where a side is missing."""
    if set(extents) != set(exact):
        return 28.0
    pairs = [(a[side], b[side]) for a, b in ((extents, exact), (exact, extents)) for side in a]
    return float(max(_one_way(some, others) for some, others in pairs))


def _of_ends(extents: Extents, exact: Any) -> float:
    """Largest error of an end, in 50 digits, where the intervals are as many."""
    if {side: len(parts) for side, parts in extents.items()} != {s: len(parts) for s, parts in exact.items()}:
        return distance(extents, {s: [(float(a), float(b)) for a, b in parts] for s, parts in exact.items()})
    with mp.workdps(DIGITS):
        return float(
            max(
                abs(mpf(x) - y)
                for side, parts in extents.items()
                for pair, known in zip(parts, exact[side], strict=True)
                for x, y in zip(pair, known, strict=True)
            )
        )


# ---------------------------------------------------------------- methods


def _attracting(graph: Any) -> CellSet:
    """All attracting cells."""
    mask = np.zeros(graph.n_cells, dtype=bool)
    for cells, ends in zip(graph.recurrent_components(), graph.condensation().attracting, strict=True):
        mask[cells] |= ends
    return CellSet(graph.grid, mask)


def by_cells(scene: Any, cells: int, method: str, grading: str) -> Extents:
    """Extents of the attracting cells."""
    grid = ls.grid(scene.domain, cells=cells, grading=grading)
    return _attracting(ls.transitions(scene.map, grid, method)).extents()


def by_borders(scene: Any, rounds: int, parts: int = 8) -> Extents:
    """Extents of attracting cells, of which only those at a border are cut finer, round after round.

    An end is the image of another end or of a critical point, where cells are cut anyway: nothing else need be fine.
    """
    grid = ls.grid(scene.domain, cells=2048)
    for k in range(rounds + 1):
        graph = ls.transitions(scene.map, grid)
        inside = _attracting(graph)
        if k < rounds:
            grid = Grid(grid.domain, tuple(_cut(grid, inside, side, parts) for side in range(grid.sides)))
    return inside.extents()


def _cut(grid: Grid, inside: CellSet, side: int, parts: int) -> tuple[Any]:
    edges, mask = grid.edges[side][0], inside.mask[grid.of_side(side)]
    bounded = np.concatenate([[False], mask, [False]])
    border = np.flatnonzero(mask & ~(bounded[:-2] & bounded[2:]))
    weight = np.arange(1, parts) / parts
    new = edges[border, None] + weight * (edges[border + 1] - edges[border])[:, None]
    return (np.unique(np.concatenate([edges, new.ravel()])),)


def by_orbit(scene: Any, throws: int, exact: Extents) -> float:
    """Hausdorff distance of the states of one orbit from the limit set."""
    path = ls.orbit(scene.map, 15.0, 2, throws + 1000)
    x, on = path.x[1000:], path.side[1000:]
    worst = 0.0
    for side, parts in exact.items():
        here = np.sort(x[on == side])
        for lo, hi in parts:
            seen = here[(here >= lo - 1e-9) & (here <= hi + 1e-9)]
            if not seen.size:
                return hi - lo
            worst = max(worst, seen[0] - lo, hi - seen[-1], 0.5 * np.diff(seen).max(initial=0.0))
    return float(worst)


def set_errors(scene: Any, exact: Any, quick: bool = False) -> list[Point]:
    """Hausdorff errors of all methods."""
    known = {side: [(float(lo), float(hi)) for lo, hi in parts] for side, parts in exact.items()}
    sizes = CELLS[:5] if quick else CELLS
    least = 0.01 if quick else 0.5
    rows = [
        ("cells, end points of cells", "end-points", "graded"),
        ("the same, equal cells", "end-points", "uniform"),
        ("cells, padded corners", "corners-padded", "graded"),
        ("cells, corners", "corners", "graded"),
        ("cells, proved boxes", "boxes", "graded"),
    ]
    points = []
    for name, method, grading in rows:
        for cells in sizes:
            found, seconds = timed(partial(by_cells, scene, cells, method, grading), least, 10)
            points.append(Point(name, cells, distance(found, known), seconds))
    for rounds in range(0, 9 if quick else 25, 4):
        found, seconds = timed(partial(by_borders, scene, rounds), least, 10)
        points.append(Point(BORDERS, 8.0**rounds, _of_ends(found, exact), seconds))
    for throws in THROWS[:3] if quick else THROWS:
        error, seconds = timed(partial(by_orbit, scene, throws, known), least, 5)
        points.append(Point(ORBIT, throws, error, seconds))
    for tolerance in (1e-2, 1e-12):
        found, seconds = timed(partial(_critical, scene, tolerance), least, 10)
        points.append(Point(CRITICAL, 1.0 / tolerance, _of_ends(found.extents, exact), seconds))

    def proved() -> Any:
        return proved_ends(attraction(cover(parameter_box(scene), 2048)))

    ends, seconds = timed(proved, least, 10)
    points.append(Point(PROVED, 2048, ends.width, seconds))
    return points


def _critical(scene: Any, tolerance: float) -> Any:
    graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=2048))
    inside = _attracting(graph)
    return ls.limit_set(graph, _Cells(inside.extents()), tolerance)


class _Cells:
    """Attracting cells without the orbit that `attractors` counts on."""

    def __init__(self, extents: Extents) -> None:
        self.extents = extents
