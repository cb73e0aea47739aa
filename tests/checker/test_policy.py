"""Certificates of policies: confirmed as they are written, and denied where a field says more than is true."""

import json
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.feeder.scene.surroundings import BeyondSensor, SideSensor
from limitsets.proofs.policies import Policy, broken, places
from limitsets.proofs.policies.simulation import not_within
from limitsets.proofs.policies.synthesis import write
from limitsets.proofs.prover.certificate import DeniedError
from tests.proofs.forge import leave_out, opened, put

BUILD = Path(__file__).resolve().parents[2] / "limitsets" / "checker" / "build.py"
FAST = "27.57073926 in"  # 110 % of the part's own speed: kappa over 1.21
FEW = {2: (17.0, 18.0)}
CAVITY = {"position": "20 in", "width": "9.3 in", "depth": "5.8633 in", "angle": "32.23 deg"}


def scene_with(name="paper-initial", *, fast=None, **tables):
    tree = ls.load(name).as_dict() | tables
    fast = {"kappa": FAST} if fast is None else fast
    tree["feedback"] = {
        "sensor": {"beyond": "20 in"},
        "throws": [{"name": "own", **tree["throw"]}, {"name": "fast", **fast}],
    }
    return ls.load(tree)


@cache
def policies():
    """Policies by name: asked "beyond 20 in?", with an error and noise, and of a side with a cavity that catches."""
    cells = {"starts": FEW, "cells": 256}
    return {
        "place": ls.feedback(scene_with(), **cells),
        "error": ls.feedback(scene_with(), BeyondSensor(19.0, 0.02), noise={"throw.speed": "0.1 %"}, **cells),
        "catch": ls.feedback(scene_with(cavity=CAVITY), SideSensor(2), mode="catch", starts=FEW, cells=512),
    }


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    """These policies and their certificates."""
    folder, found = tmp_path_factory.mktemp("policies"), policies()
    files = {name: each.save(folder / f"{name}.proof.zip") for name, each in found.items()}
    assert [ls.recheck(file).verdict for file in files.values()] == ["proved"] * 3
    return {name: (found[name], opened(file)) for name, file in files.items()}


def verdict_of(forged, tmp_path):
    report = ls.recheck(forged.seal().write(tmp_path / "forged.proof.zip"))
    return report.verdict, report.reason


# ------------------------------------------------------------------------------ as they are written


@pytest.mark.parametrize(
    ("sensor", "options"),
    [
        (None, {}),  # the policies of the study on one bit
        (SideSensor(2), {"mode": "catch"}),
        (None, {"starts": 16.0}),
        (SideSensor(2), {"starts": 16.0, "mode": "catch"}),
        (None, {"noise": {"throw.speed": "0.1 %"}}),
        (None, {"noise": {"landing.x": "0.005 in"}, "throws": 40}),
        (BeyondSensor(20.1), {"goal": (20.1, 2), "starts": FEW}),  # 20.1 is no float
        (BeyondSensor(19.0, 0.1), {"starts": FEW}),
    ],
)
def test_what_is_found_is_confirmed(tmp_path, sensor, options):
    found = ls.feedback(scene_with(), sensor, **{"cells": 1024} | options)
    assert found.solved
    assert broken(found.found.policy, found.game, found.starts.mask) == ""
    report = ls.recheck(found.save(tmp_path / "x.proof.zip"))
    assert (report.verdict, report.claims, report.reason) == ("proved", [("policy", "proved", "")], "")
    assert f"after {found.found.throws} throws at most" in report.statement[0]
    assert report.cells == found.grid.n_cells
    assert f"states of the policy: {found.found.policy.states}" in report.statement


