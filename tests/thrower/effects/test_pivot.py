"""A vertex that only friction and weight hold: the hinge where that suffices, and an independent simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest

from limitsets.feeder.thrower.contact import force, gives_way, lets_go
from limitsets.feeder.thrower.flight import turn
from limitsets.feeder.thrower.full import gather_full
from limitsets.feeder.thrower.motion import OFF, ON, Contact
from tests.thrower.effects.test_slip import square
from tests.thrower.effects.throws import Case, agree, cases, same_end


def _worst_hold(case: Case) -> float:
    """Least of N - |T|/mu along the hinged way of a throw, from a fine grid of its angles; nan where not in doubt."""
    part = gather_full(case.full(("landing", "pivot")), case.side)
    a, d, rho2 = part.own.a, part.own.d, part.own.rho2
    grid = np.linspace(1e-5, 2 * np.pi, 400_000)
    height = case.x * grid - a * np.sin(grid) + d * (1 - np.cos(grid)) - case.kappa / 2 * grid**2
    phi = float(grid[np.flatnonzero(height <= 0)[0]])
    if phi > part.own.corner:
        return math.nan
    x, high = a * math.cos(phi) - d * math.sin(phi), a * math.sin(phi) + d * math.cos(phi)
    inertia = rho2 + a * a + d * d
    omega = (rho2 + x * (case.x - case.kappa * phi) + high * (case.height + d)) / inertia
    angles = np.linspace(0.0, part.own.corner, 20_001)
    xs, hs = a * np.cos(angles) - d * np.sin(angles), a * np.sin(angles) + d * np.cos(angles)
    rate2 = omega**2 + 2 * case.kappa * (high - hs) / inertia
    # Newton's law for the centre of mass, which goes round the vertex at omega, omega' = -kappa X/M
    along = -rate2 * xs + case.kappa * xs / inertia * hs
    off = case.kappa - rate2 * hs - case.kappa * xs / inertia * xs
    # the way: from phi up to where it turns back or a side is down, and down again
    here = int(np.searchsorted(angles, phi))
    left, right = np.arange(here, angles.size), np.arange(here, -1, -1)
    first, then = (left, right) if omega > 0 else (right, left)
    turns = np.flatnonzero(rate2[first] < 0)
    way = first if turns.size == 0 else np.concatenate([first[: turns[0]], then])
    return float((off - np.abs(along) / case.world.friction)[way].min())


def test_where_the_force_stays_in_the_cone_it_is_the_hinge() -> None:
    names = ("landing", "pivot")
    held = 0
    for case in cases(80, 5, friction=2.0):
        if _worst_hold(case) > 1e-3:
            held += 1
            assert same_end(case.mapped(names), case.mapped(("landing",)))
    assert held > 10


def test_where_it_does_not_the_part_ends_elsewhere() -> None:
    names = ("landing", "pivot")
    worst = [(_worst_hold(case), case) for case in cases(80, 5, friction=0.2)]
    slipped = [case for hold, case in worst if hold < -1e-3]
    assert len(slipped) > 10
    assert not any(same_end(case.mapped(names), case.mapped(("landing",))) for case in slipped)


def test_the_force_on_a_vertex_that_stands_still() -> None:
    # the square at rest on a corner, turned by sin = 3/5: X = 1/5, H = 7/5; rho^2 = 2, M = 4, kappa = 4:
    # omega' = -kappa X/M = -1/5, so T = -H omega' = 7/25 and N = kappa + X omega' = 4 - 1/25
    along, off = force(square(1.0), Contact(0, turn(math.asin(0.6)), 0.0, 0.0, 0.0, 0.0))
    assert along / 4 == pytest.approx(7 / 25, rel=1e-14)
    assert off / 4 == pytest.approx(4 - 1 / 25, rel=1e-14)


def test_a_vertex_lets_go_when_it_would_have_to_be_pulled() -> None:
    # omega^2 H over kappa = 4: the vertex rises by itself. On its corner, upright, H = sqrt 2.
    fast, slow = (Contact(0, turn(math.pi / 4), 0.0, rate, 0.0, 0.0) for rate in (1.69, 1.68))
    assert gives_way(square(1.0), 1.0, fast)[1] == OFF  # 1.69^2 sqrt 2 = 4.04
    assert gives_way(square(1.0), 1.0, slow)[1] == ON  # 3.99


def test_it_slips_where_the_cone_ends() -> None:
    # Falling from rest near the top about a corner, T/N as above: mu = 1/10 is passed at once off the top.
    start = Contact(0, turn(math.pi / 4 - 1e-3), 0.0, 0.0, 0.0, 0.0)
    at, slips = lets_go(square(0.1), 0.1, start)
    assert slips
    along, off = force(square(0.1), at)
    assert abs(along) == pytest.approx(0.1 * off, rel=1e-10)
    # a bullet-proof hold does not
    assert not lets_go(square(5.0), 5.0, start)[1]


@pytest.mark.sweep
def test_throws_end_where_an_independent_simulation_sees_them_end() -> None:
    names = ("landing", "pivot")
    assert [case for case in cases(60, 6) if not agree(case, names)] == []
