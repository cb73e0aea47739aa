"""The figure of a design, by its content."""

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import limitsets as ls

VARY = ("part.mass.center.along", "part.mass.center.above", "throw.speed")


def named(axes, gid):
    return [artist for artist in axes.get_children() if artist.get_gid() == gid]


def test_bars_are_the_limit_sets_of_each_scene_on_the_way():
    found = ls.design("paper-initial", critical_points=[10, 10, 20], vary=VARY, stages=2)
    drawn = ls.plot.design(found)
    FigureCanvasAgg(drawn).draw()
    (axes,) = drawn.axes
    bars = sorted(
        (-bar.get_y(), bar.get_x(), bar.get_x() + bar.get_width()) for bar in named(axes, "limit set")
    )
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
    assert len({(bar.get_facecolor(), bar.get_hatch()) for bar in named(axes, "limit set")}) == 3


def test_a_long_way_is_drawn_in_twelve_scenes():
    found = ls.design("paper-initial", critical_points=[10, 10, 20], vary=VARY, stages=26)
    assert len(found.path) == 27
    drawn = ls.plot.design(found, [({0: [(5.0, 10.0)]},)] * 27)
    (axes,) = drawn.axes
    words = [text.get_text().splitlines()[0] for text in named(axes, "words")]
    assert len(words) == len(named(axes, "limit set")) == 12
    assert (words[0], words[-1]) == ("start", "design")
    numbers = [int(word.removeprefix("step ")) for word in words[1:-1]]
    assert numbers == sorted(set(numbers))
    assert "(12 of 27 scenes are drawn)" in drawn.get_suptitle()
    assert drawn.get_figheight() < 16
