"""A tolerance in each quantity: proved, and proved again by the lone checker, which halves quantities to see it.

Where the goal x > 20 in fails for a corner of a wider tolerance is found apart, by long orbits of the plain throw.
"""

import copy
import json
import zipfile
from fractions import Fraction

import numpy as np
import pytest

import limitsets as ls
from limitsets.proofs.prover.parameters import parameter_box

pytest.importorskip("flint", reason="the checker needs python-flint")

from tests.lead_quad import LEAD_QUAD
from tests.proofs import forge
from tests.proofs.test_recheck import checker, verdict

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
    report = ls.recheck(proof.save(tmp_path / "x.proof.zip"))
    assert report.reason == ""
    assert report.claims == [("attracts-all", "proved", ""), ("goal", "proved", "")]


@pytest.mark.sweep
@pytest.mark.parametrize("name", ["arm.surface_height", "part.mass.center.along"])
def test_above_the_joint_too(tmp_path, name):
    scene = ls.load("paper-designed").with_values({"arm.surface_height": 0.1})
    proof = ls.certify(scene, ["attracts-all"], tolerance={name: "0.02 in"})
    assert proof.proved
    report = ls.recheck(proof.save(tmp_path / "x.proof.zip"))
    assert (report.verdict, report.reason) == ("proved", "")


def test_two_quantities_at_once(tmp_path):
    wide = {"arm.surface_height": "0.01 in", "part.mass.center.along": "0.02 in"}
    proof = ls.certify("paper-designed", tolerance=wide)
    assert proof.proved
    assert ls.recheck(proof.save(tmp_path / "x.proof.zip")).verdict == "proved"


@pytest.mark.sweep
@pytest.mark.parametrize(
    ("name", "width"), [("part.mass.center.along", "0.16 in"), ("arm.surface_height", "0.08 in")]
)
def test_a_tolerance_too_wide_is_refuted(name, width):
    """At one end of it parts come beyond 20 in on other sides than 2."""
    number = float(width.split()[0])
    farthest = 0.0
    for sign in (-1, 1):
        data = forge.scene("designed")
        place = {"part.mass.center.along": data["part"]["mass"]["center"], "arm.surface_height": data["arm"]}[
            name
        ]
        key = name.split(".")[-1]
        place[key] = f"{float(place[key].split()[0]) + sign * number!r} in"
        m, x, side = forge.Plain(data), 15.0, 0
        for k in range(2_000):
            R = np.array([x])
            flips = m.decision(side, R, m.kappa)[0] > 0
            x = float((m.flip if flips else m.jog)(side, R, m.kappa)[0])
            side = (side + int(flips)) % 3
            farthest = max(farthest, x) if k > 100 and side != 2 else farthest
    assert farthest > 20.001
    proof = ls.certify("paper-designed", ["goal"], tolerance={name: width})
    assert proof.claims[0].verdict == "refuted"


# ---------------------------------------------------------------- the checker's halves


@pytest.fixture(scope="module")
def proved(tmp_path_factory):
    proof = ls.certify("paper-designed", tolerance={"arm.surface_height": "0.026 in"})
    return proof.save(tmp_path_factory.mktemp("wide") / "x.proof.zip")


def reread(path):
    """A certificate as one that can be spoiled."""
    header, entries = checker.file.open_certificate(path)
    said = header["arrays"]
    arrays = {
        key: checker.file.read_array(
            entries[f"{key}.npy"], key, about["dtype"], (about["shape"] + [1])[1], about
        )
        for key, about in said.items()
    }
    return forge.Forged(header, arrays)


