"""Codes for the result of a throw, or of one step of any map.

A code of zero or more is the branch of the map that was taken (for the throw: jog or flip); a negative code is a
state of its own, never folded into a neighbour.
"""

from __future__ import annotations

JOG = 0
"""Rests on the same side."""
FLIP = 1
"""Rests on the next side."""
ROLL = 2
"""Rests on another side, or after several rolls."""
INWARD = -1
"""Lands with the centre of mass at or inside the left vertex of its side: R' <= a."""
OUTWARD = -2
"""Lands beyond the arm's end."""
OUTSIDE = -2
"""Leaves the domain: the exit of a map other than the throw, beside `UNDEFINED`."""
OUTSIDE_MODEL = -3
"""Nothing the model speaks of: a start with R <= a, or no impact within a full turn."""
UNDECIDED = -4
"""Cells only: parts of the cell do different things."""
UNDEFINED = -5
"""The map gave nan: the last exit of every map."""
UNSETTLED = -128
"""Inside the drivers only: the fast kernel could not vouch for its answer, the sure one is asked."""

NAMES = {
    JOG: "jog",
    FLIP: "flip",
    ROLL: "roll",
    INWARD: "inward",
    OUTWARD: "outward",
    OUTSIDE_MODEL: "outside-model",
    UNDECIDED: "undecided",
    UNDEFINED: "undefined",
}
