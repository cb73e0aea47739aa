"""`certify`, `average`, `absorption`, `atlas` and `explore` of a map in a Python file, FILE.py:NAME."""

import json
import re
import sys
from functools import partialmethod
from pathlib import Path
from unittest import mock

import pytest

import limitsets as ls
from limitsets.face.cli import main
from limitsets.proofs.chances import absorption
from tests.cli.command import documented, json_of, names_in, prints, refusal, run

FILE = """
import math
from typing import NamedTuple

import limitsets as ls

print("what a file prints goes to stderr")


def henon(x, y, a, b=0.3):
    return 1 - a * x**2 + y, b * x


def ricker(x, r):
    return x * math.exp(r * (1 - x))


def above_half(x, top):
    return 0.9 * x if x > top else x


def cut(x, top):
    return top * x - int(2 * x)


class Half(NamedTuple):
    slope: float


def half(params, x, side):
    return params.slope * x, side, 0


ls.register(Half, image=half)
made, registered, number = ls.map(ricker, r=2.3), Half(0.5), 3
"""


@pytest.fixture
def mymap(request):
    """A file whose name no other test uses: Python knows a module by it."""
    name = f"{request.node.name.partition('[')[0]}.py"
    Path(name).write_text(FILE, encoding="utf-8")
    yield name
    sys.path[:] = [folder for folder in sys.path if folder != str(Path.cwd())]


def certify(capfd, *words, code=0):
    ended, out, err = run_of_file(capfd, "certify", *words)
    assert ended == code, err
    return out


def run_of_file(capfd, *words):
    """As `run`, for a file that prints."""
    code = main(list(words))
    out, err = capfd.readouterr()
    lines = [line for line in err.splitlines() if not line.startswith("what a file prints")]
    assert all(line.startswith("limitsets: ") for line in lines)
    return code, out, "\n".join(lines)


def test_a_range_of_a_plain_function_is_proved_and_rechecks(capfd, mymap):
    """Section 15 of the design: orbits end in [0.35, 1.65] for r in [2.3, 2.35], and not at 2.5."""
    goal = ["--domain", "0.02:2.6", "--cells", "1000", "--ends", "0.35:1.65", "--starts", "0.02:2.6"]
    out = certify(capfd, f"{mymap}:ricker", "--set", "r=2.3:2.35", *goal, "--save", "goal")
    assert "for every r from 2.3 to 2.35" in out
    assert "what a file prints" not in out
    Path(mymap).unlink()  # a recheck needs no code
    out = prints(capfd, "recheck goal.proof.zip")
    assert "every start in [0.02, 2.6] ends in [0.35, 1.65] and stays" in out
    assert "r in [2.3, 2.35]" in out
    assert out.splitlines()[-1] == "PROVED"


def test_what_is_not_proved_is_exit_1_and_writes_nothing(capfd, mymap):
    goal = ["--domain", "0.02:2.6", "--cells", "1000", "--ends", "0.35:1.65", "--starts", "0.02:2.6"]
    out = certify(capfd, f"{mymap}:ricker", "--set", "r=2.5", *goal, code=1)
    assert "no certificate is written: nothing is proved" in out
    assert names_in() <= {mymap, "__pycache__"}


@pytest.mark.parametrize(
    ("name", "settings", "parameters"),
    [
        ("ricker", ["r=2.2"], {"r": 2.2}),
        ("made", ["r=2.2"], {"r": 2.2}),
        ("made", [], {"r": 2.3}),
        ("registered", ["slope=-0.5"], {"slope": -0.5}),
        ("Half", ["slope=0.25"], {"slope": 0.25}),
    ],
)
def test_a_map_is_a_function_an_object_or_a_class(capfd, mymap, name, settings, parameters):
    """One attracting cycle each: the 2-cycle of Ricker's map for 2 < r < 2.52, and the fixed point 0."""
    words = [word for each in settings for word in ("--set", each)]
    where = ["--domain", "0.02:2.6"] if "r" in parameters else ["--domain=-1:1"]
    out = ["certify", f"{mymap}:{name}", *words, *where, "--cells=501", "--claims", "invariant,cycles"]
    code, printed, _ = run_of_file(capfd, *out, "--json", "--save", f"{name}.zip")
    assert code == 0
    invariant, cycles = json.loads(printed)
    assert set(invariant) == documented("certify of a map")
    assert [invariant["verdict"], cycles["verdict"]] == ["proved", "proved"]
    assert invariant["parameters"] == [parameters] * 2
    assert sorted(len(each["side"]) for each in cycles["cycles"] if each["attracts"]) == [
        2 if "r" in parameters else 1
    ]
    assert json_of(capfd, f"recheck {name}.zip")["verdict"] == "proved"


