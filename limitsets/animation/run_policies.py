"""A film of feedback: the sensor's answer, the throw that the policy chooses, and where the part is known to be."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from limitsets.animation.cutting import Asked, cut
from limitsets.animation.film import Film
from limitsets.animation.lanes import lanes_of, require_start
from limitsets.animation.legs import STAYS, drawn_of, legs_of, rest_leg
from limitsets.errors import AnswerError
from limitsets.plot.throwing import Throw, throws_of

if TYPE_CHECKING:
    from limitsets.policies import Policy, Synthesis

# Starts tried in each interval for the one that takes the most throws.
TRIED = 25


class _Step(NamedTuple):
    state: int
    heard: str
    name: str
    throw: Throw | None


def film_of_policy(found: Synthesis, asked: Asked) -> Film:
    """Show what a policy does from a start, without noise."""
    policy = found.found.policy
    if policy is None:
        remedy = "more throws, other throws, another sensor or fewer starts may do it"
        raise AnswerError("the policy", found.found.verdict, "one that was found", remedy)
    scene, pace = found.scene, asked.pace(found.scene)
    if asked.start is None:
        x, side = _longest(found, policy)
    else:
        x, side = require_start(scene, asked.start)
        inside = found.starts.extents().get(side, [])
        if not any(lo <= x <= hi for lo, hi in inside):
            raise AnswerError(
                "the start", f"x = {x:g} on side {side}", "one of the policy's starts", "choose another"
            )
    steps = _run(found, policy, x, side)
    known = tuple(found.beliefs())
    texts = [_words(found, each) for each in steps]
    question = found.question
    legs = [
        rest_leg(
            scene, x, side, 1.5, f"Start: x = {x:.2f} {scene.unit} on side {side}", texts[0], steps[0].state
        )
    ]
    made = [(each, each.throw) for each in steps if each.throw is not None][: asked.throws]
    for number, (each, throw) in enumerate(made):
        last = number + 1 == len(made)
        after = ("the part is caught", -1)
        if number + 1 < len(steps):
            after = texts[number + 1], steps[number + 1].state
        legs += legs_of(
            scene,
            throw,
            pace,
            f"Throw {number + 1}, {each.name}",
            note=texts[number],
            stage=each.state,
            stays=STAYS if last else 1.0,
            after=after,
        )
    place = getattr(found.sensor, "x", None)
    lines = () if place is None else ((float(place), f"sensor: {question}"),)
    lanes = lanes_of(scene, known=known, lines=lines)
    about = drawn_of(scene)
    return cut(scene, legs, pace, title=f"{scene.name}, one bit of feedback", about=about, lanes=lanes)


def _words(found: Synthesis, step: _Step) -> str:
    asked = f"{found.question} {step.heard}" if step.heard else "nothing is asked"
    return f"sensor: {asked} → {'stop' if step.throw is None else f'throw {step.name}'} (state {step.state})"


def _run(found: Synthesis, policy: Policy, x: float, side: int) -> list[_Step]:
    """Follow the table, each throw without noise, each answer without error."""
    from limitsets.thrower import trace

    steps: list[_Step] = []
    table = policy.first
    for _ in range(int(policy.left.max()) + 1):
        heard = _heard(found, x, side)
        state = int(table[policy.answers.index(heard)])
        if state < 0:
            break
        if policy.throw[state] < 0:
            steps.append(_Step(state, heard, "", None))
            break
        name = policy.throws[int(policy.throw[state])]
        box = found.throws[name]
        path = trace(box.at_kappa(box.middle_kappa), x, side, 1)
        made = throws_of(found.scene, path, box.middle_kappa)
        if not made:
            break
        throw = made[0]
        steps.append(_Step(state, heard, name, throw))
        x, side, table = throw.after, throw.side_after, policy.after[state]
        if throw.code < 0 or (found.mode == "catch" and x >= found.goal[0]):
            break
    return steps


def _heard(found: Synthesis, x: float, side: int) -> str:
    if found.sensor is None:
        return ""
    return "yes" if found.sensor.read(x, side, 0.0) else "no"


def _longest(found: Synthesis, policy: Policy) -> tuple[float, int]:
    """Choose the start from which the policy makes the most throws."""
    best, chosen = -1, (0.0, 0)
    for side, parts in found.starts.extents().items():
        for lo, hi in parts:
            for k in range(1, TRIED + 1):
                x = lo + (hi - lo) * k / (TRIED + 1)
                count = len(_run(found, policy, x, side))
                if count > best:
                    best, chosen = count, (x, side)
    return chosen
