"""The attractors at one point of the path, and what continuation gives: the attractors at each step, numbered.

Candidates are orbits from both sides of every critical point, from all over the domain, and from the attracting cells
of a transition graph.  Orbits that close are cycles.  The others are grown from inside (`growth.py`).  A set that holds
another one is no attractor: its orbits were still on their way.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.base import Column, Table, Tabled, as_table, picked
from limitsets.parameters.continuation.growth import (
    MOST_PERIOD,
    Recorded,
    attracting_cycles,
    grown,
    recorded,
)
from limitsets.parameters.continuation.path import Place
from limitsets.systems.cells import CellSet, Grid, grid
from limitsets.systems.graph import TransitionGraph, transitions
from limitsets.systems.maps import advance, kind_of
from limitsets.systems.maps.critical import Array
from limitsets.systems.sets.closing import Cycle, Ints
from limitsets.systems.sets.end_points import BORDER, End, ends_of, read, same

Intervals = dict[int, list[tuple[float, float]]]

# Steps before an orbit is taken to be where it stays; starts per side beside those at critical points.
TRANSIENT, STARTS, STARTS_PER_SET = 1000, 12, 4
# Orbits from whose last states sets are grown, and the states taken of each.
TRIED, STATES = 3, 8
# States of a band that are sent to another place; images until the ends of a set are critical orbits.
SAMPLED, MOST_IMAGES = 9, 300
# On cells: starts all over a side, their steps; how much finer cells are that confirm, and how many there may be.
SPREAD, RESTED = 256, 3000
FINER, MOST_CELLS = 1.6, 1_000_000


@dataclass(frozen=True, eq=False)
class AttractorAtPlace:
    """One attractor at one place.

    Attributes
    ----------
    extents : dict of int to list of (lo, hi)
        Its intervals per side; points of an attracting cycle have lo = hi.
    ends : tuple of End
        The ends with their critical orbits; none of a cycle.
    cycle : Cycle or None
        The attracting cycle.
    cells : CellSet or None
        In two and three dimensions: its cells.
    decided : bool
        Whether intervals grown from inside have settled; otherwise the set stands for what cells enclose.
    """

    extents: Intervals
    ends: tuple[End, ...]
    cycle: Cycle | None
    cells: CellSet | None
    decided: bool

    @property
    def period(self) -> int:
        """Period of the attracting cycle, 0 for none."""
        return 0 if self.cycle is None else self.cycle.period

    @property
    def bands(self) -> dict[int, int]:
        """Intervals per side."""
        return {side: len(parts) for side, parts in self.extents.items()}

    def distance(self, x: Array, side: Ints) -> Array:
        """Distance of states from the set along their side; infinite where it is not on that side."""
        away = np.full(x.size, np.inf)
        for s, parts in self.extents.items():
            here = np.flatnonzero(side == s)
            ends = np.array(parts)
            beyond = np.maximum(ends[:, :1] - x[here], x[here] - ends[:, 1:])
            away[here] = np.maximum(beyond, 0.0).min(axis=0)
        return away


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The attractors at one place.

    Attributes
    ----------
    place : Place
        Where.
    attractors : tuple of AttractorAtPlace
        The attractors.
    cells : int
        Cells per axis on which they were found.
    """

    place: Place
    attractors: tuple[AttractorAtPlace, ...]
    cells: int

    @property
    def t(self) -> float:
        """Where on the path."""
        return self.place.t


def _cell_sets(graph: TransitionGraph) -> list[CellSet]:
    """Attracting components of the cells."""
    return [CellSet.of(graph.grid, cells) for cells in graph.attracting_sets()]


def _starts(place: Place, sets: Iterable[CellSet]) -> tuple[Array, Ints]:
    xs: list[float] = []
    sides: list[int] = []
    for side, pieces in place.forward.pieces.items():
        lo, hi = place.forward.bounds[side]
        ends = [end.x for piece in pieces for end in (piece.bottom, piece.top) if end.kind != "domain"]
        # Unevenly spaced: evenly spaced starts of a symmetric map share their orbits.
        inner = lo + (hi - lo) * (np.arange(STARTS) + 0.6180339887) / STARTS
        xs += [*ends, *inner.tolist()]
        sides += [side] * (len(ends) + STARTS)
    for cells in sets:
        numbers = cells.numbers()
        chosen = numbers[np.linspace(0, numbers.size - 1, STARTS_PER_SET).astype(np.int64)]
        low, high, owner = cells.grid.corners(chosen)
        xs += (0.5 * (low + high))[:, 0].tolist()
        sides += owner.tolist()
    return np.array(xs), np.array(sides, dtype=np.int64)


