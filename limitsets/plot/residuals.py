"""Figure of a fit: what is left of the landings, side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.arguments import arguments_checked
from limitsets.plot import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from limitsets.fitting import Fit

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
        axes.set_title(f"side {side}: {int(own.sum())} throws", loc="left", fontsize=style.TEXT)
        axes.set_xlabel(
            f"{'left corner' if rows.throws.corner else 'x'} before [{unit}]", fontsize=style.SMALL
        )
        axes.tick_params(labelsize=style.SMALL)
        style.open_frame(axes)
    panels[0].set_ylabel(f"landing, measured less predicted [{unit}]", fontsize=style.SMALL)
    style.title(figure, f"{found.scene.name}: residuals of {len(rows.throws)} throws")
    keys = [style.key(word, ls="", marker=marker, color=colour, ms=4.5) for _, marker, colour, word in KINDS]
    keys.append(style.key("two standard deviations", color=BARS, lw=1.4))
    if misread.any():
        keys.append(style.key("side recorded wrong", ls="", marker="s", mfc="none", mec=style.INK, ms=8.0))
    if strange.any():
        keys.append(style.key("far off", ls="", marker="x", mec=style.INK, ms=7.0))
    style.legend(figure, keys, 5)
    return figure
