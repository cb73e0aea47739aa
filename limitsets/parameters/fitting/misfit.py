"""Whether the model fits what is left of the landings, and which misreading of a film would explain it.

Two tests, each at half the level.  Outliers: the likelihood ratio of "some landings scatter more than others" against
"all alike", its law found by drawing from the fitted model.  Structure: do residuals depend on side, branch and place
beyond what the fitted quantities can take up (F test)?
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from operator import attrgetter, mul
from typing import NamedTuple

import numpy as np

from limitsets.base import DataError
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.scene import Scene
from limitsets.feeder.scene.units import UNITS, exact_factor
from limitsets.parameters.fitting.likelihood import MISREAD, Rows, as_recorded, assigned, whitened
from limitsets.parameters.fitting.searching import (
    MEDIAN,
    Start,
    jacobian,
    quantities_of,
    robust_start,
    units_of_change,
)
from limitsets.parameters.fitting.throws import SLACK, Throws

LEVEL = 0.05
DRAWS = 1999
# Of the alternative: how large a share of the landings scatters more, and how many times more.
SHARES = np.array([0.02, 0.05, 0.1, 0.2])
WIDER = np.array([2.0, 4.0, 8.0, 20.0, 100.0])
# Weight of a number of that many standard deviations, in the robust fit of what is left (Huber's).
BEND = 1.345
ROUNDS_OF_MISFIT = 8
# Residuals that are all this small, in standard deviations, are none.
NOTHING = 1e-9
# Beyond so many robust standard deviations a row is named.
NAMED = 3.5
# Scatters up to so many robust ones, and how many of them are tried.
WIDEST, SIZES = 1.5, 16


@dataclass(frozen=True)
class Misfit:
    """What the tests say.

    Attributes
    ----------
    outliers, structure : float
        Probabilities of what is left of the landings being as far from the model's as it is, if the model held.
    strange : tuple of int
        Lines of the file whose landings are far off.
    """

    outliers: float
    structure: float | None
    strange: tuple[int, ...]

    @property
    def p(self) -> float:
        """The probability for both tests together (Bonferroni)."""
        both = [each for each in (self.outliers, self.structure) if each is not None]
        return min(1.0, len(both) * min(both))

    @property
    def lacking(self) -> bool:
        """Whether the data hold something that the model lacks."""
        return self.p < LEVEL


def misfit_of(scene: Scene, start: Start) -> Misfit:
    """Test the model by the robust fit: the most likely machine leans towards throws that no machine makes."""
    rows = start.rows
    told = rows.told(scene, start.known)
    slopes = jacobian(scene, rows, start.names, start.values, units_of_change(scene, start.names))
    # of speed and of landings: the scatter that is most likely for the landings that are not far off
    sizes = start.spread * np.linspace(0.0, WIDEST, SIZES)
    per_share = max(float(np.median(np.abs(told.per_log_speed))), 1e-12)
    speed, landing = (each.reshape(-1, 1) for each in np.meshgrid(sizes / per_share, sizes))
    landing = np.hypot(landing, 1e-7 * scene.arm_length)
    residual, log_variance = whitened(rows, told, speed, landing)
    loss = np.minimum(residual**2, NAMED**2) + log_variance
    k = [int(np.argmin(loss.sum(axis=1)))]

    def white(miss: Array | None) -> Array:
        return np.asarray(whitened(rows, told, speed[k], landing[k], miss)[0][0])

    columns = np.stack([white(column[None]) for column in slopes.T], axis=1)
    throws = rows.throws
    return misfit(white(None), columns, 2 * rows.side + rows.branch, throws.x_before, throws.row)


def misfit(residual: Array, slopes: Array, groups: Ints, x: Array, row: Ints) -> Misfit:
    """Test what is left of the landings.

    Parameters
    ----------
    residual : ndarray, shape (n,)
        Of unit variance if the model holds, from the fit.
    slopes : ndarray, shape (n, p)
        Their derivatives by the fitted quantities.
    groups : ndarray of int, shape (n,)
        Side and branch of each throw, as a number.
    x : ndarray, shape (n,)
        Place before.
    row : ndarray of int, shape (n,)
        Lines of the file.
    """
    drawn = np.random.default_rng(13).standard_normal((DRAWS, residual.size))
    cleared = _cleared(residual[None], slopes)
    ratio, others = _ratio(cleared)[0], _ratio(_cleared(drawn, slopes))
    outliers = (1.0 + np.count_nonzero(others >= ratio)) / (1.0 + DRAWS)
    strange = tuple(int(each) for each in row[np.abs(cleared[0]) > NAMED])
    return Misfit(float(outliers), _structure(residual, slopes, groups, x), strange)


def _cleared(residual: Array, slopes: Array) -> Array:
    """Take off what the quantities can take up, outliers counting little, and divide by the robust scale; (m, n)."""
    weight = np.ones_like(residual)
    left = residual
    for _ in range(ROUNDS_OF_MISFIT):
        normal = np.einsum("mn,np,nq->mpq", weight, slopes, slopes)
        pull = np.einsum("mn,np,mn->mp", weight, slopes, residual)
        left = residual - np.linalg.solve(normal, pull[..., None])[..., 0] @ slopes.T
        size = np.maximum(np.median(np.abs(left), axis=1, keepdims=True) / MEDIAN, NOTHING)
        weight = np.minimum(1.0, BEND * size / np.maximum(np.abs(left), 1e-300))
    return np.asarray(left / size)


def _ratio(z: Array) -> Array:
    """Logarithm of the likelihood ratio, the largest over share and width; shape (m,)."""
    ratio = np.full(z.shape[0], -np.inf)
    # one alternative at a time: all at once take gigabytes for a long film, and hold a Ctrl-C back
    for wide in WIDER:
        gain = np.exp(np.minimum(0.5 * z**2 * (1.0 - 1.0 / wide**2), 700.0)) / wide
        for share in SHARES:
            ratio = np.maximum(ratio, np.log1p(share * (gain - 1.0)).sum(axis=1))
    return ratio


def _structure(residual: Array, slopes: Array, groups: Ints, x: Array) -> float | None:
    """F test of a parabola in x for each side and branch, beside the slopes; None for too few throws."""
    from scipy.stats import f as f_law

    columns = [slopes]
    for group in np.unique(groups):
        own = groups == group
        if own.sum() >= 6:
            z = np.where(own, (x - x[own].mean()) / max(float(np.ptp(x[own])), 1e-12), 0.0)
            columns.append(np.stack([own.astype(float), z, z**2], axis=1))
    few, many = columns[0], np.concatenate(columns, axis=1)
    ranks = [int(np.linalg.matrix_rank(each)) for each in (few, many)]
    spare, more = residual.size - ranks[1], ranks[1] - ranks[0]
    if more < 1 or spare < 5:
        return None
    sums = [
        float(((residual - each @ np.linalg.lstsq(each, residual)[0]) ** 2).sum()) for each in (few, many)
    ]
    return float(f_law.sf((sums[0] - sums[1]) / more / (sums[1] / spare), more, spare))


# ----------------------------------------------------------------
# What was done wrong when a film was written down: the reading of the same numbers that explains the landings.
#
# A film that does not fit is read in other ways, one at a time: columns exchanged, sides counted from another side or
# the other way round, another unit, the other corner, another origin or scale.  The readings that suit the scene best
# are fitted robustly; a reading explains the film if its landings are much closer and its sides fit.


# A larger share of sides that do not fit is no accident.
MOST_MISREAD = 0.2
# Up to this share of rows that cannot be are single numbers written down wrong.
MOST_TYPED = 0.05
# The logarithm of the likelihood grows by at least this: for each throw, or in all where a number was fitted to it.
EACH, IN_ALL = 0.5, 6.0
# The probability of what is left from which the model holds: two tests in 1999 draws, one of them at its least.
PLAUSIBLE = 0.002
# Origins that are tried, in shares of the arm, and scales.
ORIGINS = np.array([-0.2, -0.1, -0.05, -0.02, 0.02, 0.05, 0.1, 0.2])
SCALES = np.array([0.5, 0.65, 0.8, 0.9, 0.96, 1.04, 1.1, 1.25, 1.5, 2.0])
# Steps to the scale of the law of Cauchy; fits of an origin or scale; other readings that are fitted.
ROUNDS, STEPS, FITTED = 30, 8, 3
# A reading by which most landings miss by more than this share of a side explains nothing.
CLOSE = 0.05
# Stands for an infinite cost where a minimum is looked for.
WORST = 1e12


class Reading(NamedTuple):
    """Throws read in another way.

    Attributes
    ----------
    said : str
        What that way explains, and what to do.
    throws : Throws
        The same numbers, read so.
    scale : float
        By how much places were scaled.
    fitted : bool
        Whether it is an origin or a scale, which was fitted; else a plain mistake.
    """

    said: str
    throws: Throws
    scale: float = 1.0
    fitted: bool = False


class _Judged(NamedTuple):
    """A reading, minus the logarithm of its likelihood (landings and sides), its robust fit; infinite without a fit."""

    reading: Reading
    cost: float
    start: Start | None


def impossible(scene: Scene, throws: Throws) -> Mask:
    """Say which throws cannot be: from or to places off the arm, on sides that the part does not have; shape (n,)."""
    count, most = len(scene.sides), (1.0 + SLACK) * scene.arm_length
    corner = (
        np.zeros(len(throws)) if throws.corner else scene.sides.a[np.minimum(throws.side_before, count - 1)]
    )
    least = -SLACK * scene.arm_length if throws.corner else 0.0
    places = (corner < throws.x_before) & (least < throws.x_after)
    places &= np.maximum(throws.x_before, throws.x_after) <= most
    return ~places | (np.maximum(throws.side_before, throws.side_after) >= count)


def doubtful(scene: Scene, start: Start) -> bool:
    """Say whether more sides do not fit than are recorded wrong by accident, or landings are far off."""
    wrong, count = start.rows.misread(len(scene.sides))
    return wrong > MOST_MISREAD * count or start.spread > _rough(scene)


def explained(
    scene: Scene, throws: Throws, error: Array, known: bool, start: Start | None, refused: DataError | None
) -> str:
    """Say how a film seems to have been measured that does not fit; empty where nothing is wrong or explains it.

    Raises
    ------
    DataError
        The film was written down in another way: which, and what to do; or what was `refused` of it.
    """
    if start is not None and not doubtful(scene, start) and not misfit_of(scene, start).lacking:
        return ""
    if refused is not None and impossible(scene, throws).sum() <= max(1, MOST_TYPED * len(throws)):
        raise refused
    reading = explanation(scene, throws, error, known, start)
    if reading is not None and (start is None or not reading.fitted):
        raise DataError(
            "what the film shows",
            "no throws of this machine",
            "throws that this machine can make",
            reading.said,
            file=throws.file or None,
        ) from refused
    if refused is not None:
        raise refused
    return "" if reading is None else reading.said


def explanation(
    scene: Scene, throws: Throws, error: Array, known: bool, start: Start | None
) -> Reading | None:
    """Find the other reading that explains a film.

    Parameters
    ----------
    scene : Scene
        The machine as far as it is known.
    throws : Throws
        The film, which may hold places off the arm and sides that the part does not have.
    error, known : ndarray, bool
        Standard deviation of a measured place, and whether it is known.
    start : Start or None
        The robust fit of the film as it stands; None where there is none.
    """

    def suits(reading: Reading) -> float:
        """Return the cost of a reading with the scene as it is."""
        rows = _rows(scene, reading, error, known)
        if rows is None:
            return math.inf
        values = {name: scene.value(name) for name in quantities_of(scene)}
        return _cost(scene, assigned(rows, scene, values, _rough(scene)), values, reading.scale)

    def fitted(reading: Reading) -> _Judged:
        """Return the cost of a reading at its best."""
        rows = _rows(scene, reading, error, known)
        with suppress(DataError):
            own = None if rows is None else robust_start(scene, rows)
            if own is not None and not doubtful(scene, own):
                return _Judged(reading, _cost(scene, own.rows, own.known, reading.scale), own)
        return _Judged(reading, math.inf, None)

    now = math.inf if start is None else _cost(scene, start.rows, start.known, 1.0)
    suited = sorted(_readings(scene, throws), key=suits)[:FITTED]
    plain = min(map(fitted, suited), key=attrgetter("cost"))
    gained = plain.start is not None and now - plain.cost > EACH * len(throws)
    if gained and _holds(scene, plain):
        return plain.reading
    closest = (_closest(suits, fitted, make, grid) for make, grid in _families(scene, throws))
    moved = min(closest, key=attrgetter("cost"))
    if now - moved.cost > IN_ALL and _holds(scene, moved):
        return moved.reading
    return plain.reading if gained and plain.cost < moved.cost else None


def _placed(said: str, throws: Throws, place: Callable[[Array], Array], scale: float = 1.0) -> Reading:
    """Read each place as another one."""
    return Reading(
        said, replace(throws, x_before=place(throws.x_before), x_after=place(throws.x_after)), scale
    )


def _readings(scene: Scene, throws: Throws) -> list[Reading]:
    """Read the same numbers in other ways, none of which has a number to be fitted."""
    unit, arm, length = throws.unit or scene.unit, scene.arm_length, scene.sides.length
    factors = {other: float(exact_factor(other, unit)) for other in UNITS["length"] if other != unit}
    sides = throws.side_before, throws.side_after
    name = "corner" if throws.corner else "x"
    what, columns = ("the centre of mass", "x") if throws.corner else ("the left corner", "corner")
    swapped = replace(throws, x_before=throws.x_after, x_after=throws.x_before)
    readings = [
        Reading(
            "before and after are exchanged: exchange the names of these columns",
            replace(swapped, side_before=sides[1], side_after=sides[0]),
        ),
        Reading(
            f"the columns {name}_before and {name}_after are exchanged: exchange their names",
            swapped,
        ),
        Reading(
            "the columns side_before and side_after are exchanged: exchange their names",
            replace(throws, side_before=sides[1], side_after=sides[0]),
        ),
        *_other_sides(len(scene.sides), throws),
        *(
            _placed(
                f"the places are in {other}: write [{other}] for [{unit}] in the header",
                throws,
                partial(mul, factor),
                factor,
            )
            for other, factor in factors.items()
        ),
        Reading(
            f"the places are those of {what}: name their columns {columns}_before and {columns}_after",
            replace(throws, corner=not throws.corner),
        ),
        _placed(
            "the places are measured from the arm's end: subtract them from the arm's length",
            throws,
            lambda place: arm - place,
        ),
    ]
    if max(map(np.max, sides)) < len(scene.sides):
        said = (
            "the places are those of the right corner: subtract the length of the side that the part rests on, and"
            " name their columns corner_before and corner_after"
        )
        places = (throws.x_before - length[sides[0]], throws.x_after - length[sides[1]])
        readings.append(Reading(said, replace(throws, x_before=places[0], x_after=places[1], corner=True)))
    return readings


def _other_sides(count: int, throws: Throws) -> list[Reading]:
    """Count the sides from another one, or the other way round."""
    both = np.stack([throws.side_before, throws.side_after])
    ways = []
    if both.max() < count or (both.min() >= 1 and both.max() == count):
        ways.append(("the sides are counted from 1: subtract 1, the scene has them from 0", both - 1))
    if both.max() < count:
        ways += [
            (f"the side that the scene calls 0 is called {k}: count the sides as the scene does", both - k)
            for k in range(2, count)
        ]
        ways += [
            (
                f"the sides are counted against the flip order, from side {k}: count them as the scene does",
                k - both,
            )
            for k in range(count)
        ]
    return [
        Reading(said, replace(throws, side_before=sides[0] % count, side_after=sides[1] % count))
        for said, sides in ways
    ]


Family = tuple[Callable[[float], Reading], Array]


def _families(scene: Scene, throws: Throws) -> tuple[Family, Family]:
    """Move the origin of places, and scale them."""

    def moved(by: float) -> Reading:
        size = f"{abs(by):.2g} {scene.unit} too {'small' if by > 0 else 'large'}"
        said = f"places seem to be {size}: measure them from the joint"
        return _placed(said, throws, lambda place: place + by)._replace(fitted=True)

    def scaled(log: float) -> Reading:
        factor = math.exp(log)
        said = f"the scale of places seems to be wrong: multiply each place by {factor:.4g}"
        return _placed(said, throws, lambda place: place * factor, factor)._replace(fitted=True)

    return (moved, ORIGINS * scene.arm_length), (scaled, np.log(SCALES))


def _closest(
    suits: Callable[[Reading], float],
    fitted: Callable[[Reading], _Judged],
    make: Callable[[float], Reading],
    grid: Array,
) -> _Judged:
    """Look for the best of a family of readings: on a grid by the scene as it is, then by fits near the best."""
    from scipy.optimize import minimize_scalar

    numbers = np.sort(np.append(grid, 0.0))
    k = int(np.argmin([suits(make(each)) for each in numbers]))
    best = minimize_scalar(
        lambda number: min(fitted(make(number)).cost, WORST),
        bounds=(numbers[max(k - 1, 0)], numbers[min(k + 1, numbers.size - 1)]),
        method="bounded",
        options={"maxiter": STEPS},
    )
    return fitted(make(float(best.x)))


def _holds(scene: Scene, judged: _Judged) -> bool:
    """Say whether the model fits as well as chance allows."""
    return judged.start is not None and misfit_of(scene, judged.start).p >= PLAUSIBLE


def _rough(scene: Scene) -> float:
    return CLOSE * float(np.mean(scene.sides.length))


def _rows(scene: Scene, reading: Reading, error: Array, known: bool) -> Rows | None:
    """Return the rows of a reading; None where it has sides that the part does not have, or places off the arm."""
    if impossible(scene, reading.throws).any():
        return None
    return as_recorded(reading.throws, error * reading.scale, known, len(scene.sides))


def _cost(scene: Scene, rows: Rows, values: dict[str, float], scale: float) -> float:
    """Return minus the logarithm of the likelihood: landings by a law of Cauchy, in places as written, and sides."""
    count = len(scene.sides)
    told = rows.told(scene, values)
    miss = np.nan_to_num(rows.throws.x_after - told.after[0], nan=scene.arm_length) / scale
    least = (1e-6 * scene.arm_length) ** 2
    square = max(float(np.median(miss**2)), least)
    for _ in range(ROUNDS):
        square = max(square * 2.0 * float(np.mean(miss**2 / (square + miss**2))), least)
    wrong, _ = rows.misread(count)
    landings = float(np.sum(0.5 * math.log(square) + np.log1p(miss**2 / square)))
    return landings + wrong * math.log((count - 1) / MISREAD)
