"""The checker on feeding: right sections are accepted, and none that has been made false.

Certificates come from `forge.py`, in plain floats and apart from the package.  What is true is known from the plain
throw: on paper-designed only side 2 comes to rest beyond 19 in, and every start does; beyond 20.5 in some never do.
"""

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

from tests.proofs import forge
from tests.proofs.test_recheck import COARSE, checker, verdict

CAVITY = {"width": "9.3 in", "depth": "5.8633 in", "angle": "32.23 deg"}
EVERY = {"side": 2, "safety": "every", "progress": {"starts": "every", "throws": 400}}
ALMOST = {"side": 2, "safety": "every", "almost": {"starts": "almost-every", "thinning": 200}}
SIDES = ("0", "1", "2")


@pytest.fixture(scope="module")
def good():
    return forge.forge("designed", **COARSE)


@pytest.fixture(scope="module")
def initial():
    return forge.forge("initial", **COARSE)


@pytest.fixture(scope="module")
def scattered():
    """Landings scatter by 0.02 in: parts near the joint may leave."""
    return forge.forge("designed", landing=0.02, first=0.1, ratio=0.006, widest=0.06)


def ending(good, section, x="19 in", **header):
    """The claim feeds alone, of an arm that ends at x."""
    f = good.copy()
    f.header["claims"] = [{"claim": "feeds", "section": section}]
    for box in f.header["boxes"]:
        box["scene"]["cavity"] = {"position": x} | CAVITY
    f.header |= header
    return f


def denied(f, tmp_path):
    """Whether nothing of it is confirmed, and the file can be read."""
    report = verdict(f, tmp_path)
    assert report.claims[0][:2] == ("feeds", "failed"), report.claims
    return report.reason


def fed(m, x_end, count=400, most=400, landing=0.0):
    """Random starts, the throws until they come to rest beyond the end, and the side; -1 for those that never do."""
    random = np.random.default_rng(8)
    side = random.integers(3, size=count)
    x = m.a[side] + (x_end - m.a[side]) * random.uniform(0.03, 1.0, count)
    start, on = (side.copy(), x.copy()), np.full(count, -1)
    throws = np.zeros(count, dtype=int)
    left = np.arange(count)
    for number in range(1, most):
        side, x, _ = forge.throw(m, side, x)
        x = x + landing * random.choice([-1.0, 1.0], x.size)
        beyond = x >= x_end
        on[left[beyond]], throws[left[beyond]] = side[beyond], number
        stays = ~beyond & (x > m.a[side])
        side, x, left = side[stays], x[stays], left[stays]
    return start, throws, on


# ------------------------------------------------------------------------------ what is accepted


def test_every_start_is_fed_on_side_2(good, tmp_path):
    report = verdict(ending(good, EVERY, "482.6 mm"), tmp_path)  # 19 in
    assert (report.verdict, report.reason) == ("proved", "")
    assert report.fed == {"safety": 1.0, "progress": 1.0}
    assert report.starts is None
    words = report.statement[0]
    assert words.splitlines()[0] == "feeds: the arm ends at x = 19 in"
    assert "every start a_i < x < 19 in on every side i, the first rest at x >= 19 in" in words
    assert "within 400 throws" in words
    assert not any("attracting cells" in line for line in report.statement)
    _, throws, on = fed(forge.Plain(forge.scene("designed")), 19.0)
    assert (on == 2).all()
    assert throws.max() <= 400


def test_beside_other_claims(good, tmp_path):
    f = ending(good, EVERY)
    f.header["claims"] += good.header["claims"]
    report = verdict(f, tmp_path)
    assert report.verdict == "proved"
    assert report.claims[0] == ("feeds", "proved", "")
    assert len(report.claims) == 6
    assert any("attracting cells" in line for line in report.statement)


def test_one_part_alone_is_not_the_whole(good, tmp_path):
    for part, left in (("progress", "safety"), ("safety", "progress")):
        report = verdict(ending(good, {"side": 2, part: EVERY[part]}), tmp_path)
        assert report.claims == [("feeds", "proved-on-cells", f"{left} is not claimed")]


@pytest.fixture(scope="module")
def never_fed(good):
    """A periodic orbit that stays before 20.5 in, and the largest x on it."""
    m = forge.Plain(forge.scene("designed"))
    for cycle in forge.cycles_of(m, forge.attracting(good), 6):
        lo, hi = (float.fromhex(end) for end in cycle["interval"])
        x, most = np.array([0.5 * (lo + hi)]), 0.0
        side = np.array([0])
        for _ in cycle["itinerary"]:
            most = max(most, float(x[0]))
            side, x, _ = forge.throw(m, side, x)
        if most < 20.4:
            return cycle, most
    raise AssertionError


