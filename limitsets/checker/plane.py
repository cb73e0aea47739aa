"""A plane of two quantities in cells: how its file is read, that the cells cover it, and which cells are one region.

docs/certificates.md, "Regions".
"""

import itertools
from collections.abc import Iterator
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from .balls import Array, prove
from .file import KINDS, Arrays, Quantity, plain, quantity, require, rows, section_alone, table
from .region import GOAL_PROVED, GOAL_REFUTED, Claimed
from .scene import quantities, read_scene

STARTS_WORDS = ("every", "almost-every", "from", "cells")  # the codes of the array `starts`
MOST_BORDERS = 4_097
MOST_CELLS = 1 << 20
WHOLE = {"<i2": 2, "<i4": 4}
FLAT: dict[str, tuple[str, int, int]] = {  # one row for each cell of parameters: type, columns, columns for each side
    "cells": ("<i4", 4, 0), "goal": ("|i1", 1, 0), "region": ("<i4", 1, 0), "grid": ("<i4", 1, 0),
    "starts": ("|i1", 1, 0), "from": ("<f8", 0, 1), "near": ("|i1", 1, 0), "joint": ("<f8", 0, 3),
    "counts": ("<i4", 3, 0),
}  # fmt: skip
TALL = ("jog", "flip", "rank", "component", "phi")  # one row for each cell of the arm


class Axis(NamedTuple):
    """One of the two quantities, and the borders of the smallest cells: as written, and exact."""

    name: str
    texts: list[str]
    values: list[Quantity]

    def between(self, low: int, high: int) -> str:
        """Name a range of it, for people."""
        return f"{self.name} in [{self.values[low]}, {self.values[high]}]"


class Plane(NamedTuple):
    """The content of a file: read, and not yet believed.

    Its cells are cells of parameters.
    """

    raw: dict[str, Any]
    axes: list[Axis]
    n_sides: int
    flat: dict[str, Array]
    tall: dict[str, Array]
    grids: list[list[Array]]
    first: Array  # where the rows of each cell of parameters begin in `tall`; at the end the number of all
    blocks: Array
    chain: Array
    ends: Array

    def name(self, k: int) -> str:
        """Name a cell of parameters, for people."""
        a, b, c, d = self.flat["cells"][k].tolist()
        return f"{self.axes[0].between(a, b)}, {self.axes[1].between(c, d)}"


def read_plane(header: dict[str, Any], entries: dict[str, memoryview]) -> Plane:
    """Read a file; raises BadFileError."""
    nothing = "a plane has no boxes, no noise and no tolerance"
    section = section_alone(header, "region", "a plane", "scene axes", nothing)
    raw = section["scene"]
    n_sides = len(read_scene(raw, None).sides)
    axes = [read_axis(one, raw) for one in rows(section["axes"], "axes", 2, 2)]
    require(axes[0].name != axes[1].name, "both axes are the same quantity")
    arrays = Arrays(header["arrays"], entries)
    array = arrays.read

    def either(name: str, columns: int) -> Array:
        described = arrays.said.get(name)
        dtype = described.get("dtype") if isinstance(described, dict) else None
        require(dtype in WHOLE, f"array {name} does not hold whole numbers")
        return array(name, str(dtype), columns)

    flat = {name: array(name, dtype, n + each * n_sides) for name, (dtype, n, each) in FLAT.items()}
    n = len(flat["cells"])
    require(
        0 < n <= MOST_CELLS and all(len(each) == n for each in flat.values()), "the cells are not alike many"
    )
    require(bool((flat["grid"] >= -1).all()), "array grid holds a number that is none")
    grids = [
        [array(f"edges.{g}.{i}", "<f8", 1) for i in range(n_sides)]
        for g in range(int(flat["grid"].max(initial=-1)) + 1)
    ]
    require(all(len(e) >= 2 for grid in grids for e in grid), "a side has no cells")
    tall = {name: either(name, 2 if name in ("jog", "flip") else 1) for name in TALL[:-1]}
    tall["phi"] = array("phi", "<f4", 2)
    sizes = np.array([sum(len(e) - 1 for e in grid) for grid in grids] + [0], dtype=np.int64)
    first = np.concatenate([[0], np.cumsum(sizes[flat["grid"]])])
    require(
        all(len(each) == first[-1] for each in tall.values()), "the arrays do not fit the cells of the arm"
    )
    blocks, chain = array("blocks", "<i4", 3 + 3 * n_sides), array("chain", "<i4", 3)
    ends = array("chain.ends", "<f8", 2)
    require(len(ends) == len(chain), "the arrays of the orbits do not fit")
    arrays.require_no_others()
    return Plane(
        raw,
        axes,
        n_sides,
        flat=flat,
        tall=tall,
        grids=grids,
        first=first,
        blocks=blocks,
        chain=chain,
        ends=ends,
    )