BOX = ["--domain", "0:1,0:1"]
REFUSED = [
    ("certify", "nofile.py:henon", [], "nofile.py"),
    ("certify", "{}", [], "henon, ricker, above_half, cut, Half, half, made, registered"),
    ("certify", "{}:heno", [], "henon, ricker"),
    ("certify", "{}:number", [], "the map is 3"),
    ("certify", "{}:henon", ["--set", "a=1.4"], 'add --domain "0:1,0:1"'),
    ("certify", "{}:henon", ["--set", "a=1.4", "--domain", "0:1"], "each of its 2 coordinates"),
    ("certify", "{}:henon", ["--set", "a=1.4", "--domain", "0:1,1:0"], "LO below HI"),
    ("certify", "{}:henon", ["--set", "a=1.4", "--set", "c=2", *BOX], "values of a, b"),
    ("certify", "{}:henon", ["--set", "a=one", *BOX], "the value of a is 'one'"),
    ("certify", "{}:henon", ["--set", "a=1:2:3", *BOX], "LOW:HIGH"),
    ("certify", "{}:henon", ["--set", "a=1.5:1.4", *BOX], "swap them"),
    ("certify", "{}:registered", ["--set", "q=1", "--domain", "0:1"], "a value of slope"),
    ("certify", "{}:Half", ["--domain", "0:1"], "--set slope="),
    ("certify", "{}:made", ["--domain", "0:1", "--noise", "a=b"], "the option --noise is 'a=b'"),
    ("certify", "{}:made", ["--domain", "0:1", "--starts", "0:1"], "beside --ends"),
    ("certify", "{}:above_half", ["--domain", "0:1", "--set", "top=0.5"], "no comparison"),
    ("certify", "{}:cut", ["--domain", "0:1", "--set", "top=1.5"], "write floor in place of int"),
    ("certify", "paper-designed", ["--domain", "0:1"], "none beside a scene"),
    ("certify", "paper-designed", ["--set", "a=1"], "none beside a scene"),
    ("atlas", "{}:made", ["--x", "r=2:3:4"], "--domain"),
    ("atlas", "{}:made", ["--x", "r=2:3:4", "--domain", "0:1", "--set", "r=1:2"], "certify takes a range"),
    ("explore", "{}:made", ["--no-show"], "--domain"),
]


@pytest.mark.parametrize(("command", "subject", "options", "says"), REFUSED)
def test_bad_input_is_one_line(capfd, mymap, command, subject, options, says):
    code, out, err = run_of_file(capfd, command, subject.format(mymap), *options)
    assert (code, out) == (2, "")
    assert "bug" not in err
    assert says in err.splitlines()[-1]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x = 1\ny = x / 0\n", "line 2 is 'ZeroDivisionError: division by zero'"),
        ("def f(x:\n", 'line 1 is "SyntaxError'),
        ("import nothing_of_this_name\n", "ModuleNotFoundError"),
        ("raise SystemExit(0)\n", "SystemExit: 0"),
    ],
)
def test_a_file_that_fails_names_its_own_error(capfd, text, says):
    Path("failing_map.py").write_text(text, encoding="utf-8")
    assert says in refusal(capfd, "certify failing_map.py:f --domain 0:1")


def test_a_name_of_a_module_in_use_is_refused(capfd):
    Path("math.py").write_text("", encoding="utf-8")
    assert "rename it: a module math is in use" in refusal(capfd, "certify math.py:f --domain 0:1")


def test_other_commands_take_scenes_alone(capfd):
    code, _, err = run(capfd, "analyse mymap.py:henon")
    assert code == 2
    assert "certify, atlas and explore take a map" in err


def test_explore_without_a_scene_opens_paper_designed(capfd, monkeypatch):
    shown = []
    monkeypatch.setattr("limitsets.explore", lambda scene, **_: shown.append(scene) or mock.MagicMock())
    assert run(capfd, "explore --no-show")[0] == 0
    assert [scene.name for scene in shown] == ["paper-designed"]


@pytest.mark.sweep
def test_an_atlas_of_a_map(capfd, mymap):
    """Ricker's fixed point doubles its period at r = 2."""
    words = ["--x", "r=1.9:2.1:2", "--domain", "0.02:2.6", "--workers", "1"]
    code, _, err = run_of_file(capfd, "atlas", f"{mymap}:made", *words)
    assert code == 0, err
    xarray = pytest.importorskip("xarray")
    answers = xarray.open_zarr("made-atlas.zarr", consolidated=False)
    assert answers["period"].values.squeeze()[:, 0].tolist() == [1, 2]


def test_averages_under_noise_of_a_parameter(capfd, mymap):
    how = f"average {mymap}:ricker --set r=2.6 --domain 0.06:2.2 --of 0:1 --cells 300".split()
    _, out, _ = run_of_file(capfd, *how, "--noise", "r=0.1", "--noise", "0.02")
    assert "steps land within 0.02 of the image and r deviates by at most 0.1 at every step, evenly" in out
    assert ls.recheck("ricker.averages.proof.zip").verdict == "proved"
    _, out, _ = run_of_file(capfd, *how, "--noise", "0.02", "--no-recheck", "--json")
    assert json.loads(out)[0]["noise"] == 0.02
    for noise, why in (
        ("q=0.1", "the noise of q is 0.1"),
        ("wide", "noise of landing is 'wide'"),
        ("r=", "noise of r is ''"),
    ):
        code, _, err = run_of_file(capfd, *how, "--noise", noise)
        assert (code, why in err) == (2, True), err


