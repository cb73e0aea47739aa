"""Laps of a map of a line: what `entropy` needs of its cells.

Along an axis that closes a lap ends where the image passes the seam too: images are turned to the first period.
"""

import functools
import itertools
import math
from collections.abc import Iterator

import numpy as np
from flint import arb

from .any_map import Map
from .balls import ZERO, Arb, Pair, about, floats_around, prove
from .entropy import Entropy, Lap, Row, Runs, check_entropy, laps_of
from .map_average import way_of
from .map_cells import MapCells
from .program import Program

MOST_ROUNDS = 10**6


def check_map_entropy(the_map: Map, c: MapCells, claim: Entropy) -> None:
    """Check the entropy of a map."""
    check_entropy(list(laps_of_map(the_map, c)), Runs(c, [axes[0] for axes in c.edges]), claim)


def laps_of_map(the_map: Map, c: MapCells) -> Iterator[Lap]:
    """Find the laps of the attracting cells, by side, branch and turn."""
    possible = [to[:, 0] != -2 for to in c.target]
    both, sides = np.sum(possible, axis=0) > 1, c.side_of(np.arange(len(c.rank)))
    ranges = the_map.piece([]).balls
    for side, branch in itertools.product(range(len(c.edges)), range(len(possible))):
        cells, to = (
            np.flatnonzero((c.component >= 0) & possible[branch] & (sides == side)),
            c.to[branch][side],
        )
        program, period = the_map.image[side, branch], c.periods[to][0]
        prove(period is None or len(possible) == 1, "an axis closes, of a map of two branches")
        rows = list[Row]()
        for cell, ends in zip(cells.tolist(), c.ends(cells, side).tolist(), strict=True):
            with about(c.name(cell)):
                place = way_of(the_map, (side, branch), ends) if both[cell] else -1
            rows.append(map_row(program, ranges, cell, (ends[0], ends[1]), place))
        own_period = c.periods[side][0]
        if own_period is not None and rows and rows[-1].cell == c.start[side + 1] - 1:
            rows[-1:] = without_seam(rows[-1], arb(float(c.edges[side][0][0])) + own_period, program, ranges)
        image = functools.partial(image_of, program, ranges)
        if period is None:
            yield from laps_of(side, to, rows, functools.partial(image, ZERO))
            continue
        first = arb(float(c.edges[to][0][0]))
        by_turn: dict[int, list[Row]] = {}
        for row in rows:
            for turn, place in turns_of(row, [image(ZERO, end) for end in row.ends], (first, period)):
                turned = row._replace(image=row.image - turn * period, place=max(place, row.place))
                by_turn.setdefault(turn, []).append(turned)
        for turn, own in by_turn.items():
            yield from laps_of(side, to, own, functools.partial(image, turn * period))


def map_row(program: Program, ranges: list[Arb], cell: int, ends: Pair, place: int) -> Row:
    """Enclose the map and its slopes on a cell."""
    x = [arb(ends[0]).union(arb(ends[1])), *ranges]
    return Row(cell, ends, program.gradients(x)[0][0], program.bend(x)[2], program.at(x)[0], place)


def without_seam(row: Row, seam: Arb, program: Program, ranges: list[Arb]) -> list[Row]:
    """Cut the last cell of an axis that closes: it ends before the seam, to which an edge in doubles is not exact."""
    end = math.nextafter(floats_around(seam)[0], -math.inf)
    prove(row.ends[0] < end, f"cell {row.cell}: it is too short")
    pieces = (row.cell, (row.ends[0], end), row.place), (row.cell + 1, (end, row.ends[1]), max(row.place, 0))
    return [map_row(program, ranges, *piece) for piece in pieces]


def image_of(program: Program, ranges: list[Arb], by: Arb, x: float) -> Arb:
    """Enclose the image of a place, less the turns of an axis that closes."""
    return program.at([arb(x), *ranges])[0] - by


def turns_of(row: Row, images: list[Arb], axis: tuple[Arb, Arb]) -> list[tuple[int, int]]:
    """Find in which turns of a closed axis the image of a cell lies, and where on the cell, as `Row` has it."""
    first, period = axis
    prove(
        row.sign != 0,
        f"cell {row.cell}: the axis closes, and where the slope may be 0 no laps are known then",
    )
    near = all(abs(image) < MOST_ROUNDS * period for image in images)
    prove(near, f"cell {row.cell}: an image is not bounded by {MOST_ROUNDS} turns of the axis")
    low, high = images if row.sign > 0 else images[::-1]
    least, most = ((low - first) / period).mid().floor(), ((high - first) / period).mid().ceil() - 1
    least, most = int(float(least)), int(float(most))
    least -= 0 if low >= first + least * period else 1
    most += 0 if high <= first + (most + 1) * period else 1
    inside = low >= first + least * period and high <= first + (most + 1) * period
    prove(bool(inside) and least <= most <= least + 1, f"cell {row.cell}: its image is as long as the axis")
    if least == most:
        return [(least, -1)]
    return [(least, 0 if row.sign > 0 else 1), (most, 1 if row.sign > 0 else 0)]
