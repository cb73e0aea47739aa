"""Claims about a part with a side on which it cannot rest: of starts on the other sides, and true of sampled orbits."""

from __future__ import annotations

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.systems.maps.drivers import advance
from tests.scene.test_chamfer import BOTH, CHAMFER, chamfered


def test_a_box_in_which_it_may_rest_is_refused() -> None:
    """The foot stands 0.197 cm beyond the right end: the tip of the chamfer may be moved by less than that only."""
    scene = ls.load(chamfered(effects=BOTH))
    assert parameter_box(scene).rests.tolist() == scene.sides.rests.tolist()
    tree = scene.as_dict()
    tree["part"]["vertices"][2][1] = ["3.0 cm", "3.8 cm"]
    with pytest.raises(AnswerError, match=r"side 3.*tips over the same end"):
        parameter_box(scene, tree=tree)


@pytest.mark.sweep
def test_claims_are_of_the_sides_on_which_it_rests_and_hold_of_orbits() -> None:
    scene = ls.load(chamfered(effects=BOTH, goal={"oriented_beyond": {"x": "8 cm", "side": 2}}))
    proof = ls.certify(scene, ["attracts-all", "invariant", "goal"])
    assert [claim.verdict for claim in proof.claims] == ["proved"] * 3
    assert proof.claims[2].starts == "every"
    assert proof.claims[2].shares["share"] == 1.0
    bound, extents = proof.max_throws(), proof.outer_extents()
    assert list(bound["beyond"]) == ["0", "1", "2", "4"]
    assert CHAMFER not in extents
    # jogs next to the joint move a part out by 1 + 2 |h|/kappa at least, as without the chamfer
    assert bound["near_joint"] == pytest.approx(1.03, rel=1e-6)
    rng = np.random.default_rng(1)
    for side in extents:
        x = rng.uniform(bound["beyond"][str(side)], scene.arm_length, 200)
        x, to, code, _ = advance(scene.map, x, np.full(x.size, side), bound["throws"])
        assert (code >= 0).all()
        assert all(any(lo <= at <= hi for lo, hi in extents[k]) for at, k in zip(x, to.tolist(), strict=True))


@pytest.mark.sweep
def test_shares_count_no_starts_on_the_chamfer() -> None:
    """A thin triangle part of whose starts leave the arm: the shares add up to the two sides on which it rests."""
    tree = chamfered(effects=BOTH, goal={"oriented_beyond": {"x": "18.5 cm", "side": 0}})
    tree["part"]["vertices"] = [["0 cm", "0 cm"], ["4 cm", "0 cm"], ["5.5 cm", "1.2 cm"]]
    scene = ls.load(tree)
    assert scene.sides.rests.tolist() == [True, True, False]
    (goal,) = ls.certify(scene, ["goal"]).claims
    assert goal.verdict == "proved-on-cells"
    sampled = ls.analyse(scene).basins
    assert goal.shares["share"] <= sampled.attractors[0] + sampled.undecided_between + 1e-9
    assert goal.shares["share"] == pytest.approx(sampled.attractors[0], abs=0.01)
    assert goal.shares["leaves"] == pytest.approx(sampled.exits["outward"], abs=0.01)
