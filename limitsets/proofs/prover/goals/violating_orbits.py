"""Orbits and starts that refute a goal: proposed in floats, with the noise chosen at every throw, proved in intervals.

Random throws miss what the noise can do at its worst; reachability, one state per cell, does not.  An orbit found is
replayed from its start with every decision proved and every state enclosed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.goals import Laid
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.orbits import replay
from limitsets.proofs.prover.parameters import ParameterBox
from limitsets.systems.cells import Grid, cell_ends
from limitsets.systems.maps import codes, images, orbit

Wrong: TypeAlias = Callable[[Any, Any], Any]
"""From places and sides to whether each violates the goal; of an enclosure, its lower end is asked."""

# Values of kappa tried at every throw where it may differ.
CHOICES = 33

# Throws from the start at which the search gives up.
MOST_THROWS = 2000

# Without a choice: throws of the orbit that is searched, and of one that is only shown.
SEARCHED, SHOWN = 200_000, 20

# Throws that bring an orbit from the attracting cells to the limit set, before a violation counts.
SETTLING = 20_000

# Violations by less than this, relative to x, may be rounding.
MORE_THAN_ROUNDING = 1.0 - 1e-9


@dataclass(frozen=True)
class State:
    """One state of a counterexample.

    Attributes
    ----------
    lo, hi : float
        Enclosure of x.
    side : int
        The side.
    kappa : float or None
        Gravity over squared speed of the throw made from here; None for the last state.
    landing : float or None
        How far beyond the model's place that throw lands; None for the last state, and without such noise.
    """

    lo: float
    hi: float
    side: int
    kappa: float | None
    landing: float | None = None

    def to_json(self) -> dict[str, Any]:
        """Give it as a plain table for JSON."""
        return {"x": 0.5 * (self.lo + self.hi), "between": [self.lo, self.hi], "side": self.side}


class ThrowChoice(NamedTuple):
    """What one throw may be like: kappa, and how far beyond the model's place it lands."""

    kappa: float
    landing: float


class Path(NamedTuple):
    """States and, one fewer, what each throw was like."""

    x: list[float]
    side: list[int]
    thrown: list[ThrowChoice]


def throw_choices(box: ParameterBox, kappas: int = CHOICES) -> list[ThrowChoice]:
    """List what a throw may be like: values of kappa across its noise, the ends and the middle of the landing's.

    The ends lie slightly inside the bounds, so that rounding takes none of them out of the noise.
    """
    ends, shift = (box.lo.kappa, box.hi.kappa), box.landing * (1.0 - 1e-9)
    margin = 1e-9 * (ends[1] - ends[0])
    values = (
        np.linspace(ends[0] + margin, ends[1] - margin, kappas) if box.kappa_varies else [box.middle_kappa]
    )
    shifts = (-shift, 0.0, shift) if shift > 0.0 else (0.0,)
    return [ThrowChoice(float(kappa), landing) for kappa in values for landing in shifts]


class ThrownStates(NamedTuple):
    """Images of some states: x', side', number of the state, number of the choice, whether it stays on the arm."""

    x: Array
    side: Ints
    state: Ints
    choice: Ints
    stays: Mask


def throws(box: ParameterBox, x: Any, side: Any, options: list[ThrowChoice]) -> ThrownStates:
    """Images of all states under all choices."""
    landings = []
    for kappa in sorted({option.kappa for option in options}):
        map_now = box.at_kappa(kappa)
        for s in np.unique(side).tolist():
            mine = np.flatnonzero(side == s)
            got = images(map_now, x[mine], s)
            landed = got.code != codes.OUTSIDE_MODEL
            to, state = got.side[landed], mine[landed]
            for number, option in enumerate(options):
                if option.kappa == kappa:
                    after = got.x[landed] + option.landing
                    stays = (after > box.hi.a[to]) & (after <= box.lo.arm_length)
                    landings.append((after, to, state, np.full(to.size, number), stays))
    return ThrownStates(*(np.concatenate(part) for part in zip(*landings, strict=True)))


def violation(thrown: ThrownStates, wrong: Wrong) -> Ints:
    """Find the farthest image on the arm that violates the goal by more than rounding: its number, or no number."""
    bad = np.flatnonzero(wrong(thrown.x * MORE_THAN_ROUNDING, thrown.side) & thrown.stays)
    return bad[np.argsort(-thrown.x[bad])[:1]]


