"""The lines of a drawing: straight ones, arcs of circles and ellipses, splines; and the chords that stand for them.

Each is a few vectors and a formula into which they enter linearly, so that any linear map of the plane is a map of
these vectors: an arc of a circle that a drawing stretches is an arc of an ellipse, and no curve is ever fitted to
another one.  Vertices therefore lie on the drawn curve itself, up to rounding.
"""

from __future__ import annotations

import importlib
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Array

# Lines, entities and elements that a drawing may have, and levels of blocks, groups and clones within each other: a
# small file unfolds to any number.
MOST, DEEPEST = 200_000, 64

# What the libraries raise, beside their own errors, on files that are not what their suffix says.
BROKEN = (
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    ArithmeticError,
    OSError,
    EOFError,
    RuntimeError,
    StopIteration,
)

# Points of a curve, from its start to its end, that are looked at: an odd number, the middle is one of them.
SAMPLES = np.linspace(0.0, 1.0, 17)


class Sheet(NamedTuple):
    """What a file says: its lines in its own numbers, and how long its unit is.

    Parameters
    ----------
    curves : list of Curve
        Those that are read.
    left_out : Counter
        By kind, how many were not.
    unit : str or None
        The unit of length that it states.
    size : ndarray (2,)
        What 1 is in that unit, along x and y.
    """

    curves: list[Curve]
    left_out: Counter[str]
    unit: str | None
    size: Array


@dataclass(frozen=True, eq=False)
class Curve:
    """A line of a drawing.

    Attributes
    ----------
    vectors : ndarray (n, 2)
        Of a straight line its two ends.  Of an arc its start, the vector from the centre to it, and the derivative
        there by the angle.  Of a spline its control points.
    layer : str
        On which it is drawn.
    thickness : float
        What it states of the thickness of the part; 0 without.
    sweep : float
        Of an arc the angle, or that of the circle from which an arc of an ellipse is made [rad]; 0 of others.
    knots, weights : ndarray (k,), (n,)
        Of a spline; empty of others.
    """

    vectors: Array
    layer: str = ""
    thickness: float = 0.0
    sweep: float = 0.0
    knots: Array = field(default_factory=lambda: np.empty(0))
    weights: Array = field(default_factory=lambda: np.empty(0))

    @property
    def straight(self) -> bool:
        """Whether it is a straight line."""
        return not self.sweep and not len(self.knots)

    def mapped(self, matrix: Array, shift: Array, thickness: float = 1.0) -> Curve:
        """Map it by a matrix (2, 2), columns are vectors, and move it; its thickness by a factor."""
        moved = self.vectors @ matrix.T
        moved[: 1 if self.sweep else None] += shift
        return replace(self, vectors=moved, thickness=self.thickness * thickness)

    def at(self, t: Array) -> Array:
        """Give its points, shape (n, 2), at `t` from 0, its start, to 1, its end.

        Examples
        --------
        >>> quarter = Curve(np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), sweep=math.pi / 2)
        >>> quarter.at(np.array([0.0, 1 / 3])).round(4).tolist()
        [[1.0, 0.0], [0.866, 0.5]]
        """
        if self.straight:
            return np.outer(1.0 - t, self.vectors[0]) + np.outer(t, self.vectors[1])
        if self.sweep:
            start, radius, ahead = self.vectors
            # from the start, not from the centre: that of a line that is hardly bent is far away, with few digits
            back = np.outer(2.0 * np.sin(t * self.sweep / 2) ** 2, radius)
            return np.asarray(start - back + np.outer(np.sin(t * self.sweep), ahead))
        from scipy.interpolate import BSpline

        weighted = np.column_stack([self.vectors * self.weights[:, None], self.weights])
        first, last = self._domain
        points = BSpline(self.knots, weighted, self._degree)(first + t * (last - first))
        return np.asarray(points[:, :2] / points[:, 2:])

    @property
    def circle(self) -> tuple[Array, float] | None:
        """Centre and diameter of the circle on which an arc lies; None of others."""
        start, radius, ahead = self.vectors if self.sweep else np.zeros((3, 2))
        size = float(radius @ radius)
        off = max(abs(float(radius @ ahead)), abs(float(ahead @ ahead) - size))
        # axes that differ by the rounding of a transformation are those of a circle
        return (start - radius, 2.0 * math.sqrt(size)) if off < 1e-9 * size else None

    def chords(self, error: float) -> tuple[Array, float]:
        """Give vertices on the curve, from start to end, whose chords are no farther from it than `error`.

        Returns
        -------
        points : ndarray (n, 2)
        bound : float
            No chord is farther than this from its piece of the curve.

        Raises
        ------
        AnswerError
            A spline that is not in one piece.

        Examples
        --------
        >>> circle = Curve(np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), sweep=2 * math.pi)
        >>> points, bound = circle.chords(0.01)
        >>> len(points), f"{bound:.4f}"
        (24, '0.0093')
        """
        if self.straight:
            return self.vectors, 0.0
        if self.sweep:
            # the chord of a circle is farthest in its middle; a linear map stretches that distance by this at most
            widest = float(np.linalg.norm(self.vectors[1:], 2))
            angle = 4.0 * math.asin(math.sqrt(min(1.0, error / widest) / 2.0))
            # four to a turn at least, or a circle may lose its inside
            count = math.ceil(abs(self.sweep) / min(angle, math.pi / 2))
            bound = 2.0 * widest * math.sin(self.sweep / count / 4.0) ** 2
            return self.at(np.linspace(0.0, 1.0, count + 1)), bound
        first, last = self._domain
        knots, counts = np.unique(np.clip(self.knots, first, last), return_counts=True)
        t = (knots - first) / (last - first)
        jumps = (counts[1:-1] > self._degree).any()
        # each round halves the pieces that are too long: after 40 there are none, or the curve goes to infinity
        for _ in range(0 if jumps else 40):
            pieces = t[:-1, None] + np.diff(t)[:, None] * SAMPLES
            away = from_chords(self.at(pieces.ravel()).reshape(*pieces.shape, 2))
            # between samples the distance goes on rising: by 0.4 % along a parabola, and a piece is nearly one
            far = ~(1.01 * away <= error)
            if not far.any():
                return self.at(t), 1.01 * float(away.max())
            t = np.sort(np.append(t, (t[:-1][far] + t[1:][far]) / 2.0))
        raise AnswerError("a spline of the drawing", "one that jumps", "a line in one piece", "draw it again")

    @property
    def _degree(self) -> int:
        return len(self.knots) - len(self.vectors) - 1

    @property
    def _domain(self) -> tuple[float, float]:
        """The knots between which all control points have their part: those of a closed spline go on outside."""
        return float(self.knots[self._degree]), float(self.knots[len(self.vectors)])


