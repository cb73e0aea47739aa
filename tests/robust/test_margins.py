"""Margins against sharp ones that are found apart: at 50 digits by the throw's formulas, and by plain orbits.

paper-designed, X = 20 in.  The highest place off side 2 is that of a jog from just below r_2 and a flip after it, onto
side 0.  Fixed but unknown, both throws have one speed; at every throw another, each the worst it can have.
"""

import json
import math
import zipfile
from functools import cache

import numpy as np
import pytest
from mpmath import mp, mpf

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.feeder.goals import AttractsAll, OrientedBeyond, Predicate, Reaches
from limitsets.parameters.margins.deviations import deviation_scale, deviation_scales, given
from limitsets.proofs.prover import Proof
from limitsets.proofs.prover.goals import reaches
from limitsets.proofs.prover.query import Query
from tests import one_throw
from tests.plates import left_by_some, plate
from tests.thrower import reference

X = 20
OF_MASS = [f"part.mass.{name}" for name in ("center.along", "center.above", "radius_of_gyration")]
ALL = [*(f"part.sides[{k}]" for k in range(3)), *OF_MASS, "arm.surface_height", "arm.length"]
ALL += ["throw.speed", "landing.x"]


def first_flip(facts):
    """r_2 near 20 in: the least x on side 2 that flips, by bisection."""
    lo, hi = mpf(19), mpf("21.5")
    assert reference.throw(facts, 2, lo).side == 2
    assert reference.throw(facts, 2, hi).side == 0
    while hi - lo > mpf("1e-9"):
        middle = (lo + hi) / 2
        lo, hi = (middle, hi) if reference.throw(facts, 2, middle).side == 2 else (lo, middle)
    return lo


def highest_off(first, second, landing=0):
    """Where a jog from just below r_2, then a flip lead, each landing so much too far."""
    jogged = reference.throw(first, 2, first_flip(first))
    assert (jogged.code, jogged.side) == (0, 2)
    flipped = reference.throw(second, 2, jogged.x + landing)
    assert flipped.side == 0
    return flipped.x + landing


@cache
def sharp_speed(per_throw):
    """Sharp margin of the speed, as a share."""
    kappa = mpf(reference.paper("designed").numbers["kappa"])

    def over(share):
        slow = reference.paper("designed", kappa=kappa / (1 - share) ** 2)
        fast = reference.paper("designed", kappa=kappa / (1 + share) ** 2)
        return highest_off(slow, fast if per_throw else slow) - X

    return float(mp.findroot(over, (mpf("0.003"), mpf("0.008")), solver="anderson", tol=1e-9))


def test_sharp_margins_of_the_speed_are_those_of_the_table():
    assert sharp_speed(False) == pytest.approx(0.00733, abs=5e-6)
    assert sharp_speed(True) == pytest.approx(0.00397, abs=5e-6)


@pytest.mark.sweep
@pytest.mark.parametrize("reading", ["fixed", "per-throw"])
def test_the_speed_is_bracketed_to_a_hundredth(reading):
    (found,) = ls.margin("paper-designed", "throw.speed", reading=reading)
    sharp = 100 * sharp_speed(reading == "per-throw")
    assert found.proved < sharp < found.refuted
    assert found.refuted - found.proved <= 0.01 * found.refuted
    assert (found.closed, found.reason, found.unit) == (True, "", "%")


# ---------------------------------------------------------------- other quantities, by plain orbits


def breaks_at(name, sign, sizes):
    """First of some sizes at which a long orbit of plain floats comes beyond X off side 2."""
    scene = ls.load("paper-designed")
    nominal = scene.value(name)
    for size in sizes:
        moved = scene.with_values({name: nominal + sign * size})
        if one_throw.highest_off(moved.map, 150_000) > X:
            return size
    return math.inf


