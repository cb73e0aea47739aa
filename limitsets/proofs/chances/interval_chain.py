"""A noisy scene, or a noisy map of a line, as an interval Markov chain, which model checkers read (DRN text; Storm).

A cell leads to each next cell with a probability between two numbers, which hold for every point of the cell.
The probability that a step lands in a cell, as a function of the image y, is the length that the cell has in common
with [y - e, y + e], over 2e: least at an end of a range of y, largest where y is nearest the middle of the cell.  Where
a cell's images lie is what the checker proves (`limitsets/checker/links.py`, `noisy_map.py`), at strata of the speed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from limitsets.base import (
    AnswerError,
    Column,
    Table,
    Tabled,
    arguments_checked,
    replaced,
    shown,
    shown_in_notebooks,
)
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.scattering import Scattering, Uniform, scattering_of
from limitsets.feeder.scene import Scene, load
from limitsets.numbers.interval import guard
from limitsets.proofs.chances.absorption import absorbing_places, default_starts
from limitsets.proofs.chances.absorption_of_map import require_on_grid
from limitsets.proofs.chances.chain import EXITS, Place, require_places, setting_of
from limitsets.proofs.prover.averages_of_map import cut_at_changes
from limitsets.proofs.prover.certificate import require_checker
from limitsets.proofs.prover.certifying import require_cells, require_map, require_none
from limitsets.proofs.prover.noise_of_map import as_checked, require_noise
from limitsets.systems.cells import Grid
from limitsets.systems.maps import coerce

# Parts into which each stratum of the speed is cut: between its ends landing places are linear, up to what is proved.
CELLS, PARTS = 1000, 4
# Against the roundings of places, per share of a cell, and of sums.
OF_PLACES, OF_SUMS = 2.0**-49, 2.0**-40
# Ranges of images that are shared out to cells at a time.
AT_ONCE = 20_000
# Names that the chain, or a model checker, gives itself.
TAKEN = ("init", "deadlock", "any", EXITS)
HEAD = """// interval chain of {}; cells as //[side, from x, to x]
@type: DTMC
@value_type: double-interval
@parameters

@reward_models

