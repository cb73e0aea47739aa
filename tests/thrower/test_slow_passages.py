"""Passages of about a million throws: counted right, and never taken for an end of the orbit or of a limit set.

A map x' = x + D(x) with small D crosses from x0 to x1 in

    N = integral of dx / D + ln(D(x1) / D(x0)) / 2 + O(D')

steps, the flow that interpolates the map (Julia's equation) to second order.  The angle phi of the impact gives both x
and D of a jog in closed form, so that N is one integral, taken here at 40 digits.

Where a jog is what the part does, D is convex in phi as long as the centre of mass is right of the vertex (its second
derivative is X), and D = 0 at phi = 0: for h > 0 it has one more zero there and no two to merge.  The two that merge
at a larger h lie on the jog branch continued beyond the vertex, which is followed by `along`, as limit sets do.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from mpmath import mp, mpf

import limitsets as ls
from limitsets import maps
from limitsets.feeder.thrower import Throw, throw_map
from limitsets.systems.cells import Domain
from limitsets.systems.sets import limit_set_of

mp.dps = 40

A, D, KAPPA, RHO = 2.0, 1.0, 12.0, 1.25
ARM = 40.0


def part(h: float, kappa: float = KAPPA) -> Throw:
    """Three equal sides that are like no triangle's: only side 0 is asked."""
    return throw_map(
        a=[A] * 3,
        d=[D] * 3,
        length=[2.0 * A] * 3,
        corner=[2.0] * 3,
        radius_of_gyration=RHO,
        kappa=kappa,
        surface_height=h,
        arm_length=ARM,
    )


def x_of(phi: mpf, kappa: float = KAPPA) -> mpf:
    """Start that lands at phi: f(phi) = 0 solved for R."""
    return (A * mp.sin(phi) - D * (1 - mp.cos(phi))) / phi + mpf(kappa) * phi / 2


def rate(phi: mpf, kappa: float = KAPPA) -> mpf:
    """Derivative of `x_of`."""
    low = A * mp.sin(phi) - D * (1 - mp.cos(phi))
    return (A * mp.cos(phi) - D * mp.sin(phi)) / phi - low / phi**2 + mpf(kappa) / 2


def moved(phi: mpf, h: mpf) -> mpf:
    return A * (1 - mp.cos(phi)) - D * (phi - mp.sin(phi)) - h * phi


def throws_between(one: mpf, two: mpf, h: mpf, peaks: list[mpf], kappa: float = KAPPA) -> mpf:
    """N from angle to angle."""
    total = mp.quad(lambda phi: rate(phi, kappa) / moved(phi, h), [one, *peaks, two])
    return total + mp.log(moved(two, h) / moved(one, h)) / 2


def saddle_node() -> tuple[mpf, mpf]:
    """Angle and height at which the two zeros of the jog's displacement meet: the top of (D + h phi) / phi."""
    phi = mp.findroot(lambda p: mp.diff(lambda q: moved(q, mpf(0)) / q, p), 2.0)
    return phi, moved(phi, mpf(0)) / phi


def test_just_beyond_the_saddle_node_of_the_jog() -> None:
    phi, top = saddle_node()
    h = float(top) + 3e-10
    past = mpf(h) - top
    # Leading order: D = -past phi - bend (x - x*)^2 takes pi / sqrt(past phi bend) steps.
    bend = -mp.diff(lambda p: moved(p, top), phi, 2) / 2 / rate(phi) ** 2
    leading = mp.pi / mp.sqrt(past * phi * bend)
    width = mp.sqrt(past * phi / bend) / rate(phi)
    one, two = phi * mpf("1.02"), phi * mpf("0.98")
    steps = [10**k * width for k in range(4)]
    peaks = [phi + step for step in reversed(steps)] + [phi] + [phi - step for step in steps]
    expected = throws_between(one, two, mpf(h), peaks)
    assert 9e5 < expected < 1e6
    assert float(expected) == pytest.approx(float(leading), rel=1e-3)
    start, end = float(x_of(one)), float(x_of(two))
    # Rounding x' moves it by half an ulp, against a displacement of 5e-10 at least: 2e-6 of the throws are uncertain.
    slack = 4e-6
    before = np.zeros(int(expected * (1 - slack)), np.int64)
    after = np.zeros(int(expected * (1 + slack)) + 1, np.int64)
    params = part(h)
    assert maps.along(params, [start], 0, before)[0][0] > end
    assert maps.along(params, [start], 0, after)[0][0] <= end
    # The flip takes the part away from there: as an orbit it is no passage at all.
    assert ls.orbit(params, start, 0, 3).code[0] == maps.FLIP


