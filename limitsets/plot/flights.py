"""One throw: the part in the air, and how it comes to rest (Fig. 3 of the paper)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Patch, Polygon
from numpy.typing import NDArray

from limitsets.errors import AnswerError
from limitsets.maps import codes
from limitsets.plot import style
from limitsets.plot.poses import centre_in_flight, outline, turned
from limitsets.thrower import fly, trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.scene import Scene

__all__ = ["flight"]

Array = NDArray[np.float64]

SHOWN = 3  # outlines in the air, and as many on the way from the impact to rest
AIR, LANDED = "#0072B2", "#C04A00"
FLYING: dict[str, Any] = {"edgecolor": AIR, "ls": (0, (3, 2))}
STRUCK: dict[str, Any] = {"edgecolor": AIR, "lw": 2.2}
REST: dict[str, Any] = {"edgecolor": style.INK, "lw": 1.6}
VERTEX: dict[str, Any] = {"color": LANDED, "marker": "v", "ls": ""}
CENTRE: dict[str, Any] = {"marker": "o", "ms": 4, "mfc": "white", "mec": style.INK}


def flight(scene: Scene, x: float, side: int) -> Figure:
    """Draw one throw: above the flight up to the impact, below the way from there to rest.

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
    >>> [axes.get_title(loc="left") for axes in figure.axes][1]
    'After the impact: a flip, 21.00 to 16.55 in, onto side 0'
    """
    seen = trace(scene.map, x, side, 1)
    phi = float(seen.phi[0]) if seen.code.size else fly(scene.map, x, side).phi
    if seen.code.size == 0 or seen.code[0] == codes.OUTSIDE_MODEL or not math.isfinite(phi):
        least = float(scene.sides.a[side])
        allowed = f"more than {least:.6g} on side {side}"
        raise AnswerError("x of the throw", x, allowed, "start where a throw lifts the part")
    after, side_after, code = float(seen.x[1]), int(seen.side[1]), int(seen.code[0])
    air = [_in_air(scene, x, side, angle) for angle in np.linspace(0.0, phi, SHOWN + 2)]
    rolled = _to_rest(scene, air[-1], (side, side_after), after, phi, code)
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
    _flight(above, scene, x, side, phi, air)
    _landing(below, scene, rolled, (x, side), (after, side_after), code)
    caveat = " (small-angle formulas: the vertex need not be on the arm at the impact)"
    style.title(figure, f"One throw of {scene.name}{'' if scene.flight == 'exact' else caveat}")
    style.legend(figure, _legend(len(rolled) > 2), 3)
    return figure


def _canvas(width: float, height: float) -> tuple[Figure, list[Axes]]:
    """Two panels of one extent: beside each other where the picture is tall, else one above the other."""
    if height > 0.6 * width:
        tall = min(8.0, max(3.4, 4.6 * height / width))
        return style.canvas(10.4, tall + 1.6, 1, 2, sharex=True, sharey=True)
    return style.canvas(9.0, 2 * max(1.6, 8.2 * height / width) + 1.9, 2, 1, sharex=True, sharey=True)


def _in_air(scene: Scene, x: float, side: int, phi: float) -> Array:
    return turned(outline(scene, side), phi) + centre_in_flight(scene, x, side, phi)


def _to_rest(
    scene: Scene, landed: Array, sides: tuple[int, int], after: float, phi: float, code: int
) -> list[Array]:
    """Outlines from the impact to rest, turned about the struck vertex, which is the first.

    The last one is where the map says.  By the small-angle formulas the struck vertex is not on the arm, and no turning
    about it leads there; nor does one turning where the part rolls on, or has landed on another vertex.
    """
    side, side_after = sides
    at_rest = np.array([after, scene.surface_height + float(scene.sides.d[side_after])])
    rest = outline(scene, side_after) + at_rest
    if scene.flight != "exact" or code == codes.ROLL or _struck(scene, landed) != 0:
        return [landed, rest]
    turn = -phi if side_after == side else float(scene.sides.corner[side]) - phi
    pivot = landed[0]
    return [
        *(turned(landed - pivot, angle) + pivot for angle in np.linspace(0.0, turn, SHOWN + 1)[:-1]),
        rest,
    ]


def _struck(scene: Scene, landed: Array) -> int:
    """Vertex on the arm at the impact: the first, unless the scene lets another one land before it."""
    return int(landed[:, 1].argmin()) if scene.effects.landing else 0


def _arm(axes: Axes, scene: Scene, lo: float, hi: float) -> None:
    h, ends = scene.surface_height, [lo, min(hi, scene.arm_length)]
    axes.plot(ends, [h, h], color=style.INK, lw=2.2, solid_capstyle="butt", zorder=1, gid="arm")
    axes.fill_between(ends, h, h - 0.35, facecolor="#d9d9d9", hatch="////", edgecolor="#9a9a9a", lw=0)
    if lo <= 0 <= hi:
        axes.plot([0], [0], marker="o", ms=9, mfc="white", mec=style.INK, zorder=2, gid="joint")
    style.open_frame(axes)


def _part(axes: Axes, corners: Array, **look: Any) -> None:
    axes.add_patch(Polygon(corners, closed=True, **look))


def _impact(axes: Axes, scene: Scene, corners: Array, zorder: float) -> None:
    """Draw the part when it meets the arm, and the vertex that is struck."""
    _part(axes, corners, facecolor=(0.72, 0.84, 0.93, 0.8), zorder=zorder, gid="impact", **STRUCK)
    axes.plot(*corners[_struck(scene, corners)], **VERTEX, ms=9, zorder=7, gid="struck vertex")


def _flight(axes: Axes, scene: Scene, x: float, side: int, phi: float, air: list[Array]) -> None:
    _part(axes, air[0], facecolor="#dcdcdc", zorder=2, gid="start", **REST)
    for k, corners in enumerate(air[1:-1]):
        # Later ones cover earlier ones in part, as a photograph with a strobe would show them.
        look = {"facecolor": (0.86, 0.92, 0.97, 0.72), "lw": 1.0, "zorder": 3 + 0.1 * k, **FLYING}
        _part(axes, corners, gid="in the air", **look)
    _impact(axes, scene, air[-1], zorder=4)
    path = np.array([centre_in_flight(scene, x, side, angle) for angle in np.linspace(0.0, phi, 80)])
    axes.plot(path[:, 0], path[:, 1], color=style.INK, lw=1.1, ls="-.", zorder=5, gid="path")
    stops = np.array([centre_in_flight(scene, x, side, angle) for angle in np.linspace(0.0, phi, len(air))])
    axes.plot(stops[:, 0], stops[:, 1], ls="", zorder=6, gid="centre of mass", **CENTRE)
    text = f"In the air: from x = {x:.2f} {scene.unit} on side {side}, turning by {math.degrees(phi):.1f}°"
    axes.set_title(text, fontsize=style.TEXT, loc="left")


def _landing(
    axes: Axes, scene: Scene, rolled: list[Array], start: tuple[float, int], end: tuple[float, int], code: int
) -> None:
    (x, before), (after, side) = start, end
    _part(axes, rolled[-1], facecolor=(0.86, 0.86, 0.86, 0.85), zorder=2, gid="rest", **REST)
    _impact(axes, scene, rolled[0], zorder=1.5)
    for corners in rolled[1:-1]:
        _part(axes, corners, facecolor="none", edgecolor=LANDED, lw=1.0, ls=":", zorder=3, gid="turning")
    height = scene.surface_height + float(scene.sides.d[side])
    axes.plot(after, height, ls="", zorder=6, gid="centre at rest", **CENTRE)
    how = "roll" if code == codes.ROLL else ("flip" if side != before else "jog")
    where = f"onto side {side}" if side != before else f"still on side {side}"
    note = {codes.OUTWARD: "; off the arm's end", codes.INWARD: "; into the joint"}.get(code, "")
    text = f"After the impact: a {how}, {x:.2f} to {after:.2f} {scene.unit}, {where}{note}"
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
