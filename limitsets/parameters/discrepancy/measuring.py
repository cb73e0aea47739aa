"""Throws with effects against those without, on cells: deviations of the landing, and flips that change.

Enclosed, where a box kernel follows every effect; sampled in any case, at starts drawn evenly from the cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from limitsets.base import as_table, picked
from limitsets.base.arrays import Array
from limitsets.feeder.thrower.deviation_box import Compared, deviations
from limitsets.feeder.thrower.effects import EFFECTS
from limitsets.feeder.thrower.motion import FullThrow
from limitsets.systems.maps import OUTSIDE_MODEL, UNDEFINED, advance, images

if TYPE_CHECKING:
    from limitsets.feeder.goals import Goal
    from limitsets.feeder.scene import Scene
    from limitsets.proofs.prover.parameters import ParameterBox
    from limitsets.systems.cells import CellSet

ENCLOSED = ("landing", "roll", "slip")
"""Effects that the box kernel of `limitsets.feeder.thrower.deviation_box` follows."""

# Throws before the goal is looked at, and throws at which it is.
SETTLED, WATCHED = 300, 200
# A cell of which nothing is proved is halved so many times, while there are no more than so many cells.
HALVINGS, MOST_CELLS = 8, 400_000


@dataclass(frozen=True)
class Moved:
    """How far effects move the landings of the throws from some cells.

    Attributes
    ----------
    place : str
        "limit-set" or "starts".
    effects : tuple of str
        The effects.
    how : str
        "proved" or "sampled".
    lo, hi : float
        Least and greatest deviation, outward positive, where the part comes to the same side; inf and -inf for none
        [length].
    changed, unknown : float
        Share of the cells' length from which it comes to another side, and of which nothing is known: not enclosed, or
        outside the model.
    share : float
        Share of the arm, of all sides together, that the cells take up.
    throws : int
        How many throws were simulated; 0 for a proof.
    """

    place: str
    effects: tuple[str, ...]
    how: str
    lo: float
    hi: float
    changed: float
    unknown: float
    share: float
    throws: int = 0

    @property
    def most(self) -> float:
        """The greatest deviation either way, 0 for none [length]."""
        return max(0.0, self.hi, -self.lo)

    @property
    def same_sides(self) -> bool:
        """Whether every throw comes to the side to which it comes without effects."""
        return self.changed == 0.0 and self.unknown == 0.0

    def to_json(self) -> dict[str, Any]:
        """Give it as a plain table for JSON."""
        words = ("place", "effects", "how", "lo", "hi", "changed", "unknown", "share", "throws")
        return as_table(**picked(self, *words))


def enclosed(place: str, cells: CellSet, box: ParameterBox, scene: Scene, effects: tuple[str, ...]) -> Moved:
    """Enclose the deviations on cells; `box` has the part's outline, and effects that those given replace."""
    built = {name: EFFECTS[name].build(scene.world, True) for name in effects}
    slip, others = built.pop("slip", None), tuple(built.values())
    assert isinstance(box.lo, FullThrow)
    assert isinstance(box.hi, FullThrow)
    lo, hi = box.lo._replace(effects=others), box.hi._replace(effects=others)
    least, greatest, total = np.inf, -np.inf, 0.0
    lengths = dict.fromkeys(Compared, 0.0)
    for side, parts in _by_side(cells).items():
        first, last = parts
        total += float((last - first).sum())
        for halving in range(HALVINGS + 1):
            state, moved = deviations(lo, hi, slip, side, first, last)
            again = state == Compared.UNKNOWN
            if halving == HALVINGS or 2 * int(again.sum()) > MOST_CELLS:
                again[:] = False
            for kind in Compared:
                lengths[kind] += float((last - first)[(state == kind) & ~again].sum())
            same = moved[state == Compared.SAME]
            least = min(least, float(same[:, 0].min(initial=np.inf)))
            greatest = max(greatest, float(same[:, 1].max(initial=-np.inf)))
            if not again.any():
                break
            first, last = first[again], last[again]
            middle = first + 0.5 * (last - first)
            first, last = np.concatenate([first, middle]), np.concatenate([middle, last])
    changed, unknown = (lengths[kind] / total for kind in (Compared.CHANGED, Compared.UNKNOWN))
    share = total / _arm(scene)
    return Moved(
        place, effects, "proved", lo=least, hi=greatest, changed=changed, unknown=unknown, share=share
    )


