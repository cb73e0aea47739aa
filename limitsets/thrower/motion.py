"""State of the part between two events of a throw, as the kernels of the effects pass it on.

Lengths in the scene's unit, rates divided by the throw's w, velocities by w as well, energies by m w^2.  Sides and
vertices are counted on without end, counterclockwise: number k means side, or its left vertex, k mod n, so that k less
the side a throw began on is how far the part has turned.  The part touches the arm with vertex k while it has turned
from lying on side k by 0 <= psi <= the exterior angle there; then it lies on side k + 1.

A place along the arm is given by `shift`: how far the centre of mass would have moved since the throw began, if the
part came to lie on side k without its vertex k moving.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.jit import generic, kernel
from limitsets.thrower.params import Side, Throw
from limitsets.thrower.turn import Turned

# What a vertex on the arm comes to: it stays there, a side comes down, it lets go, or the model does not say.
ON, DOWN, OFF, LOST = range(4)


class Outline(NamedTuple):
    """Where the vertices are.

    Attributes
    ----------
    p, q : ndarray, shape (n, n)
        Of the part lying on side i: vertex k is p[i, k] right of the centre of mass and q[i, k] above it [length].
    """

    p: NDArray[np.float64]
    q: NDArray[np.float64]


class FullThrow(NamedTuple):
    """The throw map with effects beyond the minimal model; build it with `effects.with_effects`.

    Attributes
    ----------
    bare : Throw
        The minimal model: part, arm and throw.
    outline : Outline
        The part's vertices.
    effects : tuple
        What is simulated: the numbers of each effect, in the order of `effects.EFFECTS`.
    """

    bare: Throw
    outline: Outline
    effects: tuple[Any, ...]

    def __getattr__(self, name: str) -> Any:
        """Give the numbers of the minimal model under their own names, for all who only read them."""
        if name in Throw._fields:
            return getattr(self.bare, name)
        raise AttributeError(name)


def without(params: Throw | FullThrow, numbers: type) -> Throw | FullThrow:
    """Return a map without the effect of these numbers; the bare one where no other is left."""
    if not isinstance(params, FullThrow):
        return params
    left = tuple(each for each in params.effects if type(each) is not numbers)
    return params._replace(effects=left) if left else params.bare


class FullSide(NamedTuple):
    """What the kernels of one side need: the minimal model of this side and of all, and the effects."""

    own: Side
    a: NDArray[np.float64]
    d: NDArray[np.float64]
    length: NDArray[np.float64]
    corner: NDArray[np.float64]
    p: NDArray[np.float64]
    q: NDArray[np.float64]
    effects: tuple[Any, ...]


class Arrival(NamedTuple):
    """A vertex about to strike the arm.

    Attributes
    ----------
    vertex : int
        Which.
    psi : Turned
        How far the part has turned from lying on the side of that number.
    shift : float
        The place, see this module [length].
    vx, vy, omega : float
        Velocity of the centre of mass and rate of rotation just before [length, 1].
    """

    vertex: int
    psi: Turned
    shift: float
    vx: float
    vy: float
    omega: float


class Contact(NamedTuple):
    """A vertex that has just struck.

    Attributes
    ----------
    vertex, psi, shift
        As in `Arrival`.
    omega : float
        Rate of rotation after the impact.
    slide, lift : float
        Velocity of the vertex along the arm and off it; the minimal model has 0 and 0 [length].
    """

    vertex: int
    psi: Turned
    shift: float
    omega: float
    slide: float
    lift: float


class Face(NamedTuple):
    """A part that has just come down on a whole side.

    Attributes
    ----------
    side : int
        Which, counted on without end.
    shift : float
        How far its centre of mass has moved since the throw began [length].
    vertex : int
        The end of the side that touched before: `side` for its left end, `side - 1` for its right.
    omega : float
        Rate of rotation just before; its sign is that of the way to this side.
    slide : float
        Velocity along the arm [length].
    """

    side: int
    shift: float
    vertex: int
    omega: float
    slide: float


# Where an effect may act by itself, `.on` the class of its numbers.  What several effects decide together, which vertex
# lands, whether it slips and rolls, finds each of them by its class.


@generic(chained=True)
def thrown(effect: Any, bare: Throw) -> Throw:
    """Return the minimal model as it is thrown with an effect."""


@generic(chained=True)
def varied(effect: Any, params: FullThrow, start: int, step: int) -> FullThrow:
    """Return the map of throw number `step` of start number `start`."""


@generic(chained=True)
def possible(effect: Any, so_far: bool, part: FullSide, x: float) -> bool:
    """Whether the model can say what a throw from x does."""


@generic(chained=True)
def impacted(effect: Any, contact: Contact, part: FullSide) -> Contact:
    """Return a vertex that has just struck as an effect leaves it."""


@generic(chained=True)
def moved(effect: Any, shift: float, part: FullSide, face: Face) -> float:
    """Return the shift of a part that stays on a side it came down on [length]; nan where the model does not say."""


@generic(chained=True)
def stays(effect: Any, so_far: bool, part: FullSide, k: int) -> bool:
    """Whether a part that came to rest on side number k remains there until the next throw."""


@kernel
def at_kappa(bare: Throw, kappa: float) -> Throw:
    """Return the minimal model thrown with another kappa: compiled code has no `_replace`."""
    return Throw(
        bare.flight,
        bare.flip,
        kappa,
        bare.surface_height,
        bare.arm_length,
        bare.radius_of_gyration,
        bare.a,
        bare.d,
        bare.length,
        bare.corner,
    )


@kernel
def side_number(part: FullSide, k: int) -> int:
    """Index of side or vertex number k."""
    return k % part.a.size


@kernel
def right_of(part: FullSide, vertex: int, psi: Turned) -> float:
    """X: how far the centre of mass is right of a vertex that touches [length]."""
    k = side_number(part, vertex)
    return part.a[k] * (1.0 - psi.versin) - part.d[k] * psi.sin  # type: ignore[no-any-return]  # kernels take arrays as Any


@kernel
def above(part: FullSide, vertex: int, psi: Turned) -> float:
    """H: how far the centre of mass is above a vertex that touches [length]."""
    k = side_number(part, vertex)
    return part.a[k] * psi.sin + part.d[k] * (1.0 - psi.versin)  # type: ignore[no-any-return]  # kernels take arrays as Any


@kernel
def on_to_next(part: FullSide, vertex: int) -> float:
    """How much farther inward the part lies on side `vertex` + 1 than on side `vertex`, turned about that vertex."""
    k, after = side_number(part, vertex), side_number(part, vertex + 1)
    return part.a[k] + (part.length[after] - part.a[after])  # type: ignore[no-any-return]  # kernels take arrays as Any


@kernel
def tips(part: FullSide, k: int) -> int:
    """Which end of side number k the part tips over of its own accord: 1 the left one, -1 the right one, 0 none."""
    number = side_number(part, k)
    if part.a[number] <= 0.0:
        return 1
    return -1 if part.a[number] >= part.length[number] else 0


def outline_of(bare: Throw) -> Outline:
    """Lay the part on every side in turn, from what is known of each side, and say where its vertices are.

    Vertex k is the left end of side k.  Walking clockwise along the outline from the left end of side i, the sides
    i, i - 1, i - 2, ... follow each other, each turned from the last by the exterior angle between them.
    """
    n = bare.a.size
    p, q = np.empty((n, n)), np.empty((n, n))
    for side in range(n):
        x, y, turned = -bare.a[side], -bare.d[side], 0.0
        for step in range(n):
            k = (side - step) % n
            p[side, k], q[side, k] = x, y
            x, y = x + bare.length[k] * np.cos(turned), y + bare.length[k] * np.sin(turned)
            turned += bare.corner[(k - 1) % n]
        # the two ends of the side that lies on the arm are at one height, to the last digit
        q[side, (side - 1) % n] = -bare.d[side]
    return Outline(p, q)
