"""Numbers of the paper's four scenes that two other programs agree on."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mpmath import mpf

from limitsets import maps
from limitsets.feeder.thrower import Throw, fly, throw_map, trace
from limitsets.systems.maps import drivers
from tests.thrower import reference
from tests.thrower.reference import PAPER


def scene(name: str, **changes: object) -> Throw:
    return throw_map(**reference.paper(name, **changes).numbers)


SIDES = {
    "initial-small": ([2.05089, 3.36103, 3.24447], [0.21620, 2.04836, 1.78985]),
    "designed-small": ([1.74394, 1.65101, 4.41796], [1.92973, 1.72239, 0.50403]),
    "initial": ([1.37302, 3.05205, 3.98670], [0.53272, 1.36702, 1.88360]),
    "designed": ([1.79776, 1.92575, 4.22558], [1.65438, 1.77927, 0.70825]),
}
LIMIT_SETS: dict[str, list[list[tuple[float, float]]]] = {
    "initial-small": [
        [(13.449486219312, 20.421069168761)],
        [(18.13120694042, 20.390334647524)],
        [(13.523779592226, 20.393068935673)],
    ],
    "designed-small": [
        [(12.216914068142, 12.88421238353)],
        [(8.9547723861184, 10.343418249967)],
        [(6.3603646024764, 20.640934683962)],
    ],
    "initial": [
        [(13.522673689975, 20.915912223359)],
        [(18.994941734574, 19.975954977782), (20.434045200511, 21.554457325114)],
        [(16.262705754072, 21.886351326378)],
    ],
    "designed": [
        [(15.205338825681, 19.75268801485)],
        [(12.637023572659, 17.439819281769)],
        [(8.9140259080455, 23.383151921158)],
    ],
}


@pytest.mark.parametrize("name", PAPER)
def test_resting_sides(name: str) -> None:
    params = scene(name)
    assert params.a == pytest.approx(SIDES[name][0], abs=6e-6)
    assert params.d == pytest.approx(SIDES[name][1], abs=6e-6)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("initial-small", [8.111560, 8.225738, 8.342593]),
        ("designed", [8.262013, 8.557124, 8.891802]),
    ],
)
def test_first_throws(name: str, expected: list[float]) -> None:
    found = trace(scene(name), 8.0, 2, 3)
    assert found.x[1:] == pytest.approx(expected, abs=6e-7)
    assert (found.code == maps.JOG).all()
    if name == "designed":
        assert found.phi[0] == pytest.approx(0.311437, abs=6e-7)


@pytest.mark.parametrize("name", PAPER)
def test_the_decision_changes_at_the_first_critical_points(name: str) -> None:
    params = scene(name)
    for side, r in enumerate(PAPER[name][-1]):
        start = params.a[side] + 1e-6 * (r - params.a[side])
        before = maps.images(params, np.linspace(start, r - 1e-5, 4001), side)
        assert set(before.code.tolist()) <= {maps.JOG, maps.INWARD}
        assert (before.side == side).all()
        assert maps.images(params, [r + 1e-5], side).side[0] == (side + 1) % 3


def test_the_energy_of_an_exact_flight_can_change_its_mind_three_times() -> None:
    # Published to two decimals, the parameters as well.
    facts = reference.paper("initial", kappa=33.06, surface_height=-0.5, flip="energy")
    facts.numbers["a"][0], facts.numbers["d"][0] = 1.373, 0.533
    x = np.linspace(5.0, 25.0, 200_001)
    flips = maps.images(throw_map(**facts.numbers), x, 0).side != 0
    changes = x[1:][flips[1:] != flips[:-1]]
    assert changes == pytest.approx([14.17, 18.24, 20.00], abs=0.05)


@pytest.mark.parametrize(("h", "expected"), [(0.1, [3.16, 3.19, 4.81]), (0.2, [4.64, 4.55, 5.39])])
def test_a_raised_surface_draws_close_starts_inward(h: float, expected: list[float]) -> None:
    params = scene("designed", surface_height=h)
    for side, x in enumerate(expected):  # rounded down: every start below collapses
        assert drivers._displacement(params, x - 0.001, side) < 0.0
        assert drivers._displacement(params, x + 0.011, side) > 0.0


def test_how_many_throws_it_takes_to_leave_the_joint() -> None:
    # Close to a the reach grows by q = 1 + 2 |h| / (kappa - d) a throw: 413 throws for three decades.
    params = scene("designed")
    counts = [
        int(np.flatnonzero(maps.orbit(params, params.a[0] + reach, 0, 2000).x >= params.a[0] + 1.0)[0])
        for reach in (1e-1, 1e-3, 1e-6, 1e-9)
    ]
    q = 1.0 + 0.4 / (params.kappa - params.d[0])
    assert [counts[2] - counts[1], counts[3] - counts[2]] == [round(3.0 * math.log(10.0) / math.log(q))] * 2
    facts, x = reference.paper("designed"), mpf(params.a[0] + 1e-1)
    throws = 0
    while x < params.a[0] + 1.0:
        throw = reference.throw(facts, 0, x)
        assert throw is not None
        x, throws = throw.x, throws + 1
    assert counts[0] == throws


@pytest.mark.parametrize(
    ("name", "side", "edge"), [("designed", 0, 20.1517), ("designed", 1, 26.4235), ("initial", 0, 26.9141)]
)
def test_where_another_vertex_lands_first(name: str, side: int, edge: float) -> None:
    params = scene(name)
    assert not trace(params, edge - 1e-4, side).other_vertex_first[0]
    assert trace(params, edge + 1e-4, side).other_vertex_first[0]
    assert not trace(scene("designed"), 27.9999, 2).other_vertex_first[0]


@pytest.mark.parametrize("name", PAPER)
def test_a_long_orbit_stays_in_the_limit_set_and_fills_it(name: str) -> None:
    path = maps.orbit(scene(name), PAPER[name][-1][2] - 1.0, 2, 400_000)
    assert path.stopped is None
    for side, parts in enumerate(LIMIT_SETS[name]):
        x = np.sort(path.x[2000:][path.side[2000:] == side])
        inside = np.sum([(x >= lo - 1e-9) & (x <= hi + 1e-9) for lo, hi in parts], axis=0)
        assert (inside == 1).all()
        for lo, hi in parts:
            some = x[(x >= lo - 1e-9) & (x <= hi + 1e-9)]
            assert (some[0], some[-1]) == pytest.approx((lo, hi), abs=2e-3)
    assert set(((path.side[1:] - path.side[:-1]) % 3).tolist()) == {0, 1}


@pytest.mark.parametrize(
    ("name", "expected", "within"),
    [
        ("initial-small", math.log1p(2.0 / 85.2549144), 1e-12),
        ("designed-small", math.log1p(2.0 / 48.6228609), 1e-12),
        ("initial", 0.099, 6e-4),
        ("designed", 0.206, 6e-4),
    ],
)
def test_lyapunov_exponent_per_throw(name: str, expected: float, within: float) -> None:
    found = maps.lyapunov(scene(name), 15.0, 2, 400_000)
    assert found.exponent == pytest.approx(expected, abs=within)
    assert (found.steps, found.stopped) == (400_000, None)


@pytest.mark.parametrize(("name", "expected"), [("initial", 0.1998), ("designed", 0.3191)])
def test_flips_per_throw(name: str, expected: float) -> None:
    path = maps.orbit(scene(name), 15.0, 2, 400_000)
    assert (path.code[2000:] == maps.FLIP).mean() == pytest.approx(expected, abs=5e-4)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("initial-small", [-5.37, -2.40, -2.67]),
        ("designed-small", [-0.96, -1.14, -2.25]),
        ("initial", [0.183, 0.175, 0.193]),
        ("designed", [0.359, 0.364, 0.079]),
    ],
)
def test_the_rate_after_the_impact_at_the_critical_points(name: str, expected: list[float]) -> None:
    params = scene(name)
    for side, omega in enumerate(expected):
        assert fly(params, PAPER[name][-1][side], side).omega == pytest.approx(omega, abs=0.0051)
