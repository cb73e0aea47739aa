"""Shared by all figures: their subject, colours, line styles, hatches, an empty figure, a piece of an orbit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from limitsets.base import AnswerError
from limitsets.base.arrays import Array
from limitsets.feeder.goals import Goal, OrientedBeyond
from limitsets.feeder.scene import Scene
from limitsets.parameters.analysis import other_vertex_first
from limitsets.systems.cells import Domain
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.maps import Orbit, orbit
from limitsets.systems.maps.contract import kind_of

# ----------------------------------------------------------------
# The subject of a figure: a scene, or a user's map with its domain, as a transition graph has them.


class Subject(NamedTuple):
    """A map in one dimension, and the words for it.

    Parameters
    ----------
    name : str
        Name of the scene or map.
    unit : str
        Unit of x; empty for a user's map.
    map : NamedTuple
        The parameters of the map.
    domain : Domain
        The domain of the map.
    least, most : ndarray of shape (sides,), float
        Least state on each side, and largest on any side; for a scene a_i and the end of the arm.
    goal : Goal or None
        Goal of the scene.
    branches : tuple of str
        Names of the codes from 0.
    flags : dict
        Places from which another vertex lands first, per side.
    thrown : bool
        Whether the map is that of a scene.
    """

    name: str
    unit: str
    map: Any
    domain: Domain
    least: Array
    most: float
    goal: Goal | None
    branches: tuple[str, ...]
    flags: Mapping[int, Sequence[tuple[float, float]]]
    thrown: bool

    @property
    def in_brackets(self) -> str:
        """The unit behind the name of a quantity."""
        return f" [{self.unit}]" if self.unit else ""

    @property
    def sides(self) -> int:
        """Number of sides."""
        return len(self.least)


def subject_of(source: Scene | TransitionGraph) -> Subject:
    """Read a scene or a transition graph.

    Raises
    ------
    AnswerError
        A map in more than one dimension.
    """
    branches = kind_of(source.map).branches
    if isinstance(source, Scene):
        return Subject(
            source.name,
            source.unit,
            source.map,
            domain=source.domain,
            least=source.sides.a,
            most=source.arm_length,
            goal=source.goal,
            branches=branches,
            flags=other_vertex_first(source),
            thrown=True,
        )
    domain = source.grid.domain
    if source.grid.dimension > 1:
        raise AnswerError(
            "the dimension of the map", source.grid.dimension, "1", "draw its basins, or a section of it"
        )
    domain.require_ends("the grid of a picture of the map, or of a limit set")
    return Subject(
        type(source.map).__name__,
        "",
        source.map,
        domain=domain,
        least=domain.lo[:, 0],
        most=float(domain.hi.max()),
        goal=None,
        branches=branches,
        flags={},
        thrown=False,
    )


# ----------------------------------------------------------------
# Shared by all figures: colours, line styles, hatches, an empty figure, and a piece of an orbit.


Extents: TypeAlias = Mapping[int, Sequence[tuple[float, float]]]

# After Okabe and Ito; as grey their lightness differs too: 0.38, 0.51, 0.59 and so on.
INK = "#222222"
JOG = "#0072B2"
FLIP = "#C04A00"
ROLL = "#8A3FA0"
GOAL = "#007A5A"
FAINT = "#8c8c8c"
# Sets: face, hatch.  Light faces with dark hatches keep text and lines on them legible.
SETS = (
    ("#5BA3D0", ""),
    ("#F2C14E", "///"),
    ("#9BD1B8", "..."),
    ("#D99AC0", "\\\\\\"),
    ("#C9C9C9", "xxx"),
    ("#E8E1A0", "+++"),
)
JOG_LINE, FLIP_LINE, ROLL_LINE = "-", (0, (4.5, 1.8)), (0, (4.5, 1.5, 1.0, 1.5))
GOAL_LINE: dict[str, Any] = {"color": GOAL, "lw": 1.3, "ls": (0, (1, 1.5))}
SMALL, TEXT = 8.5, 10.0
# Behind words that lines would cross.
PLATE: dict[str, Any] = {"boxstyle": "square,pad=0.1", "fc": "white", "ec": "none"}

# Steps after which an orbit counts as being on its attractor.
TRANSIENT = 2000
# Throws of an orbit that are drawn at most.
MOST = 90


def canvas(
    width: float, height: float, rows: int = 1, columns: int = 1, **options: Any
) -> tuple[Figure, list[Axes]]:
    """Make a figure of `rows` times `columns` axes [inches]; the axes row by row."""
    figure = Figure(figsize=(width, height), layout=ConstrainedLayoutEngine(h_pad=0.1, w_pad=0.06), dpi=110)
    return figure, list(figure.subplots(rows, columns, squeeze=False, **options).ravel())


def panels(
    count: int, columns: int, size: tuple[float, float], room: tuple[float, float], below: str = ""
) -> tuple[Figure, list[Axes]]:
    """Make a figure of panels; with a label, `below`, they share their limits, and the lowest in each column has it.

    `size` is the size of a panel, `room` the border around all of them [inches].
    """
    rows, shared = math.ceil(count / columns), bool(below)
    wide, tall = size[0] * columns + room[0], size[1] * rows + room[1]
    figure, frames = canvas(wide, tall, rows, columns, sharex=shared, sharey=shared)
    for axes in frames[count:]:
        axes.set_axis_off()
    for k, axes in enumerate(frames[:count] if shared else ()):
        lowest = k + columns >= count
        axes.xaxis.set_tick_params(labelbottom=lowest)
        axes.set_xlabel(below if lowest else "")
    return figure, frames[:count]


def extents_of(source: Any) -> list[Extents]:
    """Read intervals off an attractor, a limit set, an analysis, or several of them."""
    extents = getattr(source, "extents", source)
    if isinstance(extents, Mapping):
        return [extents]
    if isinstance(extents, Iterable) and not isinstance(extents, str):
        parts = [getattr(one, "extents", one) for one in extents]
        known = [part for part in parts if isinstance(part, Mapping)]
        if len(known) == len(parts):
            return known
    raise AnswerError(
        "what to draw", type(source).__name__, "attractors, limit sets or an analysis", "pass one of these"
    )


def ends_of(sets: Iterable[Extents]) -> list[float]:
    """List the ends of all intervals."""
    return [x for extents in sets for parts in extents.values() for pair in parts for x in pair]


def stretch(scene: Scene | Subject, extents: Extents, throws: int = 12) -> Orbit | None:
    """Cut whole rounds out of an orbit: from one arrival on its first side to another, at least `throws` throws later.

    Parameters
    ----------
    scene : Scene
        The scene.
    extents : mapping
        Intervals of the attractor.
    throws : int
        Least number of throws; there are at most 90, even if the last round is then not complete.

    Returns
    -------
    Orbit or None
        None if no orbit stays.
    """
    starts = [(hi - lo, side, 0.5 * (lo + hi)) for side, parts in extents.items() for lo, hi in parts]
    if not starts:
        return None
    _, side, x = max(starts)
    before = orbit(scene.map, x, side, TRANSIENT)
    if before.stopped:
        return None
    path = orbit(scene.map, float(before.x[-1]), int(before.side[-1]), 6 * MOST)
    if path.code.size == 0:
        return None
    first = min(extents)
    arrivals = 1 + np.flatnonzero((path.side[1:] == first) & (path.side[:-1] != first))
    begin = int(arrivals[0]) if arrivals.size else 0
    later = arrivals[arrivals >= begin + throws]
    end = min(int(later[0]) if later.size else begin + throws, begin + MOST, path.code.size)
    return Orbit(path.x[begin : end + 1], path.side[begin : end + 1], path.code[begin:end], None)


def of_set(number: int) -> dict[str, Any]:
    """Give face, hatch and edge of the set with this number."""
    face, hatch = SETS[number % len(SETS)]
    return {"facecolor": face, "hatch": hatch, "edgecolor": INK}


def bars(axes: Axes, parts: Iterable[tuple[float, float]], middle: float, half: float, **look: Any) -> None:
    """Draw a bar for each interval, `half` its height, in the lane at the height `middle`."""
    for lo, hi in parts:
        axes.add_patch(Rectangle((lo, middle - half), hi - lo, 2 * half, **look))


def widened(lo: float, hi: float, share: float) -> tuple[float, float]:
    """Give limits of an axis that leave room at both ends, a share of the distance between them."""
    return lo - share * (hi - lo), hi + share * (hi - lo)


def note(axes: Axes, words: str, at: tuple[float, float], shift: tuple[float, float], **how: Any) -> None:
    """Write words at a shift [points] from a place, in data coordinates or those of `xycoords`."""
    axes.annotate(words, at, xytext=shift, textcoords="offset points", **{"fontsize": SMALL, **how})


def name(axes: Axes, words: str, at: tuple[float, float], shift: tuple[float, float], **how: Any) -> None:
    """Write the name of a critical point, left below a place; `keep_apart` finds such names by their gid."""
    note(axes, words, at, shift, ha="right", va="top", gid="name", **how)


def open_frame(axes: Axes, *borders: str) -> None:
    """Remove borders of a frame: the top and the right one, and those named."""
    axes.spines[["top", "right", *borders]].set_visible(False)


def panel(
    axes: Axes, title: str = "", *, legend: Any = "", small_ticks: bool = False, **properties: Any
) -> None:
    """Set properties of a panel as `Axes.set` does, with small labels, a title on the left and an open frame.

    `legend` is the place of a legend inside it; with `small_ticks` the numbers of the axes are small as well.
    """
    axes.set(**properties)
    axes.set_title(title, loc="left", fontsize=TEXT)
    for axis in (axes.xaxis, axes.yaxis):
        axis.label.set_fontsize(SMALL)
    if small_ticks:
        axes.tick_params(labelsize=SMALL)
    if legend:
        axes.legend(loc=legend, fontsize=SMALL, frameon=False)
    open_frame(axes)


def lanes(axes: Axes, names: Mapping[Any, str], size: float = SMALL) -> None:
    """Write names of lanes by their heights, and remove the frame except its base."""
    axes.set_yticks(list(names), list(names.values()), fontsize=size)
    open_frame(axes, "left")
    axes.tick_params(axis="y", length=0)


def goal(axes: Axes, scene: Scene | Subject, zorder: float) -> None:
    """Draw the line beyond which only one side is allowed, if the scene's goal is of this kind."""
    if isinstance(scene.goal, OrientedBeyond):
        axes.axvline(scene.goal.x, zorder=zorder, gid="goal", **GOAL_LINE)


