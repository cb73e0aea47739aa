"""The box twin of the throw: enclosures of where a whole cell of starts goes, for a whole box of parameters.

Proof kernels on intervals, in the same steps as `throw.py`.  The impact is enclosed by a bracket: numbers proposed
by Newton's method, accepted only when the height of the vertex is proved positive at (and, being concave, before) the
lower one and negative at the upper one.  Where the displacement is proved to be monotone on the cell its image is
spanned by its ends; where the decision between jog and flip is not proved the cell has both images.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import limitsets.interval as iv
from limitsets.interval.arithmetic import Interval
from limitsets.jit import generic, proof_kernel
from limitsets.maps import codes
from limitsets.thrower.params import Energy, Exact, Signed, SmallAngle, SmallAngle2, Throw
from limitsets.thrower.turn_box import exact_turn, turn_box, turn_point

__all__ = [
    "SideBox",
    "gather_box",
    "gather_pair",
    "side_image_box",
    "throw_box",
    "throw_image_box",
    "with_kappa",
]

# The bracket of an impact reaches this far, relative to phi, beyond what Newton's method proposes: wide against the
# rounding of f (some 2^-46 of its terms), narrow against the 1e-9 asked of end points.
SLACK = 2.0**-43

NOTHING, DECIDED, BOTH = -1, 1, 2

FULL_TURN = 2.0 * math.pi


class SideBox(NamedTuple):
    """What the box kernels of one side need, each an interval; names as in `params.Side`."""

    flight: Any
    flip: Any
    kappa: Interval
    h: Interval
    a: Interval
    d: Interval
    ell: Interval
    rho2: Interval
    inertia: Interval
    shift: Interval
    single_root: bool
    side: int
    next: int


@proof_kernel
def gather_box(lo: Throw, hi: Throw, side: int) -> SideBox:
    """Intervals of one side's parameters, from the two corners of a parameter box."""
    after = side + 1 if side + 1 < lo.a.size else 0
    a, d = (lo.a[side], hi.a[side]), (lo.d[side], hi.d[side])
    kappa, rho = (lo.kappa, hi.kappa), (lo.radius_of_gyration, hi.radius_of_gyration)
    ell2 = iv.add(iv.sqr(a), iv.sqr(d))
    ell = iv.sqrt(ell2)
    rho2 = iv.sqr(rho)
    landed = iv.sub((lo.length[after], hi.length[after]), (lo.a[after], hi.a[after]))
    return SideBox(
        lo.flight,
        lo.flip,
        kappa,
        (lo.surface_height, hi.surface_height),
        a,
        d,
        ell,
        rho2,
        iv.add(rho2, ell2),
        iv.add(a, landed),
        kappa[0] > ell[1],
        side,
        after,
    )


@proof_kernel
def with_kappa(b: SideBox, lo: float, hi: float) -> SideBox:
    """Return the same side, thrown with kappa in [lo, hi]."""
    return SideBox(
        b.flight,
        b.flip,
        (lo, hi),
        b.h,
        b.a,
        b.d,
        b.ell,
        b.rho2,
        b.inertia,
        b.shift,
        lo > b.ell[1],
        b.side,
        b.next,
    )


# ---------------------------------------------------------------- flight


def bracket(flight: Any, b: SideBox, x: float) -> tuple[Interval, bool]:
    """Interval that holds the impact angle of a start x for all parameters, and whether that is proved."""


bracket = generic(bracket, proof=True)


def sure_bracket(flight: Any, b: SideBox, x: float) -> tuple[Interval, bool]:
    """Return the same, however long it takes."""


sure_bracket = generic(sure_bracket, proof=True)


def angle_slope(flight: Any, b: SideBox, x: Interval, phi: Interval) -> Interval:
    """Return the derivative of the impact angle with respect to x."""


angle_slope = generic(angle_slope, proof=True)


