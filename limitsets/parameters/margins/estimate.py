"""Estimate of the joint margin by floats, from the least robustly positively invariant set around an orbit.

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
from typing import Any, NamedTuple

import numpy as np

from limitsets.base import as_table, picked
from limitsets.base.arrays import Array, Ints
from limitsets.feeder.scene import Scene
from limitsets.feeder.thrower import Throw
from limitsets.parameters.margins.deviations import Signs, Tolerance, corners, worst_corner
from limitsets.systems.maps import orbit
from limitsets.systems.maps.critical import margins
from limitsets.systems.maps.pieces import along

# ----------------------------------------------------------------
# The least robustly positively invariant set around an orbit, by floats: one interval of x on each side.
#
# The intervals contain the limit set with its gaps filled, and every place that landings off by up to e can lead to.  A
# search tries thousands of scenes; one set costs about as much as one orbit.  Nothing is proved here:
# `limitsets.robust` proves the result of a search.


# Throws of an orbit before it counts, and of those that count.
BEFORE, COUNTED = 300, 300
# The stretches begin with this share of the orbit's extent, about its middle, so that they end where images end.
INNER = 0.9
# Samples of a side for its changes of branch; samples of a bracket, narrowed so often before a straight line is drawn
# through it: what is left of the arm is its 25 000th part, and a line through that is off by its square.
SAMPLES, FINER, NARROWINGS = 97, 17, 2
# Images after which stretches that still grow are taken to leave, and growth that counts [length].
MOST, STILL = 400, 1e-9


class InvariantIntervals(NamedTuple):
    """Stretches that no throw leaves.

    Attributes
    ----------
    lo, hi : ndarray, shape (n,)
        Ends per side, nan on a side that is never reached [length].
    creep : ndarray, shape (n,)
        Least advance of a jog at the lower end, the noise of the landing taken off; inf where the part flips there:
        what is to spare before noise carries a part back to the joint [length].
    """

    lo: Array
    hi: Array
    creep: Array

    def threshold(self, side: int) -> float:
        """Highest place on another side, -inf if there is none."""
        others = np.delete(self.hi, side)
        return float(np.max(others[np.isfinite(others)], initial=-np.inf))


_Cuts = tuple[Array, Ints]


def _cuts(params: Throw, side: int) -> _Cuts:
    """Borders between the branches of one side, ascending from a_i to the arm's end, and the branches between."""
    a, end = float(params.a[side]), params.arm_length
    x = a + (end - a) * np.linspace(1e-4, 1.0, SAMPLES)
    values = margins(params, x, side)
    flips = values > 0.0
    borders = []
    for k in np.flatnonzero(flips[1:] != flips[:-1]):
        fine, value, j = x, values, int(k)
        for _ in range(NARROWINGS):
            fine = fine[j] + (fine[j + 1] - fine[j]) * np.linspace(0.0, 1.0, FINER)
            value = margins(params, fine, side)
            j = int(np.argmax((value > 0.0) == flips[k + 1])) - 1
        share = value[j] / (value[j] - value[j + 1])
        borders.append(float(fine[j] + share * (fine[j + 1] - fine[j])))
    branches = np.concatenate([flips[:1], flips[1:][flips[1:] != flips[:-1]]])
    return np.array([a, *borders, end]), branches.astype(np.int64)


def _parts(cuts: list[_Cuts], lo: Array, hi: Array) -> tuple[Array, Ints, Ints]:
    """Cut the stretches at the borders: pairs of ends, their sides and branches."""
    ends: list[float] = []
    sides: list[int] = []
    branches: list[int] = []
    for side, (borders, on) in enumerate(cuts):
        if not lo[side] <= hi[side]:
            continue
        for k, branch in enumerate(on.tolist()):
            below, above = max(lo[side], borders[k]), min(hi[side], borders[k + 1])
            if below < above or (below == above and lo[side] == hi[side]):
                ends += [below, above]
                sides += [side, side]
                branches += [branch, branch]
    return np.array(ends), np.array(sides, dtype=np.int64), np.array(branches, dtype=np.int64)


def least_slack(params: Throw) -> float:
    """Return the least distance between a landing from anywhere on the arm and a place where parts are lost.

    A part is lost off the arm's end, or where its left vertex comes down behind the joint.

    Examples
    --------
    >>> import limitsets as ls
    >>> least_slack(ls.load("paper-designed").map) > 0
    True
    """
    room = np.inf
    for side in range(params.a.size):
        borders, branches = _cuts(params, side)
        for k, branch in enumerate(branches.tolist()):
            after, on, _ = along(params, borders[k : k + 2], side, [branch])
            # the jog from a_i itself moves nothing
            lower = after[0] - params.a[on[0]] if k or branch else np.inf
            room = min(room, lower, params.arm_length - after[1])
    return float(room)


