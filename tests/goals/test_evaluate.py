import math
from dataclasses import dataclass

import pytest

from limitsets.base.errors import AnswerError
from limitsets.face.report.pages import goal_sentence
from limitsets.feeder.goals import (
    GOALS,
    AttractsAll,
    FlipOrder,
    Goal,
    OrientedBeyond,
    Predicate,
    Reaches,
    StaysOnArm,
    as_written,
    evaluate,
    words_of,
)
from limitsets.feeder.scene import load
from limitsets.parameters.margins.single import goals_of
from tests.test_paper import LIMIT_SETS

DESIGNED, INITIAL = LIMIT_SETS["paper-designed"], LIMIT_SETS["paper-initial"]


@pytest.mark.parametrize(
    ("extents", "goal", "holds", "threshold"),
    [
        (DESIGNED, OrientedBeyond(20.0, 2), True, 19.75268801485),
        (DESIGNED, OrientedBeyond(19.75268801485, 2), True, 19.75268801485),
        (DESIGNED, OrientedBeyond(19.7526880, 2), False, 19.75268801485),
        (DESIGNED, OrientedBeyond(20.0, 0), False, 23.383151921158),
        (INITIAL, OrientedBeyond(20.0, 2), False, 21.554457325114),
        ({2: [(1.0, 5.0)]}, OrientedBeyond(2.0, 2), True, -math.inf),
        ({0: [], 2: [(1.0, 5.0)]}, OrientedBeyond(2.0, 2), True, -math.inf),
        (DESIGNED, Reaches(23.0, 2), True, 23.383151921158),
        (DESIGNED, Reaches(24.0, 2), False, 23.383151921158),
        (DESIGNED, Reaches(24.0, 2, every_orbit=True), False, 23.383151921158),
        (DESIGNED, Reaches(21.0, 2, every_orbit=True), None, 23.383151921158),
        (DESIGNED, Reaches(1.0, 3), False, -math.inf),
    ],
)
def test_goals_about_places(extents: dict, goal: Goal, holds: bool | None, threshold: float) -> None:
    assert evaluate(goal, extents) == (holds, threshold)


@pytest.mark.parametrize(
    ("goal", "facts", "holds"),
    [
        (AttractsAll(), {"fractions": [1.0]}, True),
        (AttractsAll(), {"fractions": [0.75]}, False),
        (AttractsAll(), {"fractions": [0.5, 0.5]}, False),
        (AttractsAll(), {}, False),
        (FlipOrder((0, 1, 2)), {"flip_order": (0, 1, 2)}, True),
        (FlipOrder((0, 1, 2)), {"flip_order": [2, 0, 1]}, True),
        (FlipOrder((0, 1, 2)), {"flip_order": (0, 2, 1)}, False),
        (FlipOrder((0, 1, 2)), {"flip_order": (0, 1)}, False),
        (FlipOrder((0, 1, 2)), {}, False),
        (StaysOnArm(), {}, True),
        (StaysOnArm(), {"leaving": 0.01}, False),
    ],
)
def test_goals_about_the_whole(goal: Goal, facts: dict, holds: bool) -> None:
    assert evaluate(goal, DESIGNED, **facts) == (holds, None)


@dataclass(frozen=True)
class Upright:
    """A goal of the caller's own making, of which the package knows nothing."""

    kind = "stays_on_arm"
    from_anywhere: bool = False


def test_what_is_no_goal_of_these_has_no_verdict_and_no_words():
    """It was answered, and described, as stays_on_arm."""
    for ask in (
        lambda goal: evaluate(goal, DESIGNED),
        lambda goal: goal_sentence(goal, "in"),
        lambda goal: goals_of(load("paper-designed"), goal),
    ):
        with pytest.raises(AnswerError, match=r"'Upright'.*OrientedBeyond, .*Predicate"):
            ask(Upright())


def some(kind):
    """A goal of a kind, with any numbers."""
    numbers = {"place": 20.0, "side": 2, "sides": (0, 1), "flag": False}
    return kind(**{name: numbers[word] for name, word in words_of(kind).items()})


@pytest.mark.parametrize("kind", GOALS.values())
def test_every_goal_has_words_of_its_own(kind):
    goals = [Predicate(lambda lo, hi, side: lo < 9.0, "below 9 in"), *map(some, GOALS.values())]
    told = goal_sentence(some(kind), "in")
    assert [type(each) for each in goals if goal_sentence(each, "in") == told] == [kind]


@pytest.mark.parametrize("kind", GOALS.values())
def test_a_goal_is_written_as_a_scene_reads_it(kind):
    goal = some(kind)
    tree = load("paper-designed").as_dict() | {"goal": as_written(goal, "in")}
    assert load(tree).goal == goal
