"""A map that a file gives by its formulas, and what is proved of it on one cell.

docs/certificates.md, "Certificates of any map": the map in the header, the parameters of a box, and "One cell".
"""

import functools
import itertools
import math
import operator
import re
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from flint import arb

from .balls import ZERO, Arb, Pair, floats_around
from .cells import Failure
from .file import is_whole, plain, read_side, require, rows, table
from .program import Formulas, Program, in_words, named, number, rational, read_formulas

MOST_PIECES_OF_CELL = 4_000  # of one cell: a certificate that needs more is refused
NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.]{0,40}")

# ----------------------------------------------------------------
# The map of a file.


class Shape(NamedTuple):
    """A map as its file has it: read, and not yet for certain parameters."""

    dimension: int
    sides: int
    branches: int
    names: list[str]  # of the parameters
    images: dict[tuple[int, int], Formulas]  # by side and branch
    to: dict[tuple[int, int], int]  # the side that they lead to
    margins: list[Formulas]  # by side, where there are two branches
    periods: list[list[str | None]]  # by side and axis a period, None where the axis ends

    @property
    def closes(self) -> bool:
        """Whether some axis has a period."""
        return any(period is not None for axes in self.periods for period in axes)


def read_map(raw: object) -> Shape:
    """Read the map of a header."""
    known = table(raw, "map", "dimension sides branches parameters programs margins periodic")
    for word, most in (("dimension", 3), ("sides", 64), ("branches", 2)):
        require(is_whole(known[word], 1, most), f"map: {word} is not a whole number from 1 to {most}")
    dimension, sides, branches = known["dimension"], known["sides"], known["branches"]
    names = rows(known["parameters"], "map: parameters", 0, 1_000)
    fine = all(isinstance(name, str) and NAME.fullmatch(name) for name in names)
    require(fine and len(set(names)) == len(names), "map: the name of a parameter is odd, or stands twice")
    where = "map: periodic"
    periods = [
        rows(axes, where, dimension, dimension) for axes in rows(known["periodic"], where, sides, sides)
    ]
    for period in itertools.chain(*periods):
        fits = period is None or (
            isinstance(period, str) and (period == "tau" or rational(period, where) > 0)
        )
        require(fits, f"{where}: a period is neither null nor above 0")
    keys = list(itertools.product(range(sides), range(branches)))
    images, to = {}, {}
    for key, one in zip(keys, rows(known["programs"], "map: programs", len(keys), len(keys)), strict=True):
        where = "the program of side {}, branch {}".format(*key)
        table(one, where, "side branch to ops out")
        own = is_whole(one["side"], key[0], key[0]) and is_whole(one["branch"], key[1], key[1])
        require(own, f"{where} is missing, or not in its place")
        images[key] = read_formulas(one, dimension, names, dimension, where)
        to[key] = read_side(one["to"], sides)
    margins, count = [], sides if branches == 2 else 0
    for side, one in enumerate(rows(known["margins"], "map: margins", count, count)):
        where = f"the margin of side {side}"
        table(one, where, "side ops out")
        require(is_whole(one["side"], side, side), f"{where} is missing, or not in its place")
        margins.append(read_formulas(one, dimension, names, 1, where))
    return Shape(dimension, sides, branches, names, images=images, to=to, margins=margins, periods=periods)


def period_of(text: str | None) -> Arb | None:
    """Enclose a period; None where there is none."""
    return None if text is None else 2 * arb.pi() if text == "tau" else number(text, "a period")


def map_in_words(shape: Shape, firsts: list[list[float | None]] | None = None) -> Iterator[str]:
    """Write the formulas that are checked; `firsts`: by side and axis where the domain begins, for axes that close."""
    for (side, branch), formulas in shape.images.items():
        to = shape.to[side, branch]
        yield f"side {side}, branch {branch}, to side {to}:"
        yield from ("    " + line for line in in_words(formulas, [f"x{i}'" for i in range(shape.dimension)]))
        for axis, period in enumerate(shape.periods[to]):
            if period is not None:
                first = "e" if firsts is None else repr(firsts[to][axis])
                yield f"    x{axis}' modulo {period}, in [{first}, {first} + {period})"
    for side, formulas in enumerate(shape.margins):
        yield f"side {side}: branch 1 if and only if margin > 0, else branch 0"
        yield from ("    " + line for line in in_words(formulas, ["margin"]))
    if shape.margins:
        yield "the proof is of these formulas, not of the function image"


def read_parameters(raw: object, names: list[str], where: str) -> dict[str, tuple[str, str]]:
    """Read the parameters of a box: their two ends as texts, the same text where there is no range."""
    given = table(raw, where, " ".join(names))
    texts = {}
    for name in names:
        value = given[name]
        pair = rows(value, f"{where}: a range", 2, 2) if isinstance(value, list) else [value, value]
        lo, hi = (rational(text, f"{where}: {plain(name)}") for text in pair)
        require(lo < hi or not isinstance(value, list), f"{where}: the range of {plain(name)} is empty")
        texts[name] = (pair[0], pair[1])
    return texts


def parameter_in_words(name: str, ends: tuple[str, str]) -> str:
    """Write the value or the range of a parameter."""
    lo, hi = ends
    return f"{named(name)} = {lo}" if lo == hi else f"{named(name)} in [{lo}, {hi}]"


