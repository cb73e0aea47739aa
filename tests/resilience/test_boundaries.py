"""What is measured at boundaries, and steps to the end, against closed forms."""

import math

import numpy as np
import pytest

import limitsets as ls
from limitsets.systems.resilience import uncertainty
from tests.maps_of_tests import Contraction, ThreeState, TwoState
from tests.resilience.maps_with_basins import Gaps, Sheet, Turnstile, Wall
from tests.resilience.test_shares import CUBIC, TWO_SIDES, setting

UNIT = [(0.0, 1.0)]

# ---------------------------------------------------------------- uncertainty exponent


@pytest.mark.parametrize(
    ("params", "domain", "cells", "dimension"),
    [
        (CUBIC, [(-1.2, 1.2)], 4000, 1),
        (ThreeState(), [(-3.0, 3.0)], 4001, 1),
        (TwoState(1.0), [(-2.0, 2.0), (-2.0, 2.0)], 300, 2),
        (Wall(0.3), [(-1.0, 1.0)] * 3, 40, 3),
    ],
    ids=lambda value: type(value).__name__,
)
def test_straight_boundaries_have_exponent_one(params, domain, cells, dimension):
    found = ls.resilience.uncertainty_exponent(*setting(params, domain, cells))
    assert found.exponent == pytest.approx(1.0, abs=0.01)
    assert found.boundary_dimension == pytest.approx(dimension - 1.0, abs=0.01)
    assert found.undecided == 0.0
    assert found.apart[-1] == min(100, cells // 4)


@pytest.mark.parametrize(
    ("params", "dimension"),
    [(Gaps(1.0, 1.0), math.log(2) / math.log(3)), (Gaps(2.0, 0.0), math.log(3) / math.log(5))],
    ids=str,
)
def test_open_maps_have_exponent_one_minus_the_dimension(params, dimension):
    """n + 1 branches of slope 2 n + 1: D = ln(n + 1) / ln(2 n + 1), over two decades to a few per cent."""
    graph, attractors = setting(params, UNIT, 50_021)
    found = [ls.resilience.uncertainty_exponent(graph, attractors, seed=seed) for seed in range(3)]
    assert np.mean([each.exponent for each in found]) == pytest.approx(1.0 - dimension, abs=0.02)
    assert found[0].boundary_dimension == pytest.approx(dimension, abs=0.03)
    assert found[0].apart[[0, -1]].tolist() == [1, 100]
    assert all(abs(each.exponent - 1.0 + dimension) <= each.error < 0.06 for each in found)


@pytest.mark.sweep
def test_an_open_map_in_the_plane_has_the_same_exponent_along_its_steep_axis():
    """Starts apart along x_1 come to the same exit: the mean over both axes is half, with the same exponent."""
    found = ls.resilience.uncertainty_exponent(*setting(Sheet(2.0, 0.0), UNIT * 2, (2003, 410)))
    assert found.boundary_dimension == pytest.approx(1.0 + math.log(3) / math.log(5), abs=0.05)


def test_the_axis_with_most_uncertain_starts_says_what_saturates():
    """No start is uncertain along x_1: the mean over both axes is half the share along x_0, that saturates."""
    graph, attractors = setting(Sheet(1.0, 1.0), [*UNIT, (-1.0, 1.0)], (601, 60))
    found = ls.resilience.uncertainty_exponent(graph, attractors, starts=20_000, seed=1000)
    assert (
        2.0 * found.shares[found.fitted].max() <= 0.5 * 0.75 * 1.05
    )  # two basins alike: 1 - 2 (1/2)^3 = 3/4
    assert abs(found.exponent - 1.0 + math.log(2) / math.log(3)) <= found.error < 0.2


def test_starts_beside_undecided_ones_are_left_out():
    """Of five starts in a row the middle one is undecided: the two beside it are left out, the others agree."""
    row, label = ls.grid([(0.0, 1.0)], cells=5), np.array([0, 0, ls.maps.UNDECIDED, 1, 1])
    assert uncertainty._uncertain(row, label, 1) == (0.0, 0.0)
    assert uncertainty._uncertain(row, label, 3) == (1.0, 1.0)  # 0 with 3, 1 with 4


def test_starts_on_their_way_are_told_and_left_out():
    found = ls.resilience.uncertainty_exponent(*setting(Gaps(2.0, 0.0), UNIT, 20_011), steps=1)
    assert found.undecided > 0.01
    whole = ls.resilience.uncertainty_exponent(*setting(Gaps(2.0, 0.0), UNIT, 20_011))
    assert whole.undecided == 0.0
    assert found.shares[0] < whole.shares[0]


def test_without_a_boundary_there_is_no_exponent():
    found = ls.resilience.uncertainty_exponent(*setting(Contraction(0.5, 0.0), [(-1.0, 1.0)], 401))
    assert math.isnan(found.exponent)
    assert (found.shares == 0.0).all()


def test_shares_weigh_in_the_exponent_by_the_variance_of_a_binomial():
    """The logarithm of a share f of n starts has the variance (1 - f) / n: against the weighted fit of numpy."""
    apart, starts = np.geomspace(1.0, 100.0, 6), 400.0
    shares = np.array([0.02, 0.06, 0.12, 0.35, 0.7, 0.95])
    slope, _ = uncertainty._fit(apart, shares, starts * shares)
    sizes = 1.0 / np.sqrt((1.0 - shares) / (starts * shares))
    assert slope == pytest.approx(np.polyfit(np.log(apart), np.log(shares), 1, w=sizes)[0], rel=1e-9)


# ---------------------------------------------------------------- Wada


@pytest.mark.parametrize(
    ("params", "domain", "cells"), [(Gaps(3.0, 0.0), UNIT, 20_011), (Sheet(3.0, 0.0), UNIT * 2, (2003, 20))]
)
def test_three_mixed_exits_are_wada_at_this_resolution(params, domain, cells):
    found = ls.resilience.wada(*setting(params, domain, cells))
    assert found.basins == ("first", "second", "third")
    assert (np.diff(found.shares) >= 0.0).all()
    assert found.shares[0] < 0.7 < 0.95 < found.shares[-1]
    assert (found.boxes, len(found.shares)) == (400, 4)
    assert found.of > 400
    assert "at this resolution" in found.how


def test_boundaries_of_two_basins_each_are_not_wada():
    found = ls.resilience.wada(*setting(ThreeState(), [(-3.0, 3.0)], 4001))
    assert found.basins == (0, 1, 2)
    assert found.shares == (0.0, 0.0, 0.0, 0.0)
    assert found.boxes == found.of == 4  # two boundaries, and the two middle cells beside each


def test_two_basins_cannot_be_wada():
    found = ls.resilience.wada(*setting(CUBIC, [(-1.2, 1.2)], 1000))
    assert all(math.isnan(share) for share in found.shares)
    assert found.of > 0


# ---------------------------------------------------------------- fatal shocks


@pytest.mark.parametrize("method", [None, "boxes"])
@pytest.mark.parametrize(
    ("x", "shock"),
    [(0.5**0.5, 1.5**0.5 - 0.5**0.5), (0.3, -0.3), (-1.0, 1.0 - 1.5**0.5), (1.35, 1.5**0.5 - 1.35)],
)
def test_fatal_shocks_of_the_cubic_map(method, x, shock):
    """On [-1.5, 1.5] basins end at 0 and +-sqrt(1.5); beyond, a start comes to the other attractor."""
    graph, attractors = setting(CUBIC, [(-1.5, 1.5)], 9000, method)
    found = ls.resilience.minimal_fatal_shock(graph, attractors, x)
    assert found.lo <= abs(shock) <= found.hi < found.lo + 3e-3
    assert found.shock[0] == pytest.approx(shock, abs=1e-3)
    assert found.how == ("proved" if method else "cells")
    assert method or found.hi - found.lo >= 4.0 * 3.0 / 9000  # two cells at either end
    assert {found.basin, found.into} == {0, 1}


def test_a_shock_over_the_border_of_the_domain_is_fatal():
    graph, attractors = setting(CUBIC, [(-1.2, 1.2)], 2000, "boxes")
    found = ls.resilience.minimal_fatal_shock(graph, attractors, 0.75)
    assert found.into == "outside"
    assert found.lo <= 0.45 <= found.hi < found.lo + 1e-9


@pytest.mark.parametrize("method", [None, "boxes"])
def test_fatal_shocks_keep_the_side(method):
    """x' = x^2 turns over beyond 1/2: from 0 on either side that is the nearest place, into the other side's basin."""
    graph, attractors = setting(Turnstile(2.0), TWO_SIDES, 4500, method)
    for side in (0, 1):
        found = ls.resilience.minimal_fatal_shock(graph, attractors, 0.2, side)
        assert found.lo <= 0.3 <= found.hi < found.lo + 5e-3
        assert found.into == 1 - found.basin
        assert attractors[found.basin].cells.extents().keys() == {side}
    gone = ls.resilience.minimal_fatal_shock(graph, attractors, 1.6, 0)
    assert (gone.basin, gone.lo) == (
        "outside",
        pytest.approx(0.4, abs=2e-3),
    )  # beyond the border it is out as well


def test_fatal_shocks_in_the_plane_are_euclidean():
    """The basins of TwoState meet on the line x_0 = 0; the border of the square is farther."""
    graph, attractors = setting(TwoState(1.0), [(-2.0, 2.0), (-2.0, 2.0)], 200)
    found = ls.resilience.minimal_fatal_shock(graph, attractors, (0.5, -0.3))
    assert found.lo <= 0.5 <= found.hi
    assert found.shock[0] == pytest.approx(-0.5, abs=0.05)
    assert found.shock[1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("method", [None, "boxes"])
def test_the_joint_is_a_basin_of_its_own(method):
    """With the arm above the joint starts below an unstable fixed point of the jog creep inward: 3.18 in at h = 0.1 in.

    The place is the root of the jog's displacement, computed apart by bisection.
    """
    scene = ls.load("paper-designed").with_values({"arm.surface_height": "0.1 in"})
    graph, attractors = setting(scene.map, scene.domain, 8192, method)
    lo, hi = 2.5, 4.0
    for _ in range(60):
        middle = 0.5 * (lo + hi)
        lo, hi = (middle, hi) if ls.maps.images(scene.map, [middle], 0).x[0] < middle else (lo, middle)
    found = ls.resilience.minimal_fatal_shock(graph, attractors, 8.0, 0)
    assert found.into == "inward"
    assert found.lo <= 8.0 - lo <= found.hi < found.lo + 0.15
    shares = ls.resilience.basin_stability(graph, attractors)
    assert shares.exits["inward"].lo > 0.0
    for share in (*shares.attractors, *shares.exits.values()):
        assert share.lo <= share.share <= share.hi
    assert shares.exits["outward"].hi == 0.0


# ---------------------------------------------------------------- convergence times


def test_steps_of_a_contraction():
    """From x a halving map takes ceil(log2(|x| / b)) steps to [-b, b], the attracting cells."""
    graph, attractors = setting(Contraction(0.5, 0.0), [(-1.0, 1.0)], 1001, "boxes")
    ((lo, hi),) = attractors[0].extents[0]
    found = ls.resilience.convergence_times(graph, attractors, starts=20_000)
    times = found.attractors[0]
    steps = np.ceil(np.log2(1.0 / hi))
    exact = sum(k * min(hi * 2.0**k, 1.0) - k * hi * 2.0 ** (k - 1) for k in range(1, int(steps) + 1))
    assert lo == pytest.approx(-hi)
    assert times.mean == pytest.approx(exact, abs=0.05)
    assert times.longest == steps <= times.at_most <= steps + 2
    assert exact <= times.mean_at_most <= exact + 2.0
    assert (times.starts, found.undecided) == (20_000, 0.0)
    late = ls.resilience.convergence_times(graph, attractors, starts=2000, steps=3)
    assert late.undecided == pytest.approx(1.0 - 8.0 * hi, abs=0.02)


def test_steps_out_of_an_open_map_are_geometric():
    """Each step leaves with probability n / (2 n + 1)."""
    found = ls.resilience.convergence_times(*setting(Gaps(2.0, 0.0), UNIT, 2003), starts=40_000)
    assert found.attractors == ()
    for name in ("first", "second"):
        assert found.exits[name].mean == pytest.approx(2.5, abs=0.05)
        assert found.exits[name].median == 2.0  # 2/5 leave at once, 16/25 within two steps
        assert found.exits[name].at_most is None
    assert math.isnan(found.exits["third"].mean)


def test_proved_bounds_hold_for_every_orbit_of_the_inner_basin():
    graph, attractors = setting(CUBIC, [(-1.7, 1.7)], 600, "boxes")
    found = ls.resilience.convergence_times(graph, attractors, starts=100)
    shares = ls.resilience.basin_stability(graph, attractors)
    rng = np.random.default_rng(0)
    for number, times in enumerate([*found.attractors, found.exits["outside"]]):
        cells = shares.inner[number].numbers()
        lo, hi = graph.grid.boxes(rng.choice(cells, 2000), 0)
        x = lo[:, 0] + rng.random(2000) * (hi - lo)[:, 0]
        for _ in range(times.at_most):
            x = x * (1.5 - x * x)
            x = np.where(np.abs(x) > 1.7, np.inf, x) if number == 2 else x
            with np.errstate(invalid="ignore"):
                x = np.where(np.isfinite(x), x, np.inf)
        assert times.mean_at_most <= times.at_most
        assert np.isinf(x).all() if number == 2 else attractors[number].cells.holds(x, 0).all()
