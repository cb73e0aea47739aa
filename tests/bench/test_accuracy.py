"""What accuracy costs: the limit set to a given error by each method, and one throw by each arithmetic.

Errors are asserted against ends known to twelve digits (from the decimal scene, at 40 digits); the curves behind these
rows are drawn by studies/03_accuracy.
"""

from __future__ import annotations

import numpy as np
import pytest

import limitsets as ls
from limitsets.parameters.analysis.accuracy import _distance
from limitsets.proofs.prover.attraction import attraction
from limitsets.proofs.prover.cover import cover
from limitsets.proofs.prover.end_points import proved_ends
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.systems.sets import invariant_measures
from tests.bench.measure import limit, take_turns, versus

pytestmark = pytest.mark.bench

EXACT = {
    0: [(15.205338825681, 19.75268801485)],
    1: [(12.637023572659, 17.439819281769)],
    2: [(8.9140259080455, 23.383151921158)],
}
ROUNDS = 15


def error_of(extents):
    return _distance(extents, EXACT)


def attracting(scene, cells, method=None):
    """The graph and the extents of its one attractor, without the orbit on which jogs are counted."""
    graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=cells), method)
    sets = zip(graph.recurrent_components(), graph.condensation().attracting, strict=True)
    ((cells_of_it, _),) = [(part, ends) for part, ends in sets if ends]
    from limitsets.systems.cells import CellSet

    return graph, CellSet.of(graph.grid, cells_of_it)


def test_ends_of_the_limit_set(benchmark, table):
    scene = ls.load("paper-designed")

    def critical():
        graph, cells = attracting(scene, 2048)

        class Cells:
            extents = cells.extents()

        return ls.limit_set(graph, Cells()).extents

    def proved():
        return proved_ends(attraction(cover(parameter_box(scene), 2048)))

    rivals = {
        "cells, error 3e-3": lambda: attracting(scene, 65536)[1].extents(),
        "proved boxes, error 3e-3": lambda: attracting(scene, 65536, "boxes")[1].extents(),
        "proved end points, error 1.5e-11": proved,
    }
    turns = take_turns(benchmark, critical, rivals, ROUNDS)
    assert error_of(turns.answer) < 2e-12  # the digits that are known
    for name in ("cells, error 3e-3", "proved boxes, error 3e-3"):
        assert 1e-3 < error_of(turns.answers[name]) < 5e-3
    assert turns.answers["proved end points, error 1.5e-11"].width < 1e-10
    what = "ends of the limit set by critical orbits, error 1e-14"
    table += [versus(what, turns, name, unit="ms") for name in rivals]


def test_an_error_asked_for(benchmark, table):
    scene = ls.load("paper-designed")
    turns = take_turns(
        benchmark, lambda: ls.analyse(scene, error=1e-6), {"analyse": lambda: ls.analyse(scene)}, ROUNDS
    )
    assert turns.answer.accuracy.met
    assert error_of(turns.answer.extents[0]) < 1e-6
    found = turns.answer.accuracy
    table += [
        versus("analyse to an error of 1e-6: planned, done, verified", turns, "analyse"),
        limit("the same: seconds said before", found.plan.chosen.seconds, "s", None),
        limit("the same: seconds taken by what was planned", found.seconds, "s", None),
    ]


def test_one_throw(benchmark, table):
    scene = ls.load("paper-designed")
    x = np.random.default_rng(2).uniform(*EXACT[2][0], 4096)
    from limitsets.feeder.thrower import Energy, SmallAngle

    small = scene.map._replace(flight=SmallAngle(), flip=Energy())
    turns = take_turns(
        benchmark,
        lambda: ls.maps.images(scene.map, x, 2),
        {"small angle (errors of inches)": lambda: ls.maps.images(small, x, 2)},
        200,
    )
    name = "small angle (errors of inches)"
    same = turns.answer.side == turns.answers[name].side
    assert np.abs(turns.answer.x - turns.answers[name].x)[same].max() > 1.0
    table.append(versus("an exact throw, limitsets.maps.images", turns, name, unit="ns", per=4096))


def test_density(benchmark, table):
    cells, throws = 16384, 10**6
    edges = np.linspace(0.0, 1.0, cells + 1)
    exact = np.diff(2.0 / np.pi * np.arcsin(np.sqrt(edges)))
    params = ls.maps.Logistic(4.0)

    def ulam():
        (found,) = invariant_measures(ls.transitions(params, ls.grid([(0.0, 1.0)], cells=cells)))
        return found.weight

    def histogram():
        path = ls.orbit(params, 0.3, 0, throws)
        return np.bincount((path.x[1:] * 1000).astype(int).clip(0, 999), minlength=1000) / throws

    turns = take_turns(benchmark, ulam, {"histogram of 1e6 steps": histogram}, ROUNDS)
    mine = np.abs(turns.answer - exact).sum()
    bins = np.diff(2.0 / np.pi * np.arcsin(np.sqrt(np.linspace(0.0, 1.0, 1001))))
    theirs = np.abs(turns.answers["histogram of 1e6 steps"] - bins).sum()
    assert mine < theirs < 0.1
    what = f"density of the logistic map, Ulam, 16384 cells (error {mine:.2g}, histogram {theirs:.2g})"
    table.append(versus(what, turns, "histogram of 1e6 steps", unit="ms"))
