"""The arm's surface above the joint: fixed points of the jog, and what starts on both sides of them do.

The fixed points are computed apart, from the decimals of the scene by plane geometry at 40 digits: phi* from
-h + a (1 - cos phi)/phi - d (phi - sin phi)/phi = 0, and R* from f(phi*) = 0.  docs/model.md has them
to 5 digits.
"""

import math

import numpy as np
import pytest

import limitsets as ls
from limitsets.systems.maps import images
from tests.inverse import exact

mpmath = pytest.importorskip("mpmath")
mp, mpf = mpmath.mp, mpmath.mpf

KAPPA = "25.3778518"
PAPER = {"0.1": (3.16, 3.19, 4.81), "0.2": (4.64, 4.55, 5.39)}  # docs/model.md


def scene(h, **more):
    return ls.load("paper-designed").with_values({"arm.surface_height": float(h), **more})


def sides(along="4.2255778"):
    """(a, d) of every side of the designed part, from its decimals."""
    lengths = dict(zip(exact.SIDES, ("5.75", "3.6", "6.75"), strict=True))
    return exact.feet(lengths | {exact.ALONG: along, exact.ABOVE: "0.7082490"})


def exact_fixed_point(a, d, h, kappa):
    """R* at 40 digits."""
    h, kappa = mpf(h), mpf(kappa)
    phi = mp.findroot(lambda p: -h + a * (1 - mp.cos(p)) / p - d * (p - mp.sin(p)) / p, 2 * h / a)
    return kappa * phi / 2 + (a * mp.sin(phi) - d * (1 - mp.cos(phi))) / phi


@pytest.fixture(autouse=True)
def digits():
    with mp.workdps(40):
        yield


@pytest.fixture(scope="module", params=["0.05", "0.1", "0.2"])
def proved(request):
    return request.param, ls.certify(scene(request.param), ["attracts-all"])


def record(proof):
    return proof.to_json()[0]


# ---------------------------------------------------------------- what is proved


def test_both_basins_are_proved_and_rechecked(proved, tmp_path):
    _, proof = proved
    assert proof.proved
    report = ls.recheck(proof.save(tmp_path / "x.proof.zip", recheck=False))
    assert (report.verdict, report.reason) == ("proved", "")
    assert "tends to a_i" in report.statement[0]


def test_brackets_hold_the_fixed_points_and_are_narrow(proved):
    h, proof = proved
    points = record(proof)["jog_fixed_points"]
    for side, (a, d) in enumerate(sides()):
        want = exact_fixed_point(a, d, h, KAPPA)
        lo, hi = points[str(side)]
        assert mpf(lo) < want < mpf(hi)
        assert hi - lo < 1e-9
        if h in PAPER:
            assert float(want) == pytest.approx(PAPER[h][side], abs=0.01)


def test_orbits_from_beyond_enter_in_time_and_stay(proved):
    _, proof = proved
    found, scene_ = record(proof), proof.scene
    bound = found["max_throws"]
    rng = np.random.default_rng(3)
    for side in range(3):
        hi, begin = found["jog_fixed_points"][str(side)][1], bound["beyond"][str(side)]
        assert hi < begin < hi + 1e-3
        for x in (hi + 1e-7, begin, scene_.arm_length, *rng.uniform(begin, scene_.arm_length, 5)):
            more = max(0.0, math.log((begin - hi) / (x - hi)) / math.log(bound["near_joint"]))
            late = bound["throws"] + 1 + math.ceil(more)
            path = ls.orbit(scene_.map, x, side, late + 200)
            assert path.stopped is None
            for number, parts in found["extents"].items():
                there = path.x[late:][path.side[late:] == int(number)]
                assert np.any([(a[0] <= there) & (there <= b[1]) for a, b in parts], axis=0).all()


def test_orbits_from_nearer_fall_to_the_joint(proved):
    _, proof = proved
    points = record(proof)["jog_fixed_points"]
    for side, (a, _) in enumerate(sides()):
        lo, foot = points[str(side)][0], float(a)
        for share in (0.01, 0.5, 0.9, 0.999):
            path = ls.orbit(proof.scene.map, foot + share * (lo - foot), side, 8000)
            assert (path.side == side).all()
            assert (np.diff(path.x[path.x > foot + 1e-9]) < 0.0).all()
            assert foot - 1e-12 < path.x[-1] < foot + 1e-3


# ---------------------------------------------------------------- noise and tolerance


