"""The box twin of `motion.py`: input and results of the box kernels with effects.

Everything is an interval, over a cell of starts and a box of parameters.  If the next event is undecided, all
possible events *wait*, a row of `FullSideBox.waiting` each, and are followed in turn; `Ways` collects the results by
place of rest.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.interval import Interval
from limitsets.jit import entries_of, generic, proof_kernel
from limitsets.maps import codes
from limitsets.thrower.motion import FullThrow
from limitsets.thrower.params import Throw
from limitsets.thrower.side_box import SideBox, gather_box, with_kappa

NOTHING = -1

# Undecided continuations of one cell that may wait; where more are possible nothing is proved.
ROOM = 16

ROLLED = 2
"""Code of the branch on which the part rolled on, or back."""


class FullSideBox(NamedTuple):
    """What the box kernels of one side need.

    Attributes
    ----------
    own : SideBox
        The minimal model of this side, thrown with the kappa of this throw.
    lo, hi : Throw
        Corners of the minimal model's parameters.
    p_lo, p_hi, q_lo, q_hi : ndarray, shape (n,)
        Bounds of where the vertices are, see `motion.Outline`.
    effects : tuple
        What is simulated.
    waiting : ndarray, shape (ROOM, 7)
        A side the part may have come down on, see `wait`.
    """

    own: SideBox
    lo: Throw
    hi: Throw
    p_lo: NDArray[np.float64]
    p_hi: NDArray[np.float64]
    q_lo: NDArray[np.float64]
    q_hi: NDArray[np.float64]
    effects: tuple[Any, ...]
    waiting: NDArray[np.float64]


def _not_enclosed(effect: Any) -> bool:
    return False


def enclosed(effect: Any) -> bool:
    """Say of an effect that the box kernels follow it."""
    return True


@generic(proof=True, default=_not_enclosed)
def encloses(effect: Any) -> bool:
    """Whether the box kernels follow an effect; nothing is proved of throws with one whose file has not said so."""


encloses.on(type(None), enclosed)


@proof_kernel
def all_enclosed(effects: Any) -> bool:
    """Whether the box kernels follow every effect that is there."""
    every = True
    for effect in entries_of((None,) + effects):  # noqa: RUF005 - there may be none, and numba has no unpacking
        every = every & encloses(effect)
    return every


class Way(NamedTuple):
    """A place of rest: sides turned since the throw, code of the branch, bounds of x'."""

    turned: int
    branch: int
    lo: float
    hi: float


class Ways(NamedTuple):
    """Places of rest: how many, -1 where they are too many or not known; then the first two."""

    number: int
    first: Way
    second: Way


@generic(proof=True, chained=True)
def thrown_box(effect: Any, kappa: Interval) -> Interval:
    """Return the kappas of all throws with an effect: the box twin of `motion.thrown` and `motion.varied`."""


@generic(proof=True, chained=True)
def moved_box(effect: Any, x: Interval) -> Interval:
    """Return the places of rest of all throws with an effect: the box twin of `motion.moved`."""


@proof_kernel
def gather_full_box(lo: FullThrow, hi: FullThrow, side: int, kappa: Interval) -> FullSideBox:
    """Intervals of one side, from the two corners of a parameter box, for throws with these kappa."""
    thrown = thrown_box(lo.effects, kappa)
    return FullSideBox(
        with_kappa(gather_box(lo.bare, hi.bare, side), thrown.lo, thrown.hi),
        lo.bare,
        hi.bare,
        lo.outline.p[side],
        hi.outline.p[side],
        lo.outline.q[side],
        hi.outline.q[side],
        lo.effects,
        np.empty((ROOM, 7)),
    )


@proof_kernel
def box_of(part: FullSideBox, k: int) -> SideBox:
    """Return the minimal model of side number k, counted on without end."""
    b = gather_box(part.lo, part.hi, k % part.lo.a.size)
    return with_kappa(b, part.own.kappa.lo, part.own.kappa.hi)


@proof_kernel
def corner_box(part: FullSideBox, k: int) -> Interval:
    """Exterior angle at vertex number k."""
    n = k % part.lo.a.size
    return Interval(part.lo.corner[n], part.hi.corner[n])


@proof_kernel
def vertex_box(part: FullSideBox, k: int) -> tuple[Interval, Interval]:
    """Place of vertex number k from the centre of mass, before the throw."""
    n = k % part.lo.a.size
    return Interval(part.p_lo[n], part.p_hi[n]), Interval(part.q_lo[n], part.q_hi[n])


@proof_kernel
def tips_box(part: FullSideBox, k: int) -> int:
    """Which end of side number k the part tips over, as `motion.tips`, for all parameters; 2 where that differs."""
    n = k % part.lo.a.size
    a = Interval(part.lo.a[n], part.hi.a[n])
    right = Interval(part.lo.length[n], part.hi.length[n]) - a
    if a.hi <= 0.0:
        return 1
    if right.hi <= 0.0:
        return -1
    return 0 if (a.lo > 0.0) & (right.lo > 0.0) else 2


@proof_kernel
def wait(
    part: FullSideBox, count: int, k: int, left: bool, rolled: bool, energy: Interval, x: Interval
) -> int:
    """Let a side that may have come down wait; how many then do.

    Side number k, turned about its left end or its right, having rolled or not, with a kinetic energy just before in
    m w^2, the centre of mass at x.
    """
    if count < ROOM:
        row = part.waiting[count]
        row[0], row[1], row[2] = k, 1.0 if left else 0.0, 1.0 if rolled else 0.0
        row[3], row[4] = max(energy.lo, 0.0), max(energy.hi, 0.0)
        row[5], row[6] = x.lo, x.hi
    return count + 1


@proof_kernel
def no_way() -> Ways:
    """Nothing yet."""
    none = Way(0, 0, math.inf, -math.inf)
    return Ways(0, none, none)


@proof_kernel
def put(ways: Ways, turned: int, rolled: bool, x: Interval) -> Ways:
    """Keep a place of rest."""
    branch = codes.JOG if turned == 0 else codes.FLIP
    branch = ROLLED if rolled | (turned < 0) | (turned > 1) else branch
    number, one, two = ways
    mine = Way(turned, branch, x.lo, x.hi)
    if number == 0:
        return Ways(1, mine, two)
    if (number > 0) & (one.turned == turned) & (one.branch == branch):
        return Ways(number, Way(turned, branch, min(one.lo, x.lo), max(one.hi, x.hi)), two)
    if number == 1:
        return Ways(2, one, mine)
    if (number == 2) & (two.turned == turned) & (two.branch == branch):
        return Ways(2, one, Way(turned, branch, min(two.lo, x.lo), max(two.hi, x.hi)))
    return Ways(NOTHING, one, two)
