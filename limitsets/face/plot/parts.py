"""The part on the arm, with its sides and its centre of mass; and one throw of it (Fig. 3 of the paper)."""

from __future__ import annotations

import math
import textwrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch, Polygon

from limitsets.base import AnswerError, arguments_checked
from limitsets.base.arrays import Array
from limitsets.face.plot import style
from limitsets.face.plot.throwing import (
    Motion,
    Throw,
    about_centre,
    angle_on_side,
    motion,
    outline,
    throws_of,
    turned,
)
from limitsets.feeder.geometry import side_ends
from limitsets.feeder.scene import Scene, Sketch
from limitsets.feeder.thrower import trace
from limitsets.systems.maps import codes

CENTRE: dict[str, Any] = {"marker": "o", "ms": 9, "mfc": "white", "mec": style.INK, "mew": 1.6, "ls": ""}
MASS: dict[str, Any] = {"marker": "D", "ms": 8, "color": style.FLIP, "ls": ""}
FOOT: dict[str, Any] = {"color": style.JOG, "lw": 1.3, "ls": (0, (4, 2))}
OUTLINE: dict[str, Any] = {"facecolor": "#e8eef4", "edgecolor": style.INK, "lw": 1.8}
SOLID: dict[str, Any] = {"facecolor": "#d9d9d9", "hatch": "////", "edgecolor": "#9a9a9a", "lw": 0}
HULL: dict[str, Any] = {"color": style.INK, "lw": 1.2, "ls": (0, (4, 3))}
TIPS: dict[str, Any] = {"color": style.FLIP, "lw": 3.0, "ls": (0, (1.5, 1))}

MIDDLE: dict[str, Any] = {"ha": "center", "va": "center"}

# Of a part with more sides only those have names that are longer than this share of the longest.
NAMED, LONG = 12, 0.1

# Distance of a side's name from the side [points].
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
    axes.set(aspect="equal", xlim=ends, ylim=(-0.28 * size, float(corners[:, 1].max()) + 0.15 * size))
    axes.fill_between(ends, 0.0, -0.035 * size, gid="arm", **SOLID)
    axes.axhline(0.0, color=style.INK, lw=2.0, zorder=1)
    plate = _plate(axes, scene)
    resting = scene.sides.rests.tolist()
    _sides(axes, scene, corners, resting)
    _centre(axes, scene, size)
    masses = _masses(axes, scene)
    style.note(axes, "\N{LEFTWARDS ARROW} to the joint", (ends[0], 0.0), (6, 8), ha="left", gid="joint")
    axes.set_axis_off()
    handles = [
        style.key("centre of mass", **CENTRE),
        style.key("a along side 0 from its left end, d above it", **FOOT),
        style.key("mass added", **MASS) if masses else None,
        style.key("convex hull: its sides", **HULL) if plate else None,
        None if all(resting) else style.key("the part cannot rest on this side", **TIPS),
    ]
    return style.finished(figure, f"{scene.name}: the part, lying on side 0", handles)


def _plate(axes: Axes, scene: Scene) -> bool:
    """Draw the part, and its hull where that is another polygon; say whether it is."""
    draw_on_side(axes, scene, 0, _centre_at(scene))
    notched = len(scene.outline) > len(scene.vertices)
    if notched:
        hull = turned(about_centre(scene), angle_on_side(scene, 0)) + _centre_at(scene)
        axes.add_patch(Polygon(hull, closed=True, fill=False, zorder=1.5, gid="hull", **HULL))
    return notched


def draw_on_side(axes: Axes, scene: Scene, side: int, centre: Array) -> None:
    """Draw the part as it lies on a side, with its holes; `centre` is where its centre of mass is."""

    def placed(points: Any) -> Array:
        about = np.asarray(points, dtype=np.float64) - np.asarray(scene.centre)
        return turned(about, angle_on_side(scene, side)) + centre

    axes.add_patch(Polygon(placed(scene.outline), closed=True, zorder=2, gid="part", **OUTLINE))
    for hole in scene.holes:
        look: dict[str, Any] = {"zorder": 2.5, "gid": "hole"} | OUTLINE | {"facecolor": "white", "lw": 1.2}
        if hole.centre is None:
            axes.add_patch(Polygon(placed(hole.vertices), closed=True, **look))
        else:
            axes.add_patch(Circle(tuple(placed([hole.centre])[0]), 0.5 * float(hole.diameter), **look))


