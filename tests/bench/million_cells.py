"""In a process of its own: 1e6 cells of the paper's designed scene from graph to basins, seconds and peak memory.

Prints one JSON object.  Run by test_million_cells.py.
"""

from __future__ import annotations

import json
from pathlib import Path
from time import perf_counter

import limitsets as ls

PER_SIDE, ROUNDS = 333_334, 7


def memory(word: str) -> float:
    """VmRSS or VmHWM of this process [MB]."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(word):
            return int(line.split()[1]) * 1024 / 1e6
    raise LookupError(word)


def once(per_side: int):
    """Scene to basins; the attractors' orbits, which need no cells, are cut to one throw."""
    scene = ls.load("paper-designed")
    begin = perf_counter()
    graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=per_side))
    graph.components()
    _ = graph.condensation().destination
    seconds = perf_counter() - begin
    found = ls.attractors(graph, throws=1)
    basins = ls.basins(graph, found)
    return seconds, perf_counter() - begin, found, basins


def main() -> None:
    once(3_000)  # machine code, and everything imported
    Path("/proc/self/clear_refs").write_text("5")  # forget the peak so far
    before = memory("VmRSS")
    first = once(PER_SIDE)
    peak = memory("VmHWM") - before
    seconds = [first[:2]] + [once(PER_SIDE)[:2] for _ in range(ROUNDS)]
    _, _, found, basins = first
    answer = {
        "seconds": [pair[0] for pair in seconds],
        "seconds_with_basins": [pair[1] for pair in seconds],
        "peak": peak,
        "extents": {str(side): parts for side, parts in found[0].extents.items()},
        "attractors": list(basins.attractors),
        "undecided": basins.undecided_between,
    }
    print(json.dumps(answer))


if __name__ == "__main__":
    main()
