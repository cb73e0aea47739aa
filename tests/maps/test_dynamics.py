"""Orbits, exponents and critical points of textbook maps."""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.base.errors import AnswerError, MapError
from limitsets.feeder.thrower import Energy, Exact, Signed, SmallAngle
from limitsets.systems.cells import Domain, as_domain
from limitsets.systems.maps import along, critical_points, monotone_pieces, turning_points
from limitsets.systems.maps.critical import margins
from limitsets.systems.maps.growth import CHUNK, orbit_with_exponent
from tests.maps_of_tests import Contraction, Linear2, ThreeState, TwoState

# ----------------------------------------------------------------
# Lyapunov exponents that books and papers state; images and orbits of the textbook maps: test_textbook.py.


TURN = math.sqrt(3.0) / 2.0
LONG = 2 * CHUNK + 8  # even, for the cycle of period 2; the exponent alone goes on in parts of `CHUNK` steps
# Slopes of all textbook maps are those of differences in test_textbook.py: here are those that differ in kind.
EXPONENTS = {
    "doubling": (maps.Doubling(), 0.3, LONG, math.log(2.0), 1e-12),
    # sin^2 turns it into the doubling map.
    "logistic": (maps.Logistic(4.0), 0.3, 1_000_000, math.log(2.0), 1e-3),
    # The slope over a period is r^2 (1 - 2 x)(1 - 2 y) = 4 + 2 r - r^2.
    "logistic, period 2": (maps.Logistic(3.2), 0.3, LONG, 0.5 * math.log(4.0 + 2 * 3.2 - 3.2**2), 1e-9),
    "henon": (maps.Henon(), (0.1, 0.1), 1_000_000, 0.4192, 1e-3),
    # Rotation by 30 degrees, times 0.9.
    "spiral": (Linear2(0.9 * TURN, -0.45, 0.45, 0.9 * TURN), (1.0, 0.0), LONG, math.log(0.9), 1e-3),
}


@pytest.mark.parametrize("name", EXPONENTS)
def test_lyapunov_exponent_alone_and_with_its_orbit(name: str) -> None:
    """To the bit: the orbit is recorded whole, the exponent alone goes on in parts."""
    params, x, count, expected, within = EXPONENTS[name]
    found = maps.lyapunov(params, x, 0, count, skip=1000)
    assert found.exponent == pytest.approx(expected, abs=within)
    assert (found.steps, found.stopped) == (count, None)
    path, growth = orbit_with_exponent(params, x, 0, 1000, count)
    alone = maps.orbit(params, x, 0, 1000 + count)
    assert np.array_equal(path.x, alone.x)
    assert np.array_equal(path.code, alone.code)
    assert path.stopped == alone.stopped
    assert growth == found


def test_an_orbit_that_leaves_early_ends_both() -> None:
    path, growth = orbit_with_exponent(Linear2(2.0, 0.0, 0.0, 3.0), (1.0, 1.0), 0, 10, 5000)
    alone = maps.orbit(Linear2(2.0, 0.0, 0.0, 3.0), (1.0, 1.0), 0, 5010)
    assert (path.stopped, growth.stopped) == (alone.stopped, alone.stopped)
    assert np.array_equal(path.x, alone.x)
    assert growth.steps == alone.code.size - 11  # the step that leaves has no slope
    assert growth.exponent == pytest.approx(math.log(3.0), rel=1e-4)


def rotor(x, y, z, stretch):
    """Three coordinates: a shear of the first two, and a contraction."""
    return stretch * x + y, 0.5 * y, 0.25 * z


class Bare(NamedTuple):
    """A map without slopes: boxes and derivatives cannot follow its comparison."""

    size: float


def bare(params: Bare, x: float, side: int) -> Any:
    return (params.size if x < 1.0 else 0.0) * x, side, 0


maps.register(Bare, image=bare)


def test_lyapunov_exponent_in_three_dimensions() -> None:
    found = maps.lyapunov(ls.map(rotor, stretch=0.8), (1.0, 1.0, 1.0), 0, 5000)
    assert found.exponent == pytest.approx(math.log(0.8), abs=1e-6)


def test_a_slope_of_zero_gives_minus_infinity() -> None:
    found = maps.lyapunov(maps.Logistic(2.0), 0.5, 0, 100, skip=0)
    assert (found.exponent, found.steps, found.stopped) == (-math.inf, 1, None)
    assert maps.lyapunov(TwoState(), (1.0, 1.0), 0, 100).exponent == -math.inf


def test_an_orbit_that_leaves_says_so() -> None:
    # From (1, 1) the y coordinate doubles until it overflows: 2^1023 is the last number.
    found = maps.lyapunov(Linear2(), (1.0, 1.0), 0, 5000, skip=10)
    assert found.exponent == pytest.approx(math.log(2.0), abs=1e-6)
    assert (found.steps, found.stopped) == (1013, "outside")
    early = maps.lyapunov(Linear2(), (1.0, 1.0), 0, 5000, skip=2000)
    assert (early.exponent, early.steps, early.stopped) == (None, 0, "outside")
    assert maps.lyapunov(Linear2(), (1.0, 1.0), 0, 0, skip=0) == maps.Lyapunov(None, 0, None)


