"""The audit's figure, by its content; figures of scenes with rolls."""

from functools import lru_cache

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import limitsets as ls
from limitsets.face.report.writing import FIGURES, figure


@lru_cache(maxsize=2)
def audited(name):
    return ls.audit(name)


@lru_cache(maxsize=1)
def rolling():
    tree = ls.load("paper-initial").as_dict() | {"effects": {"landing": True, "roll": True}}
    return ls.analyse(ls.load(tree))


def named(axes, gid):
    return [artist for artist in axes.get_children() if artist.get_gid() == gid]


@pytest.mark.parametrize("name", ["paper-initial", "paper-designed"])
def test_strips_are_the_ranges(name):
    found = audited(name)
    rows = found.on("domain")
    drawn = ls.plot.audit(found)
    FigureCanvasAgg(drawn).draw()
    for side, axes in enumerate(drawn.axes):
        broken = sorted(
            (round(bar.get_y() + bar.get_height() / 2), bar.get_x(), bar.get_x() + bar.get_width())
            for bar in named(axes, "broken")
        )
        wanted = sorted(
            (row, lo, hi) for row, each in enumerate(rows) for lo, hi in each.ranges.get(side, ())
        )
        assert broken == [pytest.approx(each) for each in wanted]
        assert len(named(axes, "cannot tell")) == sum(bool(each.missing) for each in rows)
        assert len(named(axes, "holds")) == sum(not each.missing for each in rows)
        sets = sorted((bar.get_x(), bar.get_x() + bar.get_width()) for bar in named(axes, "limit set"))
        assert sets == [pytest.approx(each) for each in found.extents[side]]
        assert found.scene.unit in axes.get_xlabel()
    labels = [label.get_text() for label in drawn.axes[0].get_yticklabels()]
    assert labels == [each.about.name for each in rows]


def test_every_figure_of_a_scene_that_rolls_can_be_drawn():
    for kind in FIGURES:
        FigureCanvasAgg(figure(rolling(), kind)).draw()


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
    drawn = ls.plot.flight(rolling().scene, 18.0, 1)
    titles = [axes.get_title(loc="left") for axes in drawn.axes]
    assert "a roll" in titles[1]
    assert "onto side 0" in titles[1]
    # it turns about one vertex and rolls on over others: at any time its lowest vertex is on the arm
    outlines = [patch.get_xy() for patch in named(drawn.axes[1], "turning")]
    assert len(outlines) == 2
    surface = rolling().scene.surface_height
    assert [outline[:, 1].min() for outline in outlines] == pytest.approx([surface] * 2, abs=1e-6)
