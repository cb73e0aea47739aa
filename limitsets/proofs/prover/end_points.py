"""End points of the limit set, each between two proved numbers, from images rounded outward and inward.

The limit set is the intersection L of N, F(N), F(F(N)), ..., where N are the attracting cells, which F maps into
themselves, and F is read with both one-sided limits where the decision between jog and flip changes.

*Outer.*  A(0) = N, A(n + 1) = F(A(n)) & A(n), every image rounded outward.  Each A(n) holds F^n(N), and so L.  The ends
are doubles that only move inward; they come to rest after finitely many images, at A.

*Inner.*  B(0) = A, B(n + 1) = F(B(n)) & B(n), every image rounded inward: of an interval on which one branch is proved,
where the map is therefore continuous, all between the images of two points is covered (intermediate values); the
bracket of a critical point, where no branch is proved, gives nothing.  At rest B lies in F(B).  Then B lies in F(B), in
F(F(B)), ... and, B being part of N, in every F^n(N): **B lies in L.**

This takes the place of an argument by expansion ("every interval grows until it covers the critical point").  An end is
the image, along some itinerary, of a one-sided limit at a critical point c.  It is reached because B holds
the proper side of c up to its bracket, and every point of B, on both sides of c and around every other critical point
that is kept, is again the image of a point of B.  So the proof needs no statement about recurrent orbits or about one
critical point reaching another, and no slope.  All preimages are decided starts: the value of the map at a critical
point itself does not matter.  The proof does not claim that one orbit is dense in L.

Where the map contracts, inward rounding makes B empty: the inner ends are then None, and `orbits.py` describes L there.
 With noise, both sets hold for every sequence of throws.

Checked by machine: branches and signs of slopes on tiles of N, images of tile ends, and the exact
comparison of B with its image.  Source: docs/model.md, limit sets.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from limitsets.base.arrays import Array
from limitsets.feeder.thrower.params import gather_box
from limitsets.feeder.thrower.throw_box import BOTH, NOTHING, throw_box
from limitsets.numbers.interval import Interval
from limitsets.numbers.jit import proof_kernel
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.parameters import ParameterBox
from limitsets.systems.maps import codes

# ----------------------------------------------------------------
# Images of unions of intervals, rounded outward or inward, from pieces on which branch or slope are proved.
#
# A tile is a part of the attracting cells on which the branch, the sign of the slope, or both are proved (throws of
# boxes).  Where the map is monotone on a tile, the images of two points (throws of points) span that of all between
# them.  Where one branch is proved it is continuous, a throw being proved only where the impact is the one root there
# is, so that the image of an interval covers all between the images of two of its points.  Undecided or bent tiles are
# halved down to the rounding error, which brackets critical and turning points.
#
# Brackets and images are widened slightly (inward images narrowed), so that other arithmetic of about the same accuracy
# can confirm the claims that rest on them.


Pair = tuple[float, float]
Intervals = dict[int, list[Pair]]

UNDECIDED = (BOTH, NOTHING)

# Tiles are halved down to this width relative to x, and no further than to so many of one side at a time.
FLOOR, MOST_TILES = 2.0**-47, 1024

MOST_IMAGES = 20_000

# Undecided and bent tiles grow by this share of their width at either end; images move by this share of x.
WIDER, SLACK = 2.0**-4, 2.0**-48


# ---------------------------------------------------------------- tiles


class ProvedPiece(NamedTuple):
    """A part of N with one answer: the branch (`BOTH` if not proved), the sign of the slope (0 if not proved)."""

    lo: float
    hi: float
    branch: int
    sign: int


@proof_kernel(entry=True)
def _judge(lo_map: Any, hi_map: Any, side: int, lo: Any, hi: Any, branch: Any, sign: Any) -> None:
    b = gather_box(lo_map, hi_map, side)
    for k in range(lo.size):
        state, _, _, slope, _ = throw_box(b, Interval(lo[k], hi[k]))
        branch[k] = state
        sign[k] = 1 if slope.lo > 0.0 else (-1 if slope.hi < 0.0 else 0)
        sign[k] = 0 if state == NOTHING else sign[k]


def proved_pieces_of(box: ParameterBox, side: int, lo: Array, hi: Array) -> list[ProvedPiece]:
    """Tile the given cells of one side, finely only where the branch changes or the slope has no sign."""
    done: list[ProvedPiece] = []
    while lo.size:
        branch, sign = np.empty(lo.size, np.int64), np.empty(lo.size, np.int64)
        _judge(box.lo, box.hi, side, lo, hi, branch, sign)
        middle = lo + 0.5 * (hi - lo)
        wide = (hi - lo > FLOOR * np.abs(hi)) & (lo < middle) & (middle < hi)
        open_ = (np.isin(branch, UNDECIDED) | (sign == 0)) & wide
        if int(open_.sum()) > MOST_TILES:
            open_[:] = False
        done += map(ProvedPiece, *(part[~open_].tolist() for part in (lo, hi, branch, sign)))
        lo, hi = np.append(lo[open_], middle[open_]), np.append(middle[open_], hi[open_])
    return _widened(_merged_tiles(sorted(done)))


def _merged_tiles(tiles: Iterable[ProvedPiece]) -> list[ProvedPiece]:
    """Join neighbours of one branch and one proved sign."""
    merged: list[ProvedPiece] = []
    for piece in tiles:
        last = merged[-1] if merged else None
        if last and last.hi == piece.lo and last.sign == piece.sign != 0 and last.branch == piece.branch:
            merged[-1] = last._replace(hi=piece.hi)
        else:
            merged.append(piece)
    return merged


def _widened(tiles: list[ProvedPiece]) -> list[ProvedPiece]:
    """Extend undecided tiles slightly into their decided neighbours."""
    wide = list(tiles)
    for k, piece in enumerate(tiles):
        more = WIDER * (piece.hi - piece.lo)
        if k and _knows_more(tiles[k - 1], piece, more):
            border = piece.lo - more
            wide[k - 1], wide[k] = wide[k - 1]._replace(hi=border), wide[k]._replace(lo=border)
        if k + 1 < len(tiles) and _knows_more(tiles[k + 1], piece, more):
            border = piece.hi + more
            wide[k], wide[k + 1] = wide[k]._replace(hi=border), wide[k + 1]._replace(lo=border)
    return wide


def _knows_more(known: ProvedPiece, piece: ProvedPiece, more: float) -> bool:
    """Whether `piece`, grown by `more` into its neighbour `known`, still says nothing that is not proved."""
    weak = piece.branch in UNDECIDED or piece.sign == 0
    strong = known.branch not in UNDECIDED and known.sign != 0
    true = (piece.branch in (known.branch, *UNDECIDED)) and piece.sign in (known.sign, 0)
    touches = piece.lo == known.hi or piece.hi == known.lo
    return weak and strong and true and touches and known.hi - known.lo > 4.0 * more


# ---------------------------------------------------------------- images of unions of intervals


@proof_kernel(entry=True)
def _images(lo_map: Any, hi_map: Any, side: Any, lo: Any, hi: Any, out: Any) -> None:
    """Images of lo, of hi, and of all between; rows 0 to 5 by a jog, 6 to 11 by a flip."""
    for k in range(lo.size):
        b = gather_box(lo_map, hi_map, side[k])
        for j in range(3):
            first = hi[k] if j == 1 else lo[k]
            last = lo[k] if j == 0 else hi[k]
            state, jog, _, _, _ = throw_box(b, Interval(first, last))
            flip = jog - b.shift
            good = state != NOTHING
            out[2 * j, k], out[2 * j + 1, k] = jog.lo if good else -np.inf, jog.hi if good else np.inf
            out[6 + 2 * j, k], out[7 + 2 * j, k] = flip.lo if good else -np.inf, flip.hi if good else np.inf


class PieceImage(NamedTuple):
    """What of interval number `owner` of a side lies on one tile, and the image by one of the tile's branches."""

    side: int
    owner: int
    piece: ProvedPiece
    lo: float
    hi: float
    branch: int
    to: int
    at_lo: Pair
    at_hi: Pair
    whole: Pair


