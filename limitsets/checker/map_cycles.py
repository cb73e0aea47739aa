"""Periodic orbits of a map: that they exist, differ and attract, and that cells lie where one attracts.

docs/certificates.md, "Certificates of any map": the claims `cycles` and `converges`.
"""

import functools
import itertools
import math
from typing import Any, NamedTuple

import numpy as np
from flint import arb, arb_mat

from .any_map import Map, Shape, possible
from .balls import ONE, ZERO, Arb, Pair, UnprovedError, about, floats_around, prove
from .file import hex_float, is_whole, read_box, read_side, require, rounded, rows, table
from .map_cells import MapCells

MOST_CYCLES, MOST_POINTS, MOST_TURNS = 1_000, 200, 2**53
WORST_MATRIX = 1e12  # condition of Newton's matrix, above which it is taken for singular
Boxes = list[list[Pair]]
Begins = list[list[float | None]]  # by side and axis where the domain begins, None along axes that end
Matrix = Any  # flint.arb_mat has no stubs


class Listed(NamedTuple):
    """A periodic orbit as a file lists it: of each of its points a box, side and branch."""

    boxes: Boxes
    side: list[int]
    branch: list[int]
    turns: list[list[int]]  # by point and axis: periods that are taken off the image, 0 where an axis ends
    attracts: bool
    frames: list[list[list[float]]]  # by point a matrix, [] where none is needed
    radius: float | None  # of the balls in these frames that the map contracts
    unstable: bool


def read_cycle(raw: object, shape: Shape, where: str) -> Listed:
    """Read one orbit."""
    keys = f"boxes side branch attracts frames radius{' turns' if shape.closes else ''}"
    known, d = table(raw, where, keys, "unstable"), shape.dimension
    boxes = [read_box(box, d, where) for box in rows(known["boxes"], where, 1, MOST_POINTS)]
    p = len(boxes)
    sides = [read_side(side, shape.sides) for side in rows(known["side"], where, p, p)]
    branches = rows(known["branch"], where, p, p)
    require(
        all(is_whole(b, 0, shape.branches - 1) for b in branches), f"{where}: a branch is not one of the map"
    )
    turns = rows(known["turns"], where, p, p) if shape.closes else [[0] * d] * p
    for side, along in zip([*sides[1:], sides[0]], turns, strict=True):
        most = [0 if period is None else MOST_TURNS for period in shape.periods[side]]
        fits = all(is_whole(k, -m, m) for k, m in zip(rows(along, where, d, d), most, strict=True))
        require(fits, f"{where}: turns are not whole numbers, 0 along axes that end")
    require(isinstance(known["attracts"], bool), f"{where}: attracts is neither true nor false")
    unstable = known.get("unstable", False)
    require(isinstance(unstable, bool), f"{where}: unstable is neither true nor false")
    radius = None if known["radius"] is None else hex_float(known["radius"], where)
    require(radius is None or radius > 0, f"{where}: its radius is not above 0")
    needed = known["attracts"] or radius is not None
    require((known["frames"] is not None) == needed, f"{where}: frames are missing, or not needed")
    frames = [
        [[hex_float(v, where) for v in rows(row, where, d, d)] for row in rows(frame, where, d, d)]
        for frame in (rows(known["frames"], where, p, p) if needed else [])
    ]
    return Listed(
        boxes,
        sides,
        branches,
        turns,
        attracts=known["attracts"],
        frames=frames,
        radius=radius,
        unstable=unstable,
    )


def read_begins(raw: object, shape: Shape, where: str) -> Begins:
    """Read where the domain begins along the axes that close."""
    d, begins = shape.dimension, []
    for along, periods in zip(rows(raw, where, shape.sides, shape.sides), shape.periods, strict=True):
        axes = list(zip(rows(along, where, d, d), periods, strict=True))
        fits = all((begin is None) is (period is None) for begin, period in axes)
        require(fits, f"{where}: begins has no numbers along the axes that close alone")
        begins.append([None if begin is None else hex_float(begin, where) for begin, _ in axes])
    return begins


def read_cycles(raw: object, shape: Shape, where: str) -> list[Listed]:
    """Read the orbits of a claim."""
    listed = enumerate(rows(raw, where, 1, MOST_CYCLES))
    return [read_cycle(one, shape, f"{where}, cycle {k}") for k, one in listed]


# ----------------------------------------------------------------
# Proving.


def matrix(entries: list[list[Any]]) -> Matrix:
    """Make a matrix of balls."""
    return arb_mat(len(entries), len(entries[0]), [v for row in entries for v in row])


