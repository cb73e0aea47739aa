"""The Morse graph: recurrent sets in layers, each above its successors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import networkx as nx
from matplotlib.patches import FancyArrowPatch

from limitsets.arguments import arguments_checked
from limitsets.graph import TransitionGraph, morse_graph
from limitsets.plot import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# More nodes than this cannot be told apart: the attracting and the largest are drawn, the title says how many are not.
MOST = 12
Place = tuple[float, float]


@arguments_checked
def morse(graph: nx.DiGraph[int] | TransitionGraph, name: str = "", unit: str = "") -> Figure:
    """Draw recurrent components and the order among them.

    Parameters
    ----------
    graph : networkx.DiGraph or TransitionGraph
        From `limitsets.morse_graph`, or the transition graph itself.
    name : str
        Whose it is, for the title.
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
    depth = round(max((y for _, y in place.values()), default=0))
    widest = max((sum(1 for _, y in place.values() if y == layer) for layer in range(depth + 1)), default=1)
    few = len(place) <= 6
    wide, tall = 3.0 if few else 1.4, max(0.7, min(1.45, 9.0 / (depth + 1)))
    figure, (axes,) = style.canvas(min(16.0, max(7.0, wide * widest + 1.0)), tall * (depth + 1) + 1.2)
    for one, other in drawn.edges:
        _arrow(axes, place[one], place[other], dotted=isinstance(other, str))
    for node, (x, y) in place.items():
        _node(axes, node, drawn.nodes[node], x, y, few=few, unit=unit)
    axes.set_xlim(-0.5 * max(widest, 2) - 0.1, 0.5 * max(widest, 2) + 0.1)
    axes.set_ylim(-0.72, depth + 0.55)
    axes.set_axis_off()
    axes.set_title(_title(whole, drawn, name), fontsize=style.TEXT + 1, loc="left")
    figure.supxlabel(
        "Arrows lead down the order. Areas grow with the number of cells; a double border: attracting.",
        fontsize=style.SMALL,
    )
    return figure


def _condensed(whole: nx.DiGraph[int]) -> nx.DiGraph[Any]:
    """Keep at most `MOST` nodes and the order among them; ways out become nodes named after them."""
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
    """Height: the longest way down; across: side by side, in the middle of what they lead to."""
    place: dict[Any, Place] = {}
    order = {node: number for number, node in enumerate(drawn)}

    def pull(node: Any) -> tuple[float, int]:
        below = [place[other][0] for other in drawn.successors(node)]
        return sum(below) / len(below) if below else 0.0, order[node]

    for layer, nodes in enumerate(nx.topological_generations(drawn.reverse(copy=False))):
        for k, node in enumerate(sorted(nodes, key=pull)):
            place[node] = (k - 0.5 * (len(nodes) - 1), float(layer))
    return place


def _radius(cells: int) -> float:
    """Radius in points: the area grows with the root of the number of cells, so that small sets stay visible."""
    return 7.0 + 17.0 * math.sqrt(math.sqrt(min(cells / 200_000, 1.0)))


def _node(axes: Axes, node: Any, data: dict[str, Any], x: float, y: float, *, few: bool, unit: str) -> None:
    if isinstance(node, str):
        axes.plot([x], [y], "s", ms=16, mfc="white", mec=style.FAINT, ls="none", gid="exit")
        style.note(axes, f"leaves:\n{node}", (x, y), (0, -13), ha="center", va="top")
        return
    size = 2 * _radius(data["cells"])
    circle: dict[str, Any] = {"marker": "o", "mec": style.INK, "mew": 1.2, "ls": "none"}
    face, gid = (style.SETS[0][0], "attracting") if data["attracting"] else ("white", "recurrent")
    axes.plot([x], [y], ms=size, mfc=face, gid=gid, **circle)
    if data["attracting"]:
        axes.plot([x], [y], ms=size + 6, mfc="none", gid="border", **circle)
    axes.annotate(str(node), (x, y), ha="center", va="center", fontsize=style.SMALL)
    lines = [f"{data['cells']} cell{'' if data['cells'] == 1 else 's'}"]
    if few:
        members = data.get("members")  # a graph made elsewhere has intervals only
        axes_of = range(1 if members is None else members.grid.dimension)
        along = [data["extents"], *(data["members"].extents(axis) for axis in axes_of[1:])]
        sides = members is None or members.grid.sides > 1  # a map without sides says nothing of side 0
        every = [(side, axis, parts) for axis in axes_of for side, parts in along[axis].items()]
        for side, axis, parts in every:
            shown = ", ".join(f"{lo:z.2f} to {hi:z.2f}" for lo, hi in parts[:2])
            words = [f"side {side}:"] * sides + [f"$x_{axis}$"] * (len(axes_of) > 1)
            lines.append(f"{' '.join([*words, shown])}{' ...' if len(parts) > 2 else ''} {unit}".rstrip())
    # An arrow to a way out may run behind the words.
    box = {"boxstyle": "square,pad=0.1", "fc": "white", "ec": "none"}
    style.note(axes, "\n".join(lines), (x, y), (size / 2 + 7, 0), va="center", bbox=box, gid="words")


def _arrow(axes: Axes, start: Place, end: Place, *, dotted: bool) -> None:
    head: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": 11, "shrinkA": 13, "shrinkB": 16}
    line: dict[str, Any] = {"color": "#555555", "lw": 1.0, "ls": ":" if dotted else "-"}
    axes.add_patch(FancyArrowPatch(start, end, **head, **line))


def _title(whole: nx.DiGraph[int], drawn: nx.DiGraph[Any], name: str) -> str:
    attracting = sum(data["attracting"] for _, data in whole.nodes(data=True))
    sets = whole.number_of_nodes()
    owner = f" of {name}" if name else ""
    text = f"Morse graph{owner}: {sets} recurrent set{'' if sets == 1 else 's'}, {attracting} attracting"
    hidden = sets - sum(not isinstance(node, str) for node in drawn)
    return f"{text}\n({hidden} of the smallest are not drawn)" if hidden else text
