"""The limit set, one lane per side (Figs. 4 and 6 of the paper), and the map x' against x, one panel per side."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Patch, Polygon
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator

from limitsets.base import arguments_checked
from limitsets.face.plot import style
from limitsets.face.plot.style import Extents, Subject, subject_of
from limitsets.feeder.goals import OrientedBeyond
from limitsets.feeder.scene import Scene
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.maps import ROLL, Orbit, critical_points, images

BAR = 0.085  # half the height of a bar; lanes are 1 apart
HOP = 0.36  # height of a jog's arc
SAMPLES_OF_ARROWS = 400
AGAIN: dict[str, Any] = {"facecolor": "white", "edgecolor": style.INK, "ls": ":"}
BAND: dict[str, Any] = {"facecolor": "#e9e9e9", "edgecolor": "#cfcfcf"}
START: dict[str, Any] = {"marker": "o", "ls": "", "mfc": "white", "mec": style.INK, "ms": 5}
FLIPPED: dict[str, Any] = {"color": style.FLIP, "ls": style.FLIP_LINE}
ROLLED: dict[str, Any] = {"color": style.ROLL, "ls": style.ROLL_LINE}


@arguments_checked
def limit_set(scene: Scene | TransitionGraph, found: Any, *, axes: Axes | None = None) -> Figure:
    r"""Draw the places of rest on each side, and how throws lead from one to the next.

    One lane per side; the first is repeated below the last, so that every flip goes down by one lane.  Bars are the
    limit set.  Grey bands show where the flipping part of each bar goes, arcs and arrows the throws of one orbit.

    Parameters
    ----------
    scene : Scene or TransitionGraph
        The scene, or a map of one's own in one dimension with its domain, as `limitsets.transitions` gives them.
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
        For something without extents, a bare map, which does not say where its states lie, or one of more dimensions.

    Examples
    --------
    >>> import limitsets as ls
    >>> analysis = ls.analyse("paper-designed")
    >>> figure = ls.plot.limit_set(analysis.scene, analysis.limit_sets)
    >>> [label.get_text() for label in figure.axes[0].get_yticklabels()]
    ['side 0', 'side 1', 'side 2', 'side 0\nagain']
    """
    about, sets = subject_of(scene), style.extents_of(found)
    count = about.sides
    alone = axes is None
    if axes is None:
        figure, (axes,) = style.canvas(9.0, 1.02 * _lanes_of(about) + 1.3)
    for lane in range(_lanes_of(about)):
        least = float(about.least[lane % count])
        axes.plot([least, about.most], [-lane, -lane], color=style.FAINT, lw=0.8, zorder=1)
    for number, extents in enumerate(sets):
        _bars(axes, extents, number, _lanes_of(about) - 1)
        _bands(axes, about, extents)
        path = style.stretch(about, extents)
        if path is not None:
            _throws(axes, path, count)
    marked = _critical(axes, about)
    style.goal(axes, about, zorder=2)
    _frame_lanes(axes, about, sets, marked)
    style.keep_apart(axes, 0.1)
    text = f"Limit set of {about.name}" + (": where the part comes to rest" if about.thrown else "")
    axes.set_title(text, fontsize=style.TEXT + 1.5, loc="left")
    if alone:
        style.legend(figure, _legend_of_lanes(axes, about, len(sets)), 4)
    return axes.get_figure(root=True)  # type: ignore[return-value]  # these axes are in a figure: it is not None


def _lanes_of(about: Subject) -> int:
    """Count the lanes: one per side, and that of the first side again if there are several."""
    return about.sides + (about.sides > 1)


def _bars(axes: Axes, extents: Extents, number: int, count: int) -> None:
    for side, parts in extents.items():
        style.bars(axes, parts, -side, BAR, zorder=3, gid="limit set", **style.of_set(number))
        if side == 0 and count:
            style.bars(axes, parts, -count, BAR, zorder=3, gid="limit set again", **AGAIN)


def _bands(axes: Axes, about: Subject, extents: Extents) -> None:
    """Shade the bands from each flipping stretch of a bar to its image."""
    for side, parts in extents.items():
        for lo, hi in parts:
            x = np.linspace(lo, hi, SAMPLES_OF_ARROWS)
            there = images(about.map, x, side)
            onward = (there.side == (side + 1) % about.sides) & (there.side != side)
            flips = np.flatnonzero((there.code >= 0) & (there.code != ROLL) & onward)
            for run in np.split(flips, np.flatnonzero(np.diff(flips) > 1) + 1):
                if run.size > 1:
                    top, bottom = -side - BAR, -side - 1 + BAR
                    corners = [(x[run[0]], top), (x[run[-1]], top)]
                    corners += [(there.x[run[-1]], bottom), (there.x[run[0]], bottom)]
                    axes.add_patch(Polygon(corners, lw=0.6, zorder=0, **BAND))


def _throws(axes: Axes, path: Orbit, count: int) -> None:
    wide = 0.06 * float(np.ptp(path.x)) or 1.0
    steps = zip(path.x[:-1], path.x[1:], path.side[:-1], path.side[1:], path.code, strict=True)
    for x, to, side, after, code in steps:
        rolls = code == ROLL and after != side
        if rolls or (code >= 0 and after != side):
            # a flip goes down by one lane, from the last to the first one's repetition; a roll to wherever it goes
            lane = side + 1 if not rolls and after == (side + 1) % count else after
            up = BAR if lane < side else -BAR
            look: dict[str, Any] = {"gid": "roll", **ROLLED} if rolls else {"gid": "flip", **FLIPPED}
            look |= {"arrowstyle": "-|>", "mutation_scale": 9, "shrinkA": 0, "shrinkB": 0}
            arrow = FancyArrowPatch((x, -side + up), (to, -lane - up), lw=1.2, zorder=4, **look)
        elif code >= 0:
            y, middle = -side + BAR, 0.5 * (x + to)
            top = y + HOP * min(1.0, max(0.3, abs(to - x) / wide))
            arc = Path([(x, y), (middle, top), (to, y)], [Path.MOVETO, Path.CURVE3, Path.CURVE3])
            head = "-|>" if abs(to - x) > 0.25 * wide else "-"  # a shorter arrow would be all head
            look = {"arrowstyle": head, "mutation_scale": 6, "color": style.JOG, "gid": "jog"}
            arrow = FancyArrowPatch(path=arc, lw=1.1, zorder=4, **look)
        else:
            continue
        axes.add_patch(arrow)
    axes.plot([path.x[0]], [-path.side[0] + BAR], zorder=5, gid="start", **START)


def _name(side: int, number: int) -> str:
    """Write the name of a critical point."""
    return f"$r_{{{side}}}$" + "'" * number


def _critical(axes: Axes, about: Subject) -> list[float]:
    marked = []
    for side, points in critical_points(about.map, about.domain).items():
        for number, point in enumerate(points):
            ends = [-side - 0.2, -side + 0.2]
            axes.plot([point.x] * 2, ends, color=style.INK, lw=1.6, zorder=6, gid="critical point")
            words = f"{_name(side, number)} = {point.x:.2f}"
            plate = style.PLATE | {"alpha": 0.85}
            style.name(axes, words, (point.x, ends[0]), (-3, -1), zorder=7, bbox=plate)
            marked.append(point.x)
    return marked


def _frame_lanes(axes: Axes, about: Subject, sets: list[Extents], marked: list[float]) -> None:
    """Set limits and labels, and write the intervals beside each lane."""
    ends = style.ends_of(sets) + marked
    if isinstance(about.goal, OrientedBeyond):
        ends.append(about.goal.x)
    if len(set(ends)) < 2:  # no set and no critical point: the whole arm
        ends += [float(np.min(about.least)), about.most]
    lo, hi = min(ends), max(ends)
    margin = 0.06 * (hi - lo)
    last = min(hi + margin, about.most) if hi < about.most else hi
    place = f"x of the centre of mass from the joint{about.in_brackets}" if about.thrown else "x"
    axes.set(xlim=(lo - 1.8 * margin, last), ylim=(0.65 - _lanes_of(about), 0.62), xlabel=place)
    names = {-side: f"side {side}" for side in range(about.sides)} | {-about.sides: "side 0\nagain"}
    style.lanes(axes, names if about.sides > 1 else {0: ""}, style.TEXT)
    for side in range(about.sides):
        parts = [pair for extents in sets for pair in extents.get(side, ())]
        words = f"{style.interval_text(parts)} {about.unit}".strip() if parts else "never"
        style.note(axes, words, (1.0, -side), (4, 0), xycoords=("axes fraction", "data"), va="center")


def _legend_of_lanes(axes: Axes, about: Subject, sets: int) -> list[Any]:
    several = about.sides > 1
    rolls = any(artist.get_gid() == "roll" for artist in axes.get_children())
    shown = range(min(sets, len(style.SETS)))
    return [
        *(Patch(label="limit set" if sets == 1 else f"limit set {k}", **style.of_set(k)) for k in shown),
        style.key("jog (stays on its side)" if about.thrown else "step", color=style.JOG),
        style.key("flip (to the next side)", **FLIPPED) if several else None,
        style.key("roll (on, or back)", **ROLLED) if rolls else None,
        Patch(label="where the flipping part lands", **BAND) if several else None,
        style.key("start of the orbit shown", **START),
        style.key("critical point", color=style.INK, marker="|", ms=10, mew=1.6, ls=""),
        style.key_of_goal(about),
    ]


# ----------------------------------------------------------------
# The map: x' against x, one panel per side, with an orbit as cobweb.


SAMPLES_OF_MAP = 1500
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
    before, after = (f"x {when} the {step}{about.in_brackets}" for when in ("before", "after"))
    figure, panels = style.panels(count, columns, (size, size), (0.4, 1.35), before)
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
        _frame_panel(axes, about, side, [point.x for point in critical[side]])
    _limits(panels[0], about, sets, [point.x for points in critical.values() for point in points])
    for k, axes in enumerate(panels):
        style.keep_apart(axes, 0.13)
        if k % columns == 0:
            axes.set_ylabel(after)
    words = f"Map of {about.name}: one {step}" + (", from each side" if count > 1 else "")
    handles = _legend_of_panels(about, panels, sets, path, _visible(panels[0], flags))
    return style.finished(figure, words, handles, 4 if columns > 1 else 2)


def _branches(axes: Axes, about: Subject, side: int) -> None:
    x = np.linspace(float(about.domain.lo[side, 0]), float(about.domain.hi[side, 0]), SAMPLES_OF_MAP)
    there = images(about.map, x, side)
    for code, name in enumerate(about.branches):
        if code < 2 or (there.code == code).any():
            look = LOOKS[code % len(LOOKS)]
            axes.plot(x, np.where(there.code == code, there.x, np.nan), zorder=3, gid=name, **look)
    whole = _whole(about)
    axes.plot(whole, whole, color=style.FAINT, lw=0.8, zorder=1, gid="diagonal")


def _cobweb(axes: Axes, path: Orbit, side: int) -> None:
    """Draw the part of an orbit that lies on one side: up to the branch, across to the diagonal."""
    for k in np.flatnonzero(path.side[:-1] == side):
        x, to = float(path.x[k]), float(path.x[k + 1])
        if k == 0 or path.side[k - 1] != side:
            axes.plot([x], [x], zorder=6, gid="arrival", **ARRIVAL)
        stays = path.side[k + 1] == side
        axes.plot([x, x, to if stays else x], [x, to, to], color=style.INK, lw=0.8, zorder=5, gid="cobweb")
        if not stays:
            axes.plot([x], [to], zorder=6, gid="departure", **DEPARTURE)


def _whole(about: Subject) -> tuple[float, float]:
    """Give the range of states: for a scene it begins at the joint."""
    return (0.0 if about.thrown else float(about.domain.lo.min())), about.most


def _limits(axes: Axes, about: Subject, sets: list[Extents], critical: list[float]) -> None:
    """Set the limits: the whole arm, or the surroundings of sets and critical points; the panels share them."""
    lo, hi = _whole(about)
    if ends := style.ends_of(sets):
        first, last = min(ends + critical), max(ends + critical)
        margin = 0.12 * (last - first)
        lo, hi = max(lo, first - margin), min(hi, last + margin)
    axes.set(xlim=(lo, hi), ylim=(lo, hi))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(7, steps=[1, 2, 5, 10]))


def _frame_panel(axes: Axes, about: Subject, side: int, critical: list[float]) -> None:
    axes.set_aspect("equal")
    leads = f" (a flip leads to side {(side + 1) % about.sides})" if about.thrown else ""
    if not about.domain.lo[side, 0] < about.domain.hi[side, 0]:
        leads = ": no part rests there"
    if about.sides > 1:
        axes.set_title(f"on side {side}{leads}", fontsize=style.TEXT)
    for number, x in enumerate(critical):
        how = {"xycoords": ("data", "axes fraction"), "annotation_clip": True, "fontsize": style.TEXT}
        style.name(axes, _name(side, number), (x, 1.0), (-3, -4), **how)


def _visible(axes: Axes, flags: Extents) -> bool:
    lo, hi = axes.get_xlim()
    return any(first < hi and last > lo for parts in flags.values() for first, last in parts)


def _legend_of_panels(
    about: Subject, panels: list[Axes], sets: list[Extents], path: Orbit | None, flagged: bool
) -> list[Any]:
    drawn = {line.get_gid() for axes in panels for line in axes.lines}
    several, step = about.sides > 1, "throws" if about.thrown else "steps"
    away = "flips away" if about.thrown else "goes to another side"
    return [
        *(
            style.key(name, **LOOKS[code % len(LOOKS)])
            for code, name in enumerate(about.branches)
            if name in drawn
        ),
        style.key("critical point", **CRITICAL),
        Patch(facecolor=style.SETS[0][0], edgecolor=style.INK, label="limit set") if sets else None,
        style.key(f"orbit of {path.code.size} {step}", color=style.INK, lw=0.8) if path else None,
        style.key("arrives" if several else "starts", **ARRIVAL) if "arrival" in drawn else None,
        style.key("rolls or flips away" if "roll" in drawn else away, **DEPARTURE)
        if "departure" in drawn
        else None,
        Patch(label="another vertex lands first", **FLAG | {"edgecolor": "#8c8c8c"}) if flagged else None,
    ]
