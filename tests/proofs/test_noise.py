"""Noise of the speed, the tilt and the landing place at every throw: what is proved, refuted, replayed and refused.

The sharp margin of the landing place is found twice, apart from the package: from the decision of side 2 by the throw
at 50 digits, and by following the ends of the intervals that can be reached, with the plain throw of `forge.py`.  That
of the tilt follows from the one of the speed: either multiplies kappa.
"""

import math
from itertools import pairwise

import numpy as np
import pytest
from mpmath import mp, mpf

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.feeder.scene.units import parse
from limitsets.proofs.prover.attraction import attraction
from limitsets.proofs.prover.certificate import arrays_of
from limitsets.proofs.prover.cover import cover
from limitsets.proofs.prover.parameters import parameter_box
from limitsets.systems.maps import images
from tests.proofs import forge
from tests.thrower import reference

GOAL_AT, R2 = 20.0, 20.0  # beyond 20 in only side 2; side 2 begins to flip at 20 in

EVERYWHERE_INSIDE = ["goal", "invariant", "trapping", "expanding"]


def verdicts(proof):
    return {claim.claim: claim.verdict for claim in proof.claims}


def counterexample(proof, word="goal"):
    return next(record for record in proof.to_json() if record["claim"] == word)["counterexample"]


def number(text):
    return float(text.split()[0])


def tilted_scene(throw=None):
    """The designed scene with the tilt it was computed for; given by kappa, or by a speed."""
    tree = ls.load("paper-designed").as_dict()
    tree["gravity"] = {"tilt": "30 deg"}
    if throw is not None:
        tree["throw"] = throw
    return ls.load(tree)


def require_rechecked(proof, tmp_path):
    report = ls.recheck(proof.save(tmp_path / "x.proof.zip"))
    written = {claim.claim: claim.verdict for claim in proof.claims if claim.written}
    assert {claim: state for claim, state, _ in report.claims} == written
    assert report.verdict == max(written.values(), key=("proved", "proved-on-cells").index), report.reason


def require_thrown(proof, word="goal"):
    """Throw a counterexample again at 50 digits, each throw as it says, and return its states."""
    facts = reference.paper("designed")
    states = counterexample(proof, word)
    for before, after in pairwise(states):
        said = before["parameters"]
        kappa = float(parse(said["throw.kappa"], "length").number)
        thrown = reference.throw(
            reference.Facts({**facts.numbers, "kappa": kappa}), before["side"], before["x"]
        )
        shift = number(said["landing.x"]) if "landing.x" in said else 0.0
        width = 1e-11 + 4 * (before["between"][1] - before["between"][0])
        assert thrown.side == after["side"]
        assert after["between"][0] - width <= thrown.x + shift <= after["between"][1] + width
    return states


# ---------------------------------------------------------------- the landing place


def sharp_landing():
    """Largest e with no part beyond 20 in on side 0: from just below r_2 a jog, e too far, then a flip, e too far."""
    facts = reference.paper("designed")

    def margin(e):
        jogged = reference.throw(facts, 2, R2 - mpf("1e-7"))
        assert (jogged.code, jogged.side) == (0, 2)
        flipped = reference.throw(facts, 2, jogged.x + e)
        assert flipped.side == 0
        return flipped.x + e - GOAL_AT

    return float(mp.findroot(margin, (mpf("0.05"), mpf("0.2")), solver="anderson", tol=1e-12))


def reached_with(e, throws=400):
    """Highest place on sides 0 and 1 that can be reached, by the ends of intervals that are thrown; plain floats."""
    m = forge.Plain(forge.scene("designed"))
    critical = [10.0, 10.0, R2]
    ends = {2: [15.0, 15.0]}
    for _ in range(throws):
        found = {side: list(span) for side, span in ends.items()}

        def put(side, values, found=found):
            span = found.setdefault(side, [math.inf, -math.inf])
            span[0], span[1] = min(span[0], min(values) - e), max(span[1], max(values) + e)

        for side, (lo, hi) in ends.items():
            r = critical[side]
            if lo < r:
                put(side, m.jog(side, np.array([lo, min(hi, r)]), m.kappa))
            if hi > r:
                put((side + 1) % 3, m.flip(side, np.array([max(lo, r), hi]), m.kappa))
        ends = found
    return max(ends[0][1], ends[1][1])


