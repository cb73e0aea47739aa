"""The checker on goals and on noise: right sections are accepted, and none that has been made false.

Certificates come from `forge.py`, in plain floats and apart from the package.  What is true is known from the tables
of `test_paper.py`, or sampled with the plain throw; a false section is one whose sentence does not hold.
"""

import math

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

from tests.proofs import forge
from tests.proofs.test_recheck import COARSE, checker, verdict


@pytest.fixture(scope="module")
def good():
    return forge.forge("designed", **COARSE)


def with_goal(good, section, **header):
    """The goal alone, claimed of every start unless it says another thing."""
    f = good.copy()
    own = {key: f.header["claims"][4]["section"][key] for key in ("starts", "near_joint")}
    own["starts"] = of_every(section)
    f.header["claims"] = [{"claim": "goal", "section": own | section}]
    f.header |= header
    return f


def of_every(section):
    """Word for a goal of every start, which is of almost every one where it speaks of almost every orbit."""
    return "almost-every" if section.get("every_orbit") is False else "every"


def reaches(x, every, throws, **more):
    return {"kind": "reaches", "x": f"{x} in", "side": 2, "every_orbit": every, "throws": throws} | more


ANYWHERE = {"from_anywhere": True}

TRUE = [
    {"kind": "oriented_beyond", "x": "27.5 in", "side": 2} | ANYWHERE,
    {"kind": "attracts_all"},
    {"kind": "attracts_all"} | ANYWHERE,
    {"kind": "stays_on_arm"},
    {"kind": "stays_on_arm"} | ANYWHERE,
    {"kind": "flip_order", "order": [0, 1, 2], "jogs": 20},
    {"kind": "flip_order", "order": [1, 2, 0], "jogs": 20} | ANYWHERE,
    reaches(19, True, 40),
    reaches(19, True, 2000) | ANYWHERE,
    reaches(22, False, 400),
    reaches(21, False, 400) | ANYWHERE,
]


@pytest.mark.parametrize("section", TRUE, ids=str)
def test_a_right_goal_is_proved(good, tmp_path, section):
    report = verdict(with_goal(good, section), tmp_path)
    assert (report.verdict, report.reason) == ("proved", "")
    assert report.claims == [("goal", "proved", "")]
    assert "every start a_i < x <= arm.length" in report.statement[0]
    assert (report.starts, report.share, report.open) == (of_every(section), 1.0, 0.0)


def test_almost_every_orbit_is_no_matter_of_every_start(good, tmp_path):
    for more in ({}, ANYWHERE):
        report = verdict(with_goal(good, reaches(21, False, 400) | more | {"starts": "every"}), tmp_path)
        assert report.verdict == "bad file"


