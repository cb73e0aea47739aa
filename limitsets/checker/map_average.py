"""Averages of a map of a line: what the inequalities of `orbit_average` need of its cells.

docs/certificates.md, "Averages".  The seam of an axis that closes is an end of N: where an image may pass it, the map
has a change of branch there.
"""

import itertools
from collections.abc import Iterator

import numpy as np
from flint import arb

from .any_map import Map
from .balls import Arb, Array, about, floats_around, prove
from .map_cells import MapCells
from .observable import Average, Observed, OnCell, observed
from .orbit_average import Enclosed, Step, check_line, enclosed, step_of


def check_map_average(the_map: Map, c: MapCells, average: Average) -> None:
    """Check the bounds of all components that have them."""
    functions = observed(average, the_map.program_of, the_map.piece([]).balls)
    edges = [axes[0] for axes in c.edges]
    for component in average.components():
        own = c.component == component
        closed = any(periods[0] is not None and own[c.start[s]] for s, periods in enumerate(c.periods))
        prove(not closed or bool(own.all()), "an axis closes, and not all cells are of one component")
    check_line(c, edges, average, lambda own: enclosed_steps(the_map, c, functions, own))


def enclosed_steps(the_map: Map, c: MapCells, functions: list[Observed], own: Array) -> Iterator[Step]:
    """Enclose what the inequalities need of the cells of a component, by side and branch."""
    possible = [to[:, 0] != -2 for to in c.target]
    both, sides = np.sum(possible, axis=0) > 1, c.side_of(np.arange(len(c.rank)))
    for side, branch in itertools.product(range(len(c.edges)), range(len(possible))):
        cells, to = np.flatnonzero(own & possible[branch] & (sides == side)), c.to[branch][side]
        if not len(cells):
            continue
        period, edges = c.periods[to][0], c.edges[to][0]
        prove(period is None or len(possible) == 1, "an axis closes, of a map of two branches")
        listed, ways, rows = list[Enclosed](), list[int](), list[tuple[bool, bool]]()
        for cell, ends in zip(cells.tolist(), c.ends(cells, side).tolist(), strict=True):
            outer = [cell == c.start[side], cell == c.start[side + 1] - 1]
            with about(c.name(cell)):
                ways.append(way_of(the_map, (side, branch), ends) if both[cell] else 0)
                one, *row = enclosed_cell(the_map, functions, (side, branch), ends, (edges[0], period, outer))
            listed.append(one)
            rows.append((row[0], row[1]))
        target = np.where(both[cells, None], c.target[branch][cells].astype(np.int64), -1)
        passes, rises = np.array(rows).T
        steps = [step_of(cells, to, listed, target, both[cells] | passes, np.array(ways))]
        if passes.any() and period is not None:
            seam = edges[0], floats_around(arb(edges[0]) + period)[1]
            steps.append(beyond_seam(steps[0], passes, rises, seam))
        yield from steps


def beyond_seam(step: Step, passes: Array, rises: Array, seam: tuple[float, float]) -> Step:
    """Cut images that may pass the seam: those of `step` end there, those of the step that is returned begin there."""
    first, last = seam
    step.off[passes] += 2.0**-48 * (abs(first) + 2.0 * abs(last))
    rows = {name: each if name == "to" else each[passes] for name, each in step._asdict().items()}
    ends = np.stack(
        [np.full(len(rows["cells"]), first), np.maximum(rows["ends"][:, 1] - last + first, first)], axis=1
    )
    step.ends[passes, 1], step.way[passes] = last, np.where(rises, 0, 1)[passes]
    return Step(**rows)._replace(ends=ends, way=np.where(rises, 1, 0)[passes])


def way_of(the_map: Map, key: tuple[int, int], ends: list[float]) -> int:
    """Return on which side of its change of branch an undecided cell takes a branch; there is one change at most."""
    side, branch = key
    slope = the_map.margin[side].gradients(the_map.piece([(ends[0], ends[1])]).balls)[0][0]
    prove(slope > 0 or slope < 0, "that it holds one change of branch at most is not proved")
    return branch if slope > 0 else 1 - branch


def turned_images(
    images: list[Arb], axis: tuple[Arb, Arb], outer: tuple[bool, bool]
) -> tuple[list[Arb], bool]:
    """Turn the ends of an image to the first period of an axis that closes, and say whether it may pass the seam.

    An image may begin or end on the seam exactly, as by f(0) = 0, where `outer` says that the cell does so at an end of
    N; at a border inside N there would be a change of branch between two cells.
    """
    (first, last), (below, above), passes = axis, outer, False
    period = last - first
    turns = (((images[0] + images[1]) / 2 - first) / period).mid().floor()
    images = [y - turns * period for y in images]
    if not (images[0] > first or (below and images[0] >= first)):
        images = [y + period for y in images]
        passes = True
    passes = passes or not (images[1] < last or (above and images[1] <= last))
    fits = images[0] > first and images[1] < last + period
    prove(fits or not passes, "its image is as long as the axis")
    return images, passes


def enclosed_cell(
    the_map: Map,
    functions: list[Observed],
    key: tuple[int, int],
    ends: list[float],
    axis: tuple[float, Arb | None, list[bool]],
) -> tuple[Enclosed, bool, bool]:
    """Enclose what the inequalities need of a cell; whether its image may pass the seam, and whether f rises.

    `axis` has the first edge and the period where f leads, and whether the ends of the cell are the first and the last
    edge of its own side, hence ends of N.
    """
    program, ranges, (first_edge, period, outer) = the_map.image[key], the_map.piece([]).balls, axis
    x, middle = arb(ends[0]).union(arb(ends[1])), (arb(ends[0]) + arb(ends[1])) / 2
    _, slope, second = program.bend([x, *ranges])
    rises = bool(slope > 0)
    images = [program.at([arb(end), *ranges])[0] for end in (ends if rises else ends[::-1])]
    passes = False
    if period is not None and all(y.is_finite() for y in images):
        below, above = outer if rises else outer[::-1]
        images, passes = turned_images(images, (arb(first_edge), arb(first_edge) + period), (below, above))
    at = OnCell(
        *key, (ends[0], ends[1]), x, middle=middle, bend=second / slope,
        slope=lambda: abs(program.gradients([middle, *ranges])[0][0]),
    )  # fmt: skip
    return enclosed(slope, second, images, functions, at), passes, rises
