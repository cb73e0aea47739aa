"""A film as it was read: where the part rests in which frames, which throws follow, and which frames were left out."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from limitsets.base import arguments_checked
from limitsets.face.plot import style
from limitsets.parameters.fitting.filmed import FilmedThrows

THROWN: dict[str, Any] = {"color": style.INK, "lw": 0.9, "ls": (0, (3, 2))}
UNUSED: dict[str, Any] = {"color": style.FAINT, "lw": 5.0, "alpha": 0.6, "solid_capstyle": "butt"}
LEFT_OUT: dict[str, Any] = {"color": style.FLIP, "lw": 4.0, "solid_capstyle": "butt"}


@arguments_checked
def film_rests(film: FilmedThrows) -> Figure:
    """Draw where a filmed part rests in which frames.

    Parameters
    ----------
    film : FilmedThrows
        From `limitsets.fitting.throws_of_film`.

    Returns
    -------
    matplotlib.figure.Figure
        Place along the arm against frame: a bar for each rest with the number of its side, a line for each throw that
        is written, grey bars for rests that are in none; below, the frames that were left out.
    """
    unit, what = film.scene.unit, "x" if film.centre else "left corner"
    figure, (axes,) = style.canvas(9.6, 4.6)
    used = {id(rest) for one, two, _ in film.throws for rest in (one, two)}
    rests = [rest for rest in film.seen.rests if np.isfinite(rest.x)]
    for rest in rests:
        colour, _ = style.SETS[rest.side % len(style.SETS)]
        look = UNUSED if id(rest) not in used else UNUSED | {"color": colour, "alpha": 1.0}
        axes.plot(rest.frames[[0, -1]], [rest.x, rest.x], zorder=3, gid="rest", **look)
        middle = (float(rest.frames[[0, -1]].mean()), rest.x)
        style.note(axes, str(rest.side), middle, (0, 7), ha="center", zorder=4, gid="side")
    for one, two, _ in film.throws:
        axes.plot([one.frames[-1], two.frames[0]], [one.x, two.x], zorder=2, gid="throw", **THROWN)
    low = min((rest.x for rest in rests), default=0.0)
    high = max((rest.x for rest in rests), default=1.0)
    floor = low - 0.18 * max(high - low, 1e-9 * abs(high) or 1.0)
    for spans in film.left_out.values():
        for first, last in spans:
            axes.plot([first - 0.5, last + 0.5], [floor, floor], gid="left out", **LEFT_OUT)
    style.panel(axes, "", xlabel="frame")
    axes.set_ylabel(f"{what} along the arm [{unit}]")
    handles = [
        style.key("rest, with its side", **UNUSED | {"color": style.SETS[0][0], "alpha": 1.0}),
        style.key("throw", **THROWN),
        style.key("rest in no throw", **UNUSED) if len(used) < len(rests) else None,
        style.key("frames left out", **LEFT_OUT) if film.left_out else None,
    ]
    title = f"{film.scene.name}: {len(film.throws)} throws in {film.frames} frames"
    return style.finished(figure, title, handles)
