"""Numbers against parameters: surfaces and lines of an atlas, and the bifurcation diagram of a continuation."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patches import Patch

from limitsets.base import AnswerError, arguments_checked
from limitsets.base.arrays import Array
from limitsets.face.plot import style
from limitsets.face.plot.atlas_maps import frame, hatched, mark, pixels, title_of
from limitsets.feeder.scene import load
from limitsets.feeder.scene.quantities import NAMES, base_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.parameters.atlas import Atlas
    from limitsets.parameters.continuation import Continuation


# A map of colours that looks even, also in grey and to colour-blind readers.
COLOURS = "cividis"
# Percentiles between which colours are spread, so that a few extreme values do not use up the colours.
SPREAD = (1.0, 99.0)
NOTHING, NOTHING_HATCH = "#DDDDDD", "////"
WORDS = {
    "lyapunov": "Lyapunov exponent [per throw]",
    "flips_per_throw": "mean flips per throw",
    "threshold": "threshold of the goal",
    "margin": "margin of the goal",
    "leaves": "share of the starts that leave",
    "collapses": "share of the starts that collapse to the joint",
    "share": "share of the starts that the attractor collects",
    "reach": "largest x of the attractor",
    "jogs_max": "most jogs of a visit",
}


@arguments_checked
def atlas_surface(found: Atlas, variable: str, side: int | None = None) -> Figure:
    """Draw one variable of an atlas.

    Parameters
    ----------
    found : Atlas
        From `limitsets.atlas`.
    variable : str
        A number of its dataset: `lyapunov`, `flips_per_throw`, `threshold`, `margin`, `leaves`, ...  Of several
        attractors, that of the attractor with the largest share.
    side : int, optional
        For variables that have sides: of which; a map with one side needs none.

    Returns
    -------
    matplotlib.figure.Figure
        Hatched grey where there is no such number: undecided points, no attractor, no scene.  Lines: Lyapunov exponent
        0; the x of the scene's goal, for `threshold`.

    Raises
    ------
    AnswerError
        No such variable, or its side is missing.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = ls.atlas("paper-designed", "throw.speed=150:165:4", variables=["reach", "share"])
    >>> ls.plot.atlas_surface(found, "reach", side=2).axes[0].get_ylabel()
    'largest x of the attractor, side 2 [in]'
    """
    values = _values(found, variable, side)
    unit = found.dataset[variable].attrs.get("units", "")
    words = WORDS.get(variable, found.dataset[variable].attrs.get("long_name", variable))
    words += ("" if side is None else f", side {side}") + (f" [{unit}]" if unit else "")
    figure, axes = frame(found, 3.4)
    level = _level(found, variable)
    if values.ndim == 2:
        handles = _painted(figure, axes, found, values, words, level) + mark(axes, found)
    else:
        handles = _lined(axes, found, values, words, level)
    if handles:
        style.legend(figure, handles, 3)
    axes.set_title(f"{title_of(found)}: {words.partition(' [')[0]}", loc="left", fontsize=style.TEXT + 1)
    return figure


def _values(answers: Atlas, variable: str, side: int | None) -> Array:
    """Read the variable at every point; nan at points without a value."""
    data = answers.dataset
    if variable not in data or "flag_values" in data[variable].attrs:
        known = [str(name) for name in data if "flag_values" not in data[name].attrs]
        raise AnswerError("the variable to draw", variable, ", ".join(known), "name one of these")
    array = data[variable]
    if side is None and array.sizes.get("side") == 1:
        side = 0
    if ("side" in array.dims) != (side is not None) or (
        side is not None and not 0 <= side < array.sizes["side"]
    ):
        allowed = f"0 to {array.sizes['side'] - 1}" if "side" in array.dims else "None"
        raise AnswerError(f"the side of {variable}", side, allowed, "correct it")
    if side is not None:
        array = array.isel(side=side)
    values = np.asarray(array.values, dtype=np.float64)
    if np.asarray(array.values).dtype.kind == "i":
        values[values < 0] = np.nan
    if "attractor" in array.dims:
        if "share" not in data:
            raise AnswerError("the variable share", "missing", "one beside the others", "ask for it too")
        largest = np.nan_to_num(data["share"].values, nan=-1.0).argmax(axis=-1)
        values = np.take_along_axis(values, largest[..., None], axis=-1)[..., 0]
    if values.ndim != len(answers.axes):
        raise AnswerError("the variable to draw", variable, "one number at each point", "name another")
    return values


def _level(answers: Atlas, variable: str) -> tuple[float, str] | None:
    if variable == "lyapunov":
        return 0.0, "0"
    if variable != "threshold" or "scene" not in answers.dataset.attrs["plan"]:
        return None
    x = getattr(load(answers.dataset.attrs["scene"]).goal, "x", None)
    return None if x is None else (float(x), f"x of the goal, {x:g}")


def _painted(
    figure: Figure, axes: Axes, answers: Atlas, values: Array, words: str, level: tuple[float, str] | None
) -> list[object]:
    """Paint a surface over two quantities, with its scale; return the legend's entries."""
    x, y = pixels(answers)
    there = np.isfinite(values)
    axes.set_facecolor(NOTHING)
    hatched(axes, x, y, ~there, NOTHING_HATCH)
    handles: list[object] = []
    if there.any():
        low, high = np.percentile(values[there], SPREAD)
        shown = np.ma.masked_invalid(values)
        image = axes.pcolorfast(x, y, shown, cmap=COLOURS, vmin=low, vmax=high, zorder=1)
        cut = (bool((values[there] < low).any()), bool((values[there] > high).any()))
        extend = {(True, True): "both", (True, False): "min", (False, True): "max"}.get(cut, "neither")
        figure.colorbar(image, ax=axes, label=words, extend=extend, pad=0.02)
        if level is not None and values[there].min() < level[0] < values[there].max():
            xs, ys = (answers.dataset[name].values for name in reversed(answers.axes))
            axes.contour(xs, ys, shown, [level[0]], colors="white", linewidths=2.4, zorder=3)
            line = axes.contour(xs, ys, shown, [level[0]], colors=style.INK, linewidths=1.1, zorder=4)
            line.set_gid("level")
            handles.append(style.key(level[1], color=style.INK, lw=0.9))
    if not there.all():
        handles.append(
            Patch(label="none, or undecided", fc=NOTHING, ec=style.INK, hatch=NOTHING_HATCH, lw=0.5)
        )
    return handles


