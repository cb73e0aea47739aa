"""Designs: limit sets and critical points along a path (Fig. 6 of the paper), and margin against throws to feed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

from limitsets.base import AnswerError, arguments_checked
from limitsets.face.plot import style
from limitsets.face.plot.style import Extents
from limitsets.feeder.scene import Scene
from limitsets.parameters.design import Design, RobustDesign, limit_sets_along
from limitsets.parameters.margins.margin_result import bound
from limitsets.systems.maps import critical_points

HALF = 0.3  # half the height of a bar; the distance of lanes is 1
MOST = 12  # scenes that are drawn at most: start, design, and evenly spaced steps between them
GAP = 0.9  # between the lanes of one scene and the next, in addition to 1
# The first critical point of a side, and others.
FIRST: dict[str, Any] = {"lw": 2.2, "gid": "critical point"}
FURTHER: dict[str, Any] = {"lw": 1.0, "ls": (0, (1, 1)), "gid": "further critical point"}
# A second attractor of the same scene.
ANOTHER: dict[str, Any] = {"facecolor": "white", "edgecolor": style.INK, "ls": ":"}


@arguments_checked
def design(found: Design, sets: Sequence[Sequence[Extents]] | None = None) -> Figure:
    """Draw the limit sets of the scenes on a design's path, one group of bars per scene, one bar row per side.

    Of more than twelve scenes, the start, the design and evenly spaced steps between them are drawn.

    Parameters
    ----------
    found : Design
        From `limitsets.design`; with `stages` its path moves the critical points evenly.
    sets : sequence, optional
        The answer of `limitsets.inverse.limit_sets_along`; computed if it is left out.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import limitsets as ls
    >>> vary = ["part.mass.center.along", "part.mass.center.above", "throw.speed"]
    >>> figure = ls.plot.design(ls.design("paper-initial", critical_points=[10, 10, 20], vary=vary, stages=2))
    >>> [label.get_text() for label in figure.axes[0].get_yticklabels()][:3]
    ['side 0', 'side 1', 'side 2']
    """
    if sets is None:
        sets = limit_sets_along(found)
    count, rows = len(found.start.sides), min(len(found.path), MOST)
    steps = np.linspace(0, len(found.path) - 1, rows).round().astype(int).tolist()
    drawn = [sets[step] for step in steps]
    deep = count + GAP
    figure, (axes,) = style.canvas(9.4, 0.27 * deep * rows + 1.75)
    names = {}
    for row, (step, attractors) in enumerate(zip(steps, drawn, strict=True)):
        scene, top = found.path[step], -deep * row
        for side, a in enumerate(scene.sides.a.tolist()):
            names[top - side] = f"side {side}"
            axes.plot([a, scene.arm_length], [top - side] * 2, color=style.FAINT, lw=0.6, zorder=1)
        for number, extents in enumerate(attractors):
            for side, parts in extents.items():
                look = {"lw": 0.8, "zorder": 2} | (ANOTHER if number else style.of_set(side))
                style.bars(axes, parts, top - side, HALF, gid="limit set", **look)
        _marks(axes, scene, top)
        _words(axes, found, scene, step, top - 0.5 * (count - 1))
    style.lanes(axes, names)
    _frame(axes, found, drawn, deep * rows)
    several = max((len(attractors) for attractors in drawn), default=1) > 1
    some = f"\n({rows} of {len(found.path)} scenes are drawn)" if rows < len(found.path) else ""
    words = f"{found.start.name}: limit sets while the critical points move{some}"
    handles = [
        *(Patch(label=f"limit set on side {k}", lw=0.8, **style.of_set(k)) for k in range(count)),
        Patch(label="another limit set", **ANOTHER) if several else None,
        style.key("first critical point", color=style.FLIP, marker="|", ms=10, mew=2.2, ls=""),
        style.key_of_goal(found.start),
    ]
    return style.finished(figure, words, handles, 5)


def _marks(axes: Axes, scene: Scene, top: float) -> None:
    """Mark every critical point; the design moves the first one of each side."""
    for side, points in critical_points(scene.bare_map, scene.domain).items():
        ends = [top - side - 0.43, top - side + 0.43]
        for number, point in enumerate(points):
            axes.plot([point.x] * 2, ends, color=style.FLIP, zorder=4, **(FURTHER if number else FIRST))


def _words(axes: Axes, solution: Design, scene: Scene, step: int, middle: float) -> None:
    """Write the values of its quantities beside each scene."""
    head = "start" if step == 0 else "design" if step == len(solution.path) - 1 else f"step {step}"
    values = []
    for name in solution.jacobian.names[:4]:
        if name.startswith("throw."):
            values.append(f"$\\kappa$ = {scene.kappa:.4g} {scene.unit}")
        else:
            unit = solution.quantities()[name][2]
            values.append(f"{name.split('.')[-1].replace('_', ' ')} = {scene.value(name):.4g} {unit}")
    how: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "va": "center", "gid": "words"}
    style.note(axes, "\n".join([head, *values]), (1.0, middle), (6, 0), fontsize=style.SMALL - 1.0, **how)


def _frame(axes: Axes, solution: Design, sets: Sequence[Sequence[Extents]], depth: float) -> None:
    ends = [x for row in sets for x in style.ends_of(row)]
    ends += [
        x
        for x in (*solution.before.x.tolist(), *solution.jacobian.x.tolist())
        if x <= solution.start.arm_length
    ]
    lo, hi = style.widened(min(ends, default=0.0), max(ends, default=solution.start.arm_length), 0.05)
    axes.set(xlim=(max(lo, 0.0), hi), ylim=(-depth + GAP + 0.1, 0.8))
    axes.set_xlabel(f"x of the centre of mass from the joint [{solution.start.unit}]")
    style.goal(axes, solution.start, zorder=3)


# ----------------------------------------------------------------
# A robust design: margin against throws to feed, and the share of the tolerance that each quantity takes.


BEFORE, AFTER = "#6E6E6E", style.JOG
# Bars of the scene before, which differ from those of the design also in grey.
PALE = "#D6D6D6"
# Quantities that are drawn at most.
MOST_ROWS = 12


@arguments_checked
def robust_design(found: RobustDesign, *, wanted: float | None = None, bound: float | None = None) -> Figure:
    """Draw the front of margin against throws to feed, and the cost of each quantity before and after.

    Parameters
    ----------
    found : RobustDesign
        From `limitsets.inverse.robust_design`.
    wanted : float, optional
        The wanted margin, as a factor on the tolerance; drawn as a line.
    bound : float, optional
        A margin that no design can have, as a factor on the tolerance; drawn as a line.

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
    return style.finished(figure, f"{found.before.name}: what the margin costs", handles)


