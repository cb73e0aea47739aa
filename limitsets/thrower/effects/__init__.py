"""Effects beyond the minimal model, one file each: its numbers, its kernel, and a row here.

A kernel begins by asking whether its effect is there, and is called, in its place, by `full.py`.  Which effects a
scene switches on, and with which facts, is the scene's business; what each of them is called and needs stands here.
Source: docs/model.md, effects.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import limitsets.thrower.full  # noqa: F401 - registers the map
from limitsets.errors import MapError
from limitsets.thrower.effects.bounce import Bounce
from limitsets.thrower.effects.drive import drive_of
from limitsets.thrower.effects.landing import Landing
from limitsets.thrower.effects.pivot import Pivot
from limitsets.thrower.effects.roll import Roll
from limitsets.thrower.effects.slip import Slip
from limitsets.thrower.effects.spread import spread_of
from limitsets.thrower.motion import Effects, FullThrow, outline_of
from limitsets.thrower.params import Exact, Throw

__all__ = ["BUILT", "Effect", "with_effects"]


class Effect(NamedTuple):
    """A row of the table: what an effect needs to know, and how its numbers are made of that.

    Attributes
    ----------
    needs : tuple of str
        Facts of the world that have to be given.
    build : callable
        From the world, and what the scene writes after the effect's name, to the NamedTuple that its kernels take.
    excludes : tuple of str
        Effects whose kernels do not know this one.
    """

    needs: tuple[str, ...]
    build: Callable[[Any, Any], Any]
    excludes: tuple[str, ...] = ()


BUILT: dict[str, Effect] = {
    "drive": Effect(("stroke",), drive_of, excludes=("slip", "pivot", "bounce")),
    "landing": Effect((), lambda world, how: Landing()),
    "roll": Effect((), lambda world, how: Roll()),
    "pivot": Effect(("friction",), lambda world, how: Pivot(float(world.friction))),
    "slip": Effect(("friction",), lambda world, how: Slip(float(world.friction))),
    "bounce": Effect(
        ("restitution", "bounce_threshold"),
        lambda world, how: Bounce(float(world.restitution), float(world.bounce_threshold)),
    ),
    "spread": Effect(("scatter",), spread_of),
}
"""The effects a scene may switch on, by name."""


def with_effects(bare: Throw, effects: Mapping[str, Any], world: Any) -> FullThrow:
    """Add effects to the minimal model.

    Parameters
    ----------
    bare : Throw
        Part, arm and throw; its flight is the exact one.
    effects : mapping
        By name, of `BUILT`, what the scene writes after it: true, or a word.
    world : object
        The facts, as attributes.

    Returns
    -------
    FullThrow
        A map, of a class of its own: what is not named is not in its machine code.

    Raises
    ------
    MapError
        For a small-angle flight, in which angles and heights of the part's corners have no meaning.
    """
    if not isinstance(bare.flight, Exact):
        raise MapError(
            "the flight", type(bare.flight).__name__, "the exact one", 'effects need flight = "exact"'
        )
    chosen = {name: BUILT[name].build(world, how) for name, how in effects.items()}
    return FullThrow(bare, outline_of(bare), Effects(**chosen))
