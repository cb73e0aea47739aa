"""End points of the limit set, each between two proved numbers, outer and inner.

The limit set is the intersection L of N, F(N), F(F(N)), ..., where N are the attracting cells, which F maps into
themselves, and F is read with both one-sided limits where the decision between jog and flip changes.

*Outer.*  A(0) = N, A(n + 1) = F(A(n)) & A(n), every image rounded outward.  Each A(n) holds F^n(N), and so L.  The ends
are doubles that only move inward; they come to rest after finitely many images, at A.

*Inner.*  B(0) = A, B(n + 1) = F(B(n)) & B(n), every image rounded inward: of an interval on which one branch is proved,
where the map is therefore continuous, all between the images of two points is covered (intermediate values); the
bracket of a critical point, where no branch is proved, gives nothing.  At rest B lies in F(B).  Then B lies in F(B), in
F(F(B)), ... and, B being part of N, in every F^n(N): **B lies in L.**

This takes the place of an argument by expansion ("every interval grows until it covers the critical point").  An end is
the image, along the itinerary given with it, of a one-sided limit at a critical point c.  It is reached because B holds
the proper side of c up to its bracket, and every point of B, on both sides of c and around every other critical point
that is kept, is again the image of a point of B.  So the proof needs no statement about recurrent orbits or about one
critical point reaching another, and no slope.  All preimages are decided starts: the value of the map at a critical
point itself does not matter.  The proof does not claim that one orbit is dense in L.

Where the map contracts, inward rounding makes B empty: the inner ends are then None, and `orbits.py` describes L there.
 With noise, both sets hold for every sequence of throws.

Checked by machine: branches and signs of slopes on tiles of N, images of tile ends (`proved_pieces.py`), and the exact
comparison of B with its image.  Source: docs/model.md, limit sets.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from limitsets.maps import codes
from limitsets.proofs.attraction import Attraction
from limitsets.proofs.orbits import follow
from limitsets.proofs.proved_pieces import (
    Intervals,
    Pair,
    PieceImage,
    ProvedPiece,
    UnionImages,
    at_rest,
    proved_pieces_of,
    union_of,
)
from limitsets.thrower.throw_box import BOTH


class CriticalBracket(NamedTuple):
    """Where the decision changes: one branch is proved up to `lo`, another from `hi` on."""

    side: int
    lo: float
    hi: float
    before: int
    after: int


class ProvedEnd(NamedTuple):
    """One end of one interval of the limit set.

    Attributes
    ----------
    side, which : int, str
        Its side, and "lo" or "hi".
    outer, inner : float, float or None
        Nothing of the limit set lies beyond `outer`; all from `inner` to the other end's `inner` belongs to it.
    critical : CriticalBracket or None
        Where its orbit begins, None where it is not traced to a critical point.
    branches : tuple of int
        The throws from there, the first being the branch of the one-sided limit.
    orbit : tuple of (lo, hi)
        Enclosures of the states along them, the bracket first, the end last.
    """

    side: int
    which: str
    outer: float
    inner: float | None
    critical: CriticalBracket | None
    branches: tuple[int, ...]
    orbit: tuple[Pair, ...]


@dataclass(frozen=True, eq=False)
class ProvedEnds:
    """A limit set between two unions of intervals.

    Attributes
    ----------
    ends : tuple of ProvedEnd
        By side, ascending.
    critical : tuple of CriticalBracket
        The critical points in the outer set.
    images : (int, int)
        Images taken for the outer and the inner set.
    tiles : dict of int to list of ProvedPiece
        By side, what was proved of the throws from the attracting cells.
    reason : str
        Why inner ends are missing; empty if none is.
    """

    ends: tuple[ProvedEnd, ...]
    critical: tuple[CriticalBracket, ...]
    images: tuple[int, int]
    tiles: dict[int, list[ProvedPiece]]
    reason: str

    @property
    def extents(self) -> dict[int, list[tuple[tuple[float, float | None], tuple[float | None, float]]]]:
        """Per side ``((lo_outer, lo_inner), (hi_inner, hi_outer))`` of every interval."""
        found: dict[int, list[tuple[tuple[float, float | None], tuple[float | None, float]]]] = {}
        for lo, hi in zip(self.ends[::2], self.ends[1::2], strict=True):
            found.setdefault(lo.side, []).append(((lo.outer, lo.inner), (hi.inner, hi.outer)))
        return found

    @property
    def width(self) -> float:
        """Largest distance of an inner end from its outer one; inf where one is missing."""
        widths = [np.inf if end.inner is None else abs(end.outer - end.inner) for end in self.ends]
        return float(max(widths, default=np.inf))

    def section(self) -> dict[str, Any]:
        """Return what a recheck needs."""
        return {
            "images": self.images[0],
            "ends": [
                {"side": end.side, "which": end.which, "outer": end.outer.hex(),
                 "inner": None if end.inner is None else end.inner.hex()}
                for end in self.ends
            ],
            "pieces": [
                [side, piece.lo.hex(), piece.hi.hex(), piece.branch if piece.branch >= 0 else BOTH, piece.sign]
                for side, row in sorted(self.tiles.items())
                for piece in row
            ],
        }  # fmt: skip


def _critical(tiles: dict[int, list[ProvedPiece]]) -> tuple[CriticalBracket, ...]:
    """Undecided tiles between decided ones of different branches."""
    found = []
    for side, row in tiles.items():
        groups = union_of((piece.lo, piece.hi) for piece in row if piece.branch == BOTH)
        before = {piece.hi: piece.branch for piece in row if piece.branch in (codes.JOG, codes.FLIP)}
        after = {piece.lo: piece.branch for piece in row if piece.branch in (codes.JOG, codes.FLIP)}
        found += [
            CriticalBracket(side, lo, hi, before[lo], after[hi])
            for lo, hi in groups
            if lo in before and hi in after and before[lo] != after[hi]
        ]
    return tuple(found)


class _Step(NamedTuple):
    """Where an end comes from in one throw: an x, and whether it is itself an end (by number of its interval)."""

    side: int
    x: float
    branch: int
    owner: int
    which: str


def _source(parts: list[PieceImage], outer: Intervals, side: int, x: float) -> _Step:
    """Of the ends of all images on a side, find where the one nearest to x comes from."""
    distance = np.inf
    best = _Step(side, x, -1, -1, "")
    for part in parts:
        if part.to != side or part.piece.branch not in (codes.JOG, codes.FLIP):
            continue
        interval = outer[part.side][part.owner]
        for start, image, end, which in (
            (part.lo, part.at_lo, interval[0], "lo"),
            (part.hi, part.at_hi, interval[1], "hi"),
        ):
            away = abs(0.5 * (image[0] + image[1]) - x)
            if away < distance:
                distance = away
                best = _Step(part.side, start, part.branch, part.owner if start == end else -1, which)
    return best


def _traced(
    images: UnionImages, outer: Intervals, critical: tuple[CriticalBracket, ...], side: int, x: float
) -> tuple[CriticalBracket | None, tuple[int, ...], tuple[Pair, ...]]:
    """Follow an end back to a critical point, and enclose the orbit from there."""
    parts = images.parts(outer)
    branches: list[int] = []
    most = 2 * sum(map(len, outer.values())) + 1
    at, on = x, side
    while len(branches) < most:
        step = _source(parts, outer, on, at)
        branches.insert(0, step.branch)
        at, on = step.x, step.side
        if step.owner < 0:
            break
    for one in critical:
        if one.side == on and at in (one.lo, one.hi):
            orbit = follow(images.box, one.lo, one.hi, one.side, branches)
            if orbit.lo.size == len(branches) + 1:
                return one, tuple(branches), tuple(zip(orbit.lo.tolist(), orbit.hi.tolist(), strict=True))
    return None, (), ()


def _inner_ends(outer: Intervals, inner: Intervals) -> tuple[dict[tuple[int, int], Pair], str]:
    """Inner ends by side and number of the outer interval, where it holds exactly one inner interval."""
    ends: dict[tuple[int, int], Pair] = {}
    reason = ""
    for side, intervals in sorted(outer.items()):
        for owner, (lo, hi) in enumerate(intervals):
            held = [pair for pair in inner.get(side, []) if lo <= pair[0] and pair[1] <= hi]
            if len(held) == 1:
                ends[side, owner] = held[0]
            elif not reason:
                reason = f"side {side}, [{lo:.9g}, {hi:.9g}]: " + (
                    "it is not proved that all between two ends belongs to the limit set"
                    if held
                    else "no part of it is proved to belong to the limit set; see periodic orbits"
                )
    return ends, reason


def proved_ends(found: Attraction) -> ProvedEnds:
    """Bracket the ends of the limit set.

    Parameters
    ----------
    found : Attraction
        Attracting cells.

    Returns
    -------
    ProvedEnds
        Without ends where there are no attracting cells.

    Notes
    -----
    Source: docs/model.md, limit sets; the proof is in this module's docstring.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.proofs.attraction import attraction
    >>> from limitsets.proofs.cover import cover
    >>> from limitsets.proofs.parameters import parameter_box
    >>> ends = proved_ends(attraction(cover(parameter_box(ls.load("paper-designed")), 2048)))
    >>> [(round(lo, 9), round(hi, 9)) for (lo, _), (_, hi) in ends.extents[0]], ends.width < 1e-9
    ([(15.205338826, 19.752688015)], True)
    """
    grid, box = found.cover.grid, found.cover.box
    tiles: dict[int, list[ProvedPiece]] = {}
    for side, (edges,) in enumerate(grid.edges):
        mine = np.flatnonzero(found.component[grid.of_side(side)] >= 0)
        tiles[side] = proved_pieces_of(box, side, edges[mine], edges[mine + 1])
    images = UnionImages(box, tiles)
    cells = {side: union_of((piece.lo, piece.hi) for piece in row) for side, row in tiles.items() if row}
    if not cells:
        return ProvedEnds((), (), (0, 0), {}, "there are no attracting cells")
    outer, taken = at_rest(images.outward, cells)
    inner, then = at_rest(images.inward, outer)
    held, reason = _inner_ends(outer, inner) if then > 0 else ({}, "the inner ends still move")
    critical = tuple(
        one
        for one in _critical(tiles)
        if any(lo <= one.lo and one.hi <= hi for lo, hi in outer.get(one.side, []))
    )
    ends = []
    for side, intervals in sorted(outer.items()):
        for owner, pair in enumerate(intervals):
            within = held.get((side, owner), (None, None))
            for which, x, inside in zip(("lo", "hi"), pair, within, strict=True):
                ends.append(ProvedEnd(side, which, x, inside, *_traced(images, outer, critical, side, x)))
    return ProvedEnds(tuple(ends), critical, (taken, then), tiles, reason)
