"""The numbers that `[world]` may state.

In a file of its own, which loads no kernels: scenes read it, and effects add to it (`declare`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass


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
"""The numbers that `[world]` may have, by name: those of the package, then those that effects declare."""