def test_a_wider_interval_than_was_proved_is_not_believed(proved, tmp_path):
    f = reread(proved)
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

    def ends(piece, name):
        value = dict(checker.scene.quantities(piece.raw))[name]
        q = checker.file.quantity(value, "length", name)
        return q.lo / checker.file.INCH, q.hi / checker.file.INCH

    names = ("part.mass.center.along", "part.sides[0]", "arm.surface_height")
    volume = sum(np.prod([float(hi - lo) for lo, hi in (ends(p, n) for n in names)]) for p in pieces)
    assert volume == pytest.approx(0.05 * 0.02 * 0.0002, rel=1e-12)
    rng = np.random.default_rng(4)
    for _ in range(200):
        along, base = rng.uniform(4.2, 4.25), rng.uniform(5.74, 5.76)
        mine = [
            p for p in pieces
            if ends(p, names[0])[0] <= Fraction(along) <= ends(p, names[0])[1]
            and ends(p, names[1])[0] <= Fraction(base) <= ends(p, names[1])[1]
        ]  # fmt: skip
        assert mine
        one = copy.deepcopy(raw)
        one["part"]["mass"]["center"]["along"] = f"{along!r} in"
        forge_lengths, forge.LENGTHS = forge.LENGTHS, (base, 3.6, 6.75)
        try:
            one["arm"]["surface_height"] = "-0.2 in"
            m = forge.Plain(one)
        finally:
            forge.LENGTHS = forge_lengths
        for piece in mine:
            for a, d, s in zip(m.a, m.d, piece.sides, strict=True):
                assert float(s.a.lower()) - 1e-12 <= a <= float(s.a.upper()) + 1e-12
                assert float(s.d.lower()) - 1e-12 <= d <= float(s.d.upper()) + 1e-12


OTHER_UNITS = {
    "part": {
        "vertices": [["0 mm", "0 mm"], ["130000 \u00b5m", "0 mm"], ["150 mm", "70 mm"], ["30 mm", "100 mm"]],
        "mass": {
            "plate_density": "1.5 g/cm^3",
            "plate_thickness": "2000 \u03bcm",
            "points": [{"x": "110 mm", "y": "15 mm", "mass": "60000 mg"}],
        },
    },
    "arm": {"surface_height": "-15000 \u00b5m", "length": "700 mm"},
    "throw": {"speed": " 26.7   rpm"},
    "gravity": {"tilt": "30\u00b0"},
    "world": {"stroke": "5 \u00b0"},
}


@pytest.mark.parametrize(
    ("tolerance", "noise"),
    [
        (None, None),
        ({"throw.speed": "0.05 deg/s", "arm.surface_height": "5 \u00b5m"}, None),
        (None, {"throw.speed": "0.01 rpm", "gravity.tilt": "0.01\u00b0"}),
    ],
)
def test_a_scene_in_the_units_of_other_workshops_is_rechecked(tmp_path, tolerance, noise):
    scene = ls.load(LEAD_QUAD | OTHER_UNITS)
    proof = ls.certify(scene, ["invariant"], tolerance=tolerance, noise=noise)
    assert proof.proved
    path = proof.save(tmp_path / "quad.proof.zip")
    report = ls.recheck(path)
    assert (report.verdict, report.reason) == ("proved", "")
    with zipfile.ZipFile(path) as file:
        header = json.loads(file.read("header.json"))
    assert json.dumps(header, ensure_ascii=False).isascii()
    # 26.7 rpm is 160.2 deg/s, and a plate of 1.5 g/cm^3, 2 mm thick, has 3 kg/m^2
    same = ls.load(LEAD_QUAD | {"throw": {"speed": "160.2 deg/s"}})
    box, wanted = parameter_box(scene).lo, parameter_box(same).lo
    assert box.kappa == pytest.approx(wanted.kappa, rel=1e-15)
    assert box.radius_of_gyration == pytest.approx(wanted.radius_of_gyration, rel=1e-15)