def test_one_throw_by_hand(tmp_path):
    """From 19.4 and 19.5 on side 2 the part's own throw jogs beyond 20, as its map says, and not from 18."""
    scene = scene_with()
    beyond = [float(ls.orbit(scene.map, x, 2, 1).x[1]) >= 20.0 for x in (18.0, 19.4, 19.5)]
    assert beyond == [False, True, True]
    found = ls.feedback(scene, "none", starts={2: (19.4, 19.5)}, cells=128)
    file = found.save(tmp_path / "hand.proof.zip")
    report = ls.recheck(file)
    assert report.statement[0].endswith(
        "is brought to lie on side 2 at x >= 20 in, and the controller, which stops then, knows it, after 1 throws at"
        " most (an upper bound)"
    )
    assert report.statement[1:] == [
        "starts: side 2: [19.4000000, 19.5]",
        "throws to choose from: own: kappa = 33.3605945 in; fast: kappa = 27.57073926 in",
        "asked before the first throw and after each: nothing",
        "states of the policy: 2",
    ]
    forged = opened(file)
    begin, end = forged.arrays["edges.2"][0], forged.arrays["edges.2"][-1]
    assert begin < 18.0 < end
    forged.header["claims"][0]["section"]["starts"] = [[2, (18.0).hex(), (18.0).hex()]]
    offset = sum(forged.arrays[f"edges.{side}"].size - 1 for side in (0, 1))
    cell = offset + int(np.searchsorted(forged.arrays["edges.2"], 18.0, side="right")) - 1
    forged.arrays["belief"][0, 1:] = cell, cell
    cover = found.covers["own"]
    jog = offset + np.searchsorted(forged.arrays["edges.2"], [20.0, 28.0], side="right") - 1
    forged.arrays["0.jog"][cell] = jog[0], offset + forged.arrays["edges.2"].size - 2
    forged.arrays["0.phi"][cell] = cover.images[2].witness[:, cell - offset] * [1 - 1e-9, 1 + 1e-9]
    verdict, reason = verdict_of(forged, tmp_path)
    assert verdict == "failed"
    assert "the image of a jog" in reason


@pytest.mark.parametrize("name", ["paper-initial-small-angle", "by speed, metric", "scattered"])
def test_other_scenes(tmp_path, name):
    """Other formulas; throws given by their speed, in other units; noise that is the scene's own."""
    if name == "by speed, metric":
        tree = ls.load("paper-initial").as_dict()
        speed = {"throw": {"speed": "138 deg/s"}, "gravity": {"acceleration": "193.045 in/s^2"}}
        scene = scene_with(fast={"speed": "2.65 rad/s"}, **{"arm": tree["arm"]} | speed)
    elif name == "scattered":
        spread = {"effects": {"spread": "bounded"}, "world": {"scatter": {"speed": "0.05 %"}}}
        scene = scene_with(**spread)
    else:
        scene = scene_with(name, fast={"kappa": "70 in"})
    found = ls.feedback(scene, "none", goal=(20.0, 2), starts={2: (19.7, 19.75)}, cells=512, throws=8)
    assert found.solved
    report = ls.recheck(found.save(tmp_path / "x.proof.zip"))
    assert (report.verdict, report.reason) == ("proved", "")


def test_the_file_alone_confirms_it(tmp_path, known):
    file = known["error"][1].write(tmp_path / "noisy.proof.zip")
    subprocess.run([sys.executable, str(BUILD), str(tmp_path / "recheck.pyz")], check=True, cwd=tmp_path)
    command = [sys.executable, "-I", str(tmp_path / "recheck.pyz"), str(file), "--json"]
    answer = subprocess.run(command, check=False, capture_output=True, text=True, cwd=tmp_path)
    report = json.loads(answer.stdout)
    assert (answer.returncode, report["verdict"]) == (0, "proved")
    assert report["claims"] == [["policy", "proved", ""]]
    assert report["parameters"]["noise (at every throw)"] == "throw.speed within 0.1 %"


# ------------------------------------------------------------------------------ what a liar could change


AT = ("claims", 0, "section")
FEEDBACK = (*AT, "scene", "feedback")


def section_of(forged):
    return forged.header["claims"][0]["section"]


