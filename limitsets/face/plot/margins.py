"""Margins, proved and refuted, orbits that violate a goal, and an audit as strips along the arm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from limitsets.base import AnswerError, arguments_checked
from limitsets.face.plot import style
from limitsets.feeder.goals import Goal, OrientedBeyond, Reaches
from limitsets.feeder.scene import Scene
from limitsets.feeder.scene.quantities import parsed_deviation
from limitsets.feeder.scene.units import exact_factor
from limitsets.parameters.margins.margin_result import Margin, bound
from limitsets.parameters.margins.single import MarginsBeyond
from limitsets.proofs.auditing import Audit
from limitsets.systems.maps import orbit as orbit_of

SAFE: dict[str, Any] = {"facecolor": "#9BD1B8", "edgecolor": "#2F6B52", "lw": 0.7}
OPEN: dict[str, Any] = {"facecolor": "#F4F4F4", "edgecolor": "#9A9A9A", "hatch": "....", "lw": 0.6}
BOX: dict[str, Any] = {"facecolor": "none", "edgecolor": style.FLIP, "ls": (0, (4, 2)), "lw": 1.2}
FAILS: dict[str, Any] = {"color": style.FLIP, "marker": "D", "ms": 5.0, "ls": "none"}
READINGS = {"fixed": "", "per-throw": ", every throw"}
# Right ends of the two columns of numbers, from the axes [points], and how a number stands there.
COLUMNS = (66, 138)
NUMBER: dict[str, Any] = {
    "xycoords": ("axes fraction", "data"),
    "ha": "right",
    "va": "center",
    "annotation_clip": False,
    "gid": "number",
}


def _percent(margin: Margin, size: float) -> tuple[float, str]:
    """Give a size in percent, and the words for its reference."""
    if margin.unit == "%":
        return size, ""
    if margin.nominal:
        return 100.0 * size / abs(margin.nominal), ""
    length = 100.0 * size * float(exact_factor(margin.unit, margin.scene.unit))
    return length / float(margin.scene.sides.length.min()), " (of the shortest side)"


@arguments_checked
def tornado(margins: Sequence[Margin]) -> Figure:
    """Draw the margins of single quantities, the smallest on top, as percent of the value; beside them the numbers.

    Parameters
    ----------
    margins : sequence of Margin
        From `limitsets.margin`; joint margins are left out.

    Returns
    -------
    matplotlib.figure.Figure

    Examples
    --------
    >>> import limitsets as ls
    >>> figure = ls.plot.tornado(ls.margin("paper-designed", "throw.speed", "arm.surface_height", width=0.5))
    >>> [label.get_text() for label in figure.axes[0].get_yticklabels()]
    ['throw.speed', 'arm.surface_height']
    """
    single = [each for each in margins if each.quantity != "joint"]
    single.sort(key=lambda each: _percent(each, each.proved)[0])
    figure, (axes,) = style.canvas(8.4, 0.36 * max(len(single), 2) + 1.8)
    known = [_percent(each, size)[0] for each in single for size in (each.proved, each.refuted) if size]
    low, high = (min(known) / 3.0, max(known) * 1.6) if known else (0.1, 100.0)
    for row, each in enumerate(single):
        _bar(axes, each, row, low, high)
    for at, words in zip(COLUMNS, ("safe up to", "fails from"), strict=True):
        _beside(axes, at, -0.75, words)
    names = [each.quantity + READINGS[each.reading] + _percent(each, 0.0)[1] for each in single]
    style.lanes(axes, dict(enumerate(names)))
    below = "deviation to either side [% of the value], logarithmic"
    axes.set(ylim=(len(single) - 0.4, -0.6), xscale="log", xlim=(low, high), xlabel=below)
    axes.xaxis.set_major_formatter("{x:g}")
    handles = [
        Patch(label="proved safe", **SAFE),
        style.key("shown to fail from here", **FAILS),
        Patch(label="nothing is shown", **OPEN)
        if any(each.refuted is None or not each.closed for each in single)
        else None,
    ]
    name = single[0].scene.name if single else "margins"
    return style.finished(figure, f"{name}: how much each quantity may deviate", handles)


def _bar(axes: Axes, margin: Margin, row: int, low: float, high: float) -> None:
    """Draw one margin; if no upper end is known, the rest of the axis stays empty."""
    proved = max(_percent(margin, margin.proved)[0], low)
    end = high if margin.refuted is None else max(_percent(margin, margin.refuted)[0], low)
    axes.barh(row, end - proved, left=proved, height=0.62, gid="open", zorder=1, **OPEN)
    axes.barh(row, proved - low, left=low, height=0.62, gid="proved", zorder=2, **SAFE)
    if margin.refuted is not None:
        axes.plot([end], [row], gid="refuted", zorder=3, **FAILS)
    for at, size, up in zip(COLUMNS, (margin.proved, margin.refuted), (False, True), strict=True):
        _beside(axes, at, row, bound(size, margin.unit, up=up))


def _beside(axes: Axes, at: int, row: float, words: str) -> None:
    """Write into a column to the right of the axes."""
    style.note(axes, words, (1.0, row), (at, 0), **NUMBER)


@arguments_checked
def margin_curve(found: MarginsBeyond) -> Figure:
    """Draw margins against X: between the lines lies the sharp one.

    Parameters
    ----------
    found : MarginsBeyond
        From `limitsets.parameters.margins.single.margins_beyond`.

    Returns
    -------
    matplotlib.figure.Figure
        One panel per quantity.
    """
    figure, panels = style.canvas(6.4, 2.5 * len(found.names) + 0.9, len(found.names), 1, sharex=True)
    for k, (axes, name, unit) in enumerate(zip(panels, found.names, found.units, strict=True)):
        proved, refuted = found.proved[:, k], found.refuted[:, k]
        axes.fill_between(found.x, 0.0, proved, color="#CFE8DC", gid="proved", zorder=1)
        axes.plot(found.x, proved, "o-", color="#2F6B52", ms=3.5, lw=1.3, label="proved safe", zorder=3)
        axes.plot(found.x, refuted, "D--", color=style.FLIP, ms=3.5, lw=1.1, label="shown to fail", zorder=2)
        best, top = found.best(name)
        axes.axvline(best, color=style.FAINT, lw=0.9, ls=":")
        style.note(axes, f"best: X = {best:.4g} {found.scene.unit}", (best, 0.0), (5, 6))
        most = 1.12 * max(float(np.nanmax([*refuted, top])), 1e-12)
        measure = f"{name} [{unit or 'times the tolerance'}]"
        style.panel(axes, legend="" if k else "upper right", ylabel=measure, ylim=(0.0, most))
    panels[-1].set_xlabel(f"X, beyond which only side {found.side} [{found.scene.unit}]", fontsize=style.TEXT)
    return style.finished(figure, f"{found.scene.name}: margins against X")


@arguments_checked
def tolerance_box(margin: Margin) -> Figure:
    """Draw a joint margin: what each quantity may do together with all others, proved and refuted.

    Parameters
    ----------
    margin : Margin
        Of "joint".

    Returns
    -------
    matplotlib.figure.Figure
        A bar for each quantity, as far as it is proved, in the box that is refuted.

    Raises
    ------
    AnswerError
        For a margin of one quantity.
    """
    if margin.quantity != "joint":
        raise AnswerError("the margin", margin.quantity, "a joint one", "draw others with plot.tornado")
    texts = margin.tolerance
    figure, (axes,) = style.canvas(6.8, 0.4 * len(texts) + 1.6)
    for row, (name, text) in enumerate(texts.items()):
        given = parsed_deviation(text, name)
        size, unit = float(given.number), given.unit
        axes.barh(row, 2 * margin.proved, left=-margin.proved, height=0.6, gid="proved", zorder=2, **SAFE)
        words = f"± {bound(margin.proved * size, unit)}" + (", every throw" if name == "landing.x" else "")
        axes.annotate(words, (0, row), ha="center", va="center", fontsize=style.SMALL, zorder=4)
    style.lanes(axes, dict(enumerate(texts)))
    wide = 1.1 * max(margin.proved, margin.refuted or 0.0, 1e-9)
    below = "deviation as a factor of the tolerance"
    axes.set(xlim=(-wide, wide), ylim=(len(texts) - 0.3, -0.7), xlabel=below)
    handles = [Patch(label="proved safe, all at once", **SAFE)]
    if margin.refuted is not None:
        high, middle = margin.refuted, 0.5 * (len(texts) - 1)
        axes.barh(middle, 2 * high, left=-high, height=len(texts), gid="refuted", zorder=1, **BOX)
        handles.append(Patch(label="somewhere in this larger box it fails", **BOX))
    return style.finished(figure, f"{margin.scene.name}: all quantities together", handles, 2)


# ----------------------------------------------------------------
# An orbit that violates a goal, throw by throw: places of rest, sides, and the forbidden places.


# States that are drawn: the last ones; and throws that continue an orbit of a single state.
LAST, ONWARD = 40, 12

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "h")
COLOURS = (style.JOG, style.FLIP, style.GOAL, style.ROLL, "#8A6D00", style.INK)
FORBIDDEN: dict[str, Any] = {"facecolor": "#F6E3D9", "edgecolor": "#C9A28C", "hatch": "////", "lw": 0.0}
WANTED: dict[str, Any] = {"facecolor": "#E0F0E9", "edgecolor": "#9BC4B2", "hatch": "...", "lw": 0.0}

RING: dict[str, Any] = {"ls": "", "marker": "o", "ms": 14, "mfc": "none", "mec": style.FLIP, "mew": 1.6}


@arguments_checked
def counterexample(
    scene: Scene,
    orbit: Sequence[Mapping[str, Any]],
    violated: Goal | None = None,
    name: str = "",
) -> Figure:
    """Draw an orbit that violates a goal: x after each throw, the side by marker and colour.

    Parameters
    ----------
    scene : Scene
        The scene.
    orbit : sequence of mapping
        States with "x" and "side", as `Margin.orbit` and the JSON of a proof have them.
    violated : Goal, optional
        The goal that the orbit violates.
    name : str
        The deviating quantity, for the second line of the title.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    AnswerError
        The orbit has no states.

    Examples
    --------
    >>> import limitsets as ls
    >>> orbit = [{"x": 17.3, "side": 2}, {"x": 20.1, "side": 0}]
    >>> scene = ls.load("paper-designed")
    >>> figure = counterexample(scene, orbit, scene.goal)
    >>> [patch.get_gid() for patch in figure.axes[0].patches]
    ['forbidden']
    """
    if not orbit:
        raise AnswerError("the orbit", "empty", "states with x and side", "draw one that refutes something")
    first = max(len(orbit) - LAST, 0)
    x = [float(state["x"]) for state in orbit[first:]]
    sides = [int(state["side"]) for state in orbit[first:]]
    throws = range(first, first + len(x))
    onward = _thrown_on(scene, x[-1], sides[-1]) if len(x) == 1 else ()
    figure, (axes,) = style.canvas(8.0, 4.2)
    axes.plot(throws, x, color=style.FAINT, lw=0.9, zorder=2)
    for side in sorted(set(sides)):
        mine = [k for k, on in enumerate(sides) if on == side]
        axes.plot([throws[k] for k in mine], [x[k] for k in mine], zorder=3, **_mark(side))
    if onward:
        places = [x[-1], *(place for place, _ in onward)]
        after = range(throws[-1], throws[-1] + len(places))
        axes.plot(after, places, color=style.FAINT, lw=0.9, ls=":", zorder=2)
        for k, (place, side) in enumerate(onward, start=1):
            axes.plot(throws[-1] + k, place, zorder=3, gid="thrown on", **{**_mark(side), "mfc": "white"})
    heights = [*x, *(place for place, _ in onward)]
    goal = [violated.x] if isinstance(violated, OrientedBeyond | Reaches) else []
    low, high = min(heights), max([*heights, *goal])
    span = max(high - low, 1e-3 * scene.arm_length)
    limits = low - 0.12 * span, high + 0.22 * span
    axes.set(xlabel="throws", ylabel=f"x at rest [{scene.unit}]", ylim=limits)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    handles = [
        *(style.key(f"on side {side}", **_mark(side)) for side in sorted({*sides, *(s for _, s in onward)})),
        _area(axes, violated, scene.unit),
    ]
    if isinstance(violated, OrientedBeyond):
        axes.plot(throws[-1], x[-1], zorder=4, **RING)
        label = f"on side {sides[-1]}, {x[-1] - violated.x:.2g} {scene.unit} beyond"
        handles.append(style.key(label, **RING))
    if onward:
        handles.append(
            style.key("thrown on, in the scene as it is", color=style.FAINT, ls=":", marker="o", mfc="white")
        )
    words = f"{scene.name}: an orbit that violates the goal{' at once' * (len(orbit) == 1)}"
    return style.finished(figure, f"{words}\n{name}" if name else words, handles)


def _thrown_on(scene: Scene, x: float, side: int) -> list[tuple[float, int]]:
    """Give the next places of rest, for an orbit of a single state."""
    path = orbit_of(scene.map, x, side, ONWARD)
    stays = path.code >= 0
    return [(float(x), int(side)) for x, side in zip(path.x[1:][stays], path.side[1:][stays], strict=True)]


def _area(axes: Axes, violated: Goal | None, unit: str) -> Patch | None:
    """Shade the places at which only one side is allowed, or to which the part should come; give the entry."""
    if not isinstance(violated, OrientedBeyond | Reaches):
        return None
    at, side, top = violated.x, violated.side, axes.get_ylim()[1]
    forbids = isinstance(violated, OrientedBeyond)
    look = FORBIDDEN if forbids else WANTED
    axes.axhspan(at, top, gid="forbidden" if forbids else "wanted", zorder=0, **look)
    axes.axhline(at, color=style.INK, lw=1.0, zorder=1)
    words = f"only side {side} allowed" if forbids else f"to be reached on side {side}"
    return Patch(label=f"beyond {at:.6g} {unit}: {words}", **look)


def _mark(side: int) -> dict[str, Any]:
    colour, marker = COLOURS[side % len(COLOURS)], MARKERS[side % len(MARKERS)]
    return {"color": colour, "marker": marker, "ms": 6.5, "ls": ""}


# ----------------------------------------------------------------
# An audit as strips along the arm: places where each assumption of the model holds or breaks.


HALF = 0.36  # half the height of a strip; the distance of strips is 1
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
    names = {row: finding.about.name for row, finding in enumerate(rows)}
    for side, axes in enumerate(panels):
        reach = float(scene.sides.a[side]), scene.arm_length
        for row, finding in enumerate(rows):
            gid, look = ("cannot tell", UNKNOWN) if finding.missing else ("holds", HOLDS)
            style.bars(axes, [reach], row, HALF, gid=gid, zorder=2, **look)
            style.bars(axes, finding.ranges.get(side, ()), row, HALF, gid="broken", zorder=2, **BROKEN)
        for lo, hi in found.extents.get(side, ()):
            axes.axvspan(lo, hi, facecolor="none", edgecolor=style.JOG, lw=1.4, zorder=3, gid="limit set")
        axes.set_title(f"on side {side}", loc="left", fontsize=style.TEXT)
        axes.set(xlim=(0.0, scene.arm_length), ylim=(len(rows) - 0.4, -0.6))
        style.lanes(axes, names)
    missing = any(finding.missing for finding in rows)
    border = style.key("between these lines: the limit set", color=style.JOG, lw=1.4)
    handles = [
        Patch(label="holds", **HOLDS),
        Patch(label="breaks", **BROKEN),
        Patch(label="cannot tell: a fact is missing", **UNKNOWN) if missing else None,
        border if found.extents else None,
    ]
    words = f"{scene.name}: what the minimal model assumes, and where that breaks"
    return style.finished(figure, words, handles, 4)