@nr_states
{}
@nr_choices
{}
@model
"""


@dataclass(frozen=True, eq=False)
class IntervalChain(Tabled):
    """An interval Markov chain: the chain of a scene or a map is one of those that it allows.

    A state is a cell, or a place that absorbs.  From every point of a cell the probability of each next state lies
    between the two numbers of a transition, whatever the steps before did.

    Attributes
    ----------
    name : str
        Of what it is the chain.
    cells : tuple of (int, float, float) or None
        By state the cell: side, from x, to x; None for states that are no cell [length].
    labels : dict of str to ndarray of int
        By label the states that have it: "init", the places that absorb, and the exits ("exits").
    lower, upper : scipy.sparse.csr_array, shape (states, states)
        Between which two numbers the probability of a transition lies; a lower one may be 0.
    """

    name: str
    cells: tuple[Place | None, ...]
    labels: dict[str, Ints]
    lower: Any = field(repr=False)
    upper: Any = field(repr=False)

    @property
    def states(self) -> int:
        """The number of states."""
        return len(self.cells)

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        row = self.states, self.upper.nnz, self.upper.nnz - self.lower.nnz, (self.upper - self.lower).max()
        columns = "states", "transitions", "with lower bound 0", Column("widest interval", show=".3g")
        return (Table(columns, [row], f"{self.name}: interval chain", f"labels: {', '.join(self.labels)}"),)

    def save(self, path: str | Path) -> Path:
        """Write it as DRN text, the explicit format of the model checker Storm; an older file is replaced whole.

        Every number is written so that reading it as a double gives it back.

        Parameters
        ----------
        path : str or Path
            The file, NAME.drn.

        Examples
        --------
        >>> import tempfile
        >>> import limitsets as ls
        >>> def half(x): return 0.5 * x
        >>> chain = ls.interval_chain(ls.map(half), ls.grid([(-1, 1)], cells=2), noise=0.25)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     lines = chain.save(f"{folder}/half.drn").read_text().splitlines()
        >>> lines[1:3], lines[-3], lines[-1].split()
        (['@type: DTMC', '@value_type: double-interval'], 'state 2 exits', ['2', ':', '[1.0,', '1.0]'])
        """
        place, table = Path(path), self.upper.tocoo()
        least = self.lower[table.row, table.col]
        columns = (column.tolist() for column in (table.col, least, table.data))
        moves = [f"\t\t{to} : [{lo!r}, {hi!r}]\n" for to, lo, hi in zip(*columns, strict=True)]
        text = [HEAD.format(" ".join(self.name.split()), self.states, self.states)]
        for state, cell in enumerate(self.cells):
            told = " ".join([str(state), *(label for label, some in self.labels.items() if state in some)])
            note = f"//[{', '.join(map(repr, cell))}]\n" if cell else ""
            first, end = self.upper.indptr[state : state + 2]
            text += [f"state {told}\n{note}\taction 0\n", *moves[first:end]]
        with replaced(place.parent) as draft:
            (draft / place.name).write_text("".join(text), encoding="utf-8")
        return place


@shown_in_notebooks
@arguments_checked
def interval_chain(
    scene: Any,
    scatter: Scattering | Grid | None = None,
    *,
    right: tuple[float, int] | None = None,
    wrong: float | None = None,
    absorbing: Mapping[str, Sequence[Place]] | None = None,
    starts: Sequence[Place] | None = None,
    cells: int | None = None,
    upper: Any = None,
    noise: float | None = None,
) -> IntervalChain:
    """Give a noisy scene, or a noisy map of a line, as an interval Markov chain, for model checkers.

    ``interval_chain(scene, scatter, right=...)`` of a scene, ``interval_chain(map, grid, noise=e)`` of a map.  For each
    cell the probability of each next cell is bounded, with proof, for every point of the cell.  A model checker's
    bounds are therefore bounds of the chain itself.  They are wider than those of
    `limitsets.robust.absorption_brackets`, which has functions on each cell in place of constants.

    Parameters
    ----------
    scene : Scene, str or NamedTuple
        A scene in the minimal model, or the name of one; or a map of one coordinate, or the lower corner of a box of
        its parameters.
    scatter : Scattering or Grid, optional
        Of a scene: uniform deviations of the landing place, and of the speed or not, independent of each other and of
        other throws; by default those of the scene.  Of a map: the cells.
    right : (float, int), optional
        Of a scene: x and side: a part at rest at x or beyond, on this side, has ended "right" [length].
    wrong : float, optional
        Of a scene: x: at rest there or beyond, on any other side, it has ended "wrong"; needs `right` [length].
    absorbing : mapping of str to sequence of (int, float, float), optional
        Further places that absorb: by name side, from x, to x [length].  The names become labels.
    starts : sequence of (int, float, float), optional
        Side, from x, to x: equally likely per length on all of them.  The first step leads from the state "init" to a
        start, so that n throws are n + 1 steps.  Of a scene by default as in `limitsets.robust.absorption_brackets`.
        Of a map by default none: then every cell is "init".
    cells : int, optional
        Of a scene: cells per side, by default 1000.
    upper : NamedTuple, optional
        Of a map: the upper corner of the parameters; they may be others at every step.
    noise : float, optional
        Of a map: each step lands within this distance of the image, evenly, whatever the steps before did [length].

    Returns
    -------
    IntervalChain
        Its `save` writes DRN text.

    Raises
    ------
    AnswerError
        A law that is not uniform, no noise of the landing, places or names that do not fit, or arguments of the other
        kind.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.robust import Scattering, Uniform
    >>> noise = Scattering(landing=Uniform(0.5))
    >>> chain = ls.interval_chain("paper-designed", noise, right=(20.5, 2), cells=50)
    >>> sorted(chain.labels), chain.states > 100
    (['exits', 'init', 'right'], True)

    Notes
    -----
    Interval chains: B. Jonsson and K. Larsen, LICS 1991; of noisy maps: M. Lahijanian, S. Andersson and C. Belta, IEEE
    Trans. Automatic Control 60 (2015) 2031.
    """
    guard()
    require_checker()
    import flint

    from limitsets.checker.balls import PRECISION

    kind, names = ("a map", "a scene")[isinstance(scene, Scene | str)], absorbing or {}
    other = (
        {"right": right, "wrong": wrong, "cells": cells}
        if kind == "a map"
        else {"upper": upper, "noise": noise}
    )
    require_none(other, "interval_chain", f"beside {kind}")
    require_cells(cells, "interval chain")
    if not all(name.isidentifier() and name.isascii() and name not in TAKEN for name in names):
        allowed = f"letters, digits and _, none of {', '.join(TAKEN)}"
        raise AnswerError("the names of absorbing places", ", ".join(names), allowed, "they become labels")
    with flint.ctx.workprec(PRECISION):
        if kind == "a map":
            require_map(scene, scatter, None, "interval_chain")
            corners = coerce(scene), coerce(scene if upper is None else upper)
            return _of_map(*corners, scatter, noise, starts or (), names)
        read = load(scene)
        places = absorbing_places(read, right, wrong, absorbing)
        begin = default_starts(read, right) if starts is None else starts
        return _of_scene(
            read, scattering_of(read) if scatter is None else scatter, begin, places, cells or CELLS
        )


# ----------------------------------------------------------------
# Where steps from cells lead.
#
# Rows of at, weight, side, lo, hi, sure, e: with this share of the law the images of the cell whose left node has the
# number `at` lie from lo to hi on the side, all of them (`sure`), or else some of them; steps land within e of these.


def _of_scene(
    scene: Scene, scatter: Any, starts: Sequence[Place], places: Mapping[str, Sequence[Place]], cells: int
) -> IntervalChain:
    """Bound the throws of a scene."""
    require_places(scene, "a start", starts)
    uniform = isinstance(scatter, Scattering) and isinstance(scatter.speed, Uniform | None)
    if not (uniform and isinstance(scatter.landing, Uniform) and scatter.landing.bound > 0.0):
        words = scatter.words() if isinstance(scatter, Scattering) else shown(scatter)
        allowed = "Scattering(landing=Uniform(e)) with e above 0, and speed=Uniform(d) or none"
        raise AnswerError("the noise", words, allowed, "under other laws a cell leads to nearly every cell")
    from limitsets.checker.absorption import LEFT
    from limitsets.checker.brackets import OUTERMOST, kinds_of, mesh_of
    from limitsets.checker.links import ABSORBED, Links
    from limitsets.checker.steps import Parts

    _, setting, nodes = setting_of(scene, scatter, starts, places, cells)
    noisy, parts = setting.noisy, Parts()
    mesh = mesh_of([nodes.place[nodes.of_side(k)] for k in range(len(noisy.sides))], OUTERMOST * noisy.far)
    kinds, absorbed = kinds_of(setting, mesh)
    # a cell that a place meets has both of its nodes among those of the place
    met = {EXITS if name == LEFT else name: np.intersect1d(some, some - 1) for name, some in absorbed.items()}
    gone, e, moves = kinds <= ABSORBED, float(noisy.landing.reach), list[Array]()
    for number in range(len(noisy.sides)):
        links = Links(noisy, number, mesh, mesh, kinds, parts)  # cells that it cannot follow become hard
        links.run(lambda more: None)
        first, end = mesh.first[number : number + 2].tolist()
        moves += [_throws(links, row, e) for row in parts.at_cells.rows if first <= row[0] < end]
    moves += [
        np.array([(at, 1.0, *two[k : k + 3], 0.0, e) for k in (0, 3)]) for at, _, *two in parts.hard.rows
    ]
    begin = [(side, float(lo), float(hi)) for side, lo, hi in setting.starts]
    return _put_together(scene.name, mesh, gone, met, np.concatenate(moves), begin)


def _throws(links: Any, collected: tuple[float, ...], e: float) -> Array:
    """Say where throws from a cell land, part by part of the law of the speed; by both branches where that is open."""
    at, deltas, rows = int(collected[0]), links.deltas, list[Array]()
    border, two = links.branch_of(at - links.start), links.place[at - links.start :][:2]
    # all throws land so far at most from those of the nodes, at every part of the law
    slack = 0.5 * (collected[4] - collected[3] - float(np.ptp(two))) + 2.0**-45 * links.noisy.far
    count = max((deltas.size - 1) * PARTS, 1)
    cuts = np.linspace(deltas[0], deltas[-1], count + 1)
    low, high = (np.interp(cuts, deltas, ends) for ends in (two.min(axis=0) - slack, two.max(axis=0) + slack))
    far = border.gap / links.law.most if border.gap < 1.0 else math.inf
    above = np.where(cuts[:-1] >= max(border.cut) + far, border.above, -1)
    ways = np.where(cuts[1:] <= min(border.cut) - far, border.below, above)
    for flips in (0, 1):
        some = (ways == flips) | (ways == -1)
        side, less, more = links.range_of(flips, 0.0, 0.0)
        ends = np.minimum(low[:-1], low[1:]) + less, np.maximum(high[:-1], high[1:]) + more
        columns = np.broadcast_arrays(at, 1.0 / count, side, *ends, ways == flips, e)
        rows.append(np.column_stack(columns)[some])
    return np.concatenate(rows)


def _of_map(
    lower: Any,
    upper: Any,
    grid: Any,
    noise: Any,
    starts: Sequence[Place],
    places: Mapping[str, Sequence[Place]],
) -> IntervalChain:
    """Bound the steps of a map of a line."""
    if grid.dimension != 1:
        raise AnswerError("the grid", f"{grid.dimension} axes", "one", "interval chains are of a line")
    require_noise(lower, upper, grid, noise, "pass noise=e: each step lands within e of the image")
    require_on_grid(grid, [*starts, *itertools.chain.from_iterable(places.values())])
    from limitsets.checker.brackets import OUTERMOST, mesh_of
    from limitsets.checker.noisy_map import steps_from

    jumps = [(side, x) for some in places.values() for side, *ends in some for x in ends]
    edges = [axes[0] for axes in cut_at_changes(lower, upper, grid, jumps).edges]
    mesh = mesh_of(edges, OUTERMOST * (float(np.abs(np.concatenate(edges)).max()) + noise))
    the_map, known, moves = as_checked(lower, upper, grid), dict[Any, Any](), list[Any]()
    left, right = mesh.place, np.append(mesh.place[1:], np.inf)
    side_of = np.repeat(np.arange(grid.sides), np.diff(mesh.first))
    outer = np.concatenate([mesh.first[:-1], mesh.first[1:] - 2])
    gone, met = np.zeros(mesh.place.size, bool), {EXITS: outer} | dict.fromkeys(places, np.zeros(0, int))
    gone[[*outer, *(mesh.first[1:] - 1)]] = True
    for name, (side, lo, hi) in [(name, place) for name, some in places.items() for place in some]:
        here = (side_of == side) & (left < hi) & (lo < right)
        met[name] = np.append(met[name], np.flatnonzero(here))
        gone |= here & (lo <= left) & (right <= hi)
    for at in np.flatnonzero(~gone).tolist():
        steps = steps_from(the_map, int(side_of[at]), at, (float(left[at]), float(right[at])), known)
        rows = [(step.to, *step.range, len(steps) == 1) for step in steps]
        anywhere = [(k, -left[-1], left[-1], 0.0) for k in range(grid.sides)]
        moves += [(at, 1.0, *row, noise) for row in rows or anywhere]
    return _put_together(type(lower).__name__, mesh, gone, met, np.array(moves), starts)


def _put_together(
    name: str, mesh: Any, gone: Mask, met: Mapping[str, Any], moves: Array, starts: Sequence[Place]
) -> IntervalChain:
    """Bound the probabilities from state to state.

    A cell is a state but where all of it absorbs (`gone`).  One that a place meets in part (`met`) counts as both: the
    upper bounds have it twice, the lower ones not at all.  The state of the starts has the number of a node without a
    cell, the last one of the first side.
    """
    from scipy import sparse

    n, begin, own = mesh.place.size, mesh.first[1:2][: len(starts)] - 1, np.flatnonzero(~gone)
    total = sum(hi - lo for _, lo, hi in starts)
    # even on a stretch: within half of it of its middle
    first = [
        (begin[0], (hi - lo) / total, k, *[0.5 * (lo + hi)] * 2, 1.0, 0.5 * (hi - lo)) for k, lo, hi in starts
    ]
    rows, names = np.concatenate([begin, own]), range(len(met))
    places = [(at, rows.size + k) for k, some in enumerate(met.values()) for at in some]
    into = np.array([*((at, k) for k, at in enumerate(rows)), *places])
    alone = into[np.bincount(into[:, 0])[into[:, 0]] == 1]
    states, bounds = rows.size + len(met), list[Any]()
    stay = sparse.csr_array((np.ones(len(met)), (names, [rows.size + k for k in names])), (len(met), states))
    shares = _shares(mesh, np.array([*first, *moves]))
    for table, some, off in zip(shares, (alone, into), (-OF_SUMS, OF_SUMS), strict=True):
        to = sparse.csr_array((np.ones(len(some)), tuple(some.T)), (n, states))
        bounds.append(sparse.vstack([(table @ to)[rows] * (1.0 + off), stay], format="csr"))
        bounds[-1].data = np.minimum(bounds[-1].data, 1.0)
        bounds[-1].sort_indices()
    side = np.searchsorted(mesh.first, own, side="right") - 1
    cells = zip(side.tolist(), mesh.place[own].tolist(), mesh.place[own + 1].tolist(), strict=True)
    labels = {"init": np.arange(begin.size or own.size)} | {
        word: np.array([rows.size + k]) for k, word in enumerate(met)
    }
    return IntervalChain(name, (*[None] * begin.size, *cells, *[None] * len(met)), labels, *bounds)


def _shares(mesh: Any, moves: Array) -> list[Any]:
    """Bound from below and above the probabilities from cells to cells, as sparse matrices by their left nodes."""
    from scipy import sparse

    n, size = mesh.place.size, mesh.size()
    left, right = mesh.place.copy(), np.append(mesh.place[1:], np.inf)
    left[mesh.first[:-1]], right[mesh.first[1:] - 2] = -np.inf, np.inf  # whatever lies out there
    tables = [sparse.csr_array((n, n)), sparse.csr_array((n, n))]
    for some in np.array_split(moves, len(moves) // AT_ONCE + 1):
        # shares are the same farther out
        reach = size + 2.0 * some[:, 6]
        lo, hi = np.clip(some[:, 3], -reach, reach), np.clip(some[:, 4], -reach, reach)
        span = mesh.within(some[:, 2], lo - some[:, 6], hi + some[:, 6])
        many = span.last - span.first + 1
        of = np.repeat(np.arange(many.size), many)
        cell = np.arange(of.size) - np.repeat(np.cumsum(many) - many, many) + span.first[of]
        at, weight, _, _, _, sure, e = some[of].T
        ends = lo[of], hi[of], np.clip(0.5 * (left[cell] + right[cell]), lo[of], hi[of])
        first, last, best = (
            (np.minimum(y + e, right[cell]) - np.maximum(y - e, left[cell])) / (2.0 * e) for y in ends
        )
        slack = OF_PLACES * (size / e + 1.0)
        bounds = sure * (np.minimum(first, last) - slack), best + slack
        for k, bound in enumerate(bounds):
            share = weight * np.clip(bound, 0.0, 1.0)
            tables[k] += sparse.csr_array(
                (share[share > 0.0], (at[share > 0.0].astype(int), cell[share > 0.0])), (n, n)
            )
    return tables
