"""The claims of a file about a map: how they are read, checked and put in words.

docs/certificates.md, "Certificates of any map".  A file has boxes of parameters, each with claims of its own.
"""

import itertools
import math
import re
from typing import Any, NamedTuple

import numpy as np

from .any_map import Map, Shape, parameter_in_words, read_map, read_parameters
from .balls import Array, Pair
from .cells import Crew
from .claims import entropy_of
from .file import Arrays, hex_float, plain, read_side, require, rows, table
from .map_cells import MapCells, check_map_task, prepare_map, tasks_of
from .map_cycles import Cycle, Listed, interval_in_words, read_box, read_cycles
from .program import is_whole, named

CLAIMS = {  # the claims that are known, and the keys of their sections
    "cycles": "cycles",
    "converges": "components cycles",
    "invariant": "",
    "trapping": "",
    "basin": "",
    "attracts-all": "max_rank",
    "ends-in": "",
    "expanding": "least",
    "refuted": "",
}
OF_ORBITS = ("cycles", "converges", "refuted")  # the others are about cells; these hold for fixed parameters
MOST_BOXES, MOST_NAMED = 100_000, 6
Regions = list[tuple[int, list[Pair]]]  # side and box


class Goal(NamedTuple):
    """Every start of some boxes, None for those in cells with a rank, ends in others and stays there."""

    starts: Regions | None
    ends: Regions


class Part(NamedTuple):
    """A box of parameters: what is claimed there."""

    parameters: dict[str, tuple[str, str]]
    claims: dict[str, Any]  # those that are known, with their sections
    unknown: list[str]
    cycles: list[Listed]
    drawn: list[tuple[int, int]]  # by `converges`: component and cycle
    least: float  # the slope of `expanding`, else 0
    cells: MapCells | None


class MapFile(NamedTuple):
    """The content of a file: read, and not yet believed."""

    shape: Shape
    goal: Goal | None
    parts: list[Part]


# ----------------------------------------------------------------
# Reading.


def read_map_file(header: dict[str, Any], entries: dict[str, memoryview]) -> MapFile:
    """Read the content of a file; raises BadFileError."""
    table(header, "header.json", "format version map boxes goal plane arrays", "producer")
    require(header["plane"] is None, "plane: this checker does not know regions of a map's parameters")
    shape = read_map(header["map"])
    goal = None if header["goal"] is None else read_goal(header["goal"], shape)
    boxes = rows(header["boxes"], "boxes", 1, MOST_BOXES)
    prefixes = [table(box, "a box", "parameters prefix claims")["prefix"] for box in boxes]
    plain_ones = all(isinstance(prefix, str) and re.fullmatch(r"[0-9]{1,6}\.", prefix) for prefix in prefixes)
    require(
        plain_ones and len(set(prefixes)) == len(boxes), "the prefixes of the boxes are not as they should be"
    )
    arrays = Arrays(header["arrays"], entries)
    parts = [read_part(box, shape, goal, arrays, f"box {k}") for k, box in enumerate(boxes)]
    require(any(part.claims or part.unknown for part in parts), "nothing is claimed")
    if not any(part.unknown for part in parts):  # which may need arrays
        arrays.require_no_others(
            "the header describes arrays that no claim needs", "it holds arrays that no claim needs"
        )
    return MapFile(shape, goal, parts)


def read_goal(raw: object, shape: Shape) -> Goal:
    """Read the goal of a file."""
    known = table(raw, "goal", "starts ends")

    def regions(key: str) -> Regions:
        listed = [table(one, f"goal.{key}", "side box") for one in rows(known[key], f"goal.{key}", 1, 10_000)]
        return [
            (read_side(r["side"], shape.sides), read_box(r["box"], shape.dimension, f"goal.{key}"))
            for r in listed
        ]

    return Goal(None if known["starts"] is None else regions("starts"), regions("ends"))


