"""The average of a function along almost every orbit of an expanding map on a line: what the checker confirms.

docs/certificates.md, "Certificates of any map", the claim `average`, and limitsets/checker/map_average.py, which has
the theorem: numbers u and w by cell that satisfy two inequalities on every cell prove the bound c.  `average_search`
finds them in floats; what it finds is proved once the checker, which shares no code with this, has confirmed it.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from limitsets.base import AnswerError, Progress, arguments_checked, shown, shown_in_notebooks
from limitsets.base.arrays import Array
from limitsets.proofs.prover.average_search import Values, search_component
from limitsets.proofs.prover.certificate import DeniedError
from limitsets.proofs.prover.certificate_of_map import hexed
from limitsets.proofs.prover.of_map import certify_map
from limitsets.proofs.prover.programs import evaluate
from limitsets.proofs.prover.proof import Claim, undecided
from limitsets.proofs.prover.proof_of_map import Average, ProofOfMap
from limitsets.proofs.prover.recording import names_of, recorded
from limitsets.systems.cells import Grid
from limitsets.systems.maps import coerce, images, kind_of
from limitsets.systems.maps.critical import margins

# By how much s and D are larger than floats give, and what remains between the bounds: the checker's are wider by less,
# if not at the first time.
WIDER = ((1.02, 0.02), (1.2, 0.2), (2.0, 2.0))
# Half the width of a cell that holds a change, as a share of its side, and beyond what a range of parameters makes it;
# steps that find it.
TINY, MORE, BISECTIONS = 2.0**-40, 2.0**-20, 60


# ---------------------------------------------------------------- what is averaged


class Observable(NamedTuple):
    """A function that is averaged: as a certificate names it, its values, and where it jumps, by side."""

    section: dict[str, Any]
    values: Values
    jumps: Sequence[tuple[int, float]] = ()


@np.errstate(divide="ignore")  # a slope of 0, where nothing is proved
def _logarithm(_: Array, __: int, slope: Array) -> Array:
    return np.asarray(np.log(np.abs(slope)))


def observable_of(of: Any, params: Any) -> Observable:
    """Read what is averaged: the word "lyapunov", boxes whose share of time is asked for, or a function of x."""
    if of == "lyapunov":
        return Observable({"lyapunov": True}, _logarithm)
    if callable(of):
        program = recorded(lambda _, x, __: of(x), params, 1, 0)
        numbers = dict(names_of(params))
        formula = {key: program[key] for key in ("ops", "out")}
        return Observable(
            {"formula": formula}, lambda x, _, __: np.asarray(evaluate(program, x[:, None], numbers)[:, 0])
        )
    try:
        boxes = {0: of} if not isinstance(of, dict) else of
        spans = [(int(side), float(lo), float(hi)) for side, listed in boxes.items() for lo, hi in listed]
    except (TypeError, ValueError):
        spans = []
    if not spans or not all(lo < hi for _, lo, hi in spans):
        allowed = '"lyapunov", a function of x, or ranges [(lo, hi)] whose share of time is asked for'
        raise AnswerError("the function to average", shown(of), allowed, 'pass "lyapunov"')
    listed = [{"side": side, "box": hexed(np.array([[lo, hi]]))} for side, lo, hi in spans]

    def share(x: Array, side: int, _: Array) -> Array:
        inside = [(lo <= x) & (x <= hi) for s, lo, hi in spans if s == side]
        return np.asarray(np.any([np.zeros(x.size, dtype=bool), *inside], axis=0), dtype=np.float64)

    return Observable({"share": listed}, share, [(side, end) for side, *ends in spans for end in ends])


# ---------------------------------------------------------------- cells that hold a change of branch


def cut_at_changes(lower: Any, upper: Any, grid: Grid, jumps: Sequence[tuple[int, float]]) -> Grid:
    """Cut the cells of a line at jumps of what is averaged, and so that changes of branch lie in very small ones."""
    edges = []
    for side, (borders,) in enumerate(grid.edges):
        tiny = TINY * (borders[-1] - borders[0])
        for end in [end for s, end in jumps if s == side and borders[0] + tiny < end < borders[-1] - tiny]:
            borders = np.sort(np.append(borders[np.abs(borders - end) > tiny], end))
        first, last = (_changes_at(params, grid, side) for params in (lower, upper))
        if len(first) != len(last):  # changes come and go between the corners
            edges.append((borders,))
            continue
        # the checker's balls of a range of parameters are wider by a share of it, and next to the change no cell may be
        # shorter than what its ends move by
        least, most, moves = np.minimum(first, last), np.maximum(first, last), np.abs(last - first)
        beyond = tiny + MORE * moves
        for lo, hi, apart in zip(least - beyond, most + beyond, tiny + 8.0 * moves, strict=True):
            if borders[0] + tiny < lo and hi < borders[-1] - tiny:  # else f begins or ends on the seam
                kept = (borders < lo - apart) | (borders > hi + apart)
                kept[[0, -1]] = True
                borders = np.sort(np.concatenate([borders[kept], [lo, hi]]))
        edges.append((borders,))
    return Grid(grid.domain, tuple(edges))


def _changes_at(params: Any, grid: Grid, side: int) -> Array:
    """Find where the branch changes between borders of cells, or the image passes the seam of an axis that closes."""
    borders, first = grid.edges[side][0], grid.domain.lo[side, 0]
    period = grid.domain.hi[side, 0] - first

    def level(x: Array) -> Array:
        if kind_of(params).has_margin:
            return np.asarray(margins(params, x, side) > 0.0, dtype=np.float64)
        after = images(params, x, side).x.ravel()
        return np.floor((after - first) / period) if grid.domain.closes else np.zeros(x.size)

    at = level(borders)
    k = np.flatnonzero(at[1:] != at[:-1])
    lo, hi, below = borders[k], borders[k + 1], at[k]
    for _ in range(BISECTIONS):
        middle = 0.5 * (lo + hi)
        same = level(middle) == below
        lo, hi = np.where(same, middle, lo), np.where(same, hi, middle)
    return np.asarray(np.sort(0.5 * (lo + hi)))


# ---------------------------------------------------------------- the answer


def _average(proof: ProofOfMap, observable: Observable, wider: float, share: float) -> Average | str:
    """Find the numbers of all components, with bounds that are wider by a share; or say what is missing."""
    grid, component = proof.graph.grid, proof.arrays["component"]
    upper, lower, weight = np.zeros((3, grid.n_cells))
    runs, columns = list[tuple[int, int]](), list[tuple[int, str, str]]()
    for number in range(int(component.max()) + 1):
        own = component == number
        beside, numbers = search_component(proof, own, observable.values, wider)
        if isinstance(numbers, str):
            return numbers
        upper[own], lower[own], weight[own], low, high = numbers
        runs += list(zip(beside[::2], beside[1::2], strict=True))
        wide = share * (high - low) + 2.0**-42 * (
            max(abs(low), abs(high), 1.0) + float(np.abs([upper[own], lower[own]]).max())
        )
        columns.append((number, (low - wide).hex(), (high + wide).hex()))
    components, lower_ends, upper_ends = (list(column) for column in zip(*columns, strict=True))
    section = {"of": observable.section, "components": components, "lower": lower_ends, "upper": upper_ends}
    arrays = {"average.upper": upper, "average.lower": lower, "average.weight": weight}
    return Average(section, arrays | {"average.runs": np.array(runs, np.int32).reshape(len(runs), 2)})


UNSOLVED = (
    "{reason}: an average is proved where steps stretch: no cycle that attracts or is neutral, no slope 0, no change of"
    " branch that comes back to its own side too soon; finer cells may help"
)


def averaged(proof: ProofOfMap, of: Any) -> ProofOfMap:
    """Prove between which numbers the average of a function lies, as the checker confirms it; the claim `average`."""
    observable = observable_of(of, proof.map)
    if not len(proof.cells):
        reason = "there are no attracting cells: widen the domain, or pass periodic=True for a map modulo its width"
        return replace(proof, claims=(undecided("average", reason),))
    reason = ""
    for room in WIDER:
        average = _average(proof, observable, *room)
        if isinstance(average, str):
            return replace(proof, claims=(undecided("average", UNSOLVED.format(reason=average)),))
        claim = Claim("average", "proved", "", average.section)
        answer = replace(proof, claims=(*proof.claims, claim), average=average)
        with tempfile.TemporaryDirectory() as folder:
            try:
                answer.save(Path(folder) / "average.proof.zip")
            except DeniedError as error:
                reason = error.claims.get("average", "")
            else:
                return answer
    return replace(proof, claims=(undecided("average", f"the checker does not confirm it: {reason}"),))


@shown_in_notebooks
@arguments_checked
def average(
    map: Any,  # noqa: A002  # the field's word
    grid: Grid | None = None,
    of: Any = "lyapunov",
    *,
    upper: Any = None,
    progress: Progress | None = None,
) -> ProofOfMap:
    """Prove between which numbers the average of a function along almost every orbit lies.

    For a map of a line whose steps stretch distances, on average.  For almost every start in an attracting component
    the average of the function over n steps converges, to a number between the two; so does its mean over every
    invariant density.  Single starts, such as those on a periodic orbit, may have other averages.

    Parameters
    ----------
    map : NamedTuple
        A map of one coordinate, or the lower corner of a box of its parameters.  Kinks and jumps of its formulas have
        to be changes between its two branches, ``limitsets.map(pieces=(f, g), margin=m)``, or where the image passes
        the seam of an axis that closes: ``b * x`` on ``limitsets.grid([(0, 1)], cells=1000, periodic=True)`` is b x
        modulo 1.
    grid : Grid
        The cells: the bounds come nearer as 1/cells.
    of : "lyapunov", callable or sequence of (float, float)
        What is averaged: "lyapunov" for ln |dx'/dx|, a function of x, or ranges of x for the share of steps that are
        in them (a dict gives ranges by side).
    upper : NamedTuple, optional
        The upper corner of the parameters; the bounds hold for every fixed value between.
    progress : callable, optional
        Called with the step, how much of it is done, and of how much.

    Returns
    -------
    ProofOfMap
        With the claim `average`; its `average.bounds` has by component the two numbers, where it is proved.

    Raises
    ------
    AnswerError
        For a scene, a map of more coordinates, or what is none of these functions.

    Examples
    --------
    >>> import math
    >>> import limitsets as ls
    >>> def stretched(x, b): return b * x  # modulo 1
    >>> circle = ls.grid([(0.0, 1.0)], cells=200, periodic=True)
    >>> proof = ls.average(ls.map(stretched, b=2.6), circle)
    >>> lo, hi = proof.average.bounds[0]
    >>> lo < math.log(2.6) < hi, hi - lo < 1e-9
    (True, True)
    """
    if not isinstance(map, tuple):
        way = "make one with limitsets.map; of a scene limitsets.noise_statistics samples such numbers"
        raise AnswerError("the map of an average", shown(map), "a map of a line, and no scene", way)
    if grid is None:
        way = "limitsets.average(map, limitsets.grid([(lo, hi)], cells=1000))"
        raise AnswerError("the grid of an average", None, "the cells to prove it on", f"pass {way}")
    if grid.dimension != 1:
        raise AnswerError("the grid of an average", f"{grid.dimension} axes", "one", "averages are of a line")
    corners = coerce(map), coerce(map if upper is None else upper)
    cells = cut_at_changes(*corners, grid, observable_of(of, corners[0]).jumps)
    return averaged(certify_map(map, cells, ["invariant"], upper=upper, progress=progress), of)
