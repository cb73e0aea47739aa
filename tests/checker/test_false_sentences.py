"""Forged certificates of policies and probabilities whose sentences are false, though their numbers fit together.

The true probabilities are those of uniform laws, worked out by hand from the formulas of the model.
"""

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

from limitsets.checker.report import Report, on_cells_in_words
from tests.proofs import forge
from tests.proofs.test_probabilities import certificate, mesh, section_of
from tests.proofs.test_recheck import verdict

STEPS = [np.linspace(2, 40, 20), np.linspace(2, 40, 20), np.linspace(14.5, 18.5, 60)]
FOOT = 4.4179581  # a of side 2


def chances(starts, x, within, laws=None):
    """Parts of the small-angle scene that end at x or beyond on side 2."""
    laws, right = laws or {"landing.x": "0.05 in"}, {"right": [[2, f"{x} in", None]]}
    return certificate("small", laws, starts, right, mesh("small", STEPS, {2: [x]}), within)


def test_a_scatter_beyond_all_nodes_is_refused(tmp_path):
    """An arm of 40 in hardly ever catches a part that is scattered over 20 000 in both ways: nearly all exit."""
    rows = np.array([[0.0, 1e-6], [0.0, 0.6], [0.0, 0.6]])
    forged = chances([[2, "15 in", "16 in"]], 18.0, {"exits": rows}, {"landing.x": "20000 in"})
    report = verdict(forged, tmp_path)
    assert (report.verdict, report.reason) == ("bad file", "landings are too far out")


def test_a_side_that_lies_far_from_the_next_is_refused(tmp_path):
    """Where a flip moves the place by more than 100 in, a jog beyond 200 in may come down on the arm as a flip."""
    forged = chances([[2, "15 in", "16 in"]], 18.0, {"any": np.array([[0.0, 1.0]])})
    part = section_of(forged)["scene"]["part"]
    part["sides"] = ["575 in", "360 in", "675 in"]
    part["mass"]["center"] |= {"along": "441.8 in", "above": "50.4 in"}
    section_of(forged)["scene"]["throw"]["kappa"] = "4862 in"
    report = verdict(forged.seal(), tmp_path)
    assert report.verdict == "bad file"


def test_starts_that_overlap_are_refused(tmp_path):
    """A third of 15 to 18 in lies beyond 17 in; counted twice it would be a half."""
    half = {"right": np.array([[0.49, 0.51]])}
    report = verdict(chances([[2, "15 in", "18 in"], [2, "17 in", "18 in"]], 17.0, half), tmp_path)
    assert report.verdict == "bad file"
    assert "starts overlap" in report.reason
    assert verdict(chances([[2, "15 in", "18 in"]], 17.0, half), tmp_path).verdict == "failed"
    twice = {"right": np.array([[0.33, 0.34]])}
    touching = chances([[2, "15 in", "17 in"], [2, "17 in", "18 in"]], 17.0, twice)
    assert verdict(touching, tmp_path).verdict == "proved"


@pytest.mark.parametrize(
    ("starts", "laid", "said"),
    [
        ("cells", False, "starts in the cells only, 12.5 % of the arm or more"),
        ({"from": {"0": 1.0}}, False, "starts from some x on only, 12.5 % of the arm or more"),
        (
            "cells",
            True,
            "starts in the cells only, 12.5 % of the ranges in which parts are laid down or more",
        ),
    ],
)
def test_a_goal_that_is_not_proved_for_all_starts_says_for_which(starts, laid, said):
    assert said in on_cells_in_words(Report(starts=starts, share=0.125), laid=laid)


# strata, and what is said that is false; cells under a single stratum have no bounds, and one that is a third as wide
# is bounded at its nodes only by how far its places bend
WIDE = [(1, [0.53, 0.58]), (3, [0.002, 0.012])]


