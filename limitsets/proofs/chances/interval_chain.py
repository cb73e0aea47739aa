"""A noisy scene, or a noisy map of a line, as an interval Markov chain, which model checkers read (DRN text; Storm).

A cell leads to each next cell with a probability between two numbers, which hold for every point of the cell.
The probability that a step lands in a cell, as a function of the image y, is the length that the cell has in common
with [y - e, y + e], over 2e: least at an end of a range of y, largest where y is nearest the middle of the cell.  Where
a cell's images lie is what the checker proves (`limitsets/checker/links.py`, `noisy_map.py`), at strata of the speed.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from limitsets.base import (
    AnswerError,
    Column,
    Progress,
    Table,
    Tabled,
    arguments_checked,
    as_table,
    picked,
    replaced,
    shown,
    shown_in_notebooks,
    silent,
)
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.scattering import Scattering, Uniform, scattering_of
from limitsets.feeder.scene import Scene, load
from limitsets.numbers.interval import guard
from limitsets.proofs.chances.absorption import absorbing_places, default_starts
from limitsets.proofs.chances.chain import EXITS, Place, require_places, setting_of
from limitsets.proofs.prover.averages_of_map import cut_at_changes
from limitsets.proofs.prover.certificate import require_checker
from limitsets.proofs.prover.certificate_of_map import parameters_of
from limitsets.proofs.prover.certifying import require_map, require_none
from limitsets.proofs.prover.programs import periods_of, recorded_map
from limitsets.systems.cells import Grid
from limitsets.systems.maps import coerce
from limitsets.systems.maps.contract import require_corners

if TYPE_CHECKING:
    from limitsets.checker.links import Links
    from limitsets.checker.means import Mesh

CELLS = 1000
# Parts into which each stratum of the speed is cut: between its ends landing places are linear, up to what is proved.
PARTS = 4
# Against the roundings of places, per share of a cell, and of sums.
OF_PLACES, OF_SUMS = 2.0**-49, 2.0**-40
# Ranges of images that are shared out to cells at a time.
AT_ONCE = 20_000
# Names that a model checker gives itself.
TAKEN = ("init", "deadlock", "start")


@dataclass(frozen=True, eq=False)
class IntervalChain(Tabled):
    """An interval Markov chain: the chain of a scene or a map is one of those that it allows.

    A state is a cell, or a place that absorbs.  From every point of a cell the probability of each next state lies
    between the two numbers of a transition, whatever the steps before did.

    Attributes
    ----------
    name : str
        Of what it is the chain.
    labels : dict of str to ndarray of int
        By label the states that have it: "init", the places that absorb, and the exits ("exits").
    cells : tuple of (int, float, float) or None
        By state the cell: side, from x, to x; None for states that are no cell [length].
    row, column : ndarray of int
        From which state a transition leads, and to which.
    lower, upper : ndarray
        Between which two numbers its probability lies; a lower one may be 0.
    seconds : float
        Time it took.
    """

    name: str
    labels: dict[str, Ints]
    cells: tuple[Place | None, ...]
    row: Ints
    column: Ints
    lower: Array
    upper: Array
    seconds: float

    @property
    def states(self) -> int:
        """The number of states."""
        return len(self.cells)

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        zero = int((self.lower == 0.0).sum())
        wide = float((self.upper - self.lower).max())
        columns = ("states", "transitions", "with lower bound 0", Column("widest interval", show=".3g"))
        rows = [(self.states, self.row.size, zero, wide)]
        return (Table(columns, rows, f"{self.name}: interval chain", f"labels: {', '.join(self.labels)}"),)

    def to_json(self) -> dict[str, Any]:
        """Give it as JSON takes it."""
        return as_table(
            **picked(self, "name", "states", "labels", "cells", "row", "column", "lower", "upper")
        )

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
        ...     print(chain.save(f"{folder}/half.drn").read_text().partition("@model")[2])
        <BLANKLINE>
        state 0 exits
                action 0
                        0 : [1.0, 1.0]
        state 1 init
        //[0, -1.0, 0.0]
                action 0
                        1 : [0.4999999999995417, 1.0]
                        2 : [0.0, 0.5000000000004583]
        state 2 init
        //[0, 0.0, 1.0]
                action 0
                        1 : [0.0, 0.5000000000004583]
                        2 : [0.4999999999995417, 1.0]
        <BLANKLINE>
        """
        place, told = Path(path), [""] * self.states
        for label, states in self.labels.items():
            for state in states.tolist():
                told[state] += f" {label}"
        first = np.searchsorted(self.row, np.arange(self.states + 1)).tolist()
        columns = (column.tolist() for column in (self.column, self.lower, self.upper))
        moves = [f"\t\t{to} : [{lo!r}, {hi!r}]\n" for to, lo, hi in zip(*columns, strict=True)]
        with replaced(place.parent) as draft, (draft / place.name).open("w", encoding="utf-8") as file:
            file.write(
                f"// interval chain of {' '.join(self.name.split())}; cells as //[side, from x, to x]\n"
            )
            file.write("@type: DTMC\n@value_type: double-interval\n@parameters\n\n@reward_models\n\n")
            file.write(f"@nr_states\n{self.states}\n@nr_choices\n{self.states}\n@model\n")
            for state, cell in enumerate(self.cells):
                note = "" if cell is None else f"//[{', '.join(map(repr, cell))}]\n"
                file.write(f"state {state}{told[state]}\n{note}\taction 0\n")
                file.writelines(moves[first[state] : first[state + 1]])
        return place


