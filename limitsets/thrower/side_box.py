"""The box twin of `params.on_side`: the numbers of one side for the box kernels, over a box of parameters."""

from __future__ import annotations

from typing import Any, NamedTuple

from limitsets.interval import Interval
from limitsets.interval.number import square_root
from limitsets.jit import proof_kernel
from limitsets.thrower.params import Throw


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
    a, d = Interval(lo.a[side], hi.a[side]), Interval(lo.d[side], hi.d[side])
    kappa = Interval(lo.kappa, hi.kappa)
    ell2 = a**2 + d**2
    ell = square_root(ell2)
    rho2 = Interval(lo.radius_of_gyration, hi.radius_of_gyration) ** 2
    landed = Interval(lo.length[after], hi.length[after]) - Interval(lo.a[after], hi.a[after])
    return SideBox(
        lo.flight,
        lo.flip,
        kappa,
        Interval(lo.surface_height, hi.surface_height),
        a,
        d,
        ell,
        rho2,
        rho2 + ell2,
        a + landed,
        kappa.lo > ell.hi,
        side,
        after,
    )


@proof_kernel
def with_kappa(b: SideBox, lo: float, hi: float) -> SideBox:
    """Return the same side, thrown with kappa in [lo, hi]."""
    return SideBox(
        b.flight,
        b.flip,
        Interval(lo, hi),
        b.h,
        b.a,
        b.d,
        b.ell,
        b.rho2,
        b.inertia,
        b.shift,
        lo > b.ell.hi,
        b.side,
        b.next,
    )
