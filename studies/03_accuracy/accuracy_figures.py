"""The study's figures: error against seconds, both logarithmic, a point per setting."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from accuracy_points import Point, by_method, exponent
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

__all__ = ["label_of", "long_run_figure", "set_figure", "throw_figure"]

# After Okabe and Ito, with a marker each, so that grey prints tell them apart.
LOOKS = [
    ("#0072B2", "o"),
    ("#D55E00", "s"),
    ("#009E73", "^"),
    ("#CC79A7", "D"),
    ("#222222", "v"),
    ("#56B4E9", "P"),
    ("#B58900", "X"),
    ("#7F3C8D", "h"),
    ("#888888", "<"),
    ("#4C6A00", ">"),
]
TEXT, SMALL = 12, 10.5
# The two small-angle flights are alike: the first shows behind the second.
BEHIND = "small angle (the paper)"
# Below this, in doubles, an error is what rounding leaves and no exponent is fitted.
ROUNDING = 1e-7
# Fixed costs hide the exponent in time: points within this factor of the fastest one are not fitted.
FIXED = 3.0


def label_of(points: list[Point], what: str | None) -> str:
    """Name of a method with its fitted exponents: in its size, and in time beyond its fixed costs."""
    name = points[0].method
    known = [point for point in points if point.error > ROUNDING]
    slope = exponent(known) if what else None
    if slope is None:
        return name
    label = f"{name}: {what}$^{{{slope:.2f}}}$"
    least = min(point.seconds for point in known)
    late = exponent([point for point in known if point.seconds > FIXED * least], "seconds")
    return label if late is None else f"{label}, t$^{{{late:.2f}}}$"


def _decades(values: list[float]) -> tuple[float, float]:
    """Limits at whole powers of ten, and a little beyond: an axis with one label says nothing."""
    low, high = math.floor(math.log10(0.9 * min(values))), math.ceil(math.log10(1.1 * max(values)))
    edge = 0.03 * (high - low)
    return 10.0 ** (low - edge), 10.0 ** (high + edge)


def _draw(axes: Any, points: list[Point], looks: dict[str, tuple[str, str]]) -> None:
    for name, some in by_method(points).items():
        colour, marker = looks[name]
        x, y = [point.seconds for point in some], [max(point.error, 1e-300) for point in some]
        axes.plot(
            x,
            y,
            color=colour,
            marker=marker,
            markersize=10 if name == BEHIND else 6.5,
            linewidth=1.4,
            markeredgecolor="white",
            markeredgewidth=0.5,
        )
    axes.set(xscale="log", yscale="log")
    axes.set_xlim(*_decades([point.seconds for point in points]))
    axes.set_ylim(*_decades([point.error for point in points]))
    axes.grid(alpha=0.25, which="major")
    axes.tick_params(labelsize=SMALL)
    axes.xaxis.set_minor_locator(LogLocator(subs=(2, 5), numticks=20))
    axes.xaxis.set_minor_formatter(NullFormatter())


def _looks(points: list[Point]) -> dict[str, tuple[str, str]]:
    names = list(by_method(points))
    return {name: LOOKS[k % len(LOOKS)] for k, name in enumerate(names)}


def _handles(points: list[Point], looks: dict[str, tuple[str, str]], sizes: dict[str, str]) -> list[Line2D]:
    return [
        Line2D([], [], color=looks[name][0], marker=looks[name][1], label=label_of(some, sizes.get(name)))
        for name, some in by_method(points).items()
    ]


def throw_figure(throws: list[Point], critical: list[Point], ratios: Any, unit: str) -> Figure:
    """One throw: error of x', error of the critical points, and the small-angle model's error over random parts."""
    figure = Figure(figsize=(17.0, 6.6), layout="constrained")
    one, two, three = figure.subplots(1, 3)
    looks = _looks(throws + critical)
    _draw(one, throws, looks)
    one.set_xlabel("seconds per throw", fontsize=TEXT)
    one.set_ylabel(f"largest error of x after the throw [{unit}]", fontsize=TEXT)
    one.set_title("One throw", loc="left", fontsize=TEXT + 1)
    _draw(two, critical, looks)
    two.set_xlabel("seconds for the three sides", fontsize=TEXT)
    two.set_ylabel(f"largest error of a critical point $r_i$ [{unit}]", fontsize=TEXT)
    two.set_title("Critical points", loc="left", fontsize=TEXT + 1)
    low, middle, high = np.quantile(ratios, (0.05, 0.5, 0.95))
    three.hist(ratios, bins=np.linspace(0.2, 1.2, 51), color="#9DC3DC", edgecolor="white", linewidth=0.4)
    three.axvspan(low, high, color="#F2C14E", alpha=0.25, zorder=0)
    three.axvline(middle, color="#222222")
    top = three.get_ylim()[1]
    three.set_ylim(0, top * 1.12)
    three.text(middle + 0.02, top * 1.03, f"median {middle:.2f}", fontsize=SMALL)
    three.text(high + 0.02, top * 0.93, f"5 to 95 %:\n{low:.2f} to {high:.2f}", fontsize=SMALL, va="top")
    three.set_xlabel("critical point: small angle / exact", fontsize=TEXT)
    three.set_ylabel("sides of random parts", fontsize=TEXT)
    three.tick_params(labelsize=SMALL)
    three.set_title("What small angles leave out", loc="left", fontsize=TEXT + 1)
    handles = _handles(throws, looks, {})
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=SMALL, frameon=False)
    return figure


def set_figure(points: list[Point], unit: str, sizes: dict[str, str]) -> Figure:
    """Hausdorff error of the limit set against seconds."""
    figure = Figure(figsize=(12.5, 6.8), layout="constrained")
    axes = figure.subplots()
    looks = _looks(points)
    _draw(axes, points, looks)
    axes.set_xlabel("seconds", fontsize=TEXT)
    axes.set_ylabel(f"Hausdorff distance from the limit set [{unit}]", fontsize=TEXT)
    handles = _handles(points, looks, sizes)
    figure.legend(
        handles=handles,
        loc="outside right upper",
        fontsize=SMALL,
        frameon=False,
        title="error falls as",
        title_fontsize=SMALL,
    )
    return figure


def long_run_figure(panels: dict[str, tuple[str, list[Point]]], sizes: dict[str, str]) -> Figure:
    """Basins, densities and exponents: a panel each, with its own legend of exponents."""
    figure = Figure(figsize=(17.0, 11.5), layout="constrained")
    looks = _looks([point for _, points in panels.values() for point in points])
    for axes, (title, (ylabel, points)) in zip(figure.subplots(2, 3).ravel(), panels.items(), strict=True):
        _draw(axes, points, looks)
        axes.set_title(title, loc="left", fontsize=TEXT)
        axes.set_xlabel("seconds", fontsize=TEXT)
        axes.set_ylabel(ylabel, fontsize=TEXT)
        handles = _handles(points, looks, sizes)
        axes.legend(
            handles=handles,
            loc="upper center",
            bbox_to_anchor=(0.5, -0.13),
            fontsize=SMALL,
            frameon=False,
            ncols=1,
        )
    return figure