def test_the_margin_of_the_landing_place_is_the_same_by_a_formula_and_by_reachability():
    sharp = sharp_landing()
    assert 0.1 < sharp < 0.13
    assert reached_with(0.0) == pytest.approx(19.75268801485, abs=1e-5)  # the table's end of side 0
    assert reached_with(sharp * 0.999) < GOAL_AT < reached_with(sharp * 1.001)


@pytest.mark.sweep
def test_the_landing_place_is_proved_below_its_margin_and_refuted_above(tmp_path):
    sharp = sharp_landing()
    proof = ls.certify("paper-designed", EVERYWHERE_INSIDE, noise={"landing.x": f"{0.97 * sharp:.6f} in"})
    # the goal for the starts in some cells: from the middle of the arm, too, such landings can lose a part at the joint
    assert verdicts(proof) == dict.fromkeys(EVERYWHERE_INSIDE, "proved") | {"goal": "proved-on-cells"}
    require_rechecked(proof, tmp_path)
    proof = ls.certify("paper-designed", ["goal"], noise={"landing.x": f"{1.02 * sharp:.6f} in"})
    assert verdicts(proof) == {"goal": "refuted"}
    states = require_thrown(proof)
    shifts = [number(state["parameters"]["landing.x"]) for state in states[:-1]]
    assert max(map(abs, shifts)) <= float(f"{1.02 * sharp:.6f}")
    assert len(set(shifts)) > 1  # chosen anew at every throw
    assert states[-1]["between"][0] > GOAL_AT
    assert states[-1]["side"] != 2


def test_near_the_joint_scattered_landings_leave_inward():
    """From R -> a_i the jog goes nowhere, so a landing a little short is at x <= a_i: not every start is attracted."""
    proof = ls.certify("paper-designed", ["attracts-all", "invariant"], noise={"landing.x": "0.01 in"})
    assert verdicts(proof) == {"attracts-all": "refuted", "invariant": "proved"}
    assert "may land at x <= a, and leave inward" in proof.claims[0].reason
    start, end = require_thrown(proof, "attracts-all")
    foot = float(reference.paper("designed").a[start["side"]])
    assert end["between"][1] <= foot < start["x"]


def test_landings_so_scattered_that_parts_can_be_walked_into_the_joint_leave_no_attracting_cells():
    """At x = 8 on side 2 a jog moves a part out by 0.262 in (table of first throws): 0.3 in undoes it."""
    proof = ls.certify("paper-designed", ["invariant"], noise={"landing.x": "0.3 in"})
    assert verdicts(proof) == {"invariant": "undecided"}


def test_a_landing_beyond_the_arm_counts_as_leaving():
    """Shorten the arm to just beyond the limit set's 23.3832: cells at its end may be thrown beyond it by 0.05 in."""
    tree = ls.load("paper-designed").as_dict()
    tree["arm"]["length"] = "23.42 in"
    assert verdicts(ls.certify(ls.load(tree), ["invariant"])) == {"invariant": "proved"}
    proof = ls.certify(ls.load(tree), ["invariant"], noise={"landing.x": "0.05 in"})
    assert verdicts(proof) == {"invariant": "undecided"}


def test_no_noise_of_the_landing_place_is_none():
    proof = ls.certify("paper-designed", noise={"landing.x": "0 in"})
    assert verdicts(proof) == {"attracts-all": "proved", "goal": "proved"}


