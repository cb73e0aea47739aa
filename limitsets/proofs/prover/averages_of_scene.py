"""Averages along almost every orbit of the throw: cells, and what the search needs of them."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from limitsets.base import Progress, silent
from limitsets.base.arrays import Mask
from limitsets.feeder.scene import Scene
from limitsets.feeder.scene.units import convert, parse
from limitsets.proofs.prover.attraction import Attraction, attraction, no_cells
from limitsets.proofs.prover.average_search import NO_WEIGHTS
from limitsets.proofs.prover.average_steps import Branch, bends_of, values_of
from limitsets.proofs.prover.averages import Average, confirmed
from limitsets.proofs.prover.averages_of_map import cut_at_changes, graded, ways_of
from limitsets.proofs.prover.cover import cover, cover_on, targets
from limitsets.proofs.prover.observables import FLIP, JOG, OF_THROWS, Asked, Subject, asked_for
from limitsets.proofs.prover.parameters import ParameterBox, parameter_box, scattered
from limitsets.proofs.prover.proof import Claim, Proof, undecided
from limitsets.systems.cells import Grid
from limitsets.systems.maps import along

# Cells per side on which the attracting cells are found, in turn; and cells of these, until there are weights.
FIRST = (2048, 8192, 32768)
CELLS = (8192, 32768, 131072)
# What the checker knows of ends of images, as a share of their size.
KNOWN = 2.0**-48


class Nothing(NamedTuple):
    """The parameters of a function that is averaged over throws: none."""


def fine_cells(attractors: Attraction, cells: int, jumps: Sequence[tuple[int, float]] = ()) -> Grid:
    """Cut the attracting cells evenly, into so many, and at jumps, a side and x; around them they stay as they are.

    Towards a change of branch cells become smaller: over a cell the decision is known to a share of its width.
    """
    grid, kept = attractors.cover.grid, attractors.cells.extents()
    whole = sum(hi - lo for bands in kept.values() for lo, hi in bands)
    sides = []
    for side, (edges,) in enumerate(grid.edges):
        for lo, hi in kept.get(side, []):
            evenly = np.linspace(lo, hi, 1 + max(1, round(cells * (hi - lo) / whole)))
            edges = np.union1d(edges[(edges <= lo) | (hi <= edges)], evenly)
        sides.append((edges,))
    box = attractors.cover.box
    cut = cut_at_changes(*box.bare, Grid(grid.domain, tuple(sides)), jumps)
    return Grid(grid.domain, tuple((graded(edges),) for (edges,) in cut.edges))


def branches_of(
    attractors: Attraction, asked: Asked, own: Mask, open_cells: Mask, wider: float
) -> Iterator[Branch]:
    """Give what the search needs of a component."""
    covered = attractors.cover
    grid, params, led = covered.grid, covered.box.lo, [targets(covered, branch) for branch in (JOG, FLIP)]
    for side, branch in np.ndindex(grid.sides, len(led)):
        cells, to, after_side = grid.of_side(side), led[branch], (side + branch) % grid.sides
        mine = cells.start + np.flatnonzero(own[cells] & (to[cells, 0] >= 0))
        if not mine.size:
            continue
        lo, hi = (ends[:, 0] for ends in grid.boxes(mine, side))
        places, first = (lo, 0.5 * (lo + hi), hi), int(grid.offset[after_side])
        thrown = [along(params, x, side, [branch]) for x in places]
        after, slopes = (np.array([each[k] for each in thrown]) for k in (0, 2))
        one_sign = (slopes > 0.0).all(axis=0) | (slopes < 0.0).all(axis=0)
        least = np.where(one_sign, np.abs(slopes).min(axis=0), 0.0)
        bend = bends_of(hi - lo, least, slopes, wider)
        way, both = np.zeros(mine.size, np.int64), open_cells[mine]
        if both.any():
            way[both] = ways_of(params, grid, mine[both], side, branch)
        # between the three places the slope falls by half of what it changes over a cell, and a little
        falls = 0.6 * (hi - lo) * bend * least
        yield Branch(
            mine, way, least * (1.0 - falls), bend, off=KNOWN * np.abs(after).max(axis=0),
            values=values_of([each.values for each in asked.functions], places, slopes, (side, branch)),
            ends=np.sort(after[::2], axis=0), covered=to[mine].T.astype(np.int64) - first,
            first=first, edges=grid.edges[after_side][0],
        )  # fmt: skip


def attracting(box: ParameterBox, tell: Progress) -> Attraction:
    """Find cells that attract, on finer cells where there are none."""
    for step, cells in enumerate(FIRST):
        tell(f"attracting cells, {cells} a side", step, len(FIRST))
        attractors = attraction(cover(box, cells))
        if not no_cells(attractors.component):
            break
    return attractors


def unfit(scene: Scene, attractors: Attraction, what: str) -> str:
    """Say why what averages take cannot be proved of a scene; "" where it can."""
    if attractors.cover.box.effects or scattered(scene):
        beyond = "effects beyond the minimal model" if attractors.cover.box.effects else "a spread"
        return f"{what} with {beyond} cannot be proved in this version"
    if no_cells(attractors.component):
        return f"{no_cells(attractors.component)}; `limitsets check` says what is unusual of a scene"
    return ""


def _averages(attractors: Attraction, asked: Asked, answer: Callable[[Average], Proof]) -> Average | str:
    """Find averages that the checker confirms; or say what is missing."""
    covered = attractors.cover
    open_cells = (targets(covered, JOG)[:, 0] >= 0) & (targets(covered, FLIP)[:, 0] >= 0)
    own = functools.partial(branches_of, attractors, asked)
    return confirmed(covered.grid, attractors.component, open_cells, own, asked, answer)


def _with_averages(scene: Scene, attractors: Attraction, begin: float, average: Average) -> Proof:
    claims = Claim("invariant", "proved", "", {}), Claim("average", "proved", "", average.section)
    return Proof(scene, {}, {}, (attractors,), claims, seconds=time.perf_counter() - begin, average=average)


def _length(scene: Scene, end: Any) -> float:
    """Read the end of a range: a number in the scene's unit, or a text with a unit."""
    if not isinstance(end, str):
        return float(end)
    return convert(parse(end, "length", key="of"), scene.unit)


