"""The claims of a file about a map: each is checked for all parameters of its box.

docs/certificates.md, "Certificates of any map".
"""

import itertools
from typing import Any

import numpy as np

from .any_map import Map
from .balls import Array
from .cells import Crew
from .map_cells import MapCells, check_map_task, map_tasks, prepare_map
from .map_cycles import Cycle
from .map_file import OF_ORBITS, Goal, MapFile, Part, Regions
from .map_orbits import check_every
from .map_weights import check_weights
from .map_words import Outcome, box_in_words, outcome_of


def check_part(part: Part, number: int, file: MapFile, crew: Crew) -> tuple[dict[str, str], list[Cycle]]:
    """Check all claims of a box of parameters: those that fail with the reasons; and its cycles."""
    the_map = Map(file.shape, part.parameters)
    cycles = [Cycle(the_map, listed, part.begins) for listed in part.cycles]
    bad = check_cycles(cycles)
    # without the cycles it is not known which cells are final, hence nothing about the others
    resting = part.claims if part.drawn else set(OF_ORBITS) & set(part.claims)
    failed = dict.fromkeys(resting, bad) if bad else {}
    if part.every is not None and not bad:
        why = check_every(the_map, part.every, cycles)
        failed |= {"all-cycles": why} if why else {}
    if "refuted" in part.claims and not bad:
        assert file.goal is not None
        why = check_leaving_cycle(cycles, file.goal)
        failed |= {"refuted": why} if why else {}
    if part.cells is not None and not (bad and part.drawn):
        failed |= check_cells(part, number, file, cycles, crew)
        thins = "almost-every" in part.claims and "almost-every" not in failed
        why = check_weights(the_map, part.cells) if thins else ""
        failed |= {"almost-every": why} if why else {}
    return failed, cycles


def check_cycles(cycles: list[Cycle]) -> str:
    """Prove all orbits, and that they differ; "" or the reason."""
    for k, cycle in enumerate(cycles):
        bad = cycle.prove()
        if bad:
            return f"cycle {k}: {bad}"
    by_period: dict[int, list[int]] = {}
    for k, cycle in enumerate(cycles):
        by_period.setdefault(cycle.period, []).append(k)
    for alike in by_period.values():
        for i, j in itertools.combinations(alike, 2):
            if not cycles[i].is_apart_from(cycles[j]):
                return f"that cycles {i} and {j} differ is not proved"
    return ""


def check_leaving_cycle(cycles: list[Cycle], goal: Goal) -> str:
    """Find an attracting cycle with a point inside the starts and one apart from the ends; "" or the reason.

    Orbits from near the first point tend to the cycle, so that an open set of starts violates the goal.
    """
    for cycle in cycles:
        points = list(zip(cycle.listed.side, cycle.points, strict=True))
        inner = any(
            s == side and all(v > lo and v < hi for v, (lo, hi) in zip(point, box, strict=True))
            for side, point in points
            for s, box in goal.starts or []
        )
        apart = any(
            all(
                s != side or any(v < lo or v > hi for v, (lo, hi) in zip(point, box, strict=True))
                for s, box in goal.ends
            )
            for side, point in points
        )
        if cycle.listed.attracts and inner and apart:
            return ""
    return "no attracting cycle among the starts is proved to leave the ends"


def check_cells(part: Part, number: int, file: MapFile, cycles: list[Cycle], crew: Crew) -> dict[str, str]:
    """Check the claims about cells: first by whole numbers, then the images; those that fail with the reasons."""
    c, claims, final = (
        part.cells,
        [name for name in part.claims if name not in ("cycles", "all-cycles")],
        final_cells(part),
    )
    assert c is not None
    attracting = (c.component >= 0) & ~final
    bad = check_drawn(part, c, cycles) or c.check_labels(final)
    if bad:
        return dict.fromkeys(claims, bad)
    hulls = [hull for _, k in part.drawn for hull in cycles[k].hulls]
    needing = set() if attracting.any() else {"invariant", "trapping", "expanding"}
    needing |= set() if attracting.any() or part.drawn else {"basin", "attracts-all", "ends-in"}
    failed = dict.fromkeys(needing & set(claims), "there are no attracting cells")
    if "escapes" in claims:
        bad = c.check_exits()
        failed |= {"escapes": bad} if bad else {}
    if "attracts-all" in claims:
        bad = check_whole_domain(c, part.max_rank, hulls)
        failed |= {"attracts-all": bad} if bad else {}
    if "ends-in" in claims:
        assert file.goal is not None
        bad = check_ends_in(c, attracting, hulls, file.goal)
        failed |= {"ends-in": bad} if bad else {}
    chosen = np.flatnonzero(c.checked(final))
    strict = attracting & ("trapping" in claims)
    failure = crew.run(list(map_tasks(c, number, chosen, strict, np.where(attracting, part.least, 0.0))))
    if failure is None:
        return failed
    return dict.fromkeys(claims, f"{c.name(failure[0])}: {failure[1].text}") | failed


