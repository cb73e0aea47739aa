"""Noisy scenes and maps as interval chains in DRN text, bounded by the model checker Storm, beside proved brackets.

Run it as ``python studies/16_exchange/study.py [--storm PYTHON] [--out FOLDER]``; a minute.  PYTHON is an interpreter
that has Storm's package: ``python -m venv storm && storm/bin/pip install stormpy``, then ``--storm storm/bin/python``.
Without it everything but Storm's own numbers is made.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from limitsets.robust import Scattering, Uniform, absorption_brackets

import limitsets as ls

HERE = Path(__file__).resolve().parent
# Cells of the walk, and cells per side of the scenes.
WALK, LADDER, FEEDER = (100, 400, 1000, 2000), (300, 1000, 3000), (250, 500, 1000, 2000, 4000)
# Throws that are counted, and steps after which hardly any walk goes on.
RUNGS, THROWS, STEPS = 5, 40, 80

# What Storm's Python is told.  A file, then labels and numbers of steps, two by two.
ASK = """
import json, sys
import stormpy
ways = stormpy.UncertaintyResolutionMode.MINIMIZE, stormpy.UncertaintyResolutionMode.MAXIMIZE
model = stormpy.build_model_from_drn[stormpy.Interval](sys.argv[1])
told = {"version": stormpy.__version__, "states": model.nr_states, "transitions": model.nr_transitions, "bounds": []}
for name, steps in zip(sys.argv[2::2], sys.argv[3::2]):
    asked = stormpy.parse_properties('P=? [F<=' + steps + ' "' + name + '"]')[0]
    ends = [stormpy.model_checking(model, asked, uncertainty_resolution_mode=mode) for mode in ways]
    told["bounds"].append([end.get_value(model.initial_states[0]) for end in ends])
