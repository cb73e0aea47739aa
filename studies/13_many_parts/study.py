"""Many parts thrown at once: right feeds against the number of parts, with contact between them and without.

Run it as ``python studies/13_many_parts/study.py [--seed 0] [--share 1.0] [--out FOLDER] [--json]``.
"""

from __future__ import annotations

import argparse
import json
import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import limitsets as ls
from limitsets.cell.feeding.crowd import CrowdTrials, run_crowd
from limitsets.cell.feeding.falling import FATES, arm_end_of
from limitsets.cell.feeding.trials import run_trials
from limitsets.face.plot import style
from limitsets.feeder.engine import Crowd
from limitsets.feeder.scattering import Gaussian, Scattering

HERE = Path(__file__).resolve().parent
CAVITY = tomllib.loads((HERE.parent / "sizes.toml").read_text(encoding="utf-8"))["cavity"]
NOISE = Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02))  # of study 05
BATCHES = {1: 200, 2: 100, 3: 60, 5: 40, 10: 20, 20: 12, 50: 6, 100: 4, 200: 3}
UNILATERAL = (1, 2, 5)
THROWS = 200
STEP = 4e-3
STEPS = (8e-3, 4e-3, 2e-3, 1e-3, 5e-4)
RATE = 2.0  # throws a second


def scene() -> Any:
    """Give paper-designed the cavity of sizes.toml, foam on the arm, and contact."""
    tree = ls.load("paper-designed").as_dict()
    tables = {"cavity": CAVITY, "world": {"friction": 0.9}, "effects": {"contact": True}}
    return ls.load({**tree, **tables})


def row(found: CrowdTrials) -> dict[str, Any]:
    """Collect the numbers of one run."""
    rate, error = found.right_per_throw
    held = found.fates.sum()
    return {
        "batches": int(found.throws.size),
        "counts": found.counts,
        "right": float(found.fates[:, 0].sum() / held) if held else None,
        "spilled": float(found.spilled.mean()),
        "throws": float(found.throws.mean()),
        "right per throw": rate,
        "its error": None if math.isnan(error) else error,
        "right per minute": found.per_minute(RATE),
        "met": float(found.met.mean()),
        "seconds per part and throw": found.seconds / found.thrown,
    }


def main(seed: int = 0, out: Path = HERE, share: float = 1.0) -> dict[str, Any]:
    """Run the study, write the figure into `out`, return the numbers."""
    out.mkdir(parents=True, exist_ok=True)
    end = arm_end_of(scene())
    single = run_trials(end, NOISE, 20_000, seed=seed)

    def run(parts: int, **how: Any) -> dict[str, Any]:
        batches = max(round(share * BATCHES[parts]), 1)
        asked = {"batches": batches, "seed": seed, "throws": THROWS, "step": STEP, **how}
        return row(run_crowd(end, NOISE, parts, **asked))

    numbers: dict[str, Any] = {
        "single": {"counts": single.counts, "throws": float(single.throws.mean())},
        "pushing": {str(parts): run(parts) for parts in BATCHES},
        "passing": {str(parts): run(parts, between=False) for parts in BATCHES},
        "unilateral": {str(parts): run(parts, contact="unilateral") for parts in UNILATERAL},
        "half the step": {str(parts): run(parts, step=0.5 * STEP) for parts in UNILATERAL},
        "errors of places": errors_of_places(seed),
    }
    draw(numbers).savefig(out / "many_parts.png", dpi=130)
    return numbers


def errors_of_places(seed: int) -> dict[str, Any]:
    """Throw pairs of which one flips towards the other: how far places are from those of the finest step."""
    part, random, starts = scene(), np.random.default_rng(seed), []
    for _ in range(60):
        x = random.uniform(5.0, 9.0)
        starts.append((x, x + random.uniform(5.0, 8.0), 0.005 * random.standard_normal()))
    rests: dict[float, list[Any]] = {}
    for step in STEPS:
        rests[step] = []
        for inner, outer, deviation in starts:
            crowd = Crowd([part, part], step=step)
            crowd.place(0, inner, 2)
            crowd.place(1, outer, 0)
            rests[step].append((crowd.throw(deviation), bool(crowd.overlapped)))
    found: dict[str, Any] = {}
    finest = rests[STEPS[-1]]
    for step in STEPS[:-1]:
        off, differ, alone = [], 0, 0.0
        for (coarse, _), (fine, met) in zip(rests[step], finest, strict=True):
            if any(
                (one.where, one.side) != (two.where, two.side) for one, two in zip(coarse, fine, strict=True)
            ):
                differ += 1
                continue
            error = max(abs(one.x - two.x) for one, two in zip(coarse, fine, strict=True))
            if met:
                off.append(error)
            else:
                alone = max(alone, error)
        found[str(step)] = {
            "met": len(off),
            "differ": differ,
            "median": float(np.median(off)),
            "worst": max(off),
            "worst of pairs that do not meet": alone,
        }
    return found