# Landings from 28 in reach some 26 in on other sides; the limit set ends at 23.3832 in on side 2; an orbit of period 13
# never exceeds 20.103 in; from the inner end of side 2, at 8.9, it takes four jogs at least to 19 in.
FALSE = [
    ({"kind": "oriented_beyond", "x": "24 in", "side": 2} | ANYWHERE, "failed"),
    ({"kind": "oriented_beyond", "x": "20 in", "side": 2} | ANYWHERE, "failed"),
    ({"kind": "oriented_beyond", "x": "21 in", "side": 1} | ANYWHERE, "failed"),
    ({"kind": "oriented_beyond", "x": "19.7 in", "side": 2}, "failed"),
    ({"kind": "flip_order", "order": [0, 2, 1], "jogs": 20}, "failed"),
    ({"kind": "flip_order", "order": [0, 1], "jogs": 20}, "failed"),
    ({"kind": "flip_order", "order": [2], "jogs": 20}, "failed"),
    ({"kind": "flip_order", "order": [0, 1, 2], "jogs": 3}, "failed"),
    ({"kind": "flip_order", "order": [0, 1, 2, 0, 1, 2], "jogs": 20}, "failed"),
    (reaches(19, True, 3), "failed"),
    (reaches(20.2, True, 99_999), "failed"),
    (reaches(20.2, True, 99_999) | ANYWHERE, "failed"),
    (reaches(23.5, False, 5000), "failed"),
    (reaches(23.5, False, 5000) | ANYWHERE, "failed"),
    (reaches(19, False, 400) | {"side": 0, "x": "19.8 in"}, "failed"),
    (reaches(19, True, 40) | {"side": 3}, "bad file"),
    (reaches(19, True, 40) | {"side": True}, "bad file"),
    (reaches(19, True, -1), "bad file"),
    (reaches(19, True, 10**9), "bad file"),
    (reaches(19, 1, 40), "bad file"),
    (reaches(19, True, 40) | {"more": 1}, "bad file"),
    (reaches(19, True, 40) | {"order": [0]}, "bad file"),
    ({"kind": "attracts_all", "from_anywhere": "yes"}, "bad file"),
    ({"kind": "flip_order", "order": [0, 1, 3], "jogs": 20}, "bad file"),
    ({"kind": "flip_order", "order": [], "jogs": 20}, "bad file"),
    ({"kind": "flip_order", "order": {"0": 1}, "jogs": 20}, "bad file"),
    ({"kind": "oriented_beyond", "x": ["20 in", "21 in"], "side": 2}, "bad file"),
    ({"kind": ["reaches"]}, "failed"),
    ({"kind": "reach"}, "failed"),
    ({"kind": "reaches"}, "bad file"),
]


@pytest.mark.parametrize(("section", "want"), FALSE, ids=lambda value: str(value))
def test_a_false_goal_is_not_proved(good, tmp_path, section, want):
    report = verdict(with_goal(good, section), tmp_path)
    assert report.verdict == want
    assert report.reason
    assert "\n" not in report.reason


