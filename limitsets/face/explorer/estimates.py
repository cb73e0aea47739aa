"""Knobs, the numbers that sliders move, and their estimates in some 10 ms: attractors, basins, the goal's threshold.

Cells give the attractors and their basins; the compiled loop of the atlas then gives the ends of each attractor to the
last digits, if it can decide them.  Both are estimates: no rounding is enclosed, and images of cells are sampled.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from limitsets.base import LimitsetsError, shown
from limitsets.base.arrays import Array
from limitsets.face.plot.basin import strips_of
from limitsets.feeder.geometry import side_ends
from limitsets.feeder.geometry.polygon import above_side
from limitsets.feeder.goals import OrientedBeyond, Reaches
from limitsets.feeder.scene import Scene
from limitsets.feeder.scene.quantities import STANDARD_GRAVITY, replaced, text_at
from limitsets.feeder.scene.scene import in_unit_of, unit_of
from limitsets.feeder.scene.units import UNITS, convert, exact_factor, parse, written
from limitsets.systems.cells import Domain, grid
from limitsets.systems.graph import transitions
from limitsets.systems.maps import Orbit, critical_points, has_slope, kind_of, orbit
from limitsets.systems.maps.pieces import stacked
from limitsets.systems.sets import Attractor, attractors, basins
from limitsets.systems.sets.topology import Topologies, topologies
from limitsets.systems.sets.topology.work import DECIDED

# ----------------------------------------------------------------
# Knobs: the numbers of a scene, or of a map, that sliders move, and the scene or map after a move.


# Largest number of point masses with sliders; more would be a table, not a picture.
MOST_POINTS = 3
STEPS = 400
# Ends of the slider of a point mass, as factors: a mass cannot be 0.
LIGHTEST, HEAVIEST = 0.1, 3.0
# Digits of the ends of sliders: what a conversion of units adds behind them is no end that people read.
DIGITS = 12
GOAL_X = "goal.x"
"""The knob of a goal's x, which is no quantity: it has no margin, and no axis of an atlas."""


class Knob(NamedTuple):
    """A number that a slider moves.

    Attributes
    ----------
    name : str
        The quantity of the scene, `GOAL_X`, or the field of the map's parameters.
    words : str
        The name on the page.
    unit : str
        Its unit; empty for a map.
    value, lo, hi : float
        The value, and the ends of the slider, in this unit.
    """

    name: str
    words: str
    unit: str
    value: float
    lo: float
    hi: float

    @property
    def step(self) -> float:
        """The step of an arrow key: a round number, about 1/400 of the slider."""
        rough = (self.hi - self.lo) / STEPS
        ten = 10.0 ** math.floor(math.log10(rough))
        return float(f"{ten * min((1, 2, 5, 10), key=lambda each: abs(each * ten - rough)):.3g}")

    def read(self, text: str) -> float:
        """Read a typed value: a number in the knob's unit, or with its own unit.

        Raises
        ------
        LimitsetsError
            It is no such quantity.

        Examples
        --------
        >>> Knob("throw.speed", "speed", "deg/s", 150.0, 100.0, 200.0).read("2.5 rad/s")
        143.23...
        """
        words = text.strip()
        try:
            value = float(words)
        except ValueError:
            if not self.unit:
                raise LimitsetsError(self.words, shown(words), "a number", "correct it") from None
            dimension = next(each for each, units in UNITS.items() if self.unit in units)
            value = convert(parse(words, dimension, key=self.name), self.unit)
        if not math.isfinite(value):
            raise LimitsetsError(self.words, shown(words), "a finite number", "correct it")
        return value

    @property
    def title(self) -> str:
        """The name with the unit."""
        return f"{self.words} [{self.unit}]" if self.unit else self.words


