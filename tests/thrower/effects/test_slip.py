"""Slip and spread."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

import limitsets as ls
from limitsets.feeder.scene import Scene
from limitsets.feeder.thrower import throw_map, trace
from limitsets.feeder.thrower.contact import slide_on
from limitsets.feeder.thrower.effects.bounce import Bounce, struck
from limitsets.feeder.thrower.effects.slip import Slip
from limitsets.feeder.thrower.effects.spread import Spread
from limitsets.feeder.thrower.flight import Turned, turn
from limitsets.feeder.thrower.full import gather_full, with_effects
from limitsets.feeder.thrower.motion import LOST, Arrival, Contact, Face, FullSide, above, moved, right_of
from limitsets.numbers.jit import entry_of, kernel
from limitsets.systems.maps import advance, codes, images, orbit
from limitsets.systems.maps.drivers import normal_pair, philox, uniform_pair
from tests.kept import kept
from tests.thrower.effects.routh import routh
from tests.thrower.effects.throws import cases

# ----------------------------------------------------------------
# Friction of finite strength at impacts: limits, worked numbers, and an independent simulation.


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


@dataclass(frozen=True)
class Meeting:
    """A vertex of a random part at the arm, and friction around |B|/A."""

    part: FullSide
    vertex: int
    psi: Turned
    mu: float

    @property
    def arms(self) -> tuple[float, float]:
        return right_of(self.part, self.vertex, self.psi), above(self.part, self.vertex, self.psi)

    @property
    def lever(self) -> np.ndarray:
        """Velocity of the vertex = lever @ rates."""
        right, high = self.arms
        return np.array([[1.0, 0.0, high], [0.0, 1.0, -right]])

    @property
    def gain(self) -> np.ndarray:
        """Change of the rates by an impulse at the vertex."""
        return np.diag([1.0, 1.0, 1.0 / self.part.own.rho2]) @ self.lever.T

    def struck(self, rates: np.ndarray, mu: float, restitution: float = 0.0) -> np.ndarray:
        """Rates after an impact, by the kernels."""
        hit = Arrival(self.vertex, self.psi, 0.0, *rates)
        after = struck(Bounce(restitution, 0.0), Slip(mu), self.part, hit)
        right, high = self.arms
        return np.array([after.slide - after.omega * high, after.lift + after.omega * right, after.omega])


def meetings(count: int, seed: int) -> list[Meeting]:
    """Random contacts; half of them have |B| > mu A."""
    rng, found = np.random.default_rng(seed), []
    for case in cases(count, seed):
        part = gather_full(case.full(("slip", "bounce")), 0)
        vertex = int(rng.integers(part.a.size))
        at = Meeting(part, vertex, turn(float(rng.uniform(0.0, part.corner[vertex]))), 0.0)
        compliance = at.lever @ at.gain
        mu = float(rng.uniform(0.5, 1.5)) * abs(compliance[0, 1]) / compliance[0, 0]
        found.append(Meeting(part, vertex, at.psi, mu))
    return found


def test_an_impulse_in_the_cone_does_not_stick_where_the_path_slides_back() -> None:
    # As above, A = 50, B = -7, C = 2 and mu = 1/10 < |B|/A, but sliding right at 2.5: the impulse that stops it,
    # J_n = (1 - 7 * 2.5/50)/(2 - 49/50) = 0.65/1.02 = 0.637 and J_t = (7 J_n - 2.5)/50 = 0.039, lies in the cone.
    part, psi = square(0.1, rho=0.2), turn(math.asin(0.6))
    after = struck(None, Slip(0.1), part, Arrival(0, psi, 0.0, 2.5, -1.0, 0.0))
    # slides right until 2.5 = 12 J: J = 5/24, v_n = -1 + 2.7 * 5/24 = -0.4375; then left by 2 for 0.4375/1.3
    assert after.slide == pytest.approx(-2 * 0.4375 / 1.3, rel=1e-12)


@pytest.mark.sweep
@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
def test_impacts_are_those_of_the_integrated_law(restitution: float) -> None:
    back, gained = 0, []
    rng = np.random.default_rng(40)
    for at in meetings(60, 40):
        right, high = at.arms
        for _ in range(6):
            # of what stops it the vertex needs some impulse near the cone, either way
            need = np.array([float(rng.uniform(-2.0, 2.0)) * at.mu, 1.0])
            rates = -at.gain @ need + np.array([-high, right, 1.0]) * rng.normal()
            if (at.lever @ rates)[1] >= 0.0:
                continue
            after = at.struck(rates, at.mu, restitution)
            wanted, push = routh(at.gain, at.lever, rates, at.mu)
            wanted, _ = routh(at.gain, at.lever, wanted, at.mu, restitution * push)
            np.testing.assert_allclose(after, wanted, rtol=0, atol=1e-11 * np.abs(rates).max())
            masses = np.array([1.0, 1.0, at.part.own.rho2])
            gained.append(masses @ (after**2 - rates**2) / (masses @ rates**2))
            # sliding back although the impulse that stops it is in the cone
            back += abs(need[0]) < at.mu and abs((at.lever @ wanted)[0]) > 1e-9 and restitution == 0.0
    assert max(gained) <= 1e-13
    assert min(gained) < -0.1
    assert back > 10 or restitution > 0.0


@pytest.mark.sweep
def test_enough_friction_is_that_to_stick_and_not_to_slide_back() -> None:
    """The bare map's impact from the larger of |J_t|/J_n and |B|/A on, and not before."""
    rng, second = np.random.default_rng(43), 0
    for at in meetings(60, 43):
        compliance = at.lever @ at.gain
        need, turned = float(rng.uniform(-1.0, 1.0)), abs(compliance[0, 1]) / compliance[0, 0]
        right, high = at.arms
        # turning about the vertex by 1 when it has stopped
        rates = np.array([-high, right, 1.0]) - at.gain @ (need, 1.0)
        if (at.lever @ rates)[1] >= 0.0:
            continue
        hit, enough = Arrival(at.vertex, at.psi, 0.0, *rates), max(abs(need), turned)
        second += turned > abs(need)
        for mu in (enough * (1 + 1e-9), 1e9):
            after = struck(None, Slip(mu), at.part, hit)
            assert (after.slide, after.omega) == (0.0, pytest.approx(1.0, rel=1e-13))
        assert abs(struck(None, Slip(enough * (1 - 1e-6)), at.part, hit).slide) > 1e-9
    assert 10 < second < 50


