"""The model: every formula of a throw, in balls.

docs/certificates.md, "What it rests on", numbers 2 (landing) and 3 (decision), "The surface above the joint" for the
throw told by its impact angle, and number 10 for the slope.  `FORMULAS` are the words for what is computed here.
"""

import math
from typing import Any, NamedTuple

from flint import arb

from .balls import HALF, ONE, ZERO, Arb, Rising, signed_square, sine_cosine
from .scene import Side

FORMULAS = {
    "always": [
        "a, d, L: foot from the left vertex, height of the centre of mass, length of the side; rho: radius of gyration",
        "ell^2 = a^2 + d^2;  M = rho^2 + ell^2;  kappa = g/w^2;  h: height of the arm's surface above the joint",
    ],
    "exact": [
        "phi: smallest positive root of R phi - a sin(phi) + d (1 - cos(phi)) - (kappa/2) phi^2",
        "X = a cos(phi) - d sin(phi);  H = a sin(phi) + d cos(phi);  V = kappa (ell - H)",
        "om = (rho^2 + X (R - kappa phi) + H (h + d))/M;  K = (1/2) M om^2",
        "jog: R' = R - h phi + a (1 - cos phi) - d (phi - sin phi);  flip: R' = R'(jog) - a - (L' - a'), next side",
    ],
    "small": [
        "om = (rho^2 - a R + 2 a^2 + d^2 + d h)/M;  K = (1/2) M om^2;  V = kappa (ell - d) - 2 a (R - a)",
        "jog: R' = R - h phi;  flip: R' = R - h phi - a - (L' - a'), next side",
    ],
    "small-angle": ["phi = 2 (R - a)/kappa"],
    "small-angle-2": ["phi = 2 (R - a)/(kappa - d)"],
    "exact energy": ["flip if and only if K > V or X < 0"],
    "exact signed": ["flip if and only if sgn(om) K - sgn(X) V > 0"],
    "small energy": ["flip if and only if K > V"],
    "small signed": ["flip if and only if sgn(om) K - V > 0"],
}
FULL_TURN = 6.283185307179586  # a float below 2 pi


class Angle(NamedTuple):
    """An angle p with two functions of it alone: g, where f = (R - kappa p/2) p + g, and D = R'(jog) - R."""

    p: Arb
    g: Arb
    D: Arb


def at_angle(s: Side, p: Arb) -> Angle:
    """Evaluate the functions of the angle alone."""
    if s.exact:
        sin, cos = p.sin_cos()
        back = 1 - cos  # so that a and d, which may be wide, stand once each
        return Angle(p, s.d * back - s.a * sin, s.a * back - s.d * (p - sin) - s.h * p)
    return Angle(p, (HALF * s.small_d * p - s.a) * p, -s.h * p)


def flight(x: Arb, kappa: Arb, at: Angle) -> Arb:
    """Evaluate f at one angle; f is positive before the impact."""
    return (x - HALF * kappa * at.p) * at.p + at.g


def rise_of_jog(s: Side, sin: Arb, cos: Arb) -> Arb:
    """Evaluate D' at an angle with this sine and cosine."""
    return s.a * sin - s.d * (1 - cos) - s.h if s.exact else -s.h


def over_angles(s: Side, phi: Arb, R: Arb, kappa: Arb) -> tuple[int, Arb, Arb]:
    """Return over a box: the decision (0 jog, 1 flip, 2 not settled), D'(phi), and df/dphi."""
    if s.exact:
        sin, cos = sine_cosine(phi)
        H = s.a * sin + s.d * cos
        X = s.a * cos - s.d * sin
        fall = R - kappa * phi
        spin = s.rho2 + X * fall + H * s.hd  # M om
        return decide_exact(s, spin, X, H, kappa), rise_of_jog(s, sin, cos), fall - X
    spin = s.rho2 - s.a * R + 2 * s.a * s.a + s.d * s.d + s.d * s.h
    V = kappa * (s.ell - s.d) - 2 * s.a * (R - s.a)
    F = excess(s, spin, V)
    return (1 if F > 0 else 0 if F < 0 else 2), -s.h, R - s.a - (kappa - s.small_d) * phi


def excess(s: Side, spin: Any, V: Any) -> Any:
    """Return what is positive where the part flips: sgn(om) K - V in the signed criterion, else K - V."""
    return (signed_square(spin) if s.signed else spin * spin) * s.over_2m - V


