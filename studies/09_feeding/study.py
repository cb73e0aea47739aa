"""Feeding beside the paper's trials: which scenes feed rightly, how surely, and what goes wrong in the others.

Run it as ``python studies/09_feeding/study.py [--seed 0] [--trials 100000] [--out FOLDER] [--json]``.
"""

from __future__ import annotations

import argparse
import json
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

import limitsets as ls
from limitsets.cell.feeding import Feeding
from limitsets.cell.feeding.falling import arm_end_of
from limitsets.cell.feeding.proving import proved_feeding
from limitsets.cell.feeding.trials import SERIES
from limitsets.feeder.scattering import Gaussian, Scattering, Uniform
from limitsets.parameters.noise.sampling import binomial_interval

HERE = Path(__file__).resolve().parent
CAVITY = tomllib.loads((HERE.parent / "sizes.toml").read_text(encoding="utf-8"))["cavity"]
PAPER = 19  # so many of 20 triangles fell rightly into the paper's cavity
ROBUST = HERE.parent / "07_robust_design" / "expected.json"
# The noise of study 05; and bounds, of which something can be proved of every sequence.
NORMAL = Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02))
BOUNDED = {"throw.speed": "0.5 %", "landing.x": "0.01 in"}
WITHIN = Scattering(speed=Uniform(0.005), landing=Uniform(0.01))


def fed(scene: Any, name: str, rate: str | None = None, **changes: str) -> Any:
    """Give a scene the cavity of sizes.toml, and a rate of throws."""
    tree = {**scene.as_dict(), "name": name, "cavity": {**CAVITY, **changes}}
    return ls.load(tree if rate is None else {**tree, "world": {"throw_rate": rate}})


def robust_scene() -> tuple[Any, str]:
    """Give the feeder of study 07, paper-designed with the values found there, and its own X, where its arm ends."""
    known = json.loads(ROBUST.read_text(encoding="utf-8"))
    scene = ls.load("paper-designed").with_values(known["values"])
    goal = {"oriented_beyond": {"x": f"{known['x']} in", "side": 2}}
    return ls.load({**scene.as_dict(), "goal": goal}), f"{known['x']} in"


class Case(NamedTuple):
    """A scene, the noise thrown, that of the proofs, and whether starts are those from which feeding is proved."""

    scene: Any
    scatter: Scattering
    noise: dict[str, str]
    named: bool = False

    def laid(self) -> dict[int, list[tuple[float, float]]] | None:
        """By side from where almost every start is proved to be fed to the end of the arm."""
        if not self.named:
            return None
        end = arm_end_of(self.scene)
        fed = proved_feeding(end, self.noise).fed
        return {int(side): [(x, end.x)] for side, x in fed.almost_from["from"].items()}


def cases() -> dict[str, Case]:
    """Give the scenes by name."""
    designed, initial = ls.load("paper-designed"), ls.load("paper-initial")
    robust, x = robust_scene()
    robust = fed(robust, "robust", position=x)
    return {
        "robust, starts named": Case(robust, WITHIN, BOUNDED, named=True),
        "robust, all starts": Case(robust, WITHIN, BOUNDED),
        "designed, starts named": Case(fed(designed, "designed"), WITHIN, BOUNDED, named=True),
        "designed, 2 Hz": Case(fed(designed, "designed 2 Hz", "2 Hz"), NORMAL, {}),
        "designed, 2 Hz, from rest": Case(fed(designed, "from rest", "2 Hz", tips="rest"), NORMAL, {}),
        "designed, 4 Hz, from rest": Case(fed(designed, "from rest", "4 Hz", tips="rest"), NORMAL, {}),
        "initial": Case(fed(initial, "initial"), NORMAL, {}),
    }


def row(found: Feeding) -> dict[str, Any]:
    """Collect the numbers of one case."""
    shares, trials, rate = found.shares, found.trials, found.end.scene.world.throw_rate
    series = trials.series()
    return {
        "safety": found.safe.verdict,
        "sides that can be fed": sorted(found.safe.possible),
        "progress": found.fed.verdict,
        "progress of almost every start": found.fed.almost_every,
        "throws proved": found.fed.throws,
        "starts from": found.end.starts.tolist(),
        "share of starts that may leave": found.safe.leaving,
        "probability": shares.shares,
        "its error": found.errors,
        "trials": trials.counts,
        "right, 95 % interval": binomial_interval(trials.counts["right"], trials.fate.size),
        "series of 20 with 19 or 20 right": float((series >= PAPER).mean()) if series.size else None,
        "first series": int(series[0]) if series.size else None,
        "mean throws": shares.mean_throws,
        "95 % throws": shares.quantile(0.95),
        "right per minute": shares.per_minute(rate),
        "clear from": found.end.clear[0][0] if found.end.clear else None,
        "corner beyond the end": float(trials.beyond.mean()),
        "level for 95 %": None if found.curve is None else found.curve.level,
    }


def table(rows: dict[str, dict[str, Any]]) -> str:
    """Write the numbers as a Markdown table, the paper's counts in its first line."""
    low, high = binomial_interval(PAPER, SERIES)
    lines = [
        "| case | right | wrong | wall | edge | left | right, 95 % interval | 19 or 20 right | throws | 95 % | level |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
        f"| the paper | {PAPER} of {SERIES} | | | | | {low:.3f} to {high:.3f} | | | | |",
    ]
    for name, found in rows.items():
        shares = " | ".join(
            f"{found['probability'][fate]:.4f}" for fate in ("right", "wrong", "wall", "edge", "left")
        )
        least, most = found["right, 95 % interval"]
        level = found["level for 95 %"]
        times = "not reached" if level is None else "0"
        if level is not None and level[1] > 0.0:
            times = f"{level[0]:.2f} to {level[1]:.2f} times"
        lines.append(
            f"| {name} | {shares} | {least:.5f} to {most:.5f} | {found['series of 20 with 19 or 20 right']:.3f}"
            f" | {found['mean throws']:.1f} | {found['95 % throws']} | {times} |"
        )
    return "\n".join(lines)


def main(seed: int = 0, out: Path = HERE, trials: int = 100_000, *, level: bool = True) -> dict[str, Any]:
    """Run the study, write the figure into `out`, return the numbers."""
    out.mkdir(parents=True, exist_ok=True)
    rows = {}
    for name, case in cases().items():
        found = ls.feed(
            case.scene,
            case.scatter,
            laid=case.laid(),
            noise=case.noise,
            trials=trials,
            seed=seed,
            level=level,
        )
        rows[name] = row(found)
        if name in ("designed, 2 Hz", "initial"):
            file = "designed.png" if name.startswith("designed") else "initial.png"
            ls.plot.feeding(found).savefig(out / file, dpi=130)
    return rows


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--trials", type=int, default=100_000)
    parser.add_argument("--out", type=Path, default=HERE)
    parser.add_argument("--json", action="store_true", help="print all numbers")
    given = parser.parse_args()
    answers = main(given.seed, given.out, given.trials)
    print(json.dumps(answers, indent=1) if given.json else table(answers))
