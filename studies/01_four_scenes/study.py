"""Limit sets of the paper's four scenes: a scene and a seed in, numbers and a figure out.

Run it as ``python studies/01_four_scenes/study.py [--seed 0] [--out FOLDER]``.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import limitsets as ls

HERE = Path(__file__).resolve().parent
SCENES = ("paper-initial-small-angle", "paper-designed-small-angle", "paper-initial", "paper-designed")
THROWS = 500_000
FLIP = ls.maps.FLIP


def long_orbit(scene: Any, seed: int) -> Any:
    """Follow a start drawn anywhere on the arm; the first 1000 throws are left out."""
    random = np.random.default_rng(seed)
    side = int(random.integers(len(scene.sides)))
    a = float(scene.sides.a[side])
    settled = ls.orbit(scene.map, float(random.uniform(a + 1.0, scene.arm_length)), side, 1000)
    return ls.orbit(scene.map, float(settled.x[-1]), int(settled.side[-1]), THROWS)


def counted_jogs(path: Any) -> dict[str, list[int]]:
    """Least and largest number of jogs on one visit, counted on an orbit."""
    change = np.flatnonzero(np.diff(path.side)) + 1
    side, jogs = path.side[change[:-1]], np.diff(change) - 1
    return {
        str(s): [int(jogs[side == s].min()), int(jogs[side == s].max())] for s in np.unique(side).tolist()
    }


def possible_jogs(scene: Any, extents: dict[int, list[tuple[float, float]]]) -> dict[str, list[int]]:
    """Least and largest number of jogs that the limit set admits.

    Jogs increase with x, so the number of them until the part flips falls with the x at which it comes onto the side.
    Two starts decide: the lowest and the highest x at which the flipping part of the side before arrives.
    """
    critical = ls.critical_points(scene.map, scene.domain)
    found = {}
    for side in sorted(extents):
        before = (side - 1) % len(scene.sides)
        r = critical[before][0].x
        flipping = [(max(lo, r), hi) for lo, hi in extents[before] if hi >= r]
        ends = [min(lo for lo, _ in flipping), max(hi for _, hi in flipping)]
        arrivals, _ = ls.maps.images_on(scene.map, ends, before, FLIP)
        found[str(side)] = sorted(_jogs_from(scene, float(x), side) for x in arrivals)
    return found


def _jogs_from(scene: Any, x: float, side: int) -> int:
    path = ls.orbit(scene.map, x, side, 1000)
    return int(np.flatnonzero(path.code == FLIP)[0])


def run(name: str, seed: int = 0) -> dict[str, Any]:
    """Answer the study's question for one scene."""
    analysis = ls.analyse(name)
    scene, extents = analysis.scene, analysis.extents[0]
    path = long_orbit(scene, seed)
    steps = ls.maps.lyapunov(scene.map, float(path.x[0]), int(path.side[0]), THROWS)
    return {
        "attractors": len(analysis.attractors),
        "share_of_starts": analysis.basins.attractors[0],
        "extents": {str(side): [list(pair) for pair in parts] for side, parts in extents.items()},
        "seen_on_orbit": {
            str(side): [
                float(end) for end in (path.x[path.side == side].min(), path.x[path.side == side].max())
            ]
            for side in extents
        },
        "jogs_possible": possible_jogs(scene, extents),
        "jogs_counted": counted_jogs(path),
        "flips_per_throw": float((path.code == FLIP).mean()),
        "lyapunov": steps.exponent,
        "ln_small_angle_slope": math.log(1.0 + 2.0 * abs(scene.surface_height) / scene.kappa),
    }


def table(numbers: dict[str, dict[str, Any]]) -> str:
    """Write the numbers as a Markdown table, one line per scene and side."""
    lines = [
        (
            "| scene | side | limit set [in] | jogs per visit | flips per throw | Lyapunov exponent "
            "| ln(1 + 2\\|h\\|/kappa) |"
        ),
        "|---|---|---|---|---|---|---|",
    ]
    for name, found in numbers.items():
        for side, parts in found["extents"].items():
            intervals = " and ".join(f"{lo:.6f} to {hi:.6f}" for lo, hi in parts)
            least, most = found["jogs_possible"][side]
            jogs = str(least) if least == most else f"{least} to {most}"
            rest = ["", "", ""]
            if side == "0":
                rest = [
                    f"{found[key]:.4f}" for key in ("flips_per_throw", "lyapunov", "ln_small_angle_slope")
                ]
            lines.append(
                "| " + " | ".join([name if side == "0" else "", side, intervals, jogs, *rest]) + " |"
            )
    return "\n".join(lines)


def figure() -> Figure:
    """Draw the four limit sets."""
    drawn = Figure(figsize=(17.0, 10.5), layout="constrained")
    for axes, name in zip(drawn.subplots(2, 2).ravel(), SCENES, strict=True):
        analysis = ls.analyse(name)
        ls.plot.limit_set(analysis.scene, analysis, axes=axes)
        axes.set_title(name, loc="left")
    drawn.suptitle(
        "Where the part comes to rest (bars), throws of one orbit (solid: jogs, dashed: flips), "
        "and where flipping parts land (grey)"
    )
    return drawn


def main(seed: int = 0, out: Path = HERE) -> dict[str, dict[str, Any]]:
    """Run the study, write its figure, and return its numbers."""
    numbers = {name: run(name, seed) for name in SCENES}
    out.mkdir(parents=True, exist_ok=True)
    figure().savefig(out / "limit-sets.png", dpi=90)
    return numbers


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Limit sets of the paper's four scenes.")
    parser.add_argument("--seed", type=int, default=0, help="of the start of the long orbits")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of the figure")
    parser.add_argument("--json", action="store_true", help="print all numbers as JSON")
    words = parser.parse_args()
    answer = main(words.seed, words.out)
    print(json.dumps(answer, indent=2) if words.json else table(answer))
