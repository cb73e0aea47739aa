"""Laps of the throw: what `entropy` needs of its cells."""

import functools
from collections.abc import Iterator

import numpy as np
from flint import arb

from .balls import about
from .entropy import Entropy, Lap, Row, Runs, check_entropy, laps_of
from .file import Cells
from .model import at_angle
from .scene import Scene
from .throw_average import ThrowsOfSide, require_on_arm


def check_throw_entropy(scene: Scene, c: Cells, claim: Entropy) -> None:
    """Check the entropy of one scene without noise."""
    require_on_arm(scene, c, np.unique(c.component[c.component >= 0]).tolist())
    check_entropy(list(laps_of_throws(scene, c)), Runs(c, c.edges), claim)


def laps_of_throws(scene: Scene, c: Cells) -> Iterator[Lap]:
    """Find the laps of the attracting cells, by side and branch."""
    for side, edges in enumerate(c.edges):
        own = (c.component >= 0) & (c.side == side)
        if not own.any():
            continue
        throws = ThrowsOfSide(scene, side)
        for branch in (0, 1):
            cells = np.flatnonzero(own & ((c.branch == branch) | (c.branch == 2)))
            k = cells - int(c.start[side])
            rows = []
            for cell, lo, hi in zip(cells.tolist(), edges[k].tolist(), edges[k + 1].tolist(), strict=True):
                with about(c.name(cell)):
                    place = throws.way(branch, (lo, hi)) if c.branch[cell] == 2 else -1
                    rows.append(throw_row(throws, cell, branch, (lo, hi), place))
            image = functools.partial(throws.image, branch=branch)
            yield from laps_of(side, (side + branch) % len(c.edges), rows, image)


def throw_row(throws: ThrowsOfSide, cell: int, branch: int, ends: tuple[float, float], place: int) -> Row:
    """Enclose a throw and its slopes on a cell."""
    angles = throws.angles(ends)
    slope, second = throws.slopes(angles)
    image = arb(ends[0]).union(arb(ends[1])) + at_angle(throws.s, angles).D
    return Row(cell, ends, slope, second, image - throws.s.shift if branch else image, place)