def draw(numbers: dict[str, Any]) -> Figure:
    """Draw rates, fates and cost against the number of parts."""
    figure = Figure(figsize=(13.0, 4.2), layout="constrained")
    rates, fates, cost = figure.subplots(1, 3)
    for name, colour, mark in (("passing", style.FLIP, "s"), ("pushing", style.JOG, "o")):
        rows = numbers[name]
        parts = [int(each) for each in rows]
        label = f"parts that {'push' if name == 'pushing' else 'pass through'} each other"
        values = [each["right per throw"] for each in rows.values()]
        errors = [each["its error"] or 0.0 for each in rows.values()]
        rates.errorbar(parts, values, errors, color=colour, marker=mark, capsize=3, label=label)
        seconds = [1e3 * each["seconds per part and throw"] for each in rows.values()]
        cost.plot(parts, seconds, color=colour, marker=mark, label=label)
    rates.set(xscale="log", yscale="log", xlabel="parts given", ylabel="right feeds per throw")
    rates.legend(loc="upper left", fontsize=8)
    rates.set_ylim(4e-3, 10.0)
    cost.set(xscale="log", yscale="log", xlabel="parts given", ylabel="time per part and throw [ms]")
    cost.set_yticks([0.5, 1.0, 2.0, 5.0], ["0.5", "1", "2", "5"])
    cost.set_yticks([], minor=True)
    for panel in (rates, cost):
        panel.set_xticks([int(each) for each in numbers["pushing"]], list(numbers["pushing"]))
        panel.set_xticks([], minor=True)
    rows = numbers["pushing"]
    below = [0.0] * len(rows)
    shades = {
        "right": "0.25",
        "wrong": "0.55",
        "wall": "0.75",
        "edge": "0.68",
        "left": "0.88",
        "never": "white",
        "spilled": "white",
    }
    hatches = {"edge": "\\\\", "spilled": "///", "never": "..."}
    for fate, shade in shades.items():
        high = []
        for parts, each in rows.items():
            met = each["spilled"] if fate == "spilled" else each["counts"][fate] / each["batches"]
            high.append(met / int(parts))
        fates.bar(
            list(rows), high, bottom=below, color=shade, edgecolor="0.2", hatch=hatches.get(fate), label=fate
        )
        below = [low + more for low, more in zip(below, high, strict=True)]
    fates.set(xlabel="parts given, that push each other", ylabel="share", ylim=(0.0, 1.0))
    fates.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=7, fontsize=8, columnspacing=1.0)
    return figure


def table(numbers: dict[str, Any]) -> str:
    """Write the numbers as a Markdown table."""
    heads = (
        "parts",
        "contact",
        "batches",
        *FATES,
        "spilled",
        "throws",
        "right per throw",
        "per minute",
        "ms",
    )
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for name, words in {
        "pushing": "hinge, pushing",
        "passing": "hinge, passing through",
        "unilateral": "unilateral, pushing",
        "half the step": "hinge, pushing, half the step",
    }.items():
        for parts, each in numbers[name].items():
            counts = " | ".join(str(met) for met in each["counts"].values())
            error = "" if each["its error"] is None else f" ± {each['its error']:.4f}"
            lines.append(
                f"| {parts} | {words} | {each['batches']} | {counts} | {each['spilled']:.1f} | {each['throws']:.1f}"
                f" | {each['right per throw']:.4f}{error} | {each['right per minute']:.2f}"
                f" | {1e3 * each['seconds per part and throw']:.2f} |"
            )
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--share", type=float, default=1.0, help="of the batches")
    parser.add_argument("--out", type=Path, default=HERE)
    parser.add_argument("--json", action="store_true", help="print all numbers")
    given = parser.parse_args()
    answers = main(given.seed, given.out, given.share)
    print(json.dumps(answers, indent=1) if given.json else table(answers))
