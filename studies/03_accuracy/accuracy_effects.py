"""What an effect costs, and what leaving it out costs, on the limit sets of the scenes at hand.

`costs` takes the bare map and a table of maps by name, each with one effect switched on.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from accuracy_points import timed
from matplotlib.figure import Figure

import limitsets as ls

__all__ = ["SCENES", "Cost", "costs", "effect_costs", "effects_figure"]

SCENES = ("paper-designed", "paper-initial")

# Facts of a steel part on a rubber-covered arm, say: all that the effects need to know.
WORLD = {"friction": 0.9, "restitution": 0.2, "bounce_threshold": "0.01 in", "stroke": "5 deg"}
QUICK = ("landing", "roll")
EFFECTS = (*QUICK, "slip", "pivot", "bounce", "drive")

# Throws of the bare map's orbit that are the starts, after those that lead to the limit set.
STARTS, TRANSIENT = 4000, 1000

# Where a difference of nothing is drawn, for a logarithm has no place for it [in].
NOTHING = 1e-14

# One for each effect, so that grey prints tell them apart.
MARKERS = "osD^vP"


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


def costs(bare: Any, maps: Mapping[str, Any], starts: Mapping[int, Any], least: float = 0.2) -> list[Cost]:
    """Compare maps with the bare one on many starts.

    Parameters
    ----------
    bare : NamedTuple
        The map without effects.
    maps : mapping of str to NamedTuple
        By name of the effect, the map with it.
    starts : mapping of int to ndarray
        Starts by side.
    least : float
        Seconds to spend on each timing.
    """

    def throw(params: Any) -> tuple[Any, Any, Any]:
        found = [ls.maps.images(params, x, side) for side, x in starts.items()]
        return tuple(
            np.concatenate([getattr(each, what) for each in found]) for what in ("x", "side", "code")
        )

    (x, side, code), seconds = timed(lambda: throw(bare), least, 2000)
    rows = []
    for name, params in maps.items():
        (to, on, became), took = timed(lambda params=params: throw(params), least, 2000)
        same = (on == side) & (became == code)
        off = np.abs(to - x)[same]
        typical, worst = np.quantile(off, (0.5, 0.95)) if off.size else (np.nan, np.nan)
        rows.append(Cost(name, took / seconds, float(typical), float(worst), float(1.0 - same.mean())))
    return rows


def effect_costs(scene: str, quick: bool = False) -> list[Cost]:
    """Measure each effect on the states of one orbit in the limit set of a built-in scene."""
    bare = ls.load(scene)
    path = ls.orbit(bare.map, 0.6 * bare.arm_length, 2, TRANSIENT + STARTS)
    x, side = path.x[TRANSIENT:-1], path.side[TRANSIENT:-1]
    starts = {int(s): np.ascontiguousarray(x[side == s]) for s in np.unique(side)}
    maps = {}
    for effect in QUICK if quick else EFFECTS:
        maps[effect] = ls.load(bare.as_dict() | {"effects": {effect: True}, "world": WORLD}).map
    return costs(bare.map, maps, starts, 0.02 if quick else 0.2)


def effects_figure(panels: Mapping[str, list[Cost]], unit: str = "in") -> Figure:
    """Error of leaving an effect out against what it costs to have it, a panel for each scene."""
    figure = Figure(figsize=(5.2 * len(panels), 5.2), layout="constrained")
    columns = np.atleast_1d(figure.subplots(1, len(panels), sharey=True))
    for axes, (title, rows) in zip(columns, panels.items(), strict=True):
        for k, row in enumerate(rows):
            low, high = max(row.typical, NOTHING), max(row.worst, NOTHING)
            axes.plot([row.ratio] * 2, [low, high], color=f"C{k}", marker="_", linewidth=2)
            label = f"{row.name}: {row.changed:.1%} land elsewhere"
            axes.plot(row.ratio, low, MARKERS[k], color=f"C{k}", ls="", label=label)
        axes.set(xscale="log", yscale="log", title=title, ylim=(NOTHING / 3, 10.0))
        axes.set_xlabel("seconds of a throw, relative to the bare map")
        axes.axhspan(NOTHING / 3, 3 * NOTHING, color="0.92")
        axes.annotate(
            "no difference but rounding", (0.97, 0.08), xycoords="axes fraction", color="0.35", ha="right"
        )
        axes.grid(alpha=0.25)
        axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.16), ncols=1, frameon=False, fontsize=9)
    figure.axes[0].set_ylabel(f"error of x' if left out [{unit}]: median, up to 95 %")
    return figure