def knobs_of(scene: Scene) -> tuple[Knob, ...]:
    """List the knobs of a scene, each in the unit in which the scene writes its number.

    Examples
    --------
    >>> import limitsets as ls
    >>> [knob.words for knob in knobs_of(ls.load("paper-designed"))][2:]
    ['speed', 'height of the surface', 'tilt', 'length of the arm', 'X of the goal']
    """
    if scene.gravity is None:
        throw = _knob(scene, "throw.kappa", "kappa", scene.kappa, (0.5 * scene.kappa, 1.5 * scene.kappa))
    else:
        speed = scene.value("throw.speed")
        throw = _knob(scene, "throw.speed", "speed", speed, (0.7 * speed, 1.3 * speed))
    height, end = scene.surface_height, scene.arm_length
    heights = min(-0.05 * end, 1.5 * height), max(0.05 * end, 1.5 * height)
    arm = (
        _knob(scene, "arm.surface_height", "height of the surface", height, heights),
        *_of_gravity(scene),
        _knob(scene, "arm.length", "length of the arm", end, (0.7 * end, 1.3 * end)),
    )
    return (*_of_mass(scene), throw, *arm, *_of_goal(scene))


def _knob(scene: Scene, name: str, words: str, value: float, ends: tuple[float, float]) -> Knob:
    """Give the knob of a quantity whose value and ends are in the scene's units (`Scene.value`)."""
    numbers = (float(f"{in_unit_of(scene, name, each):.{DIGITS}g}") for each in (value, *ends))
    return Knob(name, words, unit_of(scene, name), *numbers)


def _of_goal(scene: Scene) -> list[Knob]:
    """Give X of a goal that has one; parts rest below the arm's length."""
    if not isinstance(scene.goal, OrientedBeyond | Reaches):
        return []
    given = parse(scene.text["goal"][scene.goal.kind]["x"], "length")
    end = 0.99 * scene.arm_length * float(exact_factor(scene.unit, given.unit))
    return [Knob(GOAL_X, "X of the goal", given.unit, float(given.number), 0.0, float(f"{end:.{DIGITS}g}"))]


def _of_mass(scene: Scene) -> list[Knob]:
    tree = scene.text
    if text_at(tree, "part.mass.center.along") is not None:
        along, above = (scene.value(f"part.mass.center.{word}") for word in ("along", "above"))
        side = tree["part"]["mass"]["center"]["side"]
        left, right = side_ends(len(scene.vertices), side)
        measured = [
            above_side(scene.vertices[left], scene.vertices[right], corner) for corner in scene.vertices
        ]
        reach, heights = ([float(each[axis]) for each in measured] for axis in (0, 1))
        ends = min(reach), max(reach)
        return [
            _knob(scene, "part.mass.center.along", "centre of mass, along", along, ends),
            _knob(scene, "part.mass.center.above", "centre of mass, above", above, (0.0, max(heights))),
        ]
    knobs = []
    lo, hi = scene.vertices.min(axis=0), scene.vertices.max(axis=0)
    for k in range(min(len(tree["part"]["mass"].get("points", [])), MOST_POINTS)):
        for axis, word in enumerate("xy"):
            name = f"part.mass.points[{k}].{word}"
            ends = float(lo[axis]), float(hi[axis])
            knobs.append(_knob(scene, name, f"point mass {k}, {word}", scene.value(name), ends))
        name = f"part.mass.points[{k}].mass"
        mass = scene.value(name)
        knobs.append(_knob(scene, name, f"point mass {k}, mass", mass, (LIGHTEST * mass, HEAVIEST * mass)))
    return knobs


def _of_gravity(scene: Scene) -> list[Knob]:
    """Give the tilt of the table; none where gravity is unknown, or stronger than a tilt could make it."""
    if scene.gravity is None:
        return []
    sine = scene.gravity / convert(parse(STANDARD_GRAVITY, "acceleration"), f"{scene.unit}/s^2")
    if sine > 1.0 + 1e-9:
        return []
    ends = math.radians(5.0), math.radians(90.0)
    return [_knob(scene, "gravity.tilt", "tilt", math.asin(min(sine, 1.0)), ends)]


