"""Answers about a part are those about the same part in another unit: lengths scaled by a power of two, to the bit."""

import numpy as np
import pytest

import limitsets as ls
from limitsets.systems.cells import Domain

LENGTHS = ("kappa", "surface_height", "arm_length", "radius_of_gyration", "a", "d", "length")


def answers(params, domain):
    graph = ls.transitions(params, ls.grid(domain, cells=512))
    found = ls.attractors(graph, throws=2000)
    return graph, found, ls.limit_set(graph, found[0]), ls.critical_points(params, domain)


# From a part of 1e-11 lengths, below any absolute tolerance, by micrometres in metres, to kilometres in millimetres.
@pytest.mark.parametrize("power", [-40, -20, 20])
@pytest.mark.parametrize("name", ["paper-designed", "paper-initial"])
def test_scaled_by_a_power_of_two(name, power):
    scene, scale = ls.load(name), 2.0**power
    domain = scene.domain
    other = scene.map._replace(**{key: getattr(scene.map, key) * scale for key in LENGTHS})
    graph, found, limit, critical = answers(scene.map, domain)
    graph2, found2, limit2, critical2 = answers(
        other, Domain(domain.lo * scale, domain.hi * scale, domain.anchor * scale)
    )
    for one, two in zip(graph.grid.edges, graph2.grid.edges, strict=True):
        np.testing.assert_array_equal(one[0] * scale, two[0])
    np.testing.assert_array_equal(graph.condensation().destination, graph2.condensation().destination)
    assert len(found) == len(found2) == 1
    assert found[0].lyapunov == found2[0].lyapunov
    assert found[0].jogs_per_visit == found2[0].jogs_per_visit
    assert limit.converged
    assert limit2.converged
    assert {
        side: [(lo * scale, hi * scale) for lo, hi in pairs] for side, pairs in limit.extents.items()
    } == limit2.extents
    for side, points in critical.items():
        assert [point.x * scale for point in points] == [point.x for point in critical2[side]]
