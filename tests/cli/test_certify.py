"""`certify` and `audit`: what is proved, of which model, and how a file of another scene is met."""

import json
import os
import re
import signal
import subprocess
import sys
import time
import zipfile
from functools import cache
from pathlib import Path

import pytest

import limitsets as ls
from limitsets.feeder.scene.left_out import Model
from limitsets.proofs.prover import certificate as confirm
from tests.cli.command import both, documented, json_of, names_in, prints, refusal, run, written
from tests.feeding.scenes import with_cavity
from tests.plates import left_by_some

# ----------------------------------------------------------------
# `limitsets certify` and `limitsets recheck`: exit codes, words, JSON, certificates that stay whole.


def test_proved_is_exit_0_and_rechecks(capfd):
    out, (claim, _) = both(capfd, "certify paper-designed")
    assert "attracts-all: PROVED" in out
    assert "goal: PROVED" in out
    assert ALL in out
    assert set(claim) == documented("The JSON of `limitsets certify --json`", "certificates.md")
    assert "every part at rest beyond x = 20 in lies on side 2" in out
    assert names_in() == {"paper-designed.proof.zip"}
    # extents rounded outward, throws as they are; the limit set's own ends lie inside (test_paper.py)
    for side, parts in claim["extents"].items():
        line = next(line for line in out.splitlines() if line.strip().startswith(f"side {side}: x = "))
        printed = [float(word) for word in line.split("=")[1].replace("to", "").replace("in", "").split()]
        assert printed[0] <= parts[0][0][0] < printed[0] + 0.0011
        assert printed[1] - 0.0011 < parts[0][1][1] <= printed[1]
    out, record = both(capfd, "recheck paper-designed.proof.zip -o report.json")
    assert out.splitlines()[-1] == "PROVED"
    assert set(record) == documented("recheck")
    assert record["verdict"] == "proved"
    assert [claim[:2] for claim in record["claims"]] == [["attracts-all", "proved"], ["goal", "proved"]]
    assert json.loads(Path("report.json").read_text()) == record


def test_shares_of_the_starts_are_rounded_to_the_safe_side(capfd):
    """96.456 % were said to be 96.5 %, and proved."""
    left = written(left_by_some())
    out, (record,) = both(capfd, f"certify {left} --claim goal", code=1)
    words = r"It is proved for ([\d.]+) % .*; ([\d.]+) % are proved to leave the arm; of ([\d.e-]+) % nothing is proved"
    share, leaves, rest = (float(word) for word in re.search(words, out).groups())
    assert share <= 100.0 * record["share"] < share + 0.01
    assert leaves <= 100.0 * record["leaves"] < leaves + 0.001
    assert rest >= 100.0 * record["open"]


def test_of_a_goal_that_asks_nothing_it_is_said_what_it_could_ask(capfd):
    file = written("paper-designed", goal={"oriented_beyond": {"x": "24 in", "side": 2}})
    out = prints(capfd, f"certify {file} --claim goal --no-recheck")
    assert "the goal asks nothing of them" in out
    assert "\nchoose X between 19.753 and 23.383 in for side 2: " in out


def test_two_basins_in_words(capfd):
    """With h = 0.1 in the jog's fixed points lie at 3.16349, 3.19076 and 4.80947 in: see test_fixed_point.py."""
    above = written(file="above.toml", values={"arm.surface_height": 0.1})
    out = prints(capfd, f"certify {above}")
    assert "attracts-all: PROVED" in out
    assert "From every position on the arm beyond R*" in out
    assert "From every position nearer than R*, jogs bring the part ever closer to x = a" in out
    assert "From every position on the arm and every side" not in out
    for side, want in enumerate((3.1634862212551690, 3.1907626017464787, 4.8094728969963149)):
        line = next(line for line in out.splitlines() if line.strip().startswith(f"side {side}: R* between"))
        lo, hi = (float(word) for word in line.split("=")[1].removesuffix(" in").split(" and "))
        assert lo < want < hi < lo + 1e-9
    out = prints(capfd, "recheck above.proof.zip")
    assert "every start a_i < x < R*_i stays on side i and tends to a_i" in out
    noisy = run(capfd, f"certify {above} --noise 'throw.speed=0.1 %'")[1]
    assert "Between the two ends nothing is claimed" in noisy