def slopes_along(the_map: Map, listed: Listed, boxes: Boxes) -> list[list[list[Arb]]]:
    """Enclose the matrix of derivatives on each box of an orbit, whose sides and branches are proved."""
    slopes = []
    for k, (side, branch, box) in enumerate(zip(listed.side, listed.branch, boxes, strict=True)):
        piece = the_map.piece(box)
        leads = the_map.shape.to[side, branch] == listed.side[(k + 1) % len(boxes)]
        alone = leads and possible(the_map, side, piece)[0] == (branch,)
        prove(alone, f"side or branch of point {k} is not proved")
        gradients = the_map.image[side, branch].gradients(piece.balls)
        slopes.append([gradient[: the_map.dimension] for gradient in gradients])
    return slopes


class Cycle:
    """A periodic orbit of a file, for all parameters of a box; `prove` shows that one such orbit lies in its boxes."""

    def __init__(self, the_map: Map, listed: Listed, begins: Begins):
        self.map, self.listed, self.begins, self.period = the_map, listed, begins, len(listed.boxes)
        self.points: list[list[Arb]] = []  # where the points of the orbit lie
        self.frames = [matrix([[arb(v) for v in row] for row in frame]) for frame in listed.frames]
        self.inverses: list[Matrix] = []
        self.hulls: list[tuple[int, list[Pair]]] = []  # side and box around each ball

    def prove(self) -> None:
        """Prove existence, period and, where claimed, that it attracts or is unstable."""
        slopes = slopes_along(self.map, self.listed, self.listed.boxes)
        self.krawczyk(slopes)
        off = all(map(self.is_off_the_seams, self.listed.side, self.points))
        prove(off, "that its points lie in the domain, off the seam, is not proved")
        first = self.points[0]
        for k in range(1, self.period):
            again = self.period % k == 0 and self.listed.side[k] == self.listed.side[0]
            prove(not (again and meet(first, self.points[k])), f"that its period is not {k} is not proved")
        try:
            self.inverses = [frame.inv() for frame in self.frames]
        except ZeroDivisionError:
            raise UnprovedError("a frame is singular") from None
        attracts = not self.listed.attracts or math.prod(self.stretches(slopes), start=ONE) < 1
        prove(attracts, "that it attracts is not proved")
        unstable = not self.listed.unstable or self.has_multiplier_above_one(slopes)
        prove(unstable, "that it is unstable is not proved")

    def krawczyk(self, slopes: list[list[list[Arb]]]) -> None:
        """Prove that K(X), of all points together, lies in the interior of X, and store it."""
        d, boxes = self.map.dimension, self.listed.boxes
        after = [*self.listed.side[1:], self.listed.side[0]]
        turned = [
            k * period if period is not None else ZERO
            for side, turns in zip(after, self.listed.turns, strict=True)
            for k, period in zip(turns, self.map.periods[side], strict=True)
        ]
        entries = newton_image(self.map, (self.listed.side, self.listed.branch), boxes, slopes, turned)
        prove(bool(entries), "Newton's matrix is singular, or nearly so")
        inside = all(v > lo and v < hi for v, (lo, hi) in zip(entries, itertools.chain(*boxes), strict=True))
        prove(inside, "that K(X) lies in the interior of X is not proved")
        self.points = [entries[k * d : k * d + d] for k in range(self.period)]

    def is_off_the_seams(self, side: int, box: list[Arb]) -> bool:
        """Whether it is proved that the states of a box lie between both ends of each axis that closes.

        Then they are what the formulas are evaluated at, no two of them are one state, and states near them are theirs.
        """
        axes = zip(box, self.begins[side], self.map.periods[side], strict=True)
        return all(
            period is None or (v > arb(begin) and v < arb(begin) + period) for v, begin, period in axes
        )

    def stretches(self, slopes: list[list[list[Arb]]]) -> list[Arb]:
        """Bound |S_k+1^-1 DF_k S_k|_2, whose square is at most the largest row of the product with its transpose."""
        bounds = []
        for k, slope in enumerate(slopes):
            b = self.inverses[(k + 1) % self.period] * matrix(slope) * self.frames[k]
            sums = [sum(map(abs, row), ZERO) for row in (b.transpose() * b).tolist()]
            bounds.append(functools.reduce(arb.max, sums).upper().sqrt())  # the ball itself may reach below 0
        return bounds

    def has_multiplier_above_one(self, slopes: list[list[list[Arb]]]) -> bool:
        """Whether the product of all derivatives has an eigenvalue beyond the unit circle: two, or a real one."""
        one = matrix(np.eye(self.map.dimension).tolist())
        whole = functools.reduce(lambda product, slope: matrix(slope) * product, slopes, one)
        return bool(abs(whole.det()) > 1 or (one - whole).det() < 0 or (one + whole).det() < 0)

    def is_apart_from(self, other: "Cycle") -> bool:
        """Whether it is proved that two orbits differ; both are proved."""
        if self.period != other.period:
            return True
        begun = other.listed.side[0], other.points[0]
        return not any(
            side == begun[0] and meet(point, begun[1])
            for side, point in zip(self.listed.side, self.points, strict=True)
        )

    def contract(self) -> None:
        """Prove that the map contracts the balls |S_k^-1 (x - x_k)| < r around the orbit."""
        r, self.hulls = arb(self.listed.radius), []
        for side, point, frame in zip(self.listed.side, self.points, self.frames, strict=True):
            reach = [r * sum((v * v for v in row), ZERO).sqrt() for row in frame.tolist()]
            ball = [(v - far).union(v + far) for v, far in zip(point, reach, strict=True)]
            off = self.is_off_the_seams(side, ball)
            prove(off, "that its balls lie in the domain, off the seam, is not proved")
            self.hulls.append((side, [floats_around(v) for v in ball]))
        with about("that its balls are contracted is not proved"):
            slopes = slopes_along(self.map, self.listed, [hull for _, hull in self.hulls])
        contracts = all(stretch < 1 for stretch in self.stretches(slopes))
        prove(contracts, "that its balls are contracted is not proved")

    def check_drawn(self, c: MapCells, cells: list[int]) -> None:
        """Prove that some cells lie in these balls, by their corners."""
        for cell in cells:
            side, box = c.box(cell)
            if not any(self.holds(k, box) for k in range(self.period) if self.listed.side[k] == side):
                raise UnprovedError(f"{c.name(cell)}: that it lies in a ball of its cycle is not proved")

    def holds(self, k: int, box: list[Pair]) -> bool:
        """Whether all corners of a box, hence the box, are proved to lie in the k-th ball."""
        r = arb(self.listed.radius)
        for corner in itertools.product(*box):
            off = matrix([[arb(x) - v] for x, v in zip(corner, self.points[k], strict=True)])
            if not sum((v * v for v in (self.inverses[k] * off).entries()), ZERO) < r * r:
                return False
        return True

    def in_words(self) -> str:
        """Write period, place and kind."""
        where = " x ".join(interval_in_words(floats_around(v)) for v in self.points[0])
        side = f", side {self.listed.side[0]}" if self.map.shape.sides > 1 else ""
        kind = ", attracting" if self.listed.attracts else ", unstable" if self.listed.unstable else ""
        return f"period {self.period} in {where}{side}{kind}"