def scene_with(scene: Scene, knobs: tuple[Knob, ...], values: Mapping[str, float]) -> Scene:
    """Give the scene with its knobs at other values; quantities that were not moved stay as they are written.

    A tilt that is moved leaves the speed of the machine as it is, whether the scene gives a speed or kappa.

    Raises
    ------
    SceneError
        There is no such scene.

    Examples
    --------
    >>> import limitsets as ls
    >>> scene = ls.load("paper-designed")
    >>> scene_with(scene, knobs_of(scene), {"gravity.tilt": 90.0}).kappa  # twice the gravity of 30 deg
    50.75...
    """
    moved = [knob for knob in knobs if values.get(knob.name, knob.value) != knob.value]
    texts = {knob.name: written(values[knob.name], knob.unit) for knob in moved}
    if "gravity.tilt" in texts and "throw.speed" not in texts:
        speed = next(knob for knob in knobs if knob.name == "throw.speed")
        texts["throw.speed"] = written(speed.value, speed.unit)
    if not texts:
        return scene
    x = texts.pop(GOAL_X, None)
    tree = replaced(scene.text, scene.unit, scene.file, texts)
    if x is not None and scene.goal is not None:
        tree["goal"][scene.goal.kind]["x"] = x
    return Scene.of(tree, scene.file)  # of all numbers at once: an arm and an X may be possible only together


def centre_at(scene: Scene, x: float, y: float) -> dict[str, float]:
    """Say where a point of the part's frame is along and above the side from which the scene gives its centre of mass.

    The values are in the units of the knobs.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = centre_at(ls.load("paper-designed"), *ls.load("paper-designed").centre)
    >>> [round(value, 6) for value in found.values()]
    [4.225578, 0.708249]
    """
    left, right = side_ends(len(scene.vertices), scene.text["part"]["mass"]["center"]["side"])
    along, above, _ = above_side(scene.vertices[left], scene.vertices[right], (x, y))
    places = {"part.mass.center.along": float(along), "part.mass.center.above": float(above)}
    return {name: in_unit_of(scene, name, value) for name, value in places.items()}


def knobs_of_map(params: Any) -> tuple[Knob, ...]:
    """List the numbers among a map's parameters.

    Examples
    --------
    >>> from limitsets import maps
    >>> [(knob.name, knob.lo, knob.hi) for knob in knobs_of_map(maps.Henon())]
    [('a', 0.7, 2.1), ('b', 0.15, 0.45)]
    """
    knobs = []
    for name, value in zip(params._fields, params, strict=True):
        if isinstance(value, float | int | np.floating):
            ends = sorted((0.5 * float(value), 1.5 * float(value))) if value else [-1.0, 1.0]
            knobs.append(Knob(name, name, "", float(value), round(ends[0], 9), round(ends[1], 9)))
    return tuple(knobs)


def map_with(params: Any, values: Mapping[str, float]) -> Any:
    """Give the map with other parameters."""
    return params._replace(**{name: float(value) for name, value in values.items()})


# ----------------------------------------------------------------
# Estimates while a slider moves: attractors, basins, critical points and the goal's threshold, in some 10 ms.


CELLS = 2048
"""Cells per side."""

# Throws of the orbits on which jogs are counted; samples between which a change of branch is searched.
THROWS, SAMPLES = 2000, 512
# Points of a map in the plane, starts of their orbits, and first steps of each orbit that are left out.
POINTS, STARTS, SKIP = 12_000, 8, 500
# An orbit has left if it is this many sizes of the domain away from the middle of the domain.
FAR = 100.0

Extents = dict[int, list[tuple[float, float]]]


