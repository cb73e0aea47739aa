"""First critical points with their derivatives by any quantities of the scene: the implicit function theorem.

At a critical point r the deciding number F(r, q) is zero, so dr/dq = -(dF/dq) / (dF/dr).  F is evaluated on dual
numbers: from the scene's text through the formulas of `geometry`, and through the impact angle by the same theorem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from limitsets.errors import AnswerError
from limitsets.files import as_table, picked
from limitsets.inverse.critical.decision import DecidingNumber, SideNumbers, decided
from limitsets.inverse.critical.dual import MultiDual
from limitsets.inverse.critical.first_critical import first_points, nearest_miss
from limitsets.inverse.critical.seeded import Seeded, numbers_of, present
from limitsets.maps.critical import CriticalPoint
from limitsets.scene import Scene, load
from limitsets.thrower import impact_angles

Array = npt.NDArray[np.float64]

# Newton steps from the number that a bisection of the kernels found.
STEPS = 2
# Below the square root of rounding two critical points (or a flight and the arm) cannot be told from touching ones.
TOUCHING = 1e-7
# A decision this near to being drawn is drawn somewhere else by rounding.
DRAWN = 1e-12
# A root is where the decision passes 0; where Newton moves it farther, the decision jumps.
STRAYED = 1e-9


@dataclass(frozen=True, eq=False)
class CriticalJacobian:
    """First critical points and their derivatives, to rounding; nothing here is proved.

    Attributes
    ----------
    scene : Scene
        The scene.
    names : tuple of str
        The quantities.
    values : ndarray, shape (k,)
        Their values in the scene's units; 1 for a speed that the scene leaves open (given by kappa, without gravity).
    x : ndarray, shape (n,)
        First critical point of each side, nan where there is none; may lie beyond the arm's end [length].
    kinds : tuple of str or None
        ``"jog->flip"`` or ``"flip->jog"``.
    matrix : ndarray, shape (n, k)
        Derivatives of `x` by the quantities, in the scene's units; a row of nan where there are none.
    reasons : tuple of str or None
        Per side why there is no derivative.
    slack : ndarray, shape (3 n,)
        a, L - a and d of all sides: above 0 as long as every side rests [length].
    slack_matrix : ndarray, shape (3 n, k)
        Their derivatives.
    """

    scene: Scene
    names: tuple[str, ...]
    values: Array
    x: Array
    kinds: tuple[str | None, ...]
    matrix: Array
    reasons: tuple[str | None, ...]
    slack: Array
    slack_matrix: Array

    @property
    def scaled(self) -> Array:
        """Derivatives by shares of the speed, kappa, gravity and masses; by lengths and angles as they stand."""
        share = np.array([is_share(name) for name in self.names], dtype=bool)
        return self.matrix * np.where(share, self.values, 1.0)

    @property
    def determinant(self) -> float | None:
        """Determinant of `scaled`, None where it is not square or not known."""
        whole = self.matrix.shape[0] == self.matrix.shape[1] and bool(np.isfinite(self.matrix).all())
        return float(np.linalg.det(self.scaled)) if whole else None

    @property
    def condition(self) -> float | None:
        """Condition number of `scaled`: its largest singular value over its smallest; None where not known."""
        return condition_of(self.scaled)

    def to_json(self) -> dict[str, Any]:
        """Give it as plain tables for JSON, null where there is no number."""
        return as_table(
            quantities=self.names,
            critical_points=self.x,
            **picked(self, "kinds", "matrix"),
            no_derivative=self.reasons,
            **picked(self, "determinant", "condition"),
        )


def condition_of(matrix: Array) -> float | None:
    """Condition number of a matrix without nan; None where it has one, or where it is singular."""
    if not np.isfinite(matrix).all():
        return None
    singular = np.linalg.svd(matrix, compute_uv=False)
    return float(singular[0] / singular[-1]) if singular[-1] > 0.0 else None


def is_share(name: str) -> bool:
    """Whether a quantity's changes are best measured as shares of it: speed, kappa, gravity, masses."""
    return name.startswith("throw.") or name.endswith((".mass", ".acceleration"))