def read_part(box: dict[str, Any], shape: Shape, goal: Goal | None, arrays: Arrays, where: str) -> Part:
    """Read a box of parameters."""
    parameters = read_parameters(box["parameters"], shape.names, f"{where}: parameters")
    claims: dict[str, Any] = {}
    for claim in rows(box["claims"], f"{where}: claims", 0, 100):
        name = table(claim, f"{where}: a claim", "claim section")["claim"]
        require(isinstance(name, str) and name not in claims, f"{where}: a claim is no text, or made twice")
        claims[name] = claim["section"]
    unknown = [name for name in claims if name not in CLAIMS]
    known = {name: section for name, section in claims.items() if name in CLAIMS}
    for name, section in known.items():
        table(section, f"{where}: section of {name}", CLAIMS[name])
    require(goal is not None or not {"ends-in", "refuted"} & set(known), f"{where}: there is no goal")
    if "refuted" in known:
        require(set(claims) == {"refuted", "cycles"}, f"{where}: a refutation has to stand with cycles alone")
        require(
            goal is not None and goal.starts is not None, f"{where}: a refuted goal has to name its starts"
        )
    cycles = read_cycles(known["cycles"]["cycles"], shape, where) if "cycles" in known else []
    if "attracts-all" in known:
        whole = is_whole(known["attracts-all"]["max_rank"], 0, 2**31)
        require(whole, f"{where}: max_rank is not a whole number")
    least = 0.0
    if "expanding" in known:
        require(shape.dimension == 1, f"{where}: slopes are of one dimension")
        least = hex_float(known["expanding"]["least"], f"{where}: least")
        require(least > 1, f"{where}: the least slope is not above 1")
    drawn = read_drawn(known["converges"], cycles, where) if "converges" in known else []
    prefix, about_cells = box["prefix"], set(known) - {"cycles", "refuted"}
    cells = MapCells(arrays, prefix, shape) if about_cells else None
    return Part(parameters, known, unknown, cycles, drawn=drawn, least=least, cells=cells)


def read_drawn(section: dict[str, Any], cycles: list[Listed], where: str) -> list[tuple[int, int]]:
    """Read which component tends to which cycle."""
    components = rows(section["components"], f"{where}: components", 1, 2**31)
    pairs = list(
        zip(components, rows(section["cycles"], where, len(components), len(components)), strict=True)
    )
    for component, k in pairs:
        fine = is_whole(component, 0, 2**31) and is_whole(k, 0, len(cycles) - 1)
        require(
            fine and cycles[k].radius is not None,
            f"{where}: converges names no component, or no cycle with a radius",
        )
    alone = all(len(set(column)) == len(pairs) for column in zip(*pairs, strict=True))
    require(alone, f"{where}: converges names a component or a cycle twice")
    return pairs


# ----------------------------------------------------------------
# Checking.


def within(box: list[Pair], other: list[Pair]) -> bool:
    """Whether a box lies in another, closed one."""
    return all(b <= lo and hi <= e for (lo, hi), (b, e) in zip(box, other, strict=True))


def check_part(part: Part, number: int, file: MapFile, crew: Crew) -> tuple[dict[str, str], list[Cycle]]:
    """Check all claims of a box of parameters: those that fail with the reasons; and its cycles."""
    the_map = Map(file.shape, part.parameters)
    cycles = [Cycle(the_map, listed) for listed in part.cycles]
    bad = check_cycles(cycles)
    # without the cycles it is not known which cells are final, hence nothing about the others
    resting = part.claims if part.drawn else {"cycles", "refuted"} & set(part.claims)
    failed = dict.fromkeys(resting, bad) if bad else {}
    if "refuted" in part.claims and not bad:
        assert file.goal is not None
        why = check_refuted(cycles, file.goal)
        failed |= {"refuted": why} if why else {}
    if part.cells is not None and not (bad and part.drawn):
        failed |= check_cells(part, number, file, cycles, crew)
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


def check_refuted(cycles: list[Cycle], goal: Goal) -> str:
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
    c, claims = part.cells, [name for name in part.claims if name not in ("cycles", "refuted")]
    assert c is not None
    final = np.isin(c.component, [component for component, _ in part.drawn])
    attracting = (c.component >= 0) & ~final
    bad = check_drawn(part, c, cycles) or c.check_labels(final)
    if not bad and not (attracting.any() or part.drawn):
        bad = "there are no attracting cells"
    if bad:
        return dict.fromkeys(claims, bad)
    hulls = [hull for _, k in part.drawn for hull in cycles[k].hulls]
    failed = {}
    if not attracting.any():
        failed = dict.fromkeys(
            {"invariant", "trapping", "expanding"} & set(claims), "there are no attracting cells"
        )
    if "attracts-all" in claims:
        bad = check_everywhere(c, part.claims["attracts-all"]["max_rank"], hulls)
        failed |= {"attracts-all": bad} if bad else {}
    if "ends-in" in claims:
        assert file.goal is not None
        bad = check_ends_in(c, np.flatnonzero(attracting), hulls, file.goal)
        failed |= {"ends-in": bad} if bad else {}
    chosen = np.flatnonzero((c.rank >= 0) & ~final)
    strict = attracting & ("trapping" in claims)
    failure = crew.run(list(tasks_of(c, number, chosen, strict, np.where(attracting, part.least, 0.0))))
    if failure is None:
        return failed
    return dict.fromkeys(claims, f"{c.name(failure[0])}: {failure[1].text}") | failed


def check_drawn(part: Part, c: MapCells, cycles: list[Cycle]) -> str:
    """Check that each component that `converges` names has cells, and that they tend to its cycle; "" or the reason."""
    for component, k in part.drawn:
        cells = np.flatnonzero(c.component == component).tolist()
        bad = cycles[k].contract() if cells else f"component {component} has no cells"
        bad = bad or cycles[k].check_drawn(c, cells)
        if bad:
            return bad
    return ""


