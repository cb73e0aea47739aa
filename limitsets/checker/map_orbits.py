"""That the listed orbits are all of their periods in a domain: the claim `all-cycles`.

docs/certificates.md, "Certificates of any map".  A tube has a box for each of the points x_0 .. x_p-1 of an orbit, and
the side and branch of each.  At every moment the tubes hold all orbits of the period whose points lie in the domain,
each from the point with the least first coordinate on.
"""

import itertools
from collections.abc import Iterator
from typing import Any, NamedTuple

from flint import arb

from .any_map import Map, Shape, possible
from .balls import Pair, UnprovedError, about, floats_around, prove
from .file import read_box, read_side, require, rows, table, whole_number
from .map_cycles import MOST_POINTS, Boxes, Cycle, newton_image

MOST_TUBES = 500_000  # of one period: a certificate that needs more is refused
OPEN = -1  # a side or a branch that is not known yet
ROUNDS = 2  # of narrowing, before a tube is cut
WIDER, BY_SIZE = 2.0**-4, 2.0**-44  # what W is wider than its tube: of the width, and of the size
TWO_WAYS, LEAST = (
    2.0**-6,
    2.0**-36,
)  # shares of the domain, below which two branches are both taken; a tube is given up


class Every(NamedTuple):
    """The claim: the orbits of periods up to `period` in the domain, a box on each side, are the listed ones."""

    period: int
    domain: Boxes


class Tube(NamedTuple):
    """Boxes that hold the points of an orbit, their sides and branches."""

    boxes: Boxes
    side: list[int]
    branch: list[int]


def read_every(section: dict[str, Any], shape: Shape, where: str) -> Every:
    """Read the claim."""
    what = f"{where}: the period of all-cycles is not a whole number of 1 to {MOST_POINTS}"
    period = whole_number(section["period"], 1, MOST_POINTS, what)
    listed = [
        table(one, f"{where}: domain", "side box")
        for one in rows(section["domain"], f"{where}: domain", shape.sides, shape.sides)
    ]
    ordered = [read_side(one["side"], shape.sides) for one in listed] == list(range(shape.sides))
    require(ordered, f"{where}: the domain of all-cycles has not one box on each side, in order")
    return Every(period, [read_box(one["box"], shape.dimension, where) for one in listed])