def union_of(intervals: Iterable[Pair]) -> list[Pair]:
    """Union of closed intervals, ascending."""
    union: list[Pair] = []
    for lo, hi in sorted(intervals):
        if union and lo <= union[-1][1]:
            union[-1] = (union[-1][0], max(union[-1][1], hi))
        else:
            union.append((lo, hi))
    return union


def _both_of(one: Intervals, other: Intervals) -> Intervals:
    """Intersection of two unions."""
    common: Intervals = {}
    for side, intervals in one.items():
        parts = [(max(a, c), min(b, d)) for a, b in intervals for c, d in other.get(side, [])]
        kept = union_of(part for part in parts if part[0] <= part[1])
        if kept:
            common[side] = kept
    return common


@dataclass(frozen=True, eq=False)
class UnionImages:
    """Images of unions of intervals inside the tiled set."""

    box: ParameterBox
    tiles: dict[int, list[ProvedPiece]]

    def parts(self, union: Intervals) -> list[PieceImage]:
        """Cut a union at the borders of the tiles, and throw every part."""
        cuts = [
            (side, owner, piece, max(lo, piece.lo), min(hi, piece.hi))
            for side, intervals in union.items()
            for owner, (lo, hi) in enumerate(intervals)
            for piece in self.tiles[side]
            if piece.lo <= hi and piece.hi >= lo
        ]
        side = np.array([cut[0] for cut in cuts], dtype=np.int64)
        lo, hi = np.array([cut[3] for cut in cuts]), np.array([cut[4] for cut in cuts])
        out = np.empty((12, lo.size))
        _images(self.box.lo, self.box.hi, side, lo, hi, out)
        parts = []
        for cut, row in zip(cuts, out.T.tolist(), strict=True):
            piece = cut[2]
            for branch in (codes.JOG, codes.FLIP) if piece.branch in UNDECIDED else (piece.branch,):
                to = (cut[0] + branch) % self.box.lo.a.size
                pairs = [(row[k], row[k + 1]) for k in range(6 * branch, 6 * branch + 6, 2)]
                parts.append(PieceImage(*cut, branch, to, *pairs))
        return parts

    def outward(self, union: Intervals) -> Intervals:
        """Return a superset of F(union)."""
        images: Intervals = {}
        for part in self.parts(union):
            ends = (part.at_lo, part.at_hi) if part.piece.sign else (part.whole,)
            lo, hi = min(end[0] for end in ends), max(end[1] for end in ends)
            images.setdefault(part.to, []).append((lo - SLACK * abs(lo), hi + SLACK * abs(hi)))
        return {side: union_of(intervals) for side, intervals in images.items()}

    def inward(self, union: Intervals) -> Intervals:
        """Return a subset of F(union), from decided starts only."""
        images: Intervals = {}
        for run in _runs(self.parts(union)):
            ends = [end for part in run for end in (part.at_lo, part.at_hi)]
            lo, hi = min(end[1] for end in ends), max(end[0] for end in ends)
            lo, hi = lo + SLACK * abs(lo), hi - SLACK * abs(hi)
            if lo <= hi:
                images.setdefault(run[0].to, []).append((lo, hi))
        return {side: union_of(intervals) for side, intervals in images.items()}


