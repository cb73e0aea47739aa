"""Orbits that refute a goal because they recur: a single passage on the way to the limit set refutes nothing.

Without noise they are *periodic*.  A long orbit shows where a goal is violated; from such a place on its itinerary is
followed until it comes near again, and the periodic orbit of that itinerary lies nearer still, by the slope of all
these throws.  It is proved in intervals, with a point on it that violates the goal.  One that repels refutes "from
every start", one that attracts "from almost every start".
With noise they are *closed*: from a violating place on the throws are steered back, one state per place of a raster,
until one more can land exactly on an earlier place of the same orbit, by the scatter of the landing or, where kappa
alone differs, between two values of it that land on either side.  From there on the same throws lead to the violation
again.  No noise at all is one of the sequences allowed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from limitsets.base.arrays import Array, Ints
from limitsets.feeder.goals import Laid
from limitsets.feeder.scene import Scene
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.goals.violating_orbits import (
    MORE_THAN_ROUNDING,
    SEARCHED,
    SETTLING,
    Path,
    ReachedStates,
    State,
    ThrowChoice,
    Wrong,
    on_limit_set,
    replayed,
    throw_choices,
    throws,
    violating_path,
)
from limitsets.proofs.prover.orbits import (
    FIRST,
    GROWTH,
    PERIODS,
    TRIES,
    ProvedCycle,
    proved_cycle,
    proved_cycles,
    replay,
)
from limitsets.proofs.prover.parameters import ParameterBox, parameter_box
from limitsets.systems.maps import Orbit, along, images, orbit
from limitsets.systems.sets import Cycle

# Places of a long orbit, and of a short one, from which it is followed back to them; throws until it has come back.
TRIED, FEW, LONGEST = 48, 6, 80

# Where a throw hardly expands, orbits need longer to come round to a small place: up to so many throws, of which the
# nearest returns are tried.  The checker reads no longer ones.
LATEST, RETURNS = 1000, 8

# A periodic orbit is looked for this near to a place, relative to x; beyond such a slope floats do not resolve it.
NEAR, STEEPEST = 1e-3, 1e10

# Starts per side, besides those in the attracting cells, throws after which most have settled, and throws of theirs
# that are searched.
OTHERS, QUICK, SHORT = 12, 200, 2000

# Steering back: places of the raster along the arm, values of kappa, throws at most, ways to close that are tried.
PLACES, KAPPAS, BACK, CLOSINGS = 20_000, 5, 400, 20

# An exact landing between two values of kappa: so near to it, as shares of the way to the ends of the noise.
SPANS = (1e-6, 1e-4, 1e-2, 0.1, 0.5, 1.0)


class Refutation(NamedTuple):
    """An orbit that comes back, and what it refutes.

    Attributes
    ----------
    states : tuple of State
        The orbit from the state that violates the goal until there again; empty if none is found.
    of : str
        What is refuted: that the goal holds from "every" start, or from "almost-every" one.
    recurs : mapping
        Why it comes back, as in a certificate: ``{"cycle": {...}}``, or ``{"closed": True}``, with the two values of
        ``kappa`` of the throw that closes it where it is closed between them; empty if no certificate can show it.
    """

    states: tuple[State, ...] = ()
    of: str = ""
    recurs: Mapping[str, Any] = {}


class Loop(NamedTuple):
    """A periodic orbit that is proved, each point enclosed; `recurs` is empty where no recheck knows the map."""

    lo: Array
    hi: Array
    side: Ints
    branches: Ints
    attracts: bool
    recurs: Mapping[str, Any]


def recurrent_violation(attraction: Attraction, scene: Scene, wrong: Wrong, laid: Laid = ()) -> Refutation:
    """Find an orbit that violates a goal again and again, and prove it.

    Parameters
    ----------
    attraction : Attraction
        Cells and images.
    scene : Scene
        The scene.
    wrong : callable
        From places and sides to whether each violates the goal.
    laid : Laid
        Where a periodic orbit has to have a place; () for anywhere.

    Returns
    -------
    Refutation
        Empty if none is found.
    """
    box = _quiet(attraction, scene)
    for path in _paths(attraction, box):
        bad = np.flatnonzero(wrong(path.x * MORE_THAN_ROUNDING, path.side))
        tried = TRIED if path.code.size > SHORT else FEW
        loop = cycle_near(
            box,
            path,
            bad,
            lambda one: meets(one, laid) and _violates(wrong, one.lo[0], one.hi[0], one.side[0]),
            tried,
        )
        if loop is not None:
            return _of(loop, box, attraction)
    if not attraction.cover.box.noise or not (attraction.component >= 0).any():
        return Refutation()
    noisy = violating_path(attraction, wrong)
    return Refutation() if noisy is None else closed(attraction.cover.box, noisy, wrong)


def meets(loop: Loop, laid: Laid) -> bool:
    """Whether a place of an orbit lies inside one of some ranges; always, where there are none."""
    inside = [((loop.side == side) & (lo < loop.lo) & (loop.hi < hi)).any() for side, lo, hi in laid]
    return not laid or bool(np.any(inside))


def cycle_that(
    attraction: Attraction,
    scene: Scene,
    refutes: Callable[[Loop], bool],
    longest: int = PERIODS[0],
    *,
    attracting: bool = False,
) -> Refutation:
    """Find a periodic orbit that refutes a goal as a whole, by what it never does, and prove it.

    Parameters
    ----------
    attraction : Attraction
        Cells and images.
    scene : Scene
        The scene.
    refutes : callable
        From a proved orbit to whether it is such a one.
    longest : int
        Largest period searched in the attracting cells.
    attracting : bool
        Look for orbits that attract only.

    Returns
    -------
    Refutation
        Empty if none is found.
    """
    box = _quiet(attraction, scene)
    if not box.effects:
        quiet = replace(attraction, cover=replace(attraction.cover, box=box))
        for cycle in () if attracting else proved_cycles(quiet, longest).cycles:
            loop = _loop(cycle)
            if refutes(loop):
                return _of(loop, box, attraction)
    for path in _paths(attraction, box):
        ends = np.arange(max(path.x.size - 2 * LONGEST, 0), max(path.x.size - LONGEST, 1))
        best = cycle_near(box, path, ends, refutes, FEW)
        if best is not None:
            return _of(best, box, attraction)
    return Refutation()


def _quiet(attraction: Attraction, scene: Scene) -> ParameterBox:
    """Return the scene's parameters without noise."""
    box = attraction.cover.box
    return parameter_box(scene, tree=box.scene) if box.noise else box


