"""Orbits that refute, in the checker's arithmetic: right ones are accepted, tampered ones are not."""

import copy
import io
import json
import zipfile

import pytest

import limitsets as ls
from limitsets.goals import OrientedBeyond

pytest.importorskip("flint", reason="the checker needs python-flint")


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("refuted")
    found = {}
    for reading in ("fixed", "per-throw"):
        (one,) = ls.margin("paper-designed", "throw.speed", reading=reading, width=0.1)
        found[reading] = next(path for path in one.save(folder / reading) if ".refuted." in path.name)
    (one,) = ls.margin("paper-designed", "landing.x", width=0.1)
    found["landing"] = next(path for path in one.save(folder / "landing") if ".refuted." in path.name)
    goal = OrientedBeyond(25.0, 2, from_anywhere=True)
    (one,) = ls.margin("paper-designed", "throw.speed", goal=goal)
    (found["anywhere"],) = one.save(folder / "anywhere")
    return found


def rewritten(path, target, change):
    """The same file with another header."""
    with zipfile.ZipFile(path) as file:
        header, arrays = json.loads(file.read("header.json")), file.read("arrays.npz")
    change(header)
    with zipfile.ZipFile(target, "w", zipfile.ZIP_STORED) as file:
        file.writestr("header.json", json.dumps(header))
        file.writestr("arrays.npz", io.BytesIO(arrays).getvalue())
    return target


@pytest.mark.parametrize("which", ["fixed", "per-throw", "landing", "anywhere"])
def test_it_is_accepted_as_written(files, which):
    report = ls.recheck(files[which])
    assert (report.verdict, report.reason) == ("proved", "")
    assert report.claims == [("refuted", "proved", "")]
    assert "on another side than 2" in report.statement[0]


def section(header):
    return header["claims"][0]["section"]


def at(x):
    return lambda header: section(header)["goal"].update(x=x)


def other_side(header):
    section(header)["goal"]["side"] = 0


def narrower(header):
    section(header)["tolerance"]["throw.speed"] = "0.72 %"


def other_nominal(header):
    section(header)["nominal"]["throw.speed"] = "25.3 in"


def moved(header):
    start = section(header)["start"]
    start["x"] = (float.fromhex(start["x"]) + 0.3).hex()


def outside(header):
    section(header)["start"].update(x=(26.0).hex(), side=0)


def fewer(header):
    section(header)["throws"] = section(header)["throws"][:-1]


def of_throw(key, value):
    def change(header):
        for throw in section(header)["throws"]:
            throw[key] = value

    return change


def less_noise(header):
    for name in header["noise"]:
        number, unit = header["noise"][name].split()
        header["noise"][name] = f"{0.9 * float(number):.6f} {unit}"


@pytest.mark.parametrize(
    ("which", "change", "words"),
    [
        ("fixed", at("23 in"), "which the goal allows"),
        ("fixed", other_side, "which the goal allows"),
        ("fixed", narrower, "is not within"),
        ("fixed", other_nominal, "is not within"),
        ("fixed", moved, ""),
        ("fixed", outside, "does not start in the attracting cells"),
        ("fixed", fewer, "which the goal allows"),
        ("fixed", of_throw("kappa", (25.3).hex()), "is not within the noise"),
        ("fixed", of_throw("landing", (0.1).hex()), "farther off than the noise allows"),
        ("per-throw", of_throw("kappa", None), "does not say its kappa"),
        ("per-throw", of_throw("kappa", (26.0).hex()), "is not within the noise"),
        ("per-throw", of_throw("kappa", (25.3778518).hex()), "which the goal allows"),
        ("per-throw", less_noise, ""),
        ("landing", of_throw("landing", (0.2).hex()), "farther off than the noise allows"),
        ("landing", less_noise, ""),
        ("anywhere", at("27.9 in"), "which the goal allows"),
    ],
)
def test_tampered_ones_are_refused(files, tmp_path, which, change, words):
    report = ls.recheck(rewritten(files[which], tmp_path / "x.zip", change))
    assert report.verdict == "failed"
    assert words in report.reason


def test_what_is_no_orbit_is_no_file(files, tmp_path):
    def no_throws(header):
        section(header)["throws"] = []

    def no_goal(header):
        section(header)["goal"] = {"kind": "attracts_all"}

    def unknown_quantity(header):
        section(header)["tolerance"] = section(header)["nominal"] = {"part.colour": "1 in"}

    for change in (no_throws, no_goal, unknown_quantity):
        report = ls.recheck(rewritten(files["fixed"], tmp_path / "x.zip", copy.copy(change)))
        assert report.verdict == "bad file"
