"""A design as it moves: limit sets and critical points of the scenes on its path (Fig. 6 of the paper)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from limitsets.goals import OrientedBeyond
from limitsets.maps import critical_points
from limitsets.plot import style
from limitsets.plot.style import Extents

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.inverse import Design
    from limitsets.scene import Scene

__all__ = ["design"]

HALF = 0.3  # half the height of a bar; lanes are 1 apart
GAP = 0.9  # between the lanes of one scene and the next, beside the 1


def design(found: Design, sets: Sequence[Sequence[Extents]] | None = None) -> Figure:
    """Draw the limit sets of the scenes on a design's path, one group of bars per scene, one bar row per side.

    Parameters
    ----------
    found : Design
        From `limitsets.design`; with `stages` its path moves the critical points evenly.
    sets : sequence, optional
        What `limitsets.inverse.limit_sets_along` gave; computed otherwise.

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
        from limitsets.inverse import limit_sets_along

        sets = limit_sets_along(found)
    count, rows = len(found.start.sides), len(found.path)
    deep = count + GAP
    figure, (axes,) = style.canvas(9.4, 0.27 * deep * rows + 1.75)
    ticks = []
    for row, (scene, attractors) in enumerate(zip(found.path, sets, strict=True)):
        top = -deep * row
        ticks += [top - side for side in range(count)]
        _lanes(axes, scene, top)
        for number, extents in enumerate(attractors):
            _bars(axes, extents, number, top)
        _marks(axes, scene, top)
        _words(axes, found, scene, row, top - 0.5 * (count - 1))
    axes.set_yticks(
        ticks, [f"side {side}" for _ in range(rows) for side in range(count)], fontsize=style.SMALL
    )
    _frame(axes, found, sets, deep * rows)
    several = max((len(attractors) for attractors in sets), default=1) > 1
    style.title(figure, f"{found.start.name}: limit sets while the critical points move")
    style.legend(figure, _legend(found, count, several), 5)
    return figure


def _lanes(axes: Axes, scene: Scene, top: float) -> None:
    for side, a in enumerate(scene.sides.a.tolist()):
        axes.plot([a, scene.arm_length], [top - side] * 2, color=style.FAINT, lw=0.6, zorder=1)


def _bars(axes: Axes, extents: Extents, number: int, top: float) -> None:
    for side, parts in extents.items():
        face, hatch = style.SETS[side % len(style.SETS)]
        for lo, hi in parts:
            look: dict[str, Any] = {"facecolor": face, "hatch": hatch, "edgecolor": style.INK}
            if number:  # a second attractor of the same scene
                look = {"facecolor": "white", "edgecolor": style.INK, "ls": ":"}
            axes.add_patch(
                Rectangle(
                    (lo, top - side - HALF), hi - lo, 2 * HALF, lw=0.8, zorder=2, gid="limit set", **look
                )
            )


def _marks(axes: Axes, scene: Scene, top: float) -> None:
    """Mark every critical point; the first of a side is the one that is designed."""
    for side, points in critical_points(scene.bare_map, scene.domain).items():
        for number, point in enumerate(points):
            axes.plot(
                [point.x] * 2,
                [top - side - 0.43, top - side + 0.43],
                color=style.FLIP,
                lw=2.2 if number == 0 else 1.0,
                ls="-" if number == 0 else (0, (1, 1)),
                zorder=4,
                gid="critical point" if number == 0 else "further critical point",
            )


def _words(axes: Axes, found: Design, scene: Scene, row: int, middle: float) -> None:
    """Say beside each scene what its quantities are."""
    head = "start" if row == 0 else "design" if row == len(found.path) - 1 else f"step {row}"
    values = []
    for name in found.jacobian.names[:4]:
        if name.startswith("throw."):
            values.append(f"$\\kappa$ = {scene.kappa:.4g} {scene.unit}")
        else:
            unit = found.quantities()[name][2]
            values.append(f"{name.split('.')[-1].replace('_', ' ')} = {scene.value(name):.4g} {unit}")
    axes.annotate(
        "\n".join([head, *values]),
        (1.0, middle),
        xycoords=("axes fraction", "data"),
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
        fontsize=style.SMALL - 1.0,
        gid="words",
    )


def _frame(axes: Axes, found: Design, sets: Sequence[Sequence[Extents]], depth: float) -> None:
    ends = [x for row in sets for each in row for parts in each.values() for pair in parts for x in pair]
    ends += [x for x in (*found.before.x.tolist(), *found.jacobian.x.tolist()) if x <= found.start.arm_length]
    lo, hi = min(ends, default=0.0), max(ends, default=found.start.arm_length)
    room = 0.05 * (hi - lo)
    axes.set_xlim(max(lo - room, 0.0), hi + room)
    axes.set_ylim(-depth + GAP + 0.1, 0.8)
    axes.set_xlabel(f"x of the centre of mass from the joint [{found.start.unit}]")
    axes.tick_params(axis="y", length=0)
    for border in ("left", "right", "top"):
        axes.spines[border].set_visible(False)
    goal = found.start.goal
    if isinstance(goal, OrientedBeyond):
        axes.axvline(goal.x, color=style.GOAL, lw=1.3, ls=(0, (1, 1.5)), zorder=3, gid="goal")


def _legend(found: Design, count: int, several: bool) -> list[Any]:
    handles: list[Any] = []
    for side in range(count):
        face, hatch = style.SETS[side % len(style.SETS)]
        handles.append(
            Patch(facecolor=face, hatch=hatch, edgecolor=style.INK, lw=0.8, label=f"limit set on side {side}")
        )
    if several:
        handles.append(Patch(facecolor="white", edgecolor=style.INK, ls=":", label="another limit set"))
    handles.append(
        Line2D([], [], color=style.FLIP, marker="|", ms=10, mew=2.2, ls="", label="first critical point")
    )
    goal = found.start.goal
    if isinstance(goal, OrientedBeyond):
        label = f"goal: side {goal.side} beyond {goal.x:g} {found.start.unit}"
        handles.append(Line2D([], [], color=style.GOAL, lw=1.3, ls=(0, (1, 1.5)), label=label))
    return handles
