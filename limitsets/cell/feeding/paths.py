"""What is proved of feeding, in words and numbers, and what can be reached on enclosed images of the cells before X.

An orbit goes on from cells before X and ends in a cell beyond.  A cell without a rank (`proofs.basin`) whose image
comes to the border of the cells may leave: towards the joint it may also come to lie before the first cells, and is
thrown on from there.  The checker has the same rule (docs/certificates.md, "Feeding").
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from limitsets.base import as_table, picked
from limitsets.base.arrays import Mask
from limitsets.cell.feeding.falling import ArmEnd
from limitsets.feeder.scene import WITHOUT_SCATTER
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.basin import ROUNDING, SCATTERED
from limitsets.proofs.prover.cover import everywhere
from limitsets.proofs.prover.goals import State
from limitsets.proofs.prover.goals.kind import above, below
from limitsets.proofs.prover.goals.laid_starts import reached_from, starts_in
from limitsets.proofs.prover.thinning import perron_frobenius_bound
from limitsets.systems.cells import CellSet
from limitsets.systems.graph.components import ranks, reach, strong_components
from limitsets.systems.graph.ranges import RUN

# ----------------------------------------------------------------
# What is proved of feeding, in words and numbers: which sides can be fed, and whether every start is.


Extents = dict[int, list[tuple[float, float]]]

Answer = TypeVar("Answer", "Safe", "Fed")


@dataclass(frozen=True)
class Safe:
    """What is proved of the sides that are fed.

    Attributes
    ----------
    verdict : str
        Where the scene scatters its throws without bounds, followed by "of the scene without its scatter".
        "proved": no start of 99 % of the arm at least feeds another side, under any noise; "refuted": one does;
        "proved-on-cells": only the starts in `only_wanted` are proved not to; else "undecided".
    possible : dict of int to extents
        By side that may be fed the starts, by the side they lie on, from which it may be: of all others it is proved
        that they do not feed it.
    only_wanted : extents
        Starts that feed no other side than the one wanted, if they feed any.
    share : float
        Their share of the starts on the arm.
    leaving : float
        Share of the starts of which it is not excluded that they leave the arm otherwise.
    counterexample : tuple of State
        A start and its landing beyond the end on another side, proved; empty if none is shown.
    """

    verdict: str
    possible: dict[int, Extents]
    only_wanted: Extents
    share: float
    leaving: float
    counterexample: tuple[State, ...] = ()

    def lines(self, side: int, *, laid: bool = False) -> list[str]:
        """Put it in words, for the side wanted; of the whole arm, or of where parts are laid down."""
        word, words = self.verdict.partition(" ")[0], _words(self.verdict)
        if word == "proved":
            starts = (
                f"no start {'that is laid down' if laid else 'on the arm'}"
                if self.share == 1.0
                else f"none of {100 * self.share:.4f} % of the starts"
            )
            return [f"safety: {words}, {starts} feeds another side than {side}"]
        share = f"{100 * self.share:.2f} % of the starts are proved to feed no other side than {side}"
        if self.counterexample:
            start, landing = self.counterexample[0], self.counterexample[-1]
            shown = f"a throw from x = {start.lo:.6g} on side {start.side} lands on side {landing.side}"
            return [f"safety: {words}, {shown} at x = {landing.lo:.6g}", share]
        return [f"safety: {words}, {share}"]


@dataclass(frozen=True)
class Fed:
    """What is proved of whether starts are fed at all.

    Attributes
    ----------
    verdict : str
        As of `Safe`, of every start and every sequence of the noise: "proved", "proved-on-cells" (of those from
        `beyond` on), "refuted" or "undecided".
    throws : int or None
        Throws after which every start from `beyond` on is fed, at most; None where that is not proved.
    beyond : dict of int to float
        By side the x from which on it is proved; empty where parts are laid down in ranges [length].
    share : float
        Share of the starts on the arm for which it is proved.
    almost_every : str or None
        The verdict for all starts but some of total length zero; None where every start is fed.
    almost_from : str, dict or None
        For which starts that is proved: "almost-every", or those beyond some x, ``{"from": {"0": x}}``.
    almost_share : float
        Their share of the starts on the arm.
    thinning : int
        Rounds within which the other starts are proved to thin out; 0 where that is not asked or not proved.
    never_fed : tuple of State
        A periodic orbit before the end of the arm, proved; empty where none was found.
    cycle : mapping
        The same as a certificate has it; empty where nothing rechecks it.
    reason : str
        What is missing, empty if nothing.
    """

    verdict: str
    throws: int | None
    beyond: dict[int, float]
    share: float
    almost_every: str | None = None
    almost_from: Any = None
    almost_share: float = 0.0
    thinning: int = 0
    never_fed: tuple[State, ...] = ()
    cycle: Mapping[str, Any] = field(default_factory=dict)
    reason: str = ""

    def lines(self, unit: str) -> list[str]:
        """Put it in words."""
        words = _words(self.verdict)
        if self.never_fed:
            orbit = " -> ".join(f"{state.lo:.5g} ({state.side})" for state in self.never_fed[:4])
            period = len(self.never_fed) - 1
            progress = [
                f"progress of every start: {words}, an orbit of period {period} is never fed: {orbit} -> ..."
            ]
        elif self.throws is None:
            progress = [f"progress: {words}, {self.reason}"]
        else:
            whole = "every start on the arm is fed, " if self.share >= 1.0 else ""
            within = f"every start beyond {_places(self.beyond, unit)} within {self.throws} throws"
            if not self.beyond:
                whole, within = "", f"every start that is laid down is fed within {self.throws} throws"
            progress = [f"progress: {words}, {whole}{within}"]
        if self.almost_every is not None:
            words = _words(self.almost_every)
            places = (
                f" beyond {_places(self.almost_from['from'], unit)}"
                if isinstance(self.almost_from, dict)
                else ""
            )
            progress.append(f"progress of almost every start{places}: {words}")
        return progress

    def to_json(self) -> dict[str, Any]:
        """Give it as JSON takes it."""
        names = (
            "verdict",
            "throws",
            "beyond",
            "share",
            "almost_every",
            "almost_from",
            "almost_share",
            "never_fed",
        )
        return as_table(**picked(self, *names), reason=self.reason or None)


def _words(verdict: str) -> str:
    """Write a verdict for people: its word in capitals."""
    word, _, of = verdict.partition(" ")
    return f"{word.upper().replace('-', ' ')} {of}".rstrip()


def without_scatter(claim: Answer) -> Answer:
    """Say in the verdicts that they are of the scene without its scatter.

    Examples
    --------
    >>> without_scatter(Safe("proved", {}, {}, 1.0, 0.0)).lines(2)
    ['safety: PROVED of the scene without its scatter, no start on the arm feeds another side than 2']
    """
    said = {name: getattr(claim, name, None) for name in ("verdict", "almost_every")}
    changes: dict[str, Any] = {name: f"{word} {WITHOUT_SCATTER}" for name, word in said.items() if word}
    return replace(claim, **changes)


def _places(beyond: Mapping[Any, float], unit: str) -> str:
    return ", ".join(f"{x:.4g} {unit} on side {side}" for side, x in beyond.items())


# ----------------------------------------------------------------
# What can be reached on enclosed images of the cells before X, where the arm ends.


Bits = NDArray[np.uint8]

# What may be open of a claim that is proved.
LITTLE = 0.01
MOST_SIDES = 7
ANY = np.uint8(255)


def verdict_of_share(share: float) -> str:
    """Give the verdict on a claim that is proved for the starts of a share of the arm."""
    return "proved" if share >= 1.0 - LITTLE else "proved-on-cells" if share > 0.0 else "undecided"


@dataclass(frozen=True, eq=False)
class Paths:
    """What can be reached.

    Attributes
    ----------
    attraction : Attraction
        Cells and images.
    end : ArmEnd
        Where the arm ends.
    starts : ndarray of bool, shape (n_cells,)
        Cells with places before X.
    ends_on : ndarray of uint8, shape (n_cells,)
        Bit i: from there a part may come to rest beyond X on side i.
    near : ndarray of uint8, shape (n_sides,)
        The same of starts before the first cells of each side.
    leaves : ndarray of bool, shape (n_cells,)
        A cell that may leave can be reached.
    late : ndarray of bool, shape (n_cells,)
        A recurrent cell, or one that may leave, can be reached.
    steps : ndarray of int32, shape (n_cells,)
        Throws until the end, where it is not late.
    """

    attraction: Attraction
    end: ArmEnd
    starts: Mask
    ends_on: Bits
    near: Bits
    leaves: Mask
    late: Mask
    steps: NDArray[np.int32]

    @property
    def begins(self) -> Mask:
        """Cells in which starts lie: before X, and where parts are laid down."""
        return self.starts & starts_in(self.attraction, self.end.laid)[0] if self.end.laid else self.starts

    @classmethod
    def of(cls, attraction: Attraction, end: ArmEnd) -> Paths:
        """Find them."""
        grid, ranges = attraction.cover.grid, attraction.cover.graph.ranges
        lo, hi = (np.concatenate([edges[k : edges.size - 1 + k] for (edges,) in grid.edges]) for k in (0, 1))
        side = grid.side_of(np.arange(grid.n_cells))
        fed, perhaps = lo >= above(end.x), hi > below(end.x)
        owner = np.repeat(np.arange(grid.n_cells), np.diff(ranges.first))
        ranges = ranges._replace(box=ranges.box.copy())
        ranges.box[fed[owner], RUN] = 0  # what is fed goes no farther
        parts = strong_components(ranges)
        unknown = np.concatenate([images.lost for images in attraction.cover.images])
        ways = everywhere(attraction.cover)
        inward, outward = _leaving(attraction, ways, unknown)
        marks = np.where(perhaps, np.left_shift(1, side), 0).astype(np.uint8)
        for each in range(grid.sides):
            marks[outward[each] & ~fed] |= np.uint8(1 << each)
        near, before = np.zeros(grid.sides, np.uint8), None
        # what lands before the first cells goes on from there
        while before is None or (before != near).any():
            for each in range(grid.sides):
                marks[inward[each] & ~fed] |= near[each]
            spread = reach(ranges, parts, marks)
            before, near = near, np.array([_ahead(attraction, spread, each) for each in range(grid.sides)])
        ends_on = spread.copy()
        for cell in np.flatnonzero(
            perhaps & ~fed & ~unknown
        ).tolist():  # a start before X has not landed beyond it
            landings = [spread[ends[cell, 0] : ends[cell, 1] + 1] for ends in ways if ends[cell, 0] >= 0]
            ends_on[cell] = np.bitwise_or.reduce(np.concatenate([*landings, near[inward[:, cell]]]))
        leaving = (inward | outward).any(axis=0) & ~fed
        late = reach(ranges, parts, ((parts.recurrent[parts.label] & ~fed) | leaving).astype(np.uint8)) > 0
        leaves = reach(ranges, parts, leaving.astype(np.uint8)) > 0
        steps = ranks(ranges, parts, np.zeros(parts.count, dtype=bool))
        return cls(attraction, end, ~fed, ends_on=ends_on, near=near, leaves=leaves, late=late, steps=steps)

    def extents(self, some: Mask) -> Extents:
        """Intervals of the starts in some cells, by side."""
        return CellSet(self.attraction.cover.grid, some & self.starts).extents()

    def share(self, some: Mask, near: Mask) -> float:
        """Share of the starts before X, or laid down there: of those in some cells, and before the first cells."""
        if self.end.laid:
            return self._laid_share(some)
        grid, a = self.attraction.cover.grid, self.attraction.cover.box.bare[0].a
        before = sum(float(edges[0] - a[side]) for side, (edges,) in enumerate(grid.edges) if near[side])
        return (float(grid.measure[some & self.starts].sum()) + before) / float((self.end.x - a).sum())

    def _laid_share(self, some: Mask) -> float:
        """Share of the ranges where parts are laid down that lies in some cells; 1.0 where all of it does."""
        meets, inside = starts_in(self.attraction, self.end.laid)
        if inside and some[meets & self.starts].all():
            return 1.0
        grid, total, claimed = self.attraction.cover.grid, 0.0, 0.0
        for side, lo, hi in self.end.laid:
            (edges,) = grid.edges[side]
            overlap = np.minimum(edges[1:], hi) - np.maximum(edges[:-1], lo)
            claimed += float(np.maximum(overlap, 0.0)[some[grid.of_side(side)]].sum())
            total += hi - lo
        return min(claimed / total, 1.0 - ROUNDING)

    def near_to(self, bad: Mask) -> Mask:
        """Of which sides the starts before the first cells come to cells, and to no bad ones."""
        near = self.attraction.joint
        joined = not self.attraction.cover.points and all(each.proved and not each.rolls for each in near)
        ahead = [_cells_ahead(self.attraction, side) for side in range(len(near))]
        return np.array([joined and not bad[cells].any() for cells in ahead])

    def safe(self) -> Safe:
        """Say which sides can be fed."""
        wrong = np.uint8(ANY ^ (1 << self.end.side))
        bad, near = self.ends_on & wrong > 0, self.near & wrong == 0
        sides = range(self.attraction.cover.grid.sides)
        possible = {side: self.extents(self.ends_on >> side & 1 > 0) for side in sides}
        share = 1.0 if (not (bad & self.starts).any() and bool(near.all())) else self.share(~bad, near)
        begins = self.begins
        measure = self.attraction.cover.grid.measure
        return Safe(
            self.verdict_of(share),
            {side: starts for side, starts in possible.items() if any(starts.values())},
            self.extents(~bad),
            share,
            float(measure[self.leaves & begins].sum()) / float(measure[begins].sum()),
        )

    def from_on(self, bad: Mask) -> tuple[dict[int, float], Mask]:
        """Name by side the x from which on there are no bad cells, and the starts from there on."""
        grid, bad = self.attraction.cover.grid, bad & self.starts
        beyond, good = {}, np.zeros_like(bad)
        for side, (edges,) in enumerate(grid.edges):
            last = np.flatnonzero(bad[grid.of_side(side)])
            first = int(last[-1]) + 1 if last.size else 0
            beyond[side] = float(edges[first])
            good[int(grid.offset[side]) + first : int(grid.offset[side]) + edges.size - 1] = True
        return beyond, good & self.starts

    def verdict_of(self, share: float) -> str:
        """Give the verdict on a claim that is proved for a share of the starts; of those laid down all are asked."""
        if self.end.laid and share < 1.0:
            return "proved-on-cells" if share > 0.0 else "undecided"
        return verdict_of_share(share)

    def _laid(self, bad: Mask) -> tuple[float, str]:
        """Share of the starts laid down that lie in no bad cell, and what is missing where that is not all."""
        share = self._laid_share(~bad)
        if share == 1.0:
            return share, ""
        cells = np.flatnonzero(bad & self.begins)
        place = (
            self.attraction.cover.place(int(cells[0]))
            if cells.size
            else "nearer to the joint than the first cells"
        )
        return share, f"it is proved for {100 * share:.2f} % of the starts laid down, and not for {place}"

    def fed(self) -> Fed:
        """Prove of every start that it is fed."""
        if self.end.laid:
            share, missing = self._laid(self.late)
            if missing:
                return Fed("undecided", None, {}, share, reason=missing)
            return Fed("proved", int(self.steps[self.begins & ~self.late].max(initial=0)), {}, share)
        beyond, good = self.from_on(self.late)
        if not good.any():
            place = self.attraction.cover.place(int(np.flatnonzero(self.late & self.starts)[0]))
            return Fed("undecided", None, {}, 0.0, reason=f"an orbit from {place} may never be fed")
        share = self._share_from_on(good, self.late, self.near_to(self.late))
        return Fed(verdict_of_share(share), int(self.steps[good].max()), beyond, share)

    def _share_from_on(self, good: Mask, bad: Mask, near: Mask) -> float:
        """Share of the starts from some x on, and of those before the first cells of sides all of which is good."""
        if near.all() and not (bad & self.starts).any():
            return 1.0
        grid = self.attraction.cover.grid
        sides = [good[cells][self.starts[cells]].all() for cells in map(grid.of_side, range(grid.sides))]
        # a share of the arm that rounds to all of it leaves something out
        return min(self.share(good, near & np.array(sides)), 1.0 - ROUNDING)

    def almost(self, fed: Fed) -> Fed:
        """Prove of almost every start that it is fed: those that are late thin out, where they cannot leave the arm."""
        # what cannot leave the arm comes to no cell that can, and what is not late never comes to be
        left = self.late & self.starts & ~self.leaves
        starts: Any = "almost-every"
        if self.end.laid:
            share, missing = self._laid(self.leaves)
            left &= reached_from(self.attraction, self.begins & ~self.leaves)
        else:
            beyond, good = self.from_on(self.leaves)
            missing = fed.reason
            # next to the joint a throw rises with the start: it carries no set of positive length into one of length 0
            near = self.near_to(self.leaves) & all(each.rises for each in self.attraction.joint)
            share = self._share_from_on(good, self.leaves, near) if good.any() else 0.0
            starts = starts if share == 1.0 else {"from": {str(side): x for side, x in beyond.items()}}
        thinned = perron_frobenius_bound(self.attraction.cover, left)
        if thinned.reason or share == 0.0 or (self.end.laid and missing):
            return replace(fed, almost_every="undecided", reason=missing or thinned.reason)
        # a little more, so that other arithmetic can confirm it
        rounds = thinned.throws + thinned.throws // 8 + 1
        return replace(
            fed, almost_every=verdict_of_share(share), almost_from=starts, almost_share=share, thinning=rounds
        )


def _leaving(attraction: Attraction, ways: list[NDArray[np.int32]], unknown: Mask) -> tuple[Mask, Mask]:
    """By side the cells that may land before its first cell; and those that may land beyond its last one.

    These are the cells without a rank whose images come to the border: of the others they are proved not to.
    """
    grid = attraction.cover.grid
    inward, outward = np.tile(unknown, (grid.sides, 1)), np.tile(unknown, (grid.sides, 1))
    for ends in ways:
        free = (attraction.basin.rank < 0) & (ends[:, 0] >= 0)
        for side in range(grid.sides):
            inward[side] |= free & (ends[:, 0] == grid.offset[side])
            outward[side] |= free & (ends[:, 1] == grid.offset[side + 1] - 1)
    return inward, outward


def _cells_ahead(attraction: Attraction, side: int) -> slice:
    """Cells to which a throw from before the first cell of a side may lead, besides staying before it."""
    (edges,), first = attraction.cover.grid.edges[side], int(attraction.cover.grid.offset[side])
    to = attraction.joint[side].reach + attraction.cover.box.landing
    return slice(first, first + int(np.searchsorted(edges[:-1], to, side="right")))


def _ahead(attraction: Attraction, spread: Bits, side: int) -> np.uint8:
    """Sides on which a start before the first cell of a side may be fed."""
    near = attraction.joint[side]
    if attraction.cover.points or near.rolls or near.reason not in ("", SCATTERED):
        return ANY
    return np.uint8(np.bitwise_or.reduce(spread[_cells_ahead(attraction, side)]))
