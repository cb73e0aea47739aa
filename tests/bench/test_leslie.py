"""Graphs of cells against their rivals: Leslie, networkx, a million cells."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import networkx as nx
import numpy as np
import pytest

import limitsets as ls
from limitsets.systems.graph.components import reach
from tests.bench.leslie_rivals import HI, LO, Answer, by_cmgdb, by_scipy
from tests.bench.measure import Turns, limit, take_turns, versus
from tests.test_paper import LIMIT_SETS

# ----------------------------------------------------------------
# Map, components, order and basins of the Leslie map, against CMGDB and against numpy and scipy.


CMGDB, SCIPY = "CMGDB 1.5.2, batch", "numpy and scipy"
ROUNDS = {16: 15, 18: 7, 20: 5}


def by_us(depth):
    """Everything asked for: the graph, and its answer."""
    graph = ls.transitions(
        ls.maps.Leslie(), ls.grid(list(zip(LO, HI, strict=True)), depth=depth), method="corners-padded"
    )
    morse = ls.morse_graph(graph)
    destination = graph.condensation().destination
    sizes = [morse.nodes[k]["cells"] for k in morse]
    ends = [size for k, size in enumerate(sizes) if morse.nodes[k]["attracting"]]
    counts = np.bincount(destination + 4)
    names = {k: ends[k - 4] if k >= 4 else k - 4 for k in range(counts.size)}
    basins = {names[int(k)]: int(counts[k]) for k in np.flatnonzero(counts)}
    return graph, Answer(sorted(sizes, reverse=True), {(sizes[i], sizes[j]) for i, j in morse.edges}, basins)


def reached_sets(graph):
    """How many cells can reach which components: the form of CMGDB's answer."""
    sets = graph.recurrent_components()
    marks = np.zeros(graph.n_cells, np.uint64)
    for k, cells in enumerate(sets):
        marks[cells] = 1 << k
    masks, counts = np.unique(reach(graph.ranges, graph.components(), marks), return_counts=True)
    names = [frozenset(len(cells) for k, cells in enumerate(sets) if int(mask) >> k & 1) for mask in masks]
    return dict(zip(names, counts.tolist(), strict=True))


@pytest.mark.bench
@pytest.mark.skipif(find_spec("CMGDB") is None, reason="CMGDB is not installed: make bench does it")
@pytest.mark.parametrize("depth", [16, 18, 20])
def test_leslie(benchmark, depth, table):
    to_order = []

    def cmgdb():
        answer = by_cmgdb(depth)
        to_order.append(answer.seconds_to_order)
        return answer

    rivals = {CMGDB: cmgdb, SCIPY: lambda: by_scipy(depth)}
    turns = take_turns(benchmark, lambda: by_us(depth), rivals, ROUNDS[depth])
    graph, ours = turns.answer
    theirs, scipy = turns.answers[CMGDB], turns.answers[SCIPY]
    assert ours.components == scipy.components == theirs.components
    assert ours.order == scipy.order == theirs.order
    assert ours.basins == scipy.basins
    assert reached_sets(graph) == theirs.basins
    what = f"Leslie, depth {depth}: map, components, order, basins"
    deepest = depth == 20
    no_basins = f"{CMGDB}, without basins"
    more = Turns(turns.ours, {no_basins: np.array(to_order[-ROUNDS[depth] :])}, None, {})
    table += [
        versus(what, turns, CMGDB, faster=25 if deepest else None),
        versus(what, more, no_basins),
        versus(what, turns, SCIPY, faster=5 if deepest else None),
    ]
    if deepest:
        adaptive = by_cmgdb(depth, adaptive=True)
        assert sorted(adaptive.components) == sorted(ours.components)
        # On cells of mixed sizes the order comes out coarser: another answer, so no rival, but its time is told.
        what = "for information: CMGDB halving only what recurs, no basins"
        table.append(limit(what, adaptive.seconds_to_order, "s", None))


# ----------------------------------------------------------------
# networkx's own function on our graph and on a networkx.DiGraph of the same edges.


PLAIN, KEPT = "networkx.DiGraph", "ours, components kept from before"


def paper():
    scene = ls.load("paper-designed")
    return ls.transitions(scene.map, ls.grid(scene.domain, cells=33_334))


def leslie():
    return ls.transitions(ls.maps.Leslie(), ls.grid([(-0.001, 90), (-0.001, 70)], cells=(317, 316)))


@pytest.mark.bench
@pytest.mark.parametrize("build", [paper, leslie])
def test_attracting_components(benchmark, build, table):
    graph = build()
    plain = graph.to_networkx()
    list(nx.attracting_components(graph))

    def cold():
        fresh = replace(graph)  # the same ranges, nothing computed yet
        return list(nx.attracting_components(fresh))

    rivals = {
        PLAIN: lambda: list(nx.attracting_components(plain)),
        KEPT: lambda: list(nx.attracting_components(graph)),
    }
    turns = take_turns(benchmark, cold, rivals, 7)
    for name in rivals:
        assert sorted(map(sorted, turns.answer)) == sorted(map(sorted, turns.answers[name]))
    what = f"nx.attracting_components, {build.__name__}, {graph.n_cells} cells"
    table += [versus(what, turns, PLAIN, unit="ms", faster=50), versus(what, turns, KEPT, unit="ms")]


# ----------------------------------------------------------------
# 1e6 cells of the paper scene: how long, and how much memory above what the process held before.


@pytest.mark.bench
@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="peak memory is read from /proc")
def test_million_cells(table):
    script = Path(__file__).with_name("million_cells.py")
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True)
    answer = json.loads(done.stdout)
    assert answer["attractors"] == [pytest.approx(1.0, abs=1e-4)]
    assert answer["undecided"] == pytest.approx(0.0, abs=1e-4)
    for side, (ends,) in LIMIT_SETS["paper-designed"].items():
        assert answer["extents"][str(side)] == [pytest.approx(ends, abs=2e-3)]
    what = "paper-designed, 1e6 cells"
    table += [
        limit(f"{what}: grid, graph, components, survey", answer["seconds"], "s", None),
        limit(f"{what}: the same with attractors and basins", answer["seconds_with_basins"], "s", 0.5),
        limit(f"{what}: peak memory above the process before", answer["peak"], "MB", 300),
    ]