@overload
def interval_chain(
    scene: Scene | str,
    scatter: Scattering | None = None,
    *,
    right: tuple[float, int] | None = None,
    wrong: float | None = None,
    absorbing: Mapping[str, Sequence[Place]] | None = None,
    starts: Sequence[Place] | None = None,
    cells: int | None = None,
    progress: Progress | None = None,
) -> IntervalChain: ...
@overload
def interval_chain(
    scene: tuple[Any, ...],
    scatter: Grid,
    *,
    absorbing: Mapping[str, Sequence[Place]] | None = None,
    starts: Sequence[Place] | None = None,
    upper: Any = None,
    noise: float,
    progress: Progress | None = None,
) -> IntervalChain: ...
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
    progress: Progress | None = None,
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
        Of a map by default none: then every cell is initial.
    cells : int, optional
        Of a scene: cells per side, by default 1000.
    upper : NamedTuple, optional
        Of a map: the upper corner of the parameters; they may be others at every step.
    noise : float, optional
        Of a map: each step lands within this distance of the image, evenly, whatever the steps before did [length].
    progress : callable, optional
        Called with the step, how much of it is done, and of how much.

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
    begun, tell = time.perf_counter(), progress or silent
    guard()
    require_checker()
    import flint

    from limitsets.checker.balls import PRECISION

    of_scene = isinstance(scene, Scene | str)
    own, other = {"right": right, "wrong": wrong, "cells": cells}, {"upper": upper, "noise": noise}
    require_none(
        other if of_scene else own, "interval_chain", "beside a scene" if of_scene else "beside a map"
    )
    for name in absorbing or {}:
        if not (name.isidentifier() and name.isascii()) or name in (*TAKEN, EXITS):
            allowed = f"letters, digits and _, none of {', '.join((*TAKEN, EXITS))}"
            raise AnswerError("the name of absorbing places", name, allowed, "choose another: it is a label")
    with flint.ctx.workprec(PRECISION):
        if of_scene:
            if isinstance(scatter, Grid):
                raise AnswerError("the noise", shown(scatter), "a Scattering", "leave the grid out; pass cells=")
            read = load(scene)
            law = scattering_of(read) if scatter is None else scatter
            places = absorbing_places(read, right, wrong, absorbing)
            begin = default_starts(read, right) if starts is None else starts
            require_places(read, "a start", begin)
            title, table = read.name, _of_scene(read, law, begin, places, cells or CELLS, tell)
        else:
            require_map(scene, scatter, None, "interval chain")
            corners = coerce(scene), coerce(scene if upper is None else upper)
            title = type(corners[0]).__name__
            table = _of_map(*corners, scatter, noise, starts or (), absorbing or {})
    return IntervalChain(title, **table, seconds=time.perf_counter() - begun)


# ----------------------------------------------------------------
# Where steps from cells lead.
#
# Rows of at, weight, side, lo, hi, sure: with this share of the law the images of the cell whose left node has the
# number `at` lie from lo to hi on the side, all of them, or else some of them.


