"""The varied quantities of a design, scaled for the solver.

Positive quantities (speed, kappa, gravity, masses, sides, radius of gyration) are scaled by their logarithm, places and
heights by the size of the part, the tilt in radians: a step of 0.1 is then comparable for all, and "nearest" is well
defined.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from limitsets.errors import AnswerError
from limitsets.inverse.critical.derivatives import is_share
from limitsets.inverse.critical.seeded import present
from limitsets.scene import Scene
from limitsets.scene.quantities import find, in_units

Array = npt.NDArray[np.float64]
# No search goes farther than by this factor's logarithm.
FARTHEST = 20.0

Bounds = Mapping[str, Sequence[Any]]


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Names, bounds and scales of what is varied.

    Attributes
    ----------
    names : tuple of str
        The quantities.
    start : ndarray, shape (k,)
        Their values in the scene that the search starts from, in its units.
    logs : ndarray of bool, shape (k,)
        Whether a quantity is seen by its logarithm.
    scale : ndarray, shape (k,)
        What a step of 1 is for the others [their units].
    lo, hi : ndarray, shape (k,)
        Bounds, as the solver sees them.
    """

    names: tuple[str, ...]
    start: Array
    logs: npt.NDArray[np.bool_]
    scale: Array
    lo: Array
    hi: Array

    def seen(self, values: Array) -> Array:
        """Return the solver's numbers for values in the scene's units."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.logs, np.log(values / np.abs(self.start)), values / self.scale)

    def values(self, seen: Array) -> Array:
        """Return values in the scene's units."""
        shares = np.exp(np.clip(np.where(self.logs, seen, 0.0), -FARTHEST, FARTHEST))
        return np.where(self.logs, np.abs(self.start) * shares, seen * self.scale)

    def inside(self, seen: Array) -> Array:
        """Move numbers to the nearest within bounds."""
        return np.clip(seen, self.lo, self.hi)


def unknowns_of(scene: Scene, names: Sequence[str], bounds: Bounds | None) -> Unknowns:
    """Read what may be varied, and between which bounds.

    Parameters
    ----------
    scene : Scene
        Where the search starts.
    names : sequence of str
        Quantities.
    bounds : mapping of str to (lo, hi), optional
        Numbers in the scene's units, text with a unit, or None for no bound.

    Returns
    -------
    Unknowns

    Raises
    ------
    SceneError, AnswerError
        An unknown quantity or one that is not varied, or bounds that are not in order.
    """
    given = dict(bounds or {})
    for name in given:
        find(name)
        if name not in names:
            raise AnswerError("the bounds", name, ", ".join(names), "bound a quantity that is varied")
    size = float(np.ptp(scene.vertices, axis=0).max())
    start = np.array([present(scene, name) for name in names])
    logs = np.array([is_share(name) or _is_size(name) for name in names])
    scale = np.array([1.0 if find(name).dimension == "angle" else size for name in names])
    unbounded = Unknowns(tuple(names), start, logs, scale, start, start)
    pairs = [_pair(scene, name, given.get(name)) for name in names]
    ends = [unbounded.seen(np.array([pair[end] for pair in pairs])) for end in (0, 1)]
    return Unknowns(tuple(names), start, logs, scale, *ends)


def _is_size(name: str) -> bool:
    return name == "part.mass.radius_of_gyration" or name.startswith("part.sides")


def _pair(scene: Scene, name: str, given: Sequence[Any] | None) -> tuple[float, float]:
    """Read the bounds of one quantity; those that are always there keep it a quantity of its kind."""
    always = {"gravity.tilt": (0.0, 0.5 * math.pi)}
    least, most = always.get(name, (0.0 if is_share(name) or _is_size(name) else -math.inf, math.inf))
    if given is None:
        return least, most
    if isinstance(given, str) or len(given) != 2:
        raise AnswerError(
            f"the bounds of {name}", given, "(lowest, highest), None for no bound", "give a pair"
        )
    ends = [_end(scene, name, end, other) for end, other in zip(given, (least, most), strict=True)]
    lo, hi = max(ends[0], least), min(ends[1], most)
    if not lo < hi:
        raise AnswerError(f"the bounds of {name}", given, "the lowest below the highest", "correct them")
    return lo, hi


def _end(scene: Scene, name: str, value: Any, missing: float) -> float:
    if value is None:
        return missing
    return in_units(scene.unit, name, value, key=name)
