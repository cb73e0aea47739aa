"""One throw at 50 digits: what an orbit that floats have found is held against, and what replays a counterexample."""

from __future__ import annotations

from mpmath import mp, mpf

from tests.attack.facts import Facts

mp.dps = 50


def impact(facts: Facts, x: mpf, i: int) -> mpf | None:
    """Smallest positive root within a full turn, by the same bound of the curvature, to the last digit."""
    a, d, kappa = facts.a[i], facts.d[i], facts.kappa
    if x <= a:
        return None
    if facts.flight != "exact":
        under = kappa - (d if facts.flight == "small-angle-2" else 0)
        phi = 2 * (x - a) / under if under > 0 else mpf(-1)
        return phi if 0 < phi <= 2 * mp.pi else None
    with mp.workdps(70):
        bend, phi = mp.hypot(a, d) + kappa, mpf(0)
        for _ in range(20000):
            s, c = mp.sin(phi), mp.cos(phi)
            f = x * phi - a * s + d * (1 - c) - kappa / 2 * phi**2
            slope = x - a * c + d * s - kappa * phi
            if phi > 0 and f <= 0:
                break
            root = mp.sqrt(slope**2 + 2 * bend * f)
            step = 2 * f / (root - slope) if slope < 0 else (slope + root) / bend
            phi += step
            if step < mpf("1e-58") * phi:
                break
            if phi > 2 * mp.pi:
                return None
        return phi


def throw(facts: Facts, x: mpf, i: int, shift: mpf | int = 0) -> tuple[mpf, int, int]:
    """Where the part comes to rest, on which side, and the code (jog 0, flip 1, inward -1, outward -2, outside -3)."""
    phi = impact(facts, x, i)
    if phi is None:
        return x, i, -3
    a, d, h, kappa = facts.a[i], facts.d[i], facts.h, facts.kappa
    ell = mp.hypot(a, d)
    M = facts.rho**2 + ell**2
    if facts.flight == "exact":
        c, s = mp.cos(phi), mp.sin(phi)
        X, H = a * c - d * s, a * s + d * c
        om = (facts.rho**2 + X * (x - kappa * phi) + H * (h + d)) / M
        K, V = M * om**2 / 2, kappa * (ell - H)
        stuck = x - (h + d) * phi - a * c + d * s
        if facts.flip == "energy":
            over = K > V or X < 0
        else:
            over = mp.sign(om) * K - mp.sign(X) * V > 0
    else:
        om = (facts.rho**2 - a * x + 2 * a**2 + d**2 + d * h) / M
        K, V = M * om**2 / 2, kappa * (ell - d) - 2 * a * (x - a)
        stuck = x - h * phi - a
        over = (K if facts.flip == "energy" else mp.sign(om) * K) > V
    j = (i + 1) % len(facts.a) if over else i
    to = shift + (stuck - facts.side[j] + facts.a[j] if over else stuck + a)
    if to <= facts.a[j]:
        return to, j, -1
    if to > facts.arm:
        return to, j, -2
    return to, j, int(over)
