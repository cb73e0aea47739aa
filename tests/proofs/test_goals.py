"""Proofs of goals, for all starts and where parts are laid down."""

import json
from fractions import Fraction

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.feeder.goals import OrientedBeyond, Reaches, StaysOnArm
from limitsets.feeder.scene.laid import laid_goal, read_laid
from limitsets.proofs.prover.goals import reaches, sentence
from limitsets.proofs.prover.query import Query
from limitsets.systems.maps import advance
from tests.proofs import forge
from tests.proofs.test_certify import thrown_again
from tests.test_paper import LIMIT_SETS
from tests.thrower import reference

# ----------------------------------------------------------------
# Goals of every kind: proved where they hold, refuted by orbits where they do not, and rechecked.
# Truths come from the tables of `test_paper.py`, from the plain throw of `forge.py`, sampled, from orbits of the map
# (which `tests/thrower` holds against 50 digits), and from 50-digit throws.


# A part thrown so fast that jogs have an attracting fixed point on side 1, and one with two such, on sides 1 and 2.
ONE_FIXED = ("5.107240 in", "0.797946 in", "1.322505 in", "-0.894829 in", "40.470052 in", "10.211373 in")
TWO_FIXED = ("3.339860 in", "1.925104 in", "0.474104 in", "-1.891994 in", "32.154965 in", "3.756025 in")

PERIOD_13_UP_TO = 20.103  # the designed scene's orbit of period 13 never exceeds it, as is known apart


def scene_with(goal, name="paper-designed", **more):
    tree = ls.load(name).as_dict() | {"goal": goal}
    return ls.load(tree | {table: tree.get(table, {}) | values for table, values in more.items()})


def massed(along, above, rho="1.25 in"):
    return {"mass": {"center": {"side": 2, "along": along, "above": above}, "radius_of_gyration": rho}}


def part_of(numbers, goal):
    along, above, rho, height, arm, kappa = numbers
    arm = {"surface_height": height, "length": arm}
    return scene_with(goal, part=massed(along, above, rho), arm=arm, throw={"kappa": kappa})


def asked(scene, tmp_path=None, **more):
    """Certify the goal alone; save it, and so have it confirmed, if it is proved, or proved on cells."""
    proof = ls.certify(scene, ["goal"], **more)
    (claim,) = proof.claims
    if claim.written and tmp_path is not None:
        proof.save(tmp_path / "x.proof.zip")
    else:
        assert claim.verdict == "proved" or claim.reason
    return proof, claim


def require_orbit(proof, facts):
    """Throw the orbit again at 50 digits; return its states."""
    states = proof.to_json()[0]["counterexample"]
    assert len([*thrown_again(states, facts, 1e-9)]) == len(states) - 1 > 0
    return states


def facts_of(scene):
    """Facts of a scene for the 50-digit throw: the numbers of its map, which test_geometry compares with others."""
    m = scene.map
    names = ("a", "d", "length", "kappa", "surface_height", "arm_length", "radius_of_gyration")
    known = reference.paper("designed").numbers
    return reference.Facts({**known, **{name: getattr(m, name) for name in names if name in known}})


def arrive(scene, x, side, throws, at, landing=None):
    """Which starts come to rest at `at` or beyond on side 2 within some throws, the landings scattered."""
    arrived = np.zeros(len(x), dtype=bool)
    for _ in range(throws):
        x, side, code, _ = advance(scene.map, x, side, 1)
        assert (code >= 0).all()
        x = x if landing is None else x + landing.uniform(-0.05, 0.05, x.size)
        arrived |= (side == 2) & (x >= at)
    return arrived


def starts_in(name, rng, count):
    """Random places in the limit set, and their sides."""
    parts = [(lo, hi, side) for side, spans in LIMIT_SETS[name].items() for lo, hi in spans]
    return np.concatenate([rng.uniform(lo, hi, count) for lo, hi, _ in parts]), np.repeat(
        [side for *_, side in parts], count
    )


DESIGNED = "paper-designed"


# ---------------------------------------------------------------- oriented_beyond


