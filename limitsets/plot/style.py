"""What all figures share: colours, line styles, hatches, an empty figure, and a stretch of an orbit to draw."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from limitsets.errors import AnswerError
from limitsets.maps import Orbit, orbit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from limitsets.scene import Scene

__all__ = ["Extents", "canvas", "extents_of", "interval_text", "legend", "orbit_on", "stretch", "title"]

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
SMALL, TEXT = 8.5, 10.0

# Steps before an orbit is taken to be on its attractor.
TRANSIENT = 2000


def canvas(
    width: float, height: float, rows: int = 1, columns: int = 1, **options: Any
) -> tuple[Figure, list[Axes]]:
    """Make a figure of `rows` times `columns` axes [inches]; the axes row by row."""
    figure = Figure(figsize=(width, height), layout=ConstrainedLayoutEngine(h_pad=0.1, w_pad=0.06), dpi=110)
    grid = figure.subplots(rows, columns, squeeze=False, **options)
    return figure, list(grid.ravel())


def extents_of(found: Any) -> list[Extents]:
    """Read intervals off an attractor, a limit set, an analysis, or several of them."""
    extents = getattr(found, "extents", found)
    if isinstance(extents, Mapping):
        return [extents]
    if isinstance(extents, Iterable) and not isinstance(extents, str):
        parts = [getattr(one, "extents", one) for one in extents]
        known = [part for part in parts if isinstance(part, Mapping)]
        if len(known) == len(parts):
            return known
    raise AnswerError(
        "what to draw", type(found).__name__, "attractors, limit sets or an analysis", "pass one of these"
    )


def orbit_on(scene: Scene, extents: Extents, count: int) -> Orbit | None:
    """Follow an orbit on an attractor; None where there is none to follow."""
    widest = max(
        ((hi - lo, side, 0.5 * (lo + hi)) for side, parts in extents.items() for lo, hi in parts),
        default=None,
    )
    if widest is None:
        return None
    before = orbit(scene.map, widest[2], widest[1], TRANSIENT)
    if before.stopped:
        return None
    return orbit(scene.map, float(before.x[-1]), int(before.side[-1]), count)


def stretch(scene: Scene, extents: Extents, throws: int = 12, most: int = 90) -> Orbit | None:
    """Cut whole rounds out of an orbit: from an arrival on its first side to a later one, `throws` of them or more.

    Parameters
    ----------
    scene : Scene
        The scene.
    extents : mapping
        Intervals of the attractor.
    throws : int
        Least number of throws.
    most : int
        Largest number, whether or not a round is complete then.

    Returns
    -------
    Orbit or None
        None where no orbit stays.
    """
    path = orbit_on(scene, extents, 6 * most)
    if path is None or path.code.size == 0:
        return None
    first = min(extents)
    arrivals = 1 + np.flatnonzero((path.side[1:] == first) & (path.side[:-1] != first))
    begin = int(arrivals[0]) if arrivals.size else 0
    later = arrivals[arrivals >= begin + throws]
    end = min(int(later[0]) if later.size else begin + throws, begin + most, path.code.size)
    return Orbit(path.x[begin : end + 1], path.side[begin : end + 1], path.code[begin:end], None)


def legend(figure: Figure, handles: Sequence[Any], columns: int) -> None:
    """Put a legend below all axes."""
    columns = min(columns, max(len(handles), 1))
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, fontsize=SMALL, frameon=False)


def title(figure: Figure, text: str) -> None:
    """Put a title above all axes."""
    figure.suptitle(text, fontsize=TEXT + 1.5)


def keep_apart(axes: Axes, share: float) -> None:
    """Take away names of critical points that would run into the name before: each is left of its point.

    Parameters
    ----------
    axes : Axes
        With its limits set; the names have the gid "name", and those of one row stand together, from left to right.
    share : float
        Room that a name takes, of the width of the axes.
    """
    lo, hi = axes.get_xlim()
    row, last = None, lo
    for text in [each for each in axes.texts if each.get_gid() == "name"]:
        x, y = text.xy  # type: ignore[attr-defined]  # of an annotation
        if y == row and x - last < share * (hi - lo):
            text.remove()
        else:
            row, last = y, x


def interval_text(parts: Sequence[tuple[float, float]], most: int = 2) -> str:
    """Intervals as text, one per line."""
    lines = [f"{lo:.2f} to {hi:.2f}" for lo, hi in parts[:most]]
    if len(parts) > most:
        lines[-1] = f"... {len(parts)} intervals"
    return "\n".join(lines)
