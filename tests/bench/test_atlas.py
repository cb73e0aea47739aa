"""Atlases and the explorer's answers."""

from __future__ import annotations

import math
import os
import time
import warnings
from importlib.util import find_spec
from time import perf_counter
from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets.feeder.scene.arrays import throw_stack
from limitsets.parameters.regions import certified_map
from limitsets.systems.graph.components import strong_components
from limitsets.systems.graph.ranges import Ranges
from limitsets.systems.maps import INWARD, images
from limitsets.systems.maps.pieces import point_of
from limitsets.systems.sets.topology import topologies
from tests.bench.leslie_rivals import morse_by_cmgdb
from tests.bench.measure import Turns, limit, take_turns, versus
from tests.browsers import browser
from tests.explorer.served import Visitor, running, served

pytestmark = pytest.mark.bench


# ----------------------------------------------------------------
# The topology of many feeders: points per second, against `analyse` point by point and against CMGDB on cells.


ANALYSE, CMGDB = "ls.analyse point by point", "CMGDB 1.5.2, batch"
POINTS, ANALYSED, SIDE = 4000, 3, 200
# Cells on the one axis: a quarter for each side, the last quarter for none.
DEPTH, TOP = 13, 4.0


def drawn(count, seed=0):
    """Throws anywhere in the window."""
    rng = np.random.default_rng(seed)
    speed, height = np.radians(rng.uniform(120, 180, count)), rng.uniform(-1, 0.2, count)
    return throw_stack(ls.load("paper-designed"), {"throw.speed": speed, "arm.surface_height": height})


def topology_of(stack):
    return topologies(stack.params, stack.lo, stack.hi, stack.anchor)


def test_points_per_second(benchmark, table):
    scene, stack = ls.load("paper-designed"), drawn(POINTS)
    scenes = [scene.with_values({"arm.surface_height": h}) for h in (-0.7, -0.4, -0.1)]

    def by_analyse():
        return [ls.analyse(each) for each in scenes]

    turns = take_turns(benchmark, lambda: topology_of(stack), {ANALYSE: by_analyse}, 5)
    per_point = Turns(turns.ours / POINTS, {ANALYSE: turns.rivals[ANALYSE] / ANALYSED}, None, {})
    table += [
        versus("atlas: one feeder of paper-designed, its topology", per_point, ANALYSE, unit="ms"),
        limit("atlas: the same, points per second and core", POINTS / turns.ours, "/s", None),
        limit("atlas: share undecided", float((turns.answer.undecided > 0).mean()), "", 0.02),
    ]
    assert [len(each.attractors) for each in turns.answers[ANALYSE]] == [1, 1, 1]


def test_two_processes(benchmark, table):
    axes = f"throw.speed=120:180:{SIDE}", f"arm.surface_height=-1:0.2:{SIDE}"
    rivals = {"one process": lambda: ls.atlas("paper-designed", *axes, workers=1)}
    turns = take_turns(benchmark, lambda: ls.atlas("paper-designed", *axes, workers=2), rivals, 3)
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
    axes = "throw.speed=120:180:1000", "arm.surface_height=-1:0.2:1000"
    found = ls.atlas("paper-designed", *axes, workers=2)
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
    rivals = {CMGDB: lambda: [by_cmgdb(*each) for each in points]}
    turns = take_turns(benchmark, lambda: [by_us(*each) for each in points], rivals, 3)
    assert turns.answer == turns.answers[CMGDB]
    what = f"atlas: recurrent components of 100 feeders, {2**DEPTH} cells, hulls of both branches"
    table.append(versus(what, turns, CMGDB))
    # and the whole topology of each, as the atlas has it, beside CMGDB's components
    seconds = []
    for _ in turns.rivals[CMGDB]:
        begin = perf_counter()
        topology_of(stack)
        seconds.append(perf_counter() - begin)
    whole = Turns(np.array(seconds), turns.rivals, None, {})
    table.append(versus("atlas: the topology of these: bands, jogs, shares, all of it", whole, CMGDB))


# ----------------------------------------------------------------
# Frames a second of the explorer, counted in headless Chromium while a slider is dragged.