def read_axis(value: object, raw: dict[str, Any]) -> Axis:
    """Read a quantity with its borders, which ascend."""
    axis = table(value, "an axis", "quantity borders")
    name = axis["quantity"]
    require(isinstance(name, str) and name in dict(quantities(raw)), "an axis is not a quantity of the scene")
    texts = rows(axis["borders"], "borders", 2, MOST_BORDERS)
    values = [quantity(text, KINDS, name) for text in texts]
    alike = len({(q.pi, q.unit) for q in values}) == 1 and all(q.lo == q.hi for q in values)
    ascending = all(a.lo < b.lo for a, b in itertools.pairwise(values))
    require(alike and ascending, f"the borders of {plain(name)} do not ascend in one unit")
    return Axis(plain(name), texts, values)


def raster_of(plane: Plane) -> Array:
    """Spread the numbers of the cells over the smallest cells; the cells have to cover the plane once."""
    shape = tuple(len(axis.texts) - 1 for axis in plane.axes)
    raster, index = np.full(shape, -1, dtype=np.int64), plane.flat["cells"]
    right = (index >= 0) & (index <= np.array([shape[0], shape[0], shape[1], shape[1]]))
    ascend = (index[:, 0] < index[:, 1]) & (index[:, 2] < index[:, 3])
    prove(bool(right.all() and ascend.all()), "the borders of a cell are not such")
    for k, (a, b, c, d) in enumerate(index.tolist()):
        prove(not (raster[a:b, c:d] >= 0).any(), f"cell {k} lies over another one")
        raster[a:b, c:d] = k
    prove(bool((raster >= 0).all()), "the cells leave a gap")
    return raster


def check_codes(plane: Plane, has_goal: bool) -> None:
    """Check that codes are codes, and that blocks and orbits belong to cells."""
    f, n = plane.flat, len(plane.flat["cells"])
    for name, most in (("goal", 2), ("starts", 3), ("near", 1)):
        known = (f[name] >= 0) & (f[name] <= most)
        prove(bool(known.all()), f"array {name} holds a code that is none")
    fits = has_goal or not (f["goal"] == GOAL_REFUTED).any()
    prove(fits, "a goal is refuted, but the scene has none")
    for name, owner in (("blocks", plane.blocks[:, 0]), ("chain", plane.chain[:, 0])):
        ordered = ((owner >= 0) & (owner < n)).all() and (np.diff(owner) >= 0).all()
        prove(bool(ordered), f"array {name} is not in the order of the cells")


def claims_of_cells(plane: Plane) -> Iterator[Claimed]:
    """Put together, cell by cell, what is claimed of it."""
    f = plane.flat
    numbers = np.arange(len(f["cells"]) + 1)
    blocks, chain = np.searchsorted(plane.blocks[:, 0], numbers), np.searchsorted(plane.chain[:, 0], numbers)
    for k, (a, b, c, d) in enumerate(f["cells"].tolist()):
        ends = zip(plane.axes, ((a, b), (c, d)), strict=True)
        ranges = {axis.name: [axis.texts[low], axis.texts[high]] for axis, (low, high) in ends}
        rows_of = slice(int(plane.first[k]), int(plane.first[k + 1]))
        grid, orbit = int(f["grid"][k]), slice(chain[k], chain[k + 1])
        yield Claimed(
            k,
            plane.raw,
            ranges,
            int(f["goal"][k]),
            plane.grids[grid] if grid >= 0 else None,
            arrays={name: each[rows_of] for name, each in plane.tall.items()},
            starts=STARTS_WORDS[int(f["starts"][k])],
            since=f["from"][k].tolist(),
            near=f["joint"][k].reshape(-1, 3).tolist() if f["near"][k] else None,
            counts=f["counts"][k].tolist(),
            blocks=plane.blocks[blocks[k] : blocks[k + 1], 1:].tolist(),
            chain=plane.chain[orbit, 1:].tolist(),
            ends=plane.ends[orbit].tolist(),
        )


# ------------------------------------------------------------------------------------------------- regions


def check_regions(plane: Plane, raster: Array) -> None:
    """Check the numbers of the regions: cells with a common face are of one only where blocks correspond."""
    n, grid = len(plane.flat["cells"]), plane.flat["grid"]
    root = list(range(n))

    def top(k: int) -> int:
        while root[k] != k:
            root[k] = root[root[k]]
            k = root[k]
        return k

    for one, other in ((raster[:-1], raster[1:]), (raster[:, :-1], raster[:, 1:])):
        pairs = np.unique(np.stack([one.ravel(), other.ravel()], axis=1), axis=0)
        for i, j in pairs.tolist():
            if (
                i != j
                and grid[i] >= 0
                and grid[j] >= 0
                and top(i) != top(j)
                and blocks_correspond(plane, i, j)
            ):
                root[max(top(i), top(j))] = min(top(i), top(j))
    numbers: dict[int, int] = {}
    mine = [numbers.setdefault(top(k), len(numbers)) if grid[k] >= 0 else -1 for k in range(n)]
    for k, (said, own) in enumerate(zip(plane.flat["region"].tolist(), mine, strict=True)):
        prove(said == own, f"cell {k}: its region is not {said}")


