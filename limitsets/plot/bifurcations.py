"""Bifurcation diagram: the bands of attractors against one parameter of a path, with critical points and events."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patches import Patch

from limitsets.arguments import arguments_checked
from limitsets.errors import AnswerError
from limitsets.plot import style
from limitsets.scene.quantities import NAMES, base_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from limitsets.sweep.continuation import Continuation

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
        unit = f" [{found.unit}]" if found.unit else ""
        axes.set_ylabel(f"x on side {side}{unit}" if count > 1 else f"x{unit}")
        axes.set_xlim(float(along.min()), float(along.max()))
        style.open_frame(axes)
    kinds = _events(panels, found, sides, name, factor)
    panels[-1].set_xlabel(label)
    style.title(figure, f"Attractors of {found.name}")
    style.legend(figure, _legend(found, kinds), 5)
    return figure


def _scale(found: Continuation, name: str) -> tuple[float, str]:
    """Factor and label of the axis: angles of a scene in degrees."""
    if found.unit is None or name == "t":
        return 1.0, name
    pattern = "".join("[i]" if part.isdigit() else part for part in name.replace("[", "]").split("]"))
    dimension = NAMES.get(pattern, "")
    unit = base_unit(dimension, found.unit)
    if dimension in ("angular speed", "angle"):
        return math.degrees(1.0), f"{name} [{unit.replace('rad', 'deg')}]"
    return 1.0, f"{name} [{unit}]"


def _bands(axes: Axes, found: Continuation, side: int, along: NDArray[np.float64]) -> None:
    """Draw the bands of one side between steps that have as many of them."""
    for number in found.numbers:
        areas: list[Any] = []
        lines: list[Any] = []
        for k, (here, there) in enumerate(pairwise(found.attractors)):
            if number not in here or number not in there:
                continue
            first, last = (states[number].extents.get(side, []) for states in (here, there))
            if len(first) != len(last):
                continue
            x, y = along[k], along[k + 1]
            for (a, b), (c, d) in zip(first, last, strict=True):
                areas.append([(x, a), (y, c), (y, d), (x, b)])
                lines += [[(x, a), (y, c)], [(x, b), (y, d)]]
        face, _ = style.SETS[number % len(style.SETS)]
        axes.add_collection(
            PolyCollection(areas, facecolor=face, edgecolor=face, lw=0.4, zorder=2, gid="bands")
        )
        axes.add_collection(LineCollection(lines, colors=style.INK, lw=0.5, zorder=3, gid="ends"))
    axes.autoscale_view()


def _critical(axes: Axes, found: Continuation, side: int, along: NDArray[np.float64]) -> None:
    lines = [
        [(along[k], c), (along[k + 1], d)]
        for k, (here, there) in enumerate(pairwise(found.critical))
        if len(here[side]) == len(there[side])
        for c, d in zip(here[side], there[side], strict=True)
    ]
    # Joined where they belong together, so that the dashes do not begin anew at every step.
    ways: list[list[tuple[float, float]]] = []
    for first, last in lines:
        way = next((each for each in ways if each[-1] == first), None)
        if way is None:
            ways.append([first, last])
        else:
            way.append(last)
    for way in ways:
        x, y = zip(*way, strict=True)
        axes.plot(x, y, zorder=4, gid="critical point", **CRITICAL)


def _events(panels: list[Axes], found: Continuation, sides: list[int], name: str, factor: float) -> set[str]:
    """Mark the events; the kinds that there are."""
    for event in found.events:
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
    return {event.kind for event in found.events}


def _legend(found: Continuation, kinds: set[str]) -> list[Any]:
    handles: list[Any] = []
    for number in found.numbers[: len(style.SETS)]:
        face, _ = style.SETS[number % len(style.SETS)]
        handles.append(Patch(facecolor=face, edgecolor=style.INK, lw=0.5, label=f"attractor {number}"))
    if any(points for each in found.critical for points in each.values()):
        handles.append(style.key("critical point", **CRITICAL))
    handles += [
        style.key(f"event: {kind}", mfc="none", **MARK, **look)
        for kind, look in EVENTS.items()
        if kind in kinds
    ]
    return handles
