"""Basins: strips per side in one dimension, pictures of the plane in two."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Patch

from limitsets.arguments import arguments_checked
from limitsets.cells import CellSet, Grid
from limitsets.errors import AnswerError
from limitsets.maps import codes, kind_of
from limitsets.plot import style
from limitsets.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.typing import ColorType

    from limitsets.sets import Basins

# Lightness falls, so that neighbours differ in grey as well; hatches tell them apart in strips.
ATTRACTORS = ("#CFE5F5", "#F0B429", "#5FB59B", "#B5548A", "#3F4E96", "#2B2A1E")
HATCHES = ("", "///", "...", "\\\\\\", "xxx", "+++")
EDGE: dict[str, Any] = {"edgecolor": "#444444", "lw": 0.4}
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
        remedy = "draw a section of them yourself"
        raise AnswerError("the dimension of the basins", grid.dimension, "1 or 2", remedy)
    (name, unit), cells = _words(source), list[CellSet]()
    if grid.dimension == 1:
        figure = _strips(shares, [] if found is None else style.extents_of(found), unit)
    else:
        cells = [] if found is None else _cells_of(found)
        figure = _plane(shares, cells)
    style.title(figure, f"Basins{name}: where a start ends up")
    handles = _legend(shares)
    if (found is not None and grid.dimension == 1) or any(cells):
        shown = style.INK if grid.dimension == 1 else style.FLIP
        handles.append(Patch(facecolor=shown, label="the limit set itself"))
    style.legend(figure, handles, 3 if figure.get_figwidth() > 8.0 else 2)
    return figure


def _words(source: Any) -> tuple[str, str]:
    """Say whose basins they are, and the unit of x in brackets."""
    if isinstance(source, Scene):
        return f" of {source.name}", f" [{source.unit}]"
    if isinstance(source, Grid):
        return "", ""
    return f" of {kind_of(getattr(source, 'map', source)).name}", ""


def _cells_of(found: Any) -> list[CellSet]:
    """Read sets of cells off attractors, or one of them."""
    several = found if isinstance(found, Iterable) else [found]
    cells = [getattr(each, "cells", None) for each in several]
    known = [each for each in cells if isinstance(each, CellSet)]
    if len(known) < len(cells):
        raise AnswerError("what to draw", type(found).__name__, "attractors", "pass those of ls.attractors")
    return known


def _look(label: int) -> dict[str, Any]:
    number = label % len(ATTRACTORS)
    face, hatch = OUT[label][:2] if label < 0 else (ATTRACTORS[number], HATCHES[number])
    return {"facecolor": face, "hatch": hatch, **EDGE}


def _strips(shares: Basins, sets: list[style.Extents], unit: str) -> Figure:
    grid = shares.grid
    figure, (axes,) = style.canvas(9.0, 0.72 * grid.sides + 1.7)
    for side in range(grid.sides):
        edges, labels = grid.edges[side][0], shares.labels[grid.of_side(side)]
        if not labels.size:
            continue
        border = np.concatenate([[0], np.flatnonzero(np.diff(labels)) + 1, [labels.size]])
        for first, last in pairwise(border.tolist()):
            label, ends = int(labels[first]), (float(edges[first]), float(edges[last]))
            style.bar(axes, *ends, -side, 0.32, gid=f"label {label}", **_look(label))
        for extents in sets:
            for lo, hi in extents.get(side, ()):
                style.bar(axes, lo, hi, -side, 0.07, facecolor=style.INK, lw=0, zorder=3, gid="attractor")
    axes.set_yticks([-side for side in range(grid.sides)], [f"side {side}" for side in range(grid.sides)])
    axes.set_ylim(-grid.sides + 0.5, 0.5)
    lo, hi = float(grid.domain.lo.min()), float(grid.domain.hi.max())
    axes.set_xlim(lo - 0.01 * (hi - lo), hi + 0.01 * (hi - lo))
    axes.set_xlabel(f"x of the start{unit}")
    style.lanes(axes)
    return figure


def _plane(shares: Basins, attractors: list[CellSet]) -> Figure:
    grid = shares.grid
    figure, panels = style.canvas(4.6 * grid.sides + 0.6, 5.2, 1, grid.sides)
    kinds = sorted(set(shares.labels.tolist()))
    colours: list[ColorType] = [_look(kind)["facecolor"] for kind in kinds]
    number = np.searchsorted(kinds, shares.labels)
    norm = BoundaryNorm(np.arange(len(kinds) + 1) - 0.5, len(kinds))
    for side, axes in enumerate(panels):
        picture = number[grid.of_side(side)].reshape(tuple(grid.shape[side]))
        axes.pcolormesh(
            *grid.edges[side], picture.T, cmap=ListedColormap(colours), norm=norm, rasterized=True
        )
        for each in attractors:
            inside = each.mask[grid.of_side(side)].reshape(tuple(grid.shape[side]))
            axes.pcolormesh(
                *grid.edges[side], np.ma.masked_where(~inside, inside).T, cmap=ListedColormap([style.FLIP]),
                rasterized=True, gid="attractor",
            )  # fmt: skip
        axes.set_xlabel("$x_0$")
        axes.set_ylabel("$x_1$")
        if grid.sides > 1:
            axes.set_title(f"side {side}", fontsize=style.TEXT)
    return figure


def _legend(shares: Basins) -> list[Patch]:
    texts = {
        k: f"to limit set {k}: {_percent(share)} of all starts"
        for k, share in enumerate(shares.attractors[: len(ATTRACTORS)])
    }
    parts = {codes.UNDECIDED: shares.undecided_between}
    names = {name: code for code, name in codes.NAMES.items()}
    parts |= {names.get(name, codes.OUTSIDE): share for name, share in shares.exits.items()}
    present = set(shares.labels.tolist())
    for label, share in sorted(parts.items(), reverse=True):
        if label in present:
            way = (
                "leaves the domain" if label == codes.OUTSIDE and "outside" in shares.exits else OUT[label][2]
            )
            texts[label] = f"{way}: {_percent(share)}"
    plain = {} if shares.grid.dimension == 1 else {"hatch": ""}  # the picture of the plane has none
    return [Patch(label=text, **{**_look(label), **plain}) for label, text in texts.items()]


def _percent(share: float) -> str:
    """Round to a tenth, but never to all or nothing."""
    percent = 100 * share
    if percent >= 100 - 1e-9 or percent == 0:
        return f"{percent:.0f} %"
    return "> 99.9 %" if percent > 99.9 else "< 0.1 %" if percent < 0.1 else f"{percent:.1f} %"
