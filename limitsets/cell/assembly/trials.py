"""A trial of two parts: in contact with each other in the engine, or passing through each other (the paper)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from limitsets.cell.assembly.pairing import Draws, Pair, Start, are_apart, meet, seats_of, way_of
from limitsets.cell.feeding.crowd import FRICTION
from limitsets.cell.feeding.falling import FATES, ArmEnd
from limitsets.feeder.engine import Crowd, Recording, Rest
from limitsets.feeder.engine.depression import SEATED, off_seat
from limitsets.feeder.scattering import thrown
from limitsets.systems.maps import codes, images

# ----------------------------------------------------------------
# A trial of two parts that pass through each other, as the paper assumes: the throw map alone, and common
# speeds.


MOST_PASSING = 20_000
"""As in `limitsets.feed`."""


@dataclass(frozen=True)
class Passed:
    """What became of both parts.

    Attributes
    ----------
    fates : tuple of str
        Of `limitsets.feeding.FATES`, by part.
    throws : tuple of int
        Throws made until then.
    overlap_at_start : bool
        Whether their outlines overlap before the first throw.
    overlap_at_rest, overlap_in_flight : int
        The first throw after which, and in which, they overlap while both are on the arm; 0 for none.
    """

    fates: tuple[str, str]
    throws: tuple[int, int]
    overlap_at_start: bool
    overlap_at_rest: int
    overlap_in_flight: int

    @property
    def overlaps(self) -> bool:
        """Whether the outlines overlap at any time."""
        return self.overlap_at_start or self.overlap_at_rest > 0 or self.overlap_in_flight > 0

    @property
    def outcome(self) -> str:
        """A word of `limitsets.cell.assembly.assembly_run.OUTCOMES`."""
        if self.fates == ("right", "right"):
            return "assembled" if self.throws[0] < self.throws[1] else "order"
        for word in ("wrong", "wall", "edge", "left"):
            if word in self.fates:
                return word
        return "never"


def pass_through(
    pair: Pair, seed: int, number: int, *, apart: bool = False, starts: tuple[Start, Start] | None = None
) -> Passed:
    """Make one trial: throw both parts, the speed common to both, until each has met its fate.

    Parameters
    ----------
    pair : Pair
        The parts and the noise.
    seed, number : int
        Of the draws.
    apart : bool
        Whether the random starts are those of parts that do not overlap.
    starts : pair of (float, int), optional
        Instead of random ones.
    """
    draws = Draws(pair, seed, number)
    drawn = draws.starts(apart=apart)
    states = list(starts or drawn)
    fates, throws = ["never", "never"], [MOST_PASSING, MOST_PASSING]
    waiting = [0, 1]
    at_start = not are_apart(pair, states)
    at_rest = in_flight = 0
    for throw in range(1, MOST_PASSING + 1):
        deviation, landing = draws.throw()
        factor = (1.0 + deviation) ** -2
        ways = []
        both = len(waiting) == 2
        for k in tuple(waiting):
            end, start = pair.ends[k], states[k]
            params = thrown(end.scene.map)(factor)
            states[k], fate, side = _thrown(end, params, start, landing[k])
            if both and not in_flight:
                ways.append(way_of(end.scene, params, start, side))
            if fate is not None:
                fates[k], throws[k] = fate, throw
                waiting.remove(k)
        if len(ways) == 2 and meet(*ways):
            in_flight = throw
        if len(waiting) == 2 and not at_rest and not are_apart(pair, states):
            at_rest = throw
        if not waiting:
            break
    return Passed((fates[0], fates[1]), (throws[0], throws[1]), at_start, at_rest, in_flight)


def _thrown(end: ArmEnd, params: Any, start: Start, shift: float) -> tuple[Start, str | None, int]:
    """Throw one part: where it lies, its fate if it has met one, and the side it comes to lie on."""
    if end.at_edge(*start):
        return start, "edge", start[1]
    image = images(params, [start[0]], start[1])
    x, side, code = float(image.x[0]) + shift, int(image.side[0]), int(image.code[0])
    scene = end.scene
    if code == codes.OUTSIDE_MODEL or not float(scene.sides.a[side]) < x <= scene.arm_length:
        return (x, side), "left", side
    met = int(end.fate(np.array([x]), np.array([side]))[0])
    return (x, side), None if met < 0 else FATES[met], side


# ----------------------------------------------------------------
# A trial of two parts in contact with each other and with the cavity, in the engine.


MOST_THROWS = 500


@dataclass(frozen=True)
class Question:
    """How parts meet: as `Crowd` has it.

    Attributes
    ----------
    contact : str
        "hinge" or "unilateral".
    carried : bool
        Whether the cavity is thrown with what lies in it.
    step : float
        The engine's [rad].
    """

    contact: str = "hinge"
    carried: bool = True
    step: float = 4e-3


@dataclass(frozen=True)
class Pushed:
    """What became of both parts.

    Attributes
    ----------
    outcome : str
        A word of `limitsets.cell.assembly.assembly_run.OUTCOMES`.
    throws : tuple of int
        Throws after which each part came to lie in the cavity, or left; those made where it did neither.
    entered : tuple of (int or None)
        The side on which each came to lie in the cavity, -1 for none; None where it did not.
    wall : tuple of bool
        Whether each met the far wall on its way in.
    touched : bool
        Whether the parts touched each other on the way.
    survives_standing, survives_carried : bool or None
        Whether an assembled pair is still assembled after one more throw: with a cavity that stands in the room, and
        with one that is part of the arm.
    """

    outcome: str
    throws: tuple[int, int]
    entered: tuple[int | None, int | None]
    wall: tuple[bool, bool]
    touched: bool
    survives_standing: bool | None = None
    survives_carried: bool | None = None


class _Watched:
    """A trial under way: what has happened to the parts so far."""

    def __init__(self, pair: Pair, crowd: Crowd) -> None:
        self.pair, self.crowd = pair, crowd
        self.seats = seats_of(pair)
        cavity = pair.scenes[0].cavity
        assert cavity is not None  # `pair_of` refuses scenes without one
        self.near = SEATED * cavity.width
        self.throws = [0, 0]
        self.entered: list[int | None] = [None, None]
        self.wall = [False, False]
        self.ended = [False, False]
        self.ejected = self.left = self.touched = self.edge = False

    def acts_beyond(self, rests: list[Rest]) -> bool:
        """Whether the next throw acts beyond the end of the arm on a part: what it does is not simulated."""
        self.edge = any(
            rest.where == "arm" and end.at_edge(rest.x, rest.side)
            for end, rest in zip(self.pair.ends, rests, strict=True)
        )
        return self.edge

    def seen(self, throw: int, rests: list[Rest]) -> None:
        """Take note of where the parts are after a throw."""
        for k, rest in enumerate(rests):
            inside = rest.where == "cavity"
            if self.entered[k] is not None and not inside and rest.where != "unfinished":
                self.ejected = True
                self.entered[k] = None
            if not self.ended[k]:
                self.throws[k] = throw
            if inside and self.entered[k] is None:
                self.entered[k] = rest.side
                self.wall[k] = "wall" in rest.met
            least = self.pair.scenes[k].sides.a
            lost = rest.where == "lost" or (rest.where == "arm" and rest.x <= float(least[rest.side]))
            self.left |= lost
            self.ended[k] = inside or lost
            self.touched |= any(name.startswith("part") for name in rest.met)

    def assembled(self) -> bool:
        """Whether both parts lie in their seats."""
        members = self.crowd.members
        return all(off_seat(members[k].world(), self.seats[k]) <= self.near for k in (0, 1))

    def outcome(self, rests: list[Rest]) -> str:
        """Say what became of them, for the first reason that holds."""
        inside = [k for k, rest in enumerate(rests) if rest.where == "cavity"]
        both, sides = len(inside) == 2, [end.side for end in self.pair.ends]
        on_their_sides = both and [rest.side for rest in rests] == sides
        reasons = (
            ("assembled", both and self.assembled()),
            ("ejected", self.ejected),
            ("left", self.left),
            ("edge", self.edge),
            ("unfinished", any(rest.where == "unfinished" for rest in rests)),
            ("wrong", any(rests[k].side not in (sides[k], -1) for k in inside)),
            ("order", on_their_sides and self.throws[1] <= self.throws[0]),
            ("wall", any(self.wall[k] and rests[k].side == -1 for k in inside)),
            ("wrong", both),
        )
        return next((word for word, holds in reasons if holds), "never")


def crowd_of(pair: Pair, how: Question) -> Crowd:
    """Make the engine's crowd of both parts."""
    friction = pair.scenes[0].world.friction
    return Crowd(
        pair.scenes,
        contact=how.contact,
        carried=how.carried,
        friction=FRICTION if friction is None else friction,
        step=how.step,
    )


