"""Ours and its rivals in turn, medians, and the rows of the table at the end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Row", "Turns", "as_dicts", "as_text", "limit", "take_turns", "versus"]

Seconds = NDArray[np.float64]


@dataclass(frozen=True)
class Row:
    """One line of the table: what took how long, beside whom, and what was asked for."""

    what: str
    ours: float
    unit: str
    rival: str = ""
    theirs: float | None = None
    ratio: float | None = None
    reads: str = ""  # which way round the ratio is
    low: float | None = None  # quartiles of the ratio over the pairs; without a rival, of ours
    high: float | None = None
    asked: str = ""
    holds: bool | None = None  # None: for information


@dataclass(frozen=True)
class Turns:
    """Seconds of each round, and what the last one returned."""

    ours: Seconds
    rivals: dict[str, Seconds]
    answer: Any
    answers: dict[str, Any]


def take_turns(
    benchmark: Any, ours: Callable[[], Any], rivals: dict[str, Callable[[], Any]], rounds: int
) -> Turns:
    """Rivals, ours, rivals, ours, ...: whatever else the machine does hits both.

    pytest-benchmark times ours, so that its own reports and comparisons work; the rivals run in its set-up.
    One round before the first is not counted.
    """
    seconds: dict[str, list[float]] = {name: [] for name in rivals}
    answers: dict[str, Any] = {}

    def rivals_turn() -> None:
        for name, run in rivals.items():
            begin = perf_counter()
            answers[name] = run()
            seconds[name].append(perf_counter() - begin)

    answer = benchmark.pedantic(ours, setup=rivals_turn, rounds=rounds, warmup_rounds=1)
    mine = np.array(benchmark.stats.stats.data)
    theirs = {name: np.array(values[-rounds:]) for name, values in seconds.items()}
    benchmark.extra_info.update({name: float(np.median(values)) for name, values in theirs.items()})
    return Turns(mine, theirs, answer, answers)


def versus(
    what: str,
    turns: Turns,
    rival: str,
    *,
    unit: str = "s",
    per: float = 1.0,
    faster: float | None = None,
    within: float | None = None,
    inform: bool = False,
) -> Row:
    """Compare medians: `faster` asks for rival >= faster x ours, `within` for ours <= within x rival."""
    ours, theirs = turns.ours, turns.rivals[rival]
    mine, other = float(np.median(ours)), float(np.median(theirs))
    if within is not None:
        ratio, pairs, reads, asked = mine / other, ours / theirs, "ours/rival", f"<= {within:g}"
        holds = ratio <= within
    else:
        ratio, pairs, reads = other / mine, theirs / ours, "rival/ours"
        asked, holds = ("", None) if faster is None else (f">= {faster:g}", ratio >= faster)
    low, high = (float(q) for q in np.quantile(pairs, (0.25, 0.75)))
    scale = {"s": 1.0, "ms": 1e3, "ns": 1e9}[unit] / per
    if inform:
        asked, holds = "", None
    return Row(what, mine * scale, unit, rival, other * scale, ratio, reads, low, high, asked, holds)


def limit(what: str, values: Any, unit: str, below: float | None) -> Row:
    """A figure on its own: the median has to be below `below`."""
    several = np.atleast_1d(np.asarray(values, dtype=float))
    middle = float(np.median(several))
    low, high = (float(q) for q in np.quantile(several, (0.25, 0.75)))
    asked, holds = ("", None) if below is None else (f"< {below:g} {unit}", middle < below)
    return Row(what, middle, unit, low=low, high=high, asked=asked, holds=holds)


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3g}" if value < 100 else f"{value:.0f}"


def as_text(rows: list[Row]) -> list[str]:
    """Lay the table out as lines of plain text."""
    lines = [("what", "ours", "rival", "theirs", "ratio", "quartiles", "asked", "holds")]
    for row in rows:
        theirs = "" if row.theirs is None else f"{_number(row.theirs)} {row.unit}"
        ratio = "" if row.ratio is None else f"{row.reads} {_number(row.ratio)}"
        spread = f"{_number(row.low)} - {_number(row.high)}"
        holds = "" if row.holds is None else "yes" if row.holds else "NO"
        ours = f"{_number(row.ours)} {row.unit}"
        lines.append((row.what, ours, row.rival, theirs, ratio, spread, row.asked, holds))
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    rows_of = ([cell.ljust(width) for cell, width in zip(line, widths, strict=True)] for line in lines)
    text = ["  ".join(cells).rstrip() for cells in rows_of]
    return [text[0], "-" * max(map(len, text)), *text[1:]]


def as_dicts(rows: list[Row]) -> list[dict[str, Any]]:
    """The rows as JSON takes them."""
    return [asdict(row) for row in rows]
