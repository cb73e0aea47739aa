"""Certificates of maps: formulas as lists of operations, cells with targets, ranks and components, orbits in boxes.

docs/certificates.md, "Certificates of any map".  The checker evaluates the operations in balls of its own, whose ends
differ from our boxes in the last digits: targets are chosen for boxes that are wider by that, and ranks and components
are those of these targets.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError
from limitsets.base.arrays import Array, Arrays, Ints
from limitsets.proofs.prover.certificate import written
from limitsets.proofs.prover.programs import periods_of, recorded_map, require_same
from limitsets.proofs.prover.recording import decimal, names_of
from limitsets.systems.cells import Domain, Grid
from limitsets.systems.graph.components import attracting_of, ranks, reach, strong_components
from limitsets.systems.graph.ranges import Ranges, build
from limitsets.systems.graph.target import TargetBoxes, cut_at_seams, met_round
from limitsets.systems.maps import kind_of
from limitsets.systems.maps.derived import NEVER, UNKNOWN, branch_boxes

# Boxes are wider by these shares of their width and of their size.  Balls of 100 bits are narrower than our boxes but
# for the radius, which has 30 bits: 2^-28 of the width is four times its rounding.
OF_WIDTH, OF_SIZE = 2.0**-28, 2.0**-50

# A claimed slope is smaller by this share, and the boxes of an orbit are wider by MORE of their width and LEAST of the
# size of its points: the checker has to find Newton's operator inside them.
LESS, MORE, LEAST = 2.0**-40, 0.25, 2.0**-40

# Condition of frames of eigenvectors beyond which Lyapunov's equation is solved, by so many rounds along the orbit, for
# rates of contraction that are these powers of the orbit's own (or of the fastest that is asked for).
WORST, ROUNDS, SHARES, FASTEST = 1e6, 60, (0.25, 0.5, 0.75), 1e-3

Numbers: TypeAlias = NDArray[np.int32]

NO_CLAIM = -1  # the rank of cells of which nothing is claimed
IMPOSSIBLE = -2  # the target of a branch that is not taken


class Targets(NamedTuple):
    """The target cells of all cells, on all branches.

    Attributes
    ----------
    cells : ndarray of int32, shape (branches, n_cells, 2 d)
        The first along each axis, then the last: -1 and the number of cells where the image may lie beyond the domain,
        `IMPOSSIBLE` where the branch is not taken or its image not enclosed.
    to : ndarray of int32, shape (branches, n_cells)
        The side that each branch leads to.
    beyond : ndarray of bool, shape (branches, n_cells)
        Whether a part of the image may lie beyond the domain.
    unknown : ndarray of bool, shape (n_cells,)
        Cells with an image that is not enclosed.
    """

    cells: Numbers
    to: Numbers
    beyond: NDArray[np.bool_]
    unknown: NDArray[np.bool_]

    @property
    def lost(self) -> NDArray[np.bool_]:
        """Cells whose images are not proved to lie in the domain."""
        return np.asarray(self.unknown | self.beyond.any(axis=0))


def targets_of(lower: Any, upper: Any, grid: Grid) -> Targets:
    """Find the target cells of all cells, for all maps between two corners of parameters."""
    count, dimension = grid.n_cells, grid.dimension
    branches = len(kind_of(lower).branches) if kind_of(lower).has_margin else 1
    cells = np.full((branches, count, 2 * dimension), IMPOSSIBLE, np.int32)
    to, beyond = np.zeros((branches, count), np.int32), np.zeros((branches, count), dtype=bool)
    unknown = np.zeros(count, dtype=bool)
    for side, branch in np.ndindex(grid.sides, branches):
        mine = np.arange(count)[grid.of_side(side)]
        boxes = branch_boxes(lower, upper, side, branch, *grid.boxes(mine, side))
        met, after = _target_cells(grid, boxes.side, boxes.lo, boxes.hi), np.tile(grid.shape[boxes.side], 2)
        ends = ~np.tile(grid.domain.periodic, 2)
        enclosed = (boxes.state != NEVER) & (boxes.state != UNKNOWN)
        unknown[mine] |= boxes.state == UNKNOWN
        beyond[branch, mine] = enclosed & (((met < 0) | (met >= after)) & ends).any(axis=1)
        kept = np.where(ends, np.clip(met, -1, after), met)
        cells[branch, mine[enclosed]], to[branch, mine] = kept[enclosed], boxes.side
    return Targets(cells, to, beyond, unknown)


def cells_of(
    images: Targets, grid: Grid, ends: NDArray[np.bool_] | None = None, final: Numbers | None = None
) -> Arrays:
    """Find the arrays of one box of parameters.

    Parameters
    ----------
    images : Targets
        Of all maps of the box.
    grid : Grid
        The cells.
    ends : ndarray of bool, shape (n_cells,), optional
        Cells in which orbits shall end: those of them from which none leaves these then stand in place of the
        attracting components, as one.
    final : ndarray of int32, shape (n_cells,), optional
        Cells whose orbits are known from there on, as they tend to a cycle: their components from 0 on, -1 elsewhere.
        The others are numbered on.

    Returns
    -------
    dict of str to ndarray
        ``edges.S.A``, ``target.B``, `rank` and `component`.  A cell from which an image may leave the domain, is not
        enclosed, or may come to recurrent cells that do not attract, has rank -1.
    """
    target, lost = np.where(images.beyond[..., None], IMPOSSIBLE, images.cells), images.lost
    if final is not None:
        target[:, final >= 0], lost[final >= 0] = IMPOSSIBLE, False
    component, rank = _labels(ranges_of(grid, target, images.to, lost), lost, ends, final)
    edges = {
        f"edges.{s}.{axis}": e[:-1] if grid.domain.periodic[axis] else e  # the last is the first again
        for s, axes in enumerate(grid.edges)
        for axis, e in enumerate(axes)
    }
    targets = {f"target.{branch}": each for branch, each in enumerate(target)}
    return {"component": component, "rank": rank, **edges, **targets}


def _target_cells(grid: Grid, side: int, lo: Array, hi: Array) -> Ints:
    """First and last cell along each axis that boxes meet, shape (n, 2 d); outside the grid where they reach beyond.

    Along axes that close they are counted on beyond the seam.
    """
    slack = OF_WIDTH * (hi - lo) + OF_SIZE * np.maximum(np.abs(lo), np.abs(hi)) + np.finfo(np.float64).tiny
    axes, bottom, top = grid.edges[side], grid.domain.lo[side], grid.domain.hi[side]
    # An image proved to stay within a face of the domain does so for the checker too: it reaches such an end exactly.
    low_ends = np.where(lo >= bottom, np.maximum(lo - slack, bottom), lo - slack)
    high_ends = np.where(hi <= top, np.minimum(hi + slack, top), hi + slack)
    first = [np.searchsorted(e, low, "right") - 1 for e, low in zip(axes, low_ends.T, strict=True)]
    last = [np.searchsorted(e, high, "left") - 1 for e, high in zip(axes, high_ends.T, strict=True)]
    for axis in np.flatnonzero(grid.domain.periodic).tolist():
        wide = slack[:, axis] + OF_SIZE * (top - bottom)[axis]
        first[axis], last[axis] = met_round(axes[axis], lo[:, axis] - wide, hi[:, axis] + wide)
    return np.stack([*first, *last], axis=1)


def ranges_of(grid: Grid, target: Numbers, to: Numbers, lost: NDArray[np.bool_]) -> Ranges:
    """Make the graph of the targets; `to` has the side that each branch leads to."""
    cell, branch = np.nonzero(target[:, :, 0].T != IMPOSSIBLE)
    boxes, sides = target[branch, cell], to[branch, cell]
    first, last = (np.ascontiguousarray(part) for part in np.hsplit(boxes, 2))
    parts = TargetBoxes(cell, sides, first, last, np.zeros(grid.n_cells, np.uint8), 0.0)
    if grid.domain.closes:
        parts = cut_at_seams(parts, grid.shape)
    begin = np.concatenate([[0], np.cumsum(np.bincount(parts.cell, minlength=grid.n_cells))])
    return build(grid, begin, parts.side, parts.lo, parts.hi, lost.astype(np.uint8))


def _labels(
    ranges: Ranges, lost: NDArray[np.bool_], ends: NDArray[np.bool_] | None, final: Numbers | None
) -> tuple[Numbers, Numbers]:
    """Find component and rank of each cell."""
    parts = strong_components(ranges)
    component = np.full(lost.size, -1, np.int32) if final is None else final.copy()
    first = int(component.max()) + 1
    if ends is None:
        sets = [np.flatnonzero(parts.label == k).astype(np.int32) for k in np.flatnonzero(parts.recurrent)]
        attracts = attracting_of(ranges, parts, sets)
        for number, cells in enumerate(each for each, good in zip(sets, attracts, strict=True) if good):
            component[cells] = first + number
    else:
        # who may come into final cells is none of the set that stays: its targets would be of two components
        component[reach(ranges, parts, (lost | ~ends | (component >= 0)).astype(np.uint8)) == 0] = first
    settled = np.zeros(parts.count, dtype=bool)
    settled[parts.label[component >= 0]] = True
    stays_elsewhere = (parts.recurrent & ~settled)[parts.label]
    rank = ranks(ranges, parts, settled | np.asarray(parts.recurrent))
    rank[reach(ranges, parts, (lost | stays_elsewhere).astype(np.uint8)) > 0] = NO_CLAIM
    rank[component >= 0] = 0
    return component, rank


# ---------------------------------------------------------------- sections


def hexed(values: Array) -> Any:
    """Write floats of an array of any shape in hexadecimal."""
    return float(values).hex() if np.ndim(values) == 0 else [hexed(each) for each in values]


def widened(lo: Array, hi: Array) -> tuple[Array, Array]:
    """Boxes of an orbit as the file has them: in wider ones the checker finds its own Newton's operator."""
    wide = MORE * (hi - lo) + LEAST * np.maximum(np.maximum(np.abs(lo), np.abs(hi)), 1.0)
    return lo - wide, hi + wide