def sampled(
    place: str, cells: CellSet, scenes: tuple[Scene, Scene], effects: tuple[str, ...], throws: int, seed: int
) -> Moved:
    """Compare throws of two scenes, without the effects and with them, from starts drawn evenly from the cells."""
    generator = np.random.default_rng(seed)
    parts = _by_side(cells)
    total = sum(float((last - first).sum()) for first, last in parts.values())
    least, greatest, made, changed, unknown = np.inf, -np.inf, 0, 0, 0
    for side, (first, last) in parts.items():
        length = np.concatenate([[0.0], np.cumsum(last - first)])
        count = max(1, round(throws * float(length[-1]) / total))
        at = generator.random(count) * length[-1]
        cell = np.minimum(np.searchsorted(length, at, side="right") - 1, first.size - 1)
        x = np.clip(first[cell] + (at - length[cell]), first[cell], last[cell])
        without, with_them = (images(scene.map, x, side) for scene in scenes)
        outside = (with_them.code == OUTSIDE_MODEL) | (with_them.code == UNDEFINED)
        other = ~outside & (with_them.side != without.side)
        moved = (with_them.x - without.x)[~outside & ~other]
        least, greatest = min(least, moved.min(initial=np.inf)), max(greatest, moved.max(initial=-np.inf))
        made, changed, unknown = made + count, changed + int(other.sum()), unknown + int(outside.sum())
    ends = {"lo": float(least), "hi": float(greatest), "share": total / _arm(scenes[0])}
    return Moved(
        place, effects, "sampled", **ends, changed=changed / made, unknown=unknown / made, throws=made
    )


class Arrivals(NamedTuple):
    """What becomes of starts drawn evenly from the arm, simulated.

    Attributes
    ----------
    share : float
        Share that stays on the arm and after `SETTLED` throws is where the goal wants it: none of the next `WATCHED`
        throws ends where the goal is violated, and where the goal names a place x some end beyond that place.
    throws : float or None
        Mean number of throws until these first rest beyond the goal's place; None for a goal without a place, or if
        none of them does.
    """

    share: float
    throws: float | None


def arrivals(scene: Scene, goal: Goal | None, starts: int, seed: int) -> Arrivals:
    """Throw starts again and again, and see what becomes of them."""
    generator = np.random.default_rng(seed)
    lo, hi = scene.domain.lo[:, 0], scene.domain.hi[:, 0]
    side = generator.choice(lo.size, starts, p=(hi - lo) / (hi - lo).sum())
    x = lo[side] + (hi - lo)[side] * generator.random(starts)
    wrong, place = None if goal is None else goal.wrong(), getattr(goal, "x", -np.inf)
    good, beyond = np.ones(starts, dtype=bool), np.zeros(starts, dtype=bool)
    passed = np.full(starts, -1)
    for throw in range(1, SETTLED + WATCHED + 1):
        x, side, code, _ = advance(scene.map, x, side, 1)
        here = code >= 0
        x, side = x[here], side[here]
        good, beyond, passed = good[here], beyond[here], passed[here]
        there = x > place
        passed[there & (passed < 0)] = throw
        if throw > SETTLED:
            good &= True if wrong is None else ~wrong(x, side)
            beyond |= there
    arrive = good & beyond
    some = np.isfinite(place) and arrive.any()
    return Arrivals(float(arrive.sum()) / starts, float(passed[arrive].mean()) if some else None)


def along_arm(scenes: tuple[Scene, Scene], side: int, count: int = 600) -> tuple[Array, Array]:
    """Return places on a side, and how far the second scene moves their landings: nan where the side is another one."""
    lo, hi = (float(end[side, 0]) for end in (scenes[0].domain.lo, scenes[0].domain.hi))
    x = np.linspace(lo, hi, count)
    without, with_them = (images(scene.map, x, side) for scene in scenes)
    same = (with_them.side == without.side) & (with_them.code > OUTSIDE_MODEL)
    return x, np.where(same, with_them.x - without.x, np.nan)


def _arm(scene: Scene) -> float:
    """Return the length of all sides' places of rest together [length]."""
    return float((scene.domain.hi - scene.domain.lo).sum())


def _by_side(cells: CellSet) -> dict[int, tuple[Array, Array]]:
    """Per side the lower and upper ends of its cells, of sides that have some."""
    ends = {}
    for side, (edges,) in enumerate(cells.grid.edges):
        here = np.flatnonzero(cells.mask[cells.grid.of_side(side)])
        if here.size:
            ends[side] = edges[here], edges[here + 1]
    return ends