def test_where_the_stop_would_pull_endless_friction_lets_it_slide_on() -> None:
    """An impulse along the arm alone, J_t = -v_n/B, stops the approach first: v_t goes on, as v_t - v_n A/B."""
    rng = np.random.default_rng(44)
    for at in meetings(60, 44):
        (a, b), (_, c) = at.lever @ at.gain
        # an approach, B J_t > C, and J_n = -1
        rates = -at.gain @ (float(rng.uniform(1.1, 3.0)) * c / b, -1.0)
        along, off = at.lever @ rates
        assert off < 0.0
        for mu in (1e6, 1e9):
            slide, lift = at.lever @ at.struck(rates, mu)
            assert slide == pytest.approx(
                along - off * a / b, rel=1e2 / mu * max(1.0, c / abs(b), a / abs(b))
            )
            assert abs(lift) < 1e-12
            assert slide * along > 0.0


def test_without_friction_the_horizontal_velocity_stays_and_nothing_rests() -> None:
    for case in cases(20, 1, friction=0.0):
        part = gather_full(case.full(("landing", "slip")), case.side)
        hit = Arrival(case.side, turn(0.3 * part.own.corner), 0.0, -0.7, -2.0, 1.0)
        after = struck(None, entry_of(part.effects, Slip), part, hit)
        high = part.own.a * hit.psi.sin + part.own.d * (1.0 - hit.psi.versin)
        assert after.slide - after.omega * high == pytest.approx(hit.vx, rel=1e-12)
        assert case.mapped(("landing", "slip")) is None


