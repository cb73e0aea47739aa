"""The net notices what it is there for: a digit of an answer, an entry of an array, an answer that is missing."""

import copy
from zipfile import ZipFile

import numpy as np

import limitsets as ls
from tests.net.answering import of_commands, plain, written
from tests.net.comparing import differences, keep, kept


def test_an_answer_is_the_same_twice_and_one_digit_is_noticed(tmp_path):
    line = ("margin SCENE arm.surface_height --reading fixed --width 0.5",)
    scene = ls.load("paper-designed").as_dict()
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        for number, (name, answer) in enumerate(of_commands("designed", scene, line, tmp_path / folder)):
            keep(tmp_path / folder, number, name, answer)
    one, two = (kept(tmp_path / folder) for folder in ("one", "two"))
    assert list(differences(one, two)) == []
    other = copy.deepcopy(two)
    other[next(iter(other))]["json"][0]["proved"] *= 1.0 + 2.0**-52
    (place,) = differences(one, other)
    assert ".json[0].proved: " in place
    del other[next(iter(other))]["json"][0]["proved"]
    (place,) = differences(one, other)
    assert place.endswith(".json[0].proved: only before")


def test_an_entry_of_an_array_in_a_certificate_is_noticed(tmp_path):
    file = tmp_path / "a.proof.zip"
    ls.certify("paper-designed", ["invariant"]).save(file, recheck=False)
    before = written(tmp_path)
    with ZipFile(file) as whole:
        header = whole.read("header.json")
        with np.load(whole.open("arrays.npz")) as arrays:
            changed = {name: np.array(arrays[name]) for name in arrays}
    changed["0.rank"][7] += 1
    np.savez(tmp_path / "arrays.npz", **changed)
    with ZipFile(file, "w") as whole:
        whole.writestr("header.json", header)
        whole.write(tmp_path / "arrays.npz", "arrays.npz")
    (place,) = differences(before, written(tmp_path))
    assert ".arrays.0.rank: " in place


def test_what_differs_from_run_to_run_is_left_out():
    assert plain({"seconds": 1.0, "x": ["/tmp/a/b", 2.0]}, "/tmp/a") == {"x": ["OUT/b", 2.0]}
