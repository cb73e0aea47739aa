"""Designs for a goal, and designs that hold a margin."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from mpmath import mp

import limitsets as ls
from limitsets.base.errors import AnswerError, LimitsetsError
from limitsets.feeder.scene.scene import unit_of
from limitsets.parameters.design import robust_design
from limitsets.parameters.design.design_result import unbeaten
from limitsets.parameters.design.for_goal import design_for_goal
from limitsets.parameters.design.for_margin import orders_of, polished, tolerance_of
from limitsets.parameters.design.search import (
    DesignSearch,
    bounds_of,
    counterweight_for,
    counterweight_of,
    validity_slack,
)
from limitsets.parameters.margins.deviations import Tolerance
from limitsets.parameters.margins.estimate import estimated, failing, invariant_intervals, least_slack
from limitsets.systems.maps import advance
from tests.plates import LEAD_QUAD, LEAD_TRIANGLE, left_by_some
from tests.studies.test_studies import load_study
from tests.thrower import reference

# ----------------------------------------------------------------
# Design for the scene's own goal: X and side stay, bounds come by themselves, and what ruled designs out is said.


def test_a_goal_that_fails_is_met_at_its_own_x():
    """paper-initial's goal fails (the paper's section 5).  The analysis says what the search found."""
    found = design_for_goal("paper-initial", evaluations=600)
    assert found.verdict == "proved"
    assert found.scene.goal == ls.load("paper-initial").goal
    outcome = ls.analyse(found.scene).goal
    assert outcome.holds
    assert not outcome.vacuous
    assert outcome.goal.x - outcome.threshold >= found.room - 1e-3
    assert found.room_before < 0.0 < found.room
    for name, (lo, hi) in found.varied.items():
        assert lo <= found.scene.value(name) <= hi


def test_a_scene_whose_goal_is_proved_is_a_design_and_is_told_of():
    """ "none that feeds; widen the bounds" was printed for it: the scene itself is among the first designs."""
    found = design_for_goal("paper-designed", evaluations=5)
    assert found.verdict == "proved"
    # the threshold of paper-designed is 19.753 (tests/test_paper.py)
    assert found.room_before == pytest.approx(20.0 - 19.753, abs=1e-3)
    assert found.room >= found.room_before
    meets = f"the scene as it is meets the goal, with {found.room_before:.3g} in to spare"
    assert found.itself.startswith(meets)
    own = ls.load(found.before.as_dict() | {"name": found.scene.name})
    assert replace(found, scene=own).itself.endswith("so that paper-designed-design has its values")
    found = design_for_goal("paper-initial", evaluations=5)
    ruled_out = f"the scene as it is is ruled out, as one of those that {found.lacking_before}"
    assert found.itself.startswith(ruled_out)
    assert found.lacking_before


def test_quantities_stay_in_the_units_of_the_file():
    found = design_for_goal(ls.load(LEAD_QUAD), evaluations=48)
    assert list(found.varied) == [
        "part.mass.points[0].x", "part.mass.points[0].y", "part.mass.points[0].mass", "throw.speed",
        "arm.surface_height",
    ]  # fmt: skip
    text = found.scene.text
    assert text["throw"]["speed"].endswith(" deg/s")
    assert text["part"]["mass"]["points"][0]["mass"].endswith(" g")
    assert text["goal"] == LEAD_QUAD["goal"]
    rows = {row[0]: row[1:] for row in found.table().rows}
    assert rows["throw.speed"][0] == pytest.approx(160.0)
    assert rows["throw.speed"][-1] == "deg/s"
    assert rows["part.mass.points[0].mass"][0] == pytest.approx(60.0)


@pytest.mark.parametrize(
    ("scene", "height"),
    # the usual heights end at 0.2 and 0.005 mean sides below the joint, -1.07 and -0.027 in
    [("paper-designed", None), ("paper-designed", 0.3), ("paper-designed", -3.0), (LEAD_QUAD, None)],
)
def test_own_bounds_hold_the_value(scene, height):
    loaded = ls.load(scene)
    loaded = loaded if height is None else loaded.with_values({"arm.surface_height": height})
    for name, (lo, hi) in bounds_of(loaded).items():
        assert lo < hi
        assert lo <= loaded.value(name) <= hi
    assert bounds_of(loaded, ["arm.length"])["arm.length"][0] == loaded.arm_length


@pytest.mark.parametrize(
    ("name", "given", "ends"),
    [
        # the usual ones: 2.2 and 8 mean side lengths of 5.36667 in
        ("paper-designed", {"throw.kappa": (None, 30.0)}, (2.2 * 16.1 / 3.0, 30.0)),
        ("paper-designed", {"throw.kappa": (20.0, None)}, (20.0, 8.0 * 16.1 / 3.0)),
        # 15.9 mean side lengths: a throw beyond the usual ones may become as fast again
        ("paper-initial-small-angle", None, (2.2 * 16.1 / 3.0, 2.0 * 85.2549144)),
    ],
)
def test_a_bound_that_is_left_out_is_the_usual_one(name, given, ends):
    assert bounds_of(ls.load(name), given=given)["throw.kappa"] == pytest.approx(ends)


def test_bounds_with_nothing_between_are_refused():
    with pytest.raises(AnswerError, match=r"arm\.length.*28 to 20"):
        bounds_of(ls.load("paper-designed"), given={"arm.length": (None, 20.0)})


def leaving(scene):
    """Share of random starts on the whole arm from which parts leave it within 500 throws."""
    rng = np.random.default_rng(7)
    side = rng.integers(len(scene.sides), size=4000)
    a = scene.sides.a[side]
    x = a + rng.random(4000) * (scene.arm_length - a)
    return float((advance(scene.map, x, side, 500)[2] < 0).mean())


def test_a_design_that_no_part_leaves_comes_first():
    """It handed out `left_by_some`, for its room is larger by a millimetre: its margins are 0."""
    found = design_for_goal(LEAD_TRIANGLE)
    assert leaving(ls.load(left_by_some())) == pytest.approx(0.035, abs=0.01)
    assert leaving(found.scene) == 0.0
    assert found.leaving is None
    assert found.verdict == "proved"
    assert found.ruled_out["lose parts from some starts on the arm"] > 0
    (speed,) = ls.margin(found.scene, "throw.speed", reading="fixed")
    assert speed.proved > 0.0


def test_of_a_design_that_parts_leave_it_is_said():
    scene = ls.load(left_by_some())
    speed = scene.value("throw.speed")
    found = design_for_goal(scene, bounds={"throw.speed": (0.9999 * speed, 1.0001 * speed)}, evaluations=10)
    assert found.room > 0.0
    assert found.leaving == pytest.approx(0.035, abs=0.01)
    assert found.ruled_out == {"lose parts from some starts on the arm": 10}
    assert found.verdict == "undecided"


def test_what_ruled_designs_out_is_said():
    """About kappa = 33.36 in no part gets oriented: other sides come beyond 20 in (the paper's figure 6)."""
    found = design_for_goal("paper-initial", bounds={"throw.kappa": (33.0, 33.5)}, evaluations=24)
    assert found.room < 0.0
    assert found.verdict == "undecided"
    count, reason = re.search(r"among 24: (\d+) (.*)", found.message).groups()
    assert reason == "let another side get beyond X"
    assert int(count) == sum(found.ruled_out.values()) == 24
    assert found.scene.goal == found.before.goal


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"goal": {"attracts_all": True}}, "oriented_beyond or reaches"),
        ({"effects": {"landing": True}}, "minimal model"),
    ],
)
def test_what_it_refuses(change, says):
    with pytest.raises(AnswerError, match=says):
        design_for_goal(ls.load(ls.load("paper-designed").as_dict() | change))