def invariant_intervals(
    params: Throw, x: float, side: int, *, landing: float = 0.0
) -> InvariantIntervals | None:
    """Find the least stretches, one per side, that hold an orbit and that no throw leaves.

    Parameters
    ----------
    params : Throw
        The throw map, without effects.
    x, side : float, int
        Where the orbit starts; it has to come to the limit set in some hundred throws.
    landing : float
        Every landing may be off by up to this [length].

    Returns
    -------
    InvariantIntervals or None
        None where a part may leave the arm, or comes back to the joint.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.parameters.margins.estimate import invariant_intervals
    >>> found = invariant_intervals(ls.load("paper-designed").map, 12.0, 2)
    >>> found.hi.round(4).tolist(), round(found.threshold(2), 4)
    ([19.7527, 17.4398, 23.3832], 19.7527)
    """
    path = orbit(params, x, side, BEFORE + COUNTED)
    if path.stopped is not None:
        return None
    count = params.a.size
    lo, hi = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(lo, path.side[BEFORE:], path.x[BEFORE:])
    np.maximum.at(hi, path.side[BEFORE:], path.x[BEFORE:])
    seen = lo <= hi
    middle, half = 0.5 * (lo[seen] + hi[seen]), 0.5 * INNER * (hi[seen] - lo[seen])
    lo[seen], hi[seen] = middle - half, middle + half
    cuts = [_cuts(params, side) for side in range(count)]
    for _ in range(MOST):
        ends, sides, branches = _parts(cuts, lo, hi)
        after, on, _ = along(params, ends, sides, branches[:, None])
        wider_lo, wider_hi = lo.copy(), hi.copy()
        np.minimum.at(wider_lo, on, after - landing)
        np.maximum.at(wider_hi, on, after + landing)
        if not ((wider_lo > params.a).all() and wider_hi.max() <= params.arm_length):
            return None
        still = (wider_lo >= lo - STILL) & (wider_hi <= hi + STILL)
        lo, hi = wider_lo, wider_hi
        if still.all():
            return _closed(params, cuts, lo, hi, landing)
    return None


def _closed(params: Throw, cuts: list[_Cuts], lo: Array, hi: Array, landing: float) -> InvariantIntervals:
    creep = np.full(lo.size, np.inf)
    for side, (borders, branches) in enumerate(cuts):
        if lo[side] <= hi[side] and branches[np.searchsorted(borders, lo[side]) - 1] == 0:
            after, _, _ = along(params, [lo[side]], side, [0])
            creep[side] = float(after[0] - lo[side]) - landing
    never = ~(lo <= hi)
    lo[never] = hi[never] = np.nan
    return InvariantIntervals(lo, hi, creep)


# ----------------------------------------------------------------
# Estimate of the joint margin by floats: the factor on a vector of tolerances at which a part is fed wrongly.


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


def _ways(scene: Scene, intervals: InvariantIntervals, side: int) -> Array:
    """Numbers that must not rise: the threshold, minus the reach, and what keeps the part from the joint."""
    near = np.nan_to_num(intervals.lo - scene.sides.a)
    creep = np.where(np.isfinite(intervals.creep), intervals.creep, 0.0)
    return np.concatenate([[intervals.threshold(side), -intervals.hi[side]], -near, -creep])


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
        intervals = _kept(corner, self.start, landing)
        if intervals is None or not np.isfinite(intervals.hi[self.side]):
            return math.inf, -math.inf
        # the farthest place that landings always off inward still lead to
        return intervals.threshold(self.side), float(intervals.hi[self.side]) - 2.0 * landing

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
    >>> from limitsets.parameters.margins.estimate import estimated
    >>> from limitsets.parameters.margins.deviations import Tolerance
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
        intervals = _kept(corner, fed.start, 0.0)
        if corner is None or intervals is None:
            return bare
        falls[k] = _ways(corner, intervals, side) - ways
    effects = {
        name: (float(abs(falls[k, 0])), float(abs(falls[k, 1])))
        for k, name in enumerate(tolerance.deviations)
    }
    cost = float(np.abs(falls[:, :2]).sum()) + 3.0 * tolerance.scatter
    linear = (reach - threshold) / cost if cost > 0.0 else math.inf
    if linear <= above:
        return Estimate(linear, math.nan, threshold, reach, nominal, effects)
    loaded = [*(hard or ()), *(worst_corner(row) for row in falls.T)]
    spare, top = reach - threshold, min(linear, 1e3)
    margin, x = _sought(
        fed, list(dict.fromkeys(loaded)), top, above=above, spare=spare, steps=steps, close=close
    )
    return Estimate(margin, x, threshold, reach, nominal, effects)


def failing(scene: Scene, tolerance: Tolerance, side: int, estimate: Estimate, factor: float) -> list[Signs]:
    """Give the corners of the box, stretched by a factor, at which parts are not fed at `estimate.x`.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.parameters.margins.estimate import estimated, failing
    >>> from limitsets.parameters.margins.deviations import Tolerance
    >>> scene = ls.load("paper-designed")
    >>> tolerance = Tolerance.of(scene, {"throw.speed": "1 %"})
    >>> [failing(scene, tolerance, 2, estimated(scene, tolerance, 2), factor) for factor in (3.0, 9.0)]
    [[], [(-1,), (1,)]]
    """
    fed = _Fed(scene, tolerance, side, _start(estimate, side))
    places = {signs: fed.spare(factor, signs) for signs in corners(len(tolerance.deviations))}
    return [signs for signs, (low, high) in places.items() if not low <= estimate.x <= high]


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
        estimate = estimated(scene, tolerance, side, hard=first, steps=FINE, close=FINELY)
        if estimate is None or not estimate.margin > 0.0:
            return estimate
        new = [
            signs
            for signs in failing(scene, tolerance, side, estimate, estimate.margin)
            if signs not in first
        ]
        if not new:
            return estimate
        first = new + first


def _start(estimate: Estimate, side: int) -> tuple[float, int]:
    """Give a place in the limit set, near its end: from farther in an orbit may be lost that never comes back there."""
    return estimate.reach - 0.02 * (estimate.reach - estimate.threshold), side


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
