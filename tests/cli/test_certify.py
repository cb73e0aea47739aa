"""`limitsets certify` and `limitsets recheck`: exit codes, words, JSON, certificates that stay whole."""

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import limitsets as ls
from limitsets.proofs.prover import certificate as confirm
from tests.cli.command import PROGRESS, run
from tests.feeding.scenes import with_cavity
from tests.lead_triangle import left_by_some


def test_proved_is_exit_0_and_rechecks(capfd):
    code, out, _ = run(capfd, "certify", "paper-designed")
    assert code == 0
    assert "attracts-all: PROVED" in out
    assert "goal: PROVED" in out
    assert "every part at rest beyond x = 20 in lies on side 2" in out
    assert [path.name for path in Path().iterdir()] == ["paper-designed.proof.zip"]
    code, out, _ = run(capfd, "recheck", "paper-designed.proof.zip")
    assert code == 0
    assert out.splitlines()[-1] == "PROVED"
    code, out, _ = run(capfd, "recheck", "paper-designed.proof.zip", "--json", "-o", "report.json")
    record = json.loads(out)
    assert code == 0
    assert record["verdict"] == "proved"
    assert [claim[:2] for claim in record["claims"]] == [["attracts-all", "proved"], ["goal", "proved"]]
    assert json.loads(Path("report.json").read_text()) == record


def test_shares_of_the_starts_are_rounded_to_the_safe_side(capfd):
    """96.456 % were said to be 96.5 %, and proved."""
    ls.dump(ls.load(left_by_some()), "left.toml")
    _, out, _ = run(capfd, "certify", "left.toml", "--claim", "goal", "--json")
    (record,) = json.loads(out)
    code, out, _ = run(capfd, "certify", "left.toml", "--claim", "goal")
    assert code == 1
    words = r"It is proved for ([\d.]+) % .*; ([\d.]+) % are proved to leave the arm; of ([\d.e-]+) % nothing is proved"
    share, leaves, rest = (float(word) for word in re.search(words, out).groups())
    assert share <= 100.0 * record["share"] < share + 0.01
    assert leaves <= 100.0 * record["leaves"] < leaves + 0.001
    assert rest >= 100.0 * record["open"]


def test_two_basins_in_words(capfd):
    """With h = 0.1 in the jog's fixed points lie at 3.16349, 3.19076 and 4.80947 in: see test_fixed_point.py."""
    ls.dump(ls.load("paper-designed").with_values({"arm.surface_height": 0.1}), "above.toml")
    code, out, _ = run(capfd, "certify", "above.toml")
    assert code == 0
    assert "attracts-all: PROVED" in out
    assert "From every position on the arm beyond R*" in out
    assert "From every position nearer than R*, jogs bring the part ever closer to x = a" in out
    assert "From every position on the arm and every side" not in out
    for side, want in enumerate((3.1634862212551690, 3.1907626017464787, 4.8094728969963149)):
        line = next(line for line in out.splitlines() if line.strip().startswith(f"side {side}: R* between"))
        lo, hi = (float(word) for word in line.split("=")[1].removesuffix(" in").split(" and "))
        assert lo < want < hi < lo + 1e-9
    code, out, _ = run(capfd, "recheck", "above.proof.zip")
    assert code == 0
    assert "every start a_i < x < R*_i stays on side i and tends to a_i" in out
    _, out, _ = run(capfd, "certify", "above.toml", "--noise", "throw.speed=0.1 %")
    assert "Between the two ends nothing is claimed" in out


def test_printed_bounds_are_no_stronger_than_the_proved_ones(capfd):
    """Extents rounded outward, throws as they are; the limit set's own ends lie inside (test_paper.py)."""
    _, out, _ = run(capfd, "certify", "paper-designed")
    extents = ls.certify("paper-designed").to_json()[0]["extents"]
    for side, parts in extents.items():
        line = next(line for line in out.splitlines() if line.strip().startswith(f"side {side}: x = "))
        printed = [float(word) for word in line.split("=")[1].replace("to", "").replace("in", "").split()]
        assert printed[0] <= parts[0][0][0] < printed[0] + 0.0011
        assert printed[1] - 0.0011 < parts[0][1][1] <= printed[1]