def key(label: str, **look: Any) -> Line2D:
    """Make the entry of a line or, with ``ls=""``, of a marker in a legend."""
    return Line2D([], [], label=label, **look)


def key_of_goal(scene: Scene | Subject) -> Line2D | None:
    """Make the legend's entry for the line that `goal` draws."""
    if not isinstance(scene.goal, OrientedBeyond):
        return None
    return key(f"goal: side {scene.goal.side} beyond {scene.goal.x:g} {scene.unit}", **GOAL_LINE)


def legend(figure: Figure, handles: Iterable[Any], columns: int) -> None:
    """Put a legend below all axes; entries that are None are left out."""
    entries = [handle for handle in handles if handle is not None]
    columns = min(columns, max(len(entries), 1))
    figure.legend(handles=entries, loc="outside lower center", ncols=columns, fontsize=SMALL, frameon=False)


def title(figure: Figure, text: str) -> None:
    """Put a title above all axes."""
    figure.suptitle(text, fontsize=TEXT + 1.5)


def finished(figure: Figure, text: str, handles: Iterable[Any] = (), columns: int = 3) -> Figure:
    """Give the figure with its title, and a legend below all axes if it has entries."""
    title(figure, text)
    if handles:
        legend(figure, handles, columns)
    return figure


def keep_apart(axes: Axes, share: float) -> None:
    """Remove names of critical points that would overlap the name before; each name is left of its point.

    Parameters
    ----------
    axes : Axes
        Axes with their limits set; names have the gid "name", and those of one row are in order from left to right.
    share : float
        Width of a name, as a share of the width of the axes.
    """
    lo, hi = axes.get_xlim()
    row, last = None, lo
    for text in [each for each in axes.texts if each.get_gid() == "name"]:
        x, y = text.xy  # type: ignore[attr-defined]  # of an annotation
        if y == row and x - last < share * (hi - lo):
            text.remove()
        else:
            row, last = y, x


def interval_text(parts: Sequence[tuple[float, float]]) -> str:
    """Write intervals, one per line, in at most two lines."""
    lines = [f"{lo:.2f} to {hi:.2f}" for lo, hi in parts[:2]]
    if len(parts) > 2:
        lines[-1] = f"... {len(parts)} intervals"
    return "\n".join(lines)
