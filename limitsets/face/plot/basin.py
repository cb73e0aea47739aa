"""Basins, as strips per side or pictures of the plane, and the Morse graph in layers."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import Any

import networkx as nx
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Patch

from limitsets.base import AnswerError, arguments_checked
from limitsets.face.plot import style
from limitsets.feeder.scene import Scene
from limitsets.systems.cells import CellSet, Grid
from limitsets.systems.graph import TransitionGraph, morse_graph
from limitsets.systems.maps import codes, kind_of
from limitsets.systems.sets import Basins

# Lightness falls, so that neighbours differ in grey as well; in strips they also differ by hatches.
ATTRACTORS = ("#CFE5F5", "#F0B429", "#5FB59B", "#B5548A", "#3F4E96", "#2B2A1E")
HATCHES = ("", "///", "...", "\\\\\\", "xxx", "+++")
EDGE: dict[str, Any] = {"edgecolor": "#444444", "lw": 0.4}
INSIDE = ListedColormap([style.FLIP])
OUT: dict[int, tuple[str, str, str]] = {
    codes.INWARD: ("#6E6E6E", "ooo", "leaves inward"),
    codes.OUTWARD: ("#3A3A3A", "", "leaves outward"),
    codes.OUTSIDE_MODEL: ("#A8A8A8", "***", "outside the model"),
    codes.UNDECIDED: ("#FFFFFF", "|||||", "undecided"),
    codes.UNDEFINED: ("#E4D7C5", "ooo...", "the map is undefined"),
}


@arguments_checked
def basins(source: Any, shares: Basins, found: Any = None) -> Figure:
    """Draw from where each attractor is reached.

    Parameters
    ----------
    source : Scene, TransitionGraph, map or Grid
        What the basins belong to; a scene gives names and units, a map of one's own or its graph a name.
    shares : Basins
        From `limitsets.basins`, in one or two dimensions.
    found : attractors, limit sets, one of them, or an Analysis, optional
        Drawn dark inside their basins: as bars, in two dimensions as the cells of attractors.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    AnswerError
        For basins in three dimensions, or something without extents (in two dimensions: without cells).

    Examples
    --------
    >>> import limitsets as ls
    >>> analysis = ls.analyse("paper-designed")
    >>> len(ls.plot.basins(analysis.scene, analysis.basins).axes)
    1
    """
    grid = shares.grid
    if grid.dimension > 2:
        raise AnswerError(
            "the dimension of the basins", grid.dimension, "1 or 2", "draw a section of them yourself"
        )
    (name, unit), line = _words(source), grid.dimension == 1
    read: Callable[[Any], list[Any]] = style.extents_of if line else _cells_of
    sets = [] if found is None else read(found)
    figure = _strips(shares, sets, unit) if line else _plane(shares, sets)
    inside = Patch(facecolor=style.INK if line else style.FLIP, label="the limit set itself")
    drawn = found is not None if line else any(sets)
    handles = [*_legend(shares), inside if drawn else None]
    columns = 3 if figure.get_figwidth() > 8.0 else 2
    return style.finished(figure, f"Basins{name}: where a start ends up", handles, columns)


def _words(source: Any) -> tuple[str, str]:
    """Give the name of the basins' scene or map for the title, and the unit of x in brackets."""
    if isinstance(source, Scene):
        return f" of {source.name}", f" [{source.unit}]"
    if isinstance(source, Grid):
        return "", ""
    return f" of {kind_of(getattr(source, 'map', source)).name}", ""


def _cells_of(attractors: Any) -> list[CellSet]:
    """Read sets of cells off attractors, or one of them."""
    several = attractors if isinstance(attractors, Iterable) else [attractors]
    cells: list[Any] = [getattr(attractor, "cells", None) for attractor in several]
    if not all(isinstance(cell_set, CellSet) for cell_set in cells):
        raise AnswerError(
            "what to draw", type(attractors).__name__, "attractors", "pass those of ls.attractors"
        )
    return cells


def _look(label: int) -> dict[str, Any]:
    number = label % len(ATTRACTORS)
    face, hatch = OUT[label][:2] if label < 0 else (ATTRACTORS[number], HATCHES[number])
    return {"facecolor": face, "hatch": hatch, **EDGE}


def _strips(shares: Basins, sets: list[style.Extents], unit: str) -> Figure:
    grid = shares.grid
    figure, (axes,) = style.canvas(9.0, 0.72 * grid.sides + 1.7)
    for side, lo, hi, label in strips_of(shares):
        style.bars(axes, [(lo, hi)], -side, 0.32, gid=f"label {label}", **_look(label))
    look = {"facecolor": style.INK, "lw": 0, "zorder": 3, "gid": "attractor"}
    for extents in sets:
        for side, parts in extents.items():
            style.bars(axes, parts, -side, 0.07, **look)
    style.lanes(axes, {-side: f"side {side}" for side in range(grid.sides)}, style.TEXT)
    ends = style.widened(float(grid.domain.lo.min()), float(grid.domain.hi.max()), 0.01)
    axes.set(xlim=ends, ylim=(-grid.sides + 0.5, 0.5), xlabel=f"x of the start{unit}")
    return figure


