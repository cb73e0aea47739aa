"""Proved regions of parameters: boxes by what is proved of them, and lines between regions that are not one."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from limitsets.base import AnswerError, arguments_checked
from limitsets.face.plot import style
from limitsets.face.plot.basin import ATTRACTORS

UNDECIDED, PROVED, REFUTED = range(3)
EDGE: dict[str, Any] = {"edgecolor": "#777777", "lw": 0.25}


@arguments_checked
def regions(found: Any) -> Figure:
    """Draw regions of one or two parameters: proved by the number of attractors, refuted, and undecided.

    Parameters
    ----------
    found : RegionsOfMap or Regions
        From `limitsets.regions.certified_map`, `limitsets.regions.certified`, or `certify` of an atlas.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    AnswerError
        For regions of three parameters.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.regions import certified_map
    >>> lower, upper = ls.maps.Logistic(2.0), ls.maps.Logistic(2.5)
    >>> found = certified_map(lower, ls.grid([(0.1, 0.9)], cells=256), ["attracts-all", "trapping"], upper=upper)
    >>> len(ls.plot.regions(found).axes)
    1
    """
    if len(found.axes) > 2:
        raise AnswerError(
            "the regions", f"of {len(found.axes)} parameters", "of one or two", "fix one of them"
        )
    ends = [np.array([float(border) for border in axis.borders]) for axis in found.axes]
    line = len(ends) == 1
    figure, (axes,) = style.canvas(6.8, 2.2 if line else 5.8)
    ends += [np.array([0.0, 1.0])] if line else []
    shares: dict[tuple[int, int], float] = {}
    whole = float(np.prod([side[-1] - side[0] for side in ends]))
    for at, code, blocks in zip(
        found.index.tolist(), found.code.tolist(), found.blocks.tolist(), strict=True
    ):
        (left, right), (low, high) = (
            side[k] for side, k in zip(ends, [at[:2], at[2:] or [0, 1]], strict=True)
        )
        kind = (code, blocks if code == PROVED else 0)
        shares[kind] = shares.get(kind, 0.0) + (right - left) * (high - low) / whole
        axes.add_patch(Rectangle((left, low), right - left, high - low, gid=f"box {kind}", **_look(kind)))
    raster = found.raster(found.region).reshape(len(ends[0]) - 1, -1)
    axes.add_collection(LineCollection(_borders(raster, ends), colors=style.INK, lw=1.4, zorder=3))
    names = [f"{axis.quantity} [{axis.unit}]" if axis.unit else axis.quantity for axis in found.axes]
    axes.set(xlim=ends[0][[0, -1]], ylim=ends[1][[0, -1]], xlabel=names[0])
    if line:
        axes.set_yticks([])
    else:
        axes.set_ylabel(names[1])
    handles = [
        Patch(label=f"{_words(kind)}: {100 * shares[kind]:.4g} %", **_look(kind)) for kind in sorted(shares)
    ]
    return style.finished(figure, f"Proved regions of {' and '.join(names)}", handles, 2)


def _look(kind: tuple[int, int]) -> dict[str, Any]:
    """Give the face of a box: a colour by the number of attractors, a hatch where the goal is refuted."""
    code, blocks = kind
    if code == PROVED:
        return {"facecolor": ATTRACTORS[(blocks - 1) % len(ATTRACTORS)], **EDGE}
    return {
        "facecolor": "#D9D9D9" if code == REFUTED else "#FFFFFF",
        "hatch": "////" if code == REFUTED else "",
        **EDGE,
    }


def _words(kind: tuple[int, int]) -> str:
    code, blocks = kind
    if code != PROVED:
        return "refuted" if code == REFUTED else "undecided"
    return f"proved, at least {blocks} attractor{'' if blocks == 1 else 's'}" if blocks else "proved"


def _borders(raster: Any, ends: list[Any]) -> list[Any]:
    """Give the lines between smallest boxes of different regions, or of a region and none."""
    x, y = ends
    return [
        *([(x[i + 1], y[j]), (x[i + 1], y[j + 1])] for i, j in np.argwhere(raster[1:] != raster[:-1])),
        *([(x[i], y[j + 1]), (x[i + 1], y[j + 1])] for j, i in np.argwhere(raster.T[1:] != raster.T[:-1])),
    ]
