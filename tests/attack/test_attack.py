"""Verdicts against an adversary that shares no code with the package; `python -m tests.attack 500` is the long form."""

from pathlib import Path

import numpy as np
import pytest
from mpmath import mpf

from tests.attack import digits, facts as model, goals, judge, proved
from tests.attack.generate import Case, case
from tests.attack.throws import Orbits, changes, throw

# Scenes of all kinds of verdicts; those that take longest have verdicts of a kind that others have too.
SEEDS = (
    *(4, 37, 28),
    *(pytest.param(k, marks=pytest.mark.sweep) for k in (2, 5, 20, 32, 41, 46)),
    *(pytest.param(k, marks=pytest.mark.repeats) for k in (11, 21, 24)),
)

TRIANGLE = """
name = "paper"
[part]
sides = ["5.75 in", "3.6 in", "6.75 in"]
[part.mass]
center = {{ side = 2, along = "{along} in", above = "{above} in" }}
radius_of_gyration = "1.25 in"
[arm]
surface_height = "{h} in"
length = "{length} in"
[throw]
kappa = "{kappa} in"
[model]
flight = "{flight}"
flip = "{flip}"
"""
ISSUE = """
name = "four"
[part]
vertices = [["8.748 mm", "31.560 mm"], ["-7.853 mm", "31.732 mm"], ["-21.757 mm", "-26.582 mm"],
            ["-0.592 mm", "-32.428 mm"]]
[part.mass]
plate_density = "3 kg/m^2"
points = [{x = "0.404 mm", y = "12.471 mm", mass = "0.775 g"}, {x = "-1.976 mm", y = "20.782 mm", mass = "0.791 g"}]
[arm]
surface_height = "-5.202 mm"
length = "427.206 mm"
[throw]
kappa = "125.9620 mm"
[model]
flip = "energy"
[goal.reaches]
x = "69.0806 mm"
side = 1
every_orbit = true
"""


def scene(flight, flip, h, along, above, kappa, length):
    text = TRIANGLE.format(
        flight=flight, flip=flip, h=h, along=along, above=above, kappa=kappa, length=length
    )
    return model.read(text)


INITIAL_SMALL = ("small-angle", "energy", "-1.0", "3.2444722", "1.7898493", "85.2549144", "40")
DESIGNED_SMALL = ("small-angle", "energy", "-1.0", "4.4179581", "0.5040259", "48.6228609", "40")
INITIAL = ("exact", "signed", "-0.2", "3.9867006", "1.8835981", "33.3605945", "28")
DESIGNED = ("exact", "signed", "-0.2", "4.2255778", "0.7082490", "25.3778518", "28")

# The four scenes' first critical points and limit sets, from the model's reference sheet.
REFERENCE = [
    (INITIAL_SMALL, (20, 20, 20), (13.449486, 18.131207, 13.523780), (20.421069, 20.390335, 20.393069)),
    (DESIGNED_SMALL, (10, 10, 20), (12.216914, 8.954772, 6.360365), (12.884212, 10.343418, 20.640935)),
    (INITIAL, (20, 20, 20), (13.522674, 18.994942, 16.262706), (20.915912, 21.554457, 21.886351)),
    (DESIGNED, (10, 10, 20), (15.205339, 12.637024, 8.914026), (19.752688, 17.439819, 23.383152)),
]


@pytest.mark.parametrize(("words", "critical", "low", "high"), REFERENCE)
def test_the_adversary_knows_the_reference_numbers(words, critical, low, high):
    facts = scene(*words)
    numbers = facts.floats()
    assert np.allclose([changes(numbers, side)[0] for side in range(3)], critical, atol=2e-6)
    rng = np.random.default_rng(1)
    orbits = Orbits(numbers, rng.uniform(6, 25, 3000), rng.integers(0, 3, 3000))
    orbits.fly(600)
    orbits.look()
    orbits.fly(300)
    assert (orbits.code >= 0).all()
    # inside the limit set, and at its ends but for what so many throws miss
    assert (orbits.least.min(axis=0) > np.array(low) - 1e-5).all()
    assert np.allclose(orbits.least.min(axis=0), low, atol=1e-3)
    assert (orbits.most.max(axis=0) < np.array(high) + 1e-5).all()
    assert np.allclose(orbits.most.max(axis=0), high, atol=1e-3)


def test_first_throws_of_the_reference_sheet():
    facts, state, found = scene(*DESIGNED), (mpf(8), 2), []
    assert digits.impact(facts, *state) == pytest.approx(0.311437, abs=5e-7)
    for _ in range(3):
        *state, code = digits.throw(facts, *state)
        found.append(float(state[0]))
        assert code == 0
    assert found == pytest.approx([8.262013, 8.557124, 8.891802], abs=6e-7)


def test_cycles_are_found_whether_they_attract_or_repel():
    """The reference sheet: on the limit set of the designed scene one of period 13 never exceeds 20.103; all repel."""
    facts = scene(*DESIGNED)
    found = proved.cycles(facts, longest=13)
    lowest = np.inf
    for x, side, period in found:
        around = Orbits(facts.floats(), [x], [side])
        around.fly(period)
        lowest = min(lowest, around.most.max())
    assert lowest == pytest.approx(20.1023, abs=1e-3)
    assert {period for _, _, period in found} == set(range(7, 14))


@pytest.mark.parametrize("seed", range(0, 60, 5))
def test_floats_agree_with_50_digits(seed):
    """Kappa below ell, several roots and grazing included; side by side unless a decision is within rounding."""
    facts = model.read(case(seed).text)
    numbers = facts.floats()
    rng = np.random.default_rng(seed)
    apart = 0
    for _ in range(40):
        side = int(rng.integers(len(facts.a)))
        x = float(rng.uniform(numbers[0][side], numbers[6]))
        to, on, code = throw(x, side, *numbers[:3], *numbers[3:], 0.0)
        exact = digits.throw(facts, mpf(x), side)
        if (on, code) != exact[1:]:
            apart += 1
        elif code != -3:
            assert to == pytest.approx(float(exact[0]), abs=1e-11 * numbers[6])
    assert apart == 0


def test_the_judge_sees_a_goal_that_fails_elsewhere():
    """The scene of the issue: a fixed point on side 3 at 274.729 mm takes 2 % of the starts and never meets it."""
    found = goals.Verdict(Case(0, ISSUE, ("goal",)))
    rng = np.random.default_rng(0)
    (within,) = goals.ranges(found.case, rng)
    x, i, _ = proved.starts(within.facts, rng, 2000)
    goal = {"reaches": {"x": "69.0806 mm", "side": 1, "every_orbit": True}}
    bad, code, at, side = proved.settle(goal, within, x, i, rng, -1, 1)
    stay = bad[code[bad] >= 0]
    assert np.allclose(at[stay], 274.729, atol=1e-3)
    assert (side[stay] == 3).all()
    assert 0.01 < stay.size / x.size < 0.03
    claim = {"verdict": "proved", "starts": "almost-every", "share": 1.0, "leaves": 0.0, "open": 0.0}
    proved.proved_goal(found, claim, [within], Path(), rng, 2000)
    assert "go on violating it" in found.faults[0]
    assert "share 1.0 of starts is claimed" in found.faults[1]


@pytest.mark.parametrize("seed", SEEDS)
def test_no_verdict_of_a_random_scene_is_contradicted(seed, tmp_path):
    found = judge.judge(case(seed), tmp_path, count=2000)
    assert found.claims
    assert found.faults == []
