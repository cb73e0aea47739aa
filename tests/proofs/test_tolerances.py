"""Proofs for tolerance boxes and for bounded noise."""

import copy
import json
import math
import tomllib
import zipfile

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.proofs.prover.parameters import parameter_box
from tests.inverse import exact
from tests.plates import LEAD_QUAD
from tests.proofs import forge
from tests.proofs.test_certify import require_rechecked, thrown_again, verdicts
from tests.proofs.test_recheck import checker, verdict
from tests.thrower import reference

# ----------------------------------------------------------------
# A tolerance in each quantity: proved, and proved again by the lone checker, which halves quantities to see it.
# That wider ones are refuted, and where, is asked in tests/robust/test_margins.py.


pytest.importorskip("flint", reason="the checker needs python-flint")


WIDE = {  # half of what is proved of attracts-all and the goal, or somewhat less
    "arm.surface_height": "0.026 in",
    "arm.length": "2.1 in",
    "part.mass.center.along": "0.06 in",
    "part.mass.center.above": "0.015 in",
    "part.mass.radius_of_gyration": "0.09 in",
    "part.sides[0]": "0.04 in",
    "part.sides[1]": "0.04 in",
    "part.sides[2]": "0.04 in",
    "throw.kappa": "0.7 %",
    "throw.speed": "0.35 %",
    "gravity.acceleration": "0.7 %",
}


def designed(name):
    """The designed scene, by its speed where it is gravity that is not known."""
    tree = ls.load("paper-designed").as_dict()
    if name.startswith("gravity"):
        tree["throw"] = {"speed": "158.02 deg/s"}
    return ls.load(tree)


@pytest.mark.parametrize(("name", "width"), WIDE.items())
def test_each_quantity_is_proved_and_rechecked(tmp_path, name, width):
    proof = ls.certify(designed(name), tolerance={name: width})
    assert proof.proved
    report = ls.recheck(proof.save(tmp_path / "x.proof.zip", recheck=False))
    assert report.reason == ""
    assert report.claims == [("attracts-all", "proved", ""), ("goal", "proved", "")]


# ---------------------------------------------------------------- the checker's halves


@pytest.fixture(scope="module")
def proved(tmp_path_factory):
    proof = ls.certify("paper-designed", tolerance={"arm.surface_height": "0.026 in"})
    return proof.save(tmp_path_factory.mktemp("wide") / "x.proof.zip", recheck=False)


def test_a_wider_interval_than_was_proved_is_not_believed(proved, tmp_path):
    f = forge.opened(proved)
    assert verdict(f.seal(), tmp_path).verdict == "proved"
    wider = f.copy()
    wider.header["boxes"][0]["scene"]["arm"]["surface_height"] = ["-0.24 in", "-0.16 in"]
    wider.header["boxes"][0]["parameters"]["surface_height"] = [(-0.25).hex(), (-0.15).hex()]
    wider.header["tolerance"] = {"arm.surface_height": "0.04 in"}
    assert verdict(wider, tmp_path).verdict == "failed"
    for side in range(3):
        spoiled = f.copy()
        cell = int(np.flatnonzero(spoiled.arrays["0.component"] >= 0)[5 + 30 * side])
        spoiled.arrays["0.phi"][cell, 1] = spoiled.arrays["0.phi"][cell].mean()
        assert verdict(spoiled.seal(), tmp_path).verdict == "failed"


def test_one_quantity_is_not_named_twice(tmp_path):
    f = forge.forge("small", first=0.1, ratio=0.02, widest=0.1)
    f.header["tolerance"] = {"throw.kappa": "0 %", "throw.speed": "0 %"}
    report = verdict(f, tmp_path)
    assert (report.verdict, report.reason) == ("bad file", "tolerance names one quantity twice")


