"""One throw: the part in the air, and how it comes to rest (Fig. 3 of the paper)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Patch, Polygon
from numpy.typing import NDArray

from limitsets.arguments import arguments_checked
from limitsets.errors import AnswerError
from limitsets.maps import codes
from limitsets.plot import style
from limitsets.plot.poses import angle_on_side, outline, turned
from limitsets.plot.throwing import motion, throws_of
from limitsets.thrower import trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.plot.throwing import Motion, Throw
    from limitsets.scene import Scene

Array = NDArray[np.float64]

SHOWN = 3  # outlines in the air, and as many on the way from the impact to rest
WIDEST, TALLEST, LETTERS = 4.6, 8.0, 11  # of panels beside each other [inches], and letters to an inch
AIR, LANDED = "#0072B2", "#C04A00"
FLYING: dict[str, Any] = {"edgecolor": AIR, "ls": (0, (3, 2))}
STRUCK: dict[str, Any] = {"edgecolor": AIR, "lw": 2.2}
REST: dict[str, Any] = {"edgecolor": style.INK, "lw": 1.6}
VERTEX: dict[str, Any] = {"color": LANDED, "marker": "v", "ls": ""}
CENTRE: dict[str, Any] = {"marker": "o", "ms": 4, "mfc": "white", "mec": style.INK}


@arguments_checked
def flight(scene: Scene, x: float, side: int) -> Figure:
    r"""Draw one throw: above the flight up to the impact, below the way from there to rest.

    Parameters
    ----------
    scene : Scene
        The scene.
    x : float
        Where the part rests before the throw [length].
    side : int
        On which side.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    AnswerError
        For a start from which there is no flight.
    MapError
        For a side that the part has not.

    Examples
    --------
    >>> import limitsets as ls
    >>> figure = ls.plot.flight(ls.load("paper-designed"), 21.0, 2)
    >>> figure.axes[1].get_title(loc="left").replace("\n", " ")
    'After the impact: a flip, 21.00 to 16.55 in, onto side 0'
    """
    if x > scene.arm_length:
        allowed = f"at most {scene.arm_length:.9g} {scene.unit}, the end of the arm"
        raise AnswerError("the start x", x, allowed, "start where a part can rest")
    throws = throws_of(scene, trace(scene.map, x, side, 1))
    if not throws:
        least = float(scene.sides.a[side])
        allowed = f"more than {least:.6g} on side {side}"
        if x > least:  # thrown, and not down again within a full turn
            kappa = f"{scene.kappa:.6g} {scene.unit}"
            raise AnswerError(
                "the throw",
                f"outside the model, from x = {x:.6g} on side {side}",
                "one that lands within a full turn",
                f"kappa is {kappa}: throw more softly, and see whether the speed has the right unit",
            )
        raise AnswerError("x of the throw", x, allowed, "start where a throw lifts the part")
    throw, moves = throws[0], motion(scene, throws[0])
    air = _placed(scene, side, moves.flight(np.linspace(0.0, 1.0, SHOWN + 2)))
    stops = [0.0, 1.0] if moves.turning.drawn else np.linspace(0.0, 1.0, SHOWN + 1)
    rolled = _placed(scene, side, moves.turning.pose(np.array(stops)))
    everything = np.concatenate([*air, *rolled])
    lo, hi = float(everything[:, 0].min()), float(everything[:, 0].max())
    height = float(everything[:, 1].max() - min(0.0, scene.surface_height))
    figure, (above, below) = _canvas(hi - lo + 2.0, height + 1.4)
    for axes in (above, below):
        _arm(axes, scene, lo - 1.0, hi + 1.0)
        axes.set_aspect("equal")
        axes.set_xlim(lo - 1.0, hi + 1.0)
        axes.set_ylim(min(0.0, scene.surface_height) - 0.9, float(everything[:, 1].max()) + 0.5)
        axes.set_xlabel(f"distance from the joint [{scene.unit}]")
        axes.set_ylabel(f"height over the joint [{scene.unit}]")
        axes.label_outer()  # last: it takes the inner labels away
    _flight(above, scene, throw, moves, air)
    _landing(below, scene, throw, moves, rolled)
    caveat = " (small-angle formulas: the part hangs at its left vertex, whose path they give)"
    style.title(figure, f"One throw of {scene.name}{'' if scene.flight == 'exact' else caveat}")
    style.legend(figure, _legend(len(rolled) > 2), 3)
    return figure


def _canvas(width: float, height: float) -> tuple[Figure, list[Axes]]:
    """Two panels of one extent: beside each other where the picture is tall, else one above the other."""
    if height > 0.6 * width:
        tall = min(TALLEST, max(3.4, WIDEST * height / width))
        return style.canvas(10.4, tall + 1.6, 1, 2, sharex=True, sharey=True)
    return style.canvas(9.0, 2 * max(1.6, 8.2 * height / width) + 1.9, 2, 1, sharex=True, sharey=True)


def _placed(scene: Scene, side: int, poses: Array) -> list[Array]:
    """Outlines in some poses, the left end of the side thrown from first."""
    shape, start = outline(scene, side), angle_on_side(scene, side)
    return [np.array([x, y]) + turned(shape, angle - start) for x, y, angle in poses.tolist()]


def _arm(axes: Axes, scene: Scene, lo: float, hi: float) -> None:
    h, ends = scene.surface_height, [lo, min(hi, scene.arm_length)]
    axes.plot(ends, [h, h], color=style.INK, lw=2.2, solid_capstyle="butt", zorder=1, gid="arm")
    axes.fill_between(ends, h, h - 0.35, facecolor="#d9d9d9", hatch="////", edgecolor="#9a9a9a", lw=0)
    if lo <= 0 <= hi:
        axes.plot([0], [0], marker="o", ms=9, mfc="white", mec=style.INK, zorder=2, gid="joint")
    style.open_frame(axes)


def _part(axes: Axes, corners: Array, **look: Any) -> None:
    axes.add_patch(Polygon(corners, closed=True, **look))


def _impact(axes: Axes, moves: Motion, corners: Array, zorder: float) -> None:
    """Draw the part when it meets the arm, and the vertex that is struck."""
    _part(axes, corners, facecolor=(0.72, 0.84, 0.93, 0.8), zorder=zorder, gid="impact", **STRUCK)
    axes.plot(*moves.struck, **VERTEX, ms=9, zorder=7, gid="struck vertex")


def _flight(axes: Axes, scene: Scene, throw: Throw, moves: Motion, air: list[Array]) -> None:
    _part(axes, air[0], facecolor="#dcdcdc", zorder=2, gid="start", **REST)
    for k, corners in enumerate(air[1:-1]):
        # Later ones cover earlier ones in part, as a photograph with a strobe would show them.
        look = {"facecolor": (0.86, 0.92, 0.97, 0.72), "lw": 1.0, "zorder": 3 + 0.1 * k, **FLYING}
        _part(axes, corners, gid="in the air", **look)
    _impact(axes, moves, air[-1], zorder=4)
    path, stops = (moves.flight(np.linspace(0.0, 1.0, count)) for count in (80, len(air)))
    axes.plot(path[:, 0], path[:, 1], color=style.INK, lw=1.1, ls="-.", zorder=5, gid="path")
    axes.plot(stops[:, 0], stops[:, 1], ls="", zorder=6, gid="centre of mass", **CENTRE)
    start = f"from x = {throw.x:.2f} {scene.unit} on side {throw.side}"
    text = f"In the air: {start}, turning by {math.degrees(throw.phi):.1f}°"
    _head(axes, text)


def _landing(axes: Axes, scene: Scene, throw: Throw, moves: Motion, rolled: list[Array]) -> None:
    before, after, side = throw.side, throw.after, throw.side_after
    _part(axes, rolled[-1], facecolor=(0.86, 0.86, 0.86, 0.85), zorder=2, gid="rest", **REST)
    _impact(axes, moves, rolled[0], zorder=1.5)
    for corners in rolled[1:-1]:
        _part(axes, corners, facecolor="none", edgecolor=LANDED, lw=1.0, ls=":", zorder=3, gid="turning")
    height = scene.surface_height + float(scene.sides.d[side])
    axes.plot(after, height, ls="", zorder=6, gid="centre at rest", **CENTRE)
    how = "roll" if throw.code == codes.ROLL else ("flip" if side != before else "jog")
    where = f"onto side {side}" if side != before else f"still on side {side}"
    note = {codes.OUTWARD: "; off the arm's end", codes.INWARD: "; into the joint"}.get(throw.code, "")
    text = f"After the impact: a {how}, {throw.x:.2f} to {after:.2f} {scene.unit}, {where}{note}"
    _head(axes, text)


def _head(axes: Axes, text: str) -> None:
    """Write a title, in lines of phrases as wide as the panel where panels stand beside each other."""
    if axes.get_subplotspec().get_gridspec().ncols > 1:  # type: ignore[union-attr]  # of a grid
        wide = min(WIDEST, TALLEST * float(np.ptp(axes.get_xlim()) / np.ptp(axes.get_ylim())))
        first, *phrases = text.split(", ")
        lines = [first]
        for phrase in phrases:
            if len(f"{lines[-1]}, {phrase}") <= LETTERS * wide:
                lines[-1] += f", {phrase}"
            else:
                lines[-1] += ","
                lines.append(phrase)
        text = "\n".join(lines)
    axes.set_title(text, fontsize=style.TEXT, loc="left")


def _legend(turns: bool) -> list[Any]:
    handles: list[Any] = [
        Patch(facecolor="#dcdcdc", label="at rest, before and after", **REST),
        Patch(facecolor="#dbebf7", label="in the air", **FLYING),
        Patch(facecolor="#b8d6ed", label="at the impact", **STRUCK),
        style.key("path of the centre of mass", color=style.INK, ls="-.", **CENTRE),
        style.key("struck vertex", ms=8, **VERTEX),
    ]
    return [*handles, *([style.key("turning to rest", color=LANDED, ls=":")] if turns else [])]