def test_refuted_is_exit_1_with_the_orbit_and_a_certificate_of_the_rest(capfd):
    out = prints(capfd, "certify paper-initial -o rest.proof.zip", code=1)
    assert "attracts-all: PROVED" in out
    assert "goal: REFUTED" in out
    rows = [line.split() for line in out.splitlines() if line.strip()[:2].strip().isdigit()]
    last = rows[-1]
    assert float(last[1]) > 20.0
    assert last[2] in ("0", "1")
    assert "of what is proved only" in out
    out = prints(capfd, "recheck rest.proof.zip")
    assert "attracts-all: PROVED" in out
    assert "goal: PROVED" not in out
    assert "of the scene's own goal nothing is claimed" in out


@pytest.mark.sweep
def test_noise_and_tolerance(capfd):
    out = prints(capfd, "certify paper-designed --claim goal --noise 'throw.speed=0.41 %' -o a.zip", code=1)
    assert "speed of the next throw" in out
    assert "-0.41" in out
    (first,) = json_of(capfd, "certify paper-designed --claim goal --tolerance 'throw.speed=0.1 %' -o b.zip")
    assert first["tolerance"] == {"throw.speed": "0.1 %"}
    lo, hi = (float(text.split()[0]) for text in first["parameters"]["throw.kappa"])
    assert lo == pytest.approx(25.3778518 / 1.001**2)
    assert hi == pytest.approx(25.3778518 / 0.999**2)
    prints(capfd, "recheck b.zip")


def test_scattered_landings_and_tilts_name_their_throws(capfd):
    out = prints(capfd, "certify paper-designed --claim goal --noise 'landing.x=0.15 in' -o a.zip", code=1)
    assert "landing.x within 0.15 in of the model's place" in out
    assert "lands off by [in]" in out
    assert "+0.150000" in out
    tilt = f"certify {written(gravity={'tilt': '30 deg'})} --claim goal --noise 'gravity.tilt=0.3 deg'"
    out = prints(capfd, tilt, code=1)
    assert "tilt of the next throw" in out
    assert "29.7 deg" in out
    out = prints(capfd, f"{tilt} --noise 'throw.speed=0.1 %'", code=1)
    assert "kappa of the next throw [in]" in out


def test_a_goal_of_another_kind_is_put_in_words(capfd):
    order = written(goal={"flip_order": [0, 1, 2]})
    out = prints(capfd, f"certify {order} --claim goal -o a.zip")
    assert "parts come to lie on sides 0, 1, 2 in turn" in out
    assert "in the order 0 1 2, again and again" in prints(capfd, "recheck a.zip")


def test_nothing_proved_writes_nothing_and_says_why(capfd):
    fast = written(values={"throw.kappa": 2.0})
    out = prints(capfd, f"certify {fast} --claim attracts-all", code=1)
    assert "attracts-all: UNDECIDED" in out
    assert "side " in out
    assert "no certificate is written" in out
    assert names_in() == {fast}


def test_json_alone_is_on_stdout(capfd):
    out = prints(capfd, "certify paper-initial --claim goal --claim expanding --json", code=1)
    goal, expanding = json.loads(out, parse_constant=lambda word: pytest.fail(f"{word} in JSON"))
    assert (goal["claim"], goal["verdict"]) == ("goal", "refuted")
    assert set(goal["counterexample"][0]) >= {"x", "side", "parameters"}
    assert expanding["verdict"] == "proved"


BAD = """
certify
certify nope
certify paper-designed --claim everything
certify paper-designed --noise throw.speed
certify paper-designed --noise throw.speed=fast
certify paper-designed --noise 'throw.speeed=1 %'
certify paper-designed --noise 'landing.x=1 %'
certify paper-designed --noise 'gravity.tilt=1 deg'
certify paper-designed --tolerance 'throw.speed=-1 %'
certify paper-designed --tolerance 'throw.speed=1 %' --tolerance 'throw.speed=2 %'
certify paper-designed -o .
certify paper-designed -o file/below.zip
certify paper-designed -o /dev/full
recheck
recheck nothing.zip
recheck .
recheck file
recheck /dev/zero
audit no-such-scene
audit paper-initial -o file/deeper
""".strip().splitlines()