def state_that(forged, first=0):
    """A state with an answer that may come (by its number)."""
    good = (forged.arrays["throw"] >= 0) & (forged.arrays["after"][:, first] >= 0)
    return int(np.flatnonzero(good)[0])


def answered(forged):
    return state_that(forged, first=1), 1


def used_cell(forged):
    return int(np.flatnonzero(forged.arrays["0.jog"][:, 0] >= 0)[0])


def branching(forged):
    both = (forged.arrays["0.jog"][:, 0] >= 0) & (forged.arrays["0.flip"][:, 0] >= 0)
    return int(np.flatnonzero(both)[0])


def entry(name, at, value):
    """A change of an entry of an array; its place may be found in the file, its value be made of what is there."""

    def spoil(f):
        array, place = f.arrays[name], at(f) if callable(at) else at
        array[place] = value(array, place) if callable(value) else value

    return spoil


def turned(name, change):
    """Another array in place of one."""
    return lambda f: f.arrays.update({name: np.ascontiguousarray(change(f, f.arrays[name]))})


def the_throws_change_their_names(f):
    throws = section_of(f)["scene"]["feedback"]["throws"]
    throws[0]["kappa"], throws[1]["kappa"] = throws[1]["kappa"], throws[0]["kappa"]


def fewer_throws(f, left):
    """Fewer are said to be enough; and to be left in some states."""
    section_of(f)["within"] -= 1
    f.arrays["left"][left] -= 1


def the_states_go_round_with_even_counts(f):
    a_round = int(f.arrays["after"][0].max())
    f.arrays["after"][a_round, :] = 0
    f.arrays["left"][:] = f.arrays["left"][0]


def an_answer_before_the_first_throw_is_dropped(f):
    first = section_of(f)["first"]
    first[next(word for word, state in first.items() if state is not None)] = None


def it_stops_at_once(f):
    f.arrays["throw"][0], f.arrays["after"][0] = -1, -1


LIES = {  # in all three policies
    "a cell of the first belief is dropped": entry("belief", (0, 1), lambda a, k: a[k] + 1),
    "a belief is dropped": turned("belief", lambda f, a: a[a[:, 0] != int(f.arrays["after"][0].max())]),
    "a belief is moved": entry(
        "belief",
        lambda f: f.arrays["belief"][:, 0] == f.arrays["after"][0].max(),
        lambda a, k: a[k] + [0, 40, 40],
    ),
    "the throws change their names": the_throws_change_their_names,
    "another throw is made": entry("throw", state_that, lambda a, k: 1 - a[k]),
    "fewer throws are said to be enough": lambda f: fewer_throws(f, []),
    "fewer throws are left": lambda f: fewer_throws(f, 0),
    # nothing comes after the throw that catches the part: only its own count says that there is one
    "every count is one less": lambda f: fewer_throws(f, f.arrays["throw"] >= 0),
    "the states go round": entry("after", answered, lambda a, k: k[0]),
    "the states go round with even counts": the_states_go_round_with_even_counts,
    "the mode is the other one": lambda f: section_of(f).update(
        mode="catch" if section_of(f)["mode"] == "stop" else "stop"
    ),
    "an answer is dropped": entry("after", answered, -1),
    "an answer before the first throw is dropped": an_answer_before_the_first_throw_is_dropped,
    "answers are swapped": turned("after", lambda f, a: a[:, ::-1]),
    "it stops at once": it_stops_at_once,
    "an image is narrowed": entry("0.jog", used_cell, lambda a, k: a[k][0]),
    "a branch is denied": entry("0.flip", branching, -1),
    "a border is moved": entry(
        "edges.2",
        lambda f: np.searchsorted(f.arrays["edges.2"], 18.0),
        lambda a, k: 0.6 * a[k] + 0.4 * a[k + 1],
    ),
    "the speed of a throw is changed": put(*FEEDBACK, "throws", 0, "kappa", "33.4 in"),
    "no throw is left": entry("left", slice(None), 0),
    "the starts reach farther down": put(*AT, "starts", 0, 1, (16.9).hex()),
    "the starts reach farther up": put(*AT, "starts", 0, 2, (18.1).hex()),
    "the starts are on another side": lambda f: section_of(f)["starts"].append([1, *[(17.0).hex()] * 2]),
    "the starts leave the cells": put(*AT, "starts", 0, 2, (40.0).hex()),
    "the goal region is on another side": put(*AT, "goal", "side", 1),
    "noise of something else": lambda f: f.header.update(
        noise=(f.header["noise"] or {}) | {"landing.x": "0.01 in"}
    ),
    "an image is left out": entry("0.jog", used_cell, -1),
    "an image on no side": entry("0.jog", used_cell, (0, 10**6)),
    "an angle is moved": entry("0.phi", used_cell, lambda a, k: a[k] + 0.01),
    "the part is another one": put(*AT, "scene", "part", "mass", "center", "along", "4.1 in"),
    "the surface is higher": put(*AT, "scene", "arm", "surface_height", "-0.19 in"),
    "the arm is shorter": put(*AT, "scene", "arm", "length", "19 in"),
}
ONLY = [
    ("place", "the sensor stands farther out", put(*FEEDBACK, "sensor", "beyond", "20.1 in"), ""),
    ("place", "the sensor stands farther in", put(*FEEDBACK, "sensor", "beyond", "19.9 in"), ""),
    ("place", "the goal region begins farther out", put(*AT, "goal", "x", "20.5 in"), ""),
    ("error", "the sensor is worse", put(*FEEDBACK, "sensor", "error", "0.2 in"), ""),
    ("error", "more noise than was proved", put("noise", {"throw.speed": "0.3 %"}), ""),
    ("catch", "a wrong side is not caught on", put(*AT, "goal", "side", 1), "down on a wrong side"),
    ("catch", "starts are caught at once", put(*AT, "starts", 0, 2, (20.5).hex()), "caught at once"),
]