def test_random_points_land_where_the_cells_say_with_all_noise_together():
    rng = np.random.default_rng(4)
    scene = tilted_scene()
    noise = {"throw.speed": "0.2 %", "gravity.tilt": "0.1 deg", "landing.x": "0.5 mm"}
    found = attraction(cover(parameter_box(scene, noise=noise), 300))
    arrays, offset = arrays_of(found, ""), found.cover.grid.offset
    leaves = found.cover.graph.ranges.exits != 0
    met = 0
    for _ in range(40):
        speed, tilt = rng.uniform(-0.002, 0.002), math.radians(30 + rng.uniform(-0.1, 0.1))
        thrown = scene.map._replace(kappa=scene.kappa * 2 * math.sin(tilt) / (1 + speed) ** 2)
        for side in range(3):
            edges = arrays[f"edges.{side}"]
            k = rng.integers(0, edges.size - 1, 500)
            got = images(thrown, edges[k] + rng.random(500) * (edges[k + 1] - edges[k]), side)
            x = got.x + rng.uniform(-1, 1, 500) * 0.05 / 2.54
            cell = offset[side] + k
            good = (got.code >= 0) & ~leaves[cell]
            for branch, name in enumerate(("jog", "flip")):
                mine = good & (got.code == branch)
                first, last = arrays[name][cell[mine]].T
                to, local = arrays[f"edges.{(side + branch) % 3}"], offset[(side + branch) % 3]
                assert (to[first - local] <= x[mine]).all()
                assert (x[mine] <= to[last - local + 1]).all()
                met += int(mine.sum())
    assert met > 20_000


# ---------------------------------------------------------------- the tilt

# The sharp margin of the speed is 0.397 %: kappa from 1/1.00397^2 to 1/0.99603^2 of its value.
SPEED = 0.00397


@pytest.mark.parametrize(("degrees", "verdict"), [("0.25", "proved"), ("0.275", "refuted")])
def test_the_margin_of_the_tilt_is_that_of_the_speed_in_another_word(tmp_path, degrees, verdict):
    dev = math.radians(float(degrees))
    factors = [math.sin(math.radians(30) + sign * dev) / 0.5 for sign in (-1, 1)]
    speeds = [1 / (1 + SPEED) ** 2, 1 / (1 - SPEED) ** 2]
    within = speeds[0] < factors[0] and factors[1] < speeds[1]
    beyond = factors[0] < speeds[0] and speeds[1] < factors[1]
    assert (verdict == "proved") == within
    assert (verdict == "refuted") == beyond
    proof = ls.certify(tilted_scene(), ["goal"], noise={"gravity.tilt": f"{degrees} deg"})
    assert verdicts(proof) == {"goal": verdict}
    if verdict == "proved":
        require_rechecked(proof, tmp_path)
        return
    states = require_thrown(proof)
    kappa = tilted_scene().kappa
    for state in states[:-1]:
        said = state["parameters"]
        tilt = number(said["gravity.tilt"])
        assert 30 - float(degrees) <= tilt <= 30 + float(degrees)
        assert number(said["throw.kappa"]) == pytest.approx(
            kappa * math.sin(math.radians(tilt)) / 0.5, rel=1e-12
        )
        assert "landing.x" not in said
    assert len({state["parameters"]["gravity.tilt"] for state in states[:-1]}) > 1


def spans(scene, noise):
    box = parameter_box(scene, noise=noise)
    return box.lo.kappa, box.hi.kappa


def test_noise_of_the_tilt_multiplies_kappa():
    by_kappa, by_speed = tilted_scene(), tilted_scene({"speed": "158.02 deg/s"})
    speed = math.radians(158.02)
    gravity = 9.80665 / 0.0254  # in/s^2
    for text, dev in (("0.5 deg", 0.5), ("0.01 rad", math.degrees(0.01)), ("2 %", 0.6)):
        low, high = (math.sin(math.radians(30 + sign * dev)) for sign in (-1, 1))
        for scene, unit in ((by_kappa, by_kappa.kappa / 0.5), (by_speed, gravity / speed**2)):
            lo, hi = spans(scene, {"gravity.tilt": text})
            assert lo == pytest.approx(unit * low, rel=1e-14)
            assert hi == pytest.approx(unit * high, rel=1e-14)
    lo, hi = spans(by_kappa, {"gravity.tilt": "0.5 deg", "throw.speed": "1 %"})
    assert lo == pytest.approx(by_kappa.kappa * math.sin(math.radians(29.5)) / 0.5 / 1.01**2, rel=1e-14)
    assert hi == pytest.approx(by_kappa.kappa * math.sin(math.radians(30.5)) / 0.5 / 0.99**2, rel=1e-14)


