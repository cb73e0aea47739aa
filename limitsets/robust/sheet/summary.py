"""The robustness of a scene as one answer: margins, the best X, noise, and the parts left out with their reasons."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from limitsets.files import as_table, picked
from limitsets.goals import Goal
from limitsets.robust.margins.beyond import MarginsBeyond
from limitsets.robust.margins.margin_result import Margin
from limitsets.robust.margins.margin_texts import NOT_FOUND, void_of
from limitsets.robust.noise.statistics import Levels, NoiseStatistics
from limitsets.robust.sheet.entries import Entry
from limitsets.scene import Scene
from limitsets.scene.left_out import WITHOUT_SCATTER, Model
from limitsets.scene.units import exact_factor
from limitsets.tables import Table, Tabled, joined

if TYPE_CHECKING:
    from limitsets.auditing import Audit

PARTS = ("margins", "joint", "curve", "noise", "audit")
"""What an answer is put together from."""


@dataclass(frozen=True, eq=False)
class Robustness(Tabled):
    """How far a scene may drift, and what chance does to it.

    Attributes
    ----------
    scene : Scene
        The scene that was asked, its scatter left out.
    goals : tuple of Goal
        What has to hold, all of it.
    verdict : str
        Of the goals in the scene as it is: "proved", "refuted" or "undecided"; of a scene that scatters its throws
        followed by "of the scene without its scatter".
    reach : float or None
        Where the attracting cells end in which the goals are proved of the scene as it is.
    entries : tuple of Entry
        One per quantity and reading; the last is joint, where there is a tolerance.  Proved and refuted.
    tolerance : dict of str to str
        The vector that the joint factor is on.
    curve : MarginsBeyond or None
        Margins against X, of "beyond X only this side, and almost every orbit comes there".  Proved and refuted.
    noise : NoiseStatistics or None
        What chance does.  Computed between cells, not proved.
    levels : Levels or None
        Its numbers at other levels of the noise.
    law : str
        How the law of the noise was come by.
    audit : Audit or None
        Assumptions of the model that the scene breaks.
    left_out : dict of str to str
        Which of `PARTS`, or which margin, there is nothing of, and why.
    width : float
        How close brackets had to be.
    digests : dict of str to str
        Of all that margins depend on, single ones and the joint one.
    again : int
        How many margins were found by an earlier run.
    seconds : float
        Time it took.
    """

    scene: Scene
    goals: tuple[Goal, ...]
    verdict: str
    reach: float | None
    entries: tuple[Entry, ...]
    tolerance: dict[str, str]
    curve: MarginsBeyond | None
    noise: NoiseStatistics | None
    levels: Levels | None
    law: str
    audit: Audit | None
    left_out: dict[str, str]
    width: float
    digests: dict[str, str]
    again: int
    seconds: float

    @property
    def decided(self) -> str:
        """The first word of the verdict: that on `scene`, whether or not the scene that was asked scatters."""
        return self.verdict.removesuffix(f" {WITHOUT_SCATTER}")

    @property
    def model(self) -> Model:
        """Of which model the proofs are, which facts of the scene that leaves out, and what the audit found."""
        of = Model.of(self.scene)
        if self.audit is None:
            return of
        found = (each for each in self.audit.on("limit-set") if each.called_for and not each.simulated)
        return replace(of, broken=tuple(each.effect for each in found))

    @property
    def singles(self) -> tuple[Entry, ...]:
        """The margins of single quantities."""
        return tuple(entry for entry in self.entries if entry.quantity != "joint")

    @property
    def joint(self) -> Entry | None:
        """The factor on the tolerance."""
        return next((entry for entry in self.entries if entry.quantity == "joint"), None)

    @property
    def failed(self) -> tuple[str, ...]:
        """Those of `left_out` whose search ended with an error."""
        return tuple(part for part, why in self.left_out.items() if why.startswith(NOT_FOUND))

    def margins(self) -> tuple[Margin, ...]:
        """Give the entries as margins without their proofs, as figures take them."""
        return tuple(self._margin(entry) for entry in self.entries)

    def _margin(self, entry: Entry) -> Margin:
        joint = entry.quantity == "joint"
        nominal = entry.nominal
        # in the unit of the deviation
        if nominal is not None and entry.unit not in ("%", entry.nominal_unit):
            nominal = float(Fraction(repr(nominal)) * exact_factor(entry.nominal_unit, entry.unit))
        return Margin(
            entry.quantity,
            entry.reading,
            self.goals,
            entry.proved,
            entry.refuted,
            entry.unit,
            nominal,
            entry.reason,
            entry.closed,
            entry.seconds,
            self.scene,
            self.tolerance if joint else {},
            {},
            {},
            (),
            None,
            entry.direction,
        )

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        margins = joined(self.margins()) if self.entries else Table(("quantity",), (), "No margins")
        shown = [margins]
        if self.curve is not None:
            shown += self.curve.tables()
        if self.noise is not None:
            shown += self.noise.tables()
        return tuple(shown)

    def to_json(self) -> dict[str, Any]:
        """Give it as plain tables for JSON: null, never nan."""
        return as_table(
            complete=True,
            digests=self.digests,
            scene=self.scene.as_dict(),
            holds={"proved": True, "refuted": False}.get(self.verdict),
            vacuous=bool(void_of(self.goals, self.reach, self.scene.unit)),
            margins=self.entries,
            tolerance=self.tolerance or None,
            curve=self.curve,
            noise=None if self.noise is None else self.noise.to_json() | {"law": self.law},
            noise_levels=self.levels,
            assumptions=self.audit,
            model=self.model,
            **picked(self, "left_out", "width", "seconds"),
        )
