"""Margins of a map: how far a parameter may move while every start of some boxes is proved to end in others.

The search is that of scenes (`brackets`).  It asks for the claim "ends-in" of `limitsets.certify`, on the same cells
for all values; what refutes it is a cycle that attracts, has a point inside the starts and one outside the ends.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

from limitsets.base import (
    AnswerError,
    Column,
    Progress,
    Table,
    arguments_checked_as,
    as_table,
    picked,
    shown,
    shown_in_notebooks,
)
from limitsets.parameters.margins.brackets import NARROWER, Bracket, bracket_fixed
from limitsets.parameters.margins.margin_result import bound, bound_above
from limitsets.proofs.prover.certificate import Saved
from limitsets.proofs.prover.certificate_of_map import write_map
from limitsets.proofs.prover.numbers import RationalInterval
from limitsets.proofs.prover.of_map import certify_map, proved_again, refuted_again
from limitsets.proofs.prover.proof_of_map import ProofOfMap
from limitsets.proofs.prover.recording import names_of
from limitsets.systems.cells import Grid
from limitsets.systems.maps.contract import with_number


@dataclass(frozen=True, eq=False)
class _Outcome:
    """The verdict on the goal between two corners, and the proof."""

    verdict: str
    reason: str
    proof: ProofOfMap
    piece: Any
    within: Any = None


@dataclass(frozen=True, eq=False)
class _Query:
    """The goal of a map on a grid, asked of other values: `brackets.Asked`."""

    first: ProofOfMap

    def _corners(self, piece: Any) -> tuple[Any, Any]:
        return piece or (self.first.map, self.first.upper)

    def prove(self, piece: Any = None, noise: Any = None, finest: int = 0) -> _Outcome:
        """Prove the goal; there is no noise, and the cells are those that were given."""
        proof = proved_again(self.first, *self._corners(piece))
        return _Outcome(proof.claims[0].verdict, proof.claims[0].reason, proof, piece)

    def refute(self, piece: Any = None, noise: Any = None) -> _Outcome:
        """Refute it."""
        proof = refuted_again(self.first, *self._corners(piece))
        return _Outcome(proof.claims[0].verdict, proof.claims[0].reason, proof, piece)

    def unjoined(self, pieces: Any) -> str:
        """Say why pieces are not one claim: never, for each is proved for the same starts and ends."""
        return ""


@dataclass(frozen=True)
class _Scale:
    """A parameter about its value, in its own unit: `brackets.Scale`, and its `brackets.Sizes`."""

    key: str
    map: Any
    nominal: Fraction
    most: Fraction | None = None
    widest: Fraction | None = None

    @property
    def least(self) -> Fraction:
        """A thousandth of the value, or of 1 where that is 0."""
        return abs(self.nominal) / 1000 or Fraction(1, 1000)

    def alone(self) -> _Scale:
        """Return its deviations by 1."""
        return self

    def corner(self, factor: Fraction, signs: tuple[int, ...]) -> Any:
        """Return the map at a deviation."""
        at = self.nominal + factor * signs[0]
        return self.piece(RationalInterval(at, at))

    def noise(self, factor: Fraction) -> dict[str, str]:
        """Say that nothing differs at every step."""
        return {}

    def texts(self, factor: Fraction) -> dict[str, str]:
        """Write a deviation."""
        return {self.key: self.text(factor)}

    def text(self, size: Fraction) -> str:
        """Write a size."""
        return f"{float(size):g}"

    def between(self, one: Fraction, other: Fraction) -> RationalInterval:
        """Return the values at all deviations between two."""
        return RationalInterval(self.nominal + min(one, other), self.nominal + max(one, other))

    def piece(self, span: RationalInterval) -> Any:
        """Return the corners of the maps with these values.

        Sizes are short decimals, and so is the sum, which is what a certificate writes for the double next to it.
        """
        return with_number(self.map, self.key, float(span.lo)), with_number(
            self.map, self.key, float(span.hi)
        )


@dataclass(frozen=True, eq=False)
class MarginOfMap(Saved):
    """How far one parameter of a map may deviate while every start of some boxes ends in others.

    Attributes
    ----------
    quantity : str
        The parameter.
    nominal : float
        Its value.
    proved : float
        The goal is proved for every value that is no farther from it; 0 if for none.
    refuted : float or None
        So far from it an open set of starts violates the goal; None if no such value is found.
    direction : str or None
        "more" or "less": whether that value is greater or smaller.
    reason : str
        Why there is no upper end, or why the two are farther apart than asked; empty if they are not.
    closed : bool
        Whether they are as close as was asked.
    seconds : float
        Time it took.
    pieces : tuple of ProofOfMap
        What proves it: ranges of the parameter.
    against : ProofOfMap or None
        What refutes it.
    """

    quantity: str
    nominal: float
    proved: float
    refuted: float | None
    direction: str | None
    reason: str
    closed: bool
    seconds: float
    pieces: tuple[ProofOfMap, ...] = field(repr=False)
    against: ProofOfMap | None = field(repr=False)

    @property
    def holds(self) -> bool:
        """Whether the goal holds without any deviation."""
        return self.proved > 0.0

    @property
    def interval(self) -> tuple[float, float] | None:
        """The values for which the goal is proved, at least so far as `proved` on both sides; None for none."""
        ends = [
            dict(names_of(corner))[self.quantity] for each in self.pieces for corner in (each.map, each.upper)
        ]
        return (min(ends), max(ends)) if ends else None

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        sizes = Column("proved up to", show=bound), Column("refuted from", show=bound_above)
        row = (self.quantity, self.nominal, self.proved, self.refuted, self.direction, self.interval)
        values = Column("proved for", show=".6g", ends=True, inward=True)
        heads = ("parameter", Column("value", show=".6g"), *sizes, "direction", values)
        return (Table(heads, [row], "Margin", "deviations: proved below, refuted above"),)

    def to_json(self) -> dict[str, Any]:
        """Give it as a plain table for JSON."""
        plain = picked(self, "quantity", "nominal", "proved", "refuted", "direction", "closed", "interval")
        return as_table(
            **plain,
            reason=self.reason or None,
            pieces=len(self.pieces),
            timings={"margin": self.seconds},
        )

    def _write(self, path: str | Path, **how: Any) -> None:
        """Write the ranges that are proved and the value that is refuted, each a box of parameters."""
        proofs = [*self.pieces, *([] if self.against is None else [self.against])]
        if not proofs:
            raise AnswerError("the margin", "neither proved nor refuted", "one of both", "see its reason")
        assert proofs[0].goal is not None
        write_map(
            path,
            proofs[0].graph.grid.domain,
            [proof.part() for proof in proofs],
            goal=proofs[0].goal.in_file(),
            **how,
        )


def require_width(width: float) -> None:
    """Refuse a width that is no share."""
    if not 1e-4 <= width < 1:
        raise AnswerError("the width", width, "from 0.0001 to below 1", "0.01 is a hundredth")


@shown_in_notebooks
@arguments_checked_as("margin")
def margins_of_map(
    map: Any,  # noqa: A002  # the field's word
    grid: Grid,
    *quantities: str,
    ends: Any = None,
    starts: Any = None,
    width: float = 0.01,
    progress: Progress | None = None,
) -> tuple[MarginOfMap, ...]:
    """Bracket margins of parameters of a map; called by `limitsets.margin`.

    Parameters
    ----------
    map : NamedTuple
        The map.
    grid : Grid
        The cells; finer ones prove more.
    *quantities : str
        Names of parameters, those in others with a point (``arm.length``); default all.
    ends, starts : sequence of boxes
        The goal, as for `limitsets.certify`.  Without `starts` nothing refutes it.
    width : float
        How close the two ends of a bracket have to be, as a share of the upper one.
    progress : callable, optional
        Called with what is done, how much of it, and of how much.

    Raises
    ------
    AnswerError
        For a parameter that the map does not have, no ends, or what `limitsets.certify` refuses.
    """
    require_width(width)
    if ends is None:
        allowed = "boxes in which orbits end"
        raise AnswerError("the argument ends of margin", None, allowed, "pass ends=[[(lo, hi)]]")
    first = certify_map(map, grid, ["ends-in"], ends=ends, starts=starts)
    values = dict(names_of(first.map))
    for name in quantities:
        if name not in values:
            raise AnswerError("the parameter", shown(name), ", ".join(values), "correct the word")
    margins = []
    for number, name in enumerate(dict.fromkeys(quantities or values)):

        def tell(share: float, name: str = name, number: int = number) -> None:
            if progress is not None:
                progress(f"margin of {name}, {100 * share:.0f} %", number, len(quantities or values))

        scale = _Scale(name, first.map, Fraction(repr(values[name])))
        margins.append(_margin(first, scale, Fraction(repr(width)), tell))
    return tuple(margins)


def _margin(first: ProofOfMap, scale: _Scale, width: Fraction, tell: Callable[[float], None]) -> MarginOfMap:
    begin = time.perf_counter()
    tell(0.0)
    (claim,) = first.claims
    if claim.verdict == "proved":
        bracket = bracket_fixed(_Query(first), scale, width, tell)
    elif claim.verdict == "refuted":
        against = _Outcome(claim.verdict, claim.reason, first, None)
        bracket = Bracket(refuted=Fraction(0), against=against, reason=f"the goal fails: {claim.reason}")
    else:
        bracket = Bracket(reason=f"the goal is not proved of the map as it is: {claim.reason}")
    return MarginOfMap(
        quantity=scale.key,
        nominal=float(scale.nominal),
        proved=float(bracket.proved),
        refuted=None if bracket.refuted is None else float(bracket.refuted),
        direction=("more" if bracket.sign > 0 else "less") if bracket.refuted else None,
        reason=bracket.reason.replace(NARROWER, "take finer cells"),
        closed=bracket.closed(width),
        seconds=time.perf_counter() - begin,
        pieces=tuple(piece.proof for piece in bracket.pieces),
        against=None if bracket.against is None else bracket.against.proof,
    )
