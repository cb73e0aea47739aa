"""Proved periodic orbits: against orbits at 40 digits, multipliers on paper, and orbits that are none."""

import dataclasses
import math
from functools import cache

import mpmath
import numpy as np
import pytest
from scipy.optimize import brentq

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.proofs.prover.attraction import attraction
from limitsets.proofs.prover.certifying import certify
from limitsets.proofs.prover.cover import cover
from limitsets.proofs.prover.orbits import follow, proved_cycle, proved_cycles
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.systems.sets import cycles_of
from tests.proofs.test_end_points import CONTRACTING, NAMES, cells_of
from tests.sets.part import Part


@cache
def cycles(name, up_to):
    return proved_cycles(cells_of(name), up_to)


@pytest.mark.parametrize(("name", "up_to"), [("paper-designed", 16), ("paper-initial", 16)])
def test_every_orbit_found_is_proved_and_repels(name, up_to):
    found = cycles(name, up_to)
    proposed = cycles_of(ls.load(name).map, cells_of(name).cells.extents(), ls.load(name).domain, up_to)
    assert found.missing == ()
    assert [cycle.period for cycle in found.cycles] == [cycle.period for cycle in proposed]
    for cycle, other in zip(found.cycles, proposed, strict=True):
        assert not cycle.attracts
        assert cycle.multiplier[0] > 1.0
        assert cycle.multiplier[0] - 1e-9 < other.multiplier < cycle.multiplier[1] + 1e-9
        assert cycle.multiplier[1] - cycle.multiplier[0] < 1e-8
        assert ((cycle.lo < other.x) & (other.x < cycle.hi)).all()


def test_the_orbits_at_40_digits():
    part = Part("paper-designed")
    for cycle in cycles("paper-designed", 16).cycles[:4]:

        def around(x, cycle=cycle):
            side = int(cycle.side[0])
            points = [x]
            for branch in cycle.branches:
                x, side = part.throw(x, side, NAMES[branch])
                points.append(x)
            return points

        x = mpmath.mp.findroot(lambda x: around(x)[-1] - x, float(cycle.lo[0]), tol=1e-20)
        for lo, hi, point in zip(cycle.lo, cycle.hi, around(x)[:-1], strict=True):
            assert lo < point < hi


def test_an_orbit_of_period_13_that_stays_low():
    # "every orbit reaches X" is false for X above it
    highest = [cycle.hi.max() for cycle in cycles("paper-designed", 16).cycles if cycle.period == 13]
    assert 20.102 < min(highest) < 20.103


@pytest.mark.parametrize(
    ("name", "h", "kappa", "period"),
    [("paper-designed-small-angle", 1.0, 48.6228609, 54), ("paper-initial-small-angle", 1.0, 85.2549144, 48)],
)
def test_small_angle_multipliers_are_powers_of_one_slope(name, h, kappa, period):
    found = proved_cycles(cells_of(name))  # the largest period is chosen
    assert found.up_to == 64
    assert found.cycles[0].period == period
    for cycle in found.cycles:
        expected = math.exp(cycle.period * math.log1p(2.0 * h / kappa))
        assert cycle.multiplier[0] - 1e-12 < expected < cycle.multiplier[1] + 1e-12
        assert not cycle.attracts


def test_orbits_that_attract():
    scene = ls.load("paper-designed").with_values(CONTRACTING)
    found = proved_cycles(attraction(cover(parameter_box(scene), 2048)), 6)
    assert found.missing == ()
    assert [(cycle.period, cycle.attracts) for cycle in found.cycles] == [(1, True), (3, True)]
    assert found.cycles[1].branches.tolist() == [1, 1, 1]
    path = ls.orbit(scene.map, float(found.cycles[1].lo[0]) + 0.1, 0, 300)
    assert np.abs(path.x[-3:] - np.roll(found.cycles[1].lo, -int(path.side[-3]))).max() < 1e-9


# ---------------------------------------------------------------- what is none


def seven():
    scene = ls.load("paper-designed")
    return cycles_of(scene.map, cells_of("paper-designed").cells.extents(), scene.domain, 7)[0]


def test_an_orbit_run_twice_has_a_smaller_period():
    one = seven()
    twice = dataclasses.replace(
        one, x=np.tile(one.x, 2), side=np.tile(one.side, 2), branches=np.tile(one.branches, 2)
    )
    assert proved_cycle(cells_of("paper-designed").cover.box, twice) == "its period may be smaller"


def test_a_point_beside_the_orbit_is_none():
    one = seven()
    beside = dataclasses.replace(one, x=one.x + 1e-3)
    assert "opposite signs" in proved_cycle(cells_of("paper-designed").cover.box, beside)


def test_an_itinerary_the_map_does_not_take_is_none():
    # two flips and eleven jogs: from the fixed point of that itinerary the part jogs once more
    scene, box = ls.load("paper-designed"), cells_of("paper-designed").cover.box
    word = np.array([1, 1, *[0] * 11, 1])

    def gap(x):
        return float(ls.maps.along(scene.map, [x], 0, word)[0][0]) - x

    x = np.full(word.size, brentq(gap, 6.0, 26.0, xtol=1e-13))
    forced = dataclasses.replace(seven(), x=x, side=np.zeros(word.size, np.int64), branches=word)
    assert proved_cycle(box, forced) == "a decision along it is not proved"


def test_follow_stops_where_there_is_no_image():
    box = cells_of("paper-designed").cover.box
    below = float(box.lo.a[0]) - 1.0
    orbit = follow(box, below, below, 0, [0, 0])
    assert orbit.lo.size == 1
    assert orbit.decided.size == 0
    assert math.isnan(orbit.slope[0])


def test_noise_is_refused():
    with pytest.raises(AnswerError, match="without noise"):
        certify("paper-designed", ["cycles"], noise={"throw.speed": "0.1 %"})


def test_the_claim_and_its_section():
    (claim,) = certify("paper-initial", ["cycles"]).claims
    assert claim.verdict == "proved"
    assert [len(cycle["itinerary"]) for cycle in claim.section["cycles"]] == [14, 15, 16]
    for cycle in claim.section["cycles"]:
        assert float.fromhex(cycle["interval"][0]) < float.fromhex(cycle["interval"][1])
        assert not cycle["attracts"]
    assert claim.section["complete"] is False