def test_halves_hold_the_whole_together_and_narrow_it():
    """Each part of the interval is in one of the halves, and each a_i computed from it in floats is in that half's."""
    raw = forge.scene("designed")
    raw["part"]["mass"]["center"]["along"] = ["4.2 in", "4.25 in"]
    raw["part"]["sides"][0] = ["5.74 in", "5.76 in"]
    raw["arm"]["surface_height"] = ["-0.2001 in", "-0.1999 in"]
    whole = checker.scene.read_scene(copy.deepcopy(raw), None)
    pieces = [whole]
    for _ in range(6):
        pieces = [half for piece in pieces for half in piece.halves()]
    assert len(pieces) == 64
    assert all(piece.loose < 0.3 * whole.loose for piece in pieces)
    names = ("part.mass.center.along", "part.sides[0]", "arm.surface_height")
    ends = []
    for piece in pieces:
        read = dict(checker.scene.quantities(piece.raw))
        each = [checker.file.quantity(read[name], "length", name) for name in names]
        ends.append([[float(end / checker.file.INCH) for end in (q.lo, q.hi)] for q in each])
    ends = np.array(ends)
    assert np.ptp(ends, axis=2).prod(axis=1).sum() == pytest.approx(0.05 * 0.02 * 0.0002, rel=1e-12)
    rng = np.random.default_rng(4)
    for _ in range(60):
        at = rng.uniform(4.2, 4.25), rng.uniform(5.74, 5.76)
        mine = np.flatnonzero(((ends[:, :2, 0] <= at) & (at <= ends[:, :2, 1])).all(axis=1))
        assert mine.size
        feet = exact.feet(
            dict(
                zip(
                    (exact.ALONG, exact.ABOVE, *exact.SIDES),
                    (at[0], 0.7082490, at[1], 3.6, 6.75),
                    strict=True,
                )
            )
        )
        for k in mine:
            for (a, d), s in zip(feet, pieces[k].sides, strict=True):
                assert float(s.a.lower()) - 1e-12 <= a <= float(s.a.upper()) + 1e-12
                assert float(s.d.lower()) - 1e-12 <= d <= float(s.d.upper()) + 1e-12


OTHER_UNITS = tomllib.loads("""
part.vertices = [["0 mm", "0 mm"], ["130000 \u00b5m", "0 mm"], ["150 mm", "70 mm"], ["30 mm", "100 mm"]]
part.mass.plate_density = "1.5 g/cm^3"
part.mass.plate_thickness = "2000 \u03bcm"
part.mass.points = [{x = "110 mm", y = "15 mm", mass = "60000 mg"}]
arm = {surface_height = "-15000 \u00b5m", length = "700 mm"}
throw.speed = " 26.7   rpm"
gravity.tilt = "30\u00b0"
world.stroke = "5 \u00b0"
""")


DEVIATIONS = [
    (None, None),
    ({"throw.speed": "0.05 deg/s", "arm.surface_height": "5 \u00b5m"}, None),
    (None, {"throw.speed": "0.01 rpm", "gravity.tilt": "0.01\u00b0"}),
]


@pytest.mark.parametrize(("tolerance", "noise"), DEVIATIONS)
def test_a_scene_in_the_units_of_other_workshops_is_rechecked(tmp_path, tolerance, noise):
    scene = ls.load(LEAD_QUAD | OTHER_UNITS)
    proof = ls.certify(scene, ["invariant"], tolerance=tolerance, noise=noise)
    assert proof.proved
    path = proof.save(tmp_path / "quad.proof.zip", recheck=False)
    report = ls.recheck(path)
    assert (report.verdict, report.reason) == ("proved", "")
    with zipfile.ZipFile(path) as file:
        header = json.loads(file.read("header.json"))
    assert (header["version"], header["scene"]) == (3, {"flight": "exact", "flip": "signed"})
    assert json.dumps(header, ensure_ascii=False).isascii()
    # 26.7 rpm is 160.2 deg/s, and a plate of 1.5 g/cm^3, 2 mm thick, has 3 kg/m^2
    same = ls.load(LEAD_QUAD | {"throw": {"speed": "160.2 deg/s"}})
    box, wanted = parameter_box(scene).lo, parameter_box(same).lo
    assert box.kappa == pytest.approx(wanted.kappa, rel=1e-15)
    assert box.radius_of_gyration == pytest.approx(wanted.radius_of_gyration, rel=1e-15)


@pytest.mark.parametrize("model", [{}, {"model": {"flip": "energy"}}])
def test_a_scene_that_leaves_its_model_to_the_defaults_is_rechecked(tmp_path, model):
    proof = ls.certify(ls.load(LEAD_QUAD | model), ["goal"])
    (claim,) = proof.claims
    assert claim.verdict == "proved-on-cells"  # 22 % of the starts leave the arm
    report = ls.recheck(proof.save(tmp_path / "quad.proof.zip", recheck=False))
    assert report.verdict == "proved-on-cells"
    assert report.share == pytest.approx(claim.shares["share"], abs=1e-3)
    rng = np.random.default_rng(4)
    one, left = proof.scene, []
    for side, foot in enumerate(one.sides.a):
        ends = [ls.orbit(one.map, x, side, 300).stopped for x in rng.uniform(foot, one.arm_length, 200)]
        left += [end in ("inward", "outward") for end in ends]
    assert np.mean(left) >= claim.shares["leaves"] - 0.05
    flip = model.get("model", {}).get("flip", "signed")
    assert f"flight exact, flip {flip}" in report.relied_on[0]


