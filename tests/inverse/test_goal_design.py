"""Design for the scene's own goal: X and side stay, bounds come by themselves, and what ruled designs out is said."""

import re
from dataclasses import replace

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.feeder.scene.scene import unit_of
from limitsets.parameters.design import robust_design
from limitsets.parameters.design.for_goal import design_for_goal
from limitsets.parameters.design.for_margin import orders_of, tolerance_of
from limitsets.parameters.design.search import bounds_of
from limitsets.parameters.margins.deviations import Tolerance
from limitsets.systems.maps import advance
from tests.lead_quad import LEAD_QUAD
from tests.lead_triangle import LEAD_TRIANGLE, left_by_some


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


def test_a_scene_whose_goal_is_proved_has_a_design():
    """ "none that feeds; widen the bounds" was printed for it: the scene itself is among the first designs."""
    found = design_for_goal("paper-designed", evaluations=5)
    assert found.verdict == "proved"
    # the threshold of paper-designed is 19.753 (tests/test_paper.py)
    assert found.room_before == pytest.approx(20.0 - 19.753, abs=1e-3)
    assert found.room >= found.room_before


def test_the_scene_itself_is_told_of():
    found = design_for_goal("paper-designed", evaluations=5)
    assert found.itself.startswith(
        f"the scene as it is meets the goal, with {found.room_before:.3g} in to spare"
    )
    own = ls.load(found.before.as_dict() | {"name": found.scene.name})
    assert replace(found, scene=own).itself.endswith("so that paper-designed-design has its values")
    found = design_for_goal("paper-initial", evaluations=5)
    assert found.itself.startswith(
        f"the scene as it is is ruled out, as one of those that {found.lacking_before}"
    )
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


@pytest.mark.parametrize("scene", ["paper-designed", LEAD_QUAD])
def test_own_bounds_hold_the_value(scene):
    loaded = ls.load(scene)
    for name, (lo, hi) in bounds_of(loaded).items():
        assert lo < hi
        assert lo <= loaded.value(name) <= hi
    assert bounds_of(loaded, ["arm.length"])["arm.length"][0] == loaded.arm_length


@pytest.mark.parametrize("height", [0.3, -3.0])
def test_own_bounds_reach_out_to_a_value_beyond_the_usual_ones(height):
    """The usual ones end at 0.2 and 0.005 mean sides below the joint, -1.07 and -0.027 in."""
    scene = ls.load("paper-designed").with_values({"arm.surface_height": height})
    lo, hi = bounds_of(scene, ["arm.surface_height"])["arm.surface_height"]
    assert lo <= height <= hi
    assert lo < hi


@pytest.mark.parametrize(
    ("given", "ends"),
    [
        # the usual ones: 2.2 and 8 mean side lengths of 5.36667 in
        ({"throw.kappa": (None, 30.0)}, (2.2 * 16.1 / 3.0, 30.0)),
        ({"throw.kappa": (20.0, None)}, (20.0, 8.0 * 16.1 / 3.0)),
    ],
)
def test_a_bound_that_is_left_out_is_the_usual_one(given, ends):
    assert bounds_of(ls.load("paper-designed"), given=given)["throw.kappa"] == pytest.approx(ends)


def test_a_throw_beyond_the_usual_ones_may_become_as_fast_again():
    """Of paper-initial-small-angle kappa is 15.9 mean side lengths."""
    scene = ls.load("paper-initial-small-angle")
    assert bounds_of(scene)["throw.kappa"] == pytest.approx((2.2 * 16.1 / 3.0, 2.0 * scene.kappa))


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
def test_a_robust_design_keeps_deg_per_s():
    tree = ls.load("paper-designed").as_dict() | {"throw": {"speed": "158.0245 deg/s"}}
    found = robust_design(
        ls.load(tree), vary={"throw.speed": (2.7, 2.8)}, tolerance={"throw.speed": "1 %"}, orders=False,
        evaluations=4, prove=0.0,
    )  # fmt: skip
    assert unit_of(found.scene, "throw.speed") == "deg/s"
    assert found.scene.text["throw"]["speed"].endswith(" deg/s")
    (row,) = [row for row in found.table().rows if row[0] == "throw.speed"]
    assert row[1] == pytest.approx(158.0245)
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