def strips_of(shares: Basins) -> list[tuple[int, float, float, int]]:
    """Join cells of one label that lie side by side: side, ends, label."""
    strips = []
    for side in range(shares.grid.sides):
        edges, labels = shares.grid.edges[side][0], shares.labels[shares.grid.of_side(side)]
        border = [0, *(np.flatnonzero(np.diff(labels)) + 1).tolist(), labels.size]
        for first, last in pairwise(border if labels.size else ()):
            strips.append((side, float(edges[first]), float(edges[last]), int(labels[first])))
    return strips


def _plane(shares: Basins, attractors: list[CellSet]) -> Figure:
    grid = shares.grid
    figure, panels = style.canvas(4.6 * grid.sides + 0.6, 5.2, 1, grid.sides)
    kinds = sorted(set(shares.labels.tolist()))
    colours = ListedColormap([_look(kind)["facecolor"] for kind in kinds])
    number = np.searchsorted(kinds, shares.labels)
    norm = BoundaryNorm(np.arange(len(kinds) + 1) - 0.5, len(kinds))
    for side, axes in enumerate(panels):
        picture = number[grid.of_side(side)].reshape(tuple(grid.shape[side]))
        axes.pcolormesh(*grid.edges[side], picture.T, norm=norm, rasterized=True, cmap=colours)
        for cells in attractors:
            inside = cells.mask[grid.of_side(side)].reshape(tuple(grid.shape[side]))
            marked = np.ma.masked_where(~inside, inside).T
            axes.pcolormesh(*grid.edges[side], marked, rasterized=True, cmap=INSIDE, gid="attractor")
        axes.set(xlabel="$x_0$", ylabel="$x_1$")
        axes.set_title(f"side {side}" if grid.sides > 1 else "", fontsize=style.TEXT)
    return figure


def _legend(shares: Basins) -> list[Patch]:
    texts = {
        k: f"to limit set {k}: {_percent(share)} of all starts"
        for k, share in enumerate(shares.attractors[: len(ATTRACTORS)])
    }
    names = {name: code for code, name in codes.NAMES.items()}
    exits = {names.get(name, codes.OUTSIDE): share for name, share in shares.exits.items()}
    parts = {codes.UNDECIDED: shares.undecided_between} | exits
    for label in sorted(parts.keys() & set(shares.labels.tolist()), reverse=True):
        bare = label == codes.OUTSIDE and "outside" in shares.exits
        texts[label] = f"{'leaves the domain' if bare else OUT[label][2]}: {_percent(parts[label])}"
    plain = {} if shares.grid.dimension == 1 else {"hatch": ""}  # the picture of the plane has none
    return [Patch(label=text, **{**_look(label), **plain}) for label, text in texts.items()]


def _percent(share: float) -> str:
    """Round to a tenth of a percent, but never to 0 or 100."""
    percent = 100 * share
    if percent >= 100 - 1e-9 or percent == 0:
        return f"{percent:.0f} %"
    return "> 99.9 %" if percent > 99.9 else "< 0.1 %" if percent < 0.1 else f"{percent:.1f} %"


# ----------------------------------------------------------------
# The Morse graph: recurrent sets in layers, each above its successors.


# Nodes that are drawn at most: the attracting and the largest ones; the title says how many are left out.
MOST = 12
ORDER = "Arrows lead down the order. Areas grow with the number of cells; a double border: attracting."
Place = tuple[float, float]
ARROW: dict[str, Any] = {
    "arrowstyle": "-|>",
    "mutation_scale": 11,
    "shrinkA": 13,
    "shrinkB": 16,
    "color": "#555555",
    "lw": 1.0,
}


@arguments_checked
def morse(graph: nx.DiGraph[int] | TransitionGraph, name: str = "", unit: str = "") -> Figure:
    """Draw recurrent components and the order among them.

    Parameters
    ----------
    graph : networkx.DiGraph or TransitionGraph
        From `limitsets.morse_graph`, or the transition graph itself.
    name : str
        Name of the scene or map, for the title.
    unit : str
        Of x, behind the intervals.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import limitsets as ls
    >>> graph = ls.transitions(ls.maps.Cubic(1.5), ls.grid([(-1.2, 1.2)], cells=100), method="corners")
    >>> "2 attracting" in ls.plot.morse(graph).axes[0].get_title(loc="left")
    True
    """
    whole = morse_graph(graph) if isinstance(graph, TransitionGraph) else graph
    drawn = _condensed(whole)
    place = _places(drawn)
    layers = Counter(y for _, y in place.values())
    depth, widest = round(max(layers, default=0)), max(layers.values(), default=0)
    few = len(place) <= 6
    wide, tall = 3.0 if few else 1.4, max(0.7, min(1.45, 9.0 / (depth + 1)))
    figure, (axes,) = style.canvas(min(16.0, max(7.0, wide * widest + 1.0)), tall * (depth + 1) + 1.2)
    for node, other in drawn.edges:
        line = ":" if isinstance(other, str) else "-"
        axes.add_patch(FancyArrowPatch(place[node], place[other], ls=line, **ARROW))
    for node, (x, y) in place.items():
        _node(axes, node, drawn.nodes[node], x, y, few=few, unit=unit)
    half = 0.5 * max(widest, 2) + 0.1
    axes.set(xlim=(-half, half), ylim=(-0.72, depth + 0.55))
    axes.set_axis_off()
    axes.set_title(_title(whole, drawn, name), fontsize=style.TEXT + 1, loc="left")
    figure.supxlabel(ORDER, fontsize=style.SMALL)
    return figure


