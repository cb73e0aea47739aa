"""The attractor's topology: known answers and the reference."""

import math

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.feeder.scene.arrays import throw_stack
from limitsets.systems.maps.pieces import point_of, stacked
from limitsets.systems.sets.topology import topologies, work
from limitsets.systems.sets.topology.points import LEVELS
from tests.maps_of_tests import Tent
from tests.topology.compare import differences
from tests.topology.maps_with_answers import Grazing, Two, rotations, tongue_of
from tests.topology.reference import STARTS, reference
from tests.topology.window import points_of

# ----------------------------------------------------------------
# Attractors, bands, periods, shares and exponents of textbook maps, from closed forms.


def found(points, lo=0.0, hi=1.0, throws=0):
    n = len(points)
    return topologies(stacked(points), np.full((n, 1), lo), np.full((n, 1), hi), throws=throws)


def logistic(*values, **options):
    return found([maps.Logistic(r) for r in values], **options)


def decided(t):
    return t.undecided.tolist() == [0] * t.undecided.size


# ends of the windows of period 1, 2, 4 and 3: 3, 1 + sqrt 6, 3.544090359551922, 1 + sqrt 8 and 3.841499007543194
# (Strogatz, Nonlinear Dynamics and Chaos, section 10; the last is the root of the discriminant of period 6)
# beside such an end, at 3.001 and 1 + sqrt 8 + 1e-6, the multipliers are 0.996 and 0.983: orbits alone take thousands
# of throws to the cycle
PERIODS = {
    1: (1.2, 1.5, 2.0, 2.3, 2.95),
    2: (3.001, 3.05, 3.2, 1 + math.sqrt(5), 3.44),
    4: (3.46, 3.498561699327701, 3.53),
    8: (3.549, 3.5546438, 3.56),
    3: (1 + math.sqrt(8) + 1e-6, 3.8305, 3.8312, 3.8318740552833155, 3.84),
}


@pytest.mark.parametrize(("nearest", "near"), [(0.0, [0.0]), (1 / 64, [1 / 64, 1 / 32, 1 / 16, 1 / 8])])
def test_cells_are_equal_or_double_towards_an_anchor(nearest, near):
    assert work._places(4, nearest).tolist() == [*near, 0.25, 0.5, 0.75, 1.0]


@pytest.mark.parametrize("period", PERIODS)
def test_logistic_cycles(period):
    t = logistic(*PERIODS[period])
    assert decided(t)
    assert t.attractors.tolist() == [1] * len(PERIODS[period])
    assert t.period[:, 0].tolist() == t.bands[:, 0, 0].tolist() == [period] * len(PERIODS[period])
    assert t.share[:, 0] == pytest.approx(1.0)


def test_logistic_fixed_point_and_cycle_of_two():
    t = logistic(2.3, 2.8, 3.2, 3.4)
    for i, r in enumerate((2.3, 2.8)):
        assert t.lowest[i, 0, 0] == pytest.approx(1 - 1 / r, abs=1e-10)
        assert t.reach[i, 0, 0] == pytest.approx(1 - 1 / r, abs=1e-10)
    for i, r in ((2, 3.2), (3, 3.4)):
        root = math.sqrt((r + 1) * (r - 3))
        assert t.lowest[i, 0, 0] == pytest.approx((r + 1 - root) / (2 * r), abs=1e-10)
        assert t.reach[i, 0, 0] == pytest.approx((r + 1 + root) / (2 * r), abs=1e-10)


def test_logistic_core_and_exponent():
    rs = (3.7, 3.8, 3.9, 4.0)
    t = logistic(*rs, throws=200_000)
    assert decided(t)
    for i, r in enumerate(rs):
        assert (t.bands[i, 0, 0], t.period[i, 0]) == (1, 0)
        assert t.lowest[i, 0, 0] == pytest.approx(r * r / 4 * (1 - r / 4), abs=1e-12)
        assert t.reach[i, 0, 0] == pytest.approx(r / 4, abs=1e-12)
    assert t.lyapunov[3, 0] == pytest.approx(math.log(2), abs=5 * t.lyapunov_error[3, 0])
    assert t.lyapunov_error[3, 0] < 0.01


