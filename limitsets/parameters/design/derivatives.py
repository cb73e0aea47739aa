"""First critical points with their derivatives by any quantities of the scene: dual numbers, implicit functions.

At a critical point r the deciding number F(r, q) is zero, so dr/dq = -(dF/dq) / (dF/dr).  F is evaluated on dual
numbers: from the scene's text through the formulas of `geometry`, and through the impact angle by the same theorem.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from limitsets.base import AnswerError, as_table, picked
from limitsets.base.arrays import Array
from limitsets.feeder.scene import Numbers, Scene, load
from limitsets.feeder.scene.quantities import base_unit
from limitsets.feeder.scene.units import convert, parse
from limitsets.feeder.thrower import impact_angles
from limitsets.feeder.thrower.flight import Turned
from limitsets.feeder.thrower.impact import margin, strike
from limitsets.feeder.thrower.params import FLIGHTS, FLIPS
from limitsets.proofs.prover.numbers import Jet
from limitsets.systems.cells import Domain
from limitsets.systems.maps import critical_points
from limitsets.systems.maps.critical import CriticalPoint, margins

# ----------------------------------------------------------------
# Dual numbers: a value and its derivatives with respect to several quantities, carried through one computation.
#
# In the formulas of `geometry`, which use scalars with ``+ - * /`` and a passed-in ``sqrt``, they give exact
# derivatives up to rounding, without finite differences.


def multi_dual(value: float, slope: Array) -> Jet:
    """Give a number that knows its derivatives with respect to k quantities.

    Examples
    --------
    >>> import numpy as np
    >>> x, y = multi_dual(3.0, np.array([1.0, 0.0])), multi_dual(2.0, np.array([0.0, 1.0]))
    >>> slope_of(x * y / (x + y))
    array([0.16, 0.36])
    """
    return Jet(value, (slope,))


def slope_of(x: Jet) -> Array:
    """Return its derivatives, shape (k,)."""
    return np.asarray(x.derivatives[0])


def square_root(x: Jet) -> Jet:
    """Square root of a number above 0; that of 0 has no derivative."""
    root = math.sqrt(x.value)
    return multi_dual(root, slope_of(x) / (2.0 * root))


def sine(x: Jet) -> Jet:
    """Sine of an angle [rad]."""
    return multi_dual(math.sin(x.value), math.cos(x.value) * slope_of(x))


def cosine(x: Jet) -> Jet:
    """Cosine of an angle [rad]."""
    return multi_dual(math.cos(x.value), -math.sin(x.value) * slope_of(x))


# ----------------------------------------------------------------
# The deciding number between jog and flip, on dual numbers (docs/model.md: flight, impact, decision).
#
# The formulas of the impact are those of `thrower.impact`.  The impact angle is found by the kernels, refined here, and
# differentiated by the implicit function theorem, d phi = -df / (df/dphi).


# Newton steps on an angle that is right to rounding but for the kernel's last bits.
STEPS_OF_ANGLE = 3
# Below this angle phi - sin phi is summed from its series.
SMALL = 0.5


class SideNumbers(NamedTuple):
    """One side of a part, in the scene's unit; named as in `params.Side`."""

    a: Jet
    d: Jet
    length: Jet
    rho: Jet
    kappa: Jet
    h: Jet

    @property
    def ell(self) -> Jet:
        """Distance of the centre of mass from the left vertex."""
        return square_root(self.a**2 + self.d**2)

    @property
    def rho2(self) -> Jet:
        """Squared radius of gyration."""
        return self.rho**2

    @property
    def inertia(self) -> Jet:
        """Moment of inertia about the left vertex, per mass."""
        return self.rho2 + self.a**2 + self.d**2


class DecidingNumber(NamedTuple):
    """What decides.

    Parameters
    ----------
    margin : Jet
        Positive where the part flips; energies over m w^2 [length^2].
    size : float
        Size of the numbers of which it is the difference.
    steepness : float
        df/dphi at the impact, as a share of its two terms: 0 where the vertex only grazes the arm; -1 at small angles.
    """

    margin: Jet
    size: float
    steepness: float


