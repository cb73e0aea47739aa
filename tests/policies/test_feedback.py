"""`ls.feedback` on scenes: against the definition on coarse cells, against throws, and what it refuses."""

import numpy as np
import pytest

import limitsets as ls
from limitsets.errors import AnswerError
from limitsets.policies.beliefs import cells_of
from limitsets.policies.enclosed_starts import not_within
from limitsets.scene.sensing import BeyondSensor, SideSensor
from tests.policies.recursion import as_number, least


def with_throws(name="paper-initial", sensor=None, fast="27.57073926 in"):
    """A built-in scene with its own throw and one at 110 % of its speed: kappa over 1.21."""
    tree = ls.load(name).as_dict()
    tree["feedback"] = {"throws": [{"name": "own", **tree["throw"]}, {"name": "fast", "kappa": fast}]}
    if sensor is not None:
        tree["feedback"]["sensor"] = sensor
    return ls.load(tree)


@pytest.fixture(scope="module")
def scene():
    return with_throws(sensor={"beyond": "20 in"})


@pytest.mark.parametrize(
    ("mode", "starts", "sensor"),
    [
        ("stop", {2: (17.0, 18.0)}, None),
        ("stop", {1: (19.0, 19.9)}, SideSensor(2)),
        ("stop", None, None),
        ("stop", {2: (16.3, 21.0)}, BeyondSensor(18.0, 0.2)),
        ("catch", {2: (16.3, 19.0)}, None),
        ("catch", {0: (13.5, 15.0)}, SideSensor(0)),
        ("catch", {0: (18.0, 19.0)}, "none"),
    ],
)
def test_coarse_cells_against_the_definition(scene, mode, starts, sensor):
    """13 cells a side, the borders at places that matter added; depth 6."""
    found = ls.feedback(scene, sensor, mode=mode, starts=starts, throws=6, cells=13)
    game = found.game
    numbers = [
        [
            None if game.leaves[k, cell] else sum(1 << int(c) for c in cells_of(game.images[k, cell]))
            for cell in range(game.n_cells)
        ]
        for k in range(2)
    ]
    lost = None if game.lost is None else as_number(game.lost)
    plain = least(
        numbers,
        [as_number(mask) for mask in game.answers.values()],
        as_number(game.target),
        lost,
        as_number(found.starts.mask),
        6,
    )
    assert found.found.verdict == ("not-solved" if plain is None else "solved")
    assert plain is None or found.found.throws == plain


def test_a_side_without_a_throw_that_stays_is_told_apart():
    """Small cases with answers from the map itself: one jog from 19.5 on side 2 lands beyond 20, and no flip does."""
    scene = with_throws(sensor={"side": 2})
    after = [float(ls.orbit(scene.map, x, 2, 1).x[1]) for x in (19.4, 19.5)]
    assert min(after) > 20.0
    found = ls.feedback(scene, starts={2: (19.4, 19.5)}, cells=128)
    assert (found.found.verdict, found.found.throws) == ("solved", 1)
    assert found.found.policy.throws[found.found.policy.throw[found.found.policy.first[0]]] == "own"


def test_not_within_by_enclosed_starts():
    """Starts from which one throw ends below x are not served by one, and by two where two jogs get there."""
    scene = with_throws(sensor={"side": 2})
    path = ls.orbit(scene.map, 16.5, 2, 4).x
    needed = int(np.argmax(path >= 20.0))
    assert needed > 1
    found = ls.feedback(scene, starts={2: (16.4, 16.6)}, cells=128, throws=1)
    assert found.found.verdict == "not-solved"
    assert not_within(found, [(16.5, 2)], needed - 1).throws >= 1
    shown = not_within(found, [(16.5, 2)], needed)
    assert (shown.throws < needed, shown.decided) == (True, False)
    with pytest.raises(AnswerError, match="one of the starts"):
        not_within(found, [(19.0, 2)])
