"""The task that an atlas asks where no other is named, the topology of attractors, and its checks in the run itself."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from limitsets.base import AnswerError, LimitsetsError
from limitsets.feeder.goals import OrientedBeyond, Reaches
from limitsets.parameters.atlas.classes import classes
from limitsets.parameters.atlas.float_margins import float_margins, threshold_of, unit_of_margin
from limitsets.parameters.atlas.plan import Block, Coded, Variable, block_task
from limitsets.parameters.atlas.subjects import SceneSubject, Subject
from limitsets.systems.cells import Domain
from limitsets.systems.maps import advance
from limitsets.systems.maps.pieces import chosen, point_of
from limitsets.systems.sets.end_points import IntervalMap
from limitsets.systems.sets.entropy import topological_entropy
from limitsets.systems.sets.topology import DOUBTS, Topologies, topologies
from limitsets.systems.sets.topology.work import (
    BANDS_JOIN,
    DECIDED,
    MOST_ATTRACTORS,
    MOVING,
    NOT_ONE,
    STAYING,
    TOO_FINE,
    UNSURE_EXIT,
)

# ----------------------------------------------------------------
# Checks in the run itself: a sample of the points against fine cells, and some of these against a proved goal.
#
# Which points are checked depends on their numbers in the plan alone.  A point is a disagreement where any field of its
# topology differs on cells twenty times as fine, or where a certificate proves or refutes what the threshold denies.


NOT_CHECKED, AGREES, DIFFERS, PROVED, CONTRADICTED = range(5)
CODES = {
    "not_checked": NOT_CHECKED,
    "agrees_with_fine_cells": AGREES,
    "differs_from_fine_cells": DIFFERS,
    "agrees_with_certificate": PROVED,
    "differs_from_certificate": CONTRADICTED,
}
ABOUT = (
    "a sample: every field against cells twenty times as fine; of these some against a proof of the goal too"
)

# One point of so many is checked on fine cells, one of so many of these by a proof.
SAMPLED, PROVED_OF = 1000, 10
# Cells and samples of a side.
FINE = ((4801, 768), (16_381, 1536))
# Extents that agree, as a share of the largest side, and shares of starts: fine cells split these better.
CLOSE, NEAR = 1e-8, 0.02
# Multiples of this odd number, modulo 2^32, come in no order.
SCATTERED = np.uint64(2654435761)


def checks(block: Block, told: Topologies) -> npt.NDArray[np.int8]:
    """Check a sample of the points that are decided."""
    verdicts = np.full(told.attractors.size, NOT_CHECKED, np.int8)
    mixed = (block.numbers.astype(np.uint64) * SCATTERED) % np.uint64(2**32)
    at = np.flatnonzero((mixed % np.uint64(SAMPLED) == 0) & (told.undecided == DECIDED))
    if not at.size:
        return verdicts
    points = chosen(block.points, at)
    fine = topologies(points.params, points.lo, points.hi, points.anchor, levels=FINE)
    scale = (points.hi - points.lo).max(axis=1)
    verdicts[at] = np.where(_same(chosen(told, at), fine, scale), AGREES, DIFFERS)
    for k in at[(mixed[at] // np.uint64(SAMPLED)) % np.uint64(PROVED_OF) == 0]:
        if verdicts[k] == AGREES:
            verdicts[k] = _against_proof(block, told, int(k))
    return verdicts


def _same(one: Topologies, other: Topologies, scale: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Whether two records of the same points say the same."""
    same = other.undecided == DECIDED
    for name in ("attractors", "bands", "jogs_min", "jogs_max", "flip_order", "period"):
        a, b = getattr(one, name), getattr(other, name)
        same &= (a == b).reshape(len(same), -1).all(axis=1)
    for name in ("lowest", "reach", "share", "leaves", "collapses"):
        a, b = (getattr(each, name).reshape(len(same), -1) for each in (one, other))
        close = CLOSE * scale[:, None] if name in ("lowest", "reach") else NEAR
        same &= ((np.abs(a - b) <= close) | (np.isnan(a) & np.isnan(b))).all(axis=1)
    return np.asarray(same)


