"""Certificates of scenes in version 3 of the format, which is closed, and in version 2, which is read as the same."""

from dataclasses import asdict

import pytest

pytest.importorskip("flint", reason="the checker needs python-flint")

from limitsets.checker.file import BadFileError
from limitsets.checker.scene import read_scene
from tests.checker.test_false_sentences import chances, one_throw
from tests.proofs import forge
from tests.proofs.forge import leave_out, put
from tests.proofs.test_recheck import COARSE, verdict


@pytest.fixture(scope="module")
def good():
    return forge.forge("small", **COARSE)


def twice(number):
    """A claim made again."""
    return lambda f: f.header["claims"].append(f.header["claims"][number])


def beside(name):
    """An array more, like the ranks."""
    return lambda f: f.arrays.update({name: f.arrays["0.rank"]})


def unknown_twice(f):
    f.header["claims"] += [{"claim": "mixing", "section": {}}] * 2


def world(**facts):
    """Facts that the scene states."""
    return put("boxes", 0, "scene", "world", facts)


ODD = {  # what is changed, and what the reason names
    "a key more": (put("state", "x [in]"), "unknown key state"),
    "no noise": (leave_out("noise"), "noise missing"),
    "a map beside the scene": (put("map", {"flight": "exact", "flip": "signed"}), "goal, plane missing"),
    "a map in place of the scene": (
        lambda f: f.header.update(map=f.header.pop("scene")),
        "goal, plane missing",
    ),
    "neither a map nor a scene": (leave_out("scene"), "scene missing"),
    "a key more in the scene": (put("scene", "name", "throw"), "scene: unknown key name"),
    "a key less in the scene": (leave_out("scene", "flip"), "scene: flip missing"),
    "a scene that is no table": (put("scene", "exact"), "scene is not an object"),
    "another model": (put("scene", "flight", "exact"), "different models"),
    "a key more in a box": (put("boxes", 0, "note", ""), "a box: unknown key note"),
    "a key more in the parameters": (put("boxes", 0, "parameters", "c", ["0", "0"]), "unknown key c"),
    "a key more in a claim": (put("claims", 1, "note", ""), "a claim: unknown key note"),
    "a key less in a claim": (leave_out("claims", 1, "section"), "section missing"),
    "a key more in a section": (put("claims", 1, "section", {"x": 1}), "section of invariant: unknown key x"),
    "a claim made twice": (twice(1), "made twice"),
    "an unknown claim made twice": (unknown_twice, "made twice"),
    "nothing claimed": (put("claims", []), "claims is not a list of a fitting length"),
    "claims in a table": (put("claims", {"invariant": {}}), "claims is not a list of a fitting length"),
    "a scene with a misspelt table": (put("boxes", 0, "scene", "gravty", {}), "scene: unknown key gravty"),
    "a fact that is misspelt": (world(frction=0.3), "scene.world: unknown key frction"),
    "scatter that is misspelt": (world(scater={"speed": "1 %"}), "scene.world: unknown key scater"),
    "other facts that are no table": (world(other=["lost"]), "scene.world.other is not an object"),
    "other facts of null": (world(other=None), "scene.world.other is not an object"),
    "a known fact among others": (world(other={"friction": 0.3}), "friction is no name of another fact"),
    "scatter among others": (world(other={"scatter": 0.3}), "scatter is no name of another fact"),
    "others among others": (world(other={"other": 0.3}), "other is no name of another fact"),
    "a fact with an odd name": (world(other={"no. PROVED": 1}), "no. PROVED is no name of another fact"),
    "a fact with a line in its name": (world(other={"lost\n": 1}), "lost? is no name of another fact"),
    "a fact without a name": (world(other={"": 1}), " is no name of another fact"),
    "another fact in no unit": (world(other={"creep": "1 parsec"}), "parsec is not a unit of"),
    "another fact in words": (world(other={"creep": "much"}), "much is not a decimal number and a unit"),
    "another fact that is true": (world(other={"creep": True}), "True is not a decimal number and a unit"),
    "another fact that is a table": (world(other={"creep": {}}), "creep: {} is not a decimal number"),
    "an array of no box": (beside("1.rank"), "arrays that no claim needs"),
    "an array more in a box": (beside("0.exit"), "arrays that no claim needs"),
    "version 4": (put("version", 4), "not limitsets-proof, version 2 or 3"),
    "no version": (leave_out("version"), "not limitsets-proof, version 2 or 3"),
    "version 1": (put("version", 1), "version 1 of the format is not read any more: prove the scene again"),
    "version 2": (put("version", 2), "header.json: map missing"),
}