def refused_part(sketch: Sketch, why: str) -> Figure:
    """Draw a part that is refused as it is written: its corners by number, its sides, what is wrong.

    Parameters
    ----------
    sketch : Sketch
        From `limitsets.feeder.scene.reading.sketch`.
    why : str
        The error.

    Returns
    -------
    matplotlib.figure.Figure
    """
    corners, count = sketch.vertices, len(sketch.vertices)
    size = max(float(np.ptp(corners, axis=0).max()), 1e-300)
    figure, (axes,) = style.canvas(7.6, 6.0)
    lo, hi = corners.min(axis=0), corners.max(axis=0)
    beside = size * np.array([0.4, 0.25])
    room = np.stack([lo - beside, hi + beside])
    axes.set(aspect="equal", xlim=room[:, 0], ylim=room[:, 1])
    axes.add_patch(Polygon(corners, closed=True, zorder=2, gid="part", **(OUTLINE | {"ls": "--"})))
    axes.plot(*corners.T, ls="", marker="o", ms=4, color=style.INK, zorder=3)
    middle = corners.mean(axis=0)
    for k, corner in enumerate(corners):
        way = middle - corner  # inside, because the names of sides are outside
        shift = tuple((16.0 * way / max(float(np.hypot(*way)), 1e-300)).tolist())
        style.note(axes, f"P{k}", tuple(corner.tolist()), shift, gid="corner", **MIDDLE)
    ahead = np.roll(corners, -1, axis=0)
    turn = 1.0 if float(np.sum(corners[:, 0] * ahead[:, 1] - corners[:, 1] * ahead[:, 0])) >= 0.0 else -1.0
    for side in range(count):
        left, right = (corners[k] for k in side_ends(count, side))
        length = float(np.hypot(*(right - left)))
        outward = turn * _outward(left, right)
        words = f"side {side}: {length:.5g} {sketch.unit}"
        away = _clear(words, style.SMALL, outward) * outward
        halfway = tuple((0.5 * (left + right)).tolist())
        style.note(axes, words, halfway, tuple(away.tolist()), zorder=4, gid="side", **MIDDLE)
    if sketch.centre is not None:
        axes.plot(*sketch.centre, zorder=5, gid="centre of mass", **CENTRE)
        style.note(axes, "centre of mass", sketch.centre, (9, 0), va="center", zorder=5)
    axes.set_xlabel("\n".join([f"x [{sketch.unit}]", "", *textwrap.wrap(why, 92)]), fontsize=style.SMALL)
    axes.set_ylabel(f"y [{sketch.unit}]")
    return style.finished(figure, f"{sketch.name}: the part as it is written, which is refused")


def _outward(left: Array, right: Array) -> Array:
    """Give the direction across a side, outward where the corners are counterclockwise."""
    along = (right - left) / max(float(np.hypot(*(right - left))), 1e-300)
    return np.array([along[1], -along[0]])


def _clear(words: str, size: float, way: Array) -> float:
    """Give the distance of the middle of words from a side at which they are clear of it [points]."""
    return CLEAR + float(np.abs(way) @ (0.31 * size * len(words), 0.5 * size))


def _centre_at(scene: Scene) -> Array:
    """Place the centre of mass, relative to the left end of side 0."""
    return np.array([float(scene.sides.a[0]), float(scene.sides.d[0])])


