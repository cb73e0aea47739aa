"""State of the part between two events of a throw, for points and for boxes, and what an effect says of itself.

Lengths in the scene's unit, rates divided by the throw's w, velocities by w as well, energies by m w^2.  Sides and
vertices are counted on without end, counterclockwise: number k means side, or its left vertex, k mod n, so that k less
the side a throw began on is how far the part has turned.  The part touches the arm with vertex k while it has turned
from lying on side k by 0 <= psi <= the exterior angle there; then it lies on side k + 1.

A place along the arm is given by `shift`: how far the centre of mass would have moved since the throw began, if the
part came to lie on side k without its vertex k moving.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.base import MapError
from limitsets.feeder.thrower.flight import Turned
from limitsets.feeder.thrower.params import Side, SideBox, Throw, gather_box, with_kappa
from limitsets.feeder.world import FACTS, Fact
from limitsets.numbers.interval import Interval
from limitsets.numbers.jit import cover_foreign_class, entries_of, generic, kernel, proof_kernel
from limitsets.systems.maps import codes

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


# ----------------------------------------------------------------
# The box twin of `motion.py`: input and results of the box kernels with effects.
#
# Everything is an interval, over a cell of starts and a box of parameters.  If the next event is undecided, all
# possible events *wait*, a row of `FullSideBox.waiting` each, and are followed in turn; `Ways` collects the results by
# place of rest.


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
def no_way(number: int) -> Ways:
    """Nothing yet, or that nothing is known."""
    none = Way(0, 0, math.inf, -math.inf)
    return Ways(number, none, none)


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


# ----------------------------------------------------------------
# What an effect says of itself, and the table of all that a scene may switch on.
#
# An effect is one file: a NamedTuple of its numbers, its kernels, and a call of `declare`.  Its kernels are called
# where this file has a place for them (``moved.on(Numbers, method)``); boxes enclose nothing of it until it says
# ``encloses.on(Numbers, enclosed)``.


class Effect(NamedTuple):
    """What the rest of the package knows of an effect.

    Attributes
    ----------
    name : str
        Its word in ``[effects]``.
    numbers : type
        The NamedTuple class that its kernels take.
    build : callable
        From the world, and what the scene writes after the effect's name, to these numbers.
    lifts : str
        What the minimal model assumes without it, a clause for reports: "it does not bounce".
    needs : tuple of str
        Facts of the world that have to be given, of `limitsets.feeder.world.FACTS`, its own among them.
    excludes : tuple of str
        Effects whose kernels do not know this one.
    words : tuple of str
        What a scene may write after its name, the first where an audit switches it on; none: true.
    reads : tuple of str
        Facts that it takes into account where they are given.
    facts : mapping of str to Fact
        Facts of its own, by name (small letters, digits and _): how `[world]` writes what no effect needed before.
    """

    name: str
    numbers: type
    build: Callable[[Any, Any], Any]
    lifts: str
    needs: tuple[str, ...] = ()
    excludes: tuple[str, ...] = ()
    words: tuple[str, ...] = ()
    reads: tuple[str, ...] = ()
    facts: Mapping[str, Fact] = {}

    @property
    def enclosed(self) -> bool:
        """Whether boxes follow it, with some of its numbers at least."""
        return self.numbers in encloses.methods


EFFECTS: dict[str, Effect] = {}
"""The effects a scene may switch on, by name, in the order in which a throw meets them."""

_PLACES = (thrown, varied, possible, impacted, moved, stays, encloses, thrown_box, moved_box)


def declare(effect: Effect) -> None:
    """Let scenes switch an effect on and state its facts, once its methods are in their places.

    Raises
    ------
    MapError
        For a name that is taken, of the effect or of a fact of its own.
    """
    for thing, names in (
        ("effect", {effect.name} & EFFECTS.keys()),
        ("fact", effect.facts.keys() & {"scatter", *FACTS}),
    ):
        for name in names:
            raise MapError(f"the name of the {thing}", name, "a new one", "choose another")
    kernels = [place.methods[effect.numbers] for place in _PLACES if effect.numbers in place.methods]
    cover_foreign_class(effect.numbers, kernels)
    FACTS.update(effect.facts)
    EFFECTS[effect.name] = effect