@pytest.mark.parametrize(
    ("name", "way", "spoil", "why"),
    [(name, way, LIES[way], "") for name in ("place", "error", "catch") for way in LIES] + ONLY,
)
def test_a_lie_is_denied(tmp_path, known, name, way, spoil, why):
    forged = known[name][1].copy()
    spoil(forged)
    verdict, reason = verdict_of(forged, tmp_path)
    assert verdict == "failed"
    assert reason.startswith("policy: ")
    assert why in reason


def test_where_it_is_caught_is_no_matter_of_choice(tmp_path, known):
    """The place is that of the scene's cavity; without one, a part is not caught at 20 in but at 25 in."""
    forged = known["catch"][1].copy()
    section_of(forged)["goal"]["x"] = "25 in"
    assert verdict_of(forged, tmp_path)[0] == "bad file"
    del section_of(forged)["scene"]["cavity"]
    verdict, reason = verdict_of(forged, tmp_path)
    assert verdict == "failed"
    assert "does not hold all that may be" in reason


def test_what_goes_on_for_ever_is_no_policy(tmp_path):
    """Every image holds: cells that the part's own throw maps into themselves, and a state that comes after itself."""
    found = ls.feedback(scene_with(), "none", cells=256, throws=1)  # from the limit set of its own throw
    assert not found.solved
    forever = Policy(
        answers=("",),
        throws=("own", "fast"),
        first=np.array([0]),
        belief=found.starts.mask[None],
        throw=np.array([0]),
        after=np.array([[0]]),
        left=np.array([1]),
    )
    file = write(tmp_path / "x.proof.zip", found, None, forever, recheck=False, workers=1)
    report = ls.recheck(file)
    assert report.verdict == "failed"
    assert report.reason == "policy: state 0: the number of throws left does not fall"