def final_cells(part: Part) -> Array:
    """Find the cells whose orbits are known from there on: `converges` names their component."""
    assert part.cells is not None
    return np.isin(part.cells.component, [component for component, _ in part.drawn])


def check_drawn(part: Part, c: MapCells, cycles: list[Cycle]) -> str:
    """Check that each component that `converges` names has cells, and that they tend to its cycle; "" or the reason."""
    for component, k in part.drawn:
        cells = np.flatnonzero(c.component == component).tolist()
        bad = cycles[k].contract() if cells else f"component {component} has no cells"
        bad = bad or cycles[k].check_drawn(c, cells)
        if bad:
            return bad
    return ""


def check_whole_domain(c: MapCells, max_rank: int, hulls: Regions) -> str:
    """Check that all cells have a rank of at most `max_rank`, and that balls lie in the domain; "" or the reason."""
    bad = np.flatnonzero((c.rank < 0) | (c.rank > max_rank))
    if len(bad):
        return f"{c.name(int(bad[0]))}: it has no rank, or one above max_rank"
    fits = all(c.in_domain(side, box) for side, box in hulls)
    return "" if fits else "a ball of converges reaches beyond the domain"


def check_ends_in(c: MapCells, attracting: Array, hulls: Regions, goal: Goal) -> str:
    """Check that attracting cells and balls lie in the goal's ends, and its starts in cells with a rank."""
    for side in range(len(c.edges)):
        own = [np.array(box) for s, box in goal.ends if s == side]
        balls = [np.array([box]) for s, box in hulls if s == side]
        for boxes in (c.boxes(attracting, side), *balls):
            held = np.zeros(len(boxes), dtype=bool)
            for end in own:
                held |= ((end[:, 0] <= boxes[:, :, 0]) & (boxes[:, :, 1] <= end[:, 1])).all(axis=1)
            if not held.all():
                outside = box_in_words(boxes[int(np.argmin(held))].tolist())
                return f"side {side}, {outside}: it does not lie in one of the ends of the goal"
    for side, start in goal.starts or []:
        if not c.in_domain(side, start):
            return "a start of the goal lies outside the domain"
        if c.meets_seam(side, start):
            return "a start of the goal meets the seam of an axis, and not the cells on both sides of it"
        boxes, (lo, hi) = c.boxes(c.rank < 0, side), np.array(start).T
        if ((boxes[:, :, 0] < hi) & (boxes[:, :, 1] > lo)).all(axis=1).any():
            return f"side {side}, {box_in_words(start)}: starts of the goal lie in cells that have no rank"
    return ""


def check_map_file(file: MapFile, workers: int, progress: Any) -> tuple[list[Outcome], int]:
    """Check a file; what became of each box of parameters, and the number of pieces of cells."""
    with_cells = [(part.cells, final_cells(part)) for part in file.parts if part.cells is not None]
    work = sum(int(c.checked(final).sum()) for c, final in with_cells)
    advance = None if progress is None else (lambda done: progress(min(done, work), work))
    setup = file.shape, [part.parameters for part in file.parts]
    crew = Crew(setup, workers, advance, prepare=prepare_map, check=check_map_task)
    outcomes = []
    try:
        for k, part in enumerate(file.parts):
            failed, cycles = check_part(part, k, file, crew)
            outcomes.append(outcome_of(part, file.shape, file.goal, failed, cycles))
    finally:
        crew.close()
    return outcomes, crew.boxes