def test_oriented_beyond_from_anywhere_is_sharp_at_the_farthest_landing_on_another_side(tmp_path):
    m = forge.Plain(forge.scene("designed"))
    x = np.concatenate([np.linspace(a + 1e-6, m.arm, 20_001) for a in m.a])
    to, after, _ = forge.throw(m, np.repeat([0, 1, 2], 20_001), x)
    farthest = float(after[to != 2].max())
    assert 24 < farthest < 28
    goal = {"oriented_beyond": {"x": f"{farthest + 0.05:.6f} in", "side": 2}, "from_anywhere": True}
    _, claim = asked(scene_with(goal), tmp_path)
    assert claim.verdict == "proved"
    assert "After a throw from anywhere on the arm" in sentence(claim.section)
    goal["oriented_beyond"]["x"] = f"{farthest - 0.05:.6f} in"
    proof, claim = asked(scene_with(goal))
    assert claim.verdict == "refuted"
    _, end = require_orbit(proof, reference.paper("designed"))
    assert end["between"][0] > farthest - 0.05
    assert end["side"] != 2


# ---------------------------------------------------------------- attracts_all, stays_on_arm


@pytest.mark.parametrize("goal", [{"attracts_all": True}, {"stays_on_arm": True, "from_anywhere": True}])
def test_everything_stays_on_the_arm_and_comes_to_one_component(tmp_path, goal):
    """No start of the paper's scenes escapes; with h = -3 in every one does (docs/model.md)."""
    for name in ("paper-designed", "paper-initial-small-angle"):
        assert asked(scene_with(goal, name), tmp_path)[1].verdict == "proved"
    leaving = scene_with(goal, arm={"surface_height": "-3 in"})
    proof, claim = asked(leaving)
    assert claim.verdict == "refuted"
    states = require_orbit(proof, reference.paper("designed", surface_height=-3.0))
    assert states[-1]["between"][0] > 28.0
    assert all(state["between"][1] <= 28.0 for state in states[:-1])


def test_of_the_attracting_cells_no_throw_leads_off_the_arm(tmp_path):
    _, claim = asked(scene_with({"stays_on_arm": True}), tmp_path, noise={"landing.x": "0.05 in"})
    assert claim.verdict == "proved"
    # near the joint scattered landings leave inward
    anywhere = {"stays_on_arm": True, "from_anywhere": True}
    proof, claim = asked(scene_with(anywhere), noise={"landing.x": "0.05 in"})
    assert claim.verdict == "refuted"
    end = proof.to_json()[0]["counterexample"][-1]
    assert end["between"][1] <= float(reference.paper("designed").a[end["side"]])


def test_two_attracting_components_are_never_one():
    """Starts at two attracting fixed points of the jogs of sides 1 and 2 stay where they are."""
    scene = part_of(TWO_FIXED, {"attracts_all": True})
    assert all(ls.orbit(scene.map, x, side, 1000).side[-1] == side for side, x in ((1, 9.18), (2, 8.9)))
    _, claim = asked(scene)
    assert claim.verdict == "undecided"
    assert claim.final
    assert "2 attracting components" in claim.reason


# ---------------------------------------------------------------- flip_order


@pytest.mark.parametrize(("order", "more"), [([0, 1, 2], {}), ([2, 0, 1], {"from_anywhere": True})])
def test_the_flip_order_of_the_designed_scene(tmp_path, order, more):
    _, claim = asked(scene_with({"flip_order": order} | more), tmp_path)
    assert claim.verdict == "proved"
    assert 8 <= claim.section["jogs"] < 20  # 4 to 8 in a row on side 2 are seen


def test_another_order_is_refuted_by_a_flip():
    """Three sides in another order: test_refutations.py."""
    for order in ([0, 1], [2]):
        proof, claim = asked(scene_with({"flip_order": order}))
        assert claim.verdict == "refuted"
        *_, before, last = (state["side"] for state in require_orbit(proof, reference.paper("designed")))
        assert before != last
        assert (before, last) not in set(zip(order, order[1:] + order[:1], strict=True))
    assert asked(scene_with({"flip_order": [0, 1, 2, 0, 1, 2]}))[1].verdict == "undecided"


