"""An orbit that violates a goal, throw by throw: places of rest, sides, and the forbidden places."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from limitsets.arguments import arguments_checked
from limitsets.errors import AnswerError
from limitsets.goals import Goal, OrientedBeyond, Reaches
from limitsets.maps import orbit as orbit_of
from limitsets.plot import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.scene import Scene

# States that are drawn: the last of them; and throws after an orbit of a single state.
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
        States with "x" and "side", as `limitsets.robust.sheet.entries.Entry` and the JSON of a proof have them.
    violated : Goal, optional
        What it violates.
    name : str
        What deviates, for the title's second line.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    AnswerError
        No states.

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
        after = range(throws[-1], throws[-1] + len(onward) + 1)
        axes.plot(
            after, [x[-1], *(place for place, _ in onward)], color=style.FAINT, lw=0.9, ls=":", zorder=2
        )
        for k, (place, side) in enumerate(onward, start=1):
            axes.plot(throws[-1] + k, place, zorder=3, gid="thrown on", **{**_mark(side), "mfc": "white"})
    seen = [*x, *(place for place, _ in onward)]
    low, high = (
        min(seen),
        max([*seen, *([violated.x] if isinstance(violated, OrientedBeyond | Reaches) else [])]),
    )
    span = max(high - low, 1e-3 * scene.arm_length)
    axes.set_ylim(low - 0.12 * span, high + 0.22 * span)
    areas = _areas(axes, violated, scene.unit)
    if isinstance(violated, OrientedBeyond):
        axes.plot(throws[-1], x[-1], zorder=4, **RING)
        label = f"on side {sides[-1]}, {x[-1] - violated.x:.2g} {scene.unit} beyond"
        areas.append(style.key(label, **RING))
    axes.set_xlabel("throws")
    axes.set_ylabel(f"x at rest [{scene.unit}]")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    at_once = " at once" if len(orbit) == 1 else ""
    style.title(
        figure, f"{scene.name}: an orbit that violates the goal{at_once}" + (f"\n{name}" if name else "")
    )
    marks = [
        style.key(f"on side {side}", **_mark(side)) for side in sorted({*sides, *(s for _, s in onward)})
    ]
    if onward:
        areas.append(
            style.key("thrown on, in the scene as it is", color=style.FAINT, ls=":", marker="o", mfc="white")
        )
    style.legend(figure, [*marks, *areas], 3)
    return figure


def _thrown_on(scene: Scene, x: float, side: int) -> list[tuple[float, int]]:
    """Give the next rests: a single state says nothing of where it comes from."""
    path = orbit_of(scene.map, x, side, ONWARD)
    stays = path.code >= 0
    return [(float(x), int(side)) for x, side in zip(path.x[1:][stays], path.side[1:][stays], strict=True)]


def _areas(axes: Axes, violated: Goal | None, unit: str) -> list[Any]:
    """Shade where only one side is allowed, or where the part should come."""
    if not isinstance(violated, OrientedBeyond | Reaches):
        return []
    at, side, top = violated.x, violated.side, axes.get_ylim()[1]
    forbids = isinstance(violated, OrientedBeyond)
    look = FORBIDDEN if forbids else WANTED
    axes.axhspan(at, top, gid="forbidden" if forbids else "wanted", zorder=0, **look)
    axes.axhline(at, color=style.INK, lw=1.0, zorder=1)
    words = f"only side {side} allowed" if forbids else f"to be reached on side {side}"
    return [Patch(label=f"beyond {at:.6g} {unit}: {words}", **look)]


def _mark(side: int) -> dict[str, Any]:
    colour, marker = COLOURS[side % len(COLOURS)], MARKERS[side % len(MARKERS)]
    return {"color": colour, "marker": marker, "ms": 6.5, "ls": ""}
