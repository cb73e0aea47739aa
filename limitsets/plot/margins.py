"""Margins: a bar per quantity, curves over X, and the box of a joint margin; proved and refuted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Patch

from limitsets.arguments import arguments_checked
from limitsets.errors import AnswerError
from limitsets.plot import style
from limitsets.robust.margins.margin_texts import bound
from limitsets.scene.quantities import parsed_deviation

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.robust.margins.beyond import MarginsBeyond
    from limitsets.robust.margins.margin_result import Margin

SAFE: dict[str, Any] = {"facecolor": "#9BD1B8", "edgecolor": "#2F6B52", "lw": 0.7}
OPEN: dict[str, Any] = {"facecolor": "#F4F4F4", "edgecolor": "#9A9A9A", "hatch": "....", "lw": 0.6}
BOX: dict[str, Any] = {"facecolor": "none", "edgecolor": style.FLIP, "ls": (0, (4, 2)), "lw": 1.2}
FAILS: dict[str, Any] = {"color": style.FLIP, "marker": "D", "ms": 5.0, "ls": "none"}
READINGS = {"fixed": "", "per-throw": ", every throw"}
# Where the two columns of numbers end, to the right of the axes [points].
COLUMNS = (66, 138)


def _percent(margin: Margin, size: float) -> tuple[float, str]:
    """Give a size as percent, and of what."""
    if margin.unit == "%":
        return size, ""
    nominal = margin.nominal
    if nominal:
        return 100.0 * size / abs(nominal), ""
    from limitsets.scene.units import exact_factor

    least = float(margin.scene.sides.length.min())
    return 100.0 * size * float(
        exact_factor(margin.unit, margin.scene.unit)
    ) / least, " (of the shortest side)"


@arguments_checked
def tornado(margins: Sequence[Margin]) -> Figure:
    """Draw the margins of single quantities, the smallest on top, as percent of the value; beside them the numbers.

    Parameters
    ----------
    margins : sequence of Margin
        From `limitsets.margin`; joint ones are left out.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import limitsets as ls
    >>> figure = ls.plot.tornado(ls.margin("paper-designed", "throw.speed", "arm.surface_height", width=0.1))
    >>> [label.get_text() for label in figure.axes[0].get_yticklabels()]
    ['throw.speed', 'arm.surface_height']
    """
    single = [each for each in margins if each.quantity != "joint"]
    single.sort(key=lambda each: _percent(each, each.proved)[0])
    figure, (axes,) = style.canvas(8.4, 0.36 * max(len(single), 2) + 1.8)
    known = [_percent(each, size)[0] for each in single for size in (each.proved, each.refuted) if size]
    low, high = (min(known) / 3.0, max(known) * 1.6) if known else (0.1, 100.0)
    for row, each in enumerate(single):
        _bar(axes, each, row, low, high)
    for at, words in zip(COLUMNS, ("safe up to", "fails from"), strict=True):
        _beside(axes, at, -0.75, words)
    names = [each.quantity + READINGS[each.reading] for each in single]
    names = [name + _percent(each, 0.0)[1] for name, each in zip(names, single, strict=True)]
    axes.set_yticks(range(len(single)), names, fontsize=style.SMALL)
    axes.set_ylim(len(single) - 0.4, -0.6)
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.set_xlabel("deviation to either side [% of the value], logarithmic")
    style.lanes(axes)
    name = single[0].scene.name if single else "margins"
    style.title(figure, f"{name}: how much each quantity may deviate")
    handles = [Patch(label="proved safe", **SAFE), style.key("shown to fail from here", **FAILS)]
    if any(each.refuted is None or not each.closed for each in single):
        handles.append(Patch(label="nothing is shown", **OPEN))
    style.legend(figure, handles, 3)
    return figure


def _bar(axes: Axes, margin: Margin, row: int, low: float, high: float) -> None:
    """Draw one margin; where no upper end is known nothing is shown up to the end of the axis."""
    proved = max(_percent(margin, margin.proved)[0], low)
    end = high if margin.refuted is None else max(_percent(margin, margin.refuted)[0], low)
    axes.barh(row, end - proved, left=proved, height=0.62, gid="open", zorder=1, **OPEN)
    axes.barh(row, proved - low, left=low, height=0.62, gid="proved", zorder=2, **SAFE)
    if margin.refuted is not None:
        axes.plot([end], [row], gid="refuted", zorder=3, **FAILS)
    for at, size, up in zip(COLUMNS, (margin.proved, margin.refuted), (False, True), strict=True):
        _beside(axes, at, row, bound(size, margin.unit, up=up))


def _beside(axes: Axes, at: int, row: float, words: str) -> None:
    """Write into a column to the right of the axes."""
    how: dict[str, Any] = {"ha": "right", "va": "center", "annotation_clip": False, "gid": "number"}
    style.note(axes, words, (1.0, row), (at, 0), xycoords=("axes fraction", "data"), **how)


@arguments_checked
def margin_curve(found: MarginsBeyond) -> Figure:
    """Draw margins against X: between the lines lies the sharp one.

    Parameters
    ----------
    found : MarginsBeyond
        From `limitsets.robust.margins.beyond.margins_beyond`.

    Returns
    -------
    matplotlib.figure.Figure
        One panel per quantity.
    """
    figure, panels = style.canvas(6.4, 2.5 * len(found.names) + 0.9, len(found.names), 1, sharex=True)
    for k, (axes, name, unit) in enumerate(zip(panels, found.names, found.units, strict=True)):
        proved, refuted = found.proved[:, k], found.refuted[:, k]
        axes.fill_between(found.x, 0.0, proved, color="#CFE8DC", gid="proved", zorder=1)
        axes.plot(found.x, proved, "o-", color="#2F6B52", ms=3.5, lw=1.3, label="proved safe", zorder=3)
        axes.plot(found.x, refuted, "D--", color=style.FLIP, ms=3.5, lw=1.1, label="shown to fail", zorder=2)
        best, top = found.best(name)
        axes.axvline(best, color=style.FAINT, lw=0.9, ls=":")
        style.note(axes, f"best: X = {best:.4g} {found.scene.unit}", (best, 0.0), (5, 6))
        axes.set_ylabel(f"{name} [{unit or 'times the tolerance'}]", fontsize=style.SMALL)
        axes.set_ylim(0.0, 1.12 * max(float(np.nanmax([*refuted, top])), 1e-12))
        style.open_frame(axes)
    panels[-1].set_xlabel(f"X, beyond which only side {found.side} [{found.scene.unit}]")
    panels[0].legend(fontsize=style.SMALL, frameon=False, loc="upper right")
    style.title(figure, f"{found.scene.name}: margins against X")
    return figure


@arguments_checked
def tolerance_box(margin: Margin) -> Figure:
    """Draw a joint margin: what each quantity may do together with all others, proved and refuted.

    Parameters
    ----------
    margin : Margin
        Of "joint".

    Returns
    -------
    matplotlib.figure.Figure
        A bar for each quantity, as far as it is proved, in the box that is refuted.

    Raises
    ------
    AnswerError
        For a margin of one quantity.
    """
    if margin.quantity != "joint":
        raise AnswerError("the margin", margin.quantity, "a joint one", "draw others with plot.tornado")
    texts = {**margin.tolerance}
    figure, (axes,) = style.canvas(6.8, 0.4 * len(texts) + 1.6)
    for row, (name, text) in enumerate(texts.items()):
        given = parsed_deviation(text, name)
        size, unit = float(given.number), given.unit
        axes.barh(row, 2 * margin.proved, left=-margin.proved, height=0.6, gid="proved", zorder=2, **SAFE)
        words = f"± {bound(margin.proved * size, unit)}" + (", every throw" if name == "landing.x" else "")
        axes.annotate(words, (0, row), ha="center", va="center", fontsize=style.SMALL, zorder=4)
    axes.set_yticks(range(len(texts)), list(texts), fontsize=style.SMALL)
    axes.set_ylim(len(texts) - 0.3, -0.7)
    wide = 1.1 * max(margin.proved, margin.refuted or 0.0, 1e-9)
    axes.set_xlim(-wide, wide)
    axes.set_xlabel("deviation as a factor of the tolerance")
    style.lanes(axes)
    style.title(figure, f"{margin.scene.name}: all quantities together")
    handles = [Patch(label="proved safe, all at once", **SAFE)]
    if margin.refuted is not None:
        high, middle = margin.refuted, 0.5 * (len(texts) - 1)
        axes.barh(middle, 2 * high, left=-high, height=len(texts), gid="refuted", zorder=1, **BOX)
        handles.append(Patch(label="somewhere in this larger box it fails", **BOX))
    style.legend(figure, handles, 2)
    return figure