def _of_scene(
    scene: Scene,
    scatter: Scattering,
    starts: Sequence[Place],
    places: Mapping[str, Sequence[Place]],
    cells: int,
    tell: Progress,
) -> dict[str, Any]:
    """Bound the throws of a scene."""
    for thing, law in (("the landing place", scatter.landing), ("the speed", scatter.speed)):
        if not isinstance(law, Uniform | None) or (law is scatter.landing and not (law and law.bound > 0.0)):
            allowed = "Uniform(e) with e above 0" if law is scatter.landing else "Uniform, or none"
            remedy = "under other laws nearly every cell leads to every cell"
            raise AnswerError(f"the law of {thing}", law, allowed, remedy)
    from limitsets.checker.brackets import LEFT, OUTERMOST, kinds_of, mesh_of
    from limitsets.checker.links import ABSORBED, Links
    from limitsets.checker.steps import Parts

    _, setting, nodes = setting_of(scene, scatter, starts, places, cells)
    noisy, done = setting.noisy, 0

    def told(more: int) -> None:
        nonlocal done
        done = min(done + more, nodes.place.size)
        tell("cells", done, nodes.place.size)

    mesh = mesh_of([nodes.place[nodes.of_side(k)] for k in range(len(noisy.sides))], OUTERMOST * noisy.far)
    kinds, absorbed = kinds_of(setting, mesh)
    gone = kinds == ABSORBED
    # a cell belongs to a place where both of its nodes do: surely so if all of it absorbs and there is one such place
    met = {name: [k for k in some.tolist() if k + 1 in set(some.tolist())] for name, some in absorbed.items()}
    moves = []
    for number in range(len(noisy.sides)):
        parts = Parts()
        links = Links(
            noisy, number, mesh, mesh, kinds, parts
        )  # what it cannot follow becomes hard in `kinds`
        links.run(told)
        moves += [_throws(links, row) for row in parts.at_cells.rows]
        for at, _, *two in parts.hard.rows:
            moves.append(np.array([(at, 1.0, *two[:3], 0.0), (at, 1.0, *two[3:6], 0.0)]))
    begin = [(side, float(lo), float(hi)) for side, lo, hi in setting.starts]
    named = {EXITS if name == LEFT else name: some for name, some in met.items()}
    return _put_together(mesh, gone, named, moves, begin, float(noisy.landing.reach))


def _throws(links: Links, collected: tuple[float, ...]) -> Array:
    """Say where throws from a cell land, part by part of the law of the speed; by both branches where that is open."""
    at, _, _, lo, hi = collected[:5]
    cell, deltas = int(at) - links.start, links.deltas
    border, two = links.branch_of(cell), links.place[cell : cell + 2]
    # all throws land so far at most from those of the nodes, at every part of the law
    slack = 0.5 * ((hi - lo) - float(np.ptp(two))) + 2.0**-45 * links.noisy.far
    count = max((deltas.size - 1) * PARTS, 1)
    cuts = np.linspace(deltas[0], deltas[-1], count + 1)
    low = np.interp(cuts, deltas, two.min(axis=0)) - slack
    high = np.interp(cuts, deltas, two.max(axis=0)) + slack
    low, high = np.minimum(low[:-1], low[1:]), np.maximum(high[:-1], high[1:])
    far = border.gap / links.law.most if border.gap < 1.0 else math.inf
    below, above = cuts[1:] <= min(border.cut) - far, cuts[:-1] >= max(border.cut) + far
    rows = []
    for flips in (0, 1):
        sure = (below & (border.below == flips)) | (above & (border.above == flips))
        if border.below == border.above:
            sure = np.full(count, border.below == flips)
        some = sure | ((border.below != border.above) & ~below & ~above)
        side, *off = links.range_of(flips, 0.0, 0.0)
        columns = (
            np.full(count, at),
            np.full(count, 1.0 / count),
            np.full(count, side),
            low + off[0],
            high + off[1],
        )
        rows.append(np.column_stack([*columns, sure])[some])
    return np.concatenate(rows)


