"""The topology of throws, and of narrow cycles."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.feeder.scene.arrays import throw_stack
from limitsets.systems.maps import INWARD, advance
from limitsets.systems.maps.pieces import point_of, stacked
from limitsets.systems.sets.topology import topologies
from tests.test_paper import LIMIT_SETS

# ----------------------------------------------------------------
# The throw: the paper's four scenes, escape and collapse with the height of the arm.


# docs/model.md, reference numbers: jogs per visit, exponent and flips per throw (where the digits are given); the limit
# sets of the decimal scenes at 40 digits are those of tests/test_paper.py.
SCENES = {
    "paper-initial-small-angle": (((19, 20), (4, 6), (20, 22)), 0.0232, None),
    "paper-designed-small-angle": (((0, 0), (2, 4), (48, 52)), 0.0403, None),
    "paper-initial": (((6, 11), (1, 1), (2, 3)), 0.099, 0.1998),
    "paper-designed": (((0, 0), (0, 0), (3, 11)), 0.206, 0.3191),
}


def of_scene(scene, heights, throws=0):
    stack = throw_stack(scene, {"arm.surface_height": heights})
    assert stack.possible.all()
    return stack, topologies(stack.params, stack.lo, stack.hi, stack.anchor, throws=throws)


@pytest.mark.parametrize("name", SCENES)
def test_paper_scenes(name):
    scene = ls.load(name)
    jogs, lyapunov, flips = SCENES[name]
    sides = [LIMIT_SETS[name][side] for side in range(3)]
    domain = throw_stack(scene, {})
    t = topologies(stacked([scene.bare_map]), domain.lo, domain.hi, domain.anchor, throws=200_000)
    assert (t.attractors[0], t.undecided[0], t.period[0, 0]) == (1, 0, 0)
    assert t.bands[0, 0].tolist() == [len(bands) for bands in sides]
    assert t.lowest[0, 0] == pytest.approx([bands[0][0] for bands in sides], abs=1e-9)
    assert t.reach[0, 0] == pytest.approx([bands[-1][1] for bands in sides], abs=1e-9)
    assert t.flip_order[0, 0].tolist() == [0, 1, 2]
    assert list(zip(t.jogs_min[0, 0].tolist(), t.jogs_max[0, 0].tolist(), strict=True)) == list(jogs)
    assert (t.leaves[0], t.collapses[0], t.share[0, 0]) == (0.0, 0.0, pytest.approx(1.0))
    # the last digit given, and the error of the mean
    digit = 10.0 ** -(len(str(lyapunov)) - 2)
    assert t.lyapunov[0, 0] == pytest.approx(lyapunov, abs=0.6 * digit + 4 * t.lyapunov_error[0, 0])
    if flips is not None:
        assert t.flips_per_throw[0, 0] == pytest.approx(flips, abs=1e-3)
    if name.endswith("small-angle"):  # every branch has the same slope
        params = scene.bare_map
        exact = math.log(1.0 + 2.0 * abs(params.surface_height) / params.kappa)
        assert t.lyapunov[0, 0] == pytest.approx(exact, abs=1e-9)


EXACT = ("paper-initial", "paper-designed")


def lost(stack, i, starts=200):
    """Shares of the starts that leave and that come to the joint, by orbits; each share's standard error."""
    params, sides = point_of(stack.params, i), stack.lo.shape[1]
    side = np.repeat(np.arange(sides), starts)
    # the middle of equal stretches of each side
    x = (stack.lo[i] + (stack.hi[i] - stack.lo[i]) * ((np.arange(starts) + 0.5) / starts)[:, None]).T.ravel()
    weight = (stack.hi[i] - stack.lo[i])[side] / (stack.hi[i] - stack.lo[i]).sum() / starts
    x, side, code, _ = advance(params, x, side, 4000)
    inward = (code == INWARD) | (np.abs(x - params.a[side]) < 1e-2)  # jogs shrink towards the joint for ever
    outward = (code < 0) & (code != INWARD)
    return float(weight @ outward), float(weight @ inward), 1.0 / math.sqrt(starts * sides)


def test_escape_far_below_the_joint():
    # docs/model.md: strong outward jogs beat the flips; at h = -2 some starts leave, or all, at h = -3 all of them do
    for name in EXACT:
        stack, t = of_scene(ls.load(name), np.array([-2.0, -2.5, -3.0]))
        assert t.undecided.tolist() == [0, 0, 0]
        assert t.collapses.tolist() == [0.0, 0.0, 0.0]
        assert t.leaves[0] > 0.02
        assert (t.leaves[2], t.attractors[2]) == (1.0, 0)
        for i in range(3):
            outward, inward, error = lost(stack, i)
            assert t.leaves[i] == pytest.approx(outward, abs=error)
            assert inward == 0.0


