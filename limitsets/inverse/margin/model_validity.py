"""Model validity of a design: the slack of the assumptions that a fast throw would break.

The map goes on where its assumptions fail; there is a stable jog after most of a full turn, for one, that no real part
would do, because its other corners hit the arm first.  A search finds such places, so it asks the rows of the audit's
table at the two ends of each stretch, where the numbers are extreme; `limitsets.audit` looks everywhere.
"""

from __future__ import annotations

import numpy as np

from limitsets.auditing.assumptions import ASSUMPTIONS
from limitsets.auditing.judging import Row
from limitsets.robust.margins.invariant_set import InvariantIntervals
from limitsets.scene import Scene
from limitsets.thrower.assumed_box import assumed

# The left vertex lands first, the throw does not tip the part over, and the vertex that lands presses on the arm.
NAMED = {("landing", "angle"), ("release", "tipping"), ("slip", "press")}
ASKED = [about for about in ASSUMPTIONS if (about.effect, about.what) in NAMED]


def validity_slack(scene: Scene, found: InvariantIntervals) -> float:
    """Give what is to spare before an assumption of `ASKED` fails: below 0 one does.

    Parameters
    ----------
    scene : Scene
        The scene.
    found : InvariantIntervals
        Where the part is kept.

    Returns
    -------
    float
        Least over the sides, as shares of the exterior angle, of the side's length, and of the throw's impulse.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.inverse.margin.model_validity import validity_slack
    >>> from limitsets.robust.margins.invariant_set import invariant_intervals
    >>> scene = ls.load("paper-designed")
    >>> validity_slack(scene, invariant_intervals(scene.map, 12.0, 2)) > 0
    True
    """
    params = scene.bare_map
    rows = [Row(about, about.terms(scene, None)) for about in ASKED]
    sizes = {"angle": scene.sides.corner, "length": scene.sides.length, "": np.ones(len(scene.sides))}
    spare = np.inf
    for side, ends in enumerate(np.stack([found.lo, found.hi], axis=1)):
        if np.isfinite(ends).all():
            numbers = assumed(params, params, side, ends, ends)
            shares = [row.spare(numbers, side).min() / sizes[row.about.dimension][side] for row in rows]
            spare = min(spare, *shares)
    # a number that is not known is no number to rely on
    return float(spare) if np.isfinite(spare) else -9.0