def test_a_side_that_is_never_left_refutes_the_order_and_is_one_by_itself(tmp_path):
    proof, claim = asked(part_of(ONE_FIXED, {"flip_order": [0, 1, 2]}))
    assert claim.verdict == "refuted"
    first, last = require_orbit(proof, facts_of(proof.scene))
    assert first["side"] == last["side"] == 1
    assert first["x"] == last["x"]
    # thrown so fast that other starts leave the arm
    assert asked(part_of(ONE_FIXED, {"flip_order": [1]}), tmp_path)[1].verdict == "proved-on-cells"


# ---------------------------------------------------------------- reaches


@pytest.mark.parametrize("anywhere", [False, pytest.param(True, marks=pytest.mark.sweep)])
def test_every_orbit_gets_as_far_as_none_fails_to(tmp_path, anywhere):
    more = {"from_anywhere": True} if anywhere else {}
    goal = {"reaches": {"x": "20 in", "side": 2, "every_orbit": True}} | more
    proof, claim = asked(scene_with(goal), tmp_path)
    assert claim.verdict == "proved"
    rng = np.random.default_rng(8)
    x, side = starts_in(DESIGNED, rng, 200)
    if anywhere:
        begin = [float(edges[0]) for (edges,) in proof.attractions[0].cover.grid.edges]
        x = np.concatenate([x, *(rng.uniform(lo, 28.0, 300) for lo in begin)])
        side = np.concatenate([side, np.repeat([0, 1, 2], 300)])
    assert arrive(proof.scene, x, side, claim.section["throws"] + 1, 20.0).all()


def test_what_the_first_cells_miss_is_sought_on_finer_ones(monkeypatch):
    """2048 cells a side are made to miss something, where landings do not scatter."""
    known = reaches.common

    def missing(attraction, *, anywhere):
        few = anywhere and attraction.cover.grid.n_cells < 3 * 4096
        return "too few" if few else known(attraction, anywhere=anywhere)

    monkeypatch.setattr(reaches, "common", missing)
    goal = {"reaches": {"x": "12 in", "side": 2, "every_orbit": True}, "from_anywhere": True}
    assert asked(scene_with(goal))[1].verdict == "proved"


def test_every_orbit_is_refuted_by_a_periodic_one_with_noise_as_well():
    """Without: test_refutations.py."""
    at = PERIOD_13_UP_TO + 0.002
    goal = {"reaches": {"x": f"{at} in", "side": 2, "every_orbit": True}}
    proof, claim = asked(scene_with(goal), noise={"throw.speed": "0.1 %"})
    assert claim.verdict == "refuted"
    states = require_orbit(proof, reference.paper("designed"))
    assert all(state["between"][1] < at for state in states if state["side"] == 2)
    assert (states[0]["x"], states[0]["side"]) == (states[-1]["x"], states[-1]["side"])


@pytest.mark.sweep
@pytest.mark.parametrize("noise", [None, {"landing.x": "0.05 in"}])
def test_almost_every_orbit_gets_farther(tmp_path, noise):
    """The limit set of side 2 ends at 23.383; the periodic orbits that stay below are of no length."""
    at = 23.0 if noise is None else 22.0
    for more in ({}, {"from_anywhere": True}):
        goal = {"reaches": {"x": f"{at} in", "side": 2}} | more
        _, claim = asked(scene_with(goal), tmp_path, noise=noise)
        # from anywhere with scattered landings: near the joint parts leave
        assert claim.verdict == ("undecided" if noise and more else "proved")
        assert claim.starts != "every"  # the periodic orbits that stay below have starts, too
    rng = np.random.default_rng(9)
    assert arrive(ls.load(DESIGNED), *starts_in(DESIGNED, rng, 50), 4000, at, rng if noise else None).all()


@pytest.mark.parametrize("every", [False, True])
def test_no_orbit_gets_beyond_the_limit_set(every):
    proof, claim = asked(scene_with({"reaches": {"x": "23.45 in", "side": 2, "every_orbit": every}}))
    assert claim.verdict == "refuted"
    assert "no orbit in the attracting component" in claim.reason
    assert all(state["between"][1] < 23.45 for state in require_orbit(proof, reference.paper("designed")))