def decided(flight: str, flip: str, part: SideNumbers, x: Jet, phi: float) -> DecidingNumber:
    """Evaluate what decides for a throw from x that lands at phi.

    Parameters
    ----------
    flight, flip : str
        The models, in a scene's words.
    part : SideNumbers
        The side it rests on.
    x : Jet
        Where it rests [length].
    phi : float
        The impact angle to rounding [rad]; not used at small angles.
    """
    steepness, at = -1.0, None
    if flight == "exact":
        angle, steepness = _angle(part, x, phi)
        at = Turned(angle, sine(angle), 1.0 - cosine(angle), None)
    omega, barrier = strike(FLIGHTS[flight](), part, x, at)
    size = 0.5 * part.inertia.value * omega.value**2 + abs(barrier.value)
    return DecidingNumber(margin(FLIPS[flip](), part.inertia, omega, barrier), size, steepness)


def _short_of_arc(phi: float) -> float:
    """phi - sin phi, without cancellation."""
    if phi > SMALL:
        return phi - math.sin(phi)
    term, total = phi**3 / 6.0, 0.0
    for k in range(2, 12):
        total += term
        term *= -phi * phi / ((2 * k) * (2 * k + 1))
    return total


def _height(part: SideNumbers, x: Jet, phi: float) -> tuple[Jet, float, float]:
    """Height of the left vertex over the arm, its derivative by phi, and the size of that one's terms."""
    s, v = math.sin(phi), 2.0 * math.sin(0.5 * phi) ** 2
    reach = x - part.a
    f = reach * phi + part.a * _short_of_arc(phi) + part.d * v - part.kappa * (0.5 * phi * phi)
    up = reach.value + part.a.value * v + part.d.value * s
    down = part.kappa.value * phi
    return f, up - down, abs(up) + down


def _angle(part: SideNumbers, x: Jet, phi: float) -> tuple[Jet, float]:
    """Return the impact angle with its derivatives, and how steeply the vertex comes down."""
    f, slope, size = _height(part, x, phi)
    for _ in range(STEPS_OF_ANGLE):
        step = f.value / slope if slope < 0.0 else math.inf
        if abs(step) > 1e-6 * phi:  # a grazing impact: Newton would leave
            break
        phi -= step
        f, slope, size = _height(part, x, phi)
    if not slope < 0.0:
        return multi_dual(phi, slope_of(f) * math.nan), 0.0
    return multi_dual(phi, -slope_of(f) / slope), slope / size


# ----------------------------------------------------------------
# The first critical point of each side, also beyond the arm's end.
#
# A design search passes through scenes whose critical points lie beyond the arm; a value clipped at the arm's end would
# have no gradient.


SAMPLES = 2048
# Samples below a critical point where the decision is nearly drawn.
BELOW = 512
NARROWINGS = 60
GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def first_points(scene: Scene) -> tuple[CriticalPoint | None, ...]:
    """Find the first critical point of each side of the minimal model, up to where a throw makes a full turn.

    Returns
    -------
    tuple of CriticalPoint or None
        One per side; None where every throw is decided alike.

    Notes
    -----
    No flight that turns less than 2 pi starts beyond a + pi kappa at small angles, or, times 1 + (a + d)/(pi kappa) at
    most, in the exact model.

    Examples
    --------
    >>> import limitsets as ls
    >>> [round(point.x, 5) for point in first_points(ls.load("paper-designed"))]
    [10.0, 10.0, 20.0]
    """
    own, sides = scene.domain, scene.sides
    turn = sides.a + sides.d + math.pi * scene.kappa
    domain = Domain(own.lo, np.maximum(own.hi, turn[:, None]), own.anchor)
    points = critical_points(scene.bare_map, domain, samples=SAMPLES)
    return tuple(points[side][0] if points[side] else None for side in range(len(sides)))


