"""How stable a part lies on each of its sides: the angles by which the ground leans when it tips over, enclosed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from limitsets.base import AnswerError, Column, Table, Tabled, arguments_checked, rounded
from limitsets.feeder.scene import load
from limitsets.proofs.prover.numbers import RationalInterval, angle, pi, square_root
from limitsets.proofs.prover.parameters import body_of

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene

Ends = tuple[float, float]


@dataclass(frozen=True, repr=False)
class SideStability:
    """How stable a part lies on one side; each pair encloses the number.

    Attributes
    ----------
    side : int
        In flip order.
    rests : bool
        Whether the centre of mass stands above the inside of the side.
    length, a, d : pair of float
        Of the side; along it from its left end to below the centre of mass; height of the centre of mass [length].
    left, right : pair of float
        The angle by which the ground has to lean before the part tips over that end of the side [deg]; below 0 where
        the part tips by itself.
    over_left, over_right : int
        The side on which it comes to lie then, if it rests there.
    lift_left, lift_right : pair of float
        By how much the centre of mass rises when the part is turned over that end [length].
    """

    side: int
    rests: bool
    length: Ends
    a: Ends
    d: Ends
    left: Ends
    right: Ends
    over_left: int
    over_right: int
    lift_left: Ends
    lift_right: Ends


@dataclass(frozen=True, repr=False)
class Stability(Tabled):
    """On which sides a part rests, and how stable it lies there.

    Attributes
    ----------
    scene : Scene
        The scene.
    sides : tuple of SideStability
        In flip order.
    tolerance : dict of str to str
        Quantities that are known to a deviation only; the angles hold for all values in it.
    """

    scene: Scene
    sides: tuple[SideStability, ...]
    tolerance: Mapping[str, str]

    def tables(self) -> tuple[Table, ...]:
        """Give the table that shows it."""
        unit = self.scene.unit
        columns = (
            "side",
            Column("length", unit, ".6g", ends=True),
            Column("centre of mass along", unit, ".6g", ends=True),
            Column("above", unit, ".6g", ends=True),
            "rests",
            Column("tips left beyond", "deg", _down),
            "left onto side",
            Column("tips right beyond", "deg", _down),
            "right onto side",
        )
        rows = [
            (
                each.side,
                *(_merged(ends) for ends in (each.length, each.a, each.d)),
                each.rests,
                each.left[0],
                each.over_left,
                each.right[0],
                each.over_right,
            )
            for each in self.sides
        ]
        return (
            Table(columns, rows, f"How stable {self.scene.name} lies on its sides", "proved for its outline"),
        )

    def to_json(self) -> list[dict[str, Any]]:
        """Give an object for each side, as JSON has it."""
        return [vars(each) for each in self.sides]


def _down(angle: float) -> str:
    return rounded(angle, ".2f", up=False)


def _merged(ends: Ends) -> Ends:
    """Give an enclosure by its middle, twice, where its ends differ by rounding alone."""
    middle = 0.5 * (ends[0] + ends[1])
    return (middle, middle) if ends[1] - ends[0] <= 1e-12 * abs(middle) else ends


@arguments_checked
def stability(source: Scene | str, *, tolerance: Mapping[str, str] | None = None) -> Stability:
    """Say on which sides a part rests, and by how much the ground has to lean before it tips over.

    Parameters
    ----------
    source : Scene or str
        The scene, or what `limitsets.load` takes.
    tolerance : mapping of str to str, optional
        Quantities of the part that are known to a deviation only, ``{"part.mass.center.along": "0.02 in"}``.

    Returns
    -------
    Stability

    Raises
    ------
    AnswerError
        A quantity that the scene does not give, or a part of which nothing is proved throughout the tolerance.

    Notes
    -----
    The part tips over the left end of a side where the centre of mass stands right above that end: the ground leans by
    the angle whose tangent is a/d then, and by that of (L - a)/d for the right end.  The scene's decimals are taken
    exactly; every step rounds outward.

    Examples
    --------
    >>> first = stability("paper-designed").sides[0]
    >>> [round(end, 3) for end in first.left], first.over_left
    ([47.378, 47.378], 1)
    """
    scene = load(source)
    enclosed, sides = body_of(scene, tolerance or {}), []
    count, degrees = len(enclosed), 180 / pi()
    for side, (a, d, length) in enumerate(enclosed):
        right = length - a
        rests = a.lo > 0 and right.lo > 0
        if d.lo <= 0 or not (rests or a.hi <= 0 or right.hi <= 0):
            raise AnswerError(
                f"the foot of the centre of mass on side {side}",
                f"{float(a):.6g} {scene.unit}",
                "inside the side or outside, throughout the tolerance",
                "lower the tolerance",
            )
        sides.append(
            SideStability(
                side,
                rests,
                length.outward(),
                a.outward(),
                d.outward(),
                left=((pi() / 2 - angle(d, a)) * degrees).outward(),
                right=((pi() / 2 - angle(d, right)) * degrees).outward(),
                over_left=(side + 1) % count,
                over_right=(side - 1) % count,
                lift_left=_lift(a, d).outward(),
                lift_right=_lift(right, d).outward(),
            )
        )
    return Stability(scene, tuple(sides), dict(tolerance or {}))


def _lift(along: RationalInterval, above: RationalInterval) -> RationalInterval:
    """Enclose the rise of a point to right above a corner: hypot - d as a quotient, in which nothing cancels.

    It rises with the square of the distance along and falls with the height.
    """
    squares = sorted((abs(along.lo), abs(along.hi)))
    least = Fraction(0) if along.lo <= 0 <= along.hi else squares[0]

    def lift(x: Fraction, y: Fraction) -> RationalInterval:
        square = RationalInterval.of(x * x)
        return square / (square_root(square + RationalInterval.of(y * y)) + RationalInterval.of(y))

    return RationalInterval(lift(least, above.hi).lo, lift(squares[1], above.lo).hi)
