"""Landings with effects against those without, along the arm."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from limitsets.base import AnswerError, arguments_checked
from limitsets.face.plot import style
from limitsets.parameters.discrepancy import Discrepancy
from limitsets.parameters.discrepancy.measuring import along_arm

CHANGED: dict[str, Any] = {"facecolor": "#F3D9CB", "edgecolor": "#8A2F00", "hatch": "////", "lw": 0.0}


@arguments_checked
def discrepancy(compared: Discrepancy) -> Figure:
    """Draw how far effects move a landing, by where the throw starts, and where they change the side.

    Parameters
    ----------
    compared : Discrepancy
        From `limitsets.discrepancy`.

    Returns
    -------
    matplotlib.figure.Figure
        One panel per side; the band is what the goal is proved to survive at every throw.

    Raises
    ------
    AnswerError
        For a scene without effects.

    Examples
    --------
    >>> import limitsets as ls
    >>> text = ls.load("paper-designed").as_dict() | {"world": {"friction": 1.3}}
    >>> figure = ls.plot.discrepancy(ls.discrepancy(text, ["slip"]))
    >>> [axes.get_title(loc="left") for axes in figure.axes]
    ['on side 0', 'on side 1', 'on side 2']
    """
    scene, unit = compared.scene, compared.scene.unit
    if len(compared.scenes) < 2:
        raise AnswerError(
            "the effects", "none", "at least one", "name some: limitsets.discrepancy(scene, [...])"
        )
    count = len(scene.sides)
    below = f"x before the throw [{unit}]"
    figure, panels = style.panels(count, min(count, 3), (3.1, 2.5), (0.9, 1.15), below)
    survives = 0.0 if compared.margin is None else compared.margin.proved
    first = compared.scenes[0], compared.scenes[1]
    moved = [along_arm(first, side) for side in range(count)]
    reach = max([1.5 * survives, *(1.08 * np.nanmax(np.abs(each), initial=0.0) for _, each in moved), 1e-9])
    other = any(bool(np.isnan(each).any()) for _, each in moved)
    for side, axes in enumerate(panels):
        x, each = moved[side]
        for lo, hi in compared.audit.extents.get(side, ()):
            axes.axvspan(lo, hi, facecolor="#EEF2F6", edgecolor="none", zorder=0, gid="limit set")
        axes.axhspan(-survives, survives, facecolor="#CFE3D4", edgecolor="none", zorder=1, gid="survives")
        axes.fill_between(
            x, -reach, reach, where=np.isnan(each).tolist(), step="mid", zorder=2, gid="other side", **CHANGED
        )
        axes.plot(x, each, color=style.JOG, lw=1.3, zorder=3, gid="moved")
        axes.set_title(f"on side {side}", loc="left", fontsize=style.TEXT)
        axes.set(xlim=(0.0, scene.arm_length), ylim=(-reach, reach))
        if side % min(count, 3) == 0:
            axes.set_ylabel(f"landing moved by [{unit}]")
    handles = [
        style.key("with effects, less without", color=style.JOG, lw=1.3),
        Patch(facecolor="#CFE3D4", label="the goal survives that at every throw (proved)")
        if survives
        else None,
        Patch(label="another side, or outside the model", **CHANGED) if other else None,
        Patch(facecolor="#EEF2F6", label="limit set without effects") if compared.audit.extents else None,
    ]
    return style.finished(figure, f"{scene.name}: landings with {', '.join(compared.effects)}", handles, 2)