@proof_kernel
def _right_of_root(kappa: float, a: float, d: float, ell: float, reach: float) -> float:
    """Right of the root: w <= phi^3/6 and v <= phi^2/2 in f, or f <= R phi + 2 ell - (kappa/2) phi^2."""
    b = 0.5 * (kappa - d)
    under = b * b - (2.0 / 3.0) * a * reach
    cubic = 2.0 * reach / (b + math.sqrt(max(under, 0.0)))
    x = reach + a
    far = (x + math.sqrt(x * x + 4.0 * kappa * ell)) / kappa
    return min(cubic, far) if under > 0.0 else far


@proof_kernel
def _newton(kappa: float, a: float, d: float, reach: float, phi: float) -> float:
    s, v, w = exact_turn(phi)
    f = phi * (reach - 0.5 * kappa * phi) + a * w + d * v
    return phi - f / (reach + a * v + d * s - kappa * phi)


@proof_kernel
def _height(b: SideBox, reach: Interval, phi: float) -> Interval:
    """f at one angle, for all parameters."""
    _, v, w = turn_point(phi)
    p = (phi, phi)
    fall = iv.sub(reach, iv.mul(b.kappa, (0.5 * phi, 0.5 * phi)))
    return iv.add(iv.mul(p, fall), iv.add(iv.mul(b.a, w), iv.mul(b.d, v)))


@proof_kernel
def _exact_bracket(flight: Any, b: SideBox, x: float) -> tuple[Interval, bool]:
    reach = iv.sub((x, x), b.a)
    # f grows with reach, a and d and falls with kappa: its root is smallest at one corner and largest at the other.
    phi = _right_of_root(b.kappa[1], b.a[0], b.d[0], b.ell[1], reach[0])
    for _ in range(4):
        phi = _newton(b.kappa[1], b.a[0], b.d[0], reach[0], phi)
    other = phi
    for _ in range(3):
        other = _newton(b.kappa[0], b.a[1], b.d[1], reach[1], other)
    lo, hi = phi - SLACK * phi, other + SLACK * other
    proved = (reach[0] > 0.0) & (lo > 0.0) & (hi <= flight.full_turn) & b.single_root
    proved &= (_height(b, reach, lo)[0] > 0.0) & (_height(b, reach, hi)[1] < 0.0)
    return (lo, hi), proved


@proof_kernel
def _marched(b: SideBox, x: float) -> tuple[Interval, bool]:
    """As `_exact_bracket`, however many roots there are: a march that cannot step over the smallest.

    With M >= |f''|, f(t + s) >= f(t) + f'(t) s - M s^2/2, so f stays positive up to the positive root of that parabola,
    shrunk by 2^-20 against rounding.  At the start f(s) >= f'(0) s - M s^2/2.  Where no step is left the lower end is
    reached; the upper end is the next angle tried at which f is proved negative.  Near a double root, or where the
    first root jumps within the parameters, the bracket is wide and still right.
    """
    reach = iv.sub((x, x), b.a)
    bound = iv.add((b.kappa[1], b.kappa[1]), (b.ell[1], b.ell[1]))[1]
    shrink = 1.0 - 2.0**-20
    t = shrink * 2.0 * reach[0] / bound
    going = reach[0] > 0.0
    while going and t < FULL_TURN:
        f = _height(b, reach, t)
        s, v, _ = turn_point(t)
        slope = iv.add(reach, iv.add(iv.mul(b.a, v), iv.mul(b.d, s)))
        low = iv.sub(slope, iv.mul(b.kappa, (t, t)))[0]
        inside = low * low + 2.0 * bound * f[0]
        step = shrink * (low + math.sqrt(max(inside, 0.0))) / bound
        going = (f[0] > 0.0) & (step > 2.0**-40 * t)
        t = t + step if going else t
    width = 2.0**-36 * t
    while t + width < FULL_TURN and not _height(b, reach, t + width)[1] < 0.0:
        width *= 1.25
    hi = t + width
    proved = (reach[0] > 0.0) & (t > 0.0) & (hi <= FULL_TURN) & (_height(b, reach, hi)[1] < 0.0)
    return (t, hi), proved


