"""Whether the margin is large enough, against throws by other formulas (`tests.fitting.machines`)."""

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.parameters.fitting import enough
from tests.fitting.machines import ABOVE, ALONG, HEIGHT, KAPPA, RADIUS, farthest, film
from tests.proofs.forge import scene

# The goal holds up to speeds slower by 0.4 %, or so.
TRUTH = {KAPPA: 25.3778518, ALONG: 4.2255778, ABOVE: 0.7082490, HEIGHT: -0.2, RADIUS: 1.25}
X = 20.0


def aimed_at(**tables):
    return ls.load(scene("designed") | tables)


def fitted(seed, n, **how):
    goal = {"oriented_beyond": {"x": f"{X} in", "side": 2}}
    return ls.fit(aimed_at(goal=goal), film(np.random.default_rng(seed), TRUTH, n, **how))


def values(found):
    return {each.name: each.value for each in found.quantities}


@pytest.mark.sweep
def test_enough_holds_for_machines_within_the_intervals_with_all_of_the_scatter():
    found = fitted(41, 400, error=0.001, speed=1e-4, landing=5e-4)
    judged = enough(found)
    assert (judged.verdict, judged.together, judged.beyond) == ("enough", "proved", None)
    draw = np.random.default_rng(42)
    for _ in range(4):
        machine = {each.name: float(draw.choice([each.lo, each.hi])) for each in found.quantities}
        speed, landing = judged.repeats["throw.speed"][1] / 100.0, judged.repeats["landing.x"][1]
        assert farthest(draw, machine, speed=speed, landing=landing)[:2].max() <= X


@pytest.mark.sweep
def test_not_enough_names_a_deviation_that_fails_and_a_place_beyond_which_it_would_be():
    found = fitted(43, 200, error=0.005, speed=0.004, landing=0.001)
    judged = enough(found)
    assert judged.verdict == "not-enough"
    margin = judged.margins[0]
    assert 0.0 < margin.proved < margin.refuted <= judged.repeats["throw.speed"][0]
    draw, machine = np.random.default_rng(44), values(found)
    # orbits that are drawn come close to the farthest, no more: they need a little more than the least that fails
    assert farthest(draw, machine, speed=margin.proved / 100.0)[:2].max() <= X
    assert farthest(draw, machine, speed=1.2 * margin.refuted / 100.0)[:2].max() > X
    assert f"Beyond X = {judged.beyond:.4g} in it would be." in judged.sentences
    noise = {"speed": judged.repeats["throw.speed"][1] / 100.0, "landing": judged.repeats["landing.x"][1]}
    out = farthest(draw, machine, **noise)
    assert out[:2].max() <= judged.beyond < out[2]


def test_without_a_goal_there_is_nothing_to_ask():
    found = ls.fit(aimed_at(), film(np.random.default_rng(45), TRUTH))
    with pytest.raises(AnswerError, match="goal"):
        enough(found)
