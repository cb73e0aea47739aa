"""Bifurcation diagrams, by their content."""

import math

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import limitsets as ls
from limitsets.base.errors import AnswerError
from tests.maps_of_tests import TwoState


@pytest.fixture(scope="module")
def thrown():
    return ls.continuation("paper-initial", {"throw.speed": ("136 deg/s", "137 deg/s")}, steps=2)


def drawn(axes, gid):
    return [each for each in [*axes.lines, *axes.collections] if each.get_gid() == gid]


def test_every_side_shows_its_bands_its_critical_points_and_the_event(thrown):
    figure = ls.plot.bifurcation(thrown)
    FigureCanvasAgg(figure).draw()
    assert [axes.get_ylabel() for axes in figure.axes] == [f"x on side {side} [in]" for side in range(3)]
    assert figure.axes[-1].get_xlabel() == "throw.speed [deg/s]"
    assert figure.axes[0].get_xlim() == pytest.approx((136.0, 137.0))
    for side, axes in enumerate(figure.axes):
        (areas,) = drawn(axes, "bands")
        first, last = areas.get_paths()[0].vertices, areas.get_paths()[-1].vertices
        lo, hi = thrown.attractors[0][0].extents[side][0]
        assert first[0] == pytest.approx((136.0, lo))
        assert first[3] == pytest.approx((136.0, hi))
        assert last[:, 0].max() == pytest.approx(137.0)
        (line,) = drawn(axes, "critical point")
        assert line.get_xdata()[[0, -1]] == pytest.approx([136.0, 137.0])
        assert line.get_ydata()[0] == pytest.approx(thrown.critical[0][side][0])
    (event,) = thrown.events
    (mark,) = drawn(figure.axes[1], "border collision")
    assert mark.get_xdata()[0] == pytest.approx(math.degrees(event.values[0]["throw.speed"]))
    assert mark.get_ydata()[0] == pytest.approx(event.collision.x)
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["attractor 0", "critical point", "event: border collision"]


def test_against_t_or_another_quantity(thrown):
    figure = ls.plot.bifurcation(thrown, "t")
    assert figure.axes[-1].get_xlabel() == "t"
    assert figure.axes[0].get_xlim() == (0.0, 1.0)
    with pytest.raises(AnswerError, match=r"arm\.length"):
        ls.plot.bifurcation(thrown, "arm.length")
    plane = ls.continuation(
        TwoState(1.0), {"r": (0.8, 0.9)}, steps=1, cells=16, domain=[(-2.0, 2.0), (-2.0, 2.0)]
    )
    with pytest.raises(AnswerError, match="one-dimensional"):
        ls.plot.bifurcation(plane)
