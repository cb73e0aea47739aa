"""`limitsets feedback`: words, JSON as docs/json.md has it, files, exit codes."""

import csv
import re
from pathlib import Path

import pytest

import limitsets as ls
from tests.cli.command import both, documented, json_of, names_in, prints, refusal, written

SCENE = "one-bit.toml"
FEW = ("--starts", "2=17:18", "--cells", "256")


@pytest.fixture(autouse=True)
def _scene(here):
    own = ls.load("paper-initial").as_dict()["throw"]
    throws = [{"name": "own", **own}, {"name": "fast", "kappa": "27.57073926 in"}]
    written("paper-initial", SCENE, feedback={"sensor": {"beyond": "20 in"}, "throws": throws})


def test_a_policy_in_words(capfd):
    out = prints(capfd, "feedback", SCENE, *FEW)
    assert "the part is known to lie on side 2 at x = 20 in or beyond" in out
    assert "starts: those named: side 2: 17 to 18" in out
    assert "is the part beyond 20 in?" in out
    assert re.search(r"solved: [0-9]+ throws are enough", out)
    assert "thrown: 10000 of 10000 came" in out
    assert names_in() == {SCENE}


def test_json_has_the_keys_of_the_page(capfd):
    record = json_of(capfd, "feedback", SCENE, *FEW, "--parts", "500")
    assert set(record) == documented("feedback") | {"question"}
    assert ls.load(record["scene"]).feedback.sensor.x == 20.0
    assert record["sensor"] == {"x": 20.0, "error": 0.0}
    assert record["goal"] == {"x": 20.0, "side": 2}
    assert record["starts"]["extents"] == {"2": [[17.0, 18.0]]}
    assert record["verdict"] == "solved"
    assert set(record["policy"]) == {"first", "states"}
    for k, state in enumerate(record["policy"]["states"]):
        assert set(state) == {"state", "throw", "after", "left", "belief"}
        assert state["state"] == k
    simulated = record["simulated"]
    assert simulated["reached"] == simulated["parts"] == sum(simulated["throws"]) == 500
    assert record["places"] == []


def test_brackets_are_proved_beside_the_thrown_parts(capfd):
    few = (*FEW, "--noise", "landing.x=0.005 in", "--brackets", "300")
    out, record = both(capfd, "feedback", SCENE, *few)
    said = re.search(r"PROVED \(deviations .* per length\): ([\d.]+) to ([\d.]+) throws on average", out)
    assert said is not None
    record = record["brackets"]
    assert float(said[1]) <= record["mean"]["lo"] <= record["mean"]["hi"] <= float(said[2])
    assert 0.0 <= record["come"]["lo"] <= record["come"]["hi"] <= 1.0
    assert "--brackets" in refusal(capfd, "feedback", SCENE, "--brackets", "3")


def runs(rows, states, x, side):
    """Run the table of the CSV as a controller would: it knows the answers only."""

    def heard():
        return "yes" if x > 20.0 else "no"

    state = next(k for k, row in enumerate(rows) if heard() in row["begin"].split())
    for made in range(int(rows[state]["left"]) + 1):
        if rows[state]["throw"] == "stop":
            return x, side, made
        path = ls.orbit(states[rows[state]["throw"]], x, side, 1)
        x, side = float(path.x[1]), int(path.side[1])
        state = int(rows[state][f"next_{heard()}"])
    return None


def test_the_files_can_be_run_by_a_controller(capfd):
    out = prints(capfd, "feedback", SCENE, *FEW, "--csv", "table.csv", "-o", "out")
    assert "written to out" in out
    controllers = {"controller.csv", "controller.h", "controller.st"}
    assert names_in("out") == {"feedback.json", "policy.csv", "policy.png"} | controllers
    assert Path("out/policy.png").stat().st_size > 10_000
    text = Path("table.csv").read_text(encoding="utf-8")
    assert text == Path("out/policy.csv").read_text(encoding="utf-8")
    rows = list(csv.DictReader(text.splitlines()))
    assert list(rows[0]) == ["state", "begin", "throw", "next_yes", "next_no", "left"]
    scene = ls.load(SCENE)
    maps = {each.name: scene.with_values({each.quantity: each.text}).map for each in scene.feedback.throws}
    for k in range(40):
        x, side, made = runs(rows, maps, 17.0 + k / 40, 2)
        assert (side, x >= 20.0) == (2, True)
        assert made <= max(int(row["left"]) for row in rows)


def test_a_certificate_is_written_and_confirmed(capfd):
    pytest.importorskip("flint", reason="the checker needs python-flint")
    out = prints(capfd, "feedback", SCENE, *FEW, "--certificate", "one.proof.zip")
    assert "certificate: one.proof.zip, rechecked in" in out
    out = prints(capfd, "recheck one.proof.zip")
    assert "policy: from every start named the part is brought to lie on side 2 at x >= 20 in" in out
    assert out.splitlines()[-1] == "PROVED"
    words = ("feedback", SCENE, *FEW, "--certificate")
    record = json_of(capfd, *words, "two.proof.zip", "--no-recheck")
    assert record["certificate"] == {"file": "two.proof.zip", "denied": False, "recheck": None}
    out = prints(capfd, *words, "no.proof.zip", "--throws", "1", code=1)
    assert "no certificate is written: there is no policy" in out
    assert not Path("no.proof.zip").exists()


def test_what_the_checker_denies_is_not_solved(capfd, monkeypatch):
    pytest.importorskip("flint", reason="the checker needs python-flint")
    from limitsets.proofs.policies import synthesis as writing

    right = writing.brackets
    monkeypatch.setattr(writing, "brackets", lambda cover: right(cover) * [0.999, 0.9995])
    out = prints(capfd, "feedback", SCENE, *FEW, "--certificate", "one.proof.zip", code=1)
    assert "the checker denies the certificate: it is kept as one.denied.zip" in out
    assert "not decided: the checker denies it" in out
    assert names_in() == {SCENE, "one.denied.zip"}


def test_no_policy_is_exit_1(capfd):
    out = prints(capfd, f"feedback {SCENE} --cells 128 --blind --throws 3 --csv t.csv", code=1)
    assert "nothing is asked" in out
    assert "not with 3 throws on these cells" in out
    assert not Path("t.csv").exists()
    record = json_of(capfd, f"feedback {SCENE} --cells 256 --seconds 0 --side 2", code=1)
    assert (record["verdict"], record["policy"], record["simulated"]) == ("not-decided", None, None)


def test_a_sweep_names_the_best_place(capfd):
    words = ("feedback", SCENE, *FEW, "--sweep", "18:20:3", "--parts", "100")
    out, record = both(capfd, *words)
    assert [place["x"] for place in record["places"]] == [18.0, 19.0, 20.0]
    assert all(set(place) == {"x", "verdict", "within"} for place in record["places"])
    assert record["within"] == min(each["within"] for each in record["places"] if each["verdict"] == "solved")
    assert "19 in" in out


def test_bad_input_is_exit_2(capfd):
    for words, reason in (
        ("--beyond 19 --side 2", "one question"),
        ("--side 4", "0 to 2"),
        ("--starts 2=17", "SIDE=LO:HI"),
        ("--starts 2=17:18 --starts 2=18:19", "SIDE=LO:HI"),
        ("--starts 2=17:18 --from 17", "leave one out"),
        ("--sweep 1:2", "LO:HI:N"),
        ("--beyond '19 deg'", "deg is a unit of angle"),
        ("--mode hold", "stop or catch"),
        ("--from 40", "the starts"),
    ):
        assert reason in refusal(capfd, f"feedback {SCENE} --cells 32 {words}")