def _of_cycle(cycle: Cycle) -> AttractorAtPlace:
    sides = np.unique(cycle.side).tolist()
    extents = {side: [(x, x) for x in sorted(cycle.x[cycle.side == side].tolist())] for side in sides}
    return AttractorAtPlace(extents, (), cycle, None, True)


def _of_intervals(place: Place, extents: Intervals, *, inside: bool) -> AttractorAtPlace | None:
    """Take images of a set until each end comes from a critical orbit or, of an enclosure, until no end moves.

    None where part of it leaves the domain: then it is no attractor, however long its orbits stay.
    """
    union, rested, known = read(extents, place.domain), 0, False
    for _ in range(MOST_IMAGES):
        image, leaves = place.forward.image(union)
        if leaves or not image:
            return None
        rested = rested + 1 if same(union, image, 1e-12, place.extent) else 0
        union = image
        known = all(end.kind != BORDER for parts in union.values() for part in parts for end in part)
        if known if inside else rested >= 2:
            break
    ends = ends_of(kind_of(place.params).branches, union)
    bands = {side: [(lo.x, hi.x) for lo, hi in parts] for side, parts in union.items()}
    return AttractorAtPlace(bands, ends, None, None, inside and known)


def _grown_sets(place: Place, rows: Recorded, sets: list[CellSet]) -> list[AttractorAtPlace]:
    """Find the sets of the orbits that are on no cycle."""
    attractors: list[AttractorAtPlace] = []
    x, side = rows.x[:, -1], rows.side[:, -1]
    left, tried = np.arange(x.size), 0
    while left.size and tried < TRIED * (1 + len(sets)):
        k, tried = int(left[0]), tried + 1
        last = np.arange(rows.x.shape[1])[:: -max(1, rows.x.shape[1] // STATES)]
        extents = grown(place.forward, rows.x[k, last], rows.side[k, last], place.extent)
        if extents is not None:
            new = _of_intervals(place, extents, inside=True)
        else:
            around = next((s for s in sets if s.holds(x[k : k + 1], int(side[k]))[0]), None)
            new = None if around is None else _of_intervals(place, around.extents(), inside=False)
        left = left[1:]
        if new is not None:
            attractors.append(new)
            left = left[new.distance(x[left], side[left]) > 0.0]
    return attractors


def _holds(outer: AttractorAtPlace, inner: AttractorAtPlace, slack: float) -> bool:
    ends = [(x, side) for side, parts in inner.extents.items() for pair in parts for x in pair]
    x, side = np.array([each[0] for each in ends]), np.array([each[1] for each in ends], dtype=np.int64)
    return bool((outer.distance(x, side) <= slack).all())


def _least(attractors: list[AttractorAtPlace], slack: float) -> tuple[AttractorAtPlace, ...]:
    """Keep the sets that contain no other set; of two equal sets keep the first."""
    return tuple(
        each
        for k, each in enumerate(attractors)
        if not any(
            _holds(each, other, slack) and (j < k or not _holds(other, each, slack))
            for j, other in enumerate(attractors)
            if j != k
        )
    )


def snapshot_at(place: Place, cells: int) -> Snapshot:
    """Find the attractors at one place; `cells` per axis."""
    if not place.on_line:
        return _on_cells(place, cells)
    sets = _cell_sets(transitions(place.params, grid(place.domain, cells)))
    x, side = _starts(place, sets)
    x, side, code, _ = advance(place.params, x, side, TRANSIENT)
    rows = recorded(place, x[code >= 0], side[code >= 0], MOST_PERIOD)
    cycles, left = attracting_cycles(place, rows)
    attractors = [_of_cycle(cycle) for cycle in cycles]
    attractors += _grown_sets(place, Recorded(rows.x[left], rows.side[left], rows.code[left]), sets)
    ordered = sorted(
        _least(attractors, 1e-9 * place.extent),
        key=lambda each: min((side, parts[0][0]) for side, parts in each.extents.items()),
    )
    return Snapshot(place, tuple(ordered), cells)


def _on_cells(place: Place, cells: int) -> Snapshot:
    """Find the attracting cells.  If orbits stay elsewhere, use finer cells; on the finest, add the visited cells."""
    cover = grid(place.domain, cells)
    sets = _cell_sets(transitions(place.params, cover))
    snapshot = Snapshot(
        place, tuple(AttractorAtPlace(each.extents(), (), None, each, True) for each in sets), cells
    )
    x, side, label = _rested(snapshot)
    if (label >= 0).all():
        return snapshot
    if (finer := _finer(place, cells)) is not None:
        return _on_cells(place, finer)
    visited = _visited(place, cover, x[label < 0], side[label < 0], sets)
    return replace(
        snapshot,
        attractors=(
            *snapshot.attractors,
            *(AttractorAtPlace(each.extents(), (), None, each, False) for each in visited),
        ),
    )


def _finer(place: Place, cells: int) -> int | None:
    """Give a number of cells whose edges are others; None where they would be too many."""
    finer = round(FINER * cells) | 1
    return finer if place.domain.sides * finer**place.domain.dimension <= MOST_CELLS else None


def _rested(snapshot: Snapshot) -> tuple[Array, Ints, Ints]:
    """Last states of orbits from all over the domain that stay, and the attractor that each is at, else -1."""
    domain = snapshot.place.domain
    starts = grid(domain, max(2, round(SPREAD ** (1.0 / domain.dimension))))
    x = np.concatenate([starts.centres(side) for side in range(domain.sides)])
    side = starts.side_of(np.arange(len(x)))
    x, side, code, _ = advance(snapshot.place.params, x, side, RESTED)
    inside = (code >= 0) & (starts.index(x, side) >= 0)
    x, side = x[inside], side[inside]
    return x, side, _label(snapshot, x, side, 0.0)


def _visited(place: Place, cover: Grid, x: Array, side: Ints, sets: list[CellSet]) -> list[CellSet]:
    """Join the cells of orbits that share one; orbits that reach a cell of `sets` are left out."""
    rows = []
    for _ in range(TRANSIENT):
        x, side, code, _ = advance(place.params, x, side, 1)
        rows.append(np.where(code >= 0, cover.index(x, side), -1))
    merged: list[CellSet] = []
    for orbit in np.stack(rows, axis=1):
        if (orbit < 0).any() or any(each.mask[orbit].any() for each in sets):
            continue
        new = CellSet.of(cover, np.unique(orbit))
        for other in [each for each in merged if (each.mask & new.mask).any()]:
            merged.remove(other)
            new = new | other
        merged.append(new)
    return merged


def confirmed(snapshot: Snapshot) -> Snapshot | None:
    """Find the attractors on which two sizes of cells agree, by the orbits that reach them; None if none agree."""
    place, cells = snapshot.place, _finer(snapshot.place, snapshot.cells)
    if cells is None or not all(each.decided for each in snapshot.attractors):
        return None
    finer = snapshot_at(place, cells)
    x, side, fine = _rested(finer)
    coarse = _label(snapshot, x, side, 0.0)
    pairs = set(zip(coarse.tolist(), fine.tolist(), strict=True))
    one_to_one = len({a for a, _ in pairs}) == len({b for _, b in pairs}) == len(pairs)
    if (
        len(finer.attractors) == len(snapshot.attractors)
        and one_to_one
        and (fine >= 0).all()
        and (coarse >= 0).all()
    ):
        return finer
    return confirmed(finer)


def _sampled(attractor: AttractorAtPlace) -> tuple[Array, Ints]:
    """States of an attractor."""
    if attractor.cells is not None:
        numbers = attractor.cells.numbers()
        lo, hi, sides = attractor.cells.grid.corners(numbers[:: max(1, numbers.size // 64)])
        return 0.5 * (lo + hi), sides
    parts = [(side, *pair) for side, pairs in attractor.extents.items() for pair in pairs]
    width = 1 if attractor.cycle is not None else SAMPLED
    x = np.concatenate([np.linspace(lo, hi, width + 2)[1:-1] for _, lo, hi in parts])
    return x, np.repeat([side for side, _, _ in parts], width).astype(np.int64)


def _label(snapshot: Snapshot, x: Any, side: Ints, reach: float) -> Ints:
    """Attractor that each state is at, -1 where it is at none."""
    label = np.full(side.size, -1)
    sets = [each.cells for each in snapshot.attractors if each.cells is not None]
    for number, cells in enumerate(sets):
        label[cells.holds(x, side)] = number
    if not snapshot.attractors or sets:
        return label
    away = np.stack([each.distance(x, side) for each in snapshot.attractors])
    return np.where(away.min(axis=0) <= reach, away.argmin(axis=0), -1)


def arrivals(attractor: AttractorAtPlace, there: Snapshot, reach: float) -> set[int]:
    """Attractors of another place in which the states of an attractor end; -2 for an exit."""
    x, side = _sampled(attractor)
    x, side, code, _ = advance(there.place.params, x, side, TRANSIENT)
    stays = code >= 0
    label = _label(there, x[stays], side[stays], reach)
    return set(label[label >= 0].tolist()) | ({-2} if not stays.all() else set())


# ----------------------------------------------------------------
# What continuation gives: the attractors at each step, numbered, and the events between.


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
    def of(cls, attractor: AttractorAtPlace) -> State:
        """Give the state of an attractor of a snapshot."""
        return cls(attractor.extents, attractor.period, attractor.decided)

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
            picked(e, "kind", "t", "values")
            | picked(e, "before", "after", "change", "jump")
            | {"collision": None if e.collision is None else e.collision._asdict()}
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
