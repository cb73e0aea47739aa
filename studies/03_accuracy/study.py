"""What accuracy costs in time: for one throw, the limit set, basins, densities, exponents, and each effect.

Run it as ``python studies/03_accuracy/study.py [--seed 0] [--quick] [--out FOLDER]``; errors do not depend on the
machine, seconds do.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from accuracy_effects import SCENES, effect_costs, effects_figure
from accuracy_ends import BORDERS, CRITICAL, ORBIT, PROVED, reference, set_errors
from accuracy_figures import ROUNDING, long_run_figure, set_figure, throw_figure
from accuracy_long_run import (
    CELLS,
    DOUBLING,
    LOGISTIC,
    ORBITS,
    THROWS,
    ULAM,
    basin_errors,
    density_errors,
    l1_arcsine,
    l1_uniform,
    lyapunov_errors,
    scene_errors,
)
from accuracy_points import Point, by_method, exponent
from accuracy_throw import SIDE, critical_errors, random_ratios, throw_errors

import limitsets as ls

HERE = Path(__file__).resolve().parent
SCENE = "paper-designed"
PARTS = 4000

# What the setting of a method counts, where the error is a power of it.
SIZES = {CELLS: "n", ORBITS: "n", ULAM: "n", THROWS: "n", ORBIT: "n"}


def _fits(points: list[Point], but: tuple[str, ...] = ()) -> dict[str, float]:
    """Exponents of the error in cells, throws or starts."""
    found = {}
    for name, some in by_method(points).items():
        slope = exponent([point for point in some if point.error > ROUNDING])
        if slope is not None and name not in but:
            found[name] = slope
    return found


def _least(points: list[Point]) -> dict[str, float]:
    """Least error of each method."""
    return {name: min(point.error for point in some) for name, some in by_method(points).items()}


def main(seed: int = 0, out: Path = HERE, quick: bool = False) -> dict[str, Any]:
    """Run the study, write its figures, and return its numbers; `quick` leaves out the long settings."""
    scene = ls.load(SCENE)
    exact = reference(scene)
    lo, hi = (float(x) for x in exact[SIDE][0])
    throws, critical = throw_errors(scene, (lo, hi), seed, quick), critical_errors(scene, quick)
    ratios = random_ratios(PARTS, seed)
    sets = set_errors(scene, exact, quick)
    density, growth, known = scene_errors(scene, seed, quick)
    panels = {
        "Basins of the cubic map": ("error of a basin's share", basin_errors(seed, quick)),
        "Density of the doubling map (uniform)": (
            "L1 error",
            density_errors(DOUBLING, l1_uniform, seed, quick),
        ),
        "Density of the logistic map, r = 4": ("L1 error", density_errors(LOGISTIC, l1_arcsine, seed, quick)),
        f"Density of {SCENE}": ("L1 error", density),
        "Lyapunov exponent of the logistic map, r = 4": ("error per step", lyapunov_errors(seed, quick)),
        f"Lyapunov exponent of {SCENE}": ("error per throw", growth),
    }
    effects = {name: effect_costs(name, quick) for name in SCENES}
    out.mkdir(parents=True, exist_ok=True)
    sizes = {**SIZES, **{name: "n" for name in by_method(sets) if name.startswith(("cells", "the same"))}}
    throw_figure(throws, critical, ratios, scene.unit).savefig(out / "one-throw.png", dpi=90)
    set_figure(sets, scene.unit, sizes).savefig(out / "limit-set.png", dpi=90)
    long_run_figure(panels, sizes).savefig(out / "long-run.png", dpi=90)
    effects_figure(effects, scene.unit).savefig(out / "effects.png", dpi=90)
    low, middle, high = np.quantile(ratios, (0.05, 0.5, 0.95)).tolist()
    return {
        "reference": {str(side): [[float(a), float(b)] for a, b in parts] for side, parts in exact.items()},
        "throw": _least(throws),
        "critical_points": _least(critical),
        "small_over_exact": {"low": low, "median": middle, "high": high},
        "limit_set": {"exponents": _fits(sets, (BORDERS, CRITICAL, PROVED)), "least": _least(sets)},
        "long_run": {title: _fits(points) for title, (_, points) in panels.items()},
        "lyapunov": known,
        "effects": {name: {row.name: row._asdict() for row in rows} for name, rows in effects.items()},
        "points": {
            name: [point._asdict() for point in points]
            for name, points in {
                "throw": throws,
                "critical points": critical,
                "limit set": sets,
                **{title: points for title, (_, points) in panels.items()},
            }.items()
        },
    }


def _duration(seconds: float) -> str:
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if seconds >= size:
            return f"{float(f'{seconds / size:.2g}'):g} {unit}"
    return f"{float(f'{seconds / 1e-9:.2g}'):g} ns"


def table(numbers: dict[str, Any]) -> str:
    """Write the limit set's row of each method as Markdown: exponent, and what a smaller error takes."""
    lines = ["| method | error falls as | least error shown [in] | time |", "|---|---|---|---|"]
    fitted = numbers["limit_set"]["exponents"]
    rows: dict[str, list[dict[str, Any]]] = {}
    for point in numbers["points"]["limit set"]:
        rows.setdefault(point["method"], []).append(point)
    for name, points in rows.items():
        best = min(points, key=lambda point: (point["error"], point["seconds"]))
        words = {
            BORDERS: "0.2^rounds or faster",
            CRITICAL: "rounding alone",
            PROVED: "rounding alone",
        }
        count = "throws" if name == ORBIT else "cells"
        falls = f"{count}^{fitted[name]:.2f}" if name in fitted else words.get(name, "")
        lines.append(f"| {name} | {falls} | {best['error']:.1e} | {_duration(best['seconds'])} |")
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="What accuracy costs in time.")
    parser.add_argument("--seed", type=int, default=0, help="of starts, orbits and random parts")
    parser.add_argument("--quick", action="store_true", help="leave out the long settings")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of the figures")
    parser.add_argument("--json", action="store_true", help="print all numbers as JSON")
    words = parser.parse_args()
    answer = main(words.seed, words.out, words.quick)
    print(json.dumps(answer, indent=2) if words.json else table(answer))