@pytest.mark.parametrize("name", SCENES)
def test_collapse_above_the_joint(name):
    # docs/model.md: for h > 0 the jogs below a fixed point go inward; with small angles all starts do from h = 0.1 on
    heights = np.array([0.5, 0.75, 1.0]) if name in EXACT else np.array([0.1, 0.2, 0.5, 1.0])
    stack, t = of_scene(ls.load(name), heights)
    assert t.undecided.tolist() == [0] * heights.size
    assert t.attractors.tolist() == [0] * heights.size
    assert t.collapses == pytest.approx(1.0)
    for i in range(heights.size):
        assert lost(stack, i)[:2] == (0.0, pytest.approx(1.0))


def test_starts_below_the_fixed_point_of_the_jog_collapse():
    # docs/model.md: designed, h = 0.1: below 3.16, 3.19, 4.81 on sides 0, 1, 2; h = 0.2: below 4.64, 4.55, 5.39
    stack, t = of_scene(ls.load("paper-designed"), np.array([0.1, 0.2]))
    borders = np.array([[3.16, 3.19, 4.81], [4.64, 4.55, 5.39]])
    share = (borders - stack.lo).sum(axis=1) / (stack.hi - stack.lo).sum(axis=1)
    assert t.undecided.tolist() == [0, 0]
    # a border falls into one of 300 cells of each side, and a flip may bring a few more starts there
    assert np.all(t.collapses >= share - 1 / 300)
    for i in range(2):
        assert t.collapses[i] == pytest.approx(lost(stack, i)[1], abs=1 / 300)


# ----------------------------------------------------------------
# Attracting cycles with narrow basins, told apart from chaos: against orbits of the critical point, in plain numpy.


class TwoSines(NamedTuple):
    """A circle map of two harmonics with a branch for each whole turn."""

    omega: float
    k: float
    m: float


def _lift(p, x):
    turned = p.k / (2 * math.pi) * math.sin(2 * math.pi * x) + p.m / (4 * math.pi) * math.sin(4 * math.pi * x)
    return x + p.omega - turned


def _sines(p, x, side):
    y = _lift(p, x)
    return y - math.floor(y), side, math.floor(y) + 1


def _sines_on(p, x, side, branch):
    return _lift(p, x) - (branch - 1), side


ls.register(TwoSines, image=_sines, image_on=_sines_on, branches=("back", "same", "on"))


# The longest cycle that is looked for, and what is near enough for Newton's method to begin.
LONGEST, NEAR = 256, 1e-2


class Ricker(NamedTuple):
    """Ricker's map with a share m harvested: x exp(r - x) (1 - m); its critical point is 1."""

    r: float = 2.7
    m: float = 0.0


def _ricker(p, x, side):
    return x * math.exp(p.r - x) * (1.0 - p.m), side, 0


def _ricker_on(p, x, side, branch):
    factor = math.exp(p.r - x) * (1.0 - p.m)
    return x * factor, side, factor * (1.0 - x)


ls.register(Ricker, image=_ricker, image_on=_ricker_on)


def periods(f, slope, critical, throws=20_000):
    """Periods of the attracting cycles that orbits of critical points come to, 0 for none up to `LONGEST`.

    `f(x, k)` and `slope(x, k)` take the numbers k of the points.
    """
    every = np.arange(critical.size)
    x = critical.copy()
    for _ in range(throws):
        x = f(x, every)
    found = np.zeros(x.size, np.int64)
    y, returns = x.copy(), []
    for period in range(1, LONGEST + 1):
        y = f(y, every)
        returns += [(k, period) for k in np.flatnonzero(np.abs(y - x) <= NEAR * np.abs(x))]
    for k, period in returns:
        if found[k]:
            continue
        z = x[k]
        for _ in range(40):
            w, rate = z, 1.0
            for _ in range(period):
                rate, w = rate * slope(w, k), f(w, k)
            move = (w - z) / (1.0 - rate) if rate != 1.0 else math.inf
            z += move
            if not abs(z - x[k]) <= 0.1 * abs(x[k]) or abs(move) <= 1e-13 * abs(z):
                break
        if abs(z - x[k]) <= 0.1 * abs(x[k]) and abs(move) <= 1e-9 * abs(z) and abs(rate) < 1.0:
            found[k] = period
    return found


def of_ricker(count):
    """Topologies at random points, and the periods by the other way."""
    rng = np.random.default_rng(27)
    r, m = rng.uniform(2.7, 3.6, count), rng.uniform(0.0, 0.3, count)
    stack = stacked([Ricker(*pair) for pair in zip(r.tolist(), m.tolist(), strict=True)])
    t = topologies(stack, np.zeros((count, 1)), np.full((count, 1), 14.0))
    return t, periods(
        lambda x, k: x * np.exp(r[k] - x) * (1.0 - m[k]),
        lambda x, k: np.exp(r[k] - x) * (1.0 - m[k]) * (1.0 - x),
        np.ones(count),
    )


