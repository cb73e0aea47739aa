"""Trays in pictures: how a part lies in a depression, how depressions fill, what a kick does, what is remembered."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from limitsets.base import arguments_checked
from limitsets.base.arrays import Array
from limitsets.cell.trays import TrayFill
from limitsets.face.plot import style
from limitsets.face.plot.throwing import about_centre, turned
from limitsets.feeder.engine.depression import Pose
from limitsets.parameters.noise.sampling import binomial_interval

# Marks on a curve at each pass, for so many passes at most.
MARKS = 9


@arguments_checked
def tray(found: TrayFill) -> Figure:
    """Draw how a tray's depressions fill.

    Parameters
    ----------
    found : TrayFill
        From `limitsets.tray`.

    Returns
    -------
    matplotlib.figure.Figure
        Parts in a depression as they came to lie, one of each state; the fraction filled rightly against passes, by the
        chain with its interval, in histories and of many parts at once, if there are any; what a part that comes by
        leaves, and what endless passes; captures after misses and releases after kicks that were stood, or without
        histories what a kick leaves.
    """
    figure, frames = style.canvas(10.4, 7.6, 2, 2)
    last = _memory if found.histories else _kicks
    for axes, draw in zip(frames, (_poses, _curve, _shares, last), strict=True):
        draw(axes, found)
    sizes, unit = found.passes.tray, found.scene.unit
    depth, kick = sizes.depression_depth, sizes.agitation
    words = (
        f"side {found.passes.side} wanted, depressions {depth:.4g} {unit} deep, agitation {kick:.4g} {unit}"
    )
    return style.finished(figure, f"{found.scene.name}: {words}")


def _short(state: str) -> str:
    """Shorten a state's name to fit beside a bar."""
    return state.replace("leaning, vertex ", "leaning, P").replace(" lowest", "")


def _placed(filling: TrayFill, pose: Pose, share: float = 1.0) -> Array:
    """Places of the vertices, or of points between the centre of mass and the vertices."""
    corners: Array = turned(share * about_centre(filling.scene), pose.angle) + np.array([pose.x, pose.y])
    return corners


def _poses(axes: Axes, filling: TrayFill) -> None:
    """Draw a depression for each state, one below the other in two columns, with a part in it."""
    plate, counts = filling.passes.plate, filling.counts
    wide, tall = 2.0 * plate.size, 1.35 * plate.size
    for number, state in enumerate(counts.met):
        column, row = number % 2, number // 2
        at = np.array([column * wide, -row * tall])
        half, edge = 0.5 * plate.width, 0.46 * wide
        square = [(0.0, 0.0), (0.0, -plate.depth), (2 * half, -plate.depth), (2 * half, 0.0)]
        line = [
            (-edge, 0.0),
            *((x - half, y) for x, y in plate.outline or square),
            (edge, 0.0),
        ]
        axes.plot(*(np.array(line) + at).T, color=style.INK, lw=1.4)
        good = state == counts.right
        look = {"fc": "#9BD1B8", "ec": style.GOAL} if good else {"fc": "none", "ec": style.FLIP}
        pose = counts.poses[state]
        axes.add_patch(Polygon(_placed(filling, pose) + at, closed=True, lw=1.3, **look))
        for k, (x, y) in enumerate(_placed(filling, pose, 0.55) + at):
            axes.text(x, y, f"P{k}", fontsize=6.5, ha="center", va="center", color=style.FAINT)
        words = f"{_short(counts.states[state])}{': right' if good else ''}"
        axes.text(at[0] - edge, at[1] - plate.depth - 0.1 * tall, words, fontsize=style.SMALL, va="top")
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_axis_off()
    axes.set_title("as parts came to lie, one of each state", loc="left", fontsize=style.TEXT)


def _curve(axes: Axes, filling: TrayFill) -> None:
    filled = filling.filled
    passes = np.arange(filled.right.size)
    axes.fill_between(passes, *filled.interval.T, color="#9BD1B8", alpha=0.5, lw=0)
    axes.plot(passes, filled.right, color=style.GOAL, lw=1.5, label="chain, with its 95 % interval")
    places = np.unique(np.geomspace(1, passes[-1], MARKS).round().astype(int))
    looks = {False: ("o", style.INK, "a new part each pass"), True: ("s", style.FLIP, "parts return")}
    for each in filling.histories:
        marker, colour, words = looks[each.returning]
        shares, ends = each.filled[places], np.array([each.interval(int(k)) for k in places])
        look = {"marker": marker, "color": colour, "label": f"{each.after_pass.shape[0]} histories: {words}"}
        _with_ends(axes, places * (1.06 if each.returning else 1.0), shares, ends, ms=4, **look)
    _crowds(axes, filling, places)
    axes.set_xscale("symlog", linthresh=1.0)
    axes.xaxis.set_major_formatter("{x:g}")
    style.panel(
        axes,
        "filled rightly",
        legend="upper left",
        xlim=(0.0, 1.3 * passes[-1]),
        ylim=(0.0, 1.0),
        xlabel="passes",
        ylabel="fraction of the depressions",
    )


