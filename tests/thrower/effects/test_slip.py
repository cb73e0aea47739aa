"""Friction of finite strength at impacts: limits, worked numbers, and an independent simulation."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from limitsets.thrower import throw_map
from limitsets.thrower.effects import with_effects
from limitsets.thrower.effects.bounce import struck
from limitsets.thrower.effects.slip import Slip, slid_on
from limitsets.thrower.full import gather_full
from limitsets.thrower.motion import LOST, Arrival, Contact, Face, FullSide
from limitsets.thrower.sliding import slide_on
from limitsets.thrower.turn import turn
from tests.thrower.effects.throws import agree, cases, same_end

HALF = math.sqrt(0.5)


def square(mu: float, rho: float = math.sqrt(2.0)) -> FullSide:
    """A square of side 2 on side 0, kappa = 4, with slip."""
    bare = throw_map(
        a=[1.0] * 4,
        d=[1.0] * 4,
        length=[2.0] * 4,
        corner=[math.pi / 2] * 4,
        radius_of_gyration=rho,
        kappa=4.0,
        surface_height=0.0,
        arm_length=50.0,
    )
    return gather_full(with_effects(bare, {"slip": True}, SimpleNamespace(friction=mu)), 0)


def upright(vx: float, vy: float, omega: float) -> Arrival:
    """The square coming down on a corner with its centre straight above: X = 0, H = sqrt 2."""
    return Arrival(0, turn(math.pi / 4), 0.0, vx, vy, omega)


def test_a_weak_impulse_of_friction_leaves_it_sliding_and_tips_it_forward() -> None:
    # J_n = 1, J_t = -1/4; the contact slows by A J_t = 2/4, and the rotation changes by H J_t / rho^2 = -sqrt 2/8
    after = struck(None, Slip(0.25), square(0.25), upright(2.0, -1.0, 0.0))
    assert after.slide == pytest.approx(1.5, rel=1e-14)
    assert after.omega == pytest.approx(-math.sqrt(2.0) / 8, rel=1e-14)
    assert after.lift == 0.0


def test_friction_that_suffices_sticks() -> None:
    # J_t = -v_t/A = -1 and J_n = 1: in the cone from mu = 1 on
    assert struck(None, Slip(1.01), square(1.01), upright(2.0, -1.0, 0.0)).slide == 0.0
    assert struck(None, Slip(0.99), square(0.99), upright(2.0, -1.0, 0.0)).slide > 0.0


def test_sliding_stops_and_reverses_on_the_way() -> None:
    # On its left corner, turned by psi with sin = 3/5: X = 4/5 - 3/5 = 1/5, H = 7/5, made to slide slowly to the right.
    # With rho^2 = 1/25 in units of it: A = 50, B = -7, C = 2; mu = 1/10 < |B|/A = 7/50.
    part, psi = square(0.1, rho=0.2), turn(math.asin(0.6))
    # v_t = vx + H omega, v_n = vy - X omega
    after = struck(None, Slip(0.1), part, Arrival(0, psi, 0.0, 0.012, -1.0, 0.0))
    # slides right until v_t = 0.012 - (0.1 * 50 + 7) J = 0: J = 0.001; there v_n = -1 + (2 + 0.7) J = -0.9973
    # then left, v_n growing by 2 - 0.7 = 1.3 a unit: J_n = 0.001 + 0.9973/1.3, v_t = -(7 - 5) 0.9973/1.3
    assert after.slide == pytest.approx(-2 * 0.9973 / 1.3, rel=1e-12)
    drag = -0.1 * 0.001 + 0.1 * 0.9973 / 1.3
    push = 0.001 + 0.9973 / 1.3
    assert after.omega == pytest.approx((1.4 * drag - 0.2 * push) / 0.04, rel=1e-12)


def test_without_friction_the_horizontal_velocity_stays_and_nothing_rests() -> None:
    for case in cases(20, 1, friction=0.0):
        part = gather_full(case.full(("slip",)), case.side)
        hit = Arrival(case.side, turn(0.3 * part.own.corner), 0.0, -0.7, -2.0, 1.0)
        after = struck(None, part.effects.slip, part, hit)
        high = part.own.a * hit.psi.s + part.own.d * (1.0 - hit.psi.v)
        assert after.slide - after.omega * high == pytest.approx(hit.vx, rel=1e-12)
        assert case.mapped(("slip",)) is None


def test_where_the_stop_pushes_enough_friction_is_the_bare_map() -> None:
    stuck = 0
    for case in cases(60, 2, friction=1e9):
        # the impulse that stops the vertex, from the throw's formulas in docs/model.md
        facts = case.body.numbers()
        a, d, rho = facts["a"][case.side], facts["d"][case.side], case.body.rho
        phi = _landing(a, d, case.kappa, case.x)
        if phi > facts["corner"][case.side]:
            continue
        right, high = a * math.cos(phi) - d * math.sin(phi), a * math.sin(phi) + d * math.cos(phi)
        fall = case.x - case.kappa * phi
        omega = (rho**2 + right * fall + high * (case.height + d)) / (rho**2 + a * a + d * d)
        if omega * right - fall > 1e-6:
            stuck += 1
            assert same_end(case.mapped(("slip",)), case.mapped(()))
    assert stuck > 20


def _landing(a: float, d: float, kappa: float, x: float) -> float:
    """Smallest root of the flight, by a scan."""
    phi = np.linspace(1e-4, 2 * np.pi, 400_000)
    below = np.flatnonzero(x * phi - a * np.sin(phi) + d * (1 - np.cos(phi)) - kappa / 2 * phi**2 <= 0)
    return float(phi[below[0]])


def test_the_rest_slides_on_by_its_braking_distance() -> None:
    part = square(0.5)
    # speed 2, braked by mu kappa = 2: 2^2/(2 * 2) = 1, either way
    assert slid_on(Slip(0.5), part, Face(0, 0.0, 0, 0.0, 2.0)) == pytest.approx(1.0, rel=1e-15)
    assert slid_on(Slip(0.5), part, Face(0, 0.0, 0, 0.0, -2.0)) == pytest.approx(-1.0, rel=1e-15)
    # turning down about its left end by 1, xdot = d = 1 and J_n = a = 1: friction takes half of it
    assert slid_on(Slip(0.5), part, Face(0, 0.0, 0, -1.0, 0.0)) == pytest.approx(0.25 / 4.0, rel=1e-14)
    assert slid_on(Slip(1.5), part, Face(0, 0.0, 0, -1.0, 0.0)) == 0.0
    # with mu d beyond the leading end the part would tip over it; without friction it slides for ever
    assert math.isnan(slid_on(Slip(1.5), part, Face(0, 0.0, 0, 0.0, 2.0)))
    assert math.isinf(slid_on(Slip(0.0), part, Face(0, 0.0, 0, 0.0, 2.0)))


def test_painleves_paradox_is_outside_the_model() -> None:
    # sliding left with X = 1/5, H = 7/5 and rho^2 = 1/25: rho^2 + X^2 - mu X H = 0.08 - 0.28 mu
    psi = turn(math.asin(0.6))
    for mu, lost in ((0.28, False), (0.29, True)):
        _, ends = slide_on(square(mu, rho=0.2), mu, -1, Contact(0, psi, 0.0, 0.0, -1.0, 0.0))
        assert (ends == LOST) is lost


@pytest.mark.parametrize("names", [("landing", "slip"), ("landing", "slip", "roll")])
def test_throws_end_where_an_independent_simulation_sees_them_end(names: tuple[str, ...]) -> None:
    assert [case for case in cases(60, 3) if not agree(case, names)] == []