@proof_kernel
def _exact_slope(flight: Any, b: SideBox, x: Interval, phi: Interval) -> Interval:
    s, v, _ = turn_box(phi[0], phi[1])
    reach = iv.sub(x, b.a)
    below = iv.sub(iv.mul(b.kappa, phi), iv.add(reach, iv.add(iv.mul(b.a, v), iv.mul(b.d, s))))
    return iv.div(phi, below)


@proof_kernel
def _small_bracket(flight: Any, b: SideBox, x: float) -> tuple[Interval, bool]:
    phi = iv.div(iv.mul((2.0, 2.0), iv.sub((x, x), b.a)), b.kappa)
    return phi, (phi[0] > 0.0) & (phi[1] <= flight.full_turn)


@proof_kernel
def _small_slope(flight: Any, b: SideBox, x: Interval, phi: Interval) -> Interval:
    return iv.div((2.0, 2.0), b.kappa)


@proof_kernel
def _small2_bracket(flight: Any, b: SideBox, x: float) -> tuple[Interval, bool]:
    phi = iv.div(iv.mul((2.0, 2.0), iv.sub((x, x), b.a)), iv.sub(b.kappa, b.d))
    return phi, (phi[0] > 0.0) & (phi[1] <= flight.full_turn)


@proof_kernel
def _small2_slope(flight: Any, b: SideBox, x: Interval, phi: Interval) -> Interval:
    return iv.div((2.0, 2.0), iv.sub(b.kappa, b.d))


@proof_kernel
def _exact_surely(flight: Any, b: SideBox, x: float) -> tuple[Interval, bool]:
    return _marched(b, x)


sure_bracket.on(Exact, _exact_surely)  # type: ignore[attr-defined]
sure_bracket.on(SmallAngle, _small_bracket)  # type: ignore[attr-defined]
sure_bracket.on(SmallAngle2, _small2_bracket)  # type: ignore[attr-defined]
bracket.on(Exact, _exact_bracket)  # type: ignore[attr-defined]  # generic functions carry `on`
bracket.on(SmallAngle, _small_bracket)  # type: ignore[attr-defined]
bracket.on(SmallAngle2, _small2_bracket)  # type: ignore[attr-defined]
angle_slope.on(Exact, _exact_slope)  # type: ignore[attr-defined]
angle_slope.on(SmallAngle, _small_slope)  # type: ignore[attr-defined]
angle_slope.on(SmallAngle2, _small2_slope)  # type: ignore[attr-defined]


# ---------------------------------------------------------------- impact


def strike_box(flight: Any, b: SideBox, x: Interval, phi: Interval) -> tuple[Interval, Interval]:
    """Rate after the impact, barrier."""


strike_box = generic(strike_box, proof=True)


def decide_box(flip: Any, b: SideBox, omega: Interval, barrier: Interval) -> Interval:
    """Enclosure of the number that is positive where the part flips."""


decide_box = generic(decide_box, proof=True)


@proof_kernel
def _signed_square(x: Interval) -> Interval:
    """x |x|, which grows with x."""
    return iv.mul((x[0], x[0]), (abs(x[0]), abs(x[0])))[0], iv.mul((x[1], x[1]), (abs(x[1]), abs(x[1])))[1]


@proof_kernel
def _exact_strike(flight: Any, b: SideBox, x: Interval, phi: Interval) -> tuple[Interval, Interval]:
    s, v, _ = turn_box(phi[0], phi[1])
    c = iv.sub((1.0, 1.0), v)
    right = iv.sub(iv.mul(b.a, c), iv.mul(b.d, s))
    above = iv.add(iv.mul(b.a, s), iv.mul(b.d, c))
    falling = iv.sub(x, iv.mul(b.kappa, phi))
    turning = iv.add(iv.mul(right, falling), iv.mul(above, iv.add(b.h, b.d)))
    omega = iv.div(iv.add(b.rho2, turning), b.inertia)
    # X |X| / (ell + H) = sgn(X) (ell - H).  With H > 0 proved it is tight; otherwise |.| <= ell - H with the sign of X.
    near = iv.div(_signed_square(right), iv.add(b.ell, above))
    rest = iv.sub(b.ell, above)
    far = (-max(rest[1], 0.0) if right[0] < 0.0 else 0.0), (max(rest[1], 0.0) if right[1] > 0.0 else 0.0)
    upright = above[0] > 0.0
    barrier = iv.mul(b.kappa, (near[0] if upright else far[0], near[1] if upright else far[1]))
    return omega, barrier


