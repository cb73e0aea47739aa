"""Cycles: each orbit closes, once, on the branch that the map takes."""

import math
import re
from collections import Counter
from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.base.errors import AnswerError
from limitsets.parameters.atlas import Axis
from limitsets.systems.cells import CellSet, as_domain
from limitsets.systems.sets import cycles_from, cycles_of
from tests.test_paper import LIMIT_SETS

# ----------------------------------------------------------------
# Periodic orbits: counts and multipliers known on paper, and the same orbits found in another way.


UNIT = as_domain([(0.0, 1.0)])
ALL = {0: [(0.0, 1.0)]}
DESIGNED = LIMIT_SETS["paper-designed"]


def returning(found, p):
    """Number of points with F^p(x) = x."""
    return sum(cycle.period for cycle in found if p % cycle.period == 0)


def test_doubling_has_2_to_the_p_minus_1_points_on_the_circle():
    found = cycles_of(maps.Doubling(2.0), ALL, UNIT, 10)
    assert found.complete
    for p in range(1, 11):
        assert returning(found, p) - 1 == 2**p - 1  # 0 and 1 are one point of the circle
    for cycle in found:
        assert cycle.multiplier == 2.0**cycle.period
        assert cycle.residual <= cycle.rounding < 1e-13
        # Points of period p are multiples of 1 / (2^p - 1).
        multiples = cycle.x * (2.0**cycle.period - 1.0)
        assert np.abs(multiples - np.round(multiples)).max() < 1e-12


def test_the_full_logistic_map_has_2_to_the_p_points():
    found = cycles_of(maps.Logistic(4.0), ALL, UNIT, 9)
    assert [returning(found, p) for p in range(1, 10)] == [2**p for p in range(1, 10)]
    inner = [cycle for cycle in found if cycle.x[0] > 1e-9]
    assert [abs(c.multiplier) for c in inner] == pytest.approx([2.0**c.period for c in inner], rel=1e-9)


def test_logistic_period_three_comes_in_a_pair():
    found = [c for c in cycles_of(maps.Logistic(3.83), ALL, UNIT, 3) if c.period == 3]
    assert [abs(c.multiplier) < 1 for c in found] == [True, False]
    assert max(c.residual for c in found) < 2e-15
    # It is born at r = 1 + sqrt(8): below there is none.
    below = cycles_of(maps.Logistic(1.0 + math.sqrt(8.0) - 1e-6), ALL, UNIT, 3)
    assert [c.period for c in below] == [1, 1, 2]
    above = cycles_of(maps.Logistic(1.0 + math.sqrt(8.0) + 1e-6), ALL, UNIT, 3)
    assert [c.period for c in above] == [1, 1, 2, 3, 3]


def test_cubic_map():
    found = cycles_of(maps.Cubic(1.5), {0: [(-1.2, 1.2)]}, as_domain([(-1.2, 1.2)]), 5)
    assert [float(c.x[0]) for c in found] == pytest.approx([-math.sqrt(0.5), 0.0, math.sqrt(0.5)], abs=1e-15)
    assert [c.multiplier for c in found] == pytest.approx([0.0, 1.5, 0.0], abs=1e-12)


def by_recurrence(scene, longest):
    """Orbits that a long orbit nearly closes, each corrected by Newton's method with finite differences."""
    path = ls.orbit(scene.map, 15.0, 2, 300_000)
    found = set()
    for p in range(1, longest + 1):
        same = (path.side[p:] == path.side[:-p]) & (path.side[:-p] == 0)
        close = (np.abs(path.x[p:] - path.x[:-p]) < 0.1) & same
        for k in np.flatnonzero(close)[::150]:
            word, x = path.code[k : k + p], path.x[k]

            def follow(start, word=word):
                side, states = 0, [start]
                for branch in word:
                    after, to = maps.images_on(scene.map, states[-1:], side, int(branch))
                    states.append(float(after[0]))
                    side = int(to[0])
                return states

            for _ in range(8):
                slope = (follow(x + 1e-6)[-1] - follow(x - 1e-6)[-1]) / 2e-6
                x -= (follow(x)[-1] - x) / (slope - 1.0)
            states = follow(x)
            codes = ls.orbit(scene.map, x, 0, p).code
            if abs(states[-1] - x) < 1e-9 and (codes == word).all():
                found.add((p, round(float(min(states)), 6)))
    return found