def test_a_robust_search_says_what_ruled_designs_out():
    """A radius of gyration of 3 in is larger than any mass on the part has: no lead weight makes it."""
    with pytest.raises(AnswerError, match=r"none that feeds among \d+.*\d+ need more than one lead weight"):
        robust_design(
            "paper-designed", vary={"part.mass.radius_of_gyration": (3.0, 3.1)}, tolerance={"throw.speed": "1 %"},
            orders=False, evaluations=2, prove=0.0,
        )  # fmt: skip


def test_a_robust_search_moves_the_masses_that_a_scene_gives():
    """ "none that feeds among 1371: all cannot be built" was said: it moved a centre of mass that they do not give."""
    speed = {"throw.speed": "1 %"}
    found = robust_design(LEAD_TRIANGLE, tolerance=speed, orders=False, evaluations=60, prove=0.0)
    assert {f"part.mass.points[0].{word}" for word in ("x", "y", "mass")} <= set(found.varied)
    assert found.sampled.margin > 0.0
    held = ls.analyse(found.scene, 1024)
    assert held.goal.holds
    assert not held.goal.vacuous
    assert leaving(found.scene) == 0.0


@pytest.mark.sweep
def test_a_robust_search_goes_on_where_nothing_drawn_feeds():
    """ "none that feeds among 1323" was said: designs near to feeding rated above those that feed and lose a start."""
    found = robust_design(LEAD_QUAD, tolerance={"throw.speed": "1 %"}, evaluations=500, prove=0.0)
    assert found.sampled.margin > 1.0
    assert leaving(found.scene) == 0.0
    held = ls.analyse(found.scene, 1024).goal
    assert held.holds
    assert not held.vacuous


