"""Figures of margins, audits, counterexamples and designs."""

from functools import lru_cache

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError, LimitsetsError
from limitsets.face.report.writing import FIGURES, figure
from limitsets.feeder.goals import FlipOrder, OrientedBeyond, Reaches
from limitsets.parameters.margins.joint import joint_margin
from limitsets.parameters.margins.single import margins_beyond
from tests.plot.artists import drawn, named

# ----------------------------------------------------------------
# Figures of margins, by their content; margins against X, by plain orbits.


@pytest.mark.sweep
def test_the_best_place_lies_between():
    """At 20 in the threshold 19.753 leaves little to spare, at 23.3 in the reach 23.383 does."""
    curve = margins_beyond("paper-designed", 2, x=[20.0, 21.2, 23.3], width=0.2)
    best, margin = curve.best()
    assert best == 21.2
    assert margin == curve.proved[1, 0] > 2 * max(curve.proved[0, 0], curve.proved[2, 0])
    assert curve.proved[0, 0] < 0.733 < curve.refuted[0, 0]
    # at the place in the middle, the ends of the bracket: held below, broken above
    scene = ls.load("paper-designed")
    for size, good in ((curve.proved[1, 0], True), (curve.refuted[1, 0], False)):
        held = []
        for sign in (-1, 1):
            kappa = scene.kappa / (1 + sign * size / 100) ** 2
            path = ls.orbit(scene.with_values({"throw.kappa": kappa}).map, 15.0, 2, 400_000)
            x, side = np.asarray(path.x)[1000:], np.asarray(path.side)[1000:]
            held.append(x[side != 2].max() <= 21.2 <= x[side == 2].max())
        assert all(held) == good


@pytest.mark.sweep
def test_the_curve_is_drawn():
    curve = margins_beyond("paper-designed", 2, x=[20.0, 20.1], width=0.5)
    figure = drawn(ls.plot.margin_curve(curve))
    (axes,) = figure.axes
    proved = next(line for line in axes.lines if line.get_label() == "proved safe")
    assert proved.get_ydata() == pytest.approx(curve.proved[:, 0])
    assert "throw.speed [%]" in axes.get_ylabel()


def test_a_side_that_is_never_farthest_is_refused():
    with pytest.raises(LimitsetsError, match="farthest out on, 2;"):
        margins_beyond("paper-designed", 0, places=2)


@pytest.mark.sweep
def test_bars_are_the_brackets():
    margins = ls.margin("paper-designed", "arm.surface_height", "throw.speed", "landing.x", width=0.1)
    figure = drawn(ls.plot.tornado(margins))
    (axes,) = figure.axes
    labels = [label.get_text() for label in axes.get_yticklabels()]
    assert labels[0] == "throw.speed"
    assert labels[1].startswith("landing.x, every throw")
    bars = sorted(named(axes, "proved"), key=lambda bar: bar.get_y())
    ends = [bar.get_x() + bar.get_width() for bar in bars]
    height, speed, landing = margins
    shares = [
        speed.proved,
        100 * landing.proved / 3.6,
        100 * height.proved / 0.2,
    ]  # of the shortest side; of |h|
    assert ends == pytest.approx(shares)
    assert len(named(axes, "refuted")) == 3
    # the numbers beside them never claim more than is known
    words = {round(text.xy[1]): [] for text in named(axes, "number")}
    for text in named(axes, "number"):
        words[round(text.xy[1])].append(text.get_text())
    for row, one in enumerate((speed, landing, height)):
        low, high = (float(word.split()[0]) for word in words[row])
        assert 0.999 * one.proved < low <= one.proved
        assert one.refuted <= high < 1.001 * one.refuted


def test_the_joint_box_is_drawn():
    tolerance = {"throw.speed": "1 %", "landing.x": "0.01 in"}
    found = joint_margin(ls.load("paper-designed"), (OrientedBeyond(20.0, 2),), tolerance, width=0.2)
    figure = drawn(ls.plot.tolerance_box(found))
    (axes,) = figure.axes
    assert [bar.get_width() for bar in named(axes, "proved")] == pytest.approx([2 * found.proved] * 2)
    (larger,) = named(axes, "refuted")
    assert (larger.get_x(), larger.get_width()) == pytest.approx((-found.refuted, 2 * found.refuted))
    assert larger.get_height() == 2
    assert axes.get_xlim()[1] > found.refuted
    (single,) = ls.margin("paper-designed", "arm.surface_height", width=0.5)
    with pytest.raises(LimitsetsError, match="joint"):
        ls.plot.tolerance_box(single)


