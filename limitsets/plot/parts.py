"""The part on the arm: its outline, the numbers of its sides, its centre of mass, and where a side has its left end."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from limitsets.arguments import arguments_checked
from limitsets.geometry import side_ends
from limitsets.plot import style
from limitsets.plot.poses import angle_on_side, outline, turned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.scene import Scene
    from limitsets.scene.sketch import Sketch

Array = NDArray[np.float64]

CENTRE: dict[str, Any] = {"marker": "o", "ms": 9, "mfc": "white", "mec": style.INK, "mew": 1.6, "ls": ""}
MASS: dict[str, Any] = {"marker": "D", "ms": 8, "color": style.FLIP, "ls": ""}
FOOT: dict[str, Any] = {"color": style.JOG, "lw": 1.3, "ls": (0, (4, 2))}
OUTLINE: dict[str, Any] = {"facecolor": "#e8eef4", "edgecolor": style.INK, "lw": 1.8}
TIPS: dict[str, Any] = {"color": style.FLIP, "lw": 3.0, "ls": (0, (1.5, 1))}

# What the name of a side keeps from it [points].
CLEAR = 4


@arguments_checked
def part(scene: Scene) -> Figure:
    """Draw the part as it lies on side 0 on the arm, its sides numbered in the order in which it flips.

    Parameters
    ----------
    scene : Scene
        The scene.

    Returns
    -------
    matplotlib.figure.Figure
        With the centre of mass, masses added to a plate, the side on which the centre of mass is a along and d above,
        and every length in the scene's unit.  A side on which the part cannot rest is dashed.

    Examples
    --------
    >>> import limitsets as ls
    >>> figure = ls.plot.part(ls.load("paper-designed"))
    >>> [text.get_text() for text in figure.axes[0].texts if text.get_gid() == "side"]
    ['side 0: 5.75 in', 'side 1: 3.6 in', 'side 2: 6.75 in']
    """
    corners = outline(scene, 0) + _centre_at(scene)
    reach = np.ptp(corners, axis=0)
    size = float(max(reach))
    wide, high = float(reach[0]) + 0.8 * size, float(reach[1]) + 0.45 * size
    figure, (axes,) = style.canvas(7.6, min(max(5.6 * high / wide, 3.2), 7.5) + 0.7)
    ends = [float(corners[:, 0].min()) - 0.4 * size, float(corners[:, 0].max()) + 0.4 * size]
    axes.set_aspect("equal")
    axes.set_xlim(*ends)
    axes.set_ylim(-0.28 * size, float(corners[:, 1].max()) + 0.15 * size)
    axes.fill_between(
        ends, 0.0, -0.035 * size, facecolor="#d9d9d9", hatch="////", edgecolor="#9a9a9a", lw=0, gid="arm"
    )
    axes.axhline(0.0, color=style.INK, lw=2.0, zorder=1)
    axes.add_patch(Polygon(corners, closed=True, zorder=2, gid="part", **OUTLINE))
    resting = scene.sides.rests.tolist()
    _sides(axes, scene, corners, resting)
    _centre(axes, scene, size)
    masses = _masses(scene)
    _added(axes, scene, masses)
    style.note(
        axes,
        "\N{LEFTWARDS ARROW} to the joint",
        (ends[0], 0.0),
        (6, 8),
        ha="left",
        fontsize=style.SMALL,
        gid="joint",
    )
    axes.set_axis_off()
    style.title(figure, f"{scene.name}: the part, lying on side 0")
    style.legend(figure, _legend(masses, resting), 3)
    return figure


def refused_part(found: Sketch, why: str) -> Figure:
    """Draw a part that is refused as it is written: its corners by number, its sides, what is wrong.

    Parameters
    ----------
    found : Sketch
        From `limitsets.scene.sketch.sketch`.
    why : str
        The error.

    Returns
    -------
    matplotlib.figure.Figure
    """
    corners, count = found.vertices, len(found.vertices)
    size = max(float(np.ptp(corners, axis=0).max()), 1e-300)
    figure, (axes,) = style.canvas(7.6, 6.0)
    axes.set_aspect("equal")
    lo, hi = corners.min(axis=0), corners.max(axis=0)
    beside = size * np.array([0.4, 0.25])
    room = np.stack([lo - beside, hi + beside])
    axes.set(xlim=room[:, 0], ylim=room[:, 1])
    axes.add_patch(Polygon(corners, closed=True, zorder=2, gid="part", **(OUTLINE | {"ls": "--"})))
    axes.plot(*corners.T, ls="", marker="o", ms=4, color=style.INK, zorder=3)
    middle = corners.mean(axis=0)
    for k, corner in enumerate(corners):
        way = middle - corner  # the names of sides are outside
        shift = tuple((16.0 * way / max(float(np.hypot(*way)), 1e-300)).tolist())
        at = tuple(corner.tolist())
        style.note(axes, f"P{k}", at, shift, ha="center", va="center", gid="corner")
    ahead = np.roll(corners, -1, axis=0)
    turn = 1.0 if float(np.sum(corners[:, 0] * ahead[:, 1] - corners[:, 1] * ahead[:, 0])) >= 0.0 else -1.0
    for side in range(count):
        left, right = (corners[k] for k in side_ends(count, side))
        length = float(np.hypot(*(right - left)))
        outward = turn * np.array([right[1] - left[1], left[0] - right[0]]) / max(length, 1e-300)
        words = f"side {side}: {length:.5g} {found.unit}"
        away = _clear(words, style.SMALL, outward) * outward
        halfway = tuple((0.5 * (left + right)).tolist())
        style.note(axes, words, halfway, tuple(away.tolist()), ha="center", va="center", zorder=4, gid="side")
    if found.centre is not None:
        axes.plot(*found.centre, zorder=5, gid="centre of mass", **CENTRE)
        style.note(axes, "centre of mass", found.centre, (9, 0), va="center", zorder=5)
    reason = "\n".join(textwrap.wrap(why, 92))
    axes.set_xlabel(f"x [{found.unit}]\n\n{reason}", fontsize=style.SMALL)
    axes.set_ylabel(f"y [{found.unit}]")
    style.title(figure, f"{found.name}: the part as it is written, which is refused")
    return figure


def _clear(words: str, size: float, way: Array) -> float:
    """Say how far the middle of words has to be from a side, for them to be clear of it [points]."""
    return CLEAR + float(np.abs(way) @ (0.31 * size * len(words), 0.5 * size))


def _centre_at(scene: Scene) -> Array:
    """Where the centre of mass is, from the left end of side 0."""
    return np.array([float(scene.sides.a[0]), float(scene.sides.d[0])])


def _sides(axes: Axes, scene: Scene, corners: Array, resting: list[bool]) -> None:
    """Name each side outside of its middle, with its length; mark where the part cannot rest."""
    count = len(corners)
    for side in range(count):
        # of the outline the first vertex is the left end of side 0
        left, right = (corners[k] for k in side_ends(count, side))
        along = (right - left) / np.hypot(*(right - left))
        outward = np.array([along[1], -along[0]])
        words = f"side {side}: {float(scene.sides.length[side]):.5g} {scene.unit}"
        away = _clear(words, style.TEXT, outward) + (10 if side == 0 else 0)
        shift = away * outward
        leader = None
        if outward[1] < -0.1 and side != 0:  # an edge that overhangs: beside it, and not down on the arm
            shift = np.array([away / outward[0], 0.0])
            leader = {"arrowstyle": "-", "color": style.INK, "lw": 0.7}
        middle = tuple((0.5 * (left + right)).tolist())
        how: dict[str, Any] = {
            "ha": "center",
            "va": "center",
            "fontsize": style.TEXT,
            "weight": "bold",
            "arrowprops": leader,
        }
        if side == 0:  # over the line down from the centre of mass
            how["bbox"] = {"boxstyle": "square,pad=0.2", "fc": "white", "ec": "none"}
        style.note(axes, words, middle, tuple(shift.tolist()), zorder=6, gid="side", **how)
        if not resting[side]:
            axes.plot(*np.stack([left, right], axis=-1), zorder=4, gid="no rest", **TIPS)


def _centre(axes: Axes, scene: Scene, size: float) -> None:
    """Draw the centre of mass, how far it is from the left end of side 0, and how high."""
    a, d = float(scene.sides.a[0]), float(scene.sides.d[0])
    axes.plot([a, a], [0.0, d], zorder=3, gid="height", **FOOT)
    low = -0.2 * size
    axes.annotate(
        "", (0.0, low), (a, low), arrowprops={"arrowstyle": "<->", "color": style.JOG, "lw": 1.0}, gid="a"
    )
    axes.vlines([0.0, a], low, 0.0, color=style.JOG, lw=0.6, ls=":")
    words = f"a = {a:.4g} {scene.unit}, d = {d:.4g} {scene.unit}"
    style.note(axes, words, (max(a, 0.0), low), (6, 0), va="center", color=style.JOG, gid="measure")
    axes.plot(a, d, zorder=5, gid="centre of mass", **CENTRE)


def _masses(scene: Scene) -> list[tuple[Array, str]]:
    """Give the masses added to a plate: where they are drawn, and how heavy, as the scene writes it."""
    points = scene.text["part"]["mass"].get("points", ())
    found = []
    for k, point in enumerate(points):
        name = f"part.mass.points[{k}]"
        about = np.array([[scene.value(f"{name}.{axis}") for axis in "xy"]]) - np.asarray(scene.centre)
        place = turned(about, angle_on_side(scene, 0))[0] + _centre_at(scene)
        found.append((place, str(point["mass"])))
    return found


def _added(axes: Axes, scene: Scene, masses: list[tuple[Array, str]]) -> None:
    for place, text in masses:
        axes.plot(*place, zorder=5, gid="added mass", **MASS)
        right = place[0] >= float(scene.sides.a[0])
        shift, align = ((8, 0), "left") if right else ((-8, 0), "right")
        style.note(
            axes,
            text,
            tuple(place.tolist()),
            shift,
            ha=align,
            va="center",
            zorder=6,
            color=style.FLIP,
            gid="mass",
        )


def _legend(masses: list[Any], resting: list[bool]) -> list[Any]:
    handles = [
        style.key("centre of mass", **CENTRE),
        style.key("a along side 0 from its left end, d above it", **FOOT),
    ]
    if masses:
        handles.append(style.key("mass added", **MASS))
    if not all(resting):
        handles.append(style.key("the part cannot rest on this side", **TIPS))
    return handles