def test_the_sum_neither_overflows_nor_underflows() -> None:
    for slope in (1e-90, 1e90, 1e-150, 1e150):
        # 0 is fixed whatever the slope.
        found = maps.lyapunov(Contraction(slope, 0.0), 0.0, 0, 1000)
        assert found.exponent == pytest.approx(math.log(slope), rel=1e-12)


def test_wrong_questions_are_refused() -> None:
    for arguments, allowed in (
        ((Bare(1.0), 0.5, 0, 10), "image_on"),
        ((maps.Henon(), 0.5, 0, 10), "2 finite numbers"),
        ((maps.Logistic(), math.nan, 0, 10), "a finite number"),
        ((maps.Logistic(), 0.5, -1, 10), "from 0"),
        ((maps.Logistic(), 0.5, 0, -1), "from 0"),
        ((maps.Logistic(), 0.5, 0, 10, -1), "from 0"),
    ):
        with pytest.raises(MapError, match=allowed):
            maps.lyapunov(*arguments)


def test_a_circle_map_without_coupling_is_the_rotation() -> None:
    x = np.linspace(0.0, 1.0, 1001)
    for omega in (0.0, 0.25, 0.6180339887498949, 1.0 - 2.0**-53):
        turned, plain = maps.images(maps.Circle(omega, 0.0), x, 0), maps.images(maps.Rotation(omega), x, 0)
        assert turned.x.tolist() == plain.x.tolist()
        assert turned.code.tolist() == plain.code.tolist()


# ----------------------------------------------------------------
# Critical and turning points: the paper's parts under every criterion, maps with answers on paper, traps.


CRITERIA = [(SmallAngle, Energy), (SmallAngle, Signed), (Exact, Energy), (Exact, Signed)]

NONE = (None, None, None)
# First critical points of the four parts, under each of the criteria above; None: none below 80.
FIRST = {
    "paper-initial-small-angle": [(20.0, 20.0, 20.0), NONE, (21.9, 28.1, 26.8), (63.8, 44.5, 46.5)],
    "paper-designed-small-angle": [(10.0, 10.0, 20.0), NONE, (17.5, 18.3, 23.5), (17.5, 18.3, 38.2)],
    "paper-initial": [(9.8, 12.3, 13.6), NONE, (15.6, 20.0, 20.0), (20.0, 20.0, 20.0)],
    "paper-designed": [(7.2, 7.4, 13.7), (7.5, 7.6, None), (10.0, 10.0, 20.0), (10.0, 10.0, 20.0)],
}
CASES = [
    (name, flight, flip, first)
    for name, rows in FIRST.items()
    for (flight, flip), first in zip(CRITERIA, rows, strict=True)
]


def up_to_80(scene):
    anchor = scene.sides.a
    lo = anchor + 1e-6 * (80.0 - anchor)
    return Domain(lo[:, None], np.full((3, 1), 80.0), anchor)


@pytest.mark.parametrize(("name", "flight", "flip", "first"), CASES)
def test_first_critical_points_of_the_papers_parts(name, flight, flip, first):
    scene = ls.load(name)
    part = scene.map._replace(arm_length=80.0, flight=flight(), flip=flip())
    found = critical_points(part, up_to_80(scene))
    for side, r in enumerate(first):
        if r is None:
            assert found[side] == ()
        else:
            assert found[side][0].x == pytest.approx(r, abs=0.0501)
            assert (found[side][0].before, found[side][0].kind) == (0, "jog->flip")


@pytest.mark.parametrize("name", [name for name in ls.scenes() if ls.load(name).cavity is None])
def test_own_critical_points_are_round(name):
    scene = ls.load(name)
    targets = [20.0, 20.0, 20.0] if "initial" in name else [10.0, 10.0, 20.0]
    found = critical_points(scene.map, scene.domain)
    assert [found[side][0].x for side in range(3)] == pytest.approx(targets, abs=1e-6)


def test_later_changes_are_found_too():
    scene = ls.load("paper-designed")
    part = scene.map._replace(arm_length=80.0, flight=SmallAngle(), flip=Signed())
    found = critical_points(part, up_to_80(scene))
    assert [points[1].x for points in (found[0], found[1])] == pytest.approx([20.82, 22.16], abs=0.006)
    assert found[0][1].kind == "flip->jog"


def test_decision_changes_between_adjacent_floats():
    scene = ls.load("paper-designed")
    for side, points in critical_points(scene.map, scene.domain).items():
        for point in points:
            around = [np.nextafter(point.x, 0.0), point.x]
            assert (margins(scene.map, around, side) > 0.0).tolist() == [False, True]


class Dip(NamedTuple):
    """Decided by (x - middle)^2 - depth: two changes 2 sqrt(depth) apart; nothing below `start`."""

    middle: float
    depth: float
    start: float


def _dip_image(params, x, side):
    return 0.5 * x, side, 1 if (x - params.middle) * (x - params.middle) > params.depth else 0


def _dip_margin(params, x, side):
    return math.nan if x < params.start else (x - params.middle) * (x - params.middle) - params.depth


