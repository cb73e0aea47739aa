"""Further contents of a scene beside part, arm and throw: facts about the world, effects, deviations."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

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
class Fact:
    """How `[world]` writes a number.

    Parameters
    ----------
    thing : str
        What it is, for refusals: "the coefficient of friction".
    dimension : str
        Of a quantity, which is above 0; empty for a plain number from 0.
    most : float
        The largest value; below it where it has a dimension [scene's units].
    words : str
        A plain number's example; of a quantity with a largest value the range: "above 0 and below 90 deg".
    meaning : str
        What it says, where its name does not.
    """

    thing: str
    dimension: str = ""
    most: float = math.inf
    words: str = ""
    meaning: str = ""


FACTS: dict[str, Fact] = {
    "friction": Fact("the coefficient of friction", most=1e6, words="0.9"),
    "restitution": Fact("the coefficient of restitution", most=1.0, words="0.4"),
    "bounce_threshold": Fact(
        "the threshold", "length", meaning="height of a bounce below which a part stays put"
    ),
    "stroke": Fact(
        "the stroke", "angle", math.pi / 2, "above 0 and below 90 deg", "angle over which the arm accelerates"
    ),
    "throw_rate": Fact("the rate of throws", "frequency", meaning="throws per time"),
}
"""The numbers that `[world]` may have, by name; what an effect needs that none needed before is added here."""


@dataclass(frozen=True)
class World:
    """Facts, known whether or not an effect is simulated; None where not known.

    Parameters
    ----------
    friction : float or None
        Coefficient of friction.
    restitution : float or None
        Coefficient of restitution of the normal impulse, 0 to 1.
    bounce_threshold : float or None
        Height of the bounce below which the impact is plastic [length].
    stroke : float or None
        Angle over which the arm accelerates [rad].
    scatter : Scatter or None
        Noise at every throw.
    more : mapping of str to float
        All other numbers of `FACTS` that are given, read as attributes too.
    """

    friction: float | None = None
    restitution: float | None = None
    bounce_threshold: float | None = None
    stroke: float | None = None
    scatter: Scatter | None = None
    more: Mapping[str, float] = field(default_factory=dict)

    def __getattr__(self, name: str) -> float | None:
        """Give a fact that only effects from outside the package need."""
        if name in FACTS:
            return self.more.get(name)
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
        if name.startswith("_"):
            raise AttributeError(name)
        if name not in self.words:
            from limitsets.feeder.thrower.effects import EFFECTS  # lazily: its room loads numba

            if name not in EFFECTS:
                raise AttributeError(name)
        return self.words.get(name)

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
