"""Estimate of the joint margin by floats: the factor on a vector of tolerances at which a part is fed wrongly.

Fed at X on a side means: every part at rest beyond X lies on the side, and parts come to rest there.  With
every quantity off by s tolerances the highest place T(s) on another side has risen, the farthest place R(s) on the
side has come down, and some X serves every scene in the box as long as T(s) <= R(s).  Both are nearly linear: their
worst corners are found by differences.  Where an itinerary changes they jump; corners that failed before
("hard" corners) are tried first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.files import as_table, picked
from limitsets.robust.margins.invariant_set import InvariantIntervals, invariant_intervals
from limitsets.robust.margins.vector import Signs, Tolerance, corners, worst_corner
from limitsets.scene import Scene

Array = NDArray[np.float64]

# Steps towards the margin between two factors.
STEPS = 5
# How close the ends of that search come to each other, as a share.
CLOSE = 0.005
# The same for designs that are looked at on all corners.
FINE, FINELY = 20, 2e-4


@dataclass(frozen=True, eq=False)
class Estimate:
    """A joint margin by floats.

    Attributes
    ----------
    margin : float
        Factor on the tolerance up to which parts are fed at `x`; 0 or below where they are not even as it is.
    x : float
        The X that lasts longest [length].
    threshold, reach : float
        Of the scene as it is: X may lie between them [length].
    invariant : InvariantIntervals
        Where the part is kept, the scene as it is.
    effects : dict of str to (float, float)
        By how much one tolerance of each quantity raises the threshold and lowers the reach, at worst.
    """

    margin: float
    x: float
    threshold: float
    reach: float
    invariant: InvariantIntervals
    effects: dict[str, tuple[float, float]]

    def to_json(self) -> dict[str, Any]:
        """Give it as a plain table for JSON, without where the part is kept."""
        return as_table(**picked(self, "margin", "x", "threshold", "reach", "effects"))


def _kept(scene: Scene | None, start: tuple[float, int], landing: float) -> InvariantIntervals | None:
    if scene is None or not (scene.sides.a[start[1]] < start[0] < scene.arm_length):
        return None
    return invariant_intervals(scene.bare_map, *start, landing=landing)


def _ways(scene: Scene, found: InvariantIntervals, side: int) -> Array:
    """Numbers that must not rise: the threshold, minus the reach, and what keeps the part from the joint."""
    near = np.nan_to_num(found.lo - scene.sides.a)
    creep = np.where(np.isfinite(found.creep), found.creep, 0.0)
    return np.concatenate([[found.threshold(side), -found.hi[side]], -near, -creep])


class _Fed:
    """One scene, asked at several factors."""

    def __init__(self, scene: Scene, tolerance: Tolerance, side: int, start: tuple[float, int]) -> None:
        self.scene, self.tolerance, self.side, self.start = scene, tolerance, side, start

    def spare(self, factor: float, signs: Signs) -> tuple[float, float]:
        """Threshold and reach at a corner; inf and -inf where the part is not kept."""
        landing = factor * self.tolerance.scatter
        corner = self.tolerance.scene_at(self.scene, factor, signs)
        # over a surface at the joint's height nothing is proved: jogs there move a part neither out nor in
        if corner is None or not corner.surface_height * self.scene.surface_height > 0.0:
            return math.inf, -math.inf
        found = _kept(corner, self.start, landing)
        if found is None or not np.isfinite(found.hi[self.side]):
            return math.inf, -math.inf
        # the farthest place that landings always off inward still lead to
        return found.threshold(self.side), float(found.hi[self.side]) - 2.0 * landing

    def all(self, factor: float, loaded: list[Signs]) -> tuple[float, float, Signs | None]:
        """Threshold and reach over corners, and the corner at which they cross, which moves to the front."""
        highest, least = -math.inf, math.inf
        for k, signs in enumerate(loaded):
            threshold, reach = self.spare(factor, signs)
            highest, least = max(highest, threshold), min(least, reach)
            if highest > least:
                loaded.insert(0, loaded.pop(k))
                return highest, least, signs
        return highest, least, None


def estimated(
    scene: Scene,
    tolerance: Tolerance,
    side: int,
    *,
    start: tuple[float, int] | None = None,
    hard: list[Signs] | None = None,
    above: float = 0.0,
    steps: int = STEPS,
    close: float = CLOSE,
) -> Estimate | None:
    """Find the joint margin and the best X by floats.

    Parameters
    ----------
    scene : Scene
        The scene, in the minimal model.
    tolerance : Tolerance
        The tolerance that s multiplies.
    side : int
        The side on which parts are to be fed.
    start : (float, int), optional
        Where an orbit starts that leads to the limit set; default: a third up the arm, on the side.
    hard : list of tuple of int, optional
        Corners that are tried first, besides those that differences point at.
    above : float
        Margins below this are of no interest: they are bounded only.
    steps : int
        How often a factor is tried at most.
    close : float
        How close a factor that holds and one that does not have to be, as a share.

    Returns
    -------
    Estimate or None
        None where the part leaves the arm or never lies on the side.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.robust.margins.estimate import estimated
    >>> from limitsets.robust.margins.vector import Tolerance
    >>> scene = ls.load("paper-designed")
    >>> found = estimated(scene, Tolerance.of(scene, {"throw.speed": "1 %"}), 2)
    >>> round(found.threshold, 3), round(found.reach, 3), found.threshold < found.x < found.reach
    (19.753, 23.383, True)
    """
    begin = start if start is not None else (scene.arm_length / 3.0, side)
    nominal = _kept(scene, begin, 0.0)
    if nominal is None or not np.isfinite(nominal.hi[side]) or not math.isfinite(nominal.threshold(side)):
        return None
    threshold, reach = nominal.threshold(side), float(nominal.hi[side])
    if threshold >= reach:
        return Estimate((reach - threshold) / reach, math.nan, threshold, reach, nominal, {})
    bare = Estimate(0.0, math.nan, threshold, reach, nominal, {})
    fed = _Fed(scene, tolerance, side, _start(bare, side))
    ways = _ways(scene, nominal, side)
    falls = np.zeros((len(tolerance.deviations), ways.size))
    for k in range(len(tolerance.deviations)):
        sizes = [float(j == k) for j in range(len(tolerance.deviations))]
        corner = tolerance.scene_at(scene, 1.0, sizes)
        found = _kept(corner, fed.start, 0.0)
        if corner is None or found is None:
            return bare
        falls[k] = _ways(corner, found, side) - ways
    effects = {
        name: (float(abs(falls[k, 0])), float(abs(falls[k, 1])))
        for k, name in enumerate(tolerance.deviations)
    }
    cost = float(np.abs(falls[:, :2]).sum()) + 3.0 * tolerance.scatter
    linear = (reach - threshold) / cost if cost > 0.0 else math.inf
    if linear <= above:
        return Estimate(linear, math.nan, threshold, reach, nominal, effects)
    loaded = list(hard or [])
    loaded += [worst_corner(row) for row in falls.T]
    spare, top = reach - threshold, min(linear, 1e3)
    margin, x = _sought(fed, list(dict.fromkeys(loaded)), top, above, spare, steps, close)
    return Estimate(margin, x, threshold, reach, nominal, effects)


def failing(scene: Scene, tolerance: Tolerance, side: int, found: Estimate, factor: float) -> list[Signs]:
    """Give the corners of the box, stretched by a factor, at which parts are not fed at `found.x`.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.robust.margins.estimate import estimated, failing
    >>> from limitsets.robust.margins.vector import Tolerance
    >>> scene = ls.load("paper-designed")
    >>> tolerance = Tolerance.of(scene, {"throw.speed": "1 %"})
    >>> [failing(scene, tolerance, 2, estimated(scene, tolerance, 2), factor) for factor in (3.0, 9.0)]
    [[], [(-1,), (1,)]]
    """
    fed = _Fed(scene, tolerance, side, _start(found, side))
    wrong = []
    for signs in corners(len(tolerance.deviations)):
        threshold, reach = fed.spare(factor, signs)
        if not threshold <= found.x <= reach:
            wrong.append(signs)
    return wrong


def on_all_corners(
    scene: Scene, tolerance: Tolerance, side: int, hard: Sequence[Signs] = ()
) -> Estimate | None:
    """Find the margin on all corners: those at which it fails are put first, and it is sought anew.

    What it gives holds at every corner at that very factor and X.  A corner is found to fail once at most.

    Parameters
    ----------
    scene, tolerance, side
        As for `estimated`.
    hard : sequence of tuple of int
        Corners to begin with.
    """
    first = list(hard)
    while True:
        found = estimated(scene, tolerance, side, hard=first, steps=FINE, close=FINELY)
        if found is None or not found.margin > 0.0:
            return found
        new = [signs for signs in failing(scene, tolerance, side, found, found.margin) if signs not in first]
        if not new:
            return found
        first = new + first


def _start(found: Estimate, side: int) -> tuple[float, int]:
    """Give a place in the limit set, near its end: from farther in an orbit may be lost that never comes back there."""
    return found.reach - 0.02 * (found.reach - found.threshold), side


def _sought(
    fed: _Fed, loaded: list[Signs], top: float, above: float, spare: float, steps: int, close: float
) -> tuple[float, float]:
    """Close in on the margin between 0 (or `above`) and a little over its linear estimate."""
    good, bad, x = 0.0, 1.05 * top, math.nan
    factor = above if above > 0.0 else 0.98 * top
    under = 1.0 - 0.4 * close
    for _ in range(steps):
        highest, least, failed = fed.all(factor, loaded)
        if failed is None:
            good, x = factor, 0.5 * (highest + least)
            # T and R close in on each other about evenly
            ahead = factor * spare / max(spare - (least - highest), 1e-9)
            factor = min(
                max(under * ahead, 0.9 * good + 0.1 * bad), 0.5 * (good + bad) if ahead > bad else bad
            )
        else:
            bad = factor
            if factor == above:
                return 0.97 * above, math.nan
            crossed = math.isfinite(highest - least)
            ahead = factor * spare / (spare - (least - highest)) if crossed else 0.0
            factor = max(under * ahead, 0.5 * (good + bad)) if crossed else 0.5 * (good + bad)
        if bad - good < close * bad:
            break
    return good, x
