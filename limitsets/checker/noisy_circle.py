"""A noisy map whose axes close: one period of cells, and functions that are continued by copies on both sides.

docs/certificates.md, "Steps that land with noise".  Images are moved by whole periods to near the cells, so that an
image with its noise lies within three periods.  A function is what it is on the cells, on [e_0, e_0 + P); the last cell
ends no earlier.  The nodes of a copy are those of the cells moved by a period, off by at most `off`: between them the
copy is off by at most four times that times its steepest slope.
"""

import itertools
import math

import numpy as np
from flint import arb

from .any_map import Map
from .balls import Array, exact, prove
from .landings import upper
from .laws import Law
from .means import Graph, Mesh, Ranges
from .noisy_map import (
    BranchOfCell,
    StepOfMap,
    Stratum,
    between_ends,
    chain_of_map,
    mesh_of_map,
)
from .steps import Chain


class ChainOfCircles:
    """The chain on one period of each side: `copied` is that on three periods, `own` the nodes of the middle one there.

    `source`: by node of three periods that of one.
    """

    def __init__(self, mesh: Mesh, copied: Chain, own: Array, source: Array, off: float):
        self.mesh, self.copied, self.own, self.source, self.off = mesh, copied, own, source, off
        # the first and the last node of each side are one place
        self.seam = mesh.first[:-1] + 1, mesh.first[1:] - 2

    def joined(self, values: Array) -> Array:
        """Let a function have its larger value on both sides of a seam."""
        whole = values.copy()
        for nodes in self.seam:
            whole[nodes] = np.maximum(*(values[k] for k in self.seam))
        return whole

    def above(self, values: Array, fixed: Array, more: float = 0.0) -> Array:
        """Bound `more` and the mean of V after a step from above; nothing is fixed."""
        copies = self.joined(values)[self.source]
        graph = Graph(self.copied.mesh, copies)
        steepest = float(graph.steepest_on(Ranges(*(np.array([k]) for k in (0, len(copies) - 2))))[0])
        free = np.full(len(copies), -np.inf)
        bounds, above = fixed.copy(), self.copied.above(copies, free, more + 4.0 * self.off * steepest)
        inner = np.flatnonzero(self.own >= 0)
        bounds[inner] = np.maximum(bounds[inner], above[self.own[inner]])
        return self.joined(bounds)


def chain_of_circles(
    the_map: Map, strata: list[Stratum], edges: list[Array], law: Law
) -> tuple[ChainOfCircles, list[list[BranchOfCell]]]:
    """Prove the steps from all cells; with the cells on their branches, by stratum."""
    periods = [axes[0] for axes in the_map.periods if axes[0] is not None]
    prove(len(periods) == len(edges), "of several sides some close, and others end")
    # where landings of one step meet again, their density is larger than the law's
    prove(all(2 * exact(law.reach) <= each for each in periods), "the noise is longer than a period")
    mesh = mesh_of_map(edges, law)
    copies, off = list[Array](), 0.0
    for e, period in zip(edges, periods, strict=True):
        moved = [[arb(float(x)) + k * period for x in e] for k in (-1, 1)]
        before, after = (np.array([float(x.mid()) for x in some]) for some in moved)
        places = [*itertools.chain(*moved), arb(float(e[0])) + period]
        floats = [*before, *after, e[-1]]
        off = max(off, *(upper(abs(x - float(y))) for x, y in zip(places, floats, strict=True)))
        copies.append(np.concatenate([before[:-1], e, after[1:]]))
        prove(bool((np.diff(copies[-1]) > 0.0).all()), "the nodes of a copy do not ascend")
        narrow = float(np.diff(copies[-1]).min())
        prove(4.0 * off < narrow, "the nodes of an axis that closes are too close to each other")
    whole = mesh_of_map(copies, law)
    own, source = np.full(len(mesh.place), -1), np.zeros(len(whole.place), dtype=np.int64)
    for side, e in enumerate(edges):
        n, first, at = len(e) - 1, int(mesh.first[side]) + 1, int(whole.first[side]) + 1
        own[first : first + n + 1] = at + n + np.arange(n + 1)
        source[at - 1 : at + 3 * n + 2] = first + np.clip(np.arange(-1, 3 * n + 2), 0, 3 * n) % n

    def turned(steps: list[StepOfMap]) -> list[StepOfMap]:
        moved = []
        for step in steps:
            lo, hi = step.range
            e, period = copies[step.to], periods[step.to]
            turns = math.floor((0.5 * lo + 0.5 * hi - float(edges[step.to][0])) / float(period.mid()))
            by = -turns * period
            lo, hi = -upper(-(arb(lo) + by)), upper(arb(hi) + by)
            if not (arb(float(e[0])) + exact(law.reach) < lo and hi < arb(float(e[-1])) - exact(law.reach)):
                return []
            images = step.images[0] + by, step.images[1] + by
            moved.append(step._replace(images=images, range=(lo, hi), moved=by))
        return moved

    live = own[between_ends(mesh)]
    copied, pieces = chain_of_map(strata, whole, law, live, {}, turned)
    prove(len(copied.live) == len(live), "the image of a cell is not enclosed, or longer than a period")
    back = np.zeros(len(whole.place), dtype=np.int64)
    back[own[own >= 0]] = np.flatnonzero(own >= 0)
    inner = [[piece._replace(at=int(back[piece.at])) for piece in some] for some in pieces]
    return ChainOfCircles(mesh, copied, own, source, off), inner
