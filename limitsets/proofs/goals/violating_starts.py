"""Starts on the arm that refute a goal: by the landing of one throw, or by an orbit that leaves the arm."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from limitsets.goals import Laid
from limitsets.proofs.attraction import Attraction
from limitsets.proofs.goals.violating_orbits import (
    Path,
    ReachedStates,
    State,
    ThrowChoice,
    Wrong,
    proved_wrong,
    replayed,
    throw_choices,
    throws,
    violation,
)
from limitsets.proofs.parameters import ParameterBox

# Starts per side, throws, and orbits that are tried, in the search for one that leaves the arm.
STARTS, UNTIL_GONE, TRIED = 256, 400, 8


def one_throw(found: Attraction, wrong: Wrong, up_to: float = math.inf, laid: Laid = ()) -> tuple[State, ...]:
    """Find a start, laid down up to some x, whose next landing violates the goal, and prove it; empty if none is."""
    grid, box = found.cover.grid, found.cover.box
    x = np.concatenate([0.5 * (edges[:-1] + edges[1:]) for (edges,) in grid.edges])
    side = np.repeat(np.arange(grid.sides), [edges.size - 1 for (edges,) in grid.edges])
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
    states = proved_wrong(box, reached.path(0, options), wrong)
    return states if states and states[-1].hi <= box.lo.arm_length else ()


def start_that_leaves(found: Attraction, laid: Laid = ()) -> tuple[State, ...]:
    """Find a start on the arm whose orbit lands off it, x <= a or beyond the end, and prove it.

    Parameters
    ----------
    found : Attraction
        Cells and images.
    laid : Laid
        Where it begins, in one of these ranges; () for anywhere on the arm.

    Returns
    -------
    tuple of State
        The orbit, the landing off the arm last; empty if none is found.
    """
    box = found.cover.box
    for option in throw_choices(box, 3):
        for path in _first_to_leave(found, option, laid):
            states = replayed(box, path)
            if states and _is_off(box, states[-1]):
                return states
    return ()


def _lies_in(laid: Laid, x: NDArray[np.float64], side: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether starts lie in some ranges; all do where there are none."""
    some = [(side == on) & (lo < x) & (x < hi) for on, lo, hi in laid]
    found: NDArray[np.bool_] = np.any(some, axis=0) if some else np.ones_like(x, dtype=bool)
    return found


def _starts(found: Attraction, laid: Laid) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Choose starts on all of the arm; with scattered landings also one nearer to the joint than these scatter."""
    box, x, side = found.cover.box, [], []
    for s, (edges,) in enumerate(found.cover.grid.edges):
        if not box.rests[s]:
            continue
        centres = 0.5 * (edges[:-1] + edges[1:])
        centres = centres[_lies_in(laid, centres, np.full(centres.size, s))]
        near = [box.hi.a[s] + 0.125 * box.landing] if box.landing > 0.0 and not found.cover.points else []
        x.append(np.concatenate([near, centres[:: max(1, centres.size // STARTS)]]))
        side.append(np.full(x[-1].size, s))
    starts, sides = np.concatenate(x), np.concatenate(side)
    good = _lies_in(laid, starts, sides)
    return starts[good], sides[good]


def _first_to_leave(found: Attraction, option: ThrowChoice, laid: Laid) -> Iterator[Path]:
    """Throw some starts again and again, always in the same way, until some have left the arm: their orbits."""
    x, side = _starts(found, laid)
    if not x.size:
        return
    reached = ReachedStates.of(x, side)
    for _ in range(UNTIL_GONE):
        thrown = throws(found.cover.box, x, side, [option])
        for k in np.flatnonzero(~thrown.stays)[:TRIED]:
            yield reached.plus(thrown, np.array([k])).path(0, [option])
        keep = np.flatnonzero(thrown.stays)
        if keep.size < thrown.stays.size or not keep.size:
            return
        reached.add(thrown, keep)
        x, side = thrown.x[keep], thrown.side[keep]


def _is_off(box: ParameterBox, state: State) -> bool:
    """Whether a landing is proved to be at x <= a or beyond the arm's end."""
    return bool(state.hi <= box.lo.a[state.side] or state.lo > box.hi.arm_length)