def _front(axes: Axes, optimum: RobustDesign) -> list[Line2D]:
    margins = [option.candidate.estimate.margin for option in optimum.front]
    means = np.array([option.feeding.mean for option in optimum.front])
    late = np.array([option.feeding.quantile_95 for option in optimum.front])
    axes.vlines(margins, means, late, color=AFTER, lw=0.8, alpha=0.6)
    look: dict[str, Any] = {"color": AFTER, "marker": "o", "ms": 4.0, "lw": 0.8}
    axes.plot(margins, means, **look)
    handles = [style.key("designs that none beats, sampled", **look)]
    before = optimum.before_margins, optimum.before_sampled, optimum.before_feeding
    for margins_of, sampled, feeding, colour, marker, label in (
        (*before, BEFORE, "s", "the scene before"),
        (optimum.margins, optimum.sampled, optimum.feeding, style.FLIP, "D", "the design"),
    ):
        if sampled is None or feeding is None:
            continue
        axes.vlines(sampled.margin, feeding.mean, feeding.quantile_95, color=colour, lw=0.8, alpha=0.6)
        axes.plot(sampled.margin, feeding.mean, color=colour, marker=marker, ms=7.0, ls="none")
        for margin in margins_of:
            axes.plot([margin.proved, sampled.margin], [feeding.mean] * 2, color=colour, lw=2.0, alpha=0.4)
            label += f"\n{margin.goals[0].kind.replace('_', ' ')}: proved to {bound(margin.proved)}"
        handles.append(style.key(label, color=colour, marker=marker, ms=7.0, lw=2.5))
    axes.set(
        xlabel="joint margin, as a factor of the tolerance",
        ylabel="throws to feed from random starts",
        yscale="log",
    )
    axes.yaxis.set(
        major_locator=LogLocator(subs=(1.0, 2.0, 5.0)),
        major_formatter=ScalarFormatter(),
        minor_formatter=NullFormatter(),
    )
    axes.set_title("throws: mean, and 95 % at the end of each line", loc="left", fontsize=10)
    return handles


def _costs(axes: Axes, optimum: RobustDesign) -> None:
    """Draw how much of the room between threshold and reach one tolerance of each quantity takes."""
    names = list(optimum.sampled.effects)[:MOST_ROWS]
    rows = np.arange(len(names))
    for sampled, face, colour, shift, label in (
        (optimum.before_sampled, PALE, BEFORE, -0.19, "before"),
        (optimum.sampled, style.FLIP, style.FLIP, 0.19, "design"),
    ):
        if sampled is None or not sampled.effects:
            continue
        room = sampled.reach - sampled.threshold
        costs = [100.0 * sum(sampled.effects[name]) / room for name in names]
        axes.barh(rows + shift, costs, height=0.36, facecolor=face, edgecolor=colour, label=label)
    axes.set_yticks(rows, [name.removeprefix("part.mass.").removeprefix("part.") for name in names])
    axes.invert_yaxis()
    axes.set_xlabel("% of the room for X that one tolerance takes")
    axes.set_title("what limits it", loc="left", fontsize=10)
    axes.legend(loc="lower right", fontsize=9)
