"""The tray: how its depressions fill, and whether they forget.

Run it as ``python studies/14_tray/study.py [--seed 0] [--drops 8000] [--histories 200] [--out FOLDER] [--json]``.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import limitsets as ls
from limitsets.cell.trays import TrayFill
from limitsets.cell.trays.passing import Histories, histories as follow, passes_of, random_of
from limitsets.feeder.engine.depression import UNFINISHED
from limitsets.parameters.noise.sampling import binomial_interval

HERE = Path(__file__).resolve().parent
PASSES, SHORT = 200, 3
STEP = 4e-3


def scene() -> Any:
    """Give the designed triangle over the tray of sizes.toml."""
    return ls.load(HERE / "tray.toml")


def halved(seed: int, trials: int) -> dict[str, Any]:
    """Let the same parts come by, and the same kicks act on seated ones, with the engine's step and with half of it."""
    steps = [passes_of(scene(), None, step) for step in (STEP, STEP / 2)]
    found = []
    for k in range(trials):
        came, kicked = [], []
        for passes in steps:
            came.append(passes.plate.settle(*passes.arrival(random_of(seed, 0, k))).state)
            seated = passes.plate.seated(passes.side)
            kicked.append(passes.plate.settle(seated, passes.kick(random_of(seed, 1, k))).state)
        found.append((came, kicked))
    table = np.array(found)  # trial, arrival or kick, step
    right = steps[0].right
    rows = {}
    for number, word in enumerate(("captured rightly", "released")):
        met = table[:, number] == right if number == 0 else table[:, number] != right
        rows[word] = [
            {"count": int(n), "interval": binomial_interval(int(n), trials)} for n in met.sum(axis=0).tolist()
        ]
        rows[f"{word}: trials that differ"] = int((met[:, 0] != met[:, 1]).sum())
    rows["trials"], rows["unfinished"] = trials, int((table == UNFINISHED).sum())
    return rows


def forgetting(seed: int, number: int) -> dict[str, Any]:
    """Count captures after misses in many short histories, which are mostly about the empty depression."""
    asked = passes_of(scene(), None, STEP)
    found = {}
    for returning, word in ((False, "new parts"), (True, "parts return")):
        short = follow(asked, number, SHORT, seed + 1, returning=returning)
        found[word] = after(short.captures())
    return found


def agreement(found: TrayFill, each: Histories) -> list[dict[str, Any]]:
    """Set the chain beside histories after some passes."""
    rows = []
    for n in (1, 2, 5, 10, 20, 50, 100, PASSES):
        low, high = each.interval(n)
        lo, hi = found.filled.interval[n].tolist()
        chain, history = float(found.filled.right[n]), float(each.filled[n])
        rows.append(
            {
                "passes": n,
                "chain": chain,
                "chain interval": (lo, hi),
                "histories": history,
                "interval": (low, high),
                "meet": low <= hi and lo <= high,
            }
        )
    return rows


def after(counts: Sequence[tuple[int, int]]) -> list[dict[str, Any]]:
    """Give shares after 0, 1 and 2 or more with their intervals."""
    return [{"count": n, "of": of, "interval": binomial_interval(n, of)} for n, of in counts]


def main(seed: int = 0, out: Path = HERE, drops: int = 8000, histories: int = 200) -> dict[str, Any]:
    """Run the study, write the figures into `out`, return the numbers."""
    out.mkdir(parents=True, exist_ok=True)
    found = ls.tray(scene(), passes=PASSES, drops=drops, histories=histories, seed=seed, step=STEP)
    ls.plot.tray(found).savefig(out / "tray.png", dpi=130)
    new, back = found.histories
    numbers: dict[str, Any] = {
        "tray": {key: value for key, value in found.to_json().items() if key != "histories"},
        "chain and histories": agreement(found, new),
        "chain and parts that return": agreement(found, back),
        "captured rightly after misses": {
            "new parts": after(new.captures()),
            "parts return": after(back.captures()),
        },
        "released after kicks stood": {
            "new parts": after(new.releases()),
            "parts return": after(back.releases()),
        },
        "captured rightly after misses, short": forgetting(seed, 30 * histories),
        "step halved": halved(seed, max(drops // 4, 10)),
    }
    return numbers


def table(numbers: dict[str, Any]) -> str:
    """Write the numbers as Markdown tables."""
    tray = numbers["tray"]
    filled, came = tray["filled"], tray["arrivals"]
    lines = ["| state | a part that came by | stands a kick | after endless passes |", "|---|---|---|---|"]
    for name, share in filled["last"].items():
        low, high = filled["last_interval"][name]
        kicks = tray["kicks"].get(name)
        stands = "" if kicks is None else f"{kicks['counts'][name] / kicks['of']:.3f}"
        lines.append(
            f"| {name} | {came['counts'][name] / came['of']:.3f} | {stands} | {share:.3f} ({low:.3f} to {high:.3f}) |"
        )
    lines += ["", "| passes | chain | histories, new parts | histories, parts return |", "|---|---|---|---|"]
    pairs = zip(numbers["chain and histories"], numbers["chain and parts that return"], strict=True)
    for new, back in pairs:
        cells = [f"{new['passes']}", _share(new["chain"], new["chain interval"])]
        cells += [_share(each["histories"], each["interval"]) for each in (new, back)]
        lines.append(f"| {' | '.join(cells)} |")
    lines += ["", "| | parts | after 0 | after 1 | after 2 or more |", "|---|---|---|---|---|"]
    captured, released = "captured rightly after misses", "released after kicks stood"
    for what in (captured, f"{captured}, short", released):
        for parts, rows in numbers[what].items():
            cells = [f"{each['count']} of {each['of']}, {_span(each['interval'])}" for each in rows]
            lines.append(f"| {what} | {parts} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _share(value: float, interval: Sequence[float]) -> str:
    return f"{value:.3f} ({_span(interval)})"


def _span(interval: Sequence[float]) -> str:
    return f"{interval[0]:.3f} to {interval[1]:.3f}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--drops", type=int, default=8000)
    parser.add_argument("--histories", type=int, default=200)
    parser.add_argument("--out", type=Path, default=HERE)
    parser.add_argument("--json", action="store_true", help="print all numbers")
    given = parser.parse_args()
    answers = main(given.seed, given.out, given.drops, given.histories)
    print(json.dumps(answers, indent=1) if given.json else table(answers))