def _lined(
    axes: Axes, answers: Atlas, values: Array, words: str, level: tuple[float, str] | None
) -> list[object]:
    """Draw a line against one quantity."""
    x = answers.dataset[answers.axes[0]].values
    axes.plot(x, values, color=style.JOG, lw=1.1, marker="." if x.size < 60 else "", gid="values")
    axes.autoscale(axis="y")
    axes.set_ylabel(words)
    if level is None:
        return []
    axes.axhline(level[0], color=style.INK, lw=0.9, ls="--", gid="level")
    return [style.key(level[1], color=style.INK, lw=0.9, ls="--")]


# ----------------------------------------------------------------
# Bifurcation diagram: the bands of attractors against one parameter of a path, with critical points and events.


CRITICAL: dict[str, Any] = {"color": style.FLIP, "ls": style.FLIP_LINE, "lw": 1.0}
# Events, in the order of the legend: marker and colour.
EVENTS: dict[str, dict[str, Any]] = {
    "birth": {"marker": "^", "color": style.GOAL},
    "death": {"marker": "v", "color": style.FLIP},
    "merge": {"marker": ">", "color": style.ROLL},
    "split": {"marker": "<", "color": style.ROLL},
    "bands": {"marker": "|", "color": style.INK},
    "jump": {"marker": "x", "color": style.INK},
    "border collision": {"marker": "D", "color": style.FLIP},
    "touch": {"marker": "o", "color": style.FLIP},
}
MARK: dict[str, Any] = {"ls": "", "ms": 5.5, "mew": 1.2}


@arguments_checked
def bifurcation(found: Continuation, by: str | None = None) -> Figure:
    """Draw where the attractors lie on each side, against one parameter of the path.

    Parameters
    ----------
    found : Continuation
        From `limitsets.continuation`, in one dimension.
    by : str, optional
        The quantity or parameter to draw against, or "t"; default the first that the path changes.

    Returns
    -------
    matplotlib.figure.Figure
        One panel per side: bands as areas, points of attracting cycles as lines, critical points as broken lines.
        Events stand above the first panel, border collisions and touches at the place where they happen.

    Raises
    ------
    AnswerError
        For a quantity that the path does not set, or a path of a map of more dimensions.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = ls.continuation(ls.maps.Logistic(3.0), {"r": (2.9, 3.1)}, steps=4)
    >>> figure = ls.plot.bifurcation(found)
    >>> figure.axes[0].get_xlabel()
    'r'
    """
    sides = sorted(found.critical[0])
    if not sides:
        raise AnswerError("the path", found.name, "one of a one-dimensional map", "draw a map on a line")
    name = by or next((each for each, x in found.values.items() if np.ptp(x) > 0.0), "t")
    if name != "t" and name not in found.values:
        raise AnswerError("the parameter", name, ", ".join(["t", *found.values]), "name one of these")
    factor, label = _scale(found, name)
    along = factor * (found.t if name == "t" else found.values[name])
    count = len(sides)
    figure, panels = style.canvas(8.6, 2.2 * count + 1.9 if count > 1 else 5.2, count, 1, sharex=True)
    for side, axes in zip(sides, panels, strict=True):
        _bands(axes, found, side, along)
        _critical(axes, found, side, along)
        words = (f"x on side {side}" if count > 1 else "x") + (f" [{found.unit}]" if found.unit else "")
        axes.set(ylabel=words, xlim=(float(along.min()), float(along.max())))
        style.open_frame(axes)
    kinds = _events(panels, found, sides, name, factor)
    panels[-1].set_xlabel(label)
    return style.finished(figure, f"Attractors of {found.name}", _legend(found, kinds), 5)