def _sides(axes: Axes, scene: Scene, corners: Array, resting: list[bool]) -> None:
    """Write name and length of each side outside its middle; mark sides on which the part cannot rest."""
    count = len(corners)
    for side in _named(scene):
        # the first vertex of the outline is the left end of side 0
        left, right = (corners[k] for k in side_ends(count, side))
        outward = _outward(left, right)
        words = f"side {side}: {float(scene.sides.length[side]):.5g} {scene.unit}"
        away = _clear(words, style.TEXT, outward) + (10 if side == 0 else 0)
        shift = away * outward
        how: dict[str, Any] = {"fontsize": style.TEXT, "weight": "bold", **MIDDLE}
        if side == 0:  # above the line down from the centre of mass
            how["bbox"] = style.PLATE | {"boxstyle": "square,pad=0.2"}
        elif outward[1] < -0.1:  # an overhanging edge: its name stands beside it, not down on the arm
            shift = np.array([away / outward[0], 0.0])
            how["arrowprops"] = {"arrowstyle": "-", "color": style.INK, "lw": 0.7}
        middle = tuple((0.5 * (left + right)).tolist())
        style.note(axes, words, middle, tuple(shift.tolist()), zorder=6, gid="side", **how)
    for side in np.flatnonzero(~np.array(resting)).tolist():
        left, right = (corners[k] for k in side_ends(count, side))
        axes.plot(*np.stack([left, right], axis=-1), zorder=4, gid="no rest", **TIPS)


def _named(scene: Scene) -> list[int]:
    """Say which sides are named: all, but of many, the chords of an arc among them, the long ones alone."""
    lengths = scene.sides.length
    short = LONG * lengths.max() if len(lengths) > NAMED else 0.0
    return np.flatnonzero(lengths >= short).tolist()


def _centre(axes: Axes, scene: Scene, size: float) -> None:
    """Draw the centre of mass, with its distances from the left end of side 0 and from the arm."""
    a, d = float(scene.sides.a[0]), float(scene.sides.d[0])
    axes.plot([a, a], [0.0, d], zorder=3, gid="height", **FOOT)
    low, arrow = -0.2 * size, {"arrowstyle": "<->", "color": style.JOG, "lw": 1.0}
    axes.annotate("", (0.0, low), (a, low), arrowprops=arrow, gid="a")
    axes.vlines([0.0, a], low, 0.0, color=style.JOG, lw=0.6, ls=":")
    words = f"a = {a:.4g} {scene.unit}, d = {d:.4g} {scene.unit}"
    style.note(axes, words, (max(a, 0.0), low), (6, 0), va="center", color=style.JOG, gid="measure")
    axes.plot(a, d, zorder=5, gid="centre of mass", **CENTRE)


def _masses(axes: Axes, scene: Scene) -> bool:
    """Draw the masses added to a plate, with their weights as the scene writes them; say whether there are any."""
    points = scene.text["part"]["mass"].get("points", ())
    for k, point in enumerate(points):
        about = np.array([[scene.value(f"part.mass.points[{k}].{axis}") for axis in "xy"]])
        place = turned(about - np.asarray(scene.centre), angle_on_side(scene, 0))[0] + _centre_at(scene)
        axes.plot(*place, zorder=5, gid="added mass", **MASS)
        right = place[0] >= float(scene.sides.a[0])
        shift, align = ((8, 0), "left") if right else ((-8, 0), "right")
        look = {"ha": align, "va": "center", "zorder": 6, "color": style.FLIP, "gid": "mass"}
        style.note(axes, str(point["mass"]), tuple(place.tolist()), shift, **look)
    return bool(points)


# ----------------------------------------------------------------
# One throw: the part in the air, and how it comes to rest (Fig. 3 of the paper).


