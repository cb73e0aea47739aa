"""Bands of attracting cells under throws with the same parameters, for `oriented_beyond` with `throws`.

docs/certificates.md, "Goals, end points, orbits", number 9.  The parameters are fixed but unknown; the landing place
differs at every throw.  Where throws rise with x the image of an interval, on which one branch is taken, ends at the
image of its upper end.  So after some throws no part rests beyond the chains of images of these ends.
"""

import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from flint import arb

from .balls import Arb, Array, Pair, float_above, float_below, float_of, prove
from .file import LENGTHS, Cells, quantity
from .moving_ends import ByAngle, Change, MovingEnd, ParameterBox
from .part import read_wide
from .scene import Scene

MOST_SAME_THROWS = 64
MOST_HALVED = 1000  # of parameters
MOST_BANDS = 200  # after a throw
ANGLE_PIECES, MOST_ANGLE_PIECES = 8, 2000  # of a range of angles, at first and at most


Limit = Change | float | None


class Interval(NamedTuple):
    """Attracting cells side by side: their ends, and the angles of throws from them."""

    side: int
    ends: Pair
    angles: Pair


class Image(NamedTuple):
    """A piece of an interval of attracting cells on which a branch is possible, and the interval that it leads to.

    The piece lies between two limits: a number, or where the branch changes; None where the interval ends.
    """

    of: int
    to: int
    side: int
    branch: int
    begin: Limit
    end: Limit


class Band(NamedTuple):
    """A part of an interval of attracting cells: beyond all of some chains, and short of all of others."""

    of: int
    lower: list[MovingEnd]
    upper: list[MovingEnd]


def intervals_of(c: Cells) -> Array:
    """Return by cell the number of its interval of attracting cells, -1 off them."""
    inside = c.component >= 0
    begins = inside & ~np.concatenate([[False], inside[:-1] & (c.side[1:] == c.side[:-1])])
    return np.where(inside, np.cumsum(begins) - 1, -1)


def images_of(c: Cells, number: Array) -> list[Image]:
    """List the images of the intervals by both branches."""
    images = []
    for branch, (array, other) in enumerate(((c.jog, c.flip), (c.flip, c.jog))):
        possible = (number >= 0) & (array[:, 0] >= 0)
        run = np.where(possible, number, -1)
        ends = np.flatnonzero(np.diff(run, prepend=-1, append=-1))
        for first, after in itertools.pairwise(ends.tolist()):
            if run[first] < 0:
                continue
            to = np.unique(number[array[first:after]])
            prove(len(to) == 1, f"{c.name(first)}: it leads to several intervals of attracting cells")
            limits = limits_of(c, first, after, number, other, branch)
            images.append(Image(int(number[first]), int(to[0]), int(c.side[first]), branch, *limits))
    return images


def limits_of(
    c: Cells, first: int, after: int, number: Array, other: Array, branch: int
) -> tuple[Limit, Limit]:
    """Find between which limits a branch is taken that is possible on the cells from `first` to before `after`."""
    decided = np.flatnonzero(other[first:after, 0] < 0) + first

    def change(since: int, until: int, rises: bool) -> Limit:
        angles = c.phi[since:until]
        return Change(int(c.side[first]), float(angles[:, 0].min()), float(angles[:, 1].max()), rises)

    begin = end = None
    if first > 0 and number[first - 1] == number[first]:
        some = len(decided) and first < decided[0]
        begin = change(first, int(decided[0]), branch == 1) if some else float(c.lower()[first])
    if after < len(number) and number[after] == number[first]:
        some = len(decided) and decided[-1] < after - 1
        end = change(int(decided[-1]) + 1, after, branch == 0) if some else float(c.upper()[after - 1])
    return begin, end


def check_angles(
    box: ParameterBox, side: int, angles: Pair, good: Callable[[ByAngle], bool], what: str
) -> None:
    """Check something of throws with a range of angles and all parameters, cut finer where needed."""
    stack, looked = list(itertools.pairwise(np.linspace(*angles, ANGLE_PIECES + 1).tolist())), 0
    while stack:
        lo, hi = stack.pop()
        looked += 1
        mid = lo + (hi - lo) / 2
        if not good(box.throw(side, arb(mid), arb(lo).union(arb(hi)))):
            prove(looked < MOST_ANGLE_PIECES and lo < mid < hi, f"side {side}: {what}")
            stack += [(lo, mid), (mid, hi)]


def check_hypotheses(box: ParameterBox, intervals: list[Interval], images: list[Image]) -> None:
    """Check that throws rise on every interval, and that what decides rises or falls where the branch changes."""
    for one in intervals:
        check_angles(
            box,
            one.side,
            one.angles,
            lambda thrown: bool(thrown.begins.by[0] > 0 and thrown.jogs_to.by[0] > 0),
            "a throw is not proved to rise with x on the attracting cells",
        )
    limits = {limit for image in images for limit in (image.begin, image.end)}
    for change in (limit for limit in limits if isinstance(limit, Change)):

        def monotone(thrown: ByAngle, rises: bool = change.rises) -> bool:
            slope = thrown.decides.by[0]
            return bool(slope > 0) if rises else bool(slope < 0)

        what = "what decides is not proved to be monotone where the branch changes"
        check_angles(box, change.side, (change.first, change.last), monotone, what)


