"""What continuation gives: the attractors at each step, numbered, and the events between."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.files import as_table, picked
from limitsets.sweep.continuation.snapshot import Found
from limitsets.tables import Column, Table, Tabled

if TYPE_CHECKING:
    pass

# Of the bands that a resolution shows.
LEAST = "at least "


@dataclass(frozen=True)
class State:
    """One attractor at one step.

    Attributes
    ----------
    extents : dict of int to list of (lo, hi)
        Its bands per side [length]; points of an attracting cycle have lo = hi.  In two and three dimensions the
        ranges of its cells along the first axis.
    period : int
        Period of the attracting cycle, 0 where there is none (up to period 128).
    decided : bool
        False where the bands are those of an enclosure by cells: gaps narrower than a cell may be missing.  In two
        and three dimensions: where orbits stay outside the attracting cells; it is the cells that they visit.
    """

    extents: dict[int, list[tuple[float, float]]]
    period: int
    decided: bool

    @classmethod
    def of(cls, found: Found) -> State:
        """Give what a snapshot found."""
        return cls(found.extents, found.period, found.decided)

    @property
    def bands(self) -> int:
        """Number of bands on all sides."""
        return sum(len(parts) for parts in self.extents.values())

    def words(self) -> str:
        """Say what kind of attractor it is: ``"period 2"``, ``"3 bands"``, ``"at least 2 bands"`` beyond resolution."""
        if self.period:
            return f"period {self.period}"
        return f"{'' if self.decided else LEAST}{self.bands} band{'' if self.bands == 1 else 's'}"


class Collision(NamedTuple):
    """An end of an attractor on a critical point: F^k(c+-; p) = c'(p), or a point of a cycle on c'.

    Attributes
    ----------
    x, side : float, int
        c': where, and on which side.
    change : str
        What changes at c', from below to above: ``"jog->flip"``; "jump"; "exit" or "end of the domain" where the
        set begins to leave.
    k : int
        Steps from c, or the period of the cycle.
    start : float or None
        c; None for a point of an attracting cycle.
    start_side : int
        Its side; of a cycle that of the point.
    limit : str
        "c-" or "c+": the side from which the limit at c is taken; "cycle" for a point of an attracting cycle.
    itinerary : tuple of str
        The k branches from c on, the first on the limit's own side of c; of a cycle from the point on.
    """

    x: float
    side: int
    change: str
    k: int
    start: float | None
    start_side: int
    limit: str
    itinerary: tuple[str, ...]

    def __str__(self) -> str:
        runs = [(name, len(list(run))) for name, run in groupby(self.itinerary)]
        way = ", ".join(name if count == 1 else f"{name} x {count}" for name, count in runs)
        if self.start is None:
            return f"a point of the cycle {way} meets {self.change} at x = {self.x:.9g} on side {self.side}"
        start = f"{self.limit} = {self.start:.9g} on side {self.start_side}"
        return f"F^{self.k}({start}; {way}) meets {self.change} at x = {self.x:.9g} on side {self.side}"


@dataclass(frozen=True)
class Event:
    """Something that happens to attractors between two places of the path.

    Attributes
    ----------
    kind : str
        "birth", "death", "merge", "split" (of attractors); "bands" (the number of bands, or the period, of one
        changes), "jump" (its extents do, and nothing else that is told here); "border collision", "touch".
    t : (float, float)
        Bracket on the path.
    values : (dict, dict)
        Values of the path at both ends of the bracket.
    before, after : tuple of int
        Numbers of the attractors concerned.
    change : str
        What changes, in words: ``"period 1 -> period 2"``; empty where that is nothing.
    jump : float or None
        Distance (Hausdorff) of the extents at both ends of the bracket [length], infinite where a side is lost or
        gained; None where more than one attractor is concerned.
    collision : Collision or None
        Of a border collision or a touch, and of a birth or death at which an end leaves the domain.
    words : str
        The values, as people read them, a scene's in the units of its text: one number where the bracket has nine
        digits, else both of its ends.
    """

    kind: str
    t: tuple[float, float]
    values: tuple[dict[str, float], dict[str, float]]
    before: tuple[int, ...]
    after: tuple[int, ...]
    change: str
    jump: float | None
    collision: Collision | None
    words: str

    def __str__(self) -> str:
        told = [self.change] if self.change else []
        told += [str(self.collision)] if self.collision else []
        return f"{self.kind} at {self.words}" + (f": {'; '.join(told)}" if told else "")


@dataclass(frozen=True, eq=False)
class Continuation(Tabled):
    """Attractors along a path.

    Attributes
    ----------
    name : str
        Of the scene, or of the class of the map.
    unit : str or None
        The scene's unit of length.
    t : ndarray, shape (n,)
        Steps on the path: those asked for, and those put between.
    values : dict of str to ndarray, shape (n,)
        What the path sets, at each step (a scene's in its units: rad/s, its length).
    attractors : tuple of dict of int to State
        At each step, by number.  A number stays with an attractor as long as it can be followed.
    critical : tuple of dict of int to tuple of float
        At each step the critical points per side; empty in more than one dimension.
    events : tuple of Event
        In their order on the path.
    evaluations : int
        Places at which the attractors were found.
    """

    name: str
    unit: str | None
    t: NDArray[np.float64]
    values: dict[str, NDArray[np.float64]]
    attractors: tuple[dict[int, State], ...]
    critical: tuple[dict[int, tuple[float, ...]], ...]
    events: tuple[Event, ...]
    evaluations: int

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of all attractors."""
        return tuple(sorted({number for states in self.attractors for number in states}))

    def to_json(self) -> dict[str, Any]:
        """Give it as JSON takes it (docs/json.md)."""
        steps = [
            {
                "t": t,
                "values": {name: each[k] for name, each in self.values.items()},
                "attractors": self.attractors[k],
                "critical_points": self.critical[k],
            }
            for k, t in enumerate(self.t.tolist())
        ]
        events = [
            picked(e, "kind", "t", "values", "before", "after", "change", "jump")
            | {"collision": _table(e.collision)}
            for e in self.events
        ]
        return as_table(**picked(self, "name", "unit", "evaluations"), steps=steps, events=events)

    def table(self) -> Table:
        """Give the bands: one row per step, attractor and band."""
        values = (*self.values, "attractor", "period", "decided", "side", "band")
        rows = [
            (
                t,
                *(each[k] for each in self.values.values()),
                number,
                state.period,
                state.decided,
                side,
                band,
                lo,
                hi,
            )
            for k, t in enumerate(self.t.tolist())
            for number, state in self.attractors[k].items()
            for side, parts in state.extents.items()
            for band, (lo, hi) in enumerate(parts)
        ]
        return Table(("t", *values, "lo", "hi"), rows, f"{self.name}: bands", "sampled, not proved")

    def tables(self) -> tuple[Table, ...]:
        """Give the events, and the bands at each step."""
        rows = [(each.kind, each.t, each.change or None, each.jump) for each in self.events]
        columns = ("event", Column("t", show=".10g", ends=True), "change", Column("jump", show=".4g"))
        return Table(columns, rows, f"{self.name}: events", "sampled, not proved"), self.table()


def _table(collision: Collision | None) -> dict[str, Any] | None:
    return None if collision is None else collision._asdict()
