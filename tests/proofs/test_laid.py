"""Goals whose starts are ranges in which parts are laid down: proved, rechecked, forged; margins and refutations."""

import copy
import io
import json
import zipfile
from fractions import Fraction

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.feeder.goals import OrientedBeyond, Reaches, StaysOnArm
from limitsets.feeder.scene.laid import laid_goal, read_laid
from limitsets.proofs.prover.query import Query
from limitsets.systems.maps import advance

GOOD = {0: [(11, 14)], 2: [(5.0, 17.0)]}
PARTLY = {0: [(6, 12)]}


def leaving(**goal):
    """A feeder from which 8 % of the starts on the arm leave, most of them on side 1 at x < 8.24."""
    tree = copy.deepcopy(ls.load("paper-designed").as_dict())
    tree["name"] = "leaving"
    tree["throw"]["kappa"] = "18.4128 in"
    tree["part"]["mass"]["center"].update(along="3.5078 in", above="0.7035 in")
    tree["arm"]["surface_height"] = "-0.4557 in"
    tree["goal"] = goal or {"oriented_beyond": {"x": "16.2 in", "side": 2}}
    return ls.load(tree)


@pytest.fixture(scope="module")
def scene():
    return leaving()


@pytest.fixture(scope="module")
def proofs(scene, tmp_path_factory):
    folder = tmp_path_factory.mktemp("laid")
    found = {}
    for name, laid in (("good", GOOD), ("partly", PARTLY)):
        proof = ls.certify(scene, laid=laid)
        found[name] = proof, proof.save(folder / f"{name}.proof.zip")
    return found


def forged(path, target, change):
    """The same file with another section of its claim."""
    with zipfile.ZipFile(path) as file:
        header, arrays = json.loads(file.read("header.json")), file.read("arrays.npz")
    change(header["claims"][0]["section"])
    with zipfile.ZipFile(target, "w", zipfile.ZIP_STORED) as file:
        file.writestr("header.json", json.dumps(header))
        file.writestr("arrays.npz", io.BytesIO(arrays).getvalue())
    return ls.recheck(target)


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


def test_thrown_parts_do_what_is_proved(scene, proofs):
    x, side = drawn(GOOD)
    for _ in range(60):
        x, side, code, _ = advance(scene.map, x, side, 5)
        assert (code >= 0).all()
    assert not ((x > 16.2) & (side != 2)).any()
    assert ((x > 16.2) & (side == 2)).any()
    # and those that are laid down where nothing is claimed do leave
    x, side = drawn({1: [(3.0, 8.0)]})
    assert (advance(scene.map, x, side, 300)[2] < 0).mean() > 0.5


def test_shares_are_those_of_the_ranges(scene, proofs):
    proof, file = proofs["partly"]
    (claim,) = proof.claims
    assert (claim.verdict, claim.starts) == ("proved-on-cells", "cells")
    assert not proof.proved
    shares = claim.shares
    # a sixth of a thousandth flips to side 1 before x = 8.24: about the share of random parts that leave
    x, side = drawn(PARTLY, 200_000)
    lost = (advance(scene.map, x, side, 300)[2] < 0).mean()
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


@pytest.mark.parametrize(
    "starts",
    [
        {"within": {"0": [[11.0, 14.0]], "1": [[5.0, 17.0]]}},  # on another side
        {"within": {"0": [[11.0, 14.0]], "2": [[3.6, 17.0]], "1": [[6.0, 6.5]]}},  # one more
        {"within": {"0": [[3.0, 14.0]]}},  # wider
        {"within": {"1": [[8.0, 9.0]]}},  # shifted to where parts leave
        {"within": {"0": [[2.0, 14.0]]}},  # before the cells
        {"within": {"0": [[30.0, 31.0]]}},  # beyond the arm
        "every",
        "almost-every",
        {"from": {"0": 5.0, "1": 5.0, "2": 5.0}},
    ],
    ids=str,
)
def test_forged_ranges_are_denied(proofs, tmp_path, starts):
    def change(section):
        section["starts"] = json.loads(json.dumps(starts), parse_float=lambda x: float(x).hex())

    _, file = proofs["good"]
    report = forged(file, tmp_path / "f.zip", change)
    assert report.verdict in ("failed", "bad file"), report