def blocks_correspond(plane: Plane, i: int, j: int) -> bool:
    """Whether the blocks of two cells intersect one to one, and lie among the starts that come to the other's."""
    one, other = (slice(int(plane.first[k]), int(plane.first[k + 1])) for k in (i, j))
    here, there = common_cells(plane, i, j)
    a, b = plane.tall["component"][one], plane.tall["component"][other]
    ranks = plane.tall["rank"][one], plane.tall["rank"][other]
    if a.max(initial=-1) != b.max(initial=-1):
        return False
    inside = (here >= 0) & (there >= 0)
    for mine, own, into, rank in ((a, here, there, ranks[1]), (b, there, here, ranks[0])):
        held = (own >= 0) & (mine[np.maximum(own, 0)] >= 0)
        if not (inside[held].all() and (rank[into[held]] >= 0).all()):
            return False
    pair = np.stack([a[here[inside]], b[there[inside]]], axis=1)
    met = np.unique(pair[(pair >= 0).all(axis=1)], axis=0)
    blocks = int(a.max(initial=-1)) + 1
    return blocks > 0 and all(sorted(column) == list(range(blocks)) for column in met.T.tolist())


def common_cells(plane: Plane, i: int, j: int) -> tuple[Array, Array]:
    """Cut the arm at the borders of both grids: the cell of each grid in which a piece lies, -1 outside."""
    cells: list[list[Array]] = [[], []]
    starts = [0, 0]
    grids = [plane.grids[int(plane.flat["grid"][k])] for k in (i, j)]
    for side in range(plane.n_sides):
        cuts = np.union1d(grids[0][side], grids[1][side])
        for own, grid in enumerate(grids):
            edges = grid[side]
            at = np.searchsorted(edges, cuts[:-1], side="right") - 1
            inside = (at >= 0) & (at < len(edges) - 1)
            cells[own].append(np.where(inside, starts[own] + at, -1))
            starts[own] += len(edges) - 1
    return np.concatenate(cells[0]), np.concatenate(cells[1])


def area_shares(plane: Plane) -> tuple[Fraction, Fraction, Fraction]:
    """Return the shares of the plane's area, exactly: undecided, proved, refuted."""
    sums = [Fraction(0)] * 3
    ends = [[q.lo for q in axis.values] for axis in plane.axes]
    for (a, b, c, d), code in zip(plane.flat["cells"].tolist(), plane.flat["goal"].tolist(), strict=True):
        sums[code] += (ends[0][b] - ends[0][a]) * (ends[1][d] - ends[1][c])
    total = sum(sums)
    return sums[0] / total, sums[1] / total, sums[2] / total


def plane_in_words(plane: Plane, goal: dict[str, Any] | None) -> list[str]:
    """Put the claim in words, with what was checked."""
    undecided, proved, refuted = (f"{float(100 * share):.6g} %" for share in area_shares(plane))
    f, whole = plane.flat, ", ".join(axis.between(0, len(axis.texts) - 1) for axis in plane.axes)
    what = "starts come to attracting blocks" if goal is None else "the scene's goal is proved"
    against = "" if goal is None else f" refuted on {refuted}, by a periodic orbit that violates it;"
    lines = [
        f"region: {whole}, in {len(f['cells'])} cells of parameters, each for every parameter in it:",
        f"    {what} on {proved} of the area;{against} undecided on {undecided}",
    ]
    said = (
        "every start comes",
        "almost every start comes",
        "starts from some x on, of 99 % of the arm or more, come",
    )
    for kind, words in enumerate(said):
        number = int(((f["starts"] == kind) & (f["goal"] == GOAL_PROVED)).sum())
        lines += [f"    in {number} of the proved cells {words} to the blocks"] if number else []
    twice = int(((f["counts"][:, 1] == 2) & (f["goal"] == GOAL_PROVED)).sum())
    if goal is not None and goal["kind"] == "oriented_beyond" and twice:
        lines.append(
            f"    in {twice} of them the goal holds after two throws with the same parameters in the blocks"
        )
    if goal is not None and goal["kind"] == "reaches" and not goal["every"]:
        lines.append(
            "    the goal speaks of almost every orbit: it is proved but for starts of total length zero"
        )
    counts = np.bincount(plane.blocks[:, 0], minlength=len(f["cells"]))
    least, number = int(counts.min()), int(f["region"].max()) + 1
    joined = "in which attracting blocks of neighbours correspond one to one"
    lines.append(f"    attracting blocks in each cell: at least {least}; regions, {joined}: {number}")
    return lines