# ----------------------------------------------------------------
# The audit's figure, by its content; figures of scenes with rolls.


@lru_cache(maxsize=2)
def audited(name):
    return ls.audit(name)


@lru_cache(maxsize=1)
def rolling():
    tree = ls.load("paper-initial").as_dict() | {"effects": {"landing": True, "roll": True}}
    return ls.analyse(ls.load(tree))


@pytest.mark.parametrize("name", ["paper-initial", "paper-designed"])
def test_strips_are_the_ranges(name):
    found = audited(name)
    rows = found.on("domain")
    figure = drawn(ls.plot.audit(found))
    for side, axes in enumerate(figure.axes):
        bars = [(bar, bar.get_x()) for bar in named(axes, "broken")]
        broken = sorted((round(b.get_y() + b.get_height() / 2), x, x + b.get_width()) for b, x in bars)
        wanted = [(row, lo, hi) for row, each in enumerate(rows) for lo, hi in each.ranges.get(side, ())]
        assert broken == [pytest.approx(each) for each in sorted(wanted)]
        assert len(named(axes, "cannot tell")) == sum(bool(each.missing) for each in rows)
        assert len(named(axes, "holds")) == sum(not each.missing for each in rows)
        sets = sorted((bar.get_x(), bar.get_x() + bar.get_width()) for bar in named(axes, "limit set"))
        assert sets == [pytest.approx(each) for each in found.extents[side]]
        assert found.scene.unit in axes.get_xlabel()
    labels = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert labels == [each.about.name for each in rows]


def test_every_figure_of_a_scene_that_rolls_can_be_drawn():
    for kind in FIGURES:
        drawn(figure(rolling(), kind))


def test_rolls_are_drawn_as_rolls():
    """On side 1 the map rolls back to side 0 between its two critical points (the second is r_1 = 20)."""
    (line,) = named(ls.plot.map(rolling().scene, rolling().extents).axes[1], "roll")
    x, y = line.get_data()
    seen = x[y == y]
    first, second = (point.x for point in rolling().critical_points[1])
    assert first <= seen.min() < first + 0.05
    assert second - 0.05 < seen.max() <= second == pytest.approx(20.0, abs=1e-5)
    (axes,) = ls.plot.limit_set(rolling().scene, rolling()).axes
    assert named(axes, "roll")


def test_a_throw_that_rolls():
    figure = ls.plot.flight(rolling().scene, 18.0, 1)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert "a roll" in titles[1]
    assert "onto side 0" in titles[1]
    # it turns about one vertex and rolls on over others: at any time its lowest vertex is on the arm
    outlines = [patch.get_xy() for patch in named(figure.axes[1], "turning")]
    assert len(outlines) == 2
    surface = rolling().scene.surface_height
    assert [outline[:, 1].min() for outline in outlines] == pytest.approx([surface] * 2, abs=1e-6)


# ----------------------------------------------------------------
# The picture of an orbit that violates a goal: every state by its side, and where it must not be.


ORBIT = [{"x": 15.0, "side": 2}, {"x": 18.0, "side": 2}, {"x": 23.5, "side": 2}, {"x": 20.25, "side": 0}]


def orbit_drawn(goal, orbit=ORBIT):
    return ls.plot.counterexample(ls.load("paper-designed"), orbit, goal).axes[0]


def marks(axes):
    return {
        (float(x), float(y)): line.get_marker()
        for line in axes.lines
        if line.get_linestyle() == "None" and line.get_markersize() < 10
        for x, y in line.get_xydata()
    }


def test_states_and_the_forbidden_place():
    axes = orbit_drawn(OrientedBeyond(20.0, 2))
    found = marks(axes)
    assert set(found) == {(0, 15.0), (1, 18.0), (2, 23.5), (3, 20.25)}
    assert len({found[(k, x)] for k, x in ((0, 15.0), (1, 18.0), (2, 23.5))}) == 1
    assert found[(3, 20.25)] != found[(0, 15.0)]  # not by colour alone
    (area,) = axes.patches
    assert area.get_gid() == "forbidden"
    assert area.get_y() == 20.0
    words = [text.get_text() for text in axes.figure.legends[0].get_texts()]
    assert words[-1] == "on side 0, 0.25 in beyond"