@pytest.mark.sweep
def test_almost_every_start_is_fed_though_an_orbit_never_is(good, never_fed, tmp_path):
    cycle, _ = never_fed
    report = verdict(ending(good, ALMOST | {"never_fed": cycle}, "20.5 in"), tmp_path)
    assert (report.verdict, report.reason) == ("proved", "")
    assert report.fed == {"safety": 1.0, "almost": 1.0}
    assert "but for starts of total length zero" in report.statement[0]
    assert f"a periodic orbit, of {len(cycle['itinerary'])} throws" in report.statement[0]


def test_an_orbit_that_is_never_fed_alone_refutes(good, never_fed, tmp_path):
    cycle, _ = never_fed
    report = verdict(ending(good, {"side": 2, "safety": "every", "never_fed": cycle}, "20.5 in"), tmp_path)
    assert report.claims == [("feeds", "refuted", "")]


WRONG = {"start": {"x": (19.95).hex(), "side": 1}, "throws": [{"kappa": None, "landing": None}]}


def test_a_start_that_feeds_another_side_refutes(initial, tmp_path):
    m = forge.Plain(forge.scene("initial"))
    assert m.decision(1, np.array([19.95]), m.kappa)[0] < 0 < m.jog(1, np.array([19.95]), m.kappa)[0] - 20.0
    report = verdict(ending(initial, {"side": 2, "safety": "cells", "wrong": WRONG}, "20 in"), tmp_path)
    assert report.claims == [("feeds", "refuted", "")]
    _, _, on = fed(m, 20.0)
    assert report.fed["safety"] <= np.isin(on, [2, -1]).mean() + 0.03
    assert 0.0 < report.fed["safety"] < 0.5
    # what begins where the arm ends has come there
    at_end = WRONG | {"start": {"x": (19.5).hex(), "side": 1}}
    f = ending(initial, {"side": 2, "safety": "cells", "wrong": at_end}, "19.5 in")
    assert "beyond the end of the arm earlier" in denied(f, tmp_path)


def test_scattered_landings(scattered, tmp_path):
    """No start feeds another side, whether or not it leaves towards the joint; those from some x on are fed."""
    starts = {"from": dict.fromkeys(SIDES, (6.0).hex())}
    section = {"side": 2, "safety": "every", "progress": {"starts": starts, "throws": 400}}
    report = verdict(ending(scattered, section), tmp_path)
    assert report.claims[0][1] == "proved-on-cells"
    assert report.claims[0][2].startswith("progress is proved for 7")
    assert report.fed["safety"] == 1.0
    assert (scattered.arrays["0.rank"] < 0).any()
    (_, x), throws, on = fed(forge.Plain(forge.scene("designed")), 19.0, landing=0.02)
    assert set(on.tolist()) <= {2, -1}
    assert (on[x >= 6.0] == 2).all()
    assert throws[x >= 6.0].max() <= 400


@pytest.fixture
def made_up(scattered):
    """Cells and scene to which a made-up map is given."""
    import flint

    f = ending(scattered, {})
    names = ("jog", "flip", "branch", "rank", "component", "phi")
    edges = [f.arrays[f"0.edges.{i}"] for i in range(3)]
    with flint.ctx.workprec(checker.balls.PRECISION):
        scene = checker.scene.read_scene(f.header["boxes"][0]["scene"], f.header["noise"])
        yield checker.file.Cells(edges, *(f.arrays[f"0.{name}"] for name in names)), scene


def test_what_lands_before_the_first_cell_is_thrown_on(made_up):
    """All cells are thrown to a place of no harm, one that is near the first border to another side."""
    c, scene = made_up
    quiet, near, back = 400, 9, int(np.flatnonzero(c.rank >= 0)[0])
    c.jog[:], c.flip[:] = quiet, -1
    c.jog[near], c.jog[0], c.rank[0] = int(c.start[1]) - 1, [0, 0], -1
    bad, gaps = checker.feeding.unsafe_starts(checker.feeding.arm_end(c, scene), scene, 2)
    # parts of side 0 fall from cell 0 to before it, and are thrown from there to cells up to 0.02 in beyond its border
    assert c.edges[0][near] - c.edges[0][0] < 0.02
    assert gaps == [True, False, False]
    assert np.flatnonzero(bad).tolist() == [0, near]
    c.jog[near] = quiet
    c.jog[back + 200] = int(c.start[1]) - 1  # too far from the first border
    bad, gaps = checker.feeding.unsafe_starts(checker.feeding.arm_end(c, scene), scene, 2)
    assert not any(gaps)
    assert np.flatnonzero(bad).tolist() == [back + 200]


