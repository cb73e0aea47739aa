"""Prove averages along almost every orbit: of a map of a line, or of a scene."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, overload

from limitsets.base import AnswerError, Progress, arguments_checked, shown_in_notebooks
from limitsets.feeder.scene import Scene, load
from limitsets.proofs.prover.averages_of_map import asked_of_map, averaged, cut_at_changes
from limitsets.proofs.prover.averages_of_scene import averages_of_scene
from limitsets.proofs.prover.certifying import require_cells, require_map, require_none
from limitsets.proofs.prover.long_run_of_map import LongRunOfMap, long_run_of_map
from limitsets.proofs.prover.of_map import certify_map
from limitsets.proofs.prover.proof import Proof
from limitsets.proofs.prover.proof_of_map import ProofOfMap
from limitsets.systems.cells import Grid
from limitsets.systems.maps import coerce


@overload
def average(
    map: Scene | str | Path,
    grid: Any = None,
    of: Any = None,
    *,
    cells: int | None = None,
    progress: Progress | None = None,
) -> Proof: ...
@overload
def average(
    map: tuple[Any, ...],
    grid: Grid | None = None,
    of: Any = None,
    *,
    upper: Any = None,
    progress: Progress | None = None,
) -> ProofOfMap: ...
@overload
def average(
    map: tuple[Any, ...],
    grid: Grid | None = None,
    of: Any = None,
    *,
    upper: Any = None,
    noise: float | Mapping[str, float],
    progress: Progress | None = None,
) -> LongRunOfMap: ...
@shown_in_notebooks
@arguments_checked
def average(
    map: Any,  # noqa: A002  # the field's word
    grid: Any = None,
    of: Any = None,
    *,
    upper: Any = None,
    noise: float | Mapping[str, float] | None = None,
    cells: int | None = None,
    progress: Progress | None = None,
) -> Proof | ProofOfMap | LongRunOfMap:
    """Prove between which numbers averages along almost every orbit lie.

    ``average(scene, of)`` of a scene, or ``average(map, grid, of)`` of a map of a line, whose steps stretch distances
    on average.  For almost every start in an attracting component the average of a function over n steps converges, to
    a number between the two; so does its mean over every invariant density.  Single starts, such as those on a periodic
    orbit, may have other averages.

    Parameters
    ----------
    map : Scene, str, Path or NamedTuple
        A scene, what `limitsets.load` takes; or a map of one coordinate, or the lower corner of a box of its
        parameters.  Kinks and jumps of its formulas have to be changes between its two branches,
        ``limitsets.map(pieces=(f, g), margin=m)``, or where the image passes the seam of an axis that closes: ``b * x``
        on ``limitsets.grid([(0, 1)], cells=1000, periodic=True)`` is b x modulo 1.
    grid : Grid
        Of a map alone: the cells; the bounds come nearer as 1/cells.  Behind a scene what is averaged may stand here.
    of : str, callable, sequence of (float, float), or a list of some of these
        What is averaged: "lyapunov" for ln |dx'/dx|, a function of x, or ranges of x for the share of steps that are
        in them (a dict gives ranges by side).  Of a scene also "flips_per_throw", "side_shares" and "jogs_per_visit".
        A list
        ``[[(0.0, 0.5)], [(0.5, 1.0)]]`` of lists of ranges is a histogram.  Default: "lyapunov", of a scene all words.
    upper : NamedTuple, optional
        Of a map alone: the upper corner of the parameters; the bounds hold for every fixed value between.
    noise : float or mapping of str to float, optional
        Of a map alone: each step lands within this distance of the image, evenly, whatever the steps before did.  Or by
        name what deviates evenly at every step and by how much: ``{"landing": 0.001, "r": 0.02}``, a parameter.  Then
        the map need not stretch: ln |f'| may have slopes 0, and cube roots with an infinite one.  What holds is said of
        every start, almost surely: what the average tends to, if only along some of the steps, lies between the two.
    cells : int, optional
        Of a scene alone: into how many cells the attracting cells are cut, by default 8192, more where these do not
        suffice; the bounds come nearer as 1/cells.
    progress : callable, optional
        Called with the step, how much of it is done, and of how much.

    Returns
    -------
    Proof, ProofOfMap or, with noise, LongRunOfMap
        With the claim `average`.  Where it is proved `average.numbers` has by name and component the two numbers, and
        `average.lo`, `average.hi` those of the first function on all components.

    Raises
    ------
    AnswerError
        For a map of more coordinates, arguments of the other kind, or what is none of these functions.

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
    >>> def halved(x): return 0.5 * x
    >>> noisy = ls.average(ls.map(halved), ls.grid([(-1.0, 1.0)], cells=50), noise=0.25)
    >>> noisy.lo < -math.log(2.0) < noisy.hi, noisy.hi - noisy.lo < 1e-6
    (True, True)
    >>> flips = ls.average("paper-designed", of="flips_per_throw", cells=1000).average
    >>> flips.lo < 0.31916 < flips.hi < flips.lo + 0.01
    True
    """
    if isinstance(map, Scene | str | Path):
        twice = isinstance(grid, Grid) or of is not None  # else what is averaged stands in its place
        require_none(
            {"upper": upper, "noise": noise, "grid": grid if twice else None}, "average", "beside a scene"
        )
        require_cells(cells, "average")
        return averages_of_scene(load(map), of if grid is None else grid, cells, progress)
    require_map(map, grid, cells, "average")
    if grid.dimension != 1:
        raise AnswerError("the grid of an average", f"{grid.dimension} axes", "one", "averages are of a line")
    of = "lyapunov" if of is None else of
    corners = coerce(map), coerce(map if upper is None else upper)
    if noise is not None:
        return long_run_of_map(*corners, grid, of, noise, progress)
    fine = cut_at_changes(*corners, grid, asked_of_map(of, corners[0], grid).jumps)
    return averaged(certify_map(map, fine, ["invariant"], upper=upper, progress=progress), of)