@pytest.mark.parametrize("line", BAD)
def test_bad_input_is_one_line_and_exit_2(capfd, line):
    Path("file").write_text("mine" * 100)
    refusal(capfd, line)
    assert Path("file").read_text() == "mine" * 100
    assert names_in() == {"file"}


def test_a_certificate_that_was_changed_or_is_not_true_is_not_accepted(capfd):
    """Beyond 15 in parts lie on side 0 too (limit set up to 19.75), whatever the header says."""
    run(capfd, "certify paper-designed -o good.zip")
    packed = Path("good.zip").read_bytes()
    # the header's checksum tells
    Path("bad.zip").write_bytes(packed.replace(b'"x": "20 in"', b'"x": "19 in"'))
    assert "checksum" in refusal(capfd, "recheck bad.zip")
    Path("cut.zip").write_bytes(packed[:-1000])
    refusal(capfd, "recheck cut.zip")
    with zipfile.ZipFile("good.zip") as file, zipfile.ZipFile("false.zip", "w", zipfile.ZIP_STORED) as false:
        for name in file.namelist():
            false.writestr(name, file.read(name).replace(b'"x": "20 in"', b'"x": "15 in"'))
    out = prints(capfd, "recheck false.zip", code=1)
    assert "attracts-all: PROVED" in out
    assert "goal: FAILED" in out
    assert out.splitlines()[-1].startswith("FAILED: goal: ")


def test_without_flint_there_is_one_clear_error(capfd, monkeypatch):
    monkeypatch.setattr(confirm, "find_spec", lambda name: None)
    assert "pip install python-flint" in refusal(capfd, "recheck any.zip")


