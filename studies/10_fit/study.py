"""Fifty filmed throws of machines of known truth: what the fit says of them, and how often it is right.

Run it as ``python studies/10_fit/study.py [--seed 0] [--machines 40] [--bootstrap 40] [--out FOLDER]``.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

import limitsets as ls
from limitsets.base.files import as_plain
from limitsets.parameters.fitting import bootstrap, enough, fit, simulated_throws

HERE = Path(__file__).resolve().parent
NAMES = (
    "throw.speed",
    "part.mass.center.along",
    "part.mass.center.above",
    "arm.surface_height",
    "part.mass.radius_of_gyration",
)
# How far built machines are from what was aimed at: shares of the speed and of the radius, inches.
BUILT = (0.015, 0.1, 0.05, 0.05, 0.05)
ERROR, SPEED, LANDING, THROWS = 0.02, 0.002, 0.01, 50


def machine(draw: np.random.Generator) -> Any:
    """Build a machine near paper-designed."""
    aimed = ls.load("paper-designed")
    return aimed.with_values(
        {
            name: aimed.value(name) + size * float(draw.standard_normal())
            for name, size in zip(NAMES, BUILT, strict=True)
        }
    )


def film(truth: Any, draw: np.random.Generator, flipped: float = 0.0) -> Any:
    """Film single throws from random places and sides."""
    side = draw.integers(0, 3, THROWS)
    x = draw.uniform(truth.sides.a[side] + 2.0, 27.0)
    noise = {"error": ERROR, "speed": SPEED, "landing": LANDING}
    return simulated_throws(truth, x, side, **noise, misread=flipped, seed=int(draw.integers(1 << 30)))


def many(count: int, seed: int, flipped: float) -> dict[str, Any]:
    """Fit films of many machines: how often each interval holds, and how wide it is."""
    draw, aimed = np.random.default_rng(seed), ls.load("paper-designed")
    held: dict[str, list[bool]] = {}
    half: dict[str, list[float]] = {}
    for _ in range(count):
        truth = machine(draw)
        found = fit(aimed, film(truth, draw, flipped))
        for each in found.quantities:
            held.setdefault(each.name, []).append(each.lo <= truth.value(each.name) <= each.hi)
            half.setdefault(each.name, []).append(0.5 * (each.hi - each.lo) if each.bounded else math.inf)
    return {
        name: {"told": len(held[name]), "held": int(sum(held[name])), "half": float(np.median(half[name]))}
        for name in NAMES
        if name in held
    }


def one(seed: int, out: Path, films: int) -> dict[str, Any]:
    """Fit one machine, draw its residuals, bootstrap it, and ask whether it is good enough."""
    draw = np.random.default_rng(seed)
    truth = machine(draw)
    found = fit("paper-designed", film(truth, draw, 0.05))
    out.mkdir(parents=True, exist_ok=True)
    ls.plot.fit_residuals(found).savefig(out / "residuals.png", dpi=110)
    judged, again = enough(found), bootstrap(found, films, seed=seed)
    return {
        "quantities": {
            each.name: {"truth": truth.value(each.name), "value": each.value, "lo": each.lo, "hi": each.hi}
            for each in found.quantities
        },
        "misread": len(found.misread),
        "p": found.misfit.p,
        "enough": judged.verdict,
        "sentences": list(judged.sentences),
        "bootstrap": {"films": again.count, "held": again.covered},
    }


def main(seed: int = 0, out: Path = HERE, machines: int = 40, films: int = 40) -> dict[str, Any]:
    """Run the study, write its figure, and return its numbers."""
    found = {
        "one": one(seed, out, films),
        "many": {str(flipped): many(machines, seed + 1, flipped) for flipped in (0.0, 0.05)},
    }
    return dict(as_plain(found))  # null for what is open


def _said(value: float | None) -> str:
    return "open" if value is None else f"{value:.4f}"


def table(numbers: dict[str, Any]) -> str:
    """Write the numbers as Markdown tables."""
    lines = ["| quantity | truth | fitted | 95 % interval |", "|---|---|---|---|"]
    for name, each in numbers["one"]["quantities"].items():
        interval = f"{_said(each['lo'])} to {_said(each['hi'])}"
        lines.append(f"| {name} | {each['truth']:.4f} | {each['value']:.4f} | {interval} |")
    lines += [
        "",
        "| quantity | sides recorded wrong | machines | interval holds | median half width |",
        "|---|---|---|---|---|",
    ]
    for share, found in numbers["many"].items():
        for name, each in found.items():
            lines.append(
                f"| {name} | {100 * float(share):g} % | {each['told']} "
                f"| {100 * each['held'] / each['told']:.1f} % | {_said(each['half'])} |"
            )
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Fits of machines of known truth.")
    parser.add_argument("--seed", type=int, default=0, help="of machines and films")
    parser.add_argument("--machines", type=int, default=40, help="in each row of the table")
    parser.add_argument("--bootstrap", type=int, default=40, help="films of the one machine")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of the figure")
    parser.add_argument("--json", action="store_true", help="print all numbers as JSON")
    words = parser.parse_args()
    answer = main(words.seed, words.out, words.machines, words.bootstrap)
    print(json.dumps(answer, indent=2) if words.json else table(answer))
    if not words.json:
        print(*answer["one"]["sentences"], sep="\n")