def check_everywhere(c: MapCells, max_rank: int, hulls: Regions) -> str:
    """Check that all cells have a rank of at most `max_rank`, and that balls lie in the domain; "" or the reason."""
    bad = np.flatnonzero((c.rank < 0) | (c.rank > max_rank))
    if len(bad):
        return f"{c.name(int(bad[0]))}: it has no rank, or one above max_rank"
    fits = all(c.in_domain(side, box) for side, box in hulls)
    return "" if fits else "a ball of converges reaches beyond the domain"


def check_ends_in(c: MapCells, attracting: Array, hulls: Regions, goal: Goal) -> str:
    """Check that attracting cells and balls lie in the goal's ends, and its starts in cells with a rank."""
    for side, box in [*map(c.box, attracting.tolist()), *hulls]:
        if not any(s == side and within(box, end) for s, end in goal.ends):
            return f"side {side}, {box_in_words(box)}: it does not lie in one of the ends of the goal"
    for side, start in goal.starts or []:
        if not c.in_domain(side, start):
            return "a start of the goal lies outside the domain"
    for cell in np.flatnonzero(c.rank < 0).tolist() if goal.starts else []:
        side, box = c.box(cell)
        for s, start in goal.starts or []:
            if s == side and all(lo < e and hi > b for (lo, hi), (b, e) in zip(box, start, strict=True)):
                return f"{c.name(cell)}: it holds starts of the goal, and has no rank"
    return ""


class Outcome(NamedTuple):
    """What became of a box of parameters."""

    parameters: list[str]
    holds_for: str  # whether its parameters are fixed, or may change at every step; "" without a range
    verdict: str  # "proved", "refuted", "failed", or "" where nothing is claimed
    claims: list[tuple[str, str, str]]  # claim, a word, and what is proved or why not


def check_map_file(file: MapFile, workers: int, progress: Any) -> tuple[list[Outcome], int]:
    """Check a file; what became of each box of parameters, and the number of pieces of cells."""
    cells = [part.cells for part in file.parts if part.cells is not None]
    work = sum(int((c.rank >= 0).sum()) for c in cells)
    advance = None if progress is None else (lambda done: progress(min(done, work), work))
    setup = file.shape, [part.parameters for part in file.parts]
    crew = Crew(setup, workers, advance, prepare=prepare_map, check=check_map_task)
    outcomes = []
    try:
        for k, part in enumerate(file.parts):
            failed, cycles = check_part(part, k, file, crew)
            outcomes.append(outcome_of(part, file, failed, cycles))
    finally:
        crew.close()
    return outcomes, crew.boxes


# ----------------------------------------------------------------
# In words.


def outcome_of(part: Part, file: MapFile, failed: dict[str, str], cycles: list[Cycle]) -> Outcome:
    """Put in words what became of a box of parameters."""
    claims = []
    for name in [name for name in CLAIMS if name in part.claims]:
        word = "failed" if name in failed else "refuted" if name == "refuted" else "proved"
        claims.append((name, word, failed.get(name) or claim_in_words(name, part, file, cycles)))
    claims += [
        (plain(name), "not rechecked", "this checker does not know the claim") for name in part.unknown
    ]
    words = {word for _, word, _ in claims}
    worst = "failed" if words & {"failed", "not rechecked"} else "refuted" if "refuted" in words else "proved"
    parameters = [parameter_in_words(name, ends) for name, ends in part.parameters.items()]
    return Outcome(parameters, holds_for(part), worst if claims else "", claims)


def holds_for(part: Part) -> str:
    """Say which claims hold for parameters that are fixed, and which also where they change at every step."""
    wide = [named(name) for name, (lo, hi) in part.parameters.items() if lo != hi]
    names = [name for name in CLAIMS if name in part.claims]
    # who ends in the ball of a cycle tends to it, and stays, for one value only
    fixed = {*OF_ORBITS, *(("attracts-all", "ends-in") if part.drawn else ())}
    groups = (
        ("fixed in time", [name for name in names if name in fixed]),
        ("changed at every step too", [name for name in names if name not in fixed]),
    )
    said = "; ".join(f"{how}: {', '.join(group)}" for how, group in groups if group)
    return f"for every {', '.join(wide)} in the range, {said}" if wide and said else ""


def box_in_words(box: list[Pair]) -> str:
    """Write a box, its ends as shortest decimals of the doubles."""
    return " x ".join(f"[{lo!r}, {hi!r}]" for lo, hi in box)


