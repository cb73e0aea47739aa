"""Maps of an atlas: axes, pixels and hatches, the classes of its points, with a legend in words.

The colour of a class comes from the class alone, so it is the same in every picture: the structure of the attractors
gives the face, ways out a hatch.  Faces come back after seven, lighter; neighbours are told apart by a line and by the
number of their line in the legend, which stands in the largest region of each class.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.patheffects import Normal, Stroke, withTickedStroke
from scipy.ndimage import distance_transform_edt, label

from limitsets.base import AnswerError, arguments_checked
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.face.plot import style
from limitsets.feeder.goals import OrientedBeyond, Reaches
from limitsets.feeder.scene import load
from limitsets.feeder.scene.quantities import base_unit, find
from limitsets.feeder.scene.units import exact_factor
from limitsets.parameters.atlas import Atlas
from limitsets.parameters.atlas.classes import (
    UNDECIDED,
    AttractorKind,
    Entry,
    is_classified,
    legend,
    named_class,
    numbers_of,
)
from limitsets.parameters.margins.machines import Machines

# ----------------------------------------------------------------
# What the pictures of an atlas share: axes, pixels about the points, hatches, and the mark of the scene itself.


def title_of(answers: Atlas) -> str:
    """Give the title: the names of the varied quantities."""
    return str(answers.dataset.attrs.get("title", "")).removeprefix("atlas of ")


# Hatch of points at which no part gets to the X of the goal; it differs from the hatches of classes.
UNREACHED = "oo"
DESIGN: dict[str, Any] = {
    "marker": "*",
    "ms": 13.0,
    "mfc": "white",
    "mec": style.INK,
    "mew": 1.0,
    "ls": "none",
}
TICKS: dict[str, Any] = {"spacing": 8.0, "length": 0.6}


def frame(answers: Atlas, tall: float = 0.0) -> tuple[Figure, Axes]:
    """Make a figure with its axes labelled, flat where one quantity varies, but at least so tall [inches]."""
    names = answers.axes
    figure, (axes,) = style.canvas(10.2, max(5.4 if len(names) == 2 else 2.6, tall))
    units = [answers.dataset[name].attrs.get("units", "") for name in names]
    words = [f"{name} [{unit}]" if unit else name for name, unit in zip(names, units, strict=True)]
    x, y = pixels(answers)
    axes.set(xlabel=words[-1], xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    if len(names) == 2:
        axes.set_ylabel(words[0])
    return figure, axes


def edges(values: Array) -> Array:
    """Give the edges of pixels about values: half way between them."""
    if values.size == 1:
        return np.array([values[0] - 0.5, values[0] + 0.5])
    middle = 0.5 * (values[1:] + values[:-1])
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])


def pixels(answers: Atlas) -> tuple[Array, Array]:
    """Edges of the pixels along x and along y."""
    data, names = answers.dataset, answers.axes
    across = edges(data[names[-1]].values)
    return across, edges(data[names[0]].values) if len(names) == 2 else np.array([0.0, 1.0])


def hatched(
    axes: Axes,
    x: Array,
    y: Array,
    where: Mask,
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


def goal_line(axes: Axes, answers: Atlas) -> list[Any]:
    """Draw the line at which the goal begins or ceases to hold, ticks where it fails; return the legend's entry."""
    data = answers.dataset
    if "threshold" not in data:
        return []
    goal = _goal_of(answers)
    over = (data["threshold"].values - goal.x) * (1 if isinstance(goal, OrientedBeyond) else -1)
    fails = over[np.isfinite(over)] > 0.0
    if fails.all() or not fails.any():
        words = f"the goal {'fails' if fails.any() else 'holds'} wherever there is a limit set"
        return [Patch(label=words, alpha=0.0)] if fails.size else []
    looks = [Stroke(linewidth=3.2, foreground="white"), Normal()]
    names = answers.axes
    if len(names) == 2:
        xs, ys = (data[name].values for name in reversed(names))
        levels = np.ma.masked_invalid(over)
        line = axes.contour(xs, ys, levels, [0.0], colors=style.GOAL, linewidths=1.6, zorder=4)
        # higher values are on the left of a contour
        line.set(path_effects=[*looks, withTickedStroke(angle=90, **TICKS)], gid="goal")
    else:
        x = data[names[0]].values
        both = np.isfinite(over[1:]) & np.isfinite(over[:-1])
        for k in np.flatnonzero(both & ((over[1:] > 0.0) != (over[:-1] > 0.0))).tolist():
            at = x[k] - over[k] * (x[k + 1] - x[k]) / (over[k + 1] - over[k])
            ticks = withTickedStroke(angle=-90 if over[k + 1] > over[k] else 90, **TICKS)
            axes.axvline(at, color=style.GOAL, lw=1.6, zorder=4, gid="goal", path_effects=[*looks, ticks])
    look = {"lw": 1.6, "path_effects": [withTickedStroke(angle=-90, **TICKS)]}
    return [style.key("the goal fails on the side of the ticks", color=style.GOAL, **look)]


