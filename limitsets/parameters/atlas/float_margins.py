"""Margins of a goal at many points, by floats: how far a quantity may deviate before an attractor reaches too far.

`limitsets.margin` proves and refutes a margin of one scene; here its size is found for a million.  The attractors of a
point are followed to deviating parameters (`limitsets.topology.reaches`): at growing steps up to a first deviation that
breaks the goal, then by halving.  What breaks the goal only between two steps is not seen.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError
from limitsets.feeder.goals import OrientedBeyond, Reaches
from limitsets.feeder.scene import Deviation, Scene, ThrowStack, throw_stack
from limitsets.systems.sets.topology import Topologies, reaches, region_of
from limitsets.systems.sets.topology.work import DECIDED, Floats, Ints

Values: TypeAlias = Mapping[str, Floats]

# The first step, as a share of what is known to be too much; each is so much longer than the one before.
FIRST, LONGER = 2.0**-11, 1.5
# Halvings of the last step: what is left is 1.5 / 2^8, 0.6 %, and its middle at most half of that off.
HALVINGS = 8
# The largest relative deviation that is tried, and the same of lengths and angles, of the value or the part.
MOST = 0.5
# The step over which the tolerance's worst corner is found by differences.
SMALL = 0.05


def threshold_of(goal: OrientedBeyond | Reaches, reach: Floats) -> Floats:
    """Return the reach that the goal bounds, from `reach` of shape (n, S): the largest on other sides, or its own."""
    if isinstance(goal, OrientedBeyond):
        return np.asarray(np.fmax.reduce(np.delete(reach, goal.side, axis=1), axis=1))
    return reach[:, goal.side]


def unit_of_margin(scene: Scene, quantity: str, reading: str) -> str:
    """Return the unit of a margin: as in `limitsets.margin`; of the tolerance none, for it is a factor."""
    # lazily, as below: the whole prover comes with it, and few atlases ask for margins
    from limitsets.parameters.margins.deviations import deviation_scale

    return "" if quantity == "joint" else deviation_scale(scene, quantity, reading).unit


def float_margins(
    scene: Scene, values: Values, known: Topologies, quantity: str, reading: str = "fixed"
) -> Floats:
    """Find margins of the scene's goal at many points.

    Parameters
    ----------
    scene : Scene
        Its goal says where on which side parts may lie: `OrientedBeyond` or `Reaches`.
    values : mapping of str to ndarray, shape (n,)
        What varies over the points, in the scene's units.
    known : Topologies
        The attractors of the points.
    quantity, reading : str
        As for `limitsets.margin`; "joint" for the scene's tolerance.

    Returns
    -------
    ndarray, shape (n,)
        In the units of `limitsets.margin`; 0 where the goal fails as it is, nan where there is no attractor or the
        point is undecided, inf where no deviation that was tried breaks the goal.

    Raises
    ------
    AnswerError
        For another goal, or a quantity or reading that the scene does not have.
    """
    goal = scene.goal
    if not isinstance(goal, OrientedBeyond | Reaches) or goal.from_anywhere:
        word = "missing" if goal is None else getattr(goal, "word", None) or type(goal).__name__
        remedy = "add [goal] to the scene" if goal is None else "ask margin for others"
        raise AnswerError(
            "the goal of a margin by floats", word, "oriented_beyond or reaches, of the limit set", remedy
        )
    there = np.flatnonzero((known.undecided == DECIDED) & (known.attractors > 0))
    margins = np.full(known.undecided.size, np.nan)
    if there.size:
        search = _Search(scene, values, there, known, goal)
        search = _Search(scene, values, search.holding(), known, goal)
        margins[there] = 0.0
        margins[search.points] = search.joint() if quantity == "joint" else search.single(quantity, reading)
    return margins


class _Search:
    """Points whose margins are sought."""

    def __init__(
        self, scene: Scene, values: Values, points: Ints, known: Topologies, goal: OrientedBeyond | Reaches
    ) -> None:
        self.scene, self.points, self.known, self.goal = scene, points, known, goal
        self.values = {name: each[points] for name, each in values.items()}
        self.nominal = dict(self.values)

    def _at(self, name: str) -> Floats:
        """Values of a quantity at the points, of the speed those of kappa where that is given."""
        key = "throw.kappa" if self._by_kappa(name) else name
        if key not in self.nominal:
            self.nominal[key] = np.full(self.points.size, self.scene.value(key))
        return self.nominal[key]

    def _moved(self, name: str, deviation: Deviation, sizes: Floats, rows: Ints) -> dict[str, Floats]:
        """Values of a quantity at signed multiples of a deviation."""
        at, share = self._at(name)[rows], sizes * deviation.value
        if self._by_kappa(name):
            return {"throw.kappa": at / (1.0 + share) ** 2}
        return {name: at * (1.0 + share) if deviation.relative else at + share}

    def _by_kappa(self, name: str) -> bool:
        """Whether a scene without gravity, or one whose kappa varies, says how fast the throw is."""
        varied = "throw.kappa" in self.values
        return name == "throw.speed" and (
            varied or ("throw.speed" not in self.values and "kappa" in self.scene.text["throw"])
        )

    def _stack(self, rows: Ints, changed: Values) -> ThrowStack:
        kept = {name: each[rows] for name, each in self.values.items() if name not in changed}
        if "throw.kappa" in changed:
            kept.pop("throw.speed", None)
        return throw_stack(self.scene, {**kept, **changed})

    def _holds(self, rows: Ints, one: Values, other: Values | None = None) -> NDArray[np.bool_]:
        """Whether the goal holds of the attractors followed to other values, or to all between two."""
        stack = self._stack(rows, one)
        beside = None if other is None else self._stack(rows, other)
        reach = reaches(
            stack.params,
            region_of(stack.lo, stack.hi, stack.anchor),
            self.points[rows],
            self.known,
            None if beside is None else beside.params,
        )
        possible = stack.possible if beside is None else stack.possible & beside.possible
        threshold = threshold_of(self.goal, reach)
        beyond = threshold > self.goal.x  # false where there is no threshold
        good = ~beyond if isinstance(self.goal, OrientedBeyond) else threshold >= self.goal.x
        return np.asarray(good & possible & ~np.isinf(reach).any(axis=1))

    def _least(
        self, holds: Callable[[Floats, Ints], NDArray[np.bool_]], most: Floats, growing: bool
    ) -> Floats:
        """Find the least size up to `most` at which the goal fails, inf where it holds up to there.

        `growing`: what fails at one size fails at all larger ones, so that halving alone finds the least.
        """
        rows = np.arange(self.points.size)
        good, bad = np.zeros(rows.size), np.full(rows.size, np.inf)
        size = most.copy() if growing else FIRST * most
        while rows.size:
            fine = holds(size[rows], rows)
            good[rows[fine]], bad[rows[~fine]] = size[rows[fine]], size[rows[~fine]]
            rows = rows[fine & (size[rows] < most[rows])]
            size[rows] = np.minimum(LONGER * size[rows], most[rows])
        steps = HALVINGS + (int(np.ceil(-np.log2(FIRST))) if growing else 0)
        for _ in range(steps):
            rows = np.flatnonzero(np.isfinite(bad) & (bad - good > 2.0**-HALVINGS * bad))
            if not rows.size:
                break
            middle = 0.5 * (good[rows] + bad[rows])
            fine = holds(middle, rows)
            good[rows[fine]], bad[rows[~fine]] = middle[fine], middle[~fine]
        return np.where(np.isfinite(bad), 0.5 * (good + bad), np.inf)

    def holding(self) -> Ints:
        """Numbers of the points at which the goal holds as they are."""
        return self.points[self._holds(np.arange(self.points.size), self.values)]

    def single(self, quantity: str, reading: str) -> Floats:
        """Margins of one quantity."""
        from limitsets.parameters.margins.deviations import deviation_scale

        scale = deviation_scale(self.scene, quantity, reading)
        if quantity == "landing.x":
            raise AnswerError(
                "the quantity of a margin by floats",
                quantity,
                "one that the scene gives",
                "ask margin for it",
            )
        unit = scale.deviation(Fraction(1))
        whole = Deviation(1.0, relative=unit.relative)
        # of a length or an angle, a share of the value or of the part
        size = np.maximum(np.abs(self._at(quantity)), float(self.scene.sides.length.min()))
        most = MOST * (np.ones(self.points.size) if unit.relative else size)

        def moved(size: Floats, rows: Ints) -> dict[str, Floats]:
            return self._moved(quantity, whole, size, rows)

        if reading == "per-throw":
            either = self._least(
                lambda size, rows: self._holds(rows, moved(-size, rows), moved(size, rows)),
                most,
                growing=True,
            )
            return either / unit.value
        less = self._least(lambda size, rows: self._holds(rows, moved(-size, rows)), most, growing=False)
        most = np.minimum(less, most)
        more = self._least(lambda size, rows: self._holds(rows, moved(size, rows)), most, growing=False)
        return np.minimum(less, more) / unit.value

    def joint(self) -> Floats:
        """Factors on the scene's tolerance, along the corner that differences of the threshold point at."""
        if not self.scene.tolerance:
            raise AnswerError(
                "the tolerance",
                None,
                "a scene with [tolerance]",
                "name the quantities and their scales there",
            )
        rows = np.arange(self.points.size)
        deviations = {name: each for name, each in self.scene.tolerance.items() if name != "landing.x"}
        signs = {name: self._sign(name, each, rows) for name, each in deviations.items()}

        def holds(size: Floats, chosen: Ints) -> NDArray[np.bool_]:
            changed: dict[str, Floats] = {}
            for name, each in deviations.items():
                changed |= self._moved(name, each, size * signs[name][chosen], chosen)
            return self._holds(chosen, changed)

        widest = min(
            (MOST / each.value for each in deviations.values() if each.relative), default=1.0 / SMALL
        )
        return self._least(holds, np.full(rows.size, widest), growing=False)

    def _sign(self, name: str, deviation: Deviation, rows: Ints) -> Floats:
        """Which way a quantity has to go to bring the goal nearer to failing."""
        ends = []
        for sign in (-1.0, 1.0):
            stack = self._stack(rows, self._moved(name, deviation, np.full(rows.size, sign * SMALL), rows))
            reach = reaches(
                stack.params, region_of(stack.lo, stack.hi, stack.anchor), self.points, self.known
            )
            ends.append(threshold_of(self.goal, reach))
        return np.where((ends[1] >= ends[0]) == isinstance(self.goal, OrientedBeyond), 1.0, -1.0)