@proof_kernel
def _small_strike(flight: Any, b: SideBox, x: Interval, phi: Interval) -> tuple[Interval, Interval]:
    reach = iv.sub(x, b.a)
    own = iv.add(iv.add(iv.sqr(b.a), iv.sqr(b.d)), iv.mul(b.d, b.h))
    omega = iv.div(
        iv.add(iv.sub(b.rho2, iv.mul(b.a, reach)), own), b.inertia
    )  # 2 a^2 - a R = a^2 - a (R - a)
    top = iv.mul(b.kappa, iv.div(iv.sqr(b.a), iv.add(b.ell, b.d)))
    return omega, iv.sub(top, iv.mul((2.0, 2.0), iv.mul(b.a, reach)))


@proof_kernel
def _signed(flip: Any, b: SideBox, omega: Interval, barrier: Interval) -> Interval:
    return iv.sub(iv.mul(iv.mul((0.5, 0.5), b.inertia), _signed_square(omega)), barrier)


@proof_kernel
def _energy(flip: Any, b: SideBox, omega: Interval, barrier: Interval) -> Interval:
    return iv.sub(iv.mul(iv.mul((0.5, 0.5), b.inertia), iv.sqr(omega)), barrier)


strike_box.on(Exact, _exact_strike)  # type: ignore[attr-defined]
strike_box.on(SmallAngle, _small_strike)  # type: ignore[attr-defined]
strike_box.on(SmallAngle2, _small_strike)  # type: ignore[attr-defined]
decide_box.on(Signed, _signed)  # type: ignore[attr-defined]
decide_box.on(Energy, _energy)  # type: ignore[attr-defined]


# ---------------------------------------------------------------- landing


def displacement_box(flight: Any, b: SideBox, phi: Interval) -> tuple[Interval, Interval]:
    """Shift of the centre of mass by a jog, and its derivative with respect to phi."""


displacement_box = generic(displacement_box, proof=True)


@proof_kernel
def _exact_displacement(flight: Any, b: SideBox, phi: Interval) -> tuple[Interval, Interval]:
    s, v, w = turn_box(phi[0], phi[1])
    shift = iv.sub(iv.sub(iv.mul(b.a, v), iv.mul(b.d, w)), iv.mul(b.h, phi))
    return shift, iv.sub(iv.sub(iv.mul(b.a, s), iv.mul(b.d, v)), b.h)


@proof_kernel
def _small_displacement(flight: Any, b: SideBox, phi: Interval) -> tuple[Interval, Interval]:
    return iv.neg(iv.mul(b.h, phi)), iv.neg(b.h)


displacement_box.on(Exact, _exact_displacement)  # type: ignore[attr-defined]
displacement_box.on(SmallAngle, _small_displacement)  # type: ignore[attr-defined]
displacement_box.on(SmallAngle2, _small_displacement)  # type: ignore[attr-defined]


# ---------------------------------------------------------------- one throw of a cell


@proof_kernel
def throw_box(b: SideBox, lo: float, hi: float) -> tuple[int, Interval, Interval, Interval, Interval]:
    """Enclose one throw of every start in [lo, hi].

    Returns
    -------
    (state, image, phi, slope, margin)
        `state`: -1 nothing is proved; 0 jog, 1 flip; 2 either.  `image`: of a jog (a flip moves by `shift` less).
        `phi`: impact angles.  `slope`: of x' against x.  `margin`: of the decision.
    """
    first, good = bracket(b.flight, b, lo)
    last, fine = bracket(b.flight, b, hi)
    return _between(b, lo, hi, first, last, good & fine)