def throws_below(
    c: Cells, scene: Scene, bad: Array, x: float, most: int, most_boxes: int = MOST_HALVED
) -> int:
    """Find after how many throws with the same parameters no part in an interval with bad cells rests beyond x.

    `bad` are all attracting cells of wrong sides that reach beyond x.  The box of all parameters is halved where bands
    do not settle it, until every part of it is settled, or one scene in it goes beyond x.
    """
    names = scene.noise if isinstance(scene.noise, dict) else {}
    same = set(names) <= {"landing.x"}
    prove(same, "with noise of the throw no two throws have the same parameters")
    prove(
        all(bool(s.concave) for s in scene.sides),
        "kappa > ell is not proved, so that there may be several impacts",
    )
    number = intervals_of(c)
    images = images_of(c, number)
    own = np.unique(number[bad & (number >= 0)]).tolist()
    prove(int(number.max(initial=-1)) < MOST_BANDS, "there are too many intervals of attracting cells")
    intervals = []
    for k in range(int(number.max(initial=-1)) + 1):
        cells = np.flatnonzero(number == k)
        angles = float(c.phi[cells, 0].min()), float(c.phi[cells, 1].max())
        ends = float(c.lower()[cells[0]]), float(c.upper()[cells[-1]])
        intervals.append(Interval(int(c.side[cells[0]]), ends, angles))
    begin = parameters_of(scene)
    check_hypotheses(begin, intervals, images)
    stack, looked, needed = [begin], 0, 1
    beyond = f"throws with the same parameters may end beyond x = {x!r} on another side"
    while stack:
        box = stack.pop()
        looked += 1
        throws, above = bands_below(box, images, intervals, own, arb(x), most)
        if not above:
            needed = max(needed, throws)
            continue
        # where one scene of the box goes beyond, no halving helps
        point = box.worst(box.enclosed(above)[0], point=True)
        prove(point is not box and not bands_below(point, images, intervals, own, arb(x), most)[1], beyond)
        k = parameter_to_halve(box, above)
        lo, hi = box.ends[k]
        cut = lo + (hi - lo) / 2
        prove(looked + len(stack) < most_boxes and lo < cut < hi, beyond)
        halves = ((lo, cut), (cut, hi))
        stack += [ParameterBox(scene, [*box.ends[:k], half, *box.ends[k + 1 :]]) for half in halves]
    return needed


def parameters_of(scene: Scene) -> ParameterBox:
    """Return the box of all parameters of a scene."""
    unit = LENGTHS[scene.unit]
    h = quantity(scene.raw["arm"]["surface_height"], "length", "arm.surface_height")
    kappa = float_below(scene.k_lo), float_above(scene.k_hi)
    own = [
        (h.lo / unit, h.hi / unit),
        *((lo, hi) for _, lo, hi in read_wide(scene.raw["part"], unit)[0].values()),
    ]
    return ParameterBox(scene, [kappa, *((float_of(lo, up=False), float_of(hi, up=True)) for lo, hi in own)])


def bands_below(
    box: ParameterBox, images: list[Image], intervals: list[Interval], own: list[int], x: Arb, most: int
) -> tuple[int, list[MovingEnd]]:
    """Throw all intervals until the bands in some of them end at x or before: the throws, or chains beyond x."""
    bands = [Band(k, [(lo,)], [(hi,)]) for k, (_, (lo, hi), _) in enumerate(intervals)]
    throws, beyond = 0, [(intervals[k].ends[1],) for k in own]
    while throws < most and len(bands) <= MOST_BANDS:
        throws += 1
        thrown = [
            image_of_band(box, image, band, intervals)
            for image in images
            for band in bands
            if band.of == image.of
        ]
        bands = apart(box, [band for band in thrown if band is not None])
        above = (
            band.upper
            for band in bands
            if band.of in own and not any(box.highest(chain) <= x for chain in band.upper)
        )
        beyond = next(above, [])
        if not beyond:
            break
    return throws, beyond


def image_of_band(box: ParameterBox, image: Image, band: Band, intervals: list[Interval]) -> Band | None:
    """Throw the part of a band within the limits of an image; None where that part is proved to be empty."""
    lower = band.lower if image.begin is None else box.extreme([*band.lower, (image.begin,)], 1)
    upper = band.upper if image.end is None else box.extreme([*band.upper, (image.end,)], -1)
    if any(box.is_below(high, low, strictly=True) for high in upper for low in lower):
        return None
    # throws rise on the angles of the interval, and on those of a chain that meet them
    own = intervals[image.of].angles
    low, high = intervals[image.to].ends
    below, above = (
        [
            (*chain, (image.side, image.branch, sign))
            for chain in chains
            if box.lies_in(chain, image.side, own)
        ]
        for chains, sign in ((lower, -1), (upper, 1))
    )
    return Band(image.to, box.extreme([*below, (low,)], 1), box.extreme([*above, (high,)], -1))


def apart(box: ParameterBox, bands: list[Band]) -> list[Band]:
    """Leave out the bands that lie in others."""

    def is_within(one: Band, other: Band) -> bool:
        return (
            one.of == other.of
            and all(any(box.is_below(low, own) for own in one.lower) for low in other.lower)
            and all(any(box.is_below(own, high) for own in one.upper) for high in other.upper)
        )

    kept: list[Band] = []
    for band in bands:
        if not any(is_within(band, other) for other in kept):
            kept = [*(other for other in kept if not is_within(other, band)), band]
    return kept


def parameter_to_halve(box: ParameterBox, chains: list[MovingEnd]) -> int:
    """Choose the parameter to halve: that along which chains neither rise nor fall, or one rises and another falls."""
    costs = []
    slopes = [place.slopes for place in box.enclosed(chains)]
    for k, off in enumerate(box.off):
        by = [each[k] for each in slopes]
        one_way = all(d >= 0 for d in by) or all(d <= 0 for d in by)
        size = max(float(d.rad() if one_way else abs(d).upper()) for d in by)
        costs.append(size * float(abs(off).upper()))
    return box.free[int(np.argmax(costs))]