SHOWN = 3  # outlines in the air, and the same number on the way from the impact to rest
WIDEST, TALLEST, LETTERS = 4.6, 8.0, 11  # of panels beside each other [inches], and letters to an inch
AIR, LANDED = "#0072B2", "#C04A00"
FLYING: dict[str, Any] = {"edgecolor": AIR, "ls": (0, (3, 2))}
STRUCK: dict[str, Any] = {"edgecolor": AIR, "lw": 2.2}
REST: dict[str, Any] = {"edgecolor": style.INK, "lw": 1.6}
VERTEX: dict[str, Any] = {"color": LANDED, "marker": "v", "ls": ""}
SMALL_CENTRE: dict[str, Any] = {"marker": "o", "ms": 4, "mfc": "white", "mec": style.INK}


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
        For a side that the part does not have.

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
        raise _not_thrown(scene, x, side)
    throw, moves = throws[0], motion(scene, throws[0])
    air = _placed(scene, moves.flight(np.linspace(0.0, 1.0, SHOWN + 2)))
    stops = [0.0, 1.0] if moves.turning.drawn else np.linspace(0.0, 1.0, SHOWN + 1)
    rolled = _placed(scene, moves.turning.pose(np.array(stops)))
    everything = np.concatenate([*air, *rolled])
    lo, hi = float(everything[:, 0].min()) - 1.0, float(everything[:, 0].max()) + 1.0
    bottom, top = min(0.0, scene.surface_height), float(everything[:, 1].max())
    figure, (above, below) = _canvas(hi - lo, top - bottom + 1.4)
    for axes in (above, below):
        _arm(axes, scene, lo, hi)
        axes.set(
            aspect="equal",
            xlim=(lo, hi),
            ylim=(bottom - 0.9, top + 0.5),
            xlabel=f"distance from the joint [{scene.unit}]",
            ylabel=f"height over the joint [{scene.unit}]",
        )
        axes.label_outer()  # last: it takes the inner labels away
    _flight(above, scene, throw, moves, air)
    _landing(below, scene, throw, moves, rolled)
    caveat = " (small-angle formulas: the part hangs at its left vertex, whose path they give)"
    handles = [
        Patch(facecolor="#dcdcdc", label="at rest, before and after", **REST),
        Patch(facecolor="#dbebf7", label="in the air", **FLYING),
        Patch(facecolor="#b8d6ed", label="at the impact", **STRUCK),
        style.key("path of the centre of mass", color=style.INK, ls="-.", **SMALL_CENTRE),
        style.key("struck vertex", ms=8, **VERTEX),
        style.key("turning to rest", color=LANDED, ls=":") if len(rolled) > 2 else None,
    ]
    return style.finished(
        figure, f"One throw of {scene.name}{'' if scene.flight == 'exact' else caveat}", handles
    )


def _not_thrown(scene: Scene, x: float, side: int) -> AnswerError:
    """Say why no throw begins, or none ends."""
    least = float(scene.sides.a[side])
    if x <= least:
        allowed = f"more than {least:.6g} on side {side}"
        return AnswerError("x of the throw", x, allowed, "start where a throw lifts the part")
    return AnswerError(  # thrown, and not down again within a full turn
        "the throw",
        f"outside the model, from x = {x:.6g} on side {side}",
        "one that lands within a full turn",
        f"kappa is {scene.kappa:.6g} {scene.unit}: throw more softly, and see whether the speed has the right unit",
    )


def _canvas(width: float, height: float) -> tuple[Figure, list[Axes]]:
    """Make two panels with the same limits: beside each other if the picture is tall, else one above the other."""
    if height > 0.6 * width:
        tall = min(TALLEST, max(3.4, WIDEST * height / width))
        return style.canvas(10.4, tall + 1.6, 1, 2, sharex=True, sharey=True)
    return style.canvas(9.0, 2 * max(1.6, 8.2 * height / width) + 1.9, 2, 1, sharex=True, sharey=True)


def _placed(scene: Scene, poses: Array) -> list[Array]:
    """Outlines in some poses."""
    shape = about_centre(scene, hull=False)
    return [np.array([x, y]) + turned(shape, angle) for x, y, angle in poses.tolist()]