def nearest_miss(scene: Scene, side: int, until: float) -> tuple[float, float] | None:
    """Find where below a critical point the decision is nearly drawn: an earlier pair of critical points is near.

    Returns
    -------
    (float, float) or None
        x, and the deciding number there; None where it comes nowhere near 0.
    """
    a, lo = float(scene.sides.a[side]), float(scene.domain.lo[side, 0])
    share = np.linspace(0.0, 1.0, BELOW)
    even, graded = lo + (until - lo) * share, a + (lo - a) * ((until - a) / (lo - a)) ** share
    x = np.unique(np.clip(np.concatenate([even, graded]), lo, until))

    def undrawn(at: Array) -> Array:
        return np.abs(margins(scene.bare_map, at, side))

    values = undrawn(x)
    here, higher = values[1:-1], np.maximum(values[:-2], values[2:])
    # a parabola through the three falls below the lowest by less than the highest stands above it
    dips = 1 + np.flatnonzero((here < values[:-2]) & (here <= values[2:]) & (here <= higher - here))
    if dips.size == 0:
        return None
    left, right = x[dips - 1], x[dips + 1]
    for _ in range(NARROWINGS):
        c, d = right - GOLDEN * (right - left), left + GOLDEN * (right - left)
        lower = undrawn(c) < undrawn(d)
        left, right = np.where(lower, left, c), np.where(lower, d, right)
    at = 0.5 * (left + right)
    least = undrawn(at)
    k = int(least.argmin())
    return float(at[k]), float(least[k])


# ----------------------------------------------------------------
# The parameters of a scene as dual numbers, with derivatives with respect to the scene's quantities.
#
# From the text of the scene by the reading that floats and spans of rational numbers share
# (`limitsets.feeder.scene.numbers`).


SPEED, KAPPA = "throw.speed", "throw.kappa"


def present(scene: Scene, name: str) -> float:
    """Return the value of a quantity in the scene's units; a speed that the scene does not know counts as 1.

    A scene given by kappa without gravity has a speed all the same: only its unit is open, and shares of it are not.
    """
    return 1.0 if _speed_is_open(scene, name) else scene.value(name)


def with_present(scene: Scene, values: Mapping[str, float]) -> Scene:
    """Return the scene with other values; an open speed s times the present one makes kappa 1/s^2 times its own."""
    text: dict[str, float | str] = dict(values)
    if SPEED in values and _speed_is_open(scene, SPEED):
        text[KAPPA] = scene.kappa / values[SPEED] ** 2
        del text[SPEED]
    return scene.with_values(text)


def _speed_is_open(scene: Scene, name: str) -> bool:
    return name == SPEED and scene.gravity is None


def sides_of(scene: Scene, names: Sequence[str], before: int = 0) -> list[SideNumbers]:
    """Read the numbers of a scene's sides, in flip order, with their derivatives.

    Parameters
    ----------
    scene : Scene
        The scene.
    names : sequence of str
        The quantities to differentiate by, in the scene's units.
    before : int
        How many more directions the derivatives have, before those of `names`; zero here.

    Returns
    -------
    list of SideNumbers

    Raises
    ------
    SceneError
        An unknown quantity, one that this scene does not give, or two that exclude each other.
    """
    reader = _Duals(scene, names, before)
    rho, h = reader.shape.radius_of_gyration, reader.number("arm.surface_height")
    # the throw does not depend on the corners
    return [
        SideNumbers(a, d, length, rho, reader.kappa, h) for a, d, length, *_ in reader.sides(lambda y, _x: y)
    ]