def _goal_of(answers: Atlas) -> Any:
    """Read the goal of an atlas with thresholds: only these two kinds of goal have one."""
    goal = load(answers.dataset.attrs["scene"]).goal
    assert isinstance(goal, OrientedBeyond | Reaches)
    return goal


def unreached(axes: Axes, answers: Atlas) -> list[Any]:
    """Hatch points at which no part gets to the goal's X: there a goal about parts beyond X holds of no part.

    Returns the entry of a legend.
    """
    data = answers.dataset
    if "threshold" not in data or "reach" not in data:
        return []
    goal = _goal_of(answers)
    reach = np.where(np.isnan(data["reach"].values), -np.inf, data["reach"].values)
    farthest = reach.reshape(*data["threshold"].shape, -1, reach.shape[-1]).max(axis=(-2, -1))
    none = np.isfinite(farthest) & (farthest <= goal.x)
    if not none.any():
        return []
    hatched(axes, *pixels(answers), np.atleast_2d(none), UNREACHED)
    look: dict[str, Any] = {"hatch": UNREACHED, "fill": False, "edgecolor": style.INK, "lw": 0.5}
    return [Patch(label=f"no part gets to x = {goal.x:g}", **look)]


def mark(axes: Axes, answers: Atlas) -> list[Any]:
    """Mark the scene or map itself, if it lies in the window; return the legend's entry."""
    values = []
    for name in answers.axes:
        value, given = _value_of(answers, name), answers.dataset[name].values
        if value is None or not given[0] <= value <= given[-1]:
            return []
        values.append(value)
    x, y = values[-1], values[0] if len(values) == 2 else 0.15
    axes.plot([x], [y], zorder=6, gid="design", **DESIGN)
    numbers = ", ".join(f"{value:.6g}" for value in reversed(values))
    return [style.key(f"{title_of(answers)}: {numbers}", **DESIGN)]


def possible(axes: Axes, answers: Atlas, machines: Machines) -> list[Any]:
    """Draw where a fit leaves the varied quantities, with 95 %; return the legend's entry."""
    names = answers.axes
    look: dict[str, Any] = {"color": style.INK, "lw": 1.8, "ls": (0, (4, 2)), "zorder": 5}
    missing = [name for name in names if name not in machines.values]
    if missing:
        return [Patch(label=f"the fit does not tell {' and '.join(missing)}", alpha=0.0)]
    units = [answers.dataset[name].attrs.get("units", "") for name in names]
    factors = [
        float(exact_factor(unit, base_unit(find(name).dimension, machines.unit)))
        for name, unit in zip(names, units, strict=True)
    ]
    if len(names) == 2 and set(names) <= {*machines.together}:
        axes.plot(*(machines.ellipse(*names) / factors).T[::-1], gid="fit", **look)
        return [style.key("where the fit leaves both, 95 %", **look | {"marker": ""})]
    for name, factor, line in zip(names[::-1], factors[::-1], (axes.axvline, axes.axhline), strict=False):
        for end in (-1.0, 1.0):
            line((machines.values[name] + end * machines.halves[name]) / factor, gid="fit", **look)
    return [style.key("where the fit leaves each, 95 %", **look | {"marker": ""})]


def _value_of(answers: Atlas, name: str) -> float | None:
    """Return the value of a quantity in the unvaried scene or map, in the unit of its axis."""
    data, plan = answers.dataset, answers.dataset.attrs["plan"]
    if "scene" not in plan:
        value = plan.get("parameters", {}).get(name)
        return float(value) if isinstance(value, int | float) else None
    scene = load(data.attrs["scene"])
    base = base_unit(find(name).dimension, scene.unit)
    return scene.value(name) / float(exact_factor(data[name].attrs.get("units", ""), base))


# ----------------------------------------------------------------
# Maps of an atlas: the classes of its points, with a legend in words.