def _against_proof(block: Block, told: Topologies, k: int) -> int:
    """Compare the threshold of one point with what is proved of the goal there."""
    scene: Any = block.subject.at({name: float(each[k]) for name, each in block.values.items()})
    goal = scene.goal if isinstance(block.subject, SceneSubject) and scene is not None else None
    if not isinstance(goal, OrientedBeyond) or goal.from_anywhere or told.share[k, 0] != 1.0:
        return AGREES
    from limitsets.proofs.prover import certify  # lazily: most chunks need no proof

    try:
        claim = certify(scene, ["goal"]).claims[0]
    except LimitsetsError:
        return AGREES
    holds = not threshold_of(goal, told.reach[k : k + 1, 0])[0] > goal.x
    if claim.verdict not in ("proved", "refuted"):
        return AGREES
    return PROVED if (claim.verdict == "proved") == holds else CONTRADICTED


# ----------------------------------------------------------------
# The task that an atlas asks where no other is named: the topology of the attractors.


_CODES = {
    "decided": DECIDED,
    "too_fine": TOO_FINE,
    "moving": MOVING,
    "bands_join": BANDS_JOIN,
    "not_one": NOT_ONE,
    "staying": STAYING,
    "unsure_exit": UNSURE_EXIT,
}
_AVERAGES = frozenset({"flips_per_throw", "flips_per_throw_error", "lyapunov", "lyapunov_error"})
THROWS = 10_000
# Throws after which a state is taken to be where it stays.
BEFORE = 100


def _variables(
    subject: Subject, throws: int = THROWS, margin: str | None = None, reading: str = "fixed"
) -> Mapping[str, Variable]:
    """Return the variables, with as many sides as the subject has."""
    each = (("attractor", MOST_ATTRACTORS),)
    sides = (*each, ("side", subject.sides))
    doubts = "; ".join(f"{word}: {DOUBTS[number]}" for word, number in _CODES.items())
    back = "come back to the joint" if isinstance(subject, SceneSubject) else "leave over the lower end"
    variables = {
        "attractors": Variable("int8", about="how many attractors"),
        "undecided": Variable("int8", codes=_CODES, about=doubts),
        "checked": Variable("int8", codes=CODES, about=ABOUT, fill=NOT_CHECKED, copied=False),
        "class": Variable("int64", about="hash of the class's name, the same in every atlas; 0: undecided"),
        "bands": Variable("int16", sides, about="intervals of the attractor on each side", fill=0),
        "flip_order": Variable("int8", sides, about="sides in cyclic order, then -1; all -2: it changes"),
        "jogs_min": Variable("int32", sides, about="fewest throws of one visit that stay on the side"),
        "jogs_max": Variable("int32", sides, about="most throws of one visit that stay on the side"),
        "period": Variable("int32", each, about="length of the cycle that the attractor is; 0: it is none"),
        "lowest": Variable(dims=sides, unit="length", about="least x of the attractor on each side"),
        "reach": Variable(dims=sides, unit="length", about="largest x of the attractor on each side"),
        "share": Variable(dims=each, about="of the starts, those that come to the attractor"),
        "leaves": Variable(about="of the starts, those that leave"),
        "collapses": Variable(about=f"of the starts, those that {back}"),
        "flips_per_throw": Variable(dims=each, about="mean along one orbit", default=False),
        "flips_per_throw_error": Variable(dims=each, about="its standard error", default=False),
        "lyapunov": Variable(dims=each, about="Lyapunov exponent per throw", default=False),
        "lyapunov_error": Variable(dims=each, about="its standard error", default=False),
        "entropy": Variable(
            dims=each, about="topological entropy per throw; about a second a point", default=False
        ),
    }
    if _goal_of(subject) is not None:
        variables["threshold"] = Variable(unit="length", about="where the goal begins or ceases to hold")
    if margin is not None:
        if not isinstance(subject, SceneSubject):
            raise AnswerError("the subject of a margin", subject.title, "a scene with a goal", "leave it out")
        about = f"of the goal, for {margin}, {reading}, by floats"
        variables["margin"] = Variable(unit=unit_of_margin(subject.scene, margin, reading), about=about)
    return variables


