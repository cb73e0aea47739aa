"""An audit as strips along the arm: places where each assumption of the model holds or breaks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from matplotlib.patches import Patch

from limitsets.arguments import arguments_checked
from limitsets.plot import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.auditing import Audit, Finding

HALF = 0.36  # half the height of a strip; strips are 1 apart
HOLDS: dict[str, Any] = {"facecolor": "#E4EEF5", "edgecolor": "none"}
BROKEN: dict[str, Any] = {"facecolor": "#E39B72", "edgecolor": "#8A2F00", "hatch": "////", "lw": 0.6}
UNKNOWN: dict[str, Any] = {"facecolor": "#F1F1F1", "edgecolor": "#B5B5B5", "hatch": "...", "lw": 0.0}


@arguments_checked
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
    count, size = len(scene.sides), (3.1, 0.29 * len(rows) + 0.75)
    below = f"x before the throw [{scene.unit}]"
    figure, panels = style.panels(count, min(count, 3), size, (1.9, 1.15), below)
    for side, axes in enumerate(panels):
        for row, finding in enumerate(rows):
            _strip(axes, found, finding, side, row)
        for lo, hi in found.extents.get(side, ()):
            axes.axvspan(lo, hi, facecolor="none", edgecolor=style.JOG, lw=1.4, zorder=3, gid="limit set")
        axes.set_title(f"on side {side}", loc="left", fontsize=style.TEXT)
        axes.set_xlim(0.0, scene.arm_length)
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.set_yticks(range(len(rows)), [finding.about.name for finding in rows], fontsize=style.SMALL)
        style.lanes(axes)
    style.title(figure, f"{scene.name}: what the minimal model assumes, and where that breaks")
    style.legend(figure, _legend(found, rows), 4)
    return figure


def _strip(axes: Axes, found: Audit, finding: Finding, side: int, row: int) -> None:
    first, last = float(found.scene.sides.a[side]), found.scene.arm_length
    gid, look = ("cannot tell", UNKNOWN) if finding.missing else ("holds", HOLDS)
    style.bar(axes, first, last, row, HALF, gid=gid, zorder=2, **look)
    for lo, hi in finding.ranges.get(side, ()):
        style.bar(axes, lo, hi, row, HALF, gid="broken", zorder=2, **BROKEN)


def _legend(found: Audit, rows: tuple[Finding, ...]) -> list[Any]:
    handles: list[Any] = [Patch(label="holds", **HOLDS), Patch(label="breaks", **BROKEN)]
    if any(finding.missing for finding in rows):
        handles.append(Patch(label="cannot tell: a fact is missing", **UNKNOWN))
    if found.extents:
        handles.append(style.key("between these lines: the limit set", color=style.JOG, lw=1.4))
    return handles
