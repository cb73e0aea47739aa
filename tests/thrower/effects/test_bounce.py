"""Restitution: heights and times of a bouncing part, energy, limits, and an independent simulation."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from limitsets.feeder.thrower import throw_map
from limitsets.feeder.thrower.contact import next_contact
from limitsets.feeder.thrower.effects.bounce import Bounce, struck
from limitsets.feeder.thrower.effects.slip import Slip
from limitsets.feeder.thrower.flight import turn
from limitsets.feeder.thrower.full import gather_full, with_effects
from limitsets.feeder.thrower.motion import Arrival, FullSide, above, right_of
from limitsets.systems.maps.drivers import images
from tests.thrower.effects.throws import agree, cases, same_end

SIDES = 60


def wheel() -> FullSide:
    """A regular polygon of many sides, kappa = 4."""
    half = math.pi / SIDES
    bare = throw_map(
        a=[math.sin(half)] * SIDES,
        d=[math.cos(half)] * SIDES,
        length=[2 * math.sin(half)] * SIDES,
        corner=[2 * half] * SIDES,
        radius_of_gyration=0.7,
        kappa=4.0,
        surface_height=0.0,
        arm_length=50.0,
    )
    world = SimpleNamespace(restitution=0.8, bounce_threshold=1e-9)
    return gather_full(with_effects(bare, {"bounce": True}, world), 0)


@pytest.mark.sweep
def test_a_part_without_spin_rises_to_e_squared_of_its_height() -> None:
    part, e, speed = wheel(), 0.8, 3.0
    # standing on the corner under its centre
    hit = Arrival(0, turn(math.pi / SIDES), 0.0, 0.0, -speed, 0.0)
    waited = 0.0
    for n in range(1, 40):
        after = struck(Bounce(e, 1e-12), None, part, hit)
        assert after.lift**2 / 8.0 == pytest.approx(speed**2 / 8.0 * e ** (2 * n), rel=1e-11)
        waited += 2 * after.lift / 4.0
        hit, found = next_contact(part, after)
        assert found
        assert (hit.vertex, hit.vy) == (0, pytest.approx(-after.lift, rel=1e-11))
        assert abs(hit.shift) < 1e-15
    # Zeno's time, 2 v e/(g (1 - e)), less what is still to come
    assert waited == pytest.approx(2 * speed * e / (4.0 * (1 - e)) * (1 - e**39), rel=1e-10)


def test_a_bounce_off_a_corner_beside_the_centre_spins_the_part() -> None:
    # On its left corner without slip, X = sin t, H = cos t, t = pi/60, falling at 1 without rotation.
    part, rho2, t = wheel(), 0.49, math.pi / SIDES
    x, high = math.sin(t), math.cos(t)
    after = struck(Bounce(0.5, 0.0), None, part, Arrival(0, turn(0.0), 0.0, 0.0, -1.0, 0.0))
    # plastic: J_n = (rho^2 + H^2)/M, J_t = X H/M; then e = 1/2 as much again, friction sticking; M = rho^2 + 1
    m = rho2 + x * x + high * high
    push, drag = 1.5 * (rho2 + high**2) / m, 1.5 * x * high / m
    assert after.omega == pytest.approx((-x * push + high * drag) / rho2, rel=1e-12)
    assert after.slide == 0.0
    # off the arm at half the speed of a contact that sticks along it
    assert after.lift == pytest.approx(0.5, rel=1e-12)


@pytest.mark.parametrize("slips", [False, True])
def test_no_impact_gains_energy(slips: bool) -> None:
    rng = np.random.default_rng(8)
    for case in cases(15, 8):
        part = gather_full(case.full(("bounce",)), 0)
        for _ in range(40):
            vertex = int(rng.integers(part.a.size))
            psi = turn(float(rng.uniform(0, part.corner[vertex])))
            vx, vy, omega = rng.normal(size=3) * 2.0
            right, high = right_of(part, vertex, psi), above(part, vertex, psi)
            if vy - omega * right >= 0:
                continue
            slip = Slip(float(rng.uniform(0, 2))) if slips else None
            # the most that restitution gives back is all of it
            after = struck(Bounce(1.0, 0.0), slip, part, Arrival(vertex, psi, 0.0, vx, vy, omega))
            speed = (after.slide - after.omega * high, after.lift + after.omega * right)
            before = vx**2 + vy**2 + part.own.rho2 * omega**2
            left = speed[0] ** 2 + speed[1] ** 2 + part.own.rho2 * after.omega**2
            assert left <= before * (1 + 1e-13)


@pytest.mark.parametrize("names", [("bounce",), ("bounce", "roll")])
def test_no_restitution_is_the_plastic_map(names: tuple[str, ...]) -> None:
    plain = tuple(name for name in names if name != "bounce")
    for case in cases(30, 9, restitution=0.0):
        xs = np.linspace(case.x, 2 * case.x, 20)
        full = images(case.full(names), xs, case.side)
        other = images(case.full(plain) if plain else case.bare, xs, case.side)
        np.testing.assert_allclose(full.x, other.x, rtol=1e-12)
        assert (full.side == other.side).all()


def test_bounces_below_the_threshold_are_plastic() -> None:
    for case in cases(30, 10, bounce_threshold=1e6):
        assert same_end(case.mapped(("bounce",)), case.mapped(()))


def test_bounces_without_end_are_outside_the_model() -> None:
    case = cases(1, 11, restitution=1.0, bounce_threshold=1e-9)[0]
    assert case.mapped(("bounce",)) is None


@pytest.mark.sweep
def test_throws_end_where_an_independent_simulation_sees_them_end() -> None:
    names = ("landing", "bounce")
    assert [case for case in cases(60, 12) if not agree(case, names)] == []


@pytest.mark.sweep
def test_all_together_end_where_an_independent_simulation_sees_them_end() -> None:
    names = ("landing", "roll", "slip", "pivot", "bounce")
    assert [case for case in cases(60, 13) if not agree(case, names)] == []