def _of_map(
    lower: Any,
    upper: Any,
    grid: Any,
    noise: float | None,
    starts: Sequence[Place],
    places: Mapping[str, Sequence[Place]],
) -> dict[str, Any]:
    """Bound the steps of a map of a line."""
    require_corners(lower, upper)
    if grid.dimension != 1 or grid.domain.closes:
        raise AnswerError("the grid", shown(grid), "of one axis that ends", "noise is of lines that end")
    widest = float((grid.domain.hi - grid.domain.lo).max())
    if noise is None or not 2.0**-30 * widest < noise < widest:
        raise AnswerError("the noise", noise, f"above 0, below {widest:.6g}", "pass noise=e")
    each = [(f'a place that is "{name}"', place) for name, some in places.items() for place in some]
    for thing, (side, lo, hi) in [*each, *(("a start", place) for place in starts)]:
        first, last = (ends[side, 0] if side in range(grid.sides) else math.nan for ends in _ends(grid))
        if not first <= lo < hi <= last:
            raise AnswerError(thing, (side, lo, hi), "(side, from x, to x) on the grid", "correct it")
    from limitsets.checker.any_map import Map, read_map, read_parameters
    from limitsets.checker.brackets import OUTERMOST, mesh_of
    from limitsets.checker.noisy_map import steps_from

    jumps = [(side, x) for _, (side, *two) in each for x in two]
    fine = cut_at_changes(lower, upper, grid, jumps)
    shape = read_map(recorded_map(lower, grid.sides) | {"periodic": periods_of(grid.domain)})
    the_map = Map(shape, read_parameters(parameters_of(lower, upper), shape.names, "the map"))
    size = float(np.abs([grid.domain.lo, grid.domain.hi]).max()) + noise + widest
    mesh = mesh_of([axes[0] for axes in fine.edges], OUTERMOST * size)
    gone, moves = np.zeros(mesh.place.size, dtype=bool), list[Array]()
    met: dict[str, list[int]] = {name: [] for name in (EXITS, *places)}
    for side, (first, end) in enumerate(itertools.pairwise(mesh.first.tolist())):
        known: dict[tuple[int, int, float], Any] = {}
        gone[[first, end - 2]] = True
        met[EXITS] += [first, end - 2]
        for at in range(first + 1, end - 2):
            lo, hi = mesh.place[at : at + 2].tolist()
            here = [
                name
                for name, some in places.items()
                if any(s == side and a < hi and lo < b for s, a, b in some)
            ]
            whole = [
                name for name in here if any(s == side and a <= lo and hi <= b for s, a, b in places[name])
            ]
            gone[at] = bool(whole)
            for name in here:
                met[name].append(at)
            steps = steps_from(the_map, side, at, (lo, hi), known)
            rows = [(at, 1.0, step.to, *step.range, len(steps) == 1) for step in steps]
            anywhere = [(at, 1.0, other, -2.0 * size, 2.0 * size, 0.0) for other in range(grid.sides)]
            moves.append(np.array(rows or anywhere, dtype=float))
    return _put_together(mesh, gone, met, moves, starts, noise)


def _ends(grid: Grid) -> tuple[Array, Array]:
    return grid.domain.lo, grid.domain.hi


# ----------------------------------------------------------------
# The chain: bounds from cells to cells, and these put together to states.