@kernel(entry=True)
def slid(slip: Slip, shift: float, part: FullSide, face: Face) -> float:
    """As a throw does it: compiled, where a division by 0 is infinite."""
    return moved(slip, shift, part, face)


def test_the_rest_slides_on_by_its_braking_distance() -> None:
    part = square(0.5)
    # speed 2, braked by mu kappa = 2: 2^2/(2 * 2) = 1, either way
    assert slid(Slip(0.5), 0.0, part, Face(0, 0.0, 0, 0.0, 2.0)) == pytest.approx(1.0, rel=1e-15)
    assert slid(Slip(0.5), 0.0, part, Face(0, 0.0, 0, 0.0, -2.0)) == pytest.approx(-1.0, rel=1e-15)
    # turning down about its left end by 1, xdot = d = 1 and J_n = a = 1: friction takes half of it
    assert slid(Slip(0.5), 0.0, part, Face(0, 0.0, 0, -1.0, 0.0)) == pytest.approx(0.25 / 4.0, rel=1e-14)
    assert slid(Slip(1.5), 0.0, part, Face(0, 0.0, 0, -1.0, 0.0)) == 0.0
    # with mu d beyond the leading end the part would tip over it; without friction it slides for ever
    assert math.isnan(slid(Slip(1.5), 0.0, part, Face(0, 0.0, 0, 0.0, 2.0)))
    assert math.isinf(slid(Slip(0.0), 0.0, part, Face(0, 0.0, 0, 0.0, 2.0)))


@pytest.mark.sweep
def test_painleves_paradox_is_outside_the_model() -> None:
    # sliding left with X = 1/5, H = 7/5 and rho^2 = 1/25: rho^2 + X^2 - mu X H = 0.08 - 0.28 mu
    psi = turn(math.asin(0.6))
    for mu, lost in ((0.28, False), (0.29, True)):
        _, ends = slide_on(square(mu, rho=0.2), mu, -1, Contact(0, psi, 0.0, 0.0, -1.0, 0.0))
        assert (ends == LOST) is lost


# ----------------------------------------------------------------
# The effect `spread`: what is drawn, that it depends on nothing else, and what a throw makes of it.


DESIGNED = ls.load("paper-designed")


def scene(word: str, speed: str | None = None, landing: str | None = None) -> Scene:
    tree = DESIGNED.as_dict()
    scatter = {name: text for name, text in (("speed", speed), ("landing", landing)) if text is not None}
    tree |= {"effects": {"spread": word}, "world": {"scatter": scatter}}
    return ls.load(tree)


@kept
@kernel(entry=True)
def words(seed: np.uint64, a: np.uint64, b: np.uint64) -> tuple[int, int, int, int]:
    return philox(seed, a, b)


@kept
@kernel(entry=True)
def pairs(normal: bool, n: int, out: np.ndarray) -> None:
    for k in range(n):
        out[k] = normal_pair(7, k, 3) if normal else uniform_pair(7, k, 3)