def test_what_may_leave_does_not_arrive(made_up):
    """All cells are thrown beyond the end but one, which is thrown to the first border, from where all are."""
    c, scene = made_up
    c.jog[:], c.flip[:], c.rank[:] = int(c.start[3]) - 5, -1, 0
    c.jog[40], c.rank[40] = [0, 0], -1
    c.jog[50] = 40
    end = checker.feeding.arm_end(c, scene)
    assert np.flatnonzero(checker.feeding.late_within(end, 9)).tolist() == [40, 50]
    assert np.flatnonzero(checker.feeding.cells_that_may_leave(end)).tolist() == [40, 50]


# ------------------------------------------------------------------------------ what is denied


SAFE = {"side": 2, "safety": "every"}


def from_on(x):
    return {"from": dict.fromkeys(SIDES, x.hex())}


# cells, section, end of the arm, header, and what is said
DENIED = {
    "another side": ("good", EVERY | {"side": 0}, "19 in", {}, "on another side"),
    "the other side": ("good", EVERY | {"side": 1}, "19 in", {}, "on another side"),
    # an orbit stays before 20.103 in: farther out some starts are never fed
    "a moved end": ("good", EVERY, "20.2 in", {}, "not proved to be enough"),
    "an end moved farther": ("good", EVERY, "21 in", {}, "not proved to be enough"),
    "an end that other sides pass": ("initial", SAFE, "20 in", {}, "on another side"),
    "fewer rounds of thinning": (
        "good", ALMOST | {"almost": {"starts": "almost-every", "thinning": 1}}, "20.5 in", {}, "thin out",
    ),
    # near the joint a throw of 0.02 in too short loses more than it gains, and the part comes to leave
    "near the joint": ("scattered", SAFE | {"progress": {"starts": from_on(4.5), "throws": 4000}}, "19 in", {}, ""),
    "almost, near it": ("scattered", SAFE | {"almost": {"starts": from_on(4.5), "thinning": 400}}, "19 in", {}, ""),
    "every start with noise": ("scattered", EVERY, "19 in", {}, "near the joint"),
    "almost every with noise": ("scattered", ALMOST, "19 in", {}, "near the joint"),
    "starts before the cells": (
        "scattered", {"side": 2, "progress": {"starts": from_on(0.5), "throws": 4000}}, "19 in", {}, "before the cells",
    ),
    "more noise of the speed": ("good", SAFE, "19 in", {"noise": {"throw.speed": "0.5 %"}}, ""),
    "more noise of landings": ("good", SAFE, "19 in", {"noise": {"landing.x": "0.05 in"}}, ""),
    "a tolerance": ("good", EVERY, "19 in", {"tolerance": {"throw.speed": "0 %"}}, "one scene"),
    "cells that end before the arm does": ("good", EVERY, "28 in", {}, "do not reach"),
    "the side it feeds": ("initial", {"side": 1, "safety": "cells", "wrong": WRONG}, "20 in", {}, "another side"),
}  # fmt: skip


@pytest.mark.parametrize("case", DENIED)
def test_what_is_not_proved_is_denied(request, tmp_path, case):
    cells, section, x, header, words = DENIED[case]
    assert words in denied(ending(request.getfixturevalue(cells), section, x, **header), tmp_path)


def test_almost_every_start_rests_on_what_holds_near_the_joint(good, tmp_path, monkeypatch):
    def denied_there(c, scene, cells, near):
        assert near
        raise checker.balls.UnprovedError("starts of length zero")

    monkeypatch.setattr(checker.feeding, "check_null", denied_there)
    assert "starts of length zero" in denied(ending(good, ALMOST, "20.5 in"), tmp_path)


def test_fewer_throws_than_some_start_takes(good, tmp_path):
    _, throws, _ = fed(forge.Plain(forge.scene("designed")), 19.0)
    few = {"starts": "every", "throws": int(throws.max()) - 1}
    assert "not proved to be enough" in denied(ending(good, EVERY | {"progress": few}), tmp_path)


def test_progress_of_every_start_where_an_orbit_stays(good, never_fed, tmp_path):
    cycle, _ = never_fed
    section = ALMOST | {"progress": EVERY["progress"], "never_fed": cycle}
    assert "not proved to be enough" in denied(ending(good, section, "20.5 in"), tmp_path)


def spoiled(f, name, cell, value):
    f = f.copy()
    f.arrays[name][cell] = value
    return f.seal()