def check_every(the_map: Map, every: Every, cycles: list[Cycle]) -> None:
    """Prove that proved cycles are all."""
    for k, cycle in enumerate(cycles):
        prove(cycle.period <= every.period, f"cycle {k} has a longer period than all-cycles is about")
        for side, point in zip(cycle.listed.side, cycle.points, strict=True):
            pairs = zip(point, every.domain[side], strict=True)
            inside = all(v >= lo and v <= hi for v, (lo, hi) in pairs)
            prove(inside, f"that cycle {k} lies in the domain is not proved")
    # an orbit of period q is one of each multiple of q
    for period in range(every.period // 2 + 1, every.period + 1):
        with about(f"period {period}"):
            check_period(the_map, every.domain, period, cycles)


def check_period(the_map: Map, domain: Boxes, period: int, cycles: list[Cycle]) -> None:
    """Prove that every orbit of F^period = x in the domain is a listed one."""
    stack, tried = [], 0
    hull = [(min(lo for lo, _ in along), max(hi for _, hi in along)) for along in zip(*domain, strict=True)]
    for side, box in enumerate(domain):
        stack.append(Tube([box, *[hull] * (period - 1)], [side, *[OPEN] * (period - 1)], [OPEN] * period))
    while stack:
        tried += 1
        prove(tried <= MOST_TUBES, f"more than {MOST_TUBES} tubes would be needed")
        tube: Tube | None = stack.pop()
        for _ in range(ROUNDS):
            tube = None if tube is None else narrowed(the_map, tube)
        if tube is None:
            continue
        if OPEN in tube.branch:
            stack += opened(the_map, tube, domain)
            continue
        tube = unlisted(the_map, tube, cycles)
        if tube is None:
            continue
        k, axis, share = widest(tube.boxes, hull)
        if share < LEAST:
            raise UnprovedError(f"near {tube.boxes[0]} orbits are not told apart from the listed ones")
        stack += halves(tube, k, axis)


def meet_of(one: Pair, other: Pair) -> Pair:
    """Return what two intervals have in common; an end that is nan does not narrow the first."""
    return max(one[0], other[0]), min(one[1], other[1])


def with_box(tube: Tube, k: int, axis: int, pair: Pair) -> Tube:
    """Return a tube with another interval for one coordinate."""
    box = [*tube.boxes[k][:axis], pair, *tube.boxes[k][axis + 1 :]]
    return tube._replace(boxes=[*tube.boxes[:k], box, *tube.boxes[k + 1 :]])


def narrowed(the_map: Map, tube: Tube) -> Tube | None:
    """Narrow a tube along each of its steps, forward and back; None if it holds no orbit."""
    boxes, period = [list(box) for box in tube.boxes], len(tube.boxes)
    for k, (side, branch) in enumerate(zip(tube.side, tube.branch, strict=True)):
        if branch != OPEN and not narrow_step(the_map, (side, branch), boxes[k], boxes[(k + 1) % period]):
            return None
    for box in boxes[1:]:
        box[0] = meet_of(box[0], (boxes[0][0][0], box[0][1]))
    boxes[0][0] = meet_of(boxes[0][0], (boxes[0][0][0], min(box[0][1] for box in boxes)))
    empty = any(lo > hi for box in boxes for lo, hi in box)
    return None if empty else tube._replace(boxes=boxes)


def narrow_step(the_map: Map, step: tuple[int, int], box: list[Pair], after: list[Pair]) -> bool:
    """Narrow the box of a point and that of the next in place; False if no point of the one is sent into the other.

    With the middle m, f_i(x) = f_i(m) + sum_j g_j (x_j - m_j) is the next point's coordinate i: an image of the box,
    and an equation for each x_j whose g_j is not 0.
    """
    d, (side, branch) = the_map.dimension, step
    piece = the_map.piece(box)
    if branch not in possible(the_map, side, piece)[0]:
        return False
    program = the_map.image[step]
    values, gradients = program.at(piece.balls), program.gradients(piece.balls)
    middle = [ball.mid() for ball in piece.balls[:d]]
    off = [ball - m for ball, m in zip(piece.balls, middle, strict=False)]
    at = program.at(middle + piece.balls[d:])
    for i, gradient in enumerate(gradients):
        moves = [g * v for g, v in zip(gradient, off, strict=False)]
        after[i] = meet_of(after[i], floats_around(values[i]))
        after[i] = meet_of(after[i], floats_around(sum(moves, at[i])))
        if not after[i][0] <= after[i][1]:
            return False
        gap = arb(after[i][0]).union(arb(after[i][1])) - at[i]
        for j, slope in enumerate(gradient[:d]):
            if slope > 0 or slope < 0:
                near = middle[j] + (gap - sum(moves[:j] + moves[j + 1 :], arb(0))) / slope
                box[j] = meet_of(box[j], floats_around(near))
                if not box[j][0] <= box[j][1]:
                    return False
    return True


def opened(the_map: Map, tube: Tube, domain: Boxes) -> Iterator[Tube]:
    """Take the first open branch of a tube, each way that is possible; a box with two ways is cut while not small."""
    k = tube.branch.index(OPEN)
    side, after = tube.side[k], (k + 1) % len(tube.boxes)
    branches = possible(the_map, side, the_map.piece(tube.boxes[k]))[0]
    _, axis, share = widest([tube.boxes[k]], domain[side])
    if len(branches) > 1 and share > TWO_WAYS:
        yield from halves(tube, k, axis)
        return
    for branch in branches:
        to = the_map.shape.to[side, branch]
        if tube.side[after] in (OPEN, to):
            sides, taken, boxes = tube.side.copy(), tube.branch.copy(), tube.boxes.copy()
            sides[after], taken[k] = to, branch
            boxes[after] = [meet_of(*pairs) for pairs in zip(boxes[after], domain[to], strict=True)]
            if all(lo <= hi for lo, hi in boxes[after]):
                yield Tube(boxes, sides, taken)


def unlisted(the_map: Map, tube: Tube, cycles: list[Cycle]) -> Tube | None:
    """Return what of a tube may hold an orbit that is not listed; None if there is none.

    Every orbit in a wider W lies in K(W); where that lies in the interior, W has exactly one orbit along these
    branches, which is the listed one if W holds that.
    """
    wider = widened(tube.boxes)
    d = the_map.dimension
    slopes = [
        [g[:d] for g in the_map.image[step].gradients(the_map.piece(box).balls)]
        for step, box in zip(zip(tube.side, tube.branch, strict=True), wider, strict=True)
    ]
    finite = all(v.is_finite() for rows_ in slopes for row in rows_ for v in row)
    entries = newton_image(the_map, (tube.side, tube.branch), wider, slopes) if finite else []
    if not entries:
        return tube
    ends = itertools.chain(*wider)
    inside = all(v > lo and v < hi for v, (lo, hi) in zip(entries, ends, strict=True))
    if inside and any(lies_in(cycle, tube, wider) for cycle in cycles):
        return None
    cut = [
        meet_of(pair, floats_around(v)) for pair, v in zip(itertools.chain(*tube.boxes), entries, strict=True)
    ]
    if any(lo > hi for lo, hi in cut):
        return None
    return tube._replace(boxes=[cut[k * d : k * d + d] for k in range(len(tube.boxes))])


def widened(boxes: Boxes) -> Boxes:
    """Return W, in whose interior the boxes of a tube lie."""
    tiny = BY_SIZE * max(abs(end) for box in boxes for pair in box for end in pair)
    return [
        [(lo - WIDER * (hi - lo) - tiny, hi + WIDER * (hi - lo) + tiny) for lo, hi in box] for box in boxes
    ]


def lies_in(cycle: Cycle, tube: Tube, wider: Boxes) -> bool:
    """Whether a proved cycle, from one of its points on, lies in W along the sides and branches of a tube."""
    period = len(wider)
    if period % cycle.period:
        return False
    words = list(zip(tube.side, tube.branch, strict=True))
    own = list(zip(cycle.listed.side, cycle.listed.branch, strict=True))
    for first in range(cycle.period):
        order = [(first + k) % cycle.period for k in range(period)]
        if [own[k] for k in order] == words and all(
            v >= lo and v <= hi
            for k, box in zip(order, wider, strict=True)
            for v, (lo, hi) in zip(cycle.points[k], box, strict=True)
        ):
            return True
    return False


def widest(boxes: Boxes, domain: list[Pair]) -> tuple[int, int, float]:
    """Return which box is widest along which axis, as a share of the domain; and this share."""
    share, k, axis = max(
        ((hi - lo) / (upper - lower), k, axis)
        for k, box in enumerate(boxes)
        for axis, ((lo, hi), (lower, upper)) in enumerate(zip(box, domain, strict=True))
    )
    return k, axis, share


def halves(tube: Tube, k: int, axis: int) -> list[Tube]:
    """Halve a tube along one coordinate."""
    lo, hi = tube.boxes[k][axis]
    middle = 0.5 * lo + 0.5 * hi
    return [with_box(tube, k, axis, half) for half in ((lo, middle), (middle, hi))]
