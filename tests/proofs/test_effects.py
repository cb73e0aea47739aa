"""Proofs of scenes with effects and with chamfers."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from mpmath import mp
from typer.testing import CliRunner

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.proofs.prover.attraction import attraction
from limitsets.proofs.prover.cover import cover
from limitsets.proofs.prover.numbers import RationalInterval, angle
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.systems.maps import images
from limitsets.systems.maps.drivers import advance
from tests.scene.test_load import BOTH as BOTH_CHAMFER, CHAMFER, chamfered

# ----------------------------------------------------------------
# Proofs about throws with effects: what the tables say of them, what is refuted, and what has no certificate.
# The limit set of paper-initial with roll reaches x = 23.48 on side 0, from where its left vertex may land as well
# as the next one's; on that of paper-designed no effect is ever called for (docs/model.md).  Exterior angles and
# outlines are those of plane geometry at 50 digits; counterexamples are thrown again by the point map.


BOTH = {"landing": True, "roll": True}
SCATTER = {"speed": "0.3 %", "landing": "0.02 in"}


def scene(name, effects, **tables):
    return ls.load(ls.load(name).as_dict() | {"effects": effects} | tables)


def verdicts(proof):
    return {claim.claim: claim.verdict for claim in proof.claims}


def claim_of(proof, word):
    return next(claim for claim in proof.claims if claim.claim == word)


@pytest.fixture(scope="module")
def initial():
    """On an arm that ends before side 0 flies far enough for its next vertex to land."""
    tree = ls.load("paper-initial").as_dict()
    tree["arm"]["length"] = "26.5 in"
    return ls.certify(ls.load(tree | {"effects": BOTH}), ["attracts-all", "goal", "invariant", "end-points"])


@pytest.mark.sweep
def test_on_the_limit_set_of_the_designed_part_no_effect_is_called_for():
    """Everything that is proved of the minimal model is proved of the part that may land and roll as it likes."""
    words = ["attracts-all", "goal", "invariant", "trapping", "expanding"]
    proof = ls.certify(scene("paper-designed", BOTH), words)
    assert set(verdicts(proof).values()) == {"proved"}
    extents = proof.attractions[0].cells.extents()
    plain = ls.certify("paper-designed", words).attractions[0].cells.extents()
    assert extents.keys() == plain.keys()
    for side, ((lo, hi),) in plain.items():
        assert extents[side][0] == pytest.approx((lo, hi), abs=0.05)
    branches = [key for found in proof.attractions[0].cover.images for key in found.hulls]
    assert {branch for _, branch in branches} <= {0, 1, 2}


def test_rolling_back_carries_the_initial_part_beyond_20_on_side_0(initial):
    assert verdicts(initial)["goal"] == "refuted"
    last = claim_of(initial, "goal").counterexample[-1]
    assert last.side != 2
    assert last.lo > 20.0
    ends = [hi for _, hi in initial.attractions[0].cells.extents()[0]]
    assert max(ends) == pytest.approx(23.48, abs=0.05)
    path = ls.orbit(initial.scene.map, 17.0, 2, 200_000)
    assert float(path.x[1000:][path.side[1000:] == 0].max()) <= max(ends)


def test_every_start_of_the_initial_part_is_attracted_on_a_shorter_arm(initial):
    """And the cells hold long orbits from everywhere."""
    assert verdicts(initial)["attracts-all"] == "proved"
    found = initial.attractions[0]
    random = np.random.default_rng(2)
    for side in range(3):
        for x in random.uniform(found.cover.grid.edges[side][0][0], 26.5, 5):
            path = ls.orbit(initial.scene.map, float(x), side, found.max_rank + 300)
            for s in range(3):
                late = path.x[found.max_rank :][path.side[found.max_rank :] == s]
                cells = found.cover.grid.index(late, s)
                assert (found.component[cells] >= 0).all()


def test_on_the_whole_arm_starts_of_the_initial_part_leave_it():
    """Beyond x = 26.914 on side 0 the next vertex lands, and from there the part rolls off the arm's end."""
    proof = ls.certify(scene("paper-initial", BOTH), ["attracts-all"])
    (claim,) = proof.claims
    assert claim.verdict == "refuted"
    states = claim.counterexample
    for before, after in pairwise(states):
        got = images(proof.scene.map, [before.lo], before.side)
        assert got.x[0] == pytest.approx(after.lo, abs=1e-9)
        assert got.side[0] == after.side
    assert states[-1].lo > 28.0