@pytest.mark.sweep
def test_an_attracting_orbit_keeps_almost_every_orbit_from_getting_there(tmp_path):
    """The fixed point attracts: what comes near it never gets beyond it, though cells around it do."""
    scene = part_of(ONE_FIXED, {"reaches": {"x": "20 in", "side": 1}})
    fixed = float(ls.orbit(scene.map, 24.1, 1, 2000).x[-1])
    x = reference.throw(facts_of(scene), 1, fixed).x
    assert float(x) == pytest.approx(fixed, abs=1e-9)
    for every in (False, True):
        goal = {"reaches": {"x": f"{fixed - 0.5:.6f} in", "side": 1, "every_orbit": every}}
        assert asked(part_of(ONE_FIXED, goal), tmp_path)[1].verdict == "proved-on-cells"
        goal["reaches"]["x"] = f"{fixed + 0.0005:.6f} in"
        proof, claim = asked(part_of(ONE_FIXED, goal))
        assert claim.verdict == "refuted"
        states = require_orbit(proof, facts_of(scene))
        assert all(state["between"][1] < fixed + 0.0005 for state in states)


def test_a_start_on_its_way_to_the_limit_set_refutes_nothing():
    """All that stays is the fixed point, and it lies below x: cells around it reach beyond, and parts do once."""
    scene = part_of(ONE_FIXED, {"attracts_all": True})
    fixed = float(ls.orbit(scene.map, 24.1, 1, 5000).x[-1])
    assert float(reference.throw(facts_of(scene), 1, fixed).x) == pytest.approx(fixed, abs=1e-9)
    for more, want in ((1e-6, "undecided"), (1e-2, "proved-on-cells")):
        goal = {"oriented_beyond": {"x": f"{fixed + more!r} in", "side": 2}}
        assert asked(part_of(ONE_FIXED, goal))[1].verdict == want
    goal = {"oriented_beyond": {"x": f"{fixed - 1e-4!r} in", "side": 2}}
    assert asked(part_of(ONE_FIXED, goal))[1].verdict == "refuted"


# ---------------------------------------------------------------- with a tolerance, and where nothing is proved


@pytest.mark.parametrize(
    "goal",
    [
        {"flip_order": [0, 1, 2]},
        {"attracts_all": True},
        {"reaches": {"x": "19 in", "side": 2, "every_orbit": True}, "from_anywhere": True},
        {"reaches": {"x": "21 in", "side": 2}},
        {"oriented_beyond": {"x": "27 in", "side": 2}, "from_anywhere": True},
    ],
    ids=str,
)
def test_goals_hold_for_every_value_of_a_tolerance(tmp_path, goal):
    _, claim = asked(scene_with(goal), tmp_path, tolerance={"throw.speed": "0.2 %"})
    assert claim.verdict == "proved"


@pytest.mark.parametrize("kind", ["flip_order", "reaches", "oriented_beyond"])
def test_without_attracting_cells_nothing_is_said_of_them(kind):
    goal = {kind: [0, 1, 2] if kind == "flip_order" else {"x": "19 in", "side": 2}}
    _, claim = asked(scene_with(goal, arm={"surface_height": "-3 in"}))
    assert (claim.verdict, claim.reason) == ("undecided", "there are no attracting cells")


# ----------------------------------------------------------------
# Goals whose starts are ranges in which parts are laid down: proved, rechecked, forged; margins and refutations.


GOOD = {0: [(11, 14)], 2: [(5.0, 17.0)]}
PARTLY = {0: [(6, 12)]}


def leaving(**goal):
    """A feeder from which 8 % of the starts on the arm leave, most of them on side 1 at x < 8.24."""
    arm, part = {"surface_height": "-0.4557 in"}, massed("3.5078 in", "0.7035 in")
    goal = goal or {"oriented_beyond": {"x": "16.2 in", "side": 2}}
    return scene_with(goal, throw={"kappa": "18.4128 in"}, part=part, arm=arm)


@pytest.fixture(scope="module")
def scene():
    return leaving()


