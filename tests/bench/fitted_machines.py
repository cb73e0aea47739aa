"""Fits of many machines of known truth, over processes: how often intervals hold, and how often a misfit is seen.

Run it as ``python -m tests.bench.fitted_machines [--machines 1000] [--films 1000] [--workers 16] [--seed 0]``; it
prints a table in JSON.  Every film has a seed of its own, so that the answer is the same with any number of processes,
and the films with sides recorded wrong are those without, but for these sides.
"""

from __future__ import annotations

import argparse
import json
import os
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from time import perf_counter
from typing import Any

import numpy as np

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from tests.fitting.machines import film, machine
from tests.fitting.test_fit import LANDING, PLACES, SPEED, aimed_at, held_by
from tests.fitting.test_misfit import lacking, spoiled_film

FLIPPED = 0.05
EFFECTS = ("roll", "slip")
# Pieces of work at a time: small enough that no process waits for the last.
CHUNK = 4


def one_machine(seed: tuple[int, int]) -> dict[str, Any]:
    """Film a machine, and fit it with all sides right and with some recorded wrong."""
    answer: dict[str, Any] = {"seed": seed}
    values = {}
    for share in (0.0, FLIPPED):
        draw = np.random.default_rng(seed)
        truth = machine(draw)
        try:
            found = ls.fit(aimed_at(), film(draw, truth, speed=SPEED, landing=LANDING, flipped=share))
        except LimitsetsError as error:
            return {"seed": seed, "error": str(error)}
        # the half of a 95 % interval is about two standard errors
        fitted = [name for name in PLACES if name not in found.held]
        values[share] = {name: (found[name].value, 0.5 * found[name].half) for name in fitted}
        answer[f"{share:g}"] = {
            "held": held_by(found, truth),
            "open": [each.name for each in found.quantities if not each.bounded],
            "kept": sorted(found.held),
            "misfit": found.misfit.lacking,
            "off": {name: (value - truth[name]) / size for name, (value, size) in values[share].items()},
            "seconds": found.seconds,
        }
    both = set(values[0.0]) & set(values[FLIPPED])
    clean, flipped = values[0.0], values[FLIPPED]
    answer["moved"] = {name: (flipped[name][0] - clean[name][0]) / clean[name][1] for name in both}
    return answer


def one_strange_film(job: tuple[str, tuple[int, int]]) -> dict[str, Any]:
    """Test the model by a film of a machine with an effect that it lacks."""
    effect, seed = job
    try:
        seen = lacking(*spoiled_film(np.random.default_rng(seed), effect))
    except LimitsetsError as error:
        return {"seed": seed, "error": str(error)}
    return {"effect": effect, "misfit": seen}


def counted(fits: list[dict[str, Any]]) -> dict[str, Any]:
    """Count for each interval in how many fits it was there, held, and was open; medians of how far off values are."""
    told, held, ends, kept = Counter(), Counter(), Counter(), Counter()
    off: dict[str, list[float]] = {}
    for each in fits:
        told.update(each["held"].keys())
        held.update(name for name, inside in each["held"].items() if inside)
        ends.update(each["open"])
        kept.update(each["kept"])
        for name, size in each["off"].items():
            off.setdefault(name, []).append(size)
    words, counts = ("told", "held", "open", "kept"), (told, held, ends, kept)
    return {
        "intervals": {
            name: {word: count[name] for word, count in zip(words, counts, strict=True)} for name in told
        },
        "median off, standard errors": {name: float(np.median(sizes)) for name, sizes in off.items()},
    }


def measured(machines: int, films: int, workers: int, seed: int = 0) -> dict[str, Any]:
    """Fit them all, and count."""
    begin = perf_counter()
    one_machine((seed, machines))  # compiles once for all
    for effect in EFFECTS:
        spoiled_film(np.random.default_rng(seed), effect)
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ[name] = "1"  # the processes take all cores
    jobs = [(effect, (seed, machines + 1 + k)) for effect in EFFECTS for k in range(films)]
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        strange = list(pool.map(one_strange_film, jobs, chunksize=CHUNK))
        fits = list(pool.map(one_machine, [(seed, k) for k in range(machines)], chunksize=CHUNK))
    errors = [each for each in (*fits, *strange) if "error" in each]
    fits, strange = ([each for each in some if "error" not in each] for some in (fits, strange))
    clean, flipped = ([each[share] for each in fits] for share in ("0", f"{FLIPPED:g}"))
    moved = {name: [each["moved"][name] for each in fits if name in each["moved"]] for name in PLACES}
    power = {name: sum(each["misfit"] for each in strange if each["effect"] == name) for name in EFFECTS}
    far = {name: float(np.median(np.abs(each))) for name, each in moved.items()}
    shares = {"0": clean, "0.05": flipped}
    return {
        "machines": machines,
        "films with an effect, each": films,
        "clean": counted(clean),
        "flipped": counted(flipped) | {"median moved, standard errors": far},
        "level": {share: sum(each["misfit"] for each in some) for share, some in shares.items()},
        "power": power,
        "errors": errors,
        "seconds": {
            "fit, median": float(np.median([each["seconds"] for each in clean])),
            "fit, largest": max(each["seconds"] for each in clean),
            "all": perf_counter() - begin,
            "workers": workers,
        },
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Fits of machines of known truth, counted.")
    parser.add_argument("--machines", type=int, default=1000)
    parser.add_argument("--films", type=int, default=1000, help="of machines with an effect, each")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--seed", type=int, default=0)
    words = parser.parse_args()
    print(json.dumps(measured(words.machines, words.films, words.workers, words.seed), indent=1))
