"""Maps that jump inside one branch (a floor in `image`, nothing else registered): cycles, attractors, ends.

Known on paper: m x mod 1 returns after p steps at the m^p - 1 points j / (m^p - 1); and a circle map with
x + 1/2 at 0 and at 1/2 has the cycle {0, 1/2}, of multiplier (1 - k - m) (1 + k - m).
"""

import math
import re
from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets.parameters.atlas import Axis


class Times(NamedTuple):
    m: float


class Waves(NamedTuple):
    omega: float
    k: float
    m: float


def times(params, x, side):
    y = params.m * x
    return y - math.floor(y), side, 0


def lift(params, x):
    first, second = math.sin(2.0 * math.pi * x), math.sin(4.0 * math.pi * x)
    return x + params.omega - params.k / (2.0 * math.pi) * first - params.m / (4.0 * math.pi) * second


def waves(params, x, side):
    y = lift(params, x)
    return y - math.floor(y), side, 0


ls.register(Times, image=times)
ls.register(Waves, image=waves)


def graph_of(params, cells=256):
    return ls.transitions(params, ls.grid([(0.0, 1.0)], cells=cells))


@pytest.mark.parametrize("m", [3.0, 5.0])
def test_m_x_mod_1_returns_at_every_multiple(m):
    found = ls.cycles(graph_of(Times(m)), 4)
    assert found.complete
    for p in range(1, 5):
        points = np.sort(np.concatenate([c.x for c in found if p % c.period == 0]))
        assert points == pytest.approx(np.arange(m**p - 1) / (m**p - 1), abs=1e-12)


def test_a_folded_circle_has_every_cycle_that_its_lift_crosses():
    """A point of period p crosses the diagonal of the lift, moved by a whole number: crossings are counted."""
    params = Waves(0.3, 4.0, 0.3)
    found = ls.cycles(graph_of(params), 5)
    start = np.linspace(0.0, 1.0, 400_001) + 1.2345e-7
    y = start
    for p in range(1, 6):
        y = np.array(
            y + 0.3 - 2.0 / np.pi * np.sin(2.0 * np.pi * y) - 0.075 / np.pi * np.sin(4.0 * np.pi * y)
        )
        turns = np.abs(np.diff(np.floor(y - start))).sum()
        assert sum(c.period for c in found if p % c.period == 0) == turns


def test_a_cycle_on_the_cut_is_all_that_attracts():
    params = Waves(0.5, 0.7, 0.2)
    graph = graph_of(params, 1024)
    (attractor,) = ls.attractors(graph)
    for extents, wide in ((attractor.extents, 0.01), (ls.limit_set(graph, attractor).extents, 1e-9)):
        places = [0.5 * (lo + hi) for lo, hi in extents[0]]
        assert places == pytest.approx([0.0, 0.5, 1.0], abs=wide)
        assert sum(hi - lo for lo, hi in extents[0]) < wide
    # What is left open lies at the repelling cycle, not in all that meets the jump.
    assert ls.basins(graph, (attractor,)).attractors[0] > 0.98
    assert min(c.multiplier for c in ls.cycles(graph, 2)) == pytest.approx((1 - 0.9) * (1 + 0.5), abs=1e-9)


def test_basins_say_that_starts_are_undecided_by_the_enclosed_image_of_a_jump():
    """Cells that lead to the jump, counted apart: the lift rises, so that its ends bound the image of a cell."""
    params, cells = Waves(0.34, 0.95, 0.0), 1024
    graph = ls.transitions(params, ls.grid([(0.0, 1.0)], cells=cells), "boxes")
    ends = np.linspace(0.0, 1.0, cells + 1)
    after = ends + 0.34 - 0.95 / (2.0 * np.pi) * np.sin(2.0 * np.pi * ends)
    first, last = np.floor(after[:-1] * cells).astype(int), np.floor(after[1:] * cells).astype(int)
    leads = (first < cells) & (last >= cells)
    for _ in range(cells):
        leads = leads | np.array(
            [leads[np.arange(a, b + 1) % cells].any() for a, b in zip(first, last, strict=True)]
        )
    found = ls.basins(graph, ls.attractors(graph))
    assert found.undecided_between > 0.1
    words = re.search(
        r"from (.*) % of the starts .*, from (.*) % a cell whose enclosed image is a whole", found.advice
    )
    assert float(words[2]) / 100.0 == pytest.approx(leads.mean(), abs=0.003)
    assert "one branch before the jump" in found.advice
    sampled = graph_of(params, cells)
    assert "enclosed image" not in ls.basins(sampled, ls.attractors(sampled)).advice


def test_the_atlas_decides_circle_maps_with_a_floor():
    """Denjoy: with an irrational rotation number the whole circle is the attractor, and its exponent is 0.

    Below omega = k / (2 pi) the map is locked to a fixed point; the rotation by 1/4 has a cycle through each point.
    """
    axis = Axis("omega", [0.05, 0.30001, (math.sqrt(5.0) - 1.0) / 2.0])
    wanted = ["lyapunov", "lyapunov_error", "bands", "lowest", "reach", "period", "undecided"]
    found = ls.atlas(Waves(0.5, 0.5, 0.0), axis, domain=[(0.0, 1.0)], variables=wanted).dataset
    assert found.undecided.values.tolist() == [0, 0, 0]
    assert found.period.values[:, 0].tolist() == [1, 0, 0]
    assert found.lowest.values[0, 0, 0] == pytest.approx(
        math.asin(2.0 * math.pi * 0.05 / 0.5) / math.tau, abs=1e-6
    )
    for point in (1, 2):
        assert found.bands.values[point, 0, 0] == 1
        ends = found.lowest.values[point, 0, 0], found.reach.values[point, 0, 0]
        assert ends == pytest.approx((0.0, 1.0), abs=1e-9)
        assert abs(found.lyapunov.values[point, 0]) < 1e-3
    quarter = ls.atlas(Waves(0.5, 0.0, 0.0), "omega=0.25:0.25:1", domain=[(0.0, 1.0)]).dataset
    assert quarter.undecided.attrs["flag_meanings"].split()[int(quarter.undecided.values[0])] == "not_one"


def test_the_atlas_finds_the_bands_of_a_falling_map_with_a_floor():
    """x -> -5 x / 2 mod 1 expands, and its images of any interval fill [0, 1]."""
    found = ls.atlas(Times(-2.5), "m=-2.5:-2.25:2", domain=[(0.0, 1.0)]).dataset
    assert found.undecided.values.tolist() == [0, 0]
    assert found.bands.values[:, 0, 0].tolist() == [1, 1]
    assert found.lowest.values[:, 0, 0] == pytest.approx(0.0, abs=1e-9)
    assert found.reach.values[:, 0, 0] == pytest.approx(1.0, abs=1e-9)