def test_an_array_in_the_file_alone_is_refused(good, tmp_path):
    spoiled = good.copy()
    beside("0.exit")(spoiled)
    report = verdict(spoiled, tmp_path)  # which the header does not describe
    assert report.verdict == "bad file"
    assert "arrays.npz holds entries that no claim needs" in report.reason


def test_other_facts_are_named_and_change_nothing(good, tmp_path):
    plain, more = verdict(good, tmp_path), good.copy()
    world(friction=0.3, other={"lost": 0.1, "creep": "1e-3 in", "b2": 1})(more)
    report = verdict(more.seal(), tmp_path)
    assert report.model["left_out"] == ["friction", "lost", "creep", "b2"]
    assert plain.model["left_out"] == []
    assert (report.verdict, report.claims) == (plain.verdict, plain.claims)
    assert report.verdict == "proved"


def test_whoever_reads_a_scene_refuses_odd_facts():
    """Not the report alone."""
    with pytest.raises(BadFileError, match="scatter is no name of another fact"):
        read_scene(forge.scene("small") | {"world": {"other": {"scatter": 0.3}}}, None)


def alike(certificate, tmp_path):
    """What is reported of a certificate, which is the same where it is of version 2."""
    reports = [asdict(verdict(each, tmp_path)) for each in (certificate, forge.of_version_2(certificate))]
    for report in reports:
        del report["seconds"]
    assert reports[0] == reports[1]
    return reports[0]


def test_version_2_is_read_as_version_3(good, tmp_path):
    assert alike(good, tmp_path)["verdict"] == "proved"
    false = good.copy()
    false.header["claims"][0]["section"]["max_rank"] -= 1
    assert alike(false.seal(), tmp_path)["verdict"] == "failed"
    assert alike(one_throw("4 in", 4.0), tmp_path)["verdict"] == "failed"
    none_of_all = chances([[2, "15 in", "16 in"]], 18.0, {"right": [[0.0, 1.0]]})
    assert alike(none_of_all, tmp_path)["verdict"] == "proved"


OLD = {  # of version 2: what is changed, and what the reason names
    "a scene beside the map": (
        put("scene", {"flight": "small-angle", "flip": "energy"}),
        "unknown key scene",
    ),
    "a key more in the map": (put("map", "note", ""), "map: unknown key note"),
    "a key less in the map": (leave_out("map", "flip"), "map: flip missing"),
    "another map": (put("map", "name", "logistic"), "not throw, version 1"),
    "another version of the map": (put("map", "version", 2), "not throw, version 1"),
    "version of the map true": (put("map", "version", True), "not throw, version 1"),
    "another model": (put("map", "flip", "signed"), "different models"),
    "a claim made twice": (twice(1), "made twice"),
    "version 3": (put("version", 3), "goal, plane missing"),
}


@pytest.mark.parametrize(("version", "odd"), [*((3, odd) for odd in ODD), *((2, odd) for odd in OLD)])
def test_a_file_with_more_or_less_than_its_version_has_is_no_certificate(good, tmp_path, version, odd):
    change, reason = (ODD if version == 3 else OLD)[odd]
    spoiled = good.copy() if version == 3 else forge.of_version_2(good)
    change(spoiled)
    report = verdict(spoiled.seal(), tmp_path)
    assert report.verdict == "bad file"
    assert reason in report.reason
