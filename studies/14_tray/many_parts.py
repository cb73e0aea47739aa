"""Many parts on the tray at once: fractions filled against the number of parts, pushing and passing through, and cost.

Run it as ``python studies/14_tray/many_parts.py [--seed 0] [--share 1.0] [--out FOLDER] [--json]``.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import limitsets as ls
from limitsets.cell.trays import Pouring, TrayCrowd
from limitsets.cell.trays.filling import INTERVALS, filled
from limitsets.cell.trays.passing import random_of
from limitsets.cell.trays.pouring import crowds_of
from limitsets.face.plot import style
from limitsets.feeder.engine.member import Recording

HERE = Path(__file__).resolve().parent
PASSES, DEPRESSIONS, DROPS = 30, 20, 4000
BATCHES = {(5, 20): 8, (10, 20): 8, (20, 20): 8, (40, 20): 5, (80, 20): 3, (200, 20): 2, (200, 200): 1}
SHOWN = 10  # depressions in the picture


def row(found: TrayCrowd) -> dict[str, Any]:
    """Collect the numbers after the last pass."""
    numbers: dict[str, Any] = {"batches": int(found.met.size)}
    for name in ("right", "covered", "wrong"):
        share, ends = found.share(getattr(found, name))
        numbers[name] = {"value": float(share[-1]), "interval": ends[-1].tolist()}
    numbers["right or covered"] = float((found.right + found.covered)[:, -1].mean() / found.depressions)
    numbers["met"] = float(found.met.mean())
    numbers["unfinished"] = found.unfinished
    numbers["seconds per part and pass"] = found.seconds / found.moved
    return numbers


def main(seed: int = 0, out: Path = HERE, share: float = 1.0) -> dict[str, Any]:
    """Run the study, write the figure into `out`, return the numbers by (parts, depressions)."""
    out.mkdir(parents=True, exist_ok=True)
    single = ls.tray(HERE / "tray.toml", passes=PASSES, drops=max(round(share * DROPS), 100), seed=seed)
    numbers: dict[str, Any] = {}
    for (parts, depressions), batches in BATCHES.items():
        pouring = Pouring(single.passes, parts, depressions, PASSES, seed)
        rows = [pouring.row(k) for k in range(max(round(share * batches), 1))]
        pushing, passing = crowds_of(pouring, rows)
        chain = filled(single.counts, PASSES, random_of(seed, INTERVALS), parts / depressions)
        numbers[f"{parts} over {depressions}"] = {
            "pushing": row(pushing),
            "passing": row(passing),
            "chain": {
                name: {"value": float(values[-1]), "interval": ends[-1].tolist()}
                for name, values, ends in (
                    ("right", chain.right, chain.interval),
                    ("wrong", chain.wrong, chain.wrong_interval),
                )
            },
        }
    kept = Pouring(single.passes, DEPRESSIONS, DEPRESSIONS, PASSES, seed).film(0)
    draw(numbers, kept, SHOWN * single.passes.tray.pitch).savefig(out / "many_parts.png", dpi=130)
    return numbers


def draw(numbers: dict[str, Any], kept: Recording, far: float) -> Figure:
    """Draw fractions, what lies in the depressions and cost against the number of parts, and a part of the tray."""
    figure = Figure(figsize=(13.0, 6.4), layout="constrained")
    axes = figure.subplot_mosaic("ABC;DDD", height_ratios=[1.0, 0.42])
    rows = {
        int(name.split()[0]): each for name, each in numbers.items() if name.endswith(f" over {DEPRESSIONS}")
    }
    parts = np.array(list(rows))
    looks = {
        "passing": (style.JOG, "s", "pass through each other"),
        "pushing": (style.ROLL, "o", "push each other"),
    }
    for name, (colour, mark, words) in looks.items():
        values = np.array([each[name]["right"]["value"] for each in rows.values()])
        ends = np.array([each[name]["right"]["interval"] for each in rows.values()])
        bars = np.abs(ends - values[:, None]).T
        axes["A"].errorbar(parts, values, bars, color=colour, marker=mark, ls="", capsize=3, label=words)
        cost = [1e3 * each[name]["seconds per part and pass"] for each in rows.values()]
        axes["C"].plot(parts, cost, color=colour, marker=mark, label=words)
    also = [each["pushing"]["right or covered"] for each in rows.values()]
    colour, mark, _ = looks["pushing"]
    axes["A"].plot(
        parts, also, color=colour, marker=mark, mfc="white", ls="", label="push each other: also under others"
    )
    chain = [each["chain"]["right"]["value"] for each in rows.values()]
    axes["A"].plot(parts, chain, color=style.GOAL, label="chain of single parts")
    axes["A"].set(ylim=(0.0, 1.0), ylabel=f"filled rightly after {PASSES} passes")
    axes["A"].legend(fontsize=8, frameon=False)
    axes["C"].set(ylim=(0.0, None), ylabel="time per part and pass [ms]")
    axes["C"].legend(fontsize=8, frameon=False)
    below = np.zeros(parts.size)
    shades = {"right": "0.25", "covered": "0.55", "wrong": "0.82", "empty": "white"}
    for name, shade in shades.items():
        high = [each["pushing"][name]["value"] if name != "empty" else 0.0 for each in rows.values()]
        if name == "empty":
            high = (1.0 - below).tolist()
        axes["B"].bar([str(each) for each in parts], high, bottom=below, color=shade, ec="0.2", label=name)
        below = below + np.array(high)
    axes["B"].set(ylabel=f"depressions after {PASSES} passes", xlabel="parts in a pass, that push each other")
    axes["B"].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, fontsize=8, frameon=False)
    for name in "AC":
        axes[name].set(xscale="log", xlabel=f"parts in a pass, over {DEPRESSIONS} depressions")
        axes[name].set_xticks(parts, [str(each) for each in parts])
        axes[name].set_xticks([], minor=True)
    _tray(axes["D"], kept, far)
    return figure


def _tray(axes: Axes, kept: Recording, far: float) -> None:
    """Draw where parts lie at the end of a recording, up to x = far."""
    for corners in kept.ground:
        axes.fill(*corners.T, color="0.85", lw=0)
    shown = np.flatnonzero(~np.isnan(kept.poses[-1, :, 0]))
    for part in shown:
        axes.fill(*kept.corners(-1, int(part)).T, fc="#9BC4E2", ec=style.INK, lw=0.8, alpha=0.9)
    top = max(float(kept.corners(-1, int(part))[:, 1].max()) for part in shown)
    axes.set(xlim=(0.0, far), ylim=(-3.0, top + 0.5), aspect="equal")
    axes.set_axis_off()
    words = f"{DEPRESSIONS} parts a pass, pushing: {SHOWN} of {DEPRESSIONS} depressions after {PASSES} passes"
    axes.set_title(words, fontsize=9, loc="left")


def table(numbers: dict[str, Any]) -> str:
    """Write the numbers as a Markdown table."""
    heads = ("parts", "contact", "batches", "right", "covered", "wrong", "chain: right", "chain: wrong", "ms")
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for name in ("pushing", "passing"):
        for parts, each in numbers.items():
            found, chain = each[name], each["chain"]
            shares = [_share(found[word]) for word in ("right", "covered", "wrong")]
            chances = [f"{chain[word]['value']:.3f}" for word in ("right", "wrong")]
            cells = [parts, name, found["batches"], *shares, *chances]
            lines.append(
                f"| {' | '.join(map(str, cells))} | {1e3 * found['seconds per part and pass']:.2f} |"
            )
    return "\n".join(lines)


def _share(found: dict[str, Any]) -> str:
    low, high = found["interval"]
    return f"{found['value']:.3f} ({low:.3f} to {high:.3f})"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--share", type=float, default=1.0, help="of the batches and drops")
    parser.add_argument("--out", type=Path, default=HERE)
    parser.add_argument("--json", action="store_true", help="print all numbers")
    given = parser.parse_args()
    answers = main(given.seed, given.out, given.share)
    print(json.dumps(answers, indent=1) if given.json else table(answers))