@pytest.fixture(scope="module")
def proofs(scene, tmp_path_factory):
    folder = tmp_path_factory.mktemp("laid")
    found = {name: ls.certify(scene, laid=laid) for name, laid in (("good", GOOD), ("partly", PARTLY))}
    return {
        name: (proof, proof.save(folder / f"{name}.proof.zip", recheck=False))
        for name, proof in found.items()
    }


def forged(path, tmp_path, **entries):
    """The same certificate with other entries of its section."""
    return ls.recheck(forge.with_section(path, tmp_path / "f.zip", lambda section: section.update(entries)))


def hexed(ranges):
    """Places as a certificate has them."""
    return json.loads(json.dumps(ranges), parse_float=lambda x: float(x).hex())


def drawn(laid, count=4000):
    """Random starts in the ranges."""
    random, ranges = np.random.default_rng(3), [(s, lo, hi) for s, pairs in laid.items() for lo, hi in pairs]
    k = random.integers(len(ranges), size=count)
    side, lo, hi = (np.array(column)[k] for column in zip(*ranges, strict=True))
    return random.uniform(lo, hi), side.astype(np.int64)


def test_the_goal_is_proved_of_the_starts_laid_down_though_others_leave(scene, proofs):
    whole = ls.certify(scene).claims[1]
    assert whole.verdict == "proved-on-cells"
    assert whole.shares["leaves"] > 0.05
    proof, file = proofs["good"]
    (claim,) = proof.claims  # attracts-all is about the whole arm
    assert (claim.claim, claim.verdict) == ("goal", "proved")
    assert proof.proved
    (record,) = proof.to_json()
    assert record["starts"] == {"within": {"0": [[11.0, 14.0]], "2": [[5.0, 17.0]]}}
    assert record["laid"] == record["starts"]["within"]
    assert [record[word] for word in ("share", "leaves", "creeps", "open")] == [1.0, 0.0, 0.0, 0.0]
    report = ls.recheck(file)
    assert (report.verdict, report.open) == ("proved", 0.0)
    assert report.starts == {"within": {"0": [(11.0, 14.0)], "2": [(5.0, 17.0)]}}
    assert "11.0 <= x <= 14.0 on side 0" in report.statement[0]


@pytest.mark.sweep
def test_shares_are_those_of_the_ranges(scene, proofs):
    proof, file = proofs["partly"]
    (claim,) = proof.claims
    assert (claim.verdict, claim.starts) == ("proved-on-cells", "cells")
    assert not proof.proved
    shares = claim.shares
    # a sixth of a thousandth flips to side 1 before x = 8.24: about the share of random parts that leave
    x, side = drawn(PARTLY, 60_000)
    lost = (advance(scene.map, x, side, 100)[2] < 0).mean()
    assert 0.0 < lost < shares["leaves"] + shares["open"] < 0.01
    assert shares["share"] + shares["leaves"] + shares["open"] == pytest.approx(1.0, abs=1e-6)
    report = ls.recheck(file)
    assert (report.verdict, report.starts) == ("proved-on-cells", "cells")
    assert report.share == pytest.approx(shares["share"], abs=2e-6)
    assert "ranges in which parts are laid down" in report.claims[0][2]


def test_a_place_between_two_floats_is_rounded_outward():
    scene = ls.load("paper-designed")
    ((_, lo, hi),) = read_laid(scene, {0: [("20.1 cm", "12.1 in")]})
    assert Fraction(lo) <= Fraction("20.1") / Fraction("2.54") <= Fraction(np.nextafter(lo, 99.0))
    assert Fraction(np.nextafter(hi, 0.0)) <= Fraction("12.1") <= Fraction(hi)


