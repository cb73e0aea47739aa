"""Twenty odd scenes and a quantity of each: one question, asked through every door."""

from typing import Any

import limitsets as ls
from tests.plates import LEAD_QUAD, plate

HEIGHT, SPEED, KAPPA = "arm.surface_height", "throw.speed", "throw.kappa"
BESIDE = "part.mass.center.along"


def _of(name: str, **tables: Any) -> dict[str, Any]:
    tree = ls.load(name).as_dict()
    joined = {
        key: (tree.get(key, {}) | value) if isinstance(value, dict) else value
        for key, value in tables.items()
    }
    # each says one thing
    return tree | joined | {key: tables[key] for key in ("goal", "throw", "gravity") if key in tables}


def _goal(x: str, side: int, **more: Any) -> dict[str, Any]:
    return {"oriented_beyond": {"x": x, "side": side}, **more}


def _world(name: str, world: dict[str, Any], **more: Any) -> dict[str, Any]:
    return _of(name, world=world, **more)


def scenes() -> dict[str, tuple[Any, str]]:
    """By name: a scene as `limitsets.load` takes it, and the quantity whose margin is asked for."""
    designed = "paper-designed"
    steep = {"throw": {"speed": "158.02 deg/s"}, "gravity": {"tilt": "30 deg"}}
    spread = {"spread": "bounded"}
    found = {
        "designed": (_of(designed), KAPPA),
        "designed, small angles": (_of("paper-designed-small-angle"), KAPPA),
        "a goal that fails": (_of("paper-initial"), KAPPA),
        "a goal that fails, small angles": (_of("paper-initial-small-angle"), HEIGHT),
        "four corners": (_of("paper-quadrilateral"), HEIGHT),
        "a triangle to assemble": (_of("paper-triangle"), BESIDE),
        "at the border of the goal": (_of(designed, goal=_goal("19.7527 in", 2)), KAPPA),
        "nothing gets there": (_of(designed, goal=_goal("27 in", 2)), KAPPA),
        "from anywhere": (_of(designed, goal=_goal("20.5 in", 2, from_anywhere=True)), HEIGHT),
        "reaches": (_of(designed, goal={"reaches": {"x": "20 in", "side": 2}}), KAPPA),
        "stays on the arm": (_of(designed, goal={"stays_on_arm": True}), HEIGHT),
        "surface above the joint": (_of(designed, arm={"surface_height": "0.1 in"}), HEIGHT),
        "surface just below the joint": (_of(designed, arm={"surface_height": "-0.02 in"}), HEIGHT),
        "speed and tilt": (_of(designed, **steep), "gravity.tilt"),
        "the arm's end near the limit set": (_of(designed, arm={"length": "23.5 in"}), "arm.length"),
        "with friction": (_world(designed, {"friction": 0.3, "restitution": 0.2}), KAPPA),
        "with bounded spread": (
            _world(designed, {"scatter": {"speed": "0.05 %"}}, effects=spread), KAPPA,
        ),
        "with an effect": (
            _of(designed, effects={"landing": True, "roll": True}, goal=_goal("21 in", 2)), HEIGHT,
        ),
        "a lead plate": (LEAD_QUAD, SPEED),
        "a steel plate": (plate(more='[goal]\noriented_beyond = { x = "250 mm", side = 0 }\n'), SPEED),
    }  # fmt: skip
    assert len(found) == 20
    return found