# r at which two bands become one and four become two: F^3(1/2) is the fixed point, F^5(1/2) one of the cycle of two
MERGE = {1: 3.678573510428322, 2: 3.592572184}


@pytest.mark.parametrize("bands", MERGE)
@pytest.mark.parametrize("off", [1e-2, 1e-3, 1e-4, 1e-5, 1e-6])
def test_bands_merge_or_are_undecided(bands, off):
    if bands == 2 and off <= 1e-6:
        off = 2e-6  # the place is known to 1e-9 and the gap is a few times as wide
    t = logistic(MERGE[bands] - off, MERGE[bands] + off)
    for i, right in ((0, 2 * bands), (1, bands)):
        periodic = t.period[i, 0] > 0  # a window between
        assert t.undecided[i] or periodic or t.bands[i, 0, 0] == right


def test_weakly_attracting_cycles_are_no_bands():
    # beyond the ends of windows cycles attract slowly: six points, or 16, or nothing said, but never a band
    rs = [3.8415, 3.84151, 3.8416, 3.8425, 3.0001, 3.0005, 3.4496, 3.5442, 3.8285]
    t = logistic(*rs)
    assert all(t.undecided[i] or t.period[i, 0] > 0 for i in range(len(rs)))


def test_a_fixed_point_on_the_edge_of_a_cell_is_one():
    rs = [1 / (1 - k / 60) for k in range(6, 40)]
    t = logistic(*rs)
    wrong = [rs[i] for i in range(len(rs)) if not t.undecided[i] and t.attractors[i] != 1]
    assert not wrong
    assert decided(t)


@pytest.mark.parametrize("doublings", [0, 1, 2, 3])
def test_tent_bands(doublings):
    # x -> F^2(x) on its right part is a tent of slope s^2: each halving of ln s doubles the bands
    slopes = [2.0 ** (top / 2**doublings) for top in (0.55, 0.7, 0.85, 0.97)]
    t = found([Tent(s) for s in slopes], throws=4000)
    # eight bands and gaps are down to 3e-5 wide, less than the finest cells: then nothing may be said
    told = np.flatnonzero(t.undecided == 0)
    assert told.size >= (4, 4, 3, 0)[doublings]
    for i in told:
        s = slopes[i]
        assert (t.attractors[i], t.bands[i, 0, 0], t.period[i, 0]) == (1, 2**doublings, 0)
        assert t.lowest[i, 0, 0] == pytest.approx(s * (1 - s / 2), abs=1e-12)
        assert t.reach[i, 0, 0] == pytest.approx(s / 2, abs=1e-12)
        assert t.lyapunov[i, 0] == pytest.approx(math.log(s), abs=1e-9)
        assert (t.leaves[i], t.collapses[i], t.share[i, 0]) == (0.0, 0.0, pytest.approx(1.0))


def test_tents_that_leave():
    t = found([Tent(s) for s in (2.05, 2.4, 3.0)])
    assert decided(t)
    assert t.attractors.tolist() == [0, 0, 0]
    assert t.leaves == pytest.approx(1.0)


def test_circle_locks_to_the_fixed_point():
    couplings = (0.3, 0.6, 0.95)
    for share, locked in ((0.2, True), (0.97, True), (1.03, False)):
        t = found([maps.Circle(share * k / math.tau, k) for k in couplings])
        for i in range(len(couplings)):
            assert t.undecided[i] or (t.period[i, 0] == 1) == locked
            if locked:
                assert not t.undecided[i]
                x = math.asin(share) / math.tau
                assert t.lowest[i, 0, 0] == pytest.approx(x, abs=1e-9)


