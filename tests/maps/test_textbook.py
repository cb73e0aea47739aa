"""The textbook maps: a table of maps and points, times the properties every map has; then each map's answers."""

from __future__ import annotations

import math
import re
from typing import Any

import mpmath
import numpy as np
import pytest

from limitsets import maps
from limitsets.base.errors import LimitsetsError
from limitsets.numbers.jit import kernel
from limitsets.systems.maps import kernels
from limitsets.systems.maps.textbook.shared import DOMAINS as PUBLIC, exponential
from tests.maps_of_tests import DOMAINS, Baker, Contraction, Linear2, Product, ThreeState, TwoState

LOCKED = math.asin(-0.2 * math.pi / 0.7) / (2 * math.pi)
DIAGONAL = [(0.0, 0.0), (1.0, 1.0)]
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
HENON_X = (-0.7 + math.sqrt(0.49 + 5.6)) / 2.8
LESLIE_X = math.log(19.6 + 0.7 * 23.68) / 0.17

# Map, its images as a formula on lists of numbers, branches met on its domain, fixed points.
TABLE: dict[str, tuple[Any, Any, int, list[Any]]] = {
    "contraction": (Contraction(0.5, 0.25), lambda x: [0.5 * x[0] + 0.25], 1, [0.5]),
    "saddle": (Linear2(), lambda x: [x[0] / 2, 2 * x[1]], 1, [(0.0, 0.0)]),
    "x, y/2": (Linear2(1.0, 0.0, 0.0, 0.5), lambda x: [x[0], x[1] / 2], 1, [(0.3, 0.0), (-1.0, 0.0)]),
    "shear": (Linear2(1.0, 0.5, -0.5, 1.0), lambda x: [x[0] + x[1] / 2, x[1] - x[0] / 2], 1, [(0.0, 0.0)]),
    "rotation": (maps.Rotation(), lambda x: [math.fmod(x[0] + GOLDEN, 1.0)], 2, []),
    "circle": (
        maps.Circle(0.9, 0.7),
        lambda x: [math.fmod(x[0] + 0.9 - 0.35 / math.pi * math.sin(2 * math.pi * x[0]), 1.0)],
        2,
        [LOCKED + 1, 0.5 - LOCKED],
    ),
    "doubling": (maps.Doubling(), lambda x: [math.fmod(2 * x[0], 1.0)], 2, [0.0, 1.0]),
    "beta": (maps.Doubling(1.7), lambda x: [math.fmod(1.7 * x[0], 1.0)], 2, [0.0]),
    "logistic": (maps.Logistic(3.2), lambda x: [3.2 * x[0] * (1 - x[0])], 2, [0.0, 1.0 - 1.0 / 3.2]),
    "cubic": (maps.Cubic(), lambda x: [1.5 * x[0] - x[0] ** 3], 3, [0.0, math.sqrt(0.5), -math.sqrt(0.5)]),
    "henon": (
        maps.Henon(),
        lambda x: [1 - 1.4 * x[0] ** 2 + x[1], 0.3 * x[0]],
        1,
        [(HENON_X, 0.3 * HENON_X)],
    ),
    "leslie": (
        maps.Leslie(),
        lambda x: [(19.6 * x[0] + 23.68 * x[1]) * math.exp(-0.1 * (x[0] + x[1])), 0.7 * x[0]],
        1,
        [(0.0, 0.0), (LESLIE_X, 0.7 * LESLIE_X)],
    ),
    "baker": (Baker(), lambda x: [math.fmod(2 * x[0], 1.0), (x[1] + math.floor(2 * x[0])) / 2], 2, DIAGONAL),
    "two states": (TwoState(), lambda x: [1.0, 1.0] if x[0] >= 0 else [-1.0, -1.0], 2, [(1, 1), (-1, -1)]),
    "one state": (TwoState(0.4), lambda x: [0.0, 0.0], 2, [(0.0, 0.0)]),
    "three states": (
        ThreeState(),
        lambda x: [-2 if x[0] < -1 else 0 if x[0] <= 1 else 2],
        3,
        [-2.0, 0.0, 2.0],
    ),
    "product": (Product(), lambda x: [v / (2 - v) for v in x], 1, [*DIAGONAL, (0.0, 1.0), (1.0, 0.0)]),
}
ONE_OF_EACH = pytest.mark.parametrize("name", TABLE)


def domain(params: Any) -> Any:
    return (PUBLIC | DOMAINS)[type(params)]


