"""The box twin of `params.on_side`: what the box kernels need of one side, for a whole box of parameters."""

from __future__ import annotations

from typing import Any, NamedTuple

import limitsets.interval as iv
from limitsets.interval.arithmetic import Interval
from limitsets.jit import proof_kernel
from limitsets.thrower.params import Throw

__all__ = ["SideBox", "gather_box", "with_kappa"]


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