# Faces of cycles: Paul Tol's light scheme, made for areas and colour-blind readers, without its orange.
FACES = ("#EEDD88", "#44BB99", "#77AADD", "#FFAABB", "#99DDFF", "#BBCC33", "#AAAA00")
# Attractors other than cycles are darker by this share of ink.
DARKER = 0.16
# Shares of white that separate classes with the same face: other bands by side, another order, seven more bands.
LIGHTER = (0.0, 0.32, 0.58)
# Faces of classes without an attractor.
ALL_LEAVE, ALL_COLLAPSE, NEITHER_ALL = "#EE9A62", "#6A4C93", "#F6D9C4"
DOUBT, DOUBT_HATCH = "#B4B4B4", "xxxx"
LEAVE_HATCH, COLLAPSE_HATCH = "////", "...."
MOST_LINES = 12
# Height of a line of the legend, and of the room below an entry [inches].
LINE, GAP = 0.145, 0.13
# With more edges between pixels than this, lines would hide the pixels that they separate.
MOST_EDGES = 12_000
# Least room around a number, as a share of the points along the shorter axis.
ROOM = 0.025


def look_of(number: int, name: str) -> dict[str, Any]:
    """Return face and hatch of a class.

    Examples
    --------
    >>> look_of(0, "undecided")
    {'facecolor': '#B4B4B4', 'hatch': 'xxxx'}
    >>> look_of(1, "bands:3,order:0,period:3;leaves:some;collapses:none")
    {'facecolor': (0.4667, 0.6667, 0.8667), 'hatch': '////'}
    """
    if number == UNDECIDED:
        return {"facecolor": DOUBT, "hatch": DOUBT_HATCH}
    topology = named_class(name)
    hatch = LEAVE_HATCH * (topology.leaves == "some") + COLLAPSE_HATCH * (topology.collapses == "some")
    if not topology.attractors:
        face = {topology.leaves: ALL_LEAVE, topology.collapses: ALL_COLLAPSE}.get("all", NEITHER_ALL)
        return {"facecolor": face, "hatch": hatch}
    parts = sum(sum(each.bands) for each in topology.attractors)
    share = 0.0 if any(each.period for each in topology.attractors) else DARKER
    lap, hue = divmod(parts + 2 * len(topology.attractors) - 3, len(FACES))
    light = LIGHTER[(lap + sum(map(_spread, topology.attractors))) % len(LIGHTER)]
    colour = (1.0 - share) * np.array(to_rgb(FACES[hue])) + share * np.array(to_rgb(style.INK))
    mixed = (1.0 - light) * colour + light
    return {"facecolor": tuple(round(each, 4) for each in mixed.tolist()), "hatch": hatch}


def _spread(kind: AttractorKind) -> int:
    """Give a small number that differs for attractors with equally many bands, by their sides and the sides' order."""
    order = kind.flip_order
    turned = 2 if order is None else int(order != tuple(sorted(order)))
    return turned + sum(side * bands for side, bands in enumerate(kind.bands))


@arguments_checked
def atlas(found: Atlas, fitted: Machines | None = None) -> Figure:
    """Draw the classes of an atlas of one or two axes, with a legend in words, most frequent classes first.

    Parameters
    ----------
    found : Atlas
        From `limitsets.atlas`, with the variable `class`, or those of which classes are made.
    fitted : Machines, optional
        Of a fit (`limitsets.fitting.Fit.machines`): where it leaves the quantities is drawn.

    Returns
    -------
    matplotlib.figure.Figure
        Shares in the legend are of the points at which there is a scene or map.

    Raises
    ------
    AnswerError
        The atlas has no classes.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = ls.atlas(ls.maps.Logistic(3.2), "r=3.2:3.84:3", domain=[(0, 1)])
    >>> for text in ls.plot.atlas(found).legends[0].get_texts()[:3]:
    ...     print(text.get_text())
    1: one attractor, a cycle of 2 (33 %)
    2: one attractor, a cycle of 3 (33 %)
    3: one attractor, a cycle of 4 (33 %)
    """
    data = found.dataset
    if not is_classified(data):
        raise AnswerError(
            "the atlas",
            ", ".join(map(str, data)),
            "one with the variable class, which the task of the topology gives",
            "draw what a task of your own says with ls.plot.atlas_surface",
        )
    numbers, _ = numbers_of(data)
    entries = legend(data)
    looks = {each.number: look_of(each.number, each.name) for each in entries}
    doubt = [each for each in entries if each.number == UNDECIDED]
    sure = entries[: len(entries) - len(doubt)]
    lines, rest = sure[:MOST_LINES] + doubt, sure[MOST_LINES:]
    words = [_words(k + 1, each) for k, each in enumerate(lines)]
    figure, axes = frame(found, 1.1 + sum(LINE * (1 + text.count("\n")) + GAP for text in words))
    if len(found.axes) == 1:
        axes.set_yticks([])
    rows = np.atleast_2d(numbers)
    _paint(axes, found, rows, looks)
    goal = goal_line(axes, found) + unreached(axes, found)
    for k, each in enumerate(lines):
        _label(axes, found, rows == each.number, str(k + 1))
    handles = [
        Patch(label=text, edgecolor=style.INK, lw=0.5, **looks[each.number])
        for text, each in zip(words, lines, strict=True)
    ]
    if rest:
        share = _percent(sum(each.share for each in rest))
        handles.append(Patch(label=f"{len(rest)} other class{'es' * (len(rest) > 1)} ({share})", alpha=0.0))
    handles += goal + mark(axes, found) + ([] if fitted is None else possible(axes, found, fitted))
    figure.legend(
        handles=handles, loc="outside right upper", fontsize=style.SMALL, frameon=False, handlelength=2.4,
        handleheight=1.6, labelspacing=0.9, borderaxespad=0.8,
    )  # fmt: skip
    title = f"{title_of(found)}: topology of the attractors"
    if "level" in data:
        title += f"; {_percent(float((data['level'].values >= 0).mean()))} of the points computed"
    axes.set_title(title, loc="left", fontsize=style.TEXT + 1)
    return figure