def newton_image(
    the_map: Map,
    word: tuple[list[int], list[int]],
    boxes: Boxes,
    slopes: list[list[list[Arb]]],
    turned: list[Arb] | None = None,
) -> list[Arb]:
    """Return K(X) of all points of an orbit together, along the sides and branches of a word; [] if none is found.

    With F_k = f(x_k) - x_k+1: K(X) = m - C F(m) + (1 - C DF(X)) (X - m) for the middle m and any matrix C.  `turned`:
    what is taken off all images, whole periods of axes that close.
    """
    p, d = len(boxes), the_map.dimension
    newton, residual = derivative_of_gaps(slopes), []
    near = np.array([[float(v.mid()) for v in row] for row in newton])
    if not np.isfinite(near).all() or not np.linalg.cond(near) < WORST_MATRIX:
        return []
    pieces = [the_map.piece(box) for box in boxes]
    middle = [ball.mid() for piece in pieces for ball in piece.balls[:d]]
    off = [ball - ball.mid() for piece in pieces for ball in piece.balls[:d]]
    for k, (side, branch, piece) in enumerate(zip(*word, pieces, strict=True)):
        images = the_map.image[side, branch].at(middle[k * d : k * d + d] + piece.balls[d:])
        after = (k + 1) % p * d
        residual += [[image - m] for image, m in zip(images, middle[after : after + d], strict=True)]
    if turned is not None:
        residual = [[gap - turn] for (gap,), turn in zip(residual, turned, strict=True)]
    c, one = matrix(np.linalg.inv(near).tolist()), matrix(np.eye(p * d).tolist())
    moved = (
        matrix([[v] for v in middle])
        - c * matrix(residual)
        + (one - c * matrix(newton)) * matrix([[v] for v in off])
    )
    entries: list[Arb] = moved.entries()
    return entries


def derivative_of_gaps(slopes: list[list[list[Arb]]]) -> list[list[Arb]]:
    """Return the matrix of derivatives of all f(x_k) - x_k+1 by all points."""
    d, size = len(slopes[0]), len(slopes) * len(slopes[0])
    derivative = []
    for k, slope in enumerate(slopes):
        for i, entries in enumerate(slope):
            row = [ZERO] * size
            row[k * d : k * d + d] = entries
            after = (k + 1) * d % size + i
            row[after] = row[after] - 1
            derivative.append(row)
    return derivative


def meet(one: list[Arb], other: list[Arb]) -> bool:
    """Whether two points may be the same."""
    return all(map(arb.overlaps, one, other))


def interval_in_words(ends: Pair) -> str:
    """Write an interval, rounded outward."""
    lo, hi = ends
    return f"[{rounded(lo, up=False, digits=6)}, {rounded(hi, up=True, digits=6)}]"