def _arm(axes: Axes, scene: Scene, lo: float, hi: float) -> None:
    h, ends = scene.surface_height, [lo, min(hi, scene.arm_length)]
    axes.plot(ends, [h, h], color=style.INK, lw=2.2, solid_capstyle="butt", zorder=1, gid="arm")
    axes.fill_between(ends, h, h - 0.35, **SOLID)
    if lo <= 0 <= hi:
        axes.plot([0], [0], marker="o", ms=9, mfc="white", mec=style.INK, zorder=2, gid="joint")
    style.open_frame(axes)


def _part(axes: Axes, corners: Array, **look: Any) -> None:
    axes.add_patch(Polygon(corners, closed=True, **look))


def _impact(axes: Axes, moves: Motion, corners: Array, zorder: float) -> None:
    """Draw the part at the impact, and the vertex that strikes."""
    _part(axes, corners, facecolor=(0.72, 0.84, 0.93, 0.8), zorder=zorder, gid="impact", **STRUCK)
    axes.plot(*moves.struck, **VERTEX, ms=9, zorder=7, gid="struck vertex")


def _flight(axes: Axes, scene: Scene, throw: Throw, moves: Motion, air: list[Array]) -> None:
    _part(axes, air[0], facecolor="#dcdcdc", zorder=2, gid="start", **REST)
    for k, corners in enumerate(air[1:-1]):
        # Later outlines partly cover earlier ones, as in a photograph with a strobe.
        look = {"facecolor": (0.86, 0.92, 0.97, 0.72), "lw": 1.0, "zorder": 3 + 0.1 * k, **FLYING}
        _part(axes, corners, gid="in the air", **look)
    _impact(axes, moves, air[-1], zorder=4)
    path, stops = (moves.flight(np.linspace(0.0, 1.0, count)) for count in (80, len(air)))
    axes.plot(path[:, 0], path[:, 1], color=style.INK, lw=1.1, ls="-.", zorder=5, gid="path")
    axes.plot(stops[:, 0], stops[:, 1], ls="", zorder=6, gid="centre of mass", **SMALL_CENTRE)
    start = f"from x = {throw.x:.2f} {scene.unit} on side {throw.side}"
    _head(axes, f"In the air: {start}, turning by {math.degrees(throw.phi):.1f}°")


def _landing(axes: Axes, scene: Scene, throw: Throw, moves: Motion, rolled: list[Array]) -> None:
    before, after, side = throw.side, throw.after, throw.side_after
    _part(axes, rolled[-1], facecolor=(0.86, 0.86, 0.86, 0.85), zorder=2, gid="rest", **REST)
    _impact(axes, moves, rolled[0], zorder=1.5)
    for corners in rolled[1:-1]:
        _part(axes, corners, facecolor="none", edgecolor=LANDED, lw=1.0, ls=":", zorder=3, gid="turning")
    height = scene.surface_height + float(scene.sides.d[side])
    axes.plot(after, height, ls="", zorder=6, gid="centre at rest", **SMALL_CENTRE)
    how = "roll" if throw.code == codes.ROLL else ("flip" if side != before else "jog")
    where = f"onto side {side}" if side != before else f"still on side {side}"
    note = {codes.OUTWARD: "; off the arm's end", codes.INWARD: "; into the joint"}.get(throw.code, "")
    _head(axes, f"After the impact: a {how}, {throw.x:.2f} to {after:.2f} {scene.unit}, {where}{note}")


def _head(axes: Axes, text: str) -> None:
    """Write a title, in lines of phrases as wide as the panel where panels stand beside each other."""
    if axes.get_subplotspec().get_gridspec().ncols > 1:  # type: ignore[union-attr]  # of a grid
        wide = min(WIDEST, TALLEST * float(np.ptp(axes.get_xlim()) / np.ptp(axes.get_ylim())))
        lines: list[str] = []
        for phrase in text.split(", "):
            if lines and len(f"{lines[-1]}, {phrase}") <= LETTERS * wide:
                lines[-1] += f", {phrase}"
            else:
                lines.append(phrase)
        text = ",\n".join(lines)
    axes.set_title(text, fontsize=style.TEXT, loc="left")