@pytest.mark.sweep
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("line", ["recheck large.zip", "feed cavity.toml --no-proof --trials 20000000"])
def test_ctrl_c_ends_a_command_and_its_helpers_without_a_traceback(capfd, line):
    """From a terminal the whole group of processes hears it."""
    if line.startswith("recheck"):
        run(capfd, "certify paper-designed --noise 'throw.speed=0.38 %' -o large.zip")
    Path("cavity.toml").write_text(ls.dump(with_cavity()))
    process = subprocess.Popen(
        [sys.executable, "-m", "limitsets", *line.split()],
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    if process.stderr.readline():  # it is at work, and has been for two seconds
        os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate()
    assert process.returncode in (130, 0)  # or it had finished
    assert "Traceback" not in err


def test_what_is_not_proved_names_the_next_command(capfd):
    for line, command in (
        ("paper-initial", "limitsets design paper-initial --goal"),
        ("paper-designed --noise 'throw.speed=9 %'", "limitsets margin paper-designed"),
    ):
        out = prints(capfd, f"certify --no-recheck {line}", code=1)
        assert out.splitlines()[-2].startswith(f"next: {command} ")


def test_a_share_that_is_undecided_names_the_next_command(capfd):
    _, out, _ = run(capfd, "analyse paper-designed --cells 64")
    assert "of all starts; next: limitsets analyse paper-designed --cells 256 (finer cells)" in out


# ----------------------------------------------------------------
# A verdict says of which model it is: which facts of [world] are left out, through every door.


RUBBED = {"friction": 0.3, "restitution": 0.2}
LEFT_OUT = "of the minimal model: friction and restitution of [world] are not in it"
MODEL = {"simulated": [], "left_out": ["friction", "restitution"]}
ALL = "of the minimal model: no fact of [world] is left out"
THROWS = [{"name": "own", "kappa": "25.3778518 in"}]
FEEDBACK = {"sensor": {"beyond": "20 in"}, "throws": THROWS}
WITHOUT = "of the minimal model, of the scene without its scatter: scatter of [world] is not in it"
SPREAD = {"world": {"scatter": {"speed": "0.5 %"}}, "effects": {"spread": "gaussian"}}
QUICK = ("--trials", "100", "--no-level")


def scene(**tables):
    """Give the designed feeder with these tables."""
    return ls.load(ls.load("paper-designed").as_dict() | tables)


@cache
def rubbed_cell():
    """Give a cell whose world has facts that nothing is proved of, and how many assumptions break in it."""
    found = with_cavity(tables={"world": RUBBED, "feedback": FEEDBACK})
    return found, broken(found)


def broken(found):
    """Count by the whole audit what breaks on the limit set, effects of the scene apart."""
    return sum(bool(each.called_for) and not each.simulated for each in ls.audit(found).on("limit-set"))


# Verdicts after which the limit set of the scene is audited, and others.
SHEET = "--quantity throw.speed --reading fixed --width 0.5 --seconds 0 --without noise --without joint --without curve"
MASS = "part.mass.center.along,part.mass.center.above"
AUDITED = (
    "certify mine.toml",
    "margin mine.toml throw.speed --width 0.5",
    f"robustness mine.toml -o sheet {SHEET}",
    "feed mine.toml --trials 100 --no-level",
    f"design mine.toml --critical-points 10.1,10,20 --starts 0 --vary {MASS},throw.kappa",
    "design mine.toml --goal --vary throw.kappa --evaluations 5",
    pytest.param(
        "design mine.toml --robust --vary part.mass.center.along --evaluations 4 --seconds 0",
        marks=pytest.mark.sweep,
    ),
)
OTHERS = (
    "feedback mine.toml --starts 2=16:16.5 --cells 256 --parts 10",
    "atlas mine.toml --x throw.kappa=25:26:3 --workers 1",
)


@pytest.mark.parametrize("line", [*AUDITED, *OTHERS])
def test_every_command_names_what_is_left_out(capfd, line):
    found, breaks = rubbed_cell()
    written(found)
    out, records = both(capfd, line, code=None)
    (told,) = [row for row in out.splitlines() if row.startswith(LEFT_OUT)]
    for record in records if isinstance(records, list) else [records]:
        count = record["model"].pop("assumptions_broken")
        assert record["model"] == MODEL
        if line in OTHERS:
            assert count is None
            assert "; not audited" in told
        elif line.startswith("design"):  # another feeder
            assert isinstance(count, int)
        else:
            assert count == breaks > 0
            assert f"; {count} assumptions break on the limit set: " in told


def test_the_answer_is_there_before_the_audit(capfd, monkeypatch):
    import limitsets.proofs.auditing

    def late(model, scene):
        assert "attracts-all: PROVED" in capfd.readouterr().out
        raise KeyboardInterrupt

    monkeypatch.setattr(limitsets.auditing, "audited", late)
    out = prints(capfd, "certify", written(world=RUBBED), code=130)
    assert "assumption" not in out


@pytest.mark.parametrize("name", ["paper-initial", "paper-designed"])
def test_the_count_is_that_of_the_audit_and_quick(name):
    from limitsets.proofs.auditing import audited

    for world in ({}, RUBBED, {"friction": 0.01, "restitution": 0.9, "bounce_threshold": "0.01 in"}):
        found = ls.load(ls.load(name).as_dict() | {"world": world})
        assert audited(Model.of(found), found).assumptions_broken == broken(found)
        begin = time.perf_counter()
        audited(Model.of(found), found)
        assert time.perf_counter() - begin < 2.0


def test_what_is_left_out():
    """By physics.md: landing and roll need no fact; a landing without rebound is the minimal model's own."""
    scatter = {"speed": "0.5 %"}
    cases = [
        ({}, {}, (), ()),
        ({"throw_rate": "2 Hz"}, {}, (), ()),
        ({"restitution": 0.0, "bounce_threshold": "1 mm"}, {}, (), ()),
        ({"bounce_threshold": "1 mm", "stroke": "5 deg"}, {}, (), ("bounce_threshold", "stroke")),
        ({"friction": 0.9}, {"landing": True, "roll": True}, ("landing", "roll"), ("friction",)),
        ({"friction": 0.9}, {"slip": True, "pivot": True}, ("slip", "pivot"), ()),
        ({"friction": 0.9, "stroke": "5 deg"}, {"drive": True}, ("drive",), ()),
        ({"scatter": scatter}, {}, (), ("scatter",)),
        ({"scatter": scatter, "restitution": 0.2}, {"spread": "bounded"}, ("spread",), ("restitution",)),
        ({"scatter": {"speed": "0 %"}}, {}, (), ()),
    ]
    for world, effects, simulated, left_out in cases:
        model = Model.of(scene(world=world, effects=effects))
        assert (model.simulated, model.left_out) == (simulated, left_out)


def test_noise_that_allows_for_the_scatter_has_it():
    """Of each quantity as much as the scene scatters; less, or of another quantity, has not."""
    found = scene(world={"scatter": {"speed": "0.5 %", "landing": "1 mm"}})
    both = {"throw.speed": "0.5 %", "landing.x": "0.04 in"}
    assert Model.of(found, both).left_out == ()
    assert Model.of(found, both | {"landing.x": "0.03 in"}).left_out == ("scatter",)
    assert Model.of(found, {"throw.speed": "0.5 %"}).left_out == ("scatter",)
    # a third of a percent of 150 deg/s, though 0.0087 rad/s is the larger number
    assert Model.of(found, both | {"throw.speed": "0.5 deg/s"}).left_out == ("scatter",)


def test_nothing_is_left_out_of_a_scene_whose_effects_have_all_its_facts(capfd):
    """Bounded scatter is in the proof; of a scene that states nothing nothing can be left out."""
    file = written(world={"scatter": {"speed": "0.1 %"}}, effects={"spread": "bounded"})
    nothing = "of the model with spread: no fact of [world] is left out;"
    out, records = both(capfd, f"certify {file} -o mine.proof.zip")
    assert nothing in out
    assert records[0]["model"]["left_out"] == []
    assert nothing in prints(capfd, "recheck mine.proof.zip")


def test_tables_and_python_name_it():
    proof = ls.certify(scene(world=RUBBED))
    assert proof.model.sentence == LEFT_OUT
    assert proof.model.assumptions_broken is None
    assert all(LEFT_OUT in table for table in (proof.table().text(), proof._repr_html_()))
    heads, *rows = proof.table().csv().splitlines()
    assert heads.endswith(",not simulated")
    assert all(row.endswith('"friction, restitution"') for row in rows)
    (margin,) = ls.margin(scene(world=RUBBED), "throw.speed", width=0.5)
    assert LEFT_OUT in margin._repr_html_()
    assert margin.table().csv().splitlines()[1].endswith('"friction, restitution"')
    fed = ls.feed(with_cavity(tables={"world": RUBBED}), trials=10, level=False)
    assert LEFT_OUT in fed._repr_html_()


def test_of_a_map_nothing_of_this_is_said():
    proof = ls.certify(ls.maps.Logistic(2.5), ls.grid([(0.1, 0.9)], cells=512), ["attracts-all"])
    assert not hasattr(proof, "model")
    assert not any("[world]" in table.text() for table in proof.tables())


def test_a_recheck_names_what_the_file_leaves_out(capfd):
    prints(capfd, f"certify {written(world=RUBBED)} -o mine.proof.zip")
    out, record = both(capfd, "recheck mine.proof.zip")
    assert f"{LEFT_OUT}; not audited" in out
    assert record["model"] == MODEL | {"assumptions_broken": None}
    assert LEFT_OUT in ls.recheck("mine.proof.zip")._repr_html_()


def test_a_feeder_that_scatters_without_bounds(capfd):
    """Safety and progress are of the scene without its scatter: in the verdict, and the command exits 1."""
    file = written(with_cavity(tables=SPREAD))
    out = prints(capfd, "feed", file, *QUICK, "--certificate", "fed.proof.zip", code=1)
    assert "safety: PROVED of the scene without its scatter, no start on the arm feeds another side" in out
    assert "progress: PROVED of the scene without its scatter, every start" in out
    assert WITHOUT in out
    proved = "proved of the scene without its scatter"
    found = ls.feed(file, trials=10, level=False)
    record = found.to_json()
    assert record["safety"]["verdict"] == record["progress"]["verdict"] == proved
    assert record["model"]["left_out"] == ["scatter"]
    assert "of the scene without its scatter" in run(capfd, "recheck fed.proof.zip")[1]
    assert not found.proved
    assert not found.vacuous
    assert found.safe.verdict == found.fed.verdict == proved
    assert proved in found.tables()[1].csv()


def test_a_sheet_of_a_scene_that_scatters(capfd):
    """Margins are of the scene without its scatter, and so is the verdict on the goal."""
    for effect in ("gaussian", "bounded"):
        line = f"robustness {written(**SPREAD | {'effects': {'spread': effect}})} -o {effect} {SHEET}"
        out, record = both(capfd, line, code=1)
        assert "In the scene without its scatter this holds, proved." in out
        assert WITHOUT in out
        assert record["holds"] is None


@pytest.mark.sweep
def test_a_feeder_that_feeds_nothing_says_so_first(capfd):
    """The end is beyond all that the throws reach: 23.4 in on side 2, known_answers.md; most stay on the arm."""
    file = written(with_cavity(position="26 in"))
    out = prints(capfd, "feed", file, "--trials", "20", "--no-level", "-o", "fed", code=1)
    assert out.splitlines()[0].startswith("paper-designed: nothing is fed, none of 20 parts thrown")
    assert "throws until" not in out
    record = json.loads(Path("fed/feeding.json").read_text(encoding="utf-8"))
    assert record["vacuous"] is True
    assert sum(record["trials"]["counts"][name] for name in ("right", "wrong", "wall")) == 0


def test_the_explorer_names_it():
    pytest.importorskip("panel")
    from limitsets.face.explorer.page import ScenePage

    page = ScenePage(scene(world=RUBBED))
    assert f"{LEFT_OUT}; not audited" in page._proved.object
    assert f"{LEFT_OUT}; not audited" in page._estimated.object
    page.close()


# ----------------------------------------------------------------
# `limitsets audit`: words, JSON, files, exit codes.


def test_table_says_what_breaks_where_and_how_often(capfd):
    out, record = both(capfd, "audit paper-initial")
    rows = {line.split()[0]: line for line in out.splitlines() if line.split()[:1]}
    assert "BREAKS: 8.3 % of jogs" in rows["roll"]
    assert "breaks on side 1" in rows["roll"]
    assert "holds (proved)" in rows["landing"]
    assert "breaks on side 0" in rows["landing"]
    assert "Called for on the limit set: pivot, roll." in out
    assert "Give friction, restitution, stroke, scatter in [world]" in out
    assert not any("…" in line for line in out.splitlines())
    assert not names_in()
    assert set(record[0]) == documented("audit")
    assert record == json.loads(json.dumps(ls.audit("paper-initial").to_json()))


def test_files(capfd):
    out = prints(capfd, "audit paper-designed -o deep/down")
    assert out.splitlines()[-1] == "report: deep/down/audit.md"
    folder = Path("deep/down")
    assert names_in(folder) == {"audit.md", "audit.json", "part.png", "audit.png"}
    assert (folder / "audit.png").read_bytes().startswith(b"\x89PNG")
    page = (folder / "audit.md").read_text(encoding="utf-8")
    assert re.findall(r"!\[.*?\]\((.*?)\)", page) == ["part.png", "audit.png"]
    assert "| left corner lands first | 0 | 20.1516 to 28.0000 |" in page
    assert "| left corner lands first | 1 | 26.4235 to 28.0000 |" in page
    assert json.loads((folder / "audit.json").read_text())[0]["effect"] == "release"


@pytest.mark.sweep
def test_analyse_resolves_auto_and_says_so(capfd):
    auto = written("paper-initial", effects={"auto": True})
    record = json_of(capfd, f"analyse {auto} -o found")
    assert "roll" in record["effects"]["switched_on"]
    assert record["effects"]["left_out"]["slip"] == "world.friction is missing: cannot tell"
    assert record["scene"]["effects"]["roll"] is True
    page = Path("found/report.md").read_text(encoding="utf-8")
    assert "The audit of the limit set switched on: roll" in page
    assert "slip: world.friction is missing" in page
    assert "stays where it is until the next throw" not in page  # that is what rolling lifts
    prints(capfd, f"throw {auto} --x 18 --side 1")