@pytest.mark.parametrize(("strata", "said"), WIDE)
def test_wide_strata_prove_nothing_narrow(strata, said, tmp_path):
    """Places that bend with the speed by far more than their scatter, taken as even between two speeds.

    T = x + 2 H (x - a) (1 + delta)^2 / kappa, H = 50 in, kappa = 200 in, delta within 0.3: the share beyond 20.5 in
    is 0.48; if T were even between its ends it would be 0.55, between thirds of the speeds larger by 0.006.
    """
    x = np.linspace(15.0, 15.1, 2001)
    least = np.sqrt((20.5 - x) / (2 * 50.0 * (x - FOOT) / 200.0)) - 1.0
    true = float(np.mean((0.3 - least) / 0.6))
    assert 0.47 < true < 0.49
    false = np.array(said) + (true if strata > 1 else 0.0)
    for pair, expected in ((false, "failed"), ([0.0, 1.0], "proved")):
        rows = np.array([[0.0, 1e-6], pair])
        laws = {"landing.x": "0.05 in", "throw.speed": "30 %"}
        forged = chances([[2, "15 in", "15.1 in"]], 20.5, {"right": rows}, laws)
        section_of(forged)["strata"] = strata
        section_of(forged)["scene"]["throw"]["kappa"] = "200 in"
        section_of(forged)["scene"]["arm"]["surface_height"] = "-50 in"
        nodes = forged.arrays["edges.2"]
        nodes = np.concatenate([nodes[(nodes < 14.9) | (nodes > 15.2)], np.linspace(14.9, 15.2, 601)])
        forged.arrays["edges.2"] = np.unique(nodes)
        report = verdict(forged.seal(), tmp_path)
        assert report.verdict == expected


def test_where_all_places_absorb_no_throw_is_made(tmp_path):
    everywhere = {"all": [[side, "4.5 in", None] for side in range(3)]}
    forged = chances([[2, "15 in", "16 in"]], 18.0, {"all": np.array([[0.999, 1.0]] * 3)})
    section_of(forged)["absorbing"] = everywhere
    for side in range(3):
        forged.arrays[f"edges.{side}"] = np.array([1.0, 4.5, 4.501, 39.999, 40.0])
    assert verdict(forged.seal(), tmp_path).verdict == "proved"


def one_throw(goal, begins, name="own"):
    """One throw from 4.5 in on side 2 of paper-initial, whose landing is scattered by 1 in: a = 3.99 in."""
    scene = forge.scene("initial")
    scene["feedback"] = {"throws": [{"name": name, "kappa": scene["throw"]["kappa"]}]}
    m = forge.Plain(scene)
    phi = np.ones((5, 2))
    phi[3] = m.phi(2, np.array([4.4, 4.6]), m.kappa) * [1 - 1e-9, 1 + 1e-9]
    jog, flip = np.full((5, 2), -1, np.int32), np.full((5, 2), -1, np.int32)
    jog[3] = 2, 4
    section = {
        "scene": scene,
        "mode": "stop",
        "goal": {"x": goal, "side": 2},
        "starts": [[2, (4.5).hex(), (4.5).hex()]],
        "within": 1,
        "first": {"any": 0},
    }
    header = forge.alone(scene, "policy", section, noise={"landing.x": "1 in"})
    arrays = {
        **{f"edges.{side}": np.array([5.0, 28.0]) for side in (0, 1)},
        "edges.2": np.array([begins, 4.4, 4.6, 28.0]),
        "0.jog": jog,
        "0.flip": flip,
        "0.phi": phi,
        "throw": np.array([0, -1], np.int32),
        "left": np.array([1, 0], np.int32),
        "after": np.array([1, -1], np.int32),
        "belief": np.array([[0, 3, 3], [1, 2, 4]], np.int32),
    }
    return forge.Forged(header, arrays).seal()


def test_a_part_left_of_a_is_not_where_a_policy_wants_it(tmp_path):
    """The part may land at 3.41 in and so leave the arm: it does not come to lie at x >= -1 in."""
    report = verdict(one_throw("-1 in", begins=-1.0), tmp_path)
    assert report.verdict == "failed"
    assert "left of a" in report.reason
    assert "the image of a jog" in verdict(one_throw("4 in", begins=4.0), tmp_path).reason


def test_the_name_of_a_throw_does_not_read_like_another_throw(tmp_path):
    report = verdict(one_throw("4 in", 4.0, name="slow: kappa = 90 in; own"), tmp_path)
    assert "throws to choose from: slow? kappa ? 90 in? own: kappa = 33.3605945 in" in report.statement