def test_arrays_that_say_less_of_the_images(good, tmp_path):
    """A target left out, a flip left out, a bracket and a border moved."""
    f = ending(good, EVERY)
    jog, branch, phi = (f.arrays[f"0.{name}"] for name in ("jog", "branch", "phi"))
    wide = int(np.flatnonzero((jog[:, 1] > jog[:, 0]) & (branch == 0))[40])
    m, edges = forge.Plain(forge.scene("designed")), f.arrays["0.edges.0"]
    both = int(np.flatnonzero(np.diff(np.sign(m.decision(0, edges, m.kappa))))[0])
    assert edges[both + 1] < 19.0
    assert denied(spoiled(f, "0.jog", wide, [jog[wide, 0] + 1, jog[wide, 1]]), tmp_path)
    assert denied(spoiled(f, "0.jog", wide, [jog[wide, 0], jog[wide, 1] - 1]), tmp_path)
    assert denied(spoiled(f, "0.phi", wide, [phi[wide, 0], phi[wide].mean()]), tmp_path)
    one = spoiled(f, "0.flip", both, [-1, -1])
    assert denied(spoiled(one, "0.branch", both, 0), tmp_path)
    middle = f.arrays["0.edges.2"].size // 2
    assert denied(spoiled(f, "0.edges.2", middle, f.arrays["0.edges.2"][middle] + 0.03), tmp_path)


def test_a_cell_that_a_part_never_leaves(good, tmp_path):
    """Its own number left out of the targets of a cell that some part stays in: its image is not enclosed any more."""
    f = ending(good, EVERY, "20.5 in")
    inside = np.flatnonzero(f.arrays["0.component"] >= 0)
    fed_cells = int(f.arrays["0.jog"].max())
    for cell in inside[::40].tolist():
        f.arrays["0.jog"][cell] = np.where(f.arrays["0.jog"][cell] >= 0, fed_cells, -1)
    assert denied(f.seal(), tmp_path)


def test_cells_that_may_leave_and_are_said_not_to(scattered, tmp_path):
    """Without its rank of -1 a cell is claimed to be thrown into the cells, or to be fed."""
    f = ending(scattered, {"side": 2, "safety": "every"})
    cell = int(np.flatnonzero(f.arrays["0.rank"] < 0)[0])
    assert "is not proved to lie in" in denied(spoiled(f, "0.rank", cell, 0), tmp_path)


def test_an_orbit_that_is_fed(good, never_fed, tmp_path):
    """It comes to the end of an arm that is shorter than its farthest place."""
    cycle, most = never_fed
    f = ending(good, ALMOST | {"never_fed": cycle}, f"{most - 0.001:.4f} in")
    assert "may come to the end" in denied(f, tmp_path)


def test_an_orbit_lies_on_the_arm_that_reaches_beyond_it_and_on_no_shorter_one(good, never_fed):
    import flint

    cycle, most = never_fed
    raw = good.header["boxes"][0]["scene"]
    with flint.ctx.workprec(checker.balls.PRECISION):
        (orbit,) = checker.feeding.read_orbits({"cycles": [cycle], "complete": False}, 3)["orbits"]
        longer, shorter = (
            checker.scene.read_scene(raw | {"arm": raw["arm"] | {"length": f"{most + off:.4f} in"}}, None)
            for off in (0.001, -0.001)
        )
        assert len(checker.refutations.periodic(longer, orbit)) > len(cycle["itinerary"])
        with pytest.raises(checker.balls.UnprovedError, match="lie on the arm"):
            checker.refutations.periodic(shorter, orbit)


@pytest.mark.parametrize("change", ["interval", "itinerary", "multiplier", "side"])
def test_an_orbit_that_is_none(good, never_fed, tmp_path, change):
    cycle, _ = never_fed
    lo, hi = (float.fromhex(end) for end in cycle["interval"])
    word = cycle["itinerary"]
    changed = {
        "interval": [(lo + 0.01).hex(), (hi + 0.01).hex()],
        "itinerary": [1 - word[0], *word[1:]],
        "multiplier": [(float.fromhex(end) * 2.0).hex() for end in cycle["multiplier"]],
        "side": 1,
    }
    f = ending(good, ALMOST | {"never_fed": cycle | {change: changed[change]}}, "20.5 in")
    assert "an orbit: " in denied(f, tmp_path)


