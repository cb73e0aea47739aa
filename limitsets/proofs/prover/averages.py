"""Averages of functions along almost every orbit: the answer, and how it is found and confirmed.

docs/certificates.md, "Averages", and limitsets/checker/orbit_average.py, which has the theorem: numbers u and w by cell
that satisfy two inequalities on every cell prove the bound c.  `average_search` finds them in floats; what it finds is
proved once the checker, which shares no code with this, has confirmed it.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base import Column, Table
from limitsets.base.arrays import Arrays, Mask
from limitsets.proofs.prover.average_search import search_component
from limitsets.proofs.prover.average_steps import Branch
from limitsets.proofs.prover.certificate import DeniedError, Saved
from limitsets.proofs.prover.observables import Asked
from limitsets.systems.cells import Grid

# By how much s and D are larger than floats give, and what remains between the bounds: the checker's are wider by less,
# if not at the first time.
WIDER = ((1.02, 0.02), (1.2, 0.2), (2.0, 2.0))


# ---------------------------------------------------------------- the answer


@dataclass(frozen=True, eq=False)
class Average:
    """Averages of functions along orbits, each between two numbers on each attracting component.

    Attributes
    ----------
    asked : Asked
        The functions.
    section : dict
        The claim as a certificate has it: `components`, `functions` (each `of`, `lower`, `upper`), `quotients`.
    arrays : dict of str to ndarray
        ``average.upper``, ``average.lower`` (u of both ends), ``average.weight`` (w), ``average.runs``.
    """

    asked: Asked
    section: dict[str, Any]
    arrays: Arrays

    @property
    def numbers(self) -> dict[str, dict[int, tuple[float, float]]]:
        """By name and component the least and the largest number that the average of almost every start can tend to."""
        components = self.section["components"]
        named = {}
        for each, one in zip(self.asked.functions, self.section["functions"], strict=True):
            ends = np.array([[*map(float.fromhex, one[key])] for key in ("lower", "upper")])
            if {"share", "steps"} & set(each.section):  # these lie between 0 and 1 by themselves
                ends = np.clip(ends, 0.0, 1.0)
            named[each.name] = dict(zip(components, zip(*ends.tolist(), strict=True), strict=True))
        of = list(named.values())
        quotients = {
            name: {k: _quotient(of[i][k], of[j][k]) for k in components} for name, i, j in self._quotients()
        }
        return named | quotients

    def _quotients(self) -> list[tuple[str, int, int]]:
        """Give the quotients whose divisor is proved to be above 0."""
        kept = {tuple(pair) for pair in self.section["quotients"]}
        return [(name, i, j) for name, i, j in self.asked.quotients if (i, j) in kept]

    @property
    def bounds(self) -> dict[int, tuple[float, float]]:
        """Those of the first function, by component."""
        return next(iter(self.numbers.values()))

    @property
    def lo(self) -> float:
        """The least number that the average of the first function can tend to, on whichever component."""
        return min(lo for lo, _ in self.bounds.values())

    @property
    def hi(self) -> float:
        """The largest."""
        return max(hi for _, hi in self.bounds.values())

    def table(self) -> Table:
        """Show all numbers, rounded outward to the digits that are known; the component where there are several."""
        rows = []
        for row in rows_of(self) or ():
            component = (row["component"],) if len(self.bounds) > 1 else ()
            ends = outward(row["lo"], row["hi"])
            rows.append((row["name"].replace("_", " "), *component, *ends, row["hi"] - row["lo"]))
        numbers = (Column("lo", show=".12g"), Column("hi", show=".12g"), Column("width", show=".2g"))
        heads = ("average", *(("component",) if len(self.bounds) > 1 else ()), *numbers)
        said = "proved: from almost every start (all but length 0) the average over ever more steps tends to a number"
        return Table(heads, rows, "Averages along orbits", f"{said} between lo and hi")


def rows_of(average: Average | None) -> list[dict[str, Any]] | None:
    """Give all numbers as plain rows: name, component, lo, hi; None where nothing is proved."""
    if average is None:
        return None
    return [
        {"name": name, "component": component, "lo": lo, "hi": hi}
        for name, by_component in average.numbers.items()
        for component, (lo, hi) in by_component.items()
    ]


def outward(lo: float, hi: float) -> tuple[float, float]:
    """Round two ends outward to the digits that are known."""
    last = Decimal(1).scaleb(math.floor(math.log10(hi - lo)) - 1) if hi > lo else Decimal("1e-15")
    return float(Decimal(lo).quantize(last, ROUND_FLOOR)), float(Decimal(hi).quantize(last, ROUND_CEILING))


def _quotient(above: tuple[float, float], below: tuple[float, float]) -> tuple[float, float]:
    """Bound a quotient of two numbers between bounds, of which the second is above 0."""
    ends = [one / other for one in above for other in below]
    return max(math.nextafter(min(ends), -math.inf), 0.0), math.nextafter(max(ends), math.inf)


# ---------------------------------------------------------------- how it is found


BranchesOf = Callable[[Mask, Mask, float], Iterable[Branch]]
"""Gives the branches of a component from its cells, those where the branch is open, and the factor on D."""

UNSOLVED = (
    "{reason}. An average is proved where steps stretch: no cycle that attracts or is neutral, no slope 0, no change of"
    " branch that comes back to its own side too soon; of a map whose steps scatter (noise=) none of this is asked"
)


def _found(
    grid: Grid,
    component: NDArray[Any],
    undecided: Mask,
    branches_of: BranchesOf,
    asked: Asked,
    room: tuple[float, float],
) -> Average | str:
    """Find the numbers of all components, with bounds that are wider by a share; or say what is missing."""
    (wider, share), count = room, len(asked.functions)
    arrays = np.zeros((3, grid.n_cells, count))
    runs = list[tuple[int, int]]()
    ends: list[tuple[list[str], list[str]]] = [([], []) for _ in asked.functions]
    positive = np.ones(count, dtype=bool)
    numbers = range(int(component.max()) + 1)
    for number in numbers:
        own, open_cells = component == number, undecided.copy()
        beside, numbered = search_component(
            grid, own, open_cells, list(branches_of(own, open_cells, wider)), wider
        )
        if isinstance(numbered, str):
            return numbered if len(numbers) == 1 else f"component {number}: {numbered}"
        runs += list(zip(beside[::2], beside[1::2], strict=True))
        for k, (upper, lower, weight, low, high, _) in enumerate(numbered):
            arrays[0, own, k], arrays[1, own, k], arrays[2, own, k] = upper, lower, weight
            size = max(abs(low), abs(high), 1.0) + float(np.abs([upper, lower]).max())
            wide = share * (high - low) + 2.0**-42 * size
            ends[k][0].append((low - wide).hex())
            ends[k][1].append((high + wide).hex())
            positive[k] &= low - wide > 0.0
    listed = [
        {"of": each.section, "lower": lower, "upper": upper}
        for each, (lower, upper) in zip(asked.functions, ends, strict=True)
    ]
    quotients = [[i, j] for _, i, j in asked.quotients if positive[j]]
    section = {"components": [*numbers], "functions": listed, "quotients": quotients}
    columns = {
        f"average.{word}": np.ascontiguousarray(array if count > 1 else array[:, 0])
        for word, array in zip(("upper", "lower", "weight"), arrays, strict=True)
    }
    return Average(asked, section, columns | {"average.runs": np.array(runs, np.int32).reshape(len(runs), 2)})


def confirmed(
    grid: Grid,
    component: NDArray[Any],
    undecided: Mask,
    branches_of: BranchesOf,
    asked: Asked,
    answer: Callable[[Average], Saved],
) -> Average | str:
    """Find averages that the checker confirms of an answer that holds them; or say what is missing."""
    reason = ""
    for room in WIDER:
        average = _found(grid, component, undecided, branches_of, asked, room)
        if isinstance(average, str):
            return UNSOLVED.format(reason=average)
        with tempfile.TemporaryDirectory() as folder:
            try:
                answer(average).save(Path(folder) / "average.proof.zip")
            except DeniedError as error:
                reason = error.claims.get("average", "")
            else:
                return average
    return f"the checker does not confirm it: {reason}"