def of_logistic(count):
    """The same of the logistic map."""
    r = np.random.default_rng(3).uniform(3.5, 4.0, count)
    t = topologies(stacked([maps.Logistic(each) for each in r]), np.zeros((count, 1)), np.ones((count, 1)))
    slope, tops = lambda x, k: r[k] * (1.0 - 2.0 * x), np.full(count, 0.5)
    return t, periods(lambda x, k: r[k] * x * (1.0 - x), slope, tops)


@pytest.mark.sweep
def test_a_cycle_that_was_told_as_two_bands():
    # period 60, multiplier 0.44: its immediate basin is narrower than the finest cells
    t = topologies(stacked([Ricker(3.021714671660232, 0.228946186747888)]), [[0.0]], [[14.0]])
    assert (t.undecided[0], t.attractors[0], t.period[0, 0], t.bands[0, 0, 0]) == (0, 1, 60, 60)


@pytest.mark.parametrize(
    ("of_map", "count", "cycles"),  # so many there are at least
    [
        (of_ricker, 600, 0.25),
        (of_logistic, 700, 0.1),
        pytest.param(of_ricker, 10_000, 0.25, marks=pytest.mark.repeats),
    ],
)
def test_no_cycle_of_a_map_is_told_as_chaos(of_map, count, cycles):
    t, period = of_map(count)
    told = t.undecided == 0
    assert (told & (period > 0) & (t.period[:, 0] != period)).sum() == 0
    longer = told & (period == 0) & (t.period[:, 0] > 0)
    assert (t.period[longer, 0] > LONGEST).all()
    assert (~told).sum() <= 0.04 * count
    assert (~told & (period > 0)).sum() <= 0.005 * count
    assert (period > 0).sum() > cycles * count


@pytest.mark.parametrize(("r", "period"), [(3.0, 1), (1.0 + math.sqrt(6.0), 2), (1.0 + math.sqrt(8.0), 3)])
def test_at_a_bifurcation_no_longer_cycle_is_told(r, period):
    # the multiplier is 1 or -1 to rounding: orbits close as slowly as 1 / sqrt(throws)
    t = topologies(stacked([maps.Logistic(r)]), [[0.0]], [[1.0]])
    assert t.undecided[0] or t.period[0, 0] == period


@pytest.mark.sweep
@pytest.mark.parametrize(
    ("circle", "period"),
    # the orbit {0, 1/2} of multiplier (1 - m)^2 - k^2, and the fixed point 0 of multiplier 1 - k - m
    [(TwoSines(0.5, 0.75, 0.2), 2), (TwoSines(0.5, 0.4, 0.2), 2), (TwoSines(0.0, 1.5, 0.3), 1)],
)
def test_a_cycle_on_the_cut_of_a_circle_is_not_told_twice(circle, period):
    """0 and 1 are one place of the circle: the same cycle was told as two attractors, of periods 3 and 2."""
    t = topologies(stacked([circle]), [[0.0]], [[1.0]])
    assert t.undecided[0] or (t.attractors[0] == 1 and t.period[0, 0] == period)


@pytest.mark.parametrize("cubic", [1.5, 2.4, 2.9])
def test_two_attractors_of_two_critical_points_stay_two(cubic):
    # x' = r x - x^3 is odd: its two critical points have mirrored orbits, to one symmetric attractor or to two
    t = topologies(stacked([maps.Cubic(cubic)]), [[-2.0]], [[2.0]])
    x, _, _, _ = advance(maps.Cubic(cubic), [math.sqrt(cubic / 3.0)], [0], 5000)
    path = ls.orbit(maps.Cubic(cubic), float(x[0]), 0, 5000).x
    assert t.undecided[0] or t.attractors[0] == (2 if (path > 0.0).all() or (path < 0.0).all() else 1)


def test_no_cycle_of_the_throw_is_told_as_chaos():
    """Where jogs shrink (a surface above the joint) a throw may contract: orbits that close are no bands."""
    scene = ls.load("paper-designed")
    rng = np.random.default_rng(11)
    speed, height = np.radians(rng.uniform(120.0, 180.0, 30)), rng.uniform(-0.4, 0.2, 30)
    stack = throw_stack(scene, {"throw.speed": speed, "arm.surface_height": height})
    t = topologies(stack.params, stack.lo, stack.hi, stack.anchor)
    for k in np.flatnonzero((t.undecided == 0) & (t.attractors > 0)):
        side = np.repeat(np.arange(stack.lo.shape[1]), 4)
        share = np.tile([0.37, 0.55, 0.71, 0.93], side.size // 4)
        x = stack.lo[k][side] + (stack.hi[k] - stack.lo[k])[side] * share
        params = point_of(stack.params, int(k))
        x, side, code, _ = advance(params, x, side, 4000)
        first, on = x[code >= 0], side[code >= 0]
        y, to, closed = first, on, np.zeros(first.size, bool)
        for _ in range(LONGEST):
            y, to, _, _ = advance(params, y, to, 1)
            closed |= (to == on) & (np.abs(y - first) <= 1e-9)
        closed &= first - params.a[on] > 0.1  # what creeps to the joint hardly moves
        assert closed.any() <= (t.period[k] > 0).any()
