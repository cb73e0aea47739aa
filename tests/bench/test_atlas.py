"""The topology of many feeders: points per second, against `analyse` point by point and against CMGDB on cells."""

from __future__ import annotations

import warnings
from importlib.util import find_spec
from time import perf_counter

import numpy as np
import pytest

import limitsets as ls
from limitsets.feeder.scene.arrays import throw_stack
from limitsets.systems.graph.components import strong_components
from limitsets.systems.graph.ranges import Ranges
from limitsets.systems.maps import INWARD, images
from limitsets.systems.maps.pieces import point_of
from limitsets.systems.topology import topologies
from tests.bench.measure import Turns, limit, take_turns, versus

pytestmark = pytest.mark.bench

ANALYSE, CMGDB = "ls.analyse point by point", "CMGDB 1.5.2, batch"
POINTS, ANALYSED, SIDE = 4000, 3, 200
# Cells on the one axis: a quarter for each side, the last quarter for none.
DEPTH, TOP = 13, 4.0


def drawn(count, seed=0):
    """Throws anywhere in the window."""
    rng = np.random.default_rng(seed)
    speed, height = np.radians(rng.uniform(120, 180, count)), rng.uniform(-1, 0.2, count)
    return throw_stack(ls.load("paper-designed"), {"throw.speed": speed, "arm.surface_height": height})


def test_points_per_second(benchmark, table):
    scene, stack = ls.load("paper-designed"), drawn(POINTS)
    scenes = [scene.with_values({"arm.surface_height": h}) for h in (-0.7, -0.4, -0.1)]

    def by_analyse():
        return [ls.analyse(each) for each in scenes]

    turns = take_turns(
        benchmark,
        lambda: topologies(stack.params, stack.lo, stack.hi, stack.anchor),
        {ANALYSE: by_analyse},
        5,
    )
    per_point = Turns(turns.ours / POINTS, {ANALYSE: turns.rivals[ANALYSE] / ANALYSED}, None, {})
    table += [
        versus("atlas: one feeder of paper-designed, its topology", per_point, ANALYSE, unit="ms"),
        limit("atlas: the same, points per second and core", POINTS / turns.ours, "/s", None),
        limit("atlas: share undecided", float((turns.answer.undecided > 0).mean()), "", 0.02),
    ]
    assert [len(each.attractors) for each in turns.answers[ANALYSE]] == [1, 1, 1]


def test_two_processes(benchmark, table):
    axes = f"throw.speed=120:180:{SIDE}", f"arm.surface_height=-1:0.2:{SIDE}"
    turns = take_turns(
        benchmark,
        lambda: ls.atlas("paper-designed", *axes, workers=2),
        {"one process": lambda: ls.atlas("paper-designed", *axes, workers=1)},
        3,
    )
    rate = SIDE * SIDE / turns.ours
    table += [
        versus(f"atlas: {SIDE} x {SIDE} points with 2 processes", turns, "one process"),
        limit("atlas: points per second with 2 processes", rate, "/s", None),
    ]
    one, two = turns.answers["one process"].dataset, turns.answer.dataset
    assert one.equals(two)


def test_a_million(table):
    """The window of the README, once, as a user runs it."""
    begin = perf_counter()
    found = ls.atlas(
        "paper-designed", "throw.speed=120:180:1000", "arm.surface_height=-1:0.2:1000", workers=2
    )
    table.append(limit("atlas: a million feeders, 2 processes", perf_counter() - begin, "s", 60))
    assert found.dataset["checked"].isin([2, 4]).sum() == 0  # none differs from fine cells or from a proof
    assert (found.dataset["undecided"] > 0).mean() < 0.02


def hulls(params, lo, hi, left, right):
    """Images of cells of one axis that holds the sides one after another, each from k to k + 1.

    One interval for each: the hull of the images of both ends, whatever lies between when these are on two sides.
    """
    span, n = hi - lo, lo.size
    below, above = np.full(left.size, n + 5.0), np.full(left.size, n + 6.0)  # where no side lies: out
    on = np.floor(0.5 * (left + right)).astype(int)
    for k in range(n):
        mine, ends = np.flatnonzero(on == k), []
        for z in (left[mine], right[mine]):
            found = images(params, lo[k] + (z - k) * span[k], k)
            place = (found.x - lo[found.side]) / span[found.side]
            inward = (found.code == INWARD) | ((found.code >= 0) & (place < 0.0))
            outward = ((found.code < 0) & (found.code != INWARD)) | (place > 1.0)
            ends.append(np.where(inward, -5.0, np.where(outward, n + 5.0, found.side + place)))
        below[mine], above[mine] = np.minimum(*ends), np.maximum(*ends)
    return below, above


def by_us(params, lo, hi):
    """Sizes of the recurrent components."""
    n = 2**DEPTH
    edges = np.linspace(0.0, TOP, n + 1)
    below, above = hulls(params, lo, hi, edges[:-1], edges[1:])
    first, last = (np.clip(np.floor(z * n / TOP), 0, n - 1).astype(np.int32) for z in (below, above))
    run = np.where((above < 0.0) | (below > TOP), 0, last - first + 1)
    one = np.ones(n, np.int32)
    box = np.stack([first, run, one, one, 0 * one], axis=1).astype(np.int32)
    stride = np.ones(1, np.int64)
    found = strong_components(Ranges(np.arange(n + 1), box, True, stride, stride, np.zeros(n, np.uint8)))
    return sorted(found.size[found.recurrent].tolist())


def by_cmgdb(params, lo, hi):
    """The same from CMGDB, the hulls as its batch map."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import CMGDB

    def scalar(rectangle):
        raise AssertionError("the batch map was to be called")

    model = CMGDB.Model(DEPTH, DEPTH, DEPTH, 10_000, [0.0], [TOP], scalar)
    model.set_batch_map(lambda r: np.column_stack(hulls(params, lo, hi, r[:, 0], r[:, 1])))
    morse, _ = CMGDB.ComputeMorseGraph(model)
    return sorted(len(morse.morse_set(v)) for v in morse.vertices())


@pytest.mark.skipif(find_spec("CMGDB") is None, reason="CMGDB is not installed: make bench does it")
def test_components_of_a_hundred(benchmark, table):
    stack = drawn(100, seed=1)
    points = [(point_of(stack.params, i), stack.lo[i], stack.hi[i]) for i in range(100)]
    turns = take_turns(
        benchmark,
        lambda: [by_us(*each) for each in points],
        {CMGDB: lambda: [by_cmgdb(*each) for each in points]},
        3,
    )
    assert turns.answer == turns.answers[CMGDB]
    what = f"atlas: recurrent components of 100 feeders, {2**DEPTH} cells, hulls of both branches"
    table.append(versus(what, turns, CMGDB))
    # and the whole topology of each, as the atlas has it, beside CMGDB's components
    seconds = []
    for _ in turns.rivals[CMGDB]:
        begin = perf_counter()
        topologies(stack.params, stack.lo, stack.hi, stack.anchor)
        seconds.append(perf_counter() - begin)
    whole = Turns(np.array(seconds), turns.rivals, None, {})
    table.append(versus("atlas: the topology of these: bands, jogs, shares, all of it", whole, CMGDB))