def test_designed_scene_has_the_near_returns_of_a_long_orbit_all_repel_and_one_stays_below_20_103():
    scene = ls.load("paper-designed")
    found = cycles_of(scene.map, DESIGNED, scene.domain, 13)
    assert found.complete
    returns = by_recurrence(scene, 13)
    assert returns <= {(c.period, round(float(c.x.min()), 6)) for c in found}
    assert len(returns) >= 5
    assert all(c.residual <= c.rounding and c.multiplier > 1.033**c.period for c in found)
    assert max(c.residual for c in found) < 1e-14
    low = min(found, key=lambda c: c.x.max())
    assert low.period == 13
    assert 20.1 < low.x.max() < 20.103
    for cycle in found:
        ends = np.array([DESIGNED[int(side)][0] for side in cycle.side])
        assert ((cycle.x >= ends[:, 0]) & (cycle.x <= ends[:, 1])).all()
        again = ls.orbit(scene.map, float(cycle.x[0]), int(cycle.side[0]), cycle.period)
        assert again.code.tolist() == cycle.branches.tolist()
        assert again.x[-1] == pytest.approx(cycle.x[0], abs=1e-9)


def test_too_many_words_is_a_value():
    found = cycles_of(maps.Doubling(2.0), ALL, UNIT, 30, most_words=100)
    assert not found.complete
    assert "raise most_words" in found.how
    assert max(c.period for c in found) < 30


# ---------------------------------------------------------------- Henon

# Biham and Wenzel, "Characterization of unstable periodic orbits in chaotic attractors and repellers" (1989): orbits
# of each period at a = 1.4, b = 0.3, and the fixed point off the attractor.
HENON = {1: 2, 2: 1, 4: 1, 6: 2, 7: 4, 8: 7, 9: 6, 10: 10}


def test_henon_orbits_by_period():
    starts = ls.orbit(maps.Henon(), (0.1, 0.1), 0, 3000).x[100:]
    found = cycles_from(maps.Henon(), np.vstack([starts, [(-1.2, -0.4)]]), 0, 10)
    assert Counter(c.period for c in found) == HENON
    assert not found.complete
    for cycle in found:
        x, y = cycle.x.T
        assert np.abs(np.roll(x, -1) - (1.0 - 1.4 * x * x + y)).max() < 1e-12
        assert np.abs(np.roll(y, -1) - 0.3 * x).max() < 1e-12
        jacobian = np.eye(2)
        for u in x:
            jacobian = np.array([[-2.8 * u, 1.0], [0.3, 0.0]]) @ jacobian
        assert cycle.multiplier == pytest.approx(np.abs(np.linalg.eigvals(jacobian)).max(), rel=1e-6)


# ---------------------------------------------------------------- on a graph


def test_cycles_of_a_graph_in_one_and_two_dimensions():
    graph = ls.transitions(maps.Logistic(3.2), ls.grid([(0.0, 1.0)], cells=1024))
    assert [c.period for c in ls.cycles(graph, 4)] == [1, 1, 2]
    (attractor,) = ls.attractors(graph)
    assert [c.period for c in ls.cycles(graph, 4, within=attractor)] == [2]
    plane = ls.transitions(maps.Henon(), ls.grid([(-2.0, 2.0), (-2.0, 2.0)], cells=128))
    found = ls.cycles(plane, 7)
    assert Counter(c.period for c in found) == {p: n for p, n in HENON.items() if p <= 7}
    off = plane.grid.index([[-1.131354, -0.339406]], 0)  # the fixed point that is not on the attractor
    within = plane.recurrent_set() - CellSet.of(plane.grid, off)
    assert Counter(c.period for c in ls.cycles(plane, 4, within=within)) == {1: 1, 2: 1, 4: 1}


def in_space(x, y, z):
    return 1.4 - x**2 - 0.1 * z, x, y


def test_cycles_in_space_are_those_that_certify_lists():
    graph = ls.transitions(ls.map(in_space), ls.grid([(-1.65, 1.65)] * 3, cells=4))
    with pytest.raises(AnswerError, match=r"of 3 coordinates'; allowed: one or two; limitsets\.certify"):
        ls.cycles(graph, 1)


def test_wrong_questions():
    graph = ls.transitions(maps.Logistic(3.2), ls.grid([(0.0, 1.0)], cells=64))
    with pytest.raises(AnswerError, match="largest period"):
        ls.cycles(graph, 0)
    with pytest.raises(AnswerError, match="set to look in"):
        ls.cycles(graph, 2, within="everything")
    with pytest.raises(AnswerError, match="the plane"):
        cycles_from(maps.Logistic(3.2), [[0.1, 0.1]], 0, 1)


# ----------------------------------------------------------------
# Cycles close under `image`, and each comes once: against counts on paper and by another way.