SECONDS = 5.0
EXPLORED = """
import limitsets as ls
ls.explore({}).show(port=0, show=False, ready=lambda url: print(url, flush=True))
"""
HENON = EXPLORED.format("ls.maps.Henon()")
# With the surface at the joint the displacement is small beside a cell, in thousands of them.
AT_JOINT = EXPLORED.format('ls.load("paper-designed").with_values({"arm.surface_height": 0.05})')


class Hand(NamedTuple):
    """How a slider is dragged: so many pixels to either side, so many radians a second, about a place further on."""

    pixels: float = 60.0
    speed: float = 2.0
    back: float = 0.0


# A picture counts when the canvas has been painted with other data than at the last count, and the screen has come to
# the next frame.
COUNT = """(canvas, name) => {
    const pen = canvas.getContext("2d"), clear = pen.clearRect.bind(pen)
    const data = () => JSON.stringify(canvas.shown.layers.find((layer) => layer.called === name))
    let last = data()
    window.painted = 0
    pen.clearRect = (...given) => {
        clear(...given)
        const now = data()
        if (now !== last) { last = now; requestAnimationFrame(() => { painted++ }) }
    }
}"""


def frames_a_second(address: str, layer: str, picture: str, slider: int, hand: Hand) -> float:
    with browser() as chromium:
        visitor = Visitor(chromium, address)
        visitor.page.wait_for_timeout(3000)
        visitor.canvas(picture).evaluate(COUNT, layer)
        (x, y), mouse = visitor.handle(slider), visitor.page.mouse
        mouse.move(x, y)
        mouse.down()
        begin = time.perf_counter()
        while (past := time.perf_counter() - begin) < SECONDS:
            mouse.move(x + hand.pixels * (math.sin(hand.speed * past) - hand.back), y)
            time.sleep(0.014)  # a hand's mouse says where it is some sixty times a second
        painted: int = visitor.page.evaluate("painted")
        mouse.up()
        return painted / past


@pytest.mark.parametrize("case", ["throw", "at the joint", "henon"])
def test_the_picture_follows_the_slider(case):
    if case == "throw":
        with served() as address:
            found = frames_a_second(address, "limit sets", "lanes", 2, Hand())
    elif case == "at the joint":
        with running("-c", AT_JOINT) as address:
            # 24 steps of the slider, from -0.035 to 0.135 in: a slow hand would be counted, not the computation
            found = frames_a_second(address, "limit sets", "lanes", 3, Hand(pixels=12.0, speed=6.0))
    else:
        with running("-c", HENON) as address:
            # to values below the first: beyond a = 1.43 all orbits leave, and pictures without points are the same
            found = frames_a_second(address, "points", "map", 0, Hand(back=1.0))
    load = os.getloadavg()[0]
    print(f"{case}: {found:.1f} frames a second (load of the machine {load:.1f}, {os.cpu_count()} cores)")
    if load < 1.5 * (os.cpu_count() or 1):  # a browser, a server and nobody else
        assert found >= 20.0


# ----------------------------------------------------------------
# A plane of parameters of record: Chialvo's neuron in the window of arXiv 2209.03443, section 4.5 (there 200 x 50
# points and 256 x 256 cells), its Morse graph at points of 64 x 64 against CMGDB, and the regions that are proved.

PHASE, PLANE, HALVINGS = ((-0.1, 7.5), (-1.3, 2.7)), (("b", 0.0, 0.5), ("k", 0.017, 0.027)), 14


def chialvo(x, y, a, b, c, k):
    return x * x * math.exp(y - x) + k, a * y - b * x + c


def neuron(b, k):
    return ls.map(chialvo, a=0.89, b=b, c=0.28, k=k)


def sizes_by_cmgdb(b, k):
    """Sizes of the recurrent components at one point."""

    def images_of(points):
        x, y = points[:, 0], points[:, 1]
        return np.column_stack([x * x * np.exp(y - x) + k, 0.89 * y - b * x + 0.28])

    morse, _ = morse_by_cmgdb(images_of, tuple(zip(*PHASE, strict=True)), HALVINGS)
    return sorted(len(morse.morse_set(v)) for v in morse.vertices())