def _percent(share: float) -> str:
    percent = 100.0 * share
    digits = ".0f" if percent >= 9.95 else ".1f" if percent >= 0.05 else ".1g"
    return f"{percent:{digits}} %"


def _words(number: int, entry: Entry) -> str:
    share = _percent(entry.share).replace(" ", "\N{NO-BREAK SPACE}")  # on one line
    lines = textwrap.wrap(f"{number}: {entry.words} ({share})", 46, subsequent_indent="   ")
    return "\n".join(lines).replace("\N{NO-BREAK SPACE}", " ")


def _paint(axes: Axes, answers: Atlas, rows: Ints, looks: Mapping[int, dict[str, Any]]) -> None:
    """Paint the classes, their hatches, and lines between them."""
    x, y = pixels(answers)
    picture = np.ones((*rows.shape, 3))
    for number, look in looks.items():
        picture[rows == number] = to_rgb(look["facecolor"])
    axes.pcolorfast(x, y, picture, zorder=1)
    for hatch in sorted({look["hatch"] for look in looks.values()} - {""}):
        numbers = [number for number, look in looks.items() if look["hatch"] == hatch]
        hatched(axes, x, y, np.isin(rows, numbers), hatch)
    (i, j), (k, m) = np.nonzero(rows[:, 1:] != rows[:, :-1]), np.nonzero(rows[1:] != rows[:-1])
    if i.size + k.size <= MOST_EDGES:
        upright = np.stack([x[j + 1], y[i], x[j + 1], y[i + 1]], axis=1)
        level = np.stack([x[m], y[k + 1], x[m + 1], y[k + 1]], axis=1)
        pairs = list(np.concatenate([upright, level]).reshape(-1, 2, 2))
        lines = LineCollection(pairs, colors=style.INK, linewidths=0.5, zorder=3, gid="boundaries")
        axes.add_collection(lines, autolim=False)


def _label(axes: Axes, answers: Atlas, where: Mask, words: str) -> None:
    """Write the number of a class into its largest region, at the point farthest from the region's edge."""
    if len(answers.axes) == 1:
        where = np.repeat(where, max(where.size // 4, 3), axis=0)
    regions, count = label(where)
    if count == 0:
        return
    (i, j), room = widest(regions == 1 + np.bincount(regions.ravel())[1:].argmax())
    if room < max(ROOM * min(where.shape), 1.5):
        return
    x = float(answers.dataset[answers.axes[-1]].values[j])
    y = float(answers.dataset[answers.axes[0]].values[i]) if len(answers.axes) == 2 else 0.5
    box = {"boxstyle": "circle,pad=0.22", "fc": "white", "ec": style.INK, "lw": 0.5, "alpha": 0.92}
    axes.text(x, y, words, ha="center", va="center", fontsize=style.SMALL, bbox=box, zorder=5, gid="number")


def widest(where: Mask) -> tuple[tuple[int, int], float]:
    """Give the point that is farthest from the edge of a region, and its distance from there."""
    room = distance_transform_edt(np.pad(where, 1))[1:-1, 1:-1]
    row, column = np.unravel_index(int(room.argmax()), room.shape)
    return (int(row), int(column)), float(room[row, column])
