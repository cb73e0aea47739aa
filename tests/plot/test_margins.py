"""Figures of margins, by their content; margins against X, by plain orbits."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.feeder.goals import OrientedBeyond
from limitsets.parameters.margins.joint import joint_margin
from limitsets.parameters.margins.single import margins_beyond


def named(axes, gid):
    return [artist for artist in axes.get_children() if artist.get_gid() == gid]


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
    figure = ls.plot.margin_curve(curve)
    FigureCanvasAgg(figure).draw()
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
    figure = ls.plot.tornado(margins)
    FigureCanvasAgg(figure).draw()
    (axes,) = figure.axes
    labels = [label.get_text() for label in axes.get_yticklabels()]
    assert labels[0] == "throw.speed"
    assert labels[1].startswith("landing.x, every throw")
    bars = sorted(named(axes, "proved"), key=lambda bar: bar.get_y())
    ends = [bar.get_x() + bar.get_width() for bar in bars]
    height, speed, landing = margins
    assert ends == pytest.approx(
        [speed.proved, 100 * landing.proved / 3.6, 100 * height.proved / 0.2]  # of the shortest side; of |h|
    )
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
    figure = ls.plot.tolerance_box(found)
    FigureCanvasAgg(figure).draw()
    (axes,) = figure.axes
    assert [bar.get_width() for bar in named(axes, "proved")] == pytest.approx([2 * found.proved] * 2)
    (larger,) = named(axes, "refuted")
    assert (larger.get_x(), larger.get_width()) == pytest.approx((-found.refuted, 2 * found.refuted))
    assert larger.get_height() == 2
    assert axes.get_xlim()[1] > found.refuted
    (single,) = ls.margin("paper-designed", "arm.surface_height", width=0.5)
    with pytest.raises(LimitsetsError, match="joint"):
        ls.plot.tolerance_box(single)
