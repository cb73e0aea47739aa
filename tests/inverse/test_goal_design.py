"""Design for the scene's own goal: X and side stay, bounds come by themselves, and what ruled designs out is said."""

import re

import pytest

import limitsets as ls
from limitsets.errors import AnswerError
from limitsets.inverse import robust_design
from limitsets.inverse.margin.for_goal import design_for_goal, own_bounds
from limitsets.scene.spelling import unit_of
from tests.lead_quad import LEAD_QUAD


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
    for name, (lo, hi) in own_bounds(loaded).items():
        assert lo < hi
        assert lo <= loaded.value(name) <= hi
    assert own_bounds(loaded, ["arm.length"])["arm.length"][0] == loaded.arm_length


@pytest.mark.parametrize("height", [0.3, -3.0])
def test_own_bounds_reach_out_to_a_value_beyond_the_usual_ones(height):
    """The usual ones end at 0.2 and 0.005 mean sides below the joint, -1.07 and -0.027 in."""
    scene = ls.load("paper-designed").with_values({"arm.surface_height": height})
    lo, hi = own_bounds(scene, ["arm.surface_height"])["arm.surface_height"]
    assert lo <= height <= hi
    assert lo < hi


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