def averages_of_scene(scene: Scene, of: Any, cells: int | None, progress: Progress | None) -> Proof:
    """Prove between which numbers averages of a scene lie, as the checker confirms them; the claim `average`."""
    begin, tell = time.perf_counter(), progress or silent
    box = parameter_box(scene)
    attractors = attracting(box, tell)

    def left(reason: str) -> Proof:
        claims = (undecided("average", reason, final=True),)
        return Proof(scene, {}, {}, (attractors,), claims, time.perf_counter() - begin)

    sides = sorted(side for side, bands in attractors.cells.extents().items() if bands)
    words = ["lyapunov", *OF_THROWS] if of is None else of
    rests = np.flatnonzero(box.rests).tolist()
    places = {side: (float(box.lo.a[side]), scene.arm_length) for side in rests}
    asked = asked_for(words, Subject(Nothing(), places, functools.partial(_length, scene), sides or rests))
    if reason := unfit(scene, attractors, "averages"):
        instead = "limitsets.robust.long_run_averages proves exponent, flips and shares of sides where laws are uniform"
        if box.effects:
            instead = "limitsets.analyse samples them"
        return left(reason if no_cells(attractors.component) else f"{reason}; {instead}")
    ladder, reason = (cells,) if cells else CELLS, NO_WEIGHTS
    for step, count in enumerate(ladder):
        tell(f"{count} cells", step, len(ladder))
        cut = attraction(cover_on(box, fine_cells(attractors, count, asked.jumps)))
        answer = functools.partial(_with_averages, scene, cut, begin)
        average = _averages(cut, asked, answer)
        if isinstance(average, Average):
            return answer(average)
        reason = average
        if NO_WEIGHTS not in reason:
            break
    return left(reason)