maps.register(Dip, image=_dip_image, margin=_dip_margin, branches=("in", "out"))
UNIT = as_domain([(0.0, 1.0)])


@pytest.mark.parametrize("depth", [1e-4, 1e-8, 1e-12])
@pytest.mark.parametrize("middle", [0.25, 0.7531, 1e-5, 1.0 - 1e-5])
def test_two_changes_between_samples_are_found(middle, depth):
    points = critical_points(Dip(middle, depth, -1.0), UNIT)[0]
    width = math.sqrt(depth)
    expected = [r for r in (middle - width, middle + width) if 0.0 <= r <= 1.0]
    assert [p.x for p in points] == pytest.approx(expected, abs=1e-9)


def test_an_extremum_that_does_not_cross_is_no_change():
    assert critical_points(Dip(0.3, -1e-12, -1.0), UNIT)[0] == ()


def test_the_border_of_the_model_is_no_change():
    # Nothing below 0.5; the change at 0.5001 hides between the border and the next sample.
    points = critical_points(Dip(0.4001, 0.01, 0.5), UNIT)[0]
    assert [p.x for p in points] == pytest.approx([0.5001], abs=1e-12)
    assert critical_points(Dip(0.3, 0.01, 0.5), UNIT)[0] == ()


class Switch(NamedTuple):
    """Two constants that change at 0 exactly, where floats are densest."""

    size: float


def _switch(params, x, side):
    return (params.size, side, 1) if x >= 0.0 else (-params.size, side, 0)


maps.register(Switch, image=_switch, branches=("low", "high"))


@pytest.mark.parametrize(
    ("params", "pair", "expected"),
    [
        (maps.Doubling(2.0), (-0.5, 1.5), [0.5]),
        (maps.Cubic(1.5), (-1.2, 1.2), [-math.sqrt(0.5), math.sqrt(0.5)]),
        (ThreeState(), (-3.0, 3.0), [-1.0, 1.0]),
        (Switch(1.0), (-2.0, 1.0), [0.0]),
        # At 1/2 there is no wave: omega = 1/2 wraps there; `Circle` has a margin.
        (maps.Circle(0.5, 0.9), (0.0, 1.0), [0.5]),
        (maps.Logistic(3.9), (0.0, 1.0), [0.5]),
    ],
)
def test_changes_of_code_with_and_without_a_margin(params, pair, expected):
    domain = as_domain([pair])
    assert [p.x for p in critical_points(params, domain)[0]] == pytest.approx(expected, abs=1e-15)


def wave(x, k):
    return math.sin(k * x)


def test_turning_points_inside_a_branch():
    params = ls.map(wave, k=20.0)
    points = turning_points(params, UNIT)[0]
    assert [p.x for p in points] == pytest.approx([math.pi * (k + 0.5) / 20.0 for k in range(6)], abs=1e-15)
    pieces = monotone_pieces(params, UNIT)[0]
    assert all(np.nextafter(one.hi, 2.0) == two.lo for one, two in itertools.pairwise(pieces))
    assert (pieces[0].lo, pieces[-1].hi) == (0.0, 1.0)


def test_a_jump_of_the_image_inside_a_branch_is_a_cut():
    # kappa < ell on side 2: the part grazes, and just beyond it the impact comes at another angle.
    part = ls.load("paper-designed").map._replace(kappa=3.5)
    lo = part.a + 1e-3
    pieces = monotone_pieces(part, Domain(lo[:, None], np.full((3, 1), 28.0), part.a))[2]
    (jump,) = [piece for piece in pieces if piece.below == "jump"]
    before, after = along(part, [np.nextafter(jump.lo, 0.0), jump.lo], 2, [jump.branch])[0]
    assert abs(after - before) > 0.1
    for piece in pieces:
        x = np.linspace(piece.lo, piece.hi, 1001)
        steps = np.diff(along(part, x, 2, [piece.branch])[0])
        assert (steps >= 0).all() or (steps <= 0).all()


def test_slopes_along_a_word_are_derivatives():
    part = ls.load("paper-designed").map
    x, h, word = 14.0, 1e-5, [0, 1, 1, 0]
    at, side, slope = along(part, [x - h, x, x + h], 2, word)
    assert slope[1] == pytest.approx((at[2] - at[0]) / (2 * h), rel=1e-8)
    assert side.tolist() == [1, 1, 1]


def test_maps_of_the_plane_and_maps_without_slopes_are_refused():
    with pytest.raises(AnswerError, match="dimension"):
        critical_points(maps.Henon(), as_domain([(-2, 2), (-2, 2)]))
    with pytest.raises(AnswerError, match="image_on"):
        monotone_pieces(Dip(0.5, 0.01, -1.0), UNIT)


class Halves(NamedTuple):
    slope: float = 0.5


def _halves(params, x, side):
    return params.slope * x, side, 1 if x > 0.0 else 0


ls.register(Halves, image=_halves, branches=("left", "right"))


def test_a_change_just_above_zero_is_at_zero():
    found = ls.critical_points(Halves(), ls.grid([(-1.0, 1.0)]).domain)
    assert [point.x for point in found[0]] == [0.0]
