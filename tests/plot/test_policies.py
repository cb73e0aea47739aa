"""The figure of a policy shows every belief, and names throws and answers."""

import matplotlib.colors
import numpy as np
import pytest
from matplotlib.patches import Rectangle

import limitsets as ls
from limitsets.base.errors import AnswerError
from tests.policies.test_feedback import with_throws


@pytest.fixture(scope="module")
def found():
    return ls.feedback(with_throws(sensor={"beyond": "20 in"}), cells=256, starts={2: (16.5, 17.5)})


def bars(axes):
    return [each for each in axes.patches if isinstance(each, Rectangle) and 0.5 < each.get_height() < 0.6]


def test_each_belief_is_a_row(found):
    figure = ls.plot.policy(found)
    for side, axes in enumerate(figure.axes):
        drawn = sorted((round(b.get_y() + 0.28), b.get_x(), b.get_x() + b.get_width()) for b in bars(axes))
        wanted = sorted(
            (k, lo, hi) for k, belief in enumerate(found.beliefs()) for lo, hi in belief.get(side, [])
        )
        assert np.allclose(np.array(drawn).reshape(-1, 3), np.array(wanted).reshape(-1, 3))
    labels = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    table = found.found.policy.to_json()["states"]
    assert len(labels) == len(table)
    for label, state in zip(labels, table, strict=True):
        assert f"{state['state']}: {state['throw'] or 'stop'}" in label
        assert all(f"{word} {at}" in label for word, at in state["after"].items() if at is not None)
    stops = {k for k, state in enumerate(table) if state["throw"] is None}
    faces = {round(b.get_y() + 0.28): b.get_facecolor() for axes in figure.axes for b in bars(axes)}
    for k, face in faces.items():
        assert (matplotlib.colors.to_hex(face) == "#ffffff") == (k in stops)
    words = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert words == [
        "throw: own",
        "throw: fast",
        "stop: the part is there",
        "goal: side 2 from here on",
        "sensor",
    ]


def test_many_states_are_drawn_without_names_and_no_policy_is_refused(found):
    many = ls.feedback(found.scene, cells=512)
    assert many.found.policy.states > 60
    figure = ls.plot.policy(many)
    assert figure.get_size_inches()[1] < 18.0
    assert len(bars(figure.axes[2])) == sum(len(belief.get(2, [])) for belief in many.beliefs())
    never = ls.feedback(found.scene, "none", cells=64, throws=1)
    with pytest.raises(AnswerError, match="what to draw is 'not-solved'"):
        ls.plot.policy(never)