@pytest.mark.sweep
def test_of_pieces_proved_for_different_starts_the_fewest_are_claimed(monkeypatch, tmp_path):
    """Below the joint's height every start comes, above it those from R* on: the file claimed every start.

    Across it nothing is proved of starts before the cells: the starts claimed begin with the cells of all pieces.
    """
    tree = left_by_some() | {"goal": {"oriented_beyond": {"x": "111.591 mm", "side": 2}}}
    tree["part"] |= {"sides": ["54 mm", "30 mm", "46 mm"]}
    tree["part"]["mass"]["points"] = [{"x": "9.5479 mm", "y": "11.3473 mm", "mass": "12.4147 g"}]
    tree["arm"]["surface_height"], tree["throw"]["speed"] = "-0.9991 mm", "322.9838 deg/s"
    (found,) = ls.margin(ls.load(tree), "arm.surface_height", width=0.5)
    kinds = [piece.answers[0].starts for piece in found.pieces]
    assert "every" in kinds
    froms = [each["from"] for each in kinds if each != "every"]
    claimed = []
    monkeypatch.setattr(Proof, "save", lambda proof, path, **_: claimed.append(proof.claims[0]))
    found.save(tmp_path)
    grids = [piece.found.cover.grid for piece in found.pieces]
    froms += [{side: grid.edges[int(side)][0][0] for side in froms[0]} for grid in grids]
    assert claimed[0].starts["from"] == {side: max(each[side] for each in froms) for side in froms[0]}


@pytest.mark.parametrize("name", ["arm.surface_height", pytest.param(OF_MASS[0], marks=pytest.mark.sweep)])
def test_lengths_are_bracketed(name):
    (found,) = ls.margin("paper-designed", name, width=0.02)
    assert found.unit == "in"
    assert found.closed
    sizes = np.array([0.97, 1.0, 1.02]) * found.refuted
    least, sign = min((breaks_at(name, sign, sizes), sign) for sign in (-1, 1))
    assert found.direction == ("less" if sign < 0 else "more")
    assert found.proved <= least
    assert 0.97 * found.refuted < least <= 1.02 * found.refuted


@pytest.mark.sweep
def test_a_tolerance_in_turns_or_milligrams_says_the_unit_of_the_margin():
    scene = ls.load("paper-designed").as_dict()
    scene["throw"], scene["gravity"] = {"speed": "26.336 rpm"}, {"acceleration": "193.045 in/s^2"}
    (by_share,) = ls.margin(ls.load(scene), "throw.speed", reading="fixed", width=0.1)
    scene["tolerance"] = {"throw.speed": "0.1 rpm"}
    (found,) = ls.margin(ls.load(scene), "throw.speed", reading="fixed", width=0.1)
    assert (found.unit, found.closed) == ("rpm", True)
    # two brackets of one number
    assert found.proved < 0.26336 * by_share.refuted
    assert 0.26336 * by_share.proved < found.refuted
    points = [{"x": "2 in", "y": "1 in", "mass": "6000 mg"}]
    scene["part"]["mass"] = {"plate_density": "1 kg/m^2", "points": points}
    scene["tolerance"] = {"part.mass.points[0].mass": "500 mg"}
    one = deviation_scale(ls.load(scene), "part.mass.points[0].mass")
    assert (one.unit, one.least) == ("mg", 6)


@pytest.mark.sweep
def test_the_landing_place_agrees_with_the_throw_at_50_digits():
    nominal = reference.paper("designed")

    def over(e):
        return highest_off(nominal, nominal, e) - X

    sharp = float(mp.findroot(over, (mpf("0.05"), mpf("0.2")), solver="anderson", tol=1e-9))
    assert sharp == pytest.approx(0.10595, abs=1e-5)  # which other tests take from here
    (found,) = ls.margin("paper-designed", "landing.x")
    assert found.reading == "per-throw"
    assert found.proved < sharp < found.refuted
    assert found.refuted < 1.02 * sharp
    # 0.07 in: beyond, the worst landings can lose starts from the middle of the arm, and the goal holds on cells only
    assert not found.closed
    assert "may leave the cells" in found.reason


