"""Films of throws: of a scene from a start, of an orbit that refutes a margin, of feedback with its sensor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from limitsets.base import AnswerError
from limitsets.face.animation.film import Asked, Film, Lanes, Pace, cut, require_length
from limitsets.face.animation.legs import (
    RESTS,
    STAYS,
    drawn_of,
    good_start,
    known_of,
    lanes_of,
    legs_of,
    require_start,
    rest_leg,
)
from limitsets.face.plot.throwing import Throw, throws_of
from limitsets.feeder.thrower import trace
from limitsets.feeder.thrower.motion import FullThrow

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene
    from limitsets.parameters.analysis import Analysis
    from limitsets.parameters.margins.margin_result import Margin
    from limitsets.proofs.policies import Policy, Synthesis


USUAL = 8
"""Default number of throws that are shown."""


def film_of_scene(scene: Scene, asked: Asked) -> Film:
    """Show throws of a scene."""
    if asked.start is not None:
        require_start(scene, asked.start)
    require_length(asked.throws or USUAL)
    analysis, _ = known_of(scene, asked.progress)
    return film_of_analysis(analysis, asked)


def film_of_analysis(analysis: Analysis, asked: Asked) -> Film:
    """Show throws of a scene that is analysed already."""
    scene, count = analysis.scene, USUAL if asked.throws is None else asked.throws
    start = good_start(analysis, count) if asked.start is None else require_start(scene, asked.start)
    return film_of_throws(scene, start, count, asked.pace(scene), lanes_of(scene, analysis))


def film_of_throws(
    scene: Scene, start: tuple[float, int], count: int, pace: Pace, lanes: Lanes | None = None
) -> Film:
    """Show `count` throws of a scene from a start; without lanes nothing is analysed."""
    x, side = start
    path = trace(scene.map, x, side, count)
    made = throws_of(scene, path)
    if not made:
        allowed = "one from which a throw lands on the arm"
        raise AnswerError("the start", f"x = {x:g} on side {side}: {path.reason}", allowed, "choose another")
    count = len(made)
    legs = [rest_leg(scene, x, side, 1.0, f"Start: x = {x:.2f} {scene.unit} on side {side}")]
    for number, throw in enumerate(made, start=1):
        stays = STAYS if number == count else RESTS
        legs += legs_of(scene, throw, pace, f"Throw {number} of {count}", stays=stays)
    return cut(scene, legs, pace, title=scene.name, about=drawn_of(scene), lanes=lanes)


# ----------------------------------------------------------------
# A film of a margin's upper end: the orbit that violates the goal, thrown as the proof says.


def film_of_margin(margin: Margin, asked: Asked) -> Film:
    """Show the last throws of the orbit that refutes the goal."""
    if asked.start is not None:
        raise AnswerError("the start", asked.start, "none: the orbit of a margin has its own", "leave it out")
    states = margin.counterexample
    if len(states) < 2:
        raise AnswerError(
            "the margin", margin.reason or "without an orbit", "one that is refuted", "draw another one"
        )
    assert margin.against is not None  # it has the orbit
    piece = margin.against.piece
    texts = {} if piece is None else {name: pair[0] for name, pair in piece.texts().items()}
    scene: Scene = margin.scene.with_values(texts) if texts else margin.scene
    made = [_thrown(scene, state) for state in states[:-1]][-(asked.throws or USUAL) :]
    _, lanes = known_of(scene, asked.progress, goal=margin.goals[0])
    pace, first = asked.pace(scene), len(states) - len(made)
    size = f"{margin.refuted:.4g} {margin.unit}".strip()
    when = "at every throw anew" if margin.reading == "per-throw" else "at all throws alike"
    what = f"{margin.quantity} deviates by {size}, {when}"
    begin = made[0]
    words = f"On the way: x = {begin.x:.2f} {scene.unit} on side {begin.side}"
    legs = [rest_leg(scene, begin.x, begin.side, 1.0, words, what)]
    for number, throw in enumerate(made):
        count = f"Throw {first + number} of {len(states) - 1}"
        speed = (
            f"; this throw with kappa = {throw.kappa:.6g} {scene.unit}"
            if margin.reading == "per-throw"
            else ""
        )
        last = number + 1 == len(made)
        after = (f"the goal is violated: x = {throw.after:.4f} {scene.unit} on side {throw.side_after}", -1)
        legs += legs_of(
            scene,
            throw,
            pace,
            count,
            note=what + speed,
            stays=2.0 * STAYS if last else 0.5,
            after=after if last else None,
        )
    title = f"{scene.name}, an orbit that violates the goal"
    return cut(scene, legs, pace, title=title, about=drawn_of(scene), lanes=lanes)


def _thrown(scene: Scene, here: Any) -> Throw:
    """Throw a state as the proof does: with its own kappa, and with the noise of its landing added."""
    params = scene.map
    if here.kappa is not None:
        bare = scene.bare_map._replace(kappa=here.kappa)
        params = params._replace(bare=bare) if isinstance(params, FullThrow) else bare
    (throw,) = throws_of(scene, trace(params, 0.5 * (here.lo + here.hi), here.side, 1), here.kappa)
    if here.landing:
        throw = throw._replace(after=throw.after + here.landing, scatters=True)
    return throw


# ----------------------------------------------------------------
# A film of feedback: the sensor's answer, the throw that the policy chooses, and where the part is known to be.


# Starts tried in each interval for the one that takes the most throws.
TRIED = 25


class _Step(NamedTuple):
    state: int
    heard: str
    name: str
    throw: Throw | None


def film_of_policy(synthesis: Synthesis, asked: Asked) -> Film:
    """Show what a policy does from a start, without noise."""
    policy = synthesis.found.policy
    if policy is None:
        remedy = "more throws, other throws, another sensor or fewer starts may do it"
        raise AnswerError("the policy", synthesis.found.verdict, "one that was found", remedy)
    scene, pace = synthesis.scene, asked.pace(synthesis.scene)
    if asked.start is None:
        x, side = _longest(synthesis, policy)
    else:
        x, side = require_start(scene, asked.start)
        inside = synthesis.starts.extents().get(side, [])
        if not any(lo <= x <= hi for lo, hi in inside):
            raise AnswerError(
                "the start", f"x = {x:g} on side {side}", "one of the policy's starts", "choose another"
            )
    steps = _run(synthesis, policy, x, side)
    texts = [_words(synthesis, step) for step in steps]
    start = f"Start: x = {x:.2f} {scene.unit} on side {side}"
    legs = [rest_leg(scene, x, side, 1.5, start, note=texts[0], stage=steps[0].state)]
    made = [(step, step.throw) for step in steps if step.throw is not None][: asked.throws]
    states = [step.state for step in steps]
    afterwards = [*zip(texts[1:], states[1:], strict=True), ("the part is caught", -1)]
    for number, (step, throw) in enumerate(made):
        legs += legs_of(
            scene,
            throw,
            pace,
            f"Throw {number + 1}, {step.name}",
            note=texts[number],
            stage=step.state,
            stays=STAYS if number + 1 == len(made) else 1.0,
            after=afterwards[number],
        )
    place = getattr(synthesis.sensor, "x", None)
    lines = () if place is None else ((float(place), f"sensor: {synthesis.question}"),)
    lanes, title = (
        lanes_of(scene, known=tuple(synthesis.beliefs()), lines=lines),
        f"{scene.name}, one bit of feedback",
    )
    return cut(scene, legs, pace, title=title, about=drawn_of(scene), lanes=lanes)


def _words(synthesis: Synthesis, step: _Step) -> str:
    asked = f"{synthesis.question} {step.heard}" if step.heard else "nothing is asked"
    return f"sensor: {asked} → {'stop' if step.throw is None else f'throw {step.name}'} (state {step.state})"


def _run(synthesis: Synthesis, policy: Policy, x: float, side: int) -> list[_Step]:
    """Follow the policy's table: each throw is without noise, each answer of the sensor without error."""
    steps: list[_Step] = []
    table = policy.first
    for _ in range(int(policy.left.max()) + 1):
        heard = _heard(synthesis, x, side)
        state = int(table[policy.answers.index(heard)])
        if state < 0:
            break
        if policy.throw[state] < 0:
            steps.append(_Step(state, heard, "", None))
            break
        name = policy.throws[int(policy.throw[state])]
        box = synthesis.throws[name]
        path = trace(box.at_kappa(box.middle_kappa), x, side, 1)
        made = throws_of(synthesis.scene, path, box.middle_kappa)
        if not made:
            break
        throw = made[0]
        steps.append(_Step(state, heard, name, throw))
        x, side, table = throw.after, throw.side_after, policy.after[state]
        if throw.code < 0 or (synthesis.mode == "catch" and x >= synthesis.goal[0]):
            break
    return steps


def _heard(synthesis: Synthesis, x: float, side: int) -> str:
    if synthesis.sensor is None:
        return ""
    return "yes" if synthesis.sensor.read(x, side, 0.0) else "no"


def _longest(synthesis: Synthesis, policy: Policy) -> tuple[float, int]:
    """Choose the start from which the policy makes the most throws."""
    starts = [
        (lo + (hi - lo) * k / (TRIED + 1), side)
        for side, parts in synthesis.starts.extents().items()
        for lo, hi in parts
        for k in range(1, TRIED + 1)
    ]
    return max(starts, key=lambda start: len(_run(synthesis, policy, *start)), default=(0.0, 0))