def _runs(parts: list[PieceImage]) -> list[list[PieceImage]]:
    """Decided parts of one interval that follow one another on one branch: the map is continuous on their union."""
    runs: list[list[PieceImage]] = []
    for part in (each for each in parts if each.piece.branch in (codes.JOG, codes.FLIP)):
        last = runs[-1][-1] if runs else None
        here = (part.side, part.owner, part.branch, part.lo)
        if last and (last.side, last.owner, last.branch, last.hi) == here:
            runs[-1].append(part)
        else:
            runs.append([part])
    return runs


def at_rest(image: Callable[[Intervals], Intervals], union: Intervals) -> tuple[Intervals, int]:
    """Intersect with the image until nothing moves; the number of images, or -1 if it still does."""
    for count in range(1, MOST_IMAGES):
        smaller = _both_of(image(union), union)
        if smaller == union:
            return union, count
        union = smaller
    return union, -1


# ----------------------------------------------------------------
# End points of the limit set, each between two proved numbers, outer and inner.


class ProvedEnd(NamedTuple):
    """One end of one interval of the limit set.

    Attributes
    ----------
    side, which : int, str
        Its side, and "lo" or "hi".
    outer, inner : float, float or None
        Nothing of the limit set lies beyond `outer`; all from `inner` to the other end's `inner` belongs to it.
    """

    side: int
    which: str
    outer: float
    inner: float | None


