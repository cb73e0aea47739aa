"""A film of a scene: its throws from a start."""

from __future__ import annotations

from typing import TYPE_CHECKING

from limitsets.animation.cutting import Asked, Pace, cut, require_length
from limitsets.animation.film import Film, Lanes
from limitsets.animation.lanes import good_start, known_of, lanes_of, require_start
from limitsets.animation.legs import RESTS, STAYS, drawn_of, legs_of, rest_leg
from limitsets.errors import AnswerError
from limitsets.plot.throwing import throws_of

if TYPE_CHECKING:
    from limitsets.analysis import Analysis
    from limitsets.scene import Scene

USUAL = 8
"""Throws that are shown unless others are asked for."""


def film_of_scene(scene: Scene, asked: Asked) -> Film:
    """Show throws of a scene."""
    if asked.start is not None:
        require_start(scene, asked.start)
    require_length(asked.throws or USUAL)
    found, _ = known_of(scene, asked.progress)
    return film_of_analysis(found, asked)


def film_of_analysis(found: Analysis, asked: Asked) -> Film:
    """Show throws of a scene that is analysed already."""
    scene, count = found.scene, USUAL if asked.throws is None else asked.throws
    start = good_start(found, count) if asked.start is None else require_start(scene, asked.start)
    return film_of_throws(scene, start, count, asked.pace(scene), lanes_of(scene, found))


def film_of_throws(
    scene: Scene, start: tuple[float, int], count: int, pace: Pace, lanes: Lanes | None = None
) -> Film:
    """Show so many throws of a scene from a start; without lanes nothing is analysed."""
    from limitsets.thrower import trace

    x, side = start
    path = trace(scene.map, x, side, count)
    made = throws_of(scene, path)
    if not made:
        allowed = "one from which a throw lands on the arm"
        raise AnswerError("the start", f"x = {x:g} on side {side}: {path.reason}", allowed, "choose another")
    count = len(made)
    words = f"Start: x = {x:.2f} {scene.unit} on side {side}"
    legs = [rest_leg(scene, x, side, 1.0, words)]
    for number, throw in enumerate(made, start=1):
        stays = STAYS if number == count else RESTS
        legs += legs_of(scene, throw, pace, f"Throw {number} of {count}", stays=stays)
    return cut(scene, legs, pace, title=scene.name, about=drawn_of(scene), lanes=lanes)