def test_with_noise_the_bracket_holds_the_fixed_points_of_every_speed(tmp_path):
    proof = ls.certify(scene("0.1"), ["attracts-all"], noise={"throw.speed": "0.3 %"})
    assert proof.proved
    points = record(proof)["jog_fixed_points"]
    kappas = [mpf(KAPPA) / (1 + s * mpf("0.003")) ** 2 for s in (-1, 1)]
    rng = np.random.default_rng(8)
    for side, (a, d) in enumerate(sides()):
        least, most = sorted(exact_fixed_point(a, d, "0.1", kappa) for kappa in kappas)
        lo, hi = points[str(side)]
        assert mpf(lo) < least < most < mpf(hi)
        assert hi - lo < 1.001 * float(most - least) + 1e-9
        x = np.concatenate([rng.uniform(float(a) + 0.01, lo, 50), rng.uniform(hi + 1e-6, hi + 0.5, 50)])
        for _ in range(300):  # the speed anew at every throw, at one of its ends or between
            kappa = float(rng.choice([*map(float, kappas), rng.uniform(*sorted(map(float, kappas)))]))
            got = images(proof.scene.map._replace(kappa=kappa), x, side)
            assert (got.code == 0).all()
            assert (got.x[:50] < x[:50]).all()
            assert (got.x[50:] > x[50:]).all()
            x = np.concatenate([got.x[:50], np.minimum(got.x[50:], hi + 0.5)])
    report = ls.recheck(proof.save(tmp_path / "x.proof.zip", recheck=False))
    assert report.verdict == "proved"
    assert "nothing is claimed of starts between lo_i and hi_i" in report.statement[0]


def test_with_a_tolerance_each_value_has_its_own_fixed_point_in_the_bracket(tmp_path):
    proof = ls.certify(scene("0.1"), ["attracts-all"], tolerance={"arm.surface_height": "0.01 in"})
    assert proof.proved
    for side, (a, d) in enumerate(sides()):
        lo, hi = record(proof)["jog_fixed_points"][str(side)]
        for share in ("-0.01", "-0.003", "0", "0.01"):
            assert lo < exact_fixed_point(a, d, mpf("0.1") + mpf(share), KAPPA) < hi
    assert ls.recheck(proof.save(tmp_path / "x.proof.zip", recheck=False)).verdict == "proved"


def test_the_bracket_of_a_tolerance_in_pieces_holds_those_of_all_pieces(tmp_path):
    proof = ls.certify(scene("0.1"), ["attracts-all"], tolerance={"part.mass.center.along": "0.01 in"})
    assert proof.proved
    assert len(proof.attractions) > 1
    for along in ("4.2155778", "4.22", "4.2355778"):
        for side, (a, d) in enumerate(sides(along)):
            lo, hi = record(proof)["jog_fixed_points"][str(side)]
            assert lo < exact_fixed_point(a, d, "0.1", KAPPA) < hi
    assert ls.recheck(proof.save(tmp_path / "x.proof.zip", recheck=False)).verdict == "proved"


# ---------------------------------------------------------------- what is not


ACROSS = "not proved to be below the joint nor above it"
UNDECIDED = [  # height of the surface, its tolerance and the rest of the scene's name
    # no fixed point where a (1 - cos phi) - d (phi - sin phi) < h phi for all phi: 40 digits find none on sides 0 and 1
    (1.0, None, "", "no unstable fixed point of the jog is found"),
    # R*_0 = 10.79 lies beyond the first critical point, 9.445: parts flip before
    (0.5, None, "", "not every start up to the fixed point of the jog is proved to jog"),
    (0.0, None, "", ACROSS),
    (0.01, "0.02 in", "", ACROSS),
    (1e-4, None, "", "too little for such cells"),  # 2 h/(kappa - d) = 8e-6
    # R' = R - h phi: nothing parts the two basins there
    (0.1, None, "-small-angle", "every jog goes inward"),
]


@pytest.mark.parametrize(("height", "tolerance", "rest", "why"), UNDECIDED)
def test_what_is_undecided_says_why(height, tolerance, rest, why):
    one = ls.load(f"paper-designed{rest}").with_values({"arm.surface_height": height})
    given = {"tolerance": {"arm.surface_height": tolerance}} if tolerance else {}
    proof = ls.certify(one, ["attracts-all"], **given)
    (claim,) = proof.claims
    assert claim.verdict == "undecided"
    assert why in claim.reason
    assert record(proof)["jog_fixed_points"] is None


def test_an_arm_that_ends_before_the_fixed_point_is_left():
    """R*_2 = 4.81 lies beyond an arm of 4.5 in, and other starts are thrown off its end."""
    tree = ls.load("paper-designed").as_dict()
    del tree["goal"]
    scene = ls.load(tree).with_values({"arm.surface_height": 0.1, "arm.length": 4.5})
    (claim,) = ls.certify(scene, ["attracts-all"]).claims
    assert claim.verdict == "refuted"
    first, last = claim.counterexample[0], claim.counterexample[-1]
    assert last.lo > 4.5
    path = ls.orbit(scene.map, first.lo, first.side, len(claim.counterexample))
    assert path.stopped == "outward"