def _paths(attraction: Attraction, box: ParameterBox) -> Iterator[Orbit]:
    """Long orbits where starts end: one in each attracting component that is met, and wherever else starts end."""
    map_now, met = box.at_kappa(box.middle_kappa), set()
    if (attraction.component >= 0).any():
        first = on_limit_set(attraction)
        met.add(_component(attraction, *first))
        yield _lasting(map_now, *first, SEARCHED)
    for side, (edges,) in enumerate(attraction.cover.grid.edges):
        for x in np.linspace(edges[0], edges[-1], OTHERS + 2)[1:-1].tolist():
            last = _unmet(attraction, map_now, x, side, met)
            if last is None:
                continue
            met.add(_component(attraction, *last))
            # two starts whose orbits end off the attracting cells may end in different places
            met.discard(-1)
            yield _lasting(map_now, *last, SHORT)


def _unmet(
    attraction: Attraction, map_now: Any, x: float, side: int, met: set[int]
) -> tuple[float, int] | None:
    """Where a start ends; None where it stops, or comes to an attracting component that was met: it stays there."""
    for count in (QUICK, SETTLING - QUICK):
        path = _lasting(map_now, x, side, count)
        x, side = float(path.x[-1]), int(path.side[-1])
        if path.stopped is not None or _component(attraction, x, side) in met:
            return None
    return x, side


def _lasting(map_now: Any, x: float, side: int, throws: int) -> Orbit:
    """Follow an orbit; where it moves by less than floats can tell it is said to stay, so that one comes back there."""
    path = orbit(map_now, x, side, throws)
    if path.stopped != "stalled":
        return path
    code = images(map_now, path.x[-1:], int(path.side[-1])).code
    return Orbit(
        np.append(path.x, path.x[-1]), np.append(path.side, path.side[-1]), np.append(path.code, code), None
    )


