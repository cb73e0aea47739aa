"""A certificate of a map as its file has it: boxes of parameters, claims and a goal, read and not yet believed.

docs/certificates.md, "Certificates of any map".
"""

from typing import Any, NamedTuple

from .any_map import Shape, read_map, read_parameters
from .balls import Pair
from .entropy import ENTROPY_KEYS, read_entropy
from .file import (
    Arrays,
    hex_float,
    is_whole,
    read_box,
    read_boxes,
    read_sections,
    read_side,
    require,
    rows,
    table,
    whole_number,
)
from .map_cells import MapCells
from .map_chances import MORE_OF_CHANCES, OF_CHANCES, read_chances_of_map
from .map_cycles import Begins, Listed, read_begins, read_cycles
from .map_long_run import OF_LONG_RUN, read_long_run_of_map
from .map_orbits import Every, read_every
from .map_plane import ParameterAxis, RegionPlace, read_axes, read_region_boxes
from .noisy_map import MORE_OF_NOISY
from .observable import KEYS as OF_AVERAGES, Allowed, read_average

CLAIMS_OF_MAP = {  # the claims that are known, and the keys of their sections
    "cycles": "cycles",
    "all-cycles": "period domain",
    "converges": "components cycles",
    "invariant": "",
    "trapping": "",
    "basin": "",
    "attracts-all": "max_rank",
    "ends-in": "",
    "expanding": "least",
    "escapes": "",
    "almost-every": "",
    "average": OF_AVERAGES,
    "entropy": ENTROPY_KEYS,
    "long-run": OF_LONG_RUN,
    "probabilities": OF_CHANCES,
    "refuted": "",
}
NOISY = {
    "long-run": MORE_OF_NOISY,
    "probabilities": MORE_OF_CHANCES,
}  # the claims about noise, and keys that may be
OF_LINE = {
    "average": read_average,
    "entropy": read_entropy,
    "long-run": read_long_run_of_map,
    "probabilities": read_chances_of_map,
}
OF_ORBITS = (
    "cycles",
    "all-cycles",
    "converges",
    "refuted",
)  # the others are about cells; these hold for fixed parameters
MOST_PARAMETER_BOXES = 100_000
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
    begins: Begins  # where the domain begins, as the cycles have it
    every: Every | None  # what `all-cycles` says
    drawn: list[tuple[int, int]]  # by `converges`: component and cycle
    max_rank: int
    least: float  # the slope of `expanding`, 0 where that is not claimed
    cells: MapCells | None
    of_line: dict[
        str, Any
    ]  # what is read of `average`, `entropy` and claims about noise, those that are claimed


class MapFile(NamedTuple):
    """The content of a file: read, and not yet believed."""

    shape: Shape
    goal: Goal | None
    parts: list[Part]
    axes: list[ParameterAxis]  # of a region, none where the boxes are no region
    places: list[RegionPlace]  # of the boxes in it
    firsts: Begins | None  # where the domain begins, None where nothing tells


# ----------------------------------------------------------------
# Reading.


def read_map_file(header: dict[str, Any], entries: dict[str, memoryview]) -> MapFile:
    """Read the content of a file; raises BadFileError."""
    table(header, "header.json", "format version map boxes goal plane arrays", "producer")
    shape = read_map(header["map"])
    axes = [] if header["plane"] is None else read_axes(header["plane"], shape.names)
    goal = None if header["goal"] is None else read_map_goal(header["goal"], shape)
    keys = "parameters claims at" if axes else "parameters claims"
    boxes = read_boxes(header["boxes"], keys, MOST_PARAMETER_BOXES)
    arrays = Arrays(header["arrays"], entries)
    parts = [read_map_part(box, shape, goal, arrays, f"box {k}") for k, box in enumerate(boxes)]
    given = [part.parameters for part in parts]
    places = read_region_boxes(axes, [box["at"] for box in boxes], given) if axes else []
    require(any(part.claims or part.unknown for part in parts), "nothing is claimed")
    # the value at which the formulas are evaluated is a part of the map
    begun = [part.cells.first_edges() for part in parts if part.cells is not None]
    begun += [part.begins for part in parts if part.cycles]
    noisy = [part.of_line[name].noisy.edges for part in parts for name in NOISY if name in part.of_line]
    begun += [[[float(e[0])] for e in edges] for edges in noisy if shape.closes]
    require(all(one == begun[0] for one in begun), "the domains of the boxes begin elsewhere")
    if not any(part.unknown for part in parts):  # which may need arrays
        arrays.require_no_others()
    return MapFile(shape, goal, parts, axes=axes, places=places, firsts=begun[0] if begun else None)


