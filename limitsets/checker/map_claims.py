"""The claims of a file about a map: each is checked for all parameters of its box.

docs/certificates.md, "Certificates of any map".
"""

import itertools
from collections.abc import Iterator

import numpy as np

from .any_map import Map
from .balls import Array, UnprovedError, about, prove, reason_of
from .cells import Crew
from .claims import Failed, failing
from .map_average import check_map_average
from .map_cells import MapCells, map_tasks
from .map_chances import check_chances_of_map
from .map_cycles import Cycle
from .map_entropy import check_map_entropy
from .map_file import NOISY, OF_ORBITS, Goal, MapFile, Part, Regions
from .map_long_run import check_long_run_of_map
from .map_orbits import check_every
from .map_weights import check_weights
from .map_words import Outcome, box_in_words, outcome_of


def check_part(part: Part, number: int, file: MapFile, crew: Crew) -> tuple[Failed, list[Cycle]]:
    """Check all claims of a box of parameters: those that fail with the reasons; and its cycles."""
    the_map = Map(file.shape, part.parameters)
    cycles = [Cycle(the_map, listed, part.begins) for listed in part.cycles]
    # without the cycles it is not known which cells are final, hence nothing about the others
    resting = set(part.claims if part.drawn else OF_ORBITS) & set(part.claims)
    bad = reason_of(check_cycles, cycles)
    failed = dict.fromkeys(resting, bad) if bad else {}
    if part.every is not None and not bad:
        failed |= failing(["all-cycles"], check_every, the_map, part.every, cycles)
    if "refuted" in part.claims and not bad:
        failed |= failing(["refuted"], check_leaving_cycle, cycles, file.goal)
    if part.cells is not None and not (bad and part.drawn):
        failed |= check_cells(part, number, file, cycles, crew)
        if "almost-every" in part.claims and "almost-every" not in failed:
            failed |= failing(["almost-every"], check_weights, the_map, part.cells)
        for name, check in (("average", check_map_average), ("entropy", check_map_entropy)):
            if name in part.of_line and name not in failed:
                failed |= failing([name], check, the_map, part.cells, part.of_line[name])
    for name, recheck in (("long-run", check_long_run_of_map), ("probabilities", check_chances_of_map)):
        if name in part.of_line:
            failed |= failing([name], recheck, the_map, part.of_line[name])
    return failed, cycles


def check_cycles(cycles: list[Cycle]) -> None:
    """Prove all orbits, and that they differ."""
    for k, cycle in enumerate(cycles):
        with about(f"cycle {k}"):
            cycle.prove()
    by_period: dict[int, list[int]] = {}
    for k, cycle in enumerate(cycles):
        by_period.setdefault(cycle.period, []).append(k)
    for alike in by_period.values():
        for i, j in itertools.combinations(alike, 2):
            prove(cycles[i].is_apart_from(cycles[j]), f"that cycles {i} and {j} differ is not proved")


def check_leaving_cycle(cycles: list[Cycle], goal: Goal) -> None:
    """Find an attracting cycle with a point inside the starts and one apart from the ends.

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
            return
    raise UnprovedError("no attracting cycle among the starts is proved to leave the ends")


def check_cells(part: Part, number: int, file: MapFile, cycles: list[Cycle], crew: Crew) -> Failed:
    """Check the claims about cells: first by whole numbers, then the images; those that fail with the reasons."""
    c, final = part.cells, final_cells(part)
    claims = [name for name in part.claims if name not in ("cycles", "all-cycles", *NOISY)]
    assert c is not None
    attracting = (c.component >= 0) & ~final
    failed = failing(claims, check_drawn, part, c, cycles) or failing(claims, c.check_labels, final)
    if failed:
        return failed
    hulls = [hull for _, k in part.drawn for hull in cycles[k].hulls]
    needing = set() if attracting.any() else {"invariant", "trapping", "expanding"}
    needing |= set() if attracting.any() or part.drawn else {"basin", "attracts-all", "ends-in"}
    failed = dict.fromkeys(needing & set(claims), "there are no attracting cells")
    if "escapes" in claims:
        failed |= failing(["escapes"], c.check_exits)
    if "attracts-all" in claims:
        failed |= failing(["attracts-all"], check_whole_domain, c, part.max_rank, hulls)
    if "ends-in" in claims:
        failed |= failing(["ends-in"], check_ends_in, c, attracting, hulls, file.goal)
    strict, least = attracting & ("trapping" in claims), np.where(attracting, part.least, 0.0)
    tasks = map_tasks(c, number, np.flatnonzero(c.checked(final)), strict, least)
    return failing(claims, crew.run, c.name, tasks) | failed


def final_cells(part: Part) -> Array:
    """Find the cells whose orbits are known from there on: `converges` names their component."""
    assert part.cells is not None
    return np.isin(part.cells.component, [component for component, _ in part.drawn])


def check_drawn(part: Part, c: MapCells, cycles: list[Cycle]) -> None:
    """Check that each component that `converges` names has cells, and that they tend to its cycle."""
    for component, k in part.drawn:
        cells = np.flatnonzero(c.component == component).tolist()
        prove(bool(cells), f"component {component} has no cells")
        cycles[k].contract()
        cycles[k].check_drawn(c, cells)


def check_whole_domain(c: MapCells, max_rank: int, hulls: Regions) -> None:
    """Check that all cells have a rank of at most `max_rank`, and that balls lie in the domain."""
    c.prove_all((c.rank >= 0) & (c.rank <= max_rank), "it has no rank, or one above max_rank")
    fits = all(c.in_domain(side, box) for side, box in hulls)
    prove(fits, "a ball of converges reaches beyond the domain")


def check_ends_in(c: MapCells, attracting: Array, hulls: Regions, goal: Goal) -> None:
    """Check that attracting cells and balls lie in the goal's ends, and its starts in cells with a rank."""
    for side in range(len(c.edges)):
        own = [np.array(box) for s, box in goal.ends if s == side]
        balls = [np.array([box]) for s, box in hulls if s == side]
        for boxes in (c.boxes(attracting, side), *balls):
            held = np.zeros(len(boxes), dtype=bool)
            for end in own:
                held |= ((end[:, 0] <= boxes[:, :, 0]) & (boxes[:, :, 1] <= end[:, 1])).all(axis=1)
            if not held.all():
                where = f"side {side}, {box_in_words(boxes[int(np.argmin(held))].tolist())}"
                raise UnprovedError(f"{where}: it does not lie in one of the ends of the goal")
    seam = "a start of the goal meets the seam of an axis, and not the cells on both sides of it"
    for side, start in goal.starts or []:
        prove(c.in_domain(side, start), "a start of the goal lies outside the domain")
        prove(not c.meets_seam(side, start), seam)
        boxes, (lo, hi) = c.boxes(c.rank < 0, side), np.array(start).T
        open_to = ((boxes[:, :, 0] < hi) & (boxes[:, :, 1] > lo)).all(axis=1).any()
        where = f"side {side}, {box_in_words(start)}"
        prove(not open_to, f"{where}: starts of the goal lie in cells that have no rank")


def work_of_maps(file: MapFile) -> int:
    """Count the cells whose images are checked, for the progress bar."""
    with_cells = [(part.cells, final_cells(part)) for part in file.parts if part.cells is not None]
    return sum(int(c.checked(final).sum()) for c, final in with_cells)


def check_parts(file: MapFile, crew: Crew) -> Iterator[Outcome]:
    """Check a file: what became of each box of parameters."""
    for k, part in enumerate(file.parts):
        failed, cycles = check_part(part, k, file, crew)
        yield outcome_of(part, file.shape, file.goal, failed, cycles)