@pytest.mark.parametrize("scene", ["paper-designed", LEAD_TRIANGLE, LEAD_QUAD])
def test_the_usual_tolerance_is_of_what_the_scene_gives(scene):
    """It named the radius of gyration of parts that have none, and the search ended."""
    loaded = ls.load(scene)
    texts = tolerance_of(loaded, None)
    assert len(Tolerance.of(loaded, texts).deviations) == len(texts) - 1  # landing.x is noise
    assert ("part.mass.points[0].x" in texts) == (scene != "paper-designed")


def test_a_point_mass_keeps_its_place_on_a_part_whose_sides_change_places():
    """Its barycentric coordinates stay."""
    for order in orders_of(ls.load(LEAD_TRIANGLE)):
        point = [order.value(f"part.mass.points[0].{word}") for word in "xy"]
        shares = np.linalg.solve(np.vstack([order.vertices.T, np.ones(3)]), [*point, 1.0])
        first = ls.load(LEAD_TRIANGLE).vertices
        own = np.linalg.solve(np.vstack([first.T, np.ones(3)]), [30.0, 8.0, 1.0])
        assert shares == pytest.approx(own, abs=1e-6)


def test_a_robust_search_that_is_ended_has_left_its_best():
    kept = []

    def ended(scene):
        kept.append(scene)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        robust_design(
            "paper-designed", vary=["part.mass.center.along"], tolerance={"throw.speed": "1 %"}, orders=False,
            evaluations=4, prove=0.0, keep=ended,
        )  # fmt: skip
    (best,) = kept
    assert best.goal.side == 2
    assert ls.analyse(best, 1024).goal.holds


@pytest.mark.sweep
@pytest.mark.parametrize("throw", [{"speed": "158.0245 deg/s"}, {"kappa": "25.3778518 in"}])
def test_a_robust_design_keeps_deg_per_s(throw):
    """The speed is written in deg/s, as in the scene or as people read it: kappa w^2 is the gravity of the scene."""
    bounds = {"throw.speed": (2.7, 2.8), "part.mass.center.along": (4.0, 4.4)}
    tree = ls.load("paper-designed").as_dict() | {"throw": throw}
    found = robust_design(  # of a single design to look at, too, something is found
        ls.load(tree), vary=bounds, tolerance=SPEED, evaluations=1, orders=False, prove=0.0
    )
    assert unit_of(found.scene, "throw.speed") == "deg/s"
    speed, unit = found.scene.text["throw"]["speed"].split()
    assert unit == "deg/s"
    assert 2.7 <= math.radians(float(speed)) <= 2.8
    assert found.scene.kappa * math.radians(float(speed)) ** 2 == pytest.approx(193.045, rel=1e-12)
    (row,) = [row for row in found.table().rows if row[0] == "throw.speed"]
    assert row[1] == pytest.approx(158.0245, abs=1e-3)
    assert row[-1] == "deg/s"