def from_chords(pieces: Array) -> Array:
    """Give how far the points of each piece, shape (m, n, 2), are at most from the line between its first and last.

    Examples
    --------
    >>> from_chords(np.array([[[0.0, 0.0], [1.0, 2.0], [4.0, 0.0]]])).tolist()
    [2.0]
    """
    start, along = pieces[:, :1], pieces[:, -1:] - pieces[:, :1]
    square = np.maximum(
        (along**2).sum(axis=-1), 1e-300
    )  # of a piece that is closed: its points from its start
    share = np.clip(((pieces - start) * along).sum(axis=-1) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(pieces - start - share[..., None] * along, axis=-1).max(axis=-1))


def require(holds: object, thing: str, value: object, allowed: str, remedy: str) -> None:
    """Refuse a drawing where something does not hold of it.

    Raises
    ------
    AnswerError
        It does not.
    """
    if not holds:
        raise AnswerError(thing, value, allowed, remedy)


def require_few(count: int, depth: int = 0) -> None:
    """Refuse a drawing that unfolds to more than anyone draws."""
    value = f"one of more than {MOST} lines, or {DEEPEST} levels"
    require(count <= MOST and depth <= DEEPEST, "the drawing", value, "one part", "draw it simpler")


def require_known(layers: Sequence[str], known: Iterable[str]) -> None:
    """Refuse layers that the drawing does not have; `known` are all."""
    names = ", ".join(sorted(known)) or "none: it has no layers"
    require(not layers, "the layer", ", ".join(layers), names, "name one of these")


def broken(kind: str, why: Exception) -> AnswerError:
    """Build the error for a file that cannot be what its suffix says."""
    reason = " ".join(str(why).split())[:200] or type(why).__name__
    remedy = f"save the drawing again; its reader says: {reason}"
    return AnswerError(f"this {kind}", "broken", f"a whole {kind} file", remedy)


def package(name: str) -> Any:
    """Import a package that reads drawings, or name the extra that brings it."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        raise AnswerError(
            f"the package {name}", "missing", "an installed one", "pip install 'limitsets[drawing]'"
        ) from None
