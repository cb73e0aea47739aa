"""Graphs as deep as they are large: one path, or one cycle, through all cells."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import limitsets as ls
from limitsets import maps
from tests.maps_of_tests import with_middles


class Slide(NamedTuple):
    """x' = x + step, until it leaves the domain."""

    step: float


def _slide(params, x, side):
    return x + params.step, side, 0


maps.register(Slide, image=_slide)


@with_middles
def check_path(cells):
    """Each cell goes to the next and the last one leaves: nothing recurs, and every path ends outside."""
    graph = ls.transitions(Slide(1.0 / cells), ls.grid([(0.0, 1.0)], cells=cells), "middles")
    assert graph.number_of_cell_edges() == cells - 1
    assert graph.recurrent_components() == []
    assert ls.attractors(graph) == ()
    assert (ls.basins(graph, ()).labels == maps.OUTSIDE).all()


@with_middles
def check_cycle(cells):
    """Each cell goes to the next and the last one to the first: one component, all cells, attracting."""
    graph = ls.transitions(maps.Rotation(1.0 / cells), ls.grid([(0.0, 1.0)], cells=cells), "middles")
    (component,) = graph.recurrent_components()
    assert np.asarray(component).size == cells
    assert graph.condensation().attracting.tolist() == [True]