@pytest.mark.sweep
def test_corners_and_masses_with_a_tolerance_are_rechecked(tmp_path):
    """The length of a side bends with its corners: an interval holds it narrower than a ball does."""
    tolerance = {"part.vertices[2].x": "0.3 mm", "throw.speed": "1.2 %", "part.mass.points[0].x": "1.2 mm"}
    proof = ls.certify(ls.load(LEAD_QUAD), ["goal"], tolerance=tolerance)
    assert [claim.verdict for claim in proof.claims] == ["proved-on-cells"]  # some starts leave, as above
    report = ls.recheck(proof.save(tmp_path / "quad.proof.zip", recheck=False))
    assert report.verdict == "proved-on-cells"
    assert report.share == pytest.approx(proof.claims[0].shares["share"], abs=1e-3)


def heavy(part, mass):
    """A quadrilateral in metres with one point of that mass [kg]: the moments are of the order of 1e-8 kg m^2."""
    tree = copy.deepcopy(part)
    tree["part"]["mass"]["points"][0]["mass"] = f"{mass!r} kg"
    return ls.load(tree)


def test_a_mass_known_to_a_tolerance_widens_the_part_by_what_it_moves(tmp_path):
    """The radius of gyration was enclosed from 0 on: a span of masses less itself stood for a moment of 0."""
    part = tomllib.loads("""
    part.vertices = [["0.00258 m", "0.00511 m"], ["-0.00415 m", "0.0012 m"],
                     ["-0.00066 m", "-0.00763 m"], ["0.00529 m", "-0.00786 m"]]
    part.mass.plate_density = "5 kg/m^2"
    part.mass.points = [{x = "0.00204 m", y = "-0.00142 m", mass = "0.00033 kg"}]
    arm = {surface_height = "-0.00031 m", length = "0.088 m"}
    throw.kappa = "0.06 m"
    """)
    masses = 0.00033 + 1e-6 * np.linspace(-1, 1, 41)
    scenes = [heavy(part, float(mass)) for mass in masses]
    numbers = np.array([[*s.sides.a, *s.sides.d, s.map.radius_of_gyration] for s in scenes])
    tree = copy.deepcopy(part)
    tree["part"]["mass"]["points"][0]["mass"] = ["0.000329 kg", "0.000331 kg"]
    lo, hi = parameter_box(scenes[20], tree=tree).bare
    wide = np.array([*(hi.a - lo.a), *(hi.d - lo.d), hi.radius_of_gyration - lo.radius_of_gyration])
    moved = np.ptp(numbers, axis=0)
    assert (wide >= moved - 1e-15).all()
    assert (wide <= 1.05 * moved + 0.05 * moved.max()).all()
    proof = ls.certify(scenes[20], ["invariant"], tolerance={"part.mass.points[0].mass": "0.000001 kg"})
    assert proof.proved
    assert ls.recheck(proof.save(tmp_path / "x.proof.zip", recheck=False)).verdict == "proved"


# ----------------------------------------------------------------
# Noise of the speed, the tilt and the landing place at every throw: what is proved, refuted, replayed and refused.
# The sharp margin of the landing place is that of the throw at 50 digits (tests/robust/test_margins.py).  That of the
# tilt follows from the one of the speed: either multiplies kappa.


SHARP_LANDING = 0.10595  # beyond 20 in only side 2

EVERYWHERE_INSIDE = ["goal", "invariant", "trapping", "expanding"]


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


def require_thrown(proof, word="goal"):
    """Throw a counterexample again at 50 digits, each throw as it says, and return its states."""
    states = counterexample(proof, word)
    assert [*thrown_again(states, reference.paper("designed"), 1e-11)]
    return states


# ---------------------------------------------------------------- the landing place


