"""Figures of noise, fits, policies and trays."""

import matplotlib.colors
import numpy as np
import pytest
from matplotlib.patches import Polygon, Rectangle

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.feeder.scattering import Gaussian, Scattering, starts_from
from limitsets.parameters.noise.sampling import throw_many
from limitsets.parameters.noise.statistics import Levels, noise_statistics
from tests.fitting.machines import film, machine
from tests.plot.artists import drawn
from tests.policies.test_feedback import with_throws
from tests.proofs.forge import scene
from tests.trays.scenes import with_tray

# ----------------------------------------------------------------
# Figures of noise, by their content.


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
    figure = drawn(ls.plot.noise_density(found, thrown))
    assert len(figure.axes) == 3
    for side, axes in enumerate(figure.axes):
        share = found.numbers[f"time on side {side}"]
        assert f"{100 * share:.2f} %" in axes.get_title(loc="left")
        densities = [
            patch for patch in axes.patches if patch.get_facecolor()[3] == 0.0 or not patch.get_fill()
        ]
        values, edges, _ = densities[0].get_data()
        assert float(values @ np.diff(edges)) == pytest.approx(share, rel=1e-9)
    words = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert words == ["2e4 throws", "transfer operator", "X = 20.5 in"]


def test_arrivals_mark_mean_and_quantile(found, thrown):
    figure = drawn(ls.plot.noise_arrivals(found, thrown))
    left, right = figure.axes
    lines = sorted(line.get_xdata()[0] for line in left.lines if len(set(line.get_xdata())) == 1)
    assert lines == pytest.approx([found.feeding.mean, found.feeding.quantile(0.95)])
    assert right.get_yscale() == "log"


def test_levels_leave_out_what_is_nothing():
    numbers = dict.fromkeys(("first beyond is wrong", "escape", "lost"), np.zeros(2))
    numbers |= {"wrong beyond": np.array([0.0, 1e-3]), "mean throws": np.array([20.0, 21.0])}
    numbers["95 % throws"] = np.array([60.0, 61.0])
    figure = drawn(ls.plot.noise_levels(Levels(np.array([0.0, 2.0]), numbers), {"noise [%]": 0.5}))
    assert [len(axes.lines) for axes in figure.axes] == [1, 2, 0]
    assert figure.axes[0].lines[0].get_xdata().tolist() == [1.0]
    assert figure.axes[2].texts[0].get_text() == "none"
    # what is nothing at one level and something at another is marked on the axis
    assert [[at[0] for at in marks.get_offsets()] for marks in figure.axes[0].collections] == [[0.0]]


# ----------------------------------------------------------------
# The figure of a fit: a panel for each side, a mark for each throw.


def test_every_throw_is_drawn_once():
    draw = np.random.default_rng(41)
    found = ls.fit(ls.load(scene("designed")), film(draw, machine(draw), flipped=0.1))
    figure = ls.plot.fit_residuals(found)
    panels = figure.axes
    assert len(panels) == 3
    marks = [line for axes in panels for line in axes.lines]
    assert sum(line.get_xdata().size for line in marks if line.get_marker() in ("o", "^")) == 50
    misread = {row for row, *_ in found.misread}
    assert sum(line.get_xdata().size for line in marks if line.get_marker() == "s") == len(misread)
    flips = sum(line.get_xdata().size for line in marks if line.get_marker() == "^")
    assert flips == int(found.rows.branch.sum())


# ----------------------------------------------------------------
# The figure of a policy shows every belief, and names throws and answers.


@pytest.fixture(scope="module")
def found_policies():
    return ls.feedback(with_throws(sensor={"beyond": "20 in"}), cells=256, starts={2: (16.5, 17.5)})


def bars(axes):
    return [each for each in axes.patches if isinstance(each, Rectangle) and 0.5 < each.get_height() < 0.6]


