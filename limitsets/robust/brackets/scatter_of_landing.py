"""The mean of a function over the deviations of the landing place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from limitsets.robust.brackets.averages import Average, mean_matrix
from limitsets.robust.brackets.densities import Staircase
from limitsets.robust.brackets.nodes import Nodes
from limitsets.robust.brackets.spans import Bends, Curvature, Span, Swings

Array = NDArray[np.float64]

# Above the relative error of one addition.
ULP = 2.0**-52


def landing_average(target: Nodes, source: Nodes, law: Staircase) -> Average:
    """Build the average of V(y + e) over e, as a function of y.

    Parameters
    ----------
    target : Nodes
        Of V.
    source : Nodes
        Of y; the outermost nodes lie as far out.
    law : Staircase
        Of e.
    """
    n, strata = source.place.size, law.weight.size
    side, y = source.side(), source.place
    reach = max(law.borders[-1], -law.borders[0])
    # Far out V is constant, and stays so within reach.
    y = np.clip(y, target.place[0] + reach, target.place[-1] - reach)
    row = np.repeat(np.arange(n), strata)
    ends = y[:, None] + law.borders
    matrix = mean_matrix(
        n,
        target,
        row,
        np.tile(law.weight, n),
        np.repeat(side, strata),
        ends[:, :-1].ravel(),
        ends[:, 1:].ravel(),
    )
    cells = np.flatnonzero(np.isfinite(source.width))
    h = np.maximum(y[cells + 1] - y[cells], 0.0)
    cells, h = cells[h > 0.0], h[h > 0.0]
    jumps = -np.diff(law.density, prepend=0.0, append=0.0)
    bends, swings = [], []
    for border, jump in zip(law.borders, jumps, strict=True):
        # A tenth of a rounding: where nothing jumps nothing bends.
        if abs(jump) > 1e-12 * law.density.max():
            span = _span(target, side[cells], y[cells] + border, y[cells + 1] + border)
            much = h * h / 8.0 * jump
            cap = 0.25 * h * abs(jump)
            bends.append(Bends(cells, much, much, cap, span))
    if law.ripple:
        span = _span(target, side[cells], y[cells] + law.borders[0], y[cells + 1] + law.borders[-1])
        swings.append(Swings(cells, np.full(cells.size, law.ripple), span))
    whole = _span(target, side, y + law.borders[0], y + law.borders[-1])
    # The places y + e are rounded: each end of a stratum moves the mean by what the density jumps there.
    off = np.abs(jumps).sum() * ULP * (np.abs(y) + reach)
    return Average(
        source,
        target,
        matrix,
        beyond=law.beyond,
        at_nodes=(Swings(np.arange(n), off, whole),),
        swings=tuple(swings),
        ways=(Curvature(cells, tuple(bends)),),
    )


def _span(target: Nodes, side: NDArray[np.int64], lo: Array, hi: Array) -> Span:
    return Span(target.cell(side, lo), target.cell(side, hi))