def _put_together(
    mesh: Mesh,
    gone: Mask,
    met: Mapping[str, Sequence[int]],
    moves: Iterable[Array],
    starts: Sequence[Place],
    e: float,
) -> dict[str, Any]:
    """Bound the probabilities from state to state: labels, cells, and the columns of the transitions.

    A cell is a state but where all of it absorbs (`gone`).  One that a place meets in part (`met`) counts as both: the
    upper bounds have it twice, the lower ones of the place not at all.
    """
    from scipy import sparse

    n, begins = mesh.place.size, int(bool(starts))
    inner = np.ones(n, dtype=bool)
    inner[mesh.first[1:] - 1] = False  # between the last node of a side and the first of the next is no cell
    own = np.flatnonzero(inner & ~gone)
    before = begins + len(met)
    several = np.bincount([at for some in met.values() for at in some], minlength=n)
    into = [(at, begins + k) for k, some in enumerate(met.values()) for at in some]
    some_of = np.array([*into, *((at, before + k) for k, at in enumerate(own.tolist()))])
    all_of = some_of[several[some_of[:, 0]] == np.where(some_of[:, 1] < before, gone[some_of[:, 0]], 0)]
    bounds = []
    for table, to in zip(_shares(mesh, moves, starts, e), (all_of, some_of), strict=True):
        states = sparse.csr_array((np.ones(len(to)), tuple(to.T)), shape=(n, before + own.size))
        # the starts stand in the row of a node that has no cell
        rows = np.concatenate([mesh.first[1 : 1 + begins] - 1, own])
        bounds.append((table @ states).tocsr()[rows].tocoo())
    lower, upper = bounds
    stay = np.arange(begins, before)
    row, column = (
        np.concatenate([np.where(upper.row < begins, 0, upper.row + before - begins), stay]),
        np.concatenate([upper.col, stay]),
    )
    least = np.asarray(lower.tocsr()[upper.row, upper.col]).ravel() * (1.0 - OF_SUMS)
    ones = np.ones(stay.size)
    columns = (
        row,
        column,
        np.append(least, ones),
        np.append(np.minimum(upper.data * (1.0 + OF_SUMS), 1.0), ones),
    )
    order = np.lexsort((column, row))
    side = np.repeat(np.arange(mesh.first.size - 1), np.diff(mesh.first))
    cells = zip(side[own].tolist(), mesh.place[own].tolist(), mesh.place[own + 1].tolist(), strict=True)
    labels = {"init": np.array([0]) if begins else np.arange(before, before + own.size)}
    labels |= {name: np.array([begins + k]) for k, name in enumerate(met)}
    table = zip(("row", "column", "lower", "upper"), (each[order] for each in columns), strict=True)
    return {"labels": labels, "cells": (*[None] * before, *cells), **dict(table)}


def _shares(mesh: Mesh, moves: Iterable[Array], starts: Sequence[Place], e: float) -> list[Any]:
    """Bound from below and above the probabilities from cells to cells, as sparse matrices by their left nodes.

    Starts stand in the row of the last node of the first side, which has no cell.
    """
    from scipy import sparse

    n, size, rows = mesh.place.size, mesh.size(), np.concatenate([*moves])
    left, right = mesh.place.copy(), np.append(mesh.place[1:], np.inf)
    left[mesh.first[:-1]], right[mesh.first[1:] - 2] = -np.inf, np.inf  # whatever lies out there
    slack, total = OF_PLACES * (size / e + 1.0), sum(hi - lo for _, lo, hi in starts)
    tables = [sparse.csr_array((n, n)), sparse.csr_array((n, n))]
    for some in np.array_split(rows, len(rows) // AT_ONCE + 1):
        lo, hi = np.clip(
            some[:, 3:5].T, -size - 2.0 * e, size + 2.0 * e
        )  # the shares are the same farther out
        of, cell = _met(mesh, some[:, 2], lo - e, hi + e)
        lo, hi, a, b = lo[of], hi[of], left[cell], right[cell]
        at, weight, sure = some[of, 0].astype(np.int64), some[of, 1], some[of, 5]

        def share(y: Array, a: Array = a, b: Array = b) -> Array:
            return np.clip((np.minimum(y + e, b) - np.maximum(y - e, a)) / (2.0 * e), 0.0, 1.0)

        least = sure * np.maximum(np.minimum(share(lo), share(hi)) - slack, 0.0)
        most = np.minimum(share(np.clip(0.5 * (a + b), lo, hi)) + slack, 1.0)
        for k, bound in enumerate((least, most)):
            tables[k] += sparse.csr_array((weight * bound, (at, cell)), shape=(n, n))
    for side, lo, hi in starts:
        of, cell = _met(mesh, np.array([side]), np.array([lo]), np.array([hi]))
        length = np.maximum(np.minimum(hi, right[cell]) - np.maximum(lo, left[cell]), 0.0) / total
        for k, off in enumerate((-1.0, 1.0)):
            bound = np.clip(length + off * OF_PLACES * (size / total + 1.0), 0.0, 1.0)
            tables[k] += sparse.csr_array((bound, (of + mesh.first[1] - 1, cell)), shape=(n, n))
    return tables


def _met(mesh: Mesh, side: Array, lo: Array, hi: Array) -> tuple[Ints, Ints]:
    """List the cells that ranges meet, or may meet by roundings: the number of the range, and the cell."""
    span = mesh.within(side, lo, hi)
    many = span.last - span.first + 1
    of = np.repeat(np.arange(many.size), many)
    return of, np.arange(of.size) - np.repeat(np.cumsum(many) - many, many) + span.first[of]