def test_each_belief_is_a_row(found_policies):
    figure = ls.plot.policy(found_policies)
    for side, axes in enumerate(figure.axes):
        drawn = sorted((round(b.get_y() + 0.28), b.get_x(), b.get_x() + b.get_width()) for b in bars(axes))
        beliefs = enumerate(found_policies.beliefs())
        wanted = sorted((k, lo, hi) for k, belief in beliefs for lo, hi in belief.get(side, []))
        assert np.allclose(np.array(drawn).reshape(-1, 3), np.array(wanted).reshape(-1, 3))
    labels = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    table = found_policies.found.policy.to_json()["states"]
    assert len(labels) == len(table)
    for label, state in zip(labels, table, strict=True):
        assert f"{state['state']}: {state['throw'] or 'stop'}" in label
        assert all(f"{word} {at}" in label for word, at in state["after"].items() if at is not None)
    stops = {k for k, state in enumerate(table) if state["throw"] is None}
    faces = {round(b.get_y() + 0.28): b.get_facecolor() for axes in figure.axes for b in bars(axes)}
    for k, face in faces.items():
        assert (matplotlib.colors.to_hex(face) == "#ffffff") == (k in stops)
    words = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    throws = ["throw: own", "throw: fast", "stop: the part is there"]
    assert words == [*throws, "goal: side 2 from here on", "sensor"]


def test_many_states_are_drawn_without_names_and_no_policy_is_refused(found_policies):
    many = ls.feedback(found_policies.scene, cells=512)
    assert many.found.policy.states > 60
    figure = ls.plot.policy(many)
    assert figure.get_size_inches()[1] < 18.0
    assert len(bars(figure.axes[2])) == sum(len(belief.get(2, [])) for belief in many.beliefs())
    never = ls.feedback(found_policies.scene, "none", cells=64, throws=1)
    with pytest.raises(AnswerError, match="what to draw is 'not-solved'"):
        ls.plot.policy(never)


# ----------------------------------------------------------------
# The figures of a tray: a depression for each state, the curve, the shares.


pytest.importorskip("pymunk")


def test_states_curve_and_shares_are_drawn():
    found = ls.tray(with_tray(), passes=10, drops=120, kicks=30, histories=3, step=8e-3)
    parts, curve, shares, memory = ls.plot.tray(found).axes
    outlines = [patch.get_xy() for patch in parts.patches if isinstance(patch, Polygon)]
    assert len(outlines) == len(found.counts.met)
    for outline in outlines:  # nothing is stretched: the sides have their lengths
        sides = np.linalg.norm(np.diff(outline, axis=0), axis=1)
        assert sorted(sides) == pytest.approx([3.6, 5.75, 6.75], abs=1e-9)
    (line,) = (each for each in curve.lines if each.get_label().startswith("chain"))
    assert line.get_ydata() == pytest.approx(found.filled.right)
    (marks,) = (shares for shares in curve.containers if shares.get_label().endswith("a new part each pass"))
    # nine, even along the logarithmic axis from 1 to 10; two pairs fall on one pass
    assert marks.lines[0].get_xdata().tolist() == sorted({round(10 ** (k / 8)) for k in range(9)})
    widths = [bar.get_width() for bar in shares.patches]
    assert widths[len(widths) // 2 :] == pytest.approx(found.filled.last.tolist())
    assert len(memory.get_yticks()) == 6


def test_without_histories_what_a_kick_leaves_is_drawn():
    found = ls.tray(with_tray(), passes=3, drops=60, kicks=20, step=8e-3)
    grid = ls.plot.tray(found).axes[3].images[0].get_array()
    assert grid.shape == (len(found.counts.met), len(found.counts.met) + 1)
    assert np.asarray(grid).sum(axis=1) == pytest.approx(1.0)


def test_many_parts_stand_beside_the_chain():
    found = ls.tray(with_tray(), passes=3, drops=60, kicks=20, step=8e-3, parts=4, depressions=2, batches=2)
    curve = ls.plot.tray(found).axes[1]
    (chain,) = (each for each in curve.lines if each.get_label() == "chain, 2 parts a pass and depression")
    assert chain.get_ydata() == pytest.approx(found.crowd_chain.right)
    drawn = {each.get_label(): each.lines[0].get_ydata() for each in curve.containers}
    pushing, passing = found.crowds
    assert drawn["4 at once that push each other"] == pytest.approx(pushing.share(pushing.right)[0][1:])
    also = pushing.share(pushing.right + pushing.covered)[0][1:]
    assert drawn["the same, also under others"] == pytest.approx(also)
    right = passing.share(passing.right)[0][1:]
    assert drawn["4 at once that pass through each other"] == pytest.approx(right)