def test_an_orbit_that_needs_a_million_throws_to_get_away_from_the_vertex() -> None:
    h = -2e-5
    first, last = mpf("1e-8"), mpf("1e-2")
    peaks = [mpf(10) ** -k for k in (7, 6, 5, 4, 3)]
    expected = throws_between(first, last, mpf(h), peaks)
    start, end = float(x_of(first)), float(x_of(last))
    path = ls.orbit(part(h), start, 0, 3_000_000)
    count = int(np.argmax(path.x >= end))
    assert 1e6 < count < 3e6
    # D = 2e-13 at first, where rounding x' by 2e-16 either way makes a throw in a thousand uncertain, and 2e-8 at last.
    assert count == pytest.approx(float(expected), rel=2e-4)
    assert path.stopped is None or path.code[-1] < 0


def test_inside_the_fixed_point_of_a_jog_with_h_above_0_the_part_creeps_to_the_vertex() -> None:
    h = 1e-4
    params = part(h)
    still = mp.findroot(lambda p: moved(p, mpf(h)), 2 * h / A)  # the unstable zero, near 2 h / a
    one, two = still * mpf("0.9"), still * mpf("1e-3")
    peaks = [still * mpf(10) ** -k for k in (1, 2)]
    expected = throws_between(one, two, mpf(h), peaks)
    path = ls.orbit(params, float(x_of(one)), 0, 2_000_000)
    count = int(np.argmax(path.x <= float(x_of(two))))
    # D = 1e-11 at last: rounding makes 2e-5 of those throws uncertain.
    assert count == pytest.approx(float(expected), rel=1e-5)
    # It never arrives: its throws round away, which is said, and is neither a fixed point nor an exit.
    assert path.stopped == "stalled"
    assert (np.diff(path.x) < 0.0).all()
    assert path.x[-1] > A
    assert (path.code == maps.JOG).all()


def test_ends_that_creep_are_not_at_rest() -> None:
    """Throws of 1e-16 of the arm: the ends stand still as numbers, and all the same all of it runs to the vertex."""
    fast = part(1e-5, kappa=1e11)
    held = limit_set_of(fast, {0: [(3.0, 5.0)]}, Domain([[2.1]] * 3, [[ARM]] * 3, [A] * 3))
    assert not held.converged
    assert "creeps" in str(held.advice)


def test_an_attractor_of_throws_that_round_away_says_so() -> None:
    scene = ls.load("paper-designed").with_values({"throw.kappa": "1e11 in", "arm.surface_height": "1e-7 in"})
    found = ls.analyse(scene, cells=32, throws=100)
    assert found.attractors
    assert all(attractor.stopped == "stalled" for attractor in found.attractors)
    assert not any(limit.converged for limit in found.limit_sets)
    assert found.extents_from == ("cells",) * len(found.attractors)
    path = ls.orbit(scene.map, 15.0, 2, 100)
    assert path.stopped == "stalled"
    assert path.code.size == 0


def test_a_million_throws_are_made_or_the_reason_is_given() -> None:
    scene = ls.load("paper-designed")
    for x, side in ((15.0, 2), (float(np.nextafter(scene.map.a[0], math.inf)), 0)):
        path = ls.orbit(scene.map, x, side, 1_000_000)
        assert (path.code.size == 1_000_000) == (path.stopped is None)
