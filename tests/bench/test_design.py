"""Design for critical points: exact derivatives against finite differences and a search without any, by scipy.

Answers are asserted: the known scene (along, above, kappa) to its printed digits.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize, root

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from tests.bench.measure import limit, take_turns, versus

pytestmark = pytest.mark.bench

VARY = ("part.mass.center.along", "part.mass.center.above", "throw.kappa")
WANTED = np.array([10.0, 10.0, 20.0])
KNOWN = (4.2255778, 0.7082490, 25.3778518)
ROUNDS = 5


class Points:
    """Critical points of the scene with other values, by the public call, and how often they were asked for."""

    def __init__(self):
        self.scene, self.count = ls.load("paper-initial"), 0
        self.start = np.array(
            [self.scene.value(VARY[0]), self.scene.value(VARY[1]), np.log(self.scene.kappa)]
        )

    def __call__(self, at):
        self.count += 1
        try:
            scene = self.scene.with_values(
                dict(zip(VARY, (float(at[0]), float(at[1]), float(np.exp(at[2]))), strict=True))
            )
        except LimitsetsError:
            return np.full(3, 100.0)
        points = ls.critical_points(scene.map, scene.domain)
        return np.array([points[side][0].x if points[side] else 100.0 for side in range(3)]) - WANTED

    def values(self, at):
        return [*at[:2], np.exp(at[2])]


def hybrid():
    points = Points()
    found = root(points, points.start, method="hybr", tol=1e-12)
    return points.values(found.x), points.count


def simplex():
    points = Points()
    found = minimize(
        lambda at: float((points(at) ** 2).sum()),
        points.start,
        method="Nelder-Mead",
        options={"xatol": 1e-8, "fatol": 1e-14, "maxfev": 1000},
    )
    return points.values(found.x), points.count


def test_design(benchmark, table):
    rivals = {"scipy hybr, finite differences": hybrid, "scipy Nelder-Mead": simplex}
    turns = take_turns(
        benchmark,
        lambda: ls.design("paper-initial", critical_points=WANTED.tolist(), vary=VARY),
        rivals,
        ROUNDS,
    )
    ours = turns.answer
    assert ours.reached
    assert [value for _, value, _ in ours.quantities().values()] == pytest.approx(KNOWN, abs=1e-5)
    for name in rivals:
        assert turns.answers[name][0] == pytest.approx(KNOWN, abs=1e-5)
    table += [versus("design of (10, 10, 20) from paper-initial", turns, name, unit="ms") for name in rivals]
    table.append(limit("the same: computations of the critical points", ours.evaluations, "", None))
    table += [limit(f"{name}: computations", turns.answers[name][1], "", None) for name in rivals]
