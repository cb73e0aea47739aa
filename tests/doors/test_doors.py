"""The same numbers through every door, or a reason: of some of the scenes of `python -m tests.doors`."""

import pytest

from tests.doors.asking import asked, disagreements
from tests.doors.scenes import scenes

SOME = ("surface above the joint", "nothing gets there", "with an effect", "a steel plate")


@pytest.mark.sweep
@pytest.mark.parametrize("name", SOME)
def test_one_question_has_one_answer(name, tmp_path):
    scene, quantity = scenes()[name]
    found = asked(scene, quantity, tmp_path)
    assert disagreements(found) == []