def test_what_cannot_be_proved_says_so(initial, tmp_path):
    assert verdicts(initial)["end-points"] == "undecided"
    assert "effects" in claim_of(initial, "end-points").reason
    with pytest.raises(AnswerError, match="landing, roll"):
        initial.save(tmp_path / "x.proof.zip")
    for effects, word in (({"drive": True}, "drive"), ({"spread": "gaussian"}, "no bound")):
        case = scene("paper-designed", effects, world={"stroke": "5 deg", "scatter": SCATTER})
        with pytest.raises(AnswerError, match=word):
            ls.certify(case)


@pytest.mark.sweep
def test_a_bounded_spread_is_noise_and_is_rechecked(tmp_path):
    case = scene("paper-designed", {"spread": "bounded"}, world={"scatter": SCATTER})
    proof = ls.certify(case, ["goal", "invariant"])
    assert proof.noise == {"throw.speed": "0.3 %", "landing.x": "0.02 in"}
    as_noise = ls.certify("paper-designed", ["goal", "invariant"], noise=proof.noise)
    assert verdicts(proof) == verdicts(as_noise) == {"goal": "proved", "invariant": "proved"}
    assert proof.attractions[0].cells.extents() == as_noise.attractions[0].cells.extents()
    report = ls.recheck(proof.save(tmp_path / "x.proof.zip", recheck=False))
    assert (report.verdict, report.reason) == ("proved", "")
    assert {claim for claim, state, _ in report.claims if state == "proved"} == {"goal", "invariant"}
    assert ls.certify(case, ["invariant"], noise={"throw.speed": "0.3 %"}).noise == proof.noise
    with pytest.raises(AnswerError, match=r"throw\.speed"):
        ls.certify(case, noise={"throw.speed": "0.2 %"})


def test_outline_and_angles_are_those_of_plane_geometry():
    box = parameter_box(scene("paper-designed", BOTH))
    lo, hi = box.lo, box.hi
    mp.dps = 50
    sides = [mp.mpf(text) for text in ("5.75", "3.6", "6.75")]
    for k in range(3):
        # the exterior angle at the left vertex, between this side and the next, by the law of cosines
        a, b, c = sides[k], sides[(k + 1) % 3], sides[(k + 2) % 3]
        angle = mp.pi - mp.acos((a * a + b * b - c * c) / (2 * a * b))
        assert lo.bare.corner[k] < angle < hi.bare.corner[k]
        assert hi.bare.corner[k] - lo.bare.corner[k] < 1e-14
    along, above = mp.mpf("4.2255778"), mp.mpf("0.7082490")
    # lying on side 2, its ends at height 0; the third vertex by its distances, left end of side 1
    right = sides[2] - along
    top = (sides[2] ** 2 + sides[1] ** 2 - sides[0] ** 2) / (2 * sides[2])
    height = mp.sqrt(sides[1] ** 2 - top**2)
    places = {2: (-along, -above), 1: (right, -above)}
    third = (sides[2] - top - along, height - above)
    places[0] = third
    for k, (x, y) in places.items():
        assert lo.outline.p[2, k] < x < hi.outline.p[2, k]
        assert lo.outline.q[2, k] < y < hi.outline.q[2, k]
        assert hi.outline.p[2, k] - lo.outline.p[2, k] < 1e-14