def test_a_design_for_critical_points_keeps_deg_per_s():
    tree = ls.load("paper-initial").as_dict() | {"throw": {"speed": "136 deg/s"}}
    vary = ["part.mass.center.along", "part.mass.center.above", "throw.speed"]
    found = ls.design(ls.load(tree), critical_points=[10, 10, 20], vary=vary)
    assert found.scene.text["throw"]["speed"].endswith(" deg/s")
    before, _, unit = found.quantities()["throw.speed"]
    assert (before, unit) == (pytest.approx(136.0), "deg/s")
    assert found.reached
    first = [points[0].x for points in ls.critical_points(found.scene.map, found.scene.domain).values()]
    assert first == pytest.approx([10, 10, 20], abs=1e-8)


def test_arm_and_throw_are_tried_before_another_part():
    """The threshold of paper-designed is 20.1837 at a surface of -0.3 in, above the 20 of the goal."""
    tree = ls.load("paper-designed").as_dict()
    tree["arm"]["surface_height"] = "-0.3 in"
    found = design_for_goal(ls.load(tree), evaluations=96)
    assert found.room_before < 0.0
    assert found.verdict == "proved"
    assert set(found.varied) == {"throw.kappa", "arm.surface_height"}
    assert found.scene.text["part"] == found.before.text["part"]


# ----------------------------------------------------------------
# Robust design: the search's numbers against the table of limit sets, orbits, closed forms, and plane geometry.


SPEED, ALONG = {"throw.speed": "1 %"}, "part.mass.center.along"


@pytest.fixture(scope="module")
def small():
    """A search of few designs, not proved."""
    return robust_design("paper-designed", evaluations=60, orders=False, prove=0.0, seed=3)


# Ends of the limit sets, from the decimal scenes at 40 digits.
@pytest.mark.parametrize(
    ("name", "hi"),
    [
        ("paper-designed", (19.75268801485, 17.439819281769, 23.383151921158)),
        ("paper-initial-small-angle", (20.421069168761, 20.390334647524, 20.393068935673)),
        ("paper-designed-small-angle", (12.88421238353, 10.343418249967, 20.640934683962)),
    ],
)
def test_what_keeps_the_part_ends_where_the_limit_set_does(name, hi):
    """Of scenes whose limit sets have no gap."""
    found = invariant_intervals(ls.load(name).map, 12.0, 2)
    assert found.hi == pytest.approx(hi, abs=1e-6)


def test_a_cycle_keeps_the_part_at_its_points():
    """Three flips that attract, from the formulas of docs/model.md at 50 digits."""
    scene = ls.load("paper-designed").with_values({"throw.kappa": 12.21, "arm.surface_height": -1.73})
    facts = reference.paper("designed", kappa=12.21, surface_height=-1.73)
    points, x, side = {}, mp.mpf(12), 0
    for _ in range(200):
        thrown = reference.throw(facts, side, x)
        x, side = thrown.x, thrown.side
        points[side] = float(x)
    intervals = invariant_intervals(scene.map, 12.0, 0)
    for ends in (intervals.lo, intervals.hi):
        assert ends == pytest.approx([points[side] for side in range(3)], abs=1e-8)


@pytest.mark.parametrize("name", ls.scenes())
def test_no_start_is_lost_where_all_landings_keep_off_the_ends(name):
    """Against throws from everywhere; of paper-quadrilateral those of side 3 flip from a_3 on and are lost inward."""
    scene = ls.load(name)
    codes = [
        advance(scene.bare_map, np.linspace(a, scene.arm_length, 2001)[1:], side, 1)[2]
        for side, a in enumerate(scene.sides.a)
    ]
    stays = bool((np.concatenate(codes) >= 0).all())
    assert (least_slack(scene.bare_map) > 0.0) == stays == (name != "paper-quadrilateral")