@dataclass(frozen=True, eq=False)
class ProvedEnds:
    """A limit set between two unions of intervals.

    Attributes
    ----------
    ends : tuple of ProvedEnd
        By side, ascending.
    images : (int, int)
        Images taken for the outer and the inner set.
    tiles : dict of int to list of ProvedPiece
        By side, what was proved of the throws from the attracting cells.
    reason : str
        Why inner ends are missing; empty if none is.
    """

    ends: tuple[ProvedEnd, ...]
    images: tuple[int, int]
    tiles: dict[int, list[ProvedPiece]]
    reason: str

    @property
    def extents(self) -> dict[int, list[tuple[tuple[float, float | None], tuple[float | None, float]]]]:
        """Per side ``((lo_outer, lo_inner), (hi_inner, hi_outer))`` of every interval."""
        intervals: dict[int, list[tuple[tuple[float, float | None], tuple[float | None, float]]]] = {}
        for lo, hi in zip(self.ends[::2], self.ends[1::2], strict=True):
            intervals.setdefault(lo.side, []).append(((lo.outer, lo.inner), (hi.inner, hi.outer)))
        return intervals

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


def proved_ends(attraction: Attraction) -> ProvedEnds:
    """Bracket the ends of the limit set.

    Parameters
    ----------
    attraction : Attraction
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
    >>> from limitsets.proofs.prover.attraction import attraction
    >>> from limitsets.proofs.prover.cover import cover
    >>> from limitsets.proofs.prover.parameters import parameter_box
    >>> ends = proved_ends(attraction(cover(parameter_box(ls.load("paper-designed")), 2048)))
    >>> [(round(lo, 9), round(hi, 9)) for (lo, _), (_, hi) in ends.extents[0]], ends.width < 1e-9
    ([(15.205338826, 19.752688015)], True)
    """
    grid, box = attraction.cover.grid, attraction.cover.box
    tiles: dict[int, list[ProvedPiece]] = {}
    for side, (edges,) in enumerate(grid.edges):
        mine = np.flatnonzero(attraction.component[grid.of_side(side)] >= 0)
        tiles[side] = proved_pieces_of(box, side, edges[mine], edges[mine + 1])
    images = UnionImages(box, tiles)
    cells = {side: union_of((piece.lo, piece.hi) for piece in row) for side, row in tiles.items() if row}
    if not cells:
        return ProvedEnds((), (0, 0), {}, "there are no attracting cells")
    outer, taken = at_rest(images.outward, cells)
    inner, then = at_rest(images.inward, outer)
    held, reason = _inner_ends(outer, inner) if then > 0 else ({}, "the inner ends still move")
    ends = [
        ProvedEnd(side, which, x, inside)
        for side, intervals in sorted(outer.items())
        for owner, pair in enumerate(intervals)
        for which, x, inside in zip(("lo", "hi"), pair, held.get((side, owner), (None, None)), strict=True)
    ]
    return ProvedEnds(tuple(ends), (taken, then), tiles, reason)