class Map:
    """A map for one box of parameters."""

    def __init__(self, shape: Shape, parameters: dict[str, tuple[str, str]]):
        self.shape, self.dimension, self.parameters = shape, shape.dimension, parameters
        self.periods = [[period_of(text) for text in axes] for axes in shape.periods]  # by side and axis
        values = {n: number(lo, n).union(number(hi, n)) for n, (lo, hi) in parameters.items()}
        self.wide = wide = [name for name, (lo, hi) in parameters.items() if lo != hi]
        self.ranges = [floats_around(values[name]) for name in wide]
        self.program_of = functools.partial(Program, dimension=self.dimension, values=values, wide=wide)
        self.image = {key: self.program_of(f) for key, f in shape.images.items()}
        self.margin = [self.program_of(f) for f in shape.margins]

    def piece(self, box: list[Pair]) -> "CellPiece":
        """Return the piece of all x in a box and all parameters."""
        return CellPiece([*box, *self.ranges])


# ----------------------------------------------------------------
# One cell.

Relation = Callable[[Any, Any], Any]
Bound = tuple[
    int, Relation, Arb
]  # result, relation, end: the result has to stand in this relation to the end
AT_MOST: list[Bound] = [(0, operator.le, ZERO)]
ABOVE: list[Bound] = [(0, operator.gt, ZERO)]


class CellPiece:
    """All x and all parameters with a range in a box, closed."""

    def __init__(self, box: list[Pair]):
        self.box = box
        self.balls = [arb(lo).union(arb(hi)) for lo, hi in box]

    def corner(self, slopes: list[Arb], upper: bool) -> list[Arb]:
        """Put every number by which a result rises or falls at the end where the result is largest, or least."""
        return [
            arb(hi if upper else lo) if slope >= 0 else arb(lo if upper else hi) if slope <= 0 else ball
            for slope, (lo, hi), ball in zip(slopes, self.box, self.balls, strict=True)
        ]

    def halves(self, slopes: list[Arb]) -> list["CellPiece"]:
        """Halve along the number that moves a result most; [] where no float lies between its ends."""
        widths = [
            (float(abs(slope).upper()) if slope.is_finite() else math.inf, hi - lo)
            for slope, (lo, hi) in zip(slopes, self.box, strict=True)
        ]
        j = max(
            range(len(widths)),
            key=lambda k: (widths[k][0] * widths[k][1] if widths[k][1] > 0 else 0.0, widths[k][1]),
        )
        lo, hi = self.box[j]
        middle = 0.5 * lo + 0.5 * hi
        if not lo < middle < hi:
            return []
        return [CellPiece([*self.box[:j], half, *self.box[j + 1 :]]) for half in ((lo, middle), (middle, hi))]


def slopes_unless(program: Program, piece: CellPiece, bounds: list[Bound]) -> list[Arb] | None:
    """Return None if all bounds are proved on a piece, else the gradient of a result whose bound is not.

    Three enclosures are tried: operation by operation; by the mean value theorem; with every number by which the result
    rises or falls at its end.
    """
    results = program.at(piece.balls)
    left = [bound for bound in bounds if not bound[1](results[bound[0]], bound[2])]
    if not left:
        return None
    middle = [ball.mid() for ball in piece.balls]  # exact, and in the ball: the gradients hold between them
    off = [ball - m for ball, m in zip(piece.balls, middle, strict=True)]
    at_middle, gradients = program.at(middle), program.gradients(piece.balls)
    for k, relation, end in left:
        slopes = gradients[k]
        mean = sum((g * d for g, d in zip(slopes, off, strict=True)), at_middle[k])
        if relation(mean, end):
            continue
        corner = piece.corner(slopes, upper=relation in (operator.le, operator.lt))
        if not relation(program.at(corner)[k], end):
            return slopes
    return None


def possible(the_map: Map, side: int, piece: CellPiece) -> tuple[tuple[int, ...], list[Arb] | None]:
    """Return the branches that are not excluded on a piece, and where both are the gradient of the margin."""
    if not the_map.margin:
        return (0,), None
    if slopes_unless(the_map.margin[side], piece, AT_MOST) is None:
        return (0,), None
    slopes = slopes_unless(the_map.margin[side], piece, ABOVE)
    return ((1,), None) if slopes is None else ((0, 1), slopes)


class CellClaim(NamedTuple):
    """What is claimed of one cell: by branch the bounds of its image, None where the branch is impossible."""

    side: int
    box: list[Pair]
    bounds: list[list[Bound] | None]
    least: Arb | None  # of the size of the slope


def check_map_cell(the_map: Map, claimed: CellClaim) -> tuple[Failure | None, int]:
    """Prove what is claimed of a cell, for all parameters; the failure or None, and the number of pieces."""
    stack, pieces = [the_map.piece(claimed.box)], 0
    while stack:
        piece = stack.pop()
        pieces += 1
        failure, slopes = check_piece(the_map, claimed, piece)
        if failure is None:
            continue
        halves = [] if slopes is None else piece.halves(slopes)
        if not halves or pieces + len(stack) > MOST_PIECES_OF_CELL:
            return failure, pieces
        stack += halves
    return None, pieces


def check_piece(
    the_map: Map, claimed: CellClaim, piece: CellPiece
) -> tuple[Failure | None, list[Arb] | None]:
    """Check a piece of a cell; where that fails also a gradient, which tells where to halve."""
    branches, of_margin = possible(the_map, claimed.side, piece)
    for branch in branches:
        bounds = claimed.bounds[branch]
        if bounds is None:
            return Failure("exclusion", f"branch {branch} is not excluded"), of_margin
        program = the_map.image[claimed.side, branch]
        slopes = slopes_unless(program, piece, bounds)
        if slopes is not None:
            return Failure(
                "image", f"the image on branch {branch} is not proved to lie in its target cells"
            ), slopes
        if claimed.least is not None:
            slopes = program.gradients(piece.balls)[0]
            if not abs(slopes[0]) >= claimed.least:
                return Failure("slope", f"the slope on branch {branch} is not proved"), slopes
    return None, None