@block_task(_variables)
def topology(
    block: Block, throws: int = THROWS, margin: str | None = None, reading: str = "fixed"
) -> dict[str, npt.NDArray[Any] | Coded]:
    """Find the topology of the attractors at every point; where it is undecided, nothing else is said.

    Flips per throw and the Lyapunov exponent are averaged over `throws` throws, if they are wanted.  `margin` names a
    quantity (or "joint", the scene's tolerance) and `reading` how it deviates (`limitsets.margin`): the margin of the
    scene's goal is found by floats then, in at most some 2 ms a point.
    """
    points = block.points
    asked = throws if block.wanted & _AVERAGES else 0
    told = topologies(points.params, points.lo, points.hi, points.anchor, throws=asked)
    fields = told._asdict()
    goal = _goal_of(block.subject)
    if goal is not None:
        fields["threshold"] = _threshold(goal, told.reach)
    if "margin" in block.wanted and margin is not None:
        fields["margin"] = float_margins(block.subject.scene, block.values, told, margin, reading)
    if "entropy" in block.wanted:
        fields["entropy"] = _entropies(block, told)
    if "checked" in block.wanted:
        fields["checked"] = checks(block, told)
    decided = told.undecided == DECIDED
    variables = _variables(block.subject, throws, margin, reading)
    answers: dict[str, npt.NDArray[Any] | Coded] = {
        name: fields[name]
        if name in ("undecided", "checked")
        else np.where(
            decided.reshape(-1, *[1] * (fields[name].ndim - 1)), fields[name], variables[name].empty
        )
        for name in block.wanted - {"class"}
    }
    if "class" in block.wanted:
        numbers, names = classes(told)
        answers["class"] = Coded(numbers, {name: number for number, name in names.items()})
    return answers


def _entropies(block: Block, told: Topologies) -> npt.NDArray[np.float64]:
    """Topological entropy of every attractor; nan where its bands are not found again."""
    entropies = np.full(told.period.shape, np.nan)
    entropies[(told.period > 0) & (told.undecided == DECIDED)[:, None]] = 0.0
    for k, a in zip(*np.nonzero((told.period == 0) & (told.undecided == DECIDED)[:, None]), strict=True):
        points = block.points
        anchor = None if points.anchor is None else points.anchor[k]
        domain = Domain(points.lo[k][:, None], points.hi[k][:, None], anchor)
        params = point_of(points.params, k)
        bands = _bands(params, domain, told.start[k, a], told.start_side[k, a])
        if [len(bands.get(side, ())) for side in range(domain.lo.size)] == told.bands[k, a].tolist():
            entropies[k, a] = topological_entropy(params, bands, domain)
    return entropies


def _bands(params: Any, domain: Domain, x: float, side: int) -> dict[int, list[tuple[float, float]]]:
    """Bands of the attractor that a state belongs to, from inside.

    Between its ends on a side there are gaps, and in these cycles that attract nothing.
    """
    from limitsets.parameters.continuation.growth import grown  # lazily: few atlases ask for entropies
    from limitsets.parameters.continuation.path import SAMPLES

    at, on, _, _ = advance(params, [x], [side], BEFORE)
    forward = IntervalMap(params, domain, SAMPLES)
    return grown(forward, at, on, float(np.max(domain.hi - domain.lo))) or {}


def _goal_of(subject: Subject) -> OrientedBeyond | Reaches | None:
    """Return the goal if it asks how far the limit set reaches."""
    goal = subject.scene.goal if isinstance(subject, SceneSubject) else None
    return goal if isinstance(goal, OrientedBeyond | Reaches) and not goal.from_anywhere else None


def _threshold(goal: OrientedBeyond | Reaches, reach: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the threshold of the worst attractor (`Goal.worst`); nan where there is none."""
    worst = np.fmax if isinstance(goal, OrientedBeyond) else np.fmin
    each = np.stack([threshold_of(goal, reach[:, a]) for a in range(reach.shape[1])])
    return np.asarray(worst.reduce(each))
