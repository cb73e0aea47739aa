"""Films that the model itself makes, and how often the intervals of a fit hold on them (parametric bootstrap)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from limitsets.fitting.fit_result import Fit
from limitsets.fitting.fitting_run import fit
from limitsets.fitting.throws import Throws
from limitsets.maps.forced import at_points
from limitsets.scene import Scene
from limitsets.scene.arrays import throw_stack

Progress = Callable[[str, int, int], None]


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
        places + error * draw.standard_normal(n),
        sides,
        after + error * draw.standard_normal(n),
        (ends + wrong * draw.integers(1, count, n)) % count,
        np.full(n, error if error > 0.0 else np.nan),
        np.zeros(n, dtype=bool),
        np.arange(2, n + 2),
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
    for number in range(count):
        if progress is not None:
            progress("bootstrap", number, count)
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
        again = fit(scene, replace(film, row=rows.throws.row))
        for each in again.quantities:
            if each.name in covered:
                covered[each.name] += each.lo <= truth[each.name] <= each.hi
    return Bootstrap(count, covered)