def test_landings_off_by_e_are_never_thrown_out_of_what_keeps_the_part():
    scene, e, rng = ls.load("paper-designed"), 0.03, np.random.default_rng(5)
    found = invariant_intervals(scene.map, 12.0, 2, landing=e)
    x, side = rng.uniform(9.5, 20.0, 4000), np.full(4000, 2)
    highest = np.full(3, -np.inf)
    for _ in range(400):
        x, side, code, _ = advance(scene.map, x, side, 1)
        assert (code >= 0).all()
        x = x + e * rng.choice((-1.0, 1.0), x.size)
        assert (found.lo[side] - 1e-9 <= x).all()
        assert (x <= found.hi[side] + 1e-9).all()
        np.maximum.at(highest, side, x)
    # and they come near its ends
    assert (found.hi - highest < 3 * e).all()


def test_the_margin_of_the_speed_is_that_of_the_table():
    """At X = 20 in: 0.733 %, where the threshold of a slower throw passes 20."""
    scene = ls.load("paper-designed")
    box = Tolerance.of(scene, SPEED)
    for factor, beyond in ((0.732, False), (0.734, True)):
        corner = box.scene_at(scene, factor, (-1,))
        assert (invariant_intervals(corner.map, 12.0, 2).threshold(2) > 20.0) == beyond


def test_the_best_margin_of_the_speed_is_where_both_ends_meet():
    scene = ls.load("paper-designed")
    box = Tolerance.of(scene, SPEED)
    found = estimated(scene, box, 2, steps=16)

    def room(factor):
        """Where all places lie that the box leaves for X: from the highest threshold to the lowest top of side 2."""
        kept = [invariant_intervals(box.scene_at(scene, factor, (s,)).map, 12.0, 2) for s in (-1, 1)]
        return max(each.threshold(2) for each in kept), min(float(each.hi[2]) for each in kept)

    least, most = room(found.margin)
    assert least <= found.x <= most
    least, most = room(1.03 * found.margin)
    assert least > most


@pytest.mark.parametrize("name", ["initial", "designed"])
def test_what_a_design_must_keep_is_what_the_model_assumes(name):
    """At 50 digits by the formulas of docs/model.md: the angle, the throw's impulse, the landing's impulse."""
    scene, facts = ls.load(f"paper-{name}"), reference.paper(name)
    found, spare = invariant_intervals(scene.map, 12.0, 2), []
    for side in range(3):
        a, d, h = facts.a[side], facts.d[side], facts.surface_height
        for x in (float(found.lo[side]), float(found.hi[side])):
            thrown = reference.throw(facts, side, x)
            right = a * mp.cos(thrown.phi) - d * mp.sin(thrown.phi)
            foot = (facts.radius_of_gyration**2 + d * (h + d)) / x
            inside = min(facts.length[side] - a - foot, a + foot) / facts.length[side]
            pressed = (thrown.omega * right - (x - facts.kappa * thrown.phi)) / x
            spare += [1 - thrown.phi / scene.sides.corner[side], inside, pressed]
    assert validity_slack(scene, found) == pytest.approx(float(min(spare)), rel=1e-9)


@pytest.mark.parametrize(("name", "rho"), [("paper-initial", 1.14), ("paper-designed", 1.01)])
def test_a_lead_weight_of_65_percent_has_the_radius_of_gyration_of_the_table(name, rho):
    scene = ls.load(name)
    found = counterweight_for(scene.vertices, scene.centre, rho)
    assert found.share == pytest.approx(0.65, abs=0.01)


def test_plate_and_lead_weight_are_the_part_again():
    scene = ls.load("paper-designed")
    found = counterweight_of(scene)
    corners = scene.vertices
    x, y = corners.T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    area = 0.5 * cross.sum()
    g = np.array([((x + np.roll(x, -1)) * cross).sum(), ((y + np.roll(y, -1)) * cross).sum()]) / (6 * area)
    # a triangle: its second moment about the centroid is that of three equal masses on the middles of its sides
    middles = 0.5 * (corners + np.roll(corners, -1, axis=0))
    own = (((middles - g) ** 2).sum(axis=1)).mean()
    p, f = np.array([found.x, found.y]), found.share
    centre = (1 - f) * g + f * p
    assert centre == pytest.approx(scene.centre, abs=1e-12)
    rho2 = (1 - f) * (own + ((g - centre) ** 2).sum()) + f * ((p - centre) ** 2).sum()
    assert math.sqrt(rho2) == pytest.approx(scene.radius_of_gyration, abs=1e-12)


