"""The map: x' against x, one panel per side, with an orbit as cobweb."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from limitsets.analysis import other_vertex_first
from limitsets.maps import FLIP, JOG, ROLL, Orbit, critical_points, images
from limitsets.plot import style
from limitsets.plot.style import Extents

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.scene import Scene

__all__ = ["map"]

SAMPLES = 1500
THROWS: dict[str, tuple[int, dict[str, Any]]] = {
    "jog": (JOG, {"color": style.JOG, "lw": 1.8}),
    "flip": (FLIP, {"color": style.FLIP, "lw": 1.8, "ls": style.FLIP_LINE}),
    "roll": (ROLL, {"color": style.ROLL, "lw": 1.8, "ls": style.ROLL_LINE}),
}
CRITICAL: dict[str, Any] = {"color": style.INK, "lw": 0.9, "ls": ":"}
ARRIVAL: dict[str, Any] = {"marker": "o", "ls": "", "mfc": "white", "mec": style.INK, "ms": 4.5}
DEPARTURE: dict[str, Any] = ARRIVAL | {"marker": "s", "mec": style.FLIP}
FLAG: dict[str, Any] = {"facecolor": "none", "edgecolor": "#bdbdbd", "hatch": "////", "lw": 0.0}


def map(scene: Scene, found: Any = None) -> Figure:  # noqa: A001 - ls.plot.map is the word for it
    """Draw x after a throw against x before it, one panel per side.

    Parameters
    ----------
    scene : Scene
        The scene.
    found : attractors, limit sets, one of them, or an Analysis, optional
        Drawn along the lower border, with an orbit on the first of them as cobweb; the picture then shows the
        surroundings of these sets and of the critical points, otherwise the whole arm.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    AnswerError
        For something without extents.

    Examples
    --------
    >>> import limitsets as ls
    >>> len(ls.plot.map(ls.load("paper-designed")).axes)
    3
    """
    sets = [] if found is None else style.extents_of(found)
    count = len(scene.sides)
    columns = count if count < 4 else math.ceil(count / 2)
    below = f"x before the throw [{scene.unit}]"
    figure, panels = style.panels(count, columns, (3.45, 3.45), (0.4, 1.35), below)
    critical, flags = critical_points(scene.map, scene.domain), other_vertex_first(scene)
    path = style.stretch(scene, sets[0], throws=10) if sets else None
    for side, axes in enumerate(panels):
        _branches(axes, scene, side)
        for lo, hi in flags[side]:
            axes.axvspan(lo, hi, zorder=0, gid="other vertex first", **FLAG)
        for point in critical[side]:
            axes.axvline(point.x, zorder=1, gid="critical point", **CRITICAL)
        for number, extents in enumerate(sets):
            look = {"ymin": 0, "ymax": 0.03, "lw": 0.8, "zorder": 4, **style.of_set(number)}
            for lo, hi in extents.get(side, ()):
                axes.axvspan(lo, hi, gid="limit set", **look)
        if path is not None:
            _cobweb(axes, path, side)
        _frame(axes, scene, side, [point.x for point in critical[side]])
    _limits(panels[0], scene, sets, [point.x for points in critical.values() for point in points])
    for k, axes in enumerate(panels):
        style.keep_apart(axes, 0.13)
        if k % columns == 0:
            axes.set_ylabel(f"x after the throw [{scene.unit}]")
    style.title(figure, f"Map of {scene.name}: one throw, from each side")
    rolls = any(line.get_gid() == "roll" for axes in panels for line in axes.lines)
    handles = _legend(sets, path, _visible(panels[0], flags), rolls)
    style.legend(figure, handles, 4)
    return figure


def _branches(axes: Axes, scene: Scene, side: int) -> None:
    x = np.linspace(float(scene.domain.lo[side, 0]), scene.arm_length, SAMPLES)
    there = images(scene.map, x, side)
    for name, (code, look) in THROWS.items():
        if code != ROLL or (there.code == ROLL).any():
            axes.plot(x, np.where(there.code == code, there.x, np.nan), zorder=3, gid=name, **look)
    whole = [0, scene.arm_length]
    axes.plot(whole, whole, color=style.FAINT, lw=0.8, zorder=1, gid="diagonal")


def _cobweb(axes: Axes, path: Orbit, side: int) -> None:
    """Draw the part of an orbit that lies on one side: up to the branch, across to the diagonal."""
    arriving = True
    for k in np.flatnonzero(path.side[:-1] == side):
        x, to = float(path.x[k]), float(path.x[k + 1])
        arriving = k == 0 or path.side[k - 1] != side
        if arriving:
            axes.plot([x], [x], zorder=6, gid="arrival", **ARRIVAL)
        stays = path.side[k + 1] == side
        axes.plot([x, x, to if stays else x], [x, to, to], color=style.INK, lw=0.8, zorder=5, gid="cobweb")
        if not stays:
            axes.plot([x], [to], zorder=6, gid="departure", **DEPARTURE)


def _limits(axes: Axes, scene: Scene, sets: list[Extents], critical: list[float]) -> None:
    """Show the whole arm, or where the sets and critical points are; the panels share their limits."""
    lo, hi = 0.0, scene.arm_length
    if ends := style.ends_of(sets):
        first, last = min(ends + critical), max(ends + critical)
        margin = 0.12 * (last - first)
        lo, hi = max(lo, first - margin), min(hi, last + margin)
    axes.set_xlim(lo, hi)
    axes.set_ylim(lo, hi)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(7, steps=[1, 2, 5, 10]))


def _frame(axes: Axes, scene: Scene, side: int, critical: list[float]) -> None:
    count = len(scene.sides)
    axes.set_aspect("equal")
    axes.set_title(f"on side {side} (a flip leads to side {(side + 1) % count})", fontsize=style.TEXT)
    for number, x in enumerate(critical):
        how = {"xycoords": ("data", "axes fraction"), "annotation_clip": True, "fontsize": style.TEXT}
        style.name(axes, f"$r_{side}$" + "'" * number, (x, 1.0), (-3, -4), **how)


def _visible(axes: Axes, flags: Extents) -> bool:
    lo, hi = axes.get_xlim()
    return any(first < hi and last > lo for parts in flags.values() for first, last in parts)


def _legend(sets: list[Extents], path: Orbit | None, flagged: bool, rolls: bool) -> list[Any]:
    handles: list[Any] = [
        style.key(name, **look) for name, (code, look) in THROWS.items() if code != ROLL or rolls
    ]
    handles.append(style.key("critical point", **CRITICAL))
    if sets:
        handles.append(Patch(facecolor=style.SETS[0][0], edgecolor=style.INK, label="limit set"))
    if path is not None:
        away = "rolls or flips away" if rolls else "flips away"
        handles += [
            style.key(f"orbit of {path.code.size} throws", color=style.INK, lw=0.8),
            style.key("arrives", **ARRIVAL),
            style.key(away, **DEPARTURE),
        ]
    if flagged:
        handles.append(Patch(label="another vertex lands first", **{**FLAG, "edgecolor": "#8c8c8c"}))
    return handles
