"""Periodic orbits: counts and multipliers known on paper, and the same orbits found in another way."""

import math
from collections import Counter

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.base.errors import AnswerError
from limitsets.systems.cells import CellSet, as_domain
from limitsets.systems.sets import cycles_from, cycles_of
from tests.test_paper import LIMIT_SETS

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


@pytest.mark.parametrize("r", [3.05, 3.2, 3.4])
def test_logistic_period_two(r):
    found = cycles_of(maps.Logistic(r), ALL, UNIT, 6)
    assert [c.period for c in found] == [1, 1, 2]
    assert [c.multiplier for c in found] == pytest.approx([r, 2.0 - r, 4.0 + 2.0 * r - r * r], abs=1e-12)


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
        close = (
            (np.abs(path.x[p:] - path.x[:-p]) < 0.1)
            & (path.side[p:] == path.side[:-p])
            & (path.side[:-p] == 0)
        )
        for k in np.flatnonzero(close)[::50]:
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


def test_designed_scene_against_near_returns_of_a_long_orbit():
    scene = ls.load("paper-designed")
    found = cycles_of(scene.map, DESIGNED, scene.domain, 13)
    assert found.complete
    assert by_recurrence(scene, 13) <= {(c.period, round(float(c.x.min()), 6)) for c in found}
    assert len(by_recurrence(scene, 13)) >= 5


def test_designed_scene_every_orbit_repels_and_one_stays_below_20_103():
    scene = ls.load("paper-designed")
    found = cycles_of(scene.map, DESIGNED, scene.domain, 13)
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


def test_each_orbit_comes_once_and_with_its_smallest_period():
    found = cycles_of(maps.Logistic(3.9), ALL, UNIT, 8)
    points = np.sort(np.concatenate([c.x for c in found]))
    assert np.diff(points).min() > 1e-7


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
        assert np.abs(np.roll(x, -1) - (1.0 - 1.4 * x * x + y)).max() < 1e-9
        jacobian = np.eye(2)
        for u in x:
            jacobian = np.array([[-2.8 * u, 1.0], [0.3, 0.0]]) @ jacobian
        assert cycle.multiplier == pytest.approx(np.abs(np.linalg.eigvals(jacobian)).max(), rel=1e-6)


def test_henon_fixed_points_and_period_two_on_paper():
    a, b = 1.4, 0.3
    found = cycles_from(maps.Henon(a, b), ls.orbit(maps.Henon(a, b), (0.1, 0.1), 0, 500).x, 0, 2)
    fixed = sorted((b - 1.0 + sign * math.sqrt((1.0 - b) ** 2 + 4.0 * a)) / (2.0 * a) for sign in (1, -1))
    assert [float(c.x[0, 0]) for c in found if c.period == 1] == pytest.approx(fixed, abs=1e-12)
    # Both points of period 2 solve a^2 x^2 - a (1 - b) x + (1 - b)^2 - a = 0.
    (two,) = [c for c in found if c.period == 2]
    assert sorted(two.x[:, 0]) == pytest.approx(
        sorted(np.roots([a * a, -a * (1.0 - b), (1.0 - b) ** 2 - a]).tolist()), abs=1e-12
    )


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


def test_wrong_questions():
    graph = ls.transitions(maps.Logistic(3.2), ls.grid([(0.0, 1.0)], cells=64))
    with pytest.raises(AnswerError, match="largest period"):
        ls.cycles(graph, 0)
    with pytest.raises(AnswerError, match="set to look in"):
        ls.cycles(graph, 2, within="everything")
    with pytest.raises(AnswerError, match="the plane"):
        cycles_from(maps.Logistic(3.2), [[0.1, 0.1]], 0, 1)
