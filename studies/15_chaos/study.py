"""What is proved about chaos: exponents, shares and entropies of the paper's feeders, and order that noise makes.

Run it as ``python studies/15_chaos/study.py [--out FOLDER]``; two to four minutes.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

import limitsets as ls

HERE = Path(__file__).resolve().parent
SCENES = ("paper-initial-small-angle", "paper-designed-small-angle", "paper-initial", "paper-designed")
# Cells of the exponents, and of the brackets that come nearer.
CELLS, FINER = 64_000, (1000, 4000, 16_000, 64_000)
# Half the width of the noise, and cells on which the exponent is bounded.
NOISES = {0.01: 4000, 0.003: 4000, 0.001: 8000, 3e-4: 30_000, 1e-4: 80_000, 5e-5: 120_000}
# Noise at which the exponent is sampled for the curve.
BETWEEN = np.geomspace(3e-5, 1.5e-2, 28).tolist()
THROWS = 10**6
ORBITS, STEPS, SETTLED = 20_000, 500, 100

# The reaction of Belousov and Zhabotinsky as a map: Matsumoto and Tsuda, J. Stat. Phys. 31 (1983) 87; constants from
# Galatolo, Monge and Nisoli, arXiv 1702.07024.
A, B = 19 / 42 * (7 / 5) ** (1 / 3), 0.02328852830307032
C = 20 / (3**20 * 7) * (7 / 5) ** (1 / 3) * math.exp(18.7)


def left(x: Any) -> Any:
    """Step from below 0.3."""
    return (A + np.cbrt(x - 0.125)) * math.exp(-x) + B


def right(x: Any) -> Any:
    """Step from above 0.3."""
    return C * (10 * x * math.exp(-10 * x / 3)) ** 19 + B


def border(x: Any) -> Any:
    """Below 0 where the left piece counts."""
    return x - 0.3


def feeders(cells: int = CELLS, names: Sequence[str] = SCENES, throws: int = THROWS) -> dict[str, Any]:
    """Prove exponent, flips per throw and entropy of scenes; one long orbit beside."""
    told = {}
    for name in names:
        numbers = ls.average(name, ["lyapunov", "flips_per_throw"], cells=cells).average.numbers
        entropy, scene = ls.entropy(name).entropy, ls.load(name)
        path = ls.maps.lyapunov(scene.map, 15.0, 2, throws)
        told[name] = {
            "lyapunov": numbers["lyapunov"][0],
            "flips_per_throw": numbers["flips_per_throw"][0],
            "entropy": (entropy.lo, entropy.hi),
            "sampled": path.exponent,
        }
    return told


def widths(counts: Sequence[int] = FINER) -> dict[int, float]:
    """Tell by the number of cells how far apart the bounds of the exponent of paper-designed are."""
    bounds = {count: ls.average("paper-designed", cells=count).average for count in counts}
    return {count: each.hi - each.lo for count, each in bounds.items()}


def order(noises: Mapping[float, int] = NOISES) -> dict[float, tuple[float, float]]:
    """Prove the exponent of the reaction by its noise."""
    reaction = ls.map(pieces=(left, right), margin=border)
    line = {cells: ls.grid([(0.0, 1.0)], cells=cells) for cells in noises.values()}
    proofs = {noise: ls.average(reaction, line[cells], noise=noise) for noise, cells in noises.items()}
    return {noise: (each.lo, each.hi) for noise, each in proofs.items()}


def sampled(noise: float, seed: int = 0) -> float:
    """Estimate the exponent by many random orbits in floats."""
    rng, total = np.random.default_rng(seed), 0.0
    x = rng.random(ORBITS)
    for step in range(SETTLED + STEPS):
        beside = x - 0.125
        image = np.where(x > 0.3, right_of(x), (A + np.cbrt(beside)) * np.exp(-x) + B)
        x = image + rng.uniform(-noise, noise, ORBITS)
        if step >= SETTLED:
            total += float(np.log(np.abs(slope_of(x))).mean())
    return total / STEPS


def right_of(x: Any) -> Any:
    """Step from above 0.3, of arrays."""
    return C * (10 * x * np.exp(-10 * x / 3)) ** 19 + B


def slope_of(x: Any) -> Any:
    """Slope of the step, by hand."""
    beside = x - 0.125
    below = np.exp(-x) * (np.cbrt(beside) ** -2.0 / 3 - A - np.cbrt(beside))
    return np.where(x > 0.3, 19 * (right_of(x) - B) * (1 / x - 10 / 3), below)


def outward(lo: float, hi: float, digits: int) -> str:
    """Write bounds, rounded outward."""
    scale = 10.0**digits
    return f"{math.floor(lo * scale) / scale:.{digits}f} to {math.ceil(hi * scale) / scale:.{digits}f}"


def figures(numbers: Mapping[str, Any], out: Path) -> None:
    """Draw exponents and entropies of the feeders, how bounds come nearer, and the exponent against the noise."""
    out.mkdir(parents=True, exist_ok=True)
    figure, (bars, near) = plt.subplots(1, 2, figsize=(9.6, 3.6), layout="constrained")
    rows = numbers["feeders"]
    for k, one in enumerate(rows.values()):
        for height, word, colour, label in (
            (k + 0.17, "entropy", "tab:orange", "topological entropy, proved"),
            (k - 0.17, "lyapunov", "tab:blue", "Lyapunov exponent, proved"),
        ):
            lo, hi = one[word]
            bars.barh(height, lo, 0.3, color=colour, alpha=0.75, label=label if k == 0 else None)
            bars.annotate(
                outward(lo, hi, 6),
                (lo, height),
                (3, 0),
                textcoords="offset points",
                va="center",
                fontsize=7,
            )
        bars.plot(one["sampled"], k - 0.17, "k|", ms=11, label="one orbit in floats" if k == 0 else None)
    bars.set_yticks(range(len(rows)), list(rows))
    bars.set_xlim(0.0, 1.75 * max(one["entropy"][1] for one in rows.values()))
    bars.invert_yaxis()
    bars.set_xlabel("per throw [natural logarithm]")
    bars.legend(
        fontsize=7,
        loc="lower center",
        bbox_to_anchor=(0.5, 1.0),
        ncols=3,
        columnspacing=0.9,
        handlelength=1.2,
    )
    cells, apart = list(numbers["widths"]), list(numbers["widths"].values())
    near.loglog(cells, apart, "o-", label="width of the bounds")
    near.loglog(cells, [apart[0] * cells[0] / n for n in cells], "k:", lw=1, label="1/cells")
    near.set_xlabel("cells")
    near.set_ylabel("width of the exponent of paper-designed")
    near.legend(fontsize=8)
    figure.savefig(out / "feeders.png", dpi=130)
    plt.close(figure)

    figure, axes = plt.subplots(figsize=(6.4, 3.8), layout="constrained")
    axes.axhline(0.0, color="0.4", lw=0.8)
    known = numbers["order"]
    for noise, (lo, hi) in known.items():
        colour = "tab:red" if lo > 0 else "tab:blue" if hi < 0 else "0.6"
        axes.plot([noise, noise], [lo, hi], color=colour, lw=5, solid_capstyle="butt")
        axes.plot(noise, 0.5 * (lo + hi), ".", color=colour, ms=8)
    curve = axes.plot(list(numbers["sampled"]), list(numbers["sampled"].values()), "k", lw=0.8)
    axes.set_xscale("log")
    axes.set_xlabel("half the width of the noise")
    axes.set_ylabel("Lyapunov exponent per step")
    handles = [plt.Line2D([], [], color=c, lw=5) for c in ("tab:red", "tab:blue", "0.6")]
    words = ["proved: above 0, chaos", "proved: below 0, order", "proved bounds, sign open"]
    axes.legend([*handles, *curve], [*words, "random orbits in floats"], fontsize=8)
    figure.savefig(out / "order.png", dpi=130)
    plt.close(figure)


def main(
    out: Path = HERE,
    cells: int = CELLS,
    names: Sequence[str] = SCENES,
    noises: Mapping[float, int] = NOISES,
    finer: Sequence[int] = FINER,
    between: Sequence[float] = BETWEEN,
) -> dict[str, Any]:
    """Run the study, write its figures, and return its numbers."""
    numbers = {
        "feeders": feeders(cells, names),
        "widths": widths(finer),
        "order": order(noises),
        "sampled": {noise: sampled(noise) for noise in sorted({*noises, *between})},
    }
    figures(numbers, out)
    return numbers


def table(numbers: Mapping[str, Any]) -> str:
    """Write the numbers as Markdown tables."""
    lines = ["| scene | Lyapunov exponent | flips per throw | entropy |", "|---|---|---|---|"]
    for name, one in numbers["feeders"].items():
        each = ((one["lyapunov"], 7), (one["flips_per_throw"], 5), (one["entropy"], 9))
        lines.append(f"| {name} | {' | '.join(outward(*ends, digits) for ends, digits in each)} |")
    lines += ["", "| noise | exponent, proved | random orbits |", "|---|---|---|"]
    for noise, (lo, hi) in numbers["order"].items():
        lines.append(f"| {noise:g} | {outward(lo, hi, 4)} | {numbers['sampled'][noise]:.4f} |")
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="What is proved about chaos.")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of the figures")
    parser.add_argument("--json", action="store_true", help="print all numbers as JSON")
    words = parser.parse_args()
    answer = main(words.out)
    print(json.dumps(answer, indent=2) if words.json else table(answer))
