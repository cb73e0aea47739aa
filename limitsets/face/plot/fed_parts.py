"""Feeding and assembly in pictures: parts that tip into the cavity, their fates, and pairs that lie in it."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Polygon

from limitsets.base import arguments_checked
from limitsets.cell.assembly import Assembly
from limitsets.cell.assembly.assembly_run import OUTCOMES, rate_of
from limitsets.cell.feeding import Feeding
from limitsets.cell.feeding.falling import FATES, tipping_times
from limitsets.face.plot import style
from limitsets.face.plot.throwing import outline, turned
from limitsets.feeder.engine import Recording

LOOKS: dict[str, dict[str, Any]] = {
    "right": {"color": style.GOAL, "ls": "-"},
    "wrong": {"color": style.FLIP, "ls": style.FLIP_LINE},
    "wall": {"color": style.ROLL, "ls": style.ROLL_LINE},
    "edge": {"color": style.INK, "ls": (0, (5, 1.5, 1, 1.5))},
    "left": {"color": style.JOG, "ls": (0, (1, 1.5))},
}
WORDS_OF_FATES = {
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
    panels = [_cavity, _throws_until_fed]
    if scene.gravity is not None:
        panels.insert(1, _tipping)
    if found.curve is not None:
        panels.append(_levels)
    figure, frames = style.panels(len(panels), 2, (4.8, 3.6), (0.0, 0.3))
    for draw, axes in zip(panels, frames, strict=True):
        draw(axes, found)
    words = f"side {found.end.side} wanted beyond x = {found.end.x:g} {scene.unit}"
    return style.finished(figure, f"{scene.name}: {words}")


def _cavity(axes: Axes, answer: Feeding) -> None:
    scene = answer.end.scene
    cavity = scene.cavity
    assert cavity is not None  # `feed` refuses a scene without a cavity
    axes.plot(*zip((-8.0, 0.0), *cavity.line, strict=True), color=style.INK, lw=1.6)
    a, d = (float(of_sides[answer.end.side]) for of_sides in (scene.sides.a, scene.sides.d))
    about_end = outline(scene, answer.end.side) + np.array([0.25 * a, d])
    for share, alpha in ((0.0, 1.0), (0.5, 0.6), (1.0, 1.0)):
        corners = turned(about_end, -share * cavity.angle)
        axes.add_patch(Polygon(corners, closed=True, fill=False, ec=style.JOG, lw=1.1, alpha=alpha))
    axes.set_aspect("equal")
    axes.autoscale_view()
    style.panel(axes, "a part tips over the end", xlabel=f"beyond the end [{scene.unit}]")


def _tipping(axes: Axes, answer: Feeding) -> None:
    scene, side = answer.end.scene, answer.end.side
    most = min(float(scene.sides.a[side]), scene.arm_length - answer.end.x)
    e = np.geomspace(1e-6 * most, most, 300)
    axes.plot(e, tipping_times(scene, side)(e), color=style.INK, lw=1.3)
    rate = scene.world.throw_rate
    if rate is not None:
        axes.axhline(1.0 / rate, color=style.FLIP, lw=1.1, ls=style.FLIP_LINE)
        style.note(axes, f"next throw, {rate:g} Hz", (float(e[0]), 1.0 / rate), (2, 3), color=style.FLIP)
    for lo, hi in answer.end.clear:
        axes.axvspan(max(lo, float(e[0])), hi, color="#9BD1B8", alpha=0.4, lw=0)
    axes.set(xscale="log", ylim=(0.0, None))
    begins = "from rest" if scene.cavity is not None and scene.cavity.tips == "rest" else "as it comes down"
    below = f"comes down beyond the end by [{scene.unit}]"
    style.panel(axes, f"time to tip, {begins} (shaded: clear)", xlabel=below, ylabel="time [s]")


def _throws_until_fed(axes: Axes, answer: Feeding) -> None:
    rows = answer.shares.by_throw
    last = (answer.shares.quantile(0.999) or rows.shape[0]) + 2
    number = np.arange(1, min(last, rows.shape[0]) + 1)
    for column, name in enumerate(FATES[:-1]):
        total = np.cumsum(rows[:, column])[: number.size]
        if total.size and total[-1] > 0.0:
            label = f"{WORDS_OF_FATES[name]}: {100 * answer.shares.shares[name]:.3g} %"
            axes.step(number, total, where="post", lw=1.3, label=label, **LOOKS[name])
    axes.set_ylim(0.0, 1.4 * axes.get_ylim()[1])  # room for the legend over the steps
    style.panel(
        axes,
        f"fates of {answer.trials.fate.size} parts",
        legend="upper left" if axes.lines else "",  # no throw if all parts stay
        xlabel="throws",
        ylabel="share of random starts",
        yticks=[tick for tick in axes.get_yticks() if tick <= 1.0],
    )


def _levels(axes: Axes, answer: Feeding) -> None:
    curve = answer.curve
    assert curve is not None
    axes.plot(curve.factors, curve.right, color=style.INK, marker="o", ms=3.5, lw=1.3)
    axes.axhline(curve.wanted, color=style.GOAL, lw=1.0, ls=(0, (4, 2)), label=f"{100 * curve.wanted:g} %")
    if curve.level is not None and curve.level[1] > 0.0:
        axes.axvline(sum(curve.level) / 2, color=style.GOAL, lw=1.0, ls=(0, (1, 1.5)))
    style.panel(
        axes,
        "right feeds against the noise",
        legend="lower left",
        xlabel="noise, in multiples of the one given",
        ylim=(0.0, 1.03),
    )


# ----------------------------------------------------------------
# Pairs of parts in pictures: how many are assembled, how the others fail, and one case of each.


WORDS_OF_PAIRS = {
    "assembled": "assembled",
    "ejected": "out of the cavity again",
    "order": "second part below",
    "wrong": "wrong orientation",
    "wall": "stuck at the wall",
    "edge": "thrown at the end (assumed)",
    "left": "left the arm",
    "never": "still on the arm",
    "unfinished": "still in motion",
}
PARTS: tuple[tuple[str, dict[str, Any]], ...] = (  # face, edge
    ("#9CC7E4", {"ec": style.JOG, "ls": "-"}),
    ("#F3C9A8", {"ec": style.FLIP, "ls": style.FLIP_LINE}),
)
GHOSTS = 3  # poses on the way to rest


@arguments_checked
def assembly(found: Assembly) -> Figure:
    """Draw what became of pairs of parts.

    Parameters
    ----------
    found : Assembly
        From `limitsets.assemble`.

    Returns
    -------
    matplotlib.figure.Figure
        Shares of the outcomes with their intervals; with contact one case of each outcome:
        both parts at rest, and faintly on their way in the last throw; without, the throws until each part is fed.
    """
    cases = [name for name in OUTCOMES if found.contact != "none" and found.example(name) is not None]
    figure, (shares, *frames) = style.panels(1 + (len(cases) or 1), 2, (4.8, 3.3), (0.0, 0.3))
    _outcomes(shares, found)
    for axes, name in zip(frames, cases, strict=False):
        _case(axes, found, name)
    if not cases:
        _throws_of_pairs(frames[0], found)
    one, two = (scene.name for scene in found.pair.scenes)
    looks = zip((one, two), PARTS, strict=True)
    handles = [Patch(label=name, fc=face, lw=1.4, **edge) for name, (face, edge) in looks]
    held = f"in contact, {found.contact}, cavity {'carried' if found.series.carried else 'standing'}"
    meet = "pass through each other" if found.contact == "none" else held
    words = f"{one} and {two}, {meet}: {len(found.rows)} trials"
    return style.finished(figure, words, handles if cases else (), 2)


def _outcomes(axes: Axes, answer: Assembly) -> None:
    shown = [name for name in reversed(OUTCOMES) if answer.counts[name] or name == "assembled"]
    for row, name in enumerate(shown):
        rate = rate_of(answer.counts[name], len(answer.rows))
        low, high = rate.interval
        axes.barh(row, rate.share, 0.6, **style.of_set(0 if name == "assembled" else 4))
        axes.plot([low, high], [row, row], color=style.INK, lw=1.3)
        style.note(axes, f"{rate.count}", (high, row), (4, -3))
    axes.set_yticks(range(len(shown)), [WORDS_OF_PAIRS[name] for name in shown], fontsize=style.SMALL)
    style.panel(axes, "what becomes of a pair", xlim=(0.0, 1.15), xlabel="share of the trials, 95 % interval")


def _throws_of_pairs(axes: Axes, answer: Assembly) -> None:
    for k, (scene, (_, edge)) in enumerate(zip(answer.pair.scenes, PARTS, strict=True)):
        right = np.sort([row["throws"][k] for row in answer.rows if row["fates"][k] == "right"])
        share = np.arange(1, right.size + 1) / len(answer.rows)
        axes.step(right, share, where="post", label=scene.name, color=edge["ec"], ls=edge["ls"], lw=1.3)
    style.panel(
        axes,
        "fed rightly, each part by itself",
        legend="lower right",
        xlabel="throws",
        ylabel="share of the trials",
        ylim=(0.0, 1.03),
    )


def _case(axes: Axes, answer: Assembly, name: str) -> None:
    number = answer.example(name)
    assert number is not None  # only outcomes with a case are drawn
    film = answer.film(number)
    last = len(film.times) - 1
    if name == "assembled":  # the film continues through the next throws
        rests = [time for time, _, word in film.marks if word == "thrown"]
        last = int(np.searchsorted(film.times, rests[1])) - 1 if len(set(rests)) > 1 else last
    for polygon in film.ground:
        axes.add_patch(Polygon(polygon, closed=True, fc="#d9d9d9", ec="#9a9a9a", lw=0.6))
    for frame in [*np.linspace(0, last, GHOSTS + 2).astype(int)[:-1].tolist(), last]:
        _parts(axes, film, frame, whole=frame == last)
    scene = answer.pair.scenes[0]
    cavity = scene.cavity
    assert cavity is not None
    left = -3.0 if name in ("left", "never") else cavity.position - 12.0
    style.panel(
        axes,
        f"{WORDS_OF_PAIRS[name]} (trial {number})",
        xlim=(left, cavity.position + cavity.width + 1.5),
        ylim=(scene.surface_height - cavity.depth - 1.0, scene.surface_height + 9.0),
        aspect="equal",
        xlabel=f"x [{scene.unit}]",
    )


def _parts(axes: Axes, film: Recording, frame: int, *, whole: bool) -> None:
    for k, (face, edge) in enumerate(PARTS):
        corners = film.corners(frame, k)
        if np.isfinite(corners).all():
            look = {"fc": face, "lw": 1.4} if whole else {"fc": "none", "lw": 0.7, "alpha": 0.5}
            axes.add_patch(Polygon(corners, closed=True, **edge, **look))
