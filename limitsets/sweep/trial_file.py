"""Finished trials, kept in a file that is replaced whole: a run that is cut off goes on with what is left."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from limitsets.errors import AnswerError
from limitsets.files import as_json, as_plain, locked, replaced
from limitsets.sweep.driving import Progress, Work, drive
from limitsets.sweep.executors import chosen_pool

Row = dict[str, Any]


class TrialFile:
    """Trials by their numbers, in chunks; without a path they are kept in memory alone.

    Parameters
    ----------
    path : Path or None
        The file, JSON: the question, and the trials.
    question : mapping
        What was asked, as JSON holds it: trials of another question are refused.
    trials, chunk : int
        How many trials are wanted, and how many make a chunk.

    Raises
    ------
    AnswerError
        The file cannot be read, or holds trials of another question.

    Examples
    --------
    >>> kept = TrialFile(None, {}, 5, 2)
    >>> kept.write([(0, {"outcome": "assembled"}), (1, {"outcome": "wrong"})])
    >>> kept.chunks, sorted(kept.done)
    (3, [0])
    """

    def __init__(self, path: Path | None, question: dict[str, Any], trials: int, chunk: int) -> None:
        self.path, self.question, self.trials, self.chunk = path, as_plain(question), trials, chunk
        self.rows: dict[int, Row] = {}
        if path is not None and path.exists():
            self.rows = _read(path, self.question)

    @property
    def chunks(self) -> int:
        """How many chunks there are."""
        return -(-self.trials // self.chunk)

    def numbers(self, chunk: int) -> range:
        """Numbers of the trials of a chunk."""
        return range(chunk * self.chunk, min((chunk + 1) * self.chunk, self.trials))

    @property
    def done(self) -> set[int]:
        """Numbers of the chunks of which every trial is kept."""
        return {k for k in range(self.chunks) if all(number in self.rows for number in self.numbers(k))}

    def write(self, found: list[tuple[int, Row]]) -> None:
        """Keep trials."""
        self.rows |= {number: as_plain(row) for number, row in found}
        if self.path is None:
            return
        rows = {str(number): self.rows[number] for number in sorted(self.rows)}
        with replaced(self.path.parent) as draft:
            text = as_json({"question": self.question, "trials": rows})
            (draft / self.path.name).write_text(text, encoding="utf-8")

    def __iter__(self) -> Iterator[Row]:
        """Give the trials wanted, in the order of their numbers."""
        return (self.rows[number] for number in range(self.trials))


def complete(
    kept: TrialFile,
    made: Callable[..., list[tuple[int, Row]]],
    given: tuple[Any, ...],
    name: str,
    points: str,
    *,
    executor: Executor | None = None,
    cluster: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Make the trials that are not kept yet: here, or where one of the last arguments says.

    Parameters
    ----------
    kept : TrialFile
        Where they are kept.
    made : callable
        Importable by workers: called with `given` and the number of a chunk, it makes the chunk's trials.
    given : tuple
        What it is given before the number.
    name, points : str
        What is done, and what is counted, in words.
    executor, cluster, workers, progress
        As in `limitsets.assemble`.
    """
    if len(kept.done) == kept.chunks:
        return
    work = Work(
        kept.chunks,
        made,
        given,
        lambda chunk: len(kept.numbers(chunk)),
        lambda chunk: f"{points} {kept.numbers(chunk).start} to {kept.numbers(chunk).stop - 1}",
        f"the {points}",
        name,
        points,
    )
    here = executor is None and cluster is None and workers is None
    alone = nullcontext() if kept.path is None else locked(kept.path)
    with alone, chosen_pool(1 if here else kept.chunks, executor, cluster, workers) as pool:
        drive(work, kept, pool, progress)


def _read(path: Path, question: dict[str, Any]) -> dict[int, Row]:
    remedy = "name another file, or delete this one"
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
        asked, rows = held["question"], {int(number): row for number, row in held["trials"].items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        allowed = "a file of trials that this call wrote"
        raise AnswerError("the file of trials", str(path), allowed, remedy) from None
    if asked != question:
        other = next(name for name in (*question, *asked) if asked.get(name) != question.get(name))
        allowed = f"trials of the same scenes, noise, seed and contact; {other} differs"
        raise AnswerError("the file of trials", str(path), allowed, remedy)
    return rows
