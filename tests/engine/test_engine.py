"""The engine's throws against the model's formulas, figures known from elsewhere, and textbook mechanics.

Expected values: docs/model.md's equations written out here, critical points the scenes were designed for, and figures
found by high-precision computations that share no code with this package.
"""

import math
import sys
from itertools import pairwise

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError, MapError
from limitsets.feeder.engine import compare, throw
from limitsets.feeder.engine.stage import IDLE, set_up, settle

pytest.importorskip("pymunk")

DESIGNED, INITIAL = ls.load("paper-designed"), ls.load("paper-initial")


def height_of_left_vertex(scene, x, side, phi):
    """f of docs/model.md."""
    a, d = scene.sides.a[side], scene.sides.d[side]
    return x * phi - a * math.sin(phi) + d * (1 - math.cos(phi)) - scene.kappa / 2 * phi**2


@pytest.mark.parametrize("scene", [DESIGNED, INITIAL], ids=["designed", "initial"])
@pytest.mark.parametrize("side", [0, 1, 2])
@pytest.mark.parametrize("beyond", [1e-3, 0.1, 3.0, 12.0])
def test_the_left_vertex_lands_where_the_equation_says(scene, side, beyond):
    x = scene.sides.a[side] + beyond
    landing = throw(scene, x, side, step=0.01)
    assert landing.struck == -side % 3
    assert height_of_left_vertex(scene, x, side, landing.phi) == pytest.approx(0.0, abs=2e-13)
    middles = np.linspace(0.0, landing.phi, 50)[1:-1]
    assert min(height_of_left_vertex(scene, x, side, phi) for phi in middles) > 0.0


def test_first_throws_of_the_designed_scene():
    known = [8.0, 8.262013, 8.557124, 8.891802]  # to 40 digits, rounded
    for before, after in pairwise(known):
        landing = throw(DESIGNED, before, 2)
        assert (landing.side, landing.status) == (2, "rest")
        assert landing.x == pytest.approx(after, abs=3e-5)
    assert throw(DESIGNED, 8.0, 2, step=0.01).phi == pytest.approx(0.311437, abs=5e-7)


@pytest.mark.parametrize(
    ("scene", "side", "r"),
    [(DESIGNED, 0, 10), (DESIGNED, 1, 10), (DESIGNED, 2, 20)] + [(INITIAL, side, 20) for side in range(3)],
)
def test_the_part_flips_from_the_critical_point_on(scene, side, r):
    assert throw(scene, r - 1e-4, side, step=2e-3).side == side
    assert throw(scene, r + 1e-4, side, step=2e-3).side == (side + 1) % 3


@pytest.mark.parametrize(
    ("scene", "side", "x"), [(DESIGNED, 0, 20.1517), (DESIGNED, 1, 26.4235), (INITIAL, 0, 26.9141)]
)
def test_another_vertex_lands_first_from_there_on(scene, side, x):
    assert throw(scene, x - 1e-4, side, step=0.01).struck == -side % 3
    assert throw(scene, x + 1e-4, side, step=0.01).struck == (-side - 1) % 3


def test_the_hinge_is_of_second_order():
    x = np.linspace(5.5, 9.5, 7)
    sizes = []
    for step in (8e-3, 4e-3, 2e-3):
        found = compare(DESIGNED, x, 2, step=step)
        assert found.agree.all()
        sizes.append(np.abs(found.error))
    assert (sizes[-1] < 2e-4).all()
    for coarse, fine in pairwise(sizes):
        assert np.median(coarse / fine) == pytest.approx(4.0, abs=0.5)


def test_unilateral_contact_rests_elsewhere_than_the_hinge():
    assert throw(DESIGNED, 15.0, 2).x == pytest.approx(16.754, abs=6e-4)
    for friction in (1.0, 2.0, 5.0):
        landing = throw(DESIGNED, 15.0, 2, contact="unilateral", friction=friction)
        assert (landing.side, landing.status) == (2, "rest")
        assert 16.9 < landing.x < 17.0