def test_noise_about_a_tilt_that_is_not_known_is_farthest_out_at_the_smallest():
    scene = tilted_scene()
    tree = scene.as_dict() | {"gravity": {"tilt": ["20 deg", "40 deg"]}}
    for text, dev in (("0.5 deg", lambda t: 0.5), ("2 %", lambda t: 0.02 * t)):
        box = parameter_box(scene, tree=tree, noise={"gravity.tilt": text})
        ratios = [
            math.sin(math.radians(t + sign * dev(t))) / math.sin(math.radians(t))
            for t in np.linspace(20, 40, 2001)
            for sign in (-1, 1)
        ]
        assert box.lo.kappa == pytest.approx(scene.kappa * min(ratios), rel=1e-13)
        assert box.hi.kappa == pytest.approx(scene.kappa * max(ratios), rel=1e-13)


# ---------------------------------------------------------------- together


def test_all_noise_together(tmp_path):
    noise = {"throw.speed": "0.1 %", "gravity.tilt": "0.05 deg", "landing.x": "0.5 mm"}
    proof = ls.certify(tilted_scene(), EVERYWHERE_INSIDE, noise=noise)
    assert verdicts(proof) == dict.fromkeys(EVERYWHERE_INSIDE, "proved")
    require_rechecked(proof, tmp_path)
    noise = {"throw.speed": "0.25 %", "landing.x": "0.08 in"}  # each alone is proved, see above
    proof = ls.certify("paper-designed", ["goal"], noise=noise)
    assert verdicts(proof) == {"goal": "refuted"}
    states = require_thrown(proof)
    assert len({state["parameters"]["throw.kappa"] for state in states[:-1]}) > 1
    assert len({state["parameters"]["landing.x"] for state in states[:-1]}) > 1


@pytest.mark.parametrize(
    ("scene", "noise", "words"),
    [
        ("paper-designed", {"gravity.tilt": "1 deg"}, "give the scene"),
        ("tilt", {"gravity.tilt": "30 deg"}, "from 0 to 90 degrees"),
        ("tilt", {"gravity.tilt": "60 deg"}, "from 0 to 90 degrees"),
        ("tilt", {"gravity.tilt": "1 in"}, "dimension is wrong"),
        ("steep", {"gravity.tilt": "2 %"}, "from 0 to 90 degrees"),
        ("tilt", {"landing.x": "1 %"}, "% is a unit of share"),
        ("tilt", {"landing.x": "1 deg"}, "dimension is wrong"),
        ("tilt", {"landing.x": "-1 in"}, "landing.x"),
        ("tilt", {"arm.length": "1 %"}, "throw.speed, gravity.tilt, landing.x"),
        ("tilt", {"throw.kappa": "1 %"}, "throw.speed, gravity.tilt, landing.x"),
    ],
    ids=str,
)
def test_noise_that_cannot_be(scene, noise, words):
    if scene == "tilt":
        scene = tilted_scene()
    elif scene == "steep":
        scene = ls.load(tilted_scene().as_dict() | {"gravity": {"tilt": "89 deg"}})
    with pytest.raises(LimitsetsError, match=words):
        ls.certify(scene, noise=noise)


def test_an_acceleration_has_no_tilt():
    tree = ls.load("paper-designed").as_dict() | {"gravity": {"acceleration": "193.045 in/s^2"}}
    with pytest.raises(LimitsetsError, match=r"noise of gravity\.tilt"):
        ls.certify(ls.load(tree), noise={"gravity.tilt": "1 deg"})


def test_end_points_with_scattered_landings_are_undecided():
    proof = ls.certify("paper-designed", ["end-points"], noise={"landing.x": "0.01 in"})
    assert verdicts(proof) == {"end-points": "undecided"}
    assert "landing.x" in proof.claims[0].reason
