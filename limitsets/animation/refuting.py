"""A film of a margin's upper end: the orbit that violates the goal, thrown as the proof says."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from limitsets.animation.cutting import Asked, cut
from limitsets.animation.film import Film
from limitsets.animation.lanes import known_of
from limitsets.animation.legs import STAYS, drawn_of, legs_of, rest_leg
from limitsets.errors import AnswerError
from limitsets.plot.throwing import Throw, throws_of

if TYPE_CHECKING:
    from limitsets.robust import Margin
    from limitsets.scene import Scene

# The last throws that are shown unless others are asked for.
USUAL = 8


def film_of_margin(margin: Margin, asked: Asked) -> Film:
    """Show the last throws of the orbit that refutes."""
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
    """Throw a state as the proof does, with its own kappa; what it lands farther is the noise of the landing."""
    from limitsets.thrower import trace
    from limitsets.thrower.motion import FullThrow

    params = scene.map
    if here.kappa is not None:
        bare = scene.bare_map._replace(kappa=here.kappa)
        params = params._replace(bare=bare) if isinstance(params, FullThrow) else bare
    (throw,) = throws_of(scene, trace(params, 0.5 * (here.lo + here.hi), here.side, 1), here.kappa)
    if here.landing:
        throw = throw._replace(after=throw.after + here.landing, scatters=True)
    return throw
