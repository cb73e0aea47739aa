"""Surfaces of an atlas: one of its numbers as colours, or as a line where one quantity varies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from matplotlib.patches import Patch

from limitsets.arguments import arguments_checked
from limitsets.errors import AnswerError
from limitsets.plot import style
from limitsets.plot.atlas_frame import frame, hatched, mark, pixels, title_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.sweep import Atlas

Array = npt.NDArray[np.float64]

# Even to the eye, in grey and for colour-blind readers.
COLOURS = "cividis"
# Percentiles between which colours are spread: a few values far off do not take them all.
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
    handles = _painted(figure, axes, found, values, words, level) if values.ndim == 2 else []
    if values.ndim == 1:
        handles = _lined(axes, found, values, words, level)
    handles += mark(axes, found) if values.ndim == 2 else []
    if handles:
        style.legend(figure, handles, 3)
    axes.set_title(f"{title_of(found)}: {words.partition(' [')[0]}", loc="left", fontsize=style.TEXT + 1)
    return figure


def _values(found: Atlas, variable: str, side: int | None) -> Array:
    """Read the variable at every point; nan where there is none."""
    data = found.dataset
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
    if values.ndim != len(found.axes):
        raise AnswerError("the variable to draw", variable, "one number at each point", "name another")
    return values


def _level(found: Atlas, variable: str) -> tuple[float, str] | None:
    if variable == "lyapunov":
        return 0.0, "0"
    plan = found.dataset.attrs["plan"]
    if variable != "threshold" or "scene" not in plan:
        return None
    from limitsets.scene import load

    goal = load(found.dataset.attrs["scene"]).goal
    x = getattr(goal, "x", None)
    return None if x is None else (float(x), f"x of the goal, {x:g}")


def _painted(
    figure: Figure, axes: Axes, found: Atlas, values: Array, words: str, level: tuple[float, str] | None
) -> list[object]:
    """Paint a surface of two quantities, with its scale; the entries of a legend."""
    x, y = pixels(found)
    there = np.isfinite(values)
    axes.set_facecolor(NOTHING)
    hatched(axes, x, y, ~there, NOTHING_HATCH)
    handles: list[object] = []
    if there.any():
        low, high = np.percentile(values[there], SPREAD)
        image = axes.pcolorfast(
            x, y, np.ma.masked_invalid(values), cmap=COLOURS, vmin=low, vmax=high, zorder=1
        )
        cut = (bool((values[there] < low).any()), bool((values[there] > high).any()))
        extend = {(True, True): "both", (True, False): "min", (False, True): "max"}.get(cut, "neither")
        figure.colorbar(image, ax=axes, label=words, extend=extend, pad=0.02)
        if level is not None and values[there].min() < level[0] < values[there].max():
            xs, ys = (found.dataset[name].values for name in reversed(found.axes))
            axes.contour(
                xs, ys, np.ma.masked_invalid(values), [level[0]], colors="white", linewidths=2.4, zorder=3
            )
            line = axes.contour(
                xs, ys, np.ma.masked_invalid(values), [level[0]], colors=style.INK, linewidths=1.1, zorder=4
            )
            line.set_gid("level")
            handles.append(style.key(level[1], color=style.INK, lw=0.9))
    if not there.all():
        handles.append(
            Patch(label="none, or undecided", fc=NOTHING, ec=style.INK, hatch=NOTHING_HATCH, lw=0.5)
        )
    return handles


def _lined(
    axes: Axes, found: Atlas, values: Array, words: str, level: tuple[float, str] | None
) -> list[object]:
    """Draw a line against one quantity."""
    x = found.dataset[found.axes[0]].values
    axes.plot(x, values, color=style.JOG, lw=1.1, marker="." if x.size < 60 else "", gid="values")
    axes.autoscale(axis="y")
    axes.set_ylabel(words)
    if level is None:
        return []
    axes.axhline(level[0], color=style.INK, lw=0.9, ls="--", gid="level")
    return [style.key(level[1], color=style.INK, lw=0.9, ls="--")]