def decide_exact(s: Side, spin: Arb, X: Arb, H: Arb, kappa: Arb) -> int:
    """Decide by the flip criterion of the exact model over a box.

    X^2 + H^2 = ell^2 gives ell - H = X^2/(ell + H).  The right-hand side is narrow where H > 0, the left-hand side next
    to H = -ell; both hold wherever they are defined.
    """
    F = excess(s, spin, kappa * barrier(s.ell, X, H, s.signed))
    if F > 0 or (X < 0 and not s.signed):
        return 1
    return 0 if F < 0 and (s.signed or X > 0) else 2


def barrier(ell: Any, X: Any, H: Any, signed: bool) -> Any:
    """Evaluate V/kappa = ell - H, with the sign of X in the signed criterion."""
    top, below_it = ell + H, ell - H
    if signed and not X > 0:
        below_it = -below_it if -X > 0 else None  # the sign is not known
    if not top > 0:
        return arb("nan") if below_it is None else below_it
    above_it = (signed_square(X) if signed else X * X) / top
    if below_it is None or H > 0 or isinstance(above_it, Rising):
        return above_it if below_it is None or H > 0 else below_it
    return above_it.intersection(below_it)


def deciding(s: Side, phi: Any, x: Any, kappa: Any) -> Any:
    """Evaluate the number that is positive where the part flips, in any arithmetic."""
    if s.exact:
        sin, cos = phi.sin_cos()
        X, H = cos * s.a - sin * s.d, sin * s.a + cos * s.d
        spin = s.rho2 + X * (x - kappa * phi) + H * s.hd
        # where X < 0 the criterion of energy flips, and the sum is positive
        V = kappa * barrier(s.ell, X, H, signed=True)
    else:
        spin = s.rho2 - s.a * x + 2 * s.a * s.a + s.d * s.d + s.d * s.h
        V = kappa * (s.ell - s.d) - 2 * s.a * (x - s.a)
    return excess(s, spin, V)


class Ratios(NamedTuple):
    """An angle p from 0 to a full turn, with sin(p)/p, V = (1 - cos p)/p^2 and W = (p - sin p)/p^3."""

    p: Arb
    sine: Arb
    V: Arb
    W: Arb


def ratios(p: Arb) -> Ratios:
    """Evaluate the ratios; W by two sums of 1/6 - p^2/120 + p^4/5040 - ..., which alternates and falls for p^2 < 42.

    Off 0 also by its definition, which is sharper at a single angle.
    """
    low, sine = ONE / 6 - p * p / 120, p.sinc()
    W = low.union(low + p**4 / 5040)
    if p > 0:
        W = W.intersection((1 - sine) / (p * p))
    return Ratios(p, sine, HALF * (HALF * p).sinc() ** 2, W)


def landing_at(s: Side, r: Ratios, kappa: Arb) -> Arb:
    """Evaluate R(p), the start whose f has the root p, for f = (R - R(p)) p."""
    return s.a * r.sine + r.p * (HALF * kappa - s.d * r.V)


def landing_slope(s: Side, r: Ratios, kappa: Arb) -> Arb:
    """Evaluate dR(p)/dp = kappa/2 - a (V - W) p - d (sin p/p - V)."""
    return HALF * kappa - s.a * (r.V - r.W) * r.p - s.d * (r.sine - r.V)


def landing_bend(s: Side, r: Ratios, cos: Arb) -> Arb:
    """Evaluate d2R(p)/dp2 = -a (sin p/p - 2 V + 2 W) - d (cos p - 2 sin p/p + 2 V)/p."""
    return -s.a * (r.sine - 2 * (r.V - r.W)) - s.d * (cos - 2 * (r.sine - r.V)) / r.p


def gain_at(a: Arb, d: Arb, h: Arb, r: Ratios) -> Arb:
    """Evaluate E(p) = (R' - R)/p of a jog; it rises with a and falls with d and h."""
    return a * r.p * r.V - d * (ONE - r.sine) - h


def gain_slope(a: Arb, d: Arb, r: Ratios) -> Arb:
    """Evaluate dE/dp."""
    return a * (r.sine - r.V) - d * (r.V - r.W) * r.p


