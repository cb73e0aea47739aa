"""The map: where a throw leads from each x, side by side, with an orbit as cobweb."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
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
    rows = math.ceil(count / columns)
    figure, panels = style.canvas(
        3.45 * columns + 0.4, 3.45 * rows + 1.35, rows, columns, sharex=True, sharey=True
    )
    critical, flags = critical_points(scene.map, scene.domain), other_vertex_first(scene)
    path = style.stretch(scene, sets[0], throws=10) if sets else None
    for side, axes in enumerate(panels[:count]):
        _branches(axes, scene, side)
        for lo, hi in flags[side]:
            axes.axvspan(lo, hi, zorder=0, gid="other vertex first", **FLAG)
        for point in critical[side]:
            axes.axvline(point.x, color=style.INK, lw=0.9, ls=":", zorder=1, gid="critical point")
        for number, extents in enumerate(sets):
            _bars(axes, extents, side, number)
        if path is not None:
            _cobweb(axes, path, side)
        _frame(axes, scene, side, [point.x for point in critical[side]])
    _limits(panels[0], scene, sets, [point.x for points in critical.values() for point in points])
    for axes in panels[count:]:
        axes.set_axis_off()
    for k, axes in enumerate(panels[:count]):
        style.keep_apart(axes, 0.13)
        axes.xaxis.set_tick_params(labelbottom=k + columns >= count)
        if k + columns >= count:
            axes.set_xlabel(f"x before the throw [{scene.unit}]")
        if k % columns == 0:
            axes.set_ylabel(f"x after the throw [{scene.unit}]")
    style.title(figure, f"Map of {scene.name}: one throw, from each side")
    rolls = any(line.get_gid() == "roll" for axes in panels[:count] for line in axes.lines)
    handles = _legend(sets, path, _visible(panels[0], flags), rolls)
    style.legend(figure, handles, 4)
    return figure


def _branches(axes: Axes, scene: Scene, side: int) -> None:
    x = np.linspace(float(scene.domain.lo[side, 0]), scene.arm_length, SAMPLES)
    there = images(scene.map, x, side)
    looks: tuple[tuple[int, str, Any, str], ...] = (
        (JOG, style.JOG, style.JOG_LINE, "jog"),
        (FLIP, style.FLIP, style.FLIP_LINE, "flip"),
        (ROLL, style.ROLL, style.ROLL_LINE, "roll"),
    )
    for code, colour, line, name in looks:
        if code == ROLL and not (there.code == ROLL).any():
            continue
        axes.plot(
            x,
            np.where(there.code == code, there.x, np.nan),
            color=colour,
            ls=line,
            lw=1.8,
            zorder=3,
            gid=name,
        )
    axes.plot(
        [0, scene.arm_length], [0, scene.arm_length], color=style.FAINT, lw=0.8, zorder=1, gid="diagonal"
    )


def _bars(axes: Axes, extents: Extents, side: int, number: int) -> None:
    face, hatch = style.SETS[number % len(style.SETS)]
    for lo, hi in extents.get(side, ()):
        axes.axvspan(
            lo,
            hi,
            ymin=0,
            ymax=0.03,
            facecolor=face,
            hatch=hatch,
            edgecolor=style.INK,
            lw=0.8,
            zorder=4,
            gid="limit set",
        )


def _cobweb(axes: Axes, path: Orbit, side: int) -> None:
    """Draw the part of an orbit that lies on one side: up to the branch, across to the diagonal."""
    arriving = True
    for k in np.flatnonzero(path.side[:-1] == side):
        x, to = float(path.x[k]), float(path.x[k + 1])
        arriving = k == 0 or path.side[k - 1] != side
        if arriving:
            axes.plot([x], [x], "o", ms=4.5, mfc="white", mec=style.INK, zorder=6, gid="arrival")
        stays = path.side[k + 1] == side
        axes.plot([x, x, to if stays else x], [x, to, to], color=style.INK, lw=0.8, zorder=5, gid="cobweb")
        if not stays:
            axes.plot([x], [to], "s", ms=4.5, mfc="white", mec=style.FLIP, zorder=6, gid="departure")


def _limits(axes: Axes, scene: Scene, sets: list[Extents], critical: list[float]) -> None:
    """Show the whole arm, or where the sets and critical points are; the panels share their limits."""
    lo, hi = 0.0, scene.arm_length
    ends = [x for extents in sets for parts in extents.values() for pair in parts for x in pair]
    if ends:
        margin = 0.12 * (max(ends + critical) - min(ends + critical))
        lo, hi = max(lo, min(ends + critical) - margin), min(hi, max(ends + critical) + margin)
    axes.set_xlim(lo, hi)
    axes.set_ylim(lo, hi)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(7, steps=[1, 2, 5, 10]))


def _frame(axes: Axes, scene: Scene, side: int, critical: list[float]) -> None:
    count = len(scene.sides)
    axes.set_aspect("equal")
    axes.set_title(f"on side {side} (a flip leads to side {(side + 1) % count})", fontsize=style.TEXT)
    for number, x in enumerate(critical):
        axes.annotate(
            f"$r_{side}$" + "'" * number,
            (x, 1.0),
            xycoords=("data", "axes fraction"),
            annotation_clip=True,
            xytext=(-3, -4),
            textcoords="offset points",
            ha="right",
            va="top",
            fontsize=style.TEXT,
            gid="name",
        )


def _visible(axes: Axes, flags: Extents) -> bool:
    lo, hi = axes.get_xlim()
    return any(first < hi and last > lo for parts in flags.values() for first, last in parts)


def _legend(sets: list[Extents], path: Orbit | None, flagged: bool, rolls: bool) -> list[Any]:
    handles: list[Any] = [
        Line2D([], [], color=style.JOG, lw=1.8, label="jog"),
        Line2D([], [], color=style.FLIP, lw=1.8, ls=style.FLIP_LINE, label="flip"),
        *([Line2D([], [], color=style.ROLL, lw=1.8, ls=style.ROLL_LINE, label="roll")] if rolls else []),
        Line2D([], [], color=style.INK, lw=0.9, ls=":", label="critical point"),
    ]
    if sets:
        handles.append(Patch(facecolor=style.SETS[0][0], edgecolor=style.INK, label="limit set"))
    if path is not None:
        away = "rolls or flips away" if rolls else "flips away"
        handles += [
            Line2D([], [], color=style.INK, lw=0.8, label=f"orbit of {path.code.size} throws"),
            Line2D([], [], marker="o", ls="", mfc="white", mec=style.INK, ms=4.5, label="arrives"),
            Line2D(
                [],
                [],
                marker="s",
                ls="",
                mfc="white",
                mec=style.FLIP,
                ms=4.5,
                label=away,
            ),
        ]
    if flagged:
        handles.append(Patch(label="another vertex lands first", **{**FLAG, "edgecolor": "#8c8c8c"}))
    return handles