def test_without_friction_nothing_changes_the_way_along_the_arm():
    landing = throw(DESIGNED, 15.0, 2, contact="unilateral", friction=0.0, patience=3.0)
    assert (landing.side, landing.status) == (-1, "unfinished")
    d = DESIGNED.sides.d[2]
    assert landing.x == pytest.approx(15.0 - (DESIGNED.surface_height + d) * landing.time, abs=1e-9)


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.6])
def test_a_vertical_bounce_ends_after_its_zeno_time(restitution):
    """2 v e / (g (1 - e)), the sum of a geometric series."""
    stage = set_up(DESIGNED, 10.0, 2)
    speed, step = 6.0, 2e-4
    stage.body.velocity, stage.body.angular_velocity = (0.0, -speed), 0.0
    time, side, _ = settle(stage, DESIGNED, 1.0, restitution, step, 60.0)
    ends = 2 * speed * restitution / (DESIGNED.kappa * (1 - restitution))
    assert side == 2
    assert time - IDLE == pytest.approx(ends, abs=0.01)


def test_friction_and_restitution_of_the_scene_are_taken_up():
    words = DESIGNED.as_dict()
    words["world"] = {"friction": 0.5, "restitution": 0.2}
    own = throw(ls.load(words), 15.0, 2, contact="unilateral", step=4e-3)
    assert own == throw(DESIGNED, 15.0, 2, contact="unilateral", friction=0.5, restitution=0.2, step=4e-3)
    assert own != throw(DESIGNED, 15.0, 2, contact="unilateral", friction=0.5, step=4e-3)


def test_a_part_left_of_its_vertex_does_not_fly():
    landing = throw(DESIGNED, 4.0, 2)  # a_2 = 4.2256
    assert (landing.status, landing.x, landing.side, landing.struck) == ("no flight", 4.0, 2, -1)
    assert math.isnan(landing.phi)


def test_a_table_of_throws():
    random = np.random.default_rng(5)
    side = random.integers(3, size=60)
    x = random.uniform(INITIAL.sides.a[side], INITIAL.arm_length)
    found = compare(INITIAL, x, side, step=4e-3)
    left = ~found.other_vertex
    assert left.sum() > 50
    assert found.agree[left].all()
    assert np.abs(found.error[left]).max() < 2e-3
    assert set(found.side_engine.tolist()) == {0, 1, 2}


def test_a_missing_engine_is_named_with_its_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymunk", None)
    with pytest.raises(AnswerError, match=r"pip install 'limitsets\[engine\]'"):
        throw(DESIGNED, 15.0, 2)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"contact": "glue"}, "'hinge' or 'unilateral'"),
        ({"friction": 0.5}, "a hinge has none"),
        ({"contact": "unilateral", "friction": 0.5, "rolls": True}, "rolls anyway"),
        ({"stroke": 1.6}, "0 to pi/2"),
        ({"threshold": -1.0}, "from 0"),
        ({"contact": "unilateral"}, "the friction is None"),
        ({"contact": "unilateral", "friction": -1.0}, "a number from 0"),
        ({"contact": "unilateral", "friction": math.inf}, "a number from 0"),
        ({"contact": "unilateral", "friction": 1.0, "restitution": 1.5}, "0 to 1"),
        ({"step": 0.0}, "above 0"),
    ],
)
def test_wrong_calls_are_refused(words, said):
    with pytest.raises(AnswerError, match=said):
        throw(DESIGNED, 15.0, 2, **words)


def test_a_side_the_part_has_not():
    with pytest.raises(MapError, match="from 0 to 2"):
        throw(DESIGNED, 15.0, 3)


def test_sides_that_do_not_fit_the_starts():
    with pytest.raises(AnswerError, match="a side per start"):
        compare(DESIGNED, [8.0, 9.0], [0, 1, 2])