def points(params: Any, count: int = 400) -> np.ndarray:
    """Random states of the domain, shape (count, dimension); none within 1e-4 of a side."""
    rng = np.random.default_rng(11)
    return np.stack([rng.uniform(lo + 1e-4, hi - 1e-4, count) for lo, hi in domain(params)], axis=1)


def state(x: np.ndarray) -> Any:
    return float(x[0]) if x.size == 1 else tuple(float(v) for v in x)


@ONE_OF_EACH
def test_images_are_those_of_the_formula_of_the_branch_and_of_the_source(name: str) -> None:
    params, formula, branches, fixed = TABLE[name]
    xs = points(params)
    found = maps.images(params, xs, 0)
    expected = np.array([formula([float(v) for v in x]) for x in xs])
    assert found.x.reshape(expected.shape) == pytest.approx(expected, rel=1e-13, abs=1e-14)
    assert (found.side == 0).all()
    assert set(found.code.tolist()) == set(range(branches))
    assert len(maps.kind_of(params).branches) == branches
    assert found.second_pass == 0.0
    for branch in range(branches):
        here = found.code == branch
        after, side = maps.images_on(params, xs[here], 0, branch)
        assert after == pytest.approx(found.x[here], rel=1e-15, abs=4e-16)  # contraction differs
        assert (side == 0).all()
    image: Any = kernels.image
    source = image.methods[type(params)]
    for k, x in enumerate(xs[:30]):
        after, side, code = source(params, state(x), 0)
        assert np.ravel(after) == pytest.approx(np.ravel(found.x[k]), rel=1e-14, abs=1e-15)
        assert (side, code) == (found.side[k], found.code[k])
    for x in fixed:
        assert maps.images(params, [x], 0).x[0] == pytest.approx(x, rel=1e-14, abs=1e-15)
    pairs = domain(params)
    corners = np.array(np.meshgrid(*pairs)).reshape(len(pairs), -1).T
    assert (maps.images(params, corners, 0).code >= 0).all()


@ONE_OF_EACH
def test_slopes_are_those_of_central_differences(name: str) -> None:
    params, *_ = TABLE[name]
    dimension = maps.kind_of(params).dimension
    image_on: Any = kernels.forced
    method = image_on.methods[type(params)]
    for x in points(params, 20):
        branch = int(maps.images(params, x[None, :], 0).code[0])
        _, _, slope = method(params, state(x), 0, branch)
        for axis in range(dimension):
            step = np.zeros(dimension)
            step[axis] = 1e-5
            ends = np.stack((x + step, x - step))
            after, _ = maps.images_on(params, ends, 0, branch)
            change = (after[0] - after[1]) / (ends[0] - ends[1])[axis]
            found = slope if dimension == 1 else [row[axis] for row in slope]
            assert found == pytest.approx(change, rel=1e-7, abs=1e-7)


# one and two coordinates, with and without branches, orbits that leave and that stay: a driver knows no more of a map
@pytest.mark.parametrize("name", ["saddle", "doubling", "henon", "three states"])
def test_all_drivers_agree(name: str) -> None:
    params, *_ = TABLE[name]
    xs = points(params, 12)
    ahead, sides, codes, steps = maps.advance(params, xs, 0, 6)
    x, alive = xs, np.ones(12, dtype=bool)
    for _ in range(6):
        found = maps.images(params, x, 0)
        x = np.where(alive[:, None], found.x.reshape(x.shape), x)
        alive &= found.code >= 0
    for k, start in enumerate(xs):
        path = maps.orbit(params, state(start), 0, 6)
        assert path.x[-1] == pytest.approx(ahead[k], rel=1e-15, nan_ok=True)
        assert (path.side[-1], path.code[-1], path.code.size) == (sides[k], codes[k], steps[k])
        assert np.ravel(ahead[k]) == pytest.approx(x[k], rel=1e-13, abs=1e-13)


@ONE_OF_EACH
def test_what_is_no_number_gets_no_branch(name: str) -> None:
    params, *_ = TABLE[name]
    dimension = maps.kind_of(params).dimension
    for axis in range(dimension):
        for bad in (math.nan, math.inf, -math.inf):
            x = np.full((1, dimension), 0.25)
            x[0, axis] = bad
            found = maps.images(params, x, 0)
            expected = maps.UNDEFINED if np.isnan(found.x).any() else maps.OUTSIDE
            assert int(found.code[0]) == expected, (axis, bad)


