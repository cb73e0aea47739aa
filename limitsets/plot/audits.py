"""An audit as strips: along the arm, where each assumption of the model holds and where it breaks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from limitsets.plot import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.auditing import Audit, Finding

__all__ = ["audit"]

HALF = 0.36  # half the height of a strip; strips are 1 apart
HOLDS: dict[str, Any] = {"facecolor": "#E4EEF5", "edgecolor": "none"}
BROKEN: dict[str, Any] = {"facecolor": "#E39B72", "edgecolor": "#8A2F00", "hatch": "////", "lw": 0.6}
UNKNOWN: dict[str, Any] = {"facecolor": "#F1F1F1", "edgecolor": "#B5B5B5", "hatch": "...", "lw": 0.0}


def audit(found: Audit) -> Figure:
    """Draw where along the arm each assumption of the minimal model holds, and where the limit set lies.

    Parameters
    ----------
    found : Audit
        From `limitsets.audit`.

    Returns
    -------
    matplotlib.figure.Figure
        One panel per side, one strip per assumption.

    Examples
    --------
    >>> import limitsets as ls
    >>> figure = ls.plot.audit(ls.audit("paper-designed"))
    >>> [axes.get_title(loc="left") for axes in figure.axes]
    ['on side 0', 'on side 1', 'on side 2']
    """
    scene, rows = found.scene, found.on("domain")
    count = len(scene.sides)
    columns = min(count, 3)
    lines = math.ceil(count / columns)
    figure, panels = style.canvas(
        3.1 * columns + 1.9,
        (0.29 * len(rows) + 0.75) * lines + 1.15,
        lines,
        columns,
        sharex=True,
        sharey=True,
    )
    for side, axes in enumerate(panels[:count]):
        for row, finding in enumerate(rows):
            _strip(axes, found, finding, side, row)
        _limit_set(axes, found, side, len(rows))
        axes.set_title(f"on side {side}", loc="left", fontsize=style.TEXT)
        axes.set_xlim(0.0, scene.arm_length)
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.set_yticks(range(len(rows)), [finding.about.name for finding in rows], fontsize=style.SMALL)
        axes.tick_params(axis="y", length=0)
        for border in ("top", "right", "left"):
            axes.spines[border].set_visible(False)
        if side + columns >= count:
            axes.set_xlabel(f"x before the throw [{scene.unit}]")
            axes.xaxis.set_tick_params(labelbottom=True)
    for axes in panels[count:]:
        axes.set_axis_off()
    style.title(figure, f"{scene.name}: what the minimal model assumes, and where that breaks")
    style.legend(figure, _legend(found, rows), 4)
    return figure


def _bar(axes: Axes, lo: float, hi: float, row: int, look: dict[str, Any], gid: str) -> None:
    axes.add_patch(Rectangle((lo, row - HALF), hi - lo, 2 * HALF, gid=gid, zorder=2, **look))


def _strip(axes: Axes, found: Audit, finding: Finding, side: int, row: int) -> None:
    first, last = float(found.scene.sides.a[side]), found.scene.arm_length
    unknown = bool(finding.missing)
    _bar(axes, first, last, row, UNKNOWN if unknown else HOLDS, "cannot tell" if unknown else "holds")
    for lo, hi in finding.ranges.get(side, ()):
        _bar(axes, lo, hi, row, BROKEN, "broken")


def _limit_set(axes: Axes, found: Audit, side: int, rows: int) -> None:
    for lo, hi in found.extents.get(side, ()):
        axes.axvspan(lo, hi, facecolor="none", edgecolor=style.JOG, lw=1.4, zorder=3, gid="limit set")


def _legend(found: Audit, rows: tuple[Finding, ...]) -> list[Any]:
    handles: list[Any] = [Patch(label="holds", **HOLDS), Patch(label="breaks", **BROKEN)]
    if any(finding.missing for finding in rows):
        handles.append(Patch(label="cannot tell: a fact is missing", **UNKNOWN))
    if found.extents:
        handles.append(Line2D([], [], color=style.JOG, lw=1.4, label="between these lines: the limit set"))
    return handles