def _condensed(whole: nx.DiGraph[int]) -> nx.DiGraph[Any]:
    """Keep at most `MOST` nodes and their order; each kind of exit becomes a node with its name."""
    rank = sorted(
        whole.nodes, key=lambda node: (-whole.nodes[node]["attracting"], -whole.nodes[node]["cells"])
    )
    kept = set(rank[:MOST])
    order: nx.DiGraph[Any] = nx.DiGraph()
    order.add_nodes_from((node, whole.nodes[node]) for node in sorted(kept))
    for node in kept:
        order.add_edges_from((node, other) for other in nx.descendants(whole, node) & kept)
        order.add_edges_from((node, way) for way in whole.nodes[node]["exits"])
    drawn = nx.transitive_reduction(order)
    drawn.add_nodes_from(order.nodes(data=True))
    return drawn


def _places(drawn: nx.DiGraph[Any]) -> dict[Any, Place]:
    """Place nodes at the height of their longest way down, each above the middle of its successors."""
    place: dict[Any, Place] = {}
    order = {node: number for number, node in enumerate(drawn)}

    def pull(node: Any) -> tuple[float, int]:
        below = [place[other][0] for other in drawn.successors(node)]
        return sum(below) / len(below) if below else 0.0, order[node]

    for layer, nodes in enumerate(nx.topological_generations(drawn.reverse(copy=False))):
        for k, node in enumerate(sorted(nodes, key=pull)):
            place[node] = (k - 0.5 * (len(nodes) - 1), float(layer))
    return place


def _node(axes: Axes, node: Any, data: dict[str, Any], x: float, y: float, *, few: bool, unit: str) -> None:
    if isinstance(node, str):
        axes.plot([x], [y], "s", ms=16, mfc="white", mec=style.FAINT, ls="none", gid="exit")
        style.note(axes, f"leaves:\n{node}", (x, y), (0, -13), ha="center", va="top")
        return
    # the area grows with the root of the number of cells, so that small sets stay visible [points]
    size = 2 * (7.0 + 17.0 * math.sqrt(math.sqrt(min(data["cells"] / 200_000, 1.0))))
    circle: dict[str, Any] = {"marker": "o", "mec": style.INK, "mew": 1.2, "ls": "none"}
    face, gid = (style.SETS[0][0], "attracting") if data["attracting"] else ("white", "recurrent")
    axes.plot([x], [y], ms=size, mfc=face, gid=gid, **circle)
    if data["attracting"]:
        axes.plot([x], [y], ms=size + 6, mfc="none", gid="border", **circle)
    axes.annotate(str(node), (x, y), ha="center", va="center", fontsize=style.SMALL)
    lines = [f"{data['cells']} cell{'s' * (data['cells'] != 1)}"]
    if few:
        members = data.get("members")  # a graph from elsewhere has only intervals
        dimension, several = (
            (1, True) if members is None else (members.grid.dimension, members.grid.sides > 1)
        )
        along = [data["extents"], *(data["members"].extents(axis) for axis in range(1, dimension))]
        for axis, extents in enumerate(along):
            for side, parts in extents.items():
                shown = ", ".join(f"{lo:z.2f} to {hi:z.2f}" for lo, hi in parts[:2])
                # a map without sides has no name for side 0
                words = [f"side {side}:"] * several + [f"$x_{axis}$"] * (dimension > 1)
                lines.append(f"{' '.join([*words, shown])}{' ...' * (len(parts) > 2)} {unit}".rstrip())
    # An arrow to a way out may run behind the words.
    shift = (size / 2 + 7, 0)
    style.note(axes, "\n".join(lines), (x, y), shift, va="center", bbox=style.PLATE, gid="words")


def _title(whole: nx.DiGraph[int], drawn: nx.DiGraph[Any], name: str) -> str:
    attracting = sum(data["attracting"] for _, data in whole.nodes(data=True))
    sets = whole.number_of_nodes()
    owner = f" of {name}" if name else ""
    text = f"Morse graph{owner}: {sets} recurrent set{'' if sets == 1 else 's'}, {attracting} attracting"
    hidden = sets - sum(not isinstance(node, str) for node in drawn)
    return f"{text}\n({hidden} of the smallest are not drawn)" if hidden else text