def test_every_textbook_map_is_in_the_table_and_public() -> None:
    assert {type(params) for params, *_ in TABLE.values()} == set(PUBLIC | DOMAINS)
    for cls in PUBLIC:
        assert getattr(maps, cls.__name__) is cls
        assert tuple(maps.domain_of(cls())) == PUBLIC[cls]
        assert type(cls()) is cls  # every one has defaults
        assert all(type(value) is float for value in cls())


def test_a_map_without_a_known_domain() -> None:
    with pytest.raises(LimitsetsError, match="Leslie"):
        maps.domain_of((1.0, 2.0))


@pytest.mark.parametrize("params", [maps.Rotation(0.25), maps.Circle(0.25), maps.Doubling(), Baker()])
def test_the_circle_has_an_end(params: Any) -> None:
    other = (0.5,) * (maps.kind_of(params).dimension - 1)
    starts = [(x, *other) for x in (-1e-300, 1.0 + 2.0**-52, 2.0, -1.0)]
    assert (maps.images(params, starts, 0).code == maps.OUTSIDE).all()


@pytest.mark.parametrize("factor", [1.1, 1.7, 1.9999999, 2.0])
def test_no_orbit_of_the_circle_leaves_by_rounding(factor: float) -> None:
    edge = 1.0 / factor
    near = edge * (1.0 + np.arange(-2000, 2001) * 2.0**-53)
    after = maps.images(maps.Doubling(factor), near, 0)
    assert ((after.x >= 0.0) & (after.x <= 1.0)).all()
    assert set(after.code.tolist()) == {0, 1}
    turned = maps.images(maps.Rotation(edge), 1.0 - near, 0)
    assert ((turned.x >= 0.0) & (turned.x <= 1.0)).all()
    # At a coupling of 1 the slope at 0 is 0: images near 0 are smaller than the rounding of their terms.
    small = np.concatenate((10.0 ** np.linspace(-300, -1, 4000), near - near.min()))
    for circle in (maps.Circle(0.0, 1.0), maps.Circle(1.0 - 2.0**-53, 1.0)):
        turned = maps.images(circle, np.concatenate((small, 1.0 - small)), 0)
        assert ((turned.x >= 0.0) & (turned.x <= 1.0)).all()
        assert (turned.code >= 0).all()


def test_branches_of_the_cubic_meet_at_its_turning_points() -> None:
    turn = math.sqrt(0.5)
    x = np.array([-turn - 1e-9, -turn + 1e-9, turn - 1e-9, turn + 1e-9])
    assert maps.images(maps.Cubic(1.5), x, 0).code.tolist() == [0, 1, 1, 2]


# ---------------------------------------------------------------- the exponential


def test_exponential_is_within_one_unit_in_the_last_place() -> None:
    rng = np.random.default_rng(3)
    near_halves = (np.arange(-1020, 1020) + 0.5) * math.log(2.0)
    spread = rng.uniform(-745.0, 709.7, 3000), rng.uniform(-1.0, 1.0, 3000)
    x = np.concatenate((*spread, near_halves, 10.0 ** rng.uniform(-20, 0, 300)))
    with mpmath.workdps(40):
        for value in x[x < 709.78]:
            exact = mpmath.exp(mpmath.mpf(value))
            unit = max(math.ulp(float(exact)), 5e-324)
            assert abs(exponential(value) - exact) <= unit, value


def test_exponential_at_the_ends() -> None:
    assert exponential(0.0) == exponential(-0.0) == 1.0
    assert exponential(709.782712893384) == pytest.approx(math.exp(709.782712893384), rel=1e-15)
    assert [exponential(x) for x in (709.79, 1e5, math.inf)] == [math.inf] * 3
    assert [exponential(x) for x in (-746.0, -1e5, -math.inf)] == [0.0] * 3
    assert math.isnan(exponential(math.nan))


def exponentials(x: Any, out: Any) -> None:
    for k in range(x.size):
        out[k] = exponential(x[k])


def test_a_loop_of_exponentials_vectorises() -> None:
    loop: Any = kernel(exponentials)
    x = np.linspace(-3.0, 3.0, 1000)
    out = np.empty_like(x)
    loop(x, out)
    assert out == pytest.approx(np.exp(x), rel=4e-16)
    text = "\n".join(loop.inspect_asm().values())
    packed = r"\bv?(mul|fmadd\d+|fmsub\d+|fnmadd\d+)pd\b|\bf(mul|mla|mls)\.2d|\bf(mul|mla|mls)\s+v\d"
    assert re.search(packed, text)
