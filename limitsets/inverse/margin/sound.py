"""Whether a design stays within the minimal model: the assumptions that a fast enough throw would break.

The map goes on where its assumptions fail; there is a stable jog after most of a full turn, for one, that no real part
would do, because its other corners hit the arm first.  A search finds such places: it has to be told.  By floats, at
the two ends of each stretch, where the numbers are extreme; `limitsets.audit` looks everywhere.
"""

from __future__ import annotations

import numpy as np

from limitsets.inverse.margin.trap import Trap
from limitsets.scene import Scene
from limitsets.thrower.assumed_box import Assumed, assumed

__all__ = ["assumptions_kept"]


def assumptions_kept(scene: Scene, found: Trap) -> float:
    """Give what is to spare before an assumption fails: below 0 one does.

    The left vertex lands first (the angle turned stays below the exterior angle there), the throw does not tip the part
    over (its impulse acts within the side), and the vertex that lands presses on the arm.

    Parameters
    ----------
    scene : Scene
        The scene.
    found : Trap
        Where the part is kept.

    Returns
    -------
    float
        Least over the sides, as shares of the exterior angle, of the side's length, and of the throw's impulse.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.inverse.margin.sound import assumptions_kept
    >>> from limitsets.inverse.margin.trap import trap
    >>> scene = ls.load("paper-designed")
    >>> assumptions_kept(scene, trap(scene.map, 12.0, 2)) > 0
    True
    """
    spare, params = np.inf, scene.bare_map
    for side, ends in enumerate(zip(found.lo.tolist(), found.hi.tolist(), strict=True)):
        if not np.isfinite(ends).all():
            continue
        numbers = assumed(params, params, side, list(ends), list(ends)).mean(axis=2)
        corner, length = float(scene.sides.corner[side]), float(scene.sides.length[side])
        spare = min(
            spare,
            float((corner - numbers[:, Assumed.ANGLE]).min()) / corner,
            float(numbers[:, Assumed.UNDER].min()) / length,
            float(numbers[:, Assumed.PRESS].min()),
        )
    # a number that is not known is no number to rely on
    return float(spare) if np.isfinite(spare) else -9.0