def test_what_is_to_be_reached_is_shown_even_far_off():
    axes = orbit_drawn(Reaches(30.0, 1))
    assert [patch.get_gid() for patch in axes.patches] == ["wanted"]
    assert axes.get_ylim()[1] > 30.0


def test_goals_without_a_place_shade_nothing():
    assert not orbit_drawn(FlipOrder((0, 1, 2))).patches
    assert not orbit_drawn(None).patches


def test_of_a_long_orbit_the_end_is_drawn():
    orbit = [{"x": 10.0 + 0.01 * k, "side": k % 3} for k in range(100)]
    found = marks(orbit_drawn(OrientedBeyond(20.0, 2), orbit))
    assert min(found)[0] == 60
    assert max(found)[0] == 99


def test_nothing_to_draw_is_refused():
    with pytest.raises(AnswerError, match="empty"):
        orbit_drawn(None, [])


def test_a_goal_that_fails_at_once_is_more_than_a_dot():
    """The next rests are those of the map: the picture shows whether the part comes back."""
    axes = orbit_drawn(OrientedBeyond(20.0, 2), [{"x": 21.0, "side": 0}])
    path = ls.orbit(ls.load("paper-designed").map, 21.0, 0, 12)
    onward = [line.get_xydata()[0] for line in axes.lines if line.get_gid() == "thrown on"]
    assert onward == [pytest.approx((k, x)) for k, x in enumerate(path.x[1:], start=1)]
    low, high = axes.get_ylim()
    assert low < path.x.min() < path.x.max() < high
    assert "at once" in axes.figure.get_suptitle()
    assert not [line for line in orbit_drawn(OrientedBeyond(20.0, 2)).lines if line.get_gid() == "thrown on"]


# ----------------------------------------------------------------
# The figure of a design, by its content.


VARY = ("part.mass.center.along", "part.mass.center.above", "throw.speed")


def test_bars_are_the_limit_sets_of_each_scene_on_the_way():
    found = ls.design("paper-initial", critical_points=[10, 10, 20], vary=VARY, stages=2)
    (axes,) = drawn(ls.plot.design(found)).axes
    drawn_bars = named(axes, "limit set")
    bars = sorted((-bar.get_y(), bar.get_x(), bar.get_x() + bar.get_width()) for bar in drawn_bars)
    wanted = []
    for scene in found.path:
        (extents,) = (limit.extents for limit in ls.analyse(scene).limit_sets)
        wanted += [pair for side in sorted(extents) for pair in extents[side]]
    assert [bar[1:] for bar in bars] == [pytest.approx(pair, abs=1e-9) for pair in wanted]
    marks = sorted((-min(line.get_ydata()), line.get_xdata()[0]) for line in named(axes, "critical point"))
    assert [x for _, x in marks] == pytest.approx([20, 20, 20, 15, 15, 20, 10, 10, 20], abs=1e-5)
    words = [text.get_text().splitlines()[0] for text in named(axes, "words")]
    assert words == ["start", "step 1", "design"]
    assert "kappa" in named(axes, "words")[0].get_text()
    assert len(named(axes, "goal")) == 1
    assert len({(bar.get_facecolor(), bar.get_hatch()) for bar in drawn_bars}) == 3


def test_a_long_way_is_drawn_in_twelve_scenes():
    found = ls.design("paper-initial", critical_points=[10, 10, 20], vary=VARY, stages=26)
    assert len(found.path) == 27
    figure = ls.plot.design(found, [({0: [(5.0, 10.0)]},)] * 27)
    (axes,) = figure.axes
    words = [text.get_text().splitlines()[0] for text in named(axes, "words")]
    assert len(words) == len(named(axes, "limit set")) == 12
    assert (words[0], words[-1]) == ("start", "design")
    numbers = [int(word.removeprefix("step ")) for word in words[1:-1]]
    assert numbers == sorted(set(numbers))
    assert "(12 of 27 scenes are drawn)" in figure.get_suptitle()
    assert figure.get_figheight() < 16
