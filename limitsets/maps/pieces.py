"""Monotone pieces: a one-dimensional map cut at switching points, turning points and jumps.

On a piece the map is a monotone function of x.  The image of an interval of it is then known from the two ends, and
one symbol names what an orbit does there: limit sets by end points and cycles by itinerary stand on these cuts.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from limitsets.arguments import arguments_checked
from limitsets.errors import AnswerError
from limitsets.maps.bisection import Array, Flags, bisected, hidden, inserted, located, sign_code
from limitsets.maps.contract import has_slope, kind_of
from limitsets.maps.critical import SAMPLES, Sides, branches_of_side, require_domain
from limitsets.maps.forced import along

# A step this large between adjacent floats is a jump; the root of a grazing throw moves by the root of an ulp.
JUMP = 2.0**-18


class TurningPoint(NamedTuple):
    """A point inside a branch where its slope changes sign.

    Attributes
    ----------
    x : float
        The point.
    branch : int
        The branch.
    """

    x: float
    branch: int


class Piece(NamedTuple):
    """A range of x on which a map stays on one branch and is monotone.

    Attributes
    ----------
    lo, hi : float
        First and last floating-point number of the piece.
    branch : int
        The branch.
    below, above : str
        What ends it: "critical", "turning", "jump" (of the image, inside the branch), "exit" (no branch beyond) or
        "domain".
    """

    lo: float
    hi: float
    branch: int
    below: str
    above: str


class _Branch(NamedTuple):
    """One branch of one side, as a function of x."""

    params: Any
    side: int
    number: int

    def image(self, x: Array) -> Array:
        return along(self.params, x, self.side, [self.number])[0]

    def slope(self, x: Array) -> Array:
        return along(self.params, x, self.side, [self.number])[2]


def _jumps(branch: _Branch, x: Array) -> Array:
    """Both floats at each jump of the image: where it moves otherwise than the slopes at two samples let expect."""
    y, slope, step = branch.image(x), branch.slope(x), np.diff(x)
    off = np.abs(np.diff(y) - 0.5 * (slope[1:] + slope[:-1]) * step)
    usual = (np.abs(np.diff(slope)) + 0.01 * np.abs(slope[1:])) * step + JUMP * JUMP * np.abs(y[1:])
    k = np.flatnonzero(off > usual)

    def larger_above(lo: Array, middle: Array, hi: Array) -> Flags:
        y_lo, y_mid, y_hi = (branch.image(at) for at in (lo, middle, hi))
        flags: Flags = np.abs(y_mid - y_lo) <= np.abs(y_hi - y_mid)
        return flags

    lo, hi = bisected(x[k], x[k + 1], larger_above)
    y_lo, y_hi = branch.image(lo), branch.image(hi)
    real = np.abs(y_hi - y_lo) > JUMP * np.maximum(1.0, np.abs(y_lo))
    return np.concatenate([lo[real], hi[real]])


def _monotone_parts(branch: _Branch, x: Array) -> tuple[list[Array], list[str]]:
    """Cut the samples of one branch where its slope changes sign or its image jumps: parts, and what each cut is."""
    jumps = _jumps(branch, x)
    x = inserted(inserted(x, jumps), hidden(branch.slope, x))
    x, rising = located(lambda at: sign_code(branch.slope(at)), x)
    turns = np.flatnonzero(np.diff(rising)) + 1
    adjacent = np.nextafter(x[:-1], np.inf) == x[1:]
    steps = np.flatnonzero(np.isin(x[:-1], jumps) & np.isin(x[1:], jumps) & adjacent) + 1
    cuts = np.union1d(turns, steps)
    return np.split(x, cuts), ["jump" if cut in steps else "turning" for cut in cuts]


def _pieces_of_side(params: Any, domain: Sides, side: int, samples: int) -> tuple[Piece, ...]:
    """Cut one side at its changes of branch, then every branch."""
    x, code = branches_of_side(params, domain, side, samples)
    if not x.size:
        return ()
    changes = np.flatnonzero(np.diff(code)) + 1
    runs = np.split(x, changes)
    branches = code[np.concatenate([[0], changes])].tolist()
    between = ["critical" if min(pair) >= 0 else "exit" for pair in pairwise(branches)]
    borders = pairwise(["domain", *between, "domain"])
    pieces: list[Piece] = []
    for run, branch, (below, above) in zip(runs, branches, borders, strict=True):
        if branch < 0:
            continue
        parts, cuts = _monotone_parts(_Branch(params, side, branch), run)
        ends = pairwise([below, *cuts, above])
        pieces += [
            Piece(float(part[0]), float(part[-1]), branch, *pair)
            for part, pair in zip(parts, ends, strict=True)
        ]
    return tuple(pieces)


@arguments_checked
def monotone_pieces(params: Any, domain: Sides, *, samples: int = SAMPLES) -> dict[int, tuple[Piece, ...]]:
    """Cut a domain into pieces on which a map stays on one branch and is monotone.

    Parameters
    ----------
    params : NamedTuple
        A one-dimensional map with `image_on`.
    domain : Domain
        What to cut.
    samples : int
        As for `critical_points`.

    Returns
    -------
    dict of int to tuple of Piece
        Per side, ascending.  Where the map has no branch (it leaves, or there is no image) there is no piece.

    Raises
    ------
    AnswerError
        For a map of two or three dimensions, or one without `image_on`.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.cells import as_domain
    >>> pieces = maps.monotone_pieces(maps.Logistic(4.0), as_domain([(0, 1)]))
    >>> [(piece.below, piece.above) for piece in pieces[0]]
    [('domain', 'critical'), ('critical', 'domain')]
    """
    require_domain(params, domain, samples)
    if not has_slope(params):
        name = kind_of(params).name
        raise AnswerError(
            "the map", name, "a map with image_on", "register image_on: one step on a forced branch"
        )
    return {side: _pieces_of_side(params, domain, side, samples) for side in range(domain.sides)}


@arguments_checked
def turning_points(
    params: Any, domain: Sides, *, samples: int = SAMPLES
) -> dict[int, tuple[TurningPoint, ...]]:
    """Find every x at which the slope of the branch in force changes sign.

    Parameters
    ----------
    params : NamedTuple
        A map in one dimension.
    domain : Sides
        Where to look, as for `monotone_pieces`.
    samples : int
        Number of samples on each side.

    Returns
    -------
    dict of int to tuple of TurningPoint
        By side, ascending.

    Examples
    --------
    >>> import limitsets as ls
    >>> scene = ls.load("paper-designed").with_values({"throw.kappa": 4.0})  # a throw far too fast for this part
    >>> [round(point.x, 4) for point in ls.maps.turning_points(scene.map, scene.domain)[0]]
    [3.9807, 9.6215]
    """
    return {
        side: tuple(TurningPoint(piece.lo, piece.branch) for piece in pieces if piece.below == "turning")
        for side, pieces in monotone_pieces(params, domain, samples=samples).items()
    }