@pytest.mark.sweep
def test_a_deviation_that_never_breaks_the_goal_says_what_ends_it():
    """With a side 2 that is 21.5 % longer the part no longer rests on side 1: a_1 reaches its length."""
    (found,) = ls.margin("paper-designed", "part.sides[2]", width=0.05)
    assert found.refuted is None
    # before that starts next to the arm's end are thrown off it: then the goal is not one of every start
    assert "may leave the cells" in found.reason
    scene = ls.load("paper-designed")
    longer = scene.with_values({"part.sides[2]": 6.75 * 1.2127})
    assert ls.orbit(longer.map, 28.0, 0, 1).stopped == "outward"
    scene.with_values({"part.sides[2]": 6.75 * (1 + found.proved / 100)})
    with pytest.raises(LimitsetsError):
        scene.with_values({"part.sides[2]": 6.75 * (1 + 1.06 * found.proved / 100)})
    (found,) = ls.margin("paper-designed", "arm.length", width=0.05)
    assert found.refuted is None
    assert "may leave the arm" in found.reason
    # the limit set ends at 23.3832 in
    assert 0.9 * (28 - 23.383152) < found.proved < 28 - 23.383152


# ---------------------------------------------------------------- goals


@pytest.mark.sweep
def test_several_goals_hold_together():
    """X = 22.5 is reached by the limit set's 23.3832 with less to spare than it is beyond the threshold of 19.753."""
    goals = [OrientedBeyond(22.5, 2), Reaches(22.5, 2)]
    (both,) = ls.margin("paper-designed", "throw.speed", goal=goals, width=0.2)
    (one,) = ls.margin("paper-designed", "throw.speed", goal=goals[0], width=0.2)
    assert both.refuted < one.proved
    slow = ls.load("paper-designed")
    for share, reached in ((both.proved, True), (both.refuted, False)):
        tops = []
        for sign in (-1, 1):
            kappa = slow.kappa / (1 + sign * share / 100) ** 2
            path = ls.orbit(slow.with_values({"throw.kappa": kappa}).map, 15.0, 2, 150_000)
            x = np.asarray(path.x)[1000:][np.asarray(path.side)[1000:] == 2]
            tops.append(x.max())
        assert (min(tops) >= 22.5) == reached


def below_20_off_side_2(lo, hi, side):
    return (hi <= 20.0) | (side == 2)