def read_map_goal(raw: object, shape: Shape) -> Goal:
    """Read the goal of a file."""
    known = table(raw, "goal", "starts ends")

    def regions(key: str) -> Regions:
        listed = [table(one, f"goal.{key}", "side box") for one in rows(known[key], f"goal.{key}", 1, 10_000)]
        return [
            (read_side(r["side"], shape.sides), read_box(r["box"], shape.dimension, f"goal.{key}"))
            for r in listed
        ]

    return Goal(None if known["starts"] is None else regions("starts"), regions("ends"))


def read_map_part(box: dict[str, Any], shape: Shape, goal: Goal | None, arrays: Arrays, where: str) -> Part:
    """Read a box of parameters."""
    parameters = read_parameters(box["parameters"], shape.names, f"{where}: parameters")
    claims = read_sections(box["claims"], f"{where}: claims", 0)
    known = {name: section for name, section in claims.items() if name in CLAIMS_OF_MAP}
    for name, section in known.items():
        more = " begins" if name == "cycles" and shape.closes else ""
        table(section, f"{where}: section of {name}", CLAIMS_OF_MAP[name] + more, NOISY.get(name, ""))
    rechecked = not shape.closes or not {"all-cycles", "escapes"} & set(known)
    require(
        rechecked, f"{where}: this checker knows neither all-cycles nor escapes beside axes with a period"
    )
    on_a_line = shape.dimension == 1 and not shape.closes
    require(on_a_line or "almost-every" not in known, f"{where}: almost-every is of one axis, which ends")
    require(goal is not None or not {"ends-in", "refuted"} & set(known), f"{where}: there is no goal")
    if "refuted" in known:
        require(set(claims) == {"refuted", "cycles"}, f"{where}: a refutation has to stand with cycles alone")
        require(
            goal is not None and goal.starts is not None, f"{where}: a refuted goal has to name its starts"
        )
    cycles = read_cycles(known["cycles"]["cycles"], shape, where) if "cycles" in known else []
    begins: Begins = [[None] * shape.dimension] * shape.sides
    if cycles and shape.closes:
        begins = read_begins(known["cycles"]["begins"], shape, where)
    drawn = read_drawn(known["converges"], cycles, where) if "converges" in known else []
    every = read_every(known["all-cycles"], shape, where) if "all-cycles" in known else None
    about_cells = set(known) - {"cycles", "all-cycles", "refuted", *NOISY}
    labels = {"exits": "escapes" in known, "weights": "almost-every" in known}
    cells = MapCells(arrays, box["prefix"], shape, **labels) if about_cells else None
    unknown = [name for name in claims if name not in CLAIMS_OF_MAP]
    numbers = read_numbers(known, shape, where)
    of_line = read_of_line(known, shape, arrays, box["prefix"], where)
    return Part(
        parameters,
        known,
        unknown,
        cycles,
        begins,
        every=every,
        drawn=drawn,
        **numbers,
        cells=cells,
        of_line=of_line,
    )


def read_of_line(
    known: dict[str, Any], shape: Shape, arrays: Arrays, prefix: str, where: str
) -> dict[str, Any]:
    """Read the claims about averages and entropies of a line, those that are made."""
    claimed = {name: read for name, read in OF_LINE.items() if name in known}
    require(shape.dimension == 1 or not claimed, f"{where}: {', '.join(claimed)} is of one axis")
    both = "converges" in known and {"average", "entropy"} & set(claimed)
    require(not both, f"{where}: average and entropy do not stand beside converges")
    ends = not (shape.closes and "probabilities" in known)
    require(ends, f"{where}: probabilities is of an axis that ends")
    periods = [axes[0] for axes in shape.periods]
    allowed = Allowed(shape.sides, shape.branches, shape.names, periods)
    return {name: read(known[name], arrays, prefix, allowed, where) for name, read in claimed.items()}


def read_numbers(known: dict[str, Any], shape: Shape, where: str) -> dict[str, Any]:
    """Read the numbers of `attracts-all` and `expanding`, 0 where these are not claimed."""
    numbers: dict[str, Any] = {"max_rank": 0, "least": 0.0}
    if "attracts-all" in known:
        max_rank = known["attracts-all"]["max_rank"]
        numbers["max_rank"] = whole_number(max_rank, 0, 2**31, f"{where}: max_rank is not a whole number")
    if "expanding" in known:
        numbers["least"] = hex_float(known["expanding"]["least"], f"{where}: least")
        above = shape.dimension == 1 and numbers["least"] > 1
        require(above, f"{where}: slopes are of one dimension, and the least is above 1")
    return numbers


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