FAILED = ("failed", "bad file")
FORGED = [  # starts, and what becomes of them
    ({"within": {"0": [[11.0, 14.0]], "1": [[5.0, 17.0]]}}, FAILED),  # on another side
    ({"within": {"0": [[11.0, 14.0]], "2": [[3.6, 17.0]], "1": [[6.0, 6.5]]}}, FAILED),  # one more
    ({"within": {"0": [[3.0, 14.0]]}}, FAILED),  # wider
    ({"within": {"1": [[8.0, 9.0]]}}, FAILED),  # shifted to where parts leave
    ({"within": {"0": [[2.0, 14.0]]}}, FAILED),  # before the cells
    ({"within": {"0": [[30.0, 31.0]]}}, FAILED),  # beyond the arm
    ("every", FAILED),
    ("almost-every", FAILED),
    ({"from": {"0": 5.0, "1": 5.0, "2": 5.0}}, FAILED),
    ({"within": {"0": [[10.8, 14.5]]}}, ("proved",)),  # wider, and true
]
NO_RANGES = [{}, {"0": []}, {"7": [[1.0, 2.0]]}, {"0": [[14.0, 11.0]]}, {"0": [[11.0, 14.0], [13.0, 15.0]]}]
NO_RANGES += [{"0": [[11.0]]}, {"0": 11.0}, []]
FORGED += [({"within": ranges}, ("bad file",)) for ranges in NO_RANGES]
FORGED += [({"within": {"0": [[11.0, 14.0]]}, "cells": {"0": [[11.0, 14.0]]}}, ("bad file",))]


@pytest.mark.parametrize(("starts", "verdicts"), FORGED, ids=str)
def test_ranges_are_judged_by_what_is_proved_of_them_whatever_was_asked(proofs, tmp_path, starts, verdicts):
    assert forged(proofs["good"][1], tmp_path, starts=hexed(starts)).verdict in verdicts


def test_what_is_proved_of_some_cells_is_not_of_all(proofs, tmp_path):
    section = forge.opened(proofs["partly"][1]).header["claims"][0]["section"]
    report = forged(proofs["partly"][1], tmp_path, starts={"within": section["starts"]["cells"]})
    assert report.verdict == "failed"
    assert "its rank is -1" in report.reason


@pytest.mark.parametrize(
    "goal",
    [
        {"stays_on_arm": True, "from_anywhere": True},
        pytest.param({"reaches": {"x": "16 in", "side": 2}}, marks=pytest.mark.repeats),
        {"reaches": {"x": "16 in", "side": 2}, "from_anywhere": True},
        {"flip_order": [0, 1, 2], "from_anywhere": True},
        {"attracts_all": True},
        {"oriented_beyond": {"x": "18 in", "side": 2}, "from_anywhere": True},
    ],
    ids=lambda goal: f"{next(iter(goal))}{'-anywhere' * ('from_anywhere' in goal)}",
)
def test_every_kind_of_goal_is_asked_of_what_such_starts_come_to(goal, tmp_path):
    """Of all starts none of these holds, since some leave."""
    proof = ls.certify(leaving(**goal), laid={0: [(11, 14)]})
    assert proof.claims[0].verdict == "proved", proof.claims[0]
    proof.save(tmp_path / "a.proof.zip")


def test_an_orbit_refutes_only_where_a_part_laid_down_comes_to_it(scene):
    elsewhere = laid_goal(StaysOnArm(from_anywhere=True), read_laid(scene, {0: [(11, 14)]}))
    there = laid_goal(StaysOnArm(from_anywhere=True), read_laid(scene, {1: [(3, 8)]}))
    assert Query.of(scene, (elsewhere,)).refute().verdict != "refuted"
    found = Query.of(scene, (there,)).refute()
    start = found.counterexample[0]
    assert found.verdict == "refuted"
    assert start.side == 1
    assert 3 < start.lo <= start.hi < 8


def test_margins_count_the_starts_laid_down_alone(scene, tmp_path):
    (whole,) = ls.margin(scene, "throw.speed", width=0.05)
    assert whole.proved == 0.0
    (found,) = ls.margin(scene, "throw.speed", laid=GOOD, width=0.05)
    # beyond 0.18 % more the limit set itself loses parts: its lower end on side 1, 8.298, comes below 8.235
    assert found.proved > 0.15
    assert found.refuted is not None
    assert found.to_json()["goal"]["laid"] == {"0": [[11.0, 14.0]], "2": [[5.0, 17.0]]}
    files = found.save(tmp_path)
    assert [ls.recheck(file).verdict for file in files] == ["proved", "refuted"]
    # a scene within what is proved feeds the parts that are laid down, whatever its speed
    for speed in (1.0 - found.proved / 100.0, 1.0 + found.proved / 100.0):
        other = scene.with_values({"throw.kappa": scene.kappa / speed**2})
        x, side, code, _ = advance(other.map, *drawn(GOOD), 300)
        assert (code >= 0).all()
        assert not ((x > 16.2) & (side != 2)).any()

    goal = forge.opened(files[1]).header["claims"][0]["section"]["goal"]
    moved = {"starts": hexed({"within": {"0": [[2.5, 2.6]]}})}
    assert forged(files[1], tmp_path, goal=goal | moved).verdict == "failed"