def test_near_the_joint_what_rolls_has_to_come_to_the_cells(initial):
    """A taller part, whose side 1 is so short on the right that every jog from near the joint rolls back over it."""
    assert not any(near.rolls for near in initial.attractions[0].joint)
    changes = {"part.mass.center.along": "3.9 in", "part.mass.center.above": "2.4 in"}
    tall = scene("paper-initial", BOTH).with_values(changes)
    near = attraction(cover(parameter_box(tall), 512)).joint
    assert [each.rolls for each in near] == [False, True, False]
    assert all(each.proved for each in near)
    for share in (1e-9, 1e-3, 0.5, 1.0):
        a = tall.sides.a[1]
        got = images(tall.map, [a + share * (near[1].x - a)], 1)
        assert (got.code[0], got.side[0]) == (2, 0)
        assert got.x[0] <= near[1].reach < got.x[0] + 1e-4


def test_the_angle_of_a_box_of_vectors_holds_that_of_every_vector():
    random = np.random.default_rng(4)
    mp.dps = 50
    for _ in range(40):
        x, y = Fraction(float(random.normal())), Fraction(float(abs(random.normal())) + 1e-9)
        width = Fraction(float(random.choice([0.0, 1e-3]))) * y
        found = angle(RationalInterval(y, y + width), RationalInterval(x, x + width))
        for u in (x, x + width):
            for v in (y, y + width):
                exact = mp.atan2(mp.mpf(v.numerator) / v.denominator, mp.mpf(u.numerator) / u.denominator)
                lo, hi = (mp.mpf(end.numerator) / end.denominator for end in (found.lo, found.hi))
                assert lo <= exact <= hi
        assert float(found.hi - found.lo) < (2e-3 if width else 1e-13)


def test_the_command_tells_the_proof_and_writes_no_certificate(tmp_path):
    from limitsets.face.cli.app import app

    file, out = tmp_path / "rolls.toml", tmp_path / "rolls.proof.zip"
    ls.scene.dump(scene("paper-designed", BOTH), file)
    told = CliRunner().invoke(app, ["certify", str(file), "--out", str(out)])
    assert told.exit_code == 0
    assert "with the effects landing, roll" in told.stdout
    assert "no certificate is written" in told.stdout
    assert not out.exists()


# ----------------------------------------------------------------
# Claims about a part with a side on which it cannot rest: of starts on the other sides, and true of sampled orbits.


def test_a_box_in_which_it_may_rest_is_refused() -> None:
    """The foot stands 0.197 cm beyond the right end: the tip of the chamfer may be moved by less than that only."""
    scene = ls.load(chamfered(effects=BOTH_CHAMFER))
    assert parameter_box(scene).rests.tolist() == scene.sides.rests.tolist()
    tree = scene.as_dict()
    tree["part"]["vertices"][2][1] = ["3.0 cm", "3.8 cm"]
    with pytest.raises(AnswerError, match=r"side 3.*tips over the same end"):
        parameter_box(scene, tree=tree)


@pytest.mark.sweep
def test_claims_are_of_the_sides_on_which_it_rests_and_hold_of_orbits() -> None:
    scene = ls.load(chamfered(effects=BOTH_CHAMFER, goal={"oriented_beyond": {"x": "8 cm", "side": 2}}))
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
    tree = chamfered(effects=BOTH_CHAMFER, goal={"oriented_beyond": {"x": "18.5 cm", "side": 0}})
    tree["part"]["vertices"] = [["0 cm", "0 cm"], ["4 cm", "0 cm"], ["5.5 cm", "1.2 cm"]]
    scene = ls.load(tree)
    assert scene.sides.rests.tolist() == [True, True, False]
    (goal,) = ls.certify(scene, ["goal"]).claims
    assert goal.verdict == "proved-on-cells"
    sampled = ls.analyse(scene).basins
    assert goal.shares["share"] <= sampled.attractors[0] + sampled.undecided_between + 1e-9
    assert goal.shares["share"] == pytest.approx(sampled.attractors[0], abs=0.01)
    assert goal.shares["leaves"] == pytest.approx(sampled.exits["outward"], abs=0.01)