def _component(attraction: Attraction, x: float, side: int) -> int:
    """Return the number of the attracting component in which a place lies, -1 if in none."""
    (cell,) = attraction.cover.grid.index([x], side)
    return int(attraction.component[cell]) if cell >= 0 else -1


def _violates(wrong: Wrong, lo: float, hi: float, side: int) -> bool:
    """Whether both ends and the middle of an enclosure violate the goal."""
    return bool(wrong(np.array([lo, 0.5 * (lo + hi), hi]), np.full(3, side)).all())


# ---------------------------------------------------------------- periodic orbits


def cycle_near(
    box: ParameterBox, path: Orbit, at: Ints, refutes: Callable[[Loop], bool], tried: int
) -> Loop | None:
    """Find a periodic orbit through, nearly, one of some places of a long orbit, and prove it.

    Parameters
    ----------
    box : ParameterBox
        One scene's parameters, without noise.
    path : Orbit
        The long orbit.
    at : ndarray of int
        Numbers of the places.
    refutes : callable
        From an orbit, which begins near the place, to whether it is wanted: asked of it as it is found, and as proved.
    tried : int
        Places that are tried, evenly spread from the largest x on.
    """
    order = at[np.argsort(-path.x[at], kind="stable")]
    for k in order[:: max(1, order.size // tried)][:tried].tolist():
        for loop in _returns(box, path, k, refutes):
            on_arm = (loop.lo > box.hi.a[loop.side]).all() and (loop.hi <= box.lo.arm_length).all()
            if on_arm and refutes(loop):
                return loop
    return None


def _returns(box: ParameterBox, path: Orbit, k: int, refutes: Callable[[Loop], bool]) -> Iterator[Loop]:
    """Periodic orbits near place k, by itineraries of growing length."""
    map_now = box.at_kappa(box.middle_kappa)
    for period in _periods(path, k):
        x, steep = (_root_on_orbit if box.effects else _root)(map_now, path, k, period)
        if abs(steep) > STEEPEST:
            return
        if not abs(x - path.x[k]) <= NEAR * abs(path.x[k]):
            continue
        around = _lasting(map_now, x, int(path.side[k]), period)
        same = around.code.size == period and (around.side == path.side[k : k + period + 1]).all()
        if not same or not (box.effects or (around.code == path.code[k : k + period]).all()):
            continue
        points = around.x[:-1], around.x[:-1], around.side[:-1], around.code.astype(np.int64)
        if not refutes(Loop(*points, abs(steep) < 1.0, {})):
            continue
        if box.effects:
            proved = _enclosed(box, around)
        else:
            cycle = Cycle(around.x[:-1], around.side[:-1], around.code, steep, 0.0, True)
            one = proved_cycle(box, cycle)
            proved = _loop(one) if isinstance(one, ProvedCycle) else None
        if proved is not None:
            yield proved


def _periods(path: Orbit, k: int) -> list[int]:
    """Throws after which the orbit lies on the side of place k again: up to `LONGEST` all, then the nearest returns."""
    period = 1 + np.flatnonzero(path.side[k + 1 : k + 1 + LATEST] == path.side[k])
    later = period[period > LONGEST]
    nearest = np.argsort(np.abs(path.x[k + later] - path.x[k]), kind="stable")[:RETURNS]
    return [*period[period <= LONGEST].tolist(), *np.sort(later[nearest]).tolist()]


def _root(map_now: Any, path: Orbit, k: int, period: int) -> tuple[float, float]:
    """Newton's method for G(x) = x along the itinerary, whatever branches the map would take; x and the slope of G."""
    word, side, x, steep = path.code[k : k + period], int(path.side[k]), float(path.x[k]), np.nan
    for _ in range(4):
        (y,), _, (steep,) = along(map_now, [x], side, word)
        x += (y - x) / (1.0 - steep) if steep != 1.0 else np.nan
        if not abs(x - path.x[k]) <= NEAR * abs(path.x[k]):
            break
    return x, float(steep)


def _root_on_orbit(map_now: Any, path: Orbit, k: int, period: int) -> tuple[float, float]:
    """As `_root` for maps whose branches cannot be forced, by the orbits of x and of a place beside it."""
    side, x, steep = int(path.side[k]), float(path.x[k]), np.nan
    step = 1e-7 * abs(x)
    for _ in range(6):
        first, second = orbit(map_now, x, side, period), orbit(map_now, x + step, side, period)
        if first.code.size < period or second.code.size < period:
            return np.nan, steep
        steep = float((second.x[-1] - first.x[-1]) / step)
        x += float(first.x[-1] - x) / (1.0 - steep) if steep != 1.0 else np.nan
        if not np.isfinite(x):
            break
    return x, steep


def _loop(cycle: ProvedCycle) -> Loop:
    return Loop(cycle.lo, cycle.hi, cycle.side, cycle.branches, cycle.attracts, {"cycle": cycle.section()})


def _enclosed(box: ParameterBox, around: Orbit) -> Loop | None:
    """Prove a periodic orbit of a map with effects: an interval goes one way, and its ends part or come nearer."""
    if not box.concave:
        return None
    x, side, period = float(around.x[0]), int(around.side[0]), around.code.size
    kappa = np.tile([[box.lo.kappa], [box.hi.kappa]], period)
    radius = FIRST * max(abs(x), 1.0)
    for _ in range(TRIES):
        lo, hi = x - radius, x + radius
        radius *= GROWTH
        whole, first, last = (
            replay(box, start, side, kappa, np.zeros(period)) for start in ((lo, hi), (lo, lo), (hi, hi))
        )
        if min(one[0].size for one in (whole, first, last)) <= period or whole[2][-1] != side:
            continue
        inward = whole[0][-1] > lo and whole[1][-1] < hi
        apart = first[1][-1] < lo and last[0][-1] > hi
        turned = first[0][-1] > hi and last[1][-1] < lo
        if inward or apart or turned:
            branches = around.code.astype(np.int64)
            return Loop(
                whole[0][:-1], whole[1][:-1], whole[2][:-1].astype(np.int64), branches, bool(inward), {}
            )
    return None


def _of(loop: Loop, box: ParameterBox, attraction: Attraction) -> Refutation:
    """Make a refutation of a periodic orbit: its first point comes again at the end."""
    kappa, landing = box.middle_kappa, 0.0 if attraction.cover.box.landing > 0.0 else None
    points = zip(loop.lo.tolist(), loop.hi.tolist(), loop.side.tolist(), strict=True)
    states = [State(lo, hi, side, kappa, landing) for lo, hi, side in points]
    last = replace(states[0], kappa=None, landing=None)
    return Refutation((*states, last), "almost-every" if loop.attracts else "every", loop.recurs)


# ---------------------------------------------------------------- closed orbits of throws that differ


def closed(box: ParameterBox, path: Path, wrong: Wrong) -> Refutation:
    """Close an orbit whose last state violates a goal, by throws within the noise, and prove it.

    Parameters
    ----------
    box : ParameterBox
        The scene's parameters with its noise.
    path : Path
        The orbit as found.
    wrong : callable
        From places and sides to whether each violates the goal.
    """
    options, step = throw_choices(box, KAPPAS), box.hi.arm_length / PLACES
    reached = ReachedStates.of(np.array(path.x[-1:]), np.array(path.side[-1:], dtype=np.int64))
    seen, left = np.zeros(0, dtype=np.int64), CLOSINGS
    for _ in range(BACK):
        x, side = reached.x[-1], reached.side[-1]
        for last, first in _within_reach(box, path, x, side)[:left].tolist():
            back = reached.path(last, options)
            whole = Path(
                [*path.x[first:], *back.x[1:]],
                [*path.side[first:], *back.side[1:]],
                [*path.thrown[first:], *back.thrown],
            )
            refutation = _closed(box, whole, len(path.x) - 1 - first, wrong)
            left -= 1
            if refutation.states or not left:
                return refutation
        thrown = throws(box, x, side, options)
        place = thrown.side * 2 * PLACES + np.floor(thrown.x / step).astype(np.int64)
        seen = reached.add_new(thrown, place, seen)
        if not reached.x[-1].size:
            break
    return Refutation()


def _ends(box: ParameterBox) -> tuple[float, float]:
    """Least and largest kappa of a throw, a little inside the noise."""
    if not box.kappa_varies:
        return box.middle_kappa, box.middle_kappa
    options = throw_choices(box, 2)
    return options[0].kappa, options[-1].kappa


def _within_reach(box: ParameterBox, path: Path, x: Array, side: Ints) -> Ints:
    """Pairs of one of these states and a place of the path where a throw from it can land, the latest first."""
    bounds, sides = np.full((2, x.size), np.nan), np.full((2, x.size), -1)
    for row, kappa in enumerate(_ends(box)):
        thrown = throws(box, x, side, [ThrowChoice(kappa, 0.0)])
        bounds[row, thrown.state], sides[row, thrown.state] = thrown.x, thrown.side
    lo, hi = bounds.min(axis=0) - box.landing, bounds.max(axis=0) + box.landing
    slack = 0.02 * (hi - lo)
    to, at = np.array(path.side[:-1]), np.array(path.x[:-1])
    good = (sides[0] == sides[1])[:, None] & (sides[0][:, None] == to)
    good &= (at > (lo + slack)[:, None]) & (at < (hi - slack)[:, None])
    pairs = np.argwhere(good)
    return pairs[np.argsort(-pairs[:, 1], kind="stable")].astype(np.int64)


def _closed(box: ParameterBox, path: Path, bad: int, wrong: Wrong) -> Refutation:
    """Prove an orbit from its exact start, and that one more throw can lead exactly there; state `bad` violates."""
    states = replayed(box, path)
    if not states or states[-1].hi > box.lo.arm_length:
        return Refutation()
    if not _violates(wrong, states[bad].lo, states[bad].hi, states[bad].side):
        return Refutation()
    kappa = _kappa_to(box, path.x[-1], path.side[-1], path.x[0], path.side[0])
    span = _closing(box, states[-1], kappa, path.x[0], path.side[0])
    if span is None:
        return Refutation()
    recurs: dict[str, Any] = {"closed": True}
    shift = None
    if box.landing > 0.0:
        lo, hi = _landed(box, states[-1], span)[:2]
        shift = path.x[0] - 0.5 * (lo + hi)
    else:
        recurs["kappa"] = [end.hex() for end in span]
    loop = [*states[:-1], replace(states[-1], kappa=kappa, landing=shift)]
    shown = [*loop[bad:], *loop[:bad], replace(loop[bad], kappa=None, landing=None)]
    return Refutation(tuple(shown), "every", recurs)


def _kappa_to(box: ParameterBox, x: float, side: int, to: float, on: int) -> float:
    """Find a kappa with which a throw lands as near as can be to a place, by halving."""

    def beyond(kappa: float) -> float:
        got = images(box.at_kappa(kappa), [x], side)
        return float(got.x[0] - to) if got.side[0] == on else np.nan

    low, high = _ends(box)
    first, last = beyond(low), beyond(high)
    if not first * last < 0.0:
        return low if abs(first) <= abs(last) else high
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (beyond(middle) > 0.0) == (first > 0.0) else (low, middle)
    return 0.5 * (low + high)


def _landed(box: ParameterBox, state: State, kappa: tuple[float, float]) -> tuple[float, float, int]:
    """Enclose one throw from a state, with every kappa from one to another: bounds and side; nan where not decided."""
    lo, hi, side = replay(box, (state.lo, state.hi), state.side, np.array(kappa).reshape(2, 1), np.zeros(1))
    return (float(lo[1]), float(hi[1]), int(side[1])) if lo.size > 1 else (np.nan, np.nan, -1)


def _closing(box: ParameterBox, state: State, kappa: float, to: float, on: int) -> tuple[float, float] | None:
    """Bounds of kappa between which the throw lands exactly there, whatever the rounding; None if it is not proved."""
    if box.landing > 0.0:
        only = (kappa, kappa) if box.kappa_varies else (box.lo.kappa, box.hi.kappa)
        lo, hi, side = _landed(box, state, only)
        near = side == on and max(abs(lo - to), abs(hi - to)) < box.landing * (1.0 - 1e-9)
        return only if near else None
    if not box.concave:
        return None
    low, high = _ends(box)
    for share in SPANS:
        span = kappa + share * (low - kappa), kappa + share * (high - kappa)
        first, last = (_landed(box, state, (end, end)) for end in span)
        parted = (first[1] < to < last[0]) or (last[1] < to < first[0])
        if parted and first[2] == last[2] == _landed(box, state, span)[2] == on:
            return span
    return None
