"""Boxes where kappa < ell: several roots, a first root that jumps, impacts that graze, none within a full turn."""

import subprocess
import sys

import numpy as np
import pytest

import limitsets as ls
from limitsets.feeder.thrower.traced import impact_angles
from limitsets.systems.graph.images.enclosed import enclosures
from limitsets.systems.maps import OUTSIDE_MODEL, images


@pytest.mark.parametrize("kappa", [4.0, 2.0, 1.0, 0.3])
@pytest.mark.parametrize("side", [0, 1, 2])
def test_enclosures_hold_whatever_the_number_of_roots(kappa, side):
    """The point map finds the smallest root by a march of its own (`tests/thrower` holds it against 50 digits)."""
    scene = ls.load("paper-designed").with_values({"throw.kappa": kappa})
    a = scene.map.a[side]
    edges = np.linspace(a * (1.0 + 1e-6), min(28.0, 3.0 * kappa + a), 1501)
    found = enclosures(scene.map, scene.map, edges, side)
    rng = np.random.default_rng(5)
    for _ in range(5):
        x = rng.uniform(edges[:-1], edges[1:])
        got = images(scene.map, x, side)
        flown = (got.code > OUTSIDE_MODEL) & ~found.lost
        inside = np.zeros(x.size, dtype=bool)
        for (to, _), (lo, hi) in found.hulls.items():
            # the point map rounds, by some 1e-15 of the lengths involved
            slack = 1e-13 * (np.abs(x) + np.abs(got.x))
            inside |= (got.side == to) & (got.x >= lo - slack) & (got.x <= hi + slack)
        assert not (flown & ~inside).any()
        beyond = (
            got.code == OUTSIDE_MODEL
        )  # but for the cell in which a full turn is reached, nothing is proved there
        assert not beyond.any() or found.lost[beyond].mean() > 0.9


def test_a_cell_on_which_the_impact_grazes_has_a_wide_bracket_and_is_still_enclosed():
    """kappa = 2, side 2: the first root jumps from one hump of the height to the next as x grows."""
    scene = ls.load("paper-designed").with_values({"throw.kappa": 2.0})
    edges = np.linspace(scene.map.a[2] * (1.0 + 1e-6), 8.0, 3001)
    found = enclosures(scene.map, scene.map, edges, 2)
    width = found.witness[1] - found.witness[0]
    wide = np.flatnonzero((width > 0.2) & ~found.lost)
    middle = 0.5 * (edges[1:] + edges[:-1])
    phi = impact_angles(scene.map, middle, 2)
    good = ~found.lost & np.isfinite(phi)
    assert ((found.witness[0] <= phi) & (phi <= found.witness[1]))[good].all()
    jumps = np.flatnonzero(np.diff(phi) > 0.2)
    assert jumps.size >= 1
    assert wide.size >= 1
    assert all(np.abs(wide - k).min() <= 1 for k in jumps if not found.lost[k])


# A start at the upper end of what is known of a: no reach is proved, and the march once never came back from there.
AT_A = """
import numpy as np
import limitsets as ls
from limitsets.systems.graph.images.enclosed import enclosures

scene = ls.load("paper-designed").with_values({"throw.kappa": 2.0})
wide = scene.map._replace(a=scene.map.a + 0.001)
for low, upper in ((scene.map, scene.map), (scene.map, wide)):
    found = enclosures(low, upper, upper.a[0] + np.array([0.0, 1e-9, 1.0]), 0)
    print(found.lost[0])
"""


def test_a_cell_that_begins_at_the_upper_end_of_a_is_answered():
    done = subprocess.run(
        [sys.executable, "-c", AT_A], capture_output=True, text=True, check=False, timeout=300
    )
    assert done.stdout.split() == ["True", "True"], done.stderr