class _Duals(Numbers):
    """The numbers of one scene, differentiated by some of its quantities."""

    def __init__(self, scene: Scene, names: Sequence[str], before: int) -> None:
        self.open_speed = SPEED in names and _speed_is_open(scene, SPEED)
        shown = {name: scene.value(name) for name in names if not (self.open_speed and name == SPEED)}
        # a speed is written in place of kappa, a tilt in place of an acceleration: then it is what counts
        self.scene = scene.with_values(shown)
        super().__init__(self.scene.text, square_root, sine)
        self.names, self.before = list(names), before

    def seeded(self, value: float, name: str = "") -> Jet:
        """Return a number, the quantity of this name if it is one."""
        dual = multi_dual(value, np.zeros(self.before + len(self.names)))
        if name in self.names:
            slope_of(dual)[self.before + self.names.index(name)] = 1.0
        return dual

    def constant(self, text: str, dimension: str, key: str = "") -> Jet:
        """Return a text of a dimension."""
        return self.seeded(convert(parse(text, dimension), base_unit(dimension, self.scene.unit)))

    def number(self, name: str) -> Jet:
        """Return a quantity by its name; kappa by a share of the speed, where nothing else is known of the speed."""
        dual = self.seeded(self.scene.value(name), name)
        if name == KAPPA and self.open_speed:
            speed = self.seeded(1.0, SPEED)
            return dual / (speed * speed)
        return dual


# ----------------------------------------------------------------
# First critical points with their derivatives by any quantities of the scene: the implicit function theorem.


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
        rows, columns = self.matrix.shape
        return (
            float(np.linalg.det(self.scaled)) if rows == columns and np.isfinite(self.matrix).all() else None
        )

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
    if scene.effects.on():
        raise AnswerError(
            "the scene's effects",
            ", ".join(scene.effects.on()),
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
    sides = sides_of(chosen, names, before=1)
    points = enumerate(zip(sides, first_points(chosen), strict=True))
    rows = [_Row(chosen, part, side, point) for side, (part, point) in points]
    slack = [number for part in sides for number in (part.a, part.length - part.a, part.d)]
    return CriticalJacobian(
        scene=chosen,
        names=names,
        values=np.array([present(chosen, name) for name in names]),
        x=np.array([row.x for row in rows]),
        kinds=tuple(row.kind for row in rows),
        matrix=np.array([row.slope for row in rows]).reshape(len(rows), len(names)),
        reasons=tuple(row.reason for row in rows),
        slack=np.array([float(number) for number in slack]),
        slack_matrix=np.array([slope_of(number)[1:] for number in slack]).reshape(len(slack), len(names)),
    )


class _Row:
    """One side: its first critical point, derivatives, or why there are none."""

    def __init__(self, scene: Scene, part: SideNumbers, side: int, point: CriticalPoint | None) -> None:
        self.scene, self.part, self.side = scene, part, side
        self.slope = np.full(slope_of(part.h).size - 1, np.nan)
        self.x: float = np.nan if point is None else point.x
        self.kind: str | None = None if point is None else point.kind
        self.reason = "every throw is decided alike" if point is None else self._differentiate(point.x)

    def _decision(self, x: float) -> DecidingNumber:
        seed = np.zeros(self.slope.size + 1)
        seed[0] = 1.0
        phi = float(impact_angles(self.scene.bare_map, [x], self.side)[0])
        return decided(self.scene.flight, self.scene.flip, self.part, multi_dual(x, seed), phi)

    def _differentiate(self, start: float) -> str | None:
        x = start
        decision = self._decision(x)
        for _ in range(STEPS):
            if abs(decision.steepness) < TOUCHING:
                return "the flight only grazes the arm: another impact is about to be the first"
            if abs(slope_of(decision.margin)[0]) * x < TOUCHING * decision.size:
                return "dF/dr = 0: two critical points meet"
            step = decision.margin.value / slope_of(decision.margin)[0]
            if not abs(step) <= STRAYED * x:
                return "the decision jumps: the impact, or the way the part turns over, changes there"
            x -= step
            decision = self._decision(x)
        miss = nearest_miss(self.scene, self.side, start - 4.0 * STRAYED * start)
        if miss is not None and miss[1] < DRAWN * self._decision(miss[0]).size:
            return f"another critical point is about to be the first, at x = {miss[0]:.9g}"
        self.x = x
        self.slope = -slope_of(decision.margin)[1:] / slope_of(decision.margin)[0]
        return None