def _scale(continuation: Continuation, name: str) -> tuple[float, str]:
    """Give factor and label of the axis: angles of a scene are in degrees."""
    if continuation.unit is None or name == "t":
        return 1.0, name
    pattern = "".join("[i]" if part.isdigit() else part for part in name.replace("[", "]").split("]"))
    dimension = NAMES.get(pattern, "")
    unit = base_unit(dimension, continuation.unit)
    if dimension in ("angular speed", "angle"):
        return math.degrees(1.0), f"{name} [{unit.replace('rad', 'deg')}]"
    return 1.0, f"{name} [{unit}]"


def _bands(axes: Axes, continuation: Continuation, side: int, along: Array) -> None:
    """Draw the bands of one side between neighbouring steps with the same number of bands."""
    for number in continuation.numbers:
        areas: list[Any] = []
        lines: list[Any] = []
        for k, (here, there) in enumerate(pairwise(continuation.attractors)):
            first, last = (
                states[number].extents.get(side, []) if number in states else [] for states in (here, there)
            )
            x, y = along[k], along[k + 1]
            for (a, b), (c, d) in zip(first, last, strict=True) if len(first) == len(last) else ():
                areas.append([(x, a), (y, c), (y, d), (x, b)])
                lines += [[(x, a), (y, c)], [(x, b), (y, d)]]
        face, _ = style.SETS[number % len(style.SETS)]
        axes.add_collection(
            PolyCollection(areas, facecolor=face, edgecolor=face, lw=0.4, zorder=2, gid="bands")
        )
        axes.add_collection(LineCollection(lines, colors=style.INK, lw=0.5, zorder=3, gid="ends"))
    axes.autoscale_view()


def _critical(axes: Axes, continuation: Continuation, side: int, along: Array) -> None:
    counts = [len(points[side]) for points in continuation.critical]
    for run in np.split(np.arange(len(counts)), np.flatnonzero(np.diff(counts)) + 1):
        for number in range(counts[run[0]] if run.size > 1 else 0):
            curve = [continuation.critical[k][side][number] for k in run]
            axes.plot(along[run], curve, zorder=4, gid="critical point", **CRITICAL)


def _events(
    panels: list[Axes], continuation: Continuation, sides: list[int], name: str, factor: float
) -> set[str]:
    """Mark the events; return the kinds that occur."""
    for event in continuation.events:
        ends = event.t if name == "t" else (event.values[0][name], event.values[1][name])
        at, look = factor * 0.5 * (ends[0] + ends[1]), EVENTS[event.kind]
        for axes in panels:
            axes.axvline(at, color=style.FAINT, lw=0.5, ls=":", zorder=1)
        if event.collision is not None:
            axes, y = panels[sides.index(event.collision.side)], event.collision.x
            how: dict[str, Any] = {}
        else:
            axes, y, how = panels[0], 1.02, {"transform": panels[0].get_xaxis_transform()}
        axes.plot([at], [y], mfc="none", zorder=6, clip_on=False, gid=event.kind, **MARK, **look, **how)
    return {event.kind for event in continuation.events}


def _legend(continuation: Continuation, kinds: set[str]) -> list[Any]:
    faces = [style.SETS[number % len(style.SETS)][0] for number in continuation.numbers[: len(style.SETS)]]
    critical = any(points for sides in continuation.critical for points in sides.values())
    return [
        *(
            Patch(facecolor=face, edgecolor=style.INK, lw=0.5, label=f"attractor {number}")
            for number, face in zip(continuation.numbers, faces, strict=False)
        ),
        style.key("critical point", **CRITICAL) if critical else None,
        *(
            style.key(f"event: {kind}", mfc="none", **MARK, **look)
            for kind, look in EVENTS.items()
            if kind in kinds
        ),
    ]
