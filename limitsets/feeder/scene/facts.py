"""Further contents of a scene beside part, arm and throw: facts about the world, effects, deviations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from limitsets.feeder.world import FACTS

TIPPING = ("landing", "roll")
"""Effects by which a part that comes down on a side on which it cannot rest goes on to the next."""

NOT_TIPPING = ("drive",)
"""Effects that do not know such a side."""

WITHOUT_EDGE = "if it is a chamfer, draw the part without it: lengthen the edges beside it until they meet"
"""What to do where nothing is known of such a side."""


@dataclass(frozen=True)
class Deviation:
    """A symmetric deviation of a quantity.

    Parameters
    ----------
    value : float
        Half its width: a fraction where `relative`, else in the quantity's own unit in the scene.
    relative : bool
        Whether it is a fraction of the quantity's value.
    """

    value: float
    relative: bool

    def of(self, nominal: float) -> float:
        """Give half the width around a nominal value.

        Examples
        --------
        >>> Deviation(0.01, relative=True).of(-50.0)
        0.5
        """
        return abs(nominal) * self.value if self.relative else self.value


SCATTERED = {"speed": "throw.speed", "landing": "landing.x"}
"""The quantities whose scatter `[world]` states, by the word that it has for them."""


@dataclass(frozen=True)
class Scatter:
    """Noise at every throw.

    Parameters
    ----------
    speed : Deviation or None
        Of the throw's angular speed [fraction or rad/s].
    landing : Deviation or None
        Of where the part lands [length].
    """

    speed: Deviation | None = None
    landing: Deviation | None = None


@dataclass(frozen=True)
class World:
    """Facts, known whether or not an effect is simulated.

    Each number of `FACTS` is an attribute, too: None where the scene does not state it.

    Parameters
    ----------
    numbers : mapping of str to float
        What the scene states, in the order of `FACTS` [scene's units; angles in rad].
    scatter : Scatter or None
        Noise at every throw.
    """

    numbers: Mapping[str, float] = field(default_factory=dict)
    scatter: Scatter | None = None

    def __getattr__(self, name: str) -> float | None:
        """Give a number by its name."""
        if not name.startswith("_") and name not in FACTS:
            import limitsets.feeder.thrower.effects  # noqa: F401 - lazily: effects declare facts, and load numba
        if name in FACTS:
            return self.numbers.get(name)
        raise AttributeError(name)


@dataclass(frozen=True)
class Effects:
    """What is simulated beyond the minimal model.

    Each effect is an attribute, too: what the scene writes after its name, None where it is off.

    Parameters
    ----------
    words : mapping of str to (bool or str)
        What the scene writes after the name of each effect that is on, in the order in which a throw meets them.
    auto : bool
        Let the analysis switch on what the scene calls for.
    contact : bool
        Parts meet each other and the walls of cavities and depressions, in the rigid-body engine; the map of one part
        on the arm is the same with it and without.
    """

    words: Mapping[str, bool | str] = field(default_factory=dict)
    auto: bool = False
    contact: bool = False

    def __getattr__(self, name: str) -> Any:
        """Give what the scene writes after the name of an effect."""
        if not name.startswith("_"):
            from limitsets.feeder.thrower.effects import EFFECTS  # lazily: its room loads numba

            if name in EFFECTS:
                return self.words.get(name)
        raise AttributeError(name)

    def also(self, **words: bool | str) -> Effects:
        """Give them with more switched on.

        Examples
        --------
        >>> Effects({"roll": True}).also(spread="bounded").on()
        ('roll', 'spread')
        """
        return replace(self, words={**self.words, **words})

    def on(self) -> tuple[str, ...]:
        """Give the names of the effects switched on.

        Examples
        --------
        >>> Effects({"roll": True}, auto=True).on()
        ('roll',)
        """
        return tuple(self.words)
