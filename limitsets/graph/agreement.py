"""Consistency of the kernels of a user's map.

When the first graph of a class is built, each kernel is evaluated at a few hundred points of the grid.  Errors are a
code that is no branch, a forced image that is not the image on the branch taken, and a proved box that does not hold
the image of one of its points.  A wrong forced image would silently leave cycles and end points empty; a wrong box
would prove false statements.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.errors import MapError
from limitsets.graph.images.hulls import BOTH, NOTHING, BoxImages
from limitsets.interval import rounding_is_sound
from limitsets.maps import images, images_on, kind_of
from limitsets.maps.contract import require_codes
from limitsets.maps.drivers import columns

__all__ = ["require_agreement"]

POINTS = 256

# Two ways to compute one image may differ by rounding, this much relative to the domain and the numbers met.
SAME = 1e-7

# Classes that were asked: (class, whether the boxes too).
_ASKED: set[tuple[type, bool]] = set()


def _starts(grid: Grid, side: int) -> NDArray[np.float64]:
    """Points spread over one side, the same in every run: shape (POINTS, dimension)."""
    draws = np.random.default_rng(side).random((POINTS, grid.dimension))
    lo, hi = np.array([edges[[0, -1]] for edges in grid.edges[side]]).T
    starts: NDArray[np.float64] = lo + draws * (hi - lo)
    return starts


def _refuse(what: str, params: Any, at: NDArray[np.float64], side: int, value: Any, allowed: Any) -> None:
    x = ", ".join(f"{v:.6g}" for v in at)
    raise MapError(
        f"{what} of {kind_of(params).name} at x = {x}, side {side}",
        value,
        f"{allowed}, as its kernel image has it",
        "make the two kernels agree",
    )


def _plain(values: NDArray[np.float64]) -> float | tuple[float, ...]:
    numbers = tuple(float(v) for v in values)
    return numbers[0] if len(numbers) == 1 else numbers


def require_agreement(params: Any, grid: Grid, boxes: bool) -> None:
    """Ask the kernels of a class from outside the package, once; `boxes`: `image_box` too.

    Raises
    ------
    MapError
        They contradict each other.
    """
    cls, kind = type(params), kind_of(params)
    if (cls, boxes) in _ASKED or cls.__module__.split(".")[0] == "limitsets":
        return
    for side in range(grid.sides):
        starts = _starts(grid, side)
        x = starts[:, 0] if kind.dimension == 1 else starts
        found = images(params, x, side)
        require_codes(params, found.code)
        after = found.x.reshape(starts.shape)
        usable = (found.code >= 0) & np.isfinite(after).all(axis=1)
        size = np.ptp(starts, axis=0) + np.abs(after)
        if kind.has_image_on:
            _ask_forced(params, starts, side, (after, found.side, found.code), usable, size)
        if boxes and kind.has_image_box and rounding_is_sound():
            _ask_boxes(params, grid, starts, side, (after, found.side, found.code), usable, size)
    _ASKED.add((cls, boxes))


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


def _ask_boxes(params: Any, grid: Grid, starts: Any, side: int, seen: Any, usable: Any, size: Any) -> None:
    """Compare the boxes of single points."""
    after, to, code = seen
    points = columns(starts, starts.shape[1])
    found = BoxImages(params, params, side, points, points)
    inside = np.zeros(code.size, dtype=bool)
    for slot in range(2):
        lo, hi = (np.stack(corner, axis=1) for corner in found.slots[slot])
        held = ((lo - SAME * size <= after) & (after <= hi + SAME * size)).all(axis=1)
        inside |= held & (found.to[2 * slot] == to) & ((slot == 0) | (found.count == BOTH))
    undefined = np.isnan(after).any(axis=1)
    proved = found.count != NOTHING
    _ask_exits(params, grid, starts, side, code, found, proved & ~usable & ~undefined)
    for k in np.flatnonzero(proved & ((usable & ~inside) | undefined))[:1]:
        box = tuple((float(lo[k]), float(hi[k])) for lo, hi in zip(*found.slots[0], strict=True))
        got = (*box, int(found.to[0, k]))
        _refuse(
            "the proved box of the kernel image_box",
            params,
            starts[k],
            side,
            got,
            (_plain(after[k]), int(to[k])),
        )


def _ask_exits(
    params: Any, grid: Grid, starts: Any, side: int, code: Any, found: BoxImages, gone: NDArray[np.bool_]
) -> None:
    """Refuse boxes in the domain, of points that have left the map: only `image` knows of that exit."""
    lo, hi = (np.stack(corner, axis=1) for corner in found.slots[0])
    for k in np.flatnonzero(gone):
        edges = grid.edges[int(found.to[0, k]) % grid.sides]
        ends = np.array([axis[[0, -1]] for axis in edges])
        if ((ends[:, 0] <= lo[k]) & (hi[k] <= ends[:, 1])).all():
            x = ", ".join(f"{v:.6g}" for v in starts[k])
            raise MapError(
                f"the image of {kind_of(params).name} at x = {x}, side {side}",
                f"code {int(code[k])}, an exit",
                f"an exit of its boxes too, which lead to {_plain(lo[k])}",
                "let image_on give nan there, or register image_box",
            )