def test_what_is_weaker_is_still_true(tmp_path, known):
    """A better sensor, less noise, a larger count, fewer starts: no lies, and the words are those of the file."""
    forged = known["error"][1].copy()
    section_of(forged)["scene"]["feedback"]["sensor"]["error"] = "0.01 in"
    forged.header["noise"] = {"throw.speed": "0.08 %"}
    section_of(forged)["starts"][0][1] = (17.5).hex()
    report = ls.recheck(forged.seal().write(tmp_path / "weaker.proof.zip"))
    assert report.verdict == "proved"
    assert report.statement[1] == "starts: side 2: [17.5, 18]"
    assert "0.01 in" in report.statement[3]
    assert report.parameters["noise (at every throw)"] == "throw.speed within 0.08 %"


BAD = [  # where, what is written there (None: nothing), and what is said
    (("claims", 0, "verdict"), "proved", "unknown key verdict"),
    (("claims",), [{"claim": word, "section": {}} for word in ("policy", "invariant")], "claims of a policy"),
    (("boxes",), [{}], "no boxes"),
    (("tolerance",), {"throw.speed": "1 %"}, "no tolerance"),
    ((*AT, "mode"), "hold", "neither stop nor catch"),
    ((*AT, "within"), True, "not a number of throws"),
    ((*AT, "first"), {"yes": 0}, "no missing"),
    ((*AT, "first", "no"), "0", "no number of a state"),
    ((*AT, "starts"), [], "not a list of a fitting length"),
    ((*AT, "starts"), [[2, (18.0).hex(), (17.0).hex()]], "is empty"),
    ((*AT, "starts"), [[3, (17.0).hex(), (18.0).hex()]], "a side is not a number"),
    ((*AT, "goal", "x"), ["19 in", "20 in"], "not one number"),
    ((*AT, "scene", "goal"), {"stays_on_arm": True}, "a goal of its own"),
    (FEEDBACK, None, "no feedback"),
    ((*FEEDBACK, "throws"), [], "not a list of a fitting length"),
    ((*FEEDBACK, "throws", 1, "name"), "own", "two throws have one name"),
    ((*FEEDBACK, "throws", 1, "kappa"), ["27 in", "28 in"], "not one number"),
    ((*FEEDBACK, "throws", 1, "speed"), "170 deg/s", "either kappa or speed"),
    ((*FEEDBACK, "sensor"), None, "any missing"),
    ((*FEEDBACK, "sensor"), {"beyond": "20 in", "side": 2}, "two questions"),
    ((*FEEDBACK, "sensor"), {"error": "1 in"}, "asks nothing"),
    ((*FEEDBACK, "sensor", "error"), "-0.1 in", "negative"),
    (("scene", "flight"), "small-angle", "different models"),
]
ARRAYS = [  # which array, its change, what becomes of the file, and what is said
    ("throw", lambda a: a[:-1], "bad file", ""),
    ("left", lambda a: a[:0], "bad file", ""),
    ("after", lambda a: a[:, :1], "bad file", ""),
    ("belief", lambda a: a.astype(np.int64), "bad file", ""),
    ("0.phi", lambda a: a[:-1], "bad file", ""),
    ("edges.0", lambda a: a[::-1], "bad file", ""),
    ("more", lambda _: np.zeros(3), "bad file", ""),
    ("throw", lambda a: np.where(a == 0, 2, a), "failed", "none of those to choose from"),
    ("throw", lambda a: np.where(a == 0, -2, a), "failed", "none of those to choose from"),
    ("after", lambda a: np.where(a == 1, 10**6, a), "failed", "a next state is none"),
    ("left", lambda a: a - 30, "failed", "negative"),
    ("belief", lambda a: a[::-1], "failed", "order of the states"),
    ("belief", lambda a: a + np.array([1000, 0, 0]), "failed", "no state"),
    ("belief", lambda a: a + np.array([0, 0, 10**6]), "failed", "cells that are none"),
    ("belief", lambda a: a * [1, 1, -1], "failed", "cells that are none"),
]


def in_place_of(name, change, verdict):
    """Another array; one of numbers of nothing keeps its type."""

    def spoil(f):
        array = change(f.arrays.get(name))
        f.arrays[name] = np.ascontiguousarray(array, np.int32 if verdict == "failed" else None)

    return spoil


