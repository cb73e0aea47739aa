"""A robust design: margin against throws to feed, and the share of each quantity of the tolerance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

from limitsets.arguments import arguments_checked
from limitsets.errors import AnswerError
from limitsets.plot import style
from limitsets.robust.margins.margin_texts import bound

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    from limitsets.inverse import RobustDesign

BEFORE, AFTER = "#6E6E6E", style.JOG
# Bars of the scene before, apart from the design's also in grey.
PALE = "#D6D6D6"
# What is drawn of the quantities' names: the last word says which it is.
MOST_ROWS = 12


@arguments_checked
def robust_design(found: RobustDesign, *, wanted: float | None = None, bound: float | None = None) -> Figure:
    """Draw the front of margin against throws to feed, and the cost of each quantity before and after.

    Parameters
    ----------
    found : RobustDesign
        From `limitsets.inverse.robust_design`.
    wanted : float, optional
        A margin that was wanted, a factor on the tolerance, as a line.
    bound : float, optional
        A margin that no design can have, a factor on the tolerance, as a line.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    AnswerError
        There is no front to draw.
    """
    if not found.front:
        raise AnswerError("the front", "empty", "one design at least", "look at more designs")
    figure, (left, right) = style.canvas(11.5, 5.4, columns=2, width_ratios=[1.6, 1.0])
    handles = _front(left, found)
    for value, text, line in ((wanted, "wanted", "--"), (bound, "no part rests beyond", ":")):
        if value is not None:
            left.axvline(value, color=style.INK, ls=line, lw=1.0)
            how: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "ha": "right", "va": "top"}
            style.note(left, f"{text}\n{value:.2f}", (value, 0.98), (-4, 0), fontsize=9, **how)
    _costs(right, found)
    style.legend(figure, handles, 3)
    style.title(figure, f"{found.before.name}: what the margin costs")
    return figure


def _front(axes: Axes, found: RobustDesign) -> list[Line2D]:
    margins = [option.candidate.found.margin for option in found.front]
    means = np.array([option.feeding.mean for option in found.front])
    late = np.array([option.feeding.quantile_95 for option in found.front])
    axes.vlines(margins, means, late, color=AFTER, lw=0.8, alpha=0.6)
    look: dict[str, Any] = {"color": AFTER, "marker": "o", "ms": 4.0, "lw": 0.8}
    axes.plot(margins, means, **look)
    handles = [style.key("designs that none beats, sampled", **look)]
    points = [
        (found.before_margins, found.before_sampled, found.before_feeding, BEFORE, "s", "the scene before"),
        (found.margins, found.sampled, found.feeding, style.FLIP, "D", "the design"),
    ]
    for margins_of, sampled, feeding, colour, marker, label in points:
        if sampled is None or feeding is None:
            continue
        axes.vlines(sampled.margin, feeding.mean, feeding.quantile_95, color=colour, lw=0.8, alpha=0.6)
        axes.plot(sampled.margin, feeding.mean, color=colour, marker=marker, ms=7.0, ls="none")
        said = label
        for one in margins_of:
            axes.plot([one.proved, sampled.margin], [feeding.mean] * 2, color=colour, lw=2.0, alpha=0.4)
            said += f"\n{one.goals[0].kind.replace('_', ' ')}: proved to {bound(one.proved)}"
        handles.append(style.key(said, color=colour, marker=marker, ms=7.0, lw=2.5))
    axes.set_xlabel("joint margin, as a factor of the tolerance")
    axes.set_ylabel("throws to feed from random starts")
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(ScalarFormatter())
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_title("throws: mean, and 95 % at the end of each line", loc="left", fontsize=10)
    return handles


def _costs(axes: Axes, found: RobustDesign) -> None:
    """Draw how much of the room between threshold and reach one tolerance of each quantity takes."""
    names = list(found.sampled.effects)[:MOST_ROWS]
    rows = np.arange(len(names))
    for sampled, colour, shift, label in (
        (found.before_sampled, BEFORE, -0.19, "before"),
        (found.sampled, style.FLIP, 0.19, "design"),
    ):
        if sampled is None or not sampled.effects:
            continue
        room = sampled.reach - sampled.threshold
        costs = [100.0 * sum(sampled.effects[name]) / room for name in names]
        face = colour if colour != BEFORE else PALE
        axes.barh(rows + shift, costs, height=0.36, facecolor=face, edgecolor=colour, label=label)
    axes.set_yticks(rows, [name.removeprefix("part.mass.").removeprefix("part.") for name in names])
    axes.invert_yaxis()
    axes.set_xlabel("% of the room for X that one tolerance takes")
    axes.set_title("what limits it", loc="left", fontsize=10)
    axes.legend(loc="lower right", fontsize=9)
