"""Figures of noise: density of the places of rest, number of throws, level of the noise; and the residuals of a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from limitsets.base import AnswerError, arguments_checked
from limitsets.base.arrays import Array
from limitsets.face.plot import style
from limitsets.parameters.fitting import Fit
from limitsets.parameters.noise.sampling import SampledStatistics
from limitsets.parameters.noise.statistics import Levels, NoiseStatistics

BAR = "#C9DCEA"
LINES = ("-", (0, (5, 2)), (0, (1.2, 1.6)), (0, (6, 1.5, 1.2, 1.5)))
COLOURS = (style.JOG, style.FLIP, style.ROLL, style.GOAL)
# Smaller shares are not drawn: a mark on the axis stands for them.
LEAST = 1e-6
# Names of numbers in a legend, and labels of their axes.
WORDS = {
    "wrong beyond": "of the rests beyond X",
    "first beyond is wrong": "of the first rests beyond X",
    "mean throws": "mean",
    "95 % throws": "until 95 % of the starts are there",
    "escape": "from the limit set, per throw",
    "lost": "of the starts, before they are there",
}


@arguments_checked
def noise_density(found: NoiseStatistics, thrown: SampledStatistics | None = None) -> Figure:
    """Draw the density of the places of rest, one panel per side, and for comparison the shares of many throws.

    Parameters
    ----------
    found : NoiseStatistics
        From `limitsets.robust.noise_statistics`.
    thrown : SampledStatistics, optional
        From `limitsets.parameters.noise.sampling.throw_many`.

    Returns
    -------
    matplotlib.figure.Figure
        One panel per side.

    Raises
    ------
    AnswerError
        Every part leaves: there is no density.
    """
    if not found.classes:
        raise AnswerError(
            "the classes of the noisy scene", "none", "one at least", "nothing stays: nothing to draw"
        )
    part = max(found.classes, key=lambda noisy: len(noisy.cells))
    sides = sorted(part.sides)
    figure, panels = style.canvas(3.5 * min(len(sides), 4) + 0.6, 3.4, 1, len(sides), sharey=True)
    for side, axes in zip(sides, panels, strict=True):
        (edges,) = found.grid.edges[side]
        height = part.density[found.grid.of_side(side)]
        if thrown is not None:
            label = f"{thrown.throws:.0e} throws".replace("e+0", "e")
            axes.stairs(thrown.density[side], thrown.bins[side], fill=True, color=BAR, label=label)
        axes.stairs(height, edges, color=style.INK, lw=1.0, label="transfer operator")
        some = np.flatnonzero(height > LEAST)
        if some.size:
            axes.set_xlim(*style.widened(float(edges[some[0]]), float(edges[some[-1] + 1]), 0.04))
        label = f"X = {found.goal[0]:g} {found.unit}"
        axes.axvline(found.goal[0], color=style.GOAL, lw=1.0, ls=(0, (4, 2)), label=label)
        words = f"side {side}: {100 * part.sides[side]:.2f} % of the rests"
        style.panel(axes, words, small_ticks=True, xlabel=f"x [{found.unit}]")
        axes.xaxis.set_major_locator(MaxNLocator(5))
    panels[0].set_ylabel(f"share of the rests per {found.unit}")
    words = f"{found.scene}: where the part rests under noise"
    return style.finished(figure, words, panels[-1].get_legend_handles_labels()[0])


@arguments_checked
def noise_arrivals(found: NoiseStatistics, thrown: SampledStatistics | None = None) -> Figure:
    """Draw the number of throws from random starts to the goal: the shares that arrive, and that have not arrived.

    Parameters
    ----------
    found : NoiseStatistics
        From `limitsets.robust.noise_statistics`.
    thrown : SampledStatistics, optional
        From `limitsets.parameters.noise.sampling.throw_many`.

    Returns
    -------
    matplotlib.figure.Figure
        Left the share that arrives with each throw, right the share that has not arrived.
    """
    fed = found.feeding
    last = (fed.quantile(0.999) or fed.arrived.size - 1) + 2
    number = np.arange(min(last, fed.arrived.size))
    figure, (left, right) = style.canvas(9.6, 3.7, 1, 2)
    if thrown is not None and thrown.arrived.size:
        counted = np.bincount(thrown.arrived, minlength=number.size) / thrown.parts
        left.bar(number, counted[: number.size], width=1.0, color=BAR, label=f"{thrown.parts} parts thrown")
        still = 1.0 - np.cumsum(counted)
        right.step(number, still[: number.size], where="post", color="#7FA9C4", lw=3.0)
    look: dict[str, Any] = {"color": style.INK, "lw": 1.0}
    edges = np.arange(number.size + 1) - 0.5
    left.stairs(fed.arrived[: number.size], edges, label="transfer operator", **look)
    right.step(number, fed.survivors[: number.size], where="post", **look)
    for axes, words in (
        (left, "share that arrives with this throw"),
        (right, "share that has not yet arrived"),
    ):
        _marks(axes, found)
        style.panel(axes, small_ticks=True, xlabel="throws", ylabel=words)
    right.set(yscale="log", ylim=(5e-4, 1.2))
    x, side = found.goal
    words = f"{found.scene}: throws from random starts to x > {x:g} {found.unit} on side {side}"
    return style.finished(figure, words, left.get_legend_handles_labels()[0], 4)


def _marks(axes: Axes, statistics: NoiseStatistics) -> None:
    mean, most = statistics.feeding.mean, statistics.feeding.quantile(0.95)
    if mean is not None:
        axes.axvline(mean, color=style.FLIP, lw=1.2, label=f"mean {mean:.1f}")
    if most is not None:
        axes.axvline(most, color=style.GOAL, lw=1.2, ls=(0, (4, 2)), label=f"95 % after {most}")


@arguments_checked
def noise_levels(
    levels: Levels, at: Mapping[str, float], shown: Mapping[str, Sequence[str]] | None = None
) -> Figure:
    """Draw numbers against the level of the noise.

    Parameters
    ----------
    levels : Levels
        From `limitsets.robust.noise_levels`.
    at : mapping of str to float
        One entry: the label of the axis, and its value at a factor of 1: ``{"speed noise [%]": 0.5}``.
    shown : mapping of str to sequence of str, optional
        Titles of the panels, each with the numbers in it.

    Returns
    -------
    matplotlib.figure.Figure
        A panel each for what is wrongly oriented, the throws to the goal and what leaves; where shares are below 1e-6
        there is an open mark on the axis.
    """
    (word, unit), *_ = at.items()
    panels_of = shown or {
        "on a wrong side": ("wrong beyond", "first beyond is wrong"),
        "throws to the goal": ("mean throws", "95 % throws"),
        "leave the arm": ("escape", "lost"),
    }
    figure, panels = style.canvas(3.6 * len(panels_of) + 0.4, 4.0, 1, len(panels_of))
    for axes, (title, names) in zip(panels, panels_of.items(), strict=True):
        _against_level(axes, levels, names, unit)
        measure = ("throws" if "throws" in title else "share") if axes.lines else ""
        limits = style.widened(0.0, float(levels.factors.max()) * unit, 0.04)
        style.panel(axes, title, small_ticks=True, xlabel=word, xlim=limits, ylabel=measure)
        if measure == "throws":
            axes.set_ylim(bottom=0.0)
        elif measure:
            axes.set_yscale("log")
            # at least a decade, or rounding would look like a change
            low, high = axes.get_ylim()
            axes.set_ylim(min(low, high / 30.0), 1.3 * high)
        else:
            axes.text(0.5, 0.5, "none", transform=axes.transAxes, ha="center", color=style.FAINT)
            axes.set_yticks([])
        if measure:
            axes.legend(fontsize=style.SMALL, frameon=False, loc="upper left", bbox_to_anchor=(0.0, -0.16))
    return figure


def _against_level(axes: Axes, levels: Levels, names: Sequence[str], unit: float) -> None:
    """Draw the numbers of one panel; shares that are too small are marks on the axis."""
    x, none = levels.factors * unit, np.zeros(levels.factors.size, dtype=bool)
    for name, colour, line in zip(names, COLOURS, LINES, strict=False):
        values: Array = levels.numbers.get(name, np.full(x.size, np.nan))
        some = values > LEAST
        if not some.any():
            continue
        none |= values <= LEAST
        label = WORDS.get(name, name)
        axes.plot(x[some], values[some], color=colour, ls=line, marker="o", ms=3.5, lw=1.4, label=label)
    if none.any():
        on_axis: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "clip_on": False, "zorder": 3}
        look: dict[str, Any] = {"marker": "v", "s": 18, "facecolors": "white", "edgecolors": style.FAINT}
        axes.scatter(x[none], np.zeros(int(none.sum())), label=f"below {LEAST:g}", **look, **on_axis)


# ----------------------------------------------------------------
# Figure of a fit: the residuals of the landings, one panel per side.


BARS = "#B5C8D6"
KINDS = ((0, "o", style.JOG, "jog"), (1, "^", style.FLIP, "flip"))


@arguments_checked
def fit_residuals(found: Fit) -> Figure:
    """Draw measured less predicted landings against the place before, with two standard deviations.

    Parameters
    ----------
    found : Fit
        From `limitsets.fit`.

    Returns
    -------
    matplotlib.figure.Figure
        One panel per side that throws began on; jogs are circles, flips triangles, throws with a side recorded wrong
        have a square around them, and crosses are those that are far off.
    """
    rows, unit = found.rows, found.scene.unit
    x = rows.throws.x_before
    sides = sorted({int(side) for side in rows.side})
    misread = np.isin(rows.throws.row, [row for row, *_ in found.misread])
    strange = np.isin(rows.throws.row, found.misfit.strange)
    width = min(3.4 * len(sides) + 0.8, 12.0)
    before = f"{'left corner' if rows.throws.corner else 'x'} before [{unit}]"
    figure, panels = style.canvas(width, 3.6, 1, len(sides), sharex=True, sharey=True)
    for side, axes in zip(sides, panels, strict=True):
        own = rows.side == side
        size = 2.0 * found.deviations[own]
        axes.errorbar(x[own], np.zeros(size.size), size, fmt="none", ecolor=BARS, lw=1.4, zorder=1)
        axes.axhline(0.0, color=style.FAINT, lw=0.8, zorder=1)
        for branch, marker, colour, _ in KINDS:
            here = own & (rows.branch == branch)
            axes.plot(x[here], found.residuals[here], ls="", marker=marker, color=colour, ms=4.5, zorder=3)
        for some, marker, size in ((own & misread, "s", 10.0), (own & strange, "x", 9.0)):
            look: dict[str, Any] = {"mfc": "none", "mec": style.INK, "mew": 1.1}
            axes.plot(x[some], found.residuals[some], ls="", marker=marker, ms=size, zorder=4, **look)
        style.panel(axes, f"side {side}: {int(own.sum())} throws", small_ticks=True, xlabel=before)
    panels[0].set_ylabel(f"landing, measured less predicted [{unit}]")
    keys = [
        *(style.key(word, ls="", marker=marker, color=colour, ms=4.5) for _, marker, colour, word in KINDS),
        style.key("two standard deviations", color=BARS, lw=1.4),
        style.key("side recorded wrong", ls="", marker="s", mfc="none", mec=style.INK, ms=8.0)
        if misread.any()
        else None,
        style.key("far off", ls="", marker="x", mec=style.INK, ms=7.0) if strange.any() else None,
    ]
    return style.finished(figure, f"{found.scene.name}: residuals of {len(rows.throws)} throws", keys, 5)
