"""A step of a march along a function that cannot pass over its first root.

Where f'' >= -bound, f stays positive up to the positive root of the parabola f + f' t - bound t^2/2.  Near a simple
root such steps shrink quadratically, near a touching one geometrically.
"""

from __future__ import annotations

import math

from limitsets.jit import kernel

# Steps below this fraction of where the march has got to no longer move it.
STILL = 2.0**-52


@kernel
def sure_step(f: float, slope: float, bound: float) -> float:
    """How far a function surely stays positive that is f > 0 now, rises by `slope` and bends by `bound` at most."""
    root = math.sqrt(slope * slope + 2.0 * bound * f)
    return (slope + root) / bound if slope > 0.0 else 2.0 * f / (root - slope)