def frames_to_try(slopes: Array) -> list[Array]:
    """Choose S_k so that S_(k+1)^-1 A_k S_k contracts, from the derivatives A_k of the steps of an attracting orbit.

    By eigenvectors, where these are far from parallel, and by Lyapunov's equation for several rates.  Eigenvectors of
    the product of all steps are carried along the orbit, and stretched so that every step contracts alike.  The
    largest norm of a frame is 1.
    """
    count, dimension = slopes.shape[:2]
    whole = reduce(lambda product, slope: slope @ product, slopes, np.eye(dimension))
    values, vectors = np.linalg.eig(whole)
    chosen = np.stack(
        [v.imag if w.imag < 0 else v.real for w, v in zip(values, vectors.T, strict=True)], axis=1
    )
    carried = [chosen]
    for slope in slopes[:-1]:
        after = slope @ carried[-1]
        carried.append(after / max(float(np.linalg.norm(after, 2)), np.finfo(float).tiny))
    tried = [_by_lyapunov(slopes, max(float(np.abs(values).max()), FASTEST) ** (s / count)) for s in SHARES]
    if all(np.linalg.cond(frame) < WORST for frame in carried):
        tried.insert(0, _alike(np.array(carried), slopes))
    return [frame / np.linalg.norm(frame, 2, axis=(1, 2)).max() for frame in tried]


