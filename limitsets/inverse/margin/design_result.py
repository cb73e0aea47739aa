"""A robust design, and what others get of it: plain tables for JSON, and a folder with scene, answer, certificates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from limitsets.files import as_json, as_table, picked
from limitsets.goals import Goal
from limitsets.inverse.margin.counterweight import Counterweight
from limitsets.inverse.margin.feeding import ThrowsToFeed
from limitsets.inverse.margin.front import Option
from limitsets.inverse.margin.search import Candidate
from limitsets.robust.margins.estimate import Estimate
from limitsets.robust.margins.margin_result import Margin, settled
from limitsets.scene import Scene, dump
from limitsets.scene.left_out import Model
from limitsets.scene.spelling import in_unit_of, unit_of
from limitsets.tables import Column, Table, Tabled, joined


@dataclass(frozen=True, eq=False)
class RobustDesign(Tabled):
    """A design for a large margin.

    Attributes
    ----------
    scene : Scene
        The design, with [goal] (the first of `goals`) and [tolerance].
    goals : tuple of Goal
        What has to hold, all of it.
    x, side : float, int
        Where parts are fed [length].
    varied : tuple of str
        What was varied.
    tolerance : dict of str to str
        What the margin multiplies.
    sampled : Estimate
        Its margin by floats, and the effect of each quantity.
    margins : tuple of Margin
        Proved and refuted, one for each of `goals`; empty where no proof was asked for.
    lead : Counterweight
        The point mass that makes it of a plate.
    feeding : ThrowsToFeed
        Throws to feed, sampled.
    front : tuple of Option
        Designs that no other one beats both in margin and in throws, by floats; the surest first.
    history : tuple of Candidate
        Every design tried that feeds at all.
    before : Scene
        Where the search began.
    before_sampled : Estimate or None
        The margin there, at the best X there, by floats.
    before_margins : tuple of Margin
        The same, proved and refuted.
    before_feeding : ThrowsToFeed or None
        Throws to feed there, sampled.
    evaluations : int
        Designs looked at.
    seconds : float
        Time of the search, without proofs.
    """

    scene: Scene
    goals: tuple[Goal, ...]
    x: float
    side: int
    varied: tuple[str, ...]
    tolerance: dict[str, str]
    sampled: Estimate
    margins: tuple[Margin, ...]
    lead: Counterweight
    feeding: ThrowsToFeed
    front: tuple[Option, ...]
    history: tuple[Candidate, ...]
    before: Scene
    before_sampled: Estimate | None
    before_margins: tuple[Margin, ...]
    before_feeding: ThrowsToFeed | None
    evaluations: int
    seconds: float

    @property
    def ratio(self) -> float | None:
        """What is proved of the design over what is refuted of the scene before: so often larger at least."""
        proved, refuted = both(self.margins)[0], both(self.before_margins)[1]
        return None if proved is None or not refuted else proved / refuted

    @property
    def model(self) -> Model:
        """Of which model the design is, and which facts of the scene that leaves out."""
        return Model.of(self.scene)

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        sides = tuple(
            f"part.sides[{k}]" for k in range(len(self.scene.sides)) if "sides" in self.scene.text["part"]
        )
        rows = [
            (
                name,
                in_unit_of(self.before, name, self.before.value(name)),
                in_unit_of(self.before, name, self.scene.value(name)),
                unit_of(self.before, name),
            )
            for name in (*sides, *self.varied)
        ]
        columns = ("quantity", Column("before", show=".6g"), Column("design", show=".6g"), "unit")
        found = Table(columns, rows, f"{self.scene.name}: robust design", self.model.sentence)
        return found, *((joined(self.margins),) if self.margins else ())

    def to_json(self) -> dict[str, Any]:
        """Give it as plain tables for JSON; every number is finite or null."""
        sides = tuple(
            f"part.sides[{k}]" for k in range(len(self.scene.sides)) if "sides" in self.scene.text["part"]
        )
        values, before = (
            {name: scene.value(name) for name in (*sides, *self.varied)}
            for scene in (self.scene, self.before)
        )
        return as_table(
            scene=self.scene.as_dict(),
            **picked(self, "x", "side", "tolerance"),
            values=values,
            before=before,
            **picked(self, "sampled", "margins", "before_sampled", "before_margins", "ratio"),
            lead=self.lead._asdict(),
            throws=self.feeding,
            before_throws=self.before_feeding,
            **picked(self, "front", "evaluations"),
            model=self.model,
            timings={"search": self.seconds},
        )

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write the scene, the answer as JSON, and what `limitsets.recheck` checks of the margin; checked before."""
        return save(self, Path(folder))[1]


def both(margins: Sequence[Margin]) -> tuple[float | None, float | None]:
    """Give the factor to which all goals are proved, and that at which one is refuted; None where not known."""
    refuted = [one.refuted for one in margins if one.refuted is not None]
    return min((one.proved for one in margins), default=None), min(refuted, default=None)


def save(found: RobustDesign, folder: Path, *, recheck: bool = True) -> tuple[RobustDesign, tuple[Path, ...]]:
    """Write scene, answer, and what `limitsets.recheck` checks; return the design without what it denies, the files."""
    folder.mkdir(parents=True, exist_ok=True)
    scene, answer = folder / f"{found.scene.name}.toml", folder / "design.json"
    dump(found.scene, scene)
    margins = [settled(one, folder, recheck=recheck) for one in found.margins]
    left = replace(found, margins=tuple(one for one, _ in margins))
    answer.write_text(as_json(left.to_json()), encoding="utf-8", newline="\n")
    return left, (scene, answer, *(path for _, paths in margins for path in paths))
