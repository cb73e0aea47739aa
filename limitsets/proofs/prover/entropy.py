"""Prove the topological entropy of a map of a line, or of a scene, from both sides."""

from __future__ import annotations

import math
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, overload

from limitsets.base import Progress, arguments_checked, shown_in_notebooks, silent
from limitsets.feeder.scene import Scene, load
from limitsets.proofs.prover.attraction import attraction
from limitsets.proofs.prover.averages_of_map import cut_at_changes
from limitsets.proofs.prover.averages_of_scene import attracting, fine_cells, unfit
from limitsets.proofs.prover.certificate import DeniedError, require_checker
from limitsets.proofs.prover.certifying import require_cells, require_map, require_none
from limitsets.proofs.prover.cover import cover_on
from limitsets.proofs.prover.entropies import ROOM, Entropy, both_ends
from limitsets.proofs.prover.of_map import certify_map
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.proofs.prover.proof import Claim, Proof, undecided
from limitsets.proofs.prover.proof_of_map import ProofOfMap
from limitsets.systems.cells import CellSet, Grid
from limitsets.systems.maps import coerce
from limitsets.systems.sets.entropy import growth_of_curve, topological_entropy

if TYPE_CHECKING:
    from limitsets.checker.entropy import Lap, Runs

P = TypeVar("P", Proof, ProofOfMap)

# Cells into which the attracting cells of a scene are cut: laps need no more.
CELLS = 1024


def laps_in(file: Path) -> tuple[list[Lap], Runs]:
    """Find laps and runs of the attracting cells in a certificate, as the checker does."""
    import flint

    from limitsets.checker.any_map import Map
    from limitsets.checker.balls import PRECISION
    from limitsets.checker.entropy import Runs
    from limitsets.checker.file import open_certificate
    from limitsets.checker.map_entropy import laps_of_map
    from limitsets.checker.map_file import read_map_file
    from limitsets.checker.report import read_certificate
    from limitsets.checker.throw_entropy import laps_of_throws

    header, entries = open_certificate(file)
    with flint.ctx.workprec(PRECISION):
        if "map" in header:
            read = read_map_file(header, entries)
            (part,) = read.parts
            assert part.cells is not None
            c, edges = part.cells, [axes[0] for axes in part.cells.edges]
            return list(laps_of_map(Map(read.shape, part.parameters), part.cells)), Runs(c, edges)
        one = read_certificate(header, entries)
        return list(laps_of_throws(one.scenes[0], one.cells[0])), Runs(one.cells[0], one.cells[0].edges)


def _left(proof: P, sampled: float, reason: str) -> P:
    """Say why nothing is proved, beside the sampled number."""
    nothing = Entropy(0.0, math.inf, sampled, {}, {})
    return replace(proof, claims=(*proof.claims, undecided("entropy", reason, final=True)), entropy=nothing)


def _with_entropy(proof: P, sampled: float, tell: Progress) -> P:
    """Add the entropy to a proof that cells are invariant, as the checker confirms it; the claim `entropy`."""
    import flint

    from limitsets.checker.balls import PRECISION, UnprovedError

    with tempfile.TemporaryDirectory() as folder, flint.ctx.workprec(PRECISION):
        file = Path(folder) / "entropy.proof.zip"
        try:
            proof.save(file, recheck=False)
            section, arrays = both_ends(*laps_in(file), tell)
            lo, hi = (math.log(float.fromhex(section[word])) for word in ("lower", "upper"))
            own = Entropy(max(lo - ROOM, 0.0), hi + ROOM, sampled, section, arrays)
            claims = *proof.claims, Claim("entropy", "proved", "", section)
            answer = replace(proof, claims=claims, entropy=own)
            answer.save(file)
        except UnprovedError as error:
            return _left(proof, sampled, str(error))
        except DeniedError as error:
            return _left(
                proof, sampled, f"the checker does not confirm it: {error.claims.get('entropy', '')}"
            )
    return answer


def _sampled(params: Any, cells: CellSet) -> float:
    """Give the entropy on cells of a line as floats have it; nan along an axis that closes."""
    domain = cells.grid.domain
    return math.nan if domain.closes else topological_entropy(params, cells.extents(), domain)


