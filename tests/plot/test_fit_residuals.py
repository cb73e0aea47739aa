"""The figure of a fit: a panel for each side, a mark for each throw."""

import numpy as np

import limitsets as ls
from tests.fitting.machines import film, machine
from tests.proofs.forge import scene


def test_every_throw_is_drawn_once():
    draw = np.random.default_rng(41)
    found = ls.fit(ls.load(scene("designed")), film(draw, machine(draw), flipped=0.1))
    figure = ls.plot.fit_residuals(found)
    panels = figure.axes
    assert len(panels) == 3
    marks = [line for axes in panels for line in axes.lines]
    assert sum(line.get_xdata().size for line in marks if line.get_marker() in ("o", "^")) == 50
    assert sum(line.get_xdata().size for line in marks if line.get_marker() == "s") == len(
        {row for row, *_ in found.misread}
    )
    flips = sum(line.get_xdata().size for line in marks if line.get_marker() == "^")
    assert flips == int(found.rows.branch.sum())
