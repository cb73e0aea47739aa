"""What random noise makes of the designed part: the transfer operator beside throws, and what more noise changes.

Run it as ``python studies/05_noise/study.py [--seed 0] [--out FOLDER] [--throws 4000000] [--json]``.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import limitsets as ls
from limitsets.feeder.scattering import Gaussian, Scattering, starts_from
from limitsets.parameters.noise.sampling import throw_many
from limitsets.parameters.noise.statistics import noise_levels

HERE = Path(__file__).resolve().parent
SCENE, GOAL = "paper-designed", (20.5, 2)
NOISE = Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02))
FACTORS = (0.0, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0)
SHORT = 23.6  # an arm that ends just beyond the limit set, which reaches to 23.383
NUMBERS = (
    "time on side 0",
    "time on side 2",
    "share of flip",
    "time beyond",
    "wrong beyond",
    "mean throws",
    "95 % throws",
)


def compared(
    scene: Any, noise: Scattering, throws: int, parts: int, seed: int, *, slopes: bool = False
) -> tuple[dict[str, Any], Any, Any]:
    """Solve one case both ways: numbers, the statistics, the throws."""
    found = ls.noise_statistics(scene, noise, goal=GOAL, sensitivity=slopes)
    thrown = throw_many(scene, noise, GOAL, starts_from(scene), throws=throws, parts=parts, seed=seed)
    rows = {
        number: {
            "operator": found.numbers[number],
            "its error": found.errors[number],
            "thrown": thrown.numbers[number],
            "its standard error": thrown.errors[number],
        }
        for number in (*NUMBERS, "fed")
        if number in thrown.numbers
    }
    escape = {"operator": found.numbers["escape"], "its error": found.errors["escape"]}
    derivatives = {
        quantity: {number: table[number].slope for number in NUMBERS}
        for quantity, table in found.sensitivity.items()
    }
    return {"numbers": rows, "escape": escape, "slopes": derivatives}, found, thrown


def table(cases: dict[str, dict[str, Any]]) -> str:
    """Write the numbers as a Markdown table."""
    lines = [
        "| case | number | operator | its error | thrown | its standard error |",
        "|---|---|---|---|---|---|",
    ]
    for name, case in cases.items():
        first = name
        for number, row in case["numbers"].items():
            cells = " | ".join(
                f"{value:.3g}" if "error" in key else f"{value:.6g}" for key, value in row.items()
            )
            lines.append(f"| {first} | {number} | {cells} |")
            first = ""
    return "\n".join(lines)


def main(
    seed: int = 0, out: Path = HERE, throws: int = 4_000_000, parts: int = 20_000, slopes: bool = True
) -> dict[str, Any]:
    """Run the study, write the figures into `out`, return the numbers."""
    scene = ls.load(SCENE)
    short = scene.with_values({"arm.length": SHORT})
    out.mkdir(parents=True, exist_ok=True)
    cases = {}
    cases["no noise"], _, _ = compared(scene, Scattering(), throws, parts, seed)
    cases["noise"], found, thrown = compared(scene, NOISE, throws, parts, seed, slopes=slopes)
    cases["twice the noise"], _, _ = compared(scene, NOISE.scaled(2.0), throws, parts, seed)
    cases["short arm"], _, _ = compared(short, NOISE, throws, parts, seed)
    ls.plot.noise_density(found, thrown).savefig(out / "density.png", dpi=130)
    ls.plot.noise_arrivals(found, thrown).savefig(out / "arrivals.png", dpi=130)
    levels = {}
    for name, chosen in (("levels", scene), ("levels-short-arm", short)):
        swept = noise_levels(chosen, NOISE, factors=FACTORS, goal=GOAL, cells=512)
        ls.plot.noise_levels(swept, {"noise of the speed [%]": 0.5}).savefig(out / f"{name}.png", dpi=130)
        levels[name] = {
            number: [None if value != value else float(value) for value in swept.numbers[number]]
            for number in ("wrong beyond", "mean throws", "95 % throws", "escape", "lost")
        }
    return {"cases": cases, "factors": list(FACTORS), "levels": levels}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=HERE)
    parser.add_argument("--throws", type=int, default=4_000_000)
    parser.add_argument("--json", action="store_true", help="print all numbers")
    given = parser.parse_args()
    answers = main(given.seed, given.out, given.throws)
    print(json.dumps(answers, indent=1) if given.json else table(answers["cases"]))
    if not given.json:
        print(json.dumps({name: case["slopes"] for name, case in answers["cases"].items() if case["slopes"]}))
        print(json.dumps({name: case["escape"] for name, case in answers["cases"].items()}))
        print(json.dumps(answers["levels"]))