@dataclass(frozen=True)
class Estimate:
    """The estimate of a map of one dimension.

    Attributes
    ----------
    lo, hi : tuple of float
        Least and largest x at which a part can rest, by side [length].
    sets : tuple of dict
        Per attractor its intervals by side.
    bands : tuple of int
        Per attractor the number of intervals that the compiled loop separates; 0 if it does not decide.
    sharp : bool
        Whether the points of cycles and the outermost ends of other attractors are those of the compiled loop;
        otherwise ends are edges of cells.
    orders : tuple
        Per attractor the flip order, None where it changes.
    shares : tuple of (int, float)
        Share of the starts for each label that occurs: the number of an attractor, or the code of an exit.
    basins : tuple of (int, float, float, int)
        Side, ends, label.
    critical : tuple of (int, int, float)
        Side, number on the side, x.
    holds : bool or None
        Whether the goal holds; None if this is not decided, or there is no goal.
    vacuous : bool
        Whether the goal holds only because no part gets to its x.
    threshold : float or None
        The x at which the goal begins or ceases to hold.
    """

    lo: tuple[float, ...]
    hi: tuple[float, ...]
    sets: tuple[Extents, ...]
    bands: tuple[int, ...]
    sharp: bool
    orders: tuple[tuple[int, ...] | None, ...]
    shares: tuple[tuple[int, float], ...]
    basins: tuple[tuple[int, float, float, int], ...]
    critical: tuple[tuple[int, int, float], ...]
    holds: bool | None = None
    vacuous: bool = False
    threshold: float | None = None


def estimate(scene: Scene) -> Estimate:
    """Estimate attractors and basins of a scene.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = estimate(ls.load("paper-designed"))
    >>> found.holds, round(found.threshold, 4)
    (True, 19.7527)
    """
    return _estimated(scene.map, scene.domain, scene)


def estimate_of_map(params: Any, domain: Domain) -> Estimate:
    """Estimate the same of any map of one dimension.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.cells import as_domain
    >>> found = estimate_of_map(maps.Logistic(3.9), as_domain([(0, 1)]))
    >>> [round(x, 4) for x in found.sets[0][0][0]]
    [0.0951, 0.975]
    """
    return _estimated(params, domain, None)


def _estimated(params: Any, domain: Domain, scene: Scene | None) -> Estimate:
    graph = transitions(params, grid(domain, cells=CELLS))
    limit_sets = attractors(graph, throws=THROWS)
    split = basins(graph, limit_sets)
    topology = _told(params, domain, len(limit_sets))
    sharpened = [_sharpened(each, params, topology) for each in limit_sets]
    sets = tuple(extents for extents, _ in sharpened)
    goal: dict[str, Any] = {}
    if scene is not None and scene.goal is not None:
        from limitsets.parameters.analysis.checks import goal_outcome

        outcome = goal_outcome(scene.goal, graph, limit_sets, split, sets)
        goal = {"holds": outcome.holds, "vacuous": outcome.vacuous, "threshold": outcome.threshold}
    labels, counts = np.unique(split.labels, return_inverse=True)
    weight = np.bincount(counts, weights=graph.grid.measure) / graph.grid.measure.sum()
    return Estimate(
        tuple(domain.lo[:, 0].tolist()),
        tuple(domain.hi[:, 0].tolist()),
        sets,
        bands=tuple(bands for _, bands in sharpened),
        sharp=topology is not None,
        orders=tuple(each.flip_order for each in limit_sets),
        shares=tuple(zip(labels.tolist(), weight.tolist(), strict=True)),
        basins=tuple(strips_of(split)),
        critical=tuple(
            (side, number, point.x)
            for side, points in critical_points(params, domain, samples=SAMPLES).items()
            for number, point in enumerate(points)
        ),
        **goal,
    )


def _told(params: Any, domain: Domain, count: int) -> Topologies | None:
    """Ask the compiled loop of the atlas; None if it does not decide, or finds more or fewer attractors than cells."""
    if not has_slope(params) or not count:
        return None
    anchor = None if domain.anchor is None else domain.anchor[None]
    topology = topologies(stacked([params]), domain.lo[:, 0][None], domain.hi[:, 0][None], anchor)
    return topology if topology.undecided[0] == DECIDED and topology.attractors[0] == count else None


