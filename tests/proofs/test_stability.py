"""How far the ground can lean under a part on each of its sides: against the arctangent, and a chamfer, a tolerance."""

import math

import mpmath
import pytest
from matplotlib.patches import Circle

import limitsets as ls
from limitsets.base import AnswerError
from limitsets.feeder.scene import load_to_analyse
from limitsets.proofs.prover.stability import stability
from tests.plates import bracket


def enclosed(pair: tuple[float, float], value: mpmath.mpf, width: float = 1e-12) -> bool:
    return pair[0] <= value <= pair[1] and pair[1] - pair[0] <= width * (1 + abs(value))


@pytest.mark.parametrize("source", ["paper-designed", bracket()])
def test_the_angles_enclose_the_arctangents_of_the_feet(source) -> None:
    scene = ls.load(source)
    answer = stability(scene)
    assert [each.side for each in answer.sides] == list(range(len(scene.sides)))
    with mpmath.workdps(40):
        for side, each in enumerate(answer.sides):
            a, d = (mpmath.mpf(0.5 * sum(pair)) for pair in (each.a, each.d))
            right = mpmath.mpf(0.5 * sum(each.length)) - a
            assert float(a) == pytest.approx(scene.sides.a[side], rel=1e-13)
            assert float(d) == pytest.approx(scene.sides.d[side], rel=1e-13)
            assert enclosed(each.left, mpmath.degrees(mpmath.atan2(a, d)))
            assert enclosed(each.right, mpmath.degrees(mpmath.atan2(right, d)))
            # the middle of a is known to rounding, the lift from it likewise
            for lift, along in ((each.lift_left, a), (each.lift_right, right)):
                assert lift == pytest.approx([float(mpmath.hypot(along, d) - d)] * 2, rel=1e-13)
                assert lift[0] <= lift[1]


def test_a_part_tips_left_onto_the_next_side_and_right_onto_the_one_before() -> None:
    """A flip turns the part about its left corner, from side i to side i + 1."""
    sides = stability("paper-designed").sides
    assert [(each.over_left, each.over_right) for each in sides] == [(1, 2), (2, 0), (0, 1)]
    assert all(each.rests for each in sides)


def test_a_tolerance_widens_the_angles_by_what_it_moves_the_foot() -> None:
    plain = stability("paper-designed").sides[2]
    wide = stability("paper-designed", tolerance={"part.mass.center.along": "0.1 in"}).sides[2]
    with mpmath.workdps(30):
        a, d = mpmath.mpf("4.2255778"), mpmath.mpf("0.7082490")
        ends = [mpmath.degrees(mpmath.atan2(a + off, d)) for off in (-mpmath.mpf(1) / 10, mpmath.mpf(1) / 10)]
    assert float(ends[0]) == pytest.approx(wide.left[0], rel=1e-12)
    assert float(ends[1]) == pytest.approx(wide.left[1], rel=1e-12)
    assert wide.left[0] < plain.left[0] <= plain.left[1] < wide.left[1]
    high = stability("paper-designed", tolerance={"part.mass.center.above": "0.05 in"}).sides[2]
    heights = [0.7082490 + 0.05, 0.7082490 - 0.05]
    lifts = [float(mpmath.hypot(4.2255778, height) - height) for height in heights]
    assert high.lift_left == pytest.approx(
        lifts, rel=1e-9
    )  # the higher the centre of mass, the less it rises
    with pytest.raises(AnswerError, match="the foot of the centre of mass on side 0"):
        stability("paper-designed", tolerance={"part.mass.center.along": "4.3 in"})


def test_a_side_on_which_the_part_does_not_rest_tips_by_itself() -> None:
    """A square of 4 cm with a corner cut off, and a weight that pulls over the edge: a is beyond the chamfer's end."""
    tree = bracket() | {"name": "chamfered"}
    vertices = [["0 cm", "0 cm"], ["4 cm", "0 cm"], ["4 cm", "3.5 cm"], ["3.5 cm", "4 cm"], ["0 cm", "4 cm"]]
    weight = {"x": "1 cm", "y": "3 cm", "mass": "20 g"}
    tree["part"] = {"vertices": vertices, "mass": {"plate_density": "1 kg/m^2", "points": [weight]}}
    scene, effects = load_to_analyse(tree)
    assert effects == ("landing", "roll")
    answer = stability(scene)
    resting = [each.rests for each in answer.sides]
    assert resting == scene.sides.rests.tolist()
    (chamfer,) = (each for each in answer.sides if not each.rests)
    assert min(chamfer.left[1], chamfer.right[1]) < 0.0 < max(chamfer.left[0], chamfer.right[0])
    assert [row[4] for row in answer.table().rows] == resting
    (panel,) = (
        axes for axes in ls.plot.resting_sides(answer).axes if axes.get_title() == f"side {chamfer.side}"
    )
    assert sorted(text.get_text() for text in panel.texts) == ["", "tips"]
    assert any(line.get_gid() == "no rest" for line in panel.lines)


def test_every_panel_shows_the_holes_where_the_part_has_them() -> None:
    """Turning keeps the way from the centre of mass to the round hole: 18.92 and 28.99 mm in the part's own frame."""
    scene = ls.load(bracket())
    way = math.dist(scene.centre, (20.0, 60.0))
    panels = ls.plot.resting_sides(stability(scene)).axes
    assert len(panels) == 5
    for axes, d in zip(panels, scene.sides.d.tolist(), strict=True):
        holes = [patch for patch in axes.patches if patch.get_gid() == "hole"]
        assert len(holes) == 2
        (circle,) = (patch for patch in holes if isinstance(patch, Circle))
        assert circle.radius == pytest.approx(5.0)
        assert math.dist(circle.center, (0.0, d)) == pytest.approx(way, rel=1e-12)
        assert circle.center[1] - circle.radius > 0.0  # above the ground