@pytest.mark.sweep
@pytest.mark.parametrize("reading", ["fixed", "per-throw"])
def test_a_function_of_the_callers_is_a_goal(tmp_path, reading):
    goal = Predicate(below_20_off_side_2, "below 20 in off side 2", cuts=(20.0,))
    (found,) = ls.margin("paper-designed", "throw.speed", goal=goal, reading=reading, width=0.1)
    assert found.proved < 100 * sharp_speed(reading == "per-throw") < found.refuted
    assert found.closed
    with pytest.raises(LimitsetsError, match="goals that the checker knows"):
        found.save(tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.sweep
def test_a_plain_function_is_taken_and_a_wrong_one_refused():
    (found,) = ls.margin(
        "paper-designed", "arm.surface_height", goal=lambda lo, hi, side: hi < 24.0, width=0.5
    )
    assert found.proved > 0
    with pytest.raises(LimitsetsError, match="returns"):
        ls.margin("paper-designed", "throw.speed", goal=lambda lo, hi, side: 1.0)


def test_a_predicate_from_anywhere():
    """From 28 in parts land beyond 25 in off side 2 (the map at the arm's end), but never beyond the arm."""

    def on_the_arm(lo, hi, side):
        return hi <= 28.0

    def near(lo, hi, side):
        return (hi <= 25.0) | (side == 2)

    scene = ls.load("paper-designed")
    (found,) = ls.margin(scene, "throw.speed", goal=Predicate(on_the_arm, from_anywhere=True), width=0.9)
    assert found.proved > 0
    (found,) = ls.margin(scene, "throw.speed", goal=Predicate(near, cuts=(25.0,), from_anywhere=True))
    assert (found.proved, found.refuted) == (0.0, 0.0)
    end = found.counterexample[-1]
    assert end.side != 2
    assert end.lo > 25.0


def test_a_goal_that_fails_as_it_is_has_no_margin():
    (found,) = ls.margin("paper-initial", "throw.speed", goal=OrientedBeyond(20.0, 2))
    assert (found.proved, found.refuted) == (0.0, 0.0)
    assert "as it is" in found.reason
    assert found.counterexample[-1].lo > 20.0
    (found,) = ls.margin("paper-designed", "landing.x", goal=AttractsAll(), width=0.5)
    # a landing a little short of a_i leaves, however little it is
    assert found.proved == 0.0
    assert not found.closed


# ---------------------------------------------------------------- lists and refusals


def test_every_quantity_of_a_scene_is_measured():
    scene = ls.load("paper-designed")
    assert set(given(scene)) == set(ALL)
    listed = [(one.quantity, one.reading, one.unit) for one in deviation_scales(scene)]
    assert [name for name, reading, _ in listed if reading == "fixed"] == ALL[:-1]
    assert [name for name, reading, _ in listed if reading == "per-throw"] == ["throw.speed", "landing.x"]
    assert ("part.sides[1]", "fixed", "%") in listed
    assert ("part.mass.center.along", "fixed", "in") in listed
    tilted = ls.load(scene.as_dict() | {"gravity": {"tilt": "30 deg"}, "throw": {"speed": "158.02 deg/s"}})
    of_tilt = [(m.reading, m.unit) for m in deviation_scales(tilted) if m.quantity == "gravity.tilt"]
    assert set(of_tilt) >= {("fixed", "deg"), ("per-throw", "deg")}
    own = ls.load(scene.as_dict() | {"tolerance": {"part.mass.center.along": "1 %"}})
    (along,) = [m for m in deviation_scales(own) if m.quantity == "part.mass.center.along"]
    assert along.unit == "%"


@pytest.mark.sweep
def test_a_goal_that_fails_between_scenes_in_which_it_holds():
    """The part's centre moved right in paper-initial: x > 21.8 off side 2 near 0.07 in, not at 0.097 in."""
    (found,) = ls.margin("paper-initial", "part.mass.center.along", goal=OrientedBeyond(21.8, 2), width=0.03)
    assert found.closed

    def highest(size):
        moved = ls.load("paper-initial").with_values({"part.mass.center.along": 3.9867006 + size})
        return one_throw.highest_off(moved.map, 200_000)

    assert highest(0.0972) < 21.8
    assert max(highest(sign * found.proved) for sign in (-1, 1)) < 21.8
    assert highest(1.01 * found.refuted) > 21.8


def test_the_value_is_in_the_unit_of_its_deviation():
    # -0.2 in; an inch is 25.4 mm
    own = ls.load(ls.load("paper-designed").as_dict() | {"tolerance": {"arm.surface_height": "0.1 mm"}})
    (found,) = ls.margin(own, "arm.surface_height", width=0.5)
    assert (found.unit, found.nominal) == ("mm", pytest.approx(-5.08, rel=1e-15))
    # the scene in metres, its surface given in millimetres
    tree = ls.load("paper-designed").as_dict()
    tree["arm"] = {"surface_height": "-5.08 mm", "length": "0.7112 m"}
    (found,) = ls.margin(ls.load(tree), "arm.surface_height", goal=OrientedBeyond(0.508, 2), width=0.5)
    assert (found.unit, found.nominal) == ("m", pytest.approx(-0.00508, rel=1e-12))


@pytest.mark.parametrize(
    ("quantity", "options", "words"),
    [
        ("throw.sped", {}, "throw.speed"),
        ("part.sides[3]", {}, "one that the scene gives"),
        ("part.vertices[0].x", {}, "one that the scene gives"),
        ("throw.speed", {"reading": "always"}, "fixed or per-throw"),
        ("part.sides[0]", {"reading": "per-throw"}, "fixed but unknown"),
        ("landing.x", {"reading": "fixed"}, "per-throw"),
        ("gravity.acceleration", {}, "given by kappa"),
        ("throw.speed", {"width": 0.0}, "width"),
        ("throw.speed", {"goal": "x > 20"}, "goal"),
        ("throw.speed", {"goal": []}, "goal"),
        ("joint", {}, "tolerance"),
    ],
)
def test_refusals(quantity, options, words):
    with pytest.raises(LimitsetsError, match=words):
        ls.margin("paper-designed", quantity, **options)


def test_a_scene_without_a_goal_is_asked_for_one():
    tree = ls.load("paper-designed").as_dict()
    del tree["goal"]
    with pytest.raises(LimitsetsError, match="say what has to hold"):
        ls.margin(ls.load(tree), "throw.speed")


# A quadrilateral in mm with a lead weight: parts that lie far outside the attractor come to it by throws that a few
# hundred cells a side do not tell from throws off the arm.
FROM_AFAR = plate(
    ('["62 mm", "45 mm"], ["12 mm", "45 mm"]', '["88 mm", "42 mm"], ["14 mm", "55 mm"]'),
    ("7850 kg/m^3", "2700 kg/m^3"),
    ('x = "58 mm", y = "9 mm", mass = "18 g"', 'x = "44.2635 mm", y = "31.2089 mm", mass = "37.1433 g"'),
    ("-8 mm", "-3.3130 mm"),
    ("180 deg/s", "170.9105 deg/s"),
    name="from-afar",
    more='[goal]\noriented_beyond = {x = "314.774 mm", side = 2}',
)


def test_a_goal_that_certify_proves_is_proved_by_the_search_for_margins():
    scene = ls.load(FROM_AFAR)
    (goal,) = (claim for claim in ls.certify(scene, claims=["goal"]).claims if claim.claim == "goal")
    assert goal.verdict == "proved"
    assert Query.of(scene, (scene.goal,)).prove().verdict == "proved"


@pytest.mark.sweep
def test_a_scene_whose_starts_need_more_cells_has_a_margin():
    (speed,) = ls.margin(FROM_AFAR, "throw.speed", reading="fixed", width=0.5)
    assert speed.proved > 0.02
    assert speed.refuted > speed.proved


@pytest.mark.sweep
def test_pieces_below_and_above_the_joint_claim_no_start_before_the_cells(tmp_path):
    """Across the joint nothing is proved of the starts before the cells: then nothing is claimed of them above it."""
    tree = ls.load("paper-designed").as_dict()
    tree["arm"]["surface_height"], tree["goal"]["oriented_beyond"]["x"] = "-0.02 in", "22 in"
    (found,) = ls.margin(ls.load(tree), "arm.surface_height", width=0.2)
    near = ["near_joint" in piece.answers[0].section for piece in found.pieces]
    assert True in near
    assert False in near
    header = json.loads(zipfile.ZipFile(found.save(tmp_path, recheck=False)[0]).read("header.json"))
    starts = header["claims"][0]["section"]["starts"]["from"]
    for piece in found.pieces:
        first = [float(edges[0]) for (edges,) in piece.found.cover.grid.edges]
        assert all(float.fromhex(x) >= first[int(side)] for side, x in starts.items())


def test_that_no_part_gets_there_is_found_without_a_bound_of_densities(monkeypatch):
    """The limit set ends at 23.383 in on side 2 (tests/test_paper.py); the bound took most of the time of a curve."""
    monkeypatch.setattr(reaches, "perron_frobenius_bound", None)
    scene = ls.load("paper-designed")
    assert Query.of(scene, (Reaches(23.5, 2),)).refute().verdict == "refuted"
    assert Query.of(scene, (Reaches(23.0, 2),)).refute().verdict == "undecided"