def _of_scene(scene: Scene, cells: int, tell: Progress) -> Proof:
    begin, box = time.perf_counter(), parameter_box(scene)
    attractors = attracting(box, tell)
    reason = unfit(scene, attractors, "entropy")
    if not reason:
        attractors = attraction(cover_on(box, fine_cells(attractors, cells)))
    claims = () if reason else (Claim("invariant", "proved", "", {}),)
    proof = Proof(scene, {}, {}, (attractors,), claims, time.perf_counter() - begin)
    if reason:
        return replace(proof, claims=(undecided("entropy", reason, final=True),))
    return _with_entropy(proof, _sampled(box.lo, attractors.cells), tell)


def _of_map(lower: Any, grid: Grid, upper: Any, tell: Progress) -> ProofOfMap:
    corners = coerce(lower), coerce(lower if upper is None else upper)
    if grid.dimension > 1:
        proof = certify_map(lower, grid, ["invariant"], upper=upper, progress=tell)
        why = "it is proved of a line alone; sampled is the growth of a curve, at most the entropy"
        return _left(proof, growth_of_curve(corners[0], grid.domain), why)
    cut = cut_at_changes(*corners, grid, turns=True)
    proof = certify_map(lower, cut, ["invariant"], upper=upper, progress=tell)
    if not (proof.arrays["component"] >= 0).any():
        why = "there are no attracting cells: images may leave the domain; widen it, or close it (periodic)"
        return replace(proof, claims=(undecided("entropy", why),))
    return _with_entropy(proof, _sampled(corners[0], proof.cells), tell)


@overload
def entropy(
    map: Scene | str | Path, grid: None = None, *, cells: int | None = None, progress: Progress | None = None
) -> Proof: ...
@overload
def entropy(
    map: tuple[Any, ...], grid: Grid, *, upper: Any = None, progress: Progress | None = None
) -> ProofOfMap: ...
@shown_in_notebooks
@arguments_checked
def entropy(
    map: Any,  # noqa: A002  # the field's word
    grid: Any = None,
    *,
    upper: Any = None,
    cells: int | None = None,
    progress: Progress | None = None,
) -> Proof | ProofOfMap:
    """Prove between which numbers the topological entropy on the attracting cells of a scene or a map of a line lies.

    A lap is an interval on which one branch is taken, and the map rises or falls; the entropy is the growth per step
    of the number of words of laps that intervals of starts follow.  For a continuous map this is the topological
    entropy.  Chaos beside the attracting cells, as in a window of periods, does not count.

    Parameters
    ----------
    map : Scene, str, Path or NamedTuple
        A scene, what `limitsets.load` takes; or a map, or the lower corner of a box of its parameters.  Of a map of
        more coordinates nothing is proved: the sampled number is the growth of the length of a curve, which is at most
        the entropy, and less where areas grow.
    grid : Grid
        Of a map alone: the cells on which attracting cells and laps are found.
    upper : NamedTuple, optional
        Of a map alone: the upper corner of the parameters; both ends hold for every fixed value between.
    cells : int, optional
        Of a scene alone: into how many cells the attracting cells are cut, by default 1024.
    progress : callable, optional
        Called with the step, how much of it is done, and of how much.

    Returns
    -------
    Proof or ProofOfMap
        With the claim `entropy`.  Its `entropy` has the proved `lo` and `hi` per step [natural logarithm], and the
        `sampled` number of the same set.

    Raises
    ------
    AnswerError
        For arguments of the other kind; or python-flint is not installed.

    Examples
    --------
    >>> import limitsets as ls
    >>> proof = ls.entropy("paper-designed")
    >>> 0.20594338 < proof.entropy.lo <= proof.entropy.hi < 0.20594340
    True
    """
    require_checker()
    tell = progress or silent
    if isinstance(map, Scene | str | Path):
        require_none({"upper": upper, "grid": grid}, "entropy", "beside a scene")
        require_cells(cells, "entropy")
        return _of_scene(load(map), cells or CELLS, tell)
    require_map(map, grid, cells, "entropy")
    return _of_map(map, grid, upper, tell)