@dataclass(eq=False)
class ReachedStates:
    """States met so far, with where each came from."""

    x: list[Array]
    side: list[Ints]
    parent: list[Ints]
    choice: list[Ints]

    @classmethod
    def of(cls, x: Array, side: Ints) -> ReachedStates:
        """Begin with some starts."""
        none = np.full(x.size, -1)
        return cls([x], [side], [none], [none])

    def add(self, thrown: ThrownStates, keep: Ints) -> None:
        """Take images of the states added last, by their numbers."""
        before = sum(part.size for part in self.x[:-1])
        self.x.append(thrown.x[keep])
        self.side.append(thrown.side[keep])
        self.parent.append(thrown.state[keep] + before)
        self.choice.append(thrown.choice[keep])

    def add_new(self, thrown: ThrownStates, place: Ints, seen: Ints) -> Ints:
        """Take one image on the arm for each place that is not seen yet, and return all places seen; -1 is none."""
        new = np.flatnonzero(thrown.stays & (place >= 0) & ~np.isin(place, seen))
        _, first = np.unique(place[new], return_index=True)
        self.add(thrown, new[first])
        return np.concatenate([seen, place[new[first]]])

    def plus(self, thrown: ThrownStates, keep: Ints) -> ReachedStates:
        """Return the same with some more, leaving this as it is."""
        more = ReachedStates([*self.x], [*self.side], [*self.parent], [*self.choice])
        more.add(thrown, keep)
        return more

    def path(self, last: int, options: list[ThrowChoice]) -> Path:
        """States and throws from the start to number `last` of those added last."""
        x, side = np.concatenate(self.x), np.concatenate(self.side)
        parent, choice = np.concatenate(self.parent), np.concatenate(self.choice)
        order = [x.size - self.x[-1].size + last]
        while parent[order[-1]] >= 0:
            order.append(int(parent[order[-1]]))
        order.reverse()
        return Path(x[order].tolist(), side[order].tolist(), [options[k] for k in choice[order[1:]]])