def _with_ends(axes: Axes, x: NDArray[Any], shares: Array, ends: Array, **look: Any) -> None:
    """Draw shares with the ends of their intervals, shape (n, 2)."""
    axes.errorbar(x, shares, np.abs(ends - shares[:, None]).T, ls="", lw=0.9, **look)


def _crowds(axes: Axes, filling: TrayFill, places: NDArray[np.intp]) -> None:
    """Draw trays with many parts at once beside the chain of single parts, if they were asked for."""
    chain = filling.crowd_chain
    if chain is not None and not np.array_equal(chain.right, filling.filled.right):
        words = (
            f"chain, {filling.crowds[0].parts / filling.crowds[0].depressions:g} parts a pass and depression"
        )
        axes.plot(np.arange(chain.right.size), chain.right, color=style.GOAL, lw=1.2, ls="--", label=words)
    for crowd in filling.crowds:
        colour, shift = (style.ROLL, 0.96) if crowd.between else (style.JOG, 1.04)
        how = "push" if crowd.between else "pass through"
        words = f"{crowd.parts} at once that {how} each other"
        shown = [(crowd.right, colour, words)]
        if crowd.between:
            shown.append((crowd.right + crowd.covered, "white", "the same, also under others"))
        for counts, face, label in shown:
            shares, ends = (each[places] for each in crowd.share(counts))
            _with_ends(
                axes, places * shift, shares, ends, marker="^", ms=4.5, color=colour, mfc=face, label=label
            )


def _shares(axes: Axes, filling: TrayFill) -> None:
    counts, filled = filling.counts, filling.filled
    numbers = np.array([0, *counts.met])
    of = int(counts.captured.sum())
    first = counts.captured[numbers] / of
    ends = np.array([binomial_interval(int(counts.captured[k]), of) for k in numbers])
    at = np.arange(numbers.size)[::-1]
    for shift, shares, edges, look, words in (
        (0.2, first, ends, style.of_set(4), "of parts that come by"),
        (-0.2, filled.last, filled.last_interval, style.of_set(0), "of depressions, after endless passes"),
    ):
        bars = np.abs(edges - shares[:, None]).T
        axes.barh(at + shift, shares, 0.38, xerr=bars, label=words, error_kw={"lw": 0.9}, **look)
    axes.set_yticks(at, [_short(name) for name in filled.states], fontsize=style.SMALL)
    axes.get_yticklabels()[filled.number].set(color=style.GOAL, fontweight="bold")
    title = "what is left in the depression (bold: right)"
    style.panel(axes, title, legend="best", xlim=(0.0, None), xlabel="share")


def _kicks(axes: Axes, filling: TrayFill) -> None:
    counts = filling.counts
    numbers = [0, *counts.met]
    shares = counts.kicked[np.ix_(counts.met, numbers)].astype(float)
    shares /= shares.sum(axis=1, keepdims=True)
    axes.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for (row, column), share in np.ndenumerate(shares):
        colour = "white" if share > 0.6 else style.INK
        axes.text(column, row, f"{share:.2f}", fontsize=style.SMALL, ha="center", va="center", color=colour)
    for axis, states in ((axes.xaxis, numbers), (axes.yaxis, counts.met)):
        names = [_short(counts.states[k]) for k in states]
        axis.set_ticks(range(len(names)), names, fontsize=style.SMALL)
    axes.set_title("what one kick leaves (rows: before)", loc="left", fontsize=style.TEXT)
    axes.tick_params(axis="x", rotation=35)


def _memory(axes: Axes, filling: TrayFill) -> None:
    rows = [("captured rightly\nafter misses", "captures"), ("released\nafter kicks it stood", "releases")]
    names, height = {}, 0.0
    for title, method in rows:
        for past, words in enumerate(("0", "1", "2 or more")):
            for each in filling.histories:
                count, of = getattr(each, method)()[past]
                share = count / of if of else math.nan
                low, high = binomial_interval(count, of) if of else (0.0, 1.0)
                marker, colour = ("s", style.FLIP) if each.returning else ("o", style.INK)
                at = height - (0.14 if each.returning else -0.14)
                bars = np.array([[share - low], [high - share]])
                axes.errorbar([share], [at], xerr=bars, marker=marker, ms=4.5, lw=1.0, color=colour)
            names[height] = words if past else f"{title}: {words}"
            height -= 1.0
        height -= 0.5
    axes.set_yticks(list(names), list(names.values()), fontsize=style.SMALL)
    title = "does it forget? dots: new parts, squares: parts return"
    style.panel(axes, title, xlim=(0.0, None), xlabel="share in the histories, with 95 % interval")