def waves(x, omega, k, m, n=1.0):
    """A circle map of two harmonics that goes round n times, with `floor` in place of branches."""
    first, second = math.sin(math.tau * x), math.sin(2.0 * math.tau * x)
    y = n * x + omega - k / math.tau * first - m / (2.0 * math.tau) * second
    return y - math.floor(y)


def times(n):
    """n x mod 1."""
    return ls.map(waves, omega=0.0, k=0.0, m=0.0, n=n)


def kicked(x, y, k):
    """The standard map on the torus."""
    v = y + k / math.tau * math.sin(math.tau * x)
    u = x + v
    return u - math.floor(u), v - math.floor(v)


def cat(x, y, a):
    u, v = a * x + y, x + y
    return u - math.floor(u), v - math.floor(v)


def cancels(x, r):
    """The logistic map by a formula that loses six digits."""
    return (r * x * (1.0 - x) + 1e6) - 1e6


class Open(NamedTuple):
    """x / 2 + 1/4 below 1/2, where the limit is a fixed point and the map is not; x / 2 above."""

    half: float


def opened(p, x, side):
    branch = 0 if x < 0.5 else 1
    after, to = opened_on(p, x, side, branch)
    return after, to, branch


def opened_on(p, x, side, branch):
    return (p.half * x + 0.25 if branch == 0 else p.half * x), side


ls.register(Open, image=opened, image_on=opened_on, branches=("below", "above"))


def require_closed(params, found):
    """Hold every cycle against the map itself."""
    for cycle in found:
        points = cycle.x if cycle.x.ndim > 1 else cycle.x[:, None]
        miss = []
        after = np.roll(points, -1, axis=0), np.roll(cycle.side, -1)
        for x, side, branch, to, to_side in zip(cycle.x, cycle.side, cycle.branches, *after, strict=True):
            one = maps.images(params, np.array([x]), int(side))
            assert (one.code[0], one.side[0]) == (branch, to_side)
            miss.append(np.abs(one.x[0] - to).max())
        assert max(miss) == cycle.residual <= cycle.rounding
        assert len(np.unique(np.column_stack([points, cycle.side]), axis=0)) == cycle.period
    points = [np.round(c.x.reshape(c.period, -1), 7) + 0.0 for c in found]
    rounded = {
        tuple(sorted((*x, s) for x, s in zip(p.tolist(), c.side.tolist(), strict=True)))
        for p, c in zip(points, found, strict=True)
    }
    assert len(rounded) == len(found)


def lifted(p, n, up_to):
    """Count the cycles of each period of a circle map: changes of sign of F^p(x) - x - q, of its lift, on a grid."""
    x = (np.arange(n) + 0.5) / n
    count, y = {}, x.copy()
    for period in range(1, up_to + 1):
        turned = p.k * np.sin(math.tau * y) + 0.5 * p.m * np.sin(2 * math.tau * y)
        y = y + p.omega - turned / math.tau
        for q in range(math.floor((y - x).min()), math.ceil((y - x).max()) + 1):
            sign = np.sign(y - x - q)
            points = int((sign != np.roll(sign, -1)).sum())
            shorter = sum(d * n for (d, of), n in count.items() if period % d == 0 and of * period == q * d)
            if points > shorter:
                count[period, q] = (points - shorter) // period
    found = Counter()
    for (period, _), number in count.items():
        found[period] += number
    return found


@pytest.mark.parametrize(("omega", "coupling"), [(0.61, 0.9), (0.5, 0.9), (0.4, 0.99)])
def test_an_own_circle_map_has_the_cycles_of_its_lift(omega, coupling):
    params = ls.map(waves, omega=omega, k=coupling, m=0.0)
    found = cycles_of(params, ALL, UNIT, 6)
    require_closed(params, found)
    assert Counter(c.period for c in found) == lifted(params, 200_001, 6)
    same = maps.Circle(omega, coupling)
    other = cycles_of(same, ALL, UNIT, 6)
    require_closed(same, other)
    assert [c.multiplier for c in other] == pytest.approx([c.multiplier for c in found], abs=1e-9)


def test_the_circle_map_at_one_half():
    # 0 and 1/2 are one orbit, of slope (1 - K) (1 + K); the other one goes from x to 1 - x
    first, second = cycles_of(maps.Circle(0.5, 0.9), ALL, UNIT, 4)
    assert first.x.tolist() == [0.0, 0.5]
    assert first.multiplier == pytest.approx((1.0 - 0.9) * (1.0 + 0.9), abs=1e-12)
    assert second.x.sum() == pytest.approx(1.0, abs=1e-14)