@pytest.mark.sweep
def test_the_landing_place_is_proved_below_its_margin(tmp_path):
    """That it is refuted above: tests/robust/test_margins.py."""
    proof = ls.certify(
        "paper-designed", EVERYWHERE_INSIDE, noise={"landing.x": f"{0.97 * SHARP_LANDING:.6f} in"}
    )
    # the goal for the starts in some cells: from the middle of the arm, too, such landings can lose a part at the joint
    assert verdicts(proof) == dict.fromkeys(EVERYWHERE_INSIDE, "proved") | {"goal": "proved-on-cells"}
    require_rechecked(proof, tmp_path)


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
    states = require_thrown(proof)[:-1]
    said = [state["parameters"] for state in states]
    tilts = [number(each["gravity.tilt"]) for each in said]
    assert 30 - float(degrees) <= min(tilts) < max(tilts) <= 30 + float(degrees)
    kappas = tilted_scene().kappa * np.sin(np.radians(tilts)) / 0.5
    assert [number(each["throw.kappa"]) for each in said] == pytest.approx(kappas, rel=1e-12)
    assert not any("landing.x" in each for each in said)


def spans(scene, noise):
    box = parameter_box(scene, noise=noise)
    return box.lo.kappa, box.hi.kappa


def test_noise_of_the_tilt_multiplies_kappa():
    by_kappa, by_speed = tilted_scene(), tilted_scene({"speed": "158.02 deg/s"})
    gravity = 9.80665 / 0.0254 / math.radians(158.02) ** 2
    units = ((by_kappa, by_kappa.kappa / 0.5), (by_speed, gravity))
    for text, dev in (("0.5 deg", 0.5), ("0.01 rad", math.degrees(0.01)), ("2 %", 0.6)):
        for scene, unit in units:
            for speed in (0.0, 0.01):
                noise = {"gravity.tilt": text} | ({"throw.speed": "1 %"} if speed else {})
                for kappa, sign in zip(spans(scene, noise), (-1, 1), strict=True):
                    tilted = unit * math.sin(math.radians(30 + sign * dev))
                    assert kappa == pytest.approx(tilted / (1 - sign * speed) ** 2, rel=1e-14)


def test_noise_about_a_tilt_that_is_not_known_is_farthest_out_at_the_smallest():
    scene = tilted_scene()
    tree = scene.as_dict() | {"gravity": {"tilt": ["20 deg", "40 deg"]}}
    for text, dev in (("0.5 deg", lambda t: 0.5), ("2 %", lambda t: 0.02 * t)):
        box = parameter_box(scene, tree=tree, noise={"gravity.tilt": text})
        ends = [(t, t + sign * dev(t)) for t in np.linspace(20, 40, 2001) for sign in (-1, 1)]
        ratios = [math.sin(math.radians(far)) / math.sin(math.radians(t)) for t, far in ends]
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
    said = [state["parameters"] for state in require_thrown(proof)[:-1]]
    shifts = {number(each["landing.x"]) for each in said}  # chosen anew at every throw
    assert max(map(abs, shifts)) <= 0.08
    assert len(shifts) > 1
    assert len({each["throw.kappa"] for each in said}) > 1
    end = counterexample(proof)[-1]
    assert (end["between"][0] > 20.0, end["side"] == 2) == (True, False)


IMPOSSIBLE = [
    ("paper-designed", "gravity.tilt", "1 deg", "give the scene"),
    ("acceleration", "gravity.tilt", "1 deg", r"noise of gravity\.tilt"),
    *(("tilt", "gravity.tilt", text, "from 0 to 90 degrees") for text in ("30 deg", "60 deg")),
    ("tilt", "gravity.tilt", "1 in", "dimension is wrong"),
    ("steep", "gravity.tilt", "2 %", "from 0 to 90 degrees"),
    ("tilt", "landing.x", "1 %", "% is a unit of share"),
    ("tilt", "landing.x", "1 deg", "dimension is wrong"),
    ("tilt", "landing.x", "-1 in", "landing.x"),
    *(
        ("tilt", name, "1 %", "throw.speed, gravity.tilt, landing.x")
        for name in ("arm.length", "throw.kappa")
    ),
]
GRAVITY = {
    "tilt": {"tilt": "30 deg"},
    "steep": {"tilt": "89 deg"},
    "acceleration": {"acceleration": "193.045 in/s^2"},
}


@pytest.mark.parametrize(("scene", "name", "text", "words"), IMPOSSIBLE, ids=str)
def test_noise_that_cannot_be(scene, name, text, words):
    if scene in GRAVITY:
        scene = ls.load(ls.load("paper-designed").as_dict() | {"gravity": GRAVITY[scene]})
    with pytest.raises(LimitsetsError, match=words):
        ls.certify(scene, noise={name: text})


def test_end_points_with_scattered_landings_are_undecided():
    proof = ls.certify("paper-designed", ["end-points"], noise={"landing.x": "0.01 in"})
    assert verdicts(proof) == {"end-points": "undecided"}
    assert "landing.x" in proof.claims[0].reason
