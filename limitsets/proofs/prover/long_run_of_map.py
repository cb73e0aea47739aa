"""Averages of a map of a line whose steps scatter: between which numbers they lie in the end, from every start.

The checker proves one inequality for each number (`limitsets/checker/map_long_run.py`); how its function is found does
not matter: u gains what one step counts, less a constant, until it stays (relative value iteration; Puterman, "Markov
Decision Processes", 1994, section 8.5).
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from limitsets.base import AnswerError, Column, Progress, Table, as_table, picked, silent
from limitsets.base.arrays import Array, Arrays, Ints, Mask
from limitsets.proofs.prover.averages import outward
from limitsets.proofs.prover.averages_of_map import asked_of_map, cut_at_changes
from limitsets.proofs.prover.certificate import Saved
from limitsets.proofs.prover.certificate_of_map import Part, write_map
from limitsets.proofs.prover.noise_of_map import (
    LEAST,
    Bounds,
    as_checked,
    nodes_for,
    noise_in_words,
    noise_of,
    require_noise,
)
from limitsets.proofs.prover.proof import Claim
from limitsets.systems.cells import Grid
from limitsets.systems.maps import kind_of

# Steps at most, and by how much the gain of a step may still differ between nodes.
MOST_STEPS, STILL = 3000, 1e-6
# They end too where so many steps bring the bound nearer by less than this share of that difference.
PATIENCE, SOON = 100, 1e-3
# A step goes so far towards what it gains, so that nothing swings.
DAMPED = 0.8
WITHOUT = "leave it out for averages without noise"
# A certificate claims bounds that are wider by this, for the roundings of another machine's sums.
ALLOWANCE = 1e-9


@dataclass(frozen=True, eq=False)
class LongRunOfMap(Saved):
    """Proved bounds of averages along orbits whose steps scatter, from every start in some places, almost surely.

    Attributes
    ----------
    map, upper : NamedTuple
        The corners of the parameters; the bounds hold for every fixed value between.
    grid : Grid
        The cells.
    noise : float or mapping of str to float
        Steps land evenly within this distance of the image, independent of each other; or by name what deviates evenly
        at every step and by how much: "landing", and a parameter.
    starts : tuple of (int, float, float)
        Side, from x, to x: from these no step leads out.
    numbers : dict of str to (float, float)
        By name between which two numbers the average lies in the end.
    section, arrays : dict
        The claim `long-run` as a certificate has it.
    seconds : float
        Time it took.
    """

    map: Any
    upper: Any
    grid: Grid
    noise: Bounds
    starts: tuple[tuple[int, float, float], ...]
    numbers: dict[str, tuple[float, float]]
    section: dict[str, Any]
    arrays: Arrays
    seconds: float

    @property
    def claims(self) -> tuple[Claim, ...]:
        """The one claim, which is proved."""
        return (Claim("long-run", "proved", "", self.section),)

    @property
    def average(self) -> LongRunOfMap:
        """The answer itself: it is asked for as averages without noise are."""
        return self

    @property
    def lo(self) -> float:
        """The least number in which the average of the first function can end."""
        return next(iter(self.numbers.values()))[0]

    @property
    def hi(self) -> float:
        """The largest."""
        return next(iter(self.numbers.values()))[1]

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [
            (name.replace("_", " "), *outward(lo, hi), hi - lo) for name, (lo, hi) in self.numbers.items()
        ]
        heads = ("average", Column("lo", show=".12g"), Column("hi", show=".12g"), Column("width", show=".2g"))
        said = (
            f"proved: from every start in {in_words(self.starts)}, almost surely, averages over ever more steps end "
            f"between lo and hi, where {noise_in_words(self.noise)}"
        )
        return (Table(heads, rows, "Averages along orbits with noise", said),)

    def __str__(self) -> str:
        return self.table().text()

    def to_json(self) -> list[dict[str, Any]]:
        """Give the claim as plain tables for JSON, a list of one, as other proofs of a map do."""
        rows = [
            {"name": name, "component": None, "lo": lo, "hi": hi} for name, (lo, hi) in self.numbers.items()
        ]
        one = as_table(
            **picked(self.claims[0], "claim", "verdict"),
            of=", ".join(kind_of(self.map).formulas),
            map=type(self.map).__name__,
            parameters=[end._asdict() for end in (self.map, self.upper)],
            cells=self.grid.n_cells,
            noise=self.noise,
            starts=self.starts,
            section=self.section,
            averages=rows,
            timings={"certify": self.seconds},
        )
        return [one]

    def _write(self, path: str | Path, **how: Any) -> None:
        part = Part((self.map, self.upper), {"long-run": self.section}, self.arrays)
        write_map(path, self.grid.domain, [part], goal=None, **how)


def in_words(starts: Sequence[tuple[int, float, float]]) -> str:
    """Name places; the side where there are several."""
    several = len({side for side, _, _ in starts}) > 1
    return ", ".join(
        f"{lo:.9g} to {hi:.9g}" + (f" on side {side}" if several else "") for side, lo, hi in starts
    )


def long_run_of_map(
    lower: Any, upper: Any, grid: Grid, of: Any, noise: Bounds, progress: Progress | None
) -> LongRunOfMap:
    """Prove between which numbers averages lie in the end where each step lands evenly within `noise` of the image.

    Of a mapping "landing" is that distance, and another key a parameter that deviates so far from its value.

    Raises
    ------
    AnswerError
        Noise that is not above 0, or of two parameters, functions without a bound, or cells that steps leave.
    """
    begun, tell = time.perf_counter(), progress or silent
    own = noise_of(lower, noise)
    require_noise(lower, upper, grid, own.landing, WITHOUT, LEAST if own.varied is None else 0.0)
    import flint

    from limitsets.checker.balls import PRECISION, UnprovedError
    from limitsets.checker.file import BadFileError
    from limitsets.checker.long_run import END_SIGNS
    from limitsets.checker.map_long_run import ENDS, LongRunOfMap as Claimed, gains_of
    from limitsets.checker.observable import Allowed, read_function

    asked = asked_of_map(of, lower, grid)
    fine = cut_at_changes(lower, upper, grid, asked.jumps, turns=True)
    listed: list[dict[str, Any]] = [
        {"of": one.section} | {end: [(0.0).hex()] for end in ENDS} for one in asked.functions
    ]
    with flint.ctx.workprec(PRECISION):
        the_map = as_checked(lower, upper, grid)
        shape, unknown = the_map.shape, [np.zeros(0)] * 3
        allowed = Allowed(shape.sides, shape.branches, shape.names)
        functions = [read_function(one, [0], allowed, "the function", unknown) for one in listed]
        tell("cells", 0, 1)
        edges = nodes_for(the_map, fine, asked.jumps)
        try:
            chain, kept, gains = gains_of(the_map, Claimed(own.checked([], edges), functions))
        except (BadFileError, UnprovedError) as error:
            allow = "so small that steps stay on some cells, where what is averaged has a bound"
            remedy = f"widen the grid, lower the noise, or let landings scatter too: {error}"
            raise AnswerError("the noise", noise, allow, remedy) from None
        mesh, columns = chain.mesh, np.zeros((len(ENDS), len(chain.mesh.place), len(listed)))
        for k, (sign, word) in itertools.product(range(len(listed)), enumerate(ENDS)):
            tell(asked.functions[k].name, 2 * k + sign, 2 * len(listed))
            bound, columns[sign, :, k] = settled(gains[k][sign].bound, mesh.place, mesh.first)
            listed[k][word] = [(END_SIGNS[sign] * (bound + ALLOWANCE)).hex()]
    written = [each[:-1] if grid.domain.closes else each for each in edges]
    arrays = {f"nodes.{side}": each for side, each in enumerate(written)} | {
        f"long-run.{end}": column if len(listed) > 1 else column[:, 0]
        for end, column in zip(ENDS, columns, strict=True)
    }
    starts = stretches(kept, mesh.place, mesh.first)
    section = own.section() | {
        "starts": [{"side": side, "box": [[lo.hex(), hi.hex()]]} for side, lo, hi in starts],
        "functions": listed,
    }
    numbers = {}
    for one, each in zip(asked.functions, listed, strict=True):
        lo, hi = (float.fromhex(each[end][0]) for end in ENDS)
        shares = {"share", "steps"} & set(one.section)  # these lie between 0 and 1 by themselves
        numbers[one.name] = (max(lo, 0.0), min(hi, 1.0)) if shares else (lo, hi)
    return LongRunOfMap(
        lower, upper, fine, own.given, tuple(starts), numbers=numbers, section=section,
        arrays=arrays, seconds=time.perf_counter() - begun,
    )  # fmt: skip


def stretches(kept: Mask, place: Array, first: Ints) -> list[tuple[int, float, float]]:
    """List the stretches of cells, given by their left nodes: side, from x, to x."""
    places = []
    for side, (begin, end) in enumerate(itertools.pairwise(first.tolist())):
        borders = begin + np.flatnonzero(np.diff(kept[begin:end].astype(np.int8), prepend=0, append=0))
        places += [(side, lo, hi) for lo, hi in place[borders].reshape(-1, 2).tolist()]
    return places


def settled(gain: Callable[[Array], tuple[Ints, Array]], place: Array, first: Ints) -> tuple[float, Array]:
    """Find a function that gains about as much everywhere; with the most that it gains.

    Parameters
    ----------
    gain : callable
        From a function at all nodes: numbers of nodes, and at these the mean after a step, with what is counted.
    place, first : ndarray
        Places of the nodes, and the number of the first of each side.
    """
    u = np.zeros(place.size)
    nodes, gained = gain(u)
    own = np.searchsorted(first, np.arange(place.size), side="right")
    # beyond the cells u goes on as at the nearest of their nodes; on sides without cells it is 0
    near = np.arange(place.size)
    for number in np.unique(own[nodes]):
        mine, some = np.flatnonzero(own == number), nodes[own[nodes] == number]
        right = np.clip(np.searchsorted(place[some], place[mine]), 1, max(some.size - 1, 1))
        left = place[mine] - place[some][right - 1] < place[some][right % some.size] - place[mine]
        near[mine] = some[np.where(left, right - 1, right % some.size)]
    best, every = (math.inf, u), list[float]()
    for _ in range(MOST_STEPS):
        more = gained - u[nodes]
        lowest, highest = float(more.min()), float(more.max())
        best = min(best, (highest, u), key=lambda each: each[0])
        every.append(best[0])
        before = every[-PATIENCE] if len(every) > PATIENCE else math.inf
        if highest - lowest < STILL or before - best[0] < SOON * (highest - lowest):
            break
        u = u.copy()
        u[nodes] += DAMPED * (more - 0.5 * (lowest + highest))
        u = u[near]
        nodes, gained = gain(u)
    return best
