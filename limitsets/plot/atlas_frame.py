"""What the pictures of an atlas share: axes, pixels about the points, hatches, and the mark of the scene itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.patheffects import Normal, Stroke, withTickedStroke

from limitsets.plot import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.sweep import Atlas


def title_of(found: Atlas) -> str:
    """Name what is varied."""
    return str(found.dataset.attrs.get("title", "")).removeprefix("atlas of ")


# Hatch of points at which no part gets to the X of the goal: another than those of the classes in `atlas_maps`.
UNREACHED = "oo"


def frame(found: Atlas, tall: float = 0.0) -> tuple[Figure, Axes]:
    """Make a figure with its axes labelled, flat where one quantity varies, but at least so tall [inches]."""
    names = found.axes
    figure, (axes,) = style.canvas(10.2, max(5.4 if len(names) == 2 else 2.6, tall))
    axes.set_xlabel(_with_unit(found, names[-1]))
    if len(names) == 2:
        axes.set_ylabel(_with_unit(found, names[0]))
    x, y = pixels(found)
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(y[0], y[-1])
    return figure, axes


def _with_unit(found: Atlas, name: str) -> str:
    unit = found.dataset[name].attrs.get("units", "")
    return f"{name} [{unit}]" if unit else name


def edges(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Give the edges of pixels about values: half way between them."""
    if values.size == 1:
        return np.array([values[0] - 0.5, values[0] + 0.5])
    middle = 0.5 * (values[1:] + values[:-1])
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])


def pixels(found: Atlas) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Edges of the pixels along x and along y."""
    data, names = found.dataset, found.axes
    across = edges(data[names[-1]].values)
    return across, edges(data[names[0]].values) if len(names) == 2 else np.array([0.0, 1.0])


def hatched(
    axes: Axes,
    x: npt.NDArray[np.float64],
    y: npt.NDArray[np.float64],
    where: npt.NDArray[np.bool_],
    hatch: str,
) -> None:
    """Hatch pixels, given their edges."""
    if not where.any():
        return
    # a box for each row of neighbours: contours would cut the corners of pixels
    vertices: list[tuple[float, float]] = []
    for i, row in enumerate(where):
        ends = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]]).astype(np.int8)))
        for a, b in zip(ends[::2].tolist(), ends[1::2].tolist(), strict=True):
            vertices += [(x[a], y[i]), (x[b], y[i]), (x[b], y[i + 1]), (x[a], y[i + 1]), (x[a], y[i])]
    codes = [Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY] * (len(vertices) // 5)
    axes.add_patch(
        PathPatch(
            Path(vertices, codes), facecolor="none", edgecolor=style.INK, hatch=hatch, lw=0.0, zorder=2, alpha=0.55,
            hatch_linewidth=0.5,
        )
    )  # fmt: skip


def goal_line(axes: Axes, found: Atlas) -> list[Any]:
    """Draw where the scene's goal begins or ceases to hold, ticks where it fails; the entry of a legend."""
    data = found.dataset
    if "threshold" not in data:
        return []
    from limitsets.goals import OrientedBeyond

    goal = _goal_of(found)
    over = (data["threshold"].values - goal.x) * (1 if isinstance(goal, OrientedBeyond) else -1)
    fails = over[np.isfinite(over)] > 0.0
    if fails.all() or not fails.any():
        word = "fails" if fails.any() else "holds"
        return (
            [Patch(label=f"the goal {word} wherever there is a limit set", alpha=0.0)] if fails.size else []
        )
    ticks: dict[str, Any] = {"spacing": 8.0, "length": 0.6}
    looks = [Stroke(linewidth=3.2, foreground="white"), Normal()]
    names = found.axes
    if len(names) == 2:
        xs, ys = (data[name].values for name in reversed(names))
        line = axes.contour(
            xs, ys, np.ma.masked_invalid(over), [0.0], colors=style.GOAL, linewidths=1.6, zorder=4
        )
        # a contour has the higher values on its left
        line.set(path_effects=[*looks, withTickedStroke(angle=90, **ticks)], gid="goal")
    else:
        x = data[names[0]].values
        both = np.isfinite(over[1:]) & np.isfinite(over[:-1])
        for k in np.flatnonzero(both & ((over[1:] > 0.0) != (over[:-1] > 0.0))).tolist():
            at = x[k] - over[k] * (x[k + 1] - x[k]) / (over[k + 1] - over[k])
            angle = -90 if over[k + 1] > over[k] else 90
            effects = [*looks, withTickedStroke(angle=angle, **ticks)]
            axes.axvline(at, color=style.GOAL, lw=1.6, zorder=4, gid="goal", path_effects=effects)
    ticked = [withTickedStroke(angle=-90, **ticks)]
    return [
        style.key("the goal fails on the side of the ticks", color=style.GOAL, lw=1.6, path_effects=ticked)
    ]


def _goal_of(found: Atlas) -> Any:
    """Read the goal of an atlas that says thresholds: only these two kinds have one."""
    from limitsets.goals import OrientedBeyond, Reaches
    from limitsets.scene import load

    goal = load(found.dataset.attrs["scene"]).goal
    assert isinstance(goal, OrientedBeyond | Reaches)
    return goal


def unreached(axes: Axes, found: Atlas) -> list[Any]:
    """Hatch where no part gets to the goal's X: a goal that asks of parts beyond X holds there of none.

    Returns the entry of a legend.
    """
    data = found.dataset
    if "threshold" not in data or "reach" not in data:
        return []
    goal = _goal_of(found)
    reach = np.where(np.isnan(data["reach"].values), -np.inf, data["reach"].values)
    farthest = reach.reshape(*data["threshold"].shape, -1, reach.shape[-1]).max(axis=(-2, -1))
    none = np.isfinite(farthest) & (farthest <= goal.x)
    if not none.any():
        return []
    hatched(axes, *pixels(found), np.atleast_2d(none), UNREACHED)
    return [
        Patch(
            label=f"no part gets to x = {goal.x:g}", hatch=UNREACHED, fill=False, edgecolor=style.INK, lw=0.5
        )
    ]


def mark(axes: Axes, found: Atlas) -> list[Any]:
    """Mark the scene or map itself, if it lies in the window; the entry of a legend."""
    values = []
    for name in found.axes:
        value, given = _value_of(found, name), found.dataset[name].values
        if value is None or not given[0] <= value <= given[-1]:
            return []
        values.append(value)
    look: dict[str, Any] = {
        "marker": "*",
        "ms": 13.0,
        "mfc": "white",
        "mec": style.INK,
        "mew": 1.0,
        "ls": "none",
    }
    x, y = values[-1], values[0] if len(values) == 2 else 0.15
    axes.plot([x], [y], zorder=6, gid="design", **look)
    numbers = ", ".join(f"{value:.6g}" for value in reversed(values))
    return [style.key(f"{title_of(found)}: {numbers}", **look)]


def _value_of(found: Atlas, name: str) -> float | None:
    """Return the value of a quantity in the scene or map that is varied, in the unit of its axis."""
    data, plan = found.dataset, found.dataset.attrs["plan"]
    if "scene" not in plan:
        value = plan.get("parameters", {}).get(name)
        return float(value) if isinstance(value, int | float) else None
    from limitsets.scene import load
    from limitsets.scene.quantities import base_unit, find
    from limitsets.scene.units import exact_factor

    scene = load(data.attrs["scene"])
    base = base_unit(find(name).dimension, scene.unit)
    return scene.value(name) / float(exact_factor(data[name].attrs.get("units", ""), base))
