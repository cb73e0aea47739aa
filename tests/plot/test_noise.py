"""Figures of noise, by their content."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import limitsets as ls
from limitsets.feeder.scattering import Gaussian, Scattering, starts_from
from limitsets.parameters.noise.sampling import throw_many
from limitsets.parameters.noise.statistics import Levels, noise_statistics

NOISE = Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02))
GOAL = (20.5, 2)


@pytest.fixture(scope="module")
def found():
    return noise_statistics("paper-designed", NOISE, goal=GOAL, cells=128, strata=8, sensitivity=False)


@pytest.fixture(scope="module")
def thrown():
    scene = ls.load("paper-designed")
    return throw_many(scene, NOISE, GOAL, starts_from(scene), throws=20_000, parts=500, bins=50)


def test_density_has_the_shares_in_its_titles(found, thrown):
    figure = ls.plot.noise_density(found, thrown)
    FigureCanvasAgg(figure).draw()
    assert len(figure.axes) == 3
    for side, axes in enumerate(figure.axes):
        share = found.numbers[f"time on side {side}"]
        assert f"{100 * share:.2f} %" in axes.get_title(loc="left")
        drawn = [patch for patch in axes.patches if patch.get_facecolor()[3] == 0.0 or not patch.get_fill()]
        values, edges, _ = drawn[0].get_data()
        assert float(values @ np.diff(edges)) == pytest.approx(share, rel=1e-9)
    words = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert words == ["2e4 throws", "transfer operator", "X = 20.5 in"]


def test_arrivals_mark_mean_and_quantile(found, thrown):
    figure = ls.plot.noise_arrivals(found, thrown)
    FigureCanvasAgg(figure).draw()
    left, right = figure.axes
    lines = sorted(line.get_xdata()[0] for line in left.lines if len(set(line.get_xdata())) == 1)
    assert lines == pytest.approx([found.feeding.mean, found.feeding.quantile(0.95)])
    assert right.get_yscale() == "log"


def test_levels_leave_out_what_is_nothing():
    numbers = {
        "wrong beyond": np.array([0.0, 1e-3]),
        "first beyond is wrong": np.zeros(2),
        "mean throws": np.array([20.0, 21.0]),
        "95 % throws": np.array([60.0, 61.0]),
        "escape": np.zeros(2),
        "lost": np.zeros(2),
    }
    figure = ls.plot.noise_levels(Levels(np.array([0.0, 2.0]), numbers), {"noise [%]": 0.5})
    FigureCanvasAgg(figure).draw()
    assert [len(axes.lines) for axes in figure.axes] == [1, 2, 0]
    assert figure.axes[0].lines[0].get_xdata().tolist() == [1.0]
    assert figure.axes[2].texts[0].get_text() == "none"
    # what is nothing at one level and something at another is marked on the axis
    assert [[at[0] for at in marks.get_offsets()] for marks in figure.axes[0].collections] == [[0.0]]
