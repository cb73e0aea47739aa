"""The map: x' against x, one panel per side, with an orbit as cobweb."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from limitsets.arguments import arguments_checked
from limitsets.maps import Orbit, critical_points, images
from limitsets.plot import style
from limitsets.plot.style import Extents
from limitsets.plot.subjects import Subject, subject_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.graph import TransitionGraph
    from limitsets.scene import Scene

SAMPLES = 1500
# Of the branches by number: of throws jog, flip and roll.
LOOKS: tuple[dict[str, Any], ...] = (
    {"color": style.JOG, "lw": 1.8},
    {"color": style.FLIP, "lw": 1.8, "ls": style.FLIP_LINE},
    {"color": style.ROLL, "lw": 1.8, "ls": style.ROLL_LINE},
)
CRITICAL: dict[str, Any] = {"color": style.INK, "lw": 0.9, "ls": ":"}
ARRIVAL: dict[str, Any] = {"marker": "o", "ls": "", "mfc": "white", "mec": style.INK, "ms": 4.5}
DEPARTURE: dict[str, Any] = ARRIVAL | {"marker": "s", "mec": style.FLIP}
FLAG: dict[str, Any] = {"facecolor": "none", "edgecolor": "#bdbdbd", "hatch": "////", "lw": 0.0}


@arguments_checked
def map(scene: Scene | TransitionGraph, found: Any = None) -> Figure:  # noqa: A001 - ls.plot.map is the word for it
    """Draw x after a throw against x before it, one panel per side.

    Parameters
    ----------
    scene : Scene or TransitionGraph
        The scene, or a map of one's own in one dimension with its domain, as `limitsets.transitions` gives them.
    found : attractors, limit sets, one of them, or an Analysis, optional
        Drawn along the lower border, with an orbit on the first of them as cobweb; the picture then shows the
        surroundings of these sets and of the critical points, otherwise the whole arm.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    AnswerError
        For something without extents, a bare map, which does not say where its states lie, or one of more dimensions.

    Examples
    --------
    >>> import limitsets as ls
    >>> len(ls.plot.map(ls.load("paper-designed")).axes)
    3
    """
    about = subject_of(scene)
    sets = [] if found is None else style.extents_of(found)
    count = about.sides
    size = 3.45 if count > 1 else 4.8
    columns = count if count < 4 else math.ceil(count / 2)
    step = "throw" if about.thrown else "step"
    below = f"x before the {step}{about.in_brackets}"
    figure, panels = style.panels(count, columns, (size, size), (0.4, 1.35), below)
    critical, flags = critical_points(about.map, about.domain), about.flags
    path = style.stretch(about, sets[0], throws=10) if sets else None
    for side, axes in enumerate(panels):
        _branches(axes, about, side)
        for lo, hi in flags.get(side, ()):
            axes.axvspan(lo, hi, zorder=0, gid="other vertex first", **FLAG)
        for point in critical[side]:
            axes.axvline(point.x, zorder=1, gid="critical point", **CRITICAL)
        for number, extents in enumerate(sets):
            look = {"ymin": 0, "ymax": 0.03, "lw": 0.8, "zorder": 4, **style.of_set(number)}
            for lo, hi in extents.get(side, ()):
                axes.axvspan(lo, hi, gid="limit set", **look)
        if path is not None:
            _cobweb(axes, path, side)
        _frame(axes, about, side, [point.x for point in critical[side]])
    _limits(panels[0], about, sets, [point.x for points in critical.values() for point in points])
    for k, axes in enumerate(panels):
        style.keep_apart(axes, 0.13)
        if k % columns == 0:
            axes.set_ylabel(f"x after the {step}{about.in_brackets}")
    style.title(figure, f"Map of {about.name}: one {step}" + (", from each side" if count > 1 else ""))
    handles = _legend(about, panels, sets, path, _visible(panels[0], flags))
    style.legend(figure, handles, 4 if columns > 1 else 2)
    return figure


def _branches(axes: Axes, about: Subject, side: int) -> None:
    x = np.linspace(float(about.domain.lo[side, 0]), float(about.domain.hi[side, 0]), SAMPLES)
    there = images(about.map, x, side)
    for code, name in enumerate(about.branches):
        if code < 2 or (there.code == code).any():
            look = LOOKS[code % len(LOOKS)]
            axes.plot(x, np.where(there.code == code, there.x, np.nan), zorder=3, gid=name, **look)
    whole = _whole(about)
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


def _whole(about: Subject) -> tuple[float, float]:
    """Where states lie: of a scene from the joint on."""
    return (0.0 if about.thrown else float(about.domain.lo.min())), about.most


def _limits(axes: Axes, about: Subject, sets: list[Extents], critical: list[float]) -> None:
    """Show the whole arm, or where the sets and critical points are; the panels share their limits."""
    lo, hi = _whole(about)
    if ends := style.ends_of(sets):
        first, last = min(ends + critical), max(ends + critical)
        margin = 0.12 * (last - first)
        lo, hi = max(lo, first - margin), min(hi, last + margin)
    axes.set_xlim(lo, hi)
    axes.set_ylim(lo, hi)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(7, steps=[1, 2, 5, 10]))


def _frame(axes: Axes, about: Subject, side: int, critical: list[float]) -> None:
    axes.set_aspect("equal")
    leads = f" (a flip leads to side {(side + 1) % about.sides})" if about.thrown else ""
    if not about.domain.lo[side, 0] < about.domain.hi[side, 0]:
        leads = ": no part rests there"
    if about.sides > 1:
        axes.set_title(f"on side {side}{leads}", fontsize=style.TEXT)
    for number, x in enumerate(critical):
        how = {"xycoords": ("data", "axes fraction"), "annotation_clip": True, "fontsize": style.TEXT}
        style.name(axes, f"$r_{{{side}}}$" + "'" * number, (x, 1.0), (-3, -4), **how)


def _visible(axes: Axes, flags: Extents) -> bool:
    lo, hi = axes.get_xlim()
    return any(first < hi and last > lo for parts in flags.values() for first, last in parts)


def _legend(
    about: Subject, panels: list[Axes], sets: list[Extents], path: Orbit | None, flagged: bool
) -> list[Any]:
    drawn = {line.get_gid() for axes in panels for line in axes.lines}
    handles: list[Any] = [
        style.key(name, **LOOKS[code % len(LOOKS)])
        for code, name in enumerate(about.branches)
        if name in drawn
    ]
    handles.append(style.key("critical point", **CRITICAL))
    if sets:
        handles.append(Patch(facecolor=style.SETS[0][0], edgecolor=style.INK, label="limit set"))
    if path is not None:
        away = (
            "rolls or flips away"
            if "roll" in drawn
            else "flips away"
            if about.thrown
            else "goes to another side"
        )
        steps = "throws" if about.thrown else "steps"
        handles.append(style.key(f"orbit of {path.code.size} {steps}", color=style.INK, lw=0.8))
        handles += (
            [style.key("arrives" if about.sides > 1 else "starts", **ARRIVAL)] if "arrival" in drawn else []
        )
        handles += [style.key(away, **DEPARTURE)] if "departure" in drawn else []
    if flagged:
        handles.append(Patch(label="another vertex lands first", **{**FLAG, "edgecolor": "#8c8c8c"}))
    return handles