FORGED_WRONG = {
    "a start that is thrown elsewhere": {"start": {"x": (18.0).hex(), "side": 1}},
    "another side": {"start": {"x": (19.95).hex(), "side": 2}},
    "a start beyond the end": {"start": {"x": (20.05).hex(), "side": 1}},
    "a start off the arm": {"start": {"x": (1.0).hex(), "side": 1}},
    "another kappa": {"throws": [{"kappa": (40.0).hex(), "landing": None}]},
    "a landing that does not scatter": {"throws": [{"kappa": None, "landing": (0.5).hex()}]},
    "one more throw": {"throws": [{"kappa": None, "landing": None}] * 2},
}


@pytest.mark.parametrize("change", FORGED_WRONG.values(), ids=FORGED_WRONG)
def test_no_start_that_feeds_another_side(initial, tmp_path, change):
    section = {"side": 2, "safety": "cells", "wrong": WRONG | change}
    assert "an orbit: " in denied(ending(initial, section, "20 in"), tmp_path)


def test_a_throw_outside_the_noise(initial, tmp_path):
    """The same orbit with a kappa that differs by 1 % is one of noise of 0.6 % of the speed, and none of 0.3 %."""
    m = forge.Plain(forge.scene("initial"))
    kappa = m.kappa * 1.01
    x = np.array([19.95])
    assert m.decision(1, x, kappa)[0] < 0
    assert m.jog(1, x, kappa)[0] > 20.0
    thrown = [{"kappa": float(kappa).hex(), "landing": None}]
    section = {"side": 2, "wrong": WRONG | {"throws": thrown}}
    f = ending(initial, section, "20 in", noise={"throw.speed": "0.6 %"})
    f.header["boxes"][0]["parameters"]["kappa"] = forge.box(m.kappa / 1.006**2, m.kappa / 0.994**2)
    assert verdict(f, tmp_path).verdict == "refuted"
    f.header["noise"] = {"throw.speed": "0.3 %"}
    f.header["boxes"][0]["parameters"]["kappa"] = forge.box(m.kappa / 1.003**2, m.kappa / 0.997**2)
    assert "not within the noise" in denied(f, tmp_path)


BAD = {
    "no part": {"side": 2},
    "no side": {"side": 3, "safety": "every"},
    "a truth": {"side": True, "safety": "every"},
    "a share": EVERY | {"share": 1.0},
    "a verdict": EVERY | {"verdict": "proved"},
    "other starts": {"side": 2, "safety": "almost-every"},
    "starts of one side": {"side": 2, "progress": {"starts": {"from": {"0": (6.0).hex()}}, "throws": 9}},
    "almost every within some throws": {"side": 2, "progress": {"starts": "almost-every", "throws": 9}},
    "a number of throws that is none": {"side": 2, "progress": {"starts": "every", "throws": 9.0}},
    "no throws": {"side": 2, "progress": {"starts": "every"}},
    "an orbit without a start": {"side": 2, "wrong": {"throws": WRONG["throws"]}},
}


@pytest.mark.parametrize("section", BAD.values(), ids=BAD)
def test_a_section_that_cannot_be_read(good, tmp_path, section):
    assert verdict(ending(good, section), tmp_path).verdict == "bad file"


SCATTERS = {"effects": {"spread": "bounded"}, "world": {"scatter": {"landing": "0.02 in"}}}
OF_THE_SCENE = {  # what is changed in it, and what becomes of the file, why
    "another throw": ({"throw": {"kappa": "25.9 in"}}, "failed", ""),
    "no cavity": ({"cavity": None}, "failed", "no cavity"),
    "a spread that is not in the noise": (SCATTERS, "bad file", "not in the noise"),
    "a place without a unit": ({"cavity": CAVITY | {"position": "19"}}, "bad file", ""),
    "a place that is an interval": ({"cavity": CAVITY | {"position": ["18 in", "19 in"]}}, "bad file", ""),
    "no place": ({"cavity": CAVITY}, "bad file", "position missing"),
    "a place before the joint": ({"cavity": CAVITY | {"position": "-1 in"}}, "bad file", "above 0"),
    # what the cavity is like beyond the end is not claimed, but its keys are known
    "how a part tips": ({"cavity": CAVITY | {"position": "19 in", "tips": "rest"}}, "proved", ""),
    "a key that is not known": (
        {"cavity": CAVITY | {"position": "19 in", "tilts": "rest"}},
        "bad file",
        "unknown key",
    ),
}


@pytest.mark.parametrize("change", OF_THE_SCENE)
def test_another_scene(good, tmp_path, change):
    tables, expected, why = OF_THE_SCENE[change]
    f = ending(good, EVERY)
    f.header["boxes"][0]["scene"] |= tables
    report = verdict(f, tmp_path)
    assert report.verdict == expected
    assert why in report.reason