def slope_over(s: Side, phi: Arb, kappa: Arb, rise: Arb, f_slope: Arb) -> Arb | None:
    """Enclose dR'/dR over a bracket of the angle; None where it is not proved that each R has one root in the bracket.

    f(p) = (R - R(p)) p gives dphi/dR = 1/R'(phi) where R(p) rises; there kappa, a and d stand once, and R does not.
    df/dphi < 0 gives dphi/dR = -phi/(df/dphi).
    """
    if not s.exact:
        return ONE - 2 * s.h / (kappa - s.small_d)
    steep = landing_slope(s, ratios(phi), kappa) if phi < 3 else ZERO
    wide, narrow = (ONE + rise / steep if steep > 0 else None), None
    if f_slope < 0:  # narrower where the box is small: the series for R(p) is cut off
        narrow = ONE - rise * phi / f_slope
    if wide is None or narrow is None:
        return narrow if wide is None else wide
    return wide.intersection(narrow)


def positive_until(s: Side, x: Arb, kappa: Arb, end: Angle) -> bool:
    """Prove f > 0 on (0, end].

    f(0) = 0 and f'(0) = x - a > 0.  Where f is strictly concave, f(end) > 0 is enough.  Otherwise a march: with
    m >= |f''|, f(t + u) >= f(t) + f'(t) u - m u^2/2, which is concave in u, so that two positive ends suffice.
    """
    if not (flight(x, kappa, end) > 0 and x > s.a):
        return False
    if s.concave:
        return True
    m = s.ell + kappa
    t = arb(float(((x - s.a) / m).lower()))  # f(u) >= u (x - a - m u/2) > 0 for u <= (x - a)/m; t is rounded
    if not x - s.a - HALF * m * t > 0:
        return False
    for _ in range(1000):
        if t >= end.p:
            return True
        sin, cos = t.sin_cos()
        f = flight(x, kappa, at_angle(s, t))
        slope = x - s.a * cos + s.d * sin - kappa * t
        f0, s0, m0 = float(f.mid()), float(slope.mid()), float(m.mid())
        if not f0 > 0:
            return False
        u = arb((s0 + math.sqrt(s0 * s0 + 2 * m0 * f0)) / m0 * (1 - 2.0**-20))
        if not (u > 0 and f > 0 and f + (slope - HALF * m * u) * u > 0):
            return False
        t = arb(math.nextafter(float(t + u), 0.0))  # not above t + u
    return False


# A bracket ends this far beyond a guess.  Where a and d are wide the second is needed: a ball's radius has 30 bits.
SLACKS = (2.0**-40, 2.0**-26)


def guess_root(floats: tuple[float, ...], is_exact: bool, x: float, kappa: float, p: float) -> float:
    """Guess the impact angle by Newton's method in floats, from p on; no proof rests on it."""
    first_a, d, small, a_past = floats
    if not is_exact:
        return 2.0 * (x - first_a) / (kappa - small)
    last = math.inf
    # next to the joint the root is far smaller than p, and the first steps only halve the guess
    for k in range(100):
        if not math.isfinite(p):
            return math.nan
        sin, cos = math.sin(p), math.cos(p)
        a = first_a if sin > 0 else a_past
        slope = x - a * cos + d * sin - kappa * p
        if slope >= 0.0:
            return math.nan
        step = ((x - 0.5 * kappa * p) * p + d - a * sin - d * cos) / slope
        p -= step
        if abs(step) < 1e-14 * p or (k > 12 and abs(step) > 0.75 * last):
            break
        last = abs(step)
    return p


def root_above(s: Side, x: Arb, kappa: Arb, at: Angle) -> Angle:
    """Return an angle proved to come after the impact at x, for this kappa and larger ones: `at` or a nearer one."""
    p = guess_root(s.late, s.exact, float(x.mid()), float(kappa.mid()), float(at.p.mid()))
    for slack in SLACKS:
        if 0 < p * (1 + slack) < at.p:
            better = at_angle(s, arb(p * (1 + slack)))
            if flight(x, kappa, better) < 0:
                return better
    return at


def root_below(s: Side, x: Arb, kappa: Arb, at: Angle, start: Arb) -> Angle:
    """Return an angle proved to come before the impact at x, for this kappa and smaller ones: `at` or a nearer one."""
    p = guess_root(s.early, s.exact, float(x.mid()), float(kappa.mid()), float(start.mid()))
    for slack in SLACKS:
        if at.p < p * (1 - slack) < FULL_TURN:
            better = at_angle(s, arb(p * (1 - slack)))
            if positive_until(s, x, kappa, better):
                return better
    return at
