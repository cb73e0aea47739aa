"""Throws whose speed deviates: where they land, how that changes with place and speed, and where they flip.

docs/certificates.md, "Probabilities", numbers 18 (landings) and 19 (the border).  The speed w (1 + delta) has kappa =
kappa_0/(1 + delta)^2.  The impact angle p of a start x solves x = P(p), P(p) = kappa p/2 + S(p), and a jog ends at
T = x + D(p); with kappa > ell there is one solution, which rises with x and with delta.
"""

from typing import NamedTuple

import numpy as np
from flint import arb

from .balls import HALF, ONE, ZERO, Arb, Array, Rising, sine_cosine
from .model import (
    FULL_TURN,
    SLACKS,
    at_angle,
    deciding,
    flight,
    guess_root,
    over_angles,
    rise_of_jog,
)
from .scene import Side

NEWTON = 60
SMALL_ANGLE = 1e-4  # up to here moments by one term and a bound: the closed forms cancel


class Hit(NamedTuple):
    """A throw from one place at one speed: a bracket of the angle, and where a jog ends."""

    before: Arb
    after: Arb
    place: Arb


class Slopes(NamedTuple):
    """Derivatives of T by x and delta, and of the angle by x and kappa, over a box."""

    x: Arb
    d: Arb
    xx: Arb
    xd: Arb
    dd: Arb
    phi_x: Arb
    phi_k: Arb


def kappa_at(kappa: Arb, delta: Arb) -> Arb:
    """Return kappa of throws whose speed deviates."""
    return kappa / (1 + delta) ** 2


def guess_angles(s: Side, x: Array, kappa: Array) -> Array:
    """Guess impact angles by Newton's method in floats, from beyond the root; no proof rests on it."""
    a, d, small, _ = s.floats
    if not s.exact:
        return 2.0 * (x - a) / (kappa - small)
    phi = 2.0 * (x + a + d) / kappa
    with np.errstate(all="ignore"):
        for _ in range(NEWTON):
            sin, cos = np.sin(phi), np.cos(phi)
            half = np.sin(0.5 * phi)
            f = (x - 0.5 * kappa * phi) * phi + 2.0 * d * half * half - a * sin
            step = f / (x - a * cos + d * sin - kappa * phi)
            phi = phi - step
            if bool((np.abs(step) < 1e-15 * phi).all()):
                break
    return phi


def guess_angle(s: Side, x: float, kappa: float) -> float:
    """Guess one impact angle."""
    return guess_root(s.floats, s.exact, x, kappa, 2.0 * (x + float(s.ell.mid())) / kappa)


def land(s: Side, x: Arb, kappa: Arb, guess: float) -> Hit | None:
    """Enclose a throw, kappa > ell being known; None where the guess is none.

    Next to the joint a guess in floats loses its digits, and the angle is nearly proportional to the distance.
    """
    near = float((2 * (x - s.a) / (kappa - (s.d if s.exact else s.small_d))).mid())
    for angle in (guess, near):
        for slack in SLACKS:
            if not 0.0 < angle * (1 + slack) < FULL_TURN:
                break
            before, after = arb(angle * (1 - slack)), arb(angle * (1 + slack))
            if flight(x, kappa, at_angle(s, before)) > 0 and flight(x, kappa, at_angle(s, after)) < 0:
                return Hit(before, after, x + advance_over(s, before.union(after)))
    return None


def advance_over(s: Side, phi: Arb) -> Arb:
    """Enclose D over angles, by the mean value theorem."""
    middle = phi.mid()
    sin, cos = sine_cosine(phi)
    return at_angle(s, middle).D + rise_of_jog(s, sin, cos) * (phi - middle)


def moments(p: Arb) -> tuple[Arb, Arb, Arb, Arb]:
    """Enclose c_1, s_1, c_2, s_2 over angles p from 0: the integrals of t^k cos(p t) and t^k sin(p t), 0 < t < 1.

    c_k' = -s_(k+1) and s_k' = c_(k+1), none above 1/(k + 2) in size.
    """
    middle = p.mid()
    off = p - middle
    if middle > SMALL_ANGLE:
        sin, cos = middle.sin_cos()
        q, r = ONE / middle, ONE / middle**2
        c1, s1 = sin * q - (1 - cos) * r, sin * r - cos * q
        c2, s2 = sin * q - 2 * s1 * q, 2 * c1 * q - cos * q
    else:
        c1, s1, c2, s2 = HALF, ZERO, ONE / 3, ZERO
        off = p
    third, quarter = (ONE / 3).union(-ONE / 3), (ONE / 4).union(-ONE / 4)
    return c1 + third * off, s1 + third * off, c2 + quarter * off, s2 + quarter * off