@pytest.mark.parametrize(
    ("spoil", "verdict", "reason"),
    [
        *((leave_out(*at) if new is None else put(*at, new), "bad file", why) for at, new, why in BAD),
        *((in_place_of(name, change, verdict), verdict, why) for name, change, verdict, why in ARRAYS),
    ],
)
def test_what_is_no_policy(tmp_path, known, spoil, verdict, reason):
    forged = known["place"][1].copy()
    spoil(forged)
    found, why = verdict_of(forged, tmp_path)
    assert found == verdict
    assert reason in why


# ------------------------------------------------------------------------------ writing


def test_nothing_is_written_without_a_policy_or_of_effects(tmp_path):
    found = ls.feedback(scene_with(), "none", starts=FEW, cells=64, throws=1)
    with pytest.raises(AnswerError, match="not-solved"):
        found.save(tmp_path / "x.proof.zip")
    scene = scene_with(effects={"landing": True}, world={"friction": 0.3, "restitution": 0.1})
    found = ls.feedback(scene, "none", starts={2: (19.4, 19.5)}, cells=128)
    assert found.solved
    with pytest.raises(AnswerError, match="with effects"):
        found.save(tmp_path / "x.proof.zip")
    assert not list(tmp_path.iterdir())


def test_a_policy_that_is_denied_is_not_decided(tmp_path, monkeypatch):
    from limitsets.proofs.policies import synthesis as writing

    right = writing.brackets
    monkeypatch.setattr(writing, "brackets", lambda cover: right(cover) * [0.999, 0.9995])
    found = ls.feedback(scene_with(), starts=FEW, cells=256)
    with pytest.raises(DeniedError, match="phi") as denied:
        found.save(tmp_path / "x.proof.zip")
    assert [path.name for path in tmp_path.iterdir()] == ["x.denied.zip"]
    left = found.denied(denied.value.claims["policy"])
    assert (left.found.verdict, left.found.policy, left.solved) == ("not-decided", None, False)
    assert "the checker denies it" in left.found.reason


def test_a_cavity_is_where_parts_are_caught():
    scene = scene_with(cavity=CAVITY | {"position": "20.5 in"})
    with pytest.raises(AnswerError, match=r"caught is 20\.0.*20\.5 in, where the arm ends"):
        ls.feedback(scene, SideSensor(2), mode="catch", starts=FEW, cells=64)
    found = ls.feedback(scene, SideSensor(2), mode="catch", goal=(20.5, 2), starts=FEW, cells=64, throws=1)
    assert found.goal == (20.5, 2)
    assert ls.feedback(scene, starts=FEW, cells=64, throws=1).goal == (20.0, 2)  # nothing is caught in stop


@pytest.mark.sweep
def test_other_sensors_on_the_same_images():
    """`places` and `asking` find what `feedback` finds with the same borders of cells."""
    sensors = [BeyondSensor(x, 0.05) for x in (18.0, 20.0)]
    cuts = [cut for each in sensors for cut in each.cuts]
    tried = places(scene_with(), [18.0, 20.0], error=0.05, starts=FEW, cells=256)
    for sensor, each in zip(sensors, tried, strict=True):
        alone = ls.feedback(scene_with(), sensor, starts=FEW, cells=256, cuts=cuts)
        assert each.sensor == sensor
        assert (each.found.verdict, each.found.throws) == (alone.found.verdict, alone.found.throws)
    assert tried[1].covers is tried[0].covers
    assert places(scene_with(), []) == ()


def test_single_starts_bound_what_the_certificate_claims(known):
    """No policy of fewer throws than two serves these starts: the count of the certificate is not below it."""
    found, forged = known["place"]
    shown = not_within(found, [(17.0, 2), (17.5, 2), (17.9, 2)], 3)
    assert 0 <= shown.throws < section_of(forged)["within"]
