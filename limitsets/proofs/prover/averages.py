"""Averages of functions along almost every orbit: what is averaged, the numbers that prove it, and the answer.

docs/certificates.md, "Averages", and limitsets/checker/orbit_average.py, which has the theorem: numbers u and w by cell
that satisfy two inequalities on every cell prove the bound c.  `average_search` finds them in floats; what it finds is
proved once the checker, which shares no code with this, has confirmed it.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError, Column, Table, shown
from limitsets.base.arrays import Array, Arrays, Mask
from limitsets.proofs.prover.average_search import Branch, Values, search_component
from limitsets.proofs.prover.certificate import DeniedError, Saved
from limitsets.proofs.prover.certificate_of_map import hexed
from limitsets.proofs.prover.programs import evaluate
from limitsets.proofs.prover.recording import names_of, recorded
from limitsets.systems.cells import Grid

# By how much s and D are larger than floats give, and what remains between the bounds: the checker's are wider by less,
# if not at the first time.
WIDER = ((1.02, 0.02), (1.2, 0.2), (2.0, 2.0))
JOG, FLIP = 0, 1
OUTWARD = (("lo", ROUND_FLOOR), ("hi", ROUND_CEILING))  # how numbers are rounded that are shown


# ---------------------------------------------------------------- what is averaged


class Observable(NamedTuple):
    """A function that is averaged: a name, how a certificate names it, its values, where it jumps, by side."""

    name: str
    section: dict[str, Any]
    values: Values
    jumps: Sequence[tuple[int, float]] = ()


@dataclass(frozen=True)
class Asked:
    """The functions that are averaged, and quotients of two of them: a name, and their numbers."""

    functions: tuple[Observable, ...]
    quotients: tuple[tuple[str, int, int], ...] = ()

    @property
    def jumps(self) -> list[tuple[int, float]]:
        """Where functions jump, by side."""
        return [jump for each in self.functions for jump in each.jumps]


@np.errstate(divide="ignore")  # a slope of 0, where nothing is proved
def _logarithm(_: Array, slope: Array, __: int, ___: int) -> Array:
    return np.asarray(np.log(np.abs(slope)))


def _steps(name: str, steps: Sequence[tuple[int, int]]) -> Observable:
    """Count steps from some sides on some branches."""
    listed = {"steps": [list(pair) for pair in steps]}
    return Observable(name, listed, lambda x, _, *key: np.full(x.size, 1.0 if key in steps else 0.0))


def _formula(of: Callable[[Any], Any], params: Any) -> Observable:
    program = recorded(lambda _, x, __: of(x), params, 1, 0)
    numbers = dict(names_of(params))
    formula = {key: program[key] for key in ("ops", "out")}
    name = getattr(of, "__name__", "function")
    return Observable(
        "function" if name == "<lambda>" else name,
        {"formula": formula},
        lambda x, *_: np.asarray(evaluate(program, x[:, None], numbers)[:, 0]),
    )


def _share(of: Any) -> Observable | None:
    """Read boxes whose share of time is asked for; None if these are none."""
    try:
        boxes = {0: of} if not isinstance(of, Mapping) else of
        spans = [(int(side), float(lo), float(hi)) for side, listed in boxes.items() for lo, hi in listed]
    except (TypeError, ValueError):
        return None
    if not spans or not all(lo < hi for _, lo, hi in spans):
        return None
    listed = [{"side": side, "box": hexed(np.array([[lo, hi]]))} for side, lo, hi in spans]

    def share(x: Array, _: Array, side: int, __: int) -> Array:
        inside = [(lo <= x) & (x <= hi) for s, lo, hi in spans if s == side]
        return np.asarray(np.any([np.zeros(x.size, dtype=bool), *inside], axis=0), dtype=np.float64)

    ends = [(side, end) for side, *ends in spans for end in ends]
    return Observable("share", {"share": listed}, share, ends)


def _is_pairs(of: Sequence[Any]) -> bool:
    """Whether a list is one of ranges, and not of functions."""
    return all(
        isinstance(one, list | tuple) and not any(isinstance(end, list | tuple) for end in one) for one in of
    )


Quotient = tuple[str, int, int]
"""A name, and the numbers of two functions in a list of some."""


def _flips(sides: Sequence[int]) -> tuple[list[Observable], list[Quotient]]:
    return [_steps("flips_per_throw", [(side, FLIP) for side in sides])], []


def _side_shares(sides: Sequence[int]) -> tuple[list[Observable], list[Quotient]]:
    return [_steps(f"share_of_side_{k}", [(k, JOG), (k, FLIP)]) for k in sides], []


def _jogs_per_visit(sides: Sequence[int]) -> tuple[list[Observable], list[Quotient]]:
    counts = [
        _steps(f"{word}s_on_side_{k}", [(k, branch)])
        for k in sides
        for branch, word in ((JOG, "jog"), (FLIP, "flip"))
    ]
    return counts, [(f"jogs_per_visit_of_side_{k}", 2 * at, 2 * at + 1) for at, k in enumerate(sides)]


OF_THROWS = {"flips_per_throw": _flips, "side_shares": _side_shares, "jogs_per_visit": _jogs_per_visit}
"""What can be asked of a scene alone, by its word."""


def _asked_alone(one: Any, params: Any, sides: Sequence[int]) -> tuple[list[Observable], list[Quotient]]:
    """Read one thing that is asked for."""
    if isinstance(one, str):
        if one == "lyapunov":
            return [Observable("lyapunov", {"lyapunov": True}, _logarithm)], []
        if sides and one in OF_THROWS:
            return OF_THROWS[one](sides)
    elif callable(one):
        return [_formula(one, params)], []
    else:
        share = _share(one)
        if share is not None:
            return [share], []
    words = ", ".join(f'"{word}"' for word in ("lyapunov", *(OF_THROWS if sides else ())))
    allowed = f"{words}, a function of x, or ranges [(lo, hi)] whose share of time is asked for"
    raise AnswerError("the function to average", shown(one), allowed, 'pass "lyapunov"')


def asked_for(of: Any, params: Any, sides: Sequence[int] = ()) -> Asked:
    """Read what is averaged, one function or a list of some; `sides` are those where parts of a scene come to rest.

    Raises
    ------
    AnswerError
        What is none of the functions.
    """
    several = isinstance(of, list | tuple) and not _is_pairs(of)
    functions, quotients = list[Observable](), list[Quotient]()
    for one in of if several else [of]:
        more, between = _asked_alone(one, params, sides)
        quotients += [(name, i + len(functions), j + len(functions)) for name, i, j in between]
        functions += more
    names = [each.name for each in functions]
    alike = [names[:k].count(name) for k, name in enumerate(names)]
    named = [
        each._replace(name=f"{each.name}_{count + 1}") if count else each
        for each, count in zip(functions, alike, strict=True)
    ]
    return Asked(tuple(named), tuple(quotients))


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
        """Show all numbers."""
        rows = [
            (
                row["name"].replace("_", " "),
                row["component"],
                *(float(Context(12, way).create_decimal(row[end])) for end, way in OUTWARD),
                row["hi"] - row["lo"],
            )
            for row in rows_of(self) or ()
        ]
        ends = (Column("lo", show=".12g"), Column("hi", show=".12g"), Column("width", show=".2g"))
        said = "proved: of almost every start in the component, and of every invariant density"
        return Table(("average", "component", *ends), rows, "Averages along orbits", said)


def rows_of(average: Average | None) -> list[dict[str, Any]] | None:
    """Give all numbers as plain rows: name, component, lo, hi; None where nothing is proved."""
    if average is None:
        return None
    return [
        {"name": name, "component": component, "lo": lo, "hi": hi}
        for name, by_component in average.numbers.items()
        for component, (lo, hi) in by_component.items()
    ]


def _quotient(above: tuple[float, float], below: tuple[float, float]) -> tuple[float, float]:
    """Bound a quotient of two numbers between bounds, of which the second is above 0."""
    ends = [one / other for one in above for other in below]
    return max(math.nextafter(min(ends), -math.inf), 0.0), math.nextafter(max(ends), math.inf)


# ---------------------------------------------------------------- how it is found


BranchesOf = Callable[[Mask, Mask, float], Iterable[Branch]]
"""Gives the branches of a component from its cells, those where the branch is open, and the factor on D."""

UNSOLVED = (
    "{reason}: an average is proved where steps stretch: no cycle that attracts or is neutral, no slope 0, no change of"
    " branch that comes back to its own side too soon; finer cells may help"
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