def test_refuted_is_exit_1_with_the_orbit_and_a_certificate_of_the_rest(capfd):
    code, out, _ = run(capfd, "certify", "paper-initial", "-o", "rest.proof.zip")
    assert code == 1
    assert "attracts-all: PROVED" in out
    assert "goal: REFUTED" in out
    rows = [line.split() for line in out.splitlines() if line.strip()[:2].strip().isdigit()]
    last = rows[-1]
    assert float(last[1]) > 20.0
    assert last[2] in ("0", "1")
    assert "of what is proved only" in out
    code, out, _ = run(capfd, "recheck", "rest.proof.zip")
    assert code == 0
    assert "attracts-all: PROVED" in out
    assert "goal: PROVED" not in out
    assert "of the scene's own goal nothing is claimed" in out


@pytest.mark.sweep
def test_noise_and_tolerance(capfd):
    code, out, _ = run(capfd, "certify", "paper-designed", "--noise", "throw.speed=0.41 %", "-o", "a.zip")
    assert code == 1
    assert "speed of the next throw" in out
    assert "-0.41" in out
    code, out, _ = run(
        capfd, "certify", "paper-designed", "--tolerance", "throw.speed=0.1 %", "-o", "b.zip", "--json"
    )
    assert code == 0
    (first, _) = json.loads(out)
    assert first["tolerance"] == {"throw.speed": "0.1 %"}
    lo, hi = (float(text.split()[0]) for text in first["parameters"]["throw.kappa"])
    assert lo == pytest.approx(25.3778518 / 1.001**2)
    assert hi == pytest.approx(25.3778518 / 0.999**2)
    assert run(capfd, "recheck", "b.zip")[0] == 0


def test_scattered_landings_and_tilts_name_their_throws(capfd):
    code, out, _ = run(
        capfd, "certify", "paper-designed", "--claim", "goal", "--noise", "landing.x=0.15 in", "-o", "a.zip"
    )
    assert code == 1
    assert "landing.x within 0.15 in of the model's place" in out
    assert "lands off by [in]" in out
    assert "+0.150000" in out
    scene = ls.load("paper-designed").as_dict() | {"gravity": {"tilt": "30 deg"}}
    ls.dump(ls.load(scene), "tilt.toml")
    code, out, _ = run(capfd, "certify", "tilt.toml", "--claim", "goal", "--noise", "gravity.tilt=0.3 deg")
    assert code == 1
    assert "tilt of the next throw" in out
    assert "29.7 deg" in out
    both = ["--noise", "gravity.tilt=0.3 deg", "--noise", "throw.speed=0.1 %"]
    code, out, _ = run(capfd, "certify", "tilt.toml", "--claim", "goal", *both)
    assert code == 1
    assert "kappa of the next throw [in]" in out


def test_a_goal_of_another_kind_is_put_in_words(capfd):
    scene = ls.load("paper-designed").as_dict() | {"goal": {"flip_order": [0, 1, 2]}}
    ls.dump(ls.load(scene), "order.toml")
    code, out, _ = run(capfd, "certify", "order.toml", "--claim", "goal", "-o", "a.zip")
    assert code == 0
    assert "parts come to lie on sides 0, 1, 2 in turn" in out
    code, out, _ = run(capfd, "recheck", "a.zip")
    assert code == 0
    assert "in the order 0 1 2, again and again" in out


def test_nothing_proved_writes_nothing_and_says_why(capfd):
    ls.dump(ls.load("paper-designed").with_values({"throw.kappa": 2.0}), "fast.toml")
    before = {path.name for path in Path().iterdir()}
    code, out, _ = run(capfd, "certify", "fast.toml")
    assert code == 1
    assert "attracts-all: UNDECIDED" in out
    assert "side " in out
    assert "no certificate is written" in out
    assert {path.name for path in Path().iterdir()} == before


def test_json_alone_is_on_stdout(capfd):
    code, out, _ = run(capfd, "certify", "paper-initial", "--claim", "goal", "--claim", "expanding", "--json")
    assert code == 1
    goal, expanding = json.loads(out, parse_constant=lambda word: pytest.fail(f"{word} in JSON"))
    assert (goal["claim"], goal["verdict"]) == ("goal", "refuted")
    assert set(goal["counterexample"][0]) >= {"x", "side", "parameters"}
    assert expanding["verdict"] == "proved"


