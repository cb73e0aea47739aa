"""Tasks that the tests ask, by name, of workers; and a driver in a process of its own."""

import math
import os
import signal
import sys
import threading
import time
from pathlib import Path

import numpy as np

from limitsets.base.errors import AnswerError
from limitsets.parameters.atlas import Variable, atlas, block_task

X, Y = "throw.speed=-20:180:21", "arm.surface_height=-1:0.1:9"
TASK = "tests.sweep.tasks_of_tests:numbers"


def numbers(scene, seed, pause=0.002):
    """Some arithmetic, some points without an answer, and a number drawn for each point."""
    time.sleep(pause)
    if scene.kappa > 400.0:
        raise AnswerError("the scene", scene.kappa, "a faster one", "throw faster")
    drawn = np.random.default_rng(seed).random()
    height = None if scene.surface_height > 0 else scene.surface_height
    feet = scene.sides.a + scene.surface_height
    return {"kappa": scene.kappa, "feet": feet, "drawn": drawn, "height": height}


def deadly(scene):
    """Kill the worker at one point, always."""
    if scene.surface_height == -0.5:
        os.kill(os.getpid(), signal.SIGKILL)
    return {"kappa": scene.kappa}


def failing(scene):
    """Fail as a function does that has a bug."""
    return {"number": 1.0 / (scene.surface_height + 0.5)}


def uneven(scene):
    """Return arrays of different lengths."""
    return {"list": [1.0] * (1 + (scene.surface_height == -0.5))}


def of_map(params, factor=1.0):
    """Give the fixed point of the logistic map, from its formula."""
    return {"fixed_point": factor * (1.0 - 1.0 / params.r)}


@block_task(
    lambda subject, power=1: {
        "kappa": Variable(unit="length", about="gravity over the squared speed"),
        "feet": Variable(unit="length", dims=(("side", 3),)),
        "sign": Variable(dtype="int8", codes={"below": 0, "above": 1}),
        "dear": Variable(default=False),
    }
)
def in_blocks(block, power=1):
    """As `numbers`, for many points at once."""
    params = block.points.params
    assert block.points.possible.all()
    found = {
        "kappa": params.kappa**power,
        "feet": params.a + params.surface_height[:, None],
        "sign": (params.surface_height > 0).astype(np.int8),
    }
    return found | ({"dear": np.full(params.kappa.size, math.pi)} if "dear" in block.wanted else {})


LONG = 60_000_000  # bytes: much more than a pipe holds, so that an answer takes a while to be sent


def long_answer(folder, number):
    """Give an answer that is long to send; the first time, of some chunks, die amid it."""
    answer, again = bytes(LONG), Path(folder) / str(number)
    if number % 3 == 0 and not again.exists():
        again.touch()
        threading.Timer(0.002 * (number + 1), os.kill, (os.getpid(), signal.SIGKILL)).start()
    return number, answer


if __name__ == "__main__":  # a driver to kill
    atlas("paper-designed", X, Y, task=TASK, chunk=(3, 3), store=sys.argv[1], workers=2)


def side_of_150(scene):
    """Whether the arm is faster than 150 deg/s."""
    return {"fast": scene.value("throw.speed") > math.radians(150.0)}
