"""The figures of a tray: a depression for each state, the curve, the shares."""

import numpy as np
import pytest
from matplotlib.patches import Polygon

import limitsets as ls
from limitsets.trays import tray_design
from tests.trays.scenes import with_tray

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
    assert drawn["4 at once that pass through each other"] == pytest.approx(
        passing.share(passing.right)[0][1:]
    )


def test_a_design_is_three_grids_and_its_best_is_marked():
    found = tray_design(with_tray(), [0.8, 1.53, 2.0], [0.4, 1.6], passes=10, drops=30, kicks=20, step=8e-3)
    panels = ls.plot.tray_design(found).axes
    assert [each.images[0].get_array().shape for each in panels] == [(3, 2)] * 3
    (mark,) = panels[0].lines
    row, column = np.unravel_index(found.right.argmax(), found.right.shape)
    assert (mark.get_xdata()[0], mark.get_ydata()[0]) == (column, row)


@pytest.mark.sweep
def test_a_design_marks_where_no_kick_moved_some_wrong_state():
    found = tray_design(with_tray(), [0.8, 2.0], [0.2, 3.0], passes=10, drops=40, kicks=30, step=8e-3)
    # a state that no kick changes is one from which all 30 kicks lead back to it
    for row, column in np.ndindex(found.held.shape):
        tree = with_tray(
            depression_depth=f"{found.depths[row]} in", agitation=f"{found.agitations[column]} in"
        )
        counts = ls.tray(tree, passes=1, drops=40, kicks=30, step=8e-3).counts
        stands = [counts.kicked[k, k] == counts.kicked[k].sum() for k in counts.met if k != counts.right]
        assert found.held[row, column] == any(stands)
    assert found.held.any()
    assert not found.held.all()
    figure = ls.plot.tray_design(found)
    for panel in figure.axes[1:]:
        marked = {(round(x - 0.5), round(y + 0.5)) for each in panel.patches for x, y in each.get_xy()[:1]}
        assert marked == {(column, row) for row, column in np.argwhere(found.held).tolist()}
    assert "no counted kick" in figure.legends[0].get_texts()[0].get_text()