@pytest.mark.parametrize("section", [TRUE[0], TRUE[1], TRUE[4], TRUE[8], TRUE[10]], ids=str)
def test_a_goal_about_all_starts_needs_all_cells_and_the_joint(good, tmp_path, section):
    """What is spoiled off the attracting cells, or near the joint, fails it; of the attracting ones it would not."""
    off = np.flatnonzero(good.arrays["0.component"] < 0)
    f = with_goal(good, section)
    f.arrays["0.phi"][off[len(off) // 2], 1] *= 0.999
    assert verdict(f.seal(), tmp_path).verdict == "failed"
    f = with_goal(good, section)
    f.arrays["0.edges.1"][-1] *= 1 - 1e-9
    assert "end before arm.length" in verdict(f.seal(), tmp_path).reason
    f = with_goal(good, section)
    f.header["boxes"][0]["scene"]["arm"]["surface_height"] = "0.2 in"
    for pair in f.header["boxes"][0]["parameters"].values():
        for ends in pair if isinstance(pair[0], list) else [pair]:
            ends[:] = [(-1e3).hex(), (1e3).hex()]
    assert "near the joint" in verdict(f, tmp_path).reason
    inner = with_goal(good, {"kind": "stays_on_arm", "starts": "cells"})
    del inner.header["claims"][0]["section"]["near_joint"]
    inner.arrays["0.phi"][off[len(off) // 2], 1] *= 0.999
    inner.arrays["0.rank"][off] = -1
    report = verdict(inner.seal(), tmp_path)
    assert (report.verdict, report.starts) == ("proved-on-cells", "cells")


def test_what_becomes_of_other_starts_is_checked_where_only_attracting_cells_are_claimed(good, tmp_path):
    """Such files once printed that all other starts are lost, or creep to the joint, and counted them as explained."""
    cells = with_goal(good, reaches(22, False, 400) | {"starts": "cells"})
    assert verdict(cells, tmp_path).verdict == "proved-on-cells"
    creep = cells.copy()
    for each in creep.header["claims"][0]["section"]["near_joint"].values():
        each["fixed_point"] = [(24.0).hex(), (24.5).hex()]
    report = verdict(creep, tmp_path)
    assert (report.verdict, "the arm's surface is not above the joint" in report.reason) == ("failed", True)
    lost = cells.copy()
    section = lost.header["claims"][0]["section"]
    section["lost"] = dict.fromkeys(section.pop("near_joint"), (25.0).hex())
    report = verdict(lost, tmp_path)
    assert (report.verdict, "none of them are lost" in report.reason) == ("bad file", True)


def test_components_are_not_joined_by_their_number(good, tmp_path):
    """A cell that none of the others leads to is no part of their component, though mapped into it."""
    f = with_goal(good, {"kind": "attracts_all"})
    component, jog, flip = (f.arrays[f"0.{name}"] for name in ("component", "jog", "flip"))
    inside = component >= 0
    for cell in np.flatnonzero(~inside):
        targets = np.concatenate(
            [np.arange(first, last + 1) for first, last in (jog[cell], flip[cell]) if first >= 0]
        )
        if inside[targets].all():
            component[cell], f.arrays["0.rank"][cell] = component[inside][0], 0
            break
    report = verdict(f.seal(), tmp_path)
    assert "not of one component" in report.reason


# ---------------------------------------------------------------- noise


def test_scattered_landings_are_added_to_every_image(tmp_path):
    """A certificate made for 0.02 in is proved for it and for less, and never for much more, nor near the joint."""
    f = forge.forge("designed", landing=0.02, **COARSE)
    goal = f.header["claims"][4]["section"] | {"x": "20.6 in"}  # the cells are coarse
    f.header["claims"] = [{"claim": "invariant", "section": {}}, {"claim": "goal", "section": goal}]
    for dev in ("0.02 in", "0.508 mm"):
        f.header["noise"] = {"landing.x": dev}
        report = verdict(f, tmp_path)
        assert (report.verdict, report.reason) == ("proved", "")
        assert list(report.starts) == ["from"]
        assert 0.96 < report.share < report.share + report.explained < 1
    f.header["noise"] = {"landing.x": "0.01 in"}  # less noise does not lose so much
    assert "falls short is not proved" in verdict(f, tmp_path).reason
    lost = goal.pop("lost")  # what becomes of the starts nearer to the joint is not said
    report = verdict(f, tmp_path)
    assert report.verdict == "proved-on-cells"
    assert report.open > 0.02
    f.header["noise"] = {"landing.x": "0.2 in"}
    assert verdict(f, tmp_path).verdict == "failed"
    f.header["noise"] = {"landing.x": "0.02 in"}
    starts = {"starts": goal["starts"], "lost": lost}
    for section, want in (
        ({"kind": "stays_on_arm"} | ANYWHERE | {"starts": "every"}, "failed"),
        ({"kind": "stays_on_arm"} | ANYWHERE | starts, "bad file"),
        ({"kind": "stays_on_arm"} | starts, "proved"),
        ({"kind": "attracts_all"} | starts, "proved"),
    ):
        g = f.copy()
        g.header["claims"] = [{"claim": "goal", "section": section}]
        assert verdict(g, tmp_path).verdict == want


def test_images_without_scatter_do_not_hold_with_it(good, tmp_path):
    f = with_goal(good, {"kind": "stays_on_arm", "starts": "cells"}, noise={"landing.x": "0.2 in"})
    del f.header["claims"][0]["section"]["near_joint"]
    report = verdict(f, tmp_path)
    assert report.verdict == "failed"
    assert "is not proved to lie in" in report.reason
    borders = {end for side in range(3) for end in good.arrays[f"0.edges.{side}"].tolist()}
    assert {float(end) for end in report.reason.rpartition("(")[2].rstrip(")").split(", ")} <= borders


NO_NOISE = [({}, {}), ({"throw.kappa": "1 %"}, {}), ({"gravity.tilt": "1 deg"}, {})]
NO_NOISE += [({"landing.x": text}, {}) for text in ("1 %", "-1 in", ["0 in", "1 in"])]
NO_NOISE += [({"gravity.tilt": "1 deg"}, {"acceleration": "193.045 in/s^2"})]
NO_NOISE += [({"gravity.tilt": text}, {"tilt": "30 deg"}) for text in ("30 deg", "60 deg", "1 in", "100 %")]


@pytest.mark.parametrize(("noise", "gravity"), NO_NOISE, ids=str)
def test_noise_that_is_none_is_refused(good, tmp_path, noise, gravity):
    f = with_goal(good, {"kind": "stays_on_arm"}, noise=noise)
    f.header["boxes"][0]["scene"]["gravity"] = gravity
    assert verdict(f, tmp_path).verdict == "bad file"


def test_the_checker_s_kappa_with_noise_of_the_tilt():
    for text, dev in (("0.5 deg", 0.5), ("0.01 rad", math.degrees(0.01)), ("2 %", 0.6)):
        low, high = (math.sin(math.radians(30 + sign * dev)) / 0.5 for sign in (-1, 1))
        raw = forge.scene("designed")
        raw["gravity"] = {"tilt": "30 deg"}
        scene = checker.scene.read_scene(raw, {"gravity.tilt": text, "throw.speed": "1 %"})
        assert float(scene.k_lo) == pytest.approx(25.3778518 * low / 1.01**2, rel=1e-13)
        assert float(scene.k_hi) == pytest.approx(25.3778518 * high / 0.99**2, rel=1e-13)
        raw["throw"] = {"speed": "90 deg/s"}
        scene = checker.scene.read_scene(raw, {"gravity.tilt": text})
        unit = 9.80665 / 0.0254 * 0.5 / (math.pi / 2) ** 2
        assert float(scene.k_lo) == pytest.approx(unit * low, rel=1e-13)
        assert float(scene.k_hi) == pytest.approx(unit * high, rel=1e-13)
        assert all(not side.landing > 0 for side in scene.sides)


def test_near_the_joint_nothing_holds_with_scattered_landings():
    """q = 1 + 2 |h| / kappa = 1.01576 is the truth without them; with them a part thrown by less leaves inward."""
    for noise, proved in ((None, True), ({"landing.x": "0 in"}, True), ({"landing.x": "0.001 in"}, False)):
        scene = checker.scene.read_scene(forge.scene("designed"), noise)
        for side in scene.sides:
            edge = float(side.a.mid()) + 0.1
            near = checker.near_hinge.check_near_hinge, side, scene.k_lo, scene.k_hi, edge, 1.0157
            missing = checker.balls.reason_of(*near)
            assert (missing == "") == proved
            assert proved or "x <= a" in missing


# ---------------------------------------------------------------- arms of a tolerance


def test_what_lands_on_a_longer_arm_is_off_a_shorter_one(good, tmp_path):
    """Designed, from side 2 just below x = 20, a jog lands beyond x = 23.3 (docs/model.md): not on an arm of 22 in."""
    f = good.copy()
    f.header["boxes"][0]["scene"]["arm"]["length"] = ["22 in", "28 in"]
    f.header["boxes"][0]["parameters"]["arm_length"] = [(21.999).hex(), (28.001).hex()]
    f.header["tolerance"] = {"arm.length": "3 in"}
    report = verdict(f, tmp_path)
    assert report.verdict == "failed"
    assert {state for claim, state, _ in report.claims if claim in ("attracts-all", "trapping")} == {"failed"}
    # on arms from 24 in on everything stays
    f.header["boxes"][0]["scene"]["arm"]["length"] = ["24 in", "28 in"]
    f.header["boxes"][0]["parameters"]["arm_length"] = [(23.999).hex(), (28.001).hex()]
    f.header["tolerance"] = {"arm.length": "2 in"}
    invariant = [c for c in f.header["claims"] if c["claim"] in ("invariant", "trapping")]
    f.header["claims"] = invariant
    report = verdict(f, tmp_path)
    assert (report.verdict, report.reason) == ("proved", "")