@proof_kernel
def sure_throw_box(b: SideBox, lo: float, hi: float) -> tuple[int, Interval, Interval, Interval, Interval]:
    """As `throw_box`, with the smallest root found by a march where there may be several."""
    first, good = sure_bracket(b.flight, b, lo)
    last, fine = sure_bracket(b.flight, b, hi)
    return _between(b, lo, hi, first, last, good & fine)


@proof_kernel
def _between(
    b: SideBox, lo: float, hi: float, first: Interval, last: Interval, proved: bool
) -> tuple[int, Interval, Interval, Interval, Interval]:
    """Enclose the throws of a cell from the brackets at its ends: the angle grows with x, if need be by jumps."""
    phi, x = (first[0], last[1]), (lo, hi)
    shift, shift_slope = displacement_box(b.flight, b, phi)
    slope = iv.add((1.0, 1.0), iv.mul(shift_slope, angle_slope(b.flight, b, x, phi)))
    # With the parameters known within wide bounds the brackets are wide: where the displacement is proved to grow
    # with phi only the outer ends of them matter.
    grows = shift_slope[0] > 0.0
    at_lo, _ = displacement_box(b.flight, b, (first[0], first[0] if grows else first[1]))
    at_hi, _ = displacement_box(b.flight, b, (last[1] if grows else last[0], last[1]))
    ends = iv.add((lo, lo), at_lo)[0], iv.add((hi, hi), at_hi)[1]
    whole = iv.add(x, shift)
    rising = slope[0] > 0.0
    image = (ends[0] if rising else whole[0], ends[1] if rising else whole[1])
    omega, barrier = strike_box(b.flight, b, x, phi)
    margin = decide_box(b.flip, b, omega, barrier)
    state = codes.FLIP if margin[0] > 0.0 else (codes.JOG if margin[1] <= 0.0 else BOTH)
    finite = (image[1] - image[0] < math.inf) & (margin[1] - margin[0] < math.inf)
    return state if proved & finite else NOTHING, image, phi, slope, margin


# ---------------------------------------------------------------- the map contract


@proof_kernel
def gather_pair(lo: Throw, hi: Throw, side: int) -> tuple[SideBox, SideBox]:
    """`on_side_box` of the throw: the same intervals stand for both corners."""
    b = gather_box(lo, hi, side)
    return b, b


@proof_kernel
def side_image_box(b: SideBox, same: SideBox, lo: float, hi: float, side: int) -> Any:
    """`image_box` of the throw on one side; the witness is the bracket of the impact angle."""
    state, jog, phi, _, _ = throw_box(b, lo, hi)
    return _slots(b, state, jog, phi)


@proof_kernel
def side_fallback_box(b: SideBox, same: SideBox, lo: float, hi: float, side: int) -> Any:
    """`fallback_box` of the throw on one side."""
    state, jog, phi, _, _ = sure_throw_box(b, lo, hi)
    return _slots(b, state, jog, phi)


@proof_kernel
def _slots(b: SideBox, state: int, jog: Interval, phi: Interval) -> Any:
    """Count, images per branch, witness."""
    flip = iv.sub(jog, b.shift)
    flips = state == codes.FLIP
    first = (
        flip[0] if flips else jog[0],
        flip[1] if flips else jog[1],
        b.next if flips else b.side,
        1 if flips else 0,
    )
    count = state if (state == NOTHING) | (state == BOTH) else DECIDED
    return count, first, (flip[0], flip[1], b.next, 1), phi


@proof_kernel
def throw_fallback_box(lo_params: Throw, hi_params: Throw, lo: float, hi: float, side: int) -> Any:
    """`fallback_box` of the throw."""
    b = gather_box(lo_params, hi_params, side)
    return side_fallback_box(b, b, lo, hi, side)


@proof_kernel
def throw_image_box(lo_params: Throw, hi_params: Throw, lo: float, hi: float, side: int) -> Any:
    """`image_box` of the throw."""
    b = gather_box(lo_params, hi_params, side)
    return side_image_box(b, b, lo, hi, side)