def _by_lyapunov(slopes: Array, rate: float) -> Array:
    """Choose frames so that |A_k x| in the norm of k + 1 is below so much of |x| in that of k."""
    count, dimension = slopes.shape[:2]
    weights = [np.eye(dimension)] * count
    for k in [*reversed(range(count))] * ROUNDS:
        weights[k] = np.eye(dimension) + slopes[k].T @ weights[(k + 1) % count] @ slopes[k] / rate**2
    return np.array([np.linalg.inv(np.linalg.cholesky(weight).T) for weight in weights])


def _alike(carried: Array, slopes: Array) -> Array:
    """Stretch frames so that every step contracts by the same factor, but where one sends all to 0."""
    stretch = np.linalg.norm(np.linalg.solve(np.roll(carried, -1, axis=0), slopes @ carried), 2, axis=(1, 2))
    if not (stretch > 0.0).all():
        return carried
    logs = np.log(stretch)
    sizes = np.exp(np.concatenate([[0.0], np.cumsum(logs - logs.mean())[:-1]]))
    return np.asarray(carried * sizes[:, None, None])


def parameters_of(lower: Any, upper: Any) -> dict[str, Any]:
    """Write each parameter as a decimal, or two where it has a range."""
    ends = zip(names_of(lower), names_of(upper), strict=True)
    return {name: decimal(lo) if lo == hi else [decimal(lo), decimal(hi)] for (name, lo), (_, hi) in ends}


