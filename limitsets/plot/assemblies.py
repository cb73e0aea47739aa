"""Pairs of parts in pictures: how many are assembled, how the others fail, and one case of each."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Patch, Polygon

from limitsets.arguments import arguments_checked
from limitsets.assembly.assembly_run import OUTCOMES
from limitsets.assembly.counting import rate_of
from limitsets.plot import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from limitsets.assembly import Assembly
    from limitsets.engine.recording import Recording

WORDS = {
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
        _throws(axes[1], found)
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


def _outcomes(axes: Axes, found: Assembly) -> None:
    shown = [name for name in OUTCOMES if found.counts[name] or name == "assembled"]
    for row, name in enumerate(reversed(shown)):
        rate = rate_of(found.counts[name], len(found.rows))
        low, high = rate.interval
        axes.barh(row, rate.share, 0.6, **style.of_set(0 if name == "assembled" else 4))
        axes.plot([low, high], [row, row], color=style.INK, lw=1.3)
        style.note(axes, f"{rate.count}", (high, row), (4, -3))
    axes.set_yticks(range(len(shown)), [WORDS[name] for name in reversed(shown)], fontsize=style.SMALL)
    axes.set_xlim(0.0, 1.15)
    axes.set_xlabel("share of the trials, 95 % interval", fontsize=style.SMALL)
    axes.set_title("what becomes of a pair", loc="left", fontsize=style.TEXT)
    style.open_frame(axes)


def _throws(axes: Axes, found: Assembly) -> None:
    for k, (scene, (_, colour)) in enumerate(zip(found.pair.scenes, PARTS, strict=True)):
        right = np.sort([row["throws"][k] for row in found.rows if row["fates"][k] == "right"])
        share = np.arange(1, right.size + 1) / len(found.rows)
        axes.step(
            right, share, where="post", color=colour, ls=("-", style.FLIP_LINE)[k], lw=1.3, label=scene.name
        )
    axes.set_ylim(0.0, 1.03)
    axes.set_title("fed rightly, each part by itself", loc="left", fontsize=style.TEXT)
    axes.set_xlabel("throws", fontsize=style.SMALL)
    axes.set_ylabel("share of the trials", fontsize=style.SMALL)
    axes.legend(fontsize=style.SMALL, frameon=False, loc="lower right")
    style.open_frame(axes)


def _case(axes: Axes, found: Assembly, name: str) -> None:
    number = found.example(name)
    assert number is not None  # only outcomes with a case are drawn
    film = found.film(number)
    last = len(film.times) - 1
    if name == "assembled":  # the film goes on through the next throws
        rests = [time for time, _, word in film.marks if word == "thrown"]
        last = int(np.searchsorted(film.times, rests[1])) - 1 if len(set(rests)) > 1 else last
    for polygon in film.ground:
        axes.add_patch(Polygon(polygon, closed=True, fc="#d9d9d9", ec="#9a9a9a", lw=0.6))
    for frame in [*np.linspace(0, last, GHOSTS + 2).astype(int)[:-1].tolist(), last]:
        _parts(axes, film, frame, whole=frame == last)
    scene = found.pair.scenes[0]
    cavity = scene.cavity
    assert cavity is not None
    axes.set_xlim(
        -3.0 if name in ("left", "never") else cavity.position - 12.0, cavity.position + cavity.width + 1.5
    )
    axes.set_ylim(scene.surface_height - cavity.depth - 1.0, scene.surface_height + 9.0)
    axes.set_aspect("equal")
    axes.set_title(f"{WORDS[name]} (trial {number})", loc="left", fontsize=style.TEXT)
    axes.set_xlabel(f"x [{scene.unit}]", fontsize=style.SMALL)
    style.open_frame(axes)


def _parts(axes: Axes, film: Recording, frame: int, *, whole: bool) -> None:
    for k, (face, edge) in enumerate(PARTS):
        corners = film.corners(frame, k)
        if np.isfinite(corners).all():
            look = {"fc": face, "lw": 1.4} if whole else {"fc": "none", "lw": 0.7, "alpha": 0.5}
            axes.add_patch(Polygon(corners, closed=True, ec=edge, ls=("-", style.FLIP_LINE)[k], **look))
