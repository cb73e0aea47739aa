"""One bit of feedback for the initial part of the paper, whose goal fails without a sensor.

Run it as ``python studies/11_feedback/study.py [--seed 0] [--out FOLDER] [--parts 10000] [--json]``.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.ticker import MaxNLocator

import limitsets as ls
from limitsets.face.plot import style
from limitsets.feeder.scene.surroundings import BeyondSensor, SideSensor
from limitsets.proofs.policies import places
from limitsets.proofs.policies.simulation import not_within, simulate

HERE = Path(__file__).resolve().parent
# fixed before the first search: the part's own throw, and one at 110 % of its speed (kappa / 1.21)
THROWS = [{"name": "own", "kappa": "33.3605945 in"}, {"name": "fast", "kappa": "27.57073926 in"}]
SENSORS = {
    "nothing": "none",
    "beyond 20 in?": BeyondSensor(20.0),
    "on side 0?": SideSensor(0),
    "on side 1?": SideSensor(1),
    "on side 2?": SideSensor(2),
}
MODES = {"stop": BeyondSensor(20.0), "catch": SideSensor(2)}  # the sensors of the later tables
FROM = (16.0, 12.0, 8.0, 6.0)
NOISE = (
    {"throw.speed": "0.1 %"},
    {"throw.speed": "0.3 %"},
    {"throw.speed": "1 %"},
    {"landing.x": "0.005 in"},
)
PLACES = np.linspace(13.0, 22.0, 37)
APART = 0.1  # of the enclosed starts


def scene_of(name: str = "paper-initial") -> Any:
    """Load the scene, with its throws to choose from."""
    tree = ls.load(name).as_dict()
    tree["feedback"] = {"throws": THROWS, "sensor": {"beyond": "20 in"}}
    return ls.load(tree)


def row(found: Any, seed: int, parts: int) -> dict[str, Any]:
    """Collect what was found, and what became of thrown parts."""
    numbers: dict[str, Any] = {"verdict": found.found.verdict, "throws": found.found.throws}
    if found.solved:
        thrown = simulate(found, parts, seed)
        numbers |= {
            "states": found.found.policy.states,
            "reached": thrown.reached,
            "mean": round(thrown.mean, 2),
        }
    return numbers


def said(numbers: dict[str, Any]) -> str:
    """Write a verdict as the table has it."""
    if numbers["verdict"] == "solved":
        return f"{numbers['throws']} throws, {numbers['states']} states"
    return f"not with {numbers['throws']}" if numbers["verdict"] == "not-solved" else "not decided"


def table(numbers: dict[str, Any]) -> str:
    """Write the verdicts as Markdown tables."""
    parts = []
    for head, rows in (("asked", "sensors"), ("starts", "starts"), ("noise at every throw", "noise")):
        lines = [f"| {head} | stop | catch |", "|---|---|---|"]
        lines += [
            f"| {name} | {said(each['stop'])} | {said(each['catch'])} |"
            for name, each in numbers[rows].items()
        ]
        parts.append("\n".join(lines))
    return "\n\n".join(parts)


def drawn(swept: dict[str, Any]) -> Any:
    """Draw the throws needed against the sensor's place."""
    figure, (axes,) = style.canvas(7.4, 3.6)
    look = {"stop": (style.JOG, "o", "stop"), "catch": (style.FLIP, "s", "catch")}
    for mode, (colour, marker, label) in look.items():
        rows = swept[mode]
        good = [(each["x"], each["throws"]) for each in rows if each["verdict"] == "solved"]
        x, throws = zip(*good, strict=True)
        shape = (
            {"ms": 4.5} if mode == "stop" else {"ms": 9.0, "mfc": "none"}
        )  # both can be seen where they meet
        axes.plot(x, throws, ls="", marker=marker, color=colour, label=label, **shape)
    axes.set_xlabel("place of the sensor [in]", fontsize=style.SMALL)
    axes.set_ylabel("throws that are enough", fontsize=style.SMALL)
    axes.set_xlim(PLACES[0] - 0.3, PLACES[-1] + 0.3)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.tick_params(labelsize=style.SMALL)
    style.open_frame(axes)
    style.title(
        figure, "paper-initial, one bit (is the part beyond x?); no mark: no policy found within 30 throws"
    )
    style.legend(figure, axes.get_legend_handles_labels()[0], 2)
    return figure


def enclosed(found: Any, most: int) -> dict[str, Any]:
    """Show on starts of the limit set, 0.1 in apart, within how many throws no policy serves them."""
    starts = [
        (float(x), side)
        for side, spans in found.starts.extents().items()
        for lo, hi in spans
        for x in np.arange(lo + APART / 2, hi, APART)
    ]
    shown = not_within(found, starts, most, seconds=300.0)
    return {"starts": len(starts), "not_within": shown.throws}


def main(
    seed: int = 0, out: Path = HERE, parts: int = 10_000, cells: int = 1024, most: int = 12
) -> dict[str, Any]:
    """Run the study, write the figures into `out`, return the numbers."""
    scene = scene_of()
    out.mkdir(parents=True, exist_ok=True)
    numbers: dict[str, Any] = {"sensors": {}, "starts": {}, "noise": {}, "swept": {}}
    for name, sensor in SENSORS.items():
        both = {mode: ls.feedback(scene, sensor, mode=mode, cells=cells) for mode in MODES}
        numbers["sensors"][name] = {mode: row(found, seed, parts) for mode, found in both.items()}
        if name in ("nothing", "beyond 20 in?"):
            numbers.setdefault("enclosed", {})[name] = enclosed(both["stop"], most)
        if name == "on side 2?":
            ls.plot.policy(both["catch"]).savefig(out / "policy.png", dpi=110)
    for x in FROM:
        found = {
            mode: ls.feedback(scene, sensor, mode=mode, cells=cells, starts=x, throws=60)
            for mode, sensor in MODES.items()
        }
        numbers["starts"][f"every x from {x:g} in on"] = {
            mode: row(each, seed, parts) for mode, each in found.items()
        }
    for noise in NOISE:
        found = {
            mode: ls.feedback(scene, sensor, mode=mode, cells=cells, noise=noise, throws=40)
            for mode, sensor in MODES.items()
        }
        ((name, size),) = noise.items()
        numbers["noise"][f"{name} {size}"] = {mode: row(each, seed, parts) for mode, each in found.items()}
    for mode in MODES:
        swept = places(scene, PLACES.tolist(), mode=mode, cells=cells, beliefs=20_000)
        numbers["swept"][mode] = [
            {"x": each.sensor.x, "verdict": each.found.verdict, "throws": each.found.throws} for each in swept
        ]
    drawn(numbers["swept"]).savefig(out / "places.png", dpi=130)
    return numbers


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=HERE)
    parser.add_argument("--parts", type=int, default=10_000)
    parser.add_argument("--json", action="store_true", help="print all numbers")
    given = parser.parse_args()
    answers = main(given.seed, given.out, given.parts)
    print(json.dumps(answers, indent=1) if given.json else table(answers))
    if not given.json:
        print(json.dumps(answers["enclosed"]))
        print(
            json.dumps(
                {
                    mode: [each for each in rows if each["verdict"] != "not-solved"]
                    for mode, rows in answers["swept"].items()
                }
            )
        )
