"""One step of the checker's noisy chain against midpoints, at any place."""

import sys

import numpy as np
import pytest

import limitsets as ls
from limitsets.feeder.scattering import Scattering, Uniform, thrown
from limitsets.systems.maps import advance
from tests.one_throw import mean_after
from tests.proofs.test_probabilities import certificate, mesh
from tests.proofs.test_recheck import checker

pytest.importorskip("flint", reason="the checker needs python-flint")


X = 20.0
# places that end within cells of side 1, three next to each other: no more is known of these cells than where their
# throws may land
WALLS = [(15.03, 15.08), (15.22, 15.26), (15.4, 15.45)]
EVEN = [np.linspace(1, 28, 150)] * 3


def of_checker(name):
    return sys.modules[f"{checker.__name__}.{name}"]


def chain_of(speed, landing, strata, tmp_path):
    """The checker's chain of paper-initial on cells of 0.18 in, and its nodes by side."""
    laws = {"landing.x": f"{landing} in"} | ({"throw.speed": f"{speed:%}"} if speed else {})
    forged = certificate(
        "initial",
        laws,
        [[2, "15 in", "16 in"]],
        {"right": [[2, f"{X} in", None]], "wall": [[1, *(f"{end} in" for end in wall)] for wall in WALLS]},
        mesh("initial", EVEN, {2: [X]}),
        {"right": np.array([[0.0, 1.0]])},
        strata=strata,
    )
    path = forged.write(tmp_path / "x.proof.zip")
    brackets = of_checker("brackets")
    claim = brackets.read_chances(*checker.report.open_certificate(path))
    chain, _ = brackets.chain_on(claim.setting, claim.edges, lambda more: None)
    return chain, [slice(*chain.mesh.first[k : k + 2]) for k in range(3)]


# speed, landing, strata, midpoints of each law
WIDER = [(0.01, 0.2, 8, 100), (0.05, 0.1, 8, 100), (0.3, 0.1, 8, 100)]
LAWS = [(0.0, 0.05, 1, 1000), *(pytest.param(*law, marks=pytest.mark.sweep) for law in WIDER)]


@pytest.mark.usefixtures("precision")
@pytest.mark.parametrize(("speed", "landing", "strata", "count"), LAWS)
def test_one_throw_is_bounded_at_every_place(speed, landing, strata, count, tmp_path):
    scene = ls.load("paper-initial")
    scatter = Scattering(speed=Uniform(speed) if speed else None, landing=Uniform(landing))
    chain, rows = chain_of(speed, landing, strata, tmp_path)
    place = chain.mesh.place
    assert not np.isfinite(chain.hard.steep).all()
    random = np.random.default_rng(5)
    side = random.integers(0, 3, 3000)
    x = random.uniform(scene.sides.a[side] + 1e-3, np.where(side == 2, X, 24.0))
    x[:60] = scene.sides.a[side[:60]] + 10.0 ** random.uniform(-9.0, -3.0, 60)  # cells at the joint
    x[60:160], side[60:160] = random.uniform(14.9, 15.6, 100), 1
    # throws are made from there
    some = ~((side == 1) & np.any([(a <= x) & (x <= b) for a, b in WALLS], axis=0))
    for share in np.linspace(-1.0, 1.0, 41):  # a mean of throws that end on the arm
        some &= advance(thrown(scene.map)(1.0 / (1.0 + share * speed) ** 2), x, side, 1)[2] >= 0
    x, side = x[some], side[some]
    for waves in (
        np.sin(3.0 * place),
        np.cos(1.0 * place),
        1.0 * (place > 17.3),
        (place - 15.0) ** 2 / 200.0,
    ):
        values = np.where(np.abs(place) < 100.0, waves, 0.0)
        found = mean_after(scene, scatter, [(place[row], values[row]) for row in rows], x, side, count)
        none = np.full(len(place), -np.inf)
        above, below = chain.above(values, none), -chain.above(-values, none)
        high, low = (
            np.select([side == k for k in range(3)], [np.interp(x, place[row], bound[row]) for row in rows])
            for bound in (above, below)
        )
        # midpoints of a function that jumps by 2 at most, where the branch changes or at 17.3: by half a weight each
        slack = 2.0 / count
        assert (found <= high + slack).all()
        assert (found >= low - slack).all()