BAD = [
    ["certify"],
    ["certify", "nope"],
    ["certify", "paper-designed", "--claim", "everything"],
    ["certify", "paper-designed", "--noise", "throw.speed"],
    ["certify", "paper-designed", "--noise", "throw.speed=fast"],
    ["certify", "paper-designed", "--noise", "throw.speeed=1 %"],
    ["certify", "paper-designed", "--noise", "landing.x=1 %"],
    ["certify", "paper-designed", "--noise", "gravity.tilt=1 deg"],
    ["certify", "paper-designed", "--tolerance", "throw.speed=-1 %"],
    ["certify", "paper-designed", "--tolerance", "throw.speed=1 %", "--tolerance", "throw.speed=2 %"],
    ["certify", "paper-designed", "-o", "."],
    ["certify", "paper-designed", "-o", "file/below.zip"],
    ["certify", "paper-designed", "-o", "/dev/full"],
    ["recheck"],
    ["recheck", "nothing.zip"],
    ["recheck", "."],
    ["recheck", "file"],
    ["recheck", "/dev/zero"],
]


@pytest.mark.parametrize("words", BAD, ids=" ".join)
def test_bad_input_is_one_line_and_exit_2(capfd, words):
    Path("file").write_text("mine" * 100)
    code, out, err = run(capfd, *words)
    assert (code, out) == (2, "")
    assert len([line for line in err.splitlines() if not PROGRESS.search(line)]) == 1
    assert "bug" not in err
    assert Path("file").read_text() == "mine" * 100
    assert [path.name for path in Path().iterdir()] == ["file"]


def test_a_certificate_that_was_changed_is_not_accepted(capfd):
    run(capfd, "certify", "paper-designed", "-o", "good.zip")
    data = Path("good.zip").read_bytes()
    Path("bad.zip").write_bytes(data.replace(b'"x": "20 in"', b'"x": "19 in"'))  # the header's checksum tells
    code, out, err = run(capfd, "recheck", "bad.zip")
    assert (code, out) == (2, "")
    assert "checksum" in err
    Path("cut.zip").write_bytes(data[:-1000])
    assert run(capfd, "recheck", "cut.zip")[0] == 2


def test_a_claim_that_is_not_true_is_exit_1(capfd):
    """Beyond 15 in parts lie on side 0 too (limit set up to 19.75), whatever the header says."""
    import io
    import zipfile

    run(capfd, "certify", "paper-designed", "-o", "good.zip")
    with zipfile.ZipFile("good.zip") as file:
        entries = {name: file.read(name) for name in file.namelist()}
    entries["header.json"] = entries["header.json"].replace(b'"x": "20 in"', b'"x": "15 in"')
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_STORED) as file:
        for name, data in entries.items():
            file.writestr(name, data)
    Path("false.zip").write_bytes(packed.getvalue())
    code, out, _ = run(capfd, "recheck", "false.zip")
    assert code == 1
    assert "attracts-all: PROVED" in out
    assert "goal: FAILED" in out
    assert out.splitlines()[-1].startswith("FAILED: goal: ")


def test_without_flint_there_is_one_clear_error(capfd, monkeypatch):
    monkeypatch.setattr(confirm, "find_spec", lambda name: None)
    code, out, err = run(capfd, "recheck", "any.zip")
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert "pip install python-flint" in err


@pytest.mark.sweep
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize(
    "words",
    [
        ("recheck", "large.zip"),
        ("feed", "cavity.toml", "--no-proof", "--trials", "20000000"),
    ],
    ids=lambda words: words[0],
)
def test_ctrl_c_ends_a_command_and_its_helpers_without_a_traceback(capfd, words):
    """From a terminal the whole group of processes hears it."""
    run(capfd, "certify", "paper-designed", "--noise", "throw.speed=0.38 %", "-o", "large.zip")
    Path("cavity.toml").write_text(ls.dump(with_cavity()))
    process = subprocess.Popen(
        [sys.executable, "-m", "limitsets", *words],
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    if process.stderr.readline():  # it is at work, and has been for two seconds
        os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate()
    assert process.returncode in (130, 0)  # or it had finished
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("words", "next_one"),
    [
        (("paper-initial",), "limitsets design paper-initial --goal"),
        (("paper-designed", "--noise", "throw.speed=9 %"), "limitsets margin paper-designed"),
    ],
    ids=["refuted", "too much noise"],
)
def test_what_is_not_proved_names_the_next_command(capfd, words, next_one):
    code, out, _ = run(capfd, "certify", *words, "--no-recheck")
    assert code == 1
    assert out.splitlines()[-2].startswith(f"next: {next_one} ")


def test_a_share_that_is_undecided_names_the_next_command(capfd):
    _, out, _ = run(capfd, "analyse", "paper-designed", "--cells", "64")
    assert "of all starts; next: limitsets analyse paper-designed --cells 256 (finer cells)" in out
    assert "undecided: " not in run(capfd, "analyse", "paper-designed", "--cells", "8192")[1]
