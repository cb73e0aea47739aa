"""The figures of a tray: a depression for each state, the curve, the shares."""

import numpy as np
import pytest
from matplotlib.patches import Polygon

import limitsets as ls
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