def slopes_over(s: Side, phi: Arb, kappa: Arb, factor: Arb) -> Slopes:
    """Enclose the derivatives over a box of angles and speeds, kappa and factor = 1 + delta told apart."""
    if s.exact:
        c1, s1, c2, s2 = moments(phi)
        sin, cos = sine_cosine(phi)
        steep, bend = HALF * kappa - s.a * s1 - s.d * c1, s.d * s2 - s.a * c2
        rate, turn = rise_of_jog(s, sin, cos), s.a * cos - s.d * sin
    else:
        steep, bend, rate, turn = HALF * (kappa - s.small_d), ZERO, -s.h, ZERO
    one = 1 / steep if steep > 0 else arb("nan")
    phi_k = -HALF * phi * one
    mixed = bend * phi_k + HALF
    phi_xx, phi_xk = -bend * one**3, -mixed * one**2
    phi_kk = (HALF * phi * mixed * one - HALF * phi_k) * one
    by_d, by_dd = -2 * kappa / factor, 6 * kappa / factor**2
    return Slopes(
        1 + rate * one,
        rate * phi_k * by_d,
        turn * one**2 + rate * phi_xx,
        xd=(turn * one * phi_k + rate * phi_xk) * by_d,
        dd=(turn * phi_k**2 + rate * phi_kk) * by_d**2 + rate * phi_k * by_dd,
        phi_x=one,
        phi_k=phi_k,
    )


def deciding_slopes(s: Side, phi: Arb, x: Arb, kappa: Arb, factor: Arb) -> tuple[Arb, Arb]:
    """Enclose the derivatives of `deciding` by x and delta over a box; nan where it does not decide."""
    if s.exact and not s.signed:
        sin, cos = sine_cosine(phi)
        if not s.a * cos - s.d * sin > 0:  # past the vertex every part flips
            return arb("nan"), arb("nan")
    unit = [[ONE if j == k else ZERO for j in range(3)] for k in range(3)]
    decision = deciding(s, Rising(phi, unit[0]), Rising(x, unit[1]), Rising(kappa, unit[2]))
    by_phi, by_x, by_kappa = decision.by
    along = slopes_over(s, phi, kappa, factor)
    return by_x + by_phi * along.phi_x, (by_kappa + by_phi * along.phi_k) * (-2 * kappa / factor)


def decides(
    s: Side, x: tuple[float, float], kappa: Arb, deviations: tuple[Arb, Arb], hits: tuple[Hit, Hit]
) -> int:
    """Decide for all starts in x and all deviations from one to another: 0 jog, 1 flip, 2 not settled.

    `hits`: the first and the last throw of the box.
    """
    box, every = arb(x[0]).union(arb(x[1])), deviations[0].union(deviations[1])
    whole, phi = kappa_at(kappa, every), hits[0].before.union(hits[1].after)
    branch = int(over_angles(s, phi, box, whole)[0])
    if branch != 2:
        return branch
    middle, at_speed = arb(0.5 * (x[0] + x[1])), every.mid()
    by_x, by_d = deciding_slopes(s, phi, box, whole, 1 + every)
    at = decided_at(s, float(middle), kappa, at_speed)
    reach = abs(by_x) * abs(box - middle) + abs(by_d) * abs(every - at_speed)
    if at - reach > 0 or at + reach < 0:
        return 1 if at > 0 else 0
    if not ((by_x > 0 or by_x < 0) and (by_d > 0 or by_d < 0 or deviations[0] == deviations[1])):
        return 2
    # it rises or falls with both: its least and its largest value are at corners
    corner = (int(bool(by_x < 0)), int(bool(by_d < 0)))
    least = decided_at(s, x[corner[0]], kappa, deviations[corner[1]])
    largest = decided_at(s, x[1 - corner[0]], kappa, deviations[1 - corner[1]])
    return 1 if least > 0 else 0 if largest < 0 else 2


def decided_at(s: Side, x: float, kappa: Arb, delta: Arb) -> Arb:
    """Enclose `deciding` of one throw; nan where the throw is not enclosed."""
    k = kappa_at(kappa, delta)
    hit = land(s, arb(x), k, guess_angle(s, x, float(k.mid())))
    return arb("nan") if hit is None else deciding(s, hit.before.union(hit.after), arb(x), k)


def guess_border(s: Side, x: Array, kappa: float, most: float, rises: Array) -> Array:
    """Guess by bisection the deviations at which throws from some places change their branch, an end if none does."""
    lo, hi = np.full(x.shape, -most), np.full(x.shape, most)
    for _ in range(50):
        middle = 0.5 * (lo + hi)
        k = kappa / (1.0 + middle) ** 2
        phi = guess_angles(s, x, k)
        up = (deciding_floats(s, phi, x, k) > 0.0) == rises
        hi, lo = np.where(up, middle, hi), np.where(up, lo, middle)
    border = 0.5 * (lo + hi)
    near = 1e-12 * most
    return np.where(border > most - near, most, np.where(border < near - most, -most, border))


def deciding_floats(s: Side, phi: Array, x: Array, kappa: Array) -> Array:
    """Evaluate `deciding` in floats; no proof rests on it."""
    a, d, h, rho2, ell = (float(ball.mid()) for ball in (s.a, s.d, s.h, s.rho2, s.ell))
    if s.exact:
        sin, cos = np.sin(phi), np.cos(phi)
        X, H = a * cos - d * sin, a * sin + d * cos
        spin = rho2 + X * (x - kappa * phi) + H * (h + d)
        V = kappa * (ell - H) * (np.sign(X) if s.signed else 1.0)
    else:
        spin = rho2 - a * x + 2.0 * a * a + d * d + d * h
        V = kappa * (ell - d) - 2.0 * a * (x - a)
    size = np.abs(spin) if s.signed else spin
    return np.asarray(spin * size * float(s.over_2m.mid()) - V)
