"""Which sides can be fed, from which starts, under every sequence of the noise; and that every start is fed.

The arm ends at X.  On enclosed images of cells an orbit goes on from cells before X, and ends in a cell beyond.

*Safety*: a cell from which no cell beyond X on another side can be reached feeds the wanted side only, under any
sequence of the noise.  *Progress*: where neither a recurrent cell nor an exit can be reached from a cell, before X,
every start in it is fed, within as many throws as the longest path has.  An orbit that is never fed makes that
impossible; then almost every start is fed where the starts that stay before X are proved to thin out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import CellSet
from limitsets.errors import AnswerError
from limitsets.feeding.falling import ArmEnd
from limitsets.feeding.verdicts import Extents, Fed, Safe
from limitsets.goals import OrientedBeyond
from limitsets.graph.components import ranks, reach, strong_components
from limitsets.graph.ranges import RUN
from limitsets.proofs.attraction import Attraction, attraction
from limitsets.proofs.certify import certify
from limitsets.proofs.cover import cover
from limitsets.proofs.goals.kind import above, below
from limitsets.proofs.goals.violating_starts import one_throw
from limitsets.proofs.parameters import parameter_box
from limitsets.proofs.perron_frobenius import perron_frobenius_bound
from limitsets.proofs.simulated import joined, scattered
from limitsets.scene import load

__all__ = ["proved_feeding"]

Mask = NDArray[np.bool_]
Progress = Callable[[str, int, int], None]

# Cells per side, tried in turn until both questions are answered, and what may be open of a claim that is proved.
LADDER = (2048, 8192, 32768)
LITTLE = 0.01
MOST_SIDES = 7


@dataclass(frozen=True, eq=False)
class _Paths:
    """What can be reached on the cells before X."""

    found: Attraction
    end: ArmEnd
    starts: Mask
    waiting: Mask
    ends_on: NDArray[np.uint8]
    leaves: Mask
    late: Mask
    steps: NDArray[np.int32]

    @classmethod
    def of(cls, found: Attraction, end: ArmEnd) -> _Paths:
        grid, ranges = found.cover.grid, found.cover.graph.ranges
        lo, hi = (np.concatenate([edges[k : edges.size - 1 + k] for (edges,) in grid.edges]) for k in (0, 1))
        side = grid.side_of(np.arange(grid.n_cells))
        fed, perhaps = lo >= above(end.x), hi > below(end.x)
        owner = np.repeat(np.arange(grid.n_cells), np.diff(ranges.first))
        ranges = ranges._replace(box=ranges.box.copy())
        ranges.box[fed[owner], RUN] = 0  # what is fed goes no farther
        parts = strong_components(ranges)
        leaving = (ranges.exits > 0) & ~fed
        marks = np.where(perhaps, np.left_shift(1, side), 0) | np.where(leaving, 1 << MOST_SIDES, 0)
        marks = reach(ranges, parts, marks.astype(np.uint8))
        stay = (parts.recurrent[parts.label] & ~fed) | leaving
        late = reach(ranges, parts, stay.astype(np.uint8)) > 0
        steps = ranks(ranges, parts, np.zeros(parts.count, dtype=bool))
        ends_on = (marks & np.uint8((1 << MOST_SIDES) - 1)).astype(np.uint8)
        return cls(found, end, ~perhaps, ~fed, ends_on, marks >> MOST_SIDES > 0, late, steps)

    def extents(self, some: Mask) -> Extents:
        return CellSet(self.found.cover.grid, some & self.starts).extents()

    def share(self, some: Mask) -> float:
        """Share of the arm before X, the starts next to the joint included where they are known to come to cells."""
        grid, a = self.found.cover.grid, self.found.cover.box.bare[0].a
        lost = sum(float(edges[0] - foot) for (edges,), foot in zip(grid.edges, a, strict=True))
        inside = float(grid.measure[some & self.starts].sum())
        whole = float((self.end.x - a).sum())
        return (inside + (lost if self.joined else 0.0)) / whole

    @property
    def joined(self) -> bool:
        """Whether starts nearer to the joint than the cells come to cells before X, and nowhere else."""
        near = self.found.joint
        return not self.found.cover.points and all(
            each.proved and not each.rolls and each.reach <= below(self.end.x) for each in near
        )

    def safe(self) -> Safe:
        wrong = self.ends_on & np.uint8(((1 << MOST_SIDES) - 1) ^ (1 << self.end.side)) > 0
        sides = range(self.found.cover.grid.sides)
        possible = {side: self.extents(self.ends_on >> side & 1 > 0) for side in sides}
        share = self.share(~wrong)
        whole = not (wrong & self.starts).any() and self.joined
        share = 1.0 if whole else share
        verdict = "proved" if share >= 1.0 - LITTLE else "proved-on-cells" if share > 0.0 else "undecided"
        return Safe(
            verdict,
            {side: found for side, found in possible.items() if any(found.values())},
            self.extents(~wrong),
            share,
            float(self.found.cover.grid.measure[self.leaves & self.starts].sum())
            / float(self.found.cover.grid.measure[self.starts].sum()),
        )

    def from_on(self, bad: Mask) -> tuple[dict[int, float], Mask]:
        """Name by side the x from which on there are no bad cells, and the starts from there on."""
        grid, bad = self.found.cover.grid, bad & self.starts
        beyond, good = {}, np.zeros_like(bad)
        for side, (edges,) in enumerate(grid.edges):
            last = np.flatnonzero(bad[grid.of_side(side)])
            first = int(last[-1]) + 1 if last.size else 0
            beyond[side] = float(edges[first])
            good[int(grid.offset[side]) + first : int(grid.offset[side]) + edges.size - 1] = True
        return beyond, good & self.starts

    def fed(self) -> Fed:
        """Prove of every start that it is fed."""
        beyond, good = self.from_on(self.late)
        if not good.any():
            place = self.found.cover.place(int(np.flatnonzero(self.late & self.starts)[0]))
            return Fed("undecided", None, {}, 0.0, reason=f"an orbit from {place} may never be fed")
        whole = self.joined and not (self.late & self.starts).any()
        share = 1.0 if whole else self.share(good)
        verdict = "proved" if share >= 1.0 - LITTLE else "proved-on-cells"
        return Fed(verdict, int(self.steps[good].max()), beyond, share)

    def almost(self, fed: Fed) -> Fed:
        """Prove of almost every start that it is fed: those leave the cells before X that cannot leave the arm."""
        beyond, good = self.from_on(self.leaves)
        # what cannot leave the arm comes to no cell that can: it stays among these cells until it is fed
        reason = perron_frobenius_bound(self.found.cover, self.waiting & ~self.leaves).reason
        if reason or not good.any():
            return replace(fed, almost_every="undecided", reason=fed.reason or reason)
        # next to the joint a throw rises with the start: it carries no set of positive length into one of length zero
        rises = self.joined and all(near.rises for near in self.found.joint)
        whole = rises and not (self.leaves & self.starts).any()
        share = 1.0 if whole else self.share(good)
        verdict = "proved" if share >= 1.0 - LITTLE else "proved-on-cells"
        starts = "almost-every" if whole else {"from": {str(side): x for side, x in beyond.items()}}
        return replace(fed, almost_every=verdict, almost_from=starts, almost_share=share)


def proved_feeding(
    end: ArmEnd, noise: Mapping[str, str] | None = None, *, progress: Progress | None = None
) -> tuple[Safe, Fed]:
    """Prove which sides can be fed and that every start is, or show what refutes it.

    Parameters
    ----------
    end : ArmEnd
        The end of the arm, the side wanted.
    noise : mapping of str to str, optional
        ``{"throw.speed": "0.3 %"}``: what may differ at every throw, as for `limitsets.certify`.
    progress : callable, optional
        Told (stage, done, all).

    Returns
    -------
    Safe
        Which sides.
    Fed
        Whether at all.

    Raises
    ------
    AnswerError
        For effects or noise of which nothing can be proved, or a part of more than seven sides.
    """
    scene = end.scene
    if len(scene.sides) > MOST_SIDES:
        raise AnswerError(
            "the sides of the part", len(scene.sides), f"up to {MOST_SIDES}", "pass prove=False"
        )
    tell = progress or (lambda stage, done, of: None)
    every = joined(dict(noise or {}), scattered(scene))
    box, cuts = parameter_box(scene, noise=every), (below(end.x), above(end.x))
    wrong = OrientedBeyond(end.x, end.side, from_anywhere=True).wrong()
    safe, fed = Safe("undecided", {}, {}, 0.0, 1.0), Fed("undecided", None, {}, 0.0)
    for step, cells in enumerate(LADDER):
        tell(f"proof on {cells} cells a side", step, len(LADDER) + 2)
        paths = _Paths.of(attraction(cover(box, cells, dict.fromkeys(range(len(scene.sides)), cuts))), end)
        if safe.verdict not in ("proved", "refuted"):
            safe = paths.safe()
            shown = () if safe.verdict == "proved" else one_throw(paths.found, wrong, up_to=end.x)
            safe = replace(safe, verdict="refuted", counterexample=shown) if shown else safe
        if fed.verdict not in ("proved", "refuted"):
            fed = paths.fed()
        if fed.verdict != "proved":
            tell("almost every start", step, len(LADDER) + 2)
            fed = paths.almost(fed)
        if step == 0 and fed.verdict != "proved":
            tell("an orbit that is never fed", len(LADDER), len(LADDER) + 2)
            fed = _never_fed(end, every, fed)
        refuted = fed.verdict == "refuted" and fed.almost_every == "proved"
        if safe.verdict in ("proved", "refuted") and (fed.verdict == "proved" or refuted):
            break
    return safe, fed


def _never_fed(end: ArmEnd, noise: Mapping[str, str], fed: Fed) -> Fed:
    """Look for a periodic orbit before the end of the arm."""
    tree = end.scene.as_dict()
    goal = {"reaches": {"x": tree["cavity"]["position"], "side": end.side, "every_orbit": True}}
    found = certify(load({**tree, "goal": goal}), ["goal"], noise=noise or None).claims[0]
    if found.verdict != "refuted" or any(state.hi > below(end.x) for state in found.counterexample):
        return fed
    return replace(
        fed, verdict="refuted", never_fed=found.counterexample, reason="a periodic orbit is never fed"
    )
