"""One line of a tolerance sheet as plain data, and checkpoints: each goes to a file that a later run reads again.

A `Margin` holds the cells of its proof.  A line of the sheet is thousands of times smaller: the bracket, the orbit at
its upper end, and the names of the files that prove both.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from limitsets.base.errors import AnswerError
from limitsets.base.files import as_json, code_digest, picked, replaced
from limitsets.feeder.goals import Goal, Predicate
from limitsets.feeder.scene import Scene
from limitsets.feeder.scene.units import exact_factor
from limitsets.parameters.margins.deviations import nominal_of
from limitsets.parameters.margins.margin_result import Margin, goal_table, settled

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


# ----------------------------------------------------------------
# Checkpoints: each margin goes to the sheet's JSON as soon as it is found, and a later run reads it again.
#
# An interrupted run loses only the current margin.  A digest ensures that an entry read again belongs to the same
# scene, goals and width, and that its files exist.


RECORD, CERTIFICATES = "robustness.json", "certificates"

# Tables of a scene that its throws depend on.
THROWN = ("part", "arm", "throw", "gravity", "model", "effects", "world")


def digest_of(*words: Any) -> str:
    """Make a word of all that a margin depends on, the code of the package among it."""
    text = json.dumps([*words, code_digest()], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


class Checkpoint:
    """The entries of a sheet in a folder; without a folder nothing is kept.

    Parameters
    ----------
    folder : Path or None
        Of the report.
    scene : Scene
        The scene.
    goals : sequence of Goal
        What is asked.
    tolerance : mapping of str to str
        Of the joint margin.
    width : float
        Of the brackets.
    seconds : float
        For the proofs of the joint margin and of the curve.
    recheck : bool
        Whether certificates are checked before they get their names.
    """

    def __init__(
        self,
        folder: Path | None,
        scene: Scene,
        goals: tuple[Goal, ...],
        tolerance: Mapping[str, str],
        width: float,
        *,
        seconds: float,
        recheck: bool = True,
    ) -> None:
        self.folder, self.scene, self.again, self.recheck = folder, scene, 0, recheck
        tables = {word: scene.text[word] for word in THROWN if word in scene.text}
        single = digest_of(tables, [goal_table(goal, scene.unit) for goal in goals], width, recheck)
        self.digests = {"single": single, "joint": digest_of(single, dict(tolerance), seconds)}
        # code of the caller's has no digest
        known = folder is not None and not any(isinstance(goal, Predicate) for goal in goals)
        record = self._record() if known else {}
        self.good = {
            word for word, text in self.digests.items() if record.get("digests", {}).get(word) == text
        }
        self.entries = self._entries(record)
        self.curve: dict[str, Any] | None = record.get("curve") if "joint" in self.good else None

    def _record(self) -> dict[str, Any]:
        """Read what an earlier run left; a file that is no such record counts as none."""
        assert self.folder is not None
        try:
            record = json.loads((self.folder / RECORD).read_text(encoding="utf-8"))
            fields = {"digests": dict(record["digests"]), "margins": list(record["margins"])}
            return fields | {"curve": record["curve"]}
        except (OSError, ValueError, KeyError, TypeError):
            return {}

    def _entries(self, record: Mapping[str, Any]) -> dict[str, Entry]:
        """Read the entries that are still good."""
        try:
            entries = [Entry.read(row) for row in record.get("margins", [])]
        except (KeyError, TypeError):
            return {}
        return {
            entry.key: entry
            for entry in entries
            if ("joint" if entry.quantity == "joint" else "single") in self.good and self._complete(entry)
        }

    def _complete(self, entry: Entry) -> bool:
        assert self.folder is not None
        files = [*entry.certificates, *([] if entry.against is None else [entry.against])]
        return all((self.folder / name).is_file() for name in files)

    def find(self, quantity: str, reading: str, unit: str) -> Entry | None:
        """Return an entry of an earlier run, if it is in the unit asked for."""
        entry = self.entries.get(f"{quantity} {reading}")
        if entry is None or entry.unit != unit:
            return None
        self.again += 1
        return entry

    def add(self, margin: Margin) -> Entry:
        """Write a margin's files, and it into the record."""
        return self.keep(written(margin, self.folder, self.recheck))

    def keep(self, entry: Entry) -> Entry:
        """Write an entry, whose files are there, into the record."""
        if self.folder is not None:
            self.entries[entry.key] = entry
            self._write()
        return entry

    def add_curve(self, table: dict[str, Any]) -> None:
        """Write margins against X into the record."""
        self.curve = table
        if self.folder is not None:
            self._write()

    def _write(self) -> None:
        assert self.folder is not None
        record: dict[str, Any] = {
            "complete": False,
            "digests": self.digests,
            "scene": self.scene.as_dict(),
            "margins": list(self.entries.values()),
            "curve": self.curve,
        }
        with replaced(self.folder) as draft:
            (draft / RECORD).write_text(as_json(record), encoding="utf-8", newline="\n")


def written(margin: Margin, folder: Path | None, recheck: bool) -> Entry:
    """Write a margin's proof and counterexample into a report's folder; the entry names what the checker confirms."""
    if folder is None:
        return Entry.of(margin)
    try:
        left, files = settled(margin, folder / CERTIFICATES, recheck=recheck)
    except AnswerError:  # effects are on, or a goal is code: nothing rechecks it, the margin stands
        return Entry.of(margin, [])
    return Entry.of(left, [f"{CERTIFICATES}/{path.name}" for path in files])
