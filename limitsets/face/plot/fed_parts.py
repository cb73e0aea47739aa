"""Feeding and assembly in pictures: parts that tip into the cavity, their fates, and pairs that lie in it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Patch, Polygon

from limitsets.base.arguments import arguments_checked
from limitsets.cell.assembly.assembly_run import OUTCOMES, rate_of
from limitsets.cell.feeding.falling import FATES, tipping_times
from limitsets.face.plot import style
from limitsets.feeder.geometry.polygon import above_side, side_ends

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from limitsets.cell.assembly import Assembly
    from limitsets.cell.feeding import Feeding
    from limitsets.feeder.engine.member import Recording


LOOKS: dict[str, dict[str, Any]] = {
    "right": {"color": style.GOAL, "ls": "-"},
    "wrong": {"color": style.FLIP, "ls": style.FLIP_LINE},
    "wall": {"color": style.ROLL, "ls": style.ROLL_LINE},
    "edge": {"color": style.INK, "ls": (0, (5, 1.5, 1, 1.5))},
    "left": {"color": style.JOG, "ls": (0, (1, 1.5))},
}
# Smaller shares are not drawn.
LEAST = 1e-6
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
    rows = math.ceil(len(panels) / 2)
    figure, axes = style.canvas(9.6, 3.6 * rows + 0.3, rows, 2)
    for draw, each in zip(panels, axes, strict=False):
        draw(each, found)
    for each in axes[len(panels) :]:
        each.set_axis_off()
    words = f"side {found.end.side} wanted beyond x = {found.end.x:g} {scene.unit}"
    style.title(figure, f"{scene.name}: {words}")
    return figure


def _corners(answer: Feeding, beyond: float, tipped: float) -> NDArray[np.float64]:
    """Vertices of a part on the wanted side, tipped over the end of the arm, relative to this end [length]."""
    scene, side = answer.end.scene, answer.end.side
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


def _cavity(axes: Axes, answer: Feeding) -> None:
    scene = answer.end.scene
    cavity = scene.cavity
    assert cavity is not None  # `feed` refuses a scene without a cavity
    ramp = cavity.depth / math.tan(cavity.angle)
    outline = [
        (-8.0, 0.0),
        (0.0, 0.0),
        (ramp, -cavity.depth),
        (cavity.width, -cavity.depth),
        (cavity.width, 0.0),
    ]
    axes.plot(*zip(*outline, strict=True), color=style.INK, lw=1.6)
    beyond = 0.25 * float(scene.sides.a[answer.end.side])
    for share, alpha in ((0.0, 1.0), (0.5, 0.6), (1.0, 1.0)):
        corners = _corners(answer, beyond, share * cavity.angle)
        axes.add_patch(Polygon(corners, closed=True, fill=False, ec=style.JOG, lw=1.1, alpha=alpha))
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_title("a part tips over the end", loc="left", fontsize=style.TEXT)
    axes.set_xlabel(f"beyond the end [{scene.unit}]", fontsize=style.SMALL)
    style.open_frame(axes)


def _tipping(axes: Axes, answer: Feeding) -> None:
    scene = answer.end.scene
    side = answer.end.side
    most = min(float(scene.sides.a[side]), scene.arm_length - answer.end.x)
    e = np.geomspace(1e-6 * most, most, 300)
    axes.plot(e, tipping_times(scene, side)(e), color=style.INK, lw=1.3)
    rate = scene.world.throw_rate
    if rate is not None:
        axes.axhline(1.0 / rate, color=style.FLIP, lw=1.1, ls=style.FLIP_LINE)
        style.note(axes, f"next throw, {rate:g} Hz", (float(e[0]), 1.0 / rate), (2, 3), color=style.FLIP)
    for lo, hi in answer.end.clear:
        axes.axvspan(max(lo, float(e[0])), hi, color="#9BD1B8", alpha=0.4, lw=0)
    axes.set_xscale("log")
    axes.set_ylim(bottom=0.0)
    begins = "from rest" if scene.cavity is not None and scene.cavity.tips == "rest" else "as it comes down"
    axes.set_title(f"time to tip, {begins} (shaded: clear)", loc="left", fontsize=style.TEXT)
    axes.set_xlabel(f"comes down beyond the end by [{scene.unit}]", fontsize=style.SMALL)
    axes.set_ylabel("time [s]", fontsize=style.SMALL)
    style.open_frame(axes)


def _throws_until_fed(axes: Axes, answer: Feeding) -> None:
    rows = answer.shares.by_throw
    last = (answer.shares.quantile(0.999) or rows.shape[0]) + 2
    number = np.arange(1, min(last, rows.shape[0]) + 1)
    for column, name in enumerate(FATES[:-1]):
        total = np.cumsum(rows[:, column])[: number.size]
        if total.size and total[-1] > 0.0:
            label = f"{WORDS_OF_FATES[name]}: {100 * answer.shares.shares[name]:.3g} %"
            axes.step(number, total, where="post", lw=1.3, label=label, **LOOKS[name])
    axes.set_title(f"fates of {answer.trials.fate.size} parts", loc="left", fontsize=style.TEXT)
    axes.set_xlabel("throws", fontsize=style.SMALL)
    axes.set_ylabel("share of random starts", fontsize=style.SMALL)
    axes.set_ylim(0.0, 1.4 * axes.get_ylim()[1])  # room for the legend over the steps
    axes.set_yticks([tick for tick in axes.get_yticks() if tick <= 1.0])
    if axes.get_legend_handles_labels()[0]:  # no throw if all parts stay
        axes.legend(fontsize=style.SMALL, frameon=False, loc="upper left")
    style.open_frame(axes)


def _levels(axes: Axes, answer: Feeding) -> None:
    curve = answer.curve
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
PARTS = (("#9CC7E4", style.JOG), ("#F3C9A8", style.FLIP))  # face, edge
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
    panels = 1 + (len(cases) or 1)
    rows = math.ceil(panels / 2)
    figure, axes = style.canvas(9.6, 3.3 * rows + 0.3, rows, 2)
    _outcomes(axes[0], found)
    for each, name in zip(axes[1:], cases, strict=False):
        _case(each, found, name)
    if not cases:
        _throws_of_pairs(axes[1], found)
    for each in axes[panels:]:
        each.set_axis_off()
    one, two = (scene.name for scene in found.pair.scenes)
    if cases:
        looks = zip((one, two), PARTS, ("-", style.FLIP_LINE), strict=True)
        handles = [Patch(label=name, fc=face, ec=edge, ls=line, lw=1.4) for name, (face, edge), line in looks]
        style.legend(figure, handles, 2)
    held = f"in contact, {found.contact}, cavity {'carried' if found.series.carried else 'standing'}"
    meet = "pass through each other" if found.contact == "none" else held
    style.title(figure, f"{one} and {two}, {meet}: {len(found.rows)} trials")
    return figure


def _outcomes(axes: Axes, answer: Assembly) -> None:
    shown = [name for name in OUTCOMES if answer.counts[name] or name == "assembled"]
    for row, name in enumerate(reversed(shown)):
        rate = rate_of(answer.counts[name], len(answer.rows))
        low, high = rate.interval
        axes.barh(row, rate.share, 0.6, **style.of_set(0 if name == "assembled" else 4))
        axes.plot([low, high], [row, row], color=style.INK, lw=1.3)
        style.note(axes, f"{rate.count}", (high, row), (4, -3))
    axes.set_yticks(
        range(len(shown)), [WORDS_OF_PAIRS[name] for name in reversed(shown)], fontsize=style.SMALL
    )
    axes.set_xlim(0.0, 1.15)
    axes.set_xlabel("share of the trials, 95 % interval", fontsize=style.SMALL)
    axes.set_title("what becomes of a pair", loc="left", fontsize=style.TEXT)
    style.open_frame(axes)


def _throws_of_pairs(axes: Axes, answer: Assembly) -> None:
    for k, (scene, (_, colour)) in enumerate(zip(answer.pair.scenes, PARTS, strict=True)):
        right = np.sort([row["throws"][k] for row in answer.rows if row["fates"][k] == "right"])
        share = np.arange(1, right.size + 1) / len(answer.rows)
        axes.step(
            right, share, where="post", color=colour, ls=("-", style.FLIP_LINE)[k], lw=1.3, label=scene.name
        )
    axes.set_ylim(0.0, 1.03)
    axes.set_title("fed rightly, each part by itself", loc="left", fontsize=style.TEXT)
    axes.set_xlabel("throws", fontsize=style.SMALL)
    axes.set_ylabel("share of the trials", fontsize=style.SMALL)
    axes.legend(fontsize=style.SMALL, frameon=False, loc="lower right")
    style.open_frame(axes)


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
    axes.set_xlim(
        -3.0 if name in ("left", "never") else cavity.position - 12.0, cavity.position + cavity.width + 1.5
    )
    axes.set_ylim(scene.surface_height - cavity.depth - 1.0, scene.surface_height + 9.0)
    axes.set_aspect("equal")
    axes.set_title(f"{WORDS_OF_PAIRS[name]} (trial {number})", loc="left", fontsize=style.TEXT)
    axes.set_xlabel(f"x [{scene.unit}]", fontsize=style.SMALL)
    style.open_frame(axes)


def _parts(axes: Axes, film: Recording, frame: int, *, whole: bool) -> None:
    for k, (face, edge) in enumerate(PARTS):
        corners = film.corners(frame, k)
        if np.isfinite(corners).all():
            look = {"fc": face, "lw": 1.4} if whole else {"fc": "none", "lw": 0.7, "alpha": 0.5}
            axes.add_patch(Polygon(corners, closed=True, ec=edge, ls=("-", style.FLIP_LINE)[k], **look))
