"""The task that an atlas asks where no other is named: the topology of the attractors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from limitsets.cells import Domain
from limitsets.errors import AnswerError
from limitsets.goals import OrientedBeyond, Reaches
from limitsets.maps import advance
from limitsets.maps.stacks import point_of
from limitsets.sets.entropy import topological_entropy
from limitsets.sets.interval_map import IntervalMap
from limitsets.sweep.checking import ABOUT, CODES, NOT_CHECKED, checks
from limitsets.sweep.classes import classes
from limitsets.sweep.continuation.growth import grown
from limitsets.sweep.continuation.path import SAMPLES
from limitsets.sweep.float_margins import float_margins, threshold_of, unit_of_margin
from limitsets.sweep.subjects import SceneSubject, Subject
from limitsets.sweep.tasks import Block, Coded, Variable, block_task
from limitsets.topology import DOUBTS, Topologies, topologies
from limitsets.topology.records import BANDS_JOIN, DECIDED, MOVING, NOT_ONE, STAYING, TOO_FINE, UNSURE_EXIT
from limitsets.topology.work import MOST_ATTRACTORS

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
    found = {
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
        found["threshold"] = Variable(unit="length", about="where the goal begins or ceases to hold")
    if margin is not None:
        if not isinstance(subject, SceneSubject):
            raise AnswerError("the subject of a margin", subject.title, "a scene with a goal", "leave it out")
        about = f"of the goal, for {margin}, {reading}, by floats"
        found["margin"] = Variable(unit=unit_of_margin(subject.scene, margin, reading), about=about)
    return found


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
    found = told._asdict()
    goal = _goal_of(block.subject)
    if goal is not None:
        found["threshold"] = _threshold(goal, told.reach)
    if "margin" in block.wanted and margin is not None:
        found["margin"] = float_margins(block.subject.scene, block.values, told, margin, reading)
    if "entropy" in block.wanted:
        found["entropy"] = _entropies(block, told)
    if "checked" in block.wanted:
        found["checked"] = checks(block, told)
    decided = told.undecided == DECIDED
    variables = _variables(block.subject, throws, margin, reading)
    answers: dict[str, npt.NDArray[Any] | Coded] = {
        name: found[name]
        if name in ("undecided", "checked")
        else _kept(found[name], decided, variables[name].empty)
        for name in block.wanted - {"class"}
    }
    if "class" in block.wanted:
        numbers, names = classes(told)
        answers["class"] = Coded(numbers, {name: number for number, name in names.items()})
    return answers


def _kept(values: npt.NDArray[Any], decided: npt.NDArray[np.bool_], empty: float) -> npt.NDArray[Any]:
    return np.where(decided.reshape(-1, *[1] * (values.ndim - 1)), values, empty)


def _entropies(block: Block, told: Topologies) -> npt.NDArray[np.float64]:
    """Topological entropy of every attractor; nan where its bands are not found again."""
    found = np.full(told.period.shape, np.nan)
    found[(told.period > 0) & (told.undecided == DECIDED)[:, None]] = 0.0
    for k, a in zip(*np.nonzero((told.period == 0) & (told.undecided == DECIDED)[:, None]), strict=True):
        points = block.points
        anchor = None if points.anchor is None else points.anchor[k]
        domain = Domain(points.lo[k][:, None], points.hi[k][:, None], anchor)
        params = point_of(points.params, k)
        bands = _bands(params, domain, told.start[k, a], told.start_side[k, a])
        if [len(bands.get(side, ())) for side in range(domain.lo.size)] == told.bands[k, a].tolist():
            found[k, a] = topological_entropy(params, bands, domain)
    return found


def _bands(params: Any, domain: Domain, x: float, side: int) -> dict[int, list[tuple[float, float]]]:
    """Bands of the attractor that a state belongs to, from inside.

    Between its ends on a side there are gaps, and in these cycles that attract nothing.
    """
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