def regions_in_words(regions: Regions, sides: int) -> str:
    """Write boxes with their sides."""
    said = [
        box_in_words(box) + (f" on side {side}" if sides > 1 else "") for side, box in regions[:MOST_NAMED]
    ]
    more = len(regions) - MOST_NAMED
    return " or ".join(said) + (f" or {more} more boxes" if more > 0 else "")


def claim_in_words(name: str, part: Part, file: MapFile, cycles: list[Cycle]) -> str:
    """Put in words what a claim says, from what was checked."""
    if name == "cycles":
        count = f"{len(cycles)} periodic orbit{'s' if len(cycles) > 1 else ''}"
        more = f"; and {len(cycles) - MOST_NAMED} more" if len(cycles) > MOST_NAMED else ""
        return f"{count}: {'; '.join(cycle.in_words() for cycle in cycles[:MOST_NAMED])}{more}"
    if name == "refuted":
        assert file.goal is not None
        return f"an open set of starts, around a point of an attracting cycle, violates that {goal_in_words(file)}"
    c = part.cells
    assert c is not None
    final = {component for component, _ in part.drawn}
    own = [k for k in np.unique(c.component[c.component >= 0]).tolist() if k not in final]
    if name == "converges":
        drawn = [f"{component_in_words(c, k)} tends to cycle {cycle}" for k, cycle in part.drawn[:MOST_NAMED]]
        return "every orbit that comes into " + "; into ".join(drawn)
    there = "the attracting cells" + (
        " and stays, or into those that tend to a cycle" if final and own else ""
    )
    there = "cells that tend to a cycle" if final and not own else there + ("" if final else " and stays")
    components = "; ".join(component_in_words(c, k) for k in own[:MOST_NAMED])
    components += f"; and {len(own) - MOST_NAMED} more" if len(own) > MOST_NAMED else ""
    if name == "basin":
        share, steps = share_in_words(c, file.shape), steps_in_words(int(c.rank.max(initial=0)))
        return f"every start in cells that cover {share} comes {steps} into {there}"
    if name == "attracts-all":
        steps = steps_in_words(part.claims[name]["max_rank"])
        return f"every start in the domain, which no orbit leaves, comes {steps} into {there}"
    if name == "ends-in":
        return goal_in_words(file)
    if name == "expanding":
        rate = f"|dx'/dx| >= {part.least!r} on {components}; no periodic orbit there attracts"
        return (
            f"{rate}; of fixed parameters the entropy (growth of laps) is at least {entropy_of(part.least)}"
        )
    what = "mapped into its interior" if name == "trapping" else "mapped into itself"
    return f"{what}: {components}"


def component_in_words(c: MapCells, component: int) -> str:
    """Name a component, with the least box around it on its first side."""
    cells = np.flatnonzero(c.component == component)
    side = int(c.side_of(cells[:1])[0])
    ends = c.ends(cells[c.side_of(cells) == side], side)
    hull = [
        (float(lo), float(hi))
        for lo, hi in zip(ends[:, ::2].min(axis=0), ends[:, 1::2].max(axis=0), strict=True)
    ]
    where = " x ".join(map(interval_in_words, hull)) + (f" on side {side}" if len(c.edges) > 1 else "")
    elsewhere = " and on other sides" if len(np.unique(c.side_of(cells))) > 1 else ""
    return f"component {component} ({len(cells)} cells in {where}{elsewhere})"


def steps_in_words(most: int) -> str:
    """Write a bound of the number of steps."""
    return f"within {most} step{'' if most == 1 else 's'}"


def goal_in_words(file: MapFile) -> str:
    """Put the goal in words."""
    goal, sides = file.goal, file.shape.sides
    assert goal is not None
    starts = "the cells with a rank" if goal.starts is None else regions_in_words(goal.starts, sides)
    return f"every start in {starts} ends in {regions_in_words(goal.ends, sides)} and stays"


def share_in_words(c: MapCells, shape: Shape) -> str:
    """Write the share of the domain that lies in cells with a rank, rounded down."""
    domain = (
        box_in_words([(float(e[0]), float(e[-1])) for e in c.edges[0]]) if shape.sides == 1 else "the domain"
    )
    if bool((c.rank >= 0).all()):
        return f"all of {domain}"
    held = whole = 0.0
    with np.errstate(all="ignore"):
        for side, axes in enumerate(c.edges):
            volume = np.diff(axes[0])
            for e in axes[1:]:
                volume = np.multiply.outer(volume, np.diff(e))
            own = c.rank[c.start[side] : c.start[side + 1]].reshape(volume.shape) >= 0
            held, whole = held + float(volume[own].sum()), whole + float(volume.sum())
    # sums of at most 2^31 terms are right to 1e-6; where they leave the range of doubles nothing is said
    fits = 1e-290 < whole < math.inf
    return f"{math.floor(held / whole * (1 - 1e-6) * 1000) / 10 if fits else 0.0} % of {domain}"
