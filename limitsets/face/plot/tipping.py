"""A part on each of its sides, with the angles by which the ground leans when it tips over."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from limitsets.base import arguments_checked, rounded
from limitsets.face.plot import style
from limitsets.face.plot.parts import CENTRE, SOLID, TIPS, draw_on_side
from limitsets.face.plot.throwing import about_centre
from limitsets.feeder.scene import Scene
from limitsets.proofs.prover.stability import SideStability, Stability

MOST = 12
"""Sides that are drawn: of a part with more, those on which it rests, the most stable ones."""
ACROSS = 4
CONE: dict[str, Any] = {"color": style.JOG, "lw": 1.2, "ls": (0, (4, 2))}


@arguments_checked
def resting_sides(answer: Stability) -> Figure:
    """Draw a part on each of its sides, and by how much the ground can lean before it tips over either end.

    Parameters
    ----------
    answer : Stability
        From `limitsets.proofs.prover.stability.stability`.

    Returns
    -------
    matplotlib.figure.Figure
        A panel for each side, of more than 12 for those on which the part rests: the part, its centre of mass, lines
        from there to both ends of the side with their angles, proved ones rounded down.  A side on which the part does
        not rest is dashed.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.proofs.prover.stability import stability
    >>> len(ls.plot.resting_sides(stability("paper-designed")).axes)
    3
    """
    scene = answer.scene
    few = len(answer.sides) <= MOST
    resting = [each for each in answer.sides if few or each.rests]
    stable = sorted(resting, key=lambda each: min(each.left[0], each.right[0]), reverse=True)[:MOST]
    drawn = sorted(stable, key=lambda each: each.side)
    across = min(len(drawn), ACROSS)
    down = math.ceil(len(drawn) / across)
    size = max(math.dist((0.0, 0.0), corner) for corner in about_centre(scene).tolist())
    tall = 0.25 * size + max(0.5 * sum(side.d) for side in drawn) + size
    figure, panels = style.canvas(
        2.9 * max(across, 2) + 0.4, 2.9 * down * tall / (2.6 * size) + 1.4, down, across
    )
    for axes, side in zip(panels, drawn, strict=False):
        _panel(axes, scene, side, size)
        axes.set(aspect="equal", xlim=(-1.3 * size, 1.3 * size), ylim=(-0.25 * size, tall - 0.25 * size))
    for axes in panels[len(drawn) :]:
        axes.remove()
    handles = [
        style.key("centre of mass", **CENTRE),
        style.key("to the ends of the side: tips over where one of them is upright", **CONE),
        None
        if all(each.rests for each in drawn)
        else style.key("the part does not rest on this side", **TIPS),
    ]
    title = f"{scene.name}: how far the ground can lean before the part tips over"
    return style.finished(figure, title, handles)


def _panel(axes: Axes, scene: Scene, side: SideStability, size: float) -> None:
    """Draw the part on a side; x runs from below the centre of mass, y from the ground."""
    a, d = 0.5 * sum(side.a), 0.5 * sum(side.d)
    axes.set_axis_off()
    axes.fill_between([-1.3 * size, 1.3 * size], 0.0, -0.07 * size, **SOLID)
    axes.axhline(0.0, color=style.INK, lw=1.6, zorder=1)
    draw_on_side(axes, scene, side.side, np.array([0.0, d]))
    ends = {-1: (-a, side.left[0]), 1: (0.5 * sum(side.length) - a, side.right[0])}
    if not side.rests:
        axes.plot([ends[-1][0], ends[1][0]], [0.0, 0.0], zorder=4, gid="no rest", **TIPS)
    for sign, (end, lean) in ends.items():
        axes.plot([0.0, end], [d, 0.0], zorder=3, gid="cone", **CONE)
        words = f"{rounded(lean, '.1f', up=False)}°" if side.rests else ("tips" if lean <= 0 else "")
        place = (sign * 1.2 * size, -0.12 * size)
        style.note(axes, words, place, (0, 0), ha="right" if sign > 0 else "left", va="top", gid="lean")
    axes.plot(0.0, d, zorder=5, gid="centre of mass", **CENTRE)
    axes.set_title(f"side {side.side}", fontsize=style.TEXT)