def test_what_is_unbeaten_is_beaten_by_none():
    rng = np.random.default_rng(0)
    margin, throws = rng.random(200).round(2), rng.integers(5, 60, 200).astype(float)
    kept = unbeaten(margin, throws)

    def beaten(k):
        better = (margin >= margin[k]) & (throws <= throws[k])
        return (better & ((margin > margin[k]) | (throws < throws[k]))).any()

    first = [k for k in range(200) if not beaten(k)]
    assert {(margin[k], throws[k]) for k in kept} == {(margin[k], throws[k]) for k in first}


def test_no_part_rests_in_a_box_larger_than_plane_geometry_allows():
    """The study's bound, by formulas of its own, against the package's refusal of parts that tip over."""
    study, scene = load_study("07_robust_design"), ls.load("paper-designed")
    texts = {f"part.sides[{k}]": "1 %" for k in range(3)}
    box = Tolerance.of(scene, texts | dict.fromkeys((ALONG, "part.mass.center.above"), "0.01 in"))
    largest = study.largest_at_rest((5.75, 3.6, 6.75), 4.2255778, 0.7082490)
    signs = list(np.ndindex(2, 2, 2, 2, 2))
    rests = [
        all(box.scene_at(scene, share * largest, [2 * s - 1 for s in corner]) is not None for corner in signs)
        for share in (0.999, 1.001)
    ]
    assert rests == [True, False]


@pytest.mark.sweep
def test_a_small_search_finds_scenes_that_hold_throughout_their_box(small):
    """Thrown: scenes drawn from 0.9 of the box, landings off at random; nothing rests wrongly, and all get there."""
    rng, scene = np.random.default_rng(1), small.scene
    assert small.sampled.margin > 0
    box = Tolerance.of(scene, small.tolerance)
    factor = 0.9 * small.sampled.margin
    for _ in range(12):
        corner = box.scene_at(scene, factor, rng.choice((-1.0, 1.0), len(box.deviations)))
        x = np.full(200, small.x - 1e-3)
        side = np.full(200, small.side)
        arrived = np.zeros(200, dtype=bool)
        for throw in range(3000):
            x, side, code, _ = advance(corner.map, x, side, 1)
            assert (code >= 0).all()
            x = x + factor * box.scatter * rng.uniform(-1, 1, x.size)
            if throw > 500:
                assert not ((x > small.x) & (side != small.side)).any()
                arrived |= (x >= small.x) & (side == small.side)
        assert arrived.all()


@pytest.mark.sweep
def test_the_margin_of_the_design_is_that_of_its_worst_corner(small):
    """By `failing`, which tries corner after corner at one factor: none at the margin, one a little beyond."""
    box = Tolerance.of(small.scene, small.tolerance)
    for share, fails in ((1.0, False), (1.001, True)):
        assert bool(failing(small.scene, box, 2, small.sampled, share * small.sampled.margin)) is fails


@pytest.mark.sweep
def test_what_stands_on_the_front_holds_on_all_corners(small):
    box = Tolerance.of(small.scene, small.tolerance)
    for option in small.front[:3]:
        scene, found = small.before.with_values(option.candidate.values), option.candidate.estimate
        assert failing(scene, box, 2, found, found.margin) == []


def test_polishing_never_ends_below_its_start():
    """The scene itself as the start, its margin from a search for the worst corner that knows nothing of polishing."""
    scene = ls.load("paper-designed")
    box = Tolerance.of(scene, SPEED)
    search = DesignSearch(scene, box, 2, {"throw.kappa": (20.0, 30.0)})
    start = math.log(scene.kappa / 20.0) / math.log(1.5)
    before = estimated(scene, box, 2, steps=20).margin
    made, found = polished(search, [[start]], lambda each: each, 12, lambda *_: None)
    assert found.margin > 1.01 * before
    assert failing(made, box, 2, found, found.margin) == []
    assert 20.0 <= made.kappa <= 30.0