def middle(attraction: Attraction, cells: Ints) -> tuple[float, int]:
    """Middle of the middle one of some cells, and its side."""
    cell = int(cells[cells.size // 2])
    side = int(attraction.cover.grid.side_of(cell))
    lo, hi = attraction.cover.grid.boxes([cell], side)
    return 0.5 * float(lo[0, 0] + hi[0, 0]), side


def on_limit_set(attraction: Attraction) -> tuple[float, int]:
    """Follow an orbit from the attracting cells until it is as near to the limit set as floats come, and its end.

    Cells surround the limit set: an orbit from one of them may violate a goal once, on its way, and never again.
    """
    start, on = middle(attraction, attraction.cells.numbers())
    box = attraction.cover.box
    path = orbit(box.at_kappa(box.middle_kappa), start, on, SETTLING)
    return float(path.x[-1]), int(path.side[-1])


def violating_path(attraction: Attraction, wrong: Wrong) -> Path | None:
    """Breadth first from an attracting cell, one state per cell, until a state violates the goal."""
    grid: Grid = attraction.cover.grid
    start, on = on_limit_set(attraction)
    reached, options = (
        ReachedStates.of(np.array([start]), np.array([on])),
        throw_choices(attraction.cover.box),
    )
    seen = np.zeros(0, np.int64)
    for _ in range(MOST_THROWS):
        thrown = throws(attraction.cover.box, reached.x[-1], reached.side[-1], options)
        bad = violation(thrown, wrong)
        if bad.size:
            reached.add(thrown, bad)
            return reached.path(0, options)
        cells = np.full(thrown.x.size, -1)
        for s in np.unique(thrown.side).tolist():
            cells[thrown.side == s] = grid.index(thrown.x[thrown.side == s], s)
        seen = reached.add_new(thrown, cells, seen)
        if not reached.x[-1].size:
            return None
    return None


def sample_passage(attraction: Attraction, cells: Ints) -> tuple[State, ...]:
    """Prove some throws from the middle of some cells, to be shown."""
    box = attraction.cover.box
    choice = ThrowChoice(box.middle_kappa, 0.0)
    path = orbit(box.at_kappa(choice.kappa), *middle(attraction, cells), SHOWN)
    return replayed(box, Path(path.x.tolist(), path.side.tolist(), [choice] * path.code.size))


def replayed(box: ParameterBox, path: Path) -> tuple[State, ...]:
    """Prove an orbit: its states enclosed, all but the last proved to be on the arm; empty if it cannot be.

    Parameters
    ----------
    box : ParameterBox
        The scene's parameters; where kappa does not differ from throw to throw the orbit is one of every kappa in it.
    path : Path
        The orbit as found.
    """
    ends = [[t.kappa, t.kappa] if box.kappa_varies else [box.lo.kappa, box.hi.kappa] for t in path.thrown]
    bounds = np.array(ends, dtype=float).reshape(-1, 2).T
    shifts = np.array([t.landing for t in path.thrown], dtype=float)
    lo, hi, sides = replay(box, (path.x[0], path.x[0]), path.side[0], bounds, shifts)
    if lo.size < len(path.x) or not (hi[:-1] <= box.lo.arm_length).all():
        return ()
    thrown = [(t.kappa, t.landing if box.landing > 0.0 else None) for t in path.thrown]
    rows = zip(lo.tolist(), hi.tolist(), sides.tolist(), [*thrown, (None, None)], strict=True)
    return tuple(State(low, high, side, *how) for low, high, side, how in rows)


# ----------------------------------------------------------------
# Starts on the arm that refute a goal: by the landing of one throw, or by an orbit that leaves the arm.


# Starts per side, throws, and orbits that are tried, in the search for one that leaves the arm.
STARTS, UNTIL_GONE, TRIED = 256, 400, 8


def one_throw(
    attraction: Attraction, wrong: Wrong, up_to: float = math.inf, laid: Laid = ()
) -> tuple[State, ...]:
    """Find a start, laid down up to some x, whose next landing violates the goal, and prove it; empty if none is."""
    box, (side, lo, hi) = attraction.cover.box, cell_ends(attraction.cover.grid)
    x = 0.5 * (lo + hi)
    good = (x < up_to) & _lies_in(laid, x, side)
    x, side = x[good], side[good]
    if not x.size:
        return ()
    options = throw_choices(box, 3)
    thrown = throws(box, x, side, options)
    bad = violation(thrown, wrong)
    if not bad.size:
        return ()
    reached = ReachedStates.of(x, side)
    reached.add(thrown, bad)
    states = replayed(box, reached.path(0, options))
    if not states or not wrong(np.array([states[-1].lo]), np.array([states[-1].side])).all():
        return ()
    return states if states[-1].hi <= box.lo.arm_length else ()


def start_that_leaves(attraction: Attraction, laid: Laid = ()) -> tuple[State, ...]:
    """Find a start on the arm whose orbit lands off it, x <= a or beyond the end, and prove it.

    Parameters
    ----------
    attraction : Attraction
        Cells and images.
    laid : Laid
        Where it begins, in one of these ranges; () for anywhere on the arm.

    Returns
    -------
    tuple of State
        The orbit, the landing off the arm last; empty if the search finds none.
    """
    box = attraction.cover.box
    for option in throw_choices(box, 3):
        for path in _first_to_leave(attraction, option, laid):
            states = replayed(box, path)
            last = states[-1] if states else None
            # proved to be at x <= a or beyond the arm's end
            if last and (last.hi <= box.lo.a[last.side] or last.lo > box.hi.arm_length):
                return states
    return ()


def _lies_in(laid: Laid, x: Array, side: Ints) -> Mask:
    """Whether starts lie in some ranges; all do where there are none."""
    some = [(side == on) & (lo < x) & (x < hi) for on, lo, hi in laid]
    inside: Mask = np.any(some, axis=0) if some else np.ones_like(x, dtype=bool)
    return inside


def _starts(attraction: Attraction, laid: Laid) -> tuple[Array, Ints]:
    """Choose starts on all of the arm; with scattered landings also one nearer to the joint than these scatter."""
    box, x, side = attraction.cover.box, [], []
    for s, (edges,) in enumerate(attraction.cover.grid.edges):
        if not box.rests[s]:
            continue
        centres = 0.5 * (edges[:-1] + edges[1:])
        centres = centres[_lies_in(laid, centres, np.full(centres.size, s))]
        near = (
            [box.hi.a[s] + 0.125 * box.landing] if box.landing > 0.0 and not attraction.cover.points else []
        )
        x.append(np.concatenate([near, centres[:: max(1, centres.size // STARTS)]]))
        side.append(np.full(x[-1].size, s))
    starts, sides = np.concatenate(x), np.concatenate(side)
    good = _lies_in(laid, starts, sides)
    return starts[good], sides[good]


def _first_to_leave(attraction: Attraction, option: ThrowChoice, laid: Laid) -> Iterator[Path]:
    """Throw some starts again and again, always in the same way, until some have left the arm: their orbits."""
    x, side = _starts(attraction, laid)
    if not x.size:
        return
    reached = ReachedStates.of(x, side)
    for _ in range(UNTIL_GONE):
        thrown = throws(attraction.cover.box, reached.x[-1], reached.side[-1], [option])
        for k in np.flatnonzero(~thrown.stays)[:TRIED]:
            yield reached.plus(thrown, np.array([k])).path(0, [option])
        keep = np.flatnonzero(thrown.stays)
        if keep.size < thrown.stays.size or not keep.size:
            return
        reached.add(thrown, keep)