def _section(claim: str, arrays: Arrays, known: Mapping[str, Any]) -> dict[str, Any]:
    """Write the section of a claim; the numbers of cells are those of the file."""
    if claim == "attracts-all":
        if (arrays["rank"] < 0).any():
            raise AnswerError(
                "the certificate of attracts-all",
                "orbits pass through cells that recur, for a number of steps that ranks of cells do not show",
                "cells of which none recurs but those that attract",
                "take finer cells, or leave the claim out",
            )
        return {"max_rank": int(arrays["rank"].max())}
    if claim == "expanding":
        return {"least": (float.fromhex(known["least_slope"]) * (1.0 - LESS)).hex()}
    return (
        dict(known)
        if claim in ("average", "entropy", "long-run", "probabilities", "cycles", "all-cycles", "converges")
        else {}
    )


class Part(NamedTuple):
    """A box of parameters of a certificate: its two corners, the claims with the numbers that the prover knows, arrays.

    Of `expanding` that is `least_slope`, of the claims about orbits their section; `arrays` is empty where no claim is
    about cells.  A claim is proved, but `refuted`, which is refuted.
    """

    corners: tuple[Any, Any]
    claims: Mapping[str, Mapping[str, Any]]
    arrays: Arrays


def region_of(parts: Sequence[Part], names: Sequence[str]) -> tuple[dict[str, Any], list[Any]]:
    """Write the axes of a region of some parameters, and by part the numbers of the borders between which it lies."""
    ends = [[dict(names_of(corner)) for corner in part.corners] for part in parts]
    borders = {name: sorted({corner[name] for pair in ends for corner in pair}) for name in names}
    axes = [{"parameter": name, "borders": [decimal(end) for end in borders[name]]} for name in names]
    at = [[[borders[name].index(corner[name]) for corner in pair] for name in names] for pair in ends]
    return {"axes": axes}, at


def write_map(
    path: str | Path,
    domain: Domain,
    parts: Sequence[Part],
    *,
    goal: Mapping[str, Any] | None,
    region: Sequence[str] = (),
    recheck: bool = True,
    workers: int | None = 1,
) -> float | None:
    """Write a certificate of a map, replacing an older file whole; it gets its name once the checker has confirmed it.

    Parameters
    ----------
    path : str or Path
        The file.
    domain : Domain
        Of the map: there its formulas are compared with what is compiled.
    parts : sequence of Part
        The boxes of parameters, one at least.
    goal : mapping, or None
        The goal of "ends-in" and "refuted", as the file has it.
    region : sequence of str
        Parameters of which the boxes are a region, none lying over another; by default they are none.
    recheck : bool
        Whether to check it first.
    workers : int, optional
        Processes that check it, None for all processors.

    Returns
    -------
    float or None
        Seconds that the check took.

    Raises
    ------
    AnswerError
        For a map that cannot be recorded, or whose recorded formulas are not what is compiled.
    DeniedError
        The checker does not confirm it: it is kept as NAME.denied.zip.
    """
    table = recorded_map(parts[0].corners[0], domain.sides) | {"periodic": periods_of(domain)}
    boxes, arrays, verdicts = list[dict[str, Any]](), Arrays(), dict[str, str]()
    for k, part in enumerate(parts):
        require_same(*part.corners, table, domain)
        claims = [
            {"claim": word, "section": _section(word, part.arrays, known)}
            for word, known in part.claims.items()
        ]
        boxes.append({"parameters": parameters_of(*part.corners), "prefix": f"{k}.", "claims": claims})
        arrays |= {f"{k}.{name}": np.ascontiguousarray(each) for name, each in part.arrays.items()}
        where = f"box {k}: " if len(parts) > 1 else ""
        verdicts |= {where + word: "refuted" if word == "refuted" else "proved" for word in part.claims}
    header = {
        "map": table,
        "boxes": boxes,
        "goal": goal,
        "plane": None,
    }
    if region:
        header["plane"], at = region_of(parts, region)
        header["boxes"] = [box | {"at": place} for box, place in zip(boxes, at, strict=True)]
    return written(path, header, arrays, verdicts, recheck=recheck, workers=workers)