def test_a_tolerance_across_the_height_of_the_joint(tmp_path):
    """Next to the joint nothing is proved at height 0: of parts laid down beyond it everything is."""
    scene = ls.load("paper-designed")
    tolerance = {"arm.surface_height": "0.25 in"}  # from -0.45 in to 0.05 in
    laid = {0: [(8, 16)]}
    query = laid_goal(OrientedBeyond(21.0, 2), read_laid(scene, laid))
    (found,) = ls.margin(scene, "arm.surface_height", goal=query, width=0.1)
    assert found.proved > 0.2, found.reason
    tree = scene.as_dict() | {"goal": {"oriented_beyond": {"x": "21 in", "side": 2}}}
    assert ls.certify(ls.load(tree), ["goal"], tolerance=tolerance).claims[0].verdict != "proved"
    proof = ls.certify(ls.load(tree), laid=laid, tolerance=tolerance)
    assert proof.claims[0].verdict == "proved", proof.claims[0].reason
    proof.save(tmp_path / "t.proof.zip")


def test_noise_of_the_landing_place(tmp_path):
    """Under it a worst sequence loses parts next to the joint: not those that are laid down farther out."""
    scene = ls.load("paper-designed")
    noise = {"landing.x": "0.01 in", "throw.speed": "0.1 %"}
    assert ls.certify(scene, ["goal"], noise=noise).claims[0].shares["leaves"] > 0.0
    proof = ls.certify(scene, laid={0: [(6, 14)]}, noise=noise)
    assert proof.claims[0].starts == {"within": {"0": [[6.0, 14.0]]}}
    proof.save(tmp_path / "n.proof.zip")


@pytest.mark.parametrize(
    ("laid", "words"),
    [
        ({3: [(8, 20)]}, "a side on which the part rests: 0, 1, 2"),
        ({True: [(8, 20)]}, "a side on which the part rests"),
        ({0: [(20, 8)]}, "a lower end and a higher one"),
        ({0: [(8, 8)]}, "a lower end and a higher one"),
        ({0: [(1, 8)]}, "where a part on side 0 tips over the joint"),
        ({0: [(8, 29)]}, "the arm's end, 28 in"),
        ({0: [(8, "20 deg")]}, "20 deg"),
        ({0: [(8, float("nan"))]}, "a number, or text with a unit"),
        ({0: [8, 20]}, "by side a list of ranges"),
        ({0: []}, "by side a list of ranges"),
        ({}, "by side a list of ranges"),
    ],
    ids=str,
)
def test_places_where_no_part_can_be_laid_down_are_refused(laid, words):
    with pytest.raises(LimitsetsError, match=r"laid down|range|20 deg") as caught:
        ls.certify("paper-designed", laid=laid)
    assert words in str(caught.value)


def test_starts_are_those_of_a_goal():
    tree = ls.load("paper-designed").as_dict()
    del tree["goal"]
    with pytest.raises(LimitsetsError, match=r"a scene with \[goal\]"):
        ls.certify(ls.load(tree), laid={0: [(8, 20)]})
    with pytest.raises(LimitsetsError, match="none beside a map"):
        ls.certify(ls.maps.Logistic(2.5), ls.grid([(0.1, 0.9)], cells=8), laid={0: [(0.2, 0.3)]})
    every = laid_goal(Reaches(20.0, 2, every_orbit=True), ((0, 8.0, 9.0),))
    assert every.laid == ((0, 8.0, 9.0),)
    assert laid_goal(every, ()) == every
