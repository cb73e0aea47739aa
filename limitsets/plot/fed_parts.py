"""Feeding in pictures: a part that tips into the cavity, how long it takes, throws until it is fed, and the noise."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Polygon

from limitsets.arguments import arguments_checked
from limitsets.feeding.falling import FATES
from limitsets.feeding.tipping import tipping_times
from limitsets.geometry.polygon import above_side, side_ends
from limitsets.plot import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from limitsets.feeding import Feeding

LOOKS: dict[str, dict[str, Any]] = {
    "right": {"color": style.GOAL, "ls": "-"},
    "wrong": {"color": style.FLIP, "ls": style.FLIP_LINE},
    "wall": {"color": style.ROLL, "ls": style.ROLL_LINE},
    "edge": {"color": style.INK, "ls": (0, (5, 1.5, 1, 1.5))},
    "left": {"color": style.JOG, "ls": (0, (1, 1.5))},
}
# Shares below this are not drawn.
LEAST = 1e-6
WORDS = {
    "right": "side wanted, clear",
    "wrong": "another side",
    "wall": "meets the wall",
    "edge": "thrown at the end (assumed not fed)",
    "left": "leaves the arm",
}


@arguments_checked
def feeding(found: Feeding) -> Figure:
    """Draw what becomes of parts at the end of the arm.

    Parameters
    ----------
    found : Feeding
        From `limitsets.feed`.

    Returns
    -------
    matplotlib.figure.Figure
        The cavity with a part that tips over the end; the time this takes against how far beyond the end it rests (with
        gravity); shares of the starts that have met each fate, by throws; right feeds against the level of the noise.
    """
    scene = found.end.scene
    panels = [_cavity, _throws]
    if scene.gravity is not None:
        panels.insert(1, _tipping)
    if found.curve is not None:
        panels.append(_levels)
    rows = math.ceil(len(panels) / 2)
    figure, axes = style.canvas(9.6, 3.6 * rows + 0.3, rows, 2)
    for draw, each in zip(panels, axes, strict=False):
        draw(each, found)
    for each in axes[len(panels) :]:
        each.set_axis_off()
    words = f"side {found.end.side} wanted beyond x = {found.end.x:g} {scene.unit}"
    style.title(figure, f"{scene.name}: {words}")
    return figure


def _corners(found: Feeding, beyond: float, tipped: float) -> NDArray[np.float64]:
    """Vertices of a part on the side wanted, tipped over the end of the arm, from the end [length]."""
    scene, side = found.end.scene, found.end.side
    corners = [(float(x), float(y)) for x, y in scene.vertices]
    left, right = side_ends(len(corners), side)
    placed = []
    for corner in corners:
        along, above, _ = above_side(corners[left], corners[right], corner)
        p = along - float(scene.sides.a[side]) + beyond
        placed.append(
            (p * math.cos(tipped) + above * math.sin(tipped), above * math.cos(tipped) - p * math.sin(tipped))
        )
    return np.array(placed)


def _cavity(axes: Axes, found: Feeding) -> None:
    scene = found.end.scene
    cavity = scene.cavity
    assert cavity is not None  # `feed` refuses a scene without one
    ramp = cavity.depth / math.tan(cavity.angle)
    outline = [
        (-8.0, 0.0),
        (0.0, 0.0),
        (ramp, -cavity.depth),
        (cavity.width, -cavity.depth),
        (cavity.width, 0.0),
    ]
    axes.plot(*zip(*outline, strict=True), color=style.INK, lw=1.6)
    beyond = 0.25 * float(scene.sides.a[found.end.side])
    for share, alpha in ((0.0, 1.0), (0.5, 0.6), (1.0, 1.0)):
        corners = _corners(found, beyond, share * cavity.angle)
        axes.add_patch(Polygon(corners, closed=True, fill=False, ec=style.JOG, lw=1.1, alpha=alpha))
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_title("a part tips over the end", loc="left", fontsize=style.TEXT)
    axes.set_xlabel(f"beyond the end [{scene.unit}]", fontsize=style.SMALL)
    style.open_frame(axes)


def _tipping(axes: Axes, found: Feeding) -> None:
    scene = found.end.scene
    side = found.end.side
    most = min(float(scene.sides.a[side]), scene.arm_length - found.end.x)
    e = np.geomspace(1e-6 * most, most, 300)
    axes.plot(e, tipping_times(scene, side)(e), color=style.INK, lw=1.3)
    rate = scene.world.throw_rate
    if rate is not None:
        axes.axhline(1.0 / rate, color=style.FLIP, lw=1.1, ls=style.FLIP_LINE)
        style.note(axes, f"next throw, {rate:g} Hz", (float(e[0]), 1.0 / rate), (2, 3), color=style.FLIP)
    for lo, hi in found.end.clear:
        axes.axvspan(max(lo, float(e[0])), hi, color="#9BD1B8", alpha=0.4, lw=0)
    axes.set_xscale("log")
    axes.set_ylim(bottom=0.0)
    begins = "from rest" if scene.cavity is not None and scene.cavity.tips == "rest" else "as it comes down"
    axes.set_title(f"time to tip, {begins} (shaded: clear)", loc="left", fontsize=style.TEXT)
    axes.set_xlabel(f"comes down beyond the end by [{scene.unit}]", fontsize=style.SMALL)
    axes.set_ylabel("time [s]", fontsize=style.SMALL)
    style.open_frame(axes)


def _throws(axes: Axes, found: Feeding) -> None:
    rows = found.shares.by_throw
    last = (found.shares.quantile(0.999) or rows.shape[0]) + 2
    number = np.arange(1, min(last, rows.shape[0]) + 1)
    for column, name in enumerate(FATES[:-1]):
        total = np.cumsum(rows[:, column])[: number.size]
        if total.size and total[-1] > 0.0:
            label = f"{WORDS[name]}: {100 * found.shares.shares[name]:.3g} %"
            axes.step(number, total, where="post", lw=1.3, label=label, **LOOKS[name])
    axes.set_title(f"fates of {found.trials.fate.size} parts", loc="left", fontsize=style.TEXT)
    axes.set_xlabel("throws", fontsize=style.SMALL)
    axes.set_ylabel("share of random starts", fontsize=style.SMALL)
    axes.set_ylim(0.0, 1.4 * axes.get_ylim()[1])  # room for the legend over the steps
    axes.set_yticks([tick for tick in axes.get_yticks() if tick <= 1.0])
    if axes.get_legend_handles_labels()[0]:  # none where all parts stay
        axes.legend(fontsize=style.SMALL, frameon=False, loc="upper left")
    style.open_frame(axes)


def _levels(axes: Axes, found: Feeding) -> None:
    curve = found.curve
    assert curve is not None
    axes.plot(curve.factors, curve.right, color=style.INK, marker="o", ms=3.5, lw=1.3)
    axes.axhline(curve.wanted, color=style.GOAL, lw=1.0, ls=(0, (4, 2)), label=f"{100 * curve.wanted:g} %")
    if curve.level is not None and curve.level[1] > 0.0:
        axes.axvline(sum(curve.level) / 2, color=style.GOAL, lw=1.0, ls=(0, (1, 1.5)))
    axes.set_ylim(0.0, 1.03)
    axes.set_title("right feeds against the noise", loc="left", fontsize=style.TEXT)
    axes.set_xlabel("noise, in multiples of the one given", fontsize=style.SMALL)
    axes.legend(fontsize=style.SMALL, frameon=False, loc="lower left")
    style.open_frame(axes)