# ----------------------------------------------------------------
# `limitsets absorption`: where orbits of a noisy map end.


def test_an_orbit_ends_as_surely_and_as_soon_as_in_closed_form(capfd, mymap):
    # a step from x lands evenly in [x/2 - 1, x/2 + 1]: above 1 with probability x/4, below 0 with 1/2 - x/4; so p(x) =
    # x/4 + p/2 with p the mean over [0, 1]: p = 1/4; and half of all orbits end at each step: 2 steps
    how = ["absorption", f"{mymap}:registered", "--domain", "0:3", "--noise", "1", "--absorbing", "top=1:3"]
    some = ["--starts", "0:0.5", "--starts", "0.5:1", "--cells", "300", "--steps", "20"]
    code, out, _ = run_of_file(capfd, *how, *some, "--json", "--csv", "t.csv")
    record = json.loads(out)
    (least, most), (soonest, latest) = record["ever"]["top"].values(), record["mean"].values()
    assert code == 0
    assert 0.2499 < least <= 0.25 <= most < 0.2501
    assert 1.9999 < soonest <= 2 <= latest < 2.0001
    lo, hi = record["within"]["any"].values()
    assert all(low <= 1 - 0.5**n <= high for n, (low, high) in enumerate(zip(lo, hi, strict=True)))
    assert set(record) == set(documented("absorption"))
    assert record["certificate"]["file"] == "registered.absorption.proof.zip"
    # with a range of slopes s: p is s/2, and still half of all orbits end at each step
    _, out, _ = run_of_file(capfd, *how, *some, "--set", "slope=0.4:0.5", "--no-recheck", "--json")
    of_range = json.loads(out)
    assert [each["slope"] for each in of_range["parameters"]] == [0.4, 0.5]
    (least, most), (soonest, latest) = of_range["ever"]["top"].values(), of_range["mean"].values()
    assert 0.19 < least <= 0.2 < 0.25 <= most < 0.26
    assert 1.999 < soonest <= 2 <= latest < 2.001
    _, out, _ = run_of_file(capfd, *how, *some, "--no-recheck")
    low, high = re.search(r"until an orbit ends: ([\d.]+) to ([\d.]+)\n", out).groups()
    assert 1.9999 < float(low) <= 2 <= float(high) < 2.0001
    Path(mymap).unlink()
    assert ls.recheck("registered.absorption.proof.zip").verdict == "proved"


def test_a_place_that_cannot_be_written_is_refused_before_the_proof(capfd, mymap, monkeypatch):
    monkeypatch.setattr(
        absorption, "absorption_brackets", lambda *_, **__: pytest.fail("it was proved first")
    )
    how = ["--domain", "0:3", "--noise", "1", "--absorbing", "top=1:3", "--save", f"{mymap}/x"]
    code, out, err = run_of_file(capfd, "absorption", f"{mymap}:registered", *how)
    assert (code, out) == (2, "")
    assert "a place that can be written" in err
    assert not list(Path().rglob("*draft*"))


def test_brackets_that_the_checker_denies_are_no_answer(capfd, mymap, monkeypatch):
    right = absorption.AbsorptionBrackets.save
    monkeypatch.setattr(absorption.AbsorptionBrackets, "save", partialmethod(right, allowance=-1e-5))
    how = ["--domain", "0:3", "--noise", "1", "--absorbing", "top=1:3", "--starts", "0:1", "--cells", "50"]
    code, out, err = run_of_file(capfd, "absorption", f"{mymap}:registered", *how, "--steps", "5")
    assert (code, out) == (2, "")
    assert err.startswith(
        "limitsets: registered.absorption.denied.zip: the certificate's claim probabilities is 'denied"
    )
    assert sorted(file.name for file in Path().glob("*.zip")) == ["registered.absorption.denied.zip"]


def test_orbits_that_need_not_end_have_no_mean(capfd, mymap):
    # |x| <= 0.2 leads to |x| <= 0.2
    how = [
        "--domain",
        "-3:3",
        "--noise",
        "0.1",
        "--absorbing",
        "high=1:2",
        "--starts",
        "0:0.1",
        "--cells",
        "20",
    ]
    words = ["absorption", f"{mymap}:registered", *how, "--steps", "5", "--no-recheck"]
    code, out, _ = run_of_file(capfd, *words)
    assert code == 0
    assert re.search(r"until an orbit ends: at least [\d.e+]+; nothing is proved from above", out)
    assert "not rechecked" in out
    for wrong, why in (
        (["paper-designed"], "limitsets feed SCENE --brackets N"),
        ([f"{mymap}:registered", "--noise", "1", "--domain", "0:3", "--absorbing", "1:3"], "NAME=LO:HI"),
        (
            [f"{mymap}:registered", "--noise", "1", "--domain", "0:3", "--starts", "1"],
            "--starts: the box is '1'",
        ),
        ([f"{mymap}:registered", "--domain", "0:3"], "pass noise=e"),
    ):
        code, _, err = run_of_file(capfd, "absorption", *wrong)
        assert (code, why in err) == (2, True), err
