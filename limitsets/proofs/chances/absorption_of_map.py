"""The chain of a map of a line whose steps scatter and end at places: its cells, its steps, its certificate."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Array
from limitsets.proofs.chances.chain import Chain, Place
from limitsets.proofs.chances.nodes import CLOSE, Nodes
from limitsets.proofs.prover.averages_of_map import cut_at_changes
from limitsets.proofs.prover.certificate_of_map import Part, write_map
from limitsets.proofs.prover.noise_of_map import (
    LEAST,
    Bounds,
    Noise,
    as_checked,
    nodes_for,
    noise_of,
    require_noise,
)
from limitsets.systems.cells import Grid


def whole_grid(grid: Grid) -> list[Place]:
    """Give the starts where none are named: all of the grid."""
    ends = (edges[0][[0, -1]].tolist() for edges in grid.edges)
    return [(side, lo, hi) for side, (lo, hi) in enumerate(ends)]


def require_on_grid(grid: Grid, places: Sequence[Place]) -> None:
    """Require a grid of lines that end, and places of it."""
    if grid.domain.closes:
        raise AnswerError(
            "the grid", "an axis that closes", "one that ends", "orbits end where they leave a line"
        )
    for side, lo, hi in places:
        borders = grid.edges[side][0] if side in range(grid.sides) else np.full(1, np.nan)
        if not borders[0] <= lo < hi <= borders[-1]:
            raise AnswerError("a place", (side, lo, hi), "(side, from x, to x) on the grid", "correct it")


def chain_of_map(
    lower: Any,
    upper: Any,
    grid: Grid,
    noise: Bounds | None,
    starts: Sequence[Place],
    absorbing: Mapping[str, Sequence[Place]],
) -> tuple[Chain, Noise]:
    """Prove a map's steps on cells; what lands off the grid has ended.

    Raises
    ------
    AnswerError
        A grid that is no line, or closes; noise or places that do not fit; an image that is not enclosed.
    """
    if grid.dimension != 1:
        raise AnswerError("the grid", f"{grid.dimension} axes", "one", "probabilities are of a line")
    own = noise_of(lower, 0.0 if noise is None else noise)
    require_noise(
        lower, upper, grid, own.landing, "pass noise=e: each step lands within e of the image",
        LEAST if own.varied is None else 0.0,
    )  # fmt: skip
    of_places = list(itertools.chain.from_iterable(absorbing.values()))
    require_on_grid(grid, [*starts, *of_places])
    import flint

    from limitsets.checker.balls import PRECISION, UnprovedError
    from limitsets.checker.file import BadFileError
    from limitsets.checker.map_chances import chain_that_ends, read_places_of_map

    jumps = [(side, x) for side, *ends in [*whole_grid(grid), *of_places] for x in ends]
    # where the branch changes nodes were taken out
    cut = [
        (np.union1d(axis, [x for k, x in jumps if k == side]),)
        for side, (axis,) in enumerate(cut_at_changes(lower, upper, grid, jumps).edges)
    ]
    fine = Grid(grid.domain, tuple(cut))
    boxes = {name: [_in_file(each) for each in some] for name, some in absorbing.items()}
    section = own.section() | {"starts": [_in_file(each) for each in starts], "absorbing": boxes}
    with flint.ctx.workprec(PRECISION):
        the_map = as_checked(lower, upper, grid)
        edges = [_beyond(each) for each in nodes_for(the_map, fine, jumps)]
        noisy = own.checked(starts, edges)
        try:
            places = read_places_of_map(section["absorbing"], noisy.starts, grid.sides, "the map")
            steps, row = chain_that_ends(the_map, noisy, places)
        except (BadFileError, UnprovedError) as error:
            allowed = "places apart from each other, on cells whose images are enclosed"
            raise AnswerError("the chain", type(lower).__name__, allowed, str(error)) from None

    def packed(path: str | Path, section: dict[str, Any], arrays: dict[str, Array], **how: Any) -> None:
        nodes = {f"nodes.{side}": each for side, each in enumerate(edges)}
        part = Part((lower, upper), {"probabilities": section}, nodes | arrays)
        write_map(path, grid.domain, [part], goal=None, **how)

    nodes = Nodes(np.concatenate(edges), np.cumsum([0, *(each.size for each in edges)]))
    return Chain(section, nodes, steps, row, packed), own


def _in_file(place: Place) -> dict[str, Any]:
    """Write a place as a certificate has it."""
    side, *ends = place
    return {"side": side, "box": [[float(end).hex() for end in ends]]}


def _beyond(edges: Array) -> Array:
    """Put a node beyond either end: what lands there has left the domain."""
    close = max(CLOSE * float(np.ptp(edges)), 4.0 * float(np.spacing(np.abs(edges).max())))
    return np.concatenate([[edges[0] - close], edges, [edges[-1] + close]])
