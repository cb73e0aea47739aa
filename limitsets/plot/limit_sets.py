"""The limit set, one lane per side, with throws as arrows (Figs. 4 and 6 of the paper)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import FancyArrowPatch, Patch, Polygon
from matplotlib.path import Path

from limitsets.goals import OrientedBeyond
from limitsets.maps import FLIP as FLIPS
from limitsets.maps import ROLL, Orbit, critical_points, images
from limitsets.plot import style
from limitsets.plot.style import Extents

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.scene import Scene

__all__ = ["limit_set"]

BAR = 0.085  # half the height of a bar; lanes are 1 apart
HOP = 0.36  # height of a jog's arc
SAMPLES = 400
BAND: dict[str, Any] = {"facecolor": "#e9e9e9", "edgecolor": "#cfcfcf"}
START: dict[str, Any] = {"marker": "o", "ls": "", "mfc": "white", "mec": style.INK, "ms": 5}
FLIPPED: dict[str, Any] = {"color": style.FLIP, "ls": style.FLIP_LINE}
ROLLED: dict[str, Any] = {"color": style.ROLL, "ls": style.ROLL_LINE}


def limit_set(scene: Scene, found: Any, *, axes: Axes | None = None) -> Figure:
    r"""Draw where a part comes to rest on each side, and how throws carry it on.

    One lane per side; the first is repeated below the last, so that every flip goes down by one lane.  Bars are the
    limit set.  Grey bands show where the flipping part of each bar goes, arcs and arrows the throws of one orbit.

    Parameters
    ----------
    scene : Scene
        The scene.
    found : attractors, limit sets, one of them, or an Analysis
        What to draw: anything with `extents`.
    axes : matplotlib.axes.Axes, optional
        Axes to draw into, without a legend; otherwise a new figure is made.

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
    >>> analysis = ls.analyse("paper-designed")
    >>> figure = ls.plot.limit_set(analysis.scene, analysis.limit_sets)
    >>> [label.get_text() for label in figure.axes[0].get_yticklabels()]
    ['side 0', 'side 1', 'side 2', 'side 0\nagain']
    """
    sets = style.extents_of(found)
    count = len(scene.sides)
    alone = axes is None
    if axes is None:
        figure, (axes,) = style.canvas(9.0, 1.02 * (count + 1) + 1.3)
    _lanes(axes, scene)
    for number, extents in enumerate(sets):
        _bars(axes, extents, number, count)
        _bands(axes, scene, extents)
        path = style.stretch(scene, extents)
        if path is not None:
            _throws(axes, path)
    marked = _critical(axes, scene)
    style.goal(axes, scene, zorder=2)
    _frame(axes, scene, sets, marked)
    style.keep_apart(axes, 0.1)
    text = f"Limit set of {scene.name}: where the part comes to rest"
    axes.set_title(text, fontsize=style.TEXT + 1.5, loc="left")
    if alone:
        rolls = any(patch.get_gid() == "roll" for patch in axes.patches)
        style.legend(figure, _legend(scene, len(sets), rolls), 4)
    return axes.get_figure(root=True)  # type: ignore[return-value]  # these axes are in a figure: it is not None


def _lanes(axes: Axes, scene: Scene) -> None:
    count = len(scene.sides)
    for lane in range(count + 1):
        a = float(scene.sides.a[lane % count])
        axes.plot([a, scene.arm_length], [-lane, -lane], color=style.FAINT, lw=0.8, zorder=1)
    names = [*(f"side {side}" for side in range(count)), "side 0\nagain"]
    axes.set_yticks([-lane for lane in range(count + 1)], names)


def _bars(axes: Axes, extents: Extents, number: int, count: int) -> None:
    again: dict[str, Any] = {"facecolor": "white", "edgecolor": style.INK, "ls": ":"}
    for side, parts in extents.items():
        for lo, hi in parts:
            style.bar(axes, lo, hi, -side, BAR, zorder=3, gid="limit set", **style.of_set(number))
            if side == 0:
                style.bar(axes, lo, hi, -count, BAR, zorder=3, gid="limit set again", **again)


def _bands(axes: Axes, scene: Scene, extents: Extents) -> None:
    """Shade from each stretch of a bar that flips to where it lands."""
    for side, parts in extents.items():
        for lo, hi in parts:
            x = np.linspace(lo, hi, SAMPLES)
            there = images(scene.map, x, side)
            flips = np.flatnonzero(there.code == FLIPS)
            for run in np.split(flips, np.flatnonzero(np.diff(flips) > 1) + 1):
                if run.size > 1:
                    top, bottom = -side - BAR, -side - 1 + BAR
                    corners = [(x[run[0]], top), (x[run[-1]], top)]
                    corners += [(there.x[run[-1]], bottom), (there.x[run[0]], bottom)]
                    axes.add_patch(Polygon(corners, lw=0.6, zorder=0, **BAND))


def _throws(axes: Axes, path: Orbit) -> None:
    wide = 0.06 * float(np.ptp(path.x)) or 1.0
    steps = zip(path.x[:-1], path.x[1:], path.side[:-1], path.side[1:], path.code, strict=True)
    for x, to, side, after, code in steps:
        rolls = code == ROLL and after != side
        if code == FLIPS or rolls:
            # a flip goes down by one lane, from the last to the first one's repetition; a roll to wherever it goes
            lane = after if rolls else side + 1
            up = BAR if lane < side else -BAR
            look: dict[str, Any] = {"gid": "roll", **ROLLED} if rolls else {"gid": "flip", **FLIPPED}
            look |= {"arrowstyle": "-|>", "mutation_scale": 9, "shrinkA": 0, "shrinkB": 0}
            arrow = FancyArrowPatch((x, -side + up), (to, -lane - up), lw=1.2, zorder=4, **look)
        elif code >= 0:
            y, middle = -side + BAR, 0.5 * (x + to)
            top = y + HOP * min(1.0, max(0.3, abs(to - x) / wide))
            arc = Path([(x, y), (middle, top), (to, y)], [Path.MOVETO, Path.CURVE3, Path.CURVE3])
            head = "-|>" if abs(to - x) > 0.25 * wide else "-"  # shorter hops than this would be all head
            look = {"arrowstyle": head, "mutation_scale": 6, "color": style.JOG, "gid": "jog"}
            arrow = FancyArrowPatch(path=arc, lw=1.1, zorder=4, **look)
        else:
            continue
        axes.add_patch(arrow)
    axes.plot([path.x[0]], [-path.side[0] + BAR], zorder=5, gid="start", **START)


def _critical(axes: Axes, scene: Scene) -> list[float]:
    marked = []
    for side, points in critical_points(scene.map, scene.domain).items():
        for number, point in enumerate(points):
            ends = [-side - 0.2, -side + 0.2]
            axes.plot([point.x] * 2, ends, color=style.INK, lw=1.6, zorder=6, gid="critical point")
            words = f"$r_{side}$" + "'" * number + f" = {point.x:.2f}"
            box = {"boxstyle": "square,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.85}
            style.name(axes, words, (point.x, ends[0]), (-3, -1), zorder=7, bbox=box)
            marked.append(point.x)
    return marked


def _frame(axes: Axes, scene: Scene, sets: list[Extents], marked: list[float]) -> None:
    """Limits, labels, and the intervals in figures beside each lane."""
    count = len(scene.sides)
    ends = style.ends_of(sets) + marked
    if isinstance(scene.goal, OrientedBeyond):
        ends.append(scene.goal.x)
    lo, hi = min(ends, default=0.0), max(ends, default=scene.arm_length)
    margin = 0.06 * (hi - lo)
    axes.set_xlim(lo - 1.8 * margin, min(hi + margin, scene.arm_length) if hi < scene.arm_length else hi)
    axes.set_ylim(-count - 0.35, 0.62)
    axes.set_xlabel(f"x of the centre of mass from the joint [{scene.unit}]")
    style.lanes(axes)
    for side in range(count):
        parts = [pair for extents in sets for pair in extents.get(side, ())]
        words = f"{style.interval_text(parts)} {scene.unit}" if parts else "never"
        style.note(axes, words, (1.0, -side), (4, 0), xycoords=("axes fraction", "data"), va="center")


def _legend(scene: Scene, sets: int, rolls: bool) -> list[Any]:
    shown = range(min(sets, len(style.SETS)))
    return [
        *(Patch(label="limit set" if sets == 1 else f"limit set {k}", **style.of_set(k)) for k in shown),
        style.key("jog (stays on its side)", color=style.JOG),
        style.key("flip (to the next side)", **FLIPPED),
        *([style.key("roll (on, or back)", **ROLLED)] if rolls else []),
        Patch(label="where the flipping part lands", **BAND),
        style.key("start of the orbit shown", **START),
        style.key("critical point", color=style.INK, marker="|", ms=10, mew=1.6, ls=""),
        *style.key_of_goal(scene),
    ]