@pytest.mark.parametrize(
    "ranges",
    [
        {},
        {"0": []},
        {"7": [[1.0, 2.0]]},
        {"0": [[14.0, 11.0]]},
        {"0": [[11.0, 14.0], [13.0, 15.0]]},
        {"0": [[11.0]]},
        {"0": 11.0},
        [],
    ],
    ids=str,
)
def test_ranges_of_another_form_are_no_certificate(proofs, tmp_path, ranges):
    said = json.loads(json.dumps(ranges), parse_float=lambda x: float(x).hex())
    _, file = proofs["good"]
    assert forged(file, tmp_path / "f.zip", lambda s: s.update(starts={"within": said})).verdict == "bad file"
    both = {"within": {"0": [[(11.0).hex(), (14.0).hex()]]}, "cells": {"0": [[(11.0).hex(), (14.0).hex()]]}}
    assert forged(file, tmp_path / "f.zip", lambda s: s.update(starts=both)).verdict == "bad file"


def test_what_is_proved_of_some_cells_is_not_claimed_of_all(proofs, tmp_path):
    _, file = proofs["partly"]
    report = forged(file, tmp_path / "f.zip", lambda s: s.update(starts={"within": s["starts"]["cells"]}))
    assert report.verdict == "failed"
    assert "its rank is -1" in report.reason


def test_a_wider_range_that_is_true_is_confirmed(proofs, tmp_path):
    """The checker does not compare with what was asked: it proves what stands in the file."""
    wider = {"within": {"0": [[(10.8).hex(), (14.5).hex()]]}}
    assert forged(proofs["good"][1], tmp_path / "f.zip", lambda s: s.update(starts=wider)).verdict == "proved"


@pytest.mark.parametrize(
    "goal",
    [
        {"stays_on_arm": True, "from_anywhere": True},
        {"reaches": {"x": "16 in", "side": 2}},
        {"reaches": {"x": "16 in", "side": 2}, "from_anywhere": True},
        {"flip_order": [0, 1, 2], "from_anywhere": True},
        {"attracts_all": True},
        {"oriented_beyond": {"x": "18 in", "side": 2}, "from_anywhere": True},
    ],
    ids=lambda goal: f"{next(iter(goal))}{'-anywhere' * ('from_anywhere' in goal)}",
)
def test_every_kind_of_goal_is_asked_of_what_such_starts_come_to(goal, tmp_path):
    scene = leaving(**goal)
    assert ls.certify(scene, ["goal"]).claims[0].verdict != "proved"
    proof = ls.certify(scene, laid={0: [(11, 14)]})
    assert proof.claims[0].verdict == "proved", proof.claims[0]
    assert ls.recheck(proof.save(tmp_path / "a.proof.zip")).verdict == "proved"


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

    def moved(section):
        section["goal"]["starts"] = {"within": {"0": [[(2.5).hex(), (2.6).hex()]]}}

    assert forged(files[1], tmp_path / "f.zip", moved).verdict == "failed"


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
    assert ls.recheck(proof.save(tmp_path / "t.proof.zip")).verdict == "proved"


def test_noise_of_the_landing_place(tmp_path):
    """Under it a worst sequence loses parts next to the joint: not those that are laid down farther out."""
    scene = ls.load("paper-designed")
    noise = {"landing.x": "0.01 in", "throw.speed": "0.1 %"}
    assert ls.certify(scene, ["goal"], noise=noise).claims[0].shares["leaves"] > 0.0
    proof = ls.certify(scene, laid={0: [(6, 14)]}, noise=noise)
    assert proof.claims[0].starts == {"within": {"0": [[6.0, 14.0]]}}
    assert ls.recheck(proof.save(tmp_path / "n.proof.zip")).verdict == "proved"


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