def require_minimal(scene: Scene) -> None:
    """Refuse a scene with effects: their decision has no derivatives here."""
    on = scene.effects.on()
    if on:
        raise AnswerError(
            "the scene's effects",
            ", ".join(on),
            "the minimal model",
            "leave [effects] out: critical points are differentiated and designed in the minimal model",
        )


def critical_jacobian(scene: Scene | str, *names: str) -> CriticalJacobian:
    """Differentiate the first critical point of each side by quantities of the scene.

    Parameters
    ----------
    scene : Scene or str
        The scene, or what `limitsets.load` takes.
    *names : str
        Quantities (`limitsets.scene.NAMES`); none gives the critical points alone.

    Returns
    -------
    CriticalJacobian
        Where a derivative does not exist `reasons` says why: no critical point, a grazing flight, two critical points
        that meet (dF/dr = 0), or another one that is about to be the first.

    Raises
    ------
    SceneError
        A quantity that this scene does not give.
    AnswerError
        A quantity named twice, or a scene with effects.

    Examples
    --------
    >>> found = critical_jacobian("paper-designed", "part.mass.center.along", "part.mass.center.above", "throw.speed")
    >>> round(found.determinant, 1), round(found.condition, 1)
    (2152.1, 7.1)
    """
    chosen = load(scene)
    require_minimal(chosen)
    if len(set(names)) != len(names):
        raise AnswerError("the quantities", ", ".join(names), "each named once", "leave the repetition out")
    numbers = numbers_of(chosen, names, before=1)
    rows = [_Row(chosen, numbers, side, point) for side, point in enumerate(first_points(chosen))]
    slack = [number for side in zip(*_slacks(numbers), strict=True) for number in side]
    return CriticalJacobian(
        chosen,
        names,
        np.array([present(chosen, name) for name in names]),
        np.array([row.x for row in rows]),
        tuple(row.kind for row in rows),
        np.array([row.slope for row in rows]).reshape(len(rows), len(names)),
        tuple(row.reason for row in rows),
        np.array([float(number) for number in slack]),
        np.array([number.slope[1:] for number in slack]).reshape(len(slack), len(names)),
    )


def _slacks(numbers: Seeded) -> tuple[Sequence[MultiDual], ...]:
    right = [length - a for length, a in zip(numbers.length, numbers.a, strict=True)]
    return numbers.a, right, numbers.d


class _Row:
    """One side: its first critical point, derivatives, or why there are none."""

    def __init__(self, scene: Scene, numbers: Seeded, side: int, point: CriticalPoint | None) -> None:
        self.scene, self.side = scene, side
        self.part = SideNumbers(numbers.a[side], numbers.d[side], numbers.rho, numbers.kappa, numbers.h)
        self.slope = np.full(numbers.h.slope.size - 1, np.nan)
        self.x: float = np.nan if point is None else point.x
        self.kind: str | None = None if point is None else point.kind
        self.reason = "every throw is decided alike" if point is None else self._differentiate(point.x)

    def _decision(self, x: float) -> DecidingNumber:
        seed = np.zeros(self.slope.size + 1)
        seed[0] = 1.0
        phi = float(impact_angles(self.scene.bare_map, [x], self.side)[0])
        return decided(self.scene.flight, self.scene.flip, self.part, MultiDual(x, seed), phi)

    def _differentiate(self, start: float) -> str | None:
        x = start
        found = self._decision(x)
        for _ in range(STEPS):
            if abs(found.steepness) < TOUCHING:
                return "the flight only grazes the arm: another impact is about to be the first"
            if abs(found.margin.slope[0]) * x < TOUCHING * found.size:
                return "dF/dr = 0: two critical points meet"
            step = found.margin.value / found.margin.slope[0]
            if not abs(step) <= STRAYED * x:
                return "the decision jumps: the impact, or the way the part turns over, changes there"
            x -= step
            found = self._decision(x)
        miss = nearest_miss(self.scene, self.side, start - 4.0 * STRAYED * start)
        if miss is not None and miss[1] < DRAWN * self._decision(miss[0]).size:
            return f"another critical point is about to be the first, at x = {miss[0]:.9g}"
        self.x = x
        self.slope = -found.margin.slope[1:] / found.margin.slope[0]
        return None
