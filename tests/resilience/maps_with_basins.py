"""Maps whose basins are known on paper, registered from outside the package as a user's maps are."""

from __future__ import annotations

import math
from typing import NamedTuple

import limitsets as ls


class Stripes(NamedTuple):
    """On [0, 2) x' = 2.25 in even stripes of one width, 2.75 in odd ones; beyond, 2.25 up to 2.5, then 2.75.

    Known answers: two attractors, and boundaries at every multiple of the width up to 2, at 2 if need be, and at 2.5.
    """

    width: float


def stripes(params, x, side):
    even = math.floor(x / params.width) % 2 == 0 if x < 2.0 else x < 2.5
    return 2.25 if even else 2.75, side, 0


ls.register(Stripes, image=stripes)


class Gaps(NamedTuple):
    """Slope s = 2 n + 1 on [0, 1]: n + 1 full branches, and between them n gaps, from which an orbit leaves.

    Known answers: what stays is a Cantor set of dimension D = ln(n + 1) / ln(s), the boundary of all basins.  Without
    halves gap number j leads to exit j: of all starts each exit takes 1/n, for P = 1/s + (n + 1)/s P.  With halves (one
    gap) its lower half leads to the first exit and its upper half to the second.  Steps until an orbit leaves are
    geometric, with mean s/n.
    """

    number: float
    halves: float


def gaps(params, x, side):
    slope = 2.0 * params.number + 1.0
    k = min(math.floor(slope * x), slope - 1.0)
    rest = slope * x - k
    which = int(k) // 2
    if int(k) % 2 == 0:
        return rest, side, which
    if params.halves > 0.0:
        which = 0 if rest < 0.5 else 1
    return rest, side, -1 - which


OPEN = {"branches": ("one", "two", "three", "four"), "exits": {"first": -1, "second": -2, "third": -3}}
ls.register(Gaps, image=gaps, **OPEN)


class Sheet(NamedTuple):
    """`Gaps` in x_0, and x_1' = x_1 / 2.

    Known answers: those of `Gaps`, with a boundary of dimension D + 1.
    """

    number: float
    halves: float


def sheet(params, z, side):
    after, side, code = gaps(params, z[0], side)
    return (after, 0.5 * z[1]), side, code


ls.register(Sheet, image=sheet, dimension=2, **OPEN)


class Wall(NamedTuple):
    """In space: x' = (1/2, 1/2, 1/2) beyond the plane x_0 = at, (-1/2, -1/2, -1/2) before it.

    Known answer: two attractors; their basins are the two sides of the plane.
    """

    at: float


def wall(params, z, side):
    value = 0.5 if z[0] > params.at else -0.5
    return (value, value, value), side, 1 if z[0] > params.at else 0


ls.register(Wall, image=wall, dimension=3, branches=("before", "beyond"))


class Turnstile(NamedTuple):
    """On two sides: x' = x^2 on the same side up to 1/2, on the other side beyond.

    Known answers on [-1/4, 2]: 0 on each side attracts; x = 1 goes round for ever.  A start below 1/2 stays, one
    between 1/2 and 1 changes side once for each step on which x > 1/2; one beyond 1 leaves.
    """

    power: float


def turnstile(params, x, side):
    flips = x > 0.5
    return x * x, 1 - side if flips else side, 1 if flips else 0


def turnstile_on(params, x, side, branch):
    return x * x, 1 - side if branch == 1 else side, 2.0 * x


def turnstile_margin(params, x, side):
    return x - 0.5


TURNSTILE = {"image": turnstile, "image_on": turnstile_on, "margin": turnstile_margin}
ls.register(Turnstile, **TURNSTILE, branches=("stays", "changes"))


class Excursion(NamedTuple):
    """x' = 1/2 below 1, 5 up to 2, 7 up to 3; beyond, 5 goes to 1/2 and 7 stays.

    Known answers: on [0, 3] a third of the starts stays, a third leaves and comes back, a third leaves for good.
    """

    leave: float


def excursion(params, x, side):
    if x < 1.0:
        return 0.5, side, 0
    if x < 2.0:
        return params.leave, side, 0
    if x < 3.0:
        return params.leave + 2.0, side, 0
    return (0.5 if x < params.leave + 1.0 else x), side, 0


ls.register(Excursion, image=excursion)


class Grebogi(NamedTuple):
    """Grebogi, McDonald, Ott, Yorke, Physics Letters A 99, 1983, with the angle from 0 to 2 pi by `floor`.

    Two attracting fixed points, (0, -J) and (pi, J); a fractal boundary.
    """

    j0: float


def grebogi(params, z, side):
    turned = z[0] + 1.32 * math.sin(2.0 * z[0]) - 0.9 * math.sin(4.0 * z[0]) - z[1] * math.sin(z[0])
    around = 2.0 * math.pi
    return (turned - around * math.floor(turned / around), -params.j0 * math.cos(z[0])), side, 0


ls.register(Grebogi, image=grebogi, dimension=2)


class Waves(NamedTuple):
    """Left of x_0 = 7/2 two basins that meet on a sine, right of it on x_1 = 3; the fixed points are (4, 2), (4, 4)."""

    pitch: float
    steep: float
    shift: float


def waves(params, z, side):
    above = math.sin(params.pitch * z[0] + params.shift) + params.steep * (z[1] - 2.0) > 0.0
    if z[0] > 3.5:
        above = z[1] > 3.0
    return (4.0, 4.0 if above else 2.0), side, 0


ls.register(Waves, image=waves, dimension=2)
