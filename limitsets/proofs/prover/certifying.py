"""Prove claims about a scene: refine the cells until each claim is proved, refuted, or out of reach."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, overload

from limitsets.base import AnswerError, Progress, arguments_checked_as, shown, shown_in_notebooks
from limitsets.feeder.scene import LaidLike, Scene, laid_goals, load
from limitsets.feeder.scene.quantities import deviation, find
from limitsets.feeder.scene.units import parse
from limitsets.proofs.prover.attraction import Attraction, attraction, near_section, no_cells, trapping
from limitsets.proofs.prover.cover import cover
from limitsets.proofs.prover.end_points import proved_ends
from limitsets.proofs.prover.goals import cuts, prove, prove_or_refute
from limitsets.proofs.prover.goals.violating_orbits import start_that_leaves
from limitsets.proofs.prover.of_map import certify_map
from limitsets.proofs.prover.orbits import proved_cycles
from limitsets.proofs.prover.parameters import ParameterBox, joined, parameter_box, scattered
from limitsets.proofs.prover.proof import Claim, Proof, claimed, undecided
from limitsets.proofs.prover.proof_of_map import ProofOfMap
from limitsets.proofs.prover.query import weakest_of
from limitsets.proofs.prover.thinning import least_slope
from limitsets.proofs.prover.tolerances import SceneBox, whole
from limitsets.systems.cells import Grid

# Cells per side, tried in turn until everything asked for is proved or refuted.
LADDER = (2048, 8192, 32768, 131072)

# Pieces into which a tolerance may be cut, and cells that may be tried on them, before the proof is given up.
MOST_PIECES, MOST_CELLS = 1024, 4_000_000

# An orbit that refutes the goal is searched for in so many of the widest pieces, and at the corners.
MOST_SEARCHED = 8


def _attracts_all(attractors: Attraction, scene: Scene) -> Claim:
    if not attractors.proved:
        noisy = attractors.cover.box.landing > 0.0 and not attractors.cover.points
        orbit = start_that_leaves(attractors) if noisy or attractors.cover.graph.ranges.exits.any() else ()
        if orbit:
            once = {"once": True}
            return Claim("attracts-all", "refuted", attractors.reason, {}, orbit, final=True, recurs=once)
        if noisy:
            return undecided("attracts-all", attractors.reason, final=True)
        return _not_attracted(attractors, scene)
    section = {"near_joint": near_section(attractors), "max_rank": attractors.max_rank}
    return Claim("attracts-all", "proved", "", section)


def _not_attracted(attractors: Attraction, scene: Scene) -> Claim:
    """Say why attraction is not proved; reasons that finer cells cannot remove come first."""
    box = attractors.cover.box
    if box.lo.surface_height <= 0.0 <= box.hi.surface_height:
        reason = "the arm's surface is not proved to be below the joint nor above it"
        return undecided("attracts-all", f"{reason}; {attractors.reason}", final=True)
    for side, point in enumerate(attractors.cover.points):
        if point.reason:
            # a narrower piece of the tolerance may have one that can be enclosed
            alone = box.scene == dict(scene.text)
            return undecided("attracts-all", f"side {side}: {point.reason}", final=alone)
    for side, near in enumerate(attractors.joint):
        if attractors.cover.points and not near.proved:
            reason = f"side {side}, up to x = {near.x:.6g}: {near.reason}"
            return undecided("attracts-all", f"{reason}; {attractors.reason}")
    least = min((near.q for near in attractors.joint if attractors.cover.points), default=math.inf)
    gain = f"{least - 1.0:.1g} of its distance"
    slow = f"; beyond the jog's fixed point a throw gains {gain} only, too little for such cells"
    few = len(attractors.unresolved) and least - 1.0 < 0.01
    return undecided("attracts-all", attractors.reason + (slow if few else ""))


def _expanding(attractors: Attraction, _: Scene) -> Claim:
    if no_cells(attractors.component):
        return claimed("expanding", no_cells(attractors.component))
    slope, place = least_slope(attractors.cover, attractors.cells)
    # less by a little, so that other arithmetic can confirm it
    stated = 1.0 + (slope - 1.0) * (1.0 - 2.0**-10)
    missing = "" if slope > 1.0 else f"slope {slope:.6g} at {place}"
    return claimed("expanding", missing, {"least_slope": stated.hex()})


def _goal(attractors: Attraction, scene: Scene, *, search: bool = True) -> Claim:
    """Prove the goal; where it is not proved, search for what refutes it if asked to."""
    goal = scene.goal
    if goal is None:
        raise AnswerError(
            "the goal", None, "a scene with [goal]", "give the scene one, or leave this claim out"
        )
    answer = (prove_or_refute if search else prove)(attractors, scene, goal)
    return Claim(
        "goal",
        answer.verdict,
        answer.reason,
        dict(answer.section),
        answer.counterexample,
        final=answer.final,
        starts=answer.starts,
        shares=dict(answer.shares),
        note=answer.note,
        recurs=dict(answer.recurs),
    )


def _require_one_scene(claim: str, attractors: Attraction, scene: Scene) -> None:
    """Refuse a tolerance: numbers that are proved for every scene in it would be exact for none."""
    if attractors.cover.box.scene != dict(scene.text):
        raise AnswerError("the claim", claim, "a claim about one scene", "ask for it without a tolerance")


def _end_points(attractors: Attraction, scene: Scene) -> Claim:
    _require_one_scene("end-points", attractors, scene)
    box = attractors.cover.box
    if box.effects or box.landing > 0.0:
        beyond = "effects beyond the minimal model" if box.effects else "noise of landing.x"
        return undecided(
            "end-points", f"end points with {beyond} cannot be proved in this version", final=True
        )
    ends = proved_ends(attractors)
    return claimed("end-points", ends.reason, ends.section())


def _cycles(attractors: Attraction, scene: Scene) -> Claim:
    _require_one_scene("cycles", attractors, scene)
    if attractors.cover.box.effects:
        reason = "cycles with effects beyond the minimal model cannot be proved in this version"
        return undecided("cycles", reason, final=True)
    orbits = proved_cycles(attractors)
    missing = (*orbits.missing, f"none is found of period up to {orbits.up_to}")
    return claimed("cycles", "" if orbits.cycles else missing[0], orbits.section())


PROVERS: dict[str, Callable[[Attraction, Scene], Claim]] = {
    "attracts-all": _attracts_all,
    "cycles": _cycles,
    "end-points": _end_points,
    "expanding": _expanding,
    "goal": _goal,
    # an attracting component is one that no image leaves; there has to be one
    "invariant": lambda attractors, _: claimed("invariant", no_cells(attractors.component)),
    "trapping": lambda attractors, _: claimed("trapping", trapping(attractors)),
}
CLAIMS = tuple(PROVERS)
"""What can be claimed in this version."""


def _chosen(scene: Scene, claims: Sequence[str] | None) -> tuple[str, ...]:
    if claims is None:
        if scene.goal is not None and scene.goal.laid:
            return ("goal",)  # attracts-all is about the whole arm
        return ("attracts-all",) if scene.goal is None else ("attracts-all", "goal")
    for claim in claims:
        if claim not in CLAIMS:
            raise AnswerError("the claim", claim, ", ".join(CLAIMS), "correct the word")
    return tuple(dict.fromkeys(claims))


def spelled_deviations(scene: Scene, given: Mapping[str, str] | None) -> dict[str, str]:
    """Check deviations, and write them as a certificate has them: a decimal number, a space, a unit."""
    deviations = {}
    for name, text in (given or {}).items():
        deviation(text, name, scene.unit, zero=True, key=name)
        number, unit = parse(text, "share" if text.rstrip().endswith("%") else find(name).dimension)
        number = number.lstrip("+")
        deviations[name] = f"{'0' if number.startswith('.') else ''}{number} {unit}"
    return deviations


@overload
def certify(
    scene: Scene | str | Path,
    grid: Sequence[str] | None = None,
    claims: Sequence[str] | None = None,
    *,
    noise: Mapping[str, str] | None = None,
    tolerance: Mapping[str, str] | None = None,
    laid: LaidLike | None = None,
    progress: Progress | None = None,
) -> Proof: ...
@overload
def certify(
    scene: tuple[Any, ...],
    grid: Grid | None = None,
    claims: Sequence[str] | None = None,
    *,
    upper: Any = None,
    ends: Any = None,
    starts: Any = None,
    period: int | None = None,
    progress: Progress | None = None,
) -> ProofOfMap: ...
def certify(
    scene: Any,
    grid: Any = None,
    claims: Sequence[str] | None = None,
    *,
    noise: Mapping[str, str] | None = None,
    tolerance: Mapping[str, str] | None = None,
    laid: LaidLike | None = None,
    upper: Any = None,
    ends: Any = None,
    starts: Any = None,
    period: int | None = None,
    progress: Progress | None = None,
) -> Proof | ProofOfMap:
    """Prove claims about a scene, ``certify(scene, claims)``, or about any map, ``certify(map, grid, claims)``.

    Parameters
    ----------
    scene : Scene, str, Path, or a map's parameters
        A scene, what `limitsets.load` takes, or the parameters of a registered map.
    grid : Grid
        Of a map alone: the cells; finer ones prove more.  Behind a scene the claims may stand here.
    claims : sequence of str, optional
        Of a map any of `limitsets.proofs.prover.of_map.CLAIMS_OF_MAP`, by default attracts-all.  Of a scene any of
        "attracts-all" (every start on the arm enters the attracting cells and stays; with the arm's surface above
        the joint, every start beyond the jog's unstable fixed point, and those before it tend to the joint),
        "invariant", "expanding" (every slope on the attracting cells exceeds 1), "trapping" (the attracting cells are
        mapped into their interior), "end-points" (those of the limit set, in brackets), "cycles" (periodic orbits
        exist, and attract or repel) and "goal".  Default: attracts-all, and the goal if there is one.
    noise : mapping of str to str, optional
        Of a scene alone: ``{"throw.speed": "0.3 %"}``: what may differ at every throw; the claims are then proved for
        every sequence of throws.  A scene whose effects have spread = "bounded" adds its scatter.
    tolerance : mapping of str to str, optional
        Of a scene alone: ``{"throw.speed": "0.7 %"}``: what is fixed but unknown; the claims are then proved for every
        such value.
    laid : mapping of int to sequence of (float, float), optional
        Of a scene alone: by side the ranges of x where parts are laid down, numbers in the scene's unit or texts with a
        unit, ``{0: [(8.0, 20.0)]}``: the goal's starts are these.  The goal alone is then claimed by default.
    upper : NamedTuple, optional
        Of a map alone: the upper corner of a box of parameters, whose lower corner is `scene`; the claims are then
        proved for every map between.
    ends, starts : sequence of boxes, optional
        Of a map alone, for its claim "ends-in": every start in a box of `starts` (default: in all cells that are proved
        to lead there) ends in the boxes of `ends` and stays.  A box is a list of (lo, hi) per axis; a dict gives lists
        by side.
    period : int, optional
        Of a map alone, for its claim "all-cycles": every orbit of a period up to this one that lies in the domain is
        proved and listed.
    progress : callable, optional
        Called with what is tried, how much of it is done, and of how much, before each attempt.

    Returns
    -------
    Proof or ProofOfMap
        With the verdict, and the reason where something is not proved.

    Raises
    ------
    AnswerError
        For a word that is no claim, an argument for maps beside a scene or for scenes beside a map, an effect of which
        nothing can be proved, noise that cannot be enclosed, or a thread that does not round to nearest.
    MapError
        For a class in place of its values, and for a map that cannot be enclosed or that contradicts itself.

    Examples
    --------
    >>> import limitsets as ls
    >>> proof = ls.certify("paper-designed")
    >>> [(claim.claim, claim.verdict, claim.starts) for claim in proof.claims]
    [('attracts-all', 'proved', None), ('goal', 'proved', 'every')]
    >>> proof = ls.certify(ls.maps.Logistic(2.5), ls.grid([(0.1, 0.9)], cells=512), ["attracts-all"])
    >>> proof.claims[0].verdict
    'proved'
    """
    if isinstance(scene, tuple | type):
        require_none({"noise": noise, "tolerance": tolerance, "laid": laid}, "certify", "beside a map")
        return certify_map(
            scene, grid, claims, upper=upper, ends=ends, starts=starts, period=period, progress=progress
        )
    twice = isinstance(grid, Grid) or claims is not None  # else the claims stand in its place
    of_maps = {"upper": upper, "ends": ends, "starts": starts, "period": period}
    require_none({**of_maps, "grid": grid if twice else None}, "certify", "beside a scene")
    return certify_scene(
        scene,
        claims if grid is None else grid,
        noise=noise,
        tolerance=tolerance,
        laid=laid,
        progress=progress,
    )


def require_none(given: Mapping[str, Any], function: str, beside: str) -> None:
    """Refuse arguments of the other kind of proof."""
    for name, value in given.items():
        if value is not None:
            own = {
                "certify": "a scene has tolerance=, a map upper=",
                "margin": "a scene has goal=, a map ends=",
                "average": "a scene has cells=, a map grid=",
                "entropy": "a scene has cells=, a map grid= and upper=",
                "absorption_brackets": "a scene has right=, wrong= and cells=, a map noise= and upper=",
                "interval_chain": "a scene has right=, wrong= and cells=, a map noise= and upper=",
            }
            remedy = f"leave it out; {own[function]}"
            raise AnswerError(f"the argument {name} of {function}", shown(value), f"none {beside}", remedy)


def require_map(map: Any, grid: Any, cells: int | None, what: str) -> None:  # noqa: A002  # the field's word
    """Refuse what is no map beside a grid, for a number that is proved of these."""
    require_none({"cells": cells}, what, "beside a map")
    if not isinstance(map, tuple):
        remedy = "make one with limitsets.map"
        raise AnswerError(f"the map of an {what}", shown(map), "a scene, or a map of a line", remedy)
    if not isinstance(grid, Grid):
        way = f"pass limitsets.{what}(map, limitsets.grid([(lo, hi)], cells=1000))"
        raise AnswerError(f"the grid of an {what}", shown(grid), "the cells to prove it on", way)


def require_cells(cells: int | None, what: str) -> None:
    """Refuse a number of cells that is none."""
    if cells is not None and cells < 1:
        raise AnswerError(f"the cells of an {what}", cells, "1 or more", "leave it out")


@shown_in_notebooks
@arguments_checked_as("certify")
def certify_scene(
    scene: Scene | str | Path,
    claims: Sequence[str] | None = None,
    *,
    noise: Mapping[str, str] | None = None,
    tolerance: Mapping[str, str] | None = None,
    laid: LaidLike | None = None,
    progress: Progress | None = None,
) -> Proof:
    """Prove claims about a scene, by the arguments of `certify`."""
    loaded, _ = laid_goals(load(scene), laid)
    wanted = _chosen(loaded, claims)
    noise = joined(spelled_deviations(loaded, noise), spelled_deviations(loaded, scattered(loaded)))
    tolerance = spelled_deviations(loaded, tolerance)
    begin = time.perf_counter()
    if tolerance:
        attractions, answers = _pieces(loaded, wanted, whole(loaded, tolerance), noise, progress)
    else:
        one, answers = _attempt(loaded, wanted, parameter_box(loaded, noise=noise), LADDER, progress)
        attractions = (one,)
    seconds = time.perf_counter() - begin
    return Proof(loaded, noise, tolerance, attractions, answers, seconds)


def _attempt(
    scene: Scene,
    wanted: tuple[str, ...],
    box: ParameterBox,
    ladder: Sequence[int],
    progress: Progress | None,
    *,
    search: bool = True,
) -> tuple[Attraction, tuple[Claim, ...]]:
    """Refine the cells until every claim is proved or refuted for one box of parameters, or the ladder ends.

    An orbit that refutes the goal is searched for with the first cells and the last: it hardly depends on them.
    """
    wanted_cuts = cuts(() if scene.goal is None else (scene.goal,), box.lo.a.size)
    for step, cells in enumerate(ladder):
        if progress is not None:
            progress(f"{cells} cells a side", step, len(ladder))
        attractors = attraction(cover(box, cells, wanted_cuts))
        now = search and step in (0, len(ladder) - 1)
        answers = tuple(
            _goal(attractors, scene, search=now) if word == "goal" else PROVERS[word](attractors, scene)
            for word in wanted
        )
        if all(answer.verdict in ("proved", "refuted") or answer.final for answer in answers):
            break
    return attractors, answers


def _pieces(
    scene: Scene,
    wanted: tuple[str, ...],
    piece: SceneBox,
    noise: Mapping[str, str] | None,
    progress: Progress | None,
) -> tuple[tuple[Attraction, ...], tuple[Claim, ...]]:
    """Prove the claims on a box of quantities; or refute the goal at one of its corners."""
    settled: dict[str, Claim] = {}
    attractions: tuple[Attraction, ...] = ()
    for corner in piece.corners() if "goal" in wanted else ():
        box = parameter_box(scene, tree=corner.tree(), noise=noise)
        one, (answer,) = _attempt(scene, ("goal",), box, LADDER, progress)
        attractions = (one,)
        if answer.verdict == "refuted":
            settled["goal"] = replace(answer, fixed=corner.texts())
            break
    left = tuple(word for word in wanted if word not in settled)
    while left:
        attractions, answers = _halved(scene, left, piece, noise, progress)
        settled |= {answer.claim: answer for answer in answers}
        left = tuple(word for word in wanted if word not in settled)
    return attractions, tuple(settled[word] for word in wanted)


def _halved(
    scene: Scene,
    wanted: tuple[str, ...],
    piece: SceneBox,
    noise: Mapping[str, str] | None,
    progress: Progress | None,
) -> tuple[tuple[Attraction, ...], tuple[Claim, ...]]:
    """Prove all of the claims, halving the box of quantities as needed; or give up some of them, with the reason."""
    scales = {name: max(span.hi - span.lo, Fraction(1, 10**30)) for name, span in piece.spans.items()}
    waiting, tried, looked = [(piece, LADDER[0])], 0, 0
    proved: list[tuple[Attraction, tuple[Claim, ...]]] = []
    while waiting:
        if progress is not None:
            progress("pieces of the tolerance", len(proved), len(proved) + len(waiting))
        part, cells = waiting.pop()
        box = parameter_box(scene, tree=part.tree(), noise=noise)
        one, answers = _attempt(scene, wanted, box, (cells,), None, search=looked < MOST_SEARCHED)
        tried, looked = tried + one.cover.grid.n_cells, looked + 1
        missing = tuple(each for each in answers if not _settled(each))
        refuted = tuple(replace(each, fixed=part.texts()) for each in missing if each.verdict == "refuted")
        if noise:  # the search takes kappa from the noise about all values in the piece: no scene allows that
            refuted = ()
        if refuted:
            return (one,), refuted
        if not missing:
            proved.append((one, answers))
        elif (
            any(each.final for each in missing)
            or len(proved) + len(waiting) >= MOST_PIECES
            or tried > MOST_CELLS
        ):
            where = ", ".join(f"{name} from {lo} to {hi}" for name, (lo, hi) in part.texts().items())
            return (one,), tuple(
                Claim(each.claim, "undecided", f"for {where}: {each.reason}", {}) for each in missing
            )
        else:
            # a narrower box of parameters is worth finer cells
            waiting += [(half, min(cells * 6 // 5, LADDER[-1])) for half in part.halves(scales)]
    attractions = tuple(one for one, _ in proved)
    joined = tuple(weakest_of([answers[k] for _, answers in proved], attractions) for k in range(len(wanted)))
    return attractions, joined


def _settled(claim: Claim) -> bool:
    """Whether narrower pieces cannot bring a better verdict: where starts leave a goal holds on cells at best."""
    return claim.verdict == "proved" or (claim.written and claim.shares["leaves"] > 0.0)