@pytest.mark.parametrize("model", [{}, {"model": {"flight": "exact"}}, {"model": {"flip": "energy"}}])
def test_a_scene_that_leaves_its_model_to_the_defaults_is_rechecked(tmp_path, model):
    proof = ls.certify(ls.load(LEAD_QUAD | model), ["goal"])
    (claim,) = proof.claims
    assert claim.verdict == "proved-on-cells"  # 22 % of the starts leave the arm
    report = ls.recheck(proof.save(tmp_path / "quad.proof.zip"))
    assert report.verdict == "proved-on-cells"
    assert report.share == pytest.approx(claim.shares["share"], abs=1e-3)
    rng = np.random.default_rng(4)
    one, left = proof.scene, []
    for side, foot in enumerate(one.sides.a):
        ends = [ls.orbit(one.map, x, side, 300).stopped for x in rng.uniform(foot, one.arm_length, 500)]
        left += [end in ("inward", "outward") for end in ends]
    assert np.mean(left) >= claim.shares["leaves"] - 0.05
    flip = model.get("model", {}).get("flip", "signed")
    assert f"flight exact, flip {flip}" in report.relied_on[0]


@pytest.mark.sweep
def test_corners_and_masses_with_a_tolerance_are_rechecked(tmp_path):
    """The length of a side bends with its corners: an interval holds it narrower than a ball does."""
    tolerance = {
        "part.vertices[2].x": "0.3 mm",
        "throw.speed": "1.2 %",
        "part.mass.points[0].x": "1.2 mm",
    }
    proof = ls.certify(ls.load(LEAD_QUAD), ["goal"], tolerance=tolerance)
    assert [claim.verdict for claim in proof.claims] == ["proved-on-cells"]  # some starts leave, as above
    report = ls.recheck(proof.save(tmp_path / "quad.proof.zip"))
    assert report.verdict == "proved-on-cells"
    assert report.share == pytest.approx(proof.claims[0].shares["share"], abs=1e-3)


def heavy(part, mass):
    """A quadrilateral in metres with one point of that mass [kg]: the moments are of the order of 1e-8 kg m^2."""
    tree = copy.deepcopy(part)
    tree["part"]["mass"]["points"][0]["mass"] = f"{mass!r} kg"
    return ls.load(tree)


def test_a_mass_known_to_a_tolerance_widens_the_part_by_what_it_moves(tmp_path):
    """The radius of gyration was enclosed from 0 on: a span of masses less itself stood for a moment of 0."""
    part = {
        "part": {
            "vertices": [
                ["0.00258 m", "0.00511 m"], ["-0.00415 m", "0.0012 m"],
                ["-0.00066 m", "-0.00763 m"], ["0.00529 m", "-0.00786 m"],
            ],
            "mass": {
                "plate_density": "5 kg/m^2",
                "points": [{"x": "0.00204 m", "y": "-0.00142 m", "mass": "0.00033 kg"}],
            },
        },
        "arm": {"surface_height": "-0.00031 m", "length": "0.088 m"},
        "throw": {"kappa": "0.06 m"},
    }  # fmt: skip
    masses = 0.00033 + 1e-6 * np.linspace(-1, 1, 41)
    scenes = [heavy(part, float(mass)) for mass in masses]
    numbers = np.array([[*s.sides.a, *s.sides.d, s.map.radius_of_gyration] for s in scenes])
    tree = copy.deepcopy(part)
    tree["part"]["mass"]["points"][0]["mass"] = ["0.000329 kg", "0.000331 kg"]
    lo, hi = parameter_box(scenes[20], tree=tree).bare
    wide = np.array(
        [
            *(hi.a - lo.a),
            *(hi.d - lo.d),
            hi.radius_of_gyration - lo.radius_of_gyration,
        ]
    )
    assert (wide >= np.ptp(numbers, axis=0) - 1e-15).all()
    moved = np.ptp(numbers, axis=0)
    assert (wide <= 1.05 * moved + 0.05 * moved.max()).all()
    proof = ls.certify(scenes[20], ["invariant"], tolerance={"part.mass.points[0].mass": "0.000001 kg"})
    assert proof.proved
    assert ls.recheck(proof.save(tmp_path / "x.proof.zip", recheck=False)).verdict == "proved"
