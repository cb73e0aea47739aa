"""One line of a tolerance sheet: a margin as plain data, to be written to a file and read again.

A `Margin` holds the cells of its proof.  A line of the sheet is thousands of times smaller: the bracket, the orbit at
its upper end, and the names of the files that prove both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from limitsets.files import picked
from limitsets.robust.margins.deviations import nominal_of
from limitsets.scene.units import exact_factor

if TYPE_CHECKING:
    from limitsets.robust.margins.margin_result import Margin

REFUTED = ".refuted.zip"

# Fields that JSON has by the same name and in the same form.
SAME = (
    "quantity",
    "reading",
    "proved",
    "refuted",
    "nominal",
    "nominal_unit",
    "direction",
    "closed",
    "violated",
    "pieces",
)


@dataclass(frozen=True)
class Entry:
    """How much one quantity of a scene, or all of its tolerance, may deviate.

    Attributes
    ----------
    quantity : str
        Its name; "joint" for all of the tolerance together.
    reading : str
        "fixed" (but unknown), "per-throw" (another one at every throw), or "tolerance" for joint.
    goals : tuple of dict
        What has to hold, all of it.
    proved : float
        Proved for every deviation up to this; 0 if for none.
    refuted : float or None
        At this deviation an orbit violates a goal; None if no such deviation is found.
    unit : str
        Of both; "" for joint, a factor on the tolerance.
    nominal : float or None
        The value about which it deviates, in `nominal_unit`.
    nominal_unit : str
        Its unit.
    closed : bool
        Whether the two ends are as close as was asked.
    reason : str
        Why there is no upper end, or why the ends are farther apart; empty otherwise.
    violated : int or None
        Which of the goals the orbit violates.
    counterexample : tuple of dict
        The orbit: x, the interval that holds it, side, parameters of the throw; empty without one.
    certificates : tuple of str
        Names of the files that prove it.
    against : str or None
        Name of the file of the counterexample.
    pieces : int
        Boxes that the proof took.
    seconds : float
        Time it took.
    direction : str or None
        "more" or "less", as of a `Margin`.
    """

    quantity: str
    reading: str
    goals: tuple[dict[str, Any], ...]
    proved: float
    refuted: float | None
    unit: str
    nominal: float | None
    nominal_unit: str
    closed: bool
    reason: str
    violated: int | None
    counterexample: tuple[dict[str, Any], ...]
    certificates: tuple[str, ...]
    against: str | None
    pieces: int
    seconds: float
    direction: str | None

    @property
    def key(self) -> str:
        """What tells it from the other lines of a sheet."""
        return f"{self.quantity} {self.reading}"

    @property
    def holds(self) -> bool:
        """Whether the goal holds without any deviation."""
        return self.proved > 0.0

    @classmethod
    def of(cls, margin: Margin, files: Sequence[str] = ()) -> Entry:
        """Write a margin down, with the names of its files."""
        nominal, unit = nominal_of(margin.scene, margin.quantity)
        broken = None if margin.against is None else margin.against.refuted
        record = margin.to_json()
        return cls.read(
            record
            | {
                "nominal": nominal,
                "nominal_unit": unit,
                "violated": margin.goals.index(broken) if broken is not None else None,
                "certificate": [name for name in files if not name.endswith(REFUTED)],
                "refutation": next((name for name in files if name.endswith(REFUTED)), None),
            }
        )

    @classmethod
    def read(cls, record: Mapping[str, Any]) -> Entry:
        """Read what `to_json` wrote."""
        goals, proofs = record["goal"], record["certificate"] or []
        return cls(
            goals=tuple(goals) if isinstance(goals, list) else (goals,),
            unit=record["unit"] or "",
            reason=record["reason"] or "",
            counterexample=tuple(record["counterexample"] or ()),
            certificates=tuple(proofs) if isinstance(proofs, list) else (proofs,),
            against=record["refutation"],
            seconds=record["timings"]["margin"],
            **{name: record[name] for name in SAME},
        )

    def to_json(self) -> dict[str, Any]:
        """Give it as a plain table for JSON, in the words of `Margin.to_json` and some more."""
        proofs = self.certificates
        return picked(self, *SAME) | {
            "goal": list(self.goals) if len(self.goals) > 1 else self.goals[0],
            "unit": self.unit or None,
            "reason": self.reason or None,
            "counterexample": list(self.counterexample) or None,
            "certificate": (list(proofs) if len(proofs) > 1 else proofs[0]) if proofs else None,
            "refutation": self.against,
            "timings": {"margin": self.seconds},
        }


def percent_of(entry: Entry, size: float | None) -> float | None:
    """Give a deviation in percent of the value; None where there is no value, or it is 0."""
    if size is None or entry.unit == "%":
        return size
    if not entry.nominal or entry.unit == "":
        return None
    if entry.unit != entry.nominal_unit:
        size *= float(exact_factor(entry.unit, entry.nominal_unit))
    return 100.0 * size / abs(entry.nominal)


def in_unit_of(entry: Entry, size: float, unit: str) -> float | None:
    """Give a deviation in another unit, percent included; None where a percentage has no value to be one of."""
    if entry.unit == unit:
        return size
    if unit == "%":
        return percent_of(entry, size)
    if entry.unit != "%":
        return size * float(exact_factor(entry.unit, unit))
    if entry.nominal is None:
        return None
    return 0.01 * size * abs(entry.nominal) * float(exact_factor(entry.nominal_unit, unit))