def test_a_limit_that_is_no_orbit_is_no_cycle():
    assert [c.x.tolist() for c in cycles_of(Open(0.5), ALL, UNIT, 3) if c.period == 1] == []


def test_a_formula_that_cancels_loses_no_cycle():
    params = ls.map(cancels, r=3.9)
    plain, rough = (cycles_of(each, ALL, UNIT, 6) for each in (maps.Logistic(3.9), params))
    require_closed(params, rough)
    assert Counter(c.period for c in rough) == Counter(c.period for c in plain)
    assert max(c.rounding for c in plain) < 1e-12 < max(c.rounding for c in rough) < 1e-8


def test_near_a_doubling_a_cycle_of_twice_the_period_is_there_or_not():
    # the cycle of period 2 is born at r = 3; its points are sqrt(r - 3) apart, in units of about 1
    for r, periods in ((3.0 - 1e-9, [1, 1]), (3.0, [1, 1]), (3.0 + 1e-6, [1, 1, 2])):
        found = cycles_of(maps.Logistic(r), ALL, UNIT, 4)
        assert [c.period for c in found] == periods
        require_closed(maps.Logistic(r), found)


def test_the_standard_map_has_two_cycles_of_period_two():
    params = ls.map(kicked, k=1.2)
    found = ls.cycles(ls.transitions(params, ls.grid([(0.0, 1.0)] * 2, cells=64)), 3)
    require_closed(params, found)
    two = [c for c in found if c.period == 2]
    # (0, 1/2), (1/2, 1/2): the trace of (1 + K, 1; K, 1) (1 - K, 1; -K, 1) is 2 - K^2
    assert two[0].multiplier == pytest.approx(1.0, abs=1e-9)
    # the other has v = 2 x at x and 1 - x, with 4 x = 1 - K sin(2 pi x) / (2 pi) up to a turn
    assert len(two) == 2
    x = two[1].x[0, 0]
    assert two[1].x[1, 0] == pytest.approx(1.0 - x, abs=1e-12)
    assert two[1].x[0, 1] == pytest.approx((2.0 * x) % 1.0, abs=1e-12)


def test_the_cat_map_has_all_its_points_up_to_period_seven():
    # trace of A^n - 2 points return after n steps
    graph = ls.transitions(ls.map(cat, a=2.0), ls.grid([(0, 1)] * 2, cells=64, periodic=True))
    per = Counter(cycle.period for cycle in ls.cycles(graph, 7))
    for n in range(1, 8):
        trace = round(np.trace(np.linalg.matrix_power(np.array([[2, 1], [1, 1]]), n)))
        assert sum(d * per[d] for d in range(1, n + 1) if n % d == 0) == trace - 2


def test_cycles_outside_the_domain_are_not_among_its_cycles():
    # fixed points of x - x (x - 1) (x - 4) / 4 are 0, 1, 4; Newton's method reaches all
    def step(x, y):
        return x - x * (x - 1.0) * (x - 4.0) / 4.0, 0.5 * y

    graph = ls.transitions(ls.map(step), ls.grid([(-0.5, 3.0), (-1.0, 1.0)], cells=32))
    assert sorted(float(cycle.x[0, 0].round(9)) for cycle in ls.cycles(graph, 1)) == [0.0, 1.0]


def test_the_cat_map_has_its_points():
    # |trace of A^p - 2| points: 1, 5, 16
    random, params = np.random.default_rng(3), ls.map(cat, a=2.0)
    found = cycles_from(params, random.random((4000, 2)), 0, 3)
    require_closed(params, found)
    assert Counter(c.period for c in found) == {1: 1, 2: 2, 3: 5}  # those of periods 1 and 3 lie on the seams


# ----------------------------------------------------------------
# Maps that jump inside one branch (a floor in `image`, nothing else registered): cycles, attractors, ends.
# Known on paper: m x mod 1 returns after p steps at the m^p - 1 points j / (m^p - 1); and a circle map with x + 1/2
# at 0 and at 1/2 has the cycle {0, 1/2}, of multiplier (1 - k - m) (1 + k - m).


def graph_of(params, cells=256):
    return ls.transitions(params, ls.grid([(0.0, 1.0)], cells=cells))


@pytest.mark.parametrize("m", [2.0, 3.0, 5.0])
def test_m_x_mod_1_returns_at_every_multiple(m):
    params = times(m)
    found = ls.cycles(graph_of(params), 9 if m == 2.0 else 4)
    assert found.complete
    require_closed(params, found)
    for p in range(1, 10 if m == 2.0 else 5):
        points = np.sort(np.concatenate([c.x for c in found if p % c.period == 0]))
        assert points == pytest.approx(np.arange(m**p - 1) / (m**p - 1), abs=1e-12)