def test_a_corner_at_which_a_design_fails_is_kept():
    """A design whose quick margin is denied by a corner, by `failing`: with that corner kept, none denies the next."""
    scene = ls.load("paper-designed")
    box = Tolerance.of(scene, SPEED | {"arm.length": "1 %"})
    search = DesignSearch(scene, box, 2, bounds_of(scene))
    design = np.random.default_rng(0).random((36, len(search.bounds)))[-1]
    made = search.scene_of(design)
    first = estimated(made, box, 2)
    wrong = failing(made, box, 2, first, 0.97 * first.margin)
    assert wrong
    search.harden(design)
    assert search.hard == wrong
    found = estimated(made, box, 2, hard=search.hard)
    assert 0.0 < found.margin < first.margin
    assert failing(made, box, 2, found, 0.97 * found.margin) == []


@pytest.mark.sweep
def test_a_small_search_says_how_it_was_found(small):
    record = small.to_json()
    json.dumps(record, allow_nan=False)
    assert record["margins"] == []
    assert record["values"].keys() >= {"part.sides[0]", "throw.kappa", "part.mass.center.along"}
    assert small.lead.inside >= 0.0
    # nothing on the front is worse than the design in both
    assert all(
        option.candidate.estimate.margin >= small.sampled.margin or option.feeding.mean <= small.feeding.mean
        for option in small.front
    )
    assert small.front[0].candidate.estimate.margin >= small.sampled.margin
    assert small.scene.goal == ls.load(small.scene.as_dict()).goal
    margins = [option.candidate.estimate.margin for option in small.front]
    assert margins == sorted(margins, reverse=True)


def test_the_same_seed_gives_the_same_designs():
    scene = ls.load("paper-designed")
    found = []
    for _ in range(2):
        search = DesignSearch(scene, Tolerance.of(scene, SPEED), 2, bounds_of(scene))
        drawn, _ = search.drawn(np.random.default_rng(8), 5)
        found.append(search.improved(drawn, 1, 3, lambda *_: None)[0])
    assert (found[0] == found[1]).all()


@pytest.mark.sweep
def test_the_figure_of_the_front(small, tmp_path):
    path = tmp_path / "front.png"
    ls.plot.robust_design(small, wanted=18.4, bound=14.7).savefig(path)
    assert path.stat().st_size > 10_000


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"side": 3}, "0 to 2"),
        ({"evaluations": 0}, "1 or more"),
        ({"vary": {"arm.length": (None, 20.0)}}, "a lower and a higher one"),
        ({"vary": {"part.mass.center.along": (0.1, 0.2)}}, "none that feeds"),
    ],
)
def test_what_cannot_be_designed_is_refused(options, words):
    with pytest.raises(LimitsetsError, match=words):
        robust_design("paper-designed", **({"evaluations": 5, "orders": False, "prove": 0.0} | options))


def test_the_usual_bounds_are_in_the_scenes_unit():
    inches = ls.load("paper-designed")
    tree = inches.as_dict()
    tree["arm"]["length"] = f"{28 * 2.54} cm"
    cm = ls.load(tree)
    for name, (lo, hi) in bounds_of(inches).items():
        assert bounds_of(cm)[name] == pytest.approx((2.54 * lo, 2.54 * hi), rel=1e-12)


@pytest.mark.sweep
def test_what_belongs_to_x_moves_with_it():
    """The cavity stayed where it was, so that nothing was fed by the design."""
    given = ls.load("paper-designed").as_dict()
    given["cavity"] = {"position": "20 in", "width": "9 in", "depth": "5 in", "angle": "30 deg"}
    given["feedback"] = {"sensor": {"beyond": "20 in"}, "throws": [{"name": "slow", "speed": "150 deg/s"}]}
    given["throw"] = {"speed": "158.02 deg/s"}
    given["gravity"] = {"acceleration": "193.045 in/s^2"}
    found = robust_design(ls.load(given), vary=["throw.speed"], evaluations=4, orders=False, prove=0.0)
    text = found.scene.as_dict()
    place = text["goal"]["oriented_beyond"]["x"]
    assert float(place.split()[0]) == found.x != 20.0
    assert text["cavity"]["position"] == text["feedback"]["sensor"]["beyond"] == place