print(json.dumps(told))
"""


def itself(x: Any) -> Any:
    """Stay, but for the noise."""
    return x


def by_storm(chain: Any, storm: str | None, *asked: tuple[str, int]) -> dict[str, Any] | None:
    """Let Storm bound the probabilities of having come to labels within so many throws; none without Storm."""
    if storm is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        path = chain.save(Path(folder) / "chain.drn")
        # the first step leads from "init" to a start
        words = [str(word) for name, count in asked for word in (name, count + 1)]
        done = subprocess.run([storm, "-c", ASK, path, *words], capture_output=True, text=True, check=True)
    told: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return told


def walk(storm: str | None, counts: Sequence[int] = WALK) -> dict[str, Any]:
    """Bound how often a walk with even steps of half an interval leaves it at the upper end."""
    places = {"low": [(0, -0.5, 0.0)], "high": [(0, 1.0, 1.5)]}
    rows = {}
    for cells in counts:
        line = ls.grid([(-0.5, 1.5)], cells=2 * cells)
        chain = ls.interval_chain(ls.map(itself), line, noise=0.5, absorbing=places, starts=[(0, 0.0, 0.5)])
        told = by_storm(chain, storm, ("high", STEPS), ("low", STEPS))
        if told:  # who never comes to the lower end leaves at the upper one
            told["bounds"] = [told["bounds"][0][0], 1.0 - told["bounds"][1][0]]
        rows[cells] = {"states": chain.states, "storm": told}
    return {"exact": 2.0 - math.cos(0.5) / (1.0 - math.sin(0.5)), "cells": rows}


def of_scene(
    name: str, e: float, words: Mapping[str, Any], throws: int, counts: Sequence[int], storm: str | None
) -> dict[int, Any]:
    """Bound by the number of cells the probability of having ended right, by both ways."""
    rows, noise = {}, Scattering(landing=Uniform(e))
    for cells in counts:
        ours = absorption_brackets(name, noise, **words, cells=cells, throws=throws, mean=False)
        chain = ls.interval_chain(name, noise, **words, cells=cells)
        told = by_storm(chain, storm, ("right", throws))
        if told:
            (told["bounds"],) = told["bounds"]
        rows[cells] = {
            "states": chain.states,
            "ours": ours.within["right"][:, throws].tolist(),
            "storm": told,
        }
    return rows


def rungs(throws: int = RUNGS) -> float:
    """Compute P(x >= 18) after so many jogs of paper-designed-small-angle by hand: a sum of uniform numbers."""
    scene = ls.load("paper-designed-small-angle")
    a, e, (lo, hi) = float(scene.sides.a[2]), 0.05, (15.0, 16.0)
    q = 1.0 + 2.0 * abs(scene.map.surface_height) / scene.map.kappa  # a jog stretches x - a by this
    widths = [q**throws * (hi - lo)] + [2.0 * e * q**k for k in range(throws)]
    rest = 18.0 - (a + q**throws * (lo - a) - e * sum(q**k for k in range(throws)))
    total = 0.0
    for signs in product((0, 1), repeat=len(widths)):
        left = rest - sum(width for sign, width in zip(signs, widths, strict=True) if sign)
        total += (-1) ** sum(signs) * max(left, 0.0) ** len(widths)
    return 1.0 - total / (math.factorial(len(widths)) * math.prod(widths))


def main(
    out: Path = HERE,
    storm: str | None = None,
    walks: Sequence[int] = WALK,
    ladders: Sequence[int] = LADDER,
    feeders: Sequence[int] = FEEDER,
) -> dict[str, Any]:
    """Run the study, write its figure where Storm was asked, and return its numbers."""
    ladder = {"right": (18.0, 2), "starts": [(2, 15.0, 16.0)]}
    feeder = {"right": (20.5, 2)}
    numbers = {
        "walk": walk(storm, walks),
        "ladder": {
            "exact": rungs(),
            "cells": of_scene("paper-designed-small-angle", 0.05, ladder, RUNGS, ladders, storm),
        },
        "feeder": {"cells": of_scene("paper-designed", 0.1, feeder, THROWS, feeders, storm)},
    }
    if storm is not None:
        figure(numbers, out)
    return numbers


def figure(numbers: Mapping[str, Any], out: Path = HERE) -> None:
    """Draw how wide both kinds of bounds are against the number of states."""
    out.mkdir(parents=True, exist_ok=True)
    drawn, axes = plt.subplots(figsize=(7.2, 4.4), layout="constrained")
    for colour, case, title in (
        ("tab:blue", "walk", "walk, P(ever high)"),
        ("tab:green", "ladder", "small-angle jogs, P(right within 5)"),
        ("tab:red", "feeder", "paper-designed, P(right within 40)"),
    ):
        rows = list(numbers[case]["cells"].values())
        states = [row["states"] for row in rows]
        for word, style, who in (
            ("storm", "o-", "constants per cell (Storm)"),
            ("ours", "s--", "affine on cells"),
        ):
            if word in rows[0]:
                ends = [row[word]["bounds"] if word == "storm" else row[word] for row in rows]
                apart = [hi - lo for lo, hi in ends]
                axes.loglog(states, apart, style, color=colour, ms=5, label=f"{title}: {who}")
    axes.set_xlabel("states of the interval chain")
    axes.set_ylabel("width of the bounds of a probability")
    axes.legend(fontsize=7, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    drawn.savefig(out / "widths.png", dpi=130)
    plt.close(drawn)


def table(numbers: Mapping[str, Any]) -> str:
    """Write the numbers as a Markdown table."""
    lines = ["| case | cells | states | Storm | ours | exact |", "|---|---|---|---|---|---|"]
    for case, one in numbers.items():
        for cells, row in one["cells"].items():
            ours = outward(*row["ours"]) if "ours" in row else ""
            storm = outward(*row["storm"]["bounds"]) if row["storm"] else ""
            exact = f"{one['exact']:.6f}" if "exact" in one else ""
            lines.append(f"| {case} | {cells} | {row['states']} | {storm} | {ours} | {exact} |")
    return "\n".join(lines)


def outward(lo: float, hi: float) -> str:
    """Write bounds, rounded outward."""
    return f"{math.floor(lo * 1e6) / 1e6:.6f} to {math.ceil(hi * 1e6) / 1e6:.6f}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description="Interval chains for model checkers, and what Storm says of them."
    )
    parser.add_argument("--storm", help="an interpreter that has the package stormpy")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of the figure")
    parser.add_argument("--json", action="store_true", help="print all numbers as JSON")
    words = parser.parse_args()
    answer = main(words.out, words.storm)
    print(json.dumps(answer, indent=2) if words.json else table(answer))
