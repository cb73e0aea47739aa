"""What an effect says of itself, and the table of all that a scene may switch on.

An effect is one file: a NamedTuple of its numbers, its kernels, and a call of `declare`.  Its kernels are called where
`motion.py` and `motion_box.py` have a place for them (``moved.on(Numbers, method)``); boxes enclose nothing of it until
it says ``encloses.on(Numbers, enclosed)``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from limitsets.errors import MapError
from limitsets.jit import cover_foreign_class
from limitsets.thrower import motion, motion_box


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
        Facts of the world that have to be given, of `limitsets.scene.facts.FACTS`.
    excludes : tuple of str
        Effects whose kernels do not know this one.
    words : tuple of str
        What a scene may write after its name, the first where an audit switches it on; none: true.
    """

    name: str
    numbers: type
    build: Callable[[Any, Any], Any]
    lifts: str
    needs: tuple[str, ...] = ()
    excludes: tuple[str, ...] = ()
    words: tuple[str, ...] = ()

    @property
    def enclosed(self) -> bool:
        """Whether boxes follow it, with some of its numbers at least."""
        return self.numbers in motion_box.encloses.methods


EFFECTS: dict[str, Effect] = {}
"""The effects a scene may switch on, by name, in the order in which a throw meets them."""

_PLACES = (
    motion.thrown,
    motion.varied,
    motion.possible,
    motion.impacted,
    motion.moved,
    motion.stays,
    motion_box.encloses,
    motion_box.thrown_box,
    motion_box.moved_box,
)


def declare(effect: Effect) -> None:
    """Let scenes switch an effect on, once its methods are in their places.

    Raises
    ------
    MapError
        For a name that is taken.
    """
    if effect.name in EFFECTS:
        raise MapError("the name of the effect", effect.name, "a new one", "choose another")
    kernels = [place.methods[effect.numbers] for place in _PLACES if effect.numbers in place.methods]
    cover_foreign_class(effect.numbers, kernels)
    EFFECTS[effect.name] = effect