def _sharpened(attractor: Attractor, params: Any, topology: Topologies | None) -> tuple[Extents, int]:
    """Replace the cells of a cycle by its points, and the outermost ends of other attractors by exact ones.

    Both happen only if points or ends lie in the attractor's cells, which may join several intervals.  The number of
    these intervals comes second, 0 if it is not known.
    """
    ends = {side: list(parts) for side, parts in attractor.extents.items()}
    for k in range(0 if topology is None else int(topology.attractors[0])):
        assert topology is not None  # the range is empty
        lowest, reach, period = topology.lowest[0, k], topology.reach[0, k], int(topology.period[0, k])
        sides = [int(side) for side in np.flatnonzero(np.isfinite(lowest))]
        if sides != sorted(ends) or not all(
            ends[side][0][0] <= reach[side] and lowest[side] <= ends[side][-1][1] for side in sides
        ):
            continue
        if period:
            cycle = orbit(params, float(topology.start[0, k]), int(topology.start_side[0, k]), period - 1)
            points = {side: np.sort(cycle.x[cycle.side == side]).tolist() for side in sides}
            return {side: [(x, x) for x in points[side]] for side in sides}, period
        for side in sides:
            ends[side][0] = float(lowest[side]), ends[side][0][1]
            ends[side][-1] = ends[side][-1][0], float(reach[side])
        return ends, int(topology.bands[0, k].sum())
    return ends, 0


class Points(NamedTuple):
    """Points of the attractors of a map of two or three dimensions.

    Attributes
    ----------
    x : ndarray of shape (n, dimension)
        Points of the orbits that stay.
    starts : int
        Number of orbits.
    gone : dict of str to int
        Number of the other orbits, by the place where they left, in words.
    """

    x: Array
    starts: int
    gone: dict[str, int]


def points_of_map(params: Any, domain: Domain) -> Points:
    """Sample the attractors of a map of two or three dimensions by orbits from a few starts.

    Orbits that leave are left out: there are no points if all of them leave.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.cells import as_domain
    >>> domain = as_domain(maps.domain_of(maps.Henon()))
    >>> points_of_map(maps.Henon(), domain).x.shape[1]
    2
    >>> points_of_map(maps.Henon(2.0, 0.3), domain).gone
    {'pass x_0 = -400': 8}
    """
    share = np.array([0.5 + 0.5 * math.cos(2.4 * k) * math.sqrt((k + 0.5) / STARTS) for k in range(STARTS)])
    other = np.roll(share, 3)
    samples, gone = [np.empty((0, kind_of(params).dimension))], Counter[str]()
    for side in range(domain.sides):
        lo, hi = domain.lo[side], domain.hi[side]
        for k in range(STARTS):
            at = np.array([share[k], other[k], share[k]])[: domain.dimension]
            path = orbit(params, lo + at * (hi - lo), side, SKIP + POINTS // STARTS)
            fate = _fate(path, lo, hi)
            if fate:
                gone[fate] += 1
            else:
                samples.append(path.x[SKIP:])
    return Points(np.concatenate(samples), STARTS * domain.sides, dict(gone))


def _fate(path: Orbit, lo: Array, hi: Array) -> str:
    """Say where an orbit leaves the surroundings of the domain, `FAR` times its size; empty if it stays."""
    far = (path.x - 0.5 * (lo + hi)) / (hi - lo)
    gone = np.flatnonzero(~(np.abs(far) <= FAR).all(axis=1))
    if not gone.size:
        return "leave by an exit of the map" if path.stopped else ""
    at = far[gone[0]]
    if np.isnan(at).any():
        return "come to an image that is no number"
    axis = int(np.abs(at).argmax())
    limit = 0.5 * (lo + hi)[axis] + math.copysign(FAR, at[axis]) * (hi - lo)[axis]
    return f"pass x_{axis} = {limit:.6g}"
