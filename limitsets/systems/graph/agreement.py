"""Consistency of the kernels of a user's map.

Before a graph is built, each kernel is evaluated at a few hundred points of the grid, and at growing distances on both
sides of each place where the branch changes.  Errors are a code that is no branch, a sign of `margin` that is not the
branch taken, a forced image that is not the image on that branch, and a proved box that does not hold the image of one
of its points.  A wrong forced image would silently leave cycles and end points empty; a wrong margin or box would prove
false statements.

It is a sample, not a proof: a contradiction that no sample meets passes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base import MapError
from limitsets.numbers.interval import rounding_is_sound
from limitsets.systems.cells import Domain
from limitsets.systems.graph.images.enclosed import BOTH, NOTHING, BoxImages
from limitsets.systems.maps import coerce, images, images_on, kind_of
from limitsets.systems.maps.contract import between, require_codes, require_corners
from limitsets.systems.maps.critical import bisected, hidden, margins, sign_code
from limitsets.systems.maps.drivers import columns

Floats = NDArray[np.float64]

# Samples of a side, changes of branch between them that are looked at, and parameters between two corners.
POINTS, CHANGES, BETWEEN = 512, 64, 4

# Two ways to compute one image may differ by rounding, this much relative to the domain and the numbers met.
SAME = 1e-7

# The nearest that kernels are compared beside a change of branch, in shares of the side's extent or, where these are
# larger, of the numbers on it: nearer, two ways to compute the place may differ by rounding.  From there on by factors
# of 16 to some gaps between samples.
NEAREST, STEPS = 2.0**-40, 9


def _starts(domain: Domain, side: int) -> Floats:
    """Points spread over one side, the same in every run: shape (POINTS, dimension), one in each of POINTS strata."""
    random = np.random.default_rng(side)
    strata = random.permuted(np.tile(np.arange(POINTS), (domain.dimension, 1)), axis=1).T
    shares = (strata + random.random(strata.shape)) / POINTS
    shares = shares if domain.dimension > 1 else np.sort(shares, axis=0)
    nearest = _nearest(domain, side)
    shares[0], shares[-1] = nearest, 1.0 - nearest  # beside two corners: on them an image may end
    return np.asarray(domain.lo[side] + shares * _extent(domain, side))


def _extent(domain: Domain, side: int) -> Floats:
    return np.asarray(domain.hi[side] - domain.lo[side])


def _nearest(domain: Domain, side: int) -> float:
    """Smallest distance between points that rounding does not blur, as a share of the extent."""
    largest = np.maximum(np.abs(domain.lo[side]), np.abs(domain.hi[side]))
    return NEAREST * float(np.maximum(largest / _extent(domain, side), 1.0).max())


def _refuse(
    what: str,
    params: Any,
    at: Floats,
    side: int,
    value: Any,
    allowed: Any,
    remedy: str = "make the two kernels agree",
) -> None:
    x = ", ".join(f"{v:.12g}" for v in at)
    raise MapError(
        f"{what} of {kind_of(params).name} at x = {x}, side {side}",
        value,
        f"{allowed}, as its kernel image has it",
        remedy,
    )


def _plain(values: Floats) -> float | tuple[float, ...]:
    numbers = tuple(float(v) for v in values)
    return numbers[0] if len(numbers) == 1 else numbers


def _around_changes(code_of: Callable[[Floats], Any], starts: Floats, domain: Domain, side: int) -> Floats:
    """Points on both sides of each change of code between consecutive starts, at growing distances from it."""
    code, extent = code_of(starts), _extent(domain, side)
    k = np.flatnonzero(code[1:] != code[:-1])[:CHANGES]
    way = starts[k + 1] - starts[k]
    length = np.abs(way / extent).max(axis=1)
    way /= length[:, None]

    def along(distance: Floats) -> Floats:
        return np.clip(starts[k] + distance[:, None] * way, domain.lo[side], domain.hi[side])

    # counted from 1, where floats are of one spacing: at most 52 halvings
    lo, hi = bisected(
        np.ones(k.size), 1.0 + length, lambda _lo, middle, _hi: code_of(along(middle - 1.0)) == code[k]
    )
    distances = _nearest(domain, side) * 16.0 ** np.arange(STEPS)
    both = [points for d in distances for points in (along(lo - 1.0 - d), along(hi - 1.0 + d))]
    return np.concatenate(both)


def _points(params: Any, domain: Domain, side: int) -> tuple[Floats, int]:
    """Where the kernels are compared: the starts, then those around changes of branch; how many starts there are."""
    starts, near_changes = _starts(domain, side), []
    if len(kind_of(params).branches) == 1:
        return starts, len(starts)
    if kind_of(params).has_margin:
        if domain.dimension == 1:  # two changes of sign between a pair of starts
            more = hidden(lambda x: margins(params, x, side), starts[:, 0])
            starts = np.unique(np.append(starts, more))[:, None]
        near_changes.append(
            _around_changes(lambda x: sign_code(margins(params, x, side)), starts, domain, side)
        )
    near_changes.append(_around_changes(lambda x: images(params, x, side).code, starts, domain, side))
    return np.concatenate([starts, *near_changes]), len(starts)


def require_agreement(params: Any, domain: Domain, boxes: bool, upper: Any = None) -> None:
    """Ask the kernels of a class from outside the package; `boxes`: `image_box` too.

    Of a box of parameters both corners are asked, and some parameters between: their images lie in the boxes that are
    proved of all.

    Raises
    ------
    AnswerError
        `upper` is no upper corner.
    MapError
        They contradict each other, or a parameter is nan.
    """
    cls, kind = type(params), kind_of(params)
    corners, ends = [params], (params, params)
    if upper is not None and upper is not params:
        require_corners(params, upper)
        ends, random = (coerce(params), coerce(upper)), np.random.default_rng(0)
        corners = [*ends, *(between(*ends, random.random) for _ in range(BETWEEN))]
    for name, value in ((name, value) for corner in corners for name, value in corner._asdict().items()):
        if isinstance(value, float | int) and math.isnan(value):
            raise MapError(f"the field {name} of {kind.name}", value, "a number", "give it a value")
    if cls.__module__.split(".")[0] == "limitsets":
        return
    for corner, side in product(corners, np.flatnonzero(domain.inhabited).tolist()):
        points, count = _points(corner, domain, side)
        image = images(corner, points, side)
        require_codes(corner, image.code)
        after = image.x.reshape(points.shape)
        usable = (image.code >= 0) & np.isfinite(after).all(axis=1)
        size = _extent(domain, side) + np.abs(after)
        if kind.has_margin and len(kind.branches) > 1:
            _ask_margin(corner, points, side, np.where(usable, image.code, -1), count)
        if kind.has_image_on:
            _ask_forced(corner, points, side, (after, image.side, image.code), usable, size)
        if boxes and kind.has_image_box and rounding_is_sound():
            _ask_boxes(
                ends,
                domain,
                points,
                side=side,
                seen=(after, image.side, image.code),
                usable=usable,
                size=size,
            )


def _ask_margin(params: Any, points: Floats, side: int, code: Any, count: int) -> None:
    """Compare the sign of `margin` with the branch taken; the first `count` points are spread over the side."""
    margin, names = margins(params, points, side), kind_of(params).branches
    sign = sign_code(margin)
    asked = (code >= 0) & (code <= 1) & (sign >= 0)
    wrong = asked & (sign != code)
    if not wrong.any():
        return
    k = int(np.where(wrong, np.abs(margin), -1.0).argmax())
    remedy = "write image in terms of margin and image_on, so that they cannot differ"
    spread = asked[:count]
    if (wrong[:count] == spread).all() and np.unique(code[:count][spread]).size == 2:
        remedy = "its sign is wrong everywhere: give its negative"
    got, want = (f"{each} ({names[each]})" for each in (int(sign[k]), int(code[k])))
    what = "the branch by the sign of the kernel margin"
    _refuse(what, params, points[k], side=side, value=got, allowed=want, remedy=remedy)


def _ask_forced(params: Any, starts: Any, side: int, seen: Any, usable: Any, size: Any) -> None:
    """Compare forced images on the branch taken."""
    after, to, code = seen
    for branch in np.unique(code[usable]).tolist():
        mine = usable & (code == branch)
        x = starts[mine]
        forced, forced_to = images_on(params, x[:, 0] if x.shape[1] == 1 else x, side, branch)
        forced = forced.reshape(x.shape)
        off = ~(np.abs(forced - after[mine]) <= SAME * size[mine]).all(axis=1)
        for k in np.flatnonzero(off | (forced_to != to[mine]))[:1]:
            name = kind_of(params).branches[branch]
            got = _plain(forced[k]), int(forced_to[k])
            want = _plain(after[mine][k]), int(to[mine][k])
            _refuse(
                f"(x', side') of the kernel image_on on branch {branch} ({name})",
                params,
                x[k],
                side,
                got,
                want,
            )


def _ask_boxes(ends: Any, domain: Domain, starts: Any, side: int, seen: Any, usable: Any, size: Any) -> None:
    """Compare the boxes of single points, for all parameters between two, with images for some of them."""
    after, to, code = seen
    params, upper = ends
    points = columns(starts, starts.shape[1])
    boxes = BoxImages(params, upper, side, points, points)
    inside = np.zeros(code.size, dtype=bool)
    for slot in range(2):
        lo, hi = (np.stack(corner, axis=1) for corner in boxes.slots[slot])
        held = ((lo - SAME * size <= after) & (after <= hi + SAME * size)).all(axis=1)
        inside |= held & (boxes.to[2 * slot] == to) & ((slot == 0) | (boxes.count == BOTH))
    undefined = np.isnan(after).any(axis=1)
    proved = boxes.count != NOTHING
    _ask_exits(params, domain, starts, side=side, code=code, boxes=boxes, gone=proved & ~usable & ~undefined)
    for k in np.flatnonzero(proved & ((usable & ~inside) | undefined))[:1]:
        box = tuple((float(lo[k]), float(hi[k])) for lo, hi in zip(*boxes.slots[0], strict=True))
        got = (*box, int(boxes.to[0, k]))
        _refuse(
            "the proved box of the kernel image_box",
            params,
            starts[k],
            side,
            got,
            (_plain(after[k]), int(to[k])),
        )


def _ask_exits(
    params: Any, domain: Domain, starts: Any, side: int, code: Any, boxes: BoxImages, gone: NDArray[np.bool_]
) -> None:
    """Refuse boxes in the domain, of points that have left the map: only `image` knows of that exit."""
    lo, hi = (np.stack(corner, axis=1) for corner in boxes.slots[0])
    for k in np.flatnonzero(gone):
        to = int(boxes.to[0, k]) % domain.sides
        if ((domain.lo[to] <= lo[k]) & (hi[k] <= domain.hi[to])).all():
            x = ", ".join(f"{v:.12g}" for v in starts[k])
            raise MapError(
                f"the image of {kind_of(params).name} at x = {x}, side {side}",
                f"code {int(code[k])}, an exit",
                f"an exit of its boxes too, which lead to {_plain(lo[k])}",
                "let image_on give nan there, or register image_box",
            )
