"""Critical points where they are wanted: the paper's method on both of its pairs, and its printed numbers.

Run it as ``python studies/06_critical_points/study.py [--seed 0] [--generations 40] [--out FOLDER]``; the longer
search whose results expected.json records is ``--generations 300`` (several minutes).
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from critical_printed import CASES, found_constants, outside

import limitsets as ls
from limitsets.parameters.design import critical_jacobian

HERE = Path(__file__).resolve().parent
ALONG, ABOVE, SPEED, KAPPA = (
    "part.mass.center.along",
    "part.mass.center.above",
    "throw.speed",
    "throw.kappa",
)
VARY = (ALONG, ABOVE, SPEED)
WANTED = (10.0, 10.0, 20.0)
PAIRS = {"small-angle": "paper-initial-small-angle", "exact": "paper-initial"}
SCENES = ("paper-initial-small-angle", "paper-designed-small-angle", "paper-initial", "paper-designed")
STARTS, STAGES = 30, 5


def derivatives() -> dict[str, Any]:
    """Compute determinant and condition number of d(r_0, r_1, r_2)/d(along, above, w/w_0) in the four scenes."""
    found = {name: critical_jacobian(name, *VARY) for name in SCENES}
    return {name: {"determinant": one.determinant, "condition": one.condition} for name, one in found.items()}


def pair(name: str) -> dict[str, Any]:
    """Design one pair from the scene as it is, as its file gives it back."""
    found = ls.design(name, critical_points=WANTED, vary=VARY)
    again = ls.load(found.scene.as_dict())
    points = [points[0].x for points in ls.critical_points(again.map, again.domain).values()]
    return {
        "reached": found.reached,
        "how": found.how,
        "evaluations": found.evaluations,
        "along": again.value(ALONG),
        "above": again.value(ABOVE),
        "kappa": again.kappa,
        "speed_before": found.start.value(SPEED),
        "speed": again.value(SPEED),
        "condition": found.condition,
        "worst_miss": float(np.abs(np.array(points) - WANTED).max()),
    }


def starts(name: str, seed: int, count: int = STARTS) -> dict[str, Any]:
    """Design from starts perturbed by N(0, 0.1) in along, above [in] and ln kappa; no start is drawn a second time."""
    scene, random = ls.load(name), np.random.default_rng(seed)
    center = np.array([scene.value(ALONG), scene.value(ABOVE), np.log(scene.kappa)])
    ends, counts = [], []
    for _ in range(count):
        along, above, log = (center + 0.1 * random.standard_normal(3)).tolist()
        start = scene.with_values({ALONG: along, ABOVE: above, KAPPA: float(np.exp(log))})
        found = ls.design(start, critical_points=WANTED, vary=(ALONG, ABOVE, KAPPA), starts=0)
        counts.append(found.evaluations)
        if found.reached:
            ends.append([value for _, value, _ in found.quantities().values()])
    return {
        "starts": count,
        "reached": len(ends),
        "apart": float(np.ptp(ends, axis=0).max()),
        "evaluations": [min(counts), max(counts)],
    }


def figures(out: Path) -> None:
    """Draw how the limit sets move from the initial to the designed scene, for both models."""
    out.mkdir(parents=True, exist_ok=True)
    for model, name in PAIRS.items():
        found = ls.design(name, critical_points=WANTED, vary=VARY, stages=STAGES)
        ls.plot.design(found).savefig(out / f"moving-{model}.png", dpi=110)


def main(
    seed: int = 0, out: Path = HERE, generations: int = 40, count: int = STARTS, tell: Any = None
) -> dict[str, Any]:
    """Run the study, write its figures, and return its numbers."""
    figures(out)
    return {
        "derivatives": derivatives(),
        "pairs": {model: pair(name) for model, name in PAIRS.items()},
        "starts": {model: starts(name, seed, count) for model, name in PAIRS.items()},
        "printed": {
            f"{case.model}, {case.triangle} triangle": found_constants(case, seed, generations, tell)
            for case in CASES
        },
        "outside": outside(),
    }


def table(numbers: dict[str, Any]) -> str:
    """Write the numbers of the method as Markdown tables."""
    lines = ["| scene | determinant | condition number |", "|---|---|---|"]
    for name, one in numbers["derivatives"].items():
        lines.append(f"| {name} | {one['determinant']:.1f} | {one['condition']:.1f} |")
    lines += [
        "",
        "| model | along [in] | above [in] | kappa [in] | w, before and after [rad/s] | evaluations | miss [in] |",
        "|---|---|---|---|---|---|---|",
    ]
    for model, one in numbers["pairs"].items():
        lines.append(
            f"| {model} | {one['along']:.7f} | {one['above']:.7f} | {one['kappa']:.7f} "
            f"| {one['speed_before']:.4f}, {one['speed']:.4f} | {one['evaluations']} | below 1e-9 |"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Critical points where they are wanted.")
    parser.add_argument("--seed", type=int, default=0, help="of the starts and of the search")
    parser.add_argument("--generations", type=int, default=40, help="of the search for the paper's constants")
    parser.add_argument("--out", type=Path, default=HERE, help="folder of the figures")
    parser.add_argument("--json", action="store_true", help="print all numbers as JSON")
    words = parser.parse_args()
    answer = main(words.seed, words.out, words.generations, tell=lambda text: print(text, file=sys.stderr))
    print(json.dumps(answer, indent=2) if words.json else table(answer))
    for reading, best in answer["printed"].items() if not words.json else ():
        print(f"printed numbers, {reading}: best rms {best['rms']:.2f} in")
