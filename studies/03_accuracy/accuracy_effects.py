"""What an effect costs, and what leaving it out costs: for any table of maps beside a bare one.

The place for effects as they come: `costs` takes the bare map and maps by name, each with one effect switched on.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from accuracy_points import timed
from matplotlib.figure import Figure

import limitsets as ls

__all__ = ["Cost", "costs", "effects_figure"]


class Cost(NamedTuple):
    """One effect.

    Attributes
    ----------
    name : str
        Its name.
    ratio : float
        Seconds of a throw with it over those of the bare map.
    typical, worst : float
        Median and 95 % quantile of how far x' is off where it is left out, over the starts for which neither the side
        nor the branch changes [scene's unit].
    changed : float
        Share of the starts that land on another side, or leave, where it is left out.
    """

    name: str
    ratio: float
    typical: float
    worst: float
    changed: float


def costs(bare: Any, maps: Mapping[str, Any], x: Any, side: int, least: float = 0.2) -> list[Cost]:
    """Compare maps with the bare one on many starts of one side.

    Parameters
    ----------
    bare : NamedTuple
        The map without effects.
    maps : mapping of str to NamedTuple
        By name of the effect, the map with it.
    x : ndarray, shape (n,)
        Starts.
    side : int
        Their side.
    least : float
        Seconds to spend on each timing.
    """
    plain, seconds = timed(lambda: ls.maps.images(bare, x, side), least, 2000)
    rows = []
    for name, params in maps.items():
        found, took = timed(lambda params=params: ls.maps.images(params, x, side), least, 2000)
        same = (found.side == plain.side) & (found.code == plain.code)
        off = np.abs(found.x - plain.x)[same]
        typical, worst = np.quantile(off, (0.5, 0.95)) if off.size else (np.nan, np.nan)
        rows.append(Cost(name, took / seconds, float(typical), float(worst), float(1.0 - same.mean())))
    return rows


def effects_figure(rows: list[Cost], unit: str = "in") -> Figure:
    """Error of leaving an effect out against what it costs to have it."""
    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    axes = figure.subplots()
    for k, row in enumerate(rows):
        colour = f"C{k}"
        axes.plot([row.ratio] * 2, [row.typical, row.worst], color=colour, marker="_", linewidth=2)
        axes.plot(
            row.ratio, row.typical, "o", color=colour, label=f"{row.name}: {row.changed:.1%} land elsewhere"
        )
    axes.set(xscale="log", yscale="log", xlabel="seconds of a throw, relative to the bare map")
    axes.set_ylabel(f"error of x' if left out [{unit}]: median, up to 95 %")
    axes.grid(alpha=0.25)
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    return figure
