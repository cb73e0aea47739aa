"""What a comparison with effects found, in a sentence, tables and advice."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from limitsets.base import Column, Table, Tabled, as_table, picked, rounded
from limitsets.feeder.scene import Scene
from limitsets.parameters.discrepancy.measuring import Arrivals, Moved
from limitsets.parameters.margins.margin_result import Margin, bound
from limitsets.proofs.auditing import Audit, Finding

BY = {
    "landing": "another corner that lands first",
    "roll": "rolling",
    "slip": "friction",
    "pivot": "friction",
    "bounce": "restitution",
    "drive": "the stroke",
}
"""What moves a landing, per effect, in the words of someone who builds a feeder."""


@dataclass(frozen=True, eq=False)
class Discrepancy(Tabled):
    """The minimal model against the model with the effects that a scene calls for.

    Attributes
    ----------
    scene : Scene
        The scene.
    effects : tuple of str
        The effects that are simulated: those called for, whose facts are given.
    left_out : dict of str to str
        Effects that are called for, or cannot be told, and are not simulated, and why.
    rows : tuple of Moved
        How far landings are moved, by place.
    covered : dict of str to float
        By place the landing noise with which the minimal model is proved to stay on its cells, where no landing is
        moved farther and no part comes to another side; as sure as the comparison of that place is [length].
    margin : Margin or None
        How much landing noise the goal survives; None without a goal.
    arrive : dict of str to Arrivals
        What becomes of starts, simulated: "minimal" without effects, "effects" with them.
    audit : Audit
        Which assumptions of the minimal model the scene breaks.
    scenes : tuple of Scene
        The scene without effects, and with them.
    """

    scene: Scene
    effects: tuple[str, ...]
    left_out: dict[str, str]
    rows: tuple[Moved, ...]
    covered: dict[str, float]
    margin: Margin | None
    arrive: dict[str, Arrivals]
    audit: Audit
    scenes: tuple[Scene, ...]

    def row(self, place: str) -> Moved | None:
        """Give what is proved of all cells of a place, else what is sampled; None where there are no cells."""
        mine = [each for each in self.rows if each.place == place]
        return best_of(mine) if mine else None

    @property
    def sentence(self) -> str:
        """The answer in one sentence."""
        if not self.effects:
            return "the scene calls for no effect that can be simulated"
        causes = [*dict.fromkeys(BY.get(name, name) for name in self.effects)]
        by = " and ".join(filter(None, (", ".join(causes[:-1]), causes[-1])))
        arrive = f"simulated with these effects {_percent(self.arrive['effects'].share)} of the starts arrive"
        worst = self.row("limit-set")
        if worst is None:
            return f"the minimal model is not proved to keep any start: {by} cannot be compared with it; {arrive}"
        how = f"sampled, {worst.throws:.0e} throws".replace("e+0", "e") if worst.throws else worst.how
        moves = "moves" if len(causes) == 1 else "move"
        said = f"{by} {moves} a landing by up to {bound(worst.most, self.scene.unit, up=True)} ({how})"
        if "limit-set" not in self.covered:
            return f"{said}{_other_sides(worst)}: not covered; {arrive}"
        survives = "the scene has no goal" if self.margin is None else _survived(self.margin)
        return f"{said}; {survives}" + (
            "" if "starts" in self.covered else f"; starts are not covered: {arrive}"
        )

    @property
    def enough(self) -> bool | None:
        """Whether the goal is proved to survive what covers the limit set; None where that is not known."""
        deviation = self.covered.get("limit-set")
        if deviation is None or self.margin is None or self.margin.unit != self.scene.unit:
            return None
        return deviation <= self.margin.proved

    @property
    def advice(self) -> list[str]:
        """What to change, as far as facts of the scene decide: sentences."""
        broken = [each for each in self.audit.on("limit-set") if each.called_for]
        lines = [words for each in broken if (words := _wanted(each, self.scene.world, self.scene.unit))]
        if self.enough is False and self.margin is not None:
            lines.append(
                f"the goal is proved for deviations up to {bound(self.margin.proved, self.margin.unit)} only: "
                "limitsets design --robust looks for a scene with wider margins"
            )
        return lines

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        unit = self.scene.unit
        columns = (
            "place",
            "effects",
            "how",
            Column("of the arm", show=_percent),
            Column("least", unit, ".4g"),
            Column("greatest", unit, ".4g"),
            Column("other side", show=_percent),
            Column("unknown", show=_percent),
            Column("covered to", unit, ".4g"),
        )
        rows = [
            (
                each.place,
                ", ".join(each.effects),
                each.how,
                each.share,
                *((each.lo, each.hi) if each.lo <= each.hi else (None, None)),
                each.changed,
                each.unknown,
                self.covered.get(each.place),
            )
            for each in self.rows
        ]
        return (
            Table(
                columns, rows, f"{self.scene.name}: landings with effects less those without", self.sentence
            ),
        )

    def to_json(self) -> dict[str, Any]:
        """Give it as a plain table for JSON."""
        margin = None if self.margin is None else {"proved": self.margin.proved, "unit": self.margin.unit}
        return as_table(
            **picked(self, "effects", "left_out", "covered", "enough"),
            **picked(self, "sentence", "advice"),
            places=[each.to_json() for each in self.rows],
            margin=margin,
            arrive={name: each._asdict() for name, each in self.arrive.items()},
        )


def best_of(rows: Sequence[Moved]) -> Moved:
    """Return what is proved of all cells of a place, else the samples, which come last."""
    return next((each for each in rows if each.same_sides), rows[-1])


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"


def _wanted(finding: Finding, world: Any, unit: str) -> str:
    """Say which fact of the world would keep an assumption, or what else would; empty for nothing to say."""
    worst, name = math.inf if finding.worst is None else finding.worst, finding.about.name
    key = finding.about.effect, finding.about.what
    holds = "only a surface that holds the corner does"
    if key in (("slip", "friction"), ("pivot", "friction"), ("release", "friction")):
        if math.isfinite(worst):
            return f"{name}: friction of {rounded(worst, '.3g', up=True)} is needed, and there is {world.friction:g}"
        return f"{name}: no friction is enough, {holds}"
    if key == ("pivot", "press"):
        return f"{name}: the arm would have to pull, {holds}"
    if key == ("bounce", "height"):
        return f"{name}: a bounce rises by {bound(worst, unit, up=True)}; a softer surface lessens it"
    return ""


def _survived(margin: Margin) -> str:
    if not margin.proved:
        return "no margin of landing.x is proved"
    return f"the goal survives {bound(margin.proved, margin.unit)} at every throw (proved)"


def _other_sides(row: Moved) -> str:
    """Say how many throws end on another side, or outside the model; empty if none does."""
    words = ((row.changed, "end on another side"), (row.unknown, "are outside the model"))
    return "".join(f", {_percent(share)} of the throws {text}" for share, text in words if share)
