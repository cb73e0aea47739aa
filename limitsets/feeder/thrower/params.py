"""Parameters of the throw map, in the form that kernels take, and the numbers of one side for points and for boxes.

`Throw` holds one entry per side; `Side` what one side's kernels need, gathered once per batch so that the loop over
starts reads no array but theirs.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.base import MapError
from limitsets.numbers.interval import Interval
from limitsets.numbers.interval.number import square_root
from limitsets.numbers.jit import generic, proof_kernel


class Exact(NamedTuple):
    """Flight with the rotation kept exact.

    Attributes
    ----------
    full_turn : float
        Angle up to which a landing is looked for [rad].
    """

    full_turn: float = 2.0 * math.pi


class SmallAngle(NamedTuple):
    """The paper's flight: sin phi -> phi, cos phi -> 1.

    Attributes
    ----------
    full_turn : float
        Angle up to which a landing is looked for [rad].
    """

    full_turn: float = 2.0 * math.pi


class SmallAngle2(NamedTuple):
    """Small-angle flight to consistent second order: phi = 2 (R - a) / (kappa - d).

    Attributes
    ----------
    full_turn : float
        Angle up to which a landing is looked for [rad].
    """

    full_turn: float = 2.0 * math.pi


class Signed(NamedTuple):
    """A flip needs the part to rotate towards the vertex with enough energy.

    Attributes
    ----------
    sign : float
        1: the direction of the rotation counts.
    """

    sign: float = 1.0


class Energy(NamedTuple):
    """The paper's criterion: a flip needs enough energy, whichever way the part rotates.

    Attributes
    ----------
    sign : float
        0: the direction of the rotation does not count.
    """

    sign: float = 0.0


class Throw(NamedTuple):
    """The throw map of one part on one arm; build it with `throw_map`.

    Attributes
    ----------
    flight : Exact, SmallAngle or SmallAngle2
        Model of the flight.
    flip : Signed or Energy
        Criterion of the flip.
    kappa : float
        Gravity over the square of the throw's angular velocity [length].
    surface_height : float
        Signed height of the arm's surface over the joint [length].
    arm_length : float
        Largest x at which a part can rest [length].
    radius_of_gyration : float
        About the centre of mass [length].
    a, d, length, corner : ndarray, shape (n,)
        Per side in flip order: foot of the centre of mass from the left vertex, its height, the side's length
        [length], and the exterior angle at the left vertex [rad].
    """

    flight: Any
    flip: Any
    kappa: float
    surface_height: float
    arm_length: float
    radius_of_gyration: float
    a: NDArray[np.float64]
    d: NDArray[np.float64]
    length: NDArray[np.float64]
    corner: NDArray[np.float64]


class Side(NamedTuple):
    """What the kernels of one side need; fields as in `Throw`, and combinations that all throws of a side share."""

    flight: Any
    flip: Any
    kappa: float
    h: float
    arm_length: float
    a: float
    d: float
    ell: float  # distance of the centre of mass from the left vertex
    rho2: float  # squared radius of gyration
    inertia: float  # rho^2 + ell^2, about the vertex
    per_inertia: float  # its inverse
    per_b: float  # of the first guess of the impact: 2 / (kappa - d), and the fraction's three coefficients
    over: float
    under: float
    under2: float
    single_root: bool  # kappa > ell: the height of the vertex is strictly concave in the angle
    corner: float
    side: int
    next: int  # the side after a flip
    a_next: float
    shift: float  # a + L' - a': how much less a flip moves the centre of mass than a jog


def gather(params: Throw, side: int) -> Side:
    """Return what the kernels need to know of one side (`on_side` of the throw map)."""
    a, d = params.a[side], params.d[side]
    after = side + 1 if side + 1 < params.a.size else 0
    ell2 = a * a + d * d
    ell = math.sqrt(ell2)
    per_b = 2.0 / (params.kappa - d)
    y = (2.0 / 3.0) * a * per_b
    rho2 = params.radius_of_gyration * params.radius_of_gyration
    return Side(
        params.flight,
        params.flip,
        params.kappa,
        params.surface_height,
        params.arm_length,
        a,
        d,
        ell,
        rho2,
        rho2 + ell2,
        1.0 / (rho2 + ell2),
        per_b,
        0.4 * y,
        0.3 * y,
        0.15 * d * per_b / 12.0,
        params.kappa > ell,
        params.corner[side],
        side,
        after,
        params.a[after],
        a + (params.length[after] - params.a[after]),
    )


def _divided(part: Any, momentum: Any) -> Any:
    return momentum / part.inertia


@generic(default=_divided)
def per_inertia(part: Any, momentum: Any) -> Any:
    """Divide an angular momentum about the left vertex by the moment of inertia there."""


def _multiplied(part: Side, momentum: float) -> float:
    return momentum * part.per_inertia


per_inertia.on(Side, _multiplied)


FLIGHTS = {"exact": Exact, "small-angle": SmallAngle, "small-angle-2": SmallAngle2}
FLIPS = {"signed": Signed, "energy": Energy}


def throw_map(
    *,
    a: ArrayLike,
    d: ArrayLike,
    length: ArrayLike,
    corner: ArrayLike,
    radius_of_gyration: float,
    kappa: float,
    surface_height: float,
    arm_length: float,
    flight: str = "exact",
    flip: str = "signed",
) -> Throw:
    """Build the throw map from plain numbers, all lengths in one unit.

    Parameters
    ----------
    a, d, length, corner : array_like, shape (n,)
        Per side in flip order, see `Throw`.
    radius_of_gyration, kappa, surface_height, arm_length : float
        See `Throw`.
    flight : {"exact", "small-angle", "small-angle-2"}
        Model of the flight.
    flip : {"signed", "energy"}
        Criterion of the flip.

    Returns
    -------
    Throw
        The map: a registered class of parameters.

    Raises
    ------
    MapError
        For an unknown word or a number that cannot be.

    Examples
    --------
    >>> from limitsets.thrower import throw_map
    >>> square = throw_map(a=[1] * 4, d=[1] * 4, length=[2] * 4, corner=[1.5707963267948966] * 4,
    ...                    radius_of_gyration=0.8, kappa=12.0, surface_height=-0.1, arm_length=20.0)
    >>> square.kappa
    12.0
    """
    if flight not in FLIGHTS:
        raise MapError("the flight", flight, f"one of {', '.join(FLIGHTS)}", "correct the word")
    if flip not in FLIPS:
        raise MapError("the flip criterion", flip, f"one of {', '.join(FLIPS)}", "correct the word")
    sides = [np.array(np.atleast_1d(values), dtype=np.float64) for values in (a, d, length, corner)]
    if len({values.shape for values in sides}) != 1 or sides[0].ndim != 1 or sides[0].size < 3:
        shapes = [values.shape for values in sides]
        raise MapError(
            "the sides", shapes, "arrays of equal length, three sides at least", "give one entry per side"
        )
    numbers = tuple(float(value) for value in (kappa, surface_height, arm_length, radius_of_gyration))
    if not (all(np.isfinite(values).all() for values in sides) and np.isfinite(numbers).all()):
        raise MapError("a parameter of the throw", "nan or inf", "finite numbers", "correct it")
    for name, value in (
        ("kappa", numbers[0]),
        ("arm_length", numbers[2]),
        ("radius_of_gyration", numbers[3]),
    ):
        if not value > 0:
            raise MapError(name, value, "a number > 0", "correct it")
    kind: Any = Throw  # mypy does not follow unpacked fields
    built: Throw = kind(FLIGHTS[flight](), FLIPS[flip](), *numbers, *sides)
    return built


# ----------------------------------------------------------------
# The box twin of `params.on_side`: the numbers of one side for the box kernels, over a box of parameters.


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
