"""Cycles that long orbits come to, and balls around a proved cycle that the map contracts: what lies there tends to it.

In frames S_k, one for each point x_k, the balls |S_k^-1 (x - x_k)| < r go each into the next, and x - x_k shrinks,
where |S_(k+1)^-1 DF S_k| < 1 on the boxes around them (docs/certificates.md, `converges`).  |B|^2 is at most the
largest row sum of |B^T B|.  The slopes are enclosed by whoever calls.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from itertools import product
from operator import add
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from limitsets.base.arrays import Array, Ints, Mask
from limitsets.proofs.prover.certificate_of_map import frames_to_try
from limitsets.proofs.prover.numbers import Intervals
from limitsets.systems.cells import Domain, Grid
from limitsets.systems.maps import advance
from limitsets.systems.sets import Cycle

Entries: TypeAlias = Sequence[Sequence[Intervals]]
Slopes: TypeAlias = Callable[[Array, Array], Intervals | None]
"""From boxes around the points of a cycle, (p, d), to enclosures of the slopes (p, d, d); None where there is none."""

# Steps until an orbit is taken to be at its cycle, fewer where all are by then; the longest period that is looked for.
STAGES, LONGEST = (1_000, 19_000), 64

# A state comes back if it is so near, relative to the extent of the states, at once by `SOON`; orbits nearer than
# `SAME` are one.
BACK, SOON, SAME = 1e-9, 1e-13, 1e-6

# Halvings of a radius until its balls are contracted, then between the largest that are and the least that are not.
HALVINGS, BETWEEN = 40, 6

# Of the largest radius: a product of the checker's balls is wider than one of our boxes, by the product of their radii.
SHARE = 0.9

# Below 1 by more than what the product of the steps is rounded by, here and by the checker.
ATTRACTS = 1.0 - 2.0**-20


class Ball(NamedTuple):
    """Balls around the points of a cycle: frames (p, d, d), their radius in these, and boxes around them (p, d)."""

    frames: Array
    radius: float
    lo: Array
    hi: Array


# ---------------------------------------------------------------- cycles by long orbits


def settled_orbits(params: Any, starts: Array, side: Ints, domain: Domain) -> list[Cycle]:
    """Find the cycles that long orbits come to, in floats.

    Parameters
    ----------
    params : NamedTuple
        The map.
    starts : ndarray, shape (m, d)
        Where the orbits begin.
    side : ndarray of int, shape (m,)
        On which sides.
    domain : Domain
        Whose axes may close.
    """
    at = starts if starts.shape[1] > 1 else starts[:, 0]
    for steps in STAGES:
        at, side, _, made = advance(params, at, side, steps, domain=domain)
        at, side = at[made == steps], side[made == steps]
        if not len(at):
            return []
        path, taken = [(at, side)], []
        for _ in range(LONGEST):
            x, on, code, _ = advance(params, *path[-1], 1, domain=domain)
            path.append((x, on))
            taken.append(code)
        points = np.stack([each.reshape(len(each), -1) for each, _ in path], axis=1)
        sides, branches = np.stack([on for _, on in path], axis=1), np.stack(taken, axis=1)
        scale = float(np.abs(points[np.isfinite(points)]).max(initial=1.0))
        stays = np.all(branches >= 0, axis=1, keepdims=True)
        with np.errstate(invalid="ignore"):  # of states that leave
            off = np.abs(domain.shortest(points[:, 1:] - points[:, :1], sides[:, 1:])).max(axis=2)
        off[(sides[:, 1:] != sides[:, :1]) | ~stays] = np.inf
        if (off.min(axis=1) < SOON * scale).all():
            break
    back = off < BACK * scale
    orbits: list[Cycle] = []
    for k in np.unique(np.nonzero(back)[0]).tolist():
        p = int(back[k].argmax()) + 1
        order = np.roll(np.arange(p), -int(np.lexsort((points[k, :p, 0], sides[k, :p]))[0]))
        here, on, code = points[k, order], sides[k, order], branches[k, order]
        known = (
            (np.abs(orbit.x - here) < SAME * scale).all() and (orbit.side == on).all()
            for orbit in orbits
            if orbit.period == p
        )
        if not any(known):
            orbits.append(Cycle(here, on, code, np.nan, float(off[k, p - 1]), BACK * scale))
    return orbits


# ---------------------------------------------------------------- balls


def entries(lo: Array, hi: Array) -> Entries:
    """Take matrices (p, d, d) apart: each entry for all p at once."""
    size = range(lo.shape[-1])
    return [[Intervals(lo[..., i, j], hi[..., i, j]) for j in size] for i in size]


def times(a: Entries, b: Entries) -> Entries:
    """Multiply matrices that are taken apart."""
    columns = [*zip(*b, strict=True)]
    return [
        [reduce(add, [v * w for v, w in zip(row, column, strict=True)]) for column in columns] for row in a
    ]


def _inverse(frames: Array) -> Entries:
    """Enclose the inverses of frames of one or two dimensions; nan, which proves nothing, where one may be singular."""
    if frames.shape[-1] == 1:
        return [[1.0 / Intervals(frames[:, 0, 0], frames[:, 0, 0])]]
    (a, b), (c, d) = entries(frames, frames)
    det = a * d - b * c
    return [[d / det, -b / det], [-c / det, a / det]]


def _around(frames: Array, radius: float, lo: Array, hi: Array) -> tuple[Array, Array]:
    """Enclose the balls around points that lie in boxes (p, d)."""
    squares = [reduce(add, [v.square() for v in row]).square_root() for row in entries(frames, frames)]
    far = np.stack([(size * radius).hi for size in squares], axis=1)
    return np.nextafter(lo - far, -np.inf), np.nextafter(hi + far, np.inf)


@np.errstate(all="ignore")  # nan and inf prove nothing
def _stretches(frames: Array, slopes: Intervals | None) -> Array:
    """Bound |S_(k+1)^-1 DF S_k|^2 of each step, shape (p,)."""
    if slopes is None:
        return np.full(len(frames), np.inf)
    ahead = _inverse(np.roll(frames, -1, axis=0))
    b = times(ahead, times(entries(slopes.lo, slopes.hi), entries(frames, frames)))
    rows = times([*zip(*b, strict=True)], b)
    return np.asarray(np.max([reduce(add, [v.absolute() for v in row]).hi for row in rows], axis=0))


def _contracts(frames: Array, slopes: Intervals | None) -> bool:
    return bool((_stretches(frames, slopes) < 1.0).all())


def attracting_frames(middle_slopes: Array, slopes: Intervals | None) -> Array | None:
    """Choose frames in which all steps together contract, on the boxes that the certificate has; None for none."""
    tried = frames_to_try(middle_slopes)
    return next((frames for frames in tried if np.prod(_stretches(frames, slopes)) < ATTRACTS), None)


def contracted_ball(lo: Array, hi: Array, middle_slopes: Array, slopes: Slopes, extent: float) -> Ball | None:
    """Find frames and the largest radius, by halving, whose balls around a cycle are contracted.

    Parameters
    ----------
    lo, hi : ndarray, shape (p, d)
        Boxes of its points, as the certificate has them.
    middle_slopes : ndarray, shape (p, d, d)
        Derivatives at the points, in floats.
    slopes : callable
        Encloses them on boxes; None for boxes that reach too far.
    extent : float
        Of the domain: where the search begins.

    Returns
    -------
    Ball or None
        None where no radius is contracted.
    """
    best, size = None, 0.0
    for frames in frames_to_try(middle_slopes):

        def holds(radius: float, frames: Array = frames) -> bool:
            return _contracts(frames, slopes(*_around(frames, radius, lo, hi)))

        radius = next((r for k in range(HALVINGS) if holds(r := extent * 0.5**k)), 0.0)
        high = 2.0 * radius
        for _ in range(BETWEEN if radius else 0):
            middle = 0.5 * (radius + high)
            radius, high = (middle, high) if holds(middle) else (radius, middle)
        radius *= SHARE
        volume = radius ** lo.shape[1] * float(np.abs(np.linalg.det(frames)).min())
        if volume > size and holds(radius):
            best, size = Ball(frames, radius, *_around(frames, radius, lo, hi)), volume
    return best


@np.errstate(all="ignore")
def cells_within(grid: Grid, ball: Ball, lo: Array, hi: Array, side: Ints) -> Mask:
    """Find the cells that lie, by their corners, in one of the balls around points that lie in boxes (p, d)."""
    within, radius = np.zeros(grid.n_cells, dtype=bool), Intervals.of(ball.radius).square().lo
    for k, on in enumerate(side.tolist()):
        cells = np.arange(grid.n_cells)[grid.of_side(on)]
        ends = grid.boxes(cells, on)
        near = ((ends[0] >= ball.lo[k]) & (ends[1] <= ball.hi[k])).all(axis=1)
        cells, ends = cells[near], (ends[0][near], ends[1][near])
        inverse, held = _inverse(ball.frames[k : k + 1]), np.ones(cells.size, dtype=bool)
        for corner in product((0, 1), repeat=grid.dimension):
            off = [
                Intervals(ends[end][:, axis], ends[end][:, axis]) - Intervals.of(lo[k, axis], hi[k, axis])
                for axis, end in enumerate(corner)
            ]
            turned = [reduce(add, [v * w for v, w in zip(row, off, strict=True)]) for row in inverse]
            held &= reduce(add, [v.square() for v in turned]).hi < radius
        within[cells[held]] = True
    return within