def sizes_by_us(b, k):
    graph = ls.transitions(neuron(b, k), ls.grid(PHASE, cells=2 ** (HALVINGS // 2)), "corners-padded")
    return sorted(len(cells) for cells in graph.recurrent_components())


@pytest.mark.skipif(find_spec("CMGDB") is None, reason="CMGDB is not installed: make bench does it")
def test_a_plane_of_record(benchmark, table):
    along = [np.linspace(lo, hi, 64) for _, lo, hi in PLANE]
    points = [(float(b), float(k)) for b in along[0][::8] for k in along[1][::8]]

    rivals = {CMGDB: lambda: [sizes_by_cmgdb(*each) for each in points]}
    turns = take_turns(benchmark, lambda: [sizes_by_us(*each) for each in points], rivals, 5)
    assert turns.answer == turns.answers[CMGDB]
    what = "Chialvo's neuron: the Morse graph at a point, 128 x 128 cells"
    table.append(versus(what, turns, CMGDB, unit="ms", per=len(points)))

    begin = perf_counter()
    axes = [f"{name}={lo}:{hi}:64" for name, lo, hi in PLANE]
    options = {"cells": 128, "method": "corners-padded"}
    whole = ls.atlas(neuron(0.0, 0.017), *axes, domain=PHASE, options=options, workers=1)
    table.append(
        limit("Chialvo's neuron: an atlas of 64 x 64 points, one process", perf_counter() - begin, "s", None)
    )
    assert (
        whole.dataset["recurrent"].values[::8, ::8].T.ravel() == [len(each) for each in turns.answer]
    ).all()
    begin = perf_counter()
    window = {"upper": neuron(0.5, 0.027), "first": 8, "depth": 12}
    proved = certified_map(neuron(0.0, 0.017), ls.grid(PHASE, cells=128), ["trapping"], **window)
    share = float(proved.shares()["proved"])
    table += [
        limit(
            "Chialvo's neuron: regions of a raster of 64 x 64, one process", perf_counter() - begin, "s", None
        ),
        limit("Chialvo's neuron: share of the plane with a proved attractor", share, "", None),
    ]
    assert share > 0.95


# ----------------------------------------------------------------
# The delayed Ricker map (arXiv 1209.2406) in x/alpha: every start tends to the fixed point, for all alpha from 0.5 on.


def delayed(x, y, alpha):
    return y, y * math.exp(alpha * (1.0 - x))


def around(centre, lo, hi, least, growth):
    """Borders of cells that grow with the distance from a centre."""
    up, down = [centre + least / 2], [centre - least / 2]
    while up[-1] < hi:
        up.append(up[-1] + max(least, growth * (up[-1] - centre)))
    while down[-1] > lo:
        down.append(down[-1] - max(least, growth * (centre - down[-1])))
    return np.array([lo, *down[-2::-1], *up[:-1], hi])


@pytest.mark.parametrize(
    ("end", "least", "growth", "depth"), [(0.8, 0.002, 0.022, 9), (0.88, 0.0002, 0.009, 8)]
)
def test_the_delayed_ricker_map(end, least, growth, depth, tmp_path, table):
    lower = ls.map(delayed, alpha=0.5)
    grid = ls.cells.Grid(
        ls.cells.Domain([[0.02, 0.02]], [[4.0, 4.0]]), ((around(1.0, 0.02, 4.0, least, growth),) * 2,)
    )
    how = {"upper": lower.with_values(alpha=end), "first": 3, "depth": depth, "share": 0.8}
    begin = perf_counter()
    proved = certified_map(lower, grid, ["converges", "basin"], **how)
    proving = perf_counter() - begin
    assert proved.shares()["proved"] == 1
    report = ls.recheck(proved.save(tmp_path / "delayed.proof.zip"))
    assert report.verdict == "proved"
    what = (
        f"delayed Ricker, alpha 0.5 to {end}, {grid.n_cells} cells, {len(proved.records)} boxes, one process"
    )
    table.append(limit(f"{what}: proved", proving, "s", None))
    table.append(limit(f"{what}: with save and recheck", perf_counter() - begin, "s", None))