def push(
    pair: Pair,
    seed: int,
    number: int,
    how: Question = Question(),
    *,
    starts: tuple[Start, Start] | None = None,
    last: int | None = None,
) -> tuple[Pushed, Recording]:
    """Make one trial; its film has frames from throw `last` on, and none where that is not given.

    Parameters
    ----------
    pair : Pair
        The parts and the noise.
    seed, number : int
        Of the draws: starts that do not overlap, speeds, landing places.
    how : Question
        How parts meet.
    starts : pair of (float, int), optional
        Instead of random ones.
    last : int, optional
        The throw from which poses are kept.
    """
    draws = Draws(pair, seed, number)
    drawn = draws.starts(apart=True)
    crowd = crowd_of(pair, how)
    for k, start in enumerate(starts or drawn):
        crowd.place(k, *start)
    watched = _Watched(pair, crowd)
    rests = crowd.rests()
    for throw in range(1, MOST_THROWS + 1):
        if watched.acts_beyond(rests):
            if throw == 1 and last is not None:  # where they began is all that there is to see
                crowd.film.on = True
                crowd.film.frame(0.0)
            break
        crowd.film.on = last is not None and throw >= last
        rests = crowd.throw(*draws.throw())
        watched.seen(throw, rests)
        if all(watched.ended) or watched.left or any(rest.where == "unfinished" for rest in rests):
            break
    outcome = watched.outcome(rests)
    standing = carried = None
    if outcome == "assembled":
        if not how.carried:
            crowd.throw(*draws.throw())
            standing = watched.assembled()
        crowd.carried = True
        crowd.throw(*draws.throw())
        carried = watched.assembled()
    made = Pushed(
        outcome,
        (watched.throws[0], watched.throws[1]),
        (watched.entered[0], watched.entered[1]),
        wall=(watched.wall[0], watched.wall[1]),
        touched=watched.touched,
        survives_standing=standing,
        survives_carried=carried,
    )
    return made, crowd.recording()
