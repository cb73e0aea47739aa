"""Near the foot with noise of the landing place: starts that come out of there, and starts that a sequence takes back.

docs/certificates.md, "For which starts".  Both are told by the impact angle, as jogs near the foot go the farther the
later the part lands.
"""

import itertools

from flint import arb

from .balls import HALF, ZERO, Arb, float_above, prove, sine_cosine
from .file import Quantity
from .model import (
    at_angle,
    guess_root,
    landing_at,
    landing_slope,
    over_angles,
    ratios,
    rise_of_jog,
    root_above,
)
from .near_hinge import near_angle, near_landing
from .scene import MOST_HALVES, Scene, Side, quantities

JOG_PIECES = 64  # of a range of angles
HALVINGS = 40  # of a range that holds an angle
# A stated kappa keeps this share of itself from the ends of its noise, which are known to 100 bits.
INSIDE = arb(2) ** -80
VARYING = ("throw", "gravi")  # how the names of the quantities begin that kappa is computed from


def from_foot(s: Side, p: Arb, kappa: Arb) -> Arb:
    """Evaluate R(p) - a, how far from the foot the start lies whose impact angle is p, without cancellation."""
    if not s.exact:
        return HALF * (kappa - s.small_d) * p
    r = ratios(p)
    return p * (HALF * kappa - s.d * r.V - s.a * r.W * p)


def angle_from_foot(s: Side, away: float, kappa: Arb, sign: int) -> Arb:
    """Find an angle of which starts are proved to lie as far from the foot or farther (sign 1), or as near (-1)."""
    a, d, small, _ = s.floats
    near = guess_root((a, d, small, a), s.exact, a + away, float(kappa), 4 * away / float(kappa) + 0.1)
    good = near * (1 + sign / 4)
    prove(good < 3 and is_beyond(s, good, away, kappa, sign), f"the angle at x - a = {away!r} is not bounded")
    for _ in range(HALVINGS):  # the guess is that of a middle scene
        middle = (near + good) / 2
        near, good = (near, middle) if is_beyond(s, middle, away, kappa, sign) else (middle, good)
    return arb(good)


def is_beyond(s: Side, p: float, away: float, kappa: Arb, sign: int) -> bool:
    """Whether starts with an impact angle are proved to lie as far from the foot or farther (1), or as near (-1)."""
    return bool(p > 0 and sign * (from_foot(s, arb(p), kappa) - away) >= 0)


def check_outward(scene: Scene, side: int, until: float, away: float) -> None:
    """Check that each jog from x - a > away, x <= until, goes outward by more than the landing scatters.

    Where R(p) rises up to an angle at which it is beyond `until`, the angle tells the start, which has no other impact.
    Jogs with D > e on a closed range of angles go outward by a least step: the part comes to rest beyond `until` after
    finitely many, no farther than `near_landing`.
    """
    s, kappa = scene.sides[side], scene.k_lo.union(scene.k_hi)
    first = angle_from_foot(s, away, scene.k_hi, -1)
    last = angle_from_foot(s, float_above(arb(until) - s.a), scene.k_lo, 1)
    prove(away > 0 and bool(first < last), "there are no such starts before the cells that are claimed")
    prove(
        s.landing < at_angle(s, first).D,
        "a jog is not proved to go outward by more than the landing scatters",
    )
    cuts = [first * k / JOG_PIECES for k in range(JOG_PIECES)]
    cuts += [first + (last - first) * k / JOG_PIECES for k in range(JOG_PIECES + 1)]
    for k, (lo, hi) in enumerate(itertools.pairwise(cuts)):
        p = lo.union(hi)
        alone = not s.exact or landing_slope(s, ratios(p), scene.k_lo) > 0
        prove(alone, "the impact is not proved to be the only one")
        if k >= JOG_PIECES:
            R = s.a + from_foot(s, lo, scene.k_lo).union(from_foot(s, hi, scene.k_hi))
            decision, rise, _ = over_angles(s, p, R, kappa)
            prove(decision == 0 and rise > 0, "a jog that goes the farther the later it lands is not proved")
    landing = near_landing(s, scene.k_lo, scene.k_hi, until)
    prove(landing <= s.arm, "R' <= arm.length is not proved")


def check_lost(scene: Scene, side: int, end: float, foot: bool) -> None:
    """Check that a worst sequence of landings takes every start in (a, end] to the joint, or in (a, a + end] by `foot`.

    A start R(p, kappa), told by its impact angle p, is thrown by D(p).  Where the throw is a jog with D < e for all p
    up to an angle after the impact at the end, landings that fall short by e bring the part inward, by a least step: to
    x <= a.
    """
    s, x = scene.sides[side], arb(end)
    prove(s.landing > 0, "without noise of the landing place no part is lost by it")
    kappa = kappa_of_worst(scene)
    if x <= (0 if foot else s.a):
        return  # there are no such starts
    prove(foot or (x > s.a and x <= s.arm), "they do not lie on the arm")
    if foot:
        top = angle_from_foot(s, end, kappa.lower(), 1)
    else:
        bound = near_angle(s, kappa.lower(), kappa.upper(), end)
        prove(bound < 3, "the impact angle is not bounded")
        top = root_above(s, x, kappa.lower(), at_angle(s, bound)).p
    stack, looked = [(top * k / 64, top * (k + 1) / 64) for k in range(64)], 0
    while stack:
        lo, hi = stack.pop()
        looked += 1
        p = lo.union(hi)
        R = landing_at(s, ratios(p), kappa) if s.exact else s.a + HALF * (kappa - s.small_d) * p
        if over_angles(s, p, R, kappa)[0] == 0 and falls_short(s, lo, hi):
            continue
        prove(looked <= MOST_HALVES, "that a jog falls short is not proved")
        stack += [(lo, HALF * (lo + hi)), (HALF * (lo + hi), hi)]


def kappa_of_worst(scene: Scene) -> Arb:
    """Choose kappa for a worst sequence: one value of the noise, but all where kappa is known to a tolerance only."""
    loose = any(
        isinstance(value, list | Quantity) for name, value in quantities(scene.raw) if name[:5] in VARYING
    )
    inner = scene.k_lo * (1 + INSIDE), scene.k_hi * (1 - INSIDE)
    return inner[1] if not loose and inner[0] < inner[1] else scene.k_lo.union(scene.k_hi)


def falls_short(s: Side, lo: Arb, hi: Arb) -> bool:
    """Whether jogs with angles in [lo, hi] are proved to go outward by less than the landing scatters."""
    rise = rise_of_jog(s, *sine_cosine(lo.union(hi)))
    end = at_angle(s, hi).D
    moved = end if rise > 0 else end - rise * ZERO.union(hi - lo)
    return bool(moved < s.landing)