def test_a_folded_circle_has_every_cycle_that_its_lift_crosses():
    """A point of period p crosses the diagonal of the lift, moved by a whole number: crossings are counted."""
    params = ls.map(waves, omega=0.3, k=4.0, m=0.3)
    found = ls.cycles(graph_of(params), 5)
    start = np.linspace(0.0, 1.0, 400_001) + 1.2345e-7
    y = start
    for p in range(1, 6):
        y = y + 0.3 - 2.0 / np.pi * np.sin(2.0 * np.pi * y) - 0.075 / np.pi * np.sin(4.0 * np.pi * y)
        turns = np.abs(np.diff(np.floor(y - start))).sum()
        assert sum(c.period for c in found if p % c.period == 0) == turns


def test_a_cycle_on_the_cut_is_all_that_attracts():
    params = ls.map(waves, omega=0.5, k=0.7, m=0.2)
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
    params, cells = ls.map(waves, omega=0.34, k=0.95, m=0.0), 1024
    graph = ls.transitions(params, ls.grid([(0.0, 1.0)], cells=cells), "boxes")
    ends = np.linspace(0.0, 1.0, cells + 1)
    after = ends + 0.34 - 0.95 / (2.0 * np.pi) * np.sin(2.0 * np.pi * ends)
    first, last = np.floor(after[:-1] * cells).astype(int), np.floor(after[1:] * cells).astype(int)
    leads = (first < cells) & (last >= cells)
    for _ in range(cells):
        meets = [leads[np.arange(a, b + 1) % cells].any() for a, b in zip(first, last, strict=True)]
        before, leads = leads, leads | np.array(meets)
        if (leads == before).all():
            break
    found = ls.basins(graph, ls.attractors(graph))
    assert found.undecided_between > 0.1
    advice = r"from (.*) % of the starts .*, from (.*) % a cell whose enclosed image is a whole"
    words = re.search(advice, found.advice)
    assert float(words[2]) / 100.0 == pytest.approx(leads.mean(), abs=0.003)
    assert "one branch before the jump" in found.advice
    sampled = graph_of(params, cells)
    assert "enclosed image" not in ls.basins(sampled, ls.attractors(sampled)).advice


@pytest.mark.sweep
def test_the_atlas_decides_circle_maps_with_a_floor():
    """Denjoy: with an irrational rotation number the whole circle is the attractor, and its exponent is 0.

    Below omega = k / (2 pi) the map is locked to a fixed point; the rotation by 1/4 has a cycle through each point.
    """
    axis = Axis("omega", [0.05, 0.30001, (math.sqrt(5.0) - 1.0) / 2.0])
    wanted = ["lyapunov", "lyapunov_error", "bands", "lowest", "reach", "period", "undecided"]
    half = ls.map(waves, omega=0.5, k=0.5, m=0.0)
    found = ls.atlas(half, axis, domain=[(0.0, 1.0)], variables=wanted).dataset
    assert found.undecided.values.tolist() == [0, 0, 0]
    assert found.period.values[:, 0].tolist() == [1, 0, 0]
    locked = math.asin(2.0 * math.pi * 0.05 / 0.5) / math.tau
    assert found.lowest.values[0, 0, 0] == pytest.approx(locked, abs=1e-6)
    for point in (1, 2):
        assert found.bands.values[point, 0, 0] == 1
        ends = found.lowest.values[point, 0, 0], found.reach.values[point, 0, 0]
        assert ends == pytest.approx((0.0, 1.0), abs=1e-9)
        assert abs(found.lyapunov.values[point, 0]) < 1e-3
    quarter = ls.atlas(half.with_values(k=0.0), "omega=0.25:0.25:1", domain=[(0.0, 1.0)]).dataset
    assert quarter.undecided.attrs["flag_meanings"].split()[int(quarter.undecided.values[0])] == "not_one"


@pytest.mark.sweep
def test_the_atlas_finds_the_bands_of_a_falling_map_with_a_floor():
    """x -> -5 x / 2 mod 1 expands, and its images of any interval fill [0, 1]."""
    found = ls.atlas(times(-2.5), "n=-2.5:-2.25:2", domain=[(0.0, 1.0)]).dataset
    assert found.undecided.values.tolist() == [0, 0]
    assert found.bands.values[:, 0, 0].tolist() == [1, 1]
    assert found.lowest.values[:, 0, 0] == pytest.approx(0.0, abs=1e-9)
    assert found.reach.values[:, 0, 0] == pytest.approx(1.0, abs=1e-9)
