"""Bounce, pivot and drive against closed forms."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import limitsets as ls
from limitsets.feeder.scene import Scene
from limitsets.feeder.thrower import throw_map
from limitsets.feeder.thrower.contact import force, gives_way, lets_go, next_contact
from limitsets.feeder.thrower.effects.bounce import Bounce, struck
from limitsets.feeder.thrower.effects.drive import all_the_way
from limitsets.feeder.thrower.effects.landing import Landing, first_arrival
from limitsets.feeder.thrower.effects.slip import Slip
from limitsets.feeder.thrower.flight import turn
from limitsets.feeder.thrower.full import gather_full, with_effects
from limitsets.feeder.thrower.motion import OFF, ON, Arrival, Contact, FullSide, above, right_of
from limitsets.numbers.jit import entry_of, kernel
from limitsets.systems.maps import codes, images
from tests.kept import kept
from tests.thrower.effects.test_slip import square
from tests.thrower.effects.throws import agree, cases, same_end

# ----------------------------------------------------------------
# Restitution: heights and times of a bouncing part, energy, limits, and an independent simulation.


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


def test_bounces_below_the_threshold_are_plastic() -> None:
    for case in cases(30, 10, bounce_threshold=1e6):
        assert same_end(case.mapped(("landing", "bounce")), case.mapped(("landing",)))


def test_bounces_without_end_are_outside_the_model() -> None:
    case = cases(1, 11, restitution=1.0, bounce_threshold=1e-9)[0]
    assert case.mapped(("landing", "bounce")) is None


@pytest.mark.sweep
@pytest.mark.parametrize(
    ("names", "seed"),
    [
        (("landing", "bounce"), 12),
        (("landing", "pivot"), 6),
        (("landing", "slip"), 3),
        (("landing", "roll", "slip"), 3),
        (("landing", "roll", "slip", "pivot", "bounce"), 13),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, tuple) else "",
)
def test_throws_end_where_an_independent_simulation_sees_them_end(names: tuple[str, ...], seed: int) -> None:
    assert [case for case in cases(30, seed) if not agree(case, names)] == []


# ----------------------------------------------------------------
# A vertex that only friction and weight hold: the hinge where that suffices, and an independent simulation.


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


# ----------------------------------------------------------------
# The effect `drive` against the same throw followed in the frame of the room, and against forces sampled densely.


DESIGNED = ls.load("paper-designed")


def scene(stroke: float, friction: float | None = None, **changes: str) -> Scene:
    tree = DESIGNED.with_values(changes).as_dict() if changes else DESIGNED.as_dict()
    tree["effects"] = {"drive": True}
    tree["world"] = {"stroke": f"{stroke!r} rad"} | ({} if friction is None else {"friction": friction})
    return ls.load(tree)


def in_the_room(case: Scene, stroke: float, x: float, side: int) -> tuple[float, int]:
    """One throw in the frame of the room: the arm stands still at the angle `stroke`, gravity points down.

    Everything by vectors from the joint; the landing by a root finder, the pivot by the law of energy.
    """
    a, d = case.sides.a[side], case.sides.d[side]
    h, kappa, rho2 = case.surface_height, case.kappa, case.radius_of_gyration**2

    def turn(vector: tuple[float, float], angle: Any) -> np.ndarray:
        c, s = np.cos(angle), np.sin(angle)
        return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])

    along, across = turn((1.0, 0.0), stroke), turn((0.0, 1.0), stroke)
    start = turn((x, h + d), stroke)
    velocity = turn((-(h + d), x), stroke)  # omega = 1 about the joint

    def centre(phi: Any) -> np.ndarray:
        fallen = 0.5 * kappa * phi * phi
        return np.array([start[0] + velocity[0] * phi, start[1] + velocity[1] * phi - fallen])

    def vertex(phi: Any) -> np.ndarray:
        return centre(phi) + turn((-a, -d), stroke + phi)

    # the left vertex over the arm's surface, which is h from the joint
    grid = np.linspace(1e-3, 2 * math.pi, 20001)
    height = across @ vertex(grid) - h
    first = int(np.flatnonzero((height[:-1] > 0) & (height[1:] <= 0))[0])
    phi = brentq(lambda t: across @ vertex(t) - h, grid[first], grid[first + 1], xtol=1e-15)

    v = velocity + np.array([0.0, -kappa * phi])
    arm = centre(phi) - vertex(phi)  # from the vertex to the centre of mass
    inertia = rho2 + arm @ arm
    omega = (rho2 + arm[0] * v[1] - arm[1] * v[0]) / inertia
    kinetic = 0.5 * inertia * omega**2
    to_top = kappa * (math.sqrt(arm @ arm) - arm[1])
    flips = omega > 0 and kinetic > to_top if arm[0] > 0 else not (omega < 0 and kinetic >= to_top)
    place = float(vertex(phi) @ along)
    if not flips:
        return place + a, side
    after = (side + 1) % len(case.sides)
    return place - case.sides.right[after], after


@pytest.mark.parametrize("stroke", [0.02, 0.1, 0.25])
def test_is_the_throw_as_seen_from_the_room(stroke: float) -> None:
    case = scene(stroke)
    random = np.random.default_rng(5)
    for side in range(3):
        x = random.uniform(case.sides.a[side] + 2.0, 26.0, 40)
        found = images(case.map, x, side)
        seen = found.code != codes.OUTSIDE_MODEL
        assert seen.sum() > 10
        for k in np.flatnonzero(seen):
            place, lies = in_the_room(case, stroke, float(x[k]), side)
            assert found.side[k] == lies
            assert found.x[k] == pytest.approx(place, abs=1e-11)


@pytest.mark.parametrize(("stroke", "friction"), [(0.002, None), (0.4, 0.3)])
def test_the_stroke_needs_a_force_that_pushes_within_the_side_and_within_friction(
    stroke: float, friction: float | None
) -> None:
    """Force and its place from Newton's laws in the room's frame, at 4001 angles of the stroke."""
    case = scene(stroke, friction)
    h, kappa, rho2 = case.surface_height, case.kappa, case.radius_of_gyration**2
    theta = np.linspace(0.0, stroke, 4001)
    acceleration, rate2 = 0.5 / stroke, theta / stroke
    answers = set()
    for side in range(3):
        a, d, right = case.sides.a[side], case.sides.d[side], case.sides.right[side]
        for x in np.linspace(a + 0.1, 27.9, 60):
            height = h + d
            along = -acceleration * height - rate2 * x + kappa * np.sin(theta)
            force = np.array([along, acceleration * x - rate2 * height + kappa * np.cos(theta)])
            # the moment about the centre of mass turns the part: c N + d T = rho^2 alpha
            place = (rho2 * acceleration - d * force[0]) / force[1]
            room = np.minimum.reduce([force[1], right - place, place + a])
            if friction is not None:
                room = np.minimum(room, friction * force[1] - np.abs(force[0]))
            if abs(room.min()) < 1e-3:
                continue
            holds = bool(room.min() > 0)
            code = int(images(case.map, [x], side).code[0])
            leans = friction is not None and math.tan(stroke) > friction
            if holds and not leans and code == codes.OUTSIDE_MODEL:
                # the part flew, but lies nowhere: the side it came down on leans over too far
                assert any(math.tan(stroke) > case.sides.a[s] / case.sides.d[s] for s in range(3))
                continue
            assert (code != codes.OUTSIDE_MODEL) == (holds and not leans)
            answers.add(holds)
    assert answers == {True, False}


def test_the_least_value_is_found_inside_the_stroke() -> None:
    random = np.random.default_rng(11)
    theta = np.linspace(0.0, 1.5, 20001)
    seen = set()
    for _ in range(300):
        stroke = random.uniform(0.05, 1.5)
        a, b, c, d = random.normal(size=4)
        at = theta[theta <= stroke]
        least = (a + b * at + c * np.sin(at) + d * np.cos(at)).min()
        if abs(least) > 1e-6:
            assert all_the_way(stroke, a, b, c, d) == (least > 0)
            seen.add(bool(least > 0))
    assert seen == {True, False}


@kept
@kernel(entry=True)
def arrivals(params: Any, x: np.ndarray, side: int, out: np.ndarray) -> None:
    part = gather_full(params, side)
    for k in range(x.size):
        hit, _ = first_arrival(entry_of(part.effects, Landing), part, x[k])
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = hit.shift, hit.vx, hit.vy, hit.omega
        out[k, 4], out[k, 5] = right_of(part, hit.vertex, hit.psi), above(part, hit.vertex, hit.psi)


@pytest.mark.parametrize("stroke", [0.02, 0.3])
def test_the_flight_keeps_its_energy(stroke: float) -> None:
    """Of the vertical in the room, which leans over the arm by the stroke; to 1e-12 of what was thrown."""
    case = scene(stroke)
    for side in range(3):
        a, d = case.sides.a[side], case.sides.d[side]
        x = np.random.default_rng(8).uniform(a + 0.5, 27.0, 200)
        out = np.empty((x.size, 6))
        arrivals(case.map, x, side, out)
        shift, vx, vy, omega, right, high = out.T
        moved = shift - a + right  # along the arm, from where it was thrown
        fallen = (d - high) * math.cos(stroke) - moved * math.sin(stroke)
        rho2, height = case.radius_of_gyration**2, case.surface_height + d
        before = 0.5 * (height**2 + x**2 + rho2)
        after = 0.5 * (vx**2 + vy**2 + rho2 * omega**2) - case.kappa * fallen
        assert after == pytest.approx(before, rel=1e-12)


def test_by_hand() -> None:
    """Gravity along the arm takes (kappa/2) sin s phi^2 from a jog and leaves kappa cos s across."""
    stroke = 0.1
    case = scene(stroke)
    # the same flight in the minimal model with kappa cos s
    across = DESIGNED.with_values({"throw.kappa": DESIGNED.kappa * math.cos(stroke)})
    from limitsets.feeder.thrower import trace

    plain, leaning = trace(across.map, 12.0, 2), trace(case.map, 12.0, 2)
    assert leaning.phi[0] == pytest.approx(plain.phi[0], rel=1e-13)
    lost = 0.5 * DESIGNED.kappa * math.sin(stroke) * plain.phi[0] ** 2
    assert leaning.displacement[0] == pytest.approx(plain.displacement[0] - lost, rel=1e-12)
