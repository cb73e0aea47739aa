"""Checkpoints: each margin goes to the sheet's JSON as soon as it is found, and a later run reads it again.

An interrupted run loses only the current margin.  A digest ensures that an entry read again belongs to the same scene,
goals and width, and that its files exist.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from limitsets.errors import AnswerError
from limitsets.files import as_json, code_digest, replaced
from limitsets.goals import Goal, Predicate
from limitsets.robust.margins.margin_result import Margin, goal_table, settled
from limitsets.robust.sheet.entries import Entry
from limitsets.scene import Scene

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
            found = {"digests": dict(record["digests"]), "margins": list(record["margins"])}
            return found | {"curve": record["curve"]}
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
        found = self.entries.get(f"{quantity} {reading}")
        if found is None or found.unit != unit:
            return None
        self.again += 1
        return found

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
