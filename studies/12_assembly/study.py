"""Assembly beside the paper's trials: two parts thrown together, without contact and in the engine, and one by one.

Run it as ``python studies/12_assembly/study.py [--seed 0] [--trials 2000] [--few 500] [--keep FOLDER] [--json]``; with
--keep finished trials are kept, and the same command goes on.  ``design.py`` designs the second part.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from halved_step import both_steps
from rate_search import confirmed
from serial_feeding import one_by_one

import limitsets as ls
from limitsets.base.files import as_plain, as_table, picked
from limitsets.cell.assembly import Assembly
from limitsets.cell.assembly.assembly_run import Rate, rate_of
from limitsets.feeder.scattering import Gaussian, Scattering

HERE = Path(__file__).resolve().parent
PAPER, SURVIVED, OF = (
    11,
    17,
    20,
)  # of the paper's 20 trials 11 assembled; of 20 assembled pairs 17 survived a throw
NAMES = ("paper-triangle", "paper-quadrilateral")
NOISE = Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02))  # of study 05
CASES: dict[str, dict[str, Any]] = {
    "pass through each other": {},
    "pass through, starts apart": {"apart": True},
    "hinge, cavity carried": {"contact": "hinge"},
    "hinge, cavity stands": {"contact": "hinge", "carried": False},
    "unilateral, cavity carried": {"contact": "unilateral"},
}
LONG = ("pass through each other", "hinge, cavity carried")


def initial_twice(seed: int, trials: int) -> dict[str, Any]:
    """Two parts as in paper-initial, both of which can fail: the joint law, of which multiplying knows nothing."""
    cavity = ls.load(NAMES[0]).as_dict()["cavity"]
    part = ls.load({**ls.load("paper-initial").as_dict(), "cavity": cavity})
    joint = ls.assemble(part, part, NOISE, trials=trials, seed=seed).joint
    assert joint is not None
    names = ("rates", "both", "product", "error", "error_interval")
    return as_table(**picked(joint, *names))


def scenes(*, contact: bool) -> list[Any]:
    """Give both parts, with contact or without."""
    trees = [ls.load(name).as_dict() for name in NAMES]
    return [
        ls.load({**tree, "effects": {**tree["effects"], "contact": True}} if contact else tree)
        for tree in trees
    ]


def ran(name: str, seed: int, trials: int, keep: Path | None, workers: int | None) -> Assembly:
    """Make the trials of a case."""
    how = CASES[name]
    file = None if keep is None else keep / f"{name.replace(' ', '-').replace(',', '')}.json"
    parts = scenes(contact="contact" in how)
    return ls.assemble(*parts, NOISE, trials=trials, seed=seed, file=file, workers=workers, **how)


def row(found: Assembly) -> dict[str, Any]:
    """Collect the numbers of a case."""
    return {
        **found.to_json(),
        "touched": sum(bool(each.get("touched")) for each in found.rows),
        "second first": sum(each["throws"][1] < each["throws"][0] for each in found.rows),
    }


def words(rate: Rate) -> str:
    """Write a rate with its interval."""
    return f"{rate.count} of {rate.of}, {rate.interval[0]:.3f} to {rate.interval[1]:.3f}"


def table(found: dict[str, dict[str, Any]]) -> str:
    """Write outcomes as a Markdown table, the paper's counts in its first line."""
    names = ("assembled", "order", "wrong", "wall", "ejected", "edge", "left", "never", "unfinished")
    lines = [
        f"| case | trials | {' | '.join(names)} | assembled, 95 % | first 20 | whole after the next throw |"
    ]
    lines.append("|---" * (len(names) + 5) + "|")
    interval = words(rate_of(PAPER, OF)).split(", ")[1]
    others = " |" * (len(names) - 1)
    lines.append(
        f"| the paper | {OF} | {PAPER} |{others} {interval} | {PAPER} | {words(rate_of(SURVIVED, OF))} |"
    )
    for name, each in found.items():
        low, high = each["assembled"]["interval"]
        survived = "; ".join(
            f"{what}: {rate['count']} of {rate['of']}, {rate['interval'][0]:.3f} to {rate['interval'][1]:.3f}"
            for what, rate in (each["survived"] or {}).items()
        )
        counts = " | ".join(str(each["counts"][word]) for word in names)
        first = each["first_series"]["assembled"]
        lines.append(
            f"| {name} | {each['trials']} | {counts} | {low:.3f} to {high:.3f} | {first} | {survived} |"
        )
    return "\n".join(lines)


def main(
    seed: int = 0,
    out: Path = HERE,
    trials: int = 2000,
    few: int = 500,
    keep: Path | None = None,
    workers: int | None = None,
    *,
    search: bool = True,
) -> dict[str, Any]:
    """Run the study, write the figures into `out`, return the numbers."""
    out.mkdir(parents=True, exist_ok=True)
    found = {name: ran(name, seed, trials if name in LONG else few, keep, workers) for name in CASES}
    for name, file in ((LONG[0], "passing.png"), (LONG[1], "contact.png")):
        ls.plot.assembly(found[name]).savefig(out / file, dpi=110)
    answers: dict[str, Any] = {"cases": {name: row(each) for name, each in found.items()}}
    answers["two initial parts"] = initial_twice(seed, trials)
    parts = scenes(contact=True)
    answers["one by one"] = {
        contact: as_plain(one_by_one(parts, NOISE, contact, few // 2, seed))
        for contact in ("hinge", "unilateral")
    }
    answers["halved step"] = as_plain(both_steps(parts, NOISE, few, seed))
    if search:
        answers["search"] = as_plain(confirmed(parts, NOISE, seed))
    return answers


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--trials", type=int, default=2000)
    parser.add_argument("--few", type=int, default=500)
    parser.add_argument("--out", type=Path, default=HERE)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--json", action="store_true", help="print all numbers")
    given = parser.parse_args()
    answers = main(given.seed, given.out, given.trials, given.few, given.keep, given.workers)
    if given.json:
        print(json.dumps(answers, indent=1))
    else:
        print(table(answers["cases"]))
        print(json.dumps({name: answers[name] for name in answers if name != "cases"}, indent=1))