def test_circle_staircase():
    coupling, omegas = 0.9, np.arange(0.01, 0.5, 0.0103)
    t = found([maps.Circle(omega, coupling) for omega in omegas])
    told, rotation = 0, rotations(omegas, coupling)
    for i, omega in enumerate(omegas):
        tongue = tongue_of(omega, coupling, rotation[i])
        if t.undecided[i] or (tongue and tongue[0] < 0):
            continue
        told += 1
        period = int(t.period[i, 0])
        if tongue:
            assert period == tongue[1], omega
        else:
            assert period == 0 or period > 16
        if period:
            turns = period * rotation[i]
            assert turns == pytest.approx(round(turns), abs=period * 1e-4)
            assert t.bands[i, 0, 0] == period
        else:
            assert [t.lowest[i, 0, 0], t.reach[i, 0, 0]] == pytest.approx([0.0, 1.0], abs=1e-9)
    assert told >= 0.9 * omegas.size


@pytest.mark.sweep
def test_cubic_shares():
    # below sqrt r the sign stays, and images come to 2 (r/3)^(3/2) at most; u = +-sqrt(r - 1)
    rs, lo, hi = (1.46, 1.5, 1.8, 1.95), -1.1, 1.2
    t = found([maps.Cubic(r) for r in rs], lo, hi)
    assert decided(t)
    assert t.attractors.tolist() == [2] * len(rs)
    assert t.period[:, :2].tolist() == [[1, 1]] * len(rs)
    assert t.lowest[:, :2, 0] == pytest.approx(np.array([[-math.sqrt(r - 1), math.sqrt(r - 1)] for r in rs]))
    # the cell in which 0 lies counts for one of them
    assert t.share[:, :2] == pytest.approx(np.array([[1.1, 1.2]] * len(rs)) / 2.3, abs=1 / 300)


def test_cubic_basin_ends_at_its_cycle_of_two():
    # for r = 1/2 orbits from within sqrt(r + 1) come to 0, those from beyond leave
    rs, half = (0.3, 0.5, 0.8), 2.0
    t = found([maps.Cubic(r) for r in rs], -half, half)
    assert decided(t)
    assert t.period[:, 0].tolist() == [1, 1, 1]
    for i, r in enumerate(rs):
        assert t.share[i, 0] == pytest.approx(math.sqrt(r + 1) / half, abs=2e-3)
        assert t.leaves[i] + t.collapses[i] == pytest.approx(1 - math.sqrt(r + 1) / half, abs=2e-3)


@pytest.mark.sweep
def test_a_chaotic_attractor_beside_a_fixed_point():
    t = found([Two(1.9, 0.5, 0.6), Two(1.3, -0.5, 0.37), Two(1.5, 0.9, 0.41)], -1.0, 1.0)
    assert decided(t)
    assert t.attractors.tolist() == [2, 2, 2]
    assert t.period[:, :2].tolist() == [[0, 1]] * 3
    assert t.bands[:, :2, 0].tolist() == [[1, 1], [2, 1], [1, 1]]
    assert t.share[:, :2] == pytest.approx(0.5)
    assert t.lowest[:, 1, 0] == pytest.approx([0.6, 0.37, 0.41], abs=1e-8)


@pytest.mark.sweep
def test_a_jump_within_a_branch():
    jumps = (0.1, 0.3, 0.777)
    t = found([Grazing(j) for j in jumps])
    for i, jump in enumerate(jumps):
        assert t.undecided[i] or t.attractors[i] == 2
        assert t.undecided[i] or t.share[i, :2] == pytest.approx([jump, 1 - jump], abs=1 / LEVELS[0][0])


@pytest.mark.sweep
def test_contractions():
    slopes = (0.98, 0.5, 0.0, -0.5, -0.98)
    t = found([Grazing(2.0, s, 0.3 * (1 - s)) for s in slopes])  # no jump in [0, 1]
    assert decided(t)
    assert t.period[:, 0].tolist() == [1] * 5
    assert t.reach[:, 0, 0] == pytest.approx(0.3, abs=1e-6)


