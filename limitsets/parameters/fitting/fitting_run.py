"""`limitsets.fit`: a scene's quantities from filmed throws; and films that the model makes, to test the intervals."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from limitsets.base import (
    AnswerError,
    DataError,
    Progress,
    arguments_checked,
    one_by_one,
    shown_in_notebooks,
    silent,
)
from limitsets.base.arrays import Array
from limitsets.feeder.scene import Scene, load, throw_stack
from limitsets.feeder.scene.quantities import base_unit, find
from limitsets.parameters.fitting.fit_result import Fit, Fitted, Scatter, fitted_scene
from limitsets.parameters.fitting.likelihood import (
    SCATTERS,
    SHARPEST,
    Likelihood,
    Rows,
    as_recorded,
    further_throws,
)
from limitsets.parameters.fitting.misfit import explained, misfit_of
from limitsets.parameters.fitting.searching import (
    LEVEL,
    RADIUS,
    End,
    Maximum,
    Start,
    largest,
    profiles,
    robust_start,
    spread_of,
    threshold_of,
    units_of_change,
)
from limitsets.parameters.fitting.throws import Throws, length_of, read_throws, throws_in
from limitsets.systems.maps.pieces import at_points

# Differences of readings of one place from which an error of measurement is taken.
READ_TWICE = 10
# A scatter this small beside the end of its interval is none.
NOTHING = 1e-3


@shown_in_notebooks
@arguments_checked
def fit(
    scene: Scene | str | Path,
    throws: Throws | str | Path,
    *,
    error: float | str | None = None,
    progress: Progress | None = None,
) -> Fit:
    """Fit a scene to filmed throws.

    Parameters
    ----------
    scene : Scene, str or Path
        The machine as far as it is known, in the minimal model; the sides of the part stay as they are.
    throws : str, Path or Throws
        A CSV file (`limitsets.fitting.read_throws`), or throws that were read.
    error : str or float, optional
        Standard deviation of a measured place, "0.5 mm" or in the scene's unit, where the file has no such column.
        Where neither is given it is taken from places that were read twice (column `run`), and without these it counts
        as unknown: the scatter is then an upper bound.
    progress : callable, optional
        Called with what is done, how much of it, and of how much.

    Returns
    -------
    Fit
        Values with 95 % intervals, scatter, misrecorded sides, whether the model fits, the scene that has it all.

    Raises
    ------
    DataError
        A file that cannot be read, or throws that cannot be; the first thing wrong, with its row and column.
    AnswerError
        A scene with effects.

    Examples
    --------
    >>> import limitsets as ls
    >>> import numpy as np
    >>> from limitsets.fitting import simulated_throws
    >>> truth = ls.load("paper-designed")
    >>> film = simulated_throws(truth, np.linspace(8, 23, 48), [0, 1, 2] * 16, error=0.02, speed=0.002, seed=1)
    >>> found = ls.fit(truth.with_values({"throw.speed": "155 deg/s"}), film)
    >>> bool(found["throw.speed"].lo < truth.value("throw.speed") < found["throw.speed"].hi)
    True
    """
    begin = time.perf_counter()
    chosen = load(scene)
    if chosen.effects.on():
        raise AnswerError(
            "the scene's effects", ", ".join(chosen.effects.on()), "the minimal model", "leave [effects] out"
        )
    film, refused = _film(throws, chosen)
    known, errors = _errors(film, error, chosen)
    tell = progress or silent
    tell("robust least squares", 0, 3)
    start = None
    if refused is None:
        try:
            start = robust_start(chosen, as_recorded(film, errors, known, len(chosen.sides)))
        except DataError as error_found:
            refused = error_found
    remark = explained(chosen, film, errors, known, start, refused)
    assert start is not None
    tell("maximum likelihood", 1, 3)
    own, best = largest(chosen, start)
    tell("profiles", 2, 3)
    threshold = threshold_of(1, len(film), len(start.names))
    best, ends = profiles(own, best, threshold, start)
    return _answer(chosen, own, best, ends=ends, start=start, threshold=threshold, remark=remark, begin=begin)


def _film(throws: Throws | str | Path, scene: Scene) -> tuple[Throws, DataError | None]:
    """Return the throws, and what is wrong with their places and sides if something is."""
    if isinstance(throws, Throws):
        return throws, None
    try:
        return read_throws(throws, scene), None
    except DataError as refused:
        return throws_in(throws, scene, anywhere=True), refused


def _errors(film: Throws, error: float | str | None, scene: Scene) -> tuple[bool, Array]:
    """Return whether the errors of measured places are known, and their standard deviations [length]."""
    column = bool(np.isfinite(film.error).all())
    if error is not None:
        if column:
            raise DataError(
                "the error",
                "given twice",
                "an option or a column",
                "leave --error or the column out",
                file=film.file or None,
            )
        return True, np.full(len(film), length_of(error, scene, "the error"))
    if column:
        return True, film.error
    if film.read_twice.size >= READ_TWICE:
        return True, np.full(len(film), spread_of(film.read_twice) / math.sqrt(2.0))
    return False, np.zeros(len(film))


def _answer(
    scene: Scene,
    own: Likelihood,
    best: Maximum,
    ends: list[tuple[End, End]],
    start: Start,
    threshold: float,
    remark: str,
    begin: float,
) -> Fit:
    values = own.values(best.at)[0]
    held, undetermined, quantities = dict(start.held), dict(start.undetermined), []
    for k, name in enumerate(own.names):
        lo, hi = (float(own.centre[k] + own.scale[k] * end.at) for end in ends[k])
        open_ends = sum(end.wall or math.isinf(end.at) for end in ends[k])
        if name == RADIUS and open_ends == len(ends[k]):
            others = undetermined.pop(name, "")
            why = "no decision between jog and flip depends on it closely enough"
            held[name] = f"the decisions do not tell it apart from {others}" if others else why
            values[k] = scene.value(name)
            continue
        value = float(values[k])
        if name == RADIUS:  # between a jog and a flip nothing is more likely than the rest
            value = min(max(scene.value(name), lo), hi) if open_ends else 0.5 * (lo + hi)
        unit = base_unit(find(name).dimension, scene.unit)
        quantities.append(Fitted(name, value, lo, hi, unit, not open_ends))
    scatters = []
    for k in range(SCATTERS):
        j = len(own.names) + k
        lo, hi = (float(own.scale[j] * end.at) for end in ends[j])
        if math.isinf(lo) and values[j] < NOTHING * hi:
            values[j] = 0.0
        scatters.append(Scatter(float(values[j]), max(lo, 0.0), hi, not own.rows.known))
    fitted = tuple(quantities)
    speed, landing = scatters
    new = fitted_scene(scene, fitted, speed, landing)
    told = own.told(values[None])
    loose = math.hypot(values[-1], SHARPEST * scene.arm_length)
    names, throws = tuple(each.name for each in fitted), own.rows.throws
    # where no error is known the gain of further throws is computed with all scatter as one
    error = own.rows.error if own.rows.known else np.full(len(throws), landing.value / math.sqrt(2.0))
    units = dict(zip(names, units_of_change(new, names).tolist(), strict=True))
    misread, misread_rate = _misread(own.rows, len(scene.sides))
    return Fit(
        scene=new,
        given=scene,
        rows=own.rows,
        quantities=fitted,
        held=held,
        undetermined=undetermined,
        speed=speed,
        landing=landing,
        error=float(np.mean(own.rows.error)) if own.rows.known else None,
        misread=misread,
        misread_rate=misread_rate,
        misfit=misfit_of(scene, start),
        explained=remark,
        residuals=throws.x_after - told.after[0],
        deviations=np.sqrt(told.variance(own.rows.error, values[-2], loose)[0]),
        further=further_throws(
            throws, own.rows.side, error, scene=new, units=units, scatter=(speed.value, landing.value)
        ),
        seconds=time.perf_counter() - begin,
        likelihood=own,
        best=best,
        threshold=threshold,
    )


def _misread(
    rows: Rows, sides: int
) -> tuple[tuple[tuple[int, str, int, int], ...], tuple[float, float, float]]:
    """Name misrecorded sides, and give their share with its exact interval (Clopper and Pearson)."""
    from scipy.stats import beta

    throws, after = rows.throws, rows.side_after(sides)
    readings = (
        ("side_before", throws.side_before, rows.side, rows.misread_before()),
        ("side_after", throws.side_after, after, rows.misread_after(sides)),
    )
    lines = [
        (int(throws.row[k]), name, int(recorded[k]), int(fits[k]))
        for name, recorded, fits, misread in readings
        for k in np.flatnonzero(misread)
    ]
    wrong, count = rows.misread(sides)
    tail = 0.5 * (1.0 - LEVEL)
    lo = float(beta.ppf(tail, wrong, count - wrong + 1)) if wrong else 0.0
    return tuple(sorted(lines)), (wrong / count, lo, float(beta.ppf(1.0 - tail, wrong + 1, count - wrong)))


# ----------------------------------------------------------------
# Films that the model itself makes, and how often the intervals of a fit hold on them (parametric bootstrap).


def simulated_throws(
    scene: Scene,
    x: ArrayLike,
    side: ArrayLike,
    *,
    error: float = 0.0,
    speed: float = 0.0,
    landing: float = 0.0,
    misread: float = 0.0,
    corner: bool = False,
    seed: int = 0,
) -> Throws:
    """Throw a part once from each place, and film it.

    Parameters
    ----------
    scene : Scene
        The machine, in the minimal model.
    x, side : array_like, shape (n,)
        Where the centre of mass of the part really is [length], and on which side the part lies.
    error : float
        Standard deviation of each measured place [length].
    speed, landing : float
        Of the speed of a throw (share), and of where it lands [length].
    misread : float
        Probability that a side after a throw is recorded wrong.
    corner : bool
        Whether the film shows the left corner of the side that the part rests on, not the centre of mass.
    seed : int
        Of the random numbers.

    Returns
    -------
    Throws

    Examples
    --------
    >>> import limitsets as ls
    >>> film = simulated_throws(ls.load("paper-designed"), [8.0, 21.0], [2, 2])
    >>> film.x_after.round(6).tolist(), film.side_after.tolist()
    ([8.262013, 16.552531], [2, 0])
    """
    draw = np.random.default_rng(seed)
    places = np.asarray(x, dtype=np.float64)
    sides = np.asarray(side, dtype=np.int64)
    n = places.size
    # faster by a share: kappa = g / w^2 goes the other way, twice
    kappa = scene.kappa / (1.0 + speed * draw.standard_normal(n)) ** 2
    params = throw_stack(scene, {"throw.kappa": kappa}).params
    jogs, _, decides = (each.diagonal() for each in at_points(params, places, sides, np.zeros(n, np.int64)))
    flips = at_points(params, places, sides, np.ones(n, np.int64))[0].diagonal()
    flipped, count = decides > 0.0, len(scene.sides)
    after = np.where(flipped, flips, jogs) + landing * draw.standard_normal(n)
    ends = (sides + flipped) % count
    wrong = draw.random(n) < misread
    if corner:
        places, after = places - scene.sides.a[sides], after - scene.sides.a[ends]
    return Throws(
        x_before=places + error * draw.standard_normal(n),
        side_before=sides,
        x_after=after + error * draw.standard_normal(n),
        side_after=(ends + wrong * draw.integers(1, count, n)) % count,
        error=np.full(n, error if error > 0.0 else np.nan),
        follows=np.zeros(n, dtype=bool),
        row=np.arange(2, n + 2),
        corner=corner,
    )


@dataclass(frozen=True)
class Bootstrap:
    """How the intervals of a fit do on films of the fitted machine itself.

    Attributes
    ----------
    count : int
        Films.
    covered : dict of str to int
        In how many of them the interval of each quantity holds the fitted value.
    """

    count: int
    covered: dict[str, int]


def bootstrap(found: Fit, count: int = 200, *, seed: int = 0, progress: Progress | None = None) -> Bootstrap:
    """Film the fitted machine again and again from the same places, and fit each film.

    Parameters
    ----------
    found : Fit
        A fit.
    count : int
        Films; 95 % intervals hold in 179 to 199 of 200.
    seed : int
        Of the random numbers.
    progress : callable, optional
        Called with what is done, how much of it, and of how much.
    """
    rows, own = found.rows, found.likelihood
    scene = found.given.with_values({each.name: each.value for each in found.quantities})
    corner = rows.throws.corner
    read = rows.throws.x_before + (scene.sides.a[rows.side] if corner else 0.0)
    inside = np.clip(read, None, scene.arm_length)
    truth = {name: scene.value(name) for name in own.names}
    covered = dict.fromkeys((each.name for each in found.quantities), 0)
    for number in one_by_one("bootstrap", range(count), count, progress):
        film = simulated_throws(
            scene,
            inside,
            rows.side,
            error=found.error or 0.0,
            speed=found.speed.value,
            landing=found.landing.value,
            corner=corner,
            seed=seed + number,
        )
        for each in fit(scene, replace(film, row=rows.throws.row)).quantities:
            if each.name in covered:
                covered[each.name] += each.lo <= truth[each.name] <= each.hi
    return Bootstrap(count, covered)