@pytest.mark.parametrize(
    ("seed", "a", "b", "expected"),
    [
        (0, 0, 0, "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
        (2**64 - 1, 2**64 - 1, 2**64 - 1, "408f276d 41c83b0e a20bc7c6 6d5451fd"),
        (0x299F31D0A4093822, 0x85A308D3243F6A88, 0x0370734413198A2E, "d16cfe09 94fdcceb 5001e420 24126ea1"),
    ],
)
def test_philox_gives_the_known_answers_of_its_authors(seed: int, a: int, b: int, expected: str) -> None:
    """Known answers for philox4x32-10 from the Random123 library (kat_vectors)."""
    found = words(np.uint64(seed), np.uint64(a), np.uint64(b))
    assert " ".join(f"{int(word):08x}" for word in found) == expected


def test_what_is_drawn_is_uniform_and_normal() -> None:
    drawn = np.empty((100_000, 2))
    pairs(False, len(drawn), drawn)
    assert drawn.min() > 0.0
    assert drawn.max() < 1.0
    for k in (0, 1):
        assert stats.kstest(drawn[:, k], "uniform").pvalue > 1e-3
    assert abs(np.corrcoef(drawn.T)[0, 1]) < 4 / np.sqrt(len(drawn))
    pairs(True, len(drawn), drawn)
    for k in (0, 1):
        assert stats.kstest(drawn[:, k], "norm").pvalue > 1e-3


def test_a_throw_uses_its_own_speed_and_its_own_shift() -> None:
    case = scene("bounded", speed="0.4 %", landing="0.05 in")
    path = orbit(case.map, 15.0, 2, 200)
    deviations = np.empty((200, 2))
    for k in range(200):
        w = words(np.uint64(0), np.uint64(0), np.uint64(k))
        first, second = (int(w[0]) << 32 | int(w[1])) >> 12, (int(w[2]) << 32 | int(w[3])) >> 12
        deviations[k] = 2 * (np.array([first, second]) + 0.5) / 2**52 - 1
    for k, (speed, landing) in enumerate(deviations):
        kappa = DESIGNED.kappa / (1 + 0.004 * speed) ** 2
        alone = images(DESIGNED.map._replace(kappa=kappa), [path.x[k]], int(path.side[k]))
        assert path.side[k + 1] == alone.side[0]
        assert path.x[k + 1] == pytest.approx(alone.x[0] + 0.05 * landing, abs=1e-12)


def test_batches_and_order_do_not_matter() -> None:
    case = scene("gaussian", speed="0.3 %", landing="0.02 in")
    starts = np.linspace(9.0, 23.0, 50)
    whole = advance(case.map, starts, 2, 300)[0]
    parts = [advance(case.map, starts[k : k + 10], 2, 300, first=k)[0] for k in range(0, 50, 10)]
    assert np.array_equal(whole, np.concatenate(parts))
    assert not np.array_equal(whole, advance(case.map, starts, 2, 300, first=1)[0])


def test_landing_places_scatter_as_stated() -> None:
    """Many starts at one place, one throw each: the spread of the landing place, to five standard errors."""
    case = scene("gaussian", landing="0.02 in")
    x, _, code, _ = advance(case.map, np.full(20_000, 12.0), 2, 1)
    alone = images(DESIGNED.map, [12.0], 2).x[0]
    assert (code == codes.JOG).all()
    assert x.mean() == pytest.approx(alone, abs=5 * 0.02 / np.sqrt(20_000))
    assert x.std() == pytest.approx(0.02, rel=5 / np.sqrt(2 * 20_000))


def test_a_scatter_in_degrees_per_second_is_one_in_percent() -> None:
    tree = DESIGNED.as_dict() | {
        "gravity": {"acceleration": "193.045 in/s^2"},
        "effects": {"spread": "bounded"},
    }
    speed = np.degrees(np.sqrt(193.045 / DESIGNED.kappa))
    tree["world"] = {"scatter": {"speed": f"{float(0.004 * speed)!r} deg/s"}}
    assert entry_of(ls.load(tree).map.effects, Spread).speed == pytest.approx(0.004, rel=1e-12)
    del tree["gravity"]
    with pytest.raises(ls.errors.SceneError, match="gravity"):
        _ = ls.load(tree).map


@pytest.mark.parametrize("word", ["bounded", "gaussian"])
def test_what_is_told_of_a_throw_is_that_of_the_throw_made(word: str) -> None:
    """On a side R' = R + displacement; a throw by w' turns the part by another angle than one by w."""
    scattered = trace(scene(word, "1 %", "0.05 in").map, 12.0, 2, 200)
    same = scattered.code == codes.JOG
    assert same.sum() > 50
    moved = np.diff(scattered.x)[same]
    assert np.allclose(scattered.displacement[same], moved, rtol=0, atol=1e-13)
    bare = trace(DESIGNED.map, 12.0, 2, 1)
    assert 1e-6 < abs(scattered.phi[0] - bare.phi[0]) < 0.05 * bare.phi[0]
