"""Throws parametrised by their impact angle p instead of their start x: no equation has to be solved.

    x = P(p) = kappa p / 2 + (a sin p - d (1 - cos p)) / p,    x' = P(p) + D(p), less the shift of a flip,

with the displacement D of a jog: docs/model.md.  The formulas take numbers of any arithmetic with ``+ - * /``, here
arrays of intervals, bare or with their derivatives by some variables (`mean_value.Jet`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from limitsets.interval import Interval
from limitsets.jit import proof_kernel
from limitsets.proofs.intervals import Intervals
from limitsets.proofs.mean_value import Jet, root
from limitsets.thrower import Energy, Exact, SmallAngle2
from limitsets.thrower.impact import pose
from limitsets.thrower.turn_box import turn_box

JOG, FLIP = 0, 1


class OneSide(NamedTuple):
    """What a throw from one side depends on: a, d, and by how much less a flip moves than a jog."""

    a: Any
    d: Any
    shift: Any


class ThrowNumbers(NamedTuple):
    """What throws depend on: their sides, the radius of gyration, kappa, height of the arm's surface."""

    sides: list[OneSide]
    rho: Any
    kappa: Any
    h: Any


class Angle(NamedTuple):
    """An angle p, sin p, 1 - cos p and p - sin p."""

    p: Any
    sin: Any
    versin: Any
    phi_minus_sin: Any


@proof_kernel(entry=True)
def _turns(lo: Any, hi: Any, out: Any) -> None:
    for k in range(lo.size):
        at = turn_box(Interval(lo[k], hi[k]))
        out[0, k], out[1, k] = at.sin.lo, at.sin.hi
        out[2, k], out[3, k] = at.versin.lo, at.versin.hi
        out[4, k], out[5, k] = at.phi_minus_sin.lo, at.phi_minus_sin.hi


def variable(value: Intervals, number: int, count: int) -> Jet:
    """Return the variable of a number, among so many."""
    one, none = Intervals.of(1.0), Intervals.of(0.0)
    return Jet(value, tuple(one if k == number else none for k in range(count)))


def angle(p: Any) -> Angle:
    """Evaluate what depends on an angle alone, with derivatives if it has any."""
    bare = p.value if isinstance(p, Jet) else p
    out = np.empty((6, bare.lo.size))
    _turns(np.ascontiguousarray(bare.lo), np.ascontiguousarray(bare.hi), out)
    s, v, w = (Intervals(out[2 * k], out[2 * k + 1]) for k in range(3))
    if not isinstance(p, Jet):
        return Angle(p, s, v, w)
    c = 1.0 - v
    return Angle(p, *(Jet(f, tuple(of * by for by in p.derivatives)) for f, of in ((s, c), (v, s), (w, v))))


def _signed_square(x: Any) -> Any:
    """x |x|."""
    if not isinstance(x, Jet):
        return x * x.absolute()
    size = x.value.absolute()
    return Jet(x.value * size, tuple(2.0 * (size * rise) for rise in x.derivatives))


@dataclass(frozen=True)
class Formulas:
    """The formulas of one model.

    Attributes
    ----------
    flight, flip : NamedTuple
        The models, as a `Throw` has them.
    """

    flight: Any
    flip: Any

    def start(self, n: ThrowNumbers, part: OneSide, at: Angle) -> Any:
        """Where the throw begins."""
        if isinstance(self.flight, Exact):
            return n.kappa * at.p * 0.5 + (part.a * at.sin - part.d * at.versin) / at.p
        pull = n.kappa - part.d if isinstance(self.flight, SmallAngle2) else n.kappa
        return part.a + pull * at.p * 0.5

    def end(self, n: ThrowNumbers, part: OneSide, at: Angle, x: Any, branch: int) -> Any:
        """Where it ends, on a branch."""
        jog = x - n.h * at.p
        if isinstance(self.flight, Exact):
            jog = jog + (part.a * at.versin - part.d * at.phi_minus_sin)
        return jog - part.shift if branch == FLIP else jog

    def margin(self, n: ThrowNumbers, part: OneSide, at: Angle, x: Any) -> Any:
        """Evaluate what decides: above 0 where it flips."""
        a, d = part.a, part.d
        ell = root(a * a + d * d)
        if isinstance(self.flight, Exact):
            right, above = pose(part, at)
            spin = n.rho * n.rho + right * (x - n.kappa * at.p) + above * (n.h + d)
            barrier = n.kappa * (_signed_square(right) / (ell + above))
        else:
            reach = x - a
            spin = n.rho * n.rho + a * a + d * d + d * n.h - a * reach
            barrier = n.kappa * (a * a / (ell + d)) - 2.0 * (a * reach)
        turned = spin * spin if isinstance(self.flip, Energy) else _signed_square(spin)
        return turned / (2.0 * (n.rho * n.rho + a * a + d * d)) - barrier
