"""The bounds of `turn_box`, proved in exact rationals; and both versions of `turn` against mpmath."""

import math
from fractions import Fraction

import mpmath
import numpy as np

from limitsets.feeder.thrower import flight_box as boxes
from limitsets.feeder.thrower.flight import V0, V1, V2, V3, V4, V5, V6, V7, W0, W1, W2, W3, W4, W5, W6, W7
from limitsets.numbers.interval import Interval

U = Fraction(1, 2**53)
W = [Fraction(c) for c in (W0, W1, W2, W3, W4, W5, W6, W7)]
V = [Fraction(c) for c in (V0, V1, V2, V3, V4, V5, V6, V7)]
# t = phi/8 is exact; pi < 355/113 bounds it.
T = Fraction(355, 113) / 4
Q = T * T


def series_relative_error(coefficients, shift):
    """Relative error of the computed t^p (c0 + q c1 + ...) against the function, for 0 <= t <= T.

    The sum is at least c0 - |c1| Q; rounding is followed through Horner's scheme term by term.
    """
    exact = [Fraction((-1) ** k, math.factorial(2 * k + shift)) for k in range(len(coefficients))]
    size, error = abs(coefficients[-1]), Fraction(0)
    for c in reversed(coefficients[:-1]):
        error = error * Q * (1 + U) ** 2 + 3 * U * size * Q  # q known to u, product rounded
        size = size * Q * (1 + 3 * U) + abs(c)
        error = error * (1 + U) + U * size
    truncated = Q ** len(exact) / math.factorial(2 * len(exact) + shift)
    coefficient = sum(abs(c - x) * Q**k for k, (c, x) in enumerate(zip(coefficients, exact, strict=True)))
    smallest = exact[0] - abs(exact[1]) * Q
    relative = (error + truncated + coefficient) / smallest
    return (1 + relative) * (1 + U) ** 4 - 1  # the powers of t in front: q and up to three products


def doubled(angle, ew, ev, es):
    """Errors after one doubling, from angles up to `angle` <= pi.

    |error of s| <= es phi, |error of v| <= ev phi^2/2, |error of w| <= ew w.  With s <= phi and v <= phi^2/2:
    w' = 2 (w + s v) >= 2 w, and phi v <= 3 w, phi^3/2 <= 5 w for phi <= pi (both ratios are monotone; at pi 2, 4.94);
    v' = 2 s^2 against phi'^2/2 = 2 phi^2;  s' = 2 s (1 - v), |1 - v| <= 1, against phi' = 2 phi.
    """
    new_w = (1 + ew + 3 * es + 5 * ev + 5 * es * ev) * (1 + U) ** 2 - 1
    new_v = (1 + es) ** 2 * (1 + U) - 1
    absolute_v = ev * angle * angle / 2
    new_s = (1 + es) * (1 + absolute_v + U * (1 + absolute_v)) * (1 + U) - 1
    return new_w, new_v, new_s


def test_the_bound():
    ew = series_relative_error(W, 3)
    ev = series_relative_error(V, 2)
    es = ew * Q / 6 * 2 + U  # s = t - w, w <= t Q / 6
    angle = T
    for _ in range(3):
        ew, ev, es = doubled(angle, ew, ev, es)
        angle *= 2
    # s -+ BOUND phi, and so on: a product or two and a sum round, by U of phi, of phi^2 and of w at most, and the
    # results are clipped to what they may be.
    assert ew + 4 * U < Fraction(boxes.BOUND)
    assert es + 4 * U < Fraction(boxes.BOUND)
    assert ev / 2 + 4 * U < Fraction(boxes.BOUND)
    assert angle >= 2 * Fraction(math.pi)
    assert math.pi**3 / 2 < 5 * math.pi


def test_enclosures_hold_against_mpmath():
    rng = np.random.default_rng(3)
    angles = np.concatenate([rng.uniform(0, 2 * np.pi, 1500), 10.0 ** rng.uniform(-200, 0.7, 1500)])
    angles = np.concatenate([angles, np.arange(0, 9) * np.pi / 4])
    with mpmath.workdps(450):
        for phi in angles[angles <= 2 * np.pi].tolist():
            p = mpmath.mpf(phi)
            exact = (mpmath.sin(p), 1 - mpmath.cos(p), p - mpmath.sin(p))
            for box, value in zip(boxes.turn_point(phi)[1:], exact, strict=True):
                assert box.lo <= value <= box.hi


def test_boxes_hold_their_points_and_their_extremes():
    rng = np.random.default_rng(4)
    for lo, hi in np.sort(rng.uniform(0, 2 * np.pi, (500, 2)), axis=1).tolist():
        _, s, v, w = boxes.turn_box(Interval(lo, hi))
        for phi in np.linspace(lo, hi, 7):
            assert s.lo <= math.sin(phi) + 1e-15
            assert math.sin(phi) - 1e-15 <= s.hi
            assert v.lo <= 1 - math.cos(phi) + 1e-15
            assert 1 - math.cos(phi) - 1e-15 <= v.hi
            assert w.lo <= phi - math.sin(phi) + 1e-15
            assert phi - math.sin(phi) - 1e-15 <= w.hi