# ----------------------------------------------------------------
# Points of the window against the reference: a handful, and twenty of them, half of these next to boundaries.


def compared(stack, found, i, cells):
    """Fields in which a point of the window differs."""
    lo, hi = stack.lo[i], stack.hi[i]
    r = reference(point_of(stack.params, i), lo, hi, cells=cells, seed=i)
    return differences(found, i, r, STARTS, float((hi - lo).max()))


def test_reference_knows_the_logistic_map():
    # two bands for r below 3.678573510428322 (gap where F^3(1/2) has not reached 1 - 1/r), one above, a cycle of three
    two, one, three = (reference(maps.Logistic(r), [0.0], [1.0], cells=40_000) for r in (3.67, 3.7, 3.83))
    assert [len(r.attractors) for r in (two, one, three)] == [1, 1, 1]
    assert [len(r.attractors[0].bands[0]) for r in (two, one, three)] == [2, 1, 3]
    assert [r.attractors[0].period for r in (two, one, three)] == [0, 0, 3]
    lo, hi = one.attractors[0].bands[0][0]
    assert (lo, hi) == (pytest.approx(0.925 * (1 - 0.925) * 3.7), pytest.approx(0.925))


@pytest.mark.parametrize("name", ["paper-designed", pytest.param("paper-initial", marks=pytest.mark.sweep)])
def test_a_handful(name):
    # escape of some, of all, none of either, and the collapse
    scene = ls.load(name)
    stack = throw_stack(scene, {"arm.surface_height": [-2.0, -0.9, -0.31, 0.15]})
    found = topologies(stack.params, stack.lo, stack.hi, stack.anchor)
    for i in range(4):
        assert found.undecided[i] == 0
        assert compared(stack, found, i, 40_000) == {}


def test_throws_that_the_fast_search_for_the_impact_cannot_vouch_for():
    # kappa below the radius of the struck vertex on side 2, hypot(a, d) = 4.28 in: several impacts, and grazing
    scene = ls.load("paper-designed").with_values({"throw.kappa": "3.5 in"})
    assert maps.images(scene.map, np.linspace(5.0, 28.0, 100), 2).second_pass == 1.0
    stack = throw_stack(scene, {"arm.surface_height": [-0.6, 0.1]})
    found = topologies(stack.params, stack.lo, stack.hi, stack.anchor)
    assert found.attractors.tolist() == [1, 0]
    for i in range(2):
        assert found.undecided[i] == 0
        assert compared(stack, found, i, 40_000) == {}


def test_differences_are_seen():
    t = topologies(stacked([maps.Logistic(3.7)]), [[0.0]], [[1.0]])
    r = reference(maps.Logistic(3.69), [0.0], [1.0], cells=40_000)
    assert set(differences(t, 0, r, STARTS, 1.0)) == {"extents 0 0"}
    r = reference(maps.Logistic(3.66), [0.0], [1.0], cells=40_000)
    assert "bands 0 0" in differences(t, 0, r, STARTS, 1.0)
    r = reference(maps.Logistic(3.83), [0.0], [1.0], cells=40_000)
    assert "period 0" in differences(t, 0, r, STARTS, 1.0)


@pytest.mark.sweep
@pytest.mark.parametrize("count", [20, pytest.param(60, marks=pytest.mark.repeats)])
def test_points_of_the_window(count):
    points = points_of(ls.load("paper-designed"), count, seed=12)
    found = points.found
    anywhere = ~points.at_boundary
    assert (found.undecided[anywhere] > 0).sum() <= 1  # two in a hundred of many
    for i in np.flatnonzero(found.undecided == 0):
        if compared(points.stack, found, i, 40_000):
            # what only the coarser cells say is their own error
            assert compared(points.stack, found, i, 160_000) == {}, points.places[i]
