"""Map, components, order and basins of the Leslie map, against CMGDB and against numpy and scipy."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest

import limitsets as ls
from limitsets.systems.graph.components import reach
from tests.bench.leslie_rivals import HI, LO, Answer, by_cmgdb, by_scipy
from tests.bench.measure import Turns, limit, take_turns, versus

pytestmark = [
    pytest.mark.bench,
    pytest.mark.skipif(find_spec("CMGDB") is None, reason="CMGDB is not installed: make bench does it"),
]

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


@pytest.mark.parametrize("depth", [16, 18, 20])
def test_leslie(benchmark, depth, table):
    to_order = []

    def cmgdb():
        answer = by_cmgdb(depth)
        to_order.append(answer.seconds_to_order)
        return answer

    turns = take_turns(
        benchmark, lambda: by_us(depth), {CMGDB: cmgdb, SCIPY: lambda: by_scipy(depth)}, ROUNDS[depth]
    )
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
        table.append(
            limit(
                "for information: CMGDB halving only what recurs, no basins",
                adaptive.seconds_to_order,
                "s",
                None,
            )
        )
